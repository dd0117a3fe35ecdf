"""Simulated tests of two vehicles with several measuring points, as laboratories record them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.mounted_motion import MountedMotion

IMPACT = 0.1  # s on the clock of the motion
# Each stamp is the double nearest to its decimal, as a text file has it.
TIME = np.arange(-500, 2000) / 10_000.0


class At(NamedTuple):
    """A measuring point, with its codes in the dictionaries of NHTSA and of ISO MME."""

    position: tuple[float, float, float]
    nhtsa: str
    mme: str
    words: str
    body: str = "vehicle"


LEFT = At((-0.9, -0.5, 0.1), "FLLR", "0CRMELERE00", "left rear floorpan")
RIGHT = At((-0.9, 0.5, 0.1), "FLRR", "0CRMERIRE00", "right rear floorpan")
CENTER = At((0.0, 0.0, 0.0), "VECG", "0VEHCCG0000", "vehicle center of gravity")
SILL = At((-0.2, -0.7, 0.2), "DSLR", "0SILBLERE00", "left rear sill")
ENGINE = At((1.2, 0.0, 0.0), "ENGN", "0ENGN000000", "engine", "engine")
HEAD = At((0.1, -0.4, -0.6), "HDCG/01", "1HEAD0000H3", "head", "driver's head")
TROLLEY = At((0.0, 0.0, 0.0), "IMCG", "0MBARCG0000", "impactor center of gravity")
RAIL = At((-1.0, -0.5, 0.0), "FRSL", "0FRAMLERE00", "left frame side rail")

FACTS = {
    "vehicle": "Car A, 2018",
    "mass_kg": "1500",
    "length_m": "4.5",
    "width_m": "1.8",
    "speed_m_per_s": "15.55555556",
}
#: Of each test: vehicles with their points, facts, letter in codes of ISO MME, and delta-V.
TESTS = {
    "car to car": (
        ((LEFT, RIGHT, CENTER, ENGINE, HEAD), FACTS, "1", (-11.0, 0.8, 0.0)),
        ((LEFT, SILL, ENGINE), {**FACTS, "vehicle": "Car B", "mass_kg": "1200"}, "2",
         (-14.0, -1.0, 0.0)),
    ),
    "mobile barrier to car": (
        ((SILL, RIGHT, CENTER), {**FACTS, "speed_m_per_s": "0"}, "1", (0.5, 6.0, 0.0)),
        ((TROLLEY, RAIL), {"vehicle": "trolley", "mass_kg": "1368", "speed_m_per_s": "15"}, "M",
         (-6.5, 0.0, 0.0)),
    ),
}  # fmt: skip


def felt(change, position):
    """Accelerations of a point along its axes, zeroed before the impact, (n, 3), m/s²."""
    pulse = HaversinePulse(IMPACT, 0.1, change, (0.0, 0.0, 60.0))
    motion = CrashMotion(0.5, Origin(45.0, 20.0, 100.0), (15.0, 0.0, 0.0), (pulse,))
    at = MountedMotion(motion, Mounting(position))
    force = at.specific_force(TIME + IMPACT)
    return force - force[TIME < 0.0].mean(axis=0)


def channels_of(
    at: At, vehicle: str, letter: str, layout: str, series: tuple[str, np.ndarray, np.ndarray]
) -> list[CrashChannel]:
    """Channels of a triad in the codes of a layout, with their stamps and values.

    `series`: quantity, stamps, values of x, y, z. In the layout of NHTSA channels are numbered
    later: their names are those of the axes.
    """
    quantity, time, values = series
    coded = layout == "mme"
    turns = quantity == "rate"
    return [
        CrashChannel(
            f"{letter}{at.mme}{'AV' if turns else 'AC'}{axis.upper()}A" if coded else axis,
            quantity,
            axis,
            "rad/s" if turns else "m/s2",
            lambda v=values[:, k]: (time.copy(), v.copy()),
            sampling="instantaneous",
            place=at.words,
            body=at.body.replace("driver", "front left occupant") if coded else at.body,
            vehicle=vehicle,
            point=at.mme if coded else at.nhtsa,
            low_pass="CFC 1000" if coded else "2800 Hz before the sampler",
            full_scale=40.0 if turns else 9806.65,
            bandwidth=None if coded else 2800.0,
        )
        for k, axis in enumerate("xyz")
    ]


def record_of(
    title: str, layout: str, channels: list[CrashChannel], vehicles: dict[str, dict[str, str]]
) -> CrashRecord:
    """A record of channels, which are numbered in the layout of NHTSA."""
    if layout == "nhtsa":
        channels = [replace(c, name=str(k)) for k, c in enumerate(channels, start=1)]
    return CrashRecord(
        Path("test"), layout, title, {"test": "77"}, tuple(channels), (), (), (), vehicles
    )


def recorded(test: str, layout: str) -> CrashRecord:
    """The record of a test in the codes of a layout: ``nhtsa`` or ``mme``."""
    channels: list[CrashChannel] = []
    vehicles = {}
    for number, (points, facts, letter, change) in enumerate(TESTS[test], start=1):
        vehicles[str(number)] = facts
        for at in points:
            values = felt(change, at.position)
            series = ("acceleration", TIME, values)
            channels += channels_of(at, str(number), letter, layout, series)
    return record_of(test.capitalize(), layout, channels, vehicles)
