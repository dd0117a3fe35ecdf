"""A body that is levelled while its fixes show motion begins with their velocity."""

from functools import cache

import numpy as np
import pytest
from tests import town_drive as town

from strapdown.alignment.levelling import KnownHeading
from strapdown.frames import place_difference
from strapdown.navigation.handover import DOUBTFUL, motion_by_fixes
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import CoarseMode, Navigation, Until
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.replay import run_batch
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import simulate_imu
from strapdown.tables import GEODETIC, VELOCITY, VELOCITY_SD

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
