"""Clocks that recorders write: times of day, and milliseconds since 1970."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.formats.arrays import day_nanoseconds
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels

PREAMBLE = (
    "Messprotokoll\nLogger: KD-500\nDatum: 12.03.2024\nKanaele: 3\nAbtastrate: 500 Hz\n"
    "Messbereich: 50\n\n"
)


def written(folder, text, name="log.txt"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_a_table_under_lines_that_look_like_rows(tmp_path):
    """'Kanaele: 3' is two fields, one of them a number: as a row of a table would be."""
    rows = "".join(f"13:05:58.{k * 2:03d}\t{k}.5\t0.1\t1.0\n" for k in range(10))
    record = read_crash_record(written(tmp_path, f"{PREAMBLE}Zeit\tx [g]\ty [g]\tz [g]\n{rows}"))
    time, values = record.channel("x [g]").load()
    # 13:05:58 is the second 47158 of its day; steps of 2 ms.
    assert np.allclose(time, 47158.0 + 0.002 * np.arange(10), atol=1e-9)
    assert values[1] == pytest.approx(1.5 * 9.80665)
    assert "Abtastrate: 500 Hz" in record.remarks


def test_midnight_is_passed():
    ticks = day_nanoseconds(np.array(["23:59:59.999", "0:00:00.001"], dtype=object))
    assert np.diff(ticks) == 2_000_000


@pytest.mark.parametrize("text", ["24:00:00", "12:61:00", "noon", None])
def test_what_is_no_time_of_day(text):
    assert day_nanoseconds(np.array(["12:00:00", text], dtype=object)) is None


def test_two_records_of_one_clock_keep_one_time(tmp_path):
    """One that begins 0.1 s after the other must not be moved by that."""
    first = 1_710_248_758_200
    times = []
    for name, start in (("a.csv", first), ("b.csv", first + 100)):
        rows = "".join(f"{start + 2 * k},{k},0,0\n" for k in range(10))
        record = read_crash_record(written(tmp_path, f"t_ms,ax,ay,az\n{rows}", name))
        times.append(record.channel("ax").load()[0])
    assert np.allclose(times[1] - times[0], 0.1, atol=1e-9)
    # 1710248758.2 s is 47158.2 s after a midnight (UTC).
    assert times[0][0] == pytest.approx(47158.2, abs=1e-6)


@pytest.mark.parametrize(
    "heading", ["v [km/h]", "Geschwindigkeitsänderung [km/h]", "Delta-V [km/h]"]
)
def test_no_interval_of_a_table_of_velocity_is_lost(tmp_path, heading):
    """A table of changes that leaves out its row of zeros keeps what came before its first row."""
    gained = [-1.0, -4.0, -12.0, -20.0, -25.0, -26.0]
    rows = "".join(f"{10 * (k + 1)},{v}\n" for k, v in enumerate(gained))
    record = read_crash_record(written(tmp_path, f"Time [ms],{heading}\n{rows}", "edr.csv"))
    table = triad_of_channels(record, {"x": heading}, quantity="acceleration")
    total = float(table["accel_x"].sum() * 0.01)
    assert total == pytest.approx(-26.0 / 3.6, rel=1e-12)


def test_a_speed_is_no_change(tmp_path):
    """What is large from the first is a speed: what it was at first is taken off."""
    rows = "".join(f"{10 * (k + 1)},{v}\n" for k, v in enumerate([50.0, 48.0, 40.0, 30.0, 25.0]))
    record = read_crash_record(written(tmp_path, f"Time [ms],v [km/h]\n{rows}", "v.csv"))
    table = triad_of_channels(record, {"x": "v [km/h]"}, quantity="acceleration")
    assert float(table["accel_x"].sum() * 0.01) == pytest.approx(-25.0 / 3.6, rel=1e-12)
