"""Session of one device: its journal, its sensors joined, and its attitude or navigation.

A session is a folder of its own with the journal (`formats.live_journal`), which any command reads
as a log, and ``latency.json`` at its end. Whatever arrives is in the journal before it is used.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from strapdown.bundle import write_json
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import Finding, StrapdownError
from strapdown.formats.columns import parse_axes
from strapdown.formats.live_journal import event_streams
from strapdown.formats.sensor_streams import Event, Joined, Located
from strapdown.live.journal import Journal
from strapdown.live.lines import BadLineError, Measured, StateLines, Word, count_unused
from strapdown.live.reception import Reception
from strapdown.live.replay import LatencyTape, RunClock, warm_up
from strapdown.live.run import as_said, live_spec, phone_aid
from strapdown.live.sources import ReceivedLine
from strapdown.navigation.replay import Recording
from strapdown.orientation_filters import OrientationTracker, make_filter
from strapdown.rotation import quaternion_from_euler
from strapdown.systems.navigation_run import make_chain
from strapdown.tables import EULER

#: Input from a device: events of its sensors, measurements and commands of lines.
Received = Event | Measured | Word
State = dict[str, Any]
Show = Callable[[State], None]
LATENCY = "latency.json"


@dataclass(frozen=True)
class SessionOptions:
    """Options of every session.

    Attributes
    ----------
    spec : NavigationSpec or None
        Of navigation; without it the attitude by a filter.
    algorithm : str
        The filter, as in `make_filter`.
    every : float, s
        Least interval between states, by the stamps.
    reorder : float, s
        By how much samples may be late.
    """

    spec: NavigationSpec | None = None
    algorithm: str = "error-state"
    every: float = 0.1
    reorder: float = 0.0


class _Estimate(Protocol):
    """Estimate that a session computes from its samples."""

    def take(self, row: Joined | Located, arrived: float) -> None:
        """Use a sample or a fix."""

    def say(self, said: Measured | Word, arrived: float) -> None:
        """Use a measurement or a command of a line."""

    def finish(self) -> None:
        """Use what waits."""


class _Orientation:
    """Attitude by a filter, sample by sample, in body axes forward-right-down."""

    def __init__(
        self,
        options: SessionOptions,
        axes: str | None,
        show: Show,
        tape: LatencyTape,
        clock: RunClock,
    ) -> None:
        self._tracker = OrientationTracker(make_filter(options.algorithm))
        self._axes = list(zip(*parse_axes(axes), strict=True)) if axes else None
        self._every, self._show, self._tape, self._clock = options.every, show, tape, clock
        self._first, self._next = math.nan, -math.inf
        self._magnetic = False

    def take(self, row: Joined | Located, arrived: float) -> None:
        """Use a sample; fixes give no attitude."""
        if isinstance(row, Located):
            return
        if math.isnan(self._first):
            self._first = row.time
        # As the reader of the journal computes it, to the last bit.
        time = self._first + (row.time - self._first)
        mag = None if row.mag is None else self._body(row.mag)
        self._magnetic |= mag is not None
        self._tracker.update(time, self._body(row.gyro), self._body(row.accel), mag)
        if time >= self._next - 1e-9:
            self._next = time + self._every
            self._show(self._state(time))
        if math.isfinite(arrived):
            self._tape.take(arrived, self._clock.now())

    def say(self, said: Measured | Word, arrived: float) -> None:
        """Refuse what a filter has no use for."""
        if isinstance(said, Measured):
            raise BadLineError(said.name, "live.measurement-without-navigation", name=said.name)

    def finish(self) -> None:
        """Nothing waits."""

    def _body(self, values: tuple[float, ...]) -> tuple[float, ...]:
        if self._axes is None:
            return values
        return tuple(sign * values[axis] for axis, sign in self._axes)

    def _state(self, time: float) -> State:
        tracker = self._tracker
        state: State = {"time": round(time, 9)}
        state |= dict(zip(EULER, tracker.roll_pitch_heading.tolist(), strict=True))
        state["q"] = tracker.quaternion.tolist()
        if (sd := tracker.roll_pitch_heading_sd) is not None:
            state |= {f"{n}_sd": v for n, v in zip(EULER, sd.tolist(), strict=True)}
        state["heading_from"] = "magnetic north" if self._magnetic else "the start"
        return state


class _Lines(StateLines):
    """States of navigation, with their quaternion."""

    show: Show

    def tell(self, told: Mapping[str, Any]) -> None:
        """Show a state."""
        state = dict(told)
        if state.get("roll") is not None:
            state["q"] = quaternion_from_euler([state[n] for n in EULER]).tolist()
        self.show(state)


class _Navigation:
    """Position, velocity and attitude, as `strapdown navigate --live`."""

    def __init__(
        self,
        spec: NavigationSpec,
        options: SessionOptions,
        journal: Journal,
        show: Show,
        warn: Callable[[Finding], None],
        clock: RunClock,
    ) -> None:
        chain = make_chain(spec, sensors_of(spec))
        recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)
        lines = _Lines(chain.navigator, lambda text: None, "json", options.every)
        lines.show = show
        warm_up(chain)
        self.aid = phone_aid(chain)
        # The journal has the events already; it keeps the rows of the recorded input.
        recording = Recording(chain, recorder)
        self.reception = Reception(chain, spec, recording, clock, lines.take, warn, journal)

    def take(self, row: Joined | Located, arrived: float) -> None:
        """Use a sample or a fix."""
        if (said := as_said(row, self.aid)) is not None:
            self.reception.accept(said, ReceivedLine(None, "", arrived))
        self._raise()

    def say(self, said: Measured | Word, arrived: float) -> None:
        """Use a measurement or a command."""
        self.reception.accept(said, ReceivedLine(None, "", arrived))
        self._raise()

    def finish(self) -> None:
        """Use what waits."""
        self.reception.finish()

    def _raise(self) -> None:
        if self.reception.error is not None:
            raise self.reception.error


class Session:
    """One device, from its first message to its end.

    Parameters
    ----------
    folder : Path
        Is made, with the journal in it.
    device : str
        As it names itself, or its address.
    source : str
        Protocol that it speaks.
    axes : str or None
        Its axes, as in `parse_axes`.
    show : callable
        Called with each state.
    warn : callable
        Called with each finding.

    Attributes
    ----------
    name : str
    last : float, s
        When the last message came, by the clock of the run.
    pause : float, s
        The longest between two messages.
    silent : bool
        Whether it was reported that nothing comes; what comes next is reported, too.
    unused : Counter
        Messages, lines and values that were not used, by reason.
    messages, events : int
    lost : int
        Messages that are missing by their numbers.
    error : StrapdownError or None
        That ended the computation; the journal goes on.
    """

    def __init__(
        self,
        folder: Path,
        device: str,
        source: str,
        axes: str | None,
        options: SessionOptions,
        show: Show,
        warn: Callable[[Finding], None],
        clock: RunClock,
        version: str = "",
    ) -> None:
        self.name, self.device, self.source = folder.name, device, source
        spec = None if options.spec is None else live_spec(options.spec, axes)
        run: dict[str, Any] = {
            "command": "live",
            "session": self.name,
            "device": device,
            "protocol": source,
            "axes": axes,
            "reorder_s": options.reorder,
            "strapdown": version,
        }
        run |= {"algorithm": options.algorithm} if spec is None else {"configuration": spec.plain()}
        self.journal = Journal.begin(folder, run)
        self.journal.warn = warn
        self._streams = event_streams(run)
        self._warn, self._clock = warn, clock
        self._show = show
        self._parsed, self._journaled, self.whole = (LatencyTape() for _ in range(3))
        self.unused: Counter[str] = Counter()
        self.messages = self.events = self.lost = 0
        self._numbers: set[int] = set()
        self._newest_number: int | None = None
        self.last, self.pause, self.silent = clock.now(), 0.0, False
        self.error: StrapdownError | None = None
        self._estimate: _Estimate
        if spec is None:
            self._estimate = _Orientation(options, axes, self._tell, self.whole, clock)
        else:
            navigation = _Navigation(spec, options, self.journal, self._tell, warn, clock)
            self._estimate, self.whole = navigation, navigation.reception.tape

    @property
    def went_back(self) -> bool:
        """Whether the clock of the device went back, so that what follows is another session."""
        return self._streams.went_back

    def number(self, number: int | None) -> None:
        """Note the number of a message: lost, repeated and late ones are counted."""
        if number is None:
            return
        newest = self._newest_number
        if newest is None or number > newest:
            self.lost += 0 if newest is None else min(number - newest - 1, 10**6)
            self._newest_number = newest = number
        elif number in self._numbers:
            self.unused["message repeated"] += 1
        else:
            self.lost -= 1 if self.lost else 0
            self.unused["message late"] += 1
        self._numbers.add(number)
        if len(self._numbers) > 4096:
            self._numbers = {one for one in self._numbers if one > newest - 2048}

    def take(self, received: Sequence[Received], arrived: float) -> None:
        """Write what a message had to the journal, and use it."""
        parsed = self._clock.now()
        self._parsed.take(arrived, parsed)
        self.messages, self.events = self.messages + 1, self.events + len(received)
        paused, self.last = max(0.0, arrived - self.last), arrived
        self.pause = max(self.pause, paused)
        if self.silent:
            self.silent = False
            self._warn(
                Finding("live.session-again", severity="note", session=self.name, seconds=paused)
            )
        self.journal.append(*received)
        self._journaled.take(parsed, self._clock.now())
        for one in received:
            if isinstance(one, Event):
                for row in self._streams.take(one):
                    self._use(self._estimate.take, row, arrived)
            else:
                self._use(self._estimate.say, one, arrived)

    def not_used(self, bad: BadLineError) -> None:
        """Count what was not used, and report the first of its kind."""
        count_unused(self.unused, bad, None, self._warn)

    def finish(self) -> dict[str, Any]:
        """End the session; return what ``latency.json`` holds."""
        for row in self._streams.finish():
            self._use(self._estimate.take, row, math.nan)
        self._use(self._estimate.finish)
        told = self.told()
        write_json(self.journal.folder / LATENCY, told)
        self.journal.close()
        for rows in self.journal.folder.glob("*.rows"):
            rows.unlink()
        return told

    def told(self) -> dict[str, Any]:
        """Return latencies by stage, and counts."""
        stages = {
            "arrival_to_parsed": self._parsed,
            "parsed_to_journal": self._journaled,
            "arrival_to_state": self.whole,
        }
        unused = self.unused + self._streams.unused
        late: Mapping[str, int] = {}
        if isinstance(self._estimate, _Navigation):
            unused = unused + self._estimate.reception.unused
            late = self._estimate.reception.late
        return {
            "session": self.name,
            "device": self.device,
            "protocol": self.source,
            "messages": self.messages,
            "events": self.events,
            "messages_lost": self.lost,
            "not_used": dict(sorted((k, v) for k, v in unused.items() if v)),
            "late": dict(late),
            "error": None if self.error is None else self.error.finding.code,
            "stages": {
                name: latency.told()
                for name, tape in stages.items()
                if (latency := tape.latency()) is not None
            },
        }

    def _use(self, use: Callable[..., None], *given: Any) -> None:
        """Give the computation a sample, a measurement or its end.

        Its error ends the computation, not the journal.
        """
        if self.error is not None:
            return
        try:
            use(*given)
        except BadLineError as bad:
            self.not_used(bad)
        except StrapdownError as error:
            self.error = error
            self._warn(error.finding.replace(file=self.name))

    def _tell(self, state: State) -> None:
        epoch = self._streams.epoch
        at = {"unix": round(state["time"] + epoch, 6)} if epoch else {}
        self._show({"session": self.name, "device": self.device, **state, **at})
