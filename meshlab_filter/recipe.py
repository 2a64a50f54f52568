"""How a cloud is ranked, as the instruction ``<?meshlab-filter …?>`` of a filter script says it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .amounts import parse_amount
from .errors import InvalidParameterError, MeshlabFilterError, PresetError
from .methods.ranking import Ranking
from .methods.registry import Method, get_method
from .mlx import Instruction, format_number
from .simplification import CLUSTER_METHOD, check_cloud
from .validation import FloatArray, check_choice, check_integer

#: What the quality of a vertex holds, the rank itself or its place among all ranks, in words.
QUALITIES = {"rank": "rank", "percent": "rank in per cent"}

#: Whose normals a method gets: the layer's, which MeshLab estimates where there are none; or those
#: of the file, and where it has none, the method's own estimate.
NORMALS = ("layer", "file")

_SHARE = re.compile(r"0\.\d+")
_OWN = ("method", "seed", "count", "quality", "center", "normals", "fit")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """Everything that ranking a cloud needs to know.

    Attributes
    ----------
    method : str
        A name of :data:`meshlab_filter.methods.registry.METHODS`.
    parameters : mapping
        The method's own; ``clusters`` and ``delete`` of "cluster-entropy" may be shares (float).
    count : int or None
        How many points to keep, for methods that cannot rank without.
    seed : int
    quality : str
        "rank": the quality is the rank, 0 first to go. "percent": it is where the middle of the
        rank lies among all ranks, 0 … 100, so that the same cut suits every cloud and
        ``q < 7.4`` deletes 7.4 % of the ranks, rounded to the nearest whole number.
    center : bool
        Move the middle of the bounding box to the origin while the filters run, where single
        precision loses least.
    normals : str
        "layer" or "file", see ``NORMALS``.
    fit : bool
        Fit the surface to the original points once the filters have run
        (:func:`meshlab_filter.fitting.fit_surface`). MeshLab has no filter for it and leaves it
        out.

    Examples
    --------
    >>> recipe = Recipe(parameters={"clusters": 807, "delete": 60})
    >>> dict(recipe.instruction().options)
    {'method': 'cluster-entropy', 'clusters': '807', 'delete': '60', 'seed': '0', 'quality': 'rank'}
    """

    method: str = CLUSTER_METHOD
    parameters: Mapping[str, Any] = field(default_factory=dict)
    count: int | None = None
    seed: int = 0
    quality: str = "rank"
    center: bool = False
    normals: str = "layer"
    fit: bool = False

    @classmethod
    def of(cls, instruction: Instruction, *, source: str = "script") -> Recipe:
        """Read an instruction.

        Raises
        ------
        PresetError
            If an option is unknown, of the wrong type or out of range; names file and line.

        Examples
        --------
        >>> Recipe.of(Instruction({"clusters": "5%", "delete": "60"})).parameters
        {'clusters': 0.05, 'delete': 60}
        """
        options = {name.replace("-", "_"): text for name, text in instruction.options.items()}
        try:
            method = get_method(options.get("method", CLUSTER_METHOD))
            own = {name: options.pop(name) for name in _OWN if name in options}
            return cls(
                method=method.name,
                parameters={name: _value(method, name, text) for name, text in options.items()},
                count=_integer("count", own["count"]) if "count" in own else None,
                seed=_integer("seed", own.get("seed", "0")),
                quality=check_choice(
                    own.get("quality", "rank"), name="quality", choices=tuple(QUALITIES)
                ),
                center=_flag(own, "center"),
                fit=_flag(own, "fit"),
                normals=check_choice(own.get("normals", "layer"), name="normals", choices=NORMALS),
            )
        except PresetError:
            raise
        except MeshlabFilterError as error:
            where = source + (f", line {instruction.line}" if instruction.line else "")
            raise PresetError(f"Invalid instruction in {where}. {error}") from error

    def instruction(self) -> Instruction:
        """Return the instruction that reads back to this recipe."""
        options = {"method": self.method}
        for name, value in self.parameters.items():
            if value is not None:
                options[name.replace("_", "-")] = _text(name, value)
        if self.count is not None:
            options["count"] = str(self.count)
        options["seed"] = str(self.seed)
        options["quality"] = self.quality
        if self.center:
            options["center"] = "true"
        if self.normals != "layer":
            options["normals"] = self.normals
        if self.fit:
            options["fit"] = "true"
        return Instruction(options)

    def rank(
        self,
        points: npt.ArrayLike,
        *,
        normals: npt.ArrayLike | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Ranking:
        """Rank a cloud.

        Parameters
        ----------
        points : array_like, shape (N, 3)
        normals : array_like, shape (N, 3), optional
            For methods that use them; estimated where they are not given.
        progress : callable, optional
            Called with the share done, 0 … 1, by methods that can tell.

        Returns
        -------
        Ranking

        Raises
        ------
        InvalidCloudError, InvalidParameterError
            If the method cannot work on this cloud with these parameters.
        """
        array = check_cloud(points)
        method = get_method(self.method)
        arguments = {name: value for name, value in self.parameters.items() if value is not None}
        if isinstance(arguments.get("clusters"), float):
            arguments["clusters"] = max(1, round(arguments["clusters"] * len(array)))
        function = method.load()
        if progress is not None and "progress" in inspect.signature(function).parameters:
            arguments["progress"] = progress
        return function(array, normals=normals, count=self.count, seed=self.seed, **arguments)

    def values(self, ranking: Ranking) -> FloatArray:
        """Return the quality of every vertex, shape (N,), for the filters that come after.

        Examples
        --------
        >>> ranking = Ranking(rank=np.array([0, 1, 2, 3]), threshold=0)
        >>> Recipe(quality="percent").values(ranking)
        array([12.5, 37.5, 62.5, 87.5])
        """
        rank = ranking.rank.astype(np.float64)
        if self.quality == "rank":
            return rank
        total = len(ranking.entropy) if ranking.entropy is not None else int(rank.max()) + 1
        return 100.0 * (rank + 0.5) / total


def _integer(name: str, text: str) -> int:
    try:
        return check_integer(int(text), name=name, minimum=0)
    except ValueError as error:
        if isinstance(error, InvalidParameterError):
            raise
        raise InvalidParameterError(
            f"Invalid {name}. Must be a whole number. Given: {text!r}."
        ) from None


def _flag(options: Mapping[str, str], name: str) -> bool:
    return check_choice(options.get(name, "false"), name=name, choices=("false", "true")) == "true"


def _value(method: Method, name: str, text: str) -> Any:
    if method.name == CLUSTER_METHOD and name in ("clusters", "delete"):
        if _SHARE.fullmatch(text):
            return float(text)
        return parse_amount(text, name=name)
    (value,) = method.parse([f"{name}={text}"]).values()
    return value


def _text(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if name in ("clusters", "delete") and isinstance(value, float):
        # A share that no percentage stands for to the last digit is written as it is.
        percent = f"{100 * value:.12g}%"
        return percent if parse_amount(percent, name=name) == value else repr(value)
    return format_number(value) if isinstance(value, int | float) else str(value)
