"""What ringing of the structure does to a place by perfect sensors at 200 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from papers.crash_trials.paper_experiment import INTERVAL, RINGINGS
from papers.crash_trials.ringing_at_200_hz import perfect_sensors
from papers.reproduction import DOES_NOT_HOLD, HOLDS, Evidence, Statement
from strapdown.simulation import Ringing, Setting, pole_impact

PHASES = 3


@dataclass(frozen=True)
class Rung:
    """Distance from the true place after 750 ms by perfect sensors at 200 Hz on what rings, m."""

    name: str
    away: float


def rung() -> tuple[Rung, ...]:
    """Quadratic mean over some instants between two samples at which the ringing begins."""
    crash = pole_impact(setting=Setting(stand=2.6, towing=5.0, after=0.85))
    found = []
    for name, shape in RINGINGS.items():
        starts = [crash.start + (k + 0.5) / PHASES * INTERVAL for k in range(PHASES)]
        errors = [perfect_sensors(scenario=crash, ringing=Ringing(s, *shape)) for s in starts]
        found.append(Rung(name, float(np.sqrt(np.mean([e @ e for e in errors])))))
    return tuple(found)


def silent() -> float:
    """The same without ringing, m."""
    crash = pole_impact(setting=Setting(stand=2.6, towing=5.0, after=0.85))
    return float(np.linalg.norm(perfect_sensors(scenario=crash)))


def vibrations(rings: tuple[Rung, ...], silent: float) -> Statement:
    """Judge that vibration degrades the measurement."""
    ring = max(rings, key=lambda r: r.away)
    holds = ring.away > 10.0 * silent
    return Statement(
        "vibrations",
        "Section 2.2",
        "Measurement can be further degraded by vibrations if they are not compensated by rubber "
        "dumpers.",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        "Distance from the true place after 750 ms, perfect sensors at 200 Hz, RMS over "
        f"{PHASES} instants at which the ringing begins; it decays in 30 ms. Means over the sample "
        "or a rate of 1 kHz do what rubber does, without moving the sensor.",
        (
            Evidence("no ringing", 1e3 * silent, "mm"),
            *(Evidence(r.name, 1e3 * r.away, "mm") for r in rings),
        ),
    )
