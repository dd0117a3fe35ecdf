"""How fast to sample, how strong and long a pulse may be, and what a receiver bears."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from papers.tadic.mounting import felt
from strapdown.crash import delta_v, detect_events, trailing_delta_v
from strapdown.sensors import Mounting
from strapdown.simulation import CRASHES

Array = NDArray[np.float64]

RATES = (50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
TRUE_RATE = 20_000.0
WINDOW = 0.030  # s
PHASES = 8
RINGING = (98.0665, 120.0, 0.03)
AHEAD = (1.0, 0.0, 0.0)
STATED = 100.0  # Hz
# What "accurate" may mean to who reads a delta-V: 49 CFR 563.8 asks for ±10 %.
ACCURATE = 0.05
PULSES = ((50.0, 0.05), (50.0, 0.25), (100.0, 0.05), (100.0, 0.25))  # g, s
G = 9.80665
KMH = 3.6
# The fastest of all frontal crashes of the consumer tests ends near 18 m/s; 130 km/h is a motorway.
FASTEST = 130.0 / KMH
RECEIVER = (50.0, 20.0)  # m/s², m/s³


@dataclass(frozen=True)
class Sampled:
    """Largest errors at one rate over the instants between two samples at which it begins.

    Attributes
    ----------
    rate : float, Hz
    late : float, s
        Of the detection.
    peak, event : float
        Of the change within the largest 30 ms and of the whole event, relative.
    """

    rate: float
    late: float
    peak: float
    event: float


def sampled(rate: float, ringing: tuple[float, float, float] | None = None) -> Sampled:
    """Sample the crash at a rate, perfectly, and compare with the exact one without ringing."""
    true = _answers(TRUE_RATE, 0.0, None)
    found = np.array([_answers(rate, k / PHASES, ringing) for k in range(PHASES)])
    late = np.abs(found[:, 0] - true[0]).max()
    peak, event = (np.abs(found[:, k] / true[k] - 1.0).max() for k in (1, 2))
    return Sampled(rate, float(late), float(peak), float(event))


def _answers(
    rate: float, phase: float, ringing: tuple[float, float, float] | None
) -> tuple[float, float, float]:
    """Detection in s, change in the largest 30 ms and over the crash in m/s."""
    own = felt(Mounting(), ringing, phase=phase, rate=rate, direction=AHEAD)
    event = detect_events(own).events[0]
    peak = trailing_delta_v(own, WINDOW, WINDOW, 0.15).peak
    return event.trigger, peak.resultant, delta_v(own, -0.02, 0.15).resultant


def table(still: tuple[Sampled, ...], ringing: tuple[Sampled, ...]) -> Table:
    """Errors by rate, without and with ringing."""
    return Table(
        "sampling-rate",
        "Sampling rate",
        "Perfect sensors on the simulated crash, instantaneous samples: largest errors over "
        f"{PHASES} instants between two samples at which the crash begins. Ringing: 10 g ahead at "
        "120 Hz that decays in 30 ms.",
        (
            "rate, Hz",
            *("detection, ms", "30 ms, %", "event, %"),
            *("ringing: detection, ms", "ringing: 30 ms, %", "ringing: event, %"),
        ),
        tuple(
            (
                f"{a.rate:g}",
                (
                    *(1e3 * a.late, 100.0 * a.peak, 100.0 * a.event),
                    *(1e3 * b.late, 100.0 * b.peak, 100.0 * b.event),
                ),
            )
            for a, b in zip(still, ringing, strict=True)
        ),
    )


def rates() -> tuple[tuple[Sampled, ...], tuple[Sampled, ...]]:
    """All rates, without ringing and with it."""
    return tuple(sampled(r) for r in RATES), tuple(sampled(r, RINGING) for r in RATES)


def above_100(still: tuple[Sampled, ...], ringing: tuple[Sampled, ...]) -> Statement:
    """Judge that more than 100 Hz are needed, and enough."""
    rigid = next((s.rate for s in still if max(s.peak, s.event) < ACCURATE), float("inf"))
    rung = next(
        (
            s.rate
            for k, s in enumerate(ringing)
            if all(max(t.peak, t.event) < ACCURATE for t in ringing[k:])
        ),
        float("inf"),
    )
    at = {s.rate: s for s in still}[STATED]
    shaken = {s.rate: s for s in ringing}
    return above_100_from(rigid, rung, at, shaken[STATED], shaken[200.0])


def above_100_from(
    rigid: float, rung: float, at: Sampled, shaken: Sampled, twice: Sampled
) -> Statement:
    """Judge from the least rate in Hz that is accurate without and with ringing, and errors."""
    if rigid <= STATED and rung <= STATED:
        verdict, condition = HOLDS, ""
    elif rigid <= STATED:
        verdict = HOLDS_WHEN
        condition = (
            "nothing rings, or what is sampled are means: with 10 g at 120 Hz instantaneous "
            f"samples need {amount(rung, 'Hz')}"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "above-100-hz",
        "Section 2",
        "For accurate detection, the sensor sampling rates should be above 100 Hz.",
        verdict,
        condition,
        "Perfect sensors on the simulated crash; accurate are changes of velocity within "
        f"{100.0 * ACCURATE:g} %, wherever between two samples the crash begins.",
        (
            Evidence("least rate that is accurate, rigid car", rigid, "Hz"),
            Evidence("least rate that is accurate, ringing", rung, "Hz"),
            Evidence("100 Hz, rigid: detection", 1e3 * at.late, "ms"),
            Evidence("100 Hz, rigid: change in 30 ms", 100.0 * at.peak, "%"),
            Evidence("100 Hz, ringing: change in 30 ms", 100.0 * shaken.peak, "%"),
            Evidence("200 Hz, ringing: change in 30 ms", 100.0 * twice.peak, "%"),
            Evidence("200 Hz, ringing: change of the event", 100.0 * twice.event, "%"),
        ),
    )


def pulses() -> Statement:
    """Judge peaks of 50 to 100 g within 50 to 250 ms."""
    changes = {(a, t): 0.5 * a * G * t for a, t in PULSES}
    pole, wall = (CRASHES[n].delta_v[0] for n in ("pole", "frontal"))
    peaks = [2.0 * float(np.linalg.norm(c)) / t / G for c, t in ((pole, 0.113), (wall, 0.110))]
    return pulses_from(changes, peaks[0], peaks[1])


def pulses_from(changes: dict[tuple[float, float], float], pole: float, wall: float) -> Statement:
    """Judge from changes of velocity by peak in g and length in s, and peaks of two crashes, g."""
    possible = [k for k, c in changes.items() if c < FASTEST]
    longest = 2.0 * FASTEST / (50.0 * G)
    if len(possible) == len(changes):
        verdict, condition = HOLDS, ""
    elif possible:
        verdict = HOLDS_WHEN
        condition = (
            f"the high peaks belong to the short times: 50 g for more than "
            f"{amount(1e3 * longest, 'ms')} would stop more than 130 km/h"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "pulse-magnitude",
        "Section 2",
        "crash pulse magnitude can reach 50-100 g's ( g ≈ 9.81 m/s² ) within 50-250 ms",
        verdict,
        condition,
        "Change of velocity of a haversine pulse, half the peak times the length. Ringing of the "
        "structure makes peaks without any change.",
        (
            *(
                Evidence(f"{a:g} g in {1e3 * t:g} ms", KMH * c, "km/h")
                for (a, t), c in changes.items()
            ),
            Evidence("peak of the simulated pole impact, 26 km/h", pole, "g"),
            Evidence("peak of a wall at 56 km/h in 110 ms", wall, "g"),
        ),
    )


def strain(name: str) -> tuple[float, float]:
    """Largest acceleration, m/s², and jerk, m/s³, of a crash at the centre of mass."""
    crash = CRASHES[name]
    time = np.arange(0.0, crash.motion.duration, 0.001)
    found = crash.motion.kinematics(time).acceleration
    jerk = np.diff(found, axis=0) / 0.001
    return (
        float(np.linalg.norm(found, axis=1).max()),
        float(np.linalg.norm(jerk, axis=1).max()),
    )


def receiver() -> Statement:
    """Judge the limits of a receiver."""
    return receiver_from({n: strain(n) for n in ("pole", "hard-braking", "kerb")})


def receiver_from(found: dict[str, tuple[float, float]]) -> Statement:
    """Judge from acceleration and jerk of the crash and of ordinary driving, m/s² and m/s³."""
    words = {"pole": "pole impact", "hard-braking": "hard braking", "kerb": "kerb"}
    crash = found["pole"]
    beyond = crash[0] > RECEIVER[0] and crash[1] > RECEIVER[1]
    return Statement(
        "gnss-limits",
        "Section 1",
        "receiver operation is normally guaranteed at accelerations below 50 m/s² and jerks below "
        "20 m/s³",
        CANNOT_BE_JUDGED if beyond else DOES_NOT_HOLD,
        "",
        "What a receiver guarantees its maker says; no simulation can. The simulated crash passes "
        "both limits, so that no fix of it may be used; that of the jerk is passed by hard braking "
        "and a kerb, too.",
        tuple(
            Evidence(f"{words[n]}: {what}", v, unit)
            for n, values in found.items()
            for v, what, unit in zip(
                values, ("acceleration", "jerk"), ("m/s²", "m/s³"), strict=True
            )
        ),
    )
