import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.estimation.sensor_blocks import (
    ERRORS_OF_SENSORS,
    accel_bias,
    accel_drift,
    accel_misalignment,
    accel_scale,
    g_sensitivity,
    gauss_markov,
    gyro_bias,
    gyro_drift,
    gyro_misalignment,
    gyro_scale,
    lever_arm,
    mounting,
    random_walk,
    standard_states,
    stated_states,
    states_that_are_stated,
    time_offset,
)
from strapdown.estimation.sensor_states import StateLayout
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.error_chain import apply
from strapdown.sensors.triad_errors import TriadErrors
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty

XYZ = ("x", "y", "z")


def coupled(coupling, rate, force, x):
    """What states add to samples, as `SensorStates` says it."""
    inputs = np.column_stack([np.ones(len(rate)), rate, force])
    return np.einsum("nc,cik,k->ni", inputs, coupling, x)


def samples():
    rng = np.random.default_rng(3)
    time = np.arange(50) * 0.01
    return time, rng.normal(0.0, 0.5, (50, 3)), rng.normal(0.0, 9.0, (50, 3))


def matrix(terms, values):
    """3x3 of terms named ``xy``."""
    out = np.zeros((3, 3))
    for term, value in zip(terms, values, strict=True):
        out[XYZ.index(term[0]), XYZ.index(term[1])] = value
    return out.tolist()


@pytest.mark.parametrize(
    ("block", "triad", "errors"),
    [
        (gyro_bias(1e-3), "gyro", lambda s, x: TriadErrors(bias=x)),
        (accel_bias(1e-3), "accel", lambda s, x: TriadErrors(bias=x)),
        (gyro_drift(1e-3, 60.0), "gyro", lambda s, x: TriadErrors(bias=x)),
        (accel_drift(1e-3, 60.0), "accel", lambda s, x: TriadErrors(bias=x)),
        (gyro_scale(1e-3), "gyro", lambda s, x: TriadErrors(scale=x)),
        (accel_scale(1e-3), "accel", lambda s, x: TriadErrors(scale=x)),
        (
            gyro_misalignment(1e-3),
            "gyro",
            lambda s, x: TriadErrors(misalignment=matrix(s.block.labels, x)),
        ),
        (
            accel_misalignment(1e-3, terms=("yx", "zx", "zy")),
            "accel",
            lambda s, x: TriadErrors(misalignment=matrix(s.block.labels, x)),
        ),
        (
            g_sensitivity(1e-3),
            "gyro",
            lambda s, x: TriadErrors(g_sensitivity=matrix(s.block.labels, x)),
        ),
    ],
    ids=lambda p: p.block.name if hasattr(p, "block") else "",
)
def test_couplings_are_those_of_the_error_chain(block, triad, errors):
    # Every one of these errors is linear in its parameter: the difference of the chain is exact
    # but for rounding, 1e-15 of values of 10.
    time, rate, force = samples()
    x = np.random.default_rng(1).normal(0.0, 0.01, len(block.block))
    true = rate if triad == "gyro" else force
    wrong = apply(errors(block, x), time, true, specific_force=force) - true
    ours, other = (block.gyro, block.accel) if triad == "gyro" else (block.accel, block.gyro)
    np.testing.assert_allclose(coupled(ours, rate, force, x), wrong, atol=1e-14)
    assert np.abs(wrong).max() > 1e-3
    assert not other.any()


@pytest.mark.parametrize("block", [lever_arm((0.1, 0.2, 0.3)), time_offset(0.01), mounting(0.02)])
def test_what_only_measurements_see_adds_nothing(block):
    assert not block.gyro.any()
    assert not block.accel.any()
    assert not block.drive.any()
    assert math.isinf(block.correlation_time)


def test_every_block_has_its_shapes_and_name():
    for name, make in ERRORS_OF_SENSORS.items():
        states = make(0.5, 100.0) if name.endswith("drift") else make(0.5)
        k = len(states.block)
        assert states.block.name == name
        assert states.sd.shape == states.drive.shape == (k,)
        assert states.gyro.shape == states.accel.shape == (7, 3, k)
        np.testing.assert_array_equal(states.sd, 0.5)


def test_a_standard_deviation_by_axis_goes_to_the_terms_of_its_sensor():
    assert gyro_misalignment((1.0, 2.0, 3.0)).sd.tolist() == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert g_sensitivity((1.0, 2.0, 3.0)).sd.tolist() == [1.0] * 3 + [2.0] * 3 + [3.0] * 3


def test_gauss_markov_keeps_its_variance():
    # dP/dt = -2 P / tau + drive² is zero.
    states = gauss_markov(gyro_scale((1e-4, 2e-4, 3e-4)), 600.0)
    np.testing.assert_allclose(states.drive**2, 2.0 * states.sd**2 * states.decay, rtol=1e-15)


def test_random_walk_has_its_drive():
    states = random_walk(gauss_markov(accel_bias(1e-3), 10.0), 2e-6)
    assert states.decay == 0.0
    np.testing.assert_array_equal(states.drive, 2e-6)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: gyro_bias(-1.0), "gyro_bias: -1.0 is not a standard deviation"),
        (lambda: accel_bias((1.0, 2.0)), r"accel_bias: \(1.0, 2.0\)"),
        (lambda: accel_scale(math.nan), "accel_scale: nan"),
        (lambda: time_offset((1.0, 1.0, 1.0)), "time_offset"),
        (
            lambda: gyro_drift(1.0, math.inf),
            "correlation_time: a correlation time of inf s of gyro_drift is not",
        ),
        (lambda: gyro_misalignment(1.0, terms=("xy", "xx")), "terms"),
        (lambda: gyro_misalignment(1.0, terms=()), "terms"),
        (lambda: gyro_misalignment(1.0, terms=("xy", "xy")), "once"),
        (lambda: random_walk(gyro_bias(1.0), "1"), "gyro_bias"),
    ],
)
def test_bad_numbers_are_named(make, said):
    with pytest.raises(ConfigError, match=said):
        make()


def names(states):
    return [s.block.name for s in states]


def test_a_data_sheet_gives_constant_and_drift():
    sensor = ImuUncertainty.of_sensor(load_sensor("fog-1000"))
    states = standard_states(sensor)
    assert names(states) == ["gyro_bias", "gyro_drift", "accel_bias", "accel_drift"]
    assert StateLayout(tuple(s.block for s in states)).size == 12
    for bias, drift, triad, process in (
        (states[0], states[1], sensor.gyro, sensor.gyro_drift),
        (states[2], states[3], sensor.accel, sensor.accel_drift),
    ):
        np.testing.assert_array_equal(bias.sd, triad.axis("bias"))
        np.testing.assert_array_equal(drift.sd, process.triad)
        assert drift.correlation_time == process.correlation_time
        assert not bias.drive.any()


def test_a_drift_without_end_is_part_of_the_constant():
    sensors = ImuUncertainty(
        TriadUncertainty(bias=3.0), TriadUncertainty(bias=1.0), BiasDrift(4.0, math.inf)
    )
    states = standard_states(sensors)
    assert names(states) == ["gyro_bias", "accel_bias"]
    np.testing.assert_allclose(states[0].sd, 5.0)
    np.testing.assert_allclose(states[1].sd, 1.0)


def test_states_by_name_have_the_sizes_that_are_stated():
    gyro = TriadUncertainty(bias=3.0, scale=2e-3, g_sensitivity=1e-4)
    accel = TriadUncertainty(bias=0.2, misalignment=5e-4)
    sensors = ImuUncertainty(gyro, accel, BiasDrift(4.0, 300.0), BiasDrift(0.1, math.inf))
    # A drift without a correlation time has no model; what has no size is not stated.
    stated = states_that_are_stated(sensors)
    assert stated == (
        "gyro_bias", "accel_bias", "gyro_drift", "gyro_scale", "accel_misalignment", "g_sensitivity"
    )  # fmt: skip
    made = dict(zip(stated, stated_states(sensors, stated), strict=True))
    assert [one.block.name for one in made.values()] == list(stated)
    sizes = {
        "gyro_bias": 3.0,  # its drift is a state of its own
        "accel_bias": math.hypot(0.2, 0.1),  # a drift that does not change is constant
        "gyro_drift": 4.0,
        "gyro_scale": 2e-3,
        "accel_misalignment": 5e-4,
        "g_sensitivity": 1e-4,
    }
    for name, size in sizes.items():
        np.testing.assert_allclose(made[name].sd, size, rtol=1e-12, err_msg=name)
        lasting = 300.0 if name == "gyro_drift" else math.inf
        assert made[name].correlation_time == lasting, name
    with pytest.raises(ConfigError, check=coded("estimation.nothing-states-over-time-changes-2")):
        stated_states(sensors, ["accel_drift"])


def test_three_states_for_a_bias_bound_what_twice_three_hold():
    bias, sd, tau = 2e-7, 5e-8, 300.0
    triad = TriadUncertainty(bias=bias)
    sensors = ImuUncertainty(triad, triad, BiasDrift(sd, tau), BiasDrift(sd, tau))
    states = standard_states(sensors, separate=False)
    assert names(states) == ["gyro_bias", "accel_bias"]
    assert states[0].decay == 0.0

    def least(start, drive2):
        """Least eigenvalue of walk less truth, over variance; both dense and long instants."""
        t = np.concatenate([[0.0], np.geomspace(1e-3, 10.0, 150)]) * tau
        s, u = np.meshgrid(t, t)
        true = bias**2 + sd**2 * np.exp(-np.abs(s - u) / tau)
        return np.linalg.eigvalsh(start**2 + drive2 * np.minimum(s, u) - true)[0] / sd**2

    start, drive2 = states[0].sd[0], states[0].drive[0] ** 2
    # Rounding of 151 values of up to 60: 1e-13.
    assert least(start, drive2) > -1e-12
    # A tenth less of either bounds no more.
    assert least(math.hypot(bias, math.sqrt(1.8) * sd), drive2) < -1e-3
    assert least(start, 0.9 * drive2) < -1e-3
