"""A case that can be read: its units, its files, what is left out, what is still open."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from good_case import TEXT, read, write

from strapdown.bundle import names_file
from strapdown.config.crash_case import CaseSpec
from strapdown.errors import ConfigError


def test_every_quantity_comes_in_the_unit_of_its_field(tmp_path):
    spec = read(tmp_path)
    # Round numbers stay round: 25.2 / 3.6 and 600 / 1000 have one nearest double each.
    assert spec.entry.speed_m_per_s == 7.0
    assert spec.entry.speed_sd_m_per_s == pytest.approx(0.1, rel=1e-15)
    assert spec.units[0].position_m == (0.6, -0.5, 0.2)
    assert spec.units[0].trigger_sd_s == 0.0014
    assert spec.references[1].over_s == (0.0, 0.115)
    assert spec.references[1].delta_v_m_per_s == pytest.approx(-26 / 3.6, rel=1e-15)
    assert spec.units[0].accelerometers[1].uncertainty["full_scale_g"] == (100.0, 50.0, 50.0)
    # Curves of some records have numbers for names.
    assert spec.units[1].accelerometers[0].channels == {"x": "1", "y": "2", "z": "3"}


@pytest.mark.parametrize(
    ("written", "kg"), [("mass_lb = 3000", 1360.77711), ("mass_kg = 1360.77711", 1360.77711)]
)
def test_a_mass_in_pounds_is_one_in_kilograms(tmp_path, written, kg):
    # 1 lb = 0.45359237 kg by definition.
    assert read(tmp_path, ("mass_kg = 1300", written)).vehicle.mass_kg == pytest.approx(kg)


@pytest.mark.parametrize(
    ("key", "value"),
    [("length_ft", 13.5), ("length_in", 162), ("length_cm", 411.48), ("length_mm", 4114.8)],
)
def test_a_length_may_be_in_other_units(tmp_path, key, value):
    spec = read(tmp_path, ("length_m = 4.2", f"{key} = {value}"))
    assert spec.vehicle.length_m == pytest.approx(4.1148, rel=1e-12)


def test_gravity_in_g_and_speed_in_mph(tmp_path):
    spec = read(
        tmp_path,
        ("[options]", "[options]\ngravity_g = 1"),
        ("speed_km_per_h = 25.2", "speed_mph = 15"),
    )
    assert spec.options.gravity_m_per_s2 == 9.80665
    assert spec.entry.speed_m_per_s == pytest.approx(6.7056, rel=1e-12)


def test_files_are_found_from_the_folder_of_the_case(tmp_path, monkeypatch):
    write(tmp_path)
    monkeypatch.chdir(tmp_path.parent)
    spec = CaseSpec.read(f"{tmp_path.name}/case.toml")
    paths = [spec.units[0].gyro.path, spec.units[1].accelerometers[0].path, spec.references[0].path]
    assert paths == [str(tmp_path / n) for n in ("imu1.csv", "imu2.csv", "cameras.csv")]
    assert spec.name == "case"
    assert all(names_file("path", path) for path in paths)


@pytest.mark.parametrize("kind", ["speed_record", "gnss"])
def test_the_speeds_of_the_wheels_are_found_there_too(tmp_path, kind):
    (tmp_path / "can.csv").touch()
    fixes = 'path = "imu2.csv"\nantenna_m = [0.0, 0.0, -1.0]' if kind == "gnss" else ""
    drive = f'kind = "{kind}"\n{fixes}\nspeed_path = "can.csv"'
    given = 'speed_km_per_h = 25.2\nspeed_sd_km_per_h = 0.36\nsource = "speed trap"\n'
    spec = read(tmp_path, ('kind = "speed"', drive), (given, ""))
    assert spec.entry.speed_path == str(tmp_path / "can.csv")


def test_the_nearest_file_can_be_pasted(tmp_path):
    write(tmp_path)
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "imu1_high_g.csv").touch()
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, ('path = "imu1.csv"', 'path = "records/imu1_highg.csv"'))
    assert caught.value.finding.data["near"] == "records/imu1_high_g.csv"


def test_a_sensor_of_a_file_is_found_there_too(tmp_path):
    from strapdown.sensors.catalogue import FOLDER

    (tmp_path / "own.toml").write_bytes((FOLDER / "mpu-6050.toml").read_bytes())
    spec = read(tmp_path, ('"mpu-6050"', '"own.toml"'))
    assert spec.units[0].gyro.sensor == str(tmp_path / "own.toml")
    assert read(tmp_path).units[0].gyro.sensor == "mpu-6050"


def test_what_was_sealed_is_the_same_case_again(tmp_path):
    spec = read(tmp_path)
    assert CaseSpec.model_validate_json(spec.model_dump_json()) == spec
    assert CaseSpec(**spec.model_dump(mode="json")) == spec


def test_the_smallest_case_takes_the_rest_as_it_is_usual(tmp_path):
    text = TEXT[: TEXT.index("[[references]]")].replace("[vehicle]", "[vehicle]\n#", 1)
    spec = CaseSpec.read(write(tmp_path, text=text))
    assert spec.references == ()
    assert spec.options.window_s is None
    assert spec.options.peak_window_s == 0.030


def test_one_name_may_stand_where_several_could(tmp_path):
    spec = read(
        tmp_path,
        ('severity = ["wang_2022_front_mais3"]', 'severity = "wang_2022_front_mais3"'),
        ("[options]", '[options]\nformats = "mme"'),
    )
    assert spec.options.severity == ("wang_2022_front_mais3",)
    assert spec.options.formats == ("mme",)


def test_the_mark_of_windows_and_its_ends_of_lines_change_nothing(tmp_path):
    path = write(tmp_path)
    spec = CaseSpec.read(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert CaseSpec.read(path) == spec
    path.write_bytes(path.read_bytes().replace(b"width_m", b"wide_m"))
    with pytest.raises(ConfigError, match="line 8, vehicle, wide_m"):
        CaseSpec.read(path)


def test_all_that_is_still_open_is_named_at_once(tmp_path):
    changes = (
        ('"Impact on a pole"', '"?"'),
        ("speed_km_per_h = 25.2", 'speed_km_per_h = "?"'),
        ("[600, -500, 200]", '["?", "?", "?"]'),
        ('y = "ay"', 'y = " ? "'),
        ("width_m = 1.7", "width_m = 1.7\nunheard_of = '?'"),
    )
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, *changes)
    assert str(caught.value) == (
        "case.toml: 5 values are missing:\n"
        "  line 1, title: what the case is called in the report\n"
        "  line 9, vehicle, unheard_of\n"
        "  line 18, entry, speed_km_per_h: speed of the vehicle at the entry\n"
        "  line 24, unit 1, position_mm: forward, right, down of the recorder from the origin that "
        "all positions share; delta-V and the direction of force move with it\n"
        "  line 34, unit 1, accelerometer 1, channels, y: the column or channel of each axis: x "
        "forward, y right, z down\n"
        '  Remedy: replace each "?" by its value, numbers without quotation marks; optional keys '
        "may be deleted"
    )


def test_text_of_any_kind_is_taken_where_text_is_wanted(tmp_path):
    hostile = "<script>alert(1)</script>\u202e\x00\x1b[31m" + "x" * 100_000
    text = TEXT.replace('title = "Impact', "description = '''D'''\ntitle = \"Impact", 1)
    escaped = hostile.replace("\x00", "\\u0000").replace("\x1b", "\\u001b")
    path = write(tmp_path, text=text.replace("'''D'''", f'"{escaped}"'))
    assert CaseSpec.read(path).description == hostile
    markup = "<b onclick='x'>&amp;</b>"
    assert read(tmp_path, ("Impact on a pole", markup)).title == markup
