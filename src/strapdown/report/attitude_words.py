"""Results of the attitude bench in words and numbers, for terminal, page and JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.attitude_algorithms import ALGORITHMS
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun, passed_pole
from strapdown.evaluation.reference_points import Score, in_words
from strapdown.formats.recording import Reading

if TYPE_CHECKING:
    from strapdown.evaluation.second_log import SecondLog

CONVENTIONS = (
    ("Body axes", "x forward, y right, z down"),
    ("Local level", "north, east, down; without a north reference, the initial heading"),
    ("Attitude", "q_nb and C_nb turn a vector from body axes to local level; scalar first"),
    (
        "Angles",
        "3-2-1: heading 0–360° clockwise from north, pitch ±90° nose up, roll ±180° "
        "right side down",
    ),
    ("Error", "rotation angle |log(C_est^T C_ref)| in degrees, whatever the axis"),
    ("Earth rate", "neglected, as in Alexiev (2021): 15°/h"),
)


# Two exact algorithms that differ by less are taken as equal.
AGREE = 1e-6  # deg


def degrees(value: float | None) -> str:
    """Format an angle to three significant digits; rounding errors are named as such."""
    if value is None:
        return "–"
    if abs(value) < 1e-9:
        return "< 1e-9°"
    if abs(value) < 1e-3:
        return f"{value:.1e}°"
    return f"{value:.3g}°" if abs(value) < 100 else f"{value:.1f}°"


def seconds(value: float) -> str:
    """Format an instant to a millisecond."""
    return f"{value:.3f}".rstrip("0").rstrip(".") + " s"


def standing(bench: AttitudeComparison) -> str:
    """Return the final errors of the algorithms in one or two sentences."""
    scores = [s for s in bench.scores if s.against == "truth"]
    if scores:
        answer = f"At {seconds(scores[0].time)}, {_ranked(bench, scores, 'from the truth')}."
    elif bench.scores:
        last = len(bench.references)
        scores = [s for s in bench.scores if s.reference == last]
        answer = f"At reference point R{last}, {_ranked(bench, scores, 'from it')}."
    elif len(bench.runs) > 1:
        table = bench.differences_deg.to_numpy()
        a, b = (bench.runs[k].algorithm for k in divmod(int(table.argmax()), len(table)))
        answer = (
            f"The algorithms differ by up to {degrees(float(table.max()))} ({a} against {b}) on "
            "these samples."
        )
    else:
        answer = f"{bench.runs[0].algorithm} ran over the log."
    return answer + _whose_error(bench, scores)


def _ranked(bench: AttitudeComparison, scores: list[Score], off: str) -> str:
    ranked = sorted(scores, key=lambda s: s.error_deg)
    worst = ranked[-1]
    # A run through the pole may be near the truth by chance; it is not named as the best.
    lost = {r.algorithm for r in bench.runs if passed_pole(r)}
    best = next((s for s in ranked if s.algorithm not in lost), ranked[0])
    least = degrees(best.error_deg)
    # Algorithms with equal displayed errors are named together.
    level = [
        s.algorithm
        for s in scores
        if degrees(s.error_deg) == least and (s is best or s.algorithm not in lost)
    ]
    *others, last = level
    named = f"{', '.join(others)} and {last} are" if others else f"{last} is"
    text = f"{named} {least} {off}"
    if worst.algorithm not in level:
        text += f"; {worst.algorithm} is {degrees(worst.error_deg)}"
    return text


# Share of the total error below which the algorithm error does not explain it.
SMALL_SHARE = 0.1


def _whose_error(bench: AttitudeComparison, scores: list[Score]) -> str:
    """Exclude the algorithms as the error source when two exact ones agree."""
    names = [run.algorithm for run in bench.runs]
    exact = [s for s in scores if s.algorithm == "quaternion"]
    if not {"dcm", "quaternion"} <= set(names) or not exact or exact[0].error_deg < AGREE:
        return ""
    pair = [names.index("dcm"), names.index("quaternion")]
    if bench.differences_deg.to_numpy()[*pair] > AGREE:
        return ""
    own = next((s.own_deg[2] for s in bench.shares if s.algorithm == "quaternion"), 0.0)
    if own > SMALL_SHARE * exact[0].error_deg:
        # They agree but share the error of an axis that turns within the step.
        return ""
    return (
        " Direction cosines and quaternion agree to rounding: the remaining error is due to the "
        "sensor, its rate, its bias or the reference, not to arithmetic."
    )


def condition(diagnostics: dict[str, float]) -> str:
    """Diagnostics of an algorithm in words."""
    parts = []
    if (near := diagnostics.get("closest_to_pole_deg")) is not None:
        how = f"±90° pitch {degrees(near)} off" if near else "through ±90° pitch"
        parts.append(f"{how} at {seconds(diagnostics['closest_to_pole_time_s'])}")
    for key, words in (("orthogonality_loss", "|CᵀC − I|"), ("norm_error", "|q| − 1")):
        if key in diagnostics:
            parts.append(f"{words} = {diagnostics[key]:.1e}")
    return "; ".join(parts) or "–"


def first_value(reading: Reading) -> str:
    """The first value of a column, in display form."""
    return reading.first if isinstance(reading.first, str) else f"{reading.first:.6g}"


def reference_lines(bench: AttitudeComparison) -> list[str]:
    """Each reference point in words, with the turned angle where turns were counted."""
    lines = []
    for number, (_, row) in enumerate(bench.references.iterrows(), start=1):
        text = f"R{number}: {in_words(row)}"
        score = next((s for s in bench.scores if s.reference == number), None)
        if score is not None and score.turned_deg is not None and score.expected_deg:
            share = score.turned_deg / score.expected_deg - 1.0
            text += (
                f"; the gyro turned {score.turned_deg:.1f}° of {score.expected_deg:.1f}° "
                f"({100 * share:+.2f} %: scale factor, bias and handling)"
            )
        if score is not None and score.sd_deg is not None:
            text += f"; known to {score.sd_deg:g}° (1σ)"
        lines.append(text)
    return lines


def facts(bench: AttitudeComparison) -> list[tuple[str, str]]:
    """Inputs and assumptions of the run."""
    found = [("Log", bench.description), *premises(bench.initial, bench.gyro_bias)]
    if bench.truth is not None:
        known = f"known at {len(bench.truth)} samples"
        counted = bench.truth.index[bench.scored]
        if len(counted):
            first, last = seconds(float(counted[0])), seconds(float(counted[-1]))
            known += f"; {len(counted)} of them count, from {first} to {last}"
        else:
            known += ", none of which counts"
        found.append(("Truth", known))
    if bench.second is not None:
        found.append(("Second log", second_words(bench.second)))
    if bench.sampling_error_deg is not None:
        final, most = map(degrees, bench.sampling_error_deg)
        how = "estimate: rates interpolated linearly between their stamps, against cubically"
        if bench.specification["source"]["kind"] == "scenario":
            how = "error of exact arithmetic on noise-free samples at this rate"
        found.append(("Sampling error", f"{final} at the end, {most} at most: {how}"))
    if bench.rests:
        shown = [
            f"{seconds(r.start)} to {seconds(r.end)}, mean rate "
            f"({', '.join(f'{math.degrees(v):.3f}' for v in r.gyro_mean)}) deg/s"
            for r in bench.rests[:6]
        ]
        if (more := len(bench.rests) - len(shown)) > 0:
            shown.append(f"and {more} more")
        found.append(("At rest", "; ".join(shown)))
    elif not bench.scores:
        found.append(("At rest", "no stationary stretch of a second or more was found"))
    return found


def premises(initial: Mapping[str, Any], gyro_bias: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Premises of the attitude of a run, by the tables of these names in its JSON."""
    i, removed = initial, str(gyro_bias["from"])
    if (bias := gyro_bias["rad_per_s"]) is not None:
        values = ", ".join(f"{math.degrees(v):.4f}" for v in bias)
        removed = f"({values}) deg/s about forward, right, down removed: {removed}"
    begins = (
        f"roll {i['roll_deg']:.3f}°, pitch {i['pitch_deg']:.3f}°, heading "
        f"{i['heading_deg']:.3f}° at {seconds(i['time_s'])}: {i['from']}"
    )
    return [("Initial attitude", begins), ("Gyro bias", removed)]


def second_words(second: SecondLog) -> str:
    """Clock, mounting and scale of a second log relative to the first, with standard deviations."""
    roll, pitch, heading = second.mounting_deg
    sd = max(second.mounting_sd_deg)
    return (
        f"its clock is {second.offset:.4f} s ahead (1σ {second.offset_sd:.2g} s) and runs "
        f"{second.drift_ppm:+.3g} ppm (1σ {second.drift_sd_ppm:.2g}); mounted at roll {roll:.2f}°, "
        f"pitch {pitch:.2f}°, heading {heading:.2f}° (1σ up to {sd:.2g}°); ratio of scale factors "
        f"{second.scale:.5f} (1σ {second.scale_sd:.2g}); correlation of the rates "
        f"{100 * second.correlation:.1f} %"
    )


# Numbers of a bench that several tables and charts share.


#: Methods of lowering the sample rate, with their labels.
MEANINGS = {
    "sum": "samples averaged",
    "drop": "samples left out",
}


def largest_known(scores: Sequence[Score]) -> float | None:
    """Largest finite error against a known attitude, deg; None if there is none."""
    found = [s.error_deg if s.max_deg is None else s.max_deg for s in scores]
    return max((e for e in found if math.isfinite(e)), default=None)


def full_rate_errors(bench: AttitudeComparison) -> dict[str, float]:
    """Return the error in deg by which each algorithm is judged at the log's own rate, by name.

    The largest error against known attitudes, else the algorithm error.
    """
    own = {share.algorithm: share.own_deg[2] for share in bench.shares}
    swept: dict[str, float] = {}
    if len(bench.sweep):
        rows = bench.sweep[bench.sweep["factor"] == 1]
        swept = dict(zip(rows["algorithm"].tolist(), rows["error_deg"].tolist(), strict=True))
    errors = {}
    for run in bench.runs:
        name = run.algorithm
        known = largest_known([s for s in bench.scores if s.algorithm == name])
        errors[name] = swept.get(name, own.get(name, math.nan) if known is None else known)
    return errors


def chosen_run(bench: AttitudeComparison) -> AttitudeRun:
    """Return the run of the recommended algorithm, else that with the smallest error."""
    errors, answer = full_rate_errors(bench), bench.answer.algorithm

    def order(run: AttitudeRun) -> float:
        error = errors[run.algorithm]
        return -1.0 if run.algorithm == answer else error if math.isfinite(error) else math.inf

    return min(bench.runs, key=order)


def sweep_grid(bench: AttitudeComparison, meaning: str, column: str = "error_deg") -> pd.DataFrame:
    """Return the errors of one method of lowering the rate, deg; NaN where one did not run.

    `meaning`: ``drop`` or ``sum``; `column`: of the sweep. Algorithms are in the order of the runs,
    rates in Hz from high to low.
    """
    names = [run.algorithm for run in bench.runs]
    part = bench.sweep[bench.sweep["meaning"] == meaning] if len(bench.sweep) else bench.sweep
    if not len(part):
        return pd.DataFrame(index=names)
    grid = part.pivot_table(column, "algorithm", "rate_hz", "max", dropna=False)
    return grid.reindex(names)[sorted(grid.columns, reverse=True)]


def like_with_like(bench: AttitudeComparison) -> tuple[list[PeerRun], list[PeerRun]]:
    """Split the other libraries into gyro-only ones, as the bench's own are, and aided ones."""
    alone = [p for p in bench.peers if p.aiding == "gyro"]
    return alone, [p for p in bench.peers if p.aiding != "gyro"]


def share_basis(bench: AttitudeComparison) -> str:
    """Return whether the shares are exact or estimates."""
    if bench.specification["source"]["kind"] == "scenario":
        return "Exact: each algorithm also ran on simulated samples without sensor errors."
    unknown = all(share.sensor_deg is None for share in bench.shares)
    return (
        "Estimate: the algorithm error is the difference from the most accurate algorithm on the "
        "same samples"
    ) + (
        "; the sensor error is unknown without a truth."
        if unknown
        else ", the sensor error that one's error against the truth."
    )


def source_of(run: AttitudeRun) -> str:
    """Source of an algorithm, as ``Alexiev (2021) Eq. (2)``."""
    cls = ALGORITHMS.get(run.algorithm.partition(":")[0])
    source = "" if cls is None else cls.source
    return f"{source} Eq. {run.equations}".strip() if run.equations else source


def offer_lines(bench: AttitudeComparison) -> list[str]:
    """Stationary stretches of similar attitude, proposed as reference points."""
    return [
        f"--reference '{offer.words}' ({offer.apart_deg:.2g}° apart by gravity, 1σ "
        f"{offer.sd_deg:.2g}°; {offer.caveat})"
        for offer in bench.offers[:4]
    ]
