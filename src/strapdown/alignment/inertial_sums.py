"""Integrals of a record in the body axes of its first instant, for alignments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.constants import Indices
from strapdown.increments import motion_increments
from strapdown.tables import DV, MOTION, values_of
from strapdown.tables.checks import Array, index_of

# Nodes over which sensor errors are taken as constant: alignment depends on changes over a fifth of
# the record and more, and the weight of a node of a 240th is accurate to 1e-4.
NODES = 240
#: Velocity increments among the columns of MOTION.
STEP_DV = slice(MOTION.index(DV[0]), MOTION.index(DV[-1]) + 1)


@dataclass(frozen=True, eq=False)
class InertialSums:
    """Integrals of rotation and specific force, in body axes of the first sample, m nodes.

    These axes are fixed in inertial space; ``C`` rotates from the body to them.

    `start`, `length` (s): first stamp, and time to the last. `stamps` ((n,), s): from the first.
    `fallen` ((n, 3), m): second integral of the specific force at the stamps. `turned` ((n, 4)):
    ``C`` at the stamps, as quaternions. `dv` ((n - 1, 3), m/s): velocity increments of the steps,
    in the body axes at the begin of each. `node_length` ((m,), s). `node_velocity` ((m, 3), m/s):
    integral of the specific force over each node. `times` ((m, 3, 3), s): integral of ``C`` over
    each node. `turns`, `pushes` ((m, 3, 3, 3), rad and m/s): sums of ``C[:, i] phi[j]`` and
    ``C[:, i] dv[j]``, indices (node, component, i, j).
    """

    start: float
    length: float
    stamps: Array
    fallen: Array
    turned: Array
    dv: Array
    node_length: Array
    node_velocity: Array
    times: Array
    turns: Array
    pushes: Array

    @property
    def middles(self) -> Array:
        """Middle of each node from the first stamp, (m,), s."""
        return np.asarray(np.cumsum(self.node_length) - 0.5 * self.node_length)


def sum_inertially(imu: pd.DataFrame, ends: Indices | None = None) -> InertialSums:
    """Integrate an Imu table with specific force.

    `ends` ((m,)): samples at which nodes end, rising, above zero, the last one that of the record;
    equal parts of the time, if not given. DataError: as `increments.motion_increments`.
    """
    return sum_increments(index_of(imu), values_of(motion_increments(imu), MOTION), ends)


def sum_increments(time: Array, rows: Array, ends: Indices | None = None) -> InertialSums:
    """As `sum_inertially`, of the stamps and the rows of `increments.motion_increments`."""
    from strapdown._kernels.sums import inertial_sums

    stamps = time - time[0]
    n = len(rows)
    nodes = min(NODES, n)
    if ends is None:
        # Nodes end at the stamps nearest to equal parts of the time.
        edges = np.searchsorted(stamps[1:], stamps[-1] * np.arange(1, nodes + 1) / nodes)
        last = np.unique(np.minimum(edges, n - 1))
        last[-1] = n - 1
    else:
        last = np.ascontiguousarray(ends - 1)
    m = len(last)
    turned, fallen = np.empty((n + 1, 4)), np.empty((n + 1, 3))
    velocity = np.empty((m, 3))
    times, turns, pushes = np.zeros((m, 3, 3)), np.zeros((m, 3, 3, 3)), np.zeros((m, 3, 3, 3))
    inertial_sums(rows, last, turned, fallen, velocity, times, turns, pushes)
    ends = stamps[last + 1]
    return InertialSums(
        float(time[0]),
        float(stamps[-1]),
        stamps,
        fallen,
        turned,
        np.ascontiguousarray(rows[:, STEP_DV]),
        np.diff(ends, prepend=0.0),
        np.diff(velocity, axis=0, prepend=np.zeros((1, 3))),
        times,
        turns,
        pushes,
    )


def moments(stamps: Array, values: Array, degrees: int) -> Array:
    """Coefficients of a record in Legendre polynomials over its length.

    `stamps` ((n,), s): from zero to the length. `values` ((n, k)). Returns (degrees, k), the unit
    of `values`: degree zero first.
    """
    from strapdown._kernels.sums import legendre_moments

    out = np.empty((degrees, values.shape[1]))
    u = 2.0 * stamps / stamps[-1] - 1.0
    legendre_moments(u, np.ascontiguousarray(values), out)
    return out
