"""Logs of known units, axes, forms and clocks, as consumer sensors would make them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from strapdown.formats.inference.conclusion import Inference
from strapdown.formats.inference.infer import Signals
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, INFERRED, MAG_UNITS, TIME_UNITS

GRAVITY = 9.81
MOTIONS = (
    "gesture",
    "gesture",
    "gesture",
    "violent",
    "swing",
    "still",
    "vehicle",
    "turntable",
    "walk",
)


@dataclass(frozen=True)
class Truth:
    """What the numbers are."""

    motion: str
    gyro_unit: str
    gyro_form: str
    gyro_axes: str
    accel_unit: str
    accel_form: str
    gravity: str
    time_unit: str
    time_fault: str
    mag_unit: str
    rate: float

    def is_wrong(self, said: Inference) -> bool:
        """Whether a settled conclusion is another than the truth."""
        if not said.settled or said.quantity in ("accel_sign", "up_axis"):
            return False
        if said.quantity == "rate":
            return abs(float(said.value) / self.rate - 1.0) > 0.02
        if said.quantity == "time_faults":
            return said.value != self.time_fault
        return said.value != getattr(self, said.quantity)


def _smooth(rng, time, rms, low, high, count=8):
    """Sums of sines of random frequency in a band, three columns."""
    if rms == 0.0:
        return np.zeros((time.size, 3))
    out = np.zeros((time.size, 3))
    for k in range(3):
        for f in np.exp(rng.uniform(np.log(low), np.log(high), count)):
            out[:, k] += np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi)) / np.sqrt(
                count / 2
            )
    return rms * out


def _motion(rng, kind, time):
    """Attitude (body to world, z up) and position of the sensor."""
    start = Rotation.random(random_state=int(rng.integers(2**31)))
    zero = np.zeros((time.size, 3))
    if kind == "still":
        return Rotation.from_quat(np.tile(start.as_quat(), (time.size, 1))), zero
    if kind == "vehicle":
        tilt = _smooth(rng, time, rng.uniform(0.005, 0.03), 0.3, 2.0)
        yaw = np.cumsum(_smooth(rng, time, 0.15, 0.02, 0.1)[:, 0]) * (time[1] - time[0])
        turn = Rotation.from_euler("ZYX", np.column_stack([yaw, tilt[:, 0], tilt[:, 1]]))
        speed = 12.0 + _smooth(rng, time, 4.0, 0.02, 0.1)[:, 0]
        course = np.column_stack([np.cos(yaw), np.sin(yaw), 0 * yaw]) * speed[:, None]
        position = np.cumsum(course, axis=0) * (time[1] - time[0])
        position += _smooth(rng, time, 0.002, 1.0, 5.0)
        return turn * start, position
    if kind == "turntable":
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = rng.uniform(0.1, 3.0) * time
        return Rotation.from_rotvec(angle[:, None] * axis) * start, zero
    if kind == "swing":  # an arm: rotation and acceleration in step
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = rng.uniform(0.2, 1.2) * np.sin(2 * np.pi * rng.uniform(0.3, 1.5) * time)
        turn = Rotation.from_rotvec(angle[:, None] * axis) * start
        return turn, turn.apply(rng.normal(size=3) * rng.uniform(0.1, 0.4))
    if kind == "walk":
        step = rng.uniform(1.6, 2.2)
        tilt = _smooth(rng, time, 0.1, 0.9 * step / 2, 1.1 * step)
        turn = Rotation.from_rotvec(tilt) * start
        return turn, _smooth(rng, time, 0.03, 0.9 * step, 1.1 * step)
    strong = 2.0 if kind == "violent" else 1.0
    angles = _smooth(rng, time, strong * rng.uniform(0.1, 0.8), 0.1, strong * rng.uniform(0.3, 0.6))
    turn = Rotation.from_euler("ZYX", angles) * start
    hand = _smooth(rng, time, strong * rng.uniform(0.002, 0.03), 0.3, 1.5)
    return turn, turn.apply(rng.normal(size=3) * rng.uniform(0.0, 0.25)) + hand


def make(seed: int) -> tuple[Signals, Truth]:
    """One log and what it is."""
    rng = np.random.default_rng(seed)
    rate = float(np.exp(rng.uniform(np.log(20.0), np.log(500.0))))
    time = np.arange(int(np.exp(rng.uniform(np.log(5.0), np.log(120.0))) * rate) + 3) / rate
    kind = str(rng.choice(MOTIONS))
    turn, position = _motion(rng, kind, time)
    # Rates as central differences of the attitude, exact for the mean over two steps.
    gyro = (turn[:-2].inv() * turn[2:]).as_rotvec() * rate / 2.0
    acceleration = (position[2:] - 2.0 * position[1:-1] + position[:-2]) * rate**2
    linear = rng.random() < 0.1
    world = acceleration + np.array([0.0, 0.0, 0.0 if linear else GRAVITY])
    accel = turn[1:-1].inv().apply(world)
    mag = turn[1:-1].inv().apply(np.array([18.0, 3.0, -rng.uniform(20.0, 50.0)]))
    time = time[1:-1]
    n = time.size
    # Data sheets of consumer sensors: scale 3 %, misalignment 1 deg, bias within 20 deg/s (of
    # those calibrated, a tenth), noise 1e-4 to 1e-2 rad/s; 80 mg and 0.01 to 0.1 m/s².
    skew = np.eye(3) + 0.01 * rng.normal(size=(3, 3)) + np.diag(0.01 * rng.normal(size=3))
    gyro = gyro @ skew.T + rng.uniform(-0.35, 0.35, 3) * rng.choice([0.1, 1.0])
    gyro += 10 ** rng.uniform(-4, -2) * rng.normal(size=(n, 3))
    offset = 0.02 if linear else 0.2
    accel = accel @ (np.eye(3) + 0.01 * rng.normal(size=(3, 3))).T + offset * rng.normal(size=3)
    accel += 10 ** rng.uniform(-2, -1) * rng.normal(size=(n, 3))
    mag = mag + rng.normal(size=3) * 3.0 + 0.5 * rng.normal(size=(n, 3))

    axes = np.eye(3)
    if (draw := rng.random()) > 0.5:
        axes = -axes if draw > 0.9 else np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], 3)
    # The matrix takes the log's gyro to the accelerometer's axes; the log has the inverse.
    order = [int(np.abs(row).argmax()) for row in axes]
    name = ",".join(("-" if axes[k, j] < 0 else "") + "xyz"[j] for k, j in enumerate(order))
    gyro = gyro @ axes
    # What is not known to the engine must not be taken for something that is: a tenth in counts.
    gyro_unit = str(rng.choice([*INFERRED["gyro"], "counts"], p=[0.4, 0.35, 0.05, 0.05, 0.05, 0.1]))
    gyro_scale = {**GYRO_UNITS, "counts": np.radians(1.0) / 16.4}[gyro_unit]
    accel_unit = str(rng.choice(["m/s2", "g", "mg", "counts"], p=[0.45, 0.35, 0.1, 0.1]))
    accel_scale = {**ACCEL_UNITS, "counts": GRAVITY / 4096.0}[accel_unit]
    gyro_form = accel_form = "rate"
    # Increments are of navigation units, in SI or in counts of their own.
    if rng.random() < 0.1 and accel_unit in ("m/s2", "counts"):
        gyro_form = accel_form = "increment"
        gyro, accel = gyro / rate, accel / rate
    mag_unit = str(rng.choice(list(INFERRED["mag"])))
    time_unit = str(rng.choice(["s", "ms", "us", "ns"]))
    stamps, fault = _stamps(rng, time, time_unit)
    if rng.random() < 0.3:
        accel_scale = -accel_scale  # gravity instead of reaction
    unknown = {"counts": None}
    truth = Truth(
        kind,
        unknown.get(gyro_unit, gyro_unit),
        gyro_form,
        name,
        unknown.get(accel_unit, accel_unit),
        accel_form,
        "removed" if linear else "present",
        time_unit,
        fault,
        mag_unit,
        rate,
    )
    gyro, accel = gyro / gyro_scale, accel / accel_scale
    if gyro_unit == "counts":
        gyro = np.round(gyro)
    if accel_unit == "counts":
        accel = np.round(accel)
    signals = Signals(stamps, gyro, accel, mag / MAG_UNITS[mag_unit])
    return signals, truth


def _stamps(rng, time, unit):
    """Stamps in a unit, jittered, and with one kind of fault in some."""
    step = time[1] - time[0]
    ticks = (time + rng.uniform(-0.02, 0.02, time.size) * step) / TIME_UNITS[unit]
    fault = str(rng.choice(["none", "none", "repeated", "backwards", "jump", "wrapped"]))
    start = (
        1.7e9 / TIME_UNITS[unit] if rng.random() < 0.3 else rng.uniform(0, 1e3) / TIME_UNITS[unit]
    )
    k = int(rng.integers(time.size // 4, 3 * time.size // 4))
    if fault == "wrapped" and unit == "us":
        ticks = np.round(ticks - ticks[k]) % 2.0**32
        return ticks.astype(np.int64), "1 wrapped (a counter of 32 bits)"
    if fault == "jump":
        ticks[k:] += 100.0 * step / TIME_UNITS[unit]
    integers = np.round(ticks).astype(np.int64) + int(start)
    whole = integers if unit in ("us", "ns") else ticks + start
    if fault == "repeated":
        whole[k] = whole[k - 1]
        return whole, "1 repeated"
    if fault == "backwards":
        whole[k] = whole[k - 4]
        return whole, "1 backwards"
    return whole, "1 jump" if fault == "jump" else "none"
