"""Bounds of a change of velocity, against sums that are done by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from strapdown.crash.delta_v_bound import (
    DeltaVBound,
    body_delta_v_bound,
    direction_bounds,
    resolved_delta_v_bound,
)
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import SampleEffects
from strapdown.crash.path import CrashPath
from strapdown.crash.pdof import AngleInterval, NedPdof, Pdof
from strapdown.errors import DataError

STEP = 0.01
# Unequal, as at the ends of a window; their sum is 0.035 s.
WEIGHTS = np.array([0.5, 1.0, 1.0, 0.75, 0.25]) * STEP


def effects_of(force, rest, noise=0.0):
    force, n = np.atleast_2d(force), len(WEIGHTS)
    p = len(force)
    return SampleEffects(
        names=tuple(f"unknown {k}" for k in range(p)),
        contributors=tuple(f"line {k}" for k in range(p)),
        force=np.repeat(force[:, None, :], n, axis=1),
        rate=np.zeros((p, n, 3)),
        rest_force=np.atleast_2d(rest),
        tilt=np.zeros((p, 3)),
        force_noise=np.full((n, 3), noise),
        rate_noise=np.zeros((n, 3)),
    )


def test_a_bias_that_was_felt_at_rest_too_is_taken_off_with_the_mean_at_rest():
    """The change is the sum of w (f - f_rest): with f and f_rest wrong alike nothing is left."""
    bias = [0.3, -0.2, 0.1]
    bound = body_delta_v_bound(effects_of(bias, bias), WEIGHTS)
    # Rounding of 0.3 m/s² · 0.035 s, squared.
    assert np.abs(bound.covariance).max() < (1e-16 * 0.3) ** 2 * 10.0


def test_an_error_at_rest_alone_counts_with_the_length_of_the_window():
    """f is right and f_rest is not: -T b; where they are wrong otherwise, T (a - b)."""
    a, b, length = np.array([0.4, 0.0, 0.1]), np.array([0.3, -0.2, 0.1]), 0.035
    alone = body_delta_v_bound(effects_of(np.zeros(3), b), WEIGHTS)
    np.testing.assert_allclose(alone.covariance, length**2 * np.outer(b, b), rtol=1e-12)
    both = body_delta_v_bound(effects_of([a, 0.0 * a], [b, b]), WEIGHTS)
    expected = length**2 * (np.outer(a - b, a - b) + np.outer(b, b))
    # Of zeros of a - b: rounding of the terms.
    np.testing.assert_allclose(both.covariance, expected, rtol=1e-12, atol=1e-18)
    assert list(both.by_contributor.index) == ["line 0", "line 1", "sensor noise"]


def test_noise_of_the_samples_adds_in_square_and_that_at_rest_counts_with_the_length():
    bound = body_delta_v_bound(
        effects_of(np.zeros(3), np.zeros(3), noise=2.0), WEIGHTS, rest_sd=(0.0, 0.5, 1.0)
    )
    # (0.25 + 1 + 1 + 0.5625 + 0.0625) · 1e-4 s² · 4, and (0.035 · 0.5)², (0.035 · 1)².
    samples = 2.875e-4 * 4.0
    expected = [samples, samples + 0.0175**2, samples + 0.035**2]
    np.testing.assert_allclose(bound.covariance, np.diag(expected), rtol=1e-12)
    np.testing.assert_allclose(bound.half_width, norm.ppf(0.975) * np.sqrt(expected), rtol=1e-9)


def test_along_a_direction_its_length_does_not_matter():
    table = pd.DataFrame(
        [np.diag([4.0, 1.0, 0.0]).ravel(), np.diag([0.0, 3.0, 9.0]).ravel()], index=["a", "b"]
    )
    bound = DeltaVBound(np.diag([4.0, 4.0, 9.0]), table)
    assert bound.along((0.0, 0.0, -5.0)) == pytest.approx(3.0)
    # (4 + 4 + 9) / 3 of the sum; 5 of 17 are of the first.
    assert bound.along((2.0, 2.0, 2.0)) == pytest.approx(np.sqrt(17.0 / 3.0))
    np.testing.assert_allclose(bound.shares((1.0, 1.0, 1.0)), [5.0 / 17.0, 12.0 / 17.0])
    for wrong in ((1.0, 2.0), (0.0, 0.0, 0.0), (np.inf, 0.0, 0.0)):
        with pytest.raises(DataError):
            bound.along(wrong)


FORCE, GRAVITY, SIGMA = 40.0, 9.80665, 1e-3
COUNT = 61


@pytest.mark.parametrize(
    ("direction", "interval", "expected"),
    [
        (Pdof(170.0, 0.0), (160.0, 190.0), (170.0, 160.0, 190.0)),
        # The direction is within half a turn of the middle of its bounds.
        (Pdof(-175.0, 0.0), (175.0, 195.0), (-175.0, -185.0, -165.0)),
        # Over ground: the azimuth, whatever it is relative to the heading.
        (NedPdof(350.0, 20.0, 0.0), (-20.0, 5.0), (350.0, 340.0, 365.0)),
    ],
)
def test_bounds_of_a_direction_are_about_it(direction, interval, expected):
    change = SimpleNamespace(
        pdof=direction, interval=SimpleNamespace(horizontal=AngleInterval(*interval))
    )
    assert direction_bounds(change) == expected


def noisy_path(anchor):
    """A level body that is pushed north, whose gyros make SIGMA of noise in every step.

    The noise is grown from the anchor both ways, by its definition: each step's adds to the
    attitude, and the attitude turns what is felt, ``dv = phi x f dt``. One unknown makes an error
    of velocity that grows evenly from the anchor.
    """
    k = np.arange(COUNT)
    time = STEP * k
    push = np.array([0.0, 1.0, 2.0])
    felt = np.array([FORCE, 0.0, -GRAVITY])
    grow = np.eye(9)
    grow[3:6, :3] = STEP * np.cross(np.eye(3), felt).T
    drive = np.zeros((9, 9))
    drive[:3, :3] = SIGMA**2 * np.eye(3)
    ahead = [np.zeros((9, 9))]
    for _ in range(COUNT):
        ahead.append(grow @ ahead[-1] @ grow.T + drive)
    mirror = np.diag([1.0] * 3 + [-1.0] * 3 + [1.0] * 3)
    noise = [ahead[j - anchor] if j >= anchor else mirror @ ahead[anchor - j] @ mirror for j in k]
    errors = np.zeros((1, COUNT, 9))
    errors[0, :, 3:6] = np.outer(time - time[anchor], push)
    table = pd.DataFrame(
        {"VN": FORCE * time, "VE": 0.0, "VD": 0.0}, index=pd.Index(time, name="time")
    )
    path = CrashPath(
        time,
        anchor,
        Entry(time=float(time[anchor]), velocity=(0.0, 0.0, 0.0), heading_deg=0.0),
        table,
        np.tile([1.0, 0.0, 0.0, 0.0], (COUNT, 1)),
        ("push",),
        ("push",),
        errors,
        np.array(noise),
        errors[:, anchor],
        (),
    )
    return path, push, felt


def noise_of_change(steps, before, felt):
    """Covariance of the sum of ``phi_i x f dt`` over so many steps, so many after the anchor.

    Noise of before turns all of them; that of the step j of n turns n - 1 - j:
    ``sigma² (n² k + (n - 1) n (2 n - 1) / 6)`` of [f dt x] [f dt x]'.
    """
    x = STEP * np.cross(np.eye(3), felt)
    total = steps**2 * before + (steps - 1) * steps * (2 * steps - 1) / 6
    return SIGMA**2 * total * x.T @ x


@pytest.mark.parametrize(
    ("anchor", "first", "last", "parts"),
    [
        (0, 20, 50, [(30, 20)]),
        (60, 10, 40, [(30, 20)]),
        (25, 5, 55, [(20, 0), (30, 0)]),
        (10, 10, 50, [(40, 0)]),
        (50, 10, 50, [(40, 0)]),
    ],
    ids=["after", "before", "both sides", "from the entry", "to the entry"],
)
def test_noise_of_a_window_is_what_is_new_and_what_the_attitude_carried_into_it(
    anchor, first, last, parts
):
    path, push, felt = noisy_path(anchor)
    start, end = path.time[first], path.time[last]
    bound = resolved_delta_v_bound(path, start, end)
    noise = bound.by_contributor.loc["sensor noise"].to_numpy().reshape(3, 3)
    expected = sum(noise_of_change(steps, before, felt) for steps, before in parts)
    np.testing.assert_allclose(noise, expected, rtol=1e-9, atol=1e-9 * expected.max())
    pushed = (end - start) * push
    row = bound.by_contributor.loc["push"].to_numpy().reshape(3, 3)
    np.testing.assert_allclose(row, np.outer(pushed, pushed), rtol=1e-9, atol=1e-12)


def test_between_samples_errors_run_on_straight_lines():
    path, push, _ = noisy_path(0)
    bound = resolved_delta_v_bound(path, 0.2025, 0.2075)
    row = bound.by_contributor.loc["push"].to_numpy().reshape(3, 3)
    np.testing.assert_allclose(row, 0.005**2 * np.outer(push, push), rtol=1e-9, atol=1e-15)


def test_a_window_lies_within_the_path_and_has_a_length():
    path, _, _ = noisy_path(0)
    assert resolved_delta_v_bound(path, path.time[0], path.time[-1]).sd[1] > 0.0
    for start, end in ((-STEP, 0.1), (0.1, 0.7), (0.2, 0.2), (0.3, 0.2)):
        with pytest.raises(DataError):
            resolved_delta_v_bound(path, start, end)
