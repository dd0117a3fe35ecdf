"""Pictures of a crash: what is in them is what was found, to scale, readable and escaped."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.stats import chi2
from tests.unit.report.crash_results import HOSTILE, crash_case, figures_in, figures_of

from strapdown import rotation
from strapdown.config.crash_case import PointSpec, VehicleSpec
from strapdown.crash.pdof import AngleInterval
from strapdown.report.crash_document import _points, crash_document, reference_in_path_axes
from strapdown.report.crash_outline import (
    angle_words,
    interval_words,
    path_moments,
    vehicle_outline,
)
from strapdown.report.crash_pictures import (
    Direction,
    MountingPoint,
    PointChange,
    conventions_picture,
    elevation_dial,
    pdof_dial,
    points_picture,
)
from strapdown.report.crash_plan import (
    MOST_FRAMES,
    PlanFrame,
    path_animation,
    path_plan,
    vehicle_body,
)
from strapdown.report.plan import ellipse, envelope, hull
from strapdown.report.svg_drawing import (
    SMALL,
    Drawing,
    nice_step,
    overlap,
    shortened,
    text_width,
    tick_words,
)
from strapdown.report.values import plain
from strapdown.tables import ACCEL, NED

CAR = vehicle_outline(VehicleSpec(length_m=4.4, width_m=1.8, front_m=2.0))
SVG = "{http://www.w3.org/2000/svg}"


def texts(svg):
    """Every line of text of a picture: words, size, box."""
    measure, found = Drawing(1.0, 1.0), []
    for one in ElementTree.fromstring(svg).iter(f"{SVG}text"):
        size = float(one.get("font-size"))
        at = float(one.get("x")), float(one.get("y")) - 0.35 * size
        turn = re.match(r"rotate\((\S+)", one.get("transform", ""))
        box = measure.box_of(
            at,
            one.text or "",
            size,
            anchor=one.get("text-anchor", "start"),
            bold=one.get("font-weight") == "bold",
            turn=float(turn.group(1)) if turn else 0.0,
        )
        found.append((one.text or "", size, box))
    return found


def check_readable(picture):
    """All text is large enough, within the picture, and no two lie on each other."""
    root = ElementTree.fromstring(picture.svg)
    width, height = float(root.get("width")), float(root.get("height"))
    found = texts(picture.svg)
    assert found
    for words, size, (left, top, right, bottom) in found:
        assert size >= 9.0, words
        assert left >= -1.0 and top >= -1.0, words
        assert right <= width + 1.0 and bottom <= height + 1.0, words
    for (a, _, first), (b, _, second) in combinations(found, 2):
        # Boxes have a fifth of a line above and below the letters.
        assert overlap(first, second) < 25.0, (a, b)


def test_an_outline_is_as_long_and_wide_as_the_vehicle_and_its_front_is_where_it_is_stated():
    np.testing.assert_allclose(CAR.low, [-2.4, -0.9])
    np.testing.assert_allclose(CAR.high, [2.0, 0.9])
    assert vehicle_outline(VehicleSpec(length_m=5.0)).high[0] == pytest.approx(2.5)
    # The windscreen is in the front half: one sees where the front is.
    assert CAR.windows[0][:, 0].min() > 0.5 * (CAR.low[0] + CAR.high[0]) - 0.1 * 4.4
    stated = ((3.0, 1.0), (3.0, -1.0), (-4.0, 0.0))
    own = vehicle_outline(VehicleSpec(outline_m=stated))
    assert own.stated
    np.testing.assert_array_equal(own.body, stated)
    assert own.windows[0][:, 0].min() > 1.0


def test_an_outline_is_placed_by_its_reference_point_and_heading():
    # Heading 90 deg: forward is the second axis, right is the negative first.
    there = CAR.placed((10.0, 20.0), 90.0, (1.0, 0.5))
    np.testing.assert_allclose(there.high, [10.0 + 0.9 + 0.5, 20.0 + 2.0 - 1.0])
    np.testing.assert_allclose(there.low, [10.0 - 0.9 + 0.5, 20.0 - 2.4 - 1.0])
    assert CAR.edge((0.0, 0.0), 0.0) == pytest.approx(2.0)
    assert CAR.edge((0.0, 0.0), 180.0) == pytest.approx(2.4)
    assert CAR.edge((0.0, 0.2), 90.0) == pytest.approx(0.7)
    assert CAR.edge((9.0, 0.0), 0.0) == 0.0


def test_a_body_stands_on_the_outline_and_shows_faces_towards_the_eye():
    body = vehicle_body(CAR)
    np.testing.assert_allclose(body.corners[:, :2].max(axis=0), CAR.high)
    # Half a turn of roll about a point: right becomes left, down becomes up.
    q = rotation.quaternion_from_euler([180.0, 0.0, 0.0])
    there = body.placed((1.0, 2.0, 3.0), q, (0.5, 0.0, 0.0))
    turned = (body.corners - [0.5, 0.0, 0.0]) * [1.0, -1.0, -1.0] + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(there, turned, atol=1e-12)
    down, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
    cap = len(body.faces) - body.cabin - 1
    seen = body.seen(body.corners, down)
    assert cap in seen and seen.index(cap) < seen.index(len(body.faces) - 1)
    assert cap not in body.seen(body.corners, up)


def direction(angle, low, high, **more):
    return Direction(
        "event 1", angle, AngleInterval(low, high), 12 if abs(angle) < 15 else 3, 5.0, **more
    )


def test_the_dial_says_the_direction_its_interval_and_the_clock():
    picture = pdof_dial(CAR, [direction(-8.0, -12.2, -4.1)])
    words = [t for t, _, _ in texts(picture.svg)]
    assert "−8.0°, 12 o'clock" in words
    assert "95 %: −12.2° to −4.1°" in words
    assert "change of velocity 5.0 m/s (18.0 km/h)" in words
    assert "−8.0° (−12.2° to −4.1°)" in picture.alt
    assert {str(h) for h in range(1, 13)} <= set(words)
    check_readable(picture)


def arrows(svg):
    """Tips of filled arrow heads: the first corner of four."""
    heads = [
        [tuple(map(float, p.split(","))) for p in one.get("points").split()]
        for one in ElementTree.fromstring(svg).iter(f"{SVG}polygon")
        if one.get("stroke") is None
    ]
    return [h for h in heads if len(h) == 4]


def test_the_arrow_comes_from_where_the_force_came():
    # From the right: on the right of the dial, pointing left.
    (head,) = arrows(pdof_dial(CAR, [replace(direction(90.0, 80.0, 100.0), interval=None)]).svg)
    tip, neck = np.array(head[0]), np.array(head[2])
    assert tip[0] > 165.0 and neck[0] > tip[0]
    assert tip[1] == pytest.approx(neck[1], abs=0.02)
    # From the front: above, pointing down the page.
    (head,) = arrows(pdof_dial(CAR, [replace(direction(0.0, -9.0, 9.0), interval=None)]).svg)
    assert head[0][1] > head[2][1] and head[0][1] < 142.0


def test_an_undetermined_direction_is_a_ring_and_no_event_is_said():
    nothing = AngleInterval(-180.0, 180.0, undetermined=True)
    picture = pdof_dial(CAR, [replace(direction(40.0, 0.0, 80.0), interval=nothing)])
    words = [t for t, _, _ in texts(picture.svg)]
    assert "undetermined" in words
    assert not any("o'clock" in t for t in words)
    ring = max(
        (p.get("points") for p in ElementTree.fromstring(picture.svg).iter(f"{SVG}polygon")),
        key=len,
    )
    points = np.array([list(map(float, p.split(","))) for p in ring.split()])
    assert np.ptp(points, axis=0) == pytest.approx([236.0, 236.0], abs=0.1)
    check_readable(picture)
    picture = pdof_dial(CAR, [])
    assert any("no event" in t for t, _, _ in texts(picture.svg))
    check_readable(picture)


def test_every_recorder_is_on_the_dial_by_number_and_name():
    units = [
        replace(direction(a, a - 4.0, a + 4.0), name=n, number=k, main=False)
        for k, (n, a) in enumerate([("IMU1", -9.0), ("B-pillar, left " * 4, -8.5), ("C", 91.0)])
    ]
    for small in (False, True):
        picture = pdof_dial(CAR, [direction(-8.0, -12.0, -4.0)], recorders=units, small=small)
        words = [t for t, _, _ in texts(picture.svg)]
        # A number at its direction, and one beside its name.
        assert [words.count(n) for n in ("1", "2", "3")] == [3, 3, 3]
        assert "IMU1" in words and "C" in words
        assert "91.0° (87.0° to 95.0°), 3 o'clock" in words
        check_readable(picture)


@pytest.mark.parametrize(
    ("azimuth", "right"), [(0.0, True), (170.0, False), (92.0, True), (-88.0, False)]
)
def test_the_elevation_is_that_of_the_force(azimuth, right):
    # From the front or the right it comes from the right of the picture, from above downward.
    one = replace(
        direction(azimuth, azimuth - 5.0, azimuth + 5.0),
        vertical_deg=30.0,
        vertical=AngleInterval(20.0, 40.0),
    )
    picture = elevation_dial(CAR, one, [replace(one, name="IMU1", number=0)])
    (head,) = arrows(picture.svg)
    tip, neck = np.array(head[0]), np.array(head[2])
    along = tip - neck
    assert math.degrees(math.atan2(along[1], abs(along[0]))) == pytest.approx(30.0, abs=0.2)
    assert (along[0] < 0.0) == right
    words = [t for t, _, _ in texts(picture.svg)]
    assert "30.0° (20.0° to 40.0°), from above" in words
    check_readable(picture)


def test_measuring_points_have_their_change_of_velocity():
    changes = [
        PointChange(MountingPoint("IMU1", (0.6, -0.5, 0.0), 0), (-6.0, 1.0, 0.0), 0.01 * np.eye(3)),
        PointChange(MountingPoint("IMU2", (0.6, 0.5, 0.0), 1), (-3.0, 0.5, 0.0), 0.01 * np.eye(3)),
    ]
    picture = points_picture(CAR, changes)
    first, second = (np.array(head[0]) for head in arrows(picture.svg))
    rings = [
        np.array([float(one.get("cx")), float(one.get("cy"))])
        for one in ElementTree.fromstring(picture.svg).iter(f"{SVG}circle")
    ][:2]
    # Down the page and to the right, at one scale.
    np.testing.assert_allclose(first - rings[0], 2.0 * (second - rings[1]), atol=0.05)
    assert (first - rings[0])[1] == pytest.approx(6.0 * (first - rings[0])[0], rel=1e-2)
    assert any("21.9 km/h" in t for t, _, _ in texts(picture.svg))
    check_readable(picture)


def test_a_point_has_the_change_that_its_own_accelerometers_felt():
    result = crash_case()
    for one, unit in zip(_points(result), result.reconstruction.units, strict=True):
        change = unit.body[0].event.delta_v
        prepared = unit.at_point.prepared
        time, force = prepared.imu.index.to_numpy(), prepared.imu[ACCEL].to_numpy()
        at_rest = unit.at_point.resting_force(9.80665)[0]
        own = np.array(
            [
                np.trapezoid(
                    np.interp(grid := np.linspace(change.start, change.end, 4001), time, column),
                    grid,
                )
                for column in (force - at_rest).T
            ]
        )
        # The angular acceleration at the ends of the contact, between samples of 5 ms: some 0.1
        # rad/s at a lever arm of 0.8 m.
        np.testing.assert_allclose(one.delta_v, own, atol=0.08)
        assert np.abs(own - change.vector).max() > 0.3


def test_several_events_stand_below_each_other_the_main_one_first():
    weak = direction(170.0, 150.0, 190.0, main=False)
    picture = pdof_dial(CAR, [weak, replace(direction(-8.0, -12.0, -4.0), name="event 2")])
    words = [t for t, _, _ in texts(picture.svg)]
    first = next(k for k, t in enumerate(words) if t.startswith("event 2: −8.0°"))
    second = next(k for k, t in enumerate(words) if t.startswith("event 1: 170°"))
    assert first < second
    # Beyond 180 the end of the interval is written on the other side.
    assert "150° to −170°" in words[second]
    check_readable(picture)


def test_angles_are_written_within_half_a_turn():
    assert angle_words(190.0, 0) == "−170°"
    assert angle_words(-180.0, 1) == "180.0°"
    assert angle_words(-0.04, 1) == "0.0°"
    assert interval_words(3.0, None) == ("3.0°", "")
    assert plain(-0.001, 2) == "0.00" and plain(-1.5, 1) == "−1.5"


@pytest.mark.parametrize(("sd", "turn"), [((2.0, 0.5), 0.6), ((1.0, 1.0), 0.0), ((3.0, 0.0), 1.0)])
def test_an_ellipse_holds_95_percent(sd, turn):
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, -s], [s, c]])
    covariance = axes @ np.diag(np.square(sd)) @ axes.T
    ring = (ellipse(np.array([5.0, 6.0]), covariance) - [5.0, 6.0]) @ axes
    reach = math.sqrt(chi2.ppf(0.95, 2))
    if min(sd) > 0.0:
        np.testing.assert_allclose(np.hypot(*(ring / sd).T), reach, rtol=1e-9)
    else:
        assert np.abs(ring[:, 1]).max() < 1e-9
        assert np.abs(ring[:, 0]).max() == pytest.approx(reach * sd[0], rel=0.01)


def test_the_envelope_leaves_no_gap_between_ellipses():
    places = np.array([[0.0, 0.0], [10.0, 0.0]])
    (area,) = envelope(places, np.tile(np.eye(2) * 0.01, (2, 1, 1)))
    half = 0.1 * math.sqrt(chi2.ppf(0.95, 2))
    # Half a corner of 28 is cut off at most: 1 - cos(pi/28) = 0.6 %.
    assert np.ptp(area, axis=0) == pytest.approx([10.0 + 2 * half, 2 * half], rel=0.007)
    square = hull(np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0.0]], float))
    assert sorted(map(tuple, square.tolist())) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert len(hull(np.zeros((5, 2)))) == 1


@pytest.mark.parametrize("names", [("north", "east"), ("forward", "right")])
def test_a_plan_has_one_scale_and_is_seen_from_above(names):
    points = np.array([[0.0, 0.0], [30.0, 4.0]])
    view = PlanFrame.of(points, names, (10.0, 20.0), 500.0, (100.0, 300.0))
    origin, first, second = view.pixels([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert np.hypot(*(first - origin)) == pytest.approx(np.hypot(*(second - origin)))
    a, b = first - origin, second - origin
    # From above the second axis is clockwise of the first; on a page y runs down.
    assert a[0] * b[1] - a[1] * b[0] > 0.0
    if names[0] == "north":
        assert a[1] < 0.0 and b[0] > 0.0
    for x, y in view.pixels(points):
        assert 10.0 <= x <= 510.0 and 20.0 <= y <= 20.0 + view.height


def test_ticks_are_round():
    assert [nice_step(v) for v in (0.03, 1.0, 1.1, 6.0, float("nan"))] == [
        0.05,
        1.0,
        2.0,
        10.0,
        1.0,
    ]
    assert [tick_words(v, s) for v, s in ((-0.2, 0.1), (-0.0, 0.5), (20.0, 5.0))] == [
        "−0.2",
        "0.0",
        "20",
    ]


CASES = [
    {},
    {"name": "rear", "units": ("IMU1",)},
    {"name": "side", "units": ("IMU1",)},
    {"name": "two-impacts", "units": ("IMU1",), "window": (-0.1, 1.0)},
    {"name": "hard-braking", "units": ("IMU1",)},
    {"units": ("IMU1",), "end": 0.06},
    {"units": ("IMU1",), "window": (0.0, 0.02)},
]


@pytest.mark.parametrize("which", CASES, ids=lambda c: "-".join(map(str, c.values())) or "pole")
def test_every_picture_is_readable_and_a_whole_svg(which):
    for picture in figures_of(**which).pictures:
        check_readable(picture)
        assert picture.alt and picture.caption and picture.title
        assert "nan" not in re.sub(r"<text.*?</text>|<title>.*?</title>", "", picture.svg)


def test_the_plan_tells_entry_end_and_instants():
    result = crash_case()
    main = result.reconstruction.main
    figures = figures_of()
    end = main.path.table[NED].iloc[-1]
    assert f"ends {plain(end['north'], 2)} m forward" in figures.path.alt
    words = [t for t, _, _ in texts(figures.path.svg)]
    assert "entry 7.1 m/s (25.6 km/h)" in words
    assert "cameras" in words
    named = path_moments(main.path, main.events.events)
    for name, at in named:
        assert name == "begin" or f"{name}, {plain(1e3 * at, 0)} ms" in words
    # The path is 1.1 m long, the car 4.5 m: it is shown larger beside.
    assert any("times larger" in t for t in words)
    long = figures_of("rear", ("IMU1",))
    assert not any("times larger" in t for t, _, _ in texts(long.path.svg))


def test_a_reference_is_drawn_where_it_was_compared():
    result = crash_case()
    answer = result.references[0]
    path = result.reconstruction.main.path
    found = reference_in_path_axes(path, answer)
    # It was moved by 2 m, and agrees at the entry.
    given = answer.table[NED].loc[found.index]
    moved = (given - found).to_numpy()
    np.testing.assert_allclose(moved, np.tile(moved[0], (len(moved), 1)), atol=1e-9)
    at = np.array([np.interp(0.0, found.index, found[c]) for c in NED])
    np.testing.assert_allclose(at, 0.0, atol=1e-9)


def test_a_path_without_length_and_error_is_drawn():
    path = crash_case("hard-braking", ("IMU1",)).reconstruction.main.path
    still = replace(
        path,
        table=path.table.assign(**dict.fromkeys(NED, 0.0)),
        errors=np.zeros_like(path.errors),
        noise_covariance=np.zeros_like(path.noise_covariance),
        entry=replace(path.entry, velocity=(0.0, 0.0, 0.0)),
    )
    picture = path_plan(still, CAR)
    check_readable(picture)
    assert "entry at rest" in [t for t, _, _ in texts(picture.svg)]
    animation = path_animation(still, CAR)
    check_readable(animation.stills)
    json.dumps(animation.scene.data(), allow_nan=False)


def test_the_animation_follows_the_path_and_is_small():
    case = crash_case("two-impacts", ("IMU1",), (-0.1, 1.0), None)
    path = case.reconstruction.main.path
    scene = figures_of("two-impacts", ("IMU1",), window=(-0.1, 1.0)).motion.scene
    data = scene.data()
    assert 2 <= len(data["frames"]) <= MOST_FRAMES
    assert len(json.dumps(data, allow_nan=False)) < 100_000
    # North, east, down of the reference point; a tenth of a millimetre.
    (body,) = data["bodies"]
    end = path.table[NED].iloc[-1].to_numpy()
    assert body["positions"][-1] == pytest.approx(end, abs=6e-5)
    car = vehicle_body(vehicle_outline(VehicleSpec()))
    corners = car.placed(end, path.q_nb[-1], (0.0, 0.0, 0.0))
    placed = rotation.rotate(np.array(body["q"][-1]), np.array(body["corners"])) + end
    np.testing.assert_allclose(placed, corners, atol=2e-3)
    assert (corners >= scene.low).all() and (corners <= scene.high).all()
    assert data["frames"][0] == "−100 ms"
    assert len(data["frames"]) == len(body["q"]) == len(body["positions"])


def test_the_conventions_show_where_units_and_point_are():
    units = [MountingPoint("IMU1", (0.6, -0.5, 0.2), 0), MountingPoint("LAB", (-0.3, 0.7, -0.3), 3)]
    picture = conventions_picture(CAR, units, point=(0.1, 0.0, 0.05), point_name="center of mass")
    words = [t for t, _, _ in texts(picture.svg)]
    assert "IMU1 (0.60, −0.50, 0.20) m" in words
    assert "center of mass (0.10, 0.00, 0.05) m" in words
    assert {"x forward", "y right", "z down", "roll +", "pitch +", "heading +", "PDOF +"} <= set(
        words
    )
    check_readable(picture)


def test_names_from_outside_are_text_and_nothing_else():
    result = crash_case()
    spec = result.spec.model_copy(update={"point": PointSpec.model_construct(name=HOSTILE)})
    answer = result.references[0]
    named = replace(answer, spec=answer.spec.model_copy(update={"name": HOSTILE}))
    units = [MountingPoint(HOSTILE, (0.0, 0.0, 0.0), 0)]
    figures = figures_in(crash_document(replace(result, spec=spec, references=(named,)), ""))
    for picture in (*figures.pictures, conventions_picture(CAR, units)):
        assert "<script" not in picture.svg and "\x00" not in picture.svg
        ElementTree.fromstring(picture.svg)
    assert "&lt;script&gt;" in figures.path.svg
    assert "<script" not in json.dumps(figures.motion.scene.data())


def test_long_names_are_cut_and_numbers_are_short():
    cut = shortened("a very long name " * 20, 100.0, SMALL)
    assert cut.endswith("…") and text_width(cut, SMALL) <= 100.0
    assert shortened("short", 100.0, SMALL) == "short"
    out = Drawing(10.0, 10.0)
    out.line((-0.0001, 1.0), (2.345678, 3.0))
    assert 'x1="0" y1="1" x2="2.35" y2="3"' in out.svg()
    out.shape([[np.nan, 1.0], [2.0, 3.0]])
    out.arrow((1.0, 1.0), (1.0, 1.0))
    assert out.svg().count("<p") == 0


def test_the_same_result_makes_the_same_bytes():
    first, second = figures_of(), figures_in(crash_document(crash_case(), ""))
    assert [p.svg for p in first.pictures] == [p.svg for p in second.pictures]
    assert first.motion.scene.data() == second.motion.scene.data()
