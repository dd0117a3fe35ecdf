"""Comparisons of logs with gaps, packets, turned axes, late stamps and a bias."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strapdown import formats, rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import Quaternion, attitude_history
from strapdown.attitude_comparison.error_budget import _median
from strapdown.increments import increments_from_imu
from strapdown.tables import attitude_table, imu_table

RATE = 100.0
ONE = {"algorithms": ["quaternion"]}


def rates(time):
    return np.column_stack(
        [
            1.2 * np.sin(2 * np.pi * 0.9 * time),
            0.8 * np.cos(2 * np.pi * 0.6 * time),
            0.5 * np.sin(2 * np.pi * 0.35 * time + 1.0),
        ]
    )


def truth_of(time):
    """Attitude at instants: the motion integrated in steps of a twentieth of a sample."""
    fine = np.arange(0.0, time[-1] + 0.01, 1.0 / (20.0 * RATE))
    imu = imu_table(fine, rates(fine))
    q = attitude_history(Quaternion(), increments_from_imu(imu, "cubic"), [1.0, 0.0, 0.0, 0.0])
    rows = np.searchsorted(fine, time - 1e-9)
    np.testing.assert_allclose(fine[rows], time, atol=1e-9)
    return attitude_table(time, q[rows])


def write(folder, time, gyro, accel=None, name="log.csv", header=None):
    columns = [time, *np.degrees(gyro).T]
    names = ["time_s", "gyro_x_deg_s", "gyro_y_deg_s", "gyro_z_deg_s"]
    if accel is not None:
        columns += list(accel.T)
        names += ["accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2"]
    path = folder / name
    pd.DataFrame(np.column_stack(columns), columns=header or names).to_csv(path, index=False)
    return path


def write_truth(folder, time):
    path = folder / "truth.csv"
    truth_of(time).reset_index().to_csv(path, index=False)
    return path


def test_a_pause_is_no_part_of_the_rate_nor_of_the_verdict(tmp_path):
    """A 100 Hz log that pauses for 10 s, and goes on turning meanwhile."""
    time = np.arange(3000) / RATE
    here = (time < 12.0) | (time > 22.0)
    log = write(tmp_path, time[here], rates(time[here]))
    bench = compare_attitude(log, reference=write_truth(tmp_path, time[::2]), **ONE)
    assert bench.clock.rate_hz == pytest.approx(RATE, rel=1e-6)
    (gap,) = bench.clock.gaps
    assert gap.length == pytest.approx(10.0, abs=0.03)
    assert bench.sweep["rate_hz"].max() == pytest.approx(RATE, rel=1e-6)
    full = bench.sweep[bench.sweep["factor"] == 1]
    # The trapezoid of a motion of at most 0.9 Hz at 100 Hz.
    assert full["max_deg"].max() < 0.05
    assert full["own_deg"].max() < 0.05
    assert bench.answer.verdict == "enough"
    # Without a truth the turn within the pause is not seen, and said not to be.
    words = compare_attitude(log, reference="end same as start", **ONE)
    assert "attitude.gap-before-reference" in {f.code for f in words.findings}
    alone = compare_attitude(log, **ONE)
    assert "attitude.gap-before-reference" not in {f.code for f in alone.findings}
    assert alone.answer.rate_hz == pytest.approx(bench.answer.rate_hz, rel=1e-6)


@pytest.mark.parametrize("held_up", [0.0, 0.5])
def test_packets_are_integrated_on_the_clock_of_the_sensor(tmp_path, held_up):
    """A program that is held up delivers late: that is no gap."""
    time = np.arange(3000) / RATE
    ends = np.repeat(time[9::10], 10) + np.tile(np.arange(10) * 1e-5, 300)
    late = (ends > 12.0) & (ends < 12.0 + held_up)
    ends[late] = 12.0 + held_up + np.arange(late.sum()) * 1e-5
    log = write(tmp_path, ends, rates(time))
    bench = compare_attitude(log, reference=write_truth(tmp_path, time[::2]), **ONE)
    assert bench.clock.kind == "bursts"
    assert bench.clock.rate_hz == pytest.approx(RATE, rel=1e-3)
    codes = {f.code for f in bench.findings}
    assert "attitude.stamps-in-bursts" in codes
    assert not codes & {"io.gaps", "io.long-gap", "attitude.gap-before-reference"}
    full = bench.sweep[bench.sweep["factor"] == 1]
    # As taken: what is turned in a packet of 0.1 s at up to 1.5 rad/s is 8 deg.
    assert full["max_deg"].max() < 0.5


def test_a_shift_of_the_clock_is_found_and_its_share_named(tmp_path):
    time = np.arange(6000) / RATE
    late = 0.012
    log = write(tmp_path, time, rates(time - late))
    known = time[::2]
    bench = compare_attitude(log, reference=write_truth(tmp_path, known), **ONE)
    budget = bench.budget
    assert budget.delay_s == pytest.approx(late, abs=5e-4)
    assert abs(budget.delay_s - late) < 4.0 * budget.delay_sd + 2e-5
    first, *_ = budget.parts.to_dict("records")
    assert budget.parts["part"].tolist()[:2] == ["as stamped", "clock"]
    assert first["max_deg"] == pytest.approx(np.degrees(late * 1.5), rel=0.5)
    clock = budget.parts.set_index("part").loc["clock"]
    assert clock["max_deg"] < 0.1 * first["max_deg"]
    # The answer is that of the sensor, on one clock; as stamped it is not.
    assert bench.sweep["max_deg"].min() < 0.1 * first["max_deg"]
    assert "attitude.reference-clock-differs" in {f.code for f in bench.findings}
    stated = compare_attitude(
        log, reference=tmp_path / "truth.csv", reference_clock="stated", **ONE
    )
    assert stated.sweep["max_deg"].min() > 0.5 * first["max_deg"]


def test_a_drift_of_the_clock_is_found(tmp_path):
    time = np.arange(6000) / RATE
    drift = 800e-6
    log = write(tmp_path, time * (1.0 + drift), rates(time))
    bench = compare_attitude(log, reference=write_truth(tmp_path, time[::2]), **ONE)
    # Against the truth's clock: the log's stamps of an instant less that.
    assert bench.budget.drift_ppm == pytest.approx(800.0, abs=10.0)
    assert bench.sweep["max_deg"].min() < 0.2


@pytest.mark.parametrize("axes", ["y,-x,z", "x,-y,z", "-z,x,-y"])
def test_axes_are_found_by_the_truth(tmp_path, axes):
    """Axis by axis of the body: which of the log's it is; an odd number of signs is a mirror."""
    time = np.arange(6000) / RATE
    gyro = np.empty((time.size, 3))
    for body, name in enumerate(axes.split(",")):
        gyro[:, "xyz".index(name[-1])] = rates(time)[:, body] * (-1.0 if "-" in name else 1.0)
    log = write(tmp_path, time, gyro)
    truth = write_truth(tmp_path, time[::2])
    bench = compare_attitude(log, reference=truth, **ONE)
    (found,) = [
        f
        for f in bench.findings
        if f.code in ("attitude.axes-by-reference", "attitude.gyro-mirrored")
    ]
    assert found.data["axes"] == axes
    assert (found.code == "attitude.gyro-mirrored") == (axes == "x,-y,z")
    assert bench.sweep["max_deg"].min() < 0.05
    assert bench.imu.attrs["sensor_axes"] == axes
    stated = compare_attitude(log, reference=truth, axes="x,y,z", **ONE)
    assert stated.sweep["max_deg"].min() > 20.0


def test_right_axes_are_left(tmp_path):
    time = np.arange(3000) / RATE
    log = write(tmp_path, time, rates(time))
    bench = compare_attitude(log, reference=write_truth(tmp_path, time[::2]), **ONE)
    codes = {f.code for f in bench.findings}
    assert not codes & {"attitude.axes-by-reference", "attitude.gyro-mirrored"}
    assert not codes & {"attitude.reference-clock-differs"}


def test_a_part_that_no_movement_is_in_is_compared(recordings):
    # The first 30 s of a trial of BROAD are a rest: no row of the truth counts.
    log = recordings("broad/02_undisturbed_slow_rotation_B.hdf5")
    bench = compare_attitude(log, algorithms=["quaternion"], duration_s=30.0, gyro_bias="rest")
    assert [one.algorithm for one in bench.runs] == ["quaternion"]


@pytest.mark.parametrize("sampling", ["mean before", "instantaneous"])
def test_means_taken_for_instants_are_late_by_half_a_step(tmp_path, sampling):
    fine = np.arange(0.0, 60.0, 1e-3)
    angle = np.vstack([np.zeros(3), np.cumsum(rates(fine + 5e-4) * 1e-3, axis=0)])[:-1]
    time = np.arange(1, 1200) / 20.0
    k = np.rint(time * 1000).astype(int)
    gyro = rates(time)
    if sampling == "mean before":
        gyro = (angle[k] - angle[k - 50]) * 20.0
    log = write(tmp_path, time, gyro)
    known = np.arange(0, 5900, 2) / RATE
    bench = compare_attitude(log, reference=write_truth(tmp_path, known), **ONE)
    late = bench.budget.delay_s / bench.clock.step
    assert late == pytest.approx(0.5 if sampling == "mean before" else 0.0, abs=0.05)


def test_bias_and_scale_are_told_apart(tmp_path):
    rng = np.random.default_rng(3)
    time = np.arange(12_000) / RATE
    bias = np.radians([0.3, -0.2, 0.1])
    matrix = np.array([[0.01, 0.002, 0.0], [0.0, -0.015, 0.003], [-0.004, 0.0, 0.02]])
    gyro = rates(time) @ (np.eye(3) + matrix).T + bias + rng.normal(0.0, 1e-3, (time.size, 3))
    log = write(tmp_path, time, gyro)
    bench = compare_attitude(
        log, reference=write_truth(tmp_path, time[::2]), gyro_bias="none", **ONE
    )
    budget = bench.budget
    # A window of 1 s has noise of 1e-4 rad: 120 of them leave 1e-5 rad/s, and of a rate of half a
    # radian a second 2e-5 of scale.
    np.testing.assert_allclose(budget.bias, bias, atol=2e-4)
    np.testing.assert_allclose(budget.matrix, matrix, atol=1e-3)
    parts = budget.parts.set_index("part")
    assert parts.loc["scale and axes", "max_deg"] < 0.1 * parts.loc["as stamped", "max_deg"]


def test_integration_holds_a_tolerance_for_as_long_as_a_bias_takes(tmp_path):
    """A constant bias of 0.5 deg/s of a body that does not turn: 1 deg after 2 s."""
    time = np.arange(3000) / RATE
    gyro = np.tile(np.radians([0.0, 0.0, 0.5]), (time.size, 1))
    log = write(tmp_path, time, gyro)
    truth = tmp_path / "truth.csv"
    still = attitude_table(time, np.tile([1.0, 0.0, 0.0, 0.0], (time.size, 1)))
    still.reset_index().to_csv(truth, index=False)
    bench = compare_attitude(log, reference=truth, gyro_bias="none", **ONE)
    held = bench.answer.holding
    assert held.ends
    # Known every 0.1 s.
    assert held.shortest_s == pytest.approx(2.0, abs=0.11)
    assert held.median_s == pytest.approx(2.0, abs=0.11)
    wide = compare_attitude(log, reference=truth, gyro_bias="none", tolerance_deg=50.0, **ONE)
    assert not wide.answer.holding.ends


def test_integration_with_a_simulated_sensor_does_not_hold_a_tolerance_beyond_its_errors():
    bench = compare_attitude("gestures", sensor="mpu-6050", rate_hz=50.0, gyro_bias="none", **ONE)
    held = bench.answer.holding
    assert held.ends
    # The bias of this part is up to 20 deg/s on each axis: 1 deg at most by 35 deg/s.
    assert 1.0 / 35.0 < held.shortest_s < 1.0


def still(count, rng, up=-9.81):
    accel = rng.normal(0.0, 0.02, (count, 3))
    accel[:, 2] += up
    return accel


@pytest.mark.parametrize("bias_deg_s", [0.0, 1.0])
def test_the_bias_of_a_rest_is_removed_where_it_is_significant(tmp_path, bias_deg_s):
    rng = np.random.default_rng(8)
    time = np.arange(4000) / RATE
    moving = (time > 10.0)[:, None]
    gyro = np.where(moving, rates(time - 10.0), 0.0) + rng.normal(0.0, 2e-3, (time.size, 3))
    gyro[:, 0] += np.radians(bias_deg_s)
    log = write(tmp_path, time, gyro, still(time.size, rng))
    bench = compare_attitude(log, **ONE)
    removed = bench.gyro_bias["rad_per_s"]
    if bias_deg_s:
        assert removed[0] == pytest.approx(np.radians(bias_deg_s), abs=3e-4)
    else:
        assert removed is None
    off = compare_attitude(log, gyro_bias="none", **ONE)
    assert off.gyro_bias["rad_per_s"] is None


def test_a_log_whose_z_points_up_is_turned_by_gravity(tmp_path, monkeypatch):
    rng = np.random.default_rng(9)
    time = np.arange(3000) / RATE
    accel = still(time.size, rng, up=9.81)
    log = write(tmp_path, time, rates(time) * (time > 8.0)[:, None], accel)
    made, assemble = [], formats.assemble
    monkeypatch.setattr(formats, "assemble", lambda *a, **k: made.append(a) or assemble(*a, **k))
    bench = compare_attitude(log, **ONE)
    assert len(made) == 1  # the columns are converted once
    (note,) = [f for f in bench.findings if f.code == "attitude.axes-by-gravity"]
    assert note.data["axes"] == "x,-y,-z"
    assert abs(bench.initial["roll_deg"]) < 1.0
    np.testing.assert_allclose(bench.imu["gyro_y"].to_numpy()[-5:], -rates(time)[-5:, 1], atol=1e-9)
    stated = compare_attitude(log, axes="x,y,z", **ONE)
    assert abs(stated.initial["roll_deg"]) > 179.0


def test_every_piece_begins_anew_with_the_attitude_given():
    time = np.arange(50) / RATE
    increments = increments_from_imu(imu_table(time, rates(time)))
    q = rotation.quaternion_from_euler([10.0, 20.0, 30.0])
    anew = attitude_history(Quaternion(), increments, [1.0, 0.0, 0.0, 0.0], [(20, q)])
    whole = attitude_history(Quaternion(), increments, [1.0, 0.0, 0.0, 0.0])
    rest = attitude_history(Quaternion(), increments.iloc[20:], q)
    np.testing.assert_array_equal(anew[:20], whole[:20])
    np.testing.assert_array_equal(anew[20:], rest)


def test_times_that_the_end_of_a_record_cuts_count_for_no_less():
    """Of exponential times, each cut at an instant of its own, the median is that of the whole."""
    rng = np.random.default_rng(4)
    times = rng.exponential(10.0, 4000)
    cut = rng.uniform(0.0, 20.0, 4000)
    median, reached = _median(np.minimum(times, cut), times <= cut)
    assert reached
    # Standard deviation of a median of some 2,000 that are seen: 1.25 x 10 / sqrt(2000).
    assert median == pytest.approx(10.0 * np.log(2.0), abs=4.0 * 0.28)
    assert _median(np.array([1.0, 3.0]), np.array([False, False])) == (3.0, False)
    assert _median(np.array([3.0, 1.0, 2.0]), np.array([True, True, True])) == (2.0, True)
