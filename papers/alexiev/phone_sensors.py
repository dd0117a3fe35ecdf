"""Gyros of phones on the motion of Fig. 6, and what their biases mean elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from papers.alexiev.sampling import algorithm_history, scenario_motion
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    Table,
    amount,
)
from strapdown import rotation
from strapdown.increments import increments_from_imu
from strapdown.sensors import SENSORS, load_sensor
from strapdown.simulation import ImuErrors, Motion, TriadErrors, simulate_imu
from strapdown.tables import GYRO

SINCE, UNTIL = 5.0, 9.0  # s, reference points of the paper


SENSOR_RATE = 500.0  # Hz: what the rate costs there is far below what a sensor costs


UNITS = 5  # of each sensor


def phone_gyros() -> tuple[str, ...]:
    """Return the names of the catalogue's sensors for phones."""
    return tuple(name for name in SENSORS if load_sensor(name).grade == "phone")


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
