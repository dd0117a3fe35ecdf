"""Slow noise in a record that its sensors do not explain, from what an inertial fit leaves over.

The fit lives on the Legendre degrees 2 and 3 of the second integral of the specific force. The
degrees above hold noise alone: from 4 to 20, two horizontal axes each, their energies tell how
much there is and how it falls with the frequency, and so what it is at degrees 2 and 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.block_means import CHANCE
from strapdown.alignment.inertial_fit import DEGREES, FIRST_FREE, InertialFit, functionals
from strapdown.alignment.inertial_sums import InertialSums
from strapdown.dsp.chi_square import chi_square_exceeded
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]

__all__ = ["KINDS", "ResidualNoise", "residual_noise"]

#: White in the place, in the velocity, in the force, and in the force's derivative.
KINDS = ("place", "velocity", "force", "walk")
_ROUNDS = 300


@dataclass(frozen=True, eq=False)
class ResidualNoise:
    """Excess over the noise of the sensors.

    Attributes
    ----------
    ratio : float
        Root of the mean ratio of energies: measured over what the sensors explain.
    significant : bool
        Whether chance gives so much less often than one time in a million.
    excess : ndarray, (4,)
        Spectral densities of `KINDS`: m²/Hz, (m/s)²/Hz, (m/s²)²/Hz, (m/s³)²/Hz; zero where it
        is not significant.
    sway : float, m
        Root mean square of the horizontal excursion that no fit takes away.
    """

    ratio: float
    significant: bool
    excess: Array
    sway: float

    def covariance(self, sums: InertialSums, push: Array, place: Array) -> Array:
        """Covariance of an answer to errors of velocity gain and place; as `Response`.

        Parameters
        ----------
        sums : InertialSums
        push, place : ndarray, (m, k, 3)

        Returns
        -------
        ndarray, (k, k)
        """
        dt = sums.node_length
        by_place, by_force = place, push
        by_velocity = _onward(place * dt[:, None, None])
        by_walk = _onward(push * dt[:, None, None])
        total = np.zeros((push.shape[1], push.shape[1]))
        for density, response in zip(
            self.excess, (by_place, by_velocity, by_force, by_walk), strict=True
        ):
            total += density * np.einsum("mki,mli,m->kl", response, response, dt)
        return total


def _onward(response: Array) -> Array:
    """Sum over all later nodes, and half of the own."""
    return np.asarray(np.cumsum(response[::-1], axis=0)[::-1] - 0.5 * response)


def residual_noise(sums: InertialSums, fit: InertialFit, sensors: ImuUncertainty) -> ResidualNoise:
    """Judge what a fit leaves over.

    Parameters
    ----------
    sums : InertialSums
    fit : InertialFit
    sensors : ImuUncertainty

    Returns
    -------
    ResidualNoise

    Notes
    -----
    The energies of a degree are exponentially distributed about the sum of what each kind of
    noise makes of it; densities of the greatest likelihood are found by steps that keep them
    positive and never lose likelihood (Févotte and Idier 2011, doi:10.1162/NECO_a_00168, the
    Itakura-Saito divergence with exponent 1/2).
    """
    shapes = _energies(sums)[:, FIRST_FREE:]
    g = float(np.linalg.norm(sums.node_velocity.sum(axis=0))) / sums.length
    drift = sensors.accel_drift
    known = max(sensors.accel.axis("noise_density")) ** 2 * shapes[2]
    walk = (g * max(sensors.gyro.axis("noise_density"))) ** 2
    walk += 2.0 * max(drift.triad) ** 2 / drift.correlation_time
    known = known + walk * shapes[3]
    energy = np.square(fit.residual[FIRST_FREE:, :2]).sum(axis=1)
    # What rounding leaves of a second integral of some 1e6 m.
    known = known + (1e-14 * float(np.abs(sums.fallen[-1]).max())) ** 2
    axes = 2 * len(energy)
    statistic = float((energy / known).sum())
    significant = statistic > chi_square_exceeded(CHANCE, axes)
    excess = np.zeros(len(KINDS))
    if significant:
        excess = _likeliest(energy, known, shapes)
    degrees = np.arange(FIRST_FREE, DEGREES)
    slow = float((np.square(fit.residual[FIRST_FREE:, :2]).T / (2.0 * degrees + 1.0)).sum())
    return ResidualNoise(
        float(np.sqrt(statistic / axes)), significant, excess, float(np.sqrt(slow))
    )


def _energies(sums: InertialSums) -> Array:
    """Variance of each degree per unit density of each kind, (4, DEGREES)."""
    place, push = functionals(sums)
    dt = sums.node_length
    later = np.triu(np.ones((len(dt), len(dt))), 1).T + 0.5 * np.eye(len(dt))
    velocity, walk = (place * dt) @ later, (push * dt) @ later
    return np.array([(np.square(x) * dt).sum(axis=1) for x in (place, velocity, push, walk)])


def _likeliest(energy: Array, known: Array, shapes: Array) -> Array:
    scale = energy.mean() / np.maximum(shapes.mean(axis=1), 1e-300)
    density = scale / len(shapes)
    for _ in range(_ROUNDS):
        model = known + density @ shapes
        # Two axes share a degree: its energy is twice the variance on average.
        up = shapes @ (0.5 * energy / model**2)
        down = shapes @ (1.0 / model)
        density = density * np.sqrt(up / np.maximum(down, 1e-300))
    return np.asarray(density)
