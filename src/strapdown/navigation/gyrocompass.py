"""Heading of a stationary body by the Earth's rate, and the check of the gyros at rest."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import BIASED, ROCKS, FineAlignment, FineResult
from strapdown.constants import STANDARD_GRAVITY
from strapdown.earth import gravity
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import Finding, StrapdownError
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import PHYSICAL
from strapdown.nav_state import NavState
from strapdown.navigation.heading_integrity import SURE
from strapdown.navigation.measurements.standstill import StandstillAid
from strapdown.navigation.modes import Aligned
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import steps_of
from strapdown.navigation.record import NavigationRecord
from strapdown.rotation import euler_sd
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import GEODETIC, GYRO, VELOCITY
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]

#: Two-sided 99 % quantiles of Student's t, with one degree of freedom to three.
STUDENT = (63.656741162872, 9.924843200918, 5.840909309733)
#: Root mean square of normalized innovations beyond which an alignment is rejected.
INCONSISTENT = 2.0
#: Scatter of the rotations about the vertical, each second, beyond which a body rocks, rad/s.
ROCKS_BY = math.radians(0.01)


@dataclass(frozen=True, eq=False)
class Compass:
    """Heading found by the gyros at rest, without prior knowledge.

    Attributes
    ----------
    begin, time : float, s
        Begin of the rest, and the instant at which the heading holds.
    q_nb : ndarray, (4,)
    gyro_bias : ndarray, (3,), rad/s
    lat_deg : float, deg
        Latitude.
    sd : float, deg
        Standard deviation of the heading by the stated gyro errors, times the excess scatter of
        the innovations.
    bound : float, deg
        99 % bound of the heading, by the gyro errors observed during the rest.
    unsteady : float, rad/s
        Mean rate about the vertical minus the Earth's and the estimated bias: a gyro change within
        the rest.
    """

    begin: float
    time: float
    q_nb: Array
    gyro_bias: Array
    lat_deg: float
    sd: float
    bound: float
    unsteady: float = 0.0


def north_within(sensors: ImuUncertainty, lat_deg: float, ellipsoid: Ellipsoid) -> float:
    """Return the standard deviation of gyrocompassing with the stated gyros, deg."""
    bias = np.hypot(sensors.gyro.axis("bias"), sensors.gyro_drift.triad)
    across = float(np.linalg.norm(Site(lat_deg, 0.0, 0.0, ellipsoid).earth_rate[:2]))
    worst = float(np.max(bias))
    return math.degrees(math.atan2(worst, across))


def compasses_of(
    chain: NavigationPipeline,
    sensors: ImuUncertainty,
    imu: pd.DataFrame,
    record: NavigationRecord,
    aligned: Sequence[Aligned],
    ellipsoid: Ellipsoid,
) -> tuple[list[Compass], list[float], Finding | None]:
    """Return the headings found by the alignments and the rests of a run, each independently.

    An alignment with a given heading, and each rest that a zero-velocity measurement detected, get
    a fine alignment of their own, which begins with north as the inertial frame shows it.

    Parameters
    ----------
    chain : NavigationPipeline
        Pipeline of the run.
    imu : DataFrame
        Samples of the run.
    record : NavigationRecord
        Result of the run.
    aligned : sequence of Aligned
        Its alignments.

    Returns
    -------
    compasses : list of Compass
        In order of time.
    doubts : list of float, s
        Ends of rests at which the gyros were not as stated.
    why : Finding or None
        Why no heading was found; None where one was.
    """
    found: list[Compass] = []
    refused: list[Finding] = []
    doubts: list[float] = []
    rests = seen_rests(chain, imu, record)
    coarse: Alignment | None = None
    fines = {one.begin for one in aligned if one.fine is not None}
    for one in aligned:
        if one.fine is None:
            coarse = one.alignment
            # Alignments by course moved; those before a fine alignment are its beginning.
            if coarse.velocity is None and one.end not in fines and one.end - one.begin >= SHORTEST:
                rests.append((one.begin, one.end))
            continue
        begin = float(one.fine.history.index[0])
        if one.fine.heading_given:
            rests.append((begin, one.end))
            continue
        against, of_gyros = _against(one.fine, coarse)
        if of_gyros:
            doubts.append(one.end)
        if against:
            refused.append(_note("navigation.alignment-not-consistent", reason=against))
        else:
            found.append(
                _judged(one.fine, begin, _site(record, one.fine.alignment.time, ellipsoid))
            )
    for begin, end in sorted(rests):
        site = _site(record, end, ellipsoid)
        try:
            fine, before = _aligned_anew(imu, site, sensors, begin, end)
        except StrapdownError as error:
            # The body was stationary by its measurements, but not by its gyros.
            doubts.append(end)
            refused.append(_note("navigation.rest-without-north", reason=error.finding))
            continue
        against, of_gyros = _against(fine, before)
        if of_gyros:
            doubts.append(end)
        if against:
            refused.append(_note("navigation.rest-not-consistent", reason=against))
        else:
            found.append(_judged(fine, begin, site))
    found = [replace(one, unsteady=_unsteady(imu, one, sensors, ellipsoid)) for one in found]
    if found:
        return sorted(found, key=lambda one: one.time), doubts, None
    if refused:
        return [], doubts, refused[-1]
    return [], doubts, _note("navigation.never-at-rest-for-north")


def _note(code: str, **data: Any) -> Finding:
    return Finding(code, severity="note", data=data)


def _judged(fine: FineResult, begin: float, site: Site) -> Compass:
    """Heading with the gyro errors observed during its own rest.

    An east rate error and a heading error are indistinguishable. The rest shows the rates to the
    north and down, which must be the Earth's. The gyro accuracy is then known by the stated
    errors, which count as one observation, and by these n, u of their standard deviations each:
    the heading error is within ``t sqrt((1 + sum u²)/(1 + n))`` standard deviations in 99 of 100
    cases, with t of Student's distribution of 1 + n degrees of freedom.
    """
    found = fine.alignment
    sd = float(found.sd_deg[2]) * max(1.0, _scatter(fine))
    u = _surprises(fine, site)
    size = math.sqrt((1.0 + float(u @ u)) / (1.0 + len(u)))
    assert found.gyro_bias is not None
    return Compass(
        begin,
        found.time,
        found.q_nb,
        found.gyro_bias,
        site.lat_deg,
        sd,
        sd * max(SURE, STUDENT[len(u)] * size),
    )


def _unsteady(
    imu: pd.DataFrame, one: Compass, sensors: ImuUncertainty, ellipsoid: Ellipsoid
) -> float:
    """Mean rate about the vertical over a rest, minus the Earth's and the bias; rad/s."""
    time = index_of(imu)
    first, last = np.searchsorted(time, [one.begin, one.time])
    rates = values_of(imu, GYRO)[first:last]
    C_nb = rotation.dcm_from_quaternion(one.q_nb)
    down = (rates - one.gyro_bias) @ C_nb[2]
    length = max(one.time - one.begin, 1.0)
    parts = max(2, round(length))
    turns = np.array([part.mean() for part in np.array_split(down, parts)])
    if float(np.std(turns)) > ROCKS_BY:
        return 0.0
    earth = float(Site(one.lat_deg, 0.0, 0.0, ellipsoid).earth_rate[2])
    noise = float(np.max(sensors.gyro.axis("noise_density"))) / math.sqrt(length)
    return max(0.0, abs(float(down.mean()) - earth) - 3.0 * noise)


def _surprises(fine: FineResult, site: Site) -> Array:
    """Rates to the north and down minus the Earth's, in expected standard deviations.

    One observed less accurately than the heading itself, such as that about the vertical of a
    rocking body, does not show gyro errors.
    """
    found = fine.alignment
    assert found.gyro_bias is not None
    C_nb = rotation.dcm_from_quaternion(found.q_nb)
    before = C_nb @ np.diag(np.square(fine.filter.model.sensors[0].sd[:3])) @ C_nb.T
    gyros = slice(PHYSICAL, PHYSICAL + 3)
    after = C_nb @ fine.filter.physical_covariance(fine.state)[gyros, gyros] @ C_nb.T
    rate = C_nb @ found.gyro_bias
    of_heading = math.radians(float(found.sd_deg[2])) * float(np.linalg.norm(site.earth_rate[:2]))
    out = []
    for k in (0, 2):
        told = float(before[k, k] - after[k, k])
        # An estimate of the variance `told` is that of a reading with this much noise.
        noise = before[k, k] * after[k, k] / told if told > 0.0 else math.inf
        if noise <= of_heading**2:
            out.append(float(rate[k]) / math.sqrt(told))
    return np.array(out)


def _scatter(fine: FineResult) -> float:
    """Root mean square of the normalized innovations, of the worst component."""
    worst = 0.0
    for table in fine.innovations.values():
        late = table.iloc[len(table) // 10 :]
        parts = len(late.columns) // 3
        nu, s = late.iloc[:, :parts].to_numpy(), late.iloc[:, parts : 2 * parts].to_numpy()
        worst = max(worst, float(np.sqrt(np.mean(np.square(nu) / s, axis=0)).max()))
    return worst


def _against(fine: FineResult, coarse: Alignment | None) -> tuple[Finding | None, bool]:
    """Finding against an alignment, and whether the gyros cause it.

    A vehicle in slight motion is inconclusive; gyros with impossible readings have changed.
    """
    found = [one for one in fine.findings if one.code != ROCKS]
    for one in found:
        if one.code == BIASED and one.data["sensor"] == "gyro":
            return one, True
    if found:
        return found[0], False
    scatter = _scatter(fine)
    if scatter > INCONSISTENT:
        return _note("navigation.alignment-innovations-scatter", ratio=scatter), False
    if coarse is None or coarse.heading_given:
        return None, False
    beside = fine.at_start if abs(coarse.time - fine.at_start.time) < 1.0 else fine.alignment
    apart = rotation.within_half_turn(coarse.roll_pitch_heading[2] - beside.roll_pitch_heading[2])
    if abs(float(apart)) > SURE * math.hypot(float(coarse.sd_deg[2]), float(beside.sd_deg[2])):
        apart_deg = abs(float(apart))
        return _note("navigation.coarse-and-fine-heading-differ", apart_deg=apart_deg), True
    return None, False


def _aligned_anew(
    imu: pd.DataFrame, site: Site, sensors: ImuUncertainty, begin: float, end: float
) -> tuple[FineResult, Alignment]:
    """Fine alignment of a rest, from its samples and its position alone."""
    time = index_of(imu)
    first, last = np.searchsorted(time, [begin - 1e-6, end + 1e-6])
    part = imu.iloc[first:last]
    part.attrs = dict(imu.attrs)
    coarse = COARSE_ALIGNMENTS["inertial_frame"]().align(part, site, sensors)
    return FineAlignment().align(part, site, sensors, coarse), coarse


def _site(record: NavigationRecord, time: float, ellipsoid: Ellipsoid) -> Site:
    """Position by the run."""
    row = min(int(np.searchsorted(index_of(record.trajectory), time)), len(record.trajectory) - 1)
    lat_deg, lon_deg, alt = (float(record.trajectory[c].iloc[row]) for c in GEODETIC)
    return Site(lat_deg, lon_deg, alt, ellipsoid)


# Effect of a maneuver on an unknown heading, by the filter's covariance.


#: Tried maneuver: m/s², s.
HARD, LONG = 0.2 * STANDARD_GRAVITY, 5.0
#: Speed below which the vehicle is stationary, m/s; fastest turn, rad/s.
STANDS, QUICKEST = 1.0, 0.5
STEP = 0.1


@dataclass(frozen=True)
class Manoeuvre:
    """Maneuver of a driver.

    Attributes
    ----------
    what : str
        In words, to precede "would bring".
    forward, aside : float, m/s²
        Horizontal acceleration along and across the way.
    duration : float, s
    """

    what: str
    forward: float
    aside: float
    duration: float


def manoeuvres_from(speed: float) -> tuple[Manoeuvre, ...]:
    """Return possible maneuvers at a speed in m/s: 0.2 g for 5 s, or until it would stop."""
    out = [Manoeuvre(f"speeding up at 0.2 g for {LONG:g} s", HARD, 0.0, LONG)]
    if speed >= STANDS:
        lasts = min(LONG, math.floor(10.0 * speed / HARD) / 10.0)
        out.append(Manoeuvre(f"braking at 0.2 g for {lasts:g} s", -HARD, 0.0, lasts))
    if speed * QUICKEST >= HARD:
        angle = math.degrees(HARD / speed * LONG)
        words = f"a turn at 0.2 g for {LONG:g} s (by {angle:.0f}°)"
        out.append(Manoeuvre(words, 0.0, HARD, LONG))
    return tuple(out)


def sd_after(
    filter_: ErrorFilter,
    start: NavState,
    P: Array,
    manoeuvre: Manoeuvre,
    position_sd: Array | None,
    velocity_sd: Array | None,
    interval: float,
) -> float:
    """Return the standard deviation of the heading after a maneuver, deg.

    The filter propagates its covariance over the motion and processes fixes; measured values are
    not needed, since a covariance does not depend on them.

    Parameters
    ----------
    P : ndarray, (p, p)
        As `ErrorFilter.begin`.
    position_sd, velocity_sd : ndarray, (3,), or None
        Of the fixes, north, east, down, m and m/s; None for a missing quantity.
    interval : float, s
        Between two fixes.
    """
    state = filter_.begin(start, P)
    state = _fixed(filter_, state, position_sd, velocity_sd)
    for begin in np.arange(0.0, manoeuvre.duration - 0.5 * STEP, interval):
        end = min(begin + interval, manoeuvre.duration)
        count = max(1, round((end - begin) / STEP))
        dt = (end - begin) / count
        rows = np.array([_row(filter_, start, manoeuvre, begin + k * dt, dt) for k in range(count)])
        time = state.time + dt * np.arange(1, count + 1)
        state, _ = filter_.predict(state, time, rows)
        state = _fixed(filter_, state, position_sd, velocity_sd)
    mechanization = filter_.mechanization
    turn = np.kron(np.eye(3), mechanization.level_from_ned(state.row))
    whole = turn.T @ filter_.physical_covariance(state)[:9, :9] @ turn
    euler = rotation.euler_from_quaternion(start.q_nb)
    return float(euler_sd(euler, whole[6:, 6:])[2])


def _row(filter_: ErrorFilter, start: NavState, m: Manoeuvre, begin: float, dt: float) -> Array:
    """Increment of a step: a level motion along and across a way that turns with it."""
    speed = float(np.hypot(*start.v_n[:2]))
    course = math.atan2(start.v_n[1], start.v_n[0])
    roll, pitch, heading = np.radians(rotation.euler_from_quaternion(start.q_nb)).tolist()
    if speed < STANDS:
        course = heading
    rate = m.aside / speed if m.aside else 0.0
    along = course + rate * (begin + 0.5 * dt)
    ahead = np.array([math.cos(along), math.sin(along), 0.0])
    right = np.array([-math.sin(along), math.cos(along), 0.0])
    g = gravity(
        math.degrees(start.lat),
        start.alt,
        ellipsoid=find_ellipsoid(filter_.mechanization.ellipsoid),
    )
    # Attitude turns with the path; the force is that at mid-step, in its first axes.
    turned = np.degrees([roll, pitch, heading + rate * begin])
    C_bn = rotation.dcm_from_euler(turned).T
    force = C_bn @ (m.forward * ahead + m.aside * right - g)
    turn = C_bn @ np.array([0.0, 0.0, rate])
    return np.concatenate([[dt], turn * dt, force * dt, 0.5 * force * dt * dt])


def _fixed(
    filter_: ErrorFilter, state: FilterState, position_sd: Array | None, velocity_sd: Array | None
) -> FilterState:
    """State after a fix; only the covariance is changed."""
    seen = []
    for first, sd in ((0, position_sd), (3, velocity_sd)):
        if sd is not None:
            H = np.zeros((3, filter_.model.physical_size))
            H[:, first : first + 3] = np.eye(3)
            R = np.full(3, float(np.mean(np.square(sd))))
            seen.append(Observation("fix", np.zeros(3), H, R, ("x", "y", "z")))
    if not seen:
        return state
    after, _, _ = filter_.estimate(
        state, np.zeros(filter_.model.layout.size), seen, [None] * len(seen)
    )
    return after


# Stationary intervals of a vehicle, by the detectors of its measurements.


#: Least length of a rest for gyrocompassing, and the longest used at once, s.
SHORTEST, LONGEST = 60.0, 300.0
#: Longest interval between epochs of a rest, s.
APART = 2.5
#: Braking and soft starts within a detected rest, at either end, s.
SOFT = 5.0
#: Computed speed that excludes a rest, m/s. A run whose gyros changed may have smaller errors
#: and reject zero-velocity updates, and its rests must still be found.
GLIDES = 5.0


def seen_rests(
    chain: NavigationPipeline, imu: pd.DataFrame, record: NavigationRecord
) -> list[tuple[float, float]]:
    """Return begins and ends of the rests of a run, split where too long, s.

    Parameters
    ----------
    imu : DataFrame
        Samples of the run.
    record : NavigationRecord
        Result of the run.

    Returns
    -------
    list of (float, float)
        Empty if no measurement detects rests.
    """
    aids = [aid for aid in chain.navigator.aids if isinstance(aid, StandstillAid)]
    if not aids:
        return []
    memories = [aid.begin() for aid in aids]
    seen: list[Array] = []
    span = record.trajectory.index
    for ends, rows in steps_of(chain.intake, imu, float(span[0]), float(span[-1])):
        for k, aid in enumerate(aids):
            memories[k], epochs = aid.watch(memories[k], ends, rows)
            seen.append(epochs.time)
    time = np.unique(np.concatenate(seen)) if seen else np.empty(0)
    speed = np.linalg.norm(values_of(record.trajectory, VELOCITY), axis=1)
    time = time[np.interp(time, index_of(record.trajectory), speed) < GLIDES]
    if not len(time):
        return []
    starts = np.flatnonzero(np.diff(time, prepend=-math.inf) > APART).tolist()
    out: list[tuple[float, float]] = []
    for first, upto in zip(starts, [*starts[1:], len(time)], strict=True):
        begin, end = float(time[first]) + SOFT, float(time[upto - 1]) - SOFT
        if end - begin < SHORTEST:
            continue
        count = max(1, math.floor((end - begin) / LONGEST))
        edges = np.linspace(begin, end, count + 1).tolist()
        out += itertools.pairwise(edges)
    return out
