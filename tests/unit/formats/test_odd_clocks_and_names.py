"""Clocks, names and units of strangers' tables that were refused, or read wrongly in silence.

A body turns about three axes under gravity, and an aircraft climbs along a bend; both are written
as each program has them, and what is read is compared with what was written.
"""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded

import strapdown as sd
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned
from strapdown.sensors.imu_health import check_imu_channels
from strapdown.tables import ACCEL, GYRO

N, STEP = 3000, 0.01
T = STEP * np.arange(N)
TURN = Rotation.from_euler(
    "zyx", np.column_stack([0.7 * T, 0.5 * np.sin(0.8 * T), 0.6 * np.sin(1.3 * T)])
)
RATE = np.vstack([(TURN[:-1].inv() * TURN[1:]).as_rotvec() / STEP, np.zeros(3)])
FORCE = TURN.inv().apply([0.0, 0.0, STANDARD_GRAVITY])
DEG = np.degrees(1.0)
SI = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]


def rows(*blocks, digits=7):
    return [",".join(f"{v:.{digits}g}" for v in row) for row in np.hstack(blocks)]


BODY = rows(RATE, FORCE)


def written(tmp_path, lines, name="log.csv"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def check(imu, rate=RATE, force=FORCE, *, digits=1e-5):
    np.testing.assert_allclose(imu[GYRO], rate, atol=digits)
    np.testing.assert_allclose(imu[ACCEL], force, atol=10 * digits)
    np.testing.assert_allclose(np.diff(imu.index), STEP, atol=1e-6)


def codes(imu):
    return {f.code for f in imu.findings}


CLOCKS = ['"время, мс"', '"Время, мс"', "время (мс)", '"час, мс"', "時間 [ミリ秒]", "时间(毫秒)"]
CLOCKS += ['"aika, ms"', '"idő, ms"', '"zaman, ms"', '"시간, ms"', '"Zeit, ms"']


@pytest.mark.parametrize("name", CLOCKS)
def test_words_for_time_and_its_unit_in_other_languages(tmp_path, name):
    lines = [f"{round(1000 * t)},{body}" for t, body in zip(T, BODY, strict=True)]
    check(sd.read_imu(written(tmp_path, [",".join([name, *SI]), *lines])))


def test_a_letter_beside_a_word_of_clocks(tmp_path):
    lines = [f"{1.7e9 + t:.2f},{body}" for t, body in zip(T, BODY, strict=True)]
    imu = sd.read_imu(written(tmp_path, [",".join(["t_unix", *SI]), *lines]))
    check(imu)
    assert imu.attrs["clock"] == "unix"


def test_fractions_without_zeros(tmp_path):
    """0.98, 0.99, 0.100: thousandths of a second after the point, as a program printed them."""
    stamps = [divmod(10 * k, 1000) for k in range(N)]
    lines = [f"{s}.{ms},{body}" for (s, ms), body in zip(stamps, BODY, strict=True)]
    imu = sd.read_imu(written(tmp_path, [",".join(["time_s", *SI]), *lines]))
    check(imu)
    assert "io.fractions-without-zeros" in codes(imu)


def test_time_that_goes_back_is_not_mended_by_digits(tmp_path):
    """A log whose clock was set back has no order in which its digits put it."""
    stamps = np.where(T < 15.0, T + 20.0, T)
    lines = [f"{t:.2f},{body}" for t, body in zip(stamps, BODY, strict=True)]
    with pytest.raises(DataError, check=coded("io.time-goes-back")):
        sd.read_imu(written(tmp_path, [",".join(["time_s", *SI]), *lines]))


@pytest.mark.parametrize("near", [True, False])
def test_rows_out_of_order_are_put_in_order(tmp_path, near):
    """Exchanged neighbors, as packets arrive, and all rows shuffled."""
    order = np.arange(N)
    if near:
        order[100::97], order[101::97] = order[101::97], order[100::97].copy()
    else:
        order = np.random.default_rng(1).permutation(N)
    lines = [f"{T[k]:.2f},{BODY[k]}" for k in order]
    imu = sd.read_imu(written(tmp_path, [",".join(["time_s", *SI]), *lines]))
    check(imu)
    assert "io.rows-out-of-order" in codes(imu)


@pytest.mark.parametrize("shift", [0.0, 0.003])
def test_two_logs_below_each_other_are_not_put_in_order(tmp_path, shift):
    lines = [f"{t:.3f},{body}" for t, body in zip(T, BODY, strict=True)]
    again = [f"{t + shift:.3f},{body}" for t, body in zip(T, BODY, strict=True)]
    with pytest.raises(DataError, check=coded("io.time-goes-back")):
        sd.read_imu(written(tmp_path, [",".join(["time_s", *SI]), *lines, *again]))


DELSYS = [f"Trigno IM sensor 1: {s}.{a} 1 (IM) [{u}]" for s, u in (("ACC", "g"), ("GYRO", "°/s"))
          for a in "XYZ"]  # fmt: skip


@pytest.mark.parametrize("emg", [False, True])
def test_each_channel_of_delsys_has_its_own_clock(tmp_path, emg):
    values = rows(FORCE / STANDARD_GRAVITY, DEG * RATE)
    lines = [
        ",".join(f"{t:.4f},{v}" for v in row.split(",")) for t, row in zip(T, values, strict=True)
    ]
    head = ",".join(f"X[s],{name}" for name in DELSYS)
    if emg:  # at a rate of its own, so that its rows go on
        head = f"X[s],Trigno IM sensor 1: EMG 1 (IM) [V],{head}"
        fast = [f"{k / 1000:.4f},{np.sin(k):.5f}" for k in range(10 * N)]
        lines += [",,,,,,,,,,,"] * 9 * N
        lines = [f"{e},{line}" for e, line in zip(fast, lines, strict=True)]
    check(sd.read_imu(written(tmp_path, [head, *lines])))


@pytest.mark.parametrize("form", ["csv", "json", "snake"])
def test_rates_of_a_browser(tmp_path, form):
    """Chromium and WebKit write x, y, z; the documents of others, in which alpha is about z."""
    names = ["rotationRate.alpha", "rotationRate.beta", "rotationRate.gamma"]
    names = [n.replace("R", "_r").replace(".", "_") for n in names] if form == "snake" else names
    force = [f"accelerationIncludingGravity.{a}" for a in "xyz"]
    ms = np.round(1000 * T)[:, None]
    table = pd.DataFrame(
        np.hstack([ms, DEG * RATE, FORCE]), columns=["timestamp_ms", *names, *force]
    )
    if form == "json":
        objects = [
            {
                "timestamp_ms": int(r[0]),
                "rotationRate": dict(zip(("alpha", "beta", "gamma"), r[1:4], strict=True)),
                "accelerationIncludingGravity": dict(zip("xyz", r[4:], strict=True)),
            }
            for r in table.to_numpy().tolist()
        ]
        path = written(tmp_path, [json.dumps(objects)], "log.json")
    else:
        path = tmp_path / "log.csv"
        table.to_csv(path, index=False)
    imu = sd.read_imu(path)
    check(imu)
    (said,) = (f for f in imu.findings if f.code == "io.rates-of-browser")
    assert said.data["columns"] == f"gyro_x={names[1]},gyro_y={names[2]},gyro_z={names[0]}"
    # Where gravity turns, it decides between the two.
    older = table.rename(columns={names[0]: names[1], names[1]: names[2], names[2]: names[0]})
    assert "io.gyro-axes-differ" not in codes(imu)
    (differ,) = (f for f in sd.read_imu(older).findings if f.code == "io.gyro-axes-differ")
    assert differ.data["columns"] == said.data["columns"]


@pytest.mark.parametrize("head", ["H acc_1G:2048", '"acc_1G","2048"'])
def test_counts_of_1_g_among_the_settings_of_a_flight_controller(tmp_path, head):
    values = np.column_stack([np.arange(N), 1e6 * T, DEG * RATE, np.round(FORCE / 9.80665 * 2048)])
    names = ["loopIteration", "time (us)", *(f"gyroADC[{k}]" for k in range(3))]
    names += [f"accSmooth[{k}]" for k in range(3)]
    lines = [",".join(f"{v:.9g}" for v in row) for row in values]
    imu = sd.read_imu(written(tmp_path, [head, ",".join(names), *lines]), units={"gyro": "deg/s"})
    check(imu, digits=5e-4)


def test_milligravities_are_among_the_units_that_are_named(tmp_path):
    values = np.column_stack([1000 * T, np.round(1e4 * RATE), np.round(FORCE / 9.80665 * 1000)])
    lines = [",".join(f"{v:.0f}" for v in row) for row in values]
    path = written(tmp_path, ["time_ms,gx,gy,gz,ax,ay,az", *lines])
    imu = sd.read_imu(path, units={"gyro": "deg/s/131"})
    (left,) = (f for f in imu.findings if f.code == "io.left-out-unusable")
    assert "mg" in [c.data["unit"] for c in left.data["reason"].data["choices"]]


def test_what_fixes_leave_open_is_asked_at_once():
    fixes = pd.DataFrame(
        {"time_s": T[::100], "lat": 48.0 + T[::100] * 1e-5, "lon": 11.0, "elevation": 500.0}
    )
    with pytest.raises(DataError, check=coded("io.fixes-leave-open")) as refused:
        sd.read_gnss(fixes)
    asked = [f.code for f in refused.value.finding.data["questions"]]
    assert asked == ["io.height-level-not-stated", "io.position-sd-not-stated"]
    assert len(sd.read_gnss(fixes, datum_height_m=0.0, position_sd_m=1.0)) == len(fixes)


@pytest.mark.parametrize("marked", ["#", ""])
def test_units_above_the_names_of_an_avionics_log(tmp_path, marked):
    """Garmin G1000: units in a comment above the names; feet, knots and feet a minute."""
    k = np.arange(300)
    course, speed, up = 40.0 + 30.0 * np.sin(k / 40.0), 55.0, 3.0 * np.sin(k / 30.0)
    ahead = np.column_stack([np.cos(np.radians(course)), np.sin(np.radians(course))])
    v = np.column_stack([speed * ahead, -up])
    way = np.vstack([np.zeros(3), np.cumsum(0.5 * (v[1:] + v[:-1]), axis=0)])
    place = geodetic_from_ned(way, (48.0, 11.0, 900.0))
    lines = [
        '#airframe_info, log_version="1.00", airframe_name="Cessna 172S"',
        f"{marked}yyy-mm-dd, hh:mm:ss, degrees, degrees, ft msl, deg C, kt, fpm, deg, deg",
        "Lcl Date, Lcl Time, Latitude, Longitude, AltMSL, OAT, GndSpd, VSpd, Roll, TRK",
    ]
    for j in k:
        lines.append(
            f"2024-05-06, 09:{30 + j // 60:02d}:{j % 60:02d}, {place[j, 0]:.8f}, "
            f"{place[j, 1]:.8f}, {place[j, 2] / 0.3048:.2f}, 10.0, {speed / 0.514444444:.4f}, "
            f"{up[j] / 0.00508:.3f}, 1.0, {course[j]:.4f}"
        )
    path = written(tmp_path, lines)
    asked = {"datum_height_m": 0.0, "position_sd_m": 3.0, "velocity_sd_m_per_s": 0.5}
    fixes = sd.read_gnss(path, **asked)
    np.testing.assert_allclose(fixes[["lat", "lon"]], place[:, :2], atol=1e-7)
    np.testing.assert_allclose(fixes["alt"], place[:, 2], atol=0.01)
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]], v, atol=1e-3)


@pytest.mark.parametrize("clipped", [False, True])
def test_samples_that_are_held_are_saturated_only_where_the_sensor_was(clipped):
    rng = np.random.default_rng(2)
    rate = RATE + rng.normal(0.0, 1e-3, RATE.shape)
    if clipped:
        rate = np.clip(rate, -0.4, 0.4)
    held = rate[np.arange(N) // 4 * 4]
    imu = pd.DataFrame(
        np.hstack([held, FORCE + rng.normal(0.0, 0.02, FORCE.shape)]),
        index=pd.Index(T, name="time"),
        columns=[*GYRO, *ACCEL],
    )
    imu.attrs = {"sampling": "instantaneous", "source": "made"}
    kinds = {f.kind for f in check_imu_channels(imu).faults if f.channel in GYRO}
    assert ("saturated" in kinds) == clipped
