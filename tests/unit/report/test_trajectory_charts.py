"""The chart of a trajectory: the plan in metres, what stands on it, and what is left out."""

from __future__ import annotations

from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.frames import geodetic_from_ned
from strapdown.report.chart import steady_range
from strapdown.report.chart_svg import ChartFigure
from strapdown.report.plan import PlanView
from strapdown.report.simulation import MOST_POINTS, trajectory_chart
from strapdown.tables import trajectory_table

PLACE = (55.75, 37.62, 150.0)
TIME_PANELS = ["height, m", "speed, m/s", "roll, deg", "pitch, deg", "heading, deg"]


def trajectory(ned, place=PLACE, *, heading=None, step=1.0, ellipsoid=WGS84):
    """A Trajectory table through places in metres about another, one a step."""
    ned = np.atleast_2d(np.asarray(ned, dtype=np.float64))
    n = len(ned)
    velocity = np.gradient(ned, step, axis=0) if n > 1 else np.zeros((1, 3))
    euler = np.zeros((n, 3))
    euler[:, 2] = 0.0 if heading is None else heading
    where = geodetic_from_ned(ned, place, ellipsoid=ellipsoid)
    where[:, 2] = place[2] - ned[:, 2]
    return trajectory_table(step * np.arange(n), where, velocity, euler)


def leg(east, north, n=101):
    s = np.linspace(0.0, 1.0, n)
    return np.column_stack([north * s, east * s, np.zeros(n)])


def line(panel, name):
    return next(one for one in panel.lines if one.name == name)


def test_the_plan_is_in_metres_about_the_start():
    # 400 m: the surface falls off by 1.3 cm, and a place put back on it moves by 1e-6 m.
    chart = trajectory_chart(trajectory(leg(300.0, -400.0)), title="t")
    path = line(chart.panels[0], "trajectory")
    np.testing.assert_allclose(path.x, np.linspace(0.0, 300.0, 101), atol=1e-5)
    np.testing.assert_allclose(path.y, np.linspace(0.0, -400.0, 101), atol=1e-5)
    plan = chart.panels[0]
    assert (plan.x_label, plan.y_label) == ("east of the start, m", "north of the start, m")
    assert [p.y_label for p in chart.panels[1:]] == TIME_PANELS
    assert chart.x_label == "time, s"


def test_the_ellipsoid_is_that_of_the_trajectory():
    shape = ELLIPSOIDS["krassovsky1940"]
    table = trajectory(leg(1e4, 1e4), ellipsoid=shape)
    ends = {}
    for one in (WGS84, shape):
        path = line(trajectory_chart(table, title="t", ellipsoid=one).panels[0], "trajectory")
        ends[one.name] = path.x[-1]
    assert ends[shape.name] == pytest.approx(1e4, abs=0.05)
    # The radii differ by 108 m in 6.4e6: 0.17 m in 10 km.
    assert abs(ends[WGS84.name] - 1e4) > 0.1


def test_far_is_in_kilometres():
    plan = trajectory_chart(trajectory(leg(3e4, 1e3)), title="t").panels[0]
    assert plan.x_label == "east of the start, km"
    # 30 km away, put back to the surface: 30 km (30/6378)²/2 = 0.3 m nearer.
    assert line(plan, "trajectory").x[-1] == pytest.approx(30.0, abs=1e-3)


@pytest.mark.parametrize("lon", [179.9999, -180.0, 180.0])
def test_the_date_line_does_not_break_a_path(lon):
    plan = trajectory_chart(trajectory(leg(100.0, 0.0), (10.0, lon, 0.0)), title="t").panels[0]
    assert line(plan, "trajectory").x[-1] == pytest.approx(100.0, abs=1e-5)


def test_start_and_end_are_marked_and_named():
    plan = trajectory_chart(trajectory(leg(300.0, 400.0)), title="t").panels[0]
    start, end = line(plan, "start"), line(plan, "end")
    assert (start.x[0], start.y[0], start.labels) == (
        pytest.approx(0),
        pytest.approx(0),
        ("start",),
    )
    assert (end.x[0], end.y[0]) == (pytest.approx(300, abs=1e-4), pytest.approx(400, abs=1e-4))
    assert end.labels == ("end",)
    assert start.symbol != end.symbol


def test_times_stand_where_it_was_then():
    plan = trajectory_chart(trajectory(leg(300.0, 400.0)), title="t").panels[0]
    times = line(plan, "time")
    assert times.labels == ("20 s", "40 s", "60 s", "80 s")
    np.testing.assert_allclose(times.x, [60.0, 120.0, 180.0, 240.0], atol=1e-4)


def test_one_that_stands_has_one_dot():
    ned = np.vstack([leg(100.0, 0.0, 50), np.tile([0.0, 100.0, 0.0], (100, 1))])
    ned = np.vstack([ned, ned[-1] + leg(100.0, 0.0, 50)])
    times = line(trajectory_chart(trajectory(ned), title="t").panels[0], "time")
    assert np.sum(np.abs(times.x - 100.0) < 1.0) == 1
    assert len(times.x) == len(times.labels)


def test_arrows_point_the_way_it_goes():
    """On a circle, clockwise: heads are turned to the right of the radius."""
    turn = np.linspace(0.0, 1.9 * np.pi, 400)
    ned = np.column_stack([100 * np.cos(turn) - 100, 100 * np.sin(turn), 0 * turn])
    heads = line(trajectory_chart(trajectory(ned), title="t").panels[0], "direction")
    xy = np.column_stack([heads.x, heads.y]).reshape(-1, 4, 2)
    assert len(xy) >= 4
    # The curve is broken after each head.
    assert np.isnan(xy[:, 3, 1]).all()
    assert np.isfinite(xy[:, :3]).all()
    tip, middle = xy[:, 1], 0.5 * (xy[:, 0] + xy[:, 2])
    along = tip - middle
    radius = tip - [0.0, -100.0]
    clockwise = np.column_stack([radius[:, 1], -radius[:, 0]])
    cosine = np.sum(along * clockwise, 1) / np.hypot(*along.T) / np.hypot(*clockwise.T)
    # A head is 0.016 of the view's width long, which is 3.4 m of a circle of 100 m: 2 degrees.
    assert (cosine > np.cos(np.radians(3.0))).all()


def test_one_that_stays_has_no_plan():
    chart = trajectory_chart(trajectory(np.zeros((50, 3)), heading=45.0), title="t")
    assert [p.y_label for p in chart.panels] == TIME_PANELS[2:]
    assert chart.caption.startswith("It stays at its place (55.75°, 37.62°, 150 m).")
    assert [p.y_label for p in trajectory_chart(trajectory([0, 0, 0]), title="t").panels] == (
        TIME_PANELS[2:]
    )


def test_one_that_only_rises_has_a_height_and_no_plan():
    ned = np.column_stack([np.zeros((50, 2)), -np.arange(50.0)])
    chart = trajectory_chart(trajectory(ned), title="t")
    assert [p.y_label for p in chart.panels] == TIME_PANELS
    assert chart.panels[0].lines[0].y.max() == pytest.approx(199.0)


def test_rounding_does_not_look_like_a_signal():
    table = trajectory(leg(300.0, 400.0))
    table["alt"] += 1e-9 * np.arange(len(table))
    chart = trajectory_chart(table, title="t")
    assert steady_range(chart.panels[1]) == pytest.approx((149.5, 150.5))
    # What changes is shown as it is.
    table["alt"] += 0.01 * np.arange(len(table))
    assert steady_range(trajectory_chart(table, title="t").panels[1]) is None


@pytest.mark.parametrize(
    ("heading", "words"), [((10.0, -10.0), "−180 to 180°"), ((170.0, 190.0), "0 to 360°")]
)
def test_a_heading_is_broken_as_little_as_can_be(heading, words):
    course = np.linspace(*heading, 101) % 360.0
    chart = trajectory_chart(trajectory(leg(1.0, 1.0), heading=course), title="t")
    shown = chart.panels[-1].lines[0].y
    np.testing.assert_allclose(shown, np.linspace(*heading, 101), atol=1e-9)
    assert f"heading {words}, clockwise from north" in chart.caption


def test_a_long_one_is_thinned_and_says_so():
    turn = np.linspace(0.0, 40.0, 20_000)
    ned = np.column_stack([900 * np.sin(turn), 500 * np.sin(1.3 * turn), 0 * turn])
    chart = trajectory_chart(trajectory(ned, step=0.01), title="t")
    path = line(chart.panels[0], "trajectory")
    assert len(path.x) == MOST_POINTS
    assert f"Plan: {MOST_POINTS} of 20000 points; those left out lie within" in chart.caption
    assert max(len(one.x) for p in chart.panels for one in p.lines) <= MOST_POINTS
    assert np.ptp(path.y) == pytest.approx(1800.0, abs=0.2)


@pytest.mark.parametrize(
    "ned", [leg(500.0, 0.0), leg(0.0, 500.0), leg(300.0, -400.0), leg(1e-2, 0.0), leg(9e6, 1e5)]
)
def test_a_plan_has_equal_scales_and_holds_its_path(ned):
    chart = trajectory_chart(trajectory(ned), title="t")
    plan, *others = drawn_panels(chart)
    (left, right), (low, high) = plan["x"], plan["y"]
    assert plan["width"] / (right - left) == pytest.approx(plan["height"] / (high - low), rel=1e-3)
    path = line(chart.panels[0], "trajectory")
    assert left < path.x.min() <= path.x.max() < right
    assert low < path.y.min() <= path.y.max() < high
    # The others are below each other, and share an axis of their own.
    assert {panel["group"] for panel in others} == {"time"} != {plan["group"]}
    assert len({panel["x"] for panel in others}) == 1
    for above, below in pairwise([plan, *others]):
        assert above["top"] + above["height"] < below["top"]
    heights = [panel["height"] for panel in others]
    assert plan["height"] > 2 * heights[0]
    assert heights == pytest.approx([heights[0]] * len(heights), abs=0.02)


def drawn_panels(chart):
    """Position and axes of each panel in the picture."""
    found = []
    for one in ElementTree.fromstring(ChartFigure(chart).svg()).iter():
        if one.get("data-x"):
            axes = {k: tuple(map(float, one.get(f"data-{k}").split()[:2])) for k in "xy"}
            box = {k: float(one.get(k)) for k in ("width", "height")}
            found.append(
                {"top": float(one.get("y")), "group": one.get("data-group"), **box, **axes}
            )
    return found


def test_a_view_is_neither_too_low_nor_too_high():
    east, north = (
        PlanView.of([(np.array([0.0, 10.0]), np.zeros(2))]),
        PlanView.of([(np.zeros(2), np.array([0.0, 10.0]))]),
    )
    assert east.height < north.height < 3.0
    assert (east.width, north.width) == (10.0, pytest.approx(10.0 / 0.62))


def test_pictures_have_the_same_bytes_and_hold_the_caption():
    chart = trajectory_chart(
        trajectory(leg(300.0, 400.0)), title="a title <of> a $\\file$ -- and 東"
    )
    a, b, c = (ChartFigure(chart).svg(caption=caption) for caption in (True, True, False))
    assert a == b
    assert "level plane at the start" in a
    assert "level plane" not in c
    assert "a title &lt;of&gt; a $\\file$ -- and 東" in c
