"""Configurations: proposed, checked, changed key by key with every comment kept, made commands."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded
from tests.studio.two_recorders import write_two_recorders
from tests.unit.config.good_case import TEXT as CASE

import strapdown as sd
from strapdown.crash.template import read_records
from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_raw
from strapdown.studio import forms
from strapdown.studio.configuration import check, command, edited, propose
from strapdown.studio.folder import Folder
from strapdown.studio.forms import form_of, kinds, unit_of
from strapdown.studio.kinds import KINDS
from strapdown.studio.look import look, stream
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


FOUND = """[entry]
speed_km_per_h = 57.090            # found: in the record, km/h
speed_sd_km_per_h = 1.0            # own words

[[units]]
# found: at rest its z points up,
# which is roll and pitch
levelling_deg = [0.10, 0.2]
angles_deg = [1.0, 2.0, 3.0]  # assumed: it looks ahead
position_m = ["?", "?", "?"]  # found: the record says 'floor'; only you know: m
"""


def test_a_value_set_by_hand_says_so_and_what_it_was():
    moved = {
        "entry.speed_km_per_h": 57.1,
        "entry.speed_sd_km_per_h": 2.0,
        "units.0.levelling_deg": [0.1, 0.3],
        "units.0.angles_deg.2": 4.0,
        "units.0.position_m": [1.0, 2.0, 3.0],
    }
    changed = edited(FOUND, moved)
    assert (
        changed
        == """[entry]
speed_km_per_h = 57.1            # set by hand; was 57.090, found: in the record, km/h
speed_sd_km_per_h = 2.0            # own words

[[units]]
# found: at rest its z points up,
# which is roll and pitch
levelling_deg = [0.1, 0.3]  # set by hand; was [0.10, 0.2]
angles_deg = [1.0, 2.0, 4.0]  # set by hand; was [1.0, 2.0, 3.0], assumed: it looks ahead
position_m = [1.0, 2.0, 3.0]  # found: the record says 'floor'; only you know: m
"""
    )
    # Once more: what it was stays what was found, which the check tells.
    again = edited(changed, {"entry.speed_km_per_h": 60, "units.0.angles_deg": [9, 9, 9]})
    assert "= 60            # set by hand; was 57.090, found: in the record, km/h" in again
    assert "= [9, 9, 9]  # set by hand; was [1.0, 2.0, 3.0], assumed: it looks ahead" in again
    # The same number without a point is no change.
    assert edited(again, {"entry.speed_km_per_h": 60.0}) == again


def test_a_measurement_of_a_simulated_case_is_no_longer_one_when_it_is_set_by_hand():
    """Its remark says by what it was measured, which a slider is not."""
    case = """[[units]]
position_m = [0.60, -0.50, 0.20]  # yours: forward, right, down, with a tape measure
angles_deg = [0.0, 0.0, 1.0]  # yours: roll, pitch, heading of the recorder against the vehicle
"""
    moved = {"units.0.position_m": [0.6, -0.4, 0.2], "units.0.angles_deg": [0.0, 0.0, 1.5]}
    changed = edited(case, moved)
    position, angles = changed.splitlines()[1:]
    was = "set by hand; was [0.60, -0.50, 0.20], yours: forward, right, down, with a tape measure"
    assert position == f"position_m = [0.6, -0.4, 0.2]  # {was}"
    assert angles.startswith("angles_deg = [0.0, 0.0, 1.5]  # set by hand; was [0.0, 0.0, 1.0], ")
    back = {"units.0.position_m": [0.6, -0.5, 0.2], "units.0.angles_deg": [0.0, 0.0, 1.0]}
    assert edited(changed, back) == case


def test_a_position_outside_of_the_vehicle_is_refused_in_the_words_of_the_form(folder):
    """By its own field and value and the size of the vehicle; no key that the form has not."""
    for position, remedy in (([-1.2, 1.9, 0.1], "check this one"), ([600, -500, 200], "meters")):
        errors = check(folder, "crash", CASE, {"units.1.position_m": position})["errors"]
        (fault,) = [e for e in errors if e["code"] == "config.position-outside-vehicle"]
        assert fault["path"] == "units.1.position_m" and fault["text"].startswith(str(position)[:5])
        assert fault["text"].endswith("m long and 1.7 m wide"), fault["text"]
        said = fault["text"] + fault["remedy"]
        assert remedy in fault["remedy"] and "{" not in said and "_m" not in said


def test_the_former_value_brings_the_former_line_back():
    there = {"entry.speed_km_per_h": 60, "units.0.levelling_deg": [1, 2], "units.0.angles_deg": [0]}
    back = {
        "entry.speed_km_per_h": 57.09,
        "units.0.levelling_deg": [0.1, 0.2],
        "units.0.angles_deg": [1, 2, 3],
    }
    assert edited(edited(FOUND, there), back) == FOUND


def test_a_check_tells_what_was_found_before(folder):
    there = {"entry.speed_km_per_h": 60, "units.0.angles_deg": [0, 0, 0]}
    found = check(folder, "crash", FOUND, there)
    was = {"entry.speed_km_per_h": 57.09, "units.0.angles_deg": [1.0, 2.0, 3.0]}
    assert found["was"] == was
    assert check(folder, "crash", FOUND, {})["was"] == {}


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


@pytest.mark.parametrize("name", ["../x", "a/b", "..", "-x", "con"])
def test_a_name_that_cannot_be_one_is_the_only_fault(folder, two_recorders, name):
    """Paths of the configuration begin at the folder, whatever the result is named."""
    text = propose(folder, "crash", two_recorders, {}, None, {})["toml"]
    fair, bad = (check(folder, "crash", text, {}, name=one) for one in ("x", name))
    assert fair["name"] is None
    assert {e["code"] for e in fair["errors"]} == {"config.open-value"}
    assert bad["errors"] == fair["errors"]
    assert bad["name"]["code"] == "studio.name-not-plain" and name in bad["name"]["text"]


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


def write_track(path):
    """A track whose heights are over the sea."""
    points = "".join(
        f'<trkpt lat="{48.0 + 1e-5 * k:.6f}" lon="11.0"><ele>500</ele>'
        f"<time>2026-01-01T00:00:{k:02d}Z</time></trkpt>"
        for k in range(20)
    )
    head = '<gpx version="1.1" creator="x" xmlns="http://www.topografix.com/GPX/1/1">'
    text = f"{head}<trk><trkseg>{points}</trkseg></trk></gpx>"
    path.write_text(text, encoding="utf-8")


def test_the_level_of_heights_is_asked_of_fixes_that_are_read_for_it_alone(folder):
    """A track whose heights are over the sea was refused, and could not be answered for."""
    write_track(folder / "track.gpx")
    for names in (["track.gpx"], ["log.csv", "track.gpx"]):
        found = look(folder, names, {}, "forward-left-up")
        asked = [q for q in found["questions"] if not q.get("optional")]
        assert [(q["key"], q["file"]) for q in asked] == [(HEIGHTS, "track.gpx")]
        found = look(folder, names, {HEIGHTS: 46.0}, "forward-left-up")
        assert HEIGHTS not in {q["key"] for q in found["questions"]}
        assert ("track.gpx", "gnss") in {(s["file"], s["name"]) for s in found["streams"]}


def trajectory(path, *, places=True, sign=1.0):
    """A file of fixes, or of a trajectory with the attitude beside."""
    rows = []
    for k in range(60):
        row = [k, 48.0 + 1e-5 * k, 11.0, 500.0, 1.11, 0.0, 0.0, 0.0, 0.0, sign * 0.1 * k]
        rows.append(",".join(f"{value:.6f}" for value in (row if places else row[:1] + row[7:])))
    head = ["time_s", "lat_deg", "lon_deg", "alt_m", "VN_m_s", "VE_m_s", "VD_m_s"]
    head = head if places else head[:1]
    head += ["roll_deg", "pitch_deg", "heading_deg"]
    path.write_text("\n".join([",".join(head), *rows]) + "\n", encoding="utf-8")


def fixes_alone(path):
    rows = [f"{k}.0,{48.0 + 1e-5 * k:.6f},11.0,500.0,1.11,0.0,0.0" for k in range(60)]
    head = "time_s,lat_deg,lon_deg,alt_m,VN_m_s,VE_m_s,VD_m_s"
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")


def proposed(folder, kind, names, **log):
    made = propose(folder, kind, names, log, "forward-left-up", {})
    return made, check(folder, kind, made["toml"], {})["values"] if made["toml"] else {}


def test_a_reference_beside_a_log_is_what_the_result_is_compared_with(folder):
    trajectory(folder / "truth.csv")
    fixes_alone(folder / "fixes.csv")
    for names in (["log.csv", "fixes.csv", "truth.csv"], ["truth.csv", "fixes.csv", "log.csv"]):
        # Fixes of their own are examined, and not the positions of the reference.
        logs = {one["name"]: one for one in look(folder, names, {}, "forward-left-up")["logs"]}
        assert logs["log.csv"]["fixes_from"] == "fixes.csv"
        made, values = proposed(folder, "navigate", names)
        assert not made["choose"]
        assert (values["log.path"], values["truth.path"]) == ("log.csv", "truth.csv")
        assert values["aiding.gnss.path"] == "fixes.csv"
        assert any("truth.csv" in text for text in made["found"])
        made, values = proposed(folder, "attitude", names)
        assert (values["log.path"], values["attitude.reference"]) == ("log.csv", ["truth.csv"])
        # What has no part in it is said to have none.
        unused = {f["file"] for f in made["findings"] if f["code"] == "studio.file-not-used"}
        assert unused == {"fixes.csv"}
        made, values = proposed(folder, "allan", names)
        assert "log.also" not in values
        assert {f["file"] for f in made["findings"]} == {"fixes.csv", "truth.csv"}


def test_an_attitude_alone_is_a_reference_for_an_attitude(folder):
    trajectory(folder / "truth.csv", places=False)
    found = look(folder, ["log.csv", "truth.csv"], {}, "forward-left-up")
    assert ("truth.csv", "reference") in {(s["file"], s["name"]) for s in found["streams"]}
    made, values = proposed(folder, "attitude", ["log.csv", "truth.csv"])
    assert values["attitude.reference"] == ["truth.csv"]
    words = command(folder, "attitude", "out", made["toml"], [])["words"]
    assert "--reference=truth.csv" in words
    # A navigation is compared with positions.
    fixes_alone(folder / "fixes.csv")
    made, values = proposed(folder, "navigate", ["log.csv", "fixes.csv", "truth.csv"])
    assert "truth.path" not in values
    said = {(f["code"], f.get("file")) for f in made["findings"]}
    assert ("studio.reference-not-used", "truth.csv") in said
    assert ("studio.file-not-used", "truth.csv") not in said


def test_which_of_several_files_is_meant_is_asked(folder):
    for name in ("one.csv", "two.csv"):
        trajectory(folder / name)
        fixes_alone(folder / f"fixes-{name}")
    shutil.copy(folder / "log.csv", folder / "other.csv")
    names = ["log.csv", "fixes-one.csv", "one.csv", "two.csv"]
    made, values = proposed(folder, "navigate", names)
    assert made["toml"] == "" and not values
    (asked,) = made["choose"]
    assert (asked["code"], asked["key"]) == ("studio.which-reference", "reference_file")
    answers = [choice["set"]["reference_file"] for choice in asked["choices"]]
    assert answers == ["one.csv", "two.csv", ""]
    for answer in answers:
        made, values = proposed(folder, "navigate", names, reference_file=answer)
        assert values.get("truth.path", "") == answer and not made["choose"]
    names = ["log.csv", "other.csv", "fixes-one.csv", "fixes-two.csv"]
    made, _ = proposed(folder, "navigate", names)
    assert [q["key"] for q in made["choose"]] == ["samples_file", "fixes_file"]
    stated = {"samples_file": "other.csv", "fixes_file": "fixes-two.csv"}
    made, values = proposed(folder, "navigate", names, **stated)
    assert (values["log.path"], values["aiding.gnss.path"]) == ("other.csv", "fixes-two.csv")
    # An answer about a file that is no longer among them is none.
    made, _ = proposed(folder, "navigate", names[:3], samples_file="gone.csv")
    assert [q["key"] for q in made["choose"]] == ["samples_file"]
    # Logs of one sensor are taken together where that is what is wanted.
    made, values = proposed(folder, "calibrate", names)
    assert not made["choose"] and values["log.also"] == ["other.csv"]


def test_a_trajectory_alone_is_fixes_or_a_reference_and_not_both(folder):
    trajectory(folder / "truth.csv")
    names = ["log.csv", "truth.csv"]
    made, _ = proposed(folder, "navigate", names)
    (asked,) = made["choose"]
    assert asked["code"] == "studio.fixes-or-reference" and len(asked["choices"]) == 2
    made, values = proposed(folder, "navigate", names, **asked["choices"][0]["set"])
    assert values["aiding.gnss.path"] == "truth.csv" and "truth.path" not in values


def test_a_proposal_reads_what_look_has_kept(folder, monkeypatch):
    from strapdown.api import doctor as module

    trajectory(folder / "truth.csv")
    names = ["log.csv", "truth.csv"]
    before = look(folder, names, {}, "forward-left-up")

    def examined(*_, **__):
        raise AssertionError("examined again")

    monkeypatch.setattr(module, "doctor", examined)
    _, values = proposed(folder, "attitude", names, from_s=1.0, to_s=50.0)
    assert values["attitude.reference"] == ["truth.csv"] and values["log.to_s"] == 50.0
    assert look(folder, names, {"reference_file": ""}, "forward-left-up") == before


def crash_files(folder):
    """Two accelerometers of a crash at their own rates, on one clock."""
    for name, step, top in (("high.csv", 1e-4, 400.0), ("low.csv", 1e-3, 80.0)):
        time = np.arange(-0.05, 0.2, step)
        pulse = -top * np.sin(np.pi * np.clip(time / 0.1, 0.0, 1.0))
        rows = np.column_stack([time, pulse, 0.1 * pulse, 0.0 * pulse])
        head = "time [s],ax [m/s2],ay [m/s2],az [g]"
        np.savetxt(folder / name, rows, "%.9g", ",", header=head, comments="")
    return ["high.csv", "low.csv"]


def test_the_channels_of_a_crash_are_drawn(folder):
    from strapdown.studio.look import stream
    from strapdown.studio.pyramid import StoredStream

    names = crash_files(folder)
    found = look(folder, names, {})
    kept = {(s["file"], s["name"]): s for s in found["streams"]}
    assert set(kept) == {("high.csv", "crash"), ("low.csv", "crash")}
    high = kept["high.csv", "crash"]
    assert high["rows"] == 2500 and high["rate_hz"] == pytest.approx(1e4)
    assert high["from_s"] == pytest.approx(-0.05)
    titles = {(c["name"], c["unit"], c["title"]) for c in high["columns"]}
    assert ("az [g]", "m/s²", "Acceleration") in titles and len(titles) == 3
    series = StoredStream(Path(stream(folder, "high.csv", "crash", {}))).series([], None, None, 50)
    extremes = series["columns"]["ax [m/s2]"]
    assert min(extremes["low"]) == pytest.approx(-400.0, rel=1e-6)
    assert max(extremes["high"]) == pytest.approx(0.0, abs=1e-9)
    # A second look, and a stream that is not there.
    assert look(folder, names, {}) == found
    for name in ("crash-2", "../crash", ".."):
        with pytest.raises((ConfigError, DataError)):
            stream(folder, "high.csv", name, {})


NHTSA = """\
----- EV5 -----
----- TEST -----
V5|a title|an aim|03/OCT/2017|MGA|DTNH|BT17|NCA|VTB|CON|DRY|22|OTH|OTH|36|0|0|0|3|none
----- INSTRUMENTATION -----
1|93|AC|NA|FLLR|XG|SEC|G'S|2800|M|D|800|21|36|-2|3|100|AM|P|LEFT REAR CROSSMEMBER
1|94|AC|NA|FLLR|ZG|SEC|G'S|2800|M|D|800|21|36|-2|3|100|AM|P|LEFT REAR CROSSMEMBER
1|95|AV|01|HDCG|YL|SEC|DPS|2800|M|D||21|36|-2|1|100|AM|P|DRIVER HEAD
----- END -----
"""


def write_nhtsa(place):
    (place / "v00042.EV5").write_text(NHTSA)
    for number, last in ((93, 4), (94, 4), (95, 2)):
        curve = "".join(f"{1e-4 * k:.6f}\t{k + 0.5}\n" for k in range(-2, last))
        (place / f"v00042.{number:03d}").write_text(curve)
    return sorted(path.name for path in place.iterdir())


def test_files_that_a_record_names_are_used(folder):
    """Ticked or named one by one, channel files are part of the record whose header is there."""
    (folder / "test").mkdir()
    files = [f"test/{name}" for name in write_nhtsa(folder / "test")]
    assert len(files) == 4
    header = files[-1]
    assert header == "test/v00042.EV5"
    every, alone = look(folder, files, {}), look(folder, [header], {})
    assert every == alone and not every["between"]
    made, of_header = (propose(folder, "crash", n, {}, None, {}) for n in (files, [header]))
    assert made["toml"] == of_header["toml"] and made["findings"] == of_header["findings"]
    assert "v00042.093" not in made["toml"]
    # The commands, too.
    paths = [str(folder / name) for name in files]
    assert [r.path.name for r in read_records(paths)] == ["v00042.EV5"]
    examined = sd.doctor(paths)
    assert [log.name for log in examined.logs] == ["v00042.EV5"] and not examined.between
    # Without the header they are what they are.
    (folder / header).unlink()
    assert len(read_records(paths[:3])) == 3


def test_what_is_no_recording_is_not_read_and_what_cannot_be_read_refuses_not_all(folder):
    names = crash_files(folder)
    (folder / "case.toml").write_text(TEXT, encoding="utf-8")
    for name, schema in (("manifest", "bundle 2"), ("scenario", "crash scenario 1")):
        said = json.dumps({"schema": f"strapdown {schema}", "a": [1, 2]}, indent=2)
        (folder / f"{name}.json").write_text(said, encoding="utf-8")
    (folder / "bad.csv").write_text("time_s,ax [g],ay [g]\n0,1,2\n1,2\n2,3,4\n")
    none = ["case.toml", "manifest.json", "scenario.json"]
    ticked = sorted([*names, *none, "bad.csv"])
    found = look(folder, ticked, {})
    assert {s["file"] for s in found["streams"]} == set(names)
    unused = [f["file"] for f in found["between"] if f["code"] == "studio.file-not-used"]
    assert unused == none
    made, plain = (propose(folder, "crash", n, {}, None, {}) for n in (ticked, names))
    assert made["toml"] == plain["toml"]
    said = {f["file"]: f["code"] for f in made["findings"]}
    assert said["bad.csv"] == "io.crash-row"
    assert all(said[name] == "studio.file-not-used" for name in none)
    # Where it is all that there is, it is refused by name.
    with pytest.raises(DataError, check=coded("io.crash-row", file="bad.csv")):
        propose(folder, "crash", ["bad.csv"], {}, None, {})
    # A list to tick has them not.
    listed = {one["name"]: one.get("recording", True) for one in Folder(folder).files()}
    assert {name for name, is_one in listed.items() if not is_one} == set(none)


def test_a_test_of_a_laboratory_is_a_record_with_the_files_that_it_names(folder):
    """The folder of a test is no log; the channels of one clock are one stream."""
    place = folder / "test"
    place.mkdir()
    write_nhtsa(place)
    found = look(folder, ["test"], {})
    (log,) = found["logs"]
    assert log["format"]["name"] == "nhtsa" and log["fit"]["crash"]["answer"] == "with limits"
    assert not log["faults"]
    first, second = found["streams"]
    assert [(s["name"], s["rows"]) for s in (first, second)] == [("crash", 6), ("crash-2", 4)]
    assert first["rate_hz"] == pytest.approx(1e4)
    place_of = "Acceleration, vehicle 1, LEFT REAR CROSSMEMBER"
    titles = [(c["name"], c["label"], c["title"], c["unit"]) for c in first["columns"]]
    assert titles == [("93", "93 x", place_of, "m/s²"), ("94", "94 z", place_of, "m/s²")]
    (rate,) = second["columns"]
    assert rate["unit"] == "rad/s" and rate["title"].startswith("Angular rate, vehicle 1, DRIVER")
    # The samples of a header are in files of their own: a change of these is another log.
    header = "test/v00042.EV5"
    before = look(folder, [header], {})["streams"]
    assert before and look(folder, [header], {})["streams"] == before
    (place / "v00042.093").write_text((place / "v00042.093").read_text().replace("0.5", "0.7"))
    after = look(folder, [header], {})["streams"]
    assert {s["key"] for s in after}.isdisjoint(s["key"] for s in before)


def test_a_part_is_no_part_of_a_case_and_that_is_said(folder):
    names = crash_files(folder)
    made = propose(folder, "crash", names, {"from_s": 0.0, "to_s": 0.1}, None, {})
    (said,) = (f for f in made["findings"] if f["code"] == "studio.part-not-used")
    assert "0 to 0.1 s" in said["text"] and made["toml"]
    made = propose(folder, "crash", names, {}, None, {})
    assert "studio.part-not-used" not in {f["code"] for f in made["findings"]}


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


def test_stretches_are_of_the_samples_of_their_own_file(folder):
    rows = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
    head = (folder / "log.csv").read_text().partition("\n")[0]

    def written(name, shift, push):
        other = rows.copy()
        other[:, 0] += shift
        other[:, 4] += push
        np.savetxt(folder / name, other, "%.9g", ",", header=head, comments="")

    written("late.csv", 5.0, 0.0)
    written("pushed.csv", 0.0, 4.0)
    found = look(folder, ["log.csv", "late.csv", "pushed.csv"], {}, "forward-right-down")
    spans = {s["file"]: (s["rests"], s["steady"]) for s in found["streams"]}
    (rest,) = spans["log.csv"][0]
    assert rest == pytest.approx([0.0, 20.0], abs=1.0) and not spans["log.csv"][1]
    assert spans["late.csv"][0] == [pytest.approx([rest[0] + 5.0, rest[1] + 5.0])]
    # A steady acceleration of 4 m/s² neither turns nor shakes, and is no rest.
    assert spans["pushed.csv"] == ([], [pytest.approx(rest)])
    assert found["rests"] == [rest]


def test_what_look_finds_names_no_option_of_the_command_line(folder):
    found = look(folder, ["log.csv"], {})
    # The options are for the command that the page shows.
    del found["logs"][0]["options"]
    said = json.dumps(found)
    assert "io.sampling-taken-as-instantaneous" in said
    assert not re.search(r"(?<![\w-])--[a-z]", said)


def test_what_nobody_stated_is_not_said_to_be_stated(folder):
    """The reason of a unit or a column that was inferred to go on, and of one that was stated."""
    head, *lines = (folder / "log.csv").read_text(encoding="utf-8").splitlines()
    rows = np.array([[float(x) for x in line.split(",")] for line in lines])
    # Turns by 30 units of it a second about x, while gravity does not: no rad/s.
    rows[:, 1:4] *= 57.3
    rows[:, 1] = 30.0 * np.sin(3.0 * rows[:, 0]) * (rows[:, 0] > 20.0)
    head = head.replace("_rad_s", "")
    np.savetxt(folder / "open.csv", rows, "%.9g", ",", header=head, comments="")

    def reasons(log):
        found = look(folder, ["open.csv"], log)
        asked = [q["key"] for q in found["questions"] if not q.get("optional")]
        return asked, {r["quantity"]: r["why"] for r in found["logs"][0]["read_as"]}

    asked, inferred = reasons({})
    assert asked == ["gyro_unit"]
    assert "unit inferred, not yet confirmed" in inferred["gyro_x"]
    assert "stated by" not in inferred["gyro_x"] + inferred["accel_x"]
    asked, stated = reasons({"gyro_unit": "rad/s"})
    assert asked == [] and "unit stated by the user" in stated["gyro_x"]
    columns = {"gyro_x": "gyro_x", "gyro_y": "gyro_y", "gyro_z": "gyro_z"}
    # Without a likely one, too, the unit is asked by clicks.
    few = rows * np.r_[1.0, 0.0, 1.0 / 57.3, 1.0 / 57.3, 1.0, 1.0, 1.0]
    np.savetxt(folder / "few.csv", few, "%.9g", ",", header=head, comments="")
    (ask,) = [q for q in look(folder, ["few.csv"], {})["questions"] if not q.get("optional")]
    assert (ask["key"], ask["code"]) == ("gyro_unit", "io.unit-undecided")
    assert {one["set"]["gyro_unit"] for one in ask["choices"]} >= {"rad/s", "deg/s"}
    _, named = reasons({"gyro_unit": "rad/s", "columns": columns})
    assert named["gyro_x"].startswith("stated by the user")


def test_a_folder_of_two_recorders_is_its_files(folder):
    """Ticked as a folder it gives what its files give that are ticked one by one."""
    rows = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
    head = (folder / "log.csv").read_text().partition("\n")[0]
    rows[:, 4] -= 100.0 * ((rows[:, 0] > 30.0) & (rows[:, 0] < 30.1))
    (folder / "two").mkdir()
    for k, name in enumerate(("one.csv", "other.csv")):
        rows[:, 0] += 5.0 * k
        np.savetxt(folder / "two" / name, rows, "%.9g", ",", header=head, comments="")
    (folder / "two" / "notes.txt").write_text("It rained.\n")
    files = ["two/one.csv", "two/other.csv"]
    by_folder, by_files = (look(folder, names, {}) for names in (["two"], files))
    left = [f["file"] for f in by_folder["between"] if f["code"] == "studio.file-not-used"]
    assert left == ["two/notes.txt"]
    assert not [f for f in by_files["between"] if f["code"] == "studio.file-not-used"]
    assert [s["file"] for s in by_folder["streams"]] == files
    assert by_folder["streams"] == by_files["streams"]
    made, one_by_one = (propose(folder, "crash", n, {}, None, {}) for n in (["two"], files))
    assert made["toml"] == one_by_one["toml"] and made["toml"].count("[[units]]") == 2
    unused = [f["file"] for f in made["findings"] if f["code"] == "studio.file-not-used"]
    assert unused == ["two/notes.txt"]


@pytest.fixture
def two_recorders(folder):
    """Names of the logs of two recorders in the folder."""
    return write_two_recorders(folder)


def test_an_answer_about_one_recorder_is_of_it_alone(folder, two_recorders):
    asked = [q for q in look(folder, two_recorders, {})["questions"] if q["key"] == "axes"]
    assert [q["file"] for q in asked] == two_recorders
    said = {"files": {"one.csv": {"axes": "forward-left-up"}}}
    one = look(folder, two_recorders, said)
    assert [q["file"] for q in one["questions"] if q["key"] == "axes"] == ["other.csv"]
    own, other = (s["key"] for s in one["streams"])
    assert own == look(folder, ["one.csv"], {}, "forward-left-up")["streams"][0]["key"]
    assert other == look(folder, ["other.csv"], {})["streams"][0]["key"]
    # What a curve is drawn of is what was looked at.
    assert stream(folder, "one.csv", "imu", said).endswith(f"{own}/imu")
    assert stream(folder, "other.csv", "imu", said).endswith(f"{other}/imu")


def test_recorders_that_are_mounted_in_two_ways_have_their_angles_in_the_case(
    folder, two_recorders
):
    axes = {"one.csv": "forward-left-up", "other.csv": "right-forward-up"}
    said = {"files": {name: {"axes": text} for name, text in axes.items()}}
    made = propose(folder, "crash", two_recorders, said, None, {})
    units = tomllib.loads(made["toml"])["units"]
    by_file = {one["accelerometers"][0]["path"]: one["angles_deg"] for one in units}
    # Roll, pitch, heading of these right angles: by hand.
    assert by_file == {"one.csv": [180.0, 0.0, 0.0], "other.csv": [180.0, 0.0, 90.0]}
    assert not [q for q in made["questions"] if q["key"].endswith("angles_deg")]
    # Both have the force from the front, somewhat from the left: its pulse pushes to the right.
    assert [q["text"].endswith("came from the front") for q in made["to_check"]] == [True, True]
    for kind in ("navigate", "attitude"):
        alone = propose(folder, kind, ["other.csv"], said, None, {})["toml"]
        assert tomllib.loads(alone)["axes"]["axes"] == "right-forward-up"


def test_axes_of_a_recorder_that_gravity_contradicts_are_not_taken(folder, two_recorders):
    said = {"files": {"one.csv": {"axes": "forward-right-down"}}}
    made = propose(folder, "crash", ["one.csv"], said, None, {})
    assert "crash.axes-against-gravity" in [f["code"] for f in made["findings"]]
    assert tomllib.loads(made["toml"])["units"][0]["angles_deg"] == [180.0, 0.0, "?"]


def test_each_question_of_a_case_is_answered_in_its_range_and_can_be_asked_again(
    folder, two_recorders
):
    made = propose(folder, "crash", ["one.csv"], {}, None, {})
    asked = {one["key"]: one for one in made["questions"]}
    assert asked["vehicle.mass_kg"]["example"] == "1450"
    assert asked["units.0.position_m"]["example"] == "[0.62, -0.45, 0.2]"
    headings = [one["set"] for one in asked["units.0.angles_deg"]["choices"]]
    assert headings == [{"units.0.angles_deg": one} for one in (0, 90, 180, -90)]

    def wrong(answer):
        found = check(folder, "crash", made["toml"], answer)["errors"]
        open_ = {one["path"] for one in found if one["code"] == "config.open-value"}
        assert open_ == set(asked) - set(answer)
        return [one["path"] for one in found if one["code"] != "config.open-value"]

    # While others are open: the range of each, and no word of what is open.
    assert wrong({"vehicle.mass_kg": 1450}) == []
    assert wrong({"vehicle.mass_kg": -5}) == ["vehicle.mass_kg"]
    assert wrong({"entry.speed_sd_km_per_h": -3}) == ["entry.speed_sd_km_per_h"]
    assert wrong({"units.0.angles_deg": [0, 0, 1000]}) == ["units.0.angles_deg.2"]
    for key, one in asked.items():
        answered = edited(made["toml"], {key: 1.5})
        assert answered != made["toml"]
        again = edited(answered, {key: one["open"]})
        assert tomllib.loads(again) == tomllib.loads(made["toml"]), key


def test_all_that_a_case_assumes_is_listed(folder, two_recorders):
    made = propose(folder, "crash", two_recorders, {}, None, {})
    listed = {one["key"] for one in made["to_check"] + made["assumed"]}
    assert {"vehicle.length_m", "entry.time_s", "units.0.position_sd_m"} <= listed
    assert {"units.1.accelerometers.0.uncertainty", "units.1.gyro.uncertainty"} <= listed
    assert len(made["assumed"]) == len(re.findall(r"# assumed\b", made["toml"]))


def test_left_handed_axes_of_a_recorder_reverse_its_third_channel(folder, two_recorders):
    rows = np.loadtxt(folder / "one.csv", delimiter=",", skiprows=1)
    head = (folder / "one.csv").read_text().partition("\n")[0]
    rows[:, [3, 6]] *= -1.0
    np.savetxt(folder / "left.csv", rows, "%.9g", ",", header=head, comments="")
    said = {"files": {"left.csv": {"axes": "forward-left-down"}}}
    made = propose(folder, "crash", ["left.csv"], said, None, {})
    (unit,) = tomllib.loads(made["toml"])["units"]
    assert unit["angles_deg"] == [180.0, 0.0, 0.0]
    triads = (unit["accelerometers"][0], unit["gyro"])
    assert [t["channels"]["z"] for t in triads] == ["-accel_z_m_s2", "-gyro_z_rad_s"]


def test_what_a_case_does_not_take_of_an_answer_is_said(folder, two_recorders):
    said = {"files": {"one.csv": {"rate_hz": 100.0}}}
    made = propose(folder, "crash", two_recorders, said, None, {})
    assert [f["file"] for f in made["findings"] if f["code"] == "studio.reading-not-used"] == [
        "one.csv"
    ]


@pytest.mark.parametrize(
    "files", [["one.csv"], {"one.csv": "x"}, {"one.csv": {"no_such": 1}}, {"one.csv": {"axes": 3}}]
)
def test_keys_of_files_that_are_none(folder, two_recorders, files):
    with pytest.raises(ConfigError):
        look(folder, two_recorders, {"files": files})


def test_logs_of_one_sensor_are_read_alike(folder, two_recorders):
    said = {"files": {"other.csv": {"axes": "right-forward-up"}}}
    made = propose(folder, "allan", two_recorders, said, None, {})
    assert [f["file"] for f in made["findings"] if f["code"] == "studio.read-as-the-first"] == [
        "other.csv"
    ]


def test_a_folder_with_one_recording_among_other_files_is_that_recording(folder):
    (folder / "one").mkdir()
    shutil.copyfile(folder / "log.csv", folder / "one" / "log.csv")
    (folder / "one" / "LICENSE").write_text("MIT\n")
    found = look(folder, ["one"], {}, "forward-right-down")
    assert [s["file"] for s in found["streams"]] == ["one/log.csv"]
    assert [f["file"] for f in found["between"]] == ["one/LICENSE"]
    made = propose(folder, "attitude", ["one"], {}, None, {})
    assert tomllib.loads(made["toml"])["log"]["path"] == "one/log.csv"


def test_fixes_beside_the_recording_of_a_folder_come_along(folder):
    """A folder gives what its log and its fixes give that are ticked one by one."""
    (folder / "one").mkdir()
    shutil.copyfile(folder / "log.csv", folder / "one" / "log.csv")
    (folder / "one" / "LICENSE").write_text("MIT\n")
    (folder / "one" / "events.csv").write_text("time_s,event\n1.0,begin\n2.0,end\n")
    rows = "".join(f"{k},{48.0 + 1e-5 * k},11.0,500.0\n" for k in range(60))
    (folder / "one" / "fixes.csv").write_text("time_s,lat_deg,lon_deg,height_m\n" + rows)
    by_folder, files = look(folder, ["one"], {}), ["one/log.csv", "one/fixes.csv"]
    assert by_folder["streams"] == look(folder, files, {})["streams"]
    assert ("one/fixes.csv", "gnss") in {(s["file"], s["name"]) for s in by_folder["streams"]}
    unused = ["one/LICENSE", "one/events.csv"]
    assert [f["file"] for f in by_folder["between"] if "not-used" in f["code"]] == unused
    made, one_by_one = (propose(folder, "navigate", n, {}, None, {}) for n in (["one"], files))
    assert made["toml"] == one_by_one["toml"] and '"one/fixes.csv"' in made["toml"]
    assert [f["file"] for f in made["findings"] if "not-used" in f["code"]] == unused
    # Heights whose level only a person knows are asked about, of a folder, too.
    (folder / "one" / "fixes.csv").unlink()
    write_track(folder / "one" / "track.gpx")
    asked = look(folder, ["one"], {})["questions"]
    assert ("one/track.gpx", HEIGHTS) in {(q["file"], q["key"]) for q in asked}


def test_files_of_samples_and_of_fixes_in_a_folder_are_used(folder):
    """A folder of arrays, of the inertial sensors and of a receiver; one array is of neither."""
    arrays = folder / "segment"
    arrays.mkdir()
    time = np.arange(0.0, 10.0, 0.01)
    samples = {"gyro": np.zeros(3), "accelerometer": np.array([0.0, 0.0, 9.8])}
    for kind, value in samples.items():
        np.save(arrays / f"IMU__{kind}__t.npy", time)
        np.save(arrays / f"IMU__{kind}__value.npy", np.tile(value, (time.size, 1)))
    date = 1.5e9 * 1e3 + 100.0 * np.arange(100)
    fixes = np.column_stack([np.full((100, 6), [48.0, 11.0, 0.0, date[0], 500.0, 0.0])])
    fixes[:, 3] = date
    np.save(arrays / "GNSS__live_gnss_ublox__t.npy", time[::10])
    np.save(arrays / "GNSS__live_gnss_ublox__value.npy", fixes)
    np.save(arrays / "CAN__speed__t.npy", time)
    found = look(folder, ["segment"], {})
    assert "imu" in {one["name"] for one in found["streams"]}
    unused = [f["file"] for f in found["between"] if f["code"] == "studio.file-not-used"]
    assert unused == ["segment/CAN__speed__t.npy"]
    # The samples are sealed with what they were read from.
    read = {path.name for path in read_raw(arrays).files}
    assert {"IMU__gyro__value.npy", "IMU__accelerometer__value.npy"} <= read


def test_files_of_a_folder_have_its_name_in_what_is_found(folder):
    """Gaps and formats are listed by the name that the streams have, of two files alike, too."""
    rows = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
    head = (folder / "log.csv").read_text().partition("\n")[0]
    with_gap = rows[(rows[:, 0] < 30.0) | (rows[:, 0] > 34.0)]
    for name, some in (("one", with_gap), ("other", rows)):
        (folder / name).mkdir()
        np.savetxt(folder / name / "log.csv", some, "%.9g", ",", header=head, comments="")
    found = look(folder, ["one/log.csv", "other/log.csv"], {}, "forward-right-down")
    assert [one["name"] for one in found["logs"]] == [s["file"] for s in found["streams"]]
    assert [one["streams"][0]["gaps"] for one in found["logs"]] == [1, 0]


def test_what_is_steady_before_an_impact_may_be_a_drive(folder):
    rows = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
    head = (folder / "log.csv").read_text().partition("\n")[0]
    rows[:, 4] -= 100.0 * ((rows[:, 0] > 30.0) & (rows[:, 0] < 30.1))
    np.savetxt(folder / "hit.csv", rows, "%.9g", ",", header=head, comments="")
    found = look(folder, ["hit.csv"], {}, "forward-right-down")
    (samples,) = found["streams"]
    assert samples["rests"] == [] and samples["steady"] == found["rests"] != []


@pytest.fixture
def walk(folder):
    """A log of a phone in the hand, never at rest, with a field like that of the Earth; fixes."""
    time = np.arange(0.0, 30.0, 0.01)
    rng = np.random.default_rng(3)
    sway = 0.2 * np.sin(9.0 * time)
    # Forward, right, down, with the front to the east; 24 µT to the north, 40 µT down.
    rows = np.column_stack([time, 0 * time, sway, sway, sway, 0 * time, sway - 9.8])
    rows[:, 1:] += 0.02 * rng.standard_normal((time.size, 6))
    field = np.array([0.0, -24.0, 40.0]) + 0.1 * rng.standard_normal((time.size, 3))
    head = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    head += ",mag_x_uT,mag_y_uT,mag_z_uT"
    whole = np.column_stack([rows, field])
    np.savetxt(folder / "walk.csv", whole, "%.9g", ",", header=head, comments="")
    stamps = np.arange(0.0, 30.0)
    fixes = [stamps, 34.0 + 0 * stamps, -118.0 + 1e-5 * stamps, 100.0 + 0 * stamps]
    head = "time_s,lat_deg,lon_deg,alt_m"
    np.savetxt(folder / "fixes.csv", np.column_stack(fixes), "%.9f", ",", header=head, comments="")
    return ["walk.csv", "fixes.csv"]


def test_the_heading_of_a_magnetometer_is_offered_where_it_is_asked(folder, walk):
    made = propose(folder, "navigate", walk, {}, "forward-right-down", {})
    offers = {q["key"]: q["choices"][0]["set"] for q in made["offers"]}
    asked = [q["key"] for q in made["questions"]]
    assert asked == ["coarse.heading_deg", "coarse.sd_deg"]
    start, aid = offers["coarse.heading_deg"], offers["aiding.magnetometer.kind"]
    declination = np.degrees(np.arctan2(*aid["aiding.magnetometer.field_ned_ut"][1::-1]))
    assert abs(start["coarse.heading_deg"] - 90.0 - declination) < 3.0 * start["coarse.sd_deg"]
    assert start["coarse.sd_deg"] >= 5.0
    # Clicked, it answers both questions; the table is that of the comment in the file.
    text = edited(made["toml"], start)
    assert not re.search(r'^\s*[a-z_]+ = "\?"', text, re.MULTILINE)
    table = tomllib.loads(edited(made["toml"], aid))["aiding"]["magnetometer"]
    assert table["kind"] == "magnetometer"
    assert f"# field_ned_ut = {table['field_ned_ut']}" in made["toml"]


def test_a_sensor_on_a_shoe_is_asked_about_where_there_are_no_fixes(folder, walk):
    made = propose(folder, "navigate", ["log.csv"], {}, "forward-right-down", {})
    (question,) = made["again"]
    assert question["choices"][0]["set"] == {"foot": True}
    again = propose(folder, "navigate", ["log.csv"], {"foot": True}, "forward-right-down", {})
    assert "[aiding.stance]" in again["toml"] and "[aiding.stance]" not in made["toml"]
    assert again["again"][0]["choices"][0]["set"] == {"foot": None}
    assert not propose(folder, "navigate", walk, {}, "forward-right-down", {})["again"]


def test_a_configuration_of_the_folder_is_offered_for_its_files(folder):
    made = propose(folder, "allan", ["log.csv"], {}, None, {})
    (folder / "mine.toml").write_text(made["toml"])
    (folder / "open.toml").write_text(f'{made["toml"]}\n[axes]\naxes = "?"\n')
    (folder / "else.toml").write_text(made["toml"].replace("log.csv", "else.csv"))
    (folder / "none.toml").write_bytes(b"\xff\x00")
    ready = propose(folder, "allan", ["log.csv"], {}, None, {})["ready"]
    assert [(one["name"], one["toml"]) for one in ready] == [("mine.toml", made["toml"])]
    assert not propose(folder, "attitude", ["log.csv"], {}, None, {})["ready"]
