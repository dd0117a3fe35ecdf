"""Write a simulated log with its exact attitude as a sealed bundle."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.attitude_comparison.source import scenario_errors, simulate_scenario
from strapdown.bundle import Seal, check_destination, sensor_file, write_bundle, write_json
from strapdown.config.motions import TrajectorySpec
from strapdown.config.sources import SimulateSpec
from strapdown.constants import Array
from strapdown.ellipsoids import WGS84, Ellipsoid, find_ellipsoid
from strapdown.errors import check_choice
from strapdown.formats.trajectory_writers import one_line, thin
from strapdown.formats.writers import (
    TRAJECTORY_FORMATS,
    WRITERS,
    FileOptions,
    log_formats,
    write_attitude_csv,
)
from strapdown.frames import ned_from_geodetic
from strapdown.report.chart import BLUE, Chart, Line, Panel, break_jumps, curve
from strapdown.report.chart_svg import ChartFigure
from strapdown.report.crash_simulation import stated_errors
from strapdown.report.plan import PlanView, path_marks
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import Motion, PulseMotion, TriadErrors
from strapdown.systems.trajectory_source import (
    SimulatedTrajectory,
    scenario_of,
    simulate_trajectory,
)
from strapdown.tables import EULER, NED, QUATERNION, VELOCITY, places_of
from strapdown.tables.checks import index_of


def write_simulation(
    spec: SimulateSpec,
    out: Path,
    *,
    force: bool = False,
    made: tuple[pd.DataFrame, pd.DataFrame] | None = None,
) -> Seal:
    """Write a simulated scenario into a new folder: ``log.*``, ``truth.csv``, ``scenario.json``.

    `made`: from `simulate_scenario` of this specification, if it has been simulated already.
    `force`: overwrite an existing bundle. ConfigError: a format is unknown, or `out` may not be
    written.
    """
    check_destination(out, force)
    formats = log_formats(spec.formats)
    imu, truth = made or simulate_scenario(spec.scenario)
    scenario = scenario_of(spec.scenario)
    seals: list[Seal] = []
    with write_bundle(
        out,
        command="simulate",
        configuration=spec.model_dump(mode="json"),
        inputs=sensor_file(spec.scenario.sensor),
        force=force,
        seals=seals,
    ) as folder:
        for name in formats:
            WRITERS[name].write(folder / f"log.{name}", {"imu": imu, "reference": truth})
        write_attitude_csv(folder / "truth.csv", truth)
        final = truth.iloc[-1]
        description = {
            "schema": "strapdown scenario 1",
            "scenario": spec.scenario.name,
            "title": scenario.title,
            "origin": scenario.source,
            "sampling": spec.scenario.sampling,
            "rate_hz": spec.scenario.rate_hz,
            "seed": spec.scenario.seed,
            "duration_s": scenario.motion.duration,
            **_describe_motion(scenario.motion),
            "references": scenario.references,
            "sensor": spec.scenario.sensor and Path(spec.scenario.sensor).name,
            **_stated(scenario_errors(spec.scenario)),
            "final_attitude": {
                "time_s": float(truth.index[-1]),
                "q_nb": [float(final[q]) for q in QUATERNION],
                **{f"{angle}_deg": float(final[angle]) for angle in EULER},
            },
        }
        write_json(folder / "scenario.json", description)
    return seals[0]


def _stated(errors: ImuErrors) -> dict[str, Any]:
    """Errors of the simulated sensor, SI."""
    return {
        "gyro_errors": stated_errors(errors.gyro, "rad_per_s"),
        "accel_errors": stated_errors(errors.accel or TriadErrors(), "m_per_s2"),
    }


def _describe_motion(motion: Motion) -> dict[str, object]:
    """Parameters of the motion: its pulses, or the fields of its class with their names."""
    if isinstance(motion, PulseMotion):
        pulses = [
            {
                "axis": "xyz"[p.axis],
                "start_s": p.start,
                "end_s": p.end,
                "end_closed": p.closed,
                "rate_rad_per_s": p.rate,
                **({"edge_s": p.edge} if p.edge else {}),
            }
            for p in motion.pulses
        ]
        return {"pulses": pulses, **({"arm_m": motion.arm} if any(motion.arm) else {})}
    return {"motion": {"class": type(motion).__name__, **_fields(motion)}}


def _fields(thing: object) -> dict[str, object]:
    found = {}
    for f in fields(thing):  # type: ignore[arg-type]
        value = getattr(thing, f.name)
        found[f.name] = _fields(value) if hasattr(value, "__dataclass_fields__") else value
    return found


# Write a simulated trajectory as a sealed bundle: log, exact truth, configuration.


# Row of a Trajectory table as keys with units.
_ROW = {"lat": "lat_deg", "lon": "lon_deg", "alt": "alt_m"}
_ROW |= {v: f"v_{axis}_m_per_s" for v, axis in zip(VELOCITY, NED, strict=True)}
_ROW |= {angle: f"{angle}_deg" for angle in EULER}


def write_trajectory_simulation(
    spec: TrajectorySpec,
    out: Path,
    *,
    force: bool = False,
    made: SimulatedTrajectory | None = None,
) -> Seal:
    """Write a simulated trajectory into a new folder, as `write_simulation`.

    The folder holds ``log.*`` (rad/s, m/s², body forward-right-down, with the true attitude in
    further columns), ``fixes.csv`` of the stated receiver, ``trajectory.csv`` and other formats,
    ``trajectory.svg``, its picture, and ``scenario.json`` with the resolved configuration. Errors
    as of `simulate_trajectory`, too.
    """
    check_destination(out, force)
    formats = log_formats(spec.formats)
    for name in spec.trajectory_formats:
        check_choice(
            "report.no-writer",
            TRAJECTORY_FORMATS,
            quantity="trajectory_formats",
            file=f"{spec.name}.toml",
            name=name,
        )
    motion, errors, imu, attitude, trajectory, fixes = made or simulate_trajectory(spec)
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
            WRITERS[name].write(folder / f"log.{name}", {"imu": imu, "reference": attitude})
        if spec.fixes != "none":
            WRITERS[spec.fixes].write(folder / f"fixes.{spec.fixes}", {"gnss": fixes})
        options = FileOptions(name=spec.name, ellipsoid=motion.ellipsoid)
        for name in dict.fromkeys(("csv", *spec.trajectory_formats)):
            path = folder / f"trajectory.{name}"
            WRITERS[name].write(path, {"reference": trajectory}, options)
        picture = ChartFigure(simulation_chart(spec, trajectory))
        picture.save(folder / "trajectory.svg", caption=True)
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
            **_stated(errors),
            "start": _state(trajectory, 0),
            "end": _state(trajectory, -1),
            "configuration": configuration | ({"sensor": sensor} if sensor else {}),
        }
        write_json(folder / "scenario.json", description)
    return seals[0]


def simulation_chart(spec: TrajectorySpec, trajectory: pd.DataFrame) -> Chart:
    """Return the chart of a simulated Trajectory table, titled as its file states."""
    title = one_line(spec.title) or one_line(spec.name)
    return trajectory_chart(trajectory, title=title, ellipsoid=find_ellipsoid(spec.ellipsoid))


def _state(trajectory: pd.DataFrame, row: int) -> dict[str, float]:
    """One row, each value under a key with its unit."""
    at = trajectory.iloc[row]
    return {"time_s": float(trajectory.index[row])} | {k: float(at[c]) for c, k in _ROW.items()}


# Chart of a trajectory: its path as a plan, and height, speed and attitude over time.


# Points of a plan, and buckets of a curve over time, that a picture of 900 pixels can resolve.
MOST_POINTS, BUCKETS = 1500, 700
# Smaller motion has no path, m; smaller changes are drawn as constant: m, m/s, deg.
NO_PATH = 1e-3
_STEADY = 1e-3
# Plans of at least this size, m, are in kilometers.
_FAR = 20e3
_LOW = 0.6  # height of a panel over time


def trajectory_chart(
    trajectory: pd.DataFrame, *, title: str, ellipsoid: Ellipsoid = WGS84
) -> Chart:
    """Chart a trajectory: plan, height, speed and attitude over time.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table. The plan is about its first position.

    Returns
    -------
    Chart
        Without the plan if the trajectory moves by less than 1 mm over ground, and then also
        without height and speed, unless the height changes by that. The plan is the projection
        along the vertical of the start onto its level plane, in which a straight path is straight:
        0.1 % of a distance is lost 490 km away.

    Raises
    ------
    DataError
        A position is invalid, as in `frames.ned_from_geodetic`.
    """
    origin = places_of(trajectory.iloc[:1])[0]
    thinned = thin(trajectory, MOST_POINTS, ellipsoid)
    kept = trajectory.iloc[thinned.rows]
    north, east, _ = ned_from_geodetic(places_of(kept), origin, ellipsoid=ellipsoid).T
    time = index_of(trajectory)

    def over_time(label: str, values: Array) -> Panel:
        line = replace(curve("trajectory", time, values, BLUE, buckets=BUCKETS), legend=False)
        return Panel(label, (line,), height=_LOW, steady=_STEADY)

    height, v_n, v_e = (trajectory[c].to_numpy(dtype=np.float64) for c in ("alt", "VN", "VE"))
    reach, rise = float(max(np.ptp(east), np.ptp(north))), float(np.ptp(height))
    at = f"{origin[0]:.6g}°, {origin[1]:.6g}°, {origin[2]:.6g} m"
    panels: list[Panel] = []
    if reach >= NO_PATH:
        panels.append(_plan(index_of(kept), east, north, reach))
        words = [
            f"Plan: in the level plane at the start ({at}), to one scale; arrows: direction of "
            "motion."
        ]
    else:
        words = [f"It stays at its place ({at})."]
    if reach >= NO_PATH or rise >= NO_PATH:
        panels += [over_time("height, m", height), over_time("speed, m/s", np.hypot(v_n, v_e))]
        words.append(f"Height over the ellipsoid ({ellipsoid.name}); speed over the ground.")
    angles = {name: trajectory[name].to_numpy(dtype=np.float64) for name in EULER}
    angles["heading"], wrapped = _wrapped(angles["heading"])
    panels += [over_time(f"{name}, deg", values) for name, values in angles.items()]
    words.append(
        "Body forward-right-down relative to north-east-down, 3-2-1 angles; heading "
        f"{wrapped}, clockwise from north."
    )
    if reach >= NO_PATH and len(kept) < len(trajectory):
        words.append(f"Plan: {thinned.sentence}")
    return Chart("trajectory", title, " ".join(words), "time, s", tuple(panels))


def _plan(time: Array, east: Array, north: Array, reach: float) -> Panel:
    """The path, with its start, end, direction and times."""
    unit, scale = ("km", 1e-3) if reach >= _FAR else ("m", 1.0)
    path = (scale * east, scale * north)
    view = PlanView.of([path])
    lines = [
        Line("trajectory", *path, BLUE, "solid", 1.8, legend=False),
        *path_marks(time, [path], view, BLUE),
    ]
    x_label, y_label = (f"{side} of the start, {unit}" for side in ("east", "north"))
    return Panel(y_label, tuple(lines), x_label=x_label, height=view.height)


def _wrapped(heading: Array) -> tuple[Array, str]:
    """Headings within the full turn, from north or from south, that breaks them least."""
    ranges = (
        ("0 to 360°", heading % 360.0),
        ("−180 to 180°", (heading + 180.0) % 360.0 - 180.0),
    )
    broken = [(break_jumps(found), words) for words, found in ranges]
    return min(broken, key=lambda one: int(np.isnan(one[0]).sum()))
