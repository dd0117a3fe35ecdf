"""Fixes of velocities alone: the way is dead reckoning from an origin that is stated."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded
from tests.drives.generator import draw, make
from tests.drives.judge import COMPONENTS, _bounds, _errors
from tests.drives.motion import geodetic

import strapdown as sd
from strapdown.alignment.gnss_course import CLIMB
from strapdown.config.logs import FixesTable, LogTable
from strapdown.errors import ConfigError, DataError
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.frames import place_difference
from strapdown.navigation.handover import way_by_velocities
from strapdown.systems.navigation_draft import draft_navigation
from strapdown.tables import GEODETIC, POSITION_SD, gnss_table

#: A receiver whose clock, faults and statements are not what is tested.
PLAIN = {
    "velocity": "ned",
    "fault": "none",
    "late_s": 0.0,
    "drift_ppm": 0.0,
    "step_s": 0.0,
    "velocity_late_s": 0.0,
    "stated": "right",
    "stated_factor": 1.0,
    "fix_style": "plain",
    "antenna_m": [0.0, 0.0, 0.0],
    "axes": "forward-right-down",
}
VELOCITIES = ["time_s", "vn_m_s", "ve_m_s", "vd_m_s", "sd_vn_m_s", "sd_ve_m_s", "sd_vd_m_s"]


def of_velocities(folder, seed, columns=VELOCITIES, **other):
    """A drawn record whose fixes have velocities alone, and its true place at the first sample."""
    made = make({**draw(seed), **PLAIN, **other}, folder)
    pd.read_csv(made.fixes)[columns].to_csv(made.fixes, index=False)
    lat, lon, alt = geodetic(made.motion.position(made.time(made.stamps[:1])))
    return made, (float(np.degrees(lat[0])), float(np.degrees(lon[0])), float(alt[0]))


def navigated(made, origin, sd_m):
    """Errors and 95 % bounds, (n, 9), of a run as proposed from an origin that is so well known."""
    fixes = FixesTable(path=str(made.fixes), origin=origin)
    log = LogTable(path=str(made.log))
    folder = made.log.parent
    draft = draft_navigation(log, folder=folder, axes=made.draw["axes"], gnss=fixes)
    config = folder / "navigate.toml"
    text = draft.text.replace("position_sd_m = 10.0", f"position_sd_m = {sd_m}")
    config.write_text(text)
    run = sd.navigate(config)
    _, off = _errors(made, run.trajectory, float(made.stamps[0]) if made.stamps[0] > 1e4 else 0.0)
    return off, _bounds(run.trajectory, run.sd), draft, run


def test_a_drive_by_velocities_alone(tmp_path):
    made, origin = of_velocities(tmp_path, 1, duration_s=70.0, outages_s=[])
    off, bound, draft, run = navigated(made, origin, 0.1)
    assert 'kind = "gnss_course"' in draft.text
    # At 54 m/s the unstated kind of sampling is 7 ms of the way; it hardly climbs.
    assert (bound[0, :2] < 1.96 * np.hypot(0.1, 54.0 * 0.01)).all()
    np.testing.assert_allclose(bound[0, 2], 1.96 * 0.1, rtol=0.05)
    # Nothing holds the position: its bound grows, and the error is in it.
    assert (bound[-1, :3] > 1.5 * bound[0, :3]).all()
    assert (np.abs(off[:, :3]) < 1.5 * bound[:, :3]).all()
    assert np.abs(off[-1, :3]).max() > 0.02
    assert (np.abs(off[-1, 3:]) < 1.5 * bound[-1, 3:]).all()
    assert bound[-1, 3:6].max() < 1.0
    told = [f.code for f in run.findings]
    assert "io.fixes-placed-by-origin" in told and "navigation.no-place-used-none-rows" not in told
    further = navigated(made, origin, 30.0)[1]
    np.testing.assert_allclose(
        np.square(further[-1, :3]) - np.square(bound[-1, :3]),
        1.96**2 * (30.0**2 - 0.1**2),
        rtol=1e-3,
    )


@pytest.mark.slow
def test_bounds_of_drives_by_velocities_alone(tmp_path):
    """At the end of drives of cars, aircraft and boats, of every grade: position, velocity, tilt.

    All 24 errors of each kind are within 95 % bounds: receivers state more than they err by.
    """
    inside = np.zeros(len(COMPONENTS))
    for seed in [s for s in range(40) if draw(s)["kind"] != "walk"][:8]:
        made, origin = of_velocities(tmp_path / str(seed), seed)
        off, bound, *_ = navigated(made, origin, 0.1)
        inside += np.abs(off[-1]) < bound[-1]
        assert (np.abs(off) < 4.0 * bound)[:, [0, 1, 2, 6, 7, 8]].all(), seed
    # Of 24 at 95 %, fewer than 19 have a chance of 1:600.
    assert (inside.reshape(3, 3).sum(axis=1) >= 19).all(), inside


def test_speed_and_course_alone(tmp_path):
    seed = 3
    made, origin = of_velocities(
        tmp_path, seed, ["time_s", "speed_m_s", "course_deg"], velocity="course", duration_s=120.0
    )
    off, bound, *_ = navigated(made, origin, 0.1)
    assert (np.abs(off[:, :3]) < 2.0 * bound[:, :3]).all()
    # A climb that no fix measures is 1 m/s at the alignment; it grows by the accelerometer's bias.
    assert bound[:, 5].min() < 1.5 * 1.96 * CLIMB
    assert (np.abs(off[-1, 3:]) < 2.0 * bound[-1, 3:]).all()


def test_a_body_that_is_levelled_while_it_moves_has_moved_from_the_origin(tmp_path):
    """Where a heading is asked, the position at the end of levelling is not the origin."""
    walk = next(s for s in range(100) if draw(s)["kind"] == "walk" and draw(s)["start"] == "moving")
    made, origin = of_velocities(tmp_path, walk, duration_s=60.0)
    log, fixes = LogTable(path=str(made.log)), FixesTable(path=str(made.fixes), origin=origin)
    draft = draft_navigation(log, folder=tmp_path, axes=made.draw["axes"], gnss=fixes)
    heading = made.answers["heading_deg"]
    text = draft.text.replace('heading_deg = "?"', f"heading_deg = {heading}")
    text = text.replace('sd_deg = "?"', f"sd_deg = {made.answers['sd_deg']}")
    (tmp_path / "navigate.toml").write_text(
        text.replace("position_sd_m = 10.0", "position_sd_m = 0.1")
    )
    run = sd.navigate(tmp_path / "navigate.toml")
    _, off = _errors(made, run.trajectory, float(made.stamps[0]) if made.stamps[0] > 1e4 else 0.0)
    bound = _bounds(run.trajectory, run.sd)
    moved = place_difference(run.trajectory[GEODETIC].to_numpy()[:1], np.array([origin]))[0]
    assert np.hypot(*moved[:2]) > 1.0
    assert (np.abs(off[:, :3]) < 1.5 * bound[:, :3]).all()


# --- parts ------------------------------------------------------------------------------


def test_the_origin_is_asked_and_measured_by_nothing(tmp_path):
    made, origin = of_velocities(tmp_path, 1, duration_s=30.0)
    with pytest.raises(DataError, check=coded("io.fixes-velocities-alone")):
        sd.read_gnss(made.fixes)
    with pytest.raises(DataError, check=coded("io.fixes-velocities-alone")):
        sd.read_gnss(made.fixes, origin="33N")  # a zone is no place
    table = sd.read_gnss(made.fixes, origin=origin)
    np.testing.assert_array_equal(table[GEODETIC], np.tile(origin, (len(table), 1)))
    assert np.isinf(table[POSITION_SD].to_numpy()).all()
    assert [f.severity for f in table.findings if f.code == "io.fixes-placed-by-origin"] == [
        "warning"
    ]
    with pytest.raises(ConfigError, check=coded("io.position-sd-without-positions")):
        sd.read_gnss(made.fixes, origin=origin, position_sd_m=1.0)
    # A receiver whose positions are not known to the program is told by its columns.
    whole = pd.read_csv(made.fixes)
    whole.assign(lat_deg=1.0).to_csv(made.fixes, index=False)
    with pytest.raises(DataError, check=coded("io.missing-columns-2")):
        sd.read_gnss(made.fixes, origin=origin)


def test_velocities_alone_without_standard_deviations_are_refused(tmp_path):
    made, origin = of_velocities(tmp_path, 1, VELOCITIES[:4], duration_s=30.0)
    with pytest.raises(DataError, check=coded("io.velocity-sd-alone")):
        sd.read_gnss(made.fixes, origin=origin)
    asked = GnssOptions(origin=origin, unstated_velocity_sd=0.3)
    assert (read_gnss(made.fixes, asked)["VN_sd"] == 0.3).all()


def test_a_way_by_velocities():
    """Of constant acceleration trapezoids are exact; unknown are climbs and what is between."""
    time = np.arange(1.0, 11.0)
    v = np.column_stack([2.0 + 0.5 * time, -time, np.zeros(10)])
    sd_m = np.tile([0.1, 0.2, np.inf], (10, 1))
    fixes = gnss_table(time, np.tile([50.0, 8.0, 0.0], (10, 1)), v, np.inf * np.ones(3), sd_m)
    way, variance = way_by_velocities(fixes, 1.0, 10.5, np.array([7.25, -10.5, 0.0]))
    of_time = lambda t: np.array([2.0 * t + 0.25 * t**2, -0.5 * t**2, 0.0])  # noqa: E731
    np.testing.assert_allclose(way, of_time(10.5) - of_time(1.0), atol=1e-12)
    steps = np.append(np.ones(9), 0.5)
    between = np.square(0.5 * steps**2).sum()
    np.testing.assert_allclose(
        variance[:2], between + np.square([0.1, 0.2]) * np.square(steps).sum(), rtol=1e-12
    )
    np.testing.assert_allclose(variance[2], between + 9.5**2, rtol=1e-12)
    # At the beginning there is no way, and before it none backward.
    np.testing.assert_array_equal(way_by_velocities(fixes, 1.0, 1.0, v[0])[0], 0.0)
    np.testing.assert_array_equal(way_by_velocities(fixes, 1.0, 0.99, v[0])[1][:2], 0.0)
    # A part that was navigated before counts from the first fix on.
    later, _ = way_by_velocities(fixes, 6.0, 10.0, v[-1])
    np.testing.assert_allclose(later, of_time(10.0) - of_time(1.0), atol=1e-12)
