"""`strapdown sensors`: the catalogue, one sensor with its sources, and several compared."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import strapdown as sd
from strapdown.errors import ConfigError
from strapdown.sensors import load_sensor
from strapdown.sensors.catalogue import SENSORS

OWN = """
title = "walks"
class = "industrial"
summary = "a fitted sensor"
[sources]
log = "a log"
[gyro]
noise_density_deg_per_s_per_sqrt_hz = { value = 0.005, source = "log" }
random_walk_deg_per_h_per_sqrt_h = { value = [WALK, WALK, WALK], source = "log" }
bias_sd_deg_per_h = { value = 20.0, assumed = "its mean" }
[accel]
noise_density_ug_per_sqrt_hz = { value = 60.0, source = "log" }
bias_sd_mg = { value = 3.0, assumed = "its mean" }
"""


@pytest.fixture
def own(tmp_path):
    def write(walk: float):
        path = tmp_path / f"own-{walk:g}.toml"
        path.write_text(OWN.replace("WALK", str(walk)))
        return path

    return write


def test_the_list_has_every_sensor_with_what_is_assumed(run_cli):
    table = sd.list_sensors().set_index("name")
    assert tuple(table.index) == SENSORS
    mpu = load_sensor("mpu-6050")
    assert table.loc["mpu-6050", "figures"] == len(mpu.sources)
    assert table.loc["mpu-6050", "assumed"] == sum(bool(f.assumed) for f in mpu.sources)
    # Data sheet: 0.005 deg/s/√Hz is 0.3 deg/√h; ±20 deg/s uniform, in deg/h.
    assert table.loc["mpu-6050", "gyro noise, deg/√h"] == pytest.approx(0.3, rel=1e-12)
    assert table.loc["mpu-6050", "bias, deg/h"] == pytest.approx(72_000.0 / math.sqrt(3.0))
    assert np.isnan(table.loc["idg-500-isz-500", "bias, mg"])
    done = run_cli("sensors")
    assert done.code == 0
    assert all(name in done.out for name in SENSORS)
    rows = json.loads(run_cli("sensors", "--json").out)
    assert [row["name"] for row in rows] == list(SENSORS)


def test_one_is_shown_with_its_sources(run_cli):
    done = run_cli("sensors", "mpu-6050")
    assert done.code == 0
    assert "gyro.bias_bound_deg_per_s" in done.out
    assert "assumed: " in done.out
    shown = json.loads(run_cli("sensors", "mpu-6050", "--json").out)
    assert [f["key"] for f in shown["sources"]] == [f.key for f in load_sensor("mpu-6050").sources]


def test_several_are_compared_and_verified(run_cli, own, tmp_path):
    out, mine = tmp_path / "out", own(300.0)
    options = ["--outage", "10", "--speed", "0", "--out", out, "--json"]
    done = run_cli("sensors", "fog-1000", "idg-500-isz-500", mine, *options)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert [f["code"] for f in found["findings"]] == ["outage.sensor-without-accelerometers"]
    drift = {one["name"]: one["drift"] for one in found["sensors"]}
    assert drift["idg-500-isz-500"] is None
    assert drift["fog-1000"]["heading_sd_deg"] < drift["own-300"]["heading_sd_deg"]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Allan deviation" in page
    assert "standard deviation" in page
    assert run_cli("verify", out).code == 0


def test_a_comparison_is_the_error_models_and_the_covariance(own):
    run = sd.compare_sensors(own(0.0), own(300.0), outage_s=30.0, speed_m_per_s=0.0)
    gyro = run.deviations.query("triad == 'gyro'").set_index(["sensor", "tau"])["allan"].unstack(0)
    noise, walk = math.radians(0.005), math.radians(300.0) / 3600.0 / 60.0
    np.testing.assert_allclose(gyro["own-0"], noise / np.sqrt(gyro.index), rtol=1e-12)
    # IEEE Std 952: K² τ/3 beside N²/τ.
    both = np.sqrt(noise**2 / gyro.index + walk**2 * gyro.index / 3.0)
    np.testing.assert_allclose(gyro["own-300"], both, rtol=1e-12)
    assert run.plot("drift").svg().startswith("<svg")
    ends = run.to_pandas().set_index("name")
    # Over 30 s the walk adds K² t³/3 to the variance of the heading, beside what it adds before.
    added = np.degrees(walk * math.sqrt(30.0**3 / 3.0))
    grown = np.sqrt(np.square(ends["heading_sd_deg"]).diff().iloc[-1])
    assert grown > added


def test_refusals(run_cli, own, tmp_path):
    assert run_cli("sensors", "mpu-605").code == 4
    assert run_cli("sensors", "--out", tmp_path / "x").code == 4
    assert run_cli("sensors", "stim300", "stim300").code == 4
    assert run_cli("sensors", "stim300", "hg1700", "--outage", "-1").code == 4
    with pytest.raises(ConfigError):
        sd.compare_sensors()
    with pytest.raises(ConfigError):
        sd.compare_sensors(*SENSORS)
