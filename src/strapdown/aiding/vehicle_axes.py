"""How the inertial sensors stand in their vehicle: assumed, and what may be wrong with it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.aiding.view import View
from strapdown.estimation.sensor_blocks import unseen
from strapdown.estimation.sensor_states import SensorStates

__all__ = ["VehicleAxes"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class VehicleAxes:
    """Axes of a vehicle, forward, right, down, in which its wheels roll.

    Attributes
    ----------
    angles_deg : tuple of float, deg
        Roll, pitch, yaw of the inertial sensors in the vehicle, 3-2-1, as `Mounting.angles_deg`:
        with a level vehicle that drives north they are roll, pitch and heading of the sensors.
        ``C_vb`` turns the axes of the sensors into those of the vehicle.
    sd_deg : tuple of float, deg
        Of pitch and of yaw; a roll about the direction of travel is not seen by a velocity along
        it. Zero both: known, without states.
    """

    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sd_deg: tuple[float, float] = (0.0, 0.0)

    def states(self, name: str) -> tuple[SensorStates, ...]:
        """Return the states, if any: assumed pitch and yaw less true, rad."""
        if not any(self.sd_deg):
            return ()
        sd = [math.radians(x) for x in self.sd_deg]
        return (unseen(f"{name}.mounting", ("pitch", "yaw"), "rad", sd),)

    def of_vehicle(self, view: View, name: str, velocity: Array, H: Array) -> tuple[Array, Array]:
        """Turn a velocity in body axes, and what errors do to it, into axes of the vehicle.

        Parameters
        ----------
        view : View
        name : str
            Of the aid.
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)

        Returns
        -------
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)
        """
        C_vb = self.now(view, name)
        out, H = C_vb @ velocity, C_vb @ H
        if any(self.sd_deg):
            at = view.place(f"{name}.mounting")
            yaw = float(view.estimate(f"{name}.mounting")[1])
            of_pitch = [math.sin(yaw), math.cos(yaw), 0.0]
            H[:, at] = np.column_stack([np.cross(of_pitch, out), np.cross([0.0, 0.0, 1.0], out)])
        return out, H

    def now(self, view: View, name: str) -> Array:
        """Return ``C_vb``, (3, 3), without what is estimated of its errors."""
        C_vb = rotation.dcm_from_euler(self.angles_deg)
        if not any(self.sd_deg):
            return C_vb
        # What is estimated comes off the pitch first, then off the yaw, as 3-2-1 angles turn.
        pitch, yaw = np.degrees(view.estimate(f"{name}.mounting")).tolist()
        return rotation.dcm_from_euler([0.0, -pitch, -yaw]) @ C_vb
