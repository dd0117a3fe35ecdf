"""What a vote of units decided, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.sensors.axis_voting import AxisEvent, AxisVote
from strapdown.sensors.health_log import WORDS

Array = NDArray[np.float64]

__all__ = ["VoteEvent", "told_events"]


@dataclass(frozen=True)
class VoteEvent:
    """Something that the vote decided.

    Attributes
    ----------
    kind : {'excluded', 'readmitted', 'disagree'}
    channels : tuple of str
        As ``A.gyro_x``; of a disagreement the most likely.
    time, since : float, s
        When it was decided, and from when on the disagreement has lasted.
    size : float, rad/s or m/s²
        How far the first channel is off what the others tell.
    chi_square, limit : float
    finding : Finding
    """

    kind: str
    channels: tuple[str, ...]
    time: float
    since: float
    size: float
    chi_square: float
    limit: float
    finding: Finding


def told_events(
    vote: AxisVote, time: Array, columns: Sequence[str], unit: str, before: int
) -> list[VoteEvent]:
    """Events of a vote in words; `before` samples went before the segment."""
    return [_event(e, time, columns, unit, before) for e in vote.events]


def _event(
    event: AxisEvent, time: Array, columns: Sequence[str], unit: str, before: int
) -> VoteEvent:
    channels = tuple(columns[k] for k in event.axes)
    when = float(time[event.row])
    step = float(time[1] - time[0]) if time.size > 1 else 0.0
    since = float(time[event.since]) if event.since >= 0 else float(time[0] + event.since * step)
    code = {
        "readmitted": "sensors.channel-readmitted",
        "excluded": "sensors.channel-excluded",
        "disagree": "sensors.channels-disagree",
    }[event.kind]
    if event.kind == "excluded" and len(channels) > 1:
        code = "sensors.unit-excluded"
    finding = Finding(
        code,
        row=before + event.row + 1,
        quantity=channels[0],
        channels=[_words(c) for c in channels],
        name=channels[0].split(".")[0],
        time=when,
        since=since,
        size=abs(event.size),
        unit=unit,
        chi_square=event.chi_square,
        limit=event.limit,
    )
    return VoteEvent(
        event.kind, channels, when, since, event.size, event.chi_square, event.limit, finding
    )


def _words(channel: str) -> str:
    name, column = channel.rsplit(".", 1)
    return f"{WORDS[column]} of unit {name}"
