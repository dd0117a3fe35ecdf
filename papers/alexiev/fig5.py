"""Fig. 5: the naive sum against direction cosines at 5 Hz and at 100 Hz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from papers.alexiev.motions import NONE, algorithm_history, final_error, scenario_motion, sweep
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
from strapdown.simulation import Motion, Pulse, PulseMotion, simulate_imu
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]

LOW, HIGH = 5.0, 100.0  # Hz, of the paper
RATES = (5.0, 10.0, 20.0, 50.0, 100.0, 1000.0)  # Hz
MOTIONS, MOTIONS_SEED = 120, 5
GROWN = 1.5  # times as far apart at the low rate: then the rate tells the two from each other
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


@dataclass(frozen=True)
class OverManyMotions:
    """How far naive sum and direction cosines are apart at both rates, on random motions.

    Attributes
    ----------
    low, high : ndarray, (n,), deg
        Angle between the two at the end, at 5 Hz and at 100 Hz.
    """

    low: Array
    high: Array

    @property
    def grown(self) -> NDArray[np.bool_]:
        """Where the low rate makes the difference at least half as large again."""
        return np.asarray(self.low > GROWN * self.high)


def over_many_motions(count: int = MOTIONS) -> OverManyMotions:
    """Compare both algorithms on random motions of three overlapping pulses."""
    rng = np.random.default_rng(MOTIONS_SEED)
    found = []
    for _ in range(count):
        pulses = []
        for axis in range(3):
            # Each begins before any ends: all three overlap.
            start = rng.uniform(2.0, 3.0)
            end = max(3.0, start + rng.uniform(0.5, 1.5))
            pulses.append(Pulse(axis, start, end, rng.uniform(-0.15, 0.15)))
        motion = PulseMotion(tuple(pulses), 5.0)
        found.append([compare(motion, rate).apart for rate in (LOW, HIGH)])
    low, high = np.array(found).T
    return OverManyMotions(low, high)


def differs_at_low_rate(
    low: Compared, high: Compared, large_low: Compared, many: OverManyMotions
) -> Statement:
    """Judge that a low rate tells the naive sum from direction cosines.

    Parameters
    ----------
    low, high : Compared
        On the same motion at 5 Hz and at 100 Hz.
    large_low : Compared
        On ten times the rates at 5 Hz.
    many : OverManyMotions
        On random overlapping motions at both rates.
    """
    share = float(many.grown.mean())
    usual = float(np.median(many.high))
    bound = float(many.high[many.grown].max(initial=0.0))
    if share > 0.5:
        verdict, condition = HOLDS, ""
    elif share > 0.0:
        verdict = HOLDS_WHEN
        condition = (
            f"the turns nearly commute: in {amount(100.0 * share, '%')} of {many.high.size} random "
            f"overlapping motions, in which the two are at most {amount(bound, '°')} apart at "
            f"{high.rate:g} Hz (median of all: {amount(usual, '°')})"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig5-low-rate",
        "Section 5, Figs. 5b and 5c",
        "The difference of quality was determined in lower measurement rate",
        verdict,
        condition,
        f"The two algorithms end {amount(low.apart, '°')} apart at {low.rate:g} Hz and "
        f"{amount(high.apart, '°')} at {high.rate:g} Hz: the difference of quality is the same, "
        "because commutation does not depend on the rate; so it is on most random motions. "
        "What a low rate adds is sampling error, in both, DCM included.",
        (
            Evidence("naive and DCM apart at 5 Hz", low.apart, "°"),
            Evidence("naive and DCM apart at 100 Hz", high.apart, "°"),
            Evidence("naive at 5 Hz", low.naive, "°"),
            Evidence("DCM at 5 Hz", low.dcm, "°"),
            Evidence("DCM at 5 Hz, ten times the rates", large_low.dcm, "°"),
            Evidence("random motions that 5 Hz part by half as much again", 100.0 * share, "%"),
            Evidence("of those, largest difference at 100 Hz", bound, "°"),
            Evidence("of all, median difference at 100 Hz", usual, "°"),
        ),
        "fig5",
    )


# ==================================================================================================
# The naive sum and the error that no rate removes: rotations do not commute
# ==================================================================================================

X, Y = 0, 1
RATE = 100.0  # Hz
ANGLES = np.geomspace(1.0, 120.0, 22)  # deg
SMALL = 10.0  # deg: the closed form is held to a percent up to here
SWEPT_RATES = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 10_000.0)  # Hz
GOOD = 1.0  # deg
_FLOOR = 1e-9  # deg: a logarithmic axis has no zero


def two_turns(angle_deg: float, order: str) -> PulseMotion:
    """Turn by the same angle about x and y.

    Parameters
    ----------
    angle_deg : float
    order : {'together', 'x then y', 'y then x'}

    Returns
    -------
    PulseMotion
        Each turn lasts a second, with edges on the grid of any whole rate.
    """
    rate = np.radians(angle_deg)
    x_start, y_start = {"together": (1.0, 1.0), "x then y": (1.0, 2.0), "y then x": (2.0, 1.0)}[
        order
    ]
    return PulseMotion(
        (Pulse(X, x_start, x_start + 1.0, rate), Pulse(Y, y_start, y_start + 1.0, rate)), 4.0
    )


def measured(angles_deg: ArrayLike, order: str) -> Array:
    """Return the naive error in deg at the end of two turns, for each angle."""
    return np.array(
        [
            final_error(two_turns(float(a), order), "naive", RATE, sampling="mean")
            for a in np.asarray(angles_deg)
        ]
    )


def closed_form(angles_deg: ArrayLike, order: str) -> Array:
    """Return the naive error of two small turns, deg.

    Parameters
    ----------
    angles_deg : array_like
    order : str
        As `two_turns`.

    Returns
    -------
    ndarray
        ``|θ1 × θ2| / 2`` together, ``|θ1 × θ2|`` for x then y, and zero for y then x, which is
        the order in which 3-2-1 angles are read (Baker-Campbell-Hausdorff, second order).
    """
    theta = np.radians(np.asarray(angles_deg, dtype=np.float64))
    share = {"together": 0.5, "x then y": 1.0, "y then x": 0.0}[order]
    return np.degrees(share * theta * theta)


def angle_for(error_deg: float, order: str) -> float:
    """Return the turn in deg about each axis at which the naive error is `error_deg`."""
    low, high = 0.01, 90.0
    # Monotonic up to a quarter turn; 40 halvings end far below what is shown.
    for _ in range(40):
        middle = 0.5 * (low + high)
        if naive_reading_error(middle, order) < error_deg:
            low = middle
        else:
            high = middle
    return low


def naive_reading_error(angle_deg: float, order: str) -> float:
    """Return the error in deg of exact sums of the gyros, read as roll, pitch and heading."""
    motion = two_turns(angle_deg, order)
    read = rotation.quaternion_from_euler([angle_deg, angle_deg, 0.0])
    return float(rotation.rotation_angle(read, motion.attitude([motion.duration])[0]))


def angle_figure() -> Figure:
    """Return the naive error against the angle of two turns, with its closed form."""
    traces = []
    for order in ("x then y", "together"):
        traces.append(Trace(f"naive, {order}", ANGLES, measured(ANGLES, order), points=True))
        traces.append(
            Trace(f"closed form, {order}", ANGLES, closed_form(ANGLES, order), reference=True)
        )
    return Figure(
        "naive-angle",
        "What the naive sum costs: two turns about two axes",
        "Final error of the naive sum from exact increments. Small turns together leave "
        "½|θ₁ × θ₂|, one after the other in the wrong order |θ₁ × θ₂|, and in the order y then x, "
        "in which 3-2-1 angles are read, nothing at all.",
        "The same angle about x and about y, one second each.",
        "turn about each axis, deg",
        (FigurePanel("error, deg", tuple(traces), log=True),),
        x_log=True,
    )


def rate_figure() -> Figure:
    """Return the final error against the rate on the two motions of Fig. 5."""
    rates = np.array(SWEPT_RATES)
    panels = []
    for name, label in (("alexiev-fig5", "small"), ("alexiev-fig5-large", "large")):
        motion = scenario_motion(name)
        traces = tuple(
            Trace(a, rates, np.maximum(sweep(motion, a, rates), _FLOOR))
            for a in ("naive", "euler", "dcm")
        )
        panels.append(FigurePanel(f"error, deg; {label} turns", traces, log=True))
    return Figure(
        "naive-rate",
        "No rate removes it",
        "Final error against the rate, on the motion of Fig. 5 and on ten times its rates. DCM "
        "falls with the square of the step, Euler-Krylov with the step; the naive sum stays where "
        "it is. Below 50 Hz the edges of the pulses are off the grid of the samples.",
        "Pulses about x, y, z overlapping: 0.10 rad/s on [2.07, 3.53), −0.05 on [2.51, 4.13), 0.15 "
        "on [2.93, 3.77) s, turns of 5° to 8°; below, ten times that.",
        "rate, Hz",
        tuple(panels),
        x_log=True,
    )


def good_at_high_rate(
    at_100: float, at_10k: float, large_100: float, large_10k: float, small: float, wrong: float
) -> Statement:
    """Judge that the naive sum is good especially at a high rate.

    Parameters
    ----------
    at_100, at_10k : float, deg
        On turns of a few degrees about three axes, at 100 Hz and at 10 kHz.
    large_100, large_10k : float, deg
        On turns ten times as large.
    small : float, deg
        Turn about each of two axes together that leaves an error of 1°.
    wrong : float, deg
        The same for two turns one after the other in the wrong order.
    """
    falls = at_10k < 0.5 * at_100 and large_10k < 0.5 * large_100
    if falls:
        verdict, condition = HOLDS, ""
    elif min(at_100, at_10k) < 2.0:
        verdict = HOLDS_WHEN
        condition = (
            f"the turns about two axes stay under some {wrong:.0f}° (1° of error) or the turn is "
            "about one axis; the rate has no part in it"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "naive-high-rate",
        "Section 5",
        "naive integration approach for attitude calculation, in spite of its simplicity, showed "
        "good results especially for high measurement rate",
        verdict,
        condition,
        "Its error is that rotations do not commute: ½|θ₁ × θ₂| for small turns together, "
        "|θ₁ × θ₂| for one after the other. A hundred times the rate leaves it as it is.",
        (
            Evidence("turns of 5° to 8°, 100 Hz", at_100, "°"),
            Evidence("the same, 10 kHz", at_10k, "°"),
            Evidence("turns of 46° to 84°, 100 Hz", large_100, "°"),
            Evidence("the same, 10 kHz", large_10k, "°"),
            Evidence("turn about each of two axes together that costs 1°", small, "°"),
            Evidence("the same, one after the other", wrong, "°"),
        ),
        "naive-angle",
    )
