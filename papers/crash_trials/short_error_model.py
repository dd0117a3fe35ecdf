"""Recorders whose whole error is a bias, a scale factor, a drift and noise; and ideal ones."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.crash_trials.trial_outcome import END
from strapdown import frames
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors import TriadUncertainty, child, crash_priors, draw_errors
from strapdown.simulation import (
    CRASHES,
    CrashScenario,
    RecorderDesign,
    TriadDesign,
    point_kinematics,
    sample_accelerometer,
    sample_gyro,
)
from strapdown.tables import NED, imu_table

Array = NDArray[np.float64]

RATE = 200.0  # Hz
# Places below the seed of a run.
ACCEL, GYRO, ACCEL_NOISE, GYRO_NOISE, SPEED = range(5)


def short_design(rate: float = RATE) -> RecorderDesign:
    """Return a recorder at the vehicle's origin that has the errors of `crash_priors` alone.

    For the whole chain: bias of the gyro and tilt are then found at rest.

    Parameters
    ----------
    rate : float, Hz
    """
    priors = crash_priors(rate)
    return RecorderDesign(
        "short",
        (TriadDesign("accelerometer", priors["accel"], rate),),
        TriadDesign("gyro", priors["gyro"], rate),
    )


def ideal_design(rate: float = RATE, bandwidth: float = math.inf) -> RecorderDesign:
    """Return a recorder at the vehicle's origin without any error but that of a low-pass.

    Parameters
    ----------
    rate, bandwidth : float, Hz
    """
    none = TriadUncertainty(bandwidth=bandwidth)
    return RecorderDesign(
        "ideal", (TriadDesign("accelerometer", none, rate),), TriadDesign("gyro", none, rate)
    )


@dataclass(frozen=True, eq=False)
class ShortRuns:
    """Errors of the place at the end, 750 ms after the impact.

    Attributes
    ----------
    errors : ndarray, (runs, 3), m
        Computed less true: north, east, down.
    """

    errors: Array

    def table(self) -> pd.DataFrame:
        """By axis: ``rms`` and ``largest``, m."""
        return pd.DataFrame(
            {
                "rms": np.sqrt((self.errors**2).mean(axis=0)),
                "largest": np.abs(self.errors).max(axis=0),
            },
            index=pd.Index(NED, name="axis"),
        )


def without_a_rest(
    seeds: int = 500,
    *,
    seed: int = 0,
    speed_sd: float = 0.0,
    scenario: CrashScenario | None = None,
) -> ShortRuns:
    """Navigate with the errors of `crash_priors` as they are: nothing is found at rest.

    The state at the impact is known, but for the speed.

    Parameters
    ----------
    seeds : int
    seed : int
    speed_sd : float, m/s
    scenario : CrashScenario, optional
        The paper's pole impact, if not given.

    Returns
    -------
    ShortRuns
    """
    crash = scenario or CRASHES["pole"]
    motion, steps = crash.motion, round(END * RATE)
    time = crash.start + np.arange(steps + 1) / RATE
    truth = motion.trajectory(time)
    force = motion.specific_force(time)
    true = point_kinematics(motion, (0.0, 0.0, 0.0), time[[0, -1]], epoch=crash.start).position
    priors = crash_priors(RATE)
    out = np.empty((seeds, 3))
    for number in range(seeds):
        root = child(seed, number)
        accel = sample_accelerometer(
            motion,
            draw_errors(priors["accel"], root, ACCEL),
            time,
            seed=child(root, ACCEL_NOISE),
            specific_force=force,
        )
        gyro = sample_gyro(
            motion, draw_errors(priors["gyro"], root, GYRO), time, seed=child(root, GYRO_NOISE)
        )
        begin = NavState.from_trajectory(truth)
        draw = np.random.Generator(np.random.PCG64(child(root, SPEED))).standard_normal()
        faster = 1.0 + speed_sd * float(draw) / float(np.linalg.norm(begin.v_n))
        begin = replace(begin, v_n=np.asarray(begin.v_n) * faster)
        increments = motion_increments(imu_table(time, gyro, accel, sampling="instantaneous"))
        out[number] = _moved(begin, increments) - (true[1] - true[0])
    return ShortRuns(out)


def _moved(begin: NavState, increments: pd.DataFrame) -> Array:
    run = run_mechanization(NorthEastDown(), begin, increments)
    place = run.trajectory[["lat", "lon", "alt"]].to_numpy(dtype=np.float64)
    return np.asarray(frames.place_difference(place[-1:], place[:1])[0])
