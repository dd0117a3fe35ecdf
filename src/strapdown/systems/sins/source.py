"""What a run of navigation takes: samples in body axes, a table for each aid, and what is known."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.config.navigation import NavigationSpec, aids_of, receivers_of
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, Finding
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.control_points import read_control_points
from strapdown.formats.gnss_files import files_of_fixes
from strapdown.formats.recording import StatedStart
from strapdown.formats.trajectory_readers import files_of_trajectory, read_trajectory
from strapdown.results.inputs import InputFiles, Reading
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.error_draws import child
from strapdown.simulation import simulate_imu
from strapdown.systems.alignment_source import body_record
from strapdown.systems.attitude_source import input_files, sensor_file
from strapdown.systems.sins.aid_files import read_aid
from strapdown.systems.sins.simulated_fixes import simulated_fixes
from strapdown.systems.trajectory_source import make_motion, with_key

__all__ = ["NavigationSource", "read_navigation_source"]

#: Stream of the fixes below the seed of a simulation; those of the sensors are counted from zero.
_FIXES = 1000


@dataclass(frozen=True, eq=False)
class NavigationSource:
    """A record to navigate by.

    Attributes
    ----------
    name, what : str
    imu : DataFrame
        Imu table, body axes, of the span that is used.
    tables : mapping of str to DataFrame
        By name of the aid, what it measured.
    truth : DataFrame or None
        Trajectory table: of the simulation, or the reference that is given.
    truth_name : str
        In words, as they stand after "error against".
    points : DataFrame or None
        Control points (`read_control_points`), on the clock of the samples.
    start : StatedStart or None
        What the file says of its place and attitude.
    readings : tuple of Reading
    inputs : tuple of InputFiles
    findings : tuple of Finding
    """

    name: str
    what: str
    imu: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    truth: pd.DataFrame | None
    truth_name: str
    points: pd.DataFrame | None
    start: StatedStart | None
    readings: tuple[Reading, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]


def read_navigation_source(spec: NavigationSpec) -> NavigationSource:
    """Read the log, the aids and the reference of a specification, or simulate them.

    Parameters
    ----------
    spec : NavigationSpec
        With absolute paths.

    Returns
    -------
    NavigationSource

    Raises
    ------
    DataError, ConfigError
        One cannot be used; the message names file, row and remedy.
    """
    tables: dict[str, pd.DataFrame] = {}
    inputs: list[InputFiles] = []
    findings: list[Finding] = []
    for name, aid in aids_of(spec).items():
        if aid.path is not None:
            tables[name] = read_aid(aid)
            findings += tables[name].attrs.get("findings", ())
            inputs.append(input_files(f"aid-{name}", aid.path, files_of_fixes(aid.path)))
    truth = None
    if spec.truth is not None:
        truth = read_trajectory(spec.truth.path)
        findings += truth.attrs["findings"]
        inputs.append(input_files("truth", spec.truth.path, files_of_trajectory(spec.truth.path)))
    points = None
    if spec.control_points is not None:
        given = spec.control_points
        points = read_control_points(given.path, given.columns)
        findings += points.attrs["findings"]
        inputs.append(input_files("control-points", given.path, (Path(given.path),)))
    inputs += sensor_file(spec.sensors.sensor)
    if spec.log is None and spec.simulation is None:
        raise ConfigError("navigation.samples-come-while-runs-no", quantity="live")
    if spec.log is None:
        return _simulated(spec, tables, truth, points, inputs, findings)
    recording, imu, of_log = body_record(spec.log, spec.axes)
    for name, table in tables.items():
        tables[name], shifted = on_clock_of(table, recording.imu)
        findings += [] if shifted is None else [shifted]
    if points is not None:
        points, shifted = on_clock_of(points, recording.imu)
        findings += [] if shifted is None else [shifted]
    if truth is not None:
        truth, shifted = on_clock_of(truth, recording.imu)
        findings += [] if shifted is None else [shifted]
    return NavigationSource(
        name=recording.name,
        what="recorded log",
        imu=imu,
        tables=tables,
        truth=truth,
        truth_name="" if spec.truth is None else Path(spec.truth.path).name,
        points=points,
        start=recording.start,
        readings=recording.readings,
        inputs=(input_files("log", spec.log.path, recording.files), *inputs),
        findings=(*of_log, *findings),
    )


def _simulated(
    spec: NavigationSpec,
    tables: Mapping[str, pd.DataFrame],
    truth: pd.DataFrame | None,
    points: pd.DataFrame | None,
    inputs: list[InputFiles],
    findings: list[Finding],
) -> NavigationSource:
    asked = spec.simulation
    assert asked is not None  # one of the two is there
    sensor = asked.sensor or spec.sensors.sensor
    assert sensor is not None  # checked with the specification
    with with_key(f"{spec.name}.toml"):
        motion = make_motion(asked.motion, find_ellipsoid(spec.ellipsoid))
        imu, _ = simulate_imu(
            motion,
            load_sensor(sensor).draw(asked.seed),
            rate=asked.rate_hz,
            sampling=asked.sampling,
            seed=asked.seed,
            source=spec.name,
        )
        made = {
            name: simulated_fixes(
                motion, one, child(asked.seed, _FIXES, zlib.crc32(name.encode())), name
            )
            for name, one in receivers_of(spec).items()
        }
    if asked.sensor != spec.sensors.sensor:
        inputs = [*inputs, *sensor_file(asked.sensor)]
    exact = motion.trajectory(imu.index.to_numpy(dtype=np.float64), source=spec.name)
    return NavigationSource(
        name=spec.name,
        what=f"simulated, {Path(sensor).stem}, seed {asked.seed}",
        imu=imu,
        tables={**tables, **made},
        truth=exact if truth is None else truth,
        truth_name="the exact truth",
        points=points,
        start=None,
        readings=(),
        inputs=tuple(inputs),
        findings=tuple(findings),
    )
