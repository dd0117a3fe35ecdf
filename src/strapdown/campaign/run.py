"""A campaign from its file to its sealed folder: run, resumed, merged, and one case by itself."""

from __future__ import annotations

import math
import shutil
import tempfile
import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.bundle import (
    InputFiles,
    Seal,
    read_manifest,
    resolved,
    source_digest,
    write_json,
)
from strapdown.campaign.case_process import run_case
from strapdown.campaign.dataset import CAMPAIGN, Dataset, frozen_of
from strapdown.campaign.design import Campaign
from strapdown.campaign.engine import Workers, run_batches
from strapdown.campaign.kinds import KINDS
from strapdown.campaign.specification import CampaignSpec
from strapdown.campaign.statistics import share_of, student_interval
from strapdown.errors import ConfigError, DataError, StrapdownError
from strapdown.progress import Progress, silent
from strapdown.report.report_bundle import ReportBundle

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
    inputs: tuple[InputFiles, ...]
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
    ) -> Seal:
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
    return {**design.frozen(), "digests": digests, "source": source_digest()}


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
    write_json(folder / CAMPAIGN, run.design.plain())
    run.dataset.write_blocks(folder, lambda table: _kept(table, run.stopped))
    write_json(folder / "summary.json", run.summary)
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
    manifest = read_manifest(path)
    configuration = resolved(manifest["configuration"], path)
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


def save_case(design: Campaign, result: Any, out: Path, force: bool) -> Seal:
    """Write the sealed folder of one case, with its report."""
    seal: Seal = KINDS[design.spec.base.kind].save(result, out, force)
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
