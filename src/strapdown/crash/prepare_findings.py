"""Findings on the preparation of a unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad, UnitArrays
from strapdown.sensors.range_merge import MergedRanges
from strapdown.sensors.rest import RestStretch
from strapdown.sensors.saturation import RangeLimits

Array = NDArray[np.float64]

# A number contradicts its stated value beyond this many standard deviations.
SIGMAS = 4.0
# Fraction of the range: differences from interpolation and decimation of two clipped ranges.
LEAST_STEP = 1e-3
# A record that begins less than this before the impact has no interval before it.
SHORTEST = 0.05  # s
# Limits of a stationary specific force that is in g instead of m/s².
NEAR_ONE = (0.8, 1.2)


def rest_findings(
    unit: CrashUnit,
    time: Array,
    impact: float,
    rest: RestStretch | None,
    levelled: bool,
    steady_acceleration: float,
) -> list[Finding]:
    """Report a missing stationary interval, or only a steady one.

    Raises
    ------
    DataError
        There is neither, and no leveling is stated.
    """
    if rest is None:
        late = time[0] > impact - SHORTEST
        said = {"begin": time[0], "impact": impact}
        if not levelled:
            code = "crash.record-starts-in-crash" if late else "crash.no-rest"
            raise DataError(code, file=unit.name, quantity="rest", data=said)
        code = "crash.record-starts-in-crash-levelled" if late else "crash.no-rest-levelled"
        return [Finding(code, file=unit.name, quantity="rest", data=said)]
    if rest.grade == "steady":
        return [
            Finding(
                "crash.no-stationary-stretch-quiet-without",
                file=unit.name,
                quantity="rest",
                end=rest.end - rest.start,
                start=rest.start,
                steady_acceleration=steady_acceleration,
            )
        ]
    return []


def length_findings(unit: CrashUnit, rest: RestStretch, gravity: float) -> list[Finding]:
    """Report a stationary force that is in g, points down, or contradicts its stated errors.

    Raises
    ------
    DataError
        Its length is near one.
    """
    assert rest.accel_mean is not None
    mean = np.asarray(rest.accel_mean)
    length = float(np.linalg.norm(mean))
    lowest = unit.accelerometers[0]
    if NEAR_ONE[0] <= length <= NEAR_ONE[1]:
        raise DataError(
            "crash.specific-force-rest-long-gravity",
            file=f"{unit.name}, {lowest.name}",
            quantity="accel",
            length=length,
        )
    found = []
    if mean[2] > 0.5 * gravity:
        found.append(
            Finding(
                "crash.specific-force-rest-along-vehicle",
                file=f"{unit.name}, {lowest.name}",
                quantity="accel_z",
                mean=mean[2],
            )
        )
    u = lowest.uncertainty
    stated = float(np.hypot(max(u.axis("bias")), gravity * max(u.axis("scale"))))
    if stated > 0.0 and abs(length - gravity) > SIGMAS * stated and 8.0 < length < 11.6:
        found.append(
            Finding(
                "crash.specific-force-rest-long-off",
                file=f"{unit.name}, {lowest.name}",
                quantity="accel",
                length=length,
                length_2=length - gravity,
                length_3=abs(length - gravity) / stated,
                stated=stated,
            )
        )
    return found


def saturation_findings(
    unit: CrashUnit,
    data: UnitArrays,
    limits: Sequence[RangeLimits],
    gyro_limits: RangeLimits,
) -> list[Finding]:
    """Report clipping of the last range or the gyro, and ranges unlike the stated ones."""
    found = []
    last = len(limits) - 1
    for j, (triad, limit) in enumerate(zip(unit.accelerometers, limits, strict=True)):
        found += _ends(unit, triad, limit, "m/s²", "accel")
        if j == last:
            found += _clipped(unit, triad, data.time, limit, "accel")
    assert unit.gyro is not None
    found += _ends(unit, unit.gyro, gyro_limits, "rad/s", "gyro")
    found += _clipped(unit, unit.gyro, data.time, gyro_limits, "gyro")
    return found


def _ends(
    unit: CrashUnit, triad: RecordedTriad, limits: RangeLimits, u: str, quantity: str
) -> list[Finding]:
    found = []
    stated = triad.uncertainty.axis("full_scale")
    for k, axis in enumerate("xyz"):
        source = f"{unit.name}, {triad.name}"
        if limits.found[k]:
            found.append(
                Finding(
                    "crash.held-between-stated-full-scale",
                    file=source,
                    quantity=f"{quantity}_{axis}",
                    lower=limits.lower[k],
                    upper=limits.upper[k],
                    u=u,
                    stated=stated[k],
                )
            )
        if limits.beyond[k]:
            found.append(
                Finding(
                    "crash.reads-more-than-stated-full",
                    file=source,
                    quantity=f"{quantity}_{axis}",
                    stated=stated[k],
                    u=u,
                )
            )
    return found


def _clipped(
    unit: CrashUnit, triad: RecordedTriad, time: Array, limits: RangeLimits, quantity: str
) -> list[Finding]:
    found = []
    for k, axis in enumerate("xyz"):
        rows = np.flatnonzero(limits.clipped[:, k])
        if rows.size:
            found.append(
                Finding(
                    f"crash.{quantity}-clipped",
                    file=f"{unit.name}, {triad.name}",
                    quantity=f"{quantity}_{axis}",
                    count=rows.size,
                    first=time[rows[0]],
                    last=time[rows[-1]],
                )
            )
    return found


def bias_findings(
    unit: CrashUnit,
    bias: Sequence[Array],
    bias_from: Sequence[int | None],
    rest: RestStretch | None,
) -> list[Finding]:
    """Report a bias that could not be estimated, or exceeds the stated one."""
    found = []
    for j in range(1, len(bias)):
        triad = unit.accelerometers[j]
        source = f"{unit.name}, {triad.name}"
        if bias_from[j] is None:
            found.append(
                Finding(
                    "crash.bias-unknown-without-rest"
                    if rest is None
                    else "crash.bias-unknown-range-at-end",
                    file=source,
                    quantity="bias",
                    name=unit.accelerometers[j - 1].name,
                    sd=max(triad.uncertainty.axis("bias")),
                )
            )
            continue
        own = bias[j] - bias[j - 1]
        stated = np.hypot(
            triad.uncertainty.axis("bias"), unit.accelerometers[j - 1].uncertainty.axis("bias")
        )
        for k, axis in enumerate("xyz"):
            if stated[k] > 0.0 and abs(own[k]) > SIGMAS * stated[k]:
                found.append(
                    Finding(
                        "crash.bias-against-times-stated",
                        file=source,
                        quantity=f"accel_{axis}",
                        own=own[k],
                        name=unit.accelerometers[j - 1].name,
                        own_2=abs(own[k]) / stated[k],
                        stated=stated[k],
                    )
                )
    return found


def step_findings(unit: CrashUnit, merged: MergedRanges) -> list[Finding]:
    """Report ranges that differ where one takes over from the other."""
    found = []
    largest = np.abs(merged.values).max(axis=0)
    for j in range(len(merged.step)):
        low, high = unit.accelerometers[j], unit.accelerometers[j + 1]
        for k, axis in enumerate("xyz"):
            if not merged.switches[j, k]:
                continue
            level = min(low.uncertainty.axis("full_scale")[k], 1e6)
            scale = level * np.hypot(
                low.uncertainty.axis("scale")[k], high.uncertainty.axis("scale")[k]
            )
            # Each axis senses the other axes through its own two angles.
            angles = np.hypot(
                low.uncertainty.axis("misalignment")[k], high.uncertainty.axis("misalignment")[k]
            )
            aside = angles * np.hypot(*np.delete(largest, k))
            own = max(float(np.hypot(scale, aside)), LEAST_STEP * level)
            sd = float(np.hypot(merged.step_sd[j, k], own))
            if abs(merged.step[j, k]) > SIGMAS * sd:
                found.append(
                    Finding(
                        "crash.take-over-another-they-differ",
                        file=unit.name,
                        quantity=f"accel_{axis}",
                        name=low.name,
                        name_2=high.name,
                        step=merged.step[j, k],
                        switches=merged.switches[j, k],
                        step_2=abs(merged.step[j, k]) / sd,
                    )
                )
    return found
