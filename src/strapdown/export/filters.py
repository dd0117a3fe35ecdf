"""An orientation filter as one C99 file: header, interface, kernels, test."""

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
from strapdown.export.algorithms import ANGLES
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.device import comment, device_translator, number, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.program import (
    ROUNDINGS,
    SAMPLES,
    Vector,
    attitude_harness,
    attitude_test,
    c_rows,
    constant_lines,
    precision_lines,
    unit_lines,
)
from strapdown.export.types_of_c import wrapped
from strapdown.orientation_filters import OrientationEstimator
from strapdown.orientation_filters.cost import count_filter_cost
from strapdown.tables import ACCEL, GYRO, MAG

HOME = "orientation"
SENSORS = ("gyro", "accel", "mag")
#: In a test vector, of a sensor without a new sample: beyond what a filter takes.
MISSING = 1e30
#: Facts about the kernels without a magnetometer.
NO_FIELD = {"usable(mx, my, mz)": 0.0, "r[FIELDS]": 0.0, "r[HEADED]": 0.0}


def filter_in_c(
    chosen: OrientationEstimator,
    *,
    magnetometer: bool,
    sampling: str,
    q_nb: ArrayLike | None = None,
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an orientation filter as one C99 file with its own test: `export_c`."""
    kernels = filter_kernels(chosen, magnetometer, sampling)
    translator = device_translator()
    functions = kernels.in_c(translator)
    sensors = SENSORS[: 2 + magnetometer]
    field = ", const real_t *mag" if magnetometer else ""
    interface = _INTERFACE.format(
        size=chosen.size,
        field=field,
        heads=" and the first field heads" if magnetometer else "",
        fields=", mag the field in any unit" if magnetometer else "",
        north=_north(chosen, magnetometer),
    )
    ends = _ENDS.format(
        begin=_begin(chosen, sampling),
        sample=sample_kernel(chosen),
        field=field,
        fields=", m[0], m[1], m[2]" if magnetometer else "",
        missing=_MISSING_FIELD if magnetometer else "",
        turn=_turn(chosen, magnetometer),
        angles=ANGLES,
    )
    if states_deviation(chosen):
        interface += _SD_PROTOTYPE
        ends += _sd(chosen, magnetometer)
    if configuration is not None:
        interface += _SAMPLE_PROTOTYPE.format(field=field)
        ends += (
            "\n"
            + unit_lines(configuration, sensors).rstrip("\n")
            + "\n"
            + _sample(configuration, magnetometer)
        )
    vector = filter_vector(chosen, magnetometer, sampling, q_nb, imu, configuration)
    body = "\n".join([*functions, ends])
    raw = configuration is not None
    start = None if q_nb is None else rotation.normalise(q_nb)
    harness = attitude_harness(_take(magnetometer, raw), _columns(magnetometer, raw), vector, start)
    parts = [
        _header(chosen, magnetometer, sampling, configuration),
        precision_lines(body, translator.names.text),
        interface,
        constant_lines(kernels),
        body,
        attitude_test(harness, vector, bound_words(vector)),
    ]
    return "\n".join(parts)


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


def begin_lines(chosen: OrientationEstimator, sampling: str) -> tuple[list[str], list[str]]:
    """Numbers of the record before the first sample, ``[index] value``: of none, of an attitude.

    Those of the options and of the attitude itself are not among them.
    """
    free, given = (chosen.begin(q, sampling) for q in (None, (1.0, 0.0, 0.0, 0.0)))
    first = orientation.OPTIONS
    skip = {orientation.Q, orientation.MEAN, *range(first, first + len(chosen.kernel_options()))}
    names = {getattr(orientation, n): n for n in ("LEVELED", "POWER")}

    def line(index: int, value: float) -> str:
        name = names.get(index, str(index))
        if index >= orientation.P and states_deviation(chosen):
            name = f"P + {index - orientation.P}"
        return f"[{name}] {value!r}"

    always = [line(i, float(v)) for i, v in enumerate(free) if v and i not in skip]
    then = [
        line(int(i), float(given[i])) for i in np.flatnonzero(free != given) if int(i) not in skip
    ]
    return always, then


# The C code around the kernels.


def _header(
    chosen: OrientationEstimator,
    magnetometer: bool,
    sampling: str,
    configuration: SensorConfiguration | None,
) -> str:
    version = importlib.import_module("strapdown").__version__
    sensors = SENSORS[: 2 + magnetometer]
    step = 0.01 if configuration is None else 1.0 / configuration.rate_hz
    cost = count_filter_cost(chosen, step, magnetometer)
    operations = ", ".join(
        f"{count:.3g} {kind}" for kind in CORTEX_M4F_CYCLES if (count := getattr(cost, kind))
    )
    mean = "the mean over the dt that ends with it" if sampling == "mean" else "at its instant"
    columns = "gx gy gz ax ay az" + (" mx my mz" if magnetometer else "")
    lines = [
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
    return "\n".join(comment("\n\n".join(lines))) + "\n"


def _north(chosen: OrientationEstimator, magnetometer: bool) -> str:
    if not magnetometer:
        return ", the heading counted from the start"
    if chosen.declination:
        return f" of true north, the declination {chosen.declination:.6g} deg"
    return " of magnetic north"


_INTERFACE = """\
struct attitude {{
    real_t record[{size}];
}};

/* Start from an attitude, a quaternion of any length but zero, or from none (a null pointer): the
 * first specific force levels the body{heads}, moving or not.
 */
void attitude_init(struct attitude *a, const real_t *q_nb);

/* Take a sample: dt in s since the last sample that was taken, gyro in rad/s, accel the specific
 * force in m/s²{fields}; a null pointer for a sensor that has no new sample.
 * Returns 0, or 1 for a sample that is refused (dt not above zero, or a rate that is not finite);
 * it then has changed nothing. The dt of the first sample is not looked at.
 */
int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3],
    const real_t *accel{field});

/* The attitude as a unit quaternion,{north}. */
void attitude_quaternion(const struct attitude *a, real_t q_nb[4]);

/* The attitude as roll, pitch and heading, rad. */
void attitude_euler(const struct attitude *a, real_t euler[3]);

/* The estimated gyro bias, rad/s: beyond the one that was subtracted. */
void attitude_gyro_bias(const struct attitude *a, real_t bias[3]);
"""
_SD_PROTOTYPE = """
/* Standard deviations of roll, pitch and heading, rad: 95 % are 1.96 of them. */
void attitude_euler_sd(const struct attitude *a, real_t sd[3]);
"""
_SAMPLE_PROTOTYPE = """
/* Take raw readings of the sensors, x, y, z in their own units and axes, a step after those before,
 * and give the attitude. Returns as attitude_update, which takes numbers of the body and any step,
 * as after a lost sample; a null pointer as there.
 */
int attitude_sample(struct attitude *a, const real_t gyro[3],
    const real_t *accel{field}, real_t q_nb[4]);
"""

_ENDS = """\
void attitude_init(struct attitude *a, const real_t *q_nb)
{{
    real_t *r = a->record;
    for (int i = 0; i < (int)(sizeof a->record / sizeof r[0]); i++) {{
        r[i] = R(0.0);
    }}
    r[Q] = R(1.0);
{begin}}}

int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3],
    const real_t *accel{field})
{{
    static const real_t none[3] = {{LARGEST, LARGEST, LARGEST}};
    const real_t *f = accel ? accel : none;
{missing}    /* Written so, NaN is refused, too. The first sample ends no step. */
    if (!((dt > R(0.0) && dt < LARGEST) || a->record[SAMPLES] == R(0.0))
        || !usable(gyro[0], gyro[1], gyro[2])) {{
        return 1;
    }}
    {sample}(a->record, dt, gyro[0], gyro[1], gyro[2], f[0], f[1],
        f[2]{fields});
    return 0;
}}

void attitude_quaternion(const struct attitude *a, real_t q_nb[4])
{{
    const real_t *r = a->record;
    const real_t w = r[Q], x = r[Q + 1], y = r[Q + 2], z = r[Q + 3];
{turn}}}

void attitude_euler(const struct attitude *a, real_t euler[3])
{{
    real_t q[4];
    attitude_quaternion(a, q);
{angles}
}}

void attitude_gyro_bias(const struct attitude *a, real_t bias[3])
{{
    for (int i = 0; i < 3; i++) {{
        bias[i] = a->record[BIAS + i];
    }}
}}
"""
_MISSING_FIELD = "    const real_t *m = mag ? mag : none;\n"
_TARGETS = [f"q_nb[{i}]" for i in range(4)]


def _begin(chosen: OrientationEstimator, sampling: str) -> str:
    always, then = (
        [f"r{head}] = {number(float(value))};" for head, value in (x.split("] ") for x in lines)]
        for lines in begin_lines(chosen, sampling)
    )
    unit = "quat_normalise(q_nb[0], q_nb[1], q_nb[2], q_nb[3])"
    given = unpacked(unit, ("r[Q]", "r[Q + 1]", "r[Q + 2]", "r[Q + 3]"), " " * 8)
    lines = [
        *(f"    {line}" for line in always),
        *("    if (q_nb) {", given),
        *(f"        {line}" for line in then),
        "    }",
    ]
    return "\n".join(lines) + "\n"


def _turn(chosen: OrientationEstimator, magnetometer: bool) -> str:
    plain = unpacked("quat_normalise(w, x, y, z)", _TARGETS) + "\n"
    if not (magnetometer and chosen.declination):
        return plain
    half = 0.5 * radians(chosen.declination)
    c, s = number(cos(half)), number(sin(half))
    turned = "c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w"
    return (
        f"    /* From magnetic to true north: half of the declination. */\n"
        f"    const real_t c = {c}, s = {s};\n"
        "    if (r[HEADED] == R(0.0)) {\n"
        + unpacked("quat_normalise(w, x, y, z)", _TARGETS, " " * 8)
        + "\n        return;\n    }\n"
        + unpacked(f"quat_normalise({turned})", _TARGETS)
        + "\n"
    )


def _sd(chosen: OrientationEstimator, magnetometer: bool) -> str:
    own = radians(getattr(chosen, "field", 0.0)) ** 2
    dd = "p[2 * N + 2]"
    if magnetometer:
        dd += f" + (r[HEADED] != R(0.0) ? {number(own)} : R(0.0))"
    terms = f"r[Q], r[Q + 1], r[Q + 2], r[Q + 3], p[0], p[1], p[2], p[N + 1], p[N + 2], {dd}"
    lines = unpacked(f"euler_deviation({terms})", ("sd[0]", "sd[1]", "sd[2]"))
    return f"""
void attitude_euler_sd(const struct attitude *a, real_t sd[3])
{{
    const real_t *r = a->record, *p = a->record + P;
{lines}
}}
"""


def _sample(configuration: SensorConfiguration, magnetometer: bool) -> str:
    gyro, accel, mag = (
        c_rows(getattr(configuration, name), name, f"{name.upper()}_UNIT") for name in SENSORS
    )
    field = ", const real_t *mag" if magnetometer else ""

    def when(name: str, values: str) -> str:
        rows = [" ".join(v.split()) for v in values.split(",\n") if v.strip()]
        text = "".join(
            f"{line}\n"
            for i, row in enumerate(rows)
            for line in wrapped(f"{name}_b[{i}] = {row};", "        ")
        )
        return f"    if ({name}) {{\n{text}    }}\n"

    arrays = "accel_b[3] = {R(0.0), R(0.0), R(0.0)}"
    if magnetometer:
        arrays += ", mag_b[3] = {R(0.0), R(0.0), R(0.0)}"
    return (
        "\nint attitude_sample(struct attitude *a, const real_t gyro[3],\n    const real_t *accel"
        f"{field}, real_t q_nb[4])\n{{\n    const real_t gyro_b[3] = {{\n{gyro}    }};\n"
        f"    real_t {arrays};\n"
        + when("accel", accel)
        + (when("mag", mag) if magnetometer else "")
        + "    const int refused = attitude_update(a, ATTITUDE_STEP, gyro_b, accel ? accel_b : 0"
        + (",\n        mag ? mag_b : 0" if magnetometer else "")
        + ");\n    attitude_quaternion(a, q_nb);\n    return refused;\n}\n"
    )


# How the test passes samples.


def _columns(magnetometer: bool, raw: bool) -> str:
    what = (
        "raw readings of gyro, accelerometer" if raw else "dt in s, rates in rad/s, forces in m/s²"
    )
    field = (", magnetometer" if raw else ", fields") if magnetometer else ""
    return f"{what}{field}; 1e30 where there is none"


def _take(magnetometer: bool, raw: bool) -> str:
    first = 0 if raw else 1
    lines = []
    for k, name in enumerate(SENSORS[: 2 + magnetometer]):
        values = ", ".join(f"R(v[{first + 3 * k + i}])" for i in range(3))
        lines.append(f"    const real_t {name}[3] = {{{values}}};")
    field = f", v[{first + 6}] < 1e29 ? mag : 0" if magnetometer else ""
    given = f"gyro, v[{first + 3}] < 1e29 ? accel : 0{field}"
    if raw:
        lines.append("    real_t turned[4];")
    call = f"sample(s, {given}, turned)" if raw else f"update(s, R(v[0]), {given})"
    return "\n".join([*lines, *wrapped(f"const int refused = attitude_{call};", "    ")])


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
