"""Roll and pitch of a body at rest with what is known of them, for a heading that is stated."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.block_means import block_means, excursion, of_mean, unexplained
from strapdown.alignment.levelling import level
from strapdown.alignment.mean_errors import force_covariance, gravity_change
from strapdown.alignment.record_checks import check_gravity, check_record, gravity_findings
from strapdown.alignment.site import Site
from strapdown.alignment.tilt_and_heading import error_of_force_and_heading
from strapdown.errors import Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["level_at_rest"]

BLOCKS = 10


def level_at_rest(
    method: str,
    imu: pd.DataFrame,
    site: Site,
    sensors: ImuUncertainty,
    heading_deg: float,
    heading_sd: float,
) -> Alignment:
    """Level a record of rest.

    Parameters
    ----------
    method : str
        To be named in the result.
    imu : DataFrame
    site : Site
    sensors : ImuUncertainty
    heading_deg : float, deg
    heading_sd : float, rad

    Returns
    -------
    Alignment
        At the last sample. Where the force scatters more than by noise, that scatter and the
        angles by which the body swings are in the covariance, and a finding says so.

    Notes
    -----
    `levelling.level` takes gravity for vertical; above the ellipsoid its north component is
    ``8e-9 alt sin(2 lat)`` m/s², a microradian of tilt at 1200 m, which is not taken off.

    Raises
    ------
    DataError
        As `record_checks.check_record` and `check_gravity`; the body points to the zenith or
        the nadir.
    """
    source = source_of(imu)
    findings = [*check_record(imu)]
    means = block_means(imu, BLOCKS)
    findings += check_gravity(means.whole_force, source)
    roll, pitch = level(means.whole_force)
    q_nb = rotation.quaternion_from_euler([roll, pitch, heading_deg])
    C_nb = rotation.dcm_from_quaternion(q_nb)
    force = force_covariance(sensors, means.length, means.whole_force)
    loud = unexplained(
        means.force, means.length, sensors.accel.axis("noise_density"), sensors.accel_drift
    )
    swing = np.zeros((3, 3))
    turning = unexplained(
        means.rate, means.length, sensors.gyro.axis("noise_density"), sensors.gyro_drift
    )
    if loud > 1.0 or turning > 1.0:
        force = force + (of_mean(means.force) if loud > 1.0 else 0.0)
        swing = excursion(imu, sensors.gyro.axis("noise_density"))
        findings.append(_disturbed(means.length, loud, turning, swing, source))
    change = gravity_change(means.whole_force, force, site.gravity)
    findings += gravity_findings(*change, source)
    by_force, by_heading = error_of_force_and_heading(-site.gravity, pitch, heading_deg, source)
    # A stated heading is that of the last sample: a swing about the vertical is not in it.
    by_swing = by_force @ rotation.cross_matrix(site.gravity) @ C_nb
    to_ned = by_force @ C_nb
    covariance = to_ned @ force @ to_ned.T + by_swing @ swing @ by_swing.T
    covariance += heading_sd**2 * np.outer(by_heading, by_heading)
    return Alignment(method, float(imu.index[-1]), q_nb, covariance, findings=tuple(findings))


def _disturbed(
    length: float, loud: float, turning: float, swing: Array, source: str | None
) -> Finding:
    return Finding(
        "alignment.specific-force-scatters",
        file=source,
        quantity="accel",
        blocks=BLOCKS,
        length=length / BLOCKS,
        loud=loud,
        turning=turning,
        in_bound=True,
        swing_deg=np.degrees(np.sqrt(np.trace(swing))),
    )
