"""Calibration of gyros and accelerometers: exact without noise, honest about what is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.calibrated import (
    DEG,
    FACES,
    GRAVITY,
    POSES,
    between,
    by_hand,
    facing,
    in_accel_axes,
    positions,
    record,
    truth,
    unit,
)

from strapdown.errors import DataError
from strapdown.sensors.calibration import (
    CalibrationConditions,
    KnownRotation,
    SensorCalibration,
    calibrate_imu,
)
from strapdown.sensors.error_chain import compensate
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.imu import imu_of_columns

EXACT = CalibrationConditions(GRAVITY, 1e-6)


def noiseless(seed=3):
    """A unit whose noise is small beside what is to be found."""
    quiet = {"bias_instability": 0.0}
    errors = unit(seed)
    return ImuErrors(
        replace(errors.gyro, noise_density=1e-6, **quiet),
        replace(errors.accel, noise_density=1e-5, **quiet),
    )


def lying(ups, errors, seed=0):
    """A record of rests on a table in these poses, and quick turns between them."""
    draw = np.random.default_rng(seed)
    poses = [facing(up) for up in ups]
    return record(*by_hand(poses[0], between(poses), draw, rest=2.0, tremor=0.0), errors, seed)


@pytest.fixture(scope="module")
def found():
    errors = noiseless()
    one = lying(POSES, errors)
    return errors, one, calibrate_imu([one], conditions=EXACT)


def test_sixteen_poses_show_every_error(found):
    errors, one, calibration = found
    assert calibration.observed.all()
    assert calibration.remedies == ()
    assert len(calibration.rests) == len(POSES)
    # Rates at 100 Hz, straight between the stamps, of a turn of 2 s: 1e-5 of the angle; noise less.
    error = calibration.values - truth(errors, calibration, [one], 0)
    heads = np.array([n.rpartition("_")[0] for n in calibration.names])
    assert np.abs(error[np.isin(heads, ["accel_scale", "accel_misalignment"])]).max() < 2e-5
    assert np.abs(error[np.isin(heads, ["gyro_scale", "gyro_misalignment"])]).max() < 5e-4
    assert np.abs(error / calibration.sd).max() < 4.0
    left = calibration.rests[["force_error", "force_left", "turn_error", "turn_left"]].abs()
    assert left["force_left"].max() < 1e-3 * left["force_error"].max()
    assert left["turn_left"].max() < 0.02 * left["turn_error"].max()


def test_what_is_missing_is_named():
    errors = noiseless()
    # Never y up or down, and so never turned about x or z from rest to rest.
    ups = [(0, 0, 1), (1, 0, 0), (1, 0, -1), (0, 0, -1), (-1, 0, 0)]
    calibration = calibrate_imu([lying(ups, errors)], conditions=EXACT)
    missing = {n for n, o in zip(calibration.names, calibration.observed, strict=True) if not o}
    assert {"accel_bias_y", "accel_scale_y"} & missing
    assert {"gyro_scale_x", "gyro_scale_z"} <= missing
    assert not {"accel_scale_x", "accel_scale_z", "gyro_scale_y"} & missing
    assert any("y" in one and not one.startswith("turn") for one in calibration.remedies)
    assert {"turn x", "turn z"} & set(calibration.remedies)


@pytest.mark.slow
def test_a_bias_that_varies_widens_the_bounds(found):
    errors, _, steady = found
    varies = replace(errors.accel, bias_instability=5e-3, correlation_time=5.0)
    records, _, _ = positions(ImuErrors(errors.gyro, varies), 5)
    loose = calibrate_imu(records, conditions=EXACT)
    assert loose.excess["accel"] > 2e-3
    assert (loose.sd[:9] > 2.0 * steady.sd[:9]).all()


@pytest.mark.slow
def test_gravity_that_is_not_known_is_a_common_scale(found):
    _, one, exact = found
    vague = calibrate_imu([one], conditions=CalibrationConditions(GRAVITY, 0.0164))
    scale = slice(3, 6)
    assert vague.sd[scale] == pytest.approx(0.0164 / GRAVITY, rel=0.05)
    unit_ = vague.covariance / np.outer(vague.sd, vague.sd)
    assert unit_[3, 4] > 0.95
    assert vague.sd[0] == pytest.approx(exact.sd[0], rel=0.5)


def test_known_turns_are_matched_by_angle_and_refused_otherwise():
    errors = noiseless()
    draw = np.random.default_rng(1)
    moves = [np.array([0.0, 0.0, 6.3]), *between([facing((0, 0, 1)), facing((1, 0, 0))])]
    one = record(*by_hand(facing((0, 0, 1)), moves, draw, tremor=0.0), errors, 1)
    calibration = calibrate_imu([one], [KnownRotation(angle=6.3, sd=DEG)], conditions=EXACT)
    assert len(calibration.turns) == 1
    at = calibration.names.index("gyro_scale_z")
    assert calibration.observed[at]
    assert calibration.sd[at] == pytest.approx(DEG / 6.3, rel=0.1)
    with pytest.raises(DataError) as caught:
        calibrate_imu([one], [KnownRotation(angle=3.0)], conditions=EXACT)
    assert caught.value.finding.code == "calibrate.turns-differ"
    early = KnownRotation(angle=6.3, start=0.5, end=1.5)
    with pytest.raises(DataError) as caught:
        calibrate_imu([one], [early], conditions=EXACT)
    assert caught.value.finding.code == "calibrate.turn-not-found"
    with pytest.raises(DataError) as caught:
        calibrate_imu([replace(one, rests=())], conditions=EXACT)
    assert caught.value.finding.code == "calibrate.no-rest"
    assert caught.value.finding.file is None
    logs = [replace(one, rests=(), imu=one.imu.copy()) for _ in range(2)]
    for log, name in zip(logs, ("first.csv", "second.csv"), strict=True):
        log.imu.attrs["source"] = name
    with pytest.raises(DataError) as caught:
        calibrate_imu(logs, conditions=EXACT)
    assert caught.value.finding.file == "first.csv, second.csv"


@pytest.mark.slow
def test_slopes_with_temperature():
    errors = noiseless()
    one = lying((*POSES, *POSES), errors)
    time = one.imu.index.to_numpy()
    warmth = 20.0 + 15.0 * time / time[-1]
    slope = np.array([2e-4, -1e-4, 5e-5])
    warm = one.imu.copy()
    warm.attrs = dict(one.imu.attrs)
    warm[GYRO] += (warmth[:, None] - 27.5) * slope
    moved = replace(record_of(warm), temperature=(time, warmth))
    found = calibrate_imu([moved], conditions=EXACT)
    assert found.temperature == pytest.approx(27.5, abs=0.5)
    assert found.temperature_slopes[0] == pytest.approx(slope, abs=4.0 * found.sd[30:33].max())
    assert (found.sd[30:33] < 0.2 * np.abs(slope).max()).all()


def record_of(imu):
    from strapdown.sensors.calibration import CalibrationRecord
    from strapdown.sensors.rest import find_rests

    return CalibrationRecord(imu, find_rests(imu))


def test_axes_of_the_accelerometers_change_no_reading():
    errors = unit(8)
    own = in_accel_axes(errors)
    skew = np.array(own.accel.misalignment)
    assert skew == pytest.approx(skew.T, abs=1e-14)
    time = np.arange(50) / 10.0
    read = np.random.default_rng(2).normal(size=(50, 3))
    one, two = (compensate(e.accel, time, read) for e in (errors, own))
    # The same vectors in turned axes: all products agree.
    assert one @ one.T == pytest.approx(two @ two.T, abs=1e-12)
    rates = [
        compensate(e.gyro, time, read, specific_force=f) for e, f in ((errors, one), (own, two))
    ]
    assert rates[0] @ one.T == pytest.approx(rates[1] @ two.T, abs=1e-12)


def test_the_file_and_other_axes(found, tmp_path):
    _, one, calibration = found
    made = SensorCalibration.of(calibration)
    assert made.not_observed == ()
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    body = one.imu.copy()
    body.attrs = dict(one.imu.attrs)
    for triad in (GYRO, ACCEL):
        body[triad] = one.imu[triad].to_numpy() @ turn.T
    by_body = made.turned(turn).apply(body)
    by_sensor = made.apply(one.imu)
    for triad in (GYRO, ACCEL):
        expected = by_sensor[triad].to_numpy() @ turn.T
        assert by_body[triad].to_numpy() == pytest.approx(expected, abs=1e-12)
    norm = np.linalg.norm(by_sensor.loc[0.0:1.9, ACCEL].mean())
    assert norm == pytest.approx(GRAVITY, abs=2e-4)
    assert made.turned(np.eye(3)).errors == made.errors


def test_what_is_left_replaces_the_data_sheet(found):
    _, _, calibration = found
    made = SensorCalibration.of(calibration)
    sheet = ImuUncertainty(
        TriadUncertainty(bias=0.1, scale=0.01, noise_density=1e-4),
        TriadUncertainty(bias=0.2, scale=1e-9, noise_density=1e-3),
    )
    left = made.uncertainty(sheet)
    assert left.gyro.axis("bias") == made.gyro.axis("bias")
    assert left.gyro.axis("misalignment") == made.gyro.axis("misalignment")
    assert left.accel.axis("scale") == (1e-9,) * 3
    assert left.gyro.noise_density == sheet.gyro.noise_density


def test_readings_of_no_sensor_are_refused():
    errors = noiseless()
    one = lying(FACES, errors)
    wrong = one.imu.copy()
    wrong.attrs = dict(one.imu.attrs)
    wrong[ACCEL] /= 9.8
    # Half of the readings in g: no scale factor explains it.
    with pytest.raises(DataError) as caught:
        calibrate_imu([record_of(wrong)], conditions=EXACT)
    assert caught.value.finding.code == "calibrate.contradiction"


def test_a_flat_triad_of_errors():
    made = in_accel_axes(ImuErrors(TriadErrors(), None))
    assert made.accel == TriadErrors()


def test_a_log_without_samples_for_a_rate():
    imu = imu_of_columns(np.arange(200) / 50.0, np.zeros((200, 6)) - 9.8, [*GYRO, *ACCEL])
    imu[GYRO] = 0.0
    with pytest.raises(DataError) as caught:
        calibrate_imu([record_of(imu)], [KnownRotation(rate=1.0, axis=0, start=9.0, end=10.0)])
    assert caught.value.finding.code == "calibrate.empty-stretch"


def test_a_known_rate_of_the_opposite_sign_is_refused():
    """Its scale error would be -200 %; a small rate of either sign is the gyro's own error."""
    columns = np.zeros((200, 6))
    columns[:, 2], columns[:, 5] = 0.5, -9.8
    imu = imu_of_columns(np.arange(200) / 50.0, columns, [*GYRO, *ACCEL])

    def code_of(rate):
        known = KnownRotation(rate=rate, axis=2, start=0.5, end=3.5)
        try:
            calibrate_imu([record_of(imu)], [known])
        except DataError as error:
            return error.finding
        return None

    found = code_of(-0.5)
    assert found is not None and found.code == "calibrate.turn-sign"
    assert found.data["axis"] == "z"
    assert found.data["stated"] == pytest.approx(-found.data["measured"])
    for rate in (0.5, 0.2, -1.5):
        other = code_of(rate)
        assert other is None or other.code != "calibrate.turn-sign", rate
