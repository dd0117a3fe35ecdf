"""Interface of every mechanization: state, propagation, and trajectory output."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown._kernels import earth as kernel
from strapdown._kernels.earth import RATE
from strapdown._kernels.level import LEVEL, ned_correct, ned_correct_rows, ned_levels
from strapdown._kernels.level import state_error as kernel_of_error
from strapdown._kernels.ned import (
    ALT,
    LARGEST_TURN,
    LAT,
    LEAP,
    POLE,
    ROW,
    V,
    reverse_increments,
    trajectory_rows,
)
from strapdown.constants import Array
from strapdown.ellipsoids import WGS84, Ellipsoid, find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding, check_choice
from strapdown.nav_state import NavState
from strapdown.tables import MOTION, TRAJECTORY, check_trajectory
from strapdown.tables.checks import is_number, values_of


@dataclass(frozen=True)
class Mechanization(ABC):
    """A method to navigate by motion increments, with its options; stateless.

    `ellipsoid`: one of `ellipsoids.ELLIPSOIDS`; also of the input and output positions. `height`
    ({'free', 'held', 'damped'}): the height follows from the sensors, whose errors it multiplies by
    e every 570 s; or is kept where it is, and the vertical velocity at zero; or a loop of the third
    order draws it to the reference heights that `advance` is given. `height_time_constant` (s): of
    each of the three poles of that loop, 1 to 1000, however often references come.
    `latitude_limit_deg` (deg): North is not used beyond it: a run stops. A wander azimuth has no
    such limit. `largest_speed` (m/s): above it the state is taken to have diverged. `height_limits`
    (m): outside these limits a run stops, too. ConfigError: an option is unknown or outside its
    range.
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
        check_choice(
            "mechanization.nothing-height-can", HEIGHTS, quantity="height", height=self.height
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

        `history` ((n, `row`)). Returns (n, 14), in level axes l: quaternion body to level,
        velocity, unit vector of the Earth's axis, height, rate of the level relative to the Earth
        (`_kernels.level`).
        """
        out = np.empty((len(history), LEVEL))
        ned_levels(history, find_ellipsoid(self.ellipsoid).parameters(), out)
        return out

    def history_row(self, state: Array) -> Array:
        """Return a state as a row of a history, (`row`,)."""
        return state[: self.row].copy()

    def level_from_ned(self, row: Array) -> Array:
        """Return the matrix from north-east-down to level axes, (3, 3).

        `row` ((`row`,)): of a history.
        """
        return np.eye(3)

    def correct(self, state: Array, error: ArrayLike) -> Array:
        """Subtract an error from a state.

        `state`: it is not changed. `error` ((9,)): state − truth, in level axes of the state:
        displacement in m, difference of the velocities as vectors in m/s, and the rotation vector
        in rad of the attitude relative to the Earth, ``C_state = exp([psi x]) C_true``.
        """
        after = state.copy()
        earth = find_ellipsoid(self.ellipsoid).parameters()
        ned_correct(after, np.asarray(error, dtype=np.float64), earth)
        return after

    def corrected_history(self, history: Array, errors: Array) -> Array:
        """Subtract an error from each row of a history; (n, `row`).

        `history` ((n, `row`)): it is not changed. `errors` ((n, 9)): as `correct`, in level axes of
        each row.
        """
        after = np.array(history)
        ned_correct_rows(after, errors, find_ellipsoid(self.ellipsoid).parameters())
        return after

    def nav_state(self, state: Array, time: float) -> NavState:
        """Return the position, velocity and attitude of a state.

        `time` (s).
        """
        return NavState.of_numbers(time, state)

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

        `state`: from `begin`, or from an earlier segment; it is not changed. `increments`: a
        MotionIncrements table of any length, one row included. `heights` ((n,), m): reference
        heights at the ends of the steps (backward: at their starts), for a damped height; NaN for a
        missing one. `backward`: go from the end of the increments to their start. Returns `state`:
        after the last step; `history` ((n, `row`)): after each step; backward the first row is the
        start of the first step. Of north-east-down: latitude and longitude in rad, height in m,
        velocity north, east, down in m/s, and ``q_nb``. DivergenceError: the state has left the
        validity of this mechanization, or is too near a pole; the first such step is named.
        DataError: `heights` is missing where the height is damped, given where it is not, infinite,
        or of another length.
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
            self._refuse(why, at, increments, state, history[made - 1] if made else None)
        if backward:
            state[velocity] *= -1.0
            history[:] = history[::-1].copy()
            history[:, velocity] *= -1.0

    def trajectory(
        self, time: ArrayLike, history: Array, source: str | None = None
    ) -> pd.DataFrame:
        """Return a history as a Trajectory table.

        `time` ((n,), s). `history` ((n, `row`)).
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

    def _refuse(
        self, why: int, step: int, increments: pd.DataFrame, state: Array, last: Array | None
    ) -> NoReturn:
        """Raise the error of a step (from 0) that a kernel refused.

        `why`: code by the kernel's `verdict`. `state`: at the start. `last`: the row before the
        step; None at the first step.
        """
        source = increments.attrs.get("source")
        if last is None:
            alt, speed = float(state[self.alt_at]), self._speed(state)
            lowest, highest = self.height_limits
            if speed > self.largest_speed or not lowest <= alt <= highest:
                raise DivergenceError(
                    "mechanization.state-begin-high-outside-or",
                    file=source,
                    quantity="state",
                    alt=alt,
                    speed=speed,
                    lowest=lowest,
                    highest=highest,
                    largest_speed=self.largest_speed,
                )
            before = None
        else:
            before = Finding(
                "mechanization.state-before-step",
                severity="note",
                lat_deg=np.degrees(self.latitude(last)),
                alt=last[self.alt_at],
                speed=self._speed(last),
            )
        row = increments.iloc[step]
        first = "first-" if last is None else ""
        data: dict[str, Any]
        if why == POLE:
            code, quantity = f"mechanization.{first}step-near-pole", "lat"
            data = {"latitude_limit_deg": self.latitude_limit_deg}
        elif why == LEAP:
            code, quantity = f"mechanization.{first}step-too-far", "state"
            data = {"at_row": row["dt"], "largest_turn": LARGEST_TURN}
        else:
            code, quantity = f"mechanization.{first}step-diverges", "state"
            data = {"increments": [f"{name} {row[name]:.4g}" for name in MOTION]}
        data |= {"time": float(increments.index[step]), "step": step + 1, "before": before}
        raise DivergenceError(code, file=source, quantity=quantity, data=data)


#: Height options: free (by the sensors), held, damped by a reference.
HEIGHTS = ("free", "held", "damped")


def reference_heights(height: str, heights: ArrayLike | None, steps: int) -> Array:
    """Return the reference heights of a segment as a kernel takes them.

    `height` ({'free', 'held', 'damped'}): height option. `heights` ((n,), m, or None): NaN for
    missing ones. `steps`: steps of the segment. Returns (n,), or (0,) where the height is not
    damped. DataError: they are missing where the height is damped, given where it is not, infinite,
    or of another length.
    """
    if height != "damped":
        if heights is None:
            return np.empty(0)
        raise DataError("mechanization.heights-damp-height", quantity="heights", height=height)
    if heights is None:
        raise DataError("mechanization.height-damped-no-reference", quantity="heights")
    try:
        reference = np.ascontiguousarray(heights, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError("mechanization.these-no-numbers", quantity="heights") from None
    if reference.shape != (steps,):
        raise DataError(
            "mechanization.shape-steps", quantity="heights", shape=reference.shape, steps=steps
        )
    if np.isinf(reference).any():
        raise DataError(
            "mechanization.infinite",
            row=int(np.argmax(np.isinf(reference))) + 1,
            quantity="heights",
        )
    return reference


def state_error(state: NavState, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the error of a state, as defined in the filters.

    Parameters
    ----------
    state, truth : NavState
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (9,)
        State − truth, in north-east-down of `state`: displacement in m (to 1e-9 m), difference
        of the velocities as vectors in m/s, and the rotation vector in rad of the attitude relative
        to the Earth, ``C_state = exp([psi x]) C_true``. `Mechanization.correct` subtracts it.
    """
    error = np.empty(9)
    kernel_of_error(state.numbers, truth.numbers, ellipsoid.parameters(), error)
    return error


def displacement_between(state: NavState, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the first three numbers of `state_error`, (3,), m."""
    return np.array(
        kernel.displacement(
            state.lat,
            state.lon,
            state.alt,
            truth.lat,
            truth.lon,
            truth.alt,
            ellipsoid.semi_major_axis,
            ellipsoid.eccentricity_squared,
        )
    )
