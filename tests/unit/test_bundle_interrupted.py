"""A bundle that is interrupted or killed between any two lines of its writing: whole or absent."""

from __future__ import annotations

import os
import shutil
import sys

import pytest
from tests.coded import coded

from strapdown import bundle
from strapdown.bundle import InputFiles, read_manifest, sha256, unsealed_changes, write_bundle
from strapdown.errors import DataError

NAMES = {"write_bundle", "make_manifest", "_keep", "_place", "_move", "files_of", "with_paths"}
FILES = {bundle.__file__}


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
        return inner if code.co_filename in FILES and code.co_name in NAMES else None

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
        return tell if code.co_filename in FILES and code.co_name in NAMES else None

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


def whole(folder):
    return unsealed_changes(folder, read_manifest(folder)) == []


def text_of(folder):
    return (folder / "report.html").read_text()


@pytest.mark.parametrize("force", [False, True])
def test_an_interruption_leaves_a_whole_bundle_or_nothing(tmp_path, given, force):
    total = lines(lambda: write(tmp_path / "x" / "y", given, "new"))
    assert total > 60
    shutil.rmtree(tmp_path / "x")
    outcomes = set()
    number, went_through = 0, False
    while not went_through:
        number += 1
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
        left = sorted(p.name for p in room.rglob("*") if p.parent in (room, room / "deep"))
        assert left in ([], ["deep", "out"]), (number, left)
        if left:
            assert whole(out), number
        outcomes.add(text_of(out) if left else None)
        shutil.rmtree(room)
    assert number > total
    assert outcomes == ({"old", "new"} if force else {None, "new"})


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("force", [False, True])
def test_a_kill_leaves_a_whole_bundle_or_none_under_its_name(tmp_path, given, force):
    outcomes, number, ended = set(), 0, False
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
        assert all(n.startswith(".out.") and n.endswith((".partial", ".old")) for n in left)
        write(out, given, "again", force=True)
        assert text_of(out) == "again"
        shutil.rmtree(room)
    assert {None, "new"} <= outcomes if not force else {"old", "new"} <= outcomes


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
