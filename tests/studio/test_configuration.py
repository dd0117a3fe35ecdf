"""Configurations: proposed, checked, changed key by key with every comment kept, made commands."""

from __future__ import annotations

import shlex
import shutil
import tomllib

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.studio import forms
from strapdown.studio.configuration import check, command, edited, propose
from strapdown.studio.forms import form_of, kinds, unit_of
from strapdown.studio.kinds import KINDS
from strapdown.studio.look import look
from strapdown.studio.questions import HEIGHTS

TEXT = """\
# The first comment.
title = "a drive"  # beside

[log]
path = "log.csv"
# from_s = 1.0: a part alone
to_s = 5.0

[aiding.gnss]   # fixes
kind = "gnss"
lever_arm_m = [0.1, 0.2, 0.3]  # measured

[[units]]
name = "one"
position_m = ["?", "?", "?"]  # only you know
"""


def comments(text):
    return [line.partition("#")[2] for line in text.split("\n") if "#" in line]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a log of 100 Hz that turns and rests, in which the process is."""
    from strapdown.studio.folder import Folder

    rng = np.random.default_rng(0)
    time = np.arange(0.0, 60.0, 0.01)
    rate = 0.3 * np.sin(0.5 * time) * (time > 20.0)
    rows = np.column_stack([time, np.zeros((time.size, 5)), np.full(time.size, -9.8)])
    rows[:, 3] = rate
    rows[:, 1:] += 1e-3 * rng.standard_normal((time.size, 6))
    head = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    np.savetxt(tmp_path / "log.csv", rows, "%.9g", ",", header=head, comments="")
    monkeypatch.chdir(tmp_path)
    return Folder.open(tmp_path).path


def test_a_change_keeps_every_comment_and_the_order():
    changed = edited(TEXT, {"log.to_s": 7.5, "aiding.gnss.lever_arm_m": [1.0, 2.0, 3.0]})
    assert comments(changed) == comments(TEXT)
    assert changed.replace("7.5", "5.0").replace("[1.0, 2.0, 3.0]", "[0.1, 0.2, 0.3]") == TEXT


def test_a_value_is_added_removed_and_set_in_a_list():
    changed = edited(
        TEXT,
        {
            "log.from_s": 2.0,
            "log.to_s": None,
            "axes.axes": "forward-left-up",
            "units.0.position_m": [1, 2, 3],
            "not.there": None,
            "aiding.gnss.lever_arm_m.1": 9.0,
        },
    )
    table = tomllib.loads(changed)
    assert table["log"] == {"path": "log.csv", "from_s": 2.0}
    assert table["axes"] == {"axes": "forward-left-up"}
    assert table["units"] == [{"name": "one", "position_m": [1, 2, 3]}]
    assert table["aiding"]["gnss"]["lever_arm_m"] == [0.1, 9.0, 0.3]
    assert set(comments(changed)) == set(comments(TEXT))


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"title.x": 1}, "studio.no-such-key"),
        ({"units.1.name": "x"}, "studio.no-such-key"),
        ({"units.name": "x"}, "studio.no-such-key"),
        ({"": 1}, "studio.no-such-key"),
        ({".".join("a" * 200): 1}, "studio.no-such-key"),
        ({str(k): 1 for k in range(300)}, "studio.request-too-large"),
        ({"x": {"y": object()}}, "studio.not-changed"),
    ],
)
def test_a_place_that_is_none(changes, code):
    with pytest.raises(ConfigError) as caught:
        edited(TEXT, changes)
    assert caught.value.finding.code == code


@pytest.mark.parametrize(
    "text", ["a = ", "[" * 5000, "a" + ".a" * 100_000 + " = 1", "x = [[[[" * 900]
)
def test_text_that_is_no_toml_is_refused_in_time(folder, text):
    found = check(folder, "navigate", text, {})
    assert found["errors"] and found["errors"][0]["code"].startswith("config.")


def test_a_fault_has_its_line_and_key(folder):
    found = check(folder, "navigate", '[log]\npath = "log.csv"\nto_s = "late"\nfrmo_s = 1.0\n', {})
    at = {(one["line"], one["key"]) for one in found["errors"]}
    assert {(3, "log, to_s"), (4, "log, frmo_s")} <= at
    assert found["values"] == {"log.path": "log.csv", "log.to_s": "late", "log.frmo_s": 1.0}


def test_the_level_of_heights_is_asked_and_taken(folder):
    """A phone's fixes over the sea could be read by an option of the command line alone."""
    rows = "".join(
        f"{k}.0,{48.0 + 1e-5 * k:.6f},11.0,{500.0 + 0.01 * k:.2f},5.0,8.0\n" for k in range(20)
    )
    head = "time_s,lat_deg,lon_deg,altitude_msl_m,horizontal_accuracy_m,vertical_accuracy_m\n"
    (folder / "fixes.csv").write_text(head + rows)
    names, axes = ["log.csv", "fixes.csv"], "forward-left-up"
    (asked,) = (q for q in look(folder, names, {}, axes)["questions"] if q["key"] == HEIGHTS)
    assert (asked["file"], asked["free"], asked["unit"]) == ("fixes.csv", "number", "m")
    assert [one["set"] for one in asked["choices"]] == [{HEIGHTS: 0.0}]
    for level in (0.0, 48.0):
        found = look(folder, names, {HEIGHTS: level}, axes)
        assert HEIGHTS not in {one["key"] for one in found["questions"]}
        assert {("log.csv", "imu"), ("fixes.csv", "gnss")} <= {
            (one["file"], one["name"]) for one in found["streams"]
        }
        made = propose(folder, "navigate", names, {HEIGHTS: level}, axes, {})
        assert check(folder, "navigate", made["toml"], {})["values"]["aiding.gnss.path"]
        assert (
            check(folder, "navigate", made["toml"], {})["values"][f"aiding.gnss.{HEIGHTS}"] == level
        )
    # Of a kind without fixes it is no key.
    assert HEIGHTS not in propose(folder, "attitude", ["log.csv"], {HEIGHTS: 0.0}, axes, {})["toml"]


def test_what_is_proposed_is_right_and_stays_so_after_a_change(folder):
    made = propose(folder, "align", ["log.csv"], {"from_s": 0.0, "to_s": 20.0}, None, {})
    open_ = {one["key"]: one for one in made["questions"]}
    assert open_["site.lat_deg"]["free"] == "number" and open_["site.lat_deg"]["unit"] == "deg"
    answers = {"site.lat_deg": 48.0, "site.lon_deg": 11.0, "sensors.sensor": "hg9900"}
    answers |= {key: 0.0 for key in open_ if key not in answers}
    found = check(folder, "align", made["toml"], answers)
    assert comments(found["toml"]) == comments(made["toml"])
    assert not found["errors"], found["errors"]
    assert found["values"]["site.lat_deg"] == 48.0
    assert check(folder, "align", found["toml"], {})["toml"] == found["toml"]


@pytest.mark.parametrize("kind", ["attitude", "allan", "calibrate"])
def test_kinds_with_options_become_the_command_that_a_person_types(folder, kind):
    keys = {"gyro_unit": "rad/s", "columns": {"time": "time_s"}, "to_s": 20.0}
    made = propose(folder, kind, ["log.csv"], keys, "forward-left-up", {})
    if kind == "calibrate":
        with pytest.raises(ConfigError):
            command(folder, kind, "out", made["toml"], [])
        made = propose(folder, kind, ["log.csv"], keys, None, {})
    assert not check(folder, kind, made["toml"], {})["errors"]
    words = command(folder, kind, "out", made["toml"], ["--no-report"])["words"]
    reading = ["--gyro-unit", "rad/s", "--columns", "time=time_s"]
    reading += ["--axes", "forward-left-up"] if kind != "calibrate" else []
    assert words == [kind, "log.csv", *reading, "--to", "20", "--out", "out", "--no-report"]


def test_options_of_a_comparison(folder):
    text = (
        '[log]\npath = "log.csv"\n[attitude]\nrates_hz = [50.0, 25.5]\ntolerance_deg = 2.0\n'
        'algorithms = ["quaternion:order=3", "naive"]\nreference = ["end same as start", "rests"]\n'
        'gyro_bias = "-0.1,0,0 deg/s"\nlat_deg = -33.5\nlon_deg = -70.0\n'
    )
    words = command(folder, "attitude", "a b", text, [])["words"]
    assert shlex.join(words) == (
        "attitude log.csv --tolerance-deg=2.0 '--gyro-bias=-0.1,0,0 deg/s' "
        "'--algorithms=quaternion:order=3 naive' '--rates=50 25.5' --lat=-33.5 --lon=-70.0 "
        "'--reference=end same as start' --reference=rests --out 'a b'"
    )


def test_no_text_of_a_configuration_becomes_an_option(folder):
    shutil.copy(folder / "log.csv", folder / "--force")
    for value in ("--force", "-q", "--export=x.c"):
        text = (
            f'[log]\npath = "--force"\n[attitude]\ninitial = "{value}"\nreference = ["{value}"]\n'
        )
        words = command(folder, "attitude", "new", text, [])["words"]
        assert words[:2] == ["attitude", "./--force"]
        assert [w for w in words if w.startswith("-")] == [
            f"--initial={value}",
            f"--reference={value}",
            "--out",
        ]


def test_only_known_options_are_added(folder):
    for option in ("--out", "--out=/tmp/x", "--live", "-v", "--export", "--help", ""):
        with pytest.raises(ConfigError) as caught:
            command(folder, "navigate", "new", '[log]\npath = "log.csv"\n', [option])
        assert caught.value.finding.code == "studio.unknown-option"


def test_every_kind_has_a_form_whose_keys_its_configuration_takes(tmp_path):
    found = {one["kind"]: one for one in kinds(tmp_path)}
    assert list(found) == list(KINDS)
    for kind, one in found.items():
        paths = [f["path"] for section in one["schema"] for f in section["fields"]]
        assert (len(paths) == len(set(paths)) and "log.path" in paths) or kind == "crash"
        for section in one["schema"]:
            for field in section["fields"]:
                assert field["type"] in ("number", "text", "choice", "flag", "list"), field
                assert field["type"] != "choice" or field["choices"], field
    crash = {f["path"]: f for s in found["crash"]["schema"] for f in s["fields"]}
    assert crash["vehicle.mass_kg"]["unit"] == "kg" and crash["vehicle.mass_kg"]["help"]
    assert crash["units[].position_m"]["unit"] == "m"
    assert crash["units[].accelerometers[].channels"]["type"] == "list"
    assert crash["options.combine"]["type"] == "flag"
    navigate = {f["path"]: f for s in found["navigate"]["schema"] for f in s["fields"]}
    assert "known_heading" in navigate["coarse.kind"]["choices"]
    assert navigate["aiding.*.lever_arm_m"]["unit"] == "m"
    assert "adis16470" in navigate["sensors.sensor"]["choices"]


def test_units_of_keys():
    assert unit_of("speed_m_per_s") == "m/s" and unit_of("speed_km_per_h") == "km/h"
    assert unit_of("noise_density_deg_per_sqrt_h") == "" and unit_of("seed") == ""
    assert unit_of("stiffness_b_n_per_m2") == "N/m²" and unit_of("share_percent") == "%"


def test_a_form_is_made_once():
    assert form_of(KINDS["crash"].form) is form_of(KINDS["crash"].form)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_field_of_a_form_says_what_it_is(kind):
    silent = [
        field["path"]
        for section in form_of(KINDS[kind].form)
        for field in section["fields"]
        if not field["help"].strip()
    ]
    assert silent == []


def test_every_help_is_that_of_a_field():
    """None is left behind when a key is renamed."""
    known = {f["path"] for kind in KINDS.values() for s in form_of(kind.form) for f in s["fields"]}
    helps = forms._helps()
    assert set(helps["path"]) <= known
    endings = {".".join(path.split(".")[-n:]) for path in known for n in (1, 2)}
    assert set(helps["name"]) <= endings
