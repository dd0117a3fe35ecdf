"""Noise of a sensor from Python, and the sensors of the catalogue."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.api.reading import ImuFile, imu_input, log_table
from strapdown.config.logs import AllanSpec
from strapdown.config.spec import specify
from strapdown.progress import Progress, silent
from strapdown.systems.allan_run import AllanRun as AllanRun
from strapdown.systems.allan_run import run_allan
from strapdown.systems.inputs import NOWHERE, Memory

if TYPE_CHECKING:
    import pandas as pd

    from strapdown.report.sensors import SensorsRun


def allan(
    *logs: Any,
    axes: str | None = None,
    at_rest: bool = False,
    target: str | None = None,
    progress: Progress = silent,
    **options: Any,
) -> AllanRun:
    """Find the noise of a sensor from a log at rest: deviations, terms, and a sensor file.

    Parameters
    ----------
    *logs : Imu, DataFrame, (t, gyro, accel), str or Path
        Samples of an unmoved sensor: s, rad/s (n, 3), m/s² (n, 3); or a file. The longest
        stationary stretch is used. Several logs of one sensor are fitted together.
    axes : str, optional
        As of `read_imu`.
    at_rest : bool
        Whether the sensor did not move in the whole log, which is then used without a test.
    target : str, optional
        A program whose parameters the saved result has as well: ``KF-GINS``, ``GTSAM``, …
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        Further keys of a log in a file: ``columns``, ``format``, ``gyro_unit``, ``accel_unit``,
        ``sampling``, ``rate_hz``, ``from_s``, ``to_s``, ``duration_s``, ``repair``.

    Returns
    -------
    AllanRun
        `deviations`, `terms`, `findings`; `sensor` for ``navigate(sensor=…)``; `parameters` for
        other programs; `plot`, `save`.

    Raises
    ------
    ConfigError
        The file does not exist, or an option does not fit it.
    DataError
        The log cannot be read, or is not at rest for a minute.
    """
    given = [imu_input(log) for log in logs]
    stated = {key: value for key, value in options.items() if value not in (None, {}, False)}
    names = ["imu.npz", *(f"imu-{k}.npz" for k in range(2, len(given) + 1))]
    memory = Memory.of(dict(zip(names, given, strict=False)))
    with memory.as_files() as folder:
        tables = [log_table(one, folder / n, stated) for n, one in zip(names, given, strict=False)]
        axes = axes or next((x.axes for x in given if isinstance(x, ImuFile) and x.axes), None)
        about = {"axes": axes, "at_rest": at_rest, "target": target}
        stem = Path(tables[0].path).resolve().stem if tables else "imu"
        spec = specify(AllanSpec, name=stem, logs=tuple(tables), **about)
        run = run_allan(spec, progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


def list_sensors() -> pd.DataFrame:
    """List the sensors of the catalogue: class, noise, bias, and how many figures are assumed.

    Returns
    -------
    DataFrame
        A row for each; units in the names of the columns, NaN where a sensor has no such figure.
        The figures of one with their sources: ``strapdown.sensors.load_sensor(name).sources``.
    """
    from strapdown.report.sensors import catalogue_table

    return catalogue_table()


def compare_sensors(
    *names: str | Path,
    outage_s: float = 60.0,
    speed_m_per_s: float = 15.0,
    progress: Progress = silent,
) -> SensorsRun:
    """Compare sensors: Allan deviations, and drift over an outage straight on.

    Parameters
    ----------
    *names : str or Path
        Up to nine sensors of the catalogue, or files, such as ``AllanRun.sensor``.
    outage_s : float, s
        Time without fixes, after 600 s with them.
    speed_m_per_s : float, m/s
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    SensorsRun
        `deviations`, `drift` (standard deviations of position and attitude over time), `sensors`;
        `to_pandas`, `plot`, `save`.

    Raises
    ------
    ConfigError
        A sensor does not exist, or two have one name.
    """
    from strapdown.config.outage import SensorsSpec
    from strapdown.report.sensors import compare

    given = tuple(
        str(Path(n).absolute()) if str(n).lower().endswith(".toml") else str(n) for n in names
    )
    keys = {"outage_s": outage_s, "speed_m_per_s": speed_m_per_s}
    return compare(specify(SensorsSpec, sensor=given, **keys), progress)
