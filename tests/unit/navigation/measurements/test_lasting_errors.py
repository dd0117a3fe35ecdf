"""Errors of positions that last from fix to fix: their state, their measure, and the bounds."""

import numpy as np
import pytest
from tests import town_drive as town

from strapdown.alignment.course_sums import Antenna
from strapdown.estimation.robust import AdaptiveRule, AdaptiveScale, Igg3
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.measurements.gnss_readiness import (
    float_position_sd,
    lasting_position_sd,
    white_position_sd,
)
from strapdown.navigation.recorder import record_of
from strapdown.systems.navigation_proposal import _position_errors
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

WHITE, LASTING, TIME = 0.3, 1.0, 60.0
SHARE = LASTING**2 / (LASTING**2 + WHITE**2)
STATED = float(np.hypot(WHITE, LASTING))


def fixes(seed, velocities=True, lasting=LASTING, white=WHITE):
    table = town.fixes(seed, position_noise=1e-4)
    rng, k = np.random.default_rng(seed), np.exp(-0.5 / TIME)
    error = white * rng.normal(size=(len(table), 3))
    slow = rng.normal(size=3)
    for row in error:
        row += lasting * slow
        slow = k * slow + np.sqrt(1.0 - k * k) * rng.normal(size=3)
    places = zip(error, table[GEODETIC].to_numpy(), strict=True)
    table[GEODETIC] = [geodetic_from_ned(e, place) for e, place in places]
    table[POSITION_SD] = STATED
    if not velocities:
        table[VELOCITY], table[VELOCITY_SD] = 0.0, np.inf
    return table


def ratios(share):
    """Errors of the position over their standard deviations, at instants far apart."""
    out = []
    for seed in range(8401, 8407):
        aid = town.gnss(position_correlated_share=share, position_correlation_time=TIME)
        navigator, state = town.begun(aid)
        _, piece = town.run(navigator, state, fixes(seed))
        off = town.off(piece)
        for mark in piece.marks:
            if mark.time % 40.0 < 0.5 and mark.time > 20.0:
                k = int(np.searchsorted(piece.time, mark.time))
                out.append(off[k] / np.sqrt(np.diagonal(mark.covariance)[:3]))
    return np.array(out)


@pytest.mark.slow
def test_bounds_hold_where_errors_last_and_their_share_is_stated():
    # 6 drives of 160 s, about 3 independent instants of 3 axes each: the mean square of 54 is 1
    # within 4 times sqrt(2 / 54); as white errors the bounds are narrower by the root of the number
    # of fixes in a correlation time.
    assert 0.4 < np.mean(np.square(ratios(SHARE))) < 1.8
    assert np.mean(np.square(ratios(0.0))) > 4.0


@pytest.mark.parametrize("velocities", [True, False])
def test_the_scatter_from_fix_to_fix_lacks_what_lasts(velocities):
    table = fixes(8501, velocities)
    white, share = white_position_sd(table)
    # Velocities of 0.1 m/s add 0.035 m at 2 Hz, and a minute's drift 0.13 m a step.
    assert white == pytest.approx(WHITE, rel=0.25)
    assert share == pytest.approx(white / STATED, rel=1e-6)
    proposed = _position_errors(table, 0.0)
    assert proposed["position_correlated_share"] == pytest.approx(SHARE, abs=0.12)
    assert "lever_arm_sd_m" not in proposed


@pytest.mark.parametrize("seed", [8511, 8512, 8513])
def test_velocities_show_how_large_the_errors_are_that_last(seed):
    table = fixes(seed)
    white, lasting = lasting_position_sd(table)
    # 160 s show three independent pairs of the longest lags, on two axes.
    assert white * STATED == pytest.approx(WHITE, rel=0.3)
    assert 0.5 * LASTING < lasting * STATED < 1.8 * LASTING
    table[[*VELOCITY_SD]] = 2.0
    assert lasting_position_sd(table) is None  # the velocities hide it
    assert lasting_position_sd(fixes(seed, velocities=False)) is None


def test_a_receiver_that_understates_what_lasts_gets_a_factor():
    factors, false = [], 0
    for seed in range(8521, 8527):
        table = fixes(seed)
        table[POSITION_SD] = 0.3 * STATED
        proposed = _position_errors(table, 0.0)
        assert proposed["position_correlated_share"] > 0.6
        factors.append(proposed["position_sd_factor"])
        false += "position_sd_factor" in _position_errors(fixes(seed), 0.0)
    # Three independent pairs of the longest lags: one in some drives looks half as large again.
    assert false <= 1
    assert np.median(factors) == pytest.approx(1.0 / 0.3, rel=0.3)


def test_a_share_between_white_and_lasting_is_proposed_where_velocities_show_it():
    shares = []
    for seed in range(8531, 8537):
        table = fixes(seed, lasting=0.6, white=0.55)
        table[POSITION_SD] = float(np.hypot(0.6, 0.55))
        shares.append(_position_errors(table, 0.0).get("position_correlated_share", 0.0))
    assert np.median(shares) > 0.35


def test_white_errors_have_no_share_that_lasts():
    table = fixes(8502, lasting=0.0)
    table[POSITION_SD] = WHITE
    assert _position_errors(table, 0.0) == {}
    assert white_position_sd(table.iloc[:20]) is None


def test_a_scatter_as_large_as_stated_may_be_of_a_receiver_that_understates():
    """Nearly all of a code receiver's error lasts, and nothing shows it without velocities.

    What is new with each fix stays as it is measured.
    """
    table = town.fixes(8502, rate=4.0, position_noise=WHITE)
    table[POSITION_SD] = WHITE
    table[VELOCITY_SD] = np.inf
    _, part = white_position_sd(table)
    proposed = _position_errors(table, 0.0)
    total, share = proposed["position_sd_factor"] ** 2, proposed["position_correlated_share"]
    assert total == pytest.approx(part / np.sqrt(0.1), rel=0.01)
    assert total * (1.0 - share) == pytest.approx(part**2, rel=0.05)
    # Of one that scatters as little as usual nothing is added.
    table[POSITION_SD] = 4.0 * WHITE
    assert "position_sd_factor" not in _position_errors(table, 0.0)
    # Left as they are: a receiver with velocities that hide it, and fixes whose scatter is hidden.
    table[POSITION_SD], table[VELOCITY_SD] = WHITE, 2.0
    assert _position_errors(table, 0.0) == {}
    rare = town.fixes(8502, rate=1.0, position_noise=WHITE)
    rare[POSITION_SD], rare[VELOCITY_SD] = WHITE, np.inf
    assert _position_errors(rare, 0.0) == {}


def test_an_antenna_of_precise_fixes_is_measured_by_a_tape():
    table = town.fixes(8503, position_noise=0.02)
    assert _position_errors(table, 0.0)["lever_arm_sd_m"] == 0.02


def test_precise_fixes_whose_scatter_is_hidden_have_the_share_of_most_receivers():
    """Velocities of 0.1 m/s over 0.5 s hide 0.02 m: what lasts may be anything."""
    hidden = _position_errors(town.fixes(8503, position_noise=0.02), 0.0)
    assert hidden["position_correlated_share"] == 0.5
    table = town.fixes(8503, rate=10.0, position_noise=0.02, velocity_noise=0.004)
    plain = _position_errors(table, 0.0)
    assert "position_correlated_share" not in plain


def test_float_solutions_are_told_by_what_they_state():
    table = town.fixes(8504, position_noise=0.02)
    table[POSITION_SD] = 0.02
    assert float_position_sd(table) is None
    rows = np.arange(len(table)) % 50 < 5
    table.loc[rows, POSITION_SD] = 0.5
    assert float_position_sd(table) == pytest.approx(0.1)
    assert _position_errors(table, 0.0)["float_position_sd_m"] == pytest.approx(0.1)
    # So they are where kinds of fix say it, and no standard deviation is stated.
    table.attrs["position_sd_taken"] = 0.02
    assert _position_errors(table, 0.0)["float_position_sd_m"] == pytest.approx(0.1)
    # A code receiver states a metre or three.
    table[POSITION_SD] *= 60.0
    assert float_position_sd(table) is None


def test_the_factor_of_an_alignment_is_that_of_slopes():
    def slope_sd(time, length, step=0.2, many=400):
        """Scatter of fitted slopes of correlated errors over that of white ones."""
        rng, n = np.random.default_rng(8), round(length / step)
        k = np.exp(-step / time)
        x = np.empty((n, many))
        x[0] = rng.normal(size=many)
        for i in range(1, n):
            x[i] = k * x[i - 1] + np.sqrt(1.0 - k * k) * rng.normal(size=many)
        t = step * (np.arange(n) - 0.5 * (n - 1))
        return np.std(t @ x) / np.sqrt(t @ t)

    for time, length in ((100.0, 60.0), (20.0, 60.0), (300.0, 60.0)):
        factor = Antenna(correlated_share=1.0, correlation_time=time)
        found = factor.position_sd_factor(0.2, length)
        assert 0.5 < found / slope_sd(time, length) < 2.0
    assert Antenna().position_sd_factor(0.2, 60.0) == 1.0


def test_a_receiver_that_is_believed_again_makes_the_bound_cover_both():
    """Twenty seconds of a wrong ambiguity: after ten rejections the receiver is believed.

    Before, the bound was that of its fixes: 0.03 m with an error of 1 m.
    """
    table = town.fixes(8541, rate=4.0, position_noise=0.02, velocity_noise=0.05)
    time = table.index.to_numpy()
    wrong = (time >= 60.0) & (time < 80.0)
    places = table[GEODETIC].to_numpy()
    shift = np.array([0.8, 0.0, -0.6])
    table.loc[wrong, GEODETIC] = [geodetic_from_ned(shift, place) for place in places[wrong]]
    rule = AdaptiveRule(Igg3(), AdaptiveScale(lowest=1.0, doubt=1e-3))
    navigator, state = town.begun(town.gnss(rule=rule))
    _, piece = town.run(navigator, state, table)
    found = record_of(navigator, [piece])
    off, at = town.off(piece), piece.time
    sd = found.sd[["north", "east", "down"]].to_numpy()
    bound = 1.96 * np.column_stack([np.interp(at, found.sd.index, one) for one in sd.T])
    during = (at > 60.0) & (at < 80.0)
    assert np.abs(off[during][:, [0, 2]]).max() > 0.5
    assert (np.abs(off[during])[:, [0, 2]] < bound[during][:, [0, 2]]).mean() > 0.99
    # East is not contradicted, and moves little with the others. Back again, the receiver is
    # believed after some seconds.
    assert bound[:, 1][at > 2.0].max() < 0.25 * 0.8
    assert 0.5 < bound[(at > 80.0) & (at < 85.0)].max() < 3.0
    assert bound[at > 120.0].max() < 0.1


def test_after_an_outage_the_solution_was_wrong():
    """Fixes that return far from the solution widen the bound only until they are believed."""
    table = town.fixes(8542, rate=4.0, position_noise=0.02, velocity_noise=0.05)
    back = table.index.to_numpy() >= 60.0
    shift = np.array([3.0, 0.0, 0.0])
    places = table[GEODETIC].to_numpy()
    # The error of an inertial solution that is worse than its model, seen from the fixes.
    table.loc[back, GEODETIC] = [geodetic_from_ned(shift, place) for place in places[back]]
    table = table[(table.index < 50.0) | back]
    rule = AdaptiveRule(Igg3(), AdaptiveScale(lowest=1.0))
    navigator, state = town.begun(town.gnss(rule=rule))
    _, piece = town.run(navigator, state, table)
    found = record_of(navigator, [piece])
    at, north = piece.time, found.sd["north"]
    far = np.abs(town.off(piece)[:, 0] - 3.0)
    bound = 1.96 * np.interp(at, north.index, north)
    during = (at > 60.5) & (far > 0.3)
    assert during.sum() > 300
    assert (far < bound)[during].mean() > 0.95
    # Not for the minute of a doubtful receiver.
    assert bound[at > 95.0].max() < 0.1
