"""Made-up logs of inertial sensors in the ways that people write them, with what they mean.

`make` writes one log for a seed. Nothing here knows how a reader works: the names, units, clocks,
layouts and damages are those of real projects, drawn independently where real life draws so.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from tests.strangers.motion import G, Motion, as_counts, simulate

DEG = np.pi / 180


@dataclass
class Truth:
    """What a correct reading of the log is.

    Stamps are relative to the first. `accel` is None where the file has no specific force.
    Quanta are half steps of the text in SI. `clocks` are other stamps that are as good.
    """

    t: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray | None
    gyro_quantum: float
    accel_quantum: float
    time_tolerance: float
    clocks: list[np.ndarray] = field(default_factory=list)
    own_rates: bool = False
    accel_t: np.ndarray | None = None
    accel_names: tuple[str, ...] = ()
    accel_optional: bool = False
    to_frd: np.ndarray | None = None  # where the file states its axes
    rate_hz: float = 0.0


@dataclass
class Made:
    """One log: where it is, what it means, what it is, and whether that can be known from it."""

    path: Path
    truth: Truth
    kind: str
    decidable: bool


@dataclass
class Column:
    """A column of text; `unit` is the text that the writer has for its unit, or empty."""

    name: str
    unit: str
    cells: list[str]
    role: str = "extra"


#: A phone's axes are right, up its face, out of its face; forward is up its face.
PHONE = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
ROOT = 20240229


# --------------------------------------------------------------------------------------- names
# {x} {X} the letter, {i} {j} its number from 0 and from 1. Gyro, accelerometer, magnetometer.
STYLES: tuple[tuple[str, str, str], ...] = (
    ("gyro_{x}", "acc_{x}", "mag_{x}"),
    ("gyro_{x}", "accel_{x}", "mag_{x}"),
    ("gyr_{x}", "acc_{x}", "mag_{x}"),
    ("gyro{X}", "accel{X}", "mag{X}"),
    ("gyro{X}", "acc{X}", "mag{X}"),
    ("Gyro{X}", "Acc{X}", "Mag{X}"),
    ("Gyr{X}", "Acc{X}", "Mag{X}"),
    ("Gyr_{X}", "Acc_{X}", "Mag_{X}"),
    ("GYRO_{X}", "ACC_{X}", "MAG_{X}"),
    ("GYR{X}", "ACC{X}", "MAG{X}"),
    ("g{x}", "a{x}", "m{x}"),
    ("G{x}", "A{x}", "M{x}"),
    ("G{X}", "A{X}", "M{X}"),
    ("w{x}", "a{x}", "m{x}"),
    ("w_{x}", "a_{x}", "m_{x}"),
    ("w{x}", "f{x}", "m{x}"),
    ("omega_{x}", "acc_{x}", "B_{x}"),
    ("omega{X}", "accel{X}", "B{X}"),
    ("Gy{X}", "Ac{X}", "Ma{X}"),
    ("AngVel{X}", "LinAcc{X}", "MagField{X}"),
    ("AngVel_{X}", "Accel_{X}", "Mag_{X}"),
    ("angular_velocity_{x}", "linear_acceleration_{x}", "magnetic_field_{x}"),
    ("angular_velocity.{x}", "linear_acceleration.{x}", "magnetic_field.{x}"),
    ("imu/angular_velocity/{x}", "imu/linear_acceleration/{x}", "mag/magnetic_field/{x}"),
    ("/imu/data/angular_velocity/{x}", "/imu/data/linear_acceleration/{x}", "/mag/{x}"),
    ("Gyroscope {X}", "Accelerometer {X}", "Magnetometer {X}"),
    ("Gyroscope {x}", "Acceleration {x}", "Magnetic field {x}"),
    ("gyroscope_{x}", "accelerometer_{x}", "magnetometer_{x}"),
    ("Gyroscope_{X}", "Accelerometer_{X}", "Magnetometer_{X}"),
    ("gyroscope.{x}", "accelerometer.{x}", "magnetometer.{x}"),
    ("gyroscope[{i}]", "accelerometer[{i}]", "magnetometer[{i}]"),
    ("gyro[{i}]", "accel[{i}]", "mag[{i}]"),
    ("gyro_rad[{i}]", "accelerometer_m_s2[{i}]", "magnetometer_ga[{i}]"),
    ("gyro{i}", "acc{i}", "mag{i}"),
    ("gyro_{j}", "acc_{j}", "mag_{j}"),
    ("{x}_gyro", "{x}_accel", "{x}_mag"),
    ("{x}gyro", "{x}acc", "{x}mag"),
    ("{X}_gyr", "{X}_acc", "{X}_mag"),
    ("{X} Gyro", "{X} Accel", "{X} Mag"),
    ("{X}-axis gyro", "{X}-axis acceleration", "{X}-axis magnetic"),
    ("{X}-Axis Angular Rate", "{X}-Axis Acceleration", "{X}-Axis Magnetic Field"),
    ("Angular velocity {X}", "Acceleration {X}", "Magnetic field {X}"),
    ("Angular rate {x}", "Specific force {x}", "Field {x}"),
    ("AngularVelocity{X}", "Acceleration{X}", "Magnetic{X}"),
    ("gyro.{x}", "accel.{x}", "mag.{x}"),
    ("gyro.{x}", "acc.{x}", "mag.{x}"),
    ("imu.gyro.{x}", "imu.accel.{x}", "imu.mag.{x}"),
    ("imu_gyro_{x}", "imu_acc_{x}", "imu_mag_{x}"),
    ("IMU1_Gyro_{X}", "IMU1_Accel_{X}", "IMU1_Mag_{X}"),
    ("BMI160_gyr_{x}", "BMI160_acc_{x}", "BMM150_mag_{x}"),
    ("sensor.gyr.{x}", "sensor.acc.{x}", "sensor.mag.{x}"),
    ("rate_{x}", "accel_{x}", "mag_{x}"),
    ("rotationRate.{x}", "acceleration.{x}", "magneticField.{x}"),
    ("{x}_rate", "{x}_accel", "{x}_field"),
    ("IMU_Gyro_{X}", "IMU_Acc_{X}", "IMU_Mag_{X}"),
    ("Wx Wy Wz", "Ax Ay Az", "Mx My Mz"),
    ("p q r", "ax ay az", "mx my mz"),
    ("p q r", "fx fy fz", "mx my mz"),
    ("P Q R", "AX AY AZ", "MX MY MZ"),
    ("roll_rate pitch_rate yaw_rate", "acc_x acc_y acc_z", "mag_x mag_y mag_z"),
    ("RollRate PitchRate YawRate", "AccX AccY AccZ", "MagX MagY MagZ"),
    ("dps_x dps_y dps_z", "g_x g_y g_z", "uT_x uT_y uT_z"),
    ("ωx ωy ωz", "ax ay az", "Bx By Bz"),
    ("Drehrate_X Drehrate_Y Drehrate_Z", "Beschl_X Beschl_Y Beschl_Z", "Mag_X Mag_Y Mag_Z"),
)
# Styles whose names say a unit themselves.
NAMED_UNITS = {
    "gyro_rad[{i}]": ("rad/s", "m/s2"),
    "dps_x dps_y dps_z": ("deg/s", "g"),
}
GYRO_UNITS: dict[str, tuple[float, tuple[str, ...], str]] = {
    "rad/s": (1.0, ("rad/s", "rad/s", "rad/sec", "rad s^-1", "rads/s", "radps"), "rad_s"),
    "deg/s": (
        DEG,
        ("deg/s", "deg/s", "°/s", "°/s", "dps", "dps", "DPS", "deg/sec", "degrees/s", "º/s"),
        "dps",
    ),
    "mdps": (DEG / 1000, ("mdps", "mdeg/s", "mdps"), "mdps"),
}
ACCEL_UNITS: dict[str, tuple[float, tuple[str, ...], str]] = {
    "m/s2": (
        1.0,
        ("m/s^2", "m/s^2", "m/s²", "m/s²", "m/s2", "m/s/s", "ms-2", "m s^-2", "m.s^-2"),
        "mps2",
    ),
    "g": (G, ("g", "g", "G", "gs", "g's"), "g"),
    "mg": (G / 1000, ("mg", "mG", "mg"), "mg"),
}
DECIMALS = {"rad/s": (4, 9), "deg/s": (2, 5), "mdps": (0, 3)}
ACCEL_DECIMALS = {"m/s2": (2, 7), "g": (3, 7), "mg": (0, 3)}


def _names(pattern: str) -> list[str]:
    if " " in pattern and "{" not in pattern:
        return pattern.split()
    return [pattern.format(x="xyz"[k], X="XYZ"[k], i=k, j=k + 1) for k in range(3)]


def _text(values: np.ndarray, decimals: int, how: str = "f") -> list[str]:
    if how == "r":
        return [repr(float(v)) for v in np.round(values, decimals)]
    return [format(v, f".{decimals}{how}") for v in values]


class Draw(np.random.Generator):
    """Random choices with shorter names."""

    def one(self, of: Sequence, weights: Sequence[float] | None = None):
        """One of these."""
        p = None if weights is None else np.array(weights) / sum(weights)
        return of[int(self.choice(len(of), p=p))]

    def odds(self, p: float) -> bool:
        """True with this probability."""
        return bool(self.random() < p)


# ------------------------------------------------------------------------------------- sampling
def sample(d: Draw, rate: float | None = None) -> tuple[Motion, float, list[str]]:
    """A motion at stamps with what loggers do to stamps; the rate; what was done."""
    rate = rate or float(
        d.one(
            [10, 20, 25, 50, 52, 60, 100, 104, 119, 200, 400, 500, 1000],
            [3, 3, 3, 8, 2, 2, 10, 2, 1, 4, 1, 1, 1],
        )
    )
    seconds = float(np.exp(d.uniform(np.log(5), np.log(120))))
    seconds = min(seconds, 12000 / rate)
    n = max(int(seconds * rate), 40)
    done: list[str] = []
    t = np.arange(n) / rate
    if d.odds(0.45):
        t = t + np.clip(d.normal(0, 0.06, n), -0.3, 0.3) / rate
        t -= t[0]
        done.append("jitter")
    if d.odds(0.06):
        i = int(d.integers(n // 4, 3 * n // 4))
        t[i:] += d.uniform(0.3, 3.0)
        done.append("gap")
    m = simulate(d, t)
    if d.odds(0.08):
        keep = d.random(n) > 0.02
        keep[0] = True
        m = pick(m, np.flatnonzero(keep))
        done.append("missing rows")
    return m, rate, done


def pick(m: Motion, rows: np.ndarray) -> Motion:
    """These samples of a motion."""
    return replace(
        m,
        t=m.t[rows],
        gyro=m.gyro[rows],
        accel=m.accel[rows],
        linear=m.linear[rows],
        attitude=m.attitude[rows],
    )


# ----------------------------------------------------------------------------------------- time
@dataclass
class Clock:
    """Columns of time, the true stamps they give, and what they say of themselves."""

    columns: list[Column]
    t: np.ndarray
    tolerance: float
    kind: str
    stated: bool = True
    preamble: list[str] = field(default_factory=list)
    clocks: list[np.ndarray] = field(default_factory=list)
    decidable: bool = True


def _dates(start: datetime, t: np.ndarray, form: str, digits: int) -> list[str]:
    out = []
    for s in t:
        at = start + timedelta(seconds=float(s))
        frac = f"{at.microsecond:06d}"[:digits]
        text = at.strftime(form)
        out.append(text.replace("FFF", frac))
    return out


def clock(d: Draw, t: np.ndarray, rate: float, unit_way: str, kind: str | None = None) -> Clock:
    """The time of a log in one of the ways that people write it."""
    kind = kind or d.one(
        [
            "s",
            "ms",
            "us",
            "ns",
            "epoch s",
            "epoch ms",
            "epoch us",
            "epoch ns",
            "iso",
            "time of day",
            "gps",
            "wrap",
            "number",
            "excel",
            "two",
            "date and time",
            "bursts",
            "boot s",
            "minutes",
        ],
        [26, 20, 8, 3, 6, 9, 3, 4, 7, 4, 2, 2, 5, 2, 4, 2, 2, 4, 0.5],
    )
    start = datetime(
        2019 + int(d.integers(7)),
        int(d.integers(1, 13)),
        int(d.integers(1, 28)),
        int(d.integers(6, 22)),
        int(d.integers(60)),
        int(d.integers(60)),
        int(d.integers(1000)) * 1000,
        tzinfo=UTC,
    )
    epoch = start.timestamp()
    names = d.one(
        ["time", "Time", "t", "timestamp", "Timestamp", "TIME", "ts", "elapsed", "time_stamp"],
        [10, 6, 5, 10, 5, 1, 3, 1, 1],
    )
    tol = 0.6 / rate if rate < 100 else 0.3 / rate

    def column(name: str, unit: str, cells: list[str]) -> Column:
        return Column(name, unit, cells, "time")

    if kind in ("s", "boot s", "gps"):
        first = {"s": 0.0, "boot s": d.uniform(5, 90000), "gps": d.uniform(1e4, 6e5)}[kind]
        dec = int(d.integers(3, 7)) if rate <= 200 else int(d.integers(4, 8))
        name = d.one(["GPS TOW", "gps_sow", "TOW", "GpsTime"]) if kind == "gps" else names
        out = [column(name, "s", _text(t + first, dec))]
        return Clock(out, t, 10.0**-dec + 1e-9, kind)
    if kind in ("ms", "us", "ns"):
        k = {"ms": 1e3, "us": 1e6, "ns": 1e9}[kind]
        first = d.one([0.0, d.uniform(0, 100), d.uniform(100, 90000)], [3, 3, 2])
        named = {
            "ms": ["millis", "time_ms", "ms", "Time(ms)", "t_ms", "millis()"],
            "us": ["micros", "time_us", "TimeUS", "time_usec", "t_us"],
            "ns": ["time_ns", "timestamp_ns", "t_ns", "timestamp [ns]", "nanoseconds"],
        }[kind]
        stated = d.odds(0.5)
        name = d.one(named) if stated else names
        out = [column(name, "" if stated else kind, [str(round(v)) for v in (t + first) * k])]
        return Clock(out, t, 1.01 / k, kind, stated)
    if kind.startswith("epoch"):
        unit = kind.split()[1]
        k = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
        dec = int(d.integers(3, 7))
        if unit == "s":
            cells, step = _text(t + epoch, dec), 10.0**-dec
        else:
            base = round(epoch) * int(k)
            cells, step = [str(base + round(v)) for v in t * k], 1.0 / k
        name = d.one([names, "unix_time", "epoch", "unixtime", "utc"], [8, 1, 1, 1, 1])
        return Clock([column(name, d.one(["", unit]), cells)], t, 1.01 * step + 1e-6, kind, False)
    if kind in ("iso", "date and time"):
        digits = int(d.one([3, 3, 6]))
        iso = d.one(
            [
                "%Y-%m-%dT%H:%M:%S.FFFZ",
                "%Y-%m-%d %H:%M:%S.FFF",
                "%Y-%m-%dT%H:%M:%S.FFF+02:00",
                "%d.%m.%Y %H:%M:%S.FFF",
                "%Y/%m/%d %H:%M:%S.FFF",
                "%Y-%m-%d %H:%M:%S:FFF",
                "%d/%m/%Y %H:%M:%S.FFF",
            ],
            [5, 5, 1, 1, 2, 1, 1],
        )
        tol = 1.01 * 10.0**-digits
        if kind == "iso":
            name = d.one(
                [names, "datetime", "DateTime", "date", "Timestamp (UTC)"], [5, 1, 1, 1, 1]
            )
            return Clock([column(name, "", _dates(start, t, iso, digits))], t, tol, kind)
        form = d.one(["%d.%m.%Y", "%Y-%m-%d", "%m/%d/%Y"])
        one = column("Date", "", _dates(start, t, form, 1))
        two = column("Time", "", _dates(start, t, "%H:%M:%S.FFF", digits))
        return Clock([one, two], t, tol, kind)
    if kind == "time of day":
        form = d.one(["%H:%M:%S.FFF", "%H:%M:%S.FFF", "%H:%M:%S,FFF", "%H:%M:%S:FFF"])
        at = start if d.odds(0.8) else start.replace(hour=23, minute=59, second=55)
        return Clock([column(names, "", _dates(at, t, form, 3))], t, 1.01e-3, kind)
    if kind == "excel":
        day = (start - datetime(1899, 12, 30, tzinfo=UTC)).total_seconds() / 86400
        out = [column(d.one(["Time", "Date", "Datum/Zeit", names]), "", _text(day + t / 86400, 11))]
        return Clock(out, t, 2e-6, kind, False)
    if kind == "minutes":
        return Clock([column("Time (min)", "", _text(t / 60, 8))], t, 1e-6, kind)
    if kind == "wrap":
        what = d.one(["ms16", "us32", "ms32"])
        k, bits = {"ms16": (1e3, 16), "us32": (1e6, 32), "ms32": (1e3, 32)}[what]
        first = 2**bits - int(d.uniform(0.2, 0.8) * min(t[-1], 60) * k)
        cells = [str(int(v)) for v in (np.rint(t * k).astype(np.int64) + first) % 2**bits]
        unit = what[:2]
        return Clock(
            [column(f"{d.one(['time', 't', 'timestamp'])}_{unit}", "", cells)], t, 1.01 / k, kind
        )
    if kind == "number":
        # A lost packet is a lost number.
        number = np.rint(t * rate).astype(np.int64)
        for i in range(1, len(number)):
            number[i] = max(number[i], number[i - 1] + 1)
        wraps = d.odds(0.25)
        cells = [str(int(v)) for v in (number % 256 if wraps else number + int(d.one([0, 1])))]
        name = d.one(
            ["sample", "PacketCounter", "index", "n", "Sample", "packet", "seq", "#", "No."]
        )
        say = d.one(
            [
                f"Sample rate: {rate:g} Hz",
                f"SampleRate={rate:g}",
                f"fs = {rate:g} Hz",
                f"Sampling frequency (Hz): {rate:g}",
                f"Update Rate: {rate:.1f}Hz",
                f"ODR {rate:g} Hz",
            ]
        )
        stated = d.odds(0.75)
        return Clock(
            [column(name, "", cells)],
            number / rate - number[0] / rate,
            tol,
            kind,
            stated,
            [say] if stated else [],
            decidable=stated,
        )
    if kind == "two":
        other = t + np.abs(d.normal(0, 0.15, len(t))) / rate
        other = np.maximum.accumulate(other)
        mine = column(
            d.one(["sensor_time_us", "device_time_us", "SampleTimeFine_us"]),
            "",
            [str(round(v)) for v in (t + 12.5) * 1e6],
        )
        host = column(
            d.one(["timestamp", "host_time", "pc_time", "received_at", "UnixTime"]),
            "",
            _text(other + epoch, 6),
        )
        both = [mine, host] if d.odds(0.5) else [host, mine]
        return Clock(both, t, 2e-3 + 1.0 / rate, kind, clocks=[other - other[0]])
    # bursts: a radio delivers several samples at once, stamped when they arrived
    size = int(d.integers(4, 13))
    n = len(t)
    arrived = t[np.minimum((np.arange(n) // size + 1) * size - 1, n - 1)]
    cells = [str(round(epoch * 1e3 + v)) for v in arrived * 1e3]
    out = Clock(
        [column(d.one(["timestamp", "time_ms", "epoch (ms)"]), "", cells)],
        t,
        1.2 * size / rate,
        "bursts",
    )
    out.decidable = False
    return out


# --------------------------------------------------------------------------------------- triads
@dataclass
class Triads:
    """Columns of gyro and accel with what they mean."""

    gyro: list[Column]
    accel: list[Column]
    gyro_true: np.ndarray
    accel_true: np.ndarray
    gyro_quantum: float
    accel_quantum: float
    preamble: list[str]
    decidable: bool
    unit_way: str
    units: tuple[str, str]
    mag_style: str


def _with_unit(name: str, unit: str, code: str, way: str) -> str:
    return {
        "brackets": f"{name} [{unit}]",
        "tight brackets": f"{name}[{unit}]",
        "parentheses": f"{name} ({unit})",
        "tight parentheses": f"{name}({unit})",
        "suffix": f"{name}_{code}",
        "comma": f"{name}; {unit}",
        "in": f"{name} in {unit}",
        "slash": f"{name} / {unit}",
        "blank": f"{name} {unit}",
    }.get(way, name)


def triads(
    d: Draw,
    m: Motion,
    unit_way: str | None = None,
    style: tuple | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
) -> Triads:
    """Columns of both triads in a style, a unit, and a way to state the unit."""
    style = style or d.one(STYLES)
    way = unit_way or d.one(
        [
            "none",
            "parentheses",
            "tight parentheses",
            "brackets",
            "tight brackets",
            "suffix",
            "units line",
            "preamble",
            "in",
            "slash",
            "blank",
        ],
        [36, 14, 6, 8, 4, 10, 8, 9, 1, 1, 1],
    )
    if way == "suffix" and any(c in style[0] for c in "[/-"):
        way = "none"
    elif way == "suffix" and " " in style[0] and "{" in style[0]:
        way = "parentheses"
    named = NAMED_UNITS.get(style[0])
    gu = gyro_unit or d.one(["deg/s", "rad/s", "mdps", "counts"], [44, 38, 4, 14])
    au = accel_unit or ("counts" if gu == "counts" else d.one(["m/s2", "g", "mg"], [50, 40, 6]))
    if gu == "mdps" and accel_unit is None:
        au = "mg"
    if named:
        gu, au = named
        way = "none"
    preamble: list[str] = []
    decidable = True
    if gu == "counts":
        top = np.abs(m.gyro).max() / DEG
        fs = next((k for k in (250, 500, 1000, 2000) if k > top), 2000)
        if d.odds(0.25):
            fs = 2000
        gk = (
            DEG / (32768 / fs)
            if d.odds(0.5)
            else DEG / {250: 131, 500: 65.5, 1000: 32.8, 2000: 16.4}[fs]
        )
        high = np.abs(m.accel).max() / G
        afs = next((k for k in (2, 4, 8, 16) if k > high), 16)
        ak = G / (32768 / afs)
        said = d.odds(0.55)
        if said:
            preamble = [
                d.one(
                    [
                        f"MPU-6050, gyro ±{fs} deg/s, accel ±{afs} g, raw counts (16 bit)",
                        f"raw LSB; gyro sensitivity {32768 / fs:.1f} LSB/(deg/s); "
                        f"accel sensitivity {32768 // afs} LSB/g",
                        f"GYRO_FS_{fs} ACCEL_FS_{afs} raw int16",
                        f"Gyro scale: {32768 / fs:.1f} LSB/dps, Accel scale: {32768 // afs} LSB/g",
                    ]
                )
            ]
        decidable = said or m.turned
        gc, gt = as_counts(m.gyro, gk)
        ac, at = as_counts(m.accel, ak)
        gq, aq = 0.55 * gk, 0.55 * ak
        way = "preamble" if said else "none"
        gcells = [[str(int(v)) for v in gc[:, k]] for k in range(3)]
        acells = [[str(int(v)) for v in ac[:, k]] for k in range(3)]
        gtext = atext = gcode = acode = ""
    else:
        gk, gtexts, gcode = GYRO_UNITS[gu]
        ak, atexts, acode = ACCEL_UNITS[au]
        gtext, atext = d.one(gtexts), d.one(atexts)
        gd, ad = int(d.integers(*DECIMALS[gu])), int(d.integers(*ACCEL_DECIMALS[au]))
        how = d.one(["f", "r", "e"], [16, 3, 1])
        if how == "e":
            gd, ad = max(gd, 5), max(ad, 5)
        # The converter of a cheap sensor lies below the text.
        gt, at = m.gyro, m.accel
        if d.odds(0.6):
            step = 2000 * DEG / 32768
            gt = np.rint(gt / step) * step
            at = np.rint(at / (16 * G / 32768)) * (16 * G / 32768)
        gq, aq = 0.55 * gk * 10.0**-gd, 0.55 * ak * 10.0**-ad
        if how == "e":
            gq += 1e-5 * np.abs(gt).max()
            aq += 1e-5 * np.abs(at).max()
        gcells = [_text(gt[:, k] / gk, gd, how) for k in range(3)]
        acells = [_text(at[:, k] / ak, ad, how) for k in range(3)]
        if way == "none" and not named:
            big = np.abs(gt).max() / gk
            decidable = m.turned or (gu != "rad/s" and big > 60)
        if way == "preamble":
            preamble = [
                d.one(
                    [
                        f"gyro: {gtext}, accel: {atext}",
                        f"Units: angular rate in {gtext}; acceleration in {atext}",
                        f"Gyroscope unit = {gtext}\nAccelerometer unit = {atext}",
                        f"acceleration {atext}, angular velocity {gtext}, magnetic field uT",
                    ]
                )
            ]
    gname = [_with_unit(x, gtext, gcode, way) if gtext else x for x in _names(style[0])]
    aname = [_with_unit(x, atext, acode, way) if atext else x for x in _names(style[1])]
    gcol = [Column(a, gtext, b, "gyro") for a, b in zip(gname, gcells, strict=True)]
    acol = [Column(a, atext, b, "accel") for a, b in zip(aname, acells, strict=True)]
    return Triads(gcol, acol, gt, at, gq, aq, preamble, decidable, way, (gu, au), style[2])


# --------------------------------------------------------------------------------------- extras
def extras(d: Draw, m: Motion, mag_style: str, way: str) -> tuple[list[Column], list[Column]]:
    """Columns beside the triads: some before them, some after them."""
    n, t = len(m.t), m.t
    before: list[Column] = []
    after: list[Column] = []
    said = way not in ("none", "preamble")
    shown = "parentheses" if said and way == "units line" else way
    if d.odds(0.25):
        name = d.one(["temp", "Temperature", "temperature", "Tmp", "T"])
        after.append(
            Column(name, "°C" if said else "", _text(24 + 0.01 * t + 0.02 * d.normal(size=n), 2))
        )
    if d.odds(0.3):
        field_enu = np.array([2.0, 21.0, -43.0])
        mag = m.attitude.inv().apply(field_enu) + d.normal(0, 0.5, (n, 3))
        for name, k in zip(_names(mag_style), range(3), strict=True):
            label = _with_unit(name, "uT", "uT", shown) if said and way != "units line" else name
            after.append(Column(label, "uT", _text(mag[:, k], 2)))
    if d.odds(0.2):
        # A cheap filter: yaw, pitch and roll wander by a degree.
        ypr = m.attitude.as_euler("ZYX", degrees=True) + np.cumsum(d.normal(0, 0.01, (n, 3)), 0)
        names = d.one(
            [
                ("yaw", "pitch", "roll"),
                ("Yaw", "Pitch", "Roll"),
                ("heading", "pitch", "roll"),
                ("Euler_Z", "Euler_Y", "Euler_X"),
            ]
        )
        after += [Column(x, "deg", _text(ypr[:, k], 2)) for k, x in enumerate(names)]
    if d.odds(0.12):
        q = m.attitude.as_quat()
        names = d.one(
            [
                ("qx", "qy", "qz", "qw"),
                ("quat_x", "quat_y", "quat_z", "quat_w"),
                ("orientation.x", "orientation.y", "orientation.z", "orientation.w"),
            ]
        )
        after += [Column(x, "", _text(q[:, k], 5)) for k, x in enumerate(names)]
    if d.odds(0.1):
        after.append(Column(d.one(["battery", "Vbat", "batt_V"]), "V", _text(3.9 - t * 1e-4, 2)))
    if d.odds(0.08):
        for name, at, dec in (("latitude", 48.137, 6), ("longitude", 11.575, 6), ("speed", 1.2, 2)):
            after.append(Column(name, "", _text(at + 1e-6 * np.floor(t), dec)))
    if d.odds(0.12):
        after.append(
            Column(d.one(["label", "activity", "state"]), "", [str(d.one(["walk", "idle"]))] * n)
        )
    if d.odds(0.08):
        before.append(Column(d.one(["device", "id", "Sensor", "name"]), "", ["imu01"] * n))
    if d.odds(0.1):
        before.append(
            Column(d.one(["", "index", "Unnamed: 0", "idx"]), "", [str(k) for k in range(n)])
        )
    if d.odds(0.06):
        after.append(
            Column(
                d.one(["baro", "pressure_hPa", "alt"]),
                "",
                _text(953.2 + 0.01 * d.normal(size=n), 2),
            )
        )
    return before, after


# --------------------------------------------------------------------------------------- layout
@dataclass
class Layout:
    """How a table becomes bytes."""

    sep: str = ","
    decimal: str = "."
    header: bool = True
    units_line: bool = False
    group_line: bool = False
    quoted: bool = False
    comment: str = ""
    comment_header: bool = False
    trailing: bool = False
    newline: str = "\n"
    encoding: str = "utf-8"
    fixed: bool = False
    preamble: list[str] = field(default_factory=list)


def layout(d: Draw, **fixed: object) -> Layout:
    """One way to write tables."""
    sep = d.one([",", ";", "\t", " ", ", ", "|"], [60, 12, 14, 6, 6, 1])
    out = Layout(sep=sep)
    if sep == ";" and d.odds(0.55):
        out.decimal = ","
    if sep == "\t" and d.odds(0.1):
        out.decimal = ","
    if sep == " " and d.odds(0.5):
        out.fixed = True
    out.quoted = sep in ",;" and d.odds(0.12)
    out.trailing = sep in (",", ";", "\t") and d.odds(0.06)
    out.newline = d.one(["\n", "\r\n"], [60, 40])
    out.encoding = d.one(["utf-8", "utf-8-sig", "utf-16", "cp1252"], [80, 12, 3, 5])
    out.comment = d.one(["# ", "% ", "// ", "", "#", ";", "! "], [10, 4, 3, 8, 2, 1, 0.5])
    out.comment_header = out.comment != "" and d.odds(0.12)
    for name, value in fixed.items():
        setattr(out, name, value)
    return out


def write(d: Draw, path: Path, columns: list[Column], how: Layout, damage: list[str]) -> list[int]:
    """Write a table; the rows that it holds whole, each once."""
    n = len(columns[0].cells)

    def cell(text: str) -> str:
        if (
            how.decimal != "."
            and text
            and text.replace(".", "", 1)
            .replace("-", "")
            .replace("e", "")
            .replace("+", "")
            .isdigit()
        ):
            return text.replace(".", how.decimal)
        return text

    def name(text: str) -> str:
        if how.sep.strip() == "" and how.sep != "\t":
            text = text.replace(" ", "_")
        if how.quoted or (how.sep.strip() in text and how.sep.strip()):
            return f'"{text}"'
        return text

    widths = [max(len(name(c.name)), max(map(len, c.cells)), len(c.unit)) + 2 for c in columns]

    def row(cells: Sequence[str]) -> str:
        if how.fixed:
            return "".join(x.rjust(w) for x, w in zip(cells, widths, strict=True))
        return how.sep.join(cells) + (how.sep.strip(" ") if how.trailing else "")

    lines = [how.comment + x for text in how.preamble for x in text.split("\n")]
    if how.preamble and how.comment == "" and d.odds(0.4):
        lines.append("")
    heads: list[str] = []
    if how.header:
        if how.group_line:
            seen = ""
            groups = []
            for c in columns:
                label = {"gyro": "Gyroscope", "accel": "Accelerometer", "time": ""}.get(c.role, "")
                groups.append(label if label != seen else "")
                seen = label
            heads.append(row(groups))
        heads.append(row([name(c.name) for c in columns]))
        if how.units_line:
            heads.append(
                row(
                    [
                        name(c.unit)
                        if how.sep.strip() == "" and how.sep != "\t" and c.unit
                        else c.unit or ("-" if how.sep == " " else "")
                        for c in columns
                    ]
                )
            )
        if how.comment_header:
            heads = [how.comment + x for x in heads]
    lines += heads
    whole: list[int] = []
    table = list(zip(*(map(cell, c.cells) for c in columns), strict=True))
    again = (
        set(d.choice(n, max(1, n // 100), replace=False).tolist())
        if "doubled rows" in damage
        else set()
    )
    texts = (
        set(d.choice(np.arange(2, n - 2), 2, replace=False).tolist())
        if "text between" in damage
        else set()
    )
    repeat = int(d.integers(5, n - 3)) if "repeated header" in damage else -1
    say = d.one(
        ["# button pressed", "Calibrating...", "--- pause ---", "WARNING: buffer overflow", ""]
    )
    for i, cells in enumerate(table):
        if i in texts:
            lines.append(say)
        if i == repeat:
            lines += heads[-1:] if not how.units_line else heads
        text = row([f'"{x}"' for x in cells] if how.quoted and d_all(how) else cells)
        lines.append(text)
        if i in again:
            lines.append(text)
        whole.append(i)
    if "truncated" in damage:
        last = lines[-1].rstrip()
        lines[-1] = last[: int(len(last) * d.uniform(0.3, 0.95))]
        whole.pop()
    body = how.newline.join(lines) + ("" if "truncated" in damage else how.newline)
    path.write_bytes(body.encode(how.encoding, errors="replace"))
    return whole


def d_all(how: Layout) -> bool:
    """Whether the cells of a quoted table are quoted as well: with a decimal comma they are."""
    return how.decimal == "," or how.newline == "\r\n"


def damages(d: Draw) -> list[str]:
    """What went wrong with the log."""
    kinds = {
        "doubled rows": 0.03,
        "text between": 0.03,
        "repeated header": 0.02,
        "truncated": 0.06,
        "nan": 0.04,
    }
    return [k for k, p in kinds.items() if d.odds(p)]


# ---------------------------------------------------------------------------------------- kinds
def _truth(c: Clock, tr: Triads, rate: float) -> Truth:
    return Truth(
        c.t - c.t[0],
        tr.gyro_true,
        tr.accel_true,
        tr.gyro_quantum,
        tr.accel_quantum,
        c.tolerance,
        [x - x[0] for x in c.clocks],
        accel_names=tuple(x.name for x in tr.accel),
        rate_hz=rate,
    )


def _rows(truth: Truth, rows: list[int]) -> Truth:
    accel = None if truth.accel is None else truth.accel[rows]
    return replace(
        truth,
        t=truth.t[rows] - truth.t[rows[0]],
        gyro=truth.gyro[rows],
        accel=accel,
        clocks=[x[rows] - x[rows[0]] for x in truth.clocks],
    )


def _nan(d: Draw, tr: Triads, truth: Truth) -> None:
    """Cells that the writer had no value for."""
    word = d.one(["NaN", "nan", "", "NULL", "N/A", "null", "NaN"])
    n = len(truth.t)
    for i in d.choice(np.arange(1, n - 1), max(1, n // 150), replace=False):
        for c in (*tr.gyro, *tr.accel):
            c.cells[i] = word
        truth.gyro = truth.gyro.copy()
        truth.gyro[i] = np.nan
        if truth.accel is not None:
            truth.accel = truth.accel.copy()
            truth.accel[i] = np.nan


PREAMBLES = (
    "Device: IMU logger v1.2",
    "Firmware 0.9.3",
    "Recorded with DataLogger Pro",
    "Subject: 03",
    "Serial number: 00B4-117",
    "Start: 2023-04-11 10:22:31",
    "Comment: second run, on the table",
    "Logger started",
    "Author: lab",
    "Calibration: none",
    "File version 2",
)


def table(d: Draw, path: Path) -> Made:
    """A table of one kind of row, everything drawn independently."""
    m, rate, _ = sample(d)
    tr = triads(d, m)
    c = clock(d, m.t, rate, tr.unit_way)
    how = layout(d)
    if how.decimal == "," and tr.unit_way == "units line":
        how.quoted = False
    before, after = extras(d, m, tr.mag_style, tr.unit_way)
    kind = [f"table {'/'.join(tr.units)}", tr.unit_way, c.kind]
    truth = _truth(c, tr, rate)
    decidable = tr.decidable and c.decidable

    # Acceleration without gravity, and gravity, beside the whole; or in its place.
    if d.odds(0.08) and tr.units[1] in ACCEL_UNITS:
        k = ACCEL_UNITS[tr.units[1]][0]
        lin, grav = d.one(
            [
                ("linear_acc_{x}", "gravity_{x}"),
                ("LinAcc{X}", "Grav{X}"),
                ("userAcceleration.{x}", "gravity.{x}"),
                ("lin_a{x}", "g_vec_{x}"),
            ]
        )
        gravity = m.accel - m.linear
        more = [
            Column(x, tr.accel[0].unit, _text(m.linear[:, i] / k, 5))
            for i, x in enumerate(_names(lin))
        ]
        if d.odds(0.6):
            more += [
                Column(x, tr.accel[0].unit, _text(gravity[:, i] / k, 5))
                for i, x in enumerate(_names(grav))
            ]
            if not {x.name for x in more} & {x.name for x in tr.accel}:
                after = more + after
                kind.append("with linear and gravity")
        elif not {x.name for x in more} & {x.name for x in tr.accel}:
            if d.odds(0.5):
                after = more + after
                kind.append("with linear")
            else:
                tr.accel = more[:3]
                truth.accel = None
                kind.append("linear only")
    elif d.odds(0.03):
        tr.accel = []
        truth.accel = None
        kind.append("gyro only")

    g, a = tr.gyro, tr.accel
    if d.odds(0.05):
        g, a = g[::-1], a[::-1]
        kind.append("zyx")
    if d.odds(0.03) and len(a) == 3:
        g, a = [g[1], g[0], g[2]], [a[1], a[0], a[2]]
        kind.append("yxz")
    core = [*a, *g] if d.odds(0.6) else [*g, *a]
    if d.odds(0.08) and a:
        core = [x for pair in zip(a, g, strict=True) for x in pair]
        kind.append("interleaved")
    cols = [*before, *c.columns, *core, *after]
    if d.odds(0.1):
        cols = [*before, *core, *after, *c.columns]
        kind.append("time last")

    if tr.unit_way in (
        "parentheses",
        "tight parentheses",
        "brackets",
        "tight brackets",
        "in",
        "slash",
        "blank",
    ):
        for x in (*c.columns, *after):
            if x.unit and x.name and not any(s in x.name for s in "([_"):
                x.name = _with_unit(x.name, x.unit, x.unit, tr.unit_way)
    elif tr.unit_way == "suffix":
        for x in c.columns:
            if x.unit:
                x.name += "_" + x.unit
    elif tr.unit_way == "units line":
        how.units_line = True
        for x in c.columns:
            if not x.unit:
                x.unit = {"ms": "ms", "us": "us", "ns": "ns", "number": "", "wrap": ""}.get(
                    c.kind, ""
                )
    lines = [*tr.preamble, *c.preamble]
    if d.odds(0.15):
        lines = [str(x) for x in d.choice(PREAMBLES, int(d.integers(1, 4)), replace=False)] + lines
    if d.odds(0.04) and m.upright:
        lines.append(
            d.one(["Axes: x forward, y left, z up", "sensor frame: X forward, Y left, Z up (FLU)"])
        )
        truth.to_frd = np.diag([1.0, -1.0, -1.0])
        kind.append("axes stated")
    elif d.odds(0.02) and m.upright:
        lines.append("Axes: x forward, y right, z down (NED body frame)")
        truth.to_frd = np.eye(3)
        kind.append("axes stated")
    how.preamble = lines
    if how.encoding == "cp1252" and any("ω" in x.name for x in cols):
        how.encoding = "utf-8"
    if d.odds(0.04) and not how.units_line:
        how.header = False
        decidable = False
        kind.append("no header")
    damage = damages(d)
    if "nan" in damage and how.sep != " " and a:
        _nan(d, tr, truth)
    if how.sep == " " and not how.fixed:
        # Blanks separate: no cell may hold one, nor be empty.
        cols = [x for x in cols if all(x.cells)]
    if how.sep == " ":
        for x in cols:
            x.cells = [y.replace(" ", "T") for y in x.cells]
            x.name = x.name or "idx"
    if how.sep.strip() == "," and any("," in y for x in cols for y in x.cells[:1]):
        how.sep = ";"
    if how.decimal == "," and how.sep.strip() == ",":
        how.decimal = "."
    rows = write(d, path, cols, how, damage)
    kind += damage
    kind.append(
        {
            ",": "comma",
            ";": "semicolon",
            "\t": "tab",
            " ": "blanks",
            ", ": "comma blank",
            "|": "bar",
        }[how.sep]
    )
    if how.decimal == ",":
        kind.append("decimal comma")
    if how.encoding != "utf-8":
        kind.append(how.encoding)
    return Made(path, _rows(truth, rows), ", ".join(kind), decidable)


def _plain(
    d: Draw,
    path: Path,
    kind: str,
    tr: Triads,
    c: Clock,
    cols: list[Column],
    how: Layout,
    rate: float,
    decidable: bool = True,
) -> Made:
    truth = _truth(c, tr, rate)
    damage = [x for x in damages(d) if x != "nan"]
    rows = write(d, path, cols, how, damage)
    return Made(path, _rows(truth, rows), ", ".join([kind, *damage]), decidable)


def arduino(d: Draw, path: Path) -> Made:
    """What a sketch prints to the serial monitor."""
    m, rate, _ = sample(d, float(d.one([20, 50, 100, 200])))
    unit = d.one(["counts", "deg/s", "rad/s"], [5, 4, 2])
    style = d.one(
        [
            ("g{x}", "a{x}", "m{x}"),
            ("Gy{X}", "Ac{X}", "Ma{X}"),
            ("gyro{X}", "accel{X}", "mag{X}"),
            ("G{x}", "A{x}", "M{x}"),
            ("GyroX GyroY GyroZ", "AccX AccY AccZ", "MagX MagY MagZ"),
        ]
    )
    accel = None if unit == "counts" else d.one(["g", "m/s2"])
    tr = triads(d, m, "none", style, unit, accel)
    way = d.one(["millis", "stamped", "labels", "teapot"], [4, 3, 3, 2])
    start = datetime(2022, 5, 3, 14, 22, 7, tzinfo=UTC)
    if way == "millis":
        c = clock(d, m.t, rate, "none", d.one(["ms", "us"], [4, 1]))
        if d.odds(0.6):
            c.columns[0].name = {"ms": "millis", "us": "micros"}[c.kind]
        cols = [*c.columns, *tr.accel, *tr.gyro]
        how = layout(
            d,
            sep=d.one([",", "\t", ", ", " "]),
            decimal=".",
            fixed=False,
            quoted=False,
            preamble=["Initializing I2C devices...", "MPU6050 connection successful", *tr.preamble]
            if d.odds(0.4)
            else tr.preamble,
            comment="",
            comment_header=False,
        )
        return _plain(
            d, path, f"arduino, {'/'.join(tr.units)}", tr, c, cols, how, rate, tr.decidable
        )
    # Stamps of the serial monitor are times of arrival to a millisecond.
    stamps = _dates(start, m.t, "%H:%M:%S.FFF", 3)
    lines = list(tr.preamble)
    decidable = tr.decidable
    if way == "stamped":
        names = [x.name for x in (*tr.accel, *tr.gyro)]
        lines.append(f"{stamps[0]} -> " + ",".join(names))
        for i, s in enumerate(stamps):
            lines.append(f"{s} -> " + ",".join(x.cells[i] for x in (*tr.accel, *tr.gyro)))
    elif way == "labels":
        colon = d.one([":", " = ", ": "])
        sep = d.one([" ", "\t", ", ", " | "])
        for i in range(len(stamps)):
            text = sep.join(f"{x.name}{colon}{x.cells[i]}" for x in (*tr.accel, *tr.gyro))
            lines.append(f"t{colon}{round(m.t[i] * 1000)}{sep}{text}")
    else:
        # The sample sketch of the library: a word, then six numbers; nothing says the rate.
        decidable = False
        for i in range(len(stamps)):
            lines.append("a/g:\t" + "\t".join(x.cells[i] for x in (*tr.accel, *tr.gyro)))
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode())
    c = Clock([], m.t, 1.01e-3 if way != "teapot" else 1.0, way)
    return Made(path, _truth(c, tr, rate), f"arduino {way}, {'/'.join(tr.units)}", decidable)


def phone(d: Draw, path: Path) -> Made:
    """The apps of phones, each with its own habits."""
    app = d.one(
        ["physics", "andro", "ios", "sensorlog", "matlab", "wide", "phyphox"], [3, 3, 3, 3, 1, 3, 2]
    )
    rate = float(d.one([50, 100, 10, 200]))
    m, rate, _ = sample(d, rate)
    how = Layout(newline=d.one(["\n", "\r\n"]))
    if app == "physics":
        tr = triads(d, m, "none", ("wx wy wz", "gFx gFy gFz", "Bx By Bz"), "rad/s", "g")
        c = clock(d, m.t, rate, "none", "s")
        c.columns[0].name = "time"
        if d.odds(0.4):
            how.sep, how.decimal = ";", ","
        gf = np.linalg.norm(m.accel, axis=1) / G
        cols = [
            *c.columns,
            *tr.accel,
            *([Column("TgF", "", _text(gf, 3))] if d.odds(0.5) else []),
            *tr.gyro,
        ]
        made = _plain(d, path, "phone: gFx and wx", tr, c, cols, how, rate)
        made.truth.to_frd = PHONE  # the app is known, and with it its axes
        return made
    if app == "andro":
        tr = triads(
            d,
            m,
            "none",
            ("GYROSCOPE {X}", "ACCELEROMETER {X}", "MAGNETIC FIELD {X}"),
            "rad/s",
            "m/s2",
        )
        for x in tr.gyro:
            x.name += " (rad/s)"
        for x in tr.accel:
            x.name += " (m/s²)"
        c = clock(d, m.t, rate, "none", "ms")
        c.columns[0].name = "Time since start in ms "
        grav = m.accel - m.linear
        more = [Column(f"GRAVITY {'XYZ'[k]} (m/s²)", "", _text(grav[:, k], 4)) for k in range(3)]
        more += [
            Column(f"LINEAR ACCELERATION {'XYZ'[k]} (m/s²)", "", _text(m.linear[:, k], 4))
            for k in range(3)
        ]
        dates = Column(
            "YYYY-MO-DD HH-MI-SS_SSS",
            "",
            _dates(datetime(2021, 3, 5, 9, 12, tzinfo=UTC), m.t, "%Y-%m-%d %H-%M-%S_FFF", 3),
        )
        how.sep = d.one([";", ","])
        return _plain(
            d,
            path,
            "phone: capitals with gravity and linear",
            tr,
            c,
            [*tr.accel, *more, *tr.gyro, *c.columns, dates],
            how,
            rate,
        )
    if app == "ios":
        # The phone's own convention: a face that is up reads minus one g.
        style = d.one(
            [
                ("gyroRotationX(rad/s)", "accelerometerAccelerationX(G)"),
                ("motionRotationRateX(rad/s)", "accelerometerAccelerationX(G)"),
                ("motionRotationRateX(rad/s)", ""),
            ]
        )
        tr = triads(d, m, "none", STYLES[0], "rad/s", "g")
        gname = [style[0].replace("X(", f"{x}(") for x in "XYZ"]
        for x, name in zip(tr.gyro, gname, strict=True):
            x.name = name
        start = datetime(2020, 8, 9, 17, 3, tzinfo=UTC)
        when = Column("loggingTime(txt)", "", _dates(start, m.t, "%Y-%m-%d %H:%M:%S.FFF +0200", 3))
        since = Column("motionTimestamp_sinceReboot(s)", "", _text(m.t + 81234.5, 6), "time")
        c = Clock([since], m.t, 2e-3, "two", clocks=[m.t])
        grav = (tr.accel_true - m.linear) / G
        parts = [Column(f"motionGravity{'XYZ'[k]}(G)", "", _text(-grav[:, k], 6)) for k in range(3)]
        user = [
            Column(f"motionUserAcceleration{'XYZ'[k]}(G)", "", _text(-m.linear[:, k] / G, 6))
            for k in range(3)
        ]
        head = [when, Column("loggingSample(N)", "", [str(k + 1) for k in range(len(m.t))])]
        if style[1]:
            for k, x in enumerate(tr.accel):
                x.name = style[1].replace("X(", f"{'XYZ'[k]}(")
                x.cells = _text(-tr.accel_true[:, k] / G, 6)
            cols = [*head, *tr.accel, since, *tr.gyro, *(user + parts if d.odds(0.6) else [])]
            made = _plain(d, path, "iOS: sign of gravity turned round", tr, c, cols, how, rate)
            made.truth.accel_quantum = 3e-5
            made.truth.to_frd = PHONE
            return made
        cols = [*head, since, *tr.gyro, *user, *parts]
        made = _plain(
            d, path, "iOS: user acceleration and gravity, no whole", tr, c, cols, how, rate
        )
        made.truth.accel_quantum = 3e-5
        made.truth.to_frd = PHONE
        made.truth.accel_optional = True
        made.truth.accel_names = tuple(x.name for x in (*user, *parts))
        return made
    if app == "sensorlog":
        tr = triads(d, m, "none", ("gyroscope_{x}", "accelerometer_{x}", "m{x}"), "rad/s", "m/s2")
        for x in (*tr.gyro, *tr.accel):
            x.name = x.name.replace("accelerometer_", "Accelerometer_").replace(
                "gyroscope_", "Gyroscope_"
            )
        c = clock(d, m.t, rate, "none", "epoch ns")
        c.columns[0].name = "time"
        since = Column("seconds_elapsed", "", _text(m.t + 0.0613, 6))
        cols = [*c.columns, since, *tr.gyro[::-1], *tr.accel[::-1]]
        return _plain(d, path, "phone: epoch ns, seconds elapsed, z y x", tr, c, cols, how, rate)
    if app == "matlab":
        tr = triads(
            d,
            m,
            "none",
            ("AngularVelocity_{X}", "Acceleration_{X}", "MagneticField_{X}"),
            "rad/s",
            "m/s2",
        )
        c = clock(d, m.t, rate, "none", "iso")
        c.columns[0].name = "Timestamp"
        return _plain(
            d,
            path,
            "phone: timetable written by MATLAB",
            tr,
            c,
            [*c.columns, *tr.accel, *tr.gyro],
            how,
            rate,
            tr.decidable,
        )
    if app == "phyphox":
        tr = triads(
            d,
            m,
            "parentheses",
            ("Gyroscope {x}", "Acceleration {x}", "Magnetic field {x}"),
            "rad/s",
            "m/s2",
        )
        c = clock(d, m.t, rate, "none", "s")
        c.columns[0].name = "Time (s)"
        how.quoted = True
        how.sep = d.one([",", ";", "\t"])
        made = _plain(
            d,
            path,
            "phone: quoted names with units",
            tr,
            c,
            [*c.columns, *tr.accel, *tr.gyro],
            how,
            rate,
        )
        made.truth.to_frd = PHONE
        return made
    tr = triads(d, m, "none", ("gyro_{x}", "acc_{x}", "mag_{x}"), "rad/s", "m/s2")
    c = clock(d, m.t, rate, "none", "epoch ms")
    lin = [Column(f"linear_acc_{x}", "", _text(m.linear[:, k], 5)) for k, x in enumerate("xyz")]
    grav = [
        Column(f"gravity_{x}", "", _text((m.accel - m.linear)[:, k], 5))
        for k, x in enumerate("xyz")
    ]
    names = [("linear first", [*lin, *grav, *tr.accel]), ("whole first", [*tr.accel, *lin, *grav])]
    word, block = d.one(names)
    return _plain(
        d,
        path,
        f"phone: linear, gravity and whole, {word}",
        tr,
        c,
        [*c.columns, *block, *tr.gyro],
        how,
        rate,
        tr.decidable,
    )


def mixed(d: Draw, path: Path) -> Made:
    """Rows of several sensors with a column or a word that says which."""
    rate = float(d.one([50, 100, 200]))
    m, rate, _ = sample(d, rate)
    gyro_words, accel_words, mag_words = d.one(
        [
            ("GYR", "ACC", "MAG"),
            ("gyro", "accel", "mag"),
            ("Gyroscope", "Accelerometer", "Magnetometer"),
            ("G", "A", "M"),
            ("TYPE_GYROSCOPE", "TYPE_ACCELEROMETER", "TYPE_MAGNETIC_FIELD"),
            (
                "android.sensor.gyroscope",
                "android.sensor.accelerometer",
                "android.sensor.magnetic_field",
            ),
            ("4", "1", "2"),
        ],
        [3, 3, 2, 1, 1, 2, 1],
    )
    gu, au = d.one([("rad/s", "m/s2"), ("deg/s", "g"), ("deg/s", "m/s2")], [5, 2, 1])
    tr = triads(d, m, "none", STYLES[0], gu, au)
    shift = d.uniform(0, 0.8) / rate
    # The other triad samples the same motion at its own instants.
    own = m.t + shift
    accel = np.column_stack([np.interp(own, m.t, m.accel[:, k]) for k in range(3)])
    ak = ACCEL_UNITS[au][0]
    unit = d.one(["ms", "ns", "s", "epoch ms"])
    k, base = {
        "ms": (1e3, 0),
        "ns": (1e9, 7 * 10**12),
        "s": (1.0, 0),
        "epoch ms": (1e3, 1_660_000_000_000),
    }[unit]

    def stamp(s: float) -> str:
        return f"{s:.6f}" if unit == "s" else str(base + round(s * k))

    rows = [(s, gyro_words, [x.cells[i] for x in tr.gyro]) for i, s in enumerate(m.t)]
    rows += [(s, accel_words, [f"{v / ak:.5f}" for v in accel[i]]) for i, s in enumerate(own)]
    if d.odds(0.5):
        mag = m.attitude.inv().apply([2.0, 21.0, -43.0])
        rows += [
            (m.t[i] + 0.4 / rate, mag_words, [f"{v:.2f}" for v in mag[i]])
            for i in range(0, len(m.t), 5)
        ]
    rows.sort(key=lambda r: r[0])
    first = d.odds(0.5)
    head = d.odds(0.75)
    name = d.one(["sensor", "type", "Sensor", "sensorType"])
    when = "timestamp" + (d.one(["_", " "]) + unit.split()[-1] if d.odds(0.4) else "")
    lines = (
        [",".join([name, when, "x", "y", "z"] if first else [when, name, "x", "y", "z"])]
        if head
        else []
    )
    for s, word, values in rows:
        lines.append(",".join([word, stamp(s), *values] if first else [stamp(s), word, *values]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    c = Clock([], m.t, 3.0 / rate, unit)
    truth = _truth(c, tr, rate)
    truth.own_rates, truth.accel_t, truth.accel = True, own - m.t[0], accel
    truth.accel_names = (accel_words,)
    if gyro_words.startswith(("android", "TYPE_", "4")):
        truth.to_frd = PHONE  # names and numbers of Android, which defines the axes
    kind = f"rows of several sensors, {gyro_words}, {gu}/{au}" + ("" if head else ", no header")
    return Made(path, truth, kind, tr.decidable and gyro_words not in ("4", "G"))


def wide(d: Draw, path: Path) -> Made:
    """One wide table of sensors at their own rates, with empty cells."""
    rate = float(d.one([50, 100, 200]))
    m, rate, _ = sample(d, rate)
    tr = triads(d, m)
    while tr.units[0] == "counts":
        tr = triads(d, m)
    same = d.odds(0.4)
    half = np.arange(0, len(m.t), 2)
    n = len(m.t)
    empty = d.one(["", "", "NaN"])
    truth = _truth(Clock([], m.t, 3.0 / rate, "s"), tr, rate)
    truth.own_rates = True
    baro = Column(
        "pressure", "", [f"{950 + 0.001 * i:.2f}" if i % 10 == 0 else empty for i in range(n)]
    )
    if same:
        # The accelerometer at every second row.
        for x in tr.accel:
            x.cells = [v if i % 2 == 0 else empty for i, v in enumerate(x.cells)]
        truth.accel_t, truth.accel = m.t[half] - m.t[0], tr.accel_true[half]
        c = clock(d, m.t, rate, tr.unit_way, d.one(["s", "ms", "epoch ms"]))
        cols = [*c.columns, *tr.gyro, *tr.accel, baro]
    else:
        # Gyro and accelerometer never in the same row.
        own = m.t + 0.5 / rate
        accel = np.column_stack([np.interp(own, m.t, tr.accel_true[:, k]) for k in range(3)])
        ak = ACCEL_UNITS[tr.units[1]][0]
        t = np.column_stack([m.t, own]).ravel()
        t = np.maximum.accumulate(t)
        c = clock(d, t, rate * 2, tr.unit_way, d.one(["s", "ms", "epoch ms"]))
        for x in tr.gyro:
            x.cells = [v for cell in x.cells for v in (cell, empty)]
        for q, x in enumerate(tr.accel):
            x.cells = [v for i in range(n) for v in (empty, f"{accel[i, q] / ak:.5f}")]
        truth.accel_t, truth.accel = own - m.t[0], accel
        cols = [*c.columns, *tr.gyro, *tr.accel]
    if tr.unit_way not in ("none", "preamble", "units line", "suffix"):
        for x in c.columns:
            if x.unit and "(" not in x.name and "[" not in x.name:
                x.name = _with_unit(x.name, x.unit, x.unit, tr.unit_way)
    how = Layout(
        sep=d.one([",", ";"]),
        preamble=tr.preamble,
        comment="# ",
        units_line=tr.unit_way == "units line",
    )
    write(d, path, cols, how, [])
    how_far = "every second row" if same else "rows of one sensor"
    kind = f"wide, empty cells, {how_far}, {'/'.join(tr.units)}, {tr.unit_way}, {c.kind}"
    return Made(path, truth, kind, tr.decidable)


def ros(d: Draw, path: Path) -> Made:
    """Tables that tools of ROS write."""
    m, rate, _ = sample(d, float(d.one([50, 100, 200, 400])))
    tool = d.one(["echo", "plot", "bagpy"])
    sep = "."
    n = len(m.t)
    q = m.attitude.as_quat()
    pre = {"echo": "field.", "plot": d.one(["/imu/", "/imu/data/", "/camera/imu/"]), "bagpy": ""}[
        tool
    ]
    sep = {"echo": ".", "plot": "/", "bagpy": "."}[tool]
    style = (f"{pre}angular_velocity{sep}{{x}}", f"{pre}linear_acceleration{sep}{{x}}", "m{x}")
    tr = triads(d, m, "none", style, "rad/s", "m/s2")
    epoch = 1_612_345_678
    ns = [str(epoch * 10**9 + round((s + 0.123456789) * 1e9)) for s in m.t]
    late = np.maximum.accumulate(m.t + np.abs(d.normal(0, 0.1 / rate, n)))
    rns = [str(epoch * 10**9 + round((s + 0.1241) * 1e9)) for s in late]
    quat = [
        Column(f"{pre}orientation{sep}{a}", "", _text(q[:, k], 8)) for k, a in enumerate("xyzw")
    ]

    def cov(of: str) -> list[Column]:
        return [
            Column(
                f"{pre}{of}_covariance{i}"
                if tool == "echo"
                else f"{pre}{of}_covariance{sep}{i}"
                if tool == "plot"
                else f"{of}_covariance_{i}",
                "",
                ["0.0004" if i % 4 == 0 else "0.0"] * n,
            )
            for i in range(9)
        ]

    body = [
        *quat,
        *cov("orientation"),
        *tr.gyro,
        *cov("angular_velocity"),
        *tr.accel,
        *cov("linear_acceleration"),
    ]
    seq = [str(10 + k) for k in range(n)]
    c = Clock([], m.t, 2e-3 + 1.0 / rate, "ros", clocks=[late - late[0]])
    if tool == "echo":
        cols = [
            Column("%time", "", rns),
            Column("field.header.seq", "", seq),
            Column("field.header.stamp", "", ns),
            Column("field.header.frame_id", "", ["imu_link"] * n),
            *body,
        ]
    elif tool == "plot":
        cols = [
            Column("__time", "", _text(late + epoch, 6)),
            Column(f"{pre}header/seq", "", seq),
            Column(f"{pre}header/stamp", "", _text(m.t + epoch, 6)),
            *body,
        ]
    else:
        cols = [
            Column("Time", "", _text(late + epoch, 6)),
            Column("header.seq", "", seq),
            Column("header.stamp.secs", "", [x[:10] for x in ns]),
            Column("header.stamp.nsecs", "", [str(int(x[10:])) for x in ns]),
            Column("header.frame_id", "", ["imu_link"] * n),
            *body,
        ]
    made = _plain(d, path, f"ROS table ({tool})", tr, c, cols, Layout(), rate)
    made.truth.to_frd = np.diag([1.0, -1.0, -1.0])
    return made


def jsonl(d: Draw, path: Path) -> Made:
    """One JSON object a line."""
    rate = float(d.one([20, 50, 100]))
    m, rate, _ = sample(d, rate)
    gu, au = d.one([("rad/s", "m/s2"), ("deg/s", "g"), ("deg/s", "m/s2")], [5, 3, 2])
    tr = triads(d, m, "none", STYLES[0], gu, au)
    shape = d.one(["flat", "nested", "arrays", "rows"])
    when = d.one(
        [
            ("ts", 1e3, 1_690_000_000_000),
            ("timestamp", 1e3, 0),
            ("t", 1.0, 0.0),
            ("time_us", 1e6, 0),
            ("timestamp", 1.0, 1_690_000_000.0),
        ]
    )
    gw, aw = d.one(
        [
            ("gyro", "accel"),
            ("gyroscope", "accelerometer"),
            ("angular_velocity", "linear_acceleration"),
            ("gyr", "acc"),
            ("rotationRate", "accelerationIncludingGravity"),
        ]
    )
    said = d.odds(0.3)
    lines = []
    truth = _truth(Clock([], m.t, max(1.01 / when[1], 2e-6), "json"), tr, rate)
    if gw == "rotationRate":  # browsers: degrees a second
        tr = triads(d, m, "none", STYLES[0], "deg/s", "m/s2")
        gu, au = tr.units
        truth = _truth(Clock([], m.t, max(1.01 / when[1], 2e-6), "json"), tr, rate)
    g = [[float(v) for v in x.cells] for x in tr.gyro]
    a = [[float(v) for v in x.cells] for x in tr.accel]
    letters = "xyz"
    suffix_g = {"rad/s": "_rad_s", "deg/s": "_dps"}[gu] if said else ""
    suffix_a = {"m/s2": "_mps2", "g": "_g"}[au] if said else ""
    for i, s in enumerate(m.t):
        stamp = when[2] + s * when[1]
        out: dict[str, object] = {when[0]: round(stamp, 6) if when[1] == 1.0 else round(stamp)}
        gv, av = [x[i] for x in g], [x[i] for x in a]
        if shape == "flat":
            out |= {f"{gw}_{x}{suffix_g}": v for x, v in zip(letters, gv, strict=True)}
            out |= {f"{aw}_{x}{suffix_a}": v for x, v in zip(letters, av, strict=True)}
        elif shape == "nested":
            out |= {
                gw + suffix_g: dict(zip(letters, gv, strict=True)),
                aw + suffix_a: dict(zip(letters, av, strict=True)),
            }
        elif shape == "arrays":
            out |= {gw + suffix_g: gv, aw + suffix_a: av}
        else:
            lines.append(json.dumps(out | {"sensor": gw, "values": gv}))
            lines.append(json.dumps(out | {"sensor": aw, "values": av}))
            continue
        if i % 50 == 0 and shape == "nested":
            out["battery"] = 0.87
        lines.append(json.dumps(out))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    truth.accel_names = (aw,)
    if shape == "rows":
        truth.own_rates, truth.accel_t = True, truth.t
        truth.time_tolerance = 3.0 / rate
    said = said and shape != "rows"
    kind = f"JSON lines, {shape}, {gw}, {gu}/{au}" + (", unit in names" if said else "")
    return Made(path, truth, kind, said or tr.decidable)


def labview(d: Draw, path: Path) -> Made:
    """The measurement file of LabVIEW."""
    m, rate, _ = sample(d, float(d.one([100, 200, 500])))
    tr = triads(
        d,
        m,
        "none",
        d.one([("Gyro {X}", "Acc {X}", "M"), ("Gyro_{x}", "Accel_{x}", "M")]),
        d.one(["deg/s", "rad/s"]),
        d.one(["g", "m/s2"]),
    )
    c = clock(d, m.t, rate, "none", "s")
    n = 6
    gtext, atext = tr.gyro[0].unit, tr.accel[0].unit
    comma = d.odds(0.3)
    tab = "\t"
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        f"Decimal_Separator\t{',' if comma else '.'}",
        "Multi_Headings\tNo",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
        "Operator\tlab",
        "Date\t2018/06/12",
        "Time\t13:05:22,4471",
        "***End_of_Header***\t",
        "\t",
        f"Channels\t{n}" + tab * n,
        "Samples" + (tab + str(len(m.t))) * n,
        "Date" + "\t2018/06/12" * n,
        "Time" + "\t13:05:22,51" * n,
        "Y_Unit_Label\t" + tab.join([atext] * 3 + [gtext] * 3),
        "X_Dimension" + "\tTime" * n,
        "X0" + "\t0,0" * n,
        f"Delta_X{(tab + format(1 / rate, '.6f')) * n}",
        "***End_of_Header***" + tab * n,
        "X_Value\t" + tab.join(x.name for x in (*tr.accel, *tr.gyro)) + "\tComment",
    ]
    said = d.odds(0.6)
    if not said:
        head = [x for x in head if not x.startswith("Y_Unit")]
    columns = [*c.columns, *tr.accel, *tr.gyro]
    lines = ["\t".join(x.cells[i] for x in columns) for i in range(len(m.t))]
    if comma:
        lines = [x.replace(".", ",") for x in lines]
    path.write_bytes(("\r\n".join(head + lines) + "\r\n").encode("cp1252", errors="replace"))
    kind = (
        f"LabVIEW, {'/'.join(tr.units)}"
        + (", units stated" if said else "")
        + (", decimal comma" if comma else "")
    )
    return Made(path, _truth(c, tr, rate), kind, said or tr.decidable)


def logger(d: Draw, path: Path) -> Made:
    """Loggers of makers: a preamble, then a table; or messages of an autopilot."""
    what = d.one(["xsens", "dataflash", "xio", "px4", "witmotion"])
    m, rate, _ = sample(d, float(d.one([50, 100, 200])))
    if what == "xsens":
        tr = triads(d, m, "none", ("Gyr_{X}", "Acc_{X}", "Mag_{X}"), "rad/s", "m/s2")
        number = np.rint(m.t * rate).astype(np.int64)
        for i in range(1, len(number)):
            number[i] = max(number[i], number[i - 1] + 1)
        fine = number * int(10000 / rate) + 4711
        cols = [
            Column("PacketCounter", "", [str(int(v + 65500) % 65536) for v in number]),
            Column("SampleTimeFine", "", [str(int(v)) for v in fine]),
            *tr.accel,
            *tr.gyro,
        ]
        how = Layout(
            sep="\t",
            comment="// ",
            newline="\r\n",
            preamble=[
                "Start Time: Unknown",
                f"Update Rate: {rate:.1f}Hz",
                "Filter Profile: human (46.1)",
                "Firmware Version: 4.3.1",
            ],
        )
        t = (number - number[0]) / rate
        return _plain(
            d,
            path,
            "logger: packet counter, rate in the preamble",
            tr,
            Clock([], t, 0.2 / rate, "number"),
            cols,
            how,
            rate,
            tr.decidable,
        )
    if what == "dataflash":
        tr = triads(d, m, "none", ("Gyr{X}", "Acc{X}", "Mag{X}"), "rad/s", "m/s2")
        fmt = "FMT, 163, 48, IMU, QffffffIIfBBHH, TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,"
        fmt += "EG,EA,T,GH,AH,GHz,AHz"
        lines = [
            "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
            fmt,
            "FMT, 129, 40, ATT, QccccCC, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw",
            "PARM, 123, SYSID_THISMAV, 1",
        ]
        for i, s in enumerate(m.t):
            us = round((s + 33.2) * 1e6)
            values = ", ".join(x.cells[i] for x in (*tr.gyro, *tr.accel))
            lines.append(f"IMU, {us}, {values}, 0, 0, 41.5, 1, 1, 1000, 1000")
            if i % 10 == 0:
                lines.append(f"ATT, {us + 50}, 0.0, 1.2, 0.0, -0.3, 0.0, 91.2")
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        truth = _truth(Clock([], m.t, 2e-6, "us"), tr, rate)
        truth.to_frd = np.eye(3)
        return Made(path, truth, "logger: messages of an autopilot as text", True)
    if what == "xio":
        tr = triads(
            d,
            m,
            "parentheses",
            ("Gyroscope {X}", "Accelerometer {X}", "Magnetometer {X}"),
            "deg/s",
            "g",
        )
        c = clock(d, m.t, rate, "none", d.one(["s", "us"]))
        c.columns[0].name = {"s": "Time (s)", "us": "Timestamp (us)"}[c.kind]
        return _plain(
            d,
            path,
            "logger: names with units",
            tr,
            c,
            [*c.columns, *tr.gyro, *tr.accel],
            Layout(),
            rate,
        )
    if what == "px4":
        tr = triads(
            d, m, "none", ("gyro_rad[{i}]", "accelerometer_m_s2[{i}]", "m"), "rad/s", "m/s2"
        )
        c = clock(d, m.t, rate, "none", "us")
        c.columns[0].name = "timestamp"
        more = [
            Column("gyro_integral_dt", "", [str(round(1e6 / rate))] * len(m.t)),
            Column("accelerometer_timestamp_relative", "", ["0"] * len(m.t)),
            Column("accelerometer_integral_dt", "", [str(round(1e6 / rate))] * len(m.t)),
        ]
        made = _plain(
            d,
            path,
            "logger: topic of an autopilot",
            tr,
            c,
            [*c.columns, *tr.gyro, more[0], more[1], *tr.accel, more[2]],
            Layout(),
            rate,
        )
        made.truth.to_frd = np.eye(3)
        return made
    tr = triads(
        d,
        m,
        "none",
        ("wx(deg/s) wy(deg/s) wz(deg/s)", "ax(g) ay(g) az(g)", "hx hy hz"),
        "deg/s",
        "g",
    )
    stamp = Column(
        "Time(s)",
        "",
        _dates(datetime(2021, 11, 4, 15, 0, tzinfo=UTC), m.t, "%Y-%m-%d %H:%M:%S.FFF", 3),
        "time",
    )
    zone = [Column("address", "", ["0x50"] * len(m.t)), stamp]
    ypr = m.attitude.as_euler("ZYX", degrees=True)
    angle = [Column(f"Angle{'XYZ'[k]}(deg)", "", _text(ypr[:, 2 - k], 3)) for k in range(3)]
    temp = Column("T(°)", "", ["31.2500"] * len(m.t))
    how = Layout(
        sep="\t", newline="\r\n", preamble=["StartTime: 2021-11-04 15:00:00.000"], comment=""
    )
    return _plain(
        d,
        path,
        "logger: dates under Time(s), angles, T(°)",
        tr,
        Clock([stamp], m.t, 1.01e-3, "iso"),
        [*zone, *tr.accel, *tr.gyro, *angle, temp],
        how,
        rate,
    )


def simulator(d: Draw, path: Path) -> Made:
    """Simulators, games and MATLAB: p, q, r beside states of the body."""
    m, rate, _ = sample(d, float(d.one([50, 60, 100])))
    what = d.one(["sim", "matlab", "xplane", "game"])
    gu = d.one(["rad/s", "deg/s"], [3, 1])
    tr = triads(
        d,
        m,
        "none",
        d.one([("p q r", "ax ay az", "m"), ("P Q R", "Ax Ay Az", "m"), ("p q r", "fx fy fz", "m")]),
        gu,
        "m/s2",
    )
    c = clock(d, m.t, rate, "none", "s")
    c.columns[0].name = d.one(["time", "t", "Time"])
    n = len(m.t)
    rpy = m.attitude.as_euler("ZYX")
    states = [Column(x, "", _text(rpy[:, 2 - k], 5)) for k, x in enumerate(("phi", "theta", "psi"))]
    states += [
        Column(x, "", _text(np.cumsum(m.linear[:, k]) / rate, 4)) for k, x in enumerate("uvw")
    ]
    if what == "matlab":
        # save -ascii: no names at all
        cols = [*c.columns, *tr.gyro, *tr.accel]
        for x in cols:
            x.cells = [f"{float(v):.7e}" for v in x.cells]
        how = Layout(sep="  ", header=False, fixed=False)
        made = _plain(d, path, f"MATLAB ascii without names, {gu}", tr, c, cols, how, rate, False)
        made.truth.gyro_quantum += 1e-6 * float(np.abs(m.gyro).max())
        made.truth.accel_quantum += 1e-5
        made.truth.time_tolerance += 1e-4
        return made
    if what == "xplane":
        tr = triads(
            d,
            m,
            "none",
            ("P,rad/s Q,rad/s R,rad/s", "fx,m/s2 fy,m/s2 fz,m/s2", "m"),
            "rad/s",
            "m/s2",
        )
        c.columns[0].name = "_totl,_time"
        return _plain(
            d,
            path,
            "simulator, bars, commas in names",
            tr,
            c,
            [*c.columns, *tr.gyro, *tr.accel],
            Layout(sep=" | ", trailing=True),
            rate,
        )
    if what == "game":
        pose = [
            Column(f"pos_{x}", "", _text(np.cumsum(m.linear[:, k]) / rate**2, 4))
            for k, x in enumerate("xyz")
        ]
        vel = [
            Column(f"vel_{x}", "", _text(np.cumsum(m.linear[:, k]) / rate, 4))
            for k, x in enumerate("xyz")
        ]
        for x, name in zip(tr.gyro, _names("angVel_{x}"), strict=True):
            x.name = name
        for x, name in zip(tr.accel, _names("imu_acc_{x}"), strict=True):
            x.name = name
        frame = Column("frame", "", [str(k) for k in range(n)])
        return _plain(
            d,
            path,
            f"game: position, velocity, angVel, {gu}",
            tr,
            c,
            [frame, *c.columns, *pose, *vel, *tr.gyro, *tr.accel],
            Layout(sep=d.one([",", ";"])),
            rate,
            tr.decidable,
        )
    how = Layout(
        sep=d.one([",", "\t"]),
        preamble=[f"simulation output, dt = {1 / rate:g} s"] if d.odds(0.5) else [],
        comment=d.one(["% ", "# "]),
        comment_header=d.odds(0.3),
    )
    return _plain(
        d,
        path,
        f"simulator: p q r, u v w, phi theta psi, {gu}",
        tr,
        c,
        [*c.columns, *tr.gyro, *tr.accel, *states],
        how,
        rate,
        tr.decidable,
    )


KINDS: dict[Callable[[Draw, Path], Made], float] = {
    table: 46,
    arduino: 9,
    phone: 12,
    mixed: 6,
    wide: 6,
    ros: 5,
    jsonl: 6,
    labview: 2,
    logger: 7,
    simulator: 5,
}


def make(seed: int, folder: Path) -> Made:
    """Write the log of this seed into the folder."""
    d = Draw(np.random.PCG64(np.random.SeedSequence([ROOT, seed])))
    maker = d.one(list(KINDS), list(KINDS.values()))
    ending = {jsonl: ".jsonl", labview: ".lvm"}.get(maker) or d.one(
        [".csv", ".txt", ".log", ".dat", ".tsv"], [70, 20, 5, 2, 0]
    )
    if maker in (arduino, mixed, logger):
        ending = d.one([".csv", ".txt", ".log"], [55, 35, 10])
    return maker(d, Path(folder) / f"log{seed:05d}{ending}")
