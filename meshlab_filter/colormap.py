"""Colours for values, readable by colour-blind people: the cividis map."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .validation import FloatArray

#: Sixteen steps of cividis (Nuñez, Anderton and Renslow 2018, PLOS ONE 13(7)), between which
#: colours are interpolated.
_CIVIDIS = np.array(
    [
        [0, 34, 78], [0, 47, 108], [22, 58, 111], [45, 69, 109], [64, 81, 108], [80, 92, 109],
        [95, 104, 111], [110, 115, 115], [125, 127, 120], [140, 139, 121], [157, 152, 118],
        [174, 165, 112], [192, 178, 104], [211, 193, 92], [230, 208, 75], [254, 232, 56],
    ]
) / 255  # fmt: skip


def colorize(values: npt.ArrayLike, *, low: float, high: float) -> FloatArray:
    """Return a colour for every value: dark blue at ``low`` and below, yellow at ``high``.

    Parameters
    ----------
    values : array_like, shape (N,)
    low, high : float
        The ends of the scale, in the unit of the values.

    Returns
    -------
    numpy.ndarray, shape (N, 4), float64
        Red, green, blue, alpha in 0 … 1; alpha is 1.

    Examples
    --------
    >>> colorize([0.0, 1.0], low=0.0, high=1.0)[1].round(2)
    array([1.  , 0.91, 0.22, 1.  ])
    """
    array = np.asarray(values, dtype=np.float64)
    span = high - low
    position = np.clip((array - low) / span, 0, 1) if span > 0 else np.zeros(len(array))
    steps = np.linspace(0, 1, len(_CIVIDIS))
    channels = [np.interp(position, steps, _CIVIDIS[:, channel]) for channel in range(3)]
    return np.column_stack([*channels, np.ones(len(array))])


def colorscale() -> list[list[object]]:
    """Return the map as pairs of a place in 0 … 1 and a colour, as plotly and CSS write it.

    Examples
    --------
    >>> colorscale()[0]
    [0.0, 'rgb(0, 34, 78)']
    """
    places = np.linspace(0, 1, len(_CIVIDIS)).round(4).tolist()
    colors = np.rint(_CIVIDIS * 255).astype(int).tolist()
    return [[place, f"rgb({r}, {g}, {b})"] for place, (r, g, b) in zip(places, colors)]
