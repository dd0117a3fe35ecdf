"""Examine logs from Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.api.reading import ImuFile, imu_input, log_table
from strapdown.config.logs import DoctorSpec, FixesTable
from strapdown.config.spec import specify
from strapdown.progress import Progress, silent
from strapdown.systems.clean_log import write_clean_log
from strapdown.systems.doctor import Diagnosis as Diagnosis
from strapdown.systems.doctor import run_doctor
from strapdown.systems.inputs import NOWHERE, Memory


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
    logs : str, Path, Imu, DataFrame, (t, gyro, accel), or a list of them
        Files, folders or samples; fixes may be in a file of their own.
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
    one = isinstance(logs, str | Path | pd.DataFrame | ImuFile | tuple)
    given = [imu_input(log) for log in ([logs] if one else logs)]
    named = {f"imu-{k + 1}.npz": log for k, log in enumerate(given)}
    memory = Memory.of(named)
    keys = {**options, **{f"{quantity}_unit": unit for quantity, unit in (units or {}).items()}}
    stated = {key: value for key, value in keys.items() if value}
    with memory.as_files() as folder:
        tables = [log_table(log, folder / name, stated) for name, log in named.items()]
        name = ", ".join(Path(table.path).resolve().stem for table in tables)
        own = tuple((x.axes if isinstance(x, ImuFile) else None) or "" for x in given)
        stated_axes = axes or (own[0] if len(set(own)) == 1 else own) or None
        fixes = [specify(FixesTable, path=t.path, **gnss) for t in tables] if gnss else []
        spec = specify(
            DoctorSpec, name=name, logs=tuple(tables), fixes=tuple(fixes), axes=stated_axes
        )
        found = run_doctor(spec, progress)
        if fix is not None:
            write_clean_log(found, fix, force=force)
        return replace(found, memory=memory).in_folder(folder, NOWHERE)
