"""Crash type (front, side, rear, rollover) from the direction of force and the roll rate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.delta_v import DeltaV
from strapdown.crash.events import CrashEvent
from strapdown.crash.pdof import AngleInterval, Pdof, pdof, pdof_interval
from strapdown.dsp.samples import running_integral
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.tables.checks import Array, as_array, check_rows, check_same_length, check_time

# Rollover criterion: a rigid body about the wheels on one side.


@dataclass(frozen=True)
class RollMotion:
    """Roll of a vehicle relative to tipping over.

    `share`: largest roll energy divided by the energy for tipping over (it tips from 1 on), reached
    at `time`, s, with the 95 % bound `low` to `high`; signed peaks of rate, deg/s, and roll, deg;
    `quarter_turns` of the latter: one or more is a rollover by NHTSA's definition (90 deg or more
    about the longitudinal or lateral axis).
    """

    share: float
    low: float
    high: float
    time: float
    peak_rate_deg_s: float
    peak_roll_deg: float
    quarter_turns: int


@dataclass(frozen=True, eq=False)
class RollRecord:
    """Rate about the forward axis, bias removed, and the roll that it starts from.

    `time`, (n,), s; `rate`, (n,), rad/s, with the standard deviation `rate_sd` of a constant error;
    `start_deg`, `start_sd_deg`: roll at the first sample.
    """

    time: ArrayLike
    rate: ArrayLike
    rate_sd: float = 0.0
    start_deg: float = 0.0
    start_sd_deg: float = 0.0


@dataclass(frozen=True)
class TippingBody:
    """A rigid vehicle that tips about the wheels on one side; dimensions in m.

    `stability_factor`: half the track divided by the height of the center of mass (49 CFR 575,
    NCAP; 1.41 is the sales-weighted mean of passenger cars of 2003, NHTSA, DOT HS 809 868);
    `roll_radius` of gyration. The criterion is this package's own: with ``r = hypot(c, h)`` (half
    track, height) and ``tip = atan(c / h)``, it tips over if the energy of the roll, per mass, ``g
    r (cos(tip - |roll|) - cos tip) + (k² + r²) rate² / 2``, reaches ``g r (1 - cos tip)``; the rate
    counts only while it turns away from level. Suspension, tires and continuing external forces are
    neglected, so that a ratio near one decides neither way. A level passenger car requires 141
    deg/s. `ConfigError`: a dimension is not positive and finite.
    """

    half_track: float = 0.75
    stability_factor: float = 1.41
    roll_radius: float = 0.65

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError("crash.no-dimension-vehicle", quantity=f.name, value=value)

    def energy_share(self, roll: ArrayLike, rate: ArrayLike) -> Array:
        """Energy of a roll, rad, at a rate, rad/s, (n,) each, divided by that for tipping over."""
        angle, turn = np.asarray(roll, dtype=np.float64), np.asarray(rate, dtype=np.float64)
        arm = math.hypot(self.half_track, self.half_track / self.stability_factor)
        tip = math.atan(self.stability_factor)
        weight = STANDARD_GRAVITY * arm
        lifted = weight * (np.cos(np.maximum(tip - np.abs(angle), 0.0)) - math.cos(tip))
        away = angle * turn >= 0.0
        moving = np.where(away, 0.5 * (self.roll_radius**2 + arm**2) * turn**2, 0.0)
        share: Array = (lifted + moving) / (weight * (1.0 - math.cos(tip)))
        return share

    def roll_motion(self, record: RollRecord, *, since: float | None = None) -> RollMotion:
        """Compute the roll of a record and its ratio to tipping over.

        The roll is the integral of the rate, valid while the pitch is small: at 10 deg of pitch and
        100 deg/s of yaw, 17 deg/s of roll are missed. Samples before `since`, s, are integrated but
        not counted. `DataError`: lengths differ, or no sample is left.
        """
        stamps, rate = as_array(record.time, None, "time"), as_array(record.rate, None, "roll_rate")
        check_same_length(None, time=stamps, roll_rate=rate)
        check_time(stamps, None)
        check_rows(rate[:, None], ["roll_rate"], None)
        start_sd, rate_sd = TWO_SIDED_95 * record.start_sd_deg, TWO_SIDED_95 * record.rate_sd
        first = -math.inf if since is None else since
        counted = stamps >= first
        if not counted.any():
            raise DataError("crash.no-rate-roll", quantity="roll_rate", first=first)
        roll = math.radians(record.start_deg) + running_integral(stamps, rate)
        share = self.energy_share(roll, rate)[counted]
        best = int(np.argmax(share))
        bounds = [float(share[best])]
        for drift in (-rate_sd, rate_sd):
            for tilt in (-start_sd, start_sd):
                moved = roll + math.radians(tilt) + drift * (stamps - stamps[0])
                bounds.append(float(self.energy_share(moved, rate + drift)[counted].max()))
        turned = roll[counted]
        peak_roll = math.degrees(float(turned[int(np.argmax(np.abs(turned)))]))
        rates = rate[counted]
        return RollMotion(
            share=float(share[best]),
            low=min(bounds),
            high=max(bounds),
            time=float(stamps[counted][best]),
            peak_rate_deg_s=math.degrees(float(rates[int(np.argmax(np.abs(rates)))])),
            peak_roll_deg=peak_roll,
            quarter_turns=int(abs(peak_roll) // 90.0),
        )


#: A passenger car.
PASSENGER_CAR = TippingBody()


#: Crash types by direction of force, clockwise, each from its border to the next,
#: deg: three hours of the clock of SAE J224 each, front 11 to 1, right 2 to 4, rear 5 to 7, left
#: 8 to 10. They refer to the direction of force; the damaged side (SAE J224, column 3) may
#: differ.
BORDERS: dict[str, tuple[float, float]] = {
    "front": (-45.0, 45.0),
    "right": (45.0, 135.0),
    "rear": (135.0, 225.0),
    "left": (-135.0, -45.0),
}
UNDETERMINED = "undetermined"
ROLLOVER = "rollover"


@dataclass(frozen=True)
class CrashType:
    """Type of one event, and its margin to the next type.

    `name` is ``front``, ``right``, ``rear``, ``left``, ``rollover``, or ``undetermined`` where a 95
    % bound, of the direction of force or of tipping over, spans a border; `side` is from the
    estimated direction alone. `interval`: 95 % of the horizontal direction, None without a
    covariance. `margin_deg` to the border of `next_type`. `roll` is None without rates. `reasons`:
    what decided, and what could not be decided.
    """

    name: str
    side: str
    direction: Pdof
    interval: AngleInterval | None
    margin_deg: float
    next_type: str
    roll: RollMotion | None
    reasons: tuple[Finding, ...]


def side_of(horizontal_deg: float) -> tuple[str, float, str]:
    """Type by direction, deg clockwise from the front, margin to the border, type beyond it.

    A direction on a border belongs to the type clockwise from the border.
    """
    names = list(BORDERS)
    quarter, within = divmod(horizontal_deg + 45.0, 90.0)
    k = int(quarter) % 4
    if within < 45.0:
        return names[k], within, names[(k - 1) % 4]
    return names[k], 90.0 - within, names[(k + 1) % 4]


def classify_crash(
    change: DeltaV | ArrayLike,
    covariance: ArrayLike | None = None,
    *,
    roll: RollRecord | None = None,
    since: float | None = None,
    body: TippingBody = PASSENGER_CAR,
) -> CrashType:
    """Classify one event.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        Of the whole event, along vehicle axes or those of the impact.
    covariance : array_like, (3, 3), m²/s², optional
        Of its error.
    roll : RollRecord, optional
        A rollover continues after its event: all samples up to the next event.
    since : float, s, optional
        Time zero of the event, from which on the roll counts; by default from its first sample.
    body : TippingBody
        Dimensions of the vehicle.

    Returns
    -------
    CrashType
        'rollover' takes precedence over the side of the impact. 'undetermined' where the 95 %
        bound of the deciding quantity spans both types.

    Raises
    ------
    DataError
        As `pdof` and `pdof_interval`, or the roll rates are not valid.
    """
    direction = pdof(change)
    side, margin, beyond = side_of(direction.horizontal_deg)
    interval = None if covariance is None else pdof_interval(change, covariance).horizontal
    motion = None if roll is None else body.roll_motion(roll, since=since)
    name, code, data = _decide(side, margin, beyond, interval, motion)
    reasons = [Finding(code, severity="note", quantity="crash type", **data)]
    if motion is None:
        reasons.append(Finding("crash.type-no-roll", severity="note", quantity="crash type"))
    return CrashType(name, side, direction, interval, margin, beyond, motion, tuple(reasons))


def _decide(
    side: str, margin: float, beyond: str, interval: AngleInterval | None, roll: RollMotion | None
) -> tuple[str, str, dict[str, Any]]:
    """Type, and code and data of what decided."""
    if roll is not None and roll.low >= 1.0:
        return ROLLOVER, "crash.type-rolled", {"share": roll.share, "low": roll.low}
    if roll is not None and roll.high >= 1.0:
        data = {"low": roll.low, "high": roll.high}
        return UNDETERMINED, "crash.type-rollover-not-known", data
    if interval is None:
        return side, "crash.type-without-bound", {"margin": margin, "beyond": beyond}
    if interval.undetermined:
        return UNDETERMINED, "crash.type-within-uncertainty", {}
    ends = {side_of(interval.low_deg)[0], side_of(interval.high_deg)[0]}
    bound = {"low": interval.low_deg, "high": interval.high_deg, "beyond": beyond}
    if ends != {side} or interval.width_deg > 90.0:
        return UNDETERMINED, "crash.type-across-border", bound | {"side": side}
    return side, "crash.type-by-direction", bound | {"margin": margin}


def classify_crashes(
    changes: Sequence[DeltaV],
    covariances: Sequence[ArrayLike] | None = None,
    *,
    events: Sequence[CrashEvent],
    roll: RollRecord | None = None,
) -> tuple[CrashType, ...]:
    """Classify each event of a record: changes and covariances, one per event in order of time.

    The roll before an event is carried over to it, and each event uses the roll from its own time
    zero to that of the next. `ConfigError`: the number of changes or covariances differs from that
    of events.
    """
    if len(changes) != len(events) or (covariances is not None and len(covariances) != len(events)):
        raise ConfigError(
            "crash.changes-velocity-events",
            quantity="delta-V",
            count=len(changes),
            count_2=len(events),
        )
    ends = [event.time_zero for event in events[1:]] + [math.inf]
    types = []
    for k, event in enumerate(events):
        own = roll
        if roll is not None:
            stamps = np.asarray(roll.time, dtype=np.float64)
            within = stamps <= ends[k]
            own = replace(roll, time=stamps[within], rate=np.asarray(roll.rate)[within])
        covariance = None if covariances is None else covariances[k]
        types.append(classify_crash(changes[k], covariance, roll=own, since=event.time_zero))
    return tuple(types)
