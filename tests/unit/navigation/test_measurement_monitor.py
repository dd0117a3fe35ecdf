"""What aids delivered, told while it comes: the same however the run is cut."""

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Innovations
from strapdown.navigation.pipeline import MeasurementMonitor
from strapdown.navigation.record import InnovationRecord, NavigationChunk


def seen(time, nu=0.5, weight=1.0, name="rtk.position"):
    ones = np.ones(3)
    return InnovationRecord(
        time, name, ("n", "e", "d"), Innovations(nu * ones, 4.0 * ones, weight * ones)
    )


def told(observations, end, cuts=(), late=()):
    """Events and outages of a run from 0 s that was cut at some times."""
    deliveries = MeasurementMonitor()
    state = deliveries.started(deliveries.begin(["rtk"]), 0.0)
    events, outages, first = [], [], -1.0
    for cut in (*cuts, end):
        part = tuple(one for one in observations if first < one.time <= cut)
        missed = tuple(("rtk", at) for at in late if first < at <= cut)
        piece = NavigationChunk(np.empty(0), np.empty((0, 10)), part, (), missed)
        state, more, ended = deliveries.process(state, piece, cut)
        events, outages, first = [*events, *more], [*outages, *ended], cut
    more, ended = deliveries.finish(state, end)
    return sorted([*events, *more], key=lambda one: (one.time, one.kind)), [*outages, *ended]


def test_an_outage_is_longer_than_three_of_the_aids_own_intervals():
    times = [1.0, 2.0, 3.0, 4.0, 7.0, 8.0, 11.5, 12.0, 13.0]
    events, outages = told([seen(t, 3.0) for t in times], 14.0)
    # 4 to 7 s is three intervals and none; 8 to 11.5 s is one.
    assert [(e.time, e.kind) for e in events] == [(11.0, "outage"), (11.5, "recovered")]
    assert events[1].finding.data["sd"] == pytest.approx(1.5)
    assert [(name, span.begin, span.end) for name, span in outages] == [("rtk", 8.0, 11.5)]


def test_an_outage_at_the_start_is_told_where_it_ends_and_one_at_the_end_stays_open():
    events, outages = told([seen(t) for t in (20.0, 21.0, 22.0)], 30.0)
    assert [(e.time, e.kind) for e in events] == [(25.0, "outage")]
    assert [(span.begin, span.end) for _, span in outages] == [(22.0, 30.0)]
    events, outages = told([], 30.0)
    assert events[0].finding.code == "navigation.event-never-observed"
    assert [(span.begin, span.end) for _, span in outages] == [(0.0, 30.0)]


def test_rejections_one_after_the_other_are_one_event():
    run = [seen(1.0), seen(2.0, 20.0, 0.0), seen(3.0, 30.0, 0.0), seen(4.0), seen(5.0, 9.0, 0.0)]
    events, _ = told(run, 6.0)
    assert [(e.time, e.kind) for e in events] == [(2.0, "rejected"), (5.0, "rejected")]
    assert events[0].finding.data == {
        "name": "rtk.position",
        "begin": 2.0,
        "end": 3.0,
        "count": 2,
        "largest": 15.0,
    }
    assert events[1].finding.code == "navigation.event-rejected-once"


def test_what_came_too_late_is_said_and_what_is_of_before_is_not():
    events, _ = told([seen(5.0), seen(6.0)], 7.0, late=(-0.5, 2.0, 3.0))
    assert [(e.time, e.kind) for e in events] == [(2.0, "late")]
    said = events[0].finding.data
    assert (said["count"], said["begin"], said["end"]) == (2, 2.0, 3.0)


@pytest.mark.parametrize("seed", range(5))
def test_cut_anywhere_it_is_the_same(seed):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.choice([1.0, 1.0, 1.0, 1.0, 8.0], 60))
    run = [seen(t, rng.normal(), float(rng.random() > 0.3)) for t in times]
    end = float(times[-1]) + 5.0
    cuts = np.sort(rng.uniform(0.0, end, 40))
    assert told(run, end) == told(run, end, tuple(cuts))


def test_two_aids_do_not_mix():
    deliveries = MeasurementMonitor()
    state = deliveries.started(deliveries.begin(["rtk", "wheel"]), 0.0)
    both = tuple(
        one for t in range(1, 9) for one in (seen(float(t)), seen(t + 0.5, name="wheel.speed"))
    )
    fewer = tuple(one for one in both if one.name != "rtk.position" or one.time < 3.0)
    piece = NavigationChunk(np.empty(0), np.empty((0, 10)), fewer, ())
    _, events, _ = deliveries.process(state, piece, 9.0)
    assert [(e.time, e.finding.data["name"]) for e in events] == [(5.0, "rtk")]


def test_what_means_nothing_is_refused():
    with pytest.raises(ConfigError, match="outage"):
        MeasurementMonitor(outage=1.0)
