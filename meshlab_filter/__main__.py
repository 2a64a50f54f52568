"""Entry point of ``meshlab-filter`` and ``python -m meshlab_filter``."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line; whatever may need MeshLab runs in a process of its own."""
    _open_streams()
    from .supervisor import is_worker, supervise, work

    arguments = sys.argv[1:]
    if is_worker():
        sys.exit(work(arguments))
    helpful = not arguments or not {"-h", "--help", "--version"}.isdisjoint(arguments)
    if helpful or "_MESHLAB_FILTER_COMPLETE" in os.environ:
        from .cli.main import invoke

        code = invoke(arguments)
        _flush()
        sys.exit(code)
    sys.exit(supervise(arguments))


def _open_streams() -> None:
    """Lead streams that came closed to nowhere, before another file gets their number."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _flush() -> None:
    """Write out what is left for standard output; if that fails, do not fail again at the end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    except AttributeError:
        # Standard output came closed.
        return


if __name__ == "__main__":
    main()
