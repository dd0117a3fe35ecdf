"""Each fault does what it says within its interval, and nothing outside."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.simulation.sensor_faults import (
    Burst,
    Dead,
    DropOut,
    Jump,
    Noisy,
    Saturated,
    Stuck,
    inject_faults,
)
from strapdown.tables import imu_table

N = 4000
TIME = np.arange(N) / 100.0
WITHIN = (TIME >= 10.0) & (TIME < 30.0)


def table():
    rng = np.random.default_rng(0)
    return imu_table(TIME, rng.standard_normal((N, 3)), rng.standard_normal((N, 3)))


def broken(kind, **more):
    imu = table()
    out = inject_faults(imu, [kind("gyro_y", 10.0, 30.0, **more)], seed=3)
    before, after = imu["gyro_y"].to_numpy(), out["gyro_y"].to_numpy()
    assert np.array_equal(after[~WITHIN], before[~WITHIN])
    assert out.drop(columns="gyro_y").equals(imu.drop(columns="gyro_y"))
    assert out.attrs == imu.attrs
    assert imu.equals(table())
    return before[WITHIN], after[WITHIN]


def test_what_repeats_is_nothing_or_is_none():
    before, after = broken(Stuck)
    assert (after == before[0]).all()
    assert (broken(Dead)[1] == 0.0).all()
    assert np.isnan(broken(DropOut)[1]).all()


def test_what_is_added():
    before, after = broken(Jump, size=0.3)
    assert np.array_equal(after, before + 0.3)
    before, after = broken(Noisy, sd=2.0)
    # 2000 samples know a standard deviation to 1.6 %: 4 of these.
    assert (after - before).std() == pytest.approx(2.0, rel=0.065)
    before, after = broken(Saturated, limit=0.5)
    assert np.array_equal(after, np.clip(before, -0.5, 0.5))
    before, after = broken(Burst, size=9.0, share=0.25)
    struck = after != before
    # A share of 2000 draws is known to √(0.25 · 0.75 / 2000), 1 %: 4 of these.
    assert struck.mean() == pytest.approx(0.25, abs=0.04)
    assert np.abs(after - before)[struck] == pytest.approx(9.0)
    assert {-1.0, 1.0} == set(np.sign(after - before)[struck])


def test_seeds():
    imu = table()
    faults = [Noisy("gyro_x", sd=1.0), Noisy("gyro_y", sd=1.0)]
    one, same, other = (inject_faults(imu, faults, seed=s) for s in (1, 1, 2))
    assert one.equals(same)
    assert not one.equals(other)
    added = (one - imu)[["gyro_x", "gyro_y"]].to_numpy()
    # Streams of their own: 4000 products of independent draws have a mean of 0.016; 4 of these.
    assert abs((added[:, 0] * added[:, 1]).mean()) < 0.064


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Stuck("gyro_w"), "unknown channel '"),
        (lambda: Stuck("gyro_x", 2.0, 2.0), "has no duration"),
        (lambda: Jump("gyro_x", size=np.inf), "size"),
        (lambda: Noisy("gyro_x", sd=-1.0), "sd"),
        (lambda: Saturated("gyro_x", limit=0.0), "is not positive"),
        (lambda: Burst("gyro_x", share=2.0), "is not between 0 and 1"),
        (lambda: inject_faults(table(), [Dead("gyro_x", 50.0)]), "has no gyro_x between"),
        (lambda: inject_faults(table()[["gyro_x"]], [Dead("accel_x")]), "has no accel_x"),
    ],
)
def test_what_is_refused(make, word):
    with pytest.raises(ConfigError, match=word):
        make()
