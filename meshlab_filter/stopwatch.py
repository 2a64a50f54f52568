"""Seconds that each stage of a run took."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Stopwatch:
    """Times named stages and announces each as it begins.

    Parameters
    ----------
    announce : callable
        Called with the name of a stage when it begins.

    Attributes
    ----------
    times : dict of str to float
        Wall-clock seconds of each stage so far.

    Examples
    --------
    >>> watch = Stopwatch(print)
    >>> with watch("read"):
    ...     pass
    read
    >>> list(watch.times)
    ['read']
    """

    def __init__(self, announce: Callable[[str], object]) -> None:
        self.announce = announce
        self.times: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time what happens within."""
        self.announce(stage)
        begin = time.perf_counter()
        yield
        self.times[stage] = round(time.perf_counter() - begin, 3)
