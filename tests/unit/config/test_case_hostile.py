"""Files of any content: an error of ours, or a case, and never a traceback."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))

from good_case import TEXT, write

from strapdown.config.crash_case import CaseSpec
from strapdown.errors import ConfigError, StrapdownError

#: Longer messages would fill a screen.
LONGEST = 4000

LINES = TEXT.splitlines()
VALUES = [
    "0", "-1", "1e308", "-1e308", "nan", "inf", "1" + "0" * 400, "true", '""', '"x"', '"?"', "[]",
    "{}", "[[]]", "[1, 2, 3]", "[1, 2]", "[nan, 1, 2]", '["?"]', "[{}]", "{ x = 1 }", "1979-05-27",
    "07:32:00", '"\\u0000"', '"\\u202e"', "'''\nx\n'''", '"' + "x" * 5000 + '"', '".."', '"/"',
    '"~"', '"case.toml"', "[[1, 2], [3, 4], [5, 6]]", "[[1, 2], [1, 2], [1, 2]]",
    "[[0, 0], [1e200, 0], [0, 1e200]]",
]  # fmt: skip
KEYS = [
    "",
    "x",
    "name",
    "path",
    "speed",
    "speed_mph",
    "\x00",
    "é" * 300,
    "units",
    "entry",
    "[key]",
    "a.b",
]


@pytest.fixture(scope="module")
def folder():
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def read_whatever(folder: Path, content: bytes | str) -> None:
    path = write(folder)
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "replace"))
    try:
        spec = CaseSpec.read(path)
    except StrapdownError as error:
        assert len(str(error)) < LONGEST
        assert error.finding.remedy
        # What a terminal would obey is not passed on; the ends of lines are the message's own.
        assert all(char.isprintable() or char == "\n" for char in str(error)), str(error)
    else:
        assert isinstance(spec, CaseSpec)


@st.composite
def changed_files(draw):
    """The good case with a few lines taken away, doubled, moved, or given other keys or values."""
    lines = list(LINES)
    for _ in range(draw(st.integers(1, 4))):
        k = draw(st.integers(0, len(lines) - 1))
        what = draw(
            st.sampled_from(["value", "value", "value", "key", "drop", "double", "move", "put"])
        )
        key, equals, value = lines[k].partition(" = ")
        if what == "value" and equals:
            lines[k] = f"{key} = {draw(st.sampled_from(VALUES))}"
        elif what == "key" and equals:
            new = draw(st.sampled_from(KEYS)).replace("\x00", "\\u0000")
            lines[k] = f'"{new}" = {value}'
        elif what == "drop" and len(lines) > 1:
            lines.pop(k)
        elif what == "double":
            lines.insert(draw(st.integers(0, len(lines))), lines[k])
        elif what == "move":
            lines.insert(draw(st.integers(0, len(lines) - 1)), lines.pop(k))
        else:
            lines.insert(k, draw(st.text(max_size=20)))
    return "\n".join(lines)


@settings(max_examples=400, deadline=None)
@given(content=changed_files())
def test_a_changed_case_is_read_or_refused(folder, content):
    read_whatever(folder, content)


@settings(max_examples=200, deadline=None)
@given(at=st.integers(0, len(TEXT)), put=st.binary(max_size=8), cut=st.integers(0, 40))
def test_damaged_bytes_are_read_or_refused(folder, at, put, cut):
    content = TEXT.encode()
    read_whatever(folder, content[:at] + put + content[at + cut :])


@settings(max_examples=100, deadline=None)
@given(content=st.one_of(st.binary(max_size=200), st.text(max_size=200)))
def test_other_files_are_refused(folder, content):
    read_whatever(folder, content)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "title: the value is missing"),
        (b"\xff\xfe\x00t", "line 1: the file is not valid TOML: byte 0xff is not UTF-8"),
        (
            b"title = 'x'\nauthor = '\xe4'",
            "line 2: the file is not valid TOML: byte 0xe4 is not UTF-8",
        ),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "byte 0x89 is not UTF-8"),
        (b"PK\x03\x04" + b"\x00" * 50, "not valid TOML"),
        (b"a = " + b"[" * 20_000 + b"]" * 20_000, "nested too deep"),
        (b"a = " + b"{ a = " * 20_000 + b"1" + b"}" * 20_000, "nested too deep"),
        (b"a = " + b"[" * 100_000, "nested too deep"),
        (b"a." * 50_000 + b"a = 1", "nested too deep"),
        (b"[" + b"a." * 2_000 + b"a]", "nested too deep"),
        (b"x" * 1_000_000 + b" = 1", "unknown key"),
        (b"a = " + b"1" * 1_000_000, "not valid TOML"),
        (b"a = 1" + b"0" * 4_000, "unknown key"),
        (b"title = '" + b"x" * 1_000_000 + b"'", "1000000 characters"),
        (b"title" + b" " * 300_000 + b"= ", "not valid TOML"),
        (b"title = " + b"1," * 300_000, "not valid TOML"),
        (b"title = 'x'\n" * 2, "line 2, title: the key is repeated; it is in line 1 too"),
        (b"[entry]\n" * 3, "line 2, entry: the key is repeated; it is in line 1 too"),
        (b'"\\u001b[31m" = 1', "'\\x1b[31m': unknown key"),
    ],
)
def test_files_that_are_no_case_say_so_at_once(folder, content, words):
    path = write(folder)
    path.write_bytes(content)
    begin = time.perf_counter()
    with pytest.raises(ConfigError) as caught:
        CaseSpec.read(path)
    # They take tenths of a second; what grows with the square of its length would take minutes.
    assert time.perf_counter() - begin < 10.0
    assert words in str(caught.value)
    assert len(str(caught.value)) < LONGEST


def test_what_is_no_file_is_named(folder):
    for path, words in (
        (folder, "it is not a file"),
        (folder / "nothing.toml", "the file does not exist"),
        (folder / "a\x00b.toml", "the file does not exist"),
        (folder / ("x" * 300 + ".toml"), "does not exist|cannot be read"),
    ):
        with pytest.raises(ConfigError, match=words):
            CaseSpec.read(path)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads all")
def test_a_file_that_may_not_be_read_says_so(folder):
    path = write(folder)
    path.chmod(0)
    with pytest.raises(ConfigError, match="check its permissions"):
        CaseSpec.read(path)


def test_a_sensor_s_file_of_any_content_is_refused(folder):
    for content in (
        b"",
        b"\xff",
        b"a = " + b"[" * 20_000,
        b"[gyro]\nx = 1",
        b"a = " + b"1" * 9_999,
    ):
        (folder / "own.toml").write_bytes(content)
        path = write(folder, ('"mpu-6050"', '"own.toml"'))
        with pytest.raises(ConfigError) as caught:
            CaseSpec.read(path)
        assert "line 48, unit 1, gyro, sensor: 'own.toml'" in str(caught.value)
