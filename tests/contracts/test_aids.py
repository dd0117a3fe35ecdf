"""What every aid promises, held for every entry of the table."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from aid_views import SITUATIONS, Moment, difference_columns, moment_of, view_of
from strapdown.aiding.aid import Aid, TableAid, WatchingAid
from strapdown.aiding.aids import AIDS
from strapdown.aiding.gnss import Gnss
from strapdown.aiding.no_slip import NoSlip
from strapdown.mechanization import MECHANIZATIONS
from strapdown.tables import gnss_table

#: Where sensors sit in the vehicle of these tests, and how they are turned.
PLACE, TURN = (1.3, -0.4, -0.2), (3.0, -6.8, 5.4)


@dataclass(frozen=True)
class Case:
    """How an aid is tried.

    Attributes
    ----------
    aid : Aid
        With every state that it can have.
    values : callable
        Of a `Moment`: what it is told where all that it assumes is true, a row of its epochs.
    """

    aid: Aid
    values: Callable[[Aid, Moment], np.ndarray]


def fix(aid, moment):
    place, velocity = moment.antenna(aid.lever_arm)
    table = gnss_table(
        [moment.time, moment.time + 1.0], [place] * 2, [velocity] * 2, [0.1] * 3, [0.1] * 3
    )
    epochs = aid.epochs(table)
    return epochs.values[:2]


def felt(aid, moment):
    return np.concatenate([moment.rate, moment.force])[None, :]


CASES = {
    "gnss": Case(Gnss(name="rtk", lever_arm=(0.0, 0.0, 0.0)), fix),
    "no_slip": Case(
        NoSlip(
            name="wheels",
            lever_arm=tuple(moment_of("level").axle_from_sensors(PLACE, TURN)),
            roll_deg=TURN[0],
            pitch_deg=TURN[1],
            yaw_deg=TURN[2],
            mounting_sd_deg=(5.0, 5.0),
            largest_rate_deg=90.0,
        ),
        felt,
    ),
}
CASE_NAMES = list(CASES)


def test_every_kind_is_tried():
    assert set(CASES) == set(AIDS)


@pytest.mark.parametrize("kind", CASE_NAMES)
def test_it_says_what_it_is(kind):
    aid = CASES[kind].aid
    assert type(aid) is AIDS[kind]
    assert aid.kind == kind
    assert aid.summary and aid.source
    assert isinstance(aid, TableAid | WatchingAid)
    assert all(s.block.name.startswith(f"{aid.name}.") for s in aid.states())


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize("mechanization", list(MECHANIZATIONS))
@pytest.mark.parametrize("kind", CASE_NAMES)
def test_what_is_true_is_what_is_computed(kind, mechanization, situation):
    """A level of metres at the Earth's radius is rounded by 1e-9 m, and what follows from it."""
    aid = CASES[kind].aid
    moment = moment_of(situation, PLACE, TURN)
    view = view_of(MECHANIZATIONS[mechanization](), aid, moment)
    for values in CASES[kind].values(aid, moment):
        for one in aid.observe(view, values):
            np.testing.assert_allclose(one.z, 0.0, atol=2e-8)
            assert (one.R > 0.0).all()
            assert one.name.startswith(f"{aid.name}.")
            assert len(one.labels) == len(one.z) == len(one.R) == len(one.H)


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize("mechanization", list(MECHANIZATIONS))
@pytest.mark.parametrize("kind", CASE_NAMES)
def test_every_column_is_how_an_error_changes_the_difference(kind, mechanization, situation):
    """Where the states of the aid are estimated to be something, too.

    What is measured along the axes of a place turns with it, by the speed over the Earth's radius
    a metre: 20 m/s and the meridians' convergence at 48 deg make 7e-6, which no aid need know.
    """
    aid = CASES[kind].aid
    moment = moment_of(situation, PLACE, TURN)
    used = MECHANIZATIONS[mechanization]()
    estimated = 0.05
    for values in CASES[kind].values(aid, moment):
        for k, one in enumerate(aid.observe(view_of(used, aid, moment, None, estimated), values)):
            found = difference_columns(used, aid, moment, values, k, estimated)
            np.testing.assert_allclose(found[:, :3], one.H[:, :3], rtol=1e-6, atol=1e-5)
            np.testing.assert_allclose(found[:, 3:], one.H[:, 3:], rtol=1e-6, atol=2e-6)
