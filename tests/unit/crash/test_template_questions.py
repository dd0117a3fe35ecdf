"""What a draft asks, or gives to confirm, rather than take a guess for granted."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from strapdown.crash.template import draft_case, read_records

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
    assert "the blow came from the front" in told["angles_deg"]
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
