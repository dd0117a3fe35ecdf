"""From the instant of an entry to the sample nearest to it: at most half a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.crash.sample_effects import SampleEffects
from strapdown.crash.window_weights import window_weights
from strapdown.rotation import cross_matrix
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ToStamp:
    """What happens from the instant of an entry to a sample.

    Attributes
    ----------
    length : float, s
        Negative where the sample is the earlier one.
    turn : ndarray, (3,), rad
        Rotation vector of the body, body axes.
    push : ndarray, (3,), m/s
        Integral of the specific force, in the body axes in the middle.
    turn_errors, push_errors : ndarray, (p, 3)
        What one standard deviation of each unknown adds to them.
    """

    length: float
    turn: Array
    push: Array
    turn_errors: Array
    push_errors: Array

    def attitude_before(self, q_nb: Array) -> Array:
        """Attitude at the entry from that at the sample, (4,)."""
        return rotation.compose(q_nb, rotation.quaternion_from_rotation_vector(-self.turn))

    def attitude_after(self, q_nb: Array) -> Array:
        """Attitude at the sample from that at the entry, (4,)."""
        return rotation.compose(q_nb, rotation.quaternion_from_rotation_vector(self.turn))

    def felt(self, q_nb: Array) -> Array:
        """Integral of the specific force in local level, (3,), m/s; `q_nb` at the sample."""
        half = rotation.quaternion_from_rotation_vector(-0.5 * self.turn)
        return rotation.rotate(rotation.compose(q_nb, half), self.push)

    def gained(self, q_nb: Array) -> Array:
        """Change of the velocity in local level, (3,), m/s; `q_nb` at the sample."""
        return np.asarray(self.felt(q_nb) + np.array([0.0, 0.0, GRAVITY * self.length]))

    def carried(self, errors: Array, q_nb: Array, *, turned: bool) -> Array:
        """Errors at the sample from those at the entry.

        Parameters
        ----------
        errors : ndarray, (p, 9)
            Rotation vector in local level, velocity, place; the unknowns of the samples first.
        q_nb : ndarray, (4,)
            At the sample.
        turned : bool
            The attitude is that of the entry too; otherwise it is the sample's already.

        Returns
        -------
        ndarray, (p, 9)
            To first order. Of the place, what grows in half a step is left out.
        """
        out, own = errors.copy(), slice(0, len(self.turn_errors))
        C = rotation.dcm_from_quaternion(q_nb)
        # phi x f, of every row.
        out[:, 3:6] += errors[:, :3] @ cross_matrix(self.felt(q_nb))
        out[own, 3:6] += self.push_errors @ C.T
        if turned:
            out[own, :3] += self.turn_errors @ C.T
        return out


def to_stamp(imu: pd.DataFrame, effects: SampleEffects, instant: float, row: int) -> ToStamp:
    """Integrate from an instant between two samples to one of them.

    Parameters
    ----------
    imu : DataFrame
        Imu table; between its samples as `window_weights` says.
    effects : SampleEffects
        On the same samples.
    instant : float, s
        Before the first or after the last sample, these hold on.
    row : int
        Of the sample.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    length = float(time[row] - instant)
    inside = min(max(instant, float(time[0])), float(time[-1]))
    sampling = str(imu.attrs.get("sampling", "instantaneous"))
    weights = window_weights(time, inside, float(time[row]), sampling)
    weights[row] += inside - instant
    near = np.flatnonzero(weights)
    few = weights[near]
    return ToStamp(
        length,
        few @ imu[GYRO].to_numpy(dtype=np.float64)[near],
        few @ imu[ACCEL].to_numpy(dtype=np.float64)[near],
        np.einsum("n,pni->pi", few, effects.rate[:, near]),
        np.einsum("n,pni->pi", few, effects.force[:, near]),
    )
