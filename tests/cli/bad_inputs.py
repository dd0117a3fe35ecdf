"""Bad input: how to make it, and what is said about it. The manual's page is made of this."""

from __future__ import annotations

import gzip
import io
import struct
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

HEADER = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"


def rows(count: int = 50, step: float = 0.01, start: float = 0.0) -> list[str]:
    return [f"{start + k * step:.6f},0.1,-0.2,{0.01 * k:.3f}" for k in range(count)]


def text(path: Path, lines: list[str], header: str | None = HEADER, end: str = "\n") -> Path:
    path.write_text("\n".join(([header] if header else []) + lines) + end, encoding="utf-8")
    return path


def with_row(number: int, row: str) -> Callable[[Path], Path]:
    """A log whose data row `number`, counted from 0, is replaced."""

    def make(folder: Path) -> Path:
        lines = rows()
        lines[number] = row
        return text(folder / "log.csv", lines)

    return make


def stamps(values: list[str], header: str = HEADER) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        return text(folder / "log.csv", [f"{v},0.1,-0.2,0.3" for v in values], header)

    return make


def turning(header: str, scale: float, force_scale: float = 1.0) -> Callable[[Path], Path]:
    """A slow tumble of 20 s: rates in rad/s over `scale`, gravity in g times `force_scale`."""

    def make(folder: Path) -> Path:
        t = np.arange(2001) * 0.01
        roll, pitch = np.sin(0.9 * t), 0.8 * np.sin(0.6 * t)
        p, q = 0.9 * np.cos(0.9 * t), 0.48 * np.cos(0.6 * t)
        # Rates of roll and pitch in body axes, heading kept: w = (p, q cos, -q sin).
        rates = np.column_stack([p, q * np.cos(roll), -q * np.sin(roll)]) / scale
        force = [np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)]
        table = np.column_stack([t, rates, force_scale * np.transpose(force)])
        lines = [",".join(f"{v:.6f}" for v in row) for row in table]
        return text(folder / "log.csv", lines, header)

    return make


def wrapped(folder: Path) -> Path:
    ticks = [(4294960000 + 10000 * k) % 2**32 for k in range(40)]
    return stamps([str(t) for t in ticks], HEADER.replace("time_s", "time_us"))(folder)


def empty(folder: Path) -> Path:
    (folder / "log.csv").write_bytes(b"")
    return folder / "log.csv"


def empty_mat(folder: Path) -> Path:
    (folder / "log.mat").write_bytes(b"")
    return folder / "log.mat"


def unknown_bytes(folder: Path) -> Path:
    path = folder / "log.xyz"
    path.write_bytes(bytes(range(256)) * 40)
    return path


def unknown_folder(folder: Path) -> Path:
    (folder / "recording").mkdir()
    (folder / "recording" / "notes.txt").write_text("hello")
    return folder / "recording"


def _npy(shape: tuple[int, ...], data: bytes) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    return stream.getvalue() + data


def lying_header(folder: Path) -> Path:
    """The array's own header claims eight terabytes."""
    with zipfile.ZipFile(folder / "log.npz", "w") as archive:
        archive.writestr("time_s.npy", _npy((10,), bytes(80)))
        archive.writestr("gyro_rad_s.npy", _npy((333_333_333_333, 3), bytes(240)))
    return folder / "log.npz"


def lying_directory(folder: Path) -> Path:
    """The archive's directory claims less than unfolds: zeros without end, if one lets them."""
    path = folder / "log.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gyro_rad_s.npy", _npy((100_000, 3), bytes(2_400_000)))
    data = bytearray(path.read_bytes())
    entry = data.rfind(b"PK\x01\x02")
    data[entry + 24 : entry + 28] = struct.pack("<I", 2_000)
    path.write_bytes(bytes(data))
    return path


def bomb(folder: Path) -> Path:
    """A few kilobytes that honestly say they unfold to gigabytes of zeros."""
    path = folder / "log.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("gyro_rad_s.npy", "w", force_zip64=True) as member,
    ):
        member.write(_npy((3_000_000, 3), b""))
        for _ in range(72):
            member.write(bytes(1_000_000))
    return path


def cut_archive(folder: Path) -> Path:
    whole = folder / "whole.npz"
    np.savez(whole, time_s=np.arange(9.0), gyro_rad_s=np.ones((9, 3)))
    (folder / "log.npz").write_bytes(whole.read_bytes()[:-40])
    return folder / "log.npz"


def pickled(folder: Path) -> Path:
    np.savez(folder / "log.npz", gyro_rad_s=np.array([{"run": "me"}, None], dtype=object))
    return folder / "log.npz"


def no_matlab(folder: Path) -> Path:
    (folder / "log.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    return folder / "log.mat"


def deadly_matlab(folder: Path) -> Path:
    """A variable that is said to be complex, and has no imaginary part: SciPy dies of it."""
    path = folder / "log.mat"
    savemat(path, {"gyro": np.ones((50, 3)), "accel": np.ones((50, 3))})
    data = bytearray(path.read_bytes())
    data[145] |= 0x08
    path.write_bytes(data)
    return path


def hdf5_elsewhere(folder: Path) -> Path:
    with h5py.File(folder / "log.h5", "w") as file:
        file["time_s"] = np.arange(50) * 0.01
        file["gyro"] = h5py.ExternalLink("other.h5", "gyro")
    return folder / "log.h5"


def packed_zeros(folder: Path) -> Path:
    packed = {"chunks": (1 << 20,), "compression": "gzip"}
    with h5py.File(folder / "log.h5", "w") as file:
        for name in ("time_s", "gyro_x", "gyro_y", "gyro_z"):
            values = np.zeros(9_000_000)
            values[::97] = 1.0
            file.create_dataset(name, data=values, **packed)
    return folder / "log.h5"


def no_hdf5(folder: Path) -> Path:
    (folder / "log.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(300))
    return folder / "log.h5"


def _sensor_logger(values: str, start: int = 1_707_663_721_345_109_200) -> str:
    """A sensor's table as Sensor Logger writes it; synthetic."""
    head = "time,seconds_elapsed,z,y,x"
    return "\n".join(
        [head, *(f"{start + 10_000_000 * k},{0.01 * k:.2f},{values}" for k in range(50))]
    )


def recording_zip(**members: str) -> Callable[[Path], Path]:
    """A zip as an application on a phone exports it."""

    def make(folder: Path) -> Path:
        with zipfile.ZipFile(folder / "rec.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                archive.writestr(f"{name}.csv", content)
        return folder / "rec.zip"

    return make


def cut_zip(folder: Path) -> Path:
    path = recording_zip(Gyroscope=_sensor_logger("0.1,0.2,0.3"))(folder)
    path.write_bytes(path.read_bytes()[:-40])
    return path


def sensorstream(number: int, line: str) -> Callable[[Path], Path]:
    """A file of Sensorstream IMU+GPS in which one line is replaced."""
    lines = [f"{890 + 0.01 * k:.2f}, 3, 0.1, 0.2, 9.8, 4, 0.1, 0.2, 0.3" for k in range(50)]
    lines[number] = line
    return lambda folder: text(folder / "log.csv", lines, None)


def sensors_on_two_clocks(folder: Path) -> Path:
    (folder / "rec").mkdir()
    text(folder / "rec" / "gyro.csv", rows(), HEADER)
    head = "time_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    text(folder / "rec" / "accel.csv", rows(start=1.7e9), head)
    return folder / "rec"


def cut_array(folder: Path) -> Path:
    (folder / "rec").mkdir()
    np.save(folder / "rec" / "gyro_rad_s.npy", np.ones((50, 3)))
    path = folder / "rec" / "gyro_rad_s.npy"
    path.write_bytes(path.read_bytes()[:-100])
    return folder / "rec"


def no_parquet(folder: Path) -> Path:
    (folder / "log.parquet").write_bytes(b"PAR1" + bytes(100))
    return folder / "log.parquet"


def cut_json(folder: Path) -> Path:
    (folder / "rec.json").write_text('[\n{"sensor": "Gyroscope", "time": "1", "x": "0"},\n{"sen')
    return folder / "rec.json"


SECOND = "43.5861, lon_deg = 39.7215"
THIRD = "43.5868, lon_deg = 39.7242"
CAR = """rate_hz = 100
[motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
manoeuvres = [
  { do = "accelerate", to_m_per_s = 15, duration_s = 8 },
  { do = "turn_left", radius_m = 30 },
]
"""
WAYPOINTS = """[motion]
kind = "waypoints"
speed_m_per_s = 10
waypoints = [
  { lat_deg = 43.5850, lon_deg = 39.7203 },
  { lat_deg = 43.5861, lon_deg = 39.7215 },
  { lat_deg = 43.5868, lon_deg = 39.7242 },
]
"""


def trajectory(
    old: str, new: str, whole: str = CAR, options: tuple[str, ...] = ()
) -> tuple[Callable[[Path], Path], tuple[str, ...], bool, str]:
    """A trajectory's file in which a piece of text is replaced; what follows a case's title."""
    assert whole.count(old) == 1

    def make(folder: Path) -> Path:
        path = folder / "car.toml"
        path.write_text(whole.replace(old, new), encoding="utf-8")
        return path

    return make, options, True, "simulate"


def packed(pack: Callable[[bytes], bytes]) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = folder / "log.csv.gz"
        path.write_bytes(pack("\n".join([HEADER, *rows()]).encode()))
        return path

    return make


def sections(folder: Path) -> Path:
    force = [f"{0.01 * k:.2f},0.1,0.2,9.8" for k in range(20)]
    fixes = [f"{k},48.0,11.0,500.0" for k in range(20)]
    return text(folder / "log.csv", [*force, "time,lat,lon,alt", *fixes], "time_s,ax,ay,az")


@dataclass(frozen=True)
class Case:
    """One bad input.

    `fails` is False where the log is used all the same and a note says what was done.
    """

    title: str
    make: Callable[[Path], Path]
    options: tuple[str, ...] = ()
    fails: bool = True
    command: str = "attitude"


CASES = [
    Case("An empty file", empty),
    Case("An empty binary file", empty_mat),
    Case("A compressed file that was cut", packed(lambda data: gzip.compress(data)[:-20])),
    Case("An archive in an archive", packed(lambda data: gzip.compress(gzip.compress(data)))),
    Case("Tables below each other, none of a gyro", sections),
    Case("A header, and nothing under it", lambda f: text(f / "log.csv", [])),
    Case(
        "A last line that was cut",
        lambda f: text(f / "log.csv", [*rows(), "0.500000,0.1"], end=""),
        fails=False,
    ),
    Case("A line with too many fields", with_row(7, "0.07,0.1,-0.2,0.3,0.4")),
    Case("Text in a column of numbers", with_row(7, "0.07,0.1,off,0.3")),
    Case("NaN", with_row(7, "0.07,0.1,nan,0.3")),
    Case("An empty field", with_row(7, "0.07,0.1,,0.3")),
    Case("A code of a missing value", with_row(7, "0.07,0.1,-9999,0.3")),
    Case("Infinity", with_row(7, "0.07,0.1,inf,0.3")),
    Case("NaN, with --repair", with_row(7, "0.07,0.1,nan,0.3"), ("--repair",), False),
    Case("A stamp twice", with_row(7, "0.06,0.1,-0.2,0.3")),
    Case("A stamp twice, with --repair", with_row(7, "0.06,0.1,-0.2,0.3"), ("--repair",), False),
    Case("Time going back", with_row(7, "0.01,0.1,-0.2,0.3")),
    Case("A clock that wrapped", wrapped),
    Case("A clock that wrapped, with --repair", wrapped, ("--repair",), False),
    Case(
        "Milliseconds that do not say so",
        stamps([str(10 * k) for k in range(50)], HEADER.replace("time_s", "time")),
        fails=False,
    ),
    Case(
        "A clock that could be of two units",
        stamps([str(k) for k in range(50)], HEADER.replace("time_s", "time")),
    ),
    Case(
        "Nanoseconds since 1970 that do not say so",
        stamps(
            [str(1_700_000_000_000_000_000 + 10_000_000 * k) for k in range(50)],
            HEADER.replace("time_s", "time"),
        ),
        fails=False,
    ),
    Case(
        "Nanoseconds since 1970, with --time-unit ns",
        stamps(
            [str(1_700_000_000_000_000_000 + 10_000_000 * k) for k in range(50)],
            HEADER.replace("time_s", "time"),
        ),
        ("--time-unit", "ns"),
        False,
    ),
    Case(
        "A gap of seconds",
        lambda f: text(f / "log.csv", rows(100) + rows(100, start=4.0)),
        fails=False,
    ),
    Case("A log of one sample", lambda f: text(f / "log.csv", rows(1))),
    Case(
        "No unit of the rate",
        lambda f: text(f / "log.csv", rows(), "time_s,gx,gy,gz"),
    ),
    Case(
        "No unit of the rate, and gravity tells it",
        turning("time_s,gx,gy,gz,ax,ay,az", np.pi / 180.0),
        fails=False,
    ),
    Case(
        "Degrees that were called radians, and gravity tells it",
        turning("time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_g,ay_g,az_g", np.pi / 180.0),
    ),
    Case(
        "Increments of each sample without a unit",
        turning("time_s,gx,gy,gz,ax,ay,az", 100.0, 9.80665 / 100.0),
    ),
    Case(
        "The same with their units stated",
        turning("time_s,gx,gy,gz,ax,ay,az", 100.0, 9.80665 / 100.0),
        ("--gyro-unit", "rad", "--accel-unit", "m/s"),
        fails=False,
    ),
    Case(
        "Columns that are named increments, and hold rates",
        turning("time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,ax_g,ay_g,az_g", 1.0),
    ),
    Case(
        "Increments whose unit is not in their names",
        turning("time_s,dtheta_x,dtheta_y,dtheta_z,ax_g,ay_g,az_g", 100.0),
    ),
    Case(
        "Increments that are called values at their stamps",
        turning("time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,ax_g,ay_g,az_g", 100.0),
        ("--sampling", "instantaneous"),
    ),
    Case(
        "A unit that is none",
        lambda f: text(f / "log.csv", rows(), "time_s,gx,gy,gz"),
        ("--gyro-unit", "furlongs"),
    ),
    Case(
        "A word that is no unit, in the heading",
        turning("time_s,gx (foo/s),gy (foo/s),gz (foo/s),ax (g),ay (g),az (g)", 1.0),
    ),
    Case(
        "Degrees that were called radians",
        lambda f: text(f / "log.csv", [f"{0.01 * k:.2f},0,0,{120 + k}" for k in range(50)]),
        fails=False,
    ),
    Case(
        "A gyro at the end of its range",
        lambda f: text(
            f / "log.csv",
            [f"{0.01 * k:.2f},0,0,{min(50.0 * k, 1999.939)}" for k in range(50)],
            "time_s,gx_dps,gy_dps,gz_dps",
        ),
        fails=False,
    ),
    Case("Unknown columns", lambda f: text(f / "log.csv", rows(), "a,b,c,d")),
    Case("Columns without names", lambda f: text(f / "log.csv", rows(), None)),
    Case(
        "Raw counts of a sensor",
        lambda f: text(
            f / "log.csv",
            [f"{10 * k},{100 * k},{-7 * k},{k}" for k in range(50)],
            "millis,gx,gy,gz",
        ),
    ),
    Case(
        "A column that is not there",
        lambda f: text(f / "log.csv", rows(), "time_s,wx,wy,wz"),
        ("--columns", "gyro_x=wxx"),
    ),
    Case(
        "A quantity that is none",
        lambda f: text(f / "log.csv", rows()),
        ("--columns", "gyr_x=wx"),
    ),
    Case(
        "Two columns that could be one quantity",
        lambda f: text(f / "log.csv", [f"{r},0.5" for r in rows()], f"{HEADER},gyro_x_rad_s"),
    ),
    Case("Axes that are none", lambda f: text(f / "log.csv", rows()), ("--axes", "x,y,y")),
    Case(
        "Axes that are a mirror image",
        lambda f: text(f / "log.csv", rows()),
        ("--axes", "x,y,-z"),
        False,
    ),
    Case(
        "A reference point outside the log",
        lambda f: text(f / "log.csv", rows()),
        ("--reference", "7.5 same as start"),
    ),
    Case(
        "A reference file that is not there",
        lambda f: text(f / "log.csv", rows()),
        ("--reference", "thruth.csv"),
    ),
    Case(
        "A reference that is not understood",
        lambda f: text(f / "log.csv", rows()),
        ("--reference", "the end is the start"),
    ),
    Case(
        "A window outside the log",
        lambda f: text(f / "log.csv", rows()),
        ("--from", "5"),
    ),
    Case(
        "Levelling without an accelerometer",
        lambda f: text(f / "log.csv", rows()),
        ("--initial", "level"),
    ),
    Case(
        "A bias from a rest that there is not",
        lambda f: text(f / "log.csv", rows()),
        ("--gyro-bias", "rest"),
    ),
    Case("Rates that are none", lambda f: text(f / "log.csv", rows()), ("--rates", "fast")),
    Case("A negative rate", lambda f: text(f / "log.csv", rows()), ("--rates", "-5")),
    Case(
        "A rate that leaves nothing to judge",
        lambda f: text(f / "log.csv", rows()),
        ("--rates", "1"),
    ),
    Case(
        "Rates that are not a whole part of the log's",
        lambda f: text(f / "log.csv", rows()),
        ("--rates", "70,30"),
        False,
    ),
    Case("A tolerance of nothing", lambda f: text(f / "log.csv", rows()), ("--tolerance-deg", "0")),
    Case("No trials", lambda f: text(f / "log.csv", rows()), ("--trials", "0")),
    Case("A log, to be drawn again", lambda f: text(f / "log.csv", rows()), ("--trials", "3")),
    Case(
        "A log, with the errors of a sensor",
        lambda f: text(f / "log.csv", rows()),
        ("--sensor", "mpu-6050"),
    ),
    Case(
        "Reference points at rests that there are not",
        lambda f: text(f / "log.csv", rows()),
        ("--reference", "rests"),
    ),
    Case(
        "A second log that is not there",
        lambda f: text(f / "log.csv", rows()),
        ("--reference-log", "second.csv"),
    ),
    Case(
        "A library that is none",
        lambda f: text(f / "log.csv", rows()),
        ("--peers", "vqff"),
    ),
    Case(
        "C code into a folder that is not there",
        lambda f: text(f / "log.csv", rows()),
        ("--export", "missing/attitude.c"),
    ),
    Case(
        "C code over something else",
        lambda f: text(f / "log.csv", rows()),
        ("--export", "log.csv", "--force"),
    ),
    Case(
        "An algorithm that is none",
        lambda f: text(f / "log.csv", rows()),
        ("--algorithms", "quaternoin"),
    ),
    Case("No such file", lambda f: f / "lgo.csv"),
    Case("A folder that is no known recording", unknown_folder),
    Case("An unknown format", unknown_bytes),
    Case("An archive that claims more than it holds", lying_header),
    Case("An archive whose directory claims less than it holds", lying_directory),
    Case("An archive that would unfold without measure", bomb),
    Case("An archive that was cut", cut_archive),
    Case("An archive of Python objects", pickled),
    Case("A damaged MATLAB file", no_matlab),
    Case("A damaged HDF5 file", no_hdf5),
    Case("A MATLAB file that ends the library by a signal", deadly_matlab),
    Case("An HDF5 file whose gyro is in another file", hdf5_elsewhere),
    Case("An HDF5 file that unpacks to far more than it stores", packed_zeros),
    Case("An archive of a phone that was cut", cut_zip),
    Case("An archive of something else", recording_zip(Contacts="name,number")),
    Case(
        "A recording of a phone without a gyroscope",
        recording_zip(Accelerometer=_sensor_logger("9.8,0.2,0.3")),
    ),
    Case(
        "An empty member of an archive",
        recording_zip(Gyroscope=_sensor_logger("0.1,0.2,0.3"), Gravity=""),
    ),
    Case(
        "A member of an archive with text among the numbers",
        recording_zip(Gyroscope=_sensor_logger("0.1,0.2,0.3").replace("0.07,0.1", "0.07,off")),
    ),
    Case(
        "A phone of unknown platform",
        recording_zip(
            Gyroscope=_sensor_logger("0.1,0.2,0.3"),
            Accelerometer=_sensor_logger("0.1,0.2,0.3"),
            Gravity=_sensor_logger("9.8,0,0"),
        ),
        fails=False,
    ),
    Case(
        "A sensor that runs for half of the recording",
        recording_zip(
            Gyroscope=_sensor_logger("0.1,0.2,0.3"),
            TotalAcceleration="\n".join(_sensor_logger("9.8,0.2,0.3").splitlines()[:26]),
        ),
        fails=False,
    ),
    Case("Sensors on two clocks", sensors_on_two_clocks),
    Case("Records that were cut", cut_json),
    Case(
        "A line of Sensorstream that is none",
        sensorstream(30, "890.30, 3, 0.1, 0.2, 9.8, 4, 0.1, 0.2"),
    ),
    Case(
        "A line of Sensorstream without a gyroscope",
        sensorstream(30, "890.30, 3, 0.1, 0.2, 9.8"),
        fails=False,
    ),
    Case("An array that was cut", cut_array),
    Case("A damaged Parquet file", no_parquet),
    Case("A trajectory that is no TOML", *trajectory('"car"', '"car')),
    Case("A key of a trajectory that is not known", *trajectory("rate_hz", "rate")),
    Case("A key of a motion that is not known", *trajectory("lon_deg", "long_deg")),
    Case("A key of a motion that is missing", *trajectory("lat_deg = 55.75", "")),
    Case("A motion without its kind", *trajectory('kind = "car"', "")),
    Case("A kind of motion that is not known", *trajectory('"car"', '"cart"')),
    Case("A manoeuvre that is not known", *trajectory('"turn_left"', '"turnleft"')),
    Case("A key of a manoeuvre that is not known", *trajectory("radius_m", "radius")),
    Case("A number of the wrong sign", *trajectory("duration_s = 8", "duration_s = -8")),
    Case("Text for a number", *trajectory("lat_deg = 55.75", 'lat_deg = "55 N"')),
    Case(
        "Latitude and longitude swapped",
        *trajectory("lat_deg = 55.75\nlon_deg = 37.62", "lat_deg = 151.2\nlon_deg = -33.9"),
    ),
    Case("A turn that is too tight for its speed", *trajectory("radius_m = 30", "radius_m = 3")),
    Case("More acceleration than a car has", *trajectory("duration_s = 8", "duration_s = 1")),
    Case("A turn of a vehicle that stands", *trajectory("to_m_per_s = 15", "to_m_per_s = 0")),
    Case(
        "A distance and a duration at once",
        *trajectory('"turn_left", radius_m = 30', '"straight", distance_m = 9, duration_s = 3'),
    ),
    Case("A sensor that is not known", *trajectory("rate_hz = 100", 'sensor = "mpu-6000"')),
    Case("An ellipsoid that is not known", *trajectory("rate_hz = 100", 'ellipsoid = "wgs72"')),
    Case("A rate under which nothing is left", *trajectory("= 100", "= 0.001")),
    Case(
        "A waypoint twice",
        *trajectory(THIRD, SECOND, WAYPOINTS),
    ),
    Case(
        "Waypoints with a time and without",
        *trajectory("39.7242 }", "39.7242, time_s = 50 }", WAYPOINTS),
    ),
    Case(
        "A path that turns back",
        *trajectory(THIRD, "43.5850, lon_deg = 39.7203", WAYPOINTS),
    ),
    Case("A path that is too fast for its bends", *trajectory("= 10", "= 200", WAYPOINTS)),
    Case("Another format than there is", *trajectory("= 100", "= 50", CAR, ("--format", "xls"))),
    Case("A trajectory's file that is not there", lambda f: f / "cart.toml", (), True, "simulate"),
]
