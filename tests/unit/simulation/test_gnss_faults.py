"""Faults of a receiver do what they say, to the rows that they are asked to, and to no others."""

from __future__ import annotations

import numpy as np
from tests.gnss_faults import (
    Frozen,
    GrowingBias,
    Outage,
    Outliers,
    WrongSd,
    inject_gnss_faults,
)

from strapdown.frames import place_difference
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, check_gnss, gnss_table

TIME = np.arange(0.0, 400.0, 0.5)
TABLE = gnss_table(
    TIME,
    np.column_stack([45.0 + 1e-5 * TIME, 20.0 + 0.0 * TIME, 80.0 + 0.0 * TIME]),
    np.column_stack([1.11 + 0.0 * TIME, 0.0 * TIME, 0.0 * TIME]),
    (0.5, 0.5, 1.0),
    (0.1, 0.1, 0.2),
    source="receiver",
)


def moved(table):
    return place_difference(table[GEODETIC].to_numpy(), TABLE[GEODETIC].to_numpy())


def test_an_outage_takes_rows_away():
    out = inject_gnss_faults(TABLE, [Outage(10.0, 20.0), Outage(100.0, 160.0)])
    gone = TABLE.index.difference(out.index).to_numpy()
    assert gone.tolist() == [*np.arange(10.0, 20.0, 0.5), *np.arange(100.0, 160.0, 0.5)]
    assert out.attrs["source"] == "receiver"


def test_outliers_are_as_many_and_as_large_as_asked_for():
    out = inject_gnss_faults(TABLE, [Outliers(share=0.1, size=50.0)], seed=1)
    off = moved(out)
    struck = np.abs(off[:, 0]) > 1.0
    # 800 fixes with 0.1: 80 with a standard deviation of 8.5.
    assert 80 - 4 * 8.5 < struck.sum() < 80 + 4 * 8.5
    # 25 m and 50 m; the metres are along one normal, 50 m of a curved Earth are 1e-4 m off.
    assert np.abs(np.abs(off[struck]) - [25.0, 25.0, 50.0]).max() < 1e-3
    assert np.abs(off[~struck]).max() < 1e-8
    again = inject_gnss_faults(TABLE, [Outliers(share=0.1, size=50.0)], seed=1)
    assert again.equals(out)
    assert not inject_gnss_faults(TABLE, [Outliers()], seed=2).equals(out)


def test_a_bias_grows_from_nothing_and_ends_with_its_interval():
    out = inject_gnss_faults(TABLE, [GrowingBias(100.0, 200.0, rate=(0.1, -0.2, 0.0))])
    off = moved(out)
    within = (TIME >= 100.0) & (TIME < 200.0)
    expected = np.where(within, TIME - 100.0, 0.0)[:, None] * [0.1, -0.2, 0.0]
    assert np.abs(off - expected).max() < 1e-4


def test_a_frozen_receiver_repeats_itself_with_stamps_that_go_on():
    out = inject_gnss_faults(TABLE, [Frozen(50.0, 60.0)])
    within = (TIME >= 50.0) & (TIME < 60.0)
    assert (out[within].to_numpy() == TABLE.to_numpy()[100]).all()
    assert out[~within].equals(TABLE[~within])
    assert (out.index == TABLE.index).all()
    check_gnss(out)


def test_a_wrong_precision_leaves_the_fixes():
    out = inject_gnss_faults(TABLE, [WrongSd(position_factor=1 / 3, velocity_factor=2.0)])
    np.testing.assert_allclose(out[POSITION_SD], TABLE[POSITION_SD] / 3.0, rtol=1e-15)
    np.testing.assert_allclose(out[VELOCITY_SD], TABLE[VELOCITY_SD] * 2.0, rtol=1e-15)
    assert out[[*GEODETIC, *VELOCITY]].equals(TABLE[[*GEODETIC, *VELOCITY]])
