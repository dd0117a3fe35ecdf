"""A run judged: its heading by a second reckoning, and the run without what does not agree."""

from __future__ import annotations

import json
from statistics import NormalDist
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec, make_filter
from strapdown.navigation import heading_checks
from strapdown.navigation.heading_checks import _Check, heading_checks_of, run_heading_checks
from strapdown.navigation.heading_integrity import SURE
from strapdown.report.navigation import NAVIGATION
from strapdown.systems.navigation_run import make_chain, run_navigation

LIMIT = 3.0


def drive(
    *, error=0.0, sd=1.0, manoeuvres=True, outliers=0.0, trust=None, aids=True, compass=None, laps=1
):
    """A car at 12 m/s with a heading at the start that is off by so many degrees."""
    straight = [{"do": "straight", "duration_s": 90.0}]
    bends = [
        {"do": "straight", "duration_s": 15.0},
        {"do": "turn_left", "angle_deg": 90.0, "radius_m": 60.0},
        {"do": "straight", "duration_s": 20.0},
        {"do": "turn_right", "angle_deg": 60.0, "radius_m": 60.0},
        {"do": "straight", "duration_s": 30.0},
    ]
    receiver = {"rate_hz": 1.0, "position_noise_m": 0.5, "velocity_noise_m_per_s": 0.05}
    table = {
        "simulation": {
            "rate_hz": 50.0,
            "seed": 5,
            "motion": {
                "kind": "car",
                "lat_deg": 48.0,
                "lon_deg": 11.0,
                "alt_m": 500.0,
                "heading_deg": 20.0,
                "speed_m_per_s": 12.0,
                "manoeuvres": bends * laps if manoeuvres else straight,
            },
            "gnss": {"rtk": {**receiver, "outlier_share": outliers}} if aids else {},
        },
        "sensors": {"sensor": "stim300"},
        "start": {
            "lat_deg": 48.0,
            "lon_deg": 11.0,
            "alt_m": 500.0,
            "v_ned_m_per_s": [12.0 * np.cos(np.radians(20.0)), 12.0 * np.sin(np.radians(20.0)), 0],
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 20.0 + error,
            "position_sd_m": 1.0,
            "heading_sd_deg": sd,
        },
        "aiding": {"rtk": {"kind": "gnss"}} if aids else {},
        "trust": trust or {},
        "output": {"figures": False},
    }
    if compass is not None:
        table["aiding"]["compass"] = {"kind": "heading", "path": str(compass)}
    table["start"]["v_ned_m_per_s"] = [float(v) for v in table["start"]["v_ned_m_per_s"]]
    return NavigationSpec.checked(table)


def errors(result):
    """Light and error of the heading of each second."""
    light = result.trust.heading.table
    known = result.differences
    error = np.interp(light.index, known.index, known["heading"])
    return light["status"].to_numpy(), error


@pytest.fixture(scope="module")
def sound():
    return run_navigation(drive(error=0.7))


def test_a_sound_drive_is_green_after_its_first_bend(sound):
    light, error = errors(sound)
    assert (np.abs(error[light == 0]) < LIMIT).all()
    # The first bend begins at 15 s and lasts 8 s.
    assert (light[:14] != 0).all()
    # Between two bends the gyros of this class carry it for a quarter of a minute.
    assert np.mean(light[15:] == 0) > 0.7
    assert sound.trust.first is None
    assert sound.trust.repeated is None


def test_without_a_manoeuvre_a_start_is_borne_out_by_nothing():
    result = run_navigation(drive(error=6.0, manoeuvres=False))
    light, error = errors(result)
    # The bound of the run itself believes a heading that is off by 6 deg.
    assert np.sum(result.trust.heading.table["bound"] < LIMIT) > 20
    assert (np.abs(error) > LIMIT).mean() > 0.9
    assert (light != 0).all()
    advice = result.trust.advice[-1]
    best, after = advice.options[0]
    assert best.aside or best.forward
    # By what a change of velocity of 9.8 m/s tells with fixes of 0.05 m/s: half a degree.
    assert after < 1.0 < advice.sd


def test_a_wrong_start_is_never_green_while_it_is_wrong():
    result = run_navigation(drive(error=9.0))
    light, error = errors(result)
    wrong = np.abs(error) > LIMIT
    assert wrong.sum() > 10
    assert not (wrong & (light == 0)).any()


@pytest.mark.slow
def test_what_was_wrong_with_a_run_does_not_pass_to_a_later_witness(tmp_path):
    """A compass off by 8° makes tilts and biases wrong that the second witness would begin with."""
    truth = run_navigation(drive(laps=3, trust={"repeat": False})).source.truth.iloc[::50]
    compass = tmp_path / "compass.csv"
    told = pd.DataFrame({"heading_deg": (truth["heading"] + 8.0) % 360.0, "heading_sd_deg": 0.5})
    told.rename_axis("time_s").to_csv(compass)
    spec = drive(laps=3, error=8.0, compass=compass, trust={"repeat": False})
    result = run_navigation(spec)
    source, record, sensors = result.source, result.record, sensors_of(spec)
    made = heading_checks_of(
        make_filter(spec, sensors),
        make_chain(spec, sensors),
        source.imu,
        source.tables,
        record,
        result.trust.consistency,
    )
    known = result.differences
    off = [
        (np.interp(one.time, known.index, known["heading"]) - one.difference) / one.sd
        for one in run_heading_checks(made, record, LIMIT / 3.0)
        if one.since > 30.0
    ]
    off = np.abs(np.concatenate(off))
    assert len(off) > 30
    # What a witness bounds with 99 % may be beyond that now and then: one error lasts for seconds.
    assert np.mean(off < SURE) > 0.9


def test_what_a_check_finds_piece_by_piece_is_what_it_finds_at_once():
    """Doubts are judged from what came since the last time; the whole judged anew is the same."""
    spec = drive(laps=2, error=8.0, trust={"repeat": False})
    result = run_navigation(spec)
    source, record, sensors = result.source, result.record, sensors_of(spec)
    chain, filter_ = make_chain(spec, sensors), make_filter(spec, sensors)
    consistency = result.trust.consistency
    made = heading_checks_of(filter_, chain, source.imu, source.tables, record, consistency)
    checks = run_heading_checks(made, record, 0.01)
    assert max(one.time[-1] - one.since for one in checks) > 120.0
    over, evidence, finish = _Check.over, _Check.evidence, _Check.finish

    def nothing(check):
        return heading_checks._result(check.since, check.found.rows[:0])

    def finished(check):
        if check.result is None:
            evidence(check)
        return finish(check)

    with pytest.MonkeyPatch.context() as patched:
        # Without doubts, and without a least scatter, so that every epoch counts.
        patched.setattr(heading_checks, "doubts_of", lambda *_: lambda *_: False)
        patched.setattr(heading_checks, "_scatter", lambda u: np.nanmean(np.abs(u), axis=1))
        by_parts = run_heading_checks(made, record, 0.01)
        patched.setattr(_Check, "evidence", nothing)
        patched.setattr(_Check, "finish", finished)
        at_once = run_heading_checks(made, record, 0.01)
    for one, other in zip(by_parts, at_once, strict=True):
        for name in ("time", "difference", "sd", "covariance", "scale"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))

    begin, doubts = heading_checks._begin, []

    def begun(filter_, run, at, doubt):
        doubts.append(doubt)
        return begin(filter_, run, at, doubt)

    # Once doubted, a run stays so: its estimates are not believed again.
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(heading_checks, "_begin", begun)
        patched.setattr(heading_checks, "doubts_of", lambda *_: lambda _, at: 90.0 < at < 150.0)
        run_heading_checks(made, record, 0.01)
    since = [one.since for one in checks]
    assert doubts == [at > 90.0 for at in since]
    assert any(doubts)
    assert not doubts[0]

    def diverging(check, time, rows):
        check.lost = check.since > 60.0
        if not check.lost:
            over(check, time, rows)

    # One that diverges before its first mark has no result.
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(_Check, "over", diverging)
        left = run_heading_checks(made, record, 0.01)
    assert [one.since for one in left] == [one.since for one in checks if one.since <= 60.0]


def test_the_scatter_of_innovations_is_that_of_the_latest_and_of_eight_at_least():
    rng = np.random.default_rng(7)
    time = np.cumsum(rng.uniform(0.4, 0.6, 200))
    u = 1.7 * rng.normal(size=(200, 2))
    u[::9] *= 6.0
    seconds = np.arange(1.0, 90.0)
    check = SimpleNamespace(seen=SimpleNamespace(rows=np.column_stack([time, u])))
    found = _Check._scale(check, seconds)
    for at, scale in zip(seconds.tolist(), found.tolist(), strict=True):
        newest = u[time <= at][-60:]
        if len(newest) < 8:
            assert scale == 1.0
            continue
        whole = np.sqrt(np.minimum(newest**2, 9.0).mean())
        middle = np.median(np.abs(newest)) / NormalDist().inv_cdf(0.75)
        assert scale == pytest.approx(max(1.0, whole, middle), rel=1e-12)
    assert found.max() > 1.5


def test_gross_errors_are_left_out_of_the_repeated_run():
    result = run_navigation(drive(outliers=0.1))
    first, repeated = result.trust.first, result.trust.repeated
    assert first.kind == "gross"
    assert first.aid == "rtk"
    assert repeated.change.code == "navigation.rerun-without-gross-errors"
    known = result.source.truth

    def rms(record):
        rows = record.trajectory
        north = 6.37e6 * np.radians(rows["lat"] - np.interp(rows.index, known.index, known["lat"]))
        return float(np.sqrt(np.mean(north**2)))

    # The filter has no robust rule: a fix that is 25 m off moves it by metres.
    assert rms(repeated.record) < 0.5 * rms(result.record)


def test_repeating_can_be_turned_off():
    result = run_navigation(drive(outliers=0.1, trust={"repeat": False}))
    assert result.trust.first is not None
    assert result.trust.repeated is None


def test_without_fixes_nothing_bears_a_heading_out():
    result = run_navigation(drive(aids=False))
    assert result.trust.unconfirmed[0].code == "navigation.no-receiver-fixes"
    assert result.trust.heading.share("trusted") == 0.0


def test_the_files_say_what_was_judged(sound, tmp_path):
    NAVIGATION.write(sound, tmp_path / "out")
    told = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))
    light = sound.trust.heading
    assert told["heading"]["share"]["trusted"] == light.share("trusted")
    assert told["answer"].startswith("Position bound, ")
    assert {name: one["at_end"] for name, one in told["quantities"].items()} == dict.fromkeys(
        ("horizontal_position", "height", "horizontal_velocity", "vertical_velocity"), "trusted"
    )
    table = pd.read_csv(tmp_path / "out" / "heading_integrity.csv", comment="#")
    assert len(table) == len(light.table)
    assert (table["status"] == "trusted").mean() == light.share("trusted")
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Status of position and velocity" in report
    assert "First inconsistency, and the re-run without it" in report
