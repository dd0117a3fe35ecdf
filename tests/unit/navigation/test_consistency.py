"""Innovations that are as expected are left in peace, and those that are not are told apart."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm

from strapdown.errors import ConfigError
from strapdown.navigation.consistency import (
    GROSS,
    consistency_of,
    consistency_of_all,
    gross_of,
    whiteness,
)

sys.path.insert(0, str(Path(__file__).parent))

from innovations import LABELS, exactly, innovation_table


def verdicts(normalised):
    return consistency_of("gnss.position", innovation_table(normalised)).verdicts


@pytest.mark.slow
@pytest.mark.parametrize(("epochs", "runs"), [(60, 150), (300, 200), (1800, 100)])
def test_rate_of_false_alarms(epochs, runs):
    rng = np.random.default_rng(epochs)
    tables = [innovation_table(rng.normal(size=(epochs, 3))) for _ in range(runs)]
    wrong = sum(not consistency_of("x", table).consistent for table in tables)
    # One in a hundred is stated; more than this number comes once in ten thousand times.
    assert wrong <= binom.isf(1e-4, runs, 0.01)


def test_rate_of_false_alarms_is_not_far_below_what_is_stated():
    rng = np.random.default_rng(7)
    wrong = sum(
        not consistency_of(
            "x", innovation_table(rng.normal(size=(200, 3))), false_alarm=0.5
        ).consistent
        for _ in range(100)
    )
    # Evenly divided among tests that depend on each other: well over half of what is stated.
    assert wrong > binom.ppf(1e-4, 100, 0.25)


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_wrong_standard_deviation_is_named_with_its_factor(factor):
    rng = np.random.default_rng(1)
    for _ in range(20):
        found = verdicts(factor * rng.normal(size=(120, 3)))
        size = [one for one in found if one.kind == ("understated" if factor > 1 else "overstated")]
        assert {one.component for one in size} == set(LABELS)
        for one in size:
            said = one.finding.data["scale"]
            # 1 / sqrt(2 n) of it is its standard deviation; five of them.
            assert abs(said / factor - 1.0) < 5.0 / np.sqrt(240.0)
            assert one.since == 0.0


def test_a_bias_of_one_standard_deviation_is_of_its_component_alone():
    rng = np.random.default_rng(2)
    for _ in range(20):
        found = verdicts(rng.normal((1.0, 0.0, 0.0), 1.0, (120, 3)))
        assert found[0].kind == "bias"
        assert found[0].component == LABELS[0]
        # The label is 'north, m': a name and a unit.
        name, unit = LABELS[0].split(", ")
        assert found[0].finding.code == "navigation.innovations-biased"
        assert found[0].finding.data["component"] == name
        assert found[0].finding.data["unit"] == f" {unit}"
        assert not [one for one in found if one.component != LABELS[0]]
        # The bias is no scatter.
        assert {one.kind for one in found} == {"bias"}


def test_coloured_noise_follows_itself():
    rng = np.random.default_rng(3)
    for _ in range(20):
        white = rng.normal(size=(300, 3))
        coloured = np.empty_like(white)
        coloured[0] = white[0]
        for k in range(1, len(white)):
            coloured[k] = 0.5 * coloured[k - 1] + np.sqrt(0.75) * white[k]
        found = [one for one in verdicts(coloured) if one.kind == "correlated"]
        assert len(found) >= 2
        assert {one.finding.code for one in found} == {"navigation.innovations-colored"}
        assert all(0.0 < one.finding.data["lag_1"] < 1.0 for one in found)


def test_an_observation_that_is_believed_too_much_is_taken_back():
    rng = np.random.default_rng(4)
    white = rng.normal(size=(301, 1))
    found = verdicts((white[1:] - white[:-1]) / np.sqrt(2.0))
    assert found[0].kind == "correlated"
    assert found[0].finding.code == "navigation.innovations-anticorrelated"


def test_a_jump_is_dated():
    rng = np.random.default_rng(5)
    for _ in range(20):
        u = rng.normal(size=(400, 3))
        u[250:, 1] += 1.5
        found = verdicts(u)
        assert found[0].kind == "change"
        assert found[0].component == LABELS[1]
        # The time of a jump of the mean by d standard deviations is known to a few 1/d² epochs.
        assert abs(found[0].since - 250.0) < 15.0
        assert found[0].p <= 0.01


def test_what_scatters_more_from_some_time_on_is_dated_too():
    rng = np.random.default_rng(6)
    u = rng.normal(size=(400, 3))
    u[200:] *= 2.5
    found = [one for one in verdicts(u) if one.kind == "change"]
    assert {one.component for one in found} == set(LABELS)
    assert all(abs(one.since - 200.0) < 20.0 for one in found)


def test_gross_errors_are_counted_and_are_not_held_against_the_filter():
    rng = np.random.default_rng(8)
    u = rng.normal(size=(300, 3))
    u[30::30] = 50.0
    out = consistency_of("x", innovation_table(u))
    assert out.consistent
    assert [one.kind for one in out.verdicts] == ["gross"] * 3
    assert all(one.since == one.finding.data["first"] == 30.0 for one in out.verdicts)
    counts = {(one.finding.data["gross"], one.finding.data["count"]) for one in out.verdicts}
    assert counts == {(9, 300)}
    assert all(one.finding.data["percent"] == pytest.approx(3.0) for one in out.verdicts)
    assert all(one.gross == 9 and one.count == 300 for one in out.components)
    assert out.nis["nis"].max() == pytest.approx(7500.0)


def test_a_gross_error_is_beyond_what_two_million_normal_innovations_reach():
    # 5.7e-7 of normal numbers: half a million to two million of them hold one.
    assert 0.5e6 < 1.0 / (2.0 * norm.sf(GROSS)) < 2e6
    u = np.tile([0.5, -0.5], 20)[:, None]
    u[[3, 7, 11, 15], 0] = (GROSS - 0.01, -GROSS + 0.01, GROSS + 0.01, -GROSS - 0.01)
    assert list(np.flatnonzero(gross_of(u))) == [11, 15]


def test_a_gross_error_is_beyond_those_that_are_usual_in_the_run():
    """Where all scatter three times as far as they should, the threshold is three times as far.

    The median of |u| is 0.6745 standard deviations of a normal number, here 3 of those expected.
    """
    usual = 3.0 * norm.ppf(0.75)
    u = np.tile([usual, -usual], 20)[:, None]
    u[[4, 9], 0] = (3.0 * GROSS - 0.01, 3.0 * GROSS + 0.01)
    assert list(np.flatnonzero(gross_of(u))) == [9]
    # Where they scatter less than they should it stays, and what is not there is no error.
    u = np.column_stack([0.1 * u[:, 0], np.full(len(u), np.nan)])
    u[9, 0] = GROSS + 0.01
    assert [tuple(at) for at in np.argwhere(gross_of(u))] == [(9, 0)]


def test_numbers_of_a_run():
    rng = np.random.default_rng(9)
    u = rng.normal(size=(95, 2))
    u[3, 0] = np.nan
    out = consistency_of("x", innovation_table(u), window=30)
    assert list(out.nis["components"][:5]) == [2, 2, 2, 1, 2]
    assert out.nis["nis"].iloc[5] == pytest.approx(u[5] @ u[5])
    assert out.nis["upper"].iloc[5] == pytest.approx(7.377759)
    # Three windows and the rest.
    assert list(out.windows["epochs"]) == [30, 30, 30, 5]
    assert list(out.windows["since"]) == [0.0, 30.0, 60.0, 90.0]
    first = u[:30].ravel()
    first = first[~np.isnan(first)]
    assert out.windows["nis"].iloc[0] == pytest.approx(np.mean(first**2))
    one = out.components[1]
    assert one.scale == pytest.approx(np.sqrt(np.mean(u[:, 1] ** 2)))
    assert one.bias == pytest.approx(u[:, 1].mean())
    assert one.bias_in_unit == pytest.approx(2.0 * u[:, 1].mean())
    assert one.inside == pytest.approx(np.mean(np.abs(u[:, 1]) <= 1.959964))
    assert one.scale_bounds[0] < 1.0 < one.scale_bounds[1]


def test_bounds_and_probabilities_are_those_of_normal_numbers():
    u = np.random.default_rng(10).normal(0.3, 1.2, size=(40, 2))
    u[7, 0] = np.nan
    out = consistency_of("x", innovation_table(u), window=2)
    for name, p in (("lower", 0.025), ("upper", 0.975)):
        np.testing.assert_allclose(out.nis[name][[6, 7]], chi2.ppf(p, [2, 1]), rtol=1e-9)
        # Of two epochs of two components, less one that is not there; by the number of them.
        np.testing.assert_allclose(
            out.windows[name].iloc[[2, 3]], chi2.ppf(p, [4, 3]) / [4.0, 3.0], rtol=1e-9
        )
    inside = out.nis["nis"].between(out.nis["lower"], out.nis["upper"])
    assert out.inside == pytest.approx(inside.mean())
    for k, one in enumerate(out.components):
        x = u[~np.isnan(u[:, k]), k]
        n, square = len(x), x @ x
        assert one.bias_bound == pytest.approx(norm.ppf(0.975) / np.sqrt(n))
        assert one.autocorrelation_bound == pytest.approx(norm.ppf(0.975) / np.sqrt(n))
        np.testing.assert_allclose(
            one.scale_bounds, np.sqrt(chi2.ppf([0.025, 0.975], n) / n), rtol=1e-9
        )
        # Each is the probability of as much to either side.
        assert one.bias_p == pytest.approx(2.0 * norm.sf(abs(x.mean()) * np.sqrt(n)))
        rho = one.autocorrelation[0]
        assert one.lag_p == pytest.approx(2.0 * norm.sf(abs(rho) * np.sqrt(n)))
        assert one.scale_p == pytest.approx(2.0 * min(chi2.sf(square, n), chi2.cdf(square, n)))
        # One lag for each 25 epochs.
        assert len(one.autocorrelation) == 1


def test_a_mean_of_what_follows_itself_is_farther_from_zero_by_chance():
    """By (1 + rho)/(1 - rho) in variance, as that of a first-order process; the scatter counts."""
    u = exactly(20, scale=1.2, mean=0.5, rho=0.4)
    (bias,) = [one for one in verdicts(u) if one.kind == "bias"]
    spread = 1.2 * np.sqrt(1.4 / 0.6)
    assert bias.p == pytest.approx(2.0 * norm.sf(0.5 * np.sqrt(600.0) / spread), rel=1e-6)
    # One whose scatter is small is no surer for that.
    (bias,) = [one for one in verdicts(exactly(21, scale=0.5, mean=0.3)) if one.kind == "bias"]
    assert bias.p == pytest.approx(2.0 * norm.sf(0.3 * np.sqrt(600.0)), rel=1e-6)


def test_a_mean_is_no_part_of_the_scatter_where_it_is_no_chance():
    n = 600
    (size,) = [one for one in verdicts(exactly(22, scale=1.2, mean=0.5)) if one.kind != "bias"]
    # About the mean, with one degree of freedom less.
    assert (size.kind, size.p) == (
        "understated",
        pytest.approx(2.0 * chi2.sf(n * 1.44, n - 1), rel=1e-6),
    )
    (size,) = verdicts(exactly(22, scale=0.8))
    assert (size.kind, size.p) == (
        "overstated",
        pytest.approx(2.0 * chi2.cdf(n * 0.64, n), rel=1e-6),
    )
    # A mean of 0.5 is not told as a scatter of sqrt(1 + 0.25).
    assert [one.kind for one in verdicts(exactly(22, mean=0.5))] == ["bias"]


def test_whiteness_is_ljung_and_box():
    # Of four numbers by hand: about their mean -1, 1, 1, -1, so rho_1 = -1/4 and rho_2 = -1/2.
    rho, p = whiteness(np.array([1.0, 3.0, 3.0, 1.0]), 2)
    assert rho == pytest.approx([-0.25, -0.5])
    q = 4.0 * 6.0 * (0.0625 / 3.0 + 0.25 / 2.0)
    assert p == pytest.approx(np.exp(-0.5 * q))


def test_too_few_epochs_say_so():
    out = consistency_of("x", innovation_table(np.zeros((4, 3))))
    assert out.consistent is False
    assert {one.kind for one in out.verdicts} == {"few"}


def test_all_of_a_record():
    table = innovation_table(np.random.default_rng(0).normal(size=(50, 3)))
    out = consistency_of_all({"a.position": table, "b.position": table})
    assert list(out) == ["a.position", "b.position"]
    assert out["b.position"].name == "b.position"


@pytest.mark.parametrize(
    ("given", "what"), [({"window": 1}, "window"), ({"false_alarm": 0.0}, "false")]
)
def test_what_makes_no_sense_is_refused(given, what):
    with pytest.raises(ConfigError, match=what):
        consistency_of("x", innovation_table(np.zeros((50, 1))), **given)
