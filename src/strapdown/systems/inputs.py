"""Inputs of a run: files, tables in memory, and the part of a log that is used."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.bundle.configuration_paths import with_paths
from strapdown.bundle.seal import InputFiles
from strapdown.errors import ConfigError
from strapdown.formats import csv
from strapdown.formats.clocks import GPS, UNIX, clock_of
from strapdown.formats.log_writers import LOG_WRITERS

__all__ = [
    "NOWHERE",
    "Memory",
    "check_part",
    "moved_inputs",
    "moved_paths",
    "part_of_log",
]


def check_part(from_s: float | None, to_s: float | None, duration_s: float | None) -> None:
    """Refuse an invalid part.

    Parameters
    ----------
    from_s, to_s, duration_s : float or None, s

    Raises
    ------
    ConfigError
        Both end and duration are given, it ends before it begins, or a value is not finite.
    """
    for flag, value in (("--from", from_s), ("--to", to_s), ("--duration", duration_s)):
        if value is not None and not np.isfinite(value):
            raise ConfigError("io.part-not-finite", quantity=flag, value=value)
    if to_s is not None and duration_s is not None:
        raise ConfigError(
            "io.part-ends-twice",
            quantity="--to, --duration",
            to_s=to_s,
            duration_s=duration_s,
        )
    if duration_s is not None and not duration_s > 0.0:
        raise ConfigError(
            "io.part-duration-not-positive", quantity="--duration", duration_s=duration_s
        )
    if from_s is not None and to_s is not None and not from_s < to_s:
        raise ConfigError(
            "io.part-ends-before-it-begins", quantity="--to", to_s=to_s, from_s=from_s
        )


def part_of_log(
    imu: pd.DataFrame,
    from_s: float | None,
    to_s: float | None,
    duration_s: float | None,
    name: str,
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
        The same table if all of it is used.

    Raises
    ------
    ConfigError
        Fewer than two samples lie between them, or as `check_part`.
    """
    check_part(from_s, to_s, duration_s)
    time = imu.index.to_numpy(dtype=np.float64)
    first = float(time[0]) if from_s is None else from_s
    last = float(time[-1]) if to_s is None else to_s
    if duration_s is not None:
        last = first + duration_s
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
            from_s=first,
            to_s=last,
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


# Tables in memory as input files of a bundle.


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

    @contextmanager
    def as_files(self) -> Iterator[Path]:
        """Write each table exactly into a temporary folder, which is removed at the end."""
        with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
            folder = Path(name).resolve()
            for file, table in self.tables.items():
                if file.endswith(".npz"):
                    LOG_WRITERS["npz"](folder / file, table, None)
                else:
                    _write_csv(folder / file, table)
            yield folder


def _write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write the named columns, with the unit that their quantity has in a table."""
    clock = clock_of(table).name
    name = {GPS: "gps_sow_s", UNIX: "unix_time_s"}.get(clock, "time_s")
    columns = {name: table.index.to_numpy(dtype=np.float64)}
    week = table.attrs.get("gps_week")
    if clock == GPS and week is not None:
        columns["week"] = np.full(len(table), float(week))
    for column in table.columns:
        unit = _UNITS.get(str(column).removesuffix("_sd"), "")
        columns[f"{column}{unit}"] = table[column].to_numpy(dtype=np.float64)
    csv.write(path, columns, {})


_UNITS = {
    **dict.fromkeys(("lat", "lon", "roll", "pitch", "heading"), "_deg"),
    **dict.fromkeys(("alt", "north", "east", "down", "height"), "_m"),
    **dict.fromkeys(("VN", "VE", "VD", "speed", "vx", "vy", "vz"), "_m_s"),
}


def moved_inputs(
    inputs: tuple[InputFiles, ...], old: Path, new: Path, *, copied: bool = False
) -> tuple[InputFiles, ...]:
    """Move inputs from one folder to another.

    Parameters
    ----------
    inputs : tuple of InputFiles
    old, new : Path
    copied : bool
        Whether a bundle copies the inputs in `new`, whatever their size.
    """
    return tuple(
        replace(
            one,
            path=new / one.path.relative_to(old),
            files=tuple(new / f.relative_to(old) for f in one.files),
            copied=copied,
        )
        if one.path.is_relative_to(old)
        else one
        for one in inputs
    )


def moved_paths(configuration: Any, old: Path, new: Path) -> Any:
    """A configuration as plain data, with paths moved from one folder to another."""

    def change(path: str) -> str:
        given = Path(path)
        return str(new / given.relative_to(old)) if given.is_relative_to(old) else path

    return with_paths(configuration, change)
