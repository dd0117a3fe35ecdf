"""Front, side, rear or rollover: by the direction of force and the rates of roll."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.delta_v import DeltaV
from strapdown.crash.pdof import Pdof, pdof
from strapdown.crash.pdof_interval import AngleInterval, pdof_interval
from strapdown.crash.tipping import PASSENGER_CAR, RollMotion, TippingBody
from strapdown.errors import ConfigError

__all__ = ["BORDERS", "CrashType", "classify_crash", "classify_crashes", "side_of"]

#: The types that a direction of force tells apart, clockwise, each from its border to the next,
#: deg: three hours of the clock of SAE J224 each, front 11 to 1, right 2 to 4, rear 5 to 7, left
#: 8 to 10. They are about the direction of force; the damaged side (SAE J224, column 3) may be
#: another.
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
    """Type of one event, and how near it is to another.

    Attributes
    ----------
    name : {'front', 'right', 'rear', 'left', 'rollover', 'undetermined'}
        'undetermined' where a bound spans a border: of the direction of force, or of tipping
        over.
    side : {'front', 'right', 'rear', 'left'}
        By the estimated direction alone.
    direction : Pdof
    interval : AngleInterval or None
        Of the horizontal direction, 95 %; None where no covariance was given.
    margin_deg : float, deg
        From the direction to the border of the next type.
    next_type : str
        What lies beyond that border.
    roll : RollMotion or None
        None where no rates were given: a rollover is then not looked for.
    reason : str
        Why, in a sentence.
    """

    name: str
    side: str
    direction: Pdof
    interval: AngleInterval | None
    margin_deg: float
    next_type: str
    roll: RollMotion | None
    reason: str


def side_of(horizontal_deg: float) -> tuple[str, float, str]:
    """Type by a direction, the distance to the nearest border, and the type beyond it.

    Parameters
    ----------
    horizontal_deg : float, deg
        The direction the force came from, clockwise from the front.

    Returns
    -------
    name : str
        A direction on a border belongs to the type clockwise of it.
    margin_deg : float, deg
    next_type : str
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
    event: CrashEvent | None = None,
    time: ArrayLike | None = None,
    roll_rate: ArrayLike | None = None,
    start_roll_deg: float = 0.0,
    roll_rate_sd: float = 0.0,
    start_roll_sd_deg: float = 0.0,
    body: TippingBody = PASSENGER_CAR,
) -> CrashType:
    """Classify one event.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        Of the whole event, along vehicle axes or those of the impact.
    covariance : array_like, (3, 3), m²/s², optional
        Of its error.
    event : CrashEvent, optional
        With the rates: roll is looked at from its time zero on. Without, over all that is given.
    time, roll_rate : array_like, (n,), s and rad/s, optional
        Rate about the forward axis (``gyro_x``, bias taken off). A rollover goes on after the
        event that began it; give what there is, up to the next event.
    start_roll_deg : float, deg
        Roll at the first of these.
    roll_rate_sd : float, rad/s
        Of an error of the rate that stays the same over the record (bias).
    start_roll_sd_deg : float, deg
    body : TippingBody
        Dimensions of the vehicle.

    Returns
    -------
    CrashType
        'rollover' goes before the side that was struck. 'undetermined' where the 95 % bound of
        what decides holds both answers.

    Raises
    ------
    ConfigError
        One of `time` and `roll_rate` is missing, or they do not go together.
    DataError
        As `pdof` and `pdof_interval`.
    """
    direction = pdof(change)
    side, margin, beyond = side_of(direction.horizontal_deg)
    interval = None if covariance is None else pdof_interval(change, covariance).horizontal
    roll = None
    if time is not None or roll_rate is not None:
        if time is None or roll_rate is None:
            raise ConfigError("crash.rates-need-their-stamps-stamps", quantity="roll_rate")
        roll = body.roll_motion(
            time,
            roll_rate,
            start_roll_deg=start_roll_deg,
            rate_sd=roll_rate_sd,
            start_sd_deg=start_roll_sd_deg,
            since=None if event is None else event.time_zero,
        )
    name, reason = _decide(side, margin, beyond, interval, roll)
    return CrashType(name, side, direction, interval, margin, beyond, roll, reason)


def _decide(
    side: str, margin: float, beyond: str, interval: AngleInterval | None, roll: RollMotion | None
) -> tuple[str, str]:
    if roll is not None and roll.low >= 1.0:
        return ROLLOVER, (
            f"the roll reached {roll.share:.2f} times what tips it over (at least {roll.low:.2f})"
        )
    if roll is not None and roll.high >= 1.0:
        return UNDETERMINED, (
            f"whether it rolls over is not known: the roll reached {roll.low:.2f} to "
            f"{roll.high:.2f} times what tips it over"
        )
    if interval is None:
        return side, f"the direction is {margin:.1f} deg from '{beyond}'; its bound was not given"
    if interval.undetermined:
        return UNDETERMINED, "the change of velocity is not larger than its uncertainty"
    ends = {side_of(interval.low_deg)[0], side_of(interval.high_deg)[0]}
    if ends != {side} or interval.width_deg > 90.0:
        return UNDETERMINED, (
            f"the direction lies between {interval.low_deg:.1f} and {interval.high_deg:.1f} deg, "
            f"across the border of '{side}' to '{beyond}'"
        )
    return side, (
        f"the direction is {margin:.1f} deg from '{beyond}', its bound "
        f"{interval.low_deg:.1f} to {interval.high_deg:.1f} deg"
    )


def classify_crashes(
    changes: Sequence[DeltaV],
    covariances: Sequence[ArrayLike] | None = None,
    *,
    events: Sequence[CrashEvent],
    time: ArrayLike | None = None,
    roll_rate: ArrayLike | None = None,
    start_roll_deg: float = 0.0,
    roll_rate_sd: float = 0.0,
    start_roll_sd_deg: float = 0.0,
    body: TippingBody = PASSENGER_CAR,
) -> tuple[CrashType, ...]:
    """Classify each event of a record.

    Parameters
    ----------
    changes : sequence of DeltaV
        One an event.
    covariances : sequence of array_like, (3, 3), m²/s², optional
        One an event.
    events : sequence of CrashEvent
        In order of time.
    time, roll_rate, start_roll_deg, roll_rate_sd, start_roll_sd_deg, body
        As `classify_crash`, over the whole record. The roll before an event is carried over to
        it; each looks at the roll from its own time zero to that of the next.

    Returns
    -------
    tuple of CrashType
        One an event.

    Raises
    ------
    ConfigError
        There is not one change (and covariance) an event; or as `classify_crash`.
    DataError
        As `classify_crash`.
    """
    if len(changes) != len(events) or (covariances is not None and len(covariances) != len(events)):
        raise ConfigError(
            "crash.changes-velocity-events",
            quantity="delta-V",
            count=len(changes),
            count_2=len(events),
        )
    types = []
    for k, event in enumerate(events):
        stamps, rates = time, roll_rate
        if time is not None and roll_rate is not None and k + 1 < len(events):
            stamps, rates = np.asarray(time, dtype=np.float64), np.asarray(roll_rate)
            own = stamps <= events[k + 1].time_zero
            stamps, rates = stamps[own], rates[own]
        types.append(
            classify_crash(
                changes[k],
                None if covariances is None else covariances[k],
                event=event,
                time=stamps,
                roll_rate=rates,
                start_roll_deg=start_roll_deg,
                roll_rate_sd=roll_rate_sd,
                start_roll_sd_deg=start_roll_sd_deg,
                body=body,
            )
        )
    return tuple(types)
