"""What is known of the attitude at the samples of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.evaluation.differences import attitude_at
from strapdown.rotation.angles import unit_rotation_angle

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: The final error, its root mean square and the largest, in deg.
Errors = tuple[float, float, float]


@dataclass(frozen=True)
class Known:
    """An attitude at samples of a log.

    Attributes
    ----------
    q_nb : ndarray, (n, 4)
        At every sample; without meaning where it does not count.
    counts : ndarray of bool, (n,)
    """

    q_nb: Array
    counts: Mask

    def at(self, samples: NDArray[np.int64]) -> Known:
        """Return what is known at some of the samples."""
        return Known(self.q_nb[samples], self.counts[samples])

    def errors(self, q_nb: Array) -> Errors | None:
        """Compare an attitude at every sample with what is known there.

        Parameters
        ----------
        q_nb : ndarray, (n, 4)

        Returns
        -------
        tuple of float, or None
            Final, RMS and largest rotation angle in deg; None where nothing is known.
        """
        if self.counts.all():
            return angles_to_errors(unit_rotation_angle(q_nb, self.q_nb))
        if not self.counts.any():
            return None
        angles = unit_rotation_angle(q_nb[self.counts], self.q_nb[self.counts])
        return angles_to_errors(angles)


def angles_to_errors(angles: Array) -> Errors:
    """Final, RMS and largest of angles."""
    return float(angles[-1]), float(np.sqrt((angles * angles).mean())), float(angles.max())


def known_at(truth: pd.DataFrame, scored: Mask, stamps: Array) -> Known:
    """Lay a truth over the samples of a log.

    Parameters
    ----------
    truth : DataFrame
        An Attitude table, on stamps of its own or on (some of) the log's.
    scored : ndarray of bool
        Which of its rows count.
    stamps : ndarray, (n,), s
        Of the log.

    Returns
    -------
    Known
        A sample counts where a counting row of the truth stands at its stamp, or one on each
        side of it no further apart than three of the truth's usual steps.
    """
    rows = truth[scored]
    if rows.empty:
        return Known(np.zeros((len(stamps), 4)), np.zeros(len(stamps), dtype=bool))
    times = rows.index.to_numpy(dtype=np.float64)
    usual = float(np.median(np.diff(truth.index.to_numpy()))) if len(truth) > 1 else 0.0
    before = np.searchsorted(times, stamps, side="right") - 1
    after = np.minimum(np.searchsorted(times, stamps), len(times) - 1)
    inside = (before >= 0) & (times[after] >= stamps)
    apart = times[after] - times[np.maximum(before, 0)]
    return Known(attitude_at(rows, stamps), inside & (apart <= 3.0 * usual))
