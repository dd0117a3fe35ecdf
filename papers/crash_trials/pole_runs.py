"""The crash test of Tadic and Vukajlovic (2016), with recorders that are drawn again and again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.crash_trials.cases import TrialCase, TrialPriors, Untold, paper_design, record_untold
from papers.crash_trials.outcomes import (
    END,
    TrialOutcome,
    Trials,
    coverage,
    each_case,
    gather,
    judge,
    reconstruct_case,
)
from strapdown import frames
from strapdown.constants import TWO_SIDED_95
from strapdown.crash import Entry
from strapdown.errors import DataError
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors import TriadUncertainty, child, crash_priors, draw_errors
from strapdown.simulation import (
    CRASHES,
    CrashScenario,
    ExactAnswers,
    RecorderDesign,
    Ringing,
    Setting,
    TriadDesign,
    crash_scenario,
    point_kinematics,
    record_crash,
    sample_accelerometer,
    sample_gyro,
)
from strapdown.tables import NED, imu_table

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


# ==================================================================================================
# Recorders whose whole error is a bias, a scale factor, a drift and noise; and ideal ones
# ==================================================================================================

RATE = 200.0  # Hz
# Places below the seed of a run.
ACCEL, GYRO, ACCEL_NOISE, GYRO_NOISE, START_SPEED = range(5)


def short_design(rate: float = RATE) -> RecorderDesign:
    """Return a recorder at the vehicle's origin that has the errors of `crash_priors` alone.

    For the whole chain: bias of the gyro and tilt are then found at rest.

    Parameters
    ----------
    rate : float, Hz
    """
    priors = crash_priors(rate)
    return RecorderDesign(
        "short",
        (TriadDesign("accelerometer", priors["accel"], rate),),
        TriadDesign("gyro", priors["gyro"], rate),
    )


def ideal_design(rate: float = RATE, bandwidth: float = math.inf) -> RecorderDesign:
    """Return a recorder at the vehicle's origin without any error but that of a low-pass.

    Parameters
    ----------
    rate, bandwidth : float, Hz
    """
    none = TriadUncertainty(bandwidth=bandwidth)
    return RecorderDesign(
        "ideal", (TriadDesign("accelerometer", none, rate),), TriadDesign("gyro", none, rate)
    )


@dataclass(frozen=True, eq=False)
class ShortRuns:
    """Errors of the place at the end, 750 ms after the impact.

    Attributes
    ----------
    errors : ndarray, (runs, 3), m
        Computed less true: north, east, down.
    """

    errors: Array

    def table(self) -> pd.DataFrame:
        """By axis: ``rms`` and ``largest``, m."""
        return pd.DataFrame(
            {
                "rms": np.sqrt((self.errors**2).mean(axis=0)),
                "largest": np.abs(self.errors).max(axis=0),
            },
            index=pd.Index(NED, name="axis"),
        )


def without_a_rest(
    seeds: int = 500,
    *,
    seed: int = 0,
    speed_sd: float = 0.0,
    scenario: CrashScenario | None = None,
) -> ShortRuns:
    """Navigate with the errors of `crash_priors` as they are: nothing is found at rest.

    The state at the impact is known, but for the speed.

    Parameters
    ----------
    seeds : int
    seed : int
    speed_sd : float, m/s
    scenario : CrashScenario, optional
        The paper's pole impact, if not given.

    Returns
    -------
    ShortRuns
    """
    crash = scenario or CRASHES["pole"]
    motion, steps = crash.motion, round(END * RATE)
    time = crash.start + np.arange(steps + 1) / RATE
    truth = motion.trajectory(time)
    force = motion.specific_force(time)
    true = point_kinematics(motion, (0.0, 0.0, 0.0), time[[0, -1]], epoch=crash.start).position
    priors = crash_priors(RATE)
    out = np.empty((seeds, 3))
    for number in range(seeds):
        root = child(seed, number)
        accel = sample_accelerometer(
            motion,
            draw_errors(priors["accel"], root, ACCEL),
            time,
            seed=child(root, ACCEL_NOISE),
            specific_force=force,
        )
        gyro = sample_gyro(
            motion, draw_errors(priors["gyro"], root, GYRO), time, seed=child(root, GYRO_NOISE)
        )
        begin = NavState.from_trajectory(truth)
        draw = np.random.Generator(np.random.PCG64(child(root, START_SPEED))).standard_normal()
        faster = 1.0 + speed_sd * float(draw) / float(np.linalg.norm(begin.v_n))
        begin = replace(begin, v_n=np.asarray(begin.v_n) * faster)
        increments = motion_increments(imu_table(time, gyro, accel, sampling="instantaneous"))
        out[number] = _moved(begin, increments) - (true[1] - true[0])
    return ShortRuns(out)


def _moved(begin: NavState, increments: pd.DataFrame) -> Array:
    run = run_mechanization(NorthEastDown(), begin, increments)
    place = run.trajectory[["lat", "lon", "alt"]].to_numpy(dtype=np.float64)
    return np.asarray(frames.place_difference(place[-1:], place[:1])[0])


# ==================================================================================================
# What ringing of the structure leaves of a path at 200 Hz, by how the samples are taken
# ==================================================================================================

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
    crash = scenario or crash_scenario("pole", setting=Setting(stand=2.6, towing=5.0, after=0.85))
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
    crash = scenario or crash_scenario("pole", setting=Setting(stand=2.6, towing=5.0, after=0.85))
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


# ==================================================================================================
# What becomes of the bounds where something acts that they were not told of
# ==================================================================================================

#: By name: ringing of each kind, accelerometers that bend more than told, and triggers that are
#: late by more than they say.
UNTOLD: dict[str, Untold] = {
    "nothing": Untold(),
    **{f"ringing, {name}": Untold(ringing=(r,)) for name, r in RINGINGS.items()},
    "nonlinearity of 2 % of full scale": Untold(nonlinearity=0.02),
    "nonlinearity of 5 % of full scale": Untold(nonlinearity=0.05),
    "trigger off by 5 ms": Untold(trigger_sd=0.005),
    "trigger off by 10 ms": Untold(trigger_sd=0.010),
}


def degradation(
    cases: int = 500,
    *,
    seed: int = 0,
    workers: int | None = None,
    priors: TrialPriors | None = None,
    untold: dict[str, Untold] | None = None,
) -> dict[str, Trials]:
    """Run the same cases with what nobody was told of.

    Parameters
    ----------
    cases : int
    seed : int
    workers : int, optional
    priors : TrialPriors, optional
        All as `coverage`.
    untold : dict of str to Untold, optional
        `UNTOLD`, if not given.

    Returns
    -------
    dict of str to Trials
    """
    return {
        name: coverage(cases, seed=seed, workers=workers, priors=priors, untold=what)
        for name, what in (UNTOLD if untold is None else untold).items()
    }


def degradation_table(trials: dict[str, Trials]) -> pd.DataFrame:
    """Put the coverage of every answer side by side.

    Parameters
    ----------
    trials : dict of str to Trials

    Returns
    -------
    DataFrame
        Answers by what was not told: share of the cases that count whose interval holds the truth.
    """
    return pd.DataFrame({name: t.table()["inside"] for name, t in trials.items()})
