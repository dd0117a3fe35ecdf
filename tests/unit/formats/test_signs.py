"""Signs of formats: what they see of a file, and that no text makes them slow."""

from __future__ import annotations

import json
import time

import pytest

from strapdown.formats import READERS, reader_of, readers_of
from strapdown.formats.signs import HEAD, Signs, json_beginning


def test_signs_of_a_file_and_of_a_folder(tmp_path):
    path = tmp_path / "A.LOG"
    path.write_bytes(b"\xef\xbb\xbfmade by me\n1 2 3\n\0binary magic")
    assert Signs(named=(".log",))(path)
    assert not Signs(named=(".txt",))(path)
    assert Signs(suffixes=(".log",), text=r"^1 2")(path)
    assert not Signs(suffixes=(".txt",), text=r"^1 2")(path)
    assert Signs(text=r"\Amade by")(path)
    assert not Signs(text="magic")(path)  # text ends at the first zero byte
    assert Signs(first=rb"me.1 2")(path)
    assert not Signs(first=rb"\Amade")(path)
    assert Signs(text="made", also=lambda p: p == path)(path)
    assert not Signs(text="made", also=lambda p: False)(path)
    assert not Signs(text="made", folder=lambda p: True)(tmp_path / "none")
    assert not Signs(text="made")(tmp_path)
    assert Signs(folder=lambda p: p == tmp_path)(tmp_path)
    assert not Signs(folder=lambda p: True)(path)
    assert Signs(inside="a.l*")(tmp_path)
    assert not Signs(inside="*.txt")(tmp_path)
    path.with_suffix(".zip").write_bytes(b"PK")
    assert Signs(folder=lambda p: True, zipped=True)(path.with_suffix(".zip"))
    path.write_text("made by me\n", encoding="utf-16")
    assert Signs(text=r"\Amade by")(path)
    path.write_text(f"{' ' * HEAD}made")
    assert not Signs(text="made")(path)


def test_a_sign_that_breaks_is_none(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("time,gx\n0,1\n1,2\n")

    def breaks(path):
        raise ValueError("broken")

    monkeypatch.setitem(READERS, "px4", READERS["csv"].__class__("broken", breaks, {}))
    assert reader_of(path)[0] == "csv"


@pytest.mark.parametrize(
    "unit",
    [
        *(
            " ",
            "\n",
            "\r",
            "\t",
            ",",
            ", ",
            "1",
            "1 ",
            "1,",
            "a ",
            '"',
            "%",
            "#",
            "# ",
            "$G",
            "\xb5b",
        ),
        *(
            "\n ",
            "\n,",
            "0.1 1 0 ",
            "% GPST ",
            "\n% GPST",
            "1:00:",
            "\xa3\x95\x80",
            "\n1 2 3 4 5 6 7",
        ),
    ],
)
def test_no_text_is_slow_to_recognize(tmp_path, unit):
    """Nothing grows with the square of the length: 64 kB of the same would take minutes."""
    path = tmp_path / "a.txt"
    path.write_bytes((unit * HEAD).encode("latin-1")[:HEAD])
    started = time.process_time()
    list(readers_of(path))
    assert time.process_time() - started < 2.0


def test_of_json_that_was_cut_there_is_all_before_the_cut():
    value = {"name": 'a, {b] \\ "c"', "t": [0.0, -1e-3, None], "imu": [{"x": 1}, {"x": [2, []]}]}
    text = json.dumps(value)
    assert json_beginning(text + '\n{"x": 1}') == (value, len(text))
    for end in range(1, len(text)):
        part, length = json_beginning(text[:end])
        assert length == 0
        assert list(part) == list(value)[: len(part)]
        assert part.get("t", []) == value["t"][: len(part.get("t", []))]
    assert json_beginning(text[:-3] + "nonsense")[0]["imu"][0] == {"x": 1}
    for other in ("", "x", '"word"', "[INFO] a, b", "{a: 1}"):
        assert not json_beginning(other)[0]
    assert json_beginning("[" * 100_000) == (None, 0)
