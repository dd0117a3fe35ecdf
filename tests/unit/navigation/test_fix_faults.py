"""A receiver and the inertial solution contradict each other: who is believed, and the bounds."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests import town_drive as town

from strapdown.dsp.chi_square import plane_bound
from strapdown.errors import DataError
from strapdown.estimation.robust import HUBER, AdaptiveRule, AdaptiveScale, Igg3
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.heading_checks import _known
from strapdown.navigation.measurements.clock_windows import unsure_steps
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.recorder import FullRecorder, _contradictions, record_of
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.navigation.truth_comparison import compare_with_truth
from strapdown.systems import navigation_run
from strapdown.systems.navigation_run import (
    ASSUMED,
    CONTINUED,
    STEPS_OF_OFFSET,
    _with_known_offsets,
    _with_offsets,
    _with_settled_offsets,
)
from strapdown.tables import GEODETIC, VELOCITY, VELOCITY_SD

#: What of a trajectory says that nothing swings.
AT_REST = pd.DataFrame({"VN": 0.0, "VE": 0.0, "VD": 0.0}, [0.0, 1.0])


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


@pytest.mark.parametrize(("gap", "refused"), [(4.0, 2), (3.0, 10)])
def test_an_error_that_an_outage_can_have_made_is_taken_off_after_few_fixes(gap, refused):
    """With 3 m/s² a solution goes 24 m wrong in four seconds, and in three no more than 13.5 m."""
    scale, state, rejected = RULE.scale, RULE.scale.begin(), 0
    for k in range(12):
        state = scale.jumped(state, scale.after(state, 0.3, 1.0, 1.0), 0.3, float(k), 1.5)
    for k in range(15):
        time = 11.0 + gap + k
        update = scale.rule(state, RULE.influence)
        weight = update.influence.weight(20.0 / 1.5)
        rejected += weight == 0.0
        if weight > 0.0:
            break
        after = scale.after(state, 20.0, 1.0, 1.0, weight)
        state = scale.jumped(state, after, 20.0, time, 1.5 * (time - state.time) ** 2)
    assert update.influence == HUBER
    assert rejected == refused


@pytest.mark.parametrize(("taken", "spans"), [(0.9, [(50.0, 56.0, 1.0, 56.0, None)]), (0.1, [])])
def test_after_few_rejections_a_receiver_is_a_part_of_the_bound_until_it_has_settled(taken, spans):
    """Ten observations of half a second from the first that was taken; none if it came back."""
    time, nu, rejected = 0.5 * np.arange(400), np.zeros(400), np.zeros(400, bool)
    nu[100:103], rejected[100:103], nu[103] = 1.0, True, taken
    assert list(_contradictions(time, nu, rejected, 10)) == spans


@pytest.mark.parametrize("taken", [2, 3])
def test_fixes_that_are_taken_after_an_outage_confirm_the_solution(taken):
    """A fault that begins then is the receiver's, for a minute or until it jumps back."""
    time, nu, rejected = 0.5 * np.arange(400.0), np.zeros(400), np.zeros(400, bool)
    time[100:] += 10.0
    wrong = slice(100 + taken, 120 + taken)
    nu[wrong], rejected[wrong], nu[wrong.stop] = 0.8, True, 0.8
    ((begin, end, size, _, since),) = _contradictions(time, nu, rejected, 10)
    assert (begin, size) == (time[wrong.start], 0.8)
    last = time[wrong.stop - 1]
    if taken == 2:  # position and velocity; the next shows what they hide
        assert (end, since) == (last + 0.5 * 10, time[99])
    else:
        assert (end, since) == (last + 60.0, None)


def test_a_receiver_that_returns_for_a_moment_is_doubted_as_it_was():
    """Between a float and a fixed solution it goes back and forth: each return was a new start."""
    step, away = 0.1, [20.0] * 15
    flicker = [*away, 1.0, 1.0, *away, 1.0, *away]
    told = jumps(flicker, before=100, step=step)
    # The first of each stretch is rejected by its size alone.
    firsts = {0, 17, 33}
    assert [k for k, v in enumerate(flicker) if v == 20.0 and not told[k]] == sorted(firsts)
    # Never for longer than it had agreed: ten seconds, and what is held is not begun anew.
    long = jumps(flicker * 4, before=40, step=step)
    assert not any(long[40:])
    # It returns beyond the estimate, which did not go to it.
    beyond = jumps([*[40.0] * 3, -22.0, *[0.3] * 6, *[40.0] * 15], sd=5.0, before=100, step=step)
    assert all(beyond[11:])


def test_a_jump_after_a_minute_does_not_end_the_contradiction_before_it():
    time = 0.5 * np.arange(400)
    nu, rejected = np.zeros(400), np.zeros(400, bool)
    for first, size in ((100, -1.0), (240, 1.1)):  # 70 s apart, and as if it were the way back
        nu[first : first + 20], rejected[first : first + 20] = size, True
        nu[first + 20] = size
    (begin, end, size, *_), (again, until, later, *_) = _contradictions(time, nu, rejected, 10)
    assert (begin, size) == (50.0, 1.0)
    assert end == pytest.approx(59.5 + 60.0)
    assert (again, later) == (120.0, 1.1)
    assert until == pytest.approx(129.5 + 60.0)


@pytest.mark.parametrize("push", [1.0, 3.0])
def test_a_smoothed_bound_covers_the_outage_after_which_fixes_were_rejected(push):
    """The vehicle moves otherwise than the IMU: 1 m/s in 2 s of an outage, thrice what is stated.

    The fixes after it are rejected, and then believed; they tell how the outage was.
    """
    begin, end = 60.0, 75.0
    plain, state = town.begun(town.gnss(rule=RULE))
    navigator = replace(plain, smoother=RauchTungStriebel())
    table = town.fixes(position_noise=0.05, velocity_noise=0.03)
    table = table[(table.index < begin) | (table.index > end)]
    time, rows = town.increments()
    rows = rows.copy()
    rows[(time > begin + 4.0) & (time <= begin + 6.0), 4] += push / 100.0
    state = navigator.tell(navigator.begin_from(state.engine.filter), "gnss", table)
    state, piece = navigator.advance(state, time, rows)
    tape, smoothing = FullRecorder().begin(navigator), navigator.smoother.begin(navigator)
    for one in (piece, navigator.finish(state)):
        tape.take(one)
        smoothing.take(one)
    record = tape.record(smoothing=smoothing)
    weight = record.innovations["gnss.position"].filter(like="weight")
    assert (weight[(weight.index > end) & (weight.index < end + 0.9)].min(axis=1) == 0.0).all()
    truth = town.motion().trajectory(time)
    found = compare_with_truth(record.trajectory, record.sd.index, record.covariance, truth)
    error, bound = np.hypot(*found.errors[:, :2].T), plane_bound(found.covariance)
    about = (found.time > begin) & (found.time < end + 5.0)
    # By the model the error was 14 to 50 bounds. It is divided over the outage by the noise of the
    # model, and the push was in two seconds of it: a factor in size, not in shape.
    assert (error[about] < 2.0 * bound[about]).all()
    assert np.mean(error[about] < bound[about]) > 0.6
    # Where fixes are believed again it does not jump up: it was 13 m and more for two epochs.
    until = bound[(found.time > begin) & (found.time < end)].max()
    assert bound[(found.time > end) & (found.time < end + 3.0)].max() < 1.2 * until


def stepped(by, begin=60.0, end=75.0):
    """Exact positions with an outage in which the receiver's clock steps."""
    table = town.fixes(77, position_noise=0.02, rate=5.0)
    table = table[(table.index < begin) | (table.index > end)]
    table[VELOCITY], table[VELOCITY_SD] = 0.0, np.inf
    stamps = table.index.to_numpy()
    table.index = pd.Index(np.where(stamps > begin, stamps + by, stamps), name="time")
    return table[table.index < 110.0]


def test_a_clock_may_step_in_an_outage():
    """10 m/s and 0.17 s: the positions after it are 1.7 m beside, and contradict nothing."""
    worst = []
    for unsure in ((), ((67.0, 0.2),)):
        aid = town.gnss(rule=RULE, time_offset_sd=0.01, clock_unsure=unsure)
        navigator, state = town.begun(aid)
        _, piece = town.run(navigator, state, stepped(0.17))
        record = record_of(navigator, [piece])
        at = np.minimum(np.searchsorted(piece.time, record.sd.index), len(piece.time) - 1)
        ratio = town.off(piece)[at] / record.sd[["north", "east", "down"]].to_numpy()
        after = (piece.time[at] > 75.2) & (piece.time[at] < 110.0)
        worst.append(float(np.abs(ratio[after, :2]).max()))
        found = record.sensors["gnss.time_offset_t"].loc[109.0:110.0].iloc[0]
    assert worst[0] > 5.0
    assert worst[1] < 4.0
    # The bend after the outage tells the step: assumed less true.
    assert found == pytest.approx(-0.17, abs=0.02)
    # An independent solution takes the last offset as known.
    checks = _known(aid, record, robust=False)
    assert checks.time_offset == -record.sensors["gnss.time_offset_t"].iloc[-1]
    assert checks.states() == () == checks.clock_unsure


def test_stamps_that_change_over_an_outage_tell_of_a_step():
    (at, sd), *more = unsure_steps(stepped(0.17))
    assert not more
    assert at == pytest.approx(67.5, abs=0.3)
    assert sd == pytest.approx(0.2)
    assert unsure_steps(stepped(0.0)) == []
    # A receiver that goes on with its multiples may have lost fixes only.
    assert unsure_steps(stepped(0.2)) == []


def late(seed, offset):
    """Positions that know the place to 2 cm, stamped late."""
    table = town.fixes(seed, position_noise=0.02)
    table[VELOCITY], table[VELOCITY_SD] = 0.0, np.inf
    table.index = pd.Index(table.index.to_numpy() + offset, name="time")
    return table[(table.index > 0.5) & (table.index < 50.0)]


def test_a_run_begins_again_with_a_known_offset():
    """Before the first bend an unknown offset is a displacement, at 10 m/s."""
    before, after, inside = [], [], []
    for seed in range(2):
        offset = float(np.random.default_rng(seed).normal(0.0, 0.08))
        table = late(500 + seed, offset)
        navigator, state = town.begun(town.gnss(time_offset_sd=0.08))
        first = town.run(navigator, state, table)[1]
        record = record_of(navigator, [first])
        again, findings = _with_known_offsets(SimpleChain(navigator), record, {"gnss": table})
        assert [one.code for one in findings] == ["navigation.run-again-with-known-offset"]
        (aid,) = again.navigator.aids
        sd = float(record.sensors_sd["gnss.time_offset_t"].iloc[-1])
        assert aid.time_offset_sd == pytest.approx(ASSUMED * sd)
        assert abs(aid.time_offset - offset) < 4.0 * sd
        fresh, state = town.begun(aid)
        ours = again.navigator.filter.model
        np.testing.assert_array_equal(ours.stacked.sd, fresh.filter.model.stacked.sd)
        second = town.run(again.navigator, state, table)[1]
        found = record_of(again.navigator, [second])
        at = np.minimum(np.searchsorted(second.time, found.sd.index), len(second.time) - 1)
        ratio = town.off(second)[at] / found.sd[["north", "east", "down"]].to_numpy()
        inside.append(np.abs(ratio[found.sd.index < 50.0]).max())
        for sds, one in ((before, record), (after, found)):
            sds.append(np.hypot(one.sd["north"], one.sd["east"]).loc[2.0:4.0].max())
    assert min(before) > 0.5
    assert max(after) < 0.2
    assert max(inside) < 5.0


@pytest.mark.parametrize("what", ["worth", "stepped", "little", "slow", "unsure"])
def test_an_offset_that_changed_or_hardly_matters_is_left(what):
    unsure = ((30.0, 0.2),) if what == "unsure" else ()
    aid = town.gnss(time_offset=-0.1, time_offset_sd=0.1, clock_unsure=unsure)
    navigator, _ = town.begun(aid)
    error, sd = np.linspace(0.0, 0.01, 61), np.linspace(0.1, 0.004, 61)
    if what == "stepped":
        error[10:30], sd[10:30] = 0.09, 0.005
    if what == "little":
        sd[:] = np.linspace(0.1, 0.06, 61)
    time = pd.Index(np.arange(61.0), name="time")
    name = "gnss.time_offset_t"
    speed = 0.1 if what == "slow" else 10.0
    record = SimpleNamespace(
        sensors=pd.DataFrame({name: error}, time),
        sensors_sd=pd.DataFrame({name: sd}, time),
        trajectory=pd.DataFrame({"VN": speed, "VE": 0.0, "VD": 0.0}, time),
    )
    chain = SimpleChain(navigator)
    table = town.fixes(5, position_noise=0.02)
    after, findings = _with_known_offsets(chain, record, {"gnss": table})
    assert (after is chain) == (what != "worth") == (not findings)
    if what == "worth":
        assert after.navigator.aids[0].time_offset == pytest.approx(-0.11)
        assert after.navigator.aids[0].time_offset_sd == pytest.approx(0.012)


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
    after, findings = _with_offsets(chain, record, {})
    if offset is None:
        assert after is chain
        assert not findings
    else:
        assert after.navigator.aids[0].time_offset == pytest.approx(offset)
        assert [one.code for one in findings] == ["navigation.run-again-with-offset"]
        assert math.isclose(findings[0].data["offset"], offset)


@pytest.mark.parametrize(
    ("part", "runs"), [(1.0, 2), (0.4, 3), (0.1, STEPS_OF_OFFSET), (0.0, STEPS_OF_OFFSET)]
)
def test_runs_are_repeated_until_the_offset_they_find_is_small(part, runs):
    """Each run finds a part of an offset of 0.76 s; two tell which part, of a quarter or more.

    A run that finds a constant, whatever was assumed, never settles, and says so.
    """
    navigator, _ = town.begun(town.gnss(time_offset_sd=0.2))
    name, true = "gnss.time_offset_t", -0.76
    assumed = []

    def drive(chain):
        assumed.append(chain.navigator.aids[0].time_offset)
        error = part * (assumed[-1] - true) if part else 0.3
        record = SimpleNamespace(
            sensors=pd.DataFrame({name: [error]}),
            sensors_sd=pd.DataFrame({name: [0.001]}),
            innovations={},
            trajectory=AT_REST,
        )
        return SimpleNamespace(smoothed=None, record=record)

    chain = SimpleChain(navigator)
    after, _, findings = _with_settled_offsets(chain, drive(chain), drive)
    codes = [one.code for one in findings]
    assert "navigation.run-again-with-offset" in codes
    assert len(assumed) <= runs + 1
    offset = after.navigator.aids[0].time_offset
    if part:
        assert abs(part * (offset - true)) <= CONTINUED
        assert len(codes) == 1
    else:
        assert codes[-1] == "navigation.offset-not-settled"
        assert findings[-1].data["left"] == 0.3


def walked(sizes, left):
    """Runs over fixes whose innovations have a size, and which estimate an offset, by the assumed.

    `sizes`, `left`: functions of the assumed offset.
    """
    name, navigator = "gnss.time_offset_t", town.begun(town.gnss(time_offset_sd=0.2))[0]
    labels = ("north, m", "east, m", "down, m")
    time = np.round(np.arange(10.0, 110.0), 6)

    def drive(chain):
        offset = chain.navigator.aids[0].time_offset
        columns = {f"nu {x}": sizes(offset) for x in labels}
        columns |= {f"{part} {x}": 1.0 for part in ("s", "weight") for x in labels}
        record = SimpleNamespace(
            sensors=pd.DataFrame({name: [left(offset)]}),
            sensors_sd=pd.DataFrame({name: [0.001]}),
            innovations={"gnss.position": pd.DataFrame(columns, index=time - offset)},
            trajectory=AT_REST,
        )
        return SimpleNamespace(smoothed=None, record=record)

    chain = SimpleChain(navigator)
    return _with_settled_offsets(chain, drive(chain), drive)


def test_a_contradicted_run_is_begun_with_the_likeliest_of_several_offsets():
    """Of a walk whose steps are alike every half second: from zero, the nearest is a wrong one."""
    true, wrong = -0.38, 0.12

    def nearest(offset):
        return true if offset < -0.13 else wrong

    def left(offset):
        return offset - nearest(offset)

    def sizes(offset):
        return 0.5 + 10.0 * abs(left(offset)) + 3.0 * (nearest(offset) == wrong)

    after, _, (finding,) = walked(sizes, left)
    assert finding.code == "navigation.run-again-with-offset"
    assert finding.data["offset"] == after.navigator.aids[0].time_offset
    assert finding.data["offset"] == pytest.approx(true, abs=CONTINUED)


@pytest.mark.parametrize(("size", "step"), [(2.0, 0.4), (0.9, 1.1)])
def test_an_offset_with_which_fixes_are_explained_less_is_not_used(size, step):
    """Each run finds more of it: of positions that are wrong, and of no clock."""
    after, _, (finding,) = walked(lambda offset: size + abs(offset), lambda _: step)
    assert after.navigator.aids[0].time_offset == 0.0
    assert finding.code == "navigation.offset-not-settled"


@pytest.mark.parametrize("gain", [50.0, -50.0])
def test_what_jumps_beside_the_first_run_is_the_other_hypothesis(gain, monkeypatch):
    """Displaced positions look like an offset, and beside a run with that they do not jump."""

    def settled(chain, run, drive):
        return f"{chain}, settled", drive(chain), () if chain == "displaced" else ("offset",)

    def jumps(chain, run, source, drive):
        if chain == "asked":
            return "displaced", run, "changed", ("jumps",)
        return chain, run, source, ()

    monkeypatch.setattr(navigation_run, "_with_settled_offsets", settled)
    monkeypatch.setattr(navigation_run, "_with_jumps", jumps)
    monkeypatch.setattr(navigation_run, "_gain", lambda *_: gain)

    def drive(chain, other_source="given"):
        return chain, other_source

    found = navigation_run._explained("asked", "first", "given", drive)
    if gain > 0.0:
        over = "displaced", "changed"
        assert found == ("displaced, settled", over, "changed", (), ("jumps",))
    else:
        assert found == ("asked, settled", ("asked", "given"), "given", ("offset",), ())


def test_an_offset_with_which_there_is_no_run_is_not_used():
    """As one by which no fix is left within the alignment."""
    navigator, _ = town.begun(town.gnss(time_offset_sd=0.2))
    chain, name = SimpleChain(navigator), "gnss.time_offset_t"
    record = SimpleNamespace(
        sensors=pd.DataFrame({name: [1.3]}),
        sensors_sd=pd.DataFrame({name: [0.04]}),
        innovations={},
        trajectory=AT_REST,
    )
    first = SimpleNamespace(smoothed=None, record=record)

    def drive(chain):
        raise DataError("navigation.no-position-for-alignment", quantity="site", time=2.0)

    after, run, (finding,) = _with_settled_offsets(chain, first, drive)
    assert after is chain
    assert run is first
    assert finding.code == "navigation.offset-not-settled"
    assert finding.data["left"] == 1.3
