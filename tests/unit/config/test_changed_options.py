"""Options that differ, each named where a person looks for it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from good_case import read

from strapdown.config.reading import changed_options


def changed(spec, **values):
    return spec.model_copy(update=values)


@pytest.fixture
def spec(tmp_path):
    return read(tmp_path)


def test_what_is_the_same_has_no_changes(spec):
    assert changed_options(spec, spec) == ()
    # Sealed as JSON, tuples are lists.
    assert changed_options(spec.model_dump(mode="json"), spec) == ()


def test_a_number_is_named_with_both_values(spec):
    faster = changed(spec, entry=changed(spec.entry, speed_m_per_s=8.1))
    assert changed_options(spec, faster) == ("entry, speed_m_per_s: 7.0 before, 8.1 now",)


def test_units_are_known_by_their_names_and_not_their_places(spec):
    first, second = spec.units
    gyro = changed(first.gyro, unit="rad/s")
    high = changed(first.accelerometers[1], uncertainty={"full_scale_g": 50.0})
    moved = changed(
        first, gyro=gyro, accelerometers=(first.accelerometers[0], high), position_m=(0.6, -0.5, 0)
    )
    assert changed_options(spec, changed(spec, units=(second, moved))) == (
        "unit 'IMU1', position_m: [0.6, -0.5, 0.2] before, [0.6, -0.5, 0] now",
        "unit 'IMU1', accelerometer 'high-g', uncertainty, full_scale_g: [100.0, 50.0, 50.0] "
        "before, 50.0 now",
        "unit 'IMU1', accelerometer 'high-g', uncertainty, bias_sd_mg: 700.0 before, not there now",
        "unit 'IMU1', gyro, unit: 'deg/s' before, 'rad/s' now",
        "order of units: 'IMU1', 'IMU2' before, 'IMU2', 'IMU1' now",
    )


def test_what_came_and_went_is_told(spec):
    less = changed(spec, units=spec.units[:1], references=())
    assert changed_options(spec, less) == (
        "unit 'IMU2': no longer there",
        "reference 'cameras': no longer there",
        "reference 'barrier': no longer there",
    )
    assert changed_options(less, spec)[0] == "unit 'IMU2': not there before"
    no_gyro = changed(spec, units=(changed(spec.units[0], gyro=None), spec.units[1]))
    assert changed_options(spec, no_gyro) == ("unit 'IMU1', gyro: a table before, not there now",)
    assert changed_options(no_gyro, spec) == ("unit 'IMU1', gyro: not there before",)


def test_tables_without_names_are_numbered():
    before = {"accelerometers": [{"name": "", "unit": "g"}, {"name": "", "unit": "g"}]}
    after = {"accelerometers": [{"name": "", "unit": "g"}, {"name": "", "unit": "mg"}]}
    assert changed_options(before, after) == ("accelerometer 2, unit: 'g' before, 'mg' now",)


def test_true_is_not_one_and_a_key_that_is_left_out_is_none():
    assert changed_options({"a": True}, {"a": 1}) == ("a: true before, 1 now",)
    assert changed_options({}, {"a": None}) == ()
    assert changed_options({"a": []}, {"a": [{"name": "x"}]}) == ("a 'x': not there before",)


def test_long_text_is_cut(spec):
    longer = changed(spec, description="x" * 10_000)
    (said,) = changed_options(spec, longer)
    assert said.startswith("description: '' before, 'xxx")
    assert len(said) < 150
