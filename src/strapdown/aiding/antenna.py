"""How an antenna moves by what a navigator knows, and how that depends on the navigator's errors.

With the arm r of the antenna in level axes, ``W = C_lb w_ib - w_ie`` the rate of the body relative
to the Earth and f the specific force, relative to the Earth

    place        p + r
    velocity     v + W x r
    acceleration f + g - 2 w_ie x v + W x (W x r)

Gravity g has the centrifugal part in it. The turn of the rate, ``W' x r``, is not known and not in
the acceleration, nor how g changes with the place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.level import AXIS
from strapdown.aiding.point_velocity import turn_of_body
from strapdown.aiding.view import DISPLACEMENT, ROTATION, VELOCITY, View
from strapdown.earth import gravity
from strapdown.estimation.error_model import PHYSICAL
from strapdown.rotation import cross_matrix

__all__ = ["Moving", "arm_of", "moving"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moving:
    """A vector of the antenna in level axes, and how it depends on the physical errors.

    Attributes
    ----------
    value : ndarray, (3,)
    H : ndarray, (3, p)
        Its error by the physical errors, to first order.
    """

    value: Array
    H: Array

    def after(self, other: Moving, time: float) -> Moving:
        """Return this with `time` times the other added."""
        return Moving(self.value + time * other.value, self.H + time * other.H)


def arm_of(view: View, name: str, assumed: Array) -> Array:
    """Return an arm in body axes, (3,), m, less what a filter has found of its error."""
    return assumed - view.estimate(name) if view.has(name) else assumed


def moving(view: View, arm: Array, arm_name: str) -> tuple[Moving, Moving, Moving]:
    """Return how the antenna is and moves.

    Parameters
    ----------
    view : View
    arm : ndarray, (3,), m
        Body axes, less the estimate of its error.
    arm_name : str
        Of the block of states of its error; there may be none.

    Returns
    -------
    place : Moving, m
        The value is the arm: what it is beyond the place of the body. H has the place's error, too.
    velocity : Moving, m/s
        Relative to the Earth.
    acceleration : Moving, m/s²
    """
    C = view.C_lb
    r = C @ arm
    spin = view.ellipsoid.rotation_rate * view.level[AXIS : AXIS + 3]
    turn, of_turn = turn_of_body(view)
    W = C @ turn
    arm_at = view.place(arm_name) if view.has(arm_name) else None
    across, turning = cross_matrix(r), cross_matrix(W)

    d_arm = np.zeros((3, view.columns))
    d_arm[:, ROTATION] = -across
    if arm_at is not None:
        d_arm[:, arm_at] = C
    d_W = C @ of_turn
    d_W[:, ROTATION] -= turning

    swept = turning @ r
    d_swept = turning @ d_arm - across @ d_W
    place = Moving(r, d_arm + _at(DISPLACEMENT, view.columns))
    velocity = Moving(view.velocity + swept, d_swept + _at(VELOCITY, view.columns))

    rate, felt = _steady(view)
    force = C @ felt
    W = C @ rate - spin
    turning = cross_matrix(W)
    swept = turning @ r
    d_swept = turning @ d_arm - across @ d_W
    here = view.here
    g = gravity(math.degrees(here.lat), here.alt, ellipsoid=view.ellipsoid)
    value = force + view.C_ln @ g - 2.0 * np.cross(spin, view.velocity) + turning @ swept
    d_acc = turning @ d_swept - cross_matrix(swept) @ d_W
    d_acc[:, ROTATION] -= cross_matrix(force)
    d_acc[:, VELOCITY] -= 2.0 * cross_matrix(spin)
    d_acc[:, PHYSICAL:] += C @ _of_accel(view)
    return place, velocity, Moving(value, d_acc)


def _at(where: slice, columns: int) -> Array:
    out = np.zeros((3, columns))
    out[:, where] = np.eye(3)
    return out


def _steady(view: View) -> tuple[Array, Array]:
    """Rate and force without the shaking, where it is known, and without the estimated errors."""
    if view.steady is None:
        return view.rate, view.force
    stacked = view.model.stacked
    felt = np.concatenate([[1.0], view.steady])
    return (
        view.steady[:3] - np.tensordot(felt, stacked.gyro, 1) @ view.sensors,
        view.steady[3:] - np.tensordot(felt, stacked.accel, 1) @ view.sensors,
    )


def _of_accel(view: View) -> Array:
    """Errors of the force by the states of the sensors, (3, k), body axes."""
    felt = np.concatenate([[1.0], view.rate, view.force])
    return np.tensordot(felt, view.model.stacked.accel, 1)
