"""Events that the server sends to the page: jobs that changed, lines of live runs, new files."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocket

from strapdown.errors import ConfigError
from strapdown.formats.live_journal import JOURNAL
from strapdown.studio.folder import Folder, plain_name
from strapdown.studio.jobs import ENDED, Jobs
from strapdown.studio.live_jobs import shown_state

#: Seconds between two looks at the jobs, and looks at jobs between two at the folder.
EVERY, OF_FOLDER = 0.1, 10
#: Messages that wait for a client; one that is slower is sent away, and its page asks again.
WAITING = 500
#: Longest line of a live run that is passed on, bytes; bytes of lines at once.
LINE, PART = 8192, 256 << 10
#: Places of a run at which a page is given a state, and all of the last `PART` of its output.
KEPT = 2000


@dataclass(eq=False)
class Events:
    """Sends events to every page that listens.

    Parameters
    ----------
    folder : Folder
    jobs : Jobs
    """

    folder: Folder
    jobs: Jobs
    _clients: set[asyncio.Queue[str | None]] = field(default_factory=set)
    _read: dict[str, int] = field(default_factory=dict)

    async def serve(self, socket: WebSocket) -> None:
        """Send events to one page until it goes, or is too slow."""
        limits = self.folder.limits
        if len(self._clients) >= limits.sockets:
            await socket.close(1013)
            return
        queue: asyncio.Queue[str | None] = asyncio.Queue(WAITING)
        # Before the handshake, in which others may come.
        self._clients.add(queue)
        listening: asyncio.Task[Any] | None = None
        try:
            await socket.accept()
            listening = asyncio.create_task(_until_closed(socket))
            await socket.send_text(json.dumps({"jobs": self.jobs.listed()}))
            while not listening.done():
                waiting = asyncio.create_task(queue.get())
                await asyncio.wait({waiting, listening}, return_when=asyncio.FIRST_COMPLETED)
                if not waiting.done():
                    waiting.cancel()
                    return
                message = waiting.result()
                if message is None:
                    await socket.close(1013)
                    return
                await asyncio.wait_for(socket.send_text(message), limits.patience)
        except TimeoutError:
            with suppress(RuntimeError):
                await socket.close(1013)
        finally:
            self._clients.discard(queue)
            if listening is not None:
                listening.cancel()

    async def watch(self) -> None:
        """Look at jobs and folder, and report what changed."""
        before = await run_in_threadpool(self.folder.signature)
        count = 0
        while True:
            await asyncio.sleep(EVERY)
            count += 1
            for job in await run_in_threadpool(self.jobs.advance):
                self._tell({"job": job})
            for line in await run_in_threadpool(self._lines):
                self._tell(line)
            if count % OF_FOLDER == 0:
                now = await run_in_threadpool(self.folder.signature)
                if now != before:
                    before = now
                    self._tell({"files": True})

    def _tell(self, message: dict[str, Any]) -> None:
        text = json.dumps(message)
        for queue in self._clients:
            try:
                queue.put_nowait(text)
            except asyncio.QueueFull:
                # It is sent away after what it has not read.
                queue.get_nowait()
                queue.put_nowait(None)

    def _lines(self) -> list[dict[str, Any]]:
        """New state lines of live runs: lines of JSON in their output."""
        found: list[dict[str, Any]] = []
        for job in self.jobs.listed():
            if job["kind"] != "live" or (job["state"] in ENDED and job["id"] not in self._read):
                continue
            with suppress(OSError):
                found += self._new(job["id"])
            if job["state"] in ENDED:
                del self._read[job["id"]]
        return found

    def _new(self, number: str) -> list[dict[str, Any]]:
        path = self.jobs.output(number)
        at, size = self._read.setdefault(number, 0), path.stat().st_size
        if size < at:
            at = 0  # the keeper began another file
        # Of a run that is faster than the page, the latest.
        at = max(at, size - PART)
        with path.open("rb") as stream:
            stream.seek(at)
            data = stream.read(size - at)
        whole = data.rfind(b"\n") + 1
        self._read[number] = at + whole
        states = with_numbers(_states(data[:whole].splitlines())[-WAITING // 4 :])
        return [{"line": {"id": number, "data": state}} for state in states]


def states_of(folder: Folder, jobs: Jobs, number: str) -> dict[str, Any]:
    """Return states of a live run from its beginning, and how long its sessions are silent.

    Returns
    -------
    dict
        ``states``: evenly over the output, and each of the last ones; ``silent_s``: by session,
        seconds since its last message, as the file of its journal says.
    """
    job = jobs.shown(number)
    output = jobs.output(number)
    lines: list[bytes] = []
    for path in (output.with_name(output.name + ".before"), output):
        with suppress(OSError), path.open("rb") as stream:
            lines += _lines_over(stream, path.stat().st_size, KEPT)
    states = with_numbers(_states(lines))
    silent = {}
    for name in {str(state.get("session", "")) for state in states}:
        with suppress(ConfigError, OSError):
            journal = folder.within(f"{job['name']}/{plain_name(name)}") / JOURNAL
            silent[name] = max(0.0, time.time() - journal.stat().st_mtime)
    return {"states": states, "silent_s": silent}


def _lines_over(stream: BinaryIO, size: int, most: int) -> list[bytes]:
    """Return whole lines evenly over a file, and all of its last `PART`; the latter if shorter."""
    found: dict[int, bytes] = {}
    for k in range(most if size > PART else 0):
        stream.seek(size * k // most)
        if k:
            stream.readline()
        at = stream.tell()
        while (line := stream.readline(LINE)) and line[:1] != b"{":
            at = stream.tell()
        found[at] = line
    stream.seek(max(0, size - PART))
    if size > PART:
        stream.readline()
    while stream.tell() < size:
        found[stream.tell()] = stream.readline(LINE)
    return [found[at] for at in sorted(found)]


def _states(lines: Iterable[bytes]) -> list[dict[str, Any]]:
    """Return the lines that are states."""
    found = []
    for line in lines:
        if len(line) <= LINE and line[:1] == b"{":
            with suppress(ValueError):
                found.append(json.loads(line, parse_constant=lambda _: None))
    return found


def with_numbers(states: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give the last state of each session its numbers as the page writes them."""
    for state in {str(one.get("session")): one for one in states}.values():
        state["shown"] = shown_state(state)
    return states


async def _until_closed(socket: WebSocket) -> None:
    """Read, and forget, what a page sends until it goes."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
