"""Planar impacts of two vehicles by impulse at a point of contact, in steps, as exact truth.

Restitution along the normal, friction along the tangent, tire forces in proportion to the force of
contact. Everything that the closure computes in closed form is here summed over the steps of the
impulse: energy as the balance of kinetic energy and the work of the tires, the common velocity at
the step where the approach along the impulse ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from strapdown.crash.closure import ImpactVehicle

G = 9.80665
FRICTION = 0.7
# Azimuth of the normal (force on the first), headings, contact points forward and right of either
# center of mass, ranges of the speeds in m/s, friction between the vehicles.
KINDS = {
    "head-on": (180.0, (0.0, 180.0), ((2.0, 0.05), (2.0, -0.05)), ((10, 20), (10, 20)), 0.5),
    "offset": (180.0, (0.0, 180.0), ((2.0, -0.5), (2.0, -0.5)), ((10, 20), (10, 20)), 0.5),
    "rear-end": (180.0, (0.0, 3.0), ((2.0, 0.3), (-2.2, -0.3)), ((15, 22), (0, 6)), 0.5),
    "side": (180.0, (0.0, 90.0), ((2.0, -0.1), (0.4, 0.8)), ((12, 20), (4, 14)), 0.5),
    "sideswipe": (90.0, (-12.0, 168.0), ((1.5, -0.8), (1.5, -0.8)), ((15, 22), (15, 22)), 0.4),
}


@dataclass
class Impact:
    """One drawn impact: its truth, and what was measured of it."""

    truth: dict[str, float]
    exact: tuple[ImpactVehicle, ImpactVehicle]
    measured: tuple[ImpactVehicle, ImpactVehicle]
    share: tuple[float, float]


def turned(angle, vector):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def solve(mass, inertia, arms, velocity, rate, tires, normal, restitution, friction):
    """Impulse on the first; tires add their change of velocity to the centers of mass."""
    cross = [np.array([-r[1], r[0]]) for r in arms]
    before = [velocity[i] + rate[i] * cross[i] for i in (0, 1)]
    u = before[0] - before[1]
    compliance = sum(
        np.eye(2) / mass[i] + np.outer(cross[i], cross[i]) / inertia[i] for i in (0, 1)
    )
    outside = tires[0] - tires[1]
    tangent = np.array([-normal[1], normal[0]])
    # Sticking: no sliding at the end.
    frame = np.array([normal, tangent])
    wanted = np.array([-restitution * (u @ normal), 0.0])
    impulse = np.linalg.solve(frame @ compliance, wanted - frame @ (u + outside))
    along, across = impulse @ normal, impulse @ tangent
    if abs(across) > friction * along:
        ray = normal + math.copysign(friction, across) * tangent
        size = (wanted[0] - normal @ (u + outside)) / (normal @ compliance @ ray)
        impulse = size * ray
    return impulse


def draw(rng, kind, *, central=False, guided=False, restitution=None, road=FRICTION):
    """Draw an impact of a kind; `central`: without arms, friction, yaw and tire forces.

    `guided`: on the rails of a laboratory, which neither turn nor slip before the impact.
    """
    normal_deg, headings, contacts, speeds, friction = KINDS[kind]
    mass = rng.uniform(1000.0, 2200.0, 2)
    gyration = rng.uniform(1.2, 1.45, 2)
    heading = np.radians(np.array(headings) + rng.uniform(-5.0, 5.0, 2))
    duration = rng.uniform(0.08, 0.15)
    rate = np.radians(rng.uniform(-3.0, 3.0, 2))
    normal = turned(math.radians(normal_deg + rng.uniform(-4.0, 4.0)), [1.0, 0.0])
    contact = [np.array(c) + rng.uniform(-0.1, 0.1, 2) for c in contacts]
    if central:
        contact, rate, friction = [np.zeros(2), np.zeros(2)], np.zeros(2), 0.0
    arms = [turned(heading[i], contact[i]) for i in (0, 1)]
    entry = [np.array([rng.uniform(*speeds[i]), rng.uniform(-0.3, 0.3)]) for i in (0, 1)]
    if guided:
        rate, entry = np.zeros(2), [e * [1.0, 0.0] for e in entry]
    velocity = [turned(heading[i], entry[i]) for i in (0, 1)]
    limit = road * G * duration
    tires = []
    for _ in range(2):
        angle, size = rng.uniform(0, 2 * math.pi), limit * math.sqrt(rng.uniform())
        tires.append(np.zeros(2) if central else turned(angle, [size, 0.0]))
    e = rng.uniform(0.02, 0.35) if restitution is None else restitution
    inertia = mass * gyration**2
    impulse = solve(mass, inertia, arms, velocity, rate, tires, normal, e, friction)
    signs = (1.0, -1.0)
    # Steps of the impulse, from which the truth is read.
    part = np.linspace(0.0, 1.0, 4001)[:, None]
    p = impulse / np.linalg.norm(impulse)
    points, work, centres, rates = [], 0.0, [], []
    for i in (0, 1):
        gained = signs[i] * impulse / mass[i] + tires[i]
        path = velocity[i] + part * gained
        turn = signs[i] * (arms[i][0] * impulse[1] - arms[i][1] * impulse[0]) / inertia[i]
        spin = rate[i] + part * turn
        points.append(path + spin * np.array([-arms[i][1], arms[i][0]]))
        middle = 0.5 * (path[1:] + path[:-1])
        work += float((mass[i] * tires[i] * middle).sum() / (len(part) - 1))
        centres.append(path)
        rates.append(spin[:, 0])
    kinetic = [
        sum(
            0.5 * mass[i] * centres[i][k] @ centres[i][k] + 0.5 * inertia[i] * rates[i][k] ** 2
            for i in (0, 1)
        )
        for k in (0, -1)
    ]
    relative = (points[0] - points[1]) @ p
    end = float(np.interp(0.0, relative, part[:, 0]))
    # The balance of an elastic impact is zero but for rounding.
    energy = max(float(kinetic[0] + work - kinetic[1]), 0.0)
    true_share = rng.uniform(0.25, 0.75)
    truth = {
        "closing_speed": -float(relative[0]),
        "separation_speed": float(relative[-1]),
        "restitution": -float(relative[-1] / relative[0]),
        # Points of contact that slide on past each other never have a common velocity.
        "common_velocity": float(np.interp(end, part[:, 0], points[0] @ p))
        if relative[-1] > 0.0
        else math.nan,
        "energy": energy,
        "ees_1": math.sqrt(2 * true_share * energy / mass[0]),
        "ees_2": math.sqrt(2 * (1 - true_share) * energy / mass[1]),
        "mass_ratio": float(mass[1] / mass[0]),
        "relative_heading_deg": math.degrees(heading[1] - heading[0]),
        "direction_deg": math.degrees(math.atan2(p[1], p[0])) % 360.0,
    }
    share_sd = 0.04
    exact, measured = [], []
    for i in (0, 1):
        change = turned(-heading[i], centres[i][-1] - centres[i][0])
        fields = {
            "name": f"vehicle {i + 1}",
            "delta_v": [*change, 0.0],
            "covariance": np.diag([0.2, 0.25, 0.3]) ** 2,
            "duration": duration,
            "mass": (mass[i], 0.02 * mass[i]),
            "heading_deg": (math.degrees(heading[i]), 1.5),
            "entry": entry[i],
            "entry_covariance": np.diag([0.4, 0.2]) ** 2,
            "rate": (math.degrees(rate[i]), 0.5),
            "rate_change": (math.degrees(rates[i][-1] - rates[i][0]), 1.5),
            "contact": (*contact[i], 0.1),
        }
        exact.append(ImpactVehicle(**fields))
        seen = dict(fields)
        seen["delta_v"] = fields["delta_v"] + rng.normal(size=3) * [0.2, 0.25, 0.3]
        seen["entry"] = entry[i] + rng.normal(size=2) * [0.4, 0.2]
        seen["contact"] = (*(contact[i] + rng.normal(size=2) * 0.1), 0.1)
        for name in ("mass", "heading_deg", "rate", "rate_change"):
            value, sd = fields[name]
            seen[name] = (value + rng.normal() * sd, sd)
        measured.append(ImpactVehicle(**seen))
    share = min(max(true_share + rng.normal() * share_sd, 0.0), 1.0), share_sd
    return Impact(truth, tuple(exact), tuple(measured), share)
