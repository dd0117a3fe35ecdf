"""Readers and writers: one module per format or family of formats, and the registry of readers."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import (
    ConfigError,
    DataError,
    Finding,
    StrapdownError,
    add_warning,
    check_choice,
)
from strapdown.formats import (
    android_events,
    ardupilot,
    asl,
    comma2k19,
    csv,
    data_sets,
    gnss_logger,
    gnss_nmea,
    gnss_pos,
    gopro,
    hdf5,
    imu_makers,
    join,
    kf_gins,
    kitti,
    live_journal,
    loggers,
    novatel,
    phone_apps,
    phyphox,
    px4,
    receivers,
    ros,
    sensor_folder,
    sensor_logger,
    sensorlog,
    sensorstream,
    table_files,
    toolboxes,
    tracks,
    tum,
)
from strapdown.formats.assemble import assemble
from strapdown.formats.find_columns import names_of_fixes, names_of_quantities
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.known_formats import of_one_sensor
from strapdown.formats.recording import NoStreamError, RawLog, ReadOptions, Recording
from strapdown.formats.signs import HEAD, Signs, first_bytes, state_of
from strapdown.formats.vocabularies import BODY_RATES
from strapdown.plugins import plugin, plugins

if TYPE_CHECKING:
    from strapdown.sensors.calibration import SensorCalibration

_log = logging.getLogger("strapdown")

__all__ = [
    "FOREIGN",
    "READERS",
    "STREAMS",
    "Foreign",
    "NoStreamError",
    "ReadOptions",
    "Reader",
    "Recording",
    "files_of",
    "holds",
    "open_stream",
    "read_joined",
    "read_log",
    "read_raw",
    "reader_of",
    "readers_of",
    "recording_of",
]


#: Raw content of a stream: columns, fixes in the units of a Gnss table, or a Trajectory table.
Raw = RawLog | Fixes | pd.DataFrame
#: Names of streams, in the order in which they are shown.
STREAMS = ("imu", "gnss", "reference", "magnetometer", "barometer", "wheel", "heading")
#: In `Reader.streams`: one table of named columns, which hold any of `STREAMS`.
TABLE = "table"
#: Function of a module that reads each.
_FUNCTIONS = {"imu": "read", "gnss": "read_fixes"}
_FUNCTIONS |= {stream: f"read_{stream}" for stream in (*STREAMS[2:], TABLE)}


@dataclass(frozen=True)
class Reader:
    """How one format is recognized and read.

    Attributes
    ----------
    title : str
    detect : callable
        Whether a file or folder is of this format: by its content, then by its name.
    streams : mapping of str to callable
        Reader of each stream that the format may hold, by a name of `STREAMS`, or of `TABLE`. It
        raises `NoStreamError` if this file lacks the stream, and otherwise `DataError` if the file
        is damaged, or not as its format has it.
    files : callable, optional
        Every file that is read for a path; the path itself by default.
    parts : bool
        Whether one file may hold several streams of a name, of which the user chooses one by
        ``NAME:PART`` as format (a topic of a bag); the readers then take a second argument, the
        part or None.
    """

    title: str
    detect: Callable[[Path], bool]
    streams: Mapping[str, Callable[..., Raw]]
    files: Callable[[Path], tuple[Path, ...]] | None = None
    parts: bool = False

    @classmethod
    def of(
        cls,
        module: ModuleType,
        title: str = "",
        name: str = "",
        *,
        table: bool = False,
        **more: Any,
    ) -> Reader:
        """Make the reader of a module whose functions have the names of `_FUNCTIONS`.

        `title`: its ``TITLE`` if not given. Its ``files_of``, if there is one, lists the files.
        `name`: of one of several formats of a module, which is in the names of its functions:
        ``detect_gpx``, ``read_gpx``, ``read_gpx_fixes``. `table`: whether it may hold other streams
        in the columns of a text table.
        """
        have, own = vars(module), f"_{name}" if name else ""
        streams = {
            stream: have[function]
            for stream, plain in _FUNCTIONS.items()
            if (function := plain.replace("read", f"read{own}")) in have
        }
        if table:
            streams[TABLE] = csv.read
        known = title or have[f"{name.upper()}_TITLE" if name else "TITLE"]
        return cls(known, have[f"detect{own}"], streams, have.get(f"files_of{own}"), **more)


#: In the order of detection: formats of known recordings first, general formats last.
READERS: dict[str, Reader] = {
    "live": Reader.of(live_journal),
    "px4": Reader.of(px4),
    "dataflash": Reader.of(ardupilot, name="dataflash"),
    "mavlink": Reader.of(ardupilot, name="mavlink"),
    "mavlogdump": Reader(
        "messages of MAVLink as mavlogdump prints them",
        ardupilot.detect_mavlogdump,
        Reader.of(ardupilot, name="mavlink").streams,
    ),
    "ros": Reader.of(ros, parts=True),
    "novatel": Reader.of(novatel),
    "sbf": Reader.of(receivers, name="sbf"),
    "ubx": Reader.of(receivers, name="ubx"),
    "mpu6050": Reader.of(data_sets, "folder of an MPU-6050 in MATLAB files", name="mpu"),
    "broad": Reader.of(data_sets, "BROAD trial, HDF5 with optical truth", name="broad"),
    "comma2k19": Reader.of(comma2k19, "comma2k19 segment, with its pose as truth"),
    "kitti": Reader.of(kitti, "KITTI raw, folder oxts"),
    "ronin": Reader.of(data_sets, "RoNIN, HDF5 of a phone", name="ronin"),
    "asl": Reader.of(asl, "EuRoC, TUM VI: data.csv of imu0, or folder mav0"),
    "xsens": Reader.of(imu_makers, "Xsens MT Manager export (.txt .csv)", "xsens", table=True),
    "sensorstream": Reader.of(sensorstream, "Sensorstream IMU+GPS"),
    "sensor-logger": Reader.of(sensor_logger, "Sensor Logger: zip, folder, CSV, JSON"),
    "sensorlog": Reader.of(sensorlog, "SensorLog of iOS, wide CSV", table=True),
    "core-motion": Reader.of(phone_apps, "table of Core Motion", name="core_motion"),
    "gnss-logger": Reader.of(gnss_logger, "GnssLogger of Android, device_imu.csv"),
    "gsdc": Reader.of(
        gnss_logger, "Smartphone Decimeter Challenge, ground_truth.csv of 2021", "challenge"
    ),
    "gsdc-raw": Reader(
        "Smartphone Decimeter Challenge, pseudoranges",
        gnss_logger.detect_pseudoranges,
        dict.fromkeys(("imu", "gnss", "reference"), gnss_logger.refuse_pseudoranges),
    ),
    "smartloc": Reader.of(data_sets, "smartLoc, CSV of raw GNSS data", "smartloc"),
    "racechrono": Reader.of(phone_apps, name="racechrono"),
    "vbo": Reader.of(loggers, name="vbo"),
    "flysight": Reader.of(loggers, name="flysight"),
    "gyroflow": Reader.of(loggers, name="gyroflow"),
    "can": Reader(
        "messages of a CAN bus",
        loggers.detect_can,
        dict.fromkeys(("imu", "gnss", "reference"), loggers.refuse_can),
    ),
    "microstrain": Reader.of(imu_makers, name="microstrain"),
    "apdm": Reader.of(imu_makers, name="apdm"),
    "x-imu3": Reader.of(imu_makers, "x-IMU3: CSV, folder", name="xio"),
    "physics-toolbox": Reader.of(phone_apps, name="physics_toolbox"),
    "matlab-mobile": Reader.of(phone_apps, name="matlab_mobile"),
    "matlab-objects": Reader(
        "objects of MATLAB (.mat)",
        phone_apps.detect_matlab_mobile_objects,
        dict.fromkeys(("imu", "gnss", "reference"), phone_apps.refuse_matlab_mobile),
    ),
    "navego": Reader.of(toolboxes, name="navego"),
    "phyphox": Reader.of(phyphox, "phyphox: CSV, zip, folder"),
    "gnss-ins-sim": Reader.of(toolboxes, name="gnss_ins_sim"),
    "gopro": Reader.of(gopro, "GoPro telemetry: GPMF, MP4, JSON"),
    "garmin-fit": Reader.of(tracks, "Garmin FIT (.fit)", name="fit"),
    "gpx": Reader.of(tracks, "GPX track (.gpx)", "gpx"),
    "kml": Reader.of(tracks, "KML track (.kml .kmz)", "kml"),
    "tcx": Reader.of(tracks, "Garmin TCX track (.tcx)", "tcx"),
    "igc": Reader.of(tracks, "flight recorder (.igc)", "igc"),
    "geojson": Reader.of(tracks, "GeoJSON with times (.geojson .json)", "geojson"),
    "dji-srt": Reader.of(tracks, "subtitles of a DJI drone (.SRT)", "dji"),
    "packed": Reader.of(table_files, name="packed"),
    "sensor-folder": Reader.of(sensor_folder),
    "android-events": Reader.of(android_events, "log of Android sensor events, one a row"),
    "labview": Reader.of(table_files, "measurement file of LabVIEW (.lvm)", "labview"),
    "json": Reader.of(table_files, "JSON of samples: lines, list", "json"),
    "excel": Reader.of(table_files, "Excel workbook (.xlsx)", "excel"),
    "inertial-explorer": Reader.of(novatel, name="explorer"),
    "kitti-odometry": Reader.of(kitti, name="odometry"),
    "tum": Reader(tum.TITLE, tum.detect, {"reference": tum.read}),
    "rtklib": Reader("solution of RTKLIB (.pos)", gnss_pos.detect, {"gnss": gnss_pos.read}),
    "nmea": Reader(
        gnss_nmea.TITLE,
        gnss_nmea.detect,
        {"gnss": gnss_nmea.read, "heading": gnss_nmea.read_heading},
    ),
    "kf-gins": Reader(
        "KF-GINS increments, seven columns without a header", kf_gins.detect, {"imu": kf_gins.read}
    ),
    "kf-gins-fixes": Reader(
        "KF-GINS fixes, 7 or 13 columns without a header",
        kf_gins.detect_fixes,
        {"gnss": kf_gins.read_fixes, TABLE: csv.read},
    ),
    "kf-gins-nav": Reader(
        "KF-GINS trajectory, eleven columns (.nav)",
        kf_gins.detect_trajectory,
        {"reference": kf_gins.read_trajectory},
    ),
    "kf-gins-folder": Reader.of(kf_gins, name="folder"),
    "psins": Reader.of(toolboxes, "PSINS increments (.imu)", name="psins"),
    "npy-folder": Reader.of(table_files, "folder of NumPy arrays (.npy)", "numpy_folder"),
    "sensor-table": Reader(
        sensor_folder.TABLE_TITLE, sensor_folder.detect_table, {TABLE: sensor_folder.read_table}
    ),
    "csv": Reader("text table (.csv .txt .tsv .dat)", csv.detect, {TABLE: csv.read}),
    "python-ins": Reader.of(toolboxes, "python-ins arrays: imu, fix, truth (.npz)", "python_ins"),
    "sbet": Reader.of(receivers, name="sbet"),
    "npy": Reader.of(table_files, "NumPy array (.npy)", "numpy_array"),
    "npz": Reader.of(table_files, "NumPy archive (.npz)", "numpy"),
    "parquet": Reader(
        "Parquet (.parquet .pq)", table_files.detect_parquet, {TABLE: table_files.read_parquet}
    ),
    "hdf5": Reader("HDF5 (.h5 .hdf5) and MATLAB v7.3 (.mat)", hdf5.detect, {TABLE: hdf5.read}),
    "foot-mounted": Reader.of(
        data_sets, "unit on a shoe: timestamps, imu_data (.mat)", name="foot"
    ),
    "matlab": Reader("MATLAB up to v7 (.mat)", hdf5.detect_matlab, {TABLE: hdf5.read_matlab}),
}


#: Exceptions that a damaged file can cause in any reader and in the libraries that it uses.
_BROKEN = (
    *(ArithmeticError, AttributeError, LookupError, RuntimeError),
    *(StopIteration, TypeError, ValueError),
)


def readers_of(path: Path) -> Iterator[tuple[str, Reader]]:
    """Yield the readers that recognize a file or folder, those of plug-ins last."""
    data = first_bytes(path, HEAD)
    for name, reader in itertools.chain(READERS.items(), _of_others()):
        try:
            signs = reader.detect
            if signs(path, data) if isinstance(signs, Signs) else signs(path):
                yield name, reader
        except _BROKEN:  # a file that breaks the detection of a format is not of it
            _log.debug("%s: %s", path.name, reader.title, exc_info=True)


def _of_others() -> Iterator[tuple[str, Reader]]:
    """Readers of plug-ins, which are searched for where no reader of ours recognizes a file."""
    others, broken = plugins("reader", Reader)
    for one in broken:
        _log.warning("%s", one)
    yield from others.items()


#: Newest detections, by path: what it was made from, and its result.
_DETECTED: dict[Path, tuple[tuple[Any, ...], tuple[str, Reader]]] = {}
#: Detections that are kept.
_MOST_DETECTED = 64


def reader_of(path: Path) -> tuple[str, Reader | None]:
    """Return the reader that reads a file or folder, the first that recognizes it, and its name.

    A file or folder that did not change since is not detected again.
    """
    state = state_of(path)
    made_from = (state, tuple(READERS.values()))
    if state and path in _DETECTED and _DETECTED[path][0] == made_from:
        return _DETECTED[path][1]
    for name, reader in readers_of(path):
        if state and READERS.get(name) is reader:
            if len(_DETECTED) >= _MOST_DETECTED:
                _DETECTED.clear()
            _DETECTED[path] = (made_from, (name, reader))
        return name, reader
    return "", None


def open_stream(path: str | Path, stream: str, form: str | None = None) -> Raw:
    """Read one stream of a recording as it is in the file.

    `path`: a file, or the folder of a known recording. `stream`: of `STREAMS`. `form`: a key of
    `READERS`, with the part behind a colon if there are several; detected if not given. Returns the
    stream, or the columns of a table, whose names decide. ConfigError: the file does not exist, or
    the format is unknown. NoStreamError: the format is known and holds other streams. DataError:
    the format is not recognized, or the file is damaged.
    """
    path = Path(path)
    if not path.exists():
        code = "io.no-such-log" if stream == "imu" else "io.no-such-file"
        raise ConfigError(code, file=str(path))
    if path.is_file() and path.stat().st_size == 0:
        raise DataError("io.file-empty", file=path.name)
    part = ""
    if form is None:
        form, reader = reader_of(path)
    else:
        form, _, part = form.partition(":")
        reader = READERS.get(form) or plugin("reader", form, Reader)
        if reader is None:
            check_choice("io.unknown-format-of-log", READERS, quantity="format", form=form)
        elif part and not reader.parts:
            raise ConfigError("io.format-without-parts", quantity="format", form=form, part=part)
    if reader is None:
        raise _not_recognized(path)
    for key in (stream, TABLE):
        if key in reader.streams:
            _log.info("%s: read as %s (%s)", path.name, form, reader.title)
            try:
                raw = reader.streams[key](path, *([part or None] if reader.parts else []))
                if isinstance(raw, RawLog) and reader.files is not None:
                    # Of a folder, with those of the stream itself.
                    own = tuple(file for file in raw.files if file.is_file())
                    raw.files = tuple(dict.fromkeys((*reader.files(path), *own))) or raw.files
                if isinstance(raw, RawLog) and stream == "imu" and not raw.stated:
                    raw = of_one_sensor(raw)
                if isinstance(raw, RawLog) and stream == "gnss" and raw.fixes is not None:
                    raw = raw.fixes  # a section of its own
                return raw
            except _BROKEN as error:
                _log.debug("%s", path.name, exc_info=True)
                raise DataError(
                    "io.not-of-format", file=path.name, title=reader.title, reason=repr(error)
                ) from None
    rows = gnss_nmea.rows_beside(path) if form == "nmea" and stream == "imu" else 0
    raise NoStreamError(path.name, stream, reader.title, list(reader.streams), rows)


def holds(path: Path, stream: str) -> bool:
    """Whether a recording is of a format that may hold a stream, beside the columns of a table."""
    _, reader = reader_of(path)
    return reader is not None and stream in reader.streams


def files_of(path: str | Path) -> tuple[Path, ...]:
    """List the files that are read for a path: itself, or those of a folder."""
    given = Path(path)
    _, reader = reader_of(given)
    if reader is not None and reader.files is not None and (files := reader.files(given)):
        return files
    if reader is None or not given.is_dir():
        return (given,)
    found: list[Path] = []
    for stream in reader.streams:
        try:
            raw = open_stream(given, "imu" if stream == TABLE else stream)
        except DataError:  # it may lack a stream of its format
            continue
        found += raw.files if isinstance(raw, RawLog) else ()
    return tuple(dict.fromkeys(found)) or (given,)


def read_raw(path: str | Path, form: str | None = None) -> RawLog:
    """Read the raw columns of inertial sensors, or of a table; see `open_stream`."""
    raw = open_stream(path, "imu", form)
    assert isinstance(raw, RawLog)  # of inertial sensors and tables
    return raw


@dataclass(frozen=True)
class Foreign:
    """A format that is known and not read.

    `way`: how its content gets in: program, or the export of the maker's program. `magics`: first
    bytes; empty if the ending alone identifies the format. `suffixes`: endings; if `magics` are
    given, empty for any. `offset`: where the first bytes are.
    """

    what: str
    way: str
    magics: tuple[bytes, ...] = ()
    suffixes: tuple[str, ...] = ()
    offset: int = 0


#: Formats that are recognized to say how they get in; the first that fits decides.
FOREIGN = (
    Foreign(
        "a blackbox log of Betaflight, Cleanflight or INAV",
        "blackbox_decode --unit-acceleration m/s2 --unit-rotation deg/s LOG, which writes CSV",
        (b"H Product:Blackbox",),
    ),
    Foreign(
        "packets of an OpenIMU or another unit of Aceinna",
        "the parser of python-openimu (openimu parse), which writes CSV",
        tuple(b"UU" + kind for kind in (b"z1", b"a1", b"a2", b"s1", b"s2", b"e1", b"e2", b"zT")),
    ),
    Foreign(
        "a log of a DJI aircraft", "DatCon, which writes CSV", (b"BUILD",), (".dat",), offset=16
    ),
    Foreign("a binary log of Xsens", "MT Manager, exported as text", (b"\xfa\xff",), (".mtb",)),
    Foreign("a measurement file MDF", "asammdf, exported as CSV or MATLAB", (b"MDF     ",)),
    Foreign("a bus log of Vector (BLF)", "python-can, exported as CSV", (b"LOGG",)),
    Foreign("a TDMS file of LabVIEW", "npTDMS, exported as CSV", (b"TDSm",)),
    Foreign(
        "observations of a receiver (RINEX)",
        "rnx2rtkp of RTKLIB, which computes a .pos of fixes",
        (b"RINEX VERSION / TYPE", b"CRINEX VERS   / TYPE"),
        offset=60,
    ),
    Foreign(
        "corrections or observations in RTCM 3",
        "convbin and rnx2rtkp of RTKLIB, which compute a .pos of fixes",
        (b"\xd3\x00",),
        (".rtcm", ".rtcm3"),
    ),
    Foreign(
        "a video", "its telemetry: exiftool -ee, or the GPMF track of a GoPro", (b"ftyp",), offset=4
    ),
    Foreign("a workbook of Excel 97", "saved as .xlsx or CSV", (b"\xd0\xcf\x11\xe0",)),
    Foreign("a database of SQLite", "its tables, exported as CSV", (b"SQLite format 3\0",)),
    Foreign(
        "a Python pickle, which is never opened", "numpy.savez or a CSV", (), (".pkl", ".pickle")
    ),
    Foreign("a crash test in the format of NHTSA", "strapdown init crash", (), (".ev5",)),
    Foreign(
        "a compressed file",
        "the file in it, unpacked",
        (b"7z\xbc\xaf", b"Rar!"),
    ),
)


def _foreign(path: Path) -> Foreign | None:
    """Return the known format that is not read, of a file that no reader recognizes."""
    head, suffix = first_bytes(path, 128), path.suffix.lower()
    for one in FOREIGN:
        begins = not one.magics or head[one.offset :].startswith(one.magics)
        if begins and (not one.suffixes or suffix in one.suffixes):
            return one
    return None


#: Most names of a folder that are searched, and that a message lists.
MOST_NAMES, MOST_SHOWN = 200, 6
#: Largest file that is searched for a gyro or an accelerometer, bytes.
MOST_BYTES = 64 * 1024 * 1024


def _not_recognized(path: Path) -> DataError:
    """Make the error for a file or folder of no known format; it names the logs in a folder."""
    if path.is_file():
        if path.suffix.lower() == ".zip":
            sensor_folder.members_of(path)  # refuses an archive of too many tables
        if (other := _foreign(path)) is not None:
            return DataError("io.foreign-format", file=path.name, what=other.what, way=other.way)
        head = first_bytes(path, 8).hex(" ")
        return DataError("io.ending-no-known-format", file=path.name, suffix=path.suffix, head=head)
    inside = sorted(path.iterdir())[:MOST_NAMES]
    found = (p.name for p in inside if _has_sensors(p))
    logs = list(itertools.islice(found, MOST_SHOWN + 1))
    shown = logs or [p.name for p in inside]
    names = ", ".join(shown[:MOST_SHOWN]) + (" …" if len(shown) > MOST_SHOWN else "")
    if not logs:
        return DataError(
            "io.folder-no-known-recording-holds", file=path.resolve().name, names=names or "nothing"
        )
    return DataError(
        "io.folder-of-one-recording" if len(logs) == 1 else "io.folder-of-recordings",
        file=path.resolve().name,
        names=names,
        path=path / logs[0],
    )


def _has_sensors(path: Path) -> bool:
    """Whether a log has a gyro or an accelerometer; a table of fixes has neither."""
    try:
        if reader_of(path)[1] is None:
            return False
        if path.is_file() and path.stat().st_size > MOST_BYTES:
            return True
        raw = read_raw(path)
    except StrapdownError:
        return False
    return any(q.startswith(("gyro", "accel")) for q in names_of_quantities(raw))


def read_joined(paths: Sequence[str | Path], options: ReadOptions | None = None) -> Recording:
    """Read logs of single sensors on one clock into one recording.

    Parameters
    ----------
    paths : sequence of str or Path
        One has the gyro; the others are interpolated to its stamps.
    options : ReadOptions, optional
        User's statements about the logs. A column is named as in its log, or as
        ``log/column``.

    Raises
    ------
    ConfigError
        A file does not exist, an option names a column that no log has, or two logs have the
        same quantity.
    DataError
        A log cannot be used, no log has a gyro, or the clocks do not overlap.
    """
    asked = options or ReadOptions()
    logs = [read_raw(Path(path), asked.format) for path in paths]
    if len(logs) == 1:
        return assemble(logs[0], asked)
    raw = join.join(join.with_columns(logs, asked), " + ".join(log.name for log in logs))
    return assemble(raw, dataclasses.replace(asked, columns={}))


def read_log(path: str | Path, options: ReadOptions | None = None) -> Recording:
    """Read a log into body axes and SI units.

    Parameters
    ----------
    path : str or Path
        A file, or the folder of a known recording.
    options : ReadOptions, optional
        User's statements about the log.

    Raises
    ------
    ConfigError
        The file does not exist, or an option names a column that it does not have.
    DataError
        The log cannot be used; the message names file, row, quantity and remedy.
    """
    asked = options or ReadOptions()
    return recording_of(read_raw(Path(path), asked.format), asked, keep=False)


def recording_of(raw: RawLog, asked: ReadOptions, *, keep: bool = True) -> Recording:
    """Convert raw columns of inertial sensors as `read_log`; a table of another kind is refused.

    `keep`: whether the columns may be converted again; otherwise the recording takes their memory.
    """
    known = {*asked.columns, *names_of_quantities(raw)}
    if not any(q.startswith("gyro") for q in known) and not known.issuperset(BODY_RATES):
        _refuse_other_table(raw)
    if raw.calibrated is not None and asked.calibration is not None:
        given = Path(str(asked.calibration)).name
        raise raw.fault(
            "calibrate.calibrated-twice", "calibration", by=raw.calibrated, calibration=given
        )
    recording = assemble(raw, asked, keep=keep)
    return recording if asked.calibration is None else _calibrated(recording, asked)


def _calibrated(recording: Recording, asked: ReadOptions) -> Recording:
    """Take off the known errors of the sensor, in its own axes; and say what is left."""
    from strapdown.formats.columns import parse_axes
    from strapdown.formats.triad_units import axes_matrix
    from strapdown.sensors.calibration import SensorCalibration

    calibration, imu = SensorCalibration.read(str(asked.calibration)), recording.imu
    letters = str(imu.attrs.get("sensor_axes") or "x,y,z")
    known = calibration.turned(axes_matrix(*parse_axes(letters)))
    warmth = None
    if calibration.temperature is not None:
        from strapdown.formats.aid_table import temperature_of

        warm = temperature_of(recording, recording.files[0], asked.format)
        warmth = None if warm is None else np.interp(imu.index, warm.index, warm)
    imu = known.apply(imu, warmth)
    file = Path(str(asked.calibration))
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    # Name and SHA-256 identify the calibration in what is written.
    imu.attrs["calibrated"] = f"{' '.join(file.name.split())}, sha256 {digest}"
    said = [*known.findings(recording.name, Path(str(asked.calibration)).name)]
    if known.not_observed:
        data = {"calibration": Path(str(asked.calibration)).name, "names": known.missing}
        code = "calibrate.applied-in-part"
        add_warning(said, code, file=recording.name, data=data)
    said += _of_another_sensor(imu, known, recording.name, Path(str(asked.calibration)).name)
    return dataclasses.replace(recording, imu=imu, findings=(*recording.findings, *said))


#: Rate, rad/s, and force beside gravity, m/s², of a calibrated sensor at rest, which it may have
#: beyond what is left: a bias that changes from one switching on to the next, and local gravity.
CHANGED = math.radians(1.0), 0.2


def _of_another_sensor(
    imu: pd.DataFrame, known: SensorCalibration, file: str, calibration: str
) -> list[Finding]:
    """A finding where the longest rest shows errors that the calibration does not leave."""
    from strapdown.sensors.rest import find_rests

    rests = [one for one in find_rests(imu) if one.accel_mean is not None]
    if not rests:
        return []
    rest = max(rests, key=lambda one: one.end - one.start)
    rate = float(np.linalg.norm(rest.gyro_mean))
    force = abs(float(np.linalg.norm(rest.accel_mean or ())) - STANDARD_GRAVITY)
    gyro = CHANGED[0] + 3.0 * max(known.gyro.axis("bias"))
    left = max(known.accel.axis("bias")) + STANDARD_GRAVITY * max(known.accel.axis("scale"))
    if rate <= gyro and force <= CHANGED[1] + 3.0 * left:
        return []
    return [
        Finding(
            "calibrate.of-another-sensor",
            severity="warning",
            file=file,
            calibration=calibration,
            start=rest.start,
            end=rest.end,
            rate=math.degrees(rate),
            force=1e3 * force / STANDARD_GRAVITY,
        )
    ]


def _refuse_other_table(raw: RawLog) -> None:
    """Refuse a table without a gyro that has positions or attitudes; it has another use."""
    known = names_of_quantities(raw)
    if names_of_fixes(raw):
        code = "io.table-of-positions"
    elif {"roll", "pitch", "heading"} <= known or {"q_w", "q_x", "q_y", "q_z"} <= known:
        code = "io.table-of-attitudes"
    else:
        return
    raise raw.fault(code, columns=list(raw.columns), name=raw.name)
