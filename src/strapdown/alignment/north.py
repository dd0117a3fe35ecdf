"""Whether gyros can find north, and what they say of the latitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.site import Site
from strapdown.constants import DEG_PER_HOUR
from strapdown.errors import DataError, Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]

__all__ = [
    "CONTRADICTION",
    "HIGH_LATITUDE",
    "LARGEST_SD",
    "latitude_findings",
    "north_findings",
    "seems_in_deg_per_s",
]

#: A heading that is less well known than this, in rad, is no heading: a uniform one has 1.81.
LARGEST_SD = 1.0
#: Beyond this latitude, in deg, less than a third of the Earth's rate is horizontal.
HIGH_LATITUDE = 70.0
#: So many standard deviations are no chance: one in two million.
CONTRADICTION = 5.0


def north_findings(
    site: Site, sd: float, sensors: ImuUncertainty, source: str | None
) -> tuple[Finding, ...]:
    """Say how well north is known.

    Parameters
    ----------
    site : Site
    sd : float, rad
        Of the heading.
    sensors : ImuUncertainty
    source : str, optional
        Of the record, for messages.

    Returns
    -------
    tuple of Finding
        Where the latitude is high.

    Raises
    ------
    DataError
        The standard deviation exceeds 1 rad, or the place is so near to a pole that it is not a
        number.
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
            rounded=_rounded(across * DEG_PER_HOUR),
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

    Parameters
    ----------
    rate : ndarray, (3,), rad/s
    site : Site

    Returns
    -------
    bool
    """
    size, earth = (float(np.sqrt(x @ x)) for x in (rate, site.earth_rate))
    return abs(size / earth / float(np.degrees(1.0)) - 1.0) < 0.1


def _rounded(rate: float) -> str:
    """A rate in deg/h; what rounding leaves of none is none."""
    return f"{rate:.3g}" if rate > 1e-9 else "0"


def latitude_findings(
    site: Site, measured_deg: float, sd_deg: float, source: str | None
) -> tuple[Finding, ...]:
    """Compare the latitude that the sensors tell with the site's.

    Parameters
    ----------
    site : Site
    measured_deg, sd_deg : float, deg
        From the angle between gravity and the Earth's rate.
    source : str, optional

    Returns
    -------
    tuple of Finding
        One, where they differ by more than five standard deviations.
    """
    off = measured_deg - site.lat_deg
    if not abs(off) > CONTRADICTION * sd_deg:
        return ()
    if abs(measured_deg) > 90.0 + CONTRADICTION * sd_deg:
        return (
            Finding(
                "alignment.no-latitude-fits",
                file=source,
                quantity="latitude",
                lat_deg=site.lat_deg,
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
