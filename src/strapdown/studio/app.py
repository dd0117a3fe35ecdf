"""Routes of the studio: what the page asks for, and what answers it.

Everything that reads a file of the user's is asked of a process of its own (`reading_process`); the
server itself lists the folder, keeps the jobs, maps stored series and sends files.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import math
import os
import re
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any, BinaryIO

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from strapdown import __version__
from strapdown.bundle.atomic_folder import replace_file
from strapdown.config.toml_text import string
from strapdown.crash.events import KMH
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError, check_choice
from strapdown.formats.live_journal import JOURNAL
from strapdown.formats.map_tiles import Tile, open_map
from strapdown.studio.folder import Folder, plain_name, repeating
from strapdown.studio.guard import SANDBOX
from strapdown.studio.jobs import ENDED, Jobs
from strapdown.studio.live_jobs import live_command, live_info, shown_state
from strapdown.studio.pyramid import StoredStream
from strapdown.studio.reading_process import ReadingProcess, Refused, told

# --- events: jobs that changed, lines of live runs, new files ---------------------------

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


# --- records to begin with, copied where a person asks for them --------------------------

#: Head of the case of the simulated crash.
SIMULATED = "A simulated crash: what is marked as yours is the statement of the simulation."


@dataclass(frozen=True)
class Sample:
    """Records to begin with.

    Attributes
    ----------
    title, text : str
        For people.
    make : callable
        Returns the content of each file by its name.
    """

    title: str
    text: str
    make: Callable[[], dict[str, bytes]]


def _drive() -> dict[str, bytes]:
    recording = files("strapdown").joinpath("demo_data", "comma2k19")
    return {
        name: recording.joinpath(name).read_bytes()
        for name in ("imu.csv", "gnss.csv", "reference.csv")
    }


def _crash() -> dict[str, bytes]:
    from strapdown.api.simulation import simulate

    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        made = Path(name) / "crash"
        simulate("frontal").save(made)
        records = sorted(made.glob("imu1_*.csv"))
        case = (made / "case.toml").read_text(encoding="utf-8")
        truth = json.loads((made / "scenario.json").read_text(encoding="utf-8"))["impacts"][0]
        own = {p.name: p.read_bytes() for p in records}
        return {**own, "case.toml": _case_of_one(case, truth).encode()}


def _case_of_one(case: str, truth: Mapping[str, Any]) -> str:
    """Return a simulated case with its first recorder alone, whose files are in the folder.

    `truth`: of its impact, which the description states.
    """
    head, first, *others = case.split("\n[[units]]")
    # Without the comment above it, and what refers to files that are not copied.
    head = head[head.index("\ntitle = ") :]
    options = others[-1][others[-1].index("\n[options]") :]
    text = f"{head}\n[[units]]{first}{options}"
    change = math.hypot(*truth["delta_v_m_per_s"]) / KMH
    said = (
        f"Simulated, with the statements of an investigator. The truth is a delta-V of {change:.1f}"
        f" km/h and a direction of force of {truth['pdof_deg']:.1f}\N{DEGREE SIGN}."
    )
    text = re.sub("\ndescription = .*", f"\ndescription = {string(said)}", text)
    return f"# {SIMULATED}\n{text}"


SAMPLES = {
    "drive": Sample(
        "A phone in a car",
        "One minute of a recorded drive: inertial sensors, satellite fixes and a reference "
        "(comma2k19, MIT license).",
        _drive,
    ),
    "crash": Sample(
        "A simulated crash",
        "The recorder of a car that meets an obstacle with its front, in three files, and a case "
        "for them: the answers of the simulation, whose truth is known.",
        _crash,
    ),
}


def listed_samples() -> list[dict[str, str]]:
    """List the samples: name, title and text."""
    return [{"name": k, "title": one.title, "text": one.text} for k, one in SAMPLES.items()]


def sample(folder: Path, name: str) -> dict[str, Any]:
    """Copy a sample into a folder of its own, in that of the studio; return its records by name.

    A configuration for them is copied, too, and offered where one is proposed.

    ConfigError: there is no such sample, or another file has the name of one of its own.
    """
    check_choice("studio.no-such-sample", SAMPLES, quantity="name", word=name)
    own, made = f"sample-{name}", SAMPLES[name].make()
    place = Folder(folder).path / own
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise ConfigError("studio.name-taken", file=own)
    for file, data in made.items():
        target = place / file
        if target.is_symlink() or (target.exists() and target.read_bytes() != data):
            raise ConfigError("studio.name-taken", file=f"{own}/{file}")
    place.mkdir(exist_ok=True)
    for file, data in made.items():
        replace_file(place / file, data)
    return {"files": [f"{own}/{file}" for file in made if not file.endswith(".toml")]}


# The map of a studio: tiles of a local MBTiles or PMTiles file, each checked before it is sent.

#: Endings of maps that are looked for in the folder.
ENDINGS = (".pmtiles", ".mbtiles")
DEEPEST = 22


@dataclass
class Map:
    """A map file; it is opened for each tile, as another thread may ask for the next.

    Attributes
    ----------
    path : Path
    attribution : str
        As the file states it, in plain text.
    zooms : (int, int)
    """

    path: Path
    attribution: str
    zooms: tuple[int, int] = (0, DEEPEST)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def tile(self, zoom: int, column: int, row: int) -> Tile | None:
        """Return a tile; None if there is none, or it is damaged."""
        if not 0 <= zoom <= DEEPEST or not 0 <= column < 1 << zoom or not 0 <= row < 1 << zoom:
            return None
        # One at a time: memory for one directory of a hostile file.
        with self._lock, suppress(DataError), open_map(self.path) as opened:
            return opened.tile(zoom, column, row)
        return None

    def told(self) -> dict[str, Any]:
        """Return what the page needs to show it."""
        return {
            "tiles": "tiles/{z}/{x}/{y}",
            "min": self.zooms[0],
            "max": self.zooms[1],
            "attribution": self.attribution,
        }


def map_of(studio: Studio) -> Map | None:
    """Return the map that was named at the start, or the first of the folder; None without any."""
    paths = [studio.map_file] if studio.map_file is not None else []
    if not paths:
        paths = [Path(e.path) for e in studio.folder.entries() if e.name.lower().endswith(ENDINGS)]
    for path in sorted(paths):
        with suppress(OSError):
            about = path.stat()
            key = (path, about.st_mtime_ns, about.st_size)
            if studio.known_map[0] == key:
                return studio.known_map[1]
            with suppress(DataError), open_map(path) as opened:
                studio.known_map = (key, Map(path, opened.attribution, opened.zooms))
                return studio.known_map[1]
    return None


_log = logging.getLogger("strapdown")
#: The built front end; a developer may name another.
STATIC = Path(os.environ.get("STRAPDOWN_STUDIO_STATIC") or Path(__file__).parent / "static")
#: Kinds of files of the page and of results; others are sent as bytes.
MEDIA = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".webp": "image/webp",
    ".csv": "text/csv; charset=utf-8",
    ".toml": "text/plain; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".pdf": "application/pdf",
    ".woff2": "font/woff2",
    ".zip": "application/zip",
    ".gpx": "application/gpx+xml",
}
#: Status by code; 400 of other requests that cannot be met, 422 of data that cannot be used.
STATUS = {
    "studio.no-such-file": 404,
    "studio.no-such-run": 404,
    "studio.no-such-job": 404,
    "studio.no-such-page": 404,
    "studio.file-exists": 409,
    "studio.name-taken": 409,
    "studio.run-exists": 409,
    "studio.job-at-work": 409,
    "studio.upload-too-large": 413,
    "studio.request-too-large": 413,
    "studio.too-many-jobs": 429,
    "studio.disk-full": 507,
}
#: Buckets of a series, points of a track, at most.
WIDEST, MOST_POINTS = 20_000, 50_000


@dataclass
class Studio:
    """State that the routes share.

    Attributes
    ----------
    folder : Folder
    jobs : Jobs
    reading, quick : ReadingProcess
        Of logs and configurations; and of a crash while its parameters move, which must not wait
        for a log.
    map_file : Path or None
        Map that was named at the start, instead of one in the folder.
    """

    folder: Folder
    jobs: Jobs
    reading: ReadingProcess
    quick: ReadingProcess
    map_file: Path | None = None
    uploads: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(4))
    known_runs: dict[tuple[str, int, int], dict[str, Any]] = field(default_factory=dict)
    known_map: tuple[Any, Map | None] = (None, None)

    @classmethod
    def of(cls, folder: Folder, map_file: Path | None = None) -> Studio:
        """Return the studio of a folder."""
        path = folder.path
        return cls(folder, Jobs(folder), ReadingProcess(path), ReadingProcess(path), map_file)

    def end(self) -> None:
        """End the processes that read; jobs go on."""
        self.reading.end()
        self.quick.end()

    async def ask(self, question: str, *files: Path, **arguments: Any) -> Any:
        """Ask the process that reads, in a thread."""
        process = self.quick if question == "quick" else self.reading
        return await run_in_threadpool(process.ask, question, files=files, **arguments)


Handler = Callable[["Studio", Request], Awaitable[Response]]


# --- files and logs -----------------------------------------------------------------------


async def state(studio: Studio, _: Request) -> Response:
    """Files, results and jobs of the folder."""

    def seen() -> dict[str, Any]:
        return {
            "version": __version__,
            "folder": studio.folder.path.name,
            "files": studio.folder.files(),
            "runs": list_runs(studio),
            "jobs": studio.jobs.listed(),
            "samples": listed_samples(),
        }

    return JSONResponse(await run_in_threadpool(seen))


def list_runs(studio: Studio) -> list[dict[str, Any]]:
    """Results of the folder, each read once."""
    from strapdown.studio.runs import summary

    found = []
    for name in studio.folder.results():
        with suppress(StrapdownError, OSError):
            about = (studio.folder.path / name / "manifest.json").stat()
            key = (name, about.st_mtime_ns, about.st_size)
            if key not in studio.known_runs:
                studio.known_runs[key] = summary(studio.folder.path, name)
            found.append(studio.known_runs[key])
    return found


async def put_file(studio: Studio, request: Request) -> Response:
    """Take a file, part by part."""
    name = request.path_params["name"]
    length = request.headers.get("content-length")
    declared = int(length) if length is not None and length.isdecimal() else None
    replace = request.query_params.get("replace") == "1"
    async with studio.uploads:
        try:
            found = await studio.folder.take(
                name, request.stream(), declared=declared, replace=replace
            )
        except ClientDisconnect:
            raise DataError("studio.upload-stalled", file=plain_name(name)) from None
    return JSONResponse(found, status_code=201)


async def look(studio: Studio, request: Request) -> Response:
    """What `doctor` finds in files."""
    asked = await body(request, files=list, log=dict, axes=str)
    paths = [studio.folder.file(name) for name in asked.get("files", [])]
    log, axes = reading_of(asked)
    names = [studio.folder.name_of(path) for path in paths]
    return JSONResponse(await studio.ask("look", *paths, names=names, log=log, axes=axes))


async def series(studio: Studio, request: Request) -> Response:
    """Extremes of a stream of a log."""
    query = request.query_params
    path = studio.folder.file(query.get("file", ""))
    log, axes = reading_of(
        {"log": parsed(query.get("log", "{}"), "log"), "axes": query.get("axes")}
    )
    name = query.get("stream", "imu")
    at = await studio.ask(
        "stream", path, file=studio.folder.name_of(path), name=name, log=log, axes=axes
    )
    return await extremes(Path(at), request)


async def extremes(at: Path, request: Request) -> Response:
    """Series of a stored stream over the part that a request names."""
    query = request.query_params
    width = int(number(query.get("width"), "width") or 1200)
    begin, end = (number(query.get(key), key) for key in ("from", "to"))
    columns = [name for name in query.get("columns", "").split(",") if name]
    width = max(1, min(width, WIDEST))
    found = await run_in_threadpool(StoredStream(at).series, columns, begin, end, width)
    return JSONResponse(found)


def reading_of(asked: Mapping[str, Any]) -> tuple[dict[str, Any], str | None]:
    """Keys of ``[log]`` and the axes, which a page may keep among them."""
    log = {k: v for k, v in (asked.get("log") or {}).items() if v is not None}
    axes = asked.get("axes") or log.pop("axes", None)
    log.pop("axes", None)
    return log, axes if isinstance(axes, str) else None


async def copy_sample(studio: Studio, request: Request) -> Response:
    """Copy records to begin with into the folder."""
    return JSONResponse(await studio.ask("sample", name=request.path_params["name"]))


# --- configurations and jobs --------------------------------------------------------------


async def kinds(studio: Studio, _: Request) -> Response:
    """What can be run, each with its form."""
    return JSONResponse(await studio.ask("kinds"))


async def propose(studio: Studio, request: Request) -> Response:
    """Propose a configuration."""
    asked = await body(
        request,
        kind=str,
        files=list,
        log=dict,
        axes=str,
        answers=dict,
        from_s=float,
        to_s=float,
    )
    paths = [studio.folder.file(name) for name in asked.get("files", [])]
    log, axes = reading_of(asked)
    answers = asked.get("answers") or {}
    for key in ("from_s", "to_s"):
        if asked.get(key) is not None:
            log[key] = asked[key]
    found = await studio.ask(
        "propose",
        *paths,
        kind=asked.get("kind", ""),
        names=[studio.folder.name_of(path) for path in paths],
        log=log,
        axes=axes,
        answers=answers,
    )
    return JSONResponse(found)


async def check(studio: Studio, request: Request) -> Response:
    """Check a configuration, and change its keys."""
    asked = await body(request, kind=str, toml=str, set=dict, name=str)
    found = await studio.ask(
        "check",
        kind=asked.get("kind", ""),
        toml=asked.get("toml", ""),
        changes=asked.get("set") or {},
        name=asked.get("name") or "",
    )
    return JSONResponse(found)


async def submit(studio: Studio, request: Request) -> Response:
    """Write a configuration beside the logs, and queue the command that runs it."""
    asked = await body(request, kind=str, name=str, toml=str, protocol=str, options=(list, dict))
    name = plain_name(asked.get("name", ""))
    options = asked.get("options") or []
    if asked.get("kind") == "live":
        return await submit_live(studio, name, asked.get("protocol") or "", options)
    if not isinstance(options, list):
        raise ConfigError("studio.wrong-type", quantity="options", wanted="list")
    made = await studio.ask(
        "command",
        kind=asked.get("kind", ""),
        name=name,
        toml=asked.get("toml", ""),
        options=options,
    )

    def queued() -> dict[str, Any]:
        refuse_taken(studio, name, made["words"])
        digest = ""
        if made["file"]:
            digest = write_configuration(studio, made["file"], asked["toml"], made["words"])
        else:
            kept = studio.folder.state / "configurations"
            replace_file(kept / f"{name}.toml", asked["toml"].encode())
        return studio.jobs.submit(asked["kind"], name, made["words"], digest)

    return JSONResponse(await run_in_threadpool(queued), status_code=201)


async def submit_live(
    studio: Studio, name: str, protocol: str, options: Mapping[str, Any] | list[Any]
) -> Response:
    """Queue a run that receives samples as they come."""

    def queued() -> dict[str, Any]:
        given = options if isinstance(options, dict) else {}
        words = live_command(studio.folder.path, name, protocol, given)
        refuse_taken(studio, name, words)
        return studio.jobs.submit("live", name, words)

    return JSONResponse(await run_in_threadpool(queued), status_code=201)


def refuse_taken(studio: Studio, name: str, words: list[str]) -> None:
    """Refuse a run whose folder is there, unless it is to be replaced: ConfigError."""
    target = studio.folder.path / name
    if (target.exists() or target.is_symlink()) and "--force" not in words:
        raise ConfigError("studio.run-exists", name=name)


async def live(studio: Studio, _: Request) -> Response:
    """Who may send samples."""
    return JSONResponse(await run_in_threadpool(live_info, studio.folder.path))


def write_configuration(studio: Studio, name: str, text: str, words: list[str]) -> str:
    """Write the configuration file of a job; return its digest.

    One that is there is replaced only if it is the same, was written for another job, or the user
    asked to replace the result. ConfigError: it is the user's own.
    """
    data = text.encode()
    digest = hashlib.sha256(data).hexdigest()
    target = studio.folder.path / plain_name(name)
    if target.is_symlink() or target.is_dir():
        raise ConfigError("studio.name-taken", file=name)
    if target.exists():
        there = hashlib.sha256(target.read_bytes()).hexdigest()
        if there != digest and not studio.jobs.wrote(there) and "--force" not in words:
            raise ConfigError("studio.file-exists", file=name)
    replace_file(target, data)
    return digest


async def job(studio: Studio, request: Request) -> Response:
    """State of a job, with its whole output."""
    number = request.path_params["id"]
    return JSONResponse(studio.jobs.shown(number) | {"output": studio.jobs.whole(number)})


async def states(studio: Studio, request: Request) -> Response:
    """States of a live run from its beginning."""
    number = request.path_params["id"]
    return JSONResponse(await run_in_threadpool(states_of, studio.folder, studio.jobs, number))


async def cancel(studio: Studio, request: Request) -> Response:
    """End a job."""
    shown = await run_in_threadpool(studio.jobs.cancel, request.path_params["id"])
    return JSONResponse(shown)


# --- results ------------------------------------------------------------------------------


async def run(studio: Studio, request: Request) -> Response:
    """Numbers, findings and inputs of a result."""
    name = run_name(studio, request)
    found = await studio.ask("run", studio.folder.path / name, name=name)
    made = next((j for j in studio.jobs.listed() if j["run"] == name), None)
    return JSONResponse(
        {
            **found,
            "job": made["id"],
            "command_line": repeating(studio.folder.path, name, made["command"]),
        }
        if made
        else {**found, "job": None}
    )


async def run_series(studio: Studio, request: Request) -> Response:
    """Extremes of the columns of a result."""
    name = run_name(studio, request)
    at = await studio.ask("run_stream", studio.folder.path / name, name=name)
    return await extremes(Path(at), request)


async def track(studio: Studio, request: Request) -> Response:
    """Places and attitudes along a result."""
    name = run_name(studio, request)
    points = int(number(request.query_params.get("points"), "points") or 2000)
    points = max(2, min(points, MOST_POINTS))
    found = await studio.ask("track", studio.folder.path / name, name=name, points=points)
    return JSONResponse(found)


async def run_file(studio: Studio, request: Request) -> Response:
    """One file of a result, without rights where it is a page."""
    from strapdown.studio.runs import file_of_run

    path = await run_in_threadpool(
        file_of_run, studio.folder.path, request.path_params["name"], request.path_params["path"]
    )
    response = FileResponse(path, media_type=media_of(path))
    response.headers["content-security-policy"] = SANDBOX
    return response


async def export(studio: Studio, request: Request) -> Response:
    """Download a result: the folder, its report as PDF, its track, its configuration."""
    name = run_name(studio, request)
    kind = request.query_params.get("as", "zip")
    geoid = number(request.query_params.get("geoid"), "geoid")
    epoch = request.query_params.get("epoch")
    place = studio.folder.path / name
    made = await studio.ask("export", place, name=name, kind=kind, epoch=epoch, geoid=geoid)
    path = Path(made["path"])
    response = FileResponse(path, media_type=media_of(path), filename=made["name"])
    response.headers["content-security-policy"] = SANDBOX
    return response


async def compare(studio: Studio, request: Request) -> Response:
    """Differences of results."""
    asked = await body(request, runs=list)
    names = [studio.folder.file(name).name for name in asked.get("runs", [])]
    paths = [studio.folder.path / name for name in names]
    return JSONResponse(await studio.ask("compare", *paths, runs=names))


async def comparison_file(studio: Studio, request: Request) -> Response:
    """One file of a comparison, without rights where it is a page."""
    from strapdown.studio.runs import file_of_comparison

    asked = request.path_params
    path = await run_in_threadpool(
        file_of_comparison, studio.folder.path, asked["key"], asked["path"]
    )
    response = FileResponse(path, media_type=media_of(path))
    response.headers["content-security-policy"] = SANDBOX
    return response


async def quick(studio: Studio, request: Request) -> Response:
    """Linear answer of a crash while its parameters move."""
    asked = await body(request, toml=str, set=dict)
    found = await studio.ask("quick", toml=asked.get("toml", ""), changes=asked.get("set") or {})
    return JSONResponse(found)


def run_name(studio: Studio, request: Request) -> str:
    """Name of an existing result."""
    name = plain_name(request.path_params["name"])
    if name not in studio.folder.results():
        raise ConfigError("studio.no-such-run", word=name)
    return name


# --- map, page ----------------------------------------------------------------------------


async def map_info(studio: Studio, _: Request) -> Response:
    """The map of the folder."""
    found = await run_in_threadpool(map_of, studio)
    if found is None:
        return JSONResponse({"tiles": None, "min": 0, "max": 0, "attribution": ""})
    return JSONResponse(found.told())


async def tile(studio: Studio, request: Request) -> Response:
    """One tile of the map."""
    found = await run_in_threadpool(map_of, studio)
    at = [request.path_params[key] for key in "zxy"]
    picture = None if found is None else await run_in_threadpool(found.tile, *at)
    if picture is None:
        return Response(status_code=204)
    return Response(picture.data, media_type=f"image/{picture.media}")


async def page(_: Studio, __: Request) -> Response:
    """The page."""
    return page_file("index.html")


async def static(_: Studio, request: Request) -> Response:
    """A file of the page."""
    return page_file(request.path_params["name"])


def page_file(name: str) -> Response:
    """A file of the built front end."""
    try:
        path = (STATIC / name).resolve()
        there = path.is_relative_to(STATIC.resolve()) and path.is_file()
    except (OSError, ValueError, RuntimeError):  # a name that cannot be one
        there = False
    if not there:
        raise ConfigError("studio.no-such-page")
    response = FileResponse(path, media_type=media_of(path))
    response.headers["cache-control"] = "no-cache"
    return response


def media_of(path: Path) -> str:
    """Media type by the ending, of those that the studio knows."""
    return MEDIA.get(path.suffix.lower(), "application/octet-stream")


# --- requests -----------------------------------------------------------------------------


def parsed(text: str, what: str) -> Any:
    """Parse a JSON object. ConfigError: it is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ConfigError("studio.not-json", quantity=what) from None
    if not isinstance(found, dict):
        raise ConfigError("studio.not-json", quantity=what)
    return found


async def body(request: Request, **kinds: type | tuple[type, ...]) -> dict[str, Any]:
    """Return the body of a request: an object with keys of some types. ConfigError: another."""
    data = bytearray()
    async for part in request.stream():
        data += part
    found: dict[str, Any]
    try:
        found = parsed(data.decode() or "{}", "body")
    except UnicodeDecodeError:
        raise ConfigError("studio.not-json", quantity="body") from None
    for key, value in found.items():
        kind = kinds.get(key)
        if kind is None:
            raise ConfigError("studio.unknown-key", word=str(key)[:80], known=list(kinds))
        fits = isinstance(value, kind) or (kind is float and isinstance(value, int))
        if value is not None and not fits:
            names = [k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,))]
            raise ConfigError("studio.wrong-type", quantity=key, wanted=" or ".join(names))
        if isinstance(value, list) and not all(isinstance(one, str) for one in value):
            raise ConfigError("studio.wrong-type", quantity=key, wanted="texts")
        if kind is float and value is not None and not math.isfinite(value):
            raise ConfigError("studio.wrong-type", quantity=key, wanted="number")
    return found


def number(text: str | None, key: str) -> float | None:
    """Return a number of a query. ConfigError: it is none."""
    if text in (None, ""):
        return None
    try:
        found = float(str(text))
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise ConfigError("studio.wrong-type", quantity=key, wanted="number")
    return found


def refusal(error: dict[str, Any], kind: str) -> Response:
    """Answer with an error."""
    usual = 422 if kind in ("DataError", "DivergenceError") else 400
    return JSONResponse({"error": error}, status_code=STATUS.get(error["code"], usual))


def answered(studio: Studio, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
    """Return a route that answers an error with its code and sentence."""

    async def route(request: Request) -> Response:
        try:
            return await handler(studio, request)
        except Refused as error:
            return refusal(error.error, error.kind)
        except StrapdownError as error:
            return refusal(told(error.finding), type(error).__name__)
        except ClientDisconnect:
            return Response(status_code=400)
        except Exception:  # a fault of ours, said without a word of where the folder is
            _log.exception("studio")
            failed = told(Finding("studio.failed", severity="error"))
            return JSONResponse({"error": failed}, status_code=500)

    return route


def make_app(studio: Studio) -> Starlette:
    """Return the application behind the guard: paths without the token."""
    events = Events(studio.folder, studio.jobs)

    async def listen(socket: WebSocket) -> None:
        with suppress(WebSocketDisconnect):
            await events.serve(socket)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        watching = asyncio.create_task(events.watch())
        try:
            yield
        finally:
            watching.cancel()
            with suppress(asyncio.CancelledError):
                await watching
            studio.end()

    table: list[tuple[str, str, Handler]] = [
        ("GET", "/", page),
        ("GET", "/static/{name:path}", static),
        ("GET", "/api/state", state),
        ("PUT", "/api/files/{name}", put_file),
        ("POST", "/api/look", look),
        ("GET", "/api/series", series),
        ("GET", "/api/kinds", kinds),
        ("POST", "/api/propose", propose),
        ("POST", "/api/samples/{name}", copy_sample),
        ("GET", "/api/live", live),
        ("POST", "/api/check", check),
        ("POST", "/api/jobs", submit),
        ("GET", "/api/jobs/{id}", job),
        ("GET", "/api/jobs/{id}/states", states),
        ("DELETE", "/api/jobs/{id}", cancel),
        ("GET", "/api/runs/{name}", run),
        ("GET", "/api/runs/{name}/series", run_series),
        ("GET", "/api/runs/{name}/track", track),
        ("GET", "/api/runs/{name}/export", export),
        ("GET", "/runs/{name}/{path:path}", run_file),
        ("POST", "/api/compare", compare),
        ("GET", "/comparisons/{key}/{path:path}", comparison_file),
        ("POST", "/api/crash/quick", quick),
        ("GET", "/api/map", map_info),
        ("GET", "/tiles/{z:int}/{x:int}/{y:int}", tile),
    ]
    routes: list[Any] = [
        Route(path, answered(studio, handler), methods=[method]) for method, path, handler in table
    ]
    routes.append(WebSocketRoute("/api/events", listen))

    async def nothing(*_: Any) -> Response:
        return refusal(told(Finding("studio.no-such-page", severity="error")), "ConfigError")

    app = Starlette(
        routes=routes, lifespan=lifespan, exception_handlers={404: nothing, 405: nothing}
    )
    app.router.redirect_slashes = False
    return app
