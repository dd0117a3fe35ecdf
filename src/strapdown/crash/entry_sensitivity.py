"""How the state at fixes depends on the state at the anchor, on sensor errors and on noise.

Error is truth minus estimate. With phi about local level axes (``C_true = exp([phi x]) C``), f the
specific force, e the errors that the sensors add, it grows by

``phi' = -C e_g``, ``v' = phi x C f - C e_f``, ``p' = v``,

and is integrated backward from the anchor. What is left out, the Earth's and the transport rate
and the change of gravity, is a share of ``2 w t + (g/R) t²``: 2e-3 over 10 s, 1e-2 over a minute.
It concerns the standard deviations alone: the estimate itself solves the full equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.triad_uncertainty import TriadUncertainty

Array = NDArray[np.float64]

# Noise between two fixes is taken as impulses that are no farther apart than this, s.
PIECE = 0.25


@dataclass(frozen=True, eq=False)
class Course:
    """A run as the sensitivities need it, at n stamps that end at the anchor.

    Attributes
    ----------
    time : ndarray, (n,), s
    C_nb : ndarray, (n, 3, 3)
    rate, force : ndarray, (n, 3), rad/s, m/s²
        Free of the biases that were found so far.
    """

    time: Array
    C_nb: Array
    rate: Array
    force: Array


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Unknown constants of the two triads beyond their biases, as linear maps.

    Attributes
    ----------
    gyro, accel : ndarray, (n, 3, q)
        What unit parameters add to the rate and the specific force at each stamp.
    sd : ndarray, (q,)
    """

    gyro: Array
    accel: Array
    sd: Array


def sensor_errors(gyro: TriadUncertainty, accel: TriadUncertainty, course: Course) -> SensorErrors:
    """Collect scale, misalignment and g-sensitivity, where they are not zero."""
    n = len(course.time)
    columns: list[tuple[int, int, Array, float]] = []
    for triad, (spec, felt) in enumerate(((gyro, course.rate), (accel, course.force))):
        scale, tilted, g_felt = (
            spec.axis(name) for name in ("scale", "misalignment", "g_sensitivity")
        )
        for i in range(3):
            columns.append((triad, i, felt[:, i], scale[i]))
            columns += [(triad, i, felt[:, j], tilted[i]) for j in range(3) if j != i]
            if triad == 0:
                columns += [(triad, i, course.force[:, j], g_felt[i]) for j in range(3)]
    columns = [c for c in columns if c[3] > 0.0]
    maps = np.zeros((2, n, 3, len(columns)))
    for k, (triad, axis, values, _) in enumerate(columns):
        maps[triad, :, axis, k] = values
    return SensorErrors(maps[0], maps[1], np.array([c[3] for c in columns]))


def at_fixes(course: Course, errors: SensorErrors, instants: Array) -> Array:
    """Derivatives of position, velocity and attitude at instants.

    Parameters
    ----------
    course : Course
    errors : SensorErrors
        Of q parameters.
    instants : ndarray, (m,), s

    Returns
    -------
    ndarray, (m, 9, 15 + q)
        By the 15 states of `EntryState.covariance` at the anchor, and by the parameters.
    """
    n, q = len(course.time), len(errors.sd)
    pushed = np.einsum("nij,nj->ni", course.C_nb, course.force)
    phi = np.zeros((n, 3, 15 + q))
    phi[:, :, 9:12] = -course.C_nb
    phi[:, :, 15:] = -course.C_nb @ errors.gyro
    phi = back_integral(course.time, phi)
    phi[:, :, 6:9] += np.eye(3)
    v = -skew(pushed) @ phi
    v[:, :, 12:15] -= course.C_nb
    v[:, :, 15:] -= course.C_nb @ errors.accel
    v = back_integral(course.time, v)
    v[:, :, 3:6] += np.eye(3)
    p = back_integral(course.time, v)
    p[:, :, 0:3] += np.eye(3)
    return between(course.time, np.concatenate([p, v, phi], axis=1), instants)


def noise_at_fixes(
    course: Course, gyro: TriadUncertainty, accel: TriadUncertainty, instants: Array
) -> Array:
    """What the noise of the sensors between fix and anchor does to the state at the fixes.

    Returns
    -------
    ndarray, (m, 9, k)
        By k independent numbers of unit variance: six for each piece of the record.
    """
    time = course.time
    edges = np.unique(np.append(instants, time[-1]))
    pieces = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / PIECE))) + 1)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
    if not pieces:
        return np.zeros((len(instants), 9, 0))
    edges = np.unique(np.concatenate(pieces))
    lasted, middle = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    near = np.clip(np.searchsorted(time, middle), 0, len(time) - 1)
    pushed = np.einsum("nij,nj->ni", course.C_nb, course.force)
    gained = back_integral(time, pushed)
    moved = back_integral(time, gained)
    root = np.sqrt(lasted)[:, None, None]
    turn = course.C_nb[near] * np.array(gyro.axis("noise_density")) * root
    push = course.C_nb[near] * np.array(accel.axis("noise_density")) * root
    after = (middle[None, :] > instants[:, None])[..., None, None]
    since = (middle[None, :] - instants[:, None])[..., None]
    v_s, v_t = between(time, gained, middle)[None], between(time, gained, instants)[:, None]
    s_s, s_t = between(time, moved, middle)[None], between(time, moved, instants)[:, None]
    out = np.zeros((len(instants), len(middle), 9, 6))
    out[..., 0:3, 0:3] = -skew(v_s * since - (s_s - s_t)) @ turn
    out[..., 0:3, 3:6] = -since[..., None] * push
    out[..., 3:6, 0:3] = skew(v_s - v_t) @ turn
    out[..., 3:6, 3:6] = push
    out[..., 6:9, 0:3] = turn
    out *= after
    return out.transpose(0, 2, 1, 3).reshape(len(instants), 9, -1)


def back_integral(time: Array, values: Array) -> Array:
    """Minus the integral from each stamp to the last, by trapezoids."""
    dt = np.diff(time).reshape((-1,) + (1,) * (values.ndim - 1))
    out = np.zeros_like(values)
    np.cumsum(0.5 * dt * (values[1:] + values[:-1]), axis=0, out=out[1:])
    out -= out[-1].copy()
    return out


def between(time: Array, values: Array, instants: Array) -> Array:
    """Values at instants by straight lines between the stamps."""
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    share = (instants - time[after - 1]) / (time[after] - time[after - 1])
    share = share.reshape((-1,) + (1,) * (values.ndim - 1))
    return np.asarray(values[after - 1] * (1.0 - share) + values[after] * share)


def skew(v: Array) -> Array:
    """Matrices of the cross product with vectors, (..., 3, 3)."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out
