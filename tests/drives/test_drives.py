"""The generator of drives is right by itself: its truth, its samples, its files and its judge."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.drives import judge
from tests.drives.generator import (
    AXES,
    FIX_STYLES,
    GRADES,
    LOG_STYLES,
    _hum,
    draw,
    fixes,
    make,
    samples,
    stream,
)
from tests.drives.motion import DEG, EARTH_RATE, KINDS, geodetic, gravity, make_motion, to_ned

import strapdown as sd
from strapdown import earth


def first_of(kind):
    return next(draw(seed) for seed in range(1000) if draw(seed)["kind"] == kind)


def moved(facts):
    mount = Rotation.from_euler("ZYX", facts["mount_deg"], degrees=True)
    return make_motion(stream(facts["seed"], "motion"), facts, mount)


def integrated(motion, begin, length, step):
    """Position and attitude in Cartesian axes from the true start, by Runge and Kutta's rule."""
    earth = np.array([0.0, 0.0, EARTH_RATE])
    t = begin + 0.5 * step * np.arange(2 * round(length / step) + 1)
    rates, forces = motion.sensed(t)

    def slope(state, rate, force):
        r, v, c = state
        lat, lon, alt = geodetic(r)
        pull = gravity(lat, alt) * to_ned(lat, lon)[2] + motion._plane @ motion.disturbance
        w = rate - c.T @ earth
        turn = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return v, c @ force + pull - 2 * np.cross(earth, v), c @ turn

    def after(state, h, slopes):
        return [x + h * d for x, d in zip(state, slopes, strict=True)]

    at = np.array([begin])
    state = (
        motion.position(at)[0],
        motion.velocity(at)[0],
        motion.attitude(at).as_matrix()[0],
    )
    for k in range(0, len(t) - 1, 2):
        a = slope(state, rates[k], forces[k])
        b = slope(after(state, step / 2, a), rates[k + 1], forces[k + 1])
        c = slope(after(state, step / 2, b), rates[k + 1], forces[k + 1])
        e = slope(after(state, step, c), rates[k + 2], forces[k + 2])
        state = [
            x + step / 6 * (p + 2 * q + 2 * u + w)
            for x, p, q, u, w in zip(state, a, b, c, e, strict=True)
        ]
    return state


def apart(motion, begin, length, step):
    r, _, c = integrated(motion, begin, length, step)
    end = np.array([begin + length])
    turned = motion.attitude(end)[0].inv() * Rotation.from_matrix(c)
    return np.linalg.norm(r - motion.position(end)[0]), turned.magnitude()


@pytest.mark.parametrize("kind", KINDS)
def test_the_samples_integrate_to_the_truth(kind):
    motion = moved(first_of(kind))
    coarse, fine = (apart(motion, 50.0, 3.0, step) for step in (0.01, 0.005))
    assert fine[0] < 1e-4
    assert fine[1] < 1e-5
    # What remains belongs to the integration: it falls with the fourth power of the step.
    assert coarse[0] / fine[0] > 8 or fine[0] < 1e-7
    assert coarse[1] / fine[1] > 8 or fine[1] < 1e-9


def test_gravity_is_that_of_the_ellipsoid():
    lat = np.radians([-60.0, 0.0, 45.0, 80.0])
    for alt in (0.0, 3000.0):
        theirs = earth.gravity(np.degrees(lat), alt)[:, 2]
        # The series leaves out the flattening's square times twice the height over the radius,
        # a few times 1e-7 m/s² here: a hundredth of what a navigation grade sensor resolves.
        assert gravity(lat, alt) == pytest.approx(theirs, abs=5e-7)


def test_velocity_and_antenna_are_derivatives():
    motion = moved(first_of("aircraft"))
    t, arm, h = np.array([40.0, 70.5, 100.25]), (1.0, -0.4, -1.2), 1e-4
    by_differences = (motion.position(t + h, arm) - motion.position(t - h, arm)) / (2 * h)
    assert motion.velocity(t, arm) == pytest.approx(by_differences, abs=1e-4)
    apart = motion.position(t, arm) - motion.position(t)
    assert np.linalg.norm(apart, axis=1) == pytest.approx(np.full(3, np.linalg.norm(arm)))


def test_a_body_at_rest_feels_gravity_and_the_earth_alone():
    facts = first_of("town") | {"start": "rest", "rest_s": 20.0, "mount_deg": [0.0, 0.0, 0.0]}
    rate, force = moved(facts).sensed(np.array([5.0, 10.0]))
    assert np.linalg.norm(force, axis=1) == pytest.approx(
        gravity(facts["lat_deg"] * DEG, facts["alt_m"]), abs=2e-3
    )
    assert np.all(force[:, 2] < -9.7)  # specific force, down positive
    assert np.linalg.norm(rate, axis=1) == pytest.approx(EARTH_RATE, rel=1e-6)


def test_a_seed_is_one_record(tmp_path):
    facts = draw(7) | {"duration_s": 40.0, "outages_s": []}
    one, two = make(facts, tmp_path / "a"), make(facts, tmp_path / "b")
    assert one.log.read_bytes() == two.log.read_bytes()
    assert one.fixes.read_bytes() == two.fixes.read_bytes()
    assert draw(7) == draw(7)
    assert draw(7) != draw(8)


def test_a_part_can_be_changed_alone(tmp_path):
    facts = draw(7) | {"duration_s": 40.0, "outages_s": [], "fault": "none", "clock": "uptime"}
    one = make(facts, tmp_path / "a")
    two = make(facts | {"fault": "lasting", "fault_from_s": 5.0, "late_s": 0.3}, tmp_path / "b")
    assert one.log.read_bytes() == two.log.read_bytes()
    assert one.fix_ecef[0] == pytest.approx(two.fix_ecef[0], abs=1e-9)
    assert two.fix_stamps - one.fix_stamps == pytest.approx(
        np.full(len(one.fix_times), 0.3 - facts["late_s"]), abs=2e-3
    )


def test_every_choice_is_drawn():
    facts = [draw(seed) for seed in range(400)]
    assert {f["kind"] for f in facts} == set(KINDS)
    assert {f["grade"] for f in facts} == set(GRADES)
    assert {f["axes"] for f in facts} == set(AXES)
    for key, count in {"receiver": 3, "velocity": 3, "stated": 3, "fault": 4, "clock": 3}.items():
        assert len({f[key] for f in facts}) == count
    assert any(f["step_s"] for f in facts)
    assert all(120 <= f["duration_s"] <= 360 for f in facts)


def test_errors_have_the_drawn_sizes():
    facts = first_of("town") | {"start": "rest", "rest_s": 60.0, "duration_s": 62.0}
    facts |= {"vibration_m_s2": 0.0, "vibration_deg_s": 0.0, "sampling": "mean", "warming": False}
    motion = moved(facts)
    t, gyro, accel = samples(motion, facts)
    _, rate, force = samples(motion, facts, noiseless=True)
    rest = t < 55
    for read, true, density in (
        (gyro, rate, facts["gyro"]["noise"] * DEG),
        (accel, force, facts["accel"]["noise"] * 9.80665e-6),
    ):
        noise = np.diff((read - true)[rest], axis=0).std() / np.sqrt(2)
        assert noise * np.sqrt(1 / facts["rate_hz"]) == pytest.approx(density, rel=0.05)


@pytest.mark.parametrize("sampling", ["mean", "filtered"])
def test_a_shaken_body_does_not_go_anywhere(sampling):
    facts = first_of("boat") | {"start": "moving", "duration_s": 60.0, "sampling": sampling}
    facts |= {"vibration_m_s2": 2.0, "vibration_deg_s": 1.0, "rate_hz": 200, "cut_off_share": 0.2}
    t = np.arange(0, 60, 0.005)
    force, rate, square = _hum(stream(1, "vibration"), moved(facts), t, facts)
    assert np.sqrt(np.mean(force**2)) > 0.5
    white = np.sqrt(np.mean(force**2)) * np.sqrt(0.005)  # m/s/√s, if it were white
    way = np.cumsum(force, axis=0) * 0.005
    assert np.std(way[-6000:] - way[:6000]) < 0.2 * white * np.sqrt(30)
    assert np.sqrt(square[t > 5].mean()) == pytest.approx(2.0, rel=0.5)
    assert np.abs(np.degrees(np.cumsum(rate, axis=0) * 0.005)).max() < 1.0


def test_fixes_without_errors_are_the_antenna():
    facts = first_of("town") | {"white_m": 0.0, "drift_m": 0.0, "velocity_m_s": 0.0}
    facts |= {"fault": "none", "float_share": 0.0, "velocity_late_s": 0.0, "outages_s": [[30, 50]]}
    facts |= {"late_s": 0.25, "step_s": 0.0, "drift_ppm": 20.0}
    motion = moved(facts)
    got = fixes(motion, facts)
    assert got["ecef"] == pytest.approx(motion.position(got["t"], facts["antenna_m"]), abs=1e-8)
    assert got["stamp"] - got["t"] == pytest.approx(0.25 + 20e-6 * got["t"], abs=1e-12)
    assert not np.any((got["t"] > 30) & (got["t"] < 50))


@pytest.mark.parametrize("style", LOG_STYLES)
def test_the_log_says_what_it_holds(style, tmp_path):
    facts = draw(3) | {"duration_s": 20.0, "outages_s": [], "log_style": style}
    made = make(facts | {"axes": "right-forward-up"}, tmp_path)
    read = sd.read_imu(made.log, axes="right-forward-up")
    names = np.array(AXES["right-forward-up"])
    gyro = read[["gyro_x", "gyro_y", "gyro_z"]].to_numpy()
    accel = read[["accel_x", "accel_y", "accel_z"]].to_numpy()
    assert gyro == pytest.approx(made.gyro @ names, abs=1e-5)
    assert accel == pytest.approx(made.accel @ names, abs=1e-4)


@pytest.mark.parametrize("style", FIX_STYLES)
def test_the_fixes_say_what_they_hold(style, tmp_path):
    facts = draw(3) | {"duration_s": 30.0, "outages_s": [], "fix_style": style, "stated": "right"}
    made = make(facts | {"velocity": "ned"}, tmp_path)
    read = sd.read_gnss(made.fixes)
    lat, lon, alt = geodetic(made.fix_ecef)
    assert read["lat"].to_numpy() == pytest.approx(np.degrees(lat), abs=1e-8)
    assert read["lon"].to_numpy() == pytest.approx(np.degrees(lon), abs=1e-8)
    assert read["alt"].to_numpy() == pytest.approx(alt, abs=1e-3)
    expected = np.hypot(facts["white_m"], facts["drift_m"])
    assert read["north_sd"].to_numpy() == pytest.approx(expected, abs=1e-3)
    assert read["down_sd"].to_numpy() == pytest.approx(expected * facts["vertical"], abs=1e-3)


def _solution(made, bound, off):
    """Return the truth, displaced along one component by so many bounds, as a run states it."""
    t = made.times[::10]
    truth = made.motion.state(t)
    table = pd.DataFrame({k: truth[k] for k in ("lat", "lon", "alt", "roll", "pitch", "heading")})
    table[["VN", "VE", "VD"]] = truth["v"]
    table["alt"] -= off * bound
    table.index = made.stamps[::10]
    stated = pd.DataFrame({name: np.full(len(t), bound / 1.96) for name in judge.COMPONENTS})
    stated.index = table.index
    return table, stated


@pytest.mark.parametrize(("off", "inside"), [(0.0, True), (0.9, True), (1.1, False), (6.0, False)])
def test_the_judge_measures_errors_in_bounds(off, inside, tmp_path):
    made = make(draw(3) | {"duration_s": 30.0, "outages_s": []}, tmp_path)
    score = judge._score(made, _solution(made, 2.0, off), 0.0, 0.5)
    assert score["inside"]["down"] is inside
    assert score["inside"]["vertical"] is inside
    assert score["inside"]["north"]
    assert score["rms"]["down"] == pytest.approx(2.0 * off, abs=1e-6)
    assert score["rms"]["VE"] == pytest.approx(0.0, abs=1e-9)
    assert score["times_bound"] == pytest.approx(off, abs=1e-5)
    assert set(score["far"]) == ({"down"} if off > 5 else set())


def test_the_interval_is_binomial():
    assert judge.interval(0, 10) == pytest.approx((0.0, 1 - 0.005**0.1))
    low, high = judge.interval(95, 100)
    assert low < 0.95 < high
