"""Fig. 8: how the three components of the speed change over 30 ms, and the severity of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
    amount,
)
from papers.tadic.experiment import AXES, CHOSEN, PLATFORMS, Experiment, Experiments
from strapdown.crash import trailing_delta_v

Array = NDArray[np.float64]

WINDOW = 0.030  # s: "the short time-window (herein 30 ms)"
SHOWN = (-0.02, 0.20)  # s


def figure(made: Experiment) -> Figure:
    """Fig. 8 with the instants at which an event is known."""
    panels: list[list[Trace]] = [[], [], []]
    for name in PLATFORMS:
        time, change = over_window(made, name)
        for k in range(3):
            panels[k].append(Trace(name, time, change[:, k]))
    time = np.linspace(*SHOWN, 111)
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
    shown = (found.time >= SHOWN[0]) & (found.time <= SHOWN[1])
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
