"""Iron and axes of a magnetometer from rests in many poses, each in a field of its own."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.sensors.magnetometer import (
    CHANCE,
    FIELD,
    IRON,
    OFFSET,
    OFFSET_PRIOR,
    SHAPES,
    SOFT,
    SOFT_PRIOR,
    MagnetometerCalibration,
    calibrate_magnetometer,
    change_of_direction,
    direction_sd,
    strength_residual,
)
from strapdown.tables.checks import Array

#: Information, its right side or step, and logarithm of the chance, for each scatter of the field.
Part = tuple[Array, Array, Array]

#: Rotation of a magnetometer in its case before rests show it, rad; fewest rests that do.
ROTATION_PRIOR, LEAST_RESTS = 0.05, 5
#: By how much another order of the axes must fit the dip better, in squares.
SWAPPED = 10.0
#: Means of the readings of a motion, each of one reading at least; readings of all at most.
MEANS, MOST = 16, 20_000
#: Relative scatter of the field over which the likelihood is summed.
SCATTERS = np.geomspace(1e-4, 0.3, 33)
#: Correlation of the errors of strength and vertical part beside that of a scatter that is equal
#: along all axes: people and cars do not choose an axis, and yet it need not be equal.
ISOTROPIC = (0.8, 0.95, 1.0)
#: Variance, in squares of the field, of a straight line in the strength over a motion: any.
LINE = 100.0
#: Steps of the fit at most, and the one at which it ends.
STEPS, SMALL = 30, 1e-7
#: Unknowns beside hard iron, field and soft iron: rotation, vertical part of the field.
TURN, DIP, UNKNOWNS = slice(9, 12), 12, 13


def calibrate_by_poses(
    mag: Array, stretch: NDArray[np.int64], rests: list[int], up: Array, up_covariance: Array
) -> MagnetometerCalibration:
    """Find hard iron, soft iron and axes of a magnetometer together.

    Parameters
    ----------
    mag : ndarray, (n, 3)
        Readings in the order of time, without missing ones, in any unit.
    stretch : ndarray, (n,), int
        Number of the rest, or of the motion of some seconds, in which each was taken.
    rests : list of int
        Numbers of the rests.
    up : ndarray, (p, 3)
        Unit vector up of each rest, axes of the accelerometers.
    up_covariance : ndarray, (3p, 3p)
        Of the vectors up of all rests together: errors of accelerometers are alike in all.

    Returns
    -------
    MagnetometerCalibration
        With rotation; with less than five rests as `calibrate_magnetometer` finds it.

    Notes
    -----
    Each rest gives two numbers: the strength of the field, and its part along the vertical, which
    keep their values in all poses, whatever the heading (dot product invariance: Kok, Hol, Schön,
    Gustafsson and Luinge, FUSION 2012; Li, Li, IEEE Trans. Instrum. Meas. 61, 2012). The field of a
    pose differs from that of all by a random vector (people, cars and the position of the sensor
    change it), which both numbers share; more samples of a rest do not reduce it. Its standard
    deviation s has the prior 1/√s, between Jeffreys's and a uniform one (Gelman, Bayesian Analysis
    1, 2006), with which bounds of simulated sensors are neither too wide nor too narrow, and is
    summed over: few poses make the bounds wider, as Student's distribution does. Of a motion
    between rests counts what differs from a straight line in the strength, as its ends have the
    errors of their places, too; beyond that its field walks at random, by as much as its readings
    show. Maximum posterior about the nearest of the 24 ways in which axes are swapped, by
    Gauss-Newton steps.
    """
    start = calibrate_magnetometer(mag)
    if len(rests) < LEAST_RESTS:
        return start
    size = start.field
    fit = _Fit(mag / size, stretch, rests, up, up_covariance)
    fit.begin(start.hard_iron / size, start.soft_iron)
    for _ in range(STEPS):
        step, covariance = fit.step()
        fit.move(step)
        if np.abs(step).max() < SMALL:
            break
    return fit.result(start, size, covariance)


class _Fit:
    """Unknowns and readings, in units of the field."""

    def __init__(
        self,
        m: Array,
        stretch: NDArray[np.int64],
        rests: list[int],
        up: Array,
        up_covariance: Array,
    ) -> None:
        self.means = np.array([m[stretch == k].mean(axis=0) for k in rests])
        self.up, self.up_covariance = up, up_covariance.reshape(len(up), 3, len(up), 3)
        moving = np.flatnonzero(~np.isin(stretch, rests))
        moving = moving[:: max(1, -(-len(moving) // MOST))]
        which, count = np.unique(stretch[moving], return_inverse=True, return_counts=True)[1:]
        kept = count[which] >= MEANS
        self.m = m[moving[kept]]
        # First row of each mean of each motion, and how many rows it has.
        ends = np.cumsum(count[count >= MEANS])
        firsts = np.r_[0, ends[:-1]] if len(ends) else ends
        lengths = ends - firsts
        at = firsts[:, None] + lengths[:, None] * np.arange(MEANS) // MEANS
        self.edges = at.ravel()
        self.rows = np.diff(np.r_[self.edges, len(self.m)])
        self.x = np.zeros(UNKNOWNS)
        self.R = self.began = np.eye(3)
        prior = np.zeros(UNKNOWNS)
        prior[OFFSET], prior[SOFT], prior[TURN] = OFFSET_PRIOR, SOFT_PRIOR, ROTATION_PRIOR
        self.prior = np.divide(1.0, prior**2, out=np.zeros(UNKNOWNS), where=prior > 0.0)
        self.likely = len(SCATTERS) // 2

    def begin(self, hard_iron: Array, soft_iron: Array) -> None:
        """Start from an iron, and from the order of axes that fits the dip."""
        A = soft_iron - np.eye(3)
        self.x[OFFSET], self.x[FIELD] = hard_iron, 1.0
        self.x[SOFT] = A[0, 0], A[1, 1], A[0, 1], A[0, 2], A[1, 2]
        v = (self.means - hard_iron) @ soft_iron
        orders = _orders()
        fits = [_turned(v, self.up, R) for R in orders]
        # Another order of the axes than the stated one only where that one does not fit.
        best = int(np.argmin([scatter for _, scatter in fits]))
        if fits[best][1] * SWAPPED > fits[0][1]:
            best = 0
        self.began, self.R = orders[best], fits[best][0]
        self.x[TURN] = rotation.rotation_vector_from_dcm(self.R @ self.began.T)
        self.x[DIP] = float(np.mean(((v @ self.R.T) * self.up).sum(axis=1)))

    def move(self, step: Array) -> None:
        """Change the unknowns."""
        self.R = rotation.dcm_from_rotation_vector(step[TURN]) @ self.R
        self.x = self.x + step
        self.x[TURN] = rotation.rotation_vector_from_dcm(self.R @ self.began.T)

    def iron(self) -> Array:
        """Soft iron, from the readings to the field, (3, 3)."""
        return np.asarray(np.eye(3) + np.tensordot(self.x[SOFT], SHAPES, 1))

    def _strength(self, m: Array) -> tuple[Array, Array]:
        """Strength less the field's, (n,), and its derivatives, (n, 13)."""
        left, by_iron = strength_residual(m, self.x[: TURN.start])
        J = np.zeros((len(m), UNKNOWNS))
        J[:, : TURN.start] = by_iron
        return left, J

    def _vertical(self) -> tuple[Array, Array, Array]:
        """Vertical part less the field's, (p,), derivatives, and covariance by the vectors up."""
        A, up = self.iron(), self.up
        off = self.means - self.x[OFFSET]
        w = off @ A @ self.R.T
        J = np.zeros((len(w), UNKNOWNS))
        J[:, OFFSET] = -up @ self.R @ A
        J[:, SOFT] = np.einsum("ni,ij,kjl,nl->nk", up, self.R, SHAPES, off)
        J[:, TURN], J[:, DIP] = np.cross(w, up), -1.0
        by_up = np.einsum("ni,nimj,mj->nm", w, self.up_covariance, w)
        return (up * w).sum(axis=1) - self.x[DIP], J, by_up

    def _of_rests(self) -> Part:
        """Of strengths and vertical parts, whose errors go together."""
        strength, by_strength = self._strength(self.means)
        vertical, by_vertical, by_up = self._vertical()
        left, J = np.r_[strength, vertical], np.vstack([by_strength, by_vertical])
        p = len(strength)
        known = np.zeros((2 * p, 2 * p))
        known[p:, p:] = by_up
        # Of a vector with equal variances, the parts along field and vertical are correlated by
        # the sine of the dip.
        sine = float(np.clip(self.x[DIP] / self.x[FIELD], -0.99, 0.99))
        both = [np.array([[1.0, k * sine], [k * sine, 1.0]]) for k in ISOTROPIC]
        parts = [_part(left[None], J[None], np.kron(one, np.eye(p)), known) for one in both]
        information, right, chance = (np.concatenate(v) for v in zip(*parts, strict=True))
        return information, right, chance

    def _of_motions(self) -> Part | None:
        """Of the strength within each motion, less a straight line."""
        e, J = self._strength(self.m)
        if not len(e):
            return None
        noise = 0.5 * float(np.square(np.diff(e)).mean()) / float(self.rows.min())
        e = (np.add.reduceat(e, self.edges) / self.rows).reshape(-1, MEANS)
        J = np.add.reduceat(J, self.edges, axis=0) / self.rows[:, None]
        at = (np.arange(MEANS) + 1.0) / MEANS
        known = (noise + 1e-12) * np.eye(MEANS) + LINE * (1.0 + np.outer(at, at))
        return _part(e, J.reshape(-1, MEANS, UNKNOWNS), np.minimum.outer(at, at), known)

    def step(self) -> tuple[Array, Array]:
        """Change of the unknowns to the mean of the posterior, and its covariance."""
        off = self.x.copy()
        off[FIELD] = off[DIP] = 0.0
        information, right = np.diag(self.prior), self.prior * off
        rests, motions = self._of_rests(), self._of_motions()
        if motions is not None:
            # Motions show the scatter within them well: the likeliest one.
            N, g, chance = motions
            beside = rests[0][self.likely], rests[1][self.likely]
            chance = _posterior(information + beside[0] + N, right + beside[1] + g, chance)[2]
            walk = int(np.argmax(chance))
            information, right = information + N[walk], right + g[walk]
        C, steps, chance = _posterior(information + rests[0], right + rests[1], rests[2])
        self.likely = int(np.argmax(chance))
        share = np.exp(chance - chance.max())
        share /= share.sum()
        mean = share @ steps
        apart = steps - mean
        covariance = np.einsum("k,kij->ij", share, C) + (apart.T * share) @ apart
        return mean, np.asarray(covariance)

    def result(
        self, start: MagnetometerCalibration, size: float, covariance: Array
    ) -> MagnetometerCalibration:
        """The calibration in the unit of the readings."""
        of_iron = covariance[np.ix_(IRON, IRON)]
        # Iron by the readings alone, beside none.
        alone = np.linalg.inv(of_iron) - np.diag(self.prior[IRON])
        said = np.linalg.solve(of_iron, self.x[IRON])
        gained = float(said @ np.linalg.lstsq(alone, said, rcond=1e-9)[0])
        A, field = self.iron(), float(self.x[FIELD])
        readings = np.vstack([self.means, self.m])
        less = (readings - self.x[OFFSET]) @ A
        unit = np.r_[np.full(3, size), np.ones(5)]
        return replace(
            start,
            hard_iron=size * self.x[OFFSET],
            soft_iron=A,
            field=size * field,
            hard_iron_sd=size * np.sqrt(np.diag(covariance)[OFFSET]),
            residual=float(np.std(np.linalg.norm(less, axis=1))) / field,
            direction_sd_deg=direction_sd(A, field, of_iron),
            change_deg=change_of_direction(readings, less),
            found=bool(gained > chi_square_exceeded(CHANCE, len(IRON))),
            rotation=self.R,
            rotation_sd=np.sqrt(np.diag(covariance)[TURN]),
            covariance=of_iron * np.outer(unit, unit),
        )


def _part(left: Array, J: Array, K: Array, known: Array) -> Part:
    """Information, its right side, and logarithm of the likelihood for each of `SCATTERS`.

    `left`: residuals, (m, n), of m independent stretches, with derivatives `J`, (m, n, 13); `K`:
    covariance of each by a scatter of one; `known`: what is there beside it.
    """
    V = np.linalg.cholesky(np.square(SCATTERS)[:, None, None] * K + known)
    both = np.concatenate([J, left[:, :, None]], axis=2)
    columns = both.transpose(1, 0, 2).reshape(left.shape[1], -1)
    whitened = np.linalg.solve(V, np.broadcast_to(columns, (len(SCATTERS), *columns.shape)))
    whitened = whitened.reshape(len(SCATTERS), -1, UNKNOWNS + 1)
    H, r = whitened[:, :, :-1], whitened[:, :, -1]
    chance = -len(left) * np.log(np.diagonal(V, axis1=1, axis2=2)).sum(axis=1)
    # The prior of the scatter, one over its root, on a grid in logarithms.
    chance += 0.5 * np.log(SCATTERS) - 0.5 * np.square(r).sum(axis=1)
    transposed = H.transpose(0, 2, 1)
    return transposed @ H, (transposed @ r[:, :, None])[:, :, 0], chance


def _posterior(information: Array, right: Array, chance: Array) -> Part:
    """Covariances, steps and logarithms of the chance of each scatter.

    By the restricted likelihood: that of the scatter, whatever the unknowns are.
    """
    C = np.linalg.inv(information)
    steps = -np.einsum("kij,kj->ki", C, right)
    chance = chance - 0.5 * np.linalg.slogdet(information)[1]
    fit = np.einsum("ki,ki->k", right, steps)
    return np.asarray(C), np.asarray(steps), np.asarray(chance - 0.5 * fit)


def _orders() -> list[Array]:
    """The 24 right-handed orders and signs of axes, the identity first."""
    all_ = [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return [R for R in all_ if np.linalg.det(R) > 0.0]


def _turned(v: Array, up: Array, begin: Array) -> tuple[Array, float]:
    """Rotation about one order of the axes, and the squared scatter of the vertical part."""
    R, scatter = begin, 0.0
    for _ in range(5):
        w = v @ R.T
        left, J = (up * w).sum(axis=1), np.cross(w, up)
        left, J = left - left.mean(), J - J.mean(axis=0)
        variance = float(left @ left) / len(v) + SCATTERS[0] ** 2
        off = rotation.rotation_vector_from_dcm(R @ begin.T)
        prior = variance * ROTATION_PRIOR**-2
        step = np.linalg.solve(J.T @ J + prior * np.eye(3), J.T @ left + prior * off)
        R = rotation.dcm_from_rotation_vector(-step) @ R
        left = (up * (v @ R.T)).sum(axis=1)
        scatter = float(np.square(left - left.mean()).sum()) + len(v) * SCATTERS[0] ** 2
    return np.asarray(R), scatter
