"""Tests of the NHTSA database as crash records."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.nhtsa import read_nhtsa

HEADER = """\
----- EV5 -----
----- TEST -----
V5|a title|an aim|03/OCT/2017|MGA|DTNH|BT17|NCA|VTB|CON|DRY|22|OTH|OTH|36|0|0|0|3|none
----- INSTRUMENTATION -----
1|93|AC|NA|FLLR|XG|SEC|G'S|2800|M|D|800|21|36|-2|3|100|AM|P|LEFT REAR CROSSMEMBER
1|94|AC|02|HDCG|YL|SEC|FURLONG||M|D||21|36|-2|3|100|CF|R|NO DATA AFTER 67 MS
0|95|LC|NA|BARR|XG|SEC|NWT|2800|M|D|800|21|36|-2|3|100|AM|P|LOAD CELL
----- END -----
"""
CURVE = "".join(f"{1e-4 * k:.6f}\t{k + 0.5}\n" for k in range(-2, 4))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "v00042.EV5").write_text(HEADER)
    for number in (93, 94):
        (tmp_path / f"v00042.{number:03d}").write_text(CURVE)
    return tmp_path


def test_a_folder_and_its_header_are_one_test(folder):
    record = read_crash_record(folder)
    assert [c.name for c in record.channels] == ["93", "94"]
    same = read_crash_record(folder / "v00042.EV5")
    assert [c.name for c in same.channels] == ["93", "94"]
    assert read_nhtsa(folder).title == "a title"
    assert (record.format, record.title, record.facts["test"]) == ("nhtsa", "a title", "42")
    assert any("1 of 3 listed channels" in f.what for f in record.findings)


def test_the_folder_in_which_one_stands_has_its_name(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert read_crash_record(".").path.name == folder.name


def test_channels_say_what_the_header_says(folder):
    one, other = read_crash_record(folder).channels
    assert (one.quantity, one.axis, one.unit, one.place) == (
        "acceleration",
        "x",
        "g",
        "LEFT REAR CROSSMEMBER",
    )
    assert (one.bandwidth, one.low_pass) == (2800.0, "2800 Hz before the sampler")
    assert one.full_scale == pytest.approx(800 * 9.80665)
    time, values = one.load()
    np.testing.assert_allclose(time, np.arange(-2, 4) * 1e-4, atol=1e-15)
    np.testing.assert_allclose(values, (np.arange(-2, 4) + 0.5) * 9.80665, rtol=1e-15)
    assert (other.quantity, other.unit, other.body) == (
        "other",
        "FURLONG",
        "front passenger's head",
    )
    # A unit that is not known leaves the numbers as recorded.
    np.testing.assert_array_equal(other.load()[1], np.arange(-2, 4) + 0.5)
    assert "channel failed" in " ".join(other.remarks)
    assert (other.full_scale, other.bandwidth) == (None, None)


def test_a_folder_without_a_header_or_with_two(folder, tmp_path):
    (folder / "v2.EV5").write_text(HEADER)
    with pytest.raises(
        DataError,
        check=coded("io.folder-holds-headers", file="test_a_folder_without_a_header0", count=2),
    ):
        read_crash_record(folder)
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(DataError, match=r"no \.EV5 header"):
        read_nhtsa(empty)


def test_a_cut_channel_is_told_with_its_row(folder):
    (folder / "v00042.093").write_text(CURVE[:40])
    with pytest.raises(DataError) as error:
        triad_of_channels(read_crash_record(folder), {"x": "93"}, quantity="acceleration")
    assert (error.value.finding.file, error.value.finding.row) == ("v00042.093", 3)


def test_the_recorded_test(recordings):
    record = read_crash_record(recordings("crash_nhtsa_10146"))
    assert len(record.channels) == 26
    car = record.vehicles["1"]
    facts = {k: float(car[k]) for k in ("mass_kg", "length_m", "width_m")}
    assert facts == {"mass_kg": 1719.0, "length_m": 4.896, "width_m": 1.837}
    # 57.09 km/h, to the ten digits in which facts are written.
    assert float(car["speed_m_per_s"]) == pytest.approx(57.09 / 3.6, rel=1e-9)
    bodies = {c.body for c in record.channels}
    assert bodies == {"vehicle", "driver's head", "front passenger's head", "engine"}
    assert any("status as CF" in f.what for f in record.findings)
    # Delta-V of the four crossmember channels at 115 ms: 18.35 to 18.72 m/s, from each alone.
    for name in ("93", "94", "99", "100"):
        triad = triad_of_channels(record, {"x": name}, quantity="acceleration")
        part = triad.loc[0.0:0.115, "accel_x"]
        delta_v = np.trapezoid(part.to_numpy(), part.index.to_numpy())
        assert 18.3 < -delta_v < 18.8
