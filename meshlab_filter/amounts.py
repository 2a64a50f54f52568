"""Amounts as users write them: 60, 7.4%, 10%."""

from __future__ import annotations

import math
from typing import Any

from .checks import check_integer, check_number
from .errors import InvalidParameterError


def parse_amount(text: str, *, name: str) -> int | float:
    """Return a whole number as int, a percentage as a share.

    Parameters
    ----------
    text : str
        Such as "60" or "7.4%".
    name : str
        How the message calls it.

    Returns
    -------
    int or float
        An int is a number of things, a float a share in 0 … 1.

    Raises
    ------
    InvalidParameterError
        If it is neither.

    Examples
    --------
    >>> parse_amount("60", name="delete"), parse_amount("12.5%", name="delete")
    (60, 0.125)
    """
    text = text.strip()
    try:
        if text.endswith("%"):
            share = float(text[:-1]) / 100
            if math.isfinite(share):
                return check_number(share, name=name, minimum=0, maximum=1)
        else:
            return check_integer(int(text), name=name, minimum=0)
    except ValueError as error:
        if isinstance(error, InvalidParameterError):
            raise InvalidParameterError(
                f"Invalid {name}. Must be a whole number from 0, or a percentage from 0% to 100%. "
                f"Given: {text!r}."
            ) from None
    raise InvalidParameterError(
        f"Invalid {name}. Must be a whole number such as 60 or a percentage such as 7.4%. "
        f"Given: {text!r}."
    )


def parse_count(text: str, *, name: str) -> int:
    """Return a whole number from 1.

    Raises
    ------
    InvalidParameterError
        If it is none.

    Examples
    --------
    >>> parse_count("16", name="tiles")
    16
    """
    if not text.strip().isascii() or not text.strip().isdigit():
        raise InvalidParameterError(f"Invalid {name}. Must be a whole number. Given: {text!r}.")
    return check_integer(int(text), name=name, minimum=1)


def points_to_keep(
    total: int, *, count: Any = None, keep: Any = None, name: str = "points"
) -> int | None:
    """Return how many of ``total`` points are asked for, None if nothing is asked.

    Parameters
    ----------
    total : int
        Points there are.
    count : int, optional
        The number itself.
    keep : float, optional
        The share, above 0 and up to 1, rounded to the nearest whole number of points.
    name : str
        How the message calls them.

    Returns
    -------
    int or None

    Raises
    ------
    InvalidParameterError
        If both are given, or the number is not in 1 … ``total``.

    Examples
    --------
    >>> points_to_keep(28088, keep=0.1)
    2809
    """
    if count is not None and keep is not None:
        raise InvalidParameterError(
            f"Only one of count and keep can be asked for. Given: count={count}, keep={keep}."
        )
    if keep is not None:
        if isinstance(keep, int) and not isinstance(keep, bool) and keep != 1:
            raise InvalidParameterError(
                f"Invalid keep. Must be a share such as 0.1, or 10% on the command line; for a "
                f"number of {name} use count. Given: {keep}."
            )
        share = check_number(keep, name="keep", minimum=0, maximum=1)
        count = round(share * total)
        if count < 1:
            raise InvalidParameterError(
                f"Invalid keep. Must leave at least one of the {total} {name}. Given: {keep}."
            )
    if count is None:
        return None
    return check_integer(count, name="count", minimum=1, maximum=total)
