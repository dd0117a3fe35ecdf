"""`strapdown crash` that is stopped, killed, or runs out of disk: a whole report or none."""

from __future__ import annotations

import errno
import shutil
import signal
import subprocess
import sys
import time

import pytest

from strapdown.bundle import read_manifest, unsealed_changes
from strapdown.report import crash_case, document_html, document_pdf


def start(case, folder, *options):
    # A group of its own: a terminal sends Ctrl-C to all of a group, and this is one.
    return subprocess.Popen(
        [sys.executable, "-m", "strapdown", "crash", case, "--out", "out", *options],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_until(job, seen):
    deadline = time.monotonic() + 120
    while not seen() and job.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)


INSTANTS = {
    "while it reads": lambda room: True,
    "as the hidden folder appears": lambda room: any(room.glob(".*.partial")),
    "while it draws": lambda room: any(room.glob(".*.partial/figures/*")),
    "while it sets the page": lambda room: any(room.glob(".*.partial/report.html")),
    "as it seals": lambda room: any(room.glob(".*.partial/inputs")),
    "as the new one stands": lambda room: (room / "out" / "manifest.json").exists(),
}


@pytest.mark.slow
@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("instant", INSTANTS)
def test_whenever_it_is_stopped(sealed_crash, tmp_path, instant, sent, force):
    if force:
        shutil.copytree(sealed_crash.folder, tmp_path / "out")
    if force and instant == "as the new one stands":
        pytest.skip("the old one stands there all the time")
    job = start(sealed_crash.records / "case.toml", tmp_path, *(["--force"] if force else []))
    if instant == "while it reads":
        time.sleep(1.0)
    wait_until(job, lambda: INSTANTS[instant](tmp_path))
    job.send_signal(sent)
    _, err = job.communicate(timeout=120)
    assert "Traceback" not in err
    out = tmp_path / "out"
    assert out.exists() or not force or sent == signal.SIGKILL
    if out.exists():
        assert unsealed_changes(out, read_manifest(out)) == []
    left = [p.name for p in tmp_path.iterdir() if p != out]
    if sent == signal.SIGKILL:
        assert all(n.startswith(".out.") for n in left)
    else:
        assert left == []
        assert job.returncode in (0, 128 + 15, 130)


@pytest.mark.parametrize(
    ("module", "fails"), [(crash_case, "crash_json"), (document_pdf, "write_pdf")]
)
def test_a_disk_that_is_full_is_said_and_nothing_is_left(
    sealed_crash, light_case, run_cli, tmp_path, monkeypatch, module, fails
):
    def full(*given, **options):
        raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "out"))

    monkeypatch.setattr(document_html, "draw_stills", lambda document: ["<svg/>"] * 99)
    monkeypatch.setattr(document_html, "document_page", lambda document, stills=(): "")
    monkeypatch.setattr(module, fails, full)
    done = run_cli("crash", light_case, "--out", tmp_path / "deep" / "out")
    assert done.code == 4
    assert done.out == ""
    assert done.err.splitlines() == [
        f"error: {tmp_path / 'out'}: No space left on device",
        "  Remedy: check the path and the free space, or name another folder with --out",
    ]
    assert list(tmp_path.iterdir()) == []
    old = tmp_path / "old"
    shutil.copytree(sealed_crash.folder, old)
    assert run_cli("crash", light_case, "--out", old, "--force").code == 4
    assert unsealed_changes(old, read_manifest(old)) == []
    assert [p.name for p in tmp_path.iterdir()] == ["old"]


@pytest.mark.slow
def test_stopped_as_the_hidden_folder_appears(sealed_crash, tmp_path):
    job = start(sealed_crash.records / "case.toml", tmp_path)
    wait_until(job, lambda: any(tmp_path.glob(".*.partial")))
    job.terminate()
    out, err = job.communicate(timeout=120)
    assert list(tmp_path.iterdir()) == []
    assert job.returncode == 128 + signal.SIGTERM
    assert out == ""
    assert "Traceback" not in err
