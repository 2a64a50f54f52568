"""The rank every method gives to every point, and how a cloud is cut out of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..validation import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """What a method says of each point: the simplified cloud is the points of high rank.

    Attributes
    ----------
    rank : numpy.ndarray, shape (N,), int64
        Non-negative; points of lower rank go first. Ties go together. A method that orders
        single points gives each its own rank, 0 … N − 1, so that ``rank >= N - M`` keeps M.
    threshold : int
        The method's own cut for the parameters given: the cloud is ``rank >= threshold``.
    labels : numpy.ndarray, shape (N,), int64, or None
        The cluster of each point, for methods that make clusters.
    entropy : numpy.ndarray, shape (C,), float64, or None
        The entropy of each cluster, for methods that compute it; dimensionless (nats).
    info : dict
        Figures about the run, ready for JSON (iterations, clusters, guesses made).
    """

    rank: IntArray
    threshold: int
    labels: IntArray | None = None
    entropy: FloatArray | None = None
    info: dict[str, Any] = field(default_factory=dict)

    @property
    def indices(self) -> IntArray:
        """Indices of the points that stay, ascending: shape (M,), int64."""
        return np.flatnonzero(self.rank >= self.threshold)
