"""A named sensor takes the place of a scenario's own errors."""

from __future__ import annotations

import json

import pytest

from strapdown import simulate, verify
from strapdown.attitude_comparison.source import simulate_scenario
from strapdown.config import ScenarioSpec, specify
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.simulation import find_scenario, simulate_imu


def test_the_errors_are_those_of_the_unit_that_the_seed_draws():
    spec = specify(ScenarioSpec, name="alexiev-fig2e", rate_hz=50, seed=4, sensor="mpu-6050")
    imu, truth = simulate_scenario(spec)
    motion = find_scenario("alexiev-fig2e").motion
    unit = load_sensor("mpu-6050").draw(4)
    expected, exact = simulate_imu(motion, unit, rate=50.0, seed=4)
    assert imu.equals(expected)
    assert truth.equals(exact)
    # A rest of two seconds: the bias of the unit and not the scenario's.
    rest = imu[imu.index < 1.0]["gyro_x"].mean()
    assert rest == pytest.approx(unit.gyro.bias[0], abs=0.01)


@pytest.mark.parametrize("name", SENSORS)
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_every_sensor_samples_every_axis(name, sampling):
    spec = ScenarioSpec(name="alexiev-fig2c", sensor=name, sampling=sampling, rate_hz=200)
    imu, _ = simulate_scenario(spec)
    assert list(imu.columns[:1]) == ["gyro_x"]
    assert (imu.std() > 0.0).all()


def test_a_simulation_with_a_sensor_is_sealed_with_its_errors_and_runs_again(tmp_path):
    seal = simulate("alexiev-fig2c", rate_hz=50, seed=2, sensor="stim300").save(tmp_path / "s")
    told = json.loads((seal.path / "scenario.json").read_text(encoding="utf-8"))
    unit = load_sensor("stim300").draw(2)
    assert told["sensor"] == "stim300"
    assert told["gyro_errors"]["bias_rad_per_s"] == list(unit.gyro.bias)
    assert told["accel_errors"]["full_scale_m_per_s2"] == list(unit.accel.full_scale)
    assert told["gyro_errors"]["misalignment_rad"] == [list(r) for r in unit.gyro.misalignment]
    assert verify(seal.path).verdict == "identical"


def test_an_unknown_sensor_is_named_with_the_nearest(tmp_path):
    with pytest.raises(ConfigError, match="did you mean 'stim300'"):
        simulate("alexiev-fig2c", sensor="stim30").save(tmp_path / "s")
    assert not (tmp_path / "s").exists()
