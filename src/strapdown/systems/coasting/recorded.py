"""Drift of a navigation run during outages of its receivers, predicted and measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.config.alignment import sensors_of
from strapdown.config.coast import CoastSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError
from strapdown.evaluation.gnss_outages import WithheldScore, blinded, score_of, spans_to_withhold
from strapdown.evaluation.plane_bound import PLANE_95, plane_bound
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.record import NavigationChunk, Span
from strapdown.navigation.recorder import record_of
from strapdown.systems.coasting.forecast import QUANTITIES, Forecast, courses, forecast, variances
from strapdown.systems.part_of_log import check_part
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.chain import NavigationPipeline, PipelineState
from strapdown.systems.sins.run import make_chain
from strapdown.systems.sins.source import NavigationSource
from strapdown.systems.sins.withholding import SETTLED, WithheldRun, withheld_runs
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, values_of

__all__ = ["Drift", "RecordedCoast", "coast_of_run"]

Array = NDArray[np.float64]

#: Length of a chunk until navigation begins, s.
CHUNK = 2.0
#: Number of instants of an error cone.
INSTANTS = 120


@dataclass(frozen=True, eq=False)
class Drift:
    """Predicted and measured drift of one outage.

    Attributes
    ----------
    span : Span
    variance : mapping of str to ndarray, (m,)
        By quantity, predicted, at the cone's instants.
    bound : ndarray, (m,), m
        95 % bound of the horizontal position.
    time : ndarray, (n,), s
        Time of the withheld fixes since the begin.
    along, across, down : ndarray, (n,), m
        Computed minus fix; along and across the course.
    inside : ndarray of bool, (n,)
        Whether it is within the 95 % ellipse, including the noise of the fix.
    """

    span: Span
    variance: dict[str, Array]
    bound: Array
    time: Array
    along: Array
    across: Array
    down: Array
    inside: NDArray[np.bool_]

    @property
    def horizontal(self) -> Array:
        """Length of the horizontal drift, (n,), m."""
        return np.asarray(np.hypot(self.along, self.across))


@dataclass(frozen=True, eq=False)
class RecordedCoast:
    """Result of the outages of a run.

    Attributes
    ----------
    forecast : Forecast
        Of the outage with the median bound at its end.
    time : ndarray, (m,), s
        Instants of the cone, since the begin of an outage.
    variance : mapping of str to ndarray, (m,)
        By quantity: the mean over the outages.
    bound : ndarray, (m,), m
        Root mean square of their 95 % bounds.
    drifts : tuple of Drift
        In order of time; without fixes if the run has no receiver.
    stays : tuple of str
        Names of the remaining measurements.
    """

    forecast: Forecast
    time: Array
    variance: dict[str, Array]
    bound: Array
    drifts: tuple[Drift, ...]
    stays: tuple[str, ...]


def coast_of_run(
    spec: CoastSpec,
    navigation: NavigationSpec,
    source: NavigationSource,
    progress: Progress = silent,
) -> RecordedCoast:
    """Navigate over a record with outages of its receivers at even intervals.

    Parameters
    ----------
    spec : CoastSpec
    navigation : NavigationSpec
    source : NavigationSource
    progress : callable, optional

    Returns
    -------
    RecordedCoast

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
    stays = tuple(name for name in navigation.aiding if name not in receivers)
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
        blind = replace(blind, navigator=blinded(blind.navigator, name))
    runs: list[tuple[WithheldRun, Drift]] = []
    grid = np.linspace(0.0, spec.outage_s, INSTANTS + 1)
    scored = receivers[0] if receivers else None
    for number, run in enumerate(withheld_runs(chain, blind, begun, time[at:], values[at:], spans)):
        progress(f"outage {number + 1} of {len(spans)}", 0.1 + 0.4 * number / len(spans))
        runs.append((run, _drift(blind.navigator, run, spans[run.number], scored, grid)))
    order = sorted(range(len(runs)), key=lambda k: float(runs[k][1].bound[-1]))
    middle, _ = runs[order[len(order) // 2]]
    rows = slice(at + middle.rows.start, at + middle.rows.stop)
    foretold = _foretold(
        chain,
        middle.state,
        (time[rows], values[rows]),
        receivers,
        spec.outage_s,
        bool(stays),
        lambda stage, share: progress(stage, 0.5 + 0.25 * share),
    )
    drifts = tuple(drift for _, drift in runs)
    return RecordedCoast(
        forecast=foretold,
        time=grid,
        variance={q: np.mean([d.variance[q] for d in drifts], axis=0) for q in QUANTITIES},
        bound=np.sqrt(np.mean([d.bound**2 for d in drifts], axis=0)),
        drifts=drifts,
        stays=stays,
    )


def _spans(
    spec: CoastSpec, source: NavigationSource, begun: float, end: float, receivers: list[str]
) -> tuple[Span, ...]:
    """The outages, on the clock of the samples."""
    first = begun + SETTLED
    check_part(spec.from_s, spec.to_s, spec.duration_s)
    if spec.at_s is not None:
        if not first - SETTLED <= spec.at_s <= end - spec.outage_s:
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
    log = float(index_of(source.imu)[0]) if spec.from_s is None else spec.from_s
    to = spec.to_s if spec.duration_s is None else log + spec.duration_s
    within = (max(first, log), end if to is None else min(end, to))
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
    return spans_to_withhold(*within, spec.outage_s, places)


def _drift(
    navigator: Navigator, run: WithheldRun, span: Span, scored: str | None, grid: Array
) -> Drift:
    """Predicted and measured drift of an outage."""
    if run.state.navigator is None or run.through.navigator is None:
        raise _aligns_anew(span.begin, span.end)
    record = record_of(navigator, run.pieces)
    marks = record.sd.index.to_numpy(dtype=np.float64)
    course = courses(record.trajectory, marks)
    on_grid = grid + span.begin
    variance = {
        q: np.interp(on_grid, marks, v) for q, v in variances(record.covariance, course).items()
    }
    bound = np.interp(on_grid, marks, plane_bound(record.covariance))
    if scored is None:
        none = np.empty(0)
        return Drift(span, variance, bound, none, none, none, none, np.empty(0, dtype=np.bool_))
    score: WithheldScore = score_of(run.pieces, scored, span)
    way = courses(record.trajectory, score.time)
    c, s = np.cos(way), np.sin(way)
    north, east, down = score.error.T
    return Drift(
        span,
        variance,
        bound,
        score.time - span.begin,
        c * north + s * east,
        -s * north + c * east,
        down,
        score.distance <= PLANE_95,
    )


def _aligns_anew(begin: float, end: float) -> ConfigError:
    return ConfigError(
        "outage.does-not-navigate-alone-after", quantity="--at", begin=begin, end=end
    )


def _foretold(
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
