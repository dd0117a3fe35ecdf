"""Tables that are read at once are read as line by line."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.formats import csv
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
