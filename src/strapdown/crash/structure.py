"""Structural motion of a measuring point against its vehicle, or a single error instead."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.measuring_point import PointKinematics, SampleEffects
from strapdown.errors import Finding
from strapdown.sensors.crash_unit import AXES
from strapdown.tables.checks import Array

#: Line of the error budget.
STRUCTURE = "structure"
#: Structure swings on for this long after the force that bends it, s.
MEMORY = 0.02
#: Correlation times of a structural velocity that are compared, s.
CORRELATION_TIMES = (0.003, 0.006, 0.012, 0.024)
#: Velocities of points of one car differ by up to a quarter of its change of velocity; most by
#: less than a twentieth. The prior of a share is half-normal with this standard deviation.
LARGEST_SHARE, USUAL_SHARE = 0.25, 0.1
SHARES = np.array([0.0, 0.003, 0.006, 0.01, 0.015, 0.022, 0.033, 0.05, 0.075, 0.11, 0.16, 0.25])
#: Beyond the stated turning of a vehicle without a gyro, as a multiple.
MORE_TURNING, USUAL_MORE = np.array([0.0, 0.7, 1.2, 1.7]), 0.7
ROUNDS = 3
#: Length of the increments of which the structural motion is learnt for bounds, s: as short as
#: the windows of answers. Shorter ones show how it rings, by which its slower part is taken to be
#: too small: of 360 drawn crashes the 95 % bounds of a change over 30 ms then held in 84 to 88 %,
#: with these in 92 to 94 %.
LEARNT_STEP = 0.01
#: Shares of which the posterior for bounds is computed.
EXPECTED_SHARES = np.concatenate([[0.0], np.geomspace(5e-4, LARGEST_SHARE, 40)])
#: Beyond this share of the largest the envelope counts as zero.
LEAST_SEEN = 0.05
#: Of the change of velocity: noise of an increment; below it no structure is looked for.
LEAST_SHARE = 1e-3
#: Relative to the largest: shapes smaller than this are neglected.
SMALL_SHAPE = 0.1
#: A larger share is reported: smaller ones are below the scale factor of a crash sensor.
LEAST_REPORTED = 0.01
#: A share is taken from this likelihood ratio (chi-square of one degree of freedom, 1 %).
SIGNIFICANT = 6.63
#: Step of the velocities by which the effects on samples are described, s.
KNOTS = 0.005
#: About the instant of the largest envelope, s: longer than a crash.
BEFORE_PEAK, AFTER_PEAK = 0.3, 0.6
#: Relative to the largest: smaller variances are rounding.
ROUNDING, TINY = 1e-12, 1e-300


@dataclass(frozen=True, eq=False)
class Structure:
    """Velocity of measuring points relative to the rigid body, a Gaussian process.

    Along a vehicle axis it has the standard deviation ``expected * change * w(t)`` and the
    correlation ``exp(-|t - s| / correlation_time)``; points and axes are independent. Its mean
    acceleration is zero: a point that stays a part of the vehicle has its velocity when the blow is
    over.

    Attributes
    ----------
    share : ndarray, (3,)
        Likeliest, of the change of velocity, forward, right, down, beside the stated uncertainty;
        zero where the records show none. Comparisons count it.
    squares : ndarray, (4, 3)
        Mean of the share's square by its posterior (`expected_squares`), the part of each of
        `CORRELATION_TIMES`; bounds count it. It does not depend on any stated uncertainty.
    correlation_time : float, s
        Of the likeliest share.
    change : float, m/s
        Change of velocity of the vehicle over the crash.
    turning : float
        Turning of a vehicle without a gyro that the differences show, as a multiple of the stated;
        1 where they show no more.
    time, envelope : ndarray, (n,), s and 1
        w, the force as a low-pass with the memory of 20 ms passes it, its largest value 1.
    """

    share: Array
    squares: Array
    correlation_time: float
    change: float
    time: Array = field(repr=False)
    envelope: Array = field(repr=False)
    turning: float = 1.0

    @property
    def felt(self) -> Array:
        """Instants, (k,), s, at which the structure moves: while the force acts, and just after."""
        if not self.time.size:
            return self.time
        since = self.time - self.time[int(np.argmax(self.envelope))]
        near = (since > -BEFORE_PEAK) & (since < AFTER_PEAK)
        return np.asarray(self.time[near & (self.envelope > LEAST_SEEN)])

    @property
    def expected(self) -> Array:
        """Root of the mean of the share's square along each vehicle axis, (3,)."""
        return np.asarray(np.sqrt(self.squares.sum(axis=0)))

    @property
    def expected_time(self) -> float:
        """Correlation time of what bounds count, s: mean weighted by the squares."""
        times = np.array(CORRELATION_TIMES)
        return float(times @ self.squares.sum(axis=1) / max(float(self.squares.sum()), TINY))

    @property
    def reported(self) -> bool:
        """Whether the motion is worth a word: beyond the stated uncertainty, or large."""
        return bool(self.share.any() or self.expected.max() > LEAST_REPORTED)

    @property
    def sd(self) -> Array:
        """Largest standard deviation along each vehicle axis, (3,), m/s, as bounds count it."""
        return self.expected * self.change

    def correlation(self, time: Array, correlation_time: float) -> Array:
        """Covariance of velocities at instants, (k, k), for a largest variance of one."""
        w = np.interp(time, self.time, self.envelope, left=0.0, right=0.0)
        apart = np.abs(time[:, None] - time)
        return np.asarray(w[:, None] * w * np.exp(-apart / correlation_time))

    def expected_covariances(self, time: Array) -> Array:
        """Covariance of velocities at instants as bounds count it, (3, k, k), (m/s)², by axis."""
        each = np.array([self.correlation(time, one) for one in CORRELATION_TIMES])
        return np.asarray(self.change**2 * np.einsum("ta,tij->aij", self.squares, each))

    def of_increments(self, edges: Array) -> Array:
        """Covariance of increments between edges, (m, m), for a largest variance of one."""
        step = np.diff(np.eye(len(edges)), axis=0)
        return np.asarray(step @ self.correlation(edges, self.correlation_time) @ step.T)

    def expected_of_increments(self, edges: Array) -> Array:
        """Covariance of increments, (m, m), (m/s)², along the axis that moves most."""
        step = np.diff(np.eye(len(edges)), axis=0)
        most = self.expected_covariances(edges)[int(np.argmax(self.expected))]
        return np.asarray(step @ most @ step.T)

    def of_turning(self, edges: Array, until: float) -> Array:
        """Covariance of increments of an angular rate, (m, m), 1/s², of a body without a gyro.

        The rate is a random walk that the force drives, of intensity ``w²``, so that it stays when
        the force ends; the rotation until `until`, s, has a standard deviation of 1.
        """
        time = self.time[self.time <= until]
        step = np.gradient(time)
        driven = np.cumsum(np.square(self.envelope[: len(time)]) * step)
        whole = 2.0 * float((driven * (until - time) * step).sum())
        passed = np.interp(edges, time, driven / max(whole, 1e-300), left=0.0)
        return np.diag(np.diff(passed))

    def within(self, unit: PointKinematics) -> PointKinematics:
        """A unit with this motion among its unknowns: of its point alone, common with no other.

        The velocities at knots of 5 ms, between which it is linear, are the unknowns, decorrelated
        by the Cholesky factor of their covariance.
        """
        felt = self.felt
        axes = np.flatnonzero(self.expected > 0.0)
        if not axes.size or felt.size < 2:
            return unit
        count = max(math.ceil((felt[-1] - felt[0]) / KNOTS), 1)
        knots = np.linspace(felt[0], felt[-1], count + 1)
        covariances = self.expected_covariances(knots)
        time = unit.time
        step = np.diff(time, prepend=2.0 * time[0] - time[1])
        before = time - step
        if unit.imu.attrs["sampling"] != "mean":
            before, time = before + 0.5 * step, time + 0.5 * step
        # Of a velocity of one at each knot.
        at = [
            np.column_stack(
                [np.interp(t, knots, one, left=0.0, right=0.0) for one in np.eye(count + 1)]
            )
            for t in (before, time)
        ]
        pushes = (at[1] - at[0]) / step[:, None]
        names, force = [], []
        for axis in axes:
            one = covariances[axis]
            root = np.linalg.cholesky(one + 1e-9 * one.max() * np.eye(len(knots)))
            names += [f"{unit.name} structure {AXES[axis]} {k}" for k in range(len(knots))]
            force.append((pushes @ root).T[:, :, None] * np.eye(3)[axis])
        return replace(unit, effects=_with(unit.effects, names, np.concatenate(force)))


def _with(effects: SampleEffects, names: Sequence[str], force: Array) -> SampleEffects:
    """Effects with more unknowns, of the force alone and not at rest."""
    none = np.zeros((len(names), 3))
    return replace(
        effects,
        names=(*effects.names, *names),
        contributors=(*effects.contributors, *[STRUCTURE] * len(names)),
        force=np.concatenate([effects.force, force]),
        rate=np.concatenate([effects.rate, np.zeros_like(force)]),
        rest_force=np.concatenate([effects.rest_force, none]),
        tilt=np.concatenate([effects.tilt, none]),
    )


def unlearnt(units: Sequence[PointKinematics]) -> Structure:
    """The process of a vehicle, its envelope and change of velocity by all units, without size."""
    first, last = max(u.time[0] for u in units), min(u.time[-1] for u in units)
    finest = min(units, key=lambda u: float(np.median(np.diff(u.time))))
    time = finest.time[(finest.time >= first) & (finest.time <= last)]
    sizes, changes = [], []
    for unit in units:
        free = (unit.force - unit.resting_force(STANDARD_GRAVITY)[0]) @ (
            np.eye(3) - unit.unmeasured
        )
        free = np.column_stack([np.interp(time, unit.time, column) for column in free.T])
        steps = np.gradient(time)
        gained = np.cumsum(free * steps[:, None], axis=0)
        changes.append(float(np.linalg.norm(gained, axis=1).max()))
        size = np.linalg.norm(free, axis=1)
        passed = np.zeros_like(size)
        for k in range(1, len(time)):
            kept = math.exp(-(time[k] - time[k - 1]) / MEMORY)
            passed[k] = kept * passed[k - 1] + (1.0 - kept) * size[k]
        sizes.append(passed)
    envelope = np.median(sizes, axis=0)
    largest = float(envelope.max())
    return Structure(
        np.zeros(3),
        np.zeros((len(CORRELATION_TIMES), 3)),
        CORRELATION_TIMES[0],
        float(np.median(changes)),
        time,
        envelope / largest if largest > 0.0 else envelope,
    )


def learn_share(
    structure: Structure,
    edges: Array,
    kept: NDArray[np.bool_],
    difference: Array,
    covariance: Array,
    turning: Array | None = None,
) -> Structure:
    """The shares and the correlation time that make the differences of units likeliest.

    `difference`, (k, 3 m), m/s: of the velocity increments of k units less those of another, over
    the `kept` of the intervals between `edges`; `covariance`, (3 k m, 3 k m): by the sensors and
    all that is stated; `turning`, of the same shape, by a turning without a gyro as large as stated
    (`of_turning`). Largest posterior of Gaussian differences. A share is zero, and the turning as
    large as stated, unless another is significantly likelier.
    """
    of_turning = [] if turning is None else [(_root(turning), MORE_TURNING, USUAL_MORE)]
    best: tuple[float, Structure] | None = None
    for correlation_time in CORRELATION_TIMES:
        one = replace(structure, correlation_time=correlation_time)
        along = structural_unknowns(one, edges, kept, len(difference))
        found, cost = likeliest([*along, *of_turning], difference.ravel(), covariance)
        if best is None or cost < best[0]:
            more = float(found[3]) if turning is not None else 0.0
            best = (
                cost,
                replace(one, share=found[:3], turning=math.hypot(1.0, more)),
            )
    assert best is not None
    return best[1]


def structural_unknowns(
    structure: Structure, edges: Array, kept: NDArray[np.bool_], count: int
) -> list[tuple[Array, Array, float]]:
    """The shares along the three axes as unknowns of `likeliest`, of `count` units less another."""
    # The point of the other unit moves in every difference.
    both = np.linalg.cholesky(np.eye(count) + 1.0)
    own = structure.change**2 * structure.of_increments(edges)[np.ix_(kept, kept)]
    root = np.kron(both, _root(own))
    roots = [np.asarray(np.kron(root, e[:, None]), dtype=np.float64) for e in np.eye(3)]
    return [(one, SHARES, USUAL_SHARE) for one in roots]


def _root(covariance: Array) -> Array:
    """Columns, (d, r), whose product with their transpose is a covariance of rank r."""
    values, vectors = np.linalg.eigh(covariance)
    seen = values > ROUNDING * max(float(values.max(initial=0.0)), 0.0)
    return np.asarray(vectors[:, seen] * np.sqrt(values[seen]))


def likeliest(
    unknowns: Sequence[tuple[Array, Array, float]], difference: Array, covariance: Array
) -> tuple[Array, float]:
    """Sizes of covariances that add to another, by coordinate search, and the cost.

    `unknowns`: the root of the covariance of size one, (d, r), the sizes to try, from zero, and the
    standard deviation of the half-normal prior of each. The cost is twice the negative logarithm of
    the posterior.
    """
    from scipy.linalg import solve_triangular

    sizes = np.zeros(len(unknowns))
    if not difference.size:
        return sizes, 0.0
    squares = [root @ root.T for root, _, _ in unknowns]

    def costs(k: int) -> Array:
        """With each size of the grid for one unknown, the others as they are.

        Determinant and inverse of ``S + x² G Gᵀ`` by the eigenvalues of ``Gᵀ S⁻¹ G``.
        """
        others = covariance + sum(
            x**2 * square
            for j, (x, square) in enumerate(zip(sizes, squares, strict=True))
            if j != k
        )
        root, sizes_tried, sd = unknowns[k]
        factor = np.linalg.cholesky(others)
        left = solve_triangular(factor, np.column_stack([difference, root]), lower=True)
        values, vectors = np.linalg.eigh(left[:, 1:].T @ left[:, 1:])
        grid = np.square(sizes_tried)[:, None]
        grown = 1.0 + grid * np.maximum(values, 0.0)
        along = np.square(vectors.T @ (left[:, 1:].T @ left[:, 0]))
        logarithm = 2.0 * np.log(np.diagonal(factor)).sum() + np.log(grown).sum(axis=1)
        square = left[:, 0] @ left[:, 0] - (grid / grown) @ along
        prior = sum(
            (x / s) ** 2
            for j, (x, (_, _, s)) in enumerate(zip(sizes, unknowns, strict=True))
            if j != k
        )
        return np.asarray(logarithm + square + prior + (sizes_tried / sd) ** 2)

    least = math.inf
    for _ in range(ROUNDS):
        before = sizes.copy()
        for k, (_, grid, _) in enumerate(unknowns):
            tried = costs(k)
            j = int(np.argmin(tried))
            j = j if tried[0] - tried[j] > SIGNIFICANT else 0
            sizes[k], least = grid[j], float(tried[j])
        if np.array_equal(sizes, before):
            break
    return sizes, least


# Size of the structural motion as bounds count it: of all that may have made the differences.


@dataclass(frozen=True, eq=False)
class PointContrasts:
    """Differences of the velocity increments of several points, over the m intervals in use.

    `edges`, (n + 1,), s. `kept`, (n,): m of them. `values`, (j, m), m/s: along each vehicle axis,
    orthonormal contrasts of the points that measure it: independent of each other, with the
    structural variance of one point. None or more. `shapes`, (m, q): by which errors of the
    recorders and the turning of the vehicle change the increments.
    """

    edges: Array
    kept: NDArray[np.bool_]
    values: Sequence[Array]
    shapes: Array


def expected_squares(structure: Structure, contrasts: PointContrasts) -> Array:
    """Mean of the square of the share by its posterior, (4, 3), the part of each correlation time.

    The share is learnt from the part of the differences that no combination of the `shapes`
    explains, however large it may be: the restricted likelihood (Patterson and Thompson, Biometrika
    58, 1971, 545). A stated uncertainty changes sizes, never the shapes: one that is stated larger
    takes nothing from the structure, and bounds, to which both add, grow with it. Joint posterior
    of the three shares and their correlation time, by integration over grids; priors: half-normal
    with `USUAL_SHARE`, and equal for the correlation times. Where the differences show little, the
    mean is that of the prior; an axis without contrasts has none.
    """
    out = np.zeros((len(CORRELATION_TIMES), 3))
    kept = contrasts.kept
    # Orthonormal rows across all shapes, (r, m).
    vectors, sizes, _ = np.linalg.svd(contrasts.shapes)
    free = vectors[:, int((sizes > ROUNDING * sizes.max(initial=0.0)).sum()) :].T
    along = [axis for axis, one in enumerate(contrasts.values) if one.size]
    if not along or not structure.change > 0.0:
        return out
    grid = EXPECTED_SHARES
    prior = -0.5 * np.square(grid / USUAL_SHARE)
    evidence = np.zeros(len(CORRELATION_TIMES))
    for k, correlation_time in enumerate(CORRELATION_TIMES):
        one = replace(structure, correlation_time=correlation_time)
        own = one.of_increments(contrasts.edges)[np.ix_(kept, kept)]
        values, axes = np.linalg.eigh(free @ own @ free.T)
        variances = np.square(LEAST_SHARE) + np.outer(np.square(grid), np.maximum(values, 0.0))
        for axis in along:
            seen = contrasts.values[axis] @ free.T @ axes / structure.change
            cost = len(seen) * np.log(variances).sum(axis=1)
            cost += (np.square(seen).sum(axis=0) / variances).sum(axis=1)
            likely = prior - 0.5 * cost
            largest = float(likely.max())
            likely = np.exp(likely - largest)
            whole = float(np.trapezoid(likely, grid))
            evidence[k] += largest + math.log(whole)
            out[k, axis] = np.trapezoid(likely * np.square(grid), grid) / whole
    weights = np.exp(evidence - evidence.max())
    return np.asarray(out * (weights / weights.sum())[:, None])


# Single error of one of two measuring points that would explain how they differ.


OFF_SCALE, OFF_POSITION, OFF_MOUNTING = (
    f"crash.off-{what}" for what in ("scale", "position", "mounting")
)
#: Standard deviations that are tried, zero first: of a scale factor, in m and rad.
SIZES: Mapping[str, Array] = {
    OFF_SCALE: np.array([0.0, 0.05, 0.1, 0.2, 0.4]),
    OFF_POSITION: np.array([0.0, 0.1, 0.2, 0.4, 0.8]),
    OFF_MOUNTING: np.radians([0.0, 3.0, 6.0, 12.0, 24.0]),
}


_QUANTITY = {
    OFF_SCALE: "scale factor",
    OFF_POSITION: "position",
    OFF_MOUNTING: "mounting angles",
}


@dataclass(frozen=True, eq=False)
class SingleError:
    """An error that makes the differences of two points likelier than their structure does.

    `code`: a key of `SIZES`. `size`, (r,): its conditional mean, first point less second: of the
    scale factor along the force; of the position, true less stated, m; rotation of the second into
    the first, rad. `lead`: twice the logarithm of the odds against structure alone.
    """

    code: str
    size: Array
    lead: float

    def finding(self, first: str, second: str) -> Finding:
        """The error as a finding on the second point."""
        shown = {OFF_SCALE: 100.0, OFF_MOUNTING: 180.0 / math.pi}
        x, y, z = (float(v) for v in np.resize(shown.get(self.code, 1.0) * self.size, 3))
        return Finding(
            "crash.one-point-off",
            file=second,
            quantity=_QUANTITY[self.code],
            first=first,
            error=Finding(self.code, severity="note", x=x, y=y, z=z),
            odds=float(np.exp(0.5 * min(self.lead, 1000.0))),
        )


def single_error(
    effects: Mapping[str, Array],
    structure: Structure,
    edges: Array,
    kept: NDArray[np.bool_],
    difference: Array,
    covariance: Array,
    level: float,
) -> SingleError | None:
    """The likeliest error of `effects` if it explains a difference much better than structure.

    Parameters
    ----------
    effects : mapping of ndarray, (3 m, r)
        Effect of a unit of each error on the difference, by the keys of `SIZES`.
    structure : Structure
        As learnt without an error; its correlation time is kept, its shares are learnt anew.
    edges, kept, difference, covariance
        As `learn_share`, of one pair.
    level : float
        The error is reported if the odds of structure alone against it are below this.

    Notes
    -----
    A chi-square of all differences dilutes a single error: with 60 degrees of freedom one of 6.3
    standard deviations has a probability of 1e-3. Here each error is one more Gaussian unknown
    whose size is estimated beside the structure's: the ratio of the two posteriors decides from
    about 4 standard deviations on, and does not let structure absorb the error. A late clock
    is not among them: it makes the difference of a hump, as structure does.
    """
    unknowns = structural_unknowns(structure, edges, kept, 1)
    _, alone = likeliest(unknowns, difference, covariance)
    best: SingleError | None = None
    for code, effect in effects.items():
        tried = [(effect, SIZES[code], np.inf), *unknowns]
        sizes, cost = likeliest(tried, difference, covariance)
        lead = alone - cost
        if sizes[0] == 0.0 or lead < (-2.0 * math.log(level) if best is None else best.lead):
            continue
        whole = covariance + sum(
            x**2 * root @ root.T for x, (root, _, _) in zip(sizes, tried, strict=True)
        )
        size = sizes[0] ** 2 * effect.T @ np.linalg.solve(whole, difference)
        best = SingleError(code, np.asarray(size), float(lead))
    return best
