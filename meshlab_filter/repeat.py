"""How to repeat a run: as a command, as lines of Python and as a preset."""

from __future__ import annotations

import shlex
from typing import Any

from .methods.registry import get_method
from .presets import PRESETS
from .recording import of_report

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
    words = ["meshlab-filter", "run", report["input"]["path"]]
    if given.get("preset"):
        words += ["--preset", _preset(given)]
        words += ["--seed", str(given["seed"])] if "seed" in given else []
        words += ["--drop-invalid"] if given["drop_invalid"] else []
        return shlex.join(words)
    collapsed = given.get("order") == "surface-first"
    if not collapsed:
        words += ["--method", given["method"]]
    if given["asked"] is not None:
        words += ["--count", str(given["asked"])]
    for name, value in ({} if collapsed else _own(given)).items():
        if name == "keep_representative":
            words.append("--keep-representative")
        elif name in _OPTIONS:
            share = name == "delete" and isinstance(value, float)
            words += [_OPTIONS[name], f"{100 * value:.12g}%" if share else str(value)]
        else:
            words += ["--set", f"{name}={value}"]
    if collapsed:
        words += ["--order", "surface-first", *(["--move"] if given["move"] else [])]
    else:
        words += ["--seed", str(given["seed"])]
    if given["surface"] != "ball-pivoting":
        words += ["--surface", given["surface"]]
    if _fit_changed(given):
        words.append("--fit" if given["fit"] else "--no-fit")
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
    function, places = "meshlab_filter.run", [report["input"]["path"], "result"]
    arguments: dict[str, Any] = {}
    if given.get("preset"):
        function, places = "run_preset", [*places, _preset(given)]
        arguments |= {"seed": given["seed"]} if "seed" in given else {}
        arguments |= {"drop_invalid": True} if given["drop_invalid"] else {}
        return _call("from meshlab_filter.scripted import run_preset", function, places, arguments)
    collapsed = given.get("order") == "surface-first"
    if not collapsed:
        arguments["method"] = given["method"]
    if given["asked"] is not None:
        arguments["count"] = given["asked"]
    if collapsed:
        arguments |= {"order": "surface-first", "move": given["move"]}
    else:
        arguments |= {**_own(given), "seed": given["seed"]}
    if given["surface"] != "ball-pivoting":
        arguments["surface"] = given["surface"]
    if _fit_changed(given):
        arguments["fit"] = given["fit"]
    if given["drop_invalid"]:
        arguments["drop_invalid"] = True
    return _call("import meshlab_filter", function, places, arguments)


def preset_text(report: dict[str, Any]) -> str | None:
    """Return the filter script that does the same again, where there is one to write.

    Parameters
    ----------
    report : dict
        What :func:`meshlab_filter.run` returns.

    Returns
    -------
    str or None
        The text of an .mlx file for MeshLab and ``meshlab-filter run --preset``; None if a preset
        was run, or the surface came first.
    """
    given = report["parameters"]
    if given.get("preset") or given.get("order") == "surface-first":
        return None
    return of_report(report).to_xml()


def _call(imports: str, function: str, places: list[str], arguments: dict[str, Any]) -> str:
    lines = [*map(repr, places), *(f"{name}={value!r}" for name, value in arguments.items())]
    body = "".join(f"    {line},\n" for line in lines)
    return f"{imports}\n\nreport = {function}(\n{body})"


def _preset(given: dict[str, Any]) -> str:
    """Return the preset as it is asked for: one of ours by its name, any other by its file."""
    name = str(given["preset"])
    return name.removesuffix(".mlx") if name.removesuffix(".mlx") in PRESETS else name


def _fit_changed(given: dict[str, Any]) -> bool:
    """Tell whether the fitting of edges is not what the kind of surface has by default."""
    fit = given.get("fit")
    return fit is not None and fit != (given["surface"] == "ball-pivoting")


def _own(given: dict[str, Any]) -> dict[str, Any]:
    """Return the method's own parameters that differ from their defaults."""
    return {
        parameter.name: given[parameter.name]
        for parameter in get_method(given["method"]).parameters
        if given.get(parameter.name, parameter.default) != parameter.default
    }
