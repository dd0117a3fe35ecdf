"""Motions with exact truth: each quantity against the others, and against many digits."""

from __future__ import annotations

import importlib.util
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation import (
    SCENARIOS,
    Coning,
    Gesture,
    Handling,
    ImuErrors,
    Pulse,
    PulseMotion,
    SmoothRandom,
    Track,
)
from strapdown.simulation.motion import integrate_rate

_spec = importlib.util.spec_from_file_location(
    "exact_motions", Path(__file__).with_name("exact_motions.py")
)
exact = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(exact)
MOTIONS = exact.MOTIONS
BODIES = [name for name, m in MOTIONS.items() if not isinstance(m, Coning)]

# Central differences of eighth order: first and second derivative, from the middle out.
FIRST = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560])
# Powers of two, so that no time is rounded.
STEP = 2.0**-10
LONG_STEP = 2.0**-8


def times_clear(motion, step, count=400):
    grid = np.arange(int(motion.duration / step)) * step
    time = grid[:: max(1, len(grid) // count)]
    return exact.clear_of(exact.breaks(motion), time[(time > 5 * step)], 5 * step)


def first_derivative(f, time, step):
    return (
        sum(w * (f(time + k * step) - f(time - k * step)) for k, w in enumerate(FIRST, start=1))
        / step
    )


def second_derivative(f, time, step):
    outer = sum(
        w * (f(time + k * step) + f(time - k * step)) for k, w in enumerate(SECOND, start=1)
    )
    return (outer - 205 / 72 * f(time)) / step**2


@pytest.mark.parametrize("name", MOTIONS)
def test_the_rate_is_the_derivative_of_the_attitude(name):
    motion = MOTIONS[name]
    time = times_clear(motion, STEP)
    dq = first_derivative(motion.attitude, time, STEP)
    w, x, y, z = motion.attitude(time).T
    dw, dx, dy, dz = dq.T
    found = 2 * np.column_stack(
        [
            w * dx - x * dw - y * dz + z * dy,
            w * dy + x * dz - y * dw - z * dx,
            w * dz - x * dy + y * dx - z * dw,
        ]
    )
    # A quaternion carries some 1e-15, and up to 8e-15 where an angle reaches 3600 deg (63 rad, two
    # units of 1.1e-16 of it, half the angle); weights of 2.1 and the factor 2 over a step of 1 ms
    # make 4e-11 of that. The next term of the differences is (half rate x step)^8 / 630 of the
    # rate: 20 rad/s give 1e-16.
    assert np.abs(found - motion.rate(time)).max() < 4e-11


@pytest.mark.parametrize("name", BODIES)
def test_velocity_and_acceleration_are_the_derivatives_of_the_position(name):
    motion = MOTIONS[name]
    time = times_clear(motion, LONG_STEP)
    # Half a metre rounded at 1e-16, some ten times: 1e-15; weights sum to 2.1 over 4 ms and to
    # 6.5 over 15e-6 s². Between its breaks a hand's track is a quintic and has no next term; the
    # random one has (2 pi 1.5 Hz step)^8 / 3150 of its acceleration, 1e-15.
    velocity = first_derivative(motion.position, time, LONG_STEP)
    assert np.abs(velocity - motion.velocity(time)).max() < 2.1 * 1e-15 / LONG_STEP + 1e-12
    acceleration = second_derivative(motion.position, time, LONG_STEP)
    assert np.abs(acceleration - motion.acceleration(time)).max() < 6.5 * 1e-15 / LONG_STEP**2


@pytest.mark.parametrize("name", ["gesture from a skew pose", "random", "alexiev-fig6"])
def test_everything_agrees_with_twenty_five_digits(name):
    motion = MOTIONS[name]
    edges = exact.breaks(motion)
    starts = rotation.dcm_from_quaternion(motion.q_nb)
    for t in (edges[1:-2] + 0.4 * np.diff(edges[1:-1]))[::3]:
        with mpmath.workdps(25):
            place = mpmath.mpf(float(t))
            c = exact.mp_coordinates(motion, place)
            d = [
                mpmath.diff(lambda s, i=i: exact.mp_coordinates(motion, s)[i], place)
                for i in range(6)
            ]
            dd = [
                mpmath.diff(lambda s, i=i: exact.mp_coordinates(motion, s)[i], place, 2)
                for i in range(3, 6)
            ]
            matrix = np.array(exact.mp_matrix(c[:3]).tolist(), dtype=float)
            rate = np.array(exact.mp_rate(c[:3], d[:3]), dtype=float)
        at = [t]
        # Some ten roundings; an angle of hundreds of deg is itself rounded at 1e-15 rad.
        found = rotation.dcm_from_quaternion(motion.attitude(at)[0])
        assert np.abs(found - starts @ matrix).max() < 1e-14
        assert np.abs(motion.rate(at)[0] - rate).max() < 1e-14 * max(1.0, np.abs(rate).max())
        for values, known in ((motion.position(at), c[3:]), (motion.velocity(at), d[3:])):
            assert np.abs(values[0] - np.array(known, dtype=float)).max() < 1e-14
        assert np.abs(motion.acceleration(at)[0] - np.array(dd, dtype=float)).max() < 1e-13


def test_the_rate_of_the_many_digits_is_the_derivative_of_their_attitude():
    with mpmath.workdps(25):
        angles = lambda t: [50 * t, 40 * mpmath.sin(t), 300 * t * t]  # noqa: E731
        t = mpmath.mpf("0.7")
        rates = [mpmath.diff(lambda s, i=i: angles(s)[i], t) for i in range(3)]
        d = mpmath.matrix(3, 3)
        for i in range(3):
            for j in range(3):
                d[i, j] = mpmath.diff(lambda s, i=i, j=j: exact.mp_matrix(angles(s))[i, j], t)
        skew = exact.mp_matrix(angles(t)).T * d
        w = exact.mp_rate(angles(t), rates)
        assert max(abs(skew[2, 1] - w[0]), abs(skew[0, 2] - w[1]), abs(skew[1, 0] - w[2])) < 1e-10


@pytest.mark.parametrize("name", ["gesture from a skew pose", "random"])
def test_the_angle_is_the_quadrature_of_many_digits(name):
    motion = MOTIONS[name]
    end = 2.6
    pieces = [*(b for b in exact.breaks(motion) if b < end), end]

    def rate(t):
        c = exact.mp_coordinates(motion, t)
        # The derivative of the coordinates by a step that 30 digits bear.
        h = mpmath.mpf(10) ** -10
        ahead, behind = exact.mp_coordinates(motion, t + h), exact.mp_coordinates(motion, t - h)
        d = [(a - b) / (2 * h) for a, b in zip(ahead[:3], behind[:3], strict=True)]
        return exact.mp_rate(c[:3], d)

    with mpmath.workdps(30):
        nodes, weights = (
            [mpmath.mpf(float(v)) for v in column] for column in np.polynomial.legendre.leggauss(24)
        )
        total = [mpmath.mpf(0)] * 3
        for left, right in pairwise(pieces):
            for k in range(3):
                a = mpmath.mpf(left) + (mpmath.mpf(right) - left) * k / 3
                half = (mpmath.mpf(right) - left) / 6
                for x, w in zip(nodes, weights, strict=True):
                    value = rate(a + half * (1 + x))
                    total = [s + half * w * v for s, v in zip(total, value, strict=True)]
    # The nodes are rounded at 1e-16; what the code promises is 1e-14 rad and rounding.
    assert np.abs(motion.angle([end])[0] - np.array(total, dtype=float)).max() < 3e-14


@pytest.mark.parametrize("name", MOTIONS)
def test_increments_of_the_angle_are_integrals_of_the_rate(name):
    motion = MOTIONS[name]
    length = 0.04
    start = times_clear(motion, STEP)
    edges = exact.breaks(motion)
    start = start[(np.searchsorted(edges, start) == np.searchsorted(edges, start + length))]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    at = start[:, None] + 0.5 * length * (1 + nodes)
    rates = motion.rate(at.ravel()).reshape(len(start), 20, 3)
    whole = 0.5 * length * np.einsum("j,ijk->ik", weights, rates)
    found = motion.angle(start + length) - motion.angle(start)
    # Both ends carry 1e-14 and the rounding of the whole angle, 70 rad at most.
    size = np.abs(motion.angle(start)).max()
    assert np.abs(found - whole).max() < 3e-14 + 4 * np.finfo(float).eps * size
    assert np.array_equal(motion.angle([0.0]), np.zeros((1, 3)))


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTIONS)
def test_another_integrator_ends_at_the_same_attitude(name):
    motion = MOTIONS[name]
    edges = exact.breaks(motion)
    edges = edges[edges <= 12.0] if edges[-1] > 12.0 and len(edges) > 2 else edges
    edges = np.array([0.0, 2.0]) if isinstance(motion, Coning) else edges

    def derivative(t, q):
        x, y, z = motion.rate(np.array([t]))[0]
        w, a, b, c = q
        return 0.5 * np.array(
            [
                -a * x - b * y - c * z,
                w * x + b * z - c * y,
                w * y + c * x - a * z,
                w * z + a * y - b * x,
            ]
        )

    q, steps = motion.attitude(edges[:1])[0], 0
    for left, right in pairwise(edges):
        run = solve_ivp(
            derivative, (left, right), q, method="DOP853", rtol=1e-12, atol=1e-13,
            first_step=min(0.01, right - left), max_step=0.25,
        )  # fmt: skip
        q, steps = run.y[:, -1], steps + run.nfev // 12
    error = rotation.rotation_angle(q / np.linalg.norm(q), motion.attitude(edges[-1:])[0])
    # Each step keeps 1e-12 of every component: 2e-12 of half the angle, and nothing damps it.
    assert np.radians(error) < 4e-12 * steps


@pytest.mark.parametrize("name", [n for n, s in SCENARIOS.items() if s.references])
def test_a_scenario_lies_still_and_in_the_same_pose_where_it_says_so(name):
    scenario = SCENARIOS[name]
    motion = scenario.motion
    for sentence in scenario.references:
        there, since = sentence.split(" same as ")
        known = {"start": 0.0, "end": motion.duration}
        at = np.array([known.get(there) or float(there), known.get(since, -1.0)])
        at[1] = float(since) if at[1] < 0.0 else at[1]
        q = motion.attitude(at)
        assert np.array_equal(q[0], q[1]) or np.array_equal(q[0], -q[1])
        for method in (motion.rate, motion.velocity, motion.acceleration):
            assert not method(at).any()
        assert np.array_equal(*motion.position(at))


@pytest.mark.parametrize(
    ("name", "rests"),
    [
        ("alexiev-fig6", [(0, 5), (9, 11)]),
        ("intensive", [(0, 2), (8, 10)]),
        ("smooth-random", [(0, 2), (58, 60)]),
        (
            "gestures",
            [(0, 2), (5.2, 7.2), (11.8, 14), (15.8, 17.8), (19.6, 21.6), (24.6, 26.6), (30.4, 33)],
        ),
    ],
)
def test_nothing_moves_in_a_rest(name, rests):
    motion = SCENARIOS[name].motion
    for start, end in rests:
        assert end - start >= 1.5
        time = np.linspace(start, end, 201)
        for method in (motion.rate, motion.velocity, motion.acceleration):
            assert not method(time).any()
        for method in (motion.angle, motion.attitude, motion.position):
            values = method(time)
            assert (values == values[0]).all()
    between = np.linspace(rests[0][1], rests[1][0], 52)[1:-1]
    assert motion.rate(between).any(axis=1).all()


def test_handling_lies_still_for_a_second_and_a_half_between_gestures_that_end_where_they_began():
    motion = SCENARIOS["handling"].motion
    time = np.arange(0.0, 600.0, 0.05)
    still = ~motion.rate(time).any(axis=1)
    runs = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    lengths = (runs[1::2] - runs[::2]) * 0.05
    long = lengths > 1.0
    assert lengths[long].min() >= 1.45
    assert 40 < long.sum() < 100
    for start, end in zip(runs[::2][long], runs[1::2][long], strict=True):
        q = motion.attitude(time[start:end])
        assert np.array_equal(np.abs(q), np.tile([1.0, 0.0, 0.0, 0.0], (end - start, 1)))
        assert not motion.position(time[start:end]).any()
    # A hand and not a machine: under 3 g.
    assert np.linalg.norm(motion.acceleration(time), axis=1).max() < 30.0


@pytest.mark.parametrize(
    "make", [lambda seed: SmoothRandom(12.0, seed, 50.0, 1.0), lambda seed: Handling(30.0, seed)]
)
def test_the_seed_makes_the_motion(make):
    time = np.linspace(0.0, 12.0, 101)
    first, again, other = make(1), make(1), make(2)
    assert first == again
    assert np.array_equal(first.rate(time), again.rate(time))
    assert np.array_equal(first.position(time), again.position(time))
    assert not np.array_equal(first.rate(time), other.rate(time))


def outside(values, step, low, high):
    """Part of the energy at frequencies outside [low, high]."""
    power = (np.abs(np.fft.rfft(values, axis=0)) ** 2).sum(axis=1)
    power[1:-1] *= 2.0
    f = np.fft.rfftfreq(len(values), step)
    return power[(f < low) | (f > high)].sum() / power.sum()


def test_the_random_motion_keeps_to_its_band():
    band, ramp = (1.0, 2.0), 5.0
    motion = SmoothRandom(60.0, 3, 6.0, 1.0, band=band, ramp=ramp, rest=2.0)
    step = 0.02
    time = np.arange(0.0, 60.0, step)
    # The ramp's third derivative has the variation 600/ramp³, so that its transform is under that
    # by (2 pi f)^4, and the energy of one term further than 0.5 Hz away under
    # 2 (4.8)² / ((2 pi)^8 7 0.5^7) of the 46 s² that it has; 57 terms, at worst all in phase.
    spread = 57 * 2 * 4.8**2 / ((2 * np.pi) ** 8 * 7 * 0.5**7) / 46
    assert spread < 1e-3
    assert outside(motion.position(time), step, 0.5, 2.5) < spread
    # The body rate is that of the angles but for products of angle and rate.
    angles = np.abs(rotation.rotation_vector_from_quaternion(motion.attitude(time))).max()
    assert outside(motion.rate(time), step, 0.5, 2.5) < (np.sqrt(spread) + 2 * angles) ** 2 < 0.02
    # It fills the band, too: half of it is in each half.
    assert 0.2 < outside(motion.acceleration(time), step, 1.5, 25.0) < 0.8


def test_the_random_motion_has_the_rates_that_are_stated():
    time = np.arange(4.0, 56.0, 0.05)
    rates, accelerations = [], []
    for seed in range(20):
        motion = SmoothRandom(60.0, seed, 60.0, 0.5)
        rates.append((np.degrees(motion.rate(time)) ** 2).sum(axis=1).mean())
        accelerations.append((motion.acceleration(time) ** 2).sum(axis=1).mean())
    # The mean square of one axis over 52 s in a band of 1.9 Hz spreads by 1/sqrt(52 x 1.9), three
    # axes and 20 seeds less: 1.3 %; three sigma of the mean square.
    bound = 3 / np.sqrt(52 * 1.9 * 3 * 20)
    assert np.mean(rates) == pytest.approx(60.0**2, rel=bound)
    assert np.mean(accelerations) == pytest.approx(0.5**2, rel=bound)


def test_whole_turns_leave_the_pose_to_the_last_bit():
    motion = Gesture(5.0, roll=Track((1.0, 2.0), (12.5, 372.5)), q_nb=exact.SKEW)
    first, last = motion.attitude([0.0, 4.0])
    assert np.array_equal(first, -last)
    q = motion.attitude(np.linspace(0.0, 5.0, 2001))
    # Continuous in sign: 1.875 turns a second and steps of 2.5 ms.
    assert np.abs(np.diff(q, axis=0)).max() < 1.875 * np.pi * 0.0025 * 1.01


def test_the_new_motions_do_not_know_pulses():
    new = [s for s in SCENARIOS.values() if not isinstance(s.motion, PulseMotion) or s.after]
    assert len(new) >= 11
    assert all(s.errors == ImuErrors() for s in new)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Coning(0.0, 1.0, 1.0), "half_angle: 0 is not above zero"),
        (lambda: Coning(180.0, 1.0, 1.0), "below 180 deg"),
        (lambda: Coning(1.0, float("nan"), 1.0), "frequency"),
        (lambda: Coning(1.0, 1.0, 1.0, axis=(0.0, 0.0, 0.0)), "is zero"),
        (lambda: Track((), ()), "at least one"),
        (lambda: Track((0.0, 1.0), (0.0,)), "2 times and 1 values"),
        (lambda: Track((0.0, 1.0, 1.0), (0.0, 1.0, 2.0)), "is not after"),
        (lambda: Track((0.0, float("inf")), (0.0, 1.0)), "not finite"),
        (lambda: Gesture(0.0), "duration: 0 is not above zero"),
        (lambda: SmoothRandom(7.0, 1, 10.0), "use at least 8 s"),
        (lambda: SmoothRandom(20.0, 1, 10.0, band=(0.13, 0.14)), "no multiple"),
        (lambda: SmoothRandom(20.0, 1, 10.0, band=(0.0, 1.0)), "no multiple"),
        (lambda: Handling(4.0, 1), "at least 5 s"),
    ],
)
def test_what_is_no_motion_is_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


# Half a stride of the walk, whose rate takes the most steps.
@pytest.mark.parametrize(
    ("name", "end"), [("walking", 2.5), ("throwing", 4.0), ("steering", 4.0), ("gesture", 4.0)]
)
def test_attitude_of_an_activity_is_that_of_another_integrator(name, end):
    motion = SCENARIOS[name].motion
    inner = {t for p in motion.pulses for t in (p.start, p.start + p.edge, p.end - p.edge, p.end)}
    edges = [2.0, *sorted(t for t in inner if 2.0 < t < end), end]
    q = motion.attitude([2.0])[0]

    def derivative(t, q):
        x, y, z = motion.rate(np.array([t]))[0]
        w, a, b, c = q
        return 0.5 * np.array(
            [-a * x - b * y - c * z, w * x + b * z - c * y, w * y + c * x - a * z,
             w * z + a * y - b * x]
        )  # fmt: skip

    steps = 0
    for left, right in pairwise(edges):
        if right - left > 1e-9:
            run = solve_ivp(derivative, (left, right), q, method="DOP853", rtol=1e-10, atol=1e-11)
            q, steps = run.y[:, -1], steps + len(run.t)
    error = rotation.rotation_angle(q / np.linalg.norm(q), motion.attitude([end])[0])
    # Each step keeps 1e-10 of every component, twice that of half the angle.
    assert np.radians(error) < 4e-10 * steps


def test_pulse_with_edges_turns_by_what_it_is_said_to():
    pulse = Pulse(1, 1.0, 3.0, 0.5, edge=0.4)
    motion = PulseMotion((pulse,), 4.0)
    assert motion.angle([4.0])[0, 1] == pytest.approx(0.5 * (2.0 - 0.4), rel=1e-15)
    found = rotation.rotation_vector_from_quaternion(motion.attitude([4.0])[0])
    assert np.abs(found - [0.0, 0.8, 0.0]).max() < 1e-14
    # Half of an edge has half of the rate, and between the edges it is whole.
    assert np.abs(motion.rate([1.2, 2.0, 2.8])[:, 1] - [0.25, 0.5, 0.25]).max() < 1e-15
    assert not motion.rate([1.0, 3.0]).any()


def test_narrow_edges_are_almost_a_rectangle():
    """An edge of 1 µs is 1 µs late at its start, and as early at its end."""
    table = [(0, 1.0, 2.0, 2.0), (1, 1.5, 3.0, -1.0)]
    sharp = PulseMotion(tuple(Pulse(*row) for row in table), 4.0)
    edged = PulseMotion(tuple(Pulse(*row, edge=1e-6) for row in table), 4.0)
    apart = rotation.rotation_angle(sharp.attitude([4.0])[0], edged.attitude([4.0])[0])
    assert 0.0 < np.radians(apart) < 1e-6 * 3.0


def test_pulse_that_its_edges_do_not_fit_into_is_refused():
    with pytest.raises(ConfigError) as refused:
        PulseMotion((Pulse(0, 1.0, 2.0, 1.0, edge=0.51),), 4.0)
    assert refused.value.finding.code == "simulation.pulse-shorter-than-edges"
    with pytest.raises(ConfigError) as refused:
        PulseMotion((Pulse(0, 1.0, 2.0, 1.0),), 4.0, arm=(0.1, 0.0, 0.0))
    assert refused.value.finding.code == "simulation.arm-without-edges"


def test_a_rate_that_no_panels_follow_is_refused_in_bounded_memory():
    def noise(time):
        return np.sin(1e16 * np.asarray(time))[:, None] * [1.0, 0.0, 0.0]

    with pytest.raises(ConfigError, check=coded("simulation.motion-too-fast")):
        integrate_rate(noise, [0.0, 12.0])
    # 400 Hz are followed.
    turned = integrate_rate(lambda t: np.cos(800.0 * np.pi * t)[:, None] * [1.0, 0, 0], [0.0, 1.0])
    at = np.linspace(0.0, 1.0, 777)
    exact = np.sin(800.0 * np.pi * at) / (800.0 * np.pi)
    np.testing.assert_allclose(turned(at)[:, 0], exact, rtol=0.0, atol=1e-13)
