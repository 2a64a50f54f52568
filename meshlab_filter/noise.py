"""How noisy a cloud is, measured against the distance between its points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .normals import estimate_normals, unit_normals
from .validation import FloatArray, check_points

# Neighbours a quadratic height field of six coefficients is fitted to.
_NEIGHBOURS = 24
_COEFFICIENTS = 6
# Points the figure is the median of; more change it in the third digit.
_SAMPLE = 2000
# Clean scans have up to 0.06; at 20 % of the points, costs of smoothed positions are still worse at
# 0.1 and better from 0.2 on.
_NOISY = 0.15


def noise_level(points: npt.ArrayLike, normals: npt.ArrayLike | None = None) -> float:
    """Measure the scatter of points off a smooth surface, in units of their spacing.

    At up to 2000 points spread through the cloud a quadratic height field is fitted to the 24
    nearest neighbours; the figure is the median over these points of the residual's standard
    deviation over the mean distance to the 6 nearest.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Normals of any length and sign; estimated where not given.

    Returns
    -------
    float
        Dimensionless; 0 for clouds of less than 25 points, which cannot tell noise from shape.

    Raises
    ------
    InvalidCloudError
        If the points or normals are not usable.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(30.0), np.arange(30.0)))
    >>> z = 0.3 * np.random.default_rng(0).normal(size=900)
    >>> up = np.tile([0.0, 0.0, 1.0], (900, 1))
    >>> round(noise_level(np.column_stack([x, y, z]), up), 1)
    0.2
    """
    from scipy.spatial import cKDTree

    cloud = check_points(points)
    if len(cloud) <= _NEIGHBOURS:
        return 0.0
    cloud = cloud - cloud.mean(axis=0)
    if normals is None:
        directions = estimate_normals(cloud, orient=False)
    else:
        directions = unit_normals(normals, cloud)
    chosen = np.random.default_rng(0).permutation(len(cloud))[:_SAMPLE]
    # For so few questions a quickly built tree is better than a quick one.
    tree = cKDTree(cloud, compact_nodes=False, balanced_tree=False)
    far, near = tree.query(cloud[chosen], _NEIGHBOURS + 1, workers=-1)
    spacing = far[:, 1:7].mean(axis=1)
    apart = spacing > 0
    if not apart.any():
        return 0.0
    spacing, near, normal = spacing[apart], near[apart], directions[chosen][apart]
    d = (cloud[near] - cloud[chosen][apart, None]) / spacing[:, None, None]
    residual = _residuals(d, normal)
    return float(np.median(residual))


def suggest_noisy(
    points: npt.ArrayLike, normals: npt.ArrayLike | None = None
) -> tuple[bool, float]:
    """Say whether the adaptive method should judge a cloud by its smoothed positions.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Normals of any length and sign; estimated where not given.

    Returns
    -------
    noisy : bool
        Whether the noise level is above 0.15.
    level : float
        What :func:`noise_level` measured.

    Raises
    ------
    InvalidCloudError
        If the points or normals are not usable.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    >>> suggest_noisy(np.column_stack([x, y, 0 * x]))
    (False, 0.0)
    """
    level = noise_level(points, normals)
    return bool(level > _NOISY), level


def advice(info: Mapping[str, Any]) -> str | None:
    """Say in a sentence what a ranking's ``info`` suggests about noise, if it does.

    Parameters
    ----------
    info : mapping
        Of a :class:`~meshlab_filter.methods.ranking.Ranking`.

    Returns
    -------
    str or None

    Examples
    --------
    >>> advice({"noise_level": 0.31, "noisy_suggested": True})
    'The points scatter by 0.31 of their spacing: --set noisy=true may keep more of the shape.'
    >>> advice({"rounds": 3})
    """
    if not info.get("noisy_suggested"):
        return None
    return (
        f"The points scatter by {info['noise_level']:.2f} of their spacing: --set noisy=true may "
        "keep more of the shape."
    )


def _residuals(d: FloatArray, normal: FloatArray) -> FloatArray:
    """Fit heights d · normal by a quadratic of the tangent coordinates; return what scatters."""
    from .witnesses import tangent_frames

    u, v = tangent_frames(np.ascontiguousarray(normal.T))
    a = np.einsum("nkj,jn->nk", d, u)
    b = np.einsum("nkj,jn->nk", d, v)
    h = np.einsum("nkj,nj->nk", d, normal)
    design = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=2)
    left, singular, _ = np.linalg.svd(design, full_matrices=False)
    # Directions without extent, as where points lie on lines, take no part in the fit.
    used = singular > 1e-9 * singular[:, :1]
    fitted = np.einsum("nki,ni->nk", left, np.einsum("nki,nk->ni", left, h) * used)
    freedom = max(d.shape[1] - _COEFFICIENTS, 1)
    return np.asarray(np.sqrt(((h - fitted) ** 2).sum(axis=1) / freedom))
