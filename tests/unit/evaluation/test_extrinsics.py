"""Extrinsics of two sensors: errors within their bounds, and what a motion does not show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom
from tests.unit.evaluation.made_pairs import (
    GRADES,
    KINDS,
    pair_of_units,
    sines,
    unit_and_magnetometer,
)

import strapdown as sd
from strapdown import rotation
from strapdown.errors import DataError
from strapdown.evaluation.extrinsics import between_imus, imu_to_magnetometer
from strapdown.tables import ACCEL, GYRO, MAG, imu_table


def errors(found, truth):
    """Error by 95 % bound of each observable parameter that the truth has."""
    known = {
        "time_offset": truth.offset + truth.drift * (found.middle - truth.middle),
        "clock_drift": truth.drift,
    }
    turned = rotation.rotation_vector_from_dcm(found.rotation @ truth.rotation.T)
    for axis, arm, turn in zip("xyz", truth.arm, turned, strict=True):
        known[f"lever_arm_{axis}"] = arm
        known[f"rotation_{axis}"] = found[f"rotation_{axis}"].value - turn
        if truth.hard_iron is not None:
            known[f"hard_iron_{axis}"] = truth.hard_iron["xyz".index(axis)]
    return {
        one.name: (one.value - known[one.name]) / one.bound
        for one in found.estimates
        if one.observed and one.name in known
    }


@pytest.fixture(scope="module")
def units():
    return pair_of_units(3, "hand", "industrial")


@pytest.fixture(scope="module")
def found(units):
    return between_imus(*units[:2])


def test_two_units(units, found):
    ratios = errors(found, units[2])
    assert set(ratios) == {
        *("time_offset", "clock_drift"),
        *(f"{name}_{axis}" for name in ("rotation", "lever_arm") for axis in "xyz"),
    }
    # Eight errors: one beyond twice its 95 % bound is four sigma.
    assert max(abs(x) for x in ratios.values()) < 2.0
    assert not found.hidden
    # A hand at 2 rad/s shows the rotation to a hundredth of a degree, and an arm of 0.1 m to
    # what scale factors of 1 % leave of it.
    assert found["rotation_x"].bound < np.radians(0.02)
    assert found["lever_arm_x"].bound < 0.01
    before, after = found.residual["gyro"]
    assert after < 0.02 * before


def test_the_other_way_round_is_the_inverse(units, found):
    back = between_imus(units[1], units[0])
    turned = rotation.rotation_vector_from_dcm(back.rotation @ found.rotation)
    assert np.abs(turned).max() < found["rotation_x"].bound
    arms = [np.array([one[f"lever_arm_{axis}"].value for axis in "xyz"]) for one in (found, back)]
    assert np.abs(found.rotation @ arms[1] + arms[0]).max() < 2.0 * found["lever_arm_x"].bound
    offset = found["time_offset"].value + back["time_offset"].value
    # Each offset holds at the middle of its own span.
    apart = back.middle - (found.middle + found["time_offset"].value)
    moved = found["clock_drift"].value * apart
    assert abs(offset + moved) < 2.0 * found["time_offset"].bound


def test_a_turn_about_one_axis_leaves_the_rotation_about_it_open():
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 60.0, 0.01)
    rate = np.column_stack([np.zeros_like(t), np.zeros_like(t), sines(rng, t, 0.1, 1.0, 1.0)])
    axis = np.array([0.0, 0.6, 0.8])
    C = rotation.dcm_from_rotation_vector(np.array([-np.arcsin(0.6), 0.0, 0.0]))
    noise = 1e-3 * rng.normal(size=(2, *rate.shape))
    found = between_imus(imu_table(t, rate @ C.T + noise[0]), imu_table(t, rate + noise[1]))
    (open_,) = found.hidden["rotation"]
    assert abs(open_ @ axis) == pytest.approx(1.0, abs=0.01)
    assert not found["rotation_y"].observed
    assert found["rotation_y"].prior_share > 0.1
    assert "lever_arm_x" not in {one.name for one in found.estimates}
    assert found["time_offset"].observed


def test_along_a_single_axis_there_is_no_lever_arm():
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 60.0, 0.01)
    rate = np.zeros((t.size, 3))
    rate[:, 2] = sines(rng, t, 0.2, 1.5, 1.5)
    arm, turn = np.array([0.2, -0.1, 0.3]), np.gradient(rate[:, 2], t)
    pull = np.column_stack([sines(rng, t, 0.2, 1.5, 1.0) for _ in range(3)]) - [0.0, 0.0, 9.81]
    added = np.cross(np.outer(turn, [0.0, 0.0, 1.0]), arm)
    added += np.cross(rate, np.cross(rate, arm))
    noise = 0.01 * rng.normal(size=(2, *rate.shape))
    pair = [
        imu_table(t, rate + 0.1 * n, f + n)
        for n, f in zip(noise, (pull, pull + added), strict=True)
    ]
    found = between_imus(*pair)
    (open_,) = found.hidden["lever_arm"]
    np.testing.assert_allclose(np.abs(open_), [0.0, 0.0, 1.0], atol=0.02)
    assert not found["lever_arm_z"].observed
    for axis, value in (("x", 0.2), ("y", -0.1)):
        assert abs(found[f"lever_arm_{axis}"].value - value) < found[f"lever_arm_{axis}"].bound
    # Specific forces across the axis show the rotation that the rates leave open.
    assert found["rotation_z"].observed


def test_a_magnetometer():
    imu, mag, truth = unit_and_magnetometer(3, "hand", "industrial", apart=False)
    found = imu_to_magnetometer(imu, mag)
    ratios = errors(found, truth)
    assert len(ratios) == 7
    assert max(abs(x) for x in ratios.values()) < 2.0
    assert found["rotation_x"].bound < np.radians(0.3)
    before, after = found.residual["mag"]
    assert after < 0.1 * before


def test_what_is_refused():
    imu, mag, _ = unit_and_magnetometer(0, "hand", "phone", apart=False)
    with pytest.raises(DataError) as refused:
        imu_to_magnetometer(imu, mag.iloc[:90])
    assert refused.value.finding.code == "extrinsics.too-few-readings"
    shuffled = mag.sample(frac=1.0, random_state=1).set_axis(mag.index)
    with pytest.raises(DataError) as refused:
        imu_to_magnetometer(imu, shuffled[MAG])
    assert refused.value.finding.code == "extrinsics.field-does-not-turn"
    still = imu.copy()
    still[[*GYRO, *ACCEL]] = 0.0
    still.attrs = imu.attrs
    with pytest.raises(DataError):
        between_imus(imu, still)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["units", "magnetometer"])
def test_coverage_of_a_hundred_pairs(what):
    inside: dict[str, list[bool]] = {}
    for seed in range(17):
        for kind in KINDS:
            for grade in GRADES:
                if what == "units":
                    a, b, truth = pair_of_units(seed, kind, grade)
                    found = between_imus(a, b)
                else:
                    apart = seed % 2 == 0
                    a, b, truth = unit_and_magnetometer(seed, kind, grade, apart)
                    offset = None if apart else 0.0
                    found = imu_to_magnetometer(a, b, offset=offset, apart=apart)
                for name, ratio in errors(found, truth).items():
                    inside.setdefault(name, []).append(abs(ratio) <= 1.0)
    for name, flags in inside.items():
        # The 99 % interval of the share contains 95 %; bounds that are too wide are no error here.
        assert sum(flags) >= binom.ppf(0.005, len(flags), 0.95), (name, sum(flags), len(flags))


def test_a_log_beside_itself_and_refused_fixes(tmp_path):
    """A unit is not compared with itself; of fixes it is said what they lack, not that of a log."""
    log = tmp_path / "log.csv"
    time = np.arange(0.0, 40.0, 0.02)
    rate = np.column_stack([np.sin(1.1 * time), np.cos(0.7 * time), np.sin(0.5 * time)])
    values = np.column_stack([time, rate, rate + np.array([0.0, 0.0, 9.8])])
    names = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    np.savetxt(log, values, delimiter=",", header=names, comments="")
    with pytest.raises(DataError) as refused:
        sd.extrinsics(log, log)
    assert refused.value.finding.code == "extrinsics.same-log"
    track = tmp_path / "track.gpx"
    point = (
        '<trkpt lat="48.1" lon="11.{k}"><ele>500</ele><time>2024-05-01T10:00:0{k}Z</time></trkpt>'
    )
    points = "".join(point.format(k=k) for k in range(9))
    head = '<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">'
    track.write_text(f"{head}<trk><trkseg>{points}</trkseg></trk></gpx>")
    with pytest.raises(DataError) as refused:
        sd.extrinsics(log, track)
    assert refused.value.finding.code == "io.height-over-sea-column"
