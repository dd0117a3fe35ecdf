"""What an alignment found, in sentences; terminal and page say the same."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
from strapdown.estimation.resting_sensors import resting_sd
from strapdown.report.crash_values import GAP, about, plain
from strapdown.report.document import KeyFigure
from strapdown.rotation import within_half_turn
from strapdown.systems.alignment_readiness import reference_offset
from strapdown.systems.alignment_run import AlignmentResult
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION
from strapdown.tables.checks import values_of

__all__ = [
    "Trust",
    "angle_bound",
    "answer_error",
    "headline",
    "key_figures",
    "limits",
    "prior_sd",
    "small",
    "trust",
]

Array = NDArray[np.float64]

ORDER = (2, 1, 0)  # heading first: it is the one that is hard
MOST_SAID = 2  # of what speaks against an answer, in one sentence
WORDS = {
    "trusted": "It can be trusted",
    "reserve": "It can be used with reserve",
    "distrusted": "It should not be trusted",
}


@dataclass(frozen=True)
class Trust:
    """Whether the answer can be trusted, and why.

    Attributes
    ----------
    verdict : {'trusted', 'reserve', 'distrusted'}
    reasons : tuple of (bool, str)
        What speaks for it, and what against.
    short : str
        What speaks for it, in a few words.
    """

    verdict: str
    reasons: tuple[tuple[bool, str], ...]
    short: str = ""

    @property
    def sentence(self) -> str:
        """The verdict in words, with what speaks against it."""
        against = [why for good, why in self.reasons if not good]
        said = WORDS[self.verdict]
        if against:
            more = len(against) - MOST_SAID
            rest = f"; and {more} more, under 'The answer'" if more > 0 else ""
            return f"{said}: {'; '.join(against[:MOST_SAID])}{rest}."
        return f"{said}: {self.short}." if self.short else f"{said}."


def angle_bound(alignment: Alignment, which: int) -> str:
    """An angle with its bound: ``90.60° ± 0.12°``."""
    value = float(alignment.roll_pitch_heading[which])
    half = TWO_SIDED_95 * float(alignment.sd_deg[which])
    if which == 2:
        value %= 360.0
    return about(value, half, "°")


def headline(result: AlignmentResult) -> str:
    """Return the answer in one sentence."""
    end = result.end
    angles = ", ".join(f"{EULER[k]} {angle_bound(end, k)}" for k in ORDER)
    return f"{angles[0].upper()}{angles[1:]} at {end.time:.6g} s (bounds of 95 %)."


def key_figures(result: AlignmentResult) -> tuple[KeyFigure, ...]:
    """Return the numbers of the top of the page."""
    out = []
    for k in ORDER:
        half = TWO_SIDED_95 * float(result.end.sd_deg[k])
        out.append(
            KeyFigure(
                EULER[k].capitalize(),
                angle_bound(result.end, k),
                f"95{GAP}% bound; standard deviation {plain(half / TWO_SIDED_95, _places(half))}°",
                f"at the end; at the start {angle_bound(result.start, k)}",
            )
        )
    return tuple(out)


def _places(half: float) -> int:
    return min(5, max(1, 2 - math.floor(math.log10(half)))) if half > 0 else 2


def answer_error(result: AlignmentResult) -> tuple[str, Array, float] | None:
    """What the answer is off from the truth or from a reference, deg, with the reference's sd.

    Returns
    -------
    tuple or None
        ``truth`` or the reference's name; roll, pitch, heading; standard deviation in deg.
    """
    if result.source.truth is not None:
        known = result.source.truth
        row = int(np.argmin(np.abs(known.index.to_numpy() - result.end.time)))
        off = result.end.roll_pitch_heading - values_of(known, EULER)[row]
        return "the truth", np.asarray(within_half_turn(off)), 0.0
    stated = result.spec.reference
    if stated is None:
        return None
    off = reference_offset(result.attitude, stated)
    return stated.source or "the reference", off, stated.sd_deg


def trust(result: AlignmentResult) -> Trust:
    """Judge the answer by what its own record says against it."""
    reasons: list[tuple[bool, str]] = []
    known = answer_error(result)
    sd = result.end.sd_deg
    if known is not None:
        name, off, own = known
        bound = TWO_SIDED_95 * np.hypot(sd, own)
        for k in ORDER:
            if math.isfinite(off[k]):
                good = bool(abs(off[k]) <= 3.0 / TWO_SIDED_95 * bound[k])
                within = "within" if abs(off[k]) <= bound[k] else "beyond"
                reasons.append(
                    (
                        good,
                        f"the {EULER[k]} is {small(off[k])}° from {name}, {within} its bound of "
                        f"{small(bound[k])}°",
                    )
                )
    reasons += _agreement(result)
    reasons += _surprises(result)
    told = [*result.coarse.findings, *(() if result.fine is None else result.fine.findings)]
    reasons += [(False, f.what.partition(": ")[0]) for f in told]
    against = [why for good, why in reasons if not good]
    verdict = "trusted" if not against else "reserve"
    if len(against) > 1 or (against and known is not None and not reasons[0][0]):
        verdict = "distrusted"
    return Trust(verdict, tuple(reasons), _short(result, known is not None))


def _short(result: AlignmentResult, known: bool) -> str:
    parts = []
    if known:
        parts.append("it is within three standard deviations of what is known from elsewhere")
    if result.fine is not None:
        parts.append("coarse and fine alignment agree")
        parts.append("at rest the sensors showed what was expected of them")
    else:
        parts.append("nothing in the record speaks against it; no fine alignment confirms it")
    return ", and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]


def _agreement(result: AlignmentResult) -> list[tuple[bool, str]]:
    """Coarse and fine alignment beside each other, at the end of the coarse one."""
    if result.fine is None:
        return []
    time = result.attitude.index.to_numpy()
    row = int(np.argmin(np.abs(time - result.coarse.time)))
    here = values_of(result.attitude, EULER)[row]
    off = within_half_turn(result.coarse.roll_pitch_heading - here)
    bound = TWO_SIDED_95 * np.hypot(result.coarse.sd_deg, result.end.sd_deg)
    out = []
    for k in ORDER:
        good = bool(abs(off[k]) <= bound[k])
        word = "agree" if good else "do not agree"
        out.append(
            (
                good,
                f"coarse and fine alignment {word} in {EULER[k]}: they differ by "
                f"{small(off[k])}°, and may by {small(bound[k])}°",
            )
        )
    return out


def _surprises(result: AlignmentResult) -> list[tuple[bool, str]]:
    """Whether the innovations of the fine alignment are as large as they were expected."""
    if result.fine is None:
        return []
    out = []
    for name, table in result.fine.innovations.items():
        labels = [c.removeprefix("nu ") for c in table.columns if c.startswith("nu ")]
        ratios = [float(np.sqrt(np.mean(table[f"nu {x}"] ** 2 / table[f"s {x}"]))) for x in labels]
        worst = max(ratios, default=0.0)
        good = worst < 2.0
        said = "as large as expected" if good else "larger than expected"
        out.append(
            (
                good,
                f"the {name} at rest is {said}: {worst:.2g} of its standard deviation "
                "(root mean square, worst axis)",
            )
        )
    return out


def limits(result: AlignmentResult) -> tuple[tuple[str, str], ...]:
    """Return what limits the answer, and what would help."""
    out: list[tuple[str, str]] = []
    site = result.site
    gyro, accel = prior_sd(result)
    c_nb = _mean_attitude(result)
    across = abs(float(site.earth_rate[0]))
    east = float(np.linalg.norm(c_nb[1] * gyro))
    part = math.degrees(east / across) if across > 0 else math.inf
    heading = float(result.end.sd_deg[2])
    told = (
        f"{small(east * DEG_PER_HOUR)} deg/h too much about east, one standard deviation of bias, "
        f"scale and misalignment, are "
        f"{small(part)}° of heading at this latitude; all of the heading's standard deviation is "
        f"{small(heading)}°"
    )
    if part > 0.7 * heading:
        why = "longer alignment at the same attitude does not help; better or calibrated gyros do"
        out.append(("The bias of the gyros limits the heading", f"{told}: {why}."))
    else:
        why = "a longer or quieter alignment helps"
        out.append(("Noise and motion limit the heading", f"{told}: {why}."))
    g = float(np.linalg.norm(site.gravity))
    level = c_nb[:2] * accel
    tilt = float(np.linalg.norm(level, axis=1).max())
    out.append(
        (
            "The bias of the accelerometers limits roll and pitch",
            f"{tilt * MICRO_G:.3g} µg too much, one standard deviation of bias, scale and "
            f"misalignment, are {small(math.degrees(tilt / g))}° of tilt; at one attitude no "
            "alignment can tell them apart.",
        )
    )
    return tuple(out)


def prior_sd(result: AlignmentResult) -> tuple[Array, Array]:
    """What gyros and accelerometers may read too much here, before anything is estimated."""
    rate, force = (values_of(result.imu, columns).mean(axis=0) for columns in (GYRO, ACCEL))
    return resting_sd(result.sensors, rate, force)


def _mean_attitude(result: AlignmentResult) -> Array:
    middle = values_of(result.attitude, QUATERNION)[len(result.attitude) // 2]
    return rotation.dcm_from_quaternion(middle)


def small(value: float) -> str:
    """Two digits of a small number."""
    size = abs(value)
    if not math.isfinite(size):
        return "–"
    places = 2 if size == 0 else min(5, max(1, 1 - math.floor(math.log10(size))))
    return plain(value, places)
