"""A navigator with a receiver that fails: it comes back after outages, and bears what is false."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.gnss_faults import Frozen, Outage, Outliers, WrongSd, inject_gnss_faults

import town_drive as town
from strapdown.estimation.robust import AdaptiveRule, Hampel, RobustUpdate, Tukey

SETTLED = 30.0
OUTAGE = (60.0, 120.0)
FULL = None
TUKEY, HAMPEL = AdaptiveRule(Tukey()), AdaptiveRule(Hampel())


@cache
def run(rule, *faults):
    navigator, state = town.begun(town.gnss(rule=rule))
    table = town.fixes()
    if faults:
        table = inject_gnss_faults(table, faults, seed=7)
    return town.run(navigator, state, table)


def rms(piece, begin=SETTLED, end=np.inf):
    within = (piece.time > begin) & (piece.time < end)
    return float(np.sqrt((town.off(piece)[within] ** 2).sum(axis=1).mean()))


def after_outage(rule, sds):
    """The run from the end of an outage whose error has grown to so many standard deviations."""
    navigator, state = town.begun(town.gnss(rule=rule))
    table = inject_gnss_faults(town.fixes(), [Outage(*OUTAGE)])
    time, rows = town.increments()
    at = int(np.searchsorted(time, OUTAGE[1] - 0.1))
    state, _ = navigator.advance(navigator.tell(state, "gnss", table), time[:at], rows[:at])
    used, engine = navigator.filter.mechanization, state.engine
    P = navigator.filter.physical_covariance(engine.filter)[:9, :9]
    # Along the direction in which places are known worst, and velocity and tilt with it as they
    # have grown together.
    value, vector = np.linalg.eigh(P[:2, :2])
    away = P[:, :2] @ vector[:, 1] / np.sqrt(value[1])
    away[2] = 0.0
    moved = used.correct(engine.mechanization, -sds * away)
    row = used.history_row(moved)
    engine = replace(
        engine, mechanization=moved, row=row, open_history=np.r_[engine.open_history[:-1], [row]]
    )
    state = replace(state, engine=engine)
    size = sds * float(np.sqrt(value[1]))
    return size, navigator.advance(state, time[at:], rows[at:])[1]


@pytest.mark.parametrize("rule", [TUKEY, HAMPEL], ids=["tukey", "hampel"])
@pytest.mark.parametrize("sds", [3.0, 5.0])
def test_an_error_that_grew_beyond_its_bound_is_taken_off_within_a_few_fixes(rule, sds):
    size, piece = after_outage(rule, sds)
    assert size > 20.0
    weights = np.array([o.innovations.weight[:2] for o in piece.seen if o.name == "gnss.position"])
    # No more than few in a row are refused of any component: an outage of a minute explains them.
    longest = 0
    for column in weights.T:
        refused = 0
        for weight in column:
            refused = 0 if weight > 0.0 else refused + 1
            longest = max(longest, refused)
    assert longest <= 2
    # The first that is taken leaves what a fix of 1 m leaves; 12 fixes are 6 s.
    e = np.hypot(*town.off(piece)[:, :2].T)
    assert e[piece.time > OUTAGE[1] + 8.0].max() < 0.1 * size
    # Better than one fix, though heading and biases, too, were wrong by as many deviations.
    assert rms(piece, OUTAGE[1] + 15.0) < town.POSITION_SD


def test_without_patience_it_would_be_refused_for_ever():
    size, piece = after_outage(RobustUpdate(Tukey()), 5.0)
    assert np.hypot(*town.off(piece)[-1, :2]) > 0.5 * size


@pytest.mark.parametrize("rule", [TUKEY, HAMPEL], ids=["tukey", "hampel"])
def test_a_tenth_of_gross_errors_costs_no_more_than_a_fifth(rule):
    clean = rms(run(FULL)[1])
    faults = [Outliers(share=0.1, size=50.0)]
    assert rms(run(rule, *faults)[1]) < 1.2 * clean
    # And they do harm: of 50 m in every tenth fix, a filter that believes all keeps metres.
    assert rms(run(FULL, *faults)[1]) > 5.0 * clean


@pytest.mark.parametrize("rule", [TUKEY, HAMPEL], ids=["tukey", "hampel"])
def test_a_receiver_that_repeats_itself_leads_astray_by_little_and_not_for_long(rule):
    frozen = Frozen(80.0, 100.0)
    piece = run(rule, frozen)[1]
    # In 20 s the car goes some 200 m from where the receiver stays.
    assert rms(piece, 80.0, 100.0) < 8.0
    assert rms(run(FULL, frozen)[1], 80.0, 100.0) > 50.0
    assert rms(piece, 110.0) < 3.0 * rms(run(FULL)[1], 110.0)


def test_a_receiver_three_times_worse_than_it_says_is_found_out():
    state, piece = run(TUKEY, WrongSd(position_factor=1.0 / 3.0))
    factors = [one.factor for one in state.scales["gnss.position"]]
    # Learnt over some 100 fixes, with a clip that lets each tell less than half of one: 10 %.
    assert np.abs(np.array(factors) / 3.0 - 1.0).max() < 0.3
    assert all(abs(one.factor - 1.0) < 0.3 for one in state.scales["gnss.velocity"])

    def ratio(piece):
        """Root mean square of the horizontal error over its standard deviation."""
        marks = [m for m in piece.marks if m.time > SETTLED]
        at = np.searchsorted(piece.time, np.array([m.time for m in marks]) - 1e-6)
        sd = np.array([np.sqrt(np.diag(m.covariance)[:2]) for m in marks])
        return float(np.sqrt(np.mean((town.off(piece)[at, :2] / sd) ** 2)))

    # Errors are correlated over seconds, so that 150 s are some 40 that are independent.
    assert 0.6 < ratio(piece) < 1.5
    assert ratio(run(FULL, WrongSd(position_factor=1.0 / 3.0))[1]) > 2.0


@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
def test_an_arm_and_an_offset_that_were_not_known_are_found(name):
    aid = town.gnss(
        lever_arm=(0.0, 0.0, 0.0), lever_arm_sd=1.5, time_offset_sd=0.2, time_offset=0.05
    )
    navigator, state = town.begun(aid, name=name)
    last = town.run(navigator, state, town.fixes(time_offset=0.15))[1].marks[-1]
    columns = navigator.filter.model.columns_of
    arm, offset = (
        slice(columns[f"gnss.{what}"].start - 9, columns[f"gnss.{what}"].stop - 9)
        for what in ("lever_arm", "time_offset")
    )
    # Assumed less true: nothing less the arm, 0.05 s less 0.15 s.
    truth = np.r_[-np.array(town.ARM), -0.1]
    found = np.r_[last.sensors[arm], last.sensors[offset]]
    sd = np.r_[last.sensors_sd[arm], last.sensors_sd[offset]]
    assert np.abs(found - truth).max() / sd.max() < 4.0
    assert (np.abs(found - truth) < 4.0 * sd).all()
    # On a level road the height of the antenna is not told from that of the car.
    assert (sd[[0, 1, 3]] < [0.3, 0.3, 0.03]).all()
    assert sd[2] > 0.5


def test_what_was_learnt_goes_on_over_a_cut():
    # With velocities that come late, so that an epoch is before those of earlier rows, and is told
    # by so much before the samples.
    aid = town.gnss(rule=TUKEY, velocity_delay=0.75, time_offset_sd=0.01)
    navigator, state = town.begun(aid)
    table = inject_gnss_faults(town.fixes(), [Outliers(share=0.1, size=50.0)], seed=7)
    table = table[table.index > 1.0]
    time, rows = town.increments()
    whole, _ = town.run(navigator, state, table)
    told = 0
    for lo in range(0, len(time), 1234):
        end = min(lo + 1234, len(time))
        more = int(np.searchsorted(table.index, time[end - 1] + 0.8))
        if more > told:
            state = navigator.tell(state, "gnss", table.iloc[told:more])
        told = more
        state, _ = navigator.advance(state, time[lo:end], rows[lo:end])
    assert state.scales == whole.scales
    assert (state.engine.mechanization == whole.engine.mechanization).all()
    assert (state.engine.filter.covariance == whole.engine.filter.covariance).all()


def test_an_offset_does_not_drift_where_the_noise_of_the_sensors_is_overstated(monkeypatch):
    """As of a unit that shakes: the velocity follows the errors of the latest fixes.

    The innovation is correlated with the velocity that multiplies the offset: 12 to 18 standard
    deviations after 150 s, were that the derivative.
    """
    town.increments()  # of the sensors as they are
    monkeypatch.setattr(town, "ACCEL_NOISE", 200.0 * town.ACCEL_NOISE)
    off = []
    for seed in range(2):
        navigator, state = town.begun(town.gnss(time_offset_sd=0.02, use_velocity=False))
        table = town.fixes(seed=seed, rate=10.0, position_noise=0.01)
        last = town.run(navigator, state, table)[1].marks[-1]
        at = navigator.filter.model.columns_of["gnss.time_offset"].start - 9
        off.append(last.sensors[at] / last.sensors_sd[at])
        assert last.sensors_sd[at] < 0.012
    assert np.abs(off).max() < 3.0
