"""Crash reconstruction from one unit, or from the mean of several."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.acceleration import Acceleration, body_acceleration, resolved_acceleration
from strapdown.crash.at_point import PointKinematics
from strapdown.crash.crash_type import CrashType, classify_crashes
from strapdown.crash.delta_v import DeltaV, delta_v, trailing_delta_v
from strapdown.crash.delta_v_bound import (
    EventChanges,
    VelocityChange,
    body_delta_v_bound,
    resolved_delta_v_bound,
    velocity_change,
)
from strapdown.crash.entry import Entry
from strapdown.crash.events import PART_563, CrashEvents, EventRule, detect_events
from strapdown.crash.leg import VELOCITY
from strapdown.crash.path import CrashPath, reconstruct_path
from strapdown.crash.reconstruction_summary import summary_table, unit_line
from strapdown.crash.unit_effects import SampleEffects
from strapdown.errors import DataError, Finding
from strapdown.mechanization import NorthEastDown

__all__ = ["check_standing", "entry_findings"]


Array = NDArray[np.float64]

#: Length of the trailing window: Tadic and Vukajlovic (2016), section 4.
PEAK_WINDOW = 0.030
NO_ROLL = "whether it rolled over cannot be told without a gyro about the forward axis"


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


def reconstruct_unit(
    at_point: PointKinematics,
    entry: Entry | None,
    *,
    window: Sequence[float] | None = None,
    peak_window: float = PEAK_WINDOW,
    rule: EventRule = PART_563,
    gravity: float = STANDARD_GRAVITY,
    mechanization: NorthEastDown | None = None,
) -> UnitReconstruction:
    """Find the events of a unit, its changes of velocity and its path.

    Parameters
    ----------
    at_point : PointKinematics
    entry : Entry or None
        As `reconstruct_path`.
    window : (float, float), s, optional
        Of the path.
    peak_window : float, s
    rule : EventRule
    gravity : float, m/s²
        At the site.
    mechanization : NorthEastDown, optional

    Returns
    -------
    UnitReconstruction
        Without events where the record has no crash: `events` gives the largest change.

    Raises
    ------
    DataError, DivergenceError
        As `reconstruct_path`.
    """
    check_standing(at_point, entry)
    at_rest, rest_sd = at_point.resting_force(gravity)
    acceleration = body_acceleration(at_point.imu, at_rest.tolist())
    effects = at_point.effects
    events = detect_events(
        acceleration,
        rule,
        noise=tuple(float(x) for x in np.median(effects.force_noise, axis=0)),
        bias_sd=tuple(float(x) for x in rest_sd),
    )
    path = reconstruct_path(
        at_point.imu,
        effects,
        at_point.levelling,
        None if at_point.rest is None else at_point.rest.end,
        entry,
        window=window,
        mechanization=mechanization,
        zeroed_at_rest=at_point.rest is not None,
    )
    first = int(np.searchsorted(at_point.imu.index, path.time[0] - 1e-9))
    part = at_point.imu.iloc[first : first + len(path.time)]
    part.attrs = dict(at_point.imu.attrs)
    resolved = resolved_acceleration(part, path.q_nb, gravity)
    body: list[EventChanges] = []
    ned: list[EventChanges | None] = []
    findings = [
        *events.findings,
        *entry_findings(at_point, entry, path, events, mechanization),
        *_unseen(at_point, events),
    ]
    for event in events.events:
        ends = event.time_zero_sd, 0.0 if math.isnan(event.end_sd) else event.end_sd
        start, end = event.time_zero, min(event.end, acceleration.end)
        peak = trailing_delta_v(acceleration, peak_window, min(start + peak_window, end), end).peak
        whole = delta_v(acceleration, start, end, across_gaps=True)
        body.append(
            EventChanges(
                _along(effects, peak, "peak", rest_sd, None),
                _along(effects, whole, "event", rest_sd, _moved(whole, ends)),
            )
        )
        if path.time[0] <= min(start, peak.start) and max(end, peak.end) <= path.time[-1]:
            course = np.unwrap(path.table["heading"], period=360.0)
            heading = float(np.interp(start, path.time, course)) % 360.0
            spans = (peak.start, peak.end), (start, end)
            peak, whole = (delta_v(resolved, *span, across_gaps=True) for span in spans)
            ned.append(
                EventChanges(
                    _resolved(path, peak, "peak", heading, None),
                    _resolved(path, whole, "event", heading, _moved(whole, ends)),
                )
            )
        else:
            ned.append(None)
            findings.append(
                Finding(
                    "crash.event-not-within-path-change",
                    file=at_point.name,
                    quantity="window",
                    start=start,
                    end=end,
                    time=path.time[0],
                    time_2=path.time[-1],
                )
            )
    # An assumed roll gives no information on a rollover.
    rolled = "roll" not in at_point.assumed_axes
    types = classify_crashes(
        [changes.event.delta_v for changes in body],
        [changes.event.bound.covariance for changes in body],
        events=events.events,
        time=acceleration.time if rolled else None,
        roll_rate=at_point.imu["gyro_x"].to_numpy(dtype=np.float64) if rolled else None,
        start_roll_deg=at_point.levelling.roll_deg,
        roll_rate_sd=effects.roll_bias_sd,
        start_roll_sd_deg=at_point.levelling.sd_deg,
    )
    if not rolled:
        types = tuple(replace(t, reason=f"{t.reason}; {NO_ROLL}") for t in types)
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


def _unseen(at_point: PointKinematics, events: CrashEvents) -> list[Finding]:
    """Report that an impact along an assumed axis is not among the events."""
    blind = [axis for axis in at_point.assumed_axes if axis in ("forward", "right")]
    if events.events or not blind:
        return []
    return [
        Finding(
            "crash.impact-along-would-not-show", file=at_point.name, quantity="delta-V", blind=blind
        )
    ]


def _moved(change: DeltaV, ends: tuple[float, float]) -> Array:
    """Effect on the change of one standard deviation of either end of an event."""
    return np.array([-change.start_rate * ends[0], change.end_rate * ends[1]])


def _along(
    effects: SampleEffects, change: DeltaV, window: str, rest_sd: Array, at_ends: Array | None
) -> VelocityChange:
    bound = body_delta_v_bound(effects, change.weights, rest_sd=rest_sd, at_ends=at_ends)
    return velocity_change(window, change, bound)


def _resolved(
    path: CrashPath, change: DeltaV, window: str, heading: float, at_ends: Array | None
) -> VelocityChange:
    bound = resolved_delta_v_bound(path, change.start, change.end, at_ends=at_ends)
    return velocity_change(window, change, bound, heading)


# Consistency of the stated entry with the record.


# Two numbers are inconsistent beyond so many standard deviations.
SIGMAS = 4.0
# A vehicle steeper than this at the impact is on a slope: braking does not pitch it so far.
SLOPE_DEG = 4.0


def check_standing(at_point: PointKinematics, entry: Entry | None) -> None:
    """Refuse a start at zero speed where the vehicle may have been driving.

    Raises
    ------
    DataError
        No entry is given, and the quiet interval may be one of driving at speed.
    """
    rest = at_point.rest
    if entry is None and rest is not None and rest.grade == "steady":
        raise DataError(
            "crash.entry-speed-unknown-quiet",
            file=at_point.name,
            quantity="entry",
            start=rest.start,
            end=rest.end,
        )


def entry_findings(
    at_point: PointKinematics,
    entry: Entry | None,
    path: CrashPath,
    events: CrashEvents,
    mechanization: NorthEastDown | None,
) -> list[Finding]:
    """Report an entry during the crash, or a speed that the record contradicts.

    Parameters
    ----------
    at_point : PointKinematics
    entry : Entry or None
    path : CrashPath
        The path from this entry.
    events : CrashEvents
    mechanization : NorthEastDown, optional
    """
    if entry is None:
        return []
    found = _slope(at_point, entry, path)
    # Time zero is the beginning of a window with a small change; for an impact on a wall the change
    # is at the end of the window, and the first contact up to one window after time zero.
    if events.events and events.events[0].time_zero + events.rule.wake_window < entry.time:
        first = events.events[0].time_zero
        found.append(
            Finding(
                "crash.stated-crash-began-ms-before",
                file=at_point.name,
                quantity="entry",
                time=entry.time,
                time_2=1000.0 * (entry.time - first),
                first=first,
            )
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
        found.append(
            Finding(
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
