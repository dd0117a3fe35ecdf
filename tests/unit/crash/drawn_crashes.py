"""Drawn crashes of five kinds with exact truth, and two units that record them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from tests.unit.crash.made_units import GYRO, HIGH, LOW, G, haversine, record, table

from strapdown import rotation
from strapdown.crash.entry import Entry
from strapdown.crash.reconstruction import CrashReconstruction, reconstruct_crash
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad

#: Direction of force, deg, and length of the pulse, s: least and greatest.
KINDS = {
    "front": ((-15.0, 15.0), (0.08, 0.14)),
    "oblique": ((25.0, 65.0), (0.08, 0.15)),
    "side": ((80.0, 100.0), (0.05, 0.12)),
    "rear": ((165.0, 195.0), (0.08, 0.18)),
    "pole": ((-25.0, 25.0), (0.06, 0.10)),
}
STATED = (
    Mounting((0.6, -0.45, 0.2), (0.0, 0.0, 0.0), 0.02, 1.0),
    Mounting((-0.3, 0.4, 0.1), (0.0, 0.0, 90.0), 0.02, 1.0),
)


def course(x):
    """Share of a haversine's change reached, x from 0 to 1 over it."""
    x = np.clip(x, 0.0, 1.0)
    return x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi)


@dataclass(frozen=True)
class DrawnCrash:
    """A crash whose contact begins at zero.

    `pulses`: start and length, s, of haversines, and their change forward, right, down, m/s; the
    last ends the contact. `braking`, m/s², from 0.5 s before the contact to its end; `sliding`,
    m/s², from there on. `yaw`, deg/s: rate gained over the contact.
    """

    kind: str
    pulses: tuple[tuple[float, float, tuple[float, float, float]], ...]
    braking: float
    sliding: float
    yaw: float

    @property
    def end(self) -> float:
        return max(start + length for start, length, _ in self.pulses)

    @property
    def change(self):
        """True change of velocity over the contact, (3,), along the axes of the vehicle."""
        total = sum(np.asarray(change) for _, _, change in self.pulses)
        return total - [self.braking * self.end, 0.0, 0.0]

    def motion(self, time):
        """Acceleration, rates and angular acceleration in the vehicle's axes, (n, 3) each."""
        accel, rate, swing = (np.zeros((time.size, 3)) for _ in range(3))
        accel[:, 0] += 3.5 * haversine((time + 3.5) / 2.0)
        ramp = course((time + 0.5) / 0.2)
        accel[:, 0] -= np.where(time < self.end, self.braking * ramp, 0.0)
        for start, length, change in self.pulses:
            accel += np.outer(haversine((time - start) / length) / length, change)
        slid = course((time - self.end) / 0.1)
        accel[:, 0] -= np.where(time > self.end, self.sliding * slid, 0.0)
        yaw = math.radians(self.yaw)
        rate[:, 2] = yaw * course(time / self.end)
        swing[:, 2] = yaw * haversine(time / self.end) / self.end
        return accel, rate, swing

    def unit(self, name, stated, rng, *, rate_hz, end=1.0, full_scale=None):
        """A unit whose mounting and sensors err as stated; its record ends at `end`, s."""
        time = np.arange(round(-6.0 * rate_hz), round(end * rate_hz) + 1) / rate_hz
        accel, rate, swing = self.motion(time)
        place = np.asarray(stated.position) + rng.normal(scale=stated.position_sd, size=3)
        accel = accel + np.cross(swing, place) + np.cross(rate, np.cross(rate, place))
        accel[:, 2] -= G
        small = np.radians(rng.normal(scale=stated.angles_sd_deg, size=3))
        turned = rotation.dcm_from_rotation_vector(small) @ stated.C_vs
        triads = []
        for of, kind, true in (
            (LOW, "low-G", accel),
            (HIGH, "high-G", accel),
            (GYRO, "gyro", rate),
        ):
            if full_scale is not None and kind == "high-G":
                of = type(of)(**{**_fields(of), "full_scale": full_scale})
            factor = 1.0 + rng.normal(scale=np.broadcast_to(of.scale, 3))
            bias = rng.normal(scale=np.broadcast_to(of.bias, 3))
            made = record(time, (true @ turned) * factor, of, rng, bias=bias)
            columns = "gyro" if kind == "gyro" else "accel"
            triads.append(RecordedTriad(table(time, made, columns), of, kind))
        return CrashUnit(name, tuple(triads[:2]), triads[2], stated, trigger=0.0)


def _fields(of):
    return {name: getattr(of, name) for name in of.__dataclass_fields__}


def draw(kind, rng) -> DrawnCrash:
    """A crash of a kind."""
    (low, high), (short, long) = KINDS[kind]
    angle = math.radians(
        rng.uniform(low, high) * (rng.choice([-1, 1]) if kind in ("oblique", "side") else 1)
    )
    size, length = rng.uniform(4.0, 15.0), rng.uniform(short, long)
    if kind in ("side", "rear"):
        size *= 0.7
    total = -size * np.array([math.cos(angle), math.sin(angle), 0.0])
    # Parts that begin one after another and overlap: soft, hard, two-humped pulses.
    shares = rng.dirichlet([2.0, 2.0, 2.0])
    if kind == "pole":
        shares = np.array([0.15, 0.7, 0.15]) + rng.uniform(-0.1, 0.1) * np.array([1.0, -1.0, 0.0])
    starts = np.array([0.0, rng.uniform(0.1, 0.35), rng.uniform(0.4, 0.5)]) * length
    lengths = np.array([rng.uniform(0.5, 1.0) * length, 0.5 * length, length - starts[2]])
    pulses = tuple(
        (float(s), float(n), tuple((share * total).tolist()))
        for s, n, share in zip(starts, lengths, shares, strict=True)
    )
    braking = float(rng.uniform(0.0, 8.0)) if kind != "rear" and rng.uniform() < 0.4 else 0.0
    yaw = rng.normal(scale={"front": 20.0, "rear": 20.0}.get(kind, 100.0))
    return DrawnCrash(kind, pulses, braking, float(rng.uniform(0.0, 4.0)), float(yaw))


def reconstruct(crash: DrawnCrash, rng, **options) -> CrashReconstruction:
    """Reconstruct a drawn crash from two units at one rate."""
    rate_hz = float(rng.choice([200.0, 500.0, 1000.0]))
    units = [
        crash.unit(f"IMU{k}", mounting, rng, rate_hz=rate_hz, **options)
        for k, mounting in enumerate(STATED, start=1)
    ]
    return reconstruct_crash(units, Entry.from_speed(3.5, 0.05))


#: Figures of an event whose coverage is counted.
FIGURES = ("forward", "right", "resultant", "PDOF")


def errors(found, crash: DrawnCrash):
    """Errors and 95 % half widths of the figures of the largest event, (4,) each."""
    change, truth = found.delta_v, crash.change
    vector, half = change.delta_v.vector, change.bound.half_width
    across = change.interval.horizontal
    angle = math.degrees(math.atan2(-truth[1], -truth[0]))
    off = (change.pdof.horizontal_deg - angle + 180.0) % 360.0 - 180.0
    side = across.low_deg if off > 0 else across.high_deg
    wide = abs((side - change.pdof.horizontal_deg + 180.0) % 360.0 - 180.0)
    return (
        np.array([*(vector - truth)[:2], change.resultant - np.linalg.norm(truth[:2]), off]),
        np.array([*half[:2], change.resultant_bound, wide]),
    )
