"""The doctor finds each fault of a log, none in a sound one, and writes a clean log."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded
from tests.town_drive import motion

import strapdown as sd
from strapdown.config.logs import DoctorSpec, FixesTable, LogTable
from strapdown.errors import ConfigError, DataError
from strapdown.formats import READERS, csv, read_log
from strapdown.formats.clocks import clock_of
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.writers import table_columns
from strapdown.navigation.measurements import clock_windows
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.systems.doctor import USES
from strapdown.systems.navigation_proposal import propose
from strapdown.tables import gnss_table

RATE, REST, MOVING = 100.0, 20.0, 60.0
G = 9.81
COLUMNS = [
    "time_s",
    *(f"gyro_{a}_rad_s" for a in "xyz"),
    *(f"accel_{a}_m_s2" for a in "xyz"),
]
GYROS, ACCELS = COLUMNS[1:4], COLUMNS[4:]


@pytest.fixture(scope="module")
def sound():
    """A unit at rest for 20 s and then turned by hand for a minute, with the noise of a phone."""
    rng = np.random.default_rng(11)
    time = np.arange(0.0, REST + MOVING, 1.0 / RATE)
    u = np.maximum(time - REST, 0.0)
    # Angles begin and end their motion smoothly; their rates are those of a hand.
    angles = np.column_stack(
        [
            a * (1.0 - np.cos(w * u)) / 2.0 + b * np.sin(v * u) ** 3
            for a, w, b, v in (
                (70.0, 1.1, 25.0, 1.7),
                (50.0, 0.7, 20.0, 2.3),
                (120.0, 0.5, 30.0, 1.3),
            )
        ]
    )
    turn = Rotation.from_euler("xyz", angles, degrees=True)
    step = (turn[:-1].inv() * turn[1:]).as_rotvec() * RATE
    gyro = np.vstack([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])
    force = turn.inv().apply([0.0, 0.0, -G])
    force += np.where(u[:, None] > 0.0, 1.5 * np.sin(np.outer(u, [3.1, 2.2, 4.3])), 0.0)
    values = np.hstack(
        [
            gyro + np.radians(0.3) + rng.normal(0.0, np.radians(0.05), gyro.shape),
            force + rng.normal(0.0, 0.02, force.shape),
        ]
    )
    return pd.DataFrame(np.column_stack([time, values]), columns=COLUMNS)


def written(table, path, **stated):
    said = {"axes": "forward-right-down", "sampling": "instantaneous", **stated}
    csv.write(path, {name: table[name].to_numpy() for name in table.columns}, said)
    return path


def codes(one):
    """Codes of questions and faults, and of what a channel's fault is."""
    found = [*one.questions, *one.faults]
    reasons = [f.data["reason"] for f in found if f.code == "navigation.channel-fault"]
    return {f.code for f in (*found, *reasons)}


def without_rows(table):
    return table[(table.time_s < 40.0) | (table.time_s > 42.0)]


def in_bursts(table):
    k = np.arange(len(table))
    return table.assign(time_s=np.floor(k / 10) * 0.1 + (k % 10) * 2e-4)


def with_jitter(table):
    rng = np.random.default_rng(5)
    return table.assign(time_s=table.time_s + rng.uniform(-0.004, 0.004, len(table)))


def thinned(table):
    return table[np.random.default_rng(6).random(len(table)) > 0.02]


def stuck(table):
    out = table.copy()
    part = out.time_s.between(50.0, 55.0)
    out.loc[part, GYROS[1]] = out.loc[part, GYROS[1]].iloc[0]
    return out


def swapped(table):
    return table.rename(columns={GYROS[0]: GYROS[1], GYROS[1]: GYROS[0]})[COLUMNS]


def clipped(table):
    return table.assign(**{name: table[name].clip(-1.0, 1.0) for name in GYROS})


def free_of_gravity(table):
    rng = np.random.default_rng(7)
    push = np.sin(np.outer(np.maximum(table.time_s - REST, 0.0), [3.1, 2.2, 4.3]))
    return table.assign(
        **{a: 1.5 * push[:, k] + rng.normal(0.0, 0.02, len(table)) for k, a in enumerate(ACCELS)}
    )


def in_degrees(table):
    return table.assign(**{name: np.degrees(table[name]) for name in GYROS})


def with_rows_twice(table):
    return table.loc[np.sort(np.append(table.index, table.index[3000:3100]))]


def coarse(table):
    step = np.radians(0.5)
    return table.assign(**{name: np.round(table[name] / step) * step for name in GYROS})


def held(table):
    kept = table[GYROS].iloc[np.arange(len(table)) // 2 * 2].to_numpy()
    return table.assign(**dict(zip(GYROS, kept.T, strict=True)))


FAULTS = {
    without_rows: "io.long-gap",
    in_bursts: "sensors.stamps-in-bursts",
    with_jitter: "sensors.stamps-jitter",
    thinned: "sensors.samples-dropped",
    stuck: "sensors.stuck-beyond-noise",
    swapped: "io.gyro-axes-differ",
    clipped: "sensors.saturated-flat-top",
    free_of_gravity: "io.no-gravity",
    in_degrees: "io.contradicts-unit",
    with_rows_twice: "io.stamp-repeated",
    coarse: "sensors.quantization-coarse",
    held: "sensors.samples-held",
}


def test_a_sound_log_has_no_fault_and_is_fit_for_an_attitude(sound, tmp_path):
    (one,) = sd.doctor(written(sound, tmp_path / "sound.csv")).logs
    assert codes(one) == set()
    assert [one.answer(use) for use in USES] == ["yes", "no", one.answer("crash")]
    (rest, *_) = one.data["stationary"]
    assert (rest["from_s"], rest["to_s"]) == pytest.approx((0.0, REST), abs=0.6)
    # White noise of 0.05 deg/s at 100 Hz; the root mean square of 2000 second differences is known
    # to 2 %.
    density = np.radians(0.05) / np.sqrt(RATE)
    assert rest["gyro_density_rad_per_s_per_sqrt_hz"] == pytest.approx([density] * 3, rel=0.1)
    assert one.data["gravity"]["included"]
    assert one.data["gravity"]["at_rest_m_per_s2"] == pytest.approx(G, abs=0.005)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_each_fault_is_found_and_no_other(fault, sound, tmp_path):
    (one,) = sd.doctor(written(fault(sound), tmp_path / "log.csv")).logs
    # The doubled rows of a held gyro hide nothing else; a stuck channel is only stuck.
    assert codes(one) - {"navigation.channel-fault", "io.rate-at-full-scale"} == {FAULTS[fault]}


def test_a_log_too_short_for_an_impact_has_the_reason(sound, tmp_path):
    """It was said to have no specific force."""
    one = sd.doctor([written(sound.iloc[:64], tmp_path / "log.csv")]).logs[0]
    (said,) = [f for f in one.fit["crash"] if f.severity == "error"]
    assert said.code == "doctor.too-short-for-impact"
    assert said.data["duration"] == pytest.approx(0.63, abs=0.01) and said.data["needed"] > 0.63


def test_open_questions_have_answers_and_do_not_hide_what_is_in_the_log(sound, tmp_path):
    path = written(in_degrees(sound), tmp_path / "log.csv")
    (one,) = sd.doctor(path).logs
    assert one.answers == {"gyro_unit": "deg/s"}
    assert one.answer("attitude") == "with limits"
    np.testing.assert_allclose(one.streams["imu"].to_numpy(), sound[COLUMNS[1:]], rtol=1e-12)
    (told,) = sd.doctor(path, units={"gyro": "deg/s"}).logs
    assert codes(told) == set()
    with pytest.raises(DataError) as error:
        sd.doctor(path, fix=tmp_path / "clean.csv")
    assert error.value.finding.code == "io.questions"
    assert not (tmp_path / "clean.csv").exists()


def test_a_log_without_a_clock_has_its_question_and_no_answer(sound, tmp_path):
    path = tmp_path / "log.csv"
    sound[COLUMNS[1:]].to_csv(path, index=False)
    (one,) = sd.doctor(path).logs
    assert (one.answer("attitude"), one.answers) == ("no", {})
    assert dict(one.refused.data["answers"]) == {"rate": "HZ"}
    with pytest.raises(DataError, check=coded("io.questions")):
        sd.doctor(path, fix=tmp_path / "clean.csv")


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_clean_log_is_the_same_recording_without_a_question(sound, tmp_path, suffix):
    table = with_rows_twice(in_degrees(sound))
    path = written(table, tmp_path / "log.csv", axes="unknown")
    clean = tmp_path / f"clean.{suffix}"
    how = {"units": {"gyro": "deg/s"}, "axes": "x,-y,-z"}
    sd.doctor(path, fix=clean, **how)
    before = sd.read_imu(path, repair=True, **how)
    after = read_log(clean).imu
    assert np.array_equal(after.to_numpy(), before.to_numpy())
    assert np.array_equal(after.index, before.index)
    record = json.loads((tmp_path / "clean.json").read_text())
    assert [file["name"] for file in record["source"]] == ["log.csv"]
    assert "io.stamp-repeated" in {f["code"] for f in record["findings"]}
    (again,) = sd.doctor(clean).logs
    assert again.questions == ()
    with pytest.raises(ConfigError) as error:
        sd.doctor(path, fix=clean, **how)
    assert error.value.finding.code == "cli.file-exists"


def test_units_that_a_person_decided_are_not_asked_again(sound, tmp_path):
    # The numbers say rad/s; whoever states deg/s is believed, also by the clean log.
    path = written(
        sound.rename(columns={g: g.removesuffix("_rad_s") for g in GYROS}), tmp_path / "log.csv"
    )
    clean = tmp_path / "clean.parquet"
    sd.doctor(path, units={"gyro": "deg/s"}, fix=clean)
    before = sd.read_imu(path, units={"gyro": "deg/s"})
    assert np.array_equal(read_log(clean).imu.to_numpy(), before.to_numpy())


def test_a_clock_of_1970_survives_to_the_last_bit(sound, tmp_path):
    stamps = 1_600_000_000_000 + np.round(1e3 * sound.time_s).astype(np.int64)
    table = sound.drop(columns="time_s").assign(unix_time_ms=stamps)
    path = written(table, tmp_path / "log.csv")
    for clean in (tmp_path / "clean.csv", tmp_path / "clean.parquet"):
        sd.doctor(path, fix=clean, force=True)
        before, after = read_log(path).imu, read_log(clean).imu
        assert np.array_equal(before.index, after.index)
        assert clock_of(after) == clock_of(before)
        assert clock_of(after).origin == pytest.approx(1.6e9)


@pytest.fixture(scope="module")
def drive():
    """A drive through a town, and fixes of it."""
    errors = ImuErrors(
        TriadErrors(noise_density=np.radians(0.005)), TriadErrors(noise_density=1e-3)
    )
    imu, _ = simulate_imu(motion(), errors, rate=50.0, seed=3)
    receiver = GnssReceiver(rate=5.0, position_noise=1.0, velocity_noise=0.1)
    return imu, simulate_gnss(motion(), receiver, seed=5)


def test_the_offset_of_the_receivers_clock_is_found(drive, tmp_path, monkeypatch):
    imu, gnss = drive
    searches = []
    search = clock_windows.time_offset
    monkeypatch.setattr(
        clock_windows, "time_offset", lambda *given: searches.append(1) or search(*given)
    )
    log, fixes = tmp_path / "imu.csv", tmp_path / "fixes.csv"
    written(pd.DataFrame(np.column_stack([imu.index, imu.to_numpy()]), columns=COLUMNS), log)
    csv.write(fixes, table_columns(gnss), {})
    one, _ = sd.doctor([log, fixes]).logs
    assert one.answer("navigation") == "yes"
    assert codes(one) == set()
    late = gnss.copy()
    late.index = gnss.index + 0.7
    csv.write(fixes, table_columns(late), {})
    searches.clear()
    one, _ = sd.doctor([log, fixes], fix=tmp_path / "clean.csv").logs
    (fault,) = one.faults
    assert len(searches) == 1
    # The same value as `init navigate` proposes.
    proposed = propose(LogTable(path=str(log)), gnss=FixesTable(path=str(fixes))).table["aiding"][
        "gnss"
    ]
    assert proposed["time_offset_s"] == round(one.data["receiver_clock"]["offset_s"], 3)
    assert fault.data["offset"] == one.data["receiver_clock"]["offset_s"]
    assert one.answer("navigation") == "with limits"
    assert fault.code == "navigation.receiver-clock-off"
    assert np.array_equal(read_gnss(tmp_path / "clean-gnss.csv"), read_gnss(fixes))
    # An antenna a meter before the axle shifts a course by a meter over the speed, 0.08 s.
    assert fault.data["offset"] == pytest.approx(0.7, abs=0.08)


def test_fixes_of_a_clean_log_are_beside_it(drive, tmp_path):
    _, gnss = drive
    fixes, clean = tmp_path / "fixes.csv", tmp_path / "clean.parquet"
    csv.write(fixes, table_columns(gnss), {})
    sd.doctor(fixes, fix=clean)
    before, after = read_gnss(fixes), read_gnss(clean)
    assert np.array_equal(before.to_numpy(), after.to_numpy())
    assert np.array_equal(before.index, after.index)


def test_two_logs_of_one_body_have_an_offset(sound, tmp_path):
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    written(sound, one)
    rng = np.random.default_rng(8)
    other = sound.assign(time_s=sound.time_s + 0.35)
    other[GYROS] += rng.normal(0.0, np.radians(0.05), (len(other), 3))
    written(other, two)
    (found,) = sd.doctor([one, two]).between
    assert found.code == "doctor.logs-apart"
    assert found.data["offset"] == pytest.approx(0.35, abs=5e-3)


def test_logs_from_python_have_axes_of_their_own(sound, tmp_path):
    paths = tmp_path / "one.csv", tmp_path / "two.csv"
    for path in paths:
        written(sound, path)
    stated = "forward-right-down", "forward-left-up"
    given = [sd.read_imu(path, axes=axes) for path, axes in zip(paths, stated, strict=True)]
    found = sd.doctor(given)
    for one, imu in zip(found.logs, given, strict=True):
        assert np.array_equal(one.streams["imu"].to_numpy(), imu.to_numpy())
    assert found.spec.axes == stated
    # One statement for all of them has the last word.
    alike = sd.doctor(given, axes="forward-left-up")
    assert np.array_equal(alike.logs[0].streams["imu"].to_numpy(), given[1].to_numpy())
    found.save(tmp_path / "found", report=False)
    assert sd.verify(tmp_path / "found").verdict == "identical"
    with pytest.raises(ConfigError, check=coded("config.axes-of-each-log")):
        DoctorSpec.checked({"name": "x", "logs": [{"path": "a"}], "axes": ["x,y,z", ""]})


def test_what_holds_nothing_is_refused_with_the_way_in(tmp_path):
    path = tmp_path / "log.bbl"
    path.write_bytes(b"H Product:Blackbox flight data recorder\n")
    with pytest.raises(DataError) as error:
        sd.doctor(path)
    assert error.value.finding.code == "io.foreign-format"


def test_samples_in_memory_are_examined_saved_and_repeated(sound, tmp_path):
    values = sound.to_numpy()
    found = sd.doctor((values[:, 0], values[:, 1:4], values[:, 4:]))
    assert len(found.to_pandas()) == 1
    seal = found.save(tmp_path / "out")
    assert (seal.path / "report.html").stat().st_size < 2e6
    assert sd.verify(seal.path).verdict == "identical"


def test_a_file_that_breaks_a_detection_is_not_of_that_format(sound, tmp_path, monkeypatch):
    def broken(path):
        raise RuntimeError("damaged")

    monkeypatch.setitem(READERS, "broad", replace(READERS["broad"], detect=broken))
    (one,) = sd.doctor(written(sound, tmp_path / "log.csv")).logs
    assert one.data["format"]["name"] == "csv"


# Axes that nobody stated.


def of_unstated_axes(table, path, turn=None):
    """Write a log of a level unit whose axes are not stated, by rows of `turn` of its body axes."""
    level = table[table.time_s < REST]
    turn = np.eye(3) if turn is None else np.array(turn, dtype=float)
    columns = {"time_s": level.time_s.to_numpy()}
    for names in (GYROS, ACCELS):
        columns |= dict(zip(names, turn @ level[names].to_numpy().T, strict=True))
    csv.write(path, columns, {"sampling": "instantaneous"})
    return path


FORWARD_LEFT_UP = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
UPRIGHT = [[0, 1, 0], [0, 0, -1], [-1, 0, 0]]


@pytest.mark.parametrize(
    ("turn", "end", "axes"),
    [(FORWARD_LEFT_UP, "z-up", "x,-y,-z"), (UPRIGHT, "y-up", "-z,x,-y")],
)
def test_a_clean_log_asks_for_axes_that_gravity_contradicts(sound, tmp_path, turn, end, axes):
    path = of_unstated_axes(sound, tmp_path / "log.csv", turn)
    with pytest.raises(DataError) as refused:
        sd.doctor(path, fix=tmp_path / "clean.csv")
    assert refused.value.finding.code == f"doctor.fix-axes-not-stated-{end}"
    assert refused.value.finding.data["flags"] == "--axes AXES"
    assert not list(tmp_path.glob("clean*"))
    sd.doctor(path, axes=axes, fix=tmp_path / "clean.csv")
    (one,) = sd.doctor(tmp_path / "clean.csv").logs
    assert not one.faults
    assert one.streams["imu"]["accel_z"].median() == pytest.approx(-G, abs=0.01)


def test_axes_that_gravity_confirms_stay_unstated_in_a_clean_log(sound, tmp_path):
    path = of_unstated_axes(sound, tmp_path / "log.csv")
    sd.doctor(path, fix=tmp_path / "clean.csv")
    (found,) = [
        f for f in sd.doctor(tmp_path / "clean.csv").findings if f.code == "io.axes-not-stated"
    ]
    assert found.data["probability"] == pytest.approx(0.95, abs=0.01)
    sd.doctor(path, axes="x,y,z", fix=tmp_path / "clean.csv", force=True)
    found = sd.doctor(tmp_path / "clean.csv").findings
    assert not [f for f in found if f.code.startswith("io.axes")]


def test_axes_without_evidence_are_asked_for(sound, tmp_path):
    names = COLUMNS[:4]
    path = tmp_path / "gyro.csv"
    csv.write(path, {n: sound[n].to_numpy() for n in names}, {"sampling": "instantaneous"})
    with pytest.raises(DataError) as refused:
        sd.doctor(path, fix=tmp_path / "clean.csv")
    assert refused.value.finding.code == "doctor.fix-axes-not-stated"


@pytest.mark.parametrize("unit", ["m/s2", "-m/s2"])
def test_a_stated_unit_of_the_accelerometer_does_not_hide_axes_upside_down(sound, tmp_path, unit):
    turn = np.array(FORWARD_LEFT_UP, dtype=float)
    path = of_unstated_axes(sound, tmp_path / "log.csv", turn if unit == "m/s2" else np.eye(3))
    (one,) = sd.doctor(path, units={"accel": unit}).logs
    assert [f.code for f in one.faults] == ["io.axes-not-stated-z-up"]
    (one,) = sd.doctor(path, units={"accel": unit}, axes="x,y,z").logs
    assert [f.code for f in one.faults] == ["io.axes-upside-down"]
    other = "-m/s2" if unit == "m/s2" else "m/s2"
    assert not sd.doctor(path, units={"accel": other}).logs[0].faults


def test_a_clean_log_that_is_upside_down_says_so(sound, tmp_path):
    path = of_unstated_axes(sound, tmp_path / "log.csv", FORWARD_LEFT_UP)
    sd.doctor(path, axes="x,y,z", fix=tmp_path / "clean.csv")
    (one,) = sd.doctor(tmp_path / "clean.csv").logs
    assert [f.code for f in one.faults] == ["io.axes-upside-down"]


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz", "h5", "mat"])
def test_converting_does_not_state_axes_that_nobody_stated(sound, tmp_path, suffix):
    path = of_unstated_axes(sound, tmp_path / "log.csv", FORWARD_LEFT_UP)
    made = tmp_path / f"made.{suffix}"
    sd.write(sd.read_imu(path), made)
    assert "io.axes-not-stated-z-up" in {f.code for f in sd.read_imu(made).findings}
    sd.write(sd.read_imu(path, axes="x,-y,-z"), made, force=True)
    assert not [f for f in sd.read_imu(made).findings if f.code.startswith("io.axes")]


# Channels that do not read the motion.


@pytest.mark.parametrize("value", [0.0, 0.0123])
def test_a_log_whose_gyro_is_constant_on_one_axis_has_no_attitude(sound, tmp_path, value):
    table = sound.assign(gyro_y_rad_s=value)
    (one,) = sd.doctor(written(table, tmp_path / "log.csv")).logs
    for use in ("attitude", "navigation"):
        assert one.answer(use) == "no"
        (lost,) = [f for f in one.fit[use] if f.code == "doctor.channel-lost"]
        assert (lost.quantity, lost.data["percent"]) == ("gyro_y", 100.0)


@pytest.mark.parametrize(("scale", "refused"), [(0.79, True), (0.85, False)])
def test_a_force_at_rest_that_levels_no_attitude_is_said(sound, tmp_path, scale, refused):
    """One axis of another scale: what `attitude` refuses, the doctor does not propose."""
    table = sound.assign(**{ACCELS[2]: scale * sound[ACCELS[2]]})
    path = written(table, tmp_path / "log.csv")
    (one,) = sd.doctor(path).logs
    said = {f.code for f in one.fit["attitude"] if f.severity == "error"}
    code = "alignment.levelling-force-not-gravity"
    assert (code in said) == refused
    if refused:
        with pytest.raises(DataError, check=coded(code)):
            sd.attitude(path)
    else:
        sd.attitude(path)


def test_an_axis_that_is_stuck_for_a_while_limits_the_attitude(sound, tmp_path):
    table = sound.copy()
    table.loc[3000:3799, "gyro_z_rad_s"] = table.gyro_z_rad_s[3000]
    (one,) = sd.doctor(written(table, tmp_path / "log.csv")).logs
    assert one.answer("attitude") == "with limits"
    (lost,) = [f for f in one.fit["attitude"] if f.severity == "warning"]
    assert lost in one.faults
    assert (lost.quantity, lost.data["kind"], lost.data["percent"]) == ("gyro_z", "stuck", 10.0)


def test_a_clock_that_is_set_back_limits_the_attitude_and_rows_twice_do_not(sound, tmp_path):
    table = sound.copy()
    table.loc[table.time_s > 40.0, "time_s"] -= 2.0
    (one,) = sd.doctor(written(table, tmp_path / "back.csv")).logs
    assert [q.code for q in one.questions] == ["io.time-goes-back"]
    (left,) = [f for f in one.fit["attitude"] if f.code == "io.rows-after-step-back-left-out"]
    assert (one.answer("attitude"), left.data["count"]) == ("with limits", 200)
    twice = sound.iloc[np.sort(np.r_[np.arange(len(sound)), 4000])]
    (one,) = sd.doctor(written(twice, tmp_path / "twice.csv")).logs
    assert one.answer("attitude") == "yes"


def test_a_gyro_of_zero_is_no_fault_in_a_simulation_without_noise(tmp_path):
    time = np.arange(0.0, 60.0, 0.01)
    gyro = np.column_stack([0.0 * time, 0.0 * time, 0.2 * np.sin(time)])
    force = np.tile([0.0, 0.0, -G], (time.size, 1))
    (one,) = sd.doctor(sd.Imu.from_arrays(time, gyro, force)).logs
    assert one.answer("attitude") != "no"


def test_fixes_that_are_refused_are_not_missing(sound, tmp_path):
    place = {"lat_deg": 49.0 + 1e-7 * sound.index, "lon_deg": 8.4, "alt_msl_m": 120.0}
    path = written(sound.assign(**place), tmp_path / "log.csv")
    (one,) = sd.doctor(path).logs
    (refused,) = [f for f in one.fit["navigation"] if f.severity == "error"]
    assert (refused.quantity, refused.data["flags"]) == ("alt", "--gnss-datum-height 0")
    (one,) = sd.doctor(path, gnss={"datum_height_m": 46.0}).logs
    assert "gnss" in one.streams


def test_an_accelerometer_of_an_open_unit_is_not_said_to_be_missing(sound, tmp_path):
    # A clock of Apple's leaves the sign of gravity open; without gravity nothing is open.
    names = {"time_s": "TimeIntervalSince1970", **{a: a.partition("_m")[0] for a in ACCELS}}
    table = sound.rename(columns=names)
    table["TimeIntervalSince1970"] += 1.6e9
    open_, lacks = (
        sd.doctor(written(t, tmp_path / f"{k}.csv"))
        for k, t in enumerate((table, sound.drop(columns=list(ACCELS))))
    )
    assert "doctor.accel-open" in {f.code for f in open_.logs[0].fit["attitude"]}
    assert "doctor.no-leveling" in {f.code for f in lacks.logs[0].fit["attitude"]}


@pytest.fixture
def circle(tmp_path):
    """A minute of a steady turn of 3 deg/s at 10 m/s, and fixes of it: logs of both."""
    rng, time = np.random.default_rng(4), np.arange(0.0, 60.0, 0.01)
    turn, speed = np.radians(3.0), 10.0
    still, noise = np.zeros_like(time), rng.normal(size=(time.size, 6))
    gyro = np.column_stack([still, still, still + turn]) + 1e-4 * noise[:, :3]
    accel = np.column_stack([still, still + turn * speed, still - 9.81]) + 0.01 * noise[:, 3:]
    log, fixes = tmp_path / "circle.csv", tmp_path / "fixes.csv"
    written(pd.DataFrame(np.column_stack([time, gyro, accel]), columns=COLUMNS), log)
    at, radius = time[::100], speed / turn / 6.37e6
    lat = 45.0 + np.degrees(radius * np.sin(turn * at))
    lon = 10.0 + np.degrees(radius * (1.0 - np.cos(turn * at))) / np.cos(np.radians(45.0))
    place = np.column_stack([lat, lon, 0.0 * at])
    velocity = speed * np.column_stack([np.cos(turn * at), np.sin(turn * at), 0.0 * at])
    gnss = gnss_table(at, place, velocity, np.ones((at.size, 3)), np.full((at.size, 3), 0.1))
    csv.write(fixes, table_columns(gnss), {})
    return log, fixes


def test_fixes_that_move_end_what_the_samples_take_for_a_rest(circle):
    log, fixes = circle
    (alone,) = sd.doctor(log).logs
    assert len(alone.rests) == len(alone.data["stationary"]) == 1
    assert [f.code for f in alone.fit["attitude"]].count("doctor.bias-or-turn") == 1
    assert alone.answer("attitude") == "with limits"
    one, of_fixes = sd.doctor([log, fixes]).logs
    assert one.rests == ()
    assert one.data["stationary"] == []
    assert one.data["gravity"]["at_rest_m_per_s2"] is None
    assert "doctor.bias-unknown" in [f.code for f in one.fit["attitude"]]
    assert of_fixes.data["fixes_for"] == one.name
    assert one.data["fixes_for"] is None


def test_fixes_of_a_rest_leave_it(circle, tmp_path):
    log, fixes = circle
    table = read_gnss(fixes)
    table[["lat", "lon"]] = [45.0, 10.0]
    table[["VN", "VE", "VD"]] = 0.0
    csv.write(fixes, table_columns(table), {})
    one, _ = sd.doctor([log, fixes]).logs
    assert len(one.rests) == 1
    assert "doctor.bias-from-rest" in [f.code for f in one.fit["attitude"]]


def test_fixes_cut_a_rest_where_they_begin_to_move(tmp_path):
    """A train: 40 s in its station, then at constant speed; the samples show a rest of a minute."""
    rng, time = np.random.default_rng(6), np.arange(0.0, 60.0, 0.01)
    noise = rng.normal(size=(time.size, 6))
    table = np.column_stack([time, 1e-4 * noise[:, :3], 0.01 * noise[:, 3:]])
    table[:, 6] -= 9.81
    log, fixes = tmp_path / "train.csv", tmp_path / "fixes.csv"
    written(pd.DataFrame(table, columns=COLUMNS), log)
    at = time[::100]
    north = 10.0 * np.maximum(at - 40.0, 0.0)
    # No standard deviations: those of a code receiver are taken.
    rows = [
        f"{t},{45.0 + np.degrees(n / 6.37e6):.9f},10.0,100.0"
        for t, n in zip(at, north, strict=True)
    ]
    fixes.write_text("\n".join(["time_s,lat_deg,lon_deg,alt_m", *rows]) + "\n")
    (alone,) = sd.doctor(log).logs
    assert alone.rests[0].end == pytest.approx(59.99)
    one, _ = sd.doctor([log, fixes]).logs
    (rest,) = one.rests
    assert rest.start == 0.0
    # Positions of 5 m each show 10 m/s beyond doubt after two or three seconds; two fixes less.
    assert 37.0 <= rest.end <= 45.0


def test_a_magnetometer_decides_between_bias_and_turn(tmp_path):
    rng, time = np.random.default_rng(6), np.arange(0.0, 60.0, 0.01)
    noise, zero = rng.normal(size=(time.size, 9)), np.zeros_like(time)
    gyro = 1e-4 * noise[:, :3] + [0.0, 0.0, np.radians(5.0)]
    accel = 0.01 * noise[:, 3:6] + [0.0, 0.0, -9.81]
    names = [*COLUMNS, *(f"mag_{a}_uT" for a in "xyz")]
    angle = np.radians(5.0) * time
    for turns, count in ((True, 0), (False, 1)):
        a = angle if turns else zero
        field = 0.1 * noise[:, 6:] + np.column_stack([20 * np.cos(a), -20 * np.sin(a), zero + 40])
        path = tmp_path / f"{turns}.csv"
        rows = np.column_stack([time, gyro, accel, field])
        pd.DataFrame(rows, columns=names).to_csv(path, index=False)
        (one,) = sd.doctor(path).logs
        assert len(one.rests) == count
        said = [f.code for f in one.fit["attitude"]]
        assert "doctor.bias-or-turn" not in said
        assert ("doctor.bias-from-rest" in said) == (count == 1)


def test_fixes_that_may_move_do_not_decide(circle):
    """Four seconds of the turn, and positions without a standard deviation: 30 m are no rest."""
    log, fixes = circle
    log.write_text("".join(log.read_text().splitlines(keepends=True)[:361]))
    table = pd.read_csv(fixes).iloc[:4]
    kept = [name for name in table.columns if not name.startswith(("V", "v")) and "sd" not in name]
    table[kept].to_csv(fixes, index=False)
    one, _ = sd.doctor([log, fixes]).logs
    assert len(one.rests) == 1
    assert "doctor.bias-or-turn" in [f.code for f in one.fit["attitude"]]


@pytest.mark.parametrize("unit", ["deg", "g"])
def test_a_table_of_attitudes_alone_is_no_crash_record(tmp_path, unit):
    time = np.arange(0.0, 2.0, 0.001)
    names = ["roll_deg", "pitch_deg", "yaw_deg"] if unit == "deg" else ["ax_g", "ay_g", "az_g"]
    columns = {name: np.sin(k + time) for k, name in enumerate(names)}
    pd.DataFrame({"time": time} | columns).to_csv(tmp_path / "log.csv", index=False)
    (one,) = sd.doctor(tmp_path / "log.csv").logs
    read = "doctor.crash-record" in [f.code for f in one.fit["crash"]]
    assert read == (unit == "g")
    assert read == all(f.severity != "error" for f in one.fit["crash"])


@pytest.mark.parametrize(
    ("fault", "crash"), [("counts", False), ("impact", True), ("rate", False), ("force", False)]
)
def test_a_log_with_open_questions_is_a_crash_only_where_something_struck(tmp_path, fault, crash):
    """Counts of a phone's sensors had been "fit for crash with limits" and for nothing else."""
    rng, time = np.random.default_rng(3), np.arange(0.0, 30.0, 0.01)
    values = np.column_stack([rng.normal(0.0, 0.05, (time.size, 5)), 1.0 + 0.01 * np.sin(time)])
    names = ["gx", "gy", "gz", "ax", "ay", "az"]
    if fault == "counts":
        values = np.round(16384.0 * values)
    elif fault == "impact":
        values[:, 3] -= 20.0 * np.exp(-np.square((time - 15.0) / 0.05))
    else:
        names = ["gx_rad_s", "gy_rad_s", "gz_rad_s", "ax_m_s2", "ay_m_s2", "az_m_s2"]
        values[1000, 0 if fault == "rate" else 3] = 1e25
    pd.DataFrame(dict(zip(["t", *names], [time, *values.T], strict=True))).to_csv(
        tmp_path / "log.csv", index=False
    )
    (one,) = sd.doctor(tmp_path / "log.csv").logs
    assert ("doctor.crash-record" in [f.code for f in one.fit["crash"]]) == crash
