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

from strapdown.dsp.running_integral import running_integral
from strapdown.rotation import cross_matrix
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
    v = -cross_matrix(pushed) @ phi
    v[:, :, 12:15] -= course.C_nb
    v[:, :, 15:] -= course.C_nb @ errors.accel
    v = back_integral(course.time, v)
    v[:, :, 3:6] += np.eye(3)
    p = back_integral(course.time, v)
    p[:, :, 0:3] += np.eye(3)
    return between(course.time, np.concatenate([p, v, phi], axis=1), instants)


def noise_between_fixes(
    course: Course, gyro: TriadUncertainty, accel: TriadUncertainty, instants: Array
) -> tuple[Array, Array]:
    """What the noise of the sensors does to position, velocity and attitude, backward.

    Parameters
    ----------
    course : Course
    gyro, accel : TriadUncertainty
    instants : ndarray, (m,), s
        Falling, from the end of the course on.

    Returns
    -------
    carry : ndarray, (m, 9, 9)
        From the error at the instant before, in this order, to that at each; of the first from
        the anchor.
    driven : ndarray, (m, 9, 9)
        Covariance of what the noise adds on the way; as impulses in the middle of pieces.
    """
    pushed = np.einsum("nij,nj->ni", course.C_nb, course.force)
    gained = back_integral(course.time, pushed)
    moved = back_integral(course.time, gained)

    def effect(s: Array, t: Array) -> tuple[Array, Array]:
        """Of an attitude error at s on velocity and position at t before it."""
        v_s, v_t = between(course.time, gained, s), between(course.time, gained, t)
        s_s, s_t = between(course.time, moved, s), between(course.time, moved, t)
        return cross_matrix(v_s - v_t), -cross_matrix(v_s * (s - t)[:, None] - (s_s - s_t))

    before = np.concatenate([course.time[-1:], instants[:-1]])
    carry = np.zeros((len(instants), 9, 9))
    carry[:] = np.eye(9)
    carry[:, 3:6, 6:9], carry[:, 0:3, 6:9] = effect(before, instants)
    carry[:, 0:3, 3:6] = -(before - instants)[:, None, None] * np.eye(3)

    count = np.maximum(1, np.ceil((before - instants) / PIECE).astype(np.int64))
    which = np.repeat(np.arange(len(instants)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    lasted = ((before - instants) / count)[which]
    middle = instants[which] + (place + 0.5) * lasted
    near = np.clip(np.searchsorted(course.time, middle), 0, len(course.time) - 1)
    root = np.sqrt(lasted)[:, None, None]
    turn = course.C_nb[near] * np.array(gyro.axis("noise_density")) * root
    push = course.C_nb[near] * np.array(accel.axis("noise_density")) * root
    by_v, by_p = effect(middle, instants[which])
    shift = np.zeros((len(which), 9, 6))
    shift[:, 0:3, 0:3] = by_p @ turn
    shift[:, 0:3, 3:6] = -(middle - instants[which])[:, None, None] * push
    shift[:, 3:6, 0:3] = by_v @ turn
    shift[:, 3:6, 3:6] = push
    shift[:, 6:9, 0:3] = turn
    driven = np.zeros((len(instants), 9, 9))
    np.add.at(driven, which, shift @ shift.transpose(0, 2, 1))
    return carry, driven


def back_integral(time: Array, values: Array) -> Array:
    """Minus the integral from each stamp to the last, by trapezoids."""
    out = running_integral(time, values)
    out -= out[-1].copy()
    return out


def between(time: Array, values: Array, instants: Array) -> Array:
    """Values at instants by straight lines between the stamps."""
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    share = (instants - time[after - 1]) / (time[after] - time[after - 1])
    share = share.reshape((-1,) + (1,) * (values.ndim - 1))
    return np.asarray(values[after - 1] * (1.0 - share) + values[after] * share)
