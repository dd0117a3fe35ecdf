"""Assignment of the columns of a file to quantities."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError, check_choice
from strapdown.formats.arrays import STEP_OF_FIXES, is_stamp, numbers, ticks_of
from strapdown.formats.clocks import clock_of_name, is_count
from strapdown.formats.columns import (
    DELSYS_CLOCK,
    INDEXED,
    UNKNOWN_WORDS,
    ColumnName,
    clocks_with_unit,
    parts_in,
    read_name,
    split_brackets,
)
from strapdown.formats.recording import INFERRED, STATED, Questions, RawLog, ReadOptions
from strapdown.formats.vocabularies import (
    BODY_RATES,
    FIXES,
    OVER_GROUND,
    QUANTITIES,
    ROS,
    TRIADS,
    Quantity,
    Vocabulary,
)
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, OF_TABLES, find_unit, unit_of

AXES = "xyz"


#: What assigns a column to its quantity.
Basis = Literal["name", "file", "option", "numbers", "open"]
_WHY: dict[Basis, str] = {
    "name": "by its name",
    "file": "stated by the file",
    "option": STATED,
    "open": INFERRED,
    "numbers": "inferred",
}


@dataclass(frozen=True)
class Column:
    """The column of a file that holds a quantity.

    `basis` ({'name', 'file', 'option', 'numbers', 'open'}): what assigns it to the quantity.
    `sign`: -1 of a column that counts the other way, which the user names with a minus.
    """

    source: str
    unit: str | None
    basis: Basis
    sign: float = 1.0

    @property
    def why(self) -> str:
        """The basis in words, as a `Reading` shows it."""
        return _WHY[self.basis]

    @property
    def written(self) -> str:
        """The column as the user names it: with its minus."""
        return f"-{self.source}" if self.sign < 0.0 else self.source

    def values(self, raw: RawLog, quantity: str) -> NDArray[Any]:
        """Return the numbers of the quantity in the column's unit; as `numbers`."""
        found = numbers(raw, self.source, quantity)
        return found if self.sign > 0.0 else -np.asarray(found, dtype=np.float64)


def find_columns(
    raw: RawLog, options: ReadOptions, questions: Questions | None = None
) -> dict[str, Column]:
    """Find the column of each quantity.

    `options`: its `columns` override what the file states, which overrides column names.
    `questions`: where several columns fit one quantity, or names leave it open, the user is asked,
    and the first is returned meanwhile. Without it this is refused at once. Returns quantity to
    column; quantities that were not found are absent. ConfigError: an option names a column that
    does not exist. DataError: two columns fit one quantity.
    """
    asked_here = questions or Questions(raw.name)
    wanted: dict[str, str] = {}
    signs: dict[str, float] = {}
    inferred: set[str] = set()
    for quantity, source in options.columns.items():
        if quantity not in QUANTITIES and quantity not in TRIADS:
            raise ConfigError(
                "io.unknown-quantity",
                quantity="--columns",
                of_what=quantity,
                word=quantity,
                known=[*QUANTITIES, *TRIADS],
            )
        triad = quantity.partition("_")[0]
        itself = triad not in TRIADS or (quantity in TRIADS and _three_of(raw, quantity, source))
        plain, sign = (source, 1.0) if itself else _without_minus(source, raw.columns)
        for q, name in _asked(raw, quantity, plain):
            if name in wanted.values():
                raise ConfigError(
                    "io.column-named-twice", file=raw.name, quantity=f"--columns {q}", name=name
                )
            wanted[q], signs[q] = name, sign
            inferred |= {q} if quantity in options.inferred else set()
    # Triads that are not asked for are those of the unit of which one is.
    of_units = (unit for unit in raw.other_units if not set(wanted.values()).isdisjoint(unit))
    stated_columns = next(of_units, raw.stated)
    found = {
        quantity: Column(source, unit, "file")
        for source, (quantity, unit) in stated_columns.items()
        if source in raw.columns
    }
    if not raw.stated:
        found |= _by_name(raw, wanted, asked_here)
        likely = _likely_columns(raw) if not wanted and _is_nameless(raw) else {}
        if likely or (not wanted and _is_nameless(raw) and (likely := _by_motion(raw))):
            asked_here.ask(_nameless(raw, likely), **likely)
            names = list(raw.columns)
            found |= {q: Column(names[int(k) - 1], None, "numbers") for q, k in likely.items()}
    for q, name in wanted.items():
        stated = found[q].unit if q in found and found[q].source == name else None
        basis: Basis = "open" if q in inferred else "option"
        found[q] = Column(name, unit_stated(raw, name) or stated, basis, signs[q])
    if not (raw.stated or wanted.keys() & {"gyro_x", "accel_x"}):
        _ask_parts(raw, found, asked_here)
    if questions is None:
        asked_here.refuse()
    return found


def _ask_parts(raw: RawLog, found: Mapping[str, Column], questions: Questions) -> None:
    """Ask whether a gyro and an accelerometer of different parts of a body belong together."""
    if not {"gyro_x", "accel_x"} <= found.keys():
        return
    gyro, accel = (parts_in(found[f"{triad}_x"].source) for triad in ("gyro", "accel"))
    if gyro and accel and not gyro & accel:
        names = [found[f"{t}_{a}"].source for t in ("gyro", "accel") for a in AXES]
        columns = {
            f"{t}_{a}": reference(raw, found[f"{t}_{a}"].source)
            for t in ("gyro", "accel")
            for a in AXES
            if f"{t}_{a}" in found
        }
        fault = Finding(
            "io.sensors-of-different-parts",
            file=raw.name,
            quantity="accel",
            gyro=" ".join(sorted(gyro)),
            accel=" ".join(sorted(accel)),
            names=names,
        )
        questions.ask(fault, **columns)


def as_found(raw: RawLog, found: Mapping[str, Column]) -> RawLog:
    """Return a log that states the columns that were found; those with a minus are reversed."""
    turned = {c.source: c for c in found.values() if c.sign < 0.0}
    names = {name: turned[name].written if name in turned else name for name in raw.columns}
    columns = {
        names[name]: turned[name].values(raw, name) if name in turned else values
        for name, values in raw.columns.items()
    }
    units = {names.get(name, name): unit for name, unit in raw.units.items()}
    stated = {c.written: (q, c.unit) for q, c in found.items()}
    return replace(raw, columns=columns, units=units, stated=stated)


def _without_minus(name: str, columns: Iterable[str]) -> tuple[str, float]:
    """Split the minus off a column that counts the other way; a column may have that name."""
    turned = name.startswith("-") and name not in columns
    return (name[1:], -1.0) if turned else (name, 1.0)


def names_of_quantities(raw: RawLog) -> set[str]:
    """List the quantities that a log states, or that the names of its columns say."""
    if raw.stated:
        return {quantity for quantity, _ in raw.stated.values()}
    return {str(read_name(name).quantity) for name in raw.columns}


def without_gyro(raw: RawLog, missing: list[str]) -> DataError:
    """Make the error for a log without three rates; the message lists its columns."""
    if _is_nameless(raw):
        return _of_empatica(raw) or DataError(_nameless(raw, {}))
    said = {
        name: raw.stated[name][0] if name in raw.stated else str(read_name(name).quantity)
        for name in raw.columns
    }
    force = [n for n, q in said.items() if q.startswith("accel_")]
    if [*raw.triad_units] == ["accel"] and {*AXES} <= {n.strip().lower() for n in said}:
        force = [n for n in said if n.strip().lower() in {*AXES}]  # said above the table
        said |= {n: f"accel_{n.strip().lower()}" for n in force}
    force = force if {said[n][-1] for n in force} == set(AXES) else _letters_of_g(raw, said)
    if not force and len(words := [n for n in said if _OF_FORCES.search(n)]) == len(AXES):
        force = words  # of axes in words: Accelerometer (up/down)
    # The letter g alone is as often a force.
    other = [n for n in said if n not in force and read_name(n).family not in ("g", "g#")]
    if force and not any(said[n].startswith("gyro") or _OF_RATES.search(n) for n in other):
        name = raw.files[0].name if raw.files else raw.name
        return raw.fault("io.accelerometer-alone", "gyro", names=force, log=name)
    left_out = [f for f in raw.findings if f.code.startswith("io.left-out")]
    return raw.fault(
        "io.no-gyro-columns-left-out" if left_out else "io.no-gyro-columns",
        missing=missing,
        columns=list(raw.columns) or ["none"],
        left_out=left_out,
    )


#: Words of a rate of turn, in names that are not understood.
_OF_RATES = re.compile(
    r"gyr|angul|ang[\W_]?(?:vel|rate)|rotat|(?<![a-z])(?<!heart[\W_])rates?(?![a-z])|omega|ω|dps|(?:deg|rad|°)/s",
    re.I,
)


#: An accelerometer, in names whose axes are not understood.
_OF_FORCES = re.compile(r"accelerometer|acceleration", re.I)
#: Seconds since 1970 of a start, and largest rate, in the rows of Empatica.
STARTS, MOST_RATE = (1e9, 4e9), 1e3


def _of_empatica(raw: RawLog) -> DataError | None:
    """Make the error for a table whose first two rows are its start and its rate."""
    columns = list(raw.columns.values())
    if any(c.dtype.kind not in "iuf" or c.size < 3 for c in columns):
        return None
    start, rate = (np.array([float(c[k]) for c in columns]) for k in (0, 1))
    if np.ptp(start) or np.ptp(rate) or not STARTS[0] < start[0] < STARTS[1]:
        return None
    if not 0.0 < rate[0] <= MOST_RATE:
        return None
    return raw.fault("io.of-empatica", start=start[0], rate=rate[0])


def _letters_of_g(raw: RawLog, said: Mapping[str, str]) -> list[str]:
    """Return the columns of the letter g, read as rates, if they show gravity instead."""
    three = [n for a in AXES for n, q in said.items() if q == f"gyro_{a}"]
    whole = len(three) == len(AXES) and all(read_name(n).family == "g" for n in three)
    return three if whole and _shows_gravity(raw, three) else []


#: Least share of the changes of a triad that another one's explain, if it is a copy of it.
COPIED = 0.8


def _follows(raw: RawLog, names: list[str], others: list[str]) -> bool:
    """Whether three columns change as three others do, in another scale: rates and forces do not.

    The constants alone, of a turn about the vertical, show nothing.
    """
    three, other = ([raw.columns[n] for n in some] for some in (names, others))
    if any(c.dtype.kind not in "iuf" for c in (*three, *other)):
        return False
    a, b = (np.column_stack(some).astype(np.float64) for some in (three, other))
    fine = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    if not fine.any():
        return False
    a, b = (x[fine] - x[fine].mean(axis=0) for x in (a, b))
    size = float((a * a).sum()) * float((b * b).sum())
    both = float((a * b).sum())
    return size > 0.0 < both and both * both > COPIED * size


def _is_nameless(raw: RawLog) -> bool:
    """Whether no column has a name."""
    return bool(raw.columns) and all(n == f"column {k}" for k, n in enumerate(raw.columns, 1))


def _nameless(raw: RawLog, likely: dict[str, str]) -> Finding:
    """Describe columns without names, by values by which the user can identify them."""
    from strapdown.formats.crash_records import CRASH_READERS

    if raw.files and CRASH_READERS["nhtsa"].detect(raw.files[0]):
        return Finding("io.crash-test-file", severity="error", file=raw.name)
    code = "io.nameless-columns" if likely else "io.nameless-columns-open"
    likely = likely or _in_usual_order(raw)
    example = ",".join(f"{quantity}={column}" for quantity, column in likely.items())
    # Seven columns are usually increments of KF-GINS.
    return Finding(
        "io.nameless-seven-columns" if len(raw.columns) == 7 else code,
        severity="error",
        file=raw.name,
        row=raw.row(0),
        count=len(raw.columns),
        first=[f"{k}: {column[0]}" for k, column in enumerate(raw.columns.values(), 1)],
        example=example,
    )


def _in_usual_order(raw: RawLog) -> dict[str, str]:
    """Number the columns as many logs have them: a clock, which no words are, rates, forces."""
    kinds = [column.dtype.kind for column in raw.columns.values()]
    out = {"time": "1"} if kinds[0] in "iufM" and len(kinds) > len(AXES) else {}
    words = next((k for k, kind in enumerate(kinds) if kind in "iuf"), 0)
    first = 2 if out else words + 1 if kinds[0] not in "iufM" else 1
    triads = ("gyro", "accel") if len(kinds) >= first + 5 else ("gyro",)
    quantities = [f"{triad}_{axis}" for triad in triads for axis in AXES]
    numbered = zip(quantities, range(first, len(kinds) + 1), strict=False)
    return out | {quantity: str(k) for quantity, k in numbered}


#: Ranges of the median norm of an accelerometer in m/s², g and mg, and most of its spread between
#: the first and the last decile, relative to the median.
GRAVITIES, LOOSEST = ((8.8, 10.8), (0.9, 1.1), (900.0, 1100.0)), 0.5
#: Spread below which a norm may be that of a magnetometer, or of an accelerometer in any unit.
STEADY = 0.05
#: Most spread of a walk, beside a triad whose norm spreads so many times more.
VIOLENT, APART = 1.0, 3.0


#: Largest median norm of a triad that may be an accelerometer: of counts of 16 bits, three axes.
LARGEST_NORM = 6e4


def _is_gravity(norm: float) -> bool:
    """Whether a median norm is that of gravity, in m/s², g or mg."""
    return any(low < norm < high for low, high in GRAVITIES)


def _shows_gravity(raw: RawLog, names: list[str]) -> bool:
    """Whether the norm of three columns is that of gravity."""
    three = [raw.columns[n] for n in names]
    if any(c.dtype.kind not in "iuf" for c in three):
        return False
    norm, spread = norm_and_spread(three)
    return _is_gravity(norm) and spread < LOOSEST


def norm_and_spread(three: list[NDArray[Any]]) -> tuple[float, float]:
    """Return the median norm of three columns, and its spread between deciles, relative to it."""
    some = 1 + three[0].size // 100_000
    norms = np.linalg.norm(np.column_stack([c[::some] for c in three]).astype(np.float64), axis=1)
    norms = norms[np.isfinite(norms)]
    if not norms.size:
        return 0.0, 0.0
    low, usual, high = map(float, np.quantile(norms, (0.1, 0.5, 0.9)))
    return usual, (high - low) / usual if usual else 0.0


def steady_triads(raw: RawLog, names: list[str]) -> list[tuple[list[str], float]]:
    """Return triads of columns of unknown names whose norm is that of gravity, or steady.

    `names`: columns without a quantity. Three belong together if their names differ in a letter x,
    y or z, or in a number that counts; the vector of a quaternion, whose norm is steady too, has a
    fourth beside it. Returns the names, and the median norm.
    """
    out: list[tuple[list[str], float]] = []
    for name in names:
        for match in _FIRST.finditer(name):
            letters = next(s for s in _SERIES if s[0] == match[0])
            three = [name[: match.start()] + letter + name[match.end() :] for letter in letters]
            fourth = {"x": "wW", "X": "wW", "0": "3", "1": "04"}[match[0]]
            beside = {name[: match.start()] + letter + name[match.end() :] for letter in fourth}
            if not set(three) <= set(names) or beside & raw.columns.keys():
                continue
            columns = [raw.columns[n] for n in three]
            if any(c.dtype.kind not in "iuf" for c in columns):
                continue
            if any(read_name(n).quantity for n in three):
                continue
            norm, spread = norm_and_spread(columns)
            gravity = _is_gravity(norm)
            if 0.0 < norm < LARGEST_NORM and spread < (LOOSEST if gravity else STEADY):
                out.append((three, norm))
                break
    return out


def _likely_columns(raw: RawLog) -> dict[str, str]:
    """Guess the numbers of nameless columns: a clock, then triads, of which one shows gravity.

    The rates are the triad beside it; empty where more than one reading fits.
    """
    columns = list(raw.columns.values())
    clock = next((k for k, c in enumerate(columns) if c.dtype.kind in "iufM" and advances(c)), None)
    if clock is None:
        first = next((k for k, c in enumerate(columns) if c.dtype.kind in "iuf"), 0)
    else:
        first = clock + 1
    triads: dict[int, tuple[float, float]] = {}
    for k in range(first, len(columns) - 2, 3):
        three = columns[k : k + 3]
        if any(c.dtype.kind not in "iuf" for c in three):
            break
        if not any((c == c[0]).all() for c in three):  # a flag is no axis
            triads[k] = norm_and_spread(three)
    forces = [k for k, (usual, spread) in triads.items() if spread < LOOSEST and _is_gravity(usual)]
    if len(forces) != 1 and len(triads) == 2:
        # Of two, the norm of rates varies about that of their noise; a force is in any unit.
        steady, other = sorted(triads, key=lambda k: triads[k][1])
        (usual, spread), (_, varied) = triads[steady], triads[other]
        gravity = _is_gravity(usual)
        sure = usual > 0.0 and spread < (VIOLENT if gravity else STEADY) and varied > APART * spread
        forces = [steady] if sure else forces
    if len(forces) != 1:
        return {}
    force = forces[0]
    turns = [k for k in (force - 3, force + 3) if k in triads and triads[k][0] > 0.0]
    if len(triads) > 2:
        turns = [k for k in turns if triads[k][1] > STEADY]
    if len(turns) != 1:
        return {}
    out = {} if clock is None else {"time": str(clock + 1)}
    for triad, at in (("gyro", turns[0]), ("accel", force)):
        out |= {f"{triad}_{axis}": str(at + k + 1) for k, axis in enumerate(AXES)}
    return out


def _by_motion(raw: RawLog) -> dict[str, str]:
    """Guess the numbers of nameless columns by the motion; empty where it shows no pair."""
    columns = list(raw.columns.values())
    found = rates_and_force(columns)
    if found is None:
        return {}
    clock = next((k for k, c in enumerate(columns) if c.dtype.kind in "iufM" and advances(c)), None)
    out = {} if clock is None or clock >= min(found) else {"time": str(clock + 1)}
    for triad, at in zip(("gyro", "accel"), found, strict=True):
        out |= {f"{triad}_{axis}": str(at + k + 1) for k, axis in enumerate(AXES)}
    return out


# Gyro and accelerometer among columns without names, by the motion of a body: the specific force of
# one that turns, and is not shaken, turns against it: df/dt = -w x f. Of all triads of neighboring
# columns, the gyro and the accelerometer of one unit fulfil it.


#: Most columns and samples that are compared; samples of one change of the force: of seconds, in
#: which a hand turns it more than it shakes it, at 10 to 200 Hz.
COMPARED, MOST_SAMPLES, SPANS = 64, 6000, (25, 100, 200)
#: Fewest changes that are compared.
FEWEST_CHANGES = 8
#: Least share of the changes that a gyro explains, and how far below the best the first may be.
LEAST, NEAR = 0.8, 0.1
#: Largest error of the norm of a quaternion: of four numbers written with three decimals.
UNIT_NORM = 2e-3
#: Least turn of a force in all, rad.
TURNED = 0.05


def rates_and_force(columns: list[NDArray[np.generic]]) -> tuple[int, int] | None:
    """Return the numbers, from 0, of the first columns of the gyro and of the accelerometer.

    `columns` ((n,) each): a column that is not a number is None of a triad. None where no pair of
    triads explains the motion.
    """
    held = [_varied(c) for c in columns[:COMPARED]]
    for k in _of_quaternions(columns[:COMPARED]):
        held[k] = None
    triads: dict[int, Array] = {}
    for k in range(len(held) - 2):
        columns_of = [c for c in held[k : k + 3] if c is not None]
        if len(columns_of) == 3:
            triads[k] = np.column_stack(columns_of)
    forces = {}
    for k, three in triads.items():
        low, usual, high = np.quantile(np.linalg.norm(three, axis=1), (0.1, 0.5, 0.9))
        if usual > 0.0 and (high - low) < LOOSEST * usual:
            forces[k] = three
    shares: dict[tuple[int, int], float] = {}
    for at, force in forces.items():
        for k, rate in triads.items():
            if abs(k - at) >= 3:
                turned = -np.cross(rate, force)
                shares[k, at] = max(_explained(turned, force, span) for span in SPANS)
    best = max(shares.values(), default=0.0)
    if best < LEAST:
        return None
    return min(pair for pair, share in shares.items() if share > best - NEAR)


def _of_quaternions(columns: list[NDArray[np.generic]]) -> set[int]:
    """Return the numbers of columns of which four neighbors are a quaternion of unit norm.

    Its parts turn, too, and three of them may have a steady norm.
    """
    out: set[int] = set()
    for k in range(len(columns) - 3):
        four = columns[k : k + 4]
        if all(c.dtype.kind == "f" for c in four):
            values = np.column_stack([c[:MOST_SAMPLES] for c in four]).astype(np.float64)
            off = np.abs(np.linalg.norm(values, axis=1) - 1.0)
            out |= set(range(k, k + 4)) if bool((off < UNIT_NORM).all()) else set()
    return out


def _explained(turned: Array, force: Array, span: int) -> float:
    """Return the share of a force's changes that its turning explains, by one positive factor.

    `turned` ((n, 3)): -w x f; the step of time, and the unit of the rates, are in the factor.
    """
    change = force[span::span] - force[:-span:span]
    if len(change) < FEWEST_CHANGES:
        return 0.0
    turn = float(np.linalg.norm(change, axis=1).sum()) / float(np.abs(force).max())
    if turn < TURNED:
        return 0.0
    model = turned[: len(change) * span].reshape(len(change), span, 3).sum(axis=1)
    size, both = float((model * model).sum()), float((model * change).sum())
    return both * both / (size * float((change * change).sum())) if size > 0.0 < both else 0.0


def _varied(column: NDArray[np.generic]) -> Array | None:
    """Return the first values of a column that is a number and not constant; None otherwise."""
    if column.dtype.kind not in "iuf" or column.size < FEWEST_CHANGES * SPANS[0]:
        return None
    values = np.asarray(column[:MOST_SAMPLES], dtype=np.float64)
    return values if bool(np.isfinite(values).all()) and np.ptp(values) > 0.0 else None


def is_of_series(raw: RawLog, name: str) -> bool:
    """Whether a column is the first of several that differ in a letter or a number that counts."""
    return any(
        name[: m.start()] + chr(ord(m[0]) + 1) + name[m.end() :] in raw.columns
        for m in _FIRST.finditer(name)
    )


def advances(values: NDArray[Any]) -> bool:
    """Whether a column advances evenly, as a clock does; a count of samples, by one, does not."""
    if values.size < 3:
        return False
    whole = values.dtype.kind == "M"
    steps: NDArray[Any] = np.diff(values.astype(np.int64) if whole else values.astype(np.float64))
    usual = float(np.median(steps))
    even = np.mean(np.abs(steps - usual) <= 0.5 * usual)
    forward = bool((steps >= 0).all()) and not is_count(values)
    return usual > 0.0 and forward and bool(even > 0.9)


#: Names of three axes, and the first one in a name: no letter or digit of its kind beside it.
_SERIES = ("xyz", "XYZ", "012", "123")
_FIRST = re.compile(r"[xX]|(?<!\d)[01](?!\d)")
#: The letter of an axis at the end of a name, or before its unit.
_LAST = re.compile(r"[xyzXYZ](?=\W*$|[\s_]*[\[(])")
#: Columns of one sensor, by axis.
Family = dict[str, str]


def _by_name(raw: RawLog, wanted: dict[str, str], questions: Questions) -> dict[str, Column]:
    """Find the columns of the quantities that the user did not state."""
    said = {name: read_name(name) for name in raw.columns}
    for quantity, name in wanted.items():
        if str(said[name].quantity).partition("_")[0] != quantity.partition("_")[0]:
            said[name] = ColumnName(None)
    found: dict[str, str] = {}
    for name, one in said.items():
        # The vector of a quaternion: rot_w is beside rot_x.
        letter = {
            name[: m.start()] + w + name[m.end() :] for m in _LAST.finditer(name) for w in "wW"
        }
        if "rot" in one.family and letter & said.keys():
            said[name] = ColumnName(None)
    families = _families(raw, said)
    if ("gyro", "g") in families:
        _letter_g(raw, families, wanted, questions, found)
    of_triads = {t: _best({f: m for (k, f), m in families.items() if k == t}, said) for t in TRIADS}
    shared = frozenset.intersection(
        *(
            frozenset().union(*(parts_in(next(iter(m.values()))) for m in of_triads[t].values()))
            for t in ("gyro", "accel")
        )
    )
    for triad, kept in of_triads.items():
        if not kept:
            continue
        # Of several parts of a body, those that have a gyro and an accelerometer.
        paired = {f: m for f, m in kept.items() if parts_in(next(iter(m.values()))) & shared}
        kept = paired or kept
        # In a file of several units, those of the unit whose columns are asked for.
        inside = {n.rpartition("/")[0] for q, n in wanted.items() if q[:-2] in TRIADS} - {""}
        of_unit = {
            f: m for f, m in kept.items() if next(iter(m.values())).rpartition("/")[0] in inside
        }
        kept = of_unit or kept
        # Of a simulation, the sensor rather than its truth.
        kept = dict(sorted(kept.items(), key=lambda one: not _of_imu(one[1])))
        first = next(iter(kept.values()))
        members = {f"{triad}_{axis}": name for axis, name in first.items()}
        found |= {q: name for q, name in members.items() if q not in wanted}
        if wanted.keys() & members.keys():
            continue
        several = list(kept.values())
        if len(several) > 1:
            # The first is the answer as inferred.
            axis = next(iter(sorted(several, key=len)[0]))
            names = [m[axis] for m in several if axis in m]
            which = _several(raw, f"{triad}_{axis}", names, names[0])
            questions.ask(which, **_answer(raw, triad, first))
        elif said[next(iter(first.values()))].loose == UNKNOWN_WORDS:
            answer = _answer(raw, triad, first)
            whether = Finding(
                "io.columns-by-words",
                file=raw.name,
                quantity=triad,
                of_what=triad,
                names=[first[a] for a in AXES if a in first],
                columns=[f"{quantity}={name}" for quantity, name in answer.items()],
            )
            questions.ask(whether, **answer)
    rest: dict[str, list[str]] = {}
    for name, one in said.items():
        if one.quantity in QUANTITIES and not one.family:
            rest.setdefault(one.quantity, []).append(name)
    for quantity, names in rest.items():
        if quantity in wanted:
            continue
        if len(names) > 1 and quantity == "time":
            # Nor is a stamp that every row has, as a date beside a clock that starts at zero.
            held = {n: raw.columns[n] for n in names if n != "T"}
            names = [n for n, v in held.items() if not (v.size > FEW and (v == v[0]).all())]
            if names and all(map(DELSYS_CLOCK.fullmatch, names)):
                # Each column is behind its own: that of the gyro counts.
                before = list(raw.columns)
                before = before[: before.index(found.get("gyro_x", names[-1])) + 1]
                names = [next(n for n in reversed(before) if n in names)]
            names = _one_clock(raw, names) if names else []
        if not names:
            continue
        # Names read without their order are a last resort.
        names = [n for n in names if not said[n].loose] or names
        if len(names) > 1 and quantity == "time":
            names = _one_clock(raw, names)
        found[quantity] = names[0]
        if len(names) > 1:
            questions.ask(
                _several(raw, quantity, names, names[0]), **{quantity: reference(raw, names[0])}
            )
    plain = {name.strip().lower(): name for name in raw.columns}
    if len(raw.triad_units) == 1 and {*AXES} <= plain.keys() and not {*found, *wanted} - {"time"}:
        # The one sensor of which the lines above the table speak.
        found |= {f"{t}_{a}": plain[a] for t in raw.triad_units for a in AXES}
    if "time" not in {*found, *wanted} and (clock := clock_by_values(raw)):
        found["time"] = clock
    return {q: Column(name, unit_stated(raw, name), "name") for q, name in found.items()}


#: Names of counters that may be clocks, if no other column is.
_TICKS = ("tick", "ticks", "counter", "clock", "systick", "cycles")


def clock_by_values(raw: RawLog) -> str:
    """Return the one column of dates or times of day, or of ticks; empty if there is not just one.

    A clock of another name is known by its values.
    """
    dated, ticks = [], []
    for name, values in raw.columns.items():
        if values.dtype.kind == "M":
            dated.append(name)
        elif values.dtype.kind == "O":
            if values.size and ":" in (first := str(values[0])) and is_stamp(first):
                dated.append(name)
        elif name.strip().lower() in _TICKS and (advances(values) or advances(values[::-1])):
            ticks.append(name)
    found = dated or ticks
    return found[0] if len(found) == 1 else ""


def _families(raw: RawLog, said: dict[str, ColumnName]) -> dict[tuple[str, str], Family]:
    """Gather the columns of each sensor: triad and name without the axis, to the axes."""
    out: dict[tuple[str, str], Family] = {}
    numbered: dict[tuple[str, str], dict[int, str]] = {}
    for name, one in said.items():
        triad, _, axis = str(one.quantity).partition("_")
        if not one.family:
            continue
        # An array of four need not begin with x, y and z.
        if (part := INDEXED.fullmatch(name)) and _width(raw, part.group(1)) != 3:
            continue
        if one.quantity in BODY_RATES:
            triad, axis = "gyro", BODY_RATES[one.quantity][-1]
        if axis:
            key = triad, one.family
            while axis in out.get(key, ()):  # the same name once more
                key = triad, key[1] + "'"
            out.setdefault(key, {})[axis] = name
        elif one.number is not None:
            numbered.setdefault((triad, one.family), {})[one.number] = name
    for key, names in numbered.items():
        if sorted(names) in ([0, 1, 2], [1, 2, 3]) and key not in out:
            out[key] = dict(zip(AXES, (names[k] for k in sorted(names)), strict=True))
    if len(out.get(("gyro", "p"), "xyz")) < 3:
        del out["gyro", "p"]
    rates = {key: f for key, f in out.items() if key[0] == "gyro"}
    turns = {key for key in rates if key[1].rpartition(" ")[2].rstrip("'") == "turn"}
    if any(len(f) == len(AXES) for key, f in rates.items() if key not in turns):
        # Beside rates, those of angles are another's: of a controller, or of the reference.
        out = {key: f for key, f in out.items() if key not in turns}
    return out


def _best(families: dict[str, Family], said: dict[str, ColumnName]) -> dict[str, Family]:
    """Keep the families of a triad that are whole, are rates and have gravity, by best names."""
    whole = {f for f, m in families.items() if len(m) == len(AXES)}
    # A name that is there twice leaves open which of the two is meant.
    kept = {f: m for f, m in families.items() if f in whole or f.rstrip("'") in whole} or families
    preferences: tuple[Callable[[ColumnName, str], bool], ...] = (
        lambda one, family: one.loose != UNKNOWN_WORDS,
        lambda one, family: not one.increment,
        lambda one, family: not one.linear,
        lambda one, family: "including" in family,
        lambda one, family: "uncal" not in family,
        # A letter may mean anything, and names read without their order are a last resort.
        lambda one, family: len(family.rstrip("'")) > 1,
        lambda one, family: not one.loose,
    )
    for preferred in preferences:
        kept = {f: m for f, m in kept.items() if preferred(said[next(iter(m.values()))], f)} or kept
    return kept


def _letter_g(
    raw: RawLog,
    families: dict[tuple[str, str], Family],
    wanted: dict[str, str],
    questions: Questions,
    found: dict[str, str],
) -> None:
    """Decide what ``gx gy gz`` are: rates beside ``ax ay az``; else gravity, or g, or rates.

    Beside other rates they are gravity or acceleration in g: asked, if no other acceleration is
    there. Alone they are no rates if their norm is 1 g, as that of no turn is.
    """
    own = families["gyro", "g"]
    units = {unit_stated(raw, name) for name in own.values()}
    if units <= set(GYRO_UNITS) or set(own.values()) & set(wanted.values()):
        return
    linear = [n for (t, _), m in families.items() if t == "accel" for n in m.values()]
    whole = [n for n in linear if not read_name(n).linear]
    whole += [n for q, n in wanted.items() if q.startswith("accel")]
    rates = "gyro_x" in wanted or any(
        t == "gyro" and f != "g" and len(m) == 3 for (t, f), m in families.items()
    )
    alone = not (rates or linear or units - {None})
    said = {n: f"gyro_{a}" for a, n in own.items()}
    gravity = alone and bool(_letters_of_g(raw, said))
    # Torque has the whole force as G(x) beside one of another name.
    beside = [] if rates or units - {None} else _letters_of_g(raw, said)
    if beside and len(whole) == len(AXES) and _follows(raw, beside, whole):
        del families["gyro", "g"]
        return
    if not rates and (whole or not linear) and not (gravity or units <= set(ACCEL_UNITS)):
        return
    del families["gyro", "g"]
    if whole or len(own) < len(AXES):
        return
    triad = "accel" if rates or gravity or units <= set(ACCEL_UNITS) else "gyro"
    names = [own[a] for a in AXES]
    if linear and rates:
        return  # gravity, beside acceleration without it
    found |= {f"{triad}_{a}": name for a, name in own.items()}
    questions.ask(
        Finding("io.letter-g-open", file=raw.name, quantity=triad, names=names, triad=triad),
        **_answer(raw, triad, own),
    )


def _of_imu(family: Family) -> bool:
    """Whether the names of a sensor begin with the word for its unit."""
    return next(iter(family.values())).lower().startswith("imu")


def _several(raw: RawLog, quantity: str, names: list[str], first: str) -> Finding:
    return Finding(
        "io.columns-ambiguous",
        file=raw.name,
        quantity=quantity,
        count=len(names),
        names=names,
        of_what=quantity,
        names_2=first,
    )


def _answer(raw: RawLog, triad: str, family: Family) -> dict[str, str]:
    """Answer with the columns of a triad; with what their names begin with, if that is enough."""
    names = list(family.values())
    prefix = names[0].rstrip("xyzXYZ").rstrip("_-. /:[(")
    if (
        prefix
        and "," not in prefix
        and _three_of(raw, triad, prefix) == [family.get(a) for a in AXES]
    ):
        return {triad: prefix}
    return {f"{triad}_{a}": reference(raw, family[a]) for a in AXES if a in family}


def reference(raw: RawLog, name: str) -> str:
    """Name a column on the command line: by its number where the name has their separator."""
    return str(list(raw.columns).index(name) + 1) if "," in name or "=" in name else name


def _one_clock(raw: RawLog, names: list[str]) -> list[str]:
    """Return the clock to use of several: one of the samples, then one that states its unit.

    A message that was recorded by another program has the stamp of its sender and that of its
    arrival. Clocks that advance alike are one clock.
    """
    names = [n for n in names if n.lower().endswith("header.stamp")] or names
    names = [n for n in names if is_clock(raw, n)] or names
    # A stamp that a spreadsheet rounded is the same in every row.
    names = [n for n in names if len(set(raw.columns[n][:2].tolist())) > 1] or names
    names = clocks_with_unit(names, lambda n: unit_stated(raw, n) is not None)
    if len(names) > 1 and all(raw.columns[n].dtype.kind in "iuf" for n in names):
        steps = [np.diff(raw.columns[n].astype(np.float64)) for n in names]
        scaled = [s / s.mean() if s.size and s.mean() > 0.0 else None for s in steps]
        first = scaled[0]
        if first is not None and all(
            s is not None and np.allclose(s, first, rtol=0.0, atol=1e-2) for s in scaled[1:]
        ):
            return names[:1]
    return names


#: Rows over which a clock may not advance: a burst of samples.
FEW = 50


def is_clock(raw: RawLog, name: str) -> bool:
    """Whether a column holds numbers, dates or times of day; letters of a local zone are none."""
    values = raw.columns[name]
    return values.dtype.kind != "O" or bool(values.size and is_stamp(str(values[0])))


def unit_stated(raw: RawLog, column: str) -> str | None:
    """Return the unit of a column of a sensor, as a row of units, its name or ROS states it."""
    if column in raw.units:
        return unit_of(raw.units[column])
    return read_name(column).unit or _ros_unit(raw, column)


#: Words in brackets behind a name, or in a row of units, that say no unit.
_NO_UNITS = re.compile(
    r"[\W\d_]*|[xyz]|x[- ]?axis|y[- ]?axis|z[- ]?axis|none|n/?a|null|unitless|dimensionless|vector|"
    r"(?:un)?calib\w*|(?:un)?compensated|corrected|filter\w*|smooth\w*|sensor|device|body|float\w*|"
    r"double|(?:imu|sensor|unit)[\W_]?\w*|left|right|front|rear|back|up|down|roll|pitch|yaw|"
    r"\w*[. ]\w*",
    re.I,
)


#: Quantities whose units a sensor may have; degrees are often those per second.
_OF_TRIADS = {
    "gyro": ("rate", "angle"),
    "accel": ("acceleration", "change of velocity", "velocity"),
    "mag": ("magnetic field", "magnetic field, relative", "acceleration"),
}


def stated_word(raw: RawLog, column: str, triad: str) -> str:
    """Return the word that a file has instead of the unit of a sensor's column; empty if none.

    Of a row of units, or in brackets behind the name, where it is not a unit of such a sensor.
    """
    text = raw.units.get(column, "").strip().strip("[]()").strip()
    text = text or split_brackets(column)[1].strip()
    known = not text or find_unit(text, _OF_TRIADS[triad])
    return "" if known or _NO_UNITS.fullmatch(text) else text


ROS_FIELD = re.compile(rf"(.*({'|'.join(ROS)}))[./][xyz]")


def _ros_unit(raw: RawLog, column: str) -> str | None:
    """Return the unit of a field of a ROS message: its covariance is beside it."""
    field = ROS_FIELD.fullmatch(column)
    if field is None or not any(n.startswith(f"{field[1]}_covariance") for n in raw.columns):
        return None
    return ROS[field[2]][1]


def _asked(raw: RawLog, quantity: str, source: str) -> list[tuple[str, str]]:
    """Resolve one ``quantity=source`` of the user to existing columns."""
    names = list(raw.columns)
    if quantity in TRIADS:
        if members := _three_of(raw, quantity, source):
            return [(f"{quantity}_{a}", m) for a, m in zip(AXES, members, strict=True)]
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
            first=f"{source}[{width - 3}]",
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


# Quantities of other tables, as fixes and trajectories, by a vocabulary of their own.


@dataclass(frozen=True)
class Found:
    """The column of a quantity.

    `source`: column name in the file. `factor`: factor to the table's unit and sign. `stated`:
    whether the name states the unit; otherwise the table's own is assumed.
    """

    source: str
    factor: float
    stated: bool

    def values(self, raw: RawLog, quantity: str) -> Array:
        """Return the numbers in the table's unit and sign; (n,).

        `quantity`: for messages. DataError: a value is not a number.
        """
        return np.asarray(numbers(raw, self.source, quantity), np.float64) * self.factor

    def stamps(self, raw: RawLog, order: str | None = None) -> tuple[Array, str, bool]:
        """Return seconds, (n,), the name of their clock, and whether they were dates.

        `order`: of dates (`units.DATE_ORDERS`), if stated.
        DataError: a stamp is neither a number nor a date.
        """
        ticks, dated = ticks_of(raw, self.source, order=order, most_step=STEP_OF_FIXES)
        time = np.asarray(ticks * (1e-9 if dated else self.factor), dtype=np.float64)
        finite = time[np.isfinite(time)]
        first = float(finite[0]) if finite.size else 0.0
        return time, raw.clock or clock_of_name(self.source, first, dated=dated), dated


def find_quantities(
    names: Iterable[str],
    of: Vocabulary,
    asked: Mapping[str, str],
    file: str,
    units: Mapping[str, str] | None = None,
) -> dict[str, Found]:
    """Find the column of each quantity.

    `names`: as in the file. `of`: vocabulary of the file. `asked`: quantity to the name of its
    column, or its number, from 1; overrides what the names suggest. `file`: for messages. `units`:
    column to unit, if stated apart from the name. Returns quantities that were not found are
    absent. ConfigError: a requested column does not exist, or its quantity is unknown. DataError:
    two columns fit one quantity, or a unit does not fit its quantity.
    """
    columns, known = list(names), of.quantities
    wanted: dict[str, str] = {}
    signs: dict[str, float] = {}
    for quantity, name in asked.items():
        if quantity not in known:
            raise ConfigError(
                "io.unknown-quantity-of-table",
                quantity="columns",
                of_what=quantity,
                of=of.of,
                word=quantity,
                known=known,
            )
        with_sign = bool(known[quantity].units) and quantity != "time"
        name, sign = _without_minus(name, columns) if with_sign else (name, 1.0)
        if name not in columns and name.isdecimal() and 1 <= int(name) <= len(columns):
            name = columns[int(name) - 1]
        check_choice(
            "io.no-column-3", columns, quantity=f"columns {quantity}", file=file, name=name
        )
        wanted[name] = quantity
        signs |= {name: -1.0} if sign < 0.0 else {}
    found: dict[str, Found] = {}
    read = {name: read_name(name, of, (units or {}).get(name, "")) for name in columns}
    for evidence in range(3):
        there = set(found) | set(asked)
        clocks = [n for n, s in read.items() if (s.quantity, s.loose) == ("time", evidence)]
        others = set(clocks).difference(clocks_with_unit(clocks, lambda n: bool(read[n].unit)))
        for name, said in read.items():
            meant = wanted.get(name) if evidence == 0 else None
            free = name not in wanted and name not in others
            if free and said.loose == evidence and said.quantity not in there:
                meant = said.quantity
            if meant is None or (evidence == 2 and not _is_plain(name, read, known)):
                continue
            if meant in found and name.startswith(f"{found[meant].source} ("):
                continue  # the same name once more (`csv`): the first counts
            sign = signs.get(name, said.sign if said.quantity == meant else 1.0)
            factor = sign * _factor(meant, known[meant], said.unit, name, file)
            if meant in found and _in_other_unit(found[meant].source, name):
                continue
            if meant in found:
                raise DataError(
                    "io.column-names-ambiguous",
                    file=file,
                    quantity=meant,
                    source=found[meant].source,
                    name=name,
                    meant=meant,
                )
            found[meant] = Found(name, factor, bool(said.unit))
    return found


#: A name and its last word, in brackets or behind a sign.
_END = re.compile(r"(.*?)[\s_(\[]+([^\s_(\[\])]+)[\])]?$")


def _in_other_unit(one: str, other: str) -> bool:
    """Whether two names are one quantity in two units: SPEED_KPH and SPEED_MPH."""
    ends = [_END.match(name.strip().lower()) for name in (one, other)]
    if None in ends or ends[0][1] != ends[1][1]:  # type: ignore[index]
        return False
    units = {unit_of(end[2], OF_TABLES) for end in ends if end}
    return len(units) == 2 and None not in units


def _is_plain(name: str, read: Mapping[str, ColumnName], known: Mapping[str, Quantity]) -> bool:
    """Whether a name of which only words are known is alone with them, and its unit fits."""
    said = read[name]
    alone = [n for n, other in read.items() if (other.quantity, other.loose) == (said.quantity, 2)]
    return len(alone) == 1 and (not said.unit or said.unit in known[str(said.quantity)].units)


#: A unit behind the number of them that a count is: 0.01m.
_SCALED = re.compile(r"(\d+(?:\.\d+)?(?:e-?\d+)?)\*?([^\d.].*)")


def _factor(quantity: str, known: Quantity, unit: str | None, name: str, file: str) -> float:
    if unit is None:
        return 1.0
    if unit == "ms" and "m/s" in known.units:
        return known.units["m/s"]  # speed_ms
    if (scaled := _SCALED.fullmatch(unit)) and scaled[2] in known.units:
        return float(scaled[1]) * known.units[scaled[2]]
    if unit not in known.units:
        raise DataError(
            "io.unit-of-other-quantity",
            file=file,
            quantity=quantity,
            unit=unit,
            name=name,
            units=", ".join(known.units) or "none",
        )
    return known.units[unit]


#: In the name of a clock that other recordings have, too.
_SINCE_1970 = re.compile(r"utc|unix|epoch|gps", re.I)


def fix_columns(raw: RawLog, asked: Mapping[str, str]) -> dict[str, Found]:
    """Find the columns of fixes: as asked, else as the file states, else by their names.

    Names are those of `FIXES`, also after ``gps_``: a quantity that has its own name is not
    searched behind such a word, for beside ``time`` and ``speed``, ``gps_time`` and ``gps_speed``
    are others. A file that states its columns is not searched by names. Errors as of
    `find_quantities`.
    """
    if not raw.stated:
        names = list(raw.columns)
        clocks = [n for n in names if read_name(n, FIXES).quantity == "time"]
        if of_ublox := [n for n in clocks if plain_name(n) == "itow"]:
            # Beside it are the parts of a date: year, month, day, hour, min, sec.
            other = set(clocks) - {of_ublox[0], *asked.values()}
            names = [n for n in names if n not in other]
        elif len(clocks) > 1:
            # A lone T is as often a temperature; a text that is not a stamp is not a clock.
            other = {n for n in clocks if n == "T" or not is_clock(raw, n)} - set(asked.values())
            names = [n for n in names if n not in other or other >= set(clocks)]
            left = sorted(set(clocks) & {*names}, key=lambda n: not _SINCE_1970.search(n))
            if len(left) > 1 and "time" not in asked and len(one := _one_clock(raw, left)) == 1:
                # Beside a clock since the start, that of the receiver.
                names = [n for n in names if n not in left or n in one]
        by_name = find_quantities(names, FIXES, asked, raw.name, raw.units)
        if "time" not in by_name and (clock := clock_by_values(raw)):
            by_name["time"] = Found(clock, 1.0, False)
        if (height := by_name.pop("alt_hae", None)) and "alt" not in asked:
            by_name["alt"] = height
            by_name = {q: one for q, one in by_name.items() if q != "alt_msl"}
        return by_name | _over_ground(raw, names, by_name)
    known = FIXES.quantities
    found = {
        quantity: Found(column, 1.0 if unit is None else known[quantity].units[unit], True)
        for column, (quantity, unit) in raw.stated.items()
        if quantity in known and quantity not in asked
    }
    named = find_quantities(raw.columns, FIXES, asked, raw.name) if asked else {}
    return found | {quantity: named[quantity] for quantity in asked}


def _over_ground(raw: RawLog, names: list[str], found: dict[str, Found]) -> dict[str, Found]:
    """Find speed and course of fixes by names that say less; empty in a log, or if two fit."""
    missing = {"speed", "course"} - found.keys()
    if not missing or "VN" in found or "gyro_x" in names_of_quantities(raw):
        return {}
    free = [n for n in names if n not in {one.source for one in found.values()}]
    try:
        likely = find_quantities(free, OVER_GROUND, {}, raw.name, raw.units)
    except DataError:
        return {}
    return {q: one for q, one in likely.items() if q in missing}


def plain_name(name: str) -> str:
    """Return the letters and digits of a name, or of what is behind its last point or slash."""
    return re.sub(r"[\W_]", "", re.split(r"[./]", name)[-1].lower())


def names_of_fixes(raw: RawLog) -> set[str]:
    """Return the columns that are of fixes; empty without latitude and longitude."""
    try:
        found = fix_columns(raw, {})
    except StrapdownError:
        return set()
    there = {"lat", "lon"} <= found.keys()
    return {column.source for column in found.values()} if there else set()


def names_of_velocities(raw: RawLog) -> list[str]:
    """Return the columns of a velocity north and east that are there without a position."""
    try:
        found = fix_columns(raw, {})
    except StrapdownError:
        return []
    level = {"VN", "VE"} <= found.keys() and not {"lat", "lon", "north", "ecef_x"} & found.keys()
    return [found[q].source for q in ("VN", "VE", "VD") if q in found] if level else []
