"""Files that are written from kernels: their templates, precision, constants and test."""

from __future__ import annotations

import ast
import copy
import importlib
import itertools
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from strapdown.constants import Array
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.device import comment, device_translator, number, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.sources import Kernel
from strapdown.export.types_of_c import WIDTH, wrapped

if TYPE_CHECKING:
    from jinja2 import Environment

# Math functions with a macro for each precision.
MACROS = (
    *("SQRT", "SIN", "COS", "ATAN2", "HYPOT", "FABS", "FMOD", "FMAX", "FMIN", "COPYSIGN"),
    *("EXP", "FMA", "TAN", "EXPM1", "LOG", "ASIN", "ACOS", "RINT", "CBRT"),
)


def precision_lines(body: str, types: Sequence[str] = (), default: str = "float") -> str:
    """Type of a number and the functions of the math library in use, for each precision.

    `types`: definitions of what functions return. `default`: precision without ``-DREAL``.
    """
    used = [m for m in MACROS if re.search(rf"\b{m}\(", body)]
    pi = re.search(r"\bPI\b", body)
    return written("precision.c.jinja", used=used, types=types, pi=pi, default=default)


def constant_lines(kernels: Kernels) -> str:
    """Definitions of the constants in use; a comment on several is above the first."""
    lines: list[str] = []
    before = ""
    for constant in kernels.constants():
        if constant.name == "LARGEST":
            continue  # that of the precision
        if constant.comment and constant.comment != before:
            lines += comment(constant.comment)
        before = constant.comment
        lines.append(f"#define {constant.name} {number(constant.value)}")
    return "\n".join([*lines, ""]) if lines else ""


# Test vector: a short record and its attitudes in double and single precision.


SAMPLES = 48
# Rounding of a step that may differ between compilers (fused products, their own sine): a
# product of quaternions is four sums of four products, 4 roundings of half an eps each, and so
# 2 eps a component, 4 eps in the vector of four, 8 eps as an angle; the same again for the
# quaternion of the increment; and both runs may have them.
ROUNDINGS = 32


@dataclass(frozen=True)
class Vector:
    """A test vector.

    `samples` ((n, 4)): dt in s and the rates in rad/s, or of a configured sensor ((n, 3)) raw
    readings, each exactly representable in single precision. `double`, `single` ((n, 4)): attitude
    at each sample from the kernels in either precision. `condition`: factor by which the algorithm
    magnifies an error near its singularity.
    """

    samples: Array
    double: Array
    single: Array
    condition: float

    @property
    def roundings(self) -> float:
        """Largest difference between two correct implementations, in eps of the precision."""
        return len(self.samples) * ROUNDINGS * self.condition


# The file, from its template.


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("strapdown.export", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals |= {
        f.__name__: f
        for f in (braced, cells, listed, number, numbers, precision_lines, tuples, unpacked)
    }
    made.globals["literal"] = repr
    made.filters |= {
        "brief": lambda value: f"{value:.4g}".replace("e+0", "e"),
        "comment": lambda text, indent=0: "\n".join(comment(text, " " * indent)),
        "number": number,
        "wrapped": lambda text, indent: "\n".join(wrapped(text, " " * indent)),
    }
    return made


def written(template: str, **facts: Any) -> str:
    """Return a file of `templates`, filled with facts."""
    return _environment().get_template(template).render(facts)


def c_file(template: str, head: Sequence[str], kernels: Kernels, facts: dict[str, Any]) -> str:
    """Write an algorithm or a filter as one C99 file.

    `facts`: among them its test `vector`, what a row of the test consists of, and why its bound is
    what it is.
    """
    translator, vector = device_translator(), facts["vector"]
    return written(
        f"{template}.c.jinja",
        **facts,
        head=head,
        functions="\n".join(kernels.in_c(translator)),
        types=translator.names.text,
        constants=constant_lines(kernels),
        name="attitude",
        columns=vector.samples.shape[1],
        results=4,
        answers=False,
        roundings=vector.roundings,
        unit=" rad",
    )


def python_file(template: str, head: Sequence[str], kernels: Kernels, facts: dict[str, Any]) -> str:
    """Write an algorithm or a filter as one Python file: the kernels, specialized, and a class."""
    version = importlib.import_module("strapdown").__version__
    configuration: SensorConfiguration | None = facts["configuration"]
    said = [*head, *([] if configuration is None else configuration.words([*facts["sensors"]]))]
    said = [
        *(text if text.endswith(".") else f"{text}." for text in said),
        f"Written by strapdown {version} from the kernels that it runs itself, for MicroPython and "
        "CPython; it needs math alone. Body forward-right-down, local level north-east-down, q_nb "
        "turns body into local level, Hamilton, scalar first. Test: run the file.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    return written(
        f"{template}.py.jinja",
        **facts,
        head=[f"# {line}" for text in said for line in textwrap.wrap(text, WIDTH - 2)],
        constants={c.name: c.value for c in kernels.constants()},
        functions="\n\n".join(_source(f) for f in kernels.functions),
        samples=[[None if v > 1e29 else float(v) for v in row] for row in facts["vector"].samples],
    )


def _source(function: Kernel) -> str:
    """A specialized kernel as Python, in the functions that MicroPython has."""
    node = copy.deepcopy(function.node)
    if doc := ast.get_docstring(node):
        node.body[0] = ast.Expr(ast.Constant(doc.partition("\n")[0]))
    text = ast.unparse(ast.fix_missing_locations(node))
    return text.replace("np.", "math.").replace("math.hypot(", "hypot(") + "\n"


def cells(of: str, count: int) -> list[str]:
    """The first elements of an array."""
    return [f"{of}[{i}]" for i in range(count)]


# A step that is none of an attitude.

#: Rows of the test, whose numbers follow from a seed.
ROWS = 64


@dataclass(frozen=True)
class StepParts:
    """Parts of a file.

    `name`: of its structure. `step`: the kernel of a call, `call` that of the file. `before`: the
    kernel and the call that make what it takes, for each sample. `codes`: results by name.
    `row_words`, `gives`: what a row of the test consists of, and its results. `answers`: whether
    each row has results, unless it is refused. `rows` (two): middle and range of the numbers of a
    row. `run`: results of rows by the kernels, as far as there are any. `facts`: what else the
    template takes.
    """

    name: str
    template: str
    title: str
    words: Sequence[str]
    kernels: Kernels
    step: Kernel
    call: str
    memory: int
    row_words: str
    gives: str
    rows: Array
    run: Callable[[Array], Array]
    facts: dict[str, Any]
    codes: dict[str, int] = field(default_factory=dict)
    before: tuple[Kernel, str] | None = None
    answers: bool = True


def drawn_rows(rows: Array, count: int) -> Array:
    """Rows of the test: a middle, and a range times a number of -1/2 to 1/2 that a seed gives."""
    middle, span = rows
    seed, out = 1, np.empty((count, len(middle)))
    for k in range(count):
        for j in range(len(middle)):
            seed = (seed * 1664525 + 1013904223) & 0xFFFFFFFF
            out[k, j] = middle[j] + span[j] * (seed / 4294967296.0 - 0.5)
    return out


def listed(values: Sequence[float] | Array, indent: str = " " * 8) -> str:
    """Literals of numbers, wrapped."""
    text = ", ".join(number(float(v)) for v in values)
    return "\n".join(wrapped(text, indent)).strip().replace("\n    " + indent, "\n" + indent)


def tested_rows(parts: StepParts) -> dict[str, Any]:
    """Facts of the test: rows that follow from a seed, and the results of the last one."""
    count = ROWS
    found = parts.run(drawn_rows(parts.rows, count))
    while len(found) < 4:  # a low-pass waits for its first output
        count *= 2
        found = parts.run(drawn_rows(parts.rows, count))
    return {
        "count": count,
        "rows": parts.rows,
        "columns": parts.rows.shape[1],
        "results": found.shape[1],
        "expected": found[-1],
        "largest": [float(f"{max(v, 1e-3):.2g}") for v in np.abs(found).max(axis=0)],
        "bound": f"{count} rows of {ROUNDINGS} roundings that another compiler or another sine may "
        "make otherwise, relative to the largest of each result",
        "roundings": float(count * ROUNDINGS),
    }


def numbers(values: Sequence[float] | Array) -> str:
    """Decimals of numbers, wrapped."""
    text = ", ".join(repr(float(v)) for v in values)
    return "\n".join(wrapped(text, "    ")).strip().replace("\n        ", "\n    ")


def braced(values: Array) -> str:
    """Rows of numbers in braces, as C reads them."""
    # The shortest decimals that are read as the same double: C++11 has no hexadecimal ones.
    rows = (f"{{{', '.join(repr(float(v)) for v in row)}}}," for row in values)
    lines = (
        textwrap.wrap(row, WIDTH, initial_indent="    ", subsequent_indent="        ")
        for row in rows
    )
    return "\n".join(itertools.chain.from_iterable(lines))


def tuples(rows: Sequence[Sequence[float | None]]) -> str:
    """Rows of numbers as tuples, as Python reads them."""
    lines = (
        textwrap.wrap(f"({', '.join(map(repr, row))}),", WIDTH - 4, subsequent_indent=" ")
        for row in rows
    )
    return "\n".join(f"    {line}" for row in lines for line in row)
