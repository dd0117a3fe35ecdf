"""Charts of a run of navigation show what its record holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.unit.report.navigation_records import (
    AXES,
    TURN,
    one_epoch,
    record,
    shifted,
    told,
    without_aids,
)

from strapdown.dsp.chi_square import PLANE_95, plane_bound
from strapdown.frames import ned_from_geodetic
from strapdown.navigation.record import Span
from strapdown.report import navigation_charts as charts
from strapdown.report.chart import broken, kept_rows, strip_range, thin_fill
from strapdown.report.chart_svg import still
from strapdown.report.navigation_charts import (
    error_charts,
    innovation_chart,
    nees_chart,
    nis_chart,
    strip,
)
from strapdown.report.navigation_evaluation import (
    agreements,
)
from strapdown.report.navigation_plan import ellipse_rows, plan_chart


def named(panel, start):
    return [line for line in panel.lines if line.name.startswith(start)]


def test_thinning_keeps_every_extreme():
    rng = np.random.default_rng(3)
    low, high = rng.normal(size=20_000), rng.normal(size=20_000)
    low[12_345], high[777] = -50.0, 60.0
    fill = thin_fill("b", np.arange(20_000.0), low, high, "#000000", buckets=100)
    # Two columns, the least and the greatest of each of a hundred runs, and both ends.
    assert fill.x.size <= 4 * 100 + 2
    assert fill.low.min() == -50.0
    assert fill.high.max() == 60.0
    assert 12_345.0 in fill.x
    assert 777.0 in fill.x
    # Of each run of 200 samples, not of the whole alone.
    for k in range(0, 20_000, 200):
        inside = (fill.x >= k) & (fill.x < k + 200)
        assert fill.low[inside].min() == low[k : k + 200].min()
        assert fill.high[inside].max() == high[k : k + 200].max()


def test_thinning_leaves_short_curves_and_breaks():
    values = np.arange(50.0)
    assert (kept_rows((values,), 100) == np.arange(50)).all()
    values = np.zeros(10_000)
    values[5000] = np.nan
    assert 5000 in kept_rows((values,), 100)


def test_a_gap_breaks_a_curve():
    time = np.array([0.0, 1.0, 2.0, 30.0, 31.0])
    stamps, values = broken(time, np.ones(5))
    assert stamps.tolist() == [0.0, 1.0, 2.0, 16.0, 30.0, 31.0]
    assert np.isnan(values[3])
    assert np.isfinite(values[[0, 1, 2, 4, 5]]).all()


def test_the_ellipses_have_the_axes_of_the_covariance():
    made = record(outage=None)
    panel = plan_chart(told(made)).panels[0]
    (line,) = named(panel, "95")
    times = float(line.name.split("×")[1].replace("\u00a0", "")) if "×" in line.name else 1.0
    ends = np.flatnonzero(np.isnan(line.x))
    ring = np.column_stack([line.y[: ends[0]], line.x[: ends[0]]])
    off = ring - 0.5 * (ring.max(axis=0) + ring.min(axis=0))
    size = np.linalg.norm(off, axis=1) / times
    # 48 corners: one lies within 3.75 deg of an axis, which takes off its square's half at most:
    # 0.2 % of the longer one, and adds (9 - 1) times as much to the shorter.
    assert size.max() == pytest.approx(PLANE_95 * AXES[0], rel=2.2e-3)
    assert size.min() == pytest.approx(PLANE_95 * AXES[1], rel=1.8e-2)
    north, east = off[np.argmax(size)]
    assert np.degrees(np.arctan2(east, north)) % 180.0 == pytest.approx(np.degrees(TURN), abs=3.8)
    assert plane_bound(made.covariance)[0] == pytest.approx(PLANE_95 * AXES[0], rel=1e-12)


def test_ellipses_stand_at_the_ends_of_outages():
    made = record()
    along, ends = ellipse_rows(told(made))
    assert [(made.sd.index[k], s) for k, s in ends] == [(79.0, Span("outage", 50.0, 80.0))]
    assert all(not 50.0 <= made.sd.index[k] <= 80.0 for k in along)
    assert made.sd.index[along[-1]] == made.sd.index[-1]


def test_the_plan_shows_where_it_went_and_what_was_missing():
    made = record()
    panel = plan_chart(told(made)).panels[0]
    ned = ned_from_geodetic(
        made.trajectory[["lat", "lon", "alt"]].to_numpy(),
        made.trajectory[["lat", "lon", "alt"]].to_numpy()[0],
    )
    (path,), (lost,) = named(panel, "navigation"), named(panel, "without rtk")
    assert path.x[0] == pytest.approx(ned[0, 1], abs=1e-9)
    assert path.x[-1] == pytest.approx(ned[-1, 1], abs=1e-9)
    assert path.y[-1] == pytest.approx(ned[-1, 0], abs=1e-9)
    at = np.searchsorted(made.trajectory.index, [50.0, 80.0])
    assert lost.x[[0, -1]] == pytest.approx(ned[at, 1], abs=1e-9)
    assert np.isnan(path.x).sum() == 1
    (bound,) = named(panel, "bound")
    assert bound.labels == ("73.4\u00a0m after 30.0\u00a0s",)  # 2.4477 * 3 m * 10
    assert len(named(panel, "rejected")[0].x) == 1


def test_a_path_far_shorter_than_its_ellipses_is_seen_within_them():
    panel = plan_chart(told(record(speed=0.01, outage=None))).panels[0]
    marks = [line for line in panel.lines if line.labels and line.name in ("start", "end", "time")]
    # 1.2 m of way in a picture of twice 7.3 m: no instant between start and end can be read.
    assert [line.name for line in marks] == ["start", "end"]
    (ring,) = named(panel, "95\u00a0% ellipse")
    assert np.nanmax(np.abs(ring.y)) > 5.0


def test_fixes_outside_of_the_picture_do_not_widen_it():
    made = record()
    given = told(made)
    fixes = given.run.source.tables["rtk"].copy()
    fixes.iloc[3, fixes.columns.get_loc("lat")] += 1.0
    far = told(made, fixes=fixes)
    assert "1 fix is outside" in plan_chart(far).panels[0].title + plan_chart(far).caption
    assert plan_chart(far).panels[0].height == plan_chart(given).panels[0].height


def test_what_stands_has_no_plan():
    assert plan_chart(told(record(speed=0.0))) is None


@pytest.mark.parametrize(
    ("place", "course"),
    [
        ((-33.75, -70.6, 560.0), 200.0),
        ((-16.5, 179.9999, 10.0), 90.0),
        ((65.0, -179.9999, 10.0), 270.0),
        ((51.0, 0.0001, 10.0), 300.0),
    ],
)
def test_the_plan_is_right_on_every_side_of_the_earth(place, course):
    made = record(place=place, course=course, outage=None)
    (path,) = named(plan_chart(told(made)).panels[0], "navigation")
    way = 8.0 * (made.trajectory.index[-1] - made.trajectory.index[0])
    # It goes straight on in the plane of a place 0.8 m before the first sample: at 65 deg north
    # east is there turned by 0.8 m tan 65 / R, which is 0.26 mm over this way.
    assert path.x[-1] == pytest.approx(way * np.sin(np.radians(course)), abs=5e-4)
    assert path.y[-1] == pytest.approx(way * np.cos(np.radians(course)), abs=5e-4)


def test_headings_go_on_over_north():
    heading = np.array([350.0, 359.0, 2.0, 10.0, 355.0])
    assert charts.unwrapped(heading) == pytest.approx([350.0, 359.0, 362.0, 370.0, 355.0])
    made = record(outage=None)
    made.trajectory["heading"] = np.mod(350.0 + 0.02 * np.arange(len(made.trajectory)), 360.0)
    panel = charts.attitude_chart(told(made)).panels[-1]
    assert panel.lines[0].y.max() == pytest.approx(350.0 + 0.02 * (len(made.trajectory) - 1))
    fill = panel.fills[0]
    at = made.sd.index.get_loc(100.0)
    middle = 0.5 * (fill.low + fill.high)[fill.x == 100.0]
    # Sample 1000 of those that go on by 0.02 deg each; `at` is the mark of that instant.
    assert middle == pytest.approx(350.0 + 0.02 * 999, abs=1e-9)
    assert charts.heading_shown(made)[1][at] == pytest.approx(350.0 + 0.02 * 999, abs=1e-9)


def test_a_heading_that_turns_and_turns_is_broken_at_north():
    made = record(outage=None)
    made.trajectory["heading"] = np.mod(3.0 * np.arange(len(made.trajectory)), 360.0)
    shown, _, said = charts.heading_shown(made)
    assert np.nanmin(shown) >= 0.0
    assert np.nanmax(shown) < 360.0
    assert "10.0 full turns" in said  # 3 deg * 1199 / 360


def test_bounds_are_of_95_percent():
    made = record()
    chart = charts.bound_chart(told(made))
    place, velocity, attitude = chart.panels[1:]
    assert named(place, "horizontal")[0].y == pytest.approx(plane_bound(made.covariance))
    assert named(place, "height")[0].y[0] == pytest.approx(1.959964 * 2.0)
    assert named(velocity, "north")[0].y[0] == pytest.approx(1.959964 * 0.1)
    assert named(attitude, "heading")[0].y[0] == pytest.approx(1.959964 * 0.5)


def test_states_are_in_units_that_people_use():
    gyro, offset = charts.state_charts(told(record()))
    assert gyro.panels[1].y_label == "x, deg/h"
    assert gyro.panels[1].lines[0].y[0] == pytest.approx(np.degrees(2e-6) * 3600.0)
    assert offset.title == "Rtk: time offset"
    assert offset.panels[1].y_label == "rtk: time offset, s"
    assert offset.panels[1].lines[0].y[0] == 0.125


def test_the_strip_shows_modes_aids_and_what_was_rejected():
    panel = strip(record())
    assert panel.categories == ("mode", "rtk")
    fills = {fill.name: fill for fill in panel.fills}
    assert fills["outage"].x.tolist() == [50.0, 80.0]
    assert [v for v in fills["used"].x.tolist() if v == v] == [0.1, 50.0, 80.0, 120.0]
    (lost,) = named(panel, "rejected")
    assert lost.x.tolist() == [21.0]
    assert strip(without_aids(record())) is None


def test_the_strip_shows_the_heading_status_within_the_run():
    statuses = (Span("trusted", -5.0, 40.0), Span("unverified", 40.0, 121.0))
    panel = strip(record(), statuses)
    assert panel.categories == ("mode", "rtk", "heading")
    fills = {fill.name: fill for fill in panel.fills}
    assert fills["heading trusted"].x.tolist() == [0.1, 40.0]
    assert fills["heading unverified"].x.tolist() == [40.0, 120.0]
    assert "heading rejected" not in fills
    # The lower a status, the thinner its bar: it is seen without color, too.
    low, high = (
        np.ptp([fills[f"heading {s}"].low[0], fills[f"heading {s}"].high[0]])
        for s in ("unverified", "trusted")
    )
    assert low < high < 1.0


def test_a_state_that_was_not_observed_has_no_chart():
    made = told(record())
    sd = made.run.filtered.sensors_sd
    sd.loc[:, :] = sd.iloc[0].to_numpy()
    assert charts.state_charts(made) == ()
    block, _ = made.states
    assert made.unobserved(block) == block.labels


def fixes_of(made, **columns):
    given = told(made).run.source.tables["rtk"].copy()
    for name, values in columns.items():
        given[name] = values
    return told(made, fixes=given)


def test_fixes_that_are_all_alike_have_no_chart():
    assert charts.fix_charts(told(record())) == ()


def test_kind_satellites_and_stated_accuracy_of_fixes():
    count = len(told(record()).run.source.tables["rtk"])
    quality = np.where(np.arange(count) < 10, 5.0, 4.0)
    sd = np.linspace(0.5, 2.0, count)
    made = fixes_of(
        record(), quality=quality, satellites=np.arange(count) % 3 + 7.0, north_sd=sd, down_sd=sd
    )
    (chart,) = charts.fix_charts(made)
    _, kinds, satellites, stated = chart.panels
    assert kinds.categories == ("fixed", "float")
    assert kinds.lines[0].y[:10].tolist() == [1.0] * 10 and kinds.lines[0].y[10:].max() == 0.0
    assert satellites.y_label == "satellites" and satellites.lines[0].y.max() == 9.0
    horizontal, vertical = stated.lines
    assert horizontal.y[-1] == pytest.approx(np.hypot(2.0, 1.0))
    assert vertical.y[[0, -1]] == pytest.approx([0.5, 2.0])
    # A deviation that is not stated is not drawn.
    (chart,) = charts.fix_charts(fixes_of(record(), down_sd=np.inf, north_sd=sd))
    assert [line.name for line in chart.panels[-1].lines] == ["horizontal"]


def test_before_navigation_no_aid_is_used():
    made = record(outage=None)
    aligned = (Span("coarse", -60.0, -30.0), Span("fine", -30.0, 0.1))
    panel = strip(replace(made, modes=(*aligned, *made.modes)))
    fills = {fill.name: fill for fill in panel.fills}
    assert fills["coarse"].x.tolist() == [-60.0, -30.0]
    assert fills["used"].x.tolist() == [0.1, 120.0]


def test_the_strip_of_an_aid_that_comes_and_goes():
    made = without_aids(record())
    time = np.concatenate([np.arange(10.0, 20.0), np.arange(60.0, 65.0)])
    table = record().innovations["rtk.position"].iloc[: time.size].set_index(time)
    made.innovations["stand.velocity"] = table
    panel = strip(made)
    assert panel.categories == ("stand",)
    assert panel.fills[0].x[[0, 1, 3, 4]].tolist() == [10.0, 19.0, 60.0, 64.0]
    # Two epochs are no stretch: each is there where it was, and is seen.
    made.innovations["stand.velocity"] = table.iloc[[0, -1]]
    (used,) = strip(made).fills
    begins, ends = used.x[::3], used.x[1::3]
    assert 0.5 * (begins + ends) == pytest.approx([10.0, 64.0])
    assert ends - begins == pytest.approx(119.9 / 300.0)
    # From end to end of the run all the same.
    assert strip_range(charts.height_chart(told(made))) == (0.1, 120.0)


def test_innovations_far_off_are_drawn_at_the_edge():
    made = record()
    (one,) = agreements(made)
    chart = innovation_chart(made, one)
    panel = chart.panels[1]
    (edge,) = named(panel, "beyond")
    assert edge.x.tolist() == [21.0]
    assert edge.symbol == "triangle-up"
    assert "3 are beyond the axis" in chart.caption  # one a component
    # 1.96 standard deviations of 2 m.
    assert np.nanmax(panel.fills[0].high) == pytest.approx(3.919928)
    assert np.isnan(panel.fills[0].high).any()


def test_of_many_innovations_those_far_off_are_all_drawn():
    made = record(seconds=4000.0, outage=None, reject=())
    table = made.innovations["rtk.position"]
    far = [333, 1001, 2777]
    table.iloc[far, 0] = 7.0  # 3.5 standard deviations
    (one,) = agreements(made)
    chart = innovation_chart(made, one)
    (used,) = named(chart.panels[1], "used")
    assert used.x.size < 800
    assert set(table.index[far]) <= set(used.x)
    assert "one in 8 is drawn" in chart.caption


def test_normalised_squares_are_those_of_the_record():
    made = record(reject=())
    (one,) = agreements(made)
    table = made.innovations["rtk.position"]
    squares = sum(table[f"nu {x}"] ** 2 / table[f"s {x}"] for x in one.labels)
    (points,) = named(nis_chart(made, (one,)).panels[1], "epoch")
    assert points.y == pytest.approx(squares.to_numpy())
    assert one.mean_nis == pytest.approx(squares.mean())
    low, high = one.band
    assert low < 3.0 < high


def test_errors_are_beside_their_bounds():
    made = record(outage=None)
    # 3 m along the longer axis: one standard deviation.
    truth = shifted(made.trajectory, 3.0 * np.cos(TURN), 3.0 * np.sin(TURN), 1.0, 0.25)
    given = told(made, truth=truth)
    found = given.errors
    score = found.score("horizontal")
    assert score.rms == pytest.approx(3.0, rel=1e-6)
    assert score.bound == pytest.approx(PLANE_95 * 3.0, rel=1e-6)
    assert score.share == 1.0
    # One of the plane, 1 m by 2 m down, 0.25 deg by 0.5 deg of heading.
    assert found.nees["all"].to_numpy() == pytest.approx(1.0 + 0.25 + 0.25, rel=1e-4)
    assert found.freedom["all"] == 9
    place = error_charts(given)[0]
    assert place.panels[1].lines[0].y == pytest.approx(3.0 * np.cos(TURN), rel=1e-6)
    assert nees_chart(given).panels[1].levels[1].y == pytest.approx(19.0228, abs=1e-4)


@pytest.mark.parametrize(
    "make", [without_aids, one_epoch, lambda made: one_epoch(without_aids(made))]
)
def test_short_and_lonely_runs_are_drawn(make):
    given = told(make(record()))
    drawn = [
        charts.bound_chart(given),
        charts.height_chart(given),
        charts.velocity_chart(given),
        charts.attitude_chart(given),
        *charts.state_charts(given),
    ]
    drawn += [innovation_chart(given.record, one) for one in agreements(given.record)]
    for chart in drawn:
        assert "data-" in still(chart)
