"""A run of navigation again, without what in it was not as expected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Aid, TableAid, lasting
from strapdown.aiding.gnss import Gnss
from strapdown.ellipsoids import Ellipsoid
from strapdown.errors import Finding, StrapdownError
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.navigation.consistency import consistency_of_all
from strapdown.navigation.first_inconsistency import Inconsistency, inconsistencies
from strapdown.navigation.record import NavigationRecord
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.systems.progress import Progress
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.drive import run_batch
from strapdown.tables import POSITION_SD, VELOCITY_SD
from strapdown.tables.checks import index_of, values_of

__all__ = ["Repeated", "repeat_without"]

Array = NDArray[np.float64]

#: Rows a second at which the two runs are held beside each other.
RATE = 1.0
#: Epochs are of rows within this, s.
SAME = 1e-3
#: What a receiver tells, in words.
PARTS = {"position": "places", "velocity": "velocities"}
#: Where less than this share of its fixes would be left to a run that has no others, they are
#: believed less instead.
LEAST_LEFT = 0.5


@dataclass(frozen=True, eq=False)
class Repeated:
    """A run without what was not as expected, beside the run itself.

    Attributes
    ----------
    without : str
        What was changed, in words.
    record : NavigationRecord or None
        None where it could not be run.
    differences : DataFrame or None
        Run less repeated run (`trajectory_differences`), once a second.
    left : tuple of Inconsistency
        What is not consistent in the repeated run.
    failed : Finding or None
        Why it could not be run; None where it could.
    """

    without: str
    record: NavigationRecord | None
    differences: pd.DataFrame | None
    left: tuple[Inconsistency, ...] = ()
    failed: Finding | None = None


def repeat_without(
    chain: Chain,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    found: Sequence[Inconsistency],
    ellipsoid: Ellipsoid,
    progress: Progress,
) -> Repeated:
    """Run a chain again, without the measurement, epochs or stretch that were not as expected.

    Gross errors are left out epoch by epoch, a change over its stretch. What holds throughout
    is left out altogether, if another observation of places or velocities is left; else it is
    believed less, by the factor that would make it as expected.

    Parameters
    ----------
    chain : Chain
    imu : DataFrame
    tables : mapping of str to DataFrame
    record : NavigationRecord
        Of the run.
    found : sequence of Inconsistency
        The first of which is left out; of gross errors all those of the same aid.
    ellipsoid : Ellipsoid
    progress : callable

    Returns
    -------
    Repeated
    """
    aids, told, words = _changed(chain.navigator.aids, tables, found)
    changed = replace(chain, navigator=replace(chain.navigator, aids=aids, smoother=None))
    try:
        run = run_batch(
            changed, imu, told, IntervalRecorder(rate_hz=RATE), progress, chunk=60.0
        ).record
    except StrapdownError as error:
        return Repeated(words, None, None, failed=error.finding)
    rows = run.trajectory
    span = record.trajectory.index
    rows = rows[(rows.index >= span[0]) & (rows.index <= span[-1])]
    rows.attrs = dict(run.trajectory.attrs)
    differences = -trajectory_differences(rows, record.trajectory, ellipsoid)
    left = inconsistencies(consistency_of_all(run.innovations), run.innovations, lasting(aids))
    return Repeated(words, run, differences, left)


def _changed(
    aids: tuple[Aid, ...], tables: Mapping[str, pd.DataFrame], found: Sequence[Inconsistency]
) -> tuple[tuple[Aid, ...], dict[str, pd.DataFrame], str]:
    """Aids and tables without something, and it in words."""
    one = found[0]
    aid = next(a for a in aids if a.name == one.aid)
    told = dict(tables)
    part = one.name.rpartition(".")[2]
    table = tables.get(one.aid)
    if table is not None and not one.throughout:
        alike = [x for x in found if x.aid == one.aid and x.kind == "gross"]
        kept = np.ones(len(table), dtype=np.bool_)
        for each in alike if one.kind == "gross" else [one]:
            kept &= _kept(table, each, aid)
        others = [a for a in aids if a is not aid and isinstance(a, Gnss)]
        if kept.any() and (others or kept.mean() >= LEAST_LEFT):
            out = table[kept]
            out.attrs = dict(table.attrs)
            told[one.aid] = out
            count = int((~kept).sum())
            many = f"{count} of the {len(table)} rows of {one.aid}"
            if one.kind == "gross":
                return aids, told, f"without {many}: its gross errors"
            return aids, told, f"without {many}, from {one.since:.9g} to {one.until:.9g} s"
    if isinstance(aid, Gnss):
        both = aid.use_position and aid.use_velocity and _has_both(table)
        if both and part in PARTS and one.kind != "gross":
            less = (
                replace(aid, use_position=False)
                if part == "position"
                else replace(aid, use_velocity=False)
            )
            return _swapped(aids, aid, less), told, f"without the {PARTS[part]} of {one.aid}"
        if not any(isinstance(a, Gnss) for a in aids if a is not aid):
            factor = max(one.factor, 2.0)
            less = replace(
                aid,
                position_sd_factor=factor * aid.position_sd_factor,
                velocity_sd_factor=factor * aid.velocity_sd_factor,
            )
            words = (
                f"with {one.aid}, of which nothing can be spared, believed {factor:.2g} times less"
            )
            return _swapped(aids, aid, less), told, words
    if isinstance(aid, TableAid):
        told.pop(one.aid, None)
    return tuple(a for a in aids if a is not aid), told, f"without {one.aid}"


def _swapped(aids: tuple[Aid, ...], old: Aid, new: Aid) -> tuple[Aid, ...]:
    return tuple(new if a is old else a for a in aids)


def _has_both(table: pd.DataFrame | None) -> bool:
    """Whether fixes tell places and velocities."""
    return table is not None and all(
        bool(np.isfinite(values_of(table, sd)).all(axis=1).any())
        for sd in (POSITION_SD, VELOCITY_SD)
    )


def _kept(table: pd.DataFrame, one: Inconsistency, aid: Aid) -> NDArray[np.bool_]:
    """Rows of a table that are none of the epochs."""
    time = index_of(table) - float(getattr(aid, "time_offset", 0.0))
    if one.name.endswith(".velocity"):
        time = time - float(getattr(aid, "velocity_delay", 0.0))
    if one.kind == "change":
        return np.asarray((time < one.since - SAME) | (time > one.until + SAME))
    near = np.searchsorted(one.epochs, time)
    apart = np.full(len(time), np.inf)
    for k in (near - 1, near):
        good = (k >= 0) & (k < len(one.epochs))
        apart[good] = np.minimum(apart[good], np.abs(one.epochs[k[good]] - time[good]))
    return np.asarray(apart > SAME)
