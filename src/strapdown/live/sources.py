"""Sources of lines: standard input or datagrams, read by a thread."""

from __future__ import annotations

import os
import queue
import re
import secrets
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO
from urllib.parse import urlsplit

from strapdown.errors import ConfigError
from strapdown.live.replay import RunClock

#: Most waiting lines; beyond them a pipe blocks, and the system drops datagrams.
WAITING = 20_000
#: Longest line, bytes; of a longer one the begin is kept, marked so that no parser accepts it.
LONGEST, BEGIN, MARK = 4096, 64, b"\0"
#: Interval at which a thread checks whether to stop, s.
LOOK = 0.2
_LOCAL = "127.0.0.1"


@dataclass(frozen=True)
class ReceivedLine:
    """Received line.

    Attributes
    ----------
    number : int or None
        Counted from 1; None of a message that is not a line.
    arrived : float, s
        By the clock of the run.
    """

    number: int | None
    text: str
    arrived: float


class LineSource:
    """Lines in order of arrival.

    Parameters
    ----------
    name : str
        For messages.
    read : callable
        Returns bytes; empty at the end; raises `TimeoutError` if no data arrived.
    whole : bool
        Whether each read ends with a complete line.
    token : str, optional
        That commands need, if others than the launching side can send lines.
    """

    def __init__(
        self,
        name: str,
        read: Callable[[], bytes],
        clock: RunClock,
        close: Callable[[], None],
        whole: bool = True,
        token: str | None = None,
    ) -> None:
        self.name, self.token = name, token
        self._read, self._clock, self._close = read, clock, close
        self._queue: queue.Queue[ReceivedLine | None] = queue.Queue(WAITING)
        self._wanted, self._whole = True, whole
        self._count = 0
        self._thread = threading.Thread(target=self._run, name=f"lines of {name}", daemon=True)

    def begin(self) -> None:
        """Start to read."""
        self._thread.start()

    def next(self, wait: float = LOOK) -> ReceivedLine | None:
        """Return the next line, or None at the end."""
        try:
            return self._queue.get(timeout=wait)
        except queue.Empty:
            raise TimeoutError from None

    def close(self) -> None:
        """Stop reading."""
        self._wanted = False
        self._close()

    def _run(self) -> None:
        rest, cut = b"", False
        while self._wanted:
            try:
                data = self._read()
            except TimeoutError:
                continue
            except OSError:  # closed meanwhile
                break
            if not data:
                break
            lines = (rest + data).split(b"\n")
            if cut:  # the rest of a line whose begin was taken
                lines[0] = b""
            cut, rest = cut and len(lines) == 1, b""
            if not self._whole:
                rest = lines.pop()
                if len(rest) > LONGEST and not cut:
                    lines.append(rest)
                    rest, cut = b"", True
            self._put_all(lines)
        self._put_all([rest])
        self._put(None)

    def _put_all(self, lines: list[bytes]) -> None:
        arrived = self._clock.now()
        for line in lines:
            if line:
                self._count += 1
                if len(line) > LONGEST:
                    line = MARK + line[:BEGIN]
                self._put(ReceivedLine(self._count, line.decode("utf-8", "replace"), arrived))

    def _put(self, line: ReceivedLine | None) -> None:
        while self._wanted:
            try:
                return self._queue.put(line, timeout=LOOK)
            except queue.Full:
                continue
        return None


def open_source(
    where: str, clock: RunClock, stdin: IO[bytes], token: str | None = None
) -> LineSource:
    """Open a source by its name.

    Parameters
    ----------
    where : str
        ``-`` for standard input, or ``udp://HOST:PORT``; without a host, for this machine only.
        Port 0 selects a free one.
    stdin : file
    token : str, optional
        That commands in datagrams need; drawn, if not given. Standard input needs none.
    """
    drawn = token_or_drawn(token)
    if where == "-":
        if token is not None:
            raise ConfigError("live.only-with", option="--token", beside="--live udp://HOST:PORT")
        # A thread in a buffered read holds its lock to the end of the process.
        file = stdin.fileno()
        return LineSource("stdin", lambda: os.read(file, 65_536), clock, lambda: None, whole=False)
    try:
        parts = urlsplit(where)
        host, port = parts.hostname or _LOCAL, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), _LOCAL, None
    if parts.scheme != "udp" or port is None or parts.path.strip("/"):
        raise ConfigError("live.not-a-source", quantity="--live", where=where)
    try:
        bound = bound_socket(host, port, socket.SOCK_DGRAM)
    except OSError as error:
        raise ConfigError(
            "live.cannot-listen", quantity="--live", reason=error.strerror or error
        ) from None
    bound.settimeout(LOOK)
    name = f"udp://{host}:{bound.getsockname()[1]}"
    return LineSource(
        name,
        lambda: bound.recv(65_536) or b"\n",
        clock,
        bound.close,
        token=drawn,
    )


def token_or_drawn(token: str | None) -> str:
    """Return a token, or draw one; ConfigError: it has another form."""
    if token is not None and not re.fullmatch(r"[\w.~+/=-]{8,128}", token, re.ASCII):
        raise ConfigError("live.bad-token", quantity="--token")
    return token or secrets.token_urlsafe(12)


def bound_socket(host: str, port: int, kind: int) -> socket.socket:
    """Return a socket of a kind that is bound to an address; OSError: it cannot be."""
    # With its protocol: to one that is named as TCP asyncio sends without waiting for an
    # acknowledgment (40 ms).
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=kind)[0]
    made = socket.socket(family, kind, protocol)
    try:
        if kind == socket.SOCK_STREAM:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(address)
    except OSError:
        made.close()
        raise
    return made
