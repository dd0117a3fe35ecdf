"""Levelling against the definition: at rest ``f_b = C_bn (0, 0, -g)``."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.api.attitude import compare_attitude
from strapdown.errors import DataError
from strapdown.formats.writers import WRITERS
from strapdown.rotation import level
from strapdown.tables import imu_table

ANGLES = [(0, 0), (10, -20), (-170, 5), (90, 0), (-90, 30), (3, 89), (0, -90), (180, 0)]


def force(roll, pitch, heading=70.0, g=9.81):
    q_nb = rotation.quaternion_from_euler([roll, pitch, heading])
    return rotation.rotate(rotation.conjugate(q_nb), [0.0, 0.0, -g])


@pytest.mark.parametrize(("roll", "pitch"), ANGLES)
def test_the_attitude_comes_back(roll, pitch):
    found = level(force(roll, pitch))
    assert found[1] == pytest.approx(pitch, abs=1e-6)  # atan2 near its end loses half the digits
    if abs(pitch) < 90:
        assert found[0] == pytest.approx(roll, abs=1e-9)


def test_roll_is_in_the_half_open_range_it_names():
    assert level([0.0, 0.0, 9.8]) == (180.0, 0.0)


@pytest.mark.parametrize("size", [0.0, 1.0, 5.0, 20.0, 981.0])
def test_what_is_not_gravity_is_refused(size):
    with pytest.raises(DataError, match=r"at rest it is 9\.8"):
        level([0.0, 0.0, -size])


def tilted_log(path, roll, pitch):
    """Ten seconds at rest, then a turn."""
    time = np.arange(1200) * 0.01
    gyro = np.zeros((1200, 3))
    gyro[1000:, 2] = 0.5
    imu = imu_table(time, gyro, np.tile(force(roll, pitch), (1200, 1)))
    WRITERS["csv"].write(path, {"imu": imu})
    return path


@pytest.mark.parametrize("initial", ["auto", "level"])
def test_a_log_that_begins_at_rest_is_levelled(tmp_path, initial):
    bench = compare_attitude(tilted_log(tmp_path / "log.csv", 10, -20), initial=initial)
    assert bench.initial["roll_deg"] == pytest.approx(10, abs=1e-9)
    assert bench.initial["pitch_deg"] == pytest.approx(-20, abs=1e-9)
    assert bench.initial["heading_deg"] == pytest.approx(0, abs=1e-12)
    assert "levelled" in bench.initial["from"]


def test_upside_down_is_questioned(tmp_path):
    bench = compare_attitude(tilted_log(tmp_path / "log.csv", 178, 3))
    assert any("upside down" in f.what for f in bench.findings)
    mended = compare_attitude(tmp_path / "log.csv", accel_unit="-m/s2")
    assert abs(mended.initial["roll_deg"]) < 5
