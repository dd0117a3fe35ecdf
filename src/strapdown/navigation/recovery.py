"""Stretches of a run over which its solution or its receiver went wrong, and their errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY
from strapdown.estimation.robust import DOUBT, FEW, Igg3
from strapdown.frames import place_difference
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.measurements.gnss import PLACE, SPEED, Gnss
from strapdown.navigation.record import NavigationRecord, innovation_labels
from strapdown.tables import EULER, GEODETIC, POSITION_SD, VELOCITY
from strapdown.tables.checks import Array, find_gaps, index_of, values_of
from strapdown.tables.gnss import usable

#: Parts of a stretch after which its noise is told of.
PARTS = 20
#: Innovation, in standard deviations, that a rule rejects: one that is taken was forced.
REJECTED = Igg3().k1
#: Acceleration by which an inertial solution may be wrong, m/s².
SWING = 3.0
#: A receiver that goes no farther than this part of the contradiction stands.
STANDS = 0.1
#: Neighbors on each side, whose median is what steps between fixes have in common: the error of the
#: velocity. A jump is beyond so many standard deviations of a step, by the scatter of all and by
#: those stated.
BESIDE, JUMPED, STATED = 5, 6.0, 5.0
#: Steps on each side that are no jumps. Displaced positions that follow each other: a rule rejects
#: fewer, and does not come to believe them.
NEAR, FEWEST = 2, 5
#: Part of a jump by which the one back may differ.
ALIKE = 0.5
#: Float solutions: their scatter from fix to fix, and what separates them from fixed ones, in
#: standard deviations of a step of the latter, as first supposed; times the stated standard
#: deviation that they are at least, and that stated ones are where it is too small. They begin and
#: end once in so long, s.
FLOATS, APART, LARGER, UNDERSTATED = 4.0, 30.0, 3.0, 1.5
BEGINS, ENDS = 60.0, 10.0
#: Passes over the steps, each with the sizes of the last; share of fixed solutions that are gross
#: errors; median of chi-square of three components; chance below which a solution is fixed.
PASSES, GROSS, CHI_MEDIAN, UNLIKELY = 10, 0.02, 2.366, 0.1
#: Logarithm of the least chance of a way beside the likeliest: products of two are numbers.
LEAST_CHANCE = -300.0
#: Largest share of the record in which positions are not the usual ones.
MOST = 0.5
TINY = 1e-9
#: Velocities that together show whether a position changed as they say, and part of the change.
TOGETHER, CONFIRMS = 3, 0.3


@dataclass(frozen=True)
class Wrong:
    """Stretch since the last observation that agreed, over which a solution went wrong.

    Its error is taken for one of the whole stretch: half of the variance by white accelerations,
    the other by a random walk of the attitude, which acts on a position by gravity.

    Attributes
    ----------
    begin, end : float, s
    horizontal, vertical : float, m
        Standard deviations of the error of position at its end.
    """

    begin: float
    end: float
    horizontal: float
    vertical: float

    def due(self, told: float) -> float:
        """Time at which the noise that was last told of at another is to be told of again, s."""
        if told >= self.end:
            return np.inf
        return min(max(told, self.begin) + (self.end - self.begin) / PARTS, self.end)

    def covariance(self, told: float, time: float) -> Array:
        """Covariance of position, velocity and attitude, level axes, by the noise between times.

        Returns
        -------
        ndarray, (9, 9)
        """
        out = np.zeros((9, 9))
        dt = min(time, self.end) - max(told, self.begin)
        if dt <= 0.0:
            return out
        length = self.end - self.begin
        for k, size in enumerate((self.horizontal, self.horizontal, self.vertical)):
            # Twice integrated, white noise of density q gives the variance q T³ / 3.
            q = (0.5 if k < 2 else 1.0) * 3.0 * size**2 / length**3
            own = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
            out[np.ix_([k, 3 + k], [k, 3 + k])] = q * own
        # And a random walk of the tilt g² q T⁵ / 20.
        turned = 0.5 * 20.0 * (self.horizontal / STANDARD_GRAVITY) ** 2 / length**5
        out[range(6, 9), range(6, 9)] = turned * dt
        return out


class FixSteps(NamedTuple):
    """By how much positions move from fix to fix beyond the motion of a solution.

    Attributes
    ----------
    table : DataFrame
        Gnss table.
    aid : Gnss
        Receiver.
    rows : ndarray, (n,)
        Of the table that are used; none of a receiver without positions, or with few.
    at : ndarray, (n,), s
        Their instants.
    steps : ndarray, (n - 1, 3), m
        North, east, down, beyond those before and those after, between which is that of a velocity
        of the solution that changes.
    stated : ndarray, (n - 1, 3), m
        Their standard deviation, by those stated.
    """

    table: pd.DataFrame
    aid: Gnss
    rows: NDArray[np.intp]
    at: Array
    steps: Array
    stated: Array


def wrong_stretches(
    innovations: Mapping[str, pd.DataFrame], tables: Mapping[str, pd.DataFrame]
) -> tuple[Wrong, ...]:
    """Return the stretches over which a solution went wrong, by fixes that were forced on it.

    An adaptive rule that has rejected positions for long takes one in spite of its size. It shows
    an error of the solution, which its covariance does not have, unless it is the receiver that was
    wrong: it jumps away or back, stands where the solution moves, or its velocities do not agree
    with its positions.

    Parameters
    ----------
    innovations : mapping of str to DataFrame
        Of a run, by name of the observation.
    tables : mapping of str to DataFrame
        Fixes by name of the receiver.
    """
    found: list[Wrong] = []
    for name, table in innovations.items():
        aid = name.rpartition(".")[0]
        labels, fixes = innovation_labels(table), tables.get(aid)
        if fixes is None or not set(labels) <= set(PLACE):
            continue
        time = index_of(table)
        nu, s, weight = (
            values_of(table, [f"{part} {label}" for label in labels])
            for part in ("nu", "s", "weight")
        )
        path, velocity = _path(fixes), innovations.get(f"{aid}.velocity")
        for k, label in enumerate(labels):
            along = PLACE.index(label)
            for one in _forced(time, nu[:, k], s[:, k], weight[:, k], along == 2):
                sign = float(np.sign(nu[int(time.searchsorted(one.end)), k]))
                if not _confirmed(velocity, along, one, sign) and _moves(
                    index_of(fixes), path, one
                ):
                    found.append(one)
    return tuple(sorted(found, key=lambda one: one.begin))


def displaced_stretches(
    steps_of: FixSteps, *, hidden: bool = False
) -> tuple[tuple[tuple[float, float], ...], float]:
    """Return stretches of positions that jump away and back by the same, as `Gnss.displaced`.

    What a position moved from one fix to the next beyond the velocity of the solution is a jump of
    the receiver: a solution that is wrong swings by degrees. Between two opposite jumps positions
    are displaced by a constant; the longer part of the record is taken for what is not. A jump and
    the next one back are a gross error of one fix, which the update rule rejects: but not of the
    first ones after an outage, which it cannot tell, and from which it then rejects all others.

    Parameters
    ----------
    hidden : bool
        One of both jumps may be in an outage, or beyond the record: those between it and the other
        jump, before or after, whichever lasts shorter, are displaced then.

    Returns
    -------
    stretches : tuple of pairs of float, s
    size : float, m
        Largest of their displacements.
    """
    table, _, rows, at, steps, stated = steps_of
    if not len(rows):
        return (), 0.0
    scatter = MAD_TO_SD * np.median(np.abs(steps), axis=0)
    allowed = np.maximum(JUMPED * scatter, STATED * stated)
    begins = [0, *(gap.sample for gap in find_gaps(at))]
    struck: NDArray[np.bool_] = np.any(np.abs(steps) > allowed, axis=1)
    struck[np.array(begins[1:], dtype=np.intp) - 1] = False  # what an outage made of the solution
    # A solution that is corrected in earnest swings over several steps: those together are no jump.
    beside = np.convolve(struck, np.ones(2 * NEAR + 1), "same") - struck
    found, size = list[tuple[int, int]](), 0.0
    for first, last in _paired(np.flatnonzero(struck & (beside == 0)).tolist(), steps, allowed):
        if first is None:
            jump = float(np.linalg.norm(steps[last]))
            # What an outage made of the solution is part of the step over it.
            hides = [k for k in begins[1:] if np.linalg.norm(steps[k - 1]) > ALIKE * jump]
            begin = max(k for k in (0, *hides) if k <= last)
            end = min((k for k in hides if k > last), default=len(rows))
            away = (begin, last + 1), (last + 1, end)
            shorter = min(away, key=lambda one: at[one[1] - 1] - at[one[0]])
            apart = all(shorter[1] <= one[0] or one[1] <= shorter[0] for one in found)
            if apart and (hidden or (shorter == away[0] and last - begin < FEWEST - 1)):
                found.append(shorter)
                size = max(size, jump)
        elif last - first >= FEWEST:
            found = [one for one in found if one[1] <= first] + [(first + 1, last + 1)]
            size = max(size, float(np.linalg.norm(0.5 * (steps[first] - steps[last]))))
    stamps = index_of(table)[rows]
    middle = 0.5 * (stamps + np.append(stamps[0], stamps[:-1]))
    middle = np.append(middle, 2.0 * stamps[-1] - middle[-1])
    stretches = [(float(middle[begin]), float(middle[end])) for begin, end in sorted(found)]
    if sum(end - begin for begin, end in stretches) > MOST * (stamps[-1] - stamps[0]):
        return (), 0.0
    return tuple(stretches), size


def stated_floats(steps_of: FixSteps) -> tuple[pd.DataFrame, Gnss] | None:
    """State the float solutions of a receiver that does not, or understates them, by their motion.

    A receiver that loses its carrier-phase ambiguities jumps to a position with an error of another
    order of magnitude, which wanders until it fixes them again, and jumps back. What positions
    moved beyond the motion of the solution is then of three sizes: between fixed solutions, between
    float ones, and from one to the other. Where it is not stated which is which, the chances of the
    two kinds (forward and backward: Rabiner 1989, Proc. IEEE 77) and the sizes are found in turn.

    Returns
    -------
    table : DataFrame
        With the standard deviations of float solutions, where they are.
    aid : Gnss
        With the `float_position_sd` that separates them. None where there are none, or as stated.
    """
    table, aid, rows, at, steps, stated = steps_of
    if not len(rows):
        return None
    usual = np.maximum(MAD_TO_SD * np.median(np.abs(steps), axis=0), TINY)
    square = np.square(steps / usual).sum(axis=1)
    square[[gap.sample - 1 for gap in find_gaps(at)]] = np.nan  # says nothing
    own = values_of(table, POSITION_SD)[rows]
    level = np.sqrt(np.mean(np.square(own[:, :2]), axis=1))
    limit = aid.float_position_sd
    if limit:
        floats = level >= limit
        between = square[floats[1:] != floats[:-1]]
        if np.isfinite(between).sum() < FEWEST:
            return None
        apart = math.sqrt(np.nanmedian(between) / CHI_MEDIAN)
        known = np.median(aid.position_sd_factor * own[floats], axis=0)
        larger = own[floats] * float(np.median(apart * usual / known))
        if (larger < UNDERSTATED * own[floats]).any():
            return None
    else:
        floats, sd = _floats(square, np.diff(at), usual)
        if not 0.0 < floats.mean() <= MOST or (sd < LARGER * np.median(stated, axis=0)).any():
            return None
        # Some may be stated, with nothing that says from which size they are.
        floats &= (sd > UNDERSTATED * aid.position_sd_factor * own).any(axis=1)
        if not floats.any():
            return None
        larger = np.maximum(own[floats], sd / aid.position_sd_factor)
        limit = math.sqrt(float(np.median(level)) * math.hypot(*larger[0, :2] / math.sqrt(2.0)))
    out = table.copy()
    out.iloc[rows[floats], table.columns.get_indexer(pd.Index(POSITION_SD))] = larger
    return out, replace(aid, float_position_sd=limit)


def _floats(square: Array, dt: Array, usual: Array) -> tuple[NDArray[np.bool_], Array]:
    """Float solutions by the steps between all, (n,), and their standard deviations, (3,), m.

    `square`, `dt`: as of `_chance_of_floats`. `usual`: a step between fixed solutions, (3,), m.
    """
    looser, apart = FLOATS, APART
    floats = np.zeros(len(dt) + 1, dtype=np.bool_)
    chance = floats.astype(np.float64)
    for _ in range(PASSES):
        chance = _chance_of_floats(square, dt, looser, apart)
        before, floats = floats, chance > 0.5
        if (floats == before).all():
            break
        within = square[floats[1:] & floats[:-1]]
        between = square[floats[1:] != floats[:-1]]
        if len(within) < FEWEST or len(between) < 2:
            return np.zeros_like(floats), usual
        looser = math.sqrt(max(1.0, np.nanmedian(within) / CHI_MEDIAN))
        apart = math.sqrt(max(looser**2, np.nanmedian(between) / CHI_MEDIAN))
    # A fixed solution that is taken for a float one costs little.
    return np.asarray(chance > UNLIKELY), apart * usual


def _chance_of_floats(square: Array, dt: Array, looser: float, apart: float) -> Array:
    """Chance that solutions are float ones, by the steps between all: a hidden Markov chain.

    Parameters
    ----------
    square : ndarray, (n - 1,)
        Sum of the squares of the three components of a step, in variances of one between fixed
        solutions; NaN of one that says nothing.
    dt : ndarray, (n - 1,), s
    looser, apart : float
        Standard deviations of a step between float solutions, and of one between both kinds.

    Returns
    -------
    ndarray, (n,)
    """

    def likely(sd: float) -> Array:
        return np.nan_to_num(-0.5 * square / sd**2 - 3.0 * math.log(sd))

    # A gross error of a fixed solution, now and then, is none.
    fixed = np.logaddexp(likely(1.0) + math.log(1.0 - GROSS), likely(JUMPED) + math.log(GROSS))
    begin, end = np.minimum(dt / BEGINS, 0.5), np.minimum(dt / ENDS, 0.5)
    change = likely(apart)
    # By kind before and after, relative to the likeliest.
    ways = np.empty((len(dt), 2, 2))
    ways[:, 0, 0], ways[:, 0, 1] = fixed + np.log1p(-begin), change + np.log(begin)
    ways[:, 1, 0], ways[:, 1, 1] = change + np.log(end), likely(looser) + np.log1p(-end)
    ways = np.exp(np.maximum(ways - ways.max(axis=(1, 2), keepdims=True), LEAST_CHANCE))
    before = _along(ways, (1.0, ENDS / BEGINS))
    after = _along(ways[::-1].transpose(0, 2, 1), (1.0, 1.0))[::-1]
    both = before * after
    return np.asarray(both[:, 1] / both.sum(axis=1))


def _along(ways: Array, begin: tuple[float, float]) -> Array:
    """Chances of two kinds at each of n + 1 instants by the way to it, (n + 1, 2).

    By blocks, all at once: first of each from either kind, (blocks, length, 2, 2).
    """
    count = math.isqrt(len(ways)) + 1
    size = -(-len(ways) // count)
    blocks = np.resize(np.eye(2), (count, size, 2, 2))
    blocks.reshape(-1, 2, 2)[: len(ways)] = ways
    for k in range(1, size):
        blocks[:, k] = blocks[:, k - 1] @ blocks[:, k]
        blocks[:, k] /= blocks[:, k].sum(axis=(1, 2), keepdims=True)
    begun = [np.array(begin)]
    for whole in blocks[:, -1]:
        own = begun[-1] @ whole
        begun.append(own / own.sum())
    out = np.einsum("bi,bkij->bkj", np.array(begun[:-1]), blocks).reshape(-1, 2)
    return np.vstack([begun[0], out[: len(ways)]])


def fix_steps(record: NavigationRecord, table: pd.DataFrame, aid: Gnss) -> FixSteps:
    """Return by how much positions move from fix to fix beyond the motion of a solution.

    Parameters
    ----------
    record : NavigationRecord
        Of a run over the fixes.
    table : DataFrame
        Gnss table.
    aid : Gnss
        Receiver.
    """
    own = record.trajectory
    at = index_of(table) - aid.time_offset
    used = usable(table, POSITION_SD) & np.isin(table["quality"], aid.qualities)
    rows = np.flatnonzero(used & (at >= own.index[0]) & (at <= own.index[-1]))
    if len(rows) < 4 * BESIDE or not aid.use_position:
        return FixSteps(table, aid, rows[:0], at[:0], np.empty((0, 3)), np.empty((0, 3)))
    place, at = values_of(table, GEODETIC)[rows], at[rows]
    way, told = _way(record, at, np.asarray(aid.lever_arm))
    steps = place_difference(place[1:], place[:-1]) - np.diff(way, axis=0)
    around = np.pad(steps, ((BESIDE, BESIDE), (0, 0)), mode="reflect")
    around = np.median(np.lib.stride_tricks.sliding_window_view(around, BESIDE, axis=0), axis=-1)
    before, after = around[: len(steps)], around[-len(steps) :]
    steps = steps - np.clip(steps, np.minimum(before, after), np.maximum(before, after))
    sd = aid.position_sd_factor * values_of(table, POSITION_SD)[rows]
    slip = np.where(told[:, None], 0.0, _slip(record, at, float(np.linalg.norm(aid.lever_arm))))
    stated = np.sqrt(np.square(sd[1:]) + np.square(sd[:-1]) + np.square(slip))
    return FixSteps(table, aid, rows, at, steps, stated)


def _paired(jumps: list[int], steps: Array, allowed: Array) -> list[tuple[int | None, int]]:
    """Jumps away with those back, as brackets are paired, and those without, with None before.

    Gross errors within a stretch, and stretches apart.
    """
    pairs, away = list[tuple[int | None, int]](), list[int]()
    for back in jumps:
        left, jump = steps[away] + steps[back], np.linalg.norm(steps[back])
        reach = math.sqrt(2.0) * np.maximum(allowed[away], allowed[back])
        matched = (np.abs(left) < reach).all(axis=1) & (np.linalg.norm(left, axis=1) < ALIKE * jump)
        if not matched.any():
            away.append(back)
            continue
        at_last = int(np.flatnonzero(matched)[-1])
        pairs.append((away[at_last], back))
        away = away[:at_last]
    return [*pairs, *((None, jump) for jump in away)]


def _way(record: NavigationRecord, at: Array, arm: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Way of an antenna by the motion of a solution, its corrections left out.

    Between two rows with a correction in between the velocity is that of the rows around them: as
    long as there are some between most instants.

    Returns
    -------
    way : ndarray, (n, 3), m
        North, east, down, at the instants `at`, (n,).
    told : ndarray of bool, (n - 1,)
        Whether the way between two instants is without a correction.
    """
    time, velocity = index_of(record.trajectory), values_of(record.trajectory, VELOCITY)
    q = rotation.quaternion_from_euler(values_of(record.trajectory, EULER))
    steps = np.diff(time)
    rate = 0.5 * (velocity[1:] + velocity[:-1])
    rate += np.diff(rotation.rotate(q, arm), axis=0) / steps[:, None]
    free = np.ones(len(steps), dtype=np.bool_)
    for table in record.innovations.values():
        used = (table.filter(like="weight ") > 0.0).to_numpy().any(axis=1)
        row = time.searchsorted(index_of(table)[used] - SAME_INSTANT) - 1
        free[row[(row >= 0) & (row < len(free))]] = False
    middle = 0.5 * (time[1:] + time[:-1])
    told = np.diff(np.searchsorted(middle[free], at)) > 0
    if told.mean() < 0.5:
        told[:] = False
    else:
        rate = np.column_stack([np.interp(middle, middle[free], each[free]) for each in rate.T])
    way = np.concatenate([np.zeros((1, 3)), np.cumsum(rate * steps[:, None], axis=0)])
    return np.column_stack([np.interp(at, time, each) for each in way.T]), told


def _slip(record: NavigationRecord, at: Array, arm: float) -> Array:
    """Standard deviation of what corrections move an antenna between instants, (n - 1, 3), m."""
    slip = values_of(record.sd, VELOCITY) * float(np.median(np.diff(at)))
    turned = np.radians(np.linalg.norm(values_of(record.sd, EULER), axis=1))
    slip = np.hypot(slip, arm * turned[:, None])
    rows = np.clip(index_of(record.sd).searchsorted(at[1:]), 0, len(slip) - 1)
    return np.asarray(slip[rows])


def longest(stretches: tuple[Wrong, ...]) -> float:
    """Return how long stretches that follow each other last, s.

    Between two of them agreement is shorter than the second.
    """
    begin, end, out = 0.0, -math.inf, 0.0
    for one in stretches:
        if one.begin - end > one.end - one.begin:
            begin = one.begin
        end = max(end, one.end)
        out = max(out, end - begin)
    return out


def _path(fixes: pd.DataFrame) -> Array:
    """Horizontal positions of fixes from the first, (n, 2), m."""
    places = values_of(fixes, GEODETIC)
    return place_difference(places, np.broadcast_to(places[0], places.shape))[:, :2]


def _moves(time: Array, path: Array, one: Wrong) -> bool:
    """Whether a receiver moves in a stretch, compared with what the solution is said to be off."""
    first, end = np.searchsorted(time, [one.begin, one.end], side="right").tolist()
    way = path[max(first - 1, 0) : end]
    gone = np.linalg.norm(way - way[0], axis=1).max() if len(way) else 0.0
    return bool(gone > STANDS * math.hypot(one.horizontal, one.vertical))


def _confirmed(velocity: pd.DataFrame | None, along: int, one: Wrong, sign: float) -> bool:
    """Whether the velocities of a receiver do not show the error of its positions in a stretch.

    `along`: component, north, east or down. `sign`: of the innovation of the position at its end.
    """
    column = f"nu {SPEED[along]}"
    if velocity is None or column not in velocity:
        return False
    told = velocity[column].loc[one.begin : one.end].to_numpy(dtype=np.float64)
    gone = sign * float(told.mean()) * (one.end - one.begin) if len(told) else math.inf
    return len(told) >= TOGETHER and gone < CONFIRMS * math.hypot(one.horizontal, one.vertical)


def _forced(time: Array, nu: Array, s: Array, weight: Array, vertical: bool) -> list[Wrong]:
    """Stretches before observations of a component that were forced.

    Not where the receiver jumped away, as long as it stays there: for as long as it had agreed, and
    for a minute at most.
    """
    taken = np.flatnonzero(weight > 0.0).tolist()
    size, step = np.abs(nu), np.diff(time, prepend=time[0])
    forced = size > REJECTED * np.sqrt(s)
    away = np.abs(np.diff(nu, prepend=nu[0])) > np.maximum(0.5 * size, SWING * np.square(step))
    agreed_since, doubted, out = float(time[0]), -math.inf, list[Wrong]()
    for last, at in pairwise(taken):
        if not forced[last] or nu[last] * nu[at] < 0.0:
            agreed = float(time[last]) - agreed_since
            doubted = float(time[last]) + min(DOUBT, agreed) if away[last + 1] else -math.inf
        if forced[at]:
            agreed_since = float(time[at])
        if at - last <= FEW or not forced[at] or time[at] < doubted:
            continue
        soon = slice(at, int(time.searchsorted(time[at] + DOUBT)))
        if not _jumps_back(time[soon], nu[soon], weight[soon] == 0.0):
            sizes = (0.0, float(size[at])) if vertical else (float(size[at]), 0.0)
            out.append(Wrong(float(time[last]), float(time[at]), *sizes))
    return out


def _jumps_back(time: Array, nu: Array, rejected: NDArray[np.bool_]) -> bool:
    """Whether innovations jump back by about the first: of a receiver that was wrong until then.

    A solution that swings does so by degrees: from one step to the next by an acceleration. After
    an observation that was taken a step is the correction.
    """
    size, free = abs(nu[0]), rejected[:-1]
    jump = -np.sign(nu[0]) * np.diff(np.diff(nu))
    far = jump > np.maximum(0.5 * size, SWING * np.square(np.diff(time)[1:]))
    return bool((far & (jump < 2.0 * size) & free[1:] & free[:-1]).any())
