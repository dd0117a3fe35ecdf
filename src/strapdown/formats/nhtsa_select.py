"""Channels of a crash test by place and axis, and six of them as an Imu table."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.formats.nhtsa import Channel, CrashTest
from strapdown.tables import imu_table

__all__ = ["accelerations", "imu_of"]


def accelerations(
    test: CrashTest,
    location: str | None = None,
    *,
    axis: str | None = None,
    occupant: str | None = None,
    vehicle: int | None = None,
) -> tuple[Channel, ...]:
    """Select accelerometers whose samples are there.

    Parameters
    ----------
    test : CrashTest
    location : str, optional
        Code of the place, or its beginning: ``FLLR``, ``FL``.
    axis : str, optional
        ``X``, ``Y``, ``Z``, or the code with its frame, ``XG``.
    occupant : str, optional
        ``01``, ``02``; ``NA`` for the vehicle itself.
    vehicle : int, optional

    Returns
    -------
    tuple of Channel
        In the order of the header; failed ones too, as their `status` says.

    Raises
    ------
    DataError
        There is none.
    """
    found = tuple(
        c
        for c in test.channels
        if c.kind == "AC"
        and c.present
        and (location is None or c.location.startswith(location.upper()))
        and (axis is None or c.axis.startswith(axis.upper()))
        and (occupant is None or c.occupant == occupant)
        and (vehicle is None or c.vehicle == vehicle)
    )
    if not found:
        places = dict.fromkeys(c.location for c in test.channels if c.kind == "AC" and c.present)
        raise DataError(
            "io.nhtsa-no-such-channel",
            file=test.path.name,
            quantity="location",
            location=location or "any place",
            axis=axis or "any",
            occupant=occupant or "any",
            word=(location or "").upper(),
            known=places,
        )
    return found


def imu_of(
    test: CrashTest,
    accel: tuple[int, int, int],
    gyro: tuple[int, int, int],
    *,
    rest_force: tuple[float, float, float] = (0.0, 0.0, -STANDARD_GRAVITY),
    until: float = 0.0,
) -> pd.DataFrame:
    """Put six channels of one body together as an Imu table.

    Parameters
    ----------
    test : CrashTest
    accel, gyro : triple of int
        Numbers of the channels along X, Y and Z.
    rest_force : triple, m/s², optional
        Specific force of the body before the impact, in its axes. The channels are zeroed
        there, so it is put back after their own mean before `until` is taken off. It says how
        the body stood; the default is upright.
    until : float, s
        End of the stretch that is at rest or at constant velocity.

    Returns
    -------
    DataFrame
        An Imu table; time from the impact.

    Raises
    ------
    DataError
        A channel is no accelerometer or no angular rate, the stamps differ, or there are fewer
        than two samples before `until`.
    """
    values = []
    for numbers, unit in ((gyro, "rad/s"), (accel, "m/s2")):
        for number in numbers:
            channel = test.channel(number)
            if channel.si_unit != unit:
                raise DataError(
                    "io.needed-2",
                    file=test.path.name,
                    quantity=f"channel {number}",
                    name=channel.name,
                    unit=channel.unit,
                    unit_2=unit,
                )
            values.append(channel.table["value"])
    time = values[0].index.to_numpy(dtype=np.float64)
    for series, number in zip(values, (*gyro, *accel), strict=True):
        if not np.array_equal(series.index.to_numpy(), time):
            raise DataError(
                "io.stamps-not-those-channel",
                file=test.path.name,
                quantity=f"channel {number}",
                gyro=gyro[0],
            )
    table = np.column_stack([s.to_numpy(dtype=np.float64) for s in values])
    before = time < until
    if before.sum() < 2:
        raise DataError(
            "io.samples-before",
            file=test.path.name,
            quantity="time",
            before=int(before.sum()),
            until=until,
        )
    table -= table[before].mean(axis=0)
    table[:, 3:] += np.asarray(rest_force, dtype=np.float64)
    return imu_table(time, table[:, :3], table[:, 3:], source=test.path.name)
