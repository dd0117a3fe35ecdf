"""What is proposed for a receiver whose clock is not that of the sensors."""

from __future__ import annotations

import sys
import tomllib
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

import town_drive as town
from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.navigation.measurements import clock_windows
from strapdown.navigation.measurements.clock_windows import Offsets, receiver_clock
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.gnss_clock import TimeOffset
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Straight, Turn
from strapdown.systems import navigation_draft, navigation_proposal
from strapdown.systems.navigation_draft import draft_navigation
from strapdown.systems.navigation_proposal import (
    APART,
    NO_ERRORS,
    OFFSET_SD,
    RULE,
    _clock,
    propose,
)
from strapdown.systems.navigation_run import CONTINUED, run_navigation
from strapdown.tables import ACCEL, GYRO, VELOCITY, VELOCITY_SD, gnss_table

RECEIVER = {"rate": 4.0, "position_noise": 0.02, "velocity_noise": 0.03}
DRIFT = "time_offset_drift_s_per_sqrt_s"
#: How two quartz clocks run apart.
RATE = 50e-6


@cache
def imu():
    return simulate_imu(town.motion(), ImuErrors(), rate=50.0, sampling="mean")[0]


def stamped(offset, rate=0.0):
    """Fixes by a clock that is so much ahead of the sensors' and runs so much faster."""
    table = town.fixes(**RECEIVER)
    time = table.index.to_numpy()
    return gnss_table(
        time + offset + rate * (time - time[0]),
        *np.split(table.to_numpy()[:, :9], 3, axis=1),
        table[VELOCITY_SD].to_numpy(),
        source="receiver.csv",
    )


def test_clocks_that_are_apart_run_apart():
    found, _ = _clock(stamped(0.4), imu(), True)
    assert found["time_offset_s"] == round(found["time_offset_s"], 3)
    assert abs(found["time_offset_s"] - 0.4) < 3.0 * found["time_offset_sd_s"]
    assert found[DRIFT] == APART


def test_of_one_clock_nothing_drifts():
    found, _ = _clock(stamped(0.0), imu(), True)
    assert "time_offset_s" not in found
    assert DRIFT not in found


def offset_at_the_end(walk, rate):
    """Estimate less truth of the offset, and its standard deviation."""
    aid = Gnss(
        name="gnss",
        lever_arm=town.ARM,
        time_offset=0.4,
        time_offset_sd=0.05,
        time_offset_drift=walk,
    )
    navigator, state = town.begun(aid)
    state = navigator.tell(state, "gnss", stamped(0.4, rate))
    state, piece = navigator.advance(state, *town.increments())
    last = piece.marks[-1]
    k = navigator.filter.model.columns_of["gnss.time_offset"].start - 9
    span = last.time - piece.marks[0].time
    # The state is what is assumed less what is true.
    return -last.sensors[k] - rate * span, last.sensors_sd[k]


@pytest.mark.slow
def test_what_is_proposed_follows_quartz_and_spoils_little_without_it():
    for rate in (RATE, -RATE, 0.0):
        error, sd = offset_at_the_end(APART, rate)
        assert abs(error) < 3.0 * sd, rate
        assert sd < 0.01


@pytest.mark.parametrize(("sway", "noise", "arm"), [(0.3, 0.05, 0.02), (0.3, 1.0, None)])
def test_a_tape_measured_arm_is_a_state_where_velocities_of_a_turning_body_show_it(
    sway, noise, arm
):
    """0.02 m at 0.3 rad/s are 6 mm/s in step with the sway: 70 fixes of 0.05 m/s show it."""
    swayed = imu().copy()
    swayed[GYRO[0]] += sway * np.sqrt(2.0) * np.sin(2.0 * np.pi * 0.3 * swayed.index)
    # Positions that are too coarse to show it.
    table = town.fixes(**{**RECEIVER, "position_noise": 1.0, "velocity_noise": noise})
    found, _ = _clock(table, swayed, False)
    assert found.get("lever_arm_sd_m") == arm


def test_a_bias_of_the_gyros_is_no_turn_that_shows_an_arm():
    biased = imu() * 0.0
    biased.attrs = dict(imu().attrs)
    biased[GYRO] = 0.3
    table = town.fixes(**{**RECEIVER, "position_noise": 1.0})
    assert not navigation_proposal._velocities_show_arm(table, biased)


def straight(speed, sd, length=200.0):
    """Positions alone of a way north at a speed: nothing shows an offset of the clock."""
    time = np.arange(0.0, length, 1.0)
    place = np.column_stack([45.0 + speed * time / 111_132.0, 0.0 * time + 20.0, 0.0 * time])
    flat = np.full((len(time), 3), sd)
    return gnss_table(time, place, 0.0 * place, flat, np.full_like(flat, np.inf), source="r.csv")


@pytest.mark.parametrize(("speed", "sd", "offset"), [(1.4, 0.02, True), (1.4, 1.0, False)])
def test_an_offset_is_a_state_of_a_walk_where_its_fixes_would_show_it(speed, sd, offset):
    found, _ = _clock(straight(speed, sd), imu(), False)
    # 0.2 s of a walk are 0.28 m.
    assert found.get("time_offset_sd_s") == (OFFSET_SD if offset else None)
    assert DRIFT not in found


@pytest.mark.parametrize(("turns", "offset"), [(True, True), (False, False)])
def test_an_offset_is_a_state_of_a_walk_where_its_velocities_would_show_it(turns, offset):
    """Turns of 1.4 m/s within seconds: 0.2 s of them are far more than 0.05 m/s."""
    rng = np.random.default_rng(8541)
    time = np.arange(0.0, 200.0, 1.0)
    course = np.pi / 2.0 * np.sin(2.0 * np.pi * time / 15.0) if turns else 0.0 * time
    v = 1.4 * np.column_stack([np.cos(course), np.sin(course), 0.0 * time])
    place = np.column_stack([45.0 + np.cumsum(v[:, 0]) / 111_132.0, 0.0 * time + 20.0, 0.0 * time])
    place[:, :2] += rng.normal(0.0, 1.0, (len(time), 2)) / 111_132.0
    sd = np.full((len(time), 3), 0.05)
    v += rng.normal(0.0, 0.05, v.shape)
    found, _ = _clock(gnss_table(time, place, v, 60.0 * sd, sd, source="r.csv"), imu(), False)
    assert ("time_offset_sd_s" in found) == offset


@pytest.mark.parametrize(("turns", "offset"), [(True, True), (False, False)])
def test_an_assumed_noise_of_velocities_does_not_hide_the_turns_of_a_walk(turns, offset):
    """Now and then around a corner; velocities of 0.05 m/s of which nothing is stated."""
    rng = np.random.default_rng(8541)
    time = np.arange(0.0, 200.0, 0.25)
    course = np.pi / 2.0 * np.clip(time % 20.0 - 9.0, 0.0, 2.0) / 2.0 * turns
    course += np.pi / 2.0 * (time // 20.0) * turns
    v = 1.4 * np.column_stack([np.cos(course), np.sin(course), 0.0 * time])
    way = np.cumsum(v, axis=0) * 0.25
    place = np.column_stack([45.0 + way[:, 0] / 111_132.0, 20.0 + way[:, 1] / 78_847.0, 0.0 * time])
    v += rng.normal(0.0, 0.05, v.shape)
    sd = np.full((len(time), 3), 0.3)
    table = gnss_table(time, place, v, 10.0 * sd, sd, source="r.csv")
    table.attrs["velocity_sd_taken"] = 0.3
    found, _ = _clock(table, imu(), False)
    assert ("time_offset_sd_s" in found) == offset


def windows(rate, sd_rate, count=6):
    """Offsets of windows of a minute, whose drift is known to a standard deviation."""
    begin = 60.0 * np.arange(count)
    middle = begin - begin.mean()
    sd = sd_rate * np.sqrt(np.square(middle).sum())
    spans = np.column_stack([begin, begin + 60.0])
    return Offsets(spans, rate * middle, np.full(count, sd))


@pytest.mark.parametrize(
    ("rate", "sd", "drifts"),
    [(30e-6, 3e-6, True), (0.0, 3e-6, False), (10e-6, 2e-6, True), (0.0, 40e-6, True)],
)
def test_a_drift_is_stated_where_it_is_significant_or_unknown(monkeypatch, rate, sd, drifts):
    made = windows(rate, sd)
    assert made.drift() == (pytest.approx(rate, abs=1e-12), pytest.approx(sd))
    monkeypatch.setattr(clock_windows, "window_offsets", lambda *_, **__: made)
    found, _ = _clock(straight(60.0, 0.02, 360.0), imu(), True, NO_ERRORS)
    assert (DRIFT in found) == drifts
    if drifts:
        # A random walk goes as far in the time of the record as the drift.
        assert found[DRIFT] == pytest.approx(min(np.hypot(rate, sd), RATE) * 359.0**0.5, rel=0.1)
    # Fixes of 5 m do not show it.
    assert DRIFT not in _clock(straight(60.0, 5.0, 360.0), imu(), True, NO_ERRORS)[0]


@pytest.mark.parametrize(
    ("scan", "fit", "both"),
    [
        (None, (0.3, 0.05), (0.3, 0.05)),
        ((0.3, 0.05), None, (0.3, 0.05)),
        (
            (0.13, 0.06),
            (0.29, 0.08),
            ((0.13 / 0.06**2 + 0.29 / 0.08**2) / (0.06**-2 + 0.08**-2), 0.06),
        ),
        ((-0.2, 0.08), (0.32, 0.07), None),
        (None, None, None),
    ],
)
def test_two_estimates_of_an_offset_are_joined_or_contradict_each_other(
    monkeypatch, scan, fit, both
):
    found = None if scan is None else TimeOffset(*scan, 0.9, "course")
    monkeypatch.setattr(clock_windows, "time_offset", lambda *_: found)
    monkeypatch.setattr(
        clock_windows, "window_offsets", lambda *_: SimpleNamespace(joint=lambda: fit)
    )
    offset, windows = receiver_clock(None, None, NO_ERRORS)
    assert windows is not None
    if both is None:
        assert offset is None
    else:
        assert (offset.offset, offset.sd) == (pytest.approx(both[0]), both[1])
        assert offset.by == ("windows" if scan is None else "course")
    assert receiver_clock(None, None) == (found, None)


def stepped(folder, size, at=40.0, outage=0.0):
    """What is proposed and written for a drive by a clock that steps; its time is from 1970."""
    zero = 1_700_000_000.0
    names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    log = imu()[[*GYRO, *ACCEL]].set_axis(names, axis=1).set_axis(imu().index + zero)
    text = log.rename_axis("time_s").to_csv()
    (folder / "log.csv").write_text("# sampling: mean\n" + text)
    table = town.fixes(**RECEIVER)
    table = table[(table.index < at - outage) | (table.index >= at)]
    stamps = table.index.to_numpy()
    late = np.where(stamps >= at, size, 0.0)
    table.set_axis(stamps + zero + late).rename_axis("time").to_csv(folder / "fixes.csv")
    log, given = (str(folder / name) for name in ("log.csv", "fixes.csv"))
    made = []

    def proposed(*arguments, **options):
        made.append(propose(*arguments, **options))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(navigation_draft, "propose", proposed)
        draft = draft_navigation(
            LogTable(path=log),
            gnss=FixesTable(path=given),
            sensor="adis16495-1",
            folder=folder,
        )
    return made[0], tomllib.loads(draft.text)["aiding"]["gnss"]


@pytest.mark.parametrize("size", [0.617, pytest.param(-0.1, marks=pytest.mark.slow)])
def test_a_step_of_the_clock_is_corrected_in_what_is_proposed(tmp_path, size):
    made, written = stepped(tmp_path, size)
    (found,) = (f for f in made.findings if "clock-step" in f.code)
    assert found.code == "navigation.clock-step-corrected"
    ((stamp, by),) = made.table["aiding"]["gnss"]["clock_steps_s"]
    assert by == pytest.approx(size, abs=1e-6)
    assert 1_700_000_039.0 < stamp < 1_700_000_041.0
    # The stamps are those of a clock without a step, and the whole record is proposed.
    true = town.fixes(**RECEIVER).index.to_numpy()
    assert made.gnss.index.to_numpy() - made.gnss.index[0] == pytest.approx(
        true - true[0], abs=1e-5
    )
    assert "to_s" not in made.table["log"]
    assert "from_s" not in made.table["log"]
    assert written["clock_steps_s"] == [[pytest.approx(stamp), pytest.approx(by)]]


@pytest.mark.slow
def test_a_clock_that_may_have_stepped_in_an_outage_is_unsure_from_then_on(tmp_path):
    made, written = stepped(tmp_path, 0.15, outage=15.0)
    aid = made.table["aiding"]["gnss"]
    ((at, sd),) = aid["clock_unsure_s"]
    # On the time of the run, whose first sample is at zero.
    assert at == pytest.approx(32.5, abs=0.3)
    assert sd == pytest.approx(0.25, abs=1e-3)
    assert aid["time_offset_sd_s"] > 0.0
    assert written["clock_unsure_s"] == [[pytest.approx(at), pytest.approx(sd)]]
    made, written = stepped(tmp_path, 0.0, outage=15.0)
    assert "clock_unsure_s" not in made.table["aiding"]["gnss"]
    assert "clock_unsure_s" not in written


def test_an_offset_of_a_second_is_found_in_steps(tmp_path):
    """A run about an offset of zero finds a part of it; biases and scale factors take the rest.

    A single repetition left 0.4 s of 0.9 s, with an sd of 0.006 s.
    """
    legs = []
    for k in range(6):
        legs += [
            (f"{k} on", Straight(6.0)),
            (f"{k} bend", Turn(40.0 if k % 2 else -40.0, 25.0, ramp=2.0)),
        ]
    motion = car(Origin(45.0, 20.0, 80.0), legs, speed=8.0)
    imu, _ = simulate_imu(motion, load_sensor("mpu-6050").draw(3), rate=50.0, seed=3)
    receiver = GnssReceiver(rate=5.0, position_noise=0.01, velocity_noise=0.1)
    fixes = simulate_gnss(motion, receiver, seed=3)
    fixes.index = pd.Index(fixes.index + 0.9, name="time")
    names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    log = imu[[*GYRO, *ACCEL]].set_axis(names, axis=1).rename_axis("time_s")
    (tmp_path / "log.csv").write_text("# sampling: instantaneous\n" + log.to_csv())
    fixes.to_csv(tmp_path / "fixes.csv")
    first = motion.trajectory(imu.index.to_numpy()[:1]).iloc[0]
    start = {
        **{f"{key}_deg": float(first[key]) for key in ("lat", "lon", "roll", "pitch", "heading")},
        "alt_m": float(first["alt"]),
        "v_ned_m_per_s": first[VELOCITY].tolist(),
        "position_sd_m": 10.0,
        "velocity_sd_m_per_s": 2.0,
        "tilt_sd_deg": 2.0,
        "heading_sd_deg": 5.0,
    }
    table = {
        "name": "drive",
        "log": {"path": str(tmp_path / "log.csv")},
        "axes": {"axes": "forward-right-down"},
        "sensors": {"sensor": "mpu-6050"},
        "start": start,
        "aiding": {
            "gnss": {
                "kind": "gnss",
                "path": str(tmp_path / "fixes.csv"),
                "time_offset_sd_s": 0.2,
                "time_offset_drift_s_per_sqrt_s": 0.001,
                "update_rule": RULE,
            }
        },
    }
    run = run_navigation(NavigationSpec.checked(table))
    (step,) = [one for one in run.findings if one.code == "navigation.run-again-with-offset"]
    found = step.data["offset"] - run.record.sensors["gnss.time_offset_t"].iloc[-1]
    # The linear estimate of a state is trusted up to CONTINUED.
    assert found == pytest.approx(0.9, abs=CONTINUED)
