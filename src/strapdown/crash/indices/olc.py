"""Occupant load criterion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.indices.pulse import checked, cubic, first_reach, from_start, integrals
from strapdown.errors import ConfigError, Finding

__all__ = ["Olc", "olc"]

FREE, WHOLE = 0.065, 0.300  # m


@dataclass(frozen=True)
class Olc:
    """Occupant load criterion of a pulse.

    Attributes
    ----------
    value_g : float or None
        Deceleration of the ideally restrained occupant, in g; None where the pulse is too weak.
    restraint_from, restraint_to : float, s, or None
        Instants, from the start, between which the restraint acts.
    findings : tuple of Finding
    """

    value_g: float | None
    restraint_from: float | None
    restraint_to: float | None
    findings: tuple[Finding, ...] = ()


def olc(
    time: ArrayLike,
    accel_x: ArrayLike,
    *,
    start: float = 0.0,
    free: float = FREE,
    whole: float = WHOLE,
) -> Olc:
    """Constant deceleration of an occupant who first flies freely and is then ideally restrained.

    Parameters
    ----------
    time : array_like, (n,), s
    accel_x : array_like, (n,), m/s²
        Forward acceleration of the vehicle, of class CFC 180; negative in a frontal impact.
    start : float, s
        First contact.
    free, whole : float, m
        Travel of the occupant relative to the vehicle before the restraint acts, and in total.

    Returns
    -------
    Olc

    Raises
    ------
    DataError
        As `pulse.checked`; `start` is not in the record.
    ConfigError
        The travels do not satisfy ``0 <= free < whole``.

    Notes
    -----
    With ``u`` the velocity that the vehicle has lost and ``d`` its integral: the restraint acts
    from t1, where ``d = 65 mm``, and decelerates the occupant uniformly to the vehicle's velocity
    at t2, where the occupant has moved by 300 mm in all: ``d(t2) - u(t2) (t2 - t1)/2 = 300 mm``.
    The criterion is ``u(t2)/(t2 - t1)``. Euro NCAP Technical Bulletin TB 027, v1.1.1, as the
    manual of T/HIS 22.1 describes it (page "Occupant Load Criterion"; the 0.0235 m printed there
    is 0.300 - 0.065 = 0.235 m). Exact for acceleration that is linear between samples.
    """
    if not (math.isfinite(whole) and 0.0 <= free < whole):
        raise ConfigError(
            "crash.olc-ways-out-of-order", quantity="free, whole", free=free, whole=whole
        )
    t, a = from_start(*checked(time, accel_x, None, "accel_x"), start, "start")
    lost, ahead = integrals(t, -a)
    begin = first_reach(t, ahead, lost, free)
    if begin is None:
        return Olc(None, None, None, (_weak(float(ahead.max()), free),))
    rest = t - begin
    way = ahead - 0.5 * lost * rest
    slope = 0.5 * (lost + a * rest)
    # Before the restraint acts the formula is not valid.
    later = t > begin
    at_begin = cubic(t, ahead, lost, begin)

    knots = np.concatenate([[begin], t[later]])
    ways = np.concatenate([[at_begin[0]], way[later]])
    slopes = np.concatenate([[0.5 * at_begin[1]], slope[later]])
    end = first_reach(knots, ways, slopes, whole)
    if end is None:
        return Olc(None, begin - start, None, (_weak(float(ways.max()), whole),))
    velocity = cubic(t, ahead, lost, end)[1]
    value = velocity / (end - begin) / STANDARD_GRAVITY
    return Olc(value, begin - start, end - start)


def _weak(reached: float, needed: float) -> Finding:
    return Finding(
        "crash.occupant-moves-relative-vehicle-not", quantity="OLC", reached=reached, needed=needed
    )
