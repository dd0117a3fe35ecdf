"""Made-up gyro logs of known motions, as phones, toys and wearables would write them.

`draw` draws from one seed what a log is, as plain numbers and words; `make` makes it: the exact
motion, the samples of the sensor, the stamps that somebody wrote, the file, and the truth beside
it. A part of the draw can be changed and the rest stays as it was, because every part has its own
stream of random numbers. The generator knows nothing of how a log is read or judged.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt

Array = NDArray[np.float64]

ROOT = 20261126
DEG = np.pi / 180
G = 9.80665
KINDS = ("sway", "pulses", "walk", "spins", "throw")
SAMPLINGS = ("instant", "mean before", "mean after", "decimated")
DIFFICULTIES = (
    "none", "gap moving", "gap at rest", "lost", "bursts", "jitter", "drift", "ticks", "sign",
    "axes named", "axes unnamed", "units",
)  # fmt: skip
#: Two of one group are never drawn together: each decides the same column of the file.
GROUPS = {
    "bursts": "stamps", "jitter": "stamps", "ticks": "stamps",
    "sign": "axes", "axes named": "axes", "axes unnamed": "axes",
    "gap moving": "rows", "gap at rest": "rows", "lost": "rows",
}  # fmt: skip
#: Body axes that the sensor's x, y, z point along, as the line `# axes:` has them; right-handed.
AXES = {
    "forward-left-up": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "right-forward-up": [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
    "back-right-up": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    "left-back-up": [[0, -1, 0], [-1, 0, 0], [0, 0, -1]],
}
#: Name of the column of stamps, and its unit in s.
CLOCKS = {"time_s": 1.0, "t_ms": 1e-3, "timestamp_us": 1e-6, "timestamp_ns": 1e-9}
#: Names of the columns of the gyro and the accelerometer, and their units in rad/s and m/s².
GYROS = {
    "gyro_{}_rad_s": 1.0, "gyro_{}_deg_s": DEG, "gyr_{} [deg/s]": DEG, "gyro_{} (mdps)": 1e-3 * DEG,
}  # fmt: skip
ACCELS = {"accel_{}_m_s2": 1.0, "acc_{} [g]": G, "accel_{}_g": G, "acc_{} (mg)": 1e-3 * G}
RATES = (25, 50, 52, 100, 104, 119, 200, 208, 238, 250, 400, 416, 476, 500, 833, 952, 1000)
EDGE = 0.3  # s, in which a body comes to rest
FINE = 4000  # Hz
TRUTH = 250  # Hz: between two of them 26,000 deg/s² are 0.05° off a turn at constant rate


def stream(seed: int, name: str) -> np.random.Generator:
    """The random numbers of one part of a log."""
    return np.random.default_rng([ROOT, seed, zlib.crc32(name.encode())])


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# ------------------------------------------------------------------------------- the motion
def _ramp(x: Array) -> tuple[Array, Array]:
    """A step of least jerk from 0 to 1 over 0 < x < 1, and its integral from zero."""
    s = np.clip(x, 0.0, 1.0)
    over = np.maximum(x - 1.0, 0.0)
    return s**3 * (10 - 15 * s + 6 * s**2), s**4 * (2.5 - 3 * s + s**2) + over


def _held(t: Array, begin: float, length: float, edge: float) -> tuple[Array, Array]:
    """One between two edges of least jerk and zero outside, and its integral."""
    up, up_sum = _ramp((t - begin) / edge)
    down, down_sum = _ramp((t - begin - length + edge) / edge)
    return up - down, edge * (up_sum - down_sum)


@dataclass(frozen=True)
class Turn:
    """A turn about one axis by an angle that is known at every instant, with its rate."""

    axis: Array
    waves: Array = field(default_factory=lambda: np.empty((0, 3)))  # rad, Hz, rad
    helds: Array = field(default_factory=lambda: np.empty((0, 4)))  # rad/s, start, length, edge, s
    strikes: Array = field(default_factory=lambda: np.empty((0, 3)))  # rad, instant, width, s

    def angle(self, t: Array) -> tuple[Array, Array]:
        """The angle in rad and its rate in rad/s."""
        angle, rate = np.zeros_like(t), np.zeros_like(t)
        for size, frequency, phase in self.waves:
            w = 2 * np.pi * frequency
            angle += size * np.sin(w * t + phase)
            rate += size * w * np.cos(w * t + phase)
        for size, begin, length, edge in self.helds:
            on, total = _held(t, begin, length, edge)
            angle += size * total
            rate += size * on
        for size, instant, width in self.strikes:
            x = (t - instant) / width
            bump = size * np.exp(-0.5 * x**2)
            angle += bump
            rate -= bump * x / width
        return angle, rate


def multiply(a: Array, b: Array) -> Array:
    """Products of quaternions, scalar first, (..., 4)."""
    w, x, y, z = np.moveaxis(a, -1, 0)
    p, q, r, s = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            w * p - x * q - y * r - z * s,
            w * q + x * p + y * s - z * r,
            w * r - x * s + y * p + z * q,
            w * s + x * r - y * q + z * p,
        ],
        axis=-1,
    )


def turned(q: Array, v: Array) -> Array:
    """Vectors of the body in the axes of the world: ``C(q) v``."""
    u = q[..., 1:]
    t = 2 * np.cross(u, v)
    return np.asarray(v + q[..., :1] * t + np.cross(u, t))


@dataclass(frozen=True)
class Motion:
    """Turns one after the other, q = q1 q2 …, with rests between; exact at every instant.

    The clock of the turns stops in a rest, `own`, so that the body stays in the pose that it has.
    """

    turns: tuple[Turn, ...]
    waves: Array  # (k, 3, 3) position: m, Hz, rad
    rests: tuple[tuple[float, float], ...]
    duration: float

    def own(self, t: Array) -> tuple[Array, Array]:
        """Time in motion up to an instant, and its rate: 1 in motion, 0 in a rest."""
        time, rate = t.copy(), np.ones_like(t)
        for begin, end in self.rests:
            # From `begin` on the body slows down, rests, and has its full speed again at `end`.
            still, total = _held(t, begin, end - begin, EDGE)
            rate -= still
            time -= total
        return time, rate

    def state(self, t: Array) -> tuple[Array, Array]:
        """q_nb, (n, 4), and the rate of the body in its own axes, (n, 3) rad/s."""
        own, speed = self.own(np.asarray(t, dtype=np.float64))
        q = np.zeros((len(own), 4))
        q[:, 0] = 1.0
        omega = np.zeros((len(own), 3))
        for turn in self.turns:
            angle, rate = turn.angle(own)
            step = np.column_stack([np.cos(angle / 2), np.sin(angle / 2)[:, None] * turn.axis])
            back = step * [1, -1, -1, -1]
            omega = turned(back, omega) + rate[:, None] * turn.axis
            q = multiply(q, step)
        return q, omega * speed[:, None]

    def force(self, t: Array) -> Array:
        """Specific force in body axes, m/s². The acceleration fades with the clock of the turns."""
        own, speed = self.own(t)
        a = np.zeros((len(t), 3))
        for wave in self.waves:
            w = 2 * np.pi * wave[:, 1]
            a -= wave[:, 0] * w**2 * np.sin(np.outer(own, w) + wave[:, 2])
        q, _ = self.state(t)
        return turned(q * [1, -1, -1, -1], a * speed[:, None] ** 2 - [0.0, 0.0, G])

    @cached_property
    def fine(self) -> tuple[Array, Array]:
        """Instants 1/FINE s apart, from before the start to beyond the end, and their rates."""
        t = np.arange(-0.5, self.duration + 0.5, 1 / FINE)
        return t, self.state(t)[1]

    @cached_property
    def summed(self) -> CubicSpline:
        """The integral of the rate, of a spline through the fine instants: to 1e-9 rad."""
        return CubicSpline(*self.fine).antiderivative()


def _axis(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


def _waves(rng: np.random.Generator, count: int, peak: float, low: float, high: float) -> Array:
    """Sinusoids whose rates have a root mean square of `peak` / 2 together."""
    f = np.exp(rng.uniform(np.log(low), np.log(high), count))
    size = rng.uniform(0.5, 1.0, count)
    size *= peak / np.sqrt(2) / np.linalg.norm(size)
    return np.column_stack([size / (2 * np.pi * f), f, rng.uniform(0, 2 * np.pi, count)])


def motion_of(facts: dict[str, Any]) -> Motion:
    """The motion of a draw."""
    rng = stream(facts["seed"], "motion")
    kind, peak, top = facts["kind"], facts["peak_deg_s"] * DEG, facts["top_hz"]
    length = facts["duration_s"]
    turns = [Turn(_axis(rng), helds=np.array([[rng.uniform(-3, 3), -2.0, 0.5, 0.2]]))]
    if kind == "sway":
        turns += [Turn(_axis(rng), _waves(rng, 3, peak / 1.7, 0.1, top)) for _ in range(3)]
    elif kind == "pulses":
        for _ in range(4):
            begin = np.sort(rng.uniform(0, length, max(3, int(length / 3))))
            lasts = rng.uniform(0.3, 1.2, len(begin))
            edge = np.minimum(lasts / 2, 0.6 / top)
            size = peak * rng.uniform(-1, 1, len(begin))
            turns.append(Turn(_axis(rng), helds=np.column_stack([size, begin, lasts, edge])))
    elif kind == "walk":
        step = rng.uniform(1.6, 2.2)
        struck = np.arange(0.3, length, 1 / step)
        for share, f in ((1.0, step / 2), (0.6, step), (0.25, 2 * step), (0.15, 3 * step)):
            size = share * peak / (2 * np.pi * f) / 1.5
            turns.append(Turn(_axis(rng), np.array([[size, f, rng.uniform(0, 2 * np.pi)]])))
        size = DEG * rng.uniform(0.3, 1.5, len(struck)) * rng.choice([-1, 1], len(struck))
        width = np.full(len(struck), min(0.06, 0.18 / top))
        turns.append(Turn(_axis(rng), strikes=np.column_stack([size, struck, width])))
        turns.append(Turn(np.array([0.0, 0.0, 1.0]), _waves(rng, 2, 0.5, 0.02, 0.1)))
    elif kind == "spins":
        turns += [Turn(_axis(rng), _waves(rng, 2, 0.15 * peak, 0.2, top / 2)) for _ in range(2)]
        for _ in range(3):
            begin = np.sort(rng.uniform(0.5, length, max(2, int(length / 5))))
            lasts = rng.uniform(0.4, 1.0, len(begin))
            edge = np.minimum(lasts / 2, 0.6 / top)
            size = peak * rng.uniform(0.5, 1, len(begin)) * rng.choice([-1, 1], len(begin))
            turns.append(Turn(_axis(rng), helds=np.column_stack([size, begin, lasts, edge])))
    else:  # thrown and caught: a spin and a precession that last as long as the flight
        turns += [Turn(_axis(rng), _waves(rng, 2, 0.2 * peak, 0.1, top / 2)) for _ in range(2)]
        begin = np.arange(rng.uniform(1.0, 3.0), length, rng.uniform(3.0, 6.0))
        lasts = rng.uniform(0.5, 0.9, len(begin))
        edge = np.full(len(begin), min(0.25, 0.4 / top))
        for share in (0.5, 1.0):
            size = share * peak * rng.uniform(0.5, 1, len(begin)) * rng.choice([-1, 1], len(begin))
            turns.append(Turn(_axis(rng), helds=np.column_stack([size, begin, lasts, edge])))
    a = rng.uniform(0.2, 2.0, (2, 3))
    f = rng.uniform(0.3, 1.8, (2, 3))
    waves = np.stack([a / (2 * np.pi * f) ** 2, f, rng.uniform(0, 2 * np.pi, (2, 3))], axis=2)
    rests = [tuple(one) for one in facts["rests_s"]]
    return Motion(tuple(turns), waves, tuple(rests), length)


# ------------------------------------------------------------------------------- the draw
def draw(seed: int) -> dict[str, Any]:
    """Draw what the log of a seed is, as numbers and words with their units in the keys."""
    rng = stream(seed, "difficulty.draw")
    hard = [DIFFICULTIES[seed % len(DIFFICULTIES)]]  # each first difficulty equally often
    if hard != ["none"] and rng.random() < 0.5:
        taken = {GROUPS.get(hard[0], hard[0])}
        other = [d for d in DIFFICULTIES[1:] if GROUPS.get(d, d) not in taken]
        hard.append(str(rng.choice(other)))
    out: dict[str, Any] = {"seed": seed, "difficulties": hard}

    rng = stream(seed, "motion.draw")
    kind = str(rng.choice(KINDS))
    rate = float(rng.choice(RATES))
    if "ticks" in hard and rate > 500:
        rate = 200.0
    out["kind"], out["rate_hz"] = kind, rate
    fastest = {"sway": 500, "pulses": 600, "walk": 350, "spins": 1400, "throw": 1200}[kind]
    out["peak_deg_s"] = round(_log(rng, fastest / 5, fastest), 1)
    # The motion is within the reach of the log's own rate, or hardly beyond.
    out["top_hz"] = round(min(_log(rng, 0.8, 6.0), rate / 10), 2)
    out["duration_s"] = round(float(rng.uniform(15, 40 if rate < 450 else 20)), 1)
    out["tolerance_deg"] = float(rng.choice([0.3, 0.5, 1.0, 2.0, 5.0]))
    rests = [[-EDGE - 1, round(float(rng.uniform(1.0, 3.5)), 2)]] if rng.random() < 0.6 else []

    rng = stream(seed, "rows.draw")
    gaps = []
    if hard[0].startswith("gap") or hard[-1].startswith("gap"):
        wide = [round(_log(rng, 0.5, 30.0), 2)]
        if rng.random() < 0.4:
            wide.append(round(_log(rng, 0.5, 5.0), 2))
        for k, length in enumerate(wide):
            begin = out["duration_s"] * (0.3 if k == 0 else 0.75) + sum(wide[:k])
            gaps.append([round(begin, 2), round(begin + length, 2)])
            if "gap at rest" in hard:
                rests.append([round(begin - EDGE - 0.4, 2), round(begin + length + EDGE + 0.4, 2)])
        out["duration_s"] = round(out["duration_s"] + sum(wide), 2)
    out["rests_s"], out["gaps_s"] = rests, gaps
    out["lost_share"] = round(_log(rng, 0.01, 0.2), 3) if "lost" in hard else 0.0

    rng = stream(seed, "sensor.draw")
    out["sampling"] = str(rng.choice(SAMPLINGS, p=[0.4, 0.25, 0.15, 0.2]))
    out["cut_off_share"] = round(float(rng.uniform(0.25, 0.45)), 3) if rng.random() < 0.5 else 0.0
    out["delay_in_stamps"] = bool(rng.random() < 0.6)  # its maker takes the filter's delay off
    out["noise_deg_s"] = round(_log(rng, 5e-4, 3e-3), 6)  # per root of Hz
    out["bias_deg_s"] = [round(float(x), 6) for x in rng.normal(0, 5e-4, 3)]
    out["accel"] = bool(rng.random() < 0.7)

    rng = stream(seed, "stamps.draw")
    out["clock_offset_s"] = round(float(rng.choice([0.0, rng.uniform(0, 1000)])), 3)
    out["drift_ppm"] = round(float(rng.uniform(-1000, 1000)), 1) if "drift" in hard else 0.0
    out["burst"] = int(rng.integers(4, 21)) if "bursts" in hard else 1
    out["burst_apart_s"] = float(rng.choice([0.0, round(_log(rng, 2e-5, 3e-4), 6)]))
    out["jitter_share"] = round(_log(rng, 0.03, 0.4), 3) if "jitter" in hard else 0.0
    out["jitter"] = str(rng.choice(["uniform", "heavy"]))
    coarse = [1e-3, 1e-2] if rate <= 250 else [1e-3]
    out["tick_s"] = float(rng.choice(coarse)) if "ticks" in hard else 0.0

    rng = stream(seed, "file.draw")
    out["axes"] = "forward-right-down"
    if "axes named" in hard or "axes unnamed" in hard:
        out["axes"] = str(rng.choice(list(AXES)))
    by_owner = "owner" if rng.random() < 0.5 else "header"  # who names them
    out["axes_named"] = {"axes named": by_owner, "axes unnamed": "nobody"}.get(
        next((d for d in hard if d.startswith("axes")), ""), "header"
    )
    out["sign_of"] = int(rng.integers(0, 3)) if "sign" in hard else -1
    many = "units" in hard
    out["clock"] = str(rng.choice(list(CLOCKS))) if many else "time_s"
    out["gyro"] = str(rng.choice(list(GYROS))) if many else "gyro_{}_rad_s"
    out["accel_named"] = str(rng.choice(list(ACCELS))) if many else "accel_{}_m_s2"
    states = {"instant": "instantaneous", "mean before": "mean", "decimated": "mean"}
    stated = states.get(out["sampling"]) if rng.random() < 0.5 else None
    out["sampling_stated"] = stated
    return out


# -------------------------------------------------------------------------------- the log
@dataclass(frozen=True)
class Made:
    """A log on disk, its truth, and what is known of it."""

    draw: dict[str, Any]
    motion: Motion
    log: Path
    truth: Path
    instants: Array  # true times of the rows, s
    stamps: Array  # as written, s
    rates: Array  # what the sensor sensed at the rows, body axes, rad/s


def sampled(facts: dict[str, Any], motion: Motion, t: Array) -> Array:
    """Rates that the sensor gives at even instants `t`, before noise and bias, rad/s."""
    step = 1 / facts["rate_hz"]
    summed = motion.summed
    if facts["cut_off_share"] and facts["sampling"] in ("instant", "decimated"):
        cut = facts["cut_off_share"] * facts["rate_hz"]
        fine, rates = motion.fine
        low_pass = butter(2, cut, fs=FINE, output="sos")
        passed = rates[0] + sosfilt(low_pass, rates - rates[0], axis=0)
        delay = np.sqrt(2) / (2 * np.pi * cut) if facts["delay_in_stamps"] else 0.0
        spline = CubicSpline(fine - delay, passed)
        if facts["sampling"] == "instant":
            return np.asarray(spline(t))
        summed = spline.antiderivative()
    if facts["sampling"] == "instant":
        return motion.state(t)[1]
    if facts["sampling"] == "mean after":
        return np.asarray((summed(t + step) - summed(t)) / step)
    if facts["sampling"] == "mean before":
        return np.asarray((summed(t) - summed(t - step)) / step)
    # The chip averages eight samples of its own, each the mean over an eighth of the step but the
    # last, which is read out an eighth late.
    return np.asarray((summed(t - step / 8) - summed(t - 9 * step / 8)) / step)


def stamped(facts: dict[str, Any], t: Array) -> Array:
    """What is written of the true instants `t`: drift, bursts, jitter and ticks of the clock."""
    rng = stream(facts["seed"], "stamps")
    step = 1 / facts["rate_hz"]
    out = facts["clock_offset_s"] + t * (1 + 1e-6 * facts["drift_ppm"])
    if facts["burst"] > 1:  # read from a memory of so many samples, when it is full
        number = np.round(t / step).astype(int)
        place = number % facts["burst"]
        last = out + (facts["burst"] - 1 - place) * step
        out = last + 0.002 * rng.random(number.max() // facts["burst"] + 1)[
            number // facts["burst"]
        ] + place * facts["burst_apart_s"]  # fmt: skip
    if facts["jitter_share"]:
        size = facts["jitter_share"] * step
        if facts["jitter"] == "uniform":
            out = out + rng.uniform(-size, size, len(t))
        else:  # late by an exponential of which few are long, and the next ones wait behind
            late = 0.2 * size * rng.standard_exponential(len(t))
            late[rng.random(len(t)) < 0.02] *= 15
            out = out + late
            for k in range(1, len(out)):
                out[k] = max(out[k], out[k - 1] + 2e-5)
    if facts["tick_s"]:
        out = np.floor(out / facts["tick_s"]) * facts["tick_s"]
    return np.asarray(out)


def make(facts: dict[str, Any], folder: Path) -> Made:
    """Make the log and its truth in a folder."""
    motion = motion_of(facts)
    rate, seed = facts["rate_hz"], facts["seed"]
    t = np.arange(1, int(motion.duration * rate)) / rate
    rng = stream(seed, "sensor")
    rates = sampled(facts, motion, t)
    rates = rates + DEG * np.array(facts["bias_deg_s"])
    rates += DEG * facts["noise_deg_s"] * np.sqrt(rate / 2) * rng.normal(size=rates.shape)
    force = motion.force(t) + 0.01 * rng.normal(size=rates.shape)
    stamps = stamped(facts, t)
    keep = np.ones(len(t), dtype=bool)
    for begin, end in facts["gaps_s"]:
        keep &= (t <= begin) | (t >= end)
    if facts["lost_share"]:
        gone = stream(seed, "rows").random(len(t)) < facts["lost_share"]
        gone[[0, -1]] = False
        keep &= ~gone
    t, stamps, rates, force = t[keep], stamps[keep], rates[keep], force[keep]

    folder.mkdir(parents=True, exist_ok=True)
    written, felt = rates, force
    if facts["axes"] != "forward-right-down":
        to_sensor = np.array(AXES[facts["axes"]], dtype=float)
        written, felt = rates @ to_sensor.T, force @ to_sensor.T
    if facts["sign_of"] >= 0:
        written = written.copy()
        written[:, facts["sign_of"]] *= -1
    _write(facts, folder / "log.csv", stamps, written, felt)
    # The truth is on the clock of the world, less the distant origin that both files share.
    at = np.arange(0.0, motion.duration, 1 / TRUTH)
    q, _ = motion.state(at)
    truth = folder / "truth.csv"
    rows = np.column_stack([facts["clock_offset_s"] + at, q])
    head = "time_s,q_w,q_x,q_y,q_z"
    np.savetxt(truth, rows, "%.9f", ",", header=head, comments="")
    return Made(facts, motion, folder / "log.csv", truth, t, stamps, rates)


def _write(facts: dict[str, Any], path: Path, stamps: Array, rates: Array, force: Array) -> None:
    head = []
    if facts["sampling_stated"]:
        head.append(f"# sampling: {facts['sampling_stated']}")
    if facts["axes_named"] == "header":
        head.append(f"# axes: {facts['axes']}")
    names = [facts["clock"], *(facts["gyro"].format(k) for k in "xyz")]
    columns = [rates / GYROS[facts["gyro"]]]
    if facts["accel"]:
        names += [facts["accel_named"].format(k) for k in "xyz"]
        columns.append(force / ACCELS[facts["accel_named"]])
    unit = CLOCKS[facts["clock"]]
    digits = {1.0: 6, 1e-3: 3, 1e-6: 0, 1e-9: 0}[unit]
    numbers = np.column_stack(columns)
    clock = np.char.mod(f"%.{digits}f", stamps / unit)
    body = np.char.mod("%.8g", numbers)
    rows = [",".join((s, *row)) for s, row in zip(clock, body, strict=True)]
    path.write_text("\n".join([*head, ",".join(names), *rows]) + "\n")
