"""The bench run: 1 kHz sensors, robust digital filter, alignment, an hour without aids."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.autonomous import Course, go
from papers.chernodarov.setting import (
    ELLIPSOID,
    END,
    HEADING_DEG,
    PITCH_DEG,
    ROLL_DEG,
    SENSOR,
    SITE,
    align,
    autonomous_filter,
)
from strapdown.alignment import FineResult
from strapdown.prefilter import CHANNELS, RobustFir
from strapdown.sensors import TriadErrors, apply, child, intervals, white_noise
from strapdown.simulation import ACCEL_SEED, GYRO_SEED, Origin, StationaryMotion
from strapdown.tables import imu_table

Array = NDArray[np.float64]

RATE, OUTPUT_RATE = 1000.0, 100.0  # Hz
UNIT = 1
# Samples that are knocked out, for each channel, and how far.
OUTLIER_SHARE, OUTLIER_SDS = 1e-4, 50.0
_OUTLIER_SEED = 9
# The stretch of the raw signals that is drawn, s.
SHOWN = (100.0, 104.0)
AVERAGE = 10.0  # s: "on the time intervals of 10 sec"


@dataclass(frozen=True, eq=False)
class Bench:
    """One unit on the bench.

    Attributes
    ----------
    raw_time, raw : ndarray
        Samples of gyros and accelerometers over `SHOWN`, (k,) and (k, 6).
    raw_sd, outliers : ndarray, (6,)
        Standard deviation of the samples without the outliers; number of outliers put in.
    found, wrongly : int
        Outliers that the filter replaced, and good samples that it replaced.
    noise_factor, delay : float
        Of the filter, by its design; the delay in s is taken off by the stamps.
    imu, increments : DataFrame
        After the filter.
    mean_time, drift_means, bias_means : ndarray
        Ends of intervals of 10 s; what the readings exceed the truth by in the mean over each,
        of gyros and of accelerometers.
    drift, bias : ndarray
        The same without the noise.
    fine : FineResult
    damped, undamped : Course
        The hour after it, estimates of the sensors' errors taken off, and left on.
    """

    raw_time: Array
    raw: Array
    raw_sd: Array
    outliers: NDArray[np.int64]
    found: int
    wrongly: int
    noise_factor: float
    delay: float
    imu: pd.DataFrame
    increments: pd.DataFrame
    mean_time: Array
    drift_means: Array
    bias_means: Array
    drift: Array
    bias: Array
    fine: FineResult
    damped: Course
    undamped: Course


def bench(unit: int = UNIT) -> Bench:
    """Put a unit on the bench and let it run.

    Parameters
    ----------
    unit : int
        Seed of everything that is random.

    Returns
    -------
    Bench
    """
    motion = StationaryMotion(
        END,
        Origin(SITE.lat_deg, SITE.lon_deg, SITE.alt),
        ROLL_DEG,
        PITCH_DEG,
        HEADING_DEG,
        ELLIPSOID,
    )
    time = np.arange(round(END * RATE) + 1) / RATE
    start = np.zeros(1)
    true = np.hstack([motion.rate(start), motion.specific_force(start)])[0]
    errors = SENSOR.draw(unit)
    assert errors.accel is not None
    every = round(AVERAGE * RATE)
    ends = every * np.arange(1, len(time) // every + 1)
    values = np.empty((len(time), 6))
    means, sd = np.empty((2, len(ends), 6)), np.empty(6)
    for k, (triad, seed) in enumerate(((errors.gyro, GYRO_SEED), (errors.accel, ACCEL_SEED))):
        axes = slice(3 * k, 3 * k + 3)
        read, noise = _sensed(triad, true[axes], time, unit, seed)
        sd[axes] = noise.std(axis=0)
        means[1, :, axes] = _means(read, every) - true[axes]
        read += noise
        means[0, :, axes] = _means(read, every) - true[axes]
        values[:, axes] = read
    del read, noise
    hit = np.random.default_rng(child(unit, _OUTLIER_SEED)).random(values.shape) < OUTLIER_SHARE
    signs = np.where(np.arange(len(time)) % 2 == 0, 1.0, -1.0)[:, None]
    values += hit * signs * OUTLIER_SDS * sd
    made = RobustFir(rate=OUTPUT_RATE).apply(
        imu_table(time, values[:, :3], values[:, 3:], sampling="mean")
    )
    imu, increments = made.imu, made.increments
    replaced = np.zeros_like(hit)
    channel = [CHANNELS.index(c) for c in made.report.replaced["channel"]]
    replaced[made.report.replaced["row"].to_numpy() - 1, channel] = True
    shown = (time >= SHOWN[0]) & (time <= SHOWN[1])
    fine = align(imu, increments)
    used = autonomous_filter(fine)
    off = replace(fine.state, sensors=np.zeros_like(fine.state.sensors))
    return Bench(
        raw_time=time[shown],
        raw=values[shown],
        raw_sd=sd,
        outliers=hit.sum(axis=0),
        found=int((replaced & hit).sum()),
        wrongly=int((replaced & ~hit).sum()),
        noise_factor=made.report.noise_factor,
        delay=made.report.delay,
        imu=imu,
        increments=increments,
        mean_time=time[ends],
        drift_means=means[0][:, :3],
        bias_means=means[0][:, 3:],
        drift=means[1][:, :3],
        bias=means[1][:, 3:],
        fine=fine,
        damped=go(used, fine.state, increments),
        undamped=go(used, off, increments),
    )


def _sensed(
    errors: TriadErrors, true: Array, time: Array, unit: int, triad: int
) -> tuple[Array, Array]:
    """What a triad reads without its noise, and the noise, as `simulate_imu` draws them."""
    seed = child(unit, triad)
    quiet = apply(
        replace(errors, noise_density=0.0),
        time,
        np.broadcast_to(true, (len(time), 3)),
        sampling="mean",
        seed=seed,
        sampled=True,
    )
    return quiet, white_noise(seed, intervals(time), errors.axis("noise_density"))


def _means(values: Array, every: int) -> Array:
    """Means over intervals, without the sample at time zero."""
    return np.asarray(values[1:].reshape(-1, every, 3).mean(axis=1))
