"""Navigation pipeline of system C: IMU samples and measurement tables in, navigation out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from statistics import median
from typing import Literal

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Site
from strapdown.errors import ConfigError, DataError, DivergenceError, check_choice
from strapdown.estimation.error_filter import FilterState
from strapdown.navigation.handover import align, from_state, handed_over, unused_fixes, with_drift
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.modes import (
    Aligned,
    CoarseMode,
    Command,
    KnownStart,
    Mode,
    Navigation,
    PipelineChunk,
    check_timeline,
)
from strapdown.navigation.navigator import Navigator, NavigatorState, with_aids
from strapdown.navigation.preprocessing import (
    Hole,
    ImuIncrements,
    ImuPreprocessor,
    ImuPreprocessorState,
    widened,
)
from strapdown.navigation.record import Event, GrowingRows, InnovationRecord, NavigationChunk, Span
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables.checks import Array, is_number

# Monitor measurements: outages, recoveries, rejected and late observations.


# Number of intervals whose median is the measurement's own.
INTERVALS = 5


@dataclass(frozen=True)
class Rejected:
    """Consecutive rejected observations of one name.

    Attributes
    ----------
    begin, end : float, s
    largest : float
        In expected standard deviations.
    """

    begin: float
    end: float
    count: int
    largest: float


@dataclass(frozen=True)
class MeasurementStatus:
    """Status of one measurement.

    Attributes
    ----------
    newest : float, s
        Time of its last observation; before the first, the begin of navigation.
    intervals : tuple of float, s
        The last ones, without outages.
    seen : bool
        Whether it has observed anything.
    out : bool
        Whether its outage has been reported.
    """

    newest: float
    intervals: tuple[float, ...] = ()
    seen: bool = False
    out: bool = False


@dataclass(frozen=True, eq=False)
class MeasurementMonitorState:
    """State between chunks.

    Attributes
    ----------
    rejected : mapping of str to Rejected
        By name of the observation.
    late : mapping of str to Rejected
        By name of the measurement.
    begun : float, s
        Begin of navigation: observations before it are not late.
    """

    aids: Mapping[str, MeasurementStatus]
    rejected: Mapping[str, Rejected] = field(default_factory=dict)
    late: Mapping[str, Rejected] = field(default_factory=dict)
    begun: float = math.nan


@dataclass(frozen=True)
class MeasurementMonitor:
    """Report events of measurements; the state is kept by the caller.

    Attributes
    ----------
    outage : float
        A measurement with a table is in outage when it is silent for longer than this multiple of
        its own interval, the median of the last five. Before the second observation the interval
        is unknown, and an outage at the start is reported at its end.
    """

    outage: float = 3.0

    def __post_init__(self) -> None:
        if not is_number(self.outage) or not self.outage > 1.0:
            raise ConfigError(
                "navigation.outage-intervals-not-above-one", quantity="outage", outage=self.outage
            )

    def begin(self, tables: Sequence[str]) -> MeasurementMonitorState:
        """Return the state before navigation, for measurements with tables."""
        return MeasurementMonitorState({name: MeasurementStatus(math.nan) for name in tables})

    def started(self, state: MeasurementMonitorState, time: float) -> MeasurementMonitorState:
        """Return the state at the begin of navigation."""
        aids = {name: replace(one, newest=time) for name, one in state.aids.items()}
        return replace(state, aids=aids, begun=time)

    def process(
        self, state: MeasurementMonitorState, piece: NavigationChunk, time: float
    ) -> tuple[MeasurementMonitorState, list[Event], list[tuple[str, Span]]]:
        """Process the output of a chunk.

        Parameters
        ----------
        time : float, s
            Time of the newest step.

        Returns
        -------
        state : MeasurementMonitorState
        events : list of Event
        outages : list of (str, Span)
            Ended outages.
        """
        aids, rejected, late = dict(state.aids), dict(state.rejected), dict(state.late)
        events: list[Event] = []
        outages: list[tuple[str, Span]] = []
        for name, at in piece.late:
            if at > state.begun:
                late[name] = _more(late.get(name), at, 0.0)
        for one in piece.seen:
            name = one.name.rpartition(".")[0]
            if name in late:
                events.append(_unused("late", name, late.pop(name)))
            if not one.innovations.weight.any():
                rejected[one.name] = _more(rejected.get(one.name), one.time, _in_sd(one))
            elif one.name in rejected:
                events.append(_unused("rejected", one.name, rejected.pop(one.name)))
            if name in aids:
                aids[name] = self._delivered(name, aids[name], one, events, outages)
        for name, aid in aids.items():
            longest = self._longest(aid)
            if not aid.out and time - aid.newest > longest:
                events.append(_out(name, aid.newest + longest, aid.newest))
                aids[name] = replace(aid, out=True)
        return MeasurementMonitorState(aids, rejected, late, state.begun), events, outages

    def finish(
        self, state: MeasurementMonitorState, time: float
    ) -> tuple[list[Event], list[tuple[str, Span]]]:
        """Report rejections and outages that are open at the end."""
        events = [_unused("rejected", name, one) for name, one in state.rejected.items()]
        events += [_unused("late", name, one) for name, one in state.late.items()]
        outages = []
        for name, aid in state.aids.items():
            if aid.out or (not aid.seen and time > aid.newest):
                outages.append((name, Span(name, aid.newest, time)))
                if not aid.out:
                    events.append(Event.of(aid.newest, "outage", "never-observed", name=name))
        return events, outages

    def _longest(self, aid: MeasurementStatus) -> float:
        if not aid.intervals:
            return math.inf
        return self.outage * median(aid.intervals)

    def _delivered(
        self,
        name: str,
        aid: MeasurementStatus,
        one: InnovationRecord,
        events: list[Event],
        outages: list[tuple[str, Span]],
    ) -> MeasurementStatus:
        """Process an observation of a measurement."""
        if one.time <= aid.newest and aid.seen:
            return aid
        since = one.time - aid.newest
        longest = self._longest(aid)
        if since > longest:
            if not aid.out:
                events.append(_out(name, aid.newest + longest, aid.newest))
            outages.append((name, Span(name, aid.newest, one.time)))
            values = {"since": since, "observation": one.name, "sd": _in_sd(one)}
            events.append(Event.of(one.time, "recovered", "recovered", name=name, **values))
            return replace(aid, newest=one.time, out=False)
        if not aid.seen:
            return replace(aid, newest=one.time, seen=True)
        intervals = (*aid.intervals, since)[-INTERVALS:]
        return replace(aid, newest=one.time, intervals=intervals)


def _in_sd(one: InnovationRecord) -> float:
    """Largest component of an innovation in expected standard deviations."""
    return float(np.abs(one.innovations.nu / np.sqrt(one.innovations.s)).max())


def _more(known: Rejected | None, at: float, size: float) -> Rejected:
    if known is None:
        return Rejected(at, at, 1, size)
    return Rejected(known.begin, max(known.end, at), known.count + 1, max(known.largest, size))


def _unused(kind: Literal["rejected", "late"], name: str, one: Rejected) -> Event:
    code = f"{kind}-once" if one.count == 1 else kind
    return Event.of(one.begin, kind, code, name=name, **asdict(one))


def _out(name: str, at: float, newest: float) -> Event:
    return Event.of(at, "outage", "outage", name=name, since=newest)


Three = tuple[float, float, float]

#: Columns of a step kept for an alignment: time, six values, ten increments.
KEPT = 17
#: How long measurements are kept during navigation, for an alignment after a gap, s.
REMEMBERED = 60.0


@dataclass(frozen=True, eq=False)
class PipelineState:
    """Complete state of a pipeline between two chunks.

    Attributes
    ----------
    mode : int
        Index of the mode in the pipeline's `modes`.
    begun : float, s
        When the mode began; NaN before the first sample.
    next_try : float, s
        Time from `begun` to the next attempt to align.
    kept : GrowingRows
        Steps of an alignment.
    aligned : Aligned or None
        Result of the previous mode.
    told : mapping of str to tuple of DataFrame
        Measurement tables, as long as an alignment may need them.
    commands : tuple of Command
        Pending commands.
    holes : tuple of Hole
        Gaps that the steps have not reached yet.
    deliveries : MeasurementMonitorState
        Measurements received so far.
    time : float, s
        Time of the newest step.
    """

    intake: ImuPreprocessorState
    mode: int
    begun: float
    next_try: float
    kept: GrowingRows
    aligned: Aligned | None
    told: Mapping[str, tuple[pd.DataFrame, ...]]
    commands: tuple[Command, ...]
    holes: tuple[Hole, ...]
    navigator: NavigatorState | None
    deliveries: MeasurementMonitorState
    time: float


@dataclass(frozen=True, eq=False)
class NavigationPipeline:
    """Run preprocessing, coarse and fine alignment, and navigation as a sequence of modes.

    Samples may arrive in chunks of any length, and the table of each measurement at once or row by
    row, as long as a row arrives before the samples that follow it: the results are identical to
    the last bit. Methods do not change the state passed in.

    During an alignment the steps of its mode (136 bytes each; limited by the `window` of a coarse
    mode) and the measurements are kept; afterwards only the states of the stages.

    Attributes
    ----------
    modes : tuple of Mode
        The last is navigation.
    start : KnownStart, optional
        Initial state, for a sequence of navigation alone.
    sensors : ImuUncertainty, optional
        For alignments.
    site : Site, optional
        Position during the alignment; from fixes, if not given.
    site_sd : tuple of float, (3,), m
        Standard deviation of the site, north, east, down.
    velocity_sd : tuple of float, (3,), m/s
        Standard deviation of the velocity after a coarse alignment at a site, where it is zero.
    drift : tuple of float, (2,), rad/s, optional
        Error of the gyros about down with which navigation begins, and its standard deviation: a
        hypothesis, beside what is stated of the sensors.
    fixes : str, optional
        Name of the measurement whose table holds the fixes of an alignment; the first GNSS
        receiver, if not given.
    deliveries : MeasurementMonitor
        Reports outages, recoveries and rejections.

    Raises
    ------
    ConfigError
        The order of the modes is invalid, or a required input is missing.
    """

    navigator: Navigator
    intake: ImuPreprocessor = field(default_factory=ImuPreprocessor)
    modes: tuple[Mode, ...] = (Navigation(),)
    start: KnownStart | None = None
    sensors: ImuUncertainty | None = None
    site: Site | None = None
    site_sd: Three = (1.0, 1.0, 1.0)
    velocity_sd: Three = (0.1, 0.1, 0.1)
    drift: tuple[float, float] | None = None
    fixes: str | None = None
    commands: tuple[Command, ...] = ()
    deliveries: MeasurementMonitor = field(default_factory=MeasurementMonitor)

    def __post_init__(self) -> None:
        check_timeline(self.modes, self.start is not None)
        if len(self.modes) > 1 and self.sensors is None:
            raise ConfigError("navigation.alignment-without-sensor-errors", quantity="sensors")
        if self.intake.gaps.beyond == "align" and len(self.modes) == 1:
            raise ConfigError("navigation.no-alignment-after-gap", quantity="gaps")
        for command in self.commands:
            self._check_word(command.word)
        if self.fixes is not None:
            check_choice(
                "navigation.no-aid-table-2",
                self.navigator.tables,
                quantity="fixes",
                fixes=self.fixes,
            )

    @property
    def fixes_from(self) -> str | None:
        """Name of the measurement whose table holds the fixes of an alignment."""
        if self.fixes is not None:
            return self.fixes
        return next((aid.name for aid in self.navigator.aids if aid.kind == "gnss"), None)

    def begin(self, sampling: str = "instantaneous", source: str | None = None) -> PipelineState:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling : {'instantaneous', 'mean'}
            As `tables.imu_table`.
        source : str, optional
            Name of the samples, for messages.
        """
        return PipelineState(
            intake=self.intake.begin(sampling, source),
            mode=0,
            begun=np.nan,
            next_try=np.inf,
            kept=GrowingRows.of(KEPT),
            aligned=None,
            told=dict.fromkeys(self.navigator.tables, ()),
            commands=tuple(sorted(self.commands, key=lambda one: one.time)),
            holes=(),
            navigator=None,
            deliveries=self.deliveries.begin(self.navigator.tables),
            time=-np.inf,
        )

    def tell(self, state: PipelineState, name: str, table: pd.DataFrame) -> PipelineState:
        """Append rows to the table of a measurement, later than those before.

        Parameters
        ----------
        name : str
            Name of the measurement.

        Raises
        ------
        ConfigError
            Unknown measurement.
        DataError
            The table is not valid.
        """
        if state.navigator is not None:
            told = self.navigator.tell(state.navigator, name, table)
            state = replace(state, navigator=told)
            return (
                self._remembering(state, name, table)
                if self.intake.gaps.beyond == "align"
                else state
            )
        # Validated on arrival, not after an alignment.
        self.navigator.tabulated(name).epochs(table)
        return self._remembering(state, name, table)

    def command(self, state: PipelineState, word: str, time: float = -np.inf) -> PipelineState:
        """Take a command.

        Parameters
        ----------
        word : str
            As `Command.word`.
        time : float, s
            The command holds from the first sample at or after it; from the next one, if not given.
        """
        self._check_word(word)
        commands = sorted((*state.commands, Command(time, word)), key=lambda one: one.time)
        return replace(state, commands=tuple(commands))

    def advance(
        self, state: PipelineState, time: Array, values: Array, last: bool = False
    ) -> tuple[PipelineState, PipelineChunk]:
        """Process samples.

        Parameters
        ----------
        time : ndarray, (k,), s
            Stamps.
        values : ndarray, (k, 6)
            Rates in rad/s and specific forces in m/s², axes of the sensors.
        last : bool
            Whether no sample follows: a pre-filter then releases its delayed samples.

        Raises
        ------
        DataError
            The samples are invalid, a gap exceeds the limit for bridging, or the alignment is not
            possible.
        DivergenceError
            As `Navigator.advance`.
        """
        intake, steps = self.intake.advance(state.intake, time, values, last)
        sequencer = ModeSequencer(self, replace(state, intake=intake))
        sequencer.process(steps)
        return sequencer.state(), sequencer.chunk(last)

    def finish(self, state: PipelineState) -> tuple[PipelineState, PipelineChunk]:
        """End the input, as the last chunk does with `last`."""
        return self.advance(state, np.empty(0), np.empty((0, 6)), last=True)

    def _remembering(self, state: PipelineState, name: str, table: pd.DataFrame) -> PipelineState:
        """Keep a table for a later alignment; during navigation drop expired rows."""
        known = state.told[name]
        if state.navigator is not None:
            known = tuple(one for one in known if one.index[-1] > state.time - REMEMBERED)
        return replace(state, told={**state.told, name: (*known, table)})

    def _check_word(self, word: str) -> None:
        words = ("next", *(mode.name for mode in self.modes[1:]))
        if word not in words:
            raise ConfigError(
                "navigation.unknown-mode", quantity="commands", word=word, known=words
            )


# Processing of one chunk: modes, gaps, navigation.


# Stamps are rounded decimal fractions: tolerance of an instant, s.
INSTANT = 1e-7
#: Columns of a kept step.
TIME, VALUES, ROWS = 0, slice(1, 7), slice(7, 17)


class ModeSequencer:
    """Mode sequence during one chunk."""

    def __init__(self, chain: NavigationPipeline, state: PipelineState) -> None:
        self._chain = chain
        self._state = state
        self._navigation: list[NavigationChunk] = []
        self._aligned: list[Aligned] = []
        self._events: list[Event] = []
        self._modes: list[Span] = []
        self._outages: list[tuple[str, Span]] = []

    def process(self, steps: ImuIncrements) -> None:
        """Process the steps of a chunk."""
        for hole in steps.holes:
            self._found(hole)
        gaps = {hole.begin for hole in steps.holes}
        cut_off = [hole for hole in steps.cut_off if hole.begin not in gaps]
        if cut_off:
            both = sorted((*self._state.holes, *cut_off), key=lambda hole: hole.begin)
            self._state = replace(self._state, holes=tuple(both))
        kept = np.empty((len(steps.time) + (steps.opening is not None), 17))
        if steps.opening is not None:
            kept[0, TIME], kept[0, VALUES] = steps.opening
            kept[0, ROWS] = 0.0
        own = kept[len(kept) - len(steps.time) :]
        own[:, TIME], own[:, VALUES], own[:, ROWS] = steps.time, steps.values, steps.rows
        while len(kept):
            kept = self._some(kept)

    def state(self) -> PipelineState:
        """Return the present state."""
        return self._state

    def chunk(self, last: bool) -> PipelineChunk:
        """Return the output of the chunk."""
        if last:
            self._end()
        state = self._state
        return PipelineChunk(
            mode=self._chain.modes[state.mode].name,
            time=state.time,
            navigation=tuple(self._navigation),
            aligned=tuple(self._aligned),
            events=tuple(self._events),
            modes=tuple(self._modes),
            outages=tuple(self._outages),
        )

    def _end(self) -> None:
        if self._state.navigator is None:
            self._align_at_end()
        state = self._state
        mode = self._chain.modes[state.mode].name
        if state.navigator is None:
            raise DataError(
                "navigation.samples-end-mode-before-navigation",
                file=state.intake.source,
                quantity="time",
                time=state.time,
                mode=mode,
            )
        self._navigation.append(self._chain.navigator.finish(state.navigator))
        self._modes.append(Span(mode, state.begun, state.time))
        events, outages = self._chain.deliveries.finish(state.deliveries, state.time)
        self._events += events
        self._outages += outages

    def _align_at_end(self) -> None:
        """Align by all samples: an alignment back to the begin leaves them to navigation.

        One that misses its limits is refused with its accuracy.
        """
        state, mode = self._state, self._chain.modes[self._state.mode]
        if mode.kind == "navigation" or not mode.until.converges:
            return
        try:
            found = align(self._chain, state)
        except (DataError, DivergenceError):
            return
        roll, pitch, heading = found.alignment.sd_deg_to_begin.tolist()
        follows = self._chain.modes[state.mode + 1].kind
        back = isinstance(mode, CoarseMode) and getattr(mode.way, "backtrack", False)
        if back and follows == "navigation" and mode.until.met(heading, max(roll, pitch)):
            self._converged(found)
            return
        raise DataError(
            "navigation.samples-end-alignment-too-uncertain",
            file=state.intake.source,
            quantity="time",
            time=state.time,
            mode=mode.name,
            heading_deg=heading,
            tilt_deg=max(roll, pitch),
        )

    def _converged(self, found: Aligned) -> None:
        """End a mode by an alignment that meets its limits."""
        roll, pitch, heading = found.alignment.sd_deg.tolist()
        sd = {"heading_deg": heading, "tilt_deg": max(roll, pitch)}
        self._aligned_to(found, self._state.mode + 1, "mode-converged", **sd)

    def _found(self, hole: Hole) -> None:
        policy = self._chain.intake.gaps
        gap = {"length": hole.length, "begin": hole.begin, "end": hole.end}
        if hole.length > policy.bridge and policy.beyond == "refuse":
            raise DataError(
                "navigation.gap", file=self._state.intake.source, quantity="time", data=gap
            )
        anew = hole.length > policy.bridge and policy.beyond == "align"
        code = "gap-before-alignment" if anew else "gap-bridged"
        self._events.append(Event.of(hole.begin, "gap", code, **gap))
        self._state = replace(self._state, holes=(*self._state.holes, hole))

    def _some(self, kept: Array) -> Array:
        """Process steps up to the next event; return the remaining ones."""
        if np.isnan(self._state.begun):
            self._begin_mode(0, float(kept[0, TIME]))
        state = self._state
        due = self._due()
        count = len(kept)
        if due < np.inf:
            count = min(count, int(np.searchsorted(kept[:, TIME], due - INSTANT)) + 1)
        if state.holes:
            # Steps that end by the begin of a gap precede it.
            before = int(np.searchsorted(kept[:, TIME], state.holes[0].begin + INSTANT))
            if before == 0:
                self._over_hole()
                return kept
            count = min(count, before)
        now = kept[:count]
        self._state = replace(state, time=float(now[-1, TIME]))
        if state.navigator is None:
            self._keep(now)
        else:
            self._navigate(now)
        if self._state.time >= due - INSTANT:
            self._at_due()
        return kept[count:]

    def _begin_mode(self, place: int, time: float) -> None:
        mode = self._chain.modes[place]
        self._state = replace(
            self._state,
            mode=place,
            begun=time,
            next_try=mode.until.next_try(0.0),
            kept=GrowingRows.of(ROWS.stop),
        )
        self._events.append(Event.of(time, "mode", "mode-begins", mode=mode.name))

    def _due(self) -> float:
        """Time of the next event other than a sample."""
        state, chain = self._state, self._chain
        mode = chain.modes[state.mode]
        due = state.commands[0].time if state.commands else np.inf
        if mode.kind != "navigation":
            return min(due, state.begun + min(mode.until.duration, state.next_try))
        if state.navigator is None and chain.start is not None:
            return -np.inf if chain.start.at_first_sample else chain.start.state.time
        return due

    def _over_hole(self) -> None:
        """Process the step over a gap."""
        state, policy = self._state, self._chain.intake.gaps
        hole, *others = state.holes
        state = replace(state, holes=tuple(others))
        if hole.length > policy.bridge and policy.beyond == "align":
            mode = self._chain.modes[state.mode]
            self._modes.append(Span(mode.name, state.begun, hole.begin))
            if state.navigator is not None:
                self._navigation.append(self._chain.navigator.finish(state.navigator))
            self._state = replace(
                state, begun=np.nan, kept=GrowingRows.of(ROWS.stop), aligned=None, navigator=None
            )
            return
        if state.navigator is not None:
            state = replace(state, navigator=widened(self._chain.navigator, state.navigator, hole))
        self._state = state

    def _keep(self, now: Array) -> None:
        """Keep steps for an alignment."""
        state = self._state
        mode = self._chain.modes[state.mode]
        if mode.kind == "navigation":
            return
        kept = state.kept.and_then(now)
        if isinstance(mode, CoarseMode):
            old = int(np.searchsorted(kept.rows[:, TIME], state.time - mode.window - INSTANT))
            if 2 * old > kept.count:
                kept = kept.without_first(old)
        self._state = replace(state, kept=kept)

    def _navigate(self, now: Array) -> None:
        state, chain = self._state, self._chain
        assert state.navigator is not None
        after, piece = chain.navigator.advance(
            state.navigator, now[:, TIME], np.ascontiguousarray(now[:, ROWS])
        )
        self._navigation.append(piece)
        told = chain.deliveries.process(state.deliveries, piece, float(now[-1, TIME]))
        deliveries, events, outages = told
        self._events += events
        self._outages += outages
        self._state = replace(state, navigator=after, deliveries=deliveries)

    def _at_due(self) -> None:
        """Do what is due at the present time."""
        state = self._state
        mode = self._chain.modes[state.mode]
        if mode.kind == "navigation" and state.navigator is None:
            self._start_known()
            return
        if state.commands and state.commands[0].time <= state.time + INSTANT:
            self._obey()
            return
        elapsed = state.time - state.begun
        if elapsed >= mode.until.duration - INSTANT:
            found = align(self._chain, state)
            self._aligned_to(found, state.mode + 1, "mode-timed-out", elapsed=elapsed)
            return
        self._state = replace(state, next_try=mode.until.next_try(elapsed))
        try:
            found = align(self._chain, state)
        except (DataError, DivergenceError):
            # Not yet; the longest duration gives the reason.
            return
        roll, pitch, heading = found.alignment.sd_deg_to_begin.tolist()
        if mode.until.met(heading, max(roll, pitch)):
            self._converged(found)

    def _obey(self) -> None:
        """Execute the next command."""
        state, chain = self._state, self._chain
        command, *others = state.commands
        self._state = state = replace(state, commands=tuple(others))
        names = [mode.name for mode in chain.modes]
        place = state.mode + 1 if command.word == "next" else names.index(command.word)
        if place <= state.mode or place >= len(names):
            late = Event.of(state.time, "command", "command-past", word=command.word)
            self._events.append(late)
            return
        try:
            found = align(chain, state)
        except (DataError, DivergenceError) as error:
            refused = {"word": command.word, "mode": names[state.mode], "reason": error.finding}
            early = Event.of(state.time, "command", "command-too-early", **refused)
            self._events.append(early)
            return
        self._events.append(Event.of(state.time, "command", "command", word=command.word))
        self._aligned_to(found, place, "mode-commanded")

    def _aligned_to(self, found: Aligned, place: int, why: str, **values: float) -> None:
        """End an alignment mode and begin the next mode."""
        state, chain = self._state, self._chain
        self._aligned.append(found)
        self._modes.append(Span(found.mode, state.begun, state.time))
        self._events.append(Event.of(state.time, "mode", why, mode=found.mode, **values))
        kept = state.kept.rows
        if chain.modes[place].kind == "navigation":
            begun = handed_over(chain, state, found)
            self._begin_mode(place, begun.time)
            self._begin_navigation(begun, without=unused_fixes(chain, state, begun.time))
            rest = kept[kept[:, TIME] > begun.time + INSTANT]
            if len(rest):
                self._navigate(rest)
            return
        # The last sample of an alignment is the first of the next.
        last = kept[-1:].copy()
        self._begin_mode(place, state.time)
        self._state = replace(
            self._state, aligned=found, kept=GrowingRows.of(ROWS.stop).and_then(last)
        )

    def _start_known(self) -> None:
        """Begin navigation with the known initial state."""
        state, start = self._state, self._chain.start
        assert start is not None
        slack = 0.5 * state.intake.usual
        if not start.at_first_sample and abs(state.time - start.state.time) > slack:
            raise DataError(
                "navigation.state-known-samples-begin",
                file=state.intake.source,
                quantity="start",
                time=start.state.time,
                time_2=state.time,
            )
        known = replace(start.state, time=state.time)
        self._state = replace(state, begun=state.time)
        self._begin_navigation(from_state(self._chain.navigator.filter, known, start.covariance))

    def _begin_navigation(
        self, begun: FilterState, without: dict[str, tuple[pd.DataFrame, ...]] | None = None
    ) -> None:
        chain, state = self._chain, self._state
        anew = chain.intake.gaps.beyond == "align"
        # A later alignment is of another time, by when the error is known.
        if chain.drift is not None and math.isnan(state.deliveries.begun):
            begun = with_drift(chain.navigator.filter, begun, *chain.drift)
        navigator = chain.navigator.begin_from(begun)
        for name, tables in {**state.told, **(without or {})}.items():
            for table in tables:
                navigator = chain.navigator.tell(navigator, name, table)
        self._state = replace(
            state,
            navigator=navigator,
            told=state.told if anew else dict.fromkeys(state.told, ()),
            deliveries=chain.deliveries.started(state.deliveries, begun.time),
        )


def with_aid(chain: NavigationPipeline, aid: Measurement) -> NavigationPipeline:
    """Return a pipeline with other options of the aid of this name, and the states they state."""
    aids = tuple(aid if one.name == aid.name else one for one in chain.navigator.aids)
    return replace(chain, navigator=with_aids(chain.navigator, aids))
