"""Design of a campaign: its cases, each with its parameters and seed, by its number alone."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.bundle import InputFiles, input_files, named_paths
from strapdown.campaign.kinds import KINDS, Table, at_path, with_value
from strapdown.campaign.specification import CampaignSpec, ParameterTable
from strapdown.config.reading import OF_LOG, absolute_table
from strapdown.config.toml_file import TomlFile, read_toml
from strapdown.errors import ConfigError, check_choice

if TYPE_CHECKING:
    from strapdown.campaign.bulk import BulkCases

Array = NDArray[np.float64]

#: Streams of random numbers of a campaign, by use.
COORDINATES, SEEDS, ROWS = 0, 1, 2
#: Endings of the files that a folder of logs is searched for.
LOGS = (".csv", ".tsv", ".txt", ".parquet", ".npz", ".h5", ".mat", ".bin", ".ulg", ".bag", ".mcap")


@dataclass(frozen=True)
class Case:
    """One case of a campaign.

    Attributes
    ----------
    number : int
    cell, draw : int
        ``number = draw * cells + cell``: cells progress together.
    seed : int
        Equal for all cells at a draw: differences between cells are those of their parameters.
    values : dict
        Of the parameters by column.
    log : str
        Path of its log; empty without one.
    """

    number: int
    cell: int
    draw: int
    seed: int
    values: dict[str, Any]
    log: str = ""


@dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign with everything resolved: a function from the number of a case to its run.

    Attributes
    ----------
    spec : CampaignSpec
    base : dict
        Configuration that all cases begin with, its files as absolute paths.
    written : dict
        The same as it is written.
    logs, log_path : tuple of str
        Of a fleet: names from the folder of the campaign, and absolute paths.
    rows : tuple of dict
        Of a table of cases.
    files : tuple of (str, str)
        Roles and paths of the file of the campaign and of its base.
    linear : dict
        In bulk, of each scalar the value of the unperturbed case and the standard deviation by
        linear propagation: ``nominal``, ``linear_sd``.
    """

    spec: CampaignSpec
    base: Table
    written: Table
    logs: tuple[str, ...] = ()
    log_path: tuple[str, ...] = ()
    rows: tuple[Table, ...] = field(default=(), repr=False)
    files: tuple[tuple[str, str], ...] = ()
    linear: dict[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, spec: CampaignSpec, folder: Path) -> Campaign:
        """Resolve a specification, and check that its cases can be run.

        `folder`: of its file. ConfigError: a file is missing, a log has no match, a parameter is
        not a key of the configuration, or a name of a statistic is unknown.
        """
        base = spec.base
        file = None if base.file is None else folder / base.file
        if file is None:
            # Written in the campaign: its files are named from the same folder.
            source = TomlFile(folder / "campaign.toml", dict(base.configuration), "")
        else:
            source = read_toml(file)
        written, table = source.table, absolute_table(source)
        if base.simulate is not None:
            written = {"simulate": {"name": base.simulate}, **written}
            table = {"simulate": {"name": base.simulate}, **table}
        logs = _logs(folder, base.logs) if base.logs is not None else ()
        paths = tuple(str(Path(folder, log).absolute()) for log in logs)
        rows: tuple[Table, ...] = ()
        if spec.cases.table is not None:
            rows = _rows(folder / spec.cases.table, spec)
        files = () if file is None else (("base", str(file.absolute())),)
        made = cls(spec, table, written, logs, paths, rows, files)
        if base.bulk:
            if spec.keep.scalars:
                raise ConfigError("campaign.not-in-bulk", quantity="keep, scalars")
            cases = made.bulk()
            spec = spec.with_scalars({name: name for name in cases.scalars})
            linear = {"nominal": dict(cases.nominal), "linear_sd": dict(cases.linear_sd)}
            made = replace(made, spec=spec, linear=linear)
        made._check()
        return made

    @classmethod
    def thawed(cls, frozen: Mapping[str, Any]) -> Campaign:
        """Return the campaign of its frozen form, in another process or at another time."""
        places = frozen["places"]
        return cls(
            CampaignSpec.checked({k: frozen[k] for k in CampaignSpec.model_fields if k in frozen}),
            places["configuration"],
            frozen["written"],
            tuple(frozen["logs"]),
            tuple(places["log_path"]),
            tuple(frozen["rows"]),
            tuple((one["role"], one["file_path"]) for one in places["files"]),
            dict(frozen["linear"]),
        )

    def bulk(self) -> BulkCases:
        """Return the cases that are computed many at a time."""
        from strapdown.campaign.bulk import bulk_cases

        ranges = {
            str(one.path[-1]) if one.path[0] in ("start", "motion") else one.key: (
                float(one.low or 0.0),
                float(one.high or 0.0),
            )
            for one in self.drawn
        }
        return bulk_cases(self.spec.base.kind, self.base, self.spec.cases.seed, ranges)

    @cached_property
    def inputs(self) -> tuple[InputFiles, ...]:
        """Files of the campaign and its base, and those that they name, with their digests."""
        found = [input_files(role, path, (Path(path),)) for role, path in self.files]
        logs = [Path(log) for log in self.log_path]
        tables = [_filled(self.base, log) for log in logs] if logs else [self.base]
        named = (path for one in tables for path in named_paths(one))
        for path in dict.fromkeys((*named, *self.log_path)):
            found.append(input_files("input", path, _files(Path(path))))
        return tuple(found)

    def plain(self) -> dict[str, Any]:
        """Return what the campaign is, as plain data without the paths of its files."""
        spec = self.spec.plain()
        return {
            "schema": "strapdown campaign 1",
            **spec,
            "title": self.spec.title or self.spec.name,
            "keep": {**spec["keep"], "scalars": dict(self.scalars)},
            "written": self.written,
            "logs": list(self.logs),
            "rows": list(self.rows),
            "cells": list(self.cells),
            "parameters": [
                {"name": one.column, **one.model_dump(exclude_none=True, exclude={"name"})}
                for one in self.spec.parameter
            ],
            "total": self.total,
            "linear": self.linear,
            "identity": self.identity,
        }

    def frozen(self) -> dict[str, Any]:
        """Return plain data from which `thawed` makes the same campaign."""
        places = {
            "files": [{"role": role, "file_path": path} for role, path in self.files],
            "configuration": self.base,
            "log_path": list(self.log_path),
        }
        return {**self.plain(), "places": places}

    @cached_property
    def identity(self) -> str:
        """Digest of all that the numbers of a case depend on, without the paths of the files."""
        plain = self.spec.plain()
        for key in ("stop", "limits", "title"):
            plain.pop(key, None)
        plain["keep"] = {**plain["keep"], "scalars": dict(self.scalars)}
        parts = [plain, list(self.logs), list(self.rows), self.written]
        text = json.dumps(parts, sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def cells(self) -> tuple[dict[str, Any], ...]:
        """Values of the grid, by the number of the cell."""
        grid = [one for one in self.spec.parameter if one.draw is None and one.values]
        return tuple(
            dict(zip([one.column for one in grid], values, strict=True))
            for values in itertools.product(*(one.values for one in grid))
        )

    @cached_property
    def drawn(self) -> tuple[ParameterTable, ...]:
        """Parameters with a distribution."""
        return tuple(one for one in self.spec.parameter if one.draw is not None)

    @property
    def draws(self) -> int:
        """Number of draws in each cell."""
        asked = self.spec.cases.draws
        if self.spec.cases.method == "sensitivity":
            return asked * (len(self.drawn) + 2)
        return asked * max(1, len(self.logs)) * max(1, len(self.rows))

    @property
    def total(self) -> int:
        """Number of planned cases."""
        return self.draws * len(self.cells)

    @cached_property
    def scalars(self) -> dict[str, str]:
        """Kept scalars by name, and their paths in the data of a result."""
        return dict(self.spec.keep.scalars or KINDS[self.spec.base.kind].scalars)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(one.column for one in self.spec.parameter)

    def case(self, number: int) -> Case:
        """Return a case.

        IndexError: there is no such case.
        """
        if not 0 <= number < self.total:
            raise IndexError(number)
        draw, cell = divmod(number, len(self.cells))
        values = dict(self.cells[cell])
        sample, log, row = draw, "", -1
        if self.spec.cases.method == "sensitivity":
            sample = draw // (len(self.drawn) + 2)
        elif self.logs:
            log = self.logs[draw // self.spec.cases.draws]
        elif self.rows:
            row = draw // self.spec.cases.draws
            values |= self.rows[row]
        if self.drawn:
            u = self._coordinates(draw)
            values |= {one.column: _drawn(one, x) for one, x in zip(self.drawn, u, strict=True)}
        ordered = {name: values[name] for name in self.columns if name in values}
        seed = np.random.SeedSequence(self.spec.cases.seed, spawn_key=(SEEDS, sample))
        first = int(seed.generate_state(1, np.uint64)[0] >> np.uint64(1))
        return Case(number, cell, draw, first, ordered, log)

    def table(self, case: Case) -> Table:
        """Return the configuration of a case.

        ConfigError: a parameter has no place in it.
        """
        kind = KINDS[self.spec.base.kind]
        table = self.base
        if kind.seed and (len(kind.seed) == 1 or at_path(table, kind.seed[:-1]) is not None):
            table = with_value(table, kind.seed, case.seed)
        if case.log:
            path = Path(self.log_path[case.draw // self.spec.cases.draws])
            if not table.get(str(kind.log[0])) and len(kind.log) == 3:
                table = with_value(table, kind.log[:1], [{}])
            table = _filled(with_value(table, kind.log, str(path)), path)
        for one in self.spec.parameter:
            if one.column not in case.values:
                continue
            try:
                table = with_value(table, one.path, case.values[one.column])
            except KeyError as error:
                raise ConfigError(
                    "campaign.no-place", quantity=one.key, part=str(error.args[0])
                ) from None
        return table

    def _coordinates(self, draw: int) -> Array:
        """Point in the unit cube of the drawn parameters."""
        cases, width = self.spec.cases, len(self.drawn)
        if cases.method == "random":
            stream = np.random.SeedSequence(cases.seed, spawn_key=(COORDINATES, draw))
            return np.random.Generator(np.random.PCG64(stream)).random(width)
        if cases.method != "sensitivity":
            return np.asarray(self._points[draw])
        sample, column = divmod(draw, width + 2)
        a, b = self._points[sample, :width], self._points[sample, width:]
        if column < 2:
            return np.asarray(b if column else a)
        mixed = a.copy()
        mixed[column - 2] = b[column - 2]
        return np.asarray(mixed)

    @cached_property
    def _points(self) -> Array:
        """Points of a design that is made as a whole, (n, d)."""
        from scipy.stats import qmc  # noqa: TID251 - half a second, in campaigns of these alone

        cases, width = self.spec.cases, len(self.drawn)
        rng = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(cases.seed, spawn_key=(COORDINATES,)))
        )
        if cases.method == "latin":
            return np.asarray(qmc.LatinHypercube(width, rng=rng).random(self.draws))
        double = 2 * width if cases.method == "sensitivity" else width
        count = cases.draws if cases.method == "sensitivity" else self.draws
        whole = 1 << max(0, math.ceil(math.log2(count)))
        return np.asarray(qmc.Sobol(double, rng=rng).random(whole)[:count])

    def _check(self) -> None:
        """Refuse what no case could run, or no summary could use."""
        kind = KINDS[self.spec.base.kind]
        for name in self.spec.keep.curves:
            check_choice("campaign.no-curve", kind.curve_names, quantity="keep, curves", name=name)
        known = [*self.scalars, *(one.column for one in self.spec.parameter)]
        wanted = [
            ("coverage", k, name)
            for k, one in enumerate(self.spec.coverage)
            for name in (one.error, one.bound)
        ]
        wanted += [("rate", k, one.scalar) for k, one in enumerate(self.spec.rate)]
        wanted += [("consistency", k, one.scalar) for k, one in enumerate(self.spec.consistency)]
        if self.spec.stop is not None and self.spec.stop.scalar is not None:
            wanted += [("stop", 0, self.spec.stop.scalar)]
        for table, k, name in wanted:
            place = f"{table} {k + 1}"
            check_choice("campaign.no-scalar", known, quantity=place, name=name)
        if not self.spec.base.bulk:
            for cell in range(len(self.cells)):
                self.table(self.case(cell))


# --- parts of a design --------------------------------------------------------------------


def _drawn(one: ParameterTable, u: float) -> Any:
    """Quantile of a distribution at the level u, 0 to 1."""
    from scipy.special import ndtr, ndtri

    low, high = one.low or 0.0, one.high or 0.0
    if one.draw == "choice":
        return one.values[min(int(u * len(one.values)), len(one.values) - 1)]
    if one.draw == "integer":
        return int(low) + min(int(u * (high - low + 1)), int(high - low))
    if one.draw == "uniform":
        return float(low + u * (high - low))
    if one.draw == "log-uniform":
        return float(low * (high / low) ** u)
    # An exact zero has no quantile.
    level = min(max(u, 1e-300), 1.0 - 1e-16)
    if one.draw == "log-normal":
        return float((one.median or 1.0) * (one.factor or 1.0) ** ndtri(level))
    mean, sd = one.mean or 0.0, one.sd or 1.0
    if one.draw == "truncated-normal":
        first, last = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
        level = first + u * (last - first)
        return float(min(max(mean + sd * ndtri(level), low), high))
    return float(mean + sd * ndtri(level))


def _logs(folder: Path, pattern: str) -> tuple[str, ...]:
    """Paths of the logs that a pattern, a folder or a table names, from the campaign's folder."""
    given = folder / pattern
    if given.is_file():
        table = pd.read_csv(given, dtype=str)
        if "log" not in table.columns:
            raise ConfigError("campaign.no-log-column", file=given.name, have=list(table.columns))
        found = [str(name) for name in table["log"]]
        missing = [name for name in found if not (given.parent / name).exists()]
        if missing:
            raise ConfigError(
                "campaign.logs-missing", file=given.name, missing=missing[:5], count=len(missing)
            )
        inside = [given.parent / name for name in found]
    elif given.is_dir():
        inside = sorted(p for p in given.rglob("*") if p.suffix.lower() in LOGS and p.is_file())
    else:
        root = Path(pattern)
        start = Path(root.anchor) if root.is_absolute() else folder
        relative = str(root.relative_to(root.anchor)) if root.is_absolute() else pattern
        inside = sorted(start.glob(relative))
    if not inside:
        raise ConfigError("campaign.no-logs", quantity="base, logs", pattern=pattern)
    names = []
    for path in inside:
        whole = path.absolute()
        near = whole.is_relative_to(folder.absolute())
        names.append(str(whole.relative_to(folder.absolute()) if near else whole))
    return tuple(dict.fromkeys(names))


def _rows(path: Path, spec: CampaignSpec) -> tuple[Table, ...]:
    """Rows of a table of cases, by column of a parameter."""
    if not path.is_file():
        raise ConfigError("config.no-such-file", file=str(path))
    table = pd.read_csv(path)
    wanted = [one.column for one in spec.parameter]
    lacking = [name for name in wanted if name not in table.columns]
    if lacking or not len(table):
        raise ConfigError(
            "campaign.table-columns", file=path.name, lacking=lacking, have=list(table.columns)
        )
    rows = table[wanted].itertuples(index=False)
    return tuple(dict(zip(wanted, map(_plain, row), strict=True)) for row in rows)


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    return value.item() if isinstance(value, np.generic) else value


def _filled(node: Any, log: Path) -> Any:
    """Replace ``{folder}`` and ``{stem}`` in texts by those of a log."""
    if isinstance(node, dict):
        return {key: _filled(value, log) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [_filled(value, log) for value in node]
    if isinstance(node, str):
        for word, own in zip(OF_LOG, (str(log.parent), log.stem), strict=True):
            node = node.replace(word, own)
    return node


def _files(path: Path) -> tuple[Path, ...]:
    """The file of an input, or those of its folder."""
    return tuple(sorted(p for p in path.rglob("*") if p.is_file())) if path.is_dir() else (path,)
