"""Trajectories as files: one function a format, and the one table of them."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import pandas as pd

from strapdown.formats.trajectory_csv import write_csv
from strapdown.formats.trajectory_geojson import write_geojson
from strapdown.formats.trajectory_kml import write_kml
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.formats.trajectory_tum import write_tum

__all__ = ["TRAJECTORY_WRITERS", "TrajectoryFileOptions", "TrajectoryWriter"]


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
}
