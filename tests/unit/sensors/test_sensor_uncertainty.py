"""What is not known of a unit: from a data sheet, stated, and drawn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import (
    TriadUncertainty,
    crash_priors,
    draw_errors,
    uncertainty_of,
)

G = 9.80665
EVERYTHING = TriadUncertainty(
    noise_density=0.01,
    bias=(0.1, 0.2, 0.3),
    scale=0.02,
    misalignment=0.01,
    nonlinearity_2=0.005,
    g_sensitivity=0.002,
    vibration_rectification=1e-4,
    full_scale=(100.0, 50.0, 50.0),
    quantization=0.05,
    bandwidth=400.0,
)


def test_a_standard_deviation_stands_and_a_bound_is_a_uniform_distribution():
    low = uncertainty_of(load_sensor("lis302dlh"), "accel")
    assert low.bias[0] == pytest.approx(20.4e-3 * G)
    assert low.scale[0] == pytest.approx(0.10 / np.sqrt(3.0))
    assert low.nonlinearity_2[0] == pytest.approx(0.005 / np.sqrt(3.0))
    assert low.full_scale == pytest.approx((2 * G,) * 3)
    assert low.quantization[0] == pytest.approx(4 * G / 4096)
    assert low.bandwidth == 292.0
    high = uncertainty_of(load_sensor("mma3202-mma1213"), "accel")
    assert high.full_scale == pytest.approx((100 * G, 50 * G, 50 * G))


def test_an_override_replaces_the_data_sheet():
    gyro = uncertainty_of(load_sensor("idg-500-isz-500"), "gyro", bias=0.001, scale=(0.1, 0.2, 0.3))
    assert gyro.bias == (0.001,) * 3
    assert gyro.scale == (0.1, 0.2, 0.3)
    assert gyro.full_scale[0] == pytest.approx(np.radians(500.0))


@pytest.mark.parametrize(
    ("name", "triad", "overrides", "message"),
    [
        ("lis302dlh", "gyro", {}, "has no triad 'gyro'"),
        ("idg-500-isz-500", "accel", {}, "has no triad 'accel'"),
        ("lis302dlh", "magnet", {}, "has no triad 'magnet'"),
        ("lis302dlh", "accel", {"biass": 1.0}, "no 'biass'"),
        ("lis302dlh", "accel", {"bias": -1.0}, r"bias: -1\.0 is not a standard deviation or range"),
    ],
)
def test_what_is_not_there_is_refused(name, triad, overrides, message):
    with pytest.raises(ConfigError, match=message):
        uncertainty_of(load_sensor(name), triad, **overrides)


def test_draws_have_the_standard_deviations_and_facts_are_facts():
    units = [draw_errors(EVERYTHING, seed) for seed in range(300)]
    assert units[0] == draw_errors(EVERYTHING, 0) != units[1]
    off = ~np.eye(3, dtype=bool)
    found = {
        "bias": np.array([u.bias for u in units]) / EVERYTHING.bias,
        "scale": np.array([u.scale for u in units]) / 0.02,
        "misalignment": np.array([np.array(u.misalignment)[off] for u in units]) / 0.01,
        "g_sensitivity": np.array([u.g_sensitivity for u in units]) / 0.002,
        "nonlinearity_2": np.array([u.nonlinearity_2 for u in units]) / 0.005,
        "rectification": np.array([u.vibration_rectification for u in units]) / 1e-4,
    }
    for name, values in found.items():
        low, high = chi2.ppf([5e-7, 1 - 5e-7], values.size) / values.size
        assert low < (values**2).mean() < high, name
        # Independent: the greatest of all correlations of two columns has a bound for which a
        # chance of 1e-6 is shared among at most 36 pairs: 5.5 of 1/√300.
        columns = values.reshape(300, -1)
        between = np.corrcoef(columns.T) - np.eye(columns.shape[1])
        assert np.abs(between).max() < 5.5 / np.sqrt(300), name
    for name in ("noise_density", "full_scale", "quantization", "bandwidth"):
        assert getattr(units[5], name) == getattr(EVERYTHING, name)
    assert not np.array([u.misalignment for u in units])[:, range(3), range(3)].any()


def test_streams_are_apart_and_a_quantity_does_not_move_another():
    assert draw_errors(EVERYTHING, 3, 0).bias != draw_errors(EVERYTHING, 3, 1).bias
    alone = TriadUncertainty(bias=EVERYTHING.bias)
    assert draw_errors(alone, 3).bias == draw_errors(EVERYTHING, 3).bias


def test_a_curve_that_is_hardly_known_still_has_one_input_for_a_reading():
    wide = TriadUncertainty(nonlinearity_2=0.4, full_scale=10.0, scale=0.05)
    for seed in range(50):
        errors = draw_errors(wide, seed)
        assert (np.abs(errors.nonlinearity_2) <= 0.49 * (1 + np.array(errors.scale)) + 1e-15).all()


def test_the_stated_priors_are_those_of_the_rate():
    priors = crash_priors()
    assert priors["accel"].noise_density[0] * np.sqrt(200.0) == pytest.approx(0.4)
    assert priors["accel"].bias == (0.2,) * 3
    assert priors["accel"].scale == (0.02,) * 3
    assert priors["gyro"].bias[0] == pytest.approx(np.radians(0.3))
    with pytest.raises(ConfigError, check=coded("sensors.rate-not-positive")):
        crash_priors(0.0)
