"""What every reader of crash records returns: channels in SI, and what the file says of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding

Array = NDArray[np.float64]

__all__ = ["QUANTITIES", "CrashChannel", "CrashRecord"]


def _sample_row(sample: int) -> int:
    return sample + 1


#: What a channel may be, and its unit in SI.
QUANTITIES: dict[str, str] = {
    "acceleration": "m/s2",
    "rate": "rad/s",
    "velocity": "m/s",
    "displacement": "m",
    "force": "N",
    "time": "s",
    "other": "",
}


@dataclass(frozen=True, eq=False)
class CrashChannel:
    """One channel of a record.

    Attributes
    ----------
    name : str
        By which a case names it, unique in its record: a column, ``93``, ``11HEAD0000H3ACXP``.
    quantity : str
        One of `QUANTITIES`; a velocity is a change of velocity from the first sample.
    axis : str
        ``x``, ``y``, ``z`` where it is known to lie along an axis that points forward, right or
        down; with a minus where it points the other way; else empty. Of a log whose columns
        name the sensor's own axes it is the sensor's.
    unit : str
        As recorded, in this package's spelling where it is known; empty where nothing tells it.
    sampling : str or None
        ``instantaneous`` or ``mean``, where it is known.
    place : str
        Where the sensor sits, in words, as far as the record tells.
    body : str
        What it is fixed to: ``vehicle``, or another body in words.
    low_pass : str
        What it has been filtered with, in words: ``CFC 180``, ``1650 Hz before the sampler``.
    remarks : tuple of str
        What else the record says of it: status, redundancy, comment.
    full_scale : float or None
        In SI, where the record states it.
    bandwidth : float or None
        Hz, of the low-pass before the sampler.
    file : str
        Name of the file that holds its samples, for messages.
    row : callable
        Row of that file in which a sample stands, counted from 1, by the sample's number.
    clock : str
        Name of the channel of quantity ``time`` that holds its stamps; empty where the stamps are
        its own.
    load : callable
        Reads time (s, as recorded) and values (SI where the unit is known, else as recorded).
    samples : callable or None
        Reads the values alone, of a record whose stamps may have to be stated first. Those of a
        clock are as recorded, whole numbers where it counts ticks.
    """

    name: str
    quantity: str
    axis: str
    unit: str
    load: Callable[[], tuple[Array, Array]] = field(repr=False)
    sampling: str | None = None
    place: str = ""
    body: str = "vehicle"
    low_pass: str = ""
    remarks: tuple[str, ...] = ()
    full_scale: float | None = None
    bandwidth: float | None = None
    file: str = ""
    row: Callable[[int], int] = field(default=_sample_row, repr=False)
    clock: str = ""
    samples: Callable[[], NDArray[Any]] | None = field(default=None, repr=False)


@dataclass(frozen=True, eq=False)
class CrashRecord:
    """Channels of one recorder, or of a whole test.

    Attributes
    ----------
    path : Path
        Of the file or folder that a case names.
    format : str
        Key of the reader.
    title : str
    facts : dict of str to str
        What the record says of the test, for a report: vehicle, date, laboratory. With the keys
        ``mass_kg``, ``length_m``, ``width_m``, ``speed_m_per_s`` where it says those.
    channels : tuple of CrashChannel
    files : tuple of Path
        Every file that belongs to it.
    findings : tuple of Finding
    remarks : tuple of str
        What else stands in it for people: lines above a table, in which rate and axes may be.
    """

    path: Path
    format: str
    title: str
    facts: Mapping[str, str]
    channels: tuple[CrashChannel, ...]
    files: tuple[Path, ...]
    findings: tuple[Finding, ...] = ()
    remarks: tuple[str, ...] = ()

    def channel(self, name: str) -> CrashChannel:
        """Return a channel by its name.

        Raises
        ------
        DataError
            There is none; the message names the nearest.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise DataError(
            "io.no-such-channel",
            file=self.path.name,
            quantity="channel",
            name=name,
            word=name,
            known=[c.name for c in self.channels],
        )
