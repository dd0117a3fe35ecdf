"""Interface of every attitude algorithm, and its run over a record or sample by sample."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, NoReturn

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import increments as increment_kernel
from strapdown._kernels import rotation as kernel
from strapdown._kernels.compilation import ARGUMENT_ERRORS
from strapdown._kernels.increments import HEAD, LARGEST, MEAN, OPTIONS, SAMPLES, TIME
from strapdown.constants import Array
from strapdown.errors import DataError, DivergenceError
from strapdown.tables import DTHETA, THETA, attitude_table, check_sampling_kind
from strapdown.tables.checks import values_of


@dataclass(frozen=True)
class Steps:
    """Increments for the kernels: (n,) s, (n, 3) rad, (n, 3) rad."""

    dt: Array
    theta: Array
    dtheta: Array


def steps_of(increments: pd.DataFrame) -> Steps:
    """Return the arrays of an Increments table, without its time stamps."""
    dt, theta, dtheta = (values_of(increments, block) for block in (["dt"], THETA, DTHETA))
    return Steps(dt[:, 0], theta, dtheta)


@dataclass(frozen=True)
class Accuracy:
    """Order of an algorithm's attitude error in the step; 0: it does not decrease.

    Attributes
    ----------
    increments : int
        On general smooth motion, from exact increments.
    rates : int
        On general smooth motion, from rates at the stamps that are interpolated by a cubic;
        by the trapezoid it is this, and at most 2.
    coning : int
        Drift on pure coning, from exact increments.
    """

    increments: int
    rates: int
    coning: int


@dataclass(frozen=True)
class AttitudeAlgorithm(ABC):
    """One attitude algorithm with its options; stateless.

    By default the state is the quaternion ``q_nb``, or, of `width` 3, roll, pitch and heading in
    rad, of any size: a pitch beyond ±90° is legal.

    Attributes
    ----------
    name : str
        The word for it on the command line.
    title : str
        The words for it in a report.
    equations : str
        Equation numbers in its source.
    source : str
        That source.
    width : int
        Number of elements of the state that are the attitude, the first ones.
    variants : tuple of str
        Names with options that ``--algorithms all`` includes; empty: the name alone.
    advance_kernel, update_kernel : callable
        The compiled loops over many steps and for one sample.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    equations: ClassVar[str]
    source: ClassVar[str] = "Alexiev (2021)"
    summary: ClassVar[str]
    width: ClassVar[int] = 4
    variants: ClassVar[tuple[str, ...]] = ()
    advance_kernel: ClassVar[Any]
    update_kernel: ClassVar[Callable[..., Any]]

    def begin(self, q_nb: Array) -> Array:
        """Return the state of an attitude given as a unit quaternion, shape (4,)."""
        if self.width == 3:
            return np.radians(rotation.euler_from_quaternion(q_nb))
        return np.array(q_nb, dtype=np.float64)

    def quaternions(self, history: Array) -> Array:
        """Return unit quaternions ``q_nb``, (n, 4), of `width` numbers a row."""
        q = np.empty((len(history), 4))
        if self.width == 3:
            kernel.quats_from_eulers(history, q)
        else:
            kernel.unit_quats(history, math.inf, q)
        return q

    @property
    @abstractmethod
    def accuracy(self) -> Accuracy:
        """Order of its error in the step."""

    def kernel_options(self) -> tuple[float, float]:
        """Return the two options for the kernels, as numbers; zero for a missing one."""
        options = [float(getattr(self, f.name)) for f in fields(self)]
        first, second, *_ = *options, 0.0, 0.0
        return first, second

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the algorithm's diagnostics after a run.

        Parameters
        ----------
        state : ndarray
            As left by `advance`.
        time : ndarray, (n+1,), s
            The start, and the end of every step since.
        """
        return {}

    def advance(self, state: Array, increments: pd.DataFrame | Steps) -> tuple[Array, Array]:
        """Advance over a segment of increments.

        Parameters
        ----------
        state : ndarray
            From `begin`, or from an earlier segment; it is not changed.
        increments : DataFrame or Steps
            An Increments table of any length, one row included, or its arrays.

        Returns
        -------
        state : ndarray
            After the last step.
        history : ndarray, (n, width)
            The attitude part of the state after each step.
        """
        steps = increments if isinstance(increments, Steps) else steps_of(increments)
        history = np.empty((len(steps.dt), self.width))
        after = state.copy()
        options = self.kernel_options()
        type(self).advance_kernel(after, steps.dt, steps.theta, steps.dtheta, history, *options)
        return after, history

    @property
    def label(self) -> str:
        """The name with every option that is not at its default."""
        changed = [
            f"{f.name}={getattr(self, f.name)}".lower()
            for f in fields(self)
            if getattr(self, f.name) != f.default
        ]
        return f"{self.name}:{','.join(changed)}" if changed else self.name


@dataclass(frozen=True)
class AttitudeRun:
    """One algorithm over one record.

    Attributes
    ----------
    algorithm : str
        Name and options, as the command line takes them.
    title, equations : str
        Display text; the equations are numbered as in the algorithm's source.
    attitude : DataFrame
        Attitude table at every sample.
    diagnostics : dict of str to float
        Condition measures of the algorithm; each key has its unit.
    """

    algorithm: str
    title: str
    equations: str
    attitude: pd.DataFrame = field(repr=False)
    diagnostics: dict[str, float]


#: Attitudes at which a run begins anew, by row: (4,), body to local level.
Restarts = Sequence[tuple[int, Array]]


def attitude_history(
    algorithm: AttitudeAlgorithm,
    increments: pd.DataFrame | Steps,
    q_nb: ArrayLike,
    restarts: Restarts = (),
) -> Array:
    """Quaternions of `run_attitude` alone, (n+1, 4): at the start and after each step."""
    steps = increments if isinstance(increments, Steps) else steps_of(increments)
    return np.vstack([q for q, _ in _pieces(algorithm, steps, q_nb, restarts)])


def pieces_of(count: int, q_nb: ArrayLike, restarts: Restarts) -> list[tuple[slice, Array]]:
    """Steps of each piece of a run of `count` steps, and the attitude that it begins with.

    The step that ends where a piece begins belongs to none.
    """
    begins = [(0, np.asarray(q_nb, dtype=np.float64)), *restarts]
    ends = [row - 1 for row, _ in restarts] + [count]
    return [(slice(row, end), q) for (row, q), end in zip(begins, ends, strict=True)]


def _pieces(
    algorithm: AttitudeAlgorithm, steps: Steps, q_nb: ArrayLike, restarts: Restarts
) -> Iterator[tuple[Array, Array]]:
    """Quaternions at the start and after each step of each piece, and the state at its end."""
    for part, start in pieces_of(len(steps.dt), q_nb, restarts):
        piece = Steps(steps.dt[part], steps.theta[part], steps.dtheta[part])
        begun = algorithm.begin(rotation.normalise(start))
        first = begun[None, : algorithm.width]
        state, history = algorithm.advance(begun, piece)
        _refuse_overflow(algorithm, history, part.start)
        yield algorithm.quaternions(np.vstack([first, history])), state


#: Samples of one step of `history_of_samples`: what they form stays in the cache.
CHUNK = 8192


def history_of_samples(
    algorithm: AttitudeAlgorithm, time: Array, rate: Array, mean: bool, q_nb: ArrayLike
) -> Array:
    """Quaternions of `attitude_history` straight from checked samples, to the last bit.

    `time` ((n,), s): increasing. `rate` ((n, 3), rad/s): linear between the stamps, or with `mean`
    over the interval that ends there. Chunk by chunk, which no algorithm notices: increments of the
    whole record and their checks would cost several times what the algorithm does.
    """
    state = algorithm.begin(rotation.normalise(q_nb))
    out = np.empty((len(time), 4))
    out[:1] = algorithm.quaternions(state[None, : algorithm.width].copy())
    theta, dtheta = np.empty((2, CHUNK, 3))
    for start in range(0, len(time) - 1, CHUNK):
        stop = min(start + CHUNK, len(time) - 1)
        dt = np.diff(time[start : stop + 1])
        steps = Steps(dt, theta[: len(dt)], dtheta[: len(dt)])
        increment_kernel.increments(dt, rate[start : stop + 1], mean, steps.theta, steps.dtheta)
        state, history = algorithm.advance(state, steps)
        _refuse_overflow(algorithm, history, start)
        out[start + 1 : stop + 1] = algorithm.quaternions(history)
    return out


def _refuse_overflow(algorithm: AttitudeAlgorithm, history: Array, before: int) -> None:
    """Refuse numbers that a truncated series let overflow; `before`: steps before these."""
    # Of NaN both comparisons are false.
    if not history.size or (history.max() < LARGEST and history.min() > -LARGEST):
        return
    bad = np.flatnonzero(~(np.abs(history) < LARGEST).all(axis=1))
    raise DivergenceError(
        "attitude.numbers-left-range-floating-point",
        row=before + int(bad[0]) + 1,
        quantity=algorithm.label,
    )


def run_attitude(
    algorithm: AttitudeAlgorithm,
    increments: pd.DataFrame,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    restarts: Restarts = (),
) -> AttitudeRun:
    """Run an attitude algorithm over a whole record.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    increments : DataFrame
        An Increments table; the run starts where its first step begins.
    q_nb : array_like, (4,)
        Attitude at the start, body to local level.
    restarts : sequence of (int, ndarray)
        Rows (from 1) at which the run begins anew with another attitude, as after a gap; the step
        that ends there is not used.

    Returns
    -------
    AttitudeRun
        Attitude at the start and at the end of each step, and the diagnostics of the
        algorithm: where the run begins anew, those of the piece nearest to the pole, or with the
        largest loss.

    Raises
    ------
    DataError
        `q_nb` is not a rotation.
    DivergenceError
        The algorithm left the range of floating point.
    """
    ends = increments.index.to_numpy(dtype=np.float64)
    time = np.concatenate([[ends[0] - increments["dt"].iloc[0]], ends])
    q, diagnostics = [], []
    first = 0
    for piece, state in _pieces(algorithm, steps_of(increments), q_nb, restarts):
        q.append(piece)
        diagnostics.append(algorithm.diagnostics(state, time[first : first + len(piece)]))
        first += len(piece)
    key = "closest_to_pole_deg"
    if key in diagnostics[0]:
        worst = min(diagnostics, key=lambda d: d[key])
    else:
        worst = max(diagnostics, key=lambda d: max((abs(v) for v in d.values()), default=0.0))
    return AttitudeRun(
        algorithm=algorithm.label,
        title=algorithm.title,
        equations=algorithm.equations,
        attitude=attitude_table(time, np.vstack(q)),
        diagnostics=worst,
    )


# Sample by sample, as on a device or live.


# Looked up once: attribute lookup is a tenth of a call of half a microsecond.
_ndarray = np.ndarray


def refuse_sample(taken: int, last: float, time: float, gyro: ArrayLike) -> NoReturn:
    """Raise DataError for a sample after `taken` others, the last at `last`, s."""
    if taken > 0 and time <= last and np.size(gyro) == 3:
        raise DataError(
            "attitude.time-does-not-advance-followed",
            row=taken + 1,
            quantity="time",
            record=last,
            time=time,
        )
    raise DataError(
        "attitude.time-rate-time-three-finite",
        row=taken + 1,
        quantity="gyro",
        time=time,
        asarray=np.asarray(gyro).tolist(),
        largest=LARGEST,
    )


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

    __slots__ = ("_algorithm", "_plain", "_record", "_update")

    def __init__(
        self,
        algorithm: AttitudeAlgorithm,
        q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        sampling: str = "instantaneous",
    ) -> None:
        check_sampling_kind(sampling)
        unit = rotation.normalise(q_nb)
        head = np.zeros(HEAD)
        head[MEAN] = float(sampling == "mean")
        options = algorithm.kernel_options()
        head[OPTIONS:] = options
        self._algorithm = algorithm
        self._record = np.concatenate([head, algorithm.begin(unit)])
        self._update = type(algorithm).update_kernel
        # Whether the state begins with the quaternion itself.
        inherited = type(algorithm).quaternions is AttitudeAlgorithm.quaternions
        self._plain = inherited and algorithm.width == 4

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
        except ARGUMENT_ERRORS:
            # Of a type that cannot be compiled for, or not numbers.
            self._refuse(float("nan"), gyro)
        self._refuse(time, gyro)

    def _refuse(self, time: float, gyro: Array | Sequence[float]) -> NoReturn:
        refuse_sample(int(self._record[SAMPLES]), float(self._record[TIME]), time, gyro)

    def _row(self) -> Array:
        native = self._record[HEAD : HEAD + self._algorithm.width]
        row: Array = self._algorithm.quaternions(native[None, :].copy())[0]
        return row

    # Compiled for one row, where arrays of one row cost more than the arithmetic.
    @property
    def quaternion(self) -> Array:
        """The attitude ``q_nb``, (4,), unit norm."""
        if not self._plain:
            return self._row()
        out = np.empty(4)
        kernel.unit_quat_of(self._record, HEAD, out)
        return out

    @property
    def roll_pitch_heading(self) -> Array:
        """The attitude as 3-2-1 angles, (3,), deg."""
        if not self._plain:
            w, x, y, z, _ = kernel.unit_quat(*self._row())
            return np.array(kernel.euler_degrees_from_quat(w, x, y, z))
        out = np.empty(3)
        kernel.unit_euler_degrees(self._record, HEAD, out)
        return out
