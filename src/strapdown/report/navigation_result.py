"""What a report is told of the result of ``strapdown navigate``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strapdown.aiding.aid import lasting
from strapdown.config.choice import ChoiceSpec
from strapdown.config.navigation import aids_of
from strapdown.config.navigation_modules import make_aids
from strapdown.report.navigation_told import NavigationTold, Withheld
from strapdown.systems.sins.result import NavigationResult
from strapdown.systems.sins.withholding import Withheld as WithheldScores
from strapdown.systems.sins.withholding import withheld_aid
from strapdown.tables import GEODETIC

__all__ = ["told_of", "withheld_of"]

NO_RULE = "none: every observation counts in full, however far off it is"


def told_of(result: NavigationResult) -> NavigationTold:
    """Return what a report is made of.

    Parameters
    ----------
    result : NavigationResult

    Returns
    -------
    NavigationTold
    """
    spec, source = result.spec, result.source
    chain = [
        ("Record", f"{source.name}: {source.what}"),
        ("Pre-filter", spec.prefilter.kind),
        ("Coarse alignment", "" if result.coarse is None else spec.coarse.kind),
        ("Fine alignment", "" if result.fine is None else spec.fine.kind),
        ("Mechanization", spec.mechanization.kind),
        ("Filter", spec.filter.kind),
        ("Error model", _kind(spec.filter, "error_model")),
        ("Update rule", _kind(spec.filter, "update_rule") or NO_RULE),
        ("Smoother", "" if result.forward is None else spec.smoother.kind),
        *((f"Aid {name}", _of_aid(aid)) for name, aid in aids_of(spec).items()),
        ("States", ", ".join(dict.fromkeys(_block(c) for c in result.record.sensors.columns))),
    ]
    return NavigationTold(
        record=result.record,
        forward=result.forward,
        name=source.name,
        what=source.what,
        title=spec.title,
        chain=tuple((slot, what) for slot, what in chain if what),
        fixes={n: t for n, t in source.tables.items() if set(GEODETIC) <= set(t.columns)},
        truth=source.truth,
        truth_name=source.truth_name or "the truth",
        points=result.points,
        withheld=() if not result.withheld else withheld_of(withheld_aid(spec), result.withheld),
        findings=result.findings,
        ellipsoid=result.ellipsoid,
        lasting=lasting(make_aids(spec)),
    )


def _kind(of: object, slot: str) -> str:
    return str(getattr(getattr(of, slot, None), "kind", ""))


def _of_aid(aid: ChoiceSpec) -> str:
    rule = _kind(aid, "update_rule")
    return f"{aid.kind}, update rule {rule}" if rule else aid.kind


def withheld_of(aid: str, scores: Sequence[WithheldScores]) -> tuple[Withheld, ...]:
    """Return stretches that were withheld as a report shows them.

    Parameters
    ----------
    aid : str
    scores : sequence of Withheld

    Returns
    -------
    tuple of Withheld
        The largest error of each, and the bound in its direction at that instant.
    """
    out = []
    for one in scores:
        told = one.told
        worst = int(np.argmax(told.horizontal))
        forward = None if one.smoothed is None else one.forward.largest
        bound = float(told.bound[worst])
        out.append(Withheld(aid, told.span.begin, told.span.end, told.largest, bound, forward))
    return tuple(out)


def _block(column: object) -> str:
    return str(column).rpartition("_")[0] or str(column)
