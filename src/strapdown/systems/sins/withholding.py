"""A chain scored by fixes that are kept from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from strapdown.config.navigation import NavigationSpec, WithholdTable, aids_of
from strapdown.evaluation.withheld import WithheldScore, blinded, score_of, spans_to_withhold
from strapdown.exceptions import ConfigError
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.systems.progress import Progress
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.source import NavigationSource
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, values_of

__all__ = ["score_withholding", "withheld_aid"]

#: A filter has settled so long after navigation began, s.
SETTLED = 30.0


def withheld_aid(spec: NavigationSpec) -> str:
    """The aid whose fixes a specification keeps back."""
    assert spec.withhold is not None
    named = spec.withhold.aid
    return named or next(name for name, aid in aids_of(spec).items() if aid.kind == "gnss")


def score_withholding(
    spec: NavigationSpec,
    chain: Chain,
    source: NavigationSource,
    record: NavigationRecord,
    progress: Progress,
) -> tuple[WithheldScore, ...]:
    """Run a chain with all fixes up to each stretch, and through it with none.

    Parameters
    ----------
    spec : NavigationSpec
    chain : Chain
    source : NavigationSource
    record : NavigationRecord
        Of the whole run: when navigation began.
    progress : callable

    Returns
    -------
    tuple of WithheldScore
        In the order of the stretches; empty where nothing is to be kept back.

    Raises
    ------
    ConfigError
        A stretch is not within the run, or has no fixes.
    """
    asked = spec.withhold
    if asked is None:
        return ()
    name = withheld_aid(spec)
    time = index_of(source.imu)
    values = values_of(source.imu, [*GYRO, *ACCEL])
    begun = float(record.trajectory.index[0])
    spans = _spans(asked, begun, float(time[-1]))
    blind = replace(chain, navigator=blinded(chain.navigator, name))
    state = chain.begin(source.imu.attrs["sampling"], source.name)
    for aid, table in source.tables.items():
        state = chain.tell(state, aid, table)
    found: dict[int, WithheldScore] = {}
    at = 0
    for number, k in enumerate(sorted(range(len(spans)), key=lambda k: spans[k].begin)):
        progress("withholding fixes", number / len(spans))
        span = spans[k]
        first, last = np.searchsorted(time, [span.begin, span.end], side="right").tolist()
        if span.begin < begun or span.end > time[-1] or first == last:
            raise ConfigError(
                f"from {span.begin:.9g} to {span.end:.9g} s is not within the navigation, which "
                f"goes from {begun:.9g} to {time[-1]:.9g} s",
                file=source.name,
                quantity="withhold, spans_s",
                remedy="give times on the clock of the samples, within it",
            )
        state, _ = chain.advance(state, time[at:first], values[at:first])
        at = first
        _, piece = blind.advance(state, time[first:last], values[first:last])
        found[k] = score_of(piece.navigation, name, span)
    return tuple(found[k] for k in range(len(spans)))


def _spans(asked: WithholdTable, begun: float, end: float) -> Sequence[Span]:
    if asked.spans_s:
        return [Span(f"{e - b:g} s", b, e) for b, e in asked.spans_s]
    first = begun + SETTLED if asked.from_s is None else asked.from_s
    return [
        span
        for length in asked.lengths_s
        for span in spans_to_withhold(first, end, length, asked.places)
    ]
