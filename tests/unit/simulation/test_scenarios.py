"""Scenarios: exact by construction, and the same on every machine."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation import (
    SCENARIOS,
    ImuErrors,
    Pulse,
    PulseMotion,
    TriadErrors,
    find_scenario,
    simulate_imu,
)
from strapdown.tables import GYRO, QUATERNION

# What Alexiev's Section 4 and Fig. 2 ask for: which axes turn, and which errors there are.
PANELS = {
    "alexiev-fig2a": (1, (), False),
    "alexiev-fig2b": (2, (), True),
    "alexiev-fig2c": (3, (), True),
    "alexiev-fig2d": (3, ("noise",), True),
    "alexiev-fig2e": (2, ("noise", "bias"), True),
    "alexiev-fig2f": (2, ("noise", "trend"), True),
    "alexiev-fig4": (2, (), True),
    "alexiev-fig5": (3, (), True),
    "alexiev-fig5-large": (3, (), True),
    "alexiev-sequence": (3, (), False),
}

#: Of rectangles alone: those with edges have no closed form (`test_motions`).
OF_PULSES = [
    name
    for name, s in SCENARIOS.items()
    if isinstance(s.motion, PulseMotion) and not any(p.edge for p in s.motion.pulses)
]


@pytest.mark.parametrize("name", PANELS)
def test_each_panel_is_what_its_caption_says(name):
    axes, errors, overlap = PANELS[name]
    scenario = SCENARIOS[name]
    pulses = scenario.motion.pulses
    assert len({p.axis for p in pulses}) == axes
    found = [
        kind
        for kind, value in (
            ("noise", any(scenario.errors.gyro.noise_density)),
            ("bias", any(scenario.errors.gyro.bias)),
            ("trend", len(set(scenario.errors.gyro.trend)) == 3),
        )
        if value
    ]
    assert tuple(found) == errors
    together = any(
        a.start < b.end and b.start < a.end for a in pulses for b in pulses if a is not b
    )
    assert together == overlap


def mp_exp(vector):
    angle = mpmath.sqrt(sum(v * v for v in vector))
    if angle == 0:
        return mpmath.eye(3)
    x, y, z = (v / angle for v in vector)
    k = mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return mpmath.eye(3) + mpmath.sin(angle) * k + (1 - mpmath.cos(angle)) * k * k


@pytest.mark.parametrize("name", OF_PULSES)
def test_the_final_attitude_is_the_product_of_exponentials(name):
    """In forty digits, apart from the code: one exponential between each two edges."""
    motion = SCENARIOS[name].motion
    with mpmath.workdps(40):
        edges = sorted({mpmath.mpf(e) for p in motion.pulses for e in (p.start, p.end)})
        matrix = mpmath.eye(3)
        for start, end in pairwise(edges):
            turn = [mpmath.mpf(0)] * 3
            for p in motion.pulses:
                if p.start <= start and end <= p.end:
                    turn[p.axis] += mpmath.mpf(p.rate) * (end - start)
            matrix = matrix * mp_exp(turn)
        exact = np.array(matrix.tolist(), dtype=float)
    found = rotation.dcm_from_quaternion(motion.attitude([motion.duration])[0])
    # One rounding of about 2e-16 in each element for each edge.
    assert np.abs(found - exact).max() < 2e-16 * 2 * (len(edges) + 1)


@pytest.mark.parametrize("name", OF_PULSES)
@pytest.mark.parametrize("rate", [7.0, 100.0])
def test_the_angle_is_the_integral_of_the_rate_and_the_attitude_follows_it(name, rate):
    motion = SCENARIOS[name].motion
    time = np.arange(int(motion.duration * rate) + 1) / rate
    # Inside an interval of constant rate the attitude turns by exp(increment of the angle).
    edges = np.array([e for p in motion.pulses for e in (p.start, p.end)])
    clear = np.array([not ((edges > a) & (edges < b)).any() for a, b in pairwise(time)])
    q = motion.attitude(time)
    turn = rotation.quaternion_from_rotation_vector(np.diff(motion.angle(time), axis=0))
    error = rotation.rotation_angle(rotation.compose(q[:-1], turn), q[1:])
    assert clear.any()
    assert error[clear].max() < 1e-12


def test_mean_rates_add_up_to_the_angle_at_any_rate():
    motion = SCENARIOS["alexiev-fig2c"].motion
    for rate in (3.0, 10.0, 333.0):
        imu, _ = simulate_imu(motion, ImuErrors(), rate=rate, sampling="mean")
        total = imu[GYRO].to_numpy()[1:].sum(axis=0) / rate
        assert np.allclose(total, motion.angle([imu.index[-1]])[0], atol=1e-12)


def test_a_half_open_pulse_reads_its_rate_at_the_start_and_not_at_the_end():
    pulse = PulseMotion((Pulse(1, 2.0, 3.0, 2.0),), 5.0)
    assert pulse.rate([2.0, 2.5, 3.0])[:, 1].tolist() == [2.0, 2.0, 0.0]
    closed = PulseMotion((Pulse(1, 2.0, 3.0, 2.0, closed=True),), 5.0)
    assert closed.rate([2.0, 2.5, 3.0])[:, 1].tolist() == [2.0, 2.0, 2.0]
    assert np.array_equal(closed.attitude([3.0, 5.0]), pulse.attitude([3.0, 5.0]))


def test_the_seed_decides_the_noise_and_nothing_else_does():
    scenario = SCENARIOS["alexiev-fig2d"]
    first, again, other = (
        simulate_imu(scenario.motion, scenario.errors, rate=100.0, seed=seed)[0]
        for seed in (4, 4, 5)
    )
    assert first.equals(again)
    assert not first.equals(other)


@pytest.mark.parametrize("rate", [10.0, 1000.0])
def test_noise_bias_and_trend_have_the_size_that_is_stated(rate):
    still = PulseMotion((Pulse(0, 0.0, 1.0, 0.0),), 2000.0 / rate * 10)
    errors = TriadErrors(noise_density=0.01, bias=(0.1, 0.2, 0.3), trend=(0.0, 0.01, -0.01))
    imu, truth = simulate_imu(still, ImuErrors(errors), rate=rate, seed=1)
    time = imu.index.to_numpy()
    left = imu[GYRO].to_numpy() - np.array(errors.bias) - np.outer(time, errors.trend)
    # 20000 samples an axis: the standard deviation is known to 0.5 %, three axes; bound 4 sigma.
    assert left.std() / np.sqrt(rate) == pytest.approx(0.01, rel=4 / np.sqrt(2 * left.size))
    assert np.abs(truth[QUATERNION].to_numpy() - [1, 0, 0, 0]).max() == 0.0


def test_mean_samples_hold_the_mean_of_the_trend():
    still = PulseMotion((Pulse(0, 0.0, 1.0, 0.0),), 10.0)
    imu, _ = simulate_imu(
        still, ImuErrors(TriadErrors(trend=(0.1, 0, 0))), rate=10.0, sampling="mean"
    )
    # Over [t - 0.1, t] a growth of 0.1 t has the mean 0.1 (t - 0.05).
    assert np.allclose(imu["gyro_x"], 0.1 * (imu.index.to_numpy() - 0.05), atol=1e-15)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rate": 0.0}, "fewer than two samples"),
        ({"rate": -5.0}, "fewer than two samples"),
        ({"rate": float("nan")}, "fewer than two samples"),
        ({"rate": 1e9}, "use at most"),
        ({"rate": 10.0, "sampling": "average"}, "sampling: unknown kind of sampling 'average'"),
    ],
)
def test_what_cannot_be_sampled_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        simulate_imu(SCENARIOS["alexiev-fig4"].motion, ImuErrors(), **options)


def test_an_unknown_scenario_is_named_with_the_nearest():
    with pytest.raises(ConfigError, match="did you mean 'alexiev-fig4'"):
        find_scenario("alexiev-fig4x4")
