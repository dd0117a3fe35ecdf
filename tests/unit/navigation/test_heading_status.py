"""The light of a heading: what makes it green, and what keeps it from that."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from strapdown.errors import ConfigError
from strapdown.navigation.heading_integrity import SURE, doubts_of, heading_status, recent_scatter
from strapdown.navigation.record import NavigationRecord

SECONDS = 200


@dataclass
class Heard:
    since: float
    time: np.ndarray
    difference: np.ndarray
    sd: np.ndarray
    kind: str = "motion"


def record_of(heading_sd, innovations=None):
    time = pd.Index(np.arange(SECONDS + 1.0), name="time")
    sd = pd.DataFrame({"heading": np.broadcast_to(heading_sd, len(time))}, index=time)
    nothing = pd.DataFrame(index=time)
    return NavigationRecord(
        trajectory=nothing,
        sd=sd,
        covariance=np.zeros((len(time), 9, 9)),
        sensors=nothing,
        sensors_sd=nothing,
        units={},
        innovations=innovations or {},
    )


def heard(difference, sd, begin=0, end=SECONDS):
    time = np.arange(begin + 1.0, end + 1.0)
    return Heard(
        float(begin), time, np.full(len(time), float(difference)), np.full(len(time), float(sd))
    )


def innovations(u, weight=1.0):
    time = pd.Index(np.arange(float(len(u))), name="time")
    return {
        "rtk.position": pd.DataFrame(
            {"nu north, m": u, "s north, m": 1.0, "weight north, m": weight}, index=time
        )
    }


def test_sure_is_99_of_100():
    assert pytest.approx(norm.ppf(0.995), rel=1e-12) == SURE


def test_a_good_bound_without_a_witness_is_amber():
    light = heading_status(record_of(0.1), [])
    assert light.share("unverified") == 1.0
    assert set(light.table["reason"]) == {"assumed"}


def test_green_begins_where_a_witness_bounds_the_error_below_the_limit():
    # 2.58 x 1.0 deg and a difference of 0.4 deg are 2.98 deg; with 0.5 they are beyond 3 deg.
    assert heading_status(record_of(0.1), [heard(0.4, 1.0)]).share("trusted") > 0.99
    assert heading_status(record_of(0.1), [heard(0.5, 1.0)]).share("trusted") == 0.0


def test_the_run_itself_must_say_so_too():
    light = heading_status(record_of(2.0), [heard(0.0, 0.1)])
    assert light.share("trusted") == 0.0
    assert set(light.table["reason"]) == {"wide"}
    assert heading_status(record_of(6.0), [heard(0.0, 0.1)]).share("rejected") == 1.0


def test_a_witness_that_contradicts_makes_it_red():
    light = heading_status(record_of(0.3), [heard(5.0, 1.0)])
    assert light.share("rejected") > 0.99
    assert light.spans[-1].reason == "apart"
    # One that knows nothing contradicts nothing.
    assert heading_status(record_of(0.3), [heard(5.0, 10.0)]).share("rejected") == 0.0


def test_what_a_witness_told_holds_for_a_minute_and_grows():
    # The variance of the run grows by 0.01 deg² each second from 100 s on.
    sd = np.sqrt(0.01 + 0.01 * np.maximum(np.arange(SECONDS + 1.0) - 100.0, 0.0))
    table = heading_status(record_of(sd), [heard(0.0, 0.2, end=100)]).table
    for after in (10, 40):
        expected = SURE * 0.2 + 2.0 * SURE * np.sqrt(0.01 * after)
        assert table["carried"].loc[100.0 + after] == pytest.approx(expected, rel=1e-9)
    # A minute, the last second of it too.
    assert np.isfinite(table["carried"].loc[160.0])
    assert np.isinf(table["carried"].loc[161.0])
    # 3 deg are reached where 0.515 + 5.15 x sqrt(0.01 t) = 3: after 23 s.
    assert table["status"].loc[123.0] == 0
    assert table["status"].loc[124.0] == 1


def test_an_update_takes_nothing_off_what_was_added():
    sd = np.where(np.arange(SECONDS + 1) % 2, 0.3, 0.1)
    table = heading_status(record_of(sd), [heard(0.0, 0.2, end=100)]).table
    assert (np.diff(table["carried"].loc[101.0:160.0]) >= 0.0).all()


def test_scatter_takes_green_away_and_single_outliers_do_not():
    rng = np.random.default_rng(4)
    u = rng.standard_normal(SECONDS)
    spoilt = u.copy()
    spoilt[[40, 90, 140]] = 50.0
    good, outlying, wide = (record_of(0.1, innovations(x)) for x in (u, spoilt, 3.5 * u))
    witness = [heard(0.0, 0.2)]
    for one, least, most in ((good, 0.99, 1.0), (outlying, 0.99, 1.0), (wide, 0.0, 0.1)):
        share = heading_status(one, witness, recent_scatter(one)).share("trusted")
        assert least <= share <= most


def test_observations_that_are_mostly_rejected_are_no_agreement():
    u = np.random.default_rng(5).standard_normal(SECONDS)
    weight = np.where(np.arange(SECONDS) % 4 < 3, 0.0, 1.0)
    scatter = recent_scatter(record_of(0.1, innovations(u, weight)))
    # Three of four count as three standard deviations each: sqrt(0.75 x 9 + 0.25) = 2.65.
    assert scatter[60:].min() > 2.0


def test_scatter_is_amber_beyond_two_and_red_beyond_three():
    for scatter, status in (
        (1.99, "trusted"),
        (2.01, "unverified"),
        (2.99, "unverified"),
        (3.01, "rejected"),
    ):
        spread = np.full(SECONDS + 1, scatter)
        light = heading_status(record_of(0.1), [heard(0.0, 0.2, begin=-1)], spread)
        assert light.share(status) == 1.0
        assert set(light.table["reason"]) == ({"scatter"} if scatter > 2.0 else {""})


def test_the_bound_of_a_second_is_that_of_the_mark_at_it_or_the_larger_one_beside_it():
    marks = pd.Index([0.0, 1.5, 3.0], name="time")
    record = record_of(0.1)
    sd = pd.DataFrame({"heading": [0.1, 0.5, 0.2]}, index=marks)
    light = heading_status(replace(record, sd=sd), [])
    # Beyond the last mark it is the last one's.
    expected = norm.ppf(0.975) * np.array([0.1, 0.5, 0.5, 0.2, 0.2])
    np.testing.assert_allclose(light.table["bound"].loc[:4.0], expected, rtol=1e-9)


def test_before_a_witness_has_told_anything_nothing_is_carried():
    table = heading_status(record_of(0.1), [heard(0.0, 0.2, begin=30)]).table
    assert np.isinf(table["carried"].loc[:30.0]).all()
    assert table["carried"].loc[31.0] == pytest.approx(SURE * 0.2)


def test_spans_cover_the_run():
    light = heading_status(record_of(0.1), [heard(0.0, 0.1, 50, 60)])
    assert light.spans[0].begin == 0.0
    assert light.spans[-1].end == SECONDS + 1.0
    assert all(a.end == b.begin for a, b in zip(light.spans, light.spans[1:], strict=False))


def test_limits_must_be_in_order():
    with pytest.raises(
        ConfigError,
        check=lambda refused: refused.finding.code == "evaluation.heading-limits",
    ):
        heading_status(record_of(0.1), [], trusted_below=5.0, rejected_beyond=3.0)


def test_a_run_is_doubted_from_when_a_witness_contradicts_it():
    one, late = record_of(0.1), heard(2.0, 0.1, begin=99)
    assert not doubts_of(one, 3.0)([late], 99.0)
    assert doubts_of(one, 3.0)([late], 100.0)
    # By less than half of the limit nothing is contradicted.
    assert not doubts_of(one, 3.0)([heard(1.4, 0.1)], 150.0)


def test_a_run_is_doubted_from_when_its_observations_scatter():
    u = np.where(np.arange(SECONDS + 1.0) < 100.0, 1.0, 3.9)
    one = record_of(0.1, innovations(u))
    assert not doubts_of(one, 3.0)([], 100.0)
    # Half a minute later they are all that is looked at.
    assert doubts_of(one, 3.0)([], 130.0)
    # What was doubted once stays so.
    u = np.where((np.arange(SECONDS + 1.0) < 100.0) | (np.arange(SECONDS + 1.0) > 130.0), 1.0, 3.9)
    assert doubts_of(record_of(0.1, innovations(u)), 3.0)([], 190.0)
