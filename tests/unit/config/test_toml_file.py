"""Slips that make a file no TOML: its line, and what was likely meant."""

from __future__ import annotations

import pytest

from strapdown.config.toml_file import place_of, read_toml
from strapdown.errors import ConfigError, Finding, nearest

SLIPS = {
    "speed = 25,6": "config.toml-decimal-comma",
    "speed = [1,5, 2,5": "config.not-toml",
    "position = 0.6, -0.5, 0.2": "config.toml-list-without-brackets",
    "position = 600,-500,200": "config.toml-list-without-brackets",
    "speed = ?": "config.toml-open-value",
    "name = “IMU1”": "config.toml-typographic-quotes",
    'path = "C:\\data\\x.csv"': "config.toml-backslash",
    "combine = True": "config.toml-capital-boolean",
    "combine = no": "config.toml-capital-boolean",
    "speed = .5": "config.toml-no-digit-before-point",
    "number = 007": "config.toml-leading-zero",
    "number = 2024-117": "config.toml-unquoted-date",
    "number = 2024/117": "config.toml-unquoted-date",
    "speed = 7.1 m/s": "config.toml-unit-after-number",
    "heading = 12°": "config.toml-unit-after-number",
    "name = IMU1": "config.toml-unquoted-text",
    "name = 'IMU1": "config.not-toml",
    "speed": "config.not-toml",
}


@pytest.mark.parametrize("row", sorted(SLIPS))
def test_a_slip_is_answered_with_what_was_meant(row, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(f"title = 'x'  # a, b\n{row}\nmass = 1\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_toml(path)
    assert caught.value.finding.line in (2, 3)
    assert caught.value.finding.code == SLIPS[row]


@pytest.mark.parametrize("name", ["left.csv", "v10146.EV5"])
def test_a_record_in_place_of_a_file_is_answered_with_init(name, tmp_path):
    path = tmp_path / name
    path.write_text("time_s,ax\n0,1\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_toml(path)
    assert caught.value.finding.code == "config.toml-is-record"


def test_a_list_that_does_not_end_is_named_at_the_end_of_the_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("a = [1,\n2,\n\n")
    with pytest.raises(
        ConfigError, match=r"case\.toml, line 2: the file is not valid TOML: Invalid value"
    ):
        read_toml(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\nb = 2\na = 3", "line 3, a: the key is repeated; it is in line 1 too"),
        ("[t]\na = 1\n[u]\n[t]\n", "line 4, t: the key is repeated; it is in line 1 too"),
        ("[t]\n[[t]]\n", "line 2, t: the key is repeated; it is in line 1 too"),
        ("[[t]]\n[t]\n", "line 2, t: the key is repeated; it is in line 1 too"),
        ("a = { b = 1 }\n[u]\nc = { d = 1, d = 2 }", "line 3, u, c, d: the key is repeated"),
        (
            "[[u]]\nname = 1\n\nname = 2\n",
            "line 4, u 1, name: the key is repeated; it is in line 2",
        ),
    ],
)
def test_what_stands_twice_has_both_lines(text, said, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_toml(path)
    assert said in str(caught.value)


def test_a_place_counts_as_a_person_does():
    assert place_of(("units", 1, "accelerometers", 0, "unit")) == "unit 2, accelerometer 1, unit"
    assert place_of(("units", 0, "position_m", 2)) == "unit 1, position_m 3"
    assert place_of(("over_s", 0)) == "over_s 1"
    assert place_of((0,)) == "element 1"


def test_a_finding_with_a_line_says_so():
    where = {"file": "case.toml", "quantity": "entry, speed", "line": 14}
    finding = Finding("config.text-empty", **where)
    assert str(finding).startswith("case.toml, line 14, entry, speed: it is empty\n")


def test_a_near_word_may_be_one_that_is_not_listed():
    said = nearest("speed_kmph", ["speed_m_per_s", "kind"], also=["speed_km_per_h"])
    assert said == "did you mean 'speed_km_per_h'? Known: speed_m_per_s, kind."
