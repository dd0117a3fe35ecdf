"""An attitude algorithm or an orientation filter as one file for a device, from the kernels."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd
from numpy.typing import ArrayLike

from strapdown.attitude_algorithms import AttitudeAlgorithm
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.export.algorithms import algorithm_file, algorithm_kernels, sampling_kind, shape_of
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.cost import most_operations
from strapdown.export.filters import filter_file, filter_kernels, sample_kernel
from strapdown.export.steps import ExportedFile
from strapdown.orientation_filters import OrientationEstimator
from strapdown.tables import GYRO, MAG


def export_c(
    chosen: AttitudeAlgorithm | OrientationEstimator,
    *,
    interpolation: str = "linear",
    sampling: str | None = None,
    magnetometer: bool | None = None,
    q_nb: ArrayLike | None = None,
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an algorithm or a filter as one C99 file with its own test.

    The formulas are translated from strapdown's own kernels: the same operations in the same order.
    In double precision the file reproduces `run_attitude` or `run_filter` bitwise wherever the C
    library's sine and cosine equal those of Python.

    `interpolation` ({'linear', 'cubic'}): as in `increments_from_imu`; the cubic delays the
    attitude by one sample, and filters take the linear alone. `sampling` ({'instantaneous',
    'mean'}): meaning of a sample; by default as in `imu`, or the value at its instant.
    `magnetometer`: whether a filter takes one; by default if `imu` has one, and without `imu` it
    does. `q_nb` ((4,)): initial attitude of the test; by default that of an algorithm is level, and
    a filter finds it. `imu`: an Imu table whose first 48 samples are the test; by default a
    built-in motion. `configuration`: rate, units, axes and biases of the sensors, with which the
    file takes their raw readings at even steps; `imu` then has samples of that rate. Returns the
    text of the file. ConfigError: `interpolation` or `sampling` is unknown, or `sampling` differs
    from that of `imu`. DataError: `q_nb` is not a rotation; `imu` has not the sensors; or as
    `tables.check_imu`.
    """
    asked = (interpolation, sampling, magnetometer)
    return _written("c", chosen, asked, q_nb, imu, configuration)


def export_micropython(
    chosen: AttitudeAlgorithm | OrientationEstimator,
    *,
    interpolation: str = "linear",
    sampling: str | None = None,
    magnetometer: bool | None = None,
    q_nb: ArrayLike | None = None,
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an algorithm or a filter as one file for MicroPython and CPython, with its own test.

    The kernels themselves, without numba and numpy, their options as constants, and a class
    ``Attitude``. Arguments, result and errors: as of `export_c`.
    """
    asked = (interpolation, sampling, magnetometer)
    return _written("py", chosen, asked, q_nb, imu, configuration)


def _written(
    language: str,
    chosen: AttitudeAlgorithm | OrientationEstimator,
    asked: tuple[str, str | None, bool | None],
    q_nb: ArrayLike | None,
    imu: pd.DataFrame | None,
    configuration: SensorConfiguration | None,
) -> str:
    """Write a file; `asked`: interpolation, sampling, and whether there is a magnetometer."""
    interpolation, sampling, magnetometer = asked
    if isinstance(chosen, AttitudeAlgorithm):
        return algorithm_file(
            chosen,
            language,
            kind=sampling_kind(interpolation, sampling, imu),
            q_nb=(1.0, 0.0, 0.0, 0.0) if q_nb is None else q_nb,
            imu=imu,
            configuration=configuration,
        )
    # Of the other sensors a sample may be missing.
    kind = sampling_kind(interpolation, sampling, None if imu is None else imu[GYRO])
    chosen.check_interpolation(interpolation)
    if magnetometer is None:
        magnetometer = imu is None or set(MAG) <= set(imu.columns)
    return filter_file(
        chosen,
        language,
        magnetometer=magnetometer,
        sampling="mean" if kind == "mean" else "instantaneous",
        q_nb=q_nb,
        imu=imu,
        configuration=configuration,
    )


def export_attitude(
    chosen: AttitudeAlgorithm | OrientationEstimator, writer: Callable[..., str]
) -> ExportedFile:
    """Write an algorithm or a filter by `export_c` or `export_micropython`, with its operations."""
    if isinstance(chosen, AttitudeAlgorithm):
        kernels, step, _ = algorithm_kernels(chosen, shape_of(chosen), "linear")
        memory = count_cost(chosen).memory
    else:
        kernels, memory = filter_kernels(chosen, True, "instantaneous"), chosen.size
        step = kernels.namespace[sample_kernel(chosen)]
    largest = {name: high for name, (_, high) in kernels.ranges.items()}
    return ExportedFile(chosen.label, writer(chosen), most_operations(step, largest), memory)
