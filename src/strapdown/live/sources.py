"""Where lines come from: standard input or datagrams, read beside the run by a thread."""

from __future__ import annotations

import os
import queue
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO
from urllib.parse import urlsplit

from strapdown.errors import ConfigError
from strapdown.live.clock import Clock

__all__ = ["Line", "LineSource", "open_source"]

#: Lines that wait at most; a pipe then waits too, and the system drops datagrams.
WAITING = 20_000
#: Longest line, bytes; a longer one is cut there, and neither part of it can be used.
LONGEST = 4096
#: How often a thread looks whether it is wanted, s.
LOOK = 0.2
_LOCAL = "127.0.0.1"


@dataclass(frozen=True)
class Line:
    """A line as it came.

    Attributes
    ----------
    number : int
        Counted from 1.
    text : str
    arrived : float, s
        By the clock of the run.
    """

    number: int
    text: str
    arrived: float


class LineSource:
    """Lines in the order in which they come.

    Parameters
    ----------
    name : str
        For messages.
    read : callable
        Returns bytes; none at the end; raises `TimeoutError` where nothing came.
    clock : Clock
    close : callable
    whole : bool
        Whether what is read at a time ends with a line.
    """

    def __init__(
        self,
        name: str,
        read: Callable[[], bytes],
        clock: Clock,
        close: Callable[[], None],
        whole: bool = True,
    ) -> None:
        self.name = name
        self._read, self._clock, self._close = read, clock, close
        self._queue: queue.Queue[Line | None] = queue.Queue(WAITING)
        self._wanted, self._whole = True, whole
        self._count = 0
        self._thread = threading.Thread(target=self._run, name=f"lines of {name}", daemon=True)

    def begin(self) -> None:
        """Begin to read."""
        self._thread.start()

    def next(self, wait: float = LOOK) -> Line | None:
        """Return the next line, or None at the end.

        Raises
        ------
        TimeoutError
            None came for so many seconds.
        """
        try:
            return self._queue.get(timeout=wait)
        except queue.Empty:
            raise TimeoutError from None

    def close(self) -> None:
        """Read no more."""
        self._wanted = False
        self._close()

    def _run(self) -> None:
        rest = b""
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
            rest = b"" if self._whole or len(lines[-1]) > LONGEST else lines.pop()
            self._put_all(lines)
        self._put_all([rest])
        self._put(None)

    def _put_all(self, lines: list[bytes]) -> None:
        arrived = self._clock.now()
        for line in lines:
            if line:
                self._count += 1
                self._put(Line(self._count, line.decode("utf-8", "replace"), arrived))

    def _put(self, line: Line | None) -> None:
        while self._wanted:
            try:
                return self._queue.put(line, timeout=LOOK)
            except queue.Full:
                continue
        return None


def open_source(where: str, clock: Clock, stdin: IO[bytes]) -> LineSource:
    """Open what a person names.

    Parameters
    ----------
    where : str
        ``-`` for standard input, or ``udp://HOST:PORT``; without a host that of this machine
        alone. Port 0 takes a free one.
    clock : Clock
    stdin : file

    Returns
    -------
    LineSource

    Raises
    ------
    ConfigError
        It names nothing that lines can come from, or the port is taken.
    """
    if where == "-":
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
    bound = _bound(host, port)
    bound.settimeout(LOOK)
    name = f"udp://{host}:{bound.getsockname()[1]}"
    return LineSource(name, lambda: bound.recv(65_536) or b"\n", clock, bound.close)


def _bound(host: str, port: int) -> socket.socket:
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        made = socket.socket(family, socket.SOCK_DGRAM)
        try:
            made.bind(address)
        except OSError:
            made.close()
            raise
    except OSError as error:
        raise ConfigError(
            "live.cannot-listen", quantity="--live", reason=error.strerror or error
        ) from None
    return made
