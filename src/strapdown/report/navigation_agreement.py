"""Whether innovations are as large, and as free of memory, as the filter expected."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.evaluation.nees import band_of_mean
from strapdown.navigation.consistency import (
    ComponentConsistency,
    ObservationConsistency,
    consistency_of,
)
from strapdown.navigation.record import NavigationRecord

__all__ = ["Agreement", "agreements", "chi_square_far"]

Array = NDArray[np.float64]

#: A root mean square of innovations beyond this many of the expected standard deviation, or below
#: one over it, speaks against what was stated.
FAR_OFF = 2.0
#: Where half of the epochs are beyond so many times what was expected, the answer itself is
#: refuted: outliers do not reach a median.
REFUTES, LEAST_EPOCHS = 3.0, 5
#: From so large a correlation on, errors of an aid that last matter for the bounds.
REMEMBER = 0.3


@dataclass(frozen=True, eq=False)
class Agreement:
    """Innovations of one observation beside what was expected of them.

    Components are taken one after the other, so that their innovations are independent, and the
    normalised innovation squared of an epoch is the sum of nu²/s.

    Attributes
    ----------
    name : str
    labels : tuple of str
        Of the components, with units.
    time : ndarray, (n,), s
    nu, sd : ndarray, (n, m)
    weight : ndarray, (n, m)
        0 where it was rejected.
    consistency : ObservationConsistency
        What they say of the filter.
    stated : bool
        Whether it is stated that they last.
    """

    name: str
    labels: tuple[str, ...]
    time: Array
    nu: Array
    sd: Array
    weight: Array
    consistency: ObservationConsistency
    stated: bool = False

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Epochs of which no component was rejected, (n,)."""
        return np.asarray((self.weight > 0.0).all(axis=1) & (self.sd > 0.0).all(axis=1))

    @cached_property
    def nis(self) -> Array:
        """Normalised innovation squared of each epoch, (n,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.square(self.nu / self.sd).sum(axis=1))

    @property
    def freedom(self) -> int:
        """Components of an epoch."""
        return len(self.labels)

    @property
    def epochs(self) -> int:
        """How many there are."""
        return len(self.time)

    @property
    def rejected(self) -> int:
        """Epochs of which something was not used at all."""
        return int((self.weight <= 0.0).any(axis=1).sum())

    @property
    def weakened(self) -> int:
        """Epochs of which something was used with less than its whole weight."""
        some = (self.weight > 0.0) & (self.weight < 1.0)
        return int((some.any(axis=1) & (self.weight > 0.0).all(axis=1)).sum())

    @cached_property
    def mean_nis(self) -> float:
        """Mean over the epochs that were used; NaN where there is none."""
        return float(self.nis[self.used].mean()) if self.used.any() else math.nan

    @cached_property
    def band(self) -> tuple[float, float]:
        """Between which that mean is in 95 of 100 cases, where all is as stated."""
        count = int(self.used.sum())
        if not count:
            return math.nan, math.nan
        return band_of_mean(self.freedom, count)

    @property
    def ratio(self) -> float:
        """Root mean square of the innovations in their expected standard deviations."""
        return math.sqrt(self.mean_nis / self.freedom) if self.freedom else math.nan

    @property
    def usual(self) -> float:
        """Half of the epochs are beyond so many times what half of them should be within."""
        from scipy.special import chdtri

        if not self.used.any():
            return math.nan
        half = float(chdtri(self.freedom, 0.5))
        return math.sqrt(float(np.median(self.nis[self.used])) / half)

    @property
    def refutes(self) -> bool:
        """Whether most epochs contradict the answer, or were refused for that, or errors last."""
        if self.epochs < LEAST_EPOCHS:
            return False
        lasts = self.ratio > REFUTES and self.remembers
        return self.usual > REFUTES or lasts or 2 * self.rejected > self.epochs

    @property
    def correlation(self) -> float:
        """Largest correlation of a component with itself an epoch later; NaN for too few."""
        found = [float(one.autocorrelation[0]) for one in self._long]
        return max(found, key=abs, default=math.nan)

    @property
    def correlation_bound(self) -> float:
        """Below which that is in 95 of 100 cases for each component, where there is no memory."""
        return max((one.autocorrelation_bound for one in self._long), default=math.nan)

    @property
    def _long(self) -> list[ComponentConsistency]:
        """Components with epochs enough to tell of memory."""
        return [one for one in self.consistency.components if one.autocorrelation.size]

    @property
    def remembers(self) -> bool:
        """Whether they hang together from epoch to epoch far more than by chance, to harm.

        Errors that last do as much as independent ones of `lasting` their size: where that is no
        more than was stated, as of a constraint whose deviation is stated for it, no bound is too
        narrow. Where it is stated that they last, that is held to `FAR_OFF`, as a scatter is.
        """
        size = abs(self.correlation)
        far = bool(size > max(REMEMBER, 2.0 * self.correlation_bound))
        most = FAR_OFF if self.stated else 1.0
        return far and (self.correlation < 0.0 or self.lasting > most)

    @property
    def lasting(self) -> float:
        """`ratio`, by which independent errors would do as much: those of a first-order process."""
        rho = min(self.correlation, 1.0 - 1.0 / max(int(self.used.sum()), 2))
        if not rho > 0.0:
            return self.ratio
        return self.ratio * math.sqrt((1.0 + rho) / (1.0 - rho))

    @property
    def inside(self) -> bool:
        """Whether the mean is within its band."""
        return self.band[0] <= self.mean_nis <= self.band[1]

    @property
    def acceptable(self) -> bool:
        """Whether they are within a factor of two of what was expected, and if they last."""
        near = self.ratio < FAR_OFF and max(self.ratio, self.lasting) > 1.0 / FAR_OFF
        return self.inside or near


def agreements(record: NavigationRecord, lasting: Collection[str] = ()) -> tuple[Agreement, ...]:
    """Return the innovations of each observation that has any.

    Parameters
    ----------
    record : NavigationRecord
    lasting : collection of str
        Names of the aids that state that their errors last.
    """
    found = (
        _agreement(name, table, (name.rpartition(".")[0] or name) in lasting)
        for name, table in record.innovations.items()
    )
    return tuple(one for one in found if one.epochs)


def chi_square_far(freedom: float) -> float:
    """Quantile of chi-square that as few exceed as exceed three standard deviations."""
    from scipy.special import chdtri, ndtr

    return float(chdtri(freedom, 2.0 * float(ndtr(-3.0))))


def _agreement(name: str, table: pd.DataFrame, stated: bool) -> Agreement:
    labels = tuple(str(c)[3:] for c in table.columns if str(c).startswith("nu "))

    def part(what: str) -> Array:
        return table[[f"{what} {label}" for label in labels]].to_numpy(dtype=np.float64)

    time = table.index.to_numpy(dtype=np.float64)
    return Agreement(
        name,
        labels,
        time,
        part("nu"),
        np.sqrt(part("s")),
        part("weight"),
        consistency_of(name, table),
        stated,
    )
