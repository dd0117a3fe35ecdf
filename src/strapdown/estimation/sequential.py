"""The observations of an epoch, one after the other, under a rule that is asked at each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Innovations
from strapdown.estimation.covariance_input import bad_observation
from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


def take_by_rule(
    expect: Callable[..., tuple[float, float]],
    take: Callable[..., None],
    parts: tuple[Array, Array],
    x: Array,
    observations: tuple[Array, Array, Array],
    rule: UpdateRule | Sequence[UpdateRule],
    work: Array,
) -> Innovations:
    """Change the parts of a covariance and x, in place, by every observation.

    Parameters
    ----------
    expect, take : kernels
        The two halves of a scalar step; between them the rule is asked.
    parts : (ndarray, ndarray)
        What the kernels keep a covariance in.
    x : ndarray, (n,)
    observations : (z, H, R)
    rule : UpdateRule, or a sequence of them
    work : ndarray
        What `expect` leaves to `take`.
    """
    z, H, R = observations
    matrix, diagonal = parts
    told = np.empty((3, len(z)))
    steps = [one.step for one in rule] if isinstance(rule, Sequence) else [rule.step] * len(z)
    if len(steps) != len(z):
        raise ConfigError(
            "estimation.rules-observations", quantity="rule", count=len(steps), count_2=len(z)
        )
    for j, (r, step) in enumerate(zip(R.tolist(), steps, strict=True)):
        nu, s = expect(matrix, diagonal, x, z, H, j, work)
        if not (0.0 <= r < math.inf and math.isfinite(nu) and math.isfinite(s)):
            raise bad_observation(j, nu, s, R)
        moved, slope, used, weight = step(nu, s, r)
        if weight != 0.0:
            take(matrix, diagonal, x, H, j, work, s, moved, slope, used)
        told[0, j], told[1, j], told[2, j] = nu, s + r, weight
    return Innovations(told[0], told[1], told[2])


def contiguous(*arrays: Array) -> list[Array]:
    """Return arrays as the kernels want them."""
    return [np.ascontiguousarray(a, dtype=np.float64) for a in arrays]


def own(array: Array) -> Array:
    """Return a copy that the kernels may change."""
    return np.array(array, dtype=np.float64, order="C")
