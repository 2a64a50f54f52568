"""Entry point of ``meshlab-filter`` and ``python -m meshlab_filter``."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line; whatever may need MeshLab runs in a process of its own."""
    from .supervisor import is_worker, supervise, work

    arguments = sys.argv[1:]
    if is_worker():
        sys.exit(work(arguments))
    helpful = not arguments or not {"-h", "--help", "--version"}.isdisjoint(arguments)
    if helpful or "_MESHLAB_FILTER_COMPLETE" in os.environ:
        from .cli.main import invoke

        sys.exit(invoke(arguments))
    sys.exit(supervise(arguments))


if __name__ == "__main__":
    main()
