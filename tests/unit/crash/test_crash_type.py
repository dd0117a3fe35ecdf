"""Type of a crash, its margin, and where it is not known."""

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.crash_type import (
    PASSENGER_CAR,
    RollRecord,
    TippingBody,
    classify_crash,
    classify_crashes,
    side_of,
)
from strapdown.crash.delta_v import delta_v
from strapdown.crash.events import detect_events
from strapdown.errors import ConfigError, DataError

SMALL = 0.01 * np.eye(3)


def codes(found):
    """What decided, and what could not be, without the room's name."""
    return [reason.code.removeprefix("crash.") for reason in found.reasons]


@pytest.mark.parametrize(
    ("change", "name", "margin", "beyond"),
    [
        ((-10.0, 0.0, 0.0), "front", 45.0, "right"),
        ((-10.0, -10.0 * math.tan(math.radians(40.0)), 0.0), "front", 5.0, "right"),
        ((-10.0, 10.0 * math.tan(math.radians(40.0)), 0.0), "front", 5.0, "left"),
        ((0.0, -8.0, 0.0), "right", 45.0, "rear"),
        ((1.0, 8.0, 0.0), "left", 45.0 - math.degrees(math.atan(1 / 8)), "rear"),
        ((6.0, 1.0, 0.0), "rear", 45.0 - math.degrees(math.atan(1 / 6)), "left"),
        ((6.0, -1.0, 0.0), "rear", 45.0 - math.degrees(math.atan(1 / 6)), "right"),
    ],
)
def test_sides_by_the_direction_of_force(change, name, margin, beyond):
    found = classify_crash(change, SMALL)
    assert (found.name, found.side) == (name, name)
    assert found.margin_deg == pytest.approx(margin)
    # In the middle both neighbours are as near.
    assert margin == 45.0 or found.next_type == beyond
    assert found.interval is not None and codes(found) == ["type-by-direction", "type-no-roll"]


def test_borders_belong_clockwise():
    assert [side_of(a)[0] for a in (45.0, 135.0, -135.0, -45.0, 180.0, -180.0)] == [
        "right", "rear", "left", "front", "rear", "rear"
    ]  # fmt: skip


def test_a_bound_across_a_border_leaves_it_undetermined():
    near = (-10.0, -9.5, 0.0)
    assert classify_crash(near).name == "front"
    assert classify_crash(near, 0.001 * np.eye(3)).name == "front"
    found = classify_crash(near, 0.25 * np.eye(3))
    assert (found.name, found.side, found.next_type) == ("undetermined", "front", "right")
    assert codes(found)[0] == "type-across-border"
    lost = classify_crash((-0.5, 0.1, 0.0), 0.25 * np.eye(3))
    assert lost.name == "undetermined" and codes(lost)[0] == "type-within-uncertainty"


def test_what_tips_a_body_over_does_and_what_does_not_does_not():
    # The free roll of the body about its wheels, integrated: it goes over exactly where the
    # share is above one.
    body = TippingBody(0.75, 1.41, 0.65)
    arm, tip = math.hypot(0.75, 0.75 / 1.41), math.atan(1.41)
    pull = 9.80665 * arm / (0.65**2 + arm**2)
    for factor, over in ((0.99, False), (1.01, True)):
        level = math.sqrt(2.0 * pull * (1.0 - math.cos(tip)))
        roll, rate, h = 0.0, factor * level, 1e-4
        # The share grows with the square of the rate.
        assert body.energy_share(roll, rate) == pytest.approx(factor**2, rel=1e-12)
        for _ in range(40000):
            rate -= pull * math.sin(tip - roll) * h
            roll += rate * h
            if roll > tip or roll < 0.0:
                break
        assert (roll > tip) is over


def test_the_share_does_not_change_along_a_free_roll():
    arm, tip = math.hypot(0.75, 0.75 / 1.41), math.atan(1.41)
    energy = lambda roll: 9.80665 * arm * (math.cos(tip - roll) - math.cos(tip))  # noqa: E731
    k2 = 0.65**2 + arm**2
    whole = 9.80665 * arm * (1.0 - math.cos(tip))
    for roll in (0.0, 0.3, 0.5):
        rate = math.sqrt(2.0 * (0.8 * whole - energy(roll)) / k2)
        assert PASSENGER_CAR.energy_share(roll, rate) == pytest.approx(0.8, rel=1e-12)
        assert PASSENGER_CAR.energy_share(-roll, -rate) == pytest.approx(0.8, rel=1e-12)
    # On the way back the rate does not count.
    assert PASSENGER_CAR.energy_share(0.3, -2.0) < PASSENGER_CAR.energy_share(0.3, 0.1)


def test_a_rollover_goes_before_the_side():
    time = np.arange(0.0, 0.75, 0.005)
    rate = np.radians(200.0) * np.clip(time / 0.2, 0.0, 1.0)
    found = classify_crash((0.0, 6.0, 0.0), SMALL, roll=RollRecord(time, rate))
    assert (found.name, found.side) == ("rollover", "left") and found.roll is not None
    # 200 deg/s over 0.65 s: the trapezoid of the ramp is exact.
    assert found.roll.peak_roll_deg == pytest.approx(200.0 * (0.745 - 0.1), rel=1e-9)
    assert found.roll.quarter_turns == 1 and found.roll.peak_rate_deg_s == pytest.approx(200.0)
    calm = classify_crash((0.0, 6.0, 0.0), SMALL, roll=RollRecord(time, 0.2 * rate))
    assert calm.name == "left" and calm.roll is not None and calm.roll.share < 1.0


def test_a_roll_near_the_border_is_undetermined():
    time = np.arange(0.0, 0.2, 0.005)
    level = np.radians(141.0)
    found = classify_crash(
        (0.0, 6.0, 0.0), SMALL, roll=RollRecord(time, np.r_[level, np.zeros(39)], rate_sd=0.1)
    )
    assert found.name == "undetermined" and codes(found) == ["type-rollover-not-known"]
    assert found.roll is not None and found.roll.low < 1.0 < found.roll.high


def test_each_event_has_its_own():
    time = np.arange(-0.1, 2.0, 0.001)
    values = np.zeros((len(time), 3))
    for start, change in ((0.0, (-6.0, 0.5)), (0.8, (0.3, 5.0))):
        x = np.clip((time - start) / 0.1, 0.0, 1.0)
        values[:, :2] += np.outer((1.0 - np.cos(2.0 * np.pi * x)) / 0.1, change)
    made = Acceleration(time, values)
    events = detect_events(made).events
    changes = [delta_v(made, e.time_zero, e.end) for e in events]
    # It rolls after the second alone.
    rate = np.radians(220.0) * np.clip((time - 0.85) / 0.2, 0.0, 1.0)
    types = classify_crashes(changes, [SMALL, SMALL], events=events, roll=RollRecord(time, rate))
    assert [t.name for t in types] == ["front", "rollover"]
    assert [t.side for t in types] == ["front", "left"]
    plain = classify_crashes(changes, events=events)
    assert [t.name for t in plain] == ["front", "left"] and plain[0].roll is None
    with pytest.raises(
        ConfigError, check=coded("crash.changes-velocity-events", count=1, count_2=2)
    ):
        classify_crashes(changes[:1], events=events)


def test_bad_rates_are_refused():
    with pytest.raises(DataError, check=coded("tables.not-finite-number", quantity="roll_rate")):
        classify_crash((-5.0, 0.0, 0.0), roll=RollRecord([0.0, 0.1], [0.0, np.nan]))
    with pytest.raises(DataError, check=coded("crash.no-rate-roll", first=3.0)):
        PASSENGER_CAR.roll_motion(RollRecord([0.0, 0.1], [0.0, 0.0]), since=3.0)
    with pytest.raises(
        ConfigError, check=coded("crash.no-dimension-vehicle", quantity="half_track")
    ):
        TippingBody(half_track=-1.0)
