"""Jobs of a studio: commands of strapdown in processes of their own, whose state is on disk.

A job is ``python -m strapdown COMMAND …`` with the studio's folder as its working directory, so
that its result is the command line's. It goes on when the page is reloaded, and when the server
ends: one that is started again finds it by its process and the instant at which that began.
"""

from __future__ import annotations

import json
import os
import secrets
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from strapdown.bundle import MANIFEST
from strapdown.bundle.atomic_folder import replace_file
from strapdown.errors import ConfigError, Finding
from strapdown.studio import job_keeper
from strapdown.studio.folder import Folder, plain_name, repeating
from strapdown.studio.reading_process import told

#: Jobs at once; jobs that are remembered; jobs that may wait.
AT_ONCE, REMEMBERED, WAITING = 2, 100, 50
#: Time from an interrupt to the end by force, s; of a live run, which then writes what it received.
GRACE, GRACE_LIVE = 8.0, 120.0
#: Bytes and lines of output that a job shows, and bytes of it as a whole.
TAIL, LINES, WHOLE = 16 << 10, 40, 1 << 18
#: States that a job does not leave.
ENDED = ("done", "failed", "cancelled", "lost")


@dataclass(frozen=True)
class Job:
    """A job, as it is on disk.

    Attributes
    ----------
    id, kind, name : str
        `name` is that of the result's folder.
    state : str
        ``waiting``, ``running``, ``done``, ``failed``, ``cancelled`` or ``lost``: its process is
        gone without a word of how it ended.
    words : tuple of str
        The command after ``strapdown``.
    begun, ended : float or None, s
        Unix time.
    process : int or None
        Process, whose group is the job's.
    born : str
        Instant at which the process began, as the system says it; of another process with the
        same number it is another.
    stopping : float or None, s
        When it was asked to end.
    """

    id: str
    kind: str
    name: str
    words: tuple[str, ...]
    made: float
    state: str = "waiting"
    stage: str = ""
    share: float = 0.0
    begun: float | None = None
    ended: float | None = None
    process: int | None = None
    born: str = ""
    stopping: float | None = None
    error: Mapping[str, Any] | None = None
    configuration: str = ""


@dataclass
class Jobs:
    """The jobs of a folder; its methods are called from any thread.

    Parameters
    ----------
    folder : Folder
    """

    folder: Folder
    _jobs: dict[str, Job] = field(default_factory=dict)
    _children: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        for path in sorted(self._place.glob("*.json")):
            job = _read(path)
            if job is not None:
                self._jobs[job.id] = job
        self.advance()

    @property
    def _place(self) -> Path:
        return self.folder.state / "jobs"

    def submit(
        self, kind: str, name: str, words: Sequence[str], configuration: str = ""
    ) -> dict[str, Any]:
        """Queue a command, and begin it if fewer than two run.

        Parameters
        ----------
        kind, name : str
        words : sequence of str
            The command after ``strapdown``.
        configuration : str
            SHA-256 of the configuration file that it runs, if it was written for it.
        """
        with self._lock:
            if sum(job.state == "waiting" for job in self._jobs.values()) >= WAITING:
                raise ConfigError("studio.too-many-jobs", most=WAITING)
            at_work = [j for j in self._jobs.values() if j.state not in ENDED and j.name == name]
            if at_work:
                raise ConfigError("studio.job-at-work", name=name)
            job = Job(
                secrets.token_hex(8),
                kind,
                name,
                tuple(words),
                time.time(),
                configuration=configuration,
            )
            self._keep(job)
            self._forget()
            self.advance()
            return self.shown(job.id)

    def wrote(self, digest: str) -> bool:
        """Whether a configuration file with this digest was written for a job."""
        with self._lock:
            return any(job.configuration == digest for job in self._jobs.values())

    def cancel(self, number: str) -> dict[str, Any]:
        """Interrupt a job, and end it by force if it does not end by itself."""
        with self._lock:
            job = self._known(number)
            if job.state == "waiting":
                self._keep(replace(job, state="cancelled", ended=time.time()))
            elif job.state == "running" and job.stopping is None:
                self._keep(replace(job, stopping=time.time(), stage="ending"))
                self._signal(job, signal.SIGINT)
            return self.shown(number)

    def advance(self) -> list[dict[str, Any]]:
        """See the state of the jobs, begin what waits; return those that changed."""
        changed = []
        with self._lock:
            for number, child in list(self._children.items()):
                # Waited for, as soon as it is gone, whatever its job has said before.
                if child.poll() is not None and self._jobs[number].state in ENDED:
                    del self._children[number]
            for job in list(self._jobs.values()):
                if job.state == "running" and (now := self._seen(job)) != job:
                    ends = now.state != job.state or now.stopping != job.stopping
                    self._keep(now, disk=ends)
                    changed.append(now.id)
            running = sum(job.state == "running" for job in self._jobs.values())
            waiting = [job for job in self._jobs.values() if job.state == "waiting"]
            for job in sorted(waiting, key=lambda one: one.made)[: max(0, AT_ONCE - running)]:
                self._begin(job)
                changed.append(job.id)
            return [self.shown(number) for number in changed]

    def listed(self) -> list[dict[str, Any]]:
        """All jobs, the latest first."""
        with self._lock:
            jobs = sorted(self._jobs.values(), key=lambda one: -one.made)
            return [self.shown(job.id) for job in jobs]

    def running(self) -> int:
        """Number of jobs that run or wait."""
        with self._lock:
            return sum(job.state not in ENDED for job in self._jobs.values())

    def shown(self, number: str) -> dict[str, Any]:
        """Return a job as the front end shows it, with the last lines of its output."""
        with self._lock:
            job = self._known(number)
        done = (self.folder.path / job.name / MANIFEST).is_file()
        made, whole = shlex.join(("strapdown", *job.words)), job.state == "done" and done
        return {
            "id": job.id,
            "kind": job.kind,
            "name": job.name,
            "state": job.state,
            "stage": job.stage,
            "share": job.share,
            "begun": job.begun,
            "ended": job.ended,
            "command": made,
            # Where the result is, the command that made it is refused.
            "again": repeating(self.folder.path, job.name, made) if whole else None,
            "run": job.name if whole else None,
            "error": job.error,
            "tail": self._tail(job),
            "live": self._live(job),
        }

    def whole(self, number: str) -> list[str]:
        """Lines of the output of a job: all, or the last of a very long one."""
        with self._lock:
            path = self.output(number)
        return _last(path, WHOLE).decode("utf-8", "replace").splitlines()

    def output(self, number: str) -> Path:
        """File of the output of a job."""
        return self._file(self._known(number), "log")

    # --- one job -------------------------------------------------------------------------

    def _known(self, number: str) -> Job:
        if number not in self._jobs:
            raise ConfigError("studio.no-such-job", word=str(number)[:40])
        return self._jobs[number]

    def _keep(self, job: Job, *, disk: bool = True) -> None:
        self._jobs[job.id] = job
        if disk:
            text = json.dumps(vars(job) | {"words": list(job.words)})
            replace_file(self._place / f"{job.id}.json", text.encode(), self._place)

    def _file(self, job: Job, ending: str) -> Path:
        return self._place / f"{job.id}.{ending}"

    def _begin(self, job: Job) -> None:
        command = [sys.executable, "-m", "strapdown", *job.words]
        keeper = [sys.executable, "-I", "-S", str(Path(job_keeper.__file__))]
        files = [str(self._file(job, "log")), str(self._file(job, "end"))]
        environment = {
            **os.environ,
            "STRAPDOWN_PROGRESS": str(self._file(job, "progress")),
            "PYTHONUNBUFFERED": "1",
        }
        try:
            process = subprocess.Popen(
                [*keeper, *files, *command],
                cwd=self.folder.path,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                # Neither an interrupt at the terminal nor the end of the server ends it.
                start_new_session=True,
            )
        except OSError as error:
            reason = error.strerror or str(error)
            failed = told(Finding("studio.job-not-started", severity="error", reason=reason))
            self._keep(replace(job, state="failed", error=failed, ended=time.time()))
            return
        self._children[job.id] = process
        born = process_began(process.pid)
        self._keep(replace(job, state="running", begun=time.time(), process=process.pid, born=born))

    def _seen(self, job: Job) -> Job:
        """Return a running job as it is now."""
        said = self._progress(job)
        error = said.get("error")
        if job.stopping is None and "stage" in said:
            share = max(job.share, _share(said.get("share")))
            job = replace(job, stage=str(said["stage"])[:200], share=share)
        code = self._end(job)
        if code is None and self._lives(job):
            grace = GRACE_LIVE if job.kind == "live" else GRACE
            if job.stopping is not None and time.time() > job.stopping + grace:
                self._signal(job, signal.SIGKILL)
                return replace(job, stopping=time.time())
            return job
        code = self._end(job) if code is None else code  # it may have ended between the two
        ended = replace(job, ended=time.time(), process=None)
        if job.stopping is not None and code != 0:
            return replace(ended, state="cancelled")
        if code is None:
            lost = Finding("studio.job-lost", severity="error")
            return replace(ended, state="lost", error=told(lost))
        if code == 0:
            return replace(ended, state="done", share=1.0, stage="")
        if not isinstance(error, Mapping):
            killed = -code in set(signal.Signals)
            how = signal.Signals(-code).name if killed else f"exit code {code}"
            error = told(Finding("studio.job-failed", severity="error", how=how))
        return replace(ended, state="failed", error=error)

    def _progress(self, job: Job) -> dict[str, Any]:
        """Return what a job said last: stage and share, and its error."""
        found: dict[str, Any] = {}
        for line in _last(self._file(job, "progress"), TAIL).splitlines():
            with suppress(ValueError):
                said = json.loads(line)
                found |= said if isinstance(said, dict) else {}
        return found

    def _live(self, job: Job) -> dict[str, Any] | None:
        """Return where a live run listens, once it does, and a warning where it is open."""
        said = self._progress(job).get("live") if job.kind == "live" else None
        if not isinstance(said, dict) or not isinstance(said.get("address"), str):
            return None
        address = said["address"][:300]
        open_ = None
        if said.get("loopback") is not True:
            open_ = Finding("studio.live-open").sentence("studio")
        return {"address": address, "qr": address, "token": None, "warning": open_}

    def _tail(self, job: Job) -> list[str]:
        text = _last(self._file(job, "log"), TAIL).decode("utf-8", "replace")
        return text.splitlines()[-LINES:]

    def _end(self, job: Job) -> int | None:
        """Return how the command ended; None if that is not known."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            return int(json.loads(self._file(job, "end").read_text(encoding="utf-8"))["code"])
        return None

    def _lives(self, job: Job) -> bool:
        child = self._children.get(job.id)
        if child is not None:
            return child.poll() is None
        return job.process is not None and process_began(job.process) == job.born != ""

    def _signal(self, job: Job, number: int) -> None:
        """Send a signal to the group of a job, if its process is still its own."""
        if job.process is None or not self._lives(job):
            return
        with suppress(OSError):
            if os.name == "posix":
                os.killpg(job.process, number)
            else:
                os.kill(job.process, signal.SIGTERM)

    def _forget(self) -> None:
        """Remove the oldest of the jobs that ended."""
        ended = [job for job in self._jobs.values() if job.state in ENDED]
        for job in sorted(ended, key=lambda one: one.made)[: max(0, len(ended) - REMEMBERED)]:
            if job.id in self._children:
                continue  # its keeper is about to end
            del self._jobs[job.id]
            for path in self._place.glob(f"{job.id}.*"):
                path.unlink(missing_ok=True)


def _read(path: Path) -> Job | None:
    """Return the job of a file; None if it is damaged."""
    with suppress(OSError, ValueError, TypeError, KeyError, RecursionError):
        said = json.loads(path.read_text(encoding="utf-8"))
        job = Job(**{**said, "words": tuple(map(str, said["words"]))})
        numbers = all(isinstance(one, int | float) for one in (job.made, job.share))
        if job.id == path.stem and numbers and plain_name(job.name) == job.name:
            return job
    return None


def process_began(number: int) -> str:
    """Return when a process began, as the system says it; empty if there is none."""
    try:
        # The words after the name in brackets; the twentieth is the start in clock ticks. A
        # process that ended and was not waited for is one no longer.
        after = Path(f"/proc/{number}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        return "" if after[0] in "ZX" else after[19]
    except (OSError, IndexError, UnicodeDecodeError):
        pass
    if Path("/proc/self/stat").exists() or shutil.which("ps") is None:
        return ""
    done = subprocess.run(
        ["ps", "-o", "lstart=", "-p", str(number)], capture_output=True, text=True, check=False
    )
    return done.stdout.strip()


def _last(path: Path, most: int) -> bytes:
    """Return the end of a file; empty if there is none."""
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, os.SEEK_END)
            stream.seek(max(0, size - most))
            return stream.read(most)
    except OSError:
        return b""


def _share(value: Any) -> float:
    usable = isinstance(value, int | float) and 0.0 <= value <= 1.0
    return float(value) if usable else 0.0
