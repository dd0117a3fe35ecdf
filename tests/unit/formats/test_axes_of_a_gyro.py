"""Single axes that are reversed, exchanged, in another unit or dead: named, and put right.

A hand turns a body about three axes under gravity, with the noise of a phone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded
from tests.drives.generator import draw, make
from tests.town_drive import motion

import strapdown as sd
from strapdown.config.logs import LogTable
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv, read_joined, read_log
from strapdown.formats.recording import ReadOptions
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import stated_imu
from strapdown.simulation import simulate_imu
from strapdown.systems.navigation_checks import channel_findings
from strapdown.tables import ACCEL, GYRO

DEG = np.degrees(1.0)
RATE, REST, MOVING = 100.0, 8.0, 40.0
SI = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
BARE = ["t", "gx", "gy", "gz", "ax", "ay", "az"]


def hand():
    """Stamps in s, rates in rad/s and specific force in m/s², of a hand after a rest."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, REST + MOVING, 1.0 / RATE)
    u = np.maximum(time - REST, 0.0)
    angles = [
        a * (1.0 - np.cos(w * u)) / 2.0 + b * np.sin(v * u) ** 3
        for a, w, b, v in ((70, 1.1, 25, 1.7), (50, 0.7, 20, 2.3), (120, 0.5, 30, 1.3))
    ]
    turn = Rotation.from_euler("xyz", np.column_stack(angles), degrees=True)
    step = (turn[:-1].inv() * turn[1:]).as_rotvec() * RATE
    gyro = np.vstack([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])
    force = turn.inv().apply([0.0, 0.0, -STANDARD_GRAVITY])
    force += np.where(u[:, None] > 0.0, 0.8 * np.sin(np.outer(u, [3.1, 2.2, 4.3])), 0.0)
    gyro += rng.normal(0.0, np.radians(0.05), gyro.shape)
    return time, gyro, force + rng.normal(0.0, 0.02, force.shape)


T, RATES, FORCE = hand()


def table(rates, names=SI):
    return pd.DataFrame(np.column_stack([T, rates, FORCE]), columns=names)


def codes(imu):
    return {f.code for f in imu.findings}


# A column with a minus.


def test_the_columns_that_a_reversed_axis_is_told_to_need_can_be_stated():
    reversed_ = table(RATES * [1, 1, -1])
    (said,) = (f for f in sd.read_imu(reversed_).findings if f.code == "io.gyro-axes-differ")
    assert said.data["columns"] == "gyro_z=-gyro_z_rad_s"
    right = sd.read_imu(reversed_, columns={"gyro_z": "-gyro_z_rad_s"})
    assert "io.gyro-axes-differ" not in codes(right)
    np.testing.assert_allclose(right[GYRO], RATES, atol=1e-12)
    # Stated wrongly, the remedy takes the minus back.
    (said,) = (
        f
        for f in sd.read_imu(table(RATES), columns={"gyro_x": "-gyro_x_rad_s"}).findings
        if f.code == "io.gyro-axes-differ"
    )
    assert said.data["columns"] == "gyro_x=gyro_x_rad_s"


def test_exchanged_and_reversed_axes_at_once():
    rates = RATES[:, [1, 0, 2]] * [-1, 1, 1]  # x of the table is -y, y is x
    (said,) = (f for f in sd.read_imu(table(rates)).findings if f.code == "io.gyro-axes-differ")
    columns = dict(part.split("=") for part in said.data["columns"].split(","))
    right = sd.read_imu(table(rates), columns=columns)
    np.testing.assert_allclose(right[GYRO], RATES, atol=1e-12)


@pytest.mark.parametrize(
    "columns",
    [{"gyro_z": "-4"}, {"gyro_z": "-gz"}, {"gyro": "-g", "gyro_x": "gx", "gyro_y": "gy"}],
)
def test_a_minus_before_a_number_or_a_name(tmp_path, columns):
    if "gyro" in columns:
        rates, columns = -RATES, {"gyro": "-g"}
    else:
        rates = RATES * [1, 1, -1]
    path = tmp_path / "log.csv"
    csv.write(path, {n: v.to_numpy() for n, v in table(rates, BARE).items()}, {})
    stated = {"gyro_unit": "rad/s", "accel_unit": "m/s2", "time_unit": "s"}
    imu = read_log(path, ReadOptions(columns=columns, **stated)).imu
    np.testing.assert_allclose(imu[GYRO], RATES, atol=1e-9)
    # As a configuration states it.
    log = LogTable(path=str(path), columns=columns, **stated)
    from strapdown.config.logs import AxesTable
    from strapdown.systems.alignment_source import body_record

    recording, imu, _ = body_record(log, AxesTable())
    np.testing.assert_allclose(imu[GYRO], RATES, atol=1e-9)
    read = {r.quantity: r.source for r in recording.readings}
    assert read["gyro_z"] == "-gz"


@pytest.mark.parametrize("form", ["a folder", "two files", "rows of each sensor", "last row first"])
def test_a_minus_in_whatever_way_a_log_is_put_together(tmp_path, form):
    """The sign is of the column, and counts once."""
    turned = {"gyro_z": "-gz", "accel_x": "-ax"}
    frame = table(RATES * [1, 1, -1], BARE)
    frame["ax"] *= -1.0
    units = {"gyro_unit": "rad/s", "accel_unit": "m/s2", "time_unit": "s"}
    path = tmp_path / "log.csv"
    if form == "last row first":
        frame[::-1].to_csv(path, index=False)
    elif form != "rows of each sensor":
        frame[["t", "gx", "gy", "gz"]].to_csv(tmp_path / "gyro.csv", index=False)
        frame[["t", "ax", "ay", "az"]].to_csv(tmp_path / "accel.csv", index=False)
        path = tmp_path
        if form == "a folder":
            turned = {"gyro_z": "-gyro.csv/gz", "accel_x": "-accel.csv/ax"}
    else:
        gyro, accel = frame.copy(), frame.copy()
        gyro[BARE[4:]] = accel[BARE[1:4]] = np.nan
        both = pd.concat([gyro, accel]).sort_values("t", kind="stable")
        both.to_csv(path, index=False)
    paths = [path / "gyro.csv", path / "accel.csv"] if form == "two files" else [path]
    imu = read_joined(paths, ReadOptions(columns=turned, **units)).imu
    np.testing.assert_allclose(imu[GYRO], RATES, atol=1e-9)
    np.testing.assert_allclose(imu[ACCEL], FORCE, atol=1e-9)


def test_a_column_of_that_name_is_itself():
    frame = table(RATES, [*BARE[:3], "-gz", *BARE[4:]])
    imu = sd.read_imu(frame, columns={"gyro_z": "-gz"}, units={"gyro": "rad/s"})
    np.testing.assert_allclose(imu[GYRO], RATES, atol=1e-12)


def test_an_unknown_column_behind_a_minus_is_refused():
    with pytest.raises(ConfigError, check=coded("io.no-such-column", source="gq")):
        sd.read_imu(table(RATES), columns={"gyro_z": "-gq"})


def test_a_column_of_fixes_behind_a_minus():
    time = np.arange(60.0)
    fixes = pd.DataFrame(
        {
            "time_s": time,
            "lat": 45.0 + 1e-5 * time,
            "lon": 20.0 + 0.0 * time,
            "alt_ellipsoid_m": 100.0 + 2.0 * time,
            "VN": 1.112 + 0.0 * time,
            "VE": 0.0 * time,
            "up_speed": 2.0 + 0.0 * time,
        }
    )
    read = sd.read_gnss(
        fixes, columns={"VD": "-up_speed"}, position_sd_m=1.0, velocity_sd_m_per_s=0.1
    )
    np.testing.assert_array_equal(read["VD"], -2.0)


# One axis in another unit.

MIXED = [(1, 1, DEG), (DEG, 1, 1), (1, DEG, DEG)]


def test_turning_about_the_vertical_is_no_other_unit(tmp_path):
    """A car in a town: the force beside its vertical axis is acceleration, which does not turn.

    Of this drive a yaw rate as small as in another unit explains 92 % of it, and any one unit 38 %.
    """
    made = make(draw(31317), tmp_path)
    assert "io.gyro-axis-in-other-unit" not in codes(sd.read_imu(made.log))


@pytest.mark.parametrize("names", [SI, BARE], ids=["stated", "not stated"])
@pytest.mark.parametrize("factors", MIXED)
def test_one_axis_in_another_unit_is_asked_about(factors, names):
    odd = next(k for k in range(3) if sum(f == factors[k] for f in factors) == 1)
    unit = "deg/s" if factors[odd] > 1 else "rad/s"
    expected = {"unit": unit, "name": names[1 + odd], "quantity": GYRO[odd]}
    with pytest.raises(DataError, check=coded("io.gyro-axis-in-other-unit", **expected)):
        sd.read_imu(table(RATES * factors, names))
    # Whoever states one unit for all three is warned.
    imu = sd.read_imu(table(RATES * factors, names), units={"gyro": "rad/s"})
    assert "io.gyro-axis-in-other-unit" in codes(imu)


@pytest.mark.parametrize("factors", MIXED)
def test_columns_that_state_their_own_units_are_read_in_them(factors):
    units = ["deg/s" if f > 1 else "rad/s" for f in factors]
    names = ["t", *(f"g{a} [{u}]" for a, u in zip("xyz", units, strict=True)), *BARE[4:]]
    imu = sd.read_imu(table(RATES * factors, names))
    np.testing.assert_allclose(imu[GYRO], RATES, rtol=1e-12)
    np.testing.assert_array_equal(imu[ACCEL], FORCE)
    assert "io.axes-in-units-of-their-own" in codes(imu)


@pytest.mark.parametrize(("factor", "warned"), [(DEG, True), (1.0, False), (9.0, False)])
def test_the_noise_of_one_axis_shows_another_unit_where_gravity_does_not_turn(factor, warned):
    """A car turns about its vertical alone; vibration makes the noise of one axis 9 times."""
    noise = TriadErrors(noise_density=np.radians(0.005))
    errors = ImuErrors(noise, replace(noise, noise_density=1e-3))
    imu, _ = simulate_imu(motion(), errors, rate=50.0, sampling="instantaneous", seed=1)
    log = pd.DataFrame(np.column_stack([imu.index, imu[[*GYRO, *ACCEL]]]), columns=SI)
    log["gyro_x_rad_s"] *= factor
    assert ("io.gyro-axis-noise-of-other-unit" in codes(sd.read_imu(log))) == warned


# A channel that never changes.


@pytest.mark.parametrize("name", SI[1:])
def test_a_channel_that_never_changes_is_said_by_the_reading(name):
    log = table(RATES)
    log[name] = log[name].iloc[0]
    said = [f for f in sd.read_imu(log).findings if f.code == "io.channel-constant"]
    assert [f.data["name"] for f in said] == [name]
    assert said[0].severity == "warning"
    assert "io.channel-constant" in {f.code for f in sd.compare_attitude(log).findings}


def test_a_constant_channel_of_a_motion_without_noise_is_right():
    """A car in a plane turns about its vertical alone."""
    imu, _ = simulate_imu(motion(), ImuErrors(), rate=50.0, sampling="instantaneous", seed=1)
    log = pd.DataFrame(np.column_stack([imu.index, imu[[*GYRO, *ACCEL]]]), columns=SI)
    log["gyro_x_rad_s"] = 0.0
    assert "io.channel-constant" not in codes(sd.read_imu(log))


@pytest.mark.parametrize("value", [0.0, 0.0123])
def test_a_run_refuses_a_channel_that_never_changes(value):
    noise = TriadErrors(noise_density=np.radians(0.005))
    errors = ImuErrors(noise, replace(noise, noise_density=1e-3))
    imu, _ = simulate_imu(motion(), errors, rate=50.0, sampling="instantaneous", seed=1)
    imu["gyro_z"] = value
    sensors = stated_imu(load_sensor("bmi160"), {}, {})
    with pytest.raises(DataError, check=coded("navigation.channel-lost", quantity="gyro_z")):
        channel_findings(imu, sensors, None, {})


def test_acceleration_without_gravity_levels_nothing(tmp_path, run_cli):
    """The doctor proposes an attitude, and the attitude goes on as with a gyro alone."""
    log = table(RATES)
    turned = np.linalg.norm(RATES, axis=1) > 0.01
    push = 0.8 * np.sin(np.outer(T, [3.1, 2.2, 4.3])) * turned[:, None]
    log[SI[4:]] = push + np.random.default_rng(5).normal(0.0, 0.02, push.shape)
    path = tmp_path / "log.csv"
    csv.write(path, {n: v.to_numpy() for n, v in log.items()}, {})
    done = run_cli("doctor", str(path), "--out", str(tmp_path / "d"))
    assert done.code == 0 and "strapdown attitude" in done.out
    run = sd.compare_attitude(path)
    assert "io.no-gravity" in {f.code for f in run.findings}
    # Nothing that was started by acceleration stands beside it.
    assert run.initial["method"] == "zero"
