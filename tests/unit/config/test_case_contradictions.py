"""What a hurried investigator gets wrong, beyond what the manual's page of messages holds."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from good_case import TEXT, read

from strapdown.errors import ConfigError

SPEED = "speed_km_per_h = 25.2"
KIND = 'kind = "speed"'
STATED = TEXT[TEXT.index(KIND) : TEXT.index("\n[[units]]")]
FRONT = "front_m = 2.0"
SIZE = "length_m = 4.2\nwidth_m = 1.7\nfront_m = 2.0"
PLACE = "[-1.2, 0.4, 0.1]"
TRIGGER = "trigger_s = 6.9"
OPTIONS = "[options]"
BORROWED = 'gyro_from = "IMU1"'
ASSUMED = "assumed = { turn_sd_deg = 2, because = 'a pole'"
GYRO = "[units.gyro]"
DELTA_V = "delta_v_km_per_h = -26"

BAD = {
    "antenna of a stated speed": ((KIND, "antenna_m = [0, 0, 0]"), ["line 16", "contradicts kind"]),
    "fixes for a standstill": (
        (STATED, 'kind="standstill"\npath="imu1.csv"'),
        ["line 17", "(line 16)"],
    ),
    "time of a standstill": (
        (STATED, 'kind="standstill"\ntime_s = 1'),
        ["time_s = 1", "(line 16)"],
    ),
    "no file of fixes": ((STATED, 'kind="gnss"\n'), ["entry, path: the value is missing"]),
    "blank source": (('"speed trap"', '"  "'), ["config.entry-source-missing"]),
    "speed of nobody": ((SPEED, ""), ["write speed_m_per_s or speed_km_per_h"]),
    "sd of a bullet": (
        ("_km_per_h = 0.36", "_m_per_s = 36"),
        ["config.above-most", "36 is out of range", "speed_sd_km_per_h"],
    ),
    "heading": ((KIND, "heading_deg = 361"), ["config.above-most", "at most 360"]),
    "slip's sd": ((KIND, "slip_sd_deg = 181"), ["config.above-most", "at most 180"]),
    "entry in ms": (
        ("window_s = [-0.1, 0.75]", "window_s = [-0.1, 0.75]\n[entry.x]"),
        ["unknown key"],
    ),
    "far entry": (
        ("window_s = [-0.1, 0.75]", "", KIND, "time_s = -700"),
        ["config.below-least", "time_ms"],
    ),
    "window without the entry": (
        ("[-0.1, 0.75]", "[0.1, 0.75]"),
        ["line 74", "time_s = 0.0 (as nothing else is written)"],
    ),
    "length in mm": (
        ("length_m = 4.2", "length_m = 4200"),
        ["config.above-most", "4200", "length_mm"],
    ),
    "negative front": ((FRONT, "front_m = -2"), ["front_m = -2", "(line 7)"]),
    "outline in mm": ((SIZE, "outline_m = [[2000, 0], [2000, 800], [0, 0]]"), ["outline_mm"]),
    "flat outline": ((SIZE, "outline_m = [[2, 0], [1, 0], [-1, 0]]"), ["it encloses 0 m²"]),
    "crossed outline": (
        (SIZE, "outline_m = [[2, 1], [-2, -1], [2, -1], [-2, 1]]"),
        ["it encloses 0 m²", "in order around"],
    ),
    "beside an outline": (
        (SIZE, "outline_m = [[2, -1], [2, 1], [-1, 0]]", PLACE, "[-1.6, 0, 0]"),
        ["0.6 m outside", "(line 5)"],
    ),
    "above the vehicle": ((PLACE, "[-1.2, 0.4, -5]"), ["5 m above the origin"]),
    "below the vehicle": ((PLACE, "[-1.2, 0.4, 5]"), ["5 m below the origin"]),
    "position in cm": (
        (f"position_m = {PLACE}", "position_m = [-120, 40, 10]"),
        ["write position_mm or position_cm"],
    ),
    "point in mm": (("[0.0, 0.0, 0.0]", "[300, 0, 0]"), ["line 13, point, position_m", "_mm"]),
    "antenna in mm": (
        (STATED, 'kind = "gnss"\npath = "imu1.csv"\nantenna_m = [200, 0, -1300]\n'),
        ["entry, antenna_m", "antenna_mm"],
    ),
    "position's sd in mm": (
        ("position_sd_m = 0.02", "position_sd_m = 20"),
        ["config.above-most", "position_sd_mm"],
    ),
    "no position's sd": (("position_sd_m = 0.02", ""), ["position_sd_m: the value is missing"]),
    "units named alike but for spaces": (('"IMU2"', '" imu1"'), ["(line 22)"]),
    "lender without a gyro": (
        (TRIGGER, 'trigger_s = 6.9\ngyro_from = "IMU2"', GYRO, "[units.other]"),
        ["unknown key"],
    ),
    "angles": (
        ("angles_deg = [0, 0, 0]", "angles_deg = [0, 0, 720]"),
        ["config.above-most", "at most 360"],
    ),
    "angles' sd": (
        ("angles_sd_deg = 1.0", "angles_sd_deg = 91"),
        ["config.above-most", "at most 90"],
    ),
    "upside-down levelling": (
        (TRIGGER, f"{TRIGGER}\nlevelling_deg = [0, 91]\nlevelling_sd_deg = 1"),
        ["config.above-most", "at most 90"],
    ),
    "levelling's sd": (
        (TRIGGER, f"{TRIGGER}\nlevelling_deg = [0, 1]\nlevelling_sd_deg = 91"),
        ["config.above-most", "at most 90"],
    ),
    "rest backward": ((TRIGGER, f"{TRIGGER}\nrest_s = [-1, -2]"), ["ends before it begins"]),
    "rest after the entry": (
        (KIND, "time_s = -3", TRIGGER, f"{TRIGGER}\nrest_s = [-2, -1]", "[-0.1,", "[-4,"),
        ["contradicts time_s = -3 (line 16)", "speed_km_per_h = 25.2 (line 17)"],
    ),
    "no trigger at all": (
        (TRIGGER, "", "trigger_s = 0", "", OPTIONS, '[options]\nclock = "correlation"'),
        ["line 21, unit 1, trigger_s: the value is missing", "no unit has one"],
    ),
    "assumed of nothing missing": (
        (GYRO, f"[units.assumed]\n{GYRO}"),
        ["config.nothing-to-assume"],
    ),
    "assumed beside a borrowed gyro": (
        (BORROWED, f"{BORROWED}\n{ASSUMED} }}"),
        ["turn_sd_deg = 2 contradicts gyro_from = 'IMU1' (line 55)"],
    ),
    "assumed a force that is there": (
        (BORROWED, f"{ASSUMED}, delta_v_sd_m_per_s = 1 }}"),
        ["delta_v_sd_m_per_s = 1 contradicts accelerometers"],
    ),
    "assumed a turn of anything": (
        (BORROWED, "assumed = { turn_sd_deg = [2, 2, 60], because = 'x' }"),
        ["exceeds 45"],
    ),
    "assumed over nothing": ((BORROWED, f"{ASSUMED}, over_s = [1, 1] }}"), ["it lasts 0 s"]),
    "assumed in ms": ((BORROWED, f"{ASSUMED}, over_s = [0, 150] }}"), ["over_ms"]),
    "assumed less than nothing": ((BORROWED, "assumed = { turn_sd_deg = -2 }"), ["is negative"]),
    "axis of a gyro": (('x = "gx", ', ""), ["unit 1, gyro, channels: x: neither"]),
    "no channel of a gyro": (
        ('{ x = "gx", y = "gy", z = "gz" }', "{ }"),
        ["gyro, channels: x and y and z: neither"],
    ),
    "channel of another triad": (('"hx"', '"-ax"'), ["(line 33)", "one axis of one triad"]),
    "channel of another unit's gyro": (
        (BORROWED, 'gyro = { path = "imu1.csv", channels = { x = "gx", y = "b", z = "c" } }'),
        ["(line 46)", "gyro_from"],
    ),
    "a sign for a channel": (('"hx"', '"-"'), ["config.sign-without-channel"]),
    "time for an axis": (('"hx"', '"t"', 'name = "high-g"', 'time = "t"'), ["config.time-as-axis"]),
    "an axis named forward": (("x = 1", "forward = 1"), ["there is no 'forward'", "x, y, z"]),
    "an unknown sensor": (('"lis302dlh"', '"lis302"'), ["did you mean 'lis302dlh'?"]),
    "a sensor that is a case": (
        ('"lis302dlh"', '"case.toml"'),
        ["unknown key", "line 60"],
    ),
    "an unknown uncertainty": (
        ("bias_sd_mg = 20", "bias_sd_mgs = 1"),
        ["did you mean 'bias_sd_mg'?"],
    ),
    "an uncertainty in two units": (
        ("bias_sd_mg = 20", "bias_sd_mg = 20, bias_bound_ug = 3"),
        ["bias_bound_ug = 3 contradicts bias_sd_mg = 20 (line 35)"],
    ),
    "a negative uncertainty": (("bias_sd_mg = 20", "bias_sd_mg = -20"), ["it is negative"]),
    "no range": (("full_scale_g = 8", "full_scale_g = 0"), ["zero is not a valid"]),
    "a bandwidth an axis": (
        ("bias_sd_mg = 20", "bandwidth_hz = [1, 2, 3]"),
        ["all axes have one bandwidth"],
    ),
    "two numbers of uncertainty": (("bias_sd_mg = 20", "bias_sd_mg = [1, 2]"), ["nor three"]),
    "a sensor's range before a narrower one": (
        (
            "uncertainty = { full_scale_g = 8, bias_sd_mg = 20 }",
            'sensor = "mpu-6050"',
            "full_scale_g = [100, 50, 50]",
            "full_scale_g = 2",
        ),
        ["contradicts sensor = 'mpu-6050' (line 35)", "16 g precedes one of 2 g"],
    ),
    "a unit of time": (('unit = "deg/s"', 'time_unit = "day"'), ["config.unknown-time-unit"]),
    "a unit of rate": (('unit = "g"', 'unit = "°/s"'), ["a unit of a gyro"]),
    "peak in ms": (
        (OPTIONS, "[options]\npeak_window_s = 30"),
        ["config.above-most", "peak_window_ms"],
    ),
    "window before the trigger": (
        ("[-0.1, 0.75]", "[-2, -0.5]", KIND, "time_s = -1"),
        ["ends before the trigger"],
    ),
    "gravity of one": (
        (OPTIONS, "[options]\ngravity_m_per_s2 = 1"),
        ["config.not-above", "gravity"],
    ),
    "a model twice": (
        ('["wang_2022_front_mais3"]', '["wang_2022_all_mais3", "wang_2022_all_mais3"]'),
        ["severity 2", "named twice"],
    ),
    "an input that is a list": ((OPTIONS, "[options]\nseverity_inputs = { a = [1] }"), ["age"[:1]]),
    "a reference of both kinds": (
        ('name = "cameras"', 'name = "cameras"\naxis = "right"'),
        ["axis = 'right' contradicts kind = 'path' (line 63)"],
    ),
    "no change of velocity": ((DELTA_V, ""), ["delta_v_m_per_s: the value is missing"]),
    "change in km/h": (
        (DELTA_V, "delta_v_m_per_s = -97"),
        ["config.below-least", "delta_v_km_per_h"],
    ),
    "negative resultant": (
        (DELTA_V, f'{DELTA_V}\naxis = "resultant"'),
        ["contradicts axis = 'resultant' (line 71)"],
    ),
    "span backward": (("[0, 115]", "[115, 0]"), ["over_ms: [115, 0]: it ends before it begins"]),
    "a case's own name": (("number =", "name ="), ["line 2, name", "named after its file"]),
    "true for a number": (("mass_kg = 1300", "mass_kg = true"), ["true does not fit"]),
    "yes for true": ((OPTIONS, '[options]\ncombine = "yes"'), ["write true or false"]),
    "infinite": (("mass_kg = 1300", "mass_kg = inf"), ["line 6, vehicle, mass_kg: inf"]),
    "overflow": (("length_m = 4.2", "length_in = 1" + "0" * 400), ["line 7, vehicle, length_in"]),
    "more than overflow": (("length_m = 4.2", "length_m = 1" + "0" * 400), ["line 7, vehicle"]),
    "a table for a number": (("mass_kg = 1300", "mass_kg = { kg = 1300 }"), ["line 6"]),
    "a number for a table": (
        ('number = "2016-07"', "entry = 5", STATED, "", "[entry]", ""),
        ["line 2, entry: 5 is not a table"],
    ),
    "a number for a list": (("[-0.1, 0.75]", "0.75"), ["line 74, options, window_s: 0.75"]),
    "no unit": (
        (TEXT[TEXT.index("[[units]]") : TEXT.index("[[ref")], ""),
        ["units: the value is missing"],
    ),
    "a long title": (("Impact on a pole", "x" * 201), ["201 characters"]),
    "a title of two lines": (("Impact on", "Impact\\non"), ["line 1, title: character 7 is"]),
    "a name that turns": (('"IMU1"', '"IMU\u202e1"'), ["character 4 is '\\u202e'"]),
    "an empty name": (('name = "IMU1"', 'name = " "'), ["it is empty"]),
    "a path that is none": (('"cameras.csv"', '"a\\u0000b"'), ["character 2 is '\\x00'"]),
    "a very long path": (('"cameras.csv"', '"' + "x" * 4000 + '"'), ["cannot be read"]),
}


@pytest.mark.parametrize("name", sorted(BAD))
def test_it_is_refused_with_its_lines_and_a_remedy(name, tmp_path):
    pieces, words = BAD[name]
    changes = tuple(zip(pieces[::2], pieces[1::2], strict=True))
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, *changes)
    said = str(caught.value)
    texts = [word for word in words if not word.startswith("config.")]
    assert all(word in said for word in texts), said
    codes = [word for word in words if word.startswith("config.")]
    assert codes in ([], [caught.value.finding.code])
    assert "Remedy: " in said
    assert "line " in said or "units: the value is missing" in said
    assert len(said) < 1500


GOOD = {
    "a standstill": (STATED, 'kind = "standstill"\nsource = "parked"\nspeed_m_per_s = 0\n'),
    "fixes": (STATED, 'kind = "gnss"\npath = "imu1.csv"\nantenna_m = [0, 0, -1.4]\n'),
    "an outline": (SIZE, "outline_mm = [[2000, -800], [2000, 800], [-2200, 800], [-2200, -800]]"),
    "a place on the bumper": (PLACE, "[2.3, 0.9, 0.1]"),
    "an origin somewhere": (FRONT, "", PLACE, "[-4.0, 0.4, 0.1]"),
    "assumed turning": (BORROWED, f"{ASSUMED}, over_ms = [0, 150] }}"),
    "an assumed axis": (
        ", z = 3",
        "",
        BORROWED,
        f"{BORROWED}\nassumed = {{ delta_v_sd_km_per_h = 2, because = 'x' }}",
    ),
    "correlation": ("trigger_s = 0", "", OPTIONS, '[options]\nclock = "correlation"'),
    "rest before the entry": (TRIGGER, f"{TRIGGER}\nrest_s = [-3, -1]"),
    "levelling": (TRIGGER, f"{TRIGGER}\nlevelling_deg = [0, 1]\nlevelling_sd_deg = 1"),
    "no models": ('["wang_2022_front_mais3"]', "[]"),
    "spellings of units": ('unit = "deg/s"', 'unit = "°/s"\ntime_unit = "sec"'),
    "changes of velocity for a unit": (
        'sensor = "lis302dlh"',
        'unit = "km/h"\nuncertainty = { scale_sd_percent = 5 }',
    ),
    "a folder of records": ('path = "cameras.csv"', 'path = "."'),
}


@pytest.mark.parametrize("name", sorted(GOOD))
def test_what_can_be_meant_is_taken(name, tmp_path):
    pieces = GOOD[name]
    read(tmp_path, *zip(pieces[::2], pieces[1::2], strict=True))
