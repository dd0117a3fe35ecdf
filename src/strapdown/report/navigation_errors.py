"""A run of navigation beside its truth: errors, their bounds, and the two together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.trajectory_differences import ROTATION_ERROR, trajectory_differences
from strapdown.exceptions import Finding
from strapdown.navigation.record import NavigationRecord
from strapdown.report.error_envelope import PLANE_95
from strapdown.report.navigation_told import NavigationTold
from strapdown.tables import EULER, NED, VELOCITY

__all__ = ["PHYSICAL", "NavigationErrors", "Score", "navigation_errors"]

Array = NDArray[np.float64]

#: Errors of which the covariance of a record is, in its order.
PHYSICAL = 9
# Of a correlation matrix: what is less is a direction that is known.
_KNOWN = 1e-10


@dataclass(frozen=True)
class Score:
    """Errors of one quantity over a run.

    Attributes
    ----------
    quantity, unit : str
    rms, largest : float
    largest_at : float, s
    bound : float
        Root mean square of the bounds of 95 %.
    share : float
        Of the instants at which the error is within its bound.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    bound: float
    share: float


@dataclass(frozen=True, eq=False)
class NavigationErrors:
    """Errors at the samples that follow the marks of the covariance.

    Attributes
    ----------
    errors : DataFrame
        As `trajectory_differences`, by time.
    sd : ndarray, (n, 9)
        Standard deviations of the same: north, east, down m, velocities m/s, roll, pitch,
        heading deg.
    plane_sd : ndarray, (n,)
        Of the horizontal error along itself, m.
    nees : ndarray, (n,)
        Normalised error squared of place, velocity and attitude.
    freedom : ndarray, (n,)
        Directions in which the covariance does not vanish: those that the sum is over.
    findings : tuple of Finding
        Of the comparison.
    """

    errors: pd.DataFrame
    sd: Array
    plane_sd: Array
    nees: Array
    freedom: NDArray[np.intp]
    findings: tuple[Finding, ...]

    @property
    def time(self) -> Array:
        """Of the samples, (n,), s."""
        return self.errors.index.to_numpy(dtype=np.float64)

    @cached_property
    def scores(self) -> tuple[Score, ...]:
        """Errors of each quantity, and of the horizontal place."""
        found = [
            self._score(name, unit, self.errors[name].to_numpy(), TWO_SIDED_95 * self.sd[:, k])
            for k, (name, unit) in enumerate(
                [*((n, "m") for n in NED), *((n, "m/s") for n in VELOCITY)]
                + [(n, "deg") for n in EULER]
            )
        ]
        size = np.hypot(*(self.errors[n].to_numpy() for n in NED[:2]))
        return self._score("horizontal", "m", size, PLANE_95 * self.plane_sd), *found

    def score(self, quantity: str) -> Score:
        """That of one quantity."""
        return next(s for s in self.scores if s.quantity == quantity)

    def _score(self, name: str, unit: str, error: Array, bound: Array) -> Score:
        worst = int(np.argmax(np.abs(error)))
        return Score(
            name,
            unit,
            float(np.sqrt(np.mean(np.square(error)))),
            float(abs(error[worst])),
            float(self.time[worst]),
            float(np.sqrt(np.mean(np.square(bound)))),
            float(np.mean(np.abs(error) <= bound)),
        )


def navigation_errors(told: NavigationTold) -> NavigationErrors | None:
    """Compare a run with its truth.

    Parameters
    ----------
    told : NavigationTold

    Returns
    -------
    NavigationErrors or None
        None without a truth.

    Raises
    ------
    DataError
        As `trajectory_differences`: the truth has no instant in common with the run.
    """
    if told.truth is None:
        return None
    record = told.record
    rows, marks = _samples_of_marks(record)
    errors = trajectory_differences(record.trajectory.iloc[rows], told.truth, told.ellipsoid)
    kept = np.isin(record.trajectory.index.to_numpy()[rows], errors.index.to_numpy())
    P, sd = record.covariance[marks[kept]], record.sd.to_numpy(dtype=np.float64)[marks[kept]]
    found = np.column_stack(
        [
            errors[[*NED, *VELOCITY]].to_numpy(dtype=np.float64),
            np.radians(errors[ROTATION_ERROR].to_numpy(dtype=np.float64)),
        ]
    )
    nees, freedom = normalised_squares(found, P)
    return NavigationErrors(
        errors,
        sd,
        _along(found[:, :2], P[:, :2, :2]),
        nees,
        freedom,
        tuple(errors.attrs["findings"]),
    )


def _samples_of_marks(record: NavigationRecord) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of the trajectory at or after a mark, and the last mark before each."""
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    at = np.searchsorted(time, record.sd.index.to_numpy(dtype=np.float64) - 1e-9)
    marks = np.flatnonzero(at < len(time))
    # Of several marks within one step the last counts.
    last = np.append(np.diff(at[marks]) > 0, True)[: len(marks)]
    return at[marks][last], marks[last]


def normalised_squares(errors: Array, P: Array) -> tuple[Array, NDArray[np.intp]]:
    """Errors squared by the inverse of their covariance, over what is not known for certain.

    Parameters
    ----------
    errors : ndarray, (n, m)
    P : ndarray, (n, m, m)

    Returns
    -------
    squares : ndarray, (n,)
        ``e' P^-1 e``, or with the pseudoinverse where P is singular.
    freedom : ndarray of int, (n,)
    """
    sd = np.sqrt(np.maximum(np.diagonal(P, axis1=1, axis2=2), 0.0))
    scale = np.where(sd > 0.0, sd, 1.0)
    unit = P / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(unit)
    whole = values > _KNOWN
    along = np.einsum("nji,nj->ni", vectors, errors / scale)
    squares = np.where(whole, np.square(along) / np.where(whole, values, 1.0), 0.0)
    return squares.sum(axis=1), whole.sum(axis=1)


def _along(errors: Array, P: Array) -> Array:
    """Reach of an ellipse of one standard deviation in the direction of an error, (n,).

    An error is as many of these as its normalised length, so that comparing it with this is to
    ask whether it lies in the ellipse.
    """
    size = np.hypot(*errors.T)
    squares, _ = normalised_squares(errors, P)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = size / np.sqrt(squares)
    largest = np.sqrt(np.maximum(np.linalg.eigvalsh(P)[:, -1], 0.0))
    return np.asarray(np.where(squares > 0.0, reach, largest))
