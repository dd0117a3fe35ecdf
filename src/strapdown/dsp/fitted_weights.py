"""Value and slope of a polynomial fitted to a few samples, as weights of the samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

__all__ = ["bandwidth", "fitted_weights", "slope_response"]


def fitted_weights(time: Array, at: Array, degree: int) -> tuple[Array, Array]:
    """Weights of the value and the slope of a polynomial of least squares.

    Parameters
    ----------
    time : ndarray, (m, w), s
        Stamps of the samples of m windows, increasing, any spacing.
    at : ndarray, (m,), s
        Where each is told.
    degree : int
        1 to w - 1.

    Returns
    -------
    value : ndarray, (m, w)
    slope : ndarray, (m, w), 1/s

    Notes
    -----
    With equal steps the filters of Savitzky and Golay (1964, doi:10.1021/ac60214a047). The basis
    is Legendre's over the window, for which the normal equations are well conditioned.
    """
    middle, half = 0.5 * (time[:, -1] + time[:, 0]), 0.5 * (time[:, -1] - time[:, 0])
    basis = legendre.legvander((time - middle[:, None]) / half[:, None], degree)
    turned = basis.transpose(0, 2, 1)
    coefficients = np.linalg.solve(turned @ basis, turned)
    u = (at - middle) / half
    value = legendre.legvander(u, degree)
    slope = legendre.legvander(u, degree - 1) @ legendre.legder(np.eye(degree + 1))
    return (
        np.einsum("mk,mkw->mw", value, coefficients),
        np.einsum("mk,mkw->mw", slope, coefficients) / half[:, None],
    )


def slope_response(weights: Array, offset: Array, frequency: Array) -> NDArray[np.complex128]:
    """Output of weights of a slope per true derivative of a sine.

    Parameters
    ----------
    weights : ndarray, (w,), 1/s
    offset : ndarray, (w,), s
        Of each sample from where the slope is told.
    frequency : ndarray, (k,), Hz
        Above zero.

    Returns
    -------
    ndarray of complex, (k,)
    """
    omega = 2.0 * np.pi * frequency
    return np.asarray(np.exp(1j * np.outer(omega, offset)) @ weights / (1j * omega))


def bandwidth(
    response: Callable[[Array], NDArray[np.complex128]], highest: float, parts: int, loss: float
) -> float:
    """Frequency below which the size of a response is off one by no more than a loss.

    Parameters
    ----------
    response : callable
        Of frequencies, (k,), Hz.
    highest : float, Hz
        Half the rate of the samples.
    parts : int
        Of the grid on which the first frequency beyond is looked for.
    loss : float

    Returns
    -------
    float, Hz
    """
    grid = np.linspace(0.0, highest, parts)[1:]
    over = np.abs(1.0 - np.abs(response(grid))) > loss
    k = int(np.argmax(over)) if over.any() else len(grid) - 1
    low, high = (grid[k - 1] if k else 0.0), grid[k]
    for _ in range(50):
        middle = 0.5 * (low + high)
        if abs(1.0 - abs(response(np.array([middle]))[0])) > loss:
            high = middle
        else:
            low = middle
    return float(low)
