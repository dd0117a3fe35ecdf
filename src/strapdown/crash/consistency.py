"""Consistency of units on one vehicle: delta-V, mounting, lever arm and axes at one point."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY, Flags
from strapdown.crash.acceleration import window_weights
from strapdown.crash.measuring_point import LEVER_ARM, MOUNTING, NO_TURNING, PointKinematics
from strapdown.crash.structure import (
    LARGEST_SHARE,
    LEARNT_STEP,
    MORE_TURNING,
    OFF_MOUNTING,
    OFF_POSITION,
    OFF_SCALE,
    SMALL_SHAPE,
    PointContrasts,
    Structure,
    expected_squares,
    learn_share,
    single_error,
    unlearnt,
)
from strapdown.dsp.chi_square import chi_square_above
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.inference.rotation_rate import signed_permutations
from strapdown.sensors.crash_unit import NO_GYRO
from strapdown.tables.checks import Array

# Relative to the largest variance: smaller covariances are rounding.
FLOOR, TINY = 1e-12, 1e-30


@dataclass(frozen=True, eq=False)
class VelocityIncrements:
    """Integrals of a unit's specific force and rates over m intervals; rows by interval, then axis.

    `values`, (m, 3), m/s, and `turned`, (m, 3), rad, between `edges`, (m + 1,), s; the effect of
    one standard deviation of each of p unknowns on them, (3 m, p); `lever`, (3 m, 3), 1/s: effect
    of a position error (true minus stated) on the values. `force_noise`, (3 m, 3 m), (m/s)²:
    covariance from accelerometer noise. `arm_noise`, m/s, and `turned_noise`, rad, (3 m, q): effect
    of one standard deviation of each of q independent numbers, the gyro noise, on the values
    through the lever arm and on the rotation; `slopes`, (3 m, p + q), rad/s: effect of the unknowns
    and of these numbers on the changes of rate of which `lever` consists. Units that borrow a
    `gyro` have the same numbers.
    """

    edges: Array
    values: Array
    turned: Array
    names: tuple[str, ...]
    contributors: tuple[str, ...]
    effects: Array
    turned_effects: Array
    lever: Array
    force_noise: Array
    arm_noise: Array
    turned_noise: Array
    slopes: Array
    gyro: str

    def of_pieces(self, kept: NDArray[np.bool_]) -> VelocityIncrements:
        """Select some of the intervals, (m,); the edges remain those of all."""
        if kept.all():
            return self
        rows = np.repeat(kept, 3)
        return replace(
            self,
            values=self.values[kept],
            turned=self.turned[kept],
            effects=self.effects[rows],
            turned_effects=self.turned_effects[rows],
            lever=self.lever[rows],
            force_noise=self.force_noise[np.ix_(rows, rows)],
            arm_noise=self.arm_noise[rows],
            turned_noise=self.turned_noise[rows],
            slopes=self.slopes[rows],
        )

    def bent_by(self, structure: Structure, kept: NDArray[np.bool_]) -> VelocityIncrements:
        """With the structural motion of the unit's point, over the `kept` of all intervals."""
        if not structure.share.any():
            return self
        own = structure.of_increments(self.edges)[np.ix_(kept, kept)]
        size = structure.share * structure.change
        return replace(self, force_noise=self.force_noise + np.kron(own, np.diag(size**2)))

    def borrows(self, other: VelocityIncrements) -> bool:
        """Whether both share one gyro, so that their rates agree by construction."""
        return self.gyro == other.gyro


def joint_covariance(
    increments: Sequence[VelocityIncrements], *, of: str = "force", without: Collection[str] = ()
) -> Array:
    """Covariance, (3 m k, 3 m k), of the increments of k units together, between the same edges.

    Unknowns of the same name are one unknown, and the noise of a gyro that several units borrow is
    common, as far as they use the same samples. `of` is ``force`` or ``rate``; `without`:
    contributors to leave out.
    """
    columns: dict[str, int] = {}
    gyros: dict[tuple[str, int], list[int]] = {}
    for k, unit in enumerate(increments):
        for name, contributor in zip(unit.names, unit.contributors, strict=True):
            if contributor not in without:
                columns.setdefault(name, len(columns))
        gyros.setdefault((unit.gyro, unit.turned_noise.shape[1]), []).append(k)
    size = increments[0].values.size
    spread = np.zeros((len(increments), size, len(columns)))
    out = np.zeros((len(increments), size, len(increments), size))
    for k, unit in enumerate(increments):
        kept = [i for i, c in enumerate(unit.contributors) if c not in without]
        given = unit.effects if of == "force" else unit.turned_effects
        spread[k][:, [columns[unit.names[i]] for i in kept]] = given[:, kept]
        if of == "force":
            out[k, :, k] += unit.force_noise
    for of_one in gyros.values():
        for i in of_one:
            for j in of_one:
                one, other = increments[i], increments[j]
                if of == "force":
                    out[i, :, j] += one.arm_noise @ other.arm_noise.T
                else:
                    out[i, :, j] += one.turned_noise @ other.turned_noise.T
    whole = len(increments) * size
    flat = spread.reshape(whole, -1)
    return np.asarray(out.reshape(whole, whole) + flat @ flat.T)


def difference_covariance(
    first: VelocityIncrements,
    second: VelocityIncrements,
    *,
    of: str = "force",
    without: Collection[str] = (),
    turn: Array | None = None,
) -> Array:
    """Covariance, (..., 3 m, 3 m), of the increments of one unit minus those of another.

    Common errors cancel. `of`, `without` as `joint_covariance`; `turn`, (..., 3, 3): rotation
    applied to the increments of the second unit.
    """
    size, pieces = first.values.size, len(first.values)
    turned = np.eye(3) if turn is None else turn
    blocks = np.einsum("ab,...ij->...aibj", np.eye(pieces), turned)
    blocks = blocks.reshape(*turned.shape[:-2], size, size)
    back = np.swapaxes(blocks, -1, -2)
    both = joint_covariance((first, second), of=of, without=without)
    mixed = both[:size, size:] @ back
    out = both[:size, :size] + blocks @ both[size:, size:] @ back
    out = out - mixed - np.swapaxes(mixed, -1, -2)
    return np.asarray(0.5 * (out + np.swapaxes(out, -1, -2)))


def floored(covariance: Array) -> Array:
    """Make covariances, (..., k, k), invertible: raised by the rounding of the largest variance."""
    largest = float(np.diagonal(covariance, axis1=-2, axis2=-1).max())
    return np.asarray(covariance + max(FLOOR * largest, TINY) * np.eye(covariance.shape[-1]))


#: Intervals of a comparison, at most, and the probability below which it is a disagreement.
PIECES, LEVEL = 20, 1e-3


def common_edges(units: Sequence[PointKinematics]) -> Array:
    """Edges of equal intervals over the crash, as far as all units cover it.

    `DataError`: the units do not cover it. `ConfigError`: an interval is shorter than two samples.
    """
    if len(units) < 2:
        raise DataError("crash.unit-comparison-needs-two", quantity="units", count=len(units))
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    # A unit without a gyro does not know the turning after the time of its assumption.
    known = [u.assumed_until for u in units]
    start, end = max(first, -0.1), min(last, 0.75, *known)
    if not first <= start < end <= last:
        begins = next(u.name for u in units if u.time[0] == first)
        ends = next(u.name for u in units if u.time[-1] == last)
        raise DataError(
            "crash.share-does-not-cover-begins",
            quantity="window",
            units=[u.name for u in units],
            first=first,
            last=last,
            wanted=-0.1,
            wanted_2=0.75,
            begins=begins,
            ends=ends,
        )
    coarsest = max(float(np.median(np.diff(u.time))) for u in units)
    most = int((end - start) / (2.0 * coarsest))
    if most < 3:
        raise ConfigError(
            "crash.steps-cannot-cut-into-three",
            quantity="window",
            end=end - start,
            coarsest=coarsest,
        )
    return np.linspace(start, end, min(PIECES, most) + 1)


def velocity_increments(unit: PointKinematics, edges: Array) -> VelocityIncrements:
    """Integrate a unit's specific force and rates between edges, (m + 1,), s, in body axes."""
    sampling = str(unit.imu.attrs["sampling"])
    weights = np.array(
        [window_weights(unit.time, *piece, sampling) for piece in itertools.pairwise(edges)]
    )
    effects, size = unit.effects, 3 * len(weights)
    within = weights.any(axis=0)
    few = weights[:, within]
    if unit.moved is None:
        lever = np.zeros((size, 3))
    else:
        lever = np.einsum("an,nik->aik", few, unit.moved.lever[within]).reshape(size, 3)
    return VelocityIncrements(
        edges,
        weights @ unit.force,
        weights @ unit.rate,
        effects.names,
        effects.contributors,
        np.einsum("an,pni->aip", few, effects.force[:, within], optimize=True).reshape(size, -1),
        np.einsum("an,pni->aip", few, effects.rate[:, within], optimize=True).reshape(size, -1),
        lever,
        *_noise(unit, weights),
        unit.gyro,
    )


def _noise(unit: PointKinematics, weights: Array) -> tuple[Array, Array, Array, Array]:
    """Effect of the sample noise on sums with weights, (m, n), s: the four of the increments.

    Gyro noise through the lever arm keeps its correlation from sample to sample: it nearly cancels
    in a change of velocity.
    """
    m = len(weights)
    prepared, moved, effects = unit.prepared, unit.moved, unit.effects
    # Samples with weight in a sum, and those used for their angular acceleration.
    used = np.flatnonzero(weights.any(axis=0))
    wide = 0 if moved is None else moved.slope.slope.shape[1]
    within = slice(0)
    if used.size:
        within = slice(max(int(used[0]) - wide, 0), int(used[-1]) + wide + 1)
    few = weights[:, within]
    if prepared is None or moved is None:
        own = _diagonal(effects.force_noise[within])
        turning = _root(_diagonal(effects.rate_noise[within]))
    else:
        own = prepared.noise_covariance[within]
        turning = _root(prepared.gyro_noise_covariance[within])
    blocks = np.einsum("an,nij,bn->aibj", few, own, few, optimize=True)
    turned = np.einsum("an,nik->aink", few, turning).reshape(3 * m, -1)
    arm = np.zeros_like(turned)
    slopes = np.zeros((3 * m, len(effects.names) + turned.shape[1]))
    if moved is not None:
        by_slope = moved.slope.weighted(weights)[0][:, within]
        slopes = np.hstack(
            [
                np.einsum("an,pni->aip", by_slope, effects.rate[:, within]).reshape(3 * m, -1),
                np.einsum("an,nik->aink", by_slope, turning).reshape(3 * m, -1),
            ]
        )
        if moved.lever_arm.any():
            by_rate = moved.of_rates_in_sums(weights)[:, within]
            arm = np.einsum("anij,njk->aink", by_rate, turning).reshape(3 * m, -1)
    return blocks.reshape(3 * m, 3 * m), arm, turned, slopes


def _diagonal(sd: Array) -> Array:
    return np.asarray(sd[:, :, None] ** 2 * np.eye(3))


def _root(covariances: Array) -> Array:
    """Matrices whose product with their transpose is the covariance of each sample."""
    values, vectors = np.linalg.eigh(covariances)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])


def chi_square_tail(chi_square: float, freedom: int) -> float:
    """Probability of a chi-square at least this large; `freedom` may be zero."""
    return float(chi_square_above(max(chi_square, 0.0), freedom)) if freedom else 1.0


# Relative mounting of two units on one vehicle: rotation, lever arm, swapped axes.


SIGMAS = 4.0
ROUNDS = 3
# The mounting rotation is the estimated quantity, so its prior uncertainty is excluded.
_TURN = (MOUNTING,)
# Directions with a larger standard deviation count as unknown.
MOST_SD = 0.2  # rad


@dataclass(frozen=True, eq=False)
class MountingRotation:
    """Rotation from the axes of the second unit to those of the first.

    `matrix`, (3, 3); `vector_deg`, (3,), the same as a rotation vector; `covariance`, (3, 3), rad²,
    of a small rotation about the axes of the first unit, with a variance of pi² for unobserved
    directions. `misfit`: root of the residuals' chi-square over its degrees of freedom; where it
    exceeds one, the covariance has been multiplied by its square.
    """

    matrix: Array
    vector_deg: Array
    covariance: Array
    misfit: float

    @classmethod
    def untold(cls) -> MountingRotation:
        """Return the result where the rotation is not observable."""
        return cls(np.eye(3), np.zeros(3), np.pi**2 * np.eye(3), 0.0)

    @property
    def sd_deg(self) -> Array:
        """Standard deviation about each axis of the first unit, (3,), deg."""
        return np.asarray(np.degrees(np.sqrt(np.diag(self.covariance))), dtype=np.float64)


def mounting_rotation(first: VelocityIncrements, second: VelocityIncrements) -> MountingRotation:
    """Estimate the rotation between two units from forces and rates between the same edges.

    Least squares (Wahba 1965, doi:10.1137/1007077) by singular values (Markley 1988, J. Astronaut.
    Sci. 36, 245), forces and rates weighted by their stated variances; then Gauss-Newton steps with
    the full covariances, since a bias is common to all intervals. Rates of a shared gyro are left
    out.
    """
    C = _wahba(first, second)
    normal, step, square = np.eye(3), np.zeros(3), 0.0
    for _ in range(ROUNDS):
        normal, step, square = _refine(first, second, C)
        C = rotation.dcm_from_rotation_vector(step) @ C
    size = first.values.size + (0 if first.borrows(second) else first.turned.size)
    misfit = float(np.sqrt(max(square, 0.0) / (size - 3)))
    values, vectors = np.linalg.eigh(normal)
    variances = np.minimum(max(1.0, misfit) ** 2 / np.maximum(values, 1e-12), np.pi**2)
    return MountingRotation(
        C,
        np.degrees(rotation.rotation_vector_from_dcm(C)),
        np.asarray((vectors * variances) @ vectors.T),
        misfit,
    )


def _observed(
    first: VelocityIncrements, second: VelocityIncrements
) -> list[tuple[Array, Array, str]]:
    """Return forces, and rates unless both units share one gyro."""
    rates = [] if first.borrows(second) else [(first.turned, second.turned, "rate")]
    return [(first.values, second.values, "force"), *rates]


def _wahba(first: VelocityIncrements, second: VelocityIncrements) -> Array:
    """Least-squares rotation with one variance for each kind of vector."""
    product = np.zeros((3, 3))
    for a, b, of in _observed(first, second):
        variance = float(np.trace(difference_covariance(first, second, of=of, without=_TURN)))
        product += a.T @ b / max(variance / a.size, TINY)
    u, _, vt = np.linalg.svd(product)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _refine(
    first: VelocityIncrements, second: VelocityIncrements, C: Array
) -> tuple[Array, Array, float]:
    """Normal matrix, small rotation and chi-square of the residuals, with full covariances."""
    normal, right, square = np.zeros((3, 3)), np.zeros(3), 0.0
    for a, b, of in _observed(first, second):
        turned = b @ C.T
        covariance = floored(difference_covariance(first, second, of=of, without=_TURN, turn=C))
        # (1 + [φ×]) v = v - [v×] φ.
        effect, left = -rotation.cross_matrix(turned).reshape(-1, 3), (a - turned).ravel()
        weighed = np.linalg.solve(covariance, np.column_stack([effect, left]))
        normal += effect.T @ weighed[:, :3]
        right += effect.T @ weighed[:, 3]
        square += float(left @ weighed[:, 3])
    step = np.linalg.lstsq(normal, right, rcond=1e-9)[0]
    return normal, np.asarray(step, dtype=np.float64), square - float(right @ step)


def rotation_findings(
    found: MountingRotation, stated_sd: float, first: str, second: str
) -> list[Finding]:
    """Report a rotation between the units beyond four standard deviations.

    `stated_sd`, rad: stated standard deviation of each angle between the two.
    """
    vector = np.radians(found.vector_deg)
    values, vectors = np.linalg.eigh(found.covariance)
    along = vectors.T @ vector
    told = np.sqrt(values) < MOST_SD
    ratio = np.abs(along) / np.sqrt(values + stated_sd**2)
    if not (told & (ratio > SIGMAS)).any():
        return []
    x, y, z = found.vector_deg
    sd = found.sd_deg
    return [
        Finding(
            "crash.turned-against-about-forward-right",
            file=second,
            quantity="mounting angles",
            first=first,
            x=x,
            y=y,
            z=z,
            sd=sd[0],
            sd_2=sd[1],
            sd_3=sd[2],
            stated_sd_deg=np.degrees(stated_sd),
        )
    ]


# Lever arm between two units, from the difference of their forces while the vehicle turns.

# Directions with a larger standard deviation count as unobserved.
MOST_ARM_SD = 0.1  # m
# So many intervals before and after one in which a body turns alike.
TURNS_ALIKE = 2


@dataclass(frozen=True, eq=False)
class LeverArmCheck:
    """Correction of the stated lever arm between two units.

    `correction`, (3,), m, vehicle axes, to be added to the position of the first minus that of the
    second; meaningful along the columns of `directions`, (3, 3), that are `told`: with an `sd`
    below 0.1 m. `misfit` as `MountingRotation`, applied to the sds.
    """

    correction: Array
    directions: Array
    sd: Array
    told: NDArray[np.bool_]
    misfit: float

    @classmethod
    def untold(cls) -> LeverArmCheck:
        """Return the result where the lever arm is not observable."""
        return cls(np.zeros(3), np.eye(3), np.full(3, np.inf), np.zeros(3, dtype=bool), 0.0)


@dataclass(frozen=True, eq=False)
class Turning:
    """Lever arms as determined by the rates of one body, measured by several units.

    `lever`, (3 m, 3), 1/s: effect of a position error on the increments, without the errors of the
    rates. `shift`, (3 m,), m/s, and `known`, (3 m, 3 m), (m/s)²: mean and covariance of the part of
    the difference of the increments, first unit less second, that these errors make by the stated
    lever arms, as far as the rates show it: both are to be subtracted.
    """

    lever: Array
    shift: Array
    known: Array


def body_turning(increments: Sequence[VelocityIncrements]) -> Turning | None:
    """Estimate the turning of the body of one or two units; None without rates.

    Errors of the angular acceleration times the stated lever arm are in the difference of two
    units, and times the position error in its effect. Where a body hardly turns both are errors,
    and the same: the difference is exactly that of units that are not apart. So the changes of rate
    δ between the edges count as white of a variance by their mean square over neighboring intervals
    less that of their errors, plus these. The conditional mean of the true δ given the measured one
    makes the lever, and the difference less its own conditional mean is independent of it.
    """
    seen = [v for v in increments if v.lever.any()]
    if not seen:
        return None
    lever = np.mean([v.lever for v in seen], axis=0).reshape(-1, 3, 3)
    across = 0.5 * (lever - np.swapaxes(lever, 1, 2))
    change = across[:, [2, 0, 1], [1, 2, 0]].ravel()
    shared: dict[object, Array] = {}
    for v, sign in zip(increments, (1.0, -1.0), strict=False):
        share = 1.0 / len(seen) if v.lever.any() else 0.0
        both = np.stack([share * v.slopes, sign * np.hstack([v.effects, v.arm_noise])], axis=2)
        names = len(v.names)
        parts = dict(zip(v.names, both[:, :names].transpose(1, 0, 2), strict=True))
        numbers = both[:, names:].transpose(1, 0, 2)
        for key, one in (*parts.items(), ((v.gyro, len(numbers)), numbers)):
            shared[key] = shared[key] + one if key in shared else one
    columns = np.concatenate([v.reshape(-1, change.size, 2) for v in shared.values()])
    slope, arm = columns.transpose(2, 1, 0)
    noise = slope @ slope.T
    power = (np.square(change) - np.diag(noise)).reshape(-1, 3)
    number = np.arange(len(power))
    near = np.abs(number[:, None] - number) <= TURNS_ALIKE
    true = np.maximum(near @ power / near.sum(axis=1, keepdims=True), 0.0).ravel()
    weighed = np.linalg.solve(
        floored(np.diag(true) + noise), np.column_stack([change, slope @ arm.T])
    )
    turned = rotation.cross_matrix((true * weighed[:, 0]).reshape(-1, 3))
    return Turning(
        (lever - across + turned).reshape(-1, 3),
        arm @ (slope.T @ weighed[:, 0]),
        arm @ (slope.T @ weighed[:, 1:]),
    )


def check_lever_arm(
    first: VelocityIncrements, second: VelocityIncrements, turning: Turning | None
) -> LeverArmCheck:
    """Estimate the error of the stated relative position of two units, moved to one point.

    Position errors e₁ and e₂ (true minus stated) differ by ``([α×] + [ω×]²) (e₁ - e₂)``:
    generalized least squares, with noise and all unknowns but the positions as covariance. The
    component along a fixed axis of rotation is not observable; the normal matrix shows which
    directions are. `turning`: of their body.
    """
    if turning is None:
        return LeverArmCheck.untold()
    lever = turning.lever
    difference = (first.values - second.values).ravel() - turning.shift
    covariance = difference_covariance(first, second, without=(LEVER_ARM,)) - turning.known
    covariance = floored(covariance)
    weighed = np.linalg.solve(covariance, np.column_stack([lever, difference]))
    normal = lever.T @ weighed[:, :3]
    values, vectors = np.linalg.eigh(0.5 * (normal + normal.T))
    values, vectors = values[::-1], vectors[:, ::-1]
    seen = values > 1e-9 * max(float(values[0]), 1e-30)
    along = np.where(seen, vectors.T @ (lever.T @ weighed[:, 3]) / np.where(seen, values, 1.0), 0.0)
    correction = vectors @ along
    left = difference - lever @ correction
    freedom = max(left.size - int(seen.sum()), 1)
    misfit = float(np.sqrt(max(left @ np.linalg.solve(covariance, left), 0.0) / freedom))
    sd = np.where(seen, max(1.0, misfit) / np.sqrt(np.where(seen, values, 1.0)), np.inf)
    return LeverArmCheck(correction, vectors, sd, sd < MOST_ARM_SD, misfit)


def lever_arm_findings(
    check: LeverArmCheck, stated_sd: float, stated: Array, first: str, second: str
) -> list[Finding]:
    """Report positions that the motion contradicts; empty where they are not observable.

    `stated`, (3,), m: position of the first minus that of the second; `stated_sd`, m, of each
    coordinate.
    """
    found: list[Finding] = []
    along = check.directions.T @ check.correction
    for k in np.flatnonzero(check.told):
        ratio = abs(float(along[k])) / float(np.hypot(check.sd[k], stated_sd))
        if ratio <= SIGMAS:
            continue
        d = check.directions[:, k] * np.sign(along[k])
        add_warning(
            found,
            "crash.direction-their-forces-stated",
            file=first,
            quantity="position",
            d=d[0],
            d_2=d[1],
            d_3=d[2],
            d_4=float(d @ stated) + abs(float(along[k])),
            sd=check.sd[k],
            second=second,
            d_5=float(d @ stated),
            stated_sd=stated_sd,
        )
    return found


# Swapped and inverted axes, detected with a second unit on the same vehicle.


# Differences of chi-square to the best candidate: below the first another is still possible,
# above the second it is excluded (3 and 5 standard deviations).
POSSIBLE, EXCLUDED = 9.0, 25.0
# Where the stated axes fit with this probability, others are not searched: without rotation, one
# of 48 candidates fits noise better by chance.
FITS = 1e-3
AXES = ("forward", "right", "down")
# Permutations of three axes, each with either sign.
SIGNED = 48


@dataclass(frozen=True, eq=False)
class AxisMatch:
    """Signed permutation of a unit's axes that agrees best with another unit.

    `accelerometers`, `gyro`, (3, 3), map the readings of the second unit to the axes of the first
    (identity where they agree or the motion cannot decide); `..._lead`: excess chi-square of the
    identity over it. `ambiguous`: axes of the first unit for which other permutations fit the
    accelerometers within three standard deviations.
    """

    accelerometers: Array
    gyro: Array
    accelerometers_lead: float
    gyro_lead: float
    ambiguous: tuple[str, ...]

    @classmethod
    def untold(cls) -> AxisMatch:
        """Return the result where the axes are not observable."""
        return cls(np.eye(3), np.eye(3), 0.0, 0.0, AXES)

    @property
    def kind(self) -> str:
        """``agree``, ``unit`` (turned as a whole), ``accelerometers``, ``gyro``, or ``both``."""
        accel = self.accelerometers_lead > EXCLUDED
        gyro = self.gyro_lead > EXCLUDED
        proper = float(np.linalg.det(self.accelerometers)) > 0.0
        if accel and gyro:
            return "unit" if proper and np.array_equal(self.accelerometers, self.gyro) else "both"
        if accel:
            return "accelerometers"
        return "gyro" if gyro else "agree"


def match_axes(
    first: VelocityIncrements, second: VelocityIncrements, turned: Array | None = None
) -> AxisMatch:
    """Find the signed permutation of the second unit's axes that agrees with the first.

    `turned`, (3, 3): the rotation that makes them agree best. Where it is nearer to the stated axes
    than to any others it is one more candidate, and where it fits as well nothing is swapped: a car
    that hardly turns has rates that another axis fits by chance, but not the stated ones of a unit
    that is turned by some degrees.

    Least squares over the intervals, gravity included, with the full covariance of the difference.
    The excess of the smallest residuals is added to every interval alike: after moving with wrong
    rates no permutation fits. Among indistinguishable permutations the one nearest to the identity
    is taken, and the identity where it fits with a probability of 1e-3 or more. Accelerometers and
    gyros are judged separately, since either may be wired wrong; a shared gyro is not judged.
    """
    candidates = signed_permutations()[1]
    if turned is not None and (np.diag(turned) > math.cos(math.pi / 4.0)).all():
        candidates = np.concatenate([candidates, turned[None]])
    accel, lead, other = _best(first, second, "force", candidates)
    if first.borrows(second):
        return AxisMatch(accel, np.eye(3), lead, 0.0, other)
    gyro, gyro_lead, _ = _best(first, second, "rate", candidates)
    return AxisMatch(accel, gyro, lead, gyro_lead, other)


def _best(
    first: VelocityIncrements, second: VelocityIncrements, of: str, candidates: Array
) -> tuple[Array, float, tuple[str, ...]]:
    a, b = (v.values if of == "force" else v.turned for v in (first, second))
    left = (a[None] - b @ candidates.transpose(0, 2, 1)).reshape(len(candidates), -1, 1)
    covariance = floored(difference_covariance(first, second, of=of, turn=candidates))
    stated = np.trace(covariance, axis1=1, axis2=2) / a.size
    identity = int(np.flatnonzero((candidates == np.eye(3)).all(axis=(1, 2)))[0])
    as_stated = left[identity, :, 0]
    fit = float(as_stated @ np.linalg.solve(covariance[identity], as_stated))
    unstated = max(float(((left**2).mean(axis=(1, 2)) - stated).min()), 0.0)
    covariance = covariance + unstated * np.eye(a.size)
    cost = (left * np.linalg.solve(covariance, left)).sum(axis=(1, 2))
    behind = (cost - cost.min()) / max(1.0, float(cost.min()) / a.size)
    possible = np.flatnonzero(behind <= POSSIBLE)
    # Nearest to the identity: most ones on the diagonal.
    near = np.trace(candidates[possible], axis1=1, axis2=2)
    best = int(possible[np.lexsort((behind[possible], -near))[0]])
    if chi_square_tail(fit, a.size) >= FITS or (np.diag(candidates[best]) > 0.0).all():
        best = identity
    wired = candidates[possible[possible < SIGNED]]
    differs = (wired != candidates[best]).any(axis=2).any(axis=0)
    return (
        candidates[best],
        float(max(behind[identity] - behind[best], 0.0)) if best != identity else 0.0,
        tuple(name for name, d in zip(AXES, differs, strict=True) if d),
    )


def axis_findings(match: AxisMatch, first: str, second: str) -> list[Finding]:
    """Report swapped or inverted axes of the second unit; empty where they agree."""
    kind = match.kind
    if kind == "agree":
        return []
    found: list[Finding] = []
    for part in ("accelerometers", "gyro") if kind == "both" else (kind,):
        of_gyro = part == "gyro"
        matrix = match.gyro if of_gyro else match.accelerometers
        lead = match.gyro_lead if of_gyro else match.accelerometers_lead
        moved = [
            Finding(
                "crash.axis-opposite" if matrix[i, j] < 0 else "crash.axis-along",
                severity="note",
                name=first,
                axis=AXES[i],
                other=AXES[j],
            )
            for i in range(3)
            for j in [int(np.argmax(np.abs(matrix[i])))]
            if matrix[i, j] != 1.0 or i != j
        ]
        doubt = []
        if match.ambiguous and part != "gyro":
            doubt = [Finding("crash.axes-ambiguous", severity="note", axes=match.ambiguous)]
        add_warning(
            found,
            f"crash.{part}-axes-differ",
            file=second,
            quantity="axes",
            moved=moved,
            lead=math.sqrt(lead),
            doubt=doubt,
        )
    return found


# Comparison of several units on one vehicle: whether they agree within stated uncertainty.

# Variance of assumed axes, relative to the largest: no weight beside measured ones.
NO_WEIGHT = 1e8


def compare_units(units: Sequence[PointKinematics]) -> UnitComparison:
    """Compare two or more units of one rigid vehicle at one point, pairwise and against their mean.

    The crash, -0.1 to 0.75 s as far as recorded, is cut into `PIECES`, fewer where each would have
    less than two samples. With the difference d of the velocity increments and its covariance C
    from all stated uncertainties, ``dᵀ C⁻¹ d`` is chi-square distributed; common errors (a shared
    gyro, the leveling) cancel in both. A probability below `LEVEL` is a disagreement: structural
    ringing at one position, or any unstated error; so is a single error that explains their
    differences much better than structure (`single_error`). Assumed axes, and intervals in which a
    unit was clipped without a wider range, are left out. Each pair is checked for swapped axes, a
    rotated mounting and wrong positions. `DataError`, `ConfigError`: the units share no or too
    short a part.
    """
    edges = common_edges(units)
    increments = [velocity_increments(u, edges) for u in units]
    cut = [clipped_pieces(u, edges) for u in units]
    rigid = unlearnt(units)
    pairs = tuple(
        compare_pair(units[i], units[j], increments[i], increments[j], ~(cut[i] | cut[j]), rigid)
        for i, j in itertools.combinations(range(len(units)), 2)
    )
    kept = ~np.any(cut, axis=0)
    common = [v.of_pieces(kept) for v in increments]
    structure = _of_vehicle(rigid, pairs, units, common, kept)
    agreeing = {name for p in pairs if p.agree for name in (p.first, p.second)}
    contrasts = point_contrasts([u for u in units if u.name in agreeing] or units, rigid)
    if contrasts is not None:
        structure = replace(structure, squares=expected_squares(rigid, contrasts))
    bent = [v.bent_by(structure, kept) for v in common]
    combined, combined_sd, against, chi, freedom = _against_all(units, bent, kept, structure)
    probability = chi_square_tail(chi, freedom)
    findings = [_left_out(u, edges, c) for u, c in zip(units, cut, strict=True) if c.any()]
    findings += [f for p in pairs for f in p.findings]
    odd = _odd_one(units, pairs)
    findings += odd
    findings += _of_structure(units, structure)
    doubted = {u.name: _turns_back(units, increments, structure, k) for k, u in enumerate(units)}
    findings += [found for found in doubted.values() if found is not None]
    return UnitComparison(
        edges,
        pairs,
        combined,
        combined_sd,
        against,
        chi,
        freedom,
        probability,
        probability >= LEVEL and all(p.agree for p in pairs),
        structure,
        _turned_by_points(units, common, structure, kept),
        tuple(u.name for u in units if doubted[u.name] or any(f.file == u.name for f in odd)),
        tuple(findings),
    )


def point_contrasts(
    units: Sequence[PointKinematics], structure: Structure
) -> PointContrasts | None:
    """Differences of the units while the force acts, and the shapes of what else makes them.

    Shapes of increments: of a scale factor, a misalignment or a mounting angle, the specific force
    itself; of a bias, the length of the interval; of a clock, the change of the specific force; of
    a position with a gyro, the angular acceleration and the centripetal term; of a turning that no
    gyro measured, its rates (`turning_shapes`). Each may have any size along any axis. None where
    the record has too few samples.
    """
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    felt = structure.felt
    felt = felt[(felt >= first) & (felt <= last)]
    coarsest = max(float(np.median(np.diff(u.time))) for u in units)
    if felt.size < 2 or felt[-1] - felt[0] < 2.0 * coarsest:
        return None
    count = int((felt[-1] - felt[0]) / max(LEARNT_STEP, 2.0 * coarsest))
    edges = np.linspace(felt[0], felt[-1], max(count, 1) + 1)
    kept = ~np.any([clipped_pieces(u, edges) for u in units], axis=0)
    if not kept.any():
        return None
    values = []
    for u in units:
        sampling = str(u.imu.attrs["sampling"])
        weights = [window_weights(u.time, *piece, sampling) for piece in itertools.pairwise(edges)]
        values.append(np.array(weights) @ u.force)
    seen = np.array([measured_axes(np.eye(3) - u.unmeasured) for u in units])
    contrasts = []
    for axis in range(3):
        those = [v[kept, axis] for v, sees in zip(values, seen[:, axis], strict=True) if sees]
        # Orthonormal rows across the sum of all, (j, j + 1).
        across = np.linalg.svd(np.ones((1, max(len(those), 1))))[2][1:]
        contrasts.append(across @ np.array(those) if those else np.zeros((0, kept.sum())))
    return PointContrasts(edges, kept, contrasts, _shapes(units, edges, values)[kept])


def _shapes(units: Sequence[PointKinematics], edges: Array, values: Sequence[Array]) -> Array:
    """Shapes of errors and of a turning on the increments, (n, q): `point_contrasts`."""
    lengths = np.diff(edges)
    mean = np.mean(values, axis=0)
    rest = np.mean([u.resting_force(STANDARD_GRAVITY)[0] for u in units], axis=0)
    free = mean - lengths[:, None] * rest
    late = np.gradient(free / lengths[:, None], axis=0)
    groups = [free, late]
    if any(u.gyro != NO_GYRO and u.moved is not None for u in units):
        rates = []
        for u in units:
            steps = np.array([np.interp(edges, u.time, column) for column in u.rate.T]).T
            rates.append(np.hstack([np.diff(steps, axis=0)]))
        groups.append(np.mean(rates, axis=0))
    shapes = [lengths[:, None]]
    for group in groups:
        # Components of the group, but for small ones: their error is of second order.
        left, sizes, _ = np.linalg.svd(group, full_matrices=False)
        shapes.append(left[:, sizes > SMALL_SHAPE * max(float(sizes[0]), TINY)])
    if any(u.gyro == NO_GYRO for u in units):
        pushed = np.append(0.0, np.cumsum(np.linalg.norm(free, axis=1)))
        share = pushed / max(float(pushed[-1]), TINY)
        shapes.append(np.diff([share, np.sin(np.pi * share)]).T)
    return np.hstack(shapes)


def _of_vehicle(
    rigid: Structure,
    pairs: Sequence[UnitPair],
    units: Sequence[PointKinematics],
    increments: Sequence[VelocityIncrements],
    kept: Flags,
) -> Structure:
    """Structural motion of a vehicle, by all units together if they agree, else by pairs that do.

    `increments`: of the intervals `kept` of all units.
    """
    if len(pairs) == 1:
        return pairs[0].structure
    if all(p.agree for p in pairs) and kept.any():
        size, others = increments[0].values.size, len(units) - 1
        less = np.hstack([-np.tile(np.eye(size), (others, 1)), np.eye(others * size)])
        covariance = less @ joint_covariance(increments) @ less.T
        turning = _turning(units, rigid, increments[0].edges, kept)
        if turning is not None:
            turning = less @ turning @ less.T
            covariance = covariance + turning
        difference = np.array([v.values.ravel() - increments[0].values.ravel() for v in increments])
        return learn_share(
            rigid, increments[0].edges, kept, difference[1:], floored(covariance), turning
        )
    told = [p.structure for p in pairs if p.agree] or [p.structure for p in pairs]
    times = [one.correlation_time for one in told if one.share.any()]
    return replace(
        rigid,
        share=np.sqrt(np.mean([one.share**2 for one in told], axis=0)),
        turning=float(np.sqrt(np.mean([one.turning**2 for one in told]))),
        correlation_time=float(np.median(times)) if times else rigid.correlation_time,
    )


def compare_pair(
    first: PointKinematics,
    second: PointKinematics,
    a: VelocityIncrements,
    b: VelocityIncrements,
    kept: Flags,
    rigid: Structure,
    explained: bool = True,
) -> UnitPair:
    """Compare two units over the `kept` intervals of their increments `a` and `b`.

    `rigid`: the structural process of the vehicle, without size; `explained`: whether a mounting is
    looked for that would explain a disagreement.
    """
    edges = a.edges
    a, b = a.of_pieces(kept), b.of_pieces(kept)
    difference, covariance = (a.values - b.values).ravel(), difference_covariance(a, b)
    turning = _turning((first, second), rigid, edges, kept)
    if turning is not None:
        apart = np.hstack([np.eye(difference.size), -np.eye(difference.size)])
        turning = apart @ turning @ apart.T
        covariance = covariance + turning
    plain = floored(covariance)
    structure = learn_share(rigid, edges, kept, difference[None], plain, turning)
    stiff = a, b
    a, b = a.bent_by(structure, kept), b.bent_by(structure, kept)
    if turning is not None:
        a = replace(a, force_noise=a.force_noise + structure.turning**2 * turning)
    covariance = difference_covariance(a, b)
    basis = measured_by_all((first, second))
    told = np.where(measured_axes(basis), 0.0, np.nan)
    chi, freedom = chi_square_along(basis, difference, covariance)
    probability = chi_square_tail(chi, freedom)
    curve, sd = _curve(difference, kept) + told, _curve_sd(covariance, kept) + told
    lengths = np.diff(edges)[kept, None]
    force = np.full((2, kept.size, 3), np.nan)
    force[0, kept] = difference.reshape(-1, 3) / lengths + told
    # An axis that is not measured has a variance of zero, or its rounding.
    variance = np.maximum(np.diag(covariance), 0.0)
    force[1, kept] = np.sqrt(variance).reshape(-1, 3) / lengths + told
    agree, findings = probability >= LEVEL, list[Finding]()
    whole = not (first.assumed_axes or second.assumed_axes) and bool(kept.any())
    whole = whole and (agree or explained)
    body = body_turning((a, b)) if whole else None
    if whole:
        # Swapped axes make more of a difference than any structure, which would hide them.
        turned, lever = mounting_rotation(a, b), check_lever_arm(a, b, body)
        axes = match_axes(*((a, b) if agree else stiff), turned.matrix)
    else:
        # The checks of relative mounting need three measured axes and a gyro on both units.
        axes, turned, lever = AxisMatch.untold(), MountingRotation.untold(), LeverArmCheck.untold()
    if not kept.any():
        code = "crash.no-piece-record-neither-end"
        findings.append(Finding(code, file=first.name, quantity="comparison", name=second.name))
    elif freedom == 0:
        code = "crash.measure-no-axis-common-not"
        findings.append(Finding(code, file=first.name, quantity="delta-V", name=second.name))
    elif not agree:
        ratio = np.abs(curve[1:]) / np.where(sd[1:] > 0.0, sd[1:], np.inf) + 0.0 * sd[1:]
        row, axis = np.unravel_index(int(np.nanargmax(ratio)), ratio.shape)
        share = f"{probability:.1g}" if probability > 1e-12 else "less than 1e-12"
        add_warning(
            findings,
            "crash.disagree-their-common-point-chi",
            file=first.name,
            quantity="delta-V",
            name=second.name,
            chi=chi,
            freedom=freedom,
            share=share,
            axes=AXES[axis],
            edges=edges[row + 1],
            curve=curve[row + 1, axis],
            sd=sd[row + 1, axis],
        )
    found = axis_findings(axes, first.name, second.name)
    if whole and not found and first.prepared is not None and second.prepared is not None:
        # A small rotation or a wrong position is not meaningful while axes are swapped.
        mounted = first.prepared.unit.mounting, second.prepared.unit.mounting
        angles = math.radians(math.hypot(*(m.angles_sd_deg for m in mounted)))
        found = rotation_findings(turned, angles, first.name, second.name)
        found += lever_arm_findings(
            lever,
            math.hypot(*(m.position_sd for m in mounted)),
            np.subtract(mounted[0].position, mounted[1].position),
            first.name,
            second.name,
        )
        # Without a gyro a turning makes the same differences.
        error = None
        if turning is None:
            effects = _single_effects((first, second), stiff, kept, body)
            if body is not None:
                difference, plain = difference - body.shift, floored(plain - body.known)
            error = single_error(effects, structure, edges, kept, difference, plain, LEVEL)
        if error is not None:
            agree = False
            if error.code == OFF_MOUNTING and turned.sd_deg.max() < math.degrees(MOST_SD):
                # Its size beside the structure is drawn toward zero, and linear in the angle.
                error = replace(error, size=np.radians(turned.vector_deg))
            # One error has one size, and the likeliest error is the one that is named.
            found = [error.finding(first.name, second.name)]
    return UnitPair(
        first.name,
        second.name,
        edges,
        curve,
        sd,
        force[0],
        force[1],
        chi,
        freedom,
        probability,
        agree,
        axes,
        turned,
        lever,
        structure,
        tuple(findings + found),
    )


def _single_effects(
    units: tuple[PointKinematics, PointKinematics],
    increments: tuple[VelocityIncrements, VelocityIncrements],
    kept: Flags,
    turning: Turning | None,
) -> dict[str, Array]:
    """Effects, (3 m, r), of errors of one of two units on their difference: `single_error`."""
    felt = np.mean([v.values for v in increments], axis=0)
    edges = increments[0].edges
    rest = np.mean([u.resting_force(STANDARD_GRAVITY)[0] for u in units], axis=0)
    along = (felt - np.diff(edges)[kept, None] * rest).sum(axis=0) * [1.0, 1.0, 0.0]
    along = along / max(float(np.linalg.norm(along)), TINY)
    effects = {
        OFF_SCALE: np.outer(felt @ along, along).reshape(-1, 1),
        OFF_MOUNTING: -rotation.cross_matrix(felt).reshape(-1, 3),
    }
    if turning is not None:
        effects[OFF_POSITION] = turning.lever
    return effects


def _turning(
    units: Sequence[PointKinematics], structure: Structure, edges: Array, kept: Flags
) -> Array | None:
    """Joint covariance, (3 m k, 3 m k), of increments of k units by a turning that none measures.

    The stated turning of the vehicle moves a point by its rate times its lever arm. None where a
    unit has a gyro.
    """
    turned = _across(units)
    if turned is None:
        return None
    _, across = turned
    rates = structure.of_turning(edges, min(u.assumed_until for u in units))[np.ix_(kept, kept)]
    whole = np.einsum("ab,icx,jcy->iaxjby", rates, across, across)
    return np.asarray(whole.reshape(3 * len(rates) * len(units), -1))


def _across(units: Sequence[PointKinematics]) -> tuple[Array, Array] | None:
    """Stated turning, (3,), rad, and by it the motion of the point of k units, (k, 3, 3), m.

    Rows by the axis of the turning. None where a unit has a gyro.
    """
    stated_sds, arms = [], []
    for u in units:
        stated = None if u.prepared is None else (u.prepared.unit.lender or u.prepared.unit).assumed
        if stated is None or u.moved is None or u.gyro != NO_GYRO:
            return None
        stated_sds.append(stated.sd_of("turn_sd_deg"))
        arms.append(u.moved.lever_arm)
    sds = np.radians(np.max(stated_sds, axis=0))
    # From the point back to the unit.
    return sds, np.cross(np.diag(sds), -np.array(arms)[:, None])


def _turned_by_points(
    units: Sequence[PointKinematics],
    increments: Sequence[VelocityIncrements],
    structure: Structure,
    kept: Flags,
) -> PointTurning | None:
    """Turning of a vehicle without a gyro, by what moves its points against each other.

    Conditional mean and covariance of the rates of a Gaussian process (`Structure.of_turning`),
    given the differences of the units' increments over the intervals `kept`. Structure may move a
    point across as far as it was learnt along any axis: a deformation in the direction of a
    rotation is not distinguishable from the rotation. The process may turn the vehicle further than
    is stated, by the largest of `MORE_TURNING`: the points say how far, and where they do not, the
    standard deviation is the stated one. So no bound depends on whether the differences happen to
    exceed the stated uncertainty.
    """
    turned = _across(units)
    if turned is None or not kept.any():
        return None
    sds, across = turned
    edges, until = increments[0].edges, min(u.assumed_until for u in units)
    moves = np.kron(structure.expected_of_increments(edges)[np.ix_(kept, kept)], np.eye(3))
    increments = [replace(one, force_noise=one.force_noise + moves) for one in increments]
    size, others = increments[0].values.size, len(units) - 1
    less = np.hstack([-np.tile(np.eye(size), (others, 1)), np.eye(others * size)])
    joint = joint_covariance(increments, without=(NO_TURNING,))
    stated = structure.of_turning(edges, until)
    walk = (1.0 + float(MORE_TURNING[-1]) ** 2) * stated
    seen = walk[np.ix_(kept, kept)]
    joint = joint + np.einsum("ab,icx,jcy->iaxjby", seen, across, across).reshape(joint.shape)
    covariance = floored(less @ joint @ less.T)
    # Of the rates over all intervals, in multiples of the stated, with the differences.
    with_units = np.einsum("ab,jcy->acjby", walk[:, kept], across).reshape(3 * len(walk), -1)
    gain = np.linalg.solve(covariance, (with_units @ less.T).T).T
    given = np.array([v.values for v in increments])
    upto = np.vstack([np.zeros(len(walk)), np.tril(np.ones((len(walk), len(walk))))])
    length, arms = np.diff(edges), -np.array([u.moved.lever_arm for u in units if u.moved])
    steps = gain @ (less @ given.ravel())
    for _ in range(ROUNDS):
        # The centripetal force of the rates found so far, on each point.
        rate = (upto @ steps.reshape(-1, 3) * sds)[:, None]
        inward = np.cross(rate, np.cross(rate, arms))
        turned_in = 0.5 * (inward[1:] + inward[:-1]) * length[:, None, None]
        free = given - turned_in[kept].transpose(1, 0, 2)
        steps = gain @ (less @ free.ravel())
    left = np.kron(walk, np.eye(3)) - gain @ (with_units @ less.T).T
    angle = np.vstack(
        [np.zeros(len(walk)), np.cumsum(0.5 * (upto[1:] + upto[:-1]) * length[:, None], axis=0)]
    )
    out = []
    for sums in (upto, angle):
        whole = np.kron(sums, np.diag(np.degrees(sds)))
        variance = np.maximum(np.einsum("ij,jk,ik->i", whole, left, whole), 0.0)
        most = np.einsum("ij,jk,ik->i", whole, np.kron(stated, np.eye(3)), whole)
        variance = np.minimum(variance, most)
        out += [(whole @ steps).reshape(-1, 3), np.sqrt(variance).reshape(-1, 3)]
    return PointTurning(edges, *out)


def _against_all(
    units: Sequence[PointKinematics],
    increments: Sequence[VelocityIncrements],
    kept: Flags,
    structure: Structure,
) -> tuple[Array, Array, tuple[UnitAgainstAll, ...], float, int]:
    """Combine `increments` of the kept intervals and compare each unit with the combination.

    Returns the combination's delta-V and its sd, (m + 1, 3), each unit against it, and chi-square
    and degrees of freedom of all.
    """
    size = increments[0].values.size
    if size == 0:
        none = np.full((kept.size + 1, 3), np.nan)
        against_none = tuple(UnitAgainstAll(u.name, none, none, 0.0, 0, 1.0) for u in units)
        return none, none, against_none, 0.0, 0
    joint = joint_covariance(increments)
    turning = _turning(units, structure, increments[0].edges, kept)
    if turning is not None:
        joint = joint + structure.turning**2 * turning
    joint = floored(joint)
    pieces, largest = size // 3, float(np.diagonal(joint).max())
    bases = [measured_by_all((u,)) for u in units]
    for k, basis in enumerate(bases):
        if basis.shape[1] < 3:
            # Assumed axes get no weight beside measured ones.
            rows = slice(k * size, (k + 1) * size)
            unmeasured = np.eye(3) - basis @ basis.T
            joint[rows, rows] += NO_WEIGHT * largest * np.kron(np.eye(pieces), unmeasured)
    whole = np.tile(np.eye(size), (len(units), 1))
    given = np.concatenate([v.values.ravel() for v in increments])
    weighed = np.linalg.solve(joint, np.column_stack([whole, given]))
    covariance = np.linalg.inv(whole.T @ weighed[:, :size])
    combined = covariance @ (whole.T @ weighed[:, size])
    left = given - whole @ combined
    against = []
    for k, (u, basis) in enumerate(zip(units, bases, strict=True)):
        rows = slice(k * size, (k + 1) * size)
        # The unit is part of the combination: their covariance is that of the combination.
        own = joint[rows, rows] - covariance
        chi, freedom = chi_square_along(basis, left[rows], own)
        told = np.where(measured_axes(basis), 0.0, np.nan)
        against.append(
            UnitAgainstAll(
                u.name,
                _curve(left[rows], kept) + told,
                _curve_sd(own, kept) + told,
                chi,
                freedom,
                chi_square_tail(chi, freedom),
            )
        )
    # Orthonormal columns spanning the directions that at least one unit measures, (3, r).
    measured = np.mean([np.eye(3) - u.unmeasured for u in units], axis=0)
    values, vectors = np.linalg.eigh(measured)
    several = np.asarray(vectors[:, values > ROUNDING])
    told = np.where(measured_axes(several), 0.0, np.nan)
    return (
        _curve(combined, kept) + told,
        _curve_sd(np.asarray(covariance), kept) + told,
        tuple(against),
        # No further floor: that of a joint with assumed axes would hide what the others measured.
        float(left @ np.linalg.solve(joint, left)),
        pieces * (sum(b.shape[1] for b in bases) - several.shape[1]),
    )


def _curve(increments: Array, kept: Flags) -> Array:
    """Cumulative sums at all edges; left-out intervals contribute zero."""
    whole = np.zeros((kept.size, 3))
    whole[kept] = increments.reshape(-1, 3)
    return np.vstack([np.zeros(3), np.cumsum(whole, axis=0)])


def _curve_sd(covariance: Array, kept: Flags) -> Array:
    m = kept.size
    total = np.kron(np.tril(np.ones((m, m)))[:, kept], np.eye(3))
    variance = np.maximum(np.einsum("ij,jk,ik->i", total, covariance, total), 0.0)
    return np.vstack([np.zeros(3), np.sqrt(variance).reshape(-1, 3)])


def _left_out(unit: PointKinematics, edges: Array, cut: Flags) -> Finding:
    pieces = np.flatnonzero(cut)
    return Finding(
        "crash.end-range-between-pieces-record",
        file=unit.name,
        quantity="comparison",
        edges=edges[pieces[0]],
        edges_2=edges[pieces[-1] + 1],
        size=pieces.size,
        size_2=cut.size,
    )


def _odd_one(units: Sequence[PointKinematics], pairs: Sequence[UnitPair]) -> list[Finding]:
    """Of three or more units, find the one without which the others agree."""
    if len(units) < 3 or all(p.agree for p in pairs):
        return []
    odd = [
        u.name for u in units if all(p.agree for p in pairs if u.name not in (p.first, p.second))
    ]
    if len(odd) != 1:
        return []
    return [Finding("crash.others-agree-another-not", file=odd[0], quantity="delta-V")]


def _of_structure(units: Sequence[PointKinematics], structure: Structure) -> list[Finding]:
    """Report what the differences show beyond the sensors: structure, and turning."""
    found: list[Finding] = []
    names = ", ".join(u.name for u in units)
    if structure.reported:
        add_note(
            found,
            "crash.points-move-with-structure",
            file=names,
            quantity="delta-V",
            forward=structure.sd[0],
            right=structure.sd[1],
            down=structure.sd[2],
            share=100.0 * float(structure.expected.max()),
            correlation_ms=1e3 * structure.expected_time,
        )
    if structure.turning > 1.0:
        add_warning(
            found,
            "crash.turned-more-than-assumed",
            file=names,
            quantity="turn_sd_deg",
            factor=structure.turning,
        )
    return found


def _turns_back(
    units: Sequence[PointKinematics],
    increments: Sequence[VelocityIncrements],
    structure: Structure,
    number: int,
) -> Finding | None:
    """Report a unit whose velocity turns back while that of the others does not.

    A vehicle rebounds as a whole: what one point gives back of its largest change, along the
    direction in which all changed, differs between points by no more than structure does.
    """
    if not structure.change > 0.0:
        return None
    lengths = np.diff(increments[0].edges)[:, None]
    curves = []
    for unit, one in zip(units, increments, strict=True):
        free = one.values - unit.resting_force(STANDARD_GRAVITY)[0] * lengths
        curves.append(np.cumsum(free @ (np.eye(3) - unit.unmeasured), axis=0))
    middle = np.median(curves, axis=0)
    row = int(np.argmax(np.linalg.norm(middle, axis=1)))
    along = middle[row] / max(float(np.linalg.norm(middle[row])), TINY)
    changed = [curve @ along for curve in curves]
    back = [float(c.max() - c[int(np.argmax(c)) :].min()) for c in changed]
    others = [b for k, b in enumerate(back) if k != number]
    more = back[number] - max(others)
    if more <= LARGEST_SHARE * structure.change:
        return None
    return Finding(
        "crash.velocity-turns-back",
        file=units[number].name,
        quantity="delta-V",
        back=back[number],
        largest=float(changed[number].max()),
        others=max(others),
        time=float(increments[0].edges[1 + int(np.argmax(changed[number]))]),
    )


# Results of a comparison of units.


@dataclass(frozen=True, eq=False)
class UnitPair:
    """Comparison of two units at their common point; NaN along axes that either assumes.

    `difference`, `sd`, (m + 1, 3), m/s: integral of the first unit's specific force minus the
    second's, vehicle axes, from the first edge; intervals in which either was clipped contribute
    zero. `force_difference`, `force_sd`, (m, 3), m/s²: means over each interval; NaN where either
    was clipped. `chi_square`, `freedom` over the remaining intervals and common axes; `probability`
    of one at least this large if the stated uncertainty is right. `axes`, `turned`, `lever_arm` are
    not meaningful where either assumes an axis.
    """

    first: str
    second: str
    edges: Array = field(repr=False)
    difference: Array = field(repr=False)
    sd: Array = field(repr=False)
    force_difference: Array = field(repr=False)
    force_sd: Array = field(repr=False)
    chi_square: float
    freedom: int
    probability: float
    agree: bool
    axes: AxisMatch = field(repr=False)
    turned: MountingRotation = field(repr=False)
    lever_arm: LeverArmCheck = field(repr=False)
    structure: Structure = field(repr=False)
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class UnitAgainstAll:
    """One unit against the combination of all: delta-V differences and sd, (m + 1, 3), m/s.

    NaN along axes that it, or all, assume. Chi-square as `UnitPair`.
    """

    name: str
    difference: Array = field(repr=False)
    sd: Array = field(repr=False)
    chi_square: float
    freedom: int
    probability: float


@dataclass(frozen=True, eq=False)
class PointTurning:
    """Turning of a vehicle without a gyro, from the first of `edges`, (m + 1,), s, on.

    `rate`, deg/s, and `angle`, deg, with their standard deviations, (m + 1, 3): about forward,
    right, down. About an axis that the points do not show it is the assumption: zero, with its sd.
    """

    edges: Array = field(repr=False)
    rate: Array
    rate_sd: Array
    angle: Array
    angle_sd: Array


@dataclass(frozen=True, eq=False)
class UnitComparison:
    """Comparison of all units of a vehicle at one point.

    `combined`, `combined_sd`, (m + 1, 3), m/s: delta-V of the optimally weighted combination at
    `edges`, gravity included, body axes; NaN along axes that all units assume. Chi-square of all
    units against it. `structure`: motion of the units' points against each other. `doubted`: units
    that the others or the mechanics of a crash contradict. `turned`: by the points alone, None
    where a unit has a gyro.
    """

    edges: Array = field(repr=False)
    pairs: tuple[UnitPair, ...]
    combined: Array = field(repr=False)
    combined_sd: Array = field(repr=False)
    against: tuple[UnitAgainstAll, ...]
    chi_square: float
    freedom: int
    probability: float
    agree: bool
    structure: Structure = field(repr=False)
    turned: PointTurning | None = field(repr=False)
    doubted: tuple[str, ...]
    findings: tuple[Finding, ...]


# Directions measured by units of which some assume axes.


# Squared cosines closer to 0 or 1 than this are rounding.
ROUNDING = 1e-9
# A vehicle axis counts as measured from this squared cosine on: 18 deg.
MOST = 0.9


def measured_by_all(units: Sequence[PointKinematics]) -> Array:
    """Orthonormal columns spanning the directions that every unit measures, (3, r)."""
    total = np.sum([u.unmeasured for u in units], axis=0)
    if not total.any():
        return np.eye(3)
    values, vectors = np.linalg.eigh(total)
    return np.asarray(vectors[:, values < ROUNDING])


def measured_axes(basis: Array) -> NDArray[np.bool_]:
    """Which of the vehicle's axes lie within these directions, (3,)."""
    return np.asarray((basis**2).sum(axis=1) > MOST)


def chi_square_along(basis: Array, difference: Array, covariance: Array) -> tuple[float, int]:
    """Chi-square of a difference, (3 m,), along a basis, (3, r), and its degrees of freedom."""
    if basis.shape[1] < 3:
        along = np.kron(np.eye(difference.size // 3), basis)
        difference, covariance = along.T @ difference, along.T @ covariance @ along
    if not difference.size:
        return 0.0, 0
    return float(difference @ np.linalg.solve(floored(covariance), difference)), difference.size


# Intervals in which a unit was clipped without a wider range.


# Squared cosine below which a sensor axis does not count: within 6 deg of perpendicular.
LEAST_SHARE = 0.01


def clipped_axes(unit: PointKinematics, window: tuple[float, float]) -> Flags:
    """Along which of the vehicle's axes, (3,), a unit was clipped in a window, s.

    All False for a mean of several units. A clipped gyro affects all axes and is not included.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(3, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    within = (time >= window[0]) & (time <= window[1])
    cut = prepared.clipped[within].any(axis=0)
    share = prepared.unit.mounting.C_vs**2 > LEAST_SHARE
    return np.asarray((share & cut).any(axis=1))


def clipped_pieces(unit: PointKinematics, edges: Array) -> Flags:
    """In which intervals between edges, (m,), the readings of a unit are affected by clipping.

    By a clipped sample of accelerometers or gyro, or a neighbor of one: the gyro samples that form
    one angular acceleration, and the accelerometer sample up to which the line between samples
    extends.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(len(edges) - 1, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    arm = unit.moved is not None and bool(unit.moved.lever_arm.any())
    wide = unit.moved.slope.slope.shape[1] // 2 if arm and unit.moved is not None else 0
    cut = _spread(prepared.clipped, 1)
    # A clipped gyro affects the accelerometer readings only through a lever arm.
    cut |= _spread(prepared.gyro_clipped, wide + 1) if arm else False
    at = time[cut]
    return np.asarray(
        np.searchsorted(at, edges[1:], side="right") > np.searchsorted(at, edges[:-1], side="left")
    )


def _spread(flags: Flags, by: int) -> Flags:
    """Samples with a flag, (n, 3), along any axis, and so many neighbors on either side."""
    return np.asarray(
        np.convolve(np.asarray(flags.any(axis=1)), np.ones(2 * by + 1), mode="same") > 0.5
    )
