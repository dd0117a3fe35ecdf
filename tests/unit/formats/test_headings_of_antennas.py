"""Headings of two antennas: sentences, UBX-NAV-RELPOSNED, logs of NovAtel and Unicore.

Lines with a checksum that is written out are printed examples or recorded: THS and UNIHEADINGA of a
UM982, ``$PSAT,HPR`` of a Hemisphere on a ship (NOAA, CLIVAR 2010), HEADING2A and
DUALANTENNAHEADINGA of the OEM7 manual, HEADINGA of a Unicore receiver.
"""

from __future__ import annotations

import struct
import zlib
from datetime import UTC, datetime
from functools import reduce
from operator import xor

import numpy as np
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import DataError
from strapdown.formats import NoStreamError, open_stream, reader_of
from strapdown.formats.aid_table import read_aid_table, read_stream
from strapdown.formats.gnss_files import GnssOptions, read_gnss

DAY = datetime(2024, 5, 1, tzinfo=UTC).timestamp()


def sentence(body):
    return f"${body}*{reduce(xor, body.encode(), 0):02X}"


def gga(clock, quality=4):
    return sentence(f"GNGGA,{clock},4730.0,N,00830.0,E,{quality},12,0.8,500.0,M,47.0,M,,")


RMC = sentence("GNRMC,100001.00,A,4730.0,N,00830.0,E,0.0,0.0,010524,,,A")
AT = DAY + 36_000.0


def written(tmp_path, lines, name="rover.nmea"):
    path = tmp_path / name
    path.write_bytes(lines if isinstance(lines, bytes) else "\r\n".join([*lines, ""]).encode())
    return path


def codes(raw):
    return [f.code for f in raw.findings]


# Sentences.


def test_headings_of_sentences_without_a_time_have_that_before_them(tmp_path):
    lines = [
        *("$GNTHS,179.0284,A*18", gga("100000.00"), "$GNTHS,179.0284,A*18"),
        *(gga("100001.00"), RMC, sentence("GNTHS,180.5,A"), sentence("GNTHS,181.5,A")),
        *(gga("100002.00"), "$HETHS,316.70,E*1A", gga("100003.00"), "$GPTHS,,V*0E"),
        *(gga("100004.00"), sentence("GNTHS,359.9,A"), gga("100005.00"), sentence("GNTHS,0.2,S")),
    ]
    path = written(tmp_path, lines)
    raw = open_stream(path, "heading")
    assert raw.columns["time"].tolist() == [AT, AT + 1.0, AT + 4.0]
    assert raw.columns["heading"].tolist() == [179.0284, 180.5, 359.9]
    assert (raw.clock, "heading_sd" in raw.columns) == ("unix", False)
    # One before any time, dead reckoning, not valid, and a simulator; not one of two of an instant.
    assert codes(raw) == ["io.headings-left-out", "io.heading-without-time"]
    assert raw.findings[0].data["count"] == 4
    assert raw.rows.tolist() == [3, 6, 13]
    assert len(read_gnss(path, GnssOptions(position_sd=1.0))) == 6


def test_heading_true_is_used_where_there_is_no_other_kind(tmp_path):
    lines = [gga("100000.00"), RMC, sentence("GPHDT,12.5,T"), gga("100002.00"), "$GPHDT,,T*1B"]
    raw = open_stream(written(tmp_path, lines), "heading")
    # The date is that of the second instant.
    assert (raw.columns["time"].tolist(), raw.columns["heading"].tolist()) == ([AT + 1.0], [12.5])
    both = [*lines, sentence("GPTHS,13.5,A")]
    assert open_stream(written(tmp_path, both), "heading").columns["heading"].tolist() == [13.5]


def test_headings_of_hemisphere_have_a_time_of_their_own(tmp_path):
    lines = [
        gga("235410.00"),
        "$PSAT,HPR,235410.50,89.58,3.35,,N*01",
        "$GPVTG,121.24,T,112.16,M,0.10,N,0.18,K,D*2F",
        "$PSAT,HPR,235410.60,89.57,3.31,,N*09",
        sentence("PSAT,HPR,235410.70,89.60,3.31,,G"),
        gga("235411.00"),
    ]
    path = written(tmp_path, lines)
    raw = open_stream(path, "heading")
    day = 23 * 3600 + 54 * 60 + 10.0
    assert raw.columns["time"].tolist() == [day + 0.5, day + 0.6]
    assert raw.columns["heading"].tolist() == [89.58, 89.57]
    assert (raw.clock, codes(raw)) == ("relative", ["io.headings-left-out"])
    found = read_gnss(path, GnssOptions(position_sd=1.0)).attrs["findings"]
    assert "io.nmea-lines-left-out" not in [f.code for f in found]


def pashr(clock, heading, sd_deg=0.1, quality=2, aligned=",0"):
    values = f"{heading},T,1.0,2.0,,0.1,0.1,{sd_deg},{quality}{aligned}"
    return sentence(f"PASHR,{clock},{values}")


def test_attitude_sentences_have_a_standard_deviation(tmp_path):
    lines = [
        *(gga("100001.00"), RMC, pashr("100001.00", 350.25, 0.3, 2), sentence("GNTHS,1.0,A")),
        *(pashr("100001.50", 351.0, 0.4, 1), pashr("100002.00", 352.0, 0.3, 0)),
        *(pashr("100002.50", 353.0, 0.3, 2, ",1"), pashr("100003.00", 354.5, 0.5, 2, "")),
        sentence("PASHR,POS,1,8,100003.00,4730.0,N,00830.0,E,500.0,,0,0,0,1,1,1,1,A"),
    ]
    path = written(tmp_path, lines)
    table = read_stream(path, "heading")
    since = table.index - AT
    assert since.tolist() == [1.0, 1.5, 3.0]
    assert table["heading"].tolist() == [350.25, 351.0, 354.5]
    assert table["heading_sd"].tolist() == [0.3, 0.4, 0.5]
    # Without a fix, and by an inertial unit.
    assert table.attrs["findings"][0].data["count"] == 2
    assert sd.read(path)["heading"]["heading"].tolist() == [350.25, 351.0, 354.5]


def test_a_file_without_a_heading_or_without_a_valid_one(tmp_path):
    with pytest.raises(NoStreamError):
        open_stream(written(tmp_path, [gga("100000.00"), RMC]), "heading")
    with pytest.raises(DataError, check=coded("io.no-usable-heading", count=1)):
        open_stream(written(tmp_path, [gga("100000.00"), "$HETHS,316.70,E*1A"]), "heading")
    with pytest.raises(DataError, check=coded("io.not-number")):
        open_stream(written(tmp_path, [gga("100000.00"), sentence("GPHDT,x,T")]), "heading")


def test_headings_that_come_after_the_next_fix_over_midnight(tmp_path):
    lines = [
        *(gga("235958.00"), sentence("GNRMC,235958.00,A,4730.0,N,00830.0,E,0.0,0.0,010524,,,A")),
        *(gga("235959.00"), pashr("235958.00", 1.0), gga("000000.00"), pashr("235959.00", 2.0)),
        *(gga("000001.00"), pashr("000000.00", 3.0), gga("000002.00"), pashr("000001.00", 4.0)),
    ]
    raw = open_stream(written(tmp_path, lines), "heading")
    since = raw.columns["time"] - (DAY + 86_400.0)
    assert since.tolist() == [-2.0, -1.0, 0.0, 1.0]
    assert raw.columns["heading"].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_a_pause_of_more_than_half_a_day_is_within_the_day(tmp_path):
    lines = [sentence("GNRMC,060000.00,A,4730.0,N,00830.0,E,0.0,0.0,010524,,,A")]
    lines += [pashr("060000.00", 1.0), pashr("200000.00", 2.0), pashr("010000.00", 3.0)]
    raw = open_stream(written(tmp_path, lines), "heading")
    hours = (raw.columns["time"] - DAY) / 3600.0
    assert hours.tolist() == [6.0, 20.0, 25.0]


def test_a_kind_without_a_usable_heading_does_not_hide_another(tmp_path):
    empty = sentence("PASHR,,,T,,,,,,,0,0")
    lines = [gga("100000.00"), empty, sentence("GPHDT,10.0,T"), gga("100001.00"), RMC]
    lines += [pashr("100001.00", "", quality=0), sentence("GPHDT,11.0,T")]
    raw = open_stream(written(tmp_path, lines), "heading")
    assert raw.columns["time"].tolist() == [AT, AT + 1.0]
    assert raw.columns["heading"].tolist() == [10.0, 11.0]
    assert codes(raw) == ["io.heading-without-time"]


def test_an_instant_of_two_talkers_has_one_heading_and_none_is_left_out(tmp_path):
    lines = [gga("100000.00"), sentence("GPHDT,10.0,T"), sentence("GNHDT,10.5,T")]
    lines += [gga("100001.00"), RMC, sentence("GPHDT,11.0,T"), sentence("GNHDT,11.5,T")]
    raw = open_stream(written(tmp_path, lines), "heading")
    assert raw.columns["heading"].tolist() == [10.0, 11.0]
    assert codes(raw) == ["io.heading-without-time"]
    # A heading that is not kept has no part in whether all have a standard deviation.
    lines = [pashr("100000.00", 1.0, 0.2), pashr("100000.00", 2.0, 0.0), pashr("100001.00", 3.0)]
    raw = open_stream(written(tmp_path, [gga("100000.00"), *lines]), "heading")
    assert raw.columns["heading"].tolist() == [1.0, 3.0]
    assert raw.columns["heading_sd"].tolist() == [0.2, 0.1]


def test_damaged_sentences_of_headings_are_counted(tmp_path):
    bad = [sentence("GPHDT,10.0,T").replace("10.0", "20.0"), "$PSAT,HPR,235410.50,89.58,3.3"]
    fixes = [gga("100000.00"), gga("100001.00"), RMC]
    spoiled = fixes[0].replace("500.0", "600.0")
    lines = [fixes[0], spoiled, *bad, *fixes[1:], sentence("GPHDT,11.0,T")]
    path = written(tmp_path, lines)
    raw = open_stream(path, "heading")
    assert raw.columns["heading"].tolist() == [11.0]
    assert codes(raw) == ["io.nmea-lines-left-out", "io.heading-without-time"]
    left_out = raw.findings[0]
    assert (left_out.row, left_out.quantity, left_out.data["count"]) == (3, "heading", 2)
    found = read_gnss(path, GnssOptions(position_sd=1.0)).attrs["findings"]
    assert (found[0].row, found[0].data["count"]) == (2, 3)
    with pytest.raises(DataError, check=coded("io.holds-no-heading-whole", count=2)):
        open_stream(written(tmp_path, [*fixes, *bad]), "heading")
    # A damaged fix is no heading.
    with pytest.raises(NoStreamError):
        open_stream(written(tmp_path, [*fixes, spoiled]), "heading")


def test_headings_beyond_a_turn_are_not_valid(tmp_path):
    angles = ["999.0", "-10.0", "0.0", "360.0", "360.01", "-0.01"]
    pairs = [(gga(f"10000{k}.00"), sentence(f"GPHDT,{a},T")) for k, a in enumerate(angles)]
    lines = [line for pair in pairs for line in pair]
    raw = open_stream(written(tmp_path, lines), "heading")
    assert raw.columns["heading"].tolist() == [0.0, 360.0]
    assert codes(raw) == ["io.headings-left-out", "io.heading-without-time"]
    assert raw.findings[0].data["count"] == 4


# UBX.


def ubx_frame(kind, number, payload):
    body = bytes([kind, number]) + struct.pack("<H", len(payload)) + payload
    a = b = 0
    for octet in body:
        a = (a + octet) & 255
        b = (b + a) & 255
    return b"\xb5\x62" + body + bytes([a, b])


#: Fix, relative position, fixed ambiguities, moving base, valid heading.
GOOD = 1 | 1 << 2 | 2 << 3 | 1 << 5 | 1 << 8


def relposned(tow_ms, heading, accuracy, flags=GOOD, version=1, length=(123, 45)):
    payload = bytearray(64)
    payload[0] = version
    struct.pack_into("<I", payload, 4, tow_ms)
    struct.pack_into("<i", payload, 20, length[0])
    struct.pack_into("<i", payload, 24, round(heading * 1e5))
    struct.pack_into("<b", payload, 35, length[1])
    struct.pack_into("<I", payload, 52, round(accuracy * 1e5))
    struct.pack_into("<I", payload, 60, flags)
    return ubx_frame(1, 0x3C, bytes(payload))


def nav_pvt(tow_ms, date=(2026, 4, 20), clock=(13, 48, 56), valid=3):
    payload = bytearray(92)
    struct.pack_into("<IH6B", payload, 0, tow_ms, *date, *clock, valid)
    return ubx_frame(1, 7, bytes(payload))


TOW = 136_154_000  # 13:48:56 UTC on 20 April 2026, of week 2415


def test_the_baseline_of_a_moving_base(tmp_path):
    out = relposned(TOW - 200, 10.5, 0.25) + nav_pvt(TOW) + relposned(TOW, 11.25, 0.5)
    out += relposned(TOW + 200, 12.0, 0.75, GOOD | 1 << 9)
    # Each without one of the bits, a float solution, no accuracy, and of another version.
    bits = [1, 4, 32, 256, 16]
    out += b"".join(relposned(TOW + 400, 0.0, 1.0, GOOD & ~bit) for bit in bits)
    out += relposned(TOW + 400, 0.0, 1.0, GOOD & ~24 | 8) + relposned(TOW + 400, 0.0, 0.0)
    out += relposned(TOW + 400, 99.0, 1.0, version=0)
    path = written(tmp_path, out, "rover.ubx")
    assert reader_of(path)[0] == "ubx"
    table = read_stream(path, "heading")
    assert table.index.tolist() == [TOW * 1e-3 - 0.2, TOW * 1e-3, TOW * 1e-3 + 0.2]
    np.testing.assert_allclose(table["heading"], [10.5, 11.25, 12.0], rtol=1e-12)
    np.testing.assert_allclose(table["heading_sd"], [0.25, 0.5, 0.75], rtol=1e-12)
    np.testing.assert_allclose(table["baseline"], [1.2345, 1.2345, np.nan], rtol=1e-12)
    assert (table.attrs["clock"], table.attrs["gps_week"]) == ("gps-seconds-of-week", 2415)
    assert [f.data["count"] for f in table.attrs["findings"]] == [7]


def test_a_week_ends_within_the_headings(tmp_path):
    last = 604_799_900
    out = relposned(last, 1.0, 0.5) + relposned(50, 2.0, 0.5)
    # Sunday 26 April 2026, 00:00:10 of GPS, begins week 2416; UTC is 18 s behind.
    out += nav_pvt(10_000, (2026, 4, 25), (23, 59, 52))
    path = written(tmp_path, out, "rover.ubx")
    table = read_aid_table(path, {"heading": "deg", "heading_sd": "deg"}, stream="heading")
    assert table.index.tolist() == [604_799.9, 604_800.05]
    assert table.attrs["gps_week"] == 2415


def test_a_stream_without_own_headings_has_those_of_its_sentences(tmp_path):
    lines = [gga("100001.00"), RMC, sentence("GNTHS,45.5,A")]
    out = nav_pvt(TOW) + "\r\n".join([*lines, ""]).encode() + nav_pvt(TOW + 1000)
    path = written(tmp_path, out, "mixed.ubx")
    raw = open_stream(path, "heading")
    assert raw.columns["heading"].tolist() == [45.5]
    assert raw.files == (path,)
    with pytest.raises(NoStreamError):
        open_stream(written(tmp_path, nav_pvt(TOW) * 3, "plain.ubx"), "heading")


# NovAtel and Unicore.


def crc(data):
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


HEADING2A = (
    "#HEADING2A,COM1,0,39.5,FINESTEERING,1622,422892.200,02040000,f9bf,6521;SOL_COMPUTED,"
    "NARROW_INT,0.927607417,178.347869873,-1.3037414550,0,0.261901051,0.391376048,"
    '"R222","AAAA",18,17,17,16,0,01,0,33*8c48d77c'
)
DUAL = (
    "#DUALANTENNAHEADINGA,UNKNOWN,0,66.5,FINESTEERING,1949,575614.000,02000000,d426,32768;"
    "SOL_COMPUTED,NARROW_INT,-1.000000000,255.538528442,0.006041416,0.0,0.043859947,"
    '0.052394450,"J56X",24,18,18,17,04,01,00,33*1f082ec5'
)
UNICORE = (
    "#HEADINGA,COM1,0,60.0,FINESTEERING,2281,384415.000,00000000,0000,1114;SOL_COMPUTED,"
    "NARROW_INT,13.425773621,67.686813354,-78.931716919,0.000000000,0.212850377,0.413018167,"
    '"0004",16,15,16,16,0,0,4,107*157ecb94'
)
UM982 = (
    "#UNIHEADINGA,78,GPS,FINE,2428,116060000,0,0,18,11;SOL_COMPUTED,NARROW_INT,1.4773,"
    '179.0284,-2.4202,0.0000,0.8259,1.0921,"999",27,21,21,15,3,01,3,f3*5d424350'
)
FLOAT = (
    "#UNIHEADINGA,93,GPS,FINE,2385,326588000,0,0,18,10;SOL_COMPUTED,NARROW_FLOAT,5.5208,"
    '219.9783,24.6813,0.0000,16.4390,35.3287,"999",21,9,9,5,3,00,3,13*53e4320d'
)


@pytest.mark.parametrize(
    ("line", "week", "second", "heading", "spread", "length"),
    [
        (HEADING2A, 1622, 422892.2, 178.347869873, 0.261901051, 0.927607417),
        (DUAL, 1949, 575614.0, 255.538528442, 0.043859947, np.nan),
        (UNICORE, 2281, 384415.0, 67.686813354, 0.212850377, 13.425773621),
        (UM982, 2428, 116060.0, 179.0284, 0.8259, 1.4773),
    ],
)
def test_printed_headings(tmp_path, line, week, second, heading, spread, length):
    path = written(tmp_path, [line] * 2, "rover.log")
    assert reader_of(path)[0] == "novatel"
    table = read_stream(path, "heading")
    assert table.index.tolist() == [second] * 2
    assert (table.attrs["clock"], table.attrs["gps_week"]) == ("gps-seconds-of-week", week)
    expected = np.float32([[heading, spread, length]] * 2)
    np.testing.assert_array_equal(table[["heading", "heading_sd", "baseline"]], expected)


def test_a_float_solution_is_no_heading_and_a_damaged_line_none(tmp_path):
    with pytest.raises(DataError, check=coded("io.no-usable-heading", count=2)):
        open_stream(written(tmp_path, [FLOAT] * 2, "a.log"), "heading")
    raw = open_stream(written(tmp_path, [UM982, UM982.replace("179", "178"), FLOAT]), "heading")
    assert raw.columns["heading"].tolist() == [np.float32(179.0284)]
    assert codes(raw) == ["io.bytes-left-out", "io.headings-left-out"]


def test_a_log_of_sentences_and_headings_has_both(tmp_path):
    path = written(tmp_path, [gga("100000.00"), RMC, UM982, gga("100002.00"), FLOAT], "um982.log")
    assert reader_of(path)[0] == "novatel"
    assert open_stream(path, "heading").columns["heading"].tolist() == [np.float32(179.0284)]
    assert len(read_gnss(path, GnssOptions(position_sd=1.0))) == 2


def test_binary_headings(tmp_path):
    def frame(kind, ms, solved, fixed, heading):
        body = struct.pack("<IIffffff", solved, fixed, 1.5, heading, 0.0, 0.0, 0.25, 0.5)
        head = struct.pack("<3sBHBBHHBBHI", b"\xaa\x44\x12", 28, kind, 0, 32, len(body), 0, 0, 180,
                           2200, ms) + bytes(8)  # fmt: skip
        return head + body + struct.pack("<I", crc(head + body))

    states = [(0, 50, 10.25), (1, 50, 11.0), (0, 34, 12.0), (0, 48, 13.5)]
    out = b"".join(frame(971, 1000 * k, *state) for k, state in enumerate(states))
    table = read_stream(written(tmp_path, out, "rover.gps"), "heading")
    assert (table.index.tolist(), table["heading"].tolist()) == ([0.0, 3.0], [10.25, 13.5])
    assert table["baseline"].tolist() == [1.5, 1.5]
    assert table.attrs["findings"][0].data["count"] == 2
