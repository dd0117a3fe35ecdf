"""The misprints (8) and (19), the missing (16)-(17), and the sign of (20)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from papers.tadic.experiment import END, PLATFORMS, Experiments
from papers.tadic.simplifications import (
    SIMPLIFICATIONS,
    TRIPS,
    Trip,
    error_course,
    predicted_errors,
)
from strapdown import rotation
from strapdown.dsp import running_integral
from strapdown.earth import radii_of_curvature
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.sensors import ImuErrors, TriadErrors
from strapdown.simulation import (
    CRASHES,
    CrashMotion,
    CrashScenario,
    HaversinePulse,
    Origin,
    simulate_imu,
)

Array = NDArray[np.float64]

RATE = 200.0  # Hz
FINE = 2000  # steps of the integral of exact forces
LATITUDE = 60.0  # deg, of the flight
FLIGHT_SPEED, HEIGHT, HOUR = 230.0, 1e4, 3600.0


# --- (8) ---------------------------------------------------------------------------------------


def transport_as_printed() -> Statement:
    """Judge the third component of (8)."""
    printed = replace(SIMPLIFICATIONS["every term"], as_printed=True)
    pulse = HaversinePulse(0.1, 0.113, (0.0, -7.2, 0.0), (0.0, 0.0, 87.0))
    east = Trip(
        "",
        CrashMotion(END, Origin(45.0, 20.0, 100.0), (0.0, 7.1, 0.0), (pulse,), heading_deg=90.0),
        2000.0,
        "free",
    )
    wrong, right = (error_course(east, m) for m in (printed, SIMPLIFICATIONS["every term"]))
    apart = float((wrong["position_m"] - right["position_m"]).abs().max())
    radius = radii_of_curvature(LATITUDE)[1] + HEIGHT
    turned = math.degrees(2.0 * FLIGHT_SPEED * math.tan(math.radians(LATITUDE)) / radius * HOUR)
    return transport_from(apart, float(turned))


def transport_from(crash: float, flight: float) -> Statement:
    """Judge from what the printed sign does in the crash, m, and in an hour's flight, deg."""
    if flight < 1e-3:
        verdict, condition = HOLDS, ""
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "eq8",
        "Eq. (8)",
        "V_E tan φ / (R_p + h)",
        verdict,
        condition,
        "The third component lacks its minus. Eastward, the heading is then turned by twice the "
        "transport rate. In 750 ms of a crash it is nothing, on a flight everything.",
        (
            Evidence("place in 750 ms of the crash, heading east", 1e3 * crash, "mm"),
            Evidence("heading after an hour at 230 m/s, 60° north", flight, "°"),
        ),
    )


# --- (19) --------------------------------------------------------------------------------------


def as_printed(q: Array) -> Array:
    """Matrices of (19) with C23 and C31 as printed, (n, 3, 3), from unit quaternions (n, 4)."""
    C = np.array(rotation.dcm_from_quaternion(q))
    w, x, y, z = np.atleast_2d(q).T
    C = C.reshape(-1, 3, 3)
    C[:, 1, 2], C[:, 2, 0] = 2.0 * (y * z + w * x), 2.0 * (x * z + w * y)
    return np.asarray(C)


def matrix_as_printed(crash: CrashScenario | None = None) -> Statement:
    """Judge (19)."""
    scenario = crash or CRASHES["pole"]
    time = scenario.start + np.linspace(0.0, END, FINE + 1)
    q, force = scenario.motion.attitude(time), scenario.motion.specific_force(time)
    wrong = np.einsum("nij,nj->ni", as_printed(q), force) - rotation.rotate(q, force)
    rolled = np.asarray(rotation.quaternion_from_euler([1.0, 0.0, 0.0]), dtype=np.float64)
    still = np.array([0.0, 0.0, -9.80665])
    aside = as_printed(rolled)[0] @ still - rotation.rotate(rolled, still)
    moved = float(np.linalg.norm(_twice(wrong, time)))
    residual = as_printed(rolled)[0]
    return matrix_from(
        float(np.abs(residual @ residual.T - np.eye(3)).max()),
        0.5 * float(np.linalg.norm(aside)) * END**2,
        moved,
    )


def _twice(values: Array, time: Array) -> Array:
    """Integral of the integral at the end, by trapezoids."""
    return np.asarray(np.trapezoid(running_integral(time, values), time, axis=0))


def matrix_from(residual: float, rolled: float, crash: float) -> Statement:
    """Judge from C C^T - 1, and the place after 750 ms at 1° of roll and in the crash, m."""
    holds = residual < 1e-9
    return Statement(
        "eq19",
        "Eq. (19)",
        "2(q2 q3 + q0 q1), 2(q1 q3 + q0 q2)",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        "C23 and C31 lack their minus, and the matrix is no rotation. A level car does not notice. "
        "The simulated one puts its nose down by 2° while it is struck; that, and a degree of "
        "roll, cost about a decimetre, so that the paper's result would not betray it.",
        (
            Evidence("C Cᵀ − 1 at 1° of roll, largest element", residual),
            Evidence("place after 750 ms at rest, 1° of roll", rolled, "m"),
            Evidence("place after 750 ms of the crash", crash, "m"),
        ),
    )


# --- (16)-(17) ---------------------------------------------------------------------------------


def increments_missing(crash: CrashScenario | None = None) -> Statement:
    """Judge that (15) follows from (7) and (8), with what is missing between."""
    exact, first = (place_error(kind, crash) for kind in ("exact", "first order"))
    return increments_from(exact, first, norm_growth())


def norm_growth(rate_deg: float = 87.0, seconds: float = 0.537) -> float:
    """By how much (19) grows with increments [1, θ/2] that nobody normalises."""
    theta = math.radians(rate_deg) / RATE
    return float((1.0 + 0.25 * theta * theta) ** round(seconds * RATE) - 1.0)


def place_error(kind: str, crash: CrashScenario | None = None) -> float:
    """Place after 750 ms, forces exact and attitude by increments at 200 Hz, m.

    Parameters
    ----------
    kind : {'exact', 'first order'}
        Of the increments of each turn: [cos ½|θ|, …], or [1, θ/2].
    crash : CrashScenario, optional
    """
    scenario = crash or CRASHES["pole"]
    motion, steps = scenario.motion, round(END * RATE)
    time = scenario.start + np.arange(steps + 1) / RATE
    rate = motion.rate(time)
    turns = 0.5 / RATE * (rate[1:] + rate[:-1])
    q = np.empty((steps + 1, 4))
    q[0] = motion.attitude(time[:1])[0]
    for k, theta in enumerate(turns):
        if kind == "exact":
            step = rotation.quaternion_from_rotation_vector(theta)
        else:
            step = np.array([1.0, *(0.5 * theta)])
        q[k + 1] = rotation.compose(q[k], step) if kind == "exact" else _product(q[k], step)
    force = motion.specific_force(time)
    true = rotation.rotate(motion.attitude(time), force)
    # (19) of a quaternion that is not of unit length is as much longer as its square.
    size = (q * q).sum(axis=1, keepdims=True)
    own = size * rotation.rotate(q / np.sqrt(size), force)
    return float(np.linalg.norm(_twice(own - true, time)))


def _product(a: Array, b: Array) -> Array:
    """Product of two quaternions as (11) has it, of any length."""
    w, v = a[0], a[1:]
    s, u = b[0], b[1:]
    return np.array([w * s - v @ u, *(w * u + s * v + np.cross(v, u))])


def increments_from(exact: float, first: float, longer: float) -> Statement:
    """Judge from the place by exact and first-order increments, m, and by how much (19) grows."""
    if first < 2.0 * exact:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "(16) and (17), which are missing, say that the increment of a turn θ is [cos ½|θ|, "
            "(θ/|θ|) sin ½|θ|]; with [1, ½θ] and no normalising the matrix (19) grows by "
            f"{amount(100.0 * longer, '%')}"
        )
    return Statement(
        "eq16-17",
        "Eqs. (15)-(17)",
        "Equation (15) presents quaternion increment calculated from (7) and (8).",
        verdict,
        condition,
        "Equations (16) and (17) are not in the paper. Exact forces of the simulated crash, turned "
        "by an attitude of increments at 200 Hz; for the level the same increment, conjugated, "
        "from the left.",
        (
            Evidence("place after 750 ms, increment of a turn", 1e3 * exact, "mm"),
            Evidence("the same, [1, ½θ] without normalising", 1e3 * first, "mm"),
            Evidence("growth of the matrix, 87°/s for 537 ms", 100.0 * longer, "%"),
        ),
    )


# --- (20) --------------------------------------------------------------------------------------


def small_angles() -> Statement:
    """Judge (20) against the exact rotation."""
    off = {}
    for angle in (1.0, 5.0):
        phi = np.radians(angle) * np.array([1.0, 2.0, 2.0]) / 3.0
        exact = rotation.dcm_from_rotation_vector(phi)
        off[angle] = float(np.abs(exact - (np.eye(3) + _cross(phi))).max())
        if angle == 1.0:
            other = float(np.abs(exact.T - (np.eye(3) + _cross(phi))).max())
    return small_angles_from(off, other)


def _cross(v: Array) -> Array:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def small_angles_from(off: dict[float, float], other: float) -> Statement:
    """Judge from the largest element off by angle in deg, and with the other meaning of φ at 1°."""
    if off[1.0] > 1e-3:
        verdict, condition = DOES_NOT_HOLD, ""
    elif other > 10.0 * off[1.0]:
        verdict = HOLDS_WHEN
        condition = (
            "φ is the turn that carries the computed axes into the true ones; many texts mean the "
            "opposite one, and have the other sign"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "eq20",
        "Eq. (20)",
        "derived under the assumption that the angles φ_N, φ_E, φ_D are small",
        verdict,
        condition,
        "Largest element by which (20), which is 1 + [φ×], differs from the exact rotation. What "
        "is neglected is of the second order: ½φ².",
        (
            *(Evidence(f"off at {a:g}°", v) for a, v in off.items()),
            Evidence("off at 1°, φ meant the other way", other),
        ),
    )


# ==================================================================================================
# Coriolis, the Earth's rate and other simplifications over a crash, beside the sensors
# ==================================================================================================

LONGER = ("10 s", "60 s")
# What may be left out beside a sensor: a tenth of its error adds half a percent to it.
NEGLIGIBLE = 0.1
# A bias of 0.2 m/s² and one of 0.3 deg/s, as the paper's own sensors have them.
ACCEL_BIAS, GYRO_BIAS = 0.2, np.radians(0.3)
GRAVITY = 9.80665


def costs() -> dict[str, dict[str, float]]:
    """Largest error of the place by simplification and trip, m: measured in the crash.

    On the longer trips predicted, as `predicted_errors` does.
    """
    found = {}
    for name, used in SIMPLIFICATIONS.items():
        found[name] = {"crash": float(error_course(TRIPS["crash"], used)["position_m"].max())}
        for trip in LONGER:
            found[name][trip] = float(predicted_errors(TRIPS[trip], name)["position_m"])
    return found


def sensor(made: Experiments) -> dict[str, float]:
    """Error of the place that the paper's sensors make, m; on longer trips by their biases."""
    ends = np.concatenate([made.ends(n) for n in PLATFORMS])
    out = {"crash": float(np.sqrt((ends**2).sum(axis=1).mean()))}
    for name, time in zip(LONGER, (10.0, 60.0), strict=True):
        out[name] = float(np.hypot(0.5 * ACCEL_BIAS * time**2, GRAVITY * GYRO_BIAS * time**3 / 6.0))
    return out


def table(found: dict[str, dict[str, float]], sensors: dict[str, float]) -> Table:
    """What each simplification costs, beside the sensors."""
    rows = [
        (name, tuple(v if v >= 1e-5 else None for v in by_trip.values()))
        for name, by_trip in found.items()
        if name != "every term"
    ]
    rows.append(("the paper's sensors", tuple(sensors.values())))
    return Table(
        "simplifications",
        "What the paper leaves out",
        "Largest error of the place in m with perfect sensors: in 750 ms of the crash, measured; "
        "in 10 and 60 s of driving at 20 m/s to the north-east, predicted. Below 10 µm a dash. "
        "Last, the paper's sensors: in the crash the RMS of all platforms and experiments, later "
        "what biases of 0.2 m/s² and 0.3°/s make.",
        ("left out", "750 ms of the crash, m", "10 s, m", "60 s, m"),
        tuple(rows),
    )


def coriolis(found: dict[str, float], sensors: dict[str, float]) -> Statement:
    """Judge that the Coriolis correction could be left out; costs and sensors in m by trip."""
    return _neglected(
        found,
        sensors,
        "coriolis",
        "Section 2.1",
        "we did not consider Coriolis correction due to very limited sensor performance",
        "The Coriolis term left out of the paper's equations, perfect sensors, against the error "
        "of its sensors in the same time.",
    )


def earth_rate(found: dict[str, float], sensors: dict[str, float]) -> Statement:
    """Judge that the Earth's rotation may be neglected; costs and sensors in m by trip."""
    return _neglected(
        found,
        sensors,
        "earth-rate",
        "Section 2.1, Eq. (7)",
        "which can be neglected for short navigation with low performance sensors",
        "The Earth's rate left out of attitude and Coriolis term, perfect sensors, against the "
        "error of the paper's sensors in the same time.",
    )


def _neglected(
    found: dict[str, float],
    sensors: dict[str, float],
    key: str,
    place: str,
    quote: str,
    because: str,
) -> Statement:
    shares = {trip: found[trip] / sensors[trip] for trip in found}
    long = [trip for trip in LONGER if shares[trip] >= NEGLIGIBLE]
    if shares["crash"] >= NEGLIGIBLE:
        verdict, condition = DOES_NOT_HOLD, ""
    elif long:
        verdict = HOLDS_WHEN
        condition = f"it is shorter than {long[0]}, where it is {amount(100.0 * shares[long[0]])} %"
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        key,
        place,
        quote,
        verdict,
        condition,
        because,
        (
            Evidence("750 ms of the crash", 1e3 * found["crash"], "mm"),
            Evidence("sensors in the same time", 1e3 * sensors["crash"], "mm"),
            *(Evidence(f"{trip} at 20 m/s", found[trip], "m") for trip in LONGER),
            *(Evidence(f"sensors, {trip}", sensors[trip], "m") for trip in LONGER),
        ),
    )


# ==================================================================================================
# Which error leads out of a crash, and what grows with time or with distance
# ==================================================================================================

TIMES = (5.0, 10.0)  # s, "periods of up to 5-10 s"
# Biases as the paper's sensors have them after a calibration at rest; speeds are the question.


SPEED = 0.5  # m/s: what a speedometer of 2.5 % tells of 20 m/s
SCALE = 0.01


@dataclass(frozen=True)
class Ranked:
    """Errors of the place at one time of a steady drive at 20 m/s, m."""

    time: float
    speed: float
    accel: float
    gyro: float


def ranked() -> tuple[Ranked, ...]:
    """Navigate 10 s with each error alone; the speed's is straight."""
    trip = TRIPS["10 s"]
    accel = _course(trip, ImuErrors(accel=TriadErrors(bias=(ACCEL_BIAS, 0.0, 0.0))))
    gyro = _course(trip, ImuErrors(TriadErrors(bias=(0.0, GYRO_BIAS, 0.0))))
    return tuple(Ranked(t, SPEED * t, _at(accel, t), _at(gyro, t)) for t in TIMES)


def _course(trip: Trip, errors: ImuErrors) -> pd.Series:
    imu, _ = simulate_imu(trip.motion, errors, rate=trip.rate)
    steps = motion_increments(imu, interpolation="cubic")
    return error_course(trip, NorthEastDown(), steps)["position_m"]


def _at(course: pd.Series, time: float) -> float:
    stamps = course.index.to_numpy(dtype=np.float64)
    return float(np.interp(time, stamps, course.to_numpy(dtype=np.float64)))


def ranking(found: tuple[Ranked, ...]) -> Statement:
    """Judge speed before accelerometer before gyro, from the errors at `TIMES`."""
    # From here on the speed leads, and up to here the gyro follows.
    speeds = [r.accel / r.time for r in found]
    gyros = [float(np.degrees(GYRO_BIAS)) * r.accel / r.gyro for r in found]
    in_order = all(r.speed > r.accel > r.gyro for r in found)
    some = all(r.accel > r.gyro for r in found)
    if in_order:
        verdict, condition = HOLDS, ""
    elif some:
        verdict = HOLDS_WHEN
        condition = (
            f"the speed is not known to {amount(speeds[0], 'm/s')} at 5 s and "
            f"{amount(speeds[-1], 'm/s')} at 10 s, and the gyro's bias is below "
            f"{amount(gyros[-1], '°/s')}; with a measured speed the accelerometer leads"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "ranking",
        "Section 2.2",
        "the greatest influence upon the position error, for periods of up to 5-10 s and out of "
        "crash, comes from the initial speed assessment, followed by the accelerometer bias, and "
        "then the gyro bias [15].",
        verdict,
        condition,
        "A level drive at 20 m/s, navigated with each error alone: a speed that is wrong by "
        f"{SPEED:g} m/s, an accelerometer by {ACCEL_BIAS:g} m/s², a gyro by 0.3°/s. They are δv t, "
        "½ b t² and g δφ t³/6.",
        tuple(
            Evidence(f"{what}, {r.time:g} s", v, "m")
            for r in found
            for what, v in (("speed", r.speed), ("accelerometer", r.accel), ("gyro", r.gyro))
        ),
    )


# --- time and distance -------------------------------------------------------------------------


@dataclass(frozen=True)
class Growth:
    """Exponents by which errors of the place grow, and what a steady drive has of them, m.

    Attributes
    ----------
    bias, gyro : float
        Power of time.
    scale : float
        Error over scale error times distance, from standstill to 20 m/s.
    misaligned : float
        The same of a misalignment.
    steady : float
        Of a scale error of 1 % over 200 m at a steady 20 m/s, m.
    """

    bias: float
    gyro: float
    scale: float
    misaligned: float
    steady: float


def growth() -> Growth:
    """Measure them."""
    trip = TRIPS["10 s"]
    accel = _course(trip, ImuErrors(accel=TriadErrors(bias=(ACCEL_BIAS, 0.0, 0.0))))
    gyro = _course(trip, ImuErrors(TriadErrors(bias=(0.0, GYRO_BIAS, 0.0))))
    powers = [float(np.log2(_at(c, 10.0) / _at(c, 5.0))) for c in (accel, gyro)]
    along = ImuErrors(accel=TriadErrors(scale=(SCALE, 0.0, 0.0)))
    across = ImuErrors(
        accel=TriadErrors(misalignment=((0.0, 0.0, 0.0), (SCALE, 0.0, 0.0), (0.0, 0.0, 0.0)))
    )
    pulse = HaversinePulse(0.0, 10.0, (20.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    away = Trip(
        "", CrashMotion(10.0, Origin(45.0, 20.0, 100.0), (0.0, 0.0, 0.0), (pulse,)), 100.0, "free"
    )
    distance = 100.0
    shares = [_at(_course(away, e), 10.0) / (SCALE * distance) for e in (along, across)]
    return Growth(powers[0], powers[1], shares[0], shares[1], _at(_course(trip, along), 10.0))


def time_and_distance(found: Growth) -> Statement:
    """Judge what grows with time and what with distance."""
    by_time = abs(found.bias - 2.0) < 0.2 and abs(found.gyro - 3.0) < 0.3
    by_distance = abs(found.scale - 1.0) < 0.1 and abs(found.misaligned - 1.0) < 0.1
    if not (by_time and by_distance):
        verdict, condition = DOES_NOT_HOLD, ""
    elif found.steady < 0.1 * SCALE * 200.0:
        verdict = HOLDS_WHEN
        condition = (
            "the distance is counted from a standstill; at a steady speed that is known, scale "
            "factor and misalignment cost nothing, and in a crash they act on the change of speed"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "time-and-distance",
        "Section 2.2",
        "Inertial Navigation System (INS) position error increases over time, due to gyro-drifts "
        "and sensor biases, and over traveling distance due to accelerometer scale factors and "
        "orientation misalignments.",
        verdict,
        condition,
        "A drive of 10 s from a standstill to 20 m/s, and one at a steady 20 m/s, with each error "
        "alone.",
        (
            Evidence("power of time, accelerometer bias", found.bias),
            Evidence("power of time, gyro bias", found.gyro),
            Evidence("scale factor: error over 1 % of the distance", found.scale),
            Evidence("misalignment: error over 1 % of the distance", found.misaligned),
            Evidence("scale factor, steady, after 200 m", found.steady, "m"),
        ),
    )
