"""Every writer of crash records against its reader: the same numbers, bit for bit, and words."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.crash_json import write_crash_json
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_table import write_crash_csv
from strapdown.formats.crash_writers import write_mme

KEPT = ("quantity", "axis", "unit", "sampling", "place", "body", "vehicle", "point",
        "low_pass", "full_scale")  # fmt: skip


def _csv(folder, record):
    paths = write_crash_csv(folder / "a.csv", record)
    read = [c for p in paths for c in read_crash_record(p).channels]
    return {c.name: c for c in read}


def _json(folder, record):
    write_crash_json(folder / "a.json", record)
    return {c.name: c for c in read_crash_record(folder / "a.json").channels}


def _mme(folder, record):
    codes = write_mme(folder / "mme", record)
    read = read_crash_record(folder / "mme")
    assert read.findings == ()
    return {name: read.channel(code) for name, code in codes.items()}


WRITERS = {"csv": _csv, "json": _json, "mme": _mme}


def channel(name, quantity, axis, time, values, **more):
    return CrashChannel(name, quantity, axis, more.pop("unit"), lambda: (time, values), **more)


@pytest.fixture
def record():
    # Numbers with all their digits, the smallest and the largest, minus zero, and one missing.
    values = np.random.default_rng(5).normal(size=400) * 10.0 ** np.arange(-200, 200)
    values[:5] = [0.1 + 0.2, -0.0, 5e-324, math.pi * 1e300, np.nan]
    even = np.arange(400) / 1000.0 - 0.05
    uneven = np.cumsum(np.random.default_rng(6).uniform(1e-4, 2e-3, 400))
    decimal = np.array([float(f"{1e-4 * k:.4f}") for k in range(-100, 300)])
    channels = (
        channel("ax, \"high\" [1]", "acceleration", "x", even, values, unit="m/s2",
                sampling="mean", place="left sill", vehicle="2", point="DSLF", low_pass="CFC 180",
                full_scale=1961.33),
        channel("-ay", "acceleration", "-y", even, -values, unit="m/s2", sampling="instantaneous",
                place="left sill", bandwidth=1650.0, low_pass="1650 Hz before the sampler"),
        channel("ω", "rate", "z", uneven, values, unit="rad/s", body="driver's head",
                vehicle="1"),
        channel("11HEAD0000H3ACXA", "acceleration", "x", decimal, values, unit="m/s2",
                sampling="instantaneous", place="head", body="front left occupant's head",
                low_pass="CFC 1000"),
        channel("dv", "velocity", "x", decimal, values + 1.0, unit="m/s", remarks=("a: b", "c")),
        channel("F", "force", "", uneven, values, unit="N", body="barrier"),
        channel("counts", "other", "", uneven, values, unit="LSB"),
    )  # fmt: skip
    facts = {"mass_kg": "1719", "speed_m_per_s": "15.5", "test": "7"}
    return CrashRecord(Path("a record"), "csv", "A title", facts, channels, ())


@pytest.mark.parametrize("writer", WRITERS)
def test_every_writer_gives_back_what_it_was_given(writer, record, tmp_path):
    read = WRITERS[writer](tmp_path, record)
    assert set(read) >= {c.name for c in record.channels}
    for one in record.channels:
        other = read[one.name]
        for mine, back in zip(one.load(), other.load(), strict=True):
            np.testing.assert_array_equal(mine.view(np.int64)[~np.isnan(mine)],
                                          back.view(np.int64)[~np.isnan(back)])  # fmt: skip
            np.testing.assert_array_equal(np.isnan(mine), np.isnan(back))
        for key in KEPT:
            if (key, writer) == ("sampling", "mme") and one.sampling is None:
                # Samples of a laboratory are taken at their stamps, where nothing else is said.
                continue
            if (key, writer) in (("place", "mme"), ("point", "mme")) and not getattr(one, key):
                # Every code of ISO MME has a position.
                continue
            assert (getattr(other, key) or None) == (getattr(one, key) or None), (one.name, key)
        assert set(one.remarks) <= set(other.remarks)


@pytest.mark.parametrize("writer", WRITERS)
def test_two_writings_are_the_same_bytes(writer, record, tmp_path):
    files = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        WRITERS[writer](tmp_path / name, record)
        inside = sorted(p for p in (tmp_path / name).rglob("*") if p.is_file())
        files.append([(p.relative_to(tmp_path / name), p.read_bytes()) for p in inside])
    assert files[0] == files[1]


def test_mme_says_no_date(record, tmp_path):
    write_mme(tmp_path, record, name="../../evil name")
    (head,) = tmp_path.glob("*.mme")
    assert head.name == "evil_name.mme"
    text = head.read_text()
    for key in ("Timestamp", "Date of the test"):
        (line,) = [x for x in text.splitlines() if x.startswith(key)]
        assert line.endswith(":NOVALUE")


@pytest.mark.parametrize("write", [write_crash_json, write_mme])
def test_infinite_values_are_refused(write, tmp_path):
    time = np.arange(3.0)
    one = channel("a", "acceleration", "x", time, np.array([0.0, np.inf, 1.0]), unit="m/s2")
    with pytest.raises(DataError, check=coded("io.not-finite-number")) as error:
        write(tmp_path / "out", CrashRecord(Path("a"), "csv", "", {}, (one,), ()))
    assert error.value.finding.row == 2


@pytest.mark.parametrize("write", [write_crash_csv, write_mme])
def test_a_record_without_channels_is_refused(write, tmp_path):
    with pytest.raises(DataError, match="channel"):
        write(tmp_path / "out", CrashRecord(Path("a"), "csv", "", {}, (), ()))


@pytest.mark.parametrize("writer", WRITERS)
def test_a_recorded_crash_goes_through_every_format(writer, recordings, tmp_path):
    test = read_crash_record(recordings("crash_nhtsa_10146"))
    read = WRITERS[writer](tmp_path, test)
    for one in test.channels:
        other = read[one.name]
        for mine, back in zip(one.load(), other.load(), strict=True):
            np.testing.assert_array_equal(mine, back)
        assert (other.axis, other.body, other.low_pass) == (one.axis, one.body, one.low_pass)


def test_positions_of_one_word_stay_points_of_their_own_in_mme(tmp_path):
    time = np.arange(4.0)
    channels = tuple(
        channel(f"{place} {axis}", "acceleration", axis, time, time, unit="m/s2", place=place)
        for place, axes in (("front rail", "xy"), ("rear rail", "z"))
        for axis in axes
    )
    read = _mme(tmp_path, CrashRecord(Path("a"), "csv", "", {}, channels, ()))
    front, same, rear = (read[c.name].point for c in channels)
    assert front == same != rear
