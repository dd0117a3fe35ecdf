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
from strapdown.errors import DataError, Finding
from strapdown.formats import npy
from strapdown.formats.join import join
from strapdown.formats.recording import RawLog, TruthInSensorAxes

Array = NDArray[np.float64]

POSES = ("global_pose", "global_pos")
SENSORS = {
    "gyro": (("gyro",), "rad/s"),
    "accel": (("accelerometer", "acceleration"), "m/s2"),
    "mag": (("magnetometer", "magnetic"), "uT"),
}
AXES = "x,y,z"
# No interpolation between poses farther apart than this.
LONGEST_STEP = 0.5  # s


def detect(path: Path) -> bool:
    """Whether a folder has the arrays of the gyro."""
    return path.is_dir() and _find(path, "IMU", "gyro", "t") is not None


def read(path: Path) -> RawLog:
    """Read gyro, accelerometer, magnetometer and, if present, the pose as truth.

    Parameters
    ----------
    path : Path
        The folder of a segment, its ``processed_log``, or the folder of the arrays.

    Returns
    -------
    RawLog
        The truth is at the gyro sample nearest to each camera frame.

    Raises
    ------
    DataError
        An array is damaged or has the wrong shape.
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
    time, values = npy.load(t, f"{name}/{t.name}"), npy.load(value, label)
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
    times, positions, q_ed = (npy.load(f, f"{name}/{f.name}") for f in files)
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
        raw.findings.append(
            Finding("io.left-out-poses-hold-no", file=name, quantity="attitude", severity="note")
        )
        return None, files
    lat_deg, lon_deg, _ = frames.geodetic_from_ecef(positions[order]).T
    q_nd = rotation.compose(frames.q_ne(lat_deg, lon_deg), q_ed[order] / norm[order, None])
    sample, q = _at_samples(time, times[order], q_nd)
    truth = np.full((time.size, 4), np.nan)
    truth[sample] = q
    if sample.size:
        off = np.abs(times[order][:, None] - time[sample]).min(axis=0).max()
        raw.findings.append(
            Finding(
                "io.attitude-frames-turned-ecef-north",
                file=name,
                quantity="attitude",
                severity="note",
                size=order.size,
                size_2=sample.size,
                off=off,
            )
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
