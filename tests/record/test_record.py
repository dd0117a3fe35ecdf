"""The comparison of the record finds what it is for, and its lists are whole."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

HERE = Path(__file__).parent


def load(name, as_name=None):
    """Load a module of the record, which is a program and no package."""
    spec = importlib.util.spec_from_file_location(as_name or name, HERE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def record():
    """Modules of the record; they import each other by bare names, for this test alone."""
    before = dict(sys.modules)
    found = {name: load(name) for name in ("compare", "runs", "adapter_0_1", "adapter")}
    found["recorder"] = load("recorder")
    yield found
    for name in found:
        sys.modules.pop(name)
    sys.modules.update({k: v for k, v in before.items() if k in found})


def write(folder, arrays, words=None, exits=None, run="a"):
    folder.mkdir(exist_ok=True)
    np.savez(folder / f"{run}.npz", **arrays)
    document = {"exit": exits or {"00 navigate": 0}, "status": words or {}}
    (folder / f"{run}.json").write_text(json.dumps(document))


@pytest.fixture
def sides(tmp_path):
    values = np.array([[1.0, np.nan, -0.0], [2.5, np.inf, 1e-300]])
    for side in ("old", "new"):
        write(tmp_path / side, {"nav/lat": values, "nav/rms": np.array([1.0])}, {"heading": "red"})
    return tmp_path, values


def outcome(record, folder, changes=(), changelog="", runs=("a",), **more):
    return record["compare"].compare(
        folder / "old", folder / "new", runs, changes, changelog, **more
    )


def change(record, quantity="nav/lat", run="a", changelog="steeper"):
    return record["compare"].Change(run, quantity, "a new formula", changelog)


def test_equal_records_pass(record, sides):
    told = outcome(record, sides[0])
    assert (told.good, told.passed, told.failed) == (True, ("a",), ())


@pytest.mark.parametrize("at", [(0, 0), (1, 0), (1, 2)])
def test_one_bit_is_found(record, sides, at):
    folder, values = sides
    values = values.copy()
    values.view(np.int64)[at] ^= 1
    write(folder / "new", {"nav/lat": values, "nav/rms": np.array([1.0])}, {"heading": "red"})
    told = outcome(record, folder)
    assert told.failed == ("a",)
    assert [d.quantity for d in told.unlisted] == ["nav/lat"]
    assert "1 of 6" in told.unlisted[0].size


def test_the_sign_of_zero_and_a_nan_are_found(record, sides):
    folder, values = sides
    for at, value in (((0, 2), 0.0), ((0, 1), 7.0), ((0, 0), np.nan)):
        other = values.copy()
        other[at] = value
        write(folder / "new", {"nav/lat": other, "nav/rms": np.array([1.0])}, {"heading": "red"})
        assert outcome(record, folder).failed == ("a",)


def test_a_tolerance_holds_its_quantity_alone(record, sides):
    folder, values = sides
    compare = record["compare"]
    allowed = (compare.Tolerance("*", "*/rms", 4 * compare.EPS, "two sums"),)
    for factor, good in ((1 + 2 * compare.EPS, True), (1 + 6 * compare.EPS, False)):
        arrays = {"nav/lat": values, "nav/rms": np.array([factor])}
        write(folder / "new", arrays, {"heading": "red"})
        assert outcome(record, folder, tolerances=allowed).good is good
        assert not outcome(record, folder, tolerances=()).good


def test_every_tolerance_has_a_reason(record):
    assert all(t.reason and 0.0 < t.relative < 1e-9 for t in record["compare"].TOLERANCES)


def test_a_listed_change_passes_and_must_be_in_the_changelog(record, sides):
    folder, values = sides
    write(folder / "new", {"nav/lat": values + 1, "nav/rms": np.array([1.0])}, {"heading": "red"})
    listed = [change(record)]
    told = outcome(record, folder, listed, "The slope is\nsteeper by 2 %.")
    assert (told.good, told.listed) == (True, 1)
    assert not outcome(record, folder, listed, "nothing of it").good
    assert not outcome(record, folder, [change(record, changelog=" ")], "anything").good
    assert not outcome(record, folder, [change(record, "nav/lon")], "steeper").good


def test_a_listed_change_holds_up_to_its_size_alone(record, sides):
    folder, values = sides
    listed = [record["compare"].Change("a", "nav/*", "another order", "steeper", 1e-9)]
    for size, good in ((2e-9, True), (3e-9, False), (np.inf, False), (np.nan, False)):
        other = values.copy()
        other[1, 0] += size
        arrays = {"nav/lat": other}
        write(folder / "new", {**arrays, "nav/rms": np.array([1.0])}, {"heading": "red"})
        assert outcome(record, folder, listed, "steeper").good is good
    write(folder / "new", {"nav/lat": values, "nav/rms": np.ones(2)}, {"heading": "red"})
    assert not outcome(record, folder, listed, "steeper").good


def test_a_listed_change_that_does_not_occur_is_an_error(record, sides):
    told = outcome(record, sides[0], [change(record)], "steeper")
    assert not told.good
    assert "nothing changed" in told.faults[0]
    assert outcome(record, sides[0], [change(record)], "steeper", partly=True).good


@pytest.mark.parametrize("side", ["old", "new"])
def test_a_missing_run_is_found(record, sides, side):
    (sides[0] / side / "a.npz").unlink()
    told = outcome(record, sides[0])
    assert told.failed == ("a",)
    assert told.unlisted[0].quantity == "(run)"


def test_an_exit_code_a_word_and_a_missing_quantity_are_found(record, sides):
    folder, values = sides
    arrays = {"nav/lat": values, "nav/rms": np.array([1.0])}
    write(folder / "new", arrays, {"heading": "red"}, {"00 navigate": 5})
    assert [d.quantity for d in outcome(record, folder).unlisted] == ["exit 00 navigate"]
    write(folder / "new", arrays, {"heading": "green"})
    assert [d.quantity for d in outcome(record, folder).unlisted] == ["heading"]
    write(folder / "new", {"nav/lat": values}, {"heading": "red"})
    assert [d.new for d in outcome(record, folder).unlisted] == ["missing"]


def test_a_new_quantity_is_counted_and_no_failure(record, sides):
    folder, values = sides
    arrays = {"nav/lat": values, "nav/rms": np.array([1.0]), "nav/alt": values}
    write(folder / "new", arrays, {"heading": "red"})
    told = outcome(record, folder)
    assert (told.good, told.added) == (True, 1)


def test_one_bit_of_a_number_without_an_axis_is_found(record, sides):
    folder, _ = sides
    for side, value in (("old", 3.0), ("new", np.nextafter(3.0, 4.0))):
        write(folder / side, {"nav/limit": np.float64(value)})
    assert outcome(record, folder).unlisted[0].new == "3.0000000000000004"
    write(folder / "old", {"nav/limit": np.float64(np.nextafter(3.0, 4.0))})
    assert outcome(record, folder).good


def test_another_shape_is_found(record, sides):
    folder, values = sides
    arrays = {"nav/lat": values[:1], "nav/rms": np.array([1.0])}
    write(folder / "new", arrays, {"heading": "red"})
    assert outcome(record, folder).unlisted[0].new == "shape (1, 3)"


def test_json_gives_numbers_and_status_words_and_no_sentences(record):
    found = record["recorder"].Found(record["adapter_0_1"].ADAPTER)
    document = {
        "answer": "It ended.",
        "heading": {"at_end": "green", "limit": 3, "borne_out": True, "why": None},
        "spans": [{"from_s": 0.5, "light": "amber", "why": "wide"}, {"from_s": 1, "light": "red"}],
        "found": [{"kind": "gross", "meaning": "no part of the model"}],
        "matrix": [[1, 2], [3, 4]],
    }
    record["recorder"].walk_json(
        found, "nav/verdict.json", document, record["adapter_0_1"].ADAPTER.STATUS_KEYS
    )
    assert found.words == {
        "nav/integrity/found/kind": ["gross"],
        "nav/integrity/heading/heading_status_at_end": "trusted",
        "nav/integrity/spans/heading_status": ["unverified", "rejected"],
    }
    assert found.arrays["nav/integrity/spans/from_s"].tolist() == [0.5, 1.0]
    assert found.arrays["nav/integrity/matrix"].shape == (2, 2)
    assert np.isnan(found.arrays["nav/integrity/heading/why"])
    assert not any("answer" in name for name in (*found.arrays, *found.words))


def test_documents_are_written_as_toml_in_the_words_of_the_version(record):
    import tomllib

    neutral = {"a": {"kind": "zupt", "list": [1.5, {"kind": "zaru"}], "flag": True}, "title": "é"}
    text = record["recorder"].toml_text(record["adapter_0_1"].ADAPTER.document("navigate", neutral))
    assert tomllib.loads(text) == {
        "a": {"kind": "zero_velocity", "list": [1.5, {"kind": "zero_rate"}], "flag": True},
        "title": "é",
    }


def test_the_runs_name_every_command(record):
    steps = [step for run in record["runs"].RUNS.values() for step in run.steps]
    commands = {step.command.split()[0] for step in steps if hasattr(step, "command")}
    wanted = "attitude align navigate outage crash simulate init verify modules demo"
    assert commands >= set(wanted.split())
    assert {step.function for step in steps if hasattr(step, "function")} == set(
        record["adapter"].ADAPTER.CALLS
    )


# What version 0.1 offers in each slot, in neutral terms.
SLOTS = [
    "naive",
    "euler",
    "dcm",
    "quaternion",
    "rk4",
    "rotvec",
    "ned",
    "tadic",
    "wander_azimuth",
    "robust_fir",
    "summed",
    "w_d",
    "levelling",
    "known_heading",
    "two_vector",
    "inertial_frame",
    "gnss_course",
    "rotation_vector",
    "quaternions",
    "joseph",
    "ud",
    "wd",
    "plain",
    "robust",
    "paper",
    "adaptive",
    "huber",
    "hampel",
    "tukey",
    "igg3",
    "none",
    "gnss",
    "zupt",
    "zaru",
    "nonholonomic",
    "odometer",
    "body_velocity",
    "barometer",
    "heading",
    "closed_loop",
    "open_loop",
    "rts",
    "full",
    "interval",
    "shoe",
    "rate_energy",
    "force_variance",
    "force_magnitude",
    "variance",
    "force_spread",
    "stated",
    "otsu",
    "patience",
    "stationary",
    "rocking_stand",
    "sine_velocity",
    "walking",
    "car",
    "aircraft",
    "ship",
    "waypoints",
]


@pytest.mark.parametrize("name", SLOTS)
def test_the_runs_name_every_entry_of_every_slot(record, name):
    def words(item):
        if isinstance(item, str):
            yield from re.findall(r"[a-z_0-9]+", item)
        elif isinstance(item, dict):
            for part in item.values():
                yield from words(part)
        elif isinstance(item, list | tuple):
            for part in item:
                yield from words(part)

    runs = record["runs"]
    named = set()
    for run in runs.RUNS.values():
        for content in run.files.values():
            if isinstance(content, runs.Toml):
                named.update(words(content.document))
        for step in run.steps:
            if isinstance(step, runs.Command):
                named.update(words(list(step.options.values())))
    assert name in named


def test_a_rename_of_today_is_one_line_of_a_table(record):
    class Renamed(record["adapter"].Names):
        COMMANDS: ClassVar = {}
        QUANTITIES = ((r"/integrity\.json/", "/integrity/"),)

    step = record["runs"].Command("outage", ("adis16470",), {"with": "zupt"})
    assert record["adapter_0_1"].ADAPTER.arguments(step)[0] == "coast"
    assert Renamed().arguments(step) == ["outage", "adis16470", "--with", "zero_velocity"]
    assert Renamed().quantity("nav/integrity.json/place") == "nav/integrity/place"


@pytest.fixture
def program(record, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield load("__main__", "record_program")
    sys.modules.pop("record_program")


def test_an_environment_is_not_made_over_other_files(program, tmp_path):
    (tmp_path / "kept").touch()
    with pytest.raises(SystemExit):
        program.build_old(tmp_path)
    assert (tmp_path / "kept").exists()


def test_an_environment_that_could_not_be_made_leaves_no_half(program, tmp_path, monkeypatch):
    def fail(*words, **more):
        if words[0][0] == "git":
            return subprocess.CompletedProcess(words[0], 0, b"")
        raise subprocess.CalledProcessError(1, words[0])

    monkeypatch.setattr(program.subprocess, "run", fail)
    with pytest.raises(subprocess.CalledProcessError):
        program.build_old(tmp_path / "0.1")
    assert not (tmp_path / "0.1").exists()


def test_a_run_that_ended_has_its_key_and_a_failed_one_has_none(program, tmp_path, monkeypatch):
    def run(words, **more):
        return subprocess.CompletedProcess(words, int(words[3] == "bad"), "", "")

    monkeypatch.setattr(program.subprocess, "run", run)
    keys = {"good": "1", "bad": "2"}
    broken = program.record(
        "old", "python", "adapter", ["good", "bad"], tmp_path, tmp_path, 1, keys
    )
    assert broken == ["bad"]
    assert [file.name for file in tmp_path.iterdir()] == ["good.key"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("gnss.position.csv/s_down_m", "gnss.position.csv/s_down_m2"),
        ("gnss.velocity.csv/s_VN_m_s", "gnss.velocity.csv/s_VN_m2_s2"),
        ("gnss.velocity.csv/weight_VN_m_s", "gnss.velocity.csv/weight_VN"),
        ("doppler.csv/weight_down_m_s", "doppler.csv/weight_down"),
        ("quiet.csv/s_x_rad_s", "quiet.csv/s_x_rad2_s2"),
        ("compass.csv/nu_heading_rad", "compass.csv/nu_heading_rad"),
    ],
)
def test_innovations_have_one_name_in_both(record, old, new):
    before = record["adapter_0_1"].ADAPTER.quantity(f"nav/innovations/{old}")
    assert before == record["adapter"].ADAPTER.quantity(f"nav/innovations/{new}")
