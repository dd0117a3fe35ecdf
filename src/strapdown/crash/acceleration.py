"""Acceleration without gravity: input of events, delta-V and direction of force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import (
    ACCEL,
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

Array = NDArray[np.float64]

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
        """Return a north-east-down record resolved along and across one heading.

        Parameters
        ----------
        heading_deg : float, deg
            Of the vehicle at the impact.

        Returns
        -------
        Acceleration
            In the frame ``impact``: forward and right in the horizontal plane, down.

        Raises
        ------
        ConfigError
            The record is not resolved in north-east-down.
        """
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
    """Specific force of an unbiased stationary sensor, from the leveling.

    Parameters
    ----------
    roll_deg, pitch_deg : float, deg
    gravity : float, m/s²

    Returns
    -------
    ndarray, (3,), m/s²
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
    q = attitude_of_samples(q_nb, sampling, len(force), source)
    values = rotation.rotate(q, force) + np.array([0.0, 0.0, gravity])
    return Acceleration(index_of(imu), values, "ned", sampling, source)


def attitude_of_samples(
    q_nb: ArrayLike, sampling: str, samples: int, source: str | None = None
) -> Array:
    """Attitude for rotating each sample: at its stamp, or in the middle of its interval.

    Parameters
    ----------
    q_nb : array_like, (n, 4)
        At the stamps.
    sampling : {'instantaneous', 'mean'}
    samples : int
        Number of samples.
    source : str, optional
        Name for messages.

    Returns
    -------
    ndarray, (n, 4)

    Raises
    ------
    DataError
        There is not one rotation per sample.
    """
    q = rotation.normalise(q_nb)
    if q.shape != (samples, 4):
        raise DataError(
            "crash.attitudes-shape-samples",
            file=source,
            quantity="q_nb",
            shape=q.shape,
            samples=samples,
        )
    if sampling == "mean":
        # Half the rotation of the step, from its start.
        turn = rotation.rotation_vector_from_quaternion(
            rotation.compose(rotation.conjugate(q[:-1]), q[1:])
        )
        middle = rotation.compose(q[:-1], rotation.quaternion_from_rotation_vector(0.5 * turn))
        q = np.vstack([q[:1], middle])
    return q
