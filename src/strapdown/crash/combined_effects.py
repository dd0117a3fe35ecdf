"""What the unknowns of several units do to a weighted mean of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.sample_effects import SampleEffects

Array = NDArray[np.float64]

__all__ = ["SampleWeights", "combine_effects"]


@dataclass(frozen=True, eq=False)
class SampleWeights:
    """The part of a mean that is one unit's.

    Attributes
    ----------
    force : ndarray, (n, 3, 3) or (3, 3)
        Of each sample of the specific force, vehicle axes.
    rest : ndarray, (3, 3)
        Of the mean specific force at rest.
    tilt : float
        Of the attitude at rest, as far as it does not follow from that force.
    rate : float
    """

    force: Array
    rest: Array
    tilt: float
    rate: float

    @classmethod
    def alike(cls, weight: float) -> SampleWeights:
        """One number for all."""
        whole = weight * np.eye(3)
        return cls(whole, whole, weight, weight)


def combine_effects(
    parts: Sequence[SampleEffects], weights: Sequence[float | SampleWeights]
) -> SampleEffects:
    """Effects on a weighted mean of units at one point.

    Parameters
    ----------
    parts : sequence of SampleEffects
        Of units on the same stamps and at the same point. Unknowns of one name are one unknown,
        as of a gyro that two units share; the others are independent.
    weights : sequence of float or SampleWeights
        Summing to one.

    Returns
    -------
    SampleEffects
        The attitude at rest is the mean of theirs. Noise is that of independent units.
    """
    rows: dict[str, int] = {}
    contributors: list[str] = []
    for part in parts:
        for name, contributor in zip(part.names, part.contributors, strict=True):
            if name not in rows:
                rows[name] = len(rows)
                contributors.append(contributor)
    count, shape = len(rows), parts[0].force_noise.shape
    force, rate = np.zeros((count, *shape)), np.zeros((count, *shape))
    rest, tilt = np.zeros((count, 3)), np.zeros((count, 3))
    force_noise, rate_noise = np.zeros(shape), np.zeros(shape)
    for part, given in zip(parts, weights, strict=True):
        weight = given if isinstance(given, SampleWeights) else SampleWeights.alike(float(given))
        at = [rows[name] for name in part.names]
        force[at] += np.einsum("...ij,p...j->p...i", weight.force, part.force)
        rate[at] += weight.rate * part.rate
        rest[at] += part.rest_force @ weight.rest.T
        tilt[at] += weight.tilt * part.tilt
        force_noise += np.einsum("...ij,...j->...i", weight.force**2, part.force_noise**2)
        rate_noise += weight.rate**2 * part.rate_noise**2
    return SampleEffects(
        tuple(rows),
        tuple(contributors),
        force,
        rate,
        rest,
        tilt,
        np.sqrt(force_noise),
        np.sqrt(rate_noise),
    )
