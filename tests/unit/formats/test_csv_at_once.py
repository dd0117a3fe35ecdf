"""Tables that are read at once are read as line by line."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.formats import csv
from strapdown.formats.arrays import as_rows
from strapdown.formats.assemble import assemble
from strapdown.formats.recording import ReadOptions
from strapdown.formats.text_columns import single_blanks

ROWS = [[f"{0.01 * k:.2f}", f"{k / 7:.12f}", f"-{k * 1e-7 / 3!r}", str(k)] for k in range(50)]


def texts():
    blanks = [" ".join(r) for r in ROWS]
    commas = [",".join(r) for r in ROWS]
    yield "blanks", "\n".join(blanks) + "\n", True
    yield "runs of blanks", "\n".join(f"   {'  '.join(r)}  " for r in ROWS) + "\n", True
    yield "tabs", "\n".join("\t".join(r) for r in ROWS) + "\n", True
    yield "CR LF", "\r\n".join(blanks) + "\r\n", True
    yield "commas", "a,b,c,d\n" + "\n".join(commas) + "\n", True
    yield "a comment and a header", "# made by x\na,b,c,d\n" + "\n".join(commas) + "\n", True
    yield "names in a comment", "# a,b,c,d\n" + "\n".join(commas) + "\n", True
    yield "a blank line above", "\n\na,b,c,d\n" + "\n".join(commas) + "\n", True
    yield "missing values", "a,b,c,d\n" + "\n".join([*commas, "1,,nan,4"]) + "\n", True
    yield "words", "a,b,c,d\n" + "\n".join([*commas, "1,stop,3,4"]) + "\n", True
    yield "dates", "t,b\n" + "".join(f"2024-01-01T00:00:{k:02d},1\n" for k in range(50)), True
    yield "no end", "\n".join(blanks), False
    yield "blank lines", "\n\n".join(commas) + "\n", False
    yield "quotes", "\n".join(",".join(f'"{f}"' for f in r) for r in ROWS) + "\n", False
    yield "hexadecimal", "\n".join([*commas, "1,2,3,0xFF"]) + "\n", False
    yield "decimal commas", "\n".join(b.replace(".", ",") for b in blanks) + "\n", False
    yield "a field that is missing", "\n".join([*blanks, "1  3 4"]) + "\n", False


@pytest.mark.parametrize(("what", "text", "fast"), list(texts()), ids=[t[0] for t in texts()])
def test_both_ways_agree(what, text, fast):
    at_once = csv._at_once(text.encode(), "x", ())
    assert (at_once is not None) == fast
    if what == "a field that is missing":
        return
    one_by_one = csv._line_by_line(text.encode(), "x", ())
    read = csv.parse(text.encode(), "x", ())
    assert list(read.columns) == list(one_by_one.columns)
    assert np.array_equal(read.rows, one_by_one.rows)
    assert read.findings == one_by_one.findings
    for name, column in one_by_one.columns.items():
        assert read.columns[name].dtype == column.dtype
        assert np.array_equal(read.columns[name], column, equal_nan=column.dtype.kind == "f")


def test_numbers_are_the_nearest_doubles():
    rng = np.random.default_rng(7)
    texts = [[f"{v:.{d}f}" for v in rng.normal(0, 10.0 ** (d % 7), 400)] for d in range(1, 18)]
    body = "\n".join(" ".join(r) for r in zip(*texts, strict=True)) + "\n"
    log = csv._at_once(body.encode(), "x", ())
    for column, written in zip(log.columns.values(), texts, strict=True):
        assert column.tolist() == [float(t) for t in written]


@pytest.mark.parametrize("run", [1, 2, 3, 5, 15, 16, 17, 64, 255, 1000])
def test_runs_of_blanks(run):
    gap = b" " * run
    assert single_blanks(gap + b"a" + gap + b"b" + gap + b"\n" + gap + b"c\n") == b"a b\nc\n"


def test_between_blanks_a_quote_is_a_letter():
    log = csv.parse(b'4.5 5 6\n1 "2 3\n', "x", ())
    assert log.columns["column 2"].tolist() == ["5", '"2']


def logs():
    names = [f"{s}_{a}" for s in ("gyro", "accel") for a in "xyz"]
    forward = ["t", *names]
    yield "gyro first", forward, True
    yield "accelerometer first", ["t", *names[3:], *names[:3]], True
    yield "axes mixed", ["t", *(names[k] for k in (2, 4, 0, 5, 1, 3))], False
    yield "a column between", ["t", *names[:3], "temperature", *names[3:]], False
    yield "the time between", [*names[:3], "t", *names[3:]], False


@pytest.mark.parametrize(("what", "order", "together"), list(logs()), ids=[n[0] for n in logs()])
@pytest.mark.parametrize("lost", [False, True])
def test_a_table_takes_the_memory_of_its_log(tmp_path, monkeypatch, what, order, together, lost):
    """Whatever the order of its columns, and where rows are left out."""
    monkeypatch.setitem(assemble.__globals__, "AT_ONCE", 700)
    rng, n = np.random.default_rng(5), 3000
    columns = {name: rng.normal(0.0, 30.0, n) for name in order}
    columns["accel_z"] += 9.8
    columns["t"] = 0.01 * np.arange(n) + 5e-4 * rng.random(n)
    if lost:
        columns["t"][1700] = columns["t"][1699]
    path = tmp_path / "log.csv"
    rows = zip(*(columns[name].tolist() for name in order), strict=True)
    text = "\n".join(",".join(map(repr, row)) for row in rows)
    path.write_text(",".join(order) + "\n" + text + "\n")
    raw = csv.read(path)
    held = raw.columns["gyro_x"].base
    options = ReadOptions(gyro_unit="deg/s", accel_unit="m/s2", axes="y,-x,z", repair=lost)
    before = {name: raw.columns[name].copy() for name in order}
    assemble(raw, options, keep=True)
    for name in order:
        np.testing.assert_array_equal(raw.columns[name], before[name])
    imu = assemble(raw, options).imu
    kept = np.delete(np.arange(n), 1700) if lost else np.arange(n)
    for triad, factor in (("gyro", np.pi / 180.0), ("accel", 1.0)):
        for axis, (source, sign) in zip("xyz", (("y", 1.0), ("x", -1.0), ("z", 1.0)), strict=True):
            wanted = columns[f"{triad}_{source}"][kept] * (sign * factor)
            np.testing.assert_array_equal(imu[f"{triad}_{axis}"], wanted)
    np.testing.assert_array_equal(imu.index, columns["t"][kept])
    assert np.shares_memory(held, imu["gyro_x"].to_numpy()) == (together and not lost)


def test_columns_are_rows_of_one_array_only_where_they_are():
    block = np.arange(24.0).reshape(4, 6).copy()
    one, two, three = block[1, :5], block[2, :5], block[3, :5]
    np.testing.assert_array_equal(as_rows([one, two, three]), block[1:, :5])
    assert np.shares_memory(as_rows([one, two]), block)
    elsewhere = np.arange(24.0).reshape(4, 6).copy()
    locked = block.copy()
    locked.flags.writeable = False
    for parts in (
        [one, three],
        [two, one],
        [one, elsewhere[2, :5]],
        [one, block[2, 1:]],
        [one, block[2, :4]],
        [block[:, 0], block[:, 1]],
        [locked[0], locked[1]],
        [one.astype(np.float32), two.astype(np.float32)],
        [one.copy(), two.copy()],
    ):
        assert as_rows(parts) is None


def test_a_table_is_written_part_by_part(tmp_path, monkeypatch):
    rng = np.random.default_rng(2)
    columns = {"t": np.arange(1000) * 0.01, "x": rng.normal(size=1000), "n": np.arange(1000)}
    csv.write(tmp_path / "whole.csv", columns, {"made": "here"})
    monkeypatch.setattr(csv, "WRITTEN", 7)
    csv.write(tmp_path / "parts.csv", columns, {"made": "here"})
    assert (tmp_path / "parts.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    csv.write(tmp_path / "none.csv", {"t": np.empty(0)}, {})
    assert (tmp_path / "none.csv").read_text() == "t\n"
