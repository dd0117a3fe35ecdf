"""The bias of a high range, and how well it is known."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.sensors.range_merge import bias_from_lower_range


def test_the_mean_and_its_sd_are_right_over_many_draws():
    time, runs, sds = np.arange(400) / 200.0, [], []
    rng = np.random.default_rng(2)
    motion = 0.5 * np.sin(5 * time)[:, None]
    for _ in range(400):
        low = motion + 0.05 * rng.normal(size=(400, 3))
        high = motion + [11.91, -3.0, 0.0] + 0.7 * rng.normal(size=(400, 3))
        found = bias_from_lower_range(time, high, low, np.ones((400, 3), dtype=bool))
        runs.append(np.subtract(found.bias, [11.91, -3.0, 0.0]))
        sds.append(found.sd)
    z = np.array(runs) / np.array(sds)
    # The larger of two estimates of the sd is 1 to 1.1 of it: the variance is a little below one;
    # 1200 normal deviates have it to sqrt(2/1200) = 0.041.
    assert 0.75 < z.var() < 1.0 + 5 * 0.041
    assert abs(z.mean()) < 5 / np.sqrt(z.size)


def test_a_step_that_no_noise_averages_out_counts():
    time = np.arange(100) / 200.0
    low = np.zeros((100, 3))
    high = np.full((100, 3), 0.8)
    use = np.ones((100, 3), dtype=bool)
    found = bias_from_lower_range(time, high, low, use, quantization=(0.8, 0.4, 0.2))
    assert found.sd == pytest.approx(np.array([0.8, 0.4, 0.2]) / np.sqrt(12))


def test_too_few_samples_give_none():
    use = np.ones((100, 3), dtype=bool)
    use[4:, 2] = False
    y = np.zeros((100, 3))
    assert bias_from_lower_range(np.arange(100.0), y, y, use) is None
