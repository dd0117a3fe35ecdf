"""Axes of a magnetometer against accelerometers: simulated truth, and bounds that hold."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import beta
from tests.calibrated import (
    DEG,
    GRAVITY,
    POSES,
    about_vertical,
    between,
    facing,
    in_accel_axes,
    moved_by_hand,
    record,
    turned,
    unit,
)

import strapdown as sd
from strapdown import rotation
from strapdown.formats import csv
from strapdown.sensors.calibration import SensorCalibration
from strapdown.sensors.magnetometer import ROTATION_PRIOR, SHAPES, calibrate_by_poses

#: Field, µT: 63° of dip, in a frame with z up; noise of a reading; change from pose to pose.
FIELD = 48.0 * np.array([math.cos(63.0 * DEG), 0.0, -math.sin(63.0 * DEG)])
NOISE, ROOM = 0.3, 0.15
#: What accelerometers leave of the direction of up: bias beside gravity, alike in all poses.
UP_SD = 1e-3


def moved(draw, count):
    """A motion by hand through poses in any heading: stamps, attitudes, ups and rows of rests."""
    order = draw.permutation(16)[:count]
    poses = [turned(facing(POSES[k]), draw, 8.0 * DEG) for k in order]
    poses = [about_vertical(C, draw.uniform(-math.pi, math.pi)) for C in poses]
    t, w, f, C_nb = moved_by_hand(poses[0], between(poses), draw, rest=2.0)
    rate = np.linalg.norm(w, axis=1)
    rows, begin = [], None
    for k, still in enumerate(np.r_[rate < 2.0 * DEG, False]):
        if still and begin is None:
            begin = k
        if not still and begin is not None:
            if k - begin > 150:
                rows.append(slice(begin, k))
            begin = None
    return t, w, f, C_nb, rows


def read_by(draw, C_nb, rows, turn, kind="pose", room=ROOM):
    """Readings of a magnetometer that is turned by `turn` against the axes of the attitudes.

    And hard and soft iron. `kind`: the field of a pose lasts until the next one (``pose``), or
    until the middle between them (``step``), or changes steadily between them (``ramp``); along
    all axes alike or only north (``north``), with a few large changes (``heavy``: Student's with
    three degrees), in two places only (``places``); or changes within poses, too (``walk``).
    """
    n = len(C_nb)
    change = room * draw.standard_normal((len(rows), 3))
    if kind == "heavy":
        change = room * draw.standard_t(3, (len(rows), 3)) / math.sqrt(3.0)
    if kind == "north":
        change = change * [math.sqrt(3.0), 0.0, 0.0]
    if kind == "places":
        change = change[:2][draw.integers(0, 2, len(rows))]
    if kind == "ramp":
        at = np.ravel([(one.start, one.stop) for one in rows])
        columns = np.repeat(change, 2, axis=0).T
        field = FIELD + np.column_stack([np.interp(np.arange(n), at, c) for c in columns])
    else:
        begins = [one.start for one in rows]
        if kind == "step":
            begins = [0] + [(a.stop + b.start) // 2 for a, b in pairwise(rows)]
        at = np.searchsorted(begins, np.arange(n), "right") - 1
        field = FIELD + np.where(at[:, None] >= 0, change[at], 0.0)
    if kind == "walk":
        field = field + room * math.sqrt(0.02) * lfilter(
            [1.0], [1.0, -0.99], draw.standard_normal((n, 3)), axis=0
        )
    iron = np.eye(3) + 0.03 * _symmetric(draw)
    body = np.einsum("nji,nj->ni", C_nb, field)
    hard_iron = 15.0 * draw.standard_normal(3)
    read = body @ turn @ np.linalg.inv(iron) + hard_iron
    return read + NOISE * draw.standard_normal(read.shape), hard_iron, iron


def _gain(triad):
    return (1.0 + np.array(triad.scale))[:, None] * (np.eye(3) + np.array(triad.misalignment))


def _symmetric(draw):
    m = draw.standard_normal((3, 3))
    m = 0.5 * (m + m.T)
    return m - np.trace(m) / 3.0 * np.eye(3)


def aligned(seed, turn=None, count=12, kind="pose"):
    """Errors of hard iron, soft iron along its shapes, and rotation, rad; and the calibration."""
    draw = np.random.default_rng(seed)
    if turn is None:
        turn = rotation.dcm_from_rotation_vector(0.7 * ROTATION_PRIOR * draw.standard_normal(3))
    _, _, _, C_nb, rows = moved(draw, count)
    read, hard_iron, iron = read_by(draw, C_nb, rows, turn, kind)
    up = np.array([C_nb[r, 2, :].mean(axis=0) for r in rows])
    up /= np.linalg.norm(up, axis=1)[:, None]
    J = (np.eye(3) - up[:, :, None] * up[:, None, :]).reshape(-1, 3)
    up = up + (J @ (UP_SD * draw.standard_normal(3))).reshape(-1, 3)
    up /= np.linalg.norm(up, axis=1)[:, None]
    # Odd numbers are rests, even ones the motions between them.
    edges = np.ravel([(r.start, r.stop) for r in rows])
    stretch = np.searchsorted(edges, np.arange(len(read)), "right")
    rests = list(range(1, 2 * len(rows), 2))
    found = calibrate_by_poses(read, stretch, rests, up, UP_SD**2 * J @ J.T)
    shape = np.linalg.lstsq(SHAPES.reshape(5, 9).T, (found.soft_iron - iron).ravel(), rcond=None)
    turned_by = rotation.rotation_vector_from_dcm(found.rotation @ turn.T)
    return np.r_[found.hard_iron - hard_iron, shape[0], turned_by], found


def sd_of(found):
    """Standard deviations in the same order."""
    return np.r_[np.sqrt(np.diag(found.covariance)), found.rotation_sd]


def test_a_rotation_is_found_and_bounded():
    error, found = aligned(1)
    assert (found.rotation_sd < 0.3 * ROTATION_PRIOR).all()
    assert np.abs(error / sd_of(found)).max() < 3.5
    # Iron alone leaves it.
    plain = replace(found, rotation=np.eye(3))
    turn = rotation.rotation_vector_from_dcm(found.rotation)
    assert np.linalg.norm(turn) > 2.0 * np.linalg.norm(error[8:])
    one = np.array([20.0, -10.0, 30.0])
    assert found.apply(one) == pytest.approx(found.rotation @ plain.apply(one))


def test_swapped_axes_are_found():
    """As of the AK8963 in an MPU-9250: x and y change places, z has the other sign."""
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    error, found = aligned(2, turn=swap)
    assert np.abs(error / sd_of(found))[8:].max() < 3.5
    assert (found.rotation_sd < 0.3 * ROTATION_PRIOR).all()


def test_few_rests_leave_it_open():
    _, found = aligned(3, count=4)
    assert np.isinf(found.rotation_sd).all()
    assert found.rotation == pytest.approx(np.eye(3))


def test_more_samples_of_a_rest_do_not_make_it_surer():
    """The field of a pose is wrong by as much, however often it is read."""
    draw = np.random.default_rng(5)
    C_nb = np.array([about_vertical(facing(up), draw.uniform(-3.0, 3.0)) for up in POSES])
    field = FIELD + 0.3 * draw.standard_normal((16, 3))
    means = np.einsum("nji,nj->ni", C_nb, field)
    sds = []
    for count in (10, 1000):
        mag = np.repeat(means, count, axis=0) + NOISE * draw.standard_normal((16 * count, 3))
        stretch = np.repeat(np.arange(16), count)
        found = calibrate_by_poses(mag, stretch, list(range(16)), C_nb[:, 2, :], 1e-10 * np.eye(48))
        sds.append(found.rotation_sd)
    # A tenth, if samples were independent; noise of the mean of ten adds 5 % (0.1² beside 0.3²).
    assert sds[1] == pytest.approx(sds[0], rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pose", "step", "ramp", "walk", "heavy", "places", "north"])
def test_bounds_of_two_hundred_magnetometers(kind):
    """Of each number the 99 % interval of the coverage (Clopper and Pearson) reaches 95 %.

    Where the fields of poses are as they are modeled (``pose``) it contains 95 % for hard iron and
    axes; bounds of soft iron are somewhat wide (97.8 % of 1000). Fields that change along one axis
    alone, within poses as much as between them, or by a jump in the middle of each motion, are not
    as modeled: there 90 %, which the manual says; of the jump for the axes alone.
    """
    least = 0.9 if kind in ("north", "walk", "step") else 0.95
    inside, sds = [], []
    for seed in range(20_000, 20_200):
        error, found = aligned(seed, count=10 + seed % 7, kind=kind)
        inside.append(np.abs(error) < 1.96 * sd_of(found))
        sds.append(found.rotation_sd)
    assert np.median(sds) < 0.3 * ROTATION_PRIOR
    counts = np.sum(inside, axis=0).tolist()
    for k, count in enumerate(counts):
        if kind != "step" or k >= 8:
            assert beta.ppf(0.995, count + 1, 200 - count) >= least, (kind, k, count)
        if kind == "pose" and not 3 <= k < 8:
            assert beta.ppf(0.005, count, 201 - count) <= 0.95, (k, count)


def test_from_a_log_to_the_flag(tmp_path):
    """`calibrate` finds it beside gyros and accelerometers; the same flag takes it off."""
    draw, errors = np.random.default_rng(7), unit(4)
    turn = rotation.dcm_from_rotation_vector(np.array([0.05, -0.03, 0.06]))
    t, w, f, C_nb, rows = moved(draw, 14)
    made = record(t, w, f, errors, 4)
    read, _, _ = read_by(draw, C_nb, rows, turn)
    names = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    names += [f"mag_{a}_uT" for a in "xyz"]
    values = [t, *made.imu.to_numpy().T, *read.T]
    header = {"axes": "forward-right-down", "sampling": "instantaneous"}
    csv.write(tmp_path / "log.csv", dict(zip(names, values, strict=True)), header)
    run = sd.calibrate(tmp_path / "log.csv", gravity_m_per_s2=GRAVITY)
    mag = run.magnetometer
    # The axes are those of the accelerometers, which lie in the case as their misalignment has it.
    K, own = (_gain(e.accel) for e in (errors, in_accel_axes(errors)))
    expected = np.linalg.solve(K, own).T @ turn
    error = rotation.rotation_vector_from_dcm(mag.rotation @ expected.T)
    assert np.abs(error / mag.rotation_sd).max() < 4.0
    run.save(tmp_path / "out", report=False)
    known = SensorCalibration.read(tmp_path / "out" / "calibration.toml").magnetometer
    assert known.rotation == pytest.approx(mag.rotation, abs=1e-8)
    imu = sd.read_imu(tmp_path / "log.csv", calibration=tmp_path / "out" / "calibration.toml")
    dips = []
    for one in rows:
        part = imu.iloc[one].mean()
        up, h = part[["accel_x", "accel_y", "accel_z"]], part[["mag_x", "mag_y", "mag_z"]]
        dips.append(up.to_numpy() @ h.to_numpy() / np.linalg.norm(up) / np.linalg.norm(h))
    # The dip is the same in all poses: 63°, of axes 5° apart within some tenths.
    assert np.std(np.degrees(np.arcsin(dips))) < 0.5
    assert np.degrees(np.arcsin(np.mean(dips))) == pytest.approx(-63.0, abs=0.6)
