"""What a run of navigation writes beside its report: tables by time, and paths for maps."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.formats import csv
from strapdown.formats.trajectory_options import TrajectoryFileOptions
from strapdown.formats.trajectory_writers import write_trajectory
from strapdown.navigation.record import NavigationRecord
from strapdown.systems.sins.result import NavigationResult
from strapdown.tables import EULER, NED, VELOCITY

__all__ = ["write_navigation_files"]

UNITS = {"lat": "deg", "lon": "deg", "alt": "m"}
UNITS |= dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m_s") | dict.fromkeys(EULER, "deg")
#: Units in names of columns.
_WORDS = {"rad/s": "rad_s", "m/s²": "m_s2", "1": "", "(rad/s)/(m/s²)": "rad_s_per_m_s2"}
#: Maps draw no more points than this.
MOST_POINTS = 10_000


def write_navigation_files(result: NavigationResult, folder: Path) -> None:
    """Write the tables of a run.

    Parameters
    ----------
    result : NavigationResult
    folder : Path
        ``trajectory.*`` in the forms that are asked for, ``sd.csv``, ``sensor_errors.csv``,
        ``innovations/NAME.csv``, ``events.csv``, and ``errors.csv`` where the truth is known; of a
        run that is smoothed the first three by the filter alone, too, in ``forward``.
    """
    record = result.record
    told = {"run": result.source.name, "ellipsoid": result.ellipsoid.name}
    _write_states(result, record, folder, told)
    if result.forward is not None:
        (folder / "forward").mkdir()
        _write_states(result, result.forward, folder / "forward", {**told, "by": "filter alone"})
    if record.innovations:
        (folder / "innovations").mkdir()
        for name, table in record.innovations.items():
            renamed = table.rename(columns={c: _column(str(c)) for c in table.columns})
            _write(folder / "innovations" / f"{name}.csv", renamed, {**told, "of": name})
    events = record.events
    csv.write(
        folder / "events.csv",
        {
            "time_s": np.array([e.time for e in events], dtype=np.float64),
            "kind": np.array([e.kind for e in events], dtype=np.str_),
            "what": np.array([e.what for e in events], dtype=np.str_),
        },
        told,
    )
    if result.points is not None:
        score = result.points
        columns = {
            "time_s": score.time,
            "north_m": score.points[:, 0],
            "east_m": score.points[:, 1],
            "north_error_m": score.error[:, 0],
            "east_error_m": score.error[:, 1],
        }
        told_points = {**told, "sign": "computed less the point, turned and shifted onto the path"}
        csv.write(folder / "control_points.csv", columns, told_points)
    if result.differences is not None:
        errors = result.differences.rename(
            columns={c: f"{c}_{UNITS.get(str(c), 'deg')}" for c in result.differences.columns}
        )
        against = {**told, "against": result.source.truth_name, "sign": "computed less truth"}
        _write(folder / "errors.csv", errors, against)


def _write_states(
    result: NavigationResult, record: NavigationRecord, folder: Path, told: dict[str, str]
) -> None:
    """Write a trajectory, its standard deviations, and the errors of the sensors."""
    options = TrajectoryFileOptions(ellipsoid=result.ellipsoid, most_points=MOST_POINTS)
    for form in result.spec.output.files:
        path = folder / f"trajectory.{form}"
        write_trajectory(path, record.trajectory, name=result.source.name, options=options)
    sd = record.sd.rename(columns={c: f"{c}_sd_{UNITS[str(c)]}" for c in record.sd.columns})
    _write(folder / "sd.csv", sd, told)
    _write(folder / "sensor_errors.csv", _sensors(record), told)


def _sensors(record: NavigationRecord) -> pd.DataFrame:
    """Estimates beside their standard deviations, with units."""
    units = {n: _WORDS.get(u, u.replace("/", "_per_")) for n, u in record.units.items()}
    ends = {n: f"_{u}" if u else "" for n, u in units.items()}
    estimates = record.sensors.rename(columns={n: f"{n}{e}" for n, e in ends.items()})
    sd = record.sensors_sd.rename(columns={n: f"{n}_sd{e}" for n, e in ends.items()})
    return pd.concat([estimates, sd], axis=1)


def _column(name: str) -> str:
    """``nu north, m`` as ``nu_north_m``."""
    return re.sub(r"\W+", "_", name.replace("²", "2")).strip("_")


def _write(path: Path, table: pd.DataFrame, told: dict[str, str]) -> None:
    named = {"time_s": table.index.to_numpy(dtype=np.float64)}
    named |= {str(c): table[c].to_numpy(dtype=np.float64) for c in table.columns}
    csv.write(path, named, told)
