"""Navigation of a phone by its own fixes: what the screen showed is what its session gives."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from tests.live.phones import EPOCH_NS, Motion, messages, readings

import strapdown as sd
from strapdown.config.navigation import NavigationSpec
from strapdown.live.hub import Hub, StateWriter
from strapdown.live.replay import MachineClock
from strapdown.live.run import replay_session, result_of
from strapdown.live.session import SessionOptions
from strapdown.tables import EULER

CONFIG = """
[live]
[sensors]
sensor = "icm-42688-p"
[start]
lat_deg = 45.0
lon_deg = 20.0
alt_m = 81.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 30.0
[aiding.gnss]
velocity_sd_m_per_s = 0.3
"""


def phone(seconds):
    """A phone that is turned in hand where it is, with fixes each second."""
    rng = np.random.default_rng(5)
    values = readings(np.arange(0.0, seconds, 0.01), Motion(), mag=False)
    for k in range(int(seconds)):
        north, east, down = rng.normal(0.0, 1.0, 3)
        where = {
            "latitude": 45.0 + north / 111_132.0,
            "longitude": 20.0 + east / (111_320.0 * math.cos(math.radians(45.0))),
            "altitude": 81.0 - 2.0 * down,
            "speed": 0.05 if k % 3 else -1.0,  # now and then not known
            "bearing": 10.0 * k if k % 3 else -1.0,
            "speedAccuracy": 0.3,
            "horizontalAccuracy": 1.5,
            "verticalAccuracy": 2.0,
        }
        stamp = EPOCH_NS + 300_000_000 + k * 10**9
        values.append({"name": "location", "time": stamp, "values": where})
    return sorted(values, key=lambda one: one["time"])


@pytest.mark.slow
def test_a_phone_navigates_and_its_session_gives_the_same_states(tmp_path):
    config = tmp_path / "run.toml"
    config.write_text(CONFIG)
    spec, lines, warned = NavigationSpec.read(config), [], []
    hub = Hub(
        tmp_path / "out",
        SessionOptions(spec, every=0.0),
        MachineClock(),
        StateWriter(lines.append),
        warned.append,
    )
    for message in messages(phone(15.0)):
        assert hub.sensor_logger(json.dumps(message), "sensor-logger", hub.clock.now()) is None
    hub.finish()
    (told,) = hub.ended
    assert (told["error"], told["late"]) == (None, {})
    states = [one for one in map(json.loads, lines) if one.get("lat") is not None]
    assert len(states) > 1300
    # The truth stays where it is: three standard deviations of the filter's own, the fixes' of 1 m.
    last = states[-1]
    assert abs(last["lat"] - 45.0) * 111_132.0 < 3.0 * last["north_sd"] < 6.0
    truth = np.degrees(Motion().angles(np.array([last["unix"] - EPOCH_NS * 1e-9])))[0]
    for name, value in zip(EULER[:2], truth, strict=False):
        assert abs(last[name] - value) < 1.0, name
    # Axes are those of a phone, as nothing else is stated.
    run = json.loads((tmp_path / "out" / "phone-1" / "run.json").read_text())
    assert run["configuration"]["axes"] == {"axes": "y,x,-z"}
    live = replay_session(tmp_path / "out" / "phone-1", warned.append)
    received = tmp_path / "received"
    received.mkdir()
    result = result_of(live, received)
    track = result.trajectory
    found = {round(t, 9): row for t, row in zip(track.index, track.to_numpy(), strict=True)}
    columns = list(track.columns)
    common = [one for one in states if one["time"] in found]
    assert len(common) > 100
    for one in common:
        for name, digits in (("lat", 9), ("lon", 9), ("alt", 6), ("VN", 6), ("heading", 6)):
            assert round(float(found[one["time"]][columns.index(name)]), digits) == one[name]
    # And as a log like any other, by its own streams.
    streams = sd.read(tmp_path / "out" / "phone-1")
    np.testing.assert_array_equal(streams["imu"].to_numpy(), live.got.samples[:, 1:])
    np.testing.assert_array_equal(streams["imu"].index, live.got.samples[:, 0])
    assert len(streams["gnss"]) == 15
