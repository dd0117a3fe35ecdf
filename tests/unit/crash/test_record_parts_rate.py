"""Rates that a line above a table states."""

from __future__ import annotations

import pytest

from strapdown.crash.record_parts import stated_rate


@pytest.mark.parametrize(
    ("lines", "rate"),
    [
        (("CrashBox 2, sampling rate 1000 Hz", "range 100 g"), 1000.0),
        (("Abtastrate: 2,5 kHz",), 2500.0),
        (("500 samples/s",), 500.0),
        # A filter's limit is no rate; a thousands' separator may be a decimal one.
        (("low-pass 300 Hz",), None),
        (("rate 1,000 Hz",), None),
        # Two that contradict each other leave the question.
        (("accelerometer 1000 Hz", "gyro 200 Hz"), None),
        ((), None),
    ],
)
def test_the_rate_is_taken_where_one_line_states_it(lines, rate):
    found = stated_rate(lines)
    assert (found and found[0]) == rate
