"""Check a receiver's fixes before a record is navigated with them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from strapdown.constants import MAD_TO_SD, Array, Flags
from strapdown.dsp.samples import true_runs
from strapdown.errors import DataError, Finding
from strapdown.frames import ned_from_geodetic, place_difference, ways_between
from strapdown.navigation.measurements.clock_windows import stamp_step, step_finding
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.gnss_clock import (
    WHOLE,
    check_overlap,
    find_time_offset,
    find_velocity_delay,
    sure_delay,
    time_offset,
)
from strapdown.navigation.measurements.gnss_course import check_forward, check_turns
from strapdown.tables import (
    GEODETIC,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    check_gnss,
    find_gaps,
    usable,
)
from strapdown.tables.checks import ORIGIN_STATED, index_of, source_of, values_of


def gnss_readiness(
    table: pd.DataFrame,
    imu: pd.DataFrame | None = None,
    aid: Gnss | None = None,
    part: tuple[float, float] = WHOLE,
    mounting_yaw: float | None = 0.0,
) -> tuple[Finding, ...]:
    """Check fixes by themselves, and against the inertial record, with the offset of their clock.

    Parameters and errors as of `receiver_findings`.
    """
    aid = aid or Gnss(name="gnss")
    found = receiver_findings(table, imu, aid, part, mounting_yaw)
    if imu is None:
        return tuple(found)
    offset = time_offset(table, imu, aid.velocity_delay or sure_delay(table))
    return (*found, *find_time_offset(table, offset, aid.time_offset, aid.time_offset_sd))


def receiver_findings(
    table: pd.DataFrame,
    imu: pd.DataFrame | None = None,
    aid: Gnss | None = None,
    part: tuple[float, float] = WHOLE,
    mounting_yaw: float | None = 0.0,
) -> list[Finding]:
    """Check fixes by themselves, and against the inertial record on its clock.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    imu : DataFrame, optional
        Imu table.
    aid : Gnss, optional
        As it is configured: options already set are not reported again.
    part : (2,), s
        Of the record that was asked for, on the clock of `imu`.
    mounting_yaw : float, optional, rad
        Heading of the forward axis less that of the vehicle, as configured; None where nothing
        takes it to point where the body moves.

    Returns
    -------
    list of Finding
        Each with the option or the deed that helps.

    Raises
    ------
    DataError
        The fixes cannot be used as they are (`gnss_checks.check_fixes`,
        `gnss_clock.check_overlap`, `gnss_course.check_turns`).
    """
    aid = aid or Gnss(name="gnss")
    found = check_fixes(table)
    if aid.use_velocity and aid.use_position:
        found += find_velocity_delay(table, aid.velocity_delay)
    if imu is None:
        return found
    found += check_overlap(table, imu, aid.time_offset, part)
    step = stamp_step(table)
    if step is not None and step.certain:
        found.append(step_finding(table, imu, step))
    delay = aid.velocity_delay or sure_delay(table)
    found += check_turns(table, imu, delay)
    if mounting_yaw is not None:
        found += check_forward(table, imu, delay, mounting_yaw)
    return found


def white_position_sd(table: pd.DataFrame, delay: float = 0.0) -> tuple[float, float] | None:
    """Measure by how much positions scatter from fix to fix.

    By their steps less the mean of the velocities at both ends, or by their third differences. An
    error that lasts longer than some fixes is not in it; sudden motion is, so that it is an upper
    bound. Innovations beyond `TRIM` standard deviations by the median are faults and do not count.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    delay : float, s
        Of its velocities.

    Returns
    -------
    sd, share : float
        Standard deviation of the errors that are new with each fix, horizontal, a component, m; and
        the same relative to the stated one, median. None with too few fixes at equal intervals.
    """
    sd, time = values_of(table, POSITION_SD)[:, :2], index_of(table)
    good = usable(table, POSITION_SD[:2])
    if good.sum() < LEAST_ROWS:
        return None
    place = values_of(table, GEODETIC)[good]
    place = ned_from_geodetic(place, place[0])[:, :2]
    sd, time = sd[good], time[good]
    step = float(np.median(np.diff(time)))
    measured = np.isfinite(values_of(table, VELOCITY_SD)[good][:, :2]).all(axis=1)
    if measured.all():
        v = values_of(table, VELOCITY)[good][:, :2]
        then = _without_delay(time, v, delay)
        way = 0.5 * (then[1:] + then[:-1])
        apart = np.diff(time)
        left = (np.diff(place, axis=0) - way * apart[:, None]) / np.sqrt(2.0)
        even = np.abs(apart - step) < UNEVEN * step
    else:
        left = np.diff(place, n=3, axis=0) / np.sqrt(20.0)
        even = np.abs(time[3:] - time[:-3] - 3.0 * step) < UNEVEN * step
    if even.sum() < LEAST_ROWS:
        return None
    left, stated = left[even], sd[-len(left) :][even]
    return math.sqrt(_variance(left)), math.sqrt(_variance(left / stated))


def float_position_sd(table: pd.DataFrame) -> float | None:
    """Stated horizontal standard deviation that separates float from fixed solutions, m.

    A receiver that fixes its ambiguities states another order of magnitude: the limit is in the
    widest gap between the stated ones, by ratio, if it is wide and the lesser ones are those of
    fixed solutions. None of a receiver with one kind of solution.
    """
    sd = values_of(table, POSITION_SD)[usable(table, POSITION_SD[:2]), :2]
    all_sd = np.sqrt(np.mean(np.square(sd), axis=1))
    level = np.unique(all_sd)
    if len(level) < 2:
        return None
    apart = np.log(level[1:] / level[:-1])
    widest = int(np.argmax(apart))
    limit = math.sqrt(level[widest] * level[widest + 1])
    if apart[widest] < math.log(FLOAT_GAP) or level[0] > FIXED_SD:
        return None
    return limit if np.count_nonzero(all_sd < limit) >= LEAST_ROWS else None


def white_velocity_sd(table: pd.DataFrame) -> float | None:
    """Measure by how much horizontal velocities scatter from fix to fix, m/s, a component.

    By their third differences: an upper bound, as sudden motion is in it. None with too few fixes.
    """
    v = values_of(table, VELOCITY)[usable(table, VELOCITY_SD[:2])][:, :2]
    if len(v) < LEAST_ROWS:
        return None
    return math.sqrt(_variance(np.diff(v, n=3, axis=0) / math.sqrt(20.0)))


def _variance(left: Array) -> float:
    """Mean variance of two components about zero without faults, (n, 2)."""
    size = np.abs(left)
    near = size <= TRIM * MAD_TO_SD * np.median(size, axis=0)
    return float(np.mean(np.square(left).sum(axis=0, where=near) / near.sum(axis=0)))


def _without_delay(time: Array, velocity: Array, delay: float) -> Array:
    """Velocities at the stamps of the positions."""
    return np.column_stack([np.interp(time, time - delay, one) for one in velocity.T])


def lasting_position_sd(table: pd.DataFrame, delay: float = 0.0) -> tuple[float, float] | None:
    """Measure the errors of positions that last, by the velocities of the same receiver.

    Positions less the integral of the velocities change from one instant to one t later by
    ``2 w² + 2 s² (1 - exp(-t / T)) + q t`` in variance: white errors w, lasting ones s and the
    noise of the velocities. Their stated noise q, or the scatter of velocities that state none, is
    subtracted, and w and s are fitted to lags from one fix to `LAGS`, without faulty pairs. The T
    that fits best is one of `TIMES`: so short lags show a longer one by a smaller s
    only.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    delay : float, s
        Of its velocities.

    Returns
    -------
    white, lasting : float
        Standard deviations relative to the stated ones, horizontal, a component. None without
        velocities, with too few fixes, or where the noise of the velocities hides what lasts.
    """
    columns = [*POSITION_SD[:2], *VELOCITY_SD[:2]]
    sd, time = values_of(table, columns), index_of(table)
    good = usable(table, columns)
    if good.sum() < LEAST_ROWS:
        return None
    sd, time = sd[good], time[good]
    place, v = values_of(table, GEODETIC)[good], values_of(table, VELOCITY)[good][:, :2]
    then = _without_delay(time, v, delay)
    apart = np.diff(time)
    step = float(np.median(apart))
    gained = np.gradient(then, time, axis=0)
    way = 0.5 * (then[1:] + then[:-1]) * apart[:, None]
    way -= np.diff(gained, axis=0) * np.square(apart)[:, None] / 12.0
    off = place_difference(place[1:], place[:-1])[:, :2] - way
    off = np.vstack([np.zeros(2), np.cumsum(off, axis=0)])
    piece = np.append(0, np.cumsum(apart > (1.0 + UNEVEN) * step))
    stated, noise = np.square(sd[:, :2]), np.square(sd[:, 2:]) * step
    if "velocity_sd_taken" in table.attrs and (scatter := white_velocity_sd(table)) is not None:
        noise = np.minimum(noise, scatter**2 * step)
    rows = []
    for lag in sorted({1, *(max(1, round(x / step)) for x in LAGS)}):
        same = piece[lag:] == piece[:-lag] if lag < len(time) else np.zeros(0, dtype=np.bool_)
        if same.sum() < LEAST_ROWS:
            continue
        both = 0.5 * (stated[lag:] + stated[:-lag])[same]
        spread = 0.5 * _variance((off[lag:] - off[:-lag])[same] / np.sqrt(both))
        grown = 0.5 * lag * step * float(np.median(noise[lag:][same] / both))
        rows.append((lag * step, spread, grown))
    if not rows or rows[-1][0] < LEAST_LAG:
        return None
    lags, spread, hidden = np.array(rows).T
    if hidden[-1] > HIDDEN * spread[-1]:
        return None
    from scipy.optimize import nnls

    # A lag shows one independent pair in its own length.
    weight = 1.0 / (np.maximum(spread, np.finfo(np.float64).tiny) * np.sqrt(lags))
    fits = []
    for last in TIMES:
        A = np.column_stack([np.ones(len(lags)), 1.0 - np.exp(-lags / last)])
        fits.append(nnls(A * weight[:, None], np.maximum(spread - hidden, 0.0) * weight))
    white, lasting = np.sqrt(min(fits, key=lambda fit: fit[1])[0]).tolist()
    return white, lasting


# Errors of fixes that a Gnss table alone reveals.

#: Number of fixes that show their scatter; a longer interval, relative to the usual, is a gap; and
#: residuals beyond so many standard deviations are faults.
LEAST_ROWS, UNEVEN, TRIM = 30, 0.2, 5.0
#: Lags over which errors are shown to last, s, the longest that is needed, and the share of the
#: noise of velocities in it that is too large.
LAGS, LEAST_LAG, HIDDEN = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0), 9.0, 0.5
#: Correlation times that are tried, s.
TIMES = (30.0, 100.0)
#: Factor between the stated standard deviations of float and fixed solutions, at least, and the
#: largest one of the best fixed solution, m.
FLOAT_GAP, FIXED_SD = 3.0, 0.1
#: Limits beyond any vehicle: a speed over the ground, m/s, and an acceleration, m/s².
LARGEST_SPEED, LARGEST_ACCELERATION = 12_000.0, 60.0
#: In standard deviations of the positions and of the displacement between them.
JUMP = 8.0
#: Number of steps for the check of units, and the least speed for it, m/s.
LEAST_STEPS, LEAST_SPEED = 10, 2.0
#: A receiver repeats itself if so many consecutive rows are equal while it moves.
ALIKE = 3
#: Its speed before and after is that over so many fixes; the least that counts as moving, m/s.
BESIDE, MOVING = 4, 0.5
#: Number of rows that a message lists.
NAMED = 5


def check_fixes(table: pd.DataFrame) -> list[Finding]:
    """Check the fixes of a table.

    Parameters
    ----------
    table : DataFrame
        Gnss table.

    Returns
    -------
    list of Finding
        Standard deviations of zero; gaps; positions that jump; a receiver that repeats itself.
    """
    check_gnss(table)
    source = source_of(table)
    time = index_of(table)
    placed, fast = usable(table, POSITION_SD), usable(table, VELOCITY_SD)
    if not len(time):
        raise DataError("navigation.no-fixes", file=source, quantity="time")
    told = placed | usable(table, VELOCITY_SD[:2])  # many have speed and course only
    if not told.any():
        raise DataError(
            "navigation.none-rows-fix-quality-or", file=source, quantity="quality", count=len(time)
        )
    _refuse_units(table, time, placed, source)
    found = [*_certain(table, source), *_gaps(time, told, source)]
    if not placed.any() and ORIGIN_STATED not in table.attrs:
        found.append(
            Finding(
                "navigation.no-place-used-none-rows",
                file=source,
                quantity=", ".join(POSITION_SD),
                count=len(time),
            )
        )
    found += _jumps(table, time, placed, fast, source)
    frozen, speed = repeated_rows(table)
    return [*found, _repeats(source, frozen, speed)] if frozen.any() else found


def _refuse_units(table: pd.DataFrame, time: Array, placed: Flags, source: str | None) -> None:
    """Refuse positions whose speed shows that they are not in degrees."""
    rows = np.flatnonzero(placed)
    if len(rows) < 2:
        return
    place, velocity = values_of(table, GEODETIC)[rows], values_of(table, VELOCITY)[rows]
    speed = ways_between(place) / np.diff(time[rows])
    beyond = np.flatnonzero(speed > LARGEST_SPEED)
    if beyond.size > 0.5 * len(speed):
        k = int(beyond[0])
        raise DataError(
            "navigation.places-move-fix-fix-steps",
            file=source,
            row=int(rows[k + 1]) + 1,
            quantity="lat, lon",
            speed=speed[k],
            size=beyond.size,
            count=len(speed),
        )
    told = np.asarray(np.linalg.norm(0.5 * (velocity[1:] + velocity[:-1])[:, :2], axis=1))
    finite = np.isfinite(values_of(table, VELOCITY_SD)[rows]).min(axis=1)
    clear = (told > LEAST_SPEED) & finite[1:] & finite[:-1]
    if clear.sum() < LEAST_STEPS:
        return
    ratio = float(np.median(speed[clear] / told[clear]))
    if 55.0 < ratio < 65.0:
        row = int(rows[np.flatnonzero(clear)[0]]) + 1
        raise DataError(
            "navigation.fixes-in-minutes", file=source, row=row, quantity="lat, lon", ratio=ratio
        )


def _certain(table: pd.DataFrame, source: str | None) -> list[Finding]:
    out = []
    good = np.asarray(values_of(table, ["quality"])[:, 0] > 0.0)
    for columns, option in (
        (POSITION_SD, "least_position_sd_m"),
        (VELOCITY_SD, "least_velocity_sd_m_per_s"),
    ):
        zero = good & (values_of(table, columns) == 0.0).any(axis=1)
        if zero.any():
            out.append(
                Finding(
                    "navigation.fix-sd-zero",
                    file=source,
                    row=int(np.argmax(zero)) + 1,
                    quantity=", ".join(columns),
                    rows=_rows(zero),
                    option=option,
                )
            )
    return out


def _gaps(time: Array, told: Flags, source: str | None) -> list[Finding]:
    rows = np.flatnonzero(told)
    gaps = find_gaps(time[rows])
    if not gaps:
        return []
    longest = max(gaps, key=lambda gap: gap.length)
    listed = [f"{gap.length:.3g} s from {gap.start:.9g} s" for gap in gaps[:NAMED]]
    listed += ["…"] if len(gaps) > NAMED else []
    return [
        Finding(
            "navigation.outages" if len(gaps) > 1 else "navigation.outage",
            file=source,
            row=int(rows[longest.sample]) + 1,
            quantity="time",
            count=len(gaps),
            length=longest.length,
            usual=longest.usual,
            listed=listed,
        )
    ]


def _jumps(
    table: pd.DataFrame, time: Array, placed: Flags, fast: Flags, source: str | None
) -> list[Finding]:
    """Positions that no vehicle reaches from the previous one."""
    rows = np.flatnonzero(placed)
    if len(rows) < 3:
        return []
    place = values_of(table, GEODETIC)[rows]
    sd = np.linalg.norm(values_of(table, POSITION_SD)[rows], axis=1)
    moved = place_difference(place[1:], place[:-1])
    steps = np.diff(time[rows])
    has = (fast[rows][1:] & fast[rows][:-1])[:, None]
    v = np.where(fast[rows][:, None], values_of(table, VELOCITY)[rows], 0.0)
    # Without a velocity that of the step before is used.
    before = np.vstack([moved[1] / steps[1], (moved / steps[:, None])[:-1]])
    way = np.where(has, 0.5 * (v[1:] + v[:-1]), before) * steps[:, None]
    off = np.linalg.norm(moved - way, axis=1)
    # Effect of an acceleration beyond the mean of two velocities, or beyond one speed.
    free = np.where(has[:, 0], 0.125, 1.0) * LARGEST_ACCELERATION * steps**2
    allowed = JUMP * np.hypot(sd[1:], sd[:-1]) + free
    struck = off > allowed
    if not struck.any():
        return []
    k = int(np.argmax(off / allowed))
    at = np.zeros(len(time), dtype=np.bool_)
    at[rows[1:][struck]] = True
    return [
        Finding(
            "navigation.position-jumps",
            file=source,
            row=int(rows[k + 1]) + 1,
            quantity="lat, lon, alt",
            rows=_rows(at),
            off=off[k],
            sd=sd[k + 1],
        )
    ]


def _repeats(source: str | None, frozen: Flags, speed: float) -> Finding:
    """Report the rows that repeat an earlier fix while the vehicle moves."""
    return Finding(
        "navigation.receiver-repeats",
        file=source,
        row=int(np.argmax(frozen)) + 1,
        quantity="lat, lon, alt, VN, VE, VD",
        rows=_rows(frozen),
        speed=speed,
    )


def repeated_rows(table: pd.DataFrame) -> tuple[Flags, float]:
    """Find rows that repeat the position and velocity of an earlier one while the vehicle moves.

    Moving is what the repeated velocity states. Without it the position after them shows it: as far
    off as the speed before or after makes in this time, and beyond the errors of positions. A
    vehicle that has stopped is near where it stopped.

    Parameters
    ----------
    table : DataFrame
        Gnss table.

    Returns
    -------
    rows : ndarray of bool, (n,)
    speed : float, m/s
        Of the vehicle in the first; 0 without any.
    """
    sd, velocity_sd = values_of(table, POSITION_SD), values_of(table, VELOCITY_SD)
    placed, fast = usable(table, POSITION_SD), usable(table, VELOCITY_SD[:2])
    place, time = values_of(table, GEODETIC), index_of(table)
    velocity = np.where(np.isfinite(velocity_sd), values_of(table, VELOCITY), 0.0)
    values = np.column_stack([place, velocity])
    # Errors from fix to fix are those that a way of some fixes has; others last.
    usual = np.minimum(sd, _scatter(place[placed])) if placed.sum() > ALIKE else sd
    same = np.zeros(len(values), dtype=np.bool_)
    same[1:] = (values[1:] == values[:-1]).all(axis=1) & placed[1:] & placed[:-1]
    out, first = np.zeros(len(values), dtype=np.bool_), 0.0
    for run in true_runs(same):
        a, b = run.start, run.stop
        if b - a < ALIKE - 1:
            continue
        if fast[a]:
            speed = float(np.linalg.norm(velocity[a]))
            slip = np.where(np.isfinite(velocity_sd[a]), velocity_sd[a], 0.0)
            moves = speed > max(3.0 * float(np.linalg.norm(slip)), MOVING)
        elif a < 2 or b + 1 >= len(values):
            continue
        else:
            # Over some fixes: from one to the next a walk is hardly more than their scatter.
            c, d = max(0, a - 1 - BESIDE), min(len(values) - 1, b + BESIDE)
            ways = ways_between(place[[c, a - 1, b, d]])
            speeds = np.array([ways[0] / (time[a - 1] - time[c]), ways[2] / (time[d] - time[b])])
            way = speeds * (time[b] - time[a - 1])
            blur = 5.0 * float(np.linalg.norm(usual[[a, b]]))
            gone = (way > blur) & (ways[1] > np.maximum(blur, 0.5 * way)) & (speeds > MOVING)
            moves, speed = bool(gone.any()), float(speeds.max(where=gone, initial=0.0))
        if moves:
            out[a:b] = True
            first = first or speed
    return out, first


def _scatter(place: Array) -> Array:
    """Standard deviation of the errors of positions from fix to fix, (3,), m.

    By the median of the differences of a position from the middle of its neighbors.
    """
    off = place_difference(place[1:-1], 0.5 * (place[:-2] + place[2:]))
    return np.asarray(MAD_TO_SD * np.median(np.abs(off), axis=0) / math.sqrt(1.5))


def without_repeats(table: pd.DataFrame) -> tuple[pd.DataFrame, tuple[Finding, ...]]:
    """Return fixes of which those that `repeated_rows` finds have no quality, and the finding."""
    frozen, speed = repeated_rows(table)
    if not frozen.any():
        return table, ()
    out = table.copy()
    out.attrs = dict(table.attrs)
    out.loc[frozen, "quality"] = 0.0
    return out, (_repeats(source_of(table), frozen, speed),)


def _rows(struck: Flags) -> list[int | str]:
    """The first rows, counted from 1, as text; dots for further ones."""
    at: list[int | str] = [*(np.flatnonzero(struck) + 1).tolist()]
    return [*at[:NAMED], "…"] if len(at) > NAMED else at
