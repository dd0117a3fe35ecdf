"""A data sheet, and what a person states in its place, as one uncertainty."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV, load_sensor
from strapdown.sensors.uncertainty import FREEDOM, UNIT_FACTOR, ImuUncertainty, stated_imu

DEG_H = math.radians(1.0) / 3600.0
GYRO = {"bias_sd_deg_per_h": 0.01, "noise_density_deg_per_sqrt_h": 0.002}
ACCEL = {"bias_sd_ug": 50.0, "noise_density_ug_per_sqrt_hz": 10.0}


def test_a_data_sheet_alone():
    sensor = load_sensor("fog-1000")
    assert stated_imu(sensor, {}, {}) == ImuUncertainty.of_sensor(sensor)


def test_a_unit_differs_from_its_type_by_more_than_the_sheet_and_its_noise_does_not():
    sensor = load_sensor("stim300")
    sheet = ImuUncertainty.of_sensor(sensor)
    made = stated_imu(sensor, {"scale_sd_ppm": 300.0}, {}, unit_factor=UNIT_FACTOR)
    for triad in ("gyro", "accel"):
        known, unit = getattr(sheet, triad), getattr(made, triad)
        for name in ("bias", "misalignment", "g_sensitivity", "nonlinearity_2"):
            assert unit.axis(name) == pytest.approx(UNIT_FACTOR * np.array(known.axis(name)))
        for name in ("noise_density", "full_scale", "quantization", "bandwidth"):
            assert getattr(unit, name) == getattr(known, name)
    # A figure that is stated is the unit's own.
    assert made.gyro.axis("scale") == pytest.approx([300e-6] * 3)
    assert made.accel.axis("scale") == pytest.approx(UNIT_FACTOR * np.array(sheet.accel.scale))
    assert (made.gyro_drift, made.accel_drift) == (sheet.gyro_drift, sheet.accel_drift)


def test_the_factor_of_a_unit_is_that_of_the_bound_of_students_t():
    by_bound = stats.t(FREEDOM).ppf(0.975) / stats.norm.ppf(0.975)
    assert pytest.approx(by_bound, rel=2e-3) == UNIT_FACTOR
    assert pytest.approx(stats.t(FREEDOM).std()) == UNIT_FACTOR


def test_stated_alone():
    made = stated_imu(None, GYRO, ACCEL)
    assert np.max(made.gyro.bias) == pytest.approx(0.01 * DEG_H, rel=1e-14)
    assert np.max(made.gyro.noise_density) == pytest.approx(math.radians(0.002) / 60.0, rel=1e-14)
    assert made.gyro_drift.triad == (0.0, 0.0, 0.0)
    assert made.gyro_drift.correlation_time == math.inf


def test_stated_replaces_one_number_of_the_sheet():
    sensor = load_sensor("fog-1000")
    sheet = ImuUncertainty.of_sensor(sensor)
    made = stated_imu(sensor, {"bias_sd_deg_per_h": 0.05, "correlation_time_s": 100.0}, {})
    assert np.max(made.gyro.bias) == pytest.approx(0.05 * DEG_H, rel=1e-14)
    assert made.gyro.noise_density == sheet.gyro.noise_density
    assert made.gyro_drift.correlation_time == 100.0
    assert made.gyro_drift.sd == sheet.gyro_drift.sd
    assert made.accel == sheet.accel


def test_a_drift_is_stated_in_the_words_of_a_data_sheet():
    made = stated_imu(None, {**GYRO, "bias_instability_deg_per_h": 0.003}, ACCEL)
    assert made.gyro_drift.triad[0] == pytest.approx(
        0.003 * DEG_H / ALLAN_OF_GAUSS_MARKOV, rel=1e-14
    )


@pytest.mark.parametrize(
    ("gyro", "accel", "quantity", "what"),
    [
        ({}, ACCEL, "gyro, bias_sd", "perfect sensor"),
        ({"bias_sd_deg_per_h": 0.01}, ACCEL, "gyro, noise_density", "perfect sensor"),
        (GYRO, {"bias_sd_ug": 50.0}, "accel, noise_density", "perfect sensor"),
        ({**GYRO, "bias_deg": 1.0}, ACCEL, "gyro, bias_deg", "unknown key"),
        (
            {**GYRO, "correlation_time_s": [1, 2, 3]},
            ACCEL,
            "gyro, correlation_time_s",
            "a correlation time applies",
        ),
    ],
)
def test_what_is_missing_or_unknown(gyro, accel, quantity, what):
    with pytest.raises(ConfigError, match=what) as error:
        stated_imu(None, gyro, accel)
    assert error.value.finding.quantity == quantity
    assert error.value.finding.remedy


@pytest.mark.parametrize("given", ["a", None, ["a", "b", "c"]])
def test_a_value_that_is_no_number_is_refused_with_its_key(given):
    for key in ("bias_sd_ug", "bias_instability_ug"):
        with pytest.raises(ConfigError) as error:
            stated_imu(None, GYRO, {**ACCEL, key: given})
        assert error.value.finding.code == "sensors.uncertainty-not-a-number"
        assert error.value.finding.quantity == f"accel, {key}"
        assert error.value.finding.remedy
