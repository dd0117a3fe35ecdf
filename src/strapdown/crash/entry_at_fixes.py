"""The state of a run at the instants of fixes, and the side slip there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.entry_priors import EntryPriors
from strapdown.crash.entry_sensitivity import Course, between
from strapdown.ellipsoids import find_ellipsoid
from strapdown.evaluation.trajectory_at import trajectory_at
from strapdown.mechanization import NavigationRun
from strapdown.tables import EULER, GEODETIC, VELOCITY

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AtFixes:
    """The vehicle's point at the instants of the fixes."""

    place: Array
    velocity: Array
    acceleration: Array
    q_nb: Array
    rate: Array


def state_at_fixes(run: NavigationRun, course: Course, instants: Array, late: float) -> AtFixes:
    """Between two samples: place by Hermite's cubic, velocity and attitude by their rates."""
    # Instants must increase there.
    there = trajectory_at(
        run.trajectory, instants[::-1], find_ellipsoid(run.mechanization.ellipsoid)
    )[::-1]
    pushed = np.gradient(run.history[:, 3:6], run.time, axis=0)
    return AtFixes(
        there[GEODETIC].to_numpy(dtype=np.float64),
        there[VELOCITY].to_numpy(dtype=np.float64),
        between(run.time, pushed, instants),
        rotation.quaternion_from_euler(there[EULER].to_numpy(dtype=np.float64)),
        between(course.time, course.rate, instants + late),
    )


def side_slips(now: AtFixes, priors: EntryPriors) -> Array:
    """Side-slip angle at the point that does not slip, (m,), rad."""
    v = _point_velocity(now, priors)
    return np.asarray(np.arctan2(v[:, 1], v[:, 0]))


def _point_velocity(now: AtFixes, priors: EntryPriors) -> Array:
    own = rotation.rotate(rotation.conjugate(now.q_nb), now.velocity)
    return np.asarray(own + np.cross(now.rate, np.asarray(priors.no_slip_point)))


def by_state(now: AtFixes, C_nb: Array, priors: EntryPriors) -> Array:
    """Derivative of the side-slip angle by position, velocity and attitude, (m, 9)."""
    v = _point_velocity(now, priors)
    by_v = np.zeros((len(v), 1, 3))
    by_v[:, 0, 0], by_v[:, 0, 1] = -v[:, 1], v[:, 0]
    by_v /= (v[:, 0] ** 2 + v[:, 1] ** 2)[:, None, None]
    back = by_v @ C_nb.transpose(0, 2, 1)
    out = np.zeros((len(v), 9))
    out[:, 3:6] = back[:, 0]
    out[:, 6:9] = (back @ rotation.cross_matrix(now.velocity))[:, 0]
    return out
