"""What the engine concludes from logs of known units, and that it never concludes wrongly."""

from __future__ import annotations

import importlib
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parent))

from synthetic_logs import _smooth, make

from strapdown.errors import DataError
from strapdown.formats import read_log
from strapdown.formats.inference.conclusion import (
    Steps,
    infer_time_faults,
    infer_time_unit,
    posterior,
)
from strapdown.formats.inference.infer import Signals, infer_signals
from strapdown.formats.inference.rotation_rate import signed_permutations, turns
from strapdown.formats.recording import ReadOptions
from strapdown.tables import ACCEL, GYRO, MAG
from strapdown.units import GYRO_UNITS

# The package has a function of this name.
infer_module = importlib.import_module("strapdown.formats.inference.infer")
SEEDS = range(100)


def said(signals):
    return {i.quantity: i for i in infer_signals(signals)}


@pytest.mark.slow
def test_no_wrong_answer_in_a_hundred_logs():
    asked, silent, wrong = Counter(), Counter(), []
    for seed in SEEDS:
        signals, truth = make(seed)
        for one in infer_signals(signals):
            asked[one.quantity] += 1
            silent[one.quantity] += not one.settled
            if truth.is_wrong(one):
                wrong.append((seed, one, truth))
    print({q: f"{silent[q]} of {asked[q]} silent" for q in asked})
    assert not wrong
    # Motion that turns gravity is in half the logs, and half of those are in counts, in
    # increments, without gravity, violent, or have shuffled axes: a gyro is silent in most.
    assert silent["gyro_unit"] < 0.97 * asked["gyro_unit"]
    # Of accelerometers 10 % are in counts, 10 % without gravity, 10 % increments, and 10 % in mg,
    # which counts of 1024 a gravity come near; a violent or arm-swung log is silent, too.
    assert silent["accel_unit"] < 0.6 * asked["accel_unit"]
    # Time is nearly always told: what is not are steps of about one tick.
    assert silent["time_unit"] < 0.05 * asked["time_unit"]


# Swings whose force has the size of gravity by chance, or turns as it would with a gyro reversed.
ARMS = (40290, 40842, 41858, 50147, 50327, 50508, 51846, 52162, 52367)


@pytest.mark.parametrize("seed", ARMS)
def test_an_arm_that_swings_is_not_taken_for_gravity_that_turns(seed):
    signals, truth = make(seed)
    assert truth.motion == "swing"
    assert not [str(i) for i in infer_signals(signals) if truth.is_wrong(i)]


def test_each_flag_is_an_option_of_attitude():
    import typer.main

    from strapdown.cli.main import app

    command = typer.main.get_command(app).get_command(None, "attitude")
    options = {o for p in command.params for o in p.opts}
    flags = {i.flag for s in range(20) for i in infer_signals(make(s)[0])} - {""}
    assert "--gyro-unit" in flags
    assert flags <= options


def turning(seconds=40.0, rate=100.0, seed=3):
    """A slow tumble about all axes without noise: rates in rad/s, reaction in m/s²."""
    t = np.arange(-1, int(seconds * rate) + 1) / rate
    angles = np.column_stack(
        [0.9 * np.sin(0.7 * t), 0.6 * np.sin(0.9 * t + 1), 0.8 * np.sin(0.5 * t)]
    )
    turn = Rotation.from_euler("ZYX", angles)
    gyro = (turn[:-2].inv() * turn[2:]).as_rotvec() * rate / 2.0
    accel = turn[1:-1].inv().apply([0.0, 0.0, 9.81])
    return t[1:-1], gyro, accel


@pytest.mark.parametrize(("unit", "scale"), [("rad/s", 1.0), ("deg/s", np.pi / 180)])
@pytest.mark.parametrize("factor", [9.81, 1.0, -1.0])
def test_the_unit_of_a_gyro_is_told_by_gravity_of_either_sign(unit, scale, factor):
    t, gyro, accel = turning()
    found = said(Signals(t, gyro / scale, accel / factor))
    assert found["gyro_unit"].settled
    assert found["gyro_unit"].value == unit
    assert found["gyro_axes"].value == "x,y,z"
    # Both signs of the accelerometer turn alike.
    assert not found["accel_sign"].settled


@pytest.mark.parametrize("axes", ["-x,-y,-z", "y,x,z", "x,-y,z", "z,x,y"])
def test_axes_that_differ_are_told(axes):
    names, matrices = signed_permutations()
    t, gyro, accel = turning()
    matrix = matrices[names.index(axes)]
    found = said(Signals(t, gyro @ matrix, accel))
    assert (found["gyro_axes"].value, found["gyro_axes"].settled) == (axes, True)
    assert found["gyro_unit"].settled


def test_the_identity_of_turning_gravity_holds_exactly():
    """Of a log without noise the nine numbers are the identity, to the rule's error.

    The trapezoid of products that change by w dt each step errs by (w dt)²/12, 1e-5 here.
    """
    t, gyro, accel = turning()
    for turn in turns(t, gyro, accel / 9.81):
        best, left = turn.free()
        assert np.allclose(best, np.eye(3), atol=1e-3)
        assert left < 1e-5 * turn.gram[9, 9]


def test_a_bias_does_not_spoil_it():
    t, gyro, accel = turning()
    found = said(Signals(t, gyro + np.array([0.2, -0.3, 0.1]), accel))
    assert (found["gyro_unit"].value, found["gyro_unit"].settled) == ("rad/s", True)


@pytest.mark.parametrize("scale", [1.0, np.pi / 180])
def test_a_gyro_alone_and_a_gyro_at_rest_are_questions(scale):
    t, gyro, _ = turning()
    assert not said(Signals(t, 0.1 * gyro / scale, None))["gyro_unit"].settled
    noise = np.random.default_rng(1).normal(size=(t.size, 3))
    still = Signals(t, 1e-3 * noise / scale, [0, 0, 9.81] + 0.02 * noise)
    assert not said(still)["gyro_unit"].settled


def test_raw_counts_are_in_no_unit():
    t, gyro, accel = turning()
    # 16.4 counts a deg/s are 1.06 mrad/s each.
    counts = np.round(np.degrees(gyro) * 16.4)
    found = said(Signals(t, counts, np.round(accel / 9.81 * 4096)))
    assert not found["gyro_unit"].settled
    assert not found["accel_unit"].settled


def test_linear_acceleration_is_no_gravity_in_another_unit():
    rng = np.random.default_rng(5)
    t = np.arange(4000) * 0.01
    walk = sum(np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) for f in (0.9, 1.8, 2.7))
    for rms in (0.3, 1.0, 3.0, 9.81):
        found = said(Signals(t, rng.normal(size=(t.size, 3)), rms * walk / np.sqrt(4.5)))
        assert not (found["gravity"].settled and found["gravity"].value == "present"), rms


def test_increments_are_not_taken_for_rates():
    t, gyro, accel = turning()
    found = said(Signals(t, gyro * 0.01, accel * 0.01))
    assert found["accel_form"].value == "increment"
    assert not (found["gyro_form"].settled and found["gyro_form"].value == "rate")


@pytest.mark.parametrize(
    ("stamps", "unit"),
    [
        (np.arange(500) * 0.01, "s"),
        (np.arange(500) * 10, "ms"),
        (np.arange(500) * 10_000, "us"),
        (1_700_000_000_000_000_000 + np.arange(500) * 10_000_000, "ns"),
        (np.arange(500), None),  # 1 Hz or 1 kHz
    ],
)
def test_units_of_time(stamps, unit):
    one = infer_time_unit(stamps)
    assert one.settled == (unit is not None)
    assert unit is None or one.value == unit


def test_faults_of_time_are_counted():
    t = np.arange(200) * 0.01
    assert infer_time_faults(Steps.of(t)).value == "none"
    assert infer_time_faults(Steps.of(np.ones(50))).value == "constant stamps"
    t[50:] += 5.0
    t[100] = t[99]
    t[150] = t[140]
    assert infer_time_faults(Steps.of(t)).value == "1 repeated, 1 backwards, 1 jump"
    wrapped = (65_000 + np.arange(200) * 10) % 2**16
    assert "wrapped (a counter of 16 bits)" in infer_time_faults(Steps.of(wrapped)).value
    bursts = np.repeat(np.arange(40) * 0.05, 5) + np.tile(np.arange(5) * 1e-4, 40)
    assert infer_time_faults(Steps.of(bursts)).value == "bursts"


def test_a_posterior_is_a_probability():
    found = posterior({"a": 0.0, "b": -1.0, "c": -900.0})
    assert sum(found.values()) == pytest.approx(1.0, abs=1e-12)
    assert found["a"] / found["b"] == pytest.approx(np.e, rel=1e-3)
    assert next(iter(found)) == "a"


def write(path, t, gyro, accel, header="time,gx,gy,gz,ax,ay,az", extra=()):
    rows = np.column_stack([t, gyro, accel, *extra])
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


def test_a_log_without_units_is_read_with_those_inferred(tmp_path):
    t, gyro, accel = turning()
    path = write(tmp_path / "log.csv", 1e3 * t, np.degrees(gyro), accel / 9.80665)
    log = read_log(path)
    assert np.allclose(log.imu[GYRO], gyro, atol=1e-7)
    assert np.allclose(log.imu[ACCEL], accel, atol=1e-6)
    assert np.allclose(log.imu.index, t, atol=1e-9)
    told = [f.what for f in log.findings if f.what.startswith("inferred: ")]
    assert [w.split(" (")[0] for w in told] == [
        "inferred: deg/s",
        "inferred: g",
        "inferred: ms",
    ]
    assert all("confidence 0.9" in w for w in told)
    assert any("inferred: deg/s" in r.why for r in log.readings)


def test_what_cannot_be_inferred_is_an_error_that_tells_why(tmp_path):
    t, gyro, accel = turning()
    path = write(tmp_path / "log.csv", t, 0 * gyro + 0.01, accel[:1] + 0 * accel)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.unit-undecided"
    ):
        read_log(path)
    read_log(path, ReadOptions(gyro_unit="rad/s"))


def test_a_contradiction_stops_and_the_users_statement_goes_before(tmp_path):
    t, gyro, accel = turning()
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_g,ay_g,az_g"
    path = write(tmp_path / "log.csv", t, np.degrees(gyro), accel, header)
    with pytest.raises(DataError) as refused:
        read_log(path)
    finding = refused.value.finding
    assert finding.code == "io.questions"
    assert [
        (q.code, q.quantity, q.data["unit"], q.data["likely"]) for q in finding.data["questions"]
    ] == [
        ("io.contradicts-unit", "gyro", "rad/s", "deg/s"),
        ("io.contradicts-unit", "accel", "g", "m/s2"),
    ]
    assert finding.data["flags"] == "--gyro-unit deg/s --accel-unit m/s2"
    assert finding.data["keys"] == 'gyro_unit = "deg/s"; accel_unit = "m/s2"'
    as_inferred = read_log(path, ReadOptions(gyro_unit="deg/s", accel_unit="m/s2"))
    assert np.allclose(as_inferred.imu[GYRO], gyro, atol=1e-6)
    # The user decides: the file may be right.
    as_stated = read_log(path, ReadOptions(gyro_unit="rad/s", accel_unit="g"))
    assert np.allclose(as_stated.imu[GYRO], np.degrees(gyro), atol=1e-6)


def test_a_stated_unit_by_which_a_gyro_turns_beyond_its_full_scale_is_a_question(tmp_path):
    """About the vertical, gravity does not turn, and the sizes of rates alone are left."""
    t, _, _ = turning()
    gyro = np.outer(0.7 + 0.1 * np.cos(t), (0.0, 0.0, 1.0))
    level = np.tile([0.1, 0.2, 9.8], (t.size, 1))
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    path = write(tmp_path / "log.csv", t, np.degrees(gyro), level, header)
    with pytest.raises(DataError) as refused:
        read_log(path)
    finding = refused.value.finding
    assert (finding.code, finding.data["unit"], finding.data["likely"]) == (
        "io.rates-beyond-full-scale",
        "rad/s",
        "deg/s",
    )
    assert finding.data["flags"] == "--gyro-unit deg/s"
    for unit in ("deg/s", "rad/s"):
        assert len(read_log(path, ReadOptions(gyro_unit=unit)).imu) == t.size
    # Below it, the statement counts.
    assert len(read_log(write(path, t, 20.0 * gyro, level, header)).imu) == t.size


def driven(seed=4, seconds=60.0, rate=100.0):
    """A car on a road that tilts it by a degree, with gyros of a phone: rad/s and m/s²."""
    rng = np.random.default_rng(seed)
    t = np.arange(-1, int(seconds * rate) + 1) / rate
    tilt = _smooth(rng, t, 0.02, 0.3, 2.0)
    yaw = np.cumsum(_smooth(rng, t, 0.1, 0.02, 0.1)[:, 0]) / rate
    speed = 12.0 + _smooth(rng, t, 3.0, 0.02, 0.1)[:, 0]
    turn = Rotation.from_euler("ZYX", np.column_stack([yaw, tilt[:, 0], tilt[:, 1]]))
    gyro = (turn[:-2].inv() * turn[2:]).as_rotvec() * rate / 2.0 + rng.normal(0.0, 0.003, 3)
    v = np.column_stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw]) * speed[:, None]
    accel = turn[1:-1].inv().apply((v[2:] - v[:-2]) * rate / 2.0 + [0.0, 0.0, 9.81])
    n = (t.size - 2, 3)
    return t[1:-1], gyro + rng.normal(0.0, 1e-3, n), accel + rng.normal(0.0, 0.05, n)


def test_a_stated_unit_by_which_gravity_would_turn_where_it_stands_still_stops(tmp_path):
    """Of a drive without tilts that settle another unit, and rates below any full scale."""
    t, gyro, accel = driven()
    assert np.degrees(np.abs(gyro).max()) < 35.0
    found = said(Signals(t, np.degrees(gyro), accel, time_unit="s"))["gyro_unit"]
    assert not found.settled
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    path = write(tmp_path / "log.csv", t, np.degrees(gyro), accel, header)
    with pytest.raises(DataError) as refused:
        read_log(path)
    finding = refused.value.finding
    assert (finding.code, finding.data["unit"], finding.data["likely"]) == (
        "io.contradicts-unit",
        "rad/s",
        "deg/s",
    )
    assert finding.data["flags"] == "--gyro-unit deg/s"
    reasons = finding.data["reason"].data["evidence"]
    assert "io.evidence-gravity-stood-still" in {e.code for e in reasons}
    assert len(read_log(path, ReadOptions(gyro_unit="rad/s")).imu) == t.size
    for unit, scale in (("rad_s", 1.0), ("deg_s", np.degrees(1.0))):
        named = header.replace("rad_s", unit)
        log = read_log(write(path, t, scale * gyro, accel, named))
        assert np.allclose(log.imu[GYRO], gyro, atol=1e-8)


def excluded(t, gyro, accel):
    """Units in which gravity would have turned where it stood still."""
    found = said(Signals(t, gyro, accel, time_unit="s"))["gyro_unit"]
    return [e.data["unit"] for e in found.evidence if e.code == "io.evidence-gravity-stood-still"]


def test_a_bias_that_no_gyro_has_excludes_a_unit_at_rest():
    rng = np.random.default_rng(8)
    t = np.arange(3000) * 0.01
    accel = np.array([0.0, 0.0, 9.81]) + rng.normal(0.0, 0.05, (t.size, 3))
    noise = rng.normal(0.0, 0.06, (t.size, 3))
    assert excluded(t, noise + np.array([2.0, 2.0, 0.0]), accel) == ["rad/s"]
    # One of any axes may be about gravity, which nothing turns then; 28 deg/s may be a bias.
    assert excluded(t, noise + np.array([0.0, 2.0, 0.0]), accel) == []
    assert excluded(t, noise + np.array([0.3, 0.3, 0.25]), accel) == []


@pytest.mark.parametrize("speed", [2.0, 6.0])
def test_a_body_on_a_circle_whose_force_turns_with_it_excludes_no_unit(speed):
    """0.18 g toward the center keep the norm within 2 % and the direction in the body."""
    t = np.arange(4000) * 0.01
    rate = speed * (1.0 + 0.3 * np.sin(0.2 * t))
    gyro = np.outer(rate, (0.0, 0.0, 1.0))
    force = np.column_stack([1.8 * (rate / speed) ** 2, 0.0 * t, 9.81 + 0.0 * t])
    assert excluded(t, gyro, force) == []
    # Banked into its turns, as an airplane, it feels the force along one axis of its own.
    bank = 0.15 * np.sin(0.5 * t)
    roll = np.gradient(bank, t)
    about = np.column_stack([roll, 0.1 * np.sin(bank), 0.1 * np.cos(bank)])
    banked = np.column_stack([0.0 * t, 0.0 * t, 9.81 / np.cos(bank)])
    assert excluded(t, about, banked) == []


def test_gyros_without_an_accelerometer_are_judged_by_their_steps_and_their_full_scale(tmp_path):
    t = np.arange(3000) * 0.01
    path, header = tmp_path / "log.csv", "time_s,gx_rad_s,gy_rad_s,gz_rad_s"
    turned = np.outer(40.0 + np.cos(t), (0.0, 0.6, 0.8)) + 1e-3 * np.sin(9 * t)[:, None]
    for gyro, code in (
        (stepping(2000.0 / 32768.0, 60.0), "io.contradicts-unit"),
        (1.2 * turned, "io.rates-beyond-full-scale"),
    ):
        np.savetxt(path, np.column_stack([t, gyro]), delimiter=",", header=header, comments="")
        with pytest.raises(DataError) as refused:
            read_log(path)
        assert refused.value.finding.code == code
        assert refused.value.finding.data["flags"] == "--gyro-unit deg/s"
        assert len(read_log(path, ReadOptions(gyro_unit="rad/s")).imu) == t.size


def test_all_questions_are_asked_at_once(tmp_path):
    t, gyro, accel = turning()
    path = write(
        tmp_path / "log.csv",
        1e3 * t,
        0 * gyro + 0.01,
        accel[:1] + 0 * accel,
        "t,gx,gy,gz,ax_g,ay_g,az_g",
    )
    with pytest.raises(DataError) as refused:
        read_log(path)
    questions = [q.code for q in refused.value.finding.data["questions"]]
    assert questions[:2] == ["io.unit-undecided", "io.contradicts-unit"]


def test_gravity_says_which_axis_points_up(tmp_path):
    t, gyro, _ = turning()
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    flat = np.tile([0.1, 0.2, 9.8], (t.size, 1))
    path = write(tmp_path / "log.csv", t, 0.001 * gyro, flat, header)
    told = [f.text("cli") for f in read_log(path).findings if f.quantity == "axes"]
    assert "z points up in 100 % of the log" in told[0]
    assert "--axes x,-y,-z" in told[0]
    told = [str(f) for f in read_log(path, ReadOptions(axes="x,y,z")).findings]
    assert any("upside down" in w for w in told)
    assert not any("upside" in str(f) for f in read_log(path, ReadOptions(axes="x,-y,-z")).findings)


def test_a_gyro_that_turns_the_other_way_is_told(tmp_path):
    t, gyro, accel = turning()
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    path = write(tmp_path / "log.csv", t, -gyro, accel, header)
    assert any("rotates opposite to gravity" in f.what for f in read_log(path).findings)
    mirrored = read_log(path, ReadOptions(axes="x,y,-z")).findings
    assert not any("rotates opposite to gravity" in f.what for f in mirrored)


def test_a_magnetometer_is_read_in_body_axes(tmp_path):
    t, gyro, accel = turning()
    field = np.tile([200.0, -30.0, 400.0], (t.size, 1))
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    path = tmp_path / "log.csv"
    write(path, t, gyro, accel, header + ",mx_mG,my_mG,mz_mG", [field])
    imu = read_log(path, ReadOptions(axes="x,-y,-z")).imu
    assert np.allclose(imu[MAG], [20.0, 3.0, -40.0])
    # Without its unit 447 could be mG or counts of 1090 a gauss: a question.
    write(path, t, gyro, accel, header + ",mx,my,mz", [field])
    log = read_log(path)
    assert not set(MAG) & set(log.imu.columns)
    assert any(f.quantity == "mag" and "left out" in f.what for f in log.findings)
    write(path, t, gyro, accel, header + ",mx,my,mz", [0.1 * field])
    assert np.allclose(read_log(path).imu[MAG], [20.0, -3.0, 40.0])


@pytest.mark.parametrize("row", [(1e300, 0.01), (1e9, 0.01), (0.0, 1e300), (0.0, -np.inf)])
def test_a_stamp_or_a_value_beyond_all_sensors_does_not_break_the_inference(row):
    # One stamp far ahead asks for 1e10 windows; one value of 1e300 overflows when it is squared.
    stamp, value = row
    n = 400
    time = 0.01 * np.arange(n)
    time[-1] += stamp
    rng = np.random.default_rng(3)
    gyro, accel = 0.1 * rng.standard_normal((2, n, 3))
    accel[:, 2] -= 9.8
    accel[n // 2, 0] = value
    with np.errstate(all="raise"):
        found = {one.quantity: one for one in infer_signals(Signals(time, gyro, accel))}
    assert found["gravity"].value == "present"


def test_the_largest_rate_of_a_choice_is_of_the_set_of_which_the_evidence_speaks(tmp_path):
    # A steady rotation about a slanted axis: its rate exceeds each of its components.
    rng = np.random.default_rng(2)
    gyro = 12.0 + rng.normal(0.0, 0.3, (600, 3))
    table = np.column_stack([np.arange(600) * 0.01, gyro])
    path = tmp_path / "turntable.csv"
    np.savetxt(path, table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="")
    with pytest.raises(DataError) as refused:
        read_log(path)
    data = refused.value.finding.data
    (below,) = [f.data["largest"] for f in data["evidence"] if "largest" in f.data]
    for choice in data["choices"]:
        assert choice.data["largest"] == pytest.approx(np.linalg.norm(gyro, axis=1).max())
        assert below < choice.data["largest"]


#: Full scale over 32768, and the reciprocal of counts per deg/s, as data sheets have them.
SENSOR_STEPS = (2000.0 / 32768.0, 1.0 / 131.0, 0.00875)


def stepping(step, spread, digits=7, seed=5, count=3000):
    """Rates at rest as whole multiples of a step, with so many digits."""
    numbers = np.round(np.random.default_rng(seed).normal(0.0, spread, (count, 3)))
    return np.round(numbers * step, digits)


def unit_at_rest(gyro):
    force = np.random.default_rng(1).normal((0.0, 0.0, 9.81), 0.02, gyro.shape)
    return said(Signals(np.arange(len(gyro)) * 0.01, gyro, force, time_unit="s"))["gyro_unit"]


@pytest.mark.parametrize("step", SENSOR_STEPS)
@pytest.mark.parametrize("spread", [2.0, 60.0])
def test_the_step_of_a_common_sensor_gives_the_unit_of_a_gyro_at_rest(step, spread):
    for unit, scale in (("deg/s", 1.0), ("rad/s", np.pi / 180.0)):
        # Many values are in step by their phases, and the spread in steps is the evidence.
        found = unit_at_rest(stepping(step * scale, spread))
        assert found.value == unit
        assert found.settled
        assert "io.evidence-steps-of-sensor" in {e.code for e in found.evidence}


def test_other_steps_are_no_evidence_of_a_unit():
    draws, settled, steps = np.random.default_rng(77), 0, 0
    for k in range(200):
        # Round numbers are those of who wrote them.
        round_one = 10.0 ** -float(draws.integers(2, 5))
        own = round_one if k % 2 else 10.0 ** draws.uniform(-3.5, -1.5)
        found = unit_at_rest(stepping(own, draws.uniform(2.0, 100.0), seed=k, count=1500))
        settled += found.settled
        steps += any(e.code == "io.evidence-steps-of-sensor" for e in found.evidence)
        assert not (k % 2 and found.settled)
    # Two units of thirteen steps within half a part of a thousand, and those by phases.
    assert settled <= steps <= 6


def test_a_step_that_no_sensor_has_is_no_rate_in_that_unit():
    # 0.061 deg/s, but not to the digits of a data sheet: in rad/s it would be 3.5 deg/s.
    found = unit_at_rest(stepping(0.0613, 1.5, digits=4))
    assert found.value == "deg/s"
    assert dict(found.alternatives).get("rad/s", 0.0) < 0.01


def test_beside_an_accelerometer_in_mg_a_gyro_is_rather_in_thousandths():
    gyro = np.random.default_rng(3).normal(0.0, 2.0, (400, 3)) * 1000.0 * 10.0
    flat = np.tile([0.0, 0.0, 1.0], (400, 1)) + np.random.default_rng(4).normal(0, 0.004, (400, 3))
    time = np.arange(400) * 0.01
    in_mg = said(Signals(time, gyro, 1000.0 * flat, time_unit="s"))["gyro_unit"]
    in_g = said(Signals(time, gyro, flat, time_unit="s"))["gyro_unit"]
    share = [
        dict(((i.value, i.confidence), *i.alternatives)).get("mdeg/s", 0.0) for i in (in_mg, in_g)
    ]
    assert share[0] > 0.8
    assert share[0] > share[1] + 0.1


def of_half_an_hour(rate=100.0, seed=11):
    """Alternately at rest and tumbling, for minutes each, with a sensor's noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(-1, int(1800 * rate) + 1) / rate
    moves = np.clip(6.0 * np.sin(2 * np.pi * t / 400.0), 0.0, 1.0)
    angles = moves[:, None] * np.column_stack(
        [0.9 * np.sin(0.7 * t), 0.6 * np.sin(0.9 * t + 1), 0.8 * np.sin(0.5 * t)]
    )
    turn = Rotation.from_euler("ZYX", angles)
    gyro = (turn[:-2].inv() * turn[2:]).as_rotvec() * rate / 2.0
    accel = turn[1:-1].inv().apply([0.0, 0.0, 9.81])
    n = len(gyro)
    return (
        t[1:-1],
        gyro + rng.normal(0.0, 0.003, (n, 3)),
        accel + rng.normal(0.0, 0.05, (n, 3)),
    )


def test_parts_of_a_long_log_tell_what_all_of_it_tells(monkeypatch):
    """Rests and motion are both in the parts, and all stamps count."""
    t, gyro, accel = of_half_an_hour()
    t[50_000:] += 3.0
    signals = Signals(t, np.degrees(gyro), accel / 9.81)
    parts = said(signals)
    monkeypatch.setattr(infer_module, "LARGEST", t.size)
    whole = said(signals)
    for quantity, value in {
        "gyro_unit": "deg/s",
        "gyro_form": "rate",
        "gyro_axes": "x,y,z",
        "accel_unit": "g",
        "gravity": "present",
        "time_faults": "1 jump",
    }.items():
        assert parts[quantity].value == whole[quantity].value == value
        assert parts[quantity].settled
        assert whole[quantity].settled
    assert parts["up_axis"].value == whole["up_axis"].value == "z"
    # As often within 30° of upright, to two standard deviations of ten parts that are or are not.
    share = [i["up_axis"].evidence[0].data["percent"] for i in (parts, whole)]
    assert abs(share[0] - share[1]) < 200 * np.sqrt(0.25 / 10)


def test_few_rows_with_a_gyro_in_a_long_log_are_judged():
    """As where another sensor's rows are between, and its cells empty."""
    t, gyro, accel = turning()
    n, m = 60_000, len(t)
    rows = slice(23_000, 23_000 + m)
    stamps = np.arange(n) * 0.01
    g, f = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    g[rows], f[rows] = gyro, accel
    found = said(Signals(stamps, g, f))
    assert (found["gyro_unit"].value, found["gyro_unit"].settled) == ("rad/s", True)
    assert found["accel_unit"].value == "m/s2"


def test_an_arm_is_seen_in_the_parts_of_a_long_log():
    """Its derivative is not taken from one part to the next, at 2 kHz 200 rows a step of it."""
    rate, n = 2000.0, 200_000
    t = np.arange(n) / rate
    w = np.column_stack([5.0 * np.sin(6.0 * t), 4.0 * np.sin(7.3 * t + 1), 3.0 * np.sin(5.1 * t)])
    a = np.gradient(w, t, axis=0)
    r = np.array([0.2, -0.1, 0.5])
    force = np.cross(a, r) + np.cross(w, np.cross(w, r))
    starts = list(range(0, 60_000, 20_000))
    rows = np.concatenate([np.arange(k, k + 20_000) for k in (0, 90_000, 180_000)])
    arm = infer_module.fit_arm(1 / rate, w[rows], force[rows], starts)
    across = infer_module.fit_arm(1 / rate, w[rows], force[rows])
    assert arm.alone > infer_module.ARM_ALONE
    assert arm.alone > across.alone


def test_the_scale_of_a_gyro_by_gravity_contains_the_truth():
    """Hands and arms in any unit and any axes: 95 % intervals, none far from the truth."""
    known = {**GYRO_UNITS, None: np.radians(1.0) / 16.4}
    held, count = 0, 0
    for seed in range(250):
        signals, truth = make(seed)
        said = {i.quantity: i for i in infer_signals(signals)}.get("gyro_scale")
        usual = (truth.gravity, truth.gyro_form, truth.time_unit) == ("present", "rate", "s")
        if said is None or said.value is None or not usual:
            continue
        data, scale = said.evidence[0].data, known[truth.gyro_unit]
        assert data["low"] < 1.25 * scale and data["high"] > 0.8 * scale
        held += data["low"] < scale < data["high"]
        count += 1
    # Of so many, 95 % less two standard deviations.
    assert count > 10 and held > count * (0.95 - 2.0 * np.sqrt(0.95 * 0.05 / count))
