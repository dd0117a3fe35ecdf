"""Gyro and accelerometer among columns without names, by the motion of a body.

The specific force of a body that turns, and is not shaken, turns against it: df/dt = -w x f. Of all
triads of neighboring columns, the gyro and the accelerometer of one unit fulfil it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Most columns and samples that are compared; samples of one change of the force: of seconds, in
#: which a hand turns it more than it shakes it, at 10 to 200 Hz.
MOST_COLUMNS, MOST_SAMPLES, SPANS = 64, 6000, (25, 100, 200)
#: Fewest changes that are compared.
FEWEST = 8
#: Least share of the changes that a gyro explains, and how far below the best the first may be.
LEAST, NEAR = 0.8, 0.1
#: Largest spread of the norm of a force, as a share of it, and its least turn in all, rad.
LOOSEST, TURNED = 0.5, 0.05


def rates_and_force(columns: list[NDArray[np.generic]]) -> tuple[int, int] | None:
    """Return the numbers, from 0, of the first columns of the gyro and of the accelerometer.

    `columns` ((n,) each): a column that is no number is None of a triad. None where no pair of
    triads explains the motion.
    """
    held = [_numbers(c) for c in columns[:MOST_COLUMNS]]
    triads: dict[int, Array] = {}
    for k in range(len(held) - 2):
        three = [c for c in held[k : k + 3] if c is not None]
        if len(three) == 3:
            triads[k] = np.column_stack(three)
    forces = {k: f for k, f in triads.items() if _may_be_force(f)}
    shares: dict[tuple[int, int], float] = {}
    for at, force in forces.items():
        for k, rate in triads.items():
            if abs(k - at) >= 3:
                turned = -np.cross(rate, force)
                shares[k, at] = max(_explained(turned, force, span) for span in SPANS)
    best = max(shares.values(), default=0.0)
    if best < LEAST:
        return None
    return min(pair for pair, share in shares.items() if share > best - NEAR)


def _explained(turned: Array, force: Array, span: int) -> float:
    """Return the share of a force's changes that its turning explains, by one positive factor.

    `turned` ((n, 3)): -w x f; the step of time, and the unit of the rates, are in the factor.
    """
    change = force[span::span] - force[:-span:span]
    if len(change) < FEWEST or _turn(change, force) < TURNED:
        return 0.0
    model = turned[: len(change) * span].reshape(len(change), span, 3).sum(axis=1)
    size, both = float((model * model).sum()), float((model * change).sum())
    return both * both / (size * float((change * change).sum())) if size > 0.0 < both else 0.0


def _turn(change: Array, force: Array) -> float:
    return float(np.linalg.norm(change, axis=1).sum()) / float(np.abs(force).max())


def _numbers(column: NDArray[np.generic]) -> Array | None:
    """Return the first values of a column that is a number and not constant; None otherwise."""
    if column.dtype.kind not in "iuf" or column.size < FEWEST * SPANS[0]:
        return None
    values = np.asarray(column[:MOST_SAMPLES], dtype=np.float64)
    return values if bool(np.isfinite(values).all()) and np.ptp(values) > 0.0 else None


def _may_be_force(three: Array) -> bool:
    norms = np.linalg.norm(three, axis=1)
    low, usual, high = np.quantile(norms, (0.1, 0.5, 0.9))
    return bool(usual > 0.0 and (high - low) < LOOSEST * usual)
