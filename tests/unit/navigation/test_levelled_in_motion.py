"""A body that is levelled while its fixes show motion begins with their velocity."""

from functools import cache

import numpy as np
import pytest
from tests import town_drive as town

from strapdown.alignment.levelling import KnownHeading
from strapdown.frames import place_difference
from strapdown.navigation.handover import (
    CLIMB,
    DOUBTFUL,
    UNKNOWN_VELOCITY,
    motion_by_fixes,
    rest_by_fixes,
)
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import CoarseMode, Navigation, Until
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.replay import run_batch
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import simulate_imu
from strapdown.tables import ACCEL, GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

SENSORS = ImuUncertainty(
    TriadUncertainty(bias=town.GYRO_BIAS, noise_density=town.GYRO_NOISE),
    TriadUncertainty(bias=town.ACCEL_BIAS, noise_density=town.ACCEL_NOISE),
)


def receiver(noise, velocities):
    table = town.fixes(position_noise=noise)
    if not velocities:
        table[VELOCITY], table[VELOCITY_SD] = 0.0, np.inf
    return table


@cache
def samples():
    errors = ImuErrors(
        TriadErrors(noise_density=town.GYRO_NOISE), TriadErrors(noise_density=town.ACCEL_NOISE)
    )
    return simulate_imu(town.motion(), errors, rate=town.RATE, sampling="mean", seed=4)[0]


@pytest.mark.parametrize(("noise", "velocities"), [(0.02, False), (1.0, False), (1.0, True)])
def test_navigation_begins_with_the_velocity_of_the_fixes(noise, velocities):
    aid = Gnss(name="gnss", lever_arm=town.ARM)
    filter_ = town.begun(aid)[0].filter
    heading = float(town.motion().trajectory(np.array([2.0]))["heading"].iloc[0])
    chain = NavigationPipeline(
        Navigator(with_states(filter_, ()), (aid,)),
        modes=(CoarseMode(way=KnownHeading(heading, 2.0), until=Until(2.0)), Navigation()),
        sensors=SENSORS,
    )
    run = run_batch(chain, samples(), {"gnss": receiver(noise, velocities)})
    table, sd = run.record.trajectory, run.record.sd
    time = table.index.to_numpy()
    true = town.motion().trajectory(time)
    at = int(np.searchsorted(time, 2.5))
    off = table[VELOCITY].to_numpy()[at] - true[VELOCITY].to_numpy()[at]
    assert (np.abs(off) < 4.0 * sd[VELOCITY].to_numpy()[0]).all()
    # At rest it would have begun 10 m/s wrong.
    assert np.abs(off).max() < 3.0
    apart = place_difference(table[GEODETIC].to_numpy(), true[GEODETIC].to_numpy())
    late = time > 60.0
    assert np.linalg.norm(apart[late], axis=1).max() < max(5.0 * noise, 1.0)


def test_fixes_at_rest_show_no_motion():
    table = receiver(1.0, velocities=False)
    table[GEODETIC] = table[GEODETIC].to_numpy()[0]
    table["lat"] += np.random.default_rng(2).normal(0.0, 1.0 / 111e3, len(table))
    assert motion_by_fixes(table, 0.0, 10.0) is None
    table[[*VELOCITY, *VELOCITY_SD]] = 0.1
    assert motion_by_fixes(table, 0.0, 10.0) is None
    moving = motion_by_fixes(receiver(1.0, velocities=True), 0.0, 3.0)
    assert moving is not None
    assert np.hypot(*moving[0][:2]) == pytest.approx(10.0, abs=0.5)


def test_a_body_that_shakes_needs_less_proof_of_its_motion():
    table = receiver(1.0, velocities=True)
    table[VELOCITY_SD] = 4.0
    assert motion_by_fixes(table, 0.0, 3.0) is None
    moving = motion_by_fixes(table, 0.0, 3.0, DOUBTFUL)
    assert moving is not None
    # It is no better known than it is measured.
    assert (moving[1] >= 4.0).all()


def test_a_body_that_shakes_is_at_rest_only_as_far_as_its_fixes_show_it():
    """Levelled while it drives at 10 m/s, which fixes of 40 m do not show within two seconds."""
    aid = Gnss(name="gnss", lever_arm=town.ARM)
    filter_ = town.begun(aid)[0].filter
    truth = town.motion().trajectory(np.array([2.0])).iloc[0]
    modes = (CoarseMode(way=KnownHeading(float(truth["heading"]), 2.0), until=Until(2.0)),)
    chain = NavigationPipeline(
        Navigator(with_states(filter_, ()), (aid,)), modes=(*modes, Navigation()), sensors=SENSORS
    )
    table = receiver(1.0, velocities=False)
    table[POSITION_SD] = 40.0
    assert motion_by_fixes(table.loc[:2.0], 0.0, 2.0, DOUBTFUL) is None
    imu = samples().copy()
    imu[ACCEL] += 0.5 * np.sin(4.0 * imu.index.to_numpy())[:, None]
    record = run_batch(chain, imu, {"gnss": table}).record
    off = record.trajectory[VELOCITY].iloc[0] - truth[VELOCITY]
    assert np.abs(off).max() > 5.0
    sd = record.sd[VELOCITY].iloc[0]
    assert (np.abs(off) < 1.96 * sd).all()


def test_how_well_fixes_show_a_rest():
    """As a difference of positions does, with an acceleration since; or a velocity."""
    table = receiver(1.0, velocities=False).loc[:4.0]
    table[POSITION_SD] = 2.0
    last = table.index[-1]
    span = last - table.index[:-1].to_numpy()
    level = np.hypot(2.0 * np.sqrt(2.0) / span, 0.5 * span + 4.0 - last).min()
    assert rest_by_fixes(table, 0.0, 4.0) == pytest.approx([level, level, CLIMB])
    unknown = [UNKNOWN_VELOCITY, UNKNOWN_VELOCITY, CLIMB]
    assert rest_by_fixes(table.iloc[:1], 0.0, 4.0) == pytest.approx(unknown)
    assert rest_by_fixes(None, 0.0, 4.0) == pytest.approx(unknown)
    table[VELOCITY_SD] = 0.2
    since = np.hypot(0.2, 4.0 - last)
    assert rest_by_fixes(table, 0.0, 4.0) == pytest.approx([since] * 3)
