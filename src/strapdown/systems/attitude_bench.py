"""System A, Alexiev (2021): attitude algorithms on one log, and their accuracy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.levelling import level
from strapdown.attitude import AttitudeAlgorithm, make_algorithm, run_attitude
from strapdown.attitude.cost import count_cost
from strapdown.config import AttitudeSpec, LogSpec, ScenarioSpec, specify
from strapdown.constants import GYRO_SUMS, GYRO_UNITS
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.evaluation.differences import known_at, largest_differences
from strapdown.evaluation.position_references import score_places
from strapdown.evaluation.reference_points import score_references
from strapdown.formats import read_log
from strapdown.formats.columns import factor_of, parse_unit
from strapdown.formats.references import read_reference_words
from strapdown.increments import increments_from_imu
from strapdown.progress import Progress, silent
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.results.inputs import InputFiles
from strapdown.results.rests import RestStretch
from strapdown.sensors.rest import find_rests, gyro_bias_from_rests, without_gyro_bias
from strapdown.simulation import SCENARIOS, find_scenario
from strapdown.systems.attitude_answer import Evidence, find_answer, find_evidence, worst_evidence
from strapdown.systems.attitude_known import (
    gather_references,
    judge_runs,
    judge_truth,
    judge_turns,
    read_second,
    run_beside,
    truth_of_second,
    truth_score,
)
from strapdown.systems.attitude_source import (
    Source,
    describe,
    read_options,
    read_source,
    with_truth,
)
from strapdown.systems.attitude_sweep import (
    Grounds,
    between_samples,
    choose_factors,
    find_shares,
    gather,
    not_judged,
    own_truth,
    refuse_no_rate,
    sweep_rates,
    trial_names,
    worst_sweep,
)
from strapdown.systems.inputs import check_part, input_files, part_of_log
from strapdown.tables import GYRO

__all__ = ["bench_attitude", "run_bench"]


Array = NDArray[np.float64]


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
    """Run attitude algorithms over a log or a scenario and compare them with the known attitude.

    Parameters
    ----------
    source : str, Path, or a sequence of both
        Name of a scenario (`simulation.SCENARIOS`), or path of a log: a file of a known
        format, or the folder of a known recording. Several are trials of the same question:
        the first is shown, and the answer covers all trials.
    algorithms : sequence of str
        Names with options, as in ``quaternion:order=3`` (`attitude.make_algorithm`), or
        ``all``: the paper's four, Runge-Kutta, and rotation vectors of 1 to 4 increments.
    rates : sequence of float, optional, Hz
        Lower rates to try; the full rate and its halves, if not given.
    tolerance_deg : float
        Largest acceptable error, in deg.
    interpolation : {'linear', 'cubic'}
        Interpolation of the rates between stamps (`increments.increments_from_imu`).
    trials : int
        Number of seeds of a scenario, from `seed` on.
    reference : sequence of str
        Reference points in words (``end same as start``, `evaluation.reference_points`), or the
        path of a file with reference points or an attitude truth; ``rests``: gravity at every rest.
    reference_log : str or Path, optional
        Log of a second, better sensor on the same body: synchronized and aligned with this one,
        its attitude serves as the truth.
    initial : str
        ``auto``, ``truth``, ``level``, ``zero``, or ``roll,pitch,heading`` in deg. ``auto`` is
        the truth where there is one, leveled where the log begins at rest, and zero otherwise.
    gyro_bias : str
        ``none``; ``rest``, the mean over the first stationary stretch; ``rests``, interpolated
        between all of them; three numbers and a unit about forward, right, down; or the path of a
        log of the stationary sensor.
    rate : float, optional, Hz
        Sample rate of a scenario (100 if not given), or of a log without a time column.
    sampling : {'instantaneous', 'mean'}, optional
        Meaning of a row: the rate at its stamp, or its mean over the interval ending there.
    seed : int, optional
        Seed of a scenario's noise; 0 if not given.
    sensor : str or Path, optional
        For a scenario: a sensor of the catalogue, or a file like its entries.
    columns, gyro_unit, accel_unit, time_unit, axes, repair
        How to read a log, as in `formats.recording.ReadOptions`.
    from_s, to_s, duration_s : float, optional, s
        Part of the log: from an instant, to an instant, or of a duration.
    peers : sequence of str
        Filters of other libraries to compare (`peers.PEERS`), or ``all``.
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
        An option is unknown, or not available for this log.

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
    """Run attitude algorithms over a log or a scenario and compare them with the known attitude.

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
        An option is unknown, or not available for this log.
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
    """Progress of one of several equal parts."""
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
    """Run the bench on one source; return the result and the evidence for its answer."""
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
    """Reference for the errors, and the known attitude."""
    stamps = imu.index.to_numpy(dtype=np.float64)
    known = None
    if source.truth is not None and source.scored is not None:
        found = known_at(source.truth, source.scored, stamps)
        known = found if found.counts.any() else None
    clean = None if source.clean is None else source.clean.loc[imu.index]
    own = own_truth(imu, clean, known, q_nb, spec.interpolation)
    return Grounds(imu, q_nb, own, known, references, spec.interpolation)


# Conversion of the bench's arguments to a specification.


#: Meaning of ``all``: Alexiev's four, Runge-Kutta, and 1 to 4 increments.
ALL_ALGORITHMS = (
    *("naive", "euler", "dcm", "quaternion", "rk4"),
    *(f"rotvec:samples={n}" for n in (1, 2, 3, 4)),
)


def as_text(value: object) -> str:
    """Return a text unchanged, three numbers as text."""
    if isinstance(value, str | Path):
        return str(value).strip()
    return ",".join(str(v) for v in np.asarray(value).ravel().tolist())


def as_texts(values: object) -> list[str]:
    """Return one text, several or none as a list."""
    if values is None:
        return []
    if isinstance(values, str | Path):
        return [str(values)]
    return [str(v) for v in values] if isinstance(values, Iterable) else [str(values)]


def source_spec(
    text: str,
    rate: float | None,
    seed: int | None,
    reading: dict[str, Any],
    sampling: str | None,
    trials: int = 1,
    rates: Sequence[float] = (),
    sensor: str | Path | None = None,
) -> list[ScenarioSpec] | list[LogSpec]:
    """Specify a scenario, once per trial, or a log.

    Parameters
    ----------
    text : str
        Name of a scenario, or path of a log.
    rate : float or None, Hz
    seed : int or None
    reading : dict
        Options for reading a log; None where not given.
    sampling : str or None
    trials : int
        Number of seeds of a scenario.
    rates : sequence of float, Hz
        Rates to try; a scenario without a rate is sampled at the highest.
    sensor : str, Path or None
        Sensor of a scenario.

    Returns
    -------
    list of ScenarioSpec or LogSpec

    Raises
    ------
    ConfigError
        Unknown source, or an option of the other kind of source.
    """
    if trials < 1:
        raise ConfigError("attitude.no-number-trials", quantity="--trials", trials=trials)
    name = text.strip().lower()
    if not name:
        raise ConfigError("attitude.nothing-named", quantity="source")
    if name in SCENARIOS:
        if given := [key for key, value in reading.items() if value is not None]:
            raise ConfigError("attitude.scenario-not-read-file", quantity=name, given=given)
        first = 0 if seed is None else seed
        highest = max((float(r) for r in rates), default=100.0)
        return [
            specify(
                ScenarioSpec,
                name=name,
                rate_hz=highest if rate is None else rate,
                sampling=(sampling or "instantaneous").lower(),
                seed=first + k,
                sensor=None if sensor is None else str(sensor),
            )
            for k in range(trials)
        ]
    if seed is not None:
        raise ConfigError("attitude.recorded-log-no-noise-drawn", quantity="seed")
    if sensor is not None:
        raise ConfigError("attitude.recorded-log-sensor", quantity="sensor")
    if trials > 1:
        raise ConfigError("attitude.recorded-log-not-drawn-again", quantity="--trials")
    if not exists(text) and not Path(text).suffix and len(Path(text).parts) == 1:
        find_scenario(name)  # lists the valid names
    said = {key: value for key, value in reading.items() if value is not None}
    return [specify(LogSpec, path=str(Path(text)), sampling=sampling, rate_hz=rate, **said)]


def one_of_each(
    sources: Iterable[ScenarioSpec | LogSpec],
) -> list[ScenarioSpec | LogSpec]:
    """Refuse a source that is named twice: it would count as two trials.

    Raises
    ------
    ConfigError
    """
    found: list[ScenarioSpec | LogSpec] = []
    for source in sources:
        if source in found:
            name = source.name if isinstance(source, ScenarioSpec) else source.path
            raise ConfigError("attitude.named-twice-trial-does-not", file=name, quantity="source")
        found.append(source)
    return found


def exists(text: str) -> bool:
    """Whether a text is an existing path; False for sentences and invalid characters."""
    if text in ("", "none", "rest", "rests"):
        return False
    try:
        return Path(text).exists()
    except (OSError, ValueError):
        return False


def sort_references(items: Sequence[str]) -> tuple[tuple[str, ...], str | None]:
    """Separate reference sentences from the path of a truth."""
    words: list[str] = []
    truth: str | None = None
    for item in items:
        path = Path(item)
        if not exists(item):
            if " " not in item.strip() and path.suffix:
                raise ConfigError("attitude.no-such-file", file=item, quantity="reference")
            words.append(item)
        elif path.is_dir():
            raise ConfigError("attitude.folder", file=item, quantity="reference")
        elif (listed := read_reference_words(path)) is not None:
            words += listed
        elif truth is None:
            truth = str(path)
        else:
            raise ConfigError(
                "attitude.two-attitude-truths-given", quantity="reference", truth=truth, item=item
            )
    return tuple(words), truth


# Initial attitude and gyro bias of a run.


def find_gyro_bias(
    spec: AttitudeSpec, source: Source, rests: tuple[RestStretch, ...]
) -> tuple[dict[str, Any], tuple[InputFiles, ...]]:
    """Determine the gyro bias to subtract.

    Parameters
    ----------
    spec : AttitudeSpec
    source : Source
    rests : tuple of RestStretch

    Returns
    -------
    bias : dict
        ``rad_per_s`` about forward, right, down, or None; ``from``, in words.
    inputs : tuple of InputFiles
        Files from which it was taken.

    Raises
    ------
    DataError
        The log has no rest.
    ConfigError
        The option cannot be parsed.
    """
    if spec.gyro_bias_path is not None:
        options = read_options(spec.source) if isinstance(spec.source, LogSpec) else None
        other = read_log(spec.gyro_bias_path, options)
        found = find_rests(other.imu)
        if not found:
            raise DataError(
                "attitude.no-stationary-stretch-second-or", file=other.name, quantity="gyro bias"
            )
        longest = max(found, key=lambda r: r.end - r.start)
        files = input_files("gyro-bias", spec.gyro_bias_path, other.files)
        return _bias_of(longest, f"{longest.end - longest.start:.4g} s of rest in {other.name}"), (
            files,
        )
    choice = spec.gyro_bias.lower()
    if choice == "none":
        return {"rad_per_s": None, "from": "not removed: nothing was asked for"}, ()
    if choice in ("rest", "rests"):
        if not rests:
            raise DataError(
                "attitude.no-stationary-stretch-second-or-2", file=source.name, quantity="gyro bias"
            )
        if choice == "rests" and len(rests) > 1:
            course = gyro_bias_from_rests(rests)
            where = (
                f"course over {len(rests)} rests from {rests[0].start:.3f} to "
                f"{rests[-1].end:.3f} s, straight between them; shown: their average"
            )
            return {"rad_per_s": list(course.average), "from": where}, ()
        first = rests[0]
        return _bias_of(first, f"mean over the rest {first.start:.3f}–{first.end:.3f} s"), ()
    numbers, unit = _stated_bias(spec.gyro_bias)
    bias = [v * factor_of(unit, GYRO_UNITS) for v in numbers]
    return {"rad_per_s": bias, "from": f"stated: {spec.gyro_bias}"}, ()


def without_bias(
    spec: AttitudeSpec, imu: pd.DataFrame, bias: dict[str, Any], rests: tuple[RestStretch, ...]
) -> pd.DataFrame:
    """Subtract a gyro bias from the rates of a log.

    Parameters
    ----------
    spec : AttitudeSpec
    imu : DataFrame
        Imu table; it is not changed.
    bias : dict
        From `find_gyro_bias`.
    rests : tuple of RestStretch

    Returns
    -------
    DataFrame
    """
    if bias["rad_per_s"] is None:
        return imu
    if spec.gyro_bias.lower() == "rests" and len(rests) > 1:
        return without_gyro_bias(imu, gyro_bias_from_rests(rests))
    less = imu.copy()
    less[GYRO] = imu[GYRO].to_numpy() - np.asarray(bias["rad_per_s"])
    return less


def _bias_of(rest: RestStretch, where: str) -> dict[str, Any]:
    return {"rad_per_s": list(rest.gyro_mean), "from": where}


def _stated_bias(text: str) -> tuple[list[float], str]:
    match = re.fullmatch(r"([^,]+),([^,]+),\s*([+-]?[\d.]+(?:e[+-]?\d+)?)\s*(\D.*)?", text, re.I)
    try:
        if match is None:
            raise ValueError
        numbers = [float(match.group(k)) for k in (1, 2, 3)]
        if not np.isfinite(numbers).all():
            raise ValueError
    except ValueError:
        raise ConfigError("attitude.no-bias", quantity="--gyro-bias", text=text) from None
    unit = parse_unit((match.group(4) or "rad/s").strip(), "gyro")
    if unit in GYRO_SUMS:
        raise ConfigError(
            "attitude.increment-bias-rate", quantity="--gyro-bias", unit=unit, gyro_units=GYRO_UNITS
        )
    return numbers, unit


def initial_attitude(
    text: str, source: Source, rests: tuple[RestStretch, ...], findings: list[Finding]
) -> tuple[Array, dict[str, Any], float]:
    """Initial attitude of the run, its description, and the start time."""
    start = float(source.imu.index[0])
    at_rest = bool(rests) and rests[0].start - start <= 1.0 and rests[0].accel_mean is not None
    choice = text.strip().lower()
    if choice == "auto":
        choice = "truth" if source.truth is not None else "level" if at_rest else "zero"
        how = {
            "truth": "from the truth",
            "level": "levelled; heading zero, because nothing says what it is",
            "zero": "zero, because none was given and the log does not begin at rest with an "
            "accelerometer",
        }[choice]
    else:
        how = {"truth": "from the truth", "level": "levelled; heading zero", "zero": "zero"}.get(
            choice, "given"
        )
    if choice == "truth":
        q_nb, begin = _first_truth(source, start)
    elif choice == "level":
        q_nb, begin = _levelled(source, rests, at_rest, findings), start
    elif choice == "zero":
        q_nb, begin = np.array([1.0, 0.0, 0.0, 0.0]), start
    else:
        q_nb, begin = rotation.quaternion_from_euler(_three_angles(text)), start
    roll, pitch, heading = (float(a) for a in rotation.euler_from_quaternion(q_nb))
    words = {
        "roll_deg": roll,
        "pitch_deg": pitch,
        "heading_deg": heading,
        "time_s": begin,
        "from": how,
        "method": choice if choice in ("truth", "level", "zero") else "given",
    }
    return q_nb, words, begin


def _first_truth(source: Source, start: float) -> tuple[Array, float]:
    if source.truth is None:
        raise ConfigError("attitude.log-no-truth-take", file=source.name, quantity="--initial")
    stamps = source.imu.index.to_numpy(dtype=np.float64)
    # A known attitude is a valid start, even at samples that are not scored.
    known = known_at(source.truth, np.ones(len(source.truth), dtype=bool), stamps)
    good = np.flatnonzero(known.counts)
    if not good.size:
        raise ConfigError(
            "attitude.truth-nowhere-known-sample-between",
            file=source.name,
            quantity="--initial",
            stamps=stamps[0],
            stamps_2=stamps[-1],
        )
    begin = float(stamps[good[0]])
    return known.q_nb[good[0]], begin


def _levelled(
    source: Source, rests: tuple[RestStretch, ...], at_rest: bool, findings: list[Finding]
) -> Array:
    if not at_rest:
        raise ConfigError(
            "attitude.levelling-needs-accelerometer-log-begins",
            file=source.name,
            quantity="--initial",
        )
    assert rests[0].accel_mean is not None
    roll, pitch = level(rests[0].accel_mean)
    if abs(roll) > 90.0:
        findings.append(
            Finding(
                "attitude.levelled-upside-down-roll", file=source.name, quantity="accel", roll=roll
            )
        )
    return rotation.quaternion_from_euler([roll, pitch, 0.0])


def _three_angles(text: str) -> list[float]:
    try:
        angles = [float(part) for part in text.split(",")]
    except ValueError:
        angles = []
    if len(angles) != 3 or not (np.abs(angles) <= 1e6).all():
        raise ConfigError("attitude.no-attitude", quantity="--initial", text=text)
    return angles
