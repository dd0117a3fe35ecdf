"""Kinematics of a unit at a point of the vehicle, with the effects of its unknowns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.crash.acceleration import force_at_rest
from strapdown.crash.unit_effects import SampleEffects, unit_effects
from strapdown.sensors.lever_arm import MovedImu, move_unit
from strapdown.sensors.pre_crash import Levelling, PreparedUnit
from strapdown.sensors.rest import RestStretch
from strapdown.sensors.unmeasured import axis_names, unmeasured_axes, unmeasured_turns
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

#: Name that units without gyro have instead of that of a gyro's owner.
NO_GYRO = "no gyro"


@dataclass(frozen=True, eq=False)
class PointKinematics:
    """Kinematics from a unit, or the mean of several, at a point of the vehicle.

    Attributes
    ----------
    name : str
    imu : DataFrame
        Imu table in vehicle axes, time from the common trigger.
    effects : SampleEffects
    levelling : Levelling
    rest : RestStretch, optional
    rest_accel_sd : float, m/s²
        Standard deviation of the vehicle's own acceleration over the stationary interval.
    prepared : PreparedUnit, optional
        The source unit; None for a mean of several.
    moved : MovedImu, optional
        Data of the move to the point.
    unmeasured, unmeasured_turns : ndarray, (3, 3), optional
        Projections onto the directions, in vehicle axes, along which the specific force, and
        about which the rotation, is assumed instead of measured; None where all are measured.
    """

    name: str
    imu: pd.DataFrame = field(repr=False)
    effects: SampleEffects = field(repr=False)
    levelling: Levelling
    rest: RestStretch | None
    rest_accel_sd: float = 0.0
    prepared: PreparedUnit | None = field(default=None, repr=False)
    moved: MovedImu | None = field(default=None, repr=False)
    unmeasured: Array | None = field(default=None, repr=False)
    unmeasured_turns: Array | None = field(default=None, repr=False)

    @property
    def assumed_axes(self) -> tuple[str, ...]:
        """Assumed axes: of ``forward right down`` and ``roll pitch heading``."""
        none = np.zeros((3, 3))
        return axis_names(
            none if self.unmeasured is None else self.unmeasured,
            none if self.unmeasured_turns is None else self.unmeasured_turns,
        )

    @property
    def time(self) -> Array:
        """Stamps, (n,), s."""
        return np.asarray(self.imu.index.to_numpy(), dtype=np.float64)

    @property
    def force(self) -> Array:
        """Specific force, (n, 3), m/s²."""
        return np.ascontiguousarray(self.imu[ACCEL].to_numpy(dtype=np.float64))

    @property
    def rate(self) -> Array:
        """Rates, (n, 3), rad/s."""
        return np.ascontiguousarray(self.imu[GYRO].to_numpy(dtype=np.float64))

    @property
    def gyro(self) -> str:
        """Name of the unit that has the gyro, which others may borrow; or `NO_GYRO`."""
        if self.unmeasured_turns is not None and np.trace(self.unmeasured_turns) > 2.5:
            return NO_GYRO
        lender = None if self.prepared is None else self.prepared.unit.lender
        return self.name if lender is None else lender.name

    def resting_force(self, gravity: float) -> tuple[Array, Array]:
        """Mean specific force before the crash and its standard deviation, (3,) each, m/s².

        Without a stationary interval, gravity in the stated attitude.

        Parameters
        ----------
        gravity : float, m/s²
        """
        rest, level = self.rest, self.levelling
        if rest is None:
            tilt = gravity * math.radians(level.sd_deg)
            force = force_at_rest(level.roll_deg, level.pitch_deg, gravity)
            return force, np.array([tilt, tilt, 0.0])
        within = (self.imu.index >= rest.start - 1e-9) & (self.imu.index <= rest.end + 1e-9)
        mean = self.imu.loc[within, ACCEL].to_numpy(dtype=np.float64).mean(axis=0)
        noise = np.zeros(3) if rest.accel_mean_sd is None else np.asarray(rest.accel_mean_sd)
        return mean, np.hypot(noise, self.rest_accel_sd)


def at_point(
    prepared: PreparedUnit,
    point: Sequence[float],
    *,
    time_sd: float | None = None,
    window: float | None = None,
) -> PointKinematics:
    """Move a prepared unit to a point and list its unknowns there.

    Parameters
    ----------
    prepared : PreparedUnit
    point : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    time_sd : float, s, optional
        Standard deviation of the unit's clock relative to the common one; by default that of its
        trigger.
    window : float, s, optional
        Of the derivative, as in `move_imu`.

    Returns
    -------
    PointKinematics
    """
    moved = move_unit(prepared, point, window=window)
    axes, turns = unmeasured_axes(prepared.unit), unmeasured_turns(prepared.unit)
    if axes.any():
        moved = _but_along(axes, moved, prepared)
    sd = prepared.unit.trigger_sd if time_sd is None else time_sd
    return PointKinematics(
        prepared.unit.name,
        moved.imu,
        unit_effects(prepared, moved, time_sd=sd),
        prepared.levelling,
        prepared.rest,
        prepared.rest_accel_sd,
        prepared,
        moved,
        axes if axes.any() else None,
        turns if turns.any() else None,
    )


def _but_along(axes: Array, moved: MovedImu, prepared: PreparedUnit) -> MovedImu:
    """Remove the lever-arm terms along assumed axes: the assumption holds at the point itself."""
    kept, imu = np.eye(3) - axes, moved.imu.copy()
    force = moved.imu[ACCEL].to_numpy(dtype=np.float64) @ kept
    imu[ACCEL] = force + prepared.imu[ACCEL].to_numpy(dtype=np.float64) @ axes
    imu.attrs = dict(moved.imu.attrs)
    return replace(moved, imu=imu, added=kept @ moved.added @ kept)
