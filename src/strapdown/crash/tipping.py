"""Whether a roll tips a vehicle over: a rigid body about the wheels on one side."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import as_array, check_rows, check_same_length, check_time

Array = NDArray[np.float64]

__all__ = ["PASSENGER_CAR", "RollMotion", "TippingBody"]


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
