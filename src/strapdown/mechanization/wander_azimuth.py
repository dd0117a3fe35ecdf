"""Wander azimuth: level axes without rotation about the vertical, regular at the poles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import level
from strapdown._kernels import wander as kernel
from strapdown._kernels.level import LEVEL
from strapdown._kernels.sample import wander_update
from strapdown.constants import Array
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, Finding
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState

# Nearer to a pole than this, m, a meter is more than 0.06 deg of heading.
NEAR = 1000.0


@dataclass(frozen=True)
class WanderAzimuth(Mechanization):
    """Navigation in a wander azimuth, everywhere on the ellipsoid, poles included.

    Chernodarov (2009), Eqs. (1), (2), (4): a quaternion of the body in inertial axes, one of the
    level axes in the Earth's, and the velocity. Level axes are xi, eta, zeta with zeta up; xi is
    turned anticlockwise from east by the wander angle A, which is zero at the start and then
    keeps the rate of the axes about zeta, relative to the Earth, at zero:
    ``V_E = V_xi cos A - V_eta sin A``, ``V_N = V_xi sin A + V_eta cos A`` (in print a minus).
    Gravity is normal gravity, which is the paper's gravitation and centrifugal term together.

    The error of a run is of the fourth order of the step (`_kernels.wander`), at a pole as
    elsewhere. The output is north-east-down: within a distance d of a pole a displacement of x
    across rotates north, and with it longitude, heading and the components of the velocity, by
    x / d; 1 cm, ten meters from the pole, by 0.06 deg. Ground track and attitude relative to the
    Earth (`WanderAzimuth.earth_attitude`) are as accurate there as anywhere. At a pole, to
    rounding, A is set to zero, and longitude gives the direction of xi and eta.

    Attributes
    ----------
    ellipsoid, height, height_time_constant, largest_speed, height_limits
        As `Mechanization`.
    latitude_limit_deg : float, deg
        Not applicable: any value other than the default is refused.
    """

    name: ClassVar[str] = "wander_azimuth"
    summary: ClassVar[str] = "wander azimuth, zeta up, across poles too"
    source: ClassVar[str] = "Chernodarov (2009)"
    row: ClassVar[int] = kernel.ROW
    level_up: ClassVar[float] = 1.0
    alt_at: ClassVar[int] = kernel.ALT
    v_at: ClassVar[int] = kernel.V

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.latitude_limit_deg != Mechanization.latitude_limit_deg:
            raise ConfigError(
                "mechanization.limit-axes-none",
                quantity="latitude_limit_deg",
                latitude_limit_deg=self.latitude_limit_deg,
            )

    def begin(self, start: NavState) -> Array:
        """Return the state of the kernel at a start, with a wander angle of zero.

        `start`: at a pole its longitude gives the direction of north. Returns (31,), the row of a
        history, (12,): ``q_ew`` from level to ECEF axes, height in m, velocity xi, eta, zeta in
        m/s, ``q_wb`` from body to level. Then ``q_ib`` from body to inertial axes, those of ECEF at
        the start, and the memory of the kernel.
        """
        state = np.zeros(kernel.STATE)
        state[kernel.Q_EW : kernel.ALT] = level.wander_from_geodetic(start.lat, start.lon, 0.0)
        state[kernel.ALT] = start.alt
        north, east, down = start.v_n
        if self.height == "held":
            down = 0.0
        state[kernel.V : kernel.ROW] = level.level_from_north(
            0.0, north, east, down, *(float(x) for x in start.q_nb)
        )
        state[kernel.Q_IB : kernel.LOW_EW] = rotation.compose(
            state[kernel.Q_EW : kernel.ALT], state[kernel.Q_WB : kernel.ROW]
        )
        state[kernel.SPIN] = 1.0
        squared = find_ellipsoid(self.ellipsoid).eccentricity_squared
        state[kernel.PRIME] = 1.0 / math.sqrt(1.0 - squared * math.sin(start.lat) ** 2)
        return state

    def advance_rows(
        self, state: Array, increments: Array, heights: Array, earth: Array, history: Array
    ) -> tuple[int, int]:
        """Advance `state` over rows of increments; return the steps made, and why it stopped."""
        options = self.kernel_options()
        made, why = kernel.wander_advance(state, increments, heights, earth, options, history)
        return made, why

    def sample_kernel(self) -> Callable[..., int]:
        """Return the compiled function for one sample."""
        return wander_update

    def levels(self, history: Array) -> Array:
        """Return the quantities that a filter needs of each row, as `Mechanization.levels`."""
        out = np.empty((len(history), LEVEL))
        level.wander_levels(history, find_ellipsoid(self.ellipsoid).parameters(), out)
        return out

    def level_from_ned(self, row: Array) -> Array:
        """Return the matrix from north-east-down to xi, eta, zeta, (3, 3)."""
        angle = self.wander_angle(row[None, :])[0]
        s, c = math.sin(angle), math.cos(angle)
        return np.array([[s, c, 0.0], [c, -s, 0.0], [0.0, 0.0, -1.0]])

    def correct(self, state: Array, error: ArrayLike) -> Array:
        """Subtract an error from a state, as `Mechanization.correct`."""
        after = state.copy()
        earth = find_ellipsoid(self.ellipsoid).parameters()
        level.wander_correct(after, np.asarray(error, dtype=np.float64), earth)
        return after

    def corrected_history(self, history: Array, errors: Array) -> Array:
        """Subtract an error from each row of a history, as `Mechanization.corrected_history`."""
        after = np.array(history)
        level.wander_correct_rows(after, errors, find_ellipsoid(self.ellipsoid).parameters())
        return after

    def nav_state(self, state: Array, time: float) -> NavState:
        """Return the position, velocity and attitude of a state, as `Mechanization.nav_state`."""
        place = np.empty((1, 10))
        level.wander_places(state[None, : kernel.ROW], place)
        return NavState.of_numbers(time, place[0])

    def fill_trajectory(self, history: Array, out: Array) -> None:
        """Fill rows of a Trajectory table from rows of a history."""
        level.wander_trajectory(history, out)

    def latitude(self, row: Array) -> float:
        """Return the geodetic latitude of a row of a history, rad."""
        return float(level.geodetic_from_wander(*row[: kernel.ALT])[0])

    def remarks(self, time: Array, history: Array) -> tuple[Finding, ...]:
        """Report a run so near to a pole that angles from north mean little."""
        w, x, y, z = history[:, : kernel.ALT].T
        cosine = 2.0 * np.sqrt((x * x + y * y) * (w * w + z * z))
        ellipsoid = find_ellipsoid(self.ellipsoid)
        distance = cosine * ellipsoid.semi_major_axis**2 / ellipsoid.semi_minor_axis
        near = np.flatnonzero(distance < NEAR)
        if not near.size:
            return ()
        begin, end = time[near[0]], time[near[-1]]
        return (
            Finding(
                "mechanization.states-near-pole",
                severity="note",
                quantity="heading",
                size=near.size,
                begin=begin,
                end=end,
                near=NEAR,
                distance=distance.min(),
            ),
        )

    def wander_angle(self, history: Array) -> Array:
        """Return the angle from east to xi, anticlockwise.

        `history` ((n, 12)). Returns (n,), rad, within half a turn; at a pole, to rounding, zero.
        """
        return np.array([level.geodetic_from_wander(*row[: kernel.ALT])[2] for row in history])

    def earth_attitude(self, history: Array) -> Array:
        """Return the attitude relative to the Earth, regular at the poles.

        `history` ((n, 12)). Returns (n, 4), ``q_eb = q_ew q_wb``, from body to ECEF axes.
        """
        return rotation.compose(history[:, : kernel.ALT], history[:, kernel.Q_WB : kernel.ROW])

    def inertial_attitude(self, history: Array, elapsed: ArrayLike) -> Array:
        """Return the attitude in inertial axes, the first quaternion of the paper.

        `history` ((n, 12)). `elapsed` ((n,), s): since the inertial axes were those of ECEF: for
        those of the kernel, the start. Returns (n, 4), ``q_ib = [cos(W t / 2), 0, 0, sin(W t / 2)]
        q_ew q_wb``, W the rate of the Earth.
        """
        rate = find_ellipsoid(self.ellipsoid).rotation_rate
        halves = np.ascontiguousarray(0.5 * rate * np.asarray(elapsed, dtype=np.float64))
        out = np.empty((len(history), 4))
        level.inertial_from_body(history, halves, out)
        return out
