"""Folders and zip archives with one text table per sensor, and access to their members.

A table is named after its sensor, or has its name among others and axes x, y, z in its header, as
those of MetaBase of MbientLab (``MetaWear_DATE_MAC_Gyroscope_100.000Hz_1.4.5.csv`` with ``epoch
(ms)``, ``elapsed (s)`` and ``x-axis (deg/s)``). The tables are joined by a clock that counts since
1970 where they have one: seconds elapsed begin in each with its own first sample.
"""

from __future__ import annotations

import codecs
import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from strapdown.errors import DataError, add_note
from strapdown.formats import csv
from strapdown.formats.columns import read_name
from strapdown.formats.csv import of_arrays
from strapdown.formats.find_columns import AXES, find_columns
from strapdown.formats.inference.conclusion import EPOCH
from strapdown.formats.join import join
from strapdown.formats.recording import NoStreamError, RawLog, ReadOptions
from strapdown.formats.signs import Signs, while_unchanged
from strapdown.formats.text_columns import fields_of
from strapdown.formats.vocabularies import WITHOUT_GRAVITY
from strapdown.parsers import parse
from strapdown.units import TIME_UNITS

TITLE = "folder or zip of one text table a sensor"
_TRIADS = {"gyro": "gyro", "accel": "accel", "mag": "mag", "magnetometer": "mag"}
#: Words of a table that has no gravity, or that its device did not correct.
_NOT_A_TRIAD = {*WITHOUT_GRAVITY, "gravity", "uncalibrated"}
_AXIS = re.compile(
    r"(?:value[\s_-]*)?([xyz])(?:[\s_-]*(?:axis|values?|data))?(?:\s*[\[(].*)?", re.I
)


def _is_of_one_recording(archive: Path) -> bool:
    """Whether an archive has no more tables than a recording; one that is damaged may have."""
    try:
        return _tables_in(_listed(archive)) <= MOST_TABLES
    except DataError:
        return True


#: Any archive of that size is accepted.
detect = Signs(
    suffixes=(".zip",),
    also=_is_of_one_recording,
    folder=lambda path: any(_triad(m) == "gyro" for m in peek(path)),
)


def read(path: Path) -> RawLog:
    """Read each sensor's table, joined on the stamps of the gyro.

    Columns named x, y, z belong to the sensor after which their table is named.
    """
    name = path.resolve().name
    members = members_of(path)
    tables = [m for m in members if _triad(m)]
    if not any(_triad(m) == "gyro" for m in tables):
        held = ", ".join(m.name for m in members[:6]) + (" …" if len(members) > 6 else "")
        raise DataError(
            "io.no-table-gyro-holds", file=name, quantity="gyro", held=held or "nothing"
        )
    raw = join([_log(m) for m in tables], name, rows_of_member=True)
    fixes = _table_of_fixes(members)
    left = [m for m in members if m not in tables and m != fixes]
    if others := [m.name for m in left if m.suffix in csv.SUFFIXES]:
        add_note(raw.findings, "io.tables-not-used", file=name, names=others)
    return raw


TABLE_TITLE = "text table of one sensor, in its name"


def _is_of_one_sensor(path: Path) -> bool:
    """Whether a table of its own is named after a sensor, in a word, and its columns x, y and z."""
    table = file_member(path)
    in_words = re.search(r"[A-Za-z]{3}", table.stem) is not None
    return in_words and _triad(table) is not None and _has_bare_axes(table)


detect_table = Signs(suffixes=csv.SUFFIXES, also=_is_of_one_sensor)


def read_table(path: Path) -> RawLog:
    """Read the table of one sensor, after which it is named."""
    return _log(file_member(path))


def read_fixes(path: Path) -> RawLog:
    """Read the table of positions beside those of sensors.

    NoStreamError: none has latitude and longitude.
    """
    found = _table_of_fixes(members_of(path))
    if found is None:
        raise NoStreamError(path.resolve().name, "gnss", TITLE, ["imu"])
    return csv.parse(found.read(), found.label, (found.file,))


def _table_of_fixes(members: list[Member]) -> Member | None:
    """Return the one table whose names say latitude and longitude, if there is just one."""
    tables = [m for m in members if m.suffix in csv.SUFFIXES]
    found = [m for m in tables if csv.are_fixes(fields_of(first_line(m)))]
    return found[0] if len(found) == 1 else None


def _triad(member: Member) -> str | None:
    """Return the sensor of a table: by its name, or by a word in it if its header has axes."""
    if member.suffix not in csv.SUFFIXES:
        return None
    said = read_name(member.stem).quantity or member.stem.lower()
    words = re.findall(r"[A-Za-z]{3,}", member.stem)
    if said in _TRIADS or _NOT_A_TRIAD & {w.lower() for w in words}:
        return _TRIADS.get(said)
    kinds = {_TRIADS.get(str(read_name(word).quantity)) for word in words} - {None}
    kind = str(kinds.pop()) if len(kinds) == 1 else ""
    return kind if kind and _has_axes(member, kind) else None


def _has_bare_axes(member: Member) -> bool:
    """Whether a table names columns x, y and z."""
    fields = [f.strip() for f in fields_of(first_line(member))]
    return sorted(m[1].lower() for f in fields if (m := _AXIS.fullmatch(f))) == [*AXES]


def _has_axes(member: Member, triad: str) -> bool:
    """Whether a table names axes, bare or as those of its sensor and of no other."""
    if _has_bare_axes(member):
        return True
    fields = [f.strip() for f in fields_of(first_line(member))]
    said = [str(read_name(name).quantity) for name in of_arrays(fields)]
    of_sensors = sorted(q for q in said if q.partition("_")[0] in _TRIADS)
    return of_sensors == [f"{triad}_{axis}" for axis in AXES]


def _log(member: Member) -> RawLog:
    raw = csv.parse(member.read(), member.label, (member.file,))
    triad = _triad(member)
    plain = {n: m[1].lower() for n in raw.columns if (m := _AXIS.fullmatch(n.strip()))}
    if sorted(plain.values()) != [*AXES]:
        return raw
    stated: dict[str, tuple[str, str | None]] = {
        c.source: (q, c.unit) for q, c in find_columns(raw, ReadOptions()).items()
    }
    for column, axis in plain.items():
        unit = read_name(column).unit or read_name(member.stem).unit
        stated[column] = (f"{triad}_{axis}", unit)
    if clock := _since_1970(raw):
        stated = {c: said for c, said in stated.items() if said[0] != "time"}
        stated[clock] = ("time", read_name(clock).unit)
    return dataclasses.replace(raw, stated=stated)


def _since_1970(raw: RawLog) -> str | None:
    """Return the column whose stamps count since 1970, in the unit of its name."""
    for name, values in raw.columns.items():
        said = read_name(name)
        if said.quantity != "time" or said.unit not in TIME_UNITS or values.dtype.kind not in "if":
            continue
        if EPOCH[0] <= float(values[0]) * TIME_UNITS[said.unit] <= EPOCH[1]:
            return name
    return None


# Uniform access to the files of a folder or the members of a zip archive.


HEAD = 4096  # bytes in which the first line is searched
#: Most tables of a recording. Loggers write one a sensor, some forty; each is opened several times.
MOST_TABLES = 200


@dataclass(frozen=True)
class Member:
    """A file of a folder, or a member of an archive.

    `name`: path inside the folder or archive, with slashes. `label`: given path and name, for
    messages. `file`: the file on disk that holds it.
    """

    name: str
    label: str
    file: Path
    archived: bool

    @property
    def stem(self) -> str:
        """Last part of the name without its suffix."""
        return PurePosixPath(self.name).stem

    @property
    def suffix(self) -> str:
        """Suffix of the name, in lower case."""
        return PurePosixPath(self.name).suffix.lower()

    def read(self) -> bytes:
        """Read the whole content.

        DataError: the file cannot be read, or declares more data than is stored.
        """
        return self._bytes(-1)

    def first_line(self) -> str:
        """Return the first non-blank line, up to `HEAD` bytes."""
        data = self._bytes(HEAD)
        wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = data.decode("utf-16" if wide else "utf-8-sig", "replace")
        return next((line for line in text.splitlines() if line.strip()), "")

    def _bytes(self, count: int) -> bytes:
        if self.archived:
            if count == HEAD and self.suffix in csv.SUFFIXES:
                data = _heads(self.file).get(self.name)
                if data is not None:
                    return data
            data = parse(
                "archives.member", self.file, label=self.label, name=self.name, count=count
            )
            return bytes(data)
        try:
            with self.file.open("rb") as stream:
                return stream.read(count)
        except OSError as error:
            raise DataError("io.member-unreadable", file=self.label, error=error) from None


@while_unchanged(2)
def _heads(archive: Path) -> dict[str, bytes | None]:
    """Return the beginning of each table: detection asks for those of all, once a format."""
    tables = [m.name for m in _listed(archive) if m.suffix in csv.SUFFIXES][:MOST_TABLES]
    heads = parse("archives.heads", archive, members=tables, count=HEAD)
    return dict(zip(tables, heads, strict=False))


def is_container(path: Path) -> bool:
    """Whether this is a folder, or has the name of a zip archive."""
    return path.is_dir() or (path.is_file() and path.suffix.lower() == ".zip")


def members_of(path: Path) -> list[Member]:
    """List the files of a folder and of its folder ``meta``, or the members of an archive.

    Returns sorted by name; files that macOS adds to archives are left out. DataError: the archive
    is damaged, or there are more than `MOST_TABLES` tables.
    """
    found = _listed(path)
    tables = _tables_in(found)
    if tables > MOST_TABLES:
        raise DataError(
            "io.too-many-members", file=path.resolve().name, count=tables, most=MOST_TABLES
        )
    return found


def _tables_in(members: list[Member]) -> int:
    return sum(m.suffix in csv.SUFFIXES for m in members)


def _listed(path: Path) -> list[Member]:
    whole = path.resolve().name
    if path.is_dir():
        found = sorted(p for f in (path, path / "meta") if f.is_dir() for p in f.iterdir())
        return [
            Member(name, f"{whole}/{name}", p, False)
            for p in found
            if p.is_file() and not (name := p.relative_to(path).as_posix()).startswith(".")
        ]
    return [
        Member(n, f"{whole}/{n}", path, True)
        for n in _names(path)
        if not any(part.startswith((".", "__MACOSX")) for part in PurePosixPath(n).parts)
    ]


@while_unchanged(2)
def _names(path: Path) -> tuple[str, ...]:
    return tuple(parse("archives.names", path, label=path.resolve().name))


def peek(path: Path) -> list[Member]:
    """List members for format detection; none if not a container or unreadable."""
    try:
        return members_of(path) if is_container(path) else []
    except (DataError, OSError):
        return []


def first_line(member: Member) -> str:
    """Return the first line of a member for format detection; empty if unreadable."""
    try:
        return member.first_line()
    except DataError:
        return ""


def file_member(path: Path) -> Member:
    """Wrap a single file as a member."""
    return Member(path.name, path.name, path, False)
