"""ISO MME: codes in words, headers, channels, stamps; and tests that are damaged or hostile."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.mme_codes import decode_mme
from strapdown.formats.mme_reader import even_stamps

HEAD = "11HEAD0000H3ACXA"
CAR = "10VEHC0000CGAVZC"
MME = "Title :A test: of two\nNumber of test objects :1\nMass test object 1 :1400,5 kg\n"


def channel(code=HEAD, unit="g", samples="1.5\n-2\n3e1\n", **changed):
    """A channel file; a key that is None is left out."""
    fields = {
        "Channel code": code,
        "Unit": unit,
        "Reference channel": "implicit",
        "Time of first sample": "-0.01",
        "Sampling interval": "0.0001",
        "Number of samples": str(samples.count("\n")),
    }
    fields |= {k.replace("_", " "): v for k, v in changed.items()}
    head = "".join(f"{k:<28}:{v}\n" for k, v in fields.items() if v is not None)
    return head + samples


@pytest.fixture
def test_of(tmp_path):
    """Write a test of channels, with its index, and read it."""

    def write(*channels, mme=MME, index=True, folder="Channel", encoding="utf-8"):
        (tmp_path / "T1.mme").write_bytes(mme.encode(encoding))
        inner = tmp_path / folder if folder else tmp_path
        inner.mkdir(exist_ok=True)
        listed = [f"Number of channels :{len(channels)}"]
        for k, text in enumerate(channels, start=1):
            (inner / f"T1.{k:03d}").write_bytes(text.encode(encoding))
            code = next(x for x in text.splitlines() if x.lower().startswith("channel code"))
            listed.append(f"Name of channel {k:03d} :{code.partition(':')[2]} / words")
        if index:
            (inner / "T1.chn").write_text("\n".join(listed) + "\n")
        return read_crash_record(tmp_path)

    return write


def test_a_code_in_words():
    code = decode_mme(HEAD)
    assert (code.test_object, code.position, code.location) == ("vehicle 1", "front left", "head")
    assert code.fine == ("Hybrid III, mid-sized male",)
    assert (code.dimension, code.direction) == ("acceleration", "longitudinal, positive forward")
    assert (code.filter, code.quantity, code.axis) == ("CFC 1000", "acceleration", "x")
    assert code.body == "front left occupant's head"
    assert code.unknown == ()


@pytest.mark.parametrize(
    ("code", "body", "axis", "words"),
    [
        ("10VEHC0000CGACYC", "vehicle", "y", "CFC 180"),
        ("10ENGN0000TPACX0", "engine", "x", "unfiltered"),
        ("S0SLED000000ACXD", "vehicle", "x", "CFC 60"),
        # RED B keeps figures for signs that differ from those of SAE J211: no axis is known.
        ("10VEHC000000AC1P", "vehicle", "", "filtered before the sampler, above CFC 1000"),
        ("10VEHC000000ACRS", "vehicle", "", "special filter"),
        ("B0FBAR000000FOXX", "fixed barrier", "x", "no filter class"),
    ],
)
def test_bodies_axes_and_filters(code, body, axis, words):
    said = decode_mme(code)
    assert (said.body, said.axis, said.filter) == (body, axis, words)


@pytest.mark.parametrize(
    ("code", "vehicle", "body"),
    [
        ("20VEHC000000ACXC", "2", "vehicle"),
        ("10SILBLERE00ACXC", "1", "vehicle"),
        ("11SETR000000ACXC", "1", "vehicle"),
        ("10MSME000000ACXC", "1", "vehicle"),
        ("11SEAT000000ACXC", "1", "front left seat"),
        (HEAD, "1", "front left occupant's head"),
        ("M0MBARCG0000ACXC", "M", "vehicle"),
        ("M0DEFO000000ACXC", "M", "deformable element"),
        ("H0IMPA000000ACXC", "H", "vehicle"),
        ("B0FBAR000000ACXC", "", "fixed barrier"),
        ("D0HEAD000000ACXC", "", "head of the dummy or impactor"),
        # Nothing says that an unlisted part moves on its own, unless it belongs to a seat.
        ("10QQQQ000000ACXC", "1", "vehicle"),
        ("11QQQQ000000ACXC", "1", "front left 'QQQQ'"),
    ],
)
def test_the_object_and_its_body(code, vehicle, body):
    said = decode_mme(code)
    assert (said.vehicle, said.body) == (vehicle, body)


def test_a_redundant_sensor_is_at_the_point_of_the_primary_one():
    said = [decode_mme(f"10SILBLE{fine}00ACXC") for fine in ("00", "RD", "RE")]
    assert [s.point for s in said] == ["0SILBLE0000", "0SILBLE0000", "0SILBLERE00"]
    assert [s.redundant for s in said] == [False, True, False]


BARRIER = "M0MBARCG0000ACXC"


@pytest.mark.parametrize(
    ("codes", "objects", "own", "vehicle"),
    [
        # By the header of its channels; as the only object that is left; else by its letter.
        ((CAR, BARRIER), 3, "3", "3"),
        ((CAR, BARRIER), 2, None, "2"),
        ((CAR, BARRIER), 2, "M", "2"),
        ((CAR, BARRIER), 3, None, "M"),
        ((CAR, BARRIER), 1, None, "M"),
        ((CAR, BARRIER, "T0TIRS000000TI00"), 2, None, "M"),
        ((CAR, BARRIER, "00TIRS000000TI00"), 2, None, "2"),
        ((CAR, BARRIER), 2, "1", "2"),
        ((CAR, BARRIER, "B0FBAR000000FOXX"), 2, None, "M"),
        ((CAR, BARRIER, "S0SLED000000ACXD"), 2, None, "M"),
    ],
)
def test_the_number_of_a_mobile_barrier(test_of, codes, objects, own, vehicle):
    record = test_of(
        *(channel(c, Test_object_number=own if c == BARRIER else None) for c in codes),
        mme=f"Title :x\nNumber of test objects :{objects}\nName of test object 2 :trolley\n",
    )
    assert record.channel(BARRIER).vehicle == vehicle
    assert record.channel(CAR).vehicle == "1"
    assert record.vehicles == {"2": {"vehicle": "trolley"}}
    assert record.facts == {"title": "x", "number of test objects": str(objects)}


def test_two_objects_of_one_number_stay_two(test_of):
    sled = "S0SLED000000ACXD"
    record = test_of(*(channel(c, Test_object_number="2") for c in (BARRIER, sled)))
    assert len({record.channel(c).vehicle for c in (BARRIER, sled)}) == 2


def test_unknown_fields_are_shown_as_they_are():
    said = decode_mme("1_QQQQ00ZZH3ACXA".replace("_", "1"))
    assert said.location == "'QQQQ'"
    assert said.unknown == ("main location 'QQQQ'", "fine location 2 'ZZ'")
    assert decode_mme("102ABC000000ACXA").location == "the laboratory's own place 'ABC'"
    assert decode_mme("short") is None
    assert decode_mme("11HEAD0000H3ACX-") is None


def test_a_test_is_read_in_si_with_its_facts(test_of):
    record = test_of(channel(), channel(CAR, "deg/s"))
    assert (record.format, record.title) == ("mme", "A test: of two")
    assert float(record.vehicles["1"]["mass_kg"]) == 1400.5
    assert record.findings == ()
    time, values = record.channel(HEAD).load()
    np.testing.assert_array_equal(time, [-0.01, -0.0099, -0.0098])
    np.testing.assert_allclose(values, np.array([1.5, -2.0, 30.0]) * 9.80665, rtol=1e-15)
    rate = record.channel(CAR)
    assert (rate.quantity, rate.axis, rate.unit, rate.body) == ("rate", "z", "deg/s", "vehicle")
    np.testing.assert_allclose(rate.load()[1], np.radians([1.5, -2.0, 30.0]), rtol=1e-15)
    assert {p.name for p in record.files} == {"T1.mme", "T1.chn", "T1.001", "T1.002"}


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("m/(s*s)", "acceleration", 1.0),
        ("m/s²", "acceleration", 1.0),
        ("G", "acceleration", 9.80665),
    ],
)
def test_units_of_the_standard(test_of, unit, quantity, factor):
    read = test_of(channel(unit=unit)).channel(HEAD)
    assert (read.quantity, read.load()[1][0]) == (quantity, 1.5 * factor)


def test_stamps_are_the_decimals_of_the_header():
    # 0.1 + 0.2 in doubles is not 0.3; the header says tenths.
    np.testing.assert_array_equal(even_stamps("0.1", "0.1", 4), [0.1, 0.2, 0.3, 0.4])
    time = even_stamps("-0.05", "0.0001", 3500)
    np.testing.assert_array_equal(time, [float(f"{1e-4 * k:.4f}") for k in range(-500, 3000)])
    # Beyond what doubles hold exactly it is the plain sum.
    np.testing.assert_allclose(even_stamps("0", "1e-25", 3), [0.0, 1e-25, 2e-25], rtol=1e-15)


def test_files_as_other_systems_write_them(test_of):
    text = channel(samples="1,5\n NOVALUE \n-2,0D+1\n", Sampling_interval="0,0001")
    text = text.replace("Channel code  ", "CHANNEL CODE  ").replace("\n", "\r\n")
    text = text.replace("Unit", "Comments :Prüfling\r\nUnit")
    (channel_,) = test_of(
        text,
        mme="Laboratory name :Prüfstelle\r\n" + MME,
        index=False,
        encoding="latin-1",
        folder="CHANNEL",
    ).channels
    time, values = channel_.load()
    np.testing.assert_array_equal(values / 9.80665, [1.5, np.nan, -20.0])
    assert time[1] == -0.0099
    assert "Prüfling" in channel_.remarks


def test_channels_beside_the_header(test_of):
    assert len(test_of(channel(), folder="").channels) == 1


def test_stamps_of_another_channel(test_of):
    explicit = {
        "Reference_channel": "explicit",
        "Reference_channel_name": "10TIRS000000TI00",
        "Time_of_first_sample": None,
        "Sampling_interval": None,
    }
    stamps = channel("10TIRS000000TI00", "ms", samples="0\n1.5\n4\n", **explicit)
    record = test_of(stamps, channel(**explicit))
    time, _ = record.channel(HEAD).load()
    np.testing.assert_allclose(time, [0.0, 1.5e-3, 4e-3], rtol=1e-15)
    triad = triad_of_channels(record, {"x": HEAD}, quantity="acceleration")
    np.testing.assert_array_equal(triad.index, time)


@pytest.mark.parametrize(
    ("explicit", "words"),
    [
        ({"Reference_channel_name": "10TIRS000000TI00"}, "'10TIRS000000TI00', which the test does"),
        ({"Reference_channel_name": "NOVALUE"}, "which is not named"),
    ],
)
def test_stamps_that_are_not_there(test_of, explicit, words):
    with pytest.raises(DataError, match=words) as error:
        test_of(channel(Reference_channel="explicit", **explicit))
    assert error.value.finding.file == "T1.001"


def test_a_rate_where_the_header_has_none(test_of):
    record = test_of(channel(Sampling_interval="NOVALUE"))
    with pytest.raises(
        DataError, check=coded("io.sampling-interval-not-stated", quantity="sampling interval")
    ) as error:
        record.channel(HEAD).load()
    assert "rate_hz" in error.value.finding.remedy
    triad = triad_of_channels(record, {"x": HEAD}, quantity="acceleration", rate_hz=1e4)
    np.testing.assert_allclose(triad.index, [0.0, 1e-4, 2e-4], rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "words", "row"),
    [
        (channel(Number_of_samples="5"), "samples, and the header states", 9),
        (channel(Number_of_samples="2"), "samples, and the header states", 9),
        (channel(samples="1\nx y\n"), "' is not a number", 8),
        (channel(samples="1\n1_0\n"), "' is not a number", 8),
        (channel(samples="1\ninf\n"), "' is not a number", 8),
        (
            channel(samples="", Number_of_samples="NOVALUE"),
            "the file has a header and no samples",
            6,
        ),
        (channel(Sampling_interval="0"), "a sampling interval of", 5),
    ],
)
def test_damaged_channels_are_refused_with_their_row(test_of, text, words, row):
    (broken,) = test_of(text).channels
    with pytest.raises(DataError, match=words) as error:
        broken.load()
    assert error.value.finding.file == "T1.001"
    assert error.value.finding.row == row
    assert error.value.finding.remedy


def test_damaged_headers(test_of, tmp_path):
    with pytest.raises(DataError, check=coded("io.mme-line-not-understood")) as error:
        test_of("Channel code :x\nno colon here\n1\n")
    assert error.value.finding.row == 2
    record = test_of(channel(), mme="Title :x\nMass test object 1 :heavy\n")
    assert "left out: 'heavy' is not a number" in record.findings[0].what
    assert "mass_kg" not in record.vehicles.get("1", {})
    (tmp_path / "T2.mme").write_text(MME)
    with pytest.raises(
        DataError, match=r"test_damaged_headers0: the folder has 2 tests: T1\.mme, T2\.mme"
    ):
        read_crash_record(tmp_path)
    assert read_crash_record(tmp_path / "T1.mme").format == "mme"
    with pytest.raises(DataError, match="belong to other tests: T1"):
        read_crash_record(tmp_path / "T2.mme")


def test_facts_of_a_vehicle_are_in_si(test_of):
    stated = (
        "Velocity test object 1 :54 km/h\nMass test object 1 :3000 lb\nClass of test object 1 :M1\n"
    )
    record = test_of(channel(), mme=f"Title :x\n{stated}")
    assert record.vehicles == {"1": {"speed_m_per_s": "15", "class": "M1"}}
    (finding,) = record.findings
    assert (finding.code, finding.quantity) == ("io.left-out-unusable", "mass test object 1")


def test_failed_missing_and_renamed_channels_are_told(test_of, tmp_path):
    record = test_of(channel(Data_status="failed"), channel(CAR))
    assert "status as failed" in record.findings[0].what
    (tmp_path / "Channel" / "T1.002").unlink()
    index = tmp_path / "Channel" / "T1.chn"
    index.write_text(index.read_text().replace(HEAD, "11HEAD0000H3ACXC"))
    told = " ".join(str(f) for f in read_crash_record(tmp_path).findings)
    assert "1 of 2 listed channels are not in the folder: 002" in told
    assert "the index states 11HEAD0000H3ACXC" in told


def test_a_code_that_is_none_and_a_unit_against_the_code(test_of):
    record = test_of(channel("LEFT FRONT"), channel(unit="deg/s"))
    assert record.channel("LEFT FRONT").axis == ""
    assert "not a channel code of sixteen" in record.findings[0].what
    assert record.channel(HEAD).quantity == "rate"
    assert record.channel(HEAD).remarks[0].startswith("its code says acceleration")


def test_the_same_code_twice(test_of):
    record = test_of(channel(), channel(samples="7\n8\n"))
    assert [c.name for c in record.channels] == [HEAD, f"{HEAD} (2)"]
    assert record.channel(f"{HEAD} (2)").load()[1].size == 2


def test_links_that_lead_out_of_the_folder_are_not_followed(test_of, tmp_path):
    test_of(channel(), channel(CAR, "deg/s"))
    outside = tmp_path.parent / f"{tmp_path.name}-secret.txt"
    outside.write_text(channel("10VEHC000000ACXA"))
    inside = tmp_path / "Channel" / "T1.001"
    inside.unlink()
    inside.symlink_to(outside)
    record = read_crash_record(tmp_path)
    assert [c.name for c in record.channels] == [CAR]
    assert "link to a file outside" in record.findings[0].what


def test_hostile_texts_stay_texts(test_of):
    nasty = "<script>alert(1)</script>\x1b[2J\u202e" + "x" * 100_000
    record = test_of(
        channel(Comments=nasty, Name_of_the_channel=nasty), mme=f"Title :{nasty}\n{MME}"
    )
    (read,) = record.channels
    for text in (record.title, read.place, *read.remarks, *record.facts.values()):
        assert text.isprintable()
        assert len(text) <= 420
    # Markup is kept: it is for the page to escape it.
    assert "<script>" in record.title
