"""A reconstructed path against a reference: cameras, or the truth of a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.leg import PLACE
from strapdown.crash.path import CrashPath
from strapdown.errors import DataError
from strapdown.sensors.triad_errors import triad_of
from strapdown.tables import NED, POSITION_SD

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PathComparison:
    """Reconstructed minus reference path.

    Attributes
    ----------
    errors : DataFrame
        ``north east down``, m, indexed by the reference's instants, s.
    bound : DataFrame
        Half width of the 95 % interval of such errors, m: path and reference together.
    rms, largest : tuple of float, m
        Over the instants, per axis; the largest by size.
    within : tuple of float
        Fraction of the instants at which the error is within the bound. Errors of neighboring
        instants are highly correlated, so the instants are not independent trials.
    chi_square : float
        For the three components at the last instant, to compare with `chi_square_95`.
    chi_square_95 : float
        95 % limit for three degrees of freedom.
    consistent : bool
        Whether the chi-square of the last instant is below the limit.
    """

    errors: pd.DataFrame = field(repr=False)
    bound: pd.DataFrame = field(repr=False)
    rms: tuple[float, float, float]
    largest: tuple[float, float, float]
    within: tuple[float, float, float]
    chi_square: float
    chi_square_95: float

    @property
    def consistent(self) -> bool:
        """Whether the covariances are consistent with the last error."""
        return self.chi_square <= self.chi_square_95


def compare_with_reference(path: CrashPath, reference: pd.DataFrame) -> PathComparison:
    """Compare a path with a reference.

    Parameters
    ----------
    path : CrashPath
    reference : DataFrame
        Indexed by time from the common trigger, s; ``north east down`` of the same point, m, in
        the axes of the path, from any origin: it is shifted so that both agree at the entry. With
        ``north_sd east_sd down_sd``, m, where it is not exact.

    Returns
    -------
    PathComparison
        At the reference's instants within the path. The path is interpolated by the cubic that
        matches its velocities, so that a reference of 1000 frames a second is not compared with
        chords.

    Raises
    ------
    DataError
        A column is missing, a value is not finite, or the two do not share the entry and at
        least one instant after it.
    """
    if not isinstance(reference, pd.DataFrame):
        raise DataError(
            "crash.reference-of-wrong-type",
            quantity="reference path",
            name=type(reference).__name__,
        )
    time, values, sd = _columns(reference)
    from scipy.interpolate import CubicHermiteSpline

    own = CubicHermiteSpline(path.time, path.table[NED].to_numpy(), path.table[["VN", "VE", "VD"]])
    inside = (time >= path.time[0] - 1e-9) & (time <= path.time[-1] + 1e-9)
    entry = path.entry.time
    if not (inside.any() and time[0] <= entry + 1e-9 and time[inside][-1] > entry):
        raise DataError(
            "crash.path-entry",
            file=reference.attrs.get("source"),
            quantity="reference path",
            time=time[0],
            time_2=time[-1],
            time_3=path.time[0],
            time_4=path.time[-1],
            entry=entry,
        )
    origin = np.array([np.interp(entry, time, values[:, k]) for k in range(3)])
    at_origin = np.array([np.interp(entry, time, sd[:, k]) for k in range(3)])
    origin = origin - own(entry)
    difference = own(time[inside]) - (values[inside] - origin)
    covariance = _covariance(path, time[inside])
    # The reading at the origin is a further independent one.
    own_noise = sd[inside] ** 2 + at_origin**2
    covariance = covariance + np.einsum("ni,ij->nij", own_noise, np.eye(3))
    bound = TWO_SIDED_95 * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    largest = difference[np.abs(difference).argmax(axis=0), range(3)]
    from scipy.stats import chi2

    index = pd.Index(time[inside], name="time")
    return PathComparison(
        pd.DataFrame(difference, index=index, columns=NED),
        pd.DataFrame(bound, index=index, columns=NED),
        triad_of(np.sqrt((difference**2).mean(axis=0))),
        triad_of(largest),
        triad_of((np.abs(difference) <= bound).mean(axis=0)),
        float(difference[-1] @ np.linalg.pinv(covariance[-1]) @ difference[-1]),
        float(chi2.ppf(0.95, 3)),
    )


def _covariance(path: CrashPath, time: Array) -> Array:
    place = path.covariance[:, PLACE, PLACE].reshape(len(path.time), 9)
    rows = np.column_stack([np.interp(time, path.time, place[:, k]) for k in range(9)])
    return np.asarray(rows.reshape(-1, 3, 3))


def _columns(reference: pd.DataFrame) -> tuple[Array, Array, Array]:
    some = any(c in reference.columns for c in POSITION_SD)
    wanted = [*NED, *(POSITION_SD if some else ())]
    missing = [c for c in wanted if c not in reference.columns]
    if missing:
        raise DataError(
            "crash.no-column",
            file=reference.attrs.get("source"),
            quantity="reference path",
            missing=missing,
        )
    try:
        time = reference.index.to_numpy(dtype=np.float64)
        both = reference[wanted].to_numpy(dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(
            "crash.not-all-numbers",
            file=reference.attrs.get("source"),
            quantity="reference path",
            error=error,
        ) from None
    values, sd = both[:, :3], both[:, 3:] if some else np.zeros((len(both), 3))
    bad = ~(np.isfinite(values).all(axis=1) & np.isfinite(sd).all(axis=1) & np.isfinite(time))
    stuck = np.r_[False, np.diff(time) <= 0.0]
    for code, rows in (
        ("crash.reference-not-finite", bad),
        ("crash.reference-sd-negative", (sd < 0.0).any(axis=1)),
        ("crash.reference-time-does-not-advance", stuck),
    ):
        if rows.any():
            raise DataError(
                code,
                file=reference.attrs.get("source"),
                row=int(np.argmax(rows)) + 1,
                quantity="reference path",
            )
    if not len(time):
        raise DataError(
            "crash.no-rows", file=reference.attrs.get("source"), quantity="reference path"
        )
    return time, values, sd
