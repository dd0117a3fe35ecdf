"""Results against each other: what differs in options, inputs and numbers."""

from __future__ import annotations

import math
import shutil
import tempfile
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd

from strapdown import __version__
from strapdown.bundle import (
    MANIFEST,
    InputFiles,
    Seal,
    check_destination,
    input_files,
    write_json,
    write_timing,
)
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.crash_case import CaseSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.config.reading import FileSpec
from strapdown.config.toml_file import read_toml
from strapdown.crash.case import run_cases
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats import csv
from strapdown.frames import place_difference
from strapdown.progress import Progress, silent
from strapdown.report.compare_folders import (
    Condition,
    FoundCode,
    InputRow,
    OptionRow,
    SealedRun,
    conditions,
    found_codes,
    input_rows,
    open_part,
    open_run,
    option_rows,
    seconds,
    shown_names,
)
from strapdown.report.compare_numbers import OF_THE_UNIT, Value, values_of
from strapdown.report.compare_tracks import (
    Curve,
    Difference,
    Track,
    curves_of,
    differences,
    plain_scores,
    tracks_of,
)
from strapdown.report.crash_case import CRASH, file_name
from strapdown.report.report_bundle import ReportBundle, finite, with_page
from strapdown.units import SHOWN_UNITS

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure

#: Instants that differ by less are the same, s.
SAME_INSTANT = 1e-6
#: Difference of two numbers that is rounding alone: relative to them, and in units of `FINE`.
ROUNDING, TINY = 1e-12, 1e-9
FINE = ("m", "m/s", "deg", "s", "%")


@dataclass(frozen=True)
class NumberRow:
    """One quantity of all runs, and how it differs from that of the first.

    Attributes
    ----------
    values : tuple of Value or None
        None where a run has none.
    differences : tuple of float or None
        Value minus that of the first run, in `difference_unit`; None for words, for a missing
        value, and for values of different instants.
    combined : tuple of float or None
        95 % bound of the difference, as of two independent errors; None without both bounds.
    """

    key: str
    values: tuple[Value | None, ...]
    differences: tuple[float | None, ...]
    combined: tuple[float | None, ...]

    @property
    def any(self) -> Value:
        """The value of the first run that has one, for group, label, unit and kind."""
        return next(one for one in self.values if one is not None)

    @property
    def difference_unit(self) -> str:
        """Unit of differences: m of latitudes and longitudes."""
        return "m" if self.any.kind in ("lat", "lon") else self.any.unit

    @property
    def within(self) -> tuple[bool | None, ...]:
        """Whether each difference is within its combined bound; None without one."""
        pairs = zip(self.differences, self.combined, strict=True)
        return tuple(None if d is None or b is None else abs(d) <= b for d, b in pairs)

    def alike(self, k: int) -> bool:
        """Whether run `k` has the value of the first, with the same bound, to rounding."""
        first, one = self.values[0], self.values[k]
        return first is not None and one is not None and _alike(one, first)

    @property
    def same(self) -> bool:
        """Whether all runs have this value, with the same bound."""
        return all(map(self.alike, range(len(self.values))))


def _alike(one: Value, first: Value) -> bool:
    pairs = ((one.value, first.value), (one.below, first.below), (one.above, first.above))
    for a, b in pairs:
        if isinstance(a, float | int) and isinstance(b, float | int):
            least = TINY if one.unit in FINE else 0.0
            if a != b and not abs(a - b) <= max(least, ROUNDING * max(abs(a), abs(b))):
                return False
        elif a != b:
            return False
    return one.kind != "horizontal" or one.place == first.place


@dataclass(frozen=True, eq=False, repr=False)
class RunComparison:
    """Results compared: in memory until `save` writes the page and its data.

    Attributes
    ----------
    runs : tuple of SealedRun
        In the order given; differences are against the first.
    options : tuple of OptionRow
        Options that differ, of the resolved configurations.
    equal_options : int
        How many do not.
    inputs : tuple of InputRow
    conditions : tuple of Condition
        Versions and properties of the platform that differ.
    numbers : tuple of NumberRow
        Of runs of one command.
    codes : tuple of FoundCode
        Findings of the runs.
    differences : tuple of Difference
        Differences over time of navigation, crash and attitude.
    tracks, curves : tuple of tuple
        Of each run: trajectories; cones of an outage, errors over rates.
    seconds : tuple of dict
        Times taken by stage, indicative: they are outside of the seals.
    findings : tuple of Finding
        What limits the comparison; a run that was changed after it was sealed.
    """

    runs: tuple[SealedRun, ...]
    options: tuple[OptionRow, ...]
    equal_options: int
    inputs: tuple[InputRow, ...]
    conditions: tuple[Condition, ...]
    numbers: tuple[NumberRow, ...]
    codes: tuple[FoundCode, ...]
    differences: tuple[Difference, ...]
    tracks: tuple[tuple[Track, ...], ...] = field(repr=False)
    curves: tuple[tuple[Curve, ...], ...] = field(repr=False)
    seconds: tuple[dict[str, float], ...]
    findings: tuple[Finding, ...]

    @property
    def same_command(self) -> bool:
        """Whether all runs are of one command."""
        return len({run.command for run in self.runs}) == 1

    @property
    def changed(self) -> bool:
        """Whether a run was changed after it was sealed."""
        return any(run.changed for run in self.runs)

    @property
    def units(self) -> str | None:
        """System of units in which crashes are shown, that of the first; None of other runs."""
        return units_of(self.runs[0]) if self.same_command else None

    @property
    def summary(self) -> str:
        """What differs, in a few sentences."""
        from strapdown.report.compare_document import headline

        return headline(self)

    @property
    def inputs_sealed(self) -> tuple[InputFiles, ...]:
        """The folders of the runs, as inputs of the comparison."""
        return tuple(
            replace(input_files("run", str(part.root), part.files), copied=run.ran)
            for run in self.runs
            for part in run.parts
        )

    def to_pandas(self) -> pd.DataFrame:
        """Return the numbers, by their keys.

        Returns
        -------
        DataFrame
            ``group``, ``quantity``, ``unit``; of each run its value and the ends of its 95 % bound
            (``NAME``, ``NAME low``, ``NAME high``); of each but the first ``NAME difference``,
            ``NAME combined`` (its 95 % bound) and ``NAME within``. Differences of latitude and
            longitude are in m.
        """
        rows = []
        for row in self.numbers:
            about = row.any
            made: dict[str, Any] = {"key": row.key, "group": about.group}
            made |= {"quantity": about.label, "unit": about.unit}
            for run, value in zip(self.runs, row.values, strict=True):
                low, high = _ends(value)
                made |= {run.name: value and value.value}
                made |= {f"{run.name} low": low, f"{run.name} high": high}
            for k, run in enumerate(self.runs[1:], start=1):
                made[f"{run.name} difference"] = row.differences[k]
                made[f"{run.name} combined"] = row.combined[k]
                made[f"{run.name} within"] = row.within[k]
            rows.append(made)
        return pd.DataFrame(rows, columns=None if rows else ["key"]).set_index("key")

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as plain data for programs, as in ``compare.json``."""
        return comparison_json(self)

    def plot(self, kind: str = "differences") -> ChartFigure:
        """Draw one chart of the page.

        Parameters
        ----------
        kind : str
            ``differences``, ``plan``, ``attitude`` or ``cone``, as the runs have it; of several
            vehicles with ``-vehicle-1``.

        Raises
        ------
        ConfigError
            These runs have no such chart.
        """
        from strapdown.report.chart_svg import ChartFigure
        from strapdown.report.compare_charts import charts

        drawn = {chart.slug: chart for chart in charts(self)}
        if kind not in drawn:
            raise ConfigError("compare.no-chart", quantity="kind", word=kind, known=drawn)
        return ChartFigure(drawn[kind])

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the comparison as a sealed folder, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder. The compared runs are copied into it, if they have at most 64 MiB together;
            runs that were made for the comparison always.
        report : bool
            Whether to write the page and its figures as well.
        force : bool
            Overwrite an existing result.
        progress : callable, optional

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten, or is inside a compared run.
        DataError
            A run has changed since it was read.
        """
        for run in self.runs:
            if Path(out).resolve().is_relative_to(run.path.resolve()):
                raise ConfigError("compare.inside", file=str(out), quantity="--out")
        check_destination(Path(out), force)
        return COMPARE.write(
            _Sealed(self, self.inputs_sealed), out, report=report, force=force, progress=progress
        )

    def __repr__(self) -> str:
        names = " | ".join(run.name for run in self.runs)
        return f"<RunComparison {names}\n{self.summary}>"

    def _repr_html_(self) -> str:
        table = self.to_pandas()
        shown = table.loc[[row.key for row in self.numbers if not row.same]]
        html = shown.to_html(float_format="{:.6g}".format)
        return f"<div><b>{escape(self.summary)}</b></div>{html}"


def _ends(value: Value | None) -> tuple[float | None, float | None]:
    """Ends of the 95 % bound of a value, in its own unit."""
    if value is None or not isinstance(value.value, float | int) or value.kind in ("lat", "lon"):
        return None, None
    low = None if value.below is None else value.value - value.below
    high = None if value.above is None else value.value + value.above
    return low, high


# Compare.


class Saved(Protocol):
    """A run in memory, of any command."""

    def save(self, out: Path, *, report: bool) -> Any:
        """Write it as a sealed folder."""


def compare_results(
    given: Sequence[str | Path | Saved], progress: Progress = silent
) -> RunComparison:
    """Compare result folders, runs in memory, and configurations, which are run first.

    Parameters
    ----------
    given : sequence of (str, Path or run)
        Folders of results; TOML files of `navigate`, `align` or `crash`; runs in memory, named by
        their index.
    progress : callable, optional

    Returns
    -------
    RunComparison
        What is run or saved for it is in a temporary folder, which is removed with it.

    Raises
    ------
    ConfigError
        Fewer than two runs are given, one is given twice, a configuration is faulty, or runs of
        different commands have no option and no input in common.
    DataError
        A folder is not a result, or its files are damaged.
    """
    if len(given) < 2:
        raise ConfigError("compare.one-run", quantity="RUN", count=len(given))
    paths = {k: Path(one) for k, one in enumerate(given) if isinstance(one, str | Path)}
    places = [path.resolve() for path in paths.values()]
    for k, path in enumerate(paths.values()):
        if places[k] in places[:k]:
            raise ConfigError("compare.same-run", file=str(path), quantity="RUN")
    for path in paths.values():
        _check(path)
    names = {k: f"run {k + 1}" for k in range(len(given))}
    names |= dict(zip(paths, shown_names(list(paths.values())), strict=True))
    made = Path(tempfile.mkdtemp(prefix="strapdown-")).resolve()
    try:
        runs = []
        for k, one in enumerate(given):
            share = 0.8 / len(given)

            def told(stage: str, done: float, k: int = k, share: float = share) -> None:
                progress(f"{names[k]}: {stage}", share * (k + done))

            told("reading", 0.0)
            if k not in paths:
                assert not isinstance(one, str | Path)
                one.save(made / f"run-{k + 1}", report=False)
                runs.append(open_run(made / f"run-{k + 1}", names[k], ran=True))
            elif paths[k].is_file():
                place = made / str(k + 1) / paths[k].stem
                place.parent.mkdir()
                _run_file(paths[k], place, told)
                runs.append(open_run(place, names[k], ran=True))
            else:
                runs.append(open_run(paths[k].absolute(), names[k]))
        progress("comparing", 0.8)
        result = compared(runs)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise
    weakref.finalize(result, shutil.rmtree, made, ignore_errors=True)
    return result


def compared(runs: Sequence[SealedRun]) -> RunComparison:
    """Compare opened runs; errors as `compare_results`."""
    options, equal = option_rows(runs)
    inputs = input_rows(runs)
    commands = tuple(dict.fromkeys(run.command for run in runs))
    findings: list[Finding] = [
        Finding("compare.changed", file=run.name, names=[str(one.file) for one in run.changed])
        for run in runs
        if run.changed
    ]
    if len(commands) > 1:
        shared = any(row.same for row in inputs if "missing" not in row.status)
        if not (options or equal or shared):
            raise ConfigError("compare.nothing-in-common", quantity="RUN", commands=commands)
        findings.append(Finding("compare.other-commands", severity="note", commands=commands))
        tracks: tuple[tuple[Track, ...], ...] = tuple(() for _ in runs)
        curves: tuple[tuple[Curve, ...], ...] = ()
        numbers: tuple[NumberRow, ...] = ()
        codes: tuple[FoundCode, ...] = ()
    else:
        one_unit = _same_record(options, inputs)
        numbers, codes = number_rows(runs, one_unit=one_unit), found_codes(runs)
        read = [tracks_of(run) for run in runs]
        tracks, curves = tuple(own for own, _ in read), tuple(map(curves_of, runs))
        findings += [one for _, own in read for one in own]
    found: list[Difference] = []
    for k, run in enumerate(runs[1:], start=1):
        made, told = differences(tracks[0], tracks[k], k, run.name)
        found += made
        findings += told
    if found and any("changed" in row.status for row in inputs if _is_record(row)):
        findings.append(Finding("compare.other-logs", severity="note"))
    if any(row.key == "against.name" for row in numbers):
        truths = [row for row in inputs if row.role == "truth" and "changed" in row.status]
        if truths:
            findings.append(Finding("compare.other-truth"))
    return RunComparison(
        tuple(runs),
        options,
        equal,
        inputs,
        conditions(runs),
        numbers,
        codes,
        tuple(found),
        tracks,
        curves,
        tuple(seconds(run) for run in runs),
        tuple(findings),
    )


def _is_record(row: InputRow) -> bool:
    return row.role.rpartition(": ")[2] == "log"


def units_of(run: SealedRun) -> str | None:
    """System of units in which a crash is shown; None of other runs."""
    if run.command != "crash":
        return None
    found = run.parts[0].answer.get("units")
    return found if found in SHOWN_UNITS else "metric"


def _same_record(options: Sequence[OptionRow], inputs: Sequence[InputRow]) -> bool:
    """Whether all runs are of the same samples: of one log, or of one simulation."""
    logs = [row for row in inputs if _is_record(row)]
    if logs:
        return all(row.same for row in logs)
    return not any(row.key.startswith(("simulation.", "sensors.")) for row in options)


def number_rows(runs: Sequence[SealedRun], *, one_unit: bool = True) -> tuple[NumberRow, ...]:
    """Return the numbers of runs of one command, by their keys, in the order of the first.

    `one_unit`: whether all runs are of one sensor in one record; otherwise its errors differ as
    units do, and their differences have no bound.
    """
    several = any(len(run.parts) > 1 for run in runs)
    every: list[dict[str, Value]] = []
    for run in runs:
        own: dict[str, Value] = {}
        for k, part in enumerate(run.parts, start=1):
            for value in values_of(part):
                if several:
                    group = f"Vehicle {k}: {value.group}"
                    value = replace(value, key=f"vehicle {k}.{value.key}", group=group)
                own.setdefault(value.key, value)
        every.append(own)
    groups = list(dict.fromkeys(value.group for own in every for value in own.values()))
    rows = []
    for key in dict.fromkeys(key for own in every for key in own):
        values = tuple(own.get(key) for own in every)
        first = values[0]
        pairs = [(None, None), *(_difference(first, other) for other in values[1:])]
        if not one_unit and any(v is not None and OF_THE_UNIT in v.group for v in values):
            pairs = [(apart, None) for apart, _ in pairs]
        rows.append(NumberRow(key, values, *map(tuple, zip(*pairs, strict=True))))
    return tuple(sorted(rows, key=lambda row: groups.index(row.any.group)))


def _difference(first: Value | None, other: Value | None) -> tuple[float | None, float | None]:
    """Difference of two values, and its 95 % bound, as of two independent errors."""
    apart = None if first is None or other is None else _apart(first, other)
    if first is None or other is None or apart is None or not math.isfinite(apart):
        return None, None
    # The sides that face each other.
    a, b = (first.above, other.below) if apart >= 0.0 else (first.below, other.above)
    half = None if a is None or b is None else math.hypot(a, b)
    return apart, half if half is not None and math.isfinite(half) else None


def _apart(first: Value, other: Value) -> float | None:
    """Other minus first; None for words, other units and other instants."""
    if (first.kind, first.unit) != (other.kind, other.unit):
        return None
    if first.at is not None and other.at is not None:
        least = max(SAME_INSTANT, 8.0 * math.ulp(first.at))
        if abs(first.at - other.at) > least:
            return None
    if first.place is not None and other.place is not None:
        try:
            north, east, _ = map(float, place_difference(other.place, first.place))
        except StrapdownError:
            return None
        return {"lat": north, "lon": east}.get(first.kind, math.hypot(north, east))
    if not isinstance(first.value, float | int) or not isinstance(other.value, float | int):
        return None
    apart = other.value - first.value
    return (apart + 180.0) % 360.0 - 180.0 if first.kind == "angle" else apart


# Configurations, which are run first.


def _check(path: Path) -> None:
    """Refuse what is neither a folder of a result nor a configuration, before anything is run."""
    if path.is_file():
        if path.suffix.lower() != ".toml":
            raise ConfigError("compare.no-run", file=str(path), quantity="RUN")
        _kind_of(path)
    elif not path.exists():
        if path.suffix.lower() == ".toml":
            read_toml(path)
        raise DataError("bundle.no-such-folder", file=str(path))


def _kind_of(path: Path) -> str:
    """Command of a configuration: by the keys that only one command has, else navigation."""
    keys = set(read_toml(path).table)
    forms: dict[str, type[FileSpec]]
    forms = {"navigate": NavigationSpec, "align": AlignmentSpec, "crash": CaseSpec}
    fit = [name for name, form in forms.items() if keys <= set(form.model_fields) - {"name"}]
    if not fit:
        near = [name for name, form in forms.items() if len(keys & set(form.model_fields)) > 1]
        if len(near) != 1 and not {"units", "entry"} & keys:
            raise ConfigError("compare.file-of-no-run", file=str(path), quantity="RUN", known=forms)
        return "crash" if {"units", "entry"} & keys else near[0]
    if fit[:2] == ["navigate", "align"]:
        try:
            NavigationSpec.read(path)
        except ConfigError:
            return "align"
    return fit[0]


def _run_file(path: Path, out: Path, progress: Progress) -> None:
    """Run a configuration into a folder, without a report."""
    begin, kind = perf_counter(), _kind_of(path)
    if kind == "navigate":
        from strapdown.report.navigation import NAVIGATION
        from strapdown.systems.navigation_run import run_navigation

        run = run_navigation(NavigationSpec.read(path), path, progress)
        seal = NAVIGATION.write(run, out, report=False)
    elif kind == "align":
        from strapdown.report.alignment import ALIGNMENT
        from strapdown.systems.alignment_run import run_alignment

        seal = ALIGNMENT.write(run_alignment(AlignmentSpec.read(path), path), out, report=False)
    else:
        (result,) = run_cases([(CaseSpec.read(path), path)], progress)
        seal = CRASH.write(result, out, report=False)
    write_timing(seal, {"run": perf_counter() - begin})


# A comparison as JSON.


def comparison_json(result: RunComparison) -> dict[str, Any]:
    """Return a comparison as plain data for programs, in SI and degrees.

    Lists of values are in the order of ``runs``; differences are against the first, whose own are
    null.
    """
    data = {
        "schema": "strapdown compare 1",
        "strapdown": __version__,
        "summary": result.summary,
        "same_command": result.same_command,
        "runs": [
            {
                "name": run.name,
                "command": run.command,
                "seals": [part.seal for part in run.parts],
                "vehicles": len(run.parts),
                "ran_for_comparison": run.ran,
                "changed_after_sealing": [
                    {"file": str(one.file), "code": one.code} for one in run.changed
                ],
                "strapdown": run.parts[0].manifest["versions"].get("strapdown"),
            }
            for run in result.runs
        ],
        "options": [{"key": row.key, "values": row.values} for row in result.options],
        "equal_options": result.equal_options,
        "inputs": [
            {
                "role": row.role,
                "same": row.same,
                "status": row.status,
                "files": [
                    file and dict(zip(("name", "sha256", "bytes"), file, strict=True))
                    for file in row.files
                ],
            }
            for row in result.inputs
        ],
        "conditions": [{"name": row.name, "values": row.values} for row in result.conditions],
        "numbers": [
            {
                "key": row.key,
                "group": row.any.group,
                "quantity": row.any.label,
                "kind": row.any.kind,
                "unit": row.any.unit,
                "values": [one and one.value for one in row.values],
                "below_95": [one and one.below for one in row.values],
                "above_95": [one and one.above for one in row.values],
                "difference_unit": row.difference_unit,
                "differences": row.differences,
                "combined_95": row.combined,
                "within": row.within,
                "same": row.same,
            }
            for row in result.numbers
        ],
        "findings_of_runs": [
            {
                "code": one.code,
                "severity": one.severity,
                "counts": one.counts,
                "differs": one.differs,
                "sentence": one.sentence,
            }
            for one in result.codes
        ],
        "differences": [
            {"run": result.runs[one.run].name, **plain_scores(one)} for one in result.differences
        ],
        "seconds": result.seconds,
        "findings": [one.plain("cli") for one in result.findings],
    }
    return finite(data)


# The sealed folder.


@dataclass(frozen=True)
class _Sealed:
    """A comparison with its inputs, whose digests are taken once."""

    comparison: RunComparison
    inputs: tuple[InputFiles, ...]


def _configuration(sealed: _Sealed) -> dict[str, Any]:
    runs = [
        {
            "name": run.name,
            "ran_for_comparison": run.ran,
            "parts": [{"label": part.label, "path": str(part.root)} for part in run.parts],
        }
        for run in sealed.comparison.runs
    ]
    return {"compare": {"runs": runs}}


def _run(configuration: dict[str, Any]) -> _Sealed:
    runs = []
    try:
        for one in configuration["compare"]["runs"]:
            parts = tuple(open_part(Path(p["path"]), str(p["label"])) for p in one["parts"])
            ran = bool(one["ran_for_comparison"])
            runs.append(SealedRun(str(one["name"]), parts[0].root, parts, ran))
    except (KeyError, IndexError, TypeError) as error:
        raise DataError(
            "report.configuration-not-understood", file=MANIFEST, errors=error
        ) from None
    result = compared(runs)
    return _Sealed(result, result.inputs_sealed)


def _write_data(sealed: _Sealed, folder: Path) -> None:
    result = sealed.comparison
    write_json(folder / "compare.json", comparison_json(result))
    made: set[str] = set()

    for one in result.differences:
        name = file_name(f"differences-{one.run + 1}-{one.label}".rstrip("-"), made)
        comments = {
            "of": f"{result.runs[one.run].name} minus {result.runs[0].name}",
            "units": "s, m, m/s, deg; combined, first, other: 95 % bounds",
        }
        columns = {str(c): one.table[c].to_numpy() for c in one.table.columns}
        time = one.table.index.to_numpy(dtype=float)
        csv.write(folder / f"{name}.csv", {"time_s": time, **columns}, comments)


def _document(sealed: _Sealed, name: str) -> Any:
    from strapdown.report.compare_document import compare_document

    return compare_document(sealed.comparison, name)


#: Page, JSON and differences over time of a comparison.
COMPARE: ReportBundle[_Sealed] = ReportBundle(
    "compare", _configuration, _run, with_page(_write_data, _document)
)
