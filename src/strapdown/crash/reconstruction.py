"""Reconstruction of a crash: by each unit, and by the mean of those that agree."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.acceleration import (
    Acceleration,
    body_acceleration,
    resolved_acceleration,
)
from strapdown.crash.combine_units import combine_units
from strapdown.crash.consistency import UnitComparison, clipped_axes, compare_units
from strapdown.crash.contact import Contact, find_contact
from strapdown.crash.crash_type import CrashType, RollRecord, classify_crashes
from strapdown.crash.delta_v import DeltaV, delta_v, trailing_delta_v
from strapdown.crash.delta_v_bound import (
    EventChanges,
    VelocityChange,
    body_delta_v_bound,
    change_line,
    direction_bounds,
    resolved_delta_v_bound,
    velocity_change,
)
from strapdown.crash.entry import Entry, EntryState
from strapdown.crash.events import (
    BEGINS_WITHIN,
    KMH,
    PART_563,
    CrashEvents,
    EventRule,
    detect_events,
)
from strapdown.crash.measuring_point import PointKinematics
from strapdown.crash.path import VELOCITY, CrashPath, path_line, reconstruct_path
from strapdown.crash.preparation import prepare_together
from strapdown.errors import ConfigError, DataError, Finding, add_warning
from strapdown.mechanization import NorthEastDown
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.synchronise import SynchronisedUnits, synchronise
from strapdown.sensors.triad_errors import FARTHEST, finite, span, triple
from strapdown.systems.one_thread import one_thread
from strapdown.tables import NED
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from strapdown.crash.drive_entry import DriveEntry


from strapdown.crash.consistency import (
    VelocityIncrements,
    body_turning,
    clipped_pieces,
    compare_pair,
    velocity_increments,
)
from strapdown.crash.structure import unlearnt

Row = tuple[str, str, float, float, float]


def summary_table(units: Sequence[UnitReconstruction]) -> pd.DataFrame:
    """Changes of velocity, directions of force and ends of the path, with 95 % bounds.

    By ``unit``, ``part`` (number and type of the event, or ``path``) and ``quantity``, which names
    the unit: ``value``, ``low`` and ``high``. A change of velocity of which the record holds only a
    part (`VelocityChange.missing`) is open: ``high`` of its resultant is infinite, and of a
    component the bound on its far side; the direction is named that of the recorded part.
    """
    index, rows = [], []
    for unit in units:
        for part, quantity, value, low, high in _unit_rows(unit):
            index.append((unit.name, part, quantity))
            rows.append((value, low, high))
    return pd.DataFrame(
        rows,
        index=pd.MultiIndex.from_tuples(index, names=["unit", "part", "quantity"]),
        columns=["value", "low", "high"],
        dtype=np.float64,
    )


def _unit_rows(unit: UnitReconstruction) -> list[Row]:
    rows: list[Row] = []
    for k, (changes, kind) in enumerate(zip(unit.body, unit.types, strict=True), start=1):
        part = f"{k} {kind.name}"
        whole, peak = changes.event, changes.peak
        event = unit.events.events[k - 1]
        sd = TWO_SIDED_95 * event.time_zero_sd
        rows.append((part, "time zero s", *_about(event.time_zero, sd)))
        onset = changes.contact.start
        rows.append((part, "onset s", *_about(onset.time, TWO_SIDED_95 * onset.sd)))
        for name, value, ends in zip(
            ("delta-V forward m/s", "delta-V right m/s", "delta-V down m/s"),
            whole.delta_v.vector.tolist(),
            whole.ranges.tolist(),
            strict=True,
        ):
            rows.append((part, name, value, *ends))
        length = 1e3 * (peak.delta_v.end - peak.delta_v.start)
        for name, change in (
            ("delta-V resultant m/s", whole),
            (f"largest in {length:.3g} ms m/s", peak),
        ):
            rows.append((part, name, change.resultant, *change.resultant_range))
        name = "PDOF of the recorded part deg" if whole.at_least else "PDOF deg"
        rows.append((part, name, *direction_bounds(whole)))
    path = unit.path
    last = TWO_SIDED_95 * path.sd.iloc[-1]
    for axis in NED:
        value = float(path.table[axis].iloc[-1])
        rows.append(("path", f"end {axis} m", *_about(value, float(last[axis]))))
    return rows


def _about(value: float, half: float) -> tuple[float, float, float]:
    return value, value - half, value + half


def unit_line(unit: UnitReconstruction) -> str:
    """Results of one unit: a line for each event, and one for the path."""
    lines = [
        f"{unit.name}, event {k}, {kind.name}: delta-V {_size(c.event)}; {change_line(c.event)}"
        for k, (c, kind) in enumerate(zip(unit.body, unit.types, strict=True), start=1)
    ]
    if not lines:
        size, axis = unit.events.largest_change, unit.events.largest_axis
        lines = [f"{unit.name}: no event, at most {size:.2f} m/s ({axis})"]
        if (cut := unit.events.cut_change) > 0.0:
            lines = [f"{unit.name}: the record ends within an impact, at least {cut:.2f} m/s"]
    return "\n".join([*lines, f"{unit.name}, {path_line(unit.path)}"])


def _size(change: VelocityChange) -> str:
    size, half = change.resultant, change.resultant_bound
    if change.at_least:
        return f"at least {size:.2f} m/s (95 %: {change.resultant_range[0]:.2f})"
    return f"{size:.2f} ± {half:.2f} m/s"


# Crash reconstruction from one unit, or from the mean of several.


@dataclass(frozen=True, eq=False)
class UnitReconstruction:
    """Reconstruction from one unit, or from the mean of several.

    Attributes
    ----------
    name : str
    at_point : PointKinematics
    acceleration : Acceleration
        Along the rotating axes of the vehicle, stationary mean subtracted.
    resolved : Acceleration
        In the axes of the path, gravity subtracted; over the path's window.
    events : CrashEvents
    path : CrashPath
    body, ned : tuple of EventChanges
        For every event, along the rotating axes and resolved. An event that extends beyond the
        path's window has no resolved change.
    types : tuple of CrashType
        For every event, from its change along the rotating axes and the roll.
    findings : tuple of Finding
    drive : EntryState or None
        Estimate from the drive before the crash, where the entry is from there.
    """

    name: str
    at_point: PointKinematics = field(repr=False)
    acceleration: Acceleration = field(repr=False)
    resolved: Acceleration = field(repr=False)
    events: CrashEvents
    path: CrashPath = field(repr=False)
    body: tuple[EventChanges, ...]
    ned: tuple[EventChanges | None, ...]
    types: tuple[CrashType, ...]
    findings: tuple[Finding, ...] = ()
    drive: EntryState | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return f"<UnitReconstruction\n{unit_line(self)}>"

    def summary(self) -> pd.DataFrame:
        """Results with 95 % bounds: `summary_table` of this unit."""
        return summary_table([self])

    @property
    def delta_v(self) -> VelocityChange | None:
        """Change of velocity of the severest event, along the rotating axes; None without any."""
        changes = [one.event for one in self.body]
        return max(changes, key=lambda change: change.resultant) if changes else None


@dataclass(frozen=True)
class CrashOptions:
    """Options of a reconstruction.

    Attributes
    ----------
    point : sequence of float, (3,), m
        Reference point in vehicle axes (forward, right, down) from the vehicle's origin.
    window : (float, float), s, optional
        Of the path, from the trigger; -0.1 to 0.75 s, as far as a unit's record has them, if not
        given.
    rate : float, Hz
        Of the common stamps. Faster channels are decimated without aliasing.
    sampling : {'instantaneous', 'mean'}
        Meaning of the samples at the common stamps: values of a band-limited signal, or true means
        over the step, which preserve the delta-v of a fast channel.
    clock : {'trigger', 'correlation'}
        As `synchronise`.
    combine : bool
        Also reconstruct the weighted mean of the units, if they agree; if they contradict, a
        finding reports it. `combine_units` computes the mean in any case.
    preparation : mapping, optional
        Options of `Preparation` by name, for all units; under the name of a unit, a mapping of its
        own options.
    peak_window : float, s
        Window of the delta-v that usually rates severity: Tadic and Vukajlovic (2016), section 4.
    rule : EventRule
        Definition of an event: 49 CFR 563 by default.
    gravity : float, m/s²
        Local gravity.
    mechanization : NorthEastDown, optional

    Raises
    ------
    ConfigError
        An option is of another kind, or out of range.
    """

    point: Sequence[float] = (0.0, 0.0, 0.0)
    window: Sequence[float] | None = None
    rate: float = 200.0
    sampling: str = "instantaneous"
    clock: str = "trigger"
    combine: bool = True
    preparation: Mapping[str, Any] | None = None
    peak_window: float = 0.030
    rule: EventRule = PART_563
    gravity: float = STANDARD_GRAVITY
    mechanization: NorthEastDown | None = None

    def __post_init__(self) -> None:
        place = triple(self.point, "point", "sensors.point-not-three-numbers")
        if math.hypot(*place) > FARTHEST:
            raise ConfigError(
                "crash.vehicle-origin", quantity="point", place=place, hypot=math.hypot(*place)
            )
        if self.window is not None and span(self.window) is None:
            raise ConfigError("crash.window-not-a-pair", quantity="window", window=self.window)
        if not (finite(self.peak_window) and self.peak_window > 0.0):
            raise ConfigError(
                "crash.no-length", quantity="peak_window", peak_window=self.peak_window
            )
        for name, kind in (
            ("preparation", Mapping | None),
            ("rule", EventRule),
            ("gravity", int | float),
            ("mechanization", NorthEastDown | None),
        ):
            if not isinstance(getattr(self, name), kind):
                raise _wrong_type(name, getattr(self, name))


def reconstruct_unit(
    at_point: PointKinematics,
    entry: Entry | None,
    options: CrashOptions = CrashOptions(),
    *,
    units: Sequence[PointKinematics] = (),
) -> UnitReconstruction:
    """Find the events of a unit, its changes of velocity and its path.

    Parameters
    ----------
    at_point : PointKinematics
    entry : Entry or None
        As `reconstruct_path`.
    options : CrashOptions
        Window, peak window, rule, gravity and mechanization are used.
    units : sequence of PointKinematics
        Units of which `at_point` is the mean, whose clipped axes it has.

    Returns
    -------
    UnitReconstruction
        Without events where the record has no crash: `events` gives the largest change.

    Raises
    ------
    DataError, DivergenceError
        As `reconstruct_path`.
    """
    gravity, mechanization = options.gravity, options.mechanization
    peak_window = options.peak_window
    rest = at_point.rest
    if entry is None and rest is not None and rest.grade == "steady":
        # At zero speed, where the quiet interval may be one of driving.
        raise DataError(
            "crash.entry-speed-unknown-quiet",
            file=at_point.name,
            quantity="entry",
            start=rest.start,
            end=rest.end,
        )
    at_rest, rest_sd = at_point.resting_force(gravity)
    acceleration = body_acceleration(at_point.imu, at_rest.tolist())
    effects = at_point.effects
    noise = tuple(float(x) for x in np.median(effects.force_noise, axis=0))
    events = detect_events(
        acceleration, options.rule, noise=noise, bias_sd=tuple(float(x) for x in rest_sd)
    )
    path = reconstruct_path(
        at_point.imu,
        effects,
        at_point.levelling,
        None if rest is None else rest.end,
        entry,
        window=options.window,
        mechanization=mechanization,
        zeroed_at_rest=rest is not None,
    )
    first = int(np.searchsorted(at_point.imu.index, path.time[0] - 1e-9))
    part = at_point.imu.iloc[first : first + len(path.time)]
    part.attrs = dict(at_point.imu.attrs)
    resolved = resolved_acceleration(part, path.q_nb, gravity)
    body: list[EventChanges] = []
    ned: list[EventChanges | None] = []
    findings = [
        *(f for f in events.findings if f.code != BEGINS_WITHIN or not _from_zero(at_point, units)),
        *entry_findings(at_point, entry, path, events, mechanization),
    ]
    blind = [axis for axis in at_point.assumed_axes if axis in ("forward", "right")]
    if blind and not events.events:
        # An impact along an assumed axis is not among the events.
        add_warning(
            findings,
            "crash.impact-along-would-not-show",
            file=at_point.name,
            quantity="delta-V",
            blind=blind,
        )
    for k, event in enumerate(events.events):
        between = (
            events.events[k - 1].end if k else -math.inf,
            events.events[k + 1].time_zero if k + 1 < len(events.events) else math.inf,
        )
        contact = find_contact(acceleration, event, options.rule, noise=noise, between=between)
        start, end = contact.start.time, contact.end.time
        if end > at_point.assumed_until:
            add_warning(
                findings,
                "crash.event-beyond-assumed-turning",
                file=at_point.name,
                quantity="delta-V",
                end=end,
                until=at_point.assumed_until,
            )
        low = min(start + peak_window, end)
        peak = trailing_delta_v(acceleration, peak_window, low, end).peak
        whole = delta_v(acceleration, start, end, across_gaps=True)
        plain = body_delta_v_bound(effects, whole.weights, rest_sd=rest_sd, at_ends=contact.moved)
        # The part beyond the end of the record is within the bound, or leaves it without an upper
        # end.
        least = contact.beyond(TWO_SIDED_95 * plain.along(whole.vector))
        ends_of = {"event": contact.at_ends(least), "peak": _at_peak(peak, contact)}
        missing = {
            "event": _missing(least, (at_point, *units), (start, end)),
            "peak": _missing(contact.beyond(math.inf), (at_point, *units), (peak.start, peak.end)),
        }
        changes = []
        for window, change in (("peak", peak), ("event", whole)):
            bound = body_delta_v_bound(
                effects,
                change.weights,
                rest_sd=rest_sd,
                at_ends=ends_of[window],
            )
            why, of = missing[window]
            changes.append(velocity_change(window, change, bound, missing=why, open_axes=of))
        body.append(EventChanges(changes[0], changes[1], contact))
        over, of_event = changes
        together = math.hypot(over.resultant_bound, of_event.resultant_bound)
        if not of_event.at_least and over.resultant - of_event.resultant > together:
            add_warning(
                findings,
                "crash.window-exceeds-event",
                file=at_point.name,
                quantity="delta-V",
                length=1e3 * peak_window,
                peak=over.resultant,
                whole=of_event.resultant,
            )
        if changes[1].at_least:
            findings.append(_at_least(changes[1], at_point.name))
        if path.time[0] <= min(start, peak.start) and max(end, peak.end) <= path.time[-1]:
            course = np.unwrap(path.table["heading"], period=360.0)
            heading = float(np.interp(start, path.time, course)) % 360.0
            changes = []
            for window, span in (("peak", (peak.start, peak.end)), ("event", (start, end))):
                change = delta_v(resolved, *span, across_gaps=True)
                at = np.clip(np.searchsorted(path.time, span[0]), 0, len(path.time) - 1)
                turned = rotation.rotate(path.q_nb[at], ends_of[window])
                bound = resolved_delta_v_bound(path, *span, at_ends=turned)
                why, of = missing[window]
                # Axes of the vehicle are not those of the path.
                every = (any(of),) * 3
                changes.append(
                    velocity_change(window, change, bound, heading, missing=why, open_axes=every)
                )
            ned.append(EventChanges(changes[0], changes[1], contact))
        else:
            ned.append(None)
            add_warning(
                findings,
                "crash.event-not-within-path-change",
                file=at_point.name,
                quantity="window",
                start=start,
                end=end,
                time=path.time[0],
                time_2=path.time[-1],
            )
    # An assumed roll gives no information on a rollover.
    roll = None
    if "roll" not in at_point.assumed_axes:
        level, rate = at_point.levelling, at_point.imu["gyro_x"].to_numpy(dtype=np.float64)
        roll = RollRecord(
            acceleration.time, rate, effects.roll_bias_sd, level.roll_deg, level.sd_deg
        )
    types = classify_crashes(
        [changes.event.delta_v for changes in body],
        [changes.event.bound.covariance for changes in body],
        events=events.events,
        roll=roll,
    )
    return UnitReconstruction(
        at_point.name,
        at_point,
        acceleration,
        resolved,
        events,
        path,
        tuple(body),
        tuple(ned),
        types,
        tuple(findings),
    )


def _from_zero(at_point: PointKinematics, units: Sequence[PointKinematics]) -> bool:
    """Whether all records are changes of velocity that count from time zero."""
    prepared = [u.prepared for u in (at_point, *units) if u.prepared is not None]
    return bool(prepared) and all(p.unit.from_zero for p in prepared)


def _missing(
    beyond: tuple[str, ...], units: Sequence[PointKinematics], window: tuple[float, float]
) -> tuple[tuple[str, ...], tuple[bool, bool, bool]]:
    """Why, and along which axes, a change over a window is only a part.

    `beyond`: ends of the record within the contact. Of a mean, an axis counts as clipped where all
    units that measure it were clipped: its weights leave out the others.
    """
    records = [u for u in units if u.prepared is not None]
    clipped = np.zeros(3, dtype=bool)
    if records:
        measured = np.array([np.diagonal(u.unmeasured) < 0.5 for u in records])
        cut = np.array([clipped_axes(u, window) for u in records])
        clipped = (cut & measured).any(axis=0) & (cut | ~measured).all(axis=0)
    x, y, z = (bool(c) or bool(beyond) for c in clipped)
    return (*beyond, *(("clipped",) if clipped.any() else ())), (x, y, z)


def _at_least(change: VelocityChange, name: str) -> Finding:
    return Finding(
        "crash.delta-v-at-least",
        file=name,
        quantity="delta-V",
        reasons=[Finding(f"crash.missing-{m}", severity="note") for m in change.missing],
        resultant=change.resultant / KMH,
        low=change.resultant_range[0] / KMH,
    )


def _at_peak(change: DeltaV, contact: Contact) -> Array:
    """Effect on the largest change of one standard deviation of the time of its window.

    The window is where the length of the change is stationary, unless the contact's onset or end
    bounds it: what moves with it is the direction.
    """
    moved = change.end_rate - change.start_rate
    bounded = change.start <= contact.start.time + contact.start.sd
    sd = contact.start.sd if bounded else contact.end.sd
    if not bounded and change.end < contact.end.time - contact.end.sd:
        sd = 0.0
    return (sd * moved)[None]


# Consistency of the stated entry with the record.


# Two numbers are inconsistent beyond so many standard deviations.
SIGMAS = 4.0
# A vehicle steeper than this at the impact is on a slope: braking does not pitch it so far.
SLOPE_DEG = 4.0


def entry_findings(
    at_point: PointKinematics,
    entry: Entry | None,
    path: CrashPath,
    events: CrashEvents,
    mechanization: NorthEastDown | None,
) -> list[Finding]:
    """Report an entry during the crash, or a speed that the record contradicts."""
    if entry is None:
        return []
    found = _slope(at_point, entry, path)
    # Time zero is the beginning of a window with a small change; for an impact on a wall the change
    # is at the end of the window, and the first contact up to one window after time zero.
    if events.events and events.events[0].time_zero + events.rule.wake_window < entry.time:
        first = events.events[0].time_zero
        add_warning(
            found,
            "crash.stated-crash-began-ms-before",
            file=at_point.name,
            quantity="entry",
            time=entry.time,
            time_2=1000.0 * (entry.time - first),
            first=first,
        )
        # Its speed may differ from that at the beginning.
        return found
    rest = at_point.rest
    if rest is None or rest.grade != "still" or at_point.prepared is None:
        return found
    driven = reconstruct_path(
        at_point.imu,
        at_point.effects,
        at_point.levelling,
        rest.end,
        None,
        window=(float(path.time[0]), float(path.time[-1])),
        mechanization=mechanization,
    )
    k, j = path.anchor, int(np.searchsorted(driven.time, path.time[path.anchor] - 1e-9))
    speed, sd = _speed(path, k)
    felt, felt_sd = _speed(driven, j)
    if abs(speed - felt) > SIGMAS * float(np.hypot(sd, felt_sd)):
        add_warning(
            found,
            "crash.rest-until-record-itself-comes",
            file=at_point.name,
            quantity="entry speed",
            speed=speed,
            sd=1.96 * sd,
            time=entry.time,
            end=rest.end,
            felt=felt,
            felt_sd=1.96 * felt_sd,
        )
    return found


def _slope(at_point: PointKinematics, entry: Entry, path: CrashPath) -> list[Finding]:
    """Report a level velocity for a vehicle that is stationary on a slope."""
    now, sd = path.table.iloc[path.anchor], path.sd.iloc[path.anchor]
    pitch, along = float(now["pitch"]), entry.velocity
    speed = float(np.hypot(along[0], along[1]))
    heading = np.radians(float(now["heading"]))
    ahead = along[0] * np.cos(heading) + along[1] * np.sin(heading)
    climbs = float(np.tan(np.radians(pitch)) * ahead + along[2])
    known = np.hypot(speed * np.radians(float(sd["pitch"])), float(sd["VD"]))
    if abs(pitch) < SLOPE_DEG or abs(climbs) < SIGMAS * known:
        return []
    return [
        Finding(
            "crash.vertical-velocity-upward-vehicle-points",
            file=at_point.name,
            quantity="entry",
            along=0.0 - along[2],
            pitch=pitch,
            time=entry.time,
            climbs=climbs - along[2],
        )
    ]


def _speed(path: CrashPath, row: int) -> tuple[float, float]:
    """Horizontal speed at a sample, and its standard deviation."""
    v = path.table[["VN", "VE"]].to_numpy()[row]
    speed = float(np.hypot(*v))
    spread = path.covariance[row, VELOCITY, VELOCITY][:2, :2]
    if speed == 0.0:
        return 0.0, float(np.sqrt(spread.trace()))
    return speed, float(np.sqrt(v @ spread @ v)) / speed


# Reconstruct a crash from its units' records: delta-v, direction of force and path.


@dataclass(frozen=True, eq=False)
class CrashReconstruction:
    """Reconstruction of a crash by each unit and by all together.

    Attributes
    ----------
    point : tuple of float, m
        The reference point, vehicle axes from the vehicle's origin.
    synchronised : SynchronisedUnits
    units : tuple of UnitReconstruction
        Each unit by itself, at the reference point.
    comparison : UnitComparison or None
        None for a single unit.
    combined : UnitReconstruction or None
        Of the weighted mean of the units, if requested and if several units agree.
    findings : tuple of Finding
        Findings of all steps.
    """

    point: tuple[float, float, float]
    synchronised: SynchronisedUnits = field(repr=False)
    units: tuple[UnitReconstruction, ...]
    comparison: UnitComparison | None
    combined: UnitReconstruction | None
    findings: tuple[Finding, ...]

    def __repr__(self) -> str:
        lines = [unit_line(u) for u in self.answers]
        said = f"{len(self.findings)} finding{'s' * (len(self.findings) != 1)}"
        return "\n".join([f"<CrashReconstruction at {self.point} m", *lines, f"{said}>"])

    @property
    def answers(self) -> tuple[UnitReconstruction, ...]:
        """Every unit, and their mean if there is one."""
        return (*self.units, *(() if self.combined is None else (self.combined,)))

    def summary(self) -> pd.DataFrame:
        """Table of delta-v, directions of force and ends of the path, with their bounds.

        Returns
        -------
        DataFrame
            Indexed by ``unit``, ``part`` (number and type of the event, or ``path``) and
            ``quantity``; ``value``, ``low`` and ``high`` in the unit that the quantity names: 95 %
            bounds.
        """
        return summary_table(self.answers)

    @property
    def main(self) -> UnitReconstruction:
        """The mean of the units, or the first one without a contradiction."""
        if self.combined is not None:
            return self.combined
        doubted = () if self.comparison is None else self.comparison.doubted
        return next((u for u in self.units if u.name not in doubted), self.units[0])

    def unit(self, name: str) -> UnitReconstruction:
        """Find a unit by its name.

        Raises
        ------
        ConfigError
            No unit has this name.
        """
        for unit in self.units:
            if unit.name == name:
                return unit
        raise ConfigError(
            "crash.unit-unknown", quantity="unit", name=name, units=[u.name for u in self.units]
        )


def reconstruct_crash(
    units: Sequence[CrashUnit],
    entry: Entry | DriveEntry | None,
    options: CrashOptions = CrashOptions(),
) -> CrashReconstruction:
    """Reconstruct a crash.

    Parameters
    ----------
    units : sequence of CrashUnit
        Of one rigid vehicle, as recorded.
    entry : Entry, DriveEntry or None
        Velocity, heading and instant of the path; or fixes of a GNSS receiver before the crash,
        from which each unit finds them together with its biases (the mean of the units then uses
        the entry of the first). None: the vehicle was stationary at the beginning of the record,
        and the path is given in its axes at the trigger.
    options : CrashOptions

    Returns
    -------
    CrashReconstruction
        All bounds are 95 % bounds. Without an event in the record no change of velocity is
        returned, and a finding states how near it came; the path is returned in any case.

    Raises
    ------
    DataError
        A record cannot be used: the message names unit, sensor, row, quantity and remedy.
    ConfigError
        An option is out of range.
    DivergenceError
        A path left the range of vehicle motion.
    """
    _check_units(units)
    if len(units) < 2:
        return _reconstructed(units, entry, options)
    # Only several units need it, and only what is loaded is limited to one thread.
    import scipy.linalg  # noqa: F401

    with one_thread():
        return _reconstructed(units, entry, options)


def _reconstructed(
    units: Sequence[CrashUnit], entry: Entry | DriveEntry | None, options: CrashOptions
) -> CrashReconstruction:
    of_fixes: DriveEntry | None = None
    if not (entry is None or isinstance(entry, Entry)):
        # Estimation from fixes is loaded where it is needed.
        from strapdown.crash.drive_entry import DriveEntry, start_from_drive

        if not isinstance(entry, DriveEntry):
            raise _wrong_type("entry", entry)
        of_fixes = entry
    _check_preparation(options.preparation or {}, {unit.name for unit in units})
    point, combine = options.point, options.combine
    together = synchronise(
        units, method=options.clock, rate=options.rate, sampling=options.sampling, cut=False
    )
    findings = list(together.findings)
    preparation = dict(options.preparation or {})
    if of_fixes is not None:
        preparation["stood"] = of_fixes.stood()
    there = prepare_together(together, point, options.gravity, preparation)
    for of in there:
        findings += () if of.prepared is None else of.prepared.findings
    # Before each unit estimates its own biases, which absorbs part of the differences.
    comparison = None
    hidden: list[Finding] = []
    if len(there) > 1:
        comparison = compare_units(there)
        hidden = undetectable(there, comparison)
        there = [comparison.structure.within(of) for of in there]
    tied = [entry if isinstance(entry, Entry) else None] * len(there)
    drives: list[EntryState | None] = [None] * len(there)
    if of_fixes is not None:
        for k, of in enumerate(there):
            there[k], tied[k], state = start_from_drive(of, of_fixes, point)
            drives[k] = state
            findings += state.findings

    found = tuple(
        replace(reconstruct_unit(of, start, options), drive=drive)
        for of, start, drive in zip(there, tied, drives, strict=True)
    )
    combined = None
    if combine and comparison is not None and comparison.agree:
        combined = reconstruct_unit(combine_units(there), tied[0], options, units=there)
    for reconstruction in (*found, *(() if combined is None else (combined,))):
        findings += reconstruction.findings
    if comparison is not None:
        findings += [*comparison.findings, *hidden]
        if combine and not comparison.agree:
            names = ", ".join(u.name for u in there)
            add_warning(
                findings, "crash.units-disagree-no-mean-told", file=names, quantity="combine"
            )
    x, y, z = (float(v) for v in point)
    return CrashReconstruction(
        (x, y, z), together, found, comparison, combined, tuple(dict.fromkeys(findings))
    )


# Checks of the arguments before any work: those that no later stage would report.


def _check_preparation(preparation: Mapping[str, Any], units: Collection[str]) -> None:
    for name, given in preparation.items():
        if name in units and not isinstance(given, Mapping):
            raise ConfigError(
                "crash.preparation-of-unit-of-wrong-type",
                quantity=f"preparation, {name}",
                type=type(given).__name__,
            )
        if name not in units and isinstance(given, Mapping):
            raise ConfigError(
                "crash.preparation-of-unknown-unit", quantity="preparation", name=name
            )


def _check_units(units: object) -> None:
    if isinstance(units, CrashUnit):
        raise ConfigError("crash.unit-list-needed", file=units.name, quantity="units")
    if units is None or (isinstance(units, Sequence) and not units):
        raise DataError("crash.no-units-given", quantity="units")
    if not isinstance(units, Sequence) or isinstance(units, str):
        raise _wrong_type("units", units)
    for unit in units:
        if not isinstance(unit, CrashUnit):
            raise _wrong_type("units", unit)


def _wrong_type(quantity: str, given: object) -> ConfigError:
    return ConfigError(
        f"crash.{quantity}-of-wrong-type", quantity=quantity, type=type(given).__name__
    )


# Errors of one measuring point that a comparison with the others would not show.

#: A gross scale factor, a position and a mounting that a tape and an eye would make.
SCALE, POSITION, TURNED_DEG = 1.25, 0.25, 5.0


def wrong_ones(one: VelocityIncrements) -> dict[str, VelocityIncrements]:
    """Increments of a unit with each of the errors that are tried, by the codes of their names."""
    opposite = np.eye(3)
    # Along the horizontal axis that changed most.
    main = int(np.argmax(np.abs(one.values[:, :2].sum(axis=0))))
    opposite[main, main] = -1.0
    values = {
        "crash.wrong-sign": one.values @ opposite.T,
        "crash.wrong-axes": one.values @ np.eye(3)[[1, 0, 2]].T,
        "crash.wrong-scale": one.values @ np.diag([SCALE, SCALE, 1.0]).T,
        "crash.wrong-position": one.values,
        "crash.wrong-heading": one.values
        @ rotation.dcm_from_rotation_vector([0.0, 0.0, np.radians(TURNED_DEG)]).T,
    }
    turning = body_turning((one,))
    if turning is not None:
        off = (turning.lever @ (POSITION * np.array([1.0, 1.0, 0.0]))).reshape(-1, 3)
        values["crash.wrong-position"] = one.values + off
    return {code: replace(one, values=moved) for code, moved in values.items()}


def undetectable(units: Sequence[PointKinematics], comparison: UnitComparison) -> list[Finding]:
    """State the errors that a comparison of agreeing units would not detect.

    Each of `wrong_ones` is put into the record of one unit after another, which is then compared
    with the others as in `compare_units`, structure and turning learnt anew. One that a unit could
    have without a contradiction is listed. Errors common to all units never show: their records
    are those of another crash.

    Parameters
    ----------
    units : sequence of PointKinematics
        As compared.
    comparison : UnitComparison

    Returns
    -------
    list of Finding
        One note, or none where the units disagree.
    """
    if not comparison.agree:
        return []
    edges, rigid = comparison.edges, unlearnt(units)
    increments = [velocity_increments(u, edges) for u in units]
    cut = [clipped_pieces(u, edges) for u in units]
    tried = [wrong_ones(one) for one in increments]
    hidden = []
    for code in tried[0]:
        for k, unit in enumerate(units):
            pairs = (
                compare_pair(
                    *(unit, other, tried[k][code], increments[j], ~(cut[k] | cut[j]), rigid),
                    explained=False,
                )
                for j, other in enumerate(units)
                if j != k
            )
            if all(p.agree and all(f.severity == "note" for f in p.findings) for p in pairs):
                hidden.append(Finding(code, severity="note"))
                break
    return [
        Finding(
            "crash.not-detectable-with-these-points",
            severity="note",
            file=", ".join(u.name for u in units),
            quantity="comparison",
            hidden=[*hidden, Finding("crash.wrong-alike", severity="note")],
        )
    ]
