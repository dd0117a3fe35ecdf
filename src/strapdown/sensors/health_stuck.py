"""Channels that repeat one reading for longer than their noise allows, or are dead."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.equal_runs import equal_runs, longest_by_chance
from strapdown.sensors.health_log import ChannelFault, HealthLog
from strapdown.sensors.tail_limit import tail_limit

Array = NDArray[np.float64]

__all__ = ["find_missing", "find_stuck"]

# Samples about a run from which the share of repetitions is taken.
AROUND = 256
LEAST_RUN = 10  # samples
# Ranks of the runs from whose lengths the tail is taken: ten that are stuck hardly move the 20th
# longest, whose place in a geometric tail is known to a fifth; runs are whole numbers besides.
NEAR_RANK, FAR_RANK, TAIL_SLACK = 200, 20, 1.5
# Of the share of repetitions in so few samples, this many standard deviations are added.
SHARE_SLACK = 4.0
# Drop-outs that are nearer to each other than this are one burst.
SAME_BURST = 1.0  # s


def find_missing(log: HealthLog) -> list[ChannelFault]:
    """Samples that are no finite number; bursts of them within a second are one."""
    faults = []
    join = max(round(SAME_BURST * log.rate), 1)
    for k in range(len(log.names)):
        gone = ~np.isfinite(log.values[k])
        if not gone.any():
            continue
        at = np.flatnonzero(gone)
        for part in np.split(at, np.flatnonzero(np.diff(at) > join) + 1):
            a, b = int(part[0]), int(part[-1])
            code, said = "sensors.samples-missing", {"count": part.size, "of": b - a + 1}
            faults.append(log.fault(k, "missing", (a, b), float(part.size), 0.0, code, **said))
    return faults


def find_stuck(log: HealthLog) -> list[ChannelFault]:
    """Runs of one value that neither its noise nor its steps nor a rest explains.

    A run is stuck where it is longer than each of

    - ``1 + ln(P/n)/ln(r)``, with r the share of samples that repeat the one before: of the channel
      in the 256 samples before and after the run (where they are independent, the sum of the
      squares of their histogram), and of its two neighbours during the run, for what keeps all
      of them still is a rest in coarse steps;
    - what the tail of its own runs over the record tells (`tail_limit` of the 200th and the
      20th longest; of fewer than 2000, of those that a tenth and a hundredth exceed);
    - 10 samples.
    """
    same = np.zeros((len(log.names), log.time.size), dtype=bool)
    same[:, 1:] = log.values[:, 1:] == log.values[:, :-1]
    sums = np.concatenate([np.zeros((len(same), 1)), np.cumsum(same, axis=1)], axis=1)
    faults = []
    for k in range(len(log.names)):
        faults += _channel(log, k, sums)
    return faults


def _channel(log: HealthLog, k: int, sums: Array) -> list[ChannelFault]:
    n = log.time.size
    starts, lengths = equal_runs(log.values[k])
    whole = int(lengths.max()) >= n - int((~np.isfinite(log.values[k])).sum())
    tail = 0.0 if whole else _tail(lengths, log.false_alarm)
    most = np.flatnonzero(lengths >= max(LEAST_RUN, math.ceil(tail)))
    if not most.size:
        return []
    a, b = starts[most], starts[most] + lengths[most]  # one past the last
    limit = np.maximum(
        longest_by_chance(_around(sums[k], a, b, n), n, log.false_alarm), max(tail, LEAST_RUN)
    )
    for other in log.triad(k):
        if other != k and not log.wrong[other].all() and not _constant(sums[other], n):
            # Pairs within the run, its first sample excepted.
            shared = (sums[other, b] - sums[other, a + 1]) / np.maximum(b - a - 1, 1)
            limit = np.maximum(limit, longest_by_chance(shared, n, log.false_alarm))
    found = lengths[most] > limit
    return [
        _fault(log, k, int(x), int(y) - 1, float(lim))
        for x, y, lim in zip(a[found], b[found], limit[found], strict=True)
        if _others_live(sums, k, int(x), int(y))
    ]


def _tail(lengths: NDArray[np.int64], false_alarm: float) -> float:
    near, far = min(NEAR_RANK, lengths.size // 10), min(FAR_RANK, lengths.size // 100)
    limit = tail_limit(lengths, near, far, false_alarm, slack=TAIL_SLACK)
    # Fewer than 100 runs tell no tail; the other limits stand.
    return limit if math.isfinite(limit) else 0.0


def _around(sums: Array, a: NDArray[np.int64], b: NDArray[np.int64], n: int) -> Array:
    """Share of repetitions about each run, its upper bound."""
    left, right = np.maximum(a - AROUND, 0), np.minimum(b + AROUND, n)
    repeats = sums[a] - sums[left] + sums[right] - sums[b]
    pairs = a - left + right - b
    share = repeats / np.maximum(pairs, 1)
    # At least one is allowed for: none seen in so few says no more than that. A run over the whole
    # record has nothing about it, and its neighbours speak alone.
    least = 1.0 / np.maximum(pairs, 1)
    bound = np.minimum(share + SHARE_SLACK * np.sqrt(np.maximum(share, least) * least), 1.0)
    return np.asarray(np.where(pairs > LEAST_RUN, bound, 0.0))


def _constant(sums: Array, n: int) -> bool:
    return bool(sums[n] >= n - 1)


def _others_live(sums: Array, k: int, a: int, b: int) -> bool:
    """Whether any other channel changes meanwhile: else nothing is measured, or made up."""
    moved = (sums[:, b] - sums[:, a + 1]) < b - a - 1
    moved[k] = False
    return bool(moved.any())


def _fault(log: HealthLog, k: int, a: int, b: int, limit: float) -> ChannelFault:
    n, value, count = log.time.size, float(log.values[k, a]), b - a + 1
    if value == 0.0 and (a == 0 or b == n - 1):
        if a > 0:
            code = "sensors.dead-to-end"
        else:
            code = "sensors.dead-throughout" if b == n - 1 else "sensors.dead-at-start"
        return log.fault(k, "dead", (a, b), float(count), limit, code, count=count)
    code = "sensors.stuck-beyond-noise" if math.isfinite(limit) else "sensors.stuck"
    said = {"value": value, "count": count, "duration": log.time[b] - log.time[a]}
    return log.fault(k, "stuck", (a, b), float(count), limit, code, **said)
