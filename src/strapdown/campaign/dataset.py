"""Results of a campaign on disk: parts as they come, and sorted blocks when all are there.

A working folder holds ``campaign.json`` and parts, each whole or not there at all. A part is named
after its first case and its content, so that parts of several machines lie side by side. When a
campaign is complete, its rows are written in order of the case as blocks: the same bytes, whoever
ran which case when. The rows of a block count before those of a part.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from strapdown.bundle import to_json
from strapdown.bundle.atomic_folder import flush_entry
from strapdown.errors import ConfigError, DataError

#: Cases that are in memory at a time, and of a block, which is a file.
WINDOW = 2**14
BLOCK = 6 * WINDOW
#: Name of the frozen campaign.
CAMPAIGN = "campaign.json"
CASES, CURVES = "cases", "curves"


def frozen_of(folder: Path) -> dict[str, Any]:
    """Return the frozen campaign of a folder.

    DataError: the folder has none, or it cannot be read.
    """
    try:
        found: dict[str, Any] = json.loads((folder / CAMPAIGN).read_text(encoding="utf-8"))
        if found.get("schema") != "strapdown campaign 1":
            raise ValueError
    except (OSError, ValueError):
        raise DataError("campaign.no-campaign", file=str(folder)) from None
    return found


def schema_of(frozen: Mapping[str, Any]) -> pa.Schema:
    """Columns of the cases of a campaign."""
    fields = [("case", pa.int64()), ("cell", pa.int32()), ("draw", pa.int64())]
    fields += [("seed", pa.int64())]
    # In bulk they are drawn where they are used.
    varied = [] if frozen["base"].get("bulk") else frozen["parameters"]
    fields += [(one["name"], _type_of(one, frozen)) for one in varied]
    if frozen["logs"]:
        fields += [("log", pa.string())]
    fields += [(name, pa.string()) for name in ("status", "code", "findings")]
    fields += [(name, pa.float64()) for name in frozen["keep"]["scalars"]]
    return pa.schema(fields)


def _type_of(one: Mapping[str, Any], frozen: Mapping[str, Any]) -> pa.DataType:
    """Type of a parameter's column, by its values."""
    draw = one.get("draw")
    if draw == "integer":
        return pa.int64()
    if draw is not None and draw != "choice":
        return pa.float64()
    values = one.get("values") or [row[one["name"]] for row in frozen["rows"]]
    if all(isinstance(v, bool) for v in values):
        return pa.bool_()
    if all(isinstance(v, int) and not isinstance(v, bool) for v in values):
        return pa.int64()
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return pa.float64()
    return pa.string()


@dataclass(frozen=True)
class Dataset:
    """Results in a folder.

    Attributes
    ----------
    folder : Path
    frozen : mapping
        The campaign.
    """

    folder: Path
    frozen: Mapping[str, Any]

    @classmethod
    def begin(cls, folder: Path, frozen: Mapping[str, Any]) -> Dataset:
        """Make a working folder, or go on with that of the same campaign.

        ConfigError: the folder is of another campaign, or of another version of the program.
        """
        if (folder / CAMPAIGN).exists():
            made = cls(folder, frozen_of(folder))
            made.check(frozen)
            return made
        (folder / CASES).mkdir(parents=True, exist_ok=True)
        if frozen["keep"].get("curves"):
            (folder / CURVES).mkdir(exist_ok=True)
        _written(folder / CAMPAIGN, lambda path: path.write_text(to_json(frozen), "utf-8"))
        return cls(folder, frozen)

    def check(self, frozen: Mapping[str, Any]) -> None:
        """Refuse another campaign, other input files, or another version of the program."""
        for key, code in (
            ("identity", "campaign.other-campaign"),
            ("digests", "campaign.other-inputs"),
            ("source", "campaign.other-version"),
        ):
            if self.frozen[key] != frozen[key]:
                raise ConfigError(code, file=str(self.folder))

    def add(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write rows as parts, each whole or not at all.

        OSError: the disk is full, or the folder is gone; what was written stays.
        """
        ordered = sorted(rows, key=lambda row: int(row["case"]))
        # Curves first: a case is there when its row is.
        if self.frozen["keep"].get("curves"):
            self._part(CURVES, self._curve_table(ordered))
        self._part(CASES, self._case_table(ordered))

    def add_block(self, first: int, last: int, values: np.ndarray) -> None:
        """Write the scalars of cases from `first` to `last` - 1 that all are done."""
        count = last - first
        number = np.arange(first, last)
        seed = int(self.frozen["cases"].get("seed", 0))
        columns: dict[str, Any] = {
            "case": number,
            "cell": np.zeros(count, np.int32),
            "draw": number,
            "seed": np.full(count, seed),
            **{name: np.full(count, "") for name in ("code", "findings")},
            "status": np.full(count, "done"),
            **dict(zip(self.frozen["keep"]["scalars"], np.asarray(values).T, strict=True)),
        }
        schema = schema_of(self.frozen)
        arrays = [_array(columns[f.name], f.type) for f in schema]
        self._part(CASES, pa.Table.from_arrays(arrays, schema=schema))

    def there(self) -> np.ndarray:
        """Return which cases have a row, (total,) bool."""
        out = np.zeros(int(self.frozen["total"]), dtype=bool)
        for path in self._files(CASES):
            out[pq.read_table(path, columns=["case"])["case"].to_numpy()] = True
        return out

    def cases(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the rows in order of the case, a window of cases at a time."""
        yield from self._ordered(CASES, columns)

    def curves(self) -> Iterator[pa.Table]:
        """Yield the curves in order of the case, those of a window at a time."""
        if self.frozen["keep"].get("curves"):
            yield from self._ordered(CURVES, None)

    def write_blocks(self, out: Path, keep: Callable[[pa.Table], pa.Table]) -> None:
        """Write the rows that `keep` leaves, in order, as a file for each block of cases."""
        curves = bool(self.frozen["keep"].get("curves"))
        for name in (CASES, *([CURVES] if curves else [])):
            (out / name).mkdir()
            parts = (
                map(keep, self._ordered(CASES, None)) if name == CASES else self._kept_curves(keep)
            )
            for number, tables in itertools.groupby(filter(len, parts), _block_of):
                first = number * BLOCK
                path = out / name / f"part-{first:010d}-{first + BLOCK - 1:010d}-block.parquet"
                with pq.ParquetWriter(path, self._schema(name), compression="zstd") as writer:
                    for table in tables:
                        # In one piece: its bytes do not depend on the parts it is made of.
                        writer.write_table(table.combine_chunks())

    def _kept_curves(self, keep: Callable[[pa.Table], pa.Table]) -> Iterator[pa.Table]:
        """Curves of the cases that `keep` leaves, a window of cases at a time."""
        cases = filter(len, map(keep, self._ordered(CASES, ["cell", "draw"])))
        own = next(cases, None)
        for table in self._ordered(CURVES, None):
            while own is not None and _window_of(own) < _window_of(table):
                own = next(cases, None)
            if own is not None and _window_of(own) == _window_of(table):
                yield table.filter(pc.is_in(table["case"], own["case"].combine_chunks()))

    # --- files ----------------------------------------------------------------------------

    def _files(self, name: str) -> list[Path]:
        return sorted((self.folder / name).glob("part-*.parquet"))

    def _part(self, name: str, table: pa.Table) -> None:
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink, compression="zstd")
        data = sink.getvalue().to_pybytes()
        numbers = table["case"]
        first, last = (numbers[0].as_py(), numbers[-1].as_py()) if len(numbers) else (0, 0)
        own = hashlib.sha256(data).hexdigest()[:12]
        path = self.folder / name / f"part-{first:010d}-{last:010d}-{own}.parquet"
        _written(path, lambda at: at.write_bytes(data))

    def _ordered(self, name: str, columns: Sequence[str] | None) -> Iterator[pa.Table]:
        """Yield the rows of a window of cases at a time, in order and each once."""
        files = [(*_span(path), path) for path in self._files(name)]
        keys = ["case"] if name == CASES else ["case", "x"]
        wanted = None if columns is None else list(dict.fromkeys([*keys, *columns]))
        for begin in range(0, int(self.frozen["total"]), WINDOW):
            end = begin + WINDOW
            near = [path for first, last, path in files if first < end and last >= begin]
            parts = [part for path in near for part in _rows_between(path, begin, end, wanted)]
            if parts:
                yield _once(pa.concat_tables(parts), keys)

    def _case_table(self, rows: Iterable[Mapping[str, Any]]) -> pa.Table:
        schema = schema_of(self.frozen)
        own = list(self.frozen["keep"]["scalars"])
        plain = [
            {**row, **row["values"], **dict(zip(own, row["scalars"], strict=True))} for row in rows
        ]
        arrays = []
        for field in schema:
            values = [row.get(field.name) for row in plain]
            if field.type == pa.string():
                values = [None if v is None else str(v) for v in values]
            elif field.type == pa.float64():
                values = [None if v is None else float(v) for v in values]
            arrays.append(_array(values, field.type))
        return pa.Table.from_arrays(arrays, schema=schema)

    def _schema(self, name: str) -> pa.Schema:
        """Columns of the cases, or of the curves."""
        if name == CASES:
            return schema_of(self.frozen)
        names = self.frozen["keep"]["curves"]
        return pa.schema(
            [("case", pa.int64()), ("x", pa.float64()), *((n, pa.float64()) for n in names)]
        )

    def _curve_table(self, rows: Iterable[Mapping[str, Any]]) -> pa.Table:
        axis = self.frozen["keep"]["axis"]
        x = np.linspace(float(axis.get("from_s", 0.0)), axis["to_s"], int(axis.get("points", 50)))
        kept = [row for row in rows if row["curves"] is not None]
        number = np.repeat([int(row["case"]) for row in kept], len(x)).astype(np.int64)
        columns = [number, np.tile(x, len(kept))]
        for k in range(len(self.frozen["keep"]["curves"])):
            own = [np.asarray(row["curves"][k], dtype=np.float64) for row in kept]
            columns.append(np.concatenate(own) if own else np.empty(0))
        schema = self._schema(CURVES)
        arrays = [_array(c, f.type) for c, f in zip(columns, schema, strict=True)]
        return pa.Table.from_arrays(arrays, schema=schema)


def _array(values: Any, kind: pa.DataType) -> pa.Array:
    """A column; NaN is null in it."""
    return pa.array(values, type=kind, from_pandas=True)


def _block_of(table: pa.Table) -> int:
    return int(table["case"][0].as_py()) // BLOCK


def _window_of(table: pa.Table) -> int:
    return int(table["case"][0].as_py()) // WINDOW


def _rows_between(
    path: Path, begin: int, end: int, columns: list[str] | None
) -> Iterator[pa.Table]:
    """Rows of the cases from `begin` to before `end`, of those groups of a file that have some."""
    file = pq.ParquetFile(path)
    for k in range(file.num_row_groups):
        span = file.metadata.row_group(k).column(0).statistics
        if span is None or span.min >= end or span.max < begin:
            continue
        # Without threads, which would hold parts of their own.
        table = file.read_row_group(k, columns=columns, use_threads=False)
        case = table["case"].to_numpy()
        inside = (case >= begin) & (case < end)
        if inside.any():
            yield table if inside.all() else table.filter(pa.array(inside))


def _once(table: pa.Table, keys: Sequence[str]) -> pa.Table:
    """Rows in order of the keys; of equal ones the first: two machines made them to the same bits.

    Parts that are in order already are left as they are.
    """
    columns = [table[key].to_numpy() for key in keys]
    ahead = columns[-1][1:] > columns[-1][:-1]
    if len(keys) > 1:
        ahead = (columns[0][1:] > columns[0][:-1]) | ((columns[0][1:] == columns[0][:-1]) & ahead)
    if ahead.all():
        return table
    order = np.lexsort(columns[::-1])
    rows = np.column_stack([column[order] for column in columns])
    fresh = np.r_[True, (rows[1:] != rows[:-1]).any(axis=1)]
    return table.take(pa.array(order[fresh]))


def _span(path: Path) -> tuple[int, int]:
    """First and last case of a part, by its name."""
    _, first, last, *_ = path.stem.split("-")
    return int(first), int(last)


def _written(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file whole or not at all, also where the machine stops."""
    staging = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(staging)
        with staging.open("rb") as stream:
            os.fsync(stream.fileno())
        staging.replace(path)
        flush_entry(path.parent)
    except OSError:
        staging.unlink(missing_ok=True)
        raise
