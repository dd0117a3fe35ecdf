"""Attitude sample by sample, as it runs on a device or live."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numba.core.errors import NumbaError
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels.increments import HEAD, LARGEST, MEAN, OPTIONS, SAMPLES, TIME
from strapdown.attitude.algorithm import Array, AttitudeAlgorithm
from strapdown.errors import ConfigError, DataError
from strapdown.tables import SAMPLINGS

# Looked up once: attribute lookup is a tenth of a call of half a microsecond.
_ndarray = np.ndarray


class AttitudeTracker:
    """Propagate an attitude from gyro samples, one call per sample.

    Its result equals that of a batch over the same samples to the last bit.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    q_nb : array_like, (4,), optional
        Initial attitude, body to local level; identity if not given.
    sampling : {'instantaneous', 'mean'}
        Sample type: the rate at its stamp, or its mean over the interval that ends there.

    Raises
    ------
    ConfigError
        `sampling` is unknown.
    DataError
        `q_nb` is not a rotation.
    """

    __slots__ = ("_algorithm", "_record", "_update")

    def __init__(
        self,
        algorithm: AttitudeAlgorithm,
        q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        sampling: str = "instantaneous",
    ) -> None:
        if sampling not in SAMPLINGS:
            raise ConfigError(
                "attitude.no-kind-sampling",
                quantity="sampling",
                sampling=sampling,
                samplings=SAMPLINGS,
            )
        unit = rotation.normalise(q_nb)
        head = np.zeros(HEAD)
        head[MEAN] = float(sampling == "mean")
        options = algorithm.kernel_options()
        head[OPTIONS:] = options
        self._algorithm = algorithm
        self._record = np.concatenate([head, algorithm.begin(unit)])
        self._update = type(algorithm).update_kernel

    def update(self, time: float, gyro: Array | Sequence[float]) -> None:
        """Process one sample.

        Parameters
        ----------
        time : float, s
            Later than that of the sample before.
        gyro : ndarray or sequence of float, (3,), rad/s
            Body rate, forward-right-down.

        Raises
        ------
        DataError
            Time does not advance, or the rate is not three finite numbers. The sample is
            then not taken, and the state is as before.
        """
        try:
            if gyro.__class__ is not _ndarray:
                gyro = np.asarray(gyro, dtype=np.float64)
            if self._update(self._record, time, gyro) >= 0.0:
                return
        except (NumbaError, TypeError, ValueError):
            # Of a type that cannot be compiled for, or not numbers.
            self._refuse(float("nan"), gyro)
        self._refuse(time, gyro)

    def _refuse(self, time: float, gyro: Array | Sequence[float]) -> NoReturn:
        if self._record[SAMPLES] > 0 and time <= self._record[TIME] and np.size(gyro) == 3:
            raise DataError(
                "attitude.time-does-not-advance-followed",
                row=int(self._record[SAMPLES]) + 1,
                quantity="time",
                record=self._record[TIME],
                time=time,
            )
        raise DataError(
            "attitude.time-rate-time-three-finite",
            row=int(self._record[SAMPLES]) + 1,
            quantity="gyro",
            time=time,
            asarray=np.asarray(gyro).tolist(),
            largest=LARGEST,
        )

    @property
    def quaternion(self) -> Array:
        """The attitude ``q_nb``, (4,), unit norm."""
        native = self._record[HEAD : HEAD + self._algorithm.width]
        q: Array = self._algorithm.quaternions(native[None, :].copy())[0]
        return q

    @property
    def roll_pitch_heading(self) -> Array:
        """The attitude as 3-2-1 angles, (3,), deg."""
        return rotation.euler_from_quaternion(self.quaternion)
