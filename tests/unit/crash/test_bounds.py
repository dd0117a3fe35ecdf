"""Bounds of changes of velocity, and paths against a reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded
from tests.unit.crash.crash_case import RATE, prepared

from strapdown import rotation
from strapdown.crash.acceleration import body_acceleration
from strapdown.crash.delta_v import delta_v
from strapdown.crash.delta_v_bound import body_delta_v_bound, resolved_delta_v_bound
from strapdown.crash.entry import Entry, angle_rates
from strapdown.crash.measuring_point import PointKinematics, at_point
from strapdown.crash.path import VELOCITY, compare_with_reference, sample_paths
from strapdown.crash.reconstruction import CrashOptions, reconstruct_unit
from strapdown.errors import DataError
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation import ImuErrors, simulate_imu
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.earth_motion import Origin
from strapdown.tables import ACCEL, NED

CHANGE, TURN, LENGTH = (-7.2, -0.9, 0.3), (4.0, -6.0, 87.0), 0.113


@pytest.fixture(scope="module")
def at():
    pulse = HaversinePulse(2.0, LENGTH, CHANGE, TURN)
    motion = CrashMotion(3.0, Origin(45.0, 0.0, 0.0), (7.1, 0.0, 0.0), (pulse,))
    imu, _ = simulate_imu(motion, ImuErrors(), rate=RATE)
    imu.index = imu.index - 2.0
    mounting = Mounting((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.02, 0.5)
    return at_point(prepared(imu, mounting=mounting), (0.0, 0.0, 0.0), time_sd=5e-4)


@pytest.fixture(scope="module")
def answer(at):
    return reconstruct_unit(at, Entry.from_speed(7.1, 0.05))


def test_the_change_is_what_was_simulated(answer):
    # The event begins and ends where 20 ms change the velocity by 0.22 m/s: a hundredth of the
    # pulse lies outside.
    change = answer.ned[0].event
    assert change.delta_v.vector == pytest.approx(CHANGE, abs=0.08)
    assert answer.types[0].name == "front"
    assert answer.body[0].event.bound.sd[0] > 0.05


def test_resolved_bound_is_the_monte_carlo_s(answer):
    path = answer.path
    start, end = 0.02, 0.1
    a, b = (int(np.argmin(np.abs(path.time - t))) for t in (start, end))
    runs = 4000
    samples = sample_paths(path, runs=runs, seed=2)
    changes = samples.errors[:, b, VELOCITY] - samples.errors[:, a, VELOCITY]
    bound = resolved_delta_v_bound(path, path.time[a], path.time[b])
    # As of a variance: 4 sqrt(2/n), and 2 % for what is not linear.
    ratio = np.cov(changes.T).diagonal() / np.diag(bound.covariance)
    assert np.abs(ratio - 1.0).max() < 4.0 * np.sqrt(2.0 / runs) + 0.02


def test_body_bound_is_the_sum_over_what_is_added(at, answer):
    change = delta_v(answer.acceleration, 0.01, 0.0931)
    bound = body_delta_v_bound(at.effects, change.weights)
    imu = at.imu.copy()
    imu.attrs = dict(at.imu.attrs)
    k = at.effects.names.index("imu1 high-g scale x")
    imu[ACCEL] += at.effects.force[k]
    rest = answer.at_point.resting_force(9.80665)[0]
    other = delta_v(body_acceleration(imu, rest.tolist()), 0.01, 0.0931)
    moved = other.vector - change.vector
    row = bound.by_contributor.loc["scale factor"].to_numpy().reshape(3, 3)
    # Two per cent of what the high range spoke of the change; the low one speaks below 18 m/s²,
    # which a pulse of 127 has at its first and last eighth: 18 m/s² · T/4 / 2 = 0.25 m/s of 7.2.
    assert 0.95 < abs(moved[0]) / (0.02 * abs(change.vector[0])) < 1.0
    assert row[0, 0] >= moved[0] ** 2
    total = bound.by_contributor.to_numpy().sum(axis=0).reshape(3, 3)
    assert np.allclose(total, bound.covariance, rtol=1e-12)
    assert bound.shares(change.vector).sum() == pytest.approx(1.0)


def test_a_window_that_ends_at_another_time_is_less_sure(at, answer):
    change = answer.body[0].event.delta_v
    ends = np.array([change.start_rate * 0.0, change.end_rate * 0.0 + [3.0, 0.0, 0.0]])
    plain = body_delta_v_bound(at.effects, change.weights)
    wide = body_delta_v_bound(at.effects, change.weights, at_ends=ends)
    assert wide.covariance[0, 0] - plain.covariance[0, 0] == pytest.approx(9.0)
    with pytest.raises(
        DataError, match=r"direction: \[0\.0, 0\.0, 0\.0\] is zero, or does not have three"
    ):
        plain.along((0.0, 0.0, 0.0))


def test_a_path_is_consistent_with_itself_and_not_with_another(answer):
    path = answer.path
    reference = path.table[NED] + [3.0, -2.0, 1.0]
    same = compare_with_reference(path, reference)
    # Only where the reference's origin lies does not matter.
    assert max(abs(x) for x in same.largest) < 1e-9
    assert same.consistent and same.within == (1.0, 1.0, 1.0)
    sd = path.sd[NED].to_numpy()
    wrong = reference + 6.0 * sd
    other = compare_with_reference(path, wrong)
    assert not other.consistent
    assert other.rms[0] == pytest.approx(6.0 * np.sqrt(np.mean((sd - sd[path.anchor])[:, 0] ** 2)))
    stated = wrong.assign(north_sd=1.0, east_sd=1.0, down_sd=1.0)
    assert compare_with_reference(path, stated).consistent


def test_a_reference_that_cannot_serve_is_refused(answer):
    path = answer.path
    reference = path.table[NED]
    with pytest.raises(DataError, check=coded("crash.no-column", quantity="reference path")):
        compare_with_reference(path, reference[["north", "east"]])
    late = reference[reference.index > 0.5]
    with pytest.raises(DataError, check=coded("crash.path-entry")):
        compare_with_reference(path, late)
    holed = reference.copy()
    holed.iloc[3, 1] = np.nan
    with pytest.raises(DataError, match="row 4"):
        compare_with_reference(path, holed)


def test_without_a_crash_there_is_a_path_and_a_word(at):
    still = at.imu.copy()
    still.attrs = dict(at.imu.attrs)
    still[ACCEL] = [0.0, 0.0, -9.80665]
    quiet = PointKinematics("imu1", still, at.effects, at.levelling, at.rest)
    found = reconstruct_unit(quiet, Entry.from_speed(7.1, 0.05))
    assert found.events.events == () and found.body == () and found.types == ()
    assert found.findings and len(found.path.time) > 100


def test_an_event_beyond_the_path_has_no_resolved_change(at):
    found = reconstruct_unit(at, Entry.from_speed(7.1, 0.05), CrashOptions(window=(-0.05, 0.05)))
    assert found.ned == (None,)
    assert any("outside the path" in f.what for f in found.findings)


def test_angle_rates_are_derivatives():
    angles = np.array([[10.0, -25.0, 200.0]])
    q = rotation.quaternion_from_euler(angles[0])
    small = 1e-6
    for axis in range(3):
        turn = rotation.quaternion_from_rotation_vector(small * np.eye(3)[axis])
        moved = rotation.euler_from_quaternion(rotation.compose(turn, q)) - angles[0]
        # Second order of 1e-6, and rounding of angles in degrees over it.
        assert np.allclose(np.radians(moved) / small, angle_rates(angles)[0][:, axis], atol=1e-5)


def test_sd_of_angles(answer):
    row = replace(answer).path.sd.iloc[-1]
    assert isinstance(row, pd.Series)
    assert 0.1 < row["heading"] < 5.0
