"""What may turn a direction of force: lever arm, misalignment, a floor that rings, gravity."""

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
    Figure,
    FigurePanel,
    Statement,
    Table,
    Trace,
    amount,
)
from papers.tadic.directions import LENGTH, PAPER, WINDOWS
from strapdown.crash import Acceleration, delta_v, detect_events, pdof, trailing_delta_v
from strapdown.sensors import Mounting
from strapdown.simulation import CRASHES, CrashScenario, MountedMotion, Ringing

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Angles = tuple[float, ...]

RATE, LAB_RATE = 200.0, 10_000.0  # Hz
SPAN = (-0.1, 0.2)  # s
PHASES = 8
# Theory of the project: an arm of this size that is not compensated, on either side.
ARMS: tuple[Triple, ...] = ((0.6, -0.5, 0.2), (0.6, 0.5, 0.2), (-0.6, -0.5, 0.2), (-0.6, 0.5, 0.2))
TURNS = (1.0, 3.0, 5.0)  # deg of heading
#: Amplitude in m/s², frequency in Hz, decay in s: the three of the project's theory, and a floor
#: that is softer.
RINGINGS: tuple[tuple[str, tuple[float, float, float]], ...] = (
    ("10 g at 30 Hz", (98.0665, 30.0, 0.03)),
    ("10 g at 60 Hz", (98.0665, 60.0, 0.03)),
    ("10 g at 120 Hz", (98.0665, 120.0, 0.03)),
    ("10 g at 195 Hz", (98.0665, 195.0, 0.03)),
    ("5 g at 300 Hz", (49.03325, 300.0, 0.03)),
)
GRAVITY = 9.80665


@dataclass(frozen=True)
class Turned:
    """Horizontal direction of force by window of `WINDOWS`, deg; least and largest."""

    name: str
    low: Angles
    high: Angles

    def most(self, window: int, base: Turned) -> float:
        """By how much it is turned at most, deg."""
        return max(
            abs(self.low[window] - base.low[window]), abs(self.high[window] - base.high[window])
        )


def felt(
    mounting: Mounting,
    ringing: tuple[float, float, float] | None = None,
    *,
    phase: float = 0.0,
    rate: float = RATE,
    direction: Triple = (0.0, 1.0, 0.0),
    crash: CrashScenario | None = None,
) -> Acceleration:
    """What perfect sensors on a mounting say, the rest taken off, with a ringing.

    The ringing begins with the impact, and the samples `phase` of their interval later.
    """
    scenario = crash or CRASHES["pole"]
    rings = () if ringing is None else (Ringing(scenario.start, *ringing, direction),)
    unit = MountedMotion(scenario.motion, mounting, rings)
    time = np.arange(round((SPAN[1] - SPAN[0]) * rate) + 1) / rate + SPAN[0] + phase / rate
    force = unit.specific_force(time + scenario.start)
    return Acceleration(time, force - unit.specific_force(np.zeros(1))[0])


def by_window(acceleration: Acceleration, angle: int = 0) -> Angles:
    """Direction of force over each of `WINDOWS`, deg."""
    event = detect_events(acceleration).events[0]
    peak = trailing_delta_v(
        acceleration, LENGTH, min(event.time_zero + LENGTH, event.end), event.end
    ).peak
    found = [
        pdof(change)
        for change in (
            delta_v(acceleration, event.woken - LENGTH, event.woken),
            delta_v(acceleration, event.trigger - LENGTH, event.trigger),
            peak,
            delta_v(acceleration, event.time_zero, event.end),
        )
    ]
    return tuple((f.horizontal_deg, f.vertical_deg)[angle] for f in found)


def turned_by(
    name: str,
    mounting: Mounting,
    ringing: tuple[float, float, float] | None = None,
    rate: float = RATE,
) -> Turned:
    """Directions over `PHASES` instants between two samples at which the crash begins."""
    phases = range(PHASES) if rate == RATE else range(1)
    found = np.array(
        [by_window(felt(mounting, ringing, phase=k / PHASES, rate=rate)) for k in phases]
    )
    return Turned(name, tuple(found.min(axis=0).tolist()), tuple(found.max(axis=0).tolist()))


@dataclass(frozen=True)
class Candidates:
    """What was tried, in groups.

    Attributes
    ----------
    base : Turned
        At the center of mass, without anything.
    arms, turns, rings, rings_lab : tuple of Turned
        Arms that are not compensated; headings that are not known; ringing at 200 Hz; the same
        ringing at 10 kHz.
    """

    base: Turned
    arms: tuple[Turned, ...]
    turns: tuple[Turned, ...]
    rings: tuple[Turned, ...]
    rings_lab: tuple[Turned, ...]

    def most(self, group: str, window: int) -> float:
        """Largest turn of a group over a window, deg."""
        of: tuple[Turned, ...] = getattr(self, group)
        return max(t.most(window, self.base) for t in of)


def candidates() -> Candidates:
    """Try each alone on the paper's crash, with perfect sensors."""
    none = Mounting()
    return Candidates(
        turned_by("at the center of mass", none),
        tuple(
            turned_by(f"arm ({x:+g}, {y:+g}, {z:+g}) m left out", Mounting((x, y, z)))
            for x, y, z in ARMS
        ),
        tuple(
            turned_by(f"{t:g}° of heading not known", Mounting(angles_deg=(0, 0, t))) for t in TURNS
        ),
        tuple(turned_by(f"floor rings, {n}, 200 Hz", none, r) for n, r in RINGINGS),
        tuple(turned_by(f"floor rings, {n}, 10 kHz", none, r, LAB_RATE) for n, r in RINGINGS),
    )


def table(found: Candidates) -> Table:
    """By how much each turns the direction, over each window."""
    rows: list[tuple[str, tuple[float | None, ...]]] = []
    for t in (found.base, *found.arms, *found.turns, *found.rings, *found.rings_lab):
        values: list[float | None] = []
        for k in range(len(WINDOWS)):
            values += [t.low[k], t.high[k]]
        rows.append((t.name, tuple(values)))
    return Table(
        "pdof-candidates",
        "What turns a direction of force",
        "Horizontal angle in degrees, perfect sensors on the simulated crash; from and to over "
        f"{PHASES} instants between two samples at which the crash begins. Arms are from the "
        "center of mass, forward, right, down. The ringing is lateral, begins with the impact and "
        "decays in 30 ms. Two at once add up.",
        (
            "what",
            *(f"{w}, {end}" for w in WINDOWS for end in ("from", "to")),
        ),
        tuple(rows),
    )


def figure() -> Figure:
    """How a floor that rings turns the direction, by its frequency."""
    grid = np.geomspace(15.0, 400.0, 60)
    base = by_window(felt(Mounting()))
    panels: list[list[Trace]] = [[], [], []]
    for amplitude, name in ((5.0, "5 g"), (10.0, "10 g")):
        found = np.array(
            [by_window(felt(Mounting(), (amplitude * GRAVITY, float(f), 0.03))) for f in grid]
        )
        for k, traces in enumerate(panels):
            traces.append(Trace(name, grid, found[:, k] - base[k]))
    for traces in panels:
        for label, angle in (("needed, left", 43.0), ("needed, right", 49.0)):
            traces.append(Trace(label, grid[[0, -1]], np.full(2, angle), reference=True))
    return Figure(
        "pdof-ringing",
        "A floor that rings",
        "By how much a lateral ringing of the floor turns the horizontal direction at 200 Hz, "
        "against its frequency. Needed: from LAB1's −10° to IMU1's 33°, and from LAB2's −6° to "
        "IMU2's 43°.",
        "ringing as stated, decay 30 ms, begins with the impact and at a sample; instantaneous "
        "samples at 200 Hz",
        "frequency, Hz",
        (
            FigurePanel("first sign, °", tuple(panels[0])),
            FigurePanel("detection, °", tuple(panels[1])),
            FigurePanel("largest 30 ms, °", tuple(panels[2])),
        ),
        x_log=True,
    )


def ringing_speed_figure() -> Figure:
    """Fig. 8 where the floor rings: what the recorders on it have, and those on the pillars."""
    ring = RINGINGS[3][1]
    felt_by = {
        "IMU, rigid floor": felt(Mounting()),
        "IMU, floor rings": felt(Mounting(), ring),
        "IMU, floor rings, half a sample later": felt(Mounting(), ring, phase=0.5),
        "LAB, the same ringing": felt(Mounting(), ring, rate=LAB_RATE),
    }
    panels: list[list[Trace]] = [[], [], []]
    for name, acceleration in felt_by.items():
        change = trailing_delta_v(acceleration, LENGTH)
        shown = (change.time >= -0.02) & (change.time <= 0.15)
        for k in range(3):
            panels[k].append(Trace(name, change.time[shown], change.vector[shown, k]))
    event = detect_events(felt_by["IMU, rigid floor"]).events[0]
    return Figure(
        "fig8-ringing",
        "Fig. 8 with a floor that rings: change of the speed over 30 ms",
        "Perfect sensors along the vehicle's axes. A lateral ringing that begins with the impact "
        "gives samples at 200 Hz a lateral peak that is not there, of either sign as they fall; "
        "samples at 10 kHz of the same ringing have next to none of it.",
        f"{RINGINGS[3][0]}, lateral, dying away in {ring[2]:g} s; IMU at {RATE:g} Hz, LAB at "
        f"{LAB_RATE:g} Hz.",
        "time since the impact, s",
        tuple(
            FigurePanel(f"{axis}, m/s", tuple(traces))
            for axis, traces in zip(("forward", "right", "down"), panels, strict=True)
        ),
        marks=((event.woken, "first sign"), (event.trigger, "detection")),
    )


def causes(found: Candidates) -> Statement:
    """Judge that mounting and its place are the causes."""
    needed = PAPER["IMU1"][0] - PAPER["LAB1"][0], PAPER["IMU2"][0] - PAPER["LAB2"][0]
    windows = range(len(WINDOWS))
    arm, ring = ([found.most(g, w) for w in windows] for g in ("arms", "rings"))
    turn = [found.turns[1].most(w, found.base) for w in windows]
    return causes_from(min(needed), max(needed), arm, turn, ring)


def causes_from(
    least: float, most: float, arm: list[float], turn: list[float], ring: list[float]
) -> Statement:
    """Judge from the turn that is needed and what each candidate makes by window, deg."""
    whole = [a + t + r for a, t, r in zip(arm, turn, ring, strict=True)]
    remain = [max(0.0, most - w) for w in whole]
    reached = [WINDOWS[k] for k in range(len(WINDOWS)) if remain[k] == 0.0]
    if max(arm) + max(turn) >= most:
        verdict, condition = HOLDS, ""
    elif reached:
        verdict = HOLDS_WHEN
        condition = (
            f"the angle is that of the {' or '.join(reached)}, when a floor that rings turns it "
            f"anywhere; at the detection an arm, 3° of mounting and the ringing together explain "
            f"{amount(whole[1], '°')}, and in the largest 30 ms {amount(whole[2], '°')} of the "
            f"{amount(least, '°')} to {amount(most, '°')}"
        )
    else:
        verdict, condition = CANNOT_BE_JUDGED, ""
    return Statement(
        "causes",
        "Section 4",
        "Causes may be different mountings or mounting positions (structural deformation) as "
        "IMU1/2 were attached to the vehicle chassis through the floor, whereas LAB1/2 were "
        "attached to the B-pillars.",
        verdict,
        condition,
        "Each candidate alone, at its largest, with perfect sensors on the simulated crash, and "
        "their sum with the same sign. An arm that is left out turns 30 ms by some degrees, and "
        "the paper says that arms were compensated. Positions and vibrations of the paper's car "
        "were not published: which of them it was cannot be told.",
        (
            Evidence("needed: LAB1 to IMU1", least, "°"),
            Evidence("needed: LAB2 to IMU2", most, "°"),
            Evidence("arm left out, at most", max(arm), "°"),
            Evidence("3° of mounting", max(turn), "°"),
            *(Evidence(f"ringing, {w}", a, "°") for w, a in zip(WINDOWS, ring, strict=True)),
            *(
                Evidence(f"remains of the larger, {w}", a, "°")
                for w, a in zip(WINDOWS, remain, strict=True)
            ),
        ),
        "pdof-ringing",
    )


def lateral_peak(found: Candidates) -> Statement:
    """Judge that a negative lateral peak at detection turned the direction."""
    windows = range(len(WINDOWS))
    ring = [found.most("rings", w) for w in windows]
    lab = [found.most("rings_lab", w) for w in windows]
    ahead = abs(felt_over_detection())
    turn = np.radians([PAPER["IMU1"][0] - PAPER["LAB1"][0], PAPER["IMU2"][0] - PAPER["LAB2"][0]])
    return lateral_peak_from(ring, lab, float(ahead * np.tan(turn.min())))


def felt_over_detection() -> float:
    """Change of the speed ahead over the 30 ms before the detection, m/s."""
    acceleration = felt(Mounting())
    at = detect_events(acceleration).events[0].trigger
    return float(delta_v(acceleration, at - LENGTH, at).vector[0])


def lateral_peak_from(ring: list[float], lab: list[float], needed: float) -> Statement:
    """Judge from the turns by ringing at 200 Hz and at 10 kHz, by window, deg.

    `needed` is the lateral change within 30 ms that turns the direction as in the paper, m/s.
    """
    if ring[0] > 30.0 and ring[2] < 30.0:
        verdict = HOLDS_WHEN
        condition = (
            "the direction is taken early: over the largest 30 ms the same ringing turns it by "
            f"{amount(ring[2], '°')}, so that the window is as much the cause as the peak"
        )
    elif ring[0] > 30.0:
        verdict, condition = HOLDS, ""
    else:
        verdict, condition = CANNOT_BE_JUDGED, ""
    return Statement(
        "lateral-peak",
        "Section 4",
        "At the moment of crash detection, devices IMU1/2 have recorded a negative peak on the "
        "lateral axis (blue circle), which led to a differing estimation of horizontal PDOF.",
        verdict,
        condition,
        "A lateral push to the left turns the direction to the right, as in Table 2. Lateral "
        "ringing of up to 10 g that begins with the impact, perfect sensors at 200 Hz and at 10 "
        "kHz: largest turn over all instants between two samples.",
        (
            Evidence("lateral change in 30 ms for 43°, detection", needed, "m/s"),
            *(Evidence(f"200 Hz, {w}", a, "°") for w, a in zip(WINDOWS, ring, strict=True)),
            *(Evidence(f"10 kHz, {w}", a, "°") for w, a in zip(WINDOWS, lab, strict=True)),
        ),
        "pdof-ringing",
    )


# ==================================================================================================
# How fast to sample, how strong and long a pulse may be, and what a receiver bears
# ==================================================================================================

RATES = (50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
TRUE_RATE = 20_000.0
WINDOW = 0.030  # s
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


def rate_table(still: tuple[Sampled, ...], ringing: tuple[Sampled, ...]) -> Table:
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
    """Largest acceleration, m/s², and jerk, m/s³, of a crash at the center of mass."""
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
