"""Samples of a motion, algorithms over them, and the errors that come of it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

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
from strapdown import rotation
from strapdown.attitude_algorithms import (
    AttitudeAlgorithm,
    Cost,
    attitude_history,
    count_cost,
    make_algorithm,
)
from strapdown.increments import increments_from_imu
from strapdown.simulation import ImuErrors, Motion, find_scenario, simulate_imu
from strapdown.tables import GYRO, QUATERNION

Array = NDArray[np.float64]


NONE = ImuErrors()
FOUR = ("naive", "euler", "dcm", "quaternion")


def scenario_motion(name: str) -> Motion:
    """Return the motion of a scenario."""
    return find_scenario(name).motion


def algorithm_history(
    algorithm: str | AttitudeAlgorithm, increments: pd.DataFrame, q_nb: ArrayLike
) -> Array:
    """Return quaternions at the start and after each step, (n+1, 4)."""
    made = make_algorithm(algorithm) if isinstance(algorithm, str) else algorithm
    return attitude_history(made, increments, q_nb)


def errors_over_time(
    motion: Motion,
    algorithm: str | AttitudeAlgorithm,
    rate: float,
    *,
    sampling: str = "instantaneous",
    interpolation: str = "linear",
    errors: ImuErrors = NONE,
    seed: int = 0,
) -> tuple[Array, Array]:
    """Run an algorithm over samples of a motion, from its true attitude at time zero.

    Parameters
    ----------
    motion : Motion
    algorithm : str or AttitudeAlgorithm
    rate : float, Hz
    sampling, interpolation : str
        As `simulate_imu` and `increments_from_imu`.
    errors : ImuErrors
    seed : int

    Returns
    -------
    time : ndarray, (n,), s
    error : ndarray, (n,), deg
        Rotation angle from the exact attitude.
    """
    imu, truth = simulate_imu(
        motion, errors, rate=rate, sampling=sampling, seed=seed, accelerometer=False
    )
    known = truth[QUATERNION].to_numpy()
    found = algorithm_history(algorithm, increments_from_imu(imu, interpolation), known[0])
    return truth.index.to_numpy(dtype=np.float64), rotation.rotation_angle(found, known)


def final_error(
    motion: Motion, algorithm: str | AttitudeAlgorithm, rate: float, **how: object
) -> float:
    """Return the error in deg at the end; options as `errors_over_time`."""
    return float(errors_over_time(motion, algorithm, rate, **how)[1][-1])  # type: ignore[arg-type]


def sweep(
    motion: Motion, algorithm: str | AttitudeAlgorithm, rates: ArrayLike, **how: object
) -> Array:
    """Return the final error in deg at each of the rates; options as `errors_over_time`."""
    return np.array([final_error(motion, algorithm, float(r), **how) for r in np.asarray(rates)])


# ==================================================================================================
# Fig. 2: the generated gyro data, and what the four algorithms make of each panel
# ==================================================================================================

PANELS = tuple(f"alexiev-fig2{letter}" for letter in "abcdef")
# Error-free motions on which the closing sentence on the naive sum is judged.
PRACTICAL = (
    "alexiev-fig2a",
    "alexiev-sequence",
    "alexiev-fig2b",
    "alexiev-fig2c",
    "alexiev-fig4",
    "alexiev-fig5",
    "alexiev-fig5-large",
    "alexiev-fig6",
    "gestures",
    "smooth-random",
)
RATE = 100.0  # Hz
GOOD = 2.0  # deg: what is called a good estimate here


def figure() -> Figure:
    """Return Fig. 2: turn rate versus time, six panels."""
    panels = []
    for name in PANELS:
        scenario = find_scenario(name)
        imu, _ = simulate_imu(scenario.motion, scenario.errors, rate=RATE, accelerometer=False)
        time = imu.index.to_numpy(dtype=np.float64)
        traces = tuple(
            Trace(f"gyro {axis}", time, np.degrees(imu[column].to_numpy()))
            for axis, column in zip("xyz", GYRO, strict=True)
        )
        panels.append(FigurePanel(f"{name[-1]}: deg/s", traces))
    return Figure(
        "fig2",
        "Fig. 2, generated gyro data",
        "a: one axis; b: two axes overlapping; c: three axes overlapping; d: c with noise; e: b "
        "with noise and bias; f: b with noise and a different trend on each axis.",
        "Shapes by the caption, numbers ours: a z 1 rad/s for 2 s; b x 0.8, y −0.6 rad/s; c x 0.3, "
        "y 0.7, z 1.5 rad/s; noise 0.001 rad/s/√Hz; bias 0.02, −0.03, 0.01 rad/s; trend 0.01, "
        "−0.02, 0.005 rad/s². 100 Hz, seed 0.",
        "time, s",
        tuple(panels),
    )


def scenario_table() -> Table:
    """Return the errors at the end of every scenario by the four algorithms, at 100 Hz."""
    rows = []
    for name in (*PANELS, *(n for n in PRACTICAL if n not in PANELS)):
        scenario = find_scenario(name)
        rows.append(
            (
                name,
                tuple(
                    float(errors_over_time(scenario.motion, a, RATE, errors=scenario.errors)[1][-1])
                    for a in FOUR
                ),
            )
        )
    return Table(
        "scenarios",
        "The four algorithms on every motion",
        "Final error in degrees at 100 Hz, rates at the stamp. Panels d, e and f have errors of "
        "the sensor, which no algorithm removes.",
        ("motion", *(f"{a}, °" for a in FOUR)),
        tuple(rows),
    )


def practical(table: Table) -> Statement:
    """Judge the closing sentence on the naive sum from the table of errors."""
    at = table.columns.index("naive, °") - 1
    errors = {name: row[at] for name, row in table.rows if name in PRACTICAL}
    known = {name: float(e) for name, e in errors.items() if e is not None}
    good = [name for name, e in known.items() if e < GOOD]
    largest = max(known, key=lambda name: known[name])
    if len(good) == len(known):
        verdict, condition = HOLDS, ""
    elif good:
        verdict = HOLDS_WHEN
        condition = "turns are about one axis, or of a few degrees"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "naive-in-practice",
        "Section 6",
        "the simplest integration for attitude calculation also received good estimates and it "
        "can be applied in many practical cases",
        verdict,
        condition,
        f"Of {len(known)} motions without any error of a sensor, sampled at {RATE:g} Hz, the naive "
        f"sum ends within {GOOD:g}° of the truth on {len(good)}: {', '.join(good) or 'none'}.",
        (
            Evidence(f"motions within {GOOD:g}°", float(len(good))),
            Evidence("motions tried", float(len(known))),
            Evidence(f"largest error, on {largest}", known[largest], "°"),
        ),
    )


def excellent(
    fixed_axis: float, apart: float, slow: float, fast: float, slow_hz: float, fast_hz: float
) -> Statement:
    """Judge what the paper says of direction cosines and quaternion.

    Parameters
    ----------
    fixed_axis : float, deg
        Largest error on motions whose rate is constant between samples, increments exact.
    apart : float, deg
        Largest difference of the two on fast motion.
    slow, fast : float, deg
        Error of both on that motion at a low and at a high rate.
    slow_hz, fast_hz : float
    """
    exact = fixed_axis < 1e-6 and apart < 1e-6
    if exact and slow < 1.0:
        verdict, condition = HOLDS, ""
    elif exact and fast < slow:
        verdict = HOLDS_WHEN
        condition = "the rate is high enough for the motion"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "dcm-quaternion-excellent",
        "Section 5",
        "DCM differentiation and quaternion algorithms showed their excellent properties.",
        verdict,
        condition,
        "Where the axis of the turn stays within each step, both end on the exact attitude to "
        "rounding, and on any motion they agree with each other to rounding: they are one "
        "algorithm in two notations. Where the axis moves within a step, both are as far off as "
        f"the rate makes them: {amount(slow, '°')} at {slow_hz:g} Hz on the motion of Fig. 6.",
        (
            Evidence("largest error, axis fixed within each step", fixed_axis, "°"),
            Evidence("largest difference between the two", apart, "°"),
            Evidence(f"error on alexiev-fig6 at {slow_hz:g} Hz", slow, "°"),
            Evidence(f"the same at {fast_hz:g} Hz", fast, "°"),
        ),
        "fig6-rate",
    )


# ==================================================================================================
# What the algorithms cost, and what cannot be judged without the paper's own data
# ==================================================================================================


def costs() -> tuple[Cost, ...]:
    """Count the operations of the paper's four algorithms."""
    return tuple(count_cost(make_algorithm(name)) for name in FOUR)


def cost_table(found: tuple[Cost, ...]) -> Table:
    """Return the operations of one step."""
    return Table(
        "effort",
        "What a step costs",
        "Operations counted on the code itself while it ran, without forming the increment; "
        "cycles of a Cortex-M4F as a weight for ranking; numbers kept between samples.",
        (
            *("algorithm", "add", "multiply", "divide", "root"),
            *("sine, cosine", "cycles", "memory"),
        ),
        tuple(
            (
                c.algorithm,
                (c.add, c.multiply, c.divide, c.sqrt, c.trig, c.cycles, float(c.memory)),
            )
            for c in found
        ),
    )


def compromise(found: tuple[Cost, ...]) -> Statement:
    """Judge that there is a complex compromise between complexity and accuracy."""
    cycles = {c.algorithm: c.cycles for c in found}
    cheapest_right = min(("dcm", "quaternion"), key=lambda name: cycles[name])
    # The right ones cost less than Euler-Krylov: then the choice is between two, and simple.
    simple = cycles[cheapest_right] < cycles["euler"]
    trade = cycles["naive"] < cycles[cheapest_right]
    if trade and simple:
        verdict = HOLDS_WHEN
        condition = (
            f"the choice is between naive and {cheapest_right}: Euler-Krylov is dearer than what "
            "it is less accurate than"
        )
    else:
        verdict, condition = (HOLDS if trade else DOES_NOT_HOLD), ""
    return Statement(
        "compromise",
        "Abstract",
        "The article helps to resolve the complex compromise between the complexity of the "
        "algorithm and the accuracy of work",
        verdict,
        condition,
        f"The cheapest algorithm that is right, {cheapest_right}, costs "
        f"{amount(cycles[cheapest_right] / max(cycles['naive'], 1.0))} times the naive sum and "
        f"{amount(cycles[cheapest_right] / cycles['euler'])} times Euler-Krylov. On a processor "
        "that has these cycles to spare at its rate there is nothing to compromise.",
        tuple(Evidence(f"{name}, cycles a sample", value) for name, value in cycles.items()),
    )


def unpublished() -> tuple[Statement, ...]:
    """Return the statements on data and curves that the paper does not hand on."""
    return (
        Statement(
            "real-data",
            "Section 4, Fig. 3",
            "The real measurement sets received from gyros were taken from a smart phone.",
            CANNOT_BE_JUDGED,
            "",
            "Neither the logs nor the model of the phone are published, and no error is given as "
            "a number. Simulated motions with the same reference points stand in for them here.",
            (),
        ),
        Statement(
            "modest-goals",
            "Section 2",
            "The goals here are more modest and concern only the repeatability of algorithms, "
            "convergence to real attitude, algorithm efficiency, etc.",
            CANNOT_BE_JUDGED,
            "",
            "The paper gives no number for repeatability, convergence or efficiency. What this run "
            "measures of them stands in its tables.",
            (),
        ),
    )
