"""Benches with every field filled, from real runs over a simulated motion, built by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.attitude_algorithms.cost import Cost
from strapdown.attitude_comparison.answer import Answer
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun
from strapdown.attitude_comparison.sweep import ErrorShare, Trials
from strapdown.evaluation.differences import error_angles, largest_differences
from strapdown.evaluation.reference_points import Score, references_from_words, score_references
from strapdown.increments import increments_from_imu
from strapdown.simulation import ImuErrors, TriadErrors, find_scenario, simulate_imu
from strapdown.tables import QUATERNION
from strapdown.tables.sample_clock import sample_clock

NINE = (
    "naive",
    "euler",
    "euler:step=rk4",
    "dcm",
    "dcm:order=1",
    "quaternion",
    "rk4",
    "rotvec",
    "rotvec:samples=4,coefficients=fit",
)
# Operations of a sample, in the order of magnitude that counting gives.
_OPERATIONS = {
    "naive": (6, 3, 0, 0, 0, 3),
    "euler": (9, 12, 1, 0, 4, 3),
    "euler:step=rk4": (40, 60, 4, 0, 16, 9),
    "dcm": (40, 48, 2, 1, 2, 9),
    "dcm:order=1": (27, 33, 0, 0, 0, 9),
    "quaternion": (18, 24, 1, 1, 2, 4),
    "rk4": (60, 74, 1, 1, 0, 7),
    "rotvec": (24, 34, 1.5, 1, 2, 14),
    "rotvec:samples=4,coefficients=fit": (37, 53, 1.25, 1, 2, 20),
}
_FACTORS = (1, 2, 5, 10, 25)


def _share(clean, noisy, truth):
    """Errors of a run at the end, RMS and largest, and the difference that the errors make."""

    def three(errors):
        return (
            float(errors.iloc[-1]),
            float(np.sqrt((errors**2).mean())),
            float(errors.max()),
        )

    own = three(error_angles(clean.attitude, truth))
    sensor = three(error_angles(noisy.attitude, clean.attitude))
    return own, sensor


@cache
def _bench(algorithms, name="alexiev-fig2c", rate=100.0, truth_known=True, references=()):
    scenario = find_scenario(name)
    runs, clean_runs, sweep = {}, {}, []
    errors = ImuErrors(TriadErrors(noise_density=0.0003, bias=(0.002, -0.001, 0.001)))
    noisy, truth = simulate_imu(scenario.motion, errors, rate=rate, accelerometer=False)
    clean, _ = simulate_imu(scenario.motion, ImuErrors(), rate=rate, accelerometer=False)
    start = truth[QUATERNION].to_numpy()[0]
    tolerance = 2.0
    for label in algorithms:
        algorithm = make_algorithm(label)
        for meaning in ("drop", "sum"):
            for factor in _FACTORS:
                both = []
                for imu in (clean, noisy):
                    part = imu.iloc[::factor].copy()
                    part.attrs = imu.attrs
                    if meaning == "sum" and factor > 1:  # the mean rate since the last stamp
                        part = imu.groupby((np.arange(len(imu)) + factor - 1) // factor).mean()
                        part.index = imu.index[::factor][: len(part)]
                        part.attrs = imu.attrs | {"sampling": "mean"}
                    both.append(run_attitude(algorithm, increments_from_imu(part), start))
                if meaning == "drop" and factor == 1:
                    clean_runs[label], runs[label] = both
                e = error_angles(both[1].attitude, truth)
                own = float(error_angles(both[0].attitude, truth).max())
                most = float(e.max())
                sweep.append(
                    {
                        "algorithm": label,
                        "meaning": meaning,
                        "factor": factor,
                        "rate_hz": rate / factor,
                        "own_deg": own,
                        "final_deg": float(e.iloc[-1]),
                        "rms_deg": float(np.sqrt((e**2).mean())),
                        "max_deg": most,
                        "reference_deg": np.nan,
                        "error_deg": most if truth_known else own,
                    }
                )
    sweep = pd.DataFrame(sweep)
    if not truth_known:
        sweep[["final_deg", "rms_deg", "max_deg"]] = np.nan
    run_list = tuple(runs[a] for a in algorithms)
    points = references_from_words(list(references), float(noisy.index[0]), float(noisy.index[-1]))
    scores, shares, costs = [], [], []
    for label in algorithms:
        e = error_angles(runs[label].attitude, truth)
        if truth_known:
            rms = float(np.sqrt((e**2).mean()))
            scores.append(
                Score(label, "truth", float(e.index[-1]), float(e.iloc[-1]), rms, float(e.max()))
            )
        scores += score_references(runs[label], points, noisy)
        own, sensor = _share(clean_runs[label], runs[label], truth)
        single = tuple(1e-5 * (1 + k) for k in range(3))
        shares.append(ErrorShare(label, own, sensor if truth_known else None, single))
        add, multiply, divide, sqrt, trig, memory = _OPERATIONS.get(label, (9, 9, 1, 1, 1, 4))
        cycles = add + multiply + 14 * divide + 14 * sqrt + 80 * trig
        costs.append(Cost(label, add, multiply, divide, sqrt, trig, cycles, memory))
    passing = sweep[(sweep["error_deg"] <= tolerance) & (sweep["meaning"] == "drop")]
    order = {c.algorithm: c.cycles for c in costs}
    best = None
    if len(passing):
        rated = passing.assign(c=passing["algorithm"].map(order) * passing["rate_hz"])
        best = rated.sort_values(["c", "algorithm"]).iloc[0]
    answer = Answer(
        verdict="sensor" if best is None else "enough" if truth_known else "own",
        sentence=(
            "No algorithm stays within 2° here: the sensor alone is 3.1° off."
            if best is None
            else f"{best['algorithm']} at {best['rate_hz']:g} Hz is enough: it stays within "
            f"{best['error_deg']:.2g}° where {tolerance:g}° is asked for."
        ),
        tolerance_deg=tolerance,
        algorithm=None if best is None else str(best["algorithm"]),
        meaning=None if best is None else str(best["meaning"]),
        rate_hz=None if best is None else float(best["rate_hz"]),
        why=(
            "At the full rate every algorithm but naive differs from the truth by the sensor's "
            "1.2°, and none adds more than 0.05°.",
            "Dropping samples below 20 Hz adds more than the sensor does.",
        ),
        helps=("A bias taken at rest first would take away two thirds of what is left.",),
    )
    return AttitudeComparison(
        source=name,
        description=f"simulated: {scenario.title}; {len(noisy)} samples",
        specification={"source": {"kind": "scenario"}},
        imu=noisy,
        runs=run_list,
        truth=truth if truth_known else None,
        scored=np.ones(len(truth), dtype=bool) if truth_known else None,
        scores=tuple(scores),
        sampling_error_deg=(0.0, 0.01) if truth_known else None,
        differences_deg=largest_differences(run_list),
        rests=(),
        initial={
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 0.0,
            "time_s": 0.0,
            "from": "the truth",
        },
        gyro_bias={"rad_per_s": None, "from": "none was removed"},
        clock=sample_clock(noisy.index.to_numpy()),
        references=points,
        readings=(),
        findings=(),
        inputs=(),
        costs=tuple(costs),
        shares=tuple(shares),
        sweep=sweep,
        answer=answer,
    )


def _trials(bench):
    """Five trials whose errors spread about the bench's own."""
    labels = [r.algorithm for r in bench.runs]
    base = bench.sweep[(bench.sweep["factor"] == 1) & (bench.sweep["meaning"] == "drop")]
    base = base.set_index("algorithm")
    draw = np.random.default_rng(7)
    names = tuple(f"seed {k}" for k in range(5))
    spread = draw.lognormal(0.0, 0.25, (len(names), len(labels)))
    rows = [
        (name, label, *(float(base.loc[label, c] * spread[i, j]) for c in _TRIAL_COLUMNS))
        for i, name in enumerate(names)
        for j, label in enumerate(labels)
    ]
    errors = pd.DataFrame(rows, columns=["trial", "algorithm", *_TRIAL_COLUMNS])
    means = errors.groupby("algorithm")["error_deg"].agg(["mean", "std"]).sort_values("mean")
    half = means["std"] * 2.776 / np.sqrt(len(names))
    ranking = pd.DataFrame(
        {
            "algorithm": means.index,
            "mean_deg": means["mean"].to_numpy(),
            "low_deg": (means["mean"] - half).to_numpy(),
            "high_deg": (means["mean"] + half).to_numpy(),
            "luck": [*np.linspace(0.001, 0.6, len(means) - 1), np.nan],
        }
    )
    return Trials(names, errors, ranking)


_TRIAL_COLUMNS = ("error_deg", "own_deg", "rms_deg", "final_deg")


def _peers(bench):
    """Three libraries: one that integrates, one with accelerometers, one that knows nothing."""
    run = bench.runs[0].attitude

    def score(name, error):
        return (Score(name, "truth", float(run.index[-1]), error, 0.8 * error, 1.4 * error),)

    return (
        PeerRun("ahrs 0.4.0 AngularRate", "gyro", run, score("AngularRate", 1.3)),
        PeerRun("vqf 2.1.1", "gyro+accel", run, score("vqf", 0.4)),
        PeerRun("imufusion 1.2.5", "gyro+accel+mag", run, score("imufusion", 0.6)),
    )


@pytest.fixture(scope="session")
def make_bench():
    """A function that makes a bench: which algorithms, and what of the rest there is."""

    def make(
        algorithms=("naive", "dcm", "quaternion"),
        *,
        truth=True,
        sweep=True,
        trials=False,
        peers=False,
        references=(),
    ):
        bench = _bench(tuple(algorithms), truth_known=truth, references=tuple(references))
        if trials:
            bench = replace(bench, trials=_trials(bench))
        if peers:
            bench = replace(bench, peers=_peers(bench))
        if not sweep:
            bench = replace(bench, sweep=bench.sweep.iloc[:0])
        return bench

    return make


@pytest.fixture(scope="session")
def full_bench(make_bench):
    """Nine algorithms and everything that a bench can hold."""
    return make_bench(NINE, trials=True, peers=True)
