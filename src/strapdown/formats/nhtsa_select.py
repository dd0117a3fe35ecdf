"""Selection of crash test channels by location and axis, and of six as an Imu table."""

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
    """Select accelerometers whose samples are available.

    Parameters
    ----------
    test : CrashTest
    location : str, optional
        Code of the location, or its beginning: ``FLLR``, ``FL``.
    axis : str, optional
        ``X``, ``Y``, ``Z``, or the code with its frame, ``XG``.
    occupant : str, optional
        ``01``, ``02``; ``NA`` for the vehicle itself.
    vehicle : int, optional

    Returns
    -------
    tuple of Channel
        In the order of the header; including failed ones, see their `status`.

    Raises
    ------
    DataError
        No channel fits.
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
    """Combine six channels of one body into an Imu table.

    Parameters
    ----------
    test : CrashTest
    accel, gyro : triple of int
        Numbers of the channels along X, Y and Z.
    rest_force : triple, m/s², optional
        Specific force of the body before the impact, in its axes. The channels are zeroed there,
        so it is added after subtracting their own mean before `until`. It sets the attitude of
        the body; the default is upright.
    until : float, s
        End of the initial interval, in which the body is stationary or at constant velocity.

    Returns
    -------
    DataFrame
        An Imu table; time from the impact.

    Raises
    ------
    DataError
        A channel is not an accelerometer or an angular rate sensor, the stamps differ, or there
        are fewer than two samples before `until`.
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
