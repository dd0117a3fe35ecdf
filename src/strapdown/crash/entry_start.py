"""Where to begin the search for an entry state."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.entry_estimate import Fixes
from strapdown.crash.entry_priors import EntryPriors
from strapdown.crash.entry_sensitivity import between
from strapdown.ellipsoids import WGS84
from strapdown.errors import Finding
from strapdown.evaluation.control_points import rigid_fit
from strapdown.frames import geodetic_from_ned, place_difference
from strapdown.mechanization import NavigationRun
from strapdown.nav_state import NavState

Array = NDArray[np.float64]

# Slower, the direction of travel is noise.
LEAST_SPEED = 1.0  # m/s
# So many of the last fixes tell the velocity to begin with.
_LAST = 5
# Changes of velocity of which the direction means something, m/s.
_LEAST_CHANGE = 0.5
# Guesses nearer than this lead to the same end, deg.
_SAME = 30.0


def first_guesses(
    turned: NavigationRun, fixes: Fixes, priors: EntryPriors
) -> tuple[list[NavState], list[Finding]]:
    """Guess place and velocity from the last fixes, and one heading or two.

    Parameters
    ----------
    turned : NavigationRun
        From a stand, level and north, up to the anchor.
    fixes : Fixes
        Those that are believed.
    priors : EntryPriors

    Returns
    -------
    guesses : list of NavState
        Heading as the priors have it; or the direction of travel; and that for which the
        changes of velocity by the sensors agree best with those of the fixes, where it is another.
    findings : list of Finding
    """
    velocity = _velocities(fixes)
    late = np.median(velocity[-_LAST:], axis=0)
    end = float(turned.time[-1])
    ahead = late * (end - fixes.instants[-1])
    place = geodetic_from_ned(ahead, fixes.place[-1])
    speed = math.hypot(late[0], late[1])
    findings = []
    headings: list[float] = []
    if priors.heading_deg is not None:
        headings = [priors.heading_deg]
    else:
        if speed >= LEAST_SPEED:
            headings.append(math.degrees(math.atan2(late[1], late[0])))
        by_change = _heading_by_changes(turned, fixes.instants, velocity)
        if by_change is not None and not any(_near(by_change, h) for h in headings):
            headings.append(by_change)
        if speed < LEAST_SPEED:
            findings.append(
                Finding("crash.fixes-before-anchor-say-too", quantity="heading", speed=speed)
            )
    guesses = [
        NavState.from_degrees(
            *place.tolist(),
            v_n=late,
            roll_deg=priors.roll_deg,
            pitch_deg=priors.pitch_deg,
            heading_deg=h % 360.0,
            time=end,
        )
        for h in (headings or [0.0])
    ]
    return guesses, findings


def _velocities(fixes: Fixes) -> Array:
    """Of each fix; from its neighbours' places where it was not measured."""
    told = np.isfinite(fixes.sd[:, 3:])
    if told.all():
        return fixes.velocity
    moved = place_difference(fixes.place, fixes.place[0], ellipsoid=WGS84)
    return np.where(told, fixes.velocity, np.gradient(moved, fixes.instants, axis=0))


def _heading_by_changes(turned: NavigationRun, instants: Array, velocity: Array) -> float | None:
    """Heading at the end, deg, from changes of the level velocity; None where there are none."""
    felt = between(turned.time, turned.history[:, 3:5], instants)
    felt = felt - felt.mean(axis=0)
    seen = velocity[:, :2] - velocity[:, :2].mean(axis=0)
    if min(float(np.sqrt((x * x).sum(axis=1).mean())) for x in (felt, seen)) < _LEAST_CHANGE:
        return None
    begun, _ = rigid_fit(felt, seen)
    return math.degrees(begun) + float(rotation.euler_from_quaternion(turned.history[-1, 6:10])[2])


def _near(a: float, b: float) -> bool:
    return bool(np.abs(rotation.within_half_turn(np.array(a - b))) < _SAME)
