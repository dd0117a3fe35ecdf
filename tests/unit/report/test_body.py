"""The body in space: it turns as the attitude says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from strapdown import rotation
from strapdown.evaluation.differences import attitude_at
from strapdown.report.attitude_document import MOST_FRAMES, body_animation
from strapdown.report.attitude_words import chosen_run


def times_of(animation):
    return [float(name.removesuffix(" s")) for name in animation.scene.frames]


def test_the_body_turns_as_the_attitude_says(full_bench):
    animation = body_animation(full_bench)
    (body, *_) = animation.scene.bodies
    run = chosen_run(full_bench)
    assert run.algorithm == full_bench.answer.algorithm
    times = times_of(animation)
    assert len(times) == len(set(times)) == len(body.q) == MOST_FRAMES
    # A stamp of a millisecond turns by 0.0017 rad at most here.
    for k in (0, len(times) // 2, len(times) - 1):
        dcm = rotation.dcm_from_quaternion(attitude_at(run.attitude, [times[k]])[0])
        np.testing.assert_allclose(rotation.dcm_from_quaternion(body.q[k]), dcm, atol=0.003)
    np.testing.assert_array_equal([tip for _, tip, _ in body.axes], np.eye(3))
    assert [name for name, _, _ in body.axes] == ["x forward", "y right", "z down"]


def test_its_data_are_few_and_need_no_other_coordinates(full_bench):
    data = body_animation(full_bench).scene.data()
    assert len(json.dumps(data, separators=(",", ":"), allow_nan=False)) < 100_000
    faces = data["bodies"][0]["faces"]
    # Each corner of the box belongs to three faces.
    assert sorted(k for face in faces for k in face) == sorted(3 * list(range(8)))


def test_the_ghost_is_there_where_the_truth_is(make_bench):
    bench = make_bench()
    half = bench.truth.iloc[: len(bench.truth) // 2]
    short = body_animation(replace(bench, truth=half, scored=bench.scored[: len(half)]))
    ghost = short.scene.data()["bodies"][1]
    assert ghost["wire"] and ghost["q"][0] is not None and ghost["q"][-1] is None
    assert len(body_animation(make_bench(truth=False)).scene.bodies) == 1


def test_without_an_answer_the_least_wrong_is_shown(make_bench):
    bench = make_bench()
    none = replace(bench, answer=replace(bench.answer, algorithm=None))
    assert chosen_run(none).algorithm in ("dcm", "quaternion")


def test_a_long_log_says_how_fast_it_is_played(make_bench):
    bench = make_bench()
    run = bench.runs[0]
    table = run.attitude.set_axis(run.attitude.index * 100.0, axis=0)
    long = replace(bench, runs=(replace(run, attitude=table),), truth=None)
    # 700 s in 299 steps of 33 ms.
    assert f"Played {700 / (299 * 0.033):.3g} times as fast" in body_animation(long).caption
    assert "Played" not in body_animation(bench).caption


@pytest.mark.parametrize("samples", [2, 3])
def test_few_samples_are_few_frames(make_bench, samples):
    bench = make_bench(truth=False)
    run = bench.runs[0]
    short = replace(bench, runs=(replace(run, attitude=run.attitude.iloc[:samples]),))
    assert len(body_animation(short).scene.frames) == samples
