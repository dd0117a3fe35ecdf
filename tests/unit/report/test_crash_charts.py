"""Charts of a crash: their curves, bounds and marks are those of the answers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.report.crash_results import crash_case, figures_of

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.case_contact import main_event
from strapdown.crash.delta_v_bound import body_delta_v_bound
from strapdown.crash.pdof import pdof_by_shift
from strapdown.report.chart import SERIES_COLOURS
from strapdown.report.chart_svg import still
from strapdown.report.crash_charts import (
    delta_v_budget,
    delta_v_chart,
    delta_v_half_widths,
    risk_chart,
)
from strapdown.report.crash_document import (
    attitude_chart,
    flags_in_vehicle_axes,
    in_vehicle_axes,
)
from strapdown.report.crash_outline import event_marks, marks_apart, path_moments
from strapdown.sensors.crash_unit import Mounting
from strapdown.tables import EULER, NED, on_disk

ALONE = ("IMU1",)


def line(panel, name):
    return next(one for one in panel.lines if one.name == name)


def test_the_curves_of_delta_v_end_at_the_answer():
    found = crash_case().reconstruction
    (chart,) = figures_of().delta_v
    change = found.combined.body[0].event
    values = [*change.delta_v.vector, change.resultant]
    halves = [*change.bound.half_width, change.resultant_bound]
    end = 1e3 * change.delta_v.end
    for panel, value, half in zip(chart.panels, values, halves, strict=True):
        curve = line(panel, "mean of the recorders")
        # Between samples the integral is drawn straight: an eighth of the step, 5 ms, times what
        # the acceleration changes over it, at most 4 m/s² at the end: 2.5 mm/s.
        assert np.interp(end, curve.x, curve.y) == pytest.approx(3.6 * value, abs=0.01)
        bar = line(panel, "bar")
        np.testing.assert_allclose(bar.y, [3.6 * (value - half), 3.6 * (value + half)])
        assert f"{abs(3.6 * value):.1f} ± {3.6 * half:.1f} km/h" in panel.title
        assert panel.y_label.endswith("km/h")
    assert [m.label for m in chart.marks] == ["time zero", "563 event end"]
    unit = line(chart.panels[0], "IMU2")
    own = found.units[1].acceleration
    assert unit.colour == SERIES_COLOURS[1] and unit.dash != line(chart.panels[0], "IMU1").dash
    assert own.begin < 1e-3 * unit.x[0] < own.end


def test_the_band_of_delta_v_is_the_bound_at_an_exact_time():
    unit = crash_case(units=ALONE).reconstruction.main
    onset, change = unit.body[0].contact.start, unit.body[0].event
    (half,) = delta_v_half_widths(unit, onset, np.array([change.delta_v.end]))
    rest_sd = unit.at_point.resting_force(STANDARD_GRAVITY)[1]
    moved = onset.rate[None] * onset.sd
    bound = body_delta_v_bound(
        unit.at_point.effects, change.delta_v.weights, rest_sd=rest_sd, at_ends=moved
    )
    np.testing.assert_allclose(half[:3], bound.half_width, rtol=1e-9)
    # The answer's bound has the event's end as well, and is wider.
    assert (half[:3] <= np.array(change.bound.half_width) * (1.0 + 1e-9)).all()


def test_a_stated_delta_v_is_laid_over_with_its_bound():
    result = crash_case()
    spec = result.references[1].spec
    panel = figures_of().delta_v[0].panels[0]
    point = line(panel, "EDR")
    at = 1e3 * spec.over_s[1]
    assert (point.x[0], point.y[0]) == pytest.approx((at, 3.6 * spec.delta_v_m_per_s))
    bar = [one for one in panel.lines if one.name == "bar"][-1]
    assert np.ptp(bar.y) == pytest.approx(2 * TWO_SIDED_95 * 3.6 * 0.3)


def test_several_events_have_a_chart_each_and_none_has_none():
    two = figures_of("two-impacts", ALONE, (-0.1, 1.0))
    assert [c.slug for c in two.delta_v] == ["delta-v-1", "delta-v-2"]
    main = crash_case("two-impacts", ALONE, (-0.1, 1.0)).reconstruction.main
    assert main_event(main) == int(np.argmax([b.event.resultant for b in main.body]))
    none = figures_of("hard-braking", ALONE)
    assert not none.delta_v and none.pdof_by_window is None and none.severity is None
    assert none.units is None and none.accelerations is None and none.delta_v_budget is None
    nothing = crash_case("hard-braking", ALONE).reconstruction
    assert delta_v_chart(nothing.units, None) is None


def test_signals_are_as_recorded_and_marked_where_a_range_ends():
    result = crash_case(units=ALONE)
    recorded, unit = result.units[0], result.reconstruction.units[0]
    figures = figures_of(units=ALONE)
    low = recorded.accelerometers[0]
    panel = figures.signals.panels[0]
    raw = line(panel, f"{low.name}, as recorded")
    offset = result.reconstruction.synchronised.units[0].offset
    stamps = low.table.index.to_numpy() - offset
    there = np.interp(1e-3 * raw.x, stamps, low.table["accel_x"] / STANDARD_GRAVITY)
    np.testing.assert_allclose(raw.y, there, atol=1e-9)
    merged = line(panel, "merged, less bias")
    assert merged.y.min() < -10.0  # 12 g ahead
    held = line(panel, f"{low.name} at the end of its range")
    # ±2 g: at its end, but for the delay of its low-pass.
    assert held.y == pytest.approx(np.full(len(held.y), -2.0), abs=0.05)
    clipped = result.reconstruction.synchronised.units[0].accelerometers[0].clipped[:, 0]
    assert len(held.x) == int(clipped.sum())
    assert any(level.y == pytest.approx(-2.0, abs=0.01) for level in panel.levels)
    down = line(figures.signals.panels[2], "merged, less bias")
    assert down.y[0] == pytest.approx(-1.0, abs=0.05)
    zero, end = unit.events.events[0].time_zero, unit.events.events[0].end
    assert merged.x[0] >= 1e3 * (zero - 0.05) - 1e-6
    assert merged.x[-1] <= 1e3 * (end + 0.10) + 1e-6
    assert [(b.start, b.end) for b in figures.signals.bands] == [(1e3 * zero, 1e3 * end)]
    assert figures.rates is not None
    assert {b.label for b in figures.overview.bands} >= {"563 event"}


def test_signals_are_turned_into_vehicle_axes_and_missing_axes_spoil_no_other():
    C = Mounting(angles_deg=(0.0, 0.0, 90.0)).C_vs
    # Turned to the right: its forward is the vehicle's right, its right the vehicle's rear.
    values = np.array([[1.0, 2.0, 3.0], [1.0, np.nan, 3.0]])
    turned = in_vehicle_axes(values, C)
    np.testing.assert_allclose(turned[0], [-2.0, 1.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(turned[1, 1:], [1.0, 3.0], atol=1e-12)
    assert math.isnan(turned[1, 0])
    flags = flags_in_vehicle_axes(np.array([[False, True, False]]), C)
    np.testing.assert_array_equal(flags, [[True, False, False]])


def test_the_direction_by_window_goes_through_the_answer():
    found = crash_case().reconstruction
    chart = figures_of().pdof_by_window
    answer = found.main.types[0].direction.horizontal_deg
    mean = line(chart.panels[0], "mean of the recorders")
    assert np.interp(chart.marks[0].x, mean.x, mean.y) == pytest.approx(answer, abs=1e-6)
    bar = line(chart.panels[0], "bar")
    interval = found.main.body[0].event.interval.horizontal
    np.testing.assert_allclose(bar.y, [interval.low_deg, interval.high_deg])
    shift = line(figures_of().pdof_by_time_zero.panels[0], "IMU1")
    whole = found.main.body[0].event.delta_v
    table = pdof_by_shift(found.units[0].acceleration, whole.start, whole.end)
    np.testing.assert_allclose(shift.y, table["horizontal_deg"], atol=1e-9)


def test_a_direction_from_behind_does_not_jump():
    figures = figures_of("rear", ALONE)
    for chart in (figures.pdof_by_window, figures.pdof_by_time_zero):
        curve = line(chart.panels[0], "IMU1")
        assert np.abs(np.diff(curve.y)).max() < 90.0


def test_the_path_over_time_has_linear_and_sampled_bounds():
    result, figures = crash_case(), figures_of()
    path = result.reconstruction.main.path
    low, high = result.samples.interval(0.95)
    for k, (panel, axis) in enumerate(zip(figures.place.panels, NED, strict=True)):
        (fill,) = panel.fills
        half = TWO_SIDED_95 * path.sd[axis].to_numpy()
        np.testing.assert_allclose(fill.high - fill.low, 2.0 * half, atol=1e-12)
        ends = [one.y for one in panel.lines if one.name == "95 %, Monte Carlo"]
        own = path.table[axis].to_numpy()
        np.testing.assert_allclose(ends[0], own + low[:, 6 + k])
        np.testing.assert_allclose(ends[1], own + high[:, 6 + k])
    assert [p.y_label for p in figures.place.panels] == ["forward, m", "right, m", "down, m"]
    for panel, axis in zip(figures.attitude.panels, EULER, strict=True):
        (fill,) = panel.fills
        ends = [one for one in panel.lines if one.name == "95 %, Monte Carlo"]
        linear = float(fill.high[-1] - fill.low[-1])
        sampled = float(ends[1].y[-1] - ends[0].y[-1])
        # Quantiles of 400 runs are within 10 % of their own with three sigma.
        assert sampled == pytest.approx(linear, rel=0.2), axis


def test_sampled_angles_are_those_of_all_runs_together(monkeypatch):
    result = crash_case()
    path, errors = result.reconstruction.main.path, result.samples.errors
    turned = rotation.quaternion_from_rotation_vector(errors[:, -1, :3])
    true = rotation.euler_from_quaternion(rotation.compose(turned, path.q_nb[-1]))
    off = rotation.within_half_turn(true - rotation.euler_from_quaternion(path.q_nb[-1]))
    bounds = np.quantile(off, [0.025, 0.975], axis=0)
    whole = attitude_chart(path, samples=result.samples)
    # A few runs at a time, the last of them alone.
    monkeypatch.setattr(on_disk, "PART", 8 * 64 * 7)
    assert len(errors) % 7 == 1
    parts = attitude_chart(path, samples=result.samples)
    for k, (one, other) in enumerate(zip(whole.panels, parts.panels, strict=True)):
        ends = [line.y for line in other.lines if line.name == "95 %, Monte Carlo"]
        own = other.lines[0].y[-1]
        np.testing.assert_allclose([end[-1] - own for end in ends], bounds[:, k], atol=1e-10)
        for line, again in zip(one.lines, other.lines, strict=True):
            assert np.array_equal(line.y, again.y)


def test_a_reference_chart_has_the_errors_and_their_bound():
    compared = crash_case().references[0].path
    (chart,) = figures_of().references
    for panel, axis in zip(chart.panels, NED, strict=True):
        np.testing.assert_allclose(panel.lines[0].y, compared.errors[axis])
        np.testing.assert_allclose(panel.fills[0].high, compared.bound[axis])
    assert "consistent at the last instant" in chart.caption.replace("are ", "")


def test_units_against_each_other_are_the_comparison():
    comparison = crash_case().reconstruction.comparison
    chart = figures_of().units
    for one in comparison.against:
        for k, panel in enumerate(chart.panels):
            drawn = [c for c in panel.lines if c.name == one.name]
            np.testing.assert_allclose(drawn[0].y, one.difference[:, k])
            np.testing.assert_allclose(drawn[1].y, TWO_SIDED_95 * one.sd[:, k])
    assert len(figures_of().accelerations.panels[0].lines) == 3


def test_a_budget_adds_up_and_is_sorted():
    main = crash_case().reconstruction.main
    change = main.body[0].event
    np.testing.assert_allclose(
        np.sqrt((delta_v_budget(change) ** 2).sum()), change.bound.sd, rtol=1e-9
    )
    path_sd = main.path.sd[NED].iloc[-1]
    for chart, totals in (
        (figures_of().delta_v_budget, change.bound.sd[:2]),
        (figures_of().place_budget, path_sd[:2]),
    ):
        size = 0.0
        for panel, total in zip(chart.panels, totals, strict=True):
            top, parts = panel.bars
            assert panel.categories[0] == "total" and top.at[0] == 0
            assert top.values[0] == pytest.approx(total)
            assert math.sqrt((parts.values**2).sum()) == pytest.approx(total)
            size = size + parts.values**2
        last = -1 if chart.panels[0].categories[-1] == "others" else None
        assert (np.diff(size[:last]) <= 0.0).all()


def test_the_risk_lies_on_its_curve_within_the_model_s_range():
    result = crash_case()
    (answer,) = result.severity
    panel = figures_of().severity.panels[0]
    curve = panel.lines[0]
    dv = result.reconstruction.main.body[0].event.resultant
    # 120 pieces of 90 km/h: a chord of a curve of slope 0.164/mph is within 1e-3 of it.
    at = np.interp(3.6 * dv, curve.x, curve.y)
    assert at == pytest.approx(100.0 * answer.risk.probability, rel=1e-2)
    assert curve.x[-1] == pytest.approx(56.0 * 0.44704 * 3.6, abs=1e-3)
    point = panel.lines[2]
    assert point.low[0] < 3.6 * dv < point.high[0]
    assert risk_chart([], dv, 0.1) is None


def test_instants_that_are_one_are_named_together():
    main = crash_case().reconstruction.main
    named = path_moments(main.path, main.events.events)
    assert [name for name, _ in named][1] in ("time zero, entry", "entry, time zero")
    marks = marks_apart([(0.0, "a"), (0.01, "b"), (0.5, "c"), (2.0, "d")], -0.1, 1.0)
    assert [(m.x, m.label) for m in marks] == [(0.0, ""), (10.0, "a, b"), (500.0, "c")]
    assert event_marks([], 0.0, 1.0) == ()


@pytest.mark.parametrize(
    "which",
    [
        {},
        {"name": "hard-braking", "units": ALONE},
        {"units": ALONE, "end": 0.06},
        {"name": "two-impacts", "units": ALONE, "window": (-0.1, 1.0)},
    ],
    ids=["two units", "no event", "cut in the event", "two events"],
)
def test_every_chart_can_be_drawn_and_has_a_file_of_its_own(which):
    figures = figures_of(**which)
    slugs = [c.slug for c in figures.charts] + [p.slug for p in figures.pictures]
    assert len(set(slugs)) == len(slugs)
    for chart in figures.charts:
        assert "data-" in still(chart) and chart.caption
        for panel in chart.panels:
            for one in panel.lines:
                assert not np.isinf(one.y).any() and one.x.shape == one.y.shape


def test_hostile_names_are_escaped_in_charts():
    found = crash_case(units=ALONE).reconstruction
    unit = replace(found.units[0], name="<b>$x$ & _y</b>")
    chart = delta_v_chart([unit], None)
    assert "&lt;b&gt;$x$ &amp; _y&lt;/b&gt;" in still(chart)
    assert "<b>" not in still(chart)
