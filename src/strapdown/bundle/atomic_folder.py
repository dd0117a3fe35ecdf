"""Write a folder whole or not at all, by one process at a time.

1. `claimed` locks the output name for the duration of a run, and collects what a killed run left.
2. `written_whole` yields a hidden folder beside the destination. At the end of the block all its
   files are flushed to the disk, it takes the place of the destination in one step, and the
   folder around both is flushed.

Where the system can exchange two names in one step (``renameat2`` of Linux, ``renamex_np`` of
macOS), one of the old and the new content is at the destination at each instant. Elsewhere an
old folder is renamed first: a process killed between the two renames leaves nothing at the name,
and the next run into it restores the old one.

Names beside a destination ``NAME``: ``.NAME.lock``, which exists while a run holds the name, and
``.NAME.XXXXXXXXXXXXXXXX.partial`` and ``.old`` with 16 hexadecimal digits.
"""

from __future__ import annotations

import ctypes
import errno
import functools
import os
import re
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from secrets import token_hex
from typing import Any

from strapdown.errors import ConfigError

MANIFEST = "manifest.json"
#: Guarantees differ between systems; tests simulate the others.
WINDOWS, MACOS = os.name == "nt", sys.platform == "darwin"
_LOCK = re.compile(r"\.(?P<name>.+)\.lock", re.S)
_LEFT = re.compile(r"\.(?P<name>.+)\.[0-9a-f]{16}\.(?P<kind>partial|old)", re.S)
#: Beginning of a lock file, before the number of the process.
_OWNER = b"strapdown "
#: Errors of a file system without locks.
_NO_LOCKS = {errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS}
_TAKEN = {errno.EACCES, errno.EAGAIN, errno.EDEADLK}


def check_destination(out: Path, force: bool) -> None:
    """Refuse a folder that must not be written.

    `force`: allow a bundle, which has a manifest, or an empty folder, to be replaced.
    """
    if not out.exists():
        # Report before a long run a write error that would occur after it.
        parent = next(p for p in out.absolute().parents if p.exists())
        if not parent.is_dir() or not os.access(parent, os.W_OK):
            raise ConfigError("bundle.not-writable", file=str(out), quantity="--out", parent=parent)
        return
    if out.is_dir() and not any(out.iterdir()):
        return
    if not force:
        raise ConfigError("bundle.folder-exists", file=str(out), quantity="--out")
    if not (out.is_dir() and (out / MANIFEST).is_file()):
        raise ConfigError("bundle.not-a-bundle", file=str(out), quantity="--out")


# One run per name.


#: Names that this process holds, with the thread that does. A lock of POSIX is one of the process:
#: it does not hold off another thread. Changed by single operations of a dictionary alone, as an
#: interrupt could leave a lock of threads locked.
_HELD: dict[Path, tuple[int]] = {}


@contextmanager
def claimed(out: Path, force: bool = False) -> Iterator[Path]:
    """Hold the name of an output, so that no other run writes it, and restore or collect leftovers.

    Folders above it are created, and removed if they are empty at the end. A thread that holds
    the name may claim it again. Yields the destination with symbolic links resolved.

    ConfigError: another run holds the name, its folder cannot be created, or as
    `check_destination`.
    """
    out = Path(os.path.realpath(out))
    me = (threading.get_ident(),)
    holder = _HELD.setdefault(out, me)
    if holder is not me:
        if holder != me:
            raise _held_by(out, os.getpid())
        check_destination(out, force)
        yield out
        return
    made = [p for p in out.parents if not p.exists()]
    lock = None
    try:
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
        except OSError:
            parent = next(p for p in out.parents if p.exists())
            raise ConfigError(
                "bundle.not-writable", file=str(out), quantity="--out", parent=parent
            ) from None
        lock = _locked(out)
        if lock is not None:
            with suppress(OSError):
                _collect_all(out)
        check_destination(out, force)
        yield out
    finally:
        if lock is not None:
            remove_lock(_lock_file(out), lock)
        _HELD.pop(out, None)
        # A folder that another process has begun to use is kept.
        with suppress(OSError):
            for parent in made:
                parent.rmdir()


def _held_by(out: Path, process: int | None) -> ConfigError:
    return ConfigError(
        "bundle.being-written",
        file=str(out),
        quantity="--out",
        process="" if process is None else f" (process {process})",
    )


def _lock_file(out: Path) -> Path:
    return out.parent / f".{out.name}.lock"


def _locked(out: Path) -> int | None:
    """Lock a name; None where the file system has no locks."""
    path = _lock_file(out)
    while True:
        try:
            lock = open_locked(path)
        except HeldError as error:
            raise _held_by(out, error.process) from None
        except OSError as error:
            if error.errno in _NO_LOCKS:
                path.unlink(missing_ok=True)
                return None
            raise ConfigError(
                "bundle.cannot-write", file=str(out), quantity="--out", reason=error.strerror
            ) from None
        # A run that ended meanwhile has removed the file that was locked.
        with suppress(OSError):
            if os.path.samestat(os.fstat(lock), path.stat()):
                return lock
        os.close(lock)


class HeldError(Exception):
    """Another process holds a lock.

    `process`: its number, None if it is not known.
    """

    def __init__(self, process: int | None) -> None:
        self.process = process


def open_locked(path: Path, *, within: bool = False) -> int:
    """Open a lock file, lock it, and write the number of this process into it.

    `within`: hold off this process, too. The system releases the lock when the file is closed, or
    the process ends, however it does. HeldError: it is locked. OSError: it cannot be opened, or the
    file system has no locks.
    """
    lock = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666)
    try:
        if WINDOWS:
            msvcrt: Any = import_module("msvcrt")
            # Beyond its content, which others may read.
            os.lseek(lock, 1 << 20, os.SEEK_SET)
            msvcrt.locking(lock, msvcrt.LK_NBLCK, 1)
            os.lseek(lock, 0, os.SEEK_SET)
        else:
            fcntl: Any = import_module("fcntl")
            # A lock of the process is not inherited by its children, and an interrupted call of
            # this process, which left the file open, does not hold off the next.
            take = fcntl.flock if within else fcntl.lockf
            take(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.ftruncate(lock, 0)
        os.write(lock, _OWNER + str(os.getpid()).encode() + b"\n")
    except OSError as error:
        # Windows reads nothing of a file that another process has locked.
        owner = os.read(lock, 64) if error.errno in _TAKEN and not WINDOWS else b""
        os.close(lock)
        if error.errno not in _TAKEN:
            raise
        number = owner.removeprefix(_OWNER).strip()
        raise HeldError(int(number) if number.isdigit() else None) from None
    return lock


def remove_lock(path: Path, lock: int) -> None:
    """Remove a lock file that is held, and release it."""
    # Unlike POSIX, Windows cannot remove a file that is open.
    if WINDOWS:
        os.close(lock)
    with suppress(OSError):
        path.unlink()
    if not WINDOWS:
        os.close(lock)


# Files that a killed run left.


def _collect_all(out: Path) -> None:
    """Collect what killed runs left: of this name, and of each in its folder that nobody holds."""
    _collect(out)
    # To open and close a lock file of this process would release it.
    held = {p.name for p in list(_HELD) if p.parent == out.parent}
    with os.scandir(out.parent) as entries:
        found = [m["name"] for e in entries if (m := _LOCK.fullmatch(e.name))]
    for name in set(found) - held:
        other = out.parent / name
        with suppress(OSError, ConfigError):
            if not _lock_file(other).read_bytes().startswith(_OWNER):
                continue
            lock = _locked(other)
            if lock is not None:
                try:
                    _collect(other)
                finally:
                    remove_lock(_lock_file(other), lock)


def _collect(out: Path) -> None:
    """Restore an old folder that was moved away and not replaced; remove all other leftovers."""
    with os.scandir(out.parent) as entries:
        found = [(e.name, m) for e in entries if (m := _LEFT.fullmatch(e.name))]
    left = [(out.parent / name, m["kind"]) for name, m in found if m["name"] == out.name]
    for path, kind in left:
        if kind == "old" and not out.exists():
            path.rename(out)
        elif path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


# One folder in place of another.


@contextmanager
def written_whole(out: Path, seal: Callable[[Path], None]) -> Iterator[Path]:
    """Yield an empty folder whose content at the end of the block takes the place of `out`.

    `out`: absolute, held by `claimed`. `seal`: called with the folder at the end of the block.
    An error in the block, or in `seal`, leaves what was there.
    """
    # Named before it is created: an interrupt in between leaves no folder either.
    staging = _beside(out, "partial")
    try:
        staging.mkdir()
        yield staging
        seal(staging)
        for path, _, names in os.walk(staging, topdown=False):
            for name in names:
                _flush_file(Path(path) / name)
            flush_entry(Path(path))
        _put_in_place(staging, out)
    except BaseException as error:
        shutil.rmtree(staging, ignore_errors=True)
        if isinstance(error, OSError) and str(error.filename or staging).startswith(str(staging)):
            error.filename = str(out)  # a full disk names no file, others a hidden folder
        raise


def replace_file(path: Path, data: bytes, folder: Path | None = None) -> None:
    """Write a file whole or not at all, over one that exists.

    `folder`: a finished folder with the file, beside which it is written first, so that a killed
    process leaves nothing foreign in it.
    """
    partial = _beside(path if folder is None else folder, "partial")
    try:
        partial.write_bytes(data)
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def _beside(out: Path, kind: str) -> Path:
    return out.parent / f".{out.name}.{token_hex(8)}.{kind}"


def _put_in_place(staging: Path, out: Path) -> None:
    """Rename the finished folder to its destination, then delete an old one."""
    # In one step where the system and the file system can.
    exchange = _exchange() if out.exists() else None
    if not out.exists():
        staging.rename(out)
    elif exchange is not None and exchange(os.fsencode(staging), os.fsencode(out)) == 0:
        shutil.rmtree(staging, ignore_errors=True)
    else:
        old = _beside(out, "old")
        try:
            out.rename(old)
            staging.rename(out)
        except BaseException:
            if old.exists() and not out.exists():
                old.rename(out)
            raise
        finally:
            if out.exists():
                shutil.rmtree(old, ignore_errors=True)
    flush_entry(out.parent)


_HERE = -100  # AT_FDCWD of Linux: paths are absolute, and nothing is relative to it
_EXCHANGE = 2  # RENAME_EXCHANGE of Linux; RENAME_SWAP of macOS has the same value


@functools.cache
def _exchange() -> Callable[[bytes, bytes], int] | None:
    """Return the function of the system that exchanges two names, if it has one."""
    system: str = sys.platform
    text, number, flags = ctypes.c_char_p, ctypes.c_int, ctypes.c_uint
    try:
        library = ctypes.CDLL(None, use_errno=True)
        if system == "linux":
            rename = library.renameat2
            rename.argtypes = [number, text, number, text, flags]
            return lambda a, b: int(rename(_HERE, a, _HERE, b, _EXCHANGE))
        if MACOS:
            swap = library.renamex_np
            swap.argtypes = [text, text, flags]
            return lambda a, b: int(swap(a, b, _EXCHANGE))
    except (OSError, AttributeError, TypeError):
        pass  # an older C library, or another system
    return None


# To the disk: after a power cut, too, a folder is whole or absent.


def _flush_file(path: Path) -> None:
    # Windows flushes only what may be written.
    number = os.open(path, os.O_RDWR if WINDOWS else os.O_RDONLY)
    try:
        if MACOS:
            fcntl: Any = import_module("fcntl")
            # fsync of macOS leaves the data in the cache of the disk.
            fcntl.fcntl(number, fcntl.F_FULLFSYNC)
        else:
            os.fsync(number)
    except OSError as error:
        # A file system that cannot flush promises nothing; one that failed has lost data.
        if error.errno not in _NO_LOCKS:
            raise
    finally:
        os.close(number)


def flush_entry(folder: Path) -> None:
    """Flush the names in a folder; Windows does so itself."""
    if not WINDOWS:
        _flush_file(folder)
