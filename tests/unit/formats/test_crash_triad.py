"""A triad out of the channels of a record: units, axes, stamps, and what contradicts them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.record_parts import table_parts
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels

G = 9.80665


@pytest.fixture
def read(tmp_path):
    def write(text):
        path = tmp_path / "log.csv"
        path.write_text(text, encoding="utf-8")
        return read_crash_record(path)

    return write


def table(head, count=40, rate=1000.0, step=1.0):
    """A table of rest: x and y still, z of gravity in g."""
    rows = [f"{step * k / rate:.6g},0.01,-0.02,-1.0" for k in range(count)]
    return head + "\n" + "\n".join(rows) + "\n"


def test_a_triad_in_g_with_a_minus(read):
    record = read(table("t [s],ax [g],ay [g],az [g]"))
    triad = triad_of_channels(
        record, {"x": "ax [g]", "y": "-ay [g]", "z": "az [g]"}, quantity="acceleration"
    )
    assert list(triad.columns) == ["accel_x", "accel_y", "accel_z"]
    np.testing.assert_allclose(triad.to_numpy()[0], [0.01 * G, 0.02 * G, -G], rtol=1e-15)
    assert triad.index.name == "time"
    assert (triad.attrs["sampling"], triad.attrs["source"]) == ("instantaneous", "log.csv")
    told = " ".join(f.what for f in triad.attrs["findings"])
    assert "the axis y, and -y is used" in told


def test_missing_axes_are_left_out(read):
    record = read(table("t [s],a,ay [g],c"))
    triad = triad_of_channels(record, {"y": "ay [g]"}, quantity="acceleration")
    assert list(triad.columns) == ["accel_y"]


def test_a_name_that_begins_with_a_minus_is_itself(read):
    record = read(table("t [s],-a,b,c"))
    triad = triad_of_channels(record, {"x": "-a"}, quantity="acceleration", unit="g")
    assert triad["accel_x"].iloc[0] == pytest.approx(0.01 * G)
    triad = triad_of_channels(record, {"x": "--a"}, quantity="acceleration", unit="g")
    assert triad["accel_x"].iloc[0] == pytest.approx(-0.01 * G)


def test_the_unit_of_the_case_where_the_file_has_none(read):
    record = read(table("t [s],p,q,r"))
    triad = triad_of_channels(record, {"x": "p", "z": "r"}, quantity="rate", unit="deg/s")
    np.testing.assert_allclose(triad.to_numpy()[0], np.radians([0.01, -1.0]), rtol=1e-15)


def test_a_unit_against_that_of_the_file_is_refused(read):
    record = read(table("t [s],ax [g],ay [g],az [g]"))
    with pytest.raises(
        ConfigError,
        match="unit = 'm/s2' is stated",
        check=lambda refused: refused.finding.code == "io.unit-stated-record-says",
    ):
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", unit="m/s2")
    # The same in another spelling is no contradiction.
    triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", unit="G's")


def test_a_unit_of_another_quantity_is_refused(read):
    record = read(table("t [s],ax [g],ay [g],az [g]"))
    with pytest.raises(DataError, check=coded("io.channel-of-unstated-quantity")):
        triad_of_channels(record, {"x": "ax [g]"}, quantity="rate")
    with pytest.raises(
        ConfigError, check=coded("io.crash-unit-of-other-quantity", quantity="unit")
    ):
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", unit="deg/s")


def test_rest_tells_the_unit_of_three_axes(read):
    # 2000 samples at rest: the norm is 1.0, which is gravity in g and in nothing else.
    record = read(table("t [s],ax,ay,az", count=2000))
    axes = {"x": "ax", "y": "ay", "z": "az"}
    triad = triad_of_channels(record, axes, quantity="acceleration")
    assert triad["accel_z"].iloc[0] == pytest.approx(-G)
    assert any("inferred: g" in f.what for f in triad.attrs["findings"])


@pytest.mark.parametrize("axes", [{"x": "ax"}, {"x": "ax", "y": "ay"}])
def test_one_or_two_axes_tell_no_unit(read, axes):
    record = read(table("t [s],ax,ay,az", count=2000))
    with pytest.raises(DataError, check=coded("io.crash-unit-not-stated")) as error:
        triad_of_channels(record, axes, quantity="acceleration")
    assert 'write unit = "g" (the largest value' in error.value.finding.remedy


def test_one_axis_says_the_unit_of_all(read):
    record = read(table("t [s],ax [g],ay,az"))
    triad = triad_of_channels(
        record, {"x": "ax [g]", "y": "ay", "z": "az"}, quantity="acceleration"
    )
    assert triad["accel_z"].iloc[0] == pytest.approx(-G)
    assert any("g is assumed, as that of ax [g]" in f.what for f in triad.attrs["findings"])


def test_an_unknown_channel_names_the_nearest(read):
    record = read(table("t [s],ax [g],ay [g],az [g]"))
    with pytest.raises(DataError, check=coded("io.no-such-channel")):
        triad_of_channels(record, {"x": "ax [q]"}, quantity="acceleration")


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({}, "no axis is named"),
        ({"w": "ax [g]"}, "unknown axis '"),
        ({"x": "ax [g]", "y": "-ax [g]"}, "' is used for"),
    ],
)
def test_channels_that_are_no_triad(read, channels, words):
    record = read(table("t [s],ax [g],ay [g],az [g]"))
    with pytest.raises(ConfigError, match=words):
        triad_of_channels(record, channels, quantity="acceleration")
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.unknown-triad"
    ):
        triad_of_channels(record, channels, quantity="force")


def test_a_hole_is_named_by_its_row_and_a_slow_axis_is_none(read):
    rows = [f"{k},{k},{k if k % 4 == 0 else ''}" for k in range(24)]
    record = read("t [ms],ax [g],ay [g]\n" + "\n".join(rows) + "\n")
    triad = triad_of_channels(record, {"x": "ax [g]", "y": "ay [g]"}, quantity="acceleration")
    assert int(triad["accel_y"].notna().sum()) == 6
    rows[9] = "9,,"
    record = read("t [ms],ax [g],ay [g]\n" + "\n".join(rows) + "\n")
    with pytest.raises(DataError, check=coded("io.not-finite-number-such")) as error:
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration")
    assert error.value.finding.row == 11


def test_a_hole_in_four_rows_is_one(read):
    record = read("t [ms],ax [g]\n0,1\n1,1\n2,\n3,1\n")
    with pytest.raises(DataError, check=coded("io.not-finite-number-such")) as error:
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration")
    assert error.value.finding.row == 4


@pytest.mark.parametrize("most", [1.1e7, 1e25])  # g; the limit is 1e8 m/s²
def test_a_value_of_no_sensor_is_named_by_its_row(read, most):
    rows = [f"{k},{most if k == 5 else 0.1},{k}" for k in range(20)]
    record = read("t [ms],ax [g],ay [g]\n" + "\n".join(rows) + "\n")
    for find in (
        lambda: triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration"),
        lambda: table_parts("crash.csv", record),
    ):
        with pytest.raises(DataError, check=coded("io.crash-value-impossible")) as error:
            find()
        found = error.value.finding
        assert (found.row, found.data["count"]) == (7, 1)
        assert found.data["value"] == pytest.approx(most * 9.80665)
    triad_of_channels(record, {"y": "ay [g]"}, quantity="acceleration")


def test_channels_with_stamps_of_their_own_are_put_beside_each_other():
    def channel(name, axis, time):
        stamps = np.asarray(time)
        return CrashChannel(name, "acceleration", axis, "m/s2", lambda: (stamps, stamps * 10))

    fast, slow = np.arange(9) * 0.5, np.arange(4) * 1.0 + 0.25
    channels = (channel("a", "x", fast), channel("b", "y", slow))
    record = CrashRecord(Path("r"), "csv", "", {}, channels, ())
    triad = triad_of_channels(record, {"x": "a", "y": "b"}, quantity="acceleration")
    assert len(triad) == 13
    np.testing.assert_array_equal(triad["accel_x"].dropna().index, fast)
    np.testing.assert_array_equal(triad["accel_y"].dropna(), slow * 10)


def test_the_unit_of_time(read):
    text = table("t,ax [g],ay [g],az [g]", count=40, rate=1.0, step=0.4)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.crash-time-unit-undecided"
    ) as error:
        triad_of_channels(read(text), {"x": "ax [g]"}, quantity="acceleration")
    assert 'time_unit = "ms"' in error.value.finding.remedy
    triad = triad_of_channels(read(text), {"x": "ax [g]"}, quantity="acceleration", time_unit="ms")
    np.testing.assert_allclose(triad.index[:3], [0.0, 4e-4, 8e-4], rtol=1e-15)
    stated = read(text.replace("t,", "t [s],", 1))
    with pytest.raises(
        ConfigError,
        match="time_unit = 'ms' is stated",
        check=lambda refused: refused.finding.code == "io.time-unit-stated-record-says",
    ):
        triad_of_channels(stated, {"x": "ax [g]"}, quantity="acceleration", time_unit="ms")


def test_another_column_as_time(read):
    rows = [f"{k},{k * 2e-3:.3f},{k}" for k in range(20)]
    record = read("count,clock,ax [g]\n" + "\n".join(rows) + "\n")
    triad = triad_of_channels(
        record, {"x": "ax [g]"}, quantity="acceleration", time="clock", time_unit="s"
    )
    assert triad.index[-1] == pytest.approx(0.038)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.holds-stamps-needed"
    ):
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", time="ax [g]")


def test_a_rate_in_place_of_stamps(read):
    # Stamps in whole milliseconds of a record at 2 kHz repeat.
    rows = [f"{k // 2},{k}" for k in range(40)]
    record = read("t [ms],ax [g]\n" + "\n".join(rows) + "\n")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.crash-stamp-repeated"
    ) as error:
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration")
    assert (error.value.finding.row, "rate_hz" in error.value.finding.remedy) == (3, True)
    with pytest.raises(
        ConfigError,
        check=coded("io.rate-hz-stated-stamps-record", quantity="rate_hz", rate_hz=500.0),
    ):
        triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", rate_hz=500.0)
    # 39 steps in 19 ms are 2.6 % off 2 kHz; a longer record agrees.
    rows = [f"{k // 2},{k}" for k in range(400)]
    record = read("t [ms],ax [g]\n" + "\n".join(rows) + "\n")
    triad = triad_of_channels(record, {"x": "ax [g]"}, quantity="acceleration", rate_hz=2000.0)
    np.testing.assert_array_equal(triad.index, np.arange(400) / 2000.0)
    bare = read("\n".join(str(k % 7) for k in range(30)) + "\n")
    triad = triad_of_channels(
        bare, {"x": "column 1"}, quantity="acceleration", unit="g", rate_hz=100.0
    )
    assert triad.index[-1] == pytest.approx(0.29)


def test_changes_of_velocity_are_mean_accelerations(read):
    record = read("t [ms],Longitudinal Delta-V (km/h)\n0,0\n10,-3.6\n20,-10.8\n")
    triad = triad_of_channels(record, {"x": "Longitudinal Delta-V (km/h)"}, quantity="acceleration")
    assert triad.attrs["sampling"] == "mean"
    # The first row is where the change counts from: the step after it is whole.
    np.testing.assert_allclose(triad.index, [0.0, 0.01, 0.02], rtol=1e-15)
    np.testing.assert_allclose(triad["accel_x"], [0.0, -100.0, -200.0], rtol=1e-14)
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.sampling-contradicts-record"
    ):
        triad_of_channels(
            record,
            {"x": "Longitudinal Delta-V (km/h)"},
            quantity="acceleration",
            sampling="instantaneous",
        )


def test_sampling_of_the_file_and_of_the_case(read):
    plain = table("t [s],ax [g],ay [g],az [g]")
    axes = {"x": "ax [g]"}
    triad = triad_of_channels(read(plain), axes, quantity="acceleration", sampling="mean")
    assert triad.attrs["sampling"] == "mean"
    mean = read("# sampling: mean\n" + plain)
    assert triad_of_channels(mean, axes, quantity="acceleration").attrs["sampling"] == "mean"
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.triad-sampling-unknown"
    ):
        triad_of_channels(mean, axes, quantity="acceleration", sampling="average")
