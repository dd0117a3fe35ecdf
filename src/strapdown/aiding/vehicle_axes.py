"""How the inertial sensors stand in a vehicle or an instrument: assumed, and what may be wrong."""

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

ANGLES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class VehicleAxes:
    """Axes of a vehicle, forward, right, down, in which its wheels roll; or of an instrument.

    Attributes
    ----------
    angles_deg : tuple of float, deg
        Roll, pitch, yaw of the inertial sensors in the vehicle, 3-2-1, as `Mounting.angles_deg`:
        with a level vehicle that drives north they are roll, pitch and heading of the sensors.
        ``C_vb`` turns the axes of the sensors into those of the vehicle.
    sd_deg : tuple of float, deg
        Of three angles by which that is wrong, about the axes of the vehicle:
        ``C_vb true = R_z(-yaw) R_y(-pitch) R_x(-roll) C_vb assumed``. Where zero is assumed they
        are the assumed angles less the true ones, and else nearly. An angle with no standard
        deviation is known, and no state. A turn about the direction of travel is not seen by a
        velocity along it.
    """

    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sd_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def states(self, name: str) -> tuple[SensorStates, ...]:
        """Return the states, if any, of an aid: what is wrong with the angles, rad."""
        labels = [label for label, sd in zip(ANGLES, self.sd_deg, strict=True) if sd > 0.0]
        if not labels:
            return ()
        sds = [math.radians(sd) for sd in self.sd_deg if sd > 0.0]
        return (unseen(f"{name}.mounting", labels, "rad", sds),)

    def now(self, view: View, name: str) -> Array:
        """Return ``C_vb``, (3, 3), without what is estimated of its errors."""
        # What is estimated comes off the roll, then the pitch, then the yaw.
        return self._back(view, name)[0] @ rotation.dcm_from_euler(self.angles_deg)

    def of_vehicle(self, view: View, name: str, velocity: Array, H: Array) -> tuple[Array, Array]:
        """Turn a velocity in body axes, and what errors do to it, into axes of the vehicle.

        Parameters
        ----------
        view : View
        name : str
            Of the aid that has the states: ``NAME.mounting``.
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)

        Returns
        -------
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)
        """
        back, axes, labels = self._back(view, name)
        C_vb = back @ rotation.dcm_from_euler(self.angles_deg)
        out, H = C_vb @ velocity, C_vb @ H
        if labels:
            at = view.place(f"{name}.mounting")
            H[:, at] = np.column_stack([np.cross(axes[ANGLES.index(x)], out) for x in labels])
        return out, H

    def _back(self, view: View, name: str) -> tuple[Array, Array, tuple[str, ...]]:
        """What takes the estimates off, the axes about which the angles then turn, their names."""
        if not view.has(f"{name}.mounting"):
            return np.eye(3), np.eye(3), ()
        labels = view.labels(f"{name}.mounting")
        found = dict(zip(labels, view.estimate(f"{name}.mounting").tolist(), strict=True))
        roll, pitch, yaw = (math.degrees(found.get(label, 0.0)) for label in ANGLES)
        back = rotation.dcm_from_euler([-roll, -pitch, -yaw])
        axes = np.eye(3)
        axes[0] = rotation.dcm_from_euler([0.0, -pitch, -yaw])[:, 0]
        axes[1] = rotation.dcm_from_euler([0.0, 0.0, -yaw])[:, 1]
        return back, axes, labels
