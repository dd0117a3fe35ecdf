"""The bridge to other programs: figures by hand, and the way back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.sensors.bridge import PX4_STEP, TARGETS, for_program, target_of
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors, triad_of

DEG = math.pi / 180.0
ERRORS = ImuErrors(
    TriadErrors(
        noise_density=(1e-4, 2e-4, 3e-4),
        bias_instability=(1e-5, 2e-5, 3e-5),
        correlation_time=200.0,
        random_walk=(1e-6, 2e-6, 3e-6),
    ),
    TriadErrors(
        noise_density=1e-3, bias_instability=2e-4, correlation_time=200.0, random_walk=1e-5
    ),
)


def values(name, errors=ERRORS, dt=0.005):
    found = for_program(errors, name, dt, 3600.0)
    return {
        triad: {e.name: v for e, v in found.items() if e.triad == triad}
        for triad in ("gyro", "accel")
    }


def from_program(values, name, dt):
    """The noise that parameters of a program mean: a driving noise becomes a random walk."""
    name, target = target_of(name)
    dt = PX4_STEP if name == "PX4" else dt
    made = {"gyro": TriadErrors(), "accel": TriadErrors()}
    for entry in target.entries:
        if entry.name not in values.get(entry.triad, {}):
            continue
        given = values[entry.triad][entry.name]
        si = triad_of([(v / entry.factor / dt**entry.step) ** (1.0 / entry.power) for v in given])
        triads = ("gyro", "accel") if entry.name == "corrtime" else (entry.triad,)
        for triad in triads:
            if entry.quantity == "correlation_time":
                made[triad] = replace(made[triad], correlation_time=si[0])
            else:
                quantity = "random_walk" if entry.quantity == "drive" else entry.quantity
                made[triad] = replace(made[triad], **{quantity: si})
    return ImuErrors(made["gyro"], made["accel"])


@pytest.mark.parametrize("name", TARGETS)
def test_back_and_forth_gives_the_same_parameters(name):
    once = values(name)
    back = from_program(once, name, 0.005)
    again = values(name, back)
    for triad in once:
        assert set(once[triad]) == set(again[triad])
        for parameter, numbers in once[triad].items():
            # A power, its root, and two factors.
            np.testing.assert_allclose(again[triad][parameter], numbers, rtol=1e-14)


@pytest.mark.parametrize("name", TARGETS)
def test_every_entry_has_a_source_and_is_there_once(name):
    target = TARGETS[name]
    assert target.source
    keys = [(e.triad, e.name, e.unit) for e in target.entries]
    assert len(set(keys)) == len(keys)


def test_figures_by_hand():
    """0.3 deg/√h is 0.005 deg/s/√Hz; one deg/h is π/648000 rad/s; a mGal is 1e-5 m/s²."""
    errors = ImuErrors(
        TriadErrors(
            noise_density=0.005 * DEG,
            bias_instability=10.0 * DEG / 3600.0,
            correlation_time=7200.0,
            random_walk=6e-6,
        ),
        TriadErrors(noise_density=1e-3, bias_instability=1e-3, correlation_time=7200.0),
    )
    gins = values("kf-gins", replace(errors, gyro=replace(errors.gyro, random_walk=0.0)))
    assert gins["gyro"]["arw"] == pytest.approx((0.3,) * 3)
    assert gins["gyro"]["gbstd"] == pytest.approx((10.0,) * 3)
    assert gins["gyro"]["corrtime"] == pytest.approx((2.0,) * 3)
    assert gins["accel"]["vrw"] == pytest.approx((0.06,) * 3)
    assert gins["accel"]["abstd"] == pytest.approx((100.0,) * 3)
    sheet = for_program(errors, "data-sheet", 0.01, 3600.0)
    by_unit = {(e.triad, e.unit): v[0] for e, v in sheet.items()}
    assert by_unit["gyro", "deg/s/√Hz"] == pytest.approx(0.005)
    # 0.61736 of the standard deviation of a Gauss-Markov process is its Allan maximum.
    assert by_unit["gyro", "deg/h"] == pytest.approx(6.1736)
    assert by_unit["accel", "µg/√Hz"] == pytest.approx(1e-3 / 9.80665e-6)
    drive = math.sqrt(6e-6**2 + 2.0 * (10.0 * DEG / 3600.0) ** 2 / 7200.0)
    assert values("kalibr", errors)["gyro"]["gyroscope_random_walk"][0] == pytest.approx(drive)
    assert values("gtsam", errors)["gyro"]["biasOmegaCovariance"][0] == pytest.approx(drive**2)
    # A sample of 5 ms of white noise N has the standard deviation N √200.
    ros = values("robot_localization", errors)
    assert ros["gyro"]["angular_velocity_covariance"][0] == pytest.approx((0.005 * DEG) ** 2 * 200)
    # A step of 10 ms: the bias changes by 0.01 s times the parameter, and by K √0.01 s.
    px4 = values("PX4", errors)
    assert 0.01 * px4["gyro"]["EKF2_GYR_B_NOISE"][0] == pytest.approx(drive * 0.1)
    assert px4["gyro"]["EKF2_GYR_NOISE"][0] == pytest.approx(0.005 * DEG * 10.0)


def test_a_random_walk_is_a_slow_process_where_there_is_none():
    errors = ImuErrors(TriadErrors(random_walk=1e-6))
    gins = values("kf-gins", errors)["gyro"]
    assert gins["corrtime"] == pytest.approx((1.0,) * 3)
    sd = gins["gbstd"][0] * DEG / 3600.0
    # The bias changes by the same variance a second: K² = 2 sd²/T.
    assert 2.0 * sd**2 / 3600.0 == pytest.approx(1e-12)


def test_a_data_sheet_comes_back_from_the_catalogue():
    sensor = load_sensor("adis16470")
    sheet = for_program(sensor.imu_errors, "data-sheet", 0.01, 3600.0)
    by_unit = {(e.triad, e.unit): v[0] for e, v in sheet.items()}
    assert by_unit["gyro", "deg/s/√Hz"] == pytest.approx(0.008)
    assert by_unit["gyro", "deg/h"] == pytest.approx(8.0)
    assert by_unit["accel", "µg"] == pytest.approx(13.0)


def test_unknown_programs_are_refused():
    with pytest.raises(ConfigError) as refused:
        target_of("KF-GIN")
    assert "KF-GINS" in str(refused.value)


@pytest.mark.parametrize("program", ["kf-gins", "ob-gins"])
@pytest.mark.parametrize(("gyro", "accel", "common"), [(1800.0, 450.0, 0.5), (None, 900.0, 0.25)])
def test_one_correlation_time_keeps_the_driving_noise_of_both_triads(program, gyro, accel, common):
    slow = {} if gyro is None else {"bias_instability": 1e-5, "correlation_time": gyro}
    errors = ImuErrors(
        TriadErrors(noise_density=1e-4, **slow),
        TriadErrors(noise_density=1e-3, bias_instability=2e-4, correlation_time=accel),
    )
    told = for_program(
        errors,
        target_of(program.replace("-", "_") if "ob" in program else program)[0],
        0.01,
        3600.0,
    )
    got = {entry.name: values[0] for entry, values in told.items()}
    assert got["corrtime"] == pytest.approx(common)
    # The drive of a Gauss-Markov process is s sqrt(2 / T); 1 mGal is 1e-5 m/s².
    drive = 1e-5 * got["abstd"] * np.sqrt(2.0 / (3600.0 * common))
    assert drive == pytest.approx(2e-4 * np.sqrt(2.0 / accel))
