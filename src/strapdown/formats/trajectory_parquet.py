"""Trajectories as Parquet: the columns of the CSV, all numbers to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.formats.clocks import clock_of
from strapdown.formats.trajectory_csv import named_columns, told_of
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.tables import TRAJECTORY, check_trajectory

__all__ = ["write_parquet"]


def write_parquet(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a Trajectory table as Parquet.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        Further numeric columns, such as standard deviations, are written under their own names.
    name : str
    options : TrajectoryFileOptions, optional
        Ellipsoid and epoch are written to the file's metadata, like the comments of the CSV.

    Raises
    ------
    DataError
        The table is not valid.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    chosen = options or TrajectoryFileOptions()
    check_trajectory(trajectory)
    columns = named_columns(trajectory, TRAJECTORY)
    columns |= {
        str(c): trajectory[c].to_numpy(dtype=np.float64)
        for c in trajectory.columns
        if c not in TRAJECTORY and trajectory[c].dtype.kind in "iuf"
    }
    clock = clock_of(trajectory)
    told: dict[str, Any] = told_of(name, chosen)
    told |= {"clock": clock.name, "clock_origin_s": repr(clock.origin)}
    told |= {} if clock.week is None else {"gps_week": str(clock.week)}
    table = pa.table({n: pa.array(v) for n, v in columns.items()})
    pq.write_table(
        table.replace_schema_metadata(told),
        path,
        compression="zstd",
        use_dictionary=False,
        use_byte_stream_split=True,
    )
