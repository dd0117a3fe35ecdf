"""The generator of logs is right by itself: its truth, its samples, its stamps and its judge."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import simpson
from tests.attitude_logs import judge
from tests.attitude_logs.generator import (
    ACCELS,
    AXES,
    DIFFICULTIES,
    GYROS,
    KINDS,
    G,
    draw,
    make,
    motion_of,
    multiply,
    sampled,
    stamped,
    turned,
)

import strapdown as sd

CLEAN = {"difficulties": ["none"], "noise_deg_s": 0.0, "bias_deg_s": [0.0] * 3}


def first(**wanted):
    def fits(facts):
        return all(facts[key] == value for key, value in wanted.items())

    return next(facts for facts in map(draw, range(2000)) if fits(facts))


@pytest.mark.parametrize("kind", KINDS)
def test_rate_is_that_of_the_attitude(kind):
    motion = motion_of(first(kind=kind))
    t = np.linspace(0.1, motion.duration - 0.1, 997)
    h = 1e-4
    before, after = motion.state(t - h)[0], motion.state(t + h)[0]
    step = multiply(before * [1, -1, -1, -1], after)
    _, omega = motion.state(t)
    # Central differences are off by h² times a third of the second derivative of the rate.
    scale = np.abs(omega).max()
    assert np.abs(step[:, 1:] / h - omega).max() < 1e-4 * scale


def test_integral_is_that_of_the_rate():
    motion = motion_of(first(kind="walk"))
    t = np.linspace(1.0, 5.0, 8001)
    _, omega = motion.state(t)
    # Its error is of the fourth order in the step of 0.5 ms: 5e-12 here.
    total = simpson(omega, x=t, axis=0)
    found = motion.summed(t[-1]) - motion.summed(t[0])
    assert np.abs(found - total).max() < 1e-7


def test_body_rests_where_it_is_said_to():
    facts = first(difficulties=["gap at rest"])
    motion = motion_of(facts)
    for begin, end in facts["gaps_s"]:
        q, omega = motion.state(np.linspace(begin, end, 50))
        assert np.abs(omega).max() == 0.0
        assert np.abs(np.diff(q, axis=0)).max() < 1e-12
        assert np.abs(motion.force(np.array([begin])) - turned(
            q[:1] * [1, -1, -1, -1], np.array([[0.0, 0.0, -G]])
        )).max() < 1e-9  # fmt: skip


def test_samples_are_what_they_are_called():
    facts = first(kind="sway")
    t = np.arange(100, 400) / facts["rate_hz"]
    step = 1 / facts["rate_hz"]
    facts |= {"cut_off_share": 0.0, "rests_s": []}
    motion = motion_of(facts)
    at = sampled(facts | {"sampling": "instant"}, motion, t)
    assert np.array_equal(at, motion.state(t)[1])
    before = sampled(facts | {"sampling": "mean before"}, motion, t)
    after = sampled(facts | {"sampling": "mean after"}, motion, t)
    assert np.abs(before[1:] - after[:-1]).max() < 1e-9
    # By Simpson's rule over each interval, whose error is of the fourth order in the step.
    middle = motion.state(t - step / 2)[1]
    simpson = (motion.state(t - step)[1] + 4 * middle + at) / 6
    assert np.abs(before - simpson).max() < 1e-3 * np.abs(at - middle).max()


def test_stamps_have_their_fault_and_no_other():
    facts = first(difficulties=["none"])
    t = np.arange(1, 4000) / facts["rate_hz"]
    step, offset = 1 / facts["rate_hz"], facts["clock_offset_s"]
    assert np.abs(stamped(facts, t) - t - offset).max() < 1e-9
    late = stamped(facts | {"burst": 8, "burst_apart_s": 0.0}, t) - t - offset
    assert late.min() >= -1e-9
    assert late.max() < 7 * step + 0.002
    read = stamped(facts | {"burst": 8, "burst_apart_s": 0.0}, t)
    assert len(set(np.round(read, 9))) == 500
    even = stamped(facts | {"jitter_share": 0.4, "jitter": "uniform"}, t)
    assert np.abs(even - t - offset).max() <= 0.4 * step
    assert np.diff(even).min() > 0
    heavy = stamped(facts | {"jitter_share": 0.4, "jitter": "heavy"}, t)
    assert np.diff(heavy).min() > 0
    assert (heavy - t - offset).max() > 0.8 * step
    ticks = stamped(facts | {"tick_s": 0.001}, t)
    assert np.abs(ticks * 1000 - np.round(ticks * 1000)).max() < 1e-6


def test_each_difficulty_is_drawn_and_no_two_of_one_column():
    drawn = [draw(seed) for seed in range(200)]
    counts = {name: sum(name in d["difficulties"] for d in drawn) for name in DIFFICULTIES}
    assert min(counts.values()) >= 16
    for facts in drawn:
        assert sum(d in ("bursts", "jitter", "ticks") for d in facts["difficulties"]) <= 1
        assert sum(d in ("sign", "axes named", "axes unnamed") for d in facts["difficulties"]) <= 1


@pytest.mark.parametrize("gyro", GYROS)
@pytest.mark.parametrize("accel", ACCELS)
def test_file_is_read_as_what_it_is(tmp_path, gyro, accel):
    facts = first(difficulties=["none"], accel=True, kind="sway")
    facts |= {"gyro": gyro, "accel_named": accel, "axes": "right-forward-up", "duration_s": 6.0}
    made = make(facts, tmp_path)
    imu = sd.read_imu(made.log)
    names = ["gyro_x", "gyro_y", "gyro_z"]
    # Eight digits are written.
    assert np.abs(imu[names].to_numpy() - made.rates).max() < 1e-7 * np.abs(made.rates).max()


def test_axes_are_right_handed():
    for matrix in AXES.values():
        assert np.linalg.det(np.array(matrix)) == pytest.approx(1)


def test_ideal_samples_of_a_fast_rate_are_exact_and_of_a_slow_one_are_not(tmp_path):
    facts = first(kind="throw", difficulties=["none"]) | CLEAN
    made = make(facts, tmp_path)
    for meaning in ("drop", "sum"):
        fast = max(judge.errors(made, "quaternion", 2000.0, meaning))
        half = max(judge.errors(made, "quaternion", 1000.0, meaning))
        assert fast < 0.02
        assert half / fast == pytest.approx(4, abs=0.2)  # it is of the second order
        assert min(judge.errors(made, "quaternion", 4.0, meaning)) > 1


def test_gap_is_not_integrated_across(tmp_path):
    facts = first(difficulties=["gap moving"], kind="throw") | CLEAN
    facts |= {"sampling": "instant", "cut_off_share": 0.0, "rate_hz": 500.0}
    made = make(facts, tmp_path)
    assert len(judge.segments(made)) == len(facts["gaps_s"]) + 1
    assert judge.sensed(made, "rotvec") < 0.2
    assert max(judge.errors(made, "rotvec", 1000.0, "sum")) < 0.001


def test_judge_finds_a_clean_log_right_and_a_wrong_answer_wrong(tmp_path, monkeypatch):
    facts = first(difficulties=["none"], kind="throw") | CLEAN
    facts |= {"sampling": "instant", "cut_off_share": 0.0, "tolerance_deg": 1.0, "rate_hz": 500.0}
    assert judge.judge(facts, tmp_path)["outcome"] == "right"
    compared = sd.compare_attitude(
        tmp_path / "log.csv", reference=tmp_path / "truth.csv", tolerance_deg=1.0
    )
    outcomes = {}
    for factor in (1 / 8, 1, 8):
        answer = type(
            "Answer", (), vars(compared.answer) | {"rate_hz": compared.answer.rate_hz * factor}
        )
        result = type("Result", (), {"answer": answer, "sweep": compared.sweep, "findings": ()})
        monkeypatch.setattr(judge.sd, "compare_attitude", lambda *_, result=result, **__: result)
        outcomes[factor] = judge.judge(facts, tmp_path)["outcome"]
    assert outcomes == {1 / 8: "too low", 1: "right", 8: "too high"}
