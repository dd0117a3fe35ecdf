"""Error-state navigation filter around a mechanization, with measurements at any instant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from strapdown._kernels.filter_loop import ASK, NOTE, turn_blocks
from strapdown._kernels.motion_increments import split_increment
from strapdown._kernels.sums import STEADY, steady_motion
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Innovations, Observation, Step, UpdateRule
from strapdown.estimation.error_filter import (
    ErrorFilter,
    FilterState,
    Rules,
    is_large,
    turned_force,
    unlearnt_force,
)
from strapdown.estimation.robust import (
    AdaptiveRule,
    AdaptiveScale,
    Rejection,
    Scales,
    ScaleState,
    linear_range,
)
from strapdown.nav_state import NavState
from strapdown.navigation.compiled_engine import (
    NO_REFERENCES,
    CompiledEngine,
    ReferenceEngine,
    compiled,
)
from strapdown.navigation.engine import (
    SAME_INSTANT,
    Engine,
    EngineState,
    GeneralEngine,
    LostCovarianceError,
    NodeRows,
    begun,
)
from strapdown.navigation.filter_options import ClosedLoop, Correction
from strapdown.navigation.measurements.gnss import (
    HORIZONTAL_CODE,
    PLACE,
    POSITION_CODE,
    VELOCITY_CODE,
    Gnss,
)
from strapdown.navigation.measurements.measurement import (
    Epochs,
    ImuDerivedMeasurement,
    Measurement,
    TabulatedMeasurement,
    View,
)
from strapdown.navigation.record import (
    CovarianceSnapshots,
    InnovationColumns,
    InnovationRecords,
    NavigationChunk,
)
from strapdown.navigation.recovery import Wrong
from strapdown.sensors.triad_errors import triad_of
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from strapdown.navigation.smoother import RauchTungStriebel


#: A warming unit is told of at intervals of this part of the time since it was switched on, and of
#: so many seconds more, up to so many of its times: then e⁻⁸ of the variance is left.
PACE, EARLY, FADED = 0.05, 20.0, 4.0


@dataclass(frozen=True, eq=False)
class Reference:
    """States about which a filter is linearized, instead of its own estimates.

    Attributes
    ----------
    time : ndarray, (m,), s
        Times of samples, increasing.
    states : ndarray, (m, 10)
        Latitude and longitude, rad, height, m, velocity, m/s, and quaternion, body to
        north-east-down.
    sensors : ndarray, (m, k)
        Errors of sensors and aids.
    marks : ndarray, (n,), s
        Times of the covariances that are recorded, whatever instants a run about it has.
    """

    time: Array
    states: Array
    sensors: Array
    marks: Array

    def part(self, first: int, until: float) -> tuple[Array, Array, Array]:
        """Times, states and sensor errors from an index on, before a time."""
        last = max(first, int(self.time.searchsorted(until)))
        return self.time[first:last], self.states[first:last], self.sensors[first:last]

    def next_after(self, time: float) -> int:
        """Index of the first state after a time."""
        return int(self.time.searchsorted(time + SAME_INSTANT))

    def next_time(self, time: float) -> float:
        """Time of the first state after a time; infinite after the last."""
        k = self.next_after(time)
        return float(self.time[k]) if k < len(self.time) else np.inf


@dataclass(frozen=True)
class Warming:
    """Change of the biases of a unit that becomes warm after it was switched on.

    A random walk whose drive decays, with the variance ``sd² (1 - exp(-2 t / time))``: of the
    curve, which differs from unit to unit, the size and the time are known by order only.

    Attributes
    ----------
    gyro, accel : float, rad/s and m/s²
        Standard deviation of the change of a bias until the unit is warm.
    time : float, s
        Of the decay.
    begin : float, s
        When the unit was switched on; when navigation begins, if it is not known (NaN).
    """

    gyro: float
    accel: float
    time: float
    begin: float = math.nan

    def since(self, begun: float) -> float:
        """When it was switched on, of a navigation that began at a time."""
        return begun if math.isnan(self.begin) else self.begin

    def due(self, told: float, begun: float) -> float:
        """Time at which a change that was last told of at another is to be told of again."""
        t = max(told - self.since(begun), 0.0)
        return told + PACE * (t + EARLY) if t < FADED * self.time else math.inf

    def variances(self, told: float, time: float, begun: float) -> dict[str, float]:
        """Variances of the change between two times, by block of states."""
        left = [math.exp(-2.0 * max(t - self.since(begun), 0.0) / self.time) for t in (told, time)]
        share = left[0] - left[1]
        return {"gyro_bias": share * self.gyro**2, "accel_bias": share * self.accel**2}

    def within(self, sensors: ImuUncertainty, begin: float, end: float) -> ImuUncertainty:
        """Uncertainty of sensors over a time in which they warm up: as if they walked evenly."""
        share = self.variances(begin, end, begin)

        def walked(drift: BiasDrift, variance: float) -> BiasDrift:
            steps = np.sqrt(np.square(drift.steps) + variance / max(end - begin, SAME_INSTANT))
            return replace(drift, walk=triad_of(steps))

        return replace(
            sensors,
            gyro_drift=walked(sensors.gyro_drift, share["gyro_bias"]),
            accel_drift=walked(sensors.accel_drift, share["accel_bias"]),
        )


@dataclass(frozen=True)
class Navigator:
    """Navigate by motion increments and measurements of aids.

    The mechanization goes from sample to sample; a step that contains an epoch is split there.
    The covariance is propagated at the filter's own `step` and at every epoch. A log may be given
    in chunks of any length, and each aid's table whole or in parts, as long as an epoch is given
    before the samples that follow it: the result is the same to the last bit.

    Attributes
    ----------
    filter : ErrorFilter
        Its model must have the states of every aid (`with_states`).
    aids : tuple of Aid
        With names of their own.
    mark_interval : float, s
        Longest time between two marks of the covariance.
    damping : Correction
        Whether the estimated errors are fed back, subtracted from the output, or left on it.
    smoother : RauchTungStriebel, optional
        If given, the chunks hold the smoother history, too; the filter's result is the same to
        the last bit.
    about : Reference, optional
        What a smoothed run is linearized about; the filter's own estimates, if not given.
    warming : Warming, optional
        Change of the biases of a unit that becomes warm.
    wrong : tuple of Wrong
        Stretches over which an earlier run went wrong.

    Raises
    ------
    ConfigError
        Two aids have one name, or a smoother is to correct what is not corrected.
    """

    filter: ErrorFilter
    aids: tuple[Measurement, ...] = ()
    mark_interval: float = 1.0
    damping: Correction = field(default_factory=ClosedLoop)
    smoother: RauchTungStriebel | None = None
    about: Reference | None = None
    warming: Warming | None = None
    wrong: tuple[Wrong, ...] = ()

    def __post_init__(self) -> None:
        if self.smoother is not None and not self.damping.corrects:
            raise ConfigError("navigation.smoother-without-correction", quantity="smoother")
        names = [aid.name for aid in self.aids]
        for name in names:
            if not name or names.count(name) > 1:
                raise ConfigError(
                    "navigation.aid-name-taken" if name else "navigation.aid-without-name",
                    quantity="aiding",
                    name=name,
                )

    @cached_property
    def lone_receiver(self) -> Gnss | None:
        """The only aid, if it is a receiver with white errors, and its rule has a linear range."""
        if len(self.aids) != 1 or type(self.aids[0]) is not Gnss:
            return None
        aid = self.aids[0]
        return aid if not aid.states() and self.linear_range is not None else None

    @cached_property
    def linear_range(self) -> Array | None:
        """Rule of the first aid, as `robust.linear_range`."""
        return linear_range(self.aids[0].rule or self.filter.rule)

    @cached_property
    def by_name(self) -> dict[str, Measurement]:
        """Aids by their names."""
        return {aid.name: aid for aid in self.aids}

    @cached_property
    def tables(self) -> tuple[str, ...]:
        """Names of the aids with tables."""
        return tuple(aid.name for aid in self.aids if isinstance(aid, TabulatedMeasurement))

    def tabulated(self, name: str) -> TabulatedMeasurement:
        """Return the aid with a table that has this name; any other name is refused."""
        aid = self.by_name.get(name)
        if isinstance(aid, TabulatedMeasurement):
            return aid
        code = "navigation.no-aid-table"
        raise ConfigError(code, quantity="aiding", name=name, word=name, known=self.tables)

    def begin(self, start: NavState, P: Array) -> NavigatorState:
        """Return the state at a start.

        Parameters
        ----------
        P : ndarray, (p, p)
            As `ErrorFilter.begin`.
        """
        return self.begin_from(self.filter.begin(start, P))

    def begin_from(self, state: FilterState) -> NavigatorState:
        """Return the state at a state of the filter, as at the end of an alignment."""
        nothing = Epochs(np.empty(0), np.empty((0, 0)))
        return NavigatorState(
            engine=begun(self.filter, state, self.damping.feeds_back),
            queues={aid.name: nothing for aid in self.aids},
            memories={
                aid.name: aid.begin() for aid in self.aids if isinstance(aid, ImuDerivedMeasurement)
            },
            marked=-np.inf,
            observed=state.time,
            begun=state.time,
            warmed=state.time,
            tilted=is_large(self.filter.physical_covariance(state)),
        )

    def tell(self, state: NavigatorState, name: str, table: pd.DataFrame) -> NavigatorState:
        """Add rows to the table of an aid, later than its earlier rows.

        Parameters
        ----------
        name : str
            Of the aid.
        """
        more = self.tabulated(name).epochs(table)
        queue = state.queues[name]
        if queue.time.size:
            # An epoch may be before those of an earlier row: a velocity with a delay.
            both = np.concatenate([queue.time, more.time])
            order = np.argsort(both, kind="stable")
            more = Epochs(both[order], np.concatenate([queue.values, more.values])[order])
        return replace(state, queues={**state.queues, name: more})

    def advance(
        self, state: NavigatorState, time: Array, rows: Array
    ) -> tuple[NavigatorState, NavigationChunk]:
        """Process motion increments.

        Parameters
        ----------
        time : ndarray, (k,), s
            Ends of the steps.
        rows : ndarray, (k, 10)
            Rows of a MotionIncrements table.

        Raises
        ------
        DivergenceError
            The state is outside the validity of the mechanization; the sample is named.
        """
        loop = EpochLoop(self, state)
        # Compiled code has one type for writable and another for read-only arrays.
        stamps = np.require(time, np.float64, ["C", "W"])
        loop.process(stamps, np.require(rows, np.float64, ["C", "W"]))
        return loop.state(), loop.chunk()

    def finish(self, state: NavigatorState) -> NavigationChunk:
        """Return a mark of the newest sample, after the last epoch; the state is unchanged.

        Returns
        -------
        NavigationChunk
            Without samples; without a mark if there is one already.
        """
        loop = EpochLoop(self, state)
        if state.time > state.marked + SAME_INSTANT:
            loop.engine.close()
            loop.mark()
        return loop.chunk()

    def engine(self, state: EngineState) -> Engine:
        """Return the engine for a state: compiled, if available for the modules."""
        if self.about is not None:
            return ReferenceEngine(self.filter, state)
        if self.damping.feeds_back and compiled(self.filter):
            return CompiledEngine.going_on(self.filter, state)
        return GeneralEngine(self.filter, state, self.damping.feeds_back, self.damping.corrects)


def with_states(filter_: ErrorFilter, aids: tuple[Measurement, ...]) -> ErrorFilter:
    """Return a filter whose model has the states of the aids, too."""
    more = tuple(state for aid in aids for state in aid.states())
    model = replace(filter_.model, sensors=(*filter_.model.sensors, *more))
    return replace(filter_, model=model)


def with_aids(navigator: Navigator, aids: tuple[Measurement, ...]) -> Navigator:
    """Return a navigator with other options of its aids, and the states that these state."""
    filter_ = navigator.filter
    count = sum(len(aid.states()) for aid in navigator.aids)
    own = filter_.model.sensors[: len(filter_.model.sensors) - count]
    bare = replace(filter_, model=replace(filter_.model, sensors=own))
    return replace(navigator, filter=with_states(bare, aids), aids=aids)


# State of a navigator between chunks.


@dataclass(frozen=True, eq=False)
class NavigatorState:
    """State of a navigator between chunks.

    Attributes
    ----------
    engine : EngineState
        Of mechanization, estimates and covariance.
    queues : mapping of str to Epochs
        Of each aid, the epochs that have not been processed yet.
    memories : mapping of str to object
        Of each aid that is derived from the inertial sensors.
    marked : float, s
        Time of the last mark.
    observed : float, s
        Time of the last observation; the start, before the first.
    begun, warmed : float, s
        Begin of navigation, and until when the warming of the unit is in the covariance.
    scales : mapping of str to tuple of ScaleState
        By name of an observation with an adaptive rule: the scale learned of each component.
    steady : ndarray, (7,)
        Fading means of rate and specific force (`_kernels.steady_motion`) for aids that use them.
    tilted : bool
        Whether the tilt has been so uncertain since the start that its second order counts.
    kept : mapping of str to ndarray
        What aids keep from epoch to epoch (`View.kept`).
    """

    engine: EngineState
    queues: Mapping[str, Epochs]
    memories: Mapping[str, Any]
    marked: float
    observed: float
    begun: float = -np.inf
    warmed: float = -np.inf
    scales: Mapping[str, Scales] = field(default_factory=dict)
    steady: Array = field(default_factory=lambda: np.zeros(STEADY))
    tilted: bool = False
    kept: Mapping[str, Array] = field(default_factory=dict)

    @property
    def time(self) -> float:
        """Time of the newest sample, s."""
        return self.engine.time


# Processing of a chunk.


#: Averaging time that removes vibration from rates and forces, s: receivers do not see it beyond a
#: tenth of a second, and a vehicle hardly changes its acceleration in that time.
STEADY_TIME = 0.2
#: Time over which corrections of the velocity fade in `View.corrected`, s: long against that for
#: which a filter follows single fixes, short against that in which a tilt changes the velocity.
CORRECTED_TIME, CORRECTED = 3.0, "corrected"
#: A mark older than this is followed by another before an observation, so much earlier, s: what
#: lies between two marks would not show how far the standard deviation had grown.
AGED = 0.15
JUST_BEFORE = 1e-6
#: Relative size up to which a negative variance is rounding.
ROUNDING = 1e-12
#: Acceleration by which an inertial solution of any grade may be wrong, m/s².
WRONG = 3.0
PHYSICAL_LABELS = ("place", "velocity", "attitude")


def _reach(seconds: float) -> float:
    """Return by how much an inertial position may go wrong in some seconds, m."""
    return 0.5 * WRONG * seconds**2


def _is_away(scales: Scales, one: Observation, view: View) -> list[Rejection]:
    """Return rejections of an observation of which a component jumped and has not returned.

    A fix with a fault has it in all components, also where the solution may be off by so much.
    """
    if not any(view.time < of.held for of in scales):
        return []
    variances = np.einsum("ij,jk,ik->i", one.H, view.covariance, one.H) + one.R
    told = zip(scales, one.z.tolist(), variances.tolist(), strict=True)
    away = any(AdaptiveScale.is_away(of, z, s, view.time) for of, z, s in told)
    return [Rejection()] * len(scales) if away else []


class EpochLoop:
    """Processing of one chunk by a navigator."""

    def __init__(self, navigator: Navigator, state: NavigatorState) -> None:
        self.navigator = navigator
        self.engine = navigator.engine(state.engine)
        self.queues = dict(state.queues)
        self.memories = dict(state.memories)
        self.marked = state.marked
        self.observed = state.observed
        self.begun, self.warmed = state.begun, state.warmed
        self.scales = dict(state.scales)
        self.kept = dict(state.kept)
        self.tilted = state.tilted
        self.steady = state.steady.copy()
        self.begun_steady = state.steady
        self.steadies: Array | None = None
        self.seen: list[InnovationColumns] = []
        self.marks: list[CovarianceSnapshots] = []
        self.late: list[tuple[str, float]] = []
        self.engine.nodes = NodeRows(navigator.filter, navigator.smoother is not None)
        if state.marked == -np.inf:
            self.engine.nodes.began(self.engine.filter)
        self.time: Array = np.empty(0)
        self.history: Array = np.empty((0, navigator.filter.mechanization.row))
        self.follows = 0 if navigator.about is None else navigator.about.next_after(state.time)

    def process(self, time: Array, rows: Array) -> None:
        """Process steps, from epoch to epoch: propagate, split a step, or update."""
        rows = self._prepared(time, rows)
        done = self._fixes(0, time, rows)
        while True:
            due = min((q.time[0] for q in self.queues.values() if q.time.size), default=np.inf)
            epoch = min(due, self._next_reference())
            warmer = self._next_noise(time)
            if warmer < len(time) and time[warmer] < epoch - SAME_INSTANT:
                first, done = done, warmer + 1
                self._propagate(time[first:done], rows[first:done], self.history[first:done])
                self._add_noise()
                done = self._fixes(done, time, rows)
                continue
            # 1. The epoch is due now.
            if epoch <= self.engine.time + SAME_INSTANT:
                if due <= self.engine.time + SAME_INSTANT:
                    self._observe(self.engine.time)
                else:
                    self._follow()
                if done and self.engine.time <= time[done - 1] + SAME_INSTANT:
                    self.history[done - 1] = self.engine.shown()
                done = self._fixes(done, time, rows)
                continue
            # 2. The chunk ends before it.
            if done == len(time):
                return
            first, k = done, int(time.searchsorted(epoch - SAME_INSTANT))
            inside = k < len(time) and time[k] > epoch + SAME_INSTANT
            # 3. Steps before the epoch, with the one that ends at it.
            done = k if inside else min(k + 1, len(time))
            self._propagate(time[first:done], rows[first:done], self.history[first:done])
            # 4. The epoch is inside the next step: the part up to it now, the other one later.
            if inside:
                part, rest = np.empty(10), np.empty(10)
                split_increment(rows[k], epoch - self.engine.time, part, rest)
                rows[k] = rest
                unseen = np.empty((1, self.history.shape[1]))
                self._propagate(np.array([epoch]), part[None, :], unseen)

    def _next_noise(self, time: Array) -> int:
        """Index of the next step after which more noise is told of; their number if none is."""
        warming = self.navigator.warming
        due = [one.due(self.warmed) for one in self.navigator.wrong]
        if warming is not None:
            due.append(warming.due(self.warmed, self.begun))
        return int(time.searchsorted(min(due))) if due else len(time)

    def _add_noise(self) -> None:
        """Add the noise since the last time: of biases as a unit warms, and of wrong stretches."""
        warming, engine = self.navigator.warming, self.engine
        engine.close()
        filter_ = self.navigator.filter
        model = filter_.model
        Q = np.zeros((model.layout.size, model.layout.size))
        if warming is not None:
            for name, variance in warming.variances(self.warmed, engine.time, self.begun).items():
                if name in model.layout.places:
                    own = np.arange(model.layout.size)[model.layout[name]]
                    Q[own, own] = variance
        noise = sum(one.covariance(self.warmed, engine.time) for one in self.navigator.wrong)
        if np.any(noise):
            state = engine.filter
            E = model.from_physical(filter_.mechanization, state.time, state.row)[:, :9]
            Q += E @ noise @ E.T
        engine.carry(np.eye(model.physical_size), Q)
        self.warmed = engine.time

    def _next_reference(self) -> float:
        """Time of the next state of the reference."""
        about = self.navigator.about
        if about is None or self.follows == len(about.time):
            return np.inf
        return float(about.time[self.follows])

    def _follow(self) -> None:
        """Move the state to that of the reference."""
        about, engine = self.navigator.about, self.engine
        assert about is not None
        assert isinstance(engine, ReferenceEngine)
        engine.follow(about.states[self.follows], about.sensors[self.follows])
        self.follows += 1

    def _prepared(self, time: Array, rows: Array) -> Array:
        """Look at steps before they are processed; return those that may be split."""
        for aid in self.navigator.aids:
            if isinstance(aid, ImuDerivedMeasurement):
                self.memories[aid.name], self.queues[aid.name] = aid.watch(
                    self.memories[aid.name], time, rows
                )
        for name, queue in self.queues.items():
            if queue.time.size and queue.time[0] < self.engine.time - SAME_INSTANT:
                count = int(queue.time.searchsorted(self.engine.time - SAME_INSTANT))
                self.late += [(name, float(t)) for t in queue.time[:count]]
                self.queues[name] = Epochs(queue.time[count:], queue.values[count:])
        if len(time) and self._cuts(time):
            rows = rows.copy()
        if any(aid.wants_steady for aid in self.navigator.aids):
            self.steadies = np.empty((len(rows), 6))
            steady_motion(rows, STEADY_TIME, self.steady, self.steadies)
        self.time, self.history = time, np.empty((len(time), self.history.shape[1]))
        return rows

    def _cuts(self, time: Array) -> bool:
        """Whether an epoch is within a step, which is then split there."""
        for queue in self.queues.values():
            # Mostly no epoch is due: processing a single sample must not cost more for that.
            if not queue.time.size or queue.time[0] >= time[-1] - SAME_INSTANT:
                continue
            due = queue.time[: queue.time.searchsorted(time[-1] - SAME_INSTANT)]
            if (time[time.searchsorted(due - SAME_INSTANT)] > due + SAME_INSTANT).any():
                return True
        return False

    def _fixes(self, made: int, time: Array, rows: Array) -> int:
        """Process the fixes of a single receiver, and follow a reference; return the steps.

        Up to a fix without VD, or one that is rejected or doubted.
        """
        aid, engine, about = self.navigator.lone_receiver, self.engine, self.navigator.about
        if aid is None or not isinstance(engine, CompiledEngine):
            return made
        if self.tilted and about is None:
            return made
        rule = self.navigator.linear_range
        assert rule is not None
        interval = self.navigator.mark_interval * (1.0 - 1e-9)
        queue = self.queues[aid.name]
        until = self._next_noise(time)
        time, rows = time[: until + 1], rows[: until + 1]
        while made < len(time):
            due = int(queue.time.searchsorted(time[-1] + SAME_INSTANT, side="right"))
            if not due:
                break
            level = np.flatnonzero(queue.values[:due, 0] == HORIZONTAL_CODE)
            whole = int(level[0]) if len(level) else due
            if not whole:
                break
            usual = Epochs(queue.time[:whole], queue.values[:whole])
            references = NO_REFERENCES
            if about is not None:
                end = time[-1] + SAME_INSTANT if whole == due else queue.time[whole] - SAME_INSTANT
                references = about.part(self.follows, float(end))
            notes = (self.marked + interval, interval, AGED)
            learned = self._learned(aid)
            arm = np.asarray(aid.lever_arm, dtype=np.float64)
            receiver = arm, rule, learned, partial(self._step, aid, learned)
            made, fixed, why, followed = engine.propagate_with_fixes(
                time, rows, self.history, made, notes, receiver, usual, references
            )
            done, self.follows = len(fixed[0]), self.follows + followed
            self._fixed(aid, queue, fixed)
            if isinstance(aid.rule or self.navigator.filter.rule, AdaptiveRule):
                for code in set(queue.values[:done, 0].tolist()):
                    scales = learned[0 if code == POSITION_CODE else 1]
                    self.scales[aid.names(code)[0]] = tuple(map(ScaleState.of, scales.tolist()))
            queue = Epochs(queue.time[done:], queue.values[done:])
            if why == NOTE:
                self.mark()
            if why == ASK:
                break
        self.queues[aid.name] = queue
        return made

    def _step(
        self, aid: Gnss, learned: Array, code: float, j: int, nu: float, s: float, r: float
    ) -> Step:
        """Step of the rule of a receiver for a component of a fix; see `UpdateRule.step`."""
        rule = aid.rule or self.navigator.filter.rule
        assert rule is not None
        if isinstance(rule, AdaptiveRule):
            scale = ScaleState.of(learned[0 if code == POSITION_CODE else 1, j].tolist())
            rule = rule.scale.rule(scale, rule.influence)
        return rule.step(nu, s, r)

    def _learned(self, aid: Gnss) -> Array:
        """Scales that the rule of a receiver learned, of positions and velocities, (2, 3, 9)."""
        rule = aid.rule or self.navigator.filter.rule
        if not isinstance(rule, AdaptiveRule):
            return np.zeros((2, 3, len(ScaleState._fields)))
        names = (aid.names(code)[0] for code in (POSITION_CODE, VELOCITY_CODE))
        return np.array([self._scales(rule, name, 3) for name in names])

    def _scales(self, rule: AdaptiveRule, name: str, size: int) -> Scales:
        """Scales learned of the components of an observation, or their begin.

        A velocity has two components or three.
        """
        return (*self.scales.get(name, ()), *rule.begin(size))[:size]

    def _fixed(self, aid: Gnss, fixes: Epochs, fixed: tuple[Array, ...]) -> None:
        """Record the results of position fixes."""
        told, times, *marks = fixed
        if not len(times):
            return
        codes = fixes.values[: len(times), 0]
        for code in dict.fromkeys(codes.tolist()):
            of = codes == code
            innovations = Innovations(*told[of].transpose(1, 0, 2))
            self.seen.append(InnovationColumns(*aid.names(code), times[of, 1], innovations))
        rows = [each.reshape(-1, *each.shape[2:]) for each in (times - [JUST_BEFORE, 0.0], *marks)]
        made = np.flatnonzero(np.isfinite(rows[0]))
        # Without a copy where there is a mark before each fix: of an hour they are many.
        stamps, *kept = rows if len(made) == times.size else (each[made] for each in rows)
        self.marks.append(CovarianceSnapshots(stamps, *kept))
        self.marked, self.observed = float(stamps[-1]), float(times[-1, 1])

    def state(self) -> NavigatorState:
        """Current state."""
        return NavigatorState(
            self.engine.state(),
            self.queues,
            self.memories,
            self.marked,
            self.observed,
            self.begun,
            self.warmed,
            self.scales,
            self.steady,
            self.tilted,
            self.kept,
        )

    def chunk(self) -> NavigationChunk:
        """Result of the chunk."""
        return NavigationChunk(
            self.time,
            self.history,
            InnovationRecords(self.seen),
            CovarianceSnapshots.joined(self.marks, SAME_INSTANT),
            tuple(self.late),
            self.engine.nodes.blocks(),
            self.engine.left_at_nodes(),
        )

    def _steady(self, at: float) -> Array | None:
        """Rate and specific force without vibration, at the last sample before an instant."""
        if self.steadies is None:
            return None
        k = int(self.time.searchsorted(at + SAME_INSTANT, side="right"))
        if k:
            return np.asarray(self.steadies[k - 1])
        return self.begun_steady[:6] if self.begun_steady[6] else None

    def _velocity(self, at: float) -> Array:
        """Velocity of the mechanization, north-east-down, m/s."""
        mechanization = self.navigator.filter.mechanization
        return np.asarray(mechanization.nav_state(self.engine.mechanization, at).v_n)

    def _lately_corrected(self, at: float) -> Array:
        """Return `View.corrected` at an instant."""
        if CORRECTED not in self.kept:
            return np.zeros(3)
        *moved, when = self.kept[CORRECTED]
        return np.array(moved) * math.exp((when - at) / CORRECTED_TIME)

    def _propagate(self, time: Array, rows: Array, history: Array) -> None:
        """Propagate over steps without epochs, and mark the covariance in time."""
        made = 0
        while made < len(time):
            # Rounded to the interval of a decimal clock.
            note_at = self.marked + self.navigator.mark_interval * (1.0 - 1e-9)
            made += self.engine.propagate(time[made:], rows[made:], history[made:], note_at)
            if made < len(time):
                self.mark()

    def _observe(self, at: float) -> None:
        """Update with all observations at an instant."""
        engine, filter_ = self.engine, self.navigator.filter
        last = engine.last
        engine.close()
        self._forget(at)
        view = View(
            mechanization=filter_.mechanization,
            model=filter_.model,
            time=at,
            state=engine.mechanization,
            row=engine.row,
            sensors=engine.filter.sensors,
            rate=last[1:4] / last[0],
            force=last[4:7] / last[0],
            covariance_of=partial(filter_.physical_covariance, engine.filter),
            steady=self._steady(at),
            unobserved=at - self.observed,
            corrected=self._lately_corrected(at),
            kept=self.kept,
        )
        told: list[tuple[Measurement, Observation]] = []
        for aid in self.navigator.aids:
            queue = self.queues[aid.name]
            count = int(queue.time.searchsorted(at + SAME_INSTANT, side="right"))
            for values in queue.values[:count]:
                told += [(aid, one) for one in aid.observe(view, values)]
            self.queues[aid.name] = Epochs(queue.time[count:], queue.values[count:])
        if told:
            if np.isfinite(self.marked) and at > self.marked + AGED:
                self.mark(JUST_BEFORE)
            self.observed = at
            observations = [one for _, one in told]
            known = [self.engine.known(one) for one in observations]
            rules = [aid.rule or filter_.rule for aid, _ in told]
            innovations = self._told(rules, observations, view)
            if view.steady is not None:
                moved = self._velocity(at) - view.here.v_n
                self.kept[CORRECTED] = np.append(view.corrected + moved, at)
            for one, nu in zip(known, innovations, strict=True):
                row = Innovations(nu.nu[None], nu.s[None], nu.weight[None])
                columns = InnovationColumns(one.name, one.labels, np.array([at]), row, one)
                self.seen.append(columns)
        self.mark()

    def _forget(self, at: float) -> None:
        """Add to the uncertainty of states that something since the last observation changed."""
        model = self.navigator.filter.model
        for aid in self.navigator.aids:
            for name, sd in aid.forgotten(self.observed, at):
                Q = np.zeros((model.layout.size, model.layout.size))
                place = model.layout[name]
                Q[place, place] = sd**2 * np.eye(place.stop - place.start)
                self.engine.carry(np.eye(model.physical_size), Q)

    def _told(
        self, rules: list[UpdateRule | None], observations: list[Observation], view: View
    ) -> list[Innovations]:
        """Process observations; keep what their adaptive rules learn."""
        asked: list[Rules] = []
        for rule, one in zip(rules, observations, strict=True):
            if isinstance(rule, AdaptiveRule):
                scales = self._scales(rule, one.name, one.z.size)
                away = _is_away(scales, one, view)
                asked.append(away or rule.rules(scales))
            else:
                asked.append(rule)
        met = self.engine.filter
        innovations = self.engine.observe(observations, asked)
        self._unlearn(met)
        for rule, one, nu in zip(rules, observations, innovations, strict=True):
            if isinstance(rule, AdaptiveRule):
                before = self._scales(rule, one.name, one.z.size)
                after = rule.after(before, nu, one.R)
                if set(one.labels) <= set(PLACE):
                    after = rule.jumped((before, after), nu, self.engine.time, _reach)
                # A component that is not of this one keeps what it learned.
                others = self.scales.get(one.name, ())[len(after) :]
                self.scales[one.name] = (*after, *others)
        return innovations

    def _unlearn(self, met: FilterState) -> None:
        """Carry the covariance over the correction of a large tilt (second-order tilt)."""
        navigator = self.navigator
        if not self.tilted or not navigator.damping.feeds_back or navigator.about is not None:
            return
        filter_, engine = self.navigator.filter, self.engine
        before = filter_.physical_covariance(met)
        after = filter_.physical_covariance(engine.filter)
        Q = unlearnt_force(filter_, met, before, after)
        turned = turned_force(filter_, met, engine.filter)
        if turned is not None:
            T, first = turned
            size = filter_.model.layout.size
            engine.carry(T, np.zeros((size, size)) if Q is None else Q, first)
        self.tilted = is_large(after)

    def mark(self, before: float = 0.0) -> None:
        """Record covariance and estimates, with a time stamp so much earlier."""
        filter_, state = self.navigator.filter, self.engine.filter
        P, left = filter_.physical_covariance(state), self.engine.left()
        C_nl, ned = filter_.mechanization.level_from_ned(state.row).T, np.empty((9, 9))
        turn_blocks(np.ascontiguousarray(C_nl), P[:9, :9] + left[:, None] * left, ned)
        self.marked = state.time - before
        estimates, sd = self.engine.estimates(filter_), self._sd(state.time, P)
        row = CovarianceSnapshots(np.array([self.marked]), ned[None], estimates[None], sd[None])
        self.marks.append(row)

    def _sd(self, time: float, P: Array) -> Array:
        """Standard deviations of the sensor errors; refuses an invalid covariance."""
        variances, model = np.diagonal(P), self.navigator.filter.model
        if variances.min() >= 0.0:
            return np.sqrt(variances[9:])
        kinds = np.concatenate(
            [np.repeat(variances[:9].reshape(3, 3).max(axis=1), 3), np.square(model.stacked.sd)]
        )
        good = variances >= -ROUNDING * kinds
        if not good.all():
            k = int(np.argmin(good))
            label = PHYSICAL_LABELS[k // 3] if k < 9 else list(model.layout.labels())[k - len(P)]
            raise LostCovarianceError(
                "navigation.variance-lost",
                place=np.asarray(variances[:3]),
                quantity="covariance",
                state=label,
                variance=variances[k],
                time=time,
            )
        return np.sqrt(np.maximum(variances[9:], 0.0))
