"""The navigator: cut anywhere, by either engine, with its errors fed back or forward."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests import aided_drives
from tests.coded import coded

from strapdown.errors import ConfigError, DivergenceError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import ERROR_MODELS
from strapdown.estimation.robust import (
    AdaptiveRule,
    Huber,
    Igg3,
    PaperUpdate,
    RobustUpdate,
    Tukey,
)
from strapdown.estimation.sensor_blocks import accel_bias, gauss_markov, gyro_bias, gyro_scale
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation import navigator as navigator_module
from strapdown.navigation.compiled_engine import compiled
from strapdown.navigation.filter_options import NoCorrection, OpenLoop
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import Origin, SineVelocityMotion, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.tables import VELOCITY_SD

MOTION = SineVelocityMotion(
    40.0, Origin(55.0, 37.0, 150.0), (6.0, -3.0, 0.0), (4.0, 5.0, 0.3), 25.0
)
RATE = 50.0
ARM = (0.4, -0.2, -1.1)
NOISE = {"gyro_noise": (3e-5,) * 3, "accel_noise": (1e-3,) * 3}
GYRO_BIAS, ACCEL_BIAS = np.array([2e-4, -1e-4, 3e-4]), np.array([0.01, -0.02, 0.015])
SD = np.repeat([2.0, 0.2, 0.002, 3e-4, 0.02], 3)
MECHANIZATIONS = {"ned": NorthEastDown(), "wander": WanderAzimuth()}


@pytest.fixture(scope="module")
def log():
    imu, _ = simulate_imu(MOTION, ImuErrors(), rate=RATE)
    imu[["gyro_x", "gyro_y", "gyro_z"]] += GYRO_BIAS
    imu[["accel_x", "accel_y", "accel_z"]] += ACCEL_BIAS
    increments = motion_increments(imu)
    fixes = simulate_gnss(
        MOTION, GnssReceiver(rate=2.0, position_noise=0.3, velocity_noise=0.05, antenna=ARM), seed=3
    )
    # A third within a step, a third at the ends of steps but for rounding.
    fixes.index = fixes.index + np.array([0.0, 0.0137, 3e-9])[np.arange(len(fixes)) % 3]
    return increments.index.to_numpy(), increments.to_numpy(), fixes.iloc[1:-1]


def truth_at(time):
    return NavState.from_trajectory(MOTION.trajectory([time, time + 1e-3]))


def started(mechanization="ned", form="joseph", aids=(), model="rotation_vector", **options):
    sensors = (gyro_bias(SD[9]), gauss_markov(accel_bias(SD[12]), 300.0))
    filter_ = ErrorFilter(
        MECHANIZATIONS[mechanization],
        ERROR_MODELS[model](**NOISE, sensors=sensors),
        COVARIANCES[form](),
    )
    navigator = Navigator(with_states(filter_, aids), aids, **options)
    truth = truth_at(0.0)
    start = replace(truth, alt=truth.alt + 1.0, v_n=truth.v_n + np.array([0.1, -0.1, 0.05]))
    size = navigator.filter.model.physical_size
    more = navigator.filter.model.stacked.sd[6:]
    P = np.diag(np.concatenate([SD, more])[:size] ** 2)
    return navigator, navigator.begin(start, P)


def run(log, navigator, state, cuts=(), late=False):
    """Histories, marks and observations; the table at once, or each fix as it comes."""
    time, rows, fixes = log
    edges = [0, *cuts, len(time)]
    names = [aid.name for aid in navigator.aids]
    if not late:
        for name in names:
            state = navigator.tell(state, name, fixes)
    pieces = []
    for begin, end in pairwise(edges):
        if late:
            before = time[begin - 1] if begin else -np.inf
            # What is of the instant of a sample, but for rounding, is told with it.
            new = fixes[(fixes.index > before + 1e-7) & (fixes.index <= time[end - 1] + 1e-7)]
            if len(new):
                for name in names:
                    state = navigator.tell(state, name, new)
        state, piece = navigator.advance(state, time[begin:end], rows[begin:end])
        pieces.append(piece)
    return (
        np.concatenate([p.history for p in pieces]),
        [mark for p in pieces for mark in p.marks],
        [seen for p in pieces for seen in p.seen],
        state,
    )


LONE = (Gnss(name="rtk", use_velocity=False, lever_arm=ARM),)
# Places and velocities at instants of their own, as joint epochs are met in one go by one engine.
BOTH = (Gnss(name="rtk", lever_arm=ARM, velocity_delay=0.1),)
# The compiled loop takes what is in the linear range of the rule, and asks for the rest.
RULED = (replace(BOTH[0], rule=AdaptiveRule(Igg3())),)
OTHERS = (
    Gnss(name="rtk", lever_arm=ARM, lever_arm_sd=0.05, time_offset_sd=0.02),
    Gnss(name="spare", use_position=False),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "aids", [LONE, BOTH, RULED, OTHERS], ids=["lone", "both", "ruled", "others"]
)
@pytest.mark.parametrize("form", list(COVARIANCES))
@pytest.mark.parametrize("mechanization", list(MECHANIZATIONS))
def test_cut_anywhere_the_numbers_are_the_same(log, mechanization, form, aids):
    navigator, state = started(mechanization, form, aids)
    log = (log[0][:700], log[1][:700], log[2])
    whole = run(log, navigator, state)
    rng = np.random.default_rng(7)
    count = len(log[0])
    for cuts in (np.sort(rng.choice(count - 1, 12, replace=False)) + 1, range(1, count)):
        for late in (False, True):
            if late and (len(cuts) < 100 or aids in (BOTH, RULED)):
                # A fix that lies before samples that were already given comes too late, and so
                # does a velocity of a while ago.
                continue
            same(whole, run(log, navigator, state, cuts, late))


def same(a, b):
    np.testing.assert_array_equal(a[0], b[0])
    assert [m.time for m in a[1]] == [m.time for m in b[1]]
    for one, other in zip(a[1], b[1], strict=True):
        np.testing.assert_array_equal(one.covariance, other.covariance)
        np.testing.assert_array_equal(one.sensors, other.sensors)
        np.testing.assert_array_equal(one.sensors_sd, other.sensors_sd)
    assert [(s.time, s.name) for s in a[2]] == [(s.time, s.name) for s in b[2]]
    for one, other in zip(a[2], b[2], strict=True):
        np.testing.assert_array_equal(one.innovations.nu, other.innovations.nu)
        np.testing.assert_array_equal(one.innovations.s, other.innovations.s)


@pytest.mark.slow
@pytest.mark.parametrize(
    "aids", [LONE, BOTH, RULED, OTHERS], ids=["lone", "both", "ruled", "others"]
)
@pytest.mark.parametrize("form", list(COVARIANCES))
@pytest.mark.parametrize("mechanization", list(MECHANIZATIONS))
def test_both_engines_give_the_same_but_for_rounding(log, monkeypatch, mechanization, form, aids):
    navigator, state = started(mechanization, form, aids)
    assert compiled(navigator.filter)
    fast = run(log, navigator, state)
    monkeypatch.setattr(navigator_module, "compiled", lambda _: False)
    slow = run(log, navigator, state)
    # A lone receiver's place and velocity of one instant are fed back one after the other, others
    # together: here each epoch has one. Places are met to 1e-9 m.
    np.testing.assert_allclose(fast[0], slow[0], rtol=1e-9, atol=1e-9)
    assert [m.time for m in fast[1]] == [m.time for m in slow[1]]
    for one, other in zip(fast[1], slow[1], strict=True):
        np.testing.assert_allclose(
            np.diagonal(one.covariance), np.diagonal(other.covariance), rtol=1e-9
        )
        np.testing.assert_allclose(one.sensors, other.sensors, rtol=1e-8, atol=1e-13)
    for one, other in zip(fast[2], slow[2], strict=True):
        assert (one.time, one.name, one.labels) == (other.time, other.name, other.labels)
        np.testing.assert_allclose(one.innovations.nu, other.innovations.nu, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("form", list(COVARIANCES))
@pytest.mark.parametrize(
    "rule",
    [AdaptiveRule(Igg3()), RobustUpdate(Huber(2.0), 1.2), RobustUpdate(Tukey())],
    ids=["igg3", "huber", "tukey"],
)
def test_a_compiled_loop_takes_what_a_rule_takes_at_all(log, monkeypatch, rule, form):
    time, rows, fixes = log
    wrong = fixes.copy()
    wrong.iloc[20:24, wrong.columns.get_loc("alt")] += 8.0
    navigator, state = started(form=form, aids=(replace(BOTH[0], rule=rule),))
    fast = run((time, rows, wrong), navigator, state)
    weights = np.array([one.innovations.weight for one in fast[2]])
    # The loop asks for the step beyond the linear range, and leaves what is rejected.
    taken = np.array([one.observation is None for one in fast[2]])
    reduced = ((weights > 0.0) & (weights < 1.0)).any(axis=1)
    assert (reduced & taken).sum() > 5
    assert not taken[(weights == 0.0).any(axis=1)].any()
    if isinstance(rule, RobustUpdate):
        assert taken[(weights > 0.0).all(axis=1)].all()
    assert (weights == 0.0).any() == (not isinstance(rule.influence, Huber))
    monkeypatch.setattr(navigator_module, "compiled", lambda _: False)
    slow = run((time, rows, wrong), navigator, state)
    np.testing.assert_allclose(fast[0], slow[0], rtol=1e-9, atol=1e-9)
    for one, other in zip(fast[2], slow[2], strict=True):
        assert (one.time, one.name, one.labels) == (other.time, other.name, other.labels)
        for part in ("nu", "s", "weight"):
            a, b = getattr(one.innovations, part), getattr(other.innovations, part)
            np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9)
    assert fast[3].scales.keys() == slow[3].scales.keys()
    for name, learned in fast[3].scales.items():
        np.testing.assert_allclose(learned, slow[3].scales[name], rtol=1e-7, atol=1e-9)
    assert bool(fast[3].scales) == isinstance(rule, AdaptiveRule)


def test_velocities_of_two_components_and_of_three_learn_together(log, monkeypatch):
    """As of a receiver that outputs speed and course until it has a vertical velocity."""
    time, rows, fixes = log
    level = fixes.copy()
    level.iloc[:30, level.columns.get_loc(VELOCITY_SD[2])] = np.inf
    level.iloc[50:55, level.columns.get_loc(VELOCITY_SD[2])] = np.inf
    navigator, state = started(aids=RULED)
    fast = run((time, rows, level), navigator, state)
    sizes = [len(one.labels) for one in fast[2] if one.name == "rtk.velocity"]
    assert set(sizes) == {2, 3}
    assert len(fast[3].scales["rtk.velocity"]) == 3
    monkeypatch.setattr(navigator_module, "compiled", lambda _: False)
    slow = run((time, rows, level), navigator, state)
    np.testing.assert_allclose(fast[0], slow[0], rtol=1e-9, atol=1e-9)
    for name, learned in fast[3].scales.items():
        np.testing.assert_allclose(learned, slow[3].scales[name], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("model", ["rotation_vector", "quaternions"])
@pytest.mark.parametrize("damping", [None, OpenLoop()], ids=["feedback", "feedforward"])
def test_errors_are_found_and_as_large_as_is_said(log, model, damping):
    options = {} if damping is None else {"damping": damping}
    navigator, state = started("wander", "ud", LONE, model, **options)
    history, marks, _, end = run(log, navigator, state)
    used = navigator.filter.mechanization
    table = used.trajectory(log[0], history)
    off = state_error(NavState.from_trajectory(table, -1), truth_at(float(log[0][-1])))
    # The chance of beyond four standard deviations is 6e-5 each.
    sd = np.sqrt(np.diagonal(marks[-1].covariance))
    kept = slice(0, 9) if navigator.filter.model.has_height else np.r_[0, 1, 3:9]
    assert (np.abs(off[kept]) < 4.0 * sd[kept]).all()
    assert (np.abs(marks[-1].sensors[:3] - GYRO_BIAS) < 4.0 * marks[-1].sensors_sd[:3]).all()
    assert marks[-1].sensors_sd[3] < 0.9 * SD[12]
    if damping is not None:
        # Nothing was fed back: the mechanization itself has gone off.
        raw = used.nav_state(end.engine.mechanization, end.time)
        gone = state_error(raw, truth_at(end.time))
        assert np.linalg.norm(gone[:2]) > 5.0 * np.linalg.norm(off[:2])


def test_feedforward_goes_by_pieces_too(log):
    navigator, state = started("wander", "ud", LONE, damping=OpenLoop())
    cuts = [3, 77, 78, 1000]
    same(run(log, navigator, state), run(log, navigator, state, cuts))


@pytest.mark.parametrize("model", ["rotation_vector", "quaternions"])
def test_without_correction_the_estimates_are_only_recorded(log, model):
    navigator, state = started("wander", "ud", LONE, model, damping=OpenLoop())
    shown, marks, seen, end = run(log, navigator, state)
    none = replace(navigator, damping=NoCorrection())
    free = run(log, none, none.begin_from(state.engine.filter))
    used, time = navigator.filter.mechanization, log[0]
    # The same mechanization and filter to the last bit; the output alone is another.
    np.testing.assert_array_equal(free[3].engine.mechanization, end.engine.mechanization)
    np.testing.assert_array_equal(free[0][-1], used.history_row(end.engine.mechanization))
    assert np.abs(free[0] - shown).max() > 0.0
    for one, other in zip(free[2], seen, strict=True):
        np.testing.assert_array_equal(one.innovations.nu, other.innovations.nu)
    for one, other in zip(free[1], marks, strict=True):
        np.testing.assert_array_equal(one.sensors, other.sensors)
        np.testing.assert_array_equal(one.sensors_sd, other.sensors_sd)
    # What is left is the difference of both outputs; its square is in the covariance.
    at, mark = next(
        (k, i)
        for i, one in reversed(list(enumerate(marks)))
        if abs(time[k := min(int(time.searchsorted(one.time - 1e-7)), len(time) - 1)] - one.time)
        < 1e-7
    )
    raw, corrected = (
        NavState.from_trajectory(used.trajectory(time[: at + 1], rows[: at + 1]), -1)
        for rows in (free[0], shown)
    )
    more = free[1][mark].covariance - marks[mark].covariance
    kept = slice(0, 9) if navigator.filter.model.has_height else np.r_[0, 1, 3:9]
    left = state_error(raw, corrected)
    # To first order in the errors, a hundredth of a radian and less.
    np.testing.assert_allclose(
        np.sqrt(np.diagonal(more)[kept]), np.abs(left[kept]), rtol=0.01, atol=1e-6
    )
    off = np.abs(state_error(raw, truth_at(float(time[at]))))[kept]
    bounds = [np.sqrt(np.diagonal(one[mark].covariance))[kept] for one in (free[1], marks)]
    assert (off < 4.0 * bounds[0]).all()
    assert (off > 4.0 * bounds[1]).any()


def test_a_smoother_of_what_is_not_corrected_is_refused(log):
    navigator, _ = started("wander", "ud", LONE)
    with pytest.raises(ConfigError, check=coded("navigation.smoother-without-correction")):
        replace(navigator, damping=NoCorrection(), smoother=RauchTungStriebel())


def test_a_fix_that_comes_too_late_is_said_and_not_used(log):
    time, rows, fixes = log
    navigator, state = started(aids=LONE)
    state, _ = navigator.advance(state, time[:500], rows[:500])
    state = navigator.tell(state, "rtk", fixes)
    state, piece = navigator.advance(state, time[500:600], rows[500:600])
    late = [t for name, t in piece.late if name == "rtk"]
    np.testing.assert_array_equal(late, fixes.index[fixes.index < time[499] - 1e-7])
    assert min(seen.time for seen in piece.seen) >= time[499] - 1e-7


def test_marks_come_without_epochs_too(log):
    time, rows, _ = log
    navigator, state = started(mark_interval=0.5)
    _, piece = navigator.advance(state, time, rows)
    gaps = np.diff([mark.time for mark in piece.marks])
    # Groups of 0.1 s: an interval is met to one of them.
    assert gaps.max() < 0.6 + 1e-9
    assert gaps.min() > 0.5 - 1e-6


@pytest.mark.parametrize("aids", [LONE, OTHERS], ids=["lone", "others"])
def test_an_outage_is_marked_where_it_ends_and_so_is_the_end(log, aids):
    time, rows, fixes = log
    ends = float(fixes.index[fixes.index > 9.0][0])
    outage = fixes[(fixes.index < 4.0) | (fixes.index >= ends)]
    navigator, state = started(aids=aids)
    log = (time[:700], rows[:700], outage)
    whole = run(log, navigator, state)
    marks = whole[1]
    stamps = np.array([mark.time for mark in marks])
    assert (np.diff(stamps) > 0.0).all()
    at = int(np.argmin(np.abs(stamps - (ends - 1e-6))))
    assert stamps[at] == pytest.approx(ends - 1e-6, abs=2e-7)
    assert stamps[at + 1] == pytest.approx(ends, abs=2e-7)
    # It is known least just before, and known again just after.
    place = np.array([np.trace(mark.covariance[:2, :2]) for mark in marks])
    within = (stamps > 4.0) & (stamps < ends)
    assert place[at] == place[within].max() > 1.02 * place[at - 1]
    assert place[at + 1] < place[at]
    # What the fix was expected to be off by is what was marked before it.
    first = next(one for one in whole[2] if one.time > 8.0 and one.name == "rtk.position")
    R = 0.3**2
    if aids == LONE:
        arm = place[at] / 2.0 + R
        assert np.mean(first.innovations.s[:2]) == pytest.approx(arm, rel=0.01)
    # So is each fix half a second after another; fixes at 10 Hz would have no marks before them.
    before = np.abs(stamps[:, None] - (outage.index.to_numpy() - 1e-6)) < 2e-7
    assert before.sum() == (outage.index <= time[699]).sum()
    for cuts in ((31, 222, 449, 450, 451, 455), range(1, 700)):
        cut = run(log, navigator, state, cuts, late=True)
        assert [mark.time for mark in cut[1]] == stamps.tolist()
        for a, b in zip(cut[1], marks, strict=True):
            np.testing.assert_array_equal(a.covariance, b.covariance)
        np.testing.assert_array_equal(cut[0], whole[0])
    end = navigator.finish(whole[3])
    assert [mark.time for mark in end.marks] == [time[699]]
    assert len(end.history) == len(end.time) == len(end.seen) == 0
    again = navigator.finish(whole[3])
    np.testing.assert_array_equal(again.marks[0].covariance, end.marks[0].covariance)


def test_a_rule_that_takes_more_than_there_is_ends_with_a_message(log):
    time, rows, fixes = log
    aid = Gnss(name="rtk", lever_arm=ARM, rule=PaperUpdate(Tukey()))
    navigator, state = started(form="joseph", aids=(aid,))
    wrong = fixes.copy()
    wrong[["VN", "VE", "VD"]] += 0.25
    with pytest.raises(DivergenceError, check=coded("navigation.variance-lost")):
        run((time, rows, wrong), navigator, state)


def test_scale_factors_and_held_height_go_the_same_way_in_both_engines(log, monkeypatch):
    time, rows, fixes = log
    blocks = (gyro_bias(SD[9]), accel_bias(SD[12]), gyro_scale(1e-3))
    for used in (NorthEastDown(height="held"), WanderAzimuth(height="held")):
        filter_ = ErrorFilter(
            used, ERROR_MODELS["rotation_vector"](**NOISE, sensors=blocks), COVARIANCES["joseph"]()
        )
        navigator = Navigator(filter_, LONE)
        sd = np.concatenate([SD, [1e-3] * 3])
        sd[[2, 5]] = 0.0
        state = navigator.begin(truth_at(0.0), np.diag(sd**2))
        monkeypatch.setattr(navigator_module, "compiled", compiled)
        fast = run((time[:600], rows[:600], fixes), navigator, state)
        monkeypatch.setattr(navigator_module, "compiled", lambda _: False)
        slow = run((time[:600], rows[:600], fixes), navigator, state)
        np.testing.assert_allclose(fast[0], slow[0], rtol=1e-11, atol=1e-11)
        alt = used.trajectory(time[:600], fast[0])["alt"]
        # Corrections of decimetres along the tangent of a sphere of 6e6 m: 1e-8 m.
        assert alt.std() < 1e-6


def test_names_are_of_one_aid_each():
    with pytest.raises(ConfigError, check=coded("navigation.aid-name-taken")):
        Navigator(started()[0].filter, (Gnss(name="a"), Gnss(name="a")))
    with pytest.raises(ConfigError, check=coded("navigation.aid-without-name")):
        Navigator(started()[0].filter, (Gnss(),))
    navigator, state = started(aids=LONE)
    with pytest.raises(ConfigError, match="rtk"):
        navigator.tell(state, "rtx", None)


def test_what_diverges_names_the_sample(log):
    time, rows, _ = log
    wild = rows.copy()
    wild[300, 4] = 1e7
    navigator, state = started(aids=LONE)
    with pytest.raises(DivergenceError, match=f"{time[300]:.9g}"):
        navigator.advance(state, time, wild)


def test_speed_and_course_alone_tell_what_a_vertical_velocity_of_no_weight_leaves():
    navigator = aided_drives.navigator_of((Gnss(name="gnss"),))
    motion = aided_drives.drive()
    fixes = aided_drives.gnss_of(motion, 1)
    ends, told = [], []
    for unknown in (np.inf, 1e5):
        table = fixes.assign(**{"VD": 0.0, VELOCITY_SD[2]: unknown})
        state, pieces = aided_drives.run(navigator, motion, 1, {"gnss": table})
        ends.append(state.engine.filter)
        seen = [one for piece in pieces for one in piece.seen if one.name == "gnss.velocity"]
        told.append({len(one.labels) for one in seen})
    assert told == [{2}, {3}]
    level, weightless = ends
    # 1e5 m/s beside 0.1 m/s has 1e-12 of the weight, at each of 120 epochs; the loops round apart.
    sd = np.sqrt(np.diagonal(weightless.covariance))
    assert level.covariance / sd / sd[:, None] == pytest.approx(
        weightless.covariance / sd / sd[:, None], abs=1e-8
    )
    assert level.row == pytest.approx(weightless.row, rel=1e-10, abs=1e-7)
