"""Sample clock behind the stamps of a record: nominal rate, gaps, lost samples, bursts, jitter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strapdown.dsp.samples import moving_mean
from strapdown.tables.checks import Array, Gap, find_gaps

Numbers = NDArray[np.int64]

#: Fewest samples of a record whose clock is looked for.
LEAST = 20
#: A gap is longer than this many steps; shorter ones are lost samples.
GAP_STEPS = 10.0
#: In bursts this share of the steps is shorter than this part of the mean step: two samples a
#: delivery make a half short, jitter of up to 0.4 of a step a hundredth.
SHORT, BURSTS = 0.3, 0.3
#: Shortest step of a fitted clock, in steps.
SHORTEST = 0.2
#: Largest share of lost samples: with more the stamps are not those of a clock.
MOST_LOST = 0.5
#: Of the intervals between deliveries, the share that is within this part of the usual one, where
#: deliveries are even; least share of a size of bursts that counts.
PACKETS, EVEN, OFTEN = 0.5, 0.1, 0.005
#: Deliveries of a block in which losses are distinguished from a timer, and the fewest.
BLOCK, LEAST_BLOCK = 100, 25
#: Deliveries before a late one, and from it on, of which the earliest are compared: a program that
#: was held up catches up within these.
BEFORE_LATE, CAUGHT_UP = 5, 25
#: Steps within this part of a step of whole multiples, and their share, need no tracking.
MULTIPLE, MULTIPLES = 0.15, 0.98
#: Stamps within this part of a step (standard deviation) of the clock are left as they are.
NEGLIGIBLE = 0.01
#: Stamps scatter about a clock where their differences over `LAG` steps have at most this many
#: times the variance of those over one; independent steps, as of a program's loop, have `LAG`
#: times.
LAG, ABOUT_A_CLOCK = 32, 4.0
#: Gain of the loop that follows a clock from sample to sample, the stamps that it looks ahead, the
#: stamps of its acquisition, and the steps after which it begins anew.
GAIN, AHEAD, ACQUIRE, FAR = 0.02, 4, 300, 50.0
#: Part of a step within which the period of scattered stamps is looked for, and the stamps used.
REACH, SEEN = 0.05, 20_000
#: Stamps over which a clock is averaged.
WINDOW = 101
#: Standard deviations by which the rates must be smoother on one time base than on the other, and
#: the blocks that they are compared in.
SIGNIFICANT, BLOCKS = 3.0, 40


@dataclass(frozen=True)
class SampleClock:
    """Instants of the samples of a record, and what they rest on.

    Attributes
    ----------
    step : float, s
        Nominal: between consecutive samples, gaps and lost samples left out.
    time : ndarray, (n,), s
        Instants of the samples: the stamps, or those of an even clock (`repaired`).
    number : ndarray of int, (n,)
        Number of each sample on the clock; lost samples are lost numbers. The row where samples
        are taken at no clock.
    kind : {'even', 'jitter', 'bursts', 'irregular'}
        Stamps: at the steps of a clock; scattered about it; of arrival, several samples at once;
        of samples that were taken at uneven instants.
    repaired : bool
        Whether `time` differs from the stamps.
    spread : float, s
        Standard deviation of the stamps about the clock.
    lost : int
        Samples lost between gaps.
    gaps : tuple of Gap
        `sample` is the row after each, on the clock of `time`.
    """

    step: float
    time: Array
    number: Numbers
    kind: str
    repaired: bool
    spread: float
    lost: int
    gaps: tuple[Gap, ...]

    @property
    def begins(self) -> Numbers:
        """Rows at which the record begins anew: 0, and after each gap."""
        return np.array([0, *(gap.sample for gap in self.gaps)], dtype=np.int64)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """First row of each stretch without gaps, and the row after its last."""
        bounds = [*self.begins.tolist(), self.number.size]
        return list(pairwise(bounds))

    @property
    def rate_hz(self) -> float:
        """Nominal sample rate in Hz."""
        return 1.0 / self.step

    def of(self, time: Array) -> SampleClock:
        """Return the clock of consecutive rows with these instants."""
        row = int(np.searchsorted(self.time, time[0]))
        end = row + len(time)
        gaps = tuple(replace(g, sample=g.sample - row) for g in self.gaps if row < g.sample < end)
        return replace(self, time=self.time[row:end], number=self.number[row:end], gaps=gaps)

    def every(self, factor: int) -> Numbers:
        """Rows that a sampling at a whole part of the rate has, with both ends of each stretch."""
        first = np.repeat(self.number[self.begins], np.diff([*self.begins, self.number.size]))
        kept = (self.number - first) % factor == 0
        kept[self.begins] = True
        kept[np.append(self.begins[1:], kept.size) - 1] = True
        return np.flatnonzero(kept)


def sample_clock(stamps: Array, values: Array | None = None) -> SampleClock:
    """Find the clock of the samples of a record.

    Parameters
    ----------
    stamps : ndarray, (n,), s
        Not decreasing; samples that are delivered together may share a stamp.
    values : ndarray, (n, m), optional
        A motion is smoother on the instants at which it was sampled than on any others: the values
        decide between scattered stamps and an even clock. Without them, or without motion,
        scattered stamps are left as they are.
    """
    stamps = np.asarray(stamps, dtype=np.float64)
    gaps, in_bursts = _gaps(stamps)
    steps = np.diff(stamps)[_within(gaps, max(stamps.size - 1, 0))]
    if steps.size < LEAST or not steps.mean() > 0.0:
        step = float(steps.mean()) if steps.size and steps.mean() > 0.0 else 1.0
        return _as_stamped(stamps, step, [], "even")
    mean = float(steps.mean())
    usual = float(np.median(steps))
    near = steps[(steps > 0.5 * usual) & (steps < 1.5 * usual)]
    if in_bursts:
        step, numbers = _of_bursts(stamps, gaps, mean)
    elif near.size:
        # By symmetry the mean of what lies within half a step is the step, however it scatters.
        step, numbers = _of_steps(stamps, gaps, float(near.mean()))
    else:  # steps of two lengths, or stamps of which most repeat
        return _as_stamped(stamps, mean, list(gaps), "irregular")
    # Gaps in the sense of the clock; shorter ones are lost samples.
    long = [g for g in gaps if g.length > GAP_STEPS * step]
    number = np.concatenate([[0], np.cumsum(numbers)])
    fitted, step, spread, walks = _fitted(stamps, number, long, step, in_bursts)
    kind = "bursts" if in_bursts else "even" if spread < MULTIPLE * step else "jitter"
    if walks and not in_bursts and spread >= NEGLIGIBLE * step:
        return _as_stamped(stamps, mean, long, "irregular")
    lost = int((numbers[_within(long, numbers.size)] - 1).sum())
    if lost > MOST_LOST * (lost + stamps.size):
        return _as_stamped(stamps, mean, long, "irregular")
    clock = SampleClock(step, stamps, number, kind, False, spread, lost, tuple(long))
    as_good = spread < NEGLIGIBLE * step and not in_bursts
    if as_good or np.diff(fitted).min() <= SHORTEST * step:
        return clock
    smoother = _smoother_on(fitted, stamps, values, clock.begins)
    if smoother > SIGNIFICANT or (in_bursts and smoother > -SIGNIFICANT):
        moved = tuple(
            Gap(float(fitted[g.sample - 1]), float(fitted[g.sample]), g.usual, g.sample)
            for g in long
        )
        return SampleClock(step, fitted, number, kind, True, spread, lost, moved)
    if smoother < -SIGNIFICANT:
        return _as_stamped(stamps, step, long, "irregular")
    return clock


def _gaps(stamps: Array) -> tuple[list[Gap], bool]:
    """Return steps that are far longer than usual, and whether samples arrive in bursts.

    In bursts the usual step is that from one delivery to the next.
    """
    gaps: list[Gap] = []
    for _ in range(2):
        inside = _within(gaps, max(stamps.size - 1, 0))
        steps = np.diff(stamps)[inside]
        if steps.size < LEAST:
            break
        mean = float(steps.mean())
        if (steps < SHORT * mean).mean() < BURSTS:
            break
        ends = np.flatnonzero(_last_of_bursts(stamps, mean))
        if ends.size < LEAST:
            # A single pause far longer than the record is not a delivery.
            break
        early = stamps[ends] - mean * ends
        gaps = [
            replace(g, sample=int(ends[g.sample - 1]) + 1)
            for g in find_gaps(stamps[ends])
            if not _made_up(early, g.sample, mean)
        ]
    else:
        return gaps, True
    return find_gaps(stamps), False


def _made_up(early: Array, late: int, step: float) -> bool:
    """Whether the deliveries after a long wait bring the samples of that wait.

    `early`: stamps of the deliveries less the clock of their samples.
    """
    before = early[max(late - BEFORE_LATE, 0) : late].min()
    return bool(early[late : late + CAUGHT_UP].min() - before <= GAP_STEPS * step)


def _last_of_bursts(stamps: Array, step: float) -> NDArray[np.bool_]:
    """Return the samples after which a burst ends, of a record with this mean step."""
    return np.append(np.diff(stamps) > 0.5 * step, True)


def _as_stamped(stamps: Array, step: float, gaps: Sequence[Gap], kind: str) -> SampleClock:
    return SampleClock(step, stamps, np.arange(stamps.size), kind, False, 0.0, 0, tuple(gaps))


def _within(gaps: Sequence[Gap], count: int) -> NDArray[np.bool_]:
    """Return the steps that are not gaps."""
    inside = np.ones(count, dtype=bool)
    inside[[gap.sample - 1 for gap in gaps]] = False
    return inside


def _of_steps(stamps: Array, gaps: Sequence[Gap], step: float) -> tuple[float, Numbers]:
    """Nominal step, and by how much each sample advances the clock; `step`: about it."""
    whole = np.diff(stamps)
    advance = np.maximum(np.round(whole / step), 1.0)
    inside = _within(gaps, whole.size)
    if (np.abs(whole / step - advance)[inside] <= MULTIPLE * advance[inside]).mean() >= MULTIPLES:
        # Refined: rounding of long steps needs the step itself.
        step = float(whole[inside].sum() / advance[inside].sum())
        return step, np.maximum(np.round(whole / step), 1.0).astype(np.int64)
    step = _period(stamps, step)
    return step, _followed(stamps, step, np.ones(stamps.size, dtype=np.int64))


def _period(stamps: Array, step: float) -> float:
    """Refine the step of a clock about which stamps scatter, some of them lost.

    The period at which the stamps of a block agree best in phase (largest mean resultant, Mardia
    and Jupp, Directional Statistics, 2000, sec. 2.3), by blocks that become longer.
    """
    stamps = stamps[:SEEN]
    reach = REACH
    for length in (64, 512, 4096):
        count = stamps.size // length
        if count == 0:
            break
        blocks = stamps[: count * length].reshape(count, length)
        blocks = blocks - blocks[:, :1]
        tried = step * (1.0 + np.linspace(-reach, reach, 81))
        agree = [
            float(np.square(np.abs(np.exp(2j * np.pi / p * blocks).mean(axis=1))).mean())
            for p in tried
        ]
        step = float(tried[int(np.argmax(agree))])
        reach = 0.5 / length
    return step


def _followed(stamps: Array, step: float, least: Numbers) -> Numbers:
    """Count clock steps between stamps that scatter, by following the clock's phase.

    `least`: fewest steps to each stamp. Of a lost sample all later stamps are late, of a late stamp
    only itself: the earliest of the next `AHEAD` stamps decides.
    """
    start = min(stamps.size, ACQUIRE)
    # Backward, so that the phase is known when the record begins.
    back = np.concatenate([[1], least[1:start][::-1]])
    _, phase = _follow(-stamps[:start][::-1], step, back, -float(stamps[start - 1]))
    return _follow(stamps, step, least, -phase)[0]


def _follow(stamps: Array, step: float, least: Numbers, phase: float) -> tuple[Numbers, float]:
    """Follow a clock from its phase at the first stamp; return counts and the phase at the last."""
    out = np.empty(stamps.size - 1, dtype=np.int64)
    upto = np.cumsum(least)
    # Stamps less the clock without lost samples, and the earliest of the next.
    own = stamps - step * (upto - upto[0])
    late = own.copy()
    for ahead in range(1, min(AHEAD, stamps.size)):
        late[:-ahead] = np.minimum(late[:-ahead], own[ahead:])
    shift, drift = phase, 0.0
    earliest, each = late[1:].tolist(), own[1:].tolist()
    counts = least[1:].tolist()
    for k, (early, one, few) in enumerate(zip(earliest, each, counts, strict=True)):
        lost = max(round((early - shift) / step), 0)
        shift += lost * step + drift * (few + lost)
        off = one - shift
        if abs(off) > FAR * step:
            shift = one
        else:
            shift += GAIN * off
            drift += 0.25 * GAIN * GAIN * off
        out[k] = few + lost
    return out, shift + step * float(upto[-1] - upto[0])


def _of_bursts(stamps: Array, gaps: Sequence[Gap], mean: float) -> tuple[float, Numbers]:
    """Nominal step, and by how much each sample advances the clock, of delivered bursts.

    The last sample of a burst is taken just before it is delivered.
    """
    ends = np.flatnonzero(_last_of_bursts(stamps, mean))
    size = np.diff(np.concatenate([[-1], ends]))
    advance = np.ones(stamps.size - 1, dtype=np.int64)
    apart = np.diff(stamps[ends])
    if ends.size < LEAST:
        return mean, advance
    # The first burst may have begun before the record. Deliveries at even intervals are full
    # packets of which samples are lost; or those of a timer, of all samples since the last.
    usual = float(np.median(apart))
    even = np.abs(apart - usual) <= EVEN * usual
    if even.mean() < PACKETS:
        return mean, advance
    counts = np.bincount(size[1:][even])
    often = np.flatnonzero(counts > OFTEN * counts.sum())
    packet = int(often.max())
    step = usual / packet
    late = stamps[ends] / step - ends
    begins = np.searchsorted(ends, [g.sample for g in gaps])
    if _make_up(late, ends, even, begins):
        return mean, advance
    delivered = _followed(stamps[ends], step, size)
    for end, count, clock in zip(ends[1:], size[1:], delivered, strict=True):
        if clock > count:
            # It is not known which of the burst was lost.
            at = np.round(np.linspace(0.0, clock, count + 1)).astype(np.int64)
            advance[end - count : end] = np.diff(at)
    return step, advance


def _make_up(late: Array, ends: Numbers, even: NDArray[np.bool_], begins: Numbers) -> bool:
    """Whether deliveries bring all samples since the last: of a late one the next has fewer.

    Then they are independent about a line; after losses, which add up, they walk off. Of n that
    are independent the variance about a line is half that of their differences; of a walk it is
    n/15 of it (a Brownian motion less its line by least squares, in the mean).

    `late`: deliveries less the clock of their samples, in steps; `ends`: their last samples;
    `even`: intervals between them of the usual length; `begins`: first deliveries after gaps.
    """
    squares, count, blocks = 0.0, 0, 0
    for own, number in zip(np.split(late, begins), np.split(ends, begins), strict=True):
        if own.size < CAUGHT_UP + LEAST_BLOCK:
            continue
        # A program that was held up has caught up where no later delivery is earlier by a step.
        earliest = sliding_window_view(own, CAUGHT_UP).min(axis=1)
        in_time = np.flatnonzero(own[: earliest.size] <= earliest + 1.0)
        for block in np.array_split(in_time, max(in_time.size // BLOCK, 1)):
            if block.size < LEAST_BLOCK:
                continue
            line = np.polynomial.Polynomial.fit(number[block], own[block], 1)
            squares += float(np.square(own[block] - line(number[block])).sum())
            count, blocks = count + block.size, blocks + 1
    if not count:
        return False
    most = math.sqrt(0.5 * count / blocks / 15.0)
    return squares / count < most * float(np.diff(late)[even].var())


def _fitted(
    stamps: Array, number: Numbers, gaps: Sequence[Gap], step: float, in_bursts: bool
) -> tuple[Array, float, float, bool]:
    """Clock times of the samples, the step, the stamps' spread, and whether they walk off.

    Each stretch has its own origin; a slow drift is followed.
    """
    bounds = np.array([0, *(g.sample for g in gaps), stamps.size])
    pieces = [slice(a, b) for a, b in pairwise(bounds)]
    taken = np.ones(stamps.size, dtype=bool)
    if in_bursts:
        taken = _stamped(stamps, number, step)
    top = bottom = 0.0
    for piece in pieces:
        here = taken[piece]
        n, t = number[piece][here].astype(np.float64), stamps[piece][here]
        n, t = n - n.mean(), t - t.mean()
        top, bottom = top + float(n @ t), bottom + float(n @ n)
    if bottom > 0.0:
        step = top / bottom
    fitted = np.empty_like(stamps)
    left, one, far = [], [], []
    for piece in pieces:
        here = taken[piece]
        rest = stamps[piece][here] - step * number[piece][here]
        if rest.size < LEAST:
            # Too few to average: the earliest delivery, or as stamped.
            on_clock = step * number[piece] + (float(rest.min()) if rest.size else 0.0)
            fitted[piece] = on_clock if in_bursts else stamps[piece]
            continue
        width = min(WINDOW if not in_bursts else WINDOW // 2, rest.size)
        slow = moving_mean(_moving_median(rest, width) if in_bursts else rest, width)
        off = rest - slow
        late = float(np.median(off) - np.quantile(off, 0.05)) if in_bursts else 0.0
        known = np.interp(number[piece], number[piece][here], slow)
        fitted[piece] = step * number[piece] + known - late
        left.append(off)
        one.append(np.diff(rest))
        far.append(rest[LAG:] - rest[:-LAG])
    if not left:
        return fitted, step, 0.0, False
    left_all, one_all, far_all = (np.concatenate(x) for x in (left, one, far))
    walks = far_all.size > LEAST and float(np.mean(far_all**2)) > ABOUT_A_CLOCK * float(
        np.mean(one_all**2)
    )
    return fitted, step, float(left_all.std()), walks


def _moving_median(values: Array, width: int) -> Array:
    """Median of the `width` values about each; beyond the ends as before them."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, width, mode="reflect"))


def _stamped(stamps: Array, number: Numbers, step: float) -> NDArray[np.bool_]:
    """Return the samples of bursts at whose instants the stamps are.

    That is the last of each, which is taken just before a delivery, unless the stamps of bursts of
    different sizes are far more even at the first, as those of a clock that is not advanced.
    """
    last = _last_of_bursts(stamps, step)
    first = np.append(True, last[:-1])

    def scatter(taken: NDArray[np.bool_]) -> float:
        steps = np.diff(stamps[taken]) - step * np.diff(number[taken])
        return float(np.median(np.abs(steps)))

    return first if scatter(first) < 0.5 * scatter(last) else last


def _smoother_on(fitted: Array, stamps: Array, values: Array | None, begins: Numbers) -> float:
    """Return by how many standard deviations values are smoother on fitted instants than on stamps.

    A sample is predicted from its neighbors, on either time base; zero without motion.
    """
    if values is None or stamps.size < 2 * BLOCKS:
        return 0.0
    errors = []
    for time in (fitted, stamps):
        whole = time[2:] - time[:-2]
        share = np.divide(
            time[1:-1] - time[:-2], whole, out=np.full(whole.size, 0.5), where=whole > 0
        )
        off = values[1:-1] - values[:-2] - share[:, None] * (values[2:] - values[:-2])
        # Of noise alone the prediction has more, the farther it is from the middle.
        noise = 1.0 + share**2 + (1.0 - share) ** 2
        errors.append(np.square(off).sum(axis=1) / noise)
    gain = errors[1] - errors[0]
    broken = np.concatenate([begins[1:] - 1, begins[1:] - 2])
    gain[broken[(broken >= 0) & (broken < gain.size)]] = 0.0
    blocks = np.array([block.sum() for block in np.array_split(gain, BLOCKS)])
    sd = float(blocks.std(ddof=1))
    return 0.0 if sd == 0.0 else float(blocks.mean()) / (sd / np.sqrt(BLOCKS))


def ends_of_part(
    first: float, from_s: float | None, to_s: float | None, duration_s: float | None
) -> tuple[float, float]:
    """Return begin and end of a part of a record, s, infinite where none is stated.

    `first`: first stamp of the record, s, from which a length counts that has no begin.
    """
    if duration_s is not None:
        to_s = (first if from_s is None else from_s) + duration_s
    return -math.inf if from_s is None else from_s, math.inf if to_s is None else to_s
