"""Which bias leads when, from what the catalogue says of sensors."""

from __future__ import annotations

import numpy as np

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    amount,
)
from strapdown.constants import STANDARD_GRAVITY
from strapdown.sensors import SENSORS, load_sensor

EARTH_RATE = 15.041 / 3600.0  # deg/s, relative to the stars


def crossovers() -> dict[str, float]:
    """Return for each sensor with both triads the time in s from which its gyro's bias leads.

    Returns
    -------
    dict
        ``3 b_a / (g b_g)``, where ``b_a t²/2 = g b_g t³/6``, with typical biases: the standard
        deviation of the sheet, or its bound over √3.
    """
    found = {}
    for name in SENSORS:
        spreads = load_sensor(name).spreads
        if "bias" in spreads.get("gyro", {}) and "bias" in spreads.get("accel", {}):
            gyro, accel = (
                spreads[t]["bias"].size[0] / (1.0 if spreads[t]["bias"].kind == "sd" else 3**0.5)
                for t in ("gyro", "accel")
            )
            if gyro > 0.0:
                found[name] = float(3.0 * accel / (STANDARD_GRAVITY * gyro))
    return found


def gyro_biases() -> dict[str, float]:
    """Return the typical gyro bias of each sensor for phones, deg/s."""
    found = {}
    for name in SENSORS:
        sensor = load_sensor(name)
        if sensor.grade == "phone" and "bias" in sensor.spreads.get("gyro", {}):
            spread = sensor.spreads["gyro"]["bias"]
            typical = spread.size[0] / (1.0 if spread.kind == "sd" else 3**0.5)
            found[name] = float(np.degrees(typical))
    return found


def gyros_lead(times: dict[str, float]) -> Statement:
    """Judge that gyros matter more, from the time in s at which each sensor's gyro leads."""
    longest = max(times, key=lambda name: times[name])
    shortest = min(times, key=lambda name: times[name])
    median = float(np.median(list(times.values())))
    if times[longest] <= 0.0:
        verdict, condition = HOLDS, ""
    elif np.isfinite(times[longest]):
        verdict = HOLDS_WHEN
        condition = "the time is longer than 3 δa / (g δφ), which each sensor has of its own"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "gyros-lead",
        "Section 1",
        "the errors in gyros and respectively in determining the attitude influence much more the "
        "final result of the navigation in comparison with the errors in accelerometers",
        verdict,
        condition,
        f"δa t²/2 leads first, g δφ t³/6 later. For the biases of {len(times)} sensors of the "
        "catalogue, uncalibrated, the time at which the gyro takes the lead:",
        (
            Evidence(f"shortest, {shortest}", times[shortest], "s"),
            Evidence("median", median, "s"),
            Evidence(f"longest, {longest}", times[longest], "s"),
        ),
        "growth",
    )


def earth_rate_small(biases: dict[str, float]) -> Statement:
    """Judge that the Earth's rate may be left out, from gyro biases in deg/s."""
    least = min(biases, key=lambda name: biases[name])
    ratio = biases[least] / EARTH_RATE
    minutes = 1.0 / EARTH_RATE / 60.0
    if ratio > 10.0:
        verdict = HOLDS_WHEN
        condition = (
            f"the bias is that of the sheet; a run of {minutes:.0f} minutes or more with the bias "
            "taken off is 1° or more off by the Earth alone"
        )
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "earth-rate",
        "Section 3",
        "Because of the fact, that the low accuracy gyro sensors are considered, the expressions "
        "for world rotation and the influence of linear velocity onto the measured turn rate are "
        "excluded.",
        verdict,
        condition,
        "The Earth turns by 15° an hour. The least typical bias of a phone's gyro in the catalogue "
        f"({least}) is {amount(ratio)} times that.",
        (
            Evidence("the Earth", EARTH_RATE, "°/s"),
            Evidence(f"least typical bias, {least}", biases[least], "°/s"),
            Evidence("time for 1° by the Earth", minutes, "min"),
        ),
    )
