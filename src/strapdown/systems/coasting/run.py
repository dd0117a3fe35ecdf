"""Drift prediction from its specification to all results of a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from strapdown.config.alignment import sensors_of
from strapdown.config.coast import CoastSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError, Finding
from strapdown.results.inputs import InputFiles
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.attitude_source import input_files, sensor_file
from strapdown.systems.coasting.forecast import Forecast
from strapdown.systems.coasting.recorded import RecordedCoast, coast_of_run
from strapdown.systems.coasting.stated import forecast_of_sensor, sensor_of
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.source import read_navigation_source

__all__ = ["CoastResult", "run_coast"]


@dataclass(frozen=True, eq=False)
class CoastResult:
    """Result of a drift prediction.

    Attributes
    ----------
    spec : CoastSpec
    navigation : NavigationSpec or None
        The run with outages; None for a sensor along a stated motion.
    name, what : str
        Sensor or record, in words.
    sensors : ImuUncertainty
    forecast : Forecast
    recorded : RecordedCoast or None
    stays : tuple of str
        Remaining measurements.
    inputs : tuple of InputFiles
    findings : tuple of Finding
    """

    spec: CoastSpec
    navigation: NavigationSpec | None
    name: str
    what: str
    sensors: ImuUncertainty
    forecast: Forecast
    recorded: RecordedCoast | None
    stays: tuple[str, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]


@one_thread()
def run_coast(
    spec: CoastSpec,
    navigation: NavigationSpec | None = None,
    file: Path | None = None,
    progress: Progress = silent,
) -> CoastResult:
    """Predict the drift in an outage; for a navigation run, also measure it.

    Parameters
    ----------
    spec : CoastSpec
        With absolute paths.
    navigation : NavigationSpec, optional
        The run whose receivers are removed; without one, a sensor along a stated motion.
    file : Path, optional
        Configuration file of the run, listed as an input.
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    CoastResult

    Raises
    ------
    ConfigError
        No sensor is stated, the motion is invalid, or the outage does not fit into the run.
    DataError
        The record of the run cannot be read.
    """
    if navigation is None:
        if spec.sensor is None:
            raise ConfigError("outage.nothing-says-sensor", quantity="sensor")
        sensors = sensor_of(spec.sensor)
        sensor = load_sensor(spec.sensor)
        return CoastResult(
            spec,
            None,
            sensor.name,
            sensor.title,
            sensors,
            forecast_of_sensor(spec, sensors, progress),
            None,
            tuple(spec.aiding),
            sensor_file(spec.sensor),
            (),
        )
    progress("reading", 0.02)
    source = read_navigation_source(navigation)
    recorded = coast_of_run(spec, navigation, source, progress)
    files = () if file is None else (input_files("configuration", str(file), (file,)),)
    return CoastResult(
        spec,
        navigation,
        source.name,
        source.what,
        sensors_of(navigation),
        recorded.forecast,
        recorded,
        recorded.stays,
        (*files, *source.inputs),
        tuple(source.findings),
    )
