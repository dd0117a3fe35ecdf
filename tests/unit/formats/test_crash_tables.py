"""Crash records as text tables: names, units, titles above the header, clocks, event recorders."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_record import clean, unique
from strapdown.formats.crash_records import CRASH_READERS, read_crash_record
from strapdown.formats.crash_samples import mean_acceleration, mean_accelerations_of
from strapdown.formats.crash_table import channel_name
from strapdown.formats.crash_triad import state_unit
from strapdown.units import FACTORS, OF_CRASHES, find_unit

EDR = """\
Event data recorder, most recent event
Longitudinal crash pulse
Time (msec),Longitudinal Delta-V (MPH),Lateral Delta-V (MPH)
10,-1.0,0.5
20,-3.0,0.5
30,-6.0,1.5
"""


@pytest.fixture
def read(tmp_path):
    def write(text, name="log.csv", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return read_crash_record(path)

    return write


@pytest.mark.parametrize(
    ("name", "quantity", "axis", "unit"),
    [
        ("ax [g]", "acceleration", "x", "g"),
        ("Gyr_X (deg/s)", "rate", "x", "deg/s"),
        ("accel_y_m_s2", "acceleration", "y", "m/s2"),
        ("Longitudinal Delta-V (MPH)", "velocity", "x", "mph"),
        ("Delta-V, lateral [km/h]", "velocity", "y", "km/h"),
        ("Lateral Crash Pulse Acceleration", "acceleration", "y", ""),
        ("Vertical acceleration (G's)", "acceleration", "z", "g"),
        ("Yaw rate (deg/sec)", "rate", "z", "deg/s"),
        ("roll [deg/s]", "rate", "x", "deg/s"),
        ("Time (msec)", "time", "", "ms"),
        ("Time after T0 [s]", "time", "", "s"),
        ("t", "time", "", ""),
        ("accZ", "acceleration", "z", ""),
        ("Barrier force [kN]", "force", "", "kN"),
        ("Vehicle speed [km/h]", "other", "", "km/h"),
        ("upward acceleration up (m/s^2)", "acceleration", "-z", "m/s2"),
        ("temperature [C]", "other", "", "C"),
        ("column 3", "other", "", ""),
        # Channel codes of ISO MME; what an occupant's head does is not of the vehicle.
        ("10VEHCCG0000ACXD", "acceleration", "x", ""),
        ("10vehccg0000avzd [deg/s]", "rate", "z", "deg/s"),
        ("10VEHCCG0000ACYC (g)", "acceleration", "y", "g"),
        ("10VEHCCG0000AC1D", "acceleration", "", ""),
        ("11HEAD0000H3ACXA", "other", "x", ""),
        ("10VEHCCG0000QQXD", "other", "", ""),
        # The unit is of one quantity alone: it decides.
        ("gx [g]", "acceleration", "x", "g"),
    ],
)
def test_names_of_columns(name, quantity, axis, unit):
    said = channel_name(name)
    assert (said.quantity, said.axis, said.unit) == (quantity, axis, unit)


def test_a_name_against_its_unit_is_told():
    said = channel_name("acc_x [deg/s]")
    assert (said.quantity, said.axis) == ("rate", "x")
    assert "acceleration" in said.contradiction


@pytest.mark.parametrize(
    ("text", "quantity", "si"),
    [
        ("m/(s*s)", "acceleration", 1.0),
        ("G's", "acceleration", 9.80665),
        ("[°/s]", "rate", math.pi / 180.0),
        ("(km/h)", "velocity", 1.0 / 3.6),
        ("MPH", "velocity", 1609.344 / 3600.0),
        ("kN", "force", 1000.0),
        ("mm", "displacement", 1e-3),
        ("msec", "time", 1e-3),
    ],
)
def test_units_by_their_definitions(text, quantity, si):
    found = find_unit(text, OF_CRASHES)
    assert found is not None
    assert found[0] == quantity
    assert FACTORS[quantity][found[1]] == pytest.approx(si, rel=1e-15)


def test_a_unit_of_something_else_is_refused():
    assert find_unit("furlong", OF_CRASHES) is None
    with pytest.raises(
        ConfigError,
        match="'deg/s' is a unit of rate",
        check=lambda refused: refused.finding.code == "io.crash-unit-of-other-quantity",
    ):
        state_unit("deg/s", "acceleration")
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.crash-unit-unknown"
    ):
        state_unit("furlong", "acceleration")


def test_a_title_above_the_header_and_a_row_of_units(read):
    record = read("A title; with a mark\n\nTime;Acc X;V lat\nms;g;km/h\n0;0,5;0\n1;1,5;36\n")
    time, values = record.channel("Acc X").load()
    np.testing.assert_array_equal(time, [0.0, 1e-3])
    np.testing.assert_allclose(values, np.array([0.5, 1.5]) * 9.80665, rtol=1e-15)
    assert record.channel("V lat").quantity == "velocity"
    # Row 5 of the file, as an editor counts it.
    assert record.channel("Acc X").row(0) == 5


def test_a_title_above_a_table_with_a_column_of_text(read):
    record = read("sep=,\nA title\nt [s],ax [g],state\n0,1,ok\n1,2,ok\n")
    np.testing.assert_allclose(record.channel("ax [g]").load()[1], [9.80665, 19.6133])


def test_a_table_without_a_header(read):
    rows = "".join(f"{k * 1e-3:.3f},{k},{-k}\n" for k in range(10))
    record = read(rows)
    assert [c.name for c in record.channels] == ["column 1", "column 2", "column 3"]
    assert record.channel("column 1").quantity == "time"
    assert "increases evenly" in record.findings[0].what
    np.testing.assert_array_equal(record.channel("column 2").load()[1], np.arange(10.0))


def test_a_count_of_samples_is_no_clock(read):
    record = read("".join(f"{k},{k * k}\n" for k in range(10)))
    assert record.channel("column 1").quantity == "other"
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.crash-time-column-missing"
    ) as error:
        record.channel("column 2").load()
    assert "rate_hz" in error.value.finding.remedy


def test_columns_of_text_are_left_out_and_names_are_once(read):
    record = read("t [s],ax,ax,note\n0,1,2,a\n1,1,2,b\n")
    assert [c.name for c in record.channels] == ["t [s]", "ax", "ax (2)"]
    assert "columns of text" in record.findings[0].what


def test_text_among_numbers_is_named_by_its_row(read):
    record = read("t [s],ax [g]\n0,1\n1,oops\n2,3\n")
    with pytest.raises(DataError, check=coded("io.crash-channel-unusable")) as error:
        record.channel("ax [g]").load()
    assert error.value.finding.row == 3


@pytest.mark.parametrize(
    ("stamps", "words", "row"),
    [
        ("0 1 3 2", "time decreases from", 5),
        ("0 1 1 2", "repeats", 4),
        ("0 x 1 2", "missing stamp", 3),
    ],
)
def test_faults_of_time_are_named_by_their_row(read, stamps, words, row):
    lines = [f"{t}.0,1" if t != "x" else ",1" for t in stamps.split()]
    record = read("t [s],ax [g]\n" + "\n".join(lines) + "\n")
    with pytest.raises(DataError, match=words) as error:
        record.channel("ax [g]").load()
    assert error.value.finding.row == row


def test_stamps_of_1970_count_from_midnight_and_dates_are_stamps(read):
    record = read("t [s],ax [g]\n1700000000.000,1\n1700000000.001,1\n1700000000.002,1\n")
    # 1700000000 is 80000 s after a midnight. A double holds such a stamp to 2.4e-7 s.
    read_back = record.channel("ax [g]").load()[0] - 80_000
    np.testing.assert_allclose(read_back, [0, 1e-3, 2e-3], atol=5e-7)
    record = read("when,ax [g]\n2020-01-01T00:00:00.000,1\n2020-01-01T00:00:00.005,1\n")
    np.testing.assert_allclose(record.channel("ax [g]").load()[0], [0, 5e-3], atol=1e-15)


def test_a_table_of_an_event_data_recorder(read):
    record = read(EDR)
    channel = record.channel("Longitudinal Delta-V (MPH)")
    assert (channel.quantity, channel.axis, channel.sampling) == ("velocity", "x", None)
    time, velocity = channel.load()
    np.testing.assert_allclose(time, [0.01, 0.02, 0.03], rtol=1e-15)
    np.testing.assert_allclose(velocity, np.array([-1.0, -3.0, -6.0]) * 0.44704, rtol=1e-15)


def test_mean_accelerations_are_differences_over_steps(read):
    # The table begins one step after time zero, from which its changes count: -1, -2 and -3 mph
    # in 10 ms each.
    time, mean = mean_acceleration(read(EDR).channel("Longitudinal Delta-V (MPH)"))
    np.testing.assert_allclose(time, [0.01, 0.02, 0.03], rtol=1e-15)
    np.testing.assert_allclose(mean, np.array([-1.0, -2.0, -3.0]) * 44.704, rtol=1e-14)


def test_the_sum_of_mean_accelerations_is_the_change(read):
    time = np.cumsum([0.01, 0.013, 0.007, 0.02])
    velocity = np.array([0.0, -1.3, -2.9, -2.2])
    ends, mean = mean_accelerations_of(time, velocity)
    np.testing.assert_array_equal(ends, time[1:])
    # Each product rounds once or twice: a few parts in 1e16 of 3 m/s.
    np.testing.assert_allclose(np.cumsum(mean * np.diff(time)), velocity[1:], atol=5e-15)


def test_mean_acceleration_of_something_else_or_with_a_hole_is_refused(read):
    record = read("t [s],ax [g],dv [m/s]\n0,1,0\n1,1,\n2,1,2\n")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.holds-change-velocity-needed"
    ):
        mean_acceleration(record.channel("ax [g]"))
    with pytest.raises(DataError, check=coded("io.not-finite-number-2")) as error:
        mean_acceleration(record.channel("dv [m/s]"))
    assert error.value.finding.row == 3


def test_a_velocity_that_is_no_change_counts_from_its_first_sample(read):
    record = read("t [s],velocity x [m/s]\n0,15\n1,14\n2,10\n")
    np.testing.assert_array_equal(record.channel("velocity x [m/s]").load()[1], [0, -1, -5])


def test_texts_of_a_file_cannot_steer_a_terminal():
    assert clean("a\x1b[31mb\u202ec\nd") == "a\ufffd[31mb\ufffdc d"
    assert len(clean("x" * 10_000, 50)) == 50
    assert unique(["a", "a", "a (2)", ""]) == ["a", "a (2)", "a (2) (2)", ""]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\0\1\2\3" * 50, "zero bytes"),
        ("t,ax\n", "the file has a header and no data"),
        ("# a comment\n", "the file has only comments"),
        ("a,b\nx,y\nz,w\n", "no column is numeric"),
    ],
)
def test_files_that_are_no_record_are_refused(read, content, words):
    with pytest.raises(DataError, match=words) as error:
        read(content)
    assert error.value.finding.remedy


def test_a_missing_file_an_unknown_folder_and_an_unknown_reader(tmp_path):
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-such-record"
    ):
        read_crash_record(tmp_path / "none.csv")
    (tmp_path / "x.bin").write_bytes(b"1")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.folder-no-known-crash-record"
    ):
        read_crash_record(tmp_path)
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.unknown-reader"
    ) as error:
        read_crash_record(tmp_path, format="mmr")
    assert "mme" in error.value.finding.remedy
    with pytest.raises(DataError, check=coded("io.crash-record-unreadable")):
        read_crash_record(tmp_path / ("a" * 5000))


def test_a_reader_can_be_named(tmp_path):
    path = tmp_path / "log.dat"
    path.write_text("t [s],ax [g]\n0,1\n1,1\n")
    assert read_crash_record(path, format="csv").format == "csv"
    assert set(CRASH_READERS) == {"nhtsa", "mme", "json", "edr", "log", "csv"}


def test_other_logs_are_records_too(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time_s=np.arange(8) * 1e-3, accel_x_m_s2=np.arange(8.0))
    record = read_crash_record(path)
    channel = record.channel("accel_x_m_s2")
    assert (record.format, channel.axis, channel.unit) == ("log", "x", "m/s2")
    np.testing.assert_array_equal(channel.load()[1], np.arange(8.0))


def test_comments_that_are_no_channels_are_told(read):
    record = read(
        '# channel: {"column": 2, "quantity": "speed"}\n# channel: [\nt [s],a\n0,1\n1,1\n'
    )
    assert [f.row for f in record.findings] == [1, 2]
    assert "unknown quantity: 'speed'" in record.findings[0].what
