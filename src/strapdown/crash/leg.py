"""Integration segment of a record, forward or backward from the entry of a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.crash_errors import grow_errors, grow_noise
from strapdown._kernels.earth import RATE
from strapdown._kernels.ned import ROW, Q, V, reverse_increments
from strapdown.crash.unit_effects import SampleEffects
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.tables import MOTION

Array = NDArray[np.float64]

# Columns of an error: rotation vector in level, velocity, position.
ATTITUDE, VELOCITY, PLACE = slice(0, 3), slice(3, 6), slice(6, 9)


@dataclass(frozen=True, eq=False)
class IntegrationSegment:
    """Increments of a segment, the effects of the unknowns on them, and the resulting states.

    A backward segment is a motion of its own, with opposite velocity on an Earth that rotates the
    other way; `errors`, `noise_covariance` and values read from `nominal` are reversed by the
    code that joins the segments.

    Attributes
    ----------
    backward : bool
    time : ndarray, (k + 1,), s
        In the order of integration.
    state : ndarray
        Kernel state at the start.
    rows : ndarray, (k, 10)
        Motion increments.
    nominal : ndarray, (k + 1, 10)
        States of the kernel.
    effects : ndarray, (p, 6, k)
        Effect of one standard deviation of each unknown on angle and velocity of each step.
    noise_sd : ndarray, (6, k)
    earth, options : ndarray
        Kernel arguments.
    """

    backward: bool
    time: Array
    state: Array
    rows: Array
    nominal: Array
    effects: Array
    noise_sd: Array
    earth: Array
    options: Array

    def errors(self, start: Array) -> Array:
        """Propagate the errors of the unknowns from (p, 9) at the start to (p, k + 1, 9)."""
        out = np.empty((len(start), len(self.time), 9))
        theta = self.effects[:, :3].transpose(0, 2, 1)
        # An error of the rotation vector rotates the end of the step by this.
        theta = theta + 0.5 * np.cross(self.rows[:, 1:4], theta)
        grow_errors(
            self._attitude(),
            self.rows,
            self._met(start),
            np.ascontiguousarray(theta.transpose(0, 2, 1)),
            np.ascontiguousarray(self.effects[:, 3:]),
            out,
        )
        return self._met(out)

    def noise_covariance(self) -> Array:
        """Covariance from the noise of the steps, (k + 1, 9, 9)."""
        out = np.empty((len(self.time), 9, 9))
        grow_noise(
            self._attitude(),
            self.rows,
            self.noise_sd[:3].copy(),
            self.noise_sd[3:].copy(),
            np.zeros((9, 9)),
            out,
        )
        if self.backward:
            out[:, VELOCITY] *= -1.0
            out[:, :, VELOCITY] *= -1.0
        return out

    def _attitude(self) -> Array:
        return np.ascontiguousarray(rotation.dcm_from_quaternion(self.nominal[:-1, Q : Q + 4]))

    def _met(self, errors: Array) -> Array:
        """Errors in the order of integration from those of the motion, or the reverse."""
        if not self.backward:
            return np.ascontiguousarray(errors)
        met = errors.copy()
        met[..., VELOCITY] *= -1.0
        return met


def make_leg(
    mechanization: NorthEastDown,
    start: NavState,
    imu: pd.DataFrame,
    effects: SampleEffects,
    rows: slice,
    *,
    backward: bool,
) -> IntegrationSegment:
    """Cut a segment out of a record and navigate it.

    Parameters
    ----------
    mechanization : NorthEastDown
    start : NavState
        At the first sample of `rows`, or at the last where the segment runs backward.
    imu : DataFrame
        Imu table at the reference point.
    effects : SampleEffects
        On the same samples.
    rows : slice
        Samples of the segment, at least one; one sample is a segment without a step.
    backward : bool

    Raises
    ------
    DivergenceError
        The path left the range of the mechanization.
    """
    part = imu.iloc[rows]
    part.attrs = dict(imu.attrs)
    mean = imu.attrs.get("sampling") == "mean"
    time = part.index.to_numpy(dtype=np.float64)
    state = mechanization.begin(start)
    earth = find_ellipsoid(mechanization.ellipsoid).parameters()
    steps = len(time) - 1
    increments = np.empty((steps, len(MOTION)))
    if steps:
        increments[:] = motion_increments(part)[MOTION].to_numpy(dtype=np.float64)
    theta = _over_steps(effects.rate[:, rows], time, mean)
    force = _over_steps(effects.force[:, rows], time, mean)
    dv = increments[:, 4:7]
    # Half of the rotation precedes the middle of the velocity increment.
    force = force + 0.5 * np.cross(theta, dv)
    # A sample has the same noise in the step before it: over steps it adds up as if each step
    # had the noise of one sample alone.
    noise = np.concatenate([effects.rate_noise[rows], effects.force_noise[rows]], axis=1)
    noise = noise[1:] * np.diff(time)[:, None]
    if backward:
        increments, theta, force, noise = _reversed(increments, theta, force, noise)
        earth[RATE] *= -1.0
        state[V : V + 3] *= -1.0
        time = time[::-1].copy()
    nominal = np.empty((steps + 1, ROW))
    nominal[0] = state[:ROW]
    own = state.copy()
    made, _ = mechanization.advance_rows(own, increments, np.empty(0), earth, nominal[1:])
    if made < steps:
        raise DivergenceError(
            "crash.path-leaves-vehicle-can-do",
            file=imu.attrs.get("source"),
            quantity="path",
            time=time[made],
        )
    return IntegrationSegment(
        backward,
        time,
        state,
        increments,
        nominal,
        np.ascontiguousarray(np.concatenate([theta, force], axis=2).transpose(0, 2, 1)),
        np.ascontiguousarray(noise.T),
        earth,
        mechanization.kernel_options(),
    )


def _over_steps(values: Array, time: Array, mean: bool) -> Array:
    """Integrate (p, n, 3) samples over the n - 1 steps between them."""
    dt = np.diff(time)[:, None]
    if mean:
        return np.asarray(values[:, 1:] * dt)
    return np.asarray(0.5 * (values[:, 1:] + values[:, :-1]) * dt)


def _reversed(
    increments: Array, theta: Array, force: Array, noise: Array
) -> tuple[Array, Array, Array, Array]:
    """As `reverse_increments`, including the effects on the steps."""
    out = np.empty_like(increments)
    reverse_increments(increments, out)
    if not len(increments):
        return out, theta, force, noise
    back = rotation.dcm_from_rotation_vector(-increments[:, 1:4])
    felt = np.einsum("kij,pkj->pki", back, force)
    felt -= np.cross(theta, np.einsum("kij,kj->ki", back, increments[:, 4:7]))
    return out, -theta[:, ::-1], felt[:, ::-1], noise[::-1]
