"""Two cameras give the path of a marker back: exactly, within what they state, and late."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from pushed_motion import Pushed

from strapdown import frames, rotation
from strapdown.errors import ConfigError, DataError
from strapdown.simulation.cameras import Camera, film, paper_cameras, path_from_cameras
from strapdown.simulation.earth_motion import Origin, StationaryMotion

MOTION = Pushed()
MARKER = (-0.4, 0.3, -0.5)
NED = ["north", "east", "down"]
SD = [f"{axis}_sd" for axis in NED]
# What a camera states of itself.
STATED = ("reading_sd", "position_sd", "angles_sd_deg", "focal_sd", "k1_sd", "clock_sd")


def knowing(camera, **more):
    """The camera without any error but those given."""
    return replace(camera, **dict.fromkeys(STATED, 0.0) | more)


def cameras(**more):
    top, side = paper_cameras()
    return knowing(top, **more), knowing(side, **more)


def filmed(pair, seed=0, motion=MOTION, **more):
    more = {"start": 1.95, "end": 2.6} | more
    return [film(motion, {"mark": MARKER}, c, impact=2.0, seed=seed, **more) for c in pair]


def truth(time, motion=MOTION):
    at = np.asarray(time) + 2.0
    moved = motion.position(at) - motion.position(np.array([2.0]))
    return moved + rotation.rotate(motion.attitude(at), MARKER)


def test_a_point_is_seen_where_geometry_puts_it():
    camera = Camera("c", (0, 0, -10), (0, 0, 2), (3, 0, 0), 1000.0, k1=-0.1)
    np.testing.assert_allclose(camera.pixels([[0.0, 0.0, 0.0]]), [[640.0, 512.0]])
    # One metre north is up, one metre east is right; ten metres away is a tenth of the focal
    # length, less the distortion.
    bent = 1000.0 * 0.1 * (1.0 - 0.1 * 0.01)
    found = camera.pixels([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(found, [[640.0, 512.0 - bent], [640.0 + bent, 512.0]], rtol=1e-15)
    assert np.isnan(camera.pixels([[0.0, 0.0, -20.0]])).all()
    assert np.isnan(camera.pixels([[8.0, 0.0, 0.0]])).all()


@pytest.mark.parametrize("k1", [-0.15, 0.0, 0.2])
def test_distortion_is_taken_back_to_rounding(k1):
    camera = Camera("c", (0, 0, 0), (0, 0, 1), (1, 0, 0), 1000.0, k1=k1)
    xy = np.random.default_rng(1).uniform(-0.45, 0.45, (200, 2))
    points = np.column_stack([-xy[:, 1], xy[:, 0], np.ones(200)]) * 7.0
    seen = camera.pixels(points)
    there = np.isfinite(seen[:, 0])
    assert there.sum() > 150
    # Pixels up to 1280 are rounded to 2.3e-13 px, and have 1000 to the unit; the lens magnifies
    # it at its edge, by 1/(1 - 3 0.15 0.4) at most, and Newton stops at 1e-15.
    np.testing.assert_allclose(camera.directions(seen[there]), xy[there], atol=1e-15 + 3e-16)


def test_without_errors_the_path_is_exact():
    pair = cameras()
    path = path_from_cameras(*filmed(pair), pair, marker="mark")
    assert len(path) == 651
    # Directions to 1e-15 at 8 m, solved with normal equations whose condition is near one.
    np.testing.assert_allclose(path[NED], truth(path.index), atol=5e-14)
    assert path["residual"].max() < 1e-11
    assert (path[SD] == 0.0).all().all()


def test_a_path_on_the_earth_is_that_of_its_local_frame():
    """A parked vehicle far from level: the marker is where its attitude puts it."""
    motion = StationaryMotion(3.0, Origin(45.0, 20.0, 100.0), 10.0, -20.0, 130.0)
    pair = cameras()
    tracks = filmed(pair, motion=motion)
    path = path_from_cameras(*tracks, pair, marker="mark")
    arm = rotation.rotate(motion.attitude(np.array([2.0]))[0], MARKER)
    # Places on the Earth are told to 1e-9 m.
    np.testing.assert_allclose(path[NED], np.tile(arm, (len(path), 1)), atol=5e-9)


def test_a_moving_vehicle_on_the_earth_turns_with_its_level():
    """North over the curved Earth, by the same conversion written out."""

    class Driven:
        duration, ellipsoid = 3.0, frames.WGS84

        def trajectory(self, time):
            lat = 45.0 + 0.01 * (np.asarray(time) - 2.0)
            return pd.DataFrame({"lat": lat, "lon": 20.0, "alt": 100.0})

        def attitude(self, time):
            return np.tile([1.0, 0.0, 0.0, 0.0], (np.size(time), 1))

    from strapdown.simulation.cameras import _scene

    place, q = _scene(Driven(), np.array([1.5, 2.0, 2.5]), 2.0)
    np.testing.assert_allclose(place[1], 0.0, atol=1e-9)
    np.testing.assert_allclose(q[1], [1.0, 0.0, 0.0, 0.0], atol=1e-15)
    # Farther north by 0.005 deg, north points down by as much: a negative pitch.
    np.testing.assert_allclose(rotation.euler_from_quaternion(q[2]), [0.0, -0.005, 0.0], atol=1e-12)
    assert place[2, 0] == pytest.approx(555.7, abs=0.3)
    assert place[2, 2] > 0.0


def test_readings_have_the_stated_standard_deviation():
    pair = cameras(reading_sd=0.5)
    path = path_from_cameras(*filmed(pair), pair, marker="mark")
    z = (path[NED].to_numpy() - truth(path.index)) / path[SD].to_numpy()
    # 651 independent frames on each axis; the mean stretch of the lens is right to 2 %.
    for axis in range(3):
        low, high = chi2.ppf([5e-7, 1 - 5e-7], len(path)) / len(path)
        assert 0.98 * low < (z[:, axis] ** 2).mean() < 1.02 * high
    # Four readings less three unknowns leave one: a mean square of a quarter.
    expected = 0.5**2 / 4
    low, high = chi2.ppf([5e-7, 1 - 5e-7], len(path)) / len(path)
    assert 0.98 * low < (path["residual"] ** 2).mean() / expected < 1.02 * high


@pytest.mark.slow
@pytest.mark.parametrize(
    "stated",
    [
        {"position_sd": 0.005},
        {"angles_sd_deg": 0.05},
        {"focal_sd": 0.002},
        {"k1_sd": 0.01},
        {"position_sd": 0.005, "angles_sd_deg": 0.05, "focal_sd": 0.001, "k1_sd": 0.01},
    ],
)
def test_a_calibration_has_the_stated_standard_deviation(stated):
    """One draw a seed, common to all frames: chi-square over seeds, at three frames."""
    pair, seeds, z = cameras(**stated), 150, []
    for seed in range(seeds):
        tracks = filmed(pair, seed, start=2.0, end=2.4)
        path = path_from_cameras(*tracks, pair, marker="mark").iloc[[0, 200, 400]]
        z.append((path[NED].to_numpy() - truth(path.index)) / path[SD].to_numpy())
    found = (np.array(z) ** 2).mean(axis=0)
    low, high = chi2.ppf([5e-7, 1 - 5e-7], seeds) / seeds
    # Propagated to first order: the second is a percent of it.
    assert (found > 0.97 * low).all()
    assert (found < 1.03 * high).all()


def test_everything_together_is_what_the_cameras_of_the_paper_state():
    pair, z = paper_cameras(), []
    for seed in range(100):
        path = path_from_cameras(*filmed(pair, seed, start=2.0, end=2.4), pair, marker="mark")
        z.append(((path[NED].to_numpy() - truth(path.index)) / path[SD].to_numpy())[[0, 200]])
    low, high = chi2.ppf([5e-7, 1 - 5e-7], 100) / 100
    assert ((np.array(z) ** 2).mean(axis=0) > 0.97 * low).all()
    assert ((np.array(z) ** 2).mean(axis=0) < 1.03 * high).all()


def test_a_late_clock_shows_the_vehicle_where_it_was():
    pair = tuple(replace(c, clock_offset=0.02, clock_sd=0.02) for c in cameras())
    path = path_from_cameras(*filmed(pair), pair, marker="mark")
    np.testing.assert_allclose(path[NED], truth(path.index.to_numpy() - 0.02), atol=5e-14)
    # Before the impact the car is driven at 7.1 m/s north: 0.142 m behind. Both cameras share
    # what they see of north, each by its own clock.
    before = path[path.index < -0.02]
    np.testing.assert_allclose(truth(before.index)[:, 0] - before["north"], 0.142, atol=1e-12)
    assert before["north_sd"].between(0.142 / np.sqrt(2.0) * 0.95, 0.142).all()


def test_one_late_clock_is_as_its_own_view():
    """The top camera late alone: east is late as a whole, down is not."""
    top, side = cameras()
    pair = (replace(top, clock_offset=0.0005), side)
    motion = Pushed(change=(-7.2, 3.0, 0.0))
    path = path_from_cameras(*filmed(pair, motion=motion), pair, marker="mark")
    late = path[path.index > 0.2]
    off = late[NED].to_numpy() - truth(late.index, motion)
    assert np.diff(late.index)[0] == pytest.approx(0.001)
    east = np.gradient(truth(late.index, motion)[:, 1], late.index)
    # What is east of the middle is also seen by the side camera, as a change of size: a tenth.
    np.testing.assert_allclose(off[:, 1], -0.0005 * east, atol=0.15 * 0.0005 * np.abs(east).max())


def test_frames_that_differ_are_interpolated():
    top, side = cameras()
    pair = (top, replace(side, rate=700.0))
    path = path_from_cameras(*filmed(pair), pair, marker="mark")
    # (1/700 s)²/8 of 130 m/s² and of the turning arm, and as much by the perspective.
    np.testing.assert_allclose(path[NED], truth(path.index), atol=1e-4)
    noisy = tuple(replace(c, reading_sd=0.5) for c in pair)
    whole = tuple(replace(c, reading_sd=0.5) for c in (top, side))
    mixed, plain = (path_from_cameras(*filmed(p), p, marker="mark") for p in (noisy, whole))
    down = mixed["down_sd"] / plain["down_sd"].reindex(mixed.index)
    assert down.min() == pytest.approx(np.sqrt(0.5), abs=0.01)
    assert down.max() == pytest.approx(1.0, abs=0.01)


def test_tracking_close_to_the_middle_keeps_the_distortion_out():
    pair = cameras(k1_sd=0.03)
    whole = path_from_cameras(*filmed(pair, 3, start=1.8), pair, marker="mark")
    near = path_from_cameras(*filmed(pair, 3, start=1.8), pair, marker="mark", central=150.0)
    assert len(near) < len(whole)
    worst, best = (np.abs(p[NED].to_numpy() - truth(p.index)).max() for p in (whole, near))
    assert best < 0.5 * worst
    assert near[SD].max().max() < 0.5 * whole[SD].max().max()
    bare = cameras()[0]
    assert (np.hypot(*(bare.pixels(near[NED].to_numpy()) - [640, 512]).T) <= 151.0).all()


def test_a_marker_that_leaves_the_image_leaves_a_gap():
    top, side = cameras()
    pair = (replace(top, size=(1280, 300)), side)
    tracks = filmed(pair, start=1.8)
    assert tracks[0]["mark_u"].isna().any()
    path = path_from_cameras(*tracks, pair, marker="mark")
    assert len(path) == tracks[0]["mark_u"].notna().sum()
    np.testing.assert_allclose(path[NED], truth(path.index), atol=5e-14)


def test_what_is_not_seen_is_told():
    pair = cameras()
    tracks = filmed(pair)
    with pytest.raises(DataError, check=coded("simulation.camera-no-marker", quantity="marker")):
        path_from_cameras(*tracks, pair, marker="mask")
    with pytest.raises(
        DataError,
        check=coded(
            "simulation.camera-does-not-see-marker", quantity="marker", marker="mark", central=1.0
        ),
    ):
        path_from_cameras(*tracks, pair, marker="mark", central=1.0)
    late = filmed(pair, start=2.3)[1]
    early = filmed(pair, end=2.2)[0]
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "simulation.never-see-together"
    ):
        path_from_cameras(early, late, pair, marker="mark")
    with pytest.raises(ConfigError, check=coded("simulation.px-leaves-no-image")):
        path_from_cameras(*tracks, pair, marker="mark", central=0.0)
    with pytest.raises(ConfigError, check=coded("simulation.camera-no-two-frames-motion")):
        filmed(pair, start=2.5, end=2.4)
    with pytest.raises(ConfigError, check=coded("simulation.camera-nothing-look")):
        film(MOTION, {}, pair[0], impact=2.0)


@pytest.mark.parametrize(
    ("more", "quantity"),
    [
        ({"focal": 0.0}, "focal"),
        ({"rate": -1.0}, "rate"),
        ({"reading_sd": -1.0}, "reading_sd"),
        ({"k1": np.nan}, "k1"),
        ({"up": (0.0, 0.0, 3.0)}, "up"),
        ({"looking": (0.0, 0.0, 0.0)}, "up"),
        ({"size": (0, 10)}, "size"),
    ],
)
def test_a_camera_that_cannot_be_is_refused(more, quantity):
    with pytest.raises(ConfigError) as caught:
        replace(paper_cameras()[0], **more)
    finding = caught.value.finding
    assert finding.quantity == quantity
    assert paper_cameras()[0].name in (finding.file, finding.data.get("name"))
