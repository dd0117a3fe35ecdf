"""Examine logs from Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.api.reading import GnssFile, ImuFile, imu_input, log_table, table_input
from strapdown.api.stamps import as_frame
from strapdown.config.logs import DoctorSpec, FixesTable, LogTable
from strapdown.config.spec import specify
from strapdown.progress import Progress, silent
from strapdown.systems.clean_log import write_clean_log
from strapdown.systems.doctor import Diagnosis as Diagnosis
from strapdown.systems.doctor import run_doctor
from strapdown.systems.inputs import NOWHERE, Memory
from strapdown.tables import GYRO


def doctor(
    logs: Any,
    *,
    axes: str | None = None,
    units: Mapping[str, str] | None = None,
    gnss: Mapping[str, Any] | None = None,
    fix: str | Path | None = None,
    force: bool = False,
    progress: Progress = silent,
    **options: Any,
) -> Diagnosis:
    """Examine logs: streams, clocks, units, channels, faults, and what they suffice for.

    Parameters
    ----------
    logs : str, Path, Imu, GnssFixes, DataFrame, (t, gyro, accel), or a list of them
        Files, folders or samples; fixes may be in a file or a table of their own.
    axes, units
        As of `read_imu`, for every log: how it is read. By default a log from `read_imu` has its
        own.
    gnss : mapping, optional
        How the fixes are read: options of `read_gnss`, as ``{"datum_height_m": 45.0}``.
    fix : str or Path, optional
        ``.parquet`` or ``.csv``: write a clean log here, in SI and body axes, with increasing
        stamps, other streams beside it, and the record of what was done in ``.json``.
    force : bool
        Replace existing files of `fix`.
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        Further keys of a log: ``columns``, ``format``, ``sampling``, ``rate_hz``, ``from_s``,
        ``to_s``, ``duration_s``, ``repair``.

    Returns
    -------
    Diagnosis
        Data, findings, `logs` with their tables; `save` writes the page and the JSON.

    Raises
    ------
    DataError
        No log holds anything that can be read; or `fix` is given and the log leaves something open.
    ConfigError
        A file does not exist, or an option does not fit it.
    """
    logs = as_frame(logs)
    one = isinstance(logs, str | Path | pd.DataFrame | ImuFile | tuple | Mapping)
    given = [_input(log) for log in ([logs] if one else logs)]
    named = {
        f"fixes-{k + 1}.csv" if _are_fixes(log) else f"imu-{k + 1}.npz": log
        for k, log in enumerate(given)
    }
    memory = Memory.of(named)
    keys = {**options, **{f"{quantity}_unit": unit for quantity, unit in (units or {}).items()}}
    stated = {key: value for key, value in keys.items() if value}
    with memory.as_files() as folder:
        tables = [_table(log, folder / name, stated) for name, log in named.items()]
        name = ", ".join(Path(table.path).resolve().stem for table in tables)
        own = tuple((x.axes if isinstance(x, ImuFile) else None) or "" for x in given)
        stated_axes = axes or (own[0] if len(set(own)) == 1 else own) or None
        read = [{**(x.keys() if isinstance(x, GnssFile) else {}), **(gnss or {})} for x in given]
        fixes = [
            specify(FixesTable, path=t.path, **keys)
            for t, keys in zip(tables, read, strict=True)
            if keys
        ]
        spec = specify(
            DoctorSpec, name=name, logs=tuple(tables), fixes=tuple(fixes), axes=stated_axes
        )
        found = run_doctor(spec, progress)
        if fix is not None:
            write_clean_log(found, fix, force=force)
        return replace(found, memory=memory).in_folder(folder, NOWHERE)


def _are_fixes(log: Any) -> bool:
    """Whether a table is of positions alone."""
    return (
        isinstance(log, pd.DataFrame)
        and {"lat", "lon"} <= {*log.columns}
        and not {*GYRO} & {*log.columns}
    )


def _input(log: Any) -> Any:
    """Samples or fixes in any form: a file still to be read, or a checked table."""
    log = as_frame(log)
    return table_input(log, "gnss") if _are_fixes(log) else imu_input(log)


def _table(
    log: ImuFile | GnssFile | pd.DataFrame, file: Path, stated: Mapping[str, Any]
) -> LogTable:
    """How a log is read; `stated` is of samples, and not of fixes."""
    if isinstance(log, GnssFile):
        options = log.options
        return specify(LogTable, path=log.path, format=options.format, repair=options.repair)
    return log_table(log, file, {} if _are_fixes(log) else stated)
