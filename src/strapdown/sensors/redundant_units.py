"""Voting of two or more inertial units on one body, fused into one table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import Flags
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.crash_unit import SAME_STAMP
from strapdown.sensors.health_log import WORDS, known_median
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import (
    Array,
    check_columns,
    check_time,
    index_of,
    is_number,
    source_of,
    values_of,
)

# Parity of redundant axes: their consistency, independent of the motion.


# Limits of the smallest over the largest singular value, and of the cosine of two parity columns.
RANK = 1e-6
PARALLEL = 1e-9


def checked_directions(directions: ArrayLike) -> Array:
    """Check and return unit vectors, one per row, that span space.

    ConfigError: they are not (m, 3) numbers of length one to within 1e-6, or they lie in a plane.
    """
    h = np.asarray(directions, dtype=np.float64)
    if h.ndim != 2 or h.shape[1] != 3 or h.shape[0] < 3 or not np.isfinite(h).all():
        raise ConfigError("sensors.directions-shape", quantity="directions", shape=h.shape)
    off = np.abs(np.sqrt((h**2).sum(axis=1)) - 1.0)
    if off.max() > 1e-6:
        raise ConfigError(
            "sensors.row-length-or-inverse",
            quantity="directions",
            argmax=int(off.argmax()) + 1,
            off=1.0 + off.max(),
        )
    values = np.linalg.svd(h, compute_uv=False)
    if values[-1] < RANK * values[0]:
        raise ConfigError("sensors.all-axes-lie-plane", quantity="directions")
    return np.ascontiguousarray(h)


def parity_matrix(directions: ArrayLike) -> Array:
    """Parity matrix V, which cancels the motion: ``V H = 0``, ``V Vᵀ = I``.

    `directions` ((m, 3)): H, unit vectors of the measurement axes. Returns (m - 3, m): the parity
    vector of readings z is ``p = V z``. Errors e with covariance C give it the covariance
    ``V C Vᵀ``, and ``pᵀ (V C Vᵀ)⁻¹ p`` is chi-square with m - 3 degrees of freedom. Its sign and
    rotation are those of a singular value decomposition.

    Potter and Suman 1977 (AGARDograph 224, Thresholdless redundancy management with arrays of
    skewed instruments). An axis that fails moves p along its own column of V, which identifies it
    among five or more axes if no two columns are parallel.
    """
    h = checked_directions(directions)
    u, _, _ = np.linalg.svd(h, full_matrices=True)
    return np.ascontiguousarray(u[:, 3:].T)


def isolable_axes(directions: ArrayLike) -> NDArray[np.bool_]:
    """Axes whose single failure can be distinguished from that of any other, (m,)."""
    v = parity_matrix(directions)
    m = v.shape[1]
    if v.shape[0] < 2:
        return np.zeros(m, dtype=bool)
    length = np.sqrt((v**2).sum(axis=0))
    seen = length > RANK
    unit = v / np.where(seen, length, 1.0)
    cosine = np.abs(unit.T @ unit) - np.eye(m)
    return np.asarray(seen & ~(cosine > 1.0 - PARALLEL).any(axis=1))


# Voting rule, and stated errors of the axes.


@dataclass(frozen=True)
class VotingRule:
    """Criteria for disagreement, exclusion and readmission of an axis.

    Attributes
    ----------
    windows : tuple of float, s
        Time constants of the compared means: short ones for large faults, long ones for small
        faults. Until a mean is as old as its time constant, it is the mean of all samples so far.
    persist : float
        Fraction of its time constant for which a window's chi-square must exceed its limit.
    learn : float, s
        Learning time, in which the axes are compared within their stated biases; afterwards each is
        compared within its possible change since.
    readmit : float, s
        A failed axis is readmitted after it has been within half the limit for this time; infinite
        means never. A disagreement of the same two axes is reported again after this time without
        one.
    false_alarm : float, 1/h
        Expected number of samples per hour beyond a limit, for all windows and both triads, if all
        errors are as stated.
    confusion : float
        Required likelihood ratio of the excluded axis to the next candidate.
    apart : float, m
        Largest distance between the accelerometers of two units. Lever arms are not corrected; this
        allows for the centripetal acceleration between them, ``apart ω²``.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    windows: tuple[float, ...] = (0.1, 5.0)
    persist: float = 0.5
    learn: float = 30.0
    readmit: float = 60.0
    false_alarm: float = 1e-3
    confusion: float = 1e-6
    apart: float = 0.0

    def __post_init__(self) -> None:
        good = {
            "windows": bool(self.windows)
            and all(is_number(x) and 0.0 < x < math.inf for x in self.windows),
            "persist": is_number(self.persist) and 0.0 < self.persist < math.inf,
            "learn": is_number(self.learn) and 0.0 < self.learn < math.inf,
            "readmit": is_number(self.readmit) and self.readmit > 0.0,
            "false_alarm": is_number(self.false_alarm) and 0.0 < self.false_alarm < 1.0,
            "confusion": is_number(self.confusion) and 0.0 < self.confusion < 1.0,
            "apart": is_number(self.apart) and 0.0 <= self.apart < math.inf,
        }
        for name, fine in good.items():
            if not fine:
                raise ConfigError("sensors.will-not-do", quantity=name, value=getattr(self, name))


@dataclass(frozen=True, eq=False)
class AxisErrors:
    """Stated errors of m axes: arrays (m,), named as in `TriadUncertainty` and `BiasDrift`."""

    noise_density: Array
    bias: Array
    scale: Array
    misalignment: Array
    g_sensitivity: Array
    quantization: Array
    drift: Array
    correlation_time: Array

    @classmethod
    def of(cls, parts: Sequence[tuple[TriadUncertainty, BiasDrift, int]]) -> AxisErrors:
        """Collect axis ``part[2]`` of each triad."""
        names = ("noise_density", "bias", "scale", "misalignment", "g_sensitivity", "quantization")
        columns = {n: np.array([t.axis(n)[k] for t, _, k in parts]) for n in names}
        drift = np.array([d.triad[k] for _, d, k in parts])
        time = np.array([d.correlation_time for _, d, _ in parts])
        return cls(**columns, drift=drift, correlation_time=time)


HOUR = 3600.0  # s
# Gyros and accelerometers are tested separately.
TRIADS = 2


@dataclass(frozen=True, eq=False)
class VotingState:
    """State of a vote over a log; `advance` does not change these kernel arrays."""

    arrays: tuple[NDArray[np.generic], ...]
    samples: int


@dataclass(frozen=True)
class AxisEvent:
    """A decision of the vote.

    `kind` ({'excluded', 'readmitted', 'disagree'}). `row`: sample of the chunk at which it was
    decided, from 0. `since`: sample from which the chi-square has exceeded its limit; negative if
    before the chunk. `axes`: the failed axes; for a disagreement, the two most likely ones. `size`:
    deviation of the first axis from the others, in the unit of the readings.
    """

    kind: str
    row: int
    since: int
    axes: tuple[int, ...]
    size: float
    chi_square: float
    limit: float


@dataclass(frozen=True, eq=False)
class AxisVote:
    """Result of a vote over a chunk.

    `values` ((n, 3)): vector in body axes, from the healthy axes. `used` ((n, m)).
    """

    values: Array
    used: Flags
    events: tuple[AxisEvent, ...]


@dataclass(frozen=True, eq=False)
class AxisVoting:
    """Single-axis sensors of one kind on one body.

    Attributes
    ----------
    directions : array_like, (m, 3)
        Unit vectors of the measurement axes, in body axes. Four detect a single failure; five, no
        three in a plane, identify it.
    errors : AxisErrors
    rate : float, Hz
        Sample rate, from which the noise of a sample follows.
    rule : VotingRule
    groups : sequence of int, optional
        Unit of each axis, from 0: a unit may fail as a whole. Default: each axis is its own unit.
    apart : float, m
        For accelerometers, as `VotingRule.apart`.

    Raises
    ------
    ConfigError
        The directions are invalid, the number of errors differs, or the errors of an axis are not
        stated.

    Notes
    -----
    The vector is the weighted least-squares solution of the healthy axes. The means of the readings
    over each window are tested: the chi-square of their residuals, equal to that of the parity
    vector, against noise and the stated bias, scale factor, misalignment, g-sensitivity and drift.
    After `learn`, each axis is corrected for its deviation from the mean of all, and only possible
    changes count, so that the vector does not step when an axis is excluded. An axis is excluded
    where the others agree without it and no other explains the deviation as well; a unit, where no
    single axis does. The axes are assumed to share stamps and delay.
    """

    directions: ArrayLike
    errors: AxisErrors
    rate: float
    rule: VotingRule = field(default_factory=VotingRule)
    groups: Sequence[int] | None = None
    apart: float = 0.0

    def __post_init__(self) -> None:
        h = checked_directions(self.directions)
        object.__setattr__(self, "directions", h)
        own = range(len(h)) if self.groups is None else self.groups
        groups = np.asarray(list(own), dtype=np.int64)
        if len(self.errors.bias) != len(h) or groups.size != len(h):
            raise ConfigError(
                "sensors.directions-errors-groups",
                quantity="errors",
                count=len(h),
                count_2=len(self.errors.bias),
                size=groups.size,
            )
        if not (is_number(self.rate) and 0.0 < self.rate < math.inf):
            raise ConfigError("sensors.no-rate", quantity="rate", rate=self.rate)
        if not (self._one_second() > 0.0).all():
            k = int(np.argmin(self._one_second()))
            raise ConfigError("sensors.neither-noise-nor-bias-stated", quantity="errors", k=k + 1)
        object.__setattr__(self, "groups", groups)

    @property
    def weights(self) -> Array:
        """Weights of the axes: inverse variances of 1 s means, with bias and drift."""
        return np.asarray(1.0 / self._one_second())

    def covariance(self, used: Flags, variance: Array) -> Array:
        """Covariance of the vector, (3, 3), for independent axis variances, (m,)."""
        h = np.asarray(self.directions)
        w = self.weights * used
        gain = np.linalg.solve((h.T * w) @ h, h.T * w)
        return np.asarray((gain * variance) @ gain.T)

    def begin(self) -> VotingState:
        """Return the state before the first sample."""
        m, s = len(np.asarray(self.directions)), len(self.rule.windows)
        ints = np.int64
        arrays = (
            np.zeros((s, m)),
            np.zeros((s, 3)),
            np.ones(s),
            np.zeros(m),
            np.zeros(m),
            np.zeros(3),
            np.zeros(2, dtype=ints),
            np.zeros(m, dtype=ints),
            np.zeros(m, dtype=ints),
            np.zeros(m, dtype=ints),
            np.zeros(s, dtype=ints),
            np.zeros(m, dtype=ints),
        )
        return VotingState(arrays, 0)

    def advance(
        self, state: VotingState, readings: ArrayLike, other: ArrayLike | None = None
    ) -> tuple[VotingState, AxisVote]:
        """Process a chunk; the results do not depend on how the log is divided.

        Parameters
        ----------
        state : VotingState
        readings : array_like, (n, m)
            NaN where a reading is missing.
        other : array_like, (n, 3), optional
            For gyros the specific force, for their g-sensitivity; for accelerometers the rate, for
            units apart (`VotingRule.apart`); in body axes.

        Raises
        ------
        DataError
            The shapes disagree, or at a sample the healthy axes do not span space.
        """
        from strapdown._kernels import voting as kernel

        h = np.asarray(self.directions)
        z = np.ascontiguousarray(readings, dtype=np.float64)
        aside = np.zeros((len(z), 3)) if other is None else np.nan_to_num(np.array(other, float))
        if z.ndim != 2 or z.shape[1] != len(h) or aside.shape != (len(z), 3):
            raise DataError(
                "sensors.readings-shape-other-triad",
                quantity="readings",
                shape=z.shape,
                shape_2=aside.shape,
                count=len(h),
            )
        arrays = tuple(a.copy() for a in state.arrays)
        fused, used = np.empty((len(z), 3)), np.zeros((len(z), len(h)), dtype=bool)
        limits = self._limits()
        windows = np.asarray(self.rule.windows)
        groups = np.asarray(self.groups)
        arguments: tuple[Any, ...] = (
            z,
            np.ascontiguousarray(aside),
            h,
            groups,
            self.weights,
            self._facts(),
            limits,
            1.0 / self.rate,
            -np.expm1(-1.0 / (windows * self.rate)),
            np.maximum(np.ceil(self.rule.persist * windows * self.rate), 1.0).astype(np.int64),
            max(math.ceil(self.rule.learn * self.rate), 1),
            self.rule.readmit * self.rate,
            math.ceil(min(self.rule.readmit, HOUR) * self.rate),
            -2.0 * math.log(self.rule.confusion),
            self.apart**2,
            *arrays,
            fused,
            used,
        )
        raw = kernel.vote(*arguments)
        if raw and int(raw[-1][1]) == kernel.TOO_FEW:
            row = int(raw[-1][0])
            raise DataError(
                "sensors.healthy-axes-left-they-do",
                row=row + 1,
                quantity="readings",
                used=int(used[row].sum()),
            )
        kinds = {kernel.EXCLUDED: "excluded", kernel.READMITTED: "readmitted"}
        events = []
        for row, kind, which, following, size, chi, limit, since in raw:
            if which <= -2.0:
                axes = tuple(np.flatnonzero(groups == -2 - int(which)).tolist())
            elif int(kind) == kernel.DISAGREE:
                axes = (int(which), int(following)) if following >= 0.0 else (int(which),)
            else:
                axes = (int(which),)
            events.append(
                AxisEvent(
                    kinds.get(int(kind), "disagree"), int(row), int(since), axes, size, chi, limit
                )
            )
        return VotingState(arrays, state.samples + len(z)), AxisVote(fused, used, tuple(events))

    def _one_second(self) -> Array:
        e = self.errors
        return np.asarray(e.noise_density**2 + e.bias**2 + e.drift**2 + e.quantization**2 / 12.0)

    def _limits(self) -> Array:
        """Chi-square limits by degrees of freedom, (m + 1,), for all samples of an hour."""
        m = len(np.asarray(self.directions))
        tests = HOUR * self.rate * len(self.rule.windows) * TRIADS
        chance = self.rule.false_alarm / tests
        return np.array([0.0] + [chi_square_exceeded(chance, k) for k in range(1, m + 1)])

    def _facts(self) -> Array:
        e = self.errors
        first = [e.noise_density**2, e.bias**2, e.drift**2, e.correlation_time]
        by_input = [e.scale**2, e.misalignment**2, e.g_sensitivity**2]
        return np.ascontiguousarray([*first, *by_input, e.quantization**2 / 12.0])


@dataclass(frozen=True, eq=False)
class VotedImu:
    """Fused measurements of the healthy channels of all units.

    Attributes
    ----------
    imu : DataFrame
        Imu table in body axes.
    used : DataFrame of bool
        One row per sample, one column per channel (``A.gyro_x``).
    events : tuple of VoteEvent
    noise_density : DataFrame
        Of the fused channels at each sample, in u/√Hz; it increases where a channel is excluded.
    """

    imu: pd.DataFrame
    used: pd.DataFrame
    events: tuple[VoteEvent, ...]
    noise_density: pd.DataFrame

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per event."""
        return tuple(e.finding for e in self.events)


@dataclass(frozen=True, eq=False)
class UnitVotingState:
    """State of a vote of units."""

    gyro: VotingState
    accel: VotingState
    last: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class UnitVoting:
    """Voting over several units.

    Attributes
    ----------
    units : sequence of MountedUnit
        Two units detect a disagreement; three identify the failed channel or unit.
    rate : float, Hz
    rule : VotingRule

    Raises
    ------
    ConfigError
        Fewer than two units are given, or two have the same name.

    Notes
    -----
    Gyros and accelerometers are voted on separately (`AxisVoting`). Where axes of units are
    parallel and only two measure along a direction, a disagreement along it is reported without
    identifying the faulty one, and both remain in use. Units skewed relative to each other allow
    identification with fewer axes. Lever arms are not corrected: accelerometers a distance r apart
    differ by up to ``r (ω² + |dω/dt|)``, of which `VotingRule.apart` allows for the ω² part. Where
    that exceeds their uncertainty, move the readings to one point first (`sensors.lever_arm`).
    """

    units: Sequence[MountedUnit]
    rate: float
    rule: VotingRule = field(default_factory=VotingRule)
    gyro: AxisVoting = field(init=False)
    accel: AxisVoting = field(init=False)

    def __post_init__(self) -> None:
        names = [u.name for u in self.units]
        if len(names) < 2 or len(set(names)) < len(names):
            raise ConfigError(
                "sensors.units-cannot-test-each-other", quantity="units", map=map(repr, names)
            )
        directions = np.vstack([np.asarray(u.mounting).T for u in self.units])
        groups = np.repeat(np.arange(len(names)), 3)
        of_unit = [u.uncertainty for u in self.units]
        gyro = [(u.gyro, u.gyro_drift, k) for u in of_unit for k in range(3)]
        accel = [(u.accel, u.accel_drift, k) for u in of_unit for k in range(3)]
        for name, parts, apart in (("gyro", gyro, 0.0), ("accel", accel, self.rule.apart)):
            errors = AxisErrors.of(parts)
            voting = AxisVoting(directions, errors, self.rate, self.rule, groups.tolist(), apart)
            object.__setattr__(self, name, voting)

    def begin(self) -> UnitVotingState:
        """Return the state before the first sample."""
        return UnitVotingState(self.gyro.begin(), self.accel.begin())

    def advance(
        self, state: UnitVotingState, tables: Mapping[str, pd.DataFrame]
    ) -> tuple[UnitVotingState, VotedImu]:
        """Vote over a chunk; the results do not depend on how the log is divided.

        Parameters
        ----------
        state : UnitVotingState
        tables : mapping of str to DataFrame
            Imu tables by unit name, in the unit's own axes, with the same stamps; NaN values are
            ignored.

        Raises
        ------
        DataError
            A table or a column is missing, stamps differ or do not increase, or too few channels
            are healthy.
        """
        time, gyro, accel, sampling = self._readings(state, tables)
        turned = np.stack(
            [
                accel[:, 3 * k : 3 * k + 3] @ np.asarray(u.mounting).T
                for k, u in enumerate(self.units)
            ]
        )
        # The median, so that a failed unit does not loosen the test of the gyros; zero where no
        # unit has a reading.
        force = np.nan_to_num(known_median(turned, 0))
        gyro_state, rates = self.gyro.advance(state.gyro, gyro, force)
        accel_state, forces = self.accel.advance(state.accel, accel, rates.values)
        names = [u.name for u in self.units]
        # Not `imu_table`: a chunk may be one sample, and the values are finite.
        imu = pd.DataFrame(
            np.hstack([rates.values, forces.values]),
            index=pd.Index(time, name="time"),
            columns=[*GYRO, *ACCEL],
        )
        imu.attrs = {
            "sampling": sampling,
            "source": f"the vote of {', '.join(names)}",
            "axes": "forward-right-down",
        }
        columns = (
            [f"{n}.{c}" for n in names for c in GYRO],
            [f"{n}.{c}" for n in names for c in ACCEL],
        )
        used = pd.DataFrame(
            np.hstack([rates.used, forces.used]), index=imu.index, columns=columns[0] + columns[1]
        )
        noise = np.hstack(
            [fused_noise(self.gyro, rates.used), fused_noise(self.accel, forces.used)]
        )
        events = [
            _event(e, time, names_of, unit, before)
            for vote, names_of, unit, before in (
                (rates, columns[0], "rad/s", state.gyro.samples),
                (forces, columns[1], "m/s²", state.accel.samples),
            )
            for e in vote.events
        ]
        return UnitVotingState(gyro_state, accel_state, (float(time[-1]),)), VotedImu(
            imu,
            used,
            tuple(sorted(events, key=lambda e: (e.time, e.channels))),
            pd.DataFrame(noise, index=imu.index, columns=[*GYRO, *ACCEL]),
        )

    def uncertainty(self) -> ImuUncertainty:
        """Uncertainty of the fused table while all channels are healthy.

        Returns
        -------
        ImuUncertainty
            Noise, bias, drift, and scale factor and misalignment of the mean of independent units.
            Range, quantization and bandwidth are not defined for a mean and are omitted.
        """
        return ImuUncertainty(
            fused_uncertainty(self.gyro),
            fused_uncertainty(self.accel),
            fused_drift(self.gyro),
            fused_drift(self.accel),
        )

    def _readings(
        self, state: UnitVotingState, tables: Mapping[str, pd.DataFrame]
    ) -> tuple[Array, Array, Array, str]:
        time = None
        samplings = set()
        gyro, accel = [], []
        for unit in self.units:
            if unit.name not in tables:
                raise DataError("sensors.no-table-unit", quantity="tables", name=unit.name)
            table = tables[unit.name]
            source = source_of(table) or unit.name
            check_columns(table, [*GYRO, *ACCEL], source)
            own = index_of(table)
            check_time(own, source)
            if time is None:
                time = own
                if state.last and not own[0] > state.last[0]:
                    raise DataError(
                        "sensors.begins-last-segment-ended",
                        file=source,
                        row=1,
                        quantity="time",
                        own=own[0],
                        last=state.last[0],
                    )
            if own.size != time.size or np.abs(own - time).max() > SAME_STAMP / self.rate:
                raise DataError(
                    "sensors.unit-stamps-differ",
                    file=source,
                    quantity="time",
                    size=own.size,
                    size_2=time.size,
                    name=self.units[0].name,
                )
            samplings.add(str(table.attrs.get("sampling", "instantaneous")))
            gyro.append(values_of(table, GYRO))
            accel.append(values_of(table, ACCEL))
        if len(samplings) > 1:
            raise DataError("sensors.some-units-give-instantaneous-values", quantity="sampling")
        assert time is not None  # at least two units
        return time, np.hstack(gyro), np.hstack(accel), samplings.pop()


def vote_units(
    units: Sequence[MountedUnit], tables: Mapping[str, pd.DataFrame], rule: VotingRule | None = None
) -> VotedImu:
    """Vote over a whole log.

    Parameters
    ----------
    units : sequence of MountedUnit
    tables : mapping of str to DataFrame
        As in `UnitVoting.advance`; the rate is the mean rate of the first.
    rule : VotingRule, optional

    Raises
    ------
    ConfigError, DataError
        As `UnitVoting`.
    """
    first = tables.get(units[0].name) if units else None
    if first is None or len(first) < 2:
        raise DataError("sensors.no-table-two-samples-or", quantity="tables")
    time = index_of(first)
    rate = float((time.size - 1) / (time[-1] - time[0]))
    voting = UnitVoting(units, rate, VotingRule() if rule is None else rule)
    return voting.advance(voting.begin(), tables)[1]


# One of several inertial units on a body: its errors and its orientation.

# Tolerance for a mounting matrix to be a rotation.
ROTATION = 1e-6


@dataclass(frozen=True, eq=False)
class MountedUnit:
    """A unit's stated errors and mounting.

    Attributes
    ----------
    name : str
    uncertainty : ImuUncertainty
        Noise, bias, scale factor and so on, in its own axes; the misalignment includes that of its
        mounting.
    mounting : array_like, (3, 3)
        ``C``, which rotates a vector v from the unit's axes to body axes, ``C v``.

    Raises
    ------
    ConfigError
        The mounting is not a rotation.
    """

    name: str
    uncertainty: ImuUncertainty
    mounting: ArrayLike = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        c = np.asarray(self.mounting, dtype=np.float64)
        good = c.shape == (3, 3) and np.isfinite(c).all()
        if not good or np.abs(c @ c.T - np.eye(3)).max() > ROTATION or np.linalg.det(c) < 0.0:
            raise ConfigError("sensors.mounting-no-rotation", file=self.name, quantity="mounting")
        object.__setattr__(self, "mounting", c)


# Events of a vote of units, with their findings.


@dataclass(frozen=True)
class VoteEvent:
    """A decision of the vote.

    `kind` ({'excluded', 'readmitted', 'disagree'}). `channels`: such as ``A.gyro_x``; for a
    disagreement, the most likely ones. `time`, `since` (s): time of the decision, and start of the
    disagreement. `size` (rad/s or m/s²): deviation of the first channel from the others.
    """

    kind: str
    channels: tuple[str, ...]
    time: float
    since: float
    size: float
    chi_square: float
    limit: float
    finding: Finding


def _event(
    event: AxisEvent, time: Array, columns: Sequence[str], unit: str, before: int
) -> VoteEvent:
    """Convert an event of a vote to a finding; `before` samples preceded the chunk."""
    channels = tuple(columns[k] for k in event.axes)
    when = float(time[event.row])
    step = float(time[1] - time[0]) if time.size > 1 else 0.0
    since = float(time[event.since]) if event.since >= 0 else float(time[0] + event.since * step)
    if event.kind == "excluded" and len(channels) > 1:
        code = "sensors.unit-excluded"
    else:
        plural = "s" if event.kind == "disagree" else ""
        code = f"sensors.channel{plural}-{event.kind}"
    finding = Finding(
        code,
        row=before + event.row + 1,
        quantity=channels[0],
        channels=[_words(c) for c in channels],
        name=channels[0].split(".")[0],
        time=when,
        since=since,
        size=abs(event.size),
        unit=unit,
        chi_square=event.chi_square,
        limit=event.limit,
    )
    return VoteEvent(
        event.kind, channels, when, since, event.size, event.chi_square, event.limit, finding
    )


def _words(channel: str) -> str:
    name, column = channel.rsplit(".", 1)
    return f"{WORDS[column]} of unit {name}"


# Uncertainty of the vector fused from redundant axes.


def fused_noise(voting: AxisVoting, used: Flags) -> Array:
    """Noise density of the fused vector at each sample.

    `used` ((n, m)): axes included in the vector. Returns (n, 3), u/√Hz.
    """
    out = np.empty((len(used), 3))
    code = used @ (2 ** np.arange(used.shape[1], dtype=np.int64))
    for value in np.unique(code):
        at = code == value
        mask = used[int(np.argmax(at))]
        covariance = voting.covariance(mask, voting.errors.noise_density**2)
        out[at] = np.sqrt(np.diagonal(covariance))
    return out


def fused_uncertainty(voting: AxisVoting) -> TriadUncertainty:
    """Noise, bias, scale, misalignment and g-sensitivity of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    parts: dict[str, Any] = {}
    for name in ("noise_density", "bias", "scale", "misalignment", "g_sensitivity"):
        variance = np.asarray(getattr(e, name)) ** 2
        x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, variance))).tolist()
        parts[name] = (x, y, z)
    return TriadUncertainty(**parts)


def fused_drift(voting: AxisVoting) -> BiasDrift:
    """Drift of the bias of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, e.drift**2))).tolist()
    # The shortest time, which allows for the slower drifts too early.
    return BiasDrift((x, y, z), float(e.correlation_time.min()))
