"""Many cases on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

from strapdown.exceptions import ConfigError

T = TypeVar("T")

# Cases that a process is handed at a time.
TOGETHER = 4


def each_case(one: Callable[[int], T], cases: int, workers: int | None = None) -> list[T]:
    """Do every case, in processes of their own.

    Parameters
    ----------
    one : callable
        From the number of a case, from 0, to what comes of it; to be pickled where there are
        several workers. All that it draws must hang on that number alone.
    cases : int
    workers : int, optional
        Processes; one a core, if not given; with 1, all is done in this one.

    Returns
    -------
    list
        In the order of the cases.

    Raises
    ------
    ConfigError
        There is no case, or no worker.
    """
    count = (os.cpu_count() or 1) if workers is None else workers
    if cases < 1 or count < 1:
        raise ConfigError(
            f"{cases} cases by {count} workers", quantity="cases", remedy="use at least one of each"
        )
    if count == 1 or cases == 1:
        return [one(k) for k in range(cases)]
    # A fresh process has no threads or locks of this one.
    with ProcessPoolExecutor(min(count, cases), mp_context=get_context("spawn")) as pool:
        return list(pool.map(one, range(cases), chunksize=TOGETHER))
