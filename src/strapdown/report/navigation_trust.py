"""Judge whether a navigation run can be trusted, from its consistency with its bounds."""

from __future__ import annotations

from strapdown.errors import Finding
from strapdown.report.alignment_trust import Trust, reason
from strapdown.report.navigation_found import FAR_OFF, Agreement, NavigationFound
from strapdown.tables import EULER

# Errors of one run are correlated in time, so less than 95 % may lie within a good bound.
_ENOUGH = 0.8
# Share of the epochs; more rejected epochs are not outliers.
_MANY = 0.1


def trust(found: NavigationFound) -> Trust:
    """Judge a run by its consistency."""
    reasons = [*_errors(found), *_withheld(found)]
    reasons += [_innovations(one) for one in found.agreements if one.used.any()]
    reasons += [_memory(one) for one in found.agreements if one.remembers]
    reasons += _rejected(found)
    # Notes appear among the findings and do not count against the run.
    reasons += [f for f in found.findings if f.severity == "warning" and not _of_truth(found, f)]
    reasons += _silence(found)
    against = [one for one in reasons if one.severity == "warning"]
    known = found.errors is not None or bool(found.told.withheld)
    wrong = known and any(one.severity == "warning" for one in (*_errors(found), *_withheld(found)))
    wrong |= any(one.refutes for one in found.agreements)
    verdict = "trusted" if not against else "distrusted" if wrong else "reserve"
    return Trust(verdict, tuple(reasons), _short(found))


def _silence(found: NavigationFound) -> list[Finding]:
    """Reason against a run without measurements, truth or outage test: it cannot be confirmed."""
    if found.errors is not None or found.told.withheld:
        return []
    if any(one.used.any() for one in found.agreements):
        return []
    return [reason(False, "navigation.nothing-observed")]


def _of_truth(found: NavigationFound, finding: object) -> bool:
    return found.errors is not None and finding in found.errors.findings


def _short(found: NavigationFound) -> tuple[Finding, ...]:
    parts = []
    if found.errors is not None:
        score = found.errors.score("horizontal")
        parts.append(
            reason(
                True,
                "navigation.position-within-bound",
                reference=found.told.truth_name,
                share=score.share,
            )
        )
    if found.told.withheld:
        count = len(found.told.withheld)
        parts.append(
            reason(True, "navigation.outage-test-passed")
            if count == 1
            else reason(True, "navigation.outage-tests-passed", count=count)
        )
    used = [one for one in found.agreements if one.used.any()]
    if used:
        worst = max(used, key=lambda a: abs(a.ratio - 1.0))
        parts.append(
            reason(
                True,
                "navigation.innovations-as-expected"
                if len(used) == 1
                else "navigation.innovations-as-expected-worst",
                name=worst.name,
                ratio=worst.ratio,
            )
        )
    return tuple(parts)


def _errors(found: NavigationFound) -> list[Finding]:
    if found.errors is None:
        return []
    out = []
    for name, word in (
        ("horizontal", "horizontal position"),
        ("down", "height"),
        *((a, a) for a in reversed(EULER)),
    ):
        score = found.errors.score(name)
        out.append(
            reason(
                bool(score.share >= _ENOUGH),
                "navigation.error-beside-bound",
                component=word,
                rms=score.rms,
                bound=score.bound,
                unit=score.unit,
                share=score.share,
            )
        )
    return out


def _withheld(found: NavigationFound) -> list[Finding]:
    those = found.told.withheld
    if not those:
        return []
    inside = sum(w.inside for w in those)
    worst = max(those, key=lambda w: w.error_m / w.bound_m if w.bound_m > 0.0 else 0.0)
    return [
        reason(
            bool(inside >= _ENOUGH * len(those)),
            "navigation.outage-tests",
            inside=inside,
            count=len(those),
            error_m=worst.error_m,
            bound_m=worst.bound_m,
            length_s=worst.end - worst.begin,
        )
    ]


def _innovations(one: Agreement) -> Finding:
    good = one.inside or one.acceptable
    if one.inside:
        code = "navigation.innovations-agree"
    elif one.acceptable and one.ratio <= 1.0 / FAR_OFF:
        code = "navigation.innovations-small-but-correlated"
    elif one.acceptable:
        code = (
            "navigation.innovations-a-little-larger"
            if one.ratio > 1.0
            else "navigation.innovations-a-little-smaller"
        )
    else:
        code = (
            "navigation.innovations-larger" if one.ratio > 1.0 else "navigation.innovations-smaller"
        )
    return reason(good, code, name=one.name, ratio=one.ratio, independent=one.lasting)


def _memory(one: Agreement) -> Finding:
    return reason(
        False,
        "navigation.innovations-correlated",
        name=one.name,
        correlation=one.correlation,
        by_chance=one.correlation_bound,
    )


def _rejected(found: NavigationFound) -> list[Finding]:
    out = []
    for one in found.agreements:
        if one.rejected > _MANY * one.epochs:
            out.append(
                reason(
                    False,
                    "navigation.many-rejected",
                    name=one.name,
                    rejected=one.rejected,
                    epochs=one.epochs,
                    share=one.rejected / one.epochs,
                )
            )
    return out
