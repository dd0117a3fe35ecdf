"""A studio in a process of its own, and clients that are a browser or an attacker."""

from __future__ import annotations

import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import pytest

pytest.importorskip("uvicorn")

#: Starts a studio with the limits of a test, and prints its address.
START = """
import sys
from strapdown.studio.folder import Limits
from strapdown.studio.server import serve
limits = Limits(**{limits!r})
serve(sys.argv[1], limits=limits, started=lambda a: print(a.url, a.jobs, flush=True))
"""


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)

    @property
    def code(self) -> str:
        return str(self.json["error"]["code"])


@dataclass
class Studio:
    """A running studio."""

    folder: Path
    limits: dict[str, Any] = field(default_factory=dict)
    #: Whether it shows its page, for a browser, and not one of a line.
    whole: bool = False
    process: subprocess.Popen[str] = field(init=False)
    url: str = ""
    left: int = 0

    def __post_init__(self) -> None:
        self.start()

    def start(self) -> None:
        env = dict(os.environ)
        if not self.whole:
            page = self.folder.parent / "page"
            page.mkdir(exist_ok=True)
            text = "<!doctype html><title>studio</title>"
            (page / "index.html").write_text(text, encoding="utf-8")
            env["STRAPDOWN_STUDIO_STATIC"] = str(page)
        self.process = subprocess.Popen(
            [sys.executable, "-c", START.format(limits=self.limits), str(self.folder)],
            stdout=subprocess.PIPE,
            text=True,
            env=env,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline().split()
        assert line, self.process.wait()
        self.url, self.left = line[0], int(line[1])

    @property
    def port(self) -> int:
        return int(urlsplit(self.url).port or 0)

    @property
    def token(self) -> str:
        return urlsplit(self.url).path.strip("/")

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def interrupt(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(20)

    def memory(self) -> int:
        """Resident bytes."""
        text = Path(f"/proc/{self.process.pid}/status").read_text(encoding="utf-8")
        return 1024 * int(text.split("VmRSS:")[1].split()[0])

    def ask(
        self,
        method: str,
        path: str,
        body: Any = None,
        *,
        raw: bytes | None = None,
        headers: dict[str, str] | None = None,
        whole: str | None = None,
        wait: float = 120.0,
    ) -> Answer:
        """Send a request; `whole`: path with its token, else one below the token."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=wait)
        said = {"X-Strapdown": "1", **(headers or {})}
        data = raw if raw is not None else None if body is None else json.dumps(body).encode()
        target = whole if whole is not None else f"/{self.token}/{path}"
        try:
            connection.putrequest(
                method, target, skip_host="Host" in said, skip_accept_encoding=True
            )
            if data is not None and "Content-Length" not in said:
                said["Content-Length"] = str(len(data))
            for name, value in said.items():
                if value:
                    connection.putheader(name, value)
            connection.endheaders(data)
            answer = connection.getresponse()
            found = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, found, answer.read())
        finally:
            connection.close()

    def put(self, name: str, data: bytes, query: str = "") -> Answer:
        return self.ask("PUT", f"api/files/{quote(name, safe='')}{query}", raw=data)

    def socket(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=30)

    def finished(self, job: dict[str, Any], seconds: float = 300.0) -> dict[str, Any]:
        """Wait for a job."""
        end = time.monotonic() + seconds
        while job["state"] in ("waiting", "running"):
            assert time.monotonic() < end, job
            time.sleep(0.1)
            job = self.ask("GET", f"api/jobs/{job['id']}").json
        return job

    def until(self, job: dict[str, Any], seconds: float = 120.0) -> dict[str, Any]:
        """Wait until a job has told a stage."""
        end = time.monotonic() + seconds
        while not job["stage"]:
            assert time.monotonic() < end and job["state"] in ("waiting", "running"), job
            time.sleep(0.05)
            job = self.ask("GET", f"api/jobs/{job['id']}").json
        return job


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    """A studio of an empty folder, with small limits, for a module."""
    folder = tmp_path_factory.mktemp("studio") / "folder"
    folder.mkdir()
    one = Studio(folder, {"upload": 1_000_000, "patience": 1.5, "connections": 60, "sockets": 6})
    yield one
    with suppress(ProcessLookupError):
        one.kill()


@pytest.fixture
def fresh(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Studio]:
    """A studio of an empty folder, for one test; with its page where the parameter is "page"."""
    folder = tmp_path / "folder"
    folder.mkdir()
    one = Studio(folder, whole=getattr(request, "param", "") == "page")
    yield one
    one.kill()
    for path in (folder / ".strapdown-studio" / "jobs").glob("*.json"):
        number = json.loads(path.read_text(encoding="utf-8")).get("process")
        if number:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(number, signal.SIGKILL)
