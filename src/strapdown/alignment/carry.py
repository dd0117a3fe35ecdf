"""An alignment taken to another instant by the gyros."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.alignment.propagated_errors import sensor_covariance, sensor_noise
from strapdown.alignment.site import Site
from strapdown.exceptions import DataError
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import check_imu

__all__ = ["carry"]


def carry(
    imu: pd.DataFrame,
    alignment: Alignment,
    to: float,
    site: Site,
    sensors: ImuUncertainty | None = None,
) -> Alignment:
    """Carry an attitude forward or backward in time.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force that holds both instants; the samples nearest to them
        count.
    alignment : Alignment
        A gyro bias that it tells is taken off.
    to : float, s
    site : Site
        The local level turns with the Earth here; a vehicle that goes at 10 m/s turns it by
        another 0.3 deg/h, which is not in it.
    sensors : ImuUncertainty, optional
        What the gyros add to the covariance; without it nothing. It is taken as independent of
        what is in the covariance already: of `InertialFrame`, which has used the same gyros,
        ask for the attitude at the start or the end directly.

    Returns
    -------
    Alignment
        At the sample nearest to `to`, of the same method and findings.

    Raises
    ------
    DataError
        As `tables.check_imu`; one of the instants is not in the record.
    """
    check_imu(imu)
    stamps = imu.index.to_numpy(dtype=np.float64)
    here, there = (_sample(stamps, t, imu) for t in (alignment.time, to))
    if here == there:
        return alignment
    first, last = min(here, there), max(here, there)
    piece = imu.iloc[first : last + 1]
    if alignment.gyro_bias is not None:
        piece = piece.copy()
        piece[["gyro_x", "gyro_y", "gyro_z"]] -= alignment.gyro_bias
    sums = sum_inertially(piece)
    forward = there > here
    level = rotation.dcm_from_rotation_vector(
        site.earth_rate * (-sums.length if forward else sums.length)
    )
    turned = rotation.dcm_from_quaternion(sums.turned[-1])
    C_here = rotation.dcm_from_quaternion(alignment.q_nb)
    C_there = level @ C_here @ (turned if forward else turned.T)
    covariance = level @ alignment.covariance @ level.T
    if sensors is not None:
        # Angle errors come in the axes at the first sample of the piece.
        axes = level @ C_here if forward else C_there
        turn = np.tile(axes, (len(sums.node_length), 1, 1))
        none = np.zeros_like(turn)
        covariance = covariance + sensor_covariance(sums, turn, none, sensors)
        covariance = covariance + sensor_noise(sums, turn, none, sensors)
    return Alignment(
        alignment.method,
        float(stamps[there]),
        rotation.quaternion_from_dcm(C_there),
        np.asarray(covariance),
        gyro_bias=alignment.gyro_bias,
        accel_bias=alignment.accel_bias,
        gyro_bias_sd=alignment.gyro_bias_sd,
        accel_bias_sd=alignment.accel_bias_sd,
        heading_given=alignment.heading_given,
        measured_latitude_deg=alignment.measured_latitude_deg,
        measured_latitude_sd_deg=alignment.measured_latitude_sd_deg,
        findings=alignment.findings,
    )


def _sample(stamps: np.ndarray, time: float, imu: pd.DataFrame) -> int:
    slack = 0.5 * float(np.median(np.diff(stamps))) * (1.0 + 1e-6)
    if not stamps[0] - slack <= time <= stamps[-1] + slack:
        raise DataError(
            f"{time:.9g} s is not within the record, which lasts from {stamps[0]:.9g} to "
            f"{stamps[-1]:.9g} s: the gyros cannot carry the attitude there",
            file=imu.attrs.get("source"),
            quantity="time",
            remedy="give the record that holds both instants, on one clock",
        )
    return int(np.argmin(np.abs(stamps - time)))
