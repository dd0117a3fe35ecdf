"""Drift prediction from its specification to all results of a report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import InputFiles, sensor_file
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.config.outage import OutageSpec, OutageStartTable
from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.dsp.chi_square import plane_bound
from strapdown.errors import ConfigError, Finding
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import stated_states
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.navigation import outage_test
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.navigator import Navigator, NavigatorState, with_states
from strapdown.navigation.outage import (
    QUANTITIES,
    Forecast,
    Go,
    courses,
    covariance_over,
    forecast,
    physical,
    variances,
    with_physical,
)
from strapdown.navigation.pipeline import NavigationPipeline, PipelineState
from strapdown.navigation.record import NavigationChunk, Span, state_of_row
from strapdown.navigation.recorder import record_of
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.sensors.uncertainty import ImuUncertainty, stated_imu
from strapdown.simulation import simulate_imu
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.gnss import GnssReceiver, instants, simulate_gnss, velocity_of_point
from strapdown.simulation.path_motion import Limits, Manoeuvre
from strapdown.simulation.vehicles import Accelerate, Straight, Turn, car
from strapdown.systems.inputs import Memory, SavedRun, check_part, configuration_file
from strapdown.systems.navigation_run import make_chain
from strapdown.systems.navigation_source import NavigationSource, read_navigation_source
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GYRO, TRAJECTORY
from strapdown.tables.aiding import odometer_table
from strapdown.tables.checks import Array, index_of, values_of
from strapdown.tables.sample_clock import ends_of_part

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure


@dataclass(frozen=True, eq=False, repr=False)
class OutageRun(SavedRun):
    """Predicted drift in a GNSS outage; in memory until `save` writes it.

    Attributes
    ----------
    navigation : NavigationSpec or None
        The run with outages; None for a sensor along a stated motion.
    name, what : str
        Sensor or record, in words.
    forecast : Forecast
        Of a run, that of the outage of `equal` with the median bound at its end.
    drifts : tuple of Drift
        Of a run, its outages in order of time; without fixes if it has no receiver.
    stays : tuple of str
        Remaining measurements.
    memory : Memory
        Tables of the navigation run that are given in memory; files of the bundle.
    """

    bundle = "strapdown.report.outage:OUTAGE"

    configuration: ClassVar[str] = "navigation"

    spec: OutageSpec
    navigation: NavigationSpec | None
    name: str
    what: str
    sensors: ImuUncertainty
    forecast: Forecast
    drifts: tuple[Drift, ...]
    stays: tuple[str, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
    memory: Memory = field(default=Memory({}))

    @property
    def equal(self) -> tuple[Drift, ...]:
        """Outages that begin with a fix, so that all are of one length; every one if none does."""
        return _equal(self.drifts)

    @property
    def verdict(self) -> outage_test.OutageVerdict | None:
        """Agreement of the drifts of `equal` with their bounds; None without fixes."""
        scores = [drift.score for drift in self.equal if drift.score is not None]
        return outage_test.judge_outages(scores) if scores else None

    @property
    def cone(self) -> tuple[Array, Array, dict[str, Array]]:
        """Time, s, 95 % bound, m, and variance by quantity; means of squares over `equal`."""
        drifts = self.equal
        if not drifts:
            found = self.forecast
            return found.time, found.bound, {q: found.variance(q) for q in QUANTITIES}
        return (
            np.linspace(0.0, self.spec.outage_s, INSTANTS + 1),
            np.sqrt(np.mean([d.bound**2 for d in drifts], axis=0)),
            {q: np.mean([d.variance[q] for d in drifts], axis=0) for q in QUANTITIES},
        )

    @property
    def bound_m(self) -> pd.Series:
        """95 % bound of the horizontal position, m, by time since the outage began, s."""
        return pd.Series(
            self.forecast.bound, index=pd.Index(self.forecast.time, name="time"), name="bound_m"
        )

    def to_pandas(self) -> pd.DataFrame:
        """The 95 % bound, and the motion over the outage, by time since it began."""
        table = self.bound_m.to_frame()
        return table.join(self.forecast.trajectory)

    def plot(self) -> ChartFigure:
        """Draw the 95 % bound over the outage.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.
        """
        from strapdown.report.chart_svg import ChartFigure
        from strapdown.report.outage_document import cone_chart

        return ChartFigure(cone_chart(self))

    def __repr__(self) -> str:
        time, bound = self.forecast.time[-1], self.forecast.bound[-1]
        return f"<OutageRun {self.name}: within {bound:.4g} m (95 %) after {time:g} s>"


@one_thread()
def run_outage(
    spec: OutageSpec,
    navigation: NavigationSpec | None = None,
    file: Path | None = None,
    progress: Progress = silent,
    *,
    budget: bool = True,
) -> OutageRun:
    """Predict the drift in an outage; for a navigation run, also measure it.

    Parameters
    ----------
    spec : OutageSpec
        With absolute paths.
    navigation : NavigationSpec, optional
        The run whose receivers are removed; without one, a sensor along a stated motion.
    file : Path, optional
        Configuration file of the run, listed as an input.
    progress : callable, optional
        Called with a stage and the share that is done.
    budget : bool
        Whether the shares of the sources are computed at once, which takes two thirds of the time;
        else when they are first read.

    Raises
    ------
    ConfigError
        No sensor is stated, the motion is invalid, or the outage does not fit into the run.
    DataError
        The record of the run cannot be read.
    """
    if navigation is None:
        if spec.sensor is None:
            raise ConfigError("outage.nothing-says-sensor", quantity="sensor")
        sensors = sensor_of(spec.sensor)
        sensor = load_sensor(spec.sensor)
        predicted = _alone(forecast_of_sensor(spec, sensors, progress), now=budget)
        return OutageRun(
            spec,
            None,
            sensor.name,
            sensor.title,
            sensors,
            predicted,
            (),
            tuple(spec.aiding),
            sensor_file(spec.sensor),
            (),
        )
    progress("reading", 0.02)
    # Its plan is not drawn.
    navigation = navigation.with_path("map", None)
    source = read_navigation_source(navigation)
    predicted, drifts = outage_of_run(spec, navigation, source, progress)
    predicted = _alone(predicted, now=budget)
    return OutageRun(
        spec,
        navigation,
        source.name,
        source.what,
        sensors_of(navigation),
        predicted,
        drifts,
        tuple(name for name, aid in navigation.aiding.items() if aid.kind != "gnss"),
        (*configuration_file(file), *source.inputs),
        tuple(source.findings),
    )


def _alone(found: Forecast, *, now: bool) -> Forecast:
    """With a budget on one thread of the linear algebra, whenever it is computed."""
    found = replace(found, budget=one_thread()(found.budget))
    if now:
        _ = found.shares
    return found


# Drift of a navigation run during outages of its receivers, predicted and measured.


#: Length of a chunk until navigation begins, s.
CHUNK = 2.0
#: Number of instants of an error cone.
INSTANTS = 120
#: Outages whose lengths differ by this share count as of one length.
_SHARE_LATE = 0.05


@dataclass(frozen=True, eq=False)
class Drift:
    """Predicted and measured drift of one outage.

    Attributes
    ----------
    variance : mapping of str to ndarray, (m,)
        By quantity, predicted, at the cone's instants.
    bound : ndarray, (m,), m
        95 % bound of the horizontal position.
    time : ndarray, (n,), s
        Time of the withheld fixes since the begin, without those that the run with fixes rejects.
    along, across, down : ndarray, (n,), m
        Computed minus fix; along and across the course.
    score : WithheldScore or None
        Of these fixes.
    rejected : int
        Withheld fixes that the run with fixes rejects: their errors are not drift.
    since_fix : float, s
        From the last fix that was used to the begin; 0 without a receiver.
    whole : bool
        Whether that is as short as two intervals of the fixes, or 5 % of the outage: if not, the
        position has been without fixes for longer than the outage.
    to_end : bool
        Whether there are fixes to the end of the outage, by the same limit.
    """

    span: Span
    variance: dict[str, Array]
    bound: Array
    time: Array
    along: Array
    across: Array
    down: Array
    score: outage_test.WithheldScore | None = None
    rejected: int = 0
    since_fix: float = 0.0
    whole: bool = True
    to_end: bool = False

    @property
    def horizontal(self) -> Array:
        """Length of the horizontal drift, (n,), m."""
        return np.asarray(np.hypot(self.along, self.across))

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each is within its 95 % ellipse, including the noise of the fix, (n,)."""
        return np.empty(0, dtype=np.bool_) if self.score is None else self.score.inside


def outage_of_run(
    spec: OutageSpec,
    navigation: NavigationSpec,
    source: NavigationSource,
    progress: Progress = silent,
) -> tuple[Forecast, tuple[Drift, ...]]:
    """Navigate over a record with outages of its receivers at even intervals.

    Parameters
    ----------
    progress : callable, optional

    Returns
    -------
    forecast : Forecast
        Of the outage with the median bound at its end, of those of one length.
    drifts : tuple of Drift
        In order of time; without fixes if the run has no receiver, or none during the outage.

    Raises
    ------
    ConfigError
        An outage does not fit into the run, begins outside the run, or includes a new alignment.
    DataError
        Navigation never begins.
    """
    chain = make_chain(navigation, sensors_of(navigation))
    # Measurements after an outage do not affect the solution during it.
    chain = replace(chain, navigator=replace(chain.navigator, smoother=None))
    receivers = [name for name, aid in navigation.aiding.items() if aid.kind == "gnss"]
    time, values = index_of(source.imu), values_of(source.imu, [*GYRO, *ACCEL])
    state = chain.begin(source.imu.attrs["sampling"], source.name)
    for aid, table in source.tables.items():
        state = chain.tell(state, aid, table)
    begun, at = state, 0
    while begun.navigator is None and at < len(time):
        state = begun
        progress("aligning", 0.1)
        first, at = at, int(np.searchsorted(time, time[at] + CHUNK, side="right"))
        begun, _ = chain.advance(state, time[first:at], values[first:at], at == len(time))
    ends = [float(index_of(source.tables[name])[-1]) for name in receivers]
    spans = _spans(spec, source, float(begun.time), min([float(time[-1]), *ends]), receivers)
    blind = chain
    for name in receivers:
        blind = replace(blind, navigator=outage_test.blinded(blind.navigator, name))
    fixes = _Fixes(
        receivers,
        float(begun.time),
        max(
            (2.0 * _usual_interval(index_of(source.tables[name])) for name in receivers),
            default=0.0,
        ),
    )
    runs: list[outage_test.WithheldRun] = []
    for run in outage_test.withheld_runs(
        chain, blind, begun, time[at:], values[at:], spans, fixes.take
    ):
        progress(f"outage {len(runs) + 1} of {len(spans)}", 0.1 + 0.4 * len(runs) / len(spans))
        runs.append(run)
    grid = np.linspace(0.0, spec.outage_s, INSTANTS + 1)
    drifts = tuple(_drift(blind.navigator, run, spans[run.number], fixes, grid) for run in runs)
    order = sorted(_equal(drifts), key=lambda drift: float(drift.bound[-1]))
    middle = runs[drifts.index(order[len(order) // 2])]
    rows = slice(at + middle.rows.start, at + middle.rows.stop)
    predicted = _predict(
        chain,
        middle.state,
        (time[rows], values[rows]),
        receivers,
        spec.outage_s,
        len(receivers) < len(navigation.aiding),
        lambda stage, share: progress(stage, 0.5 + 0.25 * share),
    )
    return predicted, drifts


def _equal(drifts: tuple[Drift, ...]) -> tuple[Drift, ...]:
    return tuple(drift for drift in drifts if drift.whole) or drifts


def _usual_interval(time: Array) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


@dataclass
class _Fixes:
    """Which fixes the run with fixes uses and rejects; the first receiver is scored."""

    receivers: list[str]
    begun: float
    late: float
    used: list[Array] = field(default_factory=list)
    rejected: list[Array] = field(default_factory=list)

    @property
    def scored(self) -> str | None:
        return self.receivers[0] if self.receivers else None

    def take(self, chunks: Sequence[NavigationChunk]) -> None:
        names = {f"{name}.position" for name in self.receivers}
        for one in (one for chunk in chunks for one in chunk.seen.by_name() if one.name in names):
            lost = (one.innovations.weight <= 0.0).any(axis=1)
            self.used.append(one.time[~lost])
            if one.name == f"{self.scored}.position":
                self.rejected.append(one.time[lost])

    def since(self, at: float) -> float:
        """Time since the last one that was used, s; at most since navigation began."""
        before = [used[used <= at] for used in self.used]
        return at - max([self.begun, *(float(used[-1]) for used in before if used.size)])


def _spans(
    spec: OutageSpec, source: NavigationSource, begun: float, end: float, receivers: list[str]
) -> tuple[Span, ...]:
    """The outages, on the clock of the samples."""
    first = begun + outage_test.SETTLED
    check_part(spec.from_s, spec.to_s, spec.duration_s)
    if spec.at_s is not None:
        if not first - outage_test.SETTLED <= spec.at_s <= end - spec.outage_s:
            raise ConfigError(
                "outage.outage-not-within-run-navigation"
                if end - spec.outage_s > begun
                else "outage.outage-not-within-run-navigation-2",
                file=source.name,
                quantity="--at",
                outage_s=spec.outage_s,
                at_s=spec.at_s,
                begun=begun,
                end=end,
                end_2=end - spec.outage_s,
            )
        return (Span("outage", spec.at_s, spec.at_s + spec.outage_s),)
    begin = float(index_of(source.imu)[0])
    log, to = ends_of_part(begin, spec.from_s, spec.to_s, spec.duration_s)
    within = (max(first, log), min(end, to))
    if within != (first, end) and within[1] - within[0] < spec.outage_s <= end - first:
        raise ConfigError(
            "outage.outage-longer-than-between",
            file=source.name,
            quantity="--from, --to, --duration",
            outage_s=spec.outage_s,
            within=max(within[1] - within[0], 0.0),
            within_2=within[0],
            within_3=within[1],
            first=first,
            end=end,
        )
    room = end - first
    if room < spec.outage_s:
        raise ConfigError(
            "outage.outage-longer-than-run-navigation"
            if room > 1.0
            else "outage.outage-longer-than-run-navigation-2",
            file=source.name,
            quantity="--outage",
            outage_s=spec.outage_s,
            room=max(room, 0.0),
            first=first,
            end=end,
            room_2=room,
        )
    places = spec.places if receivers else 1
    return outage_test.spans_to_withhold(*within, spec.outage_s, places)


def _drift(
    navigator: Navigator, run: outage_test.WithheldRun, span: Span, fixes: _Fixes, grid: Array
) -> Drift:
    """Predicted and measured drift of an outage."""
    if run.state.navigator is None or run.through.navigator is None:
        raise _aligns_anew(span.begin, span.end)
    # With the covariance at the end, where no epoch has one.
    record = record_of(navigator, (*run.pieces, navigator.finish(run.through.navigator)))
    marks = record.sd.index.to_numpy(dtype=np.float64)
    if len(marks) < 2:
        # The record has the covariance at intervals; a shorter outage may lie between two.
        raise ConfigError(
            "outage.outage-between-covariances",
            quantity="--outage",
            outage_s=span.end - span.begin,
            begin=span.begin,
        )
    course = courses(record.trajectory, marks)
    on_grid = grid + span.begin
    variance = {
        q: np.interp(on_grid, marks, v) for q, v in variances(record.covariance, course).items()
    }
    bound = np.interp(on_grid, marks, plane_bound(record.covariance))
    none = np.empty(0)
    empty = Drift(span, variance, bound, none, none, none, none)
    if fixes.scored is None:
        return empty
    late = max(fixes.late, _SHARE_LATE * (span.end - span.begin))
    since = fixes.since(span.begin)
    empty = replace(empty, since_fix=since, whole=since <= late)
    position = f"{fixes.scored}.position"
    if not any(one.name == position for piece in run.pieces for one in piece.seen.by_name()):
        return empty
    score: outage_test.WithheldScore = outage_test.score_of(run.pieces, fixes.scored, span)
    sound = score.without(np.concatenate([none, *fixes.rejected]))
    at = sound.time
    empty = replace(empty, rejected=len(score.time) - len(at))
    if not len(at):
        return empty
    way = courses(record.trajectory, at)
    c, s = np.cos(way), np.sin(way)
    north, east, down = sound.error.T
    return replace(
        empty,
        time=at - span.begin,
        along=c * north + s * east,
        across=-s * north + c * east,
        down=down,
        score=sound,
        to_end=span.end - float(at[-1]) <= late,
    )


def _aligns_anew(begin: float, end: float) -> ConfigError:
    return ConfigError(
        "outage.does-not-navigate-alone-after", quantity="--at", begin=begin, end=end
    )


def _predict(
    chain: NavigationPipeline,
    state: PipelineState,
    samples: tuple[Array, Array],
    receivers: list[str],
    outage: float,
    aided: bool,
    progress: Progress,
) -> Forecast:
    """Forecast from a state of a run over the samples that follow it."""
    begin = state.navigator
    assert begin is not None
    # The receiver's measurements are not even compared.
    queues = {
        name: replace(queue, time=queue.time[:0], values=queue.values[:0])
        if name in receivers
        else queue
        for name, queue in begin.queues.items()
    }

    def go(navigator: Navigator, start: NavigatorState) -> tuple[NavigationChunk, ...]:
        one = replace(chain, navigator=navigator)
        end, piece = one.advance(replace(state, navigator=start), *samples)
        if end.navigator is None:
            raise _aligns_anew(state.time, end.time)
        return (*piece.navigation, navigator.finish(end.navigator))

    start = replace(begin, queues=queues)
    return forecast(chain.navigator, start, go, outage, aided=aided, progress=progress)


# Predict the drift of a sensor along a stated motion.


#: Sample rate of a stated motion, Hz. Without errors, samples are exact at any sufficient rate.
RATE = 50.0
#: Standard deviations after an alignment: m, m/s, deg, deg.
ALIGNED = (10.0, 0.1, 0.5, 5.0)
#: Rate and standard deviation of a remaining odometer, Hz and m/s.
ODOMETER_RATE, ODOMETER_SD = 2.0, 0.03
RECEIVER = "fixes"
#: Rows of the physical errors that each key of a start replaces, and the factor to SI.
STATED: dict[str, tuple[str, float]] = {
    "position_sd_m": ("position", 1.0),
    "velocity_sd_m_per_s": ("velocity", 1.0),
    "tilt_sd_deg": ("tilt", math.radians(1.0)),
    "heading_sd_deg": ("heading", math.radians(1.0)),
    "gyro_bias_sd_deg_per_h": ("gyro_bias", 1.0 / DEG_PER_HOUR),
    "accel_bias_sd_ug": ("accel_bias", 1.0 / MICRO_G),
}
CORE = {
    "position": slice(0, 3),
    "velocity": slice(3, 6),
    "tilt": slice(6, 8),
    "heading": slice(8, 9),
}


def sensor_of(name: str) -> ImuUncertainty:
    """Return the uncertainty of a sensor.

    Parameters
    ----------
    name : str
        Name in the catalogue, or path of a file.
    """
    sensor = load_sensor(name)
    for triad in ("gyro", "accel"):
        if triad not in {figure.key.partition(".")[0] for figure in sensor.sources}:
            raise ConfigError(
                "outage.sensor-without-gyros"
                if triad == "gyro"
                else "outage.sensor-without-accelerometers",
                quantity="sensor",
                name=sensor.name,
            )
    return stated_imu(sensor, {}, {})


def outage_navigator(spec: OutageSpec, sensors: ImuUncertainty, fixes: bool) -> Navigator:
    """Return the navigator of a forecast.

    Parameters
    ----------
    fixes : bool
        Whether a receiver is among its measurements.
    """
    aids: tuple[Measurement, ...] = tuple(
        aid.make(name=kind, ellipsoid="wgs84") for kind, aid in spec.aiding.items()
    )
    filter_ = ErrorFilter(
        NorthEastDown(),
        RotationVectorModel(
            gyro_noise=sensors.gyro.axis("noise_density"),
            accel_noise=sensors.accel.axis("noise_density"),
            sensors=stated_states(sensors),
        ),
        Joseph(),
    )
    filter_ = with_states(filter_, aids)
    return Navigator(filter_, (*aids, Gnss(name=RECEIVER)) if fixes else aids)


def forecast_of_sensor(
    spec: OutageSpec, sensors: ImuUncertainty, progress: Progress = silent
) -> Forecast:
    """Predict the drift of a sensor along a stated motion.

    A filter runs over a drive with fixes, and from there over the outage. Samples and fixes are
    those of the truth: the result is the covariance, which includes their errors.

    Parameters
    ----------
    progress : callable, optional

    Raises
    ------
    ConfigError
        The motion is not possible.
    """
    navigator, state, go = _begun(spec, sensors, progress)
    return forecast(
        navigator,
        state,
        go,
        spec.outage_s,
        aided=bool(navigator.aids),
        progress=lambda stage, share: progress(stage, 0.3 + 0.45 * share),
    )


def drift_of_sensor(spec: OutageSpec, sensors: ImuUncertainty) -> tuple[Array, Array]:
    """Time since the begin of the outage, (n,), s, and covariance, (n, 9, 9), of the prediction.

    The covariance of `forecast_of_sensor`, without the shares of the sources.
    """
    time, covariance, _ = covariance_over(*_begun(spec, sensors, silent), spec.outage_s)
    return time, covariance


def _begun(
    spec: OutageSpec, sensors: ImuUncertainty, progress: Progress
) -> tuple[Navigator, NavigatorState, Go]:
    """Navigator and state at the begin of an outage, and what runs over it."""
    motion, begin = stated_motion(spec)
    progress("the motion", 0.1)
    perfect = ImuErrors()
    imu, _ = simulate_imu(motion, perfect, rate=RATE, sampling="mean")
    made = motion_increments(imu)
    time, rows = index_of(made), made.to_numpy(dtype=np.float64)
    driven = begin > 0.0
    before = outage_navigator(spec, sensors, fixes=driven)
    (row,) = values_of(motion.trajectory([0.0]), TRAJECTORY)
    state = before.begin(state_of_row(row), _aligned(before, sensors))
    for name, table in _tables(spec, motion, begin, driven).items():
        state = before.tell(state, name, table)
    progress("the drive before", 0.2)
    first = int(np.searchsorted(time, begin + 0.5 / RATE)) if driven else 0
    if first:
        state, _ = before.advance(state, time[:first], rows[:first])
    navigator = replace(before, aids=tuple(a for a in before.aids if a.name != RECEIVER))
    queues = {k: v for k, v in state.queues.items() if k != RECEIVER}
    state = _stated(replace(state, queues=queues), navigator, spec.start)

    def go(one: Navigator, start: NavigatorState) -> tuple[NavigationChunk, ...]:
        end, piece = one.advance(start, time[first:], rows[first:])
        return piece, one.finish(end)

    return navigator, state, go


def _aligned(navigator: Navigator, sensors: ImuUncertainty) -> Array:
    """Covariance after an alignment, with sensors by their data sheets."""
    position, velocity, tilt, heading = ALIGNED
    core = np.repeat([position, velocity, math.radians(tilt)], 3)
    core[8] = math.radians(heading)
    sds = np.concatenate([core, navigator.filter.model.stacked.sd])
    return np.diag(np.square(sds))


def _stated(state: NavigatorState, navigator: Navigator, start: OutageStartTable) -> NavigatorState:
    """Replace errors by stated ones, uncorrelated with all others."""
    P = physical(navigator, state).copy()
    for key, (name, factor) in STATED.items():
        value = getattr(start, key)
        if value is None:
            continue
        rows = CORE.get(name) or navigator.filter.model.columns_of[name]
        P[rows, :] = P[:, rows] = 0.0
        P[rows, rows] = np.eye(rows.stop - rows.start) * (factor * value) ** 2
    return with_physical(navigator, state, P)


def _tables(
    spec: OutageSpec, motion: EarthMotion, begin: float, driven: bool
) -> dict[str, pd.DataFrame]:
    """Error-free tables of receivers and odometers."""
    out: dict[str, pd.DataFrame] = {}
    if driven:
        receiver = GnssReceiver(
            rate=1.0,
            on_excess="unaffected",
            stated_position_sd=spec.start.fix_position_sd_m,
            stated_velocity_sd=spec.start.fix_velocity_sd_m_per_s,
        )
        fixes = simulate_gnss(motion, receiver)
        out[RECEIVER] = fixes[fixes.index <= begin + 1e-6]
    if "odometer" in spec.aiding:
        arm = spec.aiding["odometer"].make().lever_arm
        at = instants(motion, ODOMETER_RATE)[1:]
        forward = velocity_of_point(motion, at, arm)[:, 0]
        out["odometer"] = odometer_table(at, forward, ODOMETER_SD)
    return out


# Stated motion: a drive with fixes, in which the filter converges, and the outage.


#: Drive with fixes: m/s, mean m/s² of a change of speed, m.
SPEED, GENTLE, RADIUS = 12.0, 1.0, 25.0
#: Least time at constant speed before the outage, s.
SETTLING = 12.0
#: Duration of a turn's onset and end, s.
RAMP = 1.0
#: Limits of a stated motion, those of a fast aircraft, m/s².
LIMITS = Limits(acceleration=100.0, lateral=100.0, climb_deg=20.0)


def stated_motion(spec: OutageSpec) -> tuple[EarthMotion, float]:
    """Return the motion of a forecast, and the begin of the outage.

    Before it, for `aided_s`, a car drives around blocks to the left and to the right, with changes
    of speed, which makes heading, tilts and biases observable. It ends with the heading at which
    the outage begins.

    Returns
    -------
    motion : EarthMotion
    begin : float, s
    """
    asked, outage = spec.motion, spec.outage_s
    before, begin = _drive(spec.start.aided_s, asked.speed_m_per_s)
    motion = car(
        Origin(asked.lat_deg, 10.0, 100.0),
        [(f"drive {k + 1}", one) for k, one in enumerate([*before, *_of_outage(spec)])],
        heading_deg=asked.heading_deg,
        speed=0.0 if before else asked.speed_m_per_s,
        limits=LIMITS,
    )
    return replace(motion, duration=begin + outage), begin


def _drive(length: float, speed: float) -> tuple[list[Manoeuvre], float]:
    """Maneuvers before the outage, and their duration; empty if no drive is specified."""
    if length == 0.0:
        return [], 0.0
    turn = math.radians(90.0) * RADIUS / SPEED + RAMP
    block: list[tuple[Manoeuvre, float]] = []
    for sign in (1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0):
        block += [
            (Straight(6.0), 6.0),
            (Accelerate(0.5 * SPEED, 6.0), 6.0),
            (Accelerate(SPEED, 6.0), 6.0),
            (Turn(sign * 90.0, RADIUS, RAMP), turn),
        ]
    round_ = sum(t for _, t in block)
    done: list[tuple[Manoeuvre, float]] = [(Straight(5.0), 5.0), (Accelerate(SPEED, 12.0), 12.0)]
    change = max(abs(speed - SPEED) / GENTLE, 1.0)
    rounds = max(1, round((length - 30.0 - change) / round_))
    done += block * rounds
    done += [(Accelerate(speed, change), change)]
    # Whole seconds, so that samples and fixes coincide with the begin of the outage.
    took = sum(t for _, t in done)
    whole = math.ceil(took + SETTLING)
    return [*(one for one, _ in done), Straight(whole - took)], float(whole)


def _of_outage(spec: OutageSpec) -> list[Manoeuvre]:
    """Maneuvers during the outage."""
    asked, outage = spec.motion, spec.outage_s
    speed, rate = asked.speed_m_per_s, asked.turn_rate_deg_per_s
    to = asked.to_speed_m_per_s
    if rate != 0.0:
        if speed == 0.0 or to is not None:
            raise ConfigError(
                "outage.turn-goes-speed-above-zero"
                if to is not None
                else "outage.body-stands-makes-no-turn",
                quantity="--turn-rate",
            )
        if speed * abs(math.radians(rate)) > LIMITS.lateral:
            most = math.degrees(LIMITS.lateral / speed)
            raise ConfigError(
                "outage.take-more-than-side",
                quantity="--turn-rate",
                rate=rate,
                speed=speed,
                lateral=LIMITS.lateral,
                most=most,
            )
        # With its ramps the turn is as long as the outage, and a second more.
        radius = speed / abs(math.radians(rate))
        return [Turn(rate * outage, radius, RAMP)]
    if to is not None and to != speed:
        least = 15.0 / 8.0 * abs(to - speed) / LIMITS.acceleration
        if outage < least:
            raise ConfigError(
                "outage.takes-more-than",
                quantity="--to-speed",
                speed=speed,
                to=to,
                outage=outage,
                acceleration=LIMITS.acceleration,
                least=least,
            )
        return [Accelerate(to, outage)]
    return [Straight(outage)]
