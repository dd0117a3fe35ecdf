"""Differences between attitudes as rotation angles."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.constants import Flags
from strapdown.dsp.samples import running_integral
from strapdown.errors import Finding
from strapdown.rotation import unit_rotation_angle
from strapdown.tables import EULER, GYRO, QUATERNION
from strapdown.tables.checks import Array, index_of, values_of

if TYPE_CHECKING:
    from strapdown.attitude_algorithms.algorithm import AttitudeRun


def attitude_at(attitude: pd.DataFrame, time: ArrayLike) -> Array:
    """Attitude at any instants within a table.

    Parameters
    ----------
    attitude : DataFrame
        An Attitude table.
    time : array_like, (n,), s
        Within the table's span; beyond it the nearest end is returned.

    Returns
    -------
    ndarray, (n, 4)
        The rows themselves at their time stamps; between them, rotated at a constant rate from
        one to the next.
    """
    stamps = attitude.index.to_numpy(dtype=np.float64)
    q = values_of(attitude, QUATERNION)
    t = np.asarray(time, dtype=np.float64)
    right = np.clip(np.searchsorted(stamps, t, side="left"), 0, len(stamps) - 1)
    out: Array = q[right].copy()
    between = (t < stamps[right]) & (right > 0)
    if between.any():
        k = right[between]
        share = (t[between] - stamps[k - 1]) / (stamps[k] - stamps[k - 1])
        turn = rotation.rotation_vector_from_quaternion(
            rotation.compose(rotation.conjugate(q[k - 1]), q[k])
        )
        part = rotation.quaternion_from_rotation_vector(turn * share[:, None])
        out[between] = rotation.compose(q[k - 1], part)
    return out


def error_angles(attitude: pd.DataFrame, truth: pd.DataFrame) -> pd.Series:
    """Rotation angle between an attitude and the truth, at the stamps of the truth.

    Parameters
    ----------
    attitude, truth : DataFrame
        Attitude tables.

    Returns
    -------
    Series
        In deg, indexed by time: the stamps of `truth` within the span of `attitude`.
    """
    stamps = truth.index.to_numpy(dtype=np.float64)
    inside = (stamps >= attitude.index[0]) & (stamps <= attitude.index[-1])
    known = values_of(truth, QUATERNION)[inside]
    angles = unit_rotation_angle(attitude_at(attitude, stamps[inside]), known)
    return pd.Series(angles, index=pd.Index(stamps[inside], name="time"), name="error")


def largest_differences(runs: tuple[AttitudeRun, ...]) -> pd.DataFrame:
    """Largest rotation angle over time between each pair of runs of one log.

    Parameters
    ----------
    runs : tuple of AttitudeRun
        On the same stamps.

    Returns
    -------
    DataFrame
        Square, symmetric, in deg; labeled by algorithm.
    """
    names = [run.algorithm for run in runs]
    table = pd.DataFrame(0.0, index=names, columns=names)
    q = [values_of(run.attitude, QUATERNION) for run in runs]
    for a, b in combinations(range(len(runs)), 2):
        table.iloc[a, b] = table.iloc[b, a] = float(unit_rotation_angle(q[a], q[b]).max())
    return table


#: Windows in which the rotations of a gyro and of a reference are compared: their length, s, the
#: fewest of them, and the largest angle, rad, beyond which a rotation may pass for a shorter one.
WINDOW, LEAST_WINDOWS, LARGEST = 1.0, 5, 2.0
#: Difference of their root mean squares that a gyro's bias allows, rad/s (MPU-6050 data sheet:
#: within 20 deg/s, one sigma a third), and the share of the larger: offsets of clocks,
#: scale factors and the noise of a reference change a root mean square by less.
BIAS, SHARE = 0.12, 0.25


def gyro_turns(imu: pd.DataFrame, instants: Array) -> Array:
    """Integrals of the rates between instants, (3, n - 1), rad."""
    stamps = index_of(imu)
    whole = running_integral(stamps, values_of(imu, GYRO))
    return np.asarray(np.diff([np.interp(instants, stamps, one) for one in whole.T], axis=1))


def rotation_contradicted(imu: pd.DataFrame, reference: pd.DataFrame) -> Finding | None:
    """Check whether a reference attitude rotates as the gyro does.

    Angles of rotation are compared, which depend neither on axes nor on mounting, by their root
    mean square, which changes little with an offset of the clocks.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.
    reference : DataFrame
        Attitudes or a trajectory, on the same clock or nearly so.

    Returns
    -------
    Finding or None
        None if they agree, the reference has no attitude, or fewer than five windows are common.
    """
    names = next((n for n in (QUATERNION, EULER) if set(n) <= set(reference.columns)), None)
    imu = imu.iloc[np.flatnonzero(np.isfinite(values_of(imu, GYRO)).all(axis=1))]
    if names is None or len(imu) < LEAST_WINDOWS:
        return None
    values = reference[names].to_numpy(dtype=np.float64)
    there = np.isfinite(values).all(axis=1)
    q_nb = rotation.quaternion_from_euler(values[there]) if names is EULER else values[there]
    known = pd.DataFrame(q_nb, reference.index[there], QUATERNION)
    if len(known) < LEAST_WINDOWS:
        return None
    start, end = max(imu.index[0], known.index[0]), min(imu.index[-1], known.index[-1])
    step = max(WINDOW, 2.0 * float(np.median(np.diff(known.index))))
    instants = np.arange(start, end, step)
    if len(instants) <= LEAST_WINDOWS:
        return None
    # The integral of the rate: what rotates about changing axes within a window differs from the
    # angle by the third order in it, less than the share that is allowed.
    turns = gyro_turns(imu, instants)
    q = attitude_at(known, instants)
    angles = np.array(
        [np.linalg.norm(turns, axis=0), np.radians(unit_rotation_angle(q[:-1], q[1:]))]
    )
    angles = angles[:, (angles < LARGEST).all(axis=0)]
    if angles.shape[1] < LEAST_WINDOWS:
        return None
    gyro, other = np.sqrt(np.mean(angles**2, axis=1)) / step
    if abs(gyro - other) < BIAS + SHARE * max(gyro, other):
        return None
    return Finding(
        "evaluation.reference-rotates-otherwise",
        quantity="reference",
        gyro_deg_s=float(np.degrees(gyro)),
        reference_deg_s=float(np.degrees(other)),
        windows=angles.shape[1],
        step=step,
    )


# Known attitude at the samples of a log.


#: The final error, its root mean square and the largest, in deg.
Errors = tuple[float, float, float]


@dataclass(frozen=True)
class Known:
    """An attitude at samples of a log.

    Attributes
    ----------
    q_nb : ndarray, (n, 4)
        At every sample; not valid where `counts` is False.
    counts : ndarray of bool, (n,)
    """

    q_nb: Array
    counts: Flags

    def at(self, samples: NDArray[np.int64]) -> Known:
        """Return the known attitude at some of the samples."""
        return Known(self.q_nb[samples], self.counts[samples])

    def errors(self, q_nb: Array) -> Errors | None:
        """Errors of an attitude, (n, 4), at every sample; None where the truth is unknown."""
        if self.counts.all():
            return angles_to_errors(unit_rotation_angle(q_nb, self.q_nb))
        if not self.counts.any():
            return None
        angles = unit_rotation_angle(q_nb[self.counts], self.q_nb[self.counts])
        return angles_to_errors(angles)


def angles_to_errors(angles: Array) -> Errors:
    """Final, RMS and largest of angles."""
    return float(angles[-1]), float(np.sqrt((angles * angles).mean())), float(angles.max())


def known_at(truth: pd.DataFrame, scored: Flags, stamps: Array) -> Known:
    """Interpolate the scored rows of a truth at the samples of a log.

    A sample counts at the stamp of a scored row, or between scored rows at most three of the
    truth's usual steps apart.
    """
    rows = truth[scored]
    if rows.empty:
        return Known(np.zeros((len(stamps), 4)), np.zeros(len(stamps), dtype=bool))
    times = rows.index.to_numpy(dtype=np.float64)
    usual = float(np.median(np.diff(truth.index.to_numpy()))) if len(truth) > 1 else 0.0
    before = np.searchsorted(times, stamps, side="right") - 1
    after = np.minimum(np.searchsorted(times, stamps), len(times) - 1)
    inside = (before >= 0) & (times[after] >= stamps)
    apart = times[after] - times[np.maximum(before, 0)]
    return Known(attitude_at(rows, stamps), inside & (apart <= 3.0 * usual))
