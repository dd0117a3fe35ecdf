"""Fig. 4: Euler-Krylov on the way to a pitch of 90°, and direction cosines as the reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.alexiev.motions import NONE, algorithm_history, final_error, scenario_motion
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
from strapdown.attitude_algorithms import AttitudeAlgorithm, EulerKrylov
from strapdown.increments import increments_from_imu
from strapdown.rotation import within_half_turn
from strapdown.simulation import simulate_imu
from strapdown.tables import QUATERNION, increments_table

Array = NDArray[np.float64]

RATES = (10.0, 50.0, 100.0, 1000.0, 10_000.0)  # Hz
NUMBERS = (
    "x 0.1 rad/s and y 2 rad/s, both on [2 s, 3 s), as the text says; start level, 5 s, no noise."
)


def greatest_pitch() -> float:
    """Return the greatest true pitch of the motion, deg."""
    motion = scenario_motion("alexiev-fig4")
    time = np.linspace(2.0, 3.0, 100_001)
    return float(rotation.euler_from_quaternion(motion.attitude(time))[:, 1].max())


def start_rate_error(rate: float, algorithm: AttitudeAlgorithm | None = None) -> float:
    """Return the final error in deg with the rate at the start of each step instead of a mean."""
    motion = scenario_motion("alexiev-fig4")
    time = np.arange(round(motion.duration * rate) + 1) / rate
    dt = np.diff(time)
    steps = increments_table(time[1:], dt, motion.rate(time[:-1]) * dt[:, None])
    found = algorithm_history(algorithm or EulerKrylov(), steps, motion.attitude([0.0])[0])
    return float(rotation.rotation_angle(found[-1], motion.attitude(time[-1:])[0]))


def table() -> Table:
    """Return the final errors at the numbers of the text."""
    motion, closed = scenario_motion("alexiev-fig4"), scenario_motion("alexiev-fig4-closed")
    rows = tuple(
        (
            f"{rate:g} Hz",
            (
                final_error(motion, "euler", rate),
                start_rate_error(rate),
                final_error(motion, "euler", rate, sampling="mean"),
                final_error(motion, "euler:step=rk4", rate),
                final_error(motion, "naive", rate),
                final_error(motion, "dcm", rate),
                final_error(motion, "quaternion", rate),
                final_error(closed, "dcm", rate),
            ),
        )
        for rate in RATES
    )
    return Table(
        "fig4",
        "Fig. 4 in numbers",
        "Final error in degrees against the exact attitude exp([0.1, 2, 0]). Euler-Krylov three "
        "ways: with the mean of the rates at both ends of a step (trapezoid), with the rate at "
        "its start, and with the exact increment. The last column is the same motion sampled "
        "with the pulse closed, [2 s, 3 s]: one sample too many, which is no algorithm's error.",
        (
            "rate",
            "euler, °",
            "euler, rate at start, °",
            "euler, exact increments, °",
            "euler, Runge-Kutta, °",
            "naive, °",
            "dcm, °",
            "quaternion, °",
            "dcm, pulse closed, °",
        ),
        rows,
    )


def time_figure(rate: float = 100.0) -> Figure:
    """Return Fig. 4 as the paper has it: angles over time by Euler-Krylov and DCM."""
    motion = scenario_motion("alexiev-fig4")
    imu, truth = simulate_imu(motion, NONE, rate=rate, accelerometer=False)
    steps = increments_from_imu(imu)
    time = truth.index.to_numpy(dtype=np.float64)
    q = truth[QUATERNION].to_numpy()
    rates = np.degrees(motion.rate(time))
    angles = {
        "euler": _angles(algorithm_history("euler", steps, q[0])),
        "dcm": _angles(algorithm_history("dcm", steps, q[0])),
        "truth": _angles(q),
    }
    panels = [
        FigurePanel(
            "gyro, deg/s",
            tuple(Trace(f"gyro {axis}", time, rates[:, k]) for k, axis in enumerate("xyz")),
        )
    ]
    panels += [
        FigurePanel(
            f"{name}, deg",
            tuple(
                Trace(who, time, values[:, k], reference=who == "truth")
                for who, values in angles.items()
            ),
        )
        for k, name in enumerate(("roll", "pitch", "heading"))
    ]
    return Figure(
        "fig4",
        "Fig. 4, Euler-Krylov at the pole",
        f"At {rate:g} Hz. The jumps of roll and heading near 2.8 s are true: beyond the greatest "
        "pitch both turn by nearly half a turn. DCM lies on the truth.",
        NUMBERS,
        "time, s",
        tuple(panels),
    )


def _angles(q: Array) -> Array:
    """Roll, pitch, heading in deg, without jumps of a whole turn."""
    angles = rotation.euler_from_quaternion(q)
    return np.degrees(np.unwrap(np.radians(angles), axis=0))


def unstable(rates: tuple[float, ...], errors: Array, exact: Array) -> Statement:
    """Judge that Euler-Krylov is unstable around 90°.

    Parameters
    ----------
    rates : tuple of float, Hz
    errors : ndarray, deg
        Of Euler-Krylov at each rate.
    exact : ndarray, deg
        Of direction cosines at each rate.
    """
    erratic = bool(np.any(np.diff(errors) > 0.0))
    worse = bool(np.all(errors > 1e3 * np.maximum(exact, 1e-12)) and errors.max() > 1.0)
    worst = int(np.argmax(errors))
    return Statement(
        "euler-unstable",
        "Section 5",
        "The attitude calculation through Euler-Krylov algorithm again proved its instability "
        "around 90°.",
        HOLDS if erratic and worse else DOES_NOT_HOLD,
        "",
        "On Fig. 4 its error does not even fall with the rate: it depends on how near a sample "
        f"comes to the pole, and is largest at {rates[worst]:g} Hz. Direction cosines are right "
        "on the same samples.",
        (
            *(
                Evidence(f"Euler-Krylov at {r:g} Hz", float(e), "°")
                for r, e in zip(rates, errors, strict=True)
            ),
            Evidence("largest error of DCM at these rates", float(exact.max()), "°"),
        ),
        "fig4",
    )


def crosses(greatest: float, summed: float) -> Statement:
    """Judge that Fig. 4 crosses 90°, from its greatest pitch and the sum of the y gyro, deg."""
    if greatest >= 90.0 - 1e-6:
        verdict, condition = HOLDS, ""
    elif summed >= 90.0:
        verdict = HOLDS_WHEN
        condition = (
            "the integral of the y gyro is meant; the true pitch of the motion reaches "
            f"{amount(greatest, '°')}"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig4-crosses-90",
        "Section 5, Fig. 4",
        "The value of turn rate is especially chosen to cross the sensitive value of 90° in 1 s.",
        verdict,
        condition,
        f"The y gyro sums to {amount(summed, '°')}, but the turn is about an axis that is "
        f"not square to x, and the true pitch never exceeds {amount(greatest, '°')}; it comes "
        f"within {amount(90.0 - greatest, '°')} of the pole, which is enough.",
        (
            Evidence("greatest true pitch", greatest, "°"),
            Evidence("sum of the y gyro", summed, "°"),
        ),
        "fig4",
    )


def incorrect(at_100: float, exact: float) -> Statement:
    """Judge that Euler-Krylov's result of Fig. 4b is wrong, from both errors in deg."""
    return Statement(
        "fig4-incorrect",
        "Section 5, Fig. 4b",
        "The result of differentiation using Euler-Krylov algorithm is incorrect",
        HOLDS if at_100 > 0.1 and at_100 > 1e3 * exact else DOES_NOT_HOLD,
        "",
        "The paper gives no rate for Fig. 4; at 100 Hz, that of its Fig. 5, the final attitude "
        "is off, and an error that is made near the pole stays.",
        (Evidence("Euler-Krylov at 100 Hz", at_100, "°"), Evidence("DCM at 100 Hz", exact, "°")),
        "fig4",
    )


def reference(exact: Array, closed_100: float, jump: float) -> Statement:
    """Judge that direction cosines are correct on Fig. 4.

    Parameters
    ----------
    exact : ndarray, deg
        Their final errors at all rates, edges of the pulse on samples.
    closed_100 : float, deg
        The same at 100 Hz with the pulse closed.
    jump : float, deg
        What one sample too many is worth: the rate times half a step, on both sides.
    """
    right = bool(exact.max() < 1e-6)
    only_sampling = abs(closed_100 - jump) < 1e-3 * jump
    if right and closed_100 > 1e-6 and only_sampling:
        verdict, condition = HOLDS_WHEN, "both edges of the pulse fall where the samples say"
    else:
        verdict, condition = (HOLDS if right else DOES_NOT_HOLD), ""
    return Statement(
        "fig4-dcm-reference",
        "Section 5, Fig. 4c",
        "On figure 4c the correct result of differentiation DCM is shown as a reference.",
        verdict,
        condition,
        "With the pulse on [2 s, 3 s) DCM ends on the exact attitude to rounding at every rate. "
        "With a sample more, at 3 s, it is off by the turn that this sample claims, as is every "
        "algorithm: an error of sampling.",
        (
            Evidence("largest error of DCM, 10 Hz to 10 kHz", float(exact.max()), "°"),
            Evidence("with the pulse closed, 100 Hz", closed_100, "°"),
            Evidence("one sample's worth of turn at 100 Hz", jump, "°"),
        ),
        "fig4",
    )


# ==================================================================================================
# Fig. 4 before 90°: how the error of Euler-Krylov grows towards the pole
# ==================================================================================================

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
