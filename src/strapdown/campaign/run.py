"""A campaign from its file to its sealed folder: run, resumed, merged, and one case by itself."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import shutil
import tempfile
import time
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from strapdown import bundle
from strapdown.bundle.atomic_folder import flush_entry
from strapdown.campaign.case_process import run_case
from strapdown.campaign.design import Campaign
from strapdown.campaign.engine import Workers, run_batches
from strapdown.campaign.kinds import KINDS
from strapdown.campaign.specification import CampaignSpec
from strapdown.campaign.statistics import share_of, student_interval
from strapdown.errors import ConfigError, DataError, StrapdownError
from strapdown.progress import Progress, silent
from strapdown.report.report_bundle import ReportBundle

# --- results on disk: parts as they come, sorted blocks at the end -----------------------
# A working folder holds ``campaign.json`` and parts, each whole or not there at all. A part is
# named after its first case and its content, so that parts of several machines lie side by side.
# When a campaign is complete, its rows are written in order of the case as blocks: the same bytes,
# whoever ran which case when. The rows of a block count before those of a part.

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
        _written(folder / CAMPAIGN, lambda path: path.write_text(bundle.to_json(frozen), "utf-8"))
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
        for column in schema:
            values = [row.get(column.name) for row in plain]
            if column.type == pa.string():
                values = [None if v is None else str(v) for v in values]
            elif column.type == pa.float64():
                values = [None if v is None else float(v) for v in values]
            arrays.append(_array(values, column.type))
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


#: Rows, and time, s, after which parts are written.
ROWS, SECONDS = 5000, 5.0
#: Of the folder in which a campaign works until it is complete.
WORKING = "-running"
#: Share of the progress that is the summary's.
SUMMARY = 0.03


# --- sequential stopping ------------------------------------------------------------------


class Stopping:
    """Finds, cell by cell, after how many draws an interval is narrow enough.

    The looks are at fixed numbers of draws, and see the draws in their order, so that the number of
    cases depends on the campaign alone. Memory does not grow with the cases but for those that
    arrive early.

    Parameters
    ----------
    frozen : mapping
        The campaign.
    """

    def __init__(self, frozen: Mapping[str, Any]) -> None:
        self.rule: Mapping[str, Any] = frozen["stop"]
        self.every = int(self.rule.get("every", 100))
        self.cells = len(frozen["cells"])
        self.draws = int(frozen["total"]) // self.cells
        #: Number of draws that each stopped cell keeps.
        self.stopped: dict[int, int] = {}
        self._next = [0] * self.cells
        self._early: list[dict[int, float]] = [{} for _ in range(self.cells)]
        # Count, mean, sum of squared deviations of the statistic.
        self._sums = [(0, 0.0, 0.0) for _ in range(self.cells)]
        self._value = _statistic(frozen, self.rule, list(frozen["keep"]["scalars"]))

    def add(self, row: Mapping[str, Any]) -> None:
        """Take a row, in any order."""
        cell, draw = int(row["cell"]), int(row["draw"])
        if cell in self.stopped or draw < self._next[cell]:
            return
        self._early[cell][draw] = self._value(row)
        while self._next[cell] in self._early[cell] and cell not in self.stopped:
            value = self._early[cell].pop(self._next[cell])
            self._next[cell] += 1
            if not math.isnan(value):
                count, mean, square = self._sums[cell]
                off = value - mean
                mean += off / (count + 1)
                self._sums[cell] = (count + 1, mean, square + off * (value - mean))
            if self._next[cell] % self.every == 0 and self._narrow(cell):
                self.stopped[cell] = self._next[cell]

    def keeps(self, cell: int, draw: int) -> bool:
        """Whether a case is among those that count."""
        return draw < self.stopped.get(cell, self.draws)

    @property
    def done(self) -> bool:
        """Whether every cell has enough."""
        return len(self.stopped) == self.cells

    def _narrow(self, cell: int) -> bool:
        count, mean, square = self._sums[cell]
        if count < 2:
            return False
        if self.rule.get("scalar") is not None:
            low, high = student_interval(count, mean, math.sqrt(square / (count - 1)))
        else:
            share = share_of(round(mean * count), count)
            low, high = share.low, share.high
        return 0.5 * (high - low) <= float(self.rule["half_width"])


def _statistic(
    spec: Mapping[str, Any], rule: Mapping[str, Any], names: list[str]
) -> Callable[[Mapping[str, Any]], float]:
    """From a row to what its statistic is the mean of; NaN where the case has none."""

    def scalar(row: Mapping[str, Any], name: str) -> float:
        return float(row["scalars"][names.index(name)])

    if rule.get("scalar") is not None:
        return lambda row: scalar(row, rule["scalar"])
    if rule.get("coverage") is not None:
        one = next(c for c in spec["coverage"] if c["name"] == rule["coverage"])

        def covered(row: Mapping[str, Any]) -> float:
            error, bound = scalar(row, one["error"]), scalar(row, one["bound"])
            return math.nan if math.isnan(error + bound) else float(abs(error) <= bound)

        return covered
    rate = next(c for c in spec["rate"] if c["name"] == rule["rate"])

    def happened(row: Mapping[str, Any]) -> float:
        value = scalar(row, rate["scalar"])
        if math.isnan(value):
            return math.nan
        above = rate.get("above")
        return float(value > above if above is not None else value < rate["below"])

    return happened


# --- the run ------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class CampaignRun:
    """A complete campaign: its cases and what they say together. `save` writes it.

    Attributes
    ----------
    design : Campaign
    summary : dict
        By cell: distributions, coverages, rates, failures, sensitivities.
    inputs : tuple of InputFiles
    """

    design: Campaign
    summary: dict[str, Any]
    inputs: tuple[bundle.InputFiles, ...]
    dataset: Dataset = field(repr=False)
    stopped: Mapping[int, int] = field(default_factory=dict)

    @property
    def cases(self) -> pd.DataFrame:
        """All cases: parameters, status and kept scalars, by number."""
        parts: list[pd.DataFrame] = [
            _kept(part, self.stopped).to_pandas() for part in self.dataset.cases()
        ]
        return pd.concat(parts, ignore_index=True).set_index("case")

    def to_pandas(self) -> pd.DataFrame:
        """As `cases`."""
        return self.cases

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> bundle.Seal:
        """Write the campaign as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder: ``cases`` and ``curves`` in Parquet, ``summary.json``, the page.
        report : bool
            Whether to write the page as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        """
        return CAMPAIGN_BUNDLE.write(self, out, report=report, force=force, progress=progress)

    def __repr__(self) -> str:
        return f"<CampaignRun {self.design.spec.name}: {self.summary['cases']} cases>"


def run_campaign(
    file: str | Path,
    *,
    workers: Workers | int | None = None,
    folder: str | Path | None = None,
    part: tuple[int, int] = (1, 1),
    progress: Progress = silent,
    shown: Callable[[str], None] = lambda address: None,
) -> CampaignRun:
    """Run many cases of one configuration, or one for each log, and summarise them.

    Parameters
    ----------
    file : str or Path
        File of the campaign, in TOML.
    workers : Workers or int, optional
        Number of cases at a time; by default one for each core of this machine.
    folder : str or Path, optional
        Working folder, which a campaign that was ended goes on from; by default a temporary one.
    part : (int, int)
        ``(1, 3)``: the first third of the cases alone, to be merged with the others.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    CampaignRun

    Raises
    ------
    ConfigError
        The campaign is invalid; the message names the line. Or no worker is to be had.
    """
    path = Path(file)
    spec = CampaignSpec.read(path, files=False)
    design = Campaign.of(spec, path.parent)
    design = replace(design, files=(("campaign", str(path.absolute())), *design.files))
    if isinstance(workers, int):
        workers = Workers(workers)
    place = _temporary() if folder is None else Path(folder)
    dataset = Dataset.begin(place, _with_digests(design))
    run = _finished(design, dataset, workers or Workers(), part, progress, shown)
    if folder is None:
        weakref.finalize(run, shutil.rmtree, place, ignore_errors=True)
    return run


def _temporary() -> Path:
    """A working folder that goes with its run."""
    return Path(tempfile.mkdtemp(prefix="strapdown-campaign-"))


def _with_digests(design: Campaign) -> dict[str, Any]:
    """The frozen campaign of a working folder, with what its results depend on besides."""
    digests = [digest for one in design.inputs for digest in one.digests]
    return {**design.frozen(), "digests": digests, "source": bundle.source_digest()}


def resume(
    folder: str | Path,
    *,
    workers: Workers | None = None,
    progress: Progress = silent,
    shown: Callable[[str], None] = lambda address: None,
) -> CampaignRun:
    """Go on with a campaign from its working folder: the cases without a row are run.

    DataError: the folder has no campaign. ConfigError: it is of another version of the program.
    """
    dataset = Dataset(Path(folder), frozen_of(Path(folder)))
    design = Campaign.thawed(dataset.frozen)
    dataset.check(_with_digests(design))
    return _finished(design, dataset, workers or Workers(), (1, 1), progress, shown)


def _finished(
    design: Campaign,
    dataset: Dataset,
    workers: Workers,
    part: tuple[int, int],
    progress: Progress,
    shown: Callable[[str], None],
) -> CampaignRun:
    """Run what is missing, and summarise."""
    rule = design.spec.stop
    stopping = None if rule is None else Stopping(dataset.frozen)
    there = dataset.there()
    if stopping is not None and there.any():
        names = list(dataset.frozen["keep"]["scalars"])
        for block in dataset.cases():
            for row in block.to_pandas().to_dict("records"):
                named = {str(key): value for key, value in row.items()}
                stopping.add({**named, "scalars": [named[name] for name in names]})
    k, of = part
    edges = [round(design.total * i / of) for i in (k - 1, k)]
    todo = np.flatnonzero(~there[edges[0] : edges[1]]) + edges[0]
    if todo.size and not (stopping is not None and stopping.done):
        _run_missing(design, dataset, todo, stopping, workers, progress, shown)
    if of > 1:
        stopped: dict[int, int] = {}
        return CampaignRun(design, {"cases": int(dataset.there().sum())}, design.inputs, dataset)
    stopped = {} if stopping is None else stopping.stopped
    progress("summarising", 1.0 - SUMMARY)
    return CampaignRun(design, _summary(dataset, stopped), design.inputs, dataset, stopped)


def _run_missing(
    design: Campaign,
    dataset: Dataset,
    todo: Any,
    stopping: Stopping | None,
    workers: Workers,
    progress: Progress,
    shown: Callable[[str], None],
) -> None:
    """Run cases, and write their rows as they come, also where the run is ended."""
    total, cells = design.total, len(design.cells)
    done = total - len(todo)
    bad = 0
    rows: list[Any] = []
    written = time.monotonic()

    def numbers() -> Iterator[int]:
        for number in todo:
            draw, cell = divmod(int(number), cells)
            if stopping is None or stopping.keeps(cell, draw):
                yield int(number)

    def flush() -> None:
        nonlocal written
        if rows:
            dataset.add(rows)
            rows.clear()
        written = time.monotonic()

    def take(batch: list[int], made: Any) -> bool:
        nonlocal done, bad
        done += len(batch)
        if design.spec.base.bulk:
            dataset.add_block(batch[0], batch[-1] + 1, made)
        else:
            rows.extend(made)
            bad += sum(row["status"] != "done" for row in made)
            if len(rows) >= ROWS or time.monotonic() - written > SECONDS:
                flush()
        lost = f", {bad:,} without a result" if bad else ""
        progress(f"{done:,} of {total:,} cases{lost}", (1.0 - SUMMARY) * done / total)
        if stopping is not None:
            for row in () if design.spec.base.bulk else made:
                stopping.add(row)
            return not stopping.done
        return True

    progress(f"{done:,} of {total:,} cases", (1.0 - SUMMARY) * done / total)
    try:
        run_batches(dataset.frozen, numbers(), workers, take, shown)
    finally:
        flush()


def _kept(table: Any, stopped: Mapping[int, int]) -> Any:
    """Rows that count: of a cell that was stopped, its first draws."""
    if not stopped:
        return table
    cell, draw = table["cell"].to_numpy(), table["draw"].to_numpy()
    limit = np.full(int(cell.max(initial=0)) + 1, np.iinfo(np.int64).max)
    for one, draws in stopped.items():
        limit[one : one + 1] = draws
    return table.filter(draw < limit[cell])


def _summary(dataset: Dataset, stopped: Mapping[int, int]) -> dict[str, Any]:
    from strapdown.campaign.summary import summarise

    def cases() -> Iterator[Any]:
        for block in dataset.cases():
            yield _kept(block, stopped)

    curves = dataset.curves if dataset.frozen["keep"].get("curves") else None
    made = summarise(dict(dataset.frozen), cases, curves)
    made["stopped"] = {str(cell): draws for cell, draws in sorted(stopped.items())}
    return made


# --- the sealed folder --------------------------------------------------------------------


def _configuration(run: CampaignRun) -> dict[str, Any]:
    return {"campaign": run.design.frozen()}


def _run(configuration: dict[str, Any]) -> CampaignRun:
    found = configuration["campaign"]
    design = Campaign.thawed(found)
    folder = _temporary()
    dataset = Dataset.begin(folder, _with_digests(design))
    run = _finished(design, dataset, Workers(), (1, 1), silent, lambda address: None)
    weakref.finalize(run, shutil.rmtree, folder, ignore_errors=True)
    return run


def _write_files(
    run: CampaignRun, folder: Path, name: str, forms: tuple[str, ...], progress: Progress
) -> None:
    bundle.write_json(folder / CAMPAIGN, run.design.plain())
    run.dataset.write_blocks(folder, lambda table: _kept(table, run.stopped))
    bundle.write_json(folder / "summary.json", run.summary)
    if forms:
        from strapdown.campaign.page import campaign_document
        from strapdown.report.document_html import write_report

        document = campaign_document(run.design.plain(), run.summary, name)
        write_report(document, folder, progress, figures=False)


CAMPAIGN_BUNDLE: ReportBundle[CampaignRun] = ReportBundle(
    "campaign", _configuration, _run, _write_files
)


# --- folders of campaigns -----------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """A campaign on disk.

    Attributes
    ----------
    design : Campaign
    dataset : Dataset
    sealed : bool
        Whether it is complete.
    """

    design: Campaign
    dataset: Dataset
    sealed: bool


def open_campaign(folder: str | Path) -> Found:
    """Open a campaign: its sealed folder, or the working one of that name.

    DataError: there is none.
    """
    path = Path(folder)
    working = path.with_name(path.name + WORKING)
    if not (path / CAMPAIGN).exists() and (working / CAMPAIGN).exists():
        path = working
    frozen = frozen_of(path)
    if "places" in frozen:
        return Found(Campaign.thawed(frozen), Dataset(path, frozen), False)
    manifest = bundle.read_manifest(path)
    configuration = bundle.resolved(manifest["configuration"], path)
    design = Campaign.thawed(configuration["campaign"])
    return Found(design, Dataset(path, frozen), True)


def case_of(folder: str | Path, number: int) -> tuple[Any, dict[str, Any], dict[str, Any] | None]:
    """Run one case of a campaign by itself.

    Parameters
    ----------
    folder : str or Path
        Of the campaign, complete or not.
    number : int

    Returns
    -------
    result, row, recorded
        The result, None where the case has none; its row, with its ``errors``, and the recorded
        row, None if there is none: equal to the last bit where program and machine are the same.

    Raises
    ------
    ConfigError
        The campaign has no such case.
    """
    found = open_campaign(folder)
    total = found.design.total
    if not 0 <= number < total:
        raise ConfigError("campaign.no-case", quantity="CASE", number=number, last=total - 1)
    errors: list[StrapdownError] = []
    row, result = run_case(found.design, number, errors)
    row["errors"] = [error.finding for error in errors]
    recorded = None
    for block in found.dataset.cases():
        near = np.flatnonzero(block["case"].to_numpy() == number)
        if len(near):
            recorded = {str(k): v for k, v in block.take(near).to_pandas().iloc[0].items()}
            break
    return result, row, recorded


def differing(
    frozen: Mapping[str, Any], row: Mapping[str, Any], recorded: Mapping[str, Any]
) -> list[str]:
    """Return the kept scalars, and the status, in which a repeated case differs."""
    values = dict(zip(frozen["keep"]["scalars"], row["scalars"], strict=True))
    off = [
        name
        for name, value in values.items()
        if not (value == recorded[name] or (math.isnan(value) and pd.isna(recorded[name])))
    ]
    return [*(["status"] if row["status"] != recorded["status"] else []), *off]


def report_now(folder: str | Path, path: Path) -> None:
    """Write the page of a campaign as it is, complete or not."""
    from strapdown.campaign.page import campaign_document
    from strapdown.report.document_html import write_report

    found = open_campaign(folder)
    summary = _summary(found.dataset, {})
    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        document = campaign_document(found.design.plain(), summary, Path(folder).name)
        write_report(document, Path(name), silent, figures=False)
        path.write_bytes((Path(name) / "report.html").read_bytes())


def save_case(design: Campaign, result: Any, out: Path, force: bool) -> bundle.Seal:
    """Write the sealed folder of one case, with its report."""
    seal: bundle.Seal = KINDS[design.spec.base.kind].save(result, out, force)
    return seal


def merge_parts(folders: Sequence[str | Path], out: str | Path) -> int:
    """Gather the parts of one campaign from several working folders; returns the missing cases.

    Parameters
    ----------
    folders : sequence of str or Path
        Working folders of the same campaign, from any machine.
    out : str or Path
        Working folder to make, or to add to.

    Raises
    ------
    ConfigError
        A folder is of another campaign, or of another version of the program.
    """
    target = None
    for folder in folders:
        found = open_campaign(folder)
        if found.sealed:
            raise DataError("campaign.sealed-part", file=str(folder))
        if target is None:
            target = Dataset.begin(Path(out), found.dataset.frozen)
        found.dataset.check(target.frozen)
        for name in ("cases", "curves"):
            for path in sorted((found.dataset.folder / name).glob("part-*.parquet")):
                copy = target.folder / name / path.name
                if not copy.exists():
                    staging = copy.with_name(f".{copy.name}.part")
                    shutil.copyfile(path, staging)
                    staging.replace(copy)
    return 0 if target is None else int((~target.there()).sum())
