"""A receiver and the inertial solution contradict each other: who is believed, and the bounds."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests import town_drive as town

from strapdown.estimation.robust import AdaptiveRule, AdaptiveScale, Igg3
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.recorder import record_of
from strapdown.systems.navigation_run import _with_offsets
from strapdown.tables import GEODETIC, VELOCITY, VELOCITY_SD


@dataclass(frozen=True)
class SimpleChain:
    """What of a pipeline an offset changes."""

    navigator: Navigator


RULE = AdaptiveRule(Igg3(), AdaptiveScale(lowest=1.0))
FAULT = np.array([20.0, -15.0, 8.0])


def faulty(begin, end):
    """Positions of a metre, of which those of a span are beside by the fault."""
    table = town.fixes(8601)
    bad = (table.index > begin) & (table.index < end)
    places = [geodetic_from_ned(FAULT, place) for place in table.loc[bad, GEODETIC].to_numpy()]
    table.loc[bad, GEODETIC] = places
    table[VELOCITY], table[VELOCITY_SD] = 0.0, np.inf
    return table


def test_fixes_that_jump_are_rejected_until_they_return():
    """Twenty seconds, forty fixes, of a wrong solution; ten were endured and then believed."""
    table = faulty(60.0, 80.0)
    outage = table[(table.index < 60.0) | (table.index > 80.0)]
    off = []
    for told in (table, outage):
        navigator, state = town.begun(town.gnss(rule=RULE))
        _, piece = town.run(navigator, state, told)
        within = (piece.time > 60.0) & (piece.time < 90.0)
        off.append(np.linalg.norm(town.off(piece)[within], axis=1).max())
        weights = [one.innovations.weight for one in piece.seen if 60.0 < one.time < 80.0]
        assert not np.any(weights)
    # As if there were no fixes; the fault is 26 m, and the drift without them 9 m.
    assert off[0] == pytest.approx(off[1], rel=0.05)


def jumps(values, sd=1.0, before=80, step=1.0):
    """Whether each of values after some good ones, `step` s apart, is where it jumped to."""
    scale, state, out = RULE.scale, RULE.scale.begin(), []
    for k, nu in enumerate([0.3] * before + values):
        time = step * k
        out.append(scale.is_away(state, nu, sd**2, time))
        usual = scale.rule(state, RULE.influence).influence.weight(nu / sd)
        weight = 0.0 if out[-1] else usual
        after = scale.after(state, nu, 0.01 * sd**2, sd**2, weight)
        state = scale.jumped(state, after, nu, time, 1.5 * (time - state.time) ** 2)
    return out[before:]


def test_a_jump_is_a_fault_and_a_growing_innovation_is_not():
    assert jumps([20.0] * 15) == [False] + [True] * 14
    # It returns: the first that does counts, and so do those after it.
    assert jumps([20.0, 20.0, 1.0, 20.0]) == [False, True, False, False]
    # An estimate that goes wrong has grown to where it is rejected, or grows on.
    assert not any(jumps([1.5 * 1.3**k for k in range(15)]))
    assert not any(jumps([20.0 * 1.6**k for k in range(15)])[2:])
    # Without good ones before, nobody knows who is wrong.
    assert not any(jumps([20.0] * 15, before=2))
    # For a minute at most.
    assert jumps([20.0] * 80) == [False] + [True] * 59 + [False] * 20


@pytest.mark.parametrize("step", [0.25, 1.0])
@pytest.mark.parametrize("before", [8, 24, 40])
def test_a_receiver_is_rejected_for_as_long_as_it_had_agreed(before, step):
    """A jump may end a fault that the estimate had followed: a wrong solution that drifted."""
    expected = [False] + [True] * (before - 1)
    assert jumps([20.0] * 60, before=before, step=step)[:before] == expected
    assert not any(jumps([20.0] * 60, before=before, step=step)[before:])
    # Gross errors that return do not count as a disagreement: the fault of 20 s is rejected.
    single = [30.0] + [0.3] * 10
    assert sum(jumps(single + [20.0] * 60, before=before, step=step)[len(single) :]) == (
        before + len(single) - 1
    )
    # Ten rejections that ended because the estimate went to them do: since then they have agreed.
    followed = [20.0] * 11 + [2.0] + [0.3] * 5
    assert sum(jumps([*followed, *[-20.0] * 60], before=3, step=step)[len(followed) :]) == 6


def test_a_contradiction_widens_all_that_a_correction_would_move():
    rule = AdaptiveRule(Igg3(), AdaptiveScale(lowest=1.0, doubt=1e-3))
    navigator, state = town.begun(town.gnss(rule=rule))
    _, piece = town.run(navigator, state, faulty(60.0, 80.0))
    record = record_of(navigator, [piece])
    own = {mark.time: mark.covariance for mark in piece.marks}
    nu = record.innovations["gnss.position"]
    rejected = nu[(nu.index > 60.0) & (nu["weight north, m"] == 0.0)]
    times = [t for t in own if 61.0 < t < 64.0]
    assert len(times) > 3
    added = np.array([record.covariance[list(record.sd.index).index(t)] - own[t] for t in times])
    for P, more in zip((own[t] for t in times), added, strict=True):
        moved = [
            float(rejected[f"nu {label}, m"].iloc[:10].abs().max()) * P[:, k] / P[k, k]
            for k, label in enumerate(("north", "east", "down"))
        ]
        # The three components contradict alike; each adds what its correction would move.
        expected = sum(np.outer(one, one) for one in moved)
        assert np.trace(more[3:6, 3:6]) > 0.5 * np.trace(expected[3:6, 3:6])
        assert np.trace(more[6:8, 6:8]) > 0.5 * np.trace(expected[6:8, 6:8])
        assert np.linalg.eigvalsh(more).min() > -1e-9 * np.trace(more)


@pytest.mark.parametrize(
    ("error", "sd", "offset"), [(0.09, 0.004, -0.19), (0.09, 0.04, None), (0.04, 0.001, None)]
)
def test_a_run_begins_again_with_a_large_offset(error, sd, offset):
    navigator, _ = town.begun(town.gnss(time_offset=-0.1, time_offset_sd=0.2))
    chain = SimpleChain(navigator)
    name = "gnss.time_offset_t"
    record = SimpleNamespace(
        sensors=pd.DataFrame({name: [0.0, error]}), sensors_sd=pd.DataFrame({name: [0.2, sd]})
    )
    after, findings = _with_offsets(chain, record)
    if offset is None:
        assert after is chain
        assert not findings
    else:
        assert after.navigator.aids[0].time_offset == pytest.approx(offset)
        assert [one.code for one in findings] == ["navigation.run-again-with-offset"]
        assert math.isclose(findings[0].data["offset"], offset)
