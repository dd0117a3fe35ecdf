"""Gaps: bridged, said, and in the covariance; longer ones end the run, or begin it anew."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.modes import KnownStart
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import (
    GapPolicy,
    Hole,
    ImuPreprocessor,
    hole_between,
    widened,
)
from strapdown.navigation.replay import run_batch
from strapdown.tables import imu_table

START = NavState.from_degrees(48.0, 11.0, 500.0, roll_deg=10.0, heading_deg=30.0)


def navigator(name="ned", form="ud"):
    model = RotationVectorModel((1e-5,) * 3, (1e-4,) * 3, (gyro_bias(1e-6), accel_bias(1e-3)))
    return Navigator(ErrorFilter(MECHANIZATIONS[name](), model, COVARIANCES[form]()))


def chain(**policy):
    known = KnownStart(START, (1.0,) * 3, (0.01,) * 3, (0.01,) * 3)
    return NavigationPipeline(navigator(), ImuPreprocessor(gaps=GapPolicy(**policy)), start=known)


def log(first=2.0, length=0.3, rate=100.0):
    """Ten seconds of a body that rocks, without the samples of a while."""
    time = np.arange(0.0, 10.0, 1.0 / rate)
    rock = np.sin(3.0 * time)[:, None]
    gyro = rock * [0.02, 0.01, 0.0]
    accel = np.array([0.0, 1.7, -9.65]) + rock * [0.1, 0.0, 0.0]
    kept = (time <= first + 1e-9) | (time >= first + length - 1e-9)
    return imu_table(time[kept], gyro[kept], accel[kept], source="rock.csv")


def test_a_mean_is_unsure_by_half_of_the_change_and_by_the_motion_before():
    rng = np.random.default_rng(1)
    before = rng.normal(size=(100, 6)) * [1, 2, 3, 4, 5, 6]
    after = rng.normal(size=6)
    hole = hole_between(before, (1.0, 1.5), after)
    expected = np.sqrt((0.5 * (after - before[-1])) ** 2 + before.var(axis=0))
    np.testing.assert_allclose(np.r_[hole.rate_sd, hole.force_sd], expected, rtol=1e-14)
    assert hole.length == 0.5


@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
@pytest.mark.parametrize("form", COVARIANCES)
def test_velocity_and_attitude_are_less_known_by_what_may_have_happened(name, form):
    nav = navigator(name, form)
    state = nav.begin(
        START, np.diag(np.r_[[1.0] * 3, [0.1] * 3, [0.01] * 3, [1e-6] * 3, [1e-3] * 3])
    )
    hole = Hole(0.0, 0.4, np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0]))
    more = widened(nav, state, hole)
    filter_ = nav.filter
    added = filter_.physical_covariance(more.engine.filter)
    added = added - filter_.physical_covariance(state.engine.filter)
    C = filter_.mechanization.levels(state.engine.row[None, :])[0]
    from strapdown import rotation
    from strapdown._kernels.level import Q_LB

    C = rotation.dcm_from_quaternion(C[Q_LB : Q_LB + 4])
    expected = np.zeros_like(added)
    expected[3:6, 3:6] = C @ np.diag((0.4 * hole.force_sd) ** 2) @ C.T
    expected[6:9, 6:9] = C @ np.diag((0.4 * hole.rate_sd) ** 2) @ C.T
    # A difference of covariances of up to 1.
    np.testing.assert_allclose(added, expected, atol=1e-13)


def test_a_short_gap_is_bridged_and_said():
    run = run_batch(chain(), log(), None)
    (gap,) = [event for event in run.record.events if event.kind == "gap"]
    assert gap.time == pytest.approx(2.0)
    assert "0.3 s without samples, from 2 to 2.3 s" in gap.finding.what
    assert len(run.record.trajectory) == len(log()) - 1
    # The truth is as near as the standard deviations say, and these are larger than without it.
    whole = run_batch(chain(), log(length=0.0), None).record
    after, there = run.record.trajectory.loc[2.5:2.6], whole.trajectory.loc[2.5:2.6]
    off = np.abs(after["VE"].to_numpy()[0] - there["VE"].to_numpy()[0])
    sd = run.record.sd["VE"].loc[2.4:].iloc[0]
    assert off < 2.0 * sd
    assert sd > 1.5 * whole.sd["VE"].loc[2.4:].iloc[0]


@pytest.mark.parametrize("length", [0.02, 0.03])
def test_a_lost_sample_is_no_gap(length):
    events = run_batch(chain(), log(length=length), None).record.events
    assert [event.kind for event in events] == ["mode"]


def test_a_long_gap_ends_the_run_with_what_can_be_done():
    with pytest.raises(
        DataError, check=coded("navigation.gap", file="rock.csv", length=1.5, begin=2.0, end=3.5)
    ) as e:
        run_batch(chain(), log(length=1.5), None)
    assert "bridge" in str(e.value)


def test_a_long_gap_can_be_bridged_on_request():
    run = run_batch(chain(beyond="bridge"), log(length=1.5), None)
    assert len(run.record.trajectory) == len(log(length=1.5)) - 1


def test_what_means_nothing_is_refused():
    for policy in ({"usual": 1.0}, {"bridge": -1.0}, {"beyond": "hope"}):
        with pytest.raises(ConfigError):
            GapPolicy(**policy)
    with pytest.raises(ConfigError, check=coded("navigation.no-alignment-after-gap")):
        chain(beyond="align")
