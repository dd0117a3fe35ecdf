"""Angle, velocity and position increments from samples of angular rate and specific force."""

from strapdown.increments.angle import increments_from_imu
from strapdown.increments.motion import (
    IncrementStream,
    MotionAccuracy,
    imu_from_increments,
    motion_accuracy,
    motion_increments,
)

__all__ = [
    "IncrementStream",
    "MotionAccuracy",
    "imu_from_increments",
    "increments_from_imu",
    "motion_accuracy",
    "motion_increments",
]
