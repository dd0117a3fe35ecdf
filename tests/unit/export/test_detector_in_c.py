"""The crash detection as C, compiled and run beside the kernel from which it was made."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from tests.unit.export.test_algorithms_in_c import build, needs_compiler

from strapdown._kernels import crash_trigger as kernel
from strapdown.export.detector import STEP, crash_samples, export_detector, run_samples

ERRORS, VARIANCE = (0.01, 0.005, 0.002, 0.0175, 0.0175, 0.02), 1.05
# Prints the result of `crash_update`, of `crash_delta_v`, and its numbers, for each sample.
HARNESS = """
#include <stdio.h>
int main(void)
{
    struct crash c;
    double v[7];
    crash_init(&c);
    while (scanf("%la %la %la %la %la %la %la", v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6) == 7) {
        real_t sample[6], out[5];
        for (int i = 0; i < 6; i++) {
            sample[i] = R(v[i + 1]);
        }
        const int code = crash_update(&c, R(v[0]), sample);
        const int least = crash_delta_v(&c, out, out + 2);
        printf("%d %d", code, least);
        for (int i = 0; i < 5; i++) {
            printf(" %a", (double)out[i]);
        }
        printf("\\n");
    }
    return 0;
}
"""


def through_c(folder, rows, single, mean):
    precision = f"-DREAL={'float' if single else 'double'}"
    program = build(folder, export_detector(ERRORS, VARIANCE, mean=mean) + HARNESS, precision)
    given = "\n".join(" ".join(float(v).hex() for v in row) for row in rows)
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    codes = np.array([[int(v) for v in line[:2]] for line in lines])
    return codes, np.array([[float.fromhex(v) for v in line[2:]] for line in lines])


def long_drive(samples=3000):
    """A drive with irregular steps, in which the mean is learnt, crashes, gaps and clipping."""
    rng = np.random.default_rng(4)
    rows = np.zeros((samples, 7))
    rows[:, 0] = rng.choice([STEP / 8, STEP, 2 * STEP], samples)
    rows[:, 1:5] = rng.normal((0.4, -0.3, -9.8, 0.1), 0.5, (samples, 4))
    for begin in (900, 1600, 2300):
        u = np.sin(np.linspace(0.0, np.pi, 30))
        rows[begin : begin + 30, 1:3] += np.outer(u, rng.normal(0.0, 150.0, 2))
        rows[begin : begin + 30, 4] += 2.0 * u
    rows[910, 5] = rows[1610, 6] = 1.0
    # A gap that widens the bound, and one that interrupts.
    rows[1612, 0], rows[2320, 0] = 0.03125, 0.25
    return rows.astype(np.float32).astype(np.float64)


@needs_compiler
@pytest.mark.parametrize("mean", [False, True])
@pytest.mark.parametrize("single", [False, True])
def test_the_c_file_gives_the_bits_of_the_kernel(tmp_path, single, mean):
    rows = long_drive()
    codes, found = through_c(tmp_path, rows, single, mean)
    expected = run_samples(rows, np.array(ERRORS), VARIANCE, mean, single)
    np.testing.assert_array_equal(codes[:, 0], expected[:, 0])
    assert set(codes[:, 0]) >= {kernel.QUIET, kernel.TRIGGERED, kernel.ENDED}
    assert set(codes[:, 1]) == {0, 1, 2}
    # Yaw angles are below 0.5 rad: sine and cosine of the C library may differ by an ulp in a step.
    eps = np.finfo(np.float32 if single else np.float64).eps
    size = np.abs(expected[:, 1:]).max()
    np.testing.assert_allclose(found, expected[:, 1:], rtol=0.0, atol=100 * eps * size)


@needs_compiler
@pytest.mark.parametrize("mean", [False, True])
@pytest.mark.parametrize("real", ["float", "double"])
def test_its_own_test_passes_and_notices_a_wrong_threshold(tmp_path, real, mean):
    text = export_detector(ERRORS, VARIANCE, mean=mean)
    program = build(tmp_path, text, "-O0", f"-DREAL={real}", "-DCRASH_TEST")
    assert subprocess.run([program], capture_output=True, check=False).returncode == 0
    for right, wrong in (
        ("#define TRIGGER R(2.2222222222222223)", "#define TRIGGER R(6.0)"),
        ("#define MEMORY R(30.0)", "#define MEMORY R(1.01)"),
        ("state[MEAN + 1] * t", "state[MEAN] * t"),
    ):
        assert right in text
        flags = ("-O0", f"-DREAL={real}", "-DCRASH_TEST")
        program = build(tmp_path, text.replace(right, wrong), *flags)
        assert subprocess.run([program], capture_output=True, check=False).returncode == 1, wrong


@needs_compiler
def test_a_refused_sample_changes_nothing(tmp_path):
    rows = crash_samples()
    bad = np.repeat(rows, 4, axis=0)
    bad[1::4, 0], bad[2::4, 1], bad[3::4, 4] = 0.0, np.nan, np.inf
    codes, found = through_c(tmp_path, bad, single=True, mean=False)
    assert (codes.reshape(-1, 4, 2)[:, 1:, 0] == -1).all()
    plain, expected = through_c(tmp_path, rows, single=True, mean=False)
    np.testing.assert_array_equal(codes[::4], plain)
    np.testing.assert_array_equal(found[::4], expected)
