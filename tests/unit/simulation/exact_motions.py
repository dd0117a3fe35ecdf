"""Motions and their formulas in many digits, written apart from the code."""

from __future__ import annotations

import mpmath
import numpy as np

from strapdown.simulation import (
    Coning,
    Gesture,
    Handling,
    Pulse,
    PulseMotion,
    SmoothRandom,
    Track,
    find_scenario,
)

SKEW = (0.5, -0.1, 0.7, 0.5)  # norm 1
MOTIONS = {
    name: find_scenario(name).motion
    for name in ("alexiev-fig6", "intensive", "gestures", "coning", "coning-slow")
} | {
    "coning about a skew axis": Coning(20.0, 2.0, 3.0, axis=(1.0, -2.0, 3.0), q_nb=SKEW),
    "gesture from a skew pose": Gesture(
        6.0,
        roll=Track((1.7, 2.3, 4.2), (10.0, -80.0, 370.0)),
        pitch=Track((1.7, 4.0), (-5.0, 85.0)),
        heading=Track((2.0, 3.0, 4.2), (200.0, -100.0, 200.0)),
        east=Track((1.6, 3.3, 4.0), (0.0, 0.5, 0.1)),
        q_nb=SKEW,
    ),
    "random": SmoothRandom(16.0, 5, 90.0, 0.7, band=(0.3, 1.5), q_nb=SKEW),
    "handling": Handling(40.0, 3),
    "pulses with edges": PulseMotion(
        (
            Pulse(0, 0.5, 3.0, 2.0, edge=0.75),
            Pulse(1, 1.0, 3.5, -1.5, edge=1.25),
            Pulse(2, 1.5, 4.5, 2.5, edge=1.0),
            Pulse(2, 4.5, 6.0, -1.0, edge=0.75),
        ),
        7.0,
        SKEW,
        (0.2, -0.1, 0.3),
    ),
}


def breaks(motion) -> np.ndarray:
    """Instants at which a third derivative jumps."""
    if isinstance(motion, Coning):
        inner = []
    elif isinstance(motion, SmoothRandom):
        ramps = (motion.rest, motion.rest + motion.ramp)
        inner = [*ramps, *(motion.duration - r for r in ramps)]
    elif isinstance(motion, PulseMotion):
        ends = ((p.start, p.start + p.edge, p.end - p.edge, p.end) for p in motion.pulses)
        inner = [t for one in ends for t in one]
    else:
        m = getattr(motion, "gestures", motion)
        tracks = (m.roll, m.pitch, m.heading, m.north, m.east, m.down)
        inner = [t for track in tracks for t in track.times]
    return np.unique([0.0, *(t for t in inner if 0.0 < t < motion.duration), motion.duration])


def clear_of(edges: np.ndarray, time: np.ndarray, by: float) -> np.ndarray:
    """Times that have no edge within a distance."""
    near = np.abs(time[:, None] - edges[None, :]).min(axis=1)
    return time[near > by]


def mp_turns(angles):
    """Rx, Ry, Rz of 3-2-1 angles in deg."""
    out = []
    for axis, angle in enumerate(angles):
        c, s = mpmath.cos(mpmath.radians(angle)), mpmath.sin(mpmath.radians(angle))
        matrix = mpmath.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        matrix[i, i] = matrix[j, j] = c
        matrix[i, j], matrix[j, i] = -s, s
        out.append(matrix)
    return out


def mp_matrix(angles):
    """C = Rz Ry Rx."""
    x, y, z = mp_turns(angles)
    return z * y * x


def mp_rate(angles, rates):
    """Each rate about its own axis, carried into the body; rad/s from deg and deg/s."""
    x, y, _ = mp_turns(angles)
    e = mpmath.eye(3)
    d = [mpmath.radians(r) for r in rates]
    total = e[:, 0] * d[0] + x.T * (e[:, 1] * d[1] + y.T * (e[:, 2] * d[2]))
    return [total[i] for i in range(3)]


def mp_quintic(x):
    x = min(max(x, mpmath.mpf(0)), mpmath.mpf(1))
    return 10 * x**3 - 15 * x**4 + 6 * x**5


def mp_track(track, t):
    """A track as a sum of steps of least jerk."""
    value = mpmath.mpf(track.values[0])
    for k in range(len(track.times) - 1):
        start, end = mpmath.mpf(track.times[k]), mpmath.mpf(track.times[k + 1])
        step = mpmath.mpf(track.values[k + 1]) - mpmath.mpf(track.values[k])
        value += step * mp_quintic((t - start) / (end - start))
    return value


def mp_random(motion, t):
    """Six coordinates of a smooth random motion, as cosines."""
    moving = mpmath.mpf(motion.duration) - 2 * mpmath.mpf(motion.rest)
    since = t - mpmath.mpf(motion.rest)
    first = int(np.ceil(motion.band[0] * float(moving) - 1e-9))
    last = int(np.floor(motion.band[1] * float(moving) + 1e-9))
    phase = np.random.Generator(np.random.PCG64(motion.seed)).random((last - first + 1, 6))
    window = mp_quintic(min(since, moving - since) / mpmath.mpf(motion.ramp))
    size = mpmath.sqrt(mpmath.mpf(2) / (3 * (last - first + 1)))
    out = []
    for column in range(6):
        total = mpmath.mpf(0)
        for k in range(first, last + 1):
            omega = 2 * mpmath.pi * k / moving
            weight = motion.rms_rate / omega if column < 3 else motion.rms_acceleration / omega**2
            angle = omega * since + 2 * mpmath.pi * mpmath.mpf(phase[k - first, column])
            total += weight * mpmath.cos(angle)
        out.append(window * size * total)
    return out


def mp_coordinates(motion, t):
    """Roll, pitch, heading in deg and north, east, down in m."""
    if isinstance(motion, SmoothRandom):
        return mp_random(motion, t)
    m = getattr(motion, "gestures", motion)
    tracks = (m.roll, m.pitch, m.heading, m.north, m.east, m.down)
    return [mp_track(track, t) for track in tracks]
