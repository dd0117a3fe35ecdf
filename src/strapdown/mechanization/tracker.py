"""Navigation sample by sample, as it runs on a device or live."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numba.core.errors import NumbaError
from numpy.typing import ArrayLike

from strapdown._kernels import sample as kernel
from strapdown._kernels.ned import LARGEST_TURN, LEAP, POLE
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.mechanization.mechanization import Array, Mechanization
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.run import LONGEST_STEP, check_longest_step
from strapdown.nav_state import NavState
from strapdown.tables import SAMPLINGS

# Looked up once: attribute lookup is a significant part of a call of a microsecond.
_ndarray = np.ndarray


class NavTracker:
    """Navigate from samples, one call per sample.

    Its result equals, to the last bit, that of a run over the same samples with
    `increments.motion_increments` at its defaults.

    Parameters
    ----------
    start : NavState
        At the first sample.
    mechanization : NorthEastDown or WanderAzimuth, optional
        North-east-down on WGS 84 with a free height, if not given.
    sampling : {'instantaneous', 'mean'}
        Sample type: the value at its stamp, or its mean over the interval that ends there.
    longest_step : float, s
        A longer step is a gap in the data, and refused; so is a first sample that is farther
        than this from the time of `start`.

    Raises
    ------
    ConfigError
        `sampling` is unknown, `longest_step` is not a valid time, or the mechanization differs.
    """

    __slots__ = ("_mechanization", "_record", "_update")

    def __init__(
        self,
        start: NavState,
        mechanization: Mechanization | None = None,
        sampling: str = "instantaneous",
        longest_step: float = LONGEST_STEP,
    ) -> None:
        check_longest_step(longest_step)
        if sampling not in SAMPLINGS:
            raise ConfigError(
                "mechanization.no-kind-sampling",
                quantity="sampling",
                sampling=sampling,
                samplings=SAMPLINGS,
            )
        used: object = NorthEastDown() if mechanization is None else mechanization
        update = used.sample_kernel() if isinstance(used, Mechanization) else None
        if not isinstance(used, Mechanization) or update is None:
            raise ConfigError(
                "mechanization.tracker-steps-northeastdown-or-wanderazimuth",
                quantity="mechanization",
                used=used,
            )
        begin = used.begin(start)
        record = np.zeros(kernel.STATE + len(begin))
        record[kernel.TIME] = start.time
        record[kernel.LONGEST] = longest_step
        record[kernel.MEAN] = float(sampling == "mean")
        record[kernel.EARTH : kernel.OPTIONS] = find_ellipsoid(used.ellipsoid).parameters()
        record[kernel.OPTIONS : kernel.STATE] = used.kernel_options()
        record[kernel.STATE :] = begin
        self._mechanization = used
        self._record = record
        self._update = update

    def update(
        self,
        time: float,
        gyro: Array | Sequence[float],
        accel: Array | Sequence[float],
        height: float = float("nan"),
    ) -> None:
        """Process one sample.

        Parameters
        ----------
        time : float, s
            Later than that of the sample before.
        gyro : ndarray or sequence of float, (3,), rad/s
            Body rate relative to inertial space, forward-right-down.
        accel : ndarray or sequence of float, (3,), m/s²
            Specific force in the same axes.
        height : float, m
            Reference height now, for a damped height; NaN for a missing one.

        Raises
        ------
        DataError
            Time does not advance, or leaps; or rate and force are not three finite numbers each.
        DivergenceError
            The state would diverge, or come too near to a pole.

        Notes
        -----
        A sample that raises an error is ignored; the state is as before it.
        """
        try:
            if gyro.__class__ is not _ndarray:
                gyro = np.asarray(gyro, dtype=np.float64)
            if accel.__class__ is not _ndarray:
                accel = np.asarray(accel, dtype=np.float64)
            why = self._update(self._record, time, gyro, accel, height)
        except (NumbaError, TypeError, ValueError):
            # Of a type that cannot be compiled for, or not numbers.
            why = kernel.BAD_SAMPLE
        if why:
            self._refuse(why, time, gyro, accel)

    def _refuse(self, why: int, time: float, gyro: ArrayLike, accel: ArrayLike) -> NoReturn:
        row = int(self._record[kernel.SAMPLES]) + 1
        if why == kernel.BAD_TIME:
            raise DataError(
                "mechanization.time-does-not-advance-followed",
                row=row,
                quantity="time",
                record=self._record[kernel.TIME],
                time=time,
            )
        if why == kernel.BAD_START:
            raise DataError(
                "mechanization.state-first-sample",
                row=row,
                quantity="time",
                record=self._record[kernel.TIME],
                time=time,
            )
        if why == kernel.BAD_HEIGHT:
            raise DataError(
                "mechanization.reference-height-height-or-infinite",
                row=row,
                quantity="height",
                height=self._mechanization.height,
            )
        if why == kernel.GAP:
            raise DataError(
                "mechanization.gap-before-body-did-not",
                row=row,
                quantity="time",
                time=time - self._record[kernel.TIME],
                time_2=time,
            )
        rate, force = (v.tolist() if isinstance(v, np.ndarray) else v for v in (gyro, accel))
        given = f"time {time}, rate {rate}, force {force}"
        if why == kernel.BAD_SAMPLE:
            raise DataError(
                "mechanization.time-three-finite-rates-three",
                row=row,
                quantity="gyro, accel",
                given=given,
            )
        if why == POLE:
            raise DivergenceError(
                "mechanization.step-comes-nearer-pole-than",
                row=row,
                quantity="lat",
                time=time,
                latitude_limit_deg=self._mechanization.latitude_limit_deg,
            )
        if why == LEAP:
            raise DivergenceError(
                "mechanization.step-place-would-move-more",
                row=row,
                quantity="state",
                time=time,
                largest_turn=LARGEST_TURN,
            )
        raise DivergenceError(
            "mechanization.state-would-diverge", row=row, quantity="state", given=given
        )

    @property
    def state(self) -> NavState:
        """Position, velocity and attitude at the last sample."""
        record = self._record
        return self._mechanization.nav_state(record[kernel.STATE :], float(record[kernel.TIME]))
