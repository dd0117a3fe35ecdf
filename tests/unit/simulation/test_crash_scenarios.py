"""Named crashes: stretches that they promise, impacts where they say, and what they do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation import CRASHES, Origin, Setting, find_crash
from strapdown.simulation.crash_motion import CrashCourse, blow, crash_scenario

IMPACTS = [name for name, c in CRASHES.items() if c.impacts]
OTHERS = [name for name, c in CRASHES.items() if not c.impacts]
# 49 CFR 563.5: an event is a change of 8 km/h or more within 150 ms.
THRESHOLD, WINDOW = 8.0 / 3.6, 0.150


def state(motion, *times):
    return motion.kinematics(np.array(times))


def in_vehicle(k, row, vector):
    """A vector in level axes that head as the vehicle does."""
    heading = math.radians(k.angles[row, 2])
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0], vector[2]])


def pulse_end(crash, impact):
    """End of the blow that begins at an instant: the pulse that changes the velocity most."""
    of_it = [p for p in crash.motion.pulses if p.start == impact]
    return max(of_it, key=lambda p: math.hypot(*p.velocity_change)).end


@pytest.mark.parametrize("name", CRASHES)
def test_it_stands_first_and_goes_on_after(name):
    crash = CRASHES[name]
    t = np.linspace(0.0, 3.0, 31)
    k = crash.motion.kinematics(t)
    np.testing.assert_array_equal(k.velocity, 0.0)
    np.testing.assert_array_equal(k.angles, np.zeros((31, 3)))
    ends = [pulse_end(crash, i) for i in crash.impacts] or [crash.start]
    assert crash.motion.duration >= ends[-1] + 1.0 - 1e-12
    assert crash.name == name
    assert crash.start == (crash.impacts[0] if crash.impacts else crash.start)


@pytest.mark.parametrize("name", CRASHES)
def test_it_comes_in_at_its_speed(name):
    crash = CRASHES[name]
    speed = crash.parameters.get("entry_speed", 0.0)
    if name == "rollover":  # friction brakes the skid: 0.4 g over 1.2 s
        speed -= 0.4 * 9.80665 * 1.2
    k = state(crash.motion, crash.start)
    assert np.linalg.norm(k.velocity[0]) == pytest.approx(speed, rel=1e-15)


@pytest.mark.parametrize("name", IMPACTS)
def test_each_impact_changes_the_velocity_as_told(name):
    crash = CRASHES[name]
    assert len(crash.impacts) == len(crash.delta_v)
    assert crash.ends == tuple(pulse_end(crash, i) for i in crash.impacts)
    for impact, told in zip(crash.impacts, crash.delta_v, strict=True):
        k = state(crash.motion, impact, pulse_end(crash, impact))
        change = in_vehicle(k, 0, k.velocity[1] - k.velocity[0])
        # A dozen sums of up to 20 m/s.
        np.testing.assert_allclose(change, told, rtol=0.0, atol=2e-14)


@pytest.mark.parametrize("name", [n for n in IMPACTS if n != "rollover"])
def test_friction_brings_it_to_rest_and_level(name):
    k = state(CRASHES[name].motion, CRASHES[name].motion.duration)
    np.testing.assert_allclose(k.velocity, 0.0, atol=2e-14)
    # Angles add up to some 100 deg on the way, in degrees.
    np.testing.assert_allclose(k.angles[0, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(k.turning, 0.0, atol=1e-14)


@pytest.mark.parametrize("name", CRASHES)
def test_a_crash_is_what_a_recorder_calls_an_event(name):
    motion = CRASHES[name].motion
    t = np.arange(0.0, motion.duration - WINDOW, 1e-3)
    change = motion.kinematics(t + WINDOW).velocity - motion.kinematics(t).velocity
    largest = np.linalg.norm(change[:, :2], axis=1).max()
    assert (largest >= THRESHOLD) == bool(CRASHES[name].impacts)


@pytest.mark.parametrize("name", IMPACTS)
def test_the_kind_is_where_the_force_comes_from(name):
    crash = CRASHES[name]
    ahead, right, _ = crash.delta_v[0]
    direction = abs(math.degrees(math.atan2(-right, -ahead)))
    kinds = {"front": (0, 45), "side": (45, 135), "rear": (135, 180), "rollover": (45, 135)}
    low, high = kinds[crash.kind]
    assert low <= direction <= high


@pytest.mark.parametrize(
    ("crash", "yaw"),
    [
        (crash_scenario("pole", offset=0.4), 1.0),  # the right is held: it turns to the right
        (crash_scenario("pole", offset=-0.4), -1.0),
        (crash_scenario("frontal"), 0.0),
        (crash_scenario("oblique", direction_deg=-30.0, arm=0.4), 1.0),
        (crash_scenario("side", direction_deg=-90.0, arm=0.3), 1.0),  # pushed to the right ahead
        (crash_scenario("rear", offset=0.2), -1.0),  # pushed forward on the right
    ],
)
def test_it_turns_to_the_side_that_the_blow_makes_it(crash, yaw):
    k = state(crash.motion, pulse_end(crash, crash.start))
    assert np.sign(np.round(k.turning[0, 2], 12)) == yaw


def test_a_car_that_skids_left_side_first_rolls_to_the_left():
    for skid, side in ((-80.0, 1.0), (80.0, -1.0)):
        crash = crash_scenario("rollover", skid_deg=skid)
        k = state(crash.motion, crash.start, pulse_end(crash, crash.start))
        sideways = in_vehicle(k, 0, k.velocity[0])[1]
        assert np.sign(sideways) == side
        assert np.sign(k.turning[1, 0]) == side
        assert math.degrees(abs(k.turning[1, 0])) == pytest.approx(
            math.degrees(2.5 * 0.55 / 0.40), rel=1e-12
        )


def test_a_setting_moves_the_crash_and_changes_nothing_that_is_felt():
    setting = Setting(Origin(-30.0, 60.0, 5.0), heading_deg=135.0, stand=7.0, coast=1.25)
    here, there = CRASHES["pole"], crash_scenario("pole", setting=setting)
    later = 7.0 + 1.25 - 3.0 - 0.5
    assert there.start == pytest.approx(here.start + later, abs=1e-15)
    t = np.linspace(here.start, here.start + 0.5, 26)
    one, two = here.motion.kinematics(t), there.motion.kinematics(t + later)
    # 135 deg is no axis: a rounding of 130 m/s² through sine and cosine, and 1e-15 s of the time.
    for a, b in zip(one.acceleration, two.acceleration, strict=True):
        turned = rotation.rotate(rotation.quaternion_from_euler([0.0, 0.0, 135.0]), a)
        np.testing.assert_allclose(turned, b, atol=2e-11)
    np.testing.assert_allclose(one.turning, two.turning, atol=1e-13)


def test_without_friction_it_goes_on_as_the_blow_left_it():
    crash = crash_scenario("pole", setting=Setting(friction=0.0, after=2.0), pitch_deg=0.0)
    end = pulse_end(crash, crash.start)
    assert crash.motion.duration == pytest.approx(end + 2.0, abs=1e-14)
    k = state(crash.motion, end, crash.motion.duration)
    np.testing.assert_array_equal(k.velocity[0], k.velocity[1])
    assert k.angles[1, 2] - k.angles[0, 2] == pytest.approx(2.0 * 86.89, abs=0.02)


def test_brakes_hold_a_constant_deceleration():
    crash = crash_scenario("hard-braking", entry_speed=20.0, deceleration=9.0)
    pulses = [p for p in crash.motion.pulses if p.start >= crash.start and any(p.velocity_change)]
    first, last = pulses[0], pulses[-1]
    t = np.linspace(first.start + 0.5 * first.length, last.end - 0.5 * last.length, 101)
    k = crash.motion.kinematics(t)
    # sin² and cos² of instants that are rounded by 2e-15 s, of a slope of 9 m/s² pi/0.2 s.
    np.testing.assert_allclose(k.acceleration[:, 0], -9.0, atol=1e-11)
    np.testing.assert_allclose(state(crash.motion, last.end).velocity, 0.0, atol=1e-14)
    # The nose is down while it brakes.
    assert state(crash.motion, t[50]).angles[0, 1] == pytest.approx(-1.5, abs=1e-12)


def test_second_of_two_impacts_comes_from_where_it_says_though_the_car_has_turned():
    crash = crash_scenario("two-impacts", between=0.5)
    one, two = crash.impacts
    assert two == pytest.approx(pulse_end(crash, one) + 0.5, abs=1e-14)
    k = state(crash.motion, two, pulse_end(crash, two))
    assert k.angles[0, 2] > 30.0
    change = in_vehicle(k, 0, k.velocity[1] - k.velocity[0])
    direction = math.degrees(math.atan2(-change[1], -change[0]))
    assert direction == pytest.approx(130.0, abs=1e-12)


def test_a_blow_straight_from_an_axis_has_no_other_component():
    assert blow(180.0, 5.0) == (5.0, 0.0, 0.0)
    assert blow(90.0, 5.0) == (0.0, -5.0, 0.0)


def test_a_lean_and_a_shift_end_where_they_say():
    course = CrashCourse(Setting(coast=0.0))
    course.lean(0, 7.0, 0.3)
    course.shift((0.5, -0.25, 0.125), 0.4, delay=0.1)
    course.time += 0.5
    motion = course.motion()
    k = state(motion, motion.duration)
    np.testing.assert_allclose(k.angles[0], [7.0, 0.0, 0.0], atol=4e-15)
    np.testing.assert_allclose(k.velocity, 0.0, atol=1e-15)
    moved = [
        sum(p.gathered(np.array([9.0]))[0] * p.velocity_change[j] for p in motion.pulses)
        for j in range(3)
    ]
    np.testing.assert_allclose(moved, [0.5, -0.25, 0.125], atol=2e-14)


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda: crash_scenario("pole", entry_speed=-1.0), "entry_speed"),
        (lambda: crash_scenario("oblique", direction_deg=120.0), "direction_deg"),
        (
            lambda: crash_scenario("hard-braking", deceleration=0.0),
            "deceleration",
        ),
        (lambda: crash_scenario("kerb", entry_speed=0.0), "entry_speed"),
        (lambda: Setting(stand=-1.0), "stand"),
        (lambda: Setting(towing=0.0), "towing"),
        (lambda: crash_scenario("pole", length=0.0), "length"),
    ],
)
def test_what_cannot_be_is_refused(make, names):
    with pytest.raises(ConfigError, match=names):
        make()


def test_a_name_that_is_none_gets_the_nearest():
    assert find_crash("pole") is CRASHES["pole"]
    with pytest.raises(ConfigError, match="pothole"):
        find_crash("potthole")
