"""The strip above charts over time: modes, and when each aid was there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.navigation.record import NavigationRecord, Span
from strapdown.report.chart import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Band,
    Fill,
    Line,
    Panel,
)

__all__ = ["mode_colour", "outage_bands", "strip"]

Array = NDArray[np.float64]

_MODES = {"coarse": GREY, "fine": SKY, "navigation": BLUE}
_MORE = (PURPLE, ORANGE)
_ROW, _PAD = 0.115, 0.05  # of a panel
_LETTER = 0.0085  # of the axis
_MOST_ROWS, _MOST_MARKS = 7, 200
# Epochs farther apart than so many usual ones are no longer one stretch; of fewer than so many
# nothing is usual. An epoch alone is as wide as this part of the whole.
_PAUSE, _FEW, _ALONE = 5.0, 4, 1.0 / 300.0


def mode_colour(name: str, names: tuple[str, ...]) -> str:
    """Colour of a mode among those of a run."""
    for known, colour in _MODES.items():
        if name.startswith(known):
            return colour
    others = [n for n in names if not n.startswith(tuple(_MODES))]
    return _MORE[others.index(name) % len(_MORE)]


def outage_bands(record: NavigationRecord) -> tuple[Band, ...]:
    """Shades of the times over which an aid was missing."""
    spans = {(s.begin, s.end) for spans in record.outages.values() for s in spans}
    return tuple(Band(begin, end, "outage") for begin, end in sorted(spans))


def strip(record: NavigationRecord) -> Panel | None:
    """Modes and aids in rows; None where there is neither."""
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    begins = [float(time[0]), *(m.begin for m in record.modes)]
    finishes = [float(time[-1]), *(m.end for m in record.modes)]
    whole = Span("", min(begins), max(finishes))
    # Before that aids were not used for navigation, but for an alignment.
    going = Span("", float(time[0]), float(time[-1]))
    rows: list[str] = []
    fills: list[Fill] = []
    # From end to end, whatever stands in the rows.
    ends = np.array([whole.begin, whole.end])
    lines = [Line("", ends, np.full(2, np.nan), GREY, points=True, size=0.0, legend=False)]
    if record.modes:
        rows.append("mode")
        fills += _modes(record.modes)
        lines += _names(record.modes, whole)
    for aid in _aids(record)[: _MOST_ROWS - len(rows)]:
        at = float(len(rows))
        rows.append(aid)
        out = record.outages.get(aid, ())
        used = (
            _between(out, going)
            if aid in record.outages
            else _stretches(_epochs(record, aid), going)
        )
        fills.append(_bar("used", used, at, 0.3, GREEN))
        if out:
            fills.append(_bar("outage", out, at, 0.13, VERMILLION))
        lost = _rejected(record, aid, whole)
        if lost.size:
            y = np.full(lost.size, at)
            lines.append(Line("rejected", lost, y, VERMILLION, points=True, symbol="x", size=6.0))
    if not rows:
        return None
    return Panel(
        "",
        tuple(lines),
        categories=tuple(rows),
        height=_PAD + _ROW * len(rows),
        fills=tuple(fills),
    )


def _aids(record: NavigationRecord) -> list[str]:
    """Names of the aids: those with outages first."""
    seen = [name.rpartition(".")[0] or name for name in record.innovations]
    return list(dict.fromkeys([*record.outages, *seen]))


def _of_aid(record: NavigationRecord, aid: str) -> list[str]:
    return [n for n in record.innovations if (n.rpartition(".")[0] or n) == aid]


def _epochs(record: NavigationRecord, aid: str) -> Array:
    found = [record.innovations[n].index.to_numpy(dtype=np.float64) for n in _of_aid(record, aid)]
    return np.unique(np.concatenate(found)) if found else np.empty(0)


def _rejected(record: NavigationRecord, aid: str, whole: Span) -> Array:
    """Times of epochs that were not used, as many as can be told apart."""
    found = []
    for name in _of_aid(record, aid):
        table = record.innovations[name]
        weights = table[[c for c in table.columns if str(c).startswith("weight ")]].to_numpy()
        found.append(table.index.to_numpy(dtype=np.float64)[(weights <= 0.0).any(axis=1)])
    times = np.unique(np.concatenate(found)) if found else np.empty(0)
    cell = (whole.end - whole.begin) / _MOST_MARKS
    if times.size <= _MOST_MARKS or cell <= 0.0:
        return times
    _, first = np.unique(np.floor((times - whole.begin) / cell), return_index=True)
    return times[first]


def _stretches(time: Array, whole: Span) -> tuple[Span, ...]:
    """Stretches in which epochs follow each other as they usually do, wide enough to be seen."""
    if not time.size:
        return ()
    steps = np.diff(time)
    usual = float(np.median(steps)) if time.size >= _FEW else 0.0
    ends = np.flatnonzero(steps > _PAUSE * usual)
    begins = time[np.concatenate([[0], ends + 1])]
    lasts = time[np.append(ends, time.size - 1)]
    least = _ALONE * (whole.end - whole.begin)
    more = np.maximum(0.5 * (least - (lasts - begins)), 0.0)
    return tuple(
        Span("used", float(a), float(b))
        for a, b in zip(
            np.maximum(begins - more, whole.begin), np.minimum(lasts + more, whole.end), strict=True
        )
    )


def _between(out: tuple[Span, ...], whole: Span) -> tuple[Span, ...]:
    """What is left of the whole without some spans."""
    found, at = [], whole.begin
    for span in sorted(out, key=lambda s: s.begin):
        if span.begin > at:
            found.append(Span("used", at, span.begin))
        at = max(at, span.end)
    if at < whole.end:
        found.append(Span("used", at, whole.end))
    return tuple(found)


def _bar(
    name: str, spans: tuple[Span, ...], at: float, thick: float, colour: str, opacity: float = 0.75
) -> Fill:
    x = [v for s in spans for v in (s.begin, s.end, np.nan)][:-1]
    y = [v for _ in spans for v in (at, at, np.nan)][:-1]
    rows = np.array(y)
    return Fill(name, np.array(x), rows - thick, rows + thick, colour, opacity)


def _modes(modes: tuple[Span, ...]) -> list[Fill]:
    names = tuple(dict.fromkeys(m.name for m in modes))
    return [
        _bar(
            name,
            tuple(m for m in modes if m.name == name),
            0.0,
            0.45,
            mode_colour(name, names),
            0.3,
        )
        for name in names
    ]


def _names(modes: tuple[Span, ...], whole: Span) -> list[Line]:
    """Names of modes in their bars, where there is room."""
    length = max(whole.end - whole.begin, 1e-9)
    fit = [m for m in modes if (m.end - m.begin) / length > _LETTER * (len(m.name) + 2)]
    if not fit:
        return []
    x = np.array([0.5 * (m.begin + m.end) for m in fit])
    labels = tuple(m.name for m in fit)
    places = ((0, 0),) * len(fit)
    return [
        Line(
            "mode",
            x,
            np.zeros(len(fit)),
            GREY,
            points=True,
            size=0.0,
            labels=labels,
            places=places,
            legend=False,
        )
    ]
