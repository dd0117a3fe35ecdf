"""Simulated units of an inertial sensor, and the procedures by which a hand calibrates them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from strapdown import rotation
from strapdown.ellipsoids import WGS84
from strapdown.sensors.calibration import (
    CalibrationConditions,
    CalibrationRecord,
    KnownRotation,
    calibrate_imu,
)
from strapdown.sensors.calibration_model import PRIOR
from strapdown.sensors.error_chain import apply
from strapdown.sensors.rest import find_rests
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors, matrix_of, triad_of
from strapdown.sensors.uncertainty import draw_errors
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.imu import imu_of_columns

DEG = math.pi / 180.0
GRAVITY, GRAVITY_SD, LATITUDE, RATE = 9.8123, 5e-4, 48.0 * DEG, 100.0
FACES = ((0, 0, 1), (1, 0, 0), (0, 0, -1), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
EDGES = ((1, 1, 0), (0, 1, 1), (1, 0, 1), (-1, 1, 0), (0, -1, 1), (1, 0, -1), (-1, -1, 0))
POSES = (*FACES, *EDGES, (0, -1, -1), (-1, 0, -1), (1, -1, 0))


def unit(seed):
    """A consumer-grade unit, drawn from what is assumed before a calibration; its bias drifts."""
    gyro = draw_errors(replace(PRIOR.gyro, bias=2.0 * DEG, noise_density=0.007 * DEG), seed, 0)
    accel = draw_errors(replace(PRIOR.accel, noise_density=1.5e-3), seed, 1)
    return ImuErrors(
        replace(gyro, bias_instability=15.0 * DEG / 3600.0, correlation_time=200.0),
        replace(accel, bias_instability=4e-4, correlation_time=200.0),
    )


def facing(up):
    """Attitude, body to a frame with z up, in which a body direction is up."""
    v = np.array(up, dtype=np.float64) / np.linalg.norm(up)
    axis = np.cross(v, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    if size < 1e-9:
        return np.eye(3) if v[2] > 0.0 else np.diag([1.0, -1.0, -1.0])
    return rotation.dcm_from_rotation_vector(axis / size * math.atan2(size, v[2]))


def turned(C, draw, sd):
    """An attitude that is not quite the one that was meant."""
    return C @ rotation.dcm_from_rotation_vector(sd * draw.standard_normal(3))


def about_vertical(C, angle):
    return rotation.dcm_from_rotation_vector(np.array([0.0, 0.0, angle])) @ C


def by_hand(first, turns, draw, **options):
    """Stamps, rates of the inertial sensor, forces; as `moved_by_hand`."""
    return moved_by_hand(first, turns, draw, **options)[:3]


def moved_by_hand(first, turns, draw, *, rest=3.0, move=1.5, tremor=1.0):
    """Stamps, rates, forces, attitudes: rests between turns (rotation vectors).

    `tremor`: of a hand that keeps holding: 0.008 deg at 5 to 11 Hz, slow tilts of 0.05 deg, and
    0.02 m/s², each of several sines; zero for a sensor that lies.
    """
    attitudes, rates, C = [], [], first

    def stay():
        count = int(rest * RATE)
        attitudes.append(np.broadcast_to(C, (count, 3, 3)))
        rates.append(np.zeros((count, 3)))

    stay()
    for turn in turns:
        count = int(move * max(1.0, np.linalg.norm(turn) / 2.2) * RATE)
        s = np.arange(1, count + 1) / count
        angle = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
        rate = 30.0 * s**2 * (1.0 - s) ** 2 * RATE / count
        attitudes.append(C @ rotation.dcm_from_rotation_vector(angle[:, None] * turn))
        rates.append(rate[:, None] * turn)
        C = C @ rotation.dcm_from_rotation_vector(turn)
        stay()
    C_nb, w = np.concatenate(attitudes), np.concatenate(rates)
    t = np.arange(len(w)) / RATE
    shake, rate = sines(t, draw, ((4, 5.0, 11.0, 0.008 * DEG), (2, 0.05, 0.4, 0.05 * DEG)))
    shake, rate = tremor * shake, tremor * rate
    R = rotation.dcm_from_rotation_vector(shake)
    w = np.einsum("nji,nj->ni", R, w) + rate - 0.5 * np.cross(shake, rate)
    C_nb = C_nb @ R
    f = GRAVITY * C_nb[:, 2, :] + tremor * sines(t, draw, ((3, 5.0, 11.0, 0.02),))[0]
    earth = np.array([0.6 * math.cos(LATITUDE), 0.8 * math.cos(LATITUDE), math.sin(LATITUDE)])
    return t, w + WGS84.rotation_rate * np.einsum("nji,j->ni", C_nb, earth), f, C_nb


def sines(t, draw, kinds):
    """Sums of sines of each axis, and their derivatives: number, band in Hz, amplitude."""
    value, slope = np.zeros((2, t.size, 3))
    for axis in range(3):
        for count, low, high, size in kinds:
            for hz in draw.uniform(low, high, count):
                phase = 2.0 * math.pi * hz * t + draw.uniform(0.0, 2.0 * math.pi)
                value[:, axis] += size * np.sin(phase)
                slope[:, axis] += size * 2.0 * math.pi * hz * np.cos(phase)
    return value, slope


def record(t, w, f, errors, seed):
    """What the unit makes of a motion, and its rests."""
    gyro = apply(errors.gyro, t, w, seed=1000 + seed, specific_force=f)
    accel = apply(errors.accel, t, f, seed=5000 + seed)
    imu = imu_of_columns(t, np.hstack([gyro, accel]), [*GYRO, *ACCEL], sampling="instantaneous")
    return CalibrationRecord(imu, find_rests(imu))


def between(poses):
    """Rotation vectors from attitude to attitude."""
    return [rotation.rotation_vector_from_dcm(a.T @ b) for a, b in pairwise(poses)]


def positions(errors, seed, count=16):
    """Sixteen poses by hand, each within 8 deg, in a random order."""
    draw = np.random.default_rng(seed)
    order = draw.permutation(count)
    poses = [turned(facing(POSES[k]), draw, 8.0 * DEG) for k in order]
    poses = [about_vertical(C, draw.uniform(-2.0, 2.0)) for C in poses]
    return [record(*by_hand(poses[0], between(poses), draw), errors, seed)], [], {}


def six_position(errors, seed):
    """Each face up within 2 deg, of a case that is turned by 1 deg against its sensor."""
    draw = np.random.default_rng(seed)
    case = rotation.dcm_from_rotation_vector(DEG * draw.standard_normal(3))
    poses = [turned(facing(face) @ case, draw, 2.0 * DEG) for face in FACES]
    poses = [about_vertical(C, draw.uniform(-2.0, 2.0)) for C in poses]
    motion = by_hand(poses[0], between(poses), draw, rest=5.0)
    return [record(*motion, errors, seed)], [], {"pose_sd": 2.0 * DEG}


def turns(errors, seed):
    """A revolution to either side on a table, on three faces, each ending within 1 deg."""
    draw = np.random.default_rng(seed)
    moves, C, first = [], None, None
    for face in ((0, 0, 1), (1, 0, 0), (0, 1, 0)):
        pose = turned(facing(face), draw, DEG)
        if C is None:
            first = pose
        else:
            moves += between([C, pose])
        C = pose
        for side in (1.0, -1.0):
            move = side * (360.0 * DEG + DEG * draw.standard_normal()) * C[2]
            moves.append(move)
            C = C @ rotation.dcm_from_rotation_vector(move)
    motion = by_hand(first, moves, draw, move=1.0)
    known = [KnownRotation(angle=360.0 * DEG, sd=DEG)]
    return [record(*motion, errors, seed)], known, {}


def rate_table(errors, seed):
    """Six rates on each of three axes, 8 s each, on a table whose rates are 0.1 % wrong.

    The axis is 1 deg off the sensor's, and 3 cm away from it.
    """
    draw = np.random.default_rng(seed)
    wrong, records, known = 1.0 + 1e-3 * draw.standard_normal(), [], []
    for log, axis in enumerate((2, 0, 1)):
        others = [k for k in range(3) if k != axis]
        n, arm = np.eye(3)[axis], np.zeros(3)
        n[others] = DEG * draw.standard_normal(2)
        n /= np.linalg.norm(n)
        arm[others] = 0.03 * draw.standard_normal(2)
        w, f, start = [], [], 0.0
        for rate in (0.0, 20.0, -20.0, 60.0, -60.0, 120.0, -120.0, 0.0):
            turn, count = rate * DEG * wrong, int(8.0 * RATE)
            w += [turn * n + WGS84.rotation_rate * math.sin(LATITUDE) * n] * count
            f += [GRAVITY * n - turn**2 * arm] * count
            if rate:
                ends = {"start": start + 0.5, "end": start + 7.5}
                known.append(
                    KnownRotation(rate=rate * DEG, axis=axis, sd=0.02 * DEG, log=log, **ends)
                )
            start += 8.0
        t = np.arange(len(w)) / RATE
        made = record(t, np.array(w), np.array(f), errors, seed + 100_000 * log)
        rests = tuple(r for r in made.rests if r.end < 8.0 or r.start > 55.9)
        records.append(replace(made, rests=rests))
    return records, known, {}


def in_accel_axes(errors: ImuErrors) -> ImuErrors:
    """Errors in axes in which the misalignment of the accelerometers is symmetric.

    The readings are the same: a rotation of the body axes is moved from one matrix to the other.
    """
    accel = errors.accel or TriadErrors()
    A = np.eye(3) + np.asarray(accel.misalignment)
    G = np.eye(3) + np.asarray(errors.gyro.misalignment)
    scale_a, scale_g = (
        1.0 + np.array(accel.axis("scale")),
        1.0 + np.array(errors.gyro.axis("scale")),
    )
    K, W = scale_a[:, None] * A, scale_g[:, None] * G
    S = np.asarray(errors.gyro.g_sensitivity) * scale_g[:, None]
    for _ in range(20):
        own = K / np.diag(K)[:, None]
        skew = 0.5 * (own - own.T)
        turn = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        R = rotation.dcm_from_rotation_vector(-turn)
        K, W, S = K @ R, W @ R, S @ R
        if np.abs(turn).max() < 1e-15:
            break
    parts: list[dict[str, Any]] = []
    for matrix in (K, W):
        scale = np.diag(matrix)
        own = matrix / scale[:, None]
        np.fill_diagonal(own, 0.0)
        parts.append({"scale": triad_of(scale - 1.0), "misalignment": matrix_of(own)})
    sensitivity = matrix_of(S / np.diag(W)[:, None])
    return ImuErrors(
        replace(errors.gyro, g_sensitivity=sensitivity, **parts[1]), replace(accel, **parts[0])
    )


PROCEDURES = {
    "positions": positions,
    "six-position": six_position,
    "turns": turns,
    "rate-table": rate_table,
}


def calibrated(procedure, seed):
    """Errors of a calibration, estimated − true, beside their standard deviations."""
    errors = unit(seed)
    records, known, more = PROCEDURES[procedure](errors, seed + 77)
    draw = np.random.default_rng(seed + 31)
    gravity = GRAVITY + GRAVITY_SD * draw.standard_normal()
    conditions = CalibrationConditions(gravity, GRAVITY_SD, **more)
    found = calibrate_imu(records, known, conditions=conditions)
    return found, found.values - truth(errors, found, records, seed + 77)


def truth(errors, found, records, seed):
    """True errors in the axes of the accelerometers, with the mean of the drift over the rests."""
    own = in_accel_axes(errors)
    out = []
    for name in found.names:
        head, _, axis = name.rpartition("_")
        triad, _, quantity = head.partition("_")
        if head == "g_sensitivity":
            value = own.gyro.g_sensitivity
        else:
            value = getattr(getattr(own, triad), quantity)
        for letter in axis:
            value = value["xyz".index(letter)]
        out.append(value)
    means = np.zeros((2, 3))
    for k, (triad, base) in enumerate(((errors.gyro, 1000), (errors.accel, 5000))):
        parts = []
        drift = TriadErrors(
            bias_instability=triad.bias_instability, correlation_time=triad.correlation_time
        )
        for log, one in enumerate(records):
            t = one.imu.index.to_numpy()
            made = apply(drift, t, np.zeros((t.size, 3)), seed=base + seed + 100_000 * log)
            parts += [made[(t >= r.start) & (t <= r.end)].mean(axis=0) for r in one.rests]
        means[k] = np.mean(parts, axis=0)
    out = np.array(out)
    out[0:3] += means[1]
    out[9:12] += means[0]
    return out
