"""Extrinsics of two sensors from their logs: rotation, lever arm, clocks, with bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, input_files, log_files
from strapdown.config.logs import AxesTable
from strapdown.config.navigation import ExtrinsicsSpec
from strapdown.errors import DataError, Finding
from strapdown.estimation.error_model import PHYSICAL
from strapdown.evaluation.extrinsics import (
    OBSERVED,
    Estimate,
    Extrinsics,
    between_imus,
    imu_to_magnetometer,
)
from strapdown.evaluation.second_log import coarse_offset
from strapdown.formats import holds
from strapdown.formats.aid_table import read_aid_table, read_stream
from strapdown.formats.clocks import on_clock_of
from strapdown.nav_state import NavState
from strapdown.navigation.handover import UNKNOWN_VELOCITY
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import KnownStart, Navigation
from strapdown.navigation.replay import run_batch
from strapdown.progress import Progress, silent
from strapdown.systems.alignment_source import body_record
from strapdown.systems.inputs import Memory, SavedRun, refuse_long_span
from strapdown.systems.navigation_run import CHUNK, NavigationRun, run_navigation
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GYRO, MAG
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from strapdown.navigation.navigator import Reference
    from strapdown.navigation.pipeline import NavigationPipeline
    from strapdown.navigation.recorder import Recorder
    from strapdown.navigation.replay import PipelineRun
    from strapdown.report.chart_svg import ChartFigure


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

    bundle = "strapdown.report.extrinsics:EXTRINSICS"

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
        if set(input_files("other", other.path, files).digests) == set(inputs[0].digests):
            raise DataError("extrinsics.same-log", file=name, quantity="other")
        progress("fitting", 0.3)
        result = between_imus(imu, second, offset=spec.offset_s)
        force = ACCEL[0] in imu.columns and ACCEL[0] in second.columns
        findings += [] if force else [_said("extrinsics.no-accelerometers", name)]
    else:
        result, name, files, read = _magnetometer(spec, imu, progress)
        findings += read
    if spec.other is not None:
        inputs.append(input_files("other", other.path, files))
        inputs += log_files(other.path, files, other.calibration)[1:]
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
            if other.calibration is not None or spec.other_axes is not None:
                raise  # of a table of a field alone they would say nothing
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
    """Quantities that the motion leaves open, with the remedy."""
    found = []
    for group, axes in result.hidden.items():
        for axis in axes:
            direction = [round(float(x), 2) for x in axis]
            found.append(_said(f"extrinsics.{group.replace('_', '-')}-open", name, axis=direction))
    for one in result.estimates:
        if one.name in ("time_offset", "clock_drift") and not one.observed:
            found.append(_said("extrinsics.clock-open", name, parameter=one.name, sd=one.sd))
    return tuple(found)


# The antenna of a satellite receiver: states of a smoothed run.

#: Standard deviations of the state with which a pass begins: position, m, velocity, m/s, tilt and
#: heading, deg. All knowledge of the state comes from the fixes, once.
UNKNOWN_PLACE, UNKNOWN_TILT, UNKNOWN_HEADING = 100.0, 10.0, 60.0
#: Most passes, and the movement of arm and offset by the last one, in standard deviations.
PASSES, SETTLED = 12, 0.05
#: An estimate of a pass is ``assumed - state``: name, state, unit, assumed, and sd before the run.
_State = tuple[str, str, str, float, float]


def _antenna(spec: ExtrinsicsSpec, progress: Progress) -> ExtrinsicsRun:
    """Lever arm, time offset and mounting as states of a smoothed run, by Gauss and Newton.

    An alignment makes the first state from the same fixes, as if arm and offset were known: with
    it they would count twice, for what was assumed. The alignment therefore serves the first run
    alone, about which the others are linearized. These begin with an unknown state, and with the
    offset of the one before: the motion is continued over an offset by a mean acceleration, which
    is late by as much as the offset itself.
    """
    assert spec.navigation is not None  # made with it
    begun: list[tuple[NavigationPipeline, PipelineRun]] = []

    def drive(
        chain: NavigationPipeline,
        imu: pd.DataFrame,
        tables: Mapping[str, pd.DataFrame],
        recorder: Recorder,
        shown: Progress,
    ) -> PipelineRun:
        begun.append((chain, run_batch(chain, imu, tables, recorder, shown, chunk=CHUNK)))
        return begun[-1][1]

    run = run_navigation(spec.navigation, None, progress, drive)
    progress("smoothing", 0.8)
    chain, found, moved = _settled(run, *begun[-1], progress)
    assert found.smoothed is not None
    assert found.smoothing is not None
    record = found.smoothed
    aiding: dict[str, dict[str, Any]] = run.spec.plain()["aiding"]
    asked = [one for one in _states_asked(chain, aiding) if one[1] in record.sensors]
    estimates = []
    for name, state, unit, assumed, prior in asked:
        # Constants are the same at all marks; an offset may wander.
        wander = float(record.sensors[state].std(ddof=0))
        sd = float(np.hypot(np.sqrt((record.sensors_sd[state] ** 2).mean()), wander))
        value = assumed - float(record.sensors[state].mean())
        share = min(1.0, (sd / prior) ** 2) if prior > 0.0 else 1.0
        limit = OBSERVED.get(name.removesuffix(name[-2:]), OBSERVED.get(name, np.inf))
        seen = share < KEPT and sd <= limit
        estimates.append(Estimate(name, unit, value, sd, NORMAL * sd, seen, share))
    columns = [list(record.sensors.columns).index(state) for _, state, *_ in asked]
    sds = np.array([one.sd for one in estimates])
    covariance = found.smoothing.correlation()[np.ix_(columns, columns)] * np.outer(sds, sds)
    time, states = record.trajectory.index, record.sensors
    result = Extrinsics(
        "gnss",
        None,
        tuple(estimates),
        covariance,
        {},
        float(time[0]),
        float(states.index[len(states) // 2]),
        float(time[-1]),
        record.innovations["gnss.position"],
        {},
    )
    name = run.source.name
    said = [
        _said("extrinsics.state-open", name, parameter=e.name, share=e.prior_share, bound=e.bound)
        for e in estimates
        if not e.observed
    ]
    if moved > SETTLED:
        said.append(_said("extrinsics.antenna-not-settled", name, moved=moved, passes=PASSES))
    offset = _receiver(chain).time_offset - states["gnss.time_offset_t"]
    first, last = (float(x) for x in offset.iloc[[0, -1]])
    ends = record.sensors_sd["gnss.time_offset_t"].iloc[[0, -1]]
    if abs(last - first) > NORMAL * math.hypot(*ends.tolist()):
        said.append(_said("extrinsics.offset-wanders", name, "note", first=first, last=last))
    # Its remedy is the offset of an earlier pass; the table has that of the last.
    kept = [f for f in run.findings if not f.code.startswith("navigation.run-again-with-")]
    other = Path(str(aiding["gnss"]["path"])).name
    run = replace(run, record=record)
    return ExtrinsicsRun(spec, name, other, result, (*kept, *said), run.inputs, run)


def _states_asked(chain: NavigationPipeline, aiding: dict[str, dict[str, Any]]) -> Iterator[_State]:
    """States of the antenna, and of the mounting where the vehicle has wheels."""
    table = aiding["gnss"]
    arm_sd = np.broadcast_to(table["lever_arm_sd_m"], 3).tolist()
    for axis, assumed, prior in zip("xyz", table["lever_arm_m"], arm_sd, strict=True):
        yield f"lever_arm_{axis}", f"gnss.lever_arm_{axis}", "m", assumed, prior
    offset_sd = table["time_offset_sd_s"]
    yield "time_offset", "gnss.time_offset_t", "s", _receiver(chain).time_offset, offset_sd
    for aid, wheels in aiding.items():
        if wheels["kind"] == "no_slip":
            for angle, prior in zip(("pitch", "yaw"), wheels["mounting_sd_deg"], strict=True):
                state, assumed = f"{aid}.mounting_{angle}", math.radians(wheels[f"{angle}_deg"])
                yield f"mounting_{angle}", state, "rad", assumed, math.radians(prior)


def _settled(
    run: NavigationRun, chain: NavigationPipeline, found: PipelineRun, progress: Progress
) -> tuple[NavigationPipeline, PipelineRun, float]:
    """Repeat a smoothed run about its states until the antenna stays; the last movement, in sd."""
    recorder = run.spec.recorder.make(ellipsoid=run.spec.ellipsoid)
    moved, before = math.inf, pd.Series(dtype=np.float64)
    for k in range(PASSES):
        progress(f"smoothing, pass {k + 1}", 0.8)
        assert found.smoothing is not None
        about = found.smoothing.reference()
        assert about is not None  # errors are fed back
        chain = _anew(chain, about)
        found = run_batch(chain, run.source.imu, run.source.tables, recorder, chunk=CHUNK)
        assert found.smoothed is not None
        states = found.smoothed.sensors.filter(regex=r"^gnss\.(lever_arm|time_offset)")
        sds = found.smoothed.sensors_sd[states.columns].mean()
        now = states.mean()
        now["gnss.time_offset_t"] -= _receiver(chain).time_offset
        if len(before):
            moved = float((abs(now - before) / sds).max())
        if moved < SETTLED:
            break
        before = now
    return chain, found, moved


def _receiver(chain: NavigationPipeline) -> Gnss:
    aid = chain.navigator.by_name["gnss"]
    assert isinstance(aid, Gnss)  # the API names it
    return aid


def _anew(chain: NavigationPipeline, about: Reference) -> NavigationPipeline:
    """A pipeline about a reference: from an unknown state, and with the offset of the reference."""
    at = chain.navigator.filter.model.columns_of["gnss.time_offset"].start - PHYSICAL
    error = float(about.sensors[:, at].mean())
    sensors = about.sensors.copy()
    sensors[:, at] -= error
    own = _receiver(chain)
    centred = replace(own, time_offset=own.time_offset - error)
    aids = tuple(centred if aid is own else aid for aid in chain.navigator.aids)
    about = replace(about, sensors=sensors)
    return replace(
        chain,
        navigator=replace(chain.navigator, aids=aids, about=about),
        modes=(Navigation(),),
        start=KnownStart(
            NavState.of_numbers(float(about.time[0]), about.states[0]),
            position_sd=(UNKNOWN_PLACE,) * 3,
            velocity_sd=(UNKNOWN_VELOCITY,) * 3,
            attitude_sd_deg=(UNKNOWN_TILT, UNKNOWN_TILT, UNKNOWN_HEADING),
        ),
        commands=(),
    )
