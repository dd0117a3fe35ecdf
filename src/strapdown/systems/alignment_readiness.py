"""How accurate an alignment is after how long: coarse over shorter parts, fine epoch by epoch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.readiness import coarse_readiness
from strapdown.alignment.site import Site
from strapdown.config.alignment import ReferenceTable
from strapdown.errors import Finding
from strapdown.rotation import within_half_turn
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import EULER
from strapdown.tables.checks import values_of

__all__ = ["AlignmentReadiness", "alignment_readiness", "reference_offset"]

Array = NDArray[np.float64]

#: Lengths that are tried, from this many seconds to the whole record, evenly in their logarithm.
LEAST, TRIES = 15.0, 16


@dataclass(frozen=True, eq=False)
class AlignmentReadiness:
    """Alignment time against accuracy.

    Attributes
    ----------
    against : {'truth', 'reference', 'answer'}
        What the differences are from: the truth of a simulation, a reference that is stated, or
        the answer of the whole record.
    coarse, fine : DataFrame
        By time since the start in s: ``roll_sd``, ``pitch_sd``, ``heading_sd`` and
        ``roll_off``, ``pitch_off``, ``heading_off``, deg; NaN where nothing is known. The fine
        one is empty where there was none.
    refused : tuple of (float, Finding)
        Lengths at which the coarse alignment found no attitude, and why.
    """

    against: str
    coarse: pd.DataFrame
    fine: pd.DataFrame
    refused: tuple[tuple[float, Finding], ...]


def alignment_readiness(
    way: CoarseAlignment,
    imu: pd.DataFrame,
    site: Site,
    sensors: ImuUncertainty,
    gnss: pd.DataFrame | None,
    attitude: pd.DataFrame,
    fine: FineResult | None,
    truth: pd.DataFrame | None,
    reference: ReferenceTable | None,
) -> AlignmentReadiness:
    """Align over shorter parts of a record, and lay the errors beside their bounds.

    Parameters
    ----------
    way : CoarseAlignment
    imu : DataFrame
        Imu table of the whole record.
    site : Site
    sensors : ImuUncertainty
    gnss : DataFrame, optional
        Gnss table.
    attitude : DataFrame
        Attitude table of the answer over the record.
    fine : FineResult, optional
    truth : DataFrame, optional
        Attitude table.
    reference : ReferenceTable, optional

    Returns
    -------
    AlignmentReadiness
    """
    begin = float(imu.index[0])
    against = "answer" if truth is None else "truth"
    offset = np.zeros(3)
    if truth is None and reference is not None:
        against = "reference"
        offset = reference_offset(attitude, reference)
    known = attitude if truth is None else truth
    lengths = _lengths(float(imu.index[-1]) - begin)
    found = coarse_readiness(way, imu, site, sensors, gnss, lengths, known).table
    refused = found["refused"].notna().to_numpy()
    coarse = found[~refused]
    sd = coarse[[f"{a}_sd" for a in EULER]].to_numpy(dtype=np.float64)
    off = coarse[[f"{a}_error" for a in EULER]].to_numpy(dtype=np.float64) + offset
    return AlignmentReadiness(
        against,
        _table(coarse.index.to_numpy(dtype=np.float64), np.hstack([sd, off])),
        _fine(fine, begin, known, offset),
        tuple(zip(found.index[refused].tolist(), found["refused"][refused].tolist(), strict=True)),
    )


def reference_offset(attitude: pd.DataFrame, reference: ReferenceTable) -> Array:
    """The answer less a stated attitude, (3,), deg; NaN where it says nothing."""
    stated = np.array(
        [
            np.nan if x is None else x
            for x in (reference.roll_deg, reference.pitch_deg, reference.heading_deg)
        ]
    )
    row = 0 if reference.at == "start" else -1
    return np.asarray(within_half_turn(values_of(attitude, EULER)[row] - stated))


def _lengths(whole: float) -> list[float]:
    if whole <= LEAST:
        return [whole]
    return [float(x) for x in np.geomspace(LEAST, whole, TRIES)]


def _fine(
    fine: FineResult | None, begin: float, known: pd.DataFrame, offset: Array
) -> pd.DataFrame:
    if fine is None:
        return _table(np.empty(0), np.empty((0, 6)))
    # The first row is what was assumed before the first epoch.
    history = fine.history.iloc[1:]
    time = history.index.to_numpy(dtype=np.float64)
    sd = history[[f"{a}_sd" for a in EULER]].to_numpy(dtype=np.float64)
    off = _off(history[EULER].to_numpy(dtype=np.float64), time, known) + offset
    return _table(time - begin, np.hstack([sd, off]))


def _off(angles: Array, time: Array, known: pd.DataFrame) -> Array:
    """Angles less those that are known at the nearest stamps, deg."""
    stamps = known.index.to_numpy(dtype=np.float64)
    at = np.clip(np.searchsorted(stamps, time), 1, len(stamps) - 1)
    at -= (time - stamps[at - 1] < stamps[at] - time).astype(np.int64)
    return np.asarray(within_half_turn(angles - values_of(known, EULER)[at]))


def _table(time: Array, rows: Array) -> pd.DataFrame:
    columns = [f"{a}_{what}" for what in ("sd", "off") for a in EULER]
    return pd.DataFrame(rows, index=pd.Index(time, name="time"), columns=columns)
