"""States of aids are found, and known as well as the filter says."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.aiding_sensors import (
    Compass,
    FieldSensor,
    PressureHeight,
    VelocityLog,
    WheelSpeed,
    simulate_barometer,
    simulate_body_velocity,
    simulate_heading,
    simulate_magnetometer,
    simulate_odometer,
)

from aided_drives import GYRO_BIAS, drive, estimate, gnss_of, navigator_of, run
from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.standstill import ZeroRate, ZeroVelocity
from strapdown.navigation.measurements.vehicle import BodyVelocity, NoSlip, Odometer

RUNS = 20
UNTIL = 66.0
#: Assumed pitch and yaw of the sensors in the vehicle.
PITCH, YAW = -3.0, 4.0


def consistent(errors, covariances):
    """Whether squares of errors over their covariances are those of normal errors.

    Their sum is chi-square distributed; one in a hundred would be outside of these bounds, and the
    seeds are fixed.
    """
    total = sum(e @ np.linalg.solve(P, e) for e, P in zip(errors, covariances, strict=True))
    low, high = chi2.ppf([0.005, 0.995], sum(len(e) for e in errors))
    assert low < total < high, (low, total, high)


def all_of(one):
    """Errors and covariances by block over the runs, and their first standard deviations."""
    runs = [one(seed) for seed in range(RUNS)]
    for name in runs[0]:
        consistent([r[name][0] for r in runs], [r[name][1] for r in runs])
    return {name: np.sqrt(np.diag(P)) for name, (_, P) in runs[0].items()}


def differences(navigator, state, truth):
    out = {}
    for name, value in truth.items():
        found, P = estimate(navigator, state, name)
        out[name] = (found - value, P)
    return out


def table_aids(seed):
    """Two wheels of unlike scale, a barometer in a change of weather, a compass; and GNSS."""
    rng = np.random.default_rng([seed, 7])
    motion = drive()
    left, right, misalignment, bias = rng.standard_normal(4) * [0.02, 0.02, 5.0, 90.0]
    aids = (
        Gnss(name="gnss"),
        Odometer(name="left", lever_arm=(-1.0, -0.7, 0.4), scale_sd=0.02),
        Odometer(name="right", lever_arm=(-1.0, 0.7, 0.4), scale_sd=0.02),
        Barometer(name="baro", walk=60.0),
        Heading(name="compass", misalignment_sd_deg=5.0),
    )
    weather = PressureHeight(rate=1.0, bias=bias, walk=60.0)
    quiet = PressureHeight(rate=1.0, bias=bias, walk=60.0, noise=1e-9)
    wheels = (
        WheelSpeed(2.0, 0.05, left, (-1.0, -0.7, 0.4)),
        WheelSpeed(2.0, 0.05, right, (-1.0, 0.7, 0.4)),
    )
    tables = {
        "gnss": gnss_of(motion, seed),
        "left": simulate_odometer(motion, wheels[0], seed=seed),
        "right": simulate_odometer(motion, wheels[1], seed=seed + 100),
        "baro": simulate_barometer(motion, weather, seed=seed + 200),
        "compass": simulate_heading(
            motion, Compass(1.0, misalignment_deg=misalignment), seed=seed + 300
        ),
    }
    navigator = navigator_of(aids)
    state, _ = run(navigator, motion, seed, tables, until=UNTIL)
    truth = {
        "left.scale": [left],
        "right.scale": [right],
        "compass.misalignment": [np.radians(misalignment)],
        "baro.bias": [
            simulate_barometer(motion, quiet, seed=seed + 200)["height"].loc[UNTIL - 1.0]
            - motion.trajectory(np.array([UNTIL - 1.0]))["alt"].iloc[0]
        ],
    }
    # At an epoch of the barometer, the last before the end.
    until = UNTIL - 1.0 + 0.01
    early, _ = run(navigator, motion, seed, tables, until=until)
    out = differences(navigator, state, truth)
    out["baro.bias"] = differences(navigator, early, truth)["baro.bias"]
    return out


@pytest.mark.slow
def test_scale_bias_and_misalignment_are_found():
    sd = all_of(table_aids)
    assert sd["left.scale"] < 0.003
    assert sd["baro.bias"] < 0.5
    assert sd["compass.misalignment"] < np.radians(0.5)


def magnetic(seed):
    """A magnetometer with hard iron, in a field that deviates from the stated one; and GNSS."""
    rng = np.random.default_rng([seed, 11])
    iron, motion = 20.0 * rng.standard_normal(3), drive()
    sensor = FieldSensor(hard_iron=tuple(iron), noise=1.0, deviation_sd=3.0)
    aids = (
        Gnss(name="gnss"),
        Magnetometer(name="mag", field_ned=sensor.field_ned, hard_iron_walk=0.0),
    )
    tables = {
        "gnss": gnss_of(motion, seed),
        "mag": simulate_magnetometer(motion, sensor, seed=seed + 400),
    }
    navigator = navigator_of(aids)
    state, _ = run(navigator, motion, seed, tables, until=UNTIL)
    return differences(navigator, state, {"mag.hard_iron": iron})


@pytest.mark.slow
def test_hard_iron_is_found_where_the_field_deviates():
    sd = all_of(magnetic)
    assert (sd["mag.hard_iron"] < 3.0).all()


def mountings(seed):
    """Wheels that do not slip and a Doppler log, of sensors that are turned in the vehicle.

    The simulated wheels do not slip at all. Of the log the square of the angles must be small
    beside its noise over its velocity, 0.1 deg: what a filter takes to be linear is so no further.
    """
    rng = np.random.default_rng([seed, 8])
    wrong = np.concatenate([[0.0], 2.0 * rng.standard_normal(2)])
    assumed = rotation.dcm_from_euler([0.0, PITCH, YAW])
    true = rotation.dcm_from_euler(-wrong) @ assumed
    motion = drive(angles_deg=tuple(rotation.euler_from_dcm(true)))
    aids = (
        Gnss(name="gnss"),
        NoSlip(
            name="wheels",
            pitch_deg=PITCH,
            yaw_deg=YAW,
            mounting_sd_deg=(2.0, 2.0),
            lateral_sd=1e-3,
            vertical_sd=1e-3,
            slip_deg_per_g=0.0,
            dive_deg_per_g=0.0,
            correlation_time=0.0,
        ),
    )
    navigator = navigator_of(aids)
    state, _ = run(navigator, motion, seed, {"gnss": gnss_of(motion, seed)}, until=UNTIL)
    out = differences(navigator, state, {"wheels.mounting": np.radians(wrong[1:])})
    scale = 0.01 * rng.standard_normal()
    turned = 0.7 * rng.standard_normal(3)
    log = rotation.dcm_from_euler(-turned) @ rotation.dcm_from_euler([30.0, 20.0, -60.0])
    angles = tuple(rotation.euler_from_dcm(log))
    instrument = VelocityLog(2.0, scale=scale, point=(0.3, 0.2, 1.0), angles_deg=angles)
    tables = {
        "gnss": gnss_of(drive(), seed),
        "log": simulate_body_velocity(drive(), instrument, seed=seed),
    }
    aid = BodyVelocity(
        name="log",
        lever_arm=(0.3, 0.2, 1.0),
        roll_deg=30.0,
        pitch_deg=20.0,
        yaw_deg=-60.0,
        mounting_sd_deg=(0.7, 0.7, 0.7),
        scale_sd=0.01,
    )
    navigator = navigator_of((Gnss(name="gnss"), aid))
    state, _ = run(navigator, drive(), seed, tables, until=UNTIL)
    return out | differences(
        navigator, state, {"log.mounting": np.radians(turned), "log.scale": [scale]}
    )


@pytest.mark.slow
def test_mountings_are_found():
    sd = all_of(mountings)
    assert (sd["wheels.mounting"] < np.radians(0.15)).all()
    assert sd["log.scale"] < 0.002
    # What turns about the direction of travel is hardly seen, and it is along none of the axes.
    assert sd["log.mounting"].min() < np.radians(0.4)


def resting(seed):
    """A rest of 12 s without anything else: the bias of the gyros."""
    navigator = navigator_of((ZeroVelocity(name="stop"), ZeroRate(name="still", sd_deg_per_s=1e-5)))
    state, _ = run(navigator, drive(), seed, {}, until=12.0)
    rng = np.random.default_rng([seed, 1])
    return differences(navigator, state, {"gyro_bias": GYRO_BIAS * rng.standard_normal(3)})


def test_the_bias_of_gyros_is_found_at_a_rest():
    """White noise of 1e-4 rad/s/√Hz over 12 s: 2.9e-5 rad/s, known from 50 samples a window."""
    sd = all_of(resting)
    np.testing.assert_allclose(sd["gyro_bias"], 2.9e-5, rtol=0.2)


def test_a_mounting_of_another_aid_is_used():
    wheels = NoSlip(name="wheels", mounting_sd_deg=(2.0, 2.0))
    odometer = Odometer(name="odometer", mounting_of="wheels")
    table = simulate_odometer(drive(), WheelSpeed(2.0))
    navigator = navigator_of((wheels, odometer))
    _, pieces = run(navigator, drive(), 0, {"odometer": table}, until=20.0)
    assert {one.name for one in pieces[0].seen} == {"wheels.velocity", "odometer.speed"}
    alone = navigator_of((odometer,))
    with pytest.raises(ConfigError, check=coded("estimation.no-state")):
        run(alone, drive(), 0, {"odometer": table}, until=20.0)
