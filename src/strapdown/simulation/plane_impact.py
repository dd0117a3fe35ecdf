"""Plane impact of a rigid vehicle: what a blow beside the centre of mass does."""

from __future__ import annotations

import math

from strapdown.simulation.crash_course import CrashCourse, Triple

#: Moment of inertia of a car in yaw over its mass, as for the paper's test, m².
YAW_GYRATION = 1.90


def blow(direction_deg: float, change: float) -> Triple:
    """Change of velocity in vehicle axes by a force that comes from a direction.

    Parameters
    ----------
    direction_deg : float, deg
        Principal direction of force: 0 from the front, positive clockwise.
    change : float, m/s

    Returns
    -------
    tuple of float, m/s
        Forward, right, down.
    """
    angle = math.radians(direction_deg)
    # What is only the rounding of pi is no component.
    parts = (-math.cos(angle), -math.sin(angle))
    ahead, right = (change * x if abs(x) > 1e-15 else 0.0 for x in parts)
    return ahead, right, 0.0


def velocity_change(
    closing_speed: float, arm: float, restitution: float, gyration_squared: float
) -> float:
    """Change of a vehicle's velocity in a plane impact against what does not yield.

    Parameters
    ----------
    closing_speed : float, m/s
        Of the centre of mass, along the force.
    arm : float, m
        Of the force about the centre of mass.
    restitution : float
        Speed of separation over speed of approach, at the contact and along the force.
    gyration_squared : float, m²
        Moment of inertia in yaw over mass.

    Returns
    -------
    float, m/s
        ``V0 (1 + e)/(1 + d²/k²)``.

    Notes
    -----
    An impulse P changes the velocity by P/m and the yaw rate by ``P d/(m k²)``, and so the speed
    of the contact along it by ``P/m (1 + d²/k²)``; restitution says that this is ``(1 + e) V0``.
    """
    return closing_speed * (1.0 + restitution) / (1.0 + arm * arm / gyration_squared)


def yaw_rate_change(change: float, arm: float, gyration_squared: float) -> float:
    """Change of the yaw rate that goes with one of velocity: ``dV d/k²``, in deg/s."""
    return math.degrees(change * arm / gyration_squared)


def strike(
    course: CrashCourse,
    direction_deg: float,
    change: float,
    arm: float,
    length: float,
    gyration_squared: float = YAW_GYRATION,
) -> Triple:
    """Lay down one blow with the yaw rate that its arm gives, and go on to its end.

    Parameters
    ----------
    course : CrashCourse
    direction_deg, change
        As `blow`.
    arm : float, m
        Of the force about the centre of mass; positive turns the vehicle to the right.
    length : float, s
    gyration_squared : float, m²

    Returns
    -------
    tuple of float, m/s
        The change of velocity: forward, right, down.
    """
    delta_v = blow(direction_deg, change)
    course.push(length, delta_v, (0.0, 0.0, yaw_rate_change(change, arm, gyration_squared)))
    course.time += length
    return delta_v
