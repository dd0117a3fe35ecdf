"""The matrix that turns a sensor's axes into those of the body: what it may be, and its checks.

Its rows are the body's forward, right and down, each in components along the sensor's x, y, z:
``v_body = M v_sensor``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError, Finding

__all__ = ["NAMED_AXES", "axes_letters", "check_axes_matrix", "report_transposed"]

Array = NDArray[np.float64]

#: Designs of units by name. Of Chernodarov (2009): with its (1,4) made -Θz, the printed matrix of
#: (1) is that of ``2 dq/dt = q (0, ω)`` for ``ω = (-Θy, Θx, Θz)``: gyros turned by 90° about z.
NAMED_AXES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "chernodarov-2009": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}
#: How far ``M M'`` may be from 1: three decimals of a cosine, and no misalignment.
ROUNDING = 2e-3
# A vehicle that is aligned stands within so much of level, and far from it where axes are wrong.
_LEVEL, _FAR = 0.94, 0.7  # cosines of 20° and 45°


def check_axes_matrix(matrix: ArrayLike, quantity: str = "matrix") -> Array:
    """Check that a matrix turns one right-handed triad into another.

    Parameters
    ----------
    matrix : array_like, (3, 3)
        Sensor axes to body forward-right-down.
    quantity : str
        For messages.

    Returns
    -------
    ndarray, (3, 3)
        The rotation nearest to it: what the rounding of its decimals left out is put back.

    Raises
    ------
    ConfigError
        It is not three by three finite numbers, its rows are not unit vectors at right angles to
        2e-3, or it is a mirror image (determinant -1).
    """
    try:
        m = np.array(matrix, dtype=np.float64)
    except (TypeError, ValueError):
        m = np.empty(0)
    if m.shape != (3, 3) or not np.isfinite(m).all():
        raise ConfigError("sensors.not-three-rows-three-finite", quantity=quantity)
    product = m @ m.T
    worst = np.unravel_index(np.argmax(np.abs(product - np.eye(3))), (3, 3))
    if abs(product[worst] - (worst[0] == worst[1])) > ROUNDING:
        raise _not_square(product, (int(worst[0]), int(worst[1])), quantity)
    if np.linalg.det(m) < 0.0:
        raise ConfigError(
            "sensors.matrix-mirror-image",
            quantity=quantity,
            # Most likely two rows were exchanged, or one lost its sign.
            down=np.cross(m[0], m[1]) + 0.0,
        )
    u, _, vt = np.linalg.svd(m)
    return np.asarray(u @ vt)


def _not_square(product: Array, worst: tuple[int, int], quantity: str) -> ConfigError:
    rows = ("forward", "right", "down")
    i, j = sorted(worst)
    if i == j:
        return ConfigError(
            "sensors.matrix-row-not-unit",
            quantity=quantity,
            row_number=i + 1,
            row_name=rows[i],
            length=np.sqrt(product[i, i]),
        )
    size = float(np.sqrt(product[i, i] * product[j, j]))
    angle = float(np.degrees(np.arccos(np.clip(product[i, j] / size, -1.0, 1.0))))
    return ConfigError(
        "sensors.matrix-rows-not-perpendicular",
        quantity=quantity,
        first=i + 1,
        second=j + 1,
        names=(rows[i], rows[j]),
        angle=angle,
    )


def axes_letters(matrix: Array) -> tuple[str, Array]:
    """Split a rotation into axes with signs, as ``--axes`` names them, and a turn after them.

    Parameters
    ----------
    matrix : ndarray, (3, 3)
        As `check_axes_matrix` returns it.

    Returns
    -------
    letters : str
        ``x,-y,-z`` and the like: which sensor axis is nearest to forward, right and down, of all
        right-handed choices.
    turn : ndarray, (3, 3)
        What is left: ``matrix = turn @ letters``; 1 where the axes lie along the body's.
    """
    best, found = -np.inf, np.eye(3)
    for plain in _right_handed():
        fit = float(np.sum(plain * matrix))
        if fit > best + 1e-9:
            best, found = fit, plain
    words = []
    for row in found:
        axis = int(np.argmax(np.abs(row)))
        words.append(("-" if row[axis] < 0 else "") + "xyz"[axis])
    return ",".join(words), np.asarray(matrix @ found.T)


def _right_handed() -> list[Array]:
    """The 24 turns that lay axes along axes."""
    out = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in np.ndindex(2, 2, 2):
            m = np.eye(3)[list(order)] * (1.0 - 2.0 * np.array(signs))[:, None]
            if np.linalg.det(m) > 0:
                out.append(m)
    return out


def report_transposed(
    matrix: Array, force: Sequence[float] | Array, file: str, quantity: str = "matrix"
) -> tuple[Finding, ...]:
    """Say where a matrix looks transposed: it lays gravity aside, and its transpose does not.

    Parameters
    ----------
    matrix : ndarray, (3, 3)
    force : array_like, (3,), m/s²
        Mean specific force in body axes, after the matrix.
    file, quantity : str
        For messages.

    Returns
    -------
    tuple of Finding
    """
    body = np.asarray(force, dtype=np.float64)
    size = float(np.linalg.norm(body))
    if not size > 0.0:
        return ()
    up = body / size
    other = matrix.T @ matrix.T @ up
    if -up[2] > _FAR or -other[2] < _LEVEL:
        return ()
    tilt = float(np.degrees(np.arccos(np.clip(-up[2], -1.0, 1.0))))
    return (
        Finding(
            "sensors.matrix-looks-transposed-body-lies", file=file, quantity=quantity, tilt=tilt
        ),
    )
