"""Checks of what users hand in; each failure is one sentence with what was given."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidCloudError, InvalidParameterError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def check_points(points: npt.ArrayLike, *, minimum: int = 1, name: str = "points") -> FloatArray:
    """Return points as a C-ordered float64 array of shape (N, 3), or say why that cannot be.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    minimum : int
        The fewest points that make sense for the caller.
    name : str
        How the message calls the array.

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64

    Raises
    ------
    InvalidCloudError
        If the shape is not (N, 3), a coordinate is not finite or there are fewer than ``minimum``.

    Examples
    --------
    >>> check_points([[0, 0, 0], [1, 2, 3]]).shape
    (2, 3)
    """
    try:
        array = np.ascontiguousarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidCloudError(
            f"Invalid {name}. Must be an array of numbers of shape (N, 3). Given: {error}."
        ) from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidCloudError(
            f"Invalid {name}. Must have shape (N, 3). Given: shape {array.shape}."
        )
    if len(array) < minimum:
        raise InvalidCloudError(f"Too few {name}. Must be at least {minimum}. Given: {len(array)}.")
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        first = int(np.flatnonzero(~finite)[0])
        raise InvalidCloudError(
            f"Invalid {name}. Every coordinate must be finite; drop the others first "
            f"(--drop-invalid on the command line). Given: {int((~finite).sum())} of "
            f"{len(array)} with NaN or infinity, the first at index {first}."
        )
    return array


def check_integer(
    value: Any, *, name: str, minimum: int | None = None, maximum: int | None = None
) -> int:
    """Return a whole number within the bounds (both included), or say what was wrong with it.

    Raises
    ------
    InvalidParameterError
        If the value is not a whole number or lies outside the bounds.

    Examples
    --------
    >>> check_integer(7, name="clusters", minimum=1)
    7
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise InvalidParameterError(f"Invalid {name}. Must be a whole number. Given: {value!r}.")
    _check_bounds(int(value), name=name, minimum=minimum, maximum=maximum)
    return int(value)


def check_number(
    value: Any, *, name: str, minimum: float | None = None, maximum: float | None = None
) -> float:
    """Return a finite number within the bounds (both included), or say what was wrong with it.

    Raises
    ------
    InvalidParameterError
        If the value is not a finite number or lies outside the bounds.

    Examples
    --------
    >>> check_number(0.4, name="evenness", minimum=0)
    0.4
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise InvalidParameterError(f"Invalid {name}. Must be a finite number. Given: {value!r}.")
    _check_bounds(float(value), name=name, minimum=minimum, maximum=maximum)
    return float(value)


def _check_bounds(value: float, *, name: str, minimum: float | None, maximum: float | None) -> None:
    if minimum is not None and value < minimum:
        raise InvalidParameterError(f"Invalid {name}. Must be at least {minimum}. Given: {value}.")
    if maximum is not None and value > maximum:
        raise InvalidParameterError(f"Invalid {name}. Must be at most {maximum}. Given: {value}.")


def check_choice(value: Any, *, name: str, choices: tuple[str, ...]) -> str:
    """Return the value if it is one of the choices.

    Raises
    ------
    InvalidParameterError
        If it is not, naming the choices.

    Examples
    --------
    >>> check_choice("random", name="init", choices=("random", "spread"))
    'random'
    """
    if value not in choices:
        raise InvalidParameterError(
            f"Invalid {name}. Must be one of {', '.join(choices)}. Given: {value!r}."
        )
    return str(value)
