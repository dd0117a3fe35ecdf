"""Lines of a live run: what is read of them, and what is told of those that cannot be used."""

from __future__ import annotations

import pytest

from strapdown.live.lines import BadLineError, Measured, Sample, Word, parse_line

AIDS = ("gnss", "wheels")


def test_a_sample():
    said = parse_line(" imu , 1.25, 1e-3,0.002,-3, 0.1,0.2,-9.8 \r\n", AIDS)
    assert said == Sample(1.25, (1e-3, 0.002, -3.0, 0.1, 0.2, -9.8))


def test_what_an_aid_measured():
    said = parse_line("wheels,2.5,speed=10.5,speed_sd=0.1", AIDS)
    assert said == Measured("wheels", 2.5, {"speed": 10.5, "speed_sd": 0.1})


def test_a_command():
    assert parse_line("command,next", AIDS) == Word("next")


@pytest.mark.parametrize("text", ["", "   \r\n", "# a remark, with commas"])
def test_a_line_that_says_nothing(text):
    assert parse_line(text, AIDS) is None


def test_a_line_of_sensorstream():
    # Stamp; gyroscope 4; accelerometer 3; pressure 85, which is passed over.
    said = parse_line("88.1, 3, 0.1,0.2,9.8, 4, 0.01,0.02,0.03, 85, 1013.2", AIDS)
    assert said == Sample(88.1, (0.01, 0.02, 0.03, 0.1, 0.2, 9.8))


@pytest.mark.parametrize(
    ("text", "kind", "code"),
    [
        ("imu,1,2,3", "imu", "wrong-number-of-values"),
        ("imu,1,2,3,4,5,6,x", "imu", "not-a-finite-number"),
        ("imu,1,2,3,4,5,6,nan", "imu", "not-a-finite-number"),
        ("command", "command", "command-not-one-word"),
        ("wheels,2.5", "wheels", "measurement-incomplete"),
        ("wheels,2.5,speed", "wheels", "not-column-value"),
        ("wheels,2.5,speed=1,speed=2", "wheels", "column-repeated"),
        ("wheels,soon,speed=1", "wheels", "not-a-finite-number"),
        ("wheel,2.5,speed=1", "word", "unknown-line"),
        ("\ufffd\ufffd", "word", "unknown-line"),
        ("88.1, 4, 0.01,0.02,0.03", "sensorstream without a sensor", "sensorstream-without-sensor"),
        ("88.1, 4, 0.01,0.02", "sensorstream", "not-sensorstream"),
        ("88.1, 4, 0,0,nan, 3, 0,0,9.8", "sensorstream", "value-not-finite"),
    ],
)
def test_a_line_that_cannot_be_used(text, kind, code):
    with pytest.raises(BadLineError) as refused:
        parse_line(text, AIDS)
    assert refused.value.kind == kind
    assert refused.value.finding.code == f"live.{code}"
    assert refused.value.finding.remedy


def test_a_wrong_word_is_answered_with_the_nearest():
    with pytest.raises(BadLineError) as told:
        parse_line("wheel,2.5,speed=1", AIDS)
    assert "wheels" in told.value.finding.remedy


@pytest.mark.parametrize(
    ("said", "refused"),
    [
        ("lon=361", True),
        ("lon=-359", False),
        ("alt=1.1e8", True),
        ("alt=4e7", False),
        ("VN=1.1e5", True),
        ("VD=-9e4", False),
        ("speed=1.1e9", True),
        ("speed=9e8", False),
    ],
)
def test_a_value_that_cannot_be_is_refused(said, refused):
    if not refused:
        assert parse_line(f"gps,1,{said}", ["gps"]).values
        return
    with pytest.raises(BadLineError) as caught:
        parse_line(f"gps,1,{said}", ["gps"])
    assert (caught.value.kind, caught.value.finding.code) == ("gps value", "live.row-beyond-limit")
