"""What an alignment found, in sentences; terminal and page say the same."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import DEG_PER_HOUR, TWO_SIDED_95
from strapdown.estimation.resting_sensors import resting_sd
from strapdown.report.alignment_trust import ORDER, bounds_hold
from strapdown.report.alignment_values import (
    NOT_KNOWN,
    angle_bound,
    force_words,
    instant,
    rate_words,
    small,
)
from strapdown.report.crash_values import GAP, plain
from strapdown.report.document import KeyFigure
from strapdown.systems.alignment_run import AlignmentResult
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION
from strapdown.tables.checks import values_of

__all__ = ["headline", "key_figures", "limits", "prior_sd"]

Array = NDArray[np.float64]


def headline(result: AlignmentResult) -> str:
    """Return the answer in one sentence."""
    end = result.end
    angles = ", ".join(f"{EULER[k]} {angle_bound(end, k)}" for k in ORDER)
    bounds = "bounds of 95 %"
    if not bounds_hold(result):
        bounds += ", which do not hold here: the record contradicts them"
    return f"{angles[0].upper()}{angles[1:]} at {instant(end.time)} ({bounds})."


def key_figures(result: AlignmentResult) -> tuple[KeyFigure, ...]:
    """Return the numbers of the top of the page."""
    out = []
    for k in ORDER:
        said = angle_bound(result.end, k)
        out.append(
            KeyFigure(
                EULER[k].capitalize(),
                said,
                f"any of them: no bound of 95{GAP}%" if said == NOT_KNOWN else _bound_of(result, k),
                f"at the end; at the start {angle_bound(result.start, k)}",
            )
        )
    return tuple(out)


def _bound_of(result: AlignmentResult, which: int) -> str:
    if not bounds_hold(result):
        return "its bound does not hold: the record contradicts it"
    sd = float(result.end.sd_deg[which])
    return f"95{GAP}% bound; standard deviation {plain(sd, _places(TWO_SIDED_95 * sd))}°"


def _places(half: float) -> int:
    return min(5, max(1, 2 - math.floor(math.log10(half)))) if half > 0 else 2


def limits(result: AlignmentResult) -> tuple[tuple[str, str], ...]:
    """Return what limits the answer, and what would help."""
    site = result.site
    gyro, accel = prior_sd(result)
    c_nb = _mean_attitude(result)
    out = [_heading_limit(result, float(np.linalg.norm(c_nb[1] * gyro)))]
    g = float(np.linalg.norm(site.gravity))
    level = c_nb[:2] * accel
    tilt = float(np.linalg.norm(level, axis=1).max())
    out.append(
        (
            "The bias of the accelerometers limits roll and pitch",
            f"{force_words(tilt)} too much, one standard deviation of bias, scale and "
            f"misalignment, are {small(math.degrees(tilt / g))}° of tilt; at one attitude no "
            "alignment can tell them apart.",
        )
    )
    return tuple(out)


def _heading_limit(result: AlignmentResult, east: float) -> tuple[str, str]:
    """What limits the heading, for an east drift of one standard deviation, rad/s."""
    coarse, heading = result.coarse, float(result.end.sd_deg[2])
    across = float(np.linalg.norm(result.site.earth_rate[:2]))
    hidden = (
        f"the horizontal rate of the Earth is {small(across * DEG_PER_HOUR)} deg/h here, and the "
        f"gyros may read {rate_words(east)} too much (one standard deviation)"
    )
    if coarse.method == "levelling":
        return (
            "The heading was not sought",
            f"levelling finds roll and pitch alone; {hidden}: state the heading (known_heading), "
            + (
                "or find it by these gyros (inertial_frame)."
                if across > east
                else "or take it from satellite fixes while driving (gnss_course)."
            ),
        )
    if coarse.heading_given and not across > east:
        told = "satellite course" if coarse.method == "gnss_course" else "stated heading"
        return (
            f"The heading is as good as the {told}",
            f"{hidden}: they cannot find north themselves.",
        )
    part = math.degrees(east / across) if across > 0 else math.inf
    told = (
        f"{small(east * DEG_PER_HOUR)} deg/h too much about east, one standard deviation of bias, "
        f"scale and misalignment, are {small(part)}° of heading at this latitude; all of the "
        f"heading's standard deviation is {small(heading)}°"
    )
    if coarse.heading_given and heading < 0.7 * part:
        return ("What was stated of the heading limits it", f"{told}: state it better.")
    if part > 0.7 * heading:
        why = "longer alignment at the same attitude does not help; better or calibrated gyros do"
        return ("The bias of the gyros limits the heading", f"{told}: {why}.")
    return ("Noise and motion limit the heading", f"{told}: a longer or quieter alignment helps.")


def prior_sd(result: AlignmentResult) -> tuple[Array, Array]:
    """What gyros and accelerometers may read too much here, before anything is estimated."""
    rate, force = (values_of(result.imu, columns).mean(axis=0) for columns in (GYRO, ACCEL))
    return resting_sd(result.sensors, rate, force)


def _mean_attitude(result: AlignmentResult) -> Array:
    middle = values_of(result.attitude, QUATERNION)[len(result.attitude) // 2]
    return rotation.dcm_from_quaternion(middle)
