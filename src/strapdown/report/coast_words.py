"""Results of an outage prediction in words: the answer, its limiting sources, and remedies."""

from __future__ import annotations

import math

import numpy as np

from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.navigation.outage import Share
from strapdown.report.document import KeyFigure
from strapdown.report.values import (
    GAP,
    KMH,
    duration_words,
    half,
    length_words,
    plain,
    share_words,
    shown_unit,
)
from strapdown.systems.outage_run import OutageRun

_WORDS = {
    "position": "position at the start",
    "velocity": "velocity at the start",
    "tilt": "tilt at the start",
    "heading": "heading at the start",
    "gyro_noise": "gyro white noise",
    "accel_noise": "accelerometer white noise",
    "gyro_bias": "gyro bias at the start",
    "accel_bias": "accelerometer bias at the start",
    "gyro_instability": "gyro bias instability",
    "accel_instability": "accelerometer bias instability",
    "gyro_scale": "gyro scale factor",
    "accel_scale": "accelerometer scale factor",
    "gyro_misalignment": "gyro misalignment",
    "accel_misalignment": "accelerometer misalignment",
    "g_sensitivity": "gyro g-sensitivity",
}
_REMEDIES = {
    "position": "the drift is hardly more than what is not known of the place where it "
    "begins: a better place there would help",
    "velocity": "velocities by Doppler, or more fixes, before the outage would help; so would an "
    "odometer that stays",
    "tilt": "a drive with turns and changes of speed, or a standstill, shortly before the outage "
    "tells tilts from accelerometer biases; a less biased accelerometer would help more",
    "heading": "turns or changes of speed before the outage make the heading known; a second "
    "antenna or a better gyro would help more",
    "gyro_noise": "no calibration takes white noise off: a gyro with less angle random walk would "
    "help, or an aid that stays",
    "accel_noise": "no calibration takes white noise off: an accelerometer with less of it would "
    "help, or an aid that stays",
    "gyro_bias": "a standstill before the outage tells the gyro biases; else a gyro whose bias is "
    "steadier would help",
    "accel_bias": "turns and changes of speed before the outage tell accelerometer biases from "
    "tilts; else an accelerometer whose bias is smaller would help",
    "gyro_instability": "the bias changes within the outage, which nothing before it can tell: a "
    "gyro whose bias is steadier would help",
    "accel_instability": "the bias changes within the outage, which nothing before it can tell: "
    "an accelerometer whose bias is steadier would help",
    "gyro_scale": "turns to both sides before the outage, or a calibration, would tell it",
    "accel_scale": "changes of speed before the outage, or a calibration, would tell it",
    "gyro_misalignment": "a calibration of the axes would take it off",
    "accel_misalignment": "a calibration of the axes would take it off",
    "g_sensitivity": "a calibration of the gyros under tilt would take it off",
}
aids_name = "noise of the aids that stay"


def source_words(name: str) -> str:
    """Name of a drift source in words."""
    aid, dot, own = name.rpartition(".")
    if dot:
        return f"{aid}: {own.replace('_', ' ')}"
    return _WORDS.get(name, name.replace("_", " "))


def at_start(share: Share, result: OutageRun) -> str:
    """Size of an error source at the start of the outage, with its unit."""
    name = share.source.name
    triad = result.sensors.gyro if name.startswith("gyro") else result.sensors.accel
    if name.endswith("_noise"):
        density = float(np.max(triad.axis("noise_density")))
        if name.startswith("gyro"):
            return f"{_three(density * DEG_PER_HOUR / 60.0)}{GAP}deg/√h"
        return f"{_three(density * MICRO_G)}{GAP}µg/√Hz"
    if name.endswith("_instability"):
        gyro = name.startswith("gyro")
        drift = result.sensors.gyro_drift if gyro else result.sensors.accel_drift
        size = max(drift.triad)
        if not size or math.isinf(drift.correlation_time):
            return "–"
        factor, unit = shown_unit("rad/s" if gyro else "m/s²", size)
        return f"{_three(factor * size)}{GAP}{unit} over {duration_words(drift.correlation_time)}"
    if not share.sd.size:
        return "–"
    low, high = float(share.sd.min()), float(share.sd.max())
    factor, unit = shown_unit(share.source.unit, high)
    if high <= 1.2 * low:
        return f"{_three(factor * high)}{GAP}{unit}"
    return f"{_three(factor * low)} to {_three(factor * high)}{GAP}{unit}"


def _three(value: float) -> str:
    """Format a number to three digits."""
    if value == 0.0 or not math.isfinite(value):
        return "0"
    return plain(value, min(6, max(0, 2 - math.floor(math.log10(abs(value))))))


def end_bound(result: OutageRun) -> float:
    """95 % bound at the end of the outage, m; over all outage tests, if there were any."""
    bound = result.forecast.bound if result.recorded is None else result.recorded.bound
    return float(bound[-1])


def motion_words(result: OutageRun) -> str:
    """The motion in words."""
    if result.navigation is not None:
        return "along its own trajectory"
    asked = result.spec.motion
    speed, to = asked.speed_m_per_s, asked.to_speed_m_per_s
    if to is not None and to != speed:
        return f"from {_speed(speed)} to {_speed(to)}"
    if not speed:
        return "standing"
    if asked.turn_rate_deg_per_s:
        side = "right" if asked.turn_rate_deg_per_s > 0.0 else "left"
        rate = plain(abs(asked.turn_rate_deg_per_s), 1)
        return f"at {_speed(speed)}, turning {side} with {rate}{GAP}deg/s"
    return f"straight on at {_speed(speed)}"


def _speed(value: float) -> str:
    return f"{value:g}{GAP}m/s ({plain(KMH * value, 0)}{GAP}km/h)"


def start_words(result: OutageRun) -> str:
    """Knowledge of the state at the start of the outage, and its origin."""
    if result.recorded is not None:
        return "what its filter knew at each outage, with all that binds its errors"
    start, begin = result.spec.start, result.forecast.begin
    stated = [
        name.partition("_sd_")[0].replace("_", " ")
        for name in type(start).model_fields
        if "_sd_" in name and not name.startswith("fix") and getattr(start, name) is not None
    ]
    if not begin:
        text = "what an alignment leaves, and the data sheet"
    else:
        text = (
            f"what a filter knows after {duration_words(begin)} of driving with fixes of "
            f"{start.fix_position_sd_m:g}{GAP}m and {start.fix_velocity_sd_m_per_s:g}{GAP}m/s "
            "each second"
        )
    return text if not stated else f"{text}; stated: {', '.join(stated)}"


def outage_words(result: OutageRun) -> str:
    """Length of the outage: ``60 s``."""
    seconds = result.spec.outage_s
    return f"{seconds:g}{GAP}s" if seconds < 600.0 else duration_words(seconds)


def headline(result: OutageRun) -> str:
    """Return the answer in a sentence."""
    outage = outage_words(result)
    said = (
        f"after {outage} {motion_words(result)}, 95 % are within {length_words(end_bound(result))}"
    )
    if result.stays:
        said += f", with {', '.join(result.stays)}"
    return f"{result.name}: {said}"


def remedy(result: OutageRun) -> str:
    """Return the largest contributor to the drift, and its remedy."""
    found = result.forecast
    whole = float(found.variance("horizontal")[-1])
    first = found.shares[0]
    share = first.variance["horizontal"][-1] / whole
    if found.aids and float(found.aids["horizontal"][-1]) / whole > share:
        share = float(found.aids["horizontal"][-1]) / whole
        return (
            f"The largest share, {share_words(share)} of the variance, is {aids_name}: what they "
            "say is what limits it."
        )
    words = _REMEDIES.get(first.source.name, "what states it better would help")
    return (
        f"The largest share, {share_words(float(share))} of the variance, is "
        f"{source_words(first.source.name)} ({at_start(first, result)}): {words}."
    )


def inside_words(result: OutageRun) -> str:
    """Number of observed drifts within the predicted bound; empty if none were observed."""
    drifts = [] if result.recorded is None else [d for d in result.recorded.drifts if d.time.size]
    if not drifts:
        return ""
    fixes = np.concatenate([d.inside for d in drifts])
    ends = [bool(d.inside[-1]) for d in drifts]
    middle = float(np.median([d.horizontal[-1] for d in drifts]))
    worst = max(float(d.horizontal[-1]) for d in drifts)
    return (
        f"Tried at {len(drifts)} {'places' if len(drifts) > 1 else 'place'}: the drift at the end "
        f"was {length_words(middle)} in the median and {length_words(worst)} at worst; "
        f"{sum(ends)} of {len(ends)} ends and {share_words(float(fixes.mean()))} of "
        f"{len(fixes)} fixes are within their 95 %."
    )


def key_figures(result: OutageRun) -> tuple[KeyFigure, ...]:
    """Return the key figures."""
    found = result.forecast
    said = "95 % at the end"

    def sd(quantity: str) -> float:
        whole = found if result.recorded is None else result.recorded
        variance = (
            found.variance(quantity)[-1]
            if whole is found
            else result.recorded.variance[quantity][-1]  # type: ignore[union-attr]
        )
        return math.sqrt(max(float(variance), 0.0))

    figures = [
        KeyFigure("Horizontal", length_words(end_bound(result)), said),
        KeyFigure("Along the way", f"±{GAP}{length_words(half(sd('along')))}", said),
        KeyFigure("Across it", f"±{GAP}{length_words(half(sd('across')))}", said),
        KeyFigure("Vertical", f"±{GAP}{length_words(half(sd('vertical')))}", said),
        KeyFigure("Heading", f"±{GAP}{_three(math.degrees(half(sd('heading'))))}°", said),
    ]
    drifts = [] if result.recorded is None else [d for d in result.recorded.drifts if d.time.size]
    if drifts:
        fixes = np.concatenate([d.inside for d in drifts])
        figures.append(
            KeyFigure(
                "Inside 95 %",
                share_words(float(fixes.mean())),
                f"of {len(fixes)} fixes in {len(drifts)} outages",
            )
        )
    return tuple(figures)
