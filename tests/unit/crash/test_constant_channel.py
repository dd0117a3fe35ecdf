"""A channel of a crash record that never changes is said, and may be left out."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.formats import csv
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels

NAMES = ["time [s]", *(f"a{a} [m/s2]" for a in "xyz")]


@pytest.fixture
def record(tmp_path):
    def write(noise=0.3, dead=True):
        rng = np.random.default_rng(4)
        t = np.arange(0.0, 1.0, 1e-3)
        pulse = -200.0 * np.exp(-(((t - 0.5) / 0.03) ** 2))
        values = np.column_stack([pulse, 0.3 * pulse, 0.0 * t - 9.8])
        values += noise * rng.normal(size=values.shape)
        if dead:
            values[:, 0] = 0.0
        path = tmp_path / "record.csv"
        csv.write(path, dict(zip(NAMES, np.column_stack([t, values]).T, strict=True)), {})
        return read_crash_record(path)

    return write


def said(record, axes="xyz"):
    channels = {a: f"a{a} [m/s2]" for a in axes}
    table = triad_of_channels(record, channels, quantity="acceleration")
    return [f for f in table.attrs["findings"] if f.code == "io.crash-channel-constant"]


def test_a_channel_that_never_changes_is_said(record):
    (found,) = said(record())
    assert found.severity == "warning"
    assert (found.data["axis"], found.data["count"]) == ("x", 1000)
    assert said(record(), "yz") == []
    assert said(record(dead=False)) == []
    assert said(record(noise=0.0)) == []
