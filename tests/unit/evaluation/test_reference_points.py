"""Reference points in words, in files, and what is measured at them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.evaluation.reference_points import (
    in_words,
    parse_reference,
    references_from_words,
    score_references,
)
from strapdown.formats.references import read_reference_words
from strapdown.increments import increments_from_imu
from strapdown.report.attitude_words import standing
from strapdown.tables import imu_table


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("end same as start", {"time": 9.0, "since": 1.0, "kind": "same"}),
        ("9.0 same-as 5", {"time": 9.0, "since": 5.0, "kind": "same"}),
        ("END: same as START sd 0.5", {"time": 9.0, "since": 1.0, "kind": "same", "sd": 0.5}),
        (
            "end 2 turns about z since start",
            {"time": 9.0, "since": 1.0, "kind": "turns", "turns": 2.0, "axis": "z"},
        ),
        (
            "end = 1 turn about up since 2.5",
            {"time": 9.0, "since": 2.5, "kind": "turns", "turns": -1.0, "axis": "z"},
        ),
        (
            "end -0.25 turns about -left since start",
            {"time": 9.0, "since": 1.0, "kind": "turns", "turns": -0.25, "axis": "y"},
        ),
        (
            "4.5 roll=-10 pitch=0 heading=270 sd 1e-1",
            {
                "time": 4.5,
                "kind": "known",
                "roll": -10.0,
                "pitch": 0.0,
                "heading": 270.0,
                "sd": 0.1,
            },
        ),
    ],
)
def test_words(text, row):
    assert parse_reference(text, 1.0, 9.0) == row


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("the end is the start", ConfigError, "not understood"),
        ("end 2 turns about w since start", ConfigError, "axis"),
        ("0.5 same as start", DataError, "s, and the log covers"),
        ("end same as 9.5", DataError, "s, and the log covers"),
        ("end roll 0 heading 0", ConfigError, "not understood"),
    ],
)
def test_words_that_cannot_be_used(text, error, message):
    with pytest.raises(error, match=message):
        parse_reference(text, 1.0, 9.0)


def turning_log(rate_deg: float = 90.0, seconds: float = 8.0):
    """A constant turn to the right about the down axis: two whole turns in eight seconds."""
    time = np.linspace(0.0, seconds, 801)
    return imu_table(time, np.tile([0.0, 0.0, np.radians(rate_deg)], (801, 1)))


def scores(words: list[str], rate_deg: float = 90.0):
    imu = turning_log(rate_deg)
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu))
    return score_references(run, references_from_words(words, 0.0, 8.0), imu)


def test_each_kind_measures_the_angle_that_is_left():
    found = scores(
        [
            "4 same as start",
            "1 roll 0 pitch 0 heading 80",
            "3 0.75 turns about down since start",
            "3 -0.75 turns about up since start",
            "3 0.5 turns about z since start",
            "6.5 2 turns about z since 0.5",
        ]
    )
    # Rounding of 800 products of quaternions at the most.
    assert [s.error_deg for s in found] == pytest.approx([0, 10, 0, 0, 90, 180], abs=1e-9)
    assert found[4].turned_deg == pytest.approx(270.0, abs=1e-9)
    assert found[4].expected_deg == 180.0


def test_whole_turns_also_tell_the_scale():
    (score,) = scores(["end 2 turns about z since start"], rate_deg=90.9)
    assert score.error_deg == pytest.approx(7.2, abs=1e-9)
    assert score.turned_deg / score.expected_deg == pytest.approx(1.01, abs=1e-12)


def test_between_samples_the_attitude_is_turned_and_not_averaged():
    imu = imu_table([0.0, 1.0], np.tile([0.0, 0.0, 2.0], (2, 1)))
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu))
    half = attitude_at(run.attitude, [0.25])[0]
    exact = rotation.quaternion_from_rotation_vector([0.0, 0.0, 0.5])
    assert rotation.rotation_angle(half, exact) < 1e-13


FILES = {
    "points.txt": "# where it lay\nend same as start\n4 roll 0 pitch 0 heading 0 sd 2\n",
    "points.toml": 'references = ["end same as start", "4 roll 0 pitch 0 heading 0 sd 2"]\n',
    "points.csv": (
        "time_s,kind,since_s,roll_deg,pitch_deg,heading_deg,sd_deg\n"
        "end,same,start,,,,\n4,known,,0,0,0,2\n"
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_points_say_the_same(tmp_path, name):
    (tmp_path / name).write_text(FILES[name])
    words = read_reference_words(tmp_path / name)
    table = references_from_words(words, 0.0, 8.0)
    assert [in_words(row) for _, row in table.iterrows()] == [
        "8 s: same attitude as at 0 s",
        "4 s: roll 0°, pitch 0°, heading 0°",
    ]
    assert table["sd"].iloc[1] == 2.0
    bench = compare_attitude("alexiev-fig4", reference=[str(tmp_path / name)])
    assert len(bench.references) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,kind,since_s\n3,same,\n", "row 2, since_s"),
        ("time_s,kind,since_s\n3,sane,1\n", "unknown kind 'sane'"),
        ("time_s,kind,since_s\n3,turns,1\n", "row 2, turns"),
    ],
)
def test_a_file_of_points_with_a_hole_is_refused(tmp_path, text, message):
    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_reference_words(tmp_path / "points.csv")


def test_a_truth_that_is_none_is_refused(tmp_path):
    (tmp_path / "truth.csv").write_text("time_s,a\n0,1\n1,2\n")
    with pytest.raises(DataError, check=coded("io.file-without-attitude", file="truth.csv")):
        compare_attitude("alexiev-fig4", reference=[str(tmp_path / "truth.csv")])


def test_a_truth_of_another_time_is_refused(tmp_path):
    (tmp_path / "truth.csv").write_text(
        "time_s,roll_deg,pitch_deg,heading_deg\n70,0,0,0\n71,0,0,0\n"
    )
    with pytest.raises(
        DataError, match=r"truth\.csv, time: 0 instants of the reference are within the log: the"
    ):
        compare_attitude("alexiev-fig4", reference=[str(tmp_path / "truth.csv")])


def test_a_truth_that_meets_the_log_in_one_instant_says_nothing(tmp_path):
    """The start would be compared with itself, and called perfect."""
    text = "time_s,roll_deg,pitch_deg,heading_deg\n-1,0,0,0\n0,0,0,0\n"
    (tmp_path / "truth.csv").write_text(text)
    with pytest.raises(
        DataError, match=r"truth\.csv, time: 1 instants of the reference are within the log: the"
    ):
        compare_attitude("alexiev-fig4", reference=[str(tmp_path / "truth.csv")])


def test_a_truth_of_a_part_of_the_log_is_told_as_that(tmp_path):
    text = "time_s,roll_deg,pitch_deg,heading_deg\n0,0,0,0\n1,0,0,0\n"
    (tmp_path / "truth.csv").write_text(text)
    bench = compare_attitude("alexiev-fig4", reference=[str(tmp_path / "truth.csv")])
    assert any("covers 1 of 5 s" in f.what for f in bench.findings)


def test_every_line_of_a_file_counts_and_a_bad_one_is_named(tmp_path):
    (tmp_path / "points.txt").write_text("# ours\nend same as start\n3 roll 1, pitch 2\n")
    with pytest.raises(
        DataError,
        check=coded("evaluation.not-understood-2", row=3, file="points.txt", quantity="reference"),
    ):
        read_reference_words(tmp_path / "points.txt")


@pytest.mark.parametrize(
    ("words", "said"), [("-2 turns about z", "-2 turns"), ("5 turns about z", "5 turns")]
)
def test_turns_that_the_gyro_did_not_see_are_questioned(words, said):
    bench = compare_attitude(
        "alexiev-fig2a", reference=[f"end {words} since start"], algorithms=["dcm", "quaternion"]
    )
    (finding,) = [f for f in bench.findings if f.quantity == "reference"]
    assert said in finding.what


def test_the_same_point_twice_is_two_points():
    bench = compare_attitude("alexiev-fig2a", reference=["end same as start"] * 2)
    assert [s.reference for s in bench.scores if s.algorithm == "dcm"] == [None, 1, 2]
    assert standing(bench).count("quaternion") == 1


def test_what_passed_the_pole_is_not_named_as_the_best():
    """At 10 Hz Runge-Kutta's Euler may end anywhere; it has said that it is not to be trusted."""
    names = ["naive", "euler:step=rk4"]
    bench = compare_attitude("alexiev-fig4", rate_hz=100, algorithms=names)
    errors = {s.algorithm: s.error_deg for s in bench.scores}
    assert errors["euler:step=rk4"] < errors["naive"]
    assert standing(bench).startswith("At 5 s, naive is")
