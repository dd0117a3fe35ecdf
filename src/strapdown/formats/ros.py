"""Bags of ROS 1 (``.bag``) and ROS 2 (folder, ``.db3``, ``.mcap``), by rosbags.

Messages: sensor_msgs/Imu, NavSatFix, MagneticField and FluidPressure of
https://github.com/ros2/common_interfaces, by REP 103 and REP 145: rad/s, m/s² of specific force, T,
Pa, and a covariance that begins with -1 where a sensor does not measure. The axes are those of the
sensor, which only a tree of transforms relates to the body: they stay open, except in the frame
``base_link``, the body's own (forward, left, up by REP 103 and 105). NavSatFix: deg, m over
the ellipsoid, covariance in m² east, north, up. A TwistStamped (or TwistWithCovarianceStamped) with
the frame and the stamps of the fixes is their velocity, east, north, up. Stamps are those of the
headers, in ns. The reference is INSPVAX or INSPVA of novatel_oem7_msgs.
"""

from __future__ import annotations

import heapq
import re
import shlex
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning, check_choice
from strapdown.formats.clocks import RELATIVE, UNIX, Clock
from strapdown.formats.known_formats import Quantities, solution
from strapdown.formats.recording import NoStreamError, RawLog, calibrated_in, calibrated_mark
from strapdown.formats.signs import Signs, first_bytes
from strapdown.formats.writing import (
    FLU,
    SECOND,
    FileOptions,
    Tables,
    imu_not_held,
    not_held,
    stream_not_held,
    unix_ns,
)
from strapdown.parsers import parse
from strapdown.parsers.limits import library
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import GEODETIC, MAG, POSITION_SD, VELOCITY, VELOCITY_SD, values_of

TITLE = "bag of ROS 1 or ROS 2 (.bag .db3 .mcap, folder)"
MAGIC = {b"#ROSBAG V2.0": ".bag", b"\x89MCAP0\r\n": ".mcap", b"SQLite format 3\0": ".db3"}
IMU, FIX = ("sensor_msgs/msg/Imu",), ("sensor_msgs/msg/NavSatFix",)
FIELD, PRESSURE = ("sensor_msgs/msg/MagneticField",), ("sensor_msgs/msg/FluidPressure",)
TWISTS = tuple(f"geometry_msgs/msg/Twist{w}Stamped" for w in ("WithCovariance", ""))
SOLUTIONS = tuple(f"novatel_oem7_msgs/msg/{m}" for m in ("INSPVAX", "INSPVA"))
STREAMS = {"imu": IMU, "gnss": FIX, "reference": SOLUTIONS, "magnetometer": FIELD}
STREAMS |= {"barometer": PRESSURE}
#: Topic and type of what states that the errors of the inertial sensor were taken off.
MARK, DIAGNOSTICS = "/imu/calibration", ("diagnostic_msgs/msg/DiagnosticArray",)
QUALITY = {-1: 0, 0: 1, 1: 2, 2: 2}  # status of NavSatFix to field 6 of NMEA GGA
LEAST_FORCE = 5.0  # m/s²
MODERN = 10**18  # ns, 2001: a clock since the start of a device never counts so far
Columns = dict[str, NDArray[Any]]


detect = Signs(
    first=rb"\A(?:" + b"|".join(map(re.escape, MAGIC)) + rb")",
    # Of a bag of ROS 2 only a ``.db3`` can lack its tables.
    also=lambda path: _suffix(path) != ".db3" or bool(parse("bags.has_messages", path)),
    folder=lambda path: b"rosbag2_bagfile_information" in first_bytes(path / "metadata.yaml", 4096),
)


def _suffix(path: Path) -> str | None:
    head = first_bytes(path, 16)
    return next((suffix for magic, suffix in MAGIC.items() if head.startswith(magic)), None)


def files_of(path: Path) -> tuple[Path, ...]:
    """List the files of a bag: itself, or those of its folder."""
    return tuple(sorted(p for p in path.iterdir() if p.is_file())) if path.is_dir() else (path,)


def _parsed(function: str, path: Path, **arguments: Any) -> Any:
    """Parse a bag; the library goes by the ending, which a file may have lost."""
    if path.is_dir() or path.suffix == (suffix := _suffix(path)):
        return parse(function, path, **arguments)
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder) / f"bag{suffix}"
        own.symlink_to(path.resolve())
        return parse(function, own, label=path.name, **arguments)


def _read(
    path: Path, stream: str, kinds: Sequence[str], values: str, topic: str | None = None
) -> tuple[Columns, list[Finding], str]:
    """Read one topic: stamps in ns and the `values` (of `parsers.bags`), findings, the clock."""
    findings: list[Finding] = []
    found = _parsed("bags.topics", path)
    if not any(name == topic and kind in kinds for name, kind, _ in found):
        there = sorted({name for name, kind, _ in found if kind in kinds})
        if topic is not None and there:
            check_choice("io.unknown-topic", there, file=path.name, quantity="format", topic=topic)
        topic = _topic(path, stream, found, kinds, findings)
    columns = dict(_parsed("bags.columns", path, topic=topic, kinds=list(kinds), values=values))
    record_time = columns.pop("record")
    if not columns["time"].any():
        add_warning(findings, "io.ros-stamps-of-record", file=path.name, quantity="time")
        columns["time"] = record_time
    clock = UNIX if columns["time"].max(initial=0) > MODERN else RELATIVE
    return columns, findings, clock


def _topic(
    path: Path,
    stream: str,
    found: Sequence[tuple[str, str, int]],
    kinds: Sequence[str],
    findings: list[Finding],
) -> str:
    """Choose the topic of a stream: the raw one of several, else refuse."""
    kind = next((k for k in kinds if any(own == k for _, own, _ in found)), None)
    if kind is None:
        there = {own for _, own, _ in found}
        has = [s for s, types in STREAMS.items() if there & set(types)]
        raise NoStreamError(path.name, stream, TITLE, has or ["other messages"])
    topics = sorted({name for name, own, _ in found if own == kind})
    left = [t for t in topics if "filter" not in t.lower()]
    raw = [t for t in left if "raw" in t.lower().rpartition("/")[2]]
    picked = next((some for some in (topics, left, raw) if len(some) == 1), None)
    if picked is None:
        # The driver's own topic has at least as many messages as one that is made from it.
        count = {t: sum(n for name, _, n in found if name == t) for t in topics}
        most = max(topics, key=lambda topic: count[topic])
        flag = "--gnss-format" if stream == "gnss" else "--format"
        raise DataError(
            "io.ros-topics-of-one-kind",
            file=path.name,
            kind=kind,
            topics=topics,
            first=most,
            flags=f"{flag} {shlex.quote(f'ros:{most}')}",
            keys=f'format = "ros:{most}"',
        )
    if len(topics) > 1:
        note = {"topic": picked[0], "others": [t for t in topics if t != picked[0]]}
        add_note(findings, "io.ros-topic-taken", file=path.name, data=note)
    return str(picked[0])


def _log(
    path: Path, out: Quantities, clock: str, findings: list[Finding], axes: str | None = None
) -> RawLog:
    raw = RawLog.of(path, out, axes=axes, clock=clock, findings=findings)
    raw.files = files_of(path)
    return raw


def read(path: Path, topic: str | None = None) -> RawLog:
    """Read rates and specific force of the topic of type Imu; its orientation is not used."""
    columns, findings, clock = _read(path, "imu", IMU, "imu", topic)
    out: Quantities = {"time": (columns["time"], "ns")}
    for triad, unit in (("gyro", "rad/s"), ("accel", "m/s2")):
        part = {f"{triad}_{a}": (columns[f"{triad}_{a}"], unit) for a in "xyz"}
        with np.errstate(over="ignore"):  # of damaged values, which are infinite then
            size = float(np.median(np.linalg.norm([v for v, _ in part.values()], axis=0)))
        if columns[f"{triad}_none"].all() and not any(v.any() for v, _ in part.values()):
            if triad == "gyro":
                raise DataError("io.ros-not-measured", file=path.name, quantity=triad)
            add_warning(findings, "io.ros-not-measured", file=path.name, quantity=triad)
            continue
        # Some drivers publish acceleration without gravity; nothing falls for half of a recording.
        if triad == "accel" and size < LEAST_FORCE:
            add_warning(
                findings, "io.force-without-gravity", file=path.name, quantity=triad, size=size
            )
            continue
        out |= part
    calibrated = None
    if any(name == MARK and kind in DIAGNOSTICS for name, kind, _ in _parsed("bags.topics", path)):
        said, _, _ = _read(path, "imu", DIAGNOSTICS, "diagnostics", MARK)
        calibrated = calibrated_in(said["text"][0])
    of_body = {str(name).lstrip("/") for name in np.unique(columns["frame"])} == {BASE}
    raw = _log(path, out, clock, findings, "x,-y,-z" if of_body else None)
    raw.calibrated = calibrated
    return raw


def read_fixes(path: Path, topic: str | None = None) -> RawLog:
    """Read the topic of type NavSatFix, with the velocity of the same device if there is one."""
    columns, findings, clock = _read(path, "gnss", FIX, "fix", topic)
    units = {"time": "ns", "lat": "deg", "lon": "deg", "alt": "m"}
    out: Quantities = {q: (columns[q], u) for q, u in units.items()}
    quality = [QUALITY.get(int(s), 0) for s in columns["status"]]
    out["quality"] = (np.array(quality), None)
    sd = np.sqrt(np.where(columns["variance"] > 0.0, columns["variance"], np.nan))
    if np.isfinite(sd).any():
        out |= {f"{n}_sd": (sd[:, k], "m") for k, n in enumerate(("north", "east", "down"))}
    velocity = _velocity(path, columns, findings)
    return _log(path, out | velocity, clock, findings)


def _velocity(path: Path, fixes: Columns, findings: list[Finding]) -> dict[str, Any]:
    """Return velocity and its standard deviation, by the stamps of the fixes."""
    topics = {name for name, kind, _ in _parsed("bags.topics", path) if kind in TWISTS}
    for topic in sorted(topics):
        columns, _, _ = _read(path, "gnss", TWISTS, "twist", topic)
        same, at, of = np.intersect1d(fixes["time"], columns["time"], return_indices=True)
        if same.size < fixes["time"].size / 2 or fixes["frame"][0] != columns["frame"][0]:
            continue
        ned, sd = np.full((2, fixes["time"].size, 3), np.nan)
        ned[at], sd[at] = columns["ned"][of], columns["variance"][of]
        sd = np.sqrt(np.where(sd > 0.0, sd, np.nan))
        note = {"topic": topic, "count": same.size}
        add_note(findings, "io.ros-velocity", file=path.name, data=note)
        out = {f"V{a}": (ned[:, k], "m/s") for k, a in enumerate("NED")}
        stated = np.isfinite(sd).any()
        return out | {f"V{a}_sd": (sd[:, k], "m/s") for k, a in enumerate("NED") if stated}
    if topics:
        left = {"topics": sorted(topics)}
        add_note(findings, "io.ros-twist-left", file=path.name, data=left)
    return {}


def read_reference(path: Path, topic: str | None = None) -> pd.DataFrame:
    """Read the solution of a SPAN system: roll, pitch and azimuth are those of its vehicle."""
    columns, findings, clock = _read(path, "reference", SOLUTIONS, "solution", topic)
    values, time = columns["values"], columns["time"] * 1e-9
    parts = (time, values[:, :3], values[:, 3:6], values[:, 6:])
    return solution(path, parts, Clock(clock), findings)


def read_magnetometer(path: Path, topic: str | None = None) -> RawLog:
    """Read the topic of type MagneticField."""
    columns, findings, clock = _read(path, "magnetometer", FIELD, "magnetometer", topic)
    units = {"time": "ns"} | {f"mag_{a}": "T" for a in "xyz"}
    out: Quantities = {q: (columns[q], u) for q, u in units.items()}
    return _log(path, out, clock, findings)


def read_barometer(path: Path, topic: str | None = None) -> RawLog:
    """Read the topic of type FluidPressure."""
    columns, findings, clock = _read(path, "barometer", PRESSURE, "barometer", topic)
    out: Quantities = {"time": (columns["time"], "ns"), "pressure": (columns["pressure"], "Pa")}
    return _log(path, out, clock, findings)


# Writing: one file of MCAP with the messages of ROS 2, in the order of their stamps.

#: Frame of the body: x forward, y left, z up (REP 103), and its name (REP 105).
BASE, RECEIVER = "base_link", "gnss"
STATUS = {0: -1, 1: 0, 2: 2}  # quality of NMEA GGA to status of NavSatFix; 4 and 5 are as 2
_MICRO = 1e-6  # T
Messages = Iterator[tuple[int, str, str, Any]]


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write a file of MCAP: Imu, NavSatFix with its velocity, MagneticField, FluidPressure.

    Body axes forward, left, up in the frame ``base_link``; stamps in ns since 1970, or of the
    recording's own clock with a warning. The covariance of quantities that are not measured is that
    of REP 145: -1 for orientation and specific force, 0 for accuracies that are not known.

    DataError: the library is missing, or a stamp lies before zero.
    """
    bags, types = library("rosbags.rosbag2", path), library("rosbags.typesys", path)
    store = types.get_typestore(types.Stores.LATEST)
    findings: list[Finding] = []
    topics: list[Messages] = []
    for stream, makers in _MESSAGES.items():
        if stream not in tables:
            continue
        stamps, said = unix_ns(tables[stream], options)
        if stamps[0] < 0:
            source = tables[stream].attrs.get("source")
            raise DataError("io.written-stamp-below-zero", file=source, quantity="time", form="ROS")
        findings += [*said, *_lost(stream, tables[stream])]
        topics += [make(tables[stream], stamps.tolist(), store.types) for make in makers]
    if "reference" in tables:
        findings.append(stream_not_held("MCAP", "reference", tables["reference"]))
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        with bags.Writer(bag, version=9, storage_plugin=bags.StoragePlugin.MCAP) as writer:
            connections: dict[str, Any] = {}
            for at, topic, kind, message in heapq.merge(*topics, key=lambda one: one[0]):
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], at, store.serialize_cdr(message, kind))
        shutil.copyfile(next(bag.glob("*.mcap")), path)
    return findings


def _lost(stream: str, table: pd.DataFrame) -> list[Finding]:
    if stream == "imu":
        return imu_not_held("MCAP", table, mag=True, mark=True)
    if stream == "gnss" and not np.isin(values_of(table, ["quality"]), list(STATUS)).all():
        return [not_held("MCAP", "gnss", "the kind of carrier-phase solution", table)]
    return []


def _header(types: Any, at: int, frame: str) -> Any:
    time = types["builtin_interfaces/msg/Time"](sec=at // SECOND, nanosec=at % SECOND)
    return types["std_msgs/msg/Header"](stamp=time, frame_id=frame)


def _point(types: Any, values: Sequence[float]) -> Any:
    x, y, z = values
    return types["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


def _imu_messages(imu: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    none = np.zeros(9)
    unknown = np.r_[-1.0, np.zeros(8)]
    has = ACCEL[0] in imu.columns
    gyro = (FLU * values_of(imu, GYRO)).tolist()
    accel = (FLU * values_of(imu, ACCEL)).tolist() if has else [[0.0] * 3] * len(stamps)
    level = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    for at, rate, force in zip(stamps, gyro, accel, strict=True):
        message = types[IMU[0]](
            header=_header(types, at, BASE),
            orientation=level,
            orientation_covariance=unknown,
            angular_velocity=_point(types, rate),
            angular_velocity_covariance=none,
            linear_acceleration=_point(types, force),
            linear_acceleration_covariance=none if has else unknown,
        )
        yield at, "/imu/data_raw", IMU[0], message


def _mark_messages(imu: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    for text in calibrated_mark(imu).values():
        name, _, value = text.partition(": ")
        status = types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=0, name=name, message=value, hardware_id="", values=[]
        )
        header = _header(types, stamps[0], BASE)
        yield stamps[0], MARK, DIAGNOSTICS[0], types[DIAGNOSTICS[0]](header=header, status=[status])


def _mag_messages(table: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    if MAG[0] not in table.columns:
        return
    field = (_MICRO * FLU * values_of(table, MAG)).tolist()
    for at, values in zip(stamps, field, strict=True):
        message = types[FIELD[0]](
            header=_header(types, at, BASE),
            magnetic_field=_point(types, values),
            magnetic_field_covariance=np.zeros(9),
        )
        yield at, "/imu/mag", FIELD[0], message


def _variance(sd: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variances east, north, up of standard deviations north, east, down; 0 where not known."""
    return np.where(np.isfinite(sd), sd, 0.0)[:, [1, 0, 2]] ** 2


def _fix_messages(gnss: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    variance = _variance(values_of(gnss, POSITION_SD))
    quality = values_of(gnss, ["quality"])[:, 0].astype(int).tolist()
    service = types["sensor_msgs/msg/NavSatStatus"].SERVICE_GPS
    for k, place in enumerate(values_of(gnss, GEODETIC).tolist()):
        known = variance[k].all()
        state = STATUS.get(quality[k], 2 if quality[k] in (4, 5) else 0)
        message = types[FIX[0]](
            header=_header(types, stamps[k], RECEIVER),
            status=types["sensor_msgs/msg/NavSatStatus"](status=state, service=service),
            latitude=place[0],
            longitude=place[1],
            altitude=place[2],
            position_covariance=np.diag(variance[k]).ravel(),
            position_covariance_type=2 if known else int(variance[k].any()),
        )
        yield stamps[k], "/gnss/fix", FIX[0], message


def _velocity_messages(gnss: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    sd = values_of(gnss, VELOCITY_SD)
    variance = _variance(sd)
    for k, (north, east, down) in enumerate(values_of(gnss, VELOCITY).tolist()):
        if not np.isfinite(sd[k]).any():
            continue
        twist = types["geometry_msgs/msg/Twist"](
            linear=_point(types, (east, north, -down)), angular=_point(types, (0.0, 0.0, 0.0))
        )
        covariance = np.diag([*variance[k], 0.0, 0.0, 0.0]).ravel()
        with_sd = types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=covariance)
        header = _header(types, stamps[k], RECEIVER)
        yield stamps[k], "/gnss/vel", TWISTS[0], types[TWISTS[0]](header=header, twist=with_sd)


def _pressure_messages(table: pd.DataFrame, stamps: list[int], types: Any) -> Messages:
    for at, pressure in zip(stamps, table["pressure"].tolist(), strict=True):
        message = types[PRESSURE[0]](
            header=_header(types, at, BASE), fluid_pressure=pressure, variance=0.0
        )
        yield at, "/air_pressure", PRESSURE[0], message


_MESSAGES: dict[str, tuple[Callable[[pd.DataFrame, list[int], Any], Messages], ...]] = {
    "imu": (_imu_messages, _mag_messages, _mark_messages),
    "gnss": (_fix_messages, _velocity_messages),
    "magnetometer": (_mag_messages,),
    "barometer": (_pressure_messages,),
}
