"""Texts that are longer than what the types of their columns are told by."""

import numpy as np
import pytest

from strapdown.formats import csv
from strapdown.formats.text_columns import BLOCK, parsed

ROW = "{0},{0}.25,{1}\n"


def long_text(last: str, first: str = "0.5") -> bytes:
    rows = BLOCK // 16
    text = "".join(ROW.format(k, first) for k in range(rows))
    assert len(text) > BLOCK
    return (text + ROW.format(rows, last)).encode()


@pytest.mark.parametrize(("last", "first"), [("1.5", "0.5"), ("1.5", "7"), ("word", "0.5")])
def test_what_comes_late_in_a_column_counts_as_if_it_came_at_once(last, first):
    whole = parsed(long_text(last, first), 3, ",")
    end = parsed(f"{first}\n{last}\n".encode(), 1, ",")[0]
    assert whole[0].dtype == np.int64
    assert whole[1][-1] == len(whole[0]) - 1 + 0.25
    assert whole[2].dtype == end.dtype
    assert whole[2][-1] == end[-1]


def test_names_in_quotes_are_read_as_those_without(tmp_path):
    plain, quoted = tmp_path / "plain.csv", tmp_path / "quoted.csv"
    body = "".join(f"{k},{k}.5\n" for k in range(20))
    plain.write_text("t,gyro_x\n" + body)
    quoted.write_text('"t","gyro_x"\n' + body)
    one, other = csv.read(plain), csv.read(quoted)
    assert list(one.columns) == list(other.columns)
    for name in one.columns:
        np.testing.assert_array_equal(one.columns[name], other.columns[name])
