"""Closed-loop Kalman filter over the errors of a mechanization (error-state EKF)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from strapdown import rotation
from strapdown._kernels.compensation import compensate, errors_of_states
from strapdown._kernels.level import ALT, AXIS, Q_LB
from strapdown.constants import STANDARD_GRAVITY
from strapdown.earth import gravity
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DivergenceError
from strapdown.estimation.covariance import (
    CovarianceForm,
    FullUpdate,
    Innovations,
    Observation,
    UpdateRule,
)
from strapdown.estimation.error_model import PHYSICAL, ErrorModel, Segment
from strapdown.estimation.sensor_states import StateLayout
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState
from strapdown.tables.checks import Array

# Relative excess of a noise over its known part, so that the difference stays positive
# semidefinite: for a noise of deficient rank, as that of a quaternion's four numbers, rounding of
# the whole, 2e-16, must be negligible beside it (`_kernels.covariance.INDEFINITE`).
ROUNDING = 1e-5
# Position of the rotation among the physical errors.
ROTATION = slice(6, 9)


@dataclass(frozen=True)
class ErrorFilter:
    """Closed loop: estimates are subtracted at once from the mechanization and the sensors.

    Error = computed − true. Those of the sensors are the residual errors of the readings after the
    estimates have been subtracted: true error − estimate. In the covariance, the signs between
    attitude and biases are those of these errors.

    Stateless: `begin` makes a state, `predict` and `observe` return a new one.

    Attributes
    ----------
    mechanization : Mechanization
    model : ErrorModel
    form : CovarianceForm
    rule : UpdateRule, optional
        Weighting of observations; full weight if not given.
    step : float, s
        Longest time over which errors grow by means of attitude and force.
    rests : bool
        Whether the body is known to be stationary, so that errors grow by gravity and the
        attitude, not by the sensor readings: sensor noise and sway would act as a motion that
        separates errors, although they are themselves observed. Errors of the biases then keep
        their direction in level axes, not in body axes, when an attitude is corrected:
        unobservable directions stay so, while otherwise each correction of a heading by degrees
        adds false information on it (Huang, Mourikis and Roumeliotis, Int. J. Robotics Research
        29 (2010) 502, on such filters). The standard deviations of the axes that a correction
        mixes should be alike.
    """

    mechanization: Mechanization
    model: ErrorModel
    form: CovarianceForm
    rule: UpdateRule | None = None
    step: float = 0.1
    rests: bool = False

    @cached_property
    def earth(self) -> Array:
        """Ellipsoid of the mechanization, as kernels take it."""
        return find_ellipsoid(self.mechanization.ellipsoid).parameters()

    def begin(self, start: NavState, P: Array) -> FilterState:
        """Return the state at a start.

        `P` ((p, p)): covariance of the physical errors: nine in north-east-down axes, and the
        sensors'.
        """
        state = self.mechanization.begin(start)
        row = self.mechanization.history_row(state)
        turn = np.eye(self.model.physical_size)
        level = self.mechanization.level_from_ned(row)
        for at in (0, 3, 6):
            turn[at : at + 3, at : at + 3] = level
        to_states = self.model.from_physical(self.mechanization, start.time, row) @ turn
        return FilterState(
            time=start.time,
            mechanization=state,
            row=row,
            sensors=np.zeros(self.model.physical_size - PHYSICAL),
            covariance=self.form.begin(symmetric(to_states @ P @ to_states.T)),
        )

    def compensated(self, state: FilterState, rows: Array) -> Array:
        """Return rows of motion increments with the estimated errors subtracted, (k, 10).

        The errors of a triad are a constant part, and parts per rate and per force x, y, z.
        """
        stacked, errors = self.model.stacked, np.empty((2, 7, 3))
        errors_of_states(stacked.gyro_terms, state.sensors, errors[0])
        errors_of_states(stacked.accel_terms, state.sensors, errors[1])
        out = np.empty_like(rows)
        compensate(rows, errors[0], errors[1], out)
        return out

    def advance_compensated(
        self, mechanization: Array, time: Array, rows: Array, history: Array
    ) -> None:
        """Advance a state of the mechanization, in place, over compensated increments.

        `mechanization`: it is changed. `time` ((k,), s): ends of the steps, for messages. `rows`
        ((k, 10)): from `compensated`. `history` ((k, row)): filled with its rows after each step.
        DivergenceError: the state is outside the validity of the mechanization; the sample is
        named.
        """
        made, why = self.mechanization.advance_rows(
            mechanization, rows, np.empty(0), self.earth, history
        )
        if why:
            raise diverged(float(time[made]))

    def follow(
        self, state: FilterState, time: Array, history: Array, rows: Array, mechanization: Array
    ) -> tuple[FilterState, Array]:
        """Propagate estimates and covariance over steps that the mechanization has made.

        `state`: at the start of the first step. `time` ((k,), s): ends of the steps. `history` ((k
        + 1, row)). `rows` ((k, 10)): from `compensated`. `mechanization`: its state after the last
        step. Returns `Phi` ((n, n)): how the states went on.
        """
        segment = Segment(self.mechanization, np.concatenate([[state.time], time]), history, rows)
        Phi, Q = self._transition(segment)
        after = FilterState(
            float(time[-1]),
            mechanization.copy(),
            history[-1],
            self._decayed(state, float(time[-1])),
            self.form.predict(state.covariance, Phi, Q),
        )
        return after, Phi

    def predict(self, state: FilterState, time: Array, rows: Array) -> tuple[FilterState, Segment]:
        """Propagate over motion increments.

        `time` ((k,), s): ends of the steps. `rows` ((k, 10)): as the sensors gave them. Returns
        `segment`: the run, of increments without the errors estimated so far. DivergenceError: the
        mechanization has left its range of validity.
        """
        after, segment = self._run(state, time, rows)
        Phi, Q = self._transition(segment)
        return replace(after, covariance=self.form.predict(state.covariance, Phi, Q)), segment

    def predict_observing(
        self,
        state: FilterState,
        time: Array,
        rows: Array,
        observe: Callable[[Segment], Observation],
    ) -> tuple[FilterState, Segment, Innovations]:
        """Predict over motion increments that are themselves observed, and correct by them.

        The noise of such an observation is in the state, too: the noise of gyros whose rotation is
        compared with the Earth's also rotates the attitude. So the observation is processed before
        the prediction, from which the known part of the noise is subtracted: with the noise v of
        the observation, ``M = cov(w, v)`` and ``S = M R^-1``, the transition is ``Phi - S H`` and
        the covariance of the noise ``Q - S M'`` (Simon, Optimal State Estimation, 2006, sec. 7.1).

        `time`, `rows`: as `predict`. `observe`: returns the observation of a segment: of the errors
        at its start, R without the noise that is in the rotation of the state.
        """
        after, segment = self._run(state, time, rows)
        Phi, Q = self._transition(segment)
        observation = observe(segment)
        used = self.mechanization
        H = observation.H @ self.model.to_physical(used, state.time, state.row)
        to_physical = self.model.to_physical(used, after.time, after.row)
        M = Q @ to_physical[ROTATION].T
        shared = to_physical[ROTATION] @ M
        # As independent components, each with at least its part.
        R = observation.R + (1.0 + ROUNDING) * np.abs(shared).sum(axis=1)
        covariance, x, seen = self.form.update(
            state.covariance, np.zeros(len(Q)), observation.z, H, R, self.rule
        )
        S = M * (seen.weight / R)
        Phi = Phi - S @ H
        covariance = self.form.predict(covariance, Phi, symmetric(Q - S @ M.T))
        after = replace(after, covariance=covariance)
        return self._fed_back(after, to_physical, Phi @ x + S @ observation.z), segment, seen

    def observe(
        self,
        state: FilterState,
        observations: Sequence[Observation],
        rules: Sequence[Rules] | None = None,
    ) -> tuple[FilterState, Array, list[Innovations]]:
        """Update with the observations of an epoch, and correct the state (closed loop).

        `observations`: of this state, independent of each other. `rules` (of a sequence of them, or
        of None): weighting of each, one rule for all of its components or one for each; the
        filter's own for all, if not given. Returns `taken` ((p,)): the physical errors that were
        corrected; `innovations`: of each observation.
        """
        to_physical = self.model.to_physical(self.mechanization, state.time, state.row)
        x = np.zeros(to_physical.shape[1])
        after, x, seen = self.estimate(state, x, observations, rules)
        return self._fed_back(after, to_physical, x), to_physical @ x, seen

    def estimate(
        self,
        state: FilterState,
        x: Array,
        observations: Sequence[Observation],
        rules: Sequence[Rules] | None = None,
    ) -> tuple[FilterState, Array, list[Innovations]]:
        """Update with the observations of an epoch without correcting the state.

        `x` ((n,)): estimated states before it. `observations`, `rules`: as `observe`. Returns
        `state`: with the covariance after; `x` ((n,)).
        """
        to_physical = self.model.to_physical(self.mechanization, state.time, state.row)
        covariance, x, seen = self.form.update(
            state.covariance,
            x,
            np.concatenate([one.z for one in observations]),
            np.concatenate([one.H for one in observations]) @ to_physical,
            np.concatenate([one.R for one in observations]),
            self.rule if rules is None else rules_of_components(rules, observations),
        )
        cuts = np.cumsum([one.z.size for one in observations])[:-1]
        parts = (np.split(values, cuts) for values in (seen.nu, seen.s, seen.weight))
        each = [Innovations(*one) for one in zip(*parts, strict=True)]
        return replace(state, covariance=covariance), x, each

    def carried(self, state: FilterState, T: Array, Q: Array) -> FilterState:
        """Return a state with its errors transformed now, and a noise added.

        `T` ((p, p)): of the physical errors. `Q` ((n, n)): of the states.
        """
        used, time, row = self.mechanization, state.time, state.row
        if not self.model.states_are_physical:
            T = self.model.from_physical(used, time, row) @ T
            T = T @ self.model.to_physical(used, time, row)
        return replace(state, covariance=self.form.predict(state.covariance, T, Q))

    def corrected(self, state: FilterState, physical: Array) -> FilterState:
        """Return a state with physical errors, (p,), subtracted; the covariance stays its own."""
        return self._fed_back(state, np.eye(len(physical)), physical)

    def physical_covariance(self, state: FilterState) -> Array:
        """Return the covariance of the physical errors, (p, p), in level axes."""
        P = self.form.matrix(state.covariance)
        if self.model.states_are_physical:
            return P
        T = self.model.to_physical(self.mechanization, state.time, state.row)
        return symmetric(T @ P @ T.T)

    def _transition(self, segment: Segment) -> tuple[Array, Array]:
        """Transition of the errors over a segment, with its noise."""
        return self.model.transition(resting(segment) if self.rests else segment, self.step)

    def _run(self, state: FilterState, time: Array, rows: Array) -> tuple[FilterState, Segment]:
        """Run the mechanization over compensated increments; the covariance is unchanged."""
        used = self.mechanization
        rows = self.compensated(state, rows)
        history = np.empty((len(rows) + 1, used.row))
        history[0] = state.row
        after = state.mechanization.copy()
        self.advance_compensated(after, time, rows, history[1:])
        segment = Segment(used, np.concatenate([[state.time], time]), history, rows)
        sensors = self._decayed(state, float(time[-1]))
        return FilterState(float(time[-1]), after, history[-1], sensors, state.covariance), segment

    def _decayed(self, state: FilterState, time: float) -> Array:
        """Estimates of the sensors' errors at a later time."""
        return state.sensors * np.exp(-self.model.stacked.decay * (time - state.time))

    def _fed_back(self, state: FilterState, to_physical: Array, x: Array) -> FilterState:
        """Subtract an estimate from the mechanization and from the sensors."""
        used = self.mechanization
        physical = to_physical @ x
        corrected = used.correct(state.mechanization, physical[:PHYSICAL])
        row = used.history_row(corrected)
        covariance = state.covariance
        if not self.model.states_are_physical:
            # States defined by the corrected quantity refer to the new one from now on: the norm
            # error of a quaternion is along the new quaternion.
            carried = self.model.from_physical(used, state.time, row) @ to_physical
            covariance = self.form.predict(covariance, carried, np.zeros_like(covariance))
        if self.rests:
            turned = biases_in_level(used, self.model.layout, state.row, row)
            covariance = self.form.predict(covariance, turned, np.zeros_like(covariance))
        return replace(
            state,
            mechanization=corrected,
            row=row,
            sensors=state.sensors + physical[PHYSICAL:],
            covariance=covariance,
        )


def diverged(time: float) -> DivergenceError:
    """Error for a state outside the mechanization's validity, at the sample of this time."""
    return DivergenceError("estimation.state-diverged-sample", quantity="state", time=time)


def symmetric(P: Array) -> Array:
    """Return the symmetric part of a square matrix."""
    return 0.5 * (P + P.T)


@dataclass(frozen=True, eq=False)
class FilterState:
    """State of a filter between steps.

    Attributes
    ----------
    time : float, s
    mechanization : ndarray
        State of the mechanization, corrected.
    row : ndarray
        Its row of a history.
    sensors : ndarray, (k,)
        Estimates of the sensors' errors, in the order of the model's `sensors`.
    covariance : ndarray, (n, n)
        State of the covariance form.
    """

    time: float
    mechanization: Array
    row: Array
    sensors: Array
    covariance: Array


# Observations of one epoch as one update: the rule and the innovation of each component.


#: Weighting of an observation: one rule, one for each of its components, or none.
Rules = UpdateRule | Sequence[UpdateRule] | None


def rules_of_components(
    rules: Sequence[Rules], observations: Sequence[Observation]
) -> list[UpdateRule] | None:
    """Return one rule for each component, or None if no component has one.

    `rules`: one an observation.
    """
    if not any(rules):
        return None
    out: list[UpdateRule] = []
    for rule, one in zip(rules, observations, strict=True):
        out += rule if isinstance(rule, Sequence) else [rule or FullUpdate()] * one.z.size
    return out


# Error propagation for a body known to be stationary (`ErrorFilter.rests`).


# Position of the attitude in a level row.
ATTITUDE = slice(Q_LB, Q_LB + 4)
# Blocks of states that are vectors in body axes.
BIASES = ("gyro_bias", "accel_bias")


def resting(segment: Segment) -> Segment:
    """Return a segment whose specific forces are gravity at its attitude."""
    used = segment.mechanization
    levels = used.levels(segment.history[:-1])
    rows = segment.increments.copy()
    up = np.zeros((len(rows), 3))
    up[:, 2] = used.level_up * _gravity(used, levels[0])
    up = rotation.rotate(rotation.conjugate(levels[:, ATTITUDE]), up)
    rows[:, 4:7] = up * rows[:, :1]
    return replace(segment, increments=rows)


def biases_in_level(
    mechanization: Mechanization, layout: StateLayout, before: Array, after: Array
) -> Array:
    """Return the transition by a correction that keeps bias errors constant in level axes.

    `layout`: of n states. `before`, `after` ((row,)): of a history, before and after the correction
    of the attitude. Returns (n, n).
    """
    q_before, q_after = mechanization.levels(np.stack([before, after]))[:, ATTITUDE]
    turn = rotation.dcm_from_quaternion(rotation.compose(rotation.conjugate(q_after), q_before))
    out = np.eye(layout.size)
    for name in BIASES:
        if name in layout:
            at = layout[name]
            out[at, at] = turn
    return out


def _gravity(mechanization: Mechanization, level: Array) -> float:
    """Gravity at a level row, m/s²."""
    sine = float(level[AXIS + 2]) * mechanization.level_up
    lat = math.degrees(math.asin(min(max(sine, -1.0), 1.0)))
    found = gravity(lat, float(level[ALT]), ellipsoid=find_ellipsoid(mechanization.ellipsoid))
    return float(np.linalg.norm(found))


# Second order of the correction of a tilt: sensors turn with it, and gravity along them changes.


# Root of the summed variances of both tilts, rad, below which the effect is at most 1 mm/s², the
# drift of an accelerometer of the cheapest class.
LARGE = math.radians(0.8)
# Positions of both tilts among the physical errors.
TILTS = slice(6, 8)
# Blocks of states that act as a bias of the accelerometers, in order of preference.
ACCEL_BIASES = ("accel_bias", "accel_drift")


def is_large(P: Array) -> bool:
    """Return whether a tilt may be so large that its second order counts.

    `P` ((p, p)): covariance of the physical errors, level axes.
    """
    return float(np.trace(P[TILTS, TILTS])) > LARGE**2


def turned_force(
    filter_: ErrorFilter, before: FilterState, after: FilterState
) -> tuple[Array, int] | None:
    """Return the transformation of the errors by a correction of a large tilt.

    While a vehicle goes straight on, fixes determine what the accelerometers add to gravity, in
    level axes: the tilt with the bias that hides it, and the vertical bias. A correction of the
    attitude turns the axes of the sensors, and the bias that is unknown along a horizontal one gets
    a vertical part. If the errors of the accelerometers kept their covariance in body axes, the
    vertical bias, which is known, would then determine the horizontal one, and so the tilt: each
    correction adds false information. The errors are kept in level axes instead (Huang, Mourikis
    and Roumeliotis, Int. J. Robotics Research 29 (2010) 502, on unobservable directions).

    `before`, `after`: states before and after the correction. Returns (p, p), of the physical
    errors, and the first of the three that it changes, or None for a model without a bias of the
    accelerometers.
    """
    used, bias = filter_.mechanization, _accel_bias(filter_)
    if bias is None:
        return None
    quaternions = used.levels(np.stack([before.row, after.row]))[:, ATTITUDE]
    C, C_after = (rotation.dcm_from_quaternion(q) for q in quaternions)
    out = np.eye(filter_.model.physical_size)
    out[bias, PHYSICAL:] += (C_after.T @ C - np.eye(3)) @ _accel_error(filter_, C)
    return out, bias.start


def _accel_bias(filter_: ErrorFilter) -> slice | None:
    """Positions, among the physical errors, of the states that act as a bias of accelerometers."""
    layout = filter_.model.layout
    first = next((layout[name].start for name in ACCEL_BIASES if name in layout), None)
    if first is None:
        return None
    first += filter_.model.physical_size - layout.size
    return slice(first, first + 3)


def _accel_error(filter_: ErrorFilter, C: Array) -> Array:
    """Error of the accelerometers, body axes, at rest by the states of the sensors, (3, k)."""
    up = filter_.mechanization.level_up * STANDARD_GRAVITY * C[2]
    inputs = np.concatenate([[1.0, 0.0, 0.0, 0.0], up])
    return np.asarray(np.tensordot(inputs, filter_.model.stacked.accel, axes=1))


def unlearnt_force(
    filter_: ErrorFilter, state: FilterState, before: Array, after: Array
) -> Array | None:
    """Return the added variance of the accelerometer bias after a correction of tilt.

    While a vehicle goes straight on, fixes determine the sum of a tilt and of the accelerometer
    bias that hides it, and the whole vertical bias, about the computed attitude. Once the tilt is
    observed otherwise, mostly by a turn, and corrected by x and y, gravity along the body changes
    by ``g (x² + y²)/2``, which a linear filter neglects. Its variance is ``g² tr(T²)/2`` with the
    covariance T of the tilts that are tied to the bias; an update inflates by the decrease of this
    variance, so that the sum does not depend on the number of updates.

    Its mean is neglected: subtracting it did not change how far bounds held in 60 drives.

    `state`: before the observation. `before`, `after` ((p, p)): covariance of the physical errors
    before and after it, level axes. Returns (n, n), or None, for the states of the model. None
    where the tilt is not large, no part is tied to a bias, or the model has no bias of the
    accelerometers.

    Tied is the part of the bias that is correlated with the tilt: ``T = M P M'/g²`` with the
    regression M of the accelerometers' error, level axes, on the tilts. For an exactly known
    accelerometer M is zero, and so is the inflation. Jazwinski, Stochastic Processes and
    Filtering Theory (1970), sec. 9.3, has the variance of a second order; when it applies is
    derived here.
    """
    used, bias = filter_.mechanization, _accel_bias(filter_)
    if bias is None or not is_large(before):
        return None
    C = rotation.dcm_from_quaternion(used.levels(state.row[None])[0, ATTITUDE])
    read = C[:2] @ _accel_error(filter_, C)
    tilt = before[TILTS, TILTS]
    M = np.linalg.solve(tilt, (read @ before[PHYSICAL:, TILTS]).T).T / STANDARD_GRAVITY
    was, now = M @ tilt @ M.T, M @ after[TILTS, TILTS] @ M.T
    variance = 0.5 * STANDARD_GRAVITY**2 * float(np.sum(was * was) - np.sum(now * now))
    if not variance > 0.0:
        return None
    along = np.zeros(len(before))
    along[bias] = C[2]
    along = filter_.model.from_physical(used, state.time, state.row) @ along
    return variance * np.outer(along, along)
