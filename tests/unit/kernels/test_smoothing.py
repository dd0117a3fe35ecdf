"""The way back of a smoother, against all observations solved at once."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown._kernels.smoothing import (
    BEGIN,
    CARRIED,
    CORE,
    COVARIANCE,
    GROWTH,
    KIND,
    UPDATE,
    begin_of_move,
    begin_of_taken,
    inverse,
    pack,
    padded,
    row_width,
    smooth_back,
    unpack,
)

N = CORE + 3


def system(seed, steps=12, known=()):
    """Growths, updates and transformations of a filter, and the joint problem that they solve."""
    rng = np.random.default_rng(seed)
    sd = np.exp(rng.uniform(-6.0, 3.0, N))
    mix = np.eye(N) + 0.3 * rng.normal(size=(N, N))
    P = mix @ np.diag(np.square(np.where(np.isin(np.arange(N), known), 0.0, 1.0))) @ mix.T
    P = P * np.outer(sd, sd)
    entries = [(BEGIN, P.copy(), None, np.zeros(N))]
    truth = np.linalg.cholesky(P + 1e-12 * np.diag(np.square(sd))) @ rng.normal(size=N)
    # All states at once: the prior, the noise of each growth, and each observation.
    joint, mean = P.copy(), np.zeros(N)
    x = np.zeros(N)
    states = [np.eye(N)]
    for k in range(steps):
        Phi = np.eye(N)
        Phi[:CORE] += 0.2 * rng.normal(size=(CORE, N)) * sd[:CORE, None] / sd[None, :]
        Phi[CORE:, CORE:] = np.diag(rng.uniform(0.8, 1.0, N - CORE))
        Q = np.diag(np.square(0.1 * sd) * rng.uniform(0.0, 1.0, N))
        if k == steps // 2:
            # A receiver's outage: nothing for some growths.
            Q *= 10.0
        moves = [(GROWTH, Phi, Q)]
        if k % 3 == 1:
            # At one instant the errors of a triad take parts of all others.
            T = np.eye(N)
            T[CORE:] += 0.2 * rng.normal(size=(3, N)) * sd[CORE:, None] / sd[None, :]
            moves.append((CARRIED, T, np.diag(np.r_[np.zeros(CORE), np.square(0.1 * sd[CORE:])])))
        for what, Phi, Q in moves:
            truth = Phi @ truth + np.sqrt(np.diagonal(Q)) * rng.normal(size=N)
            P = Phi @ P @ Phi.T + Q
            x = Phi @ x
            entries.append((what, P.copy(), Phi, np.zeros(N)))
            size = len(joint)
            grown = np.zeros((size + N, size + N))
            grown[:size, :size] = joint
            here = states[-1]
            lift = Phi @ here
            grown[size:, :size] = lift @ joint
            grown[:size, size:] = grown[size:, :size].T
            grown[size:, size:] = lift @ joint @ lift.T + Q
            mean = np.r_[mean, lift @ mean]
            joint = grown
            states = [np.hstack([s, np.zeros((N, N))]) for s in states]
            states.append(np.hstack([np.zeros((N, size)), np.eye(N)]))
        if steps // 3 < k < 2 * steps // 3:
            continue
        H = rng.normal(size=(2, N)) / sd
        R = np.diag([0.5, 0.02])
        z = H @ truth + np.sqrt(np.diagonal(R)) * rng.normal(size=2)
        S = H @ P @ H.T + R
        K = np.linalg.solve(S, H @ P).T
        taken = K @ (z - H @ x)
        before = P.copy()
        keep = np.eye(N) - K @ H
        P = keep @ P @ keep.T + K @ R @ K.T
        x = x + taken
        # Errors that are taken off: what is left of the estimate is nothing.
        entries.append((UPDATE, P.copy(), before, taken))
        G = H @ states[-1]
        S = G @ joint @ G.T + R
        gain = np.linalg.solve(S, G @ joint).T
        mean = mean + gain @ (z - G @ mean)
        left = np.eye(len(joint)) - gain @ G
        joint = left @ joint @ left.T + gain @ R @ gain.T
    return entries, states, mean, joint


def smoothed(entries):
    # What of a row is not of its kind is not read.
    rows = np.full((len(entries), row_width(N)), np.nan)
    move, taken_at = begin_of_move(N), begin_of_taken(N)
    for row, (what, P, moved, taken) in zip(rows, entries, strict=True):
        row[KIND] = what
        pack(P, row, COVARIANCE)
        if what == GROWTH:
            row[move : move + CORE * N] = moved[:CORE].ravel()
            row[move + CORE * N : move + CORE * N + N - CORE] = np.diagonal(moved)[CORE:]
        elif what == CARRIED:
            row[move], row[move + 1 : move + 1 + 3 * N] = CORE, moved[CORE:].ravel()
        elif what == UPDATE:
            pack(moved, row, move)
            row[taken_at : taken_at + N] = taken
    k = len(entries)
    errors, covariance = np.empty((k, N)), np.empty((k, N, N))
    told, less = np.zeros(padded(N)), np.zeros((N, padded(N)))
    smooth_back(rows, N, told, less, np.arange(k), errors, covariance)
    assert not told.any()
    assert not less.any()
    return errors, covariance


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("known", [(), (2, 10)])
def test_it_is_the_solution_of_everything_at_once(seed, known):
    entries, states, mean, joint = system(seed, known=known)
    errors, covariance = smoothed(entries)
    sd = np.sqrt(np.array([np.diagonal(e[1]) for e in entries]).max(axis=0))
    # The estimate of the filter at each entry: the errors that were taken off up to it.
    x, place = np.zeros(N), -1
    for k, (what, _, moved, taken) in enumerate(entries):
        if what in (GROWTH, CARRIED):
            x = moved @ x
        x = x + taken
        place += what != UPDATE
        true = states[place] @ mean
        P = states[place] @ joint @ states[place].T
        # Rounding of covariances over eight orders of magnitude, some 1e-15 each, times the
        # condition of what is inverted at an update, some 1e5.
        assert np.abs((x + errors[k] - true) / sd).max() < 1e-8
        assert np.abs((covariance[k] - P) / np.outer(sd, sd)).max() < 1e-8
        assert np.diagonal(covariance[k] - entries[k][1]).max() <= 1e-9 * np.square(sd).max()


def test_an_update_that_tells_nothing_changes_nothing():
    entries, *_ = system(7)
    errors, covariance = smoothed(entries)
    at = next(k for k, e in enumerate(entries) if e[0] == UPDATE)
    P = entries[at][1]
    more = [*entries[: at + 1], (UPDATE, P, P, np.zeros(N)), *entries[at + 1 :]]
    again, spread = smoothed(more)
    kept = [k for k in range(len(more)) if k != at + 1]
    sd = np.sqrt(np.diagonal(entries[0][1]))
    assert np.abs((again[kept] - errors) / sd).max() < 1e-8
    assert np.abs((spread[kept] - covariance) / np.outer(sd, sd)).max() < 1e-8


def test_nothing_is_told_across_a_begin():
    first, *_ = system(1)
    second, *_ = system(2)
    alone, _ = smoothed(first)
    both, _ = smoothed([*first, *second])
    np.testing.assert_array_equal(both[: len(first)], alone)


def test_what_is_known_exactly_has_no_inverse_and_does_no_harm():
    rng = np.random.default_rng(0)
    A = rng.normal(size=(N, N - 3))
    P = A @ A.T
    P[4], P[:, 4] = 0.0, 0.0
    out = np.empty((N, N))
    inverse(P, out)
    # A generalised inverse of a matrix of less than full rank.
    np.testing.assert_allclose(P @ out @ P, P, atol=1e-8)
    assert not out[4].any()


def test_packing():
    P = np.arange(N * N, dtype=float).reshape(N, N)
    P = P + P.T
    row, out = np.zeros(N * (N + 1) // 2 + 2), np.empty((N, N))
    pack(P, row, 1)
    unpack(row, 1, out)
    np.testing.assert_array_equal(out, P)
    assert row[0] == row[-1] == 0.0
