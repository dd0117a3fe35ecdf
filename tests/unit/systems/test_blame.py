"""What is wrong with a contradicted run is named: hypotheses side by side, by likelihood."""

from __future__ import annotations

import numpy as np

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.blame import blame
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.navigation.replay import run_batch
from strapdown.progress import silent
from strapdown.systems.navigation_run import (
    _coarser,
    _with_settled_offsets,
    _without_displacements,
    make_chain,
)
from strapdown.systems.navigation_source import read_navigation_source
from strapdown.tables import ACCEL, GEODETIC, GYRO

ARM = np.array([1.0, -0.4, -1.2])
UNIT = "adis16470"
#: How each fault is named.
EXPECTED = {
    "arm": "lever-arm",
    "mirrored": "axes",
    "turned": "axes",
    "gyros": "gyros",
    "sensor": "sensor-contradicted",
    "offset": "clock",
    "step": "clock-step",
    "stretch": "stretch",
    "sound": "",
}


def specified(seed, named=UNIT, arm=ARM, clock_sd=0.05, real=UNIT):
    """A car for a minute in a town, with an antenna beside its sensors, as it is stated."""
    place = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}
    turns = [
        step
        for k in range(4)
        for step in (
            {"do": "turn_left" if k % 2 else "turn_right", "angle_deg": 90.0, "radius_m": 30.0},
            {"do": "straight", "duration_s": 3.0},
            {"do": "brake" if k % 2 else "accelerate", "to_km_per_h": 36 if k % 2 else 50.0,
             "duration_s": 4.0},
        )
    ]  # fmt: skip
    receiver = {
        "rate_hz": 4.0,
        "position_noise_m": 0.3,
        "velocity_noise_m_per_s": 0.05,
        "antenna_m": tuple(ARM.tolist()),
    }
    table = {
        "simulation": {
            "rate_hz": 50.0,
            "seed": seed,
            "sensor": real,
            "motion": {
                "kind": "car",
                **place,
                "heading_deg": 30.0,
                "manoeuvres": [
                    {"do": "straight", "duration_s": 3.0},
                    {"do": "accelerate", "to_km_per_h": 40.0, "duration_s": 6.0},
                    *turns,
                ],
            },
            "gnss": {"gps": receiver},
        },
        "start": {
            **place,
            "v_ned_m_per_s": (0.0, 0.0, 0.0),
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 30.0,
            "position_sd_m": 2.0,
            "velocity_sd_m_per_s": 0.1,
            "tilt_sd_deg": 2.0,
            "heading_sd_deg": 5.0,
        },
        "sensors": {"sensor": named},
        "aiding": {
            "gps": {
                "kind": "gnss",
                "lever_arm_m": tuple(float(x) for x in arm),
                "lever_arm_sd_m": 0.02,
                "time_offset_sd_s": clock_sd,
                "update_rule": {"kind": "adaptive", "influence": "igg3"},
            }
        },
    }
    return NavigationSpec.checked(table)


def given(fault, seed):
    """Specification, samples and fixes with a fault."""
    rng = np.random.default_rng(seed)
    more = {}
    if fault == "arm":
        away = rng.normal(size=3)
        more["arm"] = ARM + 3.4 * away / np.linalg.norm(away)
    if fault == "sensor":
        more = {"named": "hg1700", "real": "mpu-6050"}
    if fault == "offset":
        more = {"clock_sd": 0.0}
    spec = specified(seed, **more)
    source = read_navigation_source(spec)
    imu, table = source.imu.copy(), source.tables["gps"].copy()
    imu.attrs, table.attrs = dict(source.imu.attrs), dict(source.tables["gps"].attrs)
    if fault == "mirrored":
        imu[[GYRO[1], ACCEL[1]]] *= -1.0
    if fault == "turned":
        for x, y, _ in (GYRO, ACCEL):
            imu[[x, y]] = np.column_stack([imu[y], -imu[x]])
    if fault == "gyros":
        imu[GYRO[2]] *= -1.0
    if fault == "offset":
        table.index = table.index + 1.0
    if fault == "step":
        table.index = table.index + np.where(table.index > 35.0, 1.0, 0.0)
    if fault == "stretch":
        bad = (table.index > 25.0) & (table.index < 40.0)
        error = np.cumsum(rng.normal(size=(int(bad.sum()), 3)), axis=0) * 3.0
        places = table.loc[bad, GEODETIC].to_numpy()
        table.loc[bad, GEODETIC] = [geodetic_from_ned(e, p) for e, p in zip(error, places, strict=True)]
    return spec, imu, {"gps": table}


def answered(fault, seed):
    """What is named, and the run that it is about, with the offset that it was repeated with."""
    spec, imu, tables = given(fault, seed)

    def drive(chain):
        return run_batch(chain, imu, tables, IntervalRecorder(rate_hz=10.0))

    sensors = sensors_of(spec)
    asked = make_chain(spec, sensors)
    chain, run, offsets = _with_settled_offsets(asked, drive(asked), drive)
    chain, run, _ = _without_displacements(chain, run, tables, drive)
    coarser = _coarser(spec, sensors, 0.0)
    named = spec.sensors.sensor
    found = blame(asked, chain, coarser, named, imu, tables, run.record, silent)
    return found, offsets, run.record


def short(found):
    """Code of a finding without what all have in common."""
    assert len(found) <= 1
    return found[0].code.removeprefix("navigation.").removeprefix("blame-") if found else ""
