"""Many units on the bench, half of their runs with the table turned after the alignment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.autonomous import EVERY, Course, after, go
from papers.chernodarov.prediction import KINDS, Predicted, predict
from papers.chernodarov.setting import (
    ELLIPSOID,
    END,
    FINE_END,
    HEADING_DEG,
    SENSOR,
    SITE,
    align,
    autonomous_filter,
)
from strapdown.alignment import FineResult
from strapdown.increments import motion_increments
from strapdown.navigation import Feedforward, Navigator
from strapdown.simulation import Origin, PathMotion, Track, simulate_imu

Array = NDArray[np.float64]

COUNT = 24
FIRST = 100  # seed of the first
# Of a body that rests, or turns about one axis, means hold everything.
RATE = 10.0  # Hz
TURN_DEG, RAMP, STEADY = 180.0, 5.0, 10.0


@dataclass(frozen=True, eq=False)
class Kept:
    """Runs of one kind: the table still, or turned.

    Attributes
    ----------
    damped, undamped : tuple of Course
        One a unit.
    predicted : dict of Predicted
        By kind, from the alignment of the first unit.
    """

    damped: tuple[Course, ...]
    undamped: tuple[Course, ...]
    predicted: dict[str, Predicted]

    def rms(self, which: str, quantity: str) -> Array:
        """Root of the mean over units of the square of Delta V or Delta S, by time, (n,)."""
        courses = self.damped if which == "damped" else self.undamped
        values = np.array([getattr(c, quantity) for c in courses])
        return np.asarray(np.sqrt(np.square(values).mean(axis=0)))

    @property
    def time(self) -> Array:
        """Times of the courses, s."""
        return self.damped[0].time


@dataclass(frozen=True, eq=False)
class Units:
    """Both kinds.

    Attributes
    ----------
    still, turned : Kept
    forward_apart : float, m/s
        Largest difference of the velocities of the first unit at rest, with its estimates fed
        back, and with the mechanization free and the errors that (6) predicts taken off.
    """

    still: Kept
    turned: Kept
    forward_apart: float


def table_motion(turned: bool) -> PathMotion:
    """Return the table: at rest, and after the alignment turned by half a turn or not."""
    rate = TURN_DEG / (RAMP + STEADY)
    times = (0.0, FINE_END, FINE_END + RAMP, FINE_END + RAMP + STEADY)
    track = Track((*times, times[-1] + RAMP), (0.0, 0.0, rate, rate, 0.0))
    return PathMotion(
        END,
        Origin(SITE.lat_deg, SITE.lon_deg, SITE.alt),
        heading_deg=HEADING_DEG,
        turn_rate=track if turned else Track((0.0,), (0.0,)),
        ellipsoid=ELLIPSOID,
    )


def units(count: int = COUNT) -> Units:
    """Align each unit, and let it navigate for an hour in four ways.

    Parameters
    ----------
    count : int

    Returns
    -------
    Units
    """
    motions = [table_motion(turned) for turned in (False, True)]
    courses: list[tuple[list[Course], list[Course]]] = [([], []), ([], [])]
    predicted: list[dict[str, Predicted]] = [{}, {}]
    for seed in range(FIRST, FIRST + count):
        errors = SENSOR.draw(seed)
        for k, motion in enumerate(motions):
            imu, _ = simulate_imu(motion, errors, rate=RATE, sampling="mean", seed=seed)
            increments = motion_increments(imu, interpolation="cubic")
            if k == 0:
                fine = align(imu)
                off = replace(fine.state, sensors=np.zeros_like(fine.state.sensors))
                used = autonomous_filter(fine)
            for state, into in zip((fine.state, off), courses[k], strict=True):
                into.append(go(used, state, increments))
            if not predicted[k]:
                if k == 0:
                    forward = fed_forward(fine, increments)
                    apart = forward - courses[0][0][0].velocity
                predicted[k] = {kind: predict(fine, increments, kind) for kind in KINDS}
    kept = [Kept(tuple(c[0]), tuple(c[1]), p) for c, p in zip(courses, predicted, strict=True)]
    return Units(kept[0], kept[1], float(np.linalg.norm(apart, axis=1).max()))


def fed_forward(fine: FineResult, increments: pd.DataFrame) -> Array:
    """Return the velocity north and east with estimates taken off what is shown, (n, 2), m/s."""
    used = autonomous_filter(fine)
    navigator = Navigator(used, damping=Feedforward())
    ends, rows = after(increments, fine.state.time)
    _, piece = navigator.advance(navigator.begin_from(fine.state), ends, rows)
    path = used.mechanization.trajectory(piece.time, piece.history)
    every = round(RATE * EVERY)
    return path[["VN", "VE"]].to_numpy()[every - 1 :: every]
