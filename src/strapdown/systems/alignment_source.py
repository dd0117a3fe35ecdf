"""Input of an alignment: a log or a simulation, in body axes, cut to its span."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, input_files, log_files, sensor_file
from strapdown.config.logs import AxesTable, LogTable, with_answers
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import Finding, StrapdownError
from strapdown.formats import files_of, read_log
from strapdown.formats.assemble import require_accel
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.recording import PLACEHOLDERS, Reading, Recording, StatedStart
from strapdown.navigation.measurements.gnss_course import unit_of_turns
from strapdown.rotation import euler_from_dcm
from strapdown.sensors.triad_errors import (
    NAMED_AXES,
    axes_letters,
    check_axes_matrix,
    report_transposed,
)
from strapdown.systems.inputs import part_of_log, read_options, refuse_long_span
from strapdown.tables import ACCEL, EULER, GYRO
from strapdown.tables.checks import Array, values_of

if TYPE_CHECKING:
    from strapdown.config.alignment import AlignmentSpec


@dataclass(frozen=True, eq=False)
class AlignmentSource:
    """Input of an alignment.

    Attributes
    ----------
    imu : DataFrame
        Imu table of the used span, body axes.
    truth : DataFrame or None
        Attitude table at the same stamps, of a simulation.
    start : StatedStart or None
        Position and attitude stated in the file.
    gnss : DataFrame or None
        Gnss table, if given.
    """

    name: str
    what: str
    imu: pd.DataFrame
    truth: pd.DataFrame | None
    start: StatedStart | None
    gnss: pd.DataFrame | None
    readings: tuple[Reading, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]


def read_alignment_source(spec: AlignmentSpec) -> AlignmentSource:
    """Read the log of a specification, or simulate its record."""
    if spec.log is None:
        return _simulated(spec)
    recording, imu, findings = body_record(spec.log, spec.axes)
    refuse_long_span(imu, recording.name)
    require_accel(recording)
    gnss, inputs = None, [*log_files(spec.log.path, recording.files, spec.log.calibration)]
    if spec.gnss is not None:
        inputs.append(input_files("gnss", spec.gnss.path, files_of(spec.gnss.path)))
        fixes = read_gnss(spec.gnss.path, spec.gnss.options())
        gnss, shifted = on_clock_of(fixes, recording.imu)
        findings = (*findings, *gnss.attrs["findings"], *([shifted] if shifted else []))
    return AlignmentSource(
        recording.name,
        "recorded log",
        imu,
        None,
        recording.start,
        gnss,
        recording.readings,
        (*inputs, *_sensor_file(spec)),
        findings,
    )


def body_record(
    log: LogTable, axes: AxesTable, inferred: Iterable[str] = ()
) -> tuple[Recording, pd.DataFrame, tuple[Finding, ...]]:
    """Read a log, rotate it into body axes, and cut it to the used span.

    `inferred`: as in `ReadOptions`.

    Returns
    -------
    recording : Recording
        The whole log as recorded.
    imu : DataFrame
        Imu table of the span, body axes.
    findings : tuple of Finding
    """
    gyro, accel = axes_matrices(axes)
    letters, turn = axes_letters(gyro) if gyro is not None else (axes.axes, None)
    options = replace(read_options(log, letters), inferred=frozenset(inferred))
    recording = read_log(log.path, options)
    findings = list(recording.findings)
    imu = recording.imu
    if gyro is not None and accel is not None and turn is not None:
        plain = gyro.T @ turn  # what the letters did, from body to sensor
        imu = _turned(imu, turn, accel @ plain)
        findings += _said(recording, turn, accel @ plain)
        if ACCEL[0] in imu.columns:
            force = values_of(imu, ACCEL).mean(axis=0)
            findings += report_transposed(accel, force, recording.name)
    part = part_of_log(imu, log.from_s, log.to_s, log.duration_s, recording.name)
    return recording, part, tuple(findings)


def gyro_unit_by_turns(
    log: LogTable,
    axes: AxesTable,
    refused: Finding,
    fixes_of: Callable[[Recording], pd.DataFrame],
) -> Finding | None:
    """Answer the unit of a gyro that a log leaves open by the turns of fixes.

    None if the log leaves open anything else without an answer, or the turns do not show the unit.

    Parameters
    ----------
    refused : Finding
        The refusal to read the log.
    fixes_of : callable
        Returns the fixes on the clock of the recording.
    """
    answers = dict(refused.data.get("answers", ()))
    if [q for q, answer in answers.items() if answer in PLACEHOLDERS] != ["gyro_unit"]:
        return None
    try:
        tried = with_answers(log, {**answers, "gyro_unit": "rad/s"})
        recording, imu, _ = body_record(tried, axes)
        return unit_of_turns(fixes_of(recording), imu)
    except StrapdownError:
        return None


def axes_matrices(axes: AxesTable) -> tuple[Array | None, Array | None]:
    """Rotation from sensor to body axes of gyros and accelerometers, where stated as matrices.

    Returns
    -------
    gyro, accel : ndarray, (3, 3), or None
    """
    both = axes.matrix if axes.design is None else NAMED_AXES[axes.design]
    if both is not None:
        matrix = check_axes_matrix(both)
        return matrix, matrix
    if axes.gyro_matrix is None or axes.accel_matrix is None:
        return None, None
    return (
        check_axes_matrix(axes.gyro_matrix, "gyro_matrix"),
        check_axes_matrix(axes.accel_matrix, "accel_matrix"),
    )


def _turned(imu: pd.DataFrame, gyro: Array, accel: Array) -> pd.DataFrame:
    out = imu.copy()
    for columns, turn in ((GYRO, gyro), (ACCEL, accel)):
        if columns[0] in out.columns and not np.array_equal(turn, np.eye(3)):
            out[columns] = values_of(imu, columns) @ turn.T
    out.attrs = dict(imu.attrs)
    return out


def _said(recording: Recording, gyro: Array, accel: Array) -> Sequence[Finding]:
    """Angle between the stated axes and the nearest that letters can name."""
    out = []
    for name, turn in (("gyro", gyro), ("accel", accel)):
        roll, pitch, heading = euler_from_dcm(turn)
        if np.abs([roll, pitch, heading]).max() < 1e-6:
            continue
        out.append(
            Finding(
                "alignment.mounting-rotation-applied",
                file=recording.name,
                quantity=name,
                severity="note",
                roll=roll,
                pitch=pitch,
                heading=heading,
            )
        )
    return out


def _sensor_file(spec: AlignmentSpec) -> tuple[InputFiles, ...]:
    found = [*sensor_file(spec.sensors.sensor)]
    if spec.simulation is not None and spec.simulation.sensor != spec.sensors.sensor:
        found += sensor_file(spec.simulation.sensor)
    return tuple(found)


def _simulated(spec: AlignmentSpec) -> AlignmentSource:
    from strapdown.config.motions import RockingStandSpec, StationarySpec
    from strapdown.systems.trajectory_source import make_motion, simulate_samples

    asked = spec.simulation
    assert asked is not None  # one of the two is there
    waves = {name: getattr(asked, f"{name}_waves") for name in EULER}
    keys = asked.model_dump(include={"duration_s", *(f"{name}_deg" for name in EULER)})
    keys |= spec.site.model_dump(include={"lat_deg", "lon_deg", "alt_m"})
    rocking = {f"{name}_waves": group for name, group in waves.items()}
    stated = (
        RockingStandSpec(kind="rocking_stand", **keys, **rocking)
        if any(waves.values())
        else StationarySpec(kind="stationary", **keys)
    )
    sensor = asked.sensor or spec.sensors.sensor
    assert sensor is not None  # checked with the specification
    motion = make_motion(stated, find_ellipsoid(spec.site.ellipsoid))
    imu, truth = simulate_samples(motion, asked, sensor, spec.name)
    what = f"simulated, {Path(sensor).stem}, seed {asked.seed}"
    return AlignmentSource(spec.name, what, imu, truth, None, None, (), _sensor_file(spec), ())
