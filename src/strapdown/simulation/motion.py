"""Motions with exact attitude at every instant, and what they are made of."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels.piecewise import legendre_sums
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.tables.checks import Array

Quaternion = tuple[float, float, float, float]


def check_numbers(
    owner: object,
    *,
    positive: str = "",
    not_negative: str = "",
    finite: str = "",
    file: str | None = None,
) -> None:
    """Raise ConfigError unless attributes, named with blanks between, are in their range.

    `file`: name of the owner, for the location of the finding.
    """
    for names, code, lowest in (
        (positive, "simulation.not-positive", math.ulp(0.0)),
        (not_negative, "simulation.negative", 0.0),
        (finite, "simulation.not-finite", -math.inf),
    ):
        for name in names.split():
            value = getattr(owner, name)
            if not (lowest <= value and math.isfinite(value)):
                raise ConfigError(code, file=file, quantity=name, value=value)


def euler_attitude(angles: Array, q_nb: Quaternion) -> Array:
    """Attitude of a body rotated by 3-2-1 angles from an initial attitude.

    `angles` ((n, 3), deg): roll, pitch, heading, relative to the initial attitude; any number of
    turns, and no singularity at pitch ±90 deg. `q_nb`: initial attitude, scalar first. Returns (n,
    4), ``q_nb Rz(heading) Ry(pitch) Rx(roll)``, continuous in sign. Whole turns reproduce the
    attitude to the last bit, except for that sign.
    """
    # 360 deg is not a binary fraction of pi, but whole turns can be removed without rounding.
    turns = np.rint(angles / 360.0)
    q = rotation.compose(
        np.asarray(q_nb, dtype=np.float64), rotation.quaternion_from_euler(angles - 360.0 * turns)
    )
    odd = turns.sum(axis=1) % 2.0 == 1.0
    return np.where(odd[:, None], -q, q)


def euler_body_rate(angles: Array, rates: Array) -> Array:
    """Body rate from the rates of the 3-2-1 angles.

    `angles` ((n, 3), deg): roll, pitch, heading. `rates` ((n, 3), deg/s): their derivatives.
    Returns (n, 3), rad/s, exactly zero where all three rates are zero.

    ``ω = [φ' - ψ' sin θ, θ' cos φ + ψ' sin φ cos θ, ψ' cos φ cos θ - θ' sin φ]``, the inverse of
    Alexiev (2021), Eqs. (8)-(10). Valid at every pitch.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    across = d_heading * np.cos(pitch)
    return np.column_stack(
        [
            d_roll - d_heading * np.sin(pitch),
            d_pitch * np.cos(roll) + across * np.sin(roll),
            across * np.cos(roll) - d_pitch * np.sin(roll),
        ]
    )


def euler_body_acceleration(angles: Array, rates: Array, accelerations: Array) -> Array:
    """Time derivative of the body rate from 3-2-1 angles and their derivatives.

    `angles` ((n, 3), deg): roll, pitch, heading. `rates`, `accelerations` ((n, 3), deg/s and
    deg/s²): their first and second derivatives. Returns (n, 3), rad/s², derivative of the
    components of `euler_body_rate` in body axes, at every pitch; exactly zero where all derivatives
    are zero.
    """
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    d_roll, d_pitch, d_heading = np.radians(rates).T
    dd_roll, dd_pitch, dd_heading = np.radians(accelerations).T
    sin, cos, steep, flat = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    across = dd_heading * flat - d_heading * d_pitch * steep
    # The y and z axes roll within the plane that these two span.
    along_y, along_z = dd_pitch + d_roll * d_heading * flat, across - d_roll * d_pitch
    return np.column_stack(
        [
            dd_roll - dd_heading * steep - d_heading * d_pitch * flat,
            along_y * cos + along_z * sin,
            along_z * cos - along_y * sin,
        ]
    )


class FlatMotion(ABC):
    """Base of motions over a flat Earth at rest, in fixed north-east-down; rows by time in s.

    The position is constant unless `moved` is overridden.
    """

    @abstractmethod
    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude ``q_nb``, continuous in sign; (n, 4)."""

    def moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Position in m, velocity in m/s, acceleration in m/s²; (n, 3) each."""
        still = np.zeros((np.size(time), 3))
        return still, still, still

    def position(self, time: ArrayLike) -> Array:
        """Position; (n, 3), m."""
        return self.moved(time)[0]

    def velocity(self, time: ArrayLike) -> Array:
        """Velocity; (n, 3), m/s."""
        return self.moved(time)[1]

    def acceleration(self, time: ArrayLike) -> Array:
        """Acceleration without gravity; (n, 3), m/s²."""
        return self.moved(time)[2]

    def specific_force(self, time: ArrayLike) -> Array:
        """``C_nb^T (a_n - g_n)`` with standard gravity straight down; (n, 3), m/s²."""
        upward = self.acceleration(time) - np.array([0.0, 0.0, STANDARD_GRAVITY])
        return rotation.rotate(rotation.conjugate(self.attitude(time)), upward)


class EulerMotion(FlatMotion):
    """Base of motions by 3-2-1 angles from an initial attitude `q_nb`."""

    q_nb: Quaternion

    @abstractmethod
    def turned(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Roll, pitch, heading in deg, and their first two derivatives; (n, 3) each."""

    @property
    @abstractmethod
    def breaks(self) -> Sequence[float]:
        """Instants between which the angles are smooth, from zero to the end, s."""

    def rate(self, time: ArrayLike) -> Array:
        """Body rate, exactly zero at rest; (n, 3), rad/s."""
        angles, rates, _ = self.turned(time)
        return euler_body_rate(angles, rates)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, within 1e-14 rad plus rounding; (n, 3), rad.

        Constant before zero, after the end, and at rest.
        """
        return self._integral(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude ``q_nb``, continuous in sign; (n, 4)."""
        return euler_attitude(self.turned(time)[0], self.q_nb)

    @cached_property
    def _integral(self) -> RateIntegral:
        return integrate_rate(self.rate, self.breaks)


class Motion(Protocol):
    """Interface of a motion: the exact truth at any instant from 0 to `duration`.

    Each method takes instants, (n,) in s, and returns one row for each. The motion decides whether
    the Earth is flat and fixed (`FlatMotion`) or rotates (`earth_motion.EarthMotion`);
    sensors use only rate and specific force.
    """

    @property
    def duration(self) -> float:
        """Length in s."""
        ...

    def rate(self, time: ArrayLike) -> Array:
        """Body rate relative to inertial space, (n, 3), rad/s."""
        ...

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, (n, 3), rad."""
        ...

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude ``q_nb``, (n, 4)."""
        ...

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force in body axes, (n, 3), m/s²."""
        ...


@dataclass(frozen=True)
class Pulse:
    """A rate about one body axis over an interval, constant or with edges of a raised cosine.

    Attributes
    ----------
    axis : int
        0, 1, 2: forward, right, down.
    start, end : float, s
        The pulse acts on the half-open interval [start, end).
    rate : float, rad/s
        Between the edges.
    closed : bool
        Let a sample on `end` still read the rate. The motion is unchanged, but the samples then
        contain one pulse value too many: a test of the sampling error at an edge.
    edge : float, s
        Within the interval, at either end: the rate rises and falls as ``sin²``. Zero is a
        rectangle, half of the interval a haversine. The turn is ``rate (end - start - edge)``.
    """

    axis: int
    start: float
    end: float
    rate: float
    closed: bool = False
    edge: float = 0.0

    def shape(self, time: Array) -> tuple[Array, Array, Array]:
        """Share of the rate at each instant, its integral in s, and its derivative per s."""
        if not self.edge:
            acts = (time >= self.start) & ((time <= self.end) if self.closed else (time < self.end))
            return (
                acts.astype(np.float64),
                np.clip(time - self.start, 0.0, self.end - self.start),
                np.zeros(time.shape),
            )
        share, total, change = np.zeros((3, *time.shape))
        total[time >= self.end] = self.end - self.start - self.edge
        inside = (time > self.start) & (time < self.end)
        t = time[inside]
        for begin, sign in ((self.start, 1.0), (self.end - self.edge, -1.0)):
            x = np.clip((t - begin) / self.edge, 0.0, 1.0)
            beyond = np.maximum(t - begin - self.edge, 0.0)
            share[inside] += sign * np.sin(0.5 * np.pi * x) ** 2
            total[inside] += sign * (
                self.edge * (0.5 * x - np.sin(np.pi * x) / (2.0 * np.pi)) + beyond
            )
            change[inside] += sign * 0.5 * np.pi / self.edge * np.sin(np.pi * x)
        return share, total, change


@dataclass(frozen=True)
class PulseMotion(FlatMotion):
    """Any number of pulses, overlapping or not, from an initial attitude.

    Between the edges of rectangles the rate vector is constant in body axes, so the attitude is an
    exact product of exponentials. With edges of a raised cosine it is integrated as series over
    panels (`integrate_attitude`), to rounding as well.

    Attributes
    ----------
    pulses : tuple of Pulse
    duration : float, s
    q_nb : tuple of float
        Attitude at time zero, scalar first.
    arm : tuple of float, m
        From the fixed point about which the body turns (a shoulder, a steering column) to the
        sensor, in body axes. It needs edges: a rectangle has no angular acceleration.

    Raises
    ------
    ConfigError
        A pulse ends before its edges do, or an arm is given with a rectangle.
    """

    pulses: tuple[Pulse, ...]
    duration: float
    q_nb: Quaternion = (1.0, 0.0, 0.0, 0.0)
    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for p in self.pulses:
            if not 0.0 <= 2.0 * p.edge <= (p.end - p.start) * (1.0 + 1e-12):
                raise ConfigError(
                    "simulation.pulse-shorter-than-edges",
                    quantity="edge",
                    edge=p.edge,
                    length=p.end - p.start,
                    start=p.start,
                )
        if any(self.arm) and not all(p.edge for p in self.pulses):
            raise ConfigError("simulation.arm-without-edges", quantity="arm")

    def rate(self, time: ArrayLike) -> Array:
        """Body rate at each instant; (n, 3), rad/s."""
        return self._summed(time, 0)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero; (n, 3), rad."""
        return self._summed(time, 1)

    def moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `FlatMotion.moved`: of the end of the arm, from where it is at time zero."""
        if not any(self.arm):
            return super().moved(time)
        r, q = np.asarray(self.arm), self.attitude(time)
        omega = self.rate(time)
        swept = np.cross(omega, r)
        pulled = np.cross(self._summed(time, 2), r) + np.cross(omega, swept)
        start = rotation.rotate(np.asarray(self.q_nb, dtype=np.float64), r)
        return rotation.rotate(q, r) - start, rotation.rotate(q, swept), rotation.rotate(q, pulled)

    def _summed(self, time: ArrayLike, which: int) -> Array:
        t = np.asarray(time, dtype=np.float64)
        out = np.zeros((t.size, 3))
        for p in self.pulses:
            out[:, p.axis] += p.rate * p.shape(t)[which]
        return out

    @cached_property
    def _panels(self) -> AttitudeIntegral:
        within = (
            e for p in self.pulses for e in (p.start, p.start + p.edge, p.end - p.edge, p.end)
        )
        breaks = [0.0, *(e for e in within if 0.0 < e < self.duration), self.duration]
        return integrate_attitude(self.rate, breaks, self.q_nb)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

        Parameters
        ----------
        time : array_like, (n,), s
            Not negative.

        Returns
        -------
        ndarray, (n, 4)
            ``q_nb``, exact to the rounding of one product per edge or panel passed.
        """
        t = np.asarray(time, dtype=np.float64)
        if any(p.edge for p in self.pulses):
            return self._panels(t)
        edges = np.unique([0.0, *(e for p in self.pulses for e in (p.start, p.end))])
        # Evaluated at mid-interval, away from the edges.
        middle = np.append(0.5 * (edges[:-1] + edges[1:]), edges[-1] + 1.0)
        rates = PulseMotion(tuple(replace(p, closed=False) for p in self.pulses), 0.0).rate(middle)
        at_edge = [np.asarray(self.q_nb, dtype=np.float64)]
        for k, length in enumerate(np.diff(edges)):
            turn = rotation.quaternion_from_rotation_vector(rates[k] * length)
            at_edge.append(rotation.compose(at_edge[-1], turn))
        last = np.searchsorted(edges, t, side="right") - 1
        since = rates[last] * (t - edges[last])[:, None]
        return rotation.compose(
            np.array(at_edge)[last], rotation.quaternion_from_rotation_vector(since)
        )


def minimum_jerk(x: Array) -> tuple[Array, Array, Array]:
    """Unit move ``10 x³ - 15 x⁴ + 6 x⁵`` and its first two derivatives with respect to `x`.

    `x`: elapsed fraction of the move; at rest outside [0, 1]. Returns `value`, `first`, `second`:
    exactly 0, 0, 0 where ``x <= 0`` and exactly 1, 0, 0 where ``x >= 1``; all three are continuous.

    Flash and Hogan (1985), J. Neurosci. 5(7), 1688-1703: the move between two rests with the least
    mean square third derivative. Its largest rate is 15/8 of its mean rate.
    """
    x = np.clip(x, 0.0, 1.0)
    rest = 1.0 - x
    # In the second half, subtract the mirrored move from one, because the polynomial cancels there.
    y = np.minimum(x, rest)
    moved = y * y * y * (10.0 - y * (15.0 - 6.0 * y))
    return (
        np.where(x > 0.5, 1.0 - moved, moved),
        30.0 * (x * rest) ** 2,
        60.0 * x * rest * (rest - x),
    )


@dataclass(frozen=True)
class Track:
    """One coordinate that moves between values, with a stop at each.

    Attributes
    ----------
    times : tuple of float, s
        Increasing.
    values : tuple of float
        One per time, in any unit. Two equal neighbors are a rest; the first and the last value are
        held before and after.

    Raises
    ------
    ConfigError
        The track is empty, a number is not finite, or the times do not increase.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.times or len(self.times) != len(self.values):
            raise ConfigError(
                "simulation.times-values",
                quantity="track",
                count=len(self.times),
                count_2=len(self.values),
            )
        if not np.isfinite([*self.times, *self.values]).all():
            raise ConfigError("simulation.time-or-value-not-finite", quantity="track")
        falls = np.flatnonzero(np.diff(self.times) <= 0.0)
        if falls.size:
            k = int(falls[0])
            raise ConfigError(
                "simulation.does-not-come-after",
                quantity="track",
                times=self.times[k + 1],
                times_2=self.times[k],
            )

    def evaluate(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Value and its first two time derivatives.

        Returns `value`, `first`, `second` ((n,)): unit of the values, that per s and per s². At
        rest the value is bit-identical to the given one, and both derivatives are exactly zero.
        """
        t = np.asarray(time, dtype=np.float64)
        times, values = np.asarray(self.times), np.asarray(self.values)
        if len(times) == 1:
            return np.full(t.shape, values[0]), np.zeros(t.shape), np.zeros(t.shape)
        k = np.searchsorted(times, t, side="right") - 1
        # From the last time on use that value itself, not a rounded sum.
        ended = k == len(times) - 1
        k = np.clip(k, 0, len(times) - 2)
        length, change = np.diff(times)[k], np.diff(values)[k]
        part, first, second = minimum_jerk((t - times[k]) / length)
        value = np.where(ended, values[-1], values[k] + change * part)
        return value, change * first / length, change * second / (length * length)


#: A coordinate that is constantly zero.
STILL = Track((0.0,), (0.0,))


_NODES = 16
_X, _W = legendre.leggauss(_NODES)
# Rate at the nodes to Legendre coefficients: c_j = (2j + 1)/2 sum_i w_i P_j(x_i) f(x_i), exact for
# polynomials that 16 nodes determine.
_TO_COEFFICIENTS = (np.arange(_NODES) + 0.5)[:, None] * (
    legendre.legvander(_X, _NODES - 1) * _W[:, None]
).T
# Truncation error of the series within one panel, rad.
_TOLERANCE = 1e-14
# Shortest panel, s; below it rounding dominates the truncation error.
_SHORTEST = 1e-5
# Most panels, and most in each second, which follow 500 Hz. Of more, the rounding of the
# instants or of the phases is what is integrated.
_PANELS, _PANELS_PER_S = 10_000, 1000.0
# Panels that are evaluated together: some 100 MB.
_TOGETHER = 20_000


@dataclass(frozen=True)
class RateIntegral:
    """Integral of a rate as Legendre series over panels.

    Attributes
    ----------
    edges : ndarray, (p + 1,), s
    before : ndarray, (p, 3), rad
        Integral up to the left edge of each panel.
    series : ndarray, (p, 17, 3), rad
        Legendre coefficients of the integral within each panel.
    """

    edges: Array
    before: Array
    series: Array

    def __call__(self, time: ArrayLike) -> Array:
        """Integral from the first edge; constant beyond both ends; (n, 3), rad."""
        t = np.clip(np.asarray(time, dtype=np.float64), self.edges[0], self.edges[-1])
        out = np.empty((t.size, 3))
        legendre_sums(self.edges, self.before, self.series, t, out)
        return out


def integrate_rate(rate: Callable[[ArrayLike], Array], breaks: Sequence[float]) -> RateIntegral:
    """Integrate a piecewise smooth rate.

    `rate`: (n,) instants in s to (n, 3) rates in rad/s. `breaks` (s): instants where the rate or a
    derivative may jump; the first and the last are the ends.

    Sixteen Gauss-Legendre nodes per panel give the Legendre coefficients c_j of the rate. The
    integral of P_n over any part of a panel of half-length h is at most 2h/(2n+1), so the first
    omitted term contributes at most ``2h |c_16| / 33``. Where ``2h |c| / 29`` of the last two terms
    kept (two, because symmetry can make one vanish) exceeds 1e-14 rad, the panel is halved. c
    decreases geometrically for an analytic rate, and the integral over a whole panel is exact to
    degree 31. The sums over the panels are compensated. ConfigError: the rate changes too fast.
    """
    edges = np.unique(np.asarray(breaks, dtype=np.float64))
    left, right = edges[:-1], edges[1:]
    lefts, lengths, series = [], [], []
    length, done = float(edges[-1] - edges[0]), 0
    most = max(_PANELS + edges.size, _PANELS_PER_S * length)
    while left.size:
        if done + left.size > most:
            raise ConfigError("simulation.motion-too-fast", count=done + left.size, length=length)
        half = 0.5 * (right - left)
        c = np.empty((left.size, _NODES, 3))
        for k in range(0, left.size, _TOGETHER):
            some = slice(k, k + _TOGETHER)
            nodes = left[some, None] + half[some, None] * (1.0 + _X)
            c[some] = _TO_COEFFICIENTS @ rate(nodes.ravel()).reshape(-1, _NODES, 3)
        tail = np.abs(c[:, -2:]).max(axis=(1, 2))
        good = (2.0 * half * tail / (2 * _NODES - 3) <= _TOLERANCE) | (half < _SHORTEST)
        lefts.append(left[good])
        lengths.append(half[good])
        series.append(c[good])
        done += int(good.sum())
        middle = left[~good] + half[~good]
        left, right = np.concatenate([left[~good], middle]), np.concatenate([middle, right[~good]])
    order = np.argsort(np.concatenate(lefts))
    starts = np.concatenate(lefts)[order]
    half = np.concatenate(lengths)[order]
    rates = np.moveaxis(np.concatenate(series)[order], 1, 0)
    integrals = legendre.legint(rates, lbnd=-1, axis=0) * half[:, None]
    whole = 2.0 * half[:, None] * rates[0]
    return RateIntegral(
        np.append(starts, edges[-1]),
        _sums(whole),
        np.ascontiguousarray(np.moveaxis(integrals, 0, 1)),
    )


def _sums(terms: Array) -> Array:
    """Sum of all preceding terms, compensated (Neumaier 1974)."""
    out = np.zeros_like(terms)
    total, lost = np.zeros(3), np.zeros(3)
    for k in range(len(terms) - 1):
        term = terms[k]
        new = total + term
        lost += np.where(np.abs(total) >= np.abs(term), (total - new) + term, (term - new) + total)
        total = new
        out[k + 1] = total + lost
    return out


# Largest turn within a panel of an attitude, rad: its series in the turn ends below 1e-16 within
# the terms that are kept, and Picard's iteration with them.
_PANEL_TURN = 0.25
_ITERATIONS = 14


@dataclass(frozen=True)
class AttitudeIntegral:
    """Attitude as Legendre series over panels.

    Attributes
    ----------
    edges : ndarray, (p + 1,), s
    before : ndarray, (p, 4)
        Attitude at the left edge of each panel.
    series : ndarray, (p, 17, 4)
        Legendre coefficients of the turn since then, a quaternion.
    """

    edges: Array
    before: Array
    series: Array

    def __call__(self, time: ArrayLike) -> Array:
        """Attitude, (n, 4), continuous in sign; that of the last edge beyond it."""
        t = np.clip(np.asarray(time, dtype=np.float64), self.edges[0], self.edges[-1])
        panel = np.clip(np.searchsorted(self.edges, t, side="right") - 1, 0, len(self.before) - 1)
        left = self.edges[panel]
        x = 2.0 * (t - left) / (self.edges[panel + 1] - left) - 1.0
        turn = np.empty((t.size, 4))
        for start in range(0, t.size, 16384):  # so that the intermediate arrays stay small
            part = slice(start, start + 16384)
            vander = legendre.legvander(x[part], _NODES)
            turn[part] = np.einsum("nj,njk->nk", vander, self.series[panel[part]])
        q = rotation.compose(self.before[panel], turn)
        return np.asarray(q / np.linalg.norm(q, axis=1)[:, None])


def integrate_attitude(
    rate: Callable[[ArrayLike], Array], breaks: Sequence[float], q_nb: Quaternion
) -> AttitudeIntegral:
    """Integrate a piecewise smooth rate to an attitude, to rounding.

    `rate`: (n,) instants in s to (n, 3) rates in rad/s. `breaks` (s): instants where the rate or a
    derivative may jump; the first and the last are the ends. `q_nb`: attitude at the first.

    Each stretch between two breaks is cut into equal panels of at most `_PANEL_TURN`, and at least
    four. Within a panel ``q = 1 + int q omega / 2`` is iterated (Picard) at sixteen Gauss-Legendre
    nodes; the k-th iteration is exact to the k-th power of half the turn over k!.
    """
    corners = np.unique(np.asarray(breaks, dtype=np.float64))
    lengths = np.diff(corners)
    seen = corners[:-1, None] + lengths[:, None] * np.linspace(0.0, 1.0, 33)
    sizes = np.linalg.norm(rate(seen.ravel()), axis=1).reshape(seen.shape).max(axis=1)
    counts = np.maximum(4, np.ceil(sizes * lengths / _PANEL_TURN).astype(int))
    at = np.concatenate(
        [corners[:1]]
        + [
            np.linspace(left, right, count + 1)[1:]
            for (left, right), count in zip(itertools.pairwise(corners), counts, strict=True)
        ]
    )
    half = 0.5 * np.diff(at)
    nodes = at[:-1, None] + half[:, None] * (1.0 + _X)
    omega = rate(nodes.ravel()).reshape(len(half), _NODES, 3)
    one = np.array([1.0, 0.0, 0.0, 0.0])
    turn = np.broadcast_to(one, (len(half), _NODES, 4))
    for _ in range(_ITERATIONS):
        slope = np.empty(turn.shape)
        slope[..., 0] = -0.5 * (turn[..., 1:] * omega).sum(axis=-1)
        slope[..., 1:] = 0.5 * (turn[..., :1] * omega + np.cross(turn[..., 1:], omega))
        c = _TO_COEFFICIENTS @ slope
        integral = legendre.legint(np.moveaxis(c, 1, 0), lbnd=-1, axis=0) * half[:, None]
        series = np.moveaxis(integral, 0, 1)
        turn = one + legendre.legvander(_X, _NODES) @ series
    series = np.ascontiguousarray(series)
    series[:, 0, 0] += 1.0
    before = np.empty((len(half), 4))
    q = np.asarray(q_nb, dtype=np.float64)
    for k, whole in enumerate(series.sum(axis=1)):  # every polynomial is one at the right edge
        before[k] = q
        q = rotation.compose(q, whole)
        q = q / np.linalg.norm(q)
    return AttitudeIntegral(at, before, series)
