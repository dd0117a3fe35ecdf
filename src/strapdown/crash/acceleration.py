"""Acceleration without gravity: input of events, delta-V and direction of force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import (
    ACCEL,
    Array,
    Gap,
    as_array,
    check_columns,
    check_rows,
    check_same_length,
    check_time,
    find_gaps,
    index_of,
    source_of,
    values_of,
)
from strapdown.tables.imu import SAMPLINGS

#: Frame of the three components. ``body``: forward, right, down, rotating with the vehicle, as a
#: recorder integrates them; ``ned``: north, east, down; ``impact``: forward, right, down of a
#: level vehicle at one heading, that of the impact.
FRAMES = ("body", "ned", "impact")


@dataclass(frozen=True, eq=False)
class Acceleration:
    """Acceleration of one point over a record, without gravity.

    Attributes
    ----------
    time : ndarray, (n,), s
        From the trigger.
    values : ndarray, (n, 3), m/s²
    frame : {'body', 'ned', 'impact'}
        As in `FRAMES`.
    sampling : {'instantaneous', 'mean'}
        Value at the stamp, or mean over the interval that ends there.
    source : str, optional
        Name of the unit or file, for messages.

    Raises
    ------
    ConfigError
        `frame` or `sampling` is unknown.
    DataError
        Shapes disagree, a value is not finite, time does not increase, or there are fewer than
        two samples.
    """

    time: Array
    values: Array
    frame: str = "body"
    sampling: str = "instantaneous"
    source: str | None = None

    def __post_init__(self) -> None:
        for name, known in (("frame", FRAMES), ("sampling", SAMPLINGS)):
            if getattr(self, name) not in known:
                raise ConfigError(
                    "crash.sampling-or-frame-unknown",
                    file=self.source,
                    quantity=name,
                    value=getattr(self, name),
                    known=known,
                )
        time = as_array(self.time, None, "time", self.source).copy()
        values = as_array(self.values, 3, "acceleration", self.source).copy()
        check_same_length(self.source, time=time, acceleration=values)
        if len(time) < 2:
            raise DataError(
                "crash.sample-change-velocity-needs-least",
                file=self.source,
                quantity="time",
                count=len(time),
            )
        check_time(time, self.source)
        check_rows(values, ["accel_x", "accel_y", "accel_z"], self.source)
        for name, array in (("time", time), ("values", np.ascontiguousarray(values))):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def begin(self) -> float:
        """First stamp, s."""
        return float(self.time[0])

    @property
    def end(self) -> float:
        """Last stamp, s."""
        return float(self.time[-1])

    def gaps(self, start: float, end: float) -> list[Gap]:
        """Gaps of the record that overlap an interval."""
        return [g for g in find_gaps(self.time) if g.start < end and g.end > start]

    def along(self, heading_deg: float) -> Acceleration:
        """Resolve a north-east-down record forward and right at one heading, deg: ``impact``."""
        if self.frame != "ned":
            raise ConfigError(
                "crash.record-frame-heading-turns-north",
                file=self.source,
                quantity="frame",
                frame=self.frame,
            )
        q = rotation.conjugate(rotation.quaternion_from_euler([0.0, 0.0, heading_deg]))
        return replace(self, values=rotation.rotate(q, self.values), frame="impact")


def _force_of(imu: pd.DataFrame) -> tuple[Array, str, str | None]:
    source = source_of(imu)
    check_columns(imu, ACCEL, source)
    sampling = imu.attrs.get("sampling")
    if sampling not in SAMPLINGS:
        raise DataError("crash.attrs-sampling", file=source, quantity="sampling", sampling=sampling)
    return values_of(imu, ACCEL), str(sampling), source


def body_acceleration(imu: pd.DataFrame, at_rest: Sequence[float]) -> Acceleration:
    """Subtract the stationary mean from the specific force, as recorders do.

    Parameters
    ----------
    imu : DataFrame
        Imu table in vehicle axes at the reference point.
    at_rest : sequence of float, (3,), m/s²
        Mean specific force while stationary before the crash, in vehicle axes
        (`RestStretch.accel_mean`), gravity and bias included. A vehicle on level ground without
        bias has (0, 0, -9.8).

    Returns
    -------
    Acceleration
        In rotating body axes. Exact while the vehicle keeps its attitude; after a change of pitch
        or roll by the angle d, g sin(d) of gravity remains, 0.17 m/s² per degree.
        `resolved_acceleration` does not have this error.

    Raises
    ------
    DataError
        As `Acceleration`; or `at_rest` is not three finite numbers.
    """
    force, sampling, source = _force_of(imu)
    rest = np.asarray(at_rest, dtype=np.float64)
    if rest.shape != (3,) or not np.isfinite(rest).all():
        raise DataError(
            "crash.not-three-finite-numbers", file=source, quantity="at_rest", at_rest=at_rest
        )
    return Acceleration(index_of(imu), force - rest, "body", sampling, source)


def force_at_rest(roll_deg: float, pitch_deg: float, gravity: float) -> Array:
    """Specific force of an unbiased stationary sensor at a roll and pitch, deg: (3,), m/s².

    For `body_acceleration`, where a record has no stationary interval.
    """
    q = rotation.conjugate(rotation.quaternion_from_euler([roll_deg, pitch_deg, 0.0]))
    return rotation.rotate(q, np.array([0.0, 0.0, -gravity]))


def resolved_acceleration(imu: pd.DataFrame, q_nb: ArrayLike, gravity: float) -> Acceleration:
    """Resolve the specific force in north-east-down and subtract gravity.

    Parameters
    ----------
    imu : DataFrame
        Imu table in vehicle axes at the reference point, biases removed.
    q_nb : array_like, (n, 4)
        Attitude at every stamp.
    gravity : float, m/s²
        Downward, including the centrifugal part (`strapdown.earth.gravity`).

    Returns
    -------
    Acceleration
        In the frame ``ned``. Means are rotated by the attitude in the middle of their interval,
        with an error of second order in the rotation over a sample. The Coriolis acceleration
        (1 mm/s² at 7 m/s) is not removed.

    Raises
    ------
    DataError
        As `Acceleration`; or there is not one valid rotation per sample.
    """
    force, sampling, source = _force_of(imu)
    q = rotation.normalise(q_nb)
    if q.shape != (len(force), 4):
        raise DataError(
            "crash.attitudes-shape-samples",
            file=source,
            quantity="q_nb",
            shape=q.shape,
            samples=len(force),
        )
    if sampling == "mean":
        # Half the rotation of the step, from its start.
        turn = rotation.rotation_vector_from_quaternion(
            rotation.compose(rotation.conjugate(q[:-1]), q[1:])
        )
        middle = rotation.compose(q[:-1], rotation.quaternion_from_rotation_vector(0.5 * turn))
        q = np.vstack([q[:1], middle])
    values = rotation.rotate(q, force) + np.array([0.0, 0.0, gravity])
    return Acceleration(index_of(imu), values, "ned", sampling, source)


# Sample weights of an integral over a window: the gradient of a delta-V.


def window_weights(
    time: ArrayLike, start: float, end: float, sampling: str = "instantaneous"
) -> Array:
    """Weights, (n,), s, of the samples in the integral from one instant to another.

    `start` and `end`, s, are within the record of stamps, (n,), s; the integral is negative where
    `end` is before `start`. Values at the stamps are interpolated linearly (second-order error in
    the step). Means over the interval that ends at the stamp are exact from stamp to stamp; within
    an interval its mean is used throughout (error at most h²/8 of the slope there), and the first
    row, which belongs to the time before the record, has zero weight. `DataError`, `ConfigError`:
    the window extends beyond the record, time does not increase, or the sampling is unknown.
    """
    stamps = as_array(time, None, "time")
    check_time(stamps, None)
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "crash.no-kind-sampling", quantity="sampling", sampling=sampling, samplings=SAMPLINGS
        )
    check_within(stamps, start, end, None)
    return _upto(stamps, end, sampling) - _upto(stamps, start, sampling)


def check_within(time: Array, start: float, end: float, source: str | None) -> None:
    """Refuse a window that is not within a record, or a record of fewer than two samples."""
    if len(time) < 2:
        raise DataError(
            "crash.sample-change-velocity-needs-least",
            file=source,
            quantity="time",
            count=len(time),
        )
    # Instants computed from stamps may exceed the last by rounding.
    slack = 8.0 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    for instant in (start, end):
        if not time[0] - slack <= instant <= time[-1] + slack:
            raise DataError(
                "crash.window-not-within-record",
                file=source,
                quantity="time",
                start=start,
                end=end,
                time=time[0],
                time_2=time[-1],
            )


def _upto(time: Array, instant: float, sampling: str) -> Array:
    """Weights of the integral from the first stamp."""
    weights = np.zeros(len(time))
    k = int(np.clip(np.searchsorted(time, instant, side="right"), 1, len(time) - 1))
    steps = np.diff(time[:k])
    step = time[k] - time[k - 1]
    u = (instant - time[k - 1]) / step
    if sampling == "mean":
        weights[1:k] = steps
        weights[k] = step * u
    else:
        weights[: k - 1] += 0.5 * steps
        weights[1:k] += 0.5 * steps
        weights[k - 1] += step * (u - 0.5 * u * u)
        weights[k] += step * 0.5 * u * u
    return weights


# Sums over the unknowns of each line of an error budget.


#: Line of the errors that are independent from sample to sample.
NOISE = "sensor noise"


def by_contributor(
    values: Array, columns: Sequence[str], contributors: Sequence[str], more: Mapping[str, Array]
) -> pd.DataFrame:
    """Sum values, (p, k), of unknowns by contributor, in order of occurrence.

    `more`: additional values, (k,), without an unknown, by contributor.
    """
    rows = {name: k for k, name in enumerate(dict.fromkeys([*contributors, *more]))}
    sums = np.zeros((len(rows), len(columns)))
    np.add.at(sums, [rows[name] for name in contributors], values)
    for name, of_line in more.items():
        sums[rows[name]] += of_line
    return pd.DataFrame(sums, pd.Index(list(rows), name="contributor"), list(columns))
