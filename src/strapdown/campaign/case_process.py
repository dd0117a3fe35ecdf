"""A process that runs cases, and its keeper, who notices when it dies, hangs or takes too much.

A case may crash its process, hang in compiled code, or need all of the memory. It runs in a process
of its own making, which answers each case by itself: the keeper knows which one it was, records it,
and starts another process for the next. Messages are pickles with their length before them.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import select
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import IO, Any

from strapdown.errors import ConfigError, DivergenceError, StrapdownError

#: Outcome of a case: status, code, findings, scalars in order, curves in order.
Row = dict[str, Any]
_LENGTH = struct.Struct("<Q")
#: Grace beyond the limit before a process that does not answer is ended, s.
GRACE = 1.0
#: Least time of a process to start and to load what it runs, s.
START = 120.0


# --- within the process -------------------------------------------------------------------


def run_case(
    campaign: Any, number: int, errors: list[StrapdownError] | None = None
) -> tuple[Row, Any]:
    """Run a case; returns its row and its result, None where it has none.

    `errors` takes the error that a case is refused or diverges with.
    """
    from strapdown.campaign.kinds import KINDS, at_path
    from strapdown.campaign.specification import key_path

    case = campaign.case(number)
    kind = KINDS[campaign.spec.base.kind]
    row = _row(campaign, case, "done")
    try:
        result = kind.run(campaign.table(case), f"case-{number}")
        view = kind.view(result)
        data = kind.data(view)
        row["scalars"] = [
            _number(at_path(data, key_path(place))) for place in campaign.scalars.values()
        ]
        row["findings"] = " ".join(sorted({one.code for one in _findings(result)}))
        if campaign.spec.keep.curves:
            row["curves"] = _curves(campaign, kind, view)
    except MemoryError:
        return {**row, "status": "memory"}, None
    except StrapdownError as error:
        if errors is not None:
            errors.append(error)
        status = "diverged" if isinstance(error, DivergenceError) else "refused"
        return {**row, "status": status, "code": error.finding.code}, None
    except Exception as error:  # a fault of ours, or of a plug-in, is a result of this case
        return {**row, "status": "failed", "code": type(error).__name__}, None
    return row, result


def _row(campaign: Any, case: Any, status: str, code: str = "") -> Row:
    """Row of a case without results."""
    return {
        **vars(case),
        "case": case.number,
        "status": status,
        "code": code,
        "findings": "",
        "scalars": [math.nan] * len(campaign.scalars),
        "curves": None,
    }


def _findings(result: Any) -> Iterator[Any]:
    found = getattr(result, "findings", None)
    if found is not None:
        yield from found
        return
    for log in getattr(result, "logs", ()):
        yield from (*log.questions, *log.faults, *log.notes)


def _number(value: Any) -> float:
    """A scalar as a number; what is none is NaN."""
    if isinstance(value, bool | int | float):
        return float(value)
    return math.nan


def _curves(campaign: Any, kind: Any, view: Any) -> list[list[float]]:
    import numpy as np

    axis = campaign.spec.keep.axis
    x = np.linspace(axis.from_s, axis.to_s, axis.points)
    table = kind.curves(view)
    time = table.index.to_numpy(dtype=np.float64)
    out = []
    for name in campaign.spec.keep.curves:
        if name not in table.columns:
            out.append([math.nan] * len(x))
            continue
        values = np.interp(x, time, table[name].to_numpy(dtype=np.float64))
        values[(x < time[0] - 1e-9) | (x > time[-1] + 1e-9)] = np.nan
        out.append(values.tolist())
    return out


def _send(stream: IO[bytes], message: Any) -> None:
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def _receive(stream: IO[bytes]) -> Any:
    """Read one message, not a byte of the next; EOFError where the stream ends before its end."""
    return pickle.loads(_exactly(stream, _LENGTH.unpack(_exactly(stream, _LENGTH.size))[0]))


def _exactly(stream: IO[bytes], count: int) -> bytes:
    parts = bytearray()
    while len(parts) < count:
        part = stream.read(count - len(parts))
        if not part:
            raise EOFError
        parts += part
    return bytes(parts)


def end_with(parent: int) -> None:
    """End this process when its keeper ends, however that happens."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def limit_memory(most: int) -> None:
    """Refuse allocations beyond so many bytes, so that what runs meets a MemoryError."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def main() -> None:
    """Serve cases on the standard streams until the input ends."""
    # The output that a case prints must not be among the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    # Unbuffered: not a byte of the next message is read with one.
    asked = os.fdopen(os.dup(0), "rb", buffering=0)
    end_with(os.getppid())
    from strapdown.campaign.design import Campaign

    frozen = _receive(asked)
    campaign = Campaign.thawed(frozen)
    bulk = campaign.bulk() if campaign.spec.base.bulk else None
    limit_memory(int(campaign.spec.limits.memory_mb * 1e6))
    _send(answers, "ready")
    while True:
        try:
            numbers = _receive(asked)
        except EOFError:
            return
        if bulk is not None:
            _send(answers, bulk.run(numbers[0], numbers[-1] + 1))
            continue
        for number in numbers:
            row, _ = run_case(campaign, number)
            _send(answers, row)


# --- its keeper ---------------------------------------------------------------------------


class CaseProcess:
    """Keeps a process that runs cases of a campaign, and starts another where it ends.

    Parameters
    ----------
    frozen : mapping
        `design.Campaign.frozen`.
    """

    def __init__(self, frozen: Mapping[str, Any]) -> None:
        self._frozen = frozen
        self._limit = float(frozen["limits"]["time_s"])
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False
        self._busy = threading.Lock()

    def begin(self) -> threading.Thread:
        """Start the process meanwhile: it loads what it runs while its keeper does the same."""

        def start() -> None:
            # Where it does not start, its first cases say so.
            with self._busy, contextlib.suppress(ConfigError):
                if not self._closed:
                    self._started()

        thread = threading.Thread(target=start, daemon=True)
        thread.start()
        return thread

    def run(self, numbers: Sequence[int]) -> Iterator[Row]:
        """Yield the rows of cases, whatever happens to them."""
        left = list(numbers)
        with self._busy:
            while left and not self._closed:
                yield from self._some(left)

    def _some(self, left: list[int]) -> Iterator[Row]:
        """Yield the rows of cases until none is left, or the process ended; these are taken."""
        process = self._started()
        assert process.stdin is not None
        # A process that ended meanwhile is noticed by its missing answer.
        with contextlib.suppress(BrokenPipeError):
            _send(process.stdin, left)
        while left:
            number, ended = left.pop(0), True
            try:
                row = self._answer(self._limit + GRACE)
                ended = row["status"] == "memory"  # what the process still holds is not known
            except TimeoutError:
                row = self._lost(number, "hung")
            except EOFError:
                row = self._lost(number, self._ended())
            if ended:
                self.stop()
                if self._closed:
                    return
            yield row
            if ended:
                return

    def block(self, first: int, last: int) -> Any:
        """Return what one call makes of many cases (`base.bulk`).

        RuntimeError: the process ended.
        """
        with self._busy:
            process = self._started()
            assert process.stdin is not None
            try:
                _send(process.stdin, [first, last - 1])
                return self._answer(self._limit + GRACE)
            except (EOFError, BrokenPipeError, TimeoutError):
                self.stop()
                raise RuntimeError(f"cases {first} to {last - 1}") from None

    def close(self) -> None:
        """End the process for good, also while another thread waits for its answer."""
        self._closed = True
        process = self._process
        if process is not None:
            process.kill()
        if self._busy.acquire(timeout=10.0):
            self.stop()
            self._busy.release()

    def stop(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with contextlib.suppress(OSError):
                        stream.close()

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._process.poll() is not None:
            self.stop()
            environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
            command = [sys.executable, "-m", "strapdown.campaign.case_process"]
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
                bufsize=0,
                # An interrupt of the keeper is none of a case.
                start_new_session=True,
            )
            assert self._process.stdin is not None
            try:
                _send(self._process.stdin, dict(self._frozen))
                self._answer(max(START, self._limit))
            except (EOFError, BrokenPipeError, TimeoutError):
                self.stop()
                raise ConfigError("campaign.no-process", python=sys.executable) from None
        return self._process

    def _answer(self, limit: float) -> Any:
        """Next message; TimeoutError after `limit`, s, EOFError where the process ended."""
        assert self._process is not None
        assert self._process.stdout is not None
        stream = self._process.stdout
        if not select.select([stream], [], [], limit)[0]:
            raise TimeoutError
        return _receive(stream)

    def _ended(self) -> str:
        """Code of how the process ended."""
        if self._process is None:
            return "exit"
        try:
            code = self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            code = None
        self.stop()
        if code is None:
            return "exit"
        if code < 0:
            with contextlib.suppress(ValueError):
                return signal.Signals(-code).name
        return f"exit {code}"

    def _lost(self, number: int, how: str) -> Row:
        from strapdown.campaign.design import Campaign

        campaign = Campaign.thawed(self._frozen)
        case, hung = campaign.case(number), how == "hung"
        return _row(campaign, case, "hung" if hung else "crashed", "" if hung else how)


if __name__ == "__main__":
    main()
