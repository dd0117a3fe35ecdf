"""A simulated trajectory as files: the log, the exact truth, and what made them, sealed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.bundle.destination import check_destination
from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import Seal
from strapdown.bundle.writing import write_bundle
from strapdown.config import TrajectorySpec
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.formats.log_writers import LOG_WRITERS, log_formats
from strapdown.formats.trajectory_csv import one_line
from strapdown.formats.trajectory_writers import TRAJECTORY_WRITERS, TrajectoryFileOptions
from strapdown.report.chart import Chart
from strapdown.report.stated_errors import stated_errors
from strapdown.report.svg_chart import draw
from strapdown.report.trajectory_charts import trajectory_chart
from strapdown.simulation import TriadErrors
from strapdown.systems.attitude_source import sensor_file
from strapdown.systems.trajectory_source import simulate_trajectory

__all__ = ["simulation_chart", "write_trajectory_simulation"]

# Row of a Trajectory table to keys with units.
_ROW = {
    "lat": "lat_deg",
    "lon": "lon_deg",
    "alt": "alt_m",
    "VN": "v_north_m_per_s",
    "VE": "v_east_m_per_s",
    "VD": "v_down_m_per_s",
    "roll": "roll_deg",
    "pitch": "pitch_deg",
    "heading": "heading_deg",
}


def write_trajectory_simulation(spec: TrajectorySpec, out: Path, *, force: bool = False) -> Seal:
    """Write a simulated trajectory.

    Parameters
    ----------
    spec : TrajectorySpec
    out : Path
        Folder to make.
    force : bool
        Replace a bundle that is there.

    Returns
    -------
    Seal
        The folder holds ``log.*`` (rad/s, m/s², body forward-right-down, with the true attitude in
        further columns), ``trajectory.csv`` and other forms of it, ``trajectory.svg``, a picture
        of it, and ``scenario.json`` with the resolved configuration.

    Raises
    ------
    ConfigError
        As `simulate_trajectory`; a format is unknown, or `out` may not be written.
    """
    check_destination(out, force)
    formats = log_formats(spec.formats)
    for name in spec.trajectory_formats:
        if name not in TRAJECTORY_WRITERS:
            raise ConfigError(
                "report.no-writer",
                file=f"{spec.name}.toml",
                quantity="trajectory_formats",
                name=name,
                word=name,
                known=TRAJECTORY_WRITERS,
            )
    motion, errors, imu, attitude, trajectory = simulate_trajectory(spec)
    configuration = spec.model_dump(mode="json", exclude_none=True)
    seals: list[Seal] = []
    with write_bundle(
        out,
        command="simulate",
        configuration={"trajectory": configuration},
        inputs=sensor_file(spec.sensor),
        force=force,
        seals=seals,
    ) as folder:
        for name in formats:
            LOG_WRITERS[name](folder / f"log.{name}", imu, attitude)
        options = TrajectoryFileOptions(ellipsoid=motion.ellipsoid)
        for name in dict.fromkeys(("csv", *spec.trajectory_formats)):
            path = folder / f"trajectory.{name}"
            TRAJECTORY_WRITERS[name](path, trajectory, name=spec.name, options=options)
        draw(simulation_chart(spec, trajectory), folder / "trajectory.svg", caption=True)
        shape = motion.ellipsoid
        sensor = spec.sensor and Path(spec.sensor).name
        description: dict[str, Any] = {
            "schema": "strapdown trajectory 1",
            "name": spec.name,
            "title": spec.title,
            "sampling": spec.sampling,
            "rate_hz": spec.rate_hz,
            "seed": spec.seed,
            "samples": len(imu),
            "duration_s": motion.duration,
            "ellipsoid": {
                "name": shape.name,
                "semi_major_axis_m": shape.semi_major_axis,
                "inverse_flattening": shape.inverse_flattening,
                "rotation_rate_rad_per_s": shape.rotation_rate,
            },
            "sensor": sensor,
            "gyro_errors": stated_errors(errors.gyro, "rad_per_s"),
            "accel_errors": stated_errors(errors.accel or TriadErrors(), "m_per_s2"),
            "start": _state(trajectory, 0),
            "end": _state(trajectory, -1),
            "configuration": configuration | ({"sensor": sensor} if sensor else {}),
        }
        (folder / "scenario.json").write_text(to_json(description), encoding="utf-8", newline="\n")
    return seals[0]


def simulation_chart(spec: TrajectorySpec, trajectory: pd.DataFrame) -> Chart:
    """Return the chart of a simulated trajectory, titled as its file says.

    Parameters
    ----------
    spec : TrajectorySpec
    trajectory : DataFrame
        A Trajectory table.

    Returns
    -------
    Chart
    """
    title = one_line(spec.title) or one_line(spec.name)
    return trajectory_chart(trajectory, title=title, ellipsoid=find_ellipsoid(spec.ellipsoid))


def _state(trajectory: pd.DataFrame, row: int) -> dict[str, float]:
    """One row, each value with its unit in its key."""
    at = trajectory.iloc[row]
    return {"time_s": float(trajectory.index[row])} | {k: float(at[c]) for c, k in _ROW.items()}
