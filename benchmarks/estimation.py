"""Estimation: an epoch of each covariance form against numpy, and its kernels against C."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.c_library import c_library
from benchmarks.measure import Ratio, by_turns

# A job is short enough for a turn of the processor.
EPOCHS = 400
FORMS = ("joseph", "ud", "wd")
# Against C, whose form is the plain one and which knows its size: Joseph's step is two changes
# of rank one for one, an orthogonalisation twice the work of two products.
LIMITS = {"joseph": 3.0, "ud": 4.0, "wd": 4.0}
BLOCKS = {
    # Rows and columns of what is not zero: position, velocity, attitude, drifts, biases; and the 17
    # states of Chernodarov: velocity, two quaternions, drifts, biases.
    15: ((0, 3, 3, 6), (3, 6, 3, 9), (3, 6, 12, 15), (6, 9, 3, 9), (6, 9, 9, 12)),
    17: ((0, 3, 0, 7), (0, 3, 14, 17), (3, 7, 3, 7), (3, 7, 11, 14), (7, 11, 0, 3), (7, 11, 7, 11)),
}


def problem(n: int) -> tuple[np.ndarray, ...]:
    """P, Phi, Q, z, H and R of an inertial filter: zeros where it has them."""
    rng = np.random.default_rng(n)
    Phi = np.eye(n)
    for top, bottom, left, right in BLOCKS[n]:
        Phi[top:bottom, left:right] += 0.003 * rng.normal(size=(bottom - top, right - left))
    driven = np.zeros(n)
    driven[3:9] = 1e-3
    return np.eye(n), Phi, np.diag(driven), np.ones(3), np.eye(n)[:3].copy(), np.ones(3)


def dense(P: Any, Phi: Any, Q: Any, x: Any, z: Any, H: Any, R: Any) -> tuple[Any, Any]:
    """Joseph's form as it stands in a textbook."""
    one = np.eye(len(x))
    P = Phi @ P @ Phi.T + Q
    for h, value, r in zip(H, z, R, strict=True):
        g = P @ h
        K = g / (h @ g + r)
        x = x + K * (value - h @ x)
        A = one - np.outer(K, h)
        P = A @ P @ A.T + r * np.outer(K, K)
    return P, x


def ratios() -> Iterator[Ratio]:
    library = c_library("covariance_limit.c")
    for n in BLOCKS:
        yield from against_numpy(n)
        if library is not None:
            yield from against_c(n, library)
    yield robust()


def against_numpy(n: int) -> Iterator[Ratio]:
    from strapdown.estimation.covariance import COVARIANCES

    P, Phi, Q, z, H, R = problem(n)
    for name in FORMS:
        form = COVARIANCES[name]()
        results: dict[str, Any] = {}

        def ours(form: Any = form, results: dict[str, Any] = results) -> None:
            state, x = form.begin(P), np.zeros(n)
            for _ in range(EPOCHS // 2):
                state, x, _ = form.epoch(state, Phi, Q, x, z, H, R)
            results["ours"] = form.matrix(state)

        def theirs(results: dict[str, Any] = results) -> None:
            matrix, x = P, np.zeros(n)
            for _ in range(EPOCHS // 2):
                matrix, x = dense(matrix, Phi, Q, x, z, H, R)
            results["theirs"] = matrix

        taken = [t / (EPOCHS // 2) * 1e6 for t in by_turns(ours, theirs, rounds=15)]
        np.testing.assert_allclose(results["ours"], results["theirs"], rtol=1e-9, atol=1e-12)
        what = f"epoch of {n} states, 3 observations, {name}"
        yield Ratio(what, taken[0], "numpy, Joseph's form", taken[1], "µs", 0.5)


def against_c(n: int, library: ctypes.CDLL) -> Iterator[Ratio]:
    P, Phi, Q, z, H, R = problem(n)
    pointer = ctypes.POINTER(ctypes.c_double)
    run = library[f"epochs{n}"]
    run.argtypes = [ctypes.c_long, *[pointer] * 3, ctypes.c_double, *[pointer] * 2]
    run.restype = None
    f, q, obs = (a.ctypes.data_as(pointer) for a in (Phi, Q, z))
    state, estimate = P.copy(), np.zeros(n)

    def in_c() -> None:
        state[:], estimate[:] = P, 0.0
        at = (state.ctypes.data_as(pointer), estimate.ctypes.data_as(pointer))
        run(EPOCHS, f, q, obs, R[0], *at)

    for name, many in compiled().items():
        out, x = np.empty((n, n)), np.zeros(n)

        def ours(many: Any = many, out: Any = out, x: Any = x) -> None:
            out[:], x[:] = P, 0.0
            many(EPOCHS, Phi, Q, x, z, H, R, out)

        taken = [t / EPOCHS * 1e6 for t in by_turns(ours, in_c, rounds=41)]
        np.testing.assert_allclose(x, estimate, rtol=1e-6, atol=1e-9)
        what = f"the same, kernels, {n} states, {name}"
        yield Ratio(what, taken[0], "plain form in C", taken[1], "µs", LIMITS[name])


def compiled() -> dict[str, Any]:
    """Epochs one after the other without Python between them; P = 1 is its own factors."""
    from numba import njit

    from strapdown._kernels import covariance

    dense_predict, dense_update = covariance.dense_predict, covariance.dense_update
    udu_predict, ud_update = covariance.udu_predict, covariance.ud_update
    wd_epoch = covariance.wd_epoch

    @njit  # type: ignore[untyped-decorator]
    def joseph(count, Phi, Q, x, z, H, R, state):  # type: ignore[no-untyped-def]
        told, after = np.empty((3, z.shape[0])), np.empty_like(state)
        for _ in range(count):
            dense_predict(state, Phi, Q, after)
            dense_update(after, x, z, H, R, True, told)
            state[:] = after

    @njit  # type: ignore[untyped-decorator]
    def ud(count, Phi, Q, x, z, H, R, state):  # type: ignore[no-untyped-def]
        told, after = np.empty((3, z.shape[0])), np.empty_like(state)
        for _ in range(count):
            udu_predict(state, Phi, Q, after)
            ud_update(after, x, z, H, R, told)
            state[:] = after

    @njit  # type: ignore[untyped-decorator]
    def wd(count, Phi, Q, x, z, H, R, state):  # type: ignore[no-untyped-def]
        told, after = np.empty((3, z.shape[0])), np.empty_like(state)
        for _ in range(count):
            wd_epoch(state, Phi, Q, True, x, z, H, R, told, after)
            state[:] = after

    return {"joseph": joseph, "ud": ud, "wd": wd}


def robust() -> Ratio:
    """What asking a rule costs: three good observations under Hampel's function."""
    from strapdown.estimation.covariance import COVARIANCES
    from strapdown.estimation.robust import Hampel, RobustUpdate

    P, _, _, z, H, R = problem(15)
    form, rule, x = COVARIANCES["ud"](), RobustUpdate(Hampel()), np.zeros(15)
    state = form.begin(P)

    def asked() -> None:
        for _ in range(EPOCHS // 2):
            form.update(state, x, z, H, R, rule)

    def plain() -> None:
        for _ in range(EPOCHS // 2):
            form.update(state, x, z, H, R)

    ours, theirs = (t / (EPOCHS // 2) * 1e6 for t in by_turns(asked, plain, rounds=15))
    return Ratio("update of 15 states, 3 observations, robust", ours, "plain", theirs, "µs", 4.0)
