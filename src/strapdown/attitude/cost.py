"""What an algorithm costs on a processor: operations a step, and what it must remember."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import arithmetic
from strapdown.attitude.algorithm import AttitudeAlgorithm
from strapdown.constants import CORTEX_M4F_CYCLES
from strapdown.results.answer import Cost

STEPS = 12
TURN = 0.01


class _State(list[Any]):
    """A state that notes how far it was used."""

    used = 0

    def __getitem__(self, index: Any) -> Any:
        self.used = max(self.used, index + 1)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        self.used = max(self.used, index + 1)
        super().__setitem__(index, value)


def _counted_run(
    algorithm: AttitudeAlgorithm, lengths: Sequence[float] = (0.01,) * STEPS
) -> tuple[Counter[str], _State]:
    count: Counter[str] = Counter()

    def number(value: float) -> arithmetic.Counted:
        return arithmetic.Counted(value, count)

    home, name = step_kernel(algorithm)
    step = getattr(arithmetic.counted_kernels()[home], name)
    start = algorithm.begin(rotation.quaternion_from_euler([20.0, -35.0, 250.0]))
    state = _State(number(float(v)) for v in start)
    for k, dt in enumerate(lengths):
        # The axis turns a little from step to step, as it does in every motion.
        theta = (0.6 * TURN, (0.64 - 0.01 * k) * TURN, (0.48 + 0.01 * k) * TURN)
        dtheta = (0.0, -0.01 * TURN, 0.01 * TURN)
        numbers = [number(v) for v in (dt, *theta, *dtheta)]
        step(state, *numbers, *algorithm.kernel_options())
    return count, state


def step_kernel(algorithm: AttitudeAlgorithm) -> tuple[str, str]:
    """Return the module and the name of the kernel of one step."""
    kernel: Any = type(algorithm).advance_kernel
    home = kernel.py_func.__module__.rpartition(".")[2]
    return home, kernel.py_func.__name__.replace("_advance", "_step")


def operation_count(algorithm: AttitudeAlgorithm) -> dict[str, float]:
    """Count the floating-point operations of a step.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm

    Returns
    -------
    dict
        ``add`` (subtractions, too), ``multiply``, ``divide`` (remainders, too), ``sqrt`` and
        ``trig``, per step, the mean over 12 steps of 0.01 rad each. From increments of angle:
        what forms them from rates is the same for every algorithm. A sign, a comparison and
        a copy are free.
    """
    count, _ = _counted_run(algorithm)
    return {kind: count[kind] / STEPS for kind in CORTEX_M4F_CYCLES}


def memory(algorithm: AttitudeAlgorithm) -> int:
    """Return how many numbers an algorithm keeps from one step to the next."""
    return _counted_run(algorithm)[1].used


def count_cost(algorithm: AttitudeAlgorithm, dt: ArrayLike | None = None) -> Cost:
    """Count what one sample costs an algorithm.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    dt : array_like, (n,), s, optional
        Steps of the log that it is for: where they are unequal an algorithm may take another
        path. Those in its middle are counted with; equal ones, where none are given.

    Returns
    -------
    Cost
        Operations of `operation_count`, weighed as `constants.CORTEX_M4F_CYCLES` does, and the
        `memory`.
    """
    lengths = np.full(STEPS, 0.01) if dt is None else np.asarray(dt, dtype=np.float64)
    first = max(0, (len(lengths) - STEPS) // 2)
    middle = np.resize(lengths[first : first + STEPS], STEPS)
    count, state = _counted_run(algorithm, middle.tolist())
    operations = {kind: count[kind] / STEPS for kind in CORTEX_M4F_CYCLES}
    return Cost(
        algorithm=algorithm.label,
        **operations,
        cycles=sum(operations[kind] * weight for kind, weight in CORTEX_M4F_CYCLES.items()),
        memory=state.used,
    )
