"""Direction of force: convention, bounds, sensitivity."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from pulses import Pulse, stamps

from strapdown import rotation
from strapdown.crash.acceleration import Acceleration
from strapdown.crash.delta_v import delta_v
from strapdown.crash.pdof import (
    CONVENTIONS,
    clock_of,
    from_convention,
    ned_pdof,
    pdof,
    pdof_by_shift,
    pdof_by_window,
    pdof_interval,
    to_convention,
)
from strapdown.errors import ConfigError, DataError


@pytest.mark.parametrize(
    ("change", "horizontal", "vertical", "clock"),
    [
        # Struck in front: slowed down. From the right: pushed to the left, which is -y.
        ((-10.0, 0.0, 0.0), 0.0, 0.0, 12),
        ((0.0, -10.0, 0.0), 90.0, 0.0, 3),
        ((10.0, 0.0, 0.0), 180.0, 0.0, 6),
        ((0.0, 10.0, 0.0), -90.0, 0.0, 9),
        ((-10.0, -10.0, 0.0), 45.0, 0.0, 2),
        # From above: pushed down, which is +z.
        ((-10.0, 0.0, 10.0), 0.0, 45.0, 12),
        ((0.0, 0.0, 5.0), 0.0, 90.0, 12),
        ((0.0, 0.0, -5.0), 0.0, -90.0, 12),
    ],
)
def test_the_convention(change, horizontal, vertical, clock):
    found = pdof(change)
    assert found.horizontal_deg == pytest.approx(horizontal, abs=1e-13)
    assert found.vertical_deg == pytest.approx(vertical, abs=1e-13)
    assert found.clock == clock


def test_over_ground_it_is_an_azimuth_and_relative_to_the_heading():
    # Heading east, struck in front: the force comes from the east.
    found = ned_pdof([0.0, -8.0, 0.0], 90.0)
    assert found.azimuth_deg == pytest.approx(90.0) and found.relative_deg == pytest.approx(0.0)
    # Heading 350, force from 20 deg: 30 deg to the right.
    change = [-math.cos(math.radians(20.0)), -math.sin(math.radians(20.0)), 0.1]
    found = ned_pdof(change, 350.0)
    assert found.azimuth_deg == pytest.approx(20.0) and found.relative_deg == pytest.approx(30.0)
    assert found.clock == 1 and found.vertical_deg > 0.0
    assert 0.0 <= ned_pdof([-1.0, 1e-17, 0.0], 0.0).azimuth_deg < 360.0


@pytest.mark.parametrize("seed", range(20))
def test_a_yaw_turns_the_direction_and_nothing_else(seed):
    rng = np.random.default_rng(seed)
    change, yaw = rng.normal(0.0, 5.0, 3), rng.uniform(-180.0, 180.0)
    # The same change seen from a vehicle that is turned by yaw: the force comes from further left.
    seen = rotation.rotate(rotation.conjugate(rotation.quaternion_from_euler([0, 0, yaw])), change)
    before, after = pdof(change), pdof(seen)
    turned = (before.horizontal_deg - yaw - after.horizontal_deg + 180.0) % 360.0 - 180.0
    # A dozen roundings of angles up to 360 deg.
    assert abs(turned) < 1e-12 and after.vertical_deg == pytest.approx(before.vertical_deg)
    over = ned_pdof(change, yaw)
    assert math.cos(math.radians(over.relative_deg - after.horizontal_deg)) > 1.0 - 1e-14


@pytest.mark.parametrize("name", list(CONVENTIONS))
def test_conventions_there_and_back(name):
    for angle in np.r_[np.arange(-179.0, 181.0, 7.3), 180.0, 0.0, 1e-9, -1e-9]:
        written = to_convention(angle, name)
        how = CONVENTIONS[name]
        assert 0.0 <= written < 360.0 if how.full_turn else -180.0 < written <= 180.0
        # Rounding of angles up to 360 deg; at the seam, a full turn is none.
        off = (from_convention(written, name) - angle + 180.0) % 360.0 - 180.0
        assert abs(off) < 1e-12


@pytest.mark.parametrize(
    ("name", "of_right", "of_front"),
    [
        ("strapdown", 90.0, 0.0),
        ("nhtsa", 90.0, 0.0),
        ("counterclockwise", -90.0, 0.0),
        ("delta-v", -90.0, 180.0),
        ("delta-v counterclockwise", 90.0, 180.0),
        ("tadic-2016", 90.0, 0.0),
    ],
)
def test_what_conventions_mean(name, of_right, of_front):
    assert to_convention(90.0, name) == of_right and to_convention(0.0, name) == of_front
    # The two that follow the change of velocity are the angle of its vector.
    change = np.array([-3.0, -2.0])
    direction = pdof([*change, 0.0]).horizontal_deg
    if name == "delta-v":
        expected = math.degrees(math.atan2(change[1], change[0]))
        assert to_convention(direction, name) == pytest.approx(expected)
    elif name == "delta-v counterclockwise":
        expected = math.degrees(math.atan2(-change[1], change[0]))
        assert to_convention(direction, name) == pytest.approx(expected)
    elif name == "nhtsa":
        assert to_convention(-10.0, name) == 350.0


def test_an_unknown_convention_gets_the_nearest():
    with pytest.raises(ConfigError, check=coded("crash.no-convention-direction-force")):
        to_convention(1.0, "nhsta")


def test_the_clock_rounds_to_the_nearest_hour_and_the_border_goes_clockwise():
    assert [clock_of(a) for a in (0, 14.999, 15, 45, -15, -15.001, 180, -165, -165.001, 165)] == [
        12, 12, 1, 2, 12, 11, 6, 7, 6, 6
    ]  # fmt: skip


def coverage(true, covariance, runs=20000, seed=0):
    rng = np.random.default_rng(seed)
    drawn = rng.multivariate_normal(true, covariance, runs)
    known = pdof(true)
    hits = np.zeros(2)
    lost = 0
    for change in drawn:
        interval = pdof_interval(change, covariance)
        hits += [
            interval.horizontal.contains(known.horizontal_deg),
            interval.vertical.low_deg <= known.vertical_deg <= interval.vertical.high_deg,
        ]
        lost += interval.horizontal.undetermined
    return hits / runs, lost / runs


@pytest.mark.slow
@pytest.mark.parametrize(
    "true", [(-7.2, 2.0, 0.8), (7.2, 0.01, 0.1), (-1.0, 0.3, 0.0)], ids=["front", "seam", "small"]
)
def test_intervals_contain_the_truth_in_95_of_100(true):
    # Errors that are unequal and correlated; the small change is only three of them long.
    covariance = np.array([[0.09, 0.03, 0.0], [0.03, 0.16, 0.02], [0.0, 0.02, 0.04]])
    (horizontal, vertical), lost = coverage(true, covariance)
    # 20000 runs know 95 % to 0.15 %; four of these.
    assert horizontal == pytest.approx(0.95, abs=0.0062)
    if true[0] < -2.0:
        assert vertical == pytest.approx(0.95, abs=0.0062) and lost == 0.0
    else:
        assert vertical >= 0.94


def test_a_change_within_its_uncertainty_has_no_direction_and_says_so():
    covariance = np.diag([0.25, 0.25, 0.25])
    interval = pdof_interval([-0.5, 0.2, 0.0], covariance)
    assert interval.horizontal.undetermined and interval.horizontal.width_deg == 360.0
    (horizontal, _), lost = coverage((-0.3, 0.2, 0.0), covariance, 5000)
    assert horizontal >= 0.94 and 0.5 < lost < 1.0
    # An upright change: all directions, although the change is large.
    assert pdof_interval([0.0, 0.0, 9.0], covariance).horizontal.undetermined


def test_far_from_zero_it_is_the_linear_bound():
    covariance = np.array([[0.09, 0.03, 0.0], [0.03, 0.16, 0.02], [0.0, 0.02, 0.04]]) * 1e-4
    change = [-7.2, 2.0, 0.8]
    interval = pdof_interval(change, covariance)
    x, y, z = change
    h = math.hypot(x, y)
    angles = [[-y / h**2, x / h**2, 0.0], np.array([-z * x / h, -z * y / h, h]) / (h**2 + z**2)]
    gradient = np.degrees(angles)
    across, up = np.sqrt(np.diag(gradient @ covariance @ gradient.T))
    # The bound is 0.1 deg: its next order is a thousandth of it.
    assert interval.horizontal.width_deg == pytest.approx(2 * 1.959964 * across, rel=2e-3)
    assert interval.vertical.width_deg == pytest.approx(2 * 1.959964 * up, rel=2e-3)


def test_the_interval_is_the_angle_of_the_ellipse_and_goes_over_the_seam():
    # A circle of radius z s seen from the distance d: asin(z s / d) to either side.
    sd, far = 0.3, 4.0
    interval = pdof_interval([far, 0.0, 0.0], sd**2 * np.eye(3)).horizontal
    half = math.degrees(math.asin(1.959963984540054 * sd / far))
    assert interval.low_deg == pytest.approx(180.0 - half) and interval.high_deg == pytest.approx(
        180.0 + half
    )
    assert interval.contains(-180.0 + 0.9 * half) and not interval.contains(-180.0 + 1.1 * half)
    none = pdof_interval([far, 1.0, 0.0], np.zeros((3, 3))).horizontal
    assert none.width_deg == 0.0 and not none.undetermined


@pytest.mark.parametrize(
    ("covariance", "change"),
    [
        (np.eye(2), [1.0, 0.0, 0.0]),
        (-np.eye(3), [1.0, 0.0, 0.0]),
        (np.triu(np.ones((3, 3))), [1.0, 0.0, 0.0]),
        (np.eye(3), [0.0, 0.0, 0.0]),
        (np.eye(3), [np.nan, 0.0, 0.0]),
    ],
)
def test_what_is_no_change_or_covariance_is_refused(covariance, change):
    with pytest.raises(DataError):
        pdof_interval(change, covariance)


def test_frames_are_not_mixed():
    time = stamps(1000.0)
    pulse = Pulse((-7.2, 2.0, 0.0))
    ned = delta_v(Acceleration(time, pulse.accel(time), "ned"), 0.0, 0.1)
    with pytest.raises(ConfigError, check=coded("crash.delta-v-frame-needed")):
        pdof(ned)
    body = delta_v(Acceleration(time, pulse.accel(time)), 0.0, 0.1)
    with pytest.raises(ConfigError, check=coded("crash.delta-v-frame-needed")):
        ned_pdof(body, 0.0)


def test_sensitivity_to_the_window_of_a_force_that_turns():
    ahead, aside = Pulse((-7.2, 0.0, 0.0)), Pulse((0.0, 3.0, 0.0), 0.03, 0.12)
    time = stamps(10000.0)
    made = Acceleration(time, ahead.accel(time) + aside.accel(time))
    table = pdof_by_window(made, -0.0007)
    assert table.index.name == "window" and len(table) == 9
    for window, row in table.iterrows():
        end = window - 0.0007
        exact = math.degrees(math.atan2(-3.0 * aside.share(end), 7.2 * ahead.share(end)))
        # Trapezoids at 10 kHz: 1e-8/12 · 2 · 3.5e3 m/s³ = 6e-6 m/s beside 0.04 m/s at least.
        assert row["horizontal_deg"] == pytest.approx(exact, abs=0.02)
    shifted = pdof_by_shift(made, -0.0007, 0.06)
    assert shifted.loc[0.0, "horizontal_deg"] == pytest.approx(
        pdof(delta_v(made, -0.0007, 0.06)).horizontal_deg, abs=0.0
    )
    kept = pdof_by_shift(made, -0.0007, 0.06, [0.01], keep_length=True)
    # -0.0007 + 0.01 is 0.0093 but for its rounding, times 130 m/s².
    known = delta_v(made, 0.0093, 0.07).vector[0]
    assert kept["dv_x"].iloc[0] == pytest.approx(known, abs=1e-13)
    ned = Acceleration(time, made.values, "ned")
    relative = pdof_by_window(ned, -0.0007, heading_deg=25.0)
    assert np.allclose(relative["horizontal_deg"], table["horizontal_deg"] - 25.0)
    # Without a heading: from the north.
    for by, same in (
        (pdof_by_window(ned, -0.0007), table),
        (pdof_by_shift(ned, -0.0007, 0.06), shifted),
    ):
        assert np.allclose(by["horizontal_deg"], same["horizontal_deg"])
    # What does not fit is left out, and nothing that fits is an error.
    assert list(pdof_by_window(made, 0.7).index) == [0.01, 0.02, 0.03, 0.04, 0.05]
    with pytest.raises(
        DataError, check=coded("crash.no-window-shortest-ms-within", quantity="window")
    ):
        pdof_by_window(made, 5.0)
