"""What one sample costs an attitude algorithm, counted on its own kernel."""

from __future__ import annotations

from collections import Counter

import numpy as np

from strapdown._kernels.arithmetic import Counted, counted_kernels
from strapdown.attitude.algorithm import AttitudeAlgorithm
from strapdown.constants import CORTEX_M4F_CYCLES
from strapdown.results import Cost

# Whole blocks of 1, 2, 3 and 4 increments.
_STEPS = 12
# An everyday step: 0.01 rad, 60 deg/s at 100 Hz; below 0.5 rad no path depends on it.
_TURN = 0.01


def count_operations(algorithm: AttitudeAlgorithm) -> Cost:
    """Count what an algorithm does with one sample.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm

    Returns
    -------
    Cost
        Of the step from an increment to the attitude in the algorithm's own numbers, without
        forming the increment (the trapezoid adds 3 additions, 3 multiplications) and without
        reading angles from the result. Averaged over 12 samples, which are whole blocks. The
        cycles weigh the operations as `constants.CORTEX_M4F_CYCLES` does.
    """
    kernel = type(algorithm).advance_kernel
    home = kernel.py_func.__module__.rpartition(".")[2]
    name = kernel.py_func.__name__.removesuffix("_advance")
    step = getattr(counted_kernels()[home], f"{name}_step")
    count: Counter[str] = Counter()
    begun = algorithm.begin(np.array([1.0, 0.0, 0.0, 0.0]))
    state = [Counted(value, count) for value in begun]
    options = algorithm.kernel_options()
    for k in range(_STEPS):
        turn = [_TURN * np.cos(k + j) for j in range(3)]
        change = [0.1 * _TURN * np.sin(k + j) for j in range(3)]
        step(state, *(Counted(v, count) for v in (0.01, *turn, *change)), *options)
    per_sample = {key: count[key] / _STEPS for key in CORTEX_M4F_CYCLES}
    return Cost(
        algorithm=algorithm.label,
        **per_sample,
        cycles=sum(per_sample[key] * weight for key, weight in CORTEX_M4F_CYCLES.items()),
        memory=len(begun),
    )
