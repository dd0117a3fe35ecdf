"""`strapdown live` in a process of its own, and what it writes."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time


class Run:
    """A run, whose lines are read as they come."""

    def __init__(self, folder, *options, wait=True):
        self.folder = folder
        self.err_path = folder / "stderr.txt"
        self.err_file = self.err_path.open("w")
        self.job = subprocess.Popen(
            [sys.executable, "-m", "strapdown", "live", "--out", str(folder / "out"), *options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self.err_file,
            text=True,
            cwd=folder,
        )
        self.said: list[dict] = []
        self.came: list[float] = []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        if wait:
            self.until(lambda: self.said or self.job.poll() is not None)
            assert self.said, self.err()
            self.address = self.said[0]["listening"]

    def _read(self):
        for line in self.job.stdout:
            self.came.append(time.perf_counter())
            self.said.append(json.loads(line))

    def states(self, session=None):
        return [s for s in list(self.said) if "time" in s and session in (None, s.get("session"))]

    def until(self, ready, seconds=60.0):
        end = time.monotonic() + seconds
        while not ready():
            assert time.monotonic() < end, (self.said[-3:], self.err())
            time.sleep(0.01)

    def err(self):
        return self.err_path.read_text()

    def end(self, code=0):
        """End by SIGINT as a person does; no traceback."""
        import signal

        if self.job.poll() is None:
            self.job.send_signal(signal.SIGINT)
        self.job.wait(60)
        self._close()
        assert "Traceback" not in self.err(), self.err()
        assert self.job.returncode == code, self.err()

    def kill(self):
        self.job.kill()
        self.job.wait(30)
        self._close()

    def _close(self):
        self.reader.join(10)
        self.job.stdout.close()
        self.err_file.close()
