"""Assignment of the columns of a file to quantities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from strapdown.errors import ConfigError, DataError
from strapdown.formats.columns import (
    BODY_RATES,
    INDEXED,
    QUANTITIES,
    TRIADS,
    read_name,
    says_increment,
)
from strapdown.formats.recording import RawLog, ReadOptions, as_stated
from strapdown.units import unit_of

AXES = "xyz"


@dataclass(frozen=True)
class Column:
    """The column of a file that holds a quantity."""

    source: str
    unit: str | None
    why: str


def find_columns(raw: RawLog, options: ReadOptions) -> dict[str, Column]:
    """Find the column of each quantity.

    `options`: its `columns` override what the file states, which overrides column names. Returns
    quantity to column; quantities that were not found are absent. ConfigError: two columns fit one
    quantity, or an option names a column that does not exist.
    """
    found = {
        quantity: Column(source, unit, "stated by the file")
        for source, (quantity, unit) in raw.stated.items()
        if source in raw.columns
    }
    if not raw.stated:
        found |= _by_name(raw, options)
    asked: dict[str, str] = {}
    for quantity, source in options.columns.items():
        if quantity not in QUANTITIES and quantity not in TRIADS:
            raise ConfigError(
                "io.unknown-quantity",
                quantity="--columns",
                of_what=quantity,
                word=quantity,
                known=[*QUANTITIES, *TRIADS],
            )
        for q, name in _asked(raw, quantity, source):
            if name in asked.values():
                raise ConfigError(
                    "io.column-named-twice",
                    file=raw.name,
                    quantity=f"--columns {q}",
                    name=name,
                )
            asked[q] = name
            stated = found[q].unit if q in found and found[q].source == name else None
            found[q] = Column(name, _unit_of(raw, name) or stated, "stated by --columns")
    return found


def names_of_quantities(raw: RawLog) -> set[str]:
    """List the quantities that a log states, or that the names of its columns say."""
    if raw.stated:
        return {quantity for quantity, _ in raw.stated.values()}
    return {str(read_name(name).quantity) for name in raw.columns}


def require_gyro(raw: RawLog, found: dict[str, Column]) -> None:
    """Refuse a log without three rates; the message lists its columns."""
    missing = [f"gyro_{a}" for a in AXES if f"gyro_{a}" not in found]
    if not missing:
        return
    if raw.columns and all(name == f"column {k}" for k, name in enumerate(raw.columns, 1)):
        _refuse_nameless(raw)
    left_out = [f for f in raw.findings if f.code.startswith("io.left-out")]
    raise DataError(
        "io.no-gyro-columns-left-out" if left_out else "io.no-gyro-columns",
        file=raw.name,
        missing=missing,
        columns=list(raw.columns) or ["none"],
        left_out=left_out,
    )


def _refuse_nameless(raw: RawLog) -> NoReturn:
    """Refuse columns without names, and show values by which the user can identify them."""
    example = "time=1,gyro_x=2,gyro_y=3,gyro_z=4"
    if len(raw.columns) >= 7:
        example += ",accel_x=5,accel_y=6,accel_z=7"
    # Seven columns are usually increments of KF-GINS.
    raise DataError(
        "io.nameless-seven-columns" if len(raw.columns) == 7 else "io.nameless-columns",
        file=raw.name,
        row=raw.row(0),
        count=len(raw.columns),
        first=[f"{k}: {column[0]}" for k, column in enumerate(raw.columns.values(), 1)],
        example=example,
    )


def _by_name(raw: RawLog, options: ReadOptions) -> dict[str, Column]:
    candidates: dict[str, list[str]] = {}
    for name in raw.columns:
        quantity = read_name(name).quantity
        if quantity is None or quantity in TRIADS:
            continue
        # An array of four need not begin with x, y and z.
        if (part := INDEXED.fullmatch(name)) and _width(raw, part.group(1)) != 3:
            continue
        candidates.setdefault(quantity, []).append(name)
    if BODY_RATES.keys() <= candidates.keys() and "gyro_x" not in candidates:
        candidates |= {gyro: candidates[rate] for rate, gyro in BODY_RATES.items()}
    for rate in BODY_RATES:
        candidates.pop(rate, None)
    asked = {q for key in options.columns for q in _members(key)}
    found = {}
    several: dict[str, list[str]] = {}
    for quantity, names in candidates.items():
        if quantity in asked:
            continue
        if len(names) > 1 and quantity == "time":
            names = _one_clock(raw, names)
        # Names read without their order are a last resort.
        names = [n for n in names if not read_name(n).loose] or names
        if len(names) > 1:
            # Rates are preferred to increments.
            names = [n for n in names if not says_increment(n)] or names
        if len(names) > 1:
            several[quantity] = names
        found[quantity] = Column(names[0], _unit_of(raw, names[0]), "by its name")
    if several:
        quantity, names = next(iter(several.items()))
        raise ConfigError(
            "io.columns-ambiguous",
            file=raw.name,
            quantity=quantity,
            count=len(names),
            names=names,
            of_what=quantity,
            names_2=names[0],
            **as_stated(_first_of_several(raw, several)),
        )
    return found


def _first_of_several(raw: RawLog, several: dict[str, list[str]]) -> dict[str, str]:
    """Answer which columns to use by the first of each; a triad by what its names begin with."""
    answers: dict[str, str] = {}
    for quantity, names in several.items():
        triad = quantity.rpartition("_")[0]
        if triad not in TRIADS:
            answers[quantity] = names[0]
        elif triad not in answers:
            prefix = names[0].rstrip("xyzXYZ").rstrip("_-. /:[(")
            whole = len(_three_of(raw, triad, prefix)) == 3
            answers |= {triad: prefix} if whole else {quantity: names[0]}
    return answers


def _one_clock(raw: RawLog, names: list[str]) -> list[str]:
    """Return the clock to use of several: one of the samples, then one that states its unit.

    A message that was recorded by another program has the stamp of its sender and that of its
    arrival. Clocks that advance alike are one clock.
    """
    names = [n for n in names if n.lower().endswith("header.stamp")] or names
    names = [n for n in names if _unit_of(raw, n)] or names
    if len(names) > 1 and all(raw.columns[n].dtype.kind in "iuf" for n in names):
        steps = [np.diff(raw.columns[n].astype(np.float64)) for n in names]
        scaled = [s / s.mean() if s.size and s.mean() > 0.0 else None for s in steps]
        first = scaled[0]
        if first is not None and all(
            s is not None and np.allclose(s, first, rtol=0.0, atol=1e-2) for s in scaled[1:]
        ):
            return names[:1]
    return names


def _unit_of(raw: RawLog, column: str) -> str | None:
    if column in raw.units:
        return unit_of(raw.units[column])
    return read_name(column).unit


def _members(quantity: str) -> list[str]:
    return [f"{quantity}_{a}" for a in AXES] if quantity in TRIADS else [quantity]


def _asked(raw: RawLog, quantity: str, source: str) -> list[tuple[str, str]]:
    """Resolve one ``quantity=source`` of the user to existing columns."""
    names = list(raw.columns)
    if quantity in TRIADS:
        if members := _three_of(raw, quantity, source):
            return list(zip(_members(quantity), members, strict=True))
    elif source in raw.columns:
        return [(quantity, source)]
    elif source.isdecimal() and 1 <= int(source) <= len(names):
        return [(quantity, names[int(source) - 1])]
    raise ConfigError(
        "io.no-such-column",
        file=raw.name,
        quantity=f"--columns {quantity}",
        source=source,
        word=source,
        known=names,
    )


def _width(raw: RawLog, array: str) -> int:
    return sum(name.startswith(f"{array}[") for name in raw.columns)


def _three_of(raw: RawLog, quantity: str, source: str) -> list[str]:
    """Resolve an array of three, three columns of a wider array, or three names in x, y, z."""
    base, _, index = source.partition("[")
    width = _width(raw, base)
    if width > 3 and not index:
        raise ConfigError(
            "io.columns-of-array",
            file=raw.name,
            quantity=f"--columns {quantity}",
            source=source,
            width=width,
            of_what=quantity,
            width_2=width - 3,
        )
    if width >= 3 and (not index or index.rstrip("]").isdecimal()):
        first = int(index.rstrip("]")) if index else 0
        members = [f"{base}[{first + k}]" for k in range(3)]
        return members if all(m in raw.columns for m in members) else []
    found = []
    for axis in AXES:
        names = [n for n in raw.columns if _is_axis(n, source, axis)]
        if len(names) != 1:
            return []
        found += names
    return found


def _is_axis(name: str, prefix: str, axis: str) -> bool:
    """Whether a name is the prefix and one axis, ignoring units and case."""
    said = read_name(name).quantity
    plain = name.lower()
    if not plain.startswith(prefix.lower()):
        return False
    rest = plain[len(prefix) :].lstrip("_-. /:[(")
    return (
        rest[:1] == axis
        and (said is None or said.endswith(f"_{axis}") or rest == axis)
        and (len(rest) == 1 or not rest[1].isalnum())
    )
