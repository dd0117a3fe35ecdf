"""Fixes withheld from a navigator, and how far its smoother then is from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.evaluation.withheld import WithheldScore, beyond_place, blinded, seen_of
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.piece import NavigationPiece
from strapdown.navigation.record import Span
from strapdown.tables import EULER

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
    time, nu, s = seen_of(pieces, name, span)
    marks = {mark.time: mark.covariance for piece in pieces for mark in piece.marks}
    before = np.array([marks[at][:2, :2] for at in time.tolist()])
    smoothing = navigator.smoother.begin(navigator)
    for piece in (*pieces, *later):
        smoothing.take(piece)
    found = smoothing.smoothed(time)
    # The place of the antenna turns with the attitude: by -r x psi for its arm r.
    arm = _arms(navigator, pieces, name, time)
    off = found.mark_errors[:, :3] - np.cross(arm, found.mark_errors[:, 6:])
    P = found.covariance[:, :2, :2]
    noise = s - np.einsum("kii->ki", np.array([marks[at][:3, :3] for at in time.tolist()]))
    variance = np.einsum("kii->ki", found.covariance[:, :3, :3]) + np.maximum(noise, 0.0)
    return WithheldScore(span, time, nu - off, variance, P + beyond_place(s, before))


def _arms(navigator: Navigator, pieces: Sequence[NavigationPiece], name: str, time: Array) -> Array:
    """The arm of an antenna, north-east-down, at instants."""
    used = navigator.filter.mechanization
    stamps = np.concatenate([piece.time for piece in pieces])
    history = np.concatenate([piece.history for piece in pieces])
    rows = history[np.clip(np.searchsorted(stamps, time), 0, len(stamps) - 1)]
    euler = used.trajectory(time, rows)[EULER].to_numpy()
    arm = np.asarray(getattr(navigator.by_name[name], "lever_arm", (0.0, 0.0, 0.0)))
    return rotation.rotate(rotation.quaternion_from_euler(euler), np.tile(arm, (len(time), 1)))
