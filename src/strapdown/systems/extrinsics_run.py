"""Extrinsics of two sensors from their logs: rotation, lever arm, clocks, with bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import InputFiles, Seal, input_files, log_files
from strapdown.config.extrinsics import ExtrinsicsSpec
from strapdown.config.logs import AxesTable
from strapdown.errors import DataError, Finding
from strapdown.evaluation.extrinsics import OBSERVED, Estimate, Extrinsics, between_imus
from strapdown.evaluation.magnetometer_extrinsics import imu_to_magnetometer
from strapdown.evaluation.second_log import coarse_offset
from strapdown.formats import holds
from strapdown.formats.aid_table import read_aid_table, read_stream
from strapdown.formats.clocks import on_clock_of
from strapdown.progress import Progress, silent
from strapdown.systems.alignment_source import body_record
from strapdown.systems.inputs import Memory, SavedRun, refuse_long_span
from strapdown.systems.navigation_run import NavigationRun, run_navigation
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GYRO, MAG

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure

__all__ = ["ExtrinsicsRun", "run_extrinsics"]

Array = NDArray[np.float64]

#: Standard normal quantile of a 95 % bound.
NORMAL = 1.959964
#: Share of the variance before a run that a state of a filter keeps, at most, to be observable.
KEPT = 0.25


@dataclass(frozen=True, eq=False, repr=False)
class ExtrinsicsRun(SavedRun):
    """Extrinsics of two sensors: in memory until `save` writes its page and its files.

    Attributes
    ----------
    result : Extrinsics
        ``rotation`` R (``v_a = R v_b``), ``estimates`` with bounds, ``covariance``, ``residual``.
    findings : tuple of Finding
        What is not observable, and what to do.
    navigation : NavigationRun or None
        Of an antenna: the smoothed run.
    """

    configuration: ClassVar[str] = "spec"

    spec: ExtrinsicsSpec
    name: str
    other: str
    result: Extrinsics
    findings: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...]
    navigation: NavigationRun | None = None
    memory: Memory = field(default=Memory({}))

    def to_pandas(self) -> pd.DataFrame:
        """One row per parameter: value, sd, 95 % bound, observed, share of the assumption; SI."""
        return pd.DataFrame([vars(one) for one in self.result.estimates]).set_index("name")

    @property
    def transform(self) -> Array:
        """``T_ab``, (4, 4), from coordinates of b to those of a; kalibr's ``T_i_b`` is its inverse.

        Without a rotation (an antenna) or a lever arm these parts are 1 and 0.
        """
        T = np.eye(4)
        if self.result.rotation is not None:
            T[:3, :3] = self.result.rotation
        names = {one.name for one in self.result.estimates}
        if "lever_arm_x" in names:
            T[:3, 3] = [self.result[f"lever_arm_{axis}"].value for axis in "xyz"]
        return T

    def plot(self) -> ChartFigure:
        """Draw what both sensors measured, before and after.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.
        """
        from strapdown.report.chart_svg import ChartFigure
        from strapdown.report.extrinsics import match_chart

        return ChartFigure(match_chart(self))

    @staticmethod
    def _writer() -> Callable[..., Seal]:
        from strapdown.report.extrinsics import EXTRINSICS

        return EXTRINSICS.write

    def __repr__(self) -> str:
        shown = [
            f"{e.name} {e.value:.4g} ± {e.bound:.2g} {e.unit}"
            for e in self.result.estimates
            if e.observed and e.name.rsplit("_", 1)[0] in ("lever_arm", "time", "rotation")
        ]
        return f"<ExtrinsicsRun {self.name}, {self.other}: {'; '.join(shown)}>"


@one_thread()
def run_extrinsics(spec: ExtrinsicsSpec, progress: Progress = silent) -> ExtrinsicsRun:
    """Find the extrinsics of two sensors from their logs.

    Parameters
    ----------
    spec : ExtrinsicsSpec
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    DataError
        A log cannot be read, moves too little, or both do not show one motion.
    """
    if spec.kind == "gnss":
        return _antenna(spec, progress)
    progress("reading", 0.05)
    recording, imu, said = body_record(spec.log, AxesTable(axes=spec.axes))
    refuse_long_span(imu, recording.name)
    findings = list(said)
    inputs = [*log_files(spec.log.path, recording.files, spec.log.calibration)]
    other = spec.other or spec.log
    files: tuple[Path, ...]
    if spec.kind == "imu":
        recording_b, second, read = body_record(other, AxesTable(axes=spec.other_axes))
        refuse_long_span(second, recording_b.name)
        findings += read
        name, files = recording_b.name, recording_b.files
        progress("fitting", 0.3)
        result = between_imus(imu, second, offset=spec.offset_s)
        force = ACCEL[0] in imu.columns and ACCEL[0] in second.columns
        findings += [] if force else [_said("extrinsics.no-accelerometers", name)]
    else:
        result, name, files, read = _magnetometer(spec, imu, progress)
        findings += read
    if spec.other is not None:
        inputs.append(input_files("other", other.path, files))
    findings += _open(result, recording.name)
    return ExtrinsicsRun(spec, recording.name, name, result, tuple(findings), tuple(inputs))


def _said(code: str, name: str, severity: str = "warning", **data: Any) -> Finding:
    return Finding(code, severity=severity, file=name, data=data)  # type: ignore[arg-type]


def _magnetometer(
    spec: ExtrinsicsSpec, imu: pd.DataFrame, progress: Progress
) -> tuple[Extrinsics, str, tuple[Path, ...], tuple[Finding, ...]]:
    """Readings of the same log, or of another one, and the fit."""
    other = spec.other or spec.log
    name = Path(other.path).name
    files: tuple[Path, ...] = (Path(other.path),)
    read: tuple[Finding, ...] = ()
    offset: float | None = 0.0 if spec.offset_s is None else spec.offset_s
    second: pd.DataFrame | None = imu
    if spec.other is not None:
        offset, second = (offset if spec.one_clock else spec.offset_s), None
        try:
            recording, second, read = body_record(other, AxesTable(axes=spec.other_axes))
            name, files = recording.name, recording.files
        except DataError:
            second = None
    if second is not None and set(MAG) <= set(second.columns):
        readings = second[MAG]
        if spec.other is not None and offset is None and GYRO[0] in second.columns:
            offset = coarse_offset(imu, second).offset
    else:
        readings, read = read_field(other.path), ()
        if spec.other is None:
            readings, _ = on_clock_of(readings, imu)
    progress("fitting", 0.3)
    apart = spec.other is not None and not spec.one_clock
    return imu_to_magnetometer(imu, readings, offset=offset, apart=apart), name, files, read


def read_field(path: str | Path) -> pd.DataFrame:
    """Return the readings of a magnetometer, by time in s: of a stream, or of a table."""
    if holds(Path(path), "magnetometer"):
        return read_stream(path, "magnetometer")
    return read_aid_table(path, dict.fromkeys(MAG, "uT"))


def _open(result: Extrinsics, name: str) -> tuple[Finding, ...]:
    """What the motion leaves open, with the remedy."""
    found = []
    for group, axes in result.hidden.items():
        for axis in axes:
            direction = [round(float(x), 2) for x in axis]
            found.append(_said(f"extrinsics.{group.replace('_', '-')}-open", name, axis=direction))
    for one in result.estimates:
        if one.name in ("time_offset", "clock_drift") and not one.observed:
            found.append(_said("extrinsics.clock-open", name, parameter=one.name, sd=one.sd))
    return tuple(found)


# The antenna of a satellite receiver, by the states of a smoothed run.


def _antenna(spec: ExtrinsicsSpec, progress: Progress) -> ExtrinsicsRun:
    assert spec.navigation is not None  # made with it
    run = run_navigation(spec.navigation, None, progress)
    states, sds = run.record.sensors, run.record.sensors_sd
    middle = len(states) // 2
    aiding: dict[str, dict[str, Any]] = run.spec.plain()["aiding"]
    table = aiding["gnss"]
    estimates: list[Estimate] = []

    def add(name: str, state: str, unit: str, assumed: float, prior: float) -> None:
        if state not in states:
            return
        # Constants are the same at all marks; an offset may wander.
        wander = float(states[state].std(ddof=0))
        sd = float(np.hypot(np.sqrt((sds[state] ** 2).mean()), wander))
        value = assumed - float(states[state].mean())
        share = min(1.0, (sd / prior) ** 2) if prior > 0.0 else 1.0
        limit = OBSERVED.get(name.removesuffix(name[-2:]), np.inf)
        seen = share < KEPT and sd <= limit
        estimates.append(Estimate(name, unit, value, sd, NORMAL * sd, seen, share))

    for axis, assumed in zip("xyz", table["lever_arm_m"], strict=True):
        prior = np.broadcast_to(table["lever_arm_sd_m"], 3)["xyz".index(axis)]
        add(f"lever_arm_{axis}", f"gnss.lever_arm_{axis}", "m", assumed, float(prior))
    offset = _offset_of(run, table)
    add("time_offset", "gnss.time_offset_t", "s", *offset)
    slip = next((n for n, one in aiding.items() if one["kind"] == "no_slip"), None)
    if slip is not None:
        wheels = aiding[slip]
        for angle, prior in zip(("pitch", "yaw"), wheels["mounting_sd_deg"], strict=True):
            assumed = np.radians(wheels[f"{angle}_deg"])
            state = f"{slip}.mounting_{angle}"
            add(f"mounting_{angle}", state, "rad", float(assumed), float(np.radians(prior)))
    time = run.record.trajectory.index
    covariance = np.diag([one.sd**2 for one in estimates])
    result = Extrinsics(
        "gnss",
        None,
        tuple(estimates),
        covariance,
        {},
        float(time[0]),
        float(states.index[middle]),
        float(time[-1]),
        _innovations(run),
        {},
    )
    name = run.source.name
    # Simulated drives say so: docs/extrinsics.md.
    said = [_said("extrinsics.antenna-indicative", name)]
    said += [
        _said("extrinsics.state-open", name, parameter=e.name, share=e.prior_share, bound=e.bound)
        for e in estimates
        if not e.observed
    ]
    ends = offset[0] - states["gnss.time_offset_t"].iloc[[0, -1]]
    if abs(ends.iloc[1] - ends.iloc[0]) > 2.0 * float(sds["gnss.time_offset_t"].iloc[middle]):
        first, last = (float(x) for x in ends)
        said.append(_said("extrinsics.offset-wanders", name, "note", first=first, last=last))
    # Its remedy is the offset of an earlier pass; the table has that of the last.
    kept = [f for f in run.findings if not f.code.startswith("navigation.run-again-with-")]
    findings = (*kept, *said)
    other = Path(str(table["path"])).name
    return ExtrinsicsRun(spec, name, other, result, findings, run.inputs, run)


def _offset_of(run: NavigationRun, table: dict[str, Any]) -> tuple[float, float]:
    """Assumed time offset and its standard deviation of the run that counts, s."""
    again = [
        f.data
        for f in run.findings
        if f.code.startswith("navigation.run-again-with-") and "offset" in f.data
    ]
    assumed = float(again[-1]["offset"]) if again else float(table["time_offset_s"])
    return assumed, float(table["time_offset_sd_s"])


def _innovations(run: NavigationRun) -> pd.DataFrame:
    """Innovations of position of the smoothed run, by time."""
    return run.record.innovations["gnss.position"]
