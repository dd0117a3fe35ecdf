"""Journal of a live run: what was received, on disk before it is used.

A folder beside the output holds

* ``run.json``: the command, its configuration and options, written first;
* ``journal``: a record for each sample, measurement and command, in the order of arrival;
* ``lock``: held by the process that writes it, and released by the system when that ends.

A record is a length, its complement, a checksum, and a payload. The checksum continues that of the
record before, so that a lost or exchanged record is found. A record goes to the operating system
in one write, before what it holds is used: it survives a kill of the process. The disk has it
`SYNCED` later at the latest: that much a power failure may take. A last record that is incomplete
is cut; any other damage is an error.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import threading
import zlib
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from strapdown.bundle import sha256, to_json
from strapdown.bundle.atomic_folder import HeldError, flush_entry, open_locked, remove_lock
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.live_journal import (
    FRAME,
    JOURNAL,
    MAGIC,
    MEASURED,
    ROWS,
    RUN,
    SAMPLE,
    SCHEMA,
    WORD,
    event_payload,
    events_in,
    records,
    run_of,
)
from strapdown.formats.sensor_streams import Event
from strapdown.live.lines import Measured, Sample, Word

#: Content of a journal: what lines said, and events of phones.
Said = Sample | Measured | Word | Event

LOCK = "lock"
#: Interval at which written data are flushed to the disk, s.
SYNCED = 1.0
_RUN, _SEALED = b"R", b"E"
#: Size of an empty journal.
HEAD = len(MAGIC) + FRAME.size + 65
#: Bytes of rows that are kept in memory before they are written.
ROOM = 1 << 16


def received_folder(out: Path) -> Path:
    """Return the folder of what a run with this output receives."""
    return out.parent / f"{out.name}-received"


class Journal:
    """Journal of a run, locked by this process.

    `begin` starts one, `reopen` continues what a killed run left.

    Attributes
    ----------
    folder : Path
    run : mapping
        Content of ``run.json``.
    warn : callable
        Called with a finding when the journal ends because it cannot be written. The run goes on.
    """

    def __init__(self, folder: Path, run: Mapping[str, Any], lock: int) -> None:
        self.folder, self.run = folder, run
        self.warn: Callable[[Finding], None] = lambda finding: None
        self._lock = lock
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self._file = os.open(folder / JOURNAL, flags, 0o666)
        self._size, self._crc = 0, 0
        self._stopped = self._dirty = False
        self._spools: list[SpooledRows] = []
        self._closing = threading.Event()
        self._syncing = threading.Thread(target=self._sync, name="journal", daemon=True)

    @classmethod
    def begin(cls, folder: Path, run: Mapping[str, Any]) -> Self:
        """Start the journal of a new run.

        Parameters
        ----------
        folder : Path
            It must not hold the data of another run.
        run : mapping
            What is needed to repeat it, as JSON, with its ``command``.

        Raises
        ------
        ConfigError
            The folder has data of another run, or that run has not ended.
        """
        folder.mkdir(parents=True, exist_ok=True)
        lock = _locked(folder)
        try:
            _refuse_data(folder)
            run = {"schema": SCHEMA, **run}
            part = folder / f"{RUN}.part"
            with part.open("w", encoding="utf-8", newline="\n") as stream:
                stream.write(to_json(run))
                stream.flush()
                os.fsync(stream.fileno())
            part.replace(folder / RUN)
            (folder / JOURNAL).unlink(missing_ok=True)
            made = cls(folder, run, lock)
        except BaseException:
            os.close(lock)
            raise
        os.write(made._file, MAGIC)
        made._size = len(MAGIC)
        made._append(_RUN + sha256(folder / RUN).encode())
        _sync_folder(folder)
        _sync_folder(folder.parent)
        made._syncing.start()
        return made

    @classmethod
    def reopen(cls, folder: Path, command: str) -> Self:
        """Open what a killed run left, and cut an incomplete last record.

        Parameters
        ----------
        command : str
            The command that wrote it.

        Raises
        ------
        ConfigError
            The folder has no journal, that of another command, or that of a run that goes on.
        DataError
            It is damaged, of another version, or of a run whose result is written.
        """
        _refuse_none(folder)
        try:
            lock = _locked(folder)
        except ConfigError:
            _refuse_none(folder)
            raise
        try:
            # Who held it may have ended, and removed it, since.
            _refuse_none(folder)
            run = run_of(folder)
            if run["command"] != command:
                raise ConfigError(
                    "live.journal-of-other-command",
                    file=str(folder),
                    quantity="--recover",
                    own=run["command"].split()[0],
                    command=run["command"],
                )
            made = cls(folder, run, lock)
            try:
                made._check()
            except BaseException:
                os.close(made._file)
                raise
        except BaseException:
            if (folder / RUN).exists():
                os.close(lock)
            else:
                _remove_lock(folder, lock)
            raise
        made._syncing.start()
        return made

    def append(self, *received: Said) -> None:
        """Write what came together, a line or a message, before it is used."""
        self._append(*map(_payload, received))

    def said(self) -> Iterator[Said]:
        """Yield what is in it, exact to the bit."""
        return said_of(payload for _, payload in self._payloads())

    @property
    def empty(self) -> bool:
        """Whether nothing was received."""
        return self._size <= HEAD

    def spool(self, name: str, columns: int) -> SpooledRows:
        """Return rows that are kept in a file of its folder until `close`."""
        self._spools.append(SpooledRows(columns, self.folder / f"{name}.rows"))
        return self._spools[-1]

    def sealed(self, digest: str) -> None:
        """Note that the result is written: recovery is not needed."""
        self._append(_SEALED + digest.encode())

    def close(self) -> None:
        """Bring all to the disk, and let others open it."""
        self._end()
        os.close(self._lock)

    def remove(self, *, whole: bool = False) -> None:
        """Close the journal and delete it, and the folder if nothing else is in it.

        `whole`: delete all that is in the folder. The lock goes last: another process that recovers
        it finds it held, or finds no journal.
        """
        self._end()
        if whole:
            for path in self.folder.iterdir():
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                elif path.name != LOCK:
                    path.unlink(missing_ok=True)
        else:
            own = (self.folder / name for name in (JOURNAL, RUN))
            for file in (*self.folder.glob("*.rows"), *own):
                file.unlink(missing_ok=True)
        _remove_lock(self.folder, self._lock)

    def _end(self) -> None:
        """Bring all to the disk, and close all but the lock."""
        self._closing.set()
        self._syncing.join()
        with suppress(OSError):
            os.fsync(self._file)
        os.close(self._file)
        for rows in self._spools:
            rows.close()

    def _append(self, *payloads: bytes) -> None:
        if self._stopped or not payloads:
            return
        crc, parts = self._crc, []
        for payload in payloads:
            crc, count = zlib.crc32(payload, crc), len(payload)
            parts += [FRAME.pack(count, count ^ 0xFFFF, crc), payload]
        data = b"".join(parts)
        try:
            if os.write(self._file, data) < len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self._stop(error)
            return
        self._size, self._crc, self._dirty = self._size + len(data), crc, True

    def _stop(self, error: OSError) -> None:
        """End the journal with its last whole record: a later one could not continue it."""
        if self._stopped:
            return
        self._stopped = True
        with suppress(OSError):
            os.ftruncate(self._file, self._size)
        reason = error.strerror or str(error)
        self.warn(Finding("live.journal-stopped", file=str(self.folder), reason=reason))

    def _sync(self) -> None:
        while not self._closing.wait(SYNCED):
            if self._dirty:
                self._dirty = False
                try:
                    os.fsync(self._file)
                except OSError as error:
                    self._stop(error)

    def _payloads(self) -> Iterator[tuple[int, bytes]]:
        """Yield the ends and the payloads of the complete records; DataError: it is damaged."""
        for at, crc, payload in records(self.folder / JOURNAL):
            self._crc = crc
            yield at, payload

    def _check(self) -> None:
        """Find the end of the last complete record, and cut what is after it."""
        self._size, count, last = 0, 0, b""
        for end, last in self._payloads():
            if not count and last != _RUN + sha256(self.folder / RUN).encode():
                raise DataError(
                    "live.not-its-run", file=str(self.folder / RUN), quantity="--recover"
                )
            self._size, count = end, count + 1
        if count < 2:
            raise DataError("live.journal-empty", file=str(self.folder), quantity="--recover")
        if last[:1] == _SEALED:
            raise DataError(
                "live.journal-complete",
                file=str(self.folder),
                quantity="--recover",
                digest=last[1:].decode("ascii", "replace"),
            )
        os.ftruncate(self._file, self._size)


def said_of(payloads: Iterable[bytes]) -> Iterator[Said]:
    """Yield what the payloads of a journal hold."""
    for payload in payloads:
        kind, rest = payload[:1], payload[1:]
        if (event := events_in(payload)) is not None:
            yield event
        elif kind == SAMPLE:
            time, *values = ROWS[len(rest) // 8].unpack(rest)
            yield Sample(time, tuple(values))
        elif kind == MEASURED:
            yield Measured(*json.loads(rest))
        elif kind == WORD:
            yield Word(rest.decode())


def _payload(said: Said) -> bytes:
    if isinstance(said, Event):
        return event_payload(said)
    if isinstance(said, Sample):
        return SAMPLE + ROWS[1 + len(said.values)].pack(said.time, *said.values)
    if isinstance(said, Measured):
        whole = [said.name, said.time, dict(said.values)]
        return MEASURED + json.dumps(whole, separators=(",", ":")).encode()
    return WORD + said.word.encode()


def _refuse_data(folder: Path) -> None:
    """Refuse a folder with data of another run; a journal without events is not data."""
    journal = folder / JOURNAL
    if journal.is_file() and journal.stat().st_size > HEAD:
        raise ConfigError(
            "live.journal-left",
            file=str(folder),
            quantity="--out",
            folder=folder,
            command=run_of(folder)["command"].split()[0],
        )
    if {p.name for p in folder.iterdir()} - {JOURNAL, LOCK, RUN, f"{RUN}.part"}:
        raise ConfigError("live.received-before", file=str(folder), quantity="--out")


def _refuse_none(folder: Path) -> None:
    """Refuse a folder without a journal."""
    if not (folder / RUN).is_file() or not (folder / JOURNAL).is_file():
        raise ConfigError("live.no-journal", file=str(folder), quantity="--recover")


def _remove_lock(folder: Path, lock: int) -> None:
    """Remove a lock that is held, and its folder if nothing else is in it."""
    remove_lock(folder / LOCK, lock)
    with suppress(OSError):
        folder.rmdir()


def _sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system can."""
    with suppress(OSError):
        flush_entry(folder)


def _locked(folder: Path) -> int:
    """Return the open lock file of a folder."""
    try:
        return open_locked(folder / LOCK, within=True)
    except (HeldError, OSError) as error:
        process = getattr(error, "process", None) or "?"
        raise ConfigError("live.journal-in-use", file=str(folder), process=process) from None


class SpooledRows:
    """Rows of numbers that grow in a file instead of in memory.

    Parameters
    ----------
    columns : int
    path : Path, optional
        A new file; in memory without it, and from where the file cannot be written.
    """

    def __init__(self, columns: int, path: Path | None = None) -> None:
        self.columns, self.count = columns, 0
        self._buffer, self._size = array("d"), 0
        # Content of a file that cannot be written any more.
        self._kept: NDArray[np.float64] = np.empty(0)
        self._file = None if path is None else path.open("w+b", buffering=0)

    def append(self, row: Sequence[float]) -> None:
        """Append a row."""
        self._buffer.extend(row)
        self.count += 1
        if self._file is not None and 8 * len(self._buffer) >= ROOM:
            self._write()

    def close(self) -> None:
        """Close the file; its rows are gone."""
        if self._file is not None:
            self._file.close()

    def _write(self) -> None:
        assert self._file is not None
        data = self._buffer.tobytes()
        try:
            if self._file.write(data) < len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            with suppress(OSError):
                self._file.truncate(self._size)
            self._kept = self._read()
            self._file.close()
            self._file = None
            return
        self._size, self._buffer = self._size + len(data), array("d")

    def _read(self) -> NDArray[np.float64]:
        """Read what is in the file."""
        if self._file is None:
            return self._kept
        self._file.seek(0)
        data = np.fromfile(self._file, dtype=np.float64, count=self._size // 8)
        self._file.seek(self._size)
        return data

    @property
    def rows(self) -> NDArray[np.float64]:
        """All rows, (`count`, columns)."""
        whole = np.concatenate([self._read(), np.frombuffer(self._buffer)])
        return whole.reshape(-1, self.columns)
