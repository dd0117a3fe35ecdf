"""Two sensors on one rigid body in a random motion: units, a magnetometer, an antenna."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from strapdown import rotation, simulate
from strapdown.simulation import GnssReceiver
from strapdown.tables import MAG, imu_table

GRAVITY = 9.81
KINDS = ("hand", "walk", "drive")
#: White noise of gyros rad/s/√Hz and of accelerometers, standard deviations of biases, of scale and
#: nonorthogonality, of the misalignment of accelerometers, and noise of a magnetometer.
GRADES = {
    "phone": (1.2e-4, 2e-3, 0.017, 0.3, 0.01, 0.006, 0.008),
    "industrial": (4e-5, 7e-4, 0.002, 0.03, 0.001, 0.001, 0.003),
}
#: Length, s, vibration that the sensors do not share, rad/s and m/s², and disturbance of the field.
LENGTH = {"hand": 40.0, "walk": 45.0, "drive": 120.0}
SHAKING = {"hand": (0.002, 0.03), "walk": (0.005, 0.1), "drive": (0.003, 0.1)}
DISTURBED = {"hand": 0.005, "walk": 0.01, "drive": 0.01}


@dataclass(frozen=True)
class Truth:
    """What a pair was made of: as `Extrinsics`."""

    rotation: np.ndarray
    offset: float
    drift: float
    middle: float
    arm: np.ndarray
    hard_iron: np.ndarray | None = None


def sines(rng, t, low, high, sd):
    """A random signal of twelve sines between two frequencies."""
    f = np.exp(rng.uniform(np.log(low), np.log(high), 12))
    a, phase = rng.normal(size=12), rng.uniform(0.0, 2.0 * np.pi, 12)
    a *= sd * np.sqrt(2.0 / (a**2).sum())
    return sum(
        size * np.sin(2.0 * np.pi * k * t + p) for size, k, p in zip(a, f, phase, strict=True)
    )


class Body:
    """Attitude and position of a body, and what sensors on it feel; splines at 500 Hz."""

    def __init__(self, rng, kind):
        t = np.arange(-3.0, LENGTH[kind] + 3.0, 0.002)

        def made(*parts):
            return sum(sines(rng, t, *part) for part in parts)

        if kind == "hand":
            angle = [made((0.15, 1.5, 0.5), (8, 11, 0.002)) for _ in range(3)]
            place = [made((0.2, 1.5, 0.12), (8, 11, 0.0005)) for _ in range(3)]
        elif kind == "walk":
            angle = [made((0.9, 4, 0.05), (5, 15, 0.004)) for _ in range(2)]
            angle += [made((0.03, 0.25, 1.2), (0.9, 4, 0.05), (5, 15, 0.003))]
            place = [made((0.05, 0.3, 2.0), (0.9, 4, 0.025), (5, 20, 0.0006)) for _ in range(2)]
            place += [made((0.9, 4, 0.03), (5, 20, 0.0008))]
        else:
            angle = [made((0.1, 1.5, 0.02), (5, 25, 0.0003)) for _ in range(2)]
            angle += [made((0.01, 0.12, 1.3), (0.2, 2, 0.005), (5, 25, 0.0002))]
            place = [made((0.02, 0.15, 12.0), (0.2, 1.5, 0.03), (8, 30, 1e-4)) for _ in range(2)]
            place += [made((0.3, 2, 0.03), (8, 30, 2e-4))]
        turned = CubicSpline(t, np.column_stack(angle))
        (roll, pitch, _), (d_roll, d_pitch, d_yaw) = turned(t).T, turned(t, 1).T
        omega = np.column_stack(
            [
                d_roll - d_yaw * np.sin(pitch),
                d_pitch * np.cos(roll) + d_yaw * np.cos(pitch) * np.sin(roll),
                d_yaw * np.cos(pitch) * np.cos(roll) - d_pitch * np.sin(roll),
            ]
        )
        C = rotation.dcm_from_euler(np.degrees(turned(t)))
        pull = CubicSpline(t, np.column_stack(place))(t, 2) - np.array([0.0, 0.0, GRAVITY])
        self.attitude, self.rate = turned, CubicSpline(t, omega)
        self.force = CubicSpline(t, np.einsum("nji,nj->ni", C, pull))

    def felt(self, t, arm):
        """Rate and specific force at a point of the body."""
        w, alpha = self.rate(t), self.rate(t, 1)
        return w, self.force(t) + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))


def colored(rng, n, dt, frequency, sd):
    """Vibration about a frequency."""
    frequency = min(frequency, 0.4 / dt)
    r = np.exp(-0.2 * np.pi * frequency * dt)
    a = [1.0, -2.0 * r * np.cos(2.0 * np.pi * frequency * dt), r * r]
    x = lfilter([1.0], a, rng.normal(size=(n + 500, 3)), axis=0)[500:]
    return x / x.std() * sd


def stamps(rng, length, rate, offset, drift):
    """Instants of samples, jittered by a tenth of a step, and their stamps by a clock."""
    n = int(length * rate)
    t = (np.arange(n) + rng.uniform() + rng.uniform(-0.1, 0.1, n)) / rate
    return t, t + offset + drift * (t - 0.5 * length) + 1e-4 * rng.normal(size=n)


def symmetric(rng, sd):
    m = sd * rng.normal(size=(3, 3))
    return np.eye(3) + 0.5 * (m + m.T)


def unit(rng, body, t, stamp, mounting, arm, grade, kind):
    """Imu table of a unit on the body, and the matrix of its gyros."""
    noise, force_noise, bias, force_bias, shape, apart, _ = GRADES[grade]
    w, f = body.felt(t, arm)
    dt, n = float(np.median(np.diff(t))), len(t)
    gyros = symmetric(rng, shape)
    forces = symmetric(rng, shape) @ rotation.dcm_from_rotation_vector(apart * rng.normal(size=3))
    w = w @ mounting @ gyros.T + bias * rng.normal(size=3)
    f = f @ mounting @ forces.T + force_bias * rng.normal(size=3)
    w += noise / np.sqrt(dt) * rng.normal(size=(n, 3))
    f += force_noise / np.sqrt(dt) * rng.normal(size=(n, 3))
    strength = rng.uniform(0.3, 1.0)
    for low, high, share in ((12.0, 40.0, 1.0), (1.0, 8.0, 0.3)):
        for values, sd in zip((w, f), SHAKING[kind], strict=True):
            values += colored(rng, n, dt, rng.uniform(low, high), sd * strength * share)
    return imu_table(stamp, w, f), gyros


def pair_of_units(seed, kind, grade):
    """Imu tables a and b, and the truth."""
    rng = np.random.default_rng([1, seed, KINDS.index(kind), len(grade)])
    length, body = LENGTH[kind], Body(rng, kind)
    rates = np.exp(rng.uniform(np.log(50.0), np.log(400.0), 2))
    offset, drift = rng.uniform(-2.0, 2.0), 6e-5 * rng.uniform(-1.0, 1.0)
    A, B = (rotation.dcm_from_rotation_vector(rng.normal(size=3)) for _ in range(2))
    arm = rng.uniform(-0.15, 0.15, 3) * (3.0 if kind == "drive" else 1.0)
    own = rng.uniform(-0.1, 0.1, 3)
    a, shape_a = unit(rng, body, *stamps(rng, length, rates[0], 0.0, 0.0), A, own, grade, kind)
    there = stamps(rng, length, rates[1], offset, drift)
    b, shape_b = unit(rng, body, *there, B, own + A @ arm, grade, kind)
    u, _, vt = np.linalg.svd(shape_a @ A.T @ B @ np.linalg.inv(shape_b))
    return a, b, Truth(u @ vt, offset, drift, 0.5 * length, arm)


def unit_and_magnetometer(seed, kind, grade, apart):
    """Imu table a, magnetometer b, in µT, and the truth; with clocks apart or with a delay."""
    rng = np.random.default_rng([2, seed, KINDS.index(kind), len(grade)])
    length, body = LENGTH[kind], Body(rng, kind)
    rate, other = np.exp(rng.uniform(np.log([50.0, 20.0]), np.log([400.0, 100.0])))
    offset = rng.uniform(-2.0, 2.0) if apart else rng.uniform(-0.05, 0.05)
    drift = 6e-5 * rng.uniform(-1.0, 1.0) if apart else 0.0
    A, R = (rotation.dcm_from_rotation_vector(rng.normal(size=3)) for _ in range(2))
    a, _ = unit(rng, body, *stamps(rng, length, rate, 0.0, 0.0), A, np.zeros(3), grade, kind)
    t, stamp = stamps(rng, length, other, offset, drift)
    field = np.array([0.4, 0.05, 0.9]) + np.column_stack(
        [sines(rng, t, 0.01, 0.3, DISTURBED[kind]) for _ in range(3)]
    )
    C = rotation.dcm_from_euler(np.degrees(body.attitude(t)))
    along = np.einsum("nji,nj->ni", C @ A @ R, field)
    soft = symmetric(rng, 0.03)
    hard = 0.5 * rng.normal(size=3)
    readings = along @ soft + hard + GRADES[grade][6] * rng.normal(size=along.shape)
    b = pd.DataFrame(50.0 * readings, index=pd.Index(stamp, name="time"), columns=MAG)
    return a, b, Truth(R, offset, drift, 0.5 * length, np.zeros(3), 50.0 * hard)


#: Units with which the made drives are driven, one after the other.
UNITS = ("mpu-6050", "icm-42688-p", "adis16470", "consumer-grade", "tactical-grade", "bmi270")


@dataclass(frozen=True)
class DriveWithAntenna:
    """Samples of a unit, fixes of an antenna, and the truth of both."""

    imu: pd.DataFrame
    gnss: pd.DataFrame
    sensor: str
    arm: np.ndarray
    offset: float
    heading_deg: float


def drive_with_antenna(seed, folder, rate=None):
    """A car with turns, stops and changes of speed; fixes of 0.02 to 2 m, at 1 or 5 Hz."""
    rng = np.random.default_rng([50, seed])

    def draw(low, high):
        return round(float(rng.uniform(low, high)), 2)

    def onward():
        return {"do": "accelerate", "to_m_per_s": draw(9.0, 16.0), "duration_s": draw(5.0, 8.0)}

    done = [{"do": "straight", "duration_s": draw(3.0, 12.0)}, onward()]
    for _ in range(4):
        what = rng.choice(["turn", "stop", "brake"], p=[0.6, 0.2, 0.2])
        if what == "stop":
            done.append({"do": "stop", "braking_s": draw(4.0, 7.0), "stay_s": draw(3.0, 12.0)})
        else:
            slow = draw(5.0, 9.0)
            done.append({"do": "brake", "to_m_per_s": slow, "duration_s": draw(3.0, 6.0)})
        if what == "turn":
            side = f"turn_{rng.choice(['left', 'right'])}"
            radius = max(draw(10.0, 28.0), round(slow**2 / 5.0, 2))
            done.append({"do": side, "angle_deg": draw(50.0, 110.0), "radius_m": radius})
        done += [onward(), {"do": "straight", "duration_s": draw(3.0, 7.0)}]
    heading, lean = draw(0.0, 360.0), draw(0.2, 0.6)
    lines = ["rate_hz = 50", f'sensor = "{UNITS[seed % len(UNITS)]}"', "[motion]", 'kind = "car"']
    lines += [f"lat_deg = {draw(-60.0, 60.0)}", "lon_deg = 30.0", "alt_m = 100.0"]
    lines += [f"heading_deg = {heading}", f"roll_deg_per_m_per_s2 = {lean}"]
    rows = [", ".join(f"{k} = {json.dumps(v)}" for k, v in one.items()) for one in done]
    lines.append("manoeuvres = [" + ", ".join(f"{{ {row} }}" for row in rows) + "]")
    path = folder / f"drive{seed}.toml"
    path.write_text("\n".join(lines))
    arm = np.array([draw(-1.5, 1.5), draw(-0.8, 0.8), draw(-1.8, 0.3)])
    offset = draw(-0.3, 0.3)
    noise = float(np.exp(rng.uniform(np.log(0.02), np.log(2.0))))
    receiver = GnssReceiver(
        rate=rate or float(rng.choice([1.0, 5.0])),
        position_noise=noise,
        velocity_noise=float(np.clip(0.15 * noise, 0.02, 0.3)),
        antenna=tuple(arm),
        time_offset=offset,
    )
    made = simulate(path, seed=seed, receiver=receiver)
    return DriveWithAntenna(made.imu, made.gnss, UNITS[seed % len(UNITS)], arm, offset, heading)
