"""Where and with what Chernodarov (2009) is reproduced: place, sensors, stages, modules."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment import FineAlignment, FineResult, Site, TwoVector
from strapdown.earth import radii_of_curvature
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation import (
    COVARIANCES,
    ErrorFilter,
    ErrorModel,
    FilterState,
    QuaternionModel,
    RobustUpdate,
)
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.prefilter import CHANNELS, RobustFir
from strapdown.sensors import (
    ImuUncertainty,
    TriadErrors,
    apply,
    child,
    intervals,
    load_sensor,
    white_noise,
)
from strapdown.simulation import ACCEL_SEED, GYRO_SEED, Origin, StationaryMotion
from strapdown.tables import MOTION, imu_table, values_of

Array = NDArray[np.float64]

#: Of the a and e² of the paper.
ELLIPSOID = find_ellipsoid("krassovsky1940")
#: Zelenograd, of the address of the author: the paper prints no coordinates of its test bed.
SITE = Site(55.98, 37.2, 200.0, ELLIPSOID)
ROLL_DEG, PITCH_DEG, HEADING_DEG = 0.5, -0.8, 40.0
SENSOR = load_sensor("fog-1000")
UNCERTAINTY = ImuUncertainty.of_sensor(SENSOR)
#: Ends of coarse and of fine alignment, s: "(100-600 sec)", "Beginning with the moment t=600 sec".
COARSE_END, FINE_END = 100.0, 600.0
#: Navigated without any aid after that, s; the paper does not say how long.
AUTONOMOUS = 3600.0
END = FINE_END + AUTONOMOUS


def wander(height: str = "free") -> Mechanization:
    """Return the mechanization of the paper."""
    return MECHANIZATIONS["wander_azimuth"](ellipsoid=ELLIPSOID.name, height=height)


def stretch(imu: pd.DataFrame, since: float, until: float) -> pd.DataFrame:
    """Return a part of a record, both ends included."""
    part: pd.DataFrame = imu.loc[since - 1e-6 : until + 1e-6]
    part.attrs = dict(imu.attrs)
    return part


def align(
    imu: pd.DataFrame,
    increments: pd.DataFrame | None = None,
    model: type[ErrorModel] = QuaternionModel,
    form: str = "wd",
    mechanization: Mechanization | None = None,
    ends: tuple[float, float] = (COARSE_END, FINE_END),
) -> FineResult:
    """Align as the paper does: coarsely, then by (16)-(18) at 1 Hz.

    Parameters
    ----------
    imu : DataFrame
        Imu table from time zero on.
    increments : DataFrame, optional
        Of the same record, where a pre-filter has made them.
    model, form, mechanization
        Those of the paper, if not given.
    ends : tuple of float, s
        Of the coarse and of the fine alignment.

    Returns
    -------
    FineResult
    """
    coarse = TwoVector().align(stretch(imu, 0.0, ends[0]), SITE, UNCERTAINTY)
    way = FineAlignment(
        mechanization=wander() if mechanization is None else mechanization,
        model=model,
        form=COVARIANCES[form](),
        rule=RobustUpdate(),
    )
    since = coarse.time
    return way.align(stretch(imu, since, ends[1]), SITE, UNCERTAINTY, coarse, increments=increments)


def autonomous_filter(fine: FineResult) -> ErrorFilter:
    """Return the filter that goes on after an alignment: it does not know that the body rests."""
    return replace(fine.filter, rests=False, mechanization=wander("held"))


# ==================================================================================================
# Navigation of a body at rest without any aid: what comes of it, and what should
# ==================================================================================================

EVERY = 1.0  # s


@dataclass(frozen=True, eq=False)
class Course:
    """Errors of a body that stands where it stood.

    Attributes
    ----------
    time : ndarray, (n,), s
    velocity : ndarray, (n, 2), m/s
        North, east.
    angles : ndarray, (n, 2), rad
        Latitude and longitude less those of the place.
    alt : ndarray, (n,), m
        Height less that of the place.
    """

    time: Array
    velocity: Array
    angles: Array
    alt: Array

    @property
    def speed(self) -> Array:
        """Delta V of Figs. 8 and 9, (n,), m/s."""
        return np.asarray(np.hypot(*self.velocity.T))

    @property
    def place(self) -> Array:
        """North and east, (n, 2), m."""
        meridian, transverse = radii_of_curvature(SITE.lat_deg, ellipsoid=ELLIPSOID)
        parallel = (transverse + SITE.alt) * np.cos(np.radians(SITE.lat_deg))
        return np.asarray(self.angles * np.array([meridian + SITE.alt, parallel]))

    @property
    def circular(self) -> Array:
        """Delta S of Figs. 10 and 11 as a distance, (n,), m."""
        return np.asarray(np.hypot(*self.place.T))

    def at(self, time: float) -> int:
        """Row of an instant."""
        return int(np.searchsorted(self.time, time - 1e-6).clip(max=len(self.time) - 1))


def after(increments: pd.DataFrame, time: float) -> tuple[Array, Array]:
    """Ends and rows of the increments after an instant."""
    ends = increments.index.to_numpy(dtype=np.float64)
    since = int(np.searchsorted(ends, time + 1e-6))
    return ends[since:], np.ascontiguousarray(values_of(increments, MOTION)[since:])


def go(filter_: ErrorFilter, state: FilterState, increments: pd.DataFrame) -> Course:
    """Navigate on from a state to the end of a record, without observations.

    Parameters
    ----------
    filter_ : ErrorFilter
    state : FilterState
        The estimates of the sensors' errors that it holds are taken off, as (6) predicts them.
    increments : DataFrame

    Returns
    -------
    Course
    """
    ends, rows = after(increments, state.time)
    history = np.empty((len(ends), filter_.mechanization.row))
    filter_.advance_compensated(
        state.mechanization.copy(), ends, filter_.compensated(state, rows), history
    )
    every = max(1, round(EVERY / float(np.median(np.diff(ends)))))
    kept = slice(every - 1, None, every)
    path = filter_.mechanization.trajectory(ends[kept], history[kept])
    home = np.radians([SITE.lat_deg, SITE.lon_deg])
    return Course(
        ends[kept],
        path[["VN", "VE"]].to_numpy(),
        np.radians(path[["lat", "lon"]].to_numpy()) - home,
        path["alt"].to_numpy() - SITE.alt,
    )


# ==================================================================================================
# The bench run: 1 kHz sensors, robust digital filter, alignment, an hour without aids
# ==================================================================================================

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
