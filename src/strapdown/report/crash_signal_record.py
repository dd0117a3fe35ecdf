"""What the recorders say at the reference point, as one crash record: for ISO MME."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.tables import ACCEL, GYRO

__all__ = ["signal_record"]

Array = NDArray[np.float64]


def signal_record(
    title: str, point: str, answers: Sequence[UnitReconstruction], rate_hz: float
) -> CrashRecord:
    """Return the signals of all answers at the reference point.

    Parameters
    ----------
    title : str
        Of the case.
    point : str
        Name of the reference point.
    answers : sequence of UnitReconstruction
    rate_hz : float, Hz
        Of the common stamps.

    Returns
    -------
    CrashRecord
        Of each recorder, and of their mean, specific force (gravity in it) and rates along the
        vehicle's axes.
    """
    channels = []
    for unit in answers:
        imu = unit.at_point.imu
        time = imu.index.to_numpy(dtype=np.float64)
        for columns, quantity, symbol in ((ACCEL, "acceleration", "m/s2"), (GYRO, "rate", "rad/s")):
            for column, axis in zip(columns, "xyz", strict=True):
                channels.append(
                    CrashChannel(
                        f"{unit.name} {column}",
                        quantity,
                        axis,
                        symbol,
                        _load(time, imu[column].to_numpy(dtype=np.float64)),
                        sampling=str(imu.attrs["sampling"]),
                        place=f"{point}, by {unit.name}",
                        low_pass=f"brought to {rate_hz:g} Hz",
                    )
                )
    return CrashRecord(
        Path("signals"), "mme", title, {"reference point": point}, tuple(channels), ()
    )


def _load(time: Array, values: Array) -> Callable[[], tuple[Array, Array]]:
    return lambda: (time, values)
