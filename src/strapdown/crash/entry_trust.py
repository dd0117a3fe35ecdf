"""Which fixes before a crash are to be believed, from what the inertial sensors felt."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.mechanization import NavigationRun

Array = NDArray[np.float64]

#: Beyond these a receiver is not believed: m/s², without gravity, and m/s³.
LARGEST_ACCELERATION = 50.0
LARGEST_JERK = 20.0
#: Acceleration is the mean over this many seconds, jerk the change between two such means that
#: follow one another, over their distance: first and second difference of the velocity.
AVERAGED = 0.05
#: For so long, s, after an excess nothing is believed either.
RECOVERY = 1.0


def strain(run: NavigationRun) -> tuple[Array, Array]:
    """Acceleration and jerk of a run, free of gravity.

    Parameters
    ----------
    run : NavigationRun
        Its heading and velocity may be anything: only changes of the velocity count.

    Returns
    -------
    acceleration, jerk : ndarray, (n,), m/s², m/s³
        At each stamp, from the samples up to it: lengths of ``(v(t) - v(t-h)) / h`` and of
        ``(v(t) - 2 v(t-h) + v(t-2h)) / h²`` with h = 50 ms; zero where the run begins later.
        White noise of density N makes ``√(2/h) N/h`` of jerk on each axis: 3.6 m/s³ for
        0.028 m/s²/√Hz. The first zero of the mean is at 20 Hz.
    """
    time, velocity = run.time, run.history[:, 3:6]

    def at(t: Array) -> Array:
        return np.column_stack([np.interp(t, time, v) for v in velocity.T])

    once, twice = at(time - AVERAGED), at(time - 2.0 * AVERAGED)
    acceleration = np.linalg.norm(velocity - once, axis=1) / AVERAGED
    jerk = np.linalg.norm(velocity - 2.0 * once + twice, axis=1) / AVERAGED**2
    acceleration[time < time[0] + AVERAGED] = 0.0
    jerk[time < time[0] + 2.0 * AVERAGED] = 0.0
    return acceleration, jerk


def judge_fixes(
    instants: Array, quality: Array, run: NavigationRun, impact: float, anchor: float, slack: float
) -> list[tuple[Finding, ...]]:
    """Find out of each fix why it is not believed.

    Parameters
    ----------
    instants : ndarray, (m,), s
        To which the fixes belong, from the beginning of the run on.
    quality : ndarray, (m,)
    run : NavigationRun
        Up to the anchor.
    impact, anchor : float, s
    slack : float, s
        How far an instant may be wrong.

    Returns
    -------
    list of tuple of Finding
        Empty where there is nothing against it.
    """
    acceleration, jerk = strain(run)
    hard, rough = acceleration > LARGEST_ACCELERATION, jerk > LARGEST_JERK
    strained = np.flatnonzero(hard | rough)
    why: list[tuple[Finding, ...]] = []
    for t, q in zip(instants, quality, strict=True):
        if t >= impact:
            why.append((_reason("crash.fix-after-impact"),))
        elif t >= impact - slack:
            why.append((_reason("crash.fix-perhaps-after-impact"),))
        elif t > anchor:
            why.append((_reason("crash.fix-after-anchor"),))
        elif q == 0:
            why.append((_reason("crash.fix-without-quality"),))
        else:
            recent = strained[
                (run.time[strained] >= t - RECOVERY) & (run.time[strained] <= t + slack)
            ]
            why.append(_excess(run.time, acceleration, jerk, recent))
    return why


def _reason(code: str, **values: float) -> Finding:
    return Finding(code, severity="note", data=values)


def _excess(
    time: Array, acceleration: Array, jerk: Array, at: NDArray[np.intp]
) -> tuple[Finding, ...]:
    """What exceeded a limit at these stamps, and when it last did."""
    if not at.size:
        return ()
    most, roughest = float(acceleration[at].max()), float(jerk[at].max())
    said = {"acceleration": most, "jerk": roughest, "last": float(time[at[-1]])}
    if most > LARGEST_ACCELERATION and roughest > LARGEST_JERK:
        return (_reason("crash.fix-under-acceleration-and-jerk", **said),)
    hard = most > LARGEST_ACCELERATION
    return (_reason("crash.fix-under-acceleration" if hard else "crash.fix-under-jerk", **said),)


def record_of_fixes(stamps: Array, why: list[tuple[Finding, ...]]) -> pd.DataFrame:
    """Begin the record of the fixes: all that are not believed have no weight."""
    used = np.array([not w for w in why], dtype=np.bool_)
    return pd.DataFrame(
        {
            "used": used,
            "why": pd.Series(why, index=stamps, dtype=object),
            "position_weight": used.astype(np.float64),
            "velocity_weight": used.astype(np.float64),
            "position_misfit": np.full(len(why), np.nan),
            "velocity_misfit": np.full(len(why), np.nan),
        },
        index=pd.Index(stamps, name="time"),
    )
