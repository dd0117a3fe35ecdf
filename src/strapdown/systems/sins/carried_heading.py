"""A heading that was found at rest, carried on by the gyros alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.attitude import quaternion_advance
from strapdown.ellipsoids import Ellipsoid
from strapdown.evaluation.heading_light import GROWS, SURE, seconds_of
from strapdown.frames import q_ne
from strapdown.navigation.record import NavigationRecord
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.gyrocompass import Compass
from strapdown.systems.sins.joined_steps import JoinedSteps
from strapdown.tables import EULER
from strapdown.tables.checks import index_of, values_of

__all__ = ["LONGEST", "UNSEEN", "CarriedHeading", "carry_headings"]

Array = NDArray[np.float64]

#: A gyro may have changed by so many standard deviations of its bias since, and nobody saw it.
UNSEEN = 30.0
#: Longer than this nobody has looked at the gyros, s.
LONGEST = 7200.0
#: A step that is so long, or so much time between two, is a gap, s.
GAP = 0.5


@dataclass(frozen=True, eq=False)
class CarriedHeading:
    """What one rest tells of the headings of a run after it; as `heading_light.Heard`.

    Attributes
    ----------
    since : float, s
        When the rest ended.
    time : ndarray, (n,), s
        Seconds of the run after it.
    difference : ndarray, (n,), deg
        Heading of the run less the carried one.
    sd : ndarray, (n,), deg
        What bounds 99 of 100 of the errors of the carried one, over `heading_light.SURE`.
    plain : ndarray, (n,), deg
        The same by what is stated of the gyros, without what the rest itself showed of them.
    kind : str
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    plain: Array
    kind: str = "gyrocompass"


def carry_headings(
    compasses: Sequence[Compass],
    doubts: Sequence[float],
    steps: JoinedSteps,
    record: NavigationRecord,
    sensors: ImuUncertainty,
    ellipsoid: Ellipsoid,
) -> list[CarriedHeading]:
    """Carry headings on, each until a later one agrees with it.

    Parameters
    ----------
    compasses : sequence of Compass
        In the order of time.
    doubts : sequence of float, s
        Instants at which gyros were found to have changed: nothing is carried beyond.
    steps : JoinedSteps
        From the first of them on.
    record : NavigationRecord
        Of the run, which tells the place: a kilometre turns north by less than 0.02 deg.
    sensors : ImuUncertainty
    ellipsoid : Ellipsoid

    Returns
    -------
    list of CarriedHeading

    Notes
    -----
    From one instant to another the gyros turn the body in inertial space, and the Earth and the way
    over it turn north; nothing else is needed. The bound of such a heading is that of the rest, the
    noise, the bias that the rest left and the scale factors since, and what a change of a gyro by
    `UNSEEN` of its standard deviations adds, which nothing but another rest would show.
    """
    if not compasses or not len(steps.time):
        return []
    rows = record.trajectory
    seconds = seconds_of(record)
    at = np.clip(np.searchsorted(index_of(rows), seconds - 1e-6), 0, len(rows) - 1)
    stamps, own = index_of(rows)[at], values_of(rows, EULER)[at, 2]
    carried = [_Carried(one, steps, rows, ellipsoid, sensors) for one in compasses]
    out = []
    for k, one in enumerate(carried):
        until = min(one.compass.time + LONGEST, one.unbroken)
        until = min([until, *(at for at in doubts if at > one.compass.time)])
        for later in carried[k + 1 :]:
            if later.compass.time <= until and one.agrees(later.compass):
                until = min(until, later.compass.time)
                break
        used = (seconds >= one.compass.time - 1e-6) & (seconds <= until + 1e-6)
        told = stamps[used]
        difference = np.asarray(rotation.within_half_turn(own[used] - one.heading(told)))
        bound, plain = one.bounds(told)
        out.append(
            CarriedHeading(one.compass.time, seconds[used], difference, bound / SURE, plain / SURE)
        )
    return [one for one in out if len(one.time)]


class _Carried:
    """The attitude of one rest, at the end of each step after it."""

    def __init__(
        self,
        compass: Compass,
        steps: JoinedSteps,
        rows: pd.DataFrame,
        ellipsoid: Ellipsoid,
        sensors: ImuUncertainty,
    ) -> None:
        self.compass, self.sensors = compass, sensors
        # A rest that ends within a step: the body stands there.
        after = int(np.searchsorted(steps.time, compass.time + 1e-6))
        dt = np.ascontiguousarray(steps.rows[after:, 0])
        turns = np.ascontiguousarray(steps.rows[after:, 1:4] - dt[:, None] * compass.gyro_bias)
        turned = np.empty((len(dt), 4))
        quaternion_advance(np.array([1.0, 0.0, 0.0, 0.0]), dt, turns, turns, turned, 0.0, 1.0)
        self.time = np.concatenate([[compass.time], steps.time[after:]])
        # Through a gap the gyros carry nothing.
        gaps = np.flatnonzero((dt > GAP) | (np.diff(self.time) > dt + GAP))
        self.unbroken = float(self.time[gaps[0]]) if len(gaps) else math.inf
        turned = np.concatenate([[[1.0, 0.0, 0.0, 0.0]], turned])
        known = index_of(rows)
        lat, lon = np.interp(self.time, known, rows["lat"]), _longitude(self.time, rows)
        lon = lon + math.degrees(ellipsoid.rotation_rate) * (self.time - compass.time)
        q_ni = q_ne(lat, rotation.within_half_turn(lon))
        first = rotation.compose(rotation.conjugate(q_ni[0]), compass.q_nb)
        q_nb = rotation.compose(q_ni, rotation.compose(first, turned))
        heading = rotation.euler_from_quaternion(q_nb)[:, 2]
        self.unwrapped = np.degrees(np.unwrap(np.radians(heading)))
        away = np.abs(self.unwrapped - self.unwrapped[0])
        self.turned = np.radians(np.maximum.accumulate(away))

    def heading(self, time: Array) -> Array:
        """At some instants, deg."""
        return np.asarray(np.interp(time, self.time, self.unwrapped))

    def bounds(self, time: Array) -> tuple[Array, Array]:
        """Of 99 of 100 headings at some instants, deg: by the rest, and by what is stated."""
        gyro, drift = self.sensors.gyro, self.sensors.gyro_drift
        since = np.maximum(time - self.compass.time, 0.0)
        bias = float(np.max(np.hypot(gyro.axis("bias"), drift.triad)))
        noise = float(np.max(gyro.axis("noise_density")))
        scale = float(np.max(np.hypot(gyro.axis("scale"), gyro.axis("misalignment"))))
        turned = np.interp(time, self.time, self.turned)
        chance = np.sqrt(noise**2 * since + (bias * since) ** 2 + (scale * turned) ** 2)
        unseen = UNSEEN * bias + GROWS * self.compass.unsteady
        grown = np.degrees(SURE * chance + unseen * since)
        return self.compass.bound + grown, SURE * self.compass.sd + grown

    def agrees(self, later: Compass) -> bool:
        """Whether a later rest found what was carried to it."""
        at = np.array([later.time])
        there = float(rotation.euler_from_quaternion(later.q_nb)[2])
        apart = abs(float(rotation.within_half_turn(self.heading(at)[0] - there)))
        return bool(apart <= math.hypot(float(self.bounds(at)[0][0]), later.bound))


def _longitude(time: Array, rows: pd.DataFrame) -> Array:
    """Longitude at some instants, deg, also over the date line."""
    lon = np.degrees(np.unwrap(np.radians(rows["lon"].to_numpy(dtype=np.float64))))
    return np.asarray(np.interp(time, index_of(rows), lon))
