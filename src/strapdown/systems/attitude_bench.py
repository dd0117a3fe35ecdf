"""System A, Alexiev (2021): attitude algorithms on one log, and how far they can be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.attitude import AttitudeAlgorithm, make_algorithm, run_attitude
from strapdown.attitude.cost import count_cost
from strapdown.config import AttitudeSpec, specify
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.evaluation.differences import largest_differences
from strapdown.evaluation.known import known_at
from strapdown.evaluation.place_scores import score_places
from strapdown.evaluation.reference_points import score_references
from strapdown.increments import increments_from_imu
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.sensors.rest import find_rests
from strapdown.systems.attitude_answer import Evidence, find_answer
from strapdown.systems.attitude_evidence import find_evidence, worst_evidence
from strapdown.systems.attitude_judgement import judge_runs, judge_truth, judge_turns, truth_score
from strapdown.systems.attitude_known import gather_references, read_second, truth_of_second
from strapdown.systems.attitude_peers import run_beside
from strapdown.systems.attitude_request import (
    ALL_ALGORITHMS,
    as_text,
    as_texts,
    exists,
    one_of_each,
    sort_references,
    source_spec,
)
from strapdown.systems.attitude_shares import (
    between_samples,
    find_shares,
    own_truth,
)
from strapdown.systems.attitude_source import Source, describe, read_source, with_truth
from strapdown.systems.attitude_start import find_gyro_bias, initial_attitude, without_bias
from strapdown.systems.attitude_sweep import (
    Grounds,
    choose_factors,
    refuse_no_rate,
    sweep_rates,
)
from strapdown.systems.attitude_trials import gather, not_judged, trial_names, worst_sweep
from strapdown.systems.part_of_log import check_part, part_of_log
from strapdown.systems.progress import Progress, silent

Array = NDArray[np.float64]

__all__ = ["bench_attitude", "run_bench"]


def bench_attitude(
    source: str | Path | Sequence[str | Path],
    *,
    algorithms: Sequence[str] = ("naive", "euler", "dcm", "quaternion", "rk4", "rotvec"),
    rates: Sequence[float] = (),
    tolerance_deg: float = 1.0,
    interpolation: str = "linear",
    trials: int = 1,
    reference: Sequence[str] = (),
    reference_log: str | Path | None = None,
    initial: str = "auto",
    gyro_bias: str = "none",
    rate: float | None = None,
    sampling: str | None = None,
    seed: int | None = None,
    sensor: str | Path | None = None,
    columns: dict[str, str] | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    time_unit: str | None = None,
    axes: str | None = None,
    repair: bool = False,
    from_s: float | None = None,
    to_s: float | None = None,
    duration_s: float | None = None,
    peers: Sequence[str] = (),
    progress: Progress = silent,
) -> AttitudeBench:
    """Run attitude algorithms over a log or a scenario and compare them with what is known.

    Parameters
    ----------
    source : str or Path, or a sequence of them
        Name of a scenario (`simulation.SCENARIOS`), or path of a log: a file of a known
        format, or the folder of a known recording. Several are trials of the same question:
        the first is shown, and the answer holds for all of them.
    algorithms : sequence of str
        Names with options, as in ``quaternion:order=3`` (`attitude.make_algorithm`), or
        ``all``: the paper's four, Runge-Kutta, and rotation vectors of 1 to 4 increments.
    rates : sequence of float, optional, Hz
        Lower rates to try; the full rate and its halves if none is given.
    tolerance_deg : float
        What counts as accurate enough: the largest error that is known, in deg.
    interpolation : {'linear', 'cubic'}
        How rates at the stamps run between them (`increments.increments_from_imu`).
    trials : int
        Of a scenario: so many seeds, from `seed` on.
    reference : sequence of str
        Reference points in words (``end same as start``, `evaluation.reference_points`), or
        the path of a file of them, or of an attitude truth; ``rests``: gravity at every rest.
    reference_log : str or Path, optional
        Log of a second, better sensor on the same body: laid over this one in time and
        mounting, its attitude is taken for the truth.
    initial : str
        ``auto``, ``truth``, ``level``, ``zero``, or ``roll,pitch,heading`` in deg. ``auto`` is
        the truth where there is one, levelled where the log begins at rest, and zero else.
    gyro_bias : str
        ``none``; ``rest``, the mean over the first stationary stretch; ``rests``, the course
        through all of them; three numbers and a
        unit about forward, right, down; or the path of a log of the sensor lying still.
    rate : float, optional, Hz
        Of a scenario (100 if not given), or of a log without a time column.
    sampling : {'instantaneous', 'mean'}, optional
        What a row holds: the rate at its stamp, or its mean over the interval ending there.
    seed : int, optional
        Of a scenario's noise; 0 if not given.
    sensor : str or Path, optional
        Of a scenario: a sensor of the catalogue, or a file like its entries.
    columns, gyro_unit, accel_unit, time_unit, axes, repair
        How to read a log, as in `formats.recording.ReadOptions`.
    from_s, to_s, duration_s : float, optional, s
        Use a part of the log: to an instant, or so much of it.
    peers : sequence of str
        Filters of other libraries to lay beside (`peers.PEERS`), or ``all``.
    progress : callable, optional
        Called with the name of a stage and the share done.

    Returns
    -------
    AttitudeBench
        Attitudes as tables (quaternion; roll, pitch, heading in deg), errors in deg.

    Raises
    ------
    DataError
        The log or a reference cannot be used; the message names file, row and remedy.
    ConfigError
        Something that was asked for is not known, or cannot be had from this log.

    Notes
    -----
    Alexiev (2021). The Earth's rotation is neglected, as in the paper: 15 deg/h.
    """
    sources = as_texts(source)
    if not sources:
        raise ConfigError("attitude.nothing-named", quantity="source")
    for one in rates:
        refuse_no_rate(float(one))
    check_part(from_s, to_s, duration_s)
    reading = {
        "columns": columns or None,
        "gyro_unit": gyro_unit,
        "accel_unit": accel_unit,
        "time_unit": time_unit,
        "axes": axes,
        "repair": repair or None,
    }
    first, *others = one_of_each(
        one
        for text in sources
        for one in source_spec(text, rate, seed, reading, sampling, trials, rates, sensor)
    )
    words, truth_path = sort_references(as_texts(reference))
    bias = as_text(gyro_bias)
    bias_path = str(Path(bias)) if exists(bias) else None
    spec = specify(
        AttitudeSpec,
        source=first,
        also=tuple(others),
        algorithms=_named(as_texts(algorithms)),
        interpolation=as_text(interpolation),
        rates_hz=tuple(float(r) for r in rates),
        tolerance_deg=tolerance_deg,
        initial=as_text(initial),
        gyro_bias="log" if bias_path else bias,
        references=words,
        truth_path=truth_path,
        gyro_bias_path=bias_path,
        peers=tuple(as_texts(peers)),
        reference_log_path=None if reference_log is None else str(reference_log),
        from_s=from_s,
        to_s=to_s,
        duration_s=duration_s,
    )
    return run_bench(spec, progress)


def run_bench(spec: AttitudeSpec, progress: Progress = silent) -> AttitudeBench:
    """Run attitude algorithms over a log or a scenario and compare them with what is known.

    Parameters
    ----------
    spec : AttitudeSpec
    progress : callable, optional
        Called with the name of a stage and the share that is done, 0 to 1.

    Returns
    -------
    AttitudeBench

    Raises
    ------
    DataError
        The log or a reference cannot be used.
    ConfigError
        Something that was asked for is not known, or cannot be had from this log.
    """
    specs = [spec.model_copy(update={"source": s, "also": ()}) for s in (spec.source, *spec.also)]
    judged = []
    for k, one in enumerate(specs):
        judged.append(_bench(one, _part_of(progress, k, len(specs))))
    bench = judged[0][0]
    if len(judged) == 1:
        return bench
    benches = [b for b, _ in judged]
    names = trial_names([s.source for s in specs])
    sweep = worst_sweep([b.sweep for b in benches])
    together = worst_evidence([e for _, e in judged], sweep)
    return replace(
        bench,
        specification=spec.model_dump(mode="json"),
        sweep=sweep,
        answer=find_answer(together, spec.tolerance_deg),
        trials=gather(benches, names),
        findings=tuple(
            f.replace(file=f.file or name)
            for b, name in zip(benches, names, strict=True)
            for f in b.findings
        )
        + not_judged([e.known for _, e in judged], names),
        inputs=tuple(item for b in benches for item in b.inputs),
    )


def _named(texts: list[str]) -> tuple[str, ...]:
    return ALL_ALGORITHMS if texts == ["all"] else tuple(texts)


def _part_of(progress: Progress, k: int, count: int) -> Progress:
    """Progress of one of several alike."""
    return lambda stage, share: progress(stage, (k + share) / count)


def _make_algorithms(texts: Sequence[str]) -> list[AttitudeAlgorithm]:
    algorithms = [make_algorithm(text) for text in texts]
    if not algorithms:
        raise ConfigError("attitude.none-named", quantity="algorithms")
    for one in algorithms:
        kernel = type(one).advance_kernel
        home = getattr(kernel, "py_func", kernel).__module__
        if not home.startswith("strapdown."):
            raise ConfigError(
                "attitude.plugin-not-countable", quantity="algorithms", name=one.name, home=home
            )
    if len({a.label for a in algorithms}) < len(algorithms):
        raise ConfigError(
            "attitude.named-twice", quantity="algorithms", algorithms=[a.label for a in algorithms]
        )
    return algorithms


def _bench(spec: AttitudeSpec, progress: Progress) -> tuple[AttitudeBench, Evidence]:
    """Bench one source, and what its answer rests on."""
    algorithms = _make_algorithms(spec.algorithms)
    progress("reading", 0.0)
    source = read_source(spec)
    whole = source.imu
    part = part_of_log(whole, spec.from_s, spec.to_s, spec.duration_s, source.name)
    source = replace(source, imu=part)
    source, second = read_second(spec, with_truth(source, spec))
    rests = find_rests(source.imu)
    bias, bias_input = find_gyro_bias(spec, source, rests)
    imu = without_bias(spec, source.imu, bias, rests)
    findings: list[Finding] = []
    q_nb, initial, begin = initial_attitude(spec.initial, source, rests, findings)
    imu = imu[imu.index >= begin]
    if len(imu) < 2:
        raise DataError("attitude.fewer-than-two-samples-left", file=source.name, begin=begin)
    if second is not None and source.truth is None:
        source = truth_of_second(source, second, imu, q_nb)
    findings = [*source.findings, *findings]
    increments = increments_from_imu(imu, spec.interpolation)
    runs = []
    for k, algorithm in enumerate(algorithms):
        progress(algorithm.title, 0.05 + 0.15 * k / len(algorithms))
        runs.append(run_attitude(algorithm, increments, q_nb))
    span = (float(imu.index[0]), float(imu.index[-1]))
    levelled = initial["method"] == "level"
    told = gather_references(spec, source, span, rests, levelled)
    references = told.points
    scores = [s for run in runs for s in truth_score(run, source)]
    scores += [s for run in runs for s in score_references(run, references, imu)]
    findings += judge_runs(runs, increments)
    findings += judge_turns(scores)
    findings += judge_truth(source, span)
    grounds = _grounds(spec, source, imu, q_nb, references)
    progress("sharing out the error", 0.2)
    shares = find_shares(
        algorithms, runs, imu, grounds.own, grounds.truth, q_nb, spec.interpolation
    )
    factors = choose_factors(imu, spec.rates_hz, findings)
    sweep = sweep_rates(
        algorithms, grounds, factors, lambda stage, share: progress(stage, 0.3 + 0.65 * share)
    )
    costs = tuple(count_cost(algorithm, increments["dt"]) for algorithm in algorithms)
    between = source.sampling_error_deg or between_samples(imu, q_nb)
    evidence = find_evidence(
        grounds, algorithms, costs, sweep, bias, rests, None if between is None else between[1]
    )
    beside = run_beside(spec.peers, source, imu, q_nb, references, findings)
    truth, scored = source.truth, source.scored
    if truth is not None and scored is not None:
        inside = np.asarray((truth.index >= span[0]) & (truth.index <= span[1]))
        truth, scored = truth[inside], scored[inside]
    bench = AttitudeBench(
        source=source.name,
        description=describe(source.imu, source.what, whole),
        specification=spec.model_dump(mode="json"),
        imu=imu,
        runs=tuple(runs),
        truth=truth,
        scored=scored,
        scores=tuple(scores),
        sampling_error_deg=between,
        differences_deg=largest_differences(tuple(runs)),
        rests=rests,
        initial=initial,
        gyro_bias=bias,
        references=references,
        readings=source.readings,
        findings=tuple(findings),
        inputs=source.inputs + bias_input,
        costs=costs,
        shares=shares,
        sweep=sweep,
        answer=find_answer(evidence, spec.tolerance_deg),
        places=tuple(p for run in runs for p in score_places(run, told.places, imu, rests))
        if told.places
        else (),
        peers=beside,
        offers=told.offers,
        second=None if second is None else second.aligned,
    )
    return bench, evidence


def _grounds(
    spec: AttitudeSpec, source: Source, imu: pd.DataFrame, q_nb: Array, references: pd.DataFrame
) -> Grounds:
    """What errors are measured against, and what is known of the attitude itself."""
    stamps = imu.index.to_numpy(dtype=np.float64)
    known = None
    if source.truth is not None and source.scored is not None:
        found = known_at(source.truth, source.scored, stamps)
        known = found if found.counts.any() else None
    clean = None if source.clean is None else source.clean.loc[imu.index]
    own = own_truth(imu, clean, known, q_nb, spec.interpolation)
    return Grounds(imu, q_nb, own, known, references, spec.interpolation)
