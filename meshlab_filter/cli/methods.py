"""``meshlab-filter methods``."""

from __future__ import annotations

import click


@click.command("methods")
@click.argument("name", required=False)
def command(name: str | None) -> None:
    """List the methods of simplification, or describe the one of that NAME."""
    from ..methods.registry import METHODS, get_method
    from .console import show

    for method in [get_method(name)] if name else METHODS.values():
        exact = "exact number of points" if method.exact_count else "number of points approached"
        seeded = "" if method.seeded else "; not repeatable, MeshLab's sampler has no seed"
        show(
            f"{method.name}: {method.summary}",
            f"    keeps: {method.keeps} ({exact}{seeded})",
            f"    source: {method.source}",
        )
        for parameter in method.parameters if name else ():
            default = "derived" if parameter.default is None else parameter.default
            show(f"    --set {parameter.name}=…  {parameter.meaning} (default: {default})")
