"""From nothing known to the attitude of a drive: over a short end of it, and then over more."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.course_fit import CourseFit, CourseModel, Found
from strapdown.alignment.course_fixes import CourseFixes
from strapdown.alignment.course_rests import RestRate
from strapdown.alignment.course_unknowns import ACCEL_NOISE, ASKED, GYRO_NOISE, HANDED, OF_SENSORS
from strapdown.alignment.drive_sums import drive_sums
from strapdown.alignment.forward_sign import check_forward
from strapdown.alignment.site import Site
from strapdown.constants import MAD_TO_SD
from strapdown.errors import DataError, Finding
from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.influence_igg3 import Igg3
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

__all__ = ["CourseSearch", "left_out"]

# A bias turns the attitude by so much over the part that is solved, rad, one standard deviation:
# what is left to second order is a hundredth of it.
LINEAR = 0.2
# Fixes, and their length in s, that are solved at first, and how the length grows at least.
LEAST_FIXES, LEAST_LENGTH, GROWTH = 4, 1.0, 1.5
# Steps of Gauss and Newton over each part: it ends when one moves nothing by more than a part of
# its standard deviation.
STEPS, SMALL = 8, 0.02
# Errors that are of a stretch of one part, and of no other.
NOISE = np.r_[GYRO_NOISE, ACCEL_NOISE] - OF_SENSORS.start
# A velocity stands out by so many of its standard deviations, or of those that are usual.
CLEAR = 6.0
# So many courses point where the vehicle drives.
MOST = 0.5
# The heading is that of the middle of the courses of so long, s.
HEADING_SPAN = 5.0


@dataclass(frozen=True, eq=False)
class CourseSearch:
    """What `course_fit.CourseFit` needs, over a whole record.

    Attributes
    ----------
    imu : DataFrame
    fixes : CourseFixes
    rests : tuple of RestRate
    site : Site
    sensors : ImuUncertainty
    model : CourseModel
    """

    imu: pd.DataFrame
    fixes: CourseFixes
    rests: tuple[RestRate, ...]
    site: Site
    sensors: ImuUncertainty
    model: CourseModel

    def over(self) -> Found:
        """Solve over ever longer parts that reach to the end, to the whole.

        Returns
        -------
        Found
            Gross errors among the fixes do not count.
        """
        fixes = self.fixes
        end, begin = float(self.imu.index[-1]), float(fixes.time[0])
        newest = fixes.time[-min(LEAST_FIXES, len(fixes.time))]
        length = end - min(newest, fixes.time[-1] - LEAST_LENGTH)
        bias, sd = self._bias_of_rests()
        means = self.imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64).mean(axis=0)
        length = max(length, LINEAR / max(sd, 1e-12))
        found = None
        while True:
            begin_here = max(end - length, begin)
            part, fit = self._part(begin_here, means)
            if found is None:
                found = self._guess(part, fit.fixes, bias)
            else:
                older = len(fit.fixes.time) - len(found.weight)
                errors = found.errors.copy()
                errors[NOISE] = 0.0
                found = replace(
                    found,
                    errors=errors,
                    fitted=np.vstack([_smooth(fit.fixes)[:older], found.fitted]),
                    weight=np.concatenate([_near_neighbours(fit.fixes)[:older], found.weight]),
                )
            found = _converged(fit, found, Huber())
            if begin_here <= begin:
                break
            sd = float(np.sqrt(np.diagonal(found.covariance)[6:9].max()))
            length = max(GROWTH * length, LINEAR / max(sd, 1e-12))
        found = _converged(fit, found, Igg3())
        if found.onward < MOST:
            raise DataError(
                "alignment.course-contradicts-forward",
                file=fixes.source,
                quantity="VN, VE",
                count=len(fixes.time),
                onward=1.0 - found.onward,
            )
        return found

    def _bias_of_rests(self) -> tuple[Array, float]:
        """Bias of the gyros by the rests, and the worst standard deviation."""
        gyro, rate = self.sensors.gyro, np.zeros(3)
        known = np.hypot(gyro.axis("bias"), self.sensors.gyro_drift.triad)
        if self.rests:
            best = min(self.rests, key=lambda rest: float(rest.sd.max()))
            rate, known = best.rate, np.minimum(known, best.sd)
        errors = np.zeros(OF_SENSORS.stop - OF_SENSORS.start)
        errors[:3] = rate
        return errors, float(known.max())

    def _part(self, begin: float, means: Array) -> tuple[pd.DataFrame, CourseFit]:
        time = self.imu.index.to_numpy(dtype=np.float64)
        fixes = self.fixes.only(self.fixes.time >= begin - 1e-9)
        first = max(int(np.searchsorted(time, fixes.time[0], side="right")) - 1, 0)
        for rest in self.rests:
            first = min(first, max(int(np.searchsorted(time, rest.time)) - 1, 0))
        part = self.imu.iloc[first:]
        part.attrs = dict(self.imu.attrs)
        return part, CourseFit(part, means, fixes, self.rests, self.site, self.sensors, self.model)

    def _guess(self, imu: pd.DataFrame, fixes: CourseFixes, bias: Array) -> Found:
        """Level by the mean force less what the velocities gain, heading by the middle course."""
        sums = drive_sums(imu, fixes.time, bias[:6], bias)
        check_forward(imu, fixes, sums, self.model.reverse)
        first, last = _ends(fixes)
        length = float(fixes.time[last].mean() - fixes.time[first].mean())
        v0 = np.median(fixes.velocity[first], axis=0)
        v1 = np.median(fixes.velocity[last], axis=0)
        gained = sums.gained[first].mean(axis=0) - sums.gained[last].mean(axis=0)
        force_n = (v1 - v0) / length - self.site.gravity
        fast = np.flatnonzero(fixes.fast & (fixes.time >= fixes.time[-1] - HEADING_SPAN))
        course = np.arctan2(fixes.velocity[fast, 1], fixes.velocity[fast, 0]) + self.model.yaw
        heading = float(course[-1])
        for _ in range(2):
            back = _attitude(gained / length, force_n, heading) @ sums.turned[fast]
            off = np.degrees(course - np.arctan2(back[:, 1, 0], back[:, 0, 0]))
            heading += math.radians(_middle_turn(off))
        C = _attitude(gained / length, force_n, heading)
        nothing = np.zeros((len(HANDED), len(HANDED)))
        return Found(C, v1, bias, nothing, _smooth(fixes), _near_neighbours(fixes), 1.0)


def left_out(fixes: CourseFixes, found: Found) -> tuple[Finding, ...]:
    """Tell of the fixes that were left out because they are off."""
    out = np.flatnonzero(found.weight == 0.0)
    if not len(out):
        return ()
    times = "it is" if len(out) == 1 else "they are"
    return (
        Finding(
            "alignment.fix-velocities-rejected",
            file=fixes.source,
            row=int(fixes.row[out[0]]),
            quantity="VN, VE, VD",
            count=len(out),
            count_2=len(fixes.time),
            times=times,
        ),
    )


def _converged(fit: CourseFit, found: Found, influence: Influence) -> Found:
    """Step until nothing moves."""
    for _ in range(STEPS):
        before, found = found, fit.step(found, influence)
        sd = np.sqrt(np.diagonal(found.covariance)[:ASKED])
        turn = rotation.rotation_vector_from_dcm(found.C @ before.C.T)
        moved = [found.velocity - before.velocity, turn, found.bias - before.bias]
        if (np.abs(np.concatenate(moved)) <= SMALL * sd).all():
            break
    return found


def _ends(fixes: CourseFixes) -> tuple[Indices, Indices]:
    """The first and the last third of fixes, without one between them."""
    count = len(fixes.time)
    third = max(1, count // 3)
    return np.arange(third), np.arange(count - third, count)


def _smooth(fixes: CourseFixes) -> Array:
    """Of each velocity and its neighbours the middle one: without what stands out."""
    k = np.arange(len(fixes.time))[:, None] + np.arange(-2, 3)
    return np.asarray(np.median(fixes.velocity[np.clip(k, 0, len(k) - 1)], axis=1))


def _near_neighbours(fixes: CourseFixes) -> Array:
    """One for a velocity that is near those about it, zero for one that stands out at first sight.

    Whatever it is, its residual decides later.
    """
    off = np.abs(fixes.velocity - _smooth(fixes))
    told = np.isfinite(fixes.sd)
    usual = np.maximum(np.where(told, fixes.sd, 0.0), MAD_TO_SD * np.median(off, axis=0))
    return np.where(((off <= CLEAR * usual) | ~told).all(axis=1), 1.0, 0.0)


def _middle_turn(off_deg: Array) -> float:
    """Middle of angles, about the one that is nearest to all others; deg."""
    apart = rotation.within_half_turn(off_deg[:, None] - off_deg)
    nearest = off_deg[int(np.argmin(np.abs(apart).sum(axis=1)))]
    return float(nearest + np.median(rotation.within_half_turn(off_deg - nearest)))


def _attitude(force_b: Array, force_n: Array, heading: float) -> Array:
    """``C_nb`` of a heading (rad) that lays the one force along the other."""
    c, s = math.cos(heading), math.sin(heading)
    size = float(np.linalg.norm(force_b) / np.linalg.norm(force_n))
    x, y, z = size * np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ force_n
    pitch = math.asin(max(-1.0, min(1.0, force_b[0] / math.hypot(x, z)))) - math.atan2(x, -z)
    lifted = math.sin(pitch) * x + math.cos(pitch) * z
    roll = math.atan2(lifted, y) - math.atan2(force_b[2], force_b[1])
    return rotation.dcm_from_euler(np.degrees([roll, pitch, heading]))
