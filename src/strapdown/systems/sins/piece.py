"""What a chain gives for a piece of its input."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine_result import FineResult
from strapdown.navigation.piece import NavigationPiece
from strapdown.navigation.record import Event, Span

__all__ = ["Aligned", "ChainPiece"]


@dataclass(frozen=True, eq=False)
class Aligned:
    """What a mode of alignment ended with.

    Attributes
    ----------
    mode : str
    begin, end : float, s
        Of the mode.
    alignment : Alignment
        At its end.
    fine : FineResult or None
    """

    mode: str
    begin: float
    end: float
    alignment: Alignment
    fine: FineResult | None = None


@dataclass(frozen=True, eq=False)
class ChainPiece:
    """What came of a piece.

    Attributes
    ----------
    mode : str
        At its end.
    time : float, s
        To which the chain has come.
    navigation : tuple of NavigationPiece
        One after the other.
    aligned : tuple of Aligned
        Modes of alignment that ended in it.
    events : tuple of Event
        That became known in it; some are of a time before.
    modes : tuple of Span
        That ended in it.
    outages : tuple of (str, Span)
        Of aids, that ended in it.
    """

    mode: str
    time: float
    navigation: tuple[NavigationPiece, ...] = ()
    aligned: tuple[Aligned, ...] = ()
    events: tuple[Event, ...] = ()
    modes: tuple[Span, ...] = ()
    outages: tuple[tuple[str, Span], ...] = ()
