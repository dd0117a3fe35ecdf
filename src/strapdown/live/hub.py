"""Many devices at once: a session for each, and what all share.

Everything here runs in one thread, the event loop's: receivers in threads hand over what they got
by `Hub.post`. A session is known by its protocol, its device and the recording that the device
names; each has its folder.
"""

from __future__ import annotations

import asyncio
import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from strapdown import __version__
from strapdown.errors import ConfigError, Finding, StrapdownError
from strapdown.formats.known_formats import AXES
from strapdown.live.lines import LINE_FORMS, BadLineError, Word, check_token
from strapdown.live.phones import (
    LineDevice,
    Message,
    SensorLoggerDevice,
    parse_sensor_logger,
    plain_name,
)
from strapdown.live.replay import RunClock
from strapdown.live.session import Received, Session, SessionOptions

#: Most sessions that are open at once; after so long without a message one ends, s.
MOST_SESSIONS, SILENT = 64, 600.0
#: Command of a line that ends its session.
END = "end"
Key = tuple[str, str, str]


class StateWriter:
    """Write states of all sessions as lines of JSON or CSV.

    Parameters
    ----------
    write : callable
        Takes a line with its end; BrokenPipeError: its reader has closed.
    """

    def __init__(self, write: Callable[[str], None], form: str = "json") -> None:
        if form not in LINE_FORMS:
            raise ConfigError("live.unknown-line-form", quantity="--lines", form=form)
        self._write, self._form = write, form
        self._head: list[str] | None = None
        #: Whether the reader of the lines is there; when it closes the pipe, the run ends.
        self.there = True

    def state(self, state: Mapping[str, Any]) -> None:
        """Write a state."""
        if self._form == "json":
            self._put(json.dumps(state) + "\n")
            return
        flat: dict[str, Any] = {}
        for name, value in state.items():
            if isinstance(value, list):
                flat |= {f"{name}_{axis}": v for axis, v in zip("wxyz", value, strict=True)}
            else:
                flat[name] = value
        if self._head is None:
            self._head = list(flat)
            self._put(",".join(self._head) + "\n")
        values = (flat.get(name) for name in self._head)
        self._put(",".join("" if v is None else str(v) for v in values) + "\n")

    def said(self, said: Mapping[str, Any]) -> None:
        """Write what is not a state: as JSON alone."""
        if self._form == "json":
            self._put(json.dumps(said) + "\n")

    def _put(self, text: str) -> None:
        if not self.there:
            return
        try:
            self._write(text)
        except BrokenPipeError:
            self.there = False


class Hub:
    """Sessions of all devices.

    Parameters
    ----------
    folder : Path
        Holds the folder of each session.
    writer : StateWriter
    warn : callable
        Called with each finding.
    platform : str
        Of phones with Sensor Logger, as in `SensorLoggerDevice`.
    aids : sequence of str
        Names of the measurements that lines may hold.
    token : str
        That commands of datagrams need.

    Attributes
    ----------
    ended : list of dict
        What ``latency.json`` of each ended session holds.
    refused : Counter
        What no session took, by reason.
    """

    def __init__(
        self,
        folder: Path,
        options: SessionOptions,
        clock: RunClock,
        writer: StateWriter,
        warn: Callable[[Finding], None],
        platform: str = "auto",
        aids: Sequence[str] = (),
        token: str = "",
    ) -> None:
        self.folder, self.clock, self.writer, self.token = folder, clock, writer, token
        self._options, self._warn = options, warn
        self._platform, self._aids = platform, aids
        SensorLoggerDevice(platform)
        self._sessions: dict[Key, Session] = {}
        self._phones: dict[Key, SensorLoggerDevice] = {}
        self._lines: dict[Key, LineDevice] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self.ended: list[dict[str, Any]] = []
        self.refused: Counter[str] = Counter()
        self.error: StrapdownError | None = None

    # What receivers call.

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Let threads post to an event loop."""
        self._loop = loop

    def post(self, call: Callable[..., Any], *arguments: Any) -> None:
        """Call in the thread of the event loop; from any other."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *arguments)

    def sensor_logger(
        self, data: bytes | str, protocol: str, arrived: float
    ) -> BadLineError | None:
        """Take a message of Sensor Logger; return why it cannot be used."""
        try:
            message = parse_sensor_logger(data)
            key = (protocol, message.device, message.session)
            session = self._session(key, message.device, AXES)
        except BadLineError as bad:
            return self._refuse(bad)
        session.number(message.number)
        phone = self._phones.setdefault(key, SensorLoggerDevice(self._platform))
        self._take_message(session, phone, message, arrived)
        self._follow(key)
        return None

    def line(self, text: str, protocol: str, device: str, arrived: float) -> None:
        """Take a line of a sender: of datagrams, a serial port, or a WebSocket."""
        key = (protocol, device, "")
        parser = self._lines.setdefault(key, LineDevice(self._aids))
        if len(self._lines) > 16 * MOST_SESSIONS:
            self._lines = {one: p for one, p in self._lines.items() if one in self._sessions}
        try:
            received = parser.parse(text, arrived)
            for one in received:
                if isinstance(one, Word):
                    self._command(one, key, protocol)
            received = [one for one in received if not (isinstance(one, Word) and one.word == END)]
            if received:
                self._session(key, device, None).take(received, arrived)
                self._follow(key)
        except BadLineError as bad:
            if key in self._sessions:
                self._sessions[key].not_used(bad)
            else:
                self._refuse(bad)

    def events(
        self,
        received: Sequence[Received],
        protocol: str,
        device: str,
        recording: str,
        arrived: float,
    ) -> None:
        """Take events of a phone that states its axes by its protocol."""
        if not received:
            return
        key = (protocol, device, recording)
        try:
            self._session(key, device, AXES).take(received, arrived)
            self._follow(key)
        except BadLineError as bad:
            self._refuse(bad)

    # Ends.

    def end_silent(self) -> None:
        """End the sessions of devices that have been silent for long."""
        now = self.clock.now()
        for key in [k for k, s in self._sessions.items() if now - s.last > SILENT]:
            self._end(key)

    def finish(self) -> None:
        """End all sessions."""
        for key in list(self._sessions):
            self._end(key)

    @property
    def count(self) -> int:
        """Number of open sessions."""
        return len(self._sessions)

    # Own.

    def _take_message(
        self, session: Session, phone: SensorLoggerDevice, message: Message, arrived: float
    ) -> None:
        events, bad = phone.events(message)
        for finding in phone.findings:
            self._warn(finding.replace(file=session.name))
        phone.findings.clear()
        for one in bad:
            session.not_used(one)
        session.take(events, arrived)

    def _command(self, said: Word, key: Key, protocol: str) -> None:
        check_token(said, None if protocol == "serial" else self.token)
        if said.word == END and key in self._sessions:
            self._end(key)

    def _session(self, key: Key, device: str, axes: str | None) -> Session:
        """Return the session of a device, a new one if there is none."""
        if (session := self._sessions.get(key)) is not None:
            return session
        if len(self._sessions) >= MOST_SESSIONS:
            raise BadLineError("session", "live.too-many-sessions", most=MOST_SESSIONS)
        try:
            session = self._sessions[key] = Session(
                self._free_folder(device),
                device,
                key[0],
                axes,
                self._options,
                self.writer.state,
                self._warn,
                self.clock,
                __version__,
            )
        except StrapdownError as error:
            # What cannot begin for one device cannot for another: the run ends.
            self.error = error
            raise BadLineError("session", error.finding) from None
        begun = {"begun": session.name, "device": device, "protocol": key[0]}
        self.writer.said(begun | {"folder": str(session.journal.folder)})
        self._warn(Finding("live.session-begun", severity="note", session=session.name))
        return session

    def _free_folder(self, device: str) -> Path:
        name = plain_name(device)
        taken = {p.name.lower() for p in self.folder.iterdir()} if self.folder.is_dir() else set()
        numbers = [
            int(found[1] or 1)
            for one in taken
            if (found := re.fullmatch(re.escape(name.lower()) + r"(?:-(\d{1,6}))?", one))
        ]
        return self.folder / (f"{name}-{max(numbers) + 1}" if numbers else name)

    def _follow(self, key: Key) -> None:
        """Begin another session of a device whose clock went back."""
        session = self._sessions.get(key)
        if session is not None and session.went_back:
            self._warn(Finding("live.session-clock-back", session=session.name))
            self._end(key)

    def _end(self, key: Key) -> None:
        session = self._sessions.pop(key)
        self._phones.pop(key, None)
        told = session.finish()
        self.ended.append(told)
        self.writer.said({"ended": session.name, **{k: told[k] for k in ("messages", "events")}})

    def _refuse(self, bad: BadLineError) -> BadLineError:
        self.refused[bad.kind] += 1
        if self.refused[bad.kind] == 1:
            self._warn(Finding("live.message-refused", reason=bad.finding))
        return bad
