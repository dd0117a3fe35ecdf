"""What is not known of a part without a data sheet: its noise from the record, the rest assumed."""

from __future__ import annotations

import math

import numpy as np

from strapdown.constants import GYRO_UNITS, STANDARD_GRAVITY
from strapdown.systems.crash_draft.impact import Impact
from strapdown.systems.crash_draft.parts import Part
from strapdown.systems.crash_draft.range_ends import RangeEnds
from strapdown.systems.crash_draft.triad_kind import FULL_SCALES, quiet_part

__all__ = ["stated_of"]

GYRO_SCALES = (90.0, 125.0, 250.0, 300.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 20000.0)
# Wide enough for an uncalibrated MEMS part: data sheets give 3 % and 2 % as bounds of the first
# two (MPU-6050 and LSM6DSO), 20 to 100 mg and 1 to 20 deg/s of zero error.
SCALE_PERCENT, MISALIGNMENT_DEG = 2.0, 1.0
BIAS_MG, BIAS_DEG_PER_S, G_SENSITIVITY = 60.0, 5.0, 0.1
# A record that was zeroed at rest has lost gravity with its bias.
ZEROED_G = 1.0
# An end is not looked for below the largest reading and this part of it.
HEADROOM = 1.01


def stated_of(
    part: Part, ends: RangeEnds, impact: Impact, finest: Part
) -> tuple[dict[str, float], str]:
    """Numbers by keys of the catalogue of sensors, and why these.

    Parameters
    ----------
    part : Part
        With values in SI.
    ends : RangeEnds
        Of it.
    impact : Impact
        Of its unit.
    finest : Part
        The accelerometer of the lowest range of the unit.
    """
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    step = float(np.median(np.diff(part.time)))
    # Of differences from sample to sample, which no motion is in.
    moved = np.diff(values[: max(quiet.count, 3)], axis=0)
    density = float(np.sqrt(np.mean(moved**2) / 2.0) * math.sqrt(step))
    reached = max(p for p in ends.peak if p == p)
    known = [e for e in ends.ends if e is not None]
    if part.kind == "rate":
        unit = GYRO_UNITS["deg/s"]
        offset = float(np.abs(quiet.mean).max()) / unit
        full = _next(max([reached * HEADROOM, *known]) / unit, GYRO_SCALES)
        numbers = {
            "noise_density_deg_per_s_per_sqrt_hz": density / unit,
            "bias_sd_deg_per_s": max(BIAS_DEG_PER_S, math.ceil(offset)),
            "scale_sd_percent": SCALE_PERCENT,
            "misalignment_sd_deg": MISALIGNMENT_DEG,
            "g_sensitivity_sd_deg_per_s_per_g": G_SENSITIVITY,
            "full_scale_deg_per_s": full,
        }
        return numbers, f"{_why()}; it rests at {offset:.2g} deg/s"
    g = STANDARD_GRAVITY
    offset = 0.0
    told = ""
    if part is not finest and len(part.axes) == 3 and not part.zeroed:
        off = quiet.mean - impact.base
        offset = float(np.abs(off).max()) / g
        told = f"; at rest it is {offset:.2g} g off the finer range, which corrects it"
    elif part.zeroed:
        offset = ZEROED_G
        told = "; it was zeroed at rest, so that gravity is in its bias"
    full = _next(max([reached * HEADROOM, *known]) / g, FULL_SCALES)
    numbers = {
        "noise_density_ug_per_sqrt_hz": density / (1e-6 * g),
        "bias_sd_mg": max(BIAS_MG, 100.0 * math.ceil(10.0 * offset)),
        "scale_sd_percent": SCALE_PERCENT,
        "misalignment_sd_deg": MISALIGNMENT_DEG,
        "full_scale_g": full,
    }
    return numbers, _why() + told


def _why() -> str:
    return (
        "wide enough for a cheap part without a calibration; the noise was found in the record, "
        "the full scale is the next usual one above what it reached"
    )


def _next(value: float, usual: tuple[float, ...]) -> float:
    return next((u for u in usual if u >= value * (1.0 - 1e-6)), float(math.ceil(value)))
