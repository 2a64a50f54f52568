"""How to repeat a run: as a command and as lines of Python."""

from __future__ import annotations

import shlex
from typing import Any

from .methods.registry import get_method

#: Parameters that the command line has options for; the others go through ``--set``.
_OPTIONS = {"clusters": "--clusters", "delete": "--delete", "k": "-k", "init": "--init"}


def command_line(report: dict[str, Any]) -> str:
    """Return the command that does the same again.

    Parameters
    ----------
    report : dict
        What :func:`meshlab_filter.run` returns.

    Returns
    -------
    str
        For a POSIX shell, names quoted.

    Examples
    --------
    >>> parameters = {"method": "cluster-entropy", "asked": None, "delete": 0.074, "seed": 0,
    ...               "surface": "ball-pivoting", "drop_invalid": False}
    >>> command_line({"input": {"path": "my scan.ply"}, "parameters": parameters})
    "meshlab-filter run 'my scan.ply' --method cluster-entropy --delete 7.4% --seed 0"
    """
    given = report["parameters"]
    words = ["meshlab-filter", "run", report["input"]["path"], "--method", given["method"]]
    if given["asked"] is not None:
        words += ["--count", str(given["asked"])]
    for name, value in _own(given).items():
        if name == "keep_representative":
            words.append("--keep-representative")
        elif name in _OPTIONS:
            share = name == "delete" and isinstance(value, float)
            words += [_OPTIONS[name], f"{100 * value:.12g}%" if share else str(value)]
        else:
            words += ["--set", f"{name}={value}"]
    words += ["--seed", str(given["seed"])]
    if given["surface"] != "ball-pivoting":
        words += ["--surface", given["surface"]]
    if given["drop_invalid"]:
        words.append("--drop-invalid")
    return shlex.join(words)


def python_lines(report: dict[str, Any]) -> str:
    """Return the lines of Python that do the same again.

    Parameters
    ----------
    report : dict
        What :func:`meshlab_filter.run` returns.

    Returns
    -------
    str

    Examples
    --------
    >>> parameters = {"method": "adaptive", "asked": 500, "evenness": 0.4, "seed": 0,
    ...               "surface": "ball-pivoting", "drop_invalid": False}
    >>> print(python_lines({"input": {"path": "scan.ply"}, "parameters": parameters}))
    import meshlab_filter
    <BLANKLINE>
    report = meshlab_filter.run(
        'scan.ply',
        'result',
        method='adaptive',
        count=500,
        seed=0,
    )
    """
    given = report["parameters"]
    arguments = {"method": given["method"]}
    if given["asked"] is not None:
        arguments["count"] = given["asked"]
    arguments |= {**_own(given), "seed": given["seed"]}
    if given["surface"] != "ball-pivoting":
        arguments["surface"] = given["surface"]
    if given["drop_invalid"]:
        arguments["drop_invalid"] = True
    lines = [repr(report["input"]["path"]), "'result'"]
    lines += [f"{name}={value!r}" for name, value in arguments.items()]
    body = "".join(f"    {line},\n" for line in lines)
    return f"import meshlab_filter\n\nreport = meshlab_filter.run(\n{body})"


def _own(given: dict[str, Any]) -> dict[str, Any]:
    """Return the method's own parameters that differ from their defaults."""
    return {
        parameter.name: given[parameter.name]
        for parameter in get_method(given["method"]).parameters
        if given.get(parameter.name, parameter.default) != parameter.default
    }
