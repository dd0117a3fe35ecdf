"""Differences of trajectories against exact geometry, another library and plain rotations."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import DataError
from strapdown.evaluation.trajectory_differences import (
    ROTATION_ERROR,
    interpolation_cost,
    summarise_differences,
    trajectory_at,
    trajectory_differences,
)
from strapdown.frames import (
    ecef_from_geodetic,
    geodetic_from_ecef,
    place_difference,
    q_ne,
)
from strapdown.tables import EULER, NED, TRAJECTORY_ERROR, VELOCITY, trajectory_table

_spec = importlib.util.spec_from_file_location(
    "made_trajectories", Path(__file__).with_name("made_trajectories.py")
)
made = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(made)

# Degrees of 180 carry 1.4e-14, metres of 6.4e6 carry 1e-9: a difference of places is right to
# a few of either.
ROUNDING = 5e-9  # m
EARTH = 6.37e6  # m


def one(lat, lon, alt=0.0, time=0.0, velocity=(0, 0, 0), euler=(0, 0, 0)):
    return trajectory_table([time], [[lat, lon, alt]], [velocity], [euler], "one")


# --- places ------------------------------------------------------------------------------------


def test_places_go_to_the_earths_axes_and_back():
    import pymap3d

    rng = np.random.default_rng(3)
    place = rng.uniform([-90, -180, -5000], [90, 180, 400_000], (2000, 3))
    place[:4, 0] = [90, -90, 0, 89.9999999]
    for ellipsoid in ELLIPSOIDS.values():
        r = ecef_from_geodetic(place, ellipsoid=ellipsoid)
        a, b = ellipsoid.semi_major_axis, ellipsoid.semi_minor_axis
        theirs = np.column_stack(pymap3d.geodetic2ecef(*place.T, ell=pymap3d.Ellipsoid(a, b)))
        assert np.abs(r - theirs).max() < ROUNDING
        back = geodetic_from_ecef(r, ellipsoid=ellipsoid)
        # 1e-9 m of 6.4e6 m is 1e-14 deg; the longitude of a place near a pole is another matter.
        assert np.abs(back[:, 0] - place[:, 0]).max() < 5e-14
        assert np.abs(back[:, 2] - place[:, 2]).max() < ROUNDING
        assert np.abs(ecef_from_geodetic(back, ellipsoid=ellipsoid) - r).max() < ROUNDING


def test_the_local_level_stands_on_the_ellipsoid():
    # The gradient of x²/a² + y²/a² + z²/b² at height zero points up.
    place = np.array([[47.0, -122.0, 0.0], [-33.0, 151.0, 0.0]])
    r = ecef_from_geodetic(place)
    a, b = ELLIPSOIDS["wgs84"].semi_major_axis, ELLIPSOIDS["wgs84"].semi_minor_axis
    up = r / np.array([a * a, a * a, b * b])
    up /= np.linalg.norm(up, axis=1)[:, None]
    q_en = rotation.conjugate(q_ne(*place[:, :2].T))
    assert np.abs(rotation.rotate(q_en, [0.0, 0.0, -1.0]) - up).max() < 1e-14
    # East has no z, and points to where longitude grows.
    east = rotation.rotate(q_en, [0.0, 1.0, 0.0])
    lon = np.radians(place[:, 1])
    expected = np.column_stack([-np.sin(lon), np.cos(lon), 0 * lon])
    assert np.abs(east - expected).max() < 1e-14


# pandas 3.1 warns of an argument that pyins passes.
@pytest.mark.filterwarnings("ignore:The inplace keyword")
@pytest.mark.parametrize("start", [(55, 37, 150), (-33, 151, 0), (0, 0, 0), (70, -120, 9000)])
def test_as_pyins_has_it(start):
    from pyins.transform import compute_state_difference

    est = made.random_trajectory(1, start=start)
    rng = np.random.default_rng(2)
    shift = rng.normal(size=(200, 3)) * [5e-4, 5e-4, 10.0]
    ref = made.perturbed(est, -shift, rng.normal(size=(200, 3)), rng.normal(size=(200, 3)) * 2.0)
    mine = trajectory_differences(est, ref)
    theirs = compute_state_difference(est.rename_axis(None), ref.rename_axis(None))[
        TRAJECTORY_ERROR
    ]
    # Arcs over radii there, a straight line here: the lengths of d = 200 m differ by d³/24R², and
    # the meridians converge by d/R tan(lat), which counts by its square.
    d = float(np.linalg.norm(mine[NED[:2]], axis=1).max())
    bound = d * (d / EARTH) ** 2 * (1.0 + np.tan(np.radians(start[0])) ** 2)
    # Heights differ over the chord in place of the mean height: by the angle of the verticals.
    assert np.abs(mine[NED] - theirs[NED]).to_numpy().max() < bound + 1e-6 * (d / EARTH) + 2e-9
    assert np.abs(mine[VELOCITY] - theirs[VELOCITY]).to_numpy().max() < 1e-13
    # Theirs is wrapped by a remainder of 360, which rounds at 1e-13.
    assert np.abs(mine[EULER] - theirs[EULER]).to_numpy().max() < 2e-13
    assert mine.attrs["interpolated"] == 0
    assert mine.attrs["findings"] == ()


def test_equal_trajectories_differ_by_nothing_at_all():
    est = made.random_trajectory(5)
    assert not trajectory_differences(est, est).to_numpy().any()


def test_exchanged_places_give_the_opposite():
    rng = np.random.default_rng(8)
    a, b = rng.uniform([-90, -180, 0], [90, 180, 1e4], (2, 50, 3))
    line = place_difference(a, b)
    assert np.abs(line + place_difference(b, a)).max() < 1e-8
    straight = ecef_from_geodetic(a) - ecef_from_geodetic(b)
    lengths = [np.linalg.norm(v, axis=1) for v in (line, straight)]
    assert np.abs(lengths[0] - lengths[1]).max() < 1e-8


def test_over_the_date_line():
    d = trajectory_differences(one(10.0, -179.9999), one(10.0, 179.9999))
    same = trajectory_differences(one(10.0, 0.0001), one(10.0, -0.0001))
    assert d["east"].iloc[0] > 21.0
    assert np.abs((d - same)[NED].to_numpy()).max() < ROUNDING
    # Longitudes a turn apart are one place: radians of 540 deg carry 1e-15 of 6.4e6 m.
    turn = trajectory_differences(one(10.0, 200.0), one(10.0, -160.0))
    assert np.abs(turn[NED].to_numpy()).max() < 2e-8


def test_over_the_pole():
    d = place_difference(np.array([[89.999, 0.0, 0.0]]), np.array([[89.999, 180.0, 0.0]]))[0]
    # Two thousandths of a degree along a meridian whose radius at the pole is a²/b.
    a, b = ELLIPSOIDS["wgs84"].semi_major_axis, ELLIPSOIDS["wgs84"].semi_minor_axis
    assert np.linalg.norm(d[:2]) == pytest.approx(a * a / b * np.radians(0.002), rel=1e-8)
    assert abs(d[2]) < ROUNDING


@pytest.mark.parametrize("km", [1, 100, 1000])
def test_far_places_of_one_height_differ_in_no_height(km):
    angle = np.degrees(km * 1000.0 / 6378137.0)
    # Along the equator, a circle: the chord 2 a sin(angle/2), all of it east, none of it down.
    d = place_difference(np.array([[0.0, angle, 0.0]]), np.array([[0.0, 0.0, 0.0]]))[0]
    chord = 2.0 * 6378137.0 * np.sin(np.radians(angle) / 2.0)
    assert np.abs(d - [0.0, chord, 0.0]).max() < ROUNDING
    # With a difference of height, that difference but for 1/8 of the angle squared, which is what
    # the two meanings of midway (the mean vertical, the middle of the line) differ by, too.
    d = place_difference(np.array([[0.0, angle, 500.0]]), np.array([[0.0, 0.0, 0.0]]))[0]
    assert abs(d[2] + 500.0) < 500.0 * np.radians(angle) ** 2 / 8.0 * 1.01 + ROUNDING
    # On a meridian of the ellipsoid the two verticals are unequally far from the middle one, to
    # the first order of the flattening and the third of the angle: less than e² d³/R².
    lats = 45.0 + np.array([-0.5, 0.5]) * angle
    places = np.column_stack([lats, [20.0, 20.0], [0.0, 0.0]])
    d = place_difference(places[:1], places[1:])[0]
    metres = km * 1000.0
    assert abs(d[2]) < 0.0067 * metres**2 / EARTH + ROUNDING


# --- attitudes ---------------------------------------------------------------------------------


def test_the_rotation_is_what_was_put_on():
    rng = np.random.default_rng(4)
    ref = made.random_trajectory(6)
    # Small and large turns about north, east and down, put on from the left.
    phi = rng.uniform(-1.0, 1.0, (200, 3)) * np.repeat([1e-9, 1e-3, 0.5, 1.7], 50)[:, None]
    q = rotation.compose(
        rotation.quaternion_from_rotation_vector(phi), rotation.quaternion_from_euler(ref[EULER])
    )
    est = ref.copy()
    est[EULER] = rotation.euler_from_quaternion(q)
    d = trajectory_differences(est, ref)
    # The angles of the table carry 360 deg times the rounding of a double, 6e-14 deg, thrice, and
    # more where the pitch is steep (80 deg: 1/cos = 6).
    assert np.abs(d[ROTATION_ERROR].to_numpy() - np.degrees(phi)).max() < 1e-12


@pytest.mark.parametrize(
    ("euler", "column"), [((0, 0, 1), "phi_D"), ((1, 0, 0), "phi_N"), ((0, 1, 0), "phi_E")]
)
def test_the_sign_is_estimate_minus_reference(euler, column):
    est = one(10.0, 20.0, euler=euler)
    d = trajectory_differences(est, one(10.0, 20.0)).iloc[0]
    assert d[column] == pytest.approx(1.0, abs=1e-13)
    assert d[EULER].tolist() == list(euler)
    others = [c for c in ROTATION_ERROR if c != column]
    assert np.abs(d[others].to_numpy()).max() < 1e-13


def test_headings_are_wrapped():
    d = trajectory_differences(one(0, 0, euler=(0, 0, 359.5)), one(0, 0, euler=(0, 0, 0.5)))
    assert d["heading"].iloc[0] == -1.0
    d = trajectory_differences(one(0, 0, euler=(179, 0, 0)), one(0, 0, euler=(-179, 0, 0)))
    assert d["roll"].iloc[0] == -2.0


# --- interpolation -----------------------------------------------------------------------------


def test_an_interpolated_reference_is_right_to_its_orders():
    stamps = np.arange(0.0, 40.0, 0.01)
    worst = []
    for step in (1.0, 0.5):
        ref = made.weaving(np.arange(0.0, 40.0 + step, step))
        d = trajectory_differences(made.weaving(stamps, source="est"), ref)
        worst.append([np.linalg.norm(d[c], axis=1).max() for c in (NED, VELOCITY, ROTATION_ERROR)])
        # h⁴/384 of the fourth derivatives 5 w⁴ and 30·0.4⁴, h²/8 of the jerks 5 w³ and 12·0.4².
        assert worst[-1][0] < step**4 / 384 * np.hypot(5 * 0.6**4, 30 * 0.4**4) * 1.01
        assert worst[-1][1] < step**2 / 8 * np.hypot(5 * 0.6**3, 12 * 0.4**2) * 1.01
        # What is judged without knowing the truth, from rows twice as far apart, is near it.
        cost = interpolation_cost(ref)
        told = [cost.position_m, cost.velocity_m_s, cost.rotation_deg]
        assert np.all(np.array(told) > 0.8 * np.array(worst[-1]))
        assert np.all(np.array(told) < 1.3 * np.array(worst[-1]))
    orders = np.log2(np.array(worst[0]) / worst[1])
    assert np.abs(orders - [4.0, 2.0, 2.0]).max() < 0.1


def test_interpolation_over_the_pole_and_the_date_line():
    # A great circle through the pole at constant height and speed, on a meridian and its opposite.
    speed, a = 250.0, 6378137.0
    ellipsoid = ELLIPSOIDS["wgs84"]
    polar = a * a / ellipsoid.semi_minor_axis
    t = np.arange(-50.0, 51.0, 10.0) + 5.0
    # Near the pole the meridian is a circle of radius a²/b, but for e² times the angle squared.
    lat = 90.0 - np.degrees(np.abs(speed * t) / polar)
    lon = np.where(t < 0, 30.0, -150.0)
    north = np.where(t < 0, speed, -speed)
    zero = np.zeros_like(t)
    heading = np.where(t < 0, 0.0, 180.0)
    ref = trajectory_table(
        t,
        np.column_stack([lat, lon, zero]),
        np.column_stack([north, zero, zero]),
        np.column_stack([zero, zero, heading]),
        "ref",
    )
    mid = trajectory_at(ref, [-5.0, 0.0, 5.0])
    # Rows at ±5 s are rows; at 0 the pole itself, within e² (1250 m/R)² of 1250 m.
    assert mid["lat"].iloc[1] == pytest.approx(90.0, abs=1e-9)
    # The sag of a circle is kept by the cubic to the fourth order: 2500⁴/(384 R³) = 4e-10 m, and
    # the rounding of heights.
    assert abs(mid["alt"].iloc[1]) < 1e-3
    moved = place_difference(
        mid[["lat", "lon", "alt"]].to_numpy()[[1]], mid[["lat", "lon", "alt"]].to_numpy()[[0]]
    )[0]
    assert np.linalg.norm(moved) == pytest.approx(1250.0, rel=1e-6)
    # Velocity is horizontal, 250 m/s, but for the chord of two that are turned by 2500 m/R.
    v = mid[VELOCITY].to_numpy()[1]
    assert np.linalg.norm(v) == pytest.approx(250.0, rel=1e-7)

    east = made.weaving(np.arange(0.0, 100.0, 1.0), lon0=179.995)
    east["lon"] = (east["lon"] + 180.0) % 360.0 - 180.0
    fine = made.weaving(np.arange(0.0, 99.0, 0.1), lon0=179.995, source="est")
    fine["lon"] = (fine["lon"] + 180.0) % 360.0 - 180.0
    assert fine["lon"].min() < 0.0 < fine["lon"].max()
    assert trajectory_differences(fine, east)[NED].abs().to_numpy().max() < 0.01


def test_rows_with_the_same_stamp_are_taken_as_they_are():
    time = 0.1 * np.arange(100)
    ref = made.weaving(time)
    # 0.1 k in another rounding: every end is a unit in the last place beyond the reference's.
    stamps = np.nextafter(time, np.inf)
    assert np.array_equal(trajectory_at(ref, stamps).to_numpy(), ref.to_numpy())
    # Summed up, the stamps are off by some ten units, which moves nothing by as much.
    stamps = np.cumsum(np.full(100, 0.1)) - 0.1
    assert np.abs(stamps - time).max() > 1e-14
    d = trajectory_differences(made.weaving(stamps, source="est"), ref)
    assert len(d) == 100
    assert d.attrs["interpolated"] == 0
    assert d.attrs["findings"] == ()
    assert np.abs(d[NED].to_numpy()).max() < ROUNDING


def test_only_what_the_reference_spans_is_compared():
    ref = made.weaving(np.arange(10.0, 20.5, 0.5))
    est = made.weaving(np.arange(0.0, 30.0, 0.25), source="est")
    d = trajectory_differences(est, ref)
    assert (d.index[0], d.index[-1]) == (10.0, 20.0)
    assert d.attrs["interpolated"] == 20
    (finding,) = d.attrs["findings"]
    assert "20 instants" in finding.what
    assert "is up to" in finding.what
    assert finding.file == "ref"


def test_gaps_of_the_reference_are_named():
    time = np.arange(0.0, 50.0, 0.5)
    ref = made.weaving(time[(time < 20.2) | (time > 24.8)])
    d = trajectory_differences(made.weaving(np.arange(0.0, 49.0, 0.25), source="est"), ref)
    gap, cost = d.attrs["findings"]
    assert "19 instants of the estimate are in 1 gaps of the reference" in gap.what
    assert "longest is 5 s at 20 s" in gap.what
    # The cost that is told knows of the gap.
    worst = np.linalg.norm(d[NED], axis=1).max()
    told = float(cost.what.split("is up to ")[1].split(" m")[0])
    assert 0.3 * worst < told < 10.0 * worst


def test_a_reference_of_two_rows():
    ref = made.weaving([0.0, 1.0])
    d = trajectory_differences(made.weaving([0.0, 0.5, 1.0], source="est"), ref)
    assert "is not known" in d.attrs["findings"][0].what


# --- errors ------------------------------------------------------------------------------------


def test_no_common_span():
    ref = made.weaving(np.arange(100.0, 110.0, 1.0))
    with pytest.raises(
        DataError,
        check=lambda refused: (
            refused.finding.code == "evaluation.estimate-no-instant-within-reference"
        ),
    ):
        trajectory_differences(made.weaving(np.arange(0.0, 5.0, 1.0), source="est"), ref)
    with pytest.raises(DataError, check=coded("evaluation.estimate-no-instant-within-reference-2")):
        trajectory_differences(
            made.weaving([0.0, 9.0], source="est"), made.weaving([2.0, 3.0, 4.0])
        )
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "evaluation.outside-span"
    ):
        trajectory_at(ref, [99.0, 100.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p[[1, 0, 2]], "latitude and longitude are swapped"),
        (lambda p: p * [np.pi / 180, np.pi / 180, 1], "the estimate's .* are radians"),
        (lambda p: p * [1, -1, 1], "longitude positive to the west"),
    ],
)
def test_places_that_are_meant_otherwise(change, message):
    place = np.array([48.2, 16.4, 200.0])
    with pytest.raises(DataError, match=message) as error:
        trajectory_differences(one(*change(place)), one(*place))
    assert "Remedy" in str(error.value)


def test_a_reference_in_radians():
    with pytest.raises(DataError, check=coded("evaluation.reference-in-radians")):
        trajectory_differences(one(48.2, 16.4), one(*np.radians([48.2, 16.4])))


def test_trajectories_that_are_merely_far_apart():
    d = trajectory_differences(one(48.2, 16.4), one(50.0, 14.0))
    assert "begin 266 km apart" in d.attrs["findings"][0].what


# --- summary -----------------------------------------------------------------------------------


def test_the_summary():
    ref = made.weaving([0.0, 1.0, 2.0, 3.0])
    est = ref.copy()
    est["alt"] += [0.0, -3.0, 4.0, -1.0]
    est["VN"] += [3.0, 0.0, 0.0, 3.0]
    est["VE"] += [4.0, 0.0, 0.0, -4.0]
    est["heading"] += [0.0, 0.0, 2.0, 1.0]
    summary = summarise_differences(trajectory_differences(est, ref))
    down = summary["down"]
    assert (down.rms, down.largest, down.largest_at, down.final) == pytest.approx(
        (np.sqrt(26 / 4), 4.0, 2.0, 1.0), abs=ROUNDING
    )
    assert summary["horizontal"].largest < 2e-9
    assert summary["position"].rms == pytest.approx(np.sqrt(26 / 4), abs=ROUNDING)
    assert summary["velocity"].largest == 5.0
    assert summary["velocity"].rms == pytest.approx(np.sqrt(50 / 4))
    assert summary["VE"].final == -4.0
    # Pitch and roll leave the length of the turn as it is: heading is the outermost.
    assert summary["rotation"].largest == pytest.approx(2.0, abs=1e-12)
    assert summary["rotation"].largest_at == 2.0
    assert summary.samples == 4
    table = summary.to_pandas()
    assert list(table.columns) == ["unit", "rms", "largest", "largest_at", "final"]
    assert table.loc["down", "largest"] == down.largest
    text = str(summary)
    assert text.startswith("ref minus ref, 0 to 3 s, 4 instants")
    assert "horizontal velocity m/s" in text
    with pytest.raises(DataError, check=coded("evaluation.no-error")):
        summary["nort"]


def test_the_summary_in_a_notebook_escapes_names():
    est = one(1.0, 2.0)
    est.attrs["source"] = "<b>"
    html = summarise_differences(trajectory_differences(est, one(1.0, 2.0)))._repr_html_()
    assert "&lt;b&gt;" in html
    assert "<b>&" in html


def test_a_summary_without_rotation():
    d = trajectory_differences(one(1.0, 2.0), one(1.0, 2.0))
    assert "rotation" not in summarise_differences(d[TRAJECTORY_ERROR]).to_pandas().index
    with pytest.raises(DataError, check=coded("evaluation.table-no-rows")):
        summarise_differences(d.iloc[:0])
