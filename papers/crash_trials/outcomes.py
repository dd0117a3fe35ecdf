"""Many cases on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from typing import TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.crash_trials.cases import TrialCase, TrialPriors, Untold, draw_case
from strapdown.constants import TWO_SIDED_95
from strapdown.crash import (
    CrashOptions,
    EventChanges,
    Preparation,
    UnitReconstruction,
    VelocityChange,
    at_point,
    ned_pdof,
    pdof,
    prepare_unit,
    reconstruct_unit,
)
from strapdown.earth import gravity
from strapdown.errors import DataError
from strapdown.rotation import within_half_turn
from strapdown.sensors import synchronise
from strapdown.simulation import ExactAnswers
from strapdown.tables import NED

T = TypeVar("T")

# Cases that a process is handed at a time.
TOGETHER = 4


def each_case(one: Callable[[int], T], cases: int, workers: int | None = None) -> list[T]:
    """Do every case, in processes of their own.

    Parameters
    ----------
    one : callable
        From the number of a case, from 0, to what comes of it; to be pickled where there are
        several workers. All that it draws must hang on that number alone.
    cases : int
    workers : int, optional
        Processes; one a core, if not given; with 1, all is done in this one.

    Returns
    -------
    list
        In the order of the cases.

    Raises
    ------
    ValueError
        There is no case, or no worker.
    """
    count = (os.cpu_count() or 1) if workers is None else workers
    if cases < 1 or count < 1:
        raise ValueError(f"{cases} cases by {count} workers: use at least one of each")
    if count == 1 or cases == 1:
        return [one(k) for k in range(cases)]
    # A fresh process has no threads or locks of this one.
    with ProcessPoolExecutor(min(count, cases), mp_context=get_context("spawn")) as pool:
        return list(pool.map(one, range(cases), chunksize=TOGETHER))


# ==================================================================================================
# A simulated crash through the whole chain, and how far it comes from the truth
# ==================================================================================================

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

WINDOW = (-0.1, 0.75)
END = 0.75
BODY, LEVEL = ("forward", "right", "down"), ("north", "east", "down")


@dataclass(frozen=True)
class Judged:
    """One answer against the truth.

    Attributes
    ----------
    error : float
        Answer less truth; m/s, m or deg.
    sd : float
        Told; of a direction half the width of its 95 % interval over 1.96.
    inside : bool
        Whether the interval of 95 % holds the truth.
    """

    error: float
    sd: float
    inside: bool


@dataclass(frozen=True)
class TrialOutcome:
    """What became of a case.

    Attributes
    ----------
    number : int
    kind : str
        Of crash.
    excluded : str
        Why its bounds are not judged: a sensor was at its end, its rest was not found (its bounds
        then allow for an acceleration that no case has), or there was no event; empty for one
        that counts.
    answers : dict of str to Judged
    """

    number: int
    kind: str
    excluded: str
    answers: dict[str, Judged] = field(repr=False)


def reconstruct_case(
    case: TrialCase, point: Triple = (0.0, 0.0, 0.0), *, sampling: str = "instantaneous"
) -> UnitReconstruction:
    """Take a case through the chain: synchronise, prepare, move, reconstruct.

    Parameters
    ----------
    case : TrialCase
    point : tuple of float, m
        Reference point, vehicle axes from the vehicle's origin.
    sampling : {'instantaneous', 'mean'}
        Of the common stamps.

    Returns
    -------
    UnitReconstruction
    """
    there = float(gravity(case.entry.lat_deg, case.entry.alt)[2])
    unit = synchronise([case.unit], sampling=sampling).units[0]
    prepared = prepare_unit(unit.unit, Preparation(gravity=there))
    return reconstruct_unit(
        at_point(prepared, point, time_sd=unit.time_sd),
        case.entry,
        CrashOptions(window=WINDOW, gravity=there),
    )


def judge_case(case: TrialCase, point: Triple = (0.0, 0.0, 0.0)) -> TrialOutcome:
    """Reconstruct a case and compare it with the truth.

    Parameters
    ----------
    case : TrialCase
    point : tuple of float, m
        As `reconstruct_case`. The entry is told for the vehicle's origin: elsewhere it would be
        wrong where the vehicle turns.

    Returns
    -------
    TrialOutcome
        Changes of velocity of the strongest event over the windows that were found, against the
        true ones over the same stretch of time; their directions; place and velocity 750 ms after
        the impact. Excluded with the message where the chain refuses the record.
    """
    try:
        found = reconstruct_case(case, point)
    except DataError as error:
        return TrialOutcome(case.number, case.scenario.name, str(error).splitlines()[0], {})
    return judge(case, found, point)


def judge(
    case: TrialCase, found: UnitReconstruction, point: Triple = (0.0, 0.0, 0.0)
) -> TrialOutcome:
    """Compare what was reconstructed of a case with the truth; as `judge_case`."""
    kind = case.scenario.name
    if not found.body:
        return TrialOutcome(case.number, kind, "no event", {})
    truth = ExactAnswers(case.scenario.motion, case.scenario.start, point)
    answers: dict[str, Judged] = {}
    which = found.events.events.index(found.events.strongest)
    for changes, axes in ((found.body[which], BODY), (found.ned[which], LEVEL)):
        if changes is not None:
            answers |= _changes(changes, axes, truth)
    place, velocity = truth.course([END])
    row = int(np.argmin(np.abs(found.path.time - END)))
    for k, axis in enumerate(NED):
        for what, column, true in (
            ("place", axis, place[0, k]),
            ("velocity", f"V{axis[0].upper()}", velocity[0, k]),
        ):
            error = float(found.path.table[column].iloc[row] - true)
            answers[f"{what} {axis}"] = _normal(error, float(found.path.sd[column].iloc[row]))
    return TrialOutcome(case.number, kind, _not_counted(found), answers)


def _normal(error: float, sd: float) -> Judged:
    return Judged(error, sd, abs(error) <= TWO_SIDED_95 * sd)


def _changes(
    changes: EventChanges, axes: tuple[str, ...], truth: ExactAnswers
) -> dict[str, Judged]:
    out: dict[str, Judged] = {}
    for change in (changes.peak, changes.event):
        dv, body = change.delta_v, axes is BODY
        true = (truth.along_body if body else truth.over_ground)(dv.start, dv.end)
        frame = "body" if body else "level"
        for k, axis in enumerate(axes):
            error = float(dv.vector[k] - true[k])
            out[f"{frame} {change.window} {axis}"] = _normal(error, change.bound.sd[k])
        size = float(np.sqrt(true @ true))
        out[f"{frame} {change.window} resultant"] = _normal(
            change.resultant - size, change.bound.along(dv.vector)
        )
        out |= _direction(change, true, frame)
    return out


def _direction(change: VelocityChange, true: Array, frame: str) -> dict[str, Judged]:
    if frame == "body":
        here, there = pdof(change.delta_v), pdof(true)
        angles = here.horizontal_deg, there.horizontal_deg
    else:
        over, under = ned_pdof(change.delta_v, 0.0), ned_pdof(true, 0.0)
        angles = over.azimuth_deg, under.azimuth_deg
    error = float(within_half_turn(np.array(angles[0] - angles[1])))
    interval = change.interval.horizontal
    sd = 0.5 * interval.width_deg / TWO_SIDED_95
    name = f"{frame} {change.window} direction"
    return {name: Judged(error, sd, interval.contains(angles[1]))}


def _not_counted(found: UnitReconstruction) -> str:
    """What keeps a case from being judged: no rest, or a sensor at its end within the path."""
    prepared = found.at_point.prepared
    assert prepared is not None
    if prepared.rest is None or prepared.rest.grade != "still":
        return "no rest found"
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    within = (time >= WINDOW[0]) & (time <= WINDOW[1])
    if prepared.clipped[within].any():
        return "accelerometer at its end"
    if prepared.gyro_clipped[within].any():
        return "gyro at its end"
    return ""


# ==================================================================================================
# How often the intervals of 95 % hold the truth
# ==================================================================================================

COVERED = 0.95


@dataclass(frozen=True, eq=False)
class Trials:
    """Outcomes of many cases.

    Attributes
    ----------
    kinds : Series
        Of crash, by case.
    excluded : Series of str
        By case: why it does not count; empty for those that do.
    errors, sds, inside : DataFrame
        Cases that count by answers: answer less truth, told standard deviation, whether the
        interval of 95 % holds the truth.
    """

    kinds: pd.Series
    excluded: pd.Series
    errors: pd.DataFrame = field(repr=False)
    sds: pd.DataFrame = field(repr=False)
    inside: pd.DataFrame = field(repr=False)

    def table(self) -> pd.DataFrame:
        """Coverage of every answer.

        Returns
        -------
        DataFrame
            By answer: ``cases``; ``inside``, share; ``low high``, between which a share lies that
            is 95 % in truth, but for three in a thousand such shares: three standard errors;
            ``rms``, ``mean`` and ``largest`` error; ``sd``, quadratic mean of what was told;
            ``ratio``, quadratic mean of error over sd: one, if the bound is right.
        """
        count = self.errors.notna().sum()
        slack = 3.0 * np.sqrt(COVERED * (1.0 - COVERED) / count)
        return pd.DataFrame(
            {
                "cases": count,
                "inside": self.inside.astype(np.float64).mean(),
                "low": COVERED - slack,
                "high": COVERED + slack,
                "rms": np.sqrt((self.errors**2).mean()),
                "mean": self.errors.mean(),
                "largest": self.errors.abs().max(),
                "sd": np.sqrt((self.sds**2).mean()),
                "ratio": np.sqrt(((self.errors / self.sds) ** 2).mean()),
            }
        )


def coverage(
    cases: int = 2000,
    *,
    seed: int = 0,
    workers: int | None = None,
    priors: TrialPriors | None = None,
    untold: Untold | None = None,
) -> Trials:
    """Reconstruct many crashes that are drawn, and see whether the bounds hold the truth.

    Parameters
    ----------
    cases : int
    seed : int
    workers : int, optional
        As `many_cases.each_case`; the outcomes do not depend on it.
    priors : TrialPriors, optional
    untold : Untold, optional
        What acts and is in no bound.

    Returns
    -------
    Trials
    """
    one = partial(_judged, seed=seed, priors=priors or TrialPriors(), untold=untold or Untold())
    return gather(each_case(one, cases, workers))


def gather(outcomes: Iterable[TrialOutcome]) -> Trials:
    """Put outcomes side by side.

    Parameters
    ----------
    outcomes : iterable of TrialOutcome
    """
    known = {o.number: o for o in outcomes}
    counted = {n: o.answers for n, o in known.items() if not o.excluded}

    def table(name: str) -> pd.DataFrame:
        rows = {n: {k: getattr(a, name) for k, a in each.items()} for n, each in counted.items()}
        return pd.DataFrame.from_dict(rows, orient="index")

    return Trials(
        pd.Series({n: o.kind for n, o in known.items()}, name="kind"),
        pd.Series({n: o.excluded for n, o in known.items()}, name="excluded"),
        table("error"),
        table("sd"),
        table("inside"),
    )


def _judged(number: int, *, seed: int, priors: TrialPriors, untold: Untold) -> TrialOutcome:
    return judge_case(draw_case(number, seed, priors, untold))
