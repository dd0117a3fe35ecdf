"""Stops and stretches of a calibration: rests, and the samples between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from strapdown.ellipsoids import WGS84
from strapdown.errors import DataError
from strapdown.sensors.rest import RestStretch, rest_between
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array, index_of, values_of

DEG = math.pi / 180.0
#: Ends of a turn without a rest: window, s.
HELD_WINDOW = 0.5
#: Least rotation between stops that counts as a turn, rad.
LEAST_TURN = 30.0 * DEG
#: Range of temperature that shows what a bias changes by with it, °C.
LEAST_RANGE = 5.0
#: Time between logs, over which the gyro bias drifts, s.
BETWEEN_LOGS = 600.0


@dataclass(frozen=True, eq=False)
class CalibrationRecord:
    """Samples of the sensor, and where it was at rest.

    Attributes
    ----------
    imu : DataFrame
        Imu table in the axes of the sensor, with specific force.
    rests : tuple of RestStretch
    temperature : (time, values) or None
        In s and °C.
    """

    imu: pd.DataFrame
    rests: tuple[RestStretch, ...]
    temperature: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class KnownRotation:
    """A rotation of known angle between two stops, or a stretch of known rate.

    Attributes
    ----------
    angle : float or None, rad
        Of the turn, several revolutions included; the gyro shows its sign.
    rate : float or None, rad/s
        Instead of the angle: of a rate table, with its sign.
    axis : int or None
        0 to 2; by the gyro if not stated.
    sd : float, rad or rad/s
        Of the angle between the stops, or of the rate of this stretch.
    log : int or None
    start, end : float or None, s
        A turn without them is the next that is found.
    """

    angle: float | None = None
    rate: float | None = None
    axis: int | None = None
    sd: float = 3.0 * DEG
    log: int | None = None
    start: float | None = None
    end: float | None = None


@dataclass(eq=False)
class Stop:
    """A rest, or the end of a turn that was held."""

    log: int
    rest: RestStretch
    wander: float
    #: Variances of the mean force along the vertical and twice across it, and of the mean rates,
    #: as if samples were independent; and by the means of three parts.
    white: Array
    by_parts: Array
    up: Array
    face: Array | None
    warmth: float
    held: bool

    @property
    def middle(self) -> float:
        """Middle of the stop, s."""
        return 0.5 * (self.rest.start + self.rest.end)


@dataclass(eq=False)
class Stretch:
    """Samples between two nodes, or of a known rate."""

    log: int
    first: int
    last: int
    time: Array
    gyro: Array
    accel: Array
    mean: bool
    known: KnownRotation | None = None
    #: Standard deviation of the vertical that is carried over it, and its part by products, rad.
    sd: float = 0.0
    second_order: float = 0.0

    @property
    def length(self) -> float:
        """From the first sample to the last, s."""
        return float(self.time[-1] - self.time[0])


def across_of(up: Array) -> Array:
    """Two unit vectors perpendicular to a direction, (3, 2); the same for nearly the same."""
    axis = np.eye(3)[int(np.argmin(np.abs(up)))]
    one = np.cross(up, axis)
    one /= np.linalg.norm(one)
    return np.column_stack([one, np.cross(up, one)])


def stop_of(log: int, record: CalibrationRecord, rest: RestStretch, held: bool = False) -> Stop:
    """Make a stop of a rest; `held`: the end of a turn, which may move."""
    if rest.accel_mean is None or rest.accel_mean_sd is None:
        raise DataError("calibrate.no-accelerometer", file=record.imu.attrs.get("source"))
    mean = np.array(rest.accel_mean)
    warmth = math.nan
    if record.temperature is not None:
        time, values = record.temperature
        warmth = float(np.interp(0.5 * (rest.start + rest.end), time, values))
    part = record.imu.loc[rest.start : rest.end]
    force, up = part[ACCEL].to_numpy(dtype=np.float64), mean / np.linalg.norm(mean)
    frame = np.column_stack([up, across_of(up)])
    values = np.hstack([force @ frame, values_of(part, GYRO)])
    wander = 0.0 if held else _wander(force, rest.end - rest.start, mean)
    return Stop(log, rest, wander, *_noise_of_mean(values), up, None, warmth, held)


def _noise_of_mean(values: Array) -> tuple[Array, Array]:
    """Variances of the mean of samples: for independent ones; and by three parts."""
    parts = np.array([part.mean(axis=0) for part in np.array_split(values, 3)])
    return values.var(axis=0) / len(values), parts.var(axis=0, ddof=1) / 3.0


def mean_variances(nodes: Sequence[Stop]) -> Array:
    """Variances of the means of each node, (n, 6), with the correlation of all rests together.

    Three parts of one rest say little of its noise, those of all rests enough: means of a bounded
    tremor are better than the samples suggest, those of a hand that wanders worse.
    """
    white = np.array([n.white for n in nodes]).reshape(-1, 6)
    quiet = [n for n in nodes if not n.held]
    ratio = np.ones(6)
    if quiet:
        found = np.array([n.by_parts / np.maximum(n.white, 1e-300) for n in quiet])
        # Axes across the vertical share theirs, and so do the gyros.
        sums = np.array([found[:, s].mean() for s in (slice(0, 1), slice(1, 3), slice(3, 6))])
        ratio = np.repeat((2.0 * len(quiet) * sums + 2.0) / (2.0 * len(quiet) + 2.0), (1, 2, 3))
    return white * ratio


def _wander(part: Array, length: float, mean: Array) -> float:
    """Half the mean square angle of the force within a rest: so much shorter is its mean."""
    count = max(1, part.shape[0] // max(1, round(length / 0.2)))
    blocks = part[: part.shape[0] // count * count].reshape(-1, count, 3)
    means = blocks.mean(axis=1)
    if means.shape[0] < 3:
        return 0.0
    # From block to block noise is independent, and a hand is not.
    noise = blocks.var(axis=1).mean(axis=0) / count
    up = mean / np.linalg.norm(mean)
    spread = np.maximum(means.var(axis=0) - noise, 0.0)
    across = float(spread.sum() - spread @ np.square(up))
    return 0.5 * across / float(mean @ mean)


def samples_between(
    record: CalibrationRecord,
    log: int,
    start: float,
    end: float,
    known: KnownRotation | None = None,
) -> Stretch:
    """Samples of a part of a log, both ends included."""
    part = record.imu.loc[start:end]
    if len(part) < 2:
        raise DataError("calibrate.empty-stretch", quantity="time", start=start, end=end)
    return Stretch(
        log,
        0,
        0,
        index_of(part),
        np.ascontiguousarray(values_of(part, GYRO)),
        np.ascontiguousarray(values_of(part, ACCEL)),
        record.imu.attrs.get("sampling") == "mean",
        known,
    )


def held_ends(
    records: Sequence[CalibrationRecord], nodes: Sequence[Stop], turns: Sequence[KnownRotation]
) -> list[Stop]:
    """Ends of turns without a rest: of logs without two, and of stated instants."""
    made: list[Stop] = []
    for log, record in enumerate(records):
        time = index_of(record.imu)
        instants = [
            (one.start, one.end)
            for one in turns
            if (one.log or 0) == log and one.start is not None and one.end is not None
        ]
        rests = [n.rest for n in nodes if n.log == log]
        if not rests and turns and not instants:
            instants = [(float(time[0]), float(time[-1]))]
        for start, end in instants:
            for a, b in ((start, start + HELD_WINDOW), (end - HELD_WINDOW, end)):
                if not any(r.start <= b and a <= r.end for r in rests):
                    rest = rest_between(record.imu, a, b, grade="held")
                    made.append(stop_of(log, record, rest, held=True))
    return made


def assign_turns(
    stretches: Sequence[Stretch], nodes: Sequence[Stop], turns: Sequence[KnownRotation]
) -> None:
    """Assign the known turns to the stretches with a rotation, in order."""
    bias = [np.array(n.rest.gyro_mean) for n in nodes if not n.held]
    mean = np.mean(bias, axis=0) if bias else np.zeros(3)
    paths = [np.asarray(np.trapezoid(s.gyro - mean, s.time, axis=0)) for s in stretches]
    free = [k for k, path in enumerate(paths) if np.linalg.norm(path) > LEAST_TURN]
    for turn in (t for t in turns if t.start is not None):
        inside = [
            k
            for k in free
            if stretches[k].log == (turn.log or 0)
            and stretches[k].time[0] < (turn.end or math.inf)
            and stretches[k].time[-1] > (turn.start or 0.0)
        ]
        if len(inside) != 1:
            where = {"start": turn.start, "end": turn.end}
            raise DataError(
                "calibrate.turn-not-found", quantity="turns", count=len(inside), **where
            )
        stretches[inside[0]].known = turn
        free.remove(inside[0])
    open_ = [t for t in turns if t.start is None]
    alike = [k for k in free if any(_fits(paths[k], t) for t in open_)]
    if len(open_) == 1:
        open_ = open_ * max(len(alike), 1)
    matched = len(alike) == len(open_) and all(
        _fits(paths[k], t) for k, t in zip(alike, open_, strict=True)
    )
    if not matched:
        angles = [math.degrees(float(np.linalg.norm(path))) for path in paths]
        raise DataError(
            "calibrate.turns-differ",
            quantity="turns",
            stated=len(open_),
            angles=[a for a in angles if a > math.degrees(LEAST_TURN)],
        )
    for k, turn in zip(alike, open_, strict=True):
        stretches[k].known = turn


def _fits(path: Array, turn: KnownRotation) -> bool:
    """Whether integrated rates are those of a turn, within a fifth."""
    size, known = float(np.linalg.norm(path)), turn.angle or 0.0
    axis = turn.axis is None or int(np.argmax(np.abs(path))) == turn.axis
    return axis and abs(size - known) < 0.2 * known + 5.0 * DEG


def angle_walk(nodes: Sequence[Stop], prior: ImuUncertainty) -> Array:
    """Angle random walk of each gyro, rad/√s: of the rests, or as stated."""
    stated = np.array(prior.gyro.axis("noise_density"))
    quiet = [n.white[3:] * (n.rest.end - n.rest.start) for n in nodes if not n.held]
    if quiet:
        return np.asarray(np.maximum(np.sqrt(np.median(quiet, axis=0)), 0.5 * stated))
    return np.where(stated > 0.0, stated, 0.01 * DEG)


def bias_walk(nodes: Sequence[Stop], variance: Array) -> Array:
    """Drift of each gyro from rest to rest beyond noise and g-sensitivity, rad/s/√s."""
    noise = variance[[not n.held for n in nodes]]
    quiet = [n for n in nodes if not n.held]
    if len(quiet) < 6:
        return np.zeros(3)
    mean = np.array([n.rest.gyro_mean for n in quiet])
    # Affine in the readings of the accelerometers, whatever their errors.
    columns = [np.ones(len(quiet)), *np.array([n.rest.accel_mean for n in quiet]).T]
    warmth = np.array([n.warmth for n in quiet])
    if np.isfinite(warmth).all() and np.ptp(warmth) > LEAST_RANGE:
        columns.append(warmth)
    design = np.column_stack(columns)
    solution = np.linalg.lstsq(design, mean, rcond=None)[0]
    left = mean - design @ solution
    pause = np.array(
        [b.middle - a.middle if a.log == b.log else BETWEEN_LOGS for a, b in pairwise(quiet)]
    )
    level = WGS84.rotation_rate**2
    excess = np.square(np.diff(left, axis=0)) - (noise[1:] + noise[:-1] + level)
    lost = (len(quiet) - 1) / max(len(quiet) - design.shape[1], 1)
    return np.asarray(np.sqrt(np.maximum(lost * excess.sum(axis=0) / pause.sum(), 0.0)))
