"""Fixes withheld from a navigator, and how far its smoother then is from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.evaluation.withheld import WithheldScore, blinded, seen_of
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.piece import NavigationPiece
from strapdown.navigation.record import Span

__all__ = ["end_of_what_tells", "score_of_smoothed", "score_withheld_smoothed"]

Array = NDArray[np.float64]

#: A smoother is given so many lengths of the stretch after it, and no less than so many seconds:
#: what comes later tells nothing of the stretch that this does not.
AFTER, LEAST_AFTER = 2.0, 60.0


def end_of_what_tells(span: Span) -> float:
    """Return the time up to which a smoother is given what follows a stretch, s."""
    return span.end + max(AFTER * (span.end - span.begin), LEAST_AFTER)


def score_withheld_smoothed(
    navigator: Navigator,
    state: NavigatorState,
    time: Array,
    rows: Array,
    name: str,
    spans: Sequence[Span],
) -> tuple[WithheldScore, ...]:
    """Score a navigator's smoother by each of some spans without fixes, by itself.

    Parameters
    ----------
    navigator : Navigator
        With a smoother.
    state : NavigatorState
        At the start, told of the fixes.
    time : ndarray, (n,), s
    rows : ndarray, (n, 10)
        As `Navigator.advance`, from the state on.
    name : str
        Of the aid; its observation ``NAME.position`` is scored.
    spans : sequence of Span
        In the order of time, within the record.

    Returns
    -------
    tuple of WithheldScore

    Raises
    ------
    ConfigError
        There is no such aid, or a span has no fixes.
    """
    blind = blinded(navigator, name)
    found, at = [], 0
    for span in spans:
        ends = [span.begin, span.end, end_of_what_tells(span)]
        first, last, after = np.searchsorted(time, ends, side="right").tolist()
        state, _ = navigator.advance(state, time[at:first], rows[at:first])
        at = first
        through, piece = blind.advance(state, time[first:last], rows[first:last])
        _, later = navigator.advance(through, time[last:after], rows[last:after])
        found.append(score_of_smoothed(navigator, [piece], [later], name, span))
    return tuple(found)


def score_of_smoothed(
    navigator: Navigator,
    pieces: Sequence[NavigationPiece],
    later: Sequence[NavigationPiece],
    name: str,
    span: Span,
) -> WithheldScore:
    """Score what a smoother makes of a span by what came before and after it.

    The place of the antenna is that of the smoothed state with the smoothed arm and the smoothed
    offset of its clock, where these are estimated, and so is its covariance.

    Parameters
    ----------
    navigator : Navigator
        With a smoother.
    pieces : sequence of NavigationPiece
        Of the span, in which the aid was looked at and not used.
    later : sequence of NavigationPiece
        That follow, with the aid.
    name : str
        Of the aid, which is a receiver.
    span : Span

    Returns
    -------
    WithheldScore

    Raises
    ------
    ConfigError
        The aid has no fixes there.
    """
    assert navigator.smoother is not None
    seen = seen_of(pieces, name, span)
    smoothing = navigator.smoother.begin(navigator)
    for piece in (*pieces, *later):
        smoothing.take(piece)
    time = np.array([one.time for one in seen])
    # Looked at by a rule of its own, it is no lone receiver of a compiled loop.
    observations = [one.observation for one in seen if one.observation is not None]
    error, covariance = smoothing.seen(time, observations)
    variance = np.einsum("kii->ki", covariance)
    return WithheldScore(span, time, error, variance, covariance[:, :2, :2])
