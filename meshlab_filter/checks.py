"""Checks of single parameters; each failure is one sentence with what was given."""

from __future__ import annotations

import math
import numbers
from typing import Any

from .errors import InvalidParameterError


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
