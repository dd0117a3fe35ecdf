"""Gyros of phones on the motion of Fig. 6, and what their biases mean elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.alexiev.motions import NONE, algorithm_history, errors_over_time, scenario_motion
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
from strapdown.increments import increments_from_imu
from strapdown.sensors import SENSORS, load_sensor
from strapdown.simulation import ImuErrors, Motion, Pulse, PulseMotion, TriadErrors, simulate_imu
from strapdown.tables import GYRO, QUATERNION, THETA, increments_table

SINCE, UNTIL = 5.0, 9.0  # s, reference points of the paper


SENSOR_RATE = 500.0  # Hz: what the rate costs there is far below what a sensor costs


UNITS = 5  # of each sensor


def phone_gyros() -> tuple[str, ...]:
    """Names of the catalogue's sensors for phones that have a data sheet; a grade has none."""
    phones = (one for one in map(load_sensor, SENSORS) if one.grade == "phone")
    return tuple(one.name for one in phones if any(figure.source for figure in one.sources))


@dataclass(frozen=True)
class SensorCost:
    """What the errors of one kind of sensor cost on this motion; medians over its units, deg.

    Attributes
    ----------
    sensor : str
    resting, resting_free : float
        Angle that is gathered over the first 5 s, and the same with the bias taken off.
    moving : float
        Error at 9 s of what began at 5 s, with the bias taken off.
    calibrated : float
        The same with scale factor and misalignment taken off, too.
    """

    sensor: str
    resting: float
    resting_free: float
    moving: float
    calibrated: float


def sensor_cost(name: str) -> SensorCost:
    """Run the motion through `UNITS` units of a sensor."""
    rows = []
    motion = scenario_motion("alexiev-fig6")
    for seed in range(UNITS):
        drawn = load_sensor(name).draw(seed).gyro
        calibrated = replace(drawn, scale=0.0, misalignment=TriadErrors().misalignment)
        raw, free, best = (
            _gathered(motion, gyro, seed, bias_off=off)
            for gyro, off in ((drawn, False), (drawn, True), (calibrated, True))
        )
        rows.append((raw[0], free[0], free[1], best[1]))
    return SensorCost(name, *np.median(np.array(rows), axis=0).tolist())


def _gathered(
    motion: Motion, gyro: TriadErrors, seed: int, *, bias_off: bool
) -> tuple[float, float]:
    """Angle in deg gathered up to 5 s, and from there to 9 s, by one unit."""
    imu, _ = simulate_imu(motion, ImuErrors(gyro), rate=SENSOR_RATE, seed=seed, accelerometer=False)
    if bias_off:
        imu[GYRO] = imu[GYRO] - imu.loc[imu.index < SINCE, GYRO].mean()
    q = algorithm_history("quaternion", increments_from_imu(imu), (1.0, 0.0, 0.0, 0.0))
    since, until = (round(t * SENSOR_RATE) for t in (SINCE, UNTIL))
    return (
        float(rotation.rotation_angle(q[0], q[since])),
        float(rotation.rotation_angle(q[since], q[until])),
    )


def sensor_table(found: tuple[SensorCost, ...]) -> Table:
    """Return what sensors of phones cost on the same motion."""
    return Table(
        "fig6-sensors",
        "Fig. 6: what the sensor alone costs",
        f"Medians in degrees over {UNITS} units of each sensor, drawn from its data sheet, at "
        f"{SENSOR_RATE:g} Hz: gathered over the first 5 s at rest, and from 5 s to 9 s. The bias "
        "is taken off with the mean of the first 5 s; calibrated: scale factor and misalignment, "
        "too.",
        (
            "sensor",
            "at rest, °",
            "at rest, bias off, °",
            "moving, bias off, °",
            "moving, calibrated, °",
        ),
        tuple((c.sensor, (c.resting, c.resting_free, c.moving, c.calibrated)) for c in found),
    )


def stable_at_rest(costs: tuple[SensorCost, ...], allowed: float = 0.5) -> Statement:
    """Judge that nothing is gathered over five seconds of rest.

    Parameters
    ----------
    costs : tuple of SensorCost
    allowed : float, deg
        What would not be seen in a plot of tens of degrees.
    """
    raw = float(np.median([c.resting for c in costs]))
    free = float(np.median([c.resting_free for c in costs]))
    if raw < allowed:
        verdict, condition = HOLDS, ""
    elif free < allowed:
        verdict = HOLDS_WHEN
        condition = (
            f"the gyro's bias has been taken off, to {amount(allowed / SINCE, '°/s')} or better"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig6-stable",
        "Section 5, Fig. 6",
        "The initial state of the phone was very stable at first 5 seconds without any "
        "accumulation of error.",
        verdict,
        condition,
        "Error-free samples gather nothing. A bare gyro of a phone gathers its bias times 5 s; "
        "phones take the bias off before an application sees the rates.",
        (
            Evidence("median over sensors, 5 s at rest, bias left in", raw, "°"),
            Evidence("the same, bias taken off", free, "°"),
        ),
        "fig6",
    )


# ==================================================================================================
# Fig. 6: intensive motion at 20 Hz, one pose at 5 s and at 9 s, and whose the error is
# ==================================================================================================

Array = NDArray[np.float64]

FAST = 1000.0  # Hz
FACTORS = (1, 2, 4, 5, 10, 20, 40, 50, 100)
PAPER_FACTOR = 50  # 20 Hz
LEADS = 2.0  # times as large: then it is the reason
_NUMBERS = (
    "alexiev-fig6: at rest to 5 s, then turned by hand as fast as it can be, up to 920 °/s, and "
    "back in the same pose from 9 s on; minimum-jerk angles between chosen poses. No error of a "
    "sensor. The record of 1 kHz is decimated."
)


@dataclass(frozen=True)
class AtRate:
    """What a rate costs at the second reference point.

    Attributes
    ----------
    rate : float, Hz
    dropped : float, deg
        Error at 9 s from samples of the rate, the others left out.
    averaged : float, deg
        The same from sums of the faster record's increments, as a sensor that integrates gives.
    cubic : float, deg
        From the dropped samples again, with the rate along a cubic between them.
    rotation_vector : float, deg
        From the sums again, with coning corrected over two increments.
    naive : float, deg
        Of the naive sum, from the dropped samples.
    """

    rate: float
    dropped: float
    averaged: float
    cubic: float
    rotation_vector: float
    naive: float


def decimate(record: pd.DataFrame, factor: int) -> AtRate:
    """Lower the rate of a record in both ways and compare the poses at 5 s and at 9 s.

    Parameters
    ----------
    record : DataFrame
        Imu table of alexiev-fig6 at `FAST`.
    factor : int
        One sample in so many is kept.
    """
    kept = np.arange(0, len(record), factor)
    few = record.iloc[kept]
    dropped = increments_from_imu(few)
    summed = sum_increments(increments_from_imu(record), kept)
    return AtRate(
        FAST / factor,
        _pose_error("dcm", dropped),
        _pose_error("dcm", summed),
        _pose_error("rk4", increments_from_imu(few, "cubic")),
        _pose_error("rotvec", summed),
        _pose_error("naive", dropped),
    )


def sum_increments(increments: pd.DataFrame, kept: NDArray[np.int64]) -> pd.DataFrame:
    """Add up the angle increments between samples, as a gyro that integrates would deliver them."""
    if len(kept) == len(increments) + 1:
        return increments
    begin = kept[:-1]
    return increments_table(
        increments.index.to_numpy(dtype=np.float64)[kept[1:] - 1],
        np.add.reduceat(increments["dt"].to_numpy(), begin),
        np.add.reduceat(increments[THETA].to_numpy(), begin, axis=0),
    )


def _pose_error(algorithm: str, steps: pd.DataFrame) -> float:
    """Angle in deg between the poses at 5 s and at 9 s, which are the same."""
    q = algorithm_history(algorithm, steps, (1.0, 0.0, 0.0, 0.0))
    time = np.append(0.0, steps.index.to_numpy(dtype=np.float64))
    since, until = (int(np.argmin(np.abs(time - t))) for t in (SINCE, UNTIL))
    return float(rotation.rotation_angle(q[since], q[until]))


def record() -> pd.DataFrame:
    """Return the samples of the motion at 1 kHz, without errors."""
    motion = scenario_motion("alexiev-fig6")
    return simulate_imu(motion, NONE, rate=FAST, accelerometer=False)[0]


def rate_table(found: tuple[AtRate, ...]) -> Table:
    """Return what each rate costs."""
    return Table(
        "fig6",
        "Fig. 6 in numbers: what the rate alone costs",
        "Angle in degrees between the poses at 5 s and at 9 s, which are the same. By leaving "
        "samples out, and by summing the increments of the faster record; then each with the "
        "algorithm of higher order that suits it.",
        (
            "rate",
            "dcm, dropped, °",
            "dcm, summed, °",
            "rk4 on cubic, dropped, °",
            "rotvec, summed, °",
            "naive, dropped, °",
        ),
        tuple(
            (
                f"{a.rate:g} Hz",
                (a.dropped, a.averaged, a.cubic, a.rotation_vector, a.naive),
            )
            for a in sorted(found, key=lambda a: a.rate)
        ),
    )


def time_figure() -> Figure:
    """Return angles and error over time at 20 Hz and at 100 Hz."""
    motion = scenario_motion("alexiev-fig6")
    fine = np.linspace(0.0, motion.duration, 2201)
    rates = np.degrees(motion.rate(fine))
    gyro = tuple(Trace(f"gyro {axis}", fine, rates[:, k]) for k, axis in enumerate("xyz"))
    curves = {rate: errors_over_time(motion, "dcm", rate) for rate in (20.0, 100.0, 1000.0)}
    errors = tuple(
        Trace(f"dcm, {rate:g} Hz", time, np.maximum(error, 1e-6))
        for rate, (time, error) in curves.items()
    )
    imu, truth = simulate_imu(motion, NONE, rate=20.0, accelerometer=False)
    q = truth[QUATERNION].to_numpy()
    time = truth.index.to_numpy(dtype=np.float64)
    found = algorithm_history("dcm", increments_from_imu(imu), q[0])
    pitch = tuple(
        Trace(name, time, rotation.euler_from_quaternion(h)[:, 1], reference=name == "truth")
        for name, h in (("dcm, 20 Hz", found), ("truth", q))
    )
    return Figure(
        "fig6",
        "Fig. 6, intensive motion between two reference points",
        "DCM on error-free samples. Nothing is gathered while the phone lies; from 5 s on the "
        "error is what the gyro did between its samples. Drawn at 1e-6° where it is less.",
        _NUMBERS,
        "time, s",
        (
            FigurePanel("gyro, deg/s", gyro),
            FigurePanel("pitch, deg", pitch),
            FigurePanel("error, deg", errors, log=True),
        ),
        marks=((SINCE, "reference, 5 s"), (UNTIL, "reference, 9 s")),
    )


def rate_figure(found: tuple[AtRate, ...], sensor_deg: float) -> Figure:
    """Return the error at 9 s against the rate, with what a sensor costs beside it."""
    ordered = sorted(found, key=lambda a: a.rate)
    rates = np.array([a.rate for a in ordered])

    def trace(name: str, key: str) -> Trace:
        return Trace(name, rates, np.maximum([getattr(a, key) for a in ordered], 1e-9))

    return Figure(
        "fig6-rate",
        "Fig. 6, the error at 9 s against the rate",
        "The same record, decimated. Dropped samples cost most, sums of increments half of it; "
        "algorithms of higher order move the limit (sums are no better than the record that they "
        "are made of). Dotted: what the median gyro of a phone costs on this motion with its bias "
        "taken off.",
        _NUMBERS,
        "rate, Hz",
        (
            FigurePanel(
                "error at 9 s, deg",
                (
                    trace("naive", "naive"),
                    trace("dcm, dropped", "dropped"),
                    trace("dcm, summed", "averaged"),
                    trace("rk4 on cubic", "cubic"),
                    trace("rotvec, summed", "rotation_vector"),
                    Trace("median sensor", rates, np.full(rates.size, sensor_deg), reference=True),
                ),
                log=True,
            ),
        ),
        x_log=True,
        marks=((20.0, "20 Hz"),),
    )


def rate_is_the_reason(slow: AtRate, fast: AtRate, costs: tuple[SensorCost, ...]) -> Statement:
    """Judge that the low rate is the reason of the error.

    Parameters
    ----------
    slow, fast : AtRate
        20 Hz, and the fastest.
    costs : tuple of SensorCost
    """
    calibrated = float(np.median([c.calibrated for c in costs]))
    sensor = float(np.median([c.moving for c in costs]))
    removed = fast.dropped < 0.01 * slow.dropped
    if removed and slow.dropped > LEADS * sensor:
        verdict, condition = HOLDS, ""
    elif removed and slow.dropped > LEADS * calibrated:
        verdict = HOLDS_WHEN
        condition = "scale factor and alignment of the gyro are calibrated, and not its bias alone"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "fig6-rate-is-the-reason",
        "Section 5, Fig. 6",
        "The reason for this crucial error is the low measurement rate, nonconforming with "
        "rotation intensities.",
        verdict,
        condition,
        "On a motion of 920 °/s at most, error-free samples at 20 Hz cost by themselves what is "
        f"below, and a higher rate takes it away. Sums of the increments over each 50 ms cost "
        f"{amount(100.0 * slow.averaged / slow.dropped, '%')} of it.",
        (
            Evidence("20 Hz, samples dropped", slow.dropped, "°"),
            Evidence("20 Hz, increments summed", slow.averaged, "°"),
            Evidence(f"{fast.rate:g} Hz", fast.dropped, "°"),
            Evidence("median sensor, bias taken off", sensor, "°"),
            Evidence("median sensor, scale and alignment taken off, too", calibrated, "°"),
        ),
        "fig6-rate",
    )


def neither_sensor_nor_algorithm(
    slow: AtRate, apart: float, costs: tuple[SensorCost, ...]
) -> Statement:
    """Judge that neither the sensor nor the algorithm explains the error of the paper's record.

    That record was not published. Where either could make such an error on such a motion, only
    the record itself could show that neither did.

    Parameters
    ----------
    slow : AtRate
        20 Hz.
    apart : float, deg
        Between direction cosines and quaternion on those samples.
    costs : tuple of SensorCost
    """
    least, most = (f(c.moving for c in costs) for f in (min, max))
    best = min(slow.cubic, slow.rotation_vector)
    arithmetic = apart > 1e-6
    order = best < 0.5 * slow.dropped
    device = most > slow.dropped / LEADS
    verdict = CANNOT_BE_JUDGED if arithmetic or device or order else HOLDS
    return Statement(
        "fig6-not-sensor-nor-algorithm",
        "Section 5, Fig. 6",
        "a substantial error was accumulated, which cannot be explained with low sensor quality "
        "or algorithmic inaccuracies",
        verdict,
        "",
        "The record was not published. Both can make such an error. Scale factor and misalignment "
        f"of phones' gyros, bias taken off, cost {amount(least, '°')} to {amount(most, '°')} on "
        f"this motion at {SENSOR_RATE:g} Hz. And though DCM and quaternion agree to rounding, an "
        f"algorithm of higher order leaves {amount(100.0 * best / slow.dropped, '%')} of the error "
        "of 20 Hz on samples of 20 Hz.",
        (
            Evidence("DCM at 20 Hz", slow.dropped, "°"),
            Evidence("DCM and quaternion apart", apart, "°"),
            Evidence("Runge-Kutta on a cubic, same samples", slow.cubic, "°"),
            Evidence("two-increment rotation vector, sums at 20 Hz", slow.rotation_vector, "°"),
            Evidence("best sensor, bias taken off", least, "°"),
            Evidence("worst sensor, bias taken off", most, "°"),
        ),
        "fig6-rate",
    )


# ==================================================================================================
# What one pose at two instants can tell, and what it cannot
# ==================================================================================================


def scale_seen(scale: float = 0.03) -> tuple[float, float]:
    """Turn out and back by 90° with a wrong scale factor: error at the return, and at most, deg."""
    quarter = 0.5 * np.pi
    motion = PulseMotion((Pulse(2, 1.0, 2.0, quarter), Pulse(2, 3.0, 4.0, -quarter)), 5.0)
    errors = ImuErrors(TriadErrors(scale=scale))
    _, error = errors_over_time(motion, "quaternion", 100.0, errors=errors)
    return float(error[-1]), float(error.max())


def reference_points(at_return: float, largest: float, at_nine: float, on_way: float) -> Statement:
    """Judge what a reference point can tell.

    Parameters
    ----------
    at_return, largest : float, deg
        Of a turn out and back with a wrong scale factor: at the return, and on the way.
    at_nine, on_way : float, deg
        Of the motion of Fig. 6 at 20 Hz: at the reference point, and the largest before it.
    """
    blind = at_return < 0.1 * largest
    sees = at_nine > 0.1 * on_way
    if sees and blind:
        verdict = HOLDS_WHEN
        condition = "the errors do not cancel on the way back to the same pose"
    else:
        verdict, condition = (HOLDS if sees else DOES_NOT_HOLD), ""
    return Statement(
        "reference-points",
        "Section 2",
        "Using this approach allows us to obtain an assessment of the quality of the entire "
        "navigation system.",
        verdict,
        condition,
        "One pose at two instants gives the sum of all errors between them. It shows the rate's "
        "on Fig. 6; it is blind to what a return takes back, such as a wrong scale factor on a "
        "turn out and back about one axis.",
        (
            Evidence("Fig. 6 at 20 Hz, seen at 9 s", at_nine, "°"),
            Evidence("the same, largest until then", on_way, "°"),
            Evidence("90° out and back, scale 3 % wrong, seen at the return", at_return, "°"),
            Evidence("the same, largest on the way", largest, "°"),
        ),
        "fig6",
    )
