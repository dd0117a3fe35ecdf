"""Crash records: channels in SI units with metadata; their names, units and attributes."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.tables import SAMPLINGS
from strapdown.tables.checks import IMPOSSIBLE_FORCE, IMPOSSIBLE_RATE, Array


def _sample_row(sample: int) -> int:
    return sample + 1


# Words of a laboratory about a channel without valid data.
_FAILED = ("failed", "no data", "questionable", "meaningless")
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
        Body of that vehicle that it is fixed to: ``vehicle`` for its structure as long as that is
        rigid, or another body in words: ``engine``, ``front left occupant's head``.
    vehicle : str
        Number of the test object that it belongs to: ``1``, ``2``; also of a mobile barrier, sled
        or impactor. Empty where the record has none, as for a fixed barrier or a table.
    point : str
        Code of the measuring point, common to the channels of one triad; empty if unknown.
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
    from_zero : bool
        Of a velocity: the change since time zero of the recorder, where it was zero.
    event : int
        Number of the event of an event data recorder; 0 where none is stated.
    dummy : str
        Of an occupant's channel: its dummy by the codes of ISO MME (``H3``, ``HF``); empty where
        unknown.
    """

    name: str
    quantity: str
    axis: str
    unit: str
    load: Callable[[], tuple[Array, Array]] = field(repr=False)
    sampling: str | None = None
    place: str = ""
    body: str = "vehicle"
    vehicle: str = ""
    point: str = ""
    low_pass: str = ""
    remarks: tuple[str, ...] = ()
    full_scale: float | None = None
    bandwidth: float | None = None
    file: str = ""
    row: Callable[[int], int] = field(default=_sample_row, repr=False)
    clock: str = ""
    samples: Callable[[], NDArray[Any]] | None = field(default=None, repr=False)
    from_zero: bool = False
    event: int = 0
    dummy: str = ""

    @property
    def where(self) -> dict[str, Any]:
        """Location of the channel, for findings."""
        return {"file": self.file or None, "quantity": f"channel {self.name}"}

    @property
    def failure(self) -> str:
        """Remark by which the laboratory says that the channel failed; empty if none."""
        return next((r for r in self.remarks if any(f in r.lower() for f in _FAILED)), "")


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
        Facts of the test for a report: date, laboratory.
    channels : tuple of CrashChannel
    files : tuple of Path
        All files of the record.
    findings : tuple of Finding
    remarks : tuple of str
        Further text for people: lines above a table, which may state rate and axes.
    vehicles : dict of str to dict of str to str
        Facts of each vehicle by its number (`CrashChannel.vehicle`), for a report. With the keys
        ``vehicle`` (its name), ``vin``, ``mass_kg``, ``length_m``, ``width_m``, ``speed_m_per_s``,
        ``crab_deg`` where stated.
    """

    path: Path
    format: str
    title: str
    facts: Mapping[str, str]
    channels: tuple[CrashChannel, ...]
    files: tuple[Path, ...]
    findings: tuple[Finding, ...] = ()
    remarks: tuple[str, ...] = ()
    vehicles: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def channel(self, name: str) -> CrashChannel:
        """Return a channel by its name.

        DataError: no channel has this name; the message suggests the most similar.
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


# Values that no sensor reads.


#: Of a channel whose unit is not known: beyond the limits in any of the known units.
IMPOSSIBLE_NUMBER = 1e12


def refuse_impossible(channel: CrashChannel, values: NDArray[Any]) -> None:
    """Refuse values, (n,), as `CrashChannel.load` returns them, beyond the limits of any body.

    DataError: names row and channel.
    """
    limits = {"acceleration": (IMPOSSIBLE_FORCE, " m/s²"), "rate": (IMPOSSIBLE_RATE, " rad/s")}
    of_any_unit = (IMPOSSIBLE_NUMBER, "")
    limit, unit = limits.get(channel.quantity, of_any_unit) if channel.unit else of_any_unit
    beyond = np.flatnonzero(np.abs(values) > limit)
    if beyond.size:
        raise DataError(
            "io.crash-value-impossible",
            **channel.where,
            row=channel.row(int(beyond[0])),
            value=float(values[beyond[0]]),
            unit=unit,
            count=int(beyond.size),
        )


# Cleaning of untrusted texts from files, for names and messages.


LONGEST_NAME = 120
LONGEST_TEXT = 400


def header_of(path: Path, suffix: str, several: str, none: str) -> Path:
    """Find the header of a test, given as file or folder.

    `suffix`: its ending. `several`, `none`: codes of the error. DataError: the folder holds no
    header, or more than one.
    """
    if not path.is_dir():
        return path
    headers = sorted(p for p in path.iterdir() if p.suffix.lower() == suffix and p.is_file())
    if len(headers) != 1:
        held = ", ".join(clean(p.name, LONGEST_NAME) for p in headers[:6])
        raise DataError(
            several if headers else none, file=path.resolve().name, count=len(headers), held=held
        )
    return headers[0]


def clean(text: str, longest: int = LONGEST_TEXT) -> str:
    """Reduce a text to one line, without control or bidirectional formatting characters.

    `longest`: longer texts are cut and end with three dots. Returns markup is kept; escaping is
    left to the code that writes a page.
    """
    # Of a very long text only the part that can be kept is processed.
    kept = "".join(
        " "
        if c.isspace()
        else "\N{REPLACEMENT CHARACTER}"
        if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Co", "Cn")
        else c
        for c in text[: 4 * longest]
    )
    kept = " ".join(kept.split())
    return kept if len(kept) <= longest else kept[: longest - 1] + "…"


def unique(names: list[str]) -> list[str]:
    """The same names, each one once: a second ``ax`` is ``ax (2)``."""
    taken: set[str] = set()
    out = []
    for name in names:
        other, count = name, 1
        while other in taken:
            count += 1
            other = f"{name} ({count})"
        taken.add(other)
        out.append(other)
    return out


# Positions in words: without what differs between the channels of one block.

#: Parts of the structure that some crashes push in: by the side of the vehicle that is struck.
DEFORMS: dict[str, str] = {
    "front": "part of the structure; a frontal crash may push it back on its own",
    "side": "part of the structure; a crash against this side may push it in on its own",
    "rear": "part of the structure; a crash from the rear may push it forward on its own",
    "roof": "part of the structure; a rollover may push it in on its own",
    "seat": "bolted to the structure; the upper rail moves with the seat",
}
_AXIS_WORD = re.compile(
    r"(?<![A-Za-z0-9])[XYZ](?:[RGL]|[ -]?(?:AXIS|DIR(?:ECTION)?))?(?![A-Za-z0-9])", re.I
)
# What distinguishes the channels of one block in the comments of laboratories.
_CHANNEL_WORD = re.compile(
    r"(?<![A-Za-z])(?:AXIS|PRIMARY|PRIM|REDUNDANT|REDUND|RED|BACK-?UP|ACCELERATIONS?|"
    r"ACCELEROMETER|ACCEL|ACC|ANGULAR|VELOCITY|RATE|YAW|ROLL|PITCH|LONGITUDINAL|LATERAL|VERTICAL|"
    r"CHANNEL)(?![A-Za-z])\.?",
    re.I,
)


def position_of(comment: str) -> str:
    """Position in a comment, which the channels of one block have in common.

    Without the axis, what is measured, and what follows a colon:
    ``BOTTOM OF ENGINE X: no data after 67 ms`` is at ``BOTTOM OF ENGINE``.
    """
    text = _AXIS_WORD.sub(" ", comment.partition(":")[0])
    return " ".join(_CHANNEL_WORD.sub(" ", text).split()).strip(" ,;-_/()")


def compact(text: str) -> str:
    """Letters and digits of a text in lower case, to compare spellings."""
    return "".join(c for c in text.casefold() if c.isalnum())


# Metadata of a crash channel as plain data, for files that store it beside the samples.


#: Remark of velocities that count from time zero, in files without `from_zero`.
CHANGE_NOTE = "change of velocity since time zero of the recorder"
_AXES = ("", "x", "y", "z", "-x", "-y", "-z")
_TEXTS = (
    *("name", "quantity", "axis", "unit", "place", "body", "vehicle", "point", "low_pass"),
    "dummy",
)
_NUMBERS = ("full_scale", "bandwidth")
MOST_REMARKS = 50


def attributes_of(channel: CrashChannel) -> dict[str, Any]:
    """Return everything of a channel except its samples.

    Returns the unit is the SI unit in which the values are written.
    """
    return {
        "name": channel.name,
        "quantity": channel.quantity,
        "axis": channel.axis,
        "unit": QUANTITIES[channel.quantity] or channel.unit,
        "sampling": channel.sampling,
        "place": channel.place,
        "body": channel.body,
        "vehicle": channel.vehicle,
        "point": channel.point,
        "low_pass": channel.low_pass,
        "dummy": channel.dummy,
        "remarks": list(channel.remarks),
        "full_scale": channel.full_scale,
        "bandwidth": channel.bandwidth,
        "from_zero": channel.from_zero,
    }


def check_attributes(said: object, file: str, row: int | None = None) -> dict[str, Any]:
    """Check the metadata of a channel from a file.

    `said`: as read from the file. Returns as `attributes_of`; missing entries are empty, texts are
    cleaned. DataError: the metadata has the wrong structure.
    """
    if not isinstance(said, Mapping):
        raise _bad("a channel", "io.channel-no-table", file, row)
    texts = {}
    for key in _TEXTS:
        value = said.get(key, "")
        if not isinstance(value, str):
            raise _bad(key, "io.channel-no-text", file, row, value=str(value)[:40])
        texts[key] = clean(value, LONGEST_NAME) if key in ("name", "unit") else clean(value)
    numbers = {}
    for key in _NUMBERS:
        value = said.get(key)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value)):
            raise _bad(key, "io.channel-no-number", file, row, value=str(value)[:40])
        numbers[key] = None if value is None else float(value)
    for key, known in (("quantity", tuple(QUANTITIES)), ("axis", _AXES)):
        if texts[key] not in known:
            raise DataError(
                "io.channel-unknown-word",
                file=file,
                row=row,
                quantity=key,
                key=key,
                word=texts[key],
                known=known,
            )
    remarks = said.get("remarks", [])
    if not isinstance(remarks, list) or not all(isinstance(r, str) for r in remarks):
        raise _bad("remarks", "io.channel-remarks-no-texts", file, row)
    from_zero = said.get("from_zero", CHANGE_NOTE in remarks)
    if not isinstance(from_zero, bool):
        raise _bad("from_zero", "io.channel-no-boolean", file, row, value=str(from_zero)[:40])
    sampling = said.get("sampling")
    if sampling not in (None, *SAMPLINGS):
        raise _bad(
            "sampling", "io.channel-sampling", file, row, value=str(sampling)[:40], known=SAMPLINGS
        )
    return {
        **texts,
        **numbers,
        "sampling": sampling,
        "from_zero": from_zero,
        "remarks": tuple(clean(r) for r in remarks[:MOST_REMARKS]),
    }


def _bad(key: str, code: str, file: str, row: int | None, **data: Any) -> DataError:
    return DataError(code, file=file, row=row, quantity=key, key=key, **data)
