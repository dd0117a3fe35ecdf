"""The one table of detectors of a standstill: what each makes of a window of samples.

Skog, Händel, Nilsson and Rantakokko, Zero-velocity detection - an algorithm evaluation, IEEE Trans.
Biomedical Engineering 57 (2010) 2657: a generalised likelihood ratio test of rest against any
motion, and what becomes of it where less is known of the signals. Theirs are sums of squares T, to
be below a threshold; here each is divided by the number of squares whose expectation is one at a
quiet rest, and its root taken, so that it is one there and a threshold is a number of standard
deviations: ``gamma = n threshold²``, n as in `StandstillDetector.squares`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD

__all__ = ["STANDSTILL_DETECTORS", "StandstillDetector"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StandstillDetector:
    """A statistic of a window of samples.

    Attributes
    ----------
    summary : str
    source : str
    squares : int
        Squares a sample with an expectation of one at rest.
    of : callable
        ``of(rate, force, gravity)`` with rates (w, 3) and forces (w, 3), each over the standard
        deviation of its noise, and gravity over that of the force: the mean square a sample.
    """

    summary: str
    source: str
    squares: int
    of: Callable[[Array, Array, float], float]

    def statistic(
        self, rate: Array, force: Array, rate_sd: float, force_sd: float, gravity: float
    ) -> float:
        """Return the statistic of a window: one at a quiet rest.

        Parameters
        ----------
        rate : ndarray, (w, 3), rad/s
        force : ndarray, (w, 3), m/s²
        rate_sd, force_sd : float
            Of the noise of a sample, in these units.
        gravity : float, m/s²

        Returns
        -------
        float
        """
        mean = self.of(rate / rate_sd, force / force_sd, gravity / force_sd)
        return float(np.sqrt(mean / self.squares))


def _rate_energy(rate: Array, force: Array, gravity: float) -> float:
    return float((rate**2).sum() / len(rate))


def _force_variance(rate: Array, force: Array, gravity: float) -> float:
    return float(force.var(axis=0, ddof=1).sum())


def _force_magnitude(rate: Array, force: Array, gravity: float) -> float:
    size = np.sqrt((force**2).sum(axis=1))
    return float(((size - gravity) ** 2).sum() / len(force))


def _shoe(rate: Array, force: Array, gravity: float) -> float:
    mean = force.sum(axis=0) / len(force)
    up = mean * (gravity / np.sqrt((mean**2).sum()))
    return float(((force - up) ** 2).sum() / len(force)) + _rate_energy(rate, force, gravity)


def _variance(rate: Array, force: Array, gravity: float) -> float:
    return float(rate.var(axis=0, ddof=1).sum()) + _force_variance(rate, force, gravity)


def _force_spread(rate: Array, force: Array, gravity: float) -> float:
    apart = np.median(np.abs(force - np.median(force, axis=0)), axis=0)
    return float(((MAD_TO_SD * apart) ** 2).sum())


SKOG = "Skog et al. (2010)"

STANDSTILL_DETECTORS: dict[str, StandstillDetector] = {
    "shoe": StandstillDetector(
        "rates about zero, and a force as long as gravity that stays where it is (GLRT)",
        f"{SKOG}, stance hypothesis optimal detector",
        6,
        _shoe,
    ),
    "rate_energy": StandstillDetector(
        "rates about zero; needs gyros without bias",
        f"{SKOG}, angular rate energy",
        3,
        _rate_energy,
    ),
    "force_variance": StandstillDetector(
        "a force that stays where it is, whatever it is: biases and scale factors do not matter",
        f"{SKOG}, acceleration moving variance",
        3,
        _force_variance,
    ),
    "force_magnitude": StandstillDetector(
        "a force as long as gravity, whatever its direction",
        f"{SKOG}, acceleration magnitude",
        1,
        _force_magnitude,
    ),
    "variance": StandstillDetector(
        "a rate and a force that stay where they are: no bias matters",
        f"{SKOG}, with unknown means of both",
        6,
        _variance,
    ),
    "force_spread": StandstillDetector(
        "as force_variance by medians, so that a slammed door does not count",
        "median absolute deviation (Hampel 1974)",
        3,
        _force_spread,
    ),
}
