"""How gravity turns in the body, as the accelerometer sees it and as the gyro predicts it.

A specific force that is constant in the world obeys df/dt = -w x f in the body (differentiate
f_b = C_bn f_n with dC_bn/dt = -[w x] C_bn). Weighted with a triangle of half-width T and
integrated by parts, the left side becomes the difference of two neighbouring means of f over T,
and nothing is assumed of how far the body turns in between. What is left over is the motion's
own acceleration, of which the means over T hold no more than the change of velocity in T.

With unknown gyro scale k, axes M (a signed permutation of the gyro's axes) and bias b,
w = k M g + b is linear in (k M, b), so that every hypothesis is judged by one small Gram matrix.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.running_integral import running_integral

Array = NDArray[np.float64]

# Long enough for the accelerations of hands and legs to average out, and of different lengths,
# so that an acceleration in step with the turn (a swinging arm), which grows with the square of
# the frequency, does not look the same in all.
HALF_WIDTHS = (0.5, 1.0, 2.0, 4.0)  # s
LEAST_WINDOWS = 3
# A scale factor of 3 % and misalignments of 1 to 2 degrees are in the data sheets of consumer
# sensors, and the acceleration of an arm in step with its turn adds its share; a difference below
# that tells nothing. Units differ by far more.
MODEL_ERROR = 0.1
# Zero-rate output, one sigma (MPU-6050 data sheet: within 20 deg/s).
BIAS_SD = 0.12  # rad/s
# Below this an offset or a scale error of the accelerometer could turn the direction as much.
LEAST_SIGNAL = 1e-4  # of gravity
_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


def signed_permutations() -> tuple[tuple[str, ...], Array]:
    """The 48 ways to lay the gyro's axes on the accelerometer's, the identity first.

    Returns
    -------
    names : tuple of str
        As ``x,-y,z``: which gyro axis stands along each axis of the accelerometer.
    matrices : ndarray, (48, 3, 3)
    """
    names, matrices = [], []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            names.append(
                ",".join(
                    ("-" if s < 0 else "") + "xyz"[k] for k, s in zip(order, signs, strict=True)
                )
            )
            matrices.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
    return tuple(names), np.array(matrices)


@dataclass(frozen=True)
class Turn:
    """One scale of time: the sums that every hypothesis is judged by.

    Attributes
    ----------
    half_width : float, s
    windows : int
        Windows that do not overlap.
    gram : ndarray, (10, 10)
        Of the nine elements of k M (row by row) and the change of gravity, with the bias taken
        out; gravity has norm 1.
    """

    half_width: float
    windows: int
    gram: Array

    @property
    def signal(self) -> float:
        """Root mean square change of gravity's direction, rad, what a bias explains left out."""
        return float(np.sqrt(max(self.gram[9, 9], 0.0) / max(6 * self.windows, 1)))

    def free(self) -> tuple[Array, float]:
        """The best nine elements, and the sum of squares that they leave."""
        a, c = self.gram[:9, :9], self.gram[:9, 9]
        scale = np.sqrt(np.diag(a))
        scale = np.where(scale > 0, scale, 1.0)
        # Directions that were not turned about stay zero.
        best = np.linalg.pinv(a / np.outer(scale, scale), rcond=1e-9, hermitian=True) @ (c / scale)
        best = best / scale
        return best.reshape(3, 3), float(max(self.gram[9, 9] - c @ best, 0.0))

    def log_likelihoods(self, matrices: Array) -> tuple[Array, Array]:
        """Logarithm of the likelihood of each (m, 3, 3) matrix k M, and what it explains.

        Relative to a gyro that predicts nothing, so that windows of different units of time
        compare. The noise is not known; it is integrated out, which leaves the power
        -windows / 2 of the sum of squares, to which the model's own error is added.
        """
        c = matrices.reshape(len(matrices), 9)
        a = np.einsum("ni,ij,nj->n", c, self.gram[:9, :9], c)
        left = np.maximum(self.gram[9, 9] - 2.0 * c @ self.gram[:9, 9] + a, 0.0)
        floor = MODEL_ERROR**2 * np.maximum(a, 0.0) + 6 * self.windows * LEAST_SIGNAL**2
        logs = -0.5 * self.windows * np.log((left + floor) / self._nothing())
        return logs, 1.0 - left / max(self.gram[9, 9], 1e-30)

    def _nothing(self) -> float:
        """What is left where the gyro predicts nothing."""
        return float(self.gram[9, 9] + 6 * self.windows * LEAST_SIGNAL**2)

    def log_free(self) -> float:
        """The same for nine free elements, each at the price of a parameter."""
        best, left = self.free()
        c = best.reshape(9)
        predicted = float(c @ self.gram[:9, :9] @ c)
        floor = MODEL_ERROR**2 * predicted + 6 * self.windows * LEAST_SIGNAL**2
        # Five of nine elements are turned about on the way, as a rule; each costs sqrt(windows).
        # Their common scale may lie anywhere in eight decades, and fits within a tenth.
        log = -0.5 * self.windows * np.log((left + floor) / self._nothing())
        cost = 2.5 * np.log(max(self.windows, 2)) + np.log(8.0 * np.log(10.0) / MODEL_ERROR)
        return float(log - cost)


def turns(time: Array, gyro: Array, force: Array) -> tuple[Turn, ...]:
    """Sums over each scale of time that the log is long enough for.

    Parameters
    ----------
    time : ndarray, (n,), s
        Increasing.
    gyro : ndarray, (n, 3)
        In any unit.
    force : ndarray, (n, 3)
        In units of gravity, of either sign.
    """
    step = np.diff(time)
    # (w x f)_a = e_abc w_b f_c; products of the gyro's axis d and the force's axis c.
    products = (gyro[:, :, None] * force[:, None, :]).reshape(-1, 9)
    signals = np.hstack([force, products])
    once = running_integral(time, signals)
    twice = running_integral(time, once)
    holes = step > max(0.1, 5.0 * float(np.quantile(step, 0.95)))
    found = []
    for width in HALF_WIDTHS:
        if time[-1] - time[0] < (LEAST_WINDOWS + 1) * width or float(np.median(step)) > width / 4:
            continue
        found += _turn(time, once, twice, holes, width)
    return tuple(found)


def _turn(
    time: Array, once: Array, twice: Array, holes: NDArray[np.bool_], width: float
) -> list[Turn]:
    grid = np.arange(time[0], time[-1] - 2 * width + 1e-9, 0.5 * width)
    # At samples, not between them: there the integrals are known.
    at = np.array([np.searchsorted(time, grid + k * width) for k in (0, 1, 2)])
    at = np.minimum(at, time.size - 1)
    hole = np.concatenate([[0], np.cumsum(holes)])
    i0, i1, i2 = at
    keep = (hole[i2] == hole[i0]) & (i1 - i0 >= 3) & (i2 - i1 >= 3)
    i0, i1, i2 = i0[keep], i1[keep], i2[keep]
    windows = int(keep.sum()) // 2
    if windows < LEAST_WINDOWS:
        return []
    w1, w2 = (time[i1] - time[i0])[:, None], (time[i2] - time[i1])[:, None]
    # A triangle that rises over w1 and falls over w2, by parts: P at the peak less the mean of P
    # over the rise, and the mean of P over the fall less P at the peak.
    y = (once[i2] - once[i1])[:, :3] / w2 - (once[i1] - once[i0])[:, :3] / w1
    weighted = (twice[i2] - twice[i1]) / w2 - (twice[i1] - twice[i0]) / w1
    f_weighted, p_weighted = weighted[:, :3], weighted[:, 3:].reshape(-1, 3, 3)
    # Regressor of element M[b, d]: -e_abc (weighted product d, c).
    x = -np.einsum("abc,ndc->nabd", _LEVI_CIVITA, p_weighted).reshape(-1, 9)
    bias = -np.einsum("abc,nc->nab", _LEVI_CIVITA, f_weighted).reshape(-1, 3)
    block = np.column_stack([x, y.reshape(-1)])
    # The spread of what nothing explains sets how hard the bias is held within its range.
    scale = np.linalg.norm(block, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    full = np.column_stack([x / scale[:9], bias])
    left = block[:, 9] - full @ np.linalg.lstsq(full, block[:, 9], rcond=1e-9)[0]
    noise = float(np.sqrt(np.mean(left**2)) + LEAST_SIGNAL) / BIAS_SD
    held = bias.T @ bias + noise**2 * np.eye(3)
    cross = bias.T @ block
    gram = block.T @ block - cross.T @ np.linalg.solve(held, cross)
    return [Turn(width, windows, gram)]
