"""Stationary intervals of a vehicle, by the detectors of its measurements."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.standstill import StandstillAid
from strapdown.navigation.record import NavigationRecord
from strapdown.systems.sins.chain import NavigationPipeline
from strapdown.systems.sins.intake import steps_of
from strapdown.tables import VELOCITY
from strapdown.tables.checks import index_of, values_of

__all__ = ["SHORTEST", "seen_rests"]

Array = NDArray[np.float64]

#: Least length of a rest for gyrocompassing, and the longest used at once, s.
SHORTEST, LONGEST = 60.0, 300.0
#: Longest interval between epochs of a rest, s.
APART = 2.5
#: Braking and soft starts within a detected rest, at either end, s.
SOFT = 5.0
#: Computed speed that excludes a rest, m/s. A run whose gyros changed may have smaller errors
#: and reject zero-velocity updates, and its rests must still be found.
GLIDES = 5.0


def seen_rests(
    chain: NavigationPipeline, imu: pd.DataFrame, record: NavigationRecord
) -> list[tuple[float, float]]:
    """Return begins and ends of the rests of a run, split where too long, s.

    Parameters
    ----------
    chain : NavigationPipeline
    imu : DataFrame
        Samples of the run.
    record : NavigationRecord
        Result of the run.

    Returns
    -------
    list of (float, float)
        Empty if no measurement detects rests.
    """
    aids = [aid for aid in chain.navigator.aids if isinstance(aid, StandstillAid)]
    if not aids:
        return []
    memories = [aid.begin() for aid in aids]
    seen: list[Array] = []
    span = record.trajectory.index
    for steps in steps_of(chain.intake, imu, float(span[0]), float(span[-1])):
        for k, aid in enumerate(aids):
            memories[k], epochs = aid.watch(memories[k], steps.time, steps.rows)
            seen.append(epochs.time)
    time = np.unique(np.concatenate(seen)) if seen else np.empty(0)
    speed = np.linalg.norm(values_of(record.trajectory, VELOCITY), axis=1)
    time = time[np.interp(time, index_of(record.trajectory), speed) < GLIDES]
    if not len(time):
        return []
    starts = np.flatnonzero(np.diff(time, prepend=-math.inf) > APART).tolist()
    out: list[tuple[float, float]] = []
    for first, upto in zip(starts, [*starts[1:], len(time)], strict=True):
        begin, end = float(time[first]) + SOFT, float(time[upto - 1]) - SOFT
        if end - begin < SHORTEST:
            continue
        count = max(1, math.floor((end - begin) / LONGEST))
        edges = np.linspace(begin, end, count + 1).tolist()
        out += itertools.pairwise(edges)
    return out
