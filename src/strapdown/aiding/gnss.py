"""Places and velocities of a satellite receiver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Epochs, TableAid
from strapdown.aiding.view import DISPLACEMENT, ROTATION, VELOCITY, View
from strapdown.estimation.observation import Observation
from strapdown.mechanization.state_error import displacement_between
from strapdown.nav_state import NavState
from strapdown.rotation import cross_matrix
from strapdown.tables import GEODETIC, GNSS, POSITION_SD, VELOCITY_SD, check_gnss
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import index_of, values_of

__all__ = ["Gnss"]

Array = NDArray[np.float64]

#: What an epoch is of: the first of its values.
POSITION_CODE, VELOCITY_CODE = 0.0, 1.0


@dataclass(frozen=True)
class Gnss(TableAid):
    """A satellite receiver: places of its antenna, velocities, or both.

    Attributes
    ----------
    lever_arm : tuple of float, (3,), m
        Of the antenna from the inertial sensors, body axes.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    kind: ClassVar[str] = "gnss"
    summary: ClassVar[str] = "places and velocities of a satellite receiver"
    source: ClassVar[str] = "Chernodarov (2009), Eqs. (19), (20)"
    columns: ClassVar[tuple[str, ...]] = tuple(GNSS)

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each place and for each velocity; see `TableAid.epochs`."""
        check_gnss(table)
        time = index_of(table)
        good = values_of(table, ["quality"])[:, 0] > 0.0
        times, rows = [], []
        for code, columns, sds in (
            (POSITION_CODE, GEODETIC, POSITION_SD),
            (VELOCITY_CODE, VELOCITY_COLUMNS, VELOCITY_SD),
        ):
            value, sd = values_of(table, columns), values_of(table, sds)
            told = good & np.isfinite(sd).all(axis=1)
            if code == POSITION_CODE:
                value = np.column_stack([np.radians(value[:, :2]), value[:, 2]])
            times.append(time[told])
            rows.append(np.column_stack([np.full(len(value), code), value, sd**2])[told])
        at = np.concatenate(times)
        order = np.argsort(at, kind="stable")
        return Epochs(at[order], np.concatenate(rows)[order])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return a place or a velocity, north, east, down, less what was measured."""
        arm = view.C_lb @ np.asarray(self.lever_arm)
        C_nl = view.C_ln.T
        H = np.zeros((3, view.columns))
        if values[0] == POSITION_CODE:
            lat, lon, alt = values[1:4].tolist()
            measured = NavState(view.time, lat, lon, alt, np.zeros(3), view.here.q_nb)
            z = displacement_between(view.here, measured, view.ellipsoid)
            z += C_nl @ arm
            H[:, DISPLACEMENT] = C_nl
            H[:, ROTATION] = -C_nl @ cross_matrix(arm)
            return [Observation(f"{self.name}.position", z, H, values[4:7], PLACE)]
        z = C_nl @ view.velocity - values[1:4]
        H[:, VELOCITY] = C_nl
        return [Observation(f"{self.name}.velocity", z, H, values[4:7], SPEED)]


PLACE = ("north, m", "east, m", "down, m")
SPEED = ("VN, m/s", "VE, m/s", "VD, m/s")
