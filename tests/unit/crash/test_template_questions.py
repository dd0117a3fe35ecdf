"""What a draft asks, or gives to confirm, rather than take a guess for granted."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

from strapdown import rotation
from strapdown.crash.template import TURNS, draft_case, read_records
from strapdown.errors import DataError
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels

RATE = 500.0


def written(folder, name, heads, columns, form="%.6f"):
    path = folder / name
    np.savetxt(
        path, np.column_stack(columns), fmt=form, delimiter=",", header=",".join(heads), comments=""
    )
    return path


@pytest.fixture
def crash():
    """Time, specific force and rates (forward, right, down) of a car struck from the front.

    36 km/h are lost in 0.1 s from 2 s on, and it then turns to the right at 60 deg/s: 30 deg in
    half a second.
    """
    time = np.arange(0.0, 3.0, 1.0 / RATE)
    rng = np.random.default_rng(2)
    force = rng.normal((0.0, 0.0, -9.80665), 0.05, (time.size, 3))
    blow = (time > 2.0) & (time < 2.1)
    force[blow, 0] -= 200.0 * np.sin(np.pi * (time[blow] - 2.0) / 0.1) ** 2
    rates = rng.normal(0.0, 0.002, (time.size, 3))
    rates[time > 2.0, 2] += np.radians(60.0)
    return time, force, rates


def drafted(folder, *paths):
    draft = draft_case(read_records(paths), folder=folder)
    return draft, tomllib.loads(draft.text)


def test_a_yaw_rate_is_asked_which_way_it_counts(crash, tmp_path):
    time, force, rates = crash
    heads = ["t_s", "ax", "ay", "az", "yaw_rate", "pitch_rate", "roll_rate"]
    path = written(tmp_path, "r.csv", heads, [time, force, rates[:, ::-1]])
    draft, table = drafted(tmp_path, path)
    channels = table["units"][0]["gyro"]["channels"]
    assert channels == {"x": "roll_rate", "y": "pitch_rate", "z": "?"}
    (asked,) = [a for a in draft.asked if a.key == "channels"]
    # 60 deg/s for half a second; time zero is found within 20 ms, which makes 1.2 deg.
    assert "turned to the right" in asked.what
    assert any(f"({n} deg to the right)" in asked.what for n in (28, 29, 30, 31))


def test_a_gyro_with_axes_is_given_to_confirm(crash, tmp_path):
    time, force, rates = crash
    heads = ["t_s", "ax", "ay", "az", "wx_rad_s", "wy_rad_s", "wz_rad_s"]
    draft, _ = drafted(tmp_path, written(tmp_path, "r.csv", heads, [time, force, rates]))
    told = {c.key: c.what for c in draft.to_check}
    assert "deg to the right, seen from above" in told["channels"]
    # That x is called x does not tell that it points forward.
    (asked,) = [a for a in draft.asked if a.key == "angles_deg"]
    assert "0 (its x points forward) makes it an impact from the front" in asked.what
    lines = draft.text.splitlines()
    for check in draft.to_check:
        assert lines[check.line - 1].startswith(f"{check.key} = ")


def test_rounded_stamps_get_the_rate_of_their_clock(crash, tmp_path):
    """2.5 ms steps in whole ms are 2 and 3: no even stamps, and no reason to refuse the record."""
    time, force, _ = crash
    ticks = np.round(np.arange(time.size) * 2.5)
    path = written(tmp_path, "r.csv", ["t_ms", "ax", "ay", "az"], [ticks, force])
    _, table = drafted(tmp_path, path)
    (part,) = table["units"][0]["accelerometers"]
    # The line goes through the first and the last stamp, each rounded by up to half a tick.
    assert part["rate_hz"] == pytest.approx(400.0, rel=1.0 / (2.5 * time.size))
    assert (part["time"], part["time_unit"]) == ("t_ms", "ms")


def test_even_stamps_state_no_rate(crash, tmp_path):
    time, force, _ = crash
    _, table = drafted(
        tmp_path, written(tmp_path, "r.csv", ["t_s", "ax", "ay", "az"], [time, force])
    )
    assert "rate_hz" not in table["units"][0]["accelerometers"][0]


def test_a_path_is_a_reference(crash, tmp_path):
    time, force, _ = crash
    record = written(tmp_path, "r.csv", ["t_s", "ax", "ay", "az"], [time, force])
    since = np.arange(-0.1, 0.7, 0.01)
    heads = ["time [s]", "north [m]", "east [m]", "down [m]"]
    film = written(tmp_path, "film.csv", heads, [since, since * 5, since * 0, since * 0])
    draft, table = drafted(tmp_path, record, film)
    (reference,) = table["references"]
    assert (reference["kind"], reference["path"]) == ("path", "film.csv")
    assert not [s for s in draft.left_out if s.path == "film.csv"]


def test_a_path_on_another_clock_stays_a_comment(crash, tmp_path):
    time, force, _ = crash
    record = written(tmp_path, "r.csv", ["t_s", "ax", "ay", "az"], [time, force])
    heads = ["time [s]", "north [m]", "east [m]", "down [m]"]
    film = written(tmp_path, "film.csv", heads, [time + 100.0, time, time * 0, time * 0])
    draft, table = drafted(tmp_path, record, film)
    assert "references" not in table
    assert "must count from the trigger" in " ".join(draft.text.split("\n# "))


def turned(force, heading_deg):
    """What a unit at this heading measures, its z down."""
    return force @ rotation.dcm_from_euler((0.0, 0.0, heading_deg))


def angles_asked(draft, table):
    (asked,) = [a.what for a in draft.asked if a.key == "angles_deg"] or [""]
    return table["units"][0]["angles_deg"], asked


@pytest.mark.parametrize("heading", TURNS)
def test_the_heading_of_a_zeroed_record_is_asked_and_what_each_would_mean(crash, tmp_path, heading):
    """No unit and no gravity: a unit turned by 90 deg was told as a blow from 8 o'clock."""
    time, force, _ = crash
    force = turned(force - [0.0, 0.0, -9.80665], heading)
    path = written(tmp_path, "r.csv", ["t_s", "x", "y", "z"], [time, force])
    found, asked = angles_asked(*drafted(tmp_path, path))
    assert found == ["?", "?", "?"]
    # The blow came from the front: the heading with which it does is the one it has.
    assert "gravity is not in it" in asked
    (front,) = re.findall(r"(-?\d+) makes it an impact from the front", asked)
    assert float(front) == heading


@pytest.mark.parametrize("heading", TURNS)
def test_gravity_tells_roll_and_pitch_and_no_heading(crash, tmp_path, heading):
    time, force, _ = crash
    path = written(tmp_path, "r.csv", ["t_s", "ax", "ay", "az"], [time, turned(force, heading)])
    found, asked = angles_asked(*drafted(tmp_path, path))
    assert found == [0.0, 0.0, "?"]
    assert re.search(
        rf"{heading:g} \(its x points [a-z ]+\) makes it an impact from the front", asked
    )


def test_headings_that_name_directions_define_the_axes(crash, tmp_path):
    time, force, _ = crash
    heads = ["t_s", *(f"{w} acceleration [m/s2]" for w in ("longitudinal", "lateral", "vertical"))]
    draft, table = drafted(tmp_path, written(tmp_path, "r.csv", heads, [time, force]))
    assert angles_asked(draft, table) == ([0.0, 0.0, 0.0], "")
    assert "found: its headings name directions of the vehicle" in " ".join(
        draft.text.split("\n# ")
    )
    told = {c.key: c.what for c in draft.to_check}
    assert "the impact came from the front" in told["angles_deg"]


def of_day(seconds, part=12):
    """Times of day, ``23:59:59.998``, to so many characters."""
    return [
        f"{int(s // 3600):02d}:{int(s % 3600 // 60):02d}:{s % 60:09.6f}"[:part]
        for s in np.mod(seconds + 1e-7, 86400.0)
    ]


@pytest.mark.parametrize("base", [36930.0, 86398.5, 86397.0], ids=["morning", "before", "midnight"])
@pytest.mark.parametrize(
    ("head", "stamps", "lasts"),
    [
        # Each lasts beyond midnight; whole seconds give a rate over a longer record.
        ("time", of_day, 4.0),
        ("time", lambda t: of_day(t, 8), 6.0),
        ("time_s", lambda t: [f"{s:.3f}" for s in np.mod(t + 1e-7, 86400.0)], 4.0),
        ("time_s", lambda t: [str(int(s)) for s in np.mod(t + 1e-7, 86400.0)], 6.0),
        ("time_ms", lambda t: [str(round(1e3 * s)) for s in np.mod(t, 86400.0)], 4.0),
        ("time_us", lambda t: [str(round(1e6 * s)) for s in np.mod(t, 86400.0)], 4.0),
    ],
    ids=["h:m:s.ms", "h:m:s", "seconds", "whole seconds", "ms", "us"],
)
def test_times_of_day_are_a_clock_with_the_trigger_inside(
    crash, tmp_path, head, stamps, lasts, base
):
    _, force, _ = crash
    time = np.arange(0.0, lasts, 1.0 / RATE)
    force = np.vstack([force, np.tile([0.0, 0.0, -9.80665], (time.size - len(force), 1))])
    told = stamps(base + time)
    rows = [f"{t},{x:.5f},{y:.5f},{z:.5f}" for t, (x, y, z) in zip(told, force, strict=True)]
    path = tmp_path / "r.csv"
    path.write_text("\n".join([f"{head},ax [m/s2],ay [m/s2],az [m/s2]", *rows]) + "\n")
    _, table = drafted(tmp_path, path)
    (unit,) = table["units"]
    part = unit["accelerometers"][0]
    found = triad_of_channels(
        read_crash_record(path),
        part["channels"],
        quantity="acceleration",
        unit=part["unit"],
        time=part["time"],
        time_unit=part["time_unit"],
        rate_hz=part.get("rate_hz"),
    )
    clock = found.index.to_numpy()
    assert clock.size == time.size and (np.diff(clock) > 0.0).all()
    # Whole seconds: the clock begins with the second of the first sample.
    assert clock[0] == pytest.approx(base, abs=0.51 if len(told[0]) <= 8 else 1e-3)
    # The blow begins 2 s after the first sample, and time zero up to 20 ms before it.
    assert -0.021 <= unit["trigger_s"] - clock[0] - 2.0 <= 0.01
    assert clock[0] < unit["trigger_s"] < clock[-1]


def test_records_that_were_joined_are_no_midnight(crash, tmp_path):
    time, force, _ = crash
    path = written(tmp_path, "r.csv", ["time_s", "ax", "ay", "az"], [36930.0 + time, force])
    rows = path.read_text().splitlines()
    path.write_text("\n".join([*rows, *rows[1:]]) + "\n")
    with pytest.raises(DataError):
        drafted(tmp_path, path)
