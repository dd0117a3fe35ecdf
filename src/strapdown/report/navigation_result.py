"""What a report is told of the result of ``strapdown navigate``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from strapdown.config.navigation import aids_of
from strapdown.evaluation.withheld import WithheldScore
from strapdown.report.navigation_told import NavigationTold, Withheld
from strapdown.systems.sins.result import NavigationResult
from strapdown.tables import GEODETIC

__all__ = ["told_of", "withheld_of"]


def told_of(result: NavigationResult, withheld: Sequence[Withheld] = ()) -> NavigationTold:
    """Return what a report is made of.

    Parameters
    ----------
    result : NavigationResult
    withheld : sequence of Withheld

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
        *((f"Aid {name}", aid.kind) for name, aid in aids_of(spec).items()),
        ("States", ", ".join(dict.fromkeys(_block(c) for c in result.record.sensors.columns))),
    ]
    return NavigationTold(
        record=result.record,
        name=source.name,
        what=source.what,
        title=spec.title,
        chain=tuple((slot, what) for slot, what in chain if what),
        fixes={n: t for n, t in source.tables.items() if set(GEODETIC) <= set(t.columns)},
        truth=source.truth,
        truth_name=source.truth_name or "the truth",
        withheld=tuple(withheld),
        findings=result.findings,
        ellipsoid=result.ellipsoid,
    )


def withheld_of(aid: str, scores: Sequence[WithheldScore]) -> tuple[Withheld, ...]:
    """Return stretches that were withheld as a report shows them.

    Parameters
    ----------
    aid : str
    scores : sequence of WithheldScore

    Returns
    -------
    tuple of Withheld
        The largest error of each, and the bound in its direction at that instant.
    """
    worst = [int(np.argmax(score.horizontal)) for score in scores]
    return tuple(
        Withheld(aid, s.span.begin, s.span.end, s.largest, float(s.bound[k]))
        for s, k in zip(scores, worst, strict=True)
    )


def _block(column: object) -> str:
    return str(column).rpartition("_")[0] or str(column)
