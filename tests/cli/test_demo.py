"""``strapdown demo``: all three systems on one page, whole or not at all."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from html import unescape
from importlib.resources import files
from pathlib import Path

import pytest

from strapdown.cli import demo_runs
from strapdown.report.demo_page import demo_page, shown_answer, shown_truth

BUILT_IN = ["hand", "pole", "tunnel", "cone"]
REAL = {"turn": "mpu6050_turns", "car": "car_rtk", "walk": "foot"}


@pytest.fixture(scope="module")
def shown(tmp_path_factory, run_cli):
    """The demonstration of somebody who has nothing but the package."""
    root = tmp_path_factory.mktemp("demo")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(root)
        patch.setenv("STRAPDOWN_DATA", str(root / "nowhere"))
        found = run_cli("demo")
    assert found.code == 0, found.err
    return root / "demo", found


def test_three_systems_on_one_page_each_with_its_bound_and_the_truth(shown):
    folder, found = shown
    page = unescape((folder / "index.html").read_text(encoding="utf-8"))
    assert re.findall(r'<h2 id="\d-(\w+)">', page) == BUILT_IN
    assert page.count("The truth beside it") == len(BUILT_IN)
    assert "its largest error is 0.729°" in page
    crash = re.search(r"Delta-V ([\d.]+) ± ([\d.]+) km/h", page)
    truth = re.search(r"velocity is ([\d.]+) km/h, the force comes from ([−\d.]+)°", page)
    force = re.search(r"direction of force [−\d.]+° \(([−\d.]+)° to ([−\d.]+)° with 95 %", page)
    assert crash is not None and truth is not None and force is not None
    # Of 7.1 m/s the pole gives back a tenth and takes all the rest. It pushes from the front as the
    # car first stood; in the axes of the car, which turns right under it, from further left, and
    # what was forward and aside then adds up to a little more.
    assert float(truth[1]) == pytest.approx(25.99, abs=0.005)
    assert abs(float(crash[1]) - float(truth[1])) < float(crash[2])
    come, low, high = (float(text.replace("−", "-")) for text in (truth[2], *force.groups()))
    assert come == pytest.approx(-1.0, abs=0.05)
    assert low < come < high
    assert re.search(r"You can trust the place to [\d.]+ m at the end", page)
    assert re.search(r"After 30 s along its own trajectory, 95 % are within [\d.]+ m", page)
    for line in ("Delta-V", "You can trust the place", "After 30 s"):
        assert line in found.out
    assert found.out.endswith(f"Open  {Path('demo') / 'index.html'}\n")


def test_the_page_needs_nothing_else_and_its_links_lead_somewhere(shown):
    folder, _ = shown
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "://" not in page.replace("http://www.w3.org", "")
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    links = [s for s in sources if not s.startswith(("data:image/svg+xml;base64,", "#"))]
    assert len(links) == 6  # four reports, a PDF and a verdict
    for link in links:
        assert (folder / link).is_file(), link


def test_it_says_in_one_line_what_is_missing(shown):
    folder, found = shown
    (line,) = [line for line in found.err.splitlines() if line.startswith("note: All of this")]
    assert all(name in line for name in REAL.values())
    assert "STRAPDOWN_DATA" in line
    assert line.removeprefix("note: ") in unescape((folder / "index.html").read_text("utf-8"))


def test_what_is_shown_is_what_the_commands_shown_make(shown, run_cli, monkeypatch):
    folder, _ = shown
    monkeypatch.chdir(folder.parent)
    done = run_cli("verify", Path("demo") / "hand", "--json")
    assert json.loads(done.out)["verdict"] == "identical"
    made = run_cli("attitude", "alexiev-fig6", "--rate", "200", "--out", "again", "-q")
    assert made.code == 0
    ours, theirs = (
        (Path(name) / "attitude.json").read_text(encoding="utf-8")
        for name in ("demo/hand", "again")
    )
    assert ours == theirs


def test_the_page_of_the_same_results_is_the_same(shown):
    folder, _ = shown
    runs = [r.shown for r in demo_runs.demo_runs(Path("demo"), Path("nowhere")) if not r.needs]
    assert demo_page(runs, folder) == demo_page(runs, folder)


def test_results_that_are_there_are_kept_without_force(shown, run_cli, monkeypatch):
    folder, _ = shown
    monkeypatch.chdir(folder.parent)
    before = (folder / "index.html").read_bytes()
    refused = run_cli("demo")
    assert refused.code == 4
    assert "--force" in refused.err
    assert (folder / "index.html").read_bytes() == before


def _only(monkeypatch, make):
    """One run, of which nothing is made but what `make` does."""
    whole = demo_runs.demo_runs

    def few(out, data):
        return [replace(whole(out, data)[0], make=make)]

    monkeypatch.setattr(demo_runs, "demo_runs", few)


def test_an_interrupt_leaves_no_page(tmp_path, run_cli, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "index.html").write_text("of results that are replaced")

    def interrupted(folder, force, progress):
        raise KeyboardInterrupt

    _only(monkeypatch, interrupted)
    assert run_cli("demo", "--force").code == 130
    assert list((tmp_path / "demo").iterdir()) == []


def test_a_page_that_cannot_be_written_leaves_no_piece(tmp_path, run_cli, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "full")))

    def nothing(folder, force, progress):
        folder.mkdir(parents=True, exist_ok=True)

    _only(monkeypatch, nothing)
    for module in ("strapdown.report.demo_page",):
        monkeypatch.setattr(f"{module}.shown_answer", lambda _: "x")
        monkeypatch.setattr(f"{module}.shown_truth", lambda *_: None)
        monkeypatch.setattr(f"{module}.demo_page", lambda *_: "<html>")
    assert run_cli("demo").code == 4
    assert list((tmp_path / "demo").iterdir()) == []


@pytest.mark.parametrize("name", ["tunnel", "car", "walk"])
def test_what_is_packaged_can_be_read(name):
    text = files("strapdown.cli").joinpath("demo_files", f"{name}.toml").read_text("utf-8")
    assert ("{data}" in text) == (name != "tunnel")
    assert tomllib.loads(text)["title"]


@pytest.mark.slow
@pytest.mark.parametrize("slug", REAL)
def test_a_recording_is_shown_with_what_is_known_of_it(slug, recordings, tmp_path):
    data = recordings(REAL[slug]).parent
    (run,) = [r for r in demo_runs.demo_runs(tmp_path, data) if r.shown.slug == slug]
    run.make(tmp_path, False, lambda stage, share: None)
    assert shown_answer(tmp_path / slug)
    truth = shown_truth(tmp_path / slug) or ""
    if slug == "turn":
        assert truth.startswith("The attitude at the end is known")
    elif slug == "car":
        assert "within the bound of 95 % at 3 of 3" in truth
    else:
        share = re.search(r": ([\d.]+) %\.$", truth)
        # A walk on foot is known to two percent of the way at the least.
        assert share is not None and float(share[1]) < 2.0
    assert f'id="1-{slug}"' in demo_page([run.shown], tmp_path)
