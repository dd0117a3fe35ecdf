"""The crash test of Tadic and Vukajlovic (2016), with recorders that are drawn again and again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.crash_trials.coverage import Trials, gather
from papers.crash_trials.many_cases import each_case
from papers.crash_trials.trial_case import TrialCase, Untold, paper_design, record_untold
from papers.crash_trials.trial_outcome import (
    TrialOutcome,
    judge,
    reconstruct_case,
)
from strapdown.constants import TWO_SIDED_95
from strapdown.crash import Entry
from strapdown.exceptions import DataError
from strapdown.sensors import child
from strapdown.simulation import CRASHES, CrashScenario, ExactAnswers, RecorderDesign, Ringing
from strapdown.tables import NED

Array = NDArray[np.float64]

#: What the structure may do where a recorder is mounted: amplitude, m/s², frequency, Hz, decay, s.
#: The three of the project's theory; the paper has no figures.
RINGINGS: dict[str, tuple[float, float, float]] = {
    "10 g at 195 Hz": (98.0665, 195.0, 0.03),
    "10 g at 120 Hz": (98.0665, 120.0, 0.03),
    "5 g at 300 Hz": (49.03325, 300.0, 0.03),
}
# Places below the seed of a run.
SPEED, RECORDER, PHASE = range(3)
# Of the paper's recorders: where between two samples the ringing begins is drawn.
INTERVAL = 0.005  # s


@dataclass(frozen=True, eq=False)
class PaperExperiment:
    """Errors of the path of the paper's crash, over many recorders.

    A recorder that the chain refuses has no path: `answers` says which and why. A gyro drawn with
    a bias above 20 deg/s, that no data sheet allows, is not found at rest.

    Attributes
    ----------
    time : ndarray, (n,), s
        From the impact, over the path's window.
    errors : ndarray, (runs, n, 3), m
        Computed less true place: forward, right, down of the vehicle at the impact.
    sds : ndarray, (runs, n, 3), m
        As told.
    variances : DataFrame
        Mean over the runs of what each contributor adds at the end, told: ``north east down``, m².
    answers : Trials
        Changes of velocity, directions and the last place, with their bounds.
    """

    time: Array
    errors: Array = field(repr=False)
    sds: Array = field(repr=False)
    variances: pd.DataFrame = field(repr=False)
    answers: Trials = field(repr=False)

    def table(self) -> pd.DataFrame:
        """Errors of each axis.

        Returns
        -------
        DataFrame
            By axis, m: ``rms`` and ``largest`` at the end, 750 ms; ``rms_window`` and
            ``largest_window`` over window and runs; ``sd``, quadratic mean of what was told at
            the end; ``inside``, share of the runs whose interval of 95 % holds the truth there.
        """
        last, told = self.errors[:, -1], self.sds[:, -1]
        return pd.DataFrame(
            {
                "rms": np.sqrt((last**2).mean(axis=0)),
                "largest": np.abs(last).max(axis=0),
                "rms_window": np.sqrt((self.errors**2).mean(axis=(0, 1))),
                "largest_window": np.abs(self.errors).max(axis=(0, 1)),
                "sd": np.sqrt((told**2).mean(axis=0)),
                "inside": (np.abs(last) <= TWO_SIDED_95 * told).mean(axis=0),
            },
            index=pd.Index(NED, name="axis"),
        )


@dataclass(frozen=True, eq=False)
class _Run:
    time: Array
    error: Array
    sd: Array
    variances: pd.DataFrame
    outcome: TrialOutcome


def paper_experiment(
    seeds: int = 500,
    *,
    seed: int = 0,
    speed_sd: float = 0.05,
    design: RecorderDesign | None = None,
    ringing: Sequence[tuple[float, float, float]] = (),
    scenario: CrashScenario | None = None,
    workers: int | None = None,
) -> PaperExperiment:
    """Repeat the paper's crash test with recorders whose errors are drawn.

    Parameters
    ----------
    seeds : int
        How many recorders, each with its own entry speed.
    seed : int
    speed_sd : float, m/s
        Of the entry speed that is told.
    design : RecorderDesign, optional
        IMU1 of the paper with everything that is not known of it, if not given: biases, high-g
        biases of up to 11.91 m/s², what is left of the warm-up, scale factors, misalignment,
        nonlinearity, sensitivity to g, noise, converters, ranges, low-passes, mounting, lever arm,
        clock and trigger.
    ringing : sequence of (amplitude, frequency, decay), m/s², Hz, s
        Of the structure, forward, from an instant within 5 ms after the impact that is drawn; no
        bound is told of it.
    scenario : CrashScenario, optional
        The pole impact of the paper, if not given.
    workers : int, optional
        Processes, as `coverage`.

    Returns
    -------
    PaperExperiment
    """
    one = partial(
        _run,
        seed=seed,
        speed_sd=speed_sd,
        design=design or paper_design(),
        ringing=tuple(ringing),
        scenario=scenario or CRASHES["pole"],
    )
    all_runs = each_case(one, seeds, workers)
    runs = [r for r in all_runs if isinstance(r, _Run)]
    parts = pd.concat([r.variances for r in runs])
    return PaperExperiment(
        runs[0].time,
        np.array([r.error for r in runs]),
        np.array([r.sd for r in runs]),
        parts.groupby(level=0, sort=False).sum() / len(runs),
        gather(r.outcome if isinstance(r, _Run) else r for r in all_runs),
    )


def _run(
    number: int,
    *,
    seed: int,
    speed_sd: float,
    design: RecorderDesign,
    ringing: tuple[tuple[float, float, float], ...],
    scenario: CrashScenario,
) -> _Run | TrialOutcome:
    motion = scenario.motion
    truth = ExactAnswers(motion, scenario.start)
    draw = np.random.Generator(np.random.PCG64(child(seed, number, SPEED))).standard_normal()
    phase = np.random.Generator(np.random.PCG64(child(seed, number, PHASE))).uniform()
    entry = pole_entry(scenario, speed_sd, float(draw))
    rings = tuple(Ringing(scenario.start + phase * INTERVAL, *r) for r in ringing)
    root = int(child(seed, number, RECORDER).generate_state(1, np.uint64)[0])
    unit, recorder = record_untold(scenario, design, Untold(), root, rings)
    case = TrialCase(number, scenario, unit, entry, recorder)
    try:
        found = reconstruct_case(case)
    except DataError as error:
        return TrialOutcome(number, scenario.name, str(error).splitlines()[0], {})
    path = found.path
    place, _ = truth.course(path.time)
    variances = path.variances()[NED]
    return _Run(
        path.time,
        path.table[NED].to_numpy() - place,
        path.sd[NED].to_numpy(),
        variances,
        judge(case, found),
    )


def pole_entry(scenario: CrashScenario, speed_sd: float, draw: float = 0.0) -> Entry:
    """What is told of the entry: its speed with an error, and where it is.

    Parameters
    ----------
    scenario : CrashScenario
    speed_sd : float, m/s
    draw : float
        The error, in standard deviations.
    """
    motion = scenario.motion
    north, east, _ = motion.kinematics(np.array([scenario.start])).velocity[0]
    origin = motion.origin
    return Entry.from_speed(
        float(np.hypot(north, east)) + speed_sd * draw,
        speed_sd,
        heading_deg=motion.heading_deg,
        lat_deg=origin.lat_deg,
        lon_deg=origin.lon_deg,
        alt=origin.alt,
    )
