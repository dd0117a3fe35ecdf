"""Write an algorithm or a filter of a comparison as one file, with the configuration of its log."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.attitude_algorithms import ALGORITHMS, AttitudeAlgorithm, make_algorithm
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.bundle.atomic_folder import replace_file
from strapdown.errors import ConfigError, check_choice
from strapdown.export import Channel, SensorConfiguration, export_c, export_micropython
from strapdown.export.attitude import export_attitude
from strapdown.export.steps import STEPS, ExportedFile, step_in_c
from strapdown.formats.columns import parse_axes
from strapdown.increments import increments_from_imu
from strapdown.orientation_filters import FILTERS, OrientationEstimator, is_filter, make_filter
from strapdown.plugins import plugin
from strapdown.tables import ACCEL, GYRO, MAG, QUATERNION, THETA, imu_table
from strapdown.tables.checks import index_of
from strapdown.units import (
    ACCEL_SUMS,
    ACCEL_UNITS,
    GYRO_SUMS,
    GYRO_UNITS,
    MAG_UNITS,
    RELATIVE_FIELDS,
    factor_of,
)

#: By the suffix of the file: its language and what writes it.
WRITERS = {".c": ("C99", export_c), ".py": ("MicroPython", export_micropython)}
#: In words.
SENSORS = {"gyro": "Gyro", "accel": "Accelerometer", "mag": "Magnetometer"}
# Samples of the test vector: about a second of motion, in a file of readable length.
VECTOR = 64


def check_export(
    path: Path | None,
    force: bool,
    suffixes: Collection[str] = tuple(WRITERS),
    quantity: str = "--export",
) -> None:
    """Reject a path that cannot be written, before the run starts.

    Raises
    ------
    ConfigError
        The file name has none of the suffixes, the file exists without `force`, or its folder does
        not exist.
    """
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        # Otherwise --force could overwrite the log itself.
        raise ConfigError(
            "report.export-suffix",
            file=str(path),
            quantity=quantity,
            suffixes=" or ".join(suffixes),
        )
    if path.is_dir():
        raise ConfigError("report.export-is-folder", file=str(path), quantity=quantity)
    if path.exists() and not force:
        raise ConfigError("report.already", file=str(path), quantity=quantity)
    if not path.parent.is_dir():
        raise ConfigError("report.no-such-folder", file=str(path.parent), quantity=quantity)


def named_for_export(name: str) -> AttitudeAlgorithm | OrientationEstimator:
    """Make the algorithm or the filter of a name with options.

    Raises
    ------
    ConfigError
        The name, an option or a value is unknown.
    """
    return make_filter(name) if is_filter(name) else make_algorithm(name, (*FILTERS, *STEPS))


def export_module(text: str, suffix: str) -> ExportedFile:
    """Write a module as one file: of `STEPS`, an algorithm or a filter.

    `text`: its name, with options. `suffix`: of the file, which gives the language. ConfigError:
    the name, an option or a value is unknown, or there is no such file of this module.
    """
    name = text.strip().lower().partition(":")[0]
    if name not in STEPS:
        known = (*STEPS, *ALGORITHMS, *FILTERS)
        if plugin("attitude", name, AttitudeAlgorithm) is None:
            check_choice("report.export-unknown", known, quantity="MODULE", name=name)
        return export_attitude(named_for_export(text), WRITERS[suffix][1])
    if suffix != ".c":
        raise ConfigError("report.export-c-alone", quantity="FILE", name=text)
    return step_in_c(text)


def chosen_for_export(
    bench: AttitudeComparison, of: str | None = None
) -> AttitudeAlgorithm | OrientationEstimator:
    """Return what to export: what was named, the recommended algorithm, or else the only one.

    Raises
    ------
    ConfigError
        No algorithm is recommended among several.
    DataError
        The log lacks the accelerometer that a filter needs.
    """
    if of is None:
        labels = [run.algorithm for run in bench.runs]
        of = labels[0] if len(labels) == 1 else bench.answer.algorithm
    if of is None:
        raise ConfigError("report.no-algorithm-accurate-enough-chosen", quantity="--export")
    chosen = named_for_export(of)
    if isinstance(chosen, OrientationEstimator):
        chosen.check_sensors(bench.imu)
    return chosen


def write_export(
    bench: AttitudeComparison, path: Path, of: str | None = None, *, force: bool = False
) -> str:
    """Write one algorithm or filter, with a test vector from the log of a comparison.

    Parameters
    ----------
    path : Path
        File to write: C99 (.c) or MicroPython (.py).
    of : str, optional
        An algorithm or a filter with its options; by default the recommended algorithm, or else the
        only one.
    force : bool
        Overwrite an existing file.

    Returns
    -------
    str
        What was exported.

    Raises
    ------
    ConfigError
        No algorithm is recommended among several, the name is unknown, or the file may not be
        written.
    DataError
        The log lacks the accelerometer that a filter needs.
    """
    check_export(path, force)
    chosen = chosen_for_export(bench, of)
    if isinstance(chosen, OrientationEstimator):
        chosen = _as_compared(bench, chosen)
    configuration, each, mean = _configuration(bench, chosen)
    start = _liveliest(bench, each)
    imu = _at_rate(bench.imu.iloc[start : start + VECTOR * each + 1], each, mean)
    if isinstance(chosen, OrientationEstimator) and set(MAG) <= set(imu):
        imu[MAG] = replace(configuration.mag, scale=1.0, axis=(0, 1, 2), sign=(1, 1, 1)).body(
            imu[MAG].to_numpy(dtype=np.float64)
        )
    of_algorithm: dict[str, Any] = {}
    if isinstance(chosen, AttitudeAlgorithm):
        first = bench.runs[0].attitude[QUATERNION].to_numpy()
        of_algorithm = {
            "interpolation": str(bench.specification["interpolation"]),
            "q_nb": first[start],
        }
    text = WRITERS[path.suffix.lower()][1](
        chosen, imu=imu, configuration=configuration, **of_algorithm
    )
    replace_file(path, text.encode())
    return chosen.label


def _as_compared(bench: AttitudeComparison, named: OrientationEstimator) -> OrientationEstimator:
    """Return a filter with what the log gave, as it was compared; options that are named stay."""
    aiding = "gyro+accel+mag" if set(MAG) <= set(bench.imu) else "gyro+accel"
    runs = [p.ran for p in bench.peers if p.aiding == aiding and p.ran is not None]
    ran = next((one for one in runs if type(one) is type(named)), None)
    if ran is not None and named == type(named)():
        return ran
    if aiding == "gyro+accel":
        return named
    found = bench.magnetometer
    return named.with_heading(found["declination_deg"], found["heading_sd_deg"])


def _configuration(
    bench: AttitudeComparison, chosen: AttitudeAlgorithm | OrientationEstimator
) -> tuple[SensorConfiguration, int, bool]:
    """Configuration of the exported sensors, samples of the log to one of its own, their mean."""
    answer, imu = bench.answer, bench.imu
    full = bench.clock.rate_hz
    recommended = answer.rate_hz if answer.algorithm == chosen.label else None
    each = 1 if recommended is None else max(1, round(full / float(recommended)))
    rate = full / each  # a last, shorter step is in what the answer states
    mean = imu.attrs["sampling"] == "mean" or (each > 1 and answer.meaning != "drop")
    by = "by the answer" if recommended is not None else "of the log, at which it was compared"
    made_of = "as in the log" if each == 1 else f"one in {each} of the log"
    if mean and each > 1:
        made_of = f"the mean over {each} steps of the log"
    sources = [f"Rate: {by}. A sample: {made_of}."]
    gyro = _channel(bench, GYRO, Channel("rad/s"), {**GYRO_UNITS, **GYRO_SUMS}, sources)
    bias = bench.gyro_bias.get("rad_per_s")
    if bias is not None:
        gyro = replace(gyro, bias=tuple(bias))
        sources.append(f"Gyro bias: {bench.gyro_bias['from']}.")
    made = SensorConfiguration(rate, gyro)
    if isinstance(chosen, OrientationEstimator):
        units = {**ACCEL_UNITS, **ACCEL_SUMS}
        made = replace(made, accel=_channel(bench, ACCEL, made.accel, units, sources))
        if set(MAG) <= set(imu):
            made = replace(made, mag=_magnetometer(bench, made.mag, sources))
    sources.append(f"Log: {bench.source}.")
    return replace(made, sources=tuple(sources)), each, mean


def _channel(
    bench: AttitudeComparison,
    columns: list[str],
    known: Channel,
    units: dict[str, float],
    sources: list[str],
) -> Channel:
    """How the log gives one sensor."""
    readings = {r.quantity.lstrip("-"): r for r in bench.readings}
    if not set(columns) <= set(readings):
        return known
    reading = readings[columns[0]]
    names = ", ".join(readings[name].source for name in columns)
    unit, scale = reading.unit, factor_of(reading.unit, units)
    if unit in GYRO_SUMS or unit in ACCEL_SUMS:
        sources.append(f"Unit: the log has increments in {unit}; give them by s of the step.")
        unit, scale = known.unit, 1.0
    attrs = bench.imu.attrs
    axes = attrs.get("sensor_axes") if columns is GYRO else attrs.get("aiding_axes")
    axis, sign = parse_axes(str(axes or attrs.get("sensor_axes") or "x,y,z"))
    sensor = columns[0].partition("_")[0]
    sources.append(f"{SENSORS[sensor]}: columns {names}: {reading.why}.")
    return Channel(unit, scale, axis, sign)


def _magnetometer(bench: AttitudeComparison, known: Channel, sources: list[str]) -> Channel:
    """How the log gives the field, and the iron to remove."""
    made = _channel(bench, MAG, known, {**MAG_UNITS, **RELATIVE_FIELDS}, sources)
    if "hard_iron" not in bench.magnetometer:
        return made
    sources.append("Magnetometer: hard and soft iron as found.")
    soft = bench.magnetometer["soft_iron"]
    return replace(
        made,
        bias=bench.magnetometer["hard_iron"],
        matrix=None if np.array_equal(soft, np.eye(3)) else soft,
    )


def _at_rate(imu: pd.DataFrame, each: int, mean: bool) -> pd.DataFrame:
    """Samples of a lower rate: one in so many, or their means, with the first for the start."""
    if each == 1 or not mean:
        return imu.iloc[::each].copy()
    steps = increments_from_imu(imu)
    count = len(steps) // each
    ends = index_of(steps).reshape(-1)[each - 1 : count * each : each]
    sums = steps[THETA].to_numpy()[: count * each].reshape(count, each, 3).sum(axis=1)
    time = np.concatenate([index_of(imu)[:1], ends])
    rates = sums / np.diff(time)[:, None]
    return imu_table(time, np.vstack([rates[:1], rates]), sampling="mean")


def _liveliest(bench: AttitudeComparison, each: int) -> int:
    """Start of the test vector: the stretch with the most rotation, which exercises the code."""
    rate = bench.imu[GYRO].to_numpy()
    energy = (rate * rate).sum(axis=1).cumsum()
    length = VECTOR * each
    if len(energy) <= length:
        return 0
    return int((energy[length:] - energy[:-length]).argmax())
