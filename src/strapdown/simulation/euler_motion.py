"""Attitude, body rate and angular acceleration of a motion that is given by its 3-2-1 angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation

Array = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]


def euler_attitude(angles: Array, q_nb: Quaternion) -> Array:
    """Attitude of a body that has turned by 3-2-1 angles from an initial attitude.

    Parameters
    ----------
    angles : ndarray, (n, 3), deg
        Roll, pitch, heading, relative to the initial attitude; any number of turns, through
        pitch ±90 deg too: nothing is divided here.
    q_nb : tuple of float
        Initial attitude, scalar first.

    Returns
    -------
    ndarray, (n, 4)
        ``q_nb Rz(heading) Ry(pitch) Rx(roll)``, continuous in sign. Whole turns leave the
        attitude to the last bit, apart from that sign.
    """
    # 360 deg fit in no binary fraction of pi, but they can be taken away without any rounding.
    turns = np.rint(angles / 360.0)
    q = rotation.compose(
        np.asarray(q_nb, dtype=np.float64), rotation.quaternion_from_euler(angles - 360.0 * turns)
    )
    odd = turns.sum(axis=1) % 2.0 == 1.0
    return np.where(odd[:, None], -q, q)


def euler_body_rate(angles: Array, rates: Array) -> Array:
    """Body rate from the rates of the 3-2-1 angles.

    Parameters
    ----------
    angles : ndarray, (n, 3), deg
        Roll, pitch, heading.
    rates : ndarray, (n, 3), deg/s
        Their derivatives.

    Returns
    -------
    ndarray, (n, 3), rad/s
        Exactly zero where all three rates are.

    Notes
    -----
    ``ω = [φ' - ψ' sin θ, θ' cos φ + ψ' sin φ cos θ, ψ' cos φ cos θ - θ' sin φ]``, of which
    Alexiev (2021), Eqs. (8)-(10), are the inverse. It holds at every pitch.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    across = d_heading * np.cos(pitch)
    return np.column_stack(
        [
            d_roll - d_heading * np.sin(pitch),
            d_pitch * np.cos(roll) + across * np.sin(roll),
            across * np.cos(roll) - d_pitch * np.sin(roll),
        ]
    )


def euler_body_acceleration(angles: Array, rates: Array, accelerations: Array) -> Array:
    """Derivative by time of the body rate, from that of the rates of the 3-2-1 angles.

    Parameters
    ----------
    angles : ndarray, (n, 3), deg
        Roll, pitch, heading.
    rates, accelerations : ndarray, (n, 3), deg/s and deg/s²
        Their first and second derivatives.

    Returns
    -------
    ndarray, (n, 3), rad/s²
        Of the components of `euler_body_rate` in body axes, at every pitch; exactly zero where
        all derivatives are.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    dd_roll, dd_pitch, dd_heading = np.radians(accelerations).T
    sin, cos, steep, flat = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    across = dd_heading * flat - d_heading * d_pitch * steep
    # The y and z axes roll within the plane that these two span.
    along_y, along_z = dd_pitch + d_roll * d_heading * flat, across - d_roll * d_pitch
    return np.column_stack(
        [
            dd_roll - dd_heading * steep - d_heading * d_pitch * flat,
            along_y * cos + along_z * sin,
            along_z * cos - along_y * sin,
        ]
    )
