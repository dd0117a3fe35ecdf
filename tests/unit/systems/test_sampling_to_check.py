"""`init navigate` lists assumptions that matter: half a sample, and a lever arm of zero."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from strapdown.errors import Finding
from strapdown.systems.navigation_draft import _arm, _sampling_to_check
from strapdown.tables import gnss_table, imu_table

ASSUMED = (Finding("io.sampling-taken-as-instantaneous", severity="note", quantity="sampling"),)


def made(*, speed=10.0, sd=2.0, turn_deg_per_s=0.0, sensor="consumer-grade", findings=ASSUMED):
    time = np.arange(0.0, 60.0, 0.01)
    rate = np.zeros((len(time), 3))
    rate[:, 2] = np.radians(turn_deg_per_s)
    imu = imu_table(time, rate, np.tile([0.0, 0.0, -9.81], (len(time), 1)), source="imu.csv")
    at = np.arange(0.0, 60.0)
    place = np.column_stack([48.0 + speed * at / 111.2e3, np.full(60, 11.0), np.full(60, 500.0)])
    velocity = np.tile([speed, 0.0, 0.0], (60, 1))
    sds = np.full((60, 3), sd), np.full((60, 3), 0.1)
    gnss = gnss_table(at, place, velocity, *sds)
    table = {"sensors": {"sensor": sensor}}
    return SimpleNamespace(imu=pd.DataFrame(imu), gnss=gnss, findings=findings, table=table)


def test_half_a_sample_is_asked_where_fixes_or_accelerometers_resolve_it():
    assert not _sampling_to_check(made())
    # 5 ms at 80 m/s are 0.4 m; at 20 deg/s they are 0.1 deg, 1.7 mg of gravity.
    assert _sampling_to_check(made(speed=80.0, sd=0.02))
    assert not _sampling_to_check(made(speed=80.0, sd=0.5))
    assert _sampling_to_check(made(turn_deg_per_s=20.0, sensor="hg9900"))
    assert not _sampling_to_check(made(turn_deg_per_s=20.0))
    assert not _sampling_to_check(made(speed=80.0, sd=0.02, findings=()))


def test_a_lever_arm_of_zero_is_listed_beside_fixes_that_are_finer_than_it():
    assert "0.02 m" in _arm(made(sd=0.02).gnss)
    assert not _arm(made(sd=5.0).gnss)
    assert not _arm(None)
