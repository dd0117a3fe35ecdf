"""A turn so smooth that the sensors feel none of it: rest, or motion, by the fixes."""

import numpy as np

from strapdown.frames import geodetic_from_ned
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.navigation_checks import channel_findings
from strapdown.tables import gnss_table, imu_table

RATE, SPEED = 0.065, 7.0  # rad/s, m/s


def test_a_smooth_turn_is_no_gyro_that_reads_too_much_at_rest():
    sensors = ImuUncertainty.of_sensor(load_sensor("stim300"))
    rng = np.random.default_rng(2)
    t = np.arange(6000) / 100.0
    rates, force = np.zeros((2, t.size, 3))
    rates[:, 2], force[:, 2] = RATE, -9.81
    sd = [np.multiply(triad.axis("noise_density"), 10.0) for triad in (sensors.gyro, sensors.accel)]
    rates += sd[0] * rng.standard_normal(rates.shape)
    force += sd[1] * rng.standard_normal(force.shape)
    seconds = np.arange(0.5, 60.0)
    circle = SPEED / RATE * np.column_stack([np.sin(RATE * seconds), 1.0 - np.cos(RATE * seconds)])

    def found(way, lateral):
        imu = imu_table(t, rates, force + np.array([0.0, lateral, 0.0]))
        ned = np.column_stack([way, np.zeros(len(way))]) + rng.standard_normal((len(way), 3))
        place = geodetic_from_ned(ned, [55.0, 37.0, 150.0])
        fixes = gnss_table(seconds, place, np.zeros((len(place), 3)), (1.0,) * 3, (np.inf,) * 3)
        said = channel_findings(imu, sensors, None, {"gnss": fixes})
        return [one.data["kind"] for one in said]

    assert found(circle, SPEED * RATE) == []
    assert found(np.zeros_like(circle), 0.0) == ["implausible"]
