"""Stationary intervals of a sensor, the gyro bias from them, and pairs of equal pose."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GyroBiasCourse", "RestStretch", "SamePose"]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class RestStretch:
    """An interval in which the sensor did not rotate.

    Attributes
    ----------
    start, end : float, s
    gyro_mean : tuple of float, rad/s
        Mean of each gyro: its bias, where the Earth's 15 deg/h is negligible.
    gyro_sd : tuple of float, rad/s
    accel_mean : tuple of float or None, m/s²
    gyro_mean_sd : tuple of float or None, rad/s
        Standard deviation of the mean, from the scatter of the means of its parts, so that
        vibration and slow drift count; not from the samples as if they were independent.
    accel_sd, accel_mean_sd : tuple of float or None, m/s²
        As for the gyro.
    grade : {'still', 'shaking', 'steady', 'stated'}
        Quiet within the noise of the sensor; shaken about one attitude, so that only the
        means are those of a stationary sensor; quiet and without rotation, but perhaps at
        speed; or stated by the user.
    """

    start: float
    end: float
    gyro_mean: Triple
    gyro_sd: Triple
    accel_mean: Triple | None
    gyro_mean_sd: Triple | None = None
    accel_sd: Triple | None = None
    accel_mean_sd: Triple | None = None
    grade: str = "still"


@dataclass(frozen=True)
class GyroBiasCourse:
    """Gyro bias over a log, from its stationary intervals.

    Attributes
    ----------
    time : tuple of float, s
        Middle of each interval.
    mean, sd : tuple of three float per interval, rad/s
        Bias in each interval, and its standard deviation.
    average, average_sd : tuple of float, rad/s
        Weighted mean over the intervals. The sd is inflated if the intervals scatter by more
        than their own.
    drift, drift_sd : tuple of float or None, rad/s²
        Slope of a line through the intervals; None for a single one.
    scatter : tuple of float or None
        Root mean square distance of the intervals from the average, in units of their own
        sd: near 1 for a constant bias, far above for a drifting one. None for a single
        one.
    """

    time: tuple[float, ...]
    mean: tuple[Triple, ...]
    sd: tuple[Triple, ...]
    average: Triple
    average_sd: Triple
    drift: Triple | None
    drift_sd: Triple | None
    scatter: Triple | None


@dataclass(frozen=True)
class SamePose:
    """Two stationary intervals at which gravity had the same direction in the body.

    Attributes
    ----------
    time, since : float, s
        Instants within the two intervals, the later one first.
    apart_deg, sd_deg : float
        Angle between the two directions, and its standard deviation from noise.
    words : str
        The corresponding reference point, in command-line syntax.
    caveat : str
        Condition for using it as a reference point.
    """

    time: float
    since: float
    apart_deg: float
    sd_deg: float
    words: str
    caveat: str
