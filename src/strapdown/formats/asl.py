"""ASL dataset layout: EuRoC MAV, TUM VI and others in the same layout.

One folder per sensor, each with ``data.csv``: stamps in ns first, then columns named by a pair of
frames and the frame of the components. ``imu0`` holds ``w_RS_S_x [rad s^-1]`` … and ``a_RS_S_x
[m s^-2]`` …, rates and specific force of the sensor S in its own axes, which depend on the mounting
(x up in EuRoC). ``state_groundtruth_estimate0`` or ``mocap0`` holds the position of S in the
reference frame R, ``p_RS_R_x [m]`` …, and ``q_RS_w []`` …, which rotates S into R (Burri and
others, The EuRoC micro aerial vehicle datasets, Int. J. Robotics Research 35 (2016) 1157-1163;
Schubert and others, The TUM VI benchmark, IROS 2018). z of R is up; the direction of x is not
known.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, add_note
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.columns import read_name
from strapdown.formats.inference.conclusion import differenced
from strapdown.formats.recording import RawLog, TruthInSensorAxes, calibrated_in, calibrated_mark
from strapdown.formats.sensor_folder import file_member, first_line
from strapdown.formats.signs import Signs, first_bytes
from strapdown.formats.tum import poses
from strapdown.formats.writing import (
    FileOptions,
    Tables,
    accel_needed,
    imu_not_held,
    is_trajectory,
    unix_ns,
    write_numbers,
)
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION, VELOCITY, places_of
from strapdown.tables.checks import Array, values_of

DATA = "data.csv"
#: What states frame and noise of a sensor beside its table, and its length at most, bytes.
SENSOR, LONGEST_SENSOR = "sensor.yaml", 1 << 14
IMU = "imu0"
TRUTHS = ("state_groundtruth_estimate0", "mocap0")
TIME = "timestamp"
RATES = {f"w_rs_s_{a}": f"gyro_{a}" for a in "xyz"}
FORCES = {f"a_rs_s_{a}": f"accel_{a}" for a in "xyz"}
TURN = {f"q_rs_{a}": f"q_{a}" for a in "wxyz"}
# R (x forward, y left, z up) from north, east, down: half a turn about x.
Q_NR = np.array([0.0, 1.0, 0.0, 0.0])
# No interpolation between poses farther apart than this.
LONGEST_STEP = 0.1  # s
# Largest tilt of the mean specific force in R. A flight that accelerates and does not decelerate
# within the log tilts it by a few degrees; a z that is not up, by 90 or 180.
MOST_TILT = 15.0  # deg


detect = Signs(
    suffixes=(".csv",),
    text=r"(?i)\A\s*+(?=.*timestamp)(?=.*(?:w_rs_s_x|q_rs_w))",
    also=lambda path: _is_imu(path) or _is_truth(path),
    folder=lambda path: _imu_of(path) is not None or _truth_of(path) is not None,
)


def read(path: Path) -> RawLog:
    """Read rates and specific force; from a folder, with the attitude truth beside them.

    `path`: ``data.csv`` of a sensor or of a ground truth; or the folder ``mav0``, ``imu0``, or the
    parent of ``mav0``. For a ground truth alone, stamps and the attitude.
    """
    if path.is_dir():
        return _folder(path)
    return _truth_table(path, path.name) if _is_truth(path) else _imu_table(path, path.name)


def _imu_of(folder: Path) -> Path | None:
    """Find the table of the inertial sensor, from any of the folders around it."""
    tables = (folder / DATA, folder / IMU / DATA, folder / "mav0" / IMU / DATA)
    return next((t for t in tables if t.is_file() and _is_imu(t)), None)


def _truth_of(folder: Path) -> Path | None:
    """Find the table of a ground truth, from any of the folders around it."""
    around = (folder, folder / "mav0")
    tables = (folder / DATA, *(a / name / DATA for a in around for name in TRUTHS))
    return next((t for t in tables if _is_truth(t)), None)


def _names(path: Path) -> set[str]:
    line = first_line(file_member(path)).lstrip("# ") if path.is_file() else ""
    return {_plain(field) for field in line.split(",")}


def _is_imu(path: Path) -> bool:
    return {TIME, *RATES, *FORCES} <= _names(path)


def _is_truth(path: Path) -> bool:
    return {TIME, *TURN} <= _names(path)


def _plain(name: str) -> str:
    return name.partition("[")[0].strip().lower()


def _imu_table(path: Path, name: str) -> RawLog:
    return _stated(csv.parse(path.read_bytes(), name, (path,)), RATES | FORCES)


def _stated(raw: RawLog, known: dict[str, str]) -> RawLog:
    stated: dict[str, tuple[str, str | None]] = {}
    for column in raw.columns:
        quantity = "time" if _plain(column) == TIME else known.get(_plain(column))
        if quantity is not None:
            unit = read_name(column).unit
            stated[column] = (quantity, unit or "ns" if quantity == "time" else unit)
    # Names over rows that hold no numbers are not taken for names.
    missing = {"time", *known.values()} - {quantity for quantity, _ in stated.values()}
    if missing:
        names = ", ".join(raw.columns)
        raise raw.fault("io.no-column-4", missing=sorted(missing), columns=names)
    return dataclasses.replace(raw, stated=stated)


def _truth_table(path: Path, name: str) -> RawLog:
    """Read stamps and attitude of a ground truth, taking z of R as up and x as north."""
    raw = _stated(csv.parse(path.read_bytes(), name, (path,)), TURN)
    by_quantity = {q: c for c, (q, _) in raw.stated.items()}
    q = np.column_stack([numbers(raw, by_quantity[k], k) for k in TURN.values()]).astype(np.float64)
    norm = np.linalg.norm(np.where(np.abs(q) < 2.0, q, np.nan), axis=1)
    good = np.abs(norm - 1.0) < 0.01
    q_ns = np.full(q.shape, np.nan)
    q_ns[good] = rotation.compose(Q_NR, q[good] / norm[good, None])
    finding = Finding("io.attitude-own-world-z-up", file=name, quantity="attitude", severity="note")
    return dataclasses.replace(
        raw,
        stated={c: said for c, said in raw.stated.items() if said[0] == "time"},
        truth=TruthInSensorAxes(q_ns, good),
        findings=[*raw.findings, finding],
    )


def _folder(path: Path) -> RawLog:
    table = _imu_of(path)
    if table is None and (truth := _truth_of(path)) is not None:
        return _truth_table(truth, path.resolve().name)
    if table is None:
        raise DataError("io.no-imu-data-csv", file=path.resolve().name)
    whole = path.resolve().name
    raw = dataclasses.replace(_imu_table(table, f"{table.parent.name}/{DATA}"), name=whole)
    around = table.parent.parent
    described = table.parent / SENSOR
    if described.is_file():
        by = calibrated_in(first_bytes(described, LONGEST_SENSOR).decode(errors="replace"))
        if by is not None:
            raw = dataclasses.replace(raw, calibrated=by, files=(*raw.files, described))
    # A bundle names every file by its path within the given folder.
    if table.parent == path or (truth := _truth_of(around)) is None:
        return raw
    known = _truth_table(truth, f"{truth.parent.name}/{DATA}")
    q_ns = _at_samples(_seconds(raw, known), _seconds(known, known), known)
    return _with(raw, q_ns, known)


def _seconds(raw: RawLog, origin: RawLog) -> Array:
    """Seconds since the first stamp of a ground truth; whole nanoseconds subtract exactly."""

    def stamps(log: RawLog) -> NDArray[np.generic]:
        column = next(c for c, (q, _) in log.stated.items() if q == "time")
        return numbers(log, column, "time")

    both = differenced(np.concatenate([stamps(origin)[:1], stamps(raw)]))
    return np.asarray((both[1:] - both[0]).astype(np.float64) * 1e-9)


def _at_samples(time: Array, known: Array, truth: RawLog) -> Array:
    """Interpolate attitude to the samples at a constant rate; NaN where no pose is near."""
    from scipy.spatial.transform import Rotation, Slerp

    assert truth.truth is not None
    q_ns = np.full((time.size, 4), np.nan)
    order = np.flatnonzero(truth.truth.scored & np.isfinite(known))
    if order.size:
        # Poses that are not later than all before them are left out.
        latest = np.maximum.accumulate(known[order])
        order = order[np.diff(latest, prepend=-np.inf) > 0]
    if order.size < 2:
        return q_ns
    poses, stamps = truth.truth.q_ns[order], known[order]
    inside = np.flatnonzero((time >= stamps[0]) & (time <= stamps[-1]))
    after = np.clip(np.searchsorted(stamps, time[inside]), 1, stamps.size - 1)
    inside = inside[stamps[after] - stamps[after - 1] <= LONGEST_STEP]
    if inside.size:
        turned = Slerp(stamps, Rotation.from_quat(poses, scalar_first=True))(time[inside])
        q_ns[inside] = turned.as_quat(scalar_first=True)
    return q_ns


def _with(raw: RawLog, q_ns: Array, known: RawLog) -> RawLog:
    """Return the log with the attitude at its samples, if gravity confirms that z is up."""
    findings = [*raw.findings, *known.findings]
    at = np.asarray(np.isfinite(q_ns).all(axis=1))
    force = np.column_stack(
        [
            numbers(raw, c, q).astype(np.float64)
            for a in "xyz"
            for c, (q, _) in raw.stated.items()
            if q == f"accel_{a}"
        ]
    )
    at = np.asarray(at & np.isfinite(force).all(axis=1))
    tilt = np.nan
    if at.any():
        mean = rotation.rotate(q_ns[at], force[at]).mean(axis=0)
        tilt = float(np.degrees(np.arctan2(np.hypot(mean[0], mean[1]), -mean[2])))
    if not tilt <= MOST_TILT:
        add_note(
            findings,
            "io.left-out-attitude-leans" if at.any() else "io.left-out-attitude-far",
            file=known.name,
            quantity="attitude",
            tilt_deg=tilt,
        )
        return dataclasses.replace(raw, findings=findings)
    add_note(
        findings,
        "io.interpolated-samples-specific-force-average",
        file=known.name,
        quantity="attitude",
        at=int(at.sum()),
        size=at.size,
        tilt=tilt,
    )
    return dataclasses.replace(
        raw, truth=TruthInSensorAxes(q_ns, at), files=(*raw.files, *known.files), findings=findings
    )


# Writing: the sensor S has the body axes forward, right, down, and R has x north, y west, z up.

_HEADS = {
    "gyro": [f"w_RS_S_{a} [rad s^-1]" for a in "xyz"],
    "accel": [f"a_RS_S_{a} [m s^-2]" for a in "xyz"],
    "position": [f"p_RS_R_{a} [m]" for a in "xyz"],
    "attitude": [f"q_RS_{a} []" for a in "wxyz"],
    "velocity": [f"v_RS_R_{a} [m s^-1]" for a in "xyz"],
}
_STAMP = "#timestamp [ns]"
_NWU = np.array([1.0, -1.0, -1.0])  # of north, east, down
_YAML = """%YAML:1.0
sensor_type: {kind}
comment: "{comment}"
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
"""


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write a folder ``mav0`` with the tables ``imu0`` and ``state_groundtruth_estimate0``.

    Stamps are whole ns since 1970, or of the recording's own clock with a warning; numbers have
    the fewest digits that reproduce each. An attitude without positions has columns of the
    attitude alone. ``sensor.yaml`` states axes and origin; biases and noise are not stated.
    """
    findings: list[Finding] = []
    if "imu" in tables:
        imu = tables["imu"]
        accel_needed(imu, "EuRoC")
        stamps, said = unix_ns(imu, options)
        findings += [*said, *imu_not_held("EuRoC", imu, mark=True)]
        columns = [stamps, *values_of(imu, [*GYRO, *ACCEL]).T]
        step = float(np.median(np.diff(stamps))) * 1e-9
        said_too = "; ".join(["body axes: forward, right, down", *calibrated_mark(imu).values()])
        _write(path / "mav0" / IMU, "imu", said_too.replace('"', "'"), step)
        _table(path / "mav0" / IMU, ("gyro", "accel"), columns)
    if "reference" in tables:
        truth = tables["reference"]
        stamps, said = unix_ns(truth, options)
        folder = path / "mav0" / TRUTHS[0]
        comment = "R: north, west, up; S: forward, right, down"
        names: tuple[str, ...] = ("attitude",)
        if is_trajectory(truth):
            names = ("position", "attitude", "velocity")
            chosen = dataclasses.replace(options, tum_frame="ned")
            position, q_ws = poses(truth, chosen)
            first = places_of(truth.iloc[:1])[0] if options.origin is None else options.origin
            lat, lon, alt = (float(v) for v in first)
            comment += f"; origin lat lon deg, height m: {lat!r} {lon!r} {alt!r}"
            # The world does not turn with the local level, to which velocities refer.
            q_ns = rotation.quaternion_from_euler(values_of(truth, EULER))
            q_wn = rotation.compose(q_ws, rotation.conjugate(q_ns))
            velocity = rotation.rotate(q_wn, values_of(truth, VELOCITY))
            blocks = [_NWU * position, _in_world(q_ws), _NWU * velocity]
        else:
            blocks = [_in_world(values_of(truth, QUATERNION))]
        findings += said
        step = float(np.median(np.diff(stamps))) * 1e-9 if len(stamps) > 1 else 0.0
        _write(folder, "visual-inertial", comment, step)
        _table(folder, names, [stamps, *np.column_stack(blocks).T])
    return findings


def _in_world(q_ns: Array) -> Array:
    return rotation.compose(rotation.conjugate(Q_NR), q_ns)


def _write(folder: Path, kind: str, comment: str, step: float) -> None:
    folder.mkdir(parents=True)
    rate = f"rate_hz: {1.0 / step:.6g}\n" if step > 0.0 else ""
    text = _YAML.format(kind=kind, comment=comment) + rate
    (folder / SENSOR).write_text(text, encoding="utf-8", newline="\n")


def _table(folder: Path, names: tuple[str, ...], columns: list[NDArray[Any]]) -> None:
    head = ",".join([_STAMP, *(h for name in names for h in _HEADS[name])]) + "\n"
    write_numbers(folder / DATA, columns, head)
