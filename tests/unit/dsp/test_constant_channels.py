"""A channel that never changes, beside others that have the noise of a sensor."""

from __future__ import annotations

import numpy as np

from strapdown.dsp.samples import constant_beside_noise

FEWEST = 10


def test_told_beside_noise_only() -> None:
    rng = np.random.default_rng(1)
    dead, alive, smooth = np.full(50, 2.0), rng.normal(size=50), np.sin(0.1 * np.arange(50))
    assert constant_beside_noise([dead, alive], FEWEST) == [True, False]
    assert constant_beside_noise([dead, alive, smooth], FEWEST) == [True, False, False]
    assert constant_beside_noise([dead, smooth], FEWEST) == [False, False]
    assert constant_beside_noise([dead, dead], FEWEST) == [False, False]


def test_changes_after_the_first_samples() -> None:
    late = np.append(np.zeros(49), 1.0)
    alive = np.random.default_rng(2).normal(size=50)
    assert constant_beside_noise([late, alive], FEWEST, 20) == [False, False]


def test_channels_too_short_say_nothing() -> None:
    """Fewer than five samples have no fourth difference (numpy warns of an empty mean)."""
    alive = np.random.default_rng(3).normal(size=50)
    for n in range(FEWEST):
        few = np.arange(float(n)) ** 3
        assert constant_beside_noise([few, few], FEWEST) == [False, False]
        assert constant_beside_noise([few, np.zeros(n)], FEWEST) == [False, False]
        assert constant_beside_noise([np.zeros(50), few], FEWEST) == [False, False]
        assert constant_beside_noise([np.zeros(50), few, alive], FEWEST) == [True, False, False]
