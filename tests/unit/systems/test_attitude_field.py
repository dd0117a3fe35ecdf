"""Magnetometer and motion of the filters, from samples and files to the result."""

from __future__ import annotations

import numpy as np
import pytest
from tests.hand_motions import record

import strapdown as sd
from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.formats.writers import WRITERS
from strapdown.orientation_filters import make_filter, run_filter
from strapdown.orientation_filters.error_state import slow_velocity
from strapdown.tables import ACCEL, MAG, QUATERNION, attitude_table, imu_table

IRON = np.array([18.0, -25.0, 10.0])


@pytest.fixture(scope="module")
def turned():
    """A hand motion of 90 s, its samples with hard iron, and without."""
    made = record("fast", 3)
    # The simulation's own iron, of 0.7 uT, is at the edge of what is significant.
    own = sd.calibrate_magnetometer(made.imu[MAG].to_numpy())
    made.imu[MAG] = own.apply(made.imu[MAG].to_numpy())
    imu = made.imu.copy()
    imu[MAG] = imu[MAG] + IRON
    return made, imu


def heading_rms(attitude, q_nb):
    error = rotation.compose(attitude[QUATERNION].to_numpy(), rotation.conjugate(q_nb))
    angles = 2.0 * np.degrees(np.arctan2(np.abs(error[:, 3]), np.abs(error[:, 0])))
    return float(np.sqrt(np.mean(angles[500:] ** 2)))


def codes(result):
    return [f.code for f in result.findings]


def test_iron_is_removed_unless_it_is_left(turned):
    made, imu = turned
    clean = sd.attitude(made.imu, algorithm="error-state")
    found = sd.attitude(imu, algorithm="error-state")
    raw = sd.attitude(imu, algorithm="error-state", magnetometer="raw")
    (said,) = (f for f in found.findings if f.code == "attitude.magnetometer-calibrated")
    assert "magnetometer has hard iron of 1" in said.text("python")
    assert codes(clean) == []
    assert "attitude.magnetometer-calibrated" not in codes(raw)
    best = heading_rms(clean, made.q_nb)
    assert heading_rms(found, made.q_nb) < best + 2.0
    assert heading_rms(raw, made.q_nb) > best + 5.0
    # What the calibration leaves open widens the bound.
    assert found["heading_sd"].median() > clean["heading_sd"].median()


def test_a_calibration_of_another_log_and_a_stream_give_the_same_bits(turned):
    _, imu = turned
    known = sd.calibrate_magnetometer(imu[MAG].to_numpy())
    assert np.allclose(known.hard_iron, IRON, atol=4.0 * known.hard_iron_sd.max())
    found = sd.attitude(imu, algorithm="complementary", magnetometer=known)
    stream = sd.OrientationFilter(100.0, "complementary", magnetometer=known)
    t = np.arange(200) / 100.0
    part = imu.iloc[:200]
    again = sd.attitude(
        imu_table(t, part.iloc[:, :3].to_numpy(), part.iloc[:, 3:6].to_numpy()).assign(
            **{name: part[name].to_numpy() for name in MAG}
        ),
        algorithm="complementary",
        magnetometer=known,
    )
    rows = [
        stream.update(row[:3], row[3:6], row[6:9])
        for row in part[[*part.columns[:6], *MAG]].to_numpy()
    ]
    assert (np.array(rows) == again[QUATERNION].to_numpy()).all()
    assert len(found) == len(imu)


def test_headings_are_true_ones_with_a_place(turned):
    made, _ = turned
    magnetic = sd.attitude(made.imu, algorithm="complementary")
    true = sd.attitude(made.imu, algorithm="complementary", place=(48.2, 16.3))
    model = sd.magnetic_field(48.2, 16.3)
    turn = rotation.quaternion_from_euler([0.0, 0.0, model.declination])
    expected = rotation.compose(turn, magnetic[QUATERNION].to_numpy())
    assert rotation.rotation_angle(expected, true[QUATERNION].to_numpy()).max() < 6e-4
    assert codes(true) == ["attitude.true-north-undated"]
    with pytest.raises(ConfigError, match="4 numbers"):
        sd.attitude(made.imu, algorithm="complementary", place=(1.0, 2.0, 3.0, 4.0))
    with pytest.raises(ConfigError, match="'on' is unknown"):
        sd.attitude(made.imu, algorithm="complementary", magnetometer="on")


@pytest.mark.parametrize(
    ("kind", "least", "most"), [("hand", 0.0, 0.3), ("fast", 0.0, 0.3), ("drive", 1.2, 5.0)]
)
def test_a_vehicle_is_told_by_its_slow_velocity(kind, least, most):
    for seed in range(3):
        imu = record(kind, seed).imu
        run = run_filter(make_filter("error-state"), imu)
        assert least <= slow_velocity(imu, run) < most


def test_the_velocity_of_a_vehicle_is_taken_and_named():
    imu = record("drive", 1).imu
    found = sd.attitude(imu, algorithm="error-state")
    assert "attitude.velocity-of-motion" in codes(found)
    name = found.attrs["algorithm"]
    assert name.startswith("error-state:velocity=")
    # The name is the whole configuration, as a stream needs it.
    again = sd.attitude(imu, algorithm=name)
    assert (again[QUATERNION].to_numpy() == found[QUATERNION].to_numpy()).all()
    assert "attitude.velocity-of-motion" not in codes(again)
    stated = sd.attitude(imu, algorithm="error-state:velocity=0.5")
    assert stated.attrs["algorithm"].startswith("error-state:velocity=0.5")


@pytest.fixture(scope="module")
def logs(turned, tmp_path_factory):
    """The log with iron and its truth, a log of the same sensor turned, and one without a field."""
    made, imu = turned
    folder = tmp_path_factory.mktemp("field")
    truth = attitude_table(imu.index, made.q_nb)
    part = imu.iloc[:4000]
    WRITERS["csv"].write(folder / "log.csv", {"imu": part, "reference": truth.iloc[:4000]})
    WRITERS["csv"].write(folder / "turned.csv", {"imu": imu})
    WRITERS["csv"].write(folder / "no-field.csv", {"imu": imu.drop(columns=MAG)})
    return folder


def compare(folder, **options):
    return sd.compare_attitude(folder / "log.csv", ["quaternion"], rates_hz=[50.0], **options)


def nine(bench):
    return {p.peer: p.errors for p in bench.peers if p.aiding == "gyro+accel+mag"}


@pytest.fixture(scope="module")
def calibrated(logs):
    return compare(logs, magnetometer=logs / "turned.csv")


def test_a_comparison_takes_the_calibration_of_a_log(logs, calibrated, tmp_path):
    raw = nine(compare(logs, magnetometer="raw"))
    bench, found = calibrated, nine(calibrated)
    assert "attitude.magnetometer-calibrated" in codes(bench)
    for name, errors in found.items():
        assert errors.heading_deg < 0.5 * raw[name].heading_deg
    assert [i.role for i in bench.inputs] == ["log", "magnetometer"]
    seal = bench.save(tmp_path / "out", report=False)
    assert sd.verify(seal.path).verdict == "identical"
    with pytest.raises(DataError, match="no magnetometer"):
        compare(logs, magnetometer=logs / "no-field.csv")


def test_a_comparison_turns_headings_to_true_north(logs, calibrated):
    bench = compare(logs, magnetometer=logs / "turned.csv", lat=48.2, lon=16.3)
    assert "attitude.true-north-undated" in codes(bench)
    declination = sd.magnetic_field(48.2, 16.3).declination
    plain = nine(calibrated)
    # The truth of the simulation counts from magnetic north: the true heading is off by as much.
    for name, errors in nine(bench).items():
        assert abs(errors.heading_deg - declination) < 1.1 * plain[name].heading_deg
    with pytest.raises(ConfigError, match="a place needs"):
        compare(logs, lat=48.2)


def test_zeros_are_no_field(turned):
    """As a driver gives them before the first conversion, and for a while within."""
    made, _ = turned
    clean = sd.attitude(made.imu, algorithm="error-state")
    for rows in (slice(0, 1), slice(3000, 3020)):
        imu = made.imu.copy()
        imu.iloc[rows, imu.columns.get_indexer(MAG)] = 0.0
        for name in ("error-state", "complementary"):
            found = sd.attitude(imu, algorithm=name)
            assert np.isfinite(found[QUATERNION].to_numpy()).all()
            if name == "error-state":
                assert heading_rms(found, made.q_nb) < heading_rms(clean, made.q_nb) + 0.5
    nothing = made.imu.copy()
    nothing[MAG] = 0.0
    assert np.isfinite(sd.attitude(nothing, algorithm="error-state")[QUATERNION].to_numpy()).all()
    with pytest.raises(DataError, match="0 readings"):
        sd.calibrate_magnetometer(np.zeros((200, 3)))


def turntable(rate_deg, seconds=60.0, begin=0.0):
    """A level turn at a steady rate, with a bias, and its true headings in deg."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, seconds, 0.01)
    turn = np.where(t < begin, 0.0, np.radians(rate_deg))
    heading = np.cumsum(turn) * 0.01
    gyro = np.column_stack([0 * t, 0 * t, turn]) + np.radians([0.3, -0.5, 0.4])
    mag = np.column_stack([20 * np.cos(heading), -20 * np.sin(heading), 45.0 + 0 * t])
    imu = imu_table(
        t,
        gyro + rng.normal(0.0, np.radians(0.1), gyro.shape),
        np.array([0.0, 0.0, -9.80665]) + rng.normal(0.0, 0.03, gyro.shape),
        sampling="mean",
    )
    imu[MAG] = mag + rng.normal(0.0, 0.4, mag.shape)
    return imu, np.degrees(heading)


def off(attitude, heading):
    return np.abs((attitude["heading"].to_numpy() - heading + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize(
    ("rate", "begin"), [(2.0, 0.0), (5.0, 0.0), (0.7, 10.0), (2.0, 10.0), (5.0, 10.0)]
)
def test_a_steady_turn_is_no_rest_where_the_field_shows_it(rate, begin):
    imu, heading = turntable(rate, begin=begin)
    found = sd.attitude(imu, algorithm="error-state", magnetometer="raw")
    error = off(found, heading)[200:]
    assert error.max() < 8.0
    assert (error < 1.96 * found["heading_sd"].to_numpy()[200:]).mean() > 0.95


def test_a_turn_after_a_rest_is_none_without_a_field():
    """The bias is known to 0.1 deg/s then: 0.7 deg/s are no bias."""
    imu, heading = turntable(0.7, begin=20.0)
    found = sd.attitude(imu.drop(columns=MAG), algorithm="error-state")
    error = off(found, heading + found["heading"].iloc[0])
    assert error.max() < 5.0
    assert (error < 1.96 * found["heading_sd"].to_numpy()).mean() > 0.95


def test_a_rest_in_which_the_field_turns_gives_no_bias(tmp_path):
    imu, _ = turntable(3.0)
    WRITERS["csv"].write(tmp_path / "table.csv", {"imu": imu})
    bench = sd.compare_attitude(tmp_path / "table.csv", ["quaternion"], rates_hz=[50.0])
    assert bench.gyro_bias["rad_per_s"] is None
    assert "field turns" in bench.gyro_bias["from"]


def test_iron_shows_in_one_turn_about_the_vertical():
    imu, heading = turntable(8.0)
    imu[MAG] = imu[MAG] + IRON
    found = sd.attitude(imu, algorithm="error-state")
    assert "attitude.magnetometer-calibrated" in codes(found)
    assert off(found, heading)[500:].max() < 8.0


def test_a_filter_is_exported_as_it_was_compared(logs, tmp_path):
    from strapdown.report.attitude_export import write_export

    bench = compare(logs, magnetometer=logs / "turned.csv", lat=48.2, lon=16.3)
    name = write_export(bench, tmp_path / "a.c", "error-state")
    (ran,) = (
        p.ran for p in bench.peers if p.aiding == "gyro+accel+mag" and p.ran.name == "error-state"
    )
    assert name == ran.label
    assert "declination=5.1" in name


def test_what_is_asked_of_a_field_that_is_not_there_is_said(logs):
    bench = sd.compare_attitude(
        logs / "no-field.csv", ["quaternion"], rates_hz=[50.0], lat=48.2, lon=16.3
    )
    assert "attitude.no-field-here" in codes(bench)
    with pytest.raises(ConfigError, match="does not exist"):
        compare(logs, magnetometer="nowhere.csv")
    with pytest.raises(ConfigError, match="orientation filter"):
        sd.compare_attitude(logs / "log.csv", ["error-state"])


def test_a_calibration_of_other_axes_is_not_applied(turned):
    _, imu = turned
    other = sd.calibrate_magnetometer(imu[MAG].to_numpy()[:, [1, 2, 0]] + [30.0, 0.0, -40.0])
    found = sd.attitude(imu, algorithm="complementary", magnetometer=other)
    raw = sd.attitude(imu, algorithm="complementary", magnetometer="raw")
    assert "attitude.calibration-does-not-fit" in codes(found)
    assert (found[QUATERNION].to_numpy() == raw[QUATERNION].to_numpy()).all()


def test_a_force_in_g_is_said(turned):
    made, _ = turned
    imu = made.imu.copy()
    imu[ACCEL] = imu[ACCEL] / 9.80665
    assert "attitude.no-gravity-in-force" in codes(sd.attitude(imu, algorithm="complementary"))
    plain = sd.attitude(made.imu, algorithm="complementary")
    assert "attitude.no-gravity-in-force" not in codes(plain)


def test_a_field_without_a_force_is_refused_as_a_log_without_one(turned):
    made, _ = turned
    with pytest.raises(DataError, match="needs an accelerometer"):
        sd.attitude(made.imu.drop(columns=ACCEL), algorithm="error-state")
