"""Trajectories as files: one function a format, and the one table of them."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import pandas as pd

from strapdown.errors import ConfigError
from strapdown.formats.trajectory_csv import write_csv
from strapdown.formats.trajectory_geojson import write_geojson
from strapdown.formats.trajectory_kml import write_kml
from strapdown.formats.trajectory_nav import write_nav
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.formats.trajectory_parquet import write_parquet
from strapdown.formats.trajectory_tum import write_tum

__all__ = [
    "TRAJECTORY_WRITERS",
    "TrajectoryFileOptions",
    "TrajectoryWriter",
    "write_trajectory",
]


class TrajectoryWriter(Protocol):
    """Writes a Trajectory table; the same table and options give the same bytes."""

    def __call__(
        self,
        path: Path,
        trajectory: pd.DataFrame,
        *,
        name: str = "trajectory",
        options: TrajectoryFileOptions | None = None,
    ) -> None:
        """Write a trajectory.

        Parameters
        ----------
        path : Path
        trajectory : DataFrame
        name : str
            For people who open the file.
        options : TrajectoryFileOptions, optional
        """


#: Suffix to the function that writes it.
TRAJECTORY_WRITERS: dict[str, TrajectoryWriter] = {
    "csv": write_csv,
    "tum": write_tum,
    "kml": write_kml,
    "geojson": write_geojson,
    "nav": write_nav,
    "parquet": write_parquet,
}


def write_trajectory(
    path: str | Path,
    trajectory: pd.DataFrame,
    *,
    name: str | None = None,
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a trajectory in the form that the file's ending names.

    Parameters
    ----------
    path : str or Path
        Ends in one of `TRAJECTORY_WRITERS`. A file that is there is replaced, once the new one
        is whole.
    trajectory : DataFrame
        A Trajectory table.
    name : str, optional
        For people who open the file; that of the file without it.
    options : TrajectoryFileOptions, optional

    Raises
    ------
    ConfigError
        The ending is unknown, the folder is not there or may not be written to, or as the writer.
    DataError
        As the writer.
    """
    path = Path(path)
    form = path.suffix.lower().removeprefix(".")
    if form not in TRAJECTORY_WRITERS:
        raise ConfigError(
            "io.no-writer-for-ending",
            file=str(path),
            suffix=path.suffix,
            word=form,
            known=TRAJECTORY_WRITERS,
        )
    part = path.with_name(f".{path.name}.part")
    try:
        TRAJECTORY_WRITERS[form](part, trajectory, name=name or path.stem, options=options)
        part.replace(path)
    except OSError as error:
        raise ConfigError("io.not-writable", file=str(path), strerror=error.strerror) from None
    finally:
        part.unlink(missing_ok=True)
