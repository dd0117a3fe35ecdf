"""Rows that grow: no value changes, and the newest grows in place."""

import numpy as np

from strapdown.navigation.record import GrowingRows


def test_every_value_keeps_its_rows():
    rng = np.random.default_rng(1)
    values = [GrowingRows.of(3)]
    rows = [np.empty((0, 3))]
    for _ in range(200):
        more = rng.normal(size=(rng.integers(0, 9), 3))
        k = int(rng.integers(len(values)))
        values.append(values[k].and_then(more))
        rows.append(np.vstack([rows[k], more]))
    for value, expected in zip(values, rows, strict=True):
        np.testing.assert_array_equal(value.rows, expected)


def test_the_newest_grows_in_place_and_gives_back_what_is_dropped():
    grown = GrowingRows.of(2).and_then(np.ones((10, 2)))
    further = grown.and_then(np.zeros((5, 2)))
    assert np.shares_memory(grown.rows, further.rows)
    branched = grown.and_then(np.full((5, 2), 7.0))
    assert (further.rows[10:] == 0.0).all() and (branched.rows[10:] == 7.0).all()
    left = further.without_first(12)
    assert left.count == 3 and not np.shares_memory(left.rows, further.rows)
