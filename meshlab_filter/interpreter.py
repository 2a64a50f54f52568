"""Starting this Python again, with the same packages."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def python_command(call: str, arguments: Sequence[str] = ()) -> list[str]:
    """Return the command that calls a function of this package in a process of its own.

    ``python -m`` would look for modules in the folder the user is in first, where a scan's
    ``random.py`` can lie; the new process looks where this one does.

    Parameters
    ----------
    call : str
        Module and function, such as "meshlab_filter.__main__:main".
    arguments : sequence of str
        What the function finds in ``sys.argv[1:]``.

    Returns
    -------
    list of str

    Examples
    --------
    >>> import subprocess
    >>> command = python_command("meshlab_filter.__main__:main", ["--version"])
    >>> subprocess.run(command, capture_output=True, check=True).stdout[:14]
    b'meshlab-filter'
    """
    module, function = call.split(":")
    code = f"import sys; sys.path[:] = {sys.path!r}; from {module} import {function}; {function}()"
    return [sys.executable, "-c", code, *arguments]
