"""Interface of every mechanization: state, propagation, and trajectory output."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels.earth import RATE
from strapdown._kernels.level import LEVEL
from strapdown._kernels.ned import (
    ALT,
    LAT,
    LON,
    ROW,
    Q,
    V,
    reverse_increments,
)
from strapdown._kernels.ned_level import ned_correct, ned_correct_rows, ned_levels
from strapdown._kernels.trajectory import trajectory_rows
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, Finding
from strapdown.mechanization.reference_heights import HEIGHTS, reference_heights
from strapdown.mechanization.refusal import refuse_start, refuse_step
from strapdown.nav_state import NavState
from strapdown.tables import MOTION, TRAJECTORY, check_trajectory
from strapdown.tables.checks import is_number, values_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mechanization(ABC):
    """A method to navigate by motion increments, with its options; stateless.

    Attributes
    ----------
    ellipsoid : str
        One of `ellipsoids.ELLIPSOIDS`; also of the input and output positions.
    height : {'free', 'held', 'damped'}
        The height follows from the sensors, whose errors it multiplies by e every 570 s; or is
        kept where it is, and the vertical velocity at zero; or a loop of the third order draws
        it to the reference heights that `advance` is given.
    height_time_constant : float, s
        Of each of the three poles of that loop, 1 to 1000, however often references come.
    latitude_limit_deg : float, deg
        North is not used beyond it: a run stops. A wander azimuth has no such limit.
    largest_speed : float, m/s
        Above it the state is taken to have diverged.
    height_limits : tuple of float, m
        A run stops outside of them, too.

    Raises
    ------
    ConfigError
        An option is unknown or outside its range.
    """

    ellipsoid: str = "wgs84"
    height: str = "free"
    height_time_constant: float = 50.0
    latitude_limit_deg: float = 89.9
    largest_speed: float = 10_000.0
    height_limits: tuple[float, float] = (-15_000.0, 1_000_000.0)

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    #: Numbers in a row of its history.
    row: ClassVar[int] = ROW
    #: Third component of up in its level axes: -1 for north-east-down.
    level_up: ClassVar[float] = -1.0
    #: Indices of the height and of the velocity in a state and in a row.
    alt_at: ClassVar[int] = ALT
    v_at: ClassVar[int] = V

    def __post_init__(self) -> None:
        find_ellipsoid(self.ellipsoid)
        if self.height not in HEIGHTS:
            raise ConfigError(
                "mechanization.nothing-height-can",
                quantity="height",
                height=self.height,
                word=str(self.height),
                known=HEIGHTS,
            )
        for name, low, high in (
            ("height_time_constant", 1.0, 1000.0),
            ("latitude_limit_deg", 0.0, 89.999),
            ("largest_speed", 1.0, 30_000.0),
        ):
            value = getattr(self, name)
            if not is_number(value) or not low <= value <= high:
                raise ConfigError(
                    "mechanization.outside", quantity=name, value=value, low=low, high=high
                )
        limits = self.height_limits
        if (
            not isinstance(limits, tuple | list)
            or len(limits) != 2
            or not all(is_number(x) for x in limits)
            or not limits[0] < limits[1]
        ):
            raise ConfigError(
                "mechanization.no-two-heights", quantity="height_limits", limits=limits
            )

    @abstractmethod
    def begin(self, start: NavState) -> Array:
        """Return the state of the kernel at a start."""

    @abstractmethod
    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why it stopped."""

    def sample_kernel(self) -> Callable[..., int] | None:
        """Return the compiled function for one sample, if any."""
        return None

    def levels(self, history: Array) -> Array:
        """Return the quantities that a filter needs of each row of a history.

        Parameters
        ----------
        history : ndarray, (n, `row`)

        Returns
        -------
        ndarray, (n, 14)
            In level axes l: quaternion body to level, velocity, unit vector of the Earth's axis,
            height, rate of the level relative to the Earth (`_kernels.level`).
        """
        out = np.empty((len(history), LEVEL))
        ned_levels(history, find_ellipsoid(self.ellipsoid).parameters(), out)
        return out

    def history_row(self, state: Array) -> Array:
        """Return a state as a row of a history, (`row`,)."""
        return state[: self.row].copy()

    def level_from_ned(self, row: Array) -> Array:
        """Return the matrix from north-east-down to level axes, (3, 3).

        Parameters
        ----------
        row : ndarray, (`row`,)
            Of a history.
        """
        return np.eye(3)

    def correct(self, state: Array, error: ArrayLike) -> Array:
        """Subtract an error from a state.

        Parameters
        ----------
        state : ndarray
            It is not changed.
        error : array_like, (9,)
            State − truth, in level axes of the state: displacement in m, difference of the
            velocities as vectors in m/s, and the rotation vector in rad of the attitude relative
            to the Earth, ``C_state = exp([psi x]) C_true``.

        Returns
        -------
        ndarray
        """
        after = state.copy()
        earth = find_ellipsoid(self.ellipsoid).parameters()
        ned_correct(after, np.asarray(error, dtype=np.float64), earth)
        return after

    def corrected_history(self, history: Array, errors: Array) -> Array:
        """Subtract an error from each row of a history.

        Parameters
        ----------
        history : ndarray, (n, `row`)
            It is not changed.
        errors : ndarray, (n, 9)
            As `correct`, in level axes of each row.

        Returns
        -------
        ndarray, (n, `row`)
        """
        after = np.array(history)
        ned_correct_rows(after, errors, find_ellipsoid(self.ellipsoid).parameters())
        return after

    def nav_state(self, state: Array, time: float) -> NavState:
        """Return the position, velocity and attitude of a state.

        Parameters
        ----------
        state : ndarray
        time : float, s

        Returns
        -------
        NavState
        """
        return NavState(
            time=time,
            lat=float(state[LAT]),
            lon=math.remainder(float(state[LON]), 2.0 * math.pi),
            alt=float(state[ALT]),
            v_n=state[V : V + 3],
            q_nb=state[Q : Q + 4],
        )

    def kernel_options(self) -> Array:
        """Options and limits for the kernels."""
        earth = find_ellipsoid(self.ellipsoid)
        return np.array(
            [
                float(HEIGHTS.index(self.height)),
                self.height_time_constant,
                2.0 * earth.gravity_at_equator / earth.semi_major_axis,
                np.cos(np.radians(self.latitude_limit_deg)),
                self.largest_speed,
                *self.height_limits,
            ]
        )

    def advance(
        self,
        state: Array,
        increments: pd.DataFrame,
        heights: ArrayLike | None = None,
        *,
        backward: bool = False,
    ) -> tuple[Array, Array]:
        """Advance over a segment of motion increments.

        Parameters
        ----------
        state : ndarray
            From `begin`, or from an earlier segment; it is not changed.
        increments : DataFrame
            A MotionIncrements table of any length, one row included.
        heights : array_like, (n,), m, optional
            Reference heights at the ends of the steps (backward: at their starts), for a damped
            height; NaN for a missing one.
        backward : bool
            Go from the end of the increments to their start.

        Returns
        -------
        state : ndarray
            After the last step.
        history : ndarray, (n, `row`)
            After each step; backward the first row is the start of the first step. Of
            north-east-down: latitude and longitude in rad, height in m, velocity north, east,
            down in m/s, and ``q_nb``.

        Raises
        ------
        DivergenceError
            The state has left the validity of this mechanization, or is too near a pole; the first
            such step is named.
        DataError
            `heights` is missing where the height is damped, given where it is not, infinite, or
            of another length.
        """
        rows = values_of(increments, MOTION)
        history = np.empty((len(rows), self.row))
        after = state.copy()
        self.advance_into(after, rows, increments, heights, history, backward=backward)
        return after, history

    def advance_into(
        self,
        state: Array,
        rows: Array,
        increments: pd.DataFrame,
        heights: ArrayLike | None,
        history: Array,
        *,
        backward: bool,
    ) -> None:
        """As `advance`, in place; `rows` are those of `increments`."""
        reference = reference_heights(self.height, heights, len(rows))
        velocity = slice(self.v_at, self.v_at + 3)
        earth = find_ellipsoid(self.ellipsoid).parameters()
        if backward:
            # Backward, the motion is one with opposite velocity on an Earth that rotates the other
            # way.
            forward, rows = rows, np.empty_like(rows)
            reverse_increments(forward, rows)
            reference = reference[::-1].copy()
            earth[RATE] *= -1.0
            state[velocity] *= -1.0
        made, why = self.advance_rows(state, rows, reference, earth, history)
        if why:
            at = len(rows) - 1 - made if backward else made
            if not made:
                refuse_start(
                    float(state[self.alt_at]),
                    self._speed(state),
                    self.height_limits,
                    self.largest_speed,
                    increments.attrs.get("source"),
                )
            before = self._state_before(history[made - 1]) if made else None
            refuse_step(why, at, increments, before, self.latitude_limit_deg)
        if backward:
            state[velocity] *= -1.0
            history[:] = history[::-1].copy()
            history[:, velocity] *= -1.0

    def trajectory(
        self, time: ArrayLike, history: Array, source: str | None = None
    ) -> pd.DataFrame:
        """Return a history as a Trajectory table.

        Parameters
        ----------
        time : array_like, (n,), s
        history : ndarray, (n, `row`)
        source : str, optional
            Name for messages.

        Returns
        -------
        DataFrame
        """
        rows = np.empty((len(history), len(TRAJECTORY)))
        self.fill_trajectory(history, rows)
        table = pd.DataFrame(
            rows, index=pd.Index(np.asarray(time), name="time"), columns=TRAJECTORY, copy=False
        )
        table.attrs["source"] = source
        check_trajectory(table)
        return table

    def fill_trajectory(self, history: Array, out: Array) -> None:
        """Fill rows of a Trajectory table from rows of a history."""
        trajectory_rows(history, out)

    def latitude(self, row: Array) -> float:
        """Return the geodetic latitude of a row of a history, rad."""
        return float(row[LAT])

    def remarks(self, time: Array, history: Array) -> tuple[Finding, ...]:
        """Return findings about the states of a run."""
        return ()

    def _speed(self, row: Array) -> float:
        return float(np.linalg.norm(row[self.v_at : self.v_at + 3]))

    def _state_before(self, row: Array) -> Finding:
        return Finding(
            "mechanization.state-before-step",
            severity="note",
            lat_deg=np.degrees(self.latitude(row)),
            alt=row[self.alt_at],
            speed=self._speed(row),
        )
