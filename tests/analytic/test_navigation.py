"""Navigation against what is known in closed form, and its order against exact increments."""

from __future__ import annotations

import math
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[1]))

from exact_increments import errors, exact_increments, rounding, start_of
from strapdown import earth, rotation
from strapdown._kernels import ned_simplified
from strapdown._kernels.compilation import interpreted
from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.errors import DivergenceError
from strapdown.increments import motion_accuracy, motion_increments
from strapdown.mechanization import NorthEastDown, Tadic, run_mechanization
from strapdown.nav_state import NavState
from strapdown.simulation import (
    ImuErrors,
    Origin,
    PathMotion,
    SineVelocityMotion,
    StationaryMotion,
    Wave,
    simulate_imu,
)
from strapdown.simulation import earth_motion as place_integral
from strapdown.tables import motion_increments_table

DAY = 86_400.0
RADIUS = 6.378e6
EARTH = WGS84.rotation_rate


def navigate(motion, step, mechanization=None, start=None):
    time = np.arange(0.0, motion.duration + 0.5 * step, step)
    return run_mechanization(
        mechanization or NorthEastDown(),
        start or start_of(motion),
        exact_increments(motion, time),
        longest_step=1e9,
    )


# --- at rest, with an error at the start ------------------------------------------------


def error_model(lat_deg):
    """Matrix of errors at rest: place N E D in m, velocity N E D, rotation vector N E D.

    Of ``C' = C Omega_ib - Omega_in C``, ``v' = C f + g - 2 w_ie x v``, ``place' = v``, linear.
    """
    s, c = math.sin(math.radians(lat_deg)), math.cos(math.radians(lat_deg))
    meridian, transverse = (float(r) for r in earth.radii_of_curvature(lat_deg))
    up, below = earth.gravity(lat_deg, 100.0), earth.gravity(lat_deg, -100.0)
    north, south = earth.gravity(lat_deg + 1e-3, 0.0), earth.gravity(lat_deg - 1e-3, 0.0)
    g = float(earth.gravity(lat_deg, 0.0)[2])
    on, od = EARTH * c, -EARTH * s
    a = np.zeros((9, 9))
    a[:3, 3:6] = np.eye(3)
    a[3:6, 2] = -(up - below) / 200.0
    a[3:6, 0] = (north - south) / math.radians(2e-3) / meridian
    a[3, 4], a[4, 3], a[4, 5], a[5, 4] = 2.0 * od, -2.0 * od, 2.0 * on, -2.0 * on
    a[3, 7], a[4, 6] = -g, g
    # -w_in x phi, less what the errors of place and velocity do to w_in.
    a[6, 7], a[7, 6], a[7, 8], a[8, 7] = od, -od, on, -on
    a[6, 0], a[6, 4] = EARTH * s / meridian, -1.0 / transverse
    a[7, 3] = 1.0 / meridian
    a[8, 0], a[8, 4] = EARTH * c / meridian, s / c / transverse
    return a


def rest_errors(lat_deg, height, tilt, rise, duration, step):
    """Half the difference of two runs with opposite errors: so the even powers of them cancel."""
    motion = StationaryMotion(duration, Origin(lat_deg, 20.0, 0.0), 3.0, -7.0, 130.0)
    truth, found = start_of(motion), []
    for sign in (1.0, -1.0):
        turn = rotation.quaternion_from_rotation_vector(sign * np.asarray(tilt))
        start = NavState(
            0.0,
            truth.lat,
            truth.lon,
            sign * rise,
            truth.v_n,
            rotation.compose(turn, truth.q_nb),
        )
        run = navigate(motion, step, NorthEastDown(height=height), start)
        phi = rotation.rotation_vector_from_quaternion(
            rotation.compose(run.history[:, 6:], rotation.conjugate(truth.q_nb))
        )
        meridian, transverse = earth.radii_of_curvature(lat_deg)
        place = (run.history[:, :3] - [truth.lat, truth.lon, 0.0]) * [
            float(meridian),
            float(transverse) * math.cos(truth.lat),
            -1.0,
        ]
        found.append(np.hstack([place, run.history[:, 3:6], phi]))
    return run.time, 0.5 * (found[0] - found[1])


@pytest.mark.parametrize("lat_deg", [30.0, -55.0])
def test_schuler_and_foucault_over_a_day(lat_deg):
    tilt, step = math.radians(1.0 / 60.0), 10.0
    time, found = rest_errors(lat_deg, "held", [0.0, tilt, 0.0], 0.0, DAY, step)
    level = [0, 1, 3, 4, 6, 7, 8]
    full = error_model(lat_deg)
    # A held height gives away, once a step, the vertical velocity that Coriolis's force made in
    # it: 2 on v_e step at its end, half of it on average, of which 2 on go east again.
    full[4, 4] = -2.0 * (0.5 * full[4, 5]) ** 2 * step
    model = full[np.ix_(level, level)]
    each = expm(model * step)
    state, exact = np.zeros(7), [np.zeros(7)]
    state[5] = tilt
    exact[0] = state
    for _ in time[1:]:
        exact.append(each @ exact[-1])
    exact = np.array(exact)

    # That damping is 1e-3 of the velocity in a day. What it does to the place within the step is
    # not in the model: a tenth of it. The third power of the error is 8e-8 of it, and a step errs
    # by (step/806 s)^4 = 2e-8 in phase.
    amplitude = np.abs(exact).max(axis=0)
    assert (np.abs(found[:, level] - exact).max(axis=0) < 1e-4 * amplitude).all()

    meridian, transverse = (float(r) for r in earth.radii_of_curvature(lat_deg))
    g = float(earth.gravity(lat_deg, 0.0)[2])
    schuler = math.sqrt(g / math.sqrt(meridian * transverse))
    assert 2.0 * math.pi / schuler / 60.0 == pytest.approx(84.4, abs=0.2)
    # Two frequencies of the model, split by the pendulum's turn, Omega sin(lat) to each side;
    # what they are shifted by besides is of Omega²/schuler = 4e-6 rad/s.
    frequencies = np.sort(np.abs(np.linalg.eigvals(model).imag))[-4:]
    turn = EARTH * abs(math.sin(math.radians(lat_deg)))
    assert frequencies[3] - frequencies[0] == pytest.approx(2.0 * turn, rel=0.05)
    assert frequencies.mean() == pytest.approx(schuler, abs=4.3e-6)

    # Amplitudes: g tilt/schuler = 2.3 m/s, R tilt = 1.9 km about a place displaced as much. Both
    # within the part that the Earth's rate is of Schuler's, 6 %.
    first = time < 5064.0
    assert np.abs(found[first, 3]).max() == pytest.approx(g * tilt / schuler, rel=0.06)
    assert np.abs(found[first, 0]).max() == pytest.approx(2.0 * RADIUS * tilt, rel=0.06)
    # After a quarter of its turn the pendulum swings east and west: a period around that time, at
    # whose ends it is up to 0.15 rad short or past of that; and the Earth's rate has its 6 %.
    around = np.abs(time - 0.5 * math.pi / turn) < 2532.0
    assert np.abs(found[around, 4]).max() == pytest.approx(g * tilt / schuler, rel=0.1)
    assert np.abs(found[around, 3]).max() < 0.25 * g * tilt / schuler


def test_a_free_height_runs_away_as_cosh():
    """Over an hour: e every 570 s."""
    time, found = rest_errors(40.0, "free", np.zeros(3), 0.1, 3600.0, 1.0)
    each, state = expm(error_model(40.0)), np.zeros(9)
    state[2] = -0.1
    exact = [state]
    for _ in time[1:]:
        exact.append(each @ exact[-1])
    # Left out: the next power of height over radius, which two signs do not cancel, (27 m/R)²;
    # the step, and rounding of 30 gravities a second: `rounding` says 1e-5 m.
    assert np.abs(found[:, 2] - np.array(exact)[:, 2]).max() < 3e-5
    assert np.abs(found[:, 5] - np.array(exact)[:, 5]).max() < 1e-7
    # cosh(k t), k² = 2g/R; the Earth's turn and shape change k² by up to 1 %, and after
    # 6.3 e-folds the height by 3 %.
    k = math.sqrt(2.0 * 9.8 / RADIUS)
    assert 1.0 / k == pytest.approx(570.0, rel=0.002)
    assert -found[-1, 2] == pytest.approx(0.1 * math.cosh(k * 3600.0), rel=0.04)


@pytest.mark.parametrize("tau", [20.0, 100.0])
def test_a_damped_height_follows_its_loop(tau):
    """A step of the reference: ``H exp(-at) (1 - 2at + a²t²/2)``, three poles at -a.

    With ``e' = -v - 3a e``, ``v' = 3a² e + a³ s + d``, ``s' = e``, E(s) = (H s² - d)/(s + a)³;
    d is by how much gravity is less at the height of the reference than where the body is.
    """
    motion, jump, wrong = StationaryMotion(8.0 * tau, Origin(50.0, 10.0, 200.0)), 40.0, []
    less = float(earth.gravity(50.0, 240.0)[2] - earth.gravity(50.0, 200.0)[2])
    for step in (0.2, 0.1):
        count = round(motion.duration / step)
        log = exact_increments(motion, np.arange(count + 1) * step, nodes=4)
        run = run_mechanization(
            NorthEastDown(height="damped", height_time_constant=tau),
            start_of(motion),
            log,
            heights=np.full(count, 200.0 + jump),
        )
        at = run.time / tau
        exact = 200.0 + jump - jump * np.exp(-at) * (1.0 - 2.0 * at + 0.5 * at * at)
        exact -= less * 0.5 * run.time**2 * np.exp(-at)
        wrong.append(np.abs(run.history[:, 2] - exact).max())
    # The loop is closed once a step, from the height after it: its error is of the first order,
    # 3 step/(2 tau) of the jump at most. The Earth's turn makes 2 on (2 on jump) = 4e-7 m/s² more
    # of d, which is 1 mm of height at 100 s.
    assert wrong[0] < jump * 1.5 * 0.2 / tau
    assert math.log2(wrong[0] / wrong[1]) == pytest.approx(1.0, abs=0.1)


# --- order ------------------------------------------------------------------------------

TURNING = SineVelocityMotion(
    64.0, Origin(55.0, 37.0, 10_000.0), (200.0, -100.0, 5.0), (30.0, 20.0, 10.0), 16.0, (0, 90, 30)
)


def left_out(motion, step):
    """What the step leaves out: a bound of the error of velocity, and of place.

    Gravity at the mean place is turned by the turn of the level, with the displacement as it is at
    the start of the step: it lacks that the radius changes, with the climb and with the latitude.
    That is a part ``(v_d + e² v) dt/R`` of the turn ``(w_ie + v/R) dt``, a third of which is left
    on average; taken as a half.
    """
    speeds = np.abs(motion.kinematics(np.linspace(0.0, motion.duration, 999)).velocity)
    speed, climb = float(np.linalg.norm(speeds, axis=1).max()), float(speeds[:, 2].mean())
    part = (climb + WGS84.eccentricity_squared * speed) / RADIUS
    acceleration = 0.5 * 9.8 * (EARTH + speed / RADIUS) * part * step**2
    return acceleration * motion.duration, 0.5 * acceleration * motion.duration**2


def test_the_second_order_of_a_step_is_too_small_to_matter():
    """With exact increments; at 240 m/s and steps of 0.25 s it is 2e-10 of a g."""
    for step in (0.125, 0.25):
        found = errors(navigate(TURNING, step), TURNING).abs().max()
        velocity, place = left_out(TURNING, step)
        noise = rounding(TURNING.duration / step, TURNING.duration)
        # The rest is of the fourth order: 1.8e-8 m/s and 1.3e-6 m at 1 s.
        assert (found[["VN", "VE", "VD"]] < velocity + noise["VN"] + 2e-8 * step**4).all()
        assert (found[["north", "east", "down"]] < place + noise["down"] + 2e-6 * step**4).all()


def test_the_order_of_a_step():
    """Long steps of a motion of 16 s, so that the second order is small beside the fourth."""
    steps = np.array([1.0, 2.0, 4.0])
    found = np.array([errors(navigate(TURNING, h), TURNING).abs().max() for h in steps])
    slopes = np.polyfit(np.log(steps), np.log(found), 1)[0]
    # A step of 1 s has a second order that takes up to a quarter of its error, which pulls the
    # slope down; attitude follows the place alone, by its radius.
    assert (slopes > 2.9).all()
    # Of east, which has least of the second order, the slope is the fourth.
    assert math.log2(found[2, 1] / found[1, 1]) == pytest.approx(4.0, abs=0.5)
    assert found[0, :3].max() < 2e-6
    assert found[0, 3:6].max() < 3e-8


CHAIN = SineVelocityMotion(
    64.0, Origin(55.0, 37.0, 10_000.0), (60.0, -40.0, 5.0), (30.0, 20.0, 10.0), 16.0, (0, 90, 30)
)


@pytest.mark.parametrize(
    ("samples", "interpolation"),
    [(1, "linear"), (1, "cubic"), (2, "linear"), (3, "linear"), (4, "linear")],
)
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_the_order_of_samples_increments_and_steps_together(sampling, samples, interpolation):
    wrong = []
    for rate in (8.0, 16.0):
        imu, _ = simulate_imu(CHAIN, ImuErrors(), rate=rate, sampling=sampling)
        log = motion_increments(imu, samples, interpolation)
        last = errors(run_mechanization(NorthEastDown(), start_of(CHAIN), log), CHAIN).iloc[-1]
        wrong.append([np.linalg.norm(last[k : k + 3]) for k in (0, 3, 6)])
    slopes = np.log2(np.array(wrong[0]) / wrong[1])
    declared = motion_accuracy(sampling, samples, interpolation)
    orders = [declared.position, declared.velocity, declared.attitude]
    # The next order is (2 pi dt/16 s)² = 0.2 % of the first times what its factors make of it.
    assert slopes == pytest.approx(np.array(orders), abs=0.25)


def test_coning_that_nobody_compensates_drifts_as_it_must():
    """Roll and pitch in quadrature: ``a²/2 (W T - sin W T)`` a step, about the axis of the cone.

    Means that are constant over their step have that drift; lines through two of them have what
    is left of the third order.
    """
    swing, period, step, duration = math.radians(3.0), 1.0, 0.02, 60.0
    waves = Wave(3.0, period), Wave(3.0, period, 90.0)
    stand = PathMotion(
        duration, Origin(50.0, 10.0, 0.0), roll_waves=waves[:1], pitch_waves=waves[1:]
    )
    imu, _ = simulate_imu(stand, ImuErrors(), rate=1.0 / step, sampling="mean")
    found = {}
    for interpolation in ("constant", "linear", "cubic"):
        log = motion_increments(imu, interpolation=interpolation)
        run = run_mechanization(NorthEastDown(height="held"), start_of(stand), log)
        found[interpolation] = errors(run, stand).iloc[-1]
    w = 2.0 * math.pi / period
    drift = 0.5 * swing**2 * (w * step - math.sin(w * step)) * duration / step
    # Roll about an axis that itself pitches is no perfect cone: parts of swing² = 0.3 %.
    assert abs(found["constant"]["heading"]) == pytest.approx(math.degrees(drift), rel=0.01)
    # Relative to the third order of constants, the fifth of lines: (w step)² = 1.6 % times 1/10.
    assert abs(found["linear"]["heading"]) < 0.016 * math.degrees(drift)
    assert abs(found["cubic"]["heading"]) < 0.016 * math.degrees(drift)
    # In gravity the swing is sculling too: the level of constants walks off, not that of lines.
    horizontal = {k: math.hypot(v["VN"], v["VE"]) for k, v in found.items()}
    assert horizontal["linear"] < 0.05 * horizontal["constant"]


# --- there and back ---------------------------------------------------------------------


@pytest.mark.parametrize("height", ["free", "held"])
def test_backward_returns_to_the_start(height):
    """Within what rounding may do on the way and on the way back."""
    climb = 0.0 if height == "held" else 2.0
    motion = SineVelocityMotion(
        3600.0, Origin(55.0, 37.0, 500.0), (5.0, -3.0, 0.1), (1.0, 1.0, climb)
    )
    if height == "held":
        motion = SineVelocityMotion(3600.0, motion.origin, (5.0, -3.0, 0.0), (1.0, 1.0, 0.0))
    start, used = start_of(motion), NorthEastDown(height=height)
    log = exact_increments(motion, np.arange(36_001) * 0.1, nodes=6)
    there = run_mechanization(used, start, log)
    back = run_mechanization(used, there.end, log, backward=True)
    noise = 2.0 * rounding(36_000, 3600.0)
    assert abs(back.end.lat - start.lat) * RADIUS < noise["north"]
    assert abs(back.end.lon - start.lon) * RADIUS < noise["north"]
    assert abs(back.end.alt - start.alt) < noise["down"]
    assert np.abs(back.end.v_n[:2] - start.v_n[:2]).max() < noise["VN"]
    assert abs(back.end.v_n[2] - start.v_n[2]) < noise["VD"]
    assert np.degrees(np.abs(back.end.q_nb - start.q_nb)).max() < noise["heading"]
    # And on the way it is where it was.
    assert np.abs(back.history[:, 0] - there.history[:, 0]).max() * RADIUS < noise["north"]


# --- everywhere -------------------------------------------------------------------------

PLACES = {
    "equator": ((0.0, 10.0, 1000.0), (250.0, 200.0, 0.0)),
    "80 deg": ((80.0, 10.0, 1000.0), (50.0, 250.0, 0.0)),
    "89.5 deg": ((89.5, 10.0, 0.0), (-20.0, 60.0, 0.0)),
    "-89.5 deg": ((-89.5, 10.0, 0.0), (20.0, 60.0, 1.0)),
    "south": ((-50.0, -60.0, 100.0), (-200.0, 100.0, 1.0)),
    "date line": ((10.0, 179.99, 5000.0), (10.0, 300.0, 0.0)),
    "west over the date line": ((60.0, -179.9, 12_000.0), (10.0, -600.0, 0.0)),
    "faster than the Earth": ((45.0, 0.0, 12_000.0), (0.0, -600.0, 0.0)),
    "30 km": ((50.0, 50.0, 30_000.0), (100.0, 900.0, 0.0)),
}


def journey(place, velocity, ellipsoid=WGS84, duration=600.0):
    return SineVelocityMotion(
        duration, Origin(*place), velocity, (5.0, 5.0, 2.0), 40.0, ellipsoid=ellipsoid
    )


def bound(motion, steps):
    """What a step leaves out and rounding; heading near a pole feels the place by tan(lat)."""
    velocity, place = left_out(motion, motion.duration / steps)
    allowed = rounding(steps, motion.duration)
    allowed[["north", "east", "down"]] += place
    allowed[["VN", "VE", "VD"]] += velocity
    steep = abs(math.tan(math.radians(motion.origin.lat_deg)))
    allowed["heading"] += math.degrees(steep * allowed["east"] / RADIUS)
    # Tilt errs by the place, too; pitch and roll of a body that heads anywhere.
    allowed[["roll", "pitch"]] += math.degrees(allowed["north"] / RADIUS)
    return allowed


@pytest.mark.parametrize("name", PLACES)
def test_everywhere(name, monkeypatch):
    monkeypatch.setattr(place_integral, "MOST_NORTHERN", 89.9)
    motion = journey(*PLACES[name])
    found = errors(navigate(motion, 0.1), motion).abs().max()
    assert (found <= bound(motion, 6000)).all(), found


@pytest.mark.slow
@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_every_ellipsoid(name):
    motion = journey((50.0, 30.0, 300.0), (100.0, -150.0, 0.0), ELLIPSOIDS[name])
    found = errors(navigate(motion, 0.1, NorthEastDown(ellipsoid=name)), motion).abs().max()
    assert (found <= bound(motion, 6000)).all(), found
    for other in ELLIPSOIDS.keys() - {name}:
        wrong = navigate(motion, 0.1, NorthEastDown(ellipsoid=other))
        # A hundred times the bound: 1e-8 of the radius or of gravity is seen.
        assert (errors(wrong, motion).abs().max() > 100.0 * bound(motion, 6000))["down"], other


def test_a_run_to_the_pole_stops_and_says_where(monkeypatch):
    monkeypatch.setattr(place_integral, "MOST_NORTHERN", 89.99)
    motion = SineVelocityMotion(150.0, Origin(89.6, 30.0, 1000.0), (250.0, 3.0, 0.0), (1.0, 1.0, 0))
    log = exact_increments(motion, np.arange(1501) * 0.1)
    with pytest.raises(DivergenceError) as caught:
        run_mechanization(NorthEastDown(), start_of(motion), log)
    truth = motion.trajectory(log.index)
    first = int(np.argmax(truth["lat"].to_numpy() > 89.9))
    finding = caught.value.finding
    assert finding.quantity == "lat"
    assert f"the sample at {log.index[first]:.9g} s (step {first + 1})" in finding.what
    assert f"{truth['lat'].iloc[first - 1]:.6f} deg of latitude" in finding.what
    assert "end the run before it" in finding.remedy
    # Until then it errs as it does elsewhere.
    before = run_mechanization(NorthEastDown(), start_of(motion), log.iloc[:first])
    allowed = bound(motion, 1500)
    allowed["heading"] *= math.tan(math.radians(89.9)) / math.tan(math.radians(89.6))
    assert (errors(before, motion).abs().max() <= allowed).all()


def test_a_leap_over_the_pole_is_no_step():
    """So fast that one step goes around it: the latitude alone would not tell."""
    start = NavState.from_degrees(89.89, 0.0, v_n=[0.0, 9000.0, 0.0])
    log = motion_increments_table([1.0], [1.0], np.zeros((1, 3)), [[0, 0, -9.83]], np.zeros((1, 3)))
    with pytest.raises(DivergenceError, check=coded("mechanization.first-step-near-pole")):
        run_mechanization(NorthEastDown(), start, log)


# --- the paper's equations --------------------------------------------------------------

FAST = SineVelocityMotion(60.0, Origin(60.0, 20.0, 0.0), (150.0, 200.0, 0.0), (5.0, 5.0, 1.0), 30.0)
EVERY_TERM = {"coriolis": True, "earth_rate": True, "transport_rate": True}


def test_with_every_term_the_papers_equations_are_of_the_first_order():
    steps = (0.2, 0.1, 0.05)
    wrong = [errors(navigate(FAST, h, Tadic(**EVERY_TERM)), FAST).abs().max() for h in steps]
    wrong = np.array([[w[:3].max(), w[3:6].max(), w[6:].max()] for w in wrong])
    slopes = -np.polyfit(np.log([1.0, 2.0, 4.0]), np.log(wrong), 1)[0]
    assert slopes == pytest.approx(np.ones(3), abs=0.15)


@pytest.mark.parametrize("term", EVERY_TERM)
def test_what_a_term_is_worth(term):
    """Each is a turn or an acceleration of known size, and left out is seen as that."""
    on, od = EARTH * math.cos(math.radians(60.0)), EARTH * math.sin(math.radians(60.0))
    speed, wide = math.hypot(150.0, 200.0), 200.0 / RADIUS
    size = {
        # Twice the Earth's rate and once the transport rate, across the velocity.
        "coriolis": ("VN", (2.0 * od + wide * math.tan(math.radians(60.0))) * 200.0 * 60.0),
        # Heading is turned by the vertical part, 60 s long.
        "earth_rate": ("heading", math.degrees(od * 60.0)),
        "transport_rate": ("heading", math.degrees(wide * math.tan(math.radians(60.0)) * 60.0)),
    }[term]
    assert speed > 0.0 and on > 0.0
    used = Tadic(**(EVERY_TERM | {term: False}))
    if term != "coriolis":
        used = Tadic(**(EVERY_TERM | {term: False, "coriolis": False}))
    found = errors(navigate(FAST, 0.05, used), FAST).abs().max()
    # Speed varies by 5 m/s of 200 about its mean, and the tilt that comes with it adds.
    assert found[size[0]] == pytest.approx(size[1], rel=0.06)


def with_misprint(name, misprinted):
    """The kernel of the paper's equations, in Python, with one of its functions replaced."""
    kernel = interpreted(ned_simplified.simplified_advance)
    names = kernel.__globals__ | {name: misprinted}
    wrong = types.FunctionType(kernel.__code__, names)

    class Misprinted(Tadic):
        def advance_rows(self, state, increments, heights, earth, history):
            return wrong(
                state,
                increments,
                heights,
                earth,
                self.kernel_options(),
                *(1.0, 1.0, 1.0, 1.0, math.nan),
                history,
            )

    return Misprinted(coriolis=True)


def printed_transport(s, c, v_n, v_e, meridian, transverse):
    n, e, d = ned_simplified.transport_rate(s, c, v_n, v_e, meridian, transverse)
    return n, e, -d


def printed_matrix(w, x, y, z):
    c = list(ned_simplified.dcm_from_quat(w, x, y, z))
    c[5], c[6] = 2.0 * (y * z + w * x), 2.0 * (x * z + w * y)
    return tuple(c)


@pytest.mark.parametrize(
    ("name", "misprinted"),
    [("transport_rate", printed_transport), ("dcm_from_quat", printed_matrix)],
)
def test_the_papers_misprints_would_be_seen(name, misprinted):
    """(8) with a plus in its third part; (19) with pluses in C23 and C31."""
    # On a level body C23 and C31 are zero, and their signs nothing.
    motion = FAST
    if name == "dcm_from_quat":
        motion = StationaryMotion(60.0, Origin(60.0, 20.0, 0.0), 20.0, 10.0, 40.0)
    right = errors(navigate(motion, 0.1, Tadic(**EVERY_TERM)), motion).abs().max()
    same = (
        errors(navigate(motion, 0.1, with_misprint("PULL", ned_simplified.PULL)), motion)
        .abs()
        .max()
    )
    assert same.to_numpy() == pytest.approx(right.to_numpy(), rel=1e-3, abs=1e-7)
    wrong = errors(navigate(motion, 0.1, with_misprint(name, misprinted)), motion).abs().max()
    assert wrong["north"] > 100.0 * right["north"] + 1.0
