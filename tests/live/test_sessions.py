"""Sessions of synthetic phones: accuracy against the sent truth, and logs like any other."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.coded import coded
from tests.live.phones import EPOCH_NS, Motion, error_deg, messages, readings

import strapdown as sd
from strapdown.errors import DataError
from strapdown.formats.live_journal import JOURNAL, MAGIC
from strapdown.live.hub import Hub, StateWriter
from strapdown.live.replay import MachineClock
from strapdown.live.session import SessionOptions
from strapdown.tables import QUATERNION

#: Of roll and pitch from an accelerometer of 0.02 m/s² noise, averaged for a second of 100 Hz, and
#: of a heading from a field of 0.2 µT noise at 50 Hz over as long: 0.02 / 9.8 / √100 rad is 0.012°,
#: 0.2 / 20 / √50 rad is 0.08°. The motion is interpolated linearly at 100 Hz, which adds less. The
#: filter weighs the field by its constant error of 4°, so that a heading error of the first
#: samples, 0.2 / 20 rad = 0.6°, decays slowly.
WITHIN = 0.6


def hub_in(folder, **options):
    lines, warned = [], []
    options = {"every": 0.0, **options}
    hub = Hub(
        folder, SessionOptions(**options), MachineClock(), StateWriter(lines.append), warned.append
    )
    return hub, lines, warned


def pushed(folder, given, **options):
    """States, what the hub has, and warnings, of messages that were pushed."""
    hub, lines, warned = hub_in(folder, **options)
    for message in given:
        bad = hub.sensor_logger(json.dumps(message), "sensor-logger", hub.clock.now())
        assert bad is None
    hub.finish()
    states = [one for one in map(json.loads, lines) if "q" in one]
    return states, hub, warned


def errors(states, motion, drift=0.0):
    """Of states after the first 3 s, deg."""
    time = np.array([one["unix"] - EPOCH_NS * 1e-9 for one in states]) / (1.0 + drift)
    q = np.array([one["q"] for one in states])
    return error_deg(q[time > 3.0], motion, time[time > 3.0])


def attitude_of(folder):
    """The attitude that the other commands compute of a session, as the screen's filter."""
    found = sd.attitude(str(folder), algorithm="error-state:velocity=0.3", magnetometer="raw")
    return found[QUATERNION].to_numpy()


def same_bits(states, folder):
    shown = np.array([one["q"] for one in states])
    np.testing.assert_array_equal(shown, attitude_of(folder))


TIME = np.arange(0.0, 12.0, 0.01)


@pytest.mark.parametrize(
    ("system", "offset"), [("android", 0.0), ("android", 0.004), ("ios", 0.003)]
)
def test_the_screen_shows_the_truth_and_the_session_gives_its_bits(tmp_path, system, offset):
    motion = Motion()
    given = messages(readings(TIME, motion, system=system, offset=offset))
    states, _, _ = pushed(tmp_path, given)
    assert len(states) > 1190
    assert max(errors(states, motion)) < WITHIN
    assert {one["session"] for one in states} == {"phone-1"}
    same_bits(states, tmp_path / "phone-1")


def test_six_axes_show_roll_and_pitch_and_a_heading_from_the_start(tmp_path):
    motion = Motion(heading=0.0)
    states, _, _ = pushed(tmp_path, messages(readings(TIME, motion, mag=False)))
    assert states[-1]["heading_from"] == "the start"
    # Without a field the gyro bias, and so the heading, is known by the rest at the start alone.
    assert max(errors(states, motion)) < WITHIN
    same_bits(states, tmp_path / "phone-1")


def test_lost_late_and_repeated_messages_are_counted_and_cost_little(tmp_path):
    motion, rng = Motion(), np.random.default_rng(3)
    whole = messages(readings(TIME, motion), size=10)
    given = [one for one in whole if rng.random() > 0.05]
    lost = len(whole) - len(given)
    again = [one for k, one in enumerate(given) for _ in range(1 + (k % 50 == 20))]
    again[100], again[101] = again[101], again[100]
    states, hub, _ = pushed(tmp_path, again, reorder=0.3)
    (told,) = hub.ended
    assert told["messages_lost"] == lost
    assert told["not_used"]["message repeated"] == sum(k % 50 == 20 for k in range(len(given)))
    assert told["not_used"]["message late"] == 1
    assert told["not_used"]["repeated"] > 0
    assert "late" not in told["not_used"]
    # Between two samples the rate is linear: over 40 ms of this motion, below 0.1°.
    assert max(errors(states, motion)) < WITHIN + 0.4
    same_bits(states, tmp_path / "phone-1")


@pytest.mark.parametrize("drift", [1e-4, -1e-4])
def test_a_clock_that_drifts_scales_rates_and_no_more(tmp_path, drift):
    motion = Motion()
    states, _, _ = pushed(tmp_path, messages(readings(TIME, motion, drift=drift)))
    assert max(errors(states, motion, drift)) < WITHIN


def test_a_clock_that_goes_back_begins_another_session(tmp_path):
    values = readings(TIME, mag=False)
    back = [{**one, "time": one["time"] - 3_600_000_000_000} for one in values]
    given = [*messages(values), *messages(back, first=1000)]
    states, hub, warned = pushed(tmp_path, given)
    assert [one["session"] for one in hub.ended] == ["phone-1", "phone-1-2"]
    assert [one.code for one in warned].count("live.session-clock-back") == 1
    for name in ("phone-1", "phone-1-2"):
        same_bits([one for one in states if one["session"] == name], tmp_path / name)
    time = [one["time"] for one in states if one["session"] == "phone-1"]
    assert np.all(np.diff(time) > 0.0)


def test_phones_that_send_at_once_are_sessions_of_their_own(tmp_path):
    motions = [Motion(heading=20.0 * k) for k in range(4)]
    each = [
        messages(readings(TIME[:800], m, seed=k), device=f"phone {k}/../x", session=str(k))
        for k, m in enumerate(motions)
    ]
    together = [one for batch in zip(*each, strict=True) for one in batch]
    states, hub, _ = pushed(tmp_path, together)
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"phone-{k}-x" for k in range(4)]
    assert len(hub.ended) == 4
    for k, motion in enumerate(motions):
        own = [one for one in states if one["session"] == f"phone-{k}-x"]
        assert max(errors(own, motion)) < WITHIN
        alone, _, _ = pushed(tmp_path / f"alone{k}", each[k])
        assert [one["q"] for one in alone] == [one["q"] for one in own]


def test_a_magnetometer_that_begins_late_and_ends_early(tmp_path):
    values = readings(TIME, Motion())
    first = values[0]["time"]
    kept = [
        one for one in values if one["name"] != "magnetometer" or 4e9 < one["time"] - first < 8e9
    ]
    states, _, _ = pushed(tmp_path, messages(kept))
    assert len(states) > 1190
    same_bits(states, tmp_path / "phone-1")
    imu = sd.read_imu(tmp_path / "phone-1")
    assert 350 < imu["mag_x"].notna().sum() < 401


def test_a_session_is_a_log_by_its_folder_and_by_its_journal(tmp_path, run_cli):
    values = readings(TIME, Motion())
    stamp = values[0]["time"]
    for k in range(12):
        where = {"latitude": 45.0, "longitude": 20.0 + 1e-5 * k, "altitude": 81.0, "speed": 0.8}
        where |= {"bearing": 90.0, "horizontalAccuracy": 3.0, "verticalAccuracy": 5.0}
        fix = {"name": "location", "time": stamp + k * 10**9 + 10**8, "values": where}
        air = {"name": "barometer", "time": stamp + k * 10**9, "values": {"pressure": 1013.0}}
        values += [fix, air]
    values.sort(key=lambda one: one["time"])
    pushed(tmp_path, messages(values))
    streams = sd.read(tmp_path / "phone-1")
    assert set(streams) == {"imu", "gnss", "barometer"}
    gnss = streams["gnss"]
    assert len(gnss) == 12
    np.testing.assert_allclose(gnss["VE"], 0.8, atol=1e-12)
    np.testing.assert_allclose(gnss["down_sd"], 5.0)
    np.testing.assert_allclose(np.diff(gnss.index), 1.0, atol=1e-9)
    assert streams["imu"].attrs["clock"] == "unix"
    assert streams["imu"].attrs["clock_origin"] == stamp // 10**9
    np.testing.assert_allclose(streams["barometer"]["pressure"], 101_300.0)
    by_file = sd.read_imu(tmp_path / "phone-1" / JOURNAL)
    np.testing.assert_array_equal(by_file.to_numpy(), streams["imu"].to_numpy())
    done = run_cli("doctor", tmp_path / "phone-1", "--json", "--out", tmp_path / "doctor")
    assert done.code == 0, done.err
    # With the sign of its phone: gravity up on its back.
    assert streams["imu"]["accel_z"].iloc[:100].mean() == pytest.approx(-9.8, abs=0.05)


def test_what_a_kill_leaves_is_a_log_to_its_last_whole_record(tmp_path):
    states, _, _ = pushed(tmp_path, messages(readings(TIME, Motion())))
    folder = tmp_path / "phone-1"
    (folder / "latency.json").unlink()
    data = (folder / JOURNAL).read_bytes()
    (folder / JOURNAL).write_bytes(data[: len(data) // 2 - 3])
    again = attitude_of(folder)
    assert 500 < len(again) < 700
    shown = np.array([one["q"] for one in states[: len(again)]])
    # The last samples, which waited for a field that is cut, are used without it.
    np.testing.assert_array_equal(again[:-3], shown[:-3])
    harmed = bytearray(data)
    harmed[len(data) // 3] ^= 1
    (folder / JOURNAL).write_bytes(harmed)
    with pytest.raises(DataError, check=coded("live.journal-damaged")):
        sd.read_imu(folder)
    (folder / JOURNAL).write_bytes(MAGIC)
    with pytest.raises(DataError, check=coded("io.no-known-stream")):
        sd.read_imu(folder)


def test_the_sign_of_a_phone_is_stated_or_by_its_screen(tmp_path):
    values = readings(TIME[:500], Motion(), system="ios", mag=False)
    states, _, warned = pushed(tmp_path / "a", messages(values))
    assert "live.platform-not-stated" in [one.code for one in warned]
    assert abs(states[50]["roll"]) < 1.0
    hub, lines, warned = hub_in(tmp_path / "b")
    hub._platform = "android"
    for message in messages(values):
        hub.sensor_logger(json.dumps(message), "sensor-logger", 0.0)
    turned = [json.loads(line) for line in lines if "roll" in line]
    assert abs(turned[50]["roll"]) > 179.0
    assert "live.platform-not-stated" not in [one.code for one in warned]
    hub.finish()


def test_sessions_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr("strapdown.live.hub.MOST_SESSIONS", 3)
    hub, _, warned = hub_in(tmp_path)
    values = readings(TIME[:5])
    said = [
        hub.sensor_logger(json.dumps(m), "sensor-logger", 0.0)
        for k in range(5)
        for m in messages(values, 100, device=f"p{k}")
    ]
    assert [one is None for one in said] == [True] * 3 + [False] * 2
    assert hub.count == 3
    assert [one.code for one in warned].count("live.message-refused") == 1
    hub.finish()


def test_a_silence_is_reported_once_and_so_is_its_end(tmp_path):
    class Clock(MachineClock):
        at = 100.0

        def now(self):
            return self.at

    hub, _, warned = hub_in(tmp_path)
    hub.clock = clock = Clock()
    given = messages(readings(TIME, Motion()))

    def send(message):
        hub.sensor_logger(json.dumps(message), "sensor-logger", clock.at)
        hub._sessions[next(iter(hub._sessions))]._clock = clock

    def silences():
        found = [(one.code, one.data["seconds"]) for one in warned if "seconds" in one.data]
        warned.clear()
        return found

    send(given[0])
    hub._sessions[next(iter(hub._sessions))].last = clock.at
    for _ in range(80):
        clock.at += 0.1
        hub.report_silent()
    assert silences() == [("live.session-silent", pytest.approx(5.1, abs=0.11))]
    send(given[1])
    assert silences() == [("live.session-again", pytest.approx(8.0))]
    # A sender that pauses for 8 s is silent after three times as long.
    clock.at += 23.0
    hub.report_silent()
    assert silences() == []
    clock.at += 2.0
    hub.report_silent()
    assert silences() == [("live.session-silent", pytest.approx(25.0))]
