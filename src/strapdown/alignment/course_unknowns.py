"""What the least squares of a drive look for, in the order of their columns."""

from __future__ import annotations

from typing import Final

import numpy as np

__all__ = [
    "ACCEL",
    "ACCEL_MATRIX",
    "ACCEL_NOISE",
    "ASKED",
    "AXLE",
    "COUNT",
    "GYRO",
    "GYRO_BY_FORCE",
    "GYRO_MATRIX",
    "GYRO_NOISE",
    "HANDED",
    "OFFSET",
    "OF_ACCELS",
    "OF_GYROS",
    "OF_SENSORS",
    "STRETCHES",
    "TURN",
    "VELOCITY",
    "YAW",
]

#: Stretches of a record with a noise of their own: what white noise adds is known at their ends.
STRETCHES: Final = 24

# At the end of the record: velocity, rotation by which the true attitude is off the computed one,
# biases of gyros and accelerometers.
VELOCITY, TURN, GYRO, ACCEL = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
ASKED: Final = 12
# Errors of gyros in proportion to rates and to forces, of accelerometers in proportion to forces,
# elements (i, j) of axis i by input j; and of both in each stretch alone, (stretch, axis).
GYRO_MATRIX, GYRO_BY_FORCE = slice(12, 21), slice(21, 30)
GYRO_NOISE = slice(30, 30 + 3 * STRETCHES)
ACCEL_MATRIX = slice(GYRO_NOISE.stop, GYRO_NOISE.stop + 9)
ACCEL_NOISE = slice(ACCEL_MATRIX.stop, ACCEL_MATRIX.stop + 3 * STRETCHES)
# Of the heading less the course; how far the unit is ahead of the axle; of the stamps of the fixes.
YAW: Final = ACCEL_NOISE.stop
AXLE: Final = YAW + 1
OFFSET: Final = YAW + 2
COUNT: Final = YAW + 3

#: In the order of `DriveSums.by_gyro` and `DriveSums.by_accel`.
OF_GYROS = np.r_[GYRO, GYRO_MATRIX, GYRO_BY_FORCE, GYRO_NOISE]
OF_ACCELS = np.r_[ACCEL, ACCEL_MATRIX, ACCEL_NOISE]
OF_SENSORS = slice(GYRO.start, ACCEL_NOISE.stop)
#: What is known beyond the record: all but its own noise, and what is of the vehicle and the fixes.
HANDED = np.r_[:ASKED, GYRO_MATRIX, GYRO_BY_FORCE, ACCEL_MATRIX]
