"""What ringing of the structure leaves of a path at 200 Hz, by how the samples are taken."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pandas as pd

from papers.crash_trials.many_cases import each_case
from papers.crash_trials.paper_experiment import INTERVAL, RINGINGS, pole_entry
from papers.crash_trials.short_error_model import ideal_design
from papers.crash_trials.trial_case import TrialCase
from papers.crash_trials.trial_outcome import END, reconstruct_case
from strapdown.simulation import (
    CrashScenario,
    ExactAnswers,
    Ringing,
    Setting,
    pole_impact,
    record_crash,
)
from strapdown.tables import NED

#: How samples are taken: name, kind, bandwidth of the single-pole low-pass before the sampler, Hz.
SAMPLERS: tuple[tuple[str, str, float], ...] = (
    ("instants", "instantaneous", math.inf),
    ("means", "mean", math.inf),
    ("20 Hz low-pass", "instantaneous", 20.0),
    ("50 Hz low-pass", "instantaneous", 50.0),
    ("80 Hz low-pass", "instantaneous", 80.0),
)
NO_RINGING = "none"


def ringing_at_200_hz(
    phases: int = 10, *, scenario: CrashScenario | None = None, workers: int | None = None
) -> pd.DataFrame:
    """Reconstruct the paper's crash with ideal sensors on a structure that rings.

    Parameters
    ----------
    phases : int
        Instants between two samples at which the ringing begins with the impact, forward.
    scenario : CrashScenario, optional
        The pole impact of the paper after a short rest, if not given.
    workers : int, optional
        Processes, as `coverage`.

    Returns
    -------
    DataFrame
        By ringing (first ``none``) and way of sampling: ``rms`` and ``largest`` over the phases,
        m: distance at 750 ms from the true place of the rigid vehicle. What a low-pass does to the
        crash itself is the row without ringing; its delay is taken off as in any record.
    """
    crash = scenario or pole_impact(setting=Setting(stand=2.6, towing=5.0, after=0.85))
    cases: list[tuple[str, str, str, float, tuple[float, float, float] | None, float]] = [
        (NO_RINGING, *sampler, None, 0.0) for sampler in SAMPLERS
    ]
    for name, ringing in RINGINGS.items():
        for sampler in SAMPLERS:
            cases += [(name, *sampler, ringing, (k + 0.5) / phases) for k in range(phases)]
    away = each_case(partial(_away, cases=tuple(cases), crash=crash), len(cases), workers)
    table = pd.DataFrame([c[:2] for c in cases], columns=["ringing", "samples"])
    table["away"] = away
    groups = table.groupby(["ringing", "samples"], sort=False)["away"]
    return pd.DataFrame(
        {"rms": groups.agg(lambda d: float(np.sqrt((d**2).mean()))), "largest": groups.max()}
    )


def perfect_sensors(
    *, scenario: CrashScenario | None = None, ringing: Ringing | None = None
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Errors of the place at 750 ms with ideal sensors at 200 Hz: north, east, down, m.

    Parameters
    ----------
    scenario : CrashScenario, optional
        As `ringing_at_200_hz`.
    ringing : Ringing, optional
    """
    crash = scenario or pole_impact(setting=Setting(stand=2.6, towing=5.0, after=0.85))
    return _error(crash, "instantaneous", math.inf, () if ringing is None else (ringing,))


def _away(
    number: int,
    *,
    cases: tuple[tuple[str, str, str, float, tuple[float, float, float] | None, float], ...],
    crash: CrashScenario,
) -> float:
    _, _, sampling, bandwidth, ringing, phase = cases[number]
    rings = () if ringing is None else (Ringing(crash.start + phase * INTERVAL, *ringing),)
    return float(np.linalg.norm(_error(crash, sampling, bandwidth, rings)))


def _error(
    crash: CrashScenario, sampling: str, bandwidth: float, rings: tuple[Ringing, ...]
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    unit, recorder = record_crash(
        crash.motion,
        ideal_design(bandwidth=bandwidth),
        impact=crash.start,
        seed=0,
        ringing=rings,
        sampling=sampling,
    )
    case = TrialCase(0, crash, unit, pole_entry(crash, 0.0), recorder)
    path = reconstruct_case(case, sampling=sampling).path
    row = int(np.argmin(np.abs(path.time - END)))
    true, _ = ExactAnswers(crash.motion, crash.start).course([path.time[row]])
    return np.asarray(path.table[NED].to_numpy(dtype=np.float64)[row] - true[0])
