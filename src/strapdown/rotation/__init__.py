"""Rotations as arrays: quaternion, direction cosine matrix, Euler angles, rotation vector.

Conventions, here and everywhere in strapdown:

* Quaternions are Hamilton's, scalar first, ``(..., 4)``; ``q_ab`` rotates a vector from frame
  ``b`` into frame ``a``: ``v_a = rotate(q_ab, v_b)``; ``q`` and ``-q`` are the same rotation.
* Matrices are ``(..., 3, 3)``: ``v_a = C_ab @ v_b``; neighboring letters cancel.
* Euler angles are ``(..., 3)``: roll, pitch, heading in degrees, 3-2-1:
  ``C_nb = Rz(heading) Ry(pitch) Rx(roll)``; heading in [0, 360), clockwise from north seen
  from above (north-east-down axes), roll in (-180, 180], pitch in [-90, 90].
* A rotation vector is ``(..., 3)`` in rad: rotation by its length about its direction.

Alexiev (2021) prints the elementary matrices (4)-(6) as rotations of the *frame*; with them
Eq. (3) must read ``C_nb = Cz^T Cy^T Cx^T``, which is the product above, and only this reading
agrees with his kinematics (8)-(10).
"""

from __future__ import annotations

from strapdown.rotation.euler_angles import (
    dcm_from_euler,
    euler_from_dcm,
    euler_from_quaternion,
    euler_from_rotation_vector,
    quaternion_from_euler,
    rotation_angle,
    rotation_vector_from_euler,
    within_half_turn,
)
from strapdown.rotation.matrices import cross_matrix, dcm_from_quaternion, quaternion_from_dcm
from strapdown.rotation.quaternions import compose, conjugate, normalise, rotate
from strapdown.rotation.rotation_vectors import (
    dcm_from_rotation_vector,
    quaternion_from_rotation_vector,
    rotation_vector_from_dcm,
    rotation_vector_from_quaternion,
)
from strapdown.rotation.scipy_rotations import from_scipy, to_scipy

__all__ = [
    "compose",
    "conjugate",
    "cross_matrix",
    "dcm_from_euler",
    "dcm_from_quaternion",
    "dcm_from_rotation_vector",
    "euler_from_dcm",
    "euler_from_quaternion",
    "euler_from_rotation_vector",
    "from_scipy",
    "normalise",
    "quaternion_from_dcm",
    "quaternion_from_euler",
    "quaternion_from_rotation_vector",
    "rotate",
    "rotation_angle",
    "rotation_vector_from_dcm",
    "rotation_vector_from_euler",
    "rotation_vector_from_quaternion",
    "to_scipy",
    "within_half_turn",
]
