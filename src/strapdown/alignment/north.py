"""Whether gyros can find north, and what they say of the latitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.site import Site
from strapdown.constants import DEG_PER_HOUR
from strapdown.exceptions import DataError, Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]

__all__ = [
    "CONTRADICTION",
    "HIGH_LATITUDE",
    "LARGEST_SD",
    "latitude_findings",
    "north_findings",
    "unit_remedy",
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
            f"the gyros cannot find north: the standard deviation of the heading is {told} (at "
            f"most {np.degrees(LARGEST_SD):.0f} deg); at latitude {site.lat_deg:.6g} deg the Earth "
            f"turns at {_rounded(across * DEG_PER_HOUR)} deg/h about north, and the bias of the "
            f"gyros is known to {bias * DEG_PER_HOUR:.3g} deg/h",
            file=source,
            quantity="heading",
            remedy=(
                "north is not defined at a pole and not found near it: state the heading "
                "(known_heading), and navigate in a wander frame"
                if across < 0.02 * size
                else "state the heading (known_heading), take it from GNSS while moving "
                "(gnss_course), align for longer if the record is short, or calibrate the gyros"
            ),
        )
    if abs(site.lat_deg) <= HIGH_LATITUDE:
        return ()
    return (
        Finding(
            f"at latitude {site.lat_deg:.6g} deg only {100.0 * across / size:.3g} % of the "
            f"Earth's rate is horizontal: the heading is known to {np.degrees(sd):.3g} deg, "
            f"{size / across:.3g} times worse than at the equator",
            file=source,
            quantity="heading",
            remedy="use better gyros, or state the heading (known_heading)",
        ),
    )


def unit_remedy(rate: Array, site: Site) -> str:
    """Remedy for a mean rate of a body at rest that is 57 times the Earth's; else empty.

    Parameters
    ----------
    rate : ndarray, (3,), rad/s
    site : Site

    Returns
    -------
    str
    """
    size, earth = (float(np.sqrt(x @ x)) for x in (rate, site.earth_rate))
    if abs(size / earth / np.degrees(1.0) - 1.0) < 0.1:
        return "the gyros seem to be in deg/s: state the unit when the log is read"
    return ""


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
        told = "the Earth's rate, as the gyros read it, and gravity lie as at no latitude"
        return (
            Finding(
                f"{told}: the site says {site.lat_deg:.6g} deg",
                file=source,
                quantity="latitude",
                remedy="check units, axes and signs of the gyros and of the accelerometers, the "
                "stated bias of the gyros, and that the body stood where it was aligned",
            ),
        )
    return (
        Finding(
            f"the sensors tell {measured_deg:.4g} deg (standard deviation {sd_deg:.2g}) from the "
            f"Earth's rate against gravity, and the site says {site.lat_deg:.6g}: "
            f"{abs(off) / sd_deg:.1f} standard deviations apart",
            file=source,
            quantity="latitude",
            remedy="check the latitude and its sign, the axes and units of the gyros, the stated "
            "bias of the gyros, and that the body stood where it was aligned",
        ),
    )
