"""Whether a run of navigation can be trusted: what it shows for its bounds and against them."""

from __future__ import annotations

from strapdown.report.alignment_trust import Trust
from strapdown.report.crash_values import GAP, plain
from strapdown.report.navigation_agreement import FAR_OFF, Agreement
from strapdown.report.navigation_errors import Score
from strapdown.report.navigation_found import NavigationFound
from strapdown.report.navigation_values import length_words, share_words
from strapdown.tables import EULER

__all__ = ["trust"]

# The errors of one run hang together in time, so that less than 95 of 100 may lie in a good bound.
_ENOUGH = 0.8
# Of the epochs: more that are refused are no outliers.
_MANY = 0.1


def trust(found: NavigationFound) -> Trust:
    """Judge a run by what it shows.

    Parameters
    ----------
    found : NavigationFound

    Returns
    -------
    alignment_trust.Trust
    """
    reasons = [*_errors(found), *_withheld(found)]
    reasons += [_innovations(one) for one in found.agreements if one.used.any()]
    reasons += [_memory(one) for one in found.agreements if one.remembers]
    reasons += _rejected(found)
    # What needs no remedy is told among the findings, and speaks against nothing.
    reasons += [
        (False, f.what.partition(": ")[0])
        for f in found.findings
        if f.remedy and not _of_truth(found, f)
    ]
    reasons += _silence(found)
    against = [why for good, why in reasons if not good]
    known = found.errors is not None or bool(found.told.withheld)
    wrong = known and any(not good for good, _ in (*_errors(found), *_withheld(found)))
    wrong |= any(one.refutes for one in found.agreements)
    verdict = "trusted" if not against else "distrusted" if wrong else "reserve"
    return Trust(verdict, tuple(reasons), _short(found))


def _silence(found: NavigationFound) -> list[tuple[bool, str]]:
    """Nothing that was measured can bear an answer out by sensors alone."""
    if found.errors is not None or found.told.withheld:
        return []
    if any(one.used.any() for one in found.agreements):
        return []
    return [
        (False, "nothing was observed beside it: its bounds rest on what is stated of the sensors")
    ]


def _of_truth(found: NavigationFound, finding: object) -> bool:
    return found.errors is not None and finding in found.errors.findings


def _short(found: NavigationFound) -> str:
    parts = []
    if found.errors is not None:
        score = found.errors.score("horizontal")
        parts.append(
            f"beside {found.told.truth_name} the place is within its bound for "
            f"{share_words(score.share)} of the time"
        )
    if found.told.withheld:
        count = len(found.told.withheld)
        parts.append(
            "what was withheld lies within the bound"
            if count == 1
            else f"each of {count} stretches that were withheld lies within the bound"
        )
    used = [one for one in found.agreements if one.used.any()]
    if used:
        worst = max(used, key=lambda a: abs(a.ratio - 1.0))
        parts.append(
            "what was observed scatters as it was expected to "
            f"({'' if len(used) == 1 else 'farthest off: '}{worst.name}, "
            f"{plain(worst.ratio, 2)} times as much)"
        )
    return ", and ".join([", ".join(parts[:-1]), *parts[-1:]]) if len(parts) > 1 else "".join(parts)


def _errors(found: NavigationFound) -> list[tuple[bool, str]]:
    if found.errors is None:
        return []
    out = []
    for name, word in (
        ("horizontal", "horizontal place"),
        ("down", "height"),
        *((a, a) for a in reversed(EULER)),
    ):
        score = found.errors.score(name)
        out.append((score.share >= _ENOUGH, _share(score, word)))
    return out


def _share(score: Score, word: str) -> str:
    rms, bound = _sized(score.rms, score.unit), _sized(score.bound, score.unit)
    return (
        f"the {word} is off by {rms} (root mean square; its bound of 95{GAP}% is {bound}), and "
        f"within that bound for {share_words(score.share)} of the time"
    )


def _sized(value: float, unit: str) -> str:
    if unit == "m":
        return length_words(value)
    places = 3 if value < 1.0 else 2
    return f"{plain(value, places)}°" if unit == "deg" else f"{plain(value, places)}{GAP}{unit}"


def _withheld(found: NavigationFound) -> list[tuple[bool, str]]:
    those = found.told.withheld
    if not those:
        return []
    inside = sum(w.inside for w in those)
    worst = max(those, key=lambda w: w.error_m / w.bound_m if w.bound_m > 0.0 else 0.0)
    text = (
        f"the error is within the bound in {inside} of {len(those)} stretches that were withheld; "
        f"the largest for its bound is {length_words(worst.error_m)} beside "
        f"{length_words(worst.bound_m)}, in {plain(worst.end - worst.begin, 0)}{GAP}s"
    )
    return [(inside >= _ENOUGH * len(those), text)]


def _innovations(one: Agreement) -> tuple[bool, str]:
    ratio = f"{plain(one.ratio, 2)} of the standard deviation that was expected"
    if one.inside:
        return True, f"{one.name} agrees with what was stated: {ratio} (root mean square)"
    if one.acceptable:
        if one.ratio <= 1.0 / FAR_OFF:
            return True, (
                f"{one.name} scatters less than was stated, but lasts from epoch to epoch: {ratio} "
                "(root mean square), and together as much as independent errors of "
                f"{plain(one.lasting, 2)}"
            )
        side = "more" if one.ratio > 1.0 else "less"
        return True, (
            f"{one.name} scatters a little {side} than was stated: {ratio} (root mean square)"
        )
    if one.ratio > 1.0:
        return False, f"{one.name} scatters more than was stated: {ratio} (root mean square)"
    return False, (
        f"{one.name} scatters less than was stated, so that its bounds are too wide: {ratio} "
        "(root mean square)"
    )


def _memory(one: Agreement) -> tuple[bool, str]:
    return False, (
        f"what is left of {one.name} lasts from epoch to epoch, as no noise does: correlation "
        f"{plain(one.correlation, 2)}, by chance up to {plain(one.correlation_bound, 2)}"
    )


def _rejected(found: NavigationFound) -> list[tuple[bool, str]]:
    out = []
    for one in found.agreements:
        if one.rejected > _MANY * one.epochs:
            share = share_words(one.rejected / one.epochs)
            out.append(
                (
                    False,
                    f"{one.rejected} of {one.epochs} epochs of {one.name} ({share}) were rejected",
                )
            )
    return out
