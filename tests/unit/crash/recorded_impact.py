"""Car-to-car crashes as a laboratory records them: planar impacts of cars that fold and ring.

The impulse is of `planar_impact`, so that momentum, closing speed, restitution and energy are
exact; the pulse, the yaw and the structure between the points are of `folding_crash`. Sensors,
positions and mountings err as the proposed case states, masses and headings as the answers do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from tests.unit.crash import planar_impact
from tests.unit.crash.folding_crash import Crash, G
from tests.unit.crash.two_vehicles import (
    CENTER,
    ENGINE,
    HEAD,
    LEFT,
    RIGHT,
    SILL,
    channels_of,
    record_of,
)

from strapdown import rotation
from strapdown.formats.crash_record import CrashRecord

TIME = np.arange(-1000, 3000) / 10_000.0
# What the proposed case assumes of a laboratory: scale factor, misalignment and mounting, tape.
SCALE, TURNED, POSITION_SD = 0.01, math.radians(math.hypot(1.0, 1.0)), 0.02
NOISE, GYRO_NOISE, GYRO_SCALE = 1.0, 0.005, 0.01
MASS_SD, HEADING_SD, SPEED_SD, CONTACT_SD = 0.01, 1.5, 0.1 / 3.6, 0.1
#: Yaw until the end of the contact by kind, deg: what a person states where no gyro says it.
TURNS = {"head-on": 5.0, "offset": 10.0, "rear-end": 5.0, "side": 10.0, "sideswipe": 8.0}
POINTS = ((LEFT, RIGHT, CENTER, ENGINE, HEAD), (LEFT, SILL, CENTER, ENGINE))


@dataclass(frozen=True)
class RecordedImpact:
    """A drawn impact, its record in a layout, and what only a person knows of it.

    `crashes`: the exact motions. `answers`: of each vehicle, keys of its case and their values; a
    position by the name of its point.
    """

    impact: planar_impact.Impact
    crashes: tuple[Crash, ...]
    record: CrashRecord
    answers: tuple[dict[str, object], ...]


def recorded_impact(
    kind: str, number: int, layout: str, *, gyros: bool = True, fault: str = ""
) -> RecordedImpact:
    """Draw an impact of a kind, with its record in the codes of ``nhtsa`` or ``mme``.

    `fault`: of the record of the first vehicle, ``sign`` (forward) or ``scale`` (of 2); or the
    records of the vehicles ``swapped``.
    """
    rng = np.random.default_rng([23, number, list(planar_impact.KINDS).index(kind)])
    impact = planar_impact.draw(rng, kind, guided=True)
    crashes = []
    for i, true in enumerate(impact.exact):
        rates = [[0.0, 0.0, math.radians(x[0])] for x in (true.rate, true.rate_change)]
        turn = np.radians([20.0, 20.0, 10.0 * TURNS[kind]])
        crashes.append(Crash.of(1000 * i + number, true.delta_v, rates, true.duration, turn))
    channels, vehicles, answers = [], {}, []
    for i, true in enumerate(impact.exact):
        name, crash = str(i + 1), crashes[1 - i if fault == "swapped" else i]
        positions = {}
        for at in POINTS[i]:
            positions[at.words] = at.position + POSITION_SD * rng.normal(size=3)
            force, rate = felt(crash, at, rng)
            if i == 0 and fault:
                force *= {"sign": [-1.0, 1.0, 1.0], "scale": 2.0}.get(fault, 1.0)
            channels += channels_of(at, name, name, layout, ("acceleration", TIME, force))
            if gyros and at is CENTER:
                channels += channels_of(at, name, name, layout, ("rate", TIME, rate))
        vehicles[name] = {
            "vehicle": f"Car {'AB'[i]}",
            "mass_kg": f"{true.mass[0] * (1.0 + MASS_SD * rng.normal()):.0f}",
            "length_m": "4.5",
            "width_m": "1.8",
            "speed_m_per_s": f"{max(true.entry[0] + SPEED_SD * rng.normal(), 0.0):.4f}",
        }
        contact = np.asarray(true.contact[:2]) + CONTACT_SD * rng.normal(size=2)
        answers.append(
            {
                "position_m": {k: [round(x, 3) for x in v.tolist()] for k, v in positions.items()},
                "heading_deg": round(true.heading_deg[0] + HEADING_SD * rng.normal(), 2),
                "heading_sd_deg": HEADING_SD,
                "mass_sd_kg": round(MASS_SD * true.mass[0], 1),
                "contact_m": [round(x, 3) for x in contact.tolist()],
                "contact_sd_m": CONTACT_SD,
                "turn_sd_deg": [2.0, 2.0, TURNS[kind]],
                "because": "film from above",
            }
        )
    record = record_of(f"Car to car, {kind}", layout, channels, vehicles)
    return RecordedImpact(impact, tuple(crashes), record, tuple(answers))


def felt(crash, at, rng):
    """Force and rates of a point along its axes, zeroed before the impact, (n, 3)."""
    force, rates = crash.motion(TIME)
    place = np.asarray(at.position)
    spin = np.gradient(rates, TIME, axis=0)
    force = force + np.cross(spin, place) + np.cross(rates, np.cross(rates, place))
    force = force + np.gradient(crash.structure(rng, TIME), TIME, axis=0)
    if at.body != "vehicle":
        # What moves by itself comes later and is hit harder.
        later = np.clip(TIME - 0.02, TIME[0], None)
        force = np.column_stack(
            [1.6 * np.interp(later, TIME, x) for x in (force + np.array([0.0, 0.0, G])).T]
        )
    C = rotation.dcm_from_rotation_vector(TURNED * rng.normal(size=3))
    force = (force @ C) * (1.0 + SCALE * rng.normal(size=3)) + NOISE * rng.normal(size=force.shape)
    rates = rates * (1.0 + GYRO_SCALE * rng.normal(size=3))
    rates = rates + GYRO_NOISE * rng.normal(size=rates.shape)
    return force - force[TIME < -0.001].mean(axis=0), rates - rates[TIME < -0.001].mean(axis=0)
