"""A bundle that is interrupted or killed between any two lines of its writing: whole or absent."""

from __future__ import annotations

import errno
import os
import re
import shutil
import subprocess
import sys
import threading
from typing import ClassVar

import pytest
from tests.coded import coded

from strapdown import bundle
from strapdown.bundle import (
    InputFiles,
    atomic_folder,
    claimed,
    read_manifest,
    sha256,
    unsealed_changes,
    write_bundle,
)
from strapdown.errors import ConfigError, DataError

FILES = {bundle.__file__, atomic_folder.__file__}
# These change nothing on the disk.
QUIET = {"_exchange", "sha256"}
HIDDEN = re.compile(r"\.out\.(lock|[0-9a-f]{16}\.(partial|old))")


def write(out, given, text, *, force=False):
    inputs = (InputFiles("record", given, (given,), (sha256(given),)),)
    with write_bundle(
        out, command="none", configuration={"text": text}, inputs=inputs, force=force, seals=[]
    ) as folder:
        (folder / "figures").mkdir()
        (folder / "figures" / "one.svg").write_text(f"<svg>{text}</svg>")
        (folder / "report.html").write_text(text)


def at_line(number, act):
    """A trace function that acts before the line of that number, once."""
    seen = 0

    def inner(frame, event, argument):
        nonlocal seen
        if event == "line":
            seen += 1
            if seen == number:
                act()
        return inner

    def outer(frame, event, argument):
        code = frame.f_code
        return inner if code.co_filename in FILES and code.co_name not in QUIET else None

    return outer


def lines(run):
    """How many lines a whole run has."""
    count = 0

    def tell(frame, event, argument):
        nonlocal count
        count += event == "line"
        return tell

    def outer(frame, event, argument):
        code = frame.f_code
        return tell if code.co_filename in FILES and code.co_name not in QUIET else None

    traced(outer, run)
    return count


def traced(function, run):
    before = sys.gettrace()
    sys.settrace(function)
    try:
        run()
    finally:
        sys.settrace(before)


def interrupt():
    raise KeyboardInterrupt


@pytest.fixture
def given(tmp_path):
    path = tmp_path / "given.csv"
    path.write_text("1,2\n")
    return path


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(bundle, "versions", dict)
    monkeypatch.setattr(bundle, "machine", dict)
    monkeypatch.setattr(bundle, "environment", tuple)
    monkeypatch.setattr(atomic_folder, "_HELD", {})
    # Some thousand times, and no power is cut here.
    monkeypatch.setattr(os, "fsync", lambda number: None)


@pytest.fixture(params=[True, False], ids=["exchange", "two renames"])
def exchange(request, monkeypatch):
    """With a system that exchanges two names in one step, and without."""
    if not request.param:
        monkeypatch.setattr(atomic_folder, "_exchange", lambda: None)
    elif atomic_folder._exchange() is None:
        pytest.skip("this system cannot exchange two names")
    return request.param


def whole(folder):
    return unsealed_changes(folder, read_manifest(folder)) == []


def text_of(folder):
    return (folder / "report.html").read_text()


def as_next_run(out):
    """What the next run into this name finds, after it has collected what a killed one left."""
    atomic_folder._HELD.clear()
    with claimed(out, True):
        found = text_of(out) if out.exists() else None
    hidden = [p.name for p in out.parent.iterdir()] if out.parent.exists() else []
    assert [n for n in hidden if n.startswith(".")] == []
    return found


# An interrupt at the end of a `with` leaves a file to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("every", [7, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("force", [False, True])
def test_an_interruption_leaves_a_whole_bundle_or_nothing(tmp_path, given, force, every, exchange):
    total = lines(lambda: write(tmp_path / "x" / "y", given, "new"))
    assert total > 100
    shutil.rmtree(tmp_path / "x")
    outcomes = set()
    number, went_through = 0, False
    while not went_through:
        number += every
        room = tmp_path / f"room{number}"
        room.mkdir()
        out = room / "deep" / "out"
        if force:
            write(out, given, "old")
        try:
            traced(at_line(number, interrupt), lambda o=out: write(o, given, "new", force=force))
            went_through = True
        except KeyboardInterrupt:
            pass
        if out.exists():
            assert whole(out), number
        # An interruption of the cleaning itself leaves hidden names, for the next run.
        left = [p.name for p in (room / "deep").iterdir()] if (room / "deep").exists() else []
        assert all(name == "out" or HIDDEN.fullmatch(name) for name in left), (number, left)
        outcomes.add(as_next_run(out))
        shutil.rmtree(room)
    assert number > total
    assert outcomes == ({"old", "new"} if force else {None, "new"})


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("force", [False, True])
def test_a_kill_leaves_a_whole_bundle_or_none_under_its_name(tmp_path, given, force, exchange):
    outcomes, after, number, ended = set(), set(), 0, False
    while not ended:
        number += 1
        room = tmp_path / f"room{number}"
        out = room / "out"
        if force:
            write(out, given, "old")
        child = os.fork()
        if child == 0:
            trace = at_line(number, lambda: os._exit(9))
            try:
                traced(trace, lambda o=out: write(o, given, "new", force=force))
            finally:
                os._exit(0)
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        if out.exists():
            assert whole(out), number
        outcomes.add(text_of(out) if out.exists() else None)
        # What is left is hidden, says by its name what it is, and hinders no later run.
        left = [p.name for p in room.iterdir() if p != out] if room.exists() else []
        assert all(HIDDEN.fullmatch(name) for name in left)
        after.add(as_next_run(out))
        write(out, given, "again", force=True)
        assert text_of(out) == "again"
        assert [p.name for p in room.iterdir()] == ["out"]
        shutil.rmtree(room)
    assert after == ({"old", "new"} if force else {None, "new"})
    # Without an exchange nothing is at the name for an instant.
    assert outcomes == after | (set() if exchange else {None})


def test_a_run_collects_what_killed_runs_of_other_names_left(tmp_path, given):
    digits = "0123456789abcdef"
    for name in ("killed", "foreign"):
        (tmp_path / f".{name}.{digits}.partial").mkdir()
    (tmp_path / ".killed.lock").write_bytes(b"strapdown 1\n")
    (tmp_path / ".foreign.lock").write_bytes(b"another program\n")
    (tmp_path / ".mine.partial").mkdir()
    write(tmp_path / "out", given, "new")
    left = {p.name for p in tmp_path.iterdir()}
    assert left == {
        "given.csv",
        "out",
        ".foreign.lock",
        f".foreign.{digits}.partial",
        ".mine.partial",
    }


HOLDER = """
import sys
from pathlib import Path
from strapdown.bundle.atomic_folder import claimed
with claimed(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_run_into_one_name_is_refused_at_once_and_not_the_third(tmp_path, given):
    out = tmp_path / "out"
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(out)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert holder.stdout.readline() == b"held\n"
    with pytest.raises(ConfigError, check=coded("bundle.being-written")) as refused:
        write(out, given, "new")
    assert str(holder.pid) in str(refused.value)
    write(tmp_path / "beside", given, "new")
    # Killed, and not ended in order: the lock is gone with the process.
    holder.kill()
    holder.communicate()
    assert (tmp_path / ".out.lock").exists()
    write(out, given, "new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["beside", "given.csv", "out"]


def test_two_threads_do_not_write_one_name(tmp_path, given):
    out = tmp_path / "out"
    refused = []

    def second():
        try:
            write(out, given, "second")
        except ConfigError as error:
            refused.append(error.finding.code)

    with claimed(out, False):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join()
        write(out, given, "first")
    assert refused == ["bundle.being-written"]
    assert text_of(out) == "first"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["given.csv", "out"]


@pytest.mark.skipif(os.name == "nt", reason="of POSIX")
def test_the_mask_of_new_files_holds_for_folders_too(tmp_path, given):
    before = os.umask(0o077)
    try:
        write(tmp_path / "out", given, "new")
    finally:
        os.umask(before)
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o700
    assert (tmp_path / "out" / "report.html").stat().st_mode & 0o777 == 0o600


def test_every_file_and_folder_is_flushed_before_it_takes_its_name(tmp_path, given, monkeypatch):
    flushed = []
    monkeypatch.setattr(atomic_folder, "_flush_file", lambda path: flushed.append(path))
    renamed = []
    rename = atomic_folder.Path.rename
    monkeypatch.setattr(
        atomic_folder.Path, "rename", lambda a, b: (renamed.append(len(flushed)), rename(a, b))
    )
    write(tmp_path / "out", given, "new")
    inside = {p.relative_to(tmp_path / "out") for p in (tmp_path / "out").rglob("*")}
    staging = flushed[renamed[0] - 1]
    assert {p.relative_to(staging) for p in flushed[: renamed[0]] if p != staging} == inside
    assert flushed[renamed[0] :] == [tmp_path]


class LikeMsvcrt:
    """Locks of Windows: of a range of bytes, by EACCES; the same process is refused, too."""

    LK_NBLCK = 2
    held: ClassVar[list[int]] = []

    @classmethod
    def locking(cls, number, mode, count):
        assert (mode, count, os.lseek(number, 0, os.SEEK_CUR)) == (2, 1, 1 << 20)
        if any(held != number and is_open_on(held, os.fstat(number)) for held in cls.held):
            raise PermissionError(errno.EACCES, "Permission denied")
        cls.held.append(number)


def is_open_on(number, about):
    """Whether a file number is still open, and on that file."""
    try:
        return os.path.samestat(os.fstat(number), about)
    except OSError:
        return False


def test_locks_and_renames_as_windows_has_them(tmp_path, given, monkeypatch):
    monkeypatch.setattr(atomic_folder, "WINDOWS", True)
    monkeypatch.setattr(atomic_folder, "_exchange", lambda: None)
    monkeypatch.setitem(sys.modules, "msvcrt", LikeMsvcrt)
    unlink = atomic_folder.Path.unlink

    def not_open(path, missing_ok=False):
        # Windows removes no file that is open.
        if path.exists() and any(is_open_on(n, path.stat()) for n in LikeMsvcrt.held):
            raise PermissionError(errno.EACCES, "in use", str(path))
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(atomic_folder.Path, "unlink", not_open)
    out = tmp_path / "out"
    write(out, given, "old")
    write(out, given, "new", force=True)
    assert text_of(out) == "new"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["given.csv", "out"]
    with claimed(out, True):
        # As another process.
        monkeypatch.setattr(atomic_folder, "_HELD", {})
        with pytest.raises(ConfigError, check=coded("bundle.being-written")):
            write(out, given, "third", force=True)
    assert text_of(out) == "new"


def test_files_are_flushed_as_macos_needs_it(tmp_path, given, monkeypatch):
    import fcntl

    asked = []
    monkeypatch.setattr(atomic_folder, "MACOS", True)
    monkeypatch.setattr(atomic_folder, "_exchange", lambda: None)
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", lambda number, what: asked.append(what))
    write(tmp_path / "out", given, "new")
    # Two files, the copy of the input, the manifest; their folders, and the one around them.
    assert set(asked) == {51} and len(asked) == 4 + 4 + 1


def test_a_file_system_without_locks_is_written_all_the_same(tmp_path, given, monkeypatch):
    import fcntl

    def none(lock, how):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "lockf", none)
    write(tmp_path / "out", given, "new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["given.csv", "out"]
    with pytest.raises(ConfigError, check=coded("bundle.folder-exists")):
        write(tmp_path / "out", given, "other")


def test_a_full_disk_leaves_nothing(tmp_path, given, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(shutil, "copyfile", full)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path / "deep" / "out", given, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["given.csv"]


def test_a_folder_that_is_not_there_is_not_called_empty(tmp_path):
    with pytest.raises(DataError, check=coded("bundle.no-such-folder")):
        read_manifest(tmp_path / "nowhere")
    (tmp_path / "here").mkdir()
    with pytest.raises(DataError, check=coded("bundle.no-manifest")):
        read_manifest(tmp_path / "here")


@pytest.mark.parametrize("said", [None, "report.html"])
def test_a_full_disk_names_the_result_and_no_hidden_folder(tmp_path, given, said):
    out = tmp_path / "out"

    def fill(folder):
        raise OSError(errno.ENOSPC, "full", str(folder / said) if said else None)

    with (
        pytest.raises(OSError, match="full") as caught,
        claimed(out, False),
        atomic_folder.written_whole(out, fill) as folder,
    ):
        (folder / "report.html").write_text("text")
    assert caught.value.filename == str(out)
    assert list(tmp_path.iterdir()) in ([], [given])
