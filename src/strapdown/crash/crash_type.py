"""Front, side, rear or rollover: by the direction of force and the rates of roll."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.delta_v import DeltaV
from strapdown.crash.events import CrashEvent
from strapdown.crash.pdof import AngleInterval, Pdof, pdof, pdof_interval
from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import as_array, check_rows, check_same_length, check_time

__all__ = [
    "BORDERS",
    "PASSENGER_CAR",
    "CrashType",
    "RollMotion",
    "TippingBody",
    "classify_crash",
    "classify_crashes",
    "side_of",
]


# Whether a roll tips a vehicle over: a rigid body about the wheels on one side.


Array = NDArray[np.float64]


@dataclass(frozen=True)
class RollMotion:
    """Roll of a vehicle, and how far it went towards tipping over.

    Attributes
    ----------
    share : float
        Largest energy of the roll over that which tips the body over; from 1 on it does.
    low, high : float
        95 % bound of `share`, from the stated errors of the rate and of the first roll.
    time : float, s
        When `share` was reached.
    peak_rate_deg_s : float, deg/s
        Signed, positive to the right.
    peak_roll_deg : float, deg
        Largest roll, signed.
    quarter_turns : int
        Whole quarter turns of `peak_roll_deg`; one or more is a rollover to NHTSA (rotation of
        90 deg or more about the longitudinal or lateral axis).
    """

    share: float
    low: float
    high: float
    time: float
    peak_rate_deg_s: float
    peak_roll_deg: float
    quarter_turns: int


@dataclass(frozen=True)
class TippingBody:
    """A rigid vehicle that tips about the wheels on one side.

    Attributes
    ----------
    half_track : float, m
    stability_factor : float
        Static stability factor: half the track over the height of the centre of mass (49 CFR
        575, NCAP). 1.41 is the sales-weighted mean of passenger cars of 2003, 1.17 of sport
        utility vehicles (NHTSA, DOT HS 809 868).
    roll_radius : float, m
        Radius of gyration about the longitudinal axis through the centre of mass.

    Raises
    ------
    ConfigError
        A dimension is not positive and finite.

    Notes
    -----
    The criterion is ours. About the wheels at the distance ``r = hypot(c, h)`` (half track,
    height) from the centre of mass, the body is at its highest at the roll ``tip = atan(c / h)``.
    It goes over that if the energy of the roll, by mass,
    ``g r (cos(tip - |roll|) - cos tip) + (k² + r²) rate² / 2``, reaches ``g r (1 - cos tip)``; the
    rate counts only while it turns away from level. Suspension, tyres and whatever still pushes
    are left out, so that a share near one is no certainty either way. A level passenger car
    needs 141 deg/s. Half track and radius of gyration are round numbers for a passenger car,
    and are ours.
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
        """Energy of a roll over that which tips the body over.

        Parameters
        ----------
        roll, rate : array_like, (n,), rad and rad/s
            From level; to the right positive.

        Returns
        -------
        ndarray, (n,)
        """
        angle, turn = np.asarray(roll, dtype=np.float64), np.asarray(rate, dtype=np.float64)
        arm = math.hypot(self.half_track, self.half_track / self.stability_factor)
        tip = math.atan(self.stability_factor)
        weight = STANDARD_GRAVITY * arm
        lifted = weight * (np.cos(np.maximum(tip - np.abs(angle), 0.0)) - math.cos(tip))
        away = angle * turn >= 0.0
        moving = np.where(away, 0.5 * (self.roll_radius**2 + arm**2) * turn**2, 0.0)
        share: Array = (lifted + moving) / (weight * (1.0 - math.cos(tip)))
        return share

    def roll_motion(
        self,
        time: ArrayLike,
        roll_rate: ArrayLike,
        *,
        start_roll_deg: float = 0.0,
        rate_sd: float = 0.0,
        start_sd_deg: float = 0.0,
        since: float | None = None,
    ) -> RollMotion:
        """Follow the roll of a record.

        Parameters
        ----------
        time, roll_rate : array_like, (n,), s and rad/s
            Rate about the forward axis, bias taken off. Its integral is the roll while the pitch
            is small: at 10 deg of pitch and 100 deg/s of yaw, 17 deg/s of roll are not seen.
        start_roll_deg : float, deg
            Roll at the first sample.
        rate_sd : float, rad/s
            Of an error of the rate that stays the same.
        start_sd_deg : float, deg
        since : float, s, optional
            What is before is followed and does not count.

        Returns
        -------
        RollMotion

        Raises
        ------
        DataError
            Stamps and rates do not go together, or nothing is left after `since`.
        """
        stamps, rate = as_array(time, None, "time"), as_array(roll_rate, None, "roll_rate")
        check_same_length(None, time=stamps, roll_rate=rate)
        check_time(stamps, None)
        check_rows(rate[:, None], ["roll_rate"], None)
        first = -math.inf if since is None else since
        counted = stamps >= first
        if not counted.any():
            raise DataError("crash.no-rate-roll", quantity="roll_rate", first=first)
        roll = math.radians(start_roll_deg) + running_integral(stamps, rate)
        share = self.energy_share(roll, rate)[counted]
        best = int(np.argmax(share))
        bounds = [float(share[best])]
        for drift in (-TWO_SIDED_95 * rate_sd, TWO_SIDED_95 * rate_sd):
            for tilt in (-TWO_SIDED_95 * start_sd_deg, TWO_SIDED_95 * start_sd_deg):
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
