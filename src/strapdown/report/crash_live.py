"""Write what a live crash detection received and found as a sealed bundle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle import Seal, input_files, write_bundle, write_json
from strapdown.crash.watch import CrashLog, WatchOptions
from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.crash_writers import ACCEL_HEADINGS, GYRO_HEADINGS, TIME
from strapdown.tables.checks import Array
from strapdown.units import GYRO_UNITS

COMMAND = "crash --live"
RECEIVED, DETECTIONS = "received.csv", "detections.json"
_RATES = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
_FORCES = ("accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2")
Rows = Sequence[Sequence[float]]


def write_received(path: Path, table: Array) -> None:
    """Write every sample that came, refused stamps included: stamp, rates if any, forces."""
    names = ("time_s", *(_RATES if table.shape[1] > 4 else ()), *_FORCES)
    csv.write(path, {name: table[:, k] for k, name in enumerate(names)}, {})


def watch_rows(options: WatchOptions, rows: Rows, every: float) -> CrashLog:
    """Detect crashes in samples as a live run does."""
    log = CrashLog(options, every)
    for row in rows:
        try:
            log.take(float(row[0]), [float(v) for v in row[1:]])
        except DataError:
            continue
    return log


def write_crash_live(
    options: WatchOptions,
    record: Path,
    out: Path,
    *,
    every: float,
    log: CrashLog | None = None,
    force: bool = False,
) -> Seal:
    """Write the bundle: what was received, what was detected, and records to be reconstructed.

    `record`: as `write_received` writes it. `log`: the detections if they are known; by default
    they are computed from the record, to the same bits.
    """
    rows = np.loadtxt(record, delimiter=",", skiprows=1, ndmin=2)
    if log is None:
        log = watch_rows(options, rows.tolist(), every)
    configuration: dict[str, Any] = {
        "log": {"path": str(record)},
        "every_s": every,
        "recorder": asdict(options),
    }
    seals: list[Seal] = []
    with write_bundle(
        out,
        command=COMMAND,
        configuration=configuration,
        inputs=(input_files("log", str(record), (record,)),),
        force=force,
        seals=seals,
    ) as folder:
        write_json(folder / DETECTIONS, {**log.summary(), "estimates": log.lines})
        for number, table in enumerate(log.records(rows), start=1):
            name = "record.csv" if number == 1 else f"record-{number}.csv"
            if len(table):
                _write_record(folder / name, table)
    return seals[0]


def _write_record(path: Path, table: Any) -> None:
    """Write the samples that were used, as the record of one recorder."""
    columns = {TIME: table[:, 0]}
    columns |= {name: table[:, k - 3] for k, name in enumerate(ACCEL_HEADINGS)}
    if table.shape[1] > 4:
        rates = table[:, 1:4] / GYRO_UNITS["deg/s"]
        columns |= {name: rates[:, k] for k, name in enumerate(GYRO_HEADINGS)}
    csv.write(path, columns, {})


def recorder_of(configuration: Mapping[str, Any]) -> WatchOptions:
    """Return the recorder of a detection from its plain data."""
    recorder: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in configuration["recorder"].items()
    }
    return WatchOptions(**recorder)


def rerun(configuration: dict[str, Any], out: Path) -> Seal:
    """Repeat a live detection from its bundle."""
    record = Path(configuration["log"]["path"])
    every = configuration["every_s"]
    return write_crash_live(recorder_of(configuration), record, out, every=every)
