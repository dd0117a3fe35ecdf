"""Fig. 4 before 90°: how the error of Euler-Krylov grows towards the pole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.alexiev.fig4 import NUMBERS
from papers.alexiev.sampling import NONE, scenario_motion
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
    amount,
)
from strapdown.attitude import EulerKrylov
from strapdown.increments import increments_from_imu
from strapdown.rotation import within_half_turn
from strapdown.simulation import simulate_imu
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]


APPROACH_RATES = (20.0, 100.0, 500.0, 2500.0)  # Hz


APPROACH_PITCHES = (30.0, 60.0, 80.0, 85.0)  # deg


@dataclass(frozen=True)
class Approach:
    """Error of Euler-Krylov's roll and heading on the way to the pole, from exact increments.

    Attributes
    ----------
    rate : float, Hz
    pitch : ndarray, (n,), deg
        True pitch, rising.
    roll, heading : ndarray, (n,), deg
        Size of the error of each.
    """

    rate: float
    pitch: Array
    roll: Array
    heading: Array

    def at(self, pitch: float) -> float:
        """Return the larger of the two errors where the true pitch is `pitch`."""
        both = np.maximum(self.roll, self.heading)
        return float(np.interp(pitch, self.pitch, both))


def approach(rate: float, step: str = "forward") -> Approach:
    """Follow roll and heading up to the greatest true pitch.

    Parameters
    ----------
    rate : float, Hz
    step : {'forward', 'rk4'}

    Returns
    -------
    Approach
        From exact increments, so that nothing of it is due to sampling.
    """
    motion = scenario_motion("alexiev-fig4")
    imu, truth = simulate_imu(motion, NONE, rate=rate, sampling="mean", accelerometer=False)
    algorithm = EulerKrylov(step)  # type: ignore[arg-type]
    start = algorithm.begin(truth[QUATERNION].to_numpy()[0])
    _, history = algorithm.advance(start, increments_from_imu(imu))
    known = truth[["roll", "pitch", "heading"]].to_numpy()[1:]
    off = np.degrees(history) - known
    off = np.abs(within_half_turn(off))
    top = int(np.argmax(known[:, 1])) + 1
    first = int(np.argmax(known[:, 1] > 0.0))
    turning = slice(first, top)
    return Approach(rate, known[turning, 1], off[turning, 0], off[turning, 2])


def approach_figure(found: tuple[Approach, ...], smooth: Approach) -> Figure:
    """Return the error of roll and heading against the true pitch, for several rates."""

    def traces(name: str) -> tuple[Trace, ...]:
        lines = [Trace(f"euler, {a.rate:g} Hz", a.pitch, getattr(a, name)) for a in found]
        name_of = f"euler:step=rk4, {smooth.rate:g} Hz"
        lines.append(Trace(name_of, smooth.pitch, np.maximum(getattr(smooth, name), 1e-6)))
        return tuple(lines)

    return Figure(
        "fig4-approach",
        "Error of Euler-Krylov before 90°",
        "Size of the error of roll (x) and heading (z) against the true pitch, while the pitch "
        "rises. From exact increments, so that all of it is the algorithm's. It is there from the "
        "first degree, grows towards the pole about as 1/cos² of the pitch, and halves with half "
        "the step: it is the error of the forward step. Runge-Kutta's step on the same equations "
        "has next to none. Drawn at 1e-6° where it is less.",
        NUMBERS,
        "true pitch, deg",
        (
            FigurePanel("roll error, deg", traces("roll"), log=True),
            FigurePanel("heading error, deg", traces("heading"), log=True),
        ),
    )


def before_ninety(found: tuple[Approach, ...], smooth: Approach) -> Statement:
    """Judge that errors about x and z grow before the pitch reaches 90°.

    Parameters
    ----------
    found : tuple of Approach
        By the forward step, at rising rates.
    smooth : Approach
        By Runge-Kutta's step at a rate that is among them.
    """
    at_100 = next(a for a in found if a.rate == smooth.rate)
    grown = [at_100.at(p) for p in APPROACH_PITCHES]
    grows = bool(np.all(np.diff(grown) > 0.0)) and grown[0] > 1e-3
    low, high = found[0], found[-1]
    order = float(
        np.log(low.at(APPROACH_PITCHES[1]) / high.at(APPROACH_PITCHES[1]))
        / np.log(high.rate / low.rate)
    )
    near, nearer = APPROACH_PITCHES[-2:]
    steepness = float(
        np.log(grown[-1] / grown[-2])
        / np.log(np.cos(np.radians(near)) / np.cos(np.radians(nearer)))
    )
    return Statement(
        "fig4-before-90",
        "Section 5, Fig. 4b",
        "the errors in estimation of angles of rotation around axes x and z start to accumulate "
        "away before reaching the angle of 90° degrees",
        HOLDS if grows else DOES_NOT_HOLD,
        "",
        "From exact increments the error of roll and heading is there at every pitch and grows "
        f"towards the pole. It falls with the rate to the power {amount(order)}: it is "
        "the truncation error of the forward step, magnified near the pole by 1/cos(pitch) to the "
        f"power {amount(steepness)}. Runge-Kutta's step on the same equations leaves "
        f"{amount(smooth.at(near) / at_100.at(near))} of it at {near:g}°.",
        (
            *(
                Evidence(f"error at a pitch of {p:g}°, 100 Hz", e, "°")
                for p, e in zip(APPROACH_PITCHES, grown, strict=True)
            ),
            *(Evidence(f"error at {near:g}°, {a.rate:g} Hz", a.at(near), "°") for a in found),
            Evidence("order in the step, at 60°", order),
            Evidence(f"power of 1/cos(pitch), {near:g}° to {nearer:g}°", steepness),
            Evidence(f"error at {near:g}° with Runge-Kutta's step", smooth.at(near), "°"),
        ),
        "fig4-approach",
    )
