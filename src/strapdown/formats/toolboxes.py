"""Files of toolboxes of inertial navigation: gnss-ins-sim, NaveGo, PSINS, python-ins."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import csv, hdf5, table_files
from strapdown.formats.clocks import RELATIVE, Clock, with_clock
from strapdown.formats.columns import read_name
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.known_formats import column, lacking, under
from strapdown.formats.recording import NoStreamError, RawLog, StatedStart
from strapdown.formats.signs import Signs, head, while_unchanged
from strapdown.formats.text_columns import decoded, is_comment
from strapdown.parsers import parse
from strapdown.rotation import dcm_from_euler
from strapdown.tables import trajectory_table

Array = NDArray[np.float64]


# Folders of gnss-ins-sim: one table a quantity, and the reference of the simulation.
#
# ``time.csv`` (``time (sec)``), ``gyro-0.csv`` (``gyro_x (deg/s)`` …), ``accel-0.csv``,
# ``mag-0.csv``, ``gps_time.csv``, ``gps-0.csv`` (``gps_lat (deg)`` … ``gps_vD (m/s)``),
# ``ref_pos.csv``, ``ref_vel.csv``, ``ref_att_euler.csv`` (yaw, pitch, roll); a number counts the
# runs of a simulation. Units are in the names. Layout and frames are those of its README and of
# ``ins_data_manager.py`` (https://github.com/Aceinna/gnss-ins-sim, MIT): the body axes are those
# whose attitude to north-east-down is given, forward, right, down; the velocity is along the body
# axes in some versions and north, east, down in others, which the positions decide. In the
# virtual inertial frame (``ref_pos_x (m)``) positions are not on the Earth.


GNSS_INS_SIM_TITLE = "folder of gnss-ins-sim"
_TABLES = re.compile(r"(gyro|accel|mag|gps)-\d+\.csv|ref_\w+\.csv|(gps_)?time\.csv")
NED = {"vN": "VN", "vE": "VE", "vD": "VD"}


def _has_stamps(path: Path) -> bool:
    """Whether the folder, or that of a table, has stamps and a table of a sensor or a reference."""
    folder = _folder(path)
    stamps = head(folder / "time.csv", 64)
    return stamps.startswith("time (sec)") and bool(_streams(folder))


detect_gnss_ins_sim = Signs(
    suffixes=(".csv",), text=r"\A\w+ \(", also=_has_stamps, folder=_has_stamps
)


def _folder(path: Path) -> Path:
    """Return the folder of a simulation: it, or that of one of its tables."""
    return path.parent if path.is_file() and _TABLES.fullmatch(path.name) else path


def files_of_gnss_ins_sim(path: Path) -> tuple[Path, ...]:
    """List the tables that are read; none if this is no such folder."""
    if not detect_gnss_ins_sim(path):
        return ()
    path = _folder(path)
    names = [t.name for k in ("gyro", "accel", "mag", "gps") if (t := _table(path, k))]
    names += ["time.csv", "gps_time.csv", "ref_pos.csv", "ref_vel.csv", "ref_att_euler.csv"]
    return tuple(path / name for name in names if (path / name).is_file())


def read_gnss_ins_sim(path: Path) -> RawLog:
    """Read rates, specific force and magnetic field of the first run."""
    path = _folder(path)
    findings: list[Finding] = []
    time = _columns(path, path / "time.csv", findings)
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (time["time"][0], "s")}
    for kind in ("gyro", "accel", "mag"):
        if table := _first_of_gnss_ins_sim(path, kind, findings):
            columns = _columns(path, table, findings, held["time"][0].size)
            held |= {q: (v, u) for q, (v, u) in columns.items() if q.startswith(kind)}
    if "gyro_x" not in held:
        raise lacking(path, "imu", GNSS_INS_SIM_TITLE, _streams(path))
    return _log_of_gnss_ins_sim(path, held, axes="x,y,z", findings=findings)


def read_gnss_ins_sim_fixes(path: Path) -> RawLog:
    """Read the fixes of the first run: latitude, longitude, height, velocity."""
    path = _folder(path)
    findings: list[Finding] = []
    table = _first_of_gnss_ins_sim(path, "gps", findings)
    if table is None or not (path / "gps_time.csv").is_file():
        raise lacking(path, "gnss", GNSS_INS_SIM_TITLE, _streams(path))
    time = _columns(path, path / "gps_time.csv", findings)["time"][0]
    held = _columns(path, table, findings, time.size)
    if "lat" not in held:
        raise DataError("io.sim-without-place", file=table.name, quantity="lat")
    visible = path / "gps_visibility.csv"
    if visible.is_file():
        seen = next(iter(_columns(path, visible, findings, time.size).values()))[0]
        held["quality"] = (np.where(seen > 0, 1.0, 0.0), None)
    return _log_of_gnss_ins_sim(path, {"time": (time, "s"), **held}, findings=findings)


def read_gnss_ins_sim_reference(path: Path) -> pd.DataFrame:
    """Read the trajectory of the simulation."""
    path = _folder(path)
    name = path.resolve().name
    findings: list[Finding] = []
    tables = [path / f"ref_{kind}.csv" for kind in ("pos", "vel", "att_euler")]
    if not all(table.is_file() for table in tables):
        raise lacking(path, "reference", GNSS_INS_SIM_TITLE, _streams(path))
    time = _columns(path, path / "time.csv", findings)["time"][0]
    held = [_columns(path, table, findings, time.size) for table in tables]
    place, velocity, euler = (np.column_stack([v for v, _ in h.values()]) for h in held)
    if "lat" not in held[0]:
        raise DataError("io.sim-without-place", file=tables[0].name, quantity="lat")
    euler = euler[:, ::-1]
    turned = np.einsum("nij,nj->ni", dcm_from_euler(np.radians(euler)), velocity)
    moved = _differenced(time, place)
    along_body = np.nansum((turned[1:] + turned[:-1] - 2 * moved) ** 2) < np.nansum(
        (velocity[1:] + velocity[:-1] - 2 * moved) ** 2
    )
    table = trajectory_table(time, place, turned if along_body else velocity, euler, source=name)
    table.attrs["findings"] = tuple(findings)
    return with_clock(table, Clock(RELATIVE))


def _differenced(time: NDArray[Any], place: NDArray[Any]) -> NDArray[Any]:
    """Velocity north, east, down between positions, on a sphere: enough to distinguish frames."""
    lat, radius = np.radians(place[:, 0]), 6.37e6
    north, down = radius * np.diff(lat), -np.diff(place[:, 2])
    east = radius * np.cos(lat[1:]) * np.radians(np.diff(place[:, 1]))
    return np.asarray(np.column_stack([north, east, down]) / np.diff(time)[:, None])


def _streams(path: Path) -> list[str]:
    there = {"imu": "gyro-*.csv", "gnss": "gps-*.csv", "reference": "ref_att_euler.csv"}
    return [stream for stream, name in there.items() if any(path.glob(name))]


def _table(path: Path, kind: str) -> Path | None:
    """Return the table of a sensor with the lowest number."""
    runs = [p for p in path.glob(f"{kind}-*.csv") if p.stem.removeprefix(f"{kind}-").isdecimal()]
    return min(runs, key=lambda p: int(p.stem.rpartition("-")[2]), default=None)


def _first_of_gnss_ins_sim(path: Path, kind: str, findings: list[Finding]) -> Path | None:
    table, count = _table(path, kind), len(list(path.glob(f"{kind}-*.csv")))
    if table is not None and count > 1:
        add_note(findings, "io.first-of-runs", file=table.name, quantity=kind, count=count)
    return table


def _columns(
    path: Path, table: Path, findings: list[Finding], count: int | None = None
) -> dict[str, tuple[NDArray[Any], str | None]]:
    """Return the columns of a table by quantity, with the units of their names."""
    names = head(table).partition("\n")[0].strip()
    # One name with a blank would be taken for two columns.
    raw = under(table, header=names.replace(" (", "("))
    findings += raw.findings
    held = {}
    for name in raw.columns:
        plain, _, said = name.partition("(")
        quantity = plain.strip().removeprefix("gps_").removeprefix("ref_").removeprefix("pos_")
        unit = {"deg": "deg", "rad": "rad", "m": "m", "sec": "s"}.get(
            said.strip(" )"), read_name(name).unit
        )
        held[NED.get(quantity, quantity)] = (np.asarray(column(raw, name)), unit)
    size = next(iter(held.values()))[0].size
    if count is not None and size != count:
        raise raw.fault("io.rows-not-those-of-stamps", sample=size - 1, size=size, count=count)
    return held


def _log_of_gnss_ins_sim(
    path: Path, held: dict[str, tuple[NDArray[Any], str | None]], **stated: Any
) -> RawLog:
    return RawLog.of(path, held, clock=RELATIVE, **stated)


# NaveGo (https://github.com/rodralez/NaveGo): MATLAB structures of sensors, fixes and reference.
#
# A structure with ``t`` (s), ``fb`` (n, 3; specific force in m/s²) and ``wb`` (n, 3; rad/s) about
# body axes forward, right, down is an IMU; with ``t``, ``lat``, ``lon`` (rad), ``h`` (m) and
# ``vel`` (n, 3; north, east, down in m/s) a receiver, where ``stdm`` (m) and ``stdv`` (m/s) are
# the standard deviations of all its fixes; with ``roll``, ``pitch``, ``yaw`` (rad), too, a
# reference. Their names are free; of several of a kind the first is read.


NAVEGO_TITLE = "structures of NaveGo (.mat)"
EULERS = {"roll", "pitch", "yaw"}
FIELDS = {
    "imu": {"t", "fb", "wb"},
    "gnss": {"t", "lat", "lon", "h"},
    "reference": {"t", "lat", "lon", "h", "vel", *EULERS},
}


def _has_structures(path: Path) -> bool:
    """Whether a file of MATLAB has structures with the fields of NaveGo."""
    # Reading a file is dear; most have no structure.
    if hdf5.detect(path):
        fields: dict[str, set[str]] = {}
        for name in hdf5.outline(path)[0]:
            of, _, field = name.rpartition("/")
            fields.setdefault(of, set()).add(field)
        if not any(own >= FIELDS["imu"] or own >= FIELDS["gnss"] for own in fields.values()):
            return False
    elif all(kind != "struct" for _, kind in hdf5.contents_of_matlab(path)):
        return False
    return bool(_kinds(_structures(path)))


detect_navego = Signs(suffixes=(".mat",), also=_has_structures)


def _structures(path: Path) -> dict[str, dict[str, Array]]:
    new = hdf5.detect(path)
    arrays: dict[str, Any] = hdf5.read_arrays(path)[0] if new else hdf5.read_matlab_arrays(path)[0]
    found: dict[str, dict[str, Array]] = {}
    for name, values in arrays.items():
        of, dot, field = name.rpartition("/" if new else ".")
        if dot and np.asarray(values).dtype.kind in "iuf":
            # MATLAB stores columns first, HDF5 rows first.
            found.setdefault(of, {})[field] = np.asarray(
                values.T if new else values, dtype=np.float64
            )
    return found


def _kinds(structures: dict[str, dict[str, Array]]) -> dict[str, list[str]]:
    kinds: dict[str, list[str]] = {}
    for name, fields in structures.items():
        for kind in ("imu", "reference", "gnss"):
            if fields.keys() >= FIELDS[kind]:
                kinds.setdefault(kind, []).append(name)
                break
    return kinds


def _first_of_navego(path: Path, kind: str) -> tuple[dict[str, Array], int, list[Finding]]:
    structures = _structures(path)
    names = _kinds(structures).get(kind, [])
    if not names:
        raise lacking(path, kind, NAVEGO_TITLE, _kinds(structures))
    findings: list[Finding] = []
    if len(names) > 1:
        add_warning(findings, "io.first-of-structures", file=path.name, quantity=kind, names=names)
    fields = structures[names[0]]
    count = fields["t"].size
    for field in FIELDS[kind] | ({"vel"} & fields.keys()):
        width = 3 if field in ("fb", "wb", "vel") else 1
        if fields[field].size != count * width:
            raise DataError(
                "io.rows-not-those-of-stamps",
                file=path.name,
                quantity=f"{names[0]}.{field}",
                size=len(fields[field]),
                count=count,
            )
    return fields, count, findings


def read_navego(path: Path) -> RawLog:
    """Read the rates and specific force of the first IMU."""
    fields, count, findings = _first_of_navego(path, "imu")
    held = {"time": (fields["t"].ravel(), "s")}
    for triad, field, unit in (("gyro", "wb", "rad/s"), ("accel", "fb", "m/s2")):
        block = fields[field].reshape(count, 3)
        held |= {f"{triad}_{a}": (block[:, k], unit) for k, a in enumerate("xyz")}
    return RawLog.of(path, held, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_navego_fixes(path: Path) -> RawLog:
    """Read the fixes of the first receiver."""
    fields, count, findings = _first_of_navego(path, "gnss")
    held: dict[str, tuple[Array, str | None]] = {"time": (fields["t"].ravel(), "s")}
    for quantity, field, unit in (("lat", "lat", "rad"), ("lon", "lon", "rad"), ("alt", "h", "m")):
        held[quantity] = (fields[field].ravel(), unit)
    if "vel" in fields:
        block = fields["vel"].reshape(count, 3)
        held |= {v: (block[:, k], "m/s") for k, v in enumerate(("VN", "VE", "VD"))}
    for field, names, unit in (
        ("stdm", ("north_sd", "east_sd", "down_sd"), "m"),
        ("stdv", ("VN_sd", "VE_sd", "VD_sd"), "m/s"),
    ):
        if fields.get(field, np.empty(0)).size == 3 and (field != "stdv" or "vel" in fields):
            sds = fields[field].ravel()
            held |= {n: (np.full(count, sds[k]), unit) for k, n in enumerate(names)}
    return RawLog.of(path, held, clock=RELATIVE, findings=findings)


def read_navego_reference(path: Path) -> pd.DataFrame:
    """Read the first reference."""
    fields, count, findings = _first_of_navego(path, "reference")
    lat, lon, alt, *euler = (fields[f].ravel() for f in ("lat", "lon", "h", "roll", "pitch", "yaw"))
    table = trajectory_table(
        fields["t"].ravel(),
        np.column_stack([np.degrees(lat), np.degrees(lon), alt]),
        fields["vel"].reshape(count, 3),
        np.degrees(np.column_stack(euler)),
        source=path.name,
    )
    table.attrs["findings"] = tuple(findings)
    return with_clock(table, Clock(RELATIVE))


# Increments of a strapdown unit from the PSINS toolbox (``.imu``).
#
# Its log of a SIMU: ``%`` comments, three lines of header, then six counts per sample:
#
#     pitch, roll, yaw (deg), VE, VN, VU (m/s)        yaw counter-clockwise from north
#     lat, lon (deg), h (m), t0 (s), step (ms), g (m/s²)
#     scale of each gyro (arcsec), of each accelerometer (µg·s)
#
# and its plain matrices: increments in rad and m/s, with the time in the last of seven columns.
# Axes right, forward, up; an increment belongs to the interval that ends at its stamp.


Lines = list[tuple[int, str]]
SUFFIX = ".imu"
#: Which sensor axis points forward, right, down.
AXES = "y,x,-z"
GYROS = [f"dtheta_{a}" for a in "xyz"]
ACCELS = [f"dv_{a}" for a in "xyz"]
_ARCSEC = math.pi / 180.0 / 3600.0
# Header lines: name, and code of the note on their content.
_HEADER = (
    ("attitude and velocity", "io.psins-attitude-line"),
    ("position and clock", "io.psins-position-line"),
    ("scale factors", "io.psins-scales-line"),
)
# Norm of the median specific force of a carried or stationary unit.
_GRAVITY = (9.6, 10.0)  # m/s²
_STEPS = (1e-5, 1.0)  # s


detect_psins = Signs(named=(SUFFIX,))


def read_psins(path: Path) -> RawLog:
    """Read the increments of a strapdown unit.

    Columns ``dtheta_x`` … in rad and ``dv_x`` … in m/s, with ``time`` at the end of each interval.
    A SIMU log is converted with the scale factors and clock of its header, whose position and
    attitude are kept as `StatedStart`. A plain matrix of seven columns is accepted if the last is a
    steady clock and the norm of the velocity increments over a step is that of gravity. Any other
    text is read as a table.
    """
    data = path.read_bytes()
    text, findings = decoded(data, path.name)
    numbered = [(row, line) for row, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in numbered if is_comment(line)]
    lines = [(row, line) for row, line in numbered if not is_comment(line)]
    ended = text.endswith(("\n", "\r"))
    if any("psins" in c.lower() for c in comments):
        return _simu(path, lines, ended, findings)
    return _matrix(path, lines, ended, findings) or csv.parse(data, path.name, (path,))


def _simu(path: Path, lines: Lines, ended: bool, findings: list[Finding]) -> RawLog:
    attitude, place, scales = (_header(path.name, lines, k) for k in range(3))
    start = _start(path.name, attitude, place, (lines[0][0], lines[1][0]))
    t0, step, g = place[3], 1e-3 * place[4], place[5]
    row = lines[1][0]
    if not _STEPS[0] <= step <= _STEPS[1]:
        _refuse(path.name, row, 1, "sampling interval", "io.psins-step", value=place[4])
    if not 9.7 <= g <= 9.9:
        _refuse(path.name, row, 1, "g", "io.psins-gravity", value=g)
    if min(scales) <= 0:
        _refuse(path.name, lines[2][0], 2, "scale factors", "io.psins-scale", value=min(scales))
    counts, rows = _counts(path.name, lines[3:], ended, findings)
    factors: Array = np.array(
        [s * _ARCSEC for s in scales[:3]] + [s * 1e-6 * g for s in scales[3:]]
    )
    stamps = np.asarray(t0 + step * np.arange(1.0, len(counts) + 1.0))
    roll, pitch, heading = start.roll_pitch_heading_deg
    add_note(
        findings,
        "io.header-states-roll-pitch-heading",
        file=path.name,
        quantity="start",
        roll=roll,
        pitch=pitch,
        heading=heading,
        lat_deg=start.lat_deg,
        lon_deg=start.lon_deg,
        alt=start.alt,
    )
    return _log_of_psins(path, stamps, np.asarray(counts * factors), rows, AXES, findings, start)


def _header(file: str, lines: Lines, which: int) -> list[float]:
    """Parse the six numbers of a header line."""
    name, _ = _HEADER[which]
    if len(lines) <= which:
        raise DataError("io.psins-header-cut", file=file, which=which + 1, name=name)
    row, line = lines[which]
    fields = line.split()
    if len(fields) != 6:
        _refuse(
            file, row, which, name, "io.psins-count", count=len(fields), line_of_header=which + 1
        )
    values = [_number(f) for f in fields]
    for text, value in zip(fields, values, strict=True):
        if not math.isfinite(value):
            _refuse(file, row, which, name, "io.psins-number", text=text)
    return values


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _refuse(file: str, row: int, which: int, quantity: str, code: str, **data: Any) -> None:
    """Refuse a value of a header line; the message describes the line."""
    holds = Finding(_HEADER[which][1], severity="note")
    raise DataError(code, file=file, row=row, quantity=quantity, holds=holds, **data)


def _start(
    file: str, attitude: list[float], place: list[float], rows: tuple[int, int]
) -> StatedStart:
    pitch, roll, yaw, east, north, up = attitude
    lat, lon, alt = place[:3]
    if abs(lat) > 90.0:
        _refuse(file, rows[1], 1, "latitude", "io.psins-latitude", value=lat)
    if abs(lon) > 360.0:
        _refuse(file, rows[1], 1, "longitude", "io.psins-longitude", value=lon)
    if abs(pitch) > 90.0:
        _refuse(file, rows[0], 0, "pitch", "io.psins-pitch", value=pitch)
    # Rotations about up, then right, then forward: with yaw reversed the 3-2-1 angles of
    # forward-right-down.
    return StatedStart(lat, lon, alt, (roll, pitch, 0.0 - yaw), (north, east, 0.0 - up))


def _counts(
    file: str, lines: Lines, ended: bool, findings: list[Finding]
) -> tuple[Array, NDArray[np.int64]]:
    """Return the integers of all samples, and their rows in the file."""
    block, rows = _block(file, lines, 6, ended, findings)
    bad = np.argwhere(block != np.round(block))
    if bad.size:
        i, j = (int(k) for k in bad[0])
        raise DataError(
            "io.no-whole-number-simu-log",
            file=file,
            row=int(rows[i]),
            quantity=(GYROS + ACCELS)[j],
            block=block[i, j],
            count=len(np.unique(bad[:, 0])),
        )
    return block, rows


def _matrix(path: Path, lines: Lines, ended: bool, findings: list[Finding]) -> RawLog | None:
    """Return increments in rad and m/s with their time, if plausible; else None."""
    if len(lines) < 3 or any(len(line.split()) != 7 for _, line in lines[:3]):
        return None
    if not all(math.isfinite(_number(f)) for _, line in lines[:3] for f in line.split()):
        return None
    block, rows = _block(path.name, lines, 7, ended, findings)
    time = block[:, 6]
    steps = np.diff(time)
    usual = float(np.median(steps)) if steps.size else 0.0
    steady = _STEPS[0] <= usual <= _STEPS[1] and float(np.mean(abs(steps - usual) < 0.1 * usual))
    if not steady or steady < 0.9:
        return None
    force = float(np.median(np.linalg.norm(block[:, 3:6], axis=1))) / usual
    turned = float(np.median(np.linalg.norm(block[:, :3], axis=1))) / usual
    if not _GRAVITY[0] <= force <= _GRAVITY[1] or not turned < 2.0 * math.pi:
        return None
    up = float(np.median(block[:, 5])) / usual > 0.5 * force
    add_warning(
        findings,
        "io.taken-for-psins" if up else "io.taken-for-psins-axes-open",
        file=path.name,
        severity="note" if up else "warning",
        rate_hz=1.0 / usual,
        force=force,
    )
    return _log_of_psins(path, time, block[:, :6], rows, AXES if up else None, findings, None)


def _block(
    file: str, lines: Lines, width: int, ended: bool, findings: list[Finding]
) -> tuple[Array, NDArray[np.int64]]:
    """Return the numbers of all rows; drop a last row that may have lost digits."""
    if lines and (not ended or len(lines[-1][1].split()) < width):
        add_note(findings, "io.last-line-does-not-end", file=file, row=lines[-1][0])
        lines = lines[:-1]
    if not lines:
        raise DataError("io.header-no-samples-under-2", file=file)
    for row, line in lines:
        if (count := len(line.split())) != width:
            raise DataError("io.numbers-every-sample", file=file, row=row, count=count, width=width)
    try:
        flat = np.array(" ".join(line for _, line in lines).split(), dtype=np.float64)
    except ValueError:
        row, text = next(
            (row, f) for row, line in lines for f in line.split() if math.isnan(_number(f))
        )
        raise DataError("io.text-not-a-number", file=file, row=row, text=text) from None
    return flat.reshape(-1, width), np.array([row for row, _ in lines], dtype=np.int64)


def _log_of_psins(
    path: Path,
    stamps: Array,
    increments: Array,
    rows: NDArray[np.int64],
    axes: str | None,
    findings: list[Finding],
    start: StatedStart | None,
) -> RawLog:
    names = GYROS + ACCELS
    stated = {"time": ("time", "s")}
    stated |= {f"dtheta_{a}": (f"gyro_{a}", "rad") for a in "xyz"}
    stated |= {f"dv_{a}": (f"accel_{a}", "m/s") for a in "xyz"}
    return RawLog(
        name=path.name,
        files=(path,),
        columns={"time": stamps} | {n: increments[:, k] for k, n in enumerate(names)},
        rows=rows,
        stated=stated,
        sampling="mean",
        axes=axes,
        findings=findings,
        start=start,
    )


# Simulation arrays of python-ins (``.npz``): rates, fixes and truth in one archive.
#
# ``time`` s and ``imu`` (n, 6): rates in rad/s and specific force in m/s², forward, right, down,
# at their stamps. ``truth`` (n, 9): latitude, longitude in deg, height in m, velocity north,
# east, down in m/s, roll, pitch, heading in deg. ``fix_time`` s and ``fix`` (m, 3): positions as
# in the truth.


COLUMNS = [*(f"gyro_{a}" for a in "xyz"), *(f"accel_{a}" for a in "xyz")]


def _holds(path: Path, *names: str) -> bool:
    if not path.is_file() or path.suffix.lower() != ".npz":
        return False
    return set(names) <= _names(path)


@while_unchanged(4)
def _names(path: Path) -> frozenset[str]:
    return frozenset(parse("archives.array_names", path))


STREAMS = {"imu": ("time", "imu"), "gnss": ("fix_time", "fix"), "reference": ("time", "truth")}


detect_python_ins = Signs(
    suffixes=(".npz",), also=lambda path: any(_holds(path, *names) for names in STREAMS.values())
)


def _arrays(path: Path, stream: str, width: int) -> tuple[Array, Array]:
    time, values = STREAMS[stream]
    if not _holds(path, time, values):
        there = [name for name, names in STREAMS.items() if _holds(path, *names)]
        raise NoStreamError(path.name, stream, "python-ins arrays", there)
    arrays = table_files.arrays_of(path)
    stamps, block = arrays[time], arrays[values]
    numeric = stamps.dtype.kind in "iuf" and block.dtype.kind in "iuf"
    if not numeric or stamps.ndim != 1 or block.shape != (stamps.size, width):
        raise DataError(
            "io.shapes-n-n-belong",
            file=path.name,
            quantity=f"{time}, {values}",
            shape=stamps.shape,
            shape_2=block.shape,
            width=width,
        )
    return stamps.astype(np.float64), block.astype(np.float64)


def read_python_ins(path: Path) -> RawLog:
    """Read the angular rates and specific force."""
    time, imu = _arrays(path, "imu", len(COLUMNS))
    units = {"gyro": "rad/s", "accel": "m/s2"}
    columns = {n: (imu[:, k], units[n.partition("_")[0]]) for k, n in enumerate(COLUMNS)}
    return RawLog.of(path, {"time": (time, "s"), **columns}, sampling="instantaneous", axes="x,y,z")


def read_python_ins_fixes(path: Path) -> Fixes:
    """Read the fixes; the archive does not state standard deviations."""
    time, place = _arrays(path, "gnss", 3)
    return Fixes(path.name, time, place, np.arange(1, time.size + 1))


def read_python_ins_reference(path: Path) -> pd.DataFrame:
    """Read the trajectory."""
    time, truth = _arrays(path, "reference", 9)
    table = trajectory_table(time, truth[:, :3], truth[:, 3:6], truth[:, 6:], source=path.name)
    table.attrs["findings"] = ()
    return with_clock(table, Clock(RELATIVE))
