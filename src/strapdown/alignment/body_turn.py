"""Whether a body turned against the local level, or the gyros' vertical and the latitude differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.inertial_sums import InertialSums
from strapdown.alignment.mean_errors import mean_of_drift
from strapdown.alignment.north import CONTRADICTION
from strapdown.alignment.site import Site
from strapdown.constants import DEG_PER_HOUR
from strapdown.errors import Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]

__all__ = ["heading_rate", "turn_findings"]

BLOCKS = 10


def heading_rate(
    sums: InertialSums, C_nb: Array, site: Site, sensors: ImuUncertainty
) -> tuple[float, float]:
    """Rate at which the body turns about the vertical against the local level.

    Parameters
    ----------
    sums : InertialSums
    C_nb : ndarray, (3, 3)
        At the first sample.
    site : Site
    sensors : ImuUncertainty

    Returns
    -------
    rate, sd : float, rad/s
        Slope of the line through the turn. To the sensors' errors it adds the scatter of the
        turn about the line, ``12 s²/(m T²)`` with s that of the means of m = 10 parts.
    """
    picked = np.unique(np.linspace(0, len(sums.stamps) - 1, 50 * BLOCKS).astype(np.int64))
    time = sums.stamps[picked]
    turned = rotation.dcm_from_quaternion(sums.turned[picked])
    level = rotation.dcm_from_rotation_vector(-site.earth_rate * time[:, None])
    turn = level @ (C_nb @ turned @ C_nb.T)
    angle = np.unwrap(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))
    off = time - time.mean()
    slope = float(off @ angle) / float(off @ off)
    left = angle - angle.mean() - slope * off
    means = np.array([part.mean() for part in np.array_split(left, BLOCKS)])
    scatter = 12.0 * means.var(ddof=2) / (BLOCKS * sums.length**2)
    gyro = sensors.gyro
    # A line through a walk is known to 6/5 of what its end tells.
    noise = 1.2 * np.square(gyro.axis("noise_density")) / sums.length
    own = np.square(gyro.axis("bias")) + mean_of_drift(sensors.gyro_drift, sums.length) + noise
    across = np.square(gyro.axis("misalignment")) + np.square(gyro.axis("scale"))
    own = own + across * float(site.earth_rate @ site.earth_rate)
    own = own + np.square(gyro.axis("g_sensitivity")) * 9.8**2
    return slope, float(np.sqrt(own.max() + scatter))


def turn_findings(
    sums: InertialSums, C_nb: Array, site: Site, sensors: ImuUncertainty, source: str | None
) -> tuple[Finding, ...]:
    """Say where a body turned about the vertical; parameters as of `heading_rate`.

    Returns
    -------
    tuple of Finding
        One, where the rate is more than five standard deviations from zero. It does no harm to
        an inertial-frame alignment of a body that turned; it does where the body stood.
    """
    rate, sd = heading_rate(sums, C_nb, site, sensors)
    if not abs(rate) > CONTRADICTION * sd:
        return ()
    vertical = -float(site.earth_rate[2])
    size = float(np.sqrt(site.earth_rate @ site.earth_rate))
    mirrored = abs(rate + 2.0 * -vertical) < abs(rate) / 10.0
    # Against the level of a latitude, a body that stands turns by what that has too much.
    sine = (vertical - rate) / size
    measured = float(np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
    if mirrored:
        code = "alignment.turns-about-vertical-latitude-mirrored"
    elif abs(sine) <= 1.0:
        code = "alignment.turns-about-vertical-as-elsewhere"
    else:
        code = "alignment.turns-about-vertical"
    return (
        Finding(
            code,
            file=source,
            quantity="gyro",
            rate=rate * DEG_PER_HOUR,
            sd=sd * DEG_PER_HOUR,
            lat_deg=site.lat_deg,
            measured_deg=measured,
        ),
    )
