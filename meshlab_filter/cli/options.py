"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


class Amount(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """A whole number (int) or a percentage (float share)."""

    name = "number|percent"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> int | float:
        """Parse the text."""
        from ..amounts import parse_amount

        if not isinstance(value, str):
            return value  # type: ignore[no-any-return]
        return parse_amount(value, name=(param.opts[0] if param else "amount"))


AMOUNT = Amount()


def method_options(function: F) -> F:
    """Add the options that say how a cloud is simplified."""
    for option in reversed(
        (
            click.option("--method", metavar="NAME", help="How to choose the points; see "
                         "'meshlab-filter methods'. Default: adaptive with --count or --keep, "
                         "else cluster-entropy, the rule of the paper."),
            click.option("--count", type=int, metavar="M", help="Keep M points."),
            click.option("--keep", type=AMOUNT, metavar="SHARE", help="Keep this share of the "
                         "points, such as 10%."),
            click.option("--clusters", type=int, metavar="C", help="cluster-entropy: number of "
                         "k-means clusters. Default: 5 % of the points."),
            click.option("--delete", type=AMOUNT, metavar="N|SHARE", help="cluster-entropy: how "
                         "many clusters to delete, such as 60 or 7.4%. Default: 7.4%."),
            click.option("-k", "--neighbors", "k", type=int, metavar="K", help="cluster-entropy: "
                         "neighbours of the density estimate. Default: the rounded square root of "
                         "the cluster's size."),
            click.option("--init", help="cluster-entropy: start of k-means: random, k-means++ or "
                         "spread. Default: random."),
            click.option("--keep-representative", is_flag=True, default=None, help="cluster-"
                         "entropy: leave one point of each deleted cluster."),
            click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE", help="Set "
                         "any other parameter of the method; may be repeated."),
            click.option("--seed", type=int, default=0, show_default=True, help="Same input, "
                         "parameters and seed: same output."),
            click.option("--drop-invalid", is_flag=True, help="Leave out points with NaN or "
                         "infinite coordinates."),
            click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors."),
        )
    ):  # fmt: skip
        function = option(function)
    return function


def method_arguments(
    *, method: str | None, keep: int | float | None, count: int | None,
    assignments: tuple[str, ...], **options: Any,
) -> dict[str, Any]:  # fmt: skip
    """Turn the options into keyword arguments of :func:`meshlab_filter.simplify`."""
    from ..methods.registry import get_method
    from ..simplification import CLUSTER_METHOD, COUNT_METHOD

    asked = {name: value for name, value in options.items() if value is not None}
    if isinstance(keep, int):
        raise click.BadParameter(
            f"must be a percentage such as 10%; for a number of points use --count. Given: {keep}.",
            param_hint="--keep",
        )
    if assignments:
        wants_points = count is not None or keep is not None
        chosen = method or (COUNT_METHOD if wants_points and not asked else CLUSTER_METHOD)
        asked |= get_method(chosen).parse(assignments)
    return {"method": method, "keep": keep, "count": count, **asked}


def preset_options(function: F) -> F:
    """Add the options that read and write presets."""
    for option in (
        click.option("--save-preset", type=click.Path(path_type=Path), metavar="FILE.mlx",
                     help="Write down what was done, as a preset that does it again."),
        click.option("--preset", "-p", metavar="NAME|FILE",
                     help="Rank and filter as a preset says, or any filter script of MeshLab; see "
                     "'meshlab-filter presets'."),
    ):  # fmt: skip
        function = option(function)
    return function


def given_options(ctx: click.Context) -> set[str]:
    """Return the names of the options that the user has given."""
    default = click.core.ParameterSource.DEFAULT
    return {name for name in ctx.params if ctx.get_parameter_source(name) is not default}


def flags_of(ctx: click.Context, names: set[str]) -> list[str]:
    """Return how options are written on the command line, in the order of the command's help."""
    return [
        max(param.opts, key=len)
        for param in ctx.command.params
        if isinstance(param, click.Option) and param.name in names
    ]


def as_arguments(ctx: click.Context, *, leave_out: tuple[str, ...]) -> list[str]:
    """Return the options the user has given, as they stand on a command line."""
    arguments: list[str] = []
    given = given_options(ctx)
    for param in ctx.command.params:
        name = param.name or ""
        if not isinstance(param, click.Option) or name in leave_out or name not in given:
            continue
        value = ctx.params[name]
        flag = max(param.opts, key=len)
        if param.is_flag:
            arguments += [flag] if value else []
        elif param.multiple:
            arguments += [text for each in value for text in (flag, str(each))]
        elif isinstance(value, float) and isinstance(param.type, Amount):
            arguments += [flag, f"{100 * value!r}%"]
        else:
            arguments += [flag, str(value)]
    return arguments
