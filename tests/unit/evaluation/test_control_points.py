"""A path beside control points: the fit that is best, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from strapdown.errors import DataError
from strapdown.evaluation.control_points import rigid_fit, score_control_points
from strapdown.frames import geodetic_from_ned
from strapdown.tables import trajectory_table

ORIGIN = (41.0, 29.0, 100.0)


def path(places):
    """A trajectory that stands on each place for a second: north and east, m."""
    ned = np.column_stack([places, np.zeros(len(places))])
    geodetic = geodetic_from_ned(ned, np.array(ORIGIN))
    still = np.zeros((len(places), 3))
    return trajectory_table(np.arange(len(places), dtype=float), geodetic, still, still)


def table(time, places, source="points.csv"):
    out = pd.DataFrame(places, index=pd.Index(time, name="time"), columns=["north", "east"])
    out.attrs["source"] = source
    return out


def around(count, seed=0):
    """Away from the first, which is the origin."""
    return np.vstack([[0.0, 0.0], np.random.default_rng(seed).uniform(-30.0, 30.0, (count, 2))])


def turned(places, deg):
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return places @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("deg", [0.0, 25.0, -170.0, 179.9])
def test_a_turn_and_a_shift_are_taken_off(deg):
    places = around(9)
    points = turned(places, -deg) + np.array([500.0, -300.0])
    found = score_control_points(path(places), table(np.arange(10.0), points))
    # The level frame of the start and geodetic places are one to rounding of a longitude, 1e-9 m.
    assert found.largest < 1e-7
    assert found.turn_deg == pytest.approx(deg, abs=1e-7)
    np.testing.assert_allclose(found.points, places, atol=1e-7)
    assert found.way == pytest.approx(np.hypot(*np.diff(places, axis=0).T).sum(), rel=1e-12)


def test_a_mirrored_or_stretched_path_is_an_error():
    """As north and east that are taken for one another are, and a scale."""
    places = around(9)
    time = np.arange(10.0)
    assert score_control_points(path(places), table(time, places[:, ::-1])).rms > 5.0
    assert score_control_points(path(places), table(time, 1.1 * places)).rms > 1.0


def test_no_other_turn_or_shift_is_nearer():
    rng = np.random.default_rng(3)
    points = around(12)
    onto = turned(points, 40.0) + 0.5 * rng.standard_normal(points.shape)
    turn, placed = rigid_fit(points, onto)
    least = np.square(placed - onto).sum()
    for d_turn, d_north, d_east in 1e-3 * rng.standard_normal((200, 3)):
        other = turned(points, math.degrees(turn + d_turn))
        other += placed.mean(axis=0) - turned(points, math.degrees(turn)).mean(axis=0)
        other += [d_north, d_east]
        assert np.square(other - onto).sum() >= least


def test_what_is_stated_is_what_it_says():
    """A point that is off by 1 m: by hand, the shift and turn of the others being held."""
    places = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [30.0, 0.0]])
    found = score_control_points(path(places), table(np.arange(4.0), places + np.array([0.0, 3.0])))
    assert found.largest < 1e-7
    found = score_control_points(
        path(places), table(np.arange(4.0), places + np.array([[0, 0], [0, 1.0], [0, 1.0], [0, 0]]))
    )
    # Symmetric: no turn, a shift by the mean, half a metre to each side.
    np.testing.assert_allclose(found.distance, 0.5, atol=1e-7)
    assert (found.rms, found.median) == pytest.approx((0.5, 0.5), abs=1e-7)


def test_points_beyond_the_run_are_left_out_and_counted():
    places = around(5)
    found = score_control_points(path(places), table(np.arange(6.0) + 2.0, around(5, 1)))
    assert (len(found.time), found.given) == (4, 6)


@pytest.mark.parametrize(
    ("time", "places", "what"),
    [
        ([100.0, 101.0], [[0.0, 0.0], [1.0, 0.0]], "control points are within the run"),
        (
            [1.0, 2.0],
            [[3.0, 4.0], [3.0, 4.0]],
            "all control points within the run are at one position, which does not ",
        ),
    ],
)
def test_what_fits_any_heading_is_refused(time, places, what):
    with pytest.raises(DataError, match=what) as refused:
        score_control_points(path(around(5)), table(time, places))
    assert refused.value.finding.file == "points.csv"
    assert refused.value.finding.remedy
