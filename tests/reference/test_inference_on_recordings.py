"""Shared recordings, stripped of every label: the engine is right, or it asks."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import raw_recordings

from strapdown.formats.inference.infer import infer

TURNED = ("x-pointing-forward", "y-pointing-left", "z-pointing-up")


def load(recordings, name):
    """The recording and its units of gyro and accelerometer, None where they have none here."""
    kind, _, part = name.partition("/")
    if kind == "broad":
        return raw_recordings.broad(recordings(f"{name}.hdf5")), "rad/s", "m/s2"
    if kind == "mpu6050_turns":
        return raw_recordings.mpu6050(recordings(name)), "deg/s", "g"
    if kind == "car_rtk":
        return raw_recordings.car(recordings(f"{name}.csv")), "rad/s", "m/s2"
    if kind == "rlg_static":
        path = recordings("rlg_static/part1_first900s.imu")
        # Counts, or radians and m/s a sample: both are no rates.
        return raw_recordings.ring_laser(path, part == "scaled"), None, None
    if kind == "phone_comma2k19":
        return raw_recordings.phone(recordings(kind)), "rad/s", "m/s2"
    if kind == "foot":
        path = recordings("foot/SensorConnectData_32_LLIO.mat")
        return raw_recordings.foot(path), "rad/s", "m/s2"
    heads = raw_recordings.crash_heads(recordings(kind))
    return heads[0 if part == "driver" else 1], "deg/s", "g"


NAMES = [
    "broad/02_undisturbed_slow_rotation_B",
    "broad/07_undisturbed_fast_rotation_B",
    "broad/14_undisturbed_slow_translation_with_breaks_B",
    "broad/27_disturbed_phone_vibration_B",
    *(f"mpu6050_turns/rotate-360ccw-around-{t}" for t in TURNED),
    "mpu6050_turns/unmoved-10min",
    "mpu6050_turns/unmoved-x-pointing-forward",
    "mpu6050_turns/unmoved-x-pointing-up",
    "mpu6050_turns/unmoved-z-pointing-left",
    "car_rtk/part1_imu_frd_si",
    "rlg_static/counts",
    "rlg_static/scaled",
    "phone_comma2k19",
    "foot",
    "crash_nhtsa_10146/driver",
    "crash_nhtsa_10146/passenger",
]
# What must be told, and not only never told wrongly. Of the gyro: gravity turns in these. The
# others are at rest, upright on a road, or shaken by more than gravity turns.
GYRO_TOLD = NAMES[:1] + NAMES[4:6]
ACCEL_TOLD = [n for n in NAMES if n.startswith(("broad", "mpu", "car", "phone"))]
GYRO = {"rad/s": 1.0, "deg/s": np.pi / 180.0}
ACCEL = {"m/s2": 1.0, "g": 9.80665}
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
AXES = {"as it is": np.eye(3), "turned": np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]])}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gyro", "accel", "time", "axes"),
    [
        (None, None, "s", "as it is"),
        ("deg/s", "g", "ms", "turned"),
        ("rad/s", "m/s2", "us", "as it is"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_it_is_right_or_asks(recordings, name, gyro, accel, time, axes):
    log, is_gyro, is_accel = load(recordings, name)
    to_gyro = GYRO[is_gyro] / GYRO[gyro] if gyro and is_gyro else 1.0
    to_accel = ACCEL[is_accel] / ACCEL[accel] if accel and is_accel else 1.0
    turned = log.scaled(to_gyro, to_accel, 1.0 / TIME[time]).turned(AXES[axes])
    if time == "us":  # a clock that counts
        turned = replace(turned, time=np.round(turned.time).astype(np.int64))
    found = {i.quantity: i for i in infer(turned.log())}
    right = {
        "gyro_unit": (gyro or is_gyro) if is_gyro else None,
        "accel_unit": (accel or is_accel) if is_accel else "m/s2" if "scaled" in name else None,
        "gyro_form": "rate" if is_gyro else "increment",
        "accel_form": "rate" if is_accel else "increment",
        "gyro_axes": "x,y,z",
        # The accelerometers of a crash are set to zero before it.
        "gravity": "removed" if name.startswith("crash") else "present",
        "time_unit": time,
        "mag_unit": "uT",
    }
    wrong = [
        str(found[q])
        for q, v in right.items()
        if q in found and found[q].settled and found[q].value != v
    ]
    assert not wrong
    # 10 kHz in ms could be 10 Hz in s.
    assert found["time_unit"].settled or name.startswith("crash")
    if name in GYRO_TOLD:
        assert found["gyro_unit"].settled
    if name in ACCEL_TOLD:
        assert found["accel_unit"].settled


@pytest.mark.parametrize("name", [NAMES[0], NAMES[4]])
@pytest.mark.parametrize("axes", ["-x,-y,-z", "x,-y,z", "y,x,z"])
def test_a_gyro_whose_axes_were_exchanged_is_never_called_right(recordings, name, axes):
    from strapdown.formats.inference.rotation_rate import signed_permutations

    names, matrices = signed_permutations()
    log, is_gyro, _ = load(recordings, name)
    log = replace(log, gyro=log.gyro @ matrices[names.index(axes)])
    found = {i.quantity: i for i in infer(log.log())}
    if found["gyro_axes"].settled:
        assert found["gyro_axes"].value == axes
    if found["gyro_unit"].settled:
        assert found["gyro_unit"].value == is_gyro
    if name == NAMES[0]:
        assert found["gyro_axes"].settled
