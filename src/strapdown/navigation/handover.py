"""Alignment at the end of an alignment mode, and the handover to navigation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.course_sums import Antenna
from strapdown.alignment.fine import FineResult
from strapdown.alignment.gnss_course import CLIMB, GnssCourse
from strapdown.alignment.levelling import BLOCKS, turn_variance
from strapdown.alignment.mean_errors import block_means, excursion
from strapdown.constants import MAD_TO_SD
from strapdown.dsp.samples import running_integral
from strapdown.earth import gravity
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState, symmetric
from strapdown.estimation.error_model import PHYSICAL
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import (
    DISPLACEMENT,
    ROTATION,
    VELOCITY,
    Measurement,
    View,
)
from strapdown.navigation.measurements.standstill import rate_at_rest
from strapdown.navigation.modes import Aligned, CoarseMode, FineMode
from strapdown.prefilter.prefilter import CHANNELS
from strapdown.rotation import rotate
from strapdown.sensors.rest import sd_of_mean
from strapdown.sensors.uncertainty import FREEDOM, ImuUncertainty
from strapdown.tables import (
    ACCEL,
    GEODETIC,
    GYRO,
    MOTION,
    POSITION_SD,
    VELOCITY_SD,
    check_gnss,
    usable,
)
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import Array, index_of, source_of, values_of

if TYPE_CHECKING:
    from strapdown.navigation.pipeline import NavigationPipeline, PipelineState


# Rows of the displacement in the covariance of an alignment that estimates the position.
PLACE = slice(39, 42)
# Tolerance of an instant, s.
INSTANT = 1e-7
# A mean rate of a rest beyond so many standard deviations is a turn. A stationary body turns by so
# much from the begin to the end, rad.
TURNS, SWAY = 4.0, math.radians(0.1)
# The rate at an instant is a mean over this time before and after it, s.
STEADY = 0.1


def align(chain: NavigationPipeline, state: PipelineState) -> Aligned:
    """Align with the steps and measurements kept during the mode.

    Parameters
    ----------
    state : PipelineState
        In an alignment mode.

    Raises
    ------
    DataError, DivergenceError
        The alignment is not possible.
    """
    mode = chain.modes[state.mode]
    assert chain.sensors is not None
    imu, sensors, warming = _steps(chain, state), chain.sensors, chain.navigator.warming
    if warming is not None:
        sensors = warming.within(sensors, float(imu.index[0]), float(imu.index[-1]))
    if isinstance(mode, FineMode):
        kept = _window(chain, state)
        assert state.aligned is not None
        coarse = state.aligned.alignment
        site, _ = _site(chain, state, coarse.q_nb)
        increments = _table(kept[1:, 7:17], kept[1:, 0], MOTION, state)
        fine = mode.way.align(imu, site, sensors, coarse, increments=increments)
        return Aligned(mode.name, state.begun, state.time, fine.alignment, fine)
    assert isinstance(mode, CoarseMode)
    site, _ = _site(chain, state, None)
    if isinstance(mode.way, GnssCourse):
        fixes, antenna = _fixes(chain, state), _antenna(chain)
        found = mode.way.align(imu, site, sensors, fixes, antenna)
    else:
        found = mode.way.align(imu, site, sensors, _fixes(chain, state))
    return Aligned(mode.name, state.begun, state.time, found)


def handed_over(chain: NavigationPipeline, state: PipelineState, found: Aligned) -> FilterState:
    """Return the filter state with which navigation begins.

    Parameters
    ----------
    state : PipelineState
        At the end of an alignment mode.
    """
    filter_ = chain.navigator.filter
    rest = _window(chain, state)[:, 1:7].mean(axis=0)
    q_nb = found.alignment.q_nb
    still = np.zeros(3)
    if found.fine is not None:
        assert state.aligned is not None
        before = state.aligned.alignment.q_nb
        _, sd = _site(chain, state, before)
        shift, by_others = still, None
        if chain.site is None:
            arm = _lever_arm(chain)
            shift = rotate(before, arm) - rotate(q_nb, arm)
            by_others = _by_antenna(chain, state, q_nb, still, still)
        return from_fine(filter_, found.fine, rest, sd, shift, by_others)
    mode = chain.modes[state.mode]
    if isinstance(mode, CoarseMode) and isinstance(mode.way, GnssCourse):
        course = found.alignment.earlier or found.alignment
        assert course.velocity is not None and course.joint is not None
        time, q_nb, velocity, joint = course.time, course.q_nb, course.velocity, course.joint
        if course.place is None:
            start, P = _here(chain, state, time, q_nb, velocity, joint[:3, :3])
        else:
            lat, lon, alt = course.place.tolist()
            start = NavState(time, np.radians(lat), np.radians(lon), alt, velocity, q_nb)
            of = np.r_[PLACE, 0:3]
            P = joint[np.ix_(of, of)]
        turn = _turn(_window(chain, state), time)
        by_others = _by_antenna(chain, state, q_nb, start.v_n, turn)
        return from_alignment(filter_, course, start, P, rest, by_others)
    fixes = _fixes(chain, state)
    moved, velocity_sd = None, np.array(chain.velocity_sd)
    if chain.site is None or _from_site(chain, state):
        shaken = any(finding.code == SHAKEN for finding in found.alignment.findings)
        clear = DOUBTFUL if shaken else CLEAR
        moved = motion_by_fixes(fixes, state.begun, state.time, clear)
        if shaken and moved is None:
            velocity_sd = np.maximum(velocity_sd, rest_by_fixes(fixes, state.begun, state.time))
    if moved is not None:
        return _in_motion(chain, state, found, rest, moved)
    site, sd = _site(chain, state, q_nb)
    start = NavState.from_degrees(site.lat_deg, site.lon_deg, site.alt, time=state.time)
    P = np.diag(np.square(np.concatenate([sd, velocity_sd])))
    by_others = None if chain.site is not None else _by_antenna(chain, state, q_nb, still, still)
    begun = from_alignment(filter_, found.alignment, start, P, rest, by_others)
    if not found.alignment.heading_given:
        return begun
    assert chain.sensors is not None
    return _rested(filter_, begun, _steps(chain, state), chain.sensors)


def _rested(
    filter_: ErrorFilter, begun: FilterState, imu: pd.DataFrame, sensors: ImuUncertainty
) -> FilterState:
    """State with the gyro errors that the mean rate of the levelled rest shows.

    Without them a heading that was stated is lost at the rate of an unknown bias before the vehicle
    moves. A rate beyond what the stated errors allow is a turn, and determines no bias; that of a
    body that swings, as in a hand, is known only as well as its own mean turn.
    """
    kept = imu[[*GYRO, *ACCEL]].to_numpy()
    mean = kept.mean(axis=0)
    view = View(
        mechanization=filter_.mechanization,
        model=filter_.model,
        time=begun.time,
        state=begun.mechanization,
        row=begun.row,
        sensors=begun.sensors,
        rate=mean[:3],
        force=mean[3:],
    )
    time = imu.index.to_numpy(dtype=np.float64)
    sway = SWAY / max(float(time[-1] - time[0]), INSTANT)
    variance = np.square(sd_of_mean(time, kept[:, :3])) + sway**2
    means = block_means(imu, BLOCKS)
    if means.scatter(sensors)[0] > 1.0:
        swing = excursion(imu, sensors.gyro.axis("noise_density"))
        variance = variance + turn_variance(sensors, means, swing)
    one = rate_at_rest("rest.rate", view, mean, variance)
    P = filter_.physical_covariance(begun)
    expected = np.einsum("ij,jk,ik->i", one.H, P, one.H) + variance
    if (np.square(one.z) > TURNS**2 * expected).any():
        return begun
    return filter_.observe(begun, [one], [None])[0]


def _in_motion(
    chain: NavigationPipeline,
    state: PipelineState,
    found: Aligned,
    rest: Array,
    moved: tuple[Array, Array],
) -> FilterState:
    """State of a body that its fixes show moving while it is levelled.

    `moved`: its velocity and standard deviation, (3,), m/s. The mean specific force was taken for
    gravity's, though the velocity may have changed by as much as it is.
    """
    filter_, q_nb = chain.navigator.filter, found.alignment.q_nb
    velocity, sd = moved
    start, P = _here(chain, state, state.time, q_nb, velocity, np.diag(np.square(sd)))
    length = max(state.time - state.begun, INSTANT)
    tilt = math.hypot(*velocity[:2]) / (length * float(np.linalg.norm(rest[3:])))
    level = found.alignment.covariance + np.diag([tilt**2, tilt**2, 0.0])
    by_others = _by_antenna(chain, state, q_nb, velocity, _turn(_window(chain, state), state.time))
    alignment = replace(found.alignment, covariance=level)
    return from_alignment(filter_, alignment, start, P, rest, by_others)


def unused_fixes(
    chain: NavigationPipeline, state: PipelineState, begun: float
) -> dict[str, tuple[pd.DataFrame, ...]]:
    """Return the fixes of the alignment's receiver that the alignment has not used.

    Parameters
    ----------
    state : PipelineState
        At the end of an alignment mode.
    begun : float, s
        When navigation begins.

    Returns
    -------
    dict of str to tuple of DataFrame
        By name of the measurement: rows after an alignment by course. A fix at its very end has
        already given position and velocity, and would count twice.
    """
    mode, name = chain.modes[state.mode], chain.fixes_from
    if name is None or not (isinstance(mode, CoarseMode) and isinstance(mode.way, GnssCourse)):
        return {}
    offset = float(getattr(_receiver(chain), "time_offset", 0.0))
    out = [table[table.index - offset > begun + INSTANT] for table in state.told[name]]
    return {name: tuple(table for table in out if len(table))}


def _by_antenna(
    chain: NavigationPipeline, state: PipelineState, q_nb: Array, velocity: Array, turn: Array
) -> Array | None:
    """Error of position and velocity from fixes per physical error."""
    if chain.fixes_from is None:
        return None
    arm, filter_, aid = _lever_arm(chain), chain.navigator.filter, _receiver(chain)
    lasting, by_site = np.zeros(3), _from_site(chain, state)
    if isinstance(aid, Gnss) and aid.lasts and not by_site:
        lasting = aid.lasting_sd(_good(_fixes(chain, state), POSITION_SD, state.time)[1][-1])
    out = errors_by_antenna(filter_, chain.fixes_from, q_nb, arm, velocity, turn, lasting)
    if by_site:
        out[DISPLACEMENT] = 0.0  # its position is not that of the antenna
    return out


def _turn(kept: Array, at: float) -> Array:
    """Mean body rate about an instant, body axes."""
    near = np.abs(kept[:, 0] - at) <= STEADY
    if not near.any():
        near = np.arange(len(kept)) == np.argmin(np.abs(kept[:, 0] - at))
    return np.asarray(kept[near, 1:4].mean(axis=0))


def _window(chain: NavigationPipeline, state: PipelineState) -> Array:
    """Steps to align with."""
    kept, mode = state.kept.rows, chain.modes[state.mode]
    if not isinstance(mode, CoarseMode):
        return kept
    return kept[np.searchsorted(kept[:, 0], state.time - mode.window - INSTANT) :]


def _steps(chain: NavigationPipeline, state: PipelineState) -> pd.DataFrame:
    """Steps to align with, as an Imu table."""
    kept = _window(chain, state)
    imu = _table(kept[:, 1:7], kept[:, 0], CHANNELS, state)
    imu.attrs["sampling"] = chain.intake.sampling(state.intake)
    imu.attrs["axes"] = "forward-right-down"
    return imu


def _table(values: Array, time: Array, columns: list[str], state: PipelineState) -> pd.DataFrame:
    table = pd.DataFrame(values.copy(), index=pd.Index(time, name="time"), columns=columns)
    table.attrs["source"] = state.intake.source
    return table


def _fixes(chain: NavigationPipeline, state: PipelineState) -> pd.DataFrame | None:
    name = chain.fixes_from
    if name is None:
        return None
    offset = float(getattr(chain.navigator.by_name[name], "time_offset", 0.0))
    return fixes_until(state.told[name], state.time + INSTANT, offset)


def _site(
    chain: NavigationPipeline, state: PipelineState, q_nb: Array | None
) -> tuple[Site, Array]:
    """Position of the sensors and its standard deviation."""
    if chain.site is not None:
        return chain.site, np.asarray(chain.site_sd, dtype=np.float64)
    ellipsoid = find_ellipsoid(chain.navigator.filter.mechanization.ellipsoid)
    site, sd = site_of_fixes(_fixes(chain, state), state.begun, state.time, ellipsoid)
    arm = _lever_arm(chain)
    if q_nb is None or not arm.any():
        return site, sd
    antenna = np.array([site.lat_deg, site.lon_deg, site.alt])
    place = geodetic_from_ned(-rotate(q_nb, arm), antenna, ellipsoid=ellipsoid)
    lat_deg, lon_deg, alt = place.tolist()
    return Site(lat_deg, lon_deg, alt, ellipsoid), sd


def _from_site(chain: NavigationPipeline, state: PipelineState) -> bool:
    """Whether the fixes have velocities alone, so that the way begins at the stated site."""
    fixes = _fixes(chain, state)
    return chain.site is not None and fixes is not None and not usable(fixes, POSITION_SD).any()


def _here(
    chain: NavigationPipeline,
    state: PipelineState,
    time: float,
    q_nb: Array,
    velocity: Array,
    covariance: Array,
) -> tuple[NavState, Array]:
    """Position of a vehicle at an instant, as of `here_by_fix`; by the site without positions."""
    fixes, ellipsoid = (
        _fixes(chain, state),
        find_ellipsoid(chain.navigator.filter.mechanization.ellipsoid),
    )
    if not _from_site(chain, state):
        return here_by_fix(fixes, time, q_nb, _lever_arm(chain), ellipsoid, velocity, covariance)
    assert chain.site is not None and fixes is not None
    way, variance = way_by_velocities(fixes, state.begun, time, velocity)
    site = np.array([chain.site.lat_deg, chain.site.lon_deg, chain.site.alt])
    lat, lon, alt = geodetic_from_ned(way, site, ellipsoid=ellipsoid).tolist()
    P = np.zeros((6, 6))
    P[:3, :3] = np.diag(np.square(chain.site_sd) + variance)
    P[3:, 3:] = covariance
    return NavState(time, np.radians(lat), np.radians(lon), alt, velocity, q_nb), P


def _receiver(chain: NavigationPipeline) -> Measurement | None:
    """The receiver whose table holds the fixes."""
    return chain.navigator.by_name.get(chain.fixes_from or "")


def _antenna(chain: NavigationPipeline) -> Antenna:
    """Lever arm and time offset of the receiver."""
    aid = _receiver(chain)
    x, y, z = _lever_arm(chain).tolist()
    return Antenna(
        (x, y, z),
        float(getattr(aid, "velocity_delay", 0.0)),
        float(getattr(aid, "time_offset_sd", 0.0)),
        float(getattr(aid, "position_correlated_share", 0.0)),
        float(getattr(aid, "position_correlation_time", 1.0)),
    )


def _lever_arm(chain: NavigationPipeline) -> Array:
    """Lever arm of the receiver's antenna."""
    arm = getattr(_receiver(chain), "lever_arm", (0.0, 0.0, 0.0))
    return np.asarray(arm, dtype=np.float64)


# Handover from alignment to navigation: the state and its covariance.


# Sensor errors that are correlated to within this fraction count as one.
SAME = 1e-9


def from_state(filter_: ErrorFilter, start: NavState, P: Array) -> FilterState:
    """Initialize a filter with a state and the covariance of its nine errors.

    Parameters
    ----------
    P : ndarray, (9, 9)
        Displacement, velocity, rotation in north-east-down; sensor errors are as the model states.
    """
    return filter_.begin(start, _with_sensors(filter_, P))


def from_alignment(
    filter_: ErrorFilter,
    found: Alignment,
    start: NavState,
    P: Array,
    rest: Array,
    by_others: Array | None = None,
) -> FilterState:
    """Initialize a filter with a coarse alignment.

    Parameters
    ----------
    found : Alignment
        Its biases, if estimated, are subtracted.
    start : NavState
        Position and velocity; the attitude is that of the alignment.
    P : ndarray, (6, 6)
        Displacement and velocity, north-east-down. The velocity block is replaced by the
        alignment's, if estimated.
    rest : ndarray, (6,)
        Mean rate and specific force of the record; they scale the scale-factor errors.
    by_others : ndarray, (6, p), optional
        Error of position and velocity per physical error, north-east-down
        (`by_antenna.errors_by_antenna`), which correlates them from the start.

    Returns
    -------
    FilterState
        If the alignment does not estimate biases, its tilt is correlated with the accelerometer
        errors at rest (`_levelled`). If they were independent, the first zero-velocity update
        would take each to confirm the other, and both covariances would become too small. Both
        are inflated where the magnitude of the specific force contradicts gravity (`_of_unit`).
    """
    whole = np.zeros((PHYSICAL, PHYSICAL))
    whole[:6, :6] = P
    whole[6:9, 6:9] = found.covariance
    start = replace(start, time=found.time, q_nb=found.q_nb)
    if found.gyro_bias is None or found.accel_bias is None:
        P = _levelled(filter_, whole, start, rest)
        return filter_.begin(start, _added(P, by_others))
    assert found.gyro_bias_sd is not None and found.accel_bias_sd is not None
    told = np.concatenate([found.gyro_bias, found.accel_bias])
    sd = np.concatenate([found.gyro_bias_sd, found.accel_bias_sd])
    if found.by_input is not None:
        told = np.concatenate([told, found.by_input])
        sd = np.concatenate([sd, np.zeros(len(found.by_input))])
    joint = np.zeros((PHYSICAL + len(told), PHYSICAL + len(told)))
    joint[:PHYSICAL, :PHYSICAL] = whole
    joint[PHYSICAL:, PHYSICAL:] = np.diag(np.square(sd))
    if found.joint is not None:
        size = len(joint) - 3
        joint[3:, 3:] = found.joint[:size, :size]
        if found.place is None:
            # A velocity error has moved the position since its fix, and carries the alignment's
            # correlations with the velocity.
            joint[:3, 3:] = np.linalg.solve(P[3:, 3:], P[3:, :3]).T @ found.joint[:3]
        else:
            joint[:3, 3:] = found.joint[size:, :size]
        joint[3:, :3] = joint[:3, 3:].T
    return _with_biases(filter_, start, joint, told, rest, by_others)


def from_fine(
    filter_: ErrorFilter,
    fine: FineResult,
    rest: Array,
    site_sd: ArrayLike = (0.0, 0.0, 0.0),
    shift: ArrayLike = (0.0, 0.0, 0.0),
    by_others: Array | None = None,
) -> FilterState:
    """Initialize a filter with the result of a fine alignment.

    The fine alignment has one bias for the total error of a sensor at rest; its covariance with
    the attitude is carried over. Where the filter has more states that act as a bias at rest (a
    drift, a scale factor under gravity), the bias is divided in proportion to their variances, as
    by a Kalman update with their sum: with x of covariance P0 before, and ``b = A x``,
    ``K = P0 A' (A P0 A')^-1``, the estimate is ``K b``, the covariance ``K P_b K' + (1 - K A) P0``
    and that with an attitude ``K P_ba``. With bias states alone K is 1.

    Parameters
    ----------
    filter_ : ErrorFilter
        Filter of navigation; any mechanization, error model and form.
    rest : ndarray, (6,)
        Mean rate in rad/s and specific force in m/s² at rest, body axes.
    site_sd : array_like, (3,), m
        Standard deviation of the site of alignment, north, east, down.
    shift : array_like, (3,), m
        Correction of the position, north, east, down: effect of the refined attitude on the lever
        arm of the antenna by which it was found.
    by_others : ndarray, (6, p), optional
        As in `from_alignment`.
    """
    old, state = fine.filter, fine.state
    P = old.physical_covariance(state)
    level = old.mechanization.level_from_ned(state.row)
    turn = np.eye(len(P))
    for at in (0, 3, 6):
        turn[at : at + 3, at : at + 3] = level.T
    P = turn @ P @ turn.T
    P[0:3, 0:3] += np.diag(np.square(np.asarray(site_sd, dtype=np.float64)))
    start = old.mechanization.nav_state(state.mechanization, state.time)
    moved = np.asarray(shift, dtype=np.float64)
    if moved.any():
        here = np.array([math.degrees(start.lat), math.degrees(start.lon), start.alt])
        ellipsoid = find_ellipsoid(old.mechanization.ellipsoid)
        lat, lon, alt = geodetic_from_ned(moved, here, ellipsoid=ellipsoid).tolist()
        start = replace(start, lat=math.radians(lat), lon=math.radians(lon), alt=alt)
    return _with_biases(filter_, start, P, state.sensors, np.asarray(rest), by_others)


def _added(P: Array, by_others: Array | None) -> Array:
    """Covariance with the errors of position and velocity per physical error added."""
    if by_others is None:
        return P
    T = np.eye(len(P))
    T[:6] += by_others
    return symmetric(T @ P @ T.T)


def _with_sensors(filter_: ErrorFilter, P: Array) -> Array:
    """Covariance of all physical errors, with the sensor errors of their model."""
    out = np.diag(np.concatenate([np.zeros(PHYSICAL), np.square(filter_.model.stacked.sd)]))
    out[:PHYSICAL, :PHYSICAL] = P
    return out


def _levelled(filter_: ErrorFilter, P: Array, start: NavState, rest: Array) -> Array:
    """Covariance of all physical errors after leveling by accelerometers.

    Accelerometer errors at rest, ``e = A x`` of the states x, tilt the measured gravity by
    ``psi_x = -(C e)_east / g``, ``psi_y = (C e)_north / g``. A heading correlated with the tilt is
    correlated with x accordingly. Where x may exceed the stated tilt, the correlation is limited
    to the largest possible.
    """
    out = _with_sensors(filter_, P)
    P0 = out[PHYSICAL:, PHYSICAL:]
    size = float(np.linalg.norm(rest[3:]))
    north_east = rotation.dcm_from_quaternion(start.q_nb)[:2] / size
    A = _read_at_rest(filter_, rest)[3:]
    T = np.array([[0.0, -1.0], [1.0, 0.0]]) @ north_east @ A
    attitude = P[6:9, 6:9]
    by_tilt = attitude[:, :2] @ np.linalg.inv(attitude[:2, :2])
    stated = T @ P0 @ T.T
    moved = size**2 * max(0.5 * float(np.trace(attitude[:2, :2] - stated)), 0.0)
    up = rest[3:] / size @ A
    ellipsoid = find_ellipsoid(filter_.mechanization.ellipsoid)
    g = gravity(math.degrees(start.lat), start.alt, ellipsoid=ellipsoid)
    wider = _of_unit(size - float(np.linalg.norm(g)), float(up @ P0 @ up) + moved)
    attitude = attitude + (wider - 1.0) * by_tilt @ stated @ by_tilt.T
    D = np.where(A.any(axis=0), math.sqrt(wider), 1.0)
    P0 = D[:, None] * P0 * D
    root = np.linalg.cholesky(attitude[:2, :2])
    own = np.linalg.solve(root, T @ np.sqrt(P0))
    part = min(1.0, 1.0 / max(float(np.linalg.norm(own, 2)), 1e-300))
    out[6:9, 6:9], out[PHYSICAL:, PHYSICAL:] = attitude, P0
    out[6:9, PHYSICAL:] = part * by_tilt @ T @ P0
    out[PHYSICAL:, 6:9] = out[6:9, PHYSICAL:].T
    return symmetric(out)


def _of_unit(excess: float, variance: float) -> float:
    """Factor on the variances of accelerometers by their error along the vertical; at least 1.

    `excess` (m/s²): magnitude of the specific force minus gravity. `variance`: stated. The errors
    of the units of a type have Student's t distribution of `FREEDOM`: a unit that lies far outside
    along the vertical is likely to along the horizontal, too, where its error is a tilt.
    """
    if not variance > 0.0:
        return 1.0
    return max(1.0, (FREEDOM + excess**2 / variance) / (FREEDOM + 1.0))


def _with_biases(
    filter_: ErrorFilter,
    start: NavState,
    joint: Array,
    told: Array,
    rest: Array,
    by_others: Array | None = None,
) -> FilterState:
    """Initialize with a state whose errors are correlated with estimated sensor errors.

    The first six sensor errors are those at the mean input; any more are per input.
    """
    P0 = np.diag(np.square(filter_.model.stacked.sd))
    A = _read_at_rest(filter_, rest - told[:6])
    if len(told) > len(A):
        A = np.vstack([A, _read_by_input(filter_)])
    size = np.sqrt(np.diagonal(A @ P0 @ A.T))
    known = size > 0.0
    A, at, size = A[known], PHYSICAL + np.flatnonzero(known), size[known]
    # Where a channel has scale-factor errors only, its bias is an error of scale.
    parts = np.linalg.pinv(A @ P0 @ A.T / np.outer(size, size), SAME, hermitian=True)
    K = P0 @ A.T @ (parts / np.outer(size, size))
    P = _with_sensors(filter_, joint[:PHYSICAL, :PHYSICAL])
    left = symmetric(P0 - K @ A @ P0)
    P[PHYSICAL:, PHYSICAL:] = symmetric(K @ joint[np.ix_(at, at)] @ K.T) + left
    P[PHYSICAL:, :PHYSICAL] = K @ joint[at, :PHYSICAL]
    P[:PHYSICAL, PHYSICAL:] = P[PHYSICAL:, :PHYSICAL].T
    state = filter_.begin(start, _added(symmetric(P), by_others))
    return replace(state, sensors=K @ told[at - PHYSICAL])


def with_drift(filter_: ErrorFilter, state: FilterState, drift: float, sd: float) -> FilterState:
    """Return a state with a hypothesis of the error of the gyros about down, rad/s."""
    used = filter_.mechanization.nav_state(state.mechanization, state.time)
    down = rotation.dcm_from_quaternion(used.q_nb)[2]
    H = np.zeros((1, PHYSICAL + len(state.sensors)))
    H[0, PHYSICAL:] = down @ _read_at_rest(filter_, np.zeros(6))[:3]
    z = np.array([drift]) - H[:, PHYSICAL:] @ state.sensors
    one = Observation("drift", z, H, np.array([sd**2]), ("down, rad/s",))
    return filter_.observe(state, [one], [None])[0]


def _read_at_rest(filter_: ErrorFilter, rest: Array) -> Array:
    """Contribution of each sensor state to the six channels of a stationary body, (6, k)."""
    stacked = filter_.model.stacked
    inputs = np.concatenate([[1.0], rest])
    return np.vstack([np.tensordot(inputs, of, axes=1) for of in (stacked.gyro, stacked.accel)])


def _read_by_input(filter_: ErrorFilter) -> Array:
    """Contribution of each sensor state to `Alignment.by_input`, (27, k)."""
    stacked = filter_.model.stacked
    parts = (stacked.gyro[1:4], stacked.gyro[4:7], stacked.accel[4:7])
    return np.concatenate([one.transpose(1, 0, 2).reshape(9, -1) for one in parts])


# Correlation of a position and velocity from fixes with lever arm and time offset.


def errors_by_antenna(
    filter_: ErrorFilter,
    name: str,
    q_nb: Array,
    lever_arm: Array,
    velocity: Array,
    turn: Array,
    lasting: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Return the errors of position and velocity from fixes per physical error.

    Parameters
    ----------
    name : str
        Name of the measurement with the fixes.
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Lever arm of the antenna, body axes.
    velocity : ndarray, (3,), m/s
        North, east, down.
    turn : ndarray, (3,), rad/s
        Rate of the body relative to the Earth, body axes.
    lasting : array_like, (3,), m
        Standard deviation of the correlated errors of the positions.

    Returns
    -------
    ndarray, (6, p)
        Displacement and velocity, north-east-down, per physical error.

    Notes
    -----
    A time offset that is assumed too large by tau shifts a fix in time, so that the position is
    wrong by ``v tau``. With arm r and rate W in north-east-down, the position ``p - r``
    is wrong by ``[r x] psi - C e``, and the velocity ``v - W x r`` by
    ``[(W x r) x] psi - W x C e``, where psi is the error of the attitude and e that of the arm.
    Without these correlations the first fixes would count as independent of the position that was
    made from them, and would confirm a zero time offset.
    """
    columns = filter_.model.columns_of
    C = rotation.dcm_from_quaternion(q_nb)
    out = np.zeros((6, filter_.model.physical_size))
    out[DISPLACEMENT, ROTATION] = rotation.cross_matrix(C @ lever_arm)
    out[VELOCITY, ROTATION] = rotation.cross_matrix(C @ np.cross(turn, lever_arm))
    if f"{name}.lever_arm" in columns:
        arm = columns[f"{name}.lever_arm"]
        out[DISPLACEMENT, arm] = -C
        out[VELOCITY, arm] = -C @ rotation.cross_matrix(turn)
    if f"{name}.time_offset" in columns:
        out[DISPLACEMENT, columns[f"{name}.time_offset"]] = velocity[:, None]
    if f"{name}.position_error" in columns:
        out[DISPLACEMENT, columns[f"{name}.position_error"]] = np.diag(np.asarray(lasting))
    return out


# Position during an alignment: the stated site, or the fixes of a receiver.


# Standard deviation of a vehicle's acceleration, m/s².
MANOEUVRE = 1.0
# Fixes considered for outliers: most, longest time, s, and fewest.
LOOKED_AT, LOOKED_BACK, LEAST_LOOKED_AT = 9, 10.0, 4
# Standard deviations that make a fix an outlier, or that prove motion.
CLEAR = 5.0
# And those of a body that the sensors do not show at rest, by this finding of its levelling.
DOUBTFUL, SHAKEN = 1.0, "alignment.specific-force-scatters"
# Speed of a body that is not at rest, m/s; number of velocities whose median shows it.
MOVES, NEWEST = 0.5, 3
#: Standard deviation of a velocity of which nothing is known, m/s.
UNKNOWN_VELOCITY = 10.0


def fixes_until(
    tables: Sequence[pd.DataFrame], time: float, offset: float = 0.0
) -> pd.DataFrame | None:
    """Concatenate the fixes up to an instant.

    Parameters
    ----------
    tables : sequence of DataFrame
        Gnss tables, one after the other.
    time : float, s
    offset : float, s
        Stamps minus the time of the inertial sensors.

    Returns
    -------
    DataFrame or None
        By the time of the inertial sensors; None without fixes.
    """
    if not tables:
        return None
    joined = tables[0] if len(tables) == 1 else pd.concat(tables)
    out: pd.DataFrame = joined[joined.index - offset <= time]
    if offset:
        out = out.set_axis(out.index - offset)
    out.attrs = dict(tables[0].attrs)
    if out.empty:
        return None
    check_gnss(out)
    return out


def site_of_fixes(
    fixes: pd.DataFrame | None, begin: float, time: float, ellipsoid: Ellipsoid
) -> tuple[Site, Array]:
    """Return the position of a stationary body, by the median of its fixes.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    begin, time : float, s
        Of the rest. If it holds no fix, the newest one before is taken.

    Returns
    -------
    site : Site
    sd : ndarray, (3,), m
        The smallest stated by a fix: correlated errors do not average out.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    first = min(int(np.searchsorted(stamps, begin)), len(stamps) - 1)
    lat, lon, alt = np.median(place[first:], axis=0).tolist()
    return Site(lat, lon, alt, ellipsoid), np.asarray(sd[first:].min(axis=0))


def here_by_fix(
    fixes: pd.DataFrame | None,
    time: float,
    q_nb: Array,
    lever_arm: Array,
    ellipsoid: Ellipsoid,
    velocity: Array,
    velocity_covariance: Array,
) -> tuple[NavState, Array]:
    """Return the position of a vehicle, by its newest fix that agrees with those before.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    time : float, s
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Lever arm of the antenna, body axes.
    velocity : ndarray, (3,), m/s
        Velocity of the sensors at `time`, north, east, down.
    velocity_covariance : ndarray, (3, 3), (m/s)²

    Returns
    -------
    state : NavState
        With the given attitude, propagated from the fix by the velocity.
    covariance : ndarray, (6, 6)
        Displacement and velocity, north-east-down; the acceleration is unknown, 1 m/s². The effect
        of a wrong stamp of the fix is left to `errors_by_antenna`.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    assert fixes is not None
    k = _newest_that_agrees(fixes, place, sd, stamps, ellipsoid)
    after = time - float(stamps[k])
    off = velocity * after - rotation.rotate(q_nb, lever_arm)
    lat, lon, alt = geodetic_from_ned(off, place[k], ellipsoid=ellipsoid).tolist()
    state = NavState(time, np.radians(lat), np.radians(lon), alt, velocity, q_nb)
    P = np.zeros((6, 6))
    unknown = np.square(sd[k]) + (0.5 * MANOEUVRE * after**2) ** 2
    P[:3, :3] = np.diag(unknown) + velocity_covariance * after**2
    P[:3, 3:] = P[3:, :3] = velocity_covariance * after
    P[3:, 3:] = velocity_covariance
    return state, P


def way_by_velocities(
    fixes: pd.DataFrame, begin: float, time: float, velocity: Array
) -> tuple[Array, Array]:
    """Return the way of a receiver since an instant, by its velocities.

    Parameters
    ----------
    fixes : DataFrame
        Fixes until `time`; those before `begin` are of a part that was navigated before, at whose
        first one the way begins.
    begin, time : float, s
    velocity : ndarray, (3,), m/s
        At `time`, north, east, down.

    Returns
    -------
    way, variance : ndarray, (3,), m and m²
        North, east, down, by trapezoids. In each step the acceleration is unknown, 1 m/s²; a climb
        that no fix measures is 1 m/s for all of the way.
    """
    told = usable(fixes, VELOCITY_SD[:2])
    stamps, v = index_of(fixes)[told], values_of(fixes, VELOCITY_COLUMNS)[told]
    begin = min(begin, float(stamps[0])) if stamps.size else begin
    span = max(time - begin, 0.0)
    before = (stamps > begin) & (stamps < time)
    at = np.concatenate([[begin], stamps[before], [begin + span]])
    known, stamps = np.vstack([v, velocity]), np.append(stamps, begin + span)
    way = np.array([np.trapezoid(np.interp(at, stamps, one), at) for one in known.T])
    steps = np.diff(at)
    variance = np.full(3, np.square(0.5 * MANOEUVRE * steps**2).sum())
    sd = values_of(fixes, VELOCITY_SD)[told]
    measured = np.isfinite(sd)
    each = np.square(np.where(measured, sd, 0.0)).max(axis=0, initial=0.0)
    return way, variance + np.where(
        measured.all(axis=0), each * np.square(steps).sum(), (CLIMB * span) ** 2
    )


def motion_by_fixes(
    fixes: pd.DataFrame | None, begin: float, time: float, clear: float = CLEAR
) -> tuple[Array, Array] | None:
    """Return the velocity of a receiver that has moved since an instant, by its newest fixes.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    begin, time : float, s
    clear : float
        Standard deviations that prove motion; fewer where the sensors do not show a rest.

    Returns
    -------
    velocity, sd : ndarray, (3,), m/s
        At `time`, north, east, down: the newest velocity, or a difference of positions over the
        time with the least error. The acceleration since is unknown, 1 m/s². None where the fixes
        since `begin` are those of a receiver at rest.
    """
    found = _velocity_by_fixes(fixes, begin, time, clear)
    if found is None:
        return None
    velocity, sd, moves = found
    return (velocity, sd) if moves else None


def rest_by_fixes(fixes: pd.DataFrame | None, begin: float, time: float) -> Array:
    """Return how well the fixes since an instant show that a receiver does not move, (3,), m/s.

    Standard deviation of its velocity at `time`, north, east, down, where the sensors do not show a
    rest; at most that of a velocity of which nothing is known, and vertically of a moving body.
    """
    unknown = np.array([UNKNOWN_VELOCITY, UNKNOWN_VELOCITY, CLIMB])
    found = _velocity_by_fixes(fixes, begin, time, CLEAR)
    return unknown if found is None else np.minimum(found[1], unknown)


def _velocity_by_fixes(
    fixes: pd.DataFrame | None, begin: float, time: float, clear: float
) -> tuple[Array, Array, bool] | None:
    """Velocity and its standard deviation, as `motion_by_fixes`; and whether they prove a motion.

    None of fewer than two positions alone.
    """
    if fixes is None or begin >= time:
        return None
    part = fixes[fixes.index >= begin]
    v, v_sd = values_of(part, VELOCITY_COLUMNS), values_of(part, VELOCITY_SD)
    told = usable(part, VELOCITY_SD[:2])
    if told.any():
        rows = np.flatnonzero(told)[-NEWEST:]
        k = int(rows[-1])
        speed = float(np.median(np.hypot(v[rows, 0], v[rows, 1])))
        since = time - float(index_of(part)[k])
        measured = np.isfinite(v_sd[k])
        own = np.where(measured, v_sd[k], CLIMB)
        moves = speed > max(MOVES, clear * float(v_sd[k, :2].max()))
        return np.where(measured, v[k], 0.0), np.hypot(own, MANOEUVRE * since), moves
    sd, good = values_of(part, POSITION_SD), usable(part, POSITION_SD)
    if good.sum() < 2:
        return None
    place, sd, stamps = values_of(part, GEODETIC)[good], sd[good], index_of(part)[good]
    way = ned_from_geodetic(place, place[-1])
    far = np.hypot(way[:, 0], way[:, 1])
    span = np.maximum(stamps[-1] - stamps, INSTANT)
    blur = np.hypot(sd, sd[-1])
    moves = bool((far > np.maximum(clear * blur[:, :2].max(axis=1), MOVES * span)).any())
    # Half of the span before the newest fix, the velocity is that of the difference.
    whole = np.hypot(blur / span[:, None], MANOEUVRE * (0.5 * span + time - stamps[-1])[:, None])
    k = int(np.argmin(whole[:-1, :2].max(axis=1)))
    return -way[k] / span[k], whole[k], moves


def _newest_that_agrees(
    fixes: pd.DataFrame, place: Array, sd: Array, stamps: Array, ellipsoid: Ellipsoid
) -> int:
    """Newest position that agrees with the positions before it, propagated by velocities.

    Each velocity is the median of three; the expected position is the median of the predictions
    by the newest fixes.
    """
    rows = np.flatnonzero(stamps >= stamps[-1] - LOOKED_BACK)[-LOOKED_AT:]
    told = usable(fixes, VELOCITY_SD)
    if len(rows) < LEAST_LOOKED_AT or told.sum() < LEAST_LOOKED_AT:
        return len(stamps) - 1
    v, v_time = values_of(fixes, VELOCITY_COLUMNS)[told], index_of(fixes)[told]
    near = np.clip(np.arange(len(v))[:, None] + np.arange(-1, 2), 0, len(v) - 1)
    v = np.median(v[near], axis=1)
    v = np.column_stack([np.interp(stamps[rows], v_time, one) for one in v.T])
    way = running_integral(stamps[rows], v)
    at = np.array([ned_from_geodetic(one, place[-1], ellipsoid=ellipsoid) for one in place[rows]])
    off = at - way
    off -= np.median(off, axis=0)
    usual = np.maximum(sd[rows], MAD_TO_SD * np.median(np.abs(off), axis=0))
    good = (np.abs(off) <= CLEAR * usual).all(axis=1)
    return int(rows[np.flatnonzero(good)[-1]]) if good.any() else len(stamps) - 1


def _good(
    fixes: pd.DataFrame | None, columns: Sequence[str], time: float
) -> tuple[Array, Array, Array]:
    """Positions, standard deviations and stamps of the fixes that have them."""
    if fixes is not None:
        sd = values_of(fixes, columns)
        good = usable(fixes, columns)
        if good.any():
            return values_of(fixes, GEODETIC)[good], sd[good], index_of(fixes)[good]
    raise DataError(
        "navigation.no-position-for-alignment",
        file=None if fixes is None else source_of(fixes),
        quantity="site",
        time=time,
    )
