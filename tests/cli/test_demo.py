"""``strapdown demo``: all three systems on one page, whole or not at all."""

from __future__ import annotations

import json
import re
import tomllib
import zlib
from dataclasses import replace
from hashlib import sha256
from html import unescape
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from scipy.spatial.transform import Rotation

import strapdown as sd
from strapdown.cli import demo as command
from strapdown.report.demo_page import demo_page, shown_answer, shown_truth

BUILT_IN = ["phone", "tunnel", "cone", "hand", "pole"]
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


@pytest.mark.slow
def test_three_systems_on_one_page_each_with_its_bound_and_the_truth(shown):
    folder, found = shown
    page = unescape((folder / "index.html").read_text(encoding="utf-8"))
    assert re.findall(r'<h2 id="\d-(\w+)">', page) == BUILT_IN
    assert page.count("Against the truth") == len(BUILT_IN)
    error = re.search(r"stays within ([\d.]+)°: its largest error is ([\d.]+)°", page)
    assert error is not None and 0.0 < float(error[2]) < float(error[1])
    crash = re.search(r"Delta-V ([\d.]+) ± ([\d.]+) km/h", page)
    truth = re.search(r"Simulated: delta-V ([\d.]+) km/h, direction of force ([−\d.]+)°", page)
    force = re.search(r"direction of force [−\d.]+° \(([−\d.]+)° to ([−\d.]+)° with 95 %", page)
    assert crash is not None and truth is not None and force is not None
    # Of 7.1 m/s the pole gives back a tenth and takes all the rest. It pushes from the front as the
    # car first stood; in the axes of the car, which turns right under it, from further left, and
    # what was forward and aside then adds up to a little more.
    assert float(truth[1]) == pytest.approx(25.95, abs=0.005)
    assert abs(float(crash[1]) - float(truth[1])) < float(crash[2])
    come, low, high = (float(text.replace("−", "-")) for text in (truth[2], *force.groups()))
    assert come == pytest.approx(-1.0, abs=0.05)
    assert low < come < high
    assert re.search(r"Position bound, 95\s%: [\d.]+ m", page)
    assert re.search(
        r"After 30 s along its own trajectory, 95 % of drifts are within [\d.]+ m", page
    )
    for line in ("Delta-V", "Position bound", "After 30 s"):
        assert line in found.out
    assert found.out.endswith(f"Open  {Path('demo') / 'index.html'}\n")


@pytest.mark.slow
def test_the_page_needs_nothing_else_and_its_links_lead_somewhere(shown):
    folder, _ = shown
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "://" not in page.replace("http://www.w3.org", "")
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    links = [s for s in sources if not s.startswith(("data:image/svg+xml;base64,", "#"))]
    assert len(links) == 6  # five reports and a PDF
    for link in links:
        assert (folder / link).is_file(), link


@pytest.mark.slow
def test_it_says_in_one_line_what_is_missing(shown):
    folder, found = shown
    (line,) = [line for line in found.err.splitlines() if line.startswith("note: Further")]
    assert all(name in line for name in REAL.values())
    assert "STRAPDOWN_DATA" in line
    assert line.removeprefix("note: ") in unescape((folder / "index.html").read_text("utf-8"))


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_page_of_the_same_results_is_the_same(shown):
    folder, _ = shown
    runs = [r.shown for r in command.demo_runs(Path("demo"), Path("nowhere")) if not r.needs]
    assert demo_page(runs, folder) == demo_page(runs, folder)


@pytest.mark.slow
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
    whole = command.demo_runs

    def few(out, data):
        return [replace(whole(out, data)[0], make=make)]

    monkeypatch.setattr(command, "demo_runs", few)


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
    assert not (tmp_path / "demo").exists()


@pytest.mark.parametrize("name", ["phone", "tunnel", "car", "walk"])
def test_what_is_packaged_can_be_read(name):
    text = files("strapdown").joinpath("demo_data", f"{name}.toml").read_text("utf-8")
    assert ("{data}" in text) == (name in {"car", "walk"})
    assert tomllib.loads(text)["title"]


@pytest.mark.slow
def test_the_real_drive_comes_first_and_is_scored_by_its_reference(shown):
    folder, found = shown
    assert found.out.startswith("A  A real drive")
    errors = json.loads((folder / "phone" / "navigation.json").read_text("utf-8"))["against"]
    assert errors["instants"] > 500
    horizontal, down = errors["errors"]["horizontal"], errors["errors"]["down"]
    # 5 m are assumed of a fix; the reference is better than 1 m.
    assert horizontal["rms_m"] < 5.0
    # A bound of 95 % holds for the horizontal position. It does not for the height: errors of fixes
    # are correlated over the minute, which the filter does not model. The page says both.
    assert horizontal["share_within_bound"] > 0.95
    page = unescape((folder / "index.html").read_text(encoding="utf-8"))
    for error in (horizontal, down):
        assert (
            f"{100.0 * error['share_within_bound']:.1f} % of the time".replace(".0 ", " ") in page
        )


PACKAGED = files("strapdown").joinpath("demo_data", "comma2k19")


def test_the_packaged_recording_is_small_and_has_license_and_provenance():
    readme = PACKAGED.joinpath("README.md").read_text("utf-8")
    stated = dict(re.findall(r"\| `(\w+\.csv)` \| .* \| `([0-9a-f]{64})` \|", readme))
    content = {name: PACKAGED.joinpath(name).read_bytes() for name in stated}
    assert set(stated) == {"imu.csv", "gnss.csv", "reference.csv"}
    assert {name: sha256(data).hexdigest() for name, data in content.items()} == stated
    # A wheel holds them compressed.
    assert sum(len(zlib.compress(data)) for data in content.values()) < 300_000
    assert "commaai/comma2k19" in readme
    license_text = PACKAGED.joinpath("LICENSE").read_text("utf-8")
    assert license_text.startswith("MIT License")
    assert "comma.ai" in license_text


def test_the_packaged_recording_is_that_of_its_source(recordings):
    source = recordings("phone_comma2k19")

    def table(name):
        return pd.read_csv(PACKAGED.joinpath(name), comment="#").to_numpy()

    def column(name):
        return np.load(source / f"{name}.npy", allow_pickle=False)

    begin = column("IMU__gyro__t")[0]
    imu = np.column_stack([column("IMU__gyro__t") - begin, column("IMU__gyro__value")])
    np.testing.assert_allclose(table("imu.csv")[:, :4], imu, rtol=0, atol=0.51e-5)
    accel = column("IMU__accelerometer__value")
    np.testing.assert_allclose(table("imu.csv")[:, 4:], accel, rtol=0, atol=0.51e-4)
    fixes = sd.read_gnss(source, position_sd_m=5.0)
    ours = sd.read_gnss(PACKAGED / "gnss.csv", position_sd_m=5.0)
    # Stamps are in UTC milliseconds; half a digit of 1e-7 deg is 6 mm.
    np.testing.assert_allclose(ours.index, fixes.index - begin, rtol=0, atol=0.51e-3)
    for name, digit in {"lat": 1e-7, "lon": 1e-7, "alt": 1e-3, "VN": 1e-4, "VE": 1e-4}.items():
        np.testing.assert_allclose(ours[name], fixes[name], rtol=0, atol=0.51 * digit)
    reference = table("reference.csv")
    np.testing.assert_allclose(
        np.column_stack(pymap3d.geodetic2ecef(*reference[:, 1:4].T)),
        column("global_pose__frame_positions")[1::2],
        rtol=0,
        atol=2e-3,
    )
    # The velocity in axes of the body is the same by the attitude of the source, ECEF to body, and
    # by ours; 0.5e-3 deg of 17 m/s and the digits of the velocity are 3e-4 m/s.
    q = column("global_pose__frame_orientations")[1::2, [1, 2, 3, 0]]
    v_body = Rotation.from_quat(q).inv().apply(column("global_pose__frame_velocities")[1::2])
    attitude = Rotation.from_euler("ZYX", reference[:, [9, 8, 7]], degrees=True)
    np.testing.assert_allclose(attitude.inv().apply(reference[:, 4:7]), v_body, rtol=0, atol=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("slug", REAL)
def test_a_recording_is_shown_with_what_is_known_of_it(slug, recordings, tmp_path):
    data = recordings(REAL[slug]).parent
    (run,) = [r for r in command.demo_runs(tmp_path, data) if r.shown.slug == slug]
    run.make(tmp_path, False, lambda stage, share: None)
    assert shown_answer(tmp_path / slug)
    truth = shown_truth(tmp_path / slug) or ""
    if slug == "turn":
        assert truth.startswith("Final attitude known")
    elif slug == "car":
        assert "consistent with the 95 % bounds in 3 of 3" in truth
    else:
        share = re.search(r": ([\d.]+) %\.$", truth)
        # A walk on foot is known to two percent of the way at the least.
        assert share is not None and float(share[1]) < 2.0
    assert f'id="1-{slug}"' in demo_page([run.shown], tmp_path)
