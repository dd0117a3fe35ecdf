"""Compiled engine for mechanizations, error models and forms that have a compiled loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels import filter_loop as kernel
from strapdown._kernels import robust
from strapdown._kernels.growth import factor_room, growth_arrays, growth_room, padded_width
from strapdown._kernels.level import LEVEL, NED, WANDER
from strapdown._kernels.robust import JOSEPH, PLAIN, UD, WD
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DivergenceError
from strapdown.estimation.covariance import (
    BiermanThornton,
    Chernodarov,
    CovarianceForm,
    Innovations,
    Joseph,
    Observation,
    Plain,
    Step,
    bad_observation,
)
from strapdown.estimation.error_filter import ErrorFilter, Rules, diverged
from strapdown.estimation.error_model import PHYSICAL, RotationVectorModel, refuse_damped_height
from strapdown.mechanization.mechanization import Mechanization, state_error
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.navigation.engine import LARGEST_GROUP, SAME_INSTANT, Engine, EngineState, NodeRows
from strapdown.navigation.measurements.gnss import POSITION_CODE
from strapdown.navigation.measurements.measurement import Epochs

Array = NDArray[np.float64]

# Exactly these types: a subclass may behave differently.
MECHANIZATIONS: dict[type[Mechanization], int] = {NorthEastDown: NED, WanderAzimuth: WANDER}
FORMS: dict[type[CovarianceForm], int] = {
    Joseph: JOSEPH,
    Plain: PLAIN,
    BiermanThornton: UD,
    Chernodarov: WD,
}


#: Step of a rule (`UpdateRule.step`) for a code and a component of a fix, its innovation, the
#: variance of the prediction, its own.
StepOf = Callable[[float, int, float, float, float], Step]
#: Times, states and sensor errors of no reference.
NO_REFERENCES = np.empty(0), np.empty((0, 10)), np.empty((0, 0))


def compiled(filter_: ErrorFilter) -> bool:
    """Whether the modules of a filter have a compiled loop."""
    return (
        type(filter_.mechanization) in MECHANIZATIONS
        and type(filter_.model) is RotationVectorModel
        and type(filter_.form) in FORMS
        and not filter_.rests
    )


class CompiledEngine(Engine):
    """North-east-down or wander azimuth, rotation-vector errors, closed loop.

    Its results equal those of `GeneralEngine` but for rounding.

    Parameters
    ----------
    filter_ : ErrorFilter
        For which `compiled` is true.
    """

    def __init__(self, filter_: ErrorFilter, state: EngineState) -> None:
        refuse_damped_height(filter_.mechanization)
        used, stacked = filter_.mechanization, filter_.model.stacked
        form = FORMS[type(filter_.form)]
        self.navigation, self.nodes = filter_, NodeRows(filter_, False)
        self._kinds = (MECHANIZATIONS[type(used)], form, used.height == "held")
        self._n = n = filter_.model.layout.size
        self._model = (
            stacked.gyro_terms,
            stacked.accel_terms,
            stacked.decay,
            stacked.drive,
            np.array(filter_.model.gyro_noise),
            np.array(filter_.model.accel_noise),
            filter_.earth,
            used.kernel_options(),
        )
        self._covariance = state.filter.covariance.copy()
        self._sensors = state.filter.sensors.copy()
        self._times = np.array([state.filter.time, state.time])
        self.mechanization = state.mechanization.copy()
        self._at_covariance = state.filter.mechanization.copy()
        self._newest = state.last.copy()
        self._states = (
            self.mechanization,
            self._at_covariance,
            self._covariance,
            self._sensors,
            self._times,
            self._newest,
        )
        self._group = (np.empty((LARGEST_GROUP + 1, used.row)), np.empty((LARGEST_GROUP, 10)))
        closing = (
            np.empty((PHYSICAL, padded_width(n))),
            growth_arrays(n),
            growth_room(n),
            np.empty((6, 3)),
            np.empty((1, LEVEL)),
            np.empty((n, n)),
            *factor_room(n),
        )
        self._room = (closing, np.empty((7, 3)), np.empty((7, 3)), np.empty(0))
        self._count = len(state.open_rows)
        self._group[0][: self._count + 1] = state.open_history
        self._group[1][: self._count] = state.open_rows
        self.filter, self.errors = state.filter, state.errors
        self.time, self.row, self.last = state.time, state.row, state.last

    def propagate(self, time: Array, rows: Array, history: Array, note_at: float) -> int:
        """Propagate over steps, as `Engine.propagate`."""
        made, why = 0, kernel.FULL
        while why == kernel.FULL:
            self.nodes.make_room(1)
            why, more, self._count, self.nodes.used = kernel.over_steps(
                self._kinds,
                self._model,
                self._states,
                self._group,
                self._count,
                self._room,
                self.navigation.step,
                note_at,
                time[made:],
                rows[made:],
                history[made:],
                self.nodes.room,
                self.nodes.used,
            )
            made += more
        self._after(why, time, made)
        return made

    def propagate_with_fixes(
        self,
        time: Array,
        rows: Array,
        history: Array,
        made: int,
        notes: tuple[float, float, float],
        receiver: tuple[Array, Array, Array, StepOf],
        fixes: Epochs,
        references: tuple[Array, Array, Array] = NO_REFERENCES,
    ) -> tuple[int, tuple[Array, ...], int, int]:
        """Process steps, and fixes with white errors, to the end of either.

        Parameters
        ----------
        time, rows, history
            As `propagate`; `rows` are changed where a fix cuts a step.
        made : int
            Steps that are already done.
        notes : tuple of float, (3,), s
            Time to stop at, as of `propagate`; from a mark to the next such time; age of a mark
            beyond which another is made before a fix.
        receiver : tuple of ndarray
            Arm of the antenna (3,), m; rule (`robust.linear_range`); scales that it learned, of
            positions and velocities (2, 3, 9): they are changed; and its step beyond the range.
        fixes : Epochs
            Of `measurements.gnss.Gnss`.
        references : tuple of ndarray
            Times, states and sensor errors, as of a `Reference`, that a `ReferenceEngine` follows.

        Returns
        -------
        made : int
        fixed : tuple of ndarray, of the m fixes that were taken
            Innovation, its predicted variance and weight (m, 3, 3); then, as of a
            `CovarianceSnapshot` before (NaN without one) and after each, times (m, 2), s,
            covariance (m, 2, 9, 9), sensors and their sd (m, 2, k).
        why : int
            Why it stopped: `filter_loop.ALL`, `NOTE` for a covariance to be noted, `ASK` before a
            fix that was rejected, or is doubted.
        followed : int
            References that were followed.
        """
        arm, rule, scales, step_of = receiver
        (note_at, interval, aged), size, k = notes, len(fixes.time), self._n - 9
        told, at, noted = (
            np.empty((size, kernel.TOLD, 3)),
            np.empty((size, 2)),
            np.empty((size, 2, 9, 9)),
        )
        sensors, sd = np.empty((size, 2, k)), np.empty((size, 2, k))
        steps, (why, done, followed) = np.zeros((3, 5)), (kernel.FULL, 0, 0)
        errors = self._beside()
        while why == kernel.FULL or (
            why == kernel.ASK and _has_step(steps, fixes.values[done], step_of)
        ):
            # A fix needs a propagation and an update.
            self.nodes.make_room(2)
            first = self.nodes.used
            left = np.empty((len(self.nodes.room), PHYSICAL))
            why, made, self._count, more, self.nodes.used, passed = kernel.over_fixes(
                self._kinds,
                self._model,
                self._states,
                self._group,
                self._count,
                self._room,
                self.navigation.step,
                note_at if not done else at[done - 1, 1] + interval,
                interval,
                time,
                rows,
                history,
                made,
                self.nodes.room,
                self.nodes.used,
                SAME_INSTANT,
                arm,
                POSITION_CODE,
                fixes.time[done:],
                fixes.values[done:],
                rule,
                scales,
                steps,
                told[done:],
                aged,
                at[done:],
                noted[done:],
                sensors[done:],
                sd[done:],
                (errors, left, *(of[followed:] for of in references)),
            )
            done, followed = done + more, followed + passed
            self._keep(errors, left[first : self.nodes.used])
        if why == kernel.BAD_FIX:
            raise bad_observation(0, told[done, 0, 0], told[done, 1, 0], fixes.values[done, 4:])
        self._after(why, time, made)
        fixed = tuple(each[:done] for each in (told, at, noted, sensors, sd))
        return int(made), fixed, why, followed

    def _beside(self) -> Array:
        """Estimated errors that are kept beside the state, (n,); none where they are fed back."""
        return np.empty(0)

    def _keep(self, errors: Array, left: Array) -> None:
        """Take the errors that a loop kept beside the state, and those left at its new nodes."""

    def close(self) -> None:
        """Propagate the covariance to the newest step."""
        if self._count:
            self.nodes.make_room(1)
            bad, self.nodes.used = kernel.close_group(
                self._kinds,
                self._model,
                self._states,
                self._group,
                self._count,
                self._room[0],
                self.nodes.room,
                self.nodes.used,
            )
            if bad >= 0:
                raise self._no_covariance()
            self._count = 0
        self._note()

    def observe(
        self, observations: Sequence[Observation], rules: Sequence[Rules]
    ) -> list[Innovations]:
        """Update with the observations at the current instant."""
        met = self.filter
        self.filter, taken, seen = self.navigation.observe(met, observations, rules)
        self.nodes.updated(met, taken, self.filter)
        self._corrected()
        return seen

    def _corrected(self) -> None:
        """Continue from the corrected state of the filter, where no group is open."""
        self.mechanization[:], self.row = self.filter.mechanization, self.filter.row
        self._at_covariance[:] = self.mechanization
        self._sensors[:] = self.filter.sensors
        self._covariance[:] = self.filter.covariance
        self._group[0][0] = self.row

    def carry(self, T: Array, Q: Array, first: int = 0) -> None:
        """Transform the errors, and add a noise."""
        self.filter = self.navigation.carried(self.filter, T, Q)
        self.nodes.carried(T, first, self.filter)
        self._covariance[:] = self.filter.covariance

    def shown(self) -> Array:
        """Return the row of the newest step."""
        return self.row

    @classmethod
    def going_on(cls, filter_: ErrorFilter, state: EngineState) -> CompiledEngine:
        """Return an engine at a state: the one that produced it, if it was not used since.

        This saves the cost of making an engine per sample. Continuing a second time from the same
        state gives a new engine, with the same result.
        """
        gave = _AT_STATE.pop(state, None)
        return gave if gave is not None and gave.navigation is filter_ else cls(filter_, state)

    def state(self) -> EngineState:
        """Return the current state; afterwards the engine may be used by `going_on` only."""
        state = EngineState(
            filter=self.filter,
            errors=self.errors,
            time=self.time,
            mechanization=self.mechanization.copy(),
            row=self.row,
            open_history=self._group[0][: self._count + 1].copy(),
            open_rows=self._group[1][: self._count].copy(),
            last=self.last,
        )
        _AT_STATE[state] = self
        return state

    def _after(self, why: int, time: Array, made: int) -> None:
        """Copy the results of a loop."""
        if why == kernel.DIVERGED:
            raise diverged(float(time[made]))
        if why == kernel.BAD:
            raise self._no_covariance()
        self._note()
        self.time, self.last = float(self._times[kernel.AT_STEP]), self._newest.copy()
        if self._count:
            self.row = self._group[0][self._count].copy()
        else:
            self.row = self.filter.row

    def _note(self) -> None:
        """Copy the state of the filter from the loop's arrays."""
        if self.filter.time != self._times[kernel.AT_COVARIANCE] or not self._count:
            self.filter = replace(
                self.filter,
                time=float(self._times[kernel.AT_COVARIANCE]),
                mechanization=self._at_covariance.copy(),
                row=self._group[0][0].copy(),
                sensors=self._sensors.copy(),
                covariance=self._covariance.copy(),
            )

    def _no_covariance(self) -> DivergenceError:
        time = float(self._times[kernel.AT_STEP])
        return DivergenceError("navigation.covariance-lost", quantity="covariance", time=time)


def _has_step(steps: Array, fix: Array, step_of: StepOf) -> bool:
    """Whether the rule takes the component of a fix that a loop asked for; its step is filled."""
    for j in np.flatnonzero(steps[:, robust.KNOWN] == robust.ASKED).tolist():
        nu, s = steps[j, robust.MOVED], steps[j, robust.SLOPE]
        taken = step_of(fix[kernel.CODE], j, float(nu), float(s), float(fix[kernel.VARIANCE + j]))
        if taken[-1] != 0.0:
            steps[j] = robust.YES, *taken
            return True
    return False


class ReferenceEngine(CompiledEngine):
    """Linearized about a reference instead of the filter's own estimates, for a smoother.

    The state follows the reference, to which `follow` moves it; the estimated errors of the state
    are kept beside it (`errors`), and so is what a smoother finds, so that the products of all
    transitions and observations are those of one trajectory. The nodes must be recorded: they hold
    the transitions.
    """

    def __init__(self, filter_: ErrorFilter, state: EngineState) -> None:
        super().__init__(filter_, state)
        self.errors = state.errors.copy()
        #: Of each node that the errors have been carried over, in parts.
        self._left: list[Array] = []
        self._carried = 0

    def propagate(self, time: Array, rows: Array, history: Array, note_at: float) -> int:
        """Propagate over steps, as `Engine.propagate`."""
        made = super().propagate(time, rows, history, note_at)
        self._carry_errors()
        return made

    def close(self) -> None:
        """Propagate covariance and estimates to the newest step."""
        super().close()
        self._carry_errors()

    def observe(
        self, observations: Sequence[Observation], rules: Sequence[Rules]
    ) -> list[Innovations]:
        """Update with the observations at the current instant; the state stays."""
        met, before = self.filter, self.errors
        self.filter, self.errors, seen = self.navigation.estimate(met, before, observations, rules)
        self.nodes.updated(met, self.errors - before, self.filter)
        self._corrected()
        self._carry_errors()
        return seen

    def carry(self, T: Array, Q: Array, first: int = 0) -> None:
        """Transform the errors, and add a noise."""
        super().carry(T, Q, first)
        self.errors = T @ self.errors
        self._carry_errors()

    def follow(self, reference: Array, sensors: Array) -> None:
        """Move the state to a reference; what it is moved by goes to the estimated errors.

        Parameters
        ----------
        reference : ndarray, (10,)
            At the newest step, as of a `Reference`.
        sensors : ndarray, (k,)
            Errors of the sensors.
        """
        self.close()
        used = self.navigation.mechanization
        own = used.nav_state(self.mechanization, self.time)
        true = NavState.of_numbers(self.time, reference)
        apart = state_error(own, true, find_ellipsoid(used.ellipsoid)).reshape(3, 3)
        level = apart @ used.level_from_ned(self.row).T
        moved = np.concatenate([level.ravel(), sensors - self.filter.sensors])
        self.filter = self.navigation.corrected(self.filter, moved)
        self.errors = self.errors - moved
        self._corrected()
        # A node of its own, where what is left on the output jumps.
        self.nodes.carried(np.eye(self._n), 0, self.filter)
        self._carry_errors()

    def left_at_nodes(self) -> Array:
        """Return what is left on the output at each node."""
        self._carry_errors()
        return np.concatenate([np.empty((0, PHYSICAL)), *self._left])

    def state(self) -> EngineState:
        """Return the current state."""
        return replace(super().state(), errors=self.errors.copy())

    def _beside(self) -> Array:
        self._carry_errors()
        return self.errors.copy()

    def _keep(self, errors: Array, left: Array) -> None:
        self.errors = errors.copy()
        self._left.append(left)
        self._carried += len(left)

    def _carry_errors(self) -> None:
        """Propagate the estimated errors over the new nodes, and record them at each."""
        for rows in self.nodes.since(self._carried):
            errors, left = self.errors.copy(), np.empty((len(rows), PHYSICAL))
            kernel.carry_errors(rows, 0, len(rows), errors, left)
            self._keep(errors, left)


#: Engines that hold a state and can continue from it, as long as the state exists.
_AT_STATE: WeakKeyDictionary[EngineState, CompiledEngine] = WeakKeyDictionary()
