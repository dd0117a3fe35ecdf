"""A stated motion: a drive with fixes that makes a filter know what it can, and the outage."""

from __future__ import annotations

import math
from dataclasses import replace

from strapdown.config.coast import CoastSpec
from strapdown.errors import ConfigError
from strapdown.simulation.course import Limits, Manoeuvre
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.manoeuvres import Accelerate, Straight, Turn
from strapdown.simulation.vehicles import car

__all__ = ["stated_motion"]

#: Of the drive with fixes: m/s, mean m/s² of a change of speed, m.
SPEED, GENTLE, RADIUS = 12.0, 1.0, 25.0
#: How long it goes on with its speed before the outage, at least, s.
SETTLING = 12.0
#: A turn comes and goes over it, s.
RAMP = 1.0
#: No more is asked of a stated motion than a fast aircraft does, m/s².
LIMITS = Limits(acceleration=100.0, lateral=100.0, climb_deg=20.0)


def stated_motion(spec: CoastSpec) -> tuple[EarthMotion, float]:
    """Return the motion of a forecast, and when the outage begins.

    Before it, for `aided_s`, a car goes round blocks to the left and to the right, with changes of
    speed: what makes heading, tilts and biases known. It ends with the heading that the outage
    begins with.

    Parameters
    ----------
    spec : CoastSpec

    Returns
    -------
    motion : EarthMotion
    begin : float, s

    Raises
    ------
    ConfigError
        The motion asks for more than 100 m/s².
    """
    asked, outage = spec.motion, spec.outage_s
    before, begin = _drive(spec.start.aided_s, asked.speed_m_per_s)
    motion = car(
        Origin(asked.lat_deg, 10.0, 100.0),
        [(f"drive {k + 1}", one) for k, one in enumerate([*before, *_coasting(spec)])],
        heading_deg=asked.heading_deg,
        speed=0.0 if before else asked.speed_m_per_s,
        limits=LIMITS,
    )
    return replace(motion, duration=begin + outage), begin


def _drive(length: float, speed: float) -> tuple[list[Manoeuvre], float]:
    """What is done before, and how long it takes; nothing, if it is not to be."""
    if length == 0.0:
        return [], 0.0
    turn = math.radians(90.0) * RADIUS / SPEED + RAMP
    block: list[tuple[Manoeuvre, float]] = []
    for sign in (1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0):
        block += [
            (Straight(6.0), 6.0),
            (Accelerate(0.5 * SPEED, 6.0), 6.0),
            (Accelerate(SPEED, 6.0), 6.0),
            (Turn(sign * 90.0, RADIUS, RAMP), turn),
        ]
    round_ = sum(t for _, t in block)
    done: list[tuple[Manoeuvre, float]] = [
        (Straight(5.0), 5.0),
        (Accelerate(SPEED, 12.0), 12.0),
    ]
    change = max(abs(speed - SPEED) / GENTLE, 1.0)
    rounds = max(1, round((length - 30.0 - change) / round_))
    done += block * rounds
    done += [(Accelerate(speed, change), change)]
    # Whole seconds, so that samples and fixes fall on the begin of the outage.
    took = sum(t for _, t in done)
    whole = math.ceil(took + SETTLING)
    return [*(one for one, _ in done), Straight(whole - took)], float(whole)


def _coasting(spec: CoastSpec) -> list[Manoeuvre]:
    """What is done in the outage."""
    asked, outage = spec.motion, spec.outage_s
    speed, rate = asked.speed_m_per_s, asked.turn_rate_deg_per_s
    to = asked.to_speed_m_per_s
    if rate != 0.0:
        if speed == 0.0 or to is not None:
            raise ConfigError(
                "outage.turn-goes-speed-above-zero"
                if to is not None
                else "outage.body-stands-makes-no-turn",
                quantity="--turn-rate",
            )
        if speed * abs(math.radians(rate)) > LIMITS.lateral:
            most = math.degrees(LIMITS.lateral / speed)
            raise ConfigError(
                "outage.take-more-than-side",
                quantity="--turn-rate",
                rate=rate,
                speed=speed,
                lateral=LIMITS.lateral,
                most=most,
            )
        # With its ramps the turn is as long as the outage, and a second more.
        radius = speed / abs(math.radians(rate))
        return [Turn(rate * outage, radius, RAMP)]
    if to is not None and to != speed:
        least = 15.0 / 8.0 * abs(to - speed) / LIMITS.acceleration
        if outage < least:
            raise ConfigError(
                "outage.takes-more-than",
                quantity="--to-speed",
                speed=speed,
                to=to,
                outage=outage,
                acceleration=LIMITS.acceleration,
                least=least,
            )
        return [Accelerate(to, outage)]
    return [Straight(outage)]
