"""GNSS outage test: score a pipeline by fixes withheld from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.config.navigation import NavigationSpec, WithholdTable
from strapdown.errors import ConfigError
from strapdown.evaluation.gnss_outages import (
    WithheldScore,
    blinded,
    end_of_what_tells,
    score_of,
    score_of_smoothed,
    spans_to_withhold,
)
from strapdown.navigation.record import NavigationChunk, NavigationRecord, Span
from strapdown.systems.progress import Progress
from strapdown.systems.sins.chain import NavigationPipeline, PipelineState
from strapdown.systems.sins.source import NavigationSource
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, values_of

__all__ = [
    "SETTLED",
    "Withheld",
    "WithheldRun",
    "score_withholding",
    "withheld_aid",
    "withheld_runs",
]

Array = NDArray[np.float64]

#: Time after the begin of navigation until the filter has settled, s.
SETTLED = 30.0


@dataclass(frozen=True, eq=False)
class Withheld:
    """Score of one test outage.

    Attributes
    ----------
    forward : WithheldScore
        By the measurements before it.
    smoothed : WithheldScore or None
        By the measurements after it, too, where the navigator has a smoother.
    """

    forward: WithheldScore
    smoothed: WithheldScore | None

    @property
    def told(self) -> WithheldScore:
        """Score of the run: smoothed if available."""
        return self.smoothed or self.forward


def withheld_aid(spec: NavigationSpec) -> str:
    """Name of the measurement whose fixes a specification withholds."""
    assert spec.withhold is not None
    named = spec.withhold.aid
    return named or next(name for name, aid in spec.aiding.items() if aid.kind == "gnss")


def score_withholding(
    spec: NavigationSpec,
    chain: NavigationPipeline,
    source: NavigationSource,
    record: NavigationRecord,
    progress: Progress,
) -> tuple[Withheld, ...]:
    """Run a pipeline with all fixes up to each test outage, and through it with none.

    Parameters
    ----------
    spec : NavigationSpec
    chain : NavigationPipeline
    source : NavigationSource
    record : NavigationRecord
        Record of the whole run, for the begin of navigation.
    progress : callable

    Returns
    -------
    tuple of Withheld
        In the order of the outages; empty if none is specified.

    Raises
    ------
    ConfigError
        An outage is not within the run, or has no fixes.
    """
    asked = spec.withhold
    if asked is None:
        return ()
    name = withheld_aid(spec)
    time = index_of(source.imu)
    values = values_of(source.imu, [*GYRO, *ACCEL])
    begun = float(record.trajectory.index[0])
    spans = _spans(asked, begun, float(time[-1]))
    state = chain.begin(source.imu.attrs["sampling"], source.name)
    for aid, table in source.tables.items():
        state = chain.tell(state, aid, table)
    for span in spans:
        if span.begin < begun or span.end > time[-1]:
            raise ConfigError(
                "navigation.not-within-navigation-goes",
                file=source.name,
                quantity="withhold, spans_s",
                begin=span.begin,
                end=span.end,
                begun=begun,
                time=time[-1],
            )
    found: dict[int, Withheld] = {}
    blind = replace(chain, navigator=blinded(chain.navigator, name))
    runs = withheld_runs(chain, blind, state, time, values, spans)
    for k, withheld in enumerate(runs):
        progress("withholding fixes", k / len(spans))
        span = spans[withheld.number]
        smoothed = None
        if chain.navigator.smoother is not None:
            until = int(np.searchsorted(time, end_of_what_tells(span), side="right"))
            then = slice(withheld.rows.stop, until)
            _, after = chain.advance(withheld.through, time[then], values[then])
            smoothed = score_of_smoothed(
                chain.navigator, withheld.pieces, after.navigation, name, span
            )
        found[withheld.number] = Withheld(score_of(withheld.pieces, name, span), smoothed)
    return tuple(found[k] for k in range(len(spans)))


@dataclass(frozen=True, eq=False)
class WithheldRun:
    """Run over a test outage in which a measurement is compared and not processed.

    Attributes
    ----------
    number : int
        Of the outage.
    state : PipelineState
        At its begin, with all earlier measurements processed.
    through : PipelineState
        At its end.
    rows : slice
        Of its samples.
    pieces : tuple of NavigationChunk
    """

    number: int
    state: PipelineState
    through: PipelineState
    rows: slice
    pieces: tuple[NavigationChunk, ...]


def withheld_runs(
    chain: NavigationPipeline,
    blind: NavigationPipeline,
    state: PipelineState,
    time: Array,
    values: Array,
    spans: Sequence[Span],
) -> Iterator[WithheldRun]:
    """Process samples with every fix up to each test outage, and through it with none.

    Parameters
    ----------
    chain : NavigationPipeline
    blind : NavigationPipeline
        The same without use of the withheld fixes (`blinded`).
    state : PipelineState
        Before the first of the samples.
    time : ndarray, (n,), s
    values : ndarray, (n, 6)
    spans : sequence of Span
        Within the samples. Each is tested separately: later ones have had its fixes.

    Yields
    ------
    WithheldRun
        In order of time.
    """
    at = 0
    for number in sorted(range(len(spans)), key=lambda k: spans[k].begin):
        span = spans[number]
        first, last = np.searchsorted(time, [span.begin, span.end], side="right").tolist()
        state, _ = chain.advance(state, time[at:first], values[at:first])
        at = first
        through, piece = blind.advance(state, time[first:last], values[first:last])
        yield WithheldRun(number, state, through, slice(first, last), piece.navigation)


def _spans(asked: WithholdTable, begun: float, end: float) -> Sequence[Span]:
    if asked.spans_s:
        return [Span(f"{e - b:g} s", b, e) for b, e in asked.spans_s]
    first = begun + SETTLED if asked.from_s is None else asked.from_s
    return [
        span
        for length in asked.lengths_s
        for span in spans_to_withhold(first, end, length, asked.places)
    ]
