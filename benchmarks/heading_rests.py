"""Runs without fixes that find north at rest, for the trial of the heading status."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from benchmarks.heading_case import KNOWN, Case, add_antennas
from strapdown import rotation
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.tables import ACCEL, GYRO

SENSORS = ("fog-1000", "hg9900")
COARSE, FINE = 60.0, 240.0  # s
PLACE = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}
DEG_PER_HOUR = np.radians(1.0) / 3600.0

# A body that is moved while it is aligned, and what its sensors read then.

Array = np.ndarray
#: Roll, pitch, yaw (n, 3), deg, and acceleration (n, 3), m/s², at some instants.
Sway = Callable[[Array], tuple[Array, Array]]

# Three points of Gauss within a sample, which is a mean over its step.
POINTS = 0.5 + 0.5 * np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
H = 1e-4  # s, of a derivative


def rocking_body(rng: np.random.Generator, end: float) -> tuple[Sway, float]:
    """Rock about a place in three angles until shortly before the end."""
    size = rng.uniform(0.05, 1.0) * rng.uniform(0.3, 1.0, 3)
    rate = rng.uniform(0.2, 1.0, 3)
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)

    def sway(t: Array) -> tuple[Array, Array]:
        fades = np.clip((end - t) / 10.0, 0.0, 1.0) * np.clip(t / 10.0, 0.0, 1.0)
        fades = fades * fades * (3.0 - 2.0 * fades)
        angle = size * np.sin(2.0 * np.pi * rate * t[:, None] + phase) * fades[:, None]
        return angle, np.zeros((len(t), 3))

    return sway, 0.0


def pushed_body(rng: np.random.Generator, end: float) -> tuple[Sway, float]:
    """One to three pushes that turn the body within seconds, and move it by centimetres."""
    count = int(rng.integers(1, 4))
    at, lasts = rng.uniform(5.0, end - 15.0, count), rng.uniform(1.0, 8.0, count)
    turn = np.column_stack(
        [rng.uniform(-0.5, 0.5, (count, 2)), rng.uniform(0.3, 6.0, count) * rng.choice([-1, 1])]
    )
    shift = rng.uniform(-0.1, 0.1, (count, 3)) * [1.0, 1.0, 0.1]

    def sway(t: Array) -> tuple[Array, Array]:
        angle, acceleration = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        for begin, over, by, along in zip(at, lasts, turn, shift, strict=True):
            x = np.clip((t - begin) / over, 0.0, 1.0)[:, None]
            angle += by * (x**3 * (10.0 - 15.0 * x + 6.0 * x * x))
            # The second derivative of the same quintic: from rest to rest.
            acceleration += along / over**2 * (60.0 * x - 180.0 * x**2 + 120.0 * x**3)
        return angle, acceleration

    return sway, float(turn[:, 2].sum())


def swayed(
    rng: np.random.Generator,
    end: float,
    kind: Callable[[np.random.Generator, float], tuple[Sway, float]],
) -> tuple[Callable[[pd.DataFrame], pd.DataFrame], float]:
    """What turns the samples of a body into those of one that sways, and its turn at the end."""
    sway, turned = kind(rng, end)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        time = table.index.to_numpy(dtype=np.float64)
        dt = float(np.median(np.diff(time)))
        rate, force = table[GYRO].to_numpy(), table[ACCEL].to_numpy()
        rates, forces = np.zeros_like(rate), np.zeros_like(force)
        for point, weight in zip(POINTS, WEIGHTS, strict=True):
            t = time - dt + point * dt
            angle, push = sway(t)
            C = np.swapaxes(rotation.dcm_from_euler(angle), -1, -2)
            before = rotation.quaternion_from_euler(sway(t - H)[0])
            after = rotation.quaternion_from_euler(sway(t + H)[0])
            turn = rotation.compose(rotation.conjugate(before), after)
            own = rotation.rotation_vector_from_quaternion(turn) / (2.0 * H)
            rates += weight * (np.einsum("nij,nj->ni", C, rate) + own)
            forces += weight * np.einsum("nij,nj->ni", C, force + push)
        table[GYRO], table[ACCEL] = rates, forces
        return table

    return imu, turned


def drive(rng: np.random.Generator, stops: int, length: float) -> list[dict[str, object]]:
    """A stand, then straights and bends in an order of their own, and stops of minutes."""
    out: list[dict[str, object]] = [
        {"do": "straight", "duration_s": COARSE + FINE + 5.0},
        {"do": "accelerate", "to_m_per_s": 14.0, "duration_s": 10.0},
    ]
    for leg in range(stops + 1):
        for _ in range(3):
            turn = str(rng.choice(["turn_left", "turn_right"]))
            angle, radius = float(rng.uniform(20.0, 140.0)), float(rng.uniform(50.0, 150.0))
            out.append({"do": "straight", "duration_s": length / (stops + 1) / 3.0})
            out.append({"do": turn, "angle_deg": angle, "radius_m": radius})
        if leg < stops:
            stay = float(rng.uniform(100.0, 240.0))
            out.append({"do": "stop", "braking_s": 8.0, "stay_s": stay})
            out.append({"do": "accelerate", "to_m_per_s": 14.0, "duration_s": 10.0})
    return out


def inertial(
    seed: int,
    stops: int | None = None,
    length: float = 1800.0,
    sensors: tuple[str, ...] = SENSORS,
) -> Case:
    rng = np.random.default_rng([seed, 78])
    sensor = str(rng.choice(sensors))
    stops = int(rng.integers(1, 4)) if stops is None else stops
    table: dict[str, object] = {
        "simulation": {
            "rate_hz": 25.0,
            "seed": seed,
            "motion": {
                "kind": "car",
                **PLACE,
                "heading_deg": float(rng.uniform(0.0, 360.0)),
                "speed_m_per_s": 0.0,
                "manoeuvres": drive(rng, stops, length),
            },
        },
        "sensors": {"sensor": sensor},
        "site": {**PLACE},
        "mechanization": {"kind": "wander_azimuth", "height": "held"},
        "aiding": {"still": {"kind": "zero_velocity"}} if stops else {},
        "coarse": {"kind": "inertial_frame", "duration_s": COARSE},
        "fine": {"kind": "filter", "duration_s": FINE},
        "recorder": {"kind": "interval", "rate_hz": 5.0},
        "trust": {"repeat": False},
    }
    return Case(table, rng, 0.0, aligns=True)


def autonomous(seed: int) -> Case:
    """An hour by the sensors alone."""
    return inertial(seed, stops=0, length=3300.0)


def with_steps(
    seed: int, least: float, most: float, stops: int, zero_rate: bool, length: float
) -> Case:
    """A gyro whose bias changes after the alignment, by so many of its standard deviations.

    Half of them are the vertical one, which the velocity shows last.
    """
    case = inertial(seed, stops, length)
    if zero_rate:
        case.table["aiding"]["rate"] = {"kind": "zero_rate"}
    bias = bias_of(case)
    step = np.zeros(3)
    size = np.exp(case.rng.uniform(np.log(least), np.log(most)))
    step[case.rng.choice([0, 1, 2, 2])] = case.rng.choice([-1.0, 1.0]) * size * bias
    at = case.rng.uniform(COARSE + FINE, COARSE + FINE + 900.0)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        table.loc[table.index > at, GYRO] += step
        return table

    case.imu = imu
    return case


def bias_of(case: Case) -> float:
    sensors = sensors_of(NavigationSpec.checked(case.table))
    return float(np.max(sensors.gyro.axis("bias")))


def step_with_stops(seed: int) -> Case:
    return with_steps(seed, 100.0, 1000.0, 3, bool(seed % 2), 3000.0)


def small_step(seed: int) -> Case:
    return with_steps(seed, 3.0, 30.0, 0, False, 3300.0)


def large_step(seed: int) -> Case:
    return with_steps(seed, 300.0, 3000.0, 0, False, 3300.0)


def wrong_latitude(seed: int) -> Case:
    case = inertial(seed)
    off = float(case.rng.choice([-1.0, 1.0]) * np.exp(case.rng.uniform(np.log(0.2), np.log(25.0))))
    case.table["site"]["lat_deg"] = PLACE["lat_deg"] + off
    return case


def rocking(seed: int) -> Case:
    case = inertial(seed)
    case.imu, _ = swayed(case.rng, COARSE + FINE, rocking_body)
    return case


def pushed(seed: int) -> Case:
    case = inertial(seed)
    case.imu, case.truth_turned = swayed(case.rng, COARSE + FINE, pushed_body)
    return case


def understated(seed: int) -> Case:
    """Gyros that are off by 3 to 300 times what is stated."""
    case = inertial(seed)
    size = np.exp(case.rng.uniform(np.log(3.0), np.log(300.0)))
    bias = size * bias_of(case) * case.rng.standard_normal(3)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        table[GYRO] += bias
        return table

    case.imu = imu
    return case


def coarser(seed: int, bias: float) -> Case:
    """Gyros of some deg/h, stated as what they are."""
    case = inertial(seed, sensors=("fog-1000",))
    # The quietest of a cheaper class: its noise does not hide the bias.
    case.table["sensors"]["gyro"] = {
        "bias_sd_deg_per_h": bias,
        "noise_density_deg_per_sqrt_h": 0.01,
    }
    added = bias * DEG_PER_HOUR * case.rng.standard_normal(3)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        rate = 1.0 / float(np.median(np.diff(table.index)))
        noise = np.radians(0.01) / 60.0 * np.sqrt(rate)
        table[GYRO] += added + noise * case.rng.standard_normal((len(table), 3))
        return table

    case.imu = imu
    return case


def tactical(seed: int) -> Case:
    return coarser(seed, float(np.random.default_rng(seed).choice([0.05, 0.1, 0.15])))


def antennas_and_gyros(seed: int) -> Case:
    case = tactical(seed)
    add_antennas(case, float(0.5 * case.rng.standard_normal()))
    return case


def antennas_off_and_gyros(seed: int) -> Case:
    case = tactical(seed) if seed % 2 else inertial(seed)
    add_antennas(case, float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(3.5, 15.0)))
    return case


def two_aids(seed: int, offset: float) -> Case:
    """Two antennas and a second pair, of which one may be off; gyros that find no north."""
    case = stored(seed, 0.0, ("adis16495-1",))
    case.heading_error = float(KNOWN * case.rng.standard_normal())
    add_antennas(case, float(0.5 * case.rng.standard_normal()))
    add_antennas(case, offset + float(0.5 * case.rng.standard_normal()), "others")
    return case


def two_agree(seed: int) -> Case:
    return two_aids(seed, 0.0)


def two_differ(seed: int) -> Case:
    rng = np.random.default_rng([seed, 79])
    return two_aids(seed, float(rng.choice([-1.0, 1.0]) * rng.uniform(6.0, 20.0)))


def stored(seed: int, error: float, sensors: tuple[str, ...] = SENSORS) -> Case:
    """A heading that was stored when it was parked, to 1 deg, instead of an alignment."""
    case = inertial(seed, sensors=sensors)
    case.aligns, case.heading_error = False, error
    del case.table["site"]
    case.table["coarse"] = {"kind": "none"}
    case.table["fine"] = {"kind": "none"}
    return case


def stored_right(seed: int) -> Case:
    return stored(seed, float(KNOWN * np.random.default_rng(seed).standard_normal()))


def stored_wrong(seed: int) -> Case:
    rng = np.random.default_rng([seed, 80])
    return stored(seed, float(rng.choice([-1.0, 1.0]) * rng.uniform(3.5, 20.0)))


SCENARIOS: dict[str, Callable[[int], Case]] = {
    "INS for an hour": autonomous,
    "INS with stops": inertial,
    "INS, wrong latitude": wrong_latitude,
    "INS, rocking alignment": rocking,
    "INS, pushed alignment": pushed,
    "INS, gyros 3 to 300 times": understated,
    "INS, gyro step, stops": step_with_stops,
    "INS, gyro step up to 30 sd": small_step,
    "INS, stored heading": stored_right,
    "INS, wrong stored heading": stored_wrong,
    "tactical gyros": tactical,
    "tactical gyros and antennas": antennas_and_gyros,
    "gyros and antennas that are off": antennas_off_and_gyros,
    "two heading aids": two_agree,
    "two heading aids, one off": two_differ,
    "unseen: gyro step of 300 to 3000 sd, no stop": large_step,
}
