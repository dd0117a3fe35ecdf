"""Accuracy of an alignment by its duration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.fine import FineResult, alignment_of, settled_epoch
from strapdown.alignment.inertial_sums import sum_inertially
from strapdown.alignment.mean_errors import sensor_covariance, sensor_noise
from strapdown.alignment.stationary import home_of
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.error_filter import FilterState
from strapdown.increments import increments_from_imu
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import EULER, GYRO, QUATERNION, attitude_table, check_attitude, check_imu
from strapdown.tables.checks import Array, source_of, values_of

SD = [f"{angle}_sd" for angle in EULER]
ERROR = [f"{angle}_error" for angle in EULER]
READINESS = ["time", *EULER, *SD, *ERROR, "findings", "refused"]
#: Shorter stretches of a record are not tried.
SHORTEST = 5.0  # s


@dataclass(frozen=True, eq=False)
class Readiness:
    """Accuracy against alignment time.

    Attributes
    ----------
    table : DataFrame
        Index ``duration``, s. Columns: ``time``, s, of validity; ``roll pitch heading``, deg;
        ``*_sd``, deg, as stated; ``*_error``, deg, estimate − reference, NaN without one;
        ``findings``, their number; ``refused``, the `Finding` of a record without an attitude,
        whose numbers are NaN, else None.
    """

    table: pd.DataFrame

    def ready(self, heading_sd_deg: float) -> float:
        """Shortest duration from which on the stated heading is at least so accurate.

        Parameters
        ----------
        heading_sd_deg : float, deg

        Returns
        -------
        float, s
            Infinite where it never is.
        """
        good = (self.table["heading_sd"] <= heading_sd_deg).to_numpy()
        bad = np.flatnonzero(~good)
        first = int(bad[-1]) + 1 if bad.size else 0
        return float(self.table.index[first]) if first < len(good) else float("inf")


def durations_of(imu: pd.DataFrame, count: int = 10) -> Array:
    """Durations that a record allows, equally spaced in their logarithm.

    `count`: at least 2. Returns (count,), s: from 5 s, or a hundredth of the record if longer, to
    the whole record. ConfigError: fewer than two are requested. DataError: the record is shorter
    than 10 s.
    """
    if count < 2:
        raise ConfigError("alignment.too-few-durations", quantity="count", count=count)
    length = float(imu.index[-1] - imu.index[0])
    if not length >= 2.0 * SHORTEST:
        raise DataError(
            "alignment.record-too-short-for-readiness",
            file=source_of(imu),
            quantity="time",
            length=length,
            shortest=SHORTEST,
            shortest_2=2.0 * SHORTEST,
        )
    return np.asarray(np.geomspace(max(SHORTEST, length / 100.0), length, count))


def readiness(
    align: Callable[[pd.DataFrame], Alignment],
    imu: pd.DataFrame,
    durations: Sequence[float] | Array | None = None,
    reference: pd.DataFrame | None = None,
) -> Readiness:
    """Align over increasing durations from the start of a record.

    Parameters
    ----------
    align : callable
        Returns an alignment of an Imu table: coarse, fine, or both in sequence.
    imu : DataFrame
        Imu table.
    durations : sequence of float, s, optional
        Rising, within the record; ten of `durations_of` if not given.
    reference : DataFrame, optional
        Attitude table of the truth, or of a better instrument: the row nearest to the time of
        an alignment is compared.

    Returns
    -------
    Readiness
        A duration that is refused has a row with the reason.

    Raises
    ------
    ConfigError
        A duration is not within the record, or they do not rise.
    DataError
        As `tables.check_attitude` of the reference.
    """
    times = durations_of(imu) if durations is None else np.asarray(durations, dtype=np.float64)
    length = float(imu.index[-1] - imu.index[0])
    rising = times.ndim == 1 and times.size > 0 and bool((np.diff(times, prepend=0.0) > 0.0).all())
    if not rising or not times[-1] <= length * (1.0 + 1e-9):
        raise ConfigError(
            "alignment.durations-not-rising",
            quantity="durations",
            times=times.tolist(),
            length=length,
        )
    if reference is not None:
        check_attitude(reference)
    start = float(imu.index[0])
    ends = np.searchsorted(imu.index.to_numpy(), start + times * (1.0 + 1e-12), side="right")
    rows = [_row(align, imu.iloc[:end], reference) for end in ends]
    index = pd.Index(times, name="duration")
    return Readiness(pd.DataFrame(rows, index=index, columns=READINESS))


def _row(
    align: Callable[[pd.DataFrame], Alignment], piece: pd.DataFrame, reference: pd.DataFrame | None
) -> list[object]:
    nothing: list[object] = [np.nan] * 10
    try:
        found = align(piece)
    except DataError as error:
        return [*nothing, 0, error.finding]
    errors = np.full(3, np.nan)
    if reference is not None:
        row = int(np.argmin(np.abs(reference.index.to_numpy() - found.time)))
        true = rotation.euler_from_quaternion(reference[QUATERNION].to_numpy()[row])
        errors = rotation.within_half_turn(found.roll_pitch_heading - true)
    numbers = [found.time, *found.roll_pitch_heading, *found.sd_deg, *errors]
    return [*numbers, len(found.findings), None]


# Unobservable errors of a stationary body, and rotations of the body that make them observable.

# Duration of a turn by hand or by a vehicle, and step of the prediction.
TURN_TIME, STEP = 20.0, 0.1  # s
#: Possible rotations of the body: a rotation vector in its own axes, deg.
TURNS: dict[str, tuple[float, float, float]] = {
    "heading-90": (0.0, 0.0, 90.0),
    "heading-180": (0.0, 0.0, 180.0),
    "roll-90": (90.0, 0.0, 0.0),
    "pitch-90": (0.0, -90.0, 0.0),
}
STAY = "none"


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """Predicted accuracy after a rotation and a further rest.

    Attributes
    ----------
    name : str
        The rotation, of `TURNS`, or `STAY`.
    rest : float, s
        Duration of the rest afterwards.
    sd_deg : ndarray, (3,), deg
        Of the tilts about north and east and of the heading.
    gyro_bias_sd, accel_bias_sd : ndarray, (3,), rad/s and m/s²
    """

    name: str
    rest: float
    sd_deg: Array
    gyro_bias_sd: Array
    accel_bias_sd: Array


def manoeuvres_after(
    result: FineResult, site: Site, rest: float | None = None
) -> tuple[Manoeuvre, ...]:
    """Predict what a rotation of the body and a further rest make observable.

    The filter's covariance is propagated over the increments of error-free sensors, with the
    observations of the same rest; no other part of the result is used. Scale factors and
    misalignments are treated as constant parts of the biases; a rotation out of the level changes
    their effect, so that the prediction for such a rotation is the best case.

    Parameters
    ----------
    result : FineResult
    site : Site
    rest : float, s, optional
        After the turn; as long as the record was, if not given.

    Returns
    -------
    tuple of Manoeuvre
        The most accurate heading first; includes no rotation.
    """
    history = result.history
    length = float(history.index[-1] - history.index[0]) if rest is None else rest
    turns = {STAY: (0.0, 0.0, 0.0), **TURNS}
    found = [
        _forecast(result, site, name, np.radians(turn), length) for name, turn in turns.items()
    ]
    return tuple(sorted(found, key=lambda one: float(one.sd_deg[2])))


def _forecast(result: FineResult, site: Site, name: str, turn: Array, rest: float) -> Manoeuvre:
    filter_ = result.filter
    # A body at rest without errors: only the covariance is needed.
    home = home_of(site, result.state.time)
    used = filter_.mechanization
    here = used.nav_state(result.state.mechanization, result.state.time)
    begun = used.begin(replace(home, q_nb=here.q_nb))
    state = FilterState(
        home.time,
        begun,
        used.history_row(begun),
        np.zeros_like(result.state.sensors),
        result.state.covariance,
    )
    q_nb = np.asarray(here.q_nb)
    moving = max(1, round(TURN_TIME / STEP))
    steps = round(TURN_TIME)
    if np.any(turn):
        rows, q_nb = _turning(site, q_nb, turn, moving)
        each = len(rows) // steps
        for k in range(steps):
            part = rows[k * each : (k + 1) * each]
            time = state.time + STEP * np.arange(1.0, each + 1)
            state, _ = filter_.predict(state, np.asarray(time), part)
    home = replace(home, q_nb=q_nb)
    each = round(result.interval / STEP)
    rows = np.tile(_resting(site, q_nb), (each, 1))
    for _ in range(max(1, math.floor(rest / result.interval))):
        time = state.time + STEP * np.arange(1.0, each + 1)
        state, _ = settled_epoch(
            filter_, state, np.asarray(time), rows, home, result.standing, tuple(result.innovations)
        )
    after = alignment_of(filter_, state)
    assert after.gyro_bias_sd is not None and after.accel_bias_sd is not None
    return Manoeuvre(
        name,
        rest,
        np.degrees(np.sqrt(np.diagonal(after.covariance))),
        after.gyro_bias_sd,
        after.accel_bias_sd,
    )


def _resting(site: Site, q_nb: Array) -> Array:
    """Motion increments of one step of a stationary body, (10,)."""
    C = rotation.dcm_from_quaternion(q_nb)
    rate, force = C.T @ site.earth_rate, -(C.T @ site.gravity)
    return np.concatenate([[STEP], rate * STEP, force * STEP, 0.5 * force * STEP**2])


def _turning(site: Site, q_nb: Array, turn: Array, steps: int) -> tuple[Array, Array]:
    """Motion increments of a turn at constant rate about an axis of the body, and its end."""
    rows = np.empty((steps, 10))
    step = rotation.quaternion_from_rotation_vector(turn / steps)
    half = rotation.quaternion_from_rotation_vector(0.5 * turn / steps)
    for i in range(steps):
        # Force is constant in level axes: over the step it is rotated halfway.
        rows[i] = _resting(site, rotation.compose(q_nb, half))
        rows[i, 4:10] = rotation.rotate(half, rows[i, 4:10].reshape(2, 3)).ravel()
        rows[i, 1:4] += turn / steps
        q_nb = rotation.compose(q_nb, step)
    return rows, q_nb


# Propagation of an alignment to another instant, or over its whole record, by the gyros.


def carry(
    imu: pd.DataFrame,
    alignment: Alignment,
    to: float,
    site: Site,
    sensors: ImuUncertainty | None = None,
) -> Alignment:
    """Propagate an attitude forward or backward in time.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force that holds both instants; the samples nearest to them
        count.
    alignment : Alignment
        Its gyro bias, if any, is subtracted.
    to : float, s
    site : Site
        The local level rotates with the Earth; motion at 10 m/s rotates it by another
        0.3 deg/h, which is neglected.
    sensors : ImuUncertainty, optional
        Gyro errors to be added to the covariance; none if not given. They are taken as
        independent of the covariance so far: of `InertialFrame`, which has used the same gyros,
        request the attitude at the start or the end directly.

    Returns
    -------
    Alignment
        At the sample nearest to `to`, of the same method and findings.

    Raises
    ------
    DataError
        As `tables.check_imu`; one of the instants is not in the record.
    """
    check_imu(imu)
    stamps = imu.index.to_numpy(dtype=np.float64)
    here, there = (_sample(stamps, t, imu) for t in (alignment.time, to))
    if here == there:
        return alignment
    first, last = min(here, there), max(here, there)
    piece = _without_gyro_bias(imu.iloc[first : last + 1], alignment)
    sums = sum_inertially(piece)
    forward = there > here
    level = rotation.dcm_from_rotation_vector(
        site.earth_rate * (-sums.length if forward else sums.length)
    )
    turned = rotation.dcm_from_quaternion(sums.turned[-1])
    C_here = rotation.dcm_from_quaternion(alignment.q_nb)
    C_there = level @ C_here @ (turned if forward else turned.T)
    covariance = level @ alignment.covariance @ level.T
    if sensors is not None:
        # Angle errors are in the axes at the first sample of the segment.
        axes = level @ C_here if forward else C_there
        turn = np.tile(axes, (len(sums.node_length), 1, 1))
        none = np.zeros_like(turn)
        covariance = covariance + sensor_covariance(sums, turn, none, sensors)
        covariance = covariance + sensor_noise(sums, turn, none, sensors)
    return replace(
        alignment,
        time=float(stamps[there]),
        q_nb=rotation.quaternion_from_dcm(C_there),
        covariance=np.asarray(covariance),
    )


def carried_attitude(alignment: Alignment, imu: pd.DataFrame, site: Site) -> pd.DataFrame:
    """Propagate an attitude over its own record.

    `alignment`: at an instant of the record; its gyro bias, if any, is subtracted. `imu`: Imu table
    of a body that stays at its position. The result is an Attitude table:
    ``q_nb(t) = q_n(t)n(T) q_nb(T) q_b(T)b(t)``, the body's rotation in inertial space by the gyros
    and that of the level by the Earth's rate. One sample of a mean rate has no step before it and
    takes the start of the first whole interval. DataError: the instant of the alignment is not in
    the record.
    """
    from strapdown.attitude_algorithms.algorithm import run_attitude
    from strapdown.attitude_algorithms.quaternion import Quaternion

    clean = _without_gyro_bias(imu, alignment)
    run = run_attitude(Quaternion(), increments_from_imu(clean)).attitude
    time = run.index.to_numpy(dtype=np.float64)
    turned = values_of(run, QUATERNION)
    at = int(np.argmin(np.abs(time - alignment.time)))
    back = rotation.conjugate(turned[at])
    level = rotation.quaternion_from_rotation_vector(
        np.outer(time - alignment.time, -site.earth_rate)
    )
    here = rotation.compose(alignment.q_nb, back)
    q_nb = rotation.compose(level, rotation.compose(here, turned))
    return attitude_table(time, q_nb, source=source_of(imu))


def _without_gyro_bias(imu: pd.DataFrame, alignment: Alignment) -> pd.DataFrame:
    if alignment.gyro_bias is None:
        return imu
    clean = imu.copy()
    clean[GYRO] = values_of(imu, GYRO) - alignment.gyro_bias
    clean.attrs = dict(imu.attrs)
    return clean


def _sample(stamps: Array, time: float, imu: pd.DataFrame) -> int:
    slack = 0.5 * float(np.median(np.diff(stamps))) * (1.0 + 1e-6)
    if not stamps[0] - slack <= time <= stamps[-1] + slack:
        raise DataError(
            "alignment.instant-outside-record",
            file=source_of(imu),
            quantity="time",
            time=time,
            stamps=stamps[0],
            stamps_2=stamps[-1],
        )
    return int(np.argmin(np.abs(stamps - time)))
