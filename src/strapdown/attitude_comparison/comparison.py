"""Comparison of attitude algorithms on one log or several (system A, Alexiev 2021)."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, fields, replace
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.attitude_algorithms import (
    AttitudeAlgorithm,
    AttitudeRun,
    make_algorithm,
    run_attitude,
)
from strapdown.attitude_algorithms.cost import Cost, count_cost
from strapdown.attitude_comparison.answer import (
    Answer,
    Evidence,
    find_answer,
    find_evidence,
    worst_evidence,
)
from strapdown.attitude_comparison.error_budget import ErrorBudget, find_budget, holding_time
from strapdown.attitude_comparison.options import AttitudeSpec
from strapdown.attitude_comparison.references import (
    PeerRun,
    gather_references,
    judge,
    read_second,
    run_beside,
    truth_of_second,
    truth_score,
    with_lowest_rates,
)
from strapdown.attitude_comparison.source import (
    AttitudeSource,
    axes_by_truth,
    describe,
    magnetic_north,
    on_clock,
    read_source,
    with_truth,
)
from strapdown.attitude_comparison.sweep import (
    ErrorShare,
    Grounds,
    Trials,
    between_samples,
    choose_factors,
    find_shares,
    gather,
    not_judged,
    sweep_on,
    sweep_rates,
    trial_names,
    worst_sweep,
)
from strapdown.bundle import InputFiles, Seal, check_destination, input_files
from strapdown.config.sources import LogSpec
from strapdown.errors import ConfigError, DataError, Finding, add_warning
from strapdown.evaluation.differences import known_at, largest_differences
from strapdown.evaluation.reference_points import SamePose, Score, score_references
from strapdown.formats import read_log
from strapdown.formats.recording import Reading
from strapdown.increments import increments_from_imu
from strapdown.orientation_filters import is_filter
from strapdown.progress import Progress, silent
from strapdown.sensors.rest import (
    RestStretch,
    begins_at_rest,
    could_be_a_turn,
    field_turned,
    find_rests,
    gyro_bias_from_rests,
    without_gyro_bias,
)
from strapdown.systems.inputs import part_of_log, read_options
from strapdown.tables import ACCEL, GYRO, MAG, references_table
from strapdown.tables.checks import Array, index_of, values_of
from strapdown.tables.sample_clock import SampleClock
from strapdown.units import GYRO_SUMS, GYRO_UNITS, factor_of, parse_unit

if TYPE_CHECKING:
    from strapdown.evaluation.position_references import PositionScore
    from strapdown.evaluation.second_log import SecondLog
    from strapdown.report.chart_svg import ChartFigure


#: Standard deviations from which the mean rate at rest is a bias.
BIAS_SIGNIFICANT = 3.0


@dataclass(frozen=True, repr=False)
class AttitudeComparison:
    """Comparison of attitude algorithms on one record.

    `answer` names the simplest algorithm and the lowest rate that are accurate enough; `summary`,
    `sweep`, `shares` and `costs` are the basis.

    Attributes
    ----------
    source : str
        Name of the log or the scenario.
    description : str
    specification : dict
        Everything that determines the run, as stored with the outputs.
    imu : DataFrame
        Samples as used: body axes, SI, bias removed if requested.
    runs : tuple of AttitudeRun
    truth : DataFrame or None
        Attitude table at (some of) the samples' stamps.
    scored : ndarray of bool or None
        Rows of `truth` that are scored.
    scores : tuple of Score
    sampling_error_deg : tuple of float, or None
        For a scenario: error of noise-free samples with exact arithmetic, at the end and at
        most. For a log an estimate: the difference between linear and cubic interpolation of
        the rates between their stamps; None for mean rates.
    differences_deg : DataFrame
        Largest rotation angle between each pair of algorithms.
    rests : tuple of RestStretch
    initial : dict
        Initial attitude in degrees, and its source.
    gyro_bias : dict
        Subtracted bias in rad/s, and its source.
    clock : SampleClock
        Nominal rate, gaps, lost samples and the nature of the stamps; `imu` is on this clock.
    references : DataFrame
    readings : tuple of Reading
    findings : tuple of Finding
        Warnings and notes, in words.
    inputs : tuple of InputFiles
    costs : tuple of Cost
        One per algorithm, in the order of `runs`.
    shares : tuple of ErrorShare
        Likewise.
    sweep : DataFrame
        One row per algorithm, rate and decimation method: ``algorithm``, ``meaning``
        (``drop``: samples are decimated; ``sum``: increments are summed, as in an
        integrating sensor), ``factor``, ``rate_hz``, ``own_deg`` (largest error of algorithm and
        rate, as in `ErrorShare`), ``final_deg``, ``rms_deg``, ``max_deg`` (against the truth),
        ``reference_deg`` (largest at a reference point), ``error_deg`` (the one used for the
        answer: against the truth, else at the reference points, else ``own_deg``).
    answer : Answer
    budget : ErrorBudget or None
        Parts of the sensor error of a log, against a truth.
    trials : Trials or None
    peers : tuple of PeerRun
    magnetometer : dict
        What the filters take of the field: declination, and by how much headings are less certain
        than usual, deg; ``hard_iron`` and ``soft_iron`` as of `MagnetometerCalibration`, if they
        are removed. `imu` has the readings as they are.
    places : tuple of PositionScore
        One per algorithm and position reference point.
    offers : tuple of SamePose
        Stationary intervals of similar pose, if no reference point is given.
    second : SecondLog or None
        Alignment of a second sensor's log with this one.
    on_disk : callable or None
        Of samples in memory: gives for a while the comparison whose inputs are files.
    """

    source: str
    description: str
    specification: dict[str, Any] = field(repr=False)
    imu: pd.DataFrame = field(repr=False)
    runs: tuple[AttitudeRun, ...] = field(repr=False)
    truth: pd.DataFrame | None = field(repr=False)
    scored: Any = field(repr=False)
    scores: tuple[Score, ...]
    sampling_error_deg: tuple[float, float] | None
    differences_deg: pd.DataFrame = field(repr=False)
    rests: tuple[RestStretch, ...]
    initial: dict[str, Any]
    gyro_bias: dict[str, Any]
    clock: SampleClock = field(repr=False)
    references: pd.DataFrame = field(repr=False)
    readings: tuple[Reading, ...] = field(repr=False)
    findings: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...] = field(repr=False)
    costs: tuple[Cost, ...] = field(repr=False)
    shares: tuple[ErrorShare, ...] = field(repr=False)
    sweep: pd.DataFrame = field(repr=False)
    answer: Answer
    budget: ErrorBudget | None = None
    trials: Trials | None = None
    peers: tuple[PeerRun, ...] = field(default=(), repr=False)
    magnetometer: dict[str, Any] = field(default_factory=dict, repr=False)
    places: tuple[PositionScore, ...] = field(default=(), repr=False)
    offers: tuple[SamePose, ...] = field(default=(), repr=False)
    second: SecondLog | None = field(default=None, repr=False)
    on_disk: Callable[[AttitudeComparison], AbstractContextManager[AttitudeComparison]] | None = (
        field(default=None, repr=False, compare=False)
    )

    def __repr__(self) -> str:
        return f"<AttitudeComparison {self.source}: {self.answer.sentence}>"

    @property
    def summary(self) -> pd.DataFrame:
        """One row per algorithm and comparison; angles in degrees, time in seconds."""
        columns = [f.name for f in fields(Score)]
        return pd.DataFrame([vars(score) for score in self.scores], columns=columns)

    def to_pandas(self) -> pd.DataFrame:
        """One row per algorithm and comparison, with error shares and cost.

        Returns
        -------
        DataFrame
            The columns of `summary`, then ``own_*_deg``, ``sensor_*_deg`` and ``single_*_deg``
            with ``final``, ``rms`` and ``max`` for the star, and the fields of `Cost`. Without
            a reference, one row per algorithm.
        """
        table = self.summary
        if table.empty:
            table = table.reindex(range(len(self.runs)))
            table["algorithm"] = [run.algorithm for run in self.runs]
        rows: list[dict[str, Any]] = []
        for share in self.shares:
            rows.append({"algorithm": share.algorithm})
            for part in ("own", "sensor", "single"):
                values = getattr(share, f"{part}_deg") or (nan, nan, nan)
                named = zip(("final", "rms", "max"), values, strict=True)
                rows[-1] |= {f"{part}_{moment}_deg": value for moment, value in named}
        shares = pd.DataFrame(rows)
        costs = pd.DataFrame([vars(cost) for cost in self.costs])
        table = table.merge(shares, on="algorithm", how="left")
        return table.merge(costs, on="algorithm", how="left")

    def save(
        self, out: str | Path, *, report: bool = True, force: bool = False, png: bool = False
    ) -> Seal:
        """Write the comparison as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder. Tables given in memory become input files in it.
        report : bool
            Whether to write the page and the figures as well.
        force : bool
            Overwrite an existing bundle.
        png : bool
            Write each figure as PNG as well.

        Returns
        -------
        Seal

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        from strapdown.report.attitude import write_attitude

        check_destination(Path(out), force)
        with self.on_disk(self) if self.on_disk else nullcontext(self) as there:
            return write_attitude(there, out, report=report, force=force, png=png)

    def plot(self, kind: str = "cost") -> ChartFigure:
        """Draw one chart of the report.

        Parameters
        ----------
        kind : str
            ``cost``, ``sweep``, ``gyro``, ``attitude``, ``error``, ``reference-error``,
            ``difference``, ``share``, ``trials`` or ``peers``.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist or has no data.
        """
        from strapdown.report.attitude_document import plot

        return plot(self, kind)

    def _repr_html_(self) -> str:
        """Answer and table of results, for a notebook."""
        from strapdown.report.attitude_document import short_html

        return short_html(self)


def run_comparison(spec: AttitudeSpec, progress: Progress = silent) -> AttitudeComparison:
    """Run attitude algorithms over a log or a scenario, and compare them with what is known."""
    specs = [spec.model_copy(update={"source": s, "also": ()}) for s in (spec.source, *spec.also)]

    def part(k: int) -> Progress:
        return lambda stage, share: progress(stage, (k + share) / len(specs))

    judged = [_bench(one, part(k)) for k, one in enumerate(specs)]
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
        trials=gather([b.sweep for b in benches], names),
        findings=tuple(
            f.replace(file=f.file or name)
            for b, name in zip(benches, names, strict=True)
            for f in b.findings
        )
        + not_judged([e.known for _, e in judged], names),
        inputs=tuple(item for b in benches for item in b.inputs),
    )


def _cost(algorithm: AttitudeAlgorithm, dt: pd.Series) -> Cost:
    """Operations of one sample; the kernels of a plug-in may be beyond counting."""
    try:
        return count_cost(algorithm, dt)
    except Exception as error:  # code of others can fail in every way
        if type(algorithm).__module__.startswith("strapdown."):
            raise
        raise ConfigError(
            "attitude.plugin-not-countable",
            quantity="algorithms",
            name=algorithm.name,
            home=type(algorithm).__module__,
            error=f"{type(error).__name__}: {error}",
        ) from None


def _bench(spec: AttitudeSpec, progress: Progress) -> tuple[AttitudeComparison, Evidence]:
    """Run the bench on one source; return the result and the evidence for its answer."""
    for text in spec.algorithms:
        if is_filter(text):
            raise ConfigError("attitude.filter-is-beside", quantity="algorithms", name=text)
    algorithms = [make_algorithm(text) for text in spec.algorithms]
    labels = [a.label for a in algorithms]
    if not labels:
        raise ConfigError("attitude.none-named", quantity="algorithms")
    if len(set(labels)) < len(labels):
        raise ConfigError("attitude.named-twice", quantity="algorithms", algorithms=labels)
    progress("reading", 0.0)
    source = read_source(spec)
    whole = source.imu
    part = part_of_log(whole, spec.from_s, spec.to_s, spec.duration_s, source.name)
    source, clock = on_clock(replace(source, imu=part))
    source, second = read_second(spec, with_truth(source, spec))
    stated = isinstance(spec.source, LogSpec) and spec.source.axes is not None
    if source.clean is None:
        source = axes_by_truth(source, stated)
    rests = find_rests(source.imu)
    imu, bias, bias_input = _gyro_bias(spec, source, rests)
    budget = None
    if second is None and source.clean is None:
        source, budget = _on_log_clock(spec, source, imu, clock)
    findings: list[Finding] = []
    q_nb, initial, begin = initial_attitude(spec.initial, source.imu, rests, findings, source.truth)
    imu = imu[imu.index >= begin]
    if len(imu) < 2:
        raise DataError("attitude.fewer-than-two-samples-left", file=source.name, begin=begin)
    if second is not None and source.truth is None:
        source = truth_of_second(source, second, imu, q_nb)
    if spec.gyro_bias.lower() == "auto" and bias["rad_per_s"] is not None:
        findings += _turn_or_bias(rests[0], source)
    findings = [*source.findings, *findings, *_proves_little(imu, source)]
    clock = clock.of(index_of(imu))
    increments = increments_from_imu(imu, spec.interpolation)
    costs = tuple(_cost(algorithm, increments["dt"]) for algorithm in algorithms)
    span = (float(imu.index[0]), float(imu.index[-1]))
    levelled = initial["method"] == "level"
    references, places, offers = gather_references(spec, source, span, rests, levelled, findings)
    known = None
    if source.truth is not None and source.scored is not None:
        known = known_at(source.truth, source.scored, imu.index.to_numpy(dtype=np.float64))
        known = known if known.counts.any() else None
    clean = None if source.clean is None else source.clean.loc[imu.index]
    grounds = Grounds.of(imu, q_nb, spec.interpolation, references, known, clean, clock)
    runs = []
    for k, algorithm in enumerate(algorithms):
        progress(algorithm.title, 0.05 + 0.15 * k / len(algorithms))
        runs.append(run_attitude(algorithm, increments, q_nb, grounds.restarts))
    scores = [s for run in runs for s in truth_score(run, source)]
    scores += [s for run in runs for s in score_references(run, references, imu)]
    findings += judge(runs, imu, increments, scores, source)
    if clock.gaps and known is None and len(references):
        add_warning(
            findings,
            "attitude.gap-before-reference",
            file=source.name,
            quantity="reference",
            count=len(clock.gaps),
            lost=sum(gap.length for gap in clock.gaps),
        )
    progress("sharing out the error", 0.2)
    shares = find_shares(algorithms, runs, grounds)
    factors = choose_factors(clock, spec.rates_hz, findings)
    sweep = sweep_rates(
        algorithms, grounds, factors, lambda stage, share: progress(stage, 0.3 + 0.65 * share)
    )
    between = source.sampling_error_deg or between_samples(grounds)
    if not spec.rates_hz:
        sweep = sweep_on(sweep, algorithms, grounds, spec.tolerance_deg)
    of_field, north, iron, field_input = _of_field(spec, source, imu, findings)
    beside = run_beside(spec.peers, source, of_field, q_nb, references, findings, north)
    tried = sorted(set(sweep["factor"].tolist()))
    beside = tuple(
        with_lowest_rates(run, of_field, grounds, tried, spec.tolerance_deg) for run in beside
    )
    evidence = replace(
        find_evidence(
            grounds, algorithms, costs, sweep, bias, rests, None if between is None else between[1]
        ),
        budget=budget,
        holding=holding_time(grounds, spec.tolerance_deg),
        filters=tuple(run for run in beside if run.cost is not None and run.scores),
    )
    positions: tuple[PositionScore, ...] = ()
    if places:
        from strapdown.evaluation.position_references import score_places

        positions = tuple(p for run in runs for p in score_places(run, places, imu, rests))
    truth, scored = source.truth, source.scored
    if truth is not None and scored is not None:
        inside = np.asarray((truth.index >= span[0]) & (truth.index <= span[1]))
        truth, scored = truth[inside], scored[inside]
    bench = AttitudeComparison(
        source=source.name,
        description=describe(source.imu, source.what, whole, clock),
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
        magnetometer={"declination_deg": north[0], "heading_sd_deg": north[1], **iron},
        clock=clock,
        budget=budget,
        references=references,
        readings=source.readings,
        findings=tuple(findings),
        inputs=source.inputs + bias_input + field_input,
        costs=costs,
        shares=shares,
        sweep=sweep,
        answer=find_answer(evidence, spec.tolerance_deg),
        places=positions,
        peers=beside,
        offers=offers,
        second=second,
    )
    return bench, evidence


def _on_log_clock(
    spec: AttitudeSpec, source: AttitudeSource, imu: pd.DataFrame, clock: SampleClock
) -> tuple[AttitudeSource, ErrorBudget | None]:
    """Split the sensor's error, and move the truth to the log's clock where the two differ."""
    truth, scored = source.truth, source.scored
    if truth is None or scored is None:
        return source, None
    stamps = index_of(imu)
    known = known_at(truth, scored, stamps)
    if not known.counts.any():
        return source, None
    first = int(np.argmax(known.counts))
    imu, clock = imu.iloc[first:], clock.of(stamps[first:])
    known = known.at(np.arange(first, len(stamps)))
    none = references_table([])
    grounds = Grounds.of(imu, known.q_nb[0], spec.interpolation, none, known, None, clock)
    budget = find_budget(grounds, truth, scored)
    if budget is None or not budget.clock_counts or spec.reference_clock == "stated":
        return source, budget
    as_means = imu.attrs["sampling"] != "mean" and budget.late_as_means(clock.step)
    finding = Finding(
        "attitude.reference-clock-as-of-means" if as_means else "attitude.reference-clock-differs",
        file=source.name,
        quantity="time",
        severity="note",
        delay_ms=1e3 * budget.delay_s,
        delay_sd_ms=1e3 * budget.delay_sd,
        steps=budget.delay_s / clock.step,
        drift_ppm=budget.drift_ppm,
        share_deg=float(budget.parts["share_deg"].iloc[1]),
    )
    moved = budget.on_log_clock(truth)
    return replace(source, truth=moved, findings=(*source.findings, finding)), budget


# Initial attitude and gyro bias of a run.


def _gyro_bias(
    spec: AttitudeSpec, source: AttitudeSource, rests: tuple[RestStretch, ...]
) -> tuple[pd.DataFrame, dict[str, Any], tuple[InputFiles, ...]]:
    """The samples without the gyro bias, the bias as `AttitudeComparison.gyro_bias`, its files."""
    imu = source.imu
    files: tuple[InputFiles, ...] = ()
    bias: Sequence[float]
    choice = spec.gyro_bias.lower()
    if choice == "auto":
        choice = "nothing"
        if rests:
            # Whether the mean of the rest differs from zero by more than chance.
            scatter = np.asarray(rests[0].gyro_mean_sd or rests[0].gyro_sd)
            if (np.abs(rests[0].gyro_mean) > BIAS_SIGNIFICANT * scatter).any():
                choice = "rest"
        if choice == "rest" and field_turned(imu, rests[0]):
            choice = "turned"
    if spec.gyro_bias_path is not None:
        log = spec.source
        options = read_options(log, source.axes) if isinstance(log, LogSpec) else None
        other = read_log(spec.gyro_bias_path, options)
        found = find_rests(other.imu)
        if not found:
            raise DataError(
                "attitude.no-stationary-stretch-second-or", file=other.name, quantity="gyro bias"
            )
        longest = max(found, key=lambda r: r.end - r.start)
        files = (input_files("gyro-bias", spec.gyro_bias_path, other.files),)
        where = f"{longest.end - longest.start:.4g} s of rest in {other.name}"
        bias = longest.gyro_mean
    elif choice in ("none", "nothing", "turned"):
        why = "not removed, not requested"
        if choice == "turned":
            why = "not removed: the magnetic field turns in what looks like a rest"
        elif choice == "nothing":
            noise = "that of the rest is within its noise"
            why = f"not removed: {noise if rests else 'no rest shows it'}"
        return imu, {"rad_per_s": None, "from": why}, ()
    elif choice in ("rest", "rests"):
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
            less = without_gyro_bias(imu, course)
            return less, {"rad_per_s": list(course.average), "from": where}, ()
        first = rests[0]
        bias, where = first.gyro_mean, f"mean over the rest {first.start:.3f}–{first.end:.3f} s"
    else:
        numbers, unit = _stated_bias(spec.gyro_bias)
        factor = factor_of(unit, GYRO_UNITS)
        bias, where = [v * factor for v in numbers], f"stated: {spec.gyro_bias}"
    less = imu.copy()
    less[GYRO] = imu[GYRO].to_numpy() - np.asarray(bias)
    return less, {"rad_per_s": list(bias), "from": where}, files


def _of_field(
    spec: AttitudeSpec, source: AttitudeSource, imu: pd.DataFrame, findings: list[Finding]
) -> tuple[pd.DataFrame, tuple[float, float], dict[str, Any], tuple[InputFiles, ...]]:
    """Samples with the magnetometer calibrated, declination and its sd in deg, iron, its files."""
    declination, sd, files = 0.0, 0.0, tuple[InputFiles, ...]()
    iron: dict[str, Any] = {}
    if not set(MAG + ACCEL) <= set(imu.columns):
        if spec.place is not None or spec.magnetometer != "auto":
            asked = "--magnetometer, --lat"
            findings.append(Finding("attitude.no-field-here", file=source.name, quantity=asked))
        return imu, (declination, sd), iron, files
    from strapdown.sensors.magnetometer import calibrate_magnetometer, without_iron

    if spec.place is not None:
        declination, sd, said = magnetic_north(spec.place, source.imu)
        findings += said
    given = None
    if spec.magnetometer_path is not None:
        log = spec.source
        options = read_options(log, source.axes) if isinstance(log, LogSpec) else None
        other = read_log(spec.magnetometer_path, options)
        if not set(MAG) <= set(other.imu.columns):
            raise DataError(
                "attitude.no-magnetometer-in-log", file=other.name, quantity="--magnetometer"
            )
        given = calibrate_magnetometer(values_of(other.imu, MAG))
        files = (input_files("magnetometer", spec.magnetometer_path, other.files),)
    if spec.magnetometer != "raw":
        imu, used, of_iron, said = without_iron(imu, given)
        findings += said
        sd = float(np.hypot(sd, of_iron))
        if used is not None:
            iron = {"hard_iron": used.hard_iron.tolist(), "soft_iron": used.soft_iron.tolist()}
    return imu, (declination, sd), iron, files


def _turn_or_bias(rest: RestStretch, source: AttitudeSource) -> list[Finding]:
    """Doubt whether a rest is one, where no magnetometer distinguishes it from a steady turn."""
    if set(MAG) <= set(source.imu.columns) or not could_be_a_turn(rest):
        return []
    size, code = float(np.degrees(np.linalg.norm(rest.gyro_mean))), "attitude.bias-or-turn"
    data = {"bias": size, "duration": rest.end - rest.start}
    return [Finding(code, file=source.name, quantity="gyro", data=data)]


#: Rates across the main axis of a motion, as a share of those along it, below which the other two
#: axes do not matter; rate in rad/s below which a body does not turn.
ACROSS, TURNING = 0.05, 0.05


def _proves_little(imu: pd.DataFrame, source: AttitudeSource) -> list[Finding]:
    """Warn of a recorded motion that any algorithm integrates: about one axis, or hardly any."""
    if source.clean is not None:
        return []
    rates = values_of(imu, GYRO)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(rates.T @ rates / len(rates)), 0.0))
    name, about = source.name, "gyro"
    if spread[2] < TURNING:
        rate = float(np.degrees(spread[2]))
        return [Finding("attitude.hardly-turns", file=name, quantity=about, rate=rate)]
    if spread[1] >= ACROSS * spread[2]:
        return []
    across = float(spread[1] / spread[2])
    return [Finding("attitude.one-axis", file=name, quantity=about, across=across)]


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
    text: str,
    imu: pd.DataFrame,
    rests: tuple[RestStretch, ...],
    findings: list[Finding],
    truth: pd.DataFrame | None = None,
) -> tuple[Array, dict[str, Any], float]:
    """Initial attitude ``q_nb`` of a run, its description, and the start time in s."""
    name = imu.attrs.get("source")
    stamps = imu.index.to_numpy(dtype=np.float64)
    begin = float(stamps[0])
    first = begins_at_rest(rests, begin)
    at_rest = first is not None and first.accel_mean is not None
    choice = text.strip().lower()
    how = {"truth": "from the truth", "level": "levelled; heading zero", "zero": "zero"}
    if choice == "auto":
        choice = "truth" if truth is not None else "level" if at_rest else "zero"
        how["level"] += ": it is not stated"
        how["zero"] += (
            ", because none was given and the log does not begin at rest with an accelerometer"
        )
    if choice == "truth":
        if truth is None:
            raise ConfigError("attitude.log-no-truth-take", file=name, quantity="--initial")
        # A known attitude is a valid start, even at samples that are not scored.
        known = known_at(truth, np.ones(len(truth), dtype=bool), stamps)
        good = np.flatnonzero(known.counts)
        if not good.size:
            raise ConfigError(
                "attitude.truth-nowhere-known-sample-between",
                file=name,
                quantity="--initial",
                stamps=stamps[0],
                stamps_2=stamps[-1],
            )
        q_nb, begin = known.q_nb[good[0]], float(stamps[good[0]])
    elif choice == "level":
        if first is None or first.accel_mean is None:
            raise ConfigError(
                "attitude.levelling-needs-accelerometer-log-begins",
                file=name,
                quantity="--initial",
            )
        tilt = rotation.level(first.accel_mean)
        if abs(tilt[0]) > 90.0:
            code = "attitude.levelled-upside-down-roll"
            findings.append(Finding(code, file=name, quantity="accel", roll=tilt[0]))
        q_nb = rotation.quaternion_from_euler([*tilt, 0.0])
    elif choice == "zero":
        q_nb = np.array([1.0, 0.0, 0.0, 0.0])
        later = next((one for one in rests if one.accel_mean is not None), None)
        if text.strip().lower() == "auto" and later is not None:
            at = float(np.ceil(100.0 * later.start) / 100.0)
            code = "attitude.rest-after-begin"
            findings.append(Finding(code, file=name, quantity="initial", begin=at))
    else:
        try:
            angles = [float(part) for part in text.split(",")]
        except ValueError:
            angles = []
        if len(angles) != 3 or not (np.abs(angles) <= 1e6).all():
            raise ConfigError("attitude.no-attitude", quantity="--initial", text=text)
        q_nb = rotation.quaternion_from_euler(angles)
    roll, pitch, heading = (float(a) for a in rotation.euler_from_quaternion(q_nb))
    words = {
        "roll_deg": roll,
        "pitch_deg": pitch,
        "heading_deg": heading,
        "time_s": begin,
        "from": how.get(choice, "given"),
        "method": choice if choice in how else "given",
    }
    return q_nb, words, begin
