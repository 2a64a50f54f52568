"""Work over pieces of arrays on all cores, with results that do not depend on how many."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_all(function: Callable[[Task], Result], tasks: Iterable[Task]) -> list[Result]:
    """Call the function once for each task, on as many threads as there are cores.

    Parameters
    ----------
    function : callable
        Must write nothing that another task reads or writes; numpy and scipy let go of the
        interpreter lock while they compute.
    tasks : iterable
        What it is called with.

    Returns
    -------
    list
        What it returned, in the order of the tasks.

    Examples
    --------
    >>> run_all(len, ["a", "bc"])
    [1, 2]
    """
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        return list(executor.map(function, tasks))


def slices(size: int, step: int) -> list[slice]:
    """Return slices of at most ``step`` that cover 0 … size − 1 in order.

    Examples
    --------
    >>> slices(5, 2)
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    return [slice(begin, min(begin + step, size)) for begin in range(0, size, step)]
