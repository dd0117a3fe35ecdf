"""Drives with fixes of a receiver, sound and with faults, for the trial of the heading status."""

from __future__ import annotations

import numpy as np
import pandas as pd

from benchmarks.heading_case import KNOWN, LIMIT, Case, add_antennas, started
from strapdown import rotation
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.tables import ACCEL, GYRO, POSITION_SD, VELOCITY_SD

SENSORS = ("adis16495-1", "adis16470", "stim300", "hg1700")


def drive(rng: np.random.Generator) -> list[dict[str, object]]:
    """Some four minutes of straights, bends, stops, in an order of their own."""
    out: list[dict[str, object]] = [
        {"do": "straight", "duration_s": float(rng.uniform(5.0, 40.0))},
    ]
    for _ in range(6):
        kind = rng.integers(5)
        radius = float(rng.uniform(30.0, 120.0))
        if kind == 0:
            angle = float(rng.uniform(30.0, 120.0))
            out.append({"do": "turn_left", "angle_deg": angle, "radius_m": radius})
        elif kind == 1:
            angle = float(rng.uniform(30.0, 120.0))
            out.append({"do": "turn_right", "angle_deg": angle, "radius_m": radius})
        elif kind == 2:
            speed = float(rng.uniform(7.0, 20.0))
            out.append({"do": "accelerate", "to_m_per_s": speed, "duration_s": 8.0})
        out.append({"do": "straight", "duration_s": float(rng.uniform(10.0, 50.0))})
    return out


def nominal(seed: int) -> Case:
    rng = np.random.default_rng([seed, 77])
    heading = float(rng.uniform(0.0, 360.0))
    table: dict[str, object] = {
        "simulation": {
            "rate_hz": 50.0,
            "seed": seed,
            "motion": {
                "kind": "car",
                "lat_deg": 55.75,
                "lon_deg": 37.62,
                "alt_m": 150.0,
                "heading_deg": heading,
                "speed_m_per_s": float(rng.uniform(8.0, 16.0)),
                "manoeuvres": drive(rng),
            },
            "gnss": {
                "rtk": {
                    "rate_hz": 1.0,
                    "position_noise_m": float(rng.choice([0.03, 0.5, 1.5])),
                    "velocity_noise_m_per_s": float(rng.choice([0.03, 0.1])),
                }
            },
        },
        "sensors": {"sensor": str(rng.choice(SENSORS))},
        "aiding": {"rtk": {"kind": "gnss"}},
        "coarse": {"kind": "none"},
        "fine": {"kind": "none"},
        "trust": {"repeat": False, "heading_limit_deg": LIMIT},
    }
    return Case(table, rng, float(KNOWN * rng.standard_normal()))


def wrong_heading(seed: int) -> Case:
    case = nominal(seed)
    case.heading_error = float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 15.0))
    return case


def no_manoeuvre(seed: int) -> Case:
    case = wrong_heading(seed)
    case.table["simulation"]["motion"]["manoeuvres"] = [{"do": "straight", "duration_s": 200.0}]
    return case


def outliers(seed: int) -> Case:
    case = nominal(seed)
    case.table["simulation"]["gnss"]["rtk"]["outlier_share"] = 0.1
    case.table["simulation"]["gnss"]["rtk"]["outlier_size"] = float(case.rng.uniform(10.0, 60.0))
    if seed % 2:
        case.table["aiding"]["rtk"]["update_rule"] = {
            "kind": "adaptive",
            "influence": "igg3",
            "scale": {"lowest": 1.0},
        }
    return case


def biased_sensor(seed: int) -> Case:
    """Gyros and accelerometers off by ten times what is stated."""
    case = nominal(seed)
    sensors = sensors_of(NavigationSpec.checked(started(case)))
    gyro = 10.0 * np.asarray(sensors.gyro.axis("bias")) * case.rng.standard_normal(3)
    accel = 5.0 * np.asarray(sensors.accel.axis("bias")) * case.rng.standard_normal(3)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        table[GYRO] += gyro
        table[ACCEL] += accel
        return table

    case.imu = imu
    return case


def noise_times_three(seed: int) -> Case:
    case = nominal(seed)

    def tables(told: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        table = told["rtk"].copy()
        table[[*POSITION_SD, *VELOCITY_SD]] /= 3.0
        return {**told, "rtk": table}

    case.tables = tables
    return case


def gnss_drift(seed: int) -> Case:
    """Errors of places that last a minute, which nobody told."""
    case = nominal(seed)
    case.table["simulation"]["gnss"]["rtk"]["position_drift_m"] = 1.5
    return case


def offset_heading(seed: int) -> Case:
    """Two antennas whose heading is off by degrees, and stated to half of one."""
    case = nominal(seed)
    add_antennas(case, float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 15.0)))
    return case


def wrong_mounting(seed: int) -> Case:
    """A unit that is turned in its vehicle, whose constraint says that it is not."""
    case = nominal(seed)
    turned = float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 12.0))
    C = rotation.dcm_from_euler([0.0, 0.0, -turned])

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        for axes in (GYRO, ACCEL):
            table[axes] = table[axes].to_numpy() @ C.T
        return table

    case.imu, case.truth_turned = imu, turned
    case.table["aiding"]["wheels"] = {"kind": "no_slip"}
    return case
