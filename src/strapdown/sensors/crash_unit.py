"""Crash recorder: triads, mounting, clock and trigger, and assumptions for missing axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.sensors.triad_errors import FARTHEST, ZERO, Triad, check_sd, finite, span, triple
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO, check_table_sampling, find_gaps
from strapdown.tables.checks import Array, check_rows, check_time, index_of


@dataclass(frozen=True)
class Mounting:
    """Position and orientation of a unit on the vehicle.

    Attributes
    ----------
    position : triad, m
        Position of the sensors in vehicle axes (forward, right, down), from the vehicle's origin:
        any point shared by all positions of a case.
    angles_deg : triad, deg
        Roll, pitch, heading (3-2-1) that rotate vehicle axes into sensor axes.
    position_sd : float, m
        Standard deviation of each coordinate.
    angles_sd_deg : float, deg
        Standard deviation of a small rotation about each vehicle axis.

    Raises
    ------
    ConfigError
        A value is not a number, a standard deviation is negative, or the position is farther from
        the origin than the length of any vehicle.
    """

    position: Triad = ZERO
    angles_deg: Triad = ZERO
    position_sd: float = 0.0
    angles_sd_deg: float = 0.0

    def __post_init__(self) -> None:
        for name, code in (
            ("position", "sensors.position-not-three-numbers"),
            ("angles_deg", "sensors.angles-not-three-numbers"),
        ):
            object.__setattr__(self, name, triple(getattr(self, name), name, code))
        if math.hypot(*self.position) > FARTHEST:
            raise ConfigError(
                "sensors.vehicle-origin",
                quantity="position",
                position=self.position,
                hypot=math.hypot(*self.position),
            )
        check_sd(self.position_sd, "position_sd", "m")
        check_sd(self.angles_sd_deg, "angles_sd_deg", "deg")

    @property
    def C_vs(self) -> Array:  # noqa: N802
        """Rotation from sensor into vehicle axes, (3, 3)."""
        return rotation.dcm_from_quaternion(rotation.quaternion_from_euler(self.angles_deg))


@dataclass(frozen=True, eq=False)
class RecordedTriad:
    """One recorded triad of a unit.

    Attributes
    ----------
    table : DataFrame
        Index ``time``, s, on the unit's clock; columns ``accel_x accel_y accel_z``, m/s², or
        ``gyro_x gyro_y gyro_z``, rad/s, in sensor axes; ``attrs["sampling"]`` as of an Imu table.
    uncertainty : TriadUncertainty
    name : str
        Name of the part, for messages.
    held : ndarray of bool, (n, 3), optional
        For a resampled table, whether a recorded sample at the end of the range contributes to a
        row, even if the resampled values are well within the range. None for a table as recorded.
    absent : tuple of int
        Axes (0, 1, 2) that were not recorded; their columns hold assumed values
        (`unmeasured.with_filled_axes`).

    Raises
    ------
    ConfigError
        Table or uncertainty is of another kind, or `held` does not match its rows.
    """

    table: pd.DataFrame
    uncertainty: TriadUncertainty
    name: str
    held: NDArray[np.bool_] | None = None
    absent: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.table, pd.DataFrame):
            raise _wrong_type("table", self.table, self.name)
        if not isinstance(self.uncertainty, TriadUncertainty):
            raise _wrong_type("uncertainty", self.uncertainty, self.name)
        if self.held is not None and np.shape(self.held) != (len(self.table), 3):
            raise ConfigError(
                "sensors.shape-table-rows",
                file=self.name,
                quantity="held",
                shape=np.shape(self.held),
                count=len(self.table),
            )


@dataclass(frozen=True, eq=False)
class CrashUnit:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
    accelerometers : tuple of RecordedTriad
        One or more, in order of increasing range.
    gyro : RecordedTriad, optional
    mounting : Mounting
    gyro_from : str, optional
        Unit whose gyro is borrowed, for a unit without one: all points of a rigid vehicle have the
        same angular rate.
    trigger : float, s, optional
        Instant of the common trigger on this unit's clock.
    trigger_sd : float, s
        Standard deviation of that instant.
    lender : CrashUnit, optional
        The unit named in `gyro_from`, once its gyro is in `gyro`, rotated into these sensor axes.
    assumed : Assumed, optional
        Assumption for axes without a column in the tables, and for the rotation of a unit without
        own or borrowed gyro.

    Raises
    ------
    ConfigError
        A part is of another kind, or the trigger is not a number.
    """

    name: str
    accelerometers: tuple[RecordedTriad, ...]
    gyro: RecordedTriad | None = None
    mounting: Mounting = Mounting()
    gyro_from: str | None = None
    trigger: float | None = None
    trigger_sd: float = 0.0
    lender: CrashUnit | None = None
    assumed: Assumed | None = None

    def __post_init__(self) -> None:
        given: object = self.accelerometers
        if not isinstance(given, tuple | list) or not all(
            isinstance(t, RecordedTriad) for t in given
        ):
            raise _wrong_type("accelerometers", given, self.name)
        object.__setattr__(self, "accelerometers", tuple(given))
        for name, kind in (
            ("gyro", RecordedTriad | None),
            ("assumed", Assumed | None),
            ("mounting", Mounting),
            ("trigger", Real | None),
        ):
            if not isinstance(getattr(self, name), kind):
                raise _wrong_type(name, getattr(self, name), self.name)

    @property
    def from_zero(self) -> bool:
        """Whether it recorded changes of velocity from time zero (49 CFR 563.8), and none before.

        By ``attrs["from_zero"]`` of all its accelerometers.
        """
        tables = [t.table for t in self.accelerometers]
        return bool(tables) and all(t.attrs.get("from_zero", False) for t in tables)


def _wrong_type(quantity: str, given: object, unit: object) -> ConfigError:
    return ConfigError(
        f"sensors.{quantity}-of-wrong-type",
        file=str(unit),
        quantity=quantity,
        type=type(given).__name__,
    )


# Requirements that a crash unit must meet before processing.

# Stamps that agree to within this fraction of a step are equal.
SAME_STAMP = 1e-3


@dataclass(frozen=True, eq=False)
class UnitArrays:
    """Arrays of a unit whose triads share their stamps.

    `time` ((n,), s). `accelerometers` ((n, 3), m/s²). `gyro` ((n, 3), rad/s).
    """

    time: Array
    accelerometers: tuple[Array, ...]
    gyro: Array
    sampling: str
    findings: tuple[Finding, ...]


def check_unit(unit: CrashUnit) -> UnitArrays:
    """Check a unit and extract its arrays.

    `unit`: on the common clock, all triads at the same stamps. DataError: accelerometer, gyro or an
    axis is missing, a value is not finite, time does not increase, or the triads' stamps or kinds
    of sampling differ.
    """
    if not unit.accelerometers:
        raise DataError("sensors.no-accelerometer", file=unit.name, quantity="accelerometers")
    if unit.gyro is None:
        raise DataError("sensors.no-gyro-path-needs-turning", file=unit.name, quantity="gyro")
    forces = tuple(_values(unit, triad, ACCEL) for triad in unit.accelerometers)
    rates = _values(unit, unit.gyro, GYRO)
    time = index_of(unit.accelerometers[0].table)
    samplings = set()
    for triad in (*unit.accelerometers, unit.gyro):
        _same_stamps(unit, triad, time)
        samplings.add(str(triad.table.attrs["sampling"]))
    if len(samplings) > 1:
        raise DataError(
            "sensors.some-triads-instantaneous-values-some", file=unit.name, quantity="sampling"
        )
    gaps = tuple(
        Finding(
            "sensors.gap-after-trigger" if gap.end > 0.0 else "sensors.gap-before-trigger",
            file=unit.name,
            row=gap.sample + 1,
            quantity="time",
            length=1000.0 * gap.length,
            start=gap.start,
            usual=1000.0 * gap.usual,
        )
        for gap in find_gaps(time)
    )
    return UnitArrays(time, forces, rates, samplings.pop(), gaps)


def _values(unit: CrashUnit, triad: RecordedTriad, columns: list[str]) -> Array:
    source = f"{unit.name}, {triad.name}"
    missing = [c for c in columns if c not in triad.table.columns]
    if missing:
        raise DataError(
            "sensors.accelerometer-axes-missing"
            if columns == ACCEL
            else "sensors.gyro-axes-missing",
            file=source,
            quantity=missing[0],
            missing=missing,
        )
    check_table_sampling(triad.table, source)
    if len(triad.table) < 2:
        raise DataError(
            "sensors.too-few-samples-of-unit", file=source, quantity="time", count=len(triad.table)
        )
    check_time(index_of(triad.table), source)
    values = np.ascontiguousarray(triad.table[columns].to_numpy(dtype=np.float64))
    check_rows(values, columns, source)
    return values


def _same_stamps(unit: CrashUnit, triad: RecordedTriad, time: Array) -> None:
    own = index_of(triad.table)
    slack = SAME_STAMP * float(np.median(np.diff(time)))
    if own.size == time.size and float(np.abs(own - time).max()) <= slack:
        return
    raise DataError(
        "sensors.triad-stamps-differ",
        file=f"{unit.name}, {triad.name}",
        quantity="time",
        size=own.size,
        own=own[0],
        own_2=own[-1],
        size_2=time.size,
        time=time[0],
        time_2=time[-1],
        name=unit.accelerometers[0].name,
    )


# Assumed motion of a vehicle on unmeasured axes, and its uncertainty.

#: Names of the time profiles, for the names of unknowns: in the order of `assumed_shapes`, and of
#: `turning_shapes`.
SHAPES = ("by the end", "on the way")
TURN_SHAPES = ("with the force", "on the way")
# Standard deviation at the midpoint of a random walk with known end, relative to that of its end.
ON_THE_WAY = 0.5
# Tires push as well, all the time: by their largest coefficient of friction, of dry asphalt.
TIRES = 0.8 * STANDARD_GRAVITY  # m/s²
# Beyond this angle "not rotating" is a poor assumption, and linear bounds are invalid.
MOST_TURN = 45.0  # deg
# Velocity changes of road vehicles in crashes are smaller.
MOST_CHANGE = 60.0  # m/s
# Longer intervals are not plausible for an impact.
LONGEST = 10.0  # s


@dataclass(frozen=True)
class Assumed:
    """Assumed motion on the axes that a unit does not measure.

    Attributes
    ----------
    turn_sd_deg : float or triad, deg, optional
        Without a gyro the vehicle is assumed not to rotate. Standard deviation of the change of
        each of roll, pitch and heading at the end of `over`. None: a missing gyro is an error.
    delta_v_sd : float or triad, m/s, optional
        Along an axis without an accelerometer, the specific force at the reconstructed point is
        assumed to be gravity alone, in the attitude of the vehicle at rest. Standard deviation of
        the velocity change along that axis over `over`; three numbers are for the vehicle's
        forward, right, down. None: a missing axis is an error.
    over : (float, float), s
        Interval of these changes, from the trigger. Motion before and after it is not covered by
        any bound.
    because : str
        User's reason for the assumption, for the report.

    Raises
    ------
    ConfigError
        Neither standard deviation is given, a number is negative or not finite, a rotation exceeds
        45 deg or a velocity change 60 m/s, or `over` is not an interval of up to 10 s.

    Notes
    -----
    The velocity change along an axis over time is the sum of two independent unknowns. One grows as
    ``u - sin(2 pi u) / (2 pi)``, the integral of a haversine, with u from 0 to 1 over `over`, and
    has the stated standard deviation at the end. Alone it would fix the midpoint at exactly half
    the change. The other therefore rises and returns as ``sin²(pi u)``, with half the standard
    deviation at the midpoint: the remaining uncertainty of a random walk at its midpoint when its
    end is known. The total standard deviation at the midpoint is then 0.71 of that at the end, as
    for a random walk.

    The rate of a rotation follows the force, which makes it by an arm: it grows with the impulse up
    to then, as a share of that by the end of `over` (`turning_shapes`), and stays. The line of the
    force moves over the vehicle while it folds: half of the variance is that of a random walk over
    the impulse, whose part beside its end is the second unknown of a rotation. After `over` the
    rate falls to zero within half of that time.
    """

    turn_sd_deg: float | Triad | None = None
    delta_v_sd: float | Triad | None = None
    over: tuple[float, float] = (0.0, 0.15)
    because: str = ""

    def __post_init__(self) -> None:
        if self.turn_sd_deg is None and self.delta_v_sd is None:
            raise ConfigError("sensors.nothing-assumed", quantity="assumed")
        turns, axes = ("roll", "pitch", "heading"), ("forward", "right", "down")
        for name, said in (
            ("turn_sd_deg", {"unit": "deg", "axes": turns, "most": MOST_TURN}),
            ("delta_v_sd", {"unit": "m/s", "axes": axes, "most": MOST_CHANGE}),
        ):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _sds(given, name, said))
        over = span(self.over)
        if over is None or over[1] - over[0] > LONGEST:
            raise ConfigError(
                "sensors.no-stretch", quantity="assumed, over", given=self.over, longest=LONGEST
            )
        object.__setattr__(self, "over", over)
        if not isinstance(self.because, str):
            raise ConfigError(
                "sensors.reason-not-text",
                quantity="assumed, because",
                name=type(self.because).__name__,
            )

    def sd_of(self, name: str) -> Triad:
        """Return ``turn_sd_deg`` or ``delta_v_sd`` as three numbers; zeros where it is None."""
        value: Triad | None = getattr(self, name)
        return ZERO if value is None else value


def assumed_shapes(time: Array, over: tuple[float, float], sampling: str) -> Array:
    """Rates of the two profiles at the samples, for a standard deviation of one at the end.

    `time` ((n,), s). `over` ((float, float), s). `sampling` ({'instantaneous', 'mean'}). Returns
    (2, n), 1/s: means over the interval that ends at the stamp, or about it, so that their sum
    times the step is exact even with few samples in `over`.
    """
    begin, end = _intervals(time, sampling)
    return np.asarray((_grown(end, over) - _grown(begin, over)) / (end - begin))


def turning_shapes(time: Array, over: tuple[float, float], sampling: str, pushed: Array) -> Array:
    """Rates of the two profiles of a turn, (2, n), 1/s, for a standard deviation of one at its end.

    `pushed`, (n,), m/s²: size of the acceleration of the vehicle about each sample; the rest as
    `assumed_shapes`. Where the record does not cover `over`, the tires alone push.
    """
    begin, end = _intervals(time, sampling)
    edges = np.concatenate([[min(begin[0], over[0])], begin, end[-1:], [max(end[-1], over[1])]])
    within = np.diff(np.clip(edges, *over))
    push = (np.concatenate([[0.0], pushed, [0.0]]) + TIRES) * within
    share = np.concatenate([[0.0], np.cumsum(push)]) / push.sum()
    rates = np.array([share, math.sqrt(0.5) * ON_THE_WAY * np.sin(np.pi * share)])
    turned = 0.5 * (rates[:, 1:] + rates[:, :-1]) * within
    whole = np.linalg.norm(turned.sum(axis=1))
    after = np.clip((edges - over[1]) / (over[1] - over[0]), 0.0, 0.5)
    falling = (over[1] - over[0]) * 0.5 * (after + np.sin(2.0 * np.pi * after) / (2.0 * np.pi))
    turned[0] += np.diff(falling)
    return np.asarray(turned[:, 1:-1] / whole / (end - begin))


def _intervals(time: Array, sampling: str) -> tuple[Array, Array]:
    """Begin and end of the interval that each sample represents, (n,) each, without gaps."""
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    if sampling == "mean":
        return time - steps, time
    return time - 0.5 * steps, time + 0.5 * np.append(steps[1:], steps[-1])


def _grown(time: Array, over: tuple[float, float]) -> Array:
    """Values of both profiles, (2, n)."""
    u = np.clip((time - over[0]) / (over[1] - over[0]), 0.0, 1.0)
    whole = u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi)
    return np.array([whole, ON_THE_WAY * np.sin(np.pi * u) ** 2])


def _sds(given: object, name: str, limits: dict[str, Any]) -> Triad:
    if finite(given):
        given = (given, given, given)
    quantity = f"assumed, {name}"
    numbers = triple(given, quantity, "sensors.assumed-not-three-numbers", **limits)
    if any(x < 0.0 or x > limits["most"] for x in numbers):
        raise ConfigError(
            "sensors.assumed-out-of-range", quantity=quantity, given=repr(given), **limits
        )
    return numbers


# --- unmeasured axes, completed by stated assumptions -----------------------------------

AXES = ("forward", "right", "down")
TURNS = ("roll", "pitch", "heading")
ALL = (0, 1, 2)
NO_GYRO = "no gyro"
# Smallest squared cosine with which a missing axis makes a vehicle axis an assumed one.
PART = 0.1


def with_filled_axes(unit: CrashUnit) -> CrashUnit:
    """Fill missing axes with zeros where an assumption is given for them.

    Its triads list those axes in `absent`, with zero stated errors. The gravity component is added
    where the attitude at rest is known (`prepare_unit`). A unit without missing axes, or without
    `assumed`, is returned unchanged. DataError: its ranges miss different axes, or an accelerometer
    has no axis.
    """
    if unit.assumed is None:
        return unit
    gyro = unit.gyro
    forces = unit.accelerometers
    if unit.assumed.delta_v_sd is not None:
        missing = {t.name: _missing(t, ACCEL) for t in forces}
        if len(set(missing.values())) > 1:
            name = next(n for n, m in missing.items() if m)
            raise DataError(
                "sensors.no-another-range-unit",
                file=f"{unit.name}, {name}",
                quantity=ACCEL[missing[name][0]],
                accel=ACCEL[missing[name][0]],
            )
        forces = tuple(_filled(t, ACCEL) for t in forces)
    if gyro is not None and unit.assumed.turn_sd_deg is not None:
        gyro = _filled(gyro, GYRO)
    return replace(unit, accelerometers=forces, gyro=gyro)


def with_gyro(unit: CrashUnit) -> CrashUnit:
    """Add a gyro with zero rate to a unit without one, if `assumed` allows for it."""
    if unit.gyro is not None or unit.gyro_from is not None or not unit.accelerometers:
        return unit
    if unit.assumed is None or unit.assumed.turn_sd_deg is None:
        return unit
    like = unit.accelerometers[0].table
    still = pd.DataFrame(np.zeros((len(like), 3)), index=like.index, columns=GYRO)
    still.attrs = dict(like.attrs)
    return replace(unit, gyro=RecordedTriad(still, TriadUncertainty(), NO_GYRO, absent=ALL))


def unmeasured_axes(unit: CrashUnit) -> Array:
    """Projection onto directions that no accelerometer measures, vehicle axes, (3, 3)."""
    absent = unit.accelerometers[0].absent if unit.accelerometers else ()
    return _projection(unit.mounting.C_vs, absent)


def unmeasured_turns(unit: CrashUnit) -> Array:
    """Projection onto the directions no gyro, own or borrowed, measures, (3, 3)."""
    lender = unit.lender or unit
    absent = () if lender.gyro is None else lender.gyro.absent
    return _projection(lender.mounting.C_vs, absent)


def axis_names(axes: Array, turns: Array) -> tuple[str, ...]:
    """Names of the assumed vehicle axes: forward right down, roll pitch heading."""
    return tuple(
        name
        for names, projection in ((AXES, axes), (TURNS, turns))
        for name, part in zip(names, np.diagonal(projection), strict=True)
        if part > PART
    )


def assumed_findings(unit: CrashUnit) -> list[Finding]:
    """Report the assumptions made for a unit."""
    found = []
    assumed = unit.assumed
    if assumed is None:
        return []
    because = (
        [Finding("sensors.assumed-because", severity="note", because=assumed.because)]
        if assumed.because
        else []
    )
    own = () if unit.gyro is None or unit.lender is not None else unit.gyro.absent
    for absent, columns, directions, names, name in (
        (own, GYRO, unmeasured_turns(unit), TURNS, "turn_sd_deg"),
        (unit.accelerometers[0].absent, ACCEL, unmeasured_axes(unit), AXES, "delta_v_sd"),
    ):
        if not absent:
            continue
        kept = [n for n, p in zip(names, np.diagonal(directions), strict=True) if p > PART]
        sds = [assumed.sd_of(name)[names.index(n)] for n in kept]
        missing = [columns[k] for k in absent]
        if columns is ACCEL:
            code, quantity = "sensors.velocity-change-assumed", missing[0]
        else:
            code = "sensors.roll-assumed" if "roll" in kept else "sensors.turning-assumed"
            quantity, missing = "gyro", ["gyro"] if len(absent) == 3 else missing
        found.append(
            Finding(
                code,
                severity="note",
                file=unit.name,
                quantity=quantity,
                missing=missing,
                # One number for all, where they are equal.
                sd=sds[:1] if len(set(sds)) == 1 else sds,
                axes=kept,
                begin=assumed.over[0],
                end=assumed.over[1],
                because=because,
            )
        )
    return found


def with_common_assumptions(units: Sequence[CrashUnit]) -> list[CrashUnit]:
    """State the same of the vehicle in all its units: the largest of what they assume of an axis.

    Its turning, and the change of velocity of its point along an axis, are one unknown in however
    many units they are stated. Of units prepared by `with_filled_axes` and `with_gyro`, as far as
    each lacks the axis.
    """
    turns, axes = np.zeros(3), np.zeros(3)
    for unit in units:
        if unit.assumed is not None:
            lacks_turn = np.diagonal(unmeasured_turns(unit)) > PART
            if unit.lender is None:
                turns = np.maximum(turns, lacks_turn * unit.assumed.sd_of("turn_sd_deg"))
            lacks_axis = np.diagonal(unmeasured_axes(unit)) > PART
            axes = np.maximum(axes, lacks_axis * unit.assumed.sd_of("delta_v_sd"))
    return [_with_at_least(unit, turns, axes) for unit in units]


def _with_at_least(unit: CrashUnit, turns: Array, axes: Array) -> CrashUnit:
    lender = None if unit.lender is None else _with_at_least(unit.lender, turns, axes)
    if lender is not unit.lender:
        unit = replace(unit, lender=lender)
    assumed = unit.assumed
    if assumed is None:
        return unit
    for name, least, lacks in (
        ("turn_sd_deg", turns, unmeasured_turns(unit)),
        ("delta_v_sd", axes, unmeasured_axes(unit)),
    ):
        stated = np.asarray(assumed.sd_of(name))
        larger = np.where(np.diagonal(lacks) > PART, np.maximum(stated, least), stated)
        if getattr(assumed, name) is not None and (larger > stated).any():
            larger_sds: Any = tuple(larger.tolist())
            assumed = replace(assumed, **{name: larger_sds})
    return unit if assumed is unit.assumed else replace(unit, assumed=assumed)


def _missing(triad: RecordedTriad, columns: Sequence[str]) -> tuple[int, ...]:
    return triad.absent or tuple(k for k, c in enumerate(columns) if c not in triad.table.columns)


def _filled(triad: RecordedTriad, columns: list[str]) -> RecordedTriad:
    absent = _missing(triad, columns)
    # Without any of its columns it is a triad of another kind, which is rejected later.
    if not absent or triad.absent or len(absent) == 3:
        return triad
    table = triad.table.copy()
    there = next(c for k, c in enumerate(columns) if k not in absent)
    for k in absent:
        # Rows missing for another axis are missing for this one as well.
        table[columns[k]] = table[there] * 0.0
    table = table[[*columns, *(c for c in triad.table.columns if c not in columns)]]
    table.attrs = dict(triad.table.attrs)
    keep = np.array([k not in absent for k in range(3)])
    told = triad.uncertainty.mapped(
        lambda sd: np.where(keep, sd, 0.0),
        np.where(keep, triad.uncertainty.axis("full_scale"), np.inf),
    )
    return replace(triad, table=table, uncertainty=told, absent=absent)


def _projection(C: Array, absent: Sequence[int]) -> Array:
    columns = C[:, list(absent)]
    return np.asarray(columns @ columns.T)
