"""What of the innovations is told as the first that does not agree."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from innovations import exactly, innovation_table

from strapdown.navigation.consistency import consistency_of_all, inconsistencies


def found(lasting=(), **tables):
    made = {name.replace("__", "."): table for name, table in tables.items()}
    return inconsistencies(consistency_of_all(made), made, lasting)


def normal(seed, n=600):
    return np.random.default_rng(seed).standard_normal((n, 3))


def test_nothing_where_all_is_as_expected():
    assert found(rtk__position=innovation_table(normal(1))) == ()


def test_what_is_no_chance_and_too_little_to_matter_is_left_out():
    # 1.25 times as much scatter is beyond chance for 600 epochs: its 99.9 % bound is 1.1.
    table = innovation_table(1.25 * normal(2))
    assert not consistency_of_all({"a": table})["a"].consistent
    assert found(rtk__position=table) == ()
    assert found(rtk__position=innovation_table(0.4 * normal(3))) == ()


def test_gross_errors_are_told_with_their_epochs():
    u = normal(4)
    u[[100, 333], 1] = 40.0
    (one,) = found(rtk__position=innovation_table(u))
    assert (one.name, one.aid, one.component, one.kind) == (
        "rtk.position",
        "rtk",
        "east, m",
        "gross",
    )
    assert one.epochs.tolist() == [100.0, 333.0]
    assert (one.since, one.until) == (100.0, 333.0)


def test_the_first_in_time_comes_first():
    late, early = normal(5), normal(6)
    late[400:, 0] += 2.0
    early[250, 2] = 60.0
    names = [
        x.name
        for x in found(rtk__position=innovation_table(late), odo__speed=innovation_table(early))
    ]
    assert names == ["odo.speed", "rtk.position"]


def test_a_change_ends_with_its_last_bad_window():
    u = normal(7)
    u[300:420, 0] += 4.0
    one = found(rtk__position=innovation_table(u))[0]
    assert one.kind == "change"
    # Windows have 30 epochs; the change is dated within a few epochs.
    assert one.since == pytest.approx(300.0, abs=5.0)
    assert 415.0 <= one.until <= 450.0


def test_noise_that_is_understated_says_by_how_much():
    ones = found(rtk__position=innovation_table(3.0 * normal(8)))
    assert {one.kind for one in ones} == {"understated"}
    # The standard deviation of a scatter of 600 is 3 %.
    assert ones[0].factor == pytest.approx(3.0, rel=0.1)
    assert ones[0].throughout


def kinds(u, lasting=()):
    return [one.kind for one in found(lasting, rtk__position=innovation_table(u))]


@pytest.mark.parametrize(
    ("little", "much", "kind"),
    [
        ({"scale": 1.49}, {"scale": 1.51}, "understated"),
        ({"mean": 0.49}, {"mean": 0.51}, "bias"),
        ({"mean": -0.49}, {"mean": -0.51}, "bias"),
        ({"rho": 0.29}, {"rho": 0.31}, "correlated"),
        ({"rho": -0.29}, {"rho": -0.31}, "correlated"),
        # sqrt((1 + 0.45) / (1 - 0.45)) = 1.62: with 0.61 of the scatter 0.99, with 0.63 1.02.
        ({"rho": 0.45, "scale": 0.61}, {"rho": 0.45, "scale": 0.63}, "correlated"),
    ],
)
def test_what_matters_begins_where_it_is_stated(little, much, kind):
    """Limits of scatter, mean and correlation, and of what a correlation does: those of the page.

    Of 600 all of these are far beyond chance.
    """
    assert kinds(exactly(11, **little)) == []
    assert kinds(exactly(11, **much)) == [kind]


def test_errors_that_are_stated_to_last_may_do_twice_as_much():
    """That is ``sqrt((1 + rho) / (1 - rho))`` = 2 for rho = 0.6; of moving averages at most 0.5."""
    # sqrt(1.45 / 0.55) = 1.624: with 1.22 of the scatter 1.98, with 1.24 it is 2.01.
    for scale, lasting, expected in (
        (1.22, ("rtk",), []),
        (1.22, ("gnss",), ["correlated"]),
        (1.24, ("rtk",), ["correlated"]),
    ):
        assert kinds(exactly(12, scale, rho=0.45), lasting) == expected


def test_the_remedy_is_the_scatter_of_independent_errors_that_do_as_much():
    (one,) = found(rtk__position=innovation_table(exactly(13, 1.2, rho=0.4)))
    assert one.factor == pytest.approx(1.2 * np.sqrt(1.4 / 0.6), rel=1e-6)
    # What takes itself back is no reason for a smaller one, and a bias for none.
    assert found(a__x=innovation_table(exactly(14, rho=-0.4)))[0].factor == pytest.approx(1.0)
    assert found(a__x=innovation_table(exactly(14, mean=0.8)))[0].factor == 1.0


def test_what_holds_throughout_comes_after_the_gross_errors_of_its_aid():
    u = 3.0 * normal(15)
    u[200, 0] = 900.0
    ones = found(rtk__position=innovation_table(u), odo__speed=innovation_table(3.0 * normal(16)))
    assert [(one.aid, one.kind) for one in ones] == [
        *[("odo", "understated")] * 3,
        ("rtk", "gross"),
        *[("rtk", "understated")] * 3,
    ]
