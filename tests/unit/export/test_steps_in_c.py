"""Mechanizations, low-pass and measurement updates as C, compiled and run beside the kernels."""

from __future__ import annotations

import ast
import functools
import math
import re
import shutil
import subprocess
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from tests.coded import coded
from tests.unit.export.test_algorithms_in_c import WARNINGS, build, needs_compiler, run

from strapdown._kernels import arithmetic
from strapdown.attitude_algorithms import ALGORITHMS, make_algorithm
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.export import export_c, steps
from strapdown.export.attitude import export_attitude
from strapdown.export.cost import most_operations
from strapdown.export.program import ROWS, drawn_rows
from strapdown.export.sources import Constant
from strapdown.export.steps import ATTITUDE, PLACE, STEPS, VELOCITY
from strapdown.nav_state import NavState

VARIANTS = [
    "ned",
    "ned:height=held",
    "ned:height=damped,height_time_constant=10,ellipsoid=pz90.11",
    "wander_azimuth",
    "wander_azimuth:height=held",
    "wander_azimuth:height=damped",
    "low_pass",
    "low_pass:from_hz=400,rate=50,channels=3,means=yes",
    "ud",
    "ud:states=4,observations=1",
    "wd",
    "wd:states=17,observations=6",
]


step_in_c, step_parts = functools.cache(steps.step_in_c), functools.cache(steps.step_parts)


def drawn(parts, count=300):
    """Rows of numbers about those of the file's own test."""
    rng = np.random.default_rng(11)
    return parts.rows[0] + parts.rows[1] * rng.uniform(-1.0, 1.0, (count, parts.rows.shape[1]))


def through_c(folder, variant, rows, *flags):
    made, (_, parts) = step_in_c(variant), step_parts(variant)
    program = build(folder, made.text, f"-D{parts.name.upper()}_FILTER", *flags)
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in rows)
    return np.array([line.split() for line in run(program, given).splitlines()], dtype=float)


def test_the_variants_cover_the_table():
    assert {v.partition(":")[0] for v in VARIANTS} == set(STEPS)


@needs_compiler
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_gives_the_bits_of_the_kernels(tmp_path, variant):
    """Sine, arctangent and exponential are those of the platform on both sides."""
    parts = step_parts(variant)[1]
    rows = drawn(parts)
    found, expected = through_c(tmp_path, variant, rows), parts.run(rows)
    np.testing.assert_array_equal(found, expected)
    assert len(found) >= 7
    # Of all results only a held height and its velocity stay what they are.
    assert (np.ptp(found, axis=0) == 0.0).sum() == ("held" in variant) * 2


@needs_compiler
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_its_own_test_passes(tmp_path, variant, real):
    text = step_in_c(variant).text
    assert max(map(len, text.splitlines())) <= 100
    name = step_parts(variant)[1].name.upper()
    out = run(build(tmp_path, text, "-O0", f"-DREAL={real}", f"-D{name}_TEST"))
    assert out.rstrip().endswith("passed")


@needs_compiler
@pytest.mark.parametrize(
    ("variant", "right", "wrong"),
    [
        ("ned", "#define TWELFTH R(0.08333", "#define TWELFTH R(0.08433"),
        ("ned", "real_t zd = half * od;", "real_t zd = half * on;"),
        ("ned:height=damped", "part * part * part /", "part * part /"),
        ("ned:height=held", "s[5] = R(0.0); /*", "s[5] = v_n[2]; /*"),
        ("wander_azimuth", "#define TWO_THIRDS R(0.66666", "#define TWO_THIRDS R(0.66766"),
        ("wander_azimuth", "real_t zz = half * oz;", "real_t zz = half * ox;"),
        ("low_pass", "p->wait = FACTOR;", "p->wait = FACTOR - 1;"),
        ("low_pass", "% WEIGHTS;", "% (WEIGHTS - 1);"),
        ("ud", "total += v[k] * old;", "total += v[k] * ud[i][k];"),
        ("ud", "before / after", "after / before"),
        ("wd", "FMA(-factor, f[k]", "FMA(factor, f[k]"),
        ("wd", "d[at] = slope * r;", "d[at] = slope * s;"),
    ],
)
def test_its_own_test_can_fail(tmp_path, variant, right, wrong):
    text, name = step_in_c(variant).text, step_parts(variant)[1].name.upper()
    assert text.count(right) == 1
    program = build(tmp_path, text.replace(right, wrong), "-O0", f"-D{name}_TEST")
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "FAILED" in done.stdout


@needs_compiler
@pytest.mark.parametrize("variant", ["ned", "wander_azimuth:height=damped"])
def test_a_step_that_is_refused_changes_nothing(tmp_path, variant):
    rows = drawn(step_parts(variant)[1], 12)
    bad = np.repeat(rows[:1], 5, axis=0)
    bad[:3, 0] = 0.0, -0.01, np.nan
    bad[3, 4] = 1e5  # faster than the limit
    bad[4, 9] = np.nan
    mixed = through_c(tmp_path, variant, np.vstack([rows[:6], bad, rows[6:]]), "-O0")
    np.testing.assert_array_equal(mixed, through_c(tmp_path, variant, rows, "-O0"))


@needs_compiler
@pytest.mark.parametrize("variant", ["ud", "wd"])
def test_an_invalid_observation_is_refused(tmp_path, variant):
    """The program writes no result for a row with a negative variance, or one that is no number."""
    rows = drawn(step_parts(variant)[1], 2)
    for column, value in ((4, -1.0), (1, np.nan), (10, np.inf)):
        bad = rows.copy()
        bad[1, column] = value
        assert len(through_c(tmp_path, variant, bad, "-O0")) == 1
    program = build(tmp_path, step_in_c(variant).text, "-O0", "-DCOVARIANCE_FILTER")
    given = "\n".join(" ".join(map(repr, row)) for row in bad.tolist())
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=False)
    assert done.stderr == "refused\n"


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler: install g++")
@pytest.mark.parametrize("variant", ["ned:height=damped", "wander_azimuth", "low_pass", "wd"])
def test_it_is_cplusplus_too(tmp_path, variant):
    name = step_parts(variant)[1].name.upper()
    (tmp_path / "step.cpp").write_text(step_in_c(variant).text, encoding="utf-8")
    flags = [f for f in WARNINGS if f not in ("-std=c99", "-Wmissing-prototypes")]
    command = ["g++", "-std=c++11", *flags, f"-D{name}_TEST", "step.cpp", "-o", "step"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "step").endswith("passed\n")


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_head_states_what_it_costs(variant):
    made = step_in_c(variant)
    code = re.split(r"#ifdef \w+_TEST", made.text)[0]
    assert re.findall(r"#include <(\S+)>", code) == ["math.h"]
    assert "malloc" not in made.text
    head = " ".join(made.text.partition("*/")[0].replace("\n *", " ").split())
    listed = ", ".join(f"{n} {kind}" for kind, n in made.operations.items() if n)
    assert f"at most: {listed}. Memory: {made.memory} numbers" in head
    if ":" not in variant:
        assert made == steps.step_in_c(variant)


def test_what_a_mode_of_the_height_does_not_need_is_left_out():
    free, damped = (step_in_c(f"ned:height={h}").text for h in ("free", "damped"))
    assert "guide_height" in damped and "EXP(" in damped
    assert "guide_height" not in free and "EXP(" not in free and "real_t height" not in free


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_run_takes_more_operations(variant):
    """The functions of the file run on counting numbers; the update takes its longest way."""
    parts = step_parts(variant)[1]
    count: Counter[str] = Counter()

    def counted(value):
        return arithmetic.Counted(float(value), count)

    def fused(a, b, c):
        count.update(multiply=1, add=1)
        return counted(float(a) * float(b) + float(c))

    math_of_kernels = SimpleNamespace(
        **arithmetic.COUNTED_MATH,
        hypot=arithmetic.counting("sqrt", math.hypot),
        exp=arithmetic.counting("trig", math.exp),
        isnan=math.isnan,
        isfinite=math.isfinite,
        nan=math.nan,
        inf=math.inf,
    )

    class Arrays:
        empty = staticmethod(lambda shape: np.empty(shape, dtype=object))
        zeros = staticmethod(lambda shape: array(np.zeros(shape)))

    def array(values):
        values = np.asarray(values, dtype=float)
        return np.array([counted(v) for v in values.ravel()], dtype=object).reshape(values.shape)

    held = parts.kernels.namespace.items()
    names = {name: one.value for name, one in held if isinstance(one, Constant)}
    names |= {"math": math_of_kernels, "np": Arrays, "fma": fused}
    for function in parts.kernels.functions:
        exec(compile(ast.Module([function.node], []), "counted", "exec"), names)

    rows = drawn(parts, 4)
    given = _arguments(variant, parts, rows, array)
    names[parts.step.name](*given)
    most = most_operations(parts.step)
    assert all(count[kind] <= most[kind] for kind in most)
    if parts.name != "navigation":
        assert {kind: count[kind] for kind in most} == most
    else:
        # A small rotation takes the series: nothing else has two ways.
        assert count["divide"] >= most["divide"] - 2 and count["add"] >= most["add"] - 15


def _arguments(variant, parts, rows, array):
    """What the kernel of a step is given, by the names of its parameters."""
    chosen = step_parts(variant)[0]
    if parts.name == "navigation":
        state = chosen.begin(NavState.of_numbers(0.0, np.array([*PLACE, *VELOCITY, *ATTITUDE])))
        held = {
            "state": state,
            "increments": rows[:1, :10],
            "reference": rows[0, 10:],
            "earth": find_ellipsoid(chosen.ellipsoid).parameters(),
            "options": chosen.kernel_options(),
            "history": np.zeros((1, chosen.row)),
        }
    elif parts.name == "prefilter":
        weights = chosen.design().weights
        shape = (len(weights), chosen.channels)
        held = {"values": np.ones(shape), "weights": weights, "out": np.zeros((1, chosen.channels))}
    else:
        n, m = chosen.states, chosen.observations
        z, r, h = np.split(rows[0], [m, 2 * m])
        ud = np.eye(n) + np.triu(np.full((n, n), 0.1), 1)
        held = {"ud": ud, "x": np.ones(n), "z": z, "H": h.reshape(m, n), "R": r}
        held |= {"told": np.zeros((2, m)), "out": np.zeros((n, n))}
    return [array(held[name]) for name in parts.step.parameters]


@pytest.mark.parametrize("name", [*ALGORITHMS, "dcm:order=3", "dcm:order=8", "quaternion:order=3"])
def test_no_step_of_an_algorithm_takes_more(name):
    algorithm = make_algorithm(name)
    made, cost = export_attitude(algorithm, export_c), count_cost(algorithm)
    assert made.text == export_c(algorithm)
    assert all(getattr(cost, kind) <= most for kind, most in made.operations.items())
    if name in ("naive", "rk4") or name.startswith("dcm:"):  # without another way
        assert all(getattr(cost, kind) == most for kind, most in made.operations.items())


@pytest.mark.parametrize("given", ["ned:height_limits=-100/2000", *STEPS])
def test_options_in_the_head_are_those_that_can_be_given(given):
    made, name = step_in_c(given), given.partition(":")[0]
    head = " ".join(made.text.partition("*/")[0].replace("\n *", " ").split())
    stated = re.search(rf"{name}: (.+?)\. Written by", head)[1]
    again = steps.step_in_c(f"{name}:{stated.replace(', ', ',')}")
    assert again.text == made.text


def test_what_is_not_possible_is_named():
    for text, code in (
        ("wd:states=99", "report.export-range"),
        ("low_pass:rate=300", "report.export-rate"),
        ("ned:height=high", "mechanization.nothing-height-can"),
        ("ud:state=3", "attitude.no-option"),
        ("ned:height_limits=1", "mechanization.no-two-heights"),
        ("ned:height_limits=low/high", "attitude.option-not-number"),
    ):
        with pytest.raises(ConfigError, check=coded(code)):
            step_in_c(text)


def test_the_rows_of_the_test_are_those_of_the_file():
    """The first by hand, from the seed that the C has."""
    rows = drawn_rows(np.array([[1.0, 0.0], [2.0, 1.0]]), ROWS)
    first = (1664525 + 1013904223) % 2**32
    second = (first * 1664525 + 1013904223) % 2**32
    assert rows[0].tolist() == [1.0 + 2.0 * (first / 2**32 - 0.5), second / 2**32 - 0.5]
    assert np.abs(rows[:, 0] - 1.0).max() <= 1.0
