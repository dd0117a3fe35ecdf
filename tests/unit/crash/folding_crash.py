"""Drawn crashes of cars that fold and ring, with exact truth, and the points that record them.

They know nothing of the structural term that is learnt: a rigid body under two overlapping pulses
that turns and goes on turning, whose points have humps of a local deformation and ringing of some
frequencies on top. Sensors, positions, mountings, attitude and entry err as stated; the car
accelerates steadily before the crash, as far as the preparation takes it to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from strapdown import CrashOptions, Entry, reconstruct_crash, rotation
from strapdown.crash.combine_units import combine_units
from strapdown.crash.consistency import compare_units
from strapdown.crash.preparation import Preparation, prepare_together
from strapdown.crash.reconstruction import CrashReconstruction, reconstruct_unit
from strapdown.sensors.crash_unit import Assumed, CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO, imu_table

G, RATE, FINE = 9.80665, 1000.0, 10
#: Direction of the force, deg, and standard deviation of the yaw rate after it, rad/s at 15 m/s.
KINDS = {
    "front": (0, 0.09),
    "offset": (0, 1.5),
    "side": (90, 0.45),
    "rear": (180, 0.09),
    "oblique": (40, 1.2),
    "pole": (0, 1.5),
}
NOISE, BIAS, SCALE, GYRO_NOISE = 0.3, 0.1, 0.01, 0.002
POSITION_SD, ANGLES_SD, LEVEL_SD, SPEED_SD = 0.02, 0.5, 0.5, 0.1
#: A gyro of the vehicle is believed to the end of the record, an assumed turning not so long.
END, ASSUMED_END = 0.349, 0.15
#: What a case can state falsely of a point, in words of `Crash.unit`.
FAULTS = ("sign", "axes", "scale", "lever arm")
#: Keys of the streams of random numbers beside that of a crash: SeedSequence fills up with zeros.
DRIVE, STATED, POINT = 97, 98, 99


def pulse(time, start, length):
    """A haversine of area one."""
    return 2.0 / length * np.sin(np.pi * np.clip((time - start) / length, 0, 1)) ** 2


@dataclass(frozen=True)
class Fault:
    """What is stated falsely of a point, or happens to its record.

    `turned_deg`: about down. `moved`, m: its true position is that much farther. `gyro`: factor
    of the yaw rate. `late`, s: its clock. `end`, s: of the record. `full_scale`, m/s². `factor`: of
    all accelerations. `missing`: axes that are not recorded.
    """

    turned_deg: float = 0.0
    moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyro: float = 1.0
    late: float = 0.0
    end: float = END
    full_scale: float = 3000.0
    factor: tuple[float, float, float] = (1.0, 1.0, 1.0)
    missing: str = ""


class Crash:
    """A drawn crash: force of the rigid body and rates, vehicle axes.

    `over_ground`: the force keeps its direction over ground; else along the axes of the vehicle.
    """

    def __init__(self, seed, kind, over_ground=False):
        rng = np.random.default_rng([seed, list(KINDS).index(kind)])
        came = math.radians(KINDS[kind][0] + rng.normal(0, 5))
        self.length = rng.uniform(*((0.05, 0.08) if kind == "pole" else (0.07, 0.13)))
        self.share, self.second = rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.4) * self.length
        size = rng.uniform(4, 20)
        self.change = -size * np.array([math.cos(came), math.sin(came), 0.02 * rng.normal()])
        self.turn_sd = size / 15.0 * np.array([0.3, 0.3, KINDS[kind][1]])
        self.turned = self.turn_sd * rng.normal(size=3)
        self.bent = math.exp(rng.uniform(math.log(0.01), math.log(0.12)))
        self.size, self.seed, self.kind = size, seed, list(KINDS).index(kind)
        self.over_ground, self.fades, self.before = over_ground, 1.0, np.zeros(3)
        of_drive = np.random.default_rng([seed, self.kind, DRIVE])
        self.steady = Preparation.steady_acceleration * of_drive.normal(size=3)
        self.speed = 20.0

    @classmethod
    def of(cls, seed, change, rates, length, turn_sd):
        """A crash of a given change over ground; `rates`, rad/s: before it, and their change."""
        made = cls(seed, "front", over_ground=True)
        made.change = np.asarray(change, dtype=float)
        made.before, made.turned = (np.asarray(x, dtype=float) for x in rates)
        made.size = float(np.linalg.norm(made.change))
        made.length, made.second = length, min(made.second, 0.4 * length)
        made.turn_sd, made.fades = np.asarray(turn_sd), 0.0
        return made

    def shape(self, time):
        first = pulse(time, 0.0, 0.6 * self.length)
        second = pulse(time, self.second, self.length - self.second)
        return self.share * first + (1 - self.share) * second

    def grown(self, time):
        """Rates at even stamps, (n,), as a multiple of `turned`."""
        shape = np.cumsum(self.shape(time)) * (time[1] - time[0])
        return shape * np.exp(-self.fades * np.maximum(time - 0.12, 0))

    def turned_by(self, end):
        """Angle by an instant over `turned`, s."""
        time = np.linspace(0.0, end, 2001)
        return float(np.trapezoid(self.grown(time), time))

    def motion(self, time):
        """Specific force of the body and its rates at even stamps, vehicle axes, (n, 3) each."""
        rates = self.before + np.outer(self.grown(time), self.turned)
        force = np.outer(self.shape(time), self.change)
        if self.over_ground:
            yaw = np.cumsum(rates[:, 2]) * (time[1] - time[0])
            yaw -= np.interp(0.0, time, yaw)
            c, s = np.cos(yaw), np.sin(yaw)
            x, y = force[:, 0].copy(), force[:, 1].copy()
            force[:, 0], force[:, 1] = c * x + s * y, -s * x + c * y
        force[time < 0.0] += self.steady
        return force + np.array([0, 0, -G]), rates

    def structure(self, rng, time):
        """Velocity of a point against the rigid body, (n, 3), m/s."""
        out = np.zeros((len(time), 3))
        for axis in range(3):
            own = 1.0 if axis == np.argmax(np.abs(self.change)) else 0.5
            humps = np.zeros(len(time))
            for _ in range(rng.integers(1, 4)):
                length, start = rng.uniform(0.015, 0.06), rng.uniform(0, self.length - 0.0075)
                humps += rng.normal() * np.sin(np.pi * np.clip((time - start) / length, 0, 1)) ** 2
            size = self.bent * self.size * rng.uniform(0.3, 1) * own
            out[:, axis] += size * humps / max(np.abs(humps).max(), 1e-9)
            for _ in range(3):
                frequency, quality = rng.uniform(25, 150), rng.uniform(2, 8)
                since = np.maximum(time - rng.uniform(0, 0.6 * self.length), 0)
                fades = (1 - np.exp(-since / 0.01)) * np.exp(-since * np.pi * frequency / quality)
                rings = np.sin(2 * np.pi * frequency * since)
                out[:, axis] += 0.15 * self.bent * self.size * rng.normal() * fades * rings
        return out

    def truth(self, start, end):
        """Change of velocity of the rigid body, (3,), along its axes."""
        time = np.linspace(start, end, 20001)
        force, _ = self.motion(time)
        return np.trapezoid(force + np.array([0, 0, G]), time, axis=0)

    @cache  # noqa: B019
    def position(self, end):
        """Where the body is at an instant, (3,), m: from where and how it was at time zero."""
        step = 5e-4
        time = np.arange(round(end / step) + 1) * step
        force, rates = self.motion(time)
        C, velocity, position = np.eye(3), np.array([self.speed, 0.0, 0.0]), np.zeros(3)
        turns = rotation.dcm_from_rotation_vector(0.5 * step * (rates[:-1] + rates[1:]))
        for k in range(1, len(time)):
            C = C @ turns[k - 1]
            gained = step * (C @ (0.5 * (force[k - 1] + force[k])) + np.array([0, 0, G]))
            position = position + step * (velocity + 0.5 * gained)
            velocity = velocity + gained
        return position

    def unit(self, number, *, gyro, wrong="", fault=None):
        """A recorder with drawn errors and position; `wrong`, `fault`: what is false of it."""
        fault = fault or Fault()
        rng = np.random.default_rng([self.seed, self.kind, POINT, number])
        place = np.array(
            [
                rng.uniform(-1, 0.6),
                (-1) ** (number + 1) * rng.uniform(0.4, 0.75),
                rng.uniform(-0.1, 0.3),
            ]
        )
        # Means over the step that ends at the stamp, from 0.1 s before the trigger on.
        fine = (np.arange(-101 * FINE, 371 * FINE) + 0.5) / (RATE * FINE)
        force, rates = self.motion(fine - fault.late)
        spin = np.gradient(rates, fine, axis=0)
        true_place = place + np.asarray(fault.moved)
        force = force + np.gradient(self.structure(rng, fine - fault.late), fine, axis=0)
        true_place = true_place + POSITION_SD * rng.normal(size=3)
        force = force + np.cross(spin, true_place) + np.cross(rates, np.cross(rates, true_place))
        off = np.radians(ANGLES_SD * rng.normal(size=3) + [0.0, 0.0, fault.turned_deg])
        C = rotation.dcm_from_rotation_vector(off)

        def means(x):
            return (x @ C).reshape(-1, FINE, 3).mean(axis=1)

        felt, turned = means(force), means(rates)
        time = np.arange(-100, 350) / RATE
        n = min(len(felt), int(np.searchsorted(time, fault.end + 1e-9)))
        time = time[:n]
        read = felt[:n] * (1 + SCALE * rng.normal(size=3)) + BIAS * rng.normal(size=3)
        read = read + NOISE * rng.normal(size=(n, 3))
        turned = turned[:n] + GYRO_NOISE * rng.normal(size=(n, 3))
        main = int(np.argmax(np.abs(self.change)))
        if wrong == "sign":
            read[:, main] *= -1
        elif wrong == "axes":
            read = read[:, [1, 0, 2]]
        elif wrong == "scale":
            read = read * [1.25, 1.25, 1.0]
        elif wrong == "lever arm":
            place = place - 0.8 * np.sign(place) * [1, 1, 0]
        elif wrong == "turns back":
            read[:, main] -= 0.6 * self.change[main] * pulse(time, 0.09, 0.05)
        read = np.clip(read * fault.factor, -fault.full_scale, fault.full_scale)
        turned[:, 2] *= fault.gyro
        table = imu_table(time, turned, read, sampling="mean")
        accel = table[[a for a in ACCEL if a[-1] not in fault.missing]]
        model = TriadUncertainty(
            noise_density=NOISE / RATE**0.5, bias=BIAS, scale=SCALE, full_scale=fault.full_scale
        )
        of_gyro = TriadUncertainty(noise_density=GYRO_NOISE / RATE**0.5)
        turn = tuple(np.degrees(self.turned_by(ASSUMED_END) * self.turn_sd).tolist())
        if gyro and not fault.missing:
            assumed = None
        else:
            assumed = Assumed(
                turn_sd_deg=None if gyro else turn,
                delta_v_sd=self.size if fault.missing else None,
                over=(0.0, ASSUMED_END),
            )
        return CrashUnit(
            "ABCDEF"[number],
            (RecordedTriad(accel, model, "accelerometer"),),
            RecordedTriad(table[GYRO], of_gyro, "gyro") if gyro else None,
            Mounting(tuple(place), position_sd=POSITION_SD, angles_sd_deg=ANGLES_SD),
            trigger=0.0,
            trigger_sd=1e-5,
            assumed=assumed,
        )

    def stated(self, units, entry=None, until=None) -> tuple[Entry, CrashOptions]:
        """Entry and options of a reconstruction, with a stated attitude that errs as it says."""
        rng = np.random.default_rng([self.seed, self.kind, STATED])
        roll, pitch, speed = rng.normal(size=3) * [LEVEL_SD, LEVEL_SD, SPEED_SD]
        blind = any(u.gyro is None for u in units)
        return (
            entry or Entry.from_speed(self.speed + speed, SPEED_SD),
            CrashOptions(
                window=(-0.09, until or (ASSUMED_END if blind else END - 0.002)),
                rate=RATE,
                sampling="mean",
                preparation={"levelling": (roll, pitch, LEVEL_SD)},
            ),
        )

    def reconstructed(self, units, entry=None, until=None) -> CrashReconstruction:
        """By some units."""
        return reconstruct_crash(units, *self.stated(units, entry, until))

    def answered(self, units, entry=None, until=None):
        """The first unit's answer, that of the mean or None, and the comparison.

        The same as those of `reconstructed`, in a third of its time: without the answers of the
        other units and the search for errors that would not show.
        """
        entry, options = self.stated(units, entry, until)
        there = prepared(units, options)
        comparison = compare_units(there)
        there = [comparison.structure.within(of) for of in there]
        single = reconstruct_unit(there[0], entry, options)
        if not comparison.agree:
            return single, None, comparison
        mean = reconstruct_unit(combine_units(there), entry, options, units=there)
        return single, mean, comparison


def prepared(units, options):
    """Units at the reference point, as `reconstruct_crash` compares them."""
    together = synchronise(
        units, method="trigger", rate=options.rate, sampling=options.sampling, cut=False
    )
    return prepare_together(together, options.point, options.gravity, options.preparation)


#: Figures of an answer whose coverage is counted.
FIGURES = (
    *("forward", "right", "resultant", "PDOF", "position forward", "position right"),
    "largest in 30 ms",
)


def errors(answer, crash):
    """Errors of an answer over the half widths of its 95 % bounds, (7,)."""
    change, path = answer.delta_v, answer.path
    true = crash.truth(change.delta_v.start, change.delta_v.end)
    off = change.delta_v.vector - true
    angle = math.degrees(math.atan2(-true[1], -true[0]))
    turn = (change.pdof.horizontal_deg - angle + 180.0) % 360.0 - 180.0
    across = change.interval.horizontal
    side = across.low_deg if turn > 0 else across.high_deg
    wide = abs((side - change.pdof.horizontal_deg + 180.0) % 360.0 - 180.0)
    at = path.table[["north", "east"]].iloc[-1].to_numpy() - crash.position(path.time[-1])[:2]
    whole = np.array([*off[:2], change.resultant - math.hypot(*true[:2]), turn, *at])
    half = [*change.bound.half_width[:2], change.resultant_bound, wide]
    of = next(one for one in answer.body if one.event is change).peak
    truth = np.linalg.norm(crash.truth(of.delta_v.start, of.delta_v.end))
    whole = np.append(whole, of.resultant - truth)
    return whole / [*half, *(1.96 * path.sd[["north", "east"]].iloc[-1]), of.resultant_bound]
