"""Result of a fine alignment, epoch by epoch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.stationary import Standing
from strapdown.errors import Finding
from strapdown.estimation.covariance import Innovations, Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import PHYSICAL
from strapdown.tables import EULER

__all__ = ["FINE_COLUMNS", "Epochs", "FineResult", "alignment_of"]

Array = NDArray[np.float64]

BIASES = tuple(f"{sensor}_bias_{axis}" for sensor in ("gyro", "accel") for axis in "xyz")
#: Columns of the history: degrees, rad/s and m/s², and the standard deviation of each.
FINE_COLUMNS = (*EULER, *BIASES, *(f"{name}_sd" for name in (*EULER, *BIASES)))


@dataclass(frozen=True, eq=False)
class FineResult:
    """Result of a fine alignment.

    Attributes
    ----------
    alignment : Alignment
        At the last epoch, with the biases.
    at_start : Alignment
        The same carried back to the first sample by the gyros.
    history : DataFrame
        By time in s, of each epoch: roll, pitch and heading in degrees, biases in rad/s and m/s²,
        and the standard deviation of each (``_sd``).
    innovations : dict of DataFrame
        By name of the observation, by time: ``nu``, ``s`` and ``weight`` of each component, as
        ``nu x, m/s``.
    standing : Standing
        Residual motion of the body.
    interval : float, s
        From epoch to epoch.
    heading_given : bool
        Whether the heading before it is independent of the gyros.
    prior_heading_sd_deg : float, deg
        Assumed standard deviation of the heading before the first epoch.
    filter : ErrorFilter
    state : FilterState
        At the last epoch, for navigation to continue from.
    findings : tuple of Finding
    source : str, optional
    """

    alignment: Alignment
    at_start: Alignment
    history: pd.DataFrame
    innovations: Mapping[str, pd.DataFrame]
    standing: Standing
    interval: float
    heading_given: bool
    prior_heading_sd_deg: float
    filter: ErrorFilter = field(repr=False)
    state: FilterState = field(repr=False)
    findings: tuple[Finding, ...] = ()
    source: str | None = None


def alignment_of(filter_: ErrorFilter, state: FilterState) -> Alignment:
    """Convert a filter state to an alignment.

    The rotation of the local level with position, 1.6e-7 rad per meter, is negligible beside
    the attitude's own uncertainty and left out.
    """
    here = filter_.mechanization.nav_state(state.mechanization, state.time)
    P = filter_.physical_covariance(state)
    level = filter_.mechanization.level_from_ned(state.row)
    sd = np.sqrt(np.diagonal(P))
    return Alignment(
        method="fine",
        time=state.time,
        q_nb=here.q_nb,
        covariance=level.T @ P[6:9, 6:9] @ level,
        gyro_bias=state.sensors[:3].copy(),
        accel_bias=state.sensors[3:6].copy(),
        gyro_bias_sd=sd[PHYSICAL : PHYSICAL + 3],
        accel_bias_sd=sd[PHYSICAL + 3 : PHYSICAL + 6],
    )


class Epochs:
    """Epochs of a run.

    Parameters
    ----------
    filter_ : ErrorFilter
    """

    def __init__(self, filter_: ErrorFilter) -> None:
        self._filter = filter_
        self._time: list[float] = []
        self._rows: list[Array] = []
        self._seen: dict[str, list[tuple[float, Observation, Innovations]]] = {}

    def add(self, state: FilterState, seen: Mapping[str, tuple[Observation, Innovations]]) -> None:
        """Append an epoch."""
        alignment = alignment_of(self._filter, state)
        assert alignment.gyro_bias is not None and alignment.accel_bias is not None
        assert alignment.gyro_bias_sd is not None and alignment.accel_bias_sd is not None
        self._time.append(state.time)
        self._rows.append(
            np.concatenate(
                [
                    alignment.roll_pitch_heading,
                    alignment.gyro_bias,
                    alignment.accel_bias,
                    alignment.sd_deg,
                    alignment.gyro_bias_sd,
                    alignment.accel_bias_sd,
                ]
            )
        )
        for name, (observation, innovations) in seen.items():
            self._seen.setdefault(name, []).append((state.time, observation, innovations))

    def history(self) -> pd.DataFrame:
        """Estimates and their standard deviations, by time."""
        rows = np.array(self._rows)
        # Heading is unwrapped through north: a plot has no jump.
        rows[:, 2] = np.degrees(np.unwrap(np.radians(rows[:, 2])))
        return pd.DataFrame(
            rows, index=pd.Index(self._time, name="time"), columns=list(FINE_COLUMNS)
        )

    def innovations(self) -> dict[str, pd.DataFrame]:
        """Innovations of each observation, by time."""
        tables = {}
        for name, epochs in self._seen.items():
            labels = epochs[0][1].labels
            values = [np.concatenate([i.nu, i.s, i.weight]) for _, _, i in epochs]
            columns = [f"{what} {label}" for what in ("nu", "s", "weight") for label in labels]
            time = pd.Index([at for at, _, _ in epochs], name="time")
            tables[name] = pd.DataFrame(np.array(values), index=time, columns=columns)
        return tables
