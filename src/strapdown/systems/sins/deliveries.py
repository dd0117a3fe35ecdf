"""Monitor measurements: outages, recoveries, rejected and late observations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import median

import numpy as np

from strapdown.errors import ConfigError
from strapdown.navigation.record import Event, InnovationRecord, NavigationChunk, Span
from strapdown.tables.checks import is_number

__all__ = ["MeasurementMonitor", "MeasurementMonitorState"]

# Number of intervals whose median is the measurement's own.
INTERVALS = 5


@dataclass(frozen=True)
class Rejected:
    """Consecutive rejected observations of one name.

    Attributes
    ----------
    begin, end : float, s
    count : int
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
    aids : mapping of str to MeasurementStatus
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
        its own interval, the median of the last five. Before the second observation there is no
        interval, and an outage at the start is reported at its end.

    Raises
    ------
    ConfigError
        The number is not above 1.
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

    def over(
        self, state: MeasurementMonitorState, piece: NavigationChunk, time: float
    ) -> tuple[MeasurementMonitorState, list[Event], list[tuple[str, Span]]]:
        """Process the output of a chunk.

        Parameters
        ----------
        state : MeasurementMonitorState
        piece : NavigationChunk
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
                events.append(_late(name, late.pop(name)))
            if not one.innovations.weight.any():
                rejected[one.name] = _more(rejected.get(one.name), one.time, _in_sd(one))
            elif one.name in rejected:
                events.append(_rejected(one.name, rejected.pop(one.name)))
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
        events = [_rejected(name, one) for name, one in state.rejected.items()]
        events += [_late(name, one) for name, one in state.late.items()]
        outages = []
        for name, aid in state.aids.items():
            if aid.out or (not aid.seen and time > aid.newest):
                outages.append((name, Span(name, aid.newest, time)))
                if not aid.out:
                    events.append(
                        Event(aid.newest, "outage", f"{name}: no observation in all of the run")
                    )
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
            events.append(
                Event(
                    one.time,
                    "recovered",
                    f"{name} again after {since:.4g} s: {one.name} {_in_sd(one):.2g} standard "
                    "deviations from what was expected",
                )
            )
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


def _epochs(one: Rejected) -> str:
    if one.count == 1:
        return f"at {one.begin:.9g} s"
    return f"{one.count} of them, from {one.begin:.9g} to {one.end:.9g} s"


def _rejected(name: str, one: Rejected) -> Event:
    return Event(
        one.begin,
        "rejected",
        f"{name} was not believed {_epochs(one)}: up to {one.largest:.3g} standard deviations off",
    )


def _late(name: str, one: Rejected) -> Event:
    return Event(
        one.begin,
        "late",
        f"{name} came after the samples that followed it, and was not used {_epochs(one)}",
    )


def _out(name: str, at: float, newest: float) -> Event:
    return Event(at, "outage", f"{name} has delivered nothing since {newest:.9g} s")
