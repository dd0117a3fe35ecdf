"""The folder of a studio: names that are shown, paths that stay in it, and files that are taken in.

Every name that comes from outside is one plain component (`plain_name`), and every path is followed
through its links before it is opened (`within`): nothing outside of the folder is read or written.
The studio's own files are in `STATE`, which is never listed and never served.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
import unicodedata
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from strapdown.bundle import MANIFEST
from strapdown.errors import ConfigError, DataError, printable

#: Folder of the studio's own: jobs and what was computed of logs.
STATE = ".strapdown-studio"
#: Longest name, bytes of UTF-8; entries of a folder that are looked at.
LONGEST, MOST_ENTRIES = 200, 5000
#: Files of one folder that are listed.
MOST_INSIDE = 500
#: Characters that some system gives a meaning in a name.
_MARKS = frozenset('/\\:*?"<>|')
#: Files by which a folder is a session of a live run.
_OF_SESSION = ("journal", "run.json")
#: How the JSON of a result begins, such as a manifest; bytes that are searched for it.
_OF_RESULT, _HEAD = re.compile(rb'\A\s*\{\s*"schema":\s*"strapdown '), 200
#: Names that Windows gives to devices.
_DEVICES = frozenset(
    ("con", "prn", "aux", "nul", *(f"com{k}" for k in range(10)), *(f"lpt{k}" for k in range(10)))
)


@dataclass(frozen=True)
class Limits:
    """Limits of what a studio takes.

    Attributes
    ----------
    upload : int
        Largest file, bytes.
    disk : int
        Bytes that stay free on the disk.
    body : int
        Largest request that is not a file, bytes.
    sockets : int
        WebSockets at once.
    connections : int
        Connections at once.
    patience : float, s
        Longest wait for the next part of a request, or for a client to take the answer.
    """

    upload: int = 8 << 30
    disk: int = 1 << 30
    body: int = 4 << 20
    sockets: int = 16
    connections: int = 96
    patience: float = 20.0


def plain_name(name: object) -> str:
    """Return a name as one component of a path, in the composed form of Unicode (NFC).

    Raises
    ------
    ConfigError
        It is empty, hidden, has a separator, a control character or a mark of direction, or is a
        name that some system does not take.
    """
    text = unicodedata.normalize("NFC", name) if isinstance(name, str) else ""
    refused = (
        not text
        or text[0] in ".- "
        or text[-1] in ". "
        or bool(_MARKS & set(text))
        or printable(text) != text
        or len(text.encode("utf-8", "surrogatepass")) > LONGEST
        or text.partition(".")[0].rstrip().lower() in _DEVICES
    )
    if refused:
        raise ConfigError("studio.name-not-plain", given=str(name)[:80])
    return text


def is_recording(path: Path) -> bool:
    """Whether a file or folder may be a recording: no configuration, and no part of a result."""
    suffix = path.suffix.lower()
    if suffix != ".json" or not path.is_file():
        return suffix != ".toml" or path.is_dir()
    with suppress(OSError), path.open("rb") as stream:
        return _OF_RESULT.search(stream.read(_HEAD)) is None
    return True


def repeating(folder: Path, name: str, made: str) -> str:
    """Return the command that made a result with a folder that is not there as ``--out``."""
    words = [word for word in shlex.split(made) if word != "--force"]
    again, number = f"{name}-again", 2
    while (folder / again).exists():
        again, number = f"{name}-again-{number}", number + 1
    words[words.index("--out") + 1] = again
    return shlex.join(words)


@dataclass(frozen=True)
class Folder:
    """The folder that a studio works in.

    Attributes
    ----------
    path : Path
        Absolute, without links.
    limits : Limits
    """

    path: Path
    limits: Limits = Limits()

    @classmethod
    def open(cls, path: str | Path, limits: Limits | None = None) -> Folder:
        """Open a folder, and make what the studio keeps in it. ConfigError: it cannot be used."""
        root = Path(path)
        if root.exists() and not root.is_dir():
            raise ConfigError("studio.not-a-folder", file=str(path))
        try:
            root = root.resolve(strict=True)
            state = root / STATE
            if state.is_symlink():
                raise ConfigError("studio.state-is-link", file=str(state))
            for part in (
                "",
                "cache",
                "comparisons",
                "configurations",
                "exports",
                "jobs",
                "uploads",
            ):
                (state / part).mkdir(mode=0o700, exist_ok=True)
            for left in (state / "uploads").iterdir():
                left.unlink()  # of an upload that ended with the server
        except OSError as error:
            reason = error.strerror or str(error)
            raise ConfigError("studio.folder-unusable", file=str(path), reason=reason) from None
        return cls(root, limits or Limits())

    @property
    def state(self) -> Path:
        """Folder of the studio's own."""
        return self.path / STATE

    def within(self, given: object) -> Path:
        """Return an existing path that a relative path in the folder names, links followed.

        Raises
        ------
        ConfigError
            It leads out of the folder, into what is hidden, or to nothing.
        """
        text = given if isinstance(given, str) else ""
        if not text or "\0" in text or "\\" in text or len(text) > 20 * LONGEST:
            raise ConfigError("studio.no-such-file", file=str(given)[:80])
        try:
            asked = (self.path / text).resolve(strict=True)
            there = asked.relative_to(self.path)
        except (OSError, ValueError, RuntimeError):
            raise ConfigError("studio.no-such-file", file=str(given)[:80]) from None
        if not there.parts or any(part.startswith(".") for part in there.parts):
            raise ConfigError("studio.no-such-file", file=str(given)[:80])
        return asked

    def file(self, name: object) -> Path:
        """Return the path of a file or folder of the folder, or of a session of a live run in it.

        The path is as named: where the name is a link within the folder, it keeps the link's name.
        """
        parts = name.split("/") if isinstance(name, str) else [""]
        plain = "/".join(plain_name(part) for part in parts)
        for form in ("NFC", "NFD"):
            named = unicodedata.normalize(form, plain)
            if len(parts) <= 2 and (self.path / named).exists():
                self.within(named)
                return self.path / named
        raise ConfigError("studio.no-such-file", file=plain)

    def name_of(self, path: Path) -> str:
        """Return the name of a path of `file`, from the folder."""
        return path.relative_to(self.path).as_posix()

    def refuse_outside(self, path: str, quantity: str) -> None:
        """Refuse a path of a configuration that leads out of the folder: ConfigError."""
        try:
            there = (self.path / path).resolve()
            inside = there.is_relative_to(self.path) and STATE not in there.parts
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside:
            raise ConfigError("studio.path-outside", quantity=quantity, path=path[:200])

    def entries(self) -> Iterator[os.DirEntry[str]]:
        """Yield the entries with plain names that do not lead out of the folder."""
        with os.scandir(self.path) as listed:
            for entry in islice(listed, MOST_ENTRIES):
                try:
                    plain_name(entry.name)
                    self.within(entry.name)
                except ConfigError:
                    continue
                yield entry

    def files(self) -> list[dict[str, Any]]:
        """List the files, and the folders that are not results: name, bytes, time of change in s.

        A folder has ``inside``, the names of the recordings in it; what is none itself has a false
        ``recording``.
        """
        found: list[dict[str, Any]] = []
        for entry in self.entries():
            with suppress(OSError):
                folder = entry.is_dir()
                if folder and (Path(entry.path) / MANIFEST).is_file():
                    continue
                if folder and (sessions := self._sessions(Path(entry.path))):
                    found += sessions
                    continue
                about = entry.stat()
                size = _size(Path(entry.path)) if folder else about.st_size
                one: dict[str, Any] = {"name": entry.name, "bytes": size}
                one["modified"] = about.st_mtime
                if not is_recording(Path(entry.path)):
                    one["recording"] = False
                if folder:
                    one |= {"folder": True, "inside": self._inside(Path(entry.path))}
                found.append(one)
        return sorted(found, key=lambda one: str(one["name"]).lower())

    def _inside(self, folder: Path) -> list[str]:
        """Names of what is in a folder and may be a log of its own."""
        found = []
        for path in islice(folder.iterdir(), MOST_ENTRIES):
            with suppress(OSError, ConfigError):
                inside = self.file(self.name_of(path))
                if is_recording(inside):
                    found.append(self.name_of(inside))
        return sorted(found, key=str.lower)[:MOST_INSIDE]

    def _sessions(self, folder: Path) -> list[dict[str, Any]]:
        """List the sessions in the folder of a live run, each of which is a log."""
        found = []
        for path in islice(folder.iterdir(), MOST_ENTRIES):
            with suppress(OSError, ConfigError):
                inside = self.file(self.name_of(path))
                if all((inside / name).is_file() for name in _OF_SESSION):
                    changed = (inside / _OF_SESSION[0]).stat().st_mtime
                    about = {"name": self.name_of(path), "bytes": _size(inside), "folder": True}
                    found.append({**about, "modified": changed})
        return found

    def results(self) -> list[str]:
        """Names of the folders with a manifest."""
        return sorted(
            e.name for e in self.entries() if e.is_dir() and (Path(e.path) / MANIFEST).is_file()
        )

    def signature(self) -> tuple[tuple[str, int, int], ...]:
        """What changes when a file or a result comes, goes or changes."""
        found = []
        for entry in self.entries():
            with suppress(OSError):
                about = entry.stat()
                found.append((entry.name, about.st_size, about.st_mtime_ns))
        return tuple(sorted(found))

    async def take(
        self, name: str, parts: AsyncIterator[bytes], *, declared: int | None, replace: bool
    ) -> dict[str, Any]:
        """Write a file of the parts that a client sends; it appears when it is complete.

        Parameters
        ----------
        declared : int or None
            Bytes that the client says it will send.
        replace : bool
            Whether a file of that name may be replaced.

        Raises
        ------
        ConfigError
            The name is not plain, or taken.
        DataError
            It is larger than the limit, or the disk is full; what came is removed.
        """
        plain = plain_name(name)
        self._check_free(plain, replace)
        self._check_room(plain, declared or 0)
        handle, temporary = tempfile.mkstemp(dir=self.state / "uploads")
        staged = Path(temporary)
        try:
            with os.fdopen(handle, "wb") as stream:
                count = checked = 0
                async for part in parts:
                    count += len(part)
                    if count - checked > 16 << 20 or count > self.limits.upload:
                        self._check_room(plain, count, written=count)
                        checked = count
                    stream.write(part)
                if declared is not None and count != declared:
                    raise DataError("studio.upload-cut", file=plain, count=count, declared=declared)
                stream.flush()
                os.fsync(stream.fileno())
            staged.chmod(0o644)
            target = self._check_free(plain, replace)
            if replace:
                staged.replace(target)
            else:
                # A link fails if the name was taken meanwhile, in one step.
                target.hardlink_to(staged)
        except FileExistsError:
            raise ConfigError("studio.file-exists", file=plain) from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise DataError("studio.not-written", file=plain, reason=reason) from None
        finally:
            staged.unlink(missing_ok=True)
        about = target.stat()
        return {"name": plain, "bytes": about.st_size, "modified": about.st_mtime}

    def _check_free(self, plain: str, replace: bool) -> Path:
        """Return where a file goes; ConfigError: the name is taken."""
        target = self.path / plain
        # The same name in another form or case is one file on some systems.
        alike = [e.name for e in self.entries() if _folded(e.name) == _folded(plain)]
        if target.is_symlink() or target.is_dir() or (alike and alike != [plain]):
            raise ConfigError("studio.name-taken", file=plain)
        if target.exists() and not replace:
            raise ConfigError("studio.file-exists", file=plain)
        return target

    def _check_room(self, plain: str, size: int, written: int = 0) -> None:
        """Refuse a file that is too large, or for which room is missing: DataError."""
        if size > self.limits.upload:
            raise DataError("studio.upload-too-large", file=plain, most=self.limits.upload / 1e9)
        free = shutil.disk_usage(self.state).free
        if free - (size - written) < self.limits.disk:
            raise DataError("studio.disk-full", file=plain, free=free / 1e9)


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


def _size(folder: Path) -> int:
    """Bytes of the files directly in a folder."""
    with os.scandir(folder) as listed:
        return sum(
            e.stat(follow_symlinks=False).st_size
            for e in islice(listed, MOST_ENTRIES)
            if e.is_file(follow_symlinks=False)
        )
