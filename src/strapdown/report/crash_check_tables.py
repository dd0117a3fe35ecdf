"""Tables of a crash report that hold its answers against recorders, models and references."""

from __future__ import annotations

import math

from strapdown.constants import TWO_SIDED_95
from strapdown.report.crash_values import KMH, MEAN, about, axis_names, instant, plain, speed
from strapdown.report.document import TableBlock
from strapdown.systems.case_references import ReferenceAnswer
from strapdown.systems.crash_case import CaseResult

__all__ = ["comparison_table", "reference_tables", "severity_table"]


def comparison_table(result: CaseResult) -> TableBlock | None:
    """Return how pairs of recorders agree."""
    comparison = result.reconstruction.comparison
    if comparison is None:
        return None
    rows = []
    for pair in comparison.pairs:
        difference, sd = pair.difference[-1], pair.sd[-1]
        rows.append(
            (
                f"{pair.first} less {pair.second}",
                *(
                    about(KMH * float(d), KMH * TWO_SIDED_95 * float(s), "")
                    if math.isfinite(float(d))
                    else "not measured"
                    for d, s in zip(difference, sd, strict=True)
                ),
                f"{pair.chi_square / max(pair.freedom, 1):.2f}",
                "below 0.0001" if pair.probability < 1e-4 else f"{pair.probability:.2g}",
                "yes" if pair.agree else "NO",
            )
        )
    start, end = float(comparison.edges[0]), float(comparison.edges[-1])
    return TableBlock(
        (
            "recorders",
            "forward, km/h",
            "right, km/h",
            "down, km/h",
            "chi-square per degree of freedom",
            "probability",
            "agree",
        ),
        tuple(rows),
        text=(0, 6),
        caption="Difference of what two recorders say of the velocity at the "
        f"{result.spec.point.name}, {instant(start)} to {instant(end)}, beside the 95 % bound of "
        "such a difference. Probability: of differences as large or larger where everything that "
        "is stated is right.",
    )


def severity_table(result: CaseResult) -> TableBlock | None:
    """Return what models of injury risk say."""
    if not result.severity:
        return None
    rows = []
    sources = list(dict.fromkeys(answer.model.source for answer in result.severity))
    for answer in result.severity:
        risk = answer.risk
        rows.append(
            (
                answer.model.outcome,
                "–" if risk is None else f"{100.0 * risk.probability:.2g} %",
                ("" if answer.because is None else answer.because.sentence("file"))
                if risk is None
                else f"{100.0 * risk.low:.2g} to {100.0 * risk.high:.2g} %",
                *((answer.model.source,) if len(sources) > 1 else ()),
            )
        )
    return TableBlock(
        (
            *("outcome", "probability", "by the bound of delta-V"),
            *(("source",) if len(sources) > 1 else ()),
        ),
        tuple(rows),
        text=(0, 2, 3),
        caption="Probability that an occupant is hurt at least so, by published models; the bound "
        "is that of the delta-V alone and not of the model."
        + (f" Source: {sources[0]}" if len(sources) == 1 else ""),
    )


def reference_tables(result: CaseResult) -> tuple[TableBlock, ...]:
    """Return the answers beside what else is known: changes of velocity, and paths."""
    changes: list[tuple[str, ...]] = []
    paths: list[tuple[str, ...]] = []
    for answer in result.references:
        spec, verdict = answer.spec, "yes" if answer.consistent else "NO"
        who = (spec.name, _name(answer, result))
        if answer.path is not None:
            errors = (*answer.path.rms, *answer.path.largest)
            paths.append((*who, *(plain(float(v), 3) for v in errors), verdict))
            continue
        assert spec.delta_v_m_per_s is not None
        changes.append(
            (
                *who,
                f"{spec.axis}, {instant(answer.span[0])} to {instant(answer.span[1])}",
                speed(answer.delta_v, TWO_SIDED_95 * answer.sd),
                speed(spec.delta_v_m_per_s, TWO_SIDED_95 * spec.delta_v_sd_m_per_s),
                verdict,
            )
        )
    names = axis_names(result)
    tables = (
        TableBlock(
            ("reference", "recorder", "delta-V", "this report", "reference", "within 95 %"),
            tuple(changes),
            text=(0, 1, 2, 5),
            caption="Changes of velocity beside those that are known otherwise; bounds hold 95 %.",
        ),
        TableBlock(
            (
                *("reference", "recorder"),
                *(f"{name}, RMS" for name in names),
                *(f"{name}, largest" for name in names),
                "within 95 %",
            ),
            tuple(paths),
            text=(0, 1, 8),
            caption="Errors of the path, m: this report less the reference.",
        ),
    )
    return tuple(table for table in tables if table.rows)


def _name(answer: ReferenceAnswer, result: CaseResult) -> str:
    combined = result.reconstruction.combined
    return MEAN if combined is not None and answer.unit == combined.name else answer.unit
