"""Writers of trajectories: one function per format, and the registry of writers."""

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
    """Writes a Trajectory table; equal input gives identical bytes."""

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
            Title for people who open the file.
        options : TrajectoryFileOptions, optional
        """


#: Suffix to writer.
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
    """Write a trajectory in the format given by the file's suffix.

    Parameters
    ----------
    path : str or Path
        Suffix one of `TRAJECTORY_WRITERS`. An existing file is replaced once the new one is
        complete.
    trajectory : DataFrame
        A Trajectory table.
    name : str, optional
        Title for people who open the file; by default the file name.
    options : TrajectoryFileOptions, optional

    Raises
    ------
    ConfigError
        The suffix is unknown, the folder is missing or not writable, or as the writer.
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
