"""Trajectories and tables by time as Parquet: columns of numbers, with the unit of each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_parquet"]


def write_parquet(
    path: Path,
    columns: Mapping[str, NDArray[np.float64]],
    comments: Mapping[str, str],
) -> None:
    """Write columns as Parquet: the same columns give the same bytes.

    Parameters
    ----------
    path : Path
    columns : mapping of str to ndarray, (n,)
        Names with their unit, as ``lat_deg``.
    comments : mapping of str to str
        Stand in the metadata of the table.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    pq.write_table(
        table.replace_schema_metadata(dict(comments)), path, compression="zstd", version="2.6"
    )
