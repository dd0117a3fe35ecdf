"""Score a navigator, or its smoother, by fixes that are withheld from it, span by span."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown.dsp.chi_square import PLANE_95
from strapdown.navigation.outage_test import blinded, end_of_what_tells, score_of, score_of_smoothed


def score_withheld(navigator, state, time, rows, name, table, spans):
    """Navigate with all fixes up to each span, and without fixes through it."""
    blind = blinded(navigator, name)
    state = navigator.tell(state, name, table)
    found = {}
    at = 0
    for k in sorted(range(len(spans)), key=lambda k: spans[k].begin):
        span = spans[k]
        first, last = np.searchsorted(time, [span.begin, span.end], side="right").tolist()
        assert at <= first < last and span.end <= time[-1]
        state, _ = navigator.advance(state, time[at:first], rows[at:first])
        at = first
        _, piece = blind.advance(state, time[first:last], rows[first:last])
        found[k] = score_of([piece], name, span)
    return tuple(found[k] for k in range(len(spans)))


def score_withheld_smoothed(navigator, state, time, rows, name, spans):
    """Score a navigator's smoother over spans without fixes, each by itself."""
    blind = blinded(navigator, name)
    found, at = [], 0
    for span in spans:
        ends = [span.begin, span.end, end_of_what_tells(span)]
        first, last, after = np.searchsorted(time, ends, side="right").tolist()
        state, _ = navigator.advance(state, time[at:first], rows[at:first])
        at = first
        through, piece = blind.advance(state, time[first:last], rows[first:last])
        _, later = navigator.advance(through, time[last:after], rows[last:after])
        smoothing = navigator.smoother.begin(navigator)
        smoothing.take(piece)
        smoothing.take(later)
        found.append(score_of_smoothed([piece], smoothing, name, span))
    return tuple(found)


def scores_table(scores):
    """Return scores as a table."""
    rows = []
    for one in scores:
        worst = int(np.argmax(one.horizontal))
        rows.append(
            {
                "length": one.span.end - one.span.begin,
                "fixes": len(one.time),
                "error": one.largest,
                "bound": float(one.bound[worst]),
                "distance": float(one.distance[worst]),
                "down": float(np.abs(one.error[:, 2]).max()),
                "inside": float(np.mean(one.distance <= PLANE_95)),
            }
        )
    begins = pd.Index([one.span.begin for one in scores], name="begin")
    return pd.DataFrame(rows, index=begins)
