"""Whether what is said of the entry agrees with the record itself."""

from __future__ import annotations

import numpy as np

from strapdown.crash.at_point import AtPoint
from strapdown.crash.entry import Entry
from strapdown.crash.events import CrashEvents
from strapdown.crash.leg import VELOCITY
from strapdown.crash.path import CrashPath, reconstruct_path
from strapdown.errors import DataError, Finding
from strapdown.mechanization import NorthEastDown

__all__ = ["check_standing", "entry_findings"]

# Beyond so many standard deviations two numbers contradict each other.
SIGMAS = 4.0
# A vehicle that is steeper than this when it is struck is on a slope: no braking pitches it so far.
SLOPE_DEG = 4.0


def check_standing(at_point: AtPoint, entry: Entry | None) -> None:
    """Refuse to begin at zero speed where the vehicle may have been driving.

    Raises
    ------
    DataError
        No entry is given, and the quiet stretch may be one at speed.
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
    at_point: AtPoint,
    entry: Entry | None,
    path: CrashPath,
    events: CrashEvents,
    mechanization: NorthEastDown | None,
) -> list[Finding]:
    """An entry that lies in the crash, or a speed that the record contradicts.

    Parameters
    ----------
    at_point : AtPoint
    entry : Entry or None
    path : CrashPath
        That is tied to it.
    events : CrashEvents
    mechanization : NorthEastDown, optional
    """
    if entry is None:
        return []
    found = _slope(at_point, entry, path)
    # Time zero is the begin of a window in which a little changes: a vehicle that strikes a wall
    # does that at its end, and is first touched up to so much after time zero.
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
        # Its speed need not be that at the beginning.
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


def _slope(at_point: AtPoint, entry: Entry, path: CrashPath) -> list[Finding]:
    """A level velocity of a vehicle that stands on a slope."""
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
