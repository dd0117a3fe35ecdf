"""One algorithm, or another library's filter, over one record."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd

from strapdown.results.scores import Score

__all__ = ["AttitudeRun", "PeerRun"]


@dataclass(frozen=True)
class AttitudeRun:
    """One algorithm over one record.

    Attributes
    ----------
    algorithm : str
        Name and options, as the command line takes them.
    title, equations : str
        For people; the equations are numbered as in the algorithm's source.
    attitude : DataFrame
        Attitude table at every sample.
    diagnostics : dict of str to float
        What the algorithm says of its own condition; each key carries its unit.
    """

    algorithm: str
    title: str
    equations: str
    attitude: pd.DataFrame = field(repr=False)
    diagnostics: dict[str, float]


@dataclass(frozen=True)
class PeerRun:
    """Another library's filter over the same log.

    Attributes
    ----------
    peer : str
        Name and version.
    aiding : str
        ``gyro``, ``gyro+accel`` or ``gyro+accel+mag``; only like is compared with like.
    attitude : DataFrame
        Attitude table.
    scores : tuple of Score
    """

    peer: str
    aiding: str
    attitude: pd.DataFrame = field(repr=False)
    scores: tuple[Score, ...]
