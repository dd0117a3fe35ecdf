"""Crashes of every kind, drawn at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from strapdown.simulation import (
    CrashScenario,
    Setting,
    frontal_impact,
    oblique_impact,
    pole_impact,
    rear_impact,
    side_impact,
)

Draw = Callable[[np.random.Generator], CrashScenario]


def _setting(rng: np.random.Generator) -> Setting:
    # Short, but with rest enough to be found as one: what is long is the waiting.
    return Setting(
        heading_deg=float(rng.uniform(0.0, 360.0)),
        stand=2.6,
        towing=5.0,
        coast=0.4,
        friction=float(rng.uniform(0.2, 0.4)),
        after=0.85,
    )


def _pole(rng: np.random.Generator) -> CrashScenario:
    return pole_impact(
        rng.uniform(5.0, 12.0),
        rng.uniform(-0.6, 0.6),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.09, 0.14),
        pitch_deg=rng.uniform(-3.0, 0.0),
        setting=_setting(rng),
    )


def _frontal(rng: np.random.Generator) -> CrashScenario:
    return frontal_impact(
        rng.uniform(8.0, 16.0),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.09, 0.13),
        pitch_deg=rng.uniform(-4.0, 0.0),
        setting=_setting(rng),
    )


def _oblique(rng: np.random.Generator) -> CrashScenario:
    return oblique_impact(
        rng.uniform(8.0, 15.0),
        rng.choice([-1.0, 1.0]) * rng.uniform(15.0, 50.0),
        arm=rng.uniform(-0.4, 0.4),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.10, 0.14),
        pitch_deg=rng.uniform(-3.0, 0.0),
        setting=_setting(rng),
    )


def _side(rng: np.random.Generator) -> CrashScenario:
    return side_impact(
        rng.uniform(4.0, 12.0),
        rng.uniform(4.0, 9.0),
        rng.choice([-1.0, 1.0]) * rng.uniform(70.0, 110.0),
        arm=rng.uniform(-0.4, 0.4),
        length=rng.uniform(0.08, 0.11),
        roll_deg=rng.uniform(-4.0, 4.0),
        setting=_setting(rng),
    )


def _rear(rng: np.random.Generator) -> CrashScenario:
    return rear_impact(
        rng.uniform(1.0, 6.0),
        rng.uniform(4.0, 8.0),
        offset=rng.uniform(-0.4, 0.4),
        length=rng.uniform(0.10, 0.14),
        pitch_deg=rng.uniform(0.0, 2.5),
        setting=_setting(rng),
    )


#: Makers of crashes by their kind: speeds of 1 to 16 m/s, changes of 3 to 19 m/s, pulses of 80 to
#: 140 ms, all headings.
DRAWN: dict[str, Draw] = {
    "pole": _pole,
    "frontal": _frontal,
    "oblique": _oblique,
    "side": _side,
    "rear": _rear,
}
