"""Inputs of a run and its result as files: tables in memory, the used part of a log, `save`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, Seal, check_destination, input_files, with_paths
from strapdown.config.reading import FileSpec
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats import csv
from strapdown.formats.recording import ReadOptions
from strapdown.lazy_names import named
from strapdown.progress import Progress, silent
from strapdown.tables.on_disk import let_go
from strapdown.tables.sample_clock import ends_of_part

if TYPE_CHECKING:
    from strapdown.config.logs import LogTable
    from strapdown.config.sources import LogSpec


def check_part(from_s: float | None, to_s: float | None, duration_s: float | None) -> None:
    """Refuse an invalid part.

    Parameters
    ----------
    from_s, to_s, duration_s : float or None, s
    """
    for flag, value in (("--from", from_s), ("--to", to_s), ("--duration", duration_s)):
        if value is not None and not np.isfinite(value):
            raise ConfigError("io.part-not-finite", quantity=flag, value=value)
    if to_s is not None and duration_s is not None:
        raise ConfigError(
            "io.part-ends-twice", quantity="--to, --duration", to_s=to_s, duration_s=duration_s
        )
    if duration_s is not None and not duration_s > 0.0:
        raise ConfigError(
            "io.part-duration-not-positive", quantity="--duration", duration_s=duration_s
        )
    if from_s is not None and to_s is not None and not from_s < to_s:
        raise ConfigError(
            "io.part-ends-before-it-begins", quantity="--to", to_s=to_s, from_s=from_s
        )


def read_options(log: LogSpec | LogTable, axes: str | None) -> ReadOptions:
    """Return the options with which the file of a log is read, its axes as letters."""
    return ReadOptions(
        format=log.format,
        columns=dict(log.columns),
        gyro_unit=log.gyro_unit,
        accel_unit=log.accel_unit,
        time_unit=log.time_unit,
        axes=axes,
        sampling=log.sampling,
        rate=log.rate_hz,
        repair=log.repair,
        calibration=log.calibration,
    )


def part_of_log(
    imu: pd.DataFrame, from_s: float | None, to_s: float | None, duration_s: float | None, name: str
) -> pd.DataFrame:
    """Return the samples between two instants, both included.

    Parameters
    ----------
    imu : DataFrame
        Imu table.
    from_s, to_s : float or None, s
        On the log's own clock; its first and its last stamp, where they are not given.
    duration_s : float or None, s
        Duration from `from_s`, or from the first stamp, instead of `to_s`.
    name : str
        Of the log, for messages.

    Returns
    -------
    DataFrame
        The same table if it is used whole.
    """
    check_part(from_s, to_s, duration_s)
    if from_s is None and to_s is None and duration_s is None and len(imu) >= 2:
        return imu
    time = imu.index.to_numpy(dtype=np.float64)
    first, last = ends_of_part(float(time[0]), from_s, to_s, duration_s)
    # A stamp that is a sum of steps may miss the instant by rounding.
    slack = 1e-6 * float(np.median(np.diff(time)))
    kept = (time >= first - slack) & (time <= last + slack)
    if kept.sum() < 2:
        ends = to_s is not None or duration_s is not None
        raise ConfigError(
            "io.part-between"
            if from_s is not None and ends
            else "io.part-up-to"
            if ends
            else "io.part-from",
            file=name,
            quantity="time",
            kept=int(kept.sum()),
            from_s=float(time[0]) if from_s is None else first,
            to_s=last if ends else float(time[-1]),
            time=time[0],
            time_2=time[-1],
        )
    if kept.all():
        return imu
    out = imu[kept]
    out.attrs = dict(imu.attrs)
    if out.attrs.get("first_row") is not None:
        out.attrs["first_row"] += int(np.argmax(kept))
    return out


#: Most time of a log in which a position is carried on: a month, or ten seconds a sample.
MOST_SPAN, MOST_STEP = 30.0 * 86400.0, 10.0  # s


def refuse_long_span(imu: pd.DataFrame, name: str) -> None:
    """Refuse a log over a clock that was set: grids over its time would be without limit.

    Parameters
    ----------
    imu : DataFrame
        Used part of an Imu table.
    name : str
        Of the log, for messages.

    Raises
    ------
    DataError
        The log is longer than a month, and than ten seconds for each of its samples.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    if time[-1] - time[0] <= max(MOST_SPAN, MOST_STEP * time.size):
        return
    k = int(np.diff(time).argmax())
    row = imu.attrs.get("first_row")
    raise DataError(
        "io.clock-set-in-log",
        file=name,
        row=None if row is None else row + k + 1,
        quantity="time",
        pause_days=(time[k + 1] - time[k]) / 86400.0,
        before=time[k],
        after=time[k + 1],
    )


# Tables in memory as input files of a bundle.


R = TypeVar("R")

#: Stands for the folder of the files that a bundle makes of tables in memory.
NOWHERE = Path("memory")


@dataclass(frozen=True)
class Memory:
    """Tables in memory, by their names as input files.

    Attributes
    ----------
    tables : mapping of str to DataFrame
        ``imu.npz``: an Imu table; ``NAME.csv``: a table by time, its columns in SI and degrees.
    """

    tables: Mapping[str, pd.DataFrame]

    @classmethod
    def of(cls, inputs: Mapping[str, Any]) -> Memory:
        """Return the tables among some inputs, by their names as files."""
        return cls({file: t for file, t in inputs.items() if isinstance(t, pd.DataFrame)})

    @contextmanager
    def as_files(self) -> Iterator[Path]:
        """Write each table exactly into a temporary folder, which is removed at the end.

        Without tables the folder is `NOWHERE`.
        """
        if not self.tables:
            yield NOWHERE
            return
        from strapdown.formats.writers import WRITERS, table_columns, table_comments

        with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
            folder = Path(name).resolve()
            for file, table in self.tables.items():
                if file.endswith(".npz"):
                    WRITERS["npz"].write(folder / file, {"imu": table})
                else:
                    csv.write(folder / file, table_columns(table), table_comments(table))
                let_go(table)
            yield folder


def _moved_inputs(inputs: Iterable[InputFiles], old: Path, new: Path) -> tuple[InputFiles, ...]:
    """Inputs moved from one folder to another; a bundle copies those of tables in memory."""
    return tuple(
        replace(
            one,
            path=new / one.path.relative_to(old),
            files=tuple(new / f.relative_to(old) for f in one.files),
            copied=True,
        )
        if one.path.is_relative_to(old)
        else one
        for one in inputs
    )


def moved_paths(configuration: Any, old: Path, new: Path) -> Any:
    """Return a configuration, or its plain data, with paths moved from one folder to another."""
    if isinstance(configuration, FileSpec):
        return type(configuration).checked(moved_paths(configuration.plain(), old, new))

    def change(path: str) -> str:
        given = Path(path)
        return str(new / given.relative_to(old)) if given.is_relative_to(old) else path

    return with_paths(configuration, change)


def moved(result: R, key: str, old: Path, new: Path) -> R:
    """Return a result whose tables in memory are files in one folder, as files in another.

    Parameters
    ----------
    result : dataclass
        With `inputs`.
    key : str
        Field with the configuration that names their paths.
    old, new : Path
        As of `Memory.as_files`; `NOWHERE` without files.
    """
    if old == new:
        return result
    configuration = moved_paths(getattr(result, key), old, new)
    run: Any = result
    changed: R = replace(run, **{key: configuration, "inputs": _moved_inputs(run.inputs, old, new)})
    return changed


def configuration_file(file: Path | None) -> tuple[InputFiles, ...]:
    """Return the configuration file of a run, if it has one, as an input."""
    return () if file is None else (input_files("configuration", str(file), (file,)),)


class SavedRun:
    """Result of a run: data in memory until `save` writes it."""

    #: Field with the configuration that names the paths of the inputs.
    configuration: ClassVar[str] = "spec"
    #: Its `ReportBundle`, imported on demand: ``module:name``.
    bundle: ClassVar[str]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
    memory: Memory

    def in_folder(self, old: Path, new: Path) -> Self:
        """Return the run with its inputs in memory moved from one folder to another."""
        return moved(self, self.configuration, old, new)

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the run as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder. Tables given in memory become input files in it.
        report : bool
            Whether to write its pages and figures as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        check_destination(Path(out), force)
        write: Callable[..., Seal] = named(self.bundle).write
        with self.memory.as_files() as folder:
            run = self.in_folder(NOWHERE, folder)
            return write(run, out, report=report, force=force, progress=progress)

    def _repr_html_(self) -> str:
        found = "".join(f"<li>{escape(str(f))}</li>" for f in self.findings)
        return f"<div><b>{escape(repr(self)[1:-1])}</b></div>{self._table_html()}<ul>{found}</ul>"

    def _table_html(self) -> str:
        return ""
