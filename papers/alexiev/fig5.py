"""Fig. 5: the naive sum against direction cosines at 5 Hz and at 100 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from papers.alexiev.sampling import NONE, algorithm_history, scenario_motion
from papers.reproduction import (
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
from strapdown import rotation
from strapdown.increments import increments_from_imu
from strapdown.simulation import Motion, simulate_imu
from strapdown.tables import QUATERNION

LOW, HIGH = 5.0, 100.0  # Hz, of the paper
RATES = (5.0, 10.0, 20.0, 50.0, 100.0, 1000.0)  # Hz
_NUMBERS = (
    "Pulses about x, y, z overlapping: 0.10 rad/s on [2.07, 3.53), −0.05 on [2.51, 4.13), 0.15 on "
    "[2.93, 3.77) s: turns of 8.4°, −4.6°, 7.2°. The edges are on the grid of 100 Hz and off that "
    "of 5 Hz, as edges fall that nobody arranged."
)


@dataclass(frozen=True)
class Compared:
    """Naive sum and direction cosines on the same samples.

    Attributes
    ----------
    rate : float, Hz
    naive, dcm : float, deg
        Final error of each.
    apart : float, deg
        Angle between the two at the end: what the choice of the algorithm makes.
    """

    rate: float
    naive: float
    dcm: float
    apart: float


def compare(motion: Motion, rate: float, sampling: str = "instantaneous") -> Compared:
    """Run both over the same samples of a motion."""
    imu, truth = simulate_imu(motion, NONE, rate=rate, sampling=sampling, accelerometer=False)
    known = truth[QUATERNION].to_numpy()
    steps = increments_from_imu(imu)
    naive, dcm = (algorithm_history(a, steps, known[0])[-1] for a in ("naive", "dcm"))
    return Compared(
        rate,
        float(rotation.rotation_angle(naive, known[-1])),
        float(rotation.rotation_angle(dcm, known[-1])),
        float(rotation.rotation_angle(naive, dcm)),
    )


def table() -> Table:
    """Return both motions at rising rates."""
    small, large = (scenario_motion(n) for n in ("alexiev-fig5", "alexiev-fig5-large"))
    rows = []
    for rate in RATES:
        found = [compare(motion, rate) for motion in (small, large)]
        rows.append((f"{rate:g} Hz", tuple(v for c in found for v in (c.naive, c.dcm, c.apart))))
    return Table(
        "fig5",
        "Fig. 5 in numbers",
        "Final error in degrees, and the angle between the two algorithms on the same samples. "
        "Left: turns of 5° to 8°; right: ten times the rates, turns of 46° to 84°.",
        (
            "rate",
            "naive, °",
            "dcm, °",
            "apart, °",
            "naive, large turns, °",
            "dcm, large turns, °",
            "apart, large turns, °",
        ),
        tuple(rows),
    )


def figure() -> Figure:
    """Return the angles by the naive sum and by direction cosines at both rates."""
    motion = scenario_motion("alexiev-fig5")
    panels = []
    for rate in (LOW, HIGH):
        imu, truth = simulate_imu(motion, NONE, rate=rate, accelerometer=False)
        time = truth.index.to_numpy(dtype=np.float64)
        q = truth[QUATERNION].to_numpy()
        steps = increments_from_imu(imu)
        rates = np.degrees(motion.rate(time))
        panels.append(
            FigurePanel(
                f"gyro at {rate:g} Hz, deg/s",
                tuple(Trace(f"gyro {axis}", time, rates[:, k]) for k, axis in enumerate("xyz")),
            )
        )
        traces = tuple(
            Trace(a, time, rotation.rotation_angle(algorithm_history(a, steps, q[0]), q))
            for a in ("naive", "dcm")
        )
        panels.append(FigurePanel(f"error at {rate:g} Hz, deg", traces))
    return Figure(
        "fig5",
        "Fig. 5, naive sum and DCM at 5 Hz and 100 Hz",
        "Rotation angle from the exact attitude. At 5 Hz the samples miss the edges of the pulses, "
        "and both algorithms pay for it on the way; at 100 Hz DCM is right and what is left of the "
        "naive sum's error is its own.",
        _NUMBERS,
        "time, s",
        tuple(panels),
    )


def very_good_at_high_rate(small: Compared, large: Compared) -> Statement:
    """Judge that the naive sum is very good at 100 Hz, on small and on large turns."""
    good, bad = small.naive < 2.0, large.naive >= 2.0
    if good and bad:
        verdict, condition = HOLDS_WHEN, "the turns are of a few degrees"
    else:
        verdict, condition = (HOLDS if good else DOES_NOT_HOLD), ""
    return Statement(
        "fig5-very-good",
        "Section 5, Fig. 5e",
        "the simplest cumulative computation gives very good results for the case of higher "
        "measurement rate",
        verdict,
        condition,
        "The paper's amplitudes did not survive. On turns of 5° to 8° overlapping about three axes "
        "the sum at 100 Hz looks right in a plot; with ten times the rates it is useless, "
        "and the rate is the same.",
        (
            Evidence("naive at 100 Hz, turns of 5° to 8°", small.naive, "°"),
            Evidence("naive at 100 Hz, turns of 46° to 84°", large.naive, "°"),
            Evidence("DCM at 100 Hz, small turns", small.dcm, "°"),
            Evidence("DCM at 100 Hz, large turns", large.dcm, "°"),
        ),
        "naive-rate",
    )


def differs_at_low_rate(low: Compared, high: Compared, large_low: Compared) -> Statement:
    """Judge that a low rate tells the naive sum from direction cosines.

    Parameters
    ----------
    low, high : Compared
        On the same motion at 5 Hz and at 100 Hz.
    large_low : Compared
        On ten times the rates at 5 Hz.
    """
    grown = low.apart / high.apart
    return Statement(
        "fig5-low-rate",
        "Section 5, Figs. 5b and 5c",
        "The difference of quality was determined in lower measurement rate",
        HOLDS if grown > 1.5 else DOES_NOT_HOLD,
        "",
        f"The two algorithms end {amount(low.apart, '°')} apart at {low.rate:g} Hz and "
        f"{amount(high.apart, '°')} at {high.rate:g} Hz: the difference of quality is the same, "
        "because commutation does not depend on the rate. What a low rate adds is sampling error, "
        "in both, DCM included.",
        (
            Evidence("naive and DCM apart at 5 Hz", low.apart, "°"),
            Evidence("naive and DCM apart at 100 Hz", high.apart, "°"),
            Evidence("naive at 5 Hz", low.naive, "°"),
            Evidence("DCM at 5 Hz", low.dcm, "°"),
            Evidence("DCM at 5 Hz, ten times the rates", large_low.dcm, "°"),
        ),
        "fig5",
    )
