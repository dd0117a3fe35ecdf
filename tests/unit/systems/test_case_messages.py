"""What a case says of a remedy names keys of the case, and no argument of a function."""

from __future__ import annotations

import re
import tomllib
from importlib import resources

import pytest

from strapdown.errors import Finding

# What belongs to functions alone.
PYTHON = re.compile(
    r"preparation|moving_at_impact|steady_acceleration|Entry[.(S]|CrashUnit\(|levelling=|rest=\(|"
    r"sampling='|outside='|reconstruct_crash: in"
)


@pytest.mark.parametrize(
    ("finding", "key"),
    [
        (Finding("crash.record-starts-in-crash", begin=0.01, impact=0.0), "levelling_sd_deg = 1.5"),
        (Finding("crash.no-rest", begin=-0.3, impact=0.0), "rest_s = [start, end]"),
        (Finding("crash.no-stationary-stretch-quiet-without"), 'kind = "standstill"'),
        (Finding("crash.entry-speed-unknown-quiet"), 'kind = "speed"'),
        (Finding("crash.vertical-velocity-upward-vehicle-points"), "climb_sd_m_per_s"),
        (Finding("crash.stated-crash-began-ms-before", first=-0.0012), "time_s = -0.001 under"),
        (Finding("crash.no-event-perhaps-in-g"), 'unit = "g"'),
        (Finding("sensors.low-pass-at-ends"), 'sampling = "mean"'),
        (Finding("sensors.rates-beyond-vehicle"), 'unit = "deg/s"'),
        (Finding("sensors.roll-assumed"), "another unit: gyro_from"),
        (Finding("dsp.samples-not-evenly-spaced-usual"), "rate_hz"),
    ],
)
def test_remedies_name_keys(finding, key):
    assert key in finding.advice("file")
    assert key not in finding.advice("python")


@pytest.mark.parametrize("room", ["crash", "sensors"])
def test_a_remedy_with_arguments_has_another_for_the_case(room):
    text = resources.files("strapdown").joinpath("messages", f"{room}.toml").read_text("utf-8")
    for code, entry in tomllib.loads(text).items():
        # A value of a wrong type comes from a program and never from a case.
        if not code.endswith("-of-wrong-type"):
            assert not PYTHON.search(entry.get("remedy_file", entry.get("remedy", ""))), code


def test_the_factor_of_a_misfit_is_that_of_what_is_named():
    """A chi-square four times its degrees of freedom is a standard deviation twice too small."""
    finding = Finding("crash.fixes-fit-worse-than-their", variance_factor=4.0, sd_factor=2.0)
    assert "covariance is too small by up to a factor of 4" in finding.advice("python")
    assert "standard deviations are too small by a factor of up to 2" in finding.advice("file")
