"""Common form of all crash records: channels in SI units, with the metadata of the file."""

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


#: Quantities of a channel, with their SI units.
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
        Unique in its record, used in a case file: a column, ``93``, ``11HEAD0000H3ACXP``.
    quantity : str
        One of `QUANTITIES`; a velocity is the change of velocity since the first sample.
    axis : str
        ``x``, ``y``, ``z`` where it is known to lie along an axis that points forward, right or
        down, with a minus if reversed; else empty. For a log whose columns name the sensor's own
        axes, the sensor's axis.
    unit : str
        As recorded, in the spelling of this package if known; empty if not stated.
    sampling : str or None
        ``instantaneous`` or ``mean``, if known.
    place : str
        Position of the sensor, in words, as far as the record states it.
    body : str
        Body that it is fixed to: ``vehicle``, or another body in words.
    low_pass : str
        Filters applied, in words: ``CFC 180``, ``1650 Hz before the sampler``.
    remarks : tuple of str
        Further statements of the record: status, redundancy, comment.
    full_scale : float or None
        In SI units, if stated.
    bandwidth : float or None
        Bandwidth in Hz of the low-pass before the sampler.
    file : str
        Name of the file that holds its samples, for messages.
    row : callable
        Maps the number of a sample to its row in that file, counted from 1.
    clock : str
        Name of the channel of quantity ``time`` that holds its stamps; empty if it has its
        own.
    load : callable
        Reads time (s, as recorded) and values (SI if the unit is known, else as recorded).
    samples : callable or None
        Reads only the values, for a record whose stamps may have to be stated first. Those of a
        clock are as recorded, integers where it counts ticks.
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
        The file or folder named in a case.
    format : str
        Key of the reader.
    title : str
    facts : dict of str to str
        Facts of the test for a report: vehicle, date, laboratory. With the keys ``mass_kg``,
        ``length_m``, ``width_m``, ``speed_m_per_s`` where stated.
    channels : tuple of CrashChannel
    files : tuple of Path
        All files of the record.
    findings : tuple of Finding
    remarks : tuple of str
        Further text for people: lines above a table, which may state rate and axes.
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
            No channel has this name; the message suggests the most similar.
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
