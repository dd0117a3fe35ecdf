"""An attitude algorithm or an orientation filter as one file for a device, from the kernels."""

from __future__ import annotations

import ast
import copy
import importlib
import textwrap
from collections.abc import Callable, Sequence
from math import cos, radians, sin
from typing import Any

import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.attitude_algorithms import AttitudeAlgorithm
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.constants import Array
from strapdown.export.algorithms import (
    SAMPLINGS,
    algorithm_in_c,
    algorithm_kernels,
    make_vector,
    sampling_kind,
    shape_of,
)
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.cost import most_operations
from strapdown.export.filters import (
    SENSORS,
    begin_lines,
    filter_in_c,
    filter_kernels,
    filter_vector,
    sample_kernel,
    states_deviation,
    title_of,
)
from strapdown.export.kernels import Kernels
from strapdown.export.program import Vector
from strapdown.export.sources import Kernel
from strapdown.export.steps import ExportedFile
from strapdown.export.types_of_c import WIDTH
from strapdown.orientation_filters import OrientationEstimator
from strapdown.tables import GYRO, MAG

# An algorithm or a filter as one Python file for MicroPython: the kernels, specialized.


def algorithm_in_python(
    algorithm: AttitudeAlgorithm,
    *,
    kind: str,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an attitude algorithm as one Python file: `export_micropython`."""
    shape = shape_of(algorithm)
    kernels, step, increments = algorithm_kernels(algorithm, shape, kind)
    change = "dx" in step.parameters
    of = {"state": "self.state", "dt": "dt"}
    of |= {f"t{axis}": f"theta[{i}]" for i, axis in enumerate("xyz")}
    if kind == "mean":
        of |= {f"d{axis}": "0.0" for axis in "xyz"}
    else:
        of |= {f"d{axis}": f"dtheta[{i}]" for i, axis in enumerate("xyz")}
    update = _UPDATES[kind].format(
        increment=increments.name,
        both="t, d" if change and kind == "linear" else "t",
        keep="dtheta.append(d)" if change else "pass",
        step=f"{step.name}({', '.join(of[p] for p in step.parameters)})",
    )
    start = rotation.normalise(q_nb)
    body = _ALGORITHM.format(
        title=algorithm.title,
        words=SAMPLINGS[kind].words,
        size=len(algorithm.begin(start)),
        begin=shape.python[0],
        read=textwrap.indent(shape.python[1], " " * 8),
        update=update,
        memory=_MEMORY[kind],
    )
    raw = "" if configuration is None else _sample(configuration, ("gyro",), "")
    vector = make_vector(algorithm, start, kind, imu, configuration)
    head = [f"{algorithm.title}, {algorithm.source}", algorithm.label, *_words(configuration, 1)]
    return _file(head, kernels, configuration, body + raw, vector, 1, start, SAMPLINGS[kind].lag)


def filter_in_python(
    chosen: OrientationEstimator,
    *,
    magnetometer: bool,
    sampling: str,
    q_nb: ArrayLike | None = None,
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an orientation filter as one Python file: `export_micropython`."""
    kernels = filter_kernels(chosen, magnetometer, sampling)
    always, then = begin_lines(chosen, sampling)
    body = _FILTER.format(
        title=chosen.title,
        size=chosen.size,
        always="".join(_record_line(x, 8) for x in always),
        then="".join(_record_line(x, 12) for x in then),
        sample=sample_kernel(chosen),
        field=", mag=None" if magnetometer else "",
        missing="        mag = NONE if mag is None else mag\n" if magnetometer else "",
        fields=", mag[0], mag[1], mag[2]" if magnetometer else "",
        turn=_turn(chosen, magnetometer),
    )
    if states_deviation(chosen):
        own = radians(getattr(chosen, "field", 0.0)) ** 2
        more = f"\n        if r[HEADED] != 0.0:\n            dd += {own!r}" if magnetometer else ""
        body += _SD.format(more=more)
    if configuration is not None:
        names = SENSORS[: 2 + magnetometer]
        body += _sample(configuration, names, ", mag=None" if magnetometer else "")
    vector = filter_vector(chosen, magnetometer, sampling, q_nb, imu, configuration)
    sensors = 2 + magnetometer
    mean = "the mean over the dt that ends with it" if sampling == "mean" else "at its instant"
    head = [
        title_of(chosen, magnetometer),
        f"{chosen.label}. A sample is {mean}",
        *_words(configuration, sensors),
    ]
    start = None if q_nb is None else rotation.normalise(q_nb)
    return _file(head, kernels, configuration, body, vector, sensors, start, 0)


def _words(configuration: SensorConfiguration | None, sensors: int) -> list[str]:
    return [] if configuration is None else configuration.words(SENSORS[:sensors])


def _record_line(text: str, indent: int) -> str:
    head, value = text.split("] ")
    return f"{' ' * indent}r{head}] = {value}\n"


def _turn(chosen: OrientationEstimator, magnetometer: bool) -> str:
    if not (magnetometer and chosen.declination):
        return ""
    half = 0.5 * radians(chosen.declination)
    return (
        f"        if r[HEADED] != 0.0:  # from magnetic to true north\n"
        f"            c, s = {cos(half)!r}, {sin(half)!r}\n"
        "            w, x, y, z = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w\n"
    )


def _source(function: Kernel) -> str:
    """A specialized kernel as Python, in the functions that MicroPython has."""
    node = copy.deepcopy(function.node)
    if doc := ast.get_docstring(node):
        node.body[0] = ast.Expr(ast.Constant(doc.partition("\n")[0]))
    text = ast.unparse(ast.fix_missing_locations(node))
    return text.replace("np.", "math.").replace("math.hypot(", "hypot(") + "\n"


def _file(
    head: Sequence[str],
    kernels: Kernels,
    configuration: SensorConfiguration | None,
    body: str,
    vector: Vector,
    sensors: int,
    start: Array | None,
    lag: int,
) -> str:
    version = importlib.import_module("strapdown").__version__
    said = [
        *(text if text.endswith(".") else f"{text}." for text in head),
        f"Written by strapdown {version} from the kernels that it runs itself, for MicroPython and "
        "CPython; it needs math alone. Body forward-right-down, local level north-east-down, q_nb "
        "turns body into local level, Hamilton, scalar first. Test: run the file.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    functions = "\n\n".join(_source(f) for f in kernels.functions)
    constants = "".join(f"{c.name} = {c.value!r}\n" for c in kernels.constants())
    if "LARGEST" not in {c.name for c in kernels.constants()}:
        constants += "LARGEST = 1e150\n"
    if configuration is not None:
        constants += f"\nSTEP_S = {1.0 / configuration.rate_hz!r}\n"
    hypot = _HYPOT if "hypot(" in functions else ""
    rows = [[None if v > 1e29 else float(v) for v in row] for row in vector.samples]
    return "\n".join(
        [
            "\n".join(f"# {line}" for text in said for line in textwrap.wrap(text, WIDTH - 2)),
            "import math\n",
            constants,
            hypot + "\n" + functions,
            body,
            _TEST.format(
                samples=_tuples(rows),
                expected=_tuples(vector.double.tolist()),
                start="" if start is None else f"({', '.join(map(repr, start.tolist()))})",
                roundings=f"{vector.roundings:.4g}",
                take=_take(configuration is not None, sensors),
                lag=lag,
            ),
        ]
    )


def _tuples(rows: Sequence[Sequence[float | None]]) -> str:
    lines = (
        textwrap.wrap(f"({', '.join(map(repr, row))}),", WIDTH - 4, subsequent_indent=" ")
        for row in rows
    )
    return "\n".join(f"    {line}" for row in lines for line in row)


def _take(raw: bool, sensors: int) -> str:
    first = 0 if raw else 1
    dt = "" if raw else "v[0], "
    rest = "".join(
        f", None if v[{at}] is None else v[{at} : {at + 3}]"
        for at in range(first + 3, first + 3 * sensors, 3)
    )
    return f"a.{'sample' if raw else 'update'}({dt}v[{first} : {first + 3}]{rest})"


def _sample(configuration: SensorConfiguration, sensors: Sequence[str], field: str) -> str:
    text = _SAMPLE.format(accel=", accel=None" if len(sensors) > 1 else "", field=field)
    for name in sensors:
        channel = getattr(configuration, name)
        rows = channel.expressions(name, repr(float(channel.scale)), repr)
        values = ",\n            ".join(rows)
        given = "" if name == "gyro" else f" if {name} is not None else None"
        text += f"        {name} = (\n            {values},\n        ){given}\n"
    return f"{text}        return self.update(STEP_S, {', '.join(sensors)})\n"


# The Python code around the kernels.

_HYPOT = """
def hypot(x, y):
    return math.sqrt(x * x + y * y)

"""

_ANGLES = '''
    @property
    def roll_pitch_heading(self):
        """The attitude as 3-2-1 angles, deg; heading from 0 to 360."""
        roll, pitch, heading = euler_from_quat(*self.quaternion)
        return math.degrees(roll), math.degrees(pitch), math.degrees(heading) % 360.0 % 360.0
'''

_ALGORITHM = (
    '''
def usable(x, y, z):
    return abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST


class Attitude:
    """{title}. {words}."""

    def __init__(self, q_nb=(1.0, 0.0, 0.0, 0.0)):
        """Start from an attitude, a quaternion of any length but zero."""
        self.state = [0.0] * {size}
        w, x, y, z = quat_normalise(*q_nb)
        {begin}
{memory}
{update}
    @property
    def quaternion(self):
        """The attitude q_nb, a unit quaternion."""
{read}
'''
    + _ANGLES
)

_MEMORY = {
    "mean": "",
    "linear": "        self.rate = None\n",
    "cubic": "        self.rates, self.steps = [], [0.0, 0.0]\n",
}

_REFUSE = '''\
    def update(self, dt, gyro):
        """Take a sample: s since the last one that was taken, rad/s of the body.

        Returns True, or False for a sample that is refused; it then has changed nothing.
        """
'''
_UPDATES = {
    "mean": _REFUSE
    + """\
        if not (0.0 < dt < LARGEST and usable(*gyro)):
            return False
        theta = [{increment}(w, dt) for w in gyro]
        {step}
        return True
""",
    "linear": _REFUSE
    + """\
        if not (usable(*gyro) and (self.rate is None or 0.0 < dt < LARGEST)):
            return False
        if self.rate is not None:
            theta, dtheta = [], []
            for before, now in zip(self.rate, gyro):
                {both} = {increment}(before, now, dt)
                theta.append(t)
                {keep}
            {step}
        self.rate = tuple(gyro)
        return True
""",
    "cubic": _REFUSE
    + """\
        if not (usable(*gyro) and (not self.rates or 0.0 < dt < LARGEST)):
            return False
        if len(self.rates) > 1:
            self.take_step(dt, gyro)
        self.rates = self.rates[-2:] + [tuple(gyro)]
        self.steps = [self.steps[1], dt]
        return True

    def take_step(self, after, last):
        \"\"\"Take the step to the newest sample, which one follows after some s, or none: 0.\"\"\"
        dt = self.steps[1]
        p = neighbour(dt, self.steps[0]) if len(self.rates) > 2 else 0.0
        r = neighbour(dt, after) if after > 0.0 else 0.0
        theta, dtheta = [], []
        for i in range(3):
            a, b, c = self.rates[0][i], self.rates[-2][i], self.rates[-1][i]
            theta.append(dt * {increment}(a, b, c, last[i], p, r))
            dtheta.append((c - b) * dt)
        {step}

    def finish(self):
        \"\"\"Take the step to the last sample without one after it: at the end.\"\"\"
        if len(self.rates) > 1:
            self.take_step(0.0, self.rates[-1])
            self.rates = self.rates[-1:]
""",
}

_FILTER = (
    '''
NONE = (float("inf"),) * 3


class Attitude:
    """{title}."""

    def __init__(self, q_nb=None):
        """Start from an attitude, or from none: the first samples find it, moving or not."""
        r = self.record = [0.0] * {size}
        r[Q] = 1.0
{always}        if q_nb is not None:
            r[Q], r[Q + 1], r[Q + 2], r[Q + 3] = quat_normalise(*q_nb)
{then}
    def update(self, dt, gyro, accel=None{field}):
        """Take a sample: s since the last one that was taken, rad/s, m/s² and field of the body.

        None for a sensor that has no new sample. Returns True, or False for a sample that is
        refused; it then has changed nothing.
        """
        r = self.record
        if not (usable(*gyro) and (r[SAMPLES] == 0.0 or 0.0 < dt < LARGEST)):
            return False
        accel = NONE if accel is None else accel
{missing}        x, y, z = gyro
        {sample}(r, dt, x, y, z, accel[0], accel[1], accel[2]{fields})
        return True

    @property
    def quaternion(self):
        """The attitude q_nb, a unit quaternion."""
        r = self.record
        w, x, y, z = r[Q], r[Q + 1], r[Q + 2], r[Q + 3]
{turn}        return quat_normalise(w, x, y, z)
'''
    + _ANGLES
    + '''
    @property
    def gyro_bias(self):
        """The estimated gyro bias, rad/s: beyond the one that was subtracted."""
        return tuple(self.record[BIAS : BIAS + 3])
'''
)
_SD = '''
    @property
    def roll_pitch_heading_sd(self):
        """Standard deviations of these angles, deg."""
        r = self.record
        p, n = P, N
        dd = r[p + 2 * n + 2]{more}
        sd = euler_deviation(
            r[Q], r[Q + 1], r[Q + 2], r[Q + 3],
            r[p], r[p + 1], r[p + 2], r[p + n + 1], r[p + n + 2], dd,
        )
        return tuple(math.degrees(v) for v in sd)
'''

_SAMPLE = '''
    def sample(self, gyro{accel}{field}):
        """Take raw readings, x, y, z in unit and axes of the sensors, a step after those before."""
'''

_TEST = '''
SAMPLES_OF_TEST = (
{samples}
)
# q_nb after each, by the kernels of strapdown in double precision.
EXPECTED = (
{expected}
)


def test():
    """Whether this file gives on this machine what strapdown gives."""
    eps = 1.0
    while 1.0 + 0.5 * eps != 1.0:
        eps *= 0.5
    a, turns = Attitude({start}), []
    for v in SAMPLES_OF_TEST:
        {take}
        turns.append(a.quaternion)
    bound, passed, largest = {roundings} * eps, True, 0.0
    for q, e in zip(turns[{lag}:], EXPECTED):
        less = sum((x - y) ** 2 for x, y in zip(q, e))
        more = sum((x + y) ** 2 for x, y in zip(q, e))
        off = 2.0 * math.sqrt(min(less, more))
        passed = passed and off <= bound  # so written NaN fails, too
        largest = max(largest, off)
    words = "passed" if passed else "FAILED"
    print("largest difference %.3g rad, bound %.3g rad: %s" % (largest, bound, words))
    return passed


if __name__ == "__main__" and not test():
    raise SystemExit(1)
'''


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
    return _written(
        (algorithm_in_c, filter_in_c),
        chosen,
        (interpolation, sampling, magnetometer),
        q_nb,
        imu,
        configuration,
    )


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
    return _written(
        (algorithm_in_python, filter_in_python),
        chosen,
        (interpolation, sampling, magnetometer),
        q_nb,
        imu,
        configuration,
    )


def _written(
    writers: tuple[Callable[..., str], Callable[..., str]],
    chosen: AttitudeAlgorithm | OrientationEstimator,
    asked: tuple[str, str | None, bool | None],
    q_nb: ArrayLike | None,
    imu: pd.DataFrame | None,
    configuration: SensorConfiguration | None,
) -> str:
    """Write a file by the writer of algorithms, or that of filters.

    `asked`: interpolation, sampling, and whether there is a magnetometer.
    """
    of_algorithm, of_filter = writers
    if isinstance(chosen, AttitudeAlgorithm):
        return of_algorithm(
            chosen,
            kind=sampling_kind(*asked[:2], imu),
            q_nb=(1.0, 0.0, 0.0, 0.0) if q_nb is None else q_nb,
            imu=imu,
            configuration=configuration,
        )
    return of_filter(
        chosen, **_of_filter(chosen, *asked, imu), q_nb=q_nb, imu=imu, configuration=configuration
    )


def _of_filter(
    chosen: OrientationEstimator,
    interpolation: str,
    sampling: str | None,
    magnetometer: bool | None,
    imu: pd.DataFrame | None,
) -> dict[str, Any]:
    """Inputs of an exported filter, from arguments or from samples."""
    # Of the other sensors a sample may be missing.
    kind = sampling_kind(interpolation, sampling, None if imu is None else imu[GYRO])
    chosen.check_interpolation(interpolation)
    if magnetometer is None:
        magnetometer = imu is None or set(MAG) <= set(imu.columns)
    return {
        "magnetometer": magnetometer,
        "sampling": "mean" if kind == "mean" else "instantaneous",
    }


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
