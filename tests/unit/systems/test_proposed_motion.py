"""Whether it stands or drives, by fixes that tell places alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown.systems.navigation_proposal import _alignment, _motion, _moving
from strapdown.tables import gnss_table

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
    begins, fastest = _moving(fixes(speed))
    # Two fixes tell a way that is 4.5 standard deviations of their difference, and 0.5 m/s more;
    # windows double, so that the one that shows it is at most twice as long, and begins in the
    # rest by no more.
    shows = 4.5 * np.sqrt(2.0) * SD / (speed - 0.5)
    assert abs(begins / RATE - STARTS) <= 2.0 * shows + 1.0 / RATE
    assert 0.0 < fastest <= speed * 1.001  # the curvature of the ellipsoid is not in 6370 km


def test_a_rest_whose_places_scatter_is_no_drive():
    # 1200 fixes and 11 lags: 13000 pairs, of which 4.5 standard deviations leave 0.5 in two
    # components, and fewer in the one that scatters here.
    begins, fastest = _moving(fixes(0.0, noise=SD))
    assert begins is None
    assert fastest <= 0.5


def test_by_places_the_drive_is_fast_enough_for_a_course():
    time = pd.Index(np.arange(0.0, 120.0, 0.01), name="time")
    rest, drives = _motion(pd.DataFrame(index=time), fixes(10.0))
    assert drives
    assert rest == pytest.approx(STARTS, abs=8.0)


@pytest.mark.parametrize("heading_deg", [None, 30.0])
def test_levelling_leaves_half_of_a_short_record_to_navigation(heading_deg):
    def length(span, rest):
        return _alignment(None, rest, False, heading_deg, span)[0]["coarse"]["duration_s"]

    assert length(6.5, 6.5) == 3.25
    assert length(600.0, 300.0) == 10.0
