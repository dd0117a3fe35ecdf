"""A unit that was switched on with its record: the biases change until it is warm."""

from dataclasses import replace

import numpy as np
import pytest
from tests import town_drive as town
from tests.town_drive import DEG

from strapdown.config.navigation import WarmingTable
from strapdown.navigation.engine import GeneralEngine
from strapdown.navigation.navigator import Navigator, Warming
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.smoother import RauchTungStriebel

WARMING = Warming(0.1 * DEG, 0.03, 60.0, begin=0.0)
AXES = [f"gyro_bias_{axis}" for axis in "xyz"]


def warmed(*aids, warming=WARMING, **changes):
    navigator, state = town.begun(*aids)
    return replace(navigator, warming=warming, **changes), state


def by_pieces(navigator, state, table, sizes):
    """The same run, cut into pieces of so many steps in turn."""
    time, rows = town.increments()
    state, pieces, at, k = navigator.tell(state, "gnss", table), [], 0, 0
    while at < len(time):
        end = at + sizes[k % len(sizes)]
        state, piece = navigator.advance(state, time[at:end], rows[at:end])
        pieces.append(piece)
        at, k = end, k + 1
    return state, pieces


@pytest.mark.parametrize("begin", [0.0, -45.0, float("nan")])
def test_without_fixes_the_variance_grows_as_the_unit_warms(begin):
    """What a constant bias with the same start lacks: sd² (exp(-2 t0/T) - exp(-2 t/T))."""
    told = []
    for warming in (None, replace(WARMING, begin=begin)):
        navigator, state = warmed(warming=warming)
        time, rows = town.increments()
        state, _ = navigator.advance(state, time, rows)
        P = navigator.filter.physical_covariance(state.engine.filter)
        told.append((np.diagonal(P)[9:15], state.warmed))
    (constant, _), (more, until) = told
    since = 0.0 if np.isnan(begin) else -begin
    share = np.exp(-2.0 * since / 60.0) - np.exp(-2.0 * (since + until) / 60.0)
    expected = share * np.repeat([WARMING.gyro**2, WARMING.accel**2], 3)
    np.testing.assert_allclose(more - constant, expected, rtol=1e-9)
    # It is told of until hardly anything is left, and not so late that a filter would not know.
    assert town.motion().duration - until < 0.06 * (since + town.motion().duration)


def test_it_is_over_when_the_unit_is_warm():
    assert WARMING.due(241.0, 0.0) == np.inf
    assert np.isfinite(WARMING.due(239.0, 0.0))
    total, at = 0.0, 0.0
    while np.isfinite(due := WARMING.due(at, 0.0)):
        assert due > at + 0.9
        total += WARMING.variances(at, due, 0.0)["gyro_bias"]
        at = due
    assert total == pytest.approx(WARMING.gyro**2, rel=1e-3)


def record_of(navigator, pieces):
    """Record of pieces, smoothed if the navigator has a smoother."""
    tape, smoother = FullRecorder().begin(navigator), navigator.smoother
    smoothing = None if smoother is None else smoother.begin(navigator)
    for piece in pieces:
        tape.take(piece)
        if smoothing is not None:
            smoothing.take(piece)
    return tape.record(smoothing=smoothing)


@pytest.mark.parametrize("smoother", [None, RauchTungStriebel()])
def test_any_cut_gives_the_same_bits(smoother):
    found = []
    for sizes in ([10**6], [7, 50, 3]):
        navigator, state = warmed(town.gnss(), smoother=smoother)
        state, pieces = by_pieces(navigator, state, town.fixes(), sizes)
        found.append((state, record_of(navigator, pieces)))
    (state, record), (same, again) = found
    assert state.warmed == same.warmed > 100.0
    np.testing.assert_array_equal(state.engine.filter.covariance, same.engine.filter.covariance)
    np.testing.assert_array_equal(record.trajectory, again.trajectory)
    np.testing.assert_array_equal(record.sensors.loc[1.0:], again.sensors.loc[1.0:])
    np.testing.assert_array_equal(record.sensors_sd.loc[1.0:], again.sensors_sd.loc[1.0:])


def test_both_engines_agree(monkeypatch):
    """The compiled loop over fixes stops where the general one is told."""
    found = []
    for general in (False, True):
        if general:
            monkeypatch.setattr(
                Navigator,
                "engine",
                lambda self, state: GeneralEngine(self.filter, state, True, True),
            )
        navigator, state = warmed(town.gnss())
        state, piece = town.run(navigator, state, town.fixes())
        sd = np.sqrt(np.diagonal(navigator.filter.physical_covariance(state.engine.filter)))
        found.append((piece.history[-1, 2:6], sd))
    # Without a warming unit they differ by 1e-6 m/s, a ten-thousandth of the standard deviation.
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-5)
    assert (np.abs(found[0][0] - found[1][0]) < 1e-3 * found[0][1][2:6]).all()


def cold(seed, time):
    """Increments of gyros whose biases go to the settled ones exponentially, and that change."""
    stamps, rows = town.increments()
    rng = np.random.default_rng([21, seed])
    change, own = WARMING.gyro * rng.normal(size=3), np.exp(rng.uniform(np.log(15), np.log(120)))
    dt = np.diff(stamps, prepend=stamps[0] - (stamps[1] - stamps[0]))
    bias = change * (1.0 - np.exp(-stamps / own))[:, None]
    rows = rows.copy()
    rows[:, 1:4] += bias * dt[:, None]
    return rows, change * (1.0 - np.exp(-time / own))[:, None]


@pytest.mark.slow
@pytest.mark.parametrize("smoothed", [False, True])
def test_bounds_hold_for_units_of_other_times(smoothed):
    """Twelve units with times of 15 to 120 s, where 60 are assumed: the biases of the gyros."""
    constant = town.GYRO_BIAS * np.array([1.0, -1.0, 0.5])
    smoother = RauchTungStriebel() if smoothed else None
    inside, far = {}, {}
    for warming in (WARMING, None):
        shares, most = [], []
        for seed in range(12):
            navigator, state = warmed(town.gnss(), warming=warming, smoother=smoother)
            state = navigator.tell(state, "gnss", town.fixes(300 + seed))
            rows, _ = cold(seed, np.zeros(1))
            state, piece = navigator.advance(state, town.increments()[0], rows)
            record = record_of(navigator, [piece, navigator.finish(state)])
            at = record.sensors.index.to_numpy()
            error = record.sensors[AXES].to_numpy() - constant - cold(seed, at)[1]
            z = error / record.sensors_sd[AXES].to_numpy()
            shares.append(np.mean(np.abs(z[at > 5.0]) < 1.96))
            most.append(np.abs(z).max())
        inside[warming], far[warming] = np.mean(shares), max(most)
    assert inside[WARMING] > 0.93
    assert far[WARMING] < 5.0
    assert inside[None] < 0.5


def test_a_table_states_it():
    made = WarmingTable(gyro_sd_deg_per_h=360.0, accel_sd_ug=3000.0).make()
    assert made.gyro == pytest.approx(0.1 * DEG)
    assert made.accel == pytest.approx(3e-3 * 9.80665)
    assert made.time == 400.0
    assert WarmingTable().make() is None
