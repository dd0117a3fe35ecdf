"""Recorder exports: one text table per triad or path, with units in the headings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.constants import GYRO_UNITS
from strapdown.formats import csv
from strapdown.tables import ACCEL, EULER, GYRO, NED, POSITION_SD, VELOCITY

__all__ = ["ACCEL_HEADINGS", "GYRO_HEADINGS", "TIME", "write_path_csv", "write_recorder_csv"]

TIME = "time [s]"
ACCEL_HEADINGS = ("ax [m/s2]", "ay [m/s2]", "az [m/s2]")
GYRO_HEADINGS = ("wx [deg/s]", "wy [deg/s]", "wz [deg/s]")


def write_recorder_csv(path: Path, table: pd.DataFrame) -> None:
    """Write one triad of a recorder.

    Parameters
    ----------
    path : Path
    table : DataFrame
        Index ``time``, s; columns ``accel_x accel_y accel_z``, m/s², or ``gyro_x gyro_y gyro_z``,
        rad/s. Accelerations and stamps are reproduced to the last bit; rates, written in deg/s,
        within rounding.
    """
    turns = set(GYRO) <= set(table.columns)
    values = table[GYRO if turns else ACCEL].to_numpy(dtype=np.float64)
    if turns:
        values = values / GYRO_UNITS["deg/s"]
    headings = GYRO_HEADINGS if turns else ACCEL_HEADINGS
    columns = {TIME: table.index.to_numpy(dtype=np.float64)}
    columns |= {name: values[:, k] for k, name in enumerate(headings)}
    csv.write(path, columns, {})


def write_path_csv(path: Path, table: pd.DataFrame) -> None:
    """Write the path of a point.

    Parameters
    ----------
    path : Path
    table : DataFrame
        Index ``time``, s; columns ``north east down`` and, if available, ``north_sd east_sd
        down_sd``, m, ``VN VE VD``, m/s, and ``roll pitch heading``, deg.
    """
    columns = {TIME: table.index.to_numpy(dtype=np.float64)}
    for names, unit in ((NED, "m"), (POSITION_SD, "m"), (VELOCITY, "m/s"), (EULER, "deg")):
        there = [name for name in names if name in table.columns]
        columns |= {f"{n} [{unit}]": table[n].to_numpy(dtype=np.float64) for n in there}
    csv.write(path, columns, {})
