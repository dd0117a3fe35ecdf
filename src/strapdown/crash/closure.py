"""Closure between the vehicles of one crash: momentum, restitution, energy, and what fails it.

Planar impact mechanics. Let vehicle i have mass m_i, change of velocity of its center of mass
``w_i = R(psi_i) dV_i - t_i`` over ground, t_i the part that the tires made, and let P be the
impulse of the contact on the first::

    m_1 w_1 = P = -m_2 w_2                                   momentum
    u = V_1 - V_2 before, v = V_1 - V_2 after                at the point of contact
    closing speed -u.p, separation speed v.p, p = P / |P|
    restitution e = -(v.p) / (u.p)
    energy lost E = -P.(u + v) / 2 = |P| (-u.p) (1 - e) / 2

The last holds for non-central impacts with rotation and friction, as u changes linearly with the
impulse (work of an impulse: Brach 1991, Mechanical Impact Dynamics; planar impact mechanics: Brach
& Brach, Vehicle Accident Analysis and Reconstruction Methods). It becomes ``mu Vc² (1 - e²) / 2``,
mu the reduced mass, where impulse and velocities lie on the line through both centers of mass. E
includes the work of friction between the vehicles.

Linear propagation: where the direction of the impulse is known to several degrees only and the
vehicles slide past each other (sideswipe), the 95 % bound of the closing speed along it holds in
about 94 %. Where the tires' bound dominates, bounds hold in up to 97 %.

The vertical is left out: the road takes vertical impulse without a bound.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.pdof import covariance_of
from strapdown.dsp.chi_square import chi_square_above, normal_above, normal_quantile
from strapdown.errors import DataError, Finding, add_note
from strapdown.rotation import within_half_turn
from strapdown.tables.checks import Array
from strapdown.units import ACCEL_UNITS, SPEEDS

Pair = tuple[float, float]

#: Largest tangential over normal force between vehicles. CRASH3 limits its energy correction
#: 1 + tan² alpha to 2, which is this.
CONTACT_FRICTION = 1.0
#: Probability with which a sound pair's momentum is reported as not closing; each limit of
#: contact has a fifth, so that all stay below 1 %.
LEVEL = 0.005
LIMIT_SHARE = 0.2
#: Hypotheses this many times less likely than the best are excluded.
RATIO = 32.0
# An unknown mass or heading: standard deviations relative to the value, and rad, so wide that they
# add nothing.
FREE_MASS, FREE_HEADING = 10.0, 10.0
# A gross error of unknown size: relative standard deviation of a wrong mass, scale or speed, so
# that zero and twice the value are one of these deviations away.
GROSS = 1.0
# Relative to the largest variance: smaller ones are rounding.
FLOOR = 1e-15
# Of one standard deviation: step of the differences that propagate it.
STEP = 1e-4

# Where the unknowns of one vehicle are in their vector.
DELTA_V, TYRES, MASS, HEADING, ENTRY, RATE, RATE_CHANGE, CONTACT, POINT = (
    slice(0, 2),
    slice(2, 4),
    4,
    5,
    slice(6, 8),
    8,
    9,
    slice(10, 12),
    slice(12, 14),
)
SIZE = 14


@dataclass(frozen=True)
class Figure:
    """A number with its 95 % bound, `low` to `high`; infinite where it is unbounded."""

    value: float
    low: float
    high: float

    @classmethod
    def from_sd(cls, value: float, sd: float) -> Figure:
        """Bound of a normal error."""
        return cls(float(value), float(value - TWO_SIDED_95 * sd), float(value + TWO_SIDED_95 * sd))

    @property
    def half_width(self) -> float:
        """Half of the width of the bound."""
        return 0.5 * (self.high - self.low)

    def contains(self, number: float) -> bool:
        """Whether the bound contains a number."""
        return self.low <= number <= self.high

    def root(self) -> Figure:
        """Square root, with what is below zero as zero."""
        return Figure(*(math.sqrt(max(v, 0.0)) for v in (self.value, self.low, self.high)))


@dataclass(frozen=True, eq=False)
class ImpactVehicle:
    """One vehicle of a crash, as reconstructed. Pairs are a value and its standard deviation.

    Attributes
    ----------
    name : str
    delta_v : array_like, (3,), m/s
        Forward, right, down over the whole event, free of gravity, along the axes of the vehicle
        at time zero (frame ``impact``; along turning axes it does not close). It has to hold at
        `point`. Measured away from the center of mass of a vehicle that turns, without its
        `point` and `rate_change`, it does not close.
    covariance : array_like, (3, 3), (m/s)²
    duration : float, s
        Of the event; bounds what the tires contribute.
    mass : pair, kg, optional
    heading_deg : pair, deg, optional
        At time zero, clockwise from north. A relative heading does as well: 0 with 0 for the
        first vehicle.
    entry : array_like, (2,), m/s, optional
        Velocity over ground of the center of mass at time zero: forward, right, or north, east.
    entry_covariance : array_like, (2, 2), (m/s)²
    entry_frame : {'body', 'ned'}
        Whether an error of the heading turns the entry velocity too.
    rate, rate_change : pair, deg/s, optional
        Yaw rate at time zero, and its change over the event; clockwise positive.
    contact : (forward, right, sd), m, optional
        Point at which the resultant force of contact acts, from the center of mass.
    point : (forward, right, sd), m
        Where `delta_v` holds, from the center of mass; by default there.

    Raises
    ------
    DataError
        A number is not finite, an sd, mass or duration out of range; or `point` is not the centre
        of mass and the change of yaw rate is missing.
    """

    name: str
    delta_v: ArrayLike
    covariance: ArrayLike
    duration: float
    mass: Pair | None = None
    heading_deg: Pair | None = None
    entry: ArrayLike | None = None
    entry_covariance: ArrayLike = field(default=((0.0, 0.0), (0.0, 0.0)))
    entry_frame: str = "body"
    rate: Pair | None = None
    rate_change: Pair | None = None
    contact: tuple[float, float, float] | None = None
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "delta_v", _numbers(self, "delta_v", (3,)))
        put(self, "covariance", covariance_of(self.covariance))
        if self.entry is not None:
            put(self, "entry", _numbers(self, "entry", (2,)))
        given = np.zeros((3, 3))
        given[:2, :2] = _numbers(self, "entry_covariance", (2, 2))
        put(self, "entry_covariance", covariance_of(given)[:2, :2])
        for name in ("mass", "heading_deg", "rate", "rate_change", "contact", "point"):
            value = getattr(self, name)
            if value is not None:
                numbers = _numbers(self, name, (len(value),))
                low = name == "mass" and numbers[0] <= 0.0
                if len(value) not in (2, 3) or numbers[-1] < 0.0 or low:
                    raise _out_of_range(self, name, value)
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise _out_of_range(self, "duration", self.duration)
        if self.entry_frame not in ("body", "ned"):
            raise _out_of_range(self, "entry_frame", self.entry_frame)
        if any(self.point) and self.rate_change is None:
            raise DataError(
                "crash.closure-rate-change-needed", quantity="rate_change", name=self.name
            )

    def with_delta_v_times(self, matrix: ArrayLike) -> ImpactVehicle:
        """The vehicle if the true change is a matrix, (2, 2), times the recorded one."""
        whole = np.eye(3)
        whole[:2, :2] = matrix
        change, covariance = np.asarray(self.delta_v), np.asarray(self.covariance)
        return replace(self, delta_v=whole @ change, covariance=whole @ covariance @ whole.T)

    def tire_limit(self, friction: float) -> float:
        """Largest change of velocity that the tires can make, m/s: friction times g times time."""
        return friction * STANDARD_GRAVITY * self.duration

    def contact_change(self, friction: float) -> tuple[Array, Array]:
        """Change of velocity of the center of mass from contact, (2,), vehicle axes, covariance.

        The impulse of the tires is bounded by friction times weight times duration and has an
        unknown direction: uniform over the disc of that radius (GUM, JCGM 100:2008, 4.3.7, takes
        what has only a bound as uniform within it), a quarter of the radius squared per axis.
        """
        x, covariance = self._unknowns(friction)
        covariance[HEADING, HEADING] = x[HEADING] = 0.0
        jacobian = jacobian_of(_contact_change, x, covariance)
        return _contact_change(x), jacobian @ covariance @ jacobian.T

    def _unknowns(self, friction: float) -> tuple[Array, Array]:
        x, covariance = np.zeros(SIZE), np.zeros((SIZE, SIZE))
        x[DELTA_V] = np.asarray(self.delta_v)[:2]
        covariance[DELTA_V, DELTA_V] = np.asarray(self.covariance)[:2, :2]
        covariance[TYRES, TYRES] = np.eye(2) * 0.25 * self.tire_limit(friction) ** 2
        if self.entry is not None:
            x[ENTRY] = self.entry
            covariance[ENTRY, ENTRY] = self.entry_covariance
        for index, pair, unit in (
            (MASS, self.mass, 1.0),
            (HEADING, self.heading_deg, math.radians(1.0)),
            (RATE, self.rate, math.radians(1.0)),
            (RATE_CHANGE, self.rate_change, math.radians(1.0)),
        ):
            if pair is not None:
                x[index], covariance[index, index] = pair[0] * unit, (pair[1] * unit) ** 2
        for where, position in ((CONTACT, self.contact), (POINT, self.point)):
            if position is not None:
                x[where] = position[:2]
                covariance[where, where] = np.eye(2) * position[2] ** 2
        return x, covariance


def _numbers(vehicle: ImpactVehicle, name: str, shape: tuple[int, ...]) -> Array:
    try:
        numbers = np.asarray(getattr(vehicle, name), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _out_of_range(vehicle, name, getattr(vehicle, name)) from error
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise _out_of_range(vehicle, name, getattr(vehicle, name))
    return numbers


def _out_of_range(vehicle: ImpactVehicle, name: str, value: object) -> DataError:
    return DataError(
        "crash.closure-value-out-of-range", quantity=name, name=vehicle.name, value=str(value)
    )


# Unknowns of an impact and their propagation. All functions take (..., SIZE) per vehicle.


def _turned(angle: Array, vector: Array) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    x, y = vector[..., 0], vector[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _by_rate(rate: Array, arm: Array) -> Array:
    """Velocity of a point at an arm from the center of mass by a yaw rate."""
    return np.stack([-rate * arm[..., 1], rate * arm[..., 0]], axis=-1)


def _centre_change(x: Array) -> Array:
    """Change of velocity of the center of mass, over ground, tires included."""
    own = x[..., DELTA_V] - _by_rate(x[..., RATE_CHANGE], x[..., POINT])
    return _turned(x[..., HEADING], own)


def _contact_change(x: Array) -> Array:
    return _centre_change(x) - x[..., TYRES]


def jacobian_of(function: Callable[[Array], Array], x: Array, covariance: Array) -> Array:
    """Derivatives of a function, (m, n), by central differences along uncertain unknowns."""
    sd = np.sqrt(np.diagonal(covariance))
    active = np.flatnonzero(sd > 0.0)
    steps = np.zeros((active.size, x.size))
    steps[np.arange(active.size), active] = STEP * sd[active]
    values = function(np.concatenate([x + steps, x - steps]))
    rows = (values[: active.size] - values[active.size :]) / (2.0 * STEP * sd[active])[:, None]
    out = np.zeros((rows.shape[1], x.size))
    out[:, active] = rows.T
    return out


def _inverse(matrix: Array, size: float) -> Array:
    """Inverse of a covariance of impulses of a size; rounding gives no information."""
    floor = max(FLOOR * float(np.trace(matrix)), (1e-9 * size) ** 2, np.finfo(float).tiny)
    return np.asarray(np.linalg.inv(matrix + floor * np.eye(len(matrix))), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Impact:
    """Unknowns of both vehicles, or of one against a fixed barrier, and what follows from them.

    `x`, (n,): nominal, of each vehicle and, last, the share of the first in the energy; free masses
    and headings at the values that close momentum. `two`: not a barrier. `over_ground`: which entry
    velocities are north, east. `at_contact`: velocities at the point of contact, else of the
    centers of mass.
    """

    x: Array
    covariance: Array
    two: bool
    over_ground: tuple[bool, ...]
    at_contact: bool

    def momentum(self, x: Array) -> Array:
        """Impulse left over, N s, (..., 2), over ground: from outside beyond the tires."""
        first, second = x[..., :SIZE], x[..., SIZE : 2 * SIZE]
        return np.asarray(
            first[..., MASS, None] * _contact_change(first)
            + second[..., MASS, None] * _contact_change(second)
        )

    def residual(self) -> tuple[Array, Array, float]:
        """Impulse left over, its covariance, and chi-square."""
        left = self.momentum(self.x)
        jacobian = jacobian_of(self.momentum, self.x, self.covariance)
        covariance = jacobian @ self.covariance @ jacobian.T
        return left, covariance, float(left @ _inverse(covariance, self._impulse()) @ left)

    def _impulse(self) -> float:
        first = self.x[:SIZE]
        return float(first[MASS] * np.linalg.norm(_contact_change(first)))

    def adjusted(self) -> _Impact:
        """Least-squares adjustment under conservation of momentum (Gauss-Newton)."""
        if not self.two:
            return self
        x, covariance = self.x, self.covariance
        for _ in range(4):
            jacobian = jacobian_of(self.momentum, x, self.covariance)
            spread = self.covariance @ jacobian.T
            gain = spread @ _inverse(jacobian @ spread, self._impulse())
            x = self.x - gain @ (self.momentum(x) + jacobian @ (self.x - x))
            covariance = self.covariance - gain @ spread.T
        return replace(self, x=x, covariance=0.5 * (covariance + covariance.T))

    def keeps_signs_of(self, other: _Impact) -> bool:
        """Whether masses are positive and neither change of velocity points backward."""
        return all(
            self.x[k + MASS] > 0.0 and float(self.x[k : k + 2] @ other.x[k : k + 2]) >= 0.0
            for k in (0, SIZE)[: 1 + self.two]
        )

    def _velocities(self, x: Array) -> tuple[Array, Array]:
        """Relative velocity of the first to the second before and after, over ground."""
        before, after = np.zeros((2, *x.shape[:-1], 2))
        for k, sign in enumerate((1.0, -1.0)[: 1 + self.two]):
            one = x[..., k * SIZE : (k + 1) * SIZE]
            entry = one[..., ENTRY]
            if not self.over_ground[k]:
                entry = _turned(one[..., HEADING], entry)
            end = entry + _centre_change(one)
            if self.at_contact:
                heading, rate, arm = one[..., HEADING], one[..., RATE], one[..., CONTACT]
                entry = entry + _turned(heading, _by_rate(rate, arm))
                end = end + _turned(heading, _by_rate(rate + one[..., RATE_CHANGE], arm))
            before, after = before + sign * entry, after + sign * end
            if k == 0:
                own_before, own_after = entry, end
        return np.stack([before, after]), np.stack([own_before, own_after])

    def direction(self) -> Array:
        """Unit vector of the impulse on the first, over ground."""
        change = _contact_change(self.x[:SIZE])
        size = float(np.linalg.norm(change))
        return np.asarray(change / size) if size > 0.0 else np.array([1.0, 0.0])

    def figures(self) -> tuple[Array, Array]:
        """Figures in the order of `CLOSING` to `IMPULSE`, and their covariance.

        `APART` is the largest separation speed over the normals that friction allows; EES are
        squared; the direction, rad, is that about the nominal.
        """
        nominal = self.direction()

        def compute(x: Array) -> Array:
            first = x[..., :SIZE]
            change = _contact_change(first)
            size = np.linalg.norm(change, axis=-1)
            p = change / np.where(size > 0.0, size, 1.0)[..., None]
            (before, after), (own, own_after) = self._velocities(x)
            closing = -(before * p).sum(axis=-1)
            separation = (after * p).sum(axis=-1)
            gained = closing + separation
            # The relative velocity along p is linear in the impulse: it is zero at this part.
            part = np.divide(closing, gained, out=np.zeros_like(gained), where=gained != 0.0)
            common = (own * p).sum(axis=-1) + part * ((own_after - own) * p).sum(axis=-1)
            across = p[..., 0] * after[..., 1] - p[..., 1] * after[..., 0]
            beyond = np.abs(np.arctan2(across, separation)) - math.atan(CONTACT_FRICTION)
            apart = np.linalg.norm(after, axis=-1) * np.cos(np.maximum(beyond, 0.0))
            mass = first[..., MASS]
            energy = 0.5 * mass * size * (closing - separation)
            share = x[..., -1]
            squares = [2.0 * share * energy / mass]
            other = x[..., SIZE + MASS] if self.two else mass
            squares.append(2.0 * (1.0 - share) * energy / other)
            turned = np.arctan2(
                nominal[0] * p[..., 1] - nominal[1] * p[..., 0], (nominal * p).sum(axis=-1)
            )
            numbers = [closing, separation, common, apart, energy, *squares, turned, mass * size]
            return np.stack(numbers, axis=-1)

        jacobian = jacobian_of(compute, self.x, self.covariance)
        return compute(self.x), jacobian @ self.covariance @ jacobian.T


CLOSING, SEPARATION, COMMON, APART, ENERGY, EES_FIRST, EES_SECOND, DIRECTION, IMPULSE = range(9)


def _impact(
    first: ImpactVehicle,
    second: ImpactVehicle | None,
    friction: float,
    share: Pair | None = None,
) -> tuple[_Impact, int]:
    """Unknowns of an impact, and the degrees of freedom of momentum."""
    if not (math.isfinite(friction) and friction >= 0.0):
        raise DataError("crash.closure-friction", quantity="friction", value=friction)
    vehicles = [first] if second is None else [first, second]
    parts = [v._unknowns(friction) for v in vehicles]
    x = np.concatenate([p[0] for p in parts] + [[0.0]])
    covariance = np.zeros((x.size, x.size))
    for k, (_, own) in enumerate(parts):
        covariance[k * SIZE : (k + 1) * SIZE, k * SIZE : (k + 1) * SIZE] = own
    if share is not None:
        x[-1], covariance[-1, -1] = share[0], share[1] ** 2
    freedom = 0
    if second is not None:
        freedom = (
            2 - _free_masses(x, covariance, vehicles) - _free_headings(x, covariance, vehicles)
        )
    elif first.mass is None:
        x[MASS] = 1.0
    at_contact = all(None not in (v.contact, v.rate, v.rate_change) for v in vehicles)
    over_ground = tuple(v.entry_frame == "ned" for v in vehicles)
    return _Impact(x, covariance, second is not None, over_ground, at_contact), freedom


def _free_masses(x: Array, covariance: Array, vehicles: Sequence[ImpactVehicle]) -> bool:
    """Put an unknown mass to the value that closes momentum; whether there is one."""
    unknown = [k for k, v in enumerate(vehicles) if v.mass is None]
    if not unknown:
        return False
    sizes = [np.linalg.norm(_contact_change(x[k * SIZE : (k + 1) * SIZE])) for k in (0, 1)]
    if len(unknown) == 2:
        x[MASS] = 1.0
    k = unknown[-1]
    at, of = k * SIZE + MASS, (1 - k) * SIZE + MASS
    x[at] = x[of] * sizes[1 - k] / max(float(sizes[k]), 1e-9)
    covariance[at, at] = (FREE_MASS * x[at]) ** 2
    return True


def _free_headings(x: Array, covariance: Array, vehicles: Sequence[ImpactVehicle]) -> bool:
    """Put an unknown heading to the value that opposes the impulses; whether there is one.

    Without any, ground is the axes of the first vehicle at time zero.
    """
    unknown = [k for k, v in enumerate(vehicles) if v.heading_deg is None]
    if not unknown:
        return False
    k = unknown[-1]
    one, other = (
        _contact_change(x[k * SIZE : (k + 1) * SIZE]),
        _contact_change(x[(1 - k) * SIZE : (2 - k) * SIZE]),
    )
    at = k * SIZE + HEADING
    x[at] = math.atan2(-other[1], -other[0]) - math.atan2(one[1], one[0])
    covariance[at, at] = FREE_HEADING**2
    return True


# Closure of two vehicles, and of one against a barrier.


@dataclass(frozen=True, eq=False)
class Closure:
    """What two vehicles of one crash say together; None where something for it is not known.

    Attributes
    ----------
    residual : ndarray, (2,), N s
        Impulse left over, north and east (in the axes of the first vehicle at time zero where no
        heading is known), with its `covariance`. An unknown mass or heading closes one direction
        by itself: its variance there is practically unbounded, and a degree of `freedom` less.
    chi_square, freedom, probability
        Of a residual at least this large if the stated uncertainty is right; without freedom
        nothing is tested and the probability is 1.
    magnitude : Figure, N s, optional
        ``m1 |w1| - m2 |w2|``; needs no heading.
    mass_ratio : Figure, optional
        Second over first, implied by the changes of velocity alone, ``|w1| / |w2|``.
    relative_heading_deg : Figure, optional
        Second minus first, implied by the directions of force alone; the whole circle where
        either change may be zero.
    direction_deg : Figure
        Of the impulse on the first, clockwise from north, adjusted under momentum.
    basis : {'contact', 'centers'}
        Where the velocities of the following hold. ``centers``: the point of contact or a yaw rate
        is not known; restitution is then that between the centers of mass along the impulse,
        which for a non-central impact is below that of the contact, and the energy is that of
        translation, of which a part goes into rotation.
    closing_speed, separation_speed : Figure, m/s, optional
        Along the impulse.
    restitution : Figure, optional
        Along the impulse, friction included: negative where the vehicles slide on past each other.
    common_velocity : Figure, m/s, optional
        Along the impulse, of both at the end of approach; none where they slide past each other.
    impulse : Figure, N s, optional
        Of the contact, adjusted under momentum.
    energy : Figure, J, optional
        Kinetic energy lost in the contact.
    energy_equivalent_speed : pair of Figure, m/s, optional
        Of the first and the second.
    findings : tuple of Finding
    """

    residual: Array
    covariance: Array = field(repr=False)
    chi_square: float
    freedom: int
    probability: float
    magnitude: Figure | None
    mass_ratio: Figure | None
    relative_heading_deg: Figure | None
    direction_deg: Figure
    basis: str
    closing_speed: Figure | None
    separation_speed: Figure | None
    restitution: Figure | None
    common_velocity: Figure | None
    impulse: Figure | None
    energy: Figure | None
    energy_equivalent_speed: tuple[Figure | None, Figure | None]
    findings: tuple[Finding, ...]

    @property
    def contradicted(self) -> bool:
        """Whether something stated must be wrong."""
        return any(f.severity == "warning" for f in self.findings)


def close_vehicles(
    first: ImpactVehicle,
    second: ImpactVehicle,
    *,
    friction: float,
    energy_share: Pair | None = None,
    level: float = LEVEL,
) -> Closure:
    """Momentum, closing speed, restitution and energy of an impact of two vehicles.

    Parameters
    ----------
    first, second : ImpactVehicle
        `delta_v` has to hold at the stated point, by default the center of mass; one of a rotating
        vehicle measured elsewhere does not close.
    friction : float
        Coefficient of friction of tires on the road: the largest that is possible.
    energy_share : pair, optional
        Share of the energy that the first absorbed, 0 to 1, and its sd (`equal_force_share`).
        The energy-equivalent speed needs it.
    level : float
        Probability with which sound momentum is reported as not closing.

    Returns
    -------
    Closure
        Bounds from linear propagation of all stated unknowns, after a least-squares adjustment
        under momentum; of ratios by Fieller's theorem. They hold only without a contradiction.

    Raises
    ------
    DataError
        The friction is negative, or the share not within 0 to 1.
    """
    return _closed(first, second, friction, energy_share, level)


def against_barrier(vehicle: ImpactVehicle, *, friction: float, level: float = LEVEL) -> Closure:
    """Closing speed, restitution and energy of a vehicle against a rigid fixed barrier.

    As `close_vehicles` with a second vehicle of infinite mass that absorbs nothing; momentum is
    not tested.
    """
    return _closed(vehicle, None, friction, (1.0, 0.0), level)


def _closed(
    first: ImpactVehicle,
    second: ImpactVehicle | None,
    friction: float,
    share: Pair | None,
    level: float,
) -> Closure:
    if share is not None and not (0.0 <= share[0] <= 1.0 and 0.0 <= share[1] < math.inf):
        raise DataError("crash.closure-share", quantity="energy_share", value=str(share))
    vehicles = [first] if second is None else [first, second]
    impact, freedom = _impact(first, second, friction, share)
    left, covariance, chi, probability = np.zeros(2), np.zeros((2, 2)), 0.0, 1.0
    if second is not None:
        left, covariance, chi = impact.residual()
        probability = chi_square_above(chi, freedom) if freedom else 1.0
    findings = list(_not_closed(vehicles, chi, freedom, probability, level))
    impact = impact.adjusted()
    values, spread = impact.figures()
    sds = np.sqrt(np.maximum(np.diagonal(spread), 0.0))
    known = _entries_known(vehicles)
    if not known:
        findings.append(Finding("crash.closure-without-entry", severity="note", quantity="entry"))
    else:
        findings += _limits(vehicles, impact, values, spread, level)
        if not impact.at_contact:
            add_note(findings, "crash.closure-of-centers", quantity="contact")

    def figure(index: int) -> Figure | None:
        return Figure.from_sd(values[index], sds[index]) if known else None

    separation = figure(SEPARATION)
    slid = separation is not None and separation.high < 0.0

    masses = first.mass is not None or (second is not None and second.mass is not None)
    equivalent = [
        square.root() if square is not None and share is not None else None
        for square in map(figure, (EES_FIRST, EES_SECOND)[: len(vehicles)])
    ]
    equivalent += [None] * (2 - len(equivalent))
    azimuth = math.degrees(math.atan2(*impact.direction()[::-1])) % 360.0
    sizes = _sizes(vehicles, friction)
    pair = [SEPARATION, CLOSING]
    return Closure(
        left,
        covariance,
        chi,
        freedom,
        probability,
        _magnitude(vehicles, sizes),
        _mass_ratio(sizes),
        _relative_heading(vehicles, friction),
        Figure.from_sd(azimuth, math.degrees(sds[DIRECTION])),
        "contact" if impact.at_contact else "centers",
        figure(CLOSING),
        separation,
        _ratio(values[pair], spread[np.ix_(pair, pair)]) if known else None,
        None if slid else figure(COMMON),
        Figure.from_sd(values[IMPULSE], sds[IMPULSE]) if masses else None,
        figure(ENERGY) if masses else None,
        (equivalent[0], equivalent[1]),
        tuple(findings),
    )


def _entries_known(vehicles: Sequence[ImpactVehicle]) -> bool:
    """Whether every entry velocity is known, along directions that are tied to the impulse."""
    if any(v.entry is None for v in vehicles):
        return False
    tied = any(v.heading_deg is not None for v in vehicles)
    return tied or all(v.entry_frame == "body" for v in vehicles)


def _not_closed(
    vehicles: Sequence[ImpactVehicle], chi: float, freedom: int, probability: float, level: float
) -> Iterator[Finding]:
    names: dict[str, Any] = {"name": vehicles[0].name, "name_2": vehicles[-1].name}
    if len(vehicles) == 2 and freedom < 2:
        missing = [
            f"{what} of {v.name}"
            for what, key in (("mass", "mass"), ("heading", "heading_deg"))
            for v in vehicles
            if getattr(v, key) is None
        ]
        yield Finding(
            "crash.momentum-partly-tested",
            severity="note",
            quantity="momentum",
            missing=missing,
            freedom=freedom,
        )
    if freedom and probability < level:
        yield Finding(
            "crash.momentum-not-closed",
            quantity="momentum",
            chi=chi,
            freedom=freedom,
            probability=probability,
            **names,
        )


def _limits(
    vehicles: Sequence[ImpactVehicle], impact: _Impact, values: Array, spread: Array, level: float
) -> Iterator[Finding]:
    """What contact does not allow, beyond its bound."""
    names: dict[str, Any] = {
        "name": vehicles[0].name,
        "name_2": vehicles[-1].name if impact.two else "barrier",
    }
    factor = normal_quantile(1.0 - LIMIT_SHARE * level)
    for code, value, sd in _margins(impact, values, spread):
        if value < -factor * sd:
            yield Finding(code, quantity="restitution", value=value, sd=sd, **names)


def _margins(impact: _Impact, values: Array, spread: Array) -> Iterator[tuple[str, float, float]]:
    """What contact keeps above zero, with its sd.

    The vehicles approach along the impulse; the contact gives no energy, so that along the impulse
    restitution is at most 1; and the points of contact part along at least one normal within the
    friction cone about the impulse. The last needs the point of contact: the centres of a
    non-central impact may go on approaching. Along the impulse itself even the points of contact
    may, where they slide on past each other.
    """
    kinds = [("crash.no-closing-speed", [CLOSING], [1.0])]
    kinds.append(("crash.restitution-above-one", [CLOSING, SEPARATION], [1.0, -1.0]))
    if impact.at_contact:
        kinds.append(("crash.restitution-below-zero", [APART], [1.0]))
    for code, indices, signs in kinds:
        row = np.zeros(len(values))
        row[indices] = signs
        yield code, float(row @ values), math.sqrt(max(float(row @ spread @ row), 0.0))


def _sizes(vehicles: Sequence[ImpactVehicle], friction: float) -> list[Pair]:
    """Size of each change from contact, m/s, and its sd."""
    out = []
    for vehicle in vehicles:
        change, covariance = vehicle.contact_change(friction)
        size = float(np.linalg.norm(change))
        along = change / size if size > 0.0 else np.array([1.0, 0.0])
        out.append((size, math.sqrt(float(along @ covariance @ along))))
    return out


def _magnitude(vehicles: Sequence[ImpactVehicle], sizes: Sequence[Pair]) -> Figure | None:
    if len(vehicles) < 2 or vehicles[0].mass is None or vehicles[1].mass is None:
        return None
    impulses, variance = [], 0.0
    for vehicle, (size, sd) in zip(vehicles, sizes, strict=True):
        mass, mass_sd = vehicle.mass or (0.0, 0.0)
        impulses.append(mass * size)
        variance += (mass * sd) ** 2 + (mass_sd * size) ** 2
    return Figure.from_sd(impulses[0] - impulses[1], math.sqrt(variance))


def _mass_ratio(sizes: Sequence[Pair]) -> Figure | None:
    if len(sizes) < 2:
        return None
    (above, sd), (below, sd_below) = sizes
    return _ratio(np.array([above, below]), np.diag([sd**2, sd_below**2]))


def _ratio(values: Array, covariance: Array) -> Figure:
    """First over second of two numbers by Fieller's theorem (1954, J. R. Stat. Soc. B 16)."""
    (above, below), z2 = values, TWO_SIDED_95**2
    # Those r with (above - r below)² <= z² var(above - r below).
    a = below**2 - z2 * covariance[1, 1]
    b = above * below - z2 * covariance[0, 1]
    c = above**2 - z2 * covariance[0, 0]
    if a <= 0.0:
        value = above / below if below else math.nan
        return Figure(float(value), -math.inf, math.inf)
    reach = math.sqrt(max(b * b - a * c, 0.0))
    return Figure(float(above / below), float((b - reach) / a), float((b + reach) / a))


def _relative_heading(vehicles: Sequence[ImpactVehicle], friction: float) -> Figure | None:
    """Heading of the second minus that of the first, deg: the impulses oppose each other."""
    if len(vehicles) < 2:
        return None
    angles, variance = [], 0.0
    for vehicle in vehicles:
        change, covariance = vehicle.contact_change(friction)
        normal = np.array([-change[1], change[0]])
        square = float(change @ change)
        across = float(normal @ covariance @ normal)
        # Fieller: the direction is not determined where the component across is not significant.
        variance += across / square**2 if square**2 > TWO_SIDED_95**2 * across else math.inf
        angles.append(math.atan2(change[1], change[0]))
    value = float(within_half_turn(np.array(math.degrees(angles[0] - angles[1]) + 180.0)))
    sd = min(math.degrees(math.sqrt(variance)), 180.0 / TWO_SIDED_95)
    return Figure.from_sd(value, sd)


# Which error explains that vehicles do not close.


@dataclass(frozen=True)
class Hypothesis:
    """One explanation: a finding that names it, and how well the pair closes under it.

    `log_likelihood`: of the recorded changes of velocity, up to a constant common to all
    hypotheses, with that of the limits of contact where the entry velocities are known.
    `possible`: under it no contradiction remains.
    """

    finding: Finding
    log_likelihood: float
    chi_square: float
    freedom: int
    probability: float
    possible: bool


@dataclass(frozen=True)
class Blame:
    """Hypotheses side by side, the most likely first; `ratio` excludes the others.

    `contradicted`: whether the pair as stated is reported at all.
    """

    contradicted: bool
    hypotheses: tuple[Hypothesis, ...]
    ratio: float

    @property
    def candidates(self) -> tuple[Hypothesis, ...]:
        """Those that close and are not significantly worse than the best; none where none closes.

        Empty also without a contradiction.
        """
        closing = [h for h in self.hypotheses if h.possible]
        if not (self.contradicted and closing):
            return ()
        least = closing[0].log_likelihood - math.log(self.ratio)
        return tuple(h for h in closing if h.log_likelihood >= least)


def blame(
    first: ImpactVehicle,
    second: ImpactVehicle,
    *,
    friction: float,
    level: float = LEVEL,
    ratio: float = RATIO,
) -> Blame:
    """Compare errors that would explain why two vehicles do not close.

    Each hypothesis undoes one error and has the likelihood of the recorded changes of velocity:
    the normal density of the momentum that is left over, times the determinant by which the
    hypothesis scales the record, times the probability that what is then found respects the
    limits of contact. A wrong mass, scale or entry speed has an unknown size, with a relative sd
    of one. Momentum alone does not determine which: opposite errors of the two vehicles,
    mass and scale, and all that is symmetric for two equal vehicles leave the same. All within
    `ratio` of the best are `Blame.candidates`.

    Parameters
    ----------
    first, second, friction, level
        As `close_vehicles`.
    ratio : float
        Of likelihoods; 32 is strong evidence (Royall 1997, Statistical Evidence).
    """
    known = _entries_known((first, second))
    factor = normal_quantile(1.0 - LIMIT_SHARE * level)
    out = []
    for finding, one, other, scale in _hypotheses(first, second, known):
        impact, freedom = _impact(one, other, friction)
        _, covariance, chi = impact.residual()
        probability = chi_square_above(chi, freedom) if freedom else 1.0
        # The density of the impulse, as that of the recorded changes of velocity; masses only
        # matter where one is free and follows the record.
        log = math.log(scale) + 2.0 * float(np.log(impact.x[[MASS, SIZE + MASS]]).sum())
        log -= 0.5 * (chi + float(np.linalg.slogdet(covariance)[1]))
        possible = probability >= level
        adjusted = impact.adjusted()
        # A wrong size is positive: the other sign is a hypothesis of its own.
        possible = possible and adjusted.keeps_signs_of(impact)
        if known and possible:
            for _, value, sd in _margins(adjusted, *adjusted.figures()):
                normal = value / max(sd, np.finfo(float).tiny)
                possible = possible and normal >= -factor
                log += math.log(max(normal_above(-normal), np.finfo(float).tiny))
        out.append(Hypothesis(finding, log, chi, freedom, probability, possible))
    contradicted = not out[0].possible
    out.sort(key=lambda h: -h.log_likelihood)
    return Blame(contradicted, tuple(out), ratio)


def blame_points(
    points: Sequence[ImpactVehicle],
    other: ImpactVehicle,
    *,
    friction: float,
    level: float = LEVEL,
) -> tuple[Finding, ...]:
    """Which of several measuring points of one vehicle do not close with the other vehicle.

    `points`: the vehicle with the change of velocity of each point, named after it. Each that does
    not close while others do is named with those; where none closes, the other vehicle, or what the
    points share, is as possible. Empty where all close.
    """
    closing: list[tuple[str, float]] = []
    odd: list[tuple[str, float]] = []
    for point in points:
        closure = close_vehicles(point, other, friction=friction, level=level / len(points))
        (odd if closure.contradicted else closing).append((point.name, closure.probability))
    if odd and not closing:
        return (
            Finding("crash.no-point-closes", quantity="momentum", name=other.name, count=len(odd)),
        )
    return tuple(
        Finding(
            "crash.point-does-not-close",
            file=name,
            quantity="momentum",
            name=other.name,
            others=[n for n, _ in closing],
            probability=probability,
        )
        for name, probability in odd
    )


Explanation = tuple[Finding, ImpactVehicle, ImpactVehicle, float]


def _hypotheses(first: ImpactVehicle, second: ImpactVehicle, known: bool) -> Iterator[Explanation]:
    """The pair as stated, and under each single error undone."""

    def note(code: str, **values: Any) -> Finding:
        return Finding(code, severity="note", quantity="momentum", **values)

    yield note("crash.closes-as-stated"), first, second, 1.0
    for k, own in enumerate((first, second)):
        for finding, changed, scale in _errors(own, known):
            pair = (changed, second) if k == 0 else (first, changed)
            yield finding.replace(name=own.name), *pair, scale
    names: dict[str, Any] = {"name": first.name, "name_2": second.name}
    record = "delta_v covariance duration entry entry_covariance entry_frame rate rate_change point"

    def with_record(of: ImpactVehicle, to: ImpactVehicle) -> ImpactVehicle:
        return replace(to, **{key: getattr(of, key) for key in record.split()})

    swapped = with_record(second, first), with_record(first, second)
    yield note("crash.closes-if-records-swapped", **names), *swapped, 1.0
    if first.mass != second.mass:
        masses = replace(first, mass=second.mass), replace(second, mass=first.mass)
        yield note("crash.closes-if-masses-swapped", **names), *masses, 1.0


def _errors(own: ImpactVehicle, known: bool) -> Iterator[tuple[Finding, ImpactVehicle, float]]:
    """One vehicle with each of its possible errors undone."""

    def note(code: str, **values: Any) -> Finding:
        return Finding(code, severity="note", quantity="momentum", **values)

    for axis, matrix in (("forward", np.diag([-1.0, 1.0])), ("right", np.diag([1.0, -1.0]))):
        yield (
            note("crash.closes-if-sign-reversed", axis=axis),
            own.with_delta_v_times(matrix),
            1.0,
        )
    swapped = own.with_delta_v_times([[0.0, 1.0], [1.0, 0.0]])
    yield note("crash.closes-if-axes-swapped"), swapped, 1.0
    if own.heading_deg is not None:
        heading, sd = own.heading_deg
        for angle in (90.0, -90.0, 180.0):
            turned = replace(own, heading_deg=(heading + angle, sd))
            yield note("crash.closes-if-heading-turned", angle=angle), turned, 1.0
    for true, taken, factor in _units():
        scaled = own.with_delta_v_times(np.eye(2) * factor)
        finding = note("crash.closes-if-unit", true=true, taken=taken, factor=factor)
        yield finding, scaled, factor**2
    if own.mass is not None:
        mass, sd = own.mass
        wrong = replace(own, mass=(mass, math.hypot(sd, GROSS * mass)))
        yield note("crash.closes-if-mass-wrong"), wrong, 1.0
    change = np.asarray(own.delta_v)
    for axis, kept in (("every", [1, 1, 0]), ("forward", [1, 0, 0]), ("right", [0, 1, 0])):
        free = GROSS * change * np.array(kept)
        wrong = replace(own, covariance=np.asarray(own.covariance) + np.outer(free, free))
        yield note("crash.closes-if-scale-wrong", axis=axis), wrong, 1.0
    if known:
        entry = np.asarray(own.entry)
        spread = np.asarray(own.entry_covariance) + GROSS**2 * (entry @ entry) * np.eye(2)
        yield note("crash.closes-if-entry-wrong"), replace(own, entry_covariance=spread), 1.0


def _units() -> Iterator[tuple[str, str, float]]:
    """A unit, the unit that it was taken for, and the factor that corrects it."""
    for table, names in ((ACCEL_UNITS, ("g", "m/s2")), (SPEEDS, ("m/s", "km/h", "mph"))):
        for true, taken in itertools.permutations(names, 2):
            yield true, taken, table[true] / table[taken]
