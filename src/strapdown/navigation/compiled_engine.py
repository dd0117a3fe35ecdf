"""The way of a navigator whose mechanization, error model and form have one compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels import error_loop as kernel
from strapdown._kernels.growth import padded
from strapdown._kernels.level import LEVEL
from strapdown.estimation.covariance import CovarianceForm, Innovations
from strapdown.estimation.error_filter import ErrorFilter, Rules, diverged
from strapdown.estimation.error_model import refuse_damped_height
from strapdown.estimation.joseph import Joseph, Plain
from strapdown.estimation.observation import Observation
from strapdown.estimation.rotation_vector_model import RotationVectorModel
from strapdown.estimation.ud import BiermanThornton
from strapdown.estimation.wd import Chernodarov
from strapdown.exceptions import DivergenceError
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.navigation.engine import LARGEST_GROUP, Engine, EngineState

__all__ = ["CompiledEngine", "compiled"]

Array = NDArray[np.float64]

# Exactly these: whatever is made from them may do otherwise.
MECHANIZATIONS = {NorthEastDown: kernel.NED, WanderAzimuth: kernel.WANDER}
FORMS: dict[type[CovarianceForm], bool] = {
    Joseph: False,
    Plain: False,
    BiermanThornton: True,
    Chernodarov: True,
}


def compiled(filter_: ErrorFilter) -> bool:
    """Whether the modules of a filter have a compiled loop."""
    return (
        type(filter_.mechanization) in MECHANIZATIONS
        and type(filter_.model) is RotationVectorModel
        and type(filter_.form) in FORMS
        and not filter_.rests
    )


class CompiledEngine(Engine):
    """North-east-down or a wander azimuth, with the errors as vectors, fed back.

    The numbers are those of `GeneralEngine` but for rounding.

    Parameters
    ----------
    filter_ : ErrorFilter
        For which `compiled` is true.
    state : EngineState
    """

    def __init__(self, filter_: ErrorFilter, state: EngineState) -> None:
        refuse_damped_height(filter_.mechanization)
        self.navigation = filter_
        self._which = MECHANIZATIONS[type(filter_.mechanization)]
        self._factored = FORMS[type(filter_.form)]
        self._held = filter_.mechanization.height == "held"
        self._options = filter_.mechanization.kernel_options()
        self._noise = np.array([filter_.model.gyro_noise, filter_.model.accel_noise])
        self._n = n = filter_.model.layout.size
        rows, width = (n, n) if self._factored else padded(n)
        rows_of_q, width_of_f = padded(n)
        used = filter_.mechanization
        self._covariance = np.zeros((rows, width))
        self._open_history = np.empty((LARGEST_GROUP + 1, used.row))
        self._open_rows = np.empty((LARGEST_GROUP, 10))
        self._errors, self._heights = np.empty((2, 7, 3)), np.empty(0)
        self._room = (
            np.empty((9, width_of_f)),
            np.empty((9, width_of_f)),
            np.empty(n - 9),
            np.empty((rows_of_q, width_of_f)),
            np.empty((51 + rows_of_q, width_of_f)),
            np.empty((6, 3)),
            np.empty((1, LEVEL)),
            np.zeros((rows, width)),
            np.empty((n, n)),
            np.empty((n, n)),
        )
        self.errors = state.errors
        self.filter = state.filter
        self.mechanization = state.mechanization.copy()
        self._sensors = state.filter.sensors.copy()
        self._covariance[:n, :n] = state.filter.covariance
        self._times = np.array([state.filter.time, state.time])
        self._count = len(state.open_rows)
        self._open_history[: self._count + 1] = state.open_history
        self._open_rows[: self._count] = state.open_rows
        self.time, self.row, self.last = state.time, state.row, state.last

    def over(self, time: Array, rows: Array, history: Array, note_at: float) -> int:
        """Go over steps, as `Engine.over`."""
        stacked = self.navigation.model.stacked
        why, made, self._count = kernel.over_steps(
            self._which,
            self._factored,
            self._held,
            self.navigation.step,
            note_at,
            self.mechanization,
            self._covariance,
            self._sensors,
            self._times,
            self._count,
            self._open_history,
            self._open_rows,
            time,
            rows,
            history,
            stacked.gyro_terms,
            stacked.accel_terms,
            stacked.decay,
            stacked.drive,
            self._noise,
            self.navigation.earth,
            self._options,
            self._errors,
            self._heights,
            self._room,
        )
        if why == kernel.DIVERGED:
            raise diverged(float(time[made]))
        if why == kernel.BAD:
            raise self._no_covariance()
        self.time = float(self._times[kernel.AT_STEP])
        if self._count:
            self.row = self._open_history[self._count].copy()
            self.last = self._open_rows[self._count - 1].copy()
        self._note()
        return int(made)

    def close(self) -> None:
        """Take the covariance to the newest step."""
        if self._count:
            stacked = self.navigation.model.stacked
            bad = kernel.close_group(
                self._which,
                self._factored,
                self._held,
                self._covariance,
                self._sensors,
                self._times,
                self._count,
                self._open_history,
                self._open_rows,
                stacked.gyro_terms,
                stacked.accel_terms,
                stacked.decay,
                stacked.drive,
                self._noise,
                self.navigation.earth,
                self._room,
            )
            if bad >= 0:
                raise self._no_covariance()
            self._count = 0
        self._note()

    def observe(
        self, observations: Sequence[Observation], rules: Sequence[Rules]
    ) -> list[Innovations]:
        """Take what is observed now."""
        self.filter, seen = self.navigation.observe(self.filter, observations, rules)
        self.mechanization, self.row = self.filter.mechanization.copy(), self.filter.row
        self._sensors[:] = self.filter.sensors
        self._covariance[: self._n, : self._n] = self.filter.covariance
        self._open_history[0] = self.row
        return seen

    def shown(self) -> Array:
        """Return the row of the newest step."""
        return self.row

    def state(self) -> EngineState:
        """Return where it is now."""
        return EngineState(
            filter=self.filter,
            errors=self.errors,
            time=self.time,
            mechanization=self.mechanization.copy(),
            row=self.row,
            open_history=self._open_history[: self._count + 1].copy(),
            open_rows=self._open_rows[: self._count].copy(),
            last=self.last,
        )

    def _note(self) -> None:
        """Read the state of the filter from the loop's arrays."""
        if self.filter.time != self._times[kernel.AT_COVARIANCE] or not self._count:
            n = self._n
            row = self._open_history[0].copy()
            self.filter = replace(
                self.filter,
                time=float(self._times[kernel.AT_COVARIANCE]),
                mechanization=self.mechanization.copy(),
                row=row,
                sensors=self._sensors.copy(),
                covariance=self._covariance[:n, :n].copy(),
            )

    def _no_covariance(self) -> DivergenceError:
        time = float(self._times[kernel.AT_STEP])
        return DivergenceError(
            f"the covariance is none any more at {time:.9g} s: a variance is negative or no number",
            quantity="covariance",
            remedy="use covariance 'ud' or 'wd', which cannot lose a variance to rounding, and "
            "look at the standard deviations that are given: units, and nothing known exactly",
        )
