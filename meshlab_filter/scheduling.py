"""Tasks on Dask: a client, the tasks of all tiles, and what to say when workers are lost."""

from __future__ import annotations

import importlib
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from .errors import InvalidParameterError, MeshlabFilterError, SchedulerError
from .validation import IntArray, check_integer

SCHEDULERS = ("threads", "processes")


def run_tasks(
    client: Any,
    task: Callable[..., int],
    folder: Path,
    numbers: IntArray,
    parameters: dict[str, Any],
    progress: Callable[[float], object],
) -> list[int]:
    """Run a task for each tile and return what they return, in the order they end.

    Parameters
    ----------
    client : distributed.Client
    task : callable
        Called with the folder, the number of a tile and the parameters.
    folder : Path
        The folder of tiles.
    numbers : numpy.ndarray, int
        Which tiles.
    parameters : dict
        The same for all tiles.
    progress : callable
        Called with the share of the tiles that is done.

    Raises
    ------
    SchedulerError
        If the scheduler goes away or workers keep dying; errors of the tasks come through.
    """
    futures = client.map(
        task, [str(folder)] * len(numbers), numbers.tolist(), parameters=parameters, pure=False
    )
    results = []
    with lost_scheduler():
        try:
            for future in _import_distributed().as_completed(futures):
                results.append(int(future.result()))
                progress(len(results) / len(futures))
        finally:
            if client.status == "running":
                client.cancel(futures)
    return results


@contextmanager
def lost_scheduler() -> Iterator[None]:
    """Turn what Dask raises when workers or the scheduler are lost into one sentence."""
    distributed = _import_distributed()
    try:
        yield
    except MeshlabFilterError:
        raise
    except distributed.KilledWorker as error:
        raise SchedulerError(
            "Workers died again and again on the same tile, mostly for want of memory; take more "
            f"tiles or fewer workers. Given: {error.args[0]}."
        ) from error
    except MemoryError as error:
        raise SchedulerError(
            "A tile did not fit into a worker's memory; take more tiles."
        ) from error
    except (OSError, TimeoutError, CancelledError) as error:
        raise SchedulerError(
            "The Dask scheduler went away; start the command again to go on with the finished "
            f"tiles. Given: {type(error).__name__}."
        ) from error


def _import_distributed() -> Any:
    """Return Dask's distributed, or say how to install it."""
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise InvalidParameterError(
            'Tiles need Dask; install it with: pip install "meshlab-filter[distributed]".'
        ) from error


@contextmanager
def connect(
    scheduler: Any, workers: int | None, announce: Callable[[str], object]
) -> Iterator[Any]:
    """Give a Dask client, of a cluster on this machine unless an address or client is given.

    Parameters
    ----------
    scheduler : {"threads", "processes"}, address, distributed.Client or None
        None is "threads".
    workers : int or None
        Threads or processes on this machine; as many as cores by default.
    announce : callable
        Called with the address of the dashboard.

    Raises
    ------
    InvalidParameterError
        If Dask is not installed or the scheduler is none of these.
    SchedulerError
        If nobody answers at the address.
    """
    distributed = _import_distributed()
    workers = check_integer(workers or os.cpu_count() or 1, name="workers", minimum=1)
    if isinstance(scheduler, distributed.Client):
        yield scheduler
        return
    scheduler = scheduler or "threads"
    with ExitStack() as stack:
        if scheduler in SCHEDULERS:
            processes = scheduler == "processes"
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=workers if processes else 1,
                    threads_per_worker=1 if processes else workers,
                    processes=processes,
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.ERROR,
                )
            )
            client = stack.enter_context(distributed.Client(cluster))
            # Dask names the machine's outer address even where it listens on the inner one only.
            announce(f"http://127.0.0.1:{urlsplit(client.dashboard_link).port}/status")
        elif "://" in str(scheduler):
            try:
                client = stack.enter_context(distributed.Client(str(scheduler), timeout="10s"))
            except (OSError, TimeoutError, ValueError) as error:
                raise SchedulerError(
                    f"No Dask scheduler answers there. Given: {scheduler}."
                ) from error
            announce(client.dashboard_link)
        else:
            raise InvalidParameterError(
                f"Invalid scheduler. Must be threads, processes or an address such as "
                f"tcp://host:8786. Given: {scheduler!r}."
            )
        yield client
