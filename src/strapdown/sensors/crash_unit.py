"""A recorder on a vehicle: its triads, where it sits, and how its clock relates to the others'."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.sensors.assumed import Assumed
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.sensors.triad_numbers import FARTHEST, check_sd, triple
from strapdown.sensors.triad_uncertainty import TriadUncertainty
from strapdown.tables.checks import is_number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mounting:
    """Where a unit sits on the vehicle, and how it is turned.

    Attributes
    ----------
    position : triad, m
        Of the sensors, in vehicle axes (forward, right, down), from the vehicle's origin: any
        point that all positions of a case share.
    angles_deg : triad, deg
        Roll, pitch, heading (3-2-1) that turn vehicle axes into sensor axes.
    position_sd : float, m
        Standard deviation of each coordinate.
    angles_sd_deg : float, deg
        Standard deviation of a small turn about each of the vehicle's axes.

    Raises
    ------
    ConfigError
        A number is none, a standard deviation is negative, or the position is farther from the
        origin than any vehicle is long.
    """

    position: Triad = ZERO
    angles_deg: Triad = ZERO
    position_sd: float = 0.0
    angles_sd_deg: float = 0.0

    def __post_init__(self) -> None:
        for name, code in (
            ("position", "sensors.position-not-three-numbers"),
            ("angles_deg", "sensors.angles-not-three-numbers"),
        ):
            object.__setattr__(self, name, triple(getattr(self, name), name, code))
        if math.hypot(*self.position) > FARTHEST:
            raise ConfigError(
                "sensors.vehicle-origin",
                quantity="position",
                position=self.position,
                hypot=math.hypot(*self.position),
            )
        check_sd(self.position_sd, "position_sd", "m")
        check_sd(self.angles_sd_deg, "angles_sd_deg", "deg")

    @property
    def C_vs(self) -> Array:  # noqa: N802
        """Turns vectors from sensor into vehicle axes, (3, 3)."""
        return rotation.dcm_from_quaternion(rotation.quaternion_from_euler(self.angles_deg))


@dataclass(frozen=True, eq=False)
class RecordedTriad:
    """One triad of a unit, as recorded.

    Attributes
    ----------
    table : DataFrame
        Index ``time``, s, on the unit's clock; columns ``accel_x accel_y accel_z``, m/s², or
        ``gyro_x gyro_y gyro_z``, rad/s, in sensor axes; ``attrs["sampling"]`` as of an Imu table.
    uncertainty : TriadUncertainty
    name : str
        Of the part, for messages.
    held : ndarray of bool, (n, 3), optional
        Of a table that was brought to other stamps: whether a recorded sample at an end of the
        range counts in a row, where the values themselves may be well within. None where the
        table is as recorded.
    absent : tuple of int
        Axes (0, 1, 2) that were not recorded: their columns are there in place of what is
        assumed (`unmeasured.with_filled_axes`).

    Raises
    ------
    ConfigError
        The table or the uncertainty is of another kind, or `held` is not of its rows.
    """

    table: pd.DataFrame
    uncertainty: TriadUncertainty
    name: str
    held: NDArray[np.bool_] | None = None
    absent: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.table, pd.DataFrame):
            raise _wrong_type("table", self.table, self.name)
        if not isinstance(self.uncertainty, TriadUncertainty):
            raise _wrong_type("uncertainty", self.uncertainty, self.name)
        if self.held is not None and np.shape(self.held) != (len(self.table), 3):
            raise ConfigError(
                "sensors.shape-table-rows",
                file=self.name,
                quantity="held",
                shape=np.shape(self.held),
                count=len(self.table),
            )


@dataclass(frozen=True, eq=False)
class CrashUnit:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
    accelerometers : tuple of RecordedTriad
        One or more, the lowest range first.
    gyro : RecordedTriad, optional
    mounting : Mounting
    gyro_from : str, optional
        Name of the unit whose gyro is borrowed, where there is none: a rigid vehicle turns
        everywhere alike.
    trigger : float, s, optional
        Instant of the common trigger on this unit's clock.
    trigger_sd : float, s
        How well that instant is known.
    lender : CrashUnit, optional
        The unit of that name, once its gyro stands in `gyro`, turned into these sensor axes.
    assumed : Assumed, optional
        What is taken of the axes that its tables have no column of, and of the turning where
        it has no gyro and borrows none.

    Raises
    ------
    ConfigError
        A part is of another kind, or the trigger is no number.
    """

    name: str
    accelerometers: tuple[RecordedTriad, ...]
    gyro: RecordedTriad | None = None
    mounting: Mounting = Mounting()
    gyro_from: str | None = None
    trigger: float | None = None
    trigger_sd: float = 0.0
    lender: CrashUnit | None = None
    assumed: Assumed | None = None

    def __post_init__(self) -> None:
        given: object = self.accelerometers
        if not isinstance(given, tuple | list) or not all(
            isinstance(t, RecordedTriad) for t in given
        ):
            raise _wrong_type("accelerometers", given, self.name)
        object.__setattr__(self, "accelerometers", tuple(given))
        if not (self.gyro is None or isinstance(self.gyro, RecordedTriad)):
            raise _wrong_type("gyro", self.gyro, self.name)
        if not (self.assumed is None or isinstance(self.assumed, Assumed)):
            raise _wrong_type("assumed", self.assumed, self.name)
        if not isinstance(self.mounting, Mounting):
            raise _wrong_type("mounting", self.mounting, self.name)
        if not (self.trigger is None or is_number(self.trigger)):
            raise _wrong_type("trigger", self.trigger, self.name)


def _wrong_type(quantity: str, given: object, unit: object) -> ConfigError:
    return ConfigError(
        f"sensors.{quantity}-of-wrong-type",
        file=str(unit),
        quantity=quantity,
        type=type(given).__name__,
    )
