"""Gyrocompassing: the attitude that aligns two measured vectors with two known ones (TRIAD)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment import record_checks as checks
from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.mean_errors import (
    BlockMeans,
    block_means,
    excursion,
    force_covariance,
    gravity_change,
    of_mean,
    rate_covariance,
)
from strapdown.constants import DEG_PER_HOUR
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables.checks import Array, source_of


@dataclass(frozen=True)
class TwoVector(CoarseAlignment):
    """Mean specific force is up, the mean rate is the Earth's: for a stationary body.

    Attributes
    ----------
    blocks : int
        Equal parts of the record, 2 to 1000, whose scatter measures the disturbance of the means.

    Raises
    ------
    ConfigError
        The number of blocks is out of range.
    """

    name: ClassVar[str] = "two_vector"
    summary: ClassVar[str] = "mean rate and mean specific force of a body at rest (TRIAD)"
    source: ClassVar[str] = "Black 1964; Britting 1971, sec. 9.2"

    blocks: int = 10

    def __post_init__(self) -> None:
        if isinstance(self.blocks, bool) or self.blocks not in range(2, 1001):
            raise ConfigError(
                "alignment.block-count-out-of-range", quantity="blocks", blocks=self.blocks
            )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`.

        DataError: the record is unusable, its force is not gravity, its rate is not the Earth's, or
        the standard deviation of the heading exceeds 1 rad.
        """
        findings = [*checks.check_record(imu)]
        source = source_of(imu)
        means = block_means(imu, self.blocks)
        findings += checks.check_gravity(means.whole_force, source)
        C_nb = triad_attitude(means.whole_force, means.whole_rate, site)

        rate = C_nb @ rate_covariance(sensors, means.length, means.whole_rate, means.whole_force)
        force = C_nb @ force_covariance(sensors, means.length, means.whole_force)
        rate, force = rate @ C_nb.T, force @ C_nb.T
        loud_rate, loud_force = means.scatter(sensors)
        swing = np.zeros((3, 3))
        if loud_rate > 1.0:
            rate = rate + of_mean(means.rate @ C_nb.T)
            swing = C_nb @ excursion(imu, sensors.gyro.axis("noise_density")) @ C_nb.T
        if loud_force > 1.0:
            force = force + of_mean(means.force @ C_nb.T)
        findings += _check_rate(means, site, rate, sensors, source)
        by_force, by_rate = sensitivities(site)
        covariance = by_force @ force @ by_force.T + by_rate @ rate @ by_rate.T + swing
        heading_sd = float(np.sqrt(covariance[2, 2]))
        if loud_rate > 1.0 or loud_force > 1.0:
            disturbed = _disturbed(means, site, loud_rate, loud_force, swing, source)
            findings.append(disturbed)
            if heading_sd > checks.LARGEST_SD:
                sd_deg = np.degrees(heading_sd)
                raise DataError(disturbed.explains("alignment.heading-lost", sd_deg=sd_deg))
        findings += checks.north_findings(site, heading_sd, sensors, source)
        findings += checks.still_by_gnss(gnss, imu, site, heading_sd)
        turned = C_nb @ means.whole_force
        findings += checks.gravity_findings(*gravity_change(turned, force, site.gravity), source)
        latitude, latitude_sd = _latitude(means, site, rate, force)
        findings += checks.latitude_findings(site, latitude, latitude_sd, source)
        return Alignment(
            self.name,
            float(imu.index[-1]),
            rotation.quaternion_from_dcm(C_nb),
            covariance,
            measured_latitude_deg=latitude,
            measured_latitude_sd_deg=latitude_sd,
            findings=tuple(findings),
        )


def triad_attitude(force: Array, rate: Array, site: Site) -> Array:
    """``C_nb`` that aligns minus the force with gravity, and the rate with the Earth's meridian.

    `force`, `rate` ((3,)): body axes. Returns (3, 3).
    """
    known = triad(site.gravity, site.earth_rate)
    return known @ triad(-force, rate).T


def triad(first: Array, second: Array) -> Array:
    """Axes along a vector, across both, and across these two (TRIAD), as columns, (3, 3)."""
    a = first / np.sqrt(first @ first)
    b = np.cross(a, second)
    b /= max(float(np.sqrt(b @ b)), 1e-300)
    return np.column_stack([a, b, np.cross(a, b)])


def sensitivities(site: Site) -> tuple[Array, Array]:
    """Attitude error per error of the mean force, and of the mean rate; (3, 3) each, NED.

    ``phi_N = -df_E/g``, ``phi_E = df_N/g``, ``phi_D = df_E tan(lat)/g - dw_E/(w cos(lat))``.
    """
    g = float(np.sqrt(site.gravity @ site.gravity))
    north, _, down = site.earth_rate
    north = north if abs(north) > 1e-12 else 1e-12
    by_force = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -down / north, 0.0]]) / g
    by_rate = np.zeros((3, 3))
    by_rate[2, 1] = -1.0 / north
    return by_force, by_rate


def _check_rate(
    means: BlockMeans, site: Site, covariance: Array, sensors: ImuUncertainty, source: str | None
) -> tuple[Finding, ...]:
    """Compare the magnitude of the mean rate with the Earth's; refuse a turn, or another unit."""
    rate, earth = means.whole_rate, float(np.sqrt(site.earth_rate @ site.earth_rate))
    size, sd = float(np.sqrt(rate @ rate)), float(np.sqrt(np.trace(covariance)))
    if not abs(size - earth) > checks.CONTRADICTION * sd:
        return ()
    bias = max(sensors.gyro.axis("bias")) * DEG_PER_HOUR
    in_deg = checks.seems_in_deg_per_s(rate, site)
    contradicts = Finding(
        "alignment.mean-rate-seems-in-deg-per-s"
        if in_deg
        else "alignment.mean-rate-not-that-of-earth",
        file=source,
        quantity="gyro",
        length=means.length,
        rate=size * DEG_PER_HOUR,
        sd=sd * DEG_PER_HOUR,
        earth=earth * DEG_PER_HOUR,
        bias=bias,
    )
    if size > 2.0 * earth + checks.CONTRADICTION * sd:
        raise DataError(contradicts)
    return (contradicts,)


def _latitude(means: BlockMeans, site: Site, rate: Array, force: Array) -> tuple[float, float]:
    """Latitude from the angle between force and rate, and its standard deviation, deg."""
    f, w = means.whole_force, means.whole_rate
    sine = float(f @ w / np.sqrt((f @ f) * (w @ w)))
    lat = np.radians(site.lat_deg)
    size, g = float(np.sqrt(w @ w)), float(np.sqrt(f @ f))
    # Across the rate in the plane of the meridian: its rotation against the vertical.
    across = np.array([-np.sin(lat), 0.0, -np.cos(lat)])
    variance = float(across @ rate @ across) / size**2 + float(force[0, 0]) / g**2
    return float(np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0)))), float(
        np.degrees(np.sqrt(variance))
    )


def _disturbed(
    means: BlockMeans,
    site: Site,
    loud_rate: float,
    loud_force: float,
    swing: Array,
    source: str | None,
) -> Finding:
    headings = np.array(
        [
            rotation.euler_from_dcm(triad_attitude(f, w, site))[2]
            for f, w in zip(means.force, means.rate, strict=True)
        ]
    )
    middle = rotation.euler_from_dcm(triad_attitude(means.whole_force, means.whole_rate, site))[2]
    off = rotation.within_half_turn(headings - middle)
    angle = np.degrees(np.sqrt(np.trace(swing)))
    first, last = (middle + off.min()) % 360.0, (middle + off.max()) % 360.0
    return Finding(
        "alignment.rate-scatters",
        file=source,
        quantity="gyro",
        count=len(off),
        length=means.length / len(off),
        loud_rate=loud_rate,
        loud_force=loud_force,
        first=first,
        last=last,
        angle=angle,
    )
