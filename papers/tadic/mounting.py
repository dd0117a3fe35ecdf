"""What may turn a direction of force: lever arm, misalignment, a floor that rings, gravity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.reproduction import (
    CANNOT_BE_JUDGED,
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
        At the centre of mass, without anything.
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
        turned_by("at the centre of mass", none),
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
        "centre of mass, forward, right, down. The ringing is lateral, begins with the impact and "
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
