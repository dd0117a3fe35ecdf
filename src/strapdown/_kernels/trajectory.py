"""Histories of navigation as rows of a Trajectory table."""

from __future__ import annotations

from numba import njit

from strapdown._kernels.rotation import DEGREES, euler_degrees_from_quat, wrap_pi


@njit(cache=True)
def trajectory_rows(history, out):
    """Latitude, longitude in deg, height, velocity, roll, pitch and heading in deg."""
    for k in range(history.shape[0]):
        out[k, 0], out[k, 1] = history[k, 0] * DEGREES, wrap_pi(history[k, 1]) * DEGREES
        for j in range(2, 6):
            out[k, j] = history[k, j]
        out[k, 6], out[k, 7], out[k, 8] = euler_degrees_from_quat(
            history[k, 6], history[k, 7], history[k, 8], history[k, 9]
        )
