"""A chain for a log: what its samples and its fixes tell of sensor, rest, motion and alignment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.gnss_clock import time_offset, velocity_delay
from strapdown.config.alignment import AxesTable, LogTable
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, Finding
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import Recording, StatedStart
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.alignment_source import body_record
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, VELOCITY_SD
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import index_of, values_of

__all__ = ["CODE_RECEIVER", "Proposal", "propose"]

Array = NDArray[np.float64]

#: Windows in which noise is measured, s, and the share of them that is taken as the quiet one.
WINDOW, QUIET = 2.0, 0.05
#: Beyond so many times the noise of its data sheet a triad shakes, and that is stated in its place.
LOUD = 3.0
NOISE_KEYS = (
    ("gyro", "noise_density_deg_per_sqrt_h", math.radians(1.0) / 60.0),
    ("accel", "noise_density_ug_per_sqrt_hz", 1e-6 * STANDARD_GRAVITY),
)
#: Below it a vehicle stands, above the other its course can be seen, m/s.
STANDS, DRIVES = 0.5, 3.0
#: Beyond so many times its standard deviation no way is apparent only: of a hundred thousand pairs
#: of places at rest four are, exp(-APPARENT**2 / 2).
APPARENT = 4.5
#: A gyro bias that leaves north to be found, and the rest that it takes.
NORTH, LEAST_REST = math.radians(2.0 / 3600.0), 60.0
#: Coarse alignment of a rest takes no more than this of it, s.
COARSE = 100.0
#: An alignment by a course ends when angles are known so well, deg.
WELL = 3.0
#: Of the rules, those that give a gross error no weight keep their accuracy among them; with its
#: scale this one cannot reject for ever. Errors that last make innovations small: they are no sign
#: of a receiver that is better than it says.
RULE = {"kind": "adaptive", "influence": "igg3", "scale": {"lowest": 1.0}}
#: Of fixes that do not say how well they know their places: a code receiver without corrections.
CODE_RECEIVER = GnssOptions(unstated_position_sd=5.0, unstated_velocity_sd=0.3)
#: How far stamps of a receiver may be from the clock of the sensors, s: so much is looked for.
OFFSET_SD = 0.2
#: What the motion tells of clocks is taken where it is so many standard deviations, and a delay
#: where it is at least so long, s; an offset is left to the filter to find to this, s.
SURE, LEAST_DELAY, LEAST_OFFSET_SD = 4.0, 0.01, 0.05
#: Stamps that are off are of another clock, and two quartz clocks run apart: by 50 ppm, which is
#: what a walk of so many s/√s does in the 400 s in which nothing may tell their offset.
APART = 1e-3


@dataclass(frozen=True, eq=False)
class Proposal:
    """A configuration as plain data, and what it rests on.

    Attributes
    ----------
    table : dict
        Of a run of navigation; where only the user knows, there is no key.
    recording : Recording
    imu : DataFrame
        Imu table, body axes.
    gnss : DataFrame or None
        Gnss table, on the clock of the samples.
    rest : float, s
        How long the vehicle stands at the start, as far as it is known.
    noise : tuple of float, (2,), or None
        Of the gyros in rad/s/√Hz, of the accelerometers in m/s²/√Hz, while it is quiet.
    guessed : bool
        Whether the sensor is only the one of the catalogue that is nearest by its noise.
    drives : bool
        Whether it drives fast enough for a course, by the fixes.
    how : str
        Why it is aligned so, in words.
    findings : tuple of Finding
        Of reading.
    """

    table: dict[str, Any]
    recording: Recording
    imu: pd.DataFrame
    gnss: pd.DataFrame | None
    rest: float
    noise: tuple[float, ...] | None
    guessed: bool
    drives: bool
    how: str
    findings: tuple[Finding, ...]


def propose(
    log: LogTable,
    *,
    axes: str | None = None,
    gnss: Path | None = None,
    sensor: str | None = None,
    site: tuple[float, float, float] | None = None,
    heading_deg: float | None = None,
    fixes_as: GnssOptions | None = None,
) -> Proposal:
    """Look through a log and the fixes beside it, and say how it can be navigated by.

    Parameters
    ----------
    log : LogTable
        With a path that can be opened.
    axes : str, optional
        How the sensor's axes lie, as `AxesTable.axes`.
    gnss : Path, optional
    sensor : str, optional
        Of the catalogue, or a file; the nearest of the catalogue by its noise, if not given.
    site : tuple of float, optional
        Latitude and longitude in deg, height in m; that of the fixes, or of the log, if not given.
    heading_deg : float, optional
        Of the body at the start.
    fixes_as : GnssOptions, optional
        How the fixes are read; as those of a code receiver, if not given.

    Returns
    -------
    Proposal

    Raises
    ------
    DataError, ConfigError
        A file cannot be read; the message names file, row and remedy.
    """
    recording, imu, findings = body_record(log, AxesTable(axes=axes))
    table: dict[str, Any] = {"log": log.model_dump(exclude_none=True), "axes": {"axes": axes}}
    fixes = None
    if gnss is not None:
        fixes, shifted = on_clock_of(read_gnss(gnss, fixes_as or CODE_RECEIVER), recording.imu)
        findings = (*findings, *fixes.attrs["findings"], *([shifted] if shifted else []))
    scatter = _scatter(imu)
    # An engine shakes one axis more than another; the quietest one tells of the sensor.
    noise = None if scatter is None else tuple(scatter.quiet.min(axis=1).tolist())
    guessed = sensor is None
    named = sensor or (None if noise is None else _nearest(noise))
    if named is not None:
        # Gyros that find north feel how a vehicle rocks: that is motion, and no noise of theirs.
        shaken = {} if _finds_north(named) else _louder(scatter, named)
        table["sensors"] = {"sensor": named, **shaken}
    place = site or _place(recording.start)
    if place is not None:
        table["site"] = dict(zip(("lat_deg", "lon_deg", "alt_m"), place, strict=True))
    rest, drives = _motion(imu, fixes)
    chosen, how = _alignment(named, rest, drives, heading_deg)
    table |= chosen
    if fixes is not None:
        assert gnss is not None  # whence the fixes are
        table["aiding"] = {
            "gnss": {
                "kind": "gnss",
                "path": str(gnss),
                "lever_arm_m": (0.0, 0.0, 0.0),
                "update_rule": RULE,
                **_taken(fixes),
                **_clock(fixes, imu, drives),
            }
        }
    return Proposal(table, recording, imu, fixes, rest, noise, guessed, drives, how, findings)


@dataclass(frozen=True, eq=False)
class Scatter:
    """Noise densities of a record, axis by axis.

    Attributes
    ----------
    quiet : ndarray, (2, 3)
        Of gyros in rad/s/√Hz and accelerometers in m/s²/√Hz, while it is quiet.
    usual : ndarray, (2, 3)
        Half of the time, what shakes included.
    """

    quiet: Array
    usual: Array


def _scatter(imu: pd.DataFrame) -> Scatter | None:
    """Noise densities; None where the record has none, or is too short."""
    time = index_of(imu)
    if ACCEL[0] not in imu.columns or len(time) < 64:
        return None
    step = float(np.median(np.diff(time)))
    size = max(16, round(WINDOW / step))
    count = len(time) // size
    if count < 3:
        return None
    quiet, usual = np.empty((2, 2, 3))
    for k, columns in enumerate((GYRO, ACCEL)):
        # Second differences leave out what turns and accelerates: of white noise they have six
        # times its variance.
        second = np.diff(values_of(imu, columns), n=2, axis=0)
        second = second[: (len(second) // size) * size].reshape(-1, size, 3)
        sd = np.sqrt(np.square(second).mean(axis=1) / 6.0) * math.sqrt(step)
        quiet[k], usual[k] = np.quantile(sd, QUIET, axis=0), np.median(sd, axis=0)
    return Scatter(quiet, usual) if quiet.min() > 0.0 else None


def _louder(scatter: Scatter | None, sensor: str | None) -> dict[str, dict[str, Any]]:
    """Noise to state in place of a data sheet's, of triads that shake far beyond it."""
    if scatter is None or sensor is None:
        return {}
    known = ImuUncertainty.of_sensor(load_sensor(sensor))
    out: dict[str, dict[str, Any]] = {}
    for k, (triad, key, unit) in enumerate(NOISE_KEYS):
        sheet = np.asarray(getattr(known, triad).axis("noise_density"))
        if (scatter.usual[k] > LOUD * sheet).any():
            stated = np.maximum(scatter.usual[k], sheet) / unit
            out[triad] = {key: tuple(float(f"{x:.2g}") for x in stated)}
    return out


def _nearest(noise: tuple[float, ...]) -> str:
    """The sensor of the catalogue whose noise is nearest, by ratios."""
    best, least = "", math.inf
    for name in SENSORS:
        try:
            known = ImuUncertainty.of_sensor(load_sensor(name))
        except ConfigError:
            continue  # it lacks a triad
        densities = (
            max(known.gyro.axis("noise_density")),
            max(known.accel.axis("noise_density")),
        )
        far = sum(math.log(a / b) ** 2 for a, b in zip(noise, densities, strict=True))
        if far < least:
            best, least = name, far
    return best


def _taken(fixes: pd.DataFrame) -> dict[str, float]:
    keys = {"position_sd_taken": "position_sd_m", "velocity_sd_taken": "velocity_sd_m_per_s"}
    return {key: fixes.attrs[taken] for taken, key in keys.items() if taken in fixes.attrs}


def _place(start: StatedStart | None) -> tuple[float, float, float] | None:
    return None if start is None else (start.lat_deg, start.lon_deg, start.alt)


def _motion(imu: pd.DataFrame, fixes: pd.DataFrame | None) -> tuple[float, bool]:
    """How long it stands at the start, and whether it then drives fast enough to see a course."""
    time = index_of(imu)
    if fixes is None:
        return float(time[-1] - time[0]), False
    at = index_of(fixes)
    within = (at >= time[0]) & (at <= time[-1])
    if within.sum() < 2:
        return 0.0, False
    begins, fastest = _moving(fixes[within])
    rest = float((at[within][begins] if begins is not None else time[-1]) - time[0])
    return max(rest, 0.0), fastest > DRIVES


def _moving(fixes: pd.DataFrame) -> tuple[int | None, float]:
    """Where it first does not stand, and the greatest speed over ground that is sure.

    Of places where the receiver measures no speed: the way between two of them less what their
    errors make of it, over 1, 2, 4 … steps, since one step may be shorter than the errors.
    """
    measured = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
    speed = np.linalg.norm(values_of(fixes, VELOCITY_COLUMNS)[:, :2], axis=1)[measured]
    moving = np.flatnonzero(measured)[speed > STANDS]
    begins = int(moving[0]) if moving.size else None
    fastest = float(speed.max(initial=0.0))
    if measured.all():
        return begins, fastest
    time = index_of(fixes)
    lat, lon, _ = np.radians(values_of(fixes, GEODETIC)).T
    sd = values_of(fixes, POSITION_SD)[:, :2].max(axis=1)
    steps = 1
    while steps < len(time):
        north = (lat[steps:] - lat[:-steps]) * 6.37e6
        east = (lon[steps:] - lon[:-steps]) * 6.37e6 * np.cos(lat[steps:])
        blur = APPARENT * np.hypot(sd[steps:], sd[:-steps])
        least = (np.hypot(north, east) - blur) / (time[steps:] - time[:-steps])
        fastest = max(fastest, float(least.max()))
        moving = np.flatnonzero(least > STANDS)
        # What a shorter way has shown already, a longer one shows with some of the rest before it.
        if moving.size and (begins is None or moving[0] + steps <= begins):
            begins = int(moving[0])
        steps *= 2
    return begins, fastest


def _clock(fixes: pd.DataFrame, imu: pd.DataFrame, drives: bool) -> dict[str, float]:
    """How late the receiver's velocities and stamps are, where the motion tells it."""
    late = velocity_delay(fixes)
    delay = 0.0 if late is None or late.delay < SURE * late.sd else late.delay
    found = time_offset(fixes, imu, delay)
    out = {"velocity_delay_s": round(delay, 3)} if delay > LEAST_DELAY else {}
    if found is None:
        return out | ({"time_offset_sd_s": OFFSET_SD} if drives else {})
    sd = max(2.0 * found.sd, LEAST_OFFSET_SD)
    out |= {"time_offset_s": round(found.offset, 3), "time_offset_sd_s": round(sd, 3)}
    if abs(found.offset) > SURE * found.sd:
        out["time_offset_drift_s_per_sqrt_s"] = APART
    return out


def _alignment(
    sensor: str | None, rest: float, drives: bool, heading_deg: float | None
) -> tuple[dict[str, Any], str]:
    """Coarse and fine alignment that such a record allows, and why."""
    if heading_deg is not None:
        coarse = {"kind": "known_heading", "heading_deg": heading_deg, "sd_deg": 2.0}
        length = min(max(rest, 1.0), 10.0)
        return (
            {"coarse": {**coarse, "duration_s": length}, "fine": {"kind": "none"}},
            f"levelled by {length:g} s, with the heading that is stated",
        )
    if rest >= LEAST_REST and sensor is not None and _finds_north(sensor):
        coarse_s = float(math.floor(min(COARSE, rest / 3.0)))
        fine_s = float(math.floor(min(rest, 600.0) - coarse_s))
        return (
            {
                "coarse": {"kind": "inertial_frame", "duration_s": coarse_s},
                "fine": {"kind": "filter", "duration_s": fine_s},
            },
            f"it stands for {rest:.4g} s, and its gyros can find north",
        )
    if drives:
        return (
            {
                "coarse": {
                    "kind": "gnss_course",
                    "window_s": 60.0,
                    "until_heading_sd_deg": WELL,
                    "until_tilt_sd_deg": _tilt(sensor),
                },
                "fine": {"kind": "none"},
            },
            "by its course, once it drives: its forward axis is taken to point where it goes",
        )
    return (
        {"coarse": {"kind": "known_heading", "duration_s": 10.0}, "fine": {"kind": "none"}},
        "neither a rest with gyros that find north, nor a drive with fixes: the heading is asked",
    )


def _tilt(sensor: str | None) -> float:
    """A tilt that a course can find, deg: accelerometers leave one of their bias over g."""
    if sensor is None:
        return WELL
    bias = max(ImuUncertainty.of_sensor(load_sensor(sensor)).accel.axis("bias"))
    return max(WELL, float(math.ceil(2.0 * math.degrees(bias / STANDARD_GRAVITY))))


def _finds_north(sensor: str) -> bool:
    return max(ImuUncertainty.of_sensor(load_sensor(sensor)).gyro.axis("bias")) <= NORTH
