"""An engine that is kept between pieces: whoever goes on from a state gets that state's numbers."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from tests.town_drive import ARM, begun, fixes, increments

from strapdown.navigation.measurements.gnss import Gnss


def on(navigator, state, first, end):
    time, rows = increments()
    return navigator.advance(state, time[first:end], rows[first:end])


@pytest.fixture
def at_200():
    navigator, state = begun(Gnss(name="gnss", lever_arm=ARM))
    state = navigator.tell(state, "gnss", fixes())
    return navigator, on(navigator, state, 0, 200)[0]


def same(one, two):
    (a, piece), (b, other) = one, two
    np.testing.assert_array_equal(piece.history, other.history)
    np.testing.assert_array_equal(a.engine.filter.covariance, b.engine.filter.covariance)
    np.testing.assert_array_equal(a.engine.open_history, b.engine.open_history)
    np.testing.assert_array_equal(a.engine.mechanization, b.engine.mechanization)


def test_two_ways_from_one_state(at_200):
    navigator, state = at_200
    time, rows = increments()
    # The first takes the engine that gave the state, over other steps; the next has to make one.
    navigator.advance(state, time[200:300], 1.001 * rows[200:300])
    second = on(navigator, state, 200, 400)
    third = on(navigator, state, 200, 400)
    same(second, third)


def test_a_state_stays_what_it_was_while_another_goes_on(at_200):
    navigator, state = at_200
    kept = copy.deepcopy(state)
    on(navigator, state, 200, 400)
    for name in ("mechanization", "row", "open_history", "open_rows", "last"):
        np.testing.assert_array_equal(
            getattr(state.engine, name), getattr(kept.engine, name), err_msg=name
        )
    np.testing.assert_array_equal(state.engine.filter.covariance, kept.engine.filter.covariance)
    same(on(navigator, state, 200, 300), on(navigator, kept, 200, 300))


def test_a_state_that_was_stored_goes_on_like_the_one_that_was_not(at_200):
    navigator, state = at_200
    stored = pickle.loads(pickle.dumps(state))
    same(on(navigator, stored, 200, 400), on(navigator, state, 200, 400))


def test_of_another_navigator_it_is_another_engine(at_200):
    navigator, state = at_200
    other, _ = begun(Gnss(name="gnss", lever_arm=ARM))
    same(on(other, state, 200, 300), on(navigator, state, 200, 300))
