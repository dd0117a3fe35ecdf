"""A step of a mechanization, a low-pass, or a measurement update as one C99 file with its test."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from strapdown import rotation
from strapdown._kernels import covariance, level
from strapdown.attitude_algorithms import with_options
from strapdown.dsp.decimation import FirDecimation, fir_decimation
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.export.cost import most_operations
from strapdown.export.device import device_translator, number
from strapdown.export.kernels import Kernels
from strapdown.export.program import StepParts, constant_lines, tested_rows, written
from strapdown.mechanization import Mechanization, NorthEastDown, WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.tables.checks import Array

# A step of a mechanization as C: motion increments to position, velocity and attitude.

#: Start of the test: latitude and longitude in rad, m; m/s; and the attitude.
PLACE, VELOCITY = (0.96875, 0.65625, 150.0), (20.0, -30.0, 0.5)
ATTITUDE = tuple(rotation.quaternion_from_euler([5.0, -10.0, 130.0]).tolist())


def navigation_parts(chosen: Mechanization) -> StepParts:
    """Parts of a mechanization; a wander azimuth has its own state, start and output."""
    wander, damped = isinstance(chosen, WanderAzimuth), chosen.height == "damped"
    options = chosen.kernel_options()
    # The kernels of a position in a wander azimuth are beside those of its corrections.
    kernels = Kernels(
        "level" if wander else "ned",
        fixed={"options[MODE]": float(options[0])},
        others=("wander", "motion_increments"),
    )
    advance = "wander_advance" if wander else "ned_advance"
    start = NavState.of_numbers(0.0, np.array([*PLACE, *VELOCITY, *ATTITUDE]))
    size = len(chosen.begin(start))
    sizes = {
        "increments": (1, 10),
        "reference": (int(damped),),
        "history": (1, chosen.row),
    }
    step = kernels.require(advance, keep=(1,), sizes=sizes)
    motion = kernels.require("linear_motion")
    if wander:
        kernels.require("wander_from_geodetic")
        kernels.require("wander_places", sizes={"history": (1, 12), "out": (1, 10)})
    ellipsoid = find_ellipsoid(chosen.ellipsoid)
    if wander:
        state_words = (
            "Quaternion level to Earth; height, m; velocity in level axes, m/s; quaternions body "
            "to level and body to inertial axes; rounding errors of sums; cosine and sine of half "
            "the Earth's angle; radius of the prime vertical; memory of the height's loop."
        )
        far = "LEAP (a step of more than 0.01 rad around the Earth)"
    else:
        state_words = (
            "Latitude, longitude, rad; height, m; velocity, m/s; quaternion body to level; sine "
            "and cosine of the latitude; radius of the prime vertical; memory of the height's loop."
        )
        far = "POLE (beyond the limit of the latitude)"
    before = [f"{n}_before[{i}]" for n in ("gyro",) for i in range(3)]
    now = [f"gyro[{i}]" for i in range(3)]
    forces = [f"{n}[{i}]" for n in ("accel_before", "accel") for i in range(3)]
    call = f"linear_motion({', '.join(['dt', *before, *now, *forces])})"
    rows = np.zeros((2, 10 + damped))
    # Long steps, in which the terms of higher order are seen.
    rows[:, 0] = 0.75, 0.125
    rows[1, 1:4], rows[1, 4:7], rows[1, 7:10] = 0.1, 1.0, 0.25
    rows[0, 6], rows[0, 9] = -7.25, -2.75
    if damped:
        rows[:, 10] = 150.0, 1.0
    earth = ellipsoid.parameters()

    def run(given: Array) -> Array:
        state = chosen.begin(start)
        history = np.empty((1, chosen.row))
        out, made = np.empty((len(given), 10)), 0
        for row in given:
            heights = row[10:].copy() if damped else np.empty(0)
            if not chosen.advance_rows(state, row[None, :10].copy(), heights, earth, history)[0]:
                continue
            if wander:
                level.wander_places(history, out[made : made + 1])
            else:
                out[made] = history[0]
            made += 1
        return out[:made]

    codes = {"DONE": 0, "POLE": 1, "DIVERGED": 2, "LEAP": 3}
    return StepParts(
        name="navigation",
        template="navigation.c.jinja",
        title=f"A step of navigation in {chosen.summary}: {chosen.source}",
        words=(
            "Axes: body forward-right-down; local level north-east-down. A step takes motion "
            "increments: the rotation vector of the body relative to inertial space, and the first "
            "and second integral of the specific force in the body axes of its start.",
            "The state needs double precision: a float holds a latitude to 0.4 m.",
        ),
        kernels=kernels,
        step=step,
        call="step",
        before=(motion, "increments"),
        memory=size,
        codes={k: v for k, v in codes.items() if k != ("POLE" if wander else "LEAP")},
        row_words="dt and nine increments" + (", and a height" if damped else ""),
        gives="latitude, longitude, height, velocity and quaternion",
        rows=rows,
        run=run,
        facts={
            "about": "Take a step of dt s with its motion increments"
            + (", and the reference height in m (NAN: none)" if damped else "")
            + f". Returns DONE; or {far}, DIVERGED (outside the limits of speed and height), or -1 "
            "for a dt that is not above zero, and then has changed nothing.",
            "wander": wander,
            "damped": damped,
            "held": chosen.height == "held",
            "state_words": state_words,
            "size": size,
            "squared": number(ellipsoid.eccentricity_squared),
            "motion": call,
            "earth": earth,
            "options": options,
            "width": chosen.row,
            "place": PLACE,
            "velocity": VELOCITY,
            "attitude": ATTITUDE,
        },
    )


@dataclass(frozen=True)
class LowPass:
    """The linear-phase low-pass and decimation of the prefilter `robust_fir`.

    `from_hz`, `rate` (Hz): of the samples, and of the outputs, which divides it. `passband`,
    `attenuation`: as `RobustFir`. `channels`: numbers of a sample. `means`: whether a sample is the
    mean over the step that ends with it.
    """

    from_hz: float = 1000.0
    rate: float = 100.0
    passband: float = 0.5
    attenuation: float = 80.0
    channels: int = 6
    means: bool = False

    def __post_init__(self) -> None:
        _check_range("from_hz", self.from_hz, 1e-3, 1e6)
        _check_range("rate", self.rate, 1e-3, 0.5 * self.from_hz)
        _check_range("channels", self.channels, 1, 64)
        factor = self.from_hz / self.rate
        if abs(factor - round(factor)) > 1e-9 * factor:
            raise ConfigError(
                "report.export-rate", quantity="rate", rate=self.rate, from_hz=self.from_hz
            )

    def design(self) -> FirDecimation:
        """Return the filter."""
        return fir_decimation(
            1.0 / self.from_hz,
            round(self.from_hz / self.rate),
            means=self.means,
            passband=self.passband,
            attenuation=self.attenuation,
        )


@dataclass(frozen=True)
class Update:
    """A measurement update: `states` of the filter, scalar `observations` of an epoch."""

    states: int = 15
    observations: int = 3

    def __post_init__(self) -> None:
        _check_range("states", self.states, 1, 64)
        _check_range("observations", self.observations, 1, 64)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ConfigError(
            "report.export-range", quantity=name, name=name, value=value, low=low, high=high
        )


@dataclass(frozen=True)
class ExportedFile:
    """An exported file, and what it costs.

    `operations`: most of what is called for a sample, by kind (`cost.most_operations`). `memory`:
    numbers that are kept between calls.
    """

    name: str
    text: str
    operations: dict[str, int]
    memory: int


def step_in_c(text: str) -> ExportedFile:
    """Write a file from a name of `STEPS` with options: ``ned:height=damped``.

    ConfigError: an option or its value is unknown.
    """
    chosen, parts = step_parts(text)
    name = text.strip().lower().partition(":")[0]
    translator = device_translator()
    functions = parts.kernels.in_c(translator)
    operations, calls = most_operations(parts.step), [parts.call]
    if parts.before is not None:
        motion, call = parts.before
        operations = dict(Counter(operations) + Counter(most_operations(motion)))
        calls = [call, *calls]
    version = importlib.import_module("strapdown").__version__
    counts = ", ".join(f"{count} {kind}" for kind, count in operations.items() if count)
    options = ", ".join(f"{f.name}={_value(getattr(chosen, f.name))}" for f in fields(chosen))
    upper = parts.name.upper()
    head = [
        f"{parts.title}.",
        f"{name}: {options}. Written by strapdown {version} from the kernels that it runs itself.",
        *parts.words,
        f"Operations of {' and '.join(f'{parts.name}_{call}' for call in calls)}, at most: "
        f"{counts}. Memory: {parts.memory} numbers between calls, no heap.",
        "Double precision; -DREAL=float for single. With -ffp-contract=off it gives the bits of "
        f"strapdown in double precision. Test: cc -std=c99 -O2 -D{upper}_TEST FILE.c -lm && "
        f"./a.out. With -D{upper}_FILTER it reads lines of {parts.row_words} and "
        f"writes {parts.gives}.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    used = {c.name for c in parts.kernels.constants()}
    results = "".join(f"#define {n} {v}\n" for n, v in parts.codes.items() if n not in used)
    file = written(
        parts.template,
        **parts.facts,
        **tested_rows(parts),
        name=parts.name,
        head=head,
        precision="double",
        types=translator.names.text,
        constants=constant_lines(parts.kernels) + results,
        functions="\n".join(functions),
        row_words=parts.row_words,
        answers=parts.answers,
        lag=0,
        unit="",
    )
    return ExportedFile(text, file, operations, parts.memory)


def _value(value: object) -> str:
    """Text of an option, as it can be given."""
    return "/".join(map(str, value)) if isinstance(value, tuple) else str(value).lower()


def step_parts(text: str) -> tuple[Any, StepParts]:
    """Return a module with its options, and the parts of its file."""
    name, _, rest = text.strip().lower().partition(":")
    kind, parts_of, _ = STEPS[name]
    chosen = with_options(kind, name, rest)
    return chosen, parts_of(chosen)


# Low-pass.


def _low_pass(chosen: LowPass) -> StepParts:
    """Parts of a low-pass."""
    design, channels = chosen.design(), chosen.channels
    count = len(design.weights)
    kernels = Kernels("signals")
    step = kernels.require(
        "fir_decimate",
        {"first": (0, 0), "factor": (design.factor, design.factor)},
        sizes={"values": (count, channels), "weights": (count,), "out": (1, channels)},
    )
    return StepParts(
        name="prefilter",
        template="low_pass.c.jinja",
        title=f"Low-pass and decimation from {chosen.from_hz:.10g} to {chosen.rate:.10g} Hz: "
        "windowed sinc, Kaiser (1974)",
        words=(
            f"Gain 1 up to {design.design.passband:.6g} Hz and 0 from {design.design.stopband:.6g} "
            f"Hz on, to {chosen.attenuation:.6g} dB; linear phase. Outliers are not replaced.",
        ),
        kernels=kernels,
        step=step,
        call="sample",
        memory=2 * count * channels + 2,
        row_words="a number for each channel",
        gives="an output where there is one",
        answers=False,
        rows=np.array([np.zeros(channels), np.full(channels, 2.0)]),
        run=lambda given: design.advance(design.begin(channels), given)[1],
        facts={
            "weights": design.weights,
            "factor": design.factor,
            "delay": design.delay,
            "wait": design.centre - design.half + int(design.means) + count,
        },
    )


# Measurement updates.


def _update(chosen: Update, weighted: bool) -> StepParts:
    """Parts of a measurement update in U-D form, or in W-D form."""
    n, m = chosen.states, chosen.observations
    kernels = Kernels("covariance")
    kernel = "wd_epoch" if weighted else "ud_update"
    arrays = {"ud": (n, n), "x": (n,), "z": (m,), "H": (m, n), "R": (m,)}
    arrays |= {"told": (2, m), "out": (n, n)}
    names = kernels.source(kernel).parameters
    step = kernels.require(
        kernel,
        {"predicted": (False, False)} if weighted else {},
        sizes={name: shape for name, shape in arrays.items() if name in names},
    )
    rows = np.zeros((2, 2 * m + m * n))
    rows[1, :m], rows[0, m : 2 * m], rows[1, m : 2 * m], rows[1, 2 * m :] = 2.0, 0.5, 0.5, 2.0

    def run(given: Array) -> Array:
        ud, x, told, unused = np.eye(n), np.zeros(n), np.empty((2, m)), np.empty((n, n))
        out = np.empty((len(given), 3 * n))
        for k, row in enumerate(given):
            z, r, h = (part.copy() for part in np.split(row, [m, 2 * m]))
            if weighted:
                after = np.empty((n, n))
                covariance.wd_epoch(
                    ud, unused, unused, False, x, z, h.reshape(m, n), r, told, after
                )
                ud = after
            else:
                covariance.ud_update(ud, x, z, h.reshape(m, n), r, told)
            out[k] = [*x, *np.diagonal(ud), *ud[0]]
        return out

    return StepParts(
        name="covariance",
        template="update.c.jinja",
        title=f"Measurement update of {n} states by {m} observations in "
        + (
            "W-D form: Chernodarov (2009), Eqs. (9)-(15)"
            if weighted
            else "U-D form: Bierman (1977), Section V.3"
        ),
        words=(
            "Units are those of the states and observations. On the stack: "
            + (f"{n * n + (n + 4) * (n + m)}" if weighted else f"{4 * n}")
            + " numbers.",
        ),
        kernels=kernels,
        step=step,
        call="update",
        memory=n * n + n,
        row_words="observations, their variances, and the rows of H",
        gives="the estimate, D and the first row of U",
        rows=rows,
        run=run,
        facts={
            "n": n,
            "m": m,
            "weighted": weighted,
            "about": "Take the scalar observations z of an epoch one after the other: rows of H, "
            "and variances r of errors that are independent of each other. Fills innovations, each "
            "after those before it, and their variances h P h' + r. Returns -1; or the index of an "
            "observation that is not finite or has a negative variance"
            + (", or -2 - i for a variance of state i" if weighted else "")
            + ": the structure is then undefined.",
        },
    )


#: By name: what has the options, what makes the parts of a file, and what that is.
STEPS: dict[str, tuple[type[Any], Callable[[Any], StepParts], str]] = {
    "ned": (NorthEastDown, navigation_parts, "step of navigation in north-east-down"),
    "wander_azimuth": (WanderAzimuth, navigation_parts, "step of navigation in a wander azimuth"),
    "low_pass": (LowPass, _low_pass, "linear-phase low-pass and decimation, as of robust_fir"),
    "ud": (Update, lambda of: _update(of, weighted=False), "measurement update in U-D form"),
    "wd": (Update, lambda of: _update(of, weighted=True), "measurement update in W-D form"),
}
