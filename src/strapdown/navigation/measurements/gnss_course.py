"""Course of a receiver, and what the integrals of the inertial sensors have to do with it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD, Array
from strapdown.dsp.samples import running_integral
from strapdown.errors import DataError, Finding
from strapdown.frames import place_difference
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, VELOCITY, VELOCITY_SD, usable
from strapdown.tables.checks import channels_of, index_of, source_of, values_of
from strapdown.tables.on_disk import filled

#: Number of steps of a course needed.
LEAST_STEPS = 20
#: Interval of the stored integrals of the sensors, s.
NODES = 0.02
#: A turn is taken over so many seconds: an offset of the clocks is short against it.
WINDOW = 10.0
#: Positions over which a course is taken for a turn are so far apart, s, and at most so far.
COURSE_STEP, LONGEST = 1.0, 2.5
#: Speed from which a course counts as one, m/s.
MOVES = 1.0
#: Windows needed; share of the turns that the gyros must explain; significance of their ratio;
#: residuals, in standard deviations by the median, that do not count; and the share that must, as
#: gyros that measure no turn explain whatever is left without the turns.
LEAST_WINDOWS, LEAST_SHARE, SIGNIFICANT, GROSS, COUNT = 10, 0.6, 5.0, 5.0, 0.8
#: Speed at which the noise of a velocity, 0.1 m/s, is in a course what sideslip is, 0.01 rad, m/s.
SLIPS = 10.0
#: A bank of 60° halves the ratio, none makes it larger, and mirrored axes make it negative.
LEAST, MOST = 1.0 / 3.0, 3.0
#: From this ratio on gyros turn too far, too, if it is significant and explains nearly all turns.
TOO_FAR, TOO_FAR_SHARE = 1.5, 0.95
#: deg/s for a rad/s, and by how much the ratio may differ from that of two units.
DEGREES, ABOUT = 180.0 / math.pi, 1.5
#: Mean specific force that is gravity, m/s².
GRAVITY = (8.0, 12.0)
#: Seconds over which a change of velocity is compared with the integral of the specific force;
#: bounds of the ratio of both; and the largest standard deviation of a direction, rad, of which
#: five are less than a quarter of a turn.
CHANGE, FORCES, SURE = 5.0, (0.6, 1.5), math.radians(15.0)
#: Angles of the forward axis from the direction of motion that are no other mounting, and by which
#: signed axes may miss one, rad.
MOUNTED, ALONG = math.radians(30.0), math.radians(20.0)


@dataclass(frozen=True)
class TurnRatio:
    """By how much the gyros turn about the vertical, over the change of a course.

    Attributes
    ----------
    ratio, sd : float
    share : float
        Of the changes of the course that the gyros explain, whatever their ratio.
    windows : int
        Of ten seconds each.
    """

    ratio: float
    sd: float
    share: float
    windows: int


def courses(gnss: pd.DataFrame, delay: float, step: float = 0.0) -> tuple[Array, Array] | None:
    """Times on the clock of the positions, (n,), and horizontal velocity then, (n, 2), m/s.

    Parameters
    ----------
    delay : float, s
        Of the velocities.
    step : float, s
        Without velocities, at least so long between the positions whose difference is taken.
    """
    time = index_of(gnss)
    by_velocity = usable(gnss, VELOCITY_SD[:2])
    if by_velocity.sum() > LEAST_STEPS:
        return time[by_velocity] - delay, values_of(gnss, VELOCITY)[by_velocity, :2]
    good = np.flatnonzero(usable(gnss, POSITION_SD[:2]))
    if step and len(good) > 1:
        good = good[:: max(1, round(step / float(np.median(np.diff(time[good])))))]
    if len(good) <= LEAST_STEPS + 1:
        return None
    time, place = time[good], values_of(gnss, GEODETIC)[good]
    moved = place_difference(place[1:], place[:-1])[:, :2]
    return 0.5 * (time[1:] + time[:-1]), moved / np.diff(time)[:, None]


def integrals(
    stamps: Array, imu: pd.DataFrame, columns: list[str], means: bool
) -> tuple[Array, Array]:
    """Integrals of three channels, (m, 3), at times, (m,), no closer than a course needs.

    Parameters
    ----------
    means : bool
        Each sample is the mean over the interval that ends with it.
    """
    last = len(stamps) - 1
    steps = filled(last, lambda part: np.diff(stamps[part.start : part.stop + 1]))
    # Steps are rounded decimal fractions.
    each = max(1, int(NODES / float(np.median(steps, overwrite_input=True)) + 1e-6))
    del steps
    kept = np.append(np.arange(0, last, each), last)
    channels = channels_of(imu, columns)
    sums = [running_integral(stamps, one, means=means)[kept] for one in channels]
    return stamps[kept], np.column_stack(sums)


def turn_ratio(
    gnss: pd.DataFrame, imu: pd.DataFrame, velocity_delay: float = 0.0
) -> TurnRatio | None:
    """Compare turns by the gyros with those of the course, in windows of ten seconds.

    Parameters
    ----------
    velocity_delay : float, s
        Of the receiver.

    Returns
    -------
    TurnRatio or None
        None if the course turns too little or too rarely, the gyros do not explain it, or the
        accelerometers do not measure gravity.

    Notes
    -----
    Whatever the mounting, the mean specific force is upward, and the rate about it is that of the
    heading: the ratio is 1 but for banks (the cosine of the bank, and more) and sideslip. The bias
    of the gyros is a second unknown. A window counts by the speeds at its ends, as the course of a
    slow one is noisier (`SLIPS`). The standard deviation is by each window's residual from the fit
    to the others (HC3 of MacKinnon and White 1985), as one turn may decide.
    """
    driven = _driven(gnss, imu, velocity_delay, WINDOW)
    if driven is None:
        return None
    at, speed, course, down, (first, last) = driven
    nodes, sums = integrals(index_of(imu), imu, GYRO, imu.attrs["sampling"] == "mean")
    turned = np.interp(at, nodes, sums @ down)
    weight = 1.0 / np.sqrt(speed[first] ** -2 + speed[last] ** -2 + SLIPS**-2)
    change = weight * (course[last] - course[first])
    X = weight[:, None] * np.column_stack([turned[last] - turned[first], at[last] - at[first]])
    fit, left, kept = _fit(X, change, GROSS * MAD_TO_SD)
    X, change, left = X[kept], change[kept], left[kept]
    if len(change) < max(LEAST_WINDOWS, COUNT * len(kept)):
        return None
    inverse = np.linalg.pinv(X.T @ X)
    alone = left / np.maximum(1.0 - np.einsum("ni,ij,nj->n", X, inverse, X), 0.1)
    spread = inverse @ (X.T * alone**2) @ X @ inverse
    slope, sd = float(fit[0]), math.sqrt(float(spread[0, 0]))
    steady = change - X[:, 1] * float(X[:, 1] @ change) / float(X[:, 1] @ X[:, 1])
    share = 1.0 - float(left @ left) / max(float(steady @ steady), 1e-300)
    if share < LEAST_SHARE or abs(slope) <= SIGNIFICANT * sd:
        return None
    return TurnRatio(1.0 / slope, sd / slope**2, share, len(change))


def _driven(
    gnss: pd.DataFrame, imu: pd.DataFrame, velocity_delay: float, length: float
) -> tuple[Array, Array, Array, Array, NDArray[np.int64]] | None:
    """Return what turns and accelerations of a drive are compared with, in windows of a length, s.

    Times, speeds and courses, each (n,), in s, m/s and rad; down in body axes, (3,); and the first
    and last number of each window, (2, m). None without gravity or with too few windows.
    """
    told = courses(gnss, velocity_delay, COURSE_STEP)
    if told is None or ACCEL[0] not in imu.columns:
        return None
    at, velocity = told
    speed = np.hypot(*velocity.T)
    windows = _windows(at, speed, index_of(imu), length)
    force = np.array([float(one.mean()) for one in channels_of(imu, ACCEL)])
    size = float(np.linalg.norm(force))
    if windows.shape[1] < LEAST_WINDOWS or not GRAVITY[0] < size < GRAVITY[1]:
        return None
    course = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    return at, speed, course, -force / size, windows


def _fit(X: NDArray[Any], y: NDArray[Any], gross: float) -> tuple[NDArray[Any], Array, Array]:
    """Fit by least squares without residuals of more than `gross` times the median.

    Returns the fit, the size of all residuals, and which are kept.
    """
    kept = np.ones(len(y), dtype=bool)
    for _ in range(10):
        fit, *_ = np.linalg.lstsq(X[kept], y[kept], rcond=None)
        left = np.abs(y - X @ fit)
        before, kept = kept, left <= gross * float(np.median(left[kept]))
        if np.array_equal(before, kept):
            break
    return fit, left, kept


def _windows(at: Array, speed: Array, stamps: Array, length: float) -> NDArray[np.int64]:
    """Return the first and last number, (2, m), of windows of a length, in s, in which it moves."""
    usual = (speed > MOVES) & (at >= stamps[0]) & (at <= stamps[-1])
    breaks = np.cumsum(~usual | np.append(False, np.diff(at) > LONGEST))
    pairs = []
    begin = 0
    ends = np.searchsorted(at, at + length)
    while begin < len(at) and (end := int(ends[begin])) < len(at):
        whole = usual[begin] and breaks[begin] == breaks[end]
        if whole:
            pairs.append((begin, end))
        begin = end if whole else begin + 1
    return np.array(pairs, dtype=np.int64).reshape(-1, 2).T


def forward_direction(
    gnss: pd.DataFrame, imu: pd.DataFrame, velocity_delay: float = 0.0
) -> tuple[Array, Array, float] | None:
    """Find where the direction of motion is in the axes of the body.

    Parameters
    ----------
    velocity_delay : float, s
        Of the receiver.

    Returns
    -------
    forward, down : ndarray, (3,)
        Unit vectors in body axes, the first across the second.
    sd : float, rad
        Of the first about the second. None if the body does not accelerate as a vehicle that
        points along its course, or too little.

    Notes
    -----
    In windows of five seconds the change of the speed, and the speed times the change of the
    course, are the integrals of the specific force forward and right of a body that turns with its
    course. As complex numbers they differ by one factor, whose angle is that of the mounting; the
    tilt of the mean specific force is a second unknown.
    """
    driven = _driven(gnss, imu, velocity_delay, CHANGE)
    if driven is None:
        return None
    at, speed, course, down, (first, last) = driven
    across = np.eye(3)[np.abs(down).argmin()]
    across -= down * (across @ down)
    across /= np.linalg.norm(across)
    sideways = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(course)))
    change = (speed + 1j * sideways)[last] - (speed + 1j * sideways)[first]
    nodes, sums = integrals(index_of(imu), imu, ACCEL, imu.attrs["sampling"] == "mean")
    gained = np.interp(at, nodes, sums @ across) + 1j * np.interp(
        at, nodes, sums @ np.cross(down, across)
    )
    gained = gained[last] - gained[first]
    X = np.column_stack([change, at[last] - at[first]])
    fit, left, kept = _fit(X, gained, GROSS)
    if kept.sum() < max(LEAST_WINDOWS, COUNT * len(kept)):
        return None
    X, gained, left = X[kept], gained[kept], left[kept]
    alone = gained - X[:, 1] * (X[:, 1] @ gained) / (X[:, 1] @ X[:, 1])
    share = 1.0 - float(left @ left) / max(float((np.abs(alone) ** 2).sum()), 1e-300)
    ratio, inverse = complex(fit[0]), np.linalg.pinv(X.conj().T @ X)
    spread = inverse @ (X.conj().T * left**2) @ X @ inverse
    sd = math.sqrt(float(spread[0, 0].real)) / max(abs(ratio), 1e-300)
    if share < LEAST_SHARE or not FORCES[0] < abs(ratio) < FORCES[1] or sd > SURE:
        return None
    way = ratio / abs(ratio)
    return way.real * across + way.imag * np.cross(down, across), down, sd


def check_forward(
    gnss: pd.DataFrame,
    imu: pd.DataFrame,
    velocity_delay: float = 0.0,
    mounting_yaw: float = 0.0,
) -> list[Finding]:
    """Report a body whose forward axis does not point where it drives.

    Parameters
    ----------
    velocity_delay : float, s
        Of the receiver.
    mounting_yaw : float, rad
        Heading of the forward axis less that of the vehicle, as it is configured.
    """
    found = forward_direction(gnss, imu, velocity_delay)
    if found is None:
        return []
    forward, down, sd = found
    c, s = math.cos(mounting_yaw), math.sin(mounting_yaw)
    axis = c * forward + s * np.cross(down, forward)  # where the forward axis then is
    off = math.acos(float(np.clip(axis[0], -1.0, 1.0)))
    if off < MOUNTED or off < SIGNIFICANT * sd:
        return []
    body = np.array([forward, np.cross(down, forward), down])
    order = np.abs(body).argmax(axis=1)
    signs = np.sign(body[np.arange(3), order])
    near = bool((np.abs(body[np.arange(3), order]) > math.cos(ALONG)).all())
    yaw = math.degrees(math.atan2(float(body[1, 0]), float(body[0, 0])))
    data: dict[str, Any] = {
        "off_deg": math.degrees(off),
        "sd_deg": math.degrees(sd),
        "yaw_deg": yaw,
        "fixes": source_of(gnss),
    }
    where: dict[str, Any] = {"file": source_of(imu), "quantity": "axes"}
    if not near:
        return [Finding("navigation.forward-not-along-course", data=data, **where)]
    # Axes of the sensor that point forward, right, down, by those that are taken to do so.
    of_sensor = str(imu.attrs.get("sensor_axes", "x,y,z")).split(",")
    names = []
    for k, sign in zip(order, signs, strict=True):
        letter = of_sensor[k].removeprefix("-")
        minus = of_sensor[k].startswith("-") != (sign < 0.0)
        names.append(f"-{letter}" if minus else letter)
    data["axes"] = ",".join(names)
    return [Finding("navigation.forward-axis-elsewhere", data=data, **where)]


def _is_about(ratio: float, factor: float) -> bool:
    return factor / ABOUT < ratio < factor * ABOUT


def unit_of_turns(gnss: pd.DataFrame, imu: pd.DataFrame) -> Finding | None:
    """Return the unit, of rad/s and deg/s, in which gyros turn as the course does.

    None if the course does not show it.

    Parameters
    ----------
    imu : DataFrame
        Its rates are read as rad/s.
    """
    found = turn_ratio(gnss, imu)
    for unit, factor in (("rad/s", 1.0), ("deg/s", DEGREES)):
        if found is not None and _is_about(found.ratio, factor):
            return Finding(
                "navigation.gyro-unit-by-course",
                file=source_of(imu),
                quantity="gyro",
                unit=unit,
                fixes=source_of(gnss),
                ratio=found.ratio / factor,
                sd=found.sd / factor,
                windows=found.windows,
                share=found.share,
            )
    return None


def check_turns(
    gnss: pd.DataFrame, imu: pd.DataFrame, velocity_delay: float = 0.0
) -> list[Finding]:
    """Refuse gyros of another unit, and report such as turn otherwise than the course.

    Raises
    ------
    DataError
        The gyros turn by as much as deg/s are more than rad/s, or less.
    """
    found = turn_ratio(gnss, imu, velocity_delay)
    if found is None:
        return []
    clear = found.share > TOO_FAR_SHARE and found.ratio - SIGNIFICANT * found.sd > 1.0
    if LEAST < found.ratio < (TOO_FAR if clear else MOST):
        return []
    facts: dict[str, Any] = {
        "file": source_of(imu),
        "quantity": "gyro",
        "fixes": source_of(gnss),
        "ratio": found.ratio,
        "sd": found.sd,
        "share": found.share,
        "windows": found.windows,
    }
    for unit, factor in (("deg/s", DEGREES), ("rad/s", 1.0 / DEGREES)):
        if _is_about(found.ratio, factor):
            raise DataError("navigation.course-shows-gyro-unit", unit=unit, **facts)
    code = "navigation.course-turns-opposite" if found.ratio < 0.0 else "navigation.course-turns"
    return [Finding(code, **facts)]
