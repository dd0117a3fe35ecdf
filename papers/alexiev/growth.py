"""How errors of the sensors grow into attitude and position: the laws of Section 2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
    amount,
)
from strapdown import rotation
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.constants import STANDARD_GRAVITY
from strapdown.evaluation import dead_reckon
from strapdown.increments import increments_from_imu
from strapdown.sensors import SENSORS, RestStretch, load_sensor
from strapdown.simulation import ImuErrors, Motion, Pulse, PulseMotion, TriadErrors, simulate_imu
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]

SECONDS, RATE = 60.0, 50.0
ACCEL_BIAS = 0.01  # m/s²
# Small enough that the tilt is its own sine to 1e-7 after a minute.
GYRO_BIAS = 1e-5  # rad/s
FIT_FROM = 5.0  # s
_STILL = PulseMotion((), SECONDS)
# It turns on after the last sample, so that no edge is sampled.
_TURNING = PulseMotion((Pulse(2, 0.0, 2.0 * SECONDS, 1.0),), SECONDS)


@dataclass(frozen=True)
class Course:
    """An error over time, and the power law fitted to it.

    Attributes
    ----------
    time : ndarray, (n,), s
    error : ndarray, (n,)
    exponent : float
        Slope of the logarithm of the error on that of time.
    coefficient : float
        What multiplies ``time**round(exponent)``, at the end.
    """

    time: Array
    error: Array
    exponent: float
    coefficient: float


def course(time: Array, error: Array) -> Course:
    """Fit a power law from `FIT_FROM` on; exponent 0 where there is no error at all."""
    late = time >= FIT_FROM
    if not np.all(error[late] > 0.0):
        return Course(time, error, 0.0, 0.0)
    exponent = float(np.polyfit(np.log(time[late]), np.log(error[late]), 1)[0])
    return Course(time, error, exponent, float(error[-1] / time[-1] ** round(exponent)))


def position_course(errors: ImuErrors, motion: Motion = _STILL) -> Course:
    """Reckon the position of a sensor that stays in its place, from its true attitude.

    Parameters
    ----------
    errors : ImuErrors
    motion : Motion
        Rotation about the sensor.

    Returns
    -------
    Course
        Distance from the place, m.
    """
    imu, truth = simulate_imu(motion, errors, rate=RATE)
    start = truth[QUATERNION].to_numpy()[0]
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu), start)
    zero = (0.0, 0.0, 0.0)
    first, last = (RestStretch(t, t, zero, zero, None) for t in (0.0, SECONDS))
    leg = dead_reckon(run, imu, first, last, gravity=STANDARD_GRAVITY, levelled=False)
    return course(leg.time, np.sqrt(np.square(leg.position).sum(axis=1)))


def attitude_course(errors: ImuErrors, motion: Motion = _STILL) -> Course:
    """Return the error of the exact quaternion over time, rad."""
    imu, truth = simulate_imu(motion, errors, rate=RATE, accelerometer=False)
    known = truth[QUATERNION].to_numpy()
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu), known[0])
    off = rotation.rotation_angle(run.attitude[QUATERNION].to_numpy(), known)
    return course(truth.index.to_numpy(dtype=np.float64), np.radians(off))


@dataclass(frozen=True)
class Laws:
    """Every course that the statements on growth rest on.

    Attributes
    ----------
    accel, accel_turning : Course
        Position by a bias of the x accelerometer; the body at rest, and turning about the
        vertical at 1 rad/s.
    tilt : Course
        Attitude by a bias of the y gyro.
    tilt_turning : Course
        The same while the body turns.
    gyro, gyro_vertical : Course
        Position by a bias of the y gyro, and of the z gyro.
    """

    accel: Course
    accel_turning: Course
    tilt: Course
    tilt_turning: Course
    gyro: Course
    gyro_vertical: Course


def laws() -> Laws:
    """Simulate all of them."""
    accel = ImuErrors(TriadErrors(), TriadErrors(bias=(ACCEL_BIAS, 0.0, 0.0)))
    about_y = ImuErrors(TriadErrors(bias=(0.0, GYRO_BIAS, 0.0)), TriadErrors())
    about_z = ImuErrors(TriadErrors(bias=(0.0, 0.0, GYRO_BIAS)), TriadErrors())
    return Laws(
        position_course(accel),
        position_course(accel, _TURNING),
        attitude_course(about_y),
        attitude_course(about_y, _TURNING),
        position_course(about_y),
        position_course(about_z),
    )


def figure(found: Laws) -> Figure:
    """Return position error against time with the laws beside it."""
    t = found.accel.time[1:]
    return Figure(
        "growth",
        "How errors grow",
        "Distance from the true place, in which the sensor stays the whole time. The law as "
        "printed for the gyro has no g; what is measured is g times that.",
        f"Accelerometer bias {ACCEL_BIAS:g} m/s² on x, gyro bias {GYRO_BIAS:g} rad/s about y, "
        f"each alone; at rest and level, {RATE:g} Hz, attitude known at the start.",
        "time, s",
        (
            FigurePanel(
                "position error, m",
                (
                    Trace("accelerometer bias", t, found.accel.error[1:]),
                    Trace("δa t²/2", t, ACCEL_BIAS * t**2 / 2.0, reference=True),
                    Trace("gyro bias", t, found.gyro.error[1:]),
                    Trace("δφ t³/6, as printed", t, GYRO_BIAS * t**3 / 6.0, reference=True),
                    Trace(
                        "g δφ t³/6", t, STANDARD_GRAVITY * GYRO_BIAS * t**3 / 6.0, reference=True
                    ),
                ),
                log=True,
            ),
        ),
        x_log=True,
    )


def _near(value: float, wanted: float) -> bool:
    return abs(value - wanted) < 0.01 * wanted


def accel_growth(at_rest: Course, turning: Course) -> Statement:
    """Judge δa t²/2, for a bias on a body at rest and on one that turns."""
    law = _near(at_rest.exponent, 2.0) and _near(at_rest.coefficient, 0.5 * ACCEL_BIAS)
    less = turning.error[-1] < 0.5 * at_rest.error[-1]
    if law and less:
        verdict, condition = HOLDS_WHEN, "the bias is constant and the body keeps its attitude"
    else:
        verdict, condition = (HOLDS if law else DOES_NOT_HOLD), ""
    return Statement(
        "growth-accel",
        "Section 2",
        "the corresponding error in distance calculated after two integrations will be δa·t²/2, "
        "e.g., it is proportional to the square of the time",
        verdict,
        condition,
        "Fitted to a minute of dead reckoning. A body that turns turns the bias with it, and its "
        "error grows more slowly: with the time, and not its square.",
        (
            Evidence("exponent of time", at_rest.exponent),
            Evidence("error over δa t²/2", at_rest.coefficient / (0.5 * ACCEL_BIAS)),
            Evidence("after 60 s, at rest", float(at_rest.error[-1]), "m"),
            Evidence("after 60 s, turning at 1 rad/s", float(turning.error[-1]), "m"),
        ),
        "growth",
    )


def attitude_growth(at_rest: Course, turning: Course) -> Statement:
    """Judge that the attitude error by a gyro's bias grows with time."""
    law = _near(at_rest.exponent, 1.0) and _near(at_rest.coefficient, GYRO_BIAS)
    less = turning.error[-1] < 0.5 * at_rest.error[-1]
    if law and less:
        verdict = HOLDS_WHEN
        condition = "the error is a constant bias and the body does not turn about another axis"
    else:
        verdict, condition = (HOLDS if law else DOES_NOT_HOLD), ""
    return Statement(
        "growth-attitude",
        "Section 2",
        "If the gyro measures turn rate with error equal to δφ, after integration the error in "
        "calculated attitude will be proportional to δφ·t.",
        verdict,
        condition,
        "While the body turns about the vertical, a bias about a horizontal body axis goes round "
        "with it and its effect stays bounded.",
        (
            Evidence("exponent of time", at_rest.exponent),
            Evidence("error over δφ t", at_rest.coefficient / GYRO_BIAS),
            Evidence(
                "turning at 1 rad/s: share of that after 60 s",
                float(turning.error[-1] / at_rest.error[-1]),
            ),
        ),
        "growth",
    )


def gyro_growth(horizontal: Course, vertical: Course) -> Statement:
    """Judge δφ t³/6, for a bias about a horizontal and about the vertical axis."""
    cubic = _near(horizontal.exponent, 3.0)
    ratio = horizontal.coefficient / (GYRO_BIAS / 6.0)
    if cubic and _near(ratio, 1.0):
        verdict, condition = HOLDS, ""
    elif cubic and _near(ratio, STANDARD_GRAVITY):
        verdict = HOLDS_WHEN
        condition = "it is multiplied by g, for a bias about a horizontal axis"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "growth-gyro",
        "Section 2",
        "the error in its calculation is propagated over distance calculation (double integration) "
        "and the final error is equal to δφ·t³/6",
        verdict,
        condition,
        "A tilt leaks gravity into the horizontal: g δφ t³/6. As printed it is no length. A bias "
        "about the vertical moves nothing that stays in its place.",
        (
            Evidence("exponent of time", horizontal.exponent),
            Evidence("error over δφ t³/6", ratio, "m/s²"),
            Evidence("after 60 s", float(horizontal.error[-1]), "m"),
            Evidence("after 60 s, bias about the vertical", float(vertical.error[-1]), "m"),
        ),
        "growth",
    )


# ==================================================================================================
# Which bias leads when, from what the catalogue says of sensors
# ==================================================================================================

EARTH_RATE = 15.041 / 3600.0  # deg/s, relative to the stars


def crossovers() -> dict[str, float]:
    """Return for each sensor with both triads the time in s from which its gyro's bias leads.

    Returns
    -------
    dict
        ``3 b_a / (g b_g)``, where ``b_a t²/2 = g b_g t³/6``, with typical biases: the standard
        deviation of the sheet, or its bound over √3.
    """
    found = {}
    for name in SENSORS:
        spreads = load_sensor(name).spreads
        if "bias" in spreads.get("gyro", {}) and "bias" in spreads.get("accel", {}):
            gyro, accel = (
                spreads[t]["bias"].size[0] / (1.0 if spreads[t]["bias"].kind == "sd" else 3**0.5)
                for t in ("gyro", "accel")
            )
            if gyro > 0.0:
                found[name] = float(3.0 * accel / (STANDARD_GRAVITY * gyro))
    return found


def gyro_biases() -> dict[str, float]:
    """Return the typical gyro bias of each sensor for phones, deg/s."""
    found = {}
    for name in SENSORS:
        sensor = load_sensor(name)
        if sensor.grade == "phone" and "bias" in sensor.spreads.get("gyro", {}):
            spread = sensor.spreads["gyro"]["bias"]
            typical = spread.size[0] / (1.0 if spread.kind == "sd" else 3**0.5)
            found[name] = float(np.degrees(typical))
    return found


def gyros_lead(times: dict[str, float]) -> Statement:
    """Judge that gyros matter more, from the time in s at which each sensor's gyro leads."""
    longest = max(times, key=lambda name: times[name])
    shortest = min(times, key=lambda name: times[name])
    median = float(np.median(list(times.values())))
    if times[longest] <= 0.0:
        verdict, condition = HOLDS, ""
    elif np.isfinite(times[longest]):
        verdict = HOLDS_WHEN
        condition = "the time is longer than 3 δa / (g δφ), which each sensor has of its own"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "gyros-lead",
        "Section 1",
        "the errors in gyros and respectively in determining the attitude influence much more the "
        "final result of the navigation in comparison with the errors in accelerometers",
        verdict,
        condition,
        f"δa t²/2 leads first, g δφ t³/6 later. For the biases of {len(times)} sensors of the "
        "catalogue, uncalibrated, the time at which the gyro takes the lead:",
        (
            Evidence(f"shortest, {shortest}", times[shortest], "s"),
            Evidence("median", median, "s"),
            Evidence(f"longest, {longest}", times[longest], "s"),
        ),
        "growth",
    )


def earth_rate_small(biases: dict[str, float]) -> Statement:
    """Judge that the Earth's rate may be left out, from gyro biases in deg/s."""
    least = min(biases, key=lambda name: biases[name])
    ratio = biases[least] / EARTH_RATE
    minutes = 1.0 / EARTH_RATE / 60.0
    if ratio > 10.0:
        verdict = HOLDS_WHEN
        condition = (
            f"the bias is that of the sheet; a run of {minutes:.0f} minutes or more with the bias "
            "taken off is 1° or more off by the Earth alone"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "earth-rate",
        "Section 3",
        "Because of the fact, that the low accuracy gyro sensors are considered, the expressions "
        "for world rotation and the influence of linear velocity onto the measured turn rate are "
        "excluded.",
        verdict,
        condition,
        "The Earth turns by 15° an hour. The least typical bias of a phone's gyro in the catalogue "
        f"({least}) is {amount(ratio)} times that.",
        (
            Evidence("the Earth", EARTH_RATE, "°/s"),
            Evidence(f"least typical bias, {least}", biases[least], "°/s"),
            Evidence("time for 1° by the Earth", minutes, "min"),
        ),
    )
