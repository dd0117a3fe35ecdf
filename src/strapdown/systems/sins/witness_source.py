"""What witnesses of a heading are made of: their filter, joined increments, thinned fixes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.gnss import Gnss
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.influence_igg3 import Igg3
from strapdown.estimation.joseph import Joseph
from strapdown.estimation.robust_update import RobustUpdate
from strapdown.estimation.rotation_vector_model import RotationVectorModel
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.navigation.consistency import ObservationConsistency
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.record import NavigationRecord
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.joined_steps import NEAR, joined_steps
from strapdown.tables.checks import index_of

__all__ = ["Witnesses", "witnesses_of"]

Array = NDArray[np.float64]

#: Fixes are taken no denser, s.
FIXES_APART = 1.0
#: Nearer to a pole the local north is none.
POLAR = 85.0


@dataclass(frozen=True, eq=False)
class Witnesses:
    """What witnesses are made of: their filter, their receivers, and the record.

    Attributes
    ----------
    navigator : Navigator
    time : ndarray, (n,), s
        Ends of the joined steps.
    rows : ndarray, (n, 10)
        Motion increments.
    tables : mapping of str to DataFrame
        Fixes, thinned.
    begun : float, s
        Begin of the first step.
    """

    navigator: Navigator
    time: Array
    rows: Array
    tables: Mapping[str, pd.DataFrame]
    begun: float


def witnesses_of(
    filter_: ErrorFilter,
    chain: Chain,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    consistency: Mapping[str, ObservationConsistency],
) -> Witnesses | None:
    """Return what witnesses of a run are made of.

    Parameters
    ----------
    filter_ : ErrorFilter
        Of the run, without the states of its aids.
    chain : Chain
        Of the run.
    imu : DataFrame
        Its samples.
    tables : mapping of str to DataFrame
        By name of the aid.
    record : NavigationRecord
        What came of it.
    consistency : mapping of str to ObservationConsistency
        Of its innovations.

    Returns
    -------
    Witnesses or None
        None where there is no satellite receiver: nothing else tells a direction of its own.
    """
    receivers = [aid for aid in chain.navigator.aids if type(aid) is Gnss and aid.name in tables]
    if not receivers:
        return None
    span = record.trajectory.index
    steps = joined_steps(chain.intake, imu, float(span[0]), float(span[-1]))
    time, rows = steps.time, steps.rows
    if len(time) < 2:
        return None
    robust = filter_.rule is not None or any(_robust(aid, consistency) for aid in receivers)
    aids = tuple(_known(aid, record, robust) for aid in receivers)
    ellipsoid = filter_.mechanization.ellipsoid
    polar = record.trajectory["lat"].abs().max() > POLAR
    model = filter_.model
    small = ErrorFilter(
        (WanderAzimuth if polar else NorthEastDown)(ellipsoid=ellipsoid),
        RotationVectorModel(model.gyro_noise, model.accel_noise, model.sensors),
        Joseph(),
        None,
        step=FIXES_APART,
    )
    thinned = {aid.name: _thinned(tables[aid.name]) for aid in receivers}
    begun = float(time[0] - rows[0, 0])
    return Witnesses(Navigator(small, aids, mark_interval=FIXES_APART), time, rows, thinned, begun)


def _known(aid: Gnss, record: NavigationRecord, robust: bool) -> Gnss:
    """A receiver with arm and time offset as the run found them in the end."""
    found = record.sensors.iloc[-1]
    arm = list(aid.lever_arm)
    for k, axis in enumerate("xyz"):
        arm[k] -= float(found.get(f"{aid.name}.lever_arm_{axis}", 0.0))
    offset = next(
        (float(v) for n, v in found.items() if str(n).startswith(f"{aid.name}.time_offset")), 0.0
    )
    return replace(
        aid,
        rule=(aid.rule or RobustUpdate(Igg3())) if robust else None,
        lever_arm=(arm[0], arm[1], arm[2]),
        lever_arm_sd=0.0,
        time_offset=aid.time_offset - offset,
        time_offset_sd=0.0,
        time_offset_drift=0.0,
    )


def _robust(aid: Gnss, consistency: Mapping[str, ObservationConsistency]) -> bool:
    """Whether fixes of a receiver are to be believed with care."""
    return aid.rule is not None or any(
        one.gross
        for name, of in consistency.items()
        if name.partition(".")[0] == aid.name
        for one in of.components
    )


def _thinned(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that are as far apart as fixes are taken."""
    time = index_of(table)
    cell = np.floor(time / FIXES_APART + NEAR)
    kept = np.concatenate([[True], np.diff(cell) > 0.0]) if len(time) else np.empty(0, bool)
    out = table[kept]
    out.attrs = dict(table.attrs)
    return out
