"""The attitude of an alignment at other instants of its record: carried there by the gyros."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.site import Site
from strapdown.attitude import Quaternion, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.tables import GYRO, QUATERNION, attitude_table
from strapdown.tables.checks import values_of

__all__ = ["carried_attitude"]

Array = NDArray[np.float64]


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
    clean = imu
    if alignment.gyro_bias is not None:
        clean = imu.copy()
        clean[GYRO] = values_of(imu, GYRO) - alignment.gyro_bias
        clean.attrs = dict(imu.attrs)
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
    return attitude_table(time, q_nb, source=imu.attrs.get("source"))
