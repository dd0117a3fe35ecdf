"""Calibration of a sensor from logs in which it rested in many poses and turned between them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import InputFiles, input_files, sensor_file
from strapdown.config.logs import AxesTable, CalibrateSpec, KnownTurn, LogTable
from strapdown.config.toml_text import string
from strapdown.earth import gravity
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.aid_table import but_temperature, stream_beside, temperature_of
from strapdown.progress import Progress, silent
from strapdown.sensors.calibration import (
    ImuCalibration,
    SensorCalibration,
    calibrate_imu,
    correlations,
    sealed_text,
)
from strapdown.sensors.calibration_model import GRAVITY, GRAVITY_SD, PRIOR, CalibrationConditions
from strapdown.sensors.calibration_stops import CalibrationRecord, KnownRotation
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.magnetometer import (
    LEAST,
    LEAST_RESTS,
    MagnetometerCalibration,
    calibrate_by_poses,
    calibrate_magnetometer,
)
from strapdown.sensors.rest import RestStretch, find_rests_of_every_grade
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.alignment_source import body_record
from strapdown.systems.inputs import Memory, SavedRun, refuse_long_span
from strapdown.systems.one_thread import one_thread
from strapdown.tables import MAG
from strapdown.tables.checks import GYRO, Array, index_of, values_of
from strapdown.tables.sample_clock import sample_clock

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure


DEG = math.pi / 180.0
#: Poses that differ by more count as two, rad; a face is up within this, rad.
POSE_APART, FACE_WITHIN = 15.0 * DEG, 20.0 * DEG
#: Distinct poses from which all errors of the accelerometers are observable.
ENOUGH = 9
#: Readings of the field in a rest, and what iron may leave of its direction, deg, for its axes.
LEAST_OF_REST, IRON_KNOWN = 5, 1.0
#: Change of field or vertical, as a share, of a sensor that lies; a motion at most, s.
LIES, LONGEST_MOTION = 0.01, 3.0
#: Gravity by latitude and height: anomalies of the field, m/s²; a stated value, m/s².
ANOMALY, STATED_SD = 5e-4, 2e-4
#: Excess of the force of rests that is worth a warning, m/s² (5 mg); of turns, rad.
LARGE_EXCESS, LARGE_TILT = 0.05, 2.0 * DEG


@dataclass(frozen=True, eq=False, repr=False)
class CalibrateRun(SavedRun):
    """Errors of a sensor with their bounds: in memory until `save` writes page and file.

    Attributes
    ----------
    procedure : str
        ``positions``, ``six-position``, ``turns``, ``rate-table``, or ``magnetometer`` alone.
    calibration : ImuCalibration or None
        Of gyros and accelerometers; None without a rest and a known rotation.
    magnetometer : MagnetometerCalibration or None
    findings : tuple of Finding
    """

    bundle = "strapdown.report.calibrate:CALIBRATE"

    configuration: ClassVar[str] = "spec"

    spec: CalibrateSpec
    name: str
    procedure: str
    calibration: ImuCalibration | None
    magnetometer: MagnetometerCalibration | None
    findings: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...]
    memory: Memory = field(default=Memory({}))

    @property
    def parameters(self) -> pd.DataFrame:
        """One row per parameter: ``value``, ``sd``, ``prior_sd``, ``observed``; SI, sensor axes."""
        found = self.calibration
        if found is None:
            return pd.DataFrame(columns=["parameter", "value", "sd", "prior_sd", "observed"])
        return pd.DataFrame(
            {
                "parameter": found.names,
                "value": found.values,
                "sd": found.sd,
                "prior_sd": found.prior_sd,
                "observed": found.observed,
            }
        )

    def to_pandas(self) -> pd.DataFrame:
        """The parameters; as `parameters`."""
        return self.parameters

    @property
    def sensor(self) -> SensorCalibration:
        """The calibration as a file has it; ``read_imu(…, calibration=…)`` takes the file."""
        if self.calibration is None:
            raise DataError("calibrate.magnetometer-alone", quantity="calibration")
        return SensorCalibration.of(self.calibration, self.magnetometer)

    def calibration_text(self) -> str:
        """The file ``calibration.toml``."""
        return _text(self)

    def plot(self) -> ChartFigure:
        """Draw the errors with their 95 % bounds.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.
        """
        from strapdown.report.calibrate import bounds_chart
        from strapdown.report.chart_svg import ChartFigure

        chart = bounds_chart(self)
        if chart is None:
            raise DataError("calibrate.magnetometer-alone", quantity="calibration")
        return ChartFigure(chart)

    def __repr__(self) -> str:
        found = self.calibration
        shown = "" if found is None else f", {int(found.observed.sum())} of {len(found.names)}"
        return f"<CalibrateRun {self.name}, {self.procedure}{shown} observed>"


@one_thread()
def run_calibrate(spec: CalibrateSpec, progress: Progress = silent) -> CalibrateRun:
    """Calibrate a sensor.

    Parameters
    ----------
    spec : CalibrateSpec
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    DataError
        A log cannot be read, or shows neither rests, nor known rotations, nor a turning field.
    """
    records: list[CalibrationRecord] = []
    fields: list[tuple[Array, Array] | None] = []
    inputs: list[InputFiles] = []
    findings: list[Finding] = []
    names = []
    for k, log in enumerate(spec.logs):
        progress(f"reading {Path(log.path).name}", 0.05 + 0.4 * k / len(spec.logs))
        record, mag, said, files = _read(log)
        records.append(record)
        fields.append(mag)
        findings += said
        names.append(files.path.name)
        inputs.append(files)
    inputs += sensor_file(spec.sensor)
    progress("finding the errors", 0.5)
    iron = _magnetometer(fields)
    magnetometer = iron if iron is not None and iron.significant else None
    procedure = _procedure(spec, records, magnetometer)
    found = None
    if procedure != "magnetometer":
        for record in records:
            if not {"accel_x"} <= set(record.imu.columns):
                raise DataError("calibrate.no-accelerometer", file=record.imu.attrs.get("source"))
        rotations = [_rotation(one, spec, len(records)) for one in spec.turns]
        prior = _prior(spec)
        found = calibrate_imu(records, rotations, prior, _conditions(spec, procedure))
        findings = [*_said(found, spec, names[0]), *findings]
        if iron is not None:
            magnetometer = _by_poses(found, fields) or magnetometer
    name = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    return CalibrateRun(spec, name, procedure, found, magnetometer, tuple(findings), tuple(inputs))


def _read(
    log: LogTable,
) -> tuple[CalibrationRecord, tuple[Array, Array] | None, list[Finding], InputFiles]:
    """Samples of a log in the axes of the sensor, its rests, and its field by time."""
    if log.calibration is not None:
        raise ConfigError("calibrate.calibrated-log", quantity="calibration")
    recording, imu, said = body_record(log, AxesTable(axes="x,y,z"))
    if "calibrated" in imu.attrs:
        by = imu.attrs["calibrated"]
        raise DataError("calibrate.calibrated-log-by", file=recording.name, by=by)
    refuse_long_span(imu, recording.name)
    # The axes of a sensor need not be those of a body.
    findings = [f for f in said if not f.code.startswith("io.axes")]
    clock = sample_clock(index_of(imu), values_of(imu, GYRO))
    if clock.repaired:
        imu = imu.copy()
        imu.index = pd.Index(clock.time, name="time")
    rests: tuple[RestStretch, ...] = find_rests_of_every_grade(imu)
    mag: tuple[Array, Array] | None = None
    if set(MAG) <= set(imu.columns):
        mag = index_of(imu), values_of(imu, MAG)
    else:
        table = stream_beside(log.path, "magnetometer", log.format, imu)
        if table is not None and set(MAG) <= set(table.columns):
            mag = index_of(table), table[MAG].to_numpy(dtype=np.float64)
    warm = temperature_of(recording, log.path, log.format)
    temperature = None
    if warm is not None:
        findings = list(but_temperature(findings, recording))
        temperature = (warm.index.to_numpy(dtype=np.float64), warm.to_numpy(dtype=np.float64))
    files = input_files("log", log.path, recording.files)
    return CalibrationRecord(imu, rests, temperature), mag, findings, files


def _magnetometer(
    fields: Sequence[tuple[Array, Array] | None],
) -> MagnetometerCalibration | None:
    """Hard and soft iron."""
    known = [one[1] for one in fields if one is not None]
    if not known:
        return None
    mag = np.vstack(known)
    if int((np.isfinite(mag).all(axis=1) & mag.any(axis=1)).sum()) < LEAST:
        return None
    return calibrate_magnetometer(mag)


def _by_poses(
    found: ImuCalibration, fields: Sequence[tuple[Array, Array] | None]
) -> MagnetometerCalibration | None:
    """Iron and axes of the magnetometer together, where rests in many poses show them."""
    readings: list[Array] = []
    stretches: list[NDArray[np.int64]] = []
    ups: list[Array] = []
    motions = 0
    for log, of_log in enumerate(fields):
        if of_log is None:
            continue
        time, mag = of_log
        good = np.isfinite(mag).all(axis=1) & mag.any(axis=1)
        time, mag = time[good], mag[good]
        stretch = np.full(len(time), -1, dtype=np.int64)
        before: tuple[Array, Array] | None = None
        for rest in found.rests[found.rests["log"] == log].to_dict("records"):
            inside = (time >= rest["start"]) & (time <= rest["end"])
            if rest["held"] or inside.sum() < LEAST_OF_REST:
                continue
            pose = mag[inside].mean(axis=0), np.array([rest[f"up_{a}"] for a in "xyz"])
            # A sensor that nobody moved is in the same field still.
            if before is None or _moved(pose, before):
                ups.append(pose[1])
            stretch[inside], before = len(ups) - 1, pose
        # A motion ends with a rest, and after some seconds another begins.
        moving = stretch < 0
        begins = np.flatnonzero(np.r_[True, moving[1:] != moving[:-1]])
        since = time - time[begins][np.searchsorted(begins, np.arange(len(time)), "right") - 1]
        begun = np.r_[True, np.diff(since // LONGEST_MOTION) != 0.0]
        begun[begins] = True
        stretch[moving] = -1 - motions - np.cumsum(begun)[moving]
        motions += len(time)
        readings.append(mag)
        stretches.append(stretch)
    if len(ups) < LEAST_RESTS:
        return None
    up = np.array(ups)
    stretch, rests = np.concatenate(stretches), list(range(len(ups)))
    made = calibrate_by_poses(np.vstack(readings), stretch, rests, up, found.up_covariance(up))
    return made if made.significant or made.direction_sd_deg < IRON_KNOWN else None


def _moved(pose: tuple[Array, Array], before: tuple[Array, Array]) -> bool:
    """Whether field or vertical differ by more than those of a sensor that lies."""
    both = zip(pose, before, strict=True)
    return any(float(np.linalg.norm(a - b)) > LIES * float(np.linalg.norm(b)) for a, b in both)


def _procedure(
    spec: CalibrateSpec,
    records: Sequence[CalibrationRecord],
    magnetometer: MagnetometerCalibration | None,
) -> str:
    """Procedure that the logs show, if it is not stated."""
    if spec.procedure is not None:
        if spec.procedure in ("turns", "rate-table") and not spec.turns:
            raise ConfigError("calibrate.no-turns", quantity="turns", procedure=spec.procedure)
        return spec.procedure
    if any(turn.rate_deg_per_s is not None for turn in spec.turns):
        return "rate-table"
    if spec.turns:
        return "turns"
    ups = [np.array(r.accel_mean) for one in records for r in one.rests if r.accel_mean is not None]
    ups = [up / np.linalg.norm(up) for up in ups]
    poses = _distinct(ups)
    if not poses and magnetometer is not None:
        return "magnetometer"
    faces = [up for up in poses if np.abs(up).max() > math.cos(FACE_WITHIN)]
    sides = {(int(np.abs(up).argmax()), bool(up[np.abs(up).argmax()] > 0.0)) for up in faces}
    return "six-position" if len(sides) == 6 and len(poses) < ENOUGH else "positions"


def _distinct(ups: Iterable[Array]) -> list[Array]:
    kept: list[Array] = []
    for up in ups:
        if all(float(up @ other) < math.cos(POSE_APART) for other in kept):
            kept.append(up)
    return kept


def _rotation(turn: KnownTurn, spec: CalibrateSpec, logs: int) -> KnownRotation:
    if turn.log is not None and turn.log > logs:
        raise ConfigError("calibrate.no-such-log", quantity="turns", log=turn.log, logs=logs)
    rate = turn.rate_deg_per_s
    # A rate table repeats its rates better than a hand its angles.
    usual = spec.turn_sd_deg if rate is None else 1e-3 * abs(rate) + 0.01
    return KnownRotation(
        angle=None if turn.angle_deg is None else turn.angle_deg * DEG,
        rate=None if rate is None else rate * DEG,
        axis=None if turn.axis is None else "xyz".index(turn.axis),
        sd=(turn.sd_deg or usual) * DEG,
        log=None if turn.log is None else turn.log - 1,
        start=turn.from_s,
        end=turn.to_s,
    )


def _prior(spec: CalibrateSpec) -> ImuUncertainty:
    return PRIOR if spec.sensor is None else ImuUncertainty.of_sensor(load_sensor(spec.sensor))


def _conditions(spec: CalibrateSpec, procedure: str) -> CalibrationConditions:
    g, sd = GRAVITY, GRAVITY_SD
    if spec.lat_deg is not None:
        g, sd = float(np.linalg.norm(gravity(spec.lat_deg, spec.alt_m))), ANOMALY
    if spec.gravity_m_per_s2 is not None:
        g, sd = spec.gravity_m_per_s2, STATED_SD
    six = spec.pose_sd_deg * DEG if procedure == "six-position" else None
    return CalibrationConditions(g, sd, spec.lat_deg, six)


def _said(found: ImuCalibration, spec: CalibrateSpec, name: str) -> Iterable[Finding]:
    missing = [n for n, o in zip(found.names, found.observed, strict=True) if not o]
    if missing:
        data = {"names": SensorCalibration.of(found).missing, "poses": _poses(found.remedies)}
        data["turns"] = [r.removeprefix("turn ") for r in found.remedies if r.startswith("turn")]
        code = "calibrate.not-observed"
        if data["poses"] and data["turns"]:
            code = "calibrate.not-observed-both"
        elif data["turns"]:
            code = "calibrate.not-observed-turns"
        yield Finding(code, file=name, data=data)
    if spec.lat_deg is None and spec.gravity_m_per_s2 is None:
        percent = 100.0 * GRAVITY_SD / GRAVITY
        yield Finding("calibrate.gravity", severity="note", file=name, data={"percent": percent})
    if found.excess["accel"] > LARGE_EXCESS:
        mg = found.excess["accel"] / 9.80665e-3
        yield Finding("calibrate.rests-disagree", file=name, data={"mg": mg})
    if found.excess["turns"] > LARGE_TILT:
        deg = found.excess["turns"] / DEG
        yield Finding("calibrate.turns-disagree", file=name, data={"deg": deg})


def _poses(remedies: Sequence[str]) -> list[str]:
    return [f"{r} up" for r in remedies if not r.startswith("turn")]


def _text(run: CalibrateRun) -> str:
    """The file: values with their standard deviations, and what they rest on."""
    found = run.calibration
    lines = [
        f"title = {string(f'calibration of {run.name}')}",
        f"procedure = {string(run.procedure)}",
        'axes = "of the sensor: the columns x, y, z of the log"',
    ]
    if found is None:
        tables: dict[str, dict[str, Any]] = {}
    else:
        missing = [n for n, o in zip(found.names, found.observed, strict=True) if not o]
        lines.append(f"not_observed = {_plain(missing)}")
        tables = run.sensor.tables()
    for one in run.inputs:
        for file, digest in zip(one.files, one.digests, strict=True):
            lines += ["", f"[[{one.role}]]", f"name = {string(file.name)}"]
            lines.append(f"sha256 = {string(digest)}")
    for name, table in tables.items():
        lines += ["", f"[{name}]", *(f"{key} = {_plain(value)}" for key, value in table.items())]
    pairs = [] if found is None else correlations(found)
    if pairs:
        lines += [
            "",
            "# Pairs of errors whose correlation exceeds 0.3.",
            "[correlation]",
            "pairs = [",
        ]
        lines += [f"  [{string(a)}, {string(b)}, {r:.2f}]," for a, b, r in pairs] + ["]"]
    return sealed_text("\n".join(lines) + "\n")


def _plain(value: Any) -> str:
    """A value of TOML: numbers with nine digits."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return string(value)
    if isinstance(value, float | int):
        return repr(float(f"{value:.9g}"))
    return f"[{', '.join(_plain(v) for v in value)}]"
