"""Noise of a sensor from a log at rest: deviations, terms, and the sensor file for a filter."""

from __future__ import annotations

import math
import shutil
import tempfile
import weakref
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, log_files
from strapdown.config.logs import AllanSpec, AxesTable, LogTable
from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import WGS84
from strapdown.errors import DataError, Finding
from strapdown.formats.aid_table import but_temperature, temperature_of
from strapdown.formats.recording import Recording
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV, KEYS
from strapdown.sensors.noise_terms import (
    ChannelNoise,
    Shapes,
    allan_model,
    deviations,
    pooled_terms,
)
from strapdown.sensors.rest import find_rest_spans
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors, triad_of
from strapdown.systems.alignment_source import body_record
from strapdown.systems.inputs import Memory, SavedRun, refuse_long_span
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GYRO, find_gaps
from strapdown.tables.checks import Array, index_of
from strapdown.tables.on_disk import let_go

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure


#: Shortest stationary stretch that is used, and one below which the result says that it is short.
LEAST_REST, SHORT = 60.0, 1800.0  # s
#: Share by which the rates of logs of one sensor may differ.
SAME_RATE = 0.01
#: Share of a log outside its longest rest from which the result says so.
MOVED = 0.02
#: Threads for deviations and digests, which take longer than the fits.
BESIDE = 2
#: Change of temperature of which an effect is estimated, °C; where it may be missing, s.
LEAST_WARMING, EDGE = 0.5, 10.0
#: Flat minimum of the Allan deviation of flicker, √(2 ln 2/π) B.
FLAT = math.sqrt(2.0 * math.log(2.0) / math.pi)
#: Correlation times to the maximum of the Allan deviation of a Gauss-Markov process.
MAXIMUM = 1.893
#: Angle random walk of a class of the catalogue at most, rad/√s: deg/√h times π/10800.
CLASSES = (
    ("navigation", 0.005 * math.pi / 10800.0),
    ("tactical", 0.15 * math.pi / 10800.0),
    ("industrial", 0.6 * math.pi / 10800.0),
    ("phone", math.inf),
)
#: Gravity on the ground differs from the standard one by so much, m/s².
GRAVITY_RANGE = 0.03
#: Keys of the sensor file, by triad and quantity.
FILE_KEYS = {
    "gyro": {
        "noise_density": "noise_density_deg_per_s_per_sqrt_hz",
        "bias_instability": "bias_instability_deg_per_h",
        "random_walk": "random_walk_deg_per_h_per_sqrt_h",
    },
    "accel": {
        "noise_density": "noise_density_ug_per_sqrt_hz",
        "bias_instability": "bias_instability_ug",
        "random_walk": "random_walk_ug_per_sqrt_h",
    },
}


@dataclass(frozen=True)
class Stretch:
    """The stationary stretch of a log, s, and the mean of each channel, rad/s or m/s²."""

    name: str
    start: float
    end: float
    means: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class AllanRun(SavedRun):
    """Noise of a sensor: in memory until `save` writes its page and its data.

    Attributes
    ----------
    deviations : DataFrame
        A row for each channel and averaging time: ``channel``, ``tau`` s, ``allan``, ``modified``,
        ``hadamard`` and ``model``, of the fitted terms, in rad/s or m/s², ``relative_sd``.
    noise : dict of str to ChannelNoise
        By channel, ``gyro_x`` … ``accel_z``.
    errors : ImuErrors
        The noise as the error model of this package has it: white noise, a Gauss-Markov process and
        a random walk. A flicker is the process with the same maximum of its Allan deviation.
    findings : tuple of Finding
    stretches : tuple of Stretch
        The stationary stretch of each log, with the means of its channels.
    rate_hz : float
    """

    bundle = "strapdown.report.allan:ALLAN"

    configuration: ClassVar[str] = "spec"

    spec: AllanSpec
    name: str
    deviations: pd.DataFrame
    noise: dict[str, ChannelNoise]
    errors: ImuErrors
    findings: tuple[Finding, ...]
    stretches: tuple[Stretch, ...]
    rate_hz: float
    inputs: tuple[InputFiles, ...]
    memory: Memory = field(default=Memory({}))

    @property
    def start(self) -> float:
        """Begin of the first stretch, s."""
        return self.stretches[0].start

    @property
    def end(self) -> float:
        """End of the first stretch, s."""
        return self.stretches[0].end

    @property
    def length(self) -> float:
        """Length of all stretches, s."""
        return math.fsum(one.end - one.start for one in self.stretches)

    @property
    def terms(self) -> pd.DataFrame:
        """One row per channel and term: value, 95 % interval, whether it is observable; SI."""
        rows = [
            {
                "channel": channel,
                "term": term.name,
                "value": term.value,
                "low": term.low,
                "high": term.high,
                "observable": term.observable,
            }
            for channel, noise in self.noise.items()
            for term in noise.terms
        ]
        return pd.DataFrame(rows)

    def to_pandas(self) -> pd.DataFrame:
        """The terms; as `terms`."""
        return self.terms

    @cached_property
    def _folder(self) -> Path:
        name = tempfile.mkdtemp(prefix="strapdown-")
        weakref.finalize(self, shutil.rmtree, name, ignore_errors=True)
        return Path(name)

    @property
    def sensor(self) -> Path:
        """The sensor as a file, for ``sensor=`` of `navigate` and `align`; gone with this run."""
        path = self._folder / f"{_stem(self.name)}.toml"
        if not path.is_file():
            path.write_text(self.sensor_text(), encoding="utf-8")
        return path

    def sensor_text(self) -> str:
        """The sensor file, in the form of the catalogue."""
        return _sensor_text(self)

    def parameters(self, target: str) -> pd.DataFrame:
        """The noise as the parameters of another program, `sensors.bridge.TARGETS`.

        Returns
        -------
        DataFrame
            ``parameter``, ``triad``, ``unit``, and the values ``x``, ``y``, ``z``.
        """
        from strapdown.sensors.bridge import for_program

        span = max(one.end - one.start for one in self.stretches)
        found = for_program(self.errors, target, 1.0 / self.rate_hz, span)
        return pd.DataFrame(
            [(e.name, e.triad, e.unit, *values) for e, values in found.items()],
            columns=["parameter", "triad", "unit", "x", "y", "z"],
        )

    def plot(self) -> ChartFigure:
        """Draw the Allan deviations with the fitted terms.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.
        """
        from strapdown.report.allan import allan_chart
        from strapdown.report.chart_svg import ChartFigure

        return ChartFigure(allan_chart(self))

    def __repr__(self) -> str:
        shown = [
            f"{channel} {' '.join(t.name for t in noise.terms if t.observable)}"
            for channel, noise in self.noise.items()
        ]
        return f"<AllanRun {self.name}, {self.length:.4g} s: {'; '.join(shown)}>"


@one_thread()
def run_allan(spec: AllanSpec, progress: Progress = silent) -> AllanRun:
    """Find the noise of a sensor from a log at rest, or from several together.

    Parameters
    ----------
    spec : AllanSpec
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    DataError
        A log cannot be read, is not at rest for a minute, has another rate or fewer channels than
        the first, or a channel is constant.
    """
    findings: list[Finding] = []
    rests: list[_Rest] = []
    noise: dict[str, ChannelNoise] = {}
    tables = []
    # Threads beside the fits and the search for rests, for what needs no lock of Python; no bit
    # depends on them.
    with ThreadPoolExecutor(BESIDE) as beside:
        for k, log in enumerate(spec.logs):
            progress("reading", 0.05 + 0.15 * k / len(spec.logs))
            rests.append(_rest_of(spec, log, findings, beside))
        dt, name = rests[0].dt, rests[0].name
        channels = [c for c in (*GYRO, *ACCEL) if c in rests[0].imu.columns]
        for rest in rests[1:]:
            if abs(rest.dt / dt - 1.0) > SAME_RATE or not set(channels) <= set(rest.imu.columns):
                raise DataError(
                    "allan.logs-differ",
                    file=rest.name,
                    rate=1.0 / rest.dt,
                    first=1.0 / dt,
                    name=name,
                    channels=[c for c in channels if c not in rest.imu.columns],
                )
        means: list[dict[str, float]] = [{} for _ in rests]
        steps, warm = [one.dt for one in rests], [one.warm for one in rests]
        shapes: Shapes = {}

        def deviations_of(channel: str) -> pd.DataFrame:
            return deviations([rest.values(channel) for rest in rests], dt)

        made = {channel: beside.submit(deviations_of, channel) for channel in channels}
        for k, channel in enumerate(channels):
            progress(f"noise of {channel}", 0.2 + 0.55 * k / len(channels))
            values = [rest.values(channel) for rest in rests]
            try:
                found = pooled_terms(values, steps, warm, shapes)
            except DataError as error:
                raise error.replaced(file=name, quantity=channel) from None
            noise[channel] = found
            for one, value in zip(means, values, strict=True):
                one[channel] = float(value.mean())
            table = made[channel].result()
            table["model"] = allan_model(found.model, table.index, found.correlation_time)
            table.insert(0, "channel", channel)
            tables.append(table.reset_index())
            for rest in rests:
                let_go(rest.imu)
    longest = max(one.end - one.start for one in rests)
    findings += _limits(noise, longest, 0.5 / dt, name)
    return AllanRun(
        spec,
        name,
        pd.concat(tables, ignore_index=True),
        noise,
        _errors(noise, dt, longest),
        tuple(findings),
        tuple(
            Stretch(one.name, one.start, one.end, mean)
            for one, mean in zip(rests, means, strict=True)
        ),
        1.0 / dt,
        tuple(file for one in rests for file in one.inputs.result()),
    )


@dataclass(frozen=True, eq=False)
class _Rest:
    """Stationary part of a log: its files, rows, sample interval in s, and temperature in °C."""

    name: str
    inputs: Future[tuple[InputFiles, ...]]
    imu: pd.DataFrame
    rows: slice
    start: float
    end: float
    dt: float
    warm: Array | None

    def values(self, channel: str) -> Array:
        """Values of a channel, without a copy where they are together."""
        return np.ascontiguousarray(self.imu[channel].to_numpy()[self.rows], dtype=np.float64)


def _rest_of(
    spec: AllanSpec, log: LogTable, findings: list[Finding], beside: ThreadPoolExecutor
) -> _Rest:
    """Read a log and find its rest; findings are appended."""
    recording, imu, read = body_record(log, AxesTable(axes=spec.axes))
    inputs = beside.submit(log_files, log.path, recording.files, log.calibration)
    refuse_long_span(imu, recording.name)
    time = index_of(imu)
    start, end = float(time[0]), float(time[-1])
    moved: list[Finding] = []
    if not spec.at_rest:
        start, end = _rest(imu, recording.name, moved)
    first, past = np.searchsorted(time, [start, end + 1e-9])
    stamps = time[first:past]
    dt = float(stamps[-1] - stamps[0]) / (stamps.size - 1)
    warm = _temperature(log, recording, stamps)
    if warm is not None:
        read = tuple(but_temperature(read, recording))
    findings += [*read, *moved]
    gaps = find_gaps(stamps)
    if gaps:
        longest = max(gap.end - gap.start for gap in gaps)
        findings.append(_said("allan.gaps", recording.name, count=len(gaps), longest=longest))
    rows = slice(int(first), int(past))
    return _Rest(recording.name, inputs, imu, rows, start, end, dt, warm)


def _rest(imu: pd.DataFrame, name: str, findings: list[Finding]) -> tuple[float, float]:
    """Ends of the longest stationary stretch, s."""
    time = index_of(imu)
    whole = float(time[-1] - time[0])
    rests = find_rest_spans(imu)
    begin, end = max(rests, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    length = end - begin
    if whole < LEAST_REST:
        raise DataError("allan.too-short-to-rest", file=name, whole=whole, least=LEAST_REST)
    if length < LEAST_REST:
        raise DataError(
            "allan.not-at-rest", file=name, longest=length, whole=whole, least=LEAST_REST
        )
    share = length / whole
    if share < 1.0 - MOVED:
        at = {"start": begin, "end": end}
        findings.append(_said("allan.moved", name, count=len(rests), share=share, **at))
    return begin, end


def _temperature(log: LogTable, recording: Recording, stamps: Array) -> Array | None:
    """Temperature of the log at the stamps, °C; None without one, or if it hardly changes."""
    stream = temperature_of(recording, log.path, log.format)
    if stream is None:
        return None
    time, values = (np.asarray(one, np.float64) for one in (stream.index, stream))
    if time[0] > stamps[0] + EDGE or time[-1] < stamps[-1] - EDGE:
        return None
    at = np.interp(stamps, time, values)
    return at if np.ptp(at) > LEAST_WARMING else None


def _said(code: str, name: str, **data: Any) -> Finding:
    return Finding(code, file=name, data=data)


def _limits(
    noise: dict[str, ChannelNoise], length: float, nyquist: float, name: str
) -> Iterable[Finding]:
    if length < SHORT:
        yield _said("allan.short", name, minutes=length / 60.0)
    colored = [c for c, one in noise.items() if one.up_to_hz < 0.9 * nyquist]
    if colored:
        yield _said(
            "allan.colored", name, channels=colored, hz=min(noise[c].up_to_hz for c in colored)
        )
    alike = [c for c, one in noise.items() if one.alike]
    if alike:
        yield _said("allan.models-alike", name, channels=alike)


# The error model of this package.


def _errors(noise: dict[str, ChannelNoise], dt: float, length: float) -> ImuErrors:
    """White noise, Gauss-Markov process and random walk of each triad.

    Of a flicker, the Gauss-Markov process has the same maximum of the Allan deviation, where the
    deviation of all terms is least; of several axes one correlation time, the geometric mean.
    """
    made: dict[str, TriadErrors] = {}
    for triad, channels in (("gyro", GYRO), ("accel", ACCEL)):
        if channels[0] not in noise:
            continue
        axes = [noise[channel] for channel in channels]
        sizes, times = [], []
        for one in axes:
            size = one.model.get("GM", one.model.get("B", 0.0) * FLAT / ALLAN_OF_GAUSS_MARKOV)
            sizes.append(size)
            if "GM" in one.model:
                times.append(one.correlation_time)
            elif size > 0.0:
                tau = np.geomspace(dt, length / 4.0, 200)
                least = tau[int(np.argmin(allan_model(one.model, tau)))]
                times.append(float(least) / MAXIMUM)
        made[triad] = TriadErrors(
            noise_density=triad_of([one.model["N"] for one in axes]),
            bias_instability=triad_of(sizes),
            correlation_time=math.exp(float(np.mean(np.log(times)))) if times else math.inf,
            random_walk=triad_of([one.model.get("K", 0.0) for one in axes]),
        )
    return ImuErrors(made["gyro"], made.get("accel"))


def _stem(name: str) -> str:
    kept = "".join(
        c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in Path(name).stem
    )
    return kept.strip("-") or "sensor"


def _sensor_text(run: AllanRun) -> str:
    """The sensor file: every value with the record as its source."""
    largest = max(run.errors.gyro.axis("noise_density"))
    grade = next(name for name, most in CLASSES if largest <= most)
    spans = f"{run.start:.6g} s to {run.end:.6g} s of the log at {run.rate_hz:.6g} Hz"
    if len(run.stretches) > 1:
        spans = f"{run.length:.6g} s of {len(run.stretches)} logs at {run.rate_hz:.6g} Hz"
    lines = [
        f'title = "sensor of {_stem(run.name)}"',
        f'class = "{grade}"',
        'summary = "noise by strapdown allan; without scale factor and misalignment"',
        "",
        "[sources]",
        f'log = "{_stem(run.name)}, strapdown allan"',
    ]
    for triad, errors in (("gyro", run.errors.gyro), ("accel", run.errors.accel)):
        if errors is None:
            continue
        lines += ["", f"[{triad}]"]
        for quantity, key in FILE_KEYS[triad].items():
            values = [v / KEYS[triad][key].factor for v in errors.axis(quantity)]
            if any(values):
                numbers = ", ".join(repr(float(f"{v:.6g}")) for v in values)
                lines.append(
                    f'{key} = {{ value = [{numbers}], source = "log", place = "{spans}" }}'
                )
        if math.isfinite(errors.correlation_time):
            time = float(f"{errors.correlation_time:.6g}")
            lines.append(
                f'correlation_time_s = {{ value = {time!r}, source = "log", place = "{spans}" }}'
            )
        lines.append(_bias(run, triad))
        rate = float(f"{run.rate_hz:.6g}")
        lines.append(f'output_rate_hz = {{ value = {rate!r}, source = "log", place = "{spans}" }}')
    return "\n".join(lines) + "\n"


def _bias(run: AllanRun, triad: str) -> str:
    """The bias as the mean of the record leaves it open, without position and attitude.

    The size of the mean rate is the Earth's, that of the mean specific force the local gravity,
    9.806 m/s² within `GRAVITY_RANGE`, but for the bias along it.
    """
    channels, size = (GYRO, WGS84.rotation_rate) if triad == "gyro" else (ACCEL, STANDARD_GRAVITY)
    off = max(
        abs(math.sqrt(math.fsum(one.means[c] ** 2 for c in channels)) - size)
        for one in run.stretches
    )
    if triad == "gyro":
        why = "mean rate of the log less the rotation rate of the Earth"
        key, value = "bias_sd_deg_per_h", off / KEYS[triad]["bias_sd_deg_per_h"].factor
    else:
        why = "mean specific force of the log less gravity, which is not known to 3 mg"
        off = math.hypot(off, GRAVITY_RANGE)
        key, value = "bias_sd_mg", off / KEYS[triad]["bias_sd_mg"].factor
    return f'{key} = {{ value = {float(f"{value:.3g}")!r}, assumed = "{why}" }}'
