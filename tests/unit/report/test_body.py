"""The body in space: it turns as the attitude says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from strapdown import rotation
from strapdown.evaluation.differences import attitude_at
from strapdown.report.attitude_numbers import chosen_run
from strapdown.report.attitude_page import MOST_FRAMES, body_caption, body_figure

TURNING = 4  # box and three axes


def tip(part):
    """End of an axis in north, east, down; the drawing has east, north, up."""
    return np.array([part["y"][1], part["x"][1], -part["z"][1]])


def test_the_axes_point_where_the_attitude_turns_them(full_bench):
    figure = body_figure(full_bench)
    run = chosen_run(full_bench)
    assert run.algorithm == full_bench.answer.algorithm
    times = [float(frame["name"]) for frame in figure["frames"]]
    # Coordinates have three digits, and a stamp of a millisecond turns by 0.0017 rad at most here.
    for k in (0, len(times) // 2, len(times) - 1):
        dcm = rotation.dcm_from_quaternion(attitude_at(run.attitude, [times[k]])[0])
        for axis in range(3):
            seen = tip(figure["frames"][k]["data"][1 + axis])
            np.testing.assert_allclose(seen, dcm[:, axis], atol=0.003)


def test_the_drawing_is_no_mirror_image(full_bench):
    axes = np.array([tip(p) for p in body_figure(full_bench)["frames"][7]["data"][1:TURNING]])
    np.testing.assert_allclose(np.linalg.det(axes), 1.0, atol=0.005)


def test_it_stands_without_being_played_and_is_thinned(full_bench):
    figure = body_figure(full_bench)
    assert len(figure["frames"]) == MOST_FRAMES
    assert figure["data"][0]["type"] == "mesh3d"
    first = figure["frames"][0]["data"]
    for still, moved in zip(figure["data"], first, strict=False):
        assert {axis: still[axis] for axis in "xyz"} == moved
    steps = figure["layout"]["sliders"][0]["steps"]
    assert [s["args"][0][0] for s in steps] == [f["name"] for f in figure["frames"]]
    assert len({f["name"] for f in figure["frames"]}) == MOST_FRAMES
    assert len(json.dumps(figure, separators=(",", ":"))) < 500_000


def test_the_ghost_is_there_where_the_truth_is(make_bench):
    bench = make_bench()
    half = bench.truth.iloc[: len(bench.truth) // 2]
    figure = body_figure(replace(bench, truth=half, scored=bench.scored[: len(half)]))
    ghosts = [f["data"][TURNING]["x"] for f in figure["frames"]]
    assert ghosts[0][0] is not None
    assert set(ghosts[-1]) == {None}
    assert len(body_figure(make_bench(truth=False))["frames"][0]["data"]) == TURNING


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
    assert f"Played {700 / (299 * 0.033):.3g} times as fast" in body_caption(long)
    assert "Played" not in body_caption(bench)


@pytest.mark.parametrize("samples", [2, 3])
def test_few_samples_are_few_frames(make_bench, samples):
    bench = make_bench(truth=False)
    run = bench.runs[0]
    short = replace(bench, runs=(replace(run, attitude=run.attitude.iloc[:samples]),))
    assert len(body_figure(short)["frames"]) == samples
