"""Attitude and the lowest range's bias from the specific force before a crash."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.levelling import level
from strapdown.crash.acceleration import force_at_rest
from strapdown.errors import DataError
from strapdown.results.rests import RestStretch
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.prepared_unit import Levelling
from strapdown.sensors.triad_uncertainty import TriadUncertainty
from strapdown.sensors.unit_checks import UnitArrays
from strapdown.tables import ACCEL

Array = NDArray[np.float64]

__all__ = ["from_stated_attitude", "gravity_correction", "level_at_rest", "with_gravity"]


def level_at_rest(rest: RestStretch, unknown: float, gravity: float, source: str) -> Levelling:
    """Roll and pitch from the mean specific force, with the sd that its noise leaves.

    Parameters
    ----------
    rest : RestStretch
        In vehicle axes.
    unknown : float, m/s²
        Standard deviation of the vehicle's own acceleration over it, each axis.
    gravity : float, m/s²
    source : str
        For messages.

    Returns
    -------
    Levelling
        Its sd is that of the worse of the two angles: an acceleration error e across the
        specific force turns it by ``e / g`` (roll: over ``cos(pitch)``).

    Raises
    ------
    DataError
        The length is not within 20 % of gravity.
    """
    assert rest.accel_mean is not None and rest.accel_mean_sd is not None
    try:
        roll, pitch = level(rest.accel_mean)
    except DataError as error:
        raise DataError(
            "crash.rest-not-level",
            file=source,
            quantity="levelling",
            reason=error.finding,
            start=rest.start,
            end=rest.end,
        ) from None
    across = math.hypot(max(rest.accel_mean_sd), unknown) / gravity
    sd = math.degrees(across / max(math.cos(math.radians(pitch)), 1e-3))
    return Levelling(roll, pitch, sd, from_rest=True)


def from_stated_attitude(
    stated: tuple[float, float, float],
    rest: RestStretch | None,
    bias_sd: Array,
    unknown: float,
    gravity: float,
) -> tuple[Levelling, Array | None]:
    """Bias of the lowest range from gravity in a stated attitude.

    Parameters
    ----------
    stated : (roll, pitch, sd), deg
    rest : RestStretch, optional
        In vehicle axes.
    bias_sd : ndarray, (3,), m/s²
        Stated sd of the lowest range's bias, vehicle axes.
    unknown : float, m/s²
        As `level_at_rest`.
    gravity : float, m/s²

    Returns
    -------
    levelling : Levelling
    shift : ndarray, (3,), m/s², or None
        What the lowest range reads at rest less what gravity gives in that attitude; None where
        there is no rest, or where the stated bias is known better than ``g`` times the sd of
        the attitude.
    """
    roll, pitch, sd = stated
    levelling = Levelling(float(roll), float(pitch), float(sd), from_rest=False)
    if rest is None or rest.accel_mean is None or rest.accel_mean_sd is None:
        return levelling, None
    known = math.hypot(gravity * math.radians(sd), unknown, max(rest.accel_mean_sd))
    if known >= float(bias_sd.max()):
        return levelling, None
    return levelling, np.asarray(rest.accel_mean) - force_at_rest(roll, pitch, gravity)


def with_gravity(
    unit: CrashUnit,
    data: UnitArrays,
    levelling: tuple[float, float, float] | None,
    gravity: float,
) -> UnitArrays:
    """Put gravity's part on the axes that are assumed.

    Parameters
    ----------
    unit : CrashUnit
        Whose triads say which axes those are.
    data : UnitArrays
        Its numbers, sensor axes.
    levelling : (roll, pitch, sd), deg, optional
        Of the vehicle at rest.
    gravity : float, m/s²

    Raises
    ------
    DataError
        There is such an axis, and no levelling is stated: accelerometers along two axes do not
        tell how a vehicle stands.
    """
    absent = list(unit.accelerometers[0].absent)
    if not absent:
        return data
    if levelling is None:
        missing = " and no ".join(ACCEL[k] for k in absent)
        raise DataError(
            "crash.no-without-three-axes-attitude",
            file=unit.name,
            quantity="levelling",
            missing=missing,
        )
    at_rest = force_at_rest(levelling[0], levelling[1], gravity) @ unit.mounting.C_vs
    filled = tuple(y.copy() for y in data.accelerometers)
    for y in filled:
        y[:, absent] = at_rest[absent]
    return replace(data, accelerometers=filled)


def gravity_correction(
    rest: RestStretch, uncertainty: TriadUncertainty, unknown: float, gravity: float
) -> tuple[float, Array] | None:
    """What makes the specific force at rest as long as gravity.

    Parameters
    ----------
    rest : RestStretch
        In vehicle axes.
    uncertainty : TriadUncertainty
        Of the lowest range.
    unknown : float, m/s²
        As `level_at_rest`.
    gravity : float, m/s²

    Returns
    -------
    correction : float, m/s²
        To be added along the direction.
    direction : ndarray, (3,)
        Of the mean specific force, vehicle axes.

    Notes
    -----
    It takes off the bias along the vertical, and what the scale factor makes of gravity, while
    the body does not turn. None over a steady stretch whose own acceleration is less known than
    that bias and scale.
    """
    assert rest.accel_mean is not None
    mean = np.asarray(rest.accel_mean)
    length = float(np.linalg.norm(mean))
    own = math.hypot(max(uncertainty.axis("bias")), gravity * max(uncertainty.axis("scale")))
    if unknown > 0.0 and unknown >= own:
        return None
    return gravity - length, mean / length
