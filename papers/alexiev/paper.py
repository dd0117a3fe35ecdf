"""Alexiev (2021), reproduced: every testable statement with a verdict from numbers of this run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from papers.alexiev import fig4, fig5, fig6, formulas, growth, motions, real_log
from papers.alexiev.motions import (
    NONE,
    algorithm_history,
    errors_over_time,
    final_error,
    scenario_motion,
)
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Part,
    Progress,
    Reproduction,
    amount,
    put_together,
    silent,
)
from strapdown import rotation
from strapdown.increments import increments_from_imu
from strapdown.simulation import simulate_imu
from strapdown.tables import QUATERNION

PAPER = (
    "K. Alexiev, Algorithms for IMU Navigation – A Review, Information Technologies and Control, "
    "January 2021"
)


CONVENTIONS = (
    (
        "Motions",
        "simulated, with the exact attitude at every instant; a real log only where it is said",
    ),
    ("Error", "rotation angle |log(C_est^T C_ref)| in degrees, whatever the axis"),
    ("Angles", "3-2-1: heading 0–360° clockwise from north, pitch ±90° nose up, roll ±180°"),
    (
        "Samples",
        "rates at the stamp, increments by the trapezoid of Eq. (2), where nothing else is said",
    ),
    ("Body axes", "x forward, y right, z down; q_nb and C_nb turn from body to local level"),
    (
        "Curves",
        "the paper's figures did not survive scanning; no curve of it is claimed to be matched",
    ),
)

# As they stand in the paper.
ORDER = (
    *("compromise", "gyros-lead", "growth-accel", "growth-attitude", "growth-gyro"),
    *("modest-goals", "reference-points", "earth-rate", "eq3", "eq8-10", "eq11-sigma"),
    *("eq12-15-17", "eq18-19", "eq20-22", "real-data", "naive-high-rate", "euler-unstable"),
    *("dcm-quaternion-excellent", "fig4-crosses-90", "fig4-incorrect", "fig4-before-90"),
    *("fig4-dcm-reference", "fig5-very-good", "fig5-low-rate", "fig6-stable"),
    *("fig6-not-sensor-nor-algorithm", "fig6-rate-is-the-reason", "naive-in-practice"),
)


def reproduce_alexiev(progress: Progress = silent) -> Reproduction:
    """Re-make Figs. 2, 4, 5 and 6 of Alexiev (2021) and judge its statements.

    Parameters
    ----------
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    Reproduction
        Simulated throughout, the same numbers every time. The paper's figures did not survive
        scanning: parameters that its text does not give are chosen here, and stand in each
        figure. No curve of the paper is claimed to be matched; its statements are judged.
    """
    parts: tuple[tuple[str, Callable[[], Part]], ...] = (
        ("Fig. 2 and all motions", _motions),
        ("formulas", _formulas),
        ("Fig. 4", _fig4),
        ("Fig. 5 and the naive sum", _naive),
        ("Fig. 6", _fig6),
        ("growth of errors", _growth),
        ("effort", _effort),
        ("a real log", real_log.real_log),
    )
    statements, tables, figures = put_together(
        parts, lambda stage, share: progress(stage, 0.8 * share)
    )
    statements.sort(key=lambda s: ORDER.index(s.key))
    made = Reproduction(
        "alexiev", PAPER, "", tuple(statements), tuple(tables), tuple(figures), CONVENTIONS
    )
    return replace(made, headline=headline(made))


def headline(made: Reproduction) -> str:
    """Say what came of it, and what follows for an application."""
    found = {s.key: s for s in made.statements}
    cycles = {e.what.split(",")[0]: e.value for e in found["compromise"].evidence}
    share = cycles["quaternion"] / cycles["euler"]
    turn = found["naive-high-rate"].evidence[-1].shown
    slow = found["fig6-rate-is-the-reason"].evidence[0].shown
    bounds = made.count(HOLDS_WHEN)
    return (
        f"Of {len(made.statements)} statements {made.count(HOLDS)} hold as they stand, {bounds} "
        f"within bounds that are named, {made.count(DOES_NOT_HOLD)} do not hold, and "
        f"{made.count(CANNOT_BE_JUDGED)} cannot be judged without the paper's own data. For an "
        f"application: the quaternion costs {amount(100.0 * share, '%')} of Euler-Krylov and is "
        "right wherever the rate keeps up with the motion; the naive sum is good to 1° for turns "
        f"under {turn} about two axes, at any rate; 20 Hz is too slow for a hand in a hurry "
        f"({slow})."
    )


def _formulas() -> Part:
    residual = formulas.worst_kinematics(transposed=True)
    return (
        [
            formulas.product_as_printed(
                formulas.worst_attitude(transposed=False),
                formulas.worst_attitude(transposed=True),
                residual,
            ),
            formulas.kinematics_as_printed(residual),
            formulas.sigma_as_printed(*formulas.increments_as_printed()),
            formulas.exponential_at_zero(
                formulas.exponential(0.0)[0],
                formulas.coefficient_loss(1e-8),
                formulas.coefficient_loss(0.01),
            ),
            formulas.quaternion_equations(formulas.poisson_difference()),
            formulas.series(formulas.truncated()),
        ],
        [],
        [],
    )


def _fig4() -> Part:
    table = fig4.table()
    columns = dict(zip(table.columns[1:], np.array([row for _, row in table.rows]).T, strict=True))
    at_100 = fig4.RATES.index(100.0)
    approaches = tuple(fig4.approach(rate) for rate in fig4.APPROACH_RATES)
    smooth = fig4.approach(100.0, "rk4")
    pulses = scenario_motion("alexiev-fig4").rate([2.5])[0]
    return (
        [
            fig4.unstable(fig4.RATES, columns["euler, °"], columns["dcm, °"]),
            fig4.crosses(fig4.greatest_pitch(), float(np.degrees(pulses[1]))),
            fig4.incorrect(columns["euler, °"][at_100], columns["dcm, °"][at_100]),
            fig4.before_ninety(approaches, smooth),
            fig4.reference(
                columns["dcm, °"],
                columns["dcm, pulse closed, °"][at_100],
                float(np.degrees(np.hypot(pulses[0], pulses[1]) / 100.0)),
            ),
        ],
        [table],
        [fig4.time_figure(), fig4.approach_figure(approaches, smooth)],
    )


def _naive() -> Part:
    small, large = (scenario_motion(n) for n in ("alexiev-fig5", "alexiev-fig5-large"))
    high, high_large = (fig5.compare(m, fig5.HIGH) for m in (small, large))
    low, low_large = (fig5.compare(m, fig5.LOW) for m in (small, large))
    return (
        [
            fig5.good_at_high_rate(
                high.naive,
                final_error(small, "naive", 10_000.0),
                high_large.naive,
                final_error(large, "naive", 10_000.0),
                fig5.angle_for(fig5.GOOD, "together"),
                fig5.angle_for(fig5.GOOD, "x then y"),
            ),
            fig5.very_good_at_high_rate(high, high_large),
            fig5.differs_at_low_rate(low, high, low_large, fig5.over_many_motions()),
        ],
        [fig5.table()],
        [fig5.figure(), fig5.angle_figure(), fig5.rate_figure()],
    )


def _fig6() -> Part:
    record = fig6.record()
    found = tuple(fig6.decimate(record, factor) for factor in fig6.FACTORS)
    fast, slow = found[0], found[fig6.FACTORS.index(fig6.PAPER_FACTOR)]
    sensors = tuple(fig6.sensor_cost(name) for name in fig6.phone_gyros())
    motion = scenario_motion("alexiev-fig6")
    _, error = errors_over_time(motion, "dcm", slow.rate)
    at_nine = round(fig6.UNTIL * slow.rate)
    return (
        [
            fig6.stable_at_rest(sensors),
            fig6.neither_sensor_nor_algorithm(slow, _apart(slow.rate), sensors),
            fig6.rate_is_the_reason(slow, fast, sensors),
            fig6.reference_points(
                *fig6.scale_seen(),
                float(error[at_nine]),
                float(error[: at_nine + 1].max()),
            ),
        ],
        [fig6.rate_table(found), fig6.sensor_table(sensors)],
        [
            fig6.time_figure(),
            fig6.rate_figure(found, float(np.median([c.moving for c in sensors]))),
        ],
    )


def _growth() -> Part:
    laws = growth.laws()
    return (
        [
            growth.gyros_lead(growth.crossovers()),
            growth.accel_growth(laws.accel, laws.accel_turning),
            growth.attitude_growth(laws.tilt, laws.tilt_turning),
            growth.gyro_growth(laws.gyro, laws.gyro_vertical),
            growth.earth_rate_small(growth.gyro_biases()),
        ],
        [],
        [growth.figure(laws)],
    )


def _motions() -> Part:
    table = motions.scenario_table()
    motion = scenario_motion("alexiev-fig6")
    exact = max(
        final_error(scenario_motion(name), algorithm, 100.0, sampling="mean")
        for name in ("alexiev-fig2a", "alexiev-fig2b", "alexiev-fig2c", "alexiev-fig4")
        for algorithm in ("dcm", "quaternion")
    )
    return (
        [
            motions.excellent(
                exact,
                _apart(20.0),
                final_error(motion, "dcm", 20.0),
                final_error(motion, "dcm", 1000.0),
                20.0,
                1000.0,
            ),
            motions.practical(table),
        ],
        [table],
        [motions.figure()],
    )


def _effort() -> Part:
    costs = motions.costs()
    return [motions.compromise(costs), *motions.unpublished()], [motions.cost_table(costs)], []


def _apart(rate: float) -> float:
    """Largest angle in deg between direction cosines and quaternion on the motion of Fig. 6."""
    imu, truth = simulate_imu(scenario_motion("alexiev-fig6"), NONE, rate=rate, accelerometer=False)
    steps = increments_from_imu(imu)
    start = truth[QUATERNION].to_numpy()[0]
    dcm, quaternion = (algorithm_history(a, steps, start) for a in ("dcm", "quaternion"))
    return float(rotation.rotation_angle(dcm, quaternion).max())
