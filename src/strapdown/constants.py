"""Physical constants, each with its source, and the types of arrays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
Triple = tuple[float, float, float]

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
