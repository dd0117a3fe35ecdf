"""The reader of NHTSA crash tests, on a small made-up test in the form of the EV5 header.

The fields and their order are those of the NHTSA Test Reference Guide, Version 5, Volume I.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.crash_nhtsa import accelerations, imu_of
from strapdown.formats.nhtsa import read_nhtsa

STEM = "synthetic00001"
VEHICLE = "|".join(
    ["1", "16", "03", "2018", "M1", "4S", "VIN", "4CIF", "2.5", "AF", "1719", "1514", "2825"]
    + ["4896", "1837", "1246", "UN", "UNK", "P", ""]
    + ["0"] * 21
    + ["36", "0"]
)


def header_row(count: int) -> str:
    return "|".join(
        [
            *("V5", "a title", "an aim", "03/OCT/2017", "MGA", "DTNH", "BT17", "NCA", "VTB", "CON"),
            *("DRY", "22", "OTH", "OTH", "36", "0", "0", "0", str(count), "a comment"),
        ]
    )


def curve(number: int, axis: str = "XG", unit: str = "G'S", kind: str = "AC", **more: str) -> str:
    fields = {
        "vehicle": "1",
        "number": str(number),
        "kind": kind,
        "occupant": "NA",
        "location": "FLLR",
        "axis": axis,
        "time": "SEC",
        "unit": unit,
        "prefilter": "2800",
        "maker": "M",
        "calibrated": "D",
        "rating": "800",
        "used": "21",
        "velocity": "36",
        "first": "-2",
        "last": "3",
        "interval": "100",
        "status": "AM",
        "primary": "P",
        "comment": f"curve {number}",
    }
    return "|".join((fields | more).values())


SAMPLES = "".join(f"{k * 1e-4:.6f}\t{k + 0.5:.6f}\n" for k in range(-2, 4))


@pytest.fixture
def make(tmp_path):
    def write(curves, files=None, header=None):
        text = header or "\n".join(
            [
                *("# Source", "----- EV5 -----", "----- TEST -----", header_row(len(curves))),
                *("----- VEHICLE -----", VEHICLE, "----- INSTRUMENTATION -----"),
                *curves,
                "----- END -----",
            ]
        )
        path = tmp_path / f"{STEM}.EV5"
        path.write_text(text, encoding="ascii")
        for number, content in (files or {}).items():
            (tmp_path / f"{STEM}.{number:03d}").write_text(content, encoding="ascii")
        return path

    return write


def test_header_is_read_in_si(make):
    test = read_nhtsa(make([curve(1), curve(2)], {1: SAMPLES}))
    assert test.closing_speed == pytest.approx(10.0)
    (vehicle,) = test.vehicles
    assert (vehicle.mass, vehicle.wheelbase, vehicle.speed) == pytest.approx((1719.0, 2.825, 10.0))
    channel = test.channel(1)
    assert channel.initial_velocity == pytest.approx(10.0)
    assert channel.rating_si == pytest.approx(800 * 9.80665)
    assert (channel.prefilter_hz, channel.used_percent, channel.primary) == (2800.0, 21.0, True)
    assert channel.interval == pytest.approx(1e-4)


def test_channels_that_are_not_there_are_told_and_refused_when_read(make):
    test = read_nhtsa(make([curve(1), curve(2), curve(3), curve(5)], {1: SAMPLES}))
    (finding,) = test.findings
    assert "3 of 4" in finding.what
    assert finding.what.endswith("2-3, 5")
    with pytest.raises(
        DataError,
        match="channel 2 ",
        check=lambda refused: refused.finding.code == "io.listed-header-file-not-folder",
    ):
        _ = test.channel(2).table


def test_failed_channels_are_told(make):
    path = make([curve(1, status="CF", comment="No data after 67 ms")], {1: SAMPLES})
    (finding,) = read_nhtsa(path).findings
    assert "CF: No data after 67 ms" in str(finding)


# Factors by definition: standard gravity, the degree, and 1 mm.
@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        ("G'S", "m/s2", 9.80665),
        ("DPS", "rad/s", math.pi / 180.0),
        ("NWT", "N", 1.0),
        ("NWM", "N*m", 1.0),
        ("MM", "m", 1e-3),
    ],
)
def test_samples_are_in_si(make, unit, si, factor):
    channel = read_nhtsa(make([curve(1, unit=unit)], {1: SAMPLES})).channel(1)
    table = channel.table
    assert table.attrs["unit"] == si
    np.testing.assert_allclose(table.index, np.arange(-2, 4) * 1e-4, atol=1e-12)
    np.testing.assert_allclose(table["value"], (np.arange(-2, 4) + 0.5) * factor, rtol=1e-12)


@pytest.mark.parametrize(
    ("content", "words", "row"),
    [
        ("", "is empty", None),
        (SAMPLES[: SAMPLES.rindex("0.000300")], "samples, and the header row states", 5),
        (SAMPLES + "0.000400\t1.0\n", "samples, and the header row states", 7),
        (SAMPLES.replace("\t1.500000", "\tnan"), "not a finite number", 4),
        (SAMPLES.replace("\t1.500000", "\t1.5.0"), "is not a time and a value", 4),
        (SAMPLES.replace("\n0.000100", "\n-0.000200"), "time decreases from", 4),
        (SAMPLES.replace("0.000300\t", "0.000400\t"), "the stamp is 0.000400 s", 6),
        (SAMPLES * 40, "too many for the 6 samples", None),
    ],
)
def test_bad_channels_are_refused_with_their_row(make, content, words, row):
    channel = read_nhtsa(make([curve(1)], {1: content})).channel(1)
    with pytest.raises(DataError, match=words) as error:
        _ = channel.table
    assert error.value.finding.file == f"{STEM}.001"
    assert error.value.finding.row == row
    assert error.value.finding.remedy


def test_unknown_units_are_refused(make):
    channel = read_nhtsa(make([curve(1, unit="FURLONG")], {1: SAMPLES})).channel(1)
    with pytest.raises(DataError, check=coded("io.unit-not-known")):
        _ = channel.table
    channel = read_nhtsa(make([curve(1, time="WEEK")], {1: SAMPLES})).channel(1)
    with pytest.raises(DataError, check=coded("io.time-unit-not-known", quantity="time")):
        _ = channel.table


def test_a_count_that_does_not_match_is_refused(make):
    path = make([curve(1)])
    path.write_text(path.read_text().replace("|1|a comment", "|2|a comment"))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.promises-curves-lists"
    ) as error:
        read_nhtsa(path)
    assert error.value.finding.row == 4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: "", "the file is empty"),
        (lambda t: t.replace("----- END -----", ""), "missing section"),
        (lambda t: "time,ax\n0,1\n", "' is outside every section"),
        (lambda t: t.replace("INSTRUMENTATION", "INSTRUMENTS"), "unknown section of EV5 '"),
        (lambda t: t.replace("|P|curve 1", "|curve 1"), "19 fields"),
        (lambda t: t.replace("|2800|", "|28OO|"), "' is not a number"),
        (lambda t: t.replace("|-2|3|", "|3|-2|"), "µs, are not a record"),
        (lambda t: t.replace("|-2|3|", "|nan|3|"), "' is not a number"),
        (lambda t: t.replace("|-2|3|", "|-2.5|3|"), "' is not a number"),
        (lambda t: t.replace("|1|a comment", "||a comment"), "' is not a number"),
    ],
)
def test_bad_headers_are_refused(make, change, words):
    path = make([curve(1)])
    path.write_text(change(path.read_text()))
    with pytest.raises(DataError, match=words) as error:
        read_nhtsa(path)
    assert error.value.finding.remedy


def test_what_a_header_does_not_state_is_none_or_nan(make):
    path = make([curve(1, rating="", velocity="NA")])
    path.write_text(path.read_text().replace("|2018|", "||").replace("|1719|", "|UN|"))
    test = read_nhtsa(path)
    assert test.vehicles[0].year is None
    assert math.isnan(test.vehicles[0].mass)
    assert math.isnan(test.channel(1).rating)
    assert math.isnan(test.channel(1).initial_velocity)


def test_a_missing_header_and_a_number_twice_are_refused(make, tmp_path):
    with pytest.raises(DataError, check=lambda refused: refused.finding.code == "io.no-such-file"):
        read_nhtsa(tmp_path / "none.EV5")
    with pytest.raises(DataError, check=coded("io.channel-listed-twice")):
        read_nhtsa(make([curve(1), curve(1)]))


def test_accelerations_are_selected_by_place_and_axis(make):
    curves = [curve(1), curve(2, axis="ZG"), curve(3, location="ENGN"), curve(4, kind="LC")]
    test = read_nhtsa(make(curves, dict.fromkeys((1, 2, 3, 4), SAMPLES)))
    assert [c.number for c in accelerations(test)] == [1, 2, 3]
    assert [c.number for c in accelerations(test, "fl", axis="x")] == [1]
    with pytest.raises(DataError, check=coded("io.nhtsa-no-such-channel")):
        accelerations(test, "HDCG")


def test_six_channels_make_an_imu_table_with_gravity_put_back(make):
    curves = [curve(n, unit="G'S") for n in (1, 2, 3)]
    curves += [curve(n, unit="DPS", kind="AV") for n in (4, 5, 6)]
    test = read_nhtsa(make(curves, dict.fromkeys(range(1, 7), SAMPLES)))
    imu = imu_of(test, (1, 2, 3), (4, 5, 6))
    # Samples before the impact are -1.5 and -0.5: their mean, -1, is taken off.
    np.testing.assert_allclose(imu["gyro_x"], np.deg2rad(np.arange(-2, 4) + 1.5), rtol=1e-12)
    np.testing.assert_allclose(imu["accel_z"], 9.80665 * (np.arange(-2, 4) + 0.5), rtol=1e-12)
    with pytest.raises(DataError, check=coded("io.needed-2")):
        imu_of(test, (4, 5, 6), (1, 2, 3))
    with pytest.raises(DataError, check=coded("io.samples-before", before=1)):
        imu_of(test, (1, 2, 3), (4, 5, 6), until=-0.00015)
