"""Writers of trajectories: the registry, and the format of the TUM RGB-D benchmark."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.formats.kf_gins import write_nav
from strapdown.formats.trajectory_csv import one_line, write_csv, write_parquet
from strapdown.formats.trajectory_maps import write_geojson, write_kml
from strapdown.formats.trajectory_options import TUM_FRAMES, TrajectoryFileOptions
from strapdown.frames import ecef_from_geodetic, q_ne
from strapdown.rotation import Q_NED_ENU
from strapdown.tables import EULER, check_trajectory, places_of

__all__ = [
    "TRAJECTORY_WRITERS",
    "TrajectoryFileOptions",
    "TrajectoryWriter",
    "poses",
    "write_trajectory",
    "write_tum",
]


# Trajectories in the format of the TUM RGB-D benchmark, for evo and similar tools.


Array = NDArray[np.float64]

# Half a turn about forward: from forward-left-up to forward-right-down, and back.
_Q_FRD_FLU = (0.0, 1.0, 0.0, 0.0)


def poses(
    trajectory: pd.DataFrame, options: TrajectoryFileOptions | None = None
) -> tuple[Array, Array]:
    """Compute positions and attitudes in one right-handed Cartesian frame.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table of one row or more.
    options : TrajectoryFileOptions, optional
        Its `tum_frame` and `ellipsoid`.

    Returns
    -------
    position : ndarray, (n, 3), m
        ``enu`` and ``ned``: from the first position, along the plane tangent to the ellipsoid
        below it; the Earth curves away from that plane by ``d²/2R``. ``ecef``: from the Earth's
        center.
    q_wb : ndarray, (n, 4)
        Body to world, scalar first, with continuous sign. World and body axes are in
        `TUM_FRAMES`. The local level rotates as the vehicle moves over the Earth, while the
        world does not: the attitude accounts for it.
    """
    chosen = options or TrajectoryFileOptions()
    place = places_of(trajectory)
    position = ecef_from_geodetic(place, ellipsoid=chosen.ellipsoid)
    to_level = q_ne(place[:, 0], place[:, 1])
    q_wb = rotation.compose(
        rotation.conjugate(to_level),
        rotation.quaternion_from_euler(trajectory[EULER].to_numpy(dtype=np.float64)),
    )
    if chosen.tum_frame != "ecef":
        q_we = to_level[0]
        if chosen.tum_frame == "enu":
            q_we = rotation.compose(Q_NED_ENU, q_we)
            q_wb = rotation.compose(q_wb, _Q_FRD_FLU)
        position = rotation.rotate(q_we, position - position[0])
        q_wb = rotation.compose(q_we, q_wb)
    # q and -q are the same attitude; readers that interpolate need equal signs of neighbors.
    along = (q_wb[1:] * q_wb[:-1]).sum(axis=1)
    sign = np.cumprod(np.r_[math.copysign(1.0, q_wb[0, 0]), np.where(along < 0.0, -1.0, 1.0)])
    # Avoid negative zeros.
    return position + 0.0, q_wb * sign[:, None] + 0.0


def write_tum(
    path: Path,
    trajectory: pd.DataFrame,
    *,
    name: str = "trajectory",
    options: TrajectoryFileOptions | None = None,
) -> None:
    """Write a trajectory as lines of ``time x y z qx qy qz qw``.

    Parameters
    ----------
    path : Path
    trajectory : DataFrame
        A Trajectory table of one row or more.
    name : str
    options : TrajectoryFileOptions, optional
        Axes and ellipsoid; written to the comments at the top, together with the origin.

    Raises
    ------
    DataError
        The table is not valid, or has no rows.

    Notes
    -----
    The quaternion is scalar last, body to world. The format does not include velocities.
    """
    chosen = options or TrajectoryFileOptions()
    check_trajectory(trajectory)
    if trajectory.empty:
        raise DataError("io.trajectory-no-rows")
    position, q_wb = poses(trajectory, chosen)
    world, body = TUM_FRAMES[chosen.tum_frame]
    lat, lon, alt = (float(v) for v in places_of(trajectory.iloc[:1])[0])
    head = [
        f"# trajectory: {one_line(name)}",
        f"# ellipsoid: {chosen.ellipsoid.name}",
        f"# world axes: {world}",
        f"# body axes: {body}",
        "# quaternion: body to world, scalar last",
    ]
    if chosen.tum_frame != "ecef":
        head.append(f"# origin lat lon deg, height m: {lat!r} {lon!r} {alt!r}")
    time = trajectory.index.to_numpy(dtype=np.float64)
    rows = np.column_stack([time, position, q_wb[:, 1:], q_wb[:, :1]]).tolist()
    lines = [" ".join(map(repr, row)) for row in rows]
    text = "\n".join([*head, "# time x y z qx qy qz qw", *lines]) + "\n"
    path.write_bytes(text.encode())


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

        `name`: title for people who open the file.
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
