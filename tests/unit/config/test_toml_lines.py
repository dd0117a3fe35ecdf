"""Lines of keys, against what tomllib reads of the same text."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))

from toml_documents import Document

from strapdown.config.toml_file import key_lines, line_of

EXAMPLE = """\
title = "a # b"  # comment
"quoted key" = 1
[vehicle]
mass_kg = 1400.0
position_m = [
  0.6,  # [forward]
  -0.5,
]
a.b . 'c.d' = 3

[[units]]
text = \"\"\"
[no.table]
no = 'key' \"\"\"
[[units]]
name = 'IMU2'
[[units.accelerometers]]
channels = { x = "1", y = { z = 2 } }
[[units.accelerometers]]
[units.gyro]
path = '''x'''
[other."de ep"]
"""


def leaves(node, path=()):
    if isinstance(node, dict | list):
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            yield from leaves(value, (*path, key))
    else:
        yield path, node


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 1),
        (("quoted key",), 2),
        (("vehicle",), 3),
        (("vehicle", "position_m"), 5),
        (("vehicle", "position_m", 1), 7),
        (("vehicle", "a"), 9),
        (("vehicle", "a", "b", "c.d"), 9),
        (("units",), 11),
        (("units", 0, "text"), 12),
        (("units", 1), 15),
        (("units", 1, "accelerometers", 0, "channels", "y", "z"), 18),
        (("units", 1, "accelerometers", 1), 19),
        (("units", 1, "gyro", "path"), 21),
        (("other",), 22),
        # Of what is not there, the line of what is around it.
        (("units", 1, "accelerometers", 0, "channels", "z"), 18),
        (("units", 1, "position_m"), 15),
        (("units", 7), 11),
    ],
)
def test_a_key_is_where_an_editor_shows_it(path, line):
    assert line_of(key_lines(EXAMPLE), path) == line


def test_what_is_in_no_table_has_no_line():
    assert line_of(key_lines(EXAMPLE), ("entry", "speed")) is None
    assert line_of(key_lines(""), ()) is None


@settings(max_examples=100, deadline=None)
@given(st.randoms(use_true_random=False))
def test_every_value_of_any_document_is_on_its_line(random):
    text = Document(random).text
    table = tomllib.loads(text)
    lines, rows = key_lines(text), text.split("\n")
    for path, value in leaves(table):
        mark = re.search(r"9\d{4}7", str(value))
        assert mark, (value, text)
        assert path in lines, (path, text)
        assert mark.group() in rows[lines[path][0] - 1], (path, text)
        keys = [part for part in path if isinstance(part, str)]
        at = max(k for k, part in enumerate(path) if isinstance(part, str))
        row = rows[lines[path[: at + 1]][0] - 1]
        escaped = keys[-1].replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
        assert keys[-1] in row or escaped in row, (path, text)


@settings(max_examples=100, deadline=None)
@given(st.randoms(use_true_random=False), st.integers(0, 400), st.text(max_size=5))
def test_text_that_is_no_toml_is_scanned_without_an_error(random, at, put):
    text = Document(random).text
    key_lines(text[:at] + put + text[at:])
    key_lines(text[:at])


def test_a_key_that_stands_twice_has_both_lines():
    lines = key_lines("a = 1\nb = 2\na = 3\n[t]\n[u]\n[t]\n")
    assert lines["a",] == [1, 3]
    assert lines["t",] == [4, 6]


@pytest.mark.parametrize(
    "text",
    [
        'a = """' + "x" * 10**6,
        "a = '''" + "'" * 10**6,
        "a = " + "[" * 10**4,
        "#" * 10**6,
        "= " * 10**5,
    ],
)
def test_long_text_takes_no_long_time(text):
    # A second would be quadratic: it is milliseconds.
    try:
        key_lines(text)
    except RecursionError:
        assert "[[" in text
