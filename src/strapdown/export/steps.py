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
from strapdown.export.device import comment, device_translator, number, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.program import (
    Harness,
    StepParts,
    constant_lines,
    listed,
    precision_lines,
    step_test,
)
from strapdown.mechanization import Mechanization, NorthEastDown, WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.tables.checks import Array

# A step of a mechanization as C: motion increments to position, velocity and attitude.

#: Start of the test: latitude and longitude in rad, m; m/s; and the attitude.
PLACE, VELOCITY = (0.96875, 0.65625, 150.0), (20.0, -30.0, 0.5)
ATTITUDE = tuple(rotation.quaternion_from_euler([5.0, -10.0, 130.0]).tolist())

_NAVIGATION = """\
struct navigation {{
{state}
    real_t state[{size}];
}};

/* Start: latitude and longitude in rad, height over the ellipsoid in m; velocity north, east, down
 * in m/s; unit quaternion body to north-east-down.
 */
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4]);

/* Motion increments between two samples, rates in rad/s and specific forces in m/s² at their
 * instants and linear between: rotation vector in rad, and the first and second integral of the
 * specific force in the body axes of the start, m/s and m.
 */
void navigation_increments(real_t dt, const real_t gyro_before[3], const real_t accel_before[3],
    const real_t gyro[3], const real_t accel[3], real_t increments[9]);

{about}
int navigation_step(struct navigation *n, real_t dt, const real_t increments[9]{argument});

/* Position, velocity and attitude, as of navigation_init{wrap}. */
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4]);
"""

_NAVIGATION_CODE = """\
{init}
void navigation_increments(real_t dt, const real_t gyro_before[3], const real_t accel_before[3],
    const real_t gyro[3], const real_t accel[3], real_t increments[9])
{{
{increments}
}}

int navigation_step(struct navigation *n, real_t dt, const real_t increments[9]{argument})
{{
    /* Semi-major axis in m, square of the eccentricity, gravity at the equator in m/s²,
     * Somigliana's constant, rate of rotation in rad/s, flattening, centrifugal over gravity.
     */
    static const real_t earth[7] = {{
        {earth}}};
    /* Mode of the height and time constant of its loop in s, decrease of gravity with height in
     * 1/s²; limits: cosine of the latitude, speed in m/s, heights in m.
     */
    static const real_t options[7] = {{
        {options}}};
    real_t row[1][10], history[1][{width}];
    if (!(dt > R(0.0) && dt < LARGEST)) {{
        return -1;
    }}
    row[0][0] = dt;
    for (int i = 0; i < 9; i++) {{
        row[0][1 + i] = increments[i];
    }}
    return {advance}(n->state, row{reference}, earth, options, history);
}}

{read}"""

_NED_INIT = """\
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4])
{{
    real_t *s = n->state;
    const real_t sine = SIN(place[0]);
    for (int i = 0; i < 3; i++) {{
        s[i] = place[i];
        s[3 + i] = v_n[i];
    }}
{held}    for (int i = 0; i < 4; i++) {{
        s[6 + i] = q_nb[i];
    }}
    s[10] = sine;
    s[11] = COS(place[0]);
    s[12] = R(1.0) / SQRT(R(1.0) - {squared} * sine * sine);
    s[13] = R(0.0);
    s[14] = R(0.0);
}}
"""

_NED_READ = """\
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4])
{
    for (int i = 0; i < 3; i++) {
        place[i] = n->state[i];
        v_n[i] = n->state[3 + i];
    }
    for (int i = 0; i < 4; i++) {
        q_nb[i] = n->state[6 + i];
    }
}
"""

_WANDER_INIT = """\
void navigation_init(struct navigation *n, const real_t place[3], const real_t v_n[3],
    const real_t q_nb[4])
{{
    real_t *s = n->state;
    const real_t sine = SIN(place[0]);
    for (int i = 0; i < {size}; i++) {{
        s[i] = R(0.0);
    }}
    const real4 ew = wander_from_geodetic(place[0], place[1], R(0.0));
    s[0] = ew.f0; s[1] = ew.f1; s[2] = ew.f2; s[3] = ew.f3;
    s[4] = place[2];
    const real7 level = level_from_north(R(0.0), v_n[0], v_n[1], {down}, q_nb[0], q_nb[1],
        q_nb[2], q_nb[3]);
    s[5] = level.f0; s[6] = level.f1; s[7] = level.f2;
    s[8] = level.f3; s[9] = level.f4; s[10] = level.f5; s[11] = level.f6;
    const real4 ib = quat_multiply(s[0], s[1], s[2], s[3], s[8], s[9], s[10], s[11]);
    s[12] = ib.f0; s[13] = ib.f1; s[14] = ib.f2; s[15] = ib.f3;
    s[24] = R(1.0);
    s[28] = R(1.0) / SQRT(R(1.0) - {squared} * (sine * sine));
}}
"""

_WANDER_READ = """\
void navigation_read(const struct navigation *n, real_t place[3], real_t v_n[3], real_t q_nb[4])
{
    real_t row[1][12], out[1][10];
    for (int i = 0; i < 12; i++) {
        row[0][i] = n->state[i];
    }
    wander_places(row, out);
    for (int i = 0; i < 3; i++) {
        place[i] = out[0][i];
        v_n[i] = out[0][3 + i];
    }
    for (int i = 0; i < 4; i++) {
        q_nb[i] = out[0][6 + i];
    }
}
"""

_NAVIGATION_START = """\
    static const real_t place[3] = {{{place}}};
    static const real_t v_n[3] = {{{velocity}}};
    static const real_t q_nb[4] = {{
        {attitude}}};
    navigation_init(s, place, v_n, q_nb);"""

_NAVIGATION_TAKE = """\
    real_t increments[9], place[3], v_n[3], q_nb[4];
    for (int i = 0; i < 9; i++) {{
        increments[i] = R(v[1 + i]);
    }}
    if (navigation_step(s, R(v[0]), increments{argument}) != DONE) {{
        return 0;
    }}
    navigation_read(s, place, v_n, q_nb);
    for (int i = 0; i < 3; i++) {{
        out[i] = (double)place[i];
        out[3 + i] = (double)v_n[i];
    }}
    for (int i = 0; i < 4; i++) {{
        out[6 + i] = (double)q_nb[i];
    }}
    return RESULTS;"""


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
    squared = number(ellipsoid.eccentricity_squared)
    held = chosen.height == "held"
    if wander:
        init = _WANDER_INIT.format(size=size, squared=squared, down="R(0.0)" if held else "v_n[2]")
        state = (
            "Quaternion level to Earth; height, m; velocity in level axes, m/s; quaternions body "
            "to level and body to inertial axes; rounding errors of sums; cosine and sine of half "
            "the Earth's angle; radius of the prime vertical; memory of the height's loop."
        )
    else:
        init = _NED_INIT.format(
            squared=squared, held="    s[5] = R(0.0); /* the height is held */\n" if held else ""
        )
        state = (
            "Latitude, longitude, rad; height, m; velocity, m/s; quaternion body to level; sine "
            "and cosine of the latitude; radius of the prime vertical; memory of the height's loop."
        )
    argument, reference = (", real_t height", ", &height") if damped else ("", "")
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
    far = "LEAP (a step of more than 0.01 rad around the Earth)"
    pole = "POLE (beyond the limit of the latitude)"
    return StepParts(
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
        interface=_NAVIGATION.format(
            state="\n".join(comment(state, "    ")),
            size=size,
            about="\n".join(
                comment(
                    "Take a step of dt s with its motion increments"
                    + (", and the reference height in m (NAN: none)" if damped else "")
                    + f". Returns DONE; or {far if wander else pole}, DIVERGED (outside the limits "
                    "of speed and height), or -1 for a dt that is not above zero, and then has "
                    "changed nothing."
                )
            ),
            argument=argument,
            wrap="; the longitude is within half a turn" if wander else "",
        ),
        code=_NAVIGATION_CODE.format(
            init=init,
            increments=unpacked(call, [f"increments[{i}]" for i in range(9)]),
            argument=argument,
            earth=listed(earth),
            options=listed(options),
            width=chosen.row,
            advance=advance,
            reference=reference,
            read=_WANDER_READ if wander else _NED_READ,
        ),
        harness=Harness(
            "navigation",
            rows.shape[1],
            10,
            "dt and nine increments" + (", and a height" if damped else ""),
            _NAVIGATION_START.format(
                place=listed(PLACE), velocity=listed(VELOCITY), attitude=listed(ATTITUDE)
            ),
            _NAVIGATION_TAKE.format(argument=", R(v[10])" if damped else ""),
            answers=True,
        ),
        gives="latitude, longitude, height, velocity and quaternion",
        rows=rows,
        run=run,
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
    body = "\n".join([*functions, parts.code])
    test = step_test(parts)
    version = importlib.import_module("strapdown").__version__
    counts = ", ".join(f"{count} {kind}" for kind, count in operations.items() if count)
    options = ", ".join(f"{f.name}={_value(getattr(chosen, f.name))}" for f in fields(chosen))
    name_c = parts.harness.name
    upper = name_c.upper()
    head = [
        f"{parts.title}.",
        f"{name}: {options}. Written by strapdown {version} from the kernels that it runs itself.",
        *parts.words,
        f"Operations of {' and '.join(f'{name_c}_{call}' for call in calls)}, at most: {counts}. "
        f"Memory: {parts.memory} numbers between calls, no heap.",
        "Double precision; -DREAL=float for single. With -ffp-contract=off it gives the bits of "
        f"strapdown in double precision. Test: cc -std=c99 -O2 -D{upper}_TEST FILE.c -lm && "
        f"./a.out. With -D{upper}_FILTER it reads lines of {parts.harness.words} and "
        f"writes {parts.gives}.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    used = {c.name for c in parts.kernels.constants()}
    results = "".join(f"#define {n} {v}\n" for n, v in parts.codes.items() if n not in used)
    lines = [
        "\n".join(comment("\n\n".join(head))) + "\n",
        precision_lines(body + test, translator.names.text, "double"),
        constant_lines(parts.kernels) + results,
        parts.interface,
        body,
        test,
    ]
    return ExportedFile(text, "\n".join(lines), operations, parts.memory)


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

_LOW_PASS = """\
#define CHANNELS {channels}
#define WEIGHTS {weights}
#define FACTOR {factor} /* samples of an output */

struct prefilter {{
    real_t line[2 * WEIGHTS][CHANNELS]; /* the last samples, twice, so that they are in a row */
    int at, wait;
}};

/* Before the first sample. */
void prefilter_init(struct prefilter *p);

/* Take a sample, all channels at once. Returns 1 where it completes an output, which belongs
 * {delay:.6g} s before it; 0 otherwise, and `out` is then as it was.
 */
int prefilter_sample(struct prefilter *p, const real_t sample[CHANNELS], real_t out[CHANNELS]);
"""

_LOW_PASS_CODE = """\
void prefilter_init(struct prefilter *p)
{{
    for (int i = 0; i < 2 * WEIGHTS; i++) {{
        for (int c = 0; c < CHANNELS; c++) {{
            p->line[i][c] = R(0.0);
        }}
    }}
    p->at = 0;
    p->wait = {wait};
}}

int prefilter_sample(struct prefilter *p, const real_t sample[CHANNELS], real_t out[CHANNELS])
{{
    /* Oldest sample first. */
    static const real_t weights[WEIGHTS] = {{
        {values}}};
    real_t row[1][CHANNELS];
    for (int c = 0; c < CHANNELS; c++) {{
        p->line[p->at][c] = sample[c];
        p->line[p->at + WEIGHTS][c] = sample[c];
    }}
    p->at = (p->at + 1) % WEIGHTS;
    p->wait--;
    if (p->wait > 0) {{
        return 0;
    }}
    p->wait = FACTOR;
    fir_decimate(p->line + p->at, weights, row);
    for (int c = 0; c < CHANNELS; c++) {{
        out[c] = row[0][c];
    }}
    return 1;
}}
"""

_LOW_PASS_TAKE = """\
    real_t sample[CHANNELS], filtered[CHANNELS];
    for (int c = 0; c < CHANNELS; c++) {
        sample[c] = R(v[c]);
    }
    if (!prefilter_sample(s, sample, filtered)) {
        return 0;
    }
    for (int c = 0; c < CHANNELS; c++) {
        out[c] = (double)filtered[c];
    }
    return RESULTS;"""


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
    wait = design.centre - design.half + int(design.means) + count
    rows = np.array([np.zeros(channels), np.full(channels, 2.0)])
    return StepParts(
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
        codes={},
        interface=_LOW_PASS.format(
            channels=channels, weights=count, factor=design.factor, delay=design.delay
        ),
        code=_LOW_PASS_CODE.format(wait=wait, values=listed(design.weights)),
        harness=Harness(
            "prefilter",
            channels,
            channels,
            "a number for each channel",
            "    prefilter_init(s);",
            _LOW_PASS_TAKE,
        ),
        gives="an output where there is one",
        rows=rows,
        run=lambda given: design.advance(design.begin(channels), given)[1],
    )


# Measurement updates.

_UPDATE = """\
#define STATES {n}
#define OBSERVATIONS {m}

struct covariance {{
    real_t ud[STATES][STATES]; /* P = U D U': U above the diagonal, D on it, zeros below */
    real_t x[STATES];          /* estimate */
}};

{about}
int covariance_update(struct covariance *c, const real_t z[OBSERVATIONS],
    real_t H[OBSERVATIONS][STATES], const real_t r[OBSERVATIONS], real_t nu[OBSERVATIONS],
    real_t s[OBSERVATIONS]);
"""

_UPDATE_CODE = """\
int covariance_update(struct covariance *c, const real_t z[OBSERVATIONS],
    real_t H[OBSERVATIONS][STATES], const real_t r[OBSERVATIONS], real_t nu[OBSERVATIONS],
    real_t s[OBSERVATIONS])
{{
    real_t told[2][OBSERVATIONS];
{call}
    for (int j = 0; j < OBSERVATIONS; j++) {{
        nu[j] = told[0][j];
        s[j] = told[1][j];
    }}
    return bad;
}}
"""

_UD_CALL = "    const int bad = ud_update(c->ud, c->x, z, H, r, told);"
_WD_CALL = """\
    real_t after[STATES][STATES];
    const int bad = wd_epoch(c->ud, c->x, z, H, r, told, after);
    for (int i = 0; i < STATES && bad == -1; i++) {
        for (int j = 0; j < STATES; j++) {
            c->ud[i][j] = after[i][j];
        }
    }"""

_UPDATE_START = """\
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) {
            s->ud[i][j] = i == j ? R(1.0) : R(0.0);
        }
        s->x[i] = R(0.0);
    }"""

_UPDATE_TAKE = """\
    real_t z[OBSERVATIONS], H[OBSERVATIONS][STATES], r[OBSERVATIONS];
    real_t nu[OBSERVATIONS], variance[OBSERVATIONS];
    for (int j = 0; j < OBSERVATIONS; j++) {
        z[j] = R(v[j]);
        r[j] = R(v[OBSERVATIONS + j]);
        for (int i = 0; i < STATES; i++) {
            H[j][i] = R(v[2 * OBSERVATIONS + STATES * j + i]);
        }
    }
    if (covariance_update(s, z, H, r, nu, variance) != -1) {
        return 0;
    }
    for (int i = 0; i < STATES; i++) {
        out[i] = (double)s->x[i];
        out[STATES + i] = (double)s->ud[i][i];
        out[2 * STATES + i] = (double)s->ud[0][i];
    }
    return RESULTS;"""


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
        codes={},
        interface=_UPDATE.format(
            n=n,
            m=m,
            about="\n".join(
                comment(
                    "Take the scalar observations z of an epoch one after the other: rows of H, "
                    "and variances r of errors that are independent of each other. Fills "
                    "innovations, each after those before it, and their variances h P h' + r. "
                    "Returns -1; or the index of an observation that is not finite or has a "
                    "negative variance"
                    + (", or -2 - i for a variance of state i" if weighted else "")
                    + ": the structure is then undefined."
                )
            ),
        ),
        code=_UPDATE_CODE.format(call=_WD_CALL if weighted else _UD_CALL),
        harness=Harness(
            "covariance",
            rows.shape[1],
            3 * n,
            "observations, their variances, and the rows of H",
            _UPDATE_START,
            _UPDATE_TAKE,
            answers=True,
        ),
        gives="the estimate, D and the first row of U",
        rows=rows,
        run=run,
    )


#: By name: what has the options, what makes the parts of a file, and what that is.
STEPS: dict[str, tuple[type[Any], Callable[[Any], StepParts], str]] = {
    "ned": (NorthEastDown, navigation_parts, "step of navigation in north-east-down"),
    "wander_azimuth": (WanderAzimuth, navigation_parts, "step of navigation in a wander azimuth"),
    "low_pass": (LowPass, _low_pass, "linear-phase low-pass and decimation, as of robust_fir"),
    "ud": (Update, lambda of: _update(of, weighted=False), "measurement update in U-D form"),
    "wd": (Update, lambda of: _update(of, weighted=True), "measurement update in W-D form"),
}
