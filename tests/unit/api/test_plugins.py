"""Plug-ins of other distributions by their entry points: `examples/plugin`, and broken ones."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_raw
from strapdown.sensors.catalogue import load_sensor
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.tables import QUATERNION

PLUGIN = Path(__file__).parents[3] / "examples" / "plugin"


def install(folder: Path, name: str, groups: dict[str, dict[str, str]]) -> None:
    """The metadata of a distribution, as an installer leaves it beside its code."""
    info = folder / f"{name.replace('-', '_')}-0.1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
    lines = []
    for group, points in groups.items():
        lines += [f"[{group}]", *(f"{n} = {value}" for n, value in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


@pytest.fixture
def installed(tmp_path, monkeypatch):
    project = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]
    install(tmp_path / "site", project["name"], project["entry-points"])
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.syspath_prepend(PLUGIN / "src")
    yield
    for name in [n for n in sys.modules if n.startswith("strapdown_example")]:
        del sys.modules[name]


@pytest.fixture
def broken(tmp_path, monkeypatch):
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "half_written.py").write_text("raise OSError('no such bus')\n")
    groups = {
        "strapdown.attitude": {"gone": "nowhere:Gone", "wrong": "pathlib:Path"},
        "strapdown.measurements": {"torn": "half_written:Torn"},
        "strapdown.readers": {"bus": "half_written:reader"},
    }
    install(tmp_path / "site", "broken-one", groups)
    monkeypatch.syspath_prepend(tmp_path / "site")


def turning():
    t = np.arange(200) / 100.0
    return t, np.column_stack([np.sin(t), 0.3 * np.cos(t), 0.0 * t])


def test_an_algorithm_from_outside_runs_in_batch_and_sample_by_sample(installed):
    t, gyro = turning()
    made = sd.attitude(t, gyro, algorithm="first_order", initial="zero")
    best = sd.attitude(t, gyro, algorithm="rotvec:samples=2", initial="zero")
    apart = (made.rotation * best.rotation.inv()).magnitude()
    # A step of Euler's method with the norm kept turns by 2 atan(theta / 2), theta**3 / 12 too
    # little, and leaves out the coning of |w x dw| dt**3 / 12; rates are below 1.05 rad/s.
    assert 0.0 < apart.max() < 200 * (1.05**3 + 1.05) * 0.01**3 / 12.0
    one = sd.OrientationFilter(100.0, "first_order", initial=(0.0, 0.0, 0.0))
    streamed = [one.update(rate) for rate in gyro]
    assert np.array_equal(streamed, made[QUATERNION].to_numpy())


def test_an_algorithm_from_outside_is_compared_counted_and_verified(installed, tmp_path):
    algorithms = ["first_order", "quaternion"]
    made = sd.compare_attitude("alexiev-fig4", algorithms, rates_hz=[100.0])
    cost = made.costs[0]
    # Four sums of three products, their halves, four squares of the norm; and four divisions.
    assert (cost.algorithm, cost.divide, cost.sqrt, cost.trig) == ("first_order", 4, 1, 0)
    assert cost.multiply == 4 * 3 + 4 + 4
    assert made.shares[0].own_deg[2] != made.shares[1].own_deg[2]
    assert 0.0 < made.shares[0].single_deg[2] < 1e-2
    made.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"


def test_an_algorithm_from_outside_is_a_word_of_the_command_line(installed, run_cli, tmp_path):
    done = run_cli(
        *("attitude", "alexiev-fig4", "--algorithms", "first_order", "--rates", "100"),
        *("--json", "--out", str(tmp_path / "out"), "--export", str(tmp_path / "first.c")),
    )
    assert done.code == 0, done.err
    assert "first_order_step(" in (tmp_path / "first.c").read_text()
    (row,) = json.loads(done.out)["algorithms"]
    assert row["algorithm"] == "first_order"


def test_a_measurement_from_outside_aids_a_run_that_is_verified(installed, tmp_path):
    motion = StationaryMotion(30.0, Origin(55.0, 37.0, 150.0))
    imu, _ = simulate_imu(
        motion, load_sensor("adis16495-1").draw(1), rate=50.0, sampling="mean", seed=1
    )
    heights = pd.DataFrame(
        {"surveyed": 149.5, "surveyed_sd": 0.1}, index=pd.Index(np.arange(2.0, 30.0), name="time")
    )
    run = sd.navigate(
        imu,
        [sd.Measurement("surveyed_height", heights, name="mark", offset_m=0.5)],
        sensor="adis16495-1",
        start={"lat_deg": 55.0, "lon_deg": 37.0, "alt_m": 153.0, "heading_deg": 0.0},
    )
    # It begins 3 m too high, with 10 m of standard deviation.
    assert "mark.height" in run.innovations
    assert abs(run.trajectory["alt"].iloc[-1] - 150.0) < 0.1
    run.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"


def test_a_log_is_read_by_a_reader_from_outside(installed, tmp_path):
    counts = np.tile(np.array([100, -50, 0, 0, 0, -2000], dtype="<i2"), (40, 1))
    path = tmp_path / "bench.bin"
    path.write_bytes(b"TWOBYTE 200 0.001 0.0049\n" + counts.tobytes())
    imu = sd.read_imu(path)
    assert imu.attrs["sampling"] == "mean"
    assert imu.iloc[3].tolist() == pytest.approx([0.1, -0.05, 0.0, 0.0, 0.0, -9.8])
    assert np.diff(imu.index) == pytest.approx(np.full(39, 0.005))
    assert list(sd.read(path)) == ["imu"]
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(DataError, check=coded("io.not-of-format")):
        sd.read_imu(path)


def test_modules_lists_them(installed, run_cli):
    done = run_cli("modules", "--json")
    assert done.code == 0, done.err
    lists = json.loads(done.out)
    assert "first_order" in [row["name"] for row in lists["attitude_algorithms"]]
    assert "surveyed_height" in [row["name"] for row in lists["aiding"]]
    assert "two_byte" in [row["name"] for row in lists["formats"]]


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: sd.attitude(*turning(), algorithm="gone"), "No module named 'nowhere'"),
        (lambda: sd.attitude(*turning(), algorithm="wrong"), "instance of AttitudeAlgorithm"),
        (lambda: read_raw(Path(__file__), "bus"), "no such bus"),
    ],
)
def test_a_broken_one_is_named_with_its_distribution(broken, ask, words):
    with pytest.raises(ConfigError) as caught:
        ask()
    assert words in str(caught.value)
    assert "broken-one" in str(caught.value)


def test_a_broken_one_disturbs_nobody_else(broken, run_cli):
    t, gyro = turning()
    assert len(sd.attitude(t, gyro)) == len(t)
    done = run_cli("modules")
    assert done.code == 0, done.err
    assert "no such bus" in done.err and "broken-one" in done.err
    with pytest.raises(ConfigError, match="quaternion"):
        sd.attitude(t, gyro, algorithm="quaternoin")
