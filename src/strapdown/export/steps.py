"""A step of a mechanization, a low-pass, or a measurement update as one C99 file with its test."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from strapdown._kernels import covariance
from strapdown.attitude_algorithms import with_options
from strapdown.dsp.decimation import FirDecimation, fir_decimation
from strapdown.errors import ConfigError
from strapdown.export.cost import most_operations
from strapdown.export.device import comment, device_translator
from strapdown.export.kernels import Kernels
from strapdown.export.navigation import navigation_parts
from strapdown.export.program import (
    Harness,
    StepParts,
    constant_lines,
    listed,
    precision_lines,
    step_test,
)
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.tables.checks import Array


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
