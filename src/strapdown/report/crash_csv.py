"""What came of a crash case, as tables in CSV: the path, and the signals at the reference point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.crash.path import CrashPath
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.formats import csv
from strapdown.tables import ACCEL, EULER, GYRO, NED, VELOCITY

__all__ = ["signals_table", "trajectory_table", "write_table"]

UNITS = dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")


def trajectory_table(path: CrashPath) -> pd.DataFrame:
    """Return the path with its standard deviations, each column with its unit.

    Parameters
    ----------
    path : CrashPath

    Returns
    -------
    DataFrame
        ``time_s``, place, velocity, attitude, then the standard deviations of each.
    """
    values = path.table.rename(columns={c: f"{c}_{u}" for c, u in UNITS.items()})
    sd = path.sd.rename(columns={c: f"{c}_sd_{u}" for c, u in UNITS.items()})
    table = pd.concat([values, sd], axis=1)
    table.insert(0, "time_s", path.time)
    return table.reset_index(drop=True)


def signals_table(unit: UnitReconstruction) -> pd.DataFrame:
    """Return what one recorder says at the reference point, gravity in it.

    Parameters
    ----------
    unit : UnitReconstruction

    Returns
    -------
    DataFrame
        Specific force forward, right, down in m/s² and rates in deg/s at the common stamps, and
        for a recorder of several ranges which of them spoke (0 the lowest) and where it was at
        its end, by sensor axis.
    """
    imu = unit.at_point.imu
    table = pd.DataFrame({"time_s": imu.index.to_numpy()})
    for axis, column in zip(("forward", "right", "down"), ACCEL, strict=True):
        table[f"force_{axis}_m_per_s2"] = imu[column].to_numpy()
    for axis, column in zip(("roll", "pitch", "yaw"), GYRO, strict=True):
        table[f"rate_{axis}_deg_per_s"] = np.degrees(imu[column].to_numpy())
    prepared = unit.at_point.prepared
    if prepared is not None:
        for k, axis in enumerate("xyz"):
            table[f"range_{axis}"] = prepared.range_spoken[:, k].astype(np.int64)
            table[f"at_end_{axis}"] = prepared.clipped[:, k].astype(np.int64)
    return table


def write_table(table: pd.DataFrame, path: Path, comments: dict[str, str]) -> None:
    """Write a table as CSV with shortest round-trip numbers.

    Parameters
    ----------
    table : DataFrame
    path : Path
    comments : dict of str to str
        At the top.
    """
    csv.write(path, {str(c): table[c].to_numpy() for c in table.columns}, comments)
