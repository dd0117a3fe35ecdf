"""Answer of a comparison: simplest algorithm and lowest rate of sufficient accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
import pandas as pd

from strapdown.attitude_algorithms import AttitudeAlgorithm, RotationVector
from strapdown.attitude_algorithms.cost import Cost
from strapdown.attitude_comparison.error_budget import ErrorBudget, Holding
from strapdown.attitude_comparison.references import PeerRun
from strapdown.attitude_comparison.sweep import (
    MOST_ACCURATE,
    Grounds,
    error_at_full_rate,
)
from strapdown.evaluation.differences import Errors
from strapdown.rotation import unit_rotation_angle
from strapdown.sensors.rest import RestStretch
from strapdown.tables import GYRO

# Where the sensor error exceeds the tolerance, an algorithm error below this share is
# negligible.
UNSEEN = 0.1
# A recommendation must reduce the error at least to this share.
WORTH = 0.9
# Largest ratio for an extrapolation by the order of accuracy.
MOST_EXTRAPOLATED = 10.0


# Attitude error beyond which its magnitude has no meaning: angles end at half a turn.
LOST = 90.0

HOW_TO_REFERENCE = (
    "Give a known attitude: "
    "--reference 'end same as start' (returned to its initial attitude), "
    "--reference 'end 2 turns about z since start', "
    "--reference '12.5 roll 0 pitch 0 heading 90', or --reference TRUTH.csv."
)


@dataclass(frozen=True)
class Answer:
    """The simplest algorithm, and the lowest rate, that are accurate enough.

    Attributes
    ----------
    verdict : str
        ``enough``: one is found; ``sensor``: none, because of the sensor; ``rate``: none,
        because of the rate; ``own``: the attitude has no reference, and the algorithm error
        was judged.
    sentence : str
        The answer as text.
    tolerance_deg : float
    algorithm, meaning : str or None
        The rate is that of samples averaged by the sensor (``sum``).
    rate_hz : float or None
    dropped_hz : float or None
        Rate that the same algorithm needs where samples are left out instead.
    holding : Holding or None
        For how long integration alone stays within the tolerance, where a truth is known.
    why, helps : tuple of str
        Reasons, and possible remedies.
    """

    verdict: str
    sentence: str
    tolerance_deg: float
    algorithm: str | None
    meaning: str | None
    rate_hz: float | None
    why: tuple[str, ...]
    helps: tuple[str, ...]
    dropped_hz: float | None = None
    holding: Holding | None = None


@dataclass(frozen=True)
class Evidence:
    """Evidence for the answer.

    Attributes
    ----------
    costs : sequence of Cost
        In the same order.
    sweep : DataFrame
        As `AttitudeComparison.sweep`.
    sensor : tuple of float or None
        Error of the sensor alone, deg, where it is known.
    known : bool
        Whether a truth or a reference point of the attitude is known.
    exact : bool
        Whether the algorithm errors are against exact truth.
    without_bias : float or None
        Remaining error in deg if the bias of a rest were removed, where it was not.
    with_cubic : float or None
        Remaining error in deg with cubic interpolation of the rates, where it was linear.
    start : float
        Initial attitude error, deg, where it is known.
    sampling : float
        Possible effect of the rate between its stamps, deg, for a log.
    reference_sd : float
        Standard deviation of the best reference point, deg; 0 where there is a truth, or it is
        not stated.
    budget : ErrorBudget or None
        Parts of the sensor error.
    holding : Holding or None
    filters : tuple of PeerRun
        The project's orientation filters on the same log, judged by a truth.
    """

    algorithms: Sequence[AttitudeAlgorithm]
    costs: Sequence[Cost]
    sweep: pd.DataFrame
    sensor: Errors | None
    known: bool
    exact: bool
    without_bias: float | None
    with_cubic: float | None
    start: float = 0.0
    sampling: float = 0.0
    reference_sd: float = 0.0
    budget: ErrorBudget | None = None
    holding: Holding | None = None
    filters: tuple[PeerRun, ...] = ()


@dataclass(frozen=True)
class Choice:
    """Algorithm, and the lowest rate at which it passes, as it does at every higher rate."""

    cost: Cost
    meaning: str
    rate_hz: float
    error_deg: float


def find_answer(evidence: Evidence, tolerance_deg: float) -> Answer:
    """Choose the algorithm of fewest cycles, and the lowest rate at which its largest error passes.

    If none passes, the sentence states whether the sensor or the rate is the limit.
    """
    if passing := choices(evidence, "error_deg", tolerance_deg):
        answer = _enough(evidence, passing, tolerance_deg)
    else:
        full = evidence.sweep[evidence.sweep["factor"] == 1]
        # By algorithm error: a poor algorithm may end nearer to the truth by chance.
        best = full.iloc[int(full["own_deg"].to_numpy().argmin())]
        sensor = _sensor_error(evidence, best)
        limited = _limited_by_sensor if sensor > tolerance_deg else _limited_by_rate
        answer = limited(evidence, best, sensor, tolerance_deg)
    return answer if evidence.known else replace(answer, helps=(HOW_TO_REFERENCE, *answer.helps))


def choices(evidence: Evidence, column: str, limit: float, meaning: str = "sum") -> list[Choice]:
    """Every algorithm whose `column` of the sweep passes, with its lowest rate; simplest first.

    A sensor of a lower rate averages over its samples (``sum``); a program that reads one sample in
    several leaves the rest out (``drop``).
    """
    part = evidence.sweep[evidence.sweep["meaning"] == meaning].sort_values("factor")
    columns = (part[name].tolist() for name in ("algorithm", "rate_hz", column, "own_deg"))
    cells = list(zip(*columns, strict=True))
    found = []
    for cost in evidence.costs:
        own = (cell[1:] for cell in cells if cell[0] == cost.algorithm)
        # With an algorithm error above the total error it passes by chance, and so does a lower
        # rate where a higher one fails.
        if passing := list(takewhile(lambda cell: np.fmax(*cell[1:]) <= limit, own)):
            rate, error, _ = passing[-1]
            found.append(Choice(cost, meaning, float(rate), float(error)))
    return sorted(found, key=lambda c: c.cost.cycles)


def _enough(evidence: Evidence, passing: list[Choice], tolerance: float) -> Answer:
    chosen = passing[0]
    judged = "error" if evidence.known else "own error"
    sentence = (
        f"{_named(evidence, chosen)} is the simplest that stays within "
        f"{tolerance:g}°: its largest {judged} is {_deg(chosen.error_deg)}."
    )
    why, dropped_hz = _why_this_rate(evidence, chosen, "error_deg", tolerance)
    thrifty = min(passing, key=lambda c: c.cost.cycles * c.rate_hz)
    if thrifty.cost.algorithm != chosen.cost.algorithm:
        few, many = (c.cost.cycles * c.rate_hz / 1e3 for c in (thrifty, chosen))
        unit = "thousand cycles of a Cortex-M4F a second"
        why.append(
            f"Fewest operations a second: {thrifty.cost.algorithm} at {thrifty.rate_hz:.4g} Hz, "
            f"{few:.3g} {unit} against {many:.3g} {unit}."
        )
    sweep = evidence.sweep
    for cost in evidence.costs:
        if cost.cycles < chosen.cost.cycles:
            of_cost = (sweep["algorithm"] == cost.algorithm) & (sweep["meaning"] == "drop")
            full = sweep[of_cost & (sweep["factor"] == 1)].iloc[0]
            off = max(float(full["error_deg"]), float(full["own_deg"]))
            why.append(
                f"{cost.algorithm} is simpler, and {_deg(off)} off at "
                f"{float(full['rate_hz']):.4g} Hz already."
            )
    if (enough := _filter_enough(evidence, tolerance)) is not None:
        why.append(enough)
    if not evidence.known:
        why.append(
            "Nothing is known of the attitude here, so that this judges the algorithm and the "
            "rate, and not the sensor."
        )
    if evidence.sampling > UNSEEN * tolerance:
        why.append(
            "How the rate runs between its stamps is not known; it may matter by up to "
            f"{_deg(evidence.sampling)}, which is in no figure here."
        )
    return Answer(
        "enough" if evidence.known else "own",
        sentence,
        tolerance,
        *(chosen.cost.algorithm, chosen.meaning, chosen.rate_hz),
        why=tuple(why),
        helps=(),
        dropped_hz=dropped_hz,
        holding=evidence.holding,
    )


def _why_this_rate(
    evidence: Evidence, chosen: Choice, column: str, limit: float
) -> tuple[list[str], float | None]:
    """Say why no lower rate passes, and which rate does by leaving samples out, also in Hz."""
    cells = evidence.sweep[
        (evidence.sweep["algorithm"] == chosen.cost.algorithm)
        & (evidence.sweep["meaning"] == chosen.meaning)
        & (evidence.sweep["rate_hz"] < chosen.rate_hz)
    ].sort_values("rate_hz", ascending=False)
    if cells.empty:
        why = [f"{chosen.rate_hz:.4g} Hz is the lowest rate that was tried."]
    else:
        lower = cells.iloc[0]
        error, rate = max(float(lower[column]), float(lower["own_deg"])), float(lower["rate_hz"])
        off = f"would be {_deg(error)}, beyond {_deg(limit)}" if np.isfinite(error) else "runs away"
        why = [f"At {rate:.4g} Hz it {off}."]
    passing = choices(evidence, column, limit, "drop")
    dropped = next((c for c in passing if c.cost.algorithm == chosen.cost.algorithm), None)
    if dropped is None:
        return why, None
    if dropped.rate_hz > chosen.rate_hz:
        why.append(
            "A program that leaves samples out, instead of a sensor that averages them, needs "
            f"{dropped.rate_hz:.4g} Hz ({_deg(dropped.error_deg)})."
        )
    return why, dropped.rate_hz


def _limited_by_sensor(
    evidence: Evidence, best: pd.Series, sensor: float, tolerance: float
) -> Answer:
    limit = min(tolerance, UNSEEN * sensor)
    good = choices(evidence, "own_deg", limit)
    of_truth = evidence.sensor is not None and sensor <= evidence.sensor[2]
    off_at_start = evidence.start > UNSEEN * sensor
    if off_at_start:
        whose = f"sensor and start make {_deg(sensor)}, and the start is {_deg(evidence.start)} off"
    elif of_truth and evidence.exact:
        whose = f"the sensor alone makes {_deg(sensor)}"
    elif of_truth:
        whose = f"the sensor makes {_deg(sensor)}, by the most accurate algorithm"
    elif evidence.reference_sd > tolerance:
        whose = (
            f"the reference points are themselves known to {_deg(evidence.reference_sd)} (1σ) "
            f"only, and the most accurate algorithm is {_deg(sensor)} from them"
        )
    else:
        whose = (
            f"by the most accurate algorithm, too, sensor and reference points are {_deg(sensor)} "
            "apart"
        )
    sentence = f"No algorithm stays within {tolerance:g}°, and none could: {whose}."
    algorithm = meaning = rate = dropped_hz = None
    if (holding := evidence.holding) is not None:
        sentence += f" From a known attitude, integration alone holds {tolerance:g}° for "
        if holding.ends:
            over = "" if holding.median_ends else "more than "
            sentence += (
                f"{holding.shortest_s:.3g} s at least, and from half of the instants for "
                f"{over}{holding.median_s:.3g} s."
            )
        else:
            sentence += f"as long as the reference covers: {holding.shortest_s:.3g} s."
    why = [
        f"The most accurate algorithm here, {best['algorithm']} at {float(best['rate_hz']):.4g} "
        f"Hz, is {_deg(float(best['error_deg']))} off; its own part is "
        f"{_deg(float(best['own_deg']))}."
    ]
    if good:
        chosen = good[0]
        algorithm, meaning, rate = chosen.cost.algorithm, chosen.meaning, chosen.rate_hz
        sentence += (
            f" {_named(evidence, chosen)} is all that integration needs: "
            f"its own error, {_deg(chosen.error_deg)}, is small beside that."
        )
        if (enough := _filter_enough(evidence, tolerance)) is not None:
            sentence += f" {enough}"
        of_rate, dropped_hz = _why_this_rate(evidence, chosen, "own_deg", limit)
        why += of_rate
    why += _of_budget(evidence)
    helps = []
    if off_at_start:
        helps.append("Another attitude at the start: --initial says where it comes from.")
    bias_helps = WORTH * float(best["error_deg"])
    if evidence.without_bias is not None and evidence.without_bias < bias_helps:
        helps.append(
            "Remove the gyro's bias: with that of the first rest taken off (--gyro-bias rest) "
            f"{_deg(evidence.without_bias)} would be left."
        )
    helps += _improvements(evidence, sensor)
    if evidence.reference_sd > tolerance:
        helps.append("Better reference points: a truth, or a pose that is known to be the same.")
    elif sensor > LOST:
        helps.append(
            "A gyro with far smaller errors, or far less time between reference points: the "
            "attitude is lost."
        )
    else:
        helps.append(
            f"A gyro whose errors are {_two_digits(sensor / tolerance)} times smaller, or that "
            "much less time between reference points."
        )
    helps += _of_filters(evidence) or [
        "Aiding: an accelerometer holds roll and pitch, a magnetometer the heading.",
    ]
    return Answer(
        *("sensor", sentence, tolerance, algorithm, meaning, rate, tuple(why), tuple(helps)),
        dropped_hz,
        evidence.holding,
    )


#: Sensors that a filter uses beside the gyro.
_AIDS = {
    "gyro+accel": "the accelerometer",
    "gyro+accel+mag": "the accelerometer and the magnetometer",
}


def _filter_enough(evidence: Evidence, tolerance: float) -> str | None:
    """Say which filter suffices: the cheapest within the tolerance, or in roll and pitch."""
    if whole := [run for run in evidence.filters if _largest(run) <= tolerance]:
        run = min(whole, key=_thrift)
        rate = "" if run.lowest_hz is None else f" down to {run.lowest_hz:.4g} Hz"
        return (
            f"With {_AIDS[run.aiding]} the filter {run.peer} stays within {tolerance:g}°{rate}: "
            f"at the log's own rate its largest error is {_deg(_largest(run))}."
        )
    level = [
        (run, run.errors.most_inclination_deg)
        for run in evidence.filters
        if run.errors is not None and run.errors.most_inclination_deg <= tolerance
    ]
    if not level:
        return None
    run, most = min(level, key=lambda pair: _thrift(pair[0]))
    level_hz = run.lowest_level_hz
    lowest = "" if level_hz is None else f" (within {tolerance:g}° down to {level_hz:.4g} Hz)"
    return (
        f"With {_AIDS[run.aiding]} the filter {run.peer} keeps roll and pitch within "
        f"{_deg(most)}{lowest}{_heading_words(run)}."
    )


def _thrift(run: PeerRun) -> tuple[str, float]:
    """Order of filters: fewest sensors, then fewest operations."""
    return run.aiding, run.cost.cycles if run.cost else np.inf


def _heading_words(run: PeerRun) -> str:
    assert run.errors is not None
    if run.aiding == "gyro+accel":
        return f", and the heading drifts by {_deg(run.errors.drift_deg_per_min)} a minute"
    return f", and the heading to {_deg(run.errors.heading_deg)} (root mean square)"


def _of_filters(evidence: Evidence) -> list[str]:
    """Say what the best orientation filter of each aiding reaches on this log."""
    lines = []
    for aiding, words in _AIDS.items():
        runs = [r for r in evidence.filters if r.aiding == aiding and r.errors is not None]
        if not runs:
            continue
        best = min(runs, key=_largest)
        assert best.errors is not None
        lines.append(
            f"With {words}, {best.peer}: {_deg(_largest(best))} at most; roll and pitch within "
            f"{_deg(best.errors.most_inclination_deg)}{_heading_words(best)}."
        )
    return lines


def _largest(run: PeerRun) -> float:
    found = [s.error_deg if s.max_deg is None else s.max_deg for s in run.scores]
    return max(found) if found else np.inf


#: What removes a part of the sensor error.
_REMEDY = {
    "bias": "The gyro's bias of this record, instead of that of the rest",
    "scale and axes": "Calibrated scale factors and axes of the gyro",
}


def _of_budget(evidence: Evidence) -> list[str]:
    """Say which parts of the sensor error the truth shows, and what each leaves."""
    budget = evidence.budget
    if budget is None or len(budget.parts) < 2:
        return []
    size = np.degrees(np.sqrt(budget.bias @ budget.bias))
    when = "late" if budget.delay_s > 0 else "early"
    clock = f"stamps {abs(1e3 * budget.delay_s):.3g} ± {1e3 * budget.delay_sd:.2g} ms {when}"
    if abs(budget.drift_ppm) > 3.0 * budget.drift_sd_ppm:
        clock += f" and drifting by {budget.drift_ppm:.3g} ppm"
    words = {
        "bias": f"a bias of {size:.2g} deg/s beside that of the rest",
        "clock": clock,
        "scale and axes": "scale factors and axes",
    }
    found = [
        f"{words[row['part']]}: {_deg(row['share_deg'])} ({_deg(row['max_deg'])} left)"
        for row in budget.parts.to_dict("records")[1:]
    ]
    return [
        "Parts of the sensor's error by the reference, removed one after the other: "
        f"{'; '.join(found)}."
    ]


def _improvements(evidence: Evidence, sensor: float) -> list[str]:
    """Name the part whose removal helps, the cheapest first."""
    found, budget = [], evidence.budget
    order = [] if budget is None else budget.parts["part"].tolist()
    for part, remedy in _REMEDY.items():
        if budget is None or part not in order:
            continue
        before, left = budget.parts["max_deg"].to_numpy()[order.index(part) - 1 :][:2].tolist()
        if left < WORTH * before and before - left > UNSEEN * sensor:
            found.append(f"{remedy}: {_deg(left)} instead of {_deg(before)}.")
    return found


def _limited_by_rate(
    evidence: Evidence, best: pd.Series, sensor: float, tolerance: float
) -> Answer:
    error, rate = float(best["error_deg"]), float(best["rate_hz"])
    sentence = (
        f"No algorithm stays within {tolerance:g}° at {rate:.4g} Hz: the best, "
        f"{best['algorithm']}, is {_deg(error)} off, and the rate is the limit."
    )
    order = next(a.accuracy.rates for a in evidence.algorithms if a.label == str(best["algorithm"]))
    helps = []
    if evidence.with_cubic is not None and evidence.with_cubic < 0.5 * error:
        helps.append(
            "Rates that run as cubics between their stamps (--interpolation cubic): "
            f"{_deg(evidence.with_cubic)} would be left."
        )
    own = float(best["own_deg"])
    # The sensor error remains at any rate.
    left = tolerance - sensor
    if order and np.isfinite(own) and own <= MOST_EXTRAPOLATED**order * left:
        # With rates integrated by the trapezoid rule, no algorithm exceeds second order.
        order = order if evidence.with_cubic is None else min(order, 2)
        needed = rate * max(1.0, own / left) ** (1.0 / order)
        helps.append(
            f"A higher rate: on smooth motion about {_two_digits(needed)} Hz, by its order of "
            "accuracy."
        )
    helps.append("A sensor that integrates between samples, or a tolerance that is wider.")
    return Answer("rate", sentence, tolerance, None, None, None, (), tuple(helps))


def _sensor_error(evidence: Evidence, best: pd.Series) -> float:
    """Sensor error: against the truth, and the total less the algorithm error.

    A reference point may have a larger error than the truth, where there are both.
    """
    if not evidence.known:
        return 0.0
    of_truth = 0.0 if evidence.sensor is None else evidence.sensor[2]
    judged = best["error_deg"] if evidence.sensor is None else best["reference_deg"]
    return max(of_truth, float(np.nan_to_num(judged - best["own_deg"])))


def _named(evidence: Evidence, choice: Choice) -> str:
    """Say which algorithm, at which rate, and how that is made from the log's own."""
    title = next(a.title for a in evidence.algorithms if a.label == choice.cost.algorithm)
    full = choice.rate_hz >= float(evidence.sweep["rate_hz"].max())
    how = "at" if full else "with samples averaged to"
    return f"{title} ({choice.cost.algorithm}) {how} {choice.rate_hz:.4g} Hz"


def _two_digits(value: float) -> str:
    digits = 1 - int(np.floor(np.log10(value)))
    return f"{round(value, digits):.10g}"


def _deg(angle: float) -> str:
    if not np.isfinite(angle):
        return "without bound"
    if angle < 5e-7:
        return "under 1e-6°"
    return f"{angle:.3g}°"


# Evidence for the answer of a bench: of one source, and the worst of several.


def find_evidence(
    grounds: Grounds,
    algorithms: Sequence[AttitudeAlgorithm],
    costs: Sequence[Cost],
    sweep: pd.DataFrame,
    bias: dict[str, object],
    rests: tuple[RestStretch, ...],
    between_deg: float | None,
) -> Evidence:
    """Gather the evidence for one source; `between_deg`: possible effect between the stamps."""
    imu, truth, references = grounds.imu, grounds.truth, grounds.references
    without_bias = with_cubic = None
    if grounds.known and rests and bias["rad_per_s"] is None:
        less = imu.copy()
        less[GYRO] = imu[GYRO].to_numpy() - np.asarray(rests[0].gyro_mean)
        without_bias = error_at_full_rate(MOST_ACCURATE, replace(grounds, imu=less))
    linear = grounds.interpolation != "cubic" and imu.attrs["sampling"] != "mean"
    if grounds.known and linear:
        cubic = replace(grounds, interpolation="cubic")
        with_cubic = error_at_full_rate(RotationVector(samples=1), cubic)
    start = reference_sd = 0.0
    if truth is not None and truth.counts[0]:
        start = float(unit_rotation_angle(grounds.q_nb[None], truth.q_nb[:1])[0])
    if truth is None and len(references):
        sd = references["sd"].to_numpy(dtype=np.float64)
        reference_sd = float(np.nan_to_num(sd).min())
    return Evidence(
        algorithms=algorithms,
        costs=costs,
        sweep=sweep,
        sensor=grounds.sensor_errors(),
        known=grounds.known,
        exact=grounds.exact,
        without_bias=without_bias,
        with_cubic=with_cubic,
        start=start,
        sampling=0.0 if grounds.exact or between_deg is None else between_deg,
        reference_sd=reference_sd,
    )


def worst_evidence(evidence: Sequence[Evidence], sweep: pd.DataFrame) -> Evidence:
    """Gather the evidence for several trials: the worst case."""
    sensors = [e.sensor for e in evidence if e.sensor is not None]
    return replace(
        evidence[0],
        sweep=sweep,
        sensor=max(sensors, key=lambda e: e[2]) if sensors else None,
        known=any(e.known for e in evidence),
        exact=all(e.exact for e in evidence),
        without_bias=_worst([e.without_bias for e in evidence]),
        with_cubic=_worst([e.with_cubic for e in evidence]),
        start=max(e.start for e in evidence),
        sampling=max(e.sampling for e in evidence),
        reference_sd=max(e.reference_sd for e in evidence),
        budget=None,
        filters=(),
        holding=min(
            (e.holding for e in evidence if e.holding is not None),
            key=lambda h: (not h.ends, h.shortest_s),
            default=None,
        ),
    )


def _worst(errors: Sequence[float | None]) -> float | None:
    """The largest value, if all are known."""
    known = [e for e in errors if e is not None]
    return max(known) if len(known) == len(errors) else None
