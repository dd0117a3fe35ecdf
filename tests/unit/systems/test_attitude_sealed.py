"""What the bench ran on is sealed whole: a bundle runs again, elsewhere and without its inputs."""

from __future__ import annotations

import json
import shutil

import pytest

from strapdown import simulate, verify
from strapdown.api.attitude import compare_attitude
from strapdown.peers import available_peers
from strapdown.report.attitude import write_attitude

ASKED = {"algorithms": ["naive", "quaternion"], "rates_hz": [50, 25]}
SENSOR = (
    'title = "x"\nclass = "phone"\nsummary = "x"\n[gyro]\n'
    'bias_bound_deg_per_s = { value = 1, assumed = "for this test" }\n'
)


def moved(seal, inputs, to):
    """The bundle in another place, and its inputs gone."""
    place = shutil.move(seal.path, to)
    for path in inputs:
        if path.exists():
            path.rename(path.with_name(path.name + ".hidden"))
    return place


@pytest.fixture
def logs(tmp_path):
    """Two logs of one name, and another sensor's log of the first motion."""
    for name, rate, seed in (("a", 50, 1), ("b", 50, 2), ("c", 100, 3)):
        simulate("alexiev-fig2e", rate_hz=rate, seed=seed).save(tmp_path / name, formats=["csv"])
    return [tmp_path / name / "log.csv" for name in "abc"]


def test_trials_of_a_scenario_with_a_sensor(tmp_path):
    bench = compare_attitude(
        "alexiev-fig2c", sensor="stim300", trials=2, seed=3, tolerance_deg=0.2, **ASKED
    )
    seal = write_attitude(bench, tmp_path / "bundle")
    assert verify(seal.path).verdict == "identical"
    told = json.loads((seal.path / "manifest.json").read_text(encoding="utf-8"))["configuration"]
    assert [told["source"]["seed"], told["also"][0]["seed"]] == [3, 4]
    assert told["rates_hz"] == [50.0, 25.0]
    assert told["tolerance_deg"] == 0.2


def test_a_sensor_of_ones_own(tmp_path):
    own = tmp_path / "own.toml"
    own.write_text(SENSOR)
    bench = compare_attitude("alexiev-fig2c", sensor=own, **ASKED)
    seal = write_attitude(bench, tmp_path / "bundle", report=False)
    simulated = simulate("alexiev-fig2c", rate_hz=50, sensor=str(tmp_path / "own.toml")).save(
        tmp_path / "s"
    )
    for one in (seal, simulated):
        place = moved(one, [own], tmp_path / f"elsewhere-{one.path.name}")
        assert verify(place).verdict == "identical"


def test_several_logs_of_one_name_and_a_bias_of_another(logs, tmp_path):
    bench = compare_attitude(logs[:2], gyro_bias=logs[2], **ASKED)
    seal = write_attitude(bench, tmp_path / "bundle", report=False)
    told = json.loads((seal.path / "manifest.json").read_text(encoding="utf-8"))
    assert [i["name"] for i in told["inputs"]] == [
        "inputs/log/log.csv",
        "inputs/gyro-bias/log.csv",
        "inputs/log-2/log.csv",
    ]
    for item, log in zip(told["inputs"], (logs[0], logs[2], logs[1]), strict=True):
        assert (seal.path / item["name"]).read_bytes() == log.read_bytes()
    place = moved(seal, logs, tmp_path / "elsewhere")
    assert verify(place).verdict == "identical"


def test_a_second_log_rests_and_an_interpolation(logs, tmp_path):
    simulate("gestures", rate_hz=50).save(tmp_path / "first", formats=["csv"])
    simulate("gestures", rate_hz=100).save(tmp_path / "second", formats=["csv"])
    first, second = tmp_path / "first" / "log.csv", tmp_path / "second" / "log.csv"
    bench = compare_attitude(
        first,
        reference_log=second,
        reference=["rests", "13 same place as 6"],
        gyro_bias="rests",
        interpolation="cubic",
        **ASKED,
    )
    assert bench.places
    seal = write_attitude(bench, tmp_path / "bundle", report=False)
    place = moved(seal, [first, second], tmp_path / "elsewhere")
    assert verify(place).verdict == "identical"


@pytest.mark.skipif("vqf" not in available_peers(), reason="the library vqf is not installed")
def test_other_libraries(logs, tmp_path):
    bench = compare_attitude(logs[0], peers=["vqf"], **ASKED)
    assert bench.peers
    seal = write_attitude(bench, tmp_path / "bundle", report=False)
    assert verify(moved(seal, logs, tmp_path / "elsewhere")).verdict == "identical"
