"""An alignment taken to another instant, or over its whole record, by the gyros."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.alignment.propagated_errors import sensor_covariance, sensor_noise
from strapdown.alignment.site import Site
from strapdown.attitude import Quaternion, run_attitude
from strapdown.errors import DataError
from strapdown.increments import increments_from_imu
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import GYRO, QUATERNION, attitude_table, check_imu
from strapdown.tables.checks import source_of, values_of

__all__ = ["carried_attitude", "carry"]

Array = NDArray[np.float64]


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
    piece = _without_gyro_bias(imu.iloc[first : last + 1], alignment)
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
    return replace(
        alignment,
        time=float(stamps[there]),
        q_nb=rotation.quaternion_from_dcm(C_there),
        covariance=np.asarray(covariance),
    )


def carried_attitude(alignment: Alignment, imu: pd.DataFrame, site: Site) -> pd.DataFrame:
    """Carry an attitude over the record that it was found in.

    Parameters
    ----------
    alignment : Alignment
        At an instant of the record; its gyro bias, where it has one, is taken off.
    imu : DataFrame
        Imu table of a body that stays at its place.
    site : Site

    Returns
    -------
    DataFrame
        Attitude table: ``q_nb(t) = q_n(t)n(T) q_nb(T) q_b(T)b(t)``, the body's turn in inertial
        space by the gyros and that of the level by the Earth's rate. One sample of a mean rate
        has no step before it and is that of the first whole interval's start.

    Raises
    ------
    DataError
        The instant of the alignment is not in the record.
    """
    clean = _without_gyro_bias(imu, alignment)
    run = run_attitude(Quaternion(), increments_from_imu(clean)).attitude
    time = run.index.to_numpy(dtype=np.float64)
    turned = values_of(run, QUATERNION)
    at = int(np.argmin(np.abs(time - alignment.time)))
    back = rotation.conjugate(turned[at])
    level = rotation.quaternion_from_rotation_vector(
        np.outer(time - alignment.time, -site.earth_rate)
    )
    here = rotation.compose(alignment.q_nb, back)
    q_nb = rotation.compose(level, rotation.compose(here, turned))
    return attitude_table(time, q_nb, source=source_of(imu))


def _without_gyro_bias(imu: pd.DataFrame, alignment: Alignment) -> pd.DataFrame:
    if alignment.gyro_bias is None:
        return imu
    clean = imu.copy()
    clean[GYRO] = values_of(imu, GYRO) - alignment.gyro_bias
    clean.attrs = dict(imu.attrs)
    return clean


def _sample(stamps: Array, time: float, imu: pd.DataFrame) -> int:
    slack = 0.5 * float(np.median(np.diff(stamps))) * (1.0 + 1e-6)
    if not stamps[0] - slack <= time <= stamps[-1] + slack:
        raise DataError(
            "alignment.instant-outside-record",
            file=source_of(imu),
            quantity="time",
            time=time,
            stamps=stamps[0],
            stamps_2=stamps[-1],
        )
    return int(np.argmin(np.abs(stamps - time)))
