"""Accuracy against alignment time."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from stands import SITE, ideal, rocking, still, unit

from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.readiness import READINESS, durations_of, readiness
from strapdown.alignment.two_vector import TwoVector
from strapdown.errors import ConfigError, DataError
from strapdown.tables import attitude_table


def aligning(way, sensors):
    return lambda part: way.align(part, SITE, sensors)


def test_a_curve_with_its_truth():
    imu, truth, sensors = unit(rocking(600.0), 50.0, 2)
    reference = attitude_table(imu.index.to_numpy(), truth)
    found = readiness(aligning(InertialFrame(), sensors), imu, reference=reference)
    table = found.table
    assert list(table.columns) == READINESS
    assert len(table) == 10
    assert table.index[0] == pytest.approx(6.0)
    assert table.index[-1] == pytest.approx(600.0)
    done = table[table["refused"].isna()]
    # Six seconds of rocking tell little; ten minutes do to what the bias of the gyros leaves.
    assert not table["heading_sd"].iloc[0] < 2.0
    assert done["heading_sd"].iloc[-1] < 0.1
    assert (done["heading_error"].abs() < 4.5 * done["heading_sd"]).all()
    assert (done["roll_error"].abs() < 4.5 * done["roll_sd"]).all()
    assert done["time"].to_numpy() == pytest.approx(done.index.to_numpy(), abs=0.02)
    assert found.ready(0.2) < found.ready(0.1)
    assert found.ready(1e-6) == np.inf


def test_what_is_refused_says_why():
    imu, _, sensors = unit(rocking(300.0), 50.0, 2)
    table = readiness(aligning(TwoVector(), sensors), imu, durations=[30.0, 300.0]).table
    assert {one.code for one in table["refused"]} == {"alignment.heading-lost"}
    assert {one.data["reason"].code for one in table["refused"]} == {"alignment.rate-scatters"}
    assert table["heading"].isna().all()
    assert table["roll_error"].isna().all()


def test_durations():
    imu, _ = ideal(still(300.0), 10.0)
    times = durations_of(imu, 4)
    assert times == pytest.approx([5.0, 19.57, 76.63, 300.0], rel=1e-3)
    assert np.diff(np.log(times)) == pytest.approx(np.full(3, np.log(60.0) / 3.0))
    with pytest.raises(ConfigError, match="count: a curve needs at least 2 durations, not 1"):
        durations_of(imu, 1)
    with pytest.raises(DataError, match=r"log.csv, time: the record is 4\.\d s"):
        durations_of(imu.iloc[:50])


@pytest.mark.parametrize("wrong", [[10.0, 5.0], [0.0, 5.0], [400.0], [np.nan], [], [-1.0, 3.0]])
def test_durations_that_do_not_rise_within_the_record(wrong):
    imu, _, sensors = unit(still(300.0), 20.0, 3)
    with pytest.raises(ConfigError, match="durations"):
        readiness(aligning(TwoVector(), sensors), imu, durations=wrong)


def test_a_reference_is_checked():
    imu, _, sensors = unit(still(300.0), 20.0, 3)
    with pytest.raises(DataError):
        readiness(aligning(TwoVector(), sensors), imu, reference=pd.DataFrame({"roll": [1.0]}))
