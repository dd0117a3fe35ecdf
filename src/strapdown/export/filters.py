"""An orientation filter as one file for a device: what its template is filled with."""

from __future__ import annotations

import importlib
from math import cos, radians, sin
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import arithmetic, orientation
from strapdown.constants import CORTEX_M4F_CYCLES, Array
from strapdown.errors import DataError
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.kernels import Kernels
from strapdown.export.program import ROUNDINGS, SAMPLES, Vector, c_file, python_file
from strapdown.orientation_filters import OrientationEstimator
from strapdown.orientation_filters.cost import count_filter_cost
from strapdown.tables import ACCEL, GYRO, MAG

HOME = "orientation"
SENSORS = ("gyro", "accel", "mag")
#: In a test vector, of a sensor without a new sample: beyond what a filter takes.
MISSING = 1e30
#: Facts about the kernels without a magnetometer.
NO_FIELD = {"usable(mx, my, mz)": 0.0, "r[FIELDS]": 0.0, "r[HEADED]": 0.0}


def filter_file(
    chosen: OrientationEstimator,
    language: str,
    *,
    magnetometer: bool,
    sampling: str,
    q_nb: ArrayLike | None = None,
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an orientation filter as one file with its own test: `export_c`.

    `language` ({'c', 'py'}): C99 or MicroPython.
    """
    kernels = filter_kernels(chosen, magnetometer, sampling)
    always, then = begun_numbers(chosen, sampling)
    vector = filter_vector(chosen, magnetometer, sampling, q_nb, imu, configuration)
    half = 0.5 * radians(chosen.declination)
    facts = {
        "size": chosen.size,
        "magnetometer": magnetometer,
        "always": always,
        "then": then,
        "kernel": sample_kernel(chosen),
        "turn": (cos(half), sin(half)) if magnetometer and chosen.declination else None,
        "deviation": states_deviation(chosen),
        "field_variance": radians(getattr(chosen, "field", 0.0)) ** 2,
        "lag": 0,
        "start": None if q_nb is None else tuple(rotation.normalise(q_nb).tolist()),
        "vector": vector,
        "sensors": {
            name: getattr(configuration, name, None) for name in SENSORS[: 2 + magnetometer]
        },
        "configuration": configuration,
    }
    if language == "py":
        mean = "the mean over the dt that ends with it" if sampling == "mean" else "at its instant"
        head = [title_of(chosen, magnetometer), f"{chosen.label}. A sample is {mean}"]
        return python_file("filter", head, kernels, {**facts, "title": chosen.title})
    facts |= {
        "north": _north(chosen, magnetometer),
        "row_words": _columns(magnetometer, configuration is not None),
        "bound": bound_words(vector),
    }
    return c_file("filter", _head(chosen, magnetometer, sampling, configuration), kernels, facts)


def sample_kernel(chosen: OrientationEstimator) -> str:
    """Name of the kernel of one sample."""
    name: str = type(chosen).advance_kernel.__name__
    return name.replace("_advance", "_sample")


def states_deviation(chosen: OrientationEstimator) -> bool:
    """Whether a filter has a covariance."""
    return chosen.row == orientation.ROW


def options_of(chosen: OrientationEstimator, sampling: str) -> dict[str, float]:
    """Values of the numbers of the record that are options, by their names."""
    options, first = chosen.kernel_options(), orientation.OPTIONS
    names = {
        name: index - first
        for name, index in vars(orientation).items()
        if type(index) is int and first <= index < first + len(options)
    }
    return {name: float(options[at]) for name, at in names.items()} | {
        "MEAN": float(sampling == "mean")
    }


def filter_kernels(chosen: OrientationEstimator, magnetometer: bool, sampling: str) -> Kernels:
    """Kernels of a filter, with its options as constants."""
    fixed = {f"r[{name}]": value for name, value in options_of(chosen, sampling).items()}
    kernels = Kernels(HOME, fixed=fixed | ({} if magnetometer else NO_FIELD))
    kernels.require(sample_kernel(chosen))
    for name in ("quat_normalise", "euler_from_quat"):
        kernels.require(name)
    if states_deviation(chosen):
        kernels.require("euler_deviation")
    return kernels


def title_of(chosen: OrientationEstimator, magnetometer: bool) -> str:
    """The first line of a file."""
    sensors = "gyro, accelerometer and magnetometer" if magnetometer else "gyro and accelerometer"
    return f"{chosen.title} for {sensors}, {chosen.source}"


def begun_numbers(
    chosen: OrientationEstimator, sampling: str
) -> tuple[dict[str, float], dict[str, float]]:
    """Numbers of the record before the first sample, by their index: of none, of an attitude.

    Those of the options and of the attitude itself are not among them.
    """
    free, given = (chosen.begin(q, sampling) for q in (None, (1.0, 0.0, 0.0, 0.0)))
    first = orientation.OPTIONS
    skip = {orientation.Q, orientation.MEAN, *range(first, first + len(chosen.kernel_options()))}
    names = {getattr(orientation, n): n for n in ("LEVELED", "POWER")}

    def index(at: int) -> str:
        if at >= orientation.P and states_deviation(chosen):
            return f"P + {at - orientation.P}"
        return names.get(at, str(at))

    always = {index(i): float(v) for i, v in enumerate(free) if v and i not in skip}
    changed = [int(i) for i in np.flatnonzero(free != given) if int(i) not in skip]
    return always, {index(i): float(given[i]) for i in changed}


def _head(
    chosen: OrientationEstimator,
    magnetometer: bool,
    sampling: str,
    configuration: SensorConfiguration | None,
) -> list[str]:
    version = importlib.import_module("strapdown").__version__
    sensors = SENSORS[: 2 + magnetometer]
    step = 0.01 if configuration is None else 1.0 / configuration.rate_hz
    cost = count_filter_cost(chosen, step, magnetometer)
    operations = ", ".join(
        f"{count:.3g} {kind}" for kind in CORTEX_M4F_CYCLES if (count := getattr(cost, kind))
    )
    mean = "the mean over the dt that ends with it" if sampling == "mean" else "at its instant"
    columns = "gx gy gz ax ay az" + (" mx my mz" if magnetometer else "")
    return [
        f"{title_of(chosen, magnetometer)}.",
        f"{chosen.label}, written by strapdown {version} from the kernels that it runs itself. "
        f"A sample is {mean}.",
        *(() if configuration is None else configuration.words(sensors)),
        "Axes: body forward-right-down; local level north-east-down"
        f"{_north(chosen, magnetometer)}. q_nb turns body into local level, Hamilton, scalar "
        "first. Rates in rad/s, specific force in m/s² (up at rest), time in s.",
        f"Operations a sample, at {1.0 / step:.6g} Hz: {operations}. Memory in single precision: "
        f"{4 * chosen.size} bytes.",
        "Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 "
        "-DATTITUDE_TEST attitude.c -lm && ./a.out. With -DATTITUDE_FILTER it reads lines of "
        f"{'dt ' if configuration is None else 'raw readings '}{columns}, nan where there is none, "
        "and writes a quaternion for each.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]


def _north(chosen: OrientationEstimator, magnetometer: bool) -> str:
    if not magnetometer:
        return ", the heading counted from the start"
    if chosen.declination:
        return f" of true north, the declination {chosen.declination:.6g} deg"
    return " of magnetic north"


def _columns(magnetometer: bool, raw: bool) -> str:
    what = (
        "raw readings of gyro, accelerometer" if raw else "dt in s, rates in rad/s, forces in m/s²"
    )
    field = (", magnetometer" if raw else ", fields") if magnetometer else ""
    return f"{what}{field}; 1e30 where there is none"


# The test vector.


def filter_motion(magnetometer: bool) -> Array:
    """A body that lies still for 2 s and then tumbles, with lost samples and one gap, (48, 10).

    dt in s, rate, specific force and field, NaN where there is none. It crosses all that a filter
    does: leveling, heading, the end of blocks, rest, a disturbed field, and a gap.
    """
    k = np.arange(SAMPLES)
    dt = np.full(SAMPLES, 0.0625)
    dt[42] = 0.75
    grow = np.clip(0.3 * (k - 30), 0.0, 2.0)
    rate = np.column_stack([np.sin(0.3 * k), np.cos(0.4 * k), 0.7 * np.sin(0.2 * k + 1)])
    rate = rate * grow[:, None] + [0.002, -0.001, 0.0015]
    q = [rotation.quaternion_from_euler([20.0, -15.0, 70.0])]
    for turn in (rate[:-1] + rate[1:]) * 0.5 * dt[1:, None]:
        q.append(rotation.compose(q[-1], rotation.quaternion_from_rotation_vector(turn)))
    back = rotation.conjugate(np.array(q))
    force = rotation.rotate(back, np.array([0.0, 0.0, -orientation.G]))
    force[:, 0] += 0.5 * grow * np.sin(1.1 * k)
    field = rotation.rotate(back, np.array([20.0, 1.0, 44.0]))
    field[35:39] *= 1.4
    force[[2, 40]] = np.nan
    field[1::2] = np.nan
    return np.column_stack([dt, rate, force, field][: 3 + magnetometer])


def filter_vector(
    chosen: OrientationEstimator,
    magnetometer: bool,
    sampling: str,
    q_nb: ArrayLike | None,
    imu: pd.DataFrame | None,
    configuration: SensorConfiguration | None,
) -> Vector:
    """Run the kernels in both precisions over the same samples.

    `q_nb` ((4,)): initial attitude, None: found from the samples. `imu`: its first 48 samples; by
    default a built-in motion. `configuration`: samples are raw readings at its rate.
    """
    sensors = SENSORS[: 2 + magnetometer]
    rows = filter_motion(magnetometer) if imu is None else _rows(imu, magnetometer)
    rows = rows.astype(np.float32).astype(np.float64)
    samples, double_rows, single_rows = rows, rows, rows
    if configuration is not None:
        step = np.full((len(rows), 1), 1.0 / configuration.rate_hz)
        raw = [
            getattr(configuration, name).raw(rows[:, 1 + 3 * i : 4 + 3 * i])
            for i, name in enumerate(sensors)
        ]
        samples = np.hstack(raw).astype(np.float32).astype(np.float64)
        double_rows, single_rows = (
            np.hstack(
                [
                    step,
                    *(
                        getattr(configuration, name).body(samples[:, 3 * i : 3 * i + 3], kind)
                        for i, name in enumerate(sensors)
                    ),
                ]
            )
            for kind in (np.float64, np.float32)
        )
    double = _run(chosen, double_rows, q_nb, sampling, single=False)
    single = _run(chosen, single_rows, q_nb, sampling, single=True)
    apart = float(np.max(np.radians(rotation.rotation_angle(double, single))))
    own = len(rows) * ROUNDINGS * float(np.finfo(np.float32).eps)
    return Vector(
        np.where(np.isnan(samples), MISSING, samples), double, single, 1 + 4 * apart / own
    )


def bound_words(vector: Vector) -> str:
    """Why the bound is what it is."""
    return (
        f"{len(vector.samples)} samples of {ROUNDINGS} roundings that another compiler or another "
        f"sine may make otherwise, which the corrections magnify up to {vector.condition:.3g} "
        "times: one more than four times what single and double precision differ by"
    )


def _rows(imu: pd.DataFrame, magnetometer: bool) -> Array:
    part = imu.iloc[:SAMPLES]
    columns = [*GYRO, *ACCEL, *(MAG if magnetometer else ())]
    if not set(columns) <= set(part.columns):
        raise DataError(
            "attitude.filter-needs-accelerometer",
            file=imu.attrs.get("source"),
            quantity="accel",
            name="export",
        )
    time = part.index.to_numpy(dtype=np.float64)
    values = part[columns].to_numpy(dtype=np.float64)
    return np.column_stack([np.diff(time, prepend=time[0]), values])


def _run(
    chosen: OrientationEstimator,
    rows: Array,
    q_nb: ArrayLike | None,
    sampling: str,
    single: bool,
) -> Array:
    kind: Any = np.float32 if single else np.float64
    module = arithmetic.single_precision(HOME) if single else orientation
    kernel = getattr(module, type(chosen).advance_kernel.__name__)
    dt, gyro, accel = (
        np.ascontiguousarray(rows[:, part].astype(kind)) for part in (0, slice(1, 4), slice(4, 7))
    )
    mag = (
        np.ascontiguousarray(rows[:, 7:10].astype(kind))
        if rows.shape[1] > 7
        else np.empty((0, 3), kind)
    )
    record = chosen.begin(q_nb, sampling).astype(kind)
    history = np.empty((len(dt), chosen.row), kind)
    kernel(record, dt, gyro, accel, mag, history)
    return chosen.attitudes(history[:, :4].astype(np.float64), record.astype(np.float64))
