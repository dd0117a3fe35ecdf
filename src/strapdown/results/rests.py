"""Rests of a sensor, the bias of its gyro from them, and two of one pose."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GyroBiasCourse", "RestStretch", "SamePose"]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class RestStretch:
    """A stretch in which the sensor did not turn.

    Attributes
    ----------
    start, end : float, s
    gyro_mean : tuple of float, rad/s
        Mean of each gyro over it: its bias, where the Earth's 15 deg/h does not matter.
    gyro_sd : tuple of float, rad/s
    accel_mean : tuple of float or None, m/s²
    gyro_mean_sd : tuple of float or None, rad/s
        How well the mean is known: from the scatter of the means of its parts, so that
        shaking and slow wandering count, and not from the samples as if each were new.
    accel_sd, accel_mean_sd : tuple of float or None, m/s²
        As for the gyro.
    grade : {'still', 'shaking', 'steady', 'stated'}
        Quiet within the noise of the sensor; shaken about one attitude, so that only the
        means are those of a rest; quiet and without turning, but perhaps at speed; or taken
        from the user's word.
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
    """The bias of a gyro over a log, from its rests.

    Attributes
    ----------
    time : tuple of float, s
        Middle of each rest.
    mean, sd : tuple of three float a rest, rad/s
        Bias at each rest, and how well it is known.
    average, average_sd : tuple of float, rad/s
        Over the rests, weighted by how well each is known. The sd is widened where the rests
        scatter by more than their own.
    drift, drift_sd : tuple of float or None, rad/s²
        Slope of a line through the rests; None for a single one.
    scatter : tuple of float or None
        Root of the mean square distance of the rests from the average, in units of their own
        sd: near 1 for a bias that stays, far above for one that wanders. None for a single
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
    """Two rests at which gravity had the same direction in the body.

    Attributes
    ----------
    time, since : float, s
        Instants within the two rests, the later one first.
    apart_deg, sd_deg : float
        Angle between the two directions, and its standard deviation by the noise.
    words : str
        The reference point that it would be, as the command line takes it.
    caveat : str
        What must be known besides, before it is one.
    """

    time: float
    since: float
    apart_deg: float
    sd_deg: float
    words: str
    caveat: str
