"""Vehicles on their paths: felt as in inertial axes, and where the manoeuvres say they come."""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mpmath import mpf
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from earth_truth import course, felt
from exact_motions import mp_track

from strapdown.ellipsoids import WGS84, find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation import (
    ImuErrors,
    Origin,
    PathMotion,
    Track,
    Wave,
    aircraft,
    car,
    ship,
    simulate_imu,
)
from strapdown.simulation.path_motion import integrate_track
from strapdown.simulation.vehicles import (
    Accelerate,
    Along,
    BankedTurn,
    Brake,
    Climb,
    LaneChange,
    Level,
    Stop,
    Straight,
    Turn,
)

PLACE = Origin(55.75, 37.62, 150.0)


def named(*manoeuvres):
    return [(type(m).__name__.lower(), m) for m in manoeuvres]


CAR = car(
    PLACE,
    named(
        Accelerate(15.0, 8.0),
        Along(60.0),
        Turn(90.0, 30.0),
        LaneChange(3.5, 4.0),
        Brake(5.0, 4.0),
        Turn(-400.0, 12.0),
        Stop(3.0, 5.0),
    ),
    heading_deg=30.0,
    sway_roll=0.4,
    sway_pitch=0.5,
)
AIRCRAFT = aircraft(
    PLACE,
    named(
        Climb(8.0, 500.0),
        BankedTurn(-90.0, 30.0),
        Climb(-4.0),
        BankedTurn(40.0, 45.0),
        Accelerate(120.0, 10.0),
        Level(),
    ),
    heading_deg=300.0,
    speed=100.0,
    attack_deg=3.0,
    ellipsoid=find_ellipsoid("pz90.11"),
)
SHIP = ship(
    PLACE,
    named(Straight(30.0), Turn(40.0, 300.0, 10.0), Straight(30.0)),
    heading_deg=250.0,
    speed=8.0,
    roll_waves=(Wave(6.0, 9.1), Wave(2.0, 5.3, 40.0)),
    pitch_waves=(Wave(1.5, 6.4, 90.0),),
    heading_waves=(Wave(0.8, 14.0),),
    heave_waves=(Wave(0.9, 7.2, 10.0),),
)
STAND = PathMotion(
    60.0,
    PLACE,
    roll_deg=1.0,
    attack_deg=-2.0,
    heading_deg=45.0,
    roll_waves=(Wave(3.0, 5.0),),
    pitch_waves=(Wave(2.0, 4.0, 30.0),),
    heading_waves=(Wave(1.0, 7.0, 60.0),),
)
VEHICLES = {"car": CAR, "aircraft": AIRCRAFT, "ship": SHIP, "stand": STAND}


def mp_waves(waves, t):
    return mpmath.fsum(
        mpf(w.amplitude)
        * mpmath.sin(2 * mpmath.pi * t / mpf(w.period) + mpmath.radians(mpf(w.phase_deg)))
        for w in waves
    )


class Written:
    """A path motion as its definition reads, in many digits, about an instant."""

    def __init__(self, motion: PathMotion, instant: float) -> None:
        self.m, self.at = motion, mpf(instant)
        times = [t for t in motion.turn_rate.times if t < instant]
        self.course = mpf(motion.heading_deg) + mpmath.fsum(
            # The rate is a quintic between the track's times: Gauss-Legendre is exact.
            mpmath.quad(lambda t: mp_track(motion.turn_rate, t), [a, b])
            for a, b in pairwise([*times, instant])
        )

    def speed(self, t):
        return mp_track(self.m.speed, self.at + t)

    def climb(self, t):
        return mpmath.radians(mp_track(self.m.climb, self.at + t))

    def turn_rate(self, t):
        return mp_track(self.m.turn_rate, self.at + t)

    def heading(self, t):
        """Right to the first derivative at zero."""
        return mpmath.radians(self.course + t * self.turn_rate(mpf(0)))

    def velocity(self, t):
        v, c, h = self.speed(t), self.climb(t), self.heading(t)
        heave = mpmath.diff(lambda x: mp_waves(self.m.heave_waves, x), self.at + t)
        level = v * mpmath.cos(c)
        return [level * mpmath.cos(h), level * mpmath.sin(h), heave - v * mpmath.sin(c)]

    def angles(self, t):
        m, g = self.m, mpf("9.80665")
        lateral = self.speed(t) * mpmath.cos(self.climb(t)) * mpmath.radians(self.turn_rate(t))
        bank = mpmath.degrees(mpmath.atan(lateral / g)) if m.coordinated else 0
        now = self.at + t
        roll = m.roll_deg - m.sway_roll * lateral + bank + mp_waves(m.roll_waves, now)
        gain = mpmath.diff(self.speed, t)
        pitch = (
            mpmath.degrees(self.climb(t))
            + mpf(m.attack_deg)
            + mpf(m.sway_pitch) * gain
            + mp_waves(m.pitch_waves, now)
        )
        heading = mpmath.degrees(self.heading(t)) + mp_waves(m.heading_waves, now)
        return [mpmath.radians(x) for x in (roll, pitch, heading)]


def instants(motion):
    """Two within every move, off the middle, thinned to eight."""
    edges = motion.breaks
    inner = [a + p * (b - a) for a, b in pairwise(edges) for p in (0.21, 0.83)]
    return inner[:: max(1, len(inner) // 8)]


@pytest.mark.slow
@pytest.mark.parametrize("name", VEHICLES)
def test_a_path_is_felt_as_in_inertial_axes(name):
    # A few last places of 10 m/s² (2e-15), and of rates under 1 rad/s (1e-16).
    motion = VEHICLES[name]
    for instant in instants(motion):
        with mpmath.workdps(30):
            written = Written(motion, instant)
        moved = motion.kinematics(np.array([instant])).moved
        start = motion.origin.place(moved)[0].tolist()
        place = course(motion.ellipsoid, start, written.velocity)
        rate, force = felt(motion.ellipsoid, place, written.angles)
        assert np.abs(motion.specific_force([instant])[0] - force).max() < 2e-14, instant
        assert np.abs(motion.rate([instant])[0] - rate).max() < 1e-15, instant


@pytest.mark.parametrize("name", VEHICLES)
def test_the_place_changes_as_the_velocity_says(name):
    # Central differences of sixth order over 0.02 s: their own error, 1e-3² of what the fifth
    # derivative makes in it, is under 1e-9 m/s; rounding of 1e-10 m over 0.02 s is 1e-8 m/s.
    motion = VEHICLES[name]
    t = np.linspace(0.5, motion.duration - 0.5, 57)
    near = np.abs(t[:, None] - np.array(motion.breaks)).min(axis=1)
    t, h = t[near > 0.04], 0.01
    weights = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    slope = sum(w * motion.kinematics(t + k * h).moved for k, w in weights.items()) / h
    k = motion.kinematics(t)
    lat = motion.origin.place(k.moved)[:, 0]
    e2, a = motion.ellipsoid.eccentricity_squared, motion.ellipsoid.semi_major_axis
    transverse = a / np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    meridian = transverse * (1.0 - e2) / (1.0 - e2 * np.sin(lat) ** 2)
    alt = motion.origin.alt + k.moved[:, 2]
    metres = [meridian + alt, (transverse + alt) * np.cos(lat), np.full(t.size, -1.0)]
    np.testing.assert_allclose(slope * np.column_stack(metres), k.velocity, rtol=0.0, atol=1e-8)


def test_manoeuvres_come_where_they_say():
    end = CAR.trajectory([CAR.duration]).iloc[0]
    assert end["heading"] == pytest.approx((30.0 + 90.0 - 400.0) % 360.0, abs=1e-12)
    assert (end[["VN", "VE", "VD"]] == 0.0).all()
    done = aircraft(PLACE, named(Climb(8.0, 500.0)), speed=100.0).trajectory
    length = aircraft(PLACE, named(Climb(8.0, 500.0)), speed=100.0).duration
    # Picard's panels are good to 1e-10 m, and the ramps' quadrature to rounding of 500 m.
    assert done([length]).iloc[0]["alt"] == pytest.approx(650.0, abs=1e-9)
    assert done([length]).iloc[0]["pitch"] == 0.0
    down = aircraft(PLACE, named(Climb(-8.0, 100.0)), speed=100.0)
    assert down.trajectory([down.duration]).iloc[0]["alt"] == pytest.approx(50.0, abs=1e-9)


@pytest.mark.parametrize("offset", [3.5, -3.5])
def test_a_lane_change_ends_beside(offset):
    lane = car(Origin(0.0, 0.0), named(LaneChange(offset, 4.0)), heading_deg=0.0, speed=15.0)
    end = lane.trajectory([lane.duration]).iloc[0]
    east = math.radians(end["lon"]) * WGS84.semi_major_axis
    # 60 m along the meridian from the equator bend the parallel by (60 m/a)²/2 of 3.5 m.
    assert east == pytest.approx(offset, abs=1e-8)
    assert end["heading"] % 360.0 == pytest.approx(0.0, abs=1e-12)


def test_a_stop_is_felt_as_rest():
    t = CAR.duration - np.linspace(4.0, 0.0, 9)
    still = CAR.kinematics(t)
    assert not still.velocity.any()
    assert not still.acceleration.any()
    assert not still.turning.any()
    assert (still.moved == still.moved[0]).all()


def test_a_coordinated_turn_is_felt_straight_down():
    # All but Coriolis (100 m/s * 1.5e-4 rad/s), the ground's curve (v²/R) and gravity's own size.
    turn = aircraft(PLACE, named(BankedTurn(180.0, 30.0)), speed=100.0)
    force = turn.specific_force([0.5 * turn.duration])[0]
    assert abs(force[1]) < 0.03
    assert force[2] == pytest.approx(-9.81 / math.cos(math.radians(30.0)), abs=0.03)


def test_a_track_is_integrated_in_closed_form():
    track = Track((0.0, 1.0, 2.5, 4.0), (1.0, -2.0, -2.0, 7.0))
    t = np.array([0.0, 0.3, 1.0, 1.7, 2.5, 3.9, 4.0, 6.0])
    exact = [float(mpmath.quad(lambda x: mp_track(track, x), _knots(end))) for end in t]
    np.testing.assert_allclose(integrate_track(track, t), exact, rtol=0.0, atol=4e-15)
    np.testing.assert_allclose(integrate_track(Track((0.0,), (2.0,)), t), 2.0 * t)


def _knots(end):
    return [0, *(k for k in (1, 2.5, 4) if k < end), end]


def test_means_are_integrals_of_what_is_felt():
    imu, _ = simulate_imu(SHIP, ImuErrors(), rate=10.0, sampling="mean")
    x, w = np.polynomial.legendre.leggauss(24)
    for k in (17, 333, 700):
        at = 0.1 * (k - 0.5) + 0.05 * x
        columns = list(imu.columns)
        rate, force = SHIP.rate(at), SHIP.specific_force(at)
        expected = 0.5 * w @ np.hstack([rate, force])
        # 8 nodes against 24 over 0.1 s of waves of 5 s; the rate's integral is of 1e-14 rad.
        np.testing.assert_allclose(imu[columns].to_numpy()[k], expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("speed", "manoeuvres", "words"),
    [
        (0.0, [Turn(90.0, 10.0)], "manoeuvre 1, turn, speed: a turn needs a speed"),
        (20.0, [Straight(1.0), Turn(90.0, 10.0)], "manoeuvre 2, turn, radius: 20 m/s on a radius"),
        (20.0, [Turn(90.0, 0.0)], "radius: 0 is not above zero"),
        (20.0, [Turn(0.0, 90.0)], "angle: a turn of 0 deg"),
        (0.0, [Accelerate(50.0, 2.0)], "needs up to 46.9 m/s²"),
        (0.0, [Accelerate(-5.0, 2.0)], "to: -5 is negative"),
        (5.0, [Brake(7.0, 2.0)], "braking from 5 to 7 m/s"),
        (0.0, [Stop(2.0, 1.0)], "braking from 0 to 0 m/s"),
        (5.0, [Straight(0.0)], "duration: 0 is not above zero"),
        (0.0, [Along(5.0)], "a distance needs a speed"),
        (20.0, [LaneChange(20.0, 2.0)], "lateral acceleration allowed"),
        (20.0, [LaneChange(3.0, -1.0)], "duration: -1 is not above zero"),
        (20.0, [Climb(30.0)], "a climb of 30 deg"),
        (20.0, [Climb(5.0, 1.0)], "the two ramps of 3 s alone gain"),
        (20.0, [Climb(5.0), Climb(5.0, 100.0)], "must begin level"),
        (20.0, [BankedTurn(90.0, -3.0)], "a bank of -3 deg"),
        (20.0, [Level(0.0)], "ramp: 0 is not above zero"),
        (-1.0, [Straight(1.0)], "initial speed of -1 m/s"),
        (1.0, [], "manoeuvres: none is given"),
    ],
)
def test_what_a_vehicle_cannot_do_is_said(speed, manoeuvres, words):
    with pytest.raises(ConfigError) as error:
        car(PLACE, named(*manoeuvres), speed=speed)
    assert words in str(error.value)


def test_waves_and_pitches_are_checked():
    with pytest.raises(
        ConfigError, check=coded("simulation.not-positive", quantity="period", value=0.0)
    ):
        Wave(1.0, 0.0)
    with pytest.raises(ConfigError, check=coded("simulation.not-finite")):
        Wave(math.inf, 1.0)
    with pytest.raises(
        ConfigError, check=coded("simulation.pitch-goes-up", quantity="pitch", steepest=85.0)
    ):
        PathMotion(1.0, PLACE, attack_deg=-80.0, pitch_waves=(Wave(5.0, 3.0),))
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "simulation.wave-comes-times"
    ):
        PathMotion(100.0, PLACE, roll_waves=(Wave(1.0, 1e-5),))
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "simulation.not-positive"
    ):
        PathMotion(0.0, PLACE)
