"""Hard and soft iron of a magnetometer that turned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from dataclasses import field as attribute
from itertools import permutations, product

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.errors import DataError, Finding
from strapdown.tables import ACCEL, MAG
from strapdown.tables.checks import Array, as_array

#: Readings of a fit at most, and at least.
MOST, LEAST = 4000, 50
#: Before the log is read: hard iron as a share of what is read, soft iron along each term.
OFFSET_PRIOR, SOFT_PRIOR = 1.0, 0.1
#: Soft iron of a magnetometer whose own is not looked for, along each term.
SOFT_LEFT = 0.02
#: Residuals, in standard deviations, from which a reading counts less (Huber).
HUBER = 1.5
#: Scatter that a fit begins with, as a share of the field; its rounds, and steps in each.
FIRST_SCATTER, ROUNDS, STEPS = 0.02, 4, 15
#: Least scatter, as a share of the field: finer than any magnetometer.
FINEST = 1e-4
#: Chance at which readings of a perfect magnetometer are called wrong: beyond three sigma.
CHANCE = 0.0027
#: Scatters of the strength in the spread of the readings along their longest axis, and in the
#: field, from which a turn made them. Of noise alone a sphere as small as itself is closest: the
#: strength of three components scatters by 0.67 of one, about 1.6 (chi of three).
TURNED, FIELD_SEEN = 2.0, 3.0
#: Variance of the directions seen along the axis with least, a third if all are, from which soft
#: iron is looked for: of a cap of 40 deg, or a band of 15 deg.
COVERED = 0.02
#: Change of direction beside its standard deviation from which a calibration is applied.
WORTH = 2.0
#: Most scatter of the calibrated strength beside that of the readings, as shares of their fields: a
#: center that is moved toward readings that cover little does not explain it.
STEADIER = 0.9
#: Direction that iron leaves open and that is worth a warning, deg.
OPEN = 3.0
#: A calibration of another log does not fit where the strength scatters more with it than without,
#: and by more than a room makes it.
MISFIT, FITS = 1.0, 0.05
#: Terms of the model: hard iron, field, soft iron.
OFFSET, FIELD, SOFT = slice(0, 3), 3, slice(4, 9)
IRON = np.r_[0:3, 4:9]
#: Symmetric matrices without a trace: a change of shape that leaves the size.
SHAPES = np.array(
    [
        [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
        [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
        [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    ]
)


@dataclass(frozen=True)
class MagnetometerCalibration:
    """Iron and axes: ``field = rotation @ soft_iron @ (reading - hard_iron)``, body axes.

    Attributes
    ----------
    hard_iron : ndarray, (3,), unit of the readings
    soft_iron : ndarray, (3, 3)
        Symmetric, without change of size; the identity unless it is significant.
    field : float, unit of the readings
        Strength of the field.
    hard_iron_sd : ndarray, (3,), unit of the readings
    residual : float
        Scatter of the calibrated strength, as a share of the field.
    raw_residual : float
        That of the readings as they are.
    direction_sd_deg : float, deg
        Standard deviation of the direction of the calibrated field by what the log left open, the
        mean over all directions.
    change_deg : float, deg
        Root mean square angle by which the calibration turns the readings.
    found : bool
        Whether the readings contradict a magnetometer without iron beyond chance: the calibrated
        ones fit a constant strength better.
    rotation : ndarray, (3, 3)
        From the axes of the magnetometer to those of the accelerometers; the identity where no
        rests in several poses showed it.
    rotation_sd : ndarray, (3,), rad
        Its standard deviations about the axes of the accelerometers; infinite where not shown.
    covariance : ndarray, (8, 8)
        Of hard iron, and of soft iron along `SHAPES`.
    """

    hard_iron: Array
    soft_iron: Array = attribute(repr=False)
    field: float
    hard_iron_sd: Array
    residual: float
    raw_residual: float
    direction_sd_deg: float
    change_deg: float
    found: bool
    rotation: Array = attribute(default_factory=lambda: np.eye(3), repr=False)
    rotation_sd: Array = attribute(default_factory=lambda: np.full(3, np.inf), repr=False)
    covariance: Array = attribute(default_factory=lambda: np.zeros((8, 8)), repr=False)

    @property
    def significant(self) -> bool:
        """Whether it is found, by more than what the log leaves open, and steadies the strength."""
        steadier = self.residual < STEADIER * self.raw_residual
        return self.found and steadier and self.change_deg > WORTH * self.direction_sd_deg

    def apply(self, mag: ArrayLike) -> Array:
        """Calibrated readings, (n, 3) or (3,); NaN stays NaN."""
        less = (np.asarray(mag, np.float64) - self.hard_iron) @ self.soft_iron
        return np.asarray(less @ self.rotation.T)


def calibrate_magnetometer(mag: ArrayLike) -> MagnetometerCalibration:
    """Fit the ellipsoid on which the readings of a turning magnetometer lie.

    Parameters
    ----------
    mag : array_like, (n, 3)
        Readings along the body axes, in the order of time and in any unit; rows with NaN are
        missing.

    Returns
    -------
    MagnetometerCalibration
        Of directions that the log does not show, nothing is assumed but that hard iron is not many
        times the field and soft iron some tenths: these stay near zero, and count in
        `direction_sd_deg`.

    Raises
    ------
    DataError
        There are fewer than 50 readings.

    Notes
    -----
    Maximum posterior by Gauss-Newton steps, with the weights of Huber. Readings at one position
    have correlated residuals, as the field differs from place to place: their information is
    divided by the integrated correlation time, in rows (Priestley, Spectral Analysis and Time
    Series, 5.3.2). A rotation of the magnetometer leaves every strength as it is:
    `calibrate_by_poses` finds it.
    """
    rows = _readings(as_array(mag, 3, "mag"))
    if len(rows) < LEAST:
        raise DataError("attitude.too-few-field-readings", quantity="mag", count=len(rows))
    m = rows[:: -(-len(rows) // MOST)]
    size = float(np.median(np.linalg.norm(m, axis=1)))
    m = m / size
    start = _sphere(m)
    raw, best = _fit(m, start, ()), _fit(m, start, (OFFSET,))
    spread = float(np.sqrt(np.linalg.eigvalsh(np.cov(m.T))[-1]))
    if min(spread / TURNED, best.x[FIELD] / FIELD_SEEN) <= best.scatter:
        best = replace(raw, covariance=np.diag([OFFSET_PRIOR**2] * 3 + [0.0] * 6))
    by, terms = best, 3
    # Of a plane of readings soft iron would flatten the noise across it.
    off = m - best.x[OFFSET]
    off = off / np.linalg.norm(off, axis=1)[:, None]
    if np.linalg.eigvalsh(np.cov(off.T))[0] > COVERED:
        by = _fit(m, best.x, (OFFSET, SOFT))
        scale = by.scatter**2 * by.correlated
        if (_loss(best, by) - _loss(by, by)) / scale > chi_square_exceeded(CHANCE, 5):
            best, terms = by, 8
    # By the scatter of the best model; each is a special case of the next.
    gained = (_loss(raw, by) - _loss(best, by)) / (by.scatter**2 * by.correlated)
    A = np.eye(3) + np.tensordot(best.x[SOFT], SHAPES, 1)
    return MagnetometerCalibration(
        hard_iron=size * best.x[OFFSET],
        soft_iron=A,
        field=size * float(best.x[FIELD]),
        hard_iron_sd=size * np.sqrt(np.maximum(np.diag(by.covariance)[OFFSET], 0.0)),
        residual=best.scatter / float(best.x[FIELD]),
        raw_residual=raw.scatter / float(raw.x[FIELD]),
        direction_sd_deg=direction_sd(
            np.eye(3) + np.tensordot(by.x[SOFT], SHAPES, 1),
            float(by.x[FIELD]),
            by.covariance[np.ix_(IRON, IRON)],
        ),
        change_deg=change_of_direction(m, (m - best.x[OFFSET]) @ A),
        found=bool(gained > chi_square_exceeded(CHANCE, terms)),
        covariance=_of_iron(by.covariance, size),
    )


def _of_iron(covariance: Array, size: float) -> Array:
    """Covariance of hard iron, in the unit of the readings, and of soft iron, (8, 8)."""
    terms = np.r_[0:3, 4:9]
    unit = np.r_[np.full(3, size), np.ones(5)]
    out = covariance[np.ix_(terms, terms)] * np.outer(unit, unit)
    if not out[3:, 3:].any():
        out[3:, 3:] = SOFT_LEFT**2 * np.eye(5)
    return np.asarray(out)


def without_iron(
    imu: pd.DataFrame, given: MagnetometerCalibration | None = None
) -> tuple[pd.DataFrame, MagnetometerCalibration | None, float, tuple[Finding, ...]]:
    """Calibrate the magnetometer of a log by itself, where its iron is significant.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; without ``mag_x..z`` or ``accel_x..z`` it is returned as it is.
    given : MagnetometerCalibration, optional
        Of another log, which is applied unless the strength of the field contradicts it.

    Returns
    -------
    imu : DataFrame
    calibration : MagnetometerCalibration or None
        The one that was applied.
    heading_sd : float, deg
        Standard deviation that iron leaves in headings, at the dip of the log.
    findings : tuple of Finding
        What was applied; or that there is iron, and the log does not show it well enough.
    """
    if not {*MAG, *ACCEL} <= set(imu.columns):
        return imu, None, 0.0, ()
    mag = imu[MAG].to_numpy(dtype=np.float64)
    if given is not None:
        raw_scatter, scatter = _scatter(mag), _scatter(given.apply(mag))
        if scatter > max(MISFIT * raw_scatter, FITS):
            code = "attitude.calibration-does-not-fit"
            return imu, None, 0.0, (_finding(code, imu, given, raw_scatter, scatter),)
        used = given
    else:
        if len(_readings(mag)) < LEAST:
            return imu, None, 0.0, ()
        used = calibrate_magnetometer(mag)
        raw_scatter, scatter = used.raw_residual, used.residual
    known = used.apply(mag)
    sd = used.direction_sd_deg / _level_share(known, imu[ACCEL].to_numpy(dtype=np.float64))
    sd = min(sd, 180.0)
    if given is None and not used.significant:
        if not used.found or used.direction_sd_deg < OPEN:
            return imu, None, 0.0, ()
        code = "attitude.magnetometer-needs-turning"
        return imu, None, sd, (_finding(code, imu, used, raw_scatter, scatter),)
    said = _finding("attitude.magnetometer-calibrated", imu, used, raw_scatter, scatter)
    imu = imu.copy()
    imu[MAG] = known
    return imu, used, sd, (said.replace(severity="note"),)


def _finding(
    code: str, imu: pd.DataFrame, used: MagnetometerCalibration, raw_scatter: float, scatter: float
) -> Finding:
    """Values that the sentences about a calibration show."""
    return Finding(
        code,
        file=imu.attrs.get("source"),
        quantity="mag",
        data={f"iron_{axis}": float(v) for axis, v in zip("xyz", used.hard_iron, strict=True)},
        sd=float(used.hard_iron_sd.max()),
        field=used.field,
        soft_percent=100.0 * float(np.abs(np.linalg.eigvalsh(used.soft_iron) - 1.0).max()),
        raw_percent=100.0 * raw_scatter,
        left_percent=100.0 * scatter,
        change_deg=used.change_deg,
        sd_deg=used.direction_sd_deg,
    )


def _readings(mag: Array) -> Array:
    """Rows that are readings: not NaN, nor the zeros of drivers before the first conversion."""
    return mag[np.isfinite(mag).all(axis=1) & mag.any(axis=1)]


def _scatter(mag: Array) -> float:
    """Relative scatter of the strength of the readings that are there."""
    strength = np.linalg.norm(_readings(mag), axis=1)
    return float(strength.std() / strength.mean()) if strength.size else 0.0


def _level_share(m: Array, f: Array) -> float:
    """Horizontal part of the field, as a share, by the specific force."""
    with np.errstate(invalid="ignore", divide="ignore"):
        down = (m * f).sum(axis=1) / (np.linalg.norm(m, axis=1) * np.linalg.norm(f, axis=1))
    return float(np.sqrt(max(1.0 - float(np.nanmedian(down)) ** 2, 1e-4)))


@dataclass(frozen=True)
class _Fit:
    x: Array
    covariance: Array
    residual: Array
    scatter: float
    correlated: float


def _sphere(m: Array) -> Array:
    """Start: center and radius by linear least squares, held near zero where they do not show."""
    design = np.column_stack([2.0 * m, np.ones(len(m))])
    ridge = np.diag([1e-3, 1e-3, 1e-3, 0.0]) * len(m)
    a = np.linalg.solve(design.T @ design + ridge, design.T @ (m * m).sum(axis=1))
    return np.concatenate([a[:3], [np.sqrt(max(a[3] + a[:3] @ a[:3], 1e-6))], np.zeros(5)])


def _calibrated(m: Array, x: Array) -> tuple[Array, Array, Array, Array]:
    """Strength less the field's, (n,), calibrated readings, those without hard iron, soft iron."""
    A = np.eye(3) + np.tensordot(x[SOFT], SHAPES, 1)
    off = m - x[OFFSET]
    v = off @ A
    return np.linalg.norm(v, axis=1) - x[FIELD], v, off, A


def strength_residual(m: Array, x: Array, soft: bool = True) -> tuple[Array, Array]:
    """Strength less the field's, (n,), and its derivatives, (n, 9); (n, 4) without soft iron.

    `m`: readings, (n, 3); `x`: hard iron, field and, along `SHAPES`, soft iron, (9,).
    """
    e, v, off, A = _calibrated(m, x)
    unit = v / np.maximum(np.linalg.norm(v, axis=1), 1e-9)[:, None]
    columns = [-unit @ A, -np.ones(len(m))]
    if soft:
        columns.append(np.einsum("ni,kij,nj->nk", unit, SHAPES, off))
    return e, np.column_stack(columns)


def _fit(m: Array, start: Array, free: tuple[slice, ...]) -> _Fit:
    """Maximum posterior of the field and of the free terms."""
    open_ = np.zeros(9, dtype=bool)
    open_[FIELD] = True
    for part in free:
        open_[part] = True
    x = np.where(open_, start, 0.0)
    if OFFSET not in free:
        x[FIELD] = np.linalg.norm(m, axis=1).mean()
    prior = np.concatenate([np.full(3, OFFSET_PRIOR**-2), [0.0], np.full(5, SOFT_PRIOR**-2)])
    prior = prior[open_]
    covariance = np.zeros((9, 9))
    # Scatter and correlation are those of residuals at a solution: on the way there the readings
    # count fully, as residuals of a wrong model are large and alike.
    scatter, correlated = FIRST_SCATTER, 1.0
    for _ in range(ROUNDS):
        damping = 0.0
        for _ in range(STEPS):
            e, J = strength_residual(m, x, SOFT in free)
            weight = np.minimum(1.0, HUBER * scatter / np.maximum(np.abs(e), 1e-12))
            information = weight / (scatter**2 * correlated)
            J = J[:, open_[: J.shape[1]]]
            gradient = J.T @ (e * information) + prior * x[open_]
            normal = J.T @ (J * information[:, None]) + np.diag(prior)
            cost = _cost(e, scatter, correlated, prior, x[open_])
            # Damped (Levenberg, Marquardt): of a plane of readings a full step goes too far.
            while damping < 1e6:
                step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
                tried = x.copy()
                tried[open_] -= step
                if (
                    _cost(_calibrated(m, tried)[0], scatter, correlated, prior, tried[open_])
                    <= cost
                ):
                    x, damping = tried, 0.1 * damping if damping > 1e-6 else 0.0
                    break
                damping = max(10.0 * damping, 1e-4)
            if damping >= 1e6 or np.abs(step).max() < 1e-6:
                break
        e, J = strength_residual(m, x)
        own = np.linalg.inv(normal)
        if SOFT not in free and OFFSET in free:
            # Soft iron that is not looked for is there all the same.
            gain = own @ J[:, open_].T @ (J[:, SOFT] * information[:, None])
            own = own + SOFT_LEFT**2 * gain @ gain.T
        covariance[np.ix_(open_, open_)] = own
        J = J[:, open_]
        correlated = _correlation(J * (weight * e)[:, None])
        # So many independent readings fewer as terms were fitted to them.
        taken = float(np.trace(np.linalg.solve(normal, J.T @ (J * information[:, None]))))
        left = max(len(m) / correlated - taken, 0.1 * len(m) / correlated, 1.0)
        lost = len(m) / correlated / left
        scatter = max(float(np.sqrt(np.mean(weight * e * e) * lost)), FINEST)
    return _Fit(x, covariance, e, scatter, correlated)


def _cost(e: Array, scatter: float, correlated: float, prior: Array, x: Array) -> float:
    """Twice the negative logarithm of the posterior, but for a constant."""
    return _huber(e, HUBER * scatter) / (scatter**2 * correlated) + float(prior @ (x * x))


def _huber(e: Array, limit: float) -> float:
    """Sum of squares, and beyond a limit of what grows in proportion."""
    size = np.abs(e)
    return float(np.where(size <= limit, size**2, 2.0 * limit * size - limit**2).sum())


def _loss(fit: _Fit, by: _Fit) -> float:
    """Sum of squared residuals, by the weights of another fit."""
    return _huber(fit.residual, HUBER * by.scatter)


def _correlation(scores: Array) -> float:
    """Integrated correlation of series, (n, k), in rows, at least 1: the mean over them.

    Up to the first negative value of each. Of residuals times derivatives it is what divides the
    information: a body that turns sees a slow disturbance from many sides.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = len(scores)
    size = next_fast_len(2 * n, real=True)
    spectrum = np.abs(rfft(scores - scores.mean(axis=0), size, axis=0)) ** 2
    values = irfft(spectrum, size, axis=0)[: n // 2]
    found = []
    for column in (values / np.maximum(values[0], 1e-300)).T:
        end = int(np.argmax(column < 0.0)) or len(column)
        found.append(max(1.0, 1.0 + 2.0 * float(column[1:end].sum())))
    return float(np.mean(found))


def change_of_direction(a: Array, b: Array) -> float:
    """Root mean square angle between vectors, deg."""
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    angles = np.arctan2(sine, (a * b).sum(axis=1))
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


def direction_sd(soft_iron: Array, field: float, covariance: Array) -> float:
    """Root mean square error of the field's direction over all directions, one axis, deg.

    `covariance`: of hard iron and soft iron along `SHAPES`, (8, 8).
    """
    of_offset = soft_iron @ covariance[:3, :3] @ soft_iron.T
    # Of a random unit vector u, E|S u - (u'S u) u|² = (1/3 - 2/15) |S|² for S without a trace.
    shape = 0.2 * np.einsum("kl,kij,lij->", covariance[3:, 3:], SHAPES, SHAPES)
    squared = (2.0 / 3.0) * np.trace(of_offset) / field**2 + shape
    return float(np.degrees(np.sqrt(0.5 * max(squared, 0.0))))


# --- iron and axes from rests in many poses, each in a field of its own -----------------

#: Information, its right side or step, and logarithm of the chance, for each scatter of the field.
Part = tuple[Array, Array, Array]

#: Rotation of a magnetometer in its case before rests show it, rad; fewest rests that do.
ROTATION_PRIOR, LEAST_RESTS = 0.05, 5
#: By how much another order of the axes must fit the dip better, in squares.
SWAPPED = 10.0
#: Means of the readings of a motion, each of one reading at least; readings of all at most.
MEANS, MOST_MOVING = 16, 20_000
#: Relative scatter of the field over which the likelihood is summed.
SCATTERS = np.geomspace(1e-4, 0.3, 33)
#: Correlation of the errors of strength and vertical part beside that of a scatter that is equal
#: along all axes: people and cars do not choose an axis, and yet it need not be equal.
ISOTROPIC = (0.8, 0.95, 1.0)
#: Variance, in squares of the field, of a straight line in the strength over a motion: any.
LINE = 100.0
#: Steps of the fit at most, and the one at which it ends.
STEPS_OF_POSES, SMALL = 30, 1e-7
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
    fit = _FitOfPoses(mag / size, stretch, rests, up, up_covariance)
    fit.begin(start.hard_iron / size, start.soft_iron)
    for _ in range(STEPS_OF_POSES):
        step, covariance = fit.step()
        fit.move(step)
        if np.abs(step).max() < SMALL:
            break
    return fit.result(start, size, covariance)


class _FitOfPoses:
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
        moving = moving[:: max(1, -(-len(moving) // MOST_MOVING))]
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
