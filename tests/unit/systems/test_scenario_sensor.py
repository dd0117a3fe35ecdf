"""A named sensor takes the place of a scenario's own errors; a scenario from a file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from strapdown import compare_attitude, rotation, simulate, verify
from strapdown.attitude_comparison.source import simulate_scenario
from strapdown.config.sources import ScenarioSpec
from strapdown.config.spec import specify
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


PULSES = """
title = "two turns that overlap"
rate_hz = 200
sampling = "mean"

[motion]
kind = "pulses"
duration_s = 6
heading_deg = 30
x = [{ start_s = 1, duration_s = 1, rate_deg_per_s = 90 }]
y = [{ start_s = 1.5, duration_ms = 2000, turn_deg = -120 }]
z = [{ start_s = 4, duration_s = 0.2, turn_deg = 5, times = 3, every_s = 0.5 }]

[gyro]
noise_density_deg_per_s_per_sqrt_hz = [0.01, 0, 0.02]
bias_deg_per_s = [0.5, 0, -0.2]
trend_deg_per_s2 = [0, 0.1, 0]
"""


def test_scenario_of_a_file_is_what_it_says(tmp_path):
    (tmp_path / "own.toml").write_text(PULSES)
    made = simulate(tmp_path / "own.toml", seed=3)
    assert made.imu.attrs["sampling"] == "mean"
    assert len(made.imu) == 1201
    turn = rotation.quaternion_from_rotation_vector
    parts = np.radians([[45, 0, 0], [45, -30, 0], [0, -90, 0], [0, 0, 15]])
    end = rotation.quaternion_from_euler([0.0, 0.0, 30.0])
    for part in parts:
        end = rotation.compose(end, turn(part))
    last = made.truth[["q_w", "q_x", "q_y", "q_z"]].to_numpy()[-1]
    assert rotation.rotation_angle(last, end) < 1e-12
    gyro = np.degrees(made.imu.iloc[1:201, :3].to_numpy())  # at rest
    noise = np.array([0.01, 0.0, 0.02]) * np.sqrt(200)
    # Five standard deviations of a mean of 200; the trend has half of its first second.
    assert (np.abs(gyro.mean(axis=0) - [0.5, 0.05, -0.2]) <= 5 * noise / np.sqrt(200) + 3e-4).all()
    assert np.diff(gyro[:, 1]) == pytest.approx(0.1 / 200, rel=1e-6)
    assert gyro.std(axis=0)[[0, 2]] == pytest.approx(noise[[0, 2]], rel=0.3)
    assert verify(made.save(tmp_path / "out").path).verdict == "identical"


def test_scenario_of_a_file_is_compared_like_a_named_one(tmp_path):
    (tmp_path / "own.toml").write_text(PULSES)
    result = compare_attitude(tmp_path / "own.toml", ["naive", "quaternion"], trials=2)
    assert result.truth is not None
    (tmp_path / "own.toml").unlink()  # what is sealed has the scenario in it
    assert verify(result.save(tmp_path / "out", report=False).path).verdict == "identical"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("rate_deg_per_s = 90", "rate_deg_per_s = 90, turn_deg = 9", "config.rate-or-turn"),
        ("times = 3, every_s", "every_s", "config.times-and-period"),
        ("duration_s = 6", "duration_s = 5", "simulation.pulse-not-within-motion"),
        ("rate_deg_per_s = 90", "rate_deg_per_s = 90, edge_s = 0.6",
         "simulation.pulse-shorter-than-edges"),
        ("heading_deg = 30", "heading_deg = 30\narm_m = [1, 0, 0]", "simulation.arm-without-edges"),
    ],
)  # fmt: skip
def test_scenario_that_is_none_is_refused(tmp_path, old, new, code):
    (tmp_path / "own.toml").write_text(PULSES.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        simulate(tmp_path / "own.toml")
    assert code in (refused.value.finding.code, *refused.value.finding.data.get("codes", ()))
    assert refused.value.finding.file == "own.toml"
