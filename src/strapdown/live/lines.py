"""Lines of a live run: samples, what aids measured, and commands, by commas.

::

    imu,TIME,GX,GY,GZ,AX,AY,AZ        rad/s and m/s², axes of the sensors
    NAME,TIME,COLUMN=VALUE,…          what the aid NAME measured
    command,WORD                      next, fine, navigation; end
    TIME,4,GX,GY,GZ,3,AX,AY,AZ,…      as Sensorstream sends them

Blanks around commas, empty lines and those that begin with ``#`` mean nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from strapdown.errors import Finding
from strapdown.formats.sensorstream import blocks_of

__all__ = ["END", "BadLineError", "Measured", "Sample", "Word", "parse_line"]

#: The word that ends a run.
END = "end"
IMU, COMMAND = "imu", "command"
#: Blocks of Sensorstream.
_ACCEL, _GYRO = 3, 4
_FORM = "imu,TIME,GX,GY,GZ,AX,AY,AZ"
#: Characters of a line that a message shows.
LONGEST = 40


class BadLineError(Exception):
    """A line that cannot be used; it is left out.

    Parameters
    ----------
    kind : str
        What all lines of its kind have in common, by which they are counted.
    code : str or Finding
        As of `StrapdownError`.
    **data
        As of `Finding`.
    """

    def __init__(self, kind: str, code: str | Finding, /, **data: Any) -> None:
        self.kind = kind
        self.finding = code if isinstance(code, Finding) else Finding(code, **data)
        super().__init__(self.finding)


@dataclass(frozen=True)
class Sample:
    """Rates in rad/s and specific forces in m/s², axes of the sensors."""

    time: float
    values: tuple[float, ...]


@dataclass(frozen=True)
class Measured:
    """What an aid measured."""

    name: str
    time: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Word:
    """A command."""

    word: str


def parse_line(text: str, aids: Sequence[str]) -> Sample | Measured | Word | None:
    """Read a line.

    Parameters
    ----------
    text : str
    aids : sequence of str
        Names of those that take what they measured.

    Returns
    -------
    Sample, Measured, Word or None
        None of a line that says nothing.

    Raises
    ------
    BadLineError
        It has another form, or a number in it is none.
    """
    text = text.strip()
    if not text or text.startswith("#"):
        return None
    head, *fields = (part.strip() for part in text.split(","))
    if head == IMU:
        if len(fields) != 7:
            raise BadLineError("imu", "live.wrong-number-of-values", count=len(fields), form=_FORM)
        time, *values = (_number(field, IMU) for field in fields)
        return Sample(time, tuple(values))
    if head == COMMAND:
        if len(fields) != 1 or not fields[0]:
            raise BadLineError("command", "live.command-not-one-word", end=END)
        return Word(fields[0])
    if head in aids:
        return _measured(head, fields)
    if head[:1].isdigit() or head[:1] in ("-", "+", "."):
        return _streamed(text)
    known = [IMU, COMMAND, *aids]
    raise BadLineError(
        "word", "live.unknown-line", given=_shown(head), word=head[:LONGEST], known=known
    )


def _measured(name: str, fields: Sequence[str]) -> Measured:
    if len(fields) < 2:
        raise BadLineError(name, "live.measurement-incomplete", name=name)
    values: dict[str, float] = {}
    for field in fields[1:]:
        column, equals, value = field.partition("=")
        if not equals:
            raise BadLineError(name, "live.not-column-value", name=name, given=_shown(field))
        if column.strip() in values:
            raise BadLineError(name, "live.column-repeated", name=name, given=_shown(field))
        values[column.strip()] = _number(value.strip(), name)
    return Measured(name, _number(fields[0], name), values)


def _streamed(text: str) -> Sample:
    found = blocks_of(text)
    if found is None:
        raise BadLineError("sensorstream", "live.not-sensorstream", form=_FORM)
    time, blocks = found
    if _GYRO not in blocks or _ACCEL not in blocks:
        raise BadLineError(
            "sensorstream without a sensor",
            "live.sensorstream-without-sensor",
            gyro=_GYRO,
            accel=_ACCEL,
        )
    values = (*blocks[_GYRO], *blocks[_ACCEL])
    if not all(map(math.isfinite, (time, *values))):
        raise BadLineError("sensorstream", "live.value-not-finite")
    return Sample(time, values)


def _number(text: str, kind: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadLineError(kind, "live.not-a-finite-number", given=_shown(text))
    return value


def _shown(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
