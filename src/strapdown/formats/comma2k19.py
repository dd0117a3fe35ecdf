"""Segments of comma2k19: a phone on the windscreen of a car, with its pose in ECEF.

Layout of https://github.com/commaai/comma2k19 (Schafer, Santana, Haden, Biasini,
arXiv:1812.05752): ``processed_log/IMU/gyro/t`` and ``…/value``, ``global_pose/frame_times`` and so
on, each a NumPy array without a suffix; or the same with ``__`` for the slashes and the suffix
``.npy``. Stamps are seconds since the device started; axes forward, right, down; gyro in rad/s
minus Android's bias estimate, accelerometer in m/s², magnetometer in µT. ``frame_orientations``
is the quaternion (w, x, y, z) from the device to ECEF: with it the velocity of the car points along
the device's x axis.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown import frames, rotation
from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats import table_files
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.join import join
from strapdown.formats.recording import NoStreamError, RawLog, TruthInSensorAxes
from strapdown.formats.signs import Signs
from strapdown.formats.wheel_columns import say_wheels
from strapdown.tables.checks import Array

POSES = ("global_pose", "global_pos")
SENSORS = {
    "gyro": (("gyro",), "rad/s"),
    "accel": (("accelerometer", "acceleration"), "m/s2"),
    "mag": (("magnetometer", "magnetic"), "uT"),
}
AXES = "x,y,z"
# No interpolation between poses farther apart than this.
LONGEST_STEP = 0.5  # s


# The arrays of the gyro or of a receiver.
detect = Signs(
    folder=lambda path: _find(path, "IMU", "gyro", "t") is not None or bool(_files_of_fixes(path))
)


def read(path: Path) -> RawLog:
    """Read gyro, accelerometer, magnetometer and, if present, the pose as truth.

    `path`: the folder of a segment, its ``processed_log``, or the folder of the arrays. The truth
    is at the gyro sample nearest to each camera frame.
    """
    name = path.resolve().name
    logs, files = [], []
    for triad, (kinds, unit) in SENSORS.items():
        for kind in kinds:
            t, value = (_find(path, "IMU", kind, part) for part in ("t", "value"))
            if t is None or value is None:
                if t is not None and triad == "gyro":
                    raise DataError("io.values-gyro-not", file=name, quantity="gyro")
                continue
            files += [t, value]
            logs.append(_log(name, kind, triad, unit, t, value))
            break
    raw = join(logs, name, tuple(files))
    truth, used = _truth(path, name, raw)
    return dataclasses.replace(raw, truth=truth, files=(*raw.files, *used))


def _find(path: Path, *parts: str) -> Path | None:
    """Find the file of an array in either layout, in the folder or its ``processed_log``."""
    for candidate in (
        path / ("__".join(parts) + ".npy"),
        path.joinpath(*parts),
        path.joinpath("processed_log", *parts),
    ):
        if candidate.is_file():
            return candidate
    return None


def _log(name: str, kind: str, triad: str, unit: str, t: Path, value: Path) -> RawLog:
    label = f"{name}/{value.name if value.suffix else kind}"
    time, values = (
        table_files.load_numpy(t, f"{name}/{t.name}"),
        table_files.load_numpy(value, label),
    )
    kinds = time.dtype.kind + values.dtype.kind
    if time.ndim != 1 or values.shape != (time.size, 3) or not set(kinds) <= set("iuf"):
        raise DataError(
            "io.stamps-shape-values-numbers-shapes",
            file=label,
            quantity=triad,
            shape=time.shape,
            shape_2=values.shape,
            dtype=values.dtype,
        )
    stated: dict[str, tuple[str, str | None]] = {"t": ("time", "s")}
    return RawLog(
        name=f"{name}/{kind}",
        files=(t, value),
        columns={"t": time} | {f"value[{k}]": values[:, k].copy() for k in range(3)},
        stated=stated | {f"value[{k}]": (f"{triad}_{'xyz'[k]}", unit) for k in range(3)},
        axes=AXES,
    )


def _truth(path: Path, name: str, raw: RawLog) -> tuple[TruthInSensorAxes | None, tuple[Path, ...]]:
    """Return the attitude at the samples nearest to the camera frames."""
    found = [
        next((f for pose in POSES if (f := _find(path, pose, f"frame_{part}"))), None)
        for part in ("times", "positions", "orientations")
    ]
    files = tuple(f for f in found if f is not None)
    if len(files) < 3:
        return None, ()
    times, positions, q_ed = (table_files.load_numpy(f, f"{name}/{f.name}") for f in files)
    shapes = (times.shape, positions.shape, q_ed.shape)
    kinds = "".join(array.dtype.kind for array in (times, positions, q_ed))
    if (
        times.ndim != 1
        or shapes[1:] != ((times.size, 3), (times.size, 4))
        or not set(kinds) <= set("iuf")
    ):
        raise DataError(
            "io.times-positions-orientations-shapes-or",
            file=f"{name}/{files[2].name}",
            quantity="attitude",
            shapes=shapes,
        )
    # Numbers far from a unit quaternion may overflow when squared.
    norm = np.linalg.norm(np.where(np.abs(q_ed) < 2.0, q_ed, np.nan), axis=1)
    distance = np.linalg.norm(np.clip(positions, -frames.FARTHEST, frames.FARTHEST), axis=1)
    on_earth = (distance >= frames.NEAREST) & (distance < frames.FARTHEST)
    good = on_earth & np.isfinite(times) & (np.abs(norm - 1.0) < 0.01)
    order = np.flatnonzero(good)[np.argsort(times[good], kind="stable")]
    order = order[np.diff(times[order], prepend=-np.inf) > 0]
    time = raw.columns[next(n for n, (q, _) in raw.stated.items() if q == "time")]
    if order.size < 2:
        add_note(raw.findings, "io.left-out-poses-hold-no", file=name, quantity="attitude")
        return None, files
    lat_deg, lon_deg, _ = frames.geodetic_from_ecef(positions[order]).T
    q_nd = rotation.compose(frames.q_ne(lat_deg, lon_deg), q_ed[order] / norm[order, None])
    sample, q = _at_samples(time, times[order], q_nd)
    truth = np.full((time.size, 4), np.nan)
    truth[sample] = q
    if sample.size:
        off = np.abs(times[order][:, None] - time[sample]).min(axis=0).max()
        add_note(
            raw.findings,
            "io.attitude-frames-turned-ecef-north",
            file=name,
            quantity="attitude",
            size=order.size,
            size_2=sample.size,
            off=off,
        )
    return TruthInSensorAxes(truth, np.isfinite(truth).all(axis=1)), files


def _at_samples(time: Array, frames: Array, q: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the samples nearest to the frames, and their attitude at a constant rate."""
    usable = np.flatnonzero(np.isfinite(time) & (time >= frames[0]) & (time <= frames[-1]))
    if not usable.size:
        return usable, np.empty((0, 4))
    stamps = time[usable]
    # A faulty clock is refused later; here it must only not mislead the search.
    rank = np.argsort(stamps, kind="stable")
    after = np.clip(np.searchsorted(stamps[rank], frames), 1, max(stamps.size - 1, 1))
    before, after = after - 1, np.minimum(after, stamps.size - 1)
    nearer = frames - stamps[rank][before] <= stamps[rank][after] - frames
    sample = np.unique(usable[rank[np.where(nearer, before, after)]])
    k = np.clip(np.searchsorted(frames, time[sample], side="right") - 1, 0, frames.size - 2)
    step = frames[k + 1] - frames[k]
    near = step <= LONGEST_STEP
    sample, k, step = sample[near], k[near], step[near]
    if not sample.size:
        return sample, np.empty((0, 4))
    share = (time[sample] - frames[k]) / step
    turned = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(q[k]), q[k + 1])
    )
    part = rotation.quaternion_from_rotation_vector(turned * share[:, None])
    return sample, np.asarray(rotation.compose(q[k], part))


# Speed by the wheels.
#
# ``CAN/wheel_speed`` has the speeds of the wheels front left, front right, rear left, rear right in
# m/s, ``CAN/speed`` the car's own in m/s (README, "Log Format"; ``wheel_speeds`` and ``car_speed``
# there), by the stamps of the sensors. Rear wheels neither steer nor drive those cars.


#: Kinds of arrays, the first that is there counts, with the columns of which the mean is used.
CAN = {
    **dict.fromkeys(("wheel_speed", "wheel_speeds"), slice(2, 4)),
    **dict.fromkeys(("speed", "car_speed"), slice(0, 1)),
}


def _files_of_wheels(path: Path) -> tuple[str, tuple[Path, Path]] | None:
    """Find the kind of the wheels' arrays, with their stamps and values."""
    for kind in CAN:
        t, value = (_find(path, "CAN", kind, part) for part in ("t", "value"))
        if t is not None and value is not None:
            return kind, (t, value)
    return None


def read_wheel(path: Path) -> RawLog:
    """Read the mean speed of the rear wheels, else the car's own."""
    name = path.resolve().name
    found = _files_of_wheels(path)
    if found is None:
        raise NoStreamError(name, "wheel", "comma2k19 segment", ["imu"])
    kind, files = found
    labels = [f"{name}/{file.name if file.suffix else f'{kind}/{file.name}'}" for file in files]
    time, values = (table_files.load_numpy(*one) for one in zip(files, labels, strict=True))
    values = values[:, None] if values.ndim == 1 else values
    used = CAN[kind]
    kinds = time.dtype.kind + values.dtype.kind
    wide = values.ndim == 2 and len(values) == time.size and values.shape[1] >= used.stop
    if time.ndim != 1 or not wide or not set(kinds) <= set("iuf"):
        raise DataError(
            "io.stamps-shape-values-numbers-shapes-2",
            file=labels[1],
            quantity="speed",
            shape=time.shape,
            shape_2=values.shape,
            dtype=values.dtype,
            columns=used.stop,
        )
    speed = np.asarray(values[:, used], dtype=np.float64).mean(axis=1)
    raw = RawLog.of(path, {"time": (time, "s"), "speed": (speed, "m/s")}, clock=RELATIVE)
    say_wheels(raw.findings, name, ("rear left", "rear right") if used.stop == 4 else (kind,))
    return dataclasses.replace(raw, files=files)


# Fixes of the segment's receiver, on the clock of the inertial sensors.
#
# ``processed_log/GNSS`` holds ``live_gnss_ublox`` and ``live_gnss_qcom`` (README of comma2k19, "Log
# Format"), each with ``t``, s since the device started, and six columns ``value``: latitude and
# longitude in deg, speed in m/s, UTC, altitude in m, bearing in deg; or the same with ``__`` for
# the slashes and the suffix ``.npy``. UTC counts from 1970, in seconds by the README, in
# milliseconds in the segments. The altitude is above the ellipsoid: in the README's segment the
# camera's pose is 1.1 m below it, and the geoid is 32 m below the ellipsoid there.
#
# ``t`` is when a fix was written, UTC when it was measured, and no fix is written before it is
# measured: the smallest ``t`` minus UTC is the difference of the clocks, including the latency
# common to all fixes. A fix is dated by its UTC plus this difference.


#: The first one present is used: ten fixes per second, and one in two seconds.
RECEIVERS = ("live_gnss_ublox", "live_gnss_qcom")
COLUMNS = 6
#: From this value on UTC is in ms: as seconds it would be in the year 5138.
IN_MS = 1e11


def belongs(path: Path) -> bool:
    """Whether a file is one of the arrays of a receiver."""
    parts = (path.resolve().parent.name, *path.stem.split("__"))
    return path.name.split("__")[-1] in ("t", "value", "t.npy", "value.npy") and any(
        receiver in parts for receiver in RECEIVERS
    )


def files_of(path: Path) -> tuple[Path, ...]:
    """Find the stamps and values of the receiver and of the wheels of a folder."""
    return (*_files_of_fixes(path), *(_files_of_wheels(path) or ("", ()))[1])


def _files_of_fixes(path: Path) -> tuple[Path, ...]:
    """Find the stamps and values of the receiver of a folder; empty if there is none.

    `path`: the folder of a segment, its ``processed_log``, ``GNSS`` in it, the folder of one
    receiver, or the folder of the arrays.
    """
    if not path.is_dir():
        return ()
    own = path.resolve().name
    for receiver in RECEIVERS:
        for folder in (path, path / "GNSS", path / "processed_log" / "GNSS"):
            found = tuple(folder / receiver / part for part in ("t", "value"))
            if all(file.is_file() for file in found):
                return found
        flat = tuple(path / f"GNSS__{receiver}__{part}.npy" for part in ("t", "value"))
        if all(file.is_file() for file in flat):
            return flat
        if own == receiver and (path / "t").is_file() and (path / "value").is_file():
            return path / "t", path / "value"
    return ()


def read_fixes(path: Path) -> Fixes:
    """Read the fixes of a segment.

    Returns without standard deviations. Speed and bearing are converted to velocity north and east;
    down is not measured.
    """
    files = _files_of_fixes(path)
    if not files:
        raise NoStreamError(path.resolve().name, "gnss", "comma2k19 segment", ["imu"])
    t_file, value_file = files
    name = path.resolve().name
    t, value = (
        table_files.load_numpy(file, f"{name}/{file.name}") for file in (t_file, value_file)
    )
    if (
        t.ndim != 1
        or value.shape != (t.size, COLUMNS)
        or not set(t.dtype.kind + value.dtype.kind) <= set("iuf")
    ):
        raise DataError(
            "io.stamps-shape-values-numbers-shapes-2",
            file=f"{name}/{value_file.name}",
            quantity="fixes",
            shape=t.shape,
            shape_2=value.shape,
            dtype=value.dtype,
            columns=COLUMNS,
        )
    if not t.size:
        raise DataError("io.no-fix", file=f"{name}/{value_file.name}")
    lat, lon, speed, utc, alt, bearing = np.asarray(value, dtype=np.float64).T
    findings: list[Finding] = []
    course = np.radians(bearing)
    return Fixes(
        name=name,
        time=_dated(np.asarray(t, dtype=np.float64), utc, name, findings),
        place=np.column_stack([lat, lon, alt]),
        rows=np.arange(1, t.size + 1),
        clock=Clock(RELATIVE),
        velocity=np.column_stack(
            [speed * np.cos(course), speed * np.sin(course), np.full(t.size, np.nan)]
        ),
        findings=findings,
    )


def _dated(t: Array, utc: Array, name: str, findings: list[Finding]) -> Array:
    """Compute when each fix was measured, on the clock of the stamps."""
    if not (np.isfinite(utc).all() and np.isfinite(t).all() and (np.diff(utc) > 0.0).all()):
        add_note(findings, "io.not-every-fix-utc-later", file=name, quantity="time")
        return t
    seconds = utc * 1e-3 if utc.max() > IN_MS else utc
    late = t - seconds
    late -= late.min()
    add_warning(
        findings,
        "io.comma2k19-fixes-dated-by-utc",
        file=name,
        quantity="time",
        late=late.max(),
        median=np.median(late),
    )
    return np.asarray(t - late)
