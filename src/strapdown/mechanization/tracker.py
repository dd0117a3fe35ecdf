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
from strapdown.exceptions import ConfigError, DataError, DivergenceError
from strapdown.mechanization.mechanization import Array, Mechanization
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.run import LONGEST_STEP, check_longest_step
from strapdown.nav_state import NavState
from strapdown.tables import SAMPLINGS

# Looked up once: at a microsecond a call, finding a name is a part of it.
_ndarray = np.ndarray


class NavTracker:
    """Navigate from samples, one call a sample.

    It gives the same numbers, to the last bit, as a run over the same samples with
    `increments.motion_increments` at its defaults.

    Parameters
    ----------
    start : NavState
        At the first sample.
    mechanization : NorthEastDown or WanderAzimuth, optional
        North-east-down on WGS 84 with a free height, if not given.
    sampling : {'instantaneous', 'mean'}
        What a sample is: the value at its stamp, or its mean over the interval that ends there.
    longest_step : float, s
        A longer step is a hole over which nothing is known, and refused; so is a first sample
        that is farther than this from the time of `start`.

    Raises
    ------
    ConfigError
        `sampling` is unknown, `longest_step` is no time, or the mechanization is another.
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
                f"'{sampling}' is no kind of sampling",
                quantity="sampling",
                remedy=f"use {' or '.join(SAMPLINGS)}",
            )
        used: object = NorthEastDown() if mechanization is None else mechanization
        update = used.sample_kernel() if isinstance(used, Mechanization) else None
        if not isinstance(used, Mechanization) or update is None:
            raise ConfigError(
                f"a tracker steps with NorthEastDown or WanderAzimuth, and not with {used!r}",
                quantity="mechanization",
                remedy="leave it out, or give one of these with its options; others navigate a "
                "whole log with run_mechanization",
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
        """Take one sample.

        Parameters
        ----------
        time : float, s
            Later than that of the sample before.
        gyro : ndarray or sequence of float, (3,), rad/s
            Body rate relative to inertial space, forward-right-down.
        accel : ndarray or sequence of float, (3,), m/s²
            Specific force in the same axes.
        height : float, m
            Reference height now, for a damped height; NaN where there is none.

        Raises
        ------
        DataError
            Time does not advance, or leaps; or rate and force are not three finite numbers each.
        DivergenceError
            The state would diverge, or come too near to a pole.

        Notes
        -----
        A sample that raises is not taken; the state is as before it.
        """
        try:
            if gyro.__class__ is not _ndarray:
                gyro = np.asarray(gyro, dtype=np.float64)
            if accel.__class__ is not _ndarray:
                accel = np.asarray(accel, dtype=np.float64)
            why = self._update(self._record, time, gyro, accel, height)
        except (NumbaError, TypeError, ValueError):
            # Of a kind that cannot be compiled for, or no numbers at all.
            why = kernel.BAD_SAMPLE
        if why:
            self._refuse(why, time, gyro, accel)

    def _refuse(self, why: int, time: float, gyro: ArrayLike, accel: ArrayLike) -> NoReturn:
        row = int(self._record[kernel.SAMPLES]) + 1
        if why == kernel.BAD_TIME:
            raise DataError(
                f"time does not advance: {self._record[kernel.TIME]:.9g} s is followed by "
                f"{time:.9g} s",
                row=row,
                quantity="time",
                remedy="leave the sample out; the state is as before it",
            )
        if why == kernel.BAD_START:
            raise DataError(
                f"the state is at {self._record[kernel.TIME]:.9g} s, and the first sample at "
                f"{time:.9g} s",
                row=row,
                quantity="time",
                remedy="give the state of that instant",
            )
        if why == kernel.BAD_HEIGHT:
            raise DataError(
                f"a reference height with a height that is {self._mechanization.height}, or one "
                "that is infinite",
                row=row,
                quantity="height",
                remedy="give finite heights to a mechanization with height='damped' alone, NaN "
                "where there is none",
            )
        if why == kernel.GAP:
            raise DataError(
                f"a gap of {time - self._record[kernel.TIME]:.6g} s before {time:.9g} s: what the "
                "body did in it is not known",
                row=row,
                quantity="time",
                remedy="begin again from a known state, or pass a longer longest_step",
            )
        rate, force = (v.tolist() if isinstance(v, np.ndarray) else v for v in (gyro, accel))
        given = f"time {time}, rate {rate}, force {force}"
        if why == kernel.BAD_SAMPLE:
            raise DataError(
                f"{given}: a time, three finite rates and three finite forces are needed",
                row=row,
                quantity="gyro, accel",
                remedy="leave the sample out; the state is as before it",
            )
        if why == POLE:
            raise DivergenceError(
                f"the step to {time:.9g} s comes nearer to a pole than "
                f"{self._mechanization.latitude_limit_deg:g} deg of latitude",
                row=row,
                quantity="lat",
                remedy="end here; north-east-down has no meaning at a pole",
            )
        if why == LEAP:
            raise DivergenceError(
                f"in the step to {time:.9g} s the place would move by more than {LARGEST_TURN:g} "
                "rad around the Earth",
                row=row,
                quantity="state",
                remedy="a step so long has no course between its ends: begin again from a known "
                "state",
            )
        raise DivergenceError(
            f"the state would diverge: {given}",
            row=row,
            quantity="state",
            remedy="look at this sample and those before it: units (rad/s, m/s²), the sign of "
            "gravity (-9.8 on z at level rest), a burst; the state is as before it",
        )

    @property
    def state(self) -> NavState:
        """Place, velocity and attitude at the last sample."""
        record = self._record
        return self._mechanization.nav_state(record[kernel.STATE :], float(record[kernel.TIME]))
