"""Redundant axes that measure one vector: least squares, parity tests, voting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.uncertainty import BiasDrift, TriadUncertainty
from strapdown.tables.checks import is_number

__all__ = [
    "AxisErrors",
    "AxisEvent",
    "AxisVote",
    "AxisVoting",
    "VotingRule",
    "VotingState",
    "checked_directions",
    "isolable_axes",
    "parity_matrix",
]


# Parity of redundant axes: their consistency, independent of the motion.


# Limits of the smallest over the largest singular value, and of the cosine of two parity columns.
RANK = 1e-6
PARALLEL = 1e-9


def checked_directions(directions: ArrayLike) -> Array:
    """Check and return unit vectors, one per row, that span space.

    Raises
    ------
    ConfigError
        They are not (m, 3) numbers of length one to within 1e-6, or they lie in a plane.
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

    Parameters
    ----------
    directions : array_like, (m, 3)
        H, unit vectors of the measurement axes.

    Returns
    -------
    ndarray, (m - 3, m)
        The parity vector of readings z is ``p = V z``. Errors e with covariance C give it the
        covariance ``V C Vᵀ``, and ``pᵀ (V C Vᵀ)⁻¹ p`` is chi-square with m - 3 degrees of freedom.
        Its sign and rotation are those of a singular value decomposition.

    Notes
    -----
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
        names = (
            "noise_density",
            "bias",
            "scale",
            "misalignment",
            "g_sensitivity",
            "quantization",
        )
        columns = {n: np.array([t.axis(n)[k] for t, _, k in parts]) for n in names}
        drift = np.array([d.triad[k] for _, d, k in parts])
        time = np.array([d.correlation_time for _, d, _ in parts])
        return cls(**columns, drift=drift, correlation_time=time)


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HOUR = 3600.0  # s
# Gyros and accelerometers are tested separately.
TRIADS = 2


@dataclass(frozen=True, eq=False)
class VotingState:
    """State of a vote over a log; `advance` does not change these kernel arrays."""

    arrays: tuple[NDArray[np.generic], ...]
    samples: int

    @property
    def excluded(self) -> Mask:
        """Excluded axes, (m,)."""
        return np.asarray(self.arrays[8] != 0)


@dataclass(frozen=True)
class AxisEvent:
    """A decision of the vote.

    Attributes
    ----------
    kind : {'excluded', 'readmitted', 'disagree'}
    row : int
        Sample of the chunk at which it was decided, from 0.
    since : int
        Sample from which the chi-square has exceeded its limit; negative if before the chunk.
    axes : tuple of int
        The failed axes; for a disagreement, the two most likely ones.
    size : float
        Deviation of the first axis from the others, in the unit of the readings.
    chi_square, limit : float
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

    Attributes
    ----------
    values : ndarray, (n, 3)
        Vector in body axes, from the healthy axes.
    used : ndarray of bool, (n, m)
    events : tuple of AxisEvent
    """

    values: Array
    used: Mask
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
    single axis does. Axes are taken to share their stamps and their delay.
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

    def covariance(self, used: Mask, variance: Array) -> Array:
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

        Returns
        -------
        VotingState, AxisVote

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
        from scipy.special import chdtri

        m = len(np.asarray(self.directions))
        tests = HOUR * self.rate * len(self.rule.windows) * TRIADS
        chance = self.rule.false_alarm / tests
        return np.array([0.0] + [float(chdtri(k, chance)) for k in range(1, m + 1)])

    def _facts(self) -> Array:
        e = self.errors
        return np.ascontiguousarray(
            [
                e.noise_density**2,
                e.bias**2,
                e.drift**2,
                e.correlation_time,
                e.scale**2,
                e.misalignment**2,
                e.g_sensitivity**2,
                e.quantization**2 / 12.0,
            ]
        )
