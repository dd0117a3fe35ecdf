"""What motion increments are: their rows, their blocks, their neighbours, and what they refuse."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.increments import (
    ORDERS,
    imu_from_increments,
    increments_from_imu,
    motion_increments,
)
from strapdown.tables import ACCEL, DR, DV, GYRO, MOTION, PHI, THETA, imu_table

_spec = importlib.util.spec_from_file_location(
    "smooth_motion", Path(__file__).with_name("smooth_motion.py")
)
smooth = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(smooth)

KINDS = [pytest.param(*key, id="-".join(map(str, key))) for key in ORDERS]
SAMPLINGS = ("instantaneous", "mean")


def uneven(count, seed=5):
    rng = np.random.default_rng(seed)
    return 0.3 + np.concatenate([[0.0], np.cumsum(rng.uniform(0.007, 0.013, count))])


def shift(state, table):
    """Put what a table leads to after a state."""
    after, t = smooth.compose(table), float(table["dt"].sum())
    return smooth.State(
        rotation.compose(state.q, after.q),
        state.velocity + rotation.rotate(state.q, after.velocity),
        state.position + state.velocity * t + rotation.rotate(state.q, after.position),
    )


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("samples", [2, 3, 4])
def test_the_rows_of_a_block_put_together_are_the_block(sampling, samples):
    imu = smooth.imu_at(uneven(50), sampling)
    rows = motion_increments(imu, samples)
    blocks = motion_increments(imu, samples, rows="block")
    assert len(rows) == 50 and len(blocks) == -(-50 // samples)
    assert (
        list(blocks.index) == [*rows.index[samples - 1 :: samples], *rows.index[-1:]][: len(blocks)]
    )
    for k in range(len(blocks)):
        part = smooth.compose(rows.iloc[k * samples : (k + 1) * samples])
        whole = smooth.compose(blocks.iloc[k : k + 1])
        # Rounding of turns of 0.1 rad, 0.4 m/s and 8 mm.
        assert (smooth.distance(part, whole) < [1e-15, 1e-15, 1e-17]).all()


@pytest.mark.parametrize(("sampling", "samples", "interpolation"), KINDS)
def test_polynomials_are_integrated_exactly(sampling, samples, interpolation):
    """Without a turn, dv and dr of a force that the method can know are exact, row by row."""
    mean = sampling == "mean"
    degree = {"constant": 0, "cubic": 2 if mean else 3}.get(interpolation, samples - mean)
    if interpolation == "linear" and samples == 1:
        degree = 1
    time = uneven(23) - 0.3
    c = np.random.default_rng(2).normal(size=(degree + 1, 3))
    powers = np.arange(degree + 1)

    def force(t, integrals):
        out = np.zeros((len(t), 3))
        for k in powers:
            factor = 1.0 / np.prod(np.arange(k + 1, k + 1 + integrals))
            out += c[k] * factor * t[:, None] ** (k + integrals)
        return out

    edges = np.concatenate([[2 * time[0] - time[1]], time])
    rows = np.diff(force(edges, 1), axis=0) / np.diff(edges)[:, None] if mean else force(time, 0)
    found = motion_increments(
        imu_table(time, np.zeros((24, 3)), rows, sampling=sampling), samples, interpolation
    )
    dt, inner = np.diff(time)[:, None], slice(0, None)
    if interpolation == "cubic":
        # At the ends there is one neighbour alone.
        inner = slice(1, -1)
    velocity = np.diff(force(time, 1), axis=0)
    distance = np.diff(force(time, 2), axis=0) - dt * force(time, 1)[:-1]
    # Values of 3 m/s2 over 13 ms, some ten roundings, and integrals whose difference loses those
    # of numbers up to 0.4 and 0.05.
    assert found[DV].to_numpy()[inner] == pytest.approx(velocity[inner], abs=5e-16)
    assert found[DR].to_numpy()[inner] == pytest.approx(distance[inner], abs=1e-16)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("samples", [2, 3, 4])
def test_a_ragged_end_borrows_the_steps_before_it(sampling, samples):
    time = uneven(4 * samples + 1)
    imu = smooth.imu_at(time, sampling)
    found = motion_increments(imu, samples)
    # The last step alone: the polynomial of the last steps, which end there.
    tail = motion_increments(imu.iloc[-samples - 1 :].set_axis(imu.index[-samples - 1 :]), samples)
    # Stamps are taken from another first node: a few roundings of the whole.
    assert found[MOTION].to_numpy()[-1] == pytest.approx(tail[MOTION].to_numpy()[-1], abs=2e-15)
    # And it is better than one step for itself.
    end, start = time[-1], time[-2]
    true = smooth.truth(start, end)
    alone = motion_increments(imu.iloc[-2:], 1, "constant" if sampling == "mean" else "linear")
    wrong = smooth.distance(smooth.compose(found.iloc[-1:]), true)
    assert (wrong < 0.2 * smooth.distance(smooth.compose(alone), true)).all()


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_a_gap_and_a_burst_end_a_block(sampling):
    steps = np.array([0.01, 0.01, 0.01, 0.2, 0.01, 0.01, 0.01, 0.01, 0.002, 0.002, 0.01])
    time = np.concatenate([[0.0], np.cumsum(steps)])
    blocks = motion_increments(smooth.imu_at(time, sampling), 4, rows="block")
    assert blocks["dt"].to_numpy() == pytest.approx([0.03, 0.2, 0.04, 0.004, 0.01], rel=1e-12)
    # The step of the gap knows nothing but its own ends.
    lone = motion_increments(smooth.imu_at(time[3:5], "instantaneous"), 1)
    if sampling == "instantaneous":
        # The same line, by an expansion of the sixth order: the fifth power of 0.2 s x 3 rad/s.
        assert blocks[PHI].to_numpy()[1] == pytest.approx(lone[PHI].to_numpy()[0], abs=2e-4)
    # The three steps before the gap are one cubic's, or one parabola's; nothing reaches over.
    before = motion_increments(smooth.imu_at(time[:4], sampling), 3, rows="block")
    assert blocks[MOTION].to_numpy()[0] == pytest.approx(before[MOTION].to_numpy()[0], abs=1e-15)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_neighbours_across_a_gap_are_not_asked(sampling):
    time = np.array([0.0, 0.01, 0.02, 0.03, 0.53, 0.54, 0.55])
    found = motion_increments(smooth.imu_at(time, sampling), 1, "cubic")
    inside = motion_increments(smooth.imu_at(time[:4], sampling), 1, "cubic")
    assert found[MOTION].to_numpy()[:3] == pytest.approx(inside[MOTION].to_numpy(), abs=1e-16)


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_the_turn_is_that_of_the_angles_and_a_coning_term(sampling, interpolation):
    imu = smooth.imu_at(uneven(200), sampling)
    theta = increments_from_imu(imu, interpolation)[THETA].to_numpy()
    phi = motion_increments(imu, 1, interpolation)[PHI].to_numpy()
    # About theta, by the products of equals: |dtheta x theta|/12 with 3 rad/s and 8 rad/s2 at
    # 13 ms, 4e-6. With neighbours the angle is the same but for that.
    assert np.abs(phi - theta).max() < 4.5e-6
    # Along theta itself coning has no part but of the next order.
    along = ((phi - theta) * theta).sum(axis=1) / np.linalg.norm(theta, axis=1)
    assert np.abs(along).max() < 1e-8


def test_the_delay_of_a_mean_costs_a_whole_order():
    """Means taken for values at their stamps are half a step late: first order, and how much."""
    start, length = 0.3, 1.2
    end = smooth.truth(start, start + length)
    late, right = [], []
    for count in (60, 120):
        time = start + np.linspace(0.0, length, count + 1)
        imu = smooth.imu_at(time, "mean")
        right.append(smooth.distance(smooth.compose(motion_increments(imu)), end))
        wrong = imu_table(time, imu[GYRO], imu[ACCEL])
        late.append(smooth.distance(smooth.compose(motion_increments(wrong)), end))
    late, right = np.array(late), np.array(right)
    assert np.log2(late[0] / late[1]) == pytest.approx([1.0, 1.0, 1.0], abs=0.1)
    # At 100 Hz, in 1.2 s: the motion of half a step, 5 ms at some rad/s and m/s2.
    assert (late[1] > [2e-3, 2e-2, 1e-2]).all()
    assert (right[1] < 1e-3 * late[1]).all()


def test_increments_of_a_sensor_are_means():
    time = uneven(30)
    edges = np.concatenate([[time[0] - 0.01], time])
    sums = np.diff(smooth.integrals(edges), axis=0)
    imu = imu_from_increments(time, sums[:, :3], sums[:, 3:], dt=0.01, source="unit")
    assert imu.attrs["sampling"] == "mean" and imu.attrs["source"] == "unit"
    steps = np.diff(edges)[:, None]
    assert imu[GYRO + ACCEL].to_numpy() == pytest.approx(sums / steps, rel=1e-13)
    # What comes out is what went in, without a turn.
    still = imu_from_increments(time, 0.0 * sums[:, :3], sums[:, 3:])
    assert motion_increments(still)[DV].to_numpy() == pytest.approx(sums[1:, 3:], rel=1e-14)


def test_the_first_step_of_increments_is_the_usual_one_or_as_said():
    time, theta = np.array([0.0, 0.01, 0.02, 0.05]), np.full((4, 3), 0.02)
    assert imu_from_increments(time, theta)[GYRO].iloc[0].tolist() == pytest.approx([2.0] * 3)
    said = imu_from_increments(time, theta, dt=0.04)
    assert said[GYRO].iloc[0].tolist() == pytest.approx([0.5] * 3)
    assert ACCEL[0] not in said.columns


@pytest.mark.parametrize("dt", [0.0, -0.01, np.nan])
def test_a_first_step_that_is_none(dt):
    with pytest.raises(DataError, check=coded("mechanization.first-step-none")) as error:
        imu_from_increments([0.0, 0.01], np.zeros((2, 3)), dt=dt)
    assert error.value.finding.quantity == "dt"


def test_increments_whose_stamps_do_not_advance():
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "tables.time-does-not-advance-followed",
    ):
        imu_from_increments([0.0, 0.01, 0.01], np.zeros((3, 3)))
    with pytest.raises(DataError, check=coded("tables.arrays-different-lengths")):
        imu_from_increments([0.0, 0.01], np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(DataError, check=coded("tables.sample-attitude-integral-rate-needs")):
        imu_from_increments([0.0], np.zeros((1, 3)))


def test_a_log_without_an_accelerometer():
    imu = imu_table([0.0, 0.01], np.zeros((2, 3)), source="log.csv")
    with pytest.raises(
        DataError,
        check=coded("mechanization.no-accelerometer-without-specific-force", quantity="accel"),
    ) as error:
        motion_increments(imu)
    said = error.value.finding
    assert said.file == "log.csv" and said.quantity == "accel" and "--columns" in said.remedy


@pytest.mark.parametrize(
    ("options", "quantity"),
    [
        ({"samples": 0}, "samples"),
        ({"samples": 5}, "samples"),
        ({"interpolation": "cubics"}, "interpolation"),
        ({"interpolation": "constant"}, "interpolation"),
        ({"samples": 2, "interpolation": "cubic"}, "interpolation"),
        ({"rows": "blocks"}, "rows"),
    ],
)
def test_options_that_are_refused(options, quantity):
    imu = smooth.imu_at(uneven(8), "instantaneous")
    with pytest.raises(ConfigError) as error:
        motion_increments(imu, **options)
    assert error.value.finding.quantity == quantity


@pytest.mark.parametrize(("sampling", "samples", "interpolation"), KINDS)
@pytest.mark.parametrize("rows", ["sample", "block"])
def test_two_samples_are_enough_and_nothing_is_changed(sampling, samples, interpolation, rows):
    imu = smooth.imu_at([0.0, 0.01], sampling)
    before = imu.copy()
    found = motion_increments(imu, samples, interpolation, rows)
    assert len(found) == 1 and found.index[0] == 0.01
    assert imu.equals(before)
