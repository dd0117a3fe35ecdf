"""Motions of vehicles and people over the Earth, exact to rounding.

A motion is a spline of the fifth degree through six channels on a grid of 100 Hz: east, north, up
of the unit in a plane that touches the ellipsoid, and heading, pitch, roll of the vehicle against
that plane. The spline is the truth: rates and specific force follow in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

KINDS = ("town", "motorway", "aircraft", "walk", "boat")
A, F = 6378137.0, 1 / 298.257223563  # WGS 84
E2 = F * (2 - F)
EARTH_RATE, GM = 7.292115e-5, 3.986004418e14
G = 9.80665
STEP = 0.01
MARGIN = 3.0  # of the grid beyond both ends, s
DEG = np.pi / 180


# ----------------------------------------------------------------------------- the Earth
def ecef(lat: Any, lon: Any, alt: Any) -> np.ndarray:
    """Cartesian position of geodetic coordinates in rad and m."""
    n = A / np.sqrt(1 - E2 * np.sin(lat) ** 2)
    return np.stack(
        [
            (n + alt) * np.cos(lat) * np.cos(lon),
            (n + alt) * np.cos(lat) * np.sin(lon),
            (n * (1 - E2) + alt) * np.sin(lat),
        ],
        axis=-1,
    )


def geodetic(r: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Latitude, longitude in rad and height in m of Cartesian positions."""
    p = np.hypot(r[..., 0], r[..., 1])
    lat = np.arctan2(r[..., 2], p * (1 - E2))
    for _ in range(6):
        n = A / np.sqrt(1 - E2 * np.sin(lat) ** 2)
        lat = np.arctan2(r[..., 2] + E2 * n * np.sin(lat), p)
    n = A / np.sqrt(1 - E2 * np.sin(lat) ** 2)
    alt = p * np.cos(lat) + r[..., 2] * np.sin(lat) - A * A / n
    return lat, np.arctan2(r[..., 1], r[..., 0]), alt


def to_ned(lat: Any, lon: Any) -> np.ndarray:
    """Matrices that turn Cartesian vectors into north, east, down."""
    sa, ca, so, co = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(sa)
    rows = [[-sa * co, -sa * so, ca], [-so, co, zero], [-ca * co, -ca * so, -sa]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def gravity(lat: Any, alt: Any) -> np.ndarray:
    """Normal gravity down the normal, m/s² (Somigliana, second order in height)."""
    s2 = np.sin(lat) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - E2 * s2)
    m = EARTH_RATE**2 * A**3 * (1 - F) / GM
    return surface * (1 - 2 / A * (1 + F + m - 2 * F * s2) * alt + 3 * alt**2 / A**2)


# ------------------------------------------------------------------------ building blocks
def ramp(t: np.ndarray, start: float, length: float) -> np.ndarray:
    """From nought to one with least jerk."""
    x = np.clip((t - start) / length, 0.0, 1.0)
    return x**3 * (10 - 15 * x + 6 * x**2)


def noise(
    rng: np.random.Generator, n: int, low: float, high: float, channels: int = 1
) -> np.ndarray:
    """Noise of unit variance between two frequencies."""
    sos = butter(2, [low, high], "bandpass", fs=1 / STEP, output="sos")
    out = sosfiltfilt(sos, rng.normal(size=(n, channels)), axis=0)
    return out / out.std(axis=0)


def bend(t: np.ndarray, start: float, length: float, angle: float) -> np.ndarray:
    """Rate of a turn by an angle: up, held, down."""
    edge = min(0.35 * length, 3.0)
    return angle / (length - edge) * (ramp(t, start, edge) - ramp(t, start + length - edge, edge))


@dataclass
class Motion:
    """Positions of a unit in m in a touching plane, its attitude against it, and where that is."""

    spline: Any  # east, north, up; heading, pitch, roll of the vehicle (unwrapped, rad)
    mount: Rotation  # unit to vehicle axes
    lat: float  # of the origin, rad
    lon: float
    alt: float
    disturbance: np.ndarray  # of gravity, east, north, up, m/s²
    duration: float
    engine: np.ndarray  # on the grid: how hard an engine works, 0 to 1
    grid: np.ndarray

    @property
    def _plane(self) -> np.ndarray:
        """Turns east, north, up of the plane into Cartesian axes."""
        return to_ned(self.lat, self.lon).T @ np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])

    def attitude(self, t: np.ndarray) -> Rotation:
        """Unit axes to Cartesian axes of the Earth."""
        to_plane = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
        vehicle = Rotation.from_euler("ZYX", self.spline(t)[:, 3:])
        return Rotation.from_matrix(self._plane) * to_plane * vehicle * self.mount

    def position(self, t: np.ndarray, arm: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Cartesian position of a point at an arm in unit axes, m."""
        base = ecef(self.lat, self.lon, self.alt) + self.spline(t)[:, :3] @ self._plane.T
        return base + self.attitude(t).apply(arm)

    def velocity(self, t: np.ndarray, arm: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Cartesian velocity of that point relative to the Earth, m/s."""
        rate = self._turning(t)
        return self.spline(t, nu=1)[:, :3] @ self._plane.T + self.attitude(t).apply(
            np.cross(rate, np.broadcast_to(arm, rate.shape))
        )

    def _turning(self, t: np.ndarray) -> np.ndarray:
        """Rates of the unit relative to the Earth, in unit axes, rad/s."""
        _, pitch, roll = self.spline(t)[:, 3:].T
        dh, dp, dr = self.spline(t, nu=1)[:, 3:].T
        vehicle = np.column_stack(
            [
                dr - dh * np.sin(pitch),
                dp * np.cos(roll) + dh * np.sin(roll) * np.cos(pitch),
                dh * np.cos(roll) * np.cos(pitch) - dp * np.sin(roll),
            ]
        )
        return self.mount.inv().apply(vehicle)

    def sensed(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates against inertial space in rad/s and specific force in m/s², in unit axes."""
        attitude = self.attitude(t)
        earth = np.array([0.0, 0.0, EARTH_RATE])
        rate = self._turning(t) + attitude.inv().apply(earth)
        lat, lon, alt = geodetic(self.position(t))
        down = to_ned(lat, lon)[:, 2]
        pull = gravity(lat, alt)[:, None] * down + self._plane @ self.disturbance
        acceleration = self.spline(t, nu=2)[:, :3] @ self._plane.T
        force = acceleration + 2 * np.cross(earth, self.velocity(t)) - pull
        return rate, attitude.inv().apply(force)

    def state(self, t: np.ndarray) -> dict[str, np.ndarray]:
        """Geodetic position, velocity north-east-down and attitude of the unit; deg, m, m/s."""
        t = np.atleast_1d(np.asarray(t, float))
        lat, lon, alt = geodetic(self.position(t))
        ned = to_ned(lat, lon)
        v = np.einsum("nij,nj->ni", ned, self.velocity(t))
        heading, pitch, roll = (
            (Rotation.from_matrix(ned) * self.attitude(t)).as_euler("ZYX", degrees=True).T
        )
        return {
            "lat": np.degrees(lat), "lon": np.degrees(lon), "alt": alt, "v": v,
            "roll": roll, "pitch": pitch, "heading": heading % 360, "ecef": self.position(t),
        }  # fmt: skip


# ------------------------------------------------------------------------------- motions
def _town(rng: np.random.Generator, t: np.ndarray, first: float) -> tuple[np.ndarray, ...]:
    """Speed and turn rate of a car between crossings."""
    speed, rate = np.full(len(t), first), np.zeros(len(t))
    now, v = float(rng.uniform(1, 4)), first

    def reach(target: float, most: float) -> None:
        nonlocal now, v, speed
        length = 1.9 * abs(target - v) / most + 0.5
        speed = speed + (target - v) * ramp(t, now, length)
        now, v = now + length, target

    while now < t[-1]:
        reach(rng.uniform(8, 16), rng.uniform(1, 2.5))
        for _ in range(int(rng.integers(0, 3))):
            angle = rng.choice([-1, 1]) * rng.uniform(5, 40) * DEG
            length = max(3.0, 1.6 * v * abs(angle) / 2.0)
            rate += bend(t, now, length, angle)
            now += length + rng.uniform(1, 8)
        now += rng.uniform(1, 10)
        if rng.random() < 0.35:
            reach(0.0, rng.uniform(1.5, 3))
            now += rng.uniform(3, 25)
        else:
            reach(rng.uniform(4, 7), rng.uniform(1.5, 3))
            angle = rng.choice([-1, 1]) * rng.uniform(60, 100) * DEG
            length = max(3.5, 1.6 * v * abs(angle) / 3.0)
            rate += bend(t, now, length, angle)
            now += length
    return speed, rate


def _motorway(rng: np.random.Generator, t: np.ndarray, first: float) -> tuple[np.ndarray, ...]:
    """Speed and turn rate of a car on a motorway."""
    speed, rate = np.full(len(t), first), np.zeros(len(t))
    now, v = 2.0, first
    if first < 5:
        speed = speed + 27 * ramp(t, now, 22.0)
        rate += bend(t, now + 5, 8.0, rng.choice([-1, 1]) * rng.uniform(15, 70) * DEG)
        now, v = now + 22, v + 27
    while now < t[-1]:
        kind = rng.random()
        if kind < 0.35:
            target = rng.uniform(20, 36)
            length = 1.9 * abs(target - v) / rng.uniform(0.6, 1.8) + 2
            speed = speed + (target - v) * ramp(t, now, length)
            v = target
        elif kind < 0.7:
            angle = rng.choice([-1, 1]) * rng.uniform(5, 45) * DEG
            length = max(6.0, 1.5 * v * abs(angle) / rng.uniform(0.7, 2.0))
            rate += bend(t, now, length, angle)
        else:
            length, angle = rng.uniform(5, 8), rng.choice([-1, 1]) * rng.uniform(1.5, 3.5) * DEG
            rate += bend(t, now, length / 2, angle) + bend(t, now + length / 2, length / 2, -angle)
        now += length + rng.uniform(2, 20)
    return speed, rate


def _road(
    rng: np.random.Generator, t: np.ndarray, speed: np.ndarray, rate: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Path of the rear axle, and the car's pitch and roll on hills, springs and rough road."""
    way = cumulative_trapezoid(speed, t, initial=0.0)
    hill, slope = np.zeros(len(t)), np.zeros(len(t))
    for length in rng.uniform(200, 3000, 4):
        high = rng.uniform(0.0, 0.012) * length / (2 * np.pi)
        phase = rng.uniform(0, 6.28)
        hill += high * np.sin(2 * np.pi * way / length + phase)
        slope += 2 * np.pi * high / length * np.cos(2 * np.pi * way / length + phase)
    rough = rng.uniform(0.3, 1.2) * np.clip(speed / 12, 0, 1.3)
    bounce = noise(rng, len(t), 0.9, 2.5, 3) + 0.08 * noise(rng, len(t), 4, 9, 3)
    lean = np.gradient(speed, t) * rng.uniform(0.2, 0.8) * DEG
    pitch = np.arctan(slope) + lean + 0.25 * DEG * rough * bounce[:, 1]
    roll = -speed * rate * rng.uniform(0.2, 0.8) * DEG + 0.35 * DEG * rough * bounce[:, 2]
    flat = speed * np.cos(np.arctan(slope))
    return np.column_stack([flat, hill + 0.0025 * rough * bounce[:, 0]]), pitch, roll


def _turned(along: np.ndarray, heading: np.ndarray, t: np.ndarray) -> np.ndarray:
    """East and north of a way that follows its heading."""
    v = along[:, None] * np.column_stack([np.sin(heading), np.cos(heading)])
    return cumulative_trapezoid(v, t, axis=0, initial=0.0)


def _car(rng: np.random.Generator, t: np.ndarray, draw: dict[str, Any]) -> tuple[np.ndarray, ...]:
    town = draw["kind"] == "town"
    moving = draw["start"] == "moving"
    first = rng.uniform(5, 14) if town else rng.uniform(22, 34)
    clock = t if moving else t - draw["rest_s"]
    speed, rate = (_town if town else _motorway)(rng, clock, first if moving else 0.0)
    heading = rng.uniform(-np.pi, np.pi) + cumulative_trapezoid(rate, t, initial=0.0)
    flat, pitch, roll = _road(rng, t, speed, rate)
    path = np.column_stack([_turned(flat[:, 0], heading, t), flat[:, 1]])
    engine = 0.35 + 0.65 * np.clip(speed / (15 if town else 35), 0, 1)
    return path, heading, pitch, roll, engine


def _aircraft(
    rng: np.random.Generator, t: np.ndarray, draw: dict[str, Any]
) -> tuple[np.ndarray, ...]:
    moving = draw["start"] == "moving"
    cruise = rng.uniform(40, 70)
    n = len(t)
    if moving:
        speed, up, airborne = np.full(n, cruise), np.zeros(n), np.ones(n)
        now = 2.0
    else:
        begin, roll_s = draw["rest_s"], rng.uniform(18, 26)
        speed = 36 * ramp(t, begin, roll_s) + (cruise - 36) * ramp(t, begin + roll_s + 5, 20)
        airborne = ramp(t, begin + roll_s - 3, 5.0)
        up = rng.uniform(3, 6) * ramp(t, begin + roll_s, 6.0)
        now = begin + roll_s + 12
    bank = np.zeros(n)
    climb = float(up[-1])
    while now < t[-1]:
        kind = rng.random()
        if kind < 0.55:
            angle = rng.choice([-1, 1]) * rng.uniform(10, 45) * DEG
            length, edge = rng.uniform(8, 35), rng.uniform(2, 4)
            bank += angle * (ramp(t, now, edge) - ramp(t, now + length, edge))
            length += edge
        elif kind < 0.8:
            target, length = rng.uniform(-4, 5), rng.uniform(4, 8)
            up = up + (target - climb) * ramp(t, now, length)
            climb = target
        else:
            length = rng.uniform(8, 15)
            speed = speed + rng.uniform(-6, 8) * ramp(t, now, length)
        now += length + rng.uniform(2, 20)
    rough = rng.uniform(0.2, 1.0) * airborne
    gusts = noise(rng, n, 0.15, 1.0, 4)
    bank += 1.2 * DEG * rough * gusts[:, 0]
    rate = G * np.tan(bank) / np.maximum(speed, 20) * airborne
    heading = rng.uniform(-np.pi, np.pi) + cumulative_trapezoid(rate, t, initial=0.0)
    attack = rng.uniform(1.5, 5.0) * DEG * airborne
    pitch = np.arcsin(np.clip(up / np.maximum(speed, 20), -0.4, 0.4)) + attack
    pitch += 0.6 * DEG * rough * gusts[:, 1]
    wind_to = rng.uniform(-np.pi, np.pi)
    wind = rng.uniform(0, 12) * np.array([np.sin(wind_to), np.cos(wind_to)])
    flat = _turned(np.sqrt(np.maximum(speed**2 - up**2, 0)), heading, t)
    flat += cumulative_trapezoid(airborne[:, None] * wind, t, axis=0, initial=0.0)
    high = cumulative_trapezoid(up, t, initial=0.0) + 0.05 * rough * gusts[:, 2]
    heading = heading + 0.8 * DEG * rough * gusts[:, 3]
    engine = np.clip(0.3 + 0.7 * speed / cruise, 0, 1)
    return np.column_stack([flat, high]), heading, pitch, bank, engine


def _walk(rng: np.random.Generator, t: np.ndarray, draw: dict[str, Any]) -> tuple[np.ndarray, ...]:
    n, pace = len(t), rng.uniform(1.1, 1.6)
    going = np.ones(n) if draw["start"] == "moving" else ramp(t, draw["rest_s"], 1.0)
    rate = np.zeros(n)
    now = 1.0 if draw["start"] == "moving" else draw["rest_s"] + 3
    while now < t[-1]:
        kind = rng.random()
        if kind < 0.55:
            length, angle = rng.uniform(1.2, 2.5), rng.choice([-1, 1]) * rng.uniform(50, 110) * DEG
            rate += bend(t, now, length, angle)
        elif kind < 0.85:
            length = rng.uniform(6, 25)
            rate += bend(t, now, length, rng.choice([-1, 1]) * rng.uniform(10, 60) * DEG)
        else:
            length = rng.uniform(4, 15)
            going = going - ramp(t, now, 0.8) + ramp(t, now + length, 0.8)
        now += length + rng.uniform(3, 20)
    speed = pace * going
    course = rng.uniform(-np.pi, np.pi) + cumulative_trapezoid(rate, t, initial=0.0)
    cadence = 2 * np.pi * rng.uniform(1.7, 2.1) * (1 + 0.02 * noise(rng, n, 0.05, 0.3)[:, 0])
    step = cumulative_trapezoid(cadence, t, initial=0.0)
    up = going * (0.022 * np.cos(step) + 0.0015 * np.cos(3 * step + 1) + 0.0006 * np.cos(5 * step))
    side = going * (0.02 * np.sin(step / 2) + 0.0015 * np.sin(2.5 * step))
    surge = going * 0.008 * np.sin(step + 0.6)
    sway = rng.uniform(0.5, 1.3)
    hand = noise(rng, n, 0.05, 0.6, 3) * draw["hand_deg"] * DEG
    heading = course + going * sway * 4 * DEG * np.sin(step / 2 + 0.5) + hand[:, 0]
    pitch = going * sway * 2 * DEG * np.sin(step + 1) + hand[:, 1]
    roll = going * sway * 2.5 * DEG * np.sin(step / 2 + 2) + hand[:, 2]
    ahead = np.column_stack([np.sin(course), np.cos(course)])
    right = np.column_stack([np.cos(course), -np.sin(course)])
    flat = _turned(speed, course, t) + surge[:, None] * ahead + side[:, None] * right
    way = cumulative_trapezoid(speed, t, initial=0.0)
    hill = 3 * np.sin(way / rng.uniform(60, 300) + rng.uniform(0, 6))
    return np.column_stack([flat, hill + up]), heading, pitch, roll, np.zeros(n)


def _boat(rng: np.random.Generator, t: np.ndarray, draw: dict[str, Any]) -> tuple[np.ndarray, ...]:
    n, cruise = len(t), rng.uniform(2.5, 12)
    moving = draw["start"] == "moving"
    speed = np.full(n, cruise) if moving else cruise * ramp(t, draw["rest_s"], 12.0)
    rate = np.zeros(n)
    now = 2.0 if moving else draw["rest_s"] + 8
    v = cruise
    while now < t[-1]:
        if rng.random() < 0.7:
            angle = rng.choice([-1, 1]) * rng.uniform(20, 150) * DEG
            length = abs(angle) / (rng.uniform(2, 8) * DEG) + 6
            rate += bend(t, now, length, angle)
        else:
            target, length = cruise * rng.uniform(0.4, 1.2), rng.uniform(6, 14)
            speed = speed + (target - v) * ramp(t, now, length)
            v = target
        now += length + rng.uniform(3, 30)
    heading = rng.uniform(-np.pi, np.pi) + cumulative_trapezoid(rate, t, initial=0.0)
    sea = rng.uniform(0.2, 1.0) * (0.4 + 0.6 * np.clip(speed / cruise, 0, 1))
    waves = noise(rng, n, 0.12, 0.4, 4) + 0.03 * noise(rng, n, 0.8, 2.0, 4)
    pitch = 2.0 * DEG * sea * waves[:, 0] + 0.3 * DEG * speed
    roll = 4.0 * DEG * sea * waves[:, 1] + np.arctan(speed * rate / G) * 0.8
    set_to, way = rng.uniform(-np.pi, np.pi), _turned(speed, heading, t)
    stream = rng.uniform(0, 1.2) * np.array([np.sin(set_to), np.cos(set_to)])
    free = np.ones(n) if moving else ramp(t, draw["rest_s"] - 1, 4.0)  # moored until then
    way += cumulative_trapezoid(free[:, None] * stream, t, axis=0, initial=0.0)
    heading = heading + 1.0 * DEG * sea * waves[:, 3]
    engine = 0.3 + 0.7 * np.clip(speed / 12, 0, 1)
    return np.column_stack([way, 0.25 * sea * waves[:, 2]]), heading, pitch, roll, engine


def make_motion(rng: np.random.Generator, draw: dict[str, Any], mount: Rotation) -> Motion:
    """Draw the motion of this kind; what it begins with and how long it lasts are drawn already."""
    t = np.arange(-MARGIN, draw["duration_s"] + MARGIN + STEP / 2, STEP)
    makers = {"aircraft": _aircraft, "walk": _walk, "boat": _boat}
    path, heading, pitch, roll, engine = makers.get(draw["kind"], _car)(rng, t, draw)
    vehicle = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll]))
    arm = vehicle.apply(draw["unit_at_m"])  # north, east, down
    path = path + np.column_stack([arm[:, 1], arm[:, 0], -arm[:, 2]])
    path = path - path[round(MARGIN / STEP)]
    path[:, 2] -= (path[:, 0] ** 2 + path[:, 1] ** 2) / (2 * A)  # along the level of the Earth
    spline = make_interp_spline(t, np.column_stack([path, heading, pitch, roll]), k=5)
    disturbance = rng.normal(0, [1.5e-4, 1.5e-4, 3e-4])  # deflection of some seconds of arc
    return Motion(
        spline, mount, draw["lat_deg"] * DEG, draw["lon_deg"] * DEG, draw["alt_m"], disturbance,
        draw["duration_s"], engine, t,
    )  # fmt: skip
