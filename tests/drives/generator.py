"""Made-up short drives with their exact truth, as the logs and fixes of people would have them.

`draw` draws from one seed what a record is, as plain numbers and words; `make` makes it:
the motion, the samples of a sensor, the fixes of a receiver, both files, and what their owner
knows. A part of the draw can be changed and the rest stays as it was, because every part has its
own stream of random numbers. The generator knows nothing of how a navigator works or begins.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import butter, lfilter, sosfilt
from scipy.spatial.transform import Rotation
from tests.drives.motion import DEG, KINDS, G, Motion, geodetic, make_motion, to_ned

GRADES = ("phone", "industrial", "tactical", "navigation")
ROOT = 20261123

#: Figures of the grades, lowest and highest, drawn evenly on a logarithmic scale: wider than those
#: of the parts that have a data sheet. Gyro: noise deg/s/√Hz, bias deg/s, in-run deg/h, scale %,
#: misalignment deg, g-sensitivity deg/s/g, warming deg/s. Accelerometer: noise µg/√Hz, bias mg,
#: in-run µg, scale %, misalignment deg, warming mg, rectification mg/g².
GYRO = {
    "phone": [(3e-3, 2e-2), (0.05, 2.0), (8, 80), (0.2, 2.0), (0.2, 1.2), (0.01, 0.1), (0.02, 0.3)],
    "industrial": [
        (2e-3, 1e-2), (0.02, 0.4), (2, 20), (0.05, 0.5), (0.03, 0.3), (2e-3, 0.02), (5e-3, 0.05),
    ],
    "tactical": [
        (5e-4, 3e-3), (2e-4, 8e-3), (0.2, 4), (0.01, 0.1), (6e-3, 0.06), (2e-4, 2e-3),
        (2e-4, 3e-3),
    ],
    "navigation": [
        (2e-5, 2e-4), (5e-7, 1e-5), (1e-3, 2e-2), (5e-4, 3e-3), (3e-4, 3e-3), (1e-8, 1e-7),
        (5e-7, 3e-6),
    ],
}  # fmt: skip
ACCEL = {
    "phone": [(80, 400), (5, 70), (20, 300), (0.1, 1.5), (0.2, 1.2), (1, 10), (0.1, 2)],
    "industrial": [(30, 200), (1, 20), (8, 80), (0.03, 0.5), (0.03, 0.3), (0.2, 3), (0.03, 0.4)],
    "tactical": [
        (15, 100), (0.3, 4), (4, 40), (0.02, 0.15), (6e-3, 0.06), (0.05, 0.6), (0.01, 0.1),
    ],
    "navigation": [
        (3, 25), (0.01, 0.12), (1, 12), (1e-3, 1e-2), (3e-4, 3e-3), (3e-3, 0.03), (3e-3, 0.03),
    ],
}  # fmt: skip
KEYS_GYRO = ("noise", "bias", "in_run", "scale", "misalignment", "g_sensitivity", "warming")
KEYS_ACCEL = ("noise", "bias", "in_run", "scale", "misalignment", "warming", "rectification")
#: What the owner of such a unit would name, if asked for its model.
PARTS = {
    "phone": ("bmi160", "lsm6dso", "icm-20602", "mpu-6050", "mpu-9250"),
    "industrial": ("adis16470", "adis16448", "xsens-mti-1", "adis16505-1"),
    "tactical": ("adis16495-1", "stim300", "hg1700"),
    "navigation": ("fog-1000", "hg9900"),
}
#: Axes of the sensor in the vehicle's forward, right, down.
AXES = {
    "forward-right-down": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "forward-left-up": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "right-forward-up": [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
    "back-right-up": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
    "left-back-up": [[0, -1, 0], [-1, 0, 0], [0, 0, -1]],
}


def stream(seed: int, name: str) -> np.random.Generator:
    """The random numbers of one part of a record."""
    return np.random.default_rng([ROOT, seed, zlib.crc32(name.encode())])


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _figures(rng: np.random.Generator, keys: tuple[str, ...], bounds: Any) -> dict[str, float]:
    return {key: _log(rng, *bound) for key, bound in zip(keys, bounds, strict=True)}


def _pick(rng: np.random.Generator, choices: Mapping[str, float]) -> str:
    return str(
        rng.choice(list(choices), p=np.array(list(choices.values())) / sum(choices.values()))
    )


# ------------------------------------------------------------------------------- the draw
def draw(seed: int) -> dict[str, Any]:
    """Draw what the record of a seed is, as numbers and words with their units in the keys."""
    rng = stream(seed, "motion.draw")
    kind = _pick(rng, dict(zip(KINDS, (0.25, 0.18, 0.2, 0.2, 0.17), strict=True)))
    out: dict[str, Any] = {"seed": seed, "kind": kind}
    out["duration_s"] = round(float(rng.uniform(120, 360)), 1)
    resting = {"town": 0.55, "motorway": 0.3, "aircraft": 0.4, "walk": 0.7, "boat": 0.5}[kind]
    out["start"] = "rest" if rng.random() < resting else "moving"
    out["rest_s"] = round(float(rng.uniform(3, 45)), 1)
    out["lat_deg"] = round(float(rng.uniform(-55, 66)), 5)
    out["lon_deg"] = round(float(rng.uniform(-179, 179)), 5)
    out["alt_m"] = round(float(rng.uniform(20, 1200)), 1) if kind != "boat" else 30.0
    if kind == "aircraft" and out["start"] == "moving":
        out["alt_m"] += 800.0
    out["hand_deg"] = round(float(rng.choice([0.0, 3.0, 8.0])), 1)
    reach = {"town": (1.5, 0.4, 0.5), "motorway": (1.5, 0.4, 0.5), "aircraft": (1.5, 0.3, 0.4)}.get(
        kind, (2.0, 0.8, 0.8) if kind == "boat" else (0.1, 0.1, 0.1)
    )
    low = (0.0, -reach[1], -reach[2])
    out["unit_at_m"] = [round(float(x), 2) for x in rng.uniform(low, reach)]

    rng = stream(seed, "sensor.draw")
    shares = {
        "town": (0.35, 0.3, 0.25, 0.1),
        "motorway": (0.35, 0.3, 0.25, 0.1),
        "aircraft": (0.15, 0.3, 0.35, 0.2),
        "walk": (0.65, 0.3, 0.05, 0.0),
        "boat": (0.2, 0.3, 0.3, 0.2),
    }[kind]
    grade = _pick(rng, dict(zip(GRADES, shares, strict=True)))
    out["grade"] = grade
    out["rate_hz"] = int(rng.choice([50, 100, 125, 200], p=[0.25, 0.4, 0.1, 0.25]))
    out["sampling"] = "mean" if grade in ("tactical", "navigation") else "filtered"
    out["cut_off_share"] = round(float(rng.uniform(0.2, 0.45)), 3)  # of the rate
    out["gyro"] = _figures(rng, KEYS_GYRO, GYRO[grade])
    out["accel"] = _figures(rng, KEYS_ACCEL, ACCEL[grade])
    out["warming"] = bool(rng.random() < 0.6)
    out["warming_s"] = round(_log(rng, 40, 600), 1)
    out["in_run_s"] = round(_log(rng, 60, 1500), 1)
    hum = {"town": (0.05, 0.8), "motorway": (0.05, 0.8), "aircraft": (0.3, 4), "boat": (0.1, 2)}
    out["vibration_m_s2"] = round(_log(rng, *hum[kind]), 3) if kind in hum else 0.0
    out["vibration_deg_s"] = round(out["vibration_m_s2"] * _log(rng, 0.05, 1.0), 4)

    rng = stream(seed, "mounting.draw")
    out["axes"] = _pick(rng, dict(zip(AXES, (0.45, 0.25, 0.18, 0.07, 0.05), strict=True)))
    skew = [0.3, 0.3, 0.3]
    if rng.random() < 0.55:
        skew = [8, 9, 3] if grade in ("phone", "industrial") else [4, 3, 1]
    out["mount_deg"] = [round(float(x), 3) for x in np.array(skew) * rng.uniform(-1, 1, 3)]

    rng = stream(seed, "receiver.draw")
    shares = {"phone": (0.4, 0.45, 0.15), "industrial": (0.45, 0.15, 0.4)}.get(
        grade, (0.4, 0.0, 0.6)
    )
    receiver = _pick(rng, dict(zip(("code", "phone", "rtk"), shares, strict=True)))
    out["receiver"] = receiver
    usual = int(rng.choice([1, 2, 4, 5, 10], p=[0.3, 0.1, 0.2, 0.25, 0.15]))
    out["fix_hz"] = 1 if receiver == "phone" else usual
    velocity = {"code": (0.3, 0.4, 0.3), "phone": (0.3, 0.0, 0.7), "rtk": (0.5, 0.4, 0.1)}[receiver]
    out["velocity"] = _pick(rng, dict(zip(("none", "ned", "course"), velocity, strict=True)))
    white, drift = {
        "code": ((0.15, 0.6), (0.5, 2.5)),
        "phone": ((0.2, 0.8), (2, 7)),
        "rtk": ((4e-3, 0.015), (3e-3, 0.012)),
    }[receiver]
    out["white_m"], out["drift_m"] = round(_log(rng, *white), 4), round(_log(rng, *drift), 4)
    out["drift_s"] = round(_log(rng, 20, 300), 1)
    out["vertical"] = round(float(rng.uniform(1.4, 2.5)), 2)
    out["velocity_m_s"] = round(_log(rng, 0.02, 0.15) * (3 if receiver == "phone" else 1), 3)
    out["velocity_late_s"] = round(0.5 / out["fix_hz"], 3) if rng.random() < 0.3 else 0.0
    out["float_share"] = round(float(rng.uniform(0, 0.15)), 3) if receiver == "rtk" else 0.0
    out["stated"] = _pick(rng, {"right": 0.45, "wrong": 0.3, "missing": 0.25})
    out["stated_factor"] = round(_log(rng, 0.2, 5.0), 3) if out["stated"] == "wrong" else 1.0
    arms = {"town": (1.2, 0.5, 1.2), "motorway": (1.2, 0.5, 1.2), "aircraft": (1.5, 0.5, 1.0),
            "walk": (0.1, 0.1, 0.4), "boat": (3.0, 1.5, 3.0)}[kind]  # fmt: skip
    arm = np.array(arms) * rng.uniform(-1, 1, 3)
    arm[2] = -abs(arm[2])
    out["antenna_m"] = [0.0] * 3 if receiver == "phone" else [round(float(x), 2) for x in arm]
    out["outages_s"] = []
    if rng.random() < 0.45:
        for _ in range(int(rng.integers(1, 4))):
            begin = float(rng.uniform(20, out["duration_s"] - 10))
            out["outages_s"].append([round(begin, 1), round(begin + _log(rng, 4, 40), 1)])
    fault = _pick(rng, {"none": 0.55, "single": 0.25, "lasting": 0.15, "frozen": 0.05})
    out["fault"] = fault
    out["fault_share"] = round(float(rng.uniform(0.005, 0.03)), 4)
    size = _log(rng, 8, 80) * np.hypot(out["white_m"], out["drift_m"])
    out["fault_m"] = round(float(min(size, 300.0)), 3)
    out["fault_from_s"] = round(float(rng.uniform(30, out["duration_s"] - 30)), 1)
    out["fault_s"] = round(_log(rng, 4, 30), 1)

    rng = stream(seed, "clock.draw")
    how = _pick(rng, {"none": 0.45, "small": 0.4, "large": 0.15})
    size = {"none": 0.0, "small": float(rng.normal(0, 0.12)), "large": float(rng.uniform(-1, 1))}
    out["late_s"] = round(size[how], 3)  # of the stamps of the fixes
    out["drift_ppm"] = round(float(rng.uniform(-50, 50)), 1) if rng.random() < 0.4 else 0.0
    out["step_s"] = 0.0
    if rng.random() < 0.1:
        back = rng.random() < 0.4
        out["step_s"] = round(
            float(rng.uniform(0.2, 0.9)) * (-1.0 / out["fix_hz"] if back else 1), 3
        )
    out["step_at_s"] = round(float(rng.uniform(0.3, 0.8)) * out["duration_s"], 1)
    out["clock"] = _pick(rng, {"since start": 0.5, "unix": 0.35, "uptime": 0.15})
    phone = grade == "phone"
    out["jitter_s"] = round(_log(rng, 1e-5, 1.5e-3), 6) if phone else 0.0
    out["lost_share"] = (
        round(float(rng.uniform(0, 2e-3)), 5) if phone and rng.random() < 0.4 else 0.0
    )

    rng = stream(seed, "person.draw")
    out["knows_sensor"] = bool(rng.random() < 0.5)
    out["part"] = str(rng.choice(PARTS[grade]))
    measured = np.array(out["antenna_m"]) + rng.normal(0, 0.02, 3)
    out["arm_measured_m"] = [round(float(x), 2) for x in measured]
    if receiver == "phone":
        out["arm_measured_m"] = [0.0] * 3
    out["log_style"] = str(rng.choice(list(LOG_STYLES)))
    out["fix_style"] = str(rng.choice(list(FIX_STYLES)))
    return out


# ------------------------------------------------------------------------------ the sensor
def _wander(
    rng: np.random.Generator, n: int, step: float, tau: float, width: int = 3
) -> np.ndarray:
    """Gauss-Markov processes of unit variance."""
    k = np.exp(-step / tau)
    drive = np.sqrt(1 - k * k) * rng.normal(size=(n, width))
    drive[0] = rng.normal(size=width)
    return lfilter([1], [1, -k], drive, axis=0)


def _hum(
    rng: np.random.Generator, motion: Motion, t: np.ndarray, draw: Mapping[str, Any]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vibration in force and rate, averaged as the sensor does, and the mean square of force."""
    many = max(4, int(np.ceil(800 / draw["rate_hz"])))
    step = 1.0 / draw["rate_hz"]
    fine = (t[:, None] - step + step * (np.arange(many) + 0.5) / many).ravel()
    work = np.interp(fine, motion.grid, motion.engine)
    base = rng.uniform(18, 45)
    turns = 2 * np.pi * np.cumsum(base * (0.5 + 0.5 * work)) * step / many
    parts = [np.zeros((len(fine), 3)) for _ in range(2)]
    for order in (1.0, 2.0, rng.uniform(2.2, 3.5)):
        for k in range(2):
            sizes = rng.normal(size=3) / order
            phases = rng.uniform(0, 6.28, 3)
            parts[k] += sizes * np.sin(order * turns[:, None] + phases)
    # A body that shakes does not go anywhere: what is broad-band begins at 15 Hz.
    sieve = butter(2, 15.0, "highpass", fs=many / step, output="sos")
    for k in range(2):
        parts[k] += 0.7 * sosfilt(sieve, rng.normal(size=parts[k].shape), axis=0)
        parts[k] *= (work / np.sqrt(np.mean(parts[k] ** 2)))[:, None]
    force, rate = draw["vibration_m_s2"] * parts[0], draw["vibration_deg_s"] * DEG * parts[1]
    square = (force.reshape(len(t), many, 3) ** 2).mean(axis=1)
    slow = np.exp(-step / 0.5)  # rectification answers to the shaking of half a second
    square = lfilter([1 - slow], [1, -slow], square, axis=0)
    if draw["sampling"] == "mean":
        return (*(x.reshape(len(t), many, 3).mean(axis=1) for x in (force, rate)), square)
    k = np.exp(-2 * np.pi * draw["cut_off_share"] / many)
    low = (lfilter([1 - k], [1, -k], x, axis=0) for x in (force, rate))
    return (*(x[many - 1 :: many] for x in low), square)  # with what is folded down


def _seen(motion: Motion, t: np.ndarray, draw: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """What a perfect sensor of this bandwidth reads at the stamps: means, or filtered samples."""
    step = 1.0 / draw["rate_hz"]
    if draw["sampling"] == "mean":
        nodes, weights = np.polynomial.legendre.leggauss(4)
        rate, force = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        for x, w in zip(nodes, weights / 2, strict=True):
            a, b = motion.sensed(t - step / 2 + x * step / 2)
            rate, force = rate + w * a, force + w * b
        return rate, force
    many = 4
    fine = np.arange(t[0] - 1.0, t[-1] + step, step / many)
    k = np.exp(-2 * np.pi * draw["cut_off_share"] / many)
    out = []
    for values in motion.sensed(fine):
        low = lfilter([1 - k], [1, -k], values - values[0], axis=0) + values[0]
        out.append(np.column_stack([np.interp(t, fine, low[:, j]) for j in range(3)]))
    return out[0], out[1]


def _triad(
    rng: np.random.Generator,
    true: np.ndarray,
    figures: Mapping[str, float],
    draw: Mapping[str, Any],
    units: tuple[float, float, float],
) -> np.ndarray:
    """A triad with its errors: `units` are those of noise, of bias and of the drift in the run."""
    n, step = len(true), 1.0 / draw["rate_hz"]
    turn = np.eye(3) + rng.normal(0, figures["misalignment"] * DEG, (3, 3)) * (1 - np.eye(3))
    out = true @ turn.T * (1 + rng.normal(0, figures["scale"] / 100, 3))
    out = out + rng.normal(0, figures["bias"] * units[1], 3)
    out += figures["in_run"] * units[2] * _wander(rng, n, step, draw["in_run_s"])
    warm = rng.normal(0, figures["warming"] * units[1], 3)
    if draw["warming"]:
        out += warm * (1 - np.exp(-np.arange(n) * step / draw["warming_s"]))[:, None]
    return out + figures["noise"] * units[0] / np.sqrt(step) * rng.normal(size=(n, 3))


@dataclass
class Made:
    """A record as its owner has it: two files, what he knows, and the truth that he does not."""

    draw: dict[str, Any]
    log: Path
    fixes: Path
    motion: Motion
    stamps: np.ndarray  # of the log, s on its own clock
    times: np.ndarray  # true times of these stamps, s since the start
    gyro: np.ndarray  # as the log has them, sensor axes
    accel: np.ndarray
    fix_stamps: np.ndarray
    fix_times: np.ndarray  # when each fix was valid
    fix_ecef: np.ndarray  # as the receiver says
    sound: np.ndarray  # fixes without a gross fault

    def time(self, stamp: Any) -> np.ndarray:
        """True time of a stamp of the log."""
        return np.interp(stamp, self.stamps, self.times)

    @property
    def answers(self) -> dict[str, Any]:
        """What the owner says when he is asked."""
        d = self.draw
        sd = {"code": 2.5, "phone": 5.0, "rtk": 0.02}[d["receiver"]]
        heading = float(self.motion.state(np.array([0.0]))["heading"][0])
        return {
            "axes": d["axes"],
            "lever_arm_m": d["arm_measured_m"],
            "heading_deg": round(heading + float(stream(d["seed"], "person").normal(0, 3)), 0),
            "sd_deg": 5.0,  # how well he knows that
            "sensor": d["part"] if d["knows_sensor"] else None,
            "position_sd_m": sd,
            "velocity_sd_m_per_s": {"code": 0.1, "phone": 0.5, "rtk": 0.05}[d["receiver"]],
            "sampling": "mean" if d["sampling"] == "mean" else "instantaneous",
        }


def samples(
    motion: Motion, draw: Mapping[str, Any], noiseless: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """True times, rates and specific force in unit axes (forward, right, down), with all errors."""
    step = 1.0 / draw["rate_hz"]
    t = np.arange(0.0, draw["duration_s"], step)
    rate, force = _seen(motion, t, draw)
    if noiseless:
        return t, rate, force
    shaken, spun, square = _hum(stream(draw["seed"], "vibration"), motion, t, draw)
    force, rate = force + shaken, rate + spun
    rng = stream(draw["seed"], "gyro")
    pulled = draw["gyro"]["g_sensitivity"] * DEG / G * rng.normal(size=(3, 3))
    gyro = _triad(rng, rate, draw["gyro"], draw, (DEG, DEG, DEG / 3600)) + force @ pulled.T
    rng = stream(draw["seed"], "accel")
    accel = _triad(rng, force, draw["accel"], draw, (1e-6 * G, 1e-3 * G, 1e-6 * G))
    accel += draw["accel"]["rectification"] * 1e-3 / G * rng.normal(size=3) * square
    return t, gyro, accel


# ---------------------------------------------------------------------------- the receiver
def fixes(motion: Motion, draw: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Positions and velocities of the antenna as the receiver gives them, in ECEF and NED."""
    rng = stream(draw["seed"], "receiver")
    step = 1.0 / draw["fix_hz"]
    t = np.arange(rng.uniform(0, step), draw["duration_s"], step)
    n, arm = len(t), np.array(draw["antenna_m"])
    true = motion.position(t, arm)
    lat, lon, _ = geodetic(true)
    ned = to_ned(lat, lon)
    high = np.array([1.0, 1.0, draw["vertical"]])
    white = draw["white_m"] * high * rng.normal(size=(n, 3))
    slow = draw["drift_m"] * high * _wander(rng, n, step, draw["drift_s"])
    sd = np.hypot(draw["white_m"], draw["drift_m"]) * high * np.ones((n, 1))
    floating = np.zeros(n, bool)
    if draw["float_share"] > 0:  # ambiguities are lost and found again
        loose = _wander(rng, n, step, 15.0, 1)[:, 0]
        floating = loose > np.quantile(loose, 1 - draw["float_share"])
        slow += floating[:, None] * 0.25 * high * _wander(rng, n, step, 20.0)
        sd = np.where(floating[:, None], 0.3 * high, sd)
    error = white + slow
    sound = np.ones(n, bool)
    rng = stream(draw["seed"], "faults")
    inside = (t >= draw["fault_from_s"]) & (t < draw["fault_from_s"] + draw["fault_s"])
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    if draw["fault"] == "single":
        bad = rng.random(n) < draw["fault_share"]
        error += bad[:, None] * draw["fault_m"] * rng.normal(size=(n, 3))
        sound &= ~bad
    elif draw["fault"] == "lasting":
        error += inside[:, None] * draw["fault_m"] * direction
        sound &= ~inside
    position = true + np.einsum("nij,ni->nj", ned, error)
    velocity_at = t - draw["velocity_late_s"]
    velocity = np.einsum("nij,nj->ni", ned, motion.velocity(velocity_at, arm))
    velocity += draw["velocity_m_s"] * np.array([1, 1, 1.5]) * rng.normal(size=(n, 3))
    if draw["fault"] == "frozen" and inside.any():
        first = int(np.flatnonzero(inside)[0])
        position[inside], velocity[inside] = position[first], velocity[first]
        sound &= ~inside
    stamp = t + draw["late_s"] + draw["drift_ppm"] * 1e-6 * t
    stamp += draw["step_s"] * (t >= draw["step_at_s"])
    keep = np.ones(n, bool)
    for begin, end in draw["outages_s"]:
        keep &= (t < begin) | (t >= end)
    latest = np.maximum.accumulate(np.where(keep, stamp, -np.inf))
    keep[1:] &= stamp[1:] > latest[:-1]
    table = {
        "t": t, "stamp": stamp, "ecef": position, "velocity": velocity,
        "sd": sd * draw["stated_factor"],
        "velocity_sd": draw["velocity_m_s"] * draw["stated_factor"] * np.tile([1, 1, 1.5], (n, 1)),
        "sound": sound & ~floating, "floating": floating,
    }  # fmt: skip
    return {key: value[keep] for key, value in table.items()}


# ------------------------------------------------------------------------------- the files
#: Names of time, gyro and accelerometer, and the factors from SI. The axis is {x}.
LOG_STYLES: dict[str, tuple[str, str, str, float, float, float]] = {
    "si": ("time_s", "gyro_{x}_rad_s", "accel_{x}_m_s2", 1.0, 1.0, 1.0),
    "degrees": ("time [s]", "gyro_{x} [deg/s]", "acc_{x} [m/s^2]", 1.0, 1 / DEG, 1.0),
    "g": ("Time (s)", "Gyro {X} (deg/s)", "Accel {X} (g)", 1.0, 1 / DEG, 1 / G),
    "millis": ("timestamp_ms", "gyro_{x}_deg_s", "accel_{x}_g", 1e3, 1 / DEG, 1 / G),
    "ros": ("t_s", "angular_velocity_{x}_rad_s", "linear_acceleration_{x}_m_s2", 1.0, 1.0, 1.0),
}
#: Names of time, latitude, longitude, height, velocities, speed, course, standard deviations.
FIX_STYLES: dict[str, dict[str, str]] = {
    "plain": {
        "time": "time_s", "lat": "lat_deg", "lon": "lon_deg", "alt": "height_ellipsoid_m",
        "VN": "vn_m_s", "VE": "ve_m_s", "VD": "vd_m_s", "speed": "speed_m_s",
        "course": "course_deg",
        "sd": "sd_{d}_m", "vsd": "sd_v{d}_m_s",
    },
    "words": {
        "time": "Time (s)", "lat": "Latitude (deg)", "lon": "Longitude (deg)",
        "alt": "Height ellipsoid (m)", "VN": "VN (m/s)", "VE": "VE (m/s)", "VD": "VD (m/s)",
        "speed": "Speed (m/s)", "course": "Course (deg)", "sd": "sd_{d} (m)",
        "vsd": "sd_v{d} (m/s)",
    },
    "receiver": {
        "time": "time_s", "lat": "latitude", "lon": "longitude", "alt": "h_ell_m", "VN": "vN",
        "VE": "vE", "VD": "vD", "speed": "speed_m_s", "course": "bearing_deg",
        "sd": "sd{D}", "vsd": "std_v{d}",
    },
}  # fmt: skip


def _write(path: Path, names: list[str], columns: list[np.ndarray], digits: list[int]) -> None:
    formats = [f"%.{k}f" for k in digits]
    np.savetxt(
        path,
        np.column_stack(columns),
        fmt=formats,
        delimiter=",",
        header=",".join(names),
        comments="",
    )


def make(facts: Mapping[str, Any], folder: Path) -> Made:
    """Make the record of a draw in a folder: `imu.csv` and `fixes.csv`."""
    d = dict(facts)
    folder.mkdir(parents=True, exist_ok=True)
    mount = Rotation.from_euler("ZYX", d["mount_deg"], degrees=True)
    motion = make_motion(stream(d["seed"], "motion"), d, mount)
    t, gyro, accel = samples(motion, d)
    rng = stream(d["seed"], "log")
    base = {"since start": 0.0, "unix": 1.7e9 + 1e7 * rng.random(), "uptime": 1e5 * rng.random()}
    zero = round(base[d["clock"]], 3)
    keep = rng.random(len(t)) >= d["lost_share"]
    stamps = zero + t + d["jitter_s"] * np.clip(rng.normal(size=len(t)), -3, 3)
    keep[1:] &= np.diff(stamps) > 0.1 / d["rate_hz"]
    t, gyro, accel, stamps = t[keep], gyro[keep], accel[keep], stamps[keep]
    stamps = np.round(stamps, 6)

    name = np.array(AXES[d["axes"]], float)  # rows: sensor axes in forward, right, down
    gyro, accel = gyro @ name.T, accel @ name.T
    style = LOG_STYLES[d["log_style"]]
    names = [style[0]]
    for pattern in style[1:3]:
        names += [pattern.format(x=x, X=x.upper()) for x in "xyz"]
    columns = [stamps * style[3], *(gyro * style[4]).T, *(accel * style[5]).T]
    fine = d["grade"] in ("tactical", "navigation")
    digits = [3 if style[3] > 1 else 6] + [9 if fine else 6] * 6
    _write(folder / "imu.csv", names, columns, digits)

    got = fixes(motion, d)
    got["stamp"] = np.round(got["stamp"] + zero, 3)
    lat, lon, alt = geodetic(got["ecef"])
    says = FIX_STYLES[d["fix_style"]]
    rows: list[tuple[str, np.ndarray, int]] = [
        (says["time"], got["stamp"], 3),
        (says["lat"], np.degrees(lat), 9),
        (says["lon"], np.degrees(lon), 9),
        (says["alt"], alt, 4),
    ]
    v = got["velocity"]
    if d["velocity"] == "ned":
        rows += [(says[key], v[:, k], 4) for k, key in enumerate(("VN", "VE", "VD"))]
    elif d["velocity"] == "course":
        course = np.degrees(np.arctan2(v[:, 1], v[:, 0])) % 360
        rows += [(says["speed"], np.hypot(v[:, 0], v[:, 1]), 3), (says["course"], course, 2)]
    if d["stated"] != "missing":
        letters = "neu" if d["fix_style"] == "receiver" else "ned"
        rows += [
            (says["sd"].format(d=x, D=x.upper()), got["sd"][:, k], 4) for k, x in enumerate(letters)
        ]
        if d["velocity"] == "ned":
            rows += [
                (says["vsd"].format(d=x), got["velocity_sd"][:, k], 4) for k, x in enumerate("ned")
            ]
    _write(folder / "fixes.csv", *map(list, zip(*rows, strict=True)))
    return Made(
        d, folder / "imu.csv", folder / "fixes.csv", motion, stamps, t, gyro, accel,
        got["stamp"], got["t"], got["ecef"], got["sound"],
    )  # fmt: skip
