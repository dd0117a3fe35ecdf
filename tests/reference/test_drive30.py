"""Half an hour at 100 Hz with a fix a second: as near to the truth as the same filter in C.

Data and the filter in C are those of the measuring sticks beside the recordings.
"""

from __future__ import annotations

import importlib.util
import re
import shutil

import numpy as np
import pytest
from tests.recorded import DATA, without

from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.tables import gnss_table, imu_table

SCRIPT = DATA.parent / "bench" / "drive30" / "drive30.py"
FORMS = ("joseph", "ud", "wd")
# How the script tells its scores, rounded to 0.001.
SCORE = re.compile(r"3-D position RMS (\S+) m, heading RMS (\S+) deg")
ROUNDING = 1e-3


@pytest.fixture(scope="module")
def script():
    """The script that generates the data and scores a result."""
    if not SCRIPT.exists():
        without(str(SCRIPT))
    if shutil.which("gcc") is None:
        pytest.skip("no gcc for the filter in C")
    spec = importlib.util.spec_from_file_location("drive30_script", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def navigated(data, form):
    """Trajectory of ours."""
    model = RotationVectorModel(
        (float(data["gyro_noise"]),) * 3,
        (float(data["accel_noise"]),) * 3,
        (gyro_bias(float(data["gyro_bias_sd"])), accel_bias(float(data["accel_bias_sd"]))),
    )
    aids = (Gnss(name="gnss"),)
    used = Navigator(
        with_states(ErrorFilter(NorthEastDown(), model, COVARIANCES[form]()), aids), aids
    )
    i, sd = data["init"], data["init_sd"]
    start = NavState.from_degrees(
        *i[:3], v_n=i[3:6], roll_deg=i[6], pitch_deg=i[7], heading_deg=i[8], time=data["time"][0]
    )
    nine = np.r_[[sd[0]] * 3, [sd[1]] * 3, np.radians([sd[2], sd[2], sd[3]])]
    P = np.diag(np.r_[nine, used.filter.model.stacked.sd] ** 2)
    fixes = gnss_table(
        data["fix_time"], data["fix"], np.zeros((len(data["fix"]), 3)), (1.0,) * 3, (np.inf,) * 3
    )
    imu = imu_table(data["time"], data["imu"][:, :3], data["imu"][:, 3:])
    increments = motion_increments(imu)
    state = used.tell(used.begin(start, P), "gnss", fixes)
    _, piece = used.advance(state, increments.index.to_numpy(), increments.to_numpy())
    return used.filter.mechanization.trajectory(piece.time, piece.history)


def scores(text):
    return np.array([[float(x) for x in found] for found in SCORE.findall(text)])


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3, 4, 5))]
)
def test_as_near_to_the_truth_as_the_filter_in_c(script, tmp_path, capsys, seed):
    script.generate(seed, tmp_path)
    capsys.readouterr()
    script.baseline(tmp_path)
    # Covariance at 100 Hz, at 10 Hz and at 1 Hz.
    every_sample, at_10_hz, _ = scores(capsys.readouterr().out)
    data = np.load(tmp_path / "drive30.npz")
    for form in FORMS:
        ours = navigated(data, form)
        place, heading = scores(
            script.errors(
                data,
                ours.index.to_numpy(),
                ours[["lat", "lon", "alt"]].to_numpy(),
                ours["heading"].to_numpy(),
            )
        )[0]
        assert place <= 1.01 * at_10_hz[0] + ROUNDING
        # The C filter's own covariance is of the first order in its step, which at 10 Hz moves its
        # heading by up to 1 %; ours is held against the one without that.
        assert heading <= 1.01 * every_sample[1] + ROUNDING
