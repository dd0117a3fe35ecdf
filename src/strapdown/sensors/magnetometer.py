"""Hard and soft iron of a magnetometer, from a log in which it turned."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError, Finding
from strapdown.tables import ACCEL, MAG

Array = NDArray[np.float64]

#: Readings of a fit at most, and at least.
MOST, LEAST = 4000, 50
#: Before the log is read: hard iron as a share of the field, soft iron along each term.
OFFSET_PRIOR, SOFT_PRIOR = 1.0, 0.1
#: Residuals, in standard deviations, from which a reading counts less (Huber).
HUBER = 1.5
#: Chance at which readings of a perfect magnetometer are called wrong: beyond three sigma.
CHANCE = 0.0027
#: Change of direction beside its standard deviation from which a calibration is applied.
WORTH = 2.0
#: Terms of the model: hard iron, field, soft iron.
OFFSET, FIELD, SOFT = slice(0, 3), 3, slice(4, 9)
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
    """Hard and soft iron: ``field = soft_iron @ (reading - hard_iron)``, body axes.

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
    """

    hard_iron: Array
    soft_iron: Array = field(repr=False)
    field: float
    hard_iron_sd: Array
    residual: float
    raw_residual: float
    direction_sd_deg: float
    change_deg: float
    found: bool

    @property
    def significant(self) -> bool:
        """Whether it is found, and by more than what the log leaves open: to be applied."""
        return self.found and self.change_deg > WORTH * self.direction_sd_deg

    def apply(self, mag: ArrayLike) -> Array:
        """Calibrated readings, (n, 3) or (3,); NaN stays NaN."""
        return np.asarray((np.asarray(mag, np.float64) - self.hard_iron) @ self.soft_iron)


def calibrate_magnetometer(
    mag: ArrayLike, time: ArrayLike | None = None
) -> MagnetometerCalibration:
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
    Maximum posterior by Gauss-Newton steps, with the weights of Huber. Readings at one place have
    correlated residuals, as the field differs from place to place: their information is divided by
    the integrated correlation time, in rows (Priestley, Spectral Analysis and Time Series, 5.3.2).
    A rotation between magnetometer and gyro leaves every strength as it is, and is not found.
    """
    from scipy.stats import chi2

    rows = np.asarray(mag, dtype=np.float64).reshape(-1, 3)
    rows = rows[np.isfinite(rows).all(axis=1)]
    if len(rows) < LEAST:
        raise DataError("attitude.too-few-field-readings", quantity="mag", count=len(rows))
    m = rows[:: -(-len(rows) // MOST)]
    size = float(np.median(np.linalg.norm(m, axis=1)))
    m = m / size
    start = _sphere(m)
    raw, full = _fit(m, start, ()), _fit(m, start, (OFFSET, SOFT))
    sphere = _fit(m, start, (OFFSET,))
    # By the scatter of the best model; each is a special case of the next.
    scale = full.scatter**2 * full.correlated
    soft = (_loss(sphere, full) - _loss(full, full)) / scale > chi2.isf(CHANCE, 5)
    best = full if soft else sphere
    terms = 8 if soft else 3
    gained = (_loss(raw, full) - _loss(best, full)) / scale
    A = np.eye(3) + np.tensordot(best.x[SOFT], SHAPES, 1)
    return MagnetometerCalibration(
        hard_iron=size * best.x[OFFSET],
        soft_iron=A,
        field=size * float(best.x[FIELD]),
        hard_iron_sd=size * np.sqrt(np.diag(full.covariance)[OFFSET]),
        residual=best.scatter / float(best.x[FIELD]),
        raw_residual=raw.scatter / float(raw.x[FIELD]),
        direction_sd_deg=_direction_sd(full),
        change_deg=_between(m, (m - best.x[OFFSET]) @ A),
        found=bool(gained > chi2.isf(CHANCE, terms)),
    )


def without_iron(
    imu: pd.DataFrame, given: MagnetometerCalibration | None = None
) -> tuple[pd.DataFrame, float, tuple[Finding, ...]]:
    """Calibrate the magnetometer of a log by itself, where its iron is significant.

    Parameters
    ----------
    imu : DataFrame
        An Imu table with an accelerometer; without ``mag_x..z`` it is returned as it is.
    given : MagnetometerCalibration, optional
        Of another log, which is applied as it is.

    Returns
    -------
    imu : DataFrame
    heading_sd : float, deg
        Standard deviation that iron leaves in headings, at the dip of the log.
    findings : tuple of Finding
        What was applied; or that there is iron, and the log does not show it well enough.
    """
    if not set(MAG) <= set(imu.columns):
        return imu, 0.0, ()
    mag = imu[MAG].to_numpy(dtype=np.float64)
    if given is None and np.isfinite(mag).all(axis=1).sum() < LEAST:
        return imu, 0.0, ()
    used = calibrate_magnetometer(mag) if given is None else given
    code = "attitude.magnetometer-calibrated"
    if given is None and not used.significant:
        if not used.found:
            return imu, 0.0, ()
        code = "attitude.magnetometer-needs-turning"
    shape = np.abs(np.linalg.eigvalsh(used.soft_iron) - 1.0).max()
    finding = Finding(
        code,
        file=imu.attrs.get("source"),
        quantity="mag",
        severity="note" if code.endswith("calibrated") else "warning",
        iron=used.hard_iron.tolist(),
        sd=used.hard_iron_sd.tolist(),
        field=used.field,
        soft_percent=100.0 * float(shape),
        raw_percent=100.0 * used.raw_residual,
        left_percent=100.0 * used.residual,
        change_deg=used.change_deg,
        sd_deg=used.direction_sd_deg,
    )
    known = used.apply(mag)
    sd = used.direction_sd_deg / _level_share(known, imu[ACCEL].to_numpy(dtype=np.float64))
    if code.endswith("calibrated"):
        imu = imu.copy()
        imu[MAG] = known
    return imu, min(sd, 180.0), (finding,)


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
    """Start: center and radius by linear least squares, held near zero where nothing shows them."""
    design = np.column_stack([2.0 * m, np.ones(len(m))])
    ridge = np.diag([1e-3, 1e-3, 1e-3, 0.0]) * len(m)
    a = np.linalg.solve(design.T @ design + ridge, design.T @ (m * m).sum(axis=1))
    return np.concatenate([a[:3], [np.sqrt(max(a[3] + a[:3] @ a[:3], 1e-6))], np.zeros(5)])


def _residual(m: Array, x: Array) -> tuple[Array, Array]:
    """Strength less the field's, (n,), and its derivatives, (n, 9)."""
    A = np.eye(3) + np.tensordot(x[SOFT], SHAPES, 1)
    off = m - x[OFFSET]
    v = off @ A
    norm = np.linalg.norm(v, axis=1)
    unit = v / np.maximum(norm, 1e-9)[:, None]
    shape = np.einsum("ni,kij,nj->nk", unit, SHAPES, off)
    return norm - x[FIELD], np.column_stack([-unit @ A, -np.ones(len(m)), shape])


def _fit(m: Array, start: Array, free: tuple[slice, ...]) -> _Fit:
    """Maximum posterior of the field and of the free terms."""
    open_ = np.zeros(9, dtype=bool)
    open_[FIELD] = True
    for part in free:
        open_[part] = True
    x = np.where(open_, start, 0.0)
    if OFFSET not in free:
        x[FIELD] = np.linalg.norm(m, axis=1).mean()
    scatter, correlated, weight = 0.1, 1.0, np.ones(len(m))
    covariance = np.zeros((9, 9))
    for _ in range(30):
        prior = np.zeros(9)
        prior[OFFSET] = (OFFSET_PRIOR * x[FIELD]) ** -2
        prior[SOFT] = SOFT_PRIOR**-2
        e, J = _residual(m, x)
        weight = np.minimum(1.0, HUBER * scatter / np.maximum(np.abs(e), 1e-12))
        information = weight / (scatter**2 * correlated)
        J = J[:, open_]
        normal = J.T @ (J * information[:, None]) + np.diag(prior[open_])
        step = np.linalg.solve(normal, J.T @ (e * information) + prior[open_] * x[open_])
        x[open_] -= step
        covariance[np.ix_(open_, open_)] = np.linalg.inv(normal)
        e, _ = _residual(m, x)
        correlated = _correlation(weight * e)
        # So many independent readings fewer as terms were fitted to them.
        taken = float(np.trace(np.linalg.solve(normal, J.T @ (J * information[:, None]))))
        left = max(len(m) / correlated - taken, 0.1 * len(m) / correlated, 1.0)
        lost = len(m) / correlated / left
        scatter = max(float(np.sqrt(np.mean(weight * e * e) * lost)), 1e-6)
        if np.abs(step).max() < 1e-9:
            break
    return _Fit(x, covariance, e, scatter, correlated)


def _loss(fit: _Fit, by: _Fit) -> float:
    """Sum of squared residuals, by the weights of another fit."""
    limit = HUBER * by.scatter
    size = np.abs(fit.residual)
    return float(np.where(size <= limit, size**2, 2.0 * limit * size - limit**2).sum())


def _correlation(e: Array) -> float:
    """Integrated correlation of a series, in rows, at least 1: up to its first negative value."""
    n = len(e)
    spectrum = np.abs(np.fft.rfft(e - e.mean(), 2 * n)) ** 2
    values = np.fft.irfft(spectrum)[: n // 2]
    if values[0] <= 0.0:
        return 1.0
    values = values / values[0]
    end = int(np.argmax(values < 0.0)) or len(values)
    return float(max(1.0, 1.0 + 2.0 * values[1:end].sum()))


def _between(a: Array, b: Array) -> float:
    """Root mean square angle between vectors, deg."""
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    angles = np.arctan2(sine, (a * b).sum(axis=1))
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


def _direction_sd(fit: _Fit) -> float:
    """Root mean square error of the field's direction over all directions, one axis, deg."""
    F = fit.x[FIELD]
    A = np.eye(3) + np.tensordot(fit.x[SOFT], SHAPES, 1)
    of_offset = A @ fit.covariance[OFFSET, OFFSET] @ A.T
    of_shape = fit.covariance[SOFT, SOFT]
    # Of a random unit vector u, E|S u - (u'S u) u|² = (1/3 - 2/15) |S|² for S without a trace.
    shape = 0.2 * np.einsum("kl,kij,lij->", of_shape, SHAPES, SHAPES)
    squared = (2.0 / 3.0) * np.trace(of_offset) / F**2 + shape
    return float(np.degrees(np.sqrt(0.5 * squared)))
