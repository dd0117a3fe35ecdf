"""Folders and zip archives with one text table per sensor, as ``gyro.csv`` and ``accel.csv``."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.columns import read_name
from strapdown.formats.find_columns import find_columns
from strapdown.formats.join import join
from strapdown.formats.members import Member, members_of, peek
from strapdown.formats.recording import RawLog, ReadOptions

_TRIADS = {"gyro": "gyro", "accel": "accel", "mag": "mag", "magnetometer": "mag"}
_AXIS = re.compile(r"([xyz])(?:[\s_-]*axis)?(?:\s*[\[(].*)?", re.I)


def detect(path: Path) -> bool:
    """Whether a folder has a table named after a gyro; any archive is accepted."""
    if path.is_file():
        return path.suffix.lower() == ".zip"
    return any(_triad(m) == "gyro" for m in peek(path))


def read(path: Path) -> RawLog:
    """Read each sensor's table, joined on the stamps of the gyro.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Columns named x, y, z belong to the sensor after which their table is named.

    Raises
    ------
    DataError
        The archive or a table is damaged, or there is no gyro.
    """
    name = path.resolve().name
    members = members_of(path)
    tables = [m for m in members if _triad(m)]
    if not any(_triad(m) == "gyro" for m in tables):
        held = ", ".join(m.name for m in members[:6]) + (" …" if len(members) > 6 else "")
        raise DataError(
            "io.no-table-gyro-holds", file=name, quantity="gyro", held=held or "nothing"
        )
    return join([_log(m) for m in tables], name, rows_of_member=True)


def _triad(member: Member) -> str | None:
    if member.suffix not in csv.SUFFIXES:
        return None
    said = read_name(member.stem).quantity or member.stem.lower()
    return _TRIADS.get(said)


def _log(member: Member) -> RawLog:
    raw = csv.parse(member.read(), member.label, (member.file,))
    triad = _triad(member)
    plain = {n: m[1].lower() for n in raw.columns if (m := _AXIS.fullmatch(n.strip()))}
    if sorted(plain.values()) != ["x", "y", "z"]:
        return raw
    stated: dict[str, tuple[str, str | None]] = {
        c.source: (q, c.unit) for q, c in find_columns(raw, ReadOptions()).items()
    }
    for column, axis in plain.items():
        unit = read_name(column).unit or read_name(member.stem).unit
        stated[column] = (f"{triad}_{axis}", unit)
    return dataclasses.replace(raw, stated=stated)
