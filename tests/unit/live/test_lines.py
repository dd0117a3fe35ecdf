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
    ("text", "kind", "what"),
    [
        ("imu,1,2,3", "imu", "3 numbers follow imu"),
        ("imu,1,2,3,4,5,6,x", "imu", "'x' is no finite number"),
        ("imu,1,2,3,4,5,6,nan", "imu", "'nan' is no finite number"),
        ("command", "command", "one word"),
        ("wheels,2.5", "wheels", "follow wheels"),
        ("wheels,2.5,speed", "wheels", "'speed' is no column=value"),
        ("wheels,2.5,speed=1,speed=2", "wheels", "there twice"),
        ("wheels,soon,speed=1", "wheels", "'soon' is no finite number"),
        ("wheel,2.5,speed=1", "word", "'wheel' begins no line"),
        ("\ufffd\ufffd", "word", "begins no line"),
        ("88.1, 4, 0.01,0.02,0.03", "sensorstream without a sensor", "no sample"),
        ("88.1, 4, 0.01,0.02", "sensorstream", "blocks"),
        ("88.1, 4, 0,0,nan, 3, 0,0,9.8", "sensorstream", "not finite"),
    ],
)
def test_a_line_that_cannot_be_used(text, kind, what):
    with pytest.raises(BadLineError, match=what) as told:
        parse_line(text, AIDS)
    assert told.value.kind == kind
    assert told.value.remedy


def test_a_wrong_word_is_answered_with_the_nearest():
    with pytest.raises(BadLineError) as told:
        parse_line("wheel,2.5,speed=1", AIDS)
    assert "wheels" in told.value.remedy
