"""How good an alignment is after how long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.site import Site
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import EULER, QUATERNION, check_attitude
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["READINESS", "Readiness", "coarse_readiness", "durations_of", "readiness"]

SD = [f"{angle}_sd" for angle in EULER]
ERROR = [f"{angle}_error" for angle in EULER]
READINESS = ["time", *EULER, *SD, *ERROR, "findings", "refused"]
#: Shorter stretches of a record are not tried.
SHORTEST = 5.0  # s


@dataclass(frozen=True, eq=False)
class Readiness:
    """Accuracy against alignment time.

    Attributes
    ----------
    method : str
    table : DataFrame
        Index ``duration``, s. Columns: ``time``, s, at which the attitude holds; ``roll pitch
        heading``, deg; ``*_sd``, deg, as stated; ``*_error``, deg, estimate less reference, NaN
        without one; ``findings``, how many there are; ``refused``, the `Finding` of a record
        that gives no attitude, whose numbers are NaN, else None.
    """

    method: str
    table: pd.DataFrame

    def ready(self, heading_sd_deg: float) -> float:
        """Shortest duration from which on the heading is stated at least so well.

        Parameters
        ----------
        heading_sd_deg : float, deg

        Returns
        -------
        float, s
            Infinite where it never is.
        """
        good = (self.table["heading_sd"] <= heading_sd_deg).to_numpy()
        bad = np.flatnonzero(~good)
        first = int(bad[-1]) + 1 if bad.size else 0
        return float(self.table.index[first]) if first < len(good) else float("inf")


def durations_of(imu: pd.DataFrame, count: int = 10) -> Array:
    """Durations that a record allows, equally spaced in their logarithm.

    Parameters
    ----------
    imu : DataFrame
    count : int
        At least 2.

    Returns
    -------
    ndarray, (count,), s
        From 5 s, or a hundredth of the record where that is more, to all of it.

    Raises
    ------
    ConfigError
        Fewer than two are asked for.
    DataError
        The record is shorter than 10 s.
    """
    if count < 2:
        raise ConfigError("alignment.too-few-durations", quantity="count", count=count)
    length = float(imu.index[-1] - imu.index[0])
    if not length >= 2.0 * SHORTEST:
        raise DataError(
            "alignment.record-too-short-for-readiness",
            file=source_of(imu),
            quantity="time",
            length=length,
            shortest=SHORTEST,
            shortest_2=2.0 * SHORTEST,
        )
    return np.asarray(np.geomspace(max(SHORTEST, length / 100.0), length, count))


def readiness(
    method: str,
    align: Callable[[pd.DataFrame], Alignment],
    imu: pd.DataFrame,
    durations: Sequence[float] | Array | None = None,
    reference: pd.DataFrame | None = None,
) -> Readiness:
    """Align over ever longer stretches from the start of a record.

    Parameters
    ----------
    method : str
        Its name.
    align : callable
        Makes an alignment of an Imu table: coarse, fine, or the one after the other.
    imu : DataFrame
        Imu table.
    durations : sequence of float, s, optional
        Rising, within the record; ten of `durations_of` where left out.
    reference : DataFrame, optional
        Attitude table with the truth, or something better: the row nearest to the time of an
        alignment counts.

    Returns
    -------
    Readiness
        A stretch that is refused has a row that says why.

    Raises
    ------
    ConfigError
        A duration is not within the record, or they do not rise.
    DataError
        As `tables.check_attitude` of the reference.
    """
    times = durations_of(imu) if durations is None else np.asarray(durations, dtype=np.float64)
    length = float(imu.index[-1] - imu.index[0])
    rising = times.ndim == 1 and times.size > 0 and bool((np.diff(times, prepend=0.0) > 0.0).all())
    if not rising or not times[-1] <= length * (1.0 + 1e-9):
        raise ConfigError(
            "alignment.durations-not-rising",
            quantity="durations",
            times=times.tolist(),
            length=length,
        )
    if reference is not None:
        check_attitude(reference)
    start = float(imu.index[0])
    ends = np.searchsorted(imu.index.to_numpy(), start + times * (1.0 + 1e-12), side="right")
    rows = [_row(align, imu.iloc[:end], reference) for end in ends]
    index = pd.Index(times, name="duration")
    return Readiness(method, pd.DataFrame(rows, index=index, columns=READINESS))


def coarse_readiness(
    method: CoarseAlignment,
    imu: pd.DataFrame,
    site: Site,
    sensors: ImuUncertainty,
    gnss: pd.DataFrame | None = None,
    durations: Sequence[float] | Array | None = None,
    reference: pd.DataFrame | None = None,
) -> Readiness:
    """`readiness` of a coarse alignment; parameters as there and of `CoarseAlignment.align`."""
    return readiness(
        method.name,
        lambda piece: method.align(piece, site, sensors, gnss),
        imu,
        durations,
        reference,
    )


def _row(
    align: Callable[[pd.DataFrame], Alignment],
    piece: pd.DataFrame,
    reference: pd.DataFrame | None,
) -> list[object]:
    nothing: list[object] = [np.nan] * 10
    try:
        found = align(piece)
    except DataError as error:
        return [*nothing, 0, error.finding]
    errors = np.full(3, np.nan)
    if reference is not None:
        row = int(np.argmin(np.abs(reference.index.to_numpy() - found.time)))
        true = rotation.euler_from_quaternion(reference[QUATERNION].to_numpy()[row])
        errors = rotation.within_half_turn(found.roll_pitch_heading - true)
    numbers = [found.time, *found.roll_pitch_heading, *found.sd_deg, *errors]
    return [*numbers, len(found.findings), None]
