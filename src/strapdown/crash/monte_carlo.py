"""Monte Carlo paths of one crash, with errors drawn from the error budget."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.crash_errors import perturbed_runs
from strapdown.crash.leg import VELOCITY
from strapdown.crash.path import CrashPath
from strapdown.errors import ConfigError

Array = NDArray[np.float64]

# Number of runs that share one stream of random numbers: part of the meaning of a seed,
# unlike the number of cores.
TOGETHER = 64
# One gigabyte of paths.
MOST_RUNS = 100_000


@dataclass(frozen=True, eq=False)
class PathSamples:
    """Simulated paths, as differences from the reconstructed one.

    Attributes
    ----------
    time : ndarray, (n,), s
    errors : ndarray, (runs, n, 9)
        Rotation vector in local level, rad; velocity, m/s; position, m: true minus computed,
        for the drawn errors.
    draws : ndarray, (runs, p)
        Standard normal numbers, one for each unknown of the path.
    """

    time: Array
    errors: Array = field(repr=False)
    draws: Array = field(repr=False)

    @property
    def covariance(self) -> Array:
        """About their mean, (n, 9, 9)."""
        centred = self.errors - self.errors.mean(axis=0)
        return np.asarray(np.einsum("rni,rnj->nij", centred, centred) / (len(centred) - 1))

    def interval(self, share: float = 0.95) -> tuple[Array, Array]:
        """Bounds of the central fraction `share` of the runs, each (n, 9)."""
        edge = 0.5 * (1.0 - share)
        low, high = np.quantile(self.errors, [edge, 1.0 - edge], axis=0)
        return low, high


def sample_paths(
    path: CrashPath, *, runs: int = 10_000, seed: int = 0, workers: int | None = None
) -> PathSamples:
    """Draw Monte Carlo paths.

    The same unknowns with the same standard deviations as in the linear covariance are drawn and
    applied to start and increments, and each path is navigated in full.

    Parameters
    ----------
    path : CrashPath
    runs : int
    seed : int
        The same seed gives bitwise the same runs on any number of cores; a larger number of
        runs extends a smaller one with the same seed.
    workers : int, optional
        Threads; by default all cores.

    Returns
    -------
    PathSamples

    Raises
    ------
    ConfigError
        `runs` is less than 2 or too large, or a seed or a number of workers is not valid.
    """
    _check(path, runs, seed, workers)
    unknowns = len(path.names)
    draws = np.empty((runs, unknowns))
    errors = np.empty((runs, len(path.time), 9))
    back, ahead = path.legs
    views = (errors[:, : path.anchor + 1][:, ::-1], errors[:, path.anchor :])
    prepared = []
    for leg, view in zip((back, ahead), views, strict=True):
        start = path.start.copy()
        if leg.backward:
            start[:, VELOCITY] *= -1.0
        used = np.abs(leg.effects).max(axis=2, initial=0.0) > 0.0
        active = (np.abs(start).max(axis=1) > 0.0) | (used.sum(axis=1) > 0)
        prepared.append(
            (
                leg,
                view,
                active,
                start[active],
                np.ascontiguousarray(leg.effects[active]),
                np.ascontiguousarray(used[active]),
            )
        )

    def chunk(number: int) -> None:
        rows = slice(number * TOGETHER, min((number + 1) * TOGETHER, runs))
        generator = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(number,)))
        )
        mine = generator.standard_normal((TOGETHER, unknowns))[: rows.stop - rows.start]
        draws[rows] = mine
        for leg, view, active, start, effects, used in prepared:
            steps = len(leg.rows)
            # Single precision suffices for noise and halves the memory.
            noise = generator.standard_normal((TOGETHER, 6, steps), dtype=np.float32)
            perturbed_runs(
                leg.state,
                leg.rows,
                leg.nominal,
                start,
                effects,
                used,
                leg.noise_sd,
                np.ascontiguousarray(mine[:, active]),
                noise,
                leg.earth,
                leg.options,
                view[rows],
            )
            if leg.backward:
                view[rows, :, VELOCITY] *= -1.0

    chunks = range((runs + TOGETHER - 1) // TOGETHER)
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        list(pool.map(chunk, chunks))
    return PathSamples(path.time, errors, draws)


def _check(path: object, runs: object, seed: object, workers: object) -> None:
    if not isinstance(path, CrashPath):
        raise ConfigError("crash.path-of-wrong-type", quantity="path", name=type(path).__name__)
    if not _is_whole(runs, 2, MOST_RUNS):
        raise ConfigError(
            "crash.runs-out-of-range", quantity="runs", runs=runs, most_runs=MOST_RUNS
        )
    for name, given, least in (("seed", seed, 0), ("workers", workers, 1)):
        if not (_is_whole(given, least) or (name == "workers" and given is None)):
            raise ConfigError("crash.count-not-whole", quantity=name, given=given, least=least)


def _is_whole(given: object, least: int, most: float = math.inf) -> bool:
    return isinstance(given, int | np.integer) and least <= int(given) <= most
