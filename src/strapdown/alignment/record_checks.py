"""Checks of a record before alignment."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Site
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.earth import radii_of_curvature
from strapdown.errors import DataError, Finding
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO, VELOCITY, VELOCITY_SD, check_gnss, check_imu, find_gaps
from strapdown.tables.checks import Array, source_of

# As in levelling: deviation from gravity beyond any bias, scale or rocking.
NEAR_GRAVITY = 0.2
#: Fewer samples do not determine the scatter.
LEAST_SAMPLES = 20
# rad/s or m/s²; below any sensor's noise, above the rounding of an error-free simulation.
ROUNDING = 1e-12


def check_record(imu: pd.DataFrame) -> tuple[Finding, ...]:
    """Check an Imu table before alignment.

    Reports outliers and gaps. DataError: as `tables.check_imu`; accelerometers are missing, there
    are fewer than 20 samples, or a channel does not change at all while others do.
    """
    check_imu(imu)
    source = source_of(imu)
    if ACCEL[0] not in imu.columns:
        raise DataError("alignment.no-accelerometer", file=source, quantity="accel")
    if len(imu) < LEAST_SAMPLES:
        raise DataError(
            "alignment.too-few-samples",
            file=source,
            quantity="time",
            count=len(imu),
            index=imu.index[-1] - imu.index[0],
            least_samples=LEAST_SAMPLES,
        )
    values = imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    _check_alive(values, source)
    outliers = outlier_findings(values, [*GYRO, *ACCEL], source)
    return (*outliers, *_gaps(imu.index.to_numpy(dtype=np.float64), source))


def check_gravity(force: Array, source: str | None) -> tuple[Finding, ...]:
    """Check that a mean specific force is that of gravity.

    `force` ((3,), m/s²). `source`: of the record, for messages. Reports a body that is upside down.
    DataError: its length is not within 20 % of 9.8 m/s².
    """
    size = float(np.sqrt(force @ force))
    if not abs(size / STANDARD_GRAVITY - 1.0) <= NEAR_GRAVITY:
        if abs(size - 1.0) <= NEAR_GRAVITY:
            code = "alignment.mean-force-seems-in-g"
        elif abs(size / (1e3 * STANDARD_GRAVITY) - 1.0) <= NEAR_GRAVITY or (
            abs(size / 1e3 - 1.0) <= NEAR_GRAVITY
        ):
            code = "alignment.mean-force-seems-in-mg"
        else:
            code = "alignment.mean-force-not-gravity"
        raise DataError(code, file=source, quantity="accel", size=size)
    if not force[2] > 0.5 * size:
        return ()
    return (
        Finding("alignment.force-points-down", file=source, quantity="accel_z", force=force[2]),
    )


def gravity_findings(change: float, sd: float, source: str | None) -> tuple[Finding, ...]:
    """Compare the magnitude of a mean specific force with the gravity of the site.

    `change`: measured minus the site's, relative. `sd`: its standard deviation. One finding, if it
    is more than five standard deviations.
    """
    if not abs(change) > CONTRADICTION * sd:
        return ()
    return (
        Finding(
            "alignment.gravity-contradicts-site",
            file=source,
            quantity="accel",
            change=1000000.0 * change,
            change_2=abs(change) / max(sd, 1e-300),
        ),
    )


def _check_alive(values: Array, source: str | None) -> None:
    """Refuse a channel that is constant while its neighbors are not."""
    # An ideal sensor at rest is constant on all channels to rounding, which is accepted.
    spread = np.ptp(values, axis=0)
    for name, columns in (("gyro", slice(0, 3)), ("accel", slice(3, 6))):
        still = spread[columns] == 0.0
        rounding = ROUNDING * max(1.0, float(np.abs(values[:, columns]).max(initial=0.0)))
        if not still.any() or not (spread[columns] > rounding).any():
            continue
        channel = (GYRO if name == "gyro" else ACCEL)[int(np.argmax(still))]
        value = values[0, columns][int(np.argmax(still))]
        raise DataError(
            "alignment.dead-gyro" if name == "gyro" else "alignment.dead-accelerometer",
            file=source,
            row=1,
            quantity=channel,
            value=value,
            count=len(values),
        )


def _gaps(time: Array, source: str | None) -> tuple[Finding, ...]:
    gaps = find_gaps(time)
    if not gaps:
        return ()
    worst = max(gaps, key=lambda gap: gap.length)
    return (
        Finding(
            "alignment.gaps" if len(gaps) > 1 else "alignment.gap",
            file=source,
            row=worst.sample + 1,
            quantity="time",
            count=len(gaps),
            length=worst.length,
            start=worst.start,
            usual=worst.usual,
        ),
    )


# Outliers in a record to be aligned.

#: Share of the steps from sample to sample that are taken as usual, and the factor on them from
#: which a step is an outlier: 36 standard deviations of white noise, 10 times the steepest of a
#: swing.
USUAL = 0.99
FACTOR = 10.0


def outlier_findings(values: Array, columns: list[str], source: str | None) -> tuple[Finding, ...]:
    """Find jumps beyond noise and rocking.

    `values` ((n, k)). `columns`: their names. At most one finding, of the channel that jumps most,
    with the row of its largest jump. A channel whose usual step is zero (a coarse converter) is not
    judged.
    """
    steps = np.abs(np.diff(values, axis=0))
    place = int(USUAL * (len(steps) - 1))
    usual = np.partition(steps, place, axis=0)[place]
    ratio = np.divide(steps.max(axis=0), usual, out=np.zeros_like(usual), where=usual > 1e-12)
    if not ratio.max(initial=0.0) > FACTOR:
        return ()
    channel = int(np.argmax(ratio))
    large = np.flatnonzero(steps[:, channel] > FACTOR * usual[channel])
    row = int(np.argmax(steps[:, channel])) + 1
    return (
        Finding(
            "alignment.outlier-or-shock" if len(large) == 1 else "alignment.outliers-or-shocks",
            file=source,
            row=row + 1,
            quantity=columns[channel],
            count=len(large),
            factor=FACTOR,
            ratio=ratio[channel],
            values=values[row, channel],
        ),
    )


# Check against GNSS that a vehicle was stationary.

#: A velocity of more standard deviations is significant.
CLEAR = 5.0


def still_by_gnss(
    gnss: pd.DataFrame | None, imu: pd.DataFrame, site: Site, heading_sd: float
) -> tuple[Finding, ...]:
    """Refuse a steady motion, which inertial sensors cannot distinguish from rest.

    `gnss`: Gnss table; no check if not given. `heading_sd` (rad): stated standard deviation; an
    error that is small against it is accepted. One finding, if the vehicle moves and the heading
    uncertainty covers the error. DataError: the vehicle moves, and the error of the heading found
    as if stationary exceeds its standard deviation: the level of a vehicle that goes north rotates
    like one on an Earth that rotates faster about east, by ``v_N/(R w cos(lat))``.
    """
    if gnss is None:
        return ()
    check_gnss(gnss)
    time = gnss.index.to_numpy(dtype=np.float64)
    during = (time >= imu.index[0]) & (time <= imu.index[-1])
    good = during & (gnss["quality"].to_numpy() > 0.0)
    velocity = gnss.loc[good, VELOCITY].to_numpy(dtype=np.float64)[:, :2]
    sd = gnss.loc[good, VELOCITY_SD].to_numpy(dtype=np.float64)[:, :2]
    told = np.isfinite(sd).all(axis=1)
    if not told.any():
        return ()
    # Errors of fixes are correlated: the mean is taken as no more accurate than one fix.
    mean, spread = velocity[told].mean(axis=0), float(sd[told].mean())
    speed = float(np.hypot(*mean))
    if not speed > CLEAR * max(spread, 1e-3):
        return ()
    meridian, _ = radii_of_curvature(site.lat_deg, ellipsoid=site.ellipsoid)
    rate = float(np.hypot(*mean)) / (float(meridian) + site.alt)
    error = rate / max(float(abs(site.earth_rate[0])), 1e-12)
    moves = Finding(
        "alignment.vehicle-moves",
        file=source_of(gnss),
        row=int(np.flatnonzero(good)[0]) + 1,
        quantity="VN, VE",
        speed=speed,
        fixes=int(told.sum()),
        heading_deg=np.degrees(error),
    )
    if error > heading_sd:
        raise DataError(moves)
    return (moves,)


# Check that the gyros can find north, and compare their latitude with the site's.

#: A heading with a larger standard deviation, rad, counts as unknown: a uniform one has 1.81.
LARGEST_SD = 1.0
#: Beyond this latitude, in deg, less than a third of the Earth's rate is horizontal.
HIGH_LATITUDE = 70.0
#: A difference of more standard deviations is significant: probability one in two million.
CONTRADICTION = 5.0


def north_findings(
    site: Site, sd: float, sensors: ImuUncertainty, source: str | None
) -> tuple[Finding, ...]:
    """Report the standard deviation of north.

    `sd` (rad): of the heading. `source`: of the record, for messages. Reports a high latitude.
    DataError: the standard deviation exceeds 1 rad, or the position is so close to a pole that it
    is not finite.
    """
    rate = site.earth_rate
    size, across = float(np.sqrt(rate @ rate)), float(abs(rate[0]))
    bias = max(sensors.gyro.axis("bias"))
    bias = float(np.hypot(bias, max(sensors.gyro_drift.triad)))
    if not sd <= LARGEST_SD:
        told = f"{np.degrees(sd):.3g} deg" if sd < 1e3 else "without bound"
        raise DataError(
            "alignment.no-north-near-pole" if across < 0.02 * size else "alignment.no-north",
            file=source,
            quantity="heading",
            told=told,
            largest_sd_deg=np.degrees(LARGEST_SD),
            lat_deg=site.lat_deg,
            # A rounding error counts as zero.
            rounded=f"{east:.3g}" if (east := across * DEG_PER_HOUR) > 1e-9 else "0",
            bias=bias * DEG_PER_HOUR,
        )
    if abs(site.lat_deg) <= HIGH_LATITUDE:
        return ()
    return (
        Finding(
            "alignment.high-latitude",
            file=source,
            quantity="heading",
            lat_deg=site.lat_deg,
            across=100.0 * across / size,
            sd_deg=np.degrees(sd),
            size=size / across,
        ),
    )


def seems_in_deg_per_s(rate: Array, site: Site) -> bool:
    """Whether the mean rate of a body at rest is 57 times the Earth's.

    `rate` ((3,), rad/s).
    """
    size, earth = (float(np.sqrt(x @ x)) for x in (rate, site.earth_rate))
    return abs(size / earth / float(np.degrees(1.0)) - 1.0) < 0.1


def latitude_findings(
    site: Site, measured_deg: float, sd_deg: float, source: str | None
) -> tuple[Finding, ...]:
    """Compare the latitude measured by the sensors with the site's.

    `measured_deg`, `sd_deg` (deg): from the angle between gravity and the Earth's rate. One
    finding, if they differ by more than five standard deviations.
    """
    off = measured_deg - site.lat_deg
    if not abs(off) > CONTRADICTION * sd_deg:
        return ()
    if abs(measured_deg) > 90.0 + CONTRADICTION * sd_deg:
        return (
            Finding(
                "alignment.no-latitude-fits", file=source, quantity="latitude", lat_deg=site.lat_deg
            ),
        )
    return (
        Finding(
            "alignment.measured-latitude-contradicts-site",
            file=source,
            quantity="latitude",
            measured_deg=measured_deg,
            sd_deg=sd_deg,
            lat_deg=site.lat_deg,
            off=abs(off) / sd_deg,
        ),
    )
