"""A recorded drive from its raw files: aligned by its course as soon as it moves, and navigated."""

import numpy as np
import pytest

from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.mechanization import MECHANIZATIONS
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import CoarseMode, Navigation, Until
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import GapPolicy, ImuPreprocessor
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.navigation.replay import run_batch
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.tables import gnss_table, imu_table

DEG = np.pi / 180.0


@pytest.fixture(scope="module")
def tables(recordings):
    folder = recordings("car_rtk")
    imu = np.loadtxt(folder / "part1_imu_frd_si.csv", delimiter=",", comments="#")
    fixes = np.loadtxt(folder / "part1_gnss_rtk.csv", delimiter=",", comments="#")
    return (
        imu_table(imu[:, 0], imu[:, 1:4], imu[:, 4:7], source="imu.csv"),
        gnss_table(fixes[:, 0], fixes[:, 1:4], fixes[:, 4:7], (0.05,) * 3, (0.1,) * 3),
    )


def chain(**gaps):
    sensors = (gyro_bias(0.3 * DEG), accel_bias(0.15))
    model = RotationVectorModel((0.05 * DEG,) * 3, (0.01,) * 3, sensors)
    filter_ = ErrorFilter(MECHANIZATIONS["ned"](), model, COVARIANCES["ud"]())
    aids = (Gnss(name="rtk", lever_arm=(0.0, -0.05, 0.0), time_offset=-0.13, velocity_delay=0.125),)
    course = COARSE_ALIGNMENTS["gnss_course"](mounting_yaw_deg=5.35)
    until = Until(120.0, heading_sd_deg=3.0, least=5.0)
    return NavigationPipeline(
        Navigator(with_states(filter_, aids), aids),
        ImuPreprocessor(gaps=GapPolicy(**gaps)),
        (CoarseMode(way=course, until=until, window=20.0), Navigation()),
        sensors=ImuUncertainty(
            TriadUncertainty(bias=0.3 * DEG, noise_density=0.02 * DEG),
            TriadUncertainty(bias=0.15, noise_density=0.003),
        ),
    )


def test_it_is_aligned_as_soon_as_it_moves_and_navigated(tables):
    imu, fixes = tables
    record = run_batch(chain(), imu, {"rtk": fixes}, IntervalRecorder(10.0)).record
    # It stands for 37.8 s.
    coarse, navigation = record.modes
    assert 37.0 < coarse.end - coarse.begin < 45.0
    assert navigation.end == imu.index[-1]
    place = record.innovations["rtk.position"].filter(like="nu").to_numpy()
    # Fixes four times a second of a drive at 15 m/s: a decimetre of what was expected.
    assert np.sqrt((place[20:] ** 2).mean(axis=0)).max() < 0.15
    assert not any(event.kind == "outage" for event in record.events)


def test_lost_fixes_and_samples_are_told_and_survived(tables):
    imu, fixes = tables
    begin = imu.index[0]
    lost = (imu.index > begin + 100.0) & (imu.index < begin + 100.3)
    away = (fixes.index > begin + 150.0) & (fixes.index < begin + 160.0)
    part, fewer = imu[~lost], fixes[~away]
    part.attrs, fewer.attrs = dict(imu.attrs), dict(fixes.attrs)
    record = run_batch(chain(), part, {"rtk": fewer}, IntervalRecorder(10.0)).record
    kinds = [event.kind for event in record.events if event.kind != "mode"]
    assert kinds == ["gap", "outage", "recovered"]
    (outage,) = record.outages["rtk"]
    assert outage.end - outage.begin == pytest.approx(10.0, abs=0.6)
    whole = run_batch(chain(), imu, {"rtk": fixes}, IntervalRecorder(10.0)).record
    last = [r.trajectory[["lat", "lon"]].iloc[-1].to_numpy() for r in (record, whole)]
    # Metres: half a minute later nothing is left of either.
    assert np.abs(last[0] - last[1]).max() * 111e3 < 0.05
