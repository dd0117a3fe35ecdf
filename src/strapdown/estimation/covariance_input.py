"""What is asked of the matrices that a covariance form is given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError

Array = NDArray[np.float64]

#: How far correlations may be from symmetric, and below zero as eigenvalues, in n roundings.
ROUNDINGS = 1e3


def checked_covariance(P: Array) -> Array:
    """Return a covariance as an array of its own, exactly symmetric.

    Parameters
    ----------
    P : array_like, (n, n)

    Returns
    -------
    ndarray, (n, n)

    Raises
    ------
    DataError
        P is not square, not finite, not symmetric, or not positive semidefinite.
    """
    P = np.array(P, dtype=np.float64, order="C")
    if P.ndim != 2 or P.shape[0] != P.shape[1] or not P.size:
        raise _bad("estimation.covariance-not-square", shape=str(P.shape))
    if not np.isfinite(P).all():
        i, j = np.argwhere(~np.isfinite(P))[0]
        raise _bad("estimation.covariance-not-finite", value=P[i, j], i=i + 1, j=j + 1)
    variances = np.diagonal(P)
    if (variances < 0.0).any():
        i = int(np.argmin(variances))
        raise _bad("estimation.variance-negative", value=P[i, i], i=i + 1)
    sd = np.sqrt(variances)
    known = sd == 0.0
    if (P[known] != 0.0).any():
        i = int(np.flatnonzero(known & (P != 0.0).any(axis=1))[0])
        raise _bad("estimation.covariance-without-variance", i=i + 1)
    unit = np.where(known, 1.0, sd)
    correlation = P / unit[:, None] / unit
    tolerance = ROUNDINGS * len(P) * np.finfo(np.float64).eps
    if np.abs(correlation - correlation.T).max() > tolerance:
        i, j = np.unravel_index(np.argmax(np.abs(correlation - correlation.T)), P.shape)
        raise _bad(
            "estimation.covariance-not-symmetric",
            i=i + 1,
            j=j + 1,
            value=P[i, j],
            mirrored=P[j, i],
        )
    P = 0.5 * (P + P.T)
    lowest = float(np.linalg.eigvalsh(0.5 * (correlation + correlation.T))[0])
    if lowest < -tolerance:
        raise _bad("estimation.covariance-indefinite", eigenvalue=lowest)
    return P


def indefinite(row: int) -> DataError:
    """Return what to raise where a factorisation finds a covariance indefinite."""
    return _bad("estimation.covariance-indefinite-in-row", i=row + 1)


def _bad(code: str, **data: Any) -> DataError:
    return DataError(code, quantity="P", **data)


def check_prediction(state: Array, Phi: Array, Q: Array) -> None:
    """Raise `DataError` where the shapes of a prediction do not fit."""
    for name, given in (("Phi", Phi), ("Q", Q)):
        if given.shape != state.shape:
            raise DataError(
                "estimation.shape-covariance",
                quantity=name,
                name=name,
                shape=given.shape,
                shape_2=state.shape,
            )


def bad_prediction(row: int, Phi: Array, Q: Array) -> DataError:
    """Return what to raise where a predicted variance is no variance."""
    for name, given in (("Phi", Phi), ("Q", Q)):
        if not np.isfinite(given).all():
            i, j = np.argwhere(~np.isfinite(given))[0]
            return DataError(
                "estimation.row-column",
                quantity=name,
                name=name,
                given=given[i, j],
                i=i + 1,
                j=j + 1,
            )
    return DataError(
        "estimation.predicted-variance-state-no-variance", quantity="Q", at_row=row + 1
    )


def check_observations(x: Array, z: Array, H: Array, R: Array) -> None:
    """Raise `DataError` where the shapes of an epoch's observations do not fit."""
    if H.ndim != 2 or H.shape[1] != len(x) or not H.shape[0] == len(z) == len(R):
        raise DataError(
            "estimation.z-shape-h-r-states",
            quantity="H",
            shape=z.shape,
            shape_2=H.shape,
            shape_3=R.shape,
            count=len(x),
        )


def bad_observation(j: int, nu: float, s: float, R: Array) -> DataError:
    """Return what to raise where observation j cannot be used."""
    if not R[j] >= 0.0 or not np.isfinite(R[j]):
        return DataError("estimation.variance-observation", quantity="R", j=j + 1, r=R[j])
    which, number = (
        ("difference from its prediction", nu) if not np.isfinite(nu) else ("expected variance", s)
    )
    return DataError("estimation.observation", quantity="z", which=which, number=number, j=j + 1)
