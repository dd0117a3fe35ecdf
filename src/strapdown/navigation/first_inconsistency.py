"""What in the innovations of a run speaks against it, in the order of time."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.navigation.consistency import (
    ComponentConsistency,
    ObservationConsistency,
    gross_of,
)
from strapdown.navigation.innovation_verdicts import Verdict

__all__ = ["Inconsistency", "inconsistencies"]

Array = NDArray[np.float64]

#: Kinds that hold of the whole run.
THROUGHOUT = ("understated", "bias", "correlated")
#: From these on what is no chance matters, too: a scatter, a mean in standard deviations, a
#: correlation.
SCATTERS, LEANS, REMEMBERS = 1.5, 0.5, 0.3
#: Of errors that are stated to last, what they do beside independent ones of the stated size.
LASTS = 2.0


@dataclass(frozen=True, eq=False)
class Inconsistency:
    """An observation that is not what a filter expected of it, in a way that matters.

    Attributes
    ----------
    name : str
        Of the observation: ``rtk.position``.
    aid : str
    component : str
        With its unit.
    kind : {'change', 'understated', 'bias', 'correlated', 'gross'}
    since : float, s
        First epoch for which it is so.
    until : float, s
        Last one; the end of the run, where it holds throughout.
    epochs : ndarray, (k,), s
        Of gross errors, those; else none.
    factor : float
        By how much larger standard deviations would make it as expected; 1 where that is no remedy.
    what, meaning : str
        In words.
    """

    name: str
    aid: str
    component: str
    kind: str
    since: float
    until: float
    epochs: Array
    factor: float
    what: str
    meaning: str

    @property
    def throughout(self) -> bool:
        """Whether it holds of the whole run."""
        return self.kind in THROUGHOUT


def inconsistencies(
    consistency: Mapping[str, ObservationConsistency],
    innovations: Mapping[str, pd.DataFrame],
    lasting: Collection[str] = (),
) -> tuple[Inconsistency, ...]:
    """Return what is inconsistent in a run, the first in time first.

    What is no chance, and yet too little to matter, is left out: a scatter below 1.5 times what
    was expected, a mean below half a standard deviation, a correlation below 0.3, and one of what
    scatters so little that it does no more than independent errors of the stated size. So is
    an observation that is better than was stated.

    Parameters
    ----------
    consistency : mapping of str to ObservationConsistency
        By name of the observation.
    innovations : mapping of str to DataFrame
        From which it is.
    lasting : collection of str
        Names of the aids that state that their errors last: these may do twice as much as
        independent ones.

    Returns
    -------
    tuple of Inconsistency
        In the order of time; what begins at one epoch, the least probable first. What holds
        throughout of an aid with gross errors comes after these.
    """
    found: list[Inconsistency] = []
    chance: dict[int, float] = {}
    for name, of in consistency.items():
        parts = {one.label: one for one in of.components}
        for verdict in of.verdicts:
            part = parts[verdict.component]
            if _matters(verdict, part, _aid(name) in lasting):
                one = _inconsistency(name, of, verdict, part, innovations[name])
                found.append(one)
                chance[id(one)] = verdict.p
    # What gross errors do to a filter that believes them holds throughout, and has no begin of its
    # own: it comes after them.
    gross: dict[str, float] = {}
    for one in found:
        if one.kind == "gross":
            gross[one.aid] = min(gross.get(one.aid, math.inf), one.since)

    def order(one: Inconsistency) -> tuple[float, bool, float]:
        after = one.throughout and one.aid in gross
        return gross[one.aid] if after else one.since, after, chance[id(one)]

    return tuple(sorted(found, key=order))


def _aid(name: str) -> str:
    """Of an observation."""
    return name.rpartition(".")[0] or name


def _matters(verdict: Verdict, part: ComponentConsistency, lasts: bool) -> bool:
    if verdict.kind in ("change", "gross"):
        return True
    if verdict.kind == "understated":
        return part.scale > SCATTERS
    if verdict.kind == "bias":
        return abs(part.bias) > LEANS
    if verdict.kind == "correlated":
        rho = float(part.autocorrelation[0])
        return rho < -REMEMBERS or (rho > REMEMBERS and _lasting(part) > (LASTS if lasts else 1.0))
    return False


def _lasting(part: ComponentConsistency) -> float:
    """Scatter of independent errors that would do as much: those of a first-order process."""
    rho = min(max(float(part.autocorrelation[0]), 0.0), 1.0 - 1.0 / max(part.count, 2))
    return part.scale * math.sqrt((1.0 + rho) / (1.0 - rho))


def _inconsistency(
    name: str,
    of: ObservationConsistency,
    verdict: Verdict,
    part: ComponentConsistency,
    table: pd.DataFrame,
) -> Inconsistency:
    time = table.index.to_numpy(dtype=np.float64)
    until, epochs = float(time[-1]), np.empty(0)
    if verdict.kind == "gross":
        epochs = gross_epochs(table, part.label)
        until = float(epochs[-1]) if len(epochs) else verdict.since
    elif verdict.kind == "change":
        until = _until(of.windows, verdict.since)
    factor = 1.0
    if verdict.kind in ("understated", "correlated"):
        factor = max(1.0, _lasting(part))
    return Inconsistency(
        name=name,
        aid=_aid(name),
        component=verdict.component,
        kind=verdict.kind,
        since=verdict.since,
        until=until,
        epochs=epochs,
        factor=factor,
        what=verdict.what,
        meaning=verdict.meaning,
    )


def _until(windows: pd.DataFrame, since: float) -> float:
    """Last epoch of the windows in a row that are beyond their bounds, from a change on."""
    later = windows[windows.index >= since]
    bad = (later["nis"] > later["upper"]).to_numpy()
    if not bad.any():
        return float(later.index[-1]) if len(later) else since
    first = int(np.argmax(bad))
    good = np.flatnonzero(~bad[first:])
    last = first + int(good[0]) - 1 if len(good) else len(bad) - 1
    return float(later.index[last])


def gross_epochs(table: pd.DataFrame, label: str) -> Array:
    """Epochs at which a component is a gross error, (k,), s."""
    s = table[f"s {label}"].to_numpy(dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where(s > 0.0, table[f"nu {label}"].to_numpy(dtype=np.float64) / np.sqrt(s), np.nan)
    return np.asarray(table.index.to_numpy(dtype=np.float64)[gross_of(u[:, None])[:, 0]])
