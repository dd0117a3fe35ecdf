"""Position references as text: known displacements between two rests.

::

    12.5 same place as 3.0
    end same place as start sd 0.01
    12.5 moved 0.30 0 0 m since 3.0

Both instants lie within rests. A displacement is along the axes of the run's local level:
forward along the run's north, right, and down.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.evaluation.reference_points import INSTANT, NUMBER, instant
from strapdown.sensors.rest import RestStretch
from strapdown.tables import ACCEL, QUATERNION
from strapdown.tables.checks import Array


@dataclass(frozen=True)
class PositionScore:
    """Comparison of a position dead-reckoned between stationary intervals with a reference.

    Attributes
    ----------
    algorithm : str
        Algorithm whose attitude rotated the specific force.
    against : str
        The reference as text.
    time, since : float, s
        The instants that are compared.
    legs : int
        Number of successive dead-reckoned legs between stationary intervals.
    seconds : float
        Total length of the legs, in s, with which the errors grow.
    moved_m, moved_corrected_m : tuple of float, m
        Displacement along the axes of the run's local level, without and with the velocity at
        the end of each leg corrected to zero.
    expected_m : tuple of float, m
    error_m, corrected_error_m : float, m
        Distance from the expected displacement.
    end_velocity_m_s : float, m/s
        Largest remaining velocity at the end of a leg, where it should be zero.
    sd_m, corrected_sd_m, end_velocity_sd_m_s : float
        From the stated errors of the sensors and of the start: root mean square of the length,
        first order.
    reference_sd_m : float or None
        Standard deviation of the reference.
    gravity_m_s2 : float
        Gravity subtracted along the vertical.
    """

    algorithm: str
    against: str
    time: float
    since: float
    legs: int
    seconds: float
    moved_m: tuple[float, float, float]
    moved_corrected_m: tuple[float, float, float]
    expected_m: tuple[float, float, float]
    error_m: float
    corrected_error_m: float
    end_velocity_m_s: float
    sd_m: float
    corrected_sd_m: float
    end_velocity_sd_m_s: float
    reference_sd_m: float | None
    gravity_m_s2: float


_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_SD = rf"(?:\s+sd\s+(?P<sd>{NUMBER})(?:\s*(?P<sd_unit>mm|cm|m))?)?"
_SAME = re.compile(
    rf"(?P<at>{INSTANT})\s+same\s+place\s+as\s+(?P<since>{INSTANT}){_SD}", re.IGNORECASE
)
_MOVED = re.compile(
    rf"(?P<at>{INSTANT})\s+moved\s+(?P<x>{NUMBER})\s+(?P<y>{NUMBER})\s+(?P<z>{NUMBER})\s*"
    rf"(?P<unit>mm|cm|m)\s+since\s+(?P<since>{INSTANT}){_SD}",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class PlaceReference:
    """A known displacement between two rests.

    Attributes
    ----------
    time, since : float, s
    moved : tuple of float, m
        Along the axes of the run's local level (north, east, down by its own heading).
    sd : float or None, m
        Its standard deviation, root mean square of the length.
    """

    time: float
    since: float
    moved: tuple[float, float, float]
    sd: float | None = None

    def __str__(self) -> str:
        at, since = (f"{t:.3f}".rstrip("0").rstrip(".") for t in (self.time, self.since))
        if not any(self.moved):
            return f"{at} s: same place as at {since} s"
        return f"{at} s: moved {' '.join(f'{m:g}' for m in self.moved)} m since {since} s"


def is_place(text: str) -> bool:
    """Return whether a sentence is a position reference, not an attitude reference."""
    return re.search(r"same[ -]place|\bmoved\b", text, re.IGNORECASE) is not None


def parse_place(text: str, start: float, end: float) -> PlaceReference:
    """Parse one position reference.

    Parameters
    ----------
    text : str
        As in the module's text; ``same-place-as``, commas, colons and equals signs are
        understood, too.
    start, end : float, s
        Times that these words mean, and the span in which instants must lie.

    Returns
    -------
    PlaceReference

    Raises
    ------
    ConfigError
        It is not understood.
    DataError
        An instant lies outside the log.
    """
    plain = re.sub(r"same-place-as", "same place as", text.partition("#")[0], flags=re.IGNORECASE)
    plain = re.sub(r"[:=,]", " ", plain).strip()
    match = _SAME.fullmatch(plain) or _MOVED.fullmatch(plain)
    if match is None:
        raise ConfigError("evaluation.not-understood", quantity="reference", text=text)
    said = match.groupdict()
    unit = _UNITS[(said.get("unit") or "m").lower()]
    x, y, z = (float(said.get(axis) or 0.0) * unit for axis in "xyz")
    sd = None
    if said["sd"] is not None:
        sd = float(said["sd"]) * _UNITS[(said["sd_unit"] or "m").lower()]
        if not sd > 0.0:
            raise ConfigError(
                "evaluation.standard-deviation-not-positive", quantity="reference", text=text
            )
    at, since = (instant(said[key], start, end, text) for key in ("at", "since"))
    if since >= at:
        raise ConfigError(
            "evaluation.compares-not-before", quantity="reference", text=text, at=at, since=since
        )
    return PlaceReference(at, since, (x, y, z), sd)


# Comparison of position references with the run dead-reckoned between rests.


# A time that is rounded to a tenth, or given at the edge of a window, still means the rest.
NEAR_REST = 0.5  # s


@dataclass(frozen=True)
class DeadReckoningErrors:
    """Assumed errors of the sensors and of the start, for the standard deviation of the position.

    Attributes
    ----------
    accel_bias_sd : float, m/s²
        Of each accelerometer, constant in the body (`rest_references.ACCEL_BIAS_SD`).
    gyro_bias_sd : float, rad/s
        Residual bias of each gyro, constant over the log.
    tilt_sd_deg : float, deg
        Of the initial attitude about each horizontal axis, in addition to the tilt by
        levelling with biased accelerometers.
    accel_noise : float or None, m/s²/√Hz
        White noise of each accelerometer; if None, from the scatter at the rests.
    levelled : bool
        The run was levelled with these accelerometers where it begins: their biases then tilt
        the start, so that they cancel as long as the body keeps that pose.
    """

    accel_bias_sd: float = 0.3
    gyro_bias_sd: float = 2e-4
    tilt_sd_deg: float = 0.0
    accel_noise: float | None = None
    levelled: bool = True


def score_places(
    run: AttitudeRun,
    places: Sequence[PlaceReference],
    imu: pd.DataFrame,
    rests: Sequence[RestStretch],
    *,
    errors: DeadReckoningErrors | None = None,
    gravity: float | None = None,
) -> tuple[PositionScore, ...]:
    """Compare the displacements of a run with known ones.

    Parameters
    ----------
    run : AttitudeRun
    places : sequence of PlaceReference
    imu : DataFrame
        The Imu table that the run used, with acceleration.
    rests : sequence of RestStretch
        In order of time; every instant of `places` lies in one, or at most half a second outside.
    errors : DeadReckoningErrors, optional
        For the standard deviation of the position; a consumer sensor if not given.
    gravity : float, m/s², optional
        As in `dead_reckon`.

    Returns
    -------
    tuple of PositionScore
        Rests between the two instants are used: the velocity begins anew at each.

    Raises
    ------
    DataError
        An instant is not at a rest, two are at the same one, or as `dead_reckon`.
    """
    assumed = errors or DeadReckoningErrors()
    return tuple(
        _score(run, place, imu, list(rests)[slice(*_between(place, rests))], assumed, gravity)
        for place in places
    )


def _between(place: PlaceReference, rests: Sequence[RestStretch]) -> tuple[int, int]:
    found = []
    for at in (place.since, place.time):
        near = [max(r.start - at, at - r.end, 0.0) for r in rests]
        if not near or min(near) > NEAR_REST:
            raise DataError(
                "evaluation.names-no-rest-rests",
                quantity="reference",
                place=place,
                at=at,
                known=[f"{r.start:.2f}-{r.end:.2f}" for r in rests] or ["none was found"],
            )
        found.append(int(np.argmin(near)))
    if found[0] == found[1]:
        rest = rests[found[0]]
        raise DataError(
            "evaluation.names-two-instants-rest",
            quantity="reference",
            place=place,
            start=rest.start,
            end=rest.end,
        )
    return found[0], found[1] + 1


def _score(
    run: AttitudeRun,
    place: PlaceReference,
    imu: pd.DataFrame,
    rests: list[RestStretch],
    errors: DeadReckoningErrors,
    gravity: float | None,
) -> PositionScore:
    legs = [
        dead_reckon(run, imu, a, b, gravity=gravity, levelled=errors.levelled)
        for a, b in pairwise(rests)
    ]
    moved = np.sum([leg.position[-1] for leg in legs], axis=0)
    corrected = np.sum([leg.position_corrected[-1] for leg in legs], axis=0)
    ends = [float(np.sqrt(np.square(leg.velocity[-1]).sum())) for leg in legs]
    worst = legs[int(np.argmax(ends))]
    noise = errors.accel_noise
    if noise is None:
        # From the quietest of the rests: sd times √(step).
        scatter = [float(np.mean(np.square(r.accel_sd))) for r in rests if r.accel_sd is not None]
        step = float(np.median(np.diff(imu.index.to_numpy(dtype=np.float64))))
        noise = float(np.sqrt(min(scatter, default=0.0) * step))
    expected = np.array(place.moved)
    raw = [(leg.position_by_bias, leg.position_by_tilt, leg.seconds**3 / 3.0) for leg in legs]
    mended = [
        (
            leg.position_by_bias - leg.velocity_by_bias * (0.5 * leg.seconds),
            leg.position_by_tilt - leg.velocity_by_tilt * (0.5 * leg.seconds),
            leg.seconds**3 / 12.0,
        )
        for leg in legs
    ]
    at_end = [(worst.velocity_by_bias, worst.velocity_by_tilt, worst.seconds)]
    return PositionScore(
        algorithm=run.algorithm,
        against=str(place),
        time=place.time,
        since=place.since,
        legs=len(legs),
        seconds=math.fsum(leg.seconds for leg in legs),
        moved_m=_triple(moved),
        moved_corrected_m=_triple(corrected),
        expected_m=place.moved,
        error_m=float(np.linalg.norm(moved - expected)),
        corrected_error_m=float(np.linalg.norm(corrected - expected)),
        end_velocity_m_s=max(ends),
        sd_m=_sd(raw, errors, noise),
        corrected_sd_m=_sd(mended, errors, noise),
        end_velocity_sd_m_s=_sd(at_end, errors, noise),
        reference_sd_m=place.sd,
        gravity_m_s2=legs[0].gravity,
    )


def _sd(
    parts: list[tuple[Array, Array, float]], errors: DeadReckoningErrors, noise: float
) -> float:
    """Root mean square length: biases and tilt are the same in all parts, noise is not."""
    by_bias = np.sum([p[0] for p in parts], axis=0)
    by_tilt = np.sum([p[1] for p in parts], axis=0)
    of_bias = np.repeat([errors.accel_bias_sd, errors.gyro_bias_sd], 3)
    variance = np.square(by_bias * of_bias).sum()
    variance += np.square(by_tilt * np.radians(errors.tilt_sd_deg)).sum()
    variance += 3.0 * noise**2 * math.fsum(p[2] for p in parts)
    return float(np.sqrt(variance))


def _triple(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


# Position between rests by dead reckoning, as a measure of attitude errors.
#
# Between two rests the specific force, rotated by the attitude of a run and freed of gravity, is
# integrated twice. At the second rest the velocity should be zero; the remaining velocity is an
# error known without a reference. A tilt error ``delta`` leaks ``g sin(delta)`` of gravity into the
# horizontal, so that the position error grows with the square of time, and with the cube for a gyro
# bias.


@dataclass(frozen=True)
class Leg:
    """Velocity and position from one rest to the next.

    Attributes
    ----------
    time : ndarray, (n,), s
        From the end of the first rest to the start of the second.
    velocity, position : ndarray, (n, 3), m/s and m
        From zero, along the axes of the run's local level.
    position_corrected : ndarray, (n, 3), m
        With a velocity subtracted that grows in proportion to time and makes the last one zero:
        exact for an error of acceleration that is constant in the local level.
    gravity : float, m/s²
    velocity_by_bias, position_by_bias : ndarray, (3, 6)
        Change at the end, for each unit of the biases of accelerometers (m/s²) and gyros
        (rad/s).
    velocity_by_tilt, position_by_tilt : ndarray, (3, 2)
        For each rad of an initial tilt about north and east.
    """

    time: Array
    velocity: Array
    position: Array
    position_corrected: Array
    gravity: float
    velocity_by_bias: Array
    position_by_bias: Array
    velocity_by_tilt: Array
    position_by_tilt: Array

    @property
    def seconds(self) -> float:
        """Length of the leg in s."""
        return float(self.time[-1] - self.time[0])


def dead_reckon(
    run: AttitudeRun,
    imu: pd.DataFrame,
    first: RestStretch,
    second: RestStretch,
    *,
    gravity: float | None = None,
    levelled: bool = True,
) -> Leg:
    """Dead-reckon velocity and position from one rest to the next.

    Parameters
    ----------
    run : AttitudeRun
    imu : DataFrame
        The Imu table that the run used, with acceleration.
    first, second : RestStretch
        One after the other.
    gravity : float, m/s², optional
        Subtracted along the vertical; the length of the mean specific force at the first rest
        if not given, which removes a part of the accelerometers' bias with it.
    levelled : bool
        The run was levelled with these accelerometers where it begins: their biases then tilt
        the start, so that they cancel as long as the body keeps that pose.

    Returns
    -------
    Leg
        Specific force at the stamp is interpolated linearly between two samples, after its
        rotation; a mean is rotated by the mean of the matrices at both ends of its interval.
        Both are accurate to the second order of the step.

    Raises
    ------
    DataError
        The table has no acceleration, the second rest does not follow the first, or the run
        does not cover them.
    """
    if not set(ACCEL) <= set(imu.columns):
        raise DataError(
            "evaluation.position-needs-acceleration-log-none",
            file=imu.attrs.get("source"),
            quantity="accel",
        )
    stamps = imu.index.to_numpy(dtype=np.float64)
    a, b = (int(np.searchsorted(stamps, t)) for t in (first.end, second.start))
    begin = float(run.attitude.index[0])
    if b <= a or first.end < begin or second.start > float(run.attitude.index[-1]):
        raise DataError(
            "evaluation.no-stretch-rest-ends-starts",
            file=imu.attrs.get("source"),
            quantity="rest",
            end=first.end,
            start=second.start,
            begin=begin,
        )
    time = stamps[a : b + 1]
    force = imu[ACCEL].to_numpy(dtype=np.float64)[a : b + 1]
    g = _gravity(first) if gravity is None else gravity
    turn = rotation.dcm_from_quaternion(attitude_at(run.attitude, time))
    steps = _Steps(time, turn, force, mean=imu.attrs["sampling"] == "mean")
    down = np.array([0.0, 0.0, 1.0])
    velocity, position = steps.twice(steps.force_n + g * down)
    by_error = _sensitivities(run, time, steps, g, gravity is None, levelled)
    share = ((time - time[0]) / (time[-1] - time[0]))[:, None]
    elapsed = (time - time[0])[:, None]
    return Leg(
        time,
        velocity,
        position,
        position - velocity[-1] * 0.5 * share * elapsed,
        g,
        *by_error,
    )


def _gravity(rest: RestStretch) -> float:
    if rest.accel_mean is None:
        return STANDARD_GRAVITY
    return float(np.sqrt(np.square(rest.accel_mean).sum()))


class _Steps:
    """The steps of a leg: quantities at both ends of each, and their integrals."""

    def __init__(self, time: Array, turn: Array, force: Array, *, mean: bool) -> None:
        self.dt = np.diff(time)[:, None]
        if mean:
            half = 0.5 * (turn[:-1] + turn[1:])
            self.turn = np.stack([half, half])
            through = np.einsum("kij,kj->ki", half, force[1:])
            self.force_n = np.stack([through, through])
        else:
            self.turn = np.stack([turn[:-1], turn[1:]])
            through = np.einsum("kij,kj->ki", turn, force)
            self.force_n = np.stack([through[:-1], through[1:]])

    def once(self, rate: Array) -> Array:
        """Trapezoidal integral from zero of the values at both ends of each step."""
        steps = 0.5 * (rate[0] + rate[1]) * self.dt
        return np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])

    def twice(self, rate: Array) -> tuple[Array, Array]:
        """Integral, and integral of the integral."""
        first = self.once(rate)
        steps = first[:-1] * self.dt + (2.0 * rate[0] + rate[1]) * self.dt**2 / 6.0
        return first, np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])


def _sensitivities(
    run: AttitudeRun, time: Array, steps: _Steps, g: float, gravity_of_rest: bool, levelled: bool
) -> tuple[Array, Array, Array, Array]:
    """Velocity and position at the end by the biases and by an initial tilt, to first order.

    With ``C_est = (1 + [psi x]) C`` the acceleration error is ``C b_a + psi x f_n``, where psi
    is the initial attitude error plus the integral of ``C b_g``.
    """
    n, seconds = len(time) - 1, float(time[-1] - time[0])
    by_psi = -rotation.cross_matrix(steps.force_n)  # (2, n, 3, 3): acceleration by psi
    velocity_psi, position_psi = (v[-1].reshape(3, 3) for v in steps.twice(by_psi.reshape(2, n, 9)))
    velocity_a, position_a = (v[-1].reshape(3, 3) for v in steps.twice(steps.turn.reshape(2, n, 9)))
    if levelled:
        start = rotation.dcm_from_quaternion(run.attitude[QUATERNION].to_numpy()[0])
        # psi x (0, 0, -g) cancels the horizontal part of C b_a.
        tilt = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) @ start / g
        velocity_a = velocity_a + velocity_psi @ tilt
        position_a = position_a + position_psi @ tilt
    if gravity_of_rest:
        lost = np.zeros((3, 3))
        lost[2] = steps.turn[0, 0][2]
        velocity_a = velocity_a - lost * seconds
        position_a = position_a - lost * (0.5 * seconds**2)
    psi_g = _turned(run.attitude, float(time[0])) + steps.once(steps.turn.reshape(2, n, 9)).reshape(
        -1, 3, 3
    )
    rate = np.stack([by_psi[0] @ psi_g[:-1], by_psi[1] @ psi_g[1:]]).reshape(2, n, 9)
    velocity_g, position_g = (v[-1].reshape(3, 3) for v in steps.twice(rate))
    return (
        np.hstack([velocity_a, velocity_g]),
        np.hstack([position_a, position_g]),
        velocity_psi[:, :2],
        position_psi[:, :2],
    )


def _turned(attitude: pd.DataFrame, until: float) -> Array:
    """Integral of ``C_nb`` from the start of a run: the attitude error per unit of gyro bias."""
    stamps = attitude.index.to_numpy(dtype=np.float64)
    inside = stamps < until
    time = np.append(stamps[inside], until)
    if len(time) < 2:
        return np.zeros((3, 3))
    q = np.vstack([attitude[QUATERNION].to_numpy()[inside], attitude_at(attitude, [until])])
    turn = rotation.dcm_from_quaternion(q)
    return np.asarray(np.trapezoid(turn, time, axis=0))
