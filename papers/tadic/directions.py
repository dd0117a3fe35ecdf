"""Fig. 8: how the three components of the speed change over 30 ms, and the severity of it."""

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
from papers.tadic.experiment import AXES, CHOSEN, PLATFORMS, Experiment, Experiments
from strapdown.crash import (
    NedPdof,
    Pdof,
    VelocityChange,
    body_delta_v_bound,
    delta_v,
    ned_pdof,
    pdof,
    resolved_delta_v_bound,
    trailing_delta_v,
    velocity_change,
)

Array = NDArray[np.float64]

KNOWN = 0.95  # of the delta-V: then it is as good as known
WINDOW = 0.030  # s: "the short time-window (herein 30 ms)"
SPEED_SHOWN = (-0.02, 0.20)  # s


def speed_figure(made: Experiment) -> Figure:
    """Fig. 8 with the instants at which an event is known."""
    panels: list[list[Trace]] = [[], [], []]
    for name in PLATFORMS:
        time, change = over_window(made, name)
        for k in range(3):
            panels[k].append(Trace(name, time, change[:, k]))
    time = np.linspace(*SPEED_SHOWN, 111)
    true = np.array([made.exact.along_body(t - WINDOW, t) for t in time])
    for k in range(3):
        panels[k].append(Trace("truth", time, true[:, k], reference=True))
    event = made.platform("IMU1").events.events[0]
    return Figure(
        "fig8",
        "Fig. 8: change of the speed over 30 ms",
        "Along the vehicle's axes: forward, right, down; what the vehicle felt at rest is taken "
        "off. The marks are IMU1's: the first sign of a crash (0.8 km/h in 20 ms), and its "
        "detection (8 km/h). Without ringing no platform has a lateral peak.",
        CHOSEN,
        "time from the trigger, s",
        tuple(
            FigurePanel(f"{axis}, m/s", tuple(traces))
            for axis, traces in zip(AXES, panels, strict=True)
        ),
        marks=((event.woken, "first sign"), (event.trigger, "detection")),
    )


def over_window(made: Experiment, name: str) -> tuple[Array, Array]:
    """Instants and change of the speed over the 30 ms before each, of what is drawn."""
    found = trailing_delta_v(made.platform(name).acceleration, WINDOW)
    shown = (found.time >= SPEED_SHOWN[0]) & (found.time <= SPEED_SHOWN[1])
    return found.time[shown], found.vector[shown]


def severity(made: Experiments) -> Statement:
    """Judge 30 ms as the window of a severity."""
    peak, whole = (
        float(
            np.mean(
                [getattr(e.platform(n).body[0], w).resultant for e in made.all for n in PLATFORMS]
            )
        )
        for w in ("peak", "event")
    )
    return severity_from(peak, whole)


def severity_from(peak: float, whole: float) -> Statement:
    """Judge from the change within 30 ms and that of the whole event, m/s."""
    share = peak / whole
    if share > 0.95:
        verdict, condition = CANNOT_BE_JUDGED, ""
    elif share > 0.2:
        verdict = HOLDS_WHEN
        condition = (
            f"it is never taken for the delta-V of regulations and injury curves, which is that of "
            f"the whole event: 30 ms hold {amount(100.0 * share, '%')} of it"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "severity-30-ms",
        "Section 4",
        "Crash severity is usually estimated according to the change of the speed vector "
        "(“delta-V”) as measured over the short time-window (herein 30 ms).",
        verdict,
        condition,
        "Both changes of all platforms and experiments: in the 30 ms in which it is largest, and "
        "from time zero to the end of the event (49 CFR 563). A pulse of 113 ms does not fit into "
        "30 ms.",
        (
            Evidence("largest in 30 ms", peak, "m/s"),
            Evidence("whole event", whole, "m/s"),
            Evidence("share", 100.0 * share, "%"),
        ),
        "fig8",
    )


def urgency(made: Experiments) -> Statement:
    """Judge that URGENCY detects a crash: what is known at the detection, and what it needs."""
    shares, times = [], []
    for e in made.all:
        for name in PLATFORMS:
            unit = e.platform(name)
            event, whole = unit.events.events[0], unit.body[0].event
            known = delta_v(unit.acceleration, event.time_zero, event.trigger).vector
            shares.append(float(np.linalg.norm(known)) / whole.resultant)
            times.append((event.trigger - event.time_zero, whole.delta_v.end - event.time_zero))
    at, end = np.mean(times, axis=0)
    return urgency_from(float(np.mean(shares)), float(at), float(end))


def urgency_from(share: float, detected: float, ended: float) -> Statement:
    """Judge from the share of the delta-V that is known at the detection, and both instants, s.

    URGENCY (Malliaris, Digges and DeBlois 1997) is a logistic model of the probability of a
    serious injury. Its first input is the delta-V of the crash, so that it can answer at the
    detection only if the whole of it is known by then.
    """
    return Statement(
        "urgency",
        "Section 4",
        "Crash is usually detected by URGENCY [18], [19] algorithm.",
        HOLDS if share > KNOWN else DOES_NOT_HOLD,
        "",
        "URGENCY gives the probability of an injury from the delta-V of a crash, its direction, "
        "belts, age and rollover; it presumes a crash that has been detected and has ended. A "
        "detection compares the change of the speed within a short window with a threshold (49 "
        "CFR 563: 8 km/h in 150 ms), and happens while most of the delta-V is still to come.",
        (
            Evidence("detection, after time zero", 1e3 * detected, "ms"),
            Evidence("end of the event, after time zero", 1e3 * ended, "ms"),
            Evidence("share of the delta-V that is known at the detection", 100.0 * share, "%"),
        ),
        "fig8",
    )


# ==================================================================================================
# Fig. 7 and Table 2: the direction of force, by window, in both frames, with bounds
# ==================================================================================================

#: Table 2 of the paper: horizontal and vertical angle, deg; its REF and LCEDR are LAB and IMU.
PAPER = {
    "LAB1": (-10.0, 14.0),
    "LAB2": (-6.0, 11.0),
    "IMU1": (33.0, 11.0),
    "IMU2": (43.0, 15.0),
}
WINDOWS = ("first sign", "detection", "largest 30 ms", "event")
LENGTH = 0.030  # s
SHOWN = (0.012, 0.14)  # s, from time zero
GRAVITY = 9.80665
#: Within this two directions are the same in Table 2, which has whole degrees.
SAME = 0.5


@dataclass(frozen=True)
class Direction:
    """Direction of force over one window.

    Attributes
    ----------
    body : VelocityChange
        Along the turning axes.
    ned : VelocityChange
        Resolved.
    true : Pdof
        Along the turning axes, exactly.
    """

    body: VelocityChange
    ned: VelocityChange
    true: Pdof

    @property
    def horizontal_deg(self) -> float:
        """Along the vehicle's axes."""
        return _pdof(self.body).horizontal_deg

    @property
    def vertical_deg(self) -> float:
        """Along the vehicle's axes."""
        return _pdof(self.body).vertical_deg

    @property
    def relative_deg(self) -> float:
        """Over ground, from the heading at the impact."""
        return self._over_ground.relative_deg

    @property
    def ned_vertical_deg(self) -> float:
        """Over ground."""
        return self._over_ground.vertical_deg

    @property
    def _over_ground(self) -> NedPdof:
        found = self.ned.pdof
        assert isinstance(found, NedPdof)
        return found


def _pdof(change: VelocityChange) -> Pdof:
    assert isinstance(change.pdof, Pdof)
    return change.pdof


def direction(made: Experiment, name: str, window: str) -> Direction:
    """Direction of force that a platform tells over one of `WINDOWS`.

    The first sign is where the speed has changed by 0.8 km/h within 20 ms, the detection where it
    has changed by 8 km/h within 150 ms (49 CFR 563); their windows are the 30 ms up to there.
    """
    unit = made.platform(name)
    event, changes = unit.events.events[0], unit.body[0]
    if window in ("first sign", "detection"):
        end = event.woken if window == "first sign" else event.trigger
        start = end - LENGTH
        rest_sd = unit.at_point.resting_force(GRAVITY)[1]
        change = delta_v(unit.acceleration, start, end)
        body = velocity_change(
            "peak",
            change,
            body_delta_v_bound(unit.at_point.effects, change.weights, rest_sd=rest_sd),
        )
    else:
        body = changes.peak if window == "largest 30 ms" else changes.event
        start, end = body.delta_v.start, body.delta_v.end
    course = np.unwrap(unit.path.table["heading"], period=360.0)
    heading = float(np.interp(event.time_zero, unit.path.time, course))
    ned = velocity_change(
        body.window,
        delta_v(unit.resolved, start, end),
        resolved_delta_v_bound(unit.path, start, end),
        heading,
    )
    return Direction(body, ned, pdof(made.exact.along_body(start, end)))


def table(made: Experiment) -> Table:
    """Table 2: the paper's angles, and ours by window."""
    rows: list[tuple[str, tuple[float | None, ...]]] = []
    for window in WINDOWS:
        for name in PLATFORMS:
            d = direction(made, name, window)
            half = [
                0.5 * i.width_deg for i in (d.body.interval.horizontal, d.body.interval.vertical)
            ]
            rows.append(
                (
                    f"{name}, {window}",
                    (
                        *(PAPER[name] if window == "detection" else (None, None)),
                        *(d.horizontal_deg, half[0], d.vertical_deg, half[1]),
                        *(d.relative_deg, d.ned_vertical_deg),
                        *(d.true.horizontal_deg, d.true.vertical_deg),
                    ),
                )
            )
    return Table(
        "table2",
        "Table 2: direction of force",
        "Degrees; where the force came from, horizontally (H) from the front, positive from the "
        "right, and vertically (V), positive from above; ± is the 95 % bound. The paper gives no "
        "convention of signs and no window other than the moment of detection and 30 ms; its REF "
        "and LCEDR are LAB and IMU here. First sign: the 30 ms up to where the speed has changed "
        "by 0.8 km/h within 20 ms; detection: those up to where it has changed by 8 km/h. Body: "
        "along the turning axes of the vehicle; NED: resolved over ground, from the heading at "
        "the impact. The truth is that of the simulated crash, which is not the paper's.",
        (
            *("platform, window", "paper, H", "paper, V", "body, H", "±", "body, V", "±"),
            *("NED, H", "NED, V", "truth, H", "truth, V"),
        ),
        tuple(rows),
    )


def figure(made: Experiment) -> Figure:
    """Fig. 7 as angles: direction of the change since time zero, while the crash goes on."""
    panels: tuple[list[Trace], list[Trace]] = ([], [])
    grid = np.linspace(*SHOWN, 129)
    for name in PLATFORMS:
        unit = made.platform(name)
        zero = unit.events.events[0].time_zero
        found = [_pdof_of(delta_v(unit.acceleration, zero, zero + t).vector) for t in grid]
        for k, traces in enumerate(panels):
            traces.append(Trace(name, grid, np.array([f[k] for f in found])))
    true = [_pdof_of(made.exact.along_body(0.0, t)) for t in grid]
    for k, traces in enumerate(panels):
        traces.append(Trace("truth", grid, np.array([f[k] for f in true]), reference=True))
        for name in PLATFORMS:
            at = np.array([SHOWN[0]])
            traces.append(Trace(f"{name}, paper", at, np.array([PAPER[name][k]]), points=True))
    event = made.platform("IMU1").events.events[0]
    return Figure(
        "fig7",
        "Fig. 7: direction of force",
        "Direction of the change of velocity since time zero, along the vehicle's axes, against "
        "the time since then: 0 the front, positive from the right and from above. Points: Table 2 "
        "of the paper, whose instant is not known. Early, the change is small, and any lateral "
        "push turns it far.",
        CHOSEN,
        "time since time zero, s",
        (
            FigurePanel("horizontal, °", tuple(panels[0])),
            FigurePanel("vertical, °", tuple(panels[1])),
        ),
        marks=((event.trigger - event.time_zero, "detection"),),
    )


def points_figure(made: Experiment) -> Figure:
    """Fig. 7 as points of azimuth and elevation, beside those of Table 2."""
    panels = []
    for window in ("detection", "largest 30 ms"):
        traces = []
        for name in PLATFORMS:
            found = _pdof(direction(made, name, window).body)
            for label, (azimuth, elevation) in (
                (name, (found.horizontal_deg, found.vertical_deg)),
                (f"{name}, Table 2", PAPER[name]),
            ):
                traces.append(Trace(label, np.array([azimuth]), np.array([elevation]), points=True))
        panels.append(FigurePanel(f"vertical, °, {window}", tuple(traces)))
    return Figure(
        "fig7-points",
        "Fig. 7: directions of force as points, with those of Table 2",
        "Azimuth and elevation of the change of the speed over 30 ms, along the vehicle's axes: up "
        "to the detection, and where it is largest. Platforms that do not ring agree to a degree "
        "or two with each other and with the front; the paper's recorders on the floor do not.",
        CHOSEN,
        "horizontal, °",
        tuple(panels),
    )


def _pdof_of(vector: Array) -> tuple[float, float]:
    found = pdof(vector)
    return found.horizontal_deg, found.vertical_deg


# --- statements -------------------------------------------------------------------------------


def frames_agree(made: Experiments) -> Statement:
    """Judge that body and north-east-down have the same direction."""
    exact, start = made.first.exact, made.first.platform("IMU1").path.table["heading"]
    heading = float(np.interp(0.0, start.index.to_numpy(dtype=np.float64), start.to_numpy()))
    apart = {}
    for window in WINDOWS:
        change = direction(made.first, "IMU1", window).body.delta_v
        body = pdof(exact.along_body(change.start, change.end))
        over = ned_pdof(exact.over_ground(change.start, change.end), heading)
        apart[window] = max(
            abs(over.relative_deg - body.horizontal_deg), abs(over.vertical_deg - body.vertical_deg)
        )
    sensed = [
        abs(d.ned_vertical_deg - d.vertical_deg)
        for e in made.all
        for d in (direction(e, n, "detection") for n in PLATFORMS)
    ]
    return frames_from(apart, float(np.mean(sensed)))


def frames_from(apart: dict[str, float], sensed: float) -> Statement:
    """Judge from the true difference of the two by window, deg.

    `sensed` is what the platforms make of the vertical one at detection.
    """
    close = [w for w in WINDOWS if apart[w] < SAME]
    if len(close) == len(WINDOWS):
        verdict, condition = HOLDS, ""
    elif close:
        verdict = HOLDS_WHEN
        condition = (
            f"the window is early ({', '.join(close)}): later the vehicle has turned, and the two "
            "part"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "body-and-ned",
        "Table 2",
        "In this specific crash” body” and “NED” frames were aligned (→the same PDOF).",
        verdict,
        condition,
        "True directions in both frames, the larger difference of the two angles, over IMU1's "
        "windows: the simulated car turns, up to 87°/s. What sensors make of the vertical angle is "
        "more, because a bias of 0.2 m/s² is levelled as a tilt of 1.2°, and that turns the change "
        "over ground: mean over all platforms and experiments.",
        (
            *(Evidence(f"true difference, {w}", apart[w], "°") for w in WINDOWS),
            Evidence("vertical, as sensed, detection", sensed, "°"),
        ),
    )


def vertical_consistent(made: Experiments) -> Statement:
    """Judge that the vertical angles agree and the horizontal ones do not."""
    spread = []
    for k in range(2):
        own = [
            np.std(
                [
                    (d.horizontal_deg, d.vertical_deg)[k]
                    for d in (direction(e, n, "detection") for n in PLATFORMS)
                ]
            )
            for e in made.all
        ]
        spread.append(float(np.mean(own)))
    angles = np.array([PAPER[n] for n in PLATFORMS])
    felt = GRAVITY / np.tan(np.radians(angles[:, 1]))
    return vertical_from(
        (float(np.ptp(angles[:, 0])), float(np.ptp(angles[:, 1]))),
        (spread[0], spread[1]),
        (float(felt.min()), float(felt.max())),
    )


def vertical_from(
    paper: tuple[float, float], ours: tuple[float, float], felt: tuple[float, float]
) -> Statement:
    """Judge from ranges of the paper's angles, our deviations (horizontal, vertical; deg).

    `felt` is the horizontal acceleration at which gravity alone would make the paper's angles.
    """
    if not paper[1] < 0.25 * paper[0]:
        verdict, condition = DOES_NOT_HOLD, ""
    elif ours[1] < 0.25 * ours[0]:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "it is told of the paper's four devices: in a car that is rigid and does not ring, "
            f"both angles scatter alike ({amount(ours[0], '°')} and {amount(ours[1], '°')})"
        )
    return Statement(
        "vertical-consistent",
        "Section 4",
        "The measured vertical PDOFs were very consistent, oppositely to the horizontal ones.",
        verdict,
        condition,
        "So Table 2 says. Nothing that all four share can scatter: gravity, left in the force, "
        "tilts it by the same angle everywhere, and with an acceleration of "
        f"{amount(felt[0])} to {amount(felt[1])} m/s² by the paper's 11° to 15°. What each has of "
        "its own, mounting and structure, scatters.",
        (
            Evidence("paper: range of the horizontal angles", paper[0], "°"),
            Evidence("paper: range of the vertical angles", paper[1], "°"),
            Evidence("ours, detection: deviation, horizontal", ours[0], "°"),
            Evidence("ours, detection: deviation, vertical", ours[1], "°"),
            Evidence("acceleration at which gravity left in makes 15°", felt[0], "m/s²"),
            Evidence("acceleration at which gravity left in makes 11°", felt[1], "m/s²"),
        ),
        "fig7",
    )
