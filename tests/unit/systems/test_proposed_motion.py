"""Whether it stands or drives, by fixes that tell places alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.systems.navigation_proposal import (
    _alignment,
    _levelled,
    _motion,
    _quiet,
    _rest,
    first_motion,
)
from strapdown.tables import ACCEL, POSITION_SD, gnss_table, imu_table

RATE = 10.0
SD = 5.0
STARTS = 60.0


def fixes(speed: float, noise: float = 0.0) -> pd.DataFrame:
    """A minute of rest, a minute northward, without velocities."""
    time = np.arange(0.0, 120.0, 1.0 / RATE)
    north = speed * np.maximum(time - STARTS, 0.0)
    north = north + noise * np.random.default_rng(3).normal(size=time.size)
    place = np.stack(
        [45.0 + np.degrees(north / 6.37e6), np.full(time.size, 10.0), np.zeros(time.size)], axis=1
    )
    none = np.zeros((time.size, 3))
    return gnss_table(time, place, none, none + SD, none + np.inf, source="fixes.csv")


@pytest.mark.parametrize("speed", [5.0, 10.0, 30.0])
def test_a_drive_is_seen_though_a_step_is_shorter_than_the_errors(speed):
    begins, fastest = first_motion(fixes(speed))
    # Two fixes tell a way that is 4.5 standard deviations of their difference, and 0.5 m/s more;
    # windows double, so that the one that shows it is at most twice as long, and begins in the
    # rest by no more.
    shows = 4.5 * np.sqrt(2.0) * SD / (speed - 0.5)
    assert abs(begins / RATE - STARTS) <= 2.0 * shows + 1.0 / RATE
    assert 0.0 < fastest <= speed * 1.001  # the curvature of the ellipsoid is not in 6370 km


def test_a_rest_whose_places_scatter_is_no_drive():
    # 1200 fixes and 11 lags: 13000 pairs, of which 4.5 standard deviations leave 0.5 in two
    # components, and fewer in the one that scatters here.
    begins, fastest = first_motion(fixes(0.0, noise=SD))
    assert begins is None
    assert fastest <= 0.5


def test_autonomous_fixes_among_fixed_solutions_are_no_drive():
    """At rest: one of thirty is autonomous, and 2 m beside; 5 m are assumed of it, and not 0.3."""
    table = fixes(0.0, noise=0.01)
    autonomous = np.arange(len(table)) % 30 == 0
    table[POSITION_SD] = np.tile(np.where(autonomous, 5.0, 0.02)[:, None], 3)
    table.loc[autonomous, "lat"] += np.degrees(2.0 / 6.37e6)
    table.attrs["position_sd_taken"] = 0.02
    assert first_motion(table) == (None, pytest.approx(0.0, abs=0.5))


def test_by_places_the_drive_is_fast_enough_for_a_course():
    time = pd.Index(np.arange(0.0, 120.0, 0.01), name="time")
    rest, drives = _motion(pd.DataFrame(index=time), fixes(10.0))
    assert drives
    assert rest == pytest.approx(STARTS, abs=8.0)


@pytest.mark.parametrize("heading_deg", [None, 30.0])
def test_levelling_leaves_half_of_a_short_record_to_navigation(heading_deg):
    def length(span, rest):
        time = pd.Index([0.0, span], name="time")
        imu = pd.DataFrame(np.tile([0.0, 0.0, -9.81], (2, 1)), time, ACCEL)
        levelled = _levelled(imu, rest, rest)
        chosen, _ = _alignment(None, rest, False, heading_deg, span, levelled)
        return chosen["coarse"]["duration_s"]

    assert length(6.5, 6.5) == 3.25
    assert length(600.0, 300.0) == 10.0


BEGINS = 6.0


def car(begins=BEGINS, rocking=0.0):
    """A unit with the noise of a phone: it rests, and then accelerates and turns."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 40.0, 0.01)
    moves = time >= begins
    rate = np.zeros((time.size, 3))
    rate[:, 2] = np.where(moves, 0.2 * np.sin(time - begins), 0.0)
    rate[:, 0] = rocking * np.cos(2.0 * time)
    force = np.tile([0.0, 0.0, -9.81], (time.size, 1))
    force[:, 0] += np.where(moves, 1.5, 0.0)
    return imu_table(
        time,
        rate + rng.normal(0.0, 0.001, rate.shape),
        force + rng.normal(0.0, 0.02, force.shape),
        sampling="instantaneous",
        source="car.csv",
    )


def test_the_rest_ends_when_the_sensors_move_though_positions_prove_it_later():
    assert _rest(_quiet(car(), 12.4), 12.4, rocks=False) == pytest.approx(BEGINS, abs=0.5)
    assert _rest(_quiet(car(), 12.4), 12.4, rocks=True) == pytest.approx(BEGINS, abs=0.5)


def test_the_rest_ends_when_the_fixes_move_though_the_sensors_are_quiet():
    assert _rest(_quiet(car(begins=100.0), 12.4), 12.4, rocks=False) == pytest.approx(
        12.4, abs=0.02
    )


def test_a_body_that_rocks_from_the_start_is_at_rest_for_gyros_that_find_north_alone():
    rocking = car(begins=100.0, rocking=0.05)
    assert _rest(_quiet(rocking, 12.4), 12.4, rocks=False) == 0.0
    assert _rest(_quiet(rocking, 12.4), 12.4, rocks=True) == pytest.approx(12.4)


def test_a_phone_at_rest_does_not_move_by_the_noise_of_its_speed():
    time = np.arange(0.0, 60.0)
    noise = 0.45 * np.random.default_rng(1).normal(size=(60, 3))
    place = np.tile([45.0, 10.0, 0.0], (60, 1))
    sd = np.tile([0.5, 0.5, np.inf], (60, 1))
    for begins in (60, 30):
        velocity = noise + np.where(time >= begins, 1.4, 0.0)[:, None] * [1.0, 0.0, 0.0]
        table = gnss_table(time, place, velocity, np.full((60, 3), SD), sd, source="fixes.csv")
        found = first_motion(table)[0]
        assert found is None if begins == 60 else abs(found - begins) <= 3
