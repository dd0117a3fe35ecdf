"""`strapdown compare` on results of real runs, against what their own files say."""

from __future__ import annotations

import gc
import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pymap3d
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bad_navigate import undrawn

import strapdown as sd
from strapdown.formats import read_raw
from strapdown.formats.trajectory_readers import read_trajectory

DRIVE = """
[simulation]
rate_hz = 20.0
seed = 3
sensor = "adis16495-1"
[simulation.motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
heading_deg = 30.0
manoeuvres = [
  { do = "accelerate", to_km_per_h = 50.0, duration_s = 8.0 },
  { do = "turn_left", angle_deg = 90.0, radius_m = 60.0 },
]
[simulation.gnss.gnss]
position_noise_m = 0.5
[start]
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 30.5
heading_sd_deg = 1.0
[sensors]
sensor = "SENSOR"
[aiding.gnss]
"""


def run(run_cli, *words):
    done = run_cli(*words)
    assert done.code == 0, done.err
    return done


@pytest.fixture(scope="module")
def drives(tmp_path_factory, run_cli):
    """One drive as two sensors would have it by their sheets, as files and as results."""
    folder = tmp_path_factory.mktemp("drives")
    for name, sensor in (("a", "adis16495-1"), ("b", "icm-42688-p")):
        (folder / f"{name}.toml").write_text(DRIVE.replace("SENSOR", sensor))
        out = folder / name
        run(run_cli, "navigate", folder / f"{name}.toml", "--out", out, "-q", "--no-report")
    return folder


def numbers(told):
    return {one["key"]: one for one in told["numbers"]}


def test_two_sensors_of_one_drive(drives, run_cli):
    done = run(run_cli, "compare", drives / "a", drives / "b", "--json")
    told = json.loads(done.out)
    assert told["options"] == [{"key": "sensors.sensor", "values": ["adis16495-1", "icm-42688-p"]}]
    assert [(i["role"], i["status"]) for i in told["inputs"]] == [
        ("configuration", ["first", "changed"])
    ]
    first, second = (
        json.loads((drives / name / "navigation.json").read_text()) for name in ("a", "b")
    )
    found = numbers(told)
    p, q = first["end"], second["end"]
    east, north, _ = pymap3d.geodetic2enu(
        *(q[k] for k in ("lat_deg", "lon_deg", "alt_m")),
        *(p[k] for k in ("lat_deg", "lon_deg", "alt_m")),
    )
    assert found["end.lat_deg"]["differences"][1] == pytest.approx(north, abs=1e-4)
    assert found["end.horizontal_m"]["differences"][1] == pytest.approx(
        np.hypot(north, east), abs=1e-4
    )
    speed = found["end.VN_m_per_s"]
    assert speed["values"] == [p["VN_m_per_s"], q["VN_m_per_s"]]
    sds = np.hypot(p["VN_sd_m_per_s"], q["VN_sd_m_per_s"])
    assert speed["combined_95"][1] == pytest.approx(1.959964 * sds, rel=1e-6)
    assert speed["within"][1] == (abs(speed["differences"][1]) <= speed["combined_95"][1])
    errors = found["against.horizontal.rms_m"]
    assert errors["values"] == [
        one["against"]["errors"]["horizontal"]["rms_m"] for one in (first, second)
    ]
    # A bias of another sensor is another bias.
    assert found["sensors.gyro_bias_x"]["combined_95"] == [None, None]


def test_the_differences_over_time_are_those_of_the_files(drives, run_cli):
    """By another library, at the stamps that both trajectories have."""
    told = json.loads(run(run_cli, "compare", drives / "a", drives / "b", "--json").out)
    a, b = (read_trajectory(drives / name / "trajectory.csv") for name in ("a", "b"))
    assert a.index.equals(b.index)
    east, north, up = pymap3d.geodetic2enu(
        *(b[k].to_numpy() for k in ("lat", "lon", "alt")),
        *(a[k].to_numpy() for k in ("lat", "lon", "alt")),
    )
    score = told["differences"][0]["quantities"]
    assert score["horizontal"]["largest_m"] <= np.hypot(north, east).max() + 1e-6
    at = float(score["horizontal"]["largest_at_s"])
    k = int(np.argmin(np.abs(a.index.to_numpy() - at)))
    assert score["horizontal"]["largest_m"] == pytest.approx(np.hypot(north, east)[k], abs=1e-5)
    at = int(np.argmin(np.abs(a.index.to_numpy() - float(score["height"]["largest_at_s"]))))
    assert score["height"]["largest_m"] == pytest.approx(abs(up[at]), abs=1e-4)
    # Share of instants within both bounds, by the deviations in the files.
    table = sd.compare_runs(drives / "a", drives / "b").differences[0].table
    assert table["VN"].iloc[-1] == pytest.approx(
        b["VN"][table.index[-1]] - a["VN"][table.index[-1]], abs=1e-12
    )
    last = [read_raw(drives / name / "sd.csv").columns for name in ("a", "b")]
    rows = [int(np.searchsorted(one["time_s"], table.index[-1] + 1e-9)) - 1 for one in last]
    both = np.hypot(*(one["VN_sd_m_s"][k] for one, k in zip(last, rows, strict=True)))
    assert table["VN_combined"].iloc[-1] == pytest.approx(1.959964 * both, rel=1e-5)


def test_a_page_is_written_sealed_and_repeated(drives, run_cli, tmp_path, monkeypatch):
    undrawn(monkeypatch)
    out = tmp_path / "out"
    done = run(run_cli, "compare", drives / "a", drives / "b", "--out", out)
    assert "sensors.sensor   adis16495-1   icm-42688-p" in done.out
    assert "Horizontal positions differ by" in done.out
    assert "--verbose" in done.out
    assert (out / "report.html").is_file()
    assert (out / "inputs/run/b/navigation.json").is_file()
    header = (out / "differences-2.csv").read_text().splitlines()
    assert any(line.startswith("time_s,horizontal,height,VN") for line in header)
    again = run_cli("compare", drives / "a", drives / "b", "--out", out)
    assert again.code == 4
    assert run_cli("verify", out, "-q").code == 0
    stored = json.loads((out / "compare.json").read_text())
    assert stored["schema"] == "strapdown compare 1"
    quiet = run(run_cli, "compare", drives / "a", drives / "b", "-q")
    assert (quiet.out, quiet.err) == ("", "")


def test_a_configuration_is_run_first(drives, run_cli, tmp_path, monkeypatch):
    undrawn(monkeypatch)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    done = run(run_cli, "compare", drives / "a", drives / "b.toml", drives / "b", "--json")
    told = json.loads(done.out)
    made = list(tmp_path.glob("strapdown-*"))
    assert [(r["name"], r["ran_for_comparison"]) for r in told["runs"]] == [
        ("a", False),
        ("b.toml", True),
        ("b", False),
    ]
    # The same file gives the same numbers.
    assert all(one["values"][1] == one["values"][2] for one in told["numbers"])
    assert [d["run"] for d in told["differences"]] == ["b.toml", "b"]
    gc.collect()
    assert not [p for p in made if p.exists()]


def test_runs_in_memory_are_compared(drives):
    first = sd.navigate(str(drives / "a.toml"))
    result = sd.compare_runs(first, drives / "a")
    assert [run.name for run in result.runs] == ["run 1", "a"]
    assert not result.options
    assert all(row.same for row in result.numbers)
    assert result.differences[0].score("horizontal").largest == 0.0


def test_a_changed_run_has_an_exit_code_of_its_own(drives, run_cli, tmp_path):
    changed = shutil.copytree(drives / "b", tmp_path / "b")
    path = changed / "navigation.json"
    path.write_text(re.sub(r'"verdict": "\w+"', '"verdict": "mine"', path.read_text()))
    done = run_cli("compare", drives / "a", changed)
    assert done.code == 6
    assert "b: the run was changed after it was sealed: navigation.json" in done.err
    for flag in ("--json", "--quiet"):
        assert run_cli("compare", drives / "a", changed, flag).code == 6


def test_refusals_have_the_usual_exit_codes(drives, run_cli, tmp_path):
    attitude = tmp_path / "attitude"
    run(
        run_cli,
        "attitude",
        "alexiev-fig4",
        "--algorithms",
        "rk4",
        "--out",
        attitude,
        "-q",
        "--no-report",
    )
    for code, *runs in (
        (4, drives / "a"),
        (4, drives / "a", drives / "a"),
        (3, drives / "a", tmp_path / "missing"),
        (3, drives / "a", tmp_path),
        (4, drives / "a", attitude),
        (4, drives / "a", Path(__file__)),
        (2,),
    ):
        done = run_cli("compare", *runs)
        assert done.code == code, done.err
        assert "Traceback" not in done.err
    told = run_cli("compare", drives / "a", attitude).err
    assert "navigate and attitude" in told


def test_attitude_at_two_rates(run_cli, tmp_path):
    for rate in (100, 50):
        flags = ("--rate", rate, "--out", tmp_path / f"at{rate}", "-q", "--no-report")
        run(run_cli, "attitude", "alexiev-fig4", *flags, "--algorithms", "quaternion,rk4")
    done = run(run_cli, "compare", tmp_path / "at100", tmp_path / "at50", "--json")
    told = json.loads(done.out)
    first, second = (
        json.loads((tmp_path / f"at{rate}" / "attitude.json").read_text()) for rate in (100, 50)
    )
    found = numbers(told)
    worst = [one["algorithms"][1]["scores"][0]["max_deg"] for one in (first, second)]
    assert found["algorithms.rk4.truth.max_deg"]["values"] == worst
    assert found["algorithms.rk4.truth.max_deg"]["differences"][1] == worst[1] - worst[0]
    at_50 = [
        next(
            r["error_deg"]
            for r in one["sweep"]
            if r["algorithm"] == "rk4" and r["meaning"] == "sum" and round(r["rate_hz"]) == 50
        )
        for one in (first, second)
    ]
    assert found["sweep.averaged.rk4.50"]["values"] == at_50
    # Both are within their errors of the truth, which they begin with.
    score = next(d for d in told["differences"] if d["of"] == "rk4")["quantities"]["angle"]
    assert 0.0 < score["largest_deg"] <= sum(worst) + 1e-6


def test_alignments(run_cli, tmp_path):
    text = Path("docs/examples/align_stand.toml").read_text()
    text = text.replace("duration_s = 600.0", "duration_s = 40.0").replace("100.0", "20.0")
    for name, sensor in (("a", "fog-1000"), ("b", "hg1700")):
        file = tmp_path / f"{name}.toml"
        file.write_text(text.replace("fog-1000", sensor))
    run(run_cli, "align", tmp_path / "a.toml", "--out", tmp_path / "a", "-q", "--no-report")
    told = json.loads(run(run_cli, "compare", tmp_path / "a", tmp_path / "b.toml", "--json").out)
    assert told["runs"][1]["command"] == "align"
    own = json.loads((tmp_path / "a" / "align.json").read_text())["end"]
    heading = numbers(told)["end.heading_deg"]
    assert heading["values"][0] == own["heading_deg"]
    assert heading["below_95"][0] == pytest.approx(1.959964 * own["heading_sd_deg"], rel=1e-6)
    assert heading["kind"] == "angle"


def test_outages(run_cli, tmp_path):
    for name in ("adis16470", "mpu-6050"):
        run(run_cli, "outage", name, "--outage", 10, "--out", tmp_path / name, "-q", "--no-report")
    result = sd.compare_runs(tmp_path / "adis16470", tmp_path / "mpu-6050")
    ends = [
        json.loads((tmp_path / n / "outage.json").read_text())["at_the_end"]["horizontal_95_m"]
        for n in ("adis16470", "mpu-6050")
    ]
    row = next(r for r in result.numbers if r.key == "at_the_end.horizontal_95_m")
    assert row.differences[1] == ends[1] - ends[0]
    cones = result.plot("cone").chart.panels[0].lines
    assert [float(line.y[-1]) for line in cones] == pytest.approx(ends)


def test_crashes_of_two_cases(light_case, run_cli, tmp_path):
    other = light_case.with_name("faster.toml")
    text = light_case.read_text(encoding="utf-8")
    other.write_text(text.replace("speed_m_per_s = 7.08", "speed_m_per_s = 7.58"), encoding="utf-8")
    try:
        told = json.loads(run(run_cli, "compare", light_case, other, "--json").out)
    finally:
        other.unlink()
    (option,) = told["options"]
    assert option == {"key": "entry.speed_m_per_s", "values": [7.08, 7.58]}
    found = numbers(told)
    # The speed at the begin moves the velocity at the end, and no change of velocity.
    assert found["main.event.1.delta_v_m_per_s"]["differences"][1] == pytest.approx(0.0, abs=0.02)
    end = next(k for k in found if k.startswith("path.end.") and k.endswith("VN_m_per_s"))
    assert found[end]["differences"][1] == pytest.approx(0.5, abs=0.03)
    score = told["differences"][0]["quantities"]
    assert score["VN"]["rms_m_per_s"] == pytest.approx(0.5, abs=0.03)
    # 0.5 m/s is ten standard deviations of the stated 0.05 m/s.
    assert score["VN"]["share_within_combined_bound"] < 0.5
    assert [i["status"][1] for i in told["inputs"] if i["role"] == "record"].count("same") >= 3
