"""Physical constants and unit factors, each with its source.

Units are converted to SI by multiplication: ``value_si = value * factor``.
"""

from __future__ import annotations

import math

__all__ = [
    "ACCEL_SUMS",
    "ACCEL_UNITS",
    "CORTEX_M4F_CYCLES",
    "DEG_PER_HOUR",
    "GYRO_SUMS",
    "GYRO_UNITS",
    "MAD_TO_SD",
    "MAG_UNITS",
    "MICRO_G",
    "STANDARD_GRAVITY",
    "TIME_UNITS",
    "TWO_SIDED_95",
]

#: Conventional standard acceleration of gravity, m/s² (3rd CGPM, 1901, Resolution 2).
STANDARD_GRAVITY = 9.80665

#: Factors from rad/s to deg/h and from m/s² to µg, for output.
DEG_PER_HOUR = math.degrees(3600.0)
MICRO_G = 1e6 / STANDARD_GRAVITY

#: 95 % of a normal distribution lie within this number of standard deviations.
TWO_SIDED_95 = 1.959963984540054

#: Standard deviation of a normal distribution over its median absolute deviation: one over the
#: quantile of 3/4.
MAD_TO_SD = 1.482602218505602

_DEGREE = math.pi / 180.0

#: Factors to rad/s.
GYRO_UNITS: dict[str, float] = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": _DEGREE,
    "mdeg/s": 1e-3 * _DEGREE,
    "deg/h": _DEGREE / 3600.0,
}

#: Factors to m/s².
ACCEL_UNITS: dict[str, float] = {
    "m/s2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    # Sensors that report gravity instead of specific force, as iOS does.
    "-m/s2": -1.0,
    "-g": -STANDARD_GRAVITY,
}

#: Factors to rad and to m/s, of the increments of sensors that sum over each sample.
GYRO_SUMS: dict[str, float] = {"rad": 1.0, "deg": _DEGREE}
ACCEL_SUMS: dict[str, float] = {"m/s": 1.0, "g*s": STANDARD_GRAVITY}

#: Factors to µT.
MAG_UNITS: dict[str, float] = {
    "uT": 1.0,
    "nT": 1e-3,
    "gauss": 100.0,
    "mG": 0.1,
    "T": 1e6,
}

#: Factors to s.
TIME_UNITS: dict[str, float] = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
}

#: Cycles of one operation on floats on a Cortex-M4F: add, multiply, divide and root from Arm
#: DDI 0439 (Cortex-M4 Technical Reference Manual), FPU instruction timing. Trigonometric
#: functions depend on the library: 60 to 100 are usual, and 80 is assumed.
CORTEX_M4F_CYCLES: dict[str, float] = {
    "add": 1.0,
    "multiply": 1.0,
    "divide": 14.0,
    "sqrt": 14.0,
    "trig": 80.0,
}
