"""Whether a record at rest may be of the sensor that is named."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Site
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.errors import Finding
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array, index_of, source_of, values_of

#: Grades that a record is compared with, the best first.
GRADES = ("intermediate-grade", "tactical-grade", "industrial-grade", "consumer-grade")
#: Length of a rest that shows noise and biases, s; the longest part of it that is used.
LEAST, LONGEST = 5.0, 120.0
#: Ratio to a noise of the data sheet, and standard deviations of a bias, beyond which a unit is not
#: of its type: by Student's t of 4 degrees of freedom, on which `UNIT_FACTOR` rests, one in 300 is.
LOUD, BEYOND = 3.0, 4.5
#: Means over so many seconds show the noise of a sensor if it is the same in all of them, and in
#: all axes, within these factors: what shakes a body does so at some frequencies, and along some
#: axes. Fewest means.
MEANS, WHITE, ALIKE, FEWEST = (0.05, 0.1, 0.2, 0.5, 1.0), 2.5, 3.0, 8
#: Turn of a body that rests on springs, rad, between the ends of its rest; what gravity is off by,
#: m/s²: anomalies, heights over the sea, and a force by vibration.
SWAY, ANOMALY = math.radians(0.2), 3e-4 * STANDARD_GRAVITY
EARTH_RATE = 15.05 / DEG_PER_HOUR


class _Seen(NamedTuple):
    """What a rest shows of a sensor, SI; NaN where it does not. `unsure`: of each bias."""

    gyro_noise: float
    accel_noise: float
    gyro_bias: Array
    accel_bias: float
    unsure: tuple[float, float]


class _Figure(NamedTuple):
    """One figure of a record beside that of a sheet, in `unit`; `ratio`: of it to its limit."""

    quantity: str
    seen: float
    stated: float
    ratio: float
    unit: str
    sign: str = ""


def unlike_sensor(
    imu: pd.DataFrame,
    quiet: Sequence[tuple[float, float]],
    named: str,
    stated: ImuUncertainty,
    site: Site | None,
) -> tuple[Finding, ...]:
    """Report noise or biases at rest far beyond the figures of the sensor that is named.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force.
    quiet : sequence of tuple of float, s
        Begin and end of the rests of the body, from the first sample; the longest is looked at.
    named : str
        Sensor of the catalogue, or a file.
    stated : ImuUncertainty
        Of the biases as they are used, with whatever is stated of the unit itself.
    site : Site, optional
        Without it the size of gravity, and with it a bias of the accelerometers, is not known.

    Returns
    -------
    tuple of Finding
        One at most. None of a grade, which is no unit, of a rest shorter than `LEAST`, and of noise
        that may be shaking.
    """
    sensor = load_sensor(named)
    begin, end = max(quiet, key=lambda one: one[1] - one[0], default=(0.0, 0.0))
    if named in GRADES or end - begin < LEAST or ACCEL[0] not in imu.columns:
        return ()
    time = index_of(imu) - imu.index[0]
    part = imu[(time >= begin) & (time <= min(end, begin + LONGEST))]
    seen = _seen(part, site)
    figures = _beyond(seen, ImuUncertainty.of_sensor(sensor), stated)
    if not figures:
        return ()
    fits = (g for g in GRADES if not _beyond(seen, *2 * (_of_grade(g),)))
    worst = max(figures, key=lambda one: one.ratio)
    return (
        Finding(
            "navigation.sensor-unlike-record",
            file=source_of(imu),
            quantity="sensors",
            named=named,
            grade=next(fits, GRADES[-1]),
            what=worst.quantity,
            seen=worst.seen,
            stated=worst.stated,
            unit=worst.unit,
            begin=float(part.index[0]),
            end=float(part.index[-1]),
            figures=[
                f"{f.quantity} {f.seen:.3g} {f.unit} (stated: {f.sign}{f.stated:.3g})"
                for f in figures
            ],
        ),
    )


def _of_grade(name: str) -> ImuUncertainty:
    return ImuUncertainty.of_sensor(load_sensor(name))


def _seen(part: pd.DataFrame, site: Site | None) -> _Seen:
    """Noise and biases of a body at rest."""
    time = index_of(part)
    step, length = float(np.median(np.diff(time))), float(time[-1] - time[0])
    gyro, accel = values_of(part, GYRO), values_of(part, ACCEL)
    known = math.nan if site is None else float(np.linalg.norm(site.gravity))
    return _Seen(
        _white(gyro, step),
        _white(accel, step),
        np.abs(gyro.mean(axis=0)),
        abs(float(np.linalg.norm(accel.mean(axis=0))) - known),
        (EARTH_RATE + SWAY / length, ANOMALY),
    )


def _white(values: Array, step: float) -> float:
    """Noise density of the quietest of three axes; NaN where it is not that of a sensor."""
    densities = []
    for size in sorted({max(1, round(mean / step)) for mean in MEANS}):
        count = len(values) // size
        if count < FEWEST:
            break
        means = values[: count * size].reshape(count, size, 3).mean(axis=1)
        # Of white noise second differences have six times the variance of a mean.
        second = np.diff(means, n=2, axis=0)
        densities.append(np.sqrt(np.square(second).mean(axis=0) / 6.0 * size * step))
    if len(densities) < 2:
        return math.nan
    least, most = np.min(densities, axis=0), np.max(densities, axis=0)
    usual = np.median(densities, axis=0)
    if (most > WHITE * least).any() or usual.max() > ALIKE * usual.min():
        return math.nan
    return float(usual.min())


def _beyond(seen: _Seen, sheet: ImuUncertainty, stated: ImuUncertainty) -> list[_Figure]:
    """Figures of a rest far beyond those of a sensor: noise of its sheet, biases as stated."""
    found = []
    for what, noise, triad, unit, factor in (
        ("gyro noise", seen.gyro_noise, sheet.gyro, "deg/√h", 60.0 * math.degrees(1.0)),
        ("accelerometer noise", seen.accel_noise, sheet.accel, "µg/√Hz", 1e6 / STANDARD_GRAVITY),
    ):
        of_sheet = max(triad.axis("noise_density"))
        if noise > LOUD * of_sheet:
            ratio = noise / max(LOUD * of_sheet, 1e-300)
            found.append(_Figure(what, noise * factor, of_sheet * factor, ratio, unit))
    by_gravity = np.square(stated.gyro.axis("g_sensitivity")) * STANDARD_GRAVITY**2
    rates = np.sqrt(stated.gyro_bias_variance() + by_gravity)
    scale = STANDARD_GRAVITY * max(stated.accel.axis("scale"))
    force = math.hypot(math.sqrt(float(stated.accel_bias_variance().max())), scale)
    worst = int(np.argmax(seen.gyro_bias / np.maximum(rates, 1e-300)))
    for what, bias, own, unsure, unit, factor in (
        (
            "gyro bias",
            float(seen.gyro_bias[worst]),
            float(rates[worst]),
            seen.unsure[0],
            "deg/h",
            DEG_PER_HOUR,
        ),
        (
            "accelerometer bias along gravity",
            seen.accel_bias,
            force,
            seen.unsure[1],
            "mg",
            1e3 / STANDARD_GRAVITY,
        ),
    ):
        limit = BEYOND * own + unsure
        if bias > limit:
            found.append(_Figure(what, bias * factor, own * factor, bias / limit, unit, "± "))
    return found
