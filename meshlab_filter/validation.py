"""Checks of what users hand in; each failure is one sentence with what was given."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .checks import check_choice as check_choice
from .checks import check_integer as check_integer
from .checks import check_number as check_number
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


def check_switch(value: Any, *, name: str) -> bool:
    """Return the value if it is true or false.

    Raises
    ------
    InvalidParameterError
        If it is anything else.

    Examples
    --------
    >>> check_switch(np.bool_(True), name="noisy")
    True
    """
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidParameterError(f"Invalid {name}. Must be true or false. Given: {value!r}.")
    return bool(value)
