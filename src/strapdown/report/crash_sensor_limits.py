"""What the sensors of a case limit: ranges, what is missing, rest, rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.report.crash_values import about, instant
from strapdown.sensors.prepared_unit import PreparedUnit
from strapdown.systems.crash_case import CaseResult

__all__ = ["assumed", "borrowed", "clipping", "rest", "ringing"]

# A rest that is shorter leaves biases that a longer one would have told.
SHORT_REST = 2.0  # s
# Below this rate a structure that rings is not integrated: a quarter of the rate is the fastest.
RINGS = 1000.0  # Hz
AXES = ("forward", "right", "down")


def _prepared(result: CaseResult) -> Iterator[tuple[UnitReconstruction, PreparedUnit]]:
    for unit in result.reconstruction.units:
        if unit.at_point.prepared is not None:
            yield unit, unit.at_point.prepared


def clipping(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return which sensors were at the end of their range."""
    cut: dict[str, list[tuple[str, str]]] = {"accelerometer": [], "gyro": []}
    for unit, prepared in _prepared(result):
        time = unit.at_point.time
        for what, clipped in (
            ("accelerometer", prepared.clipped),
            ("gyro", prepared.gyro_clipped),
        ):
            axes = [k for k in range(3) if clipped[:, k].any()]
            if axes:
                rows = np.flatnonzero(clipped.any(axis=1))
                names = ", ".join("xyz"[k] for k in axes)
                said = (
                    f"{unit.name}: its axis {names}, {len(rows)} samples between "
                    f"{instant(time[rows[0]])} and {instant(time[rows[-1]])}"
                )
                cut[what].append((unit.name, said))
    for what, found in cut.items():
        if not found:
            continue
        follows, then = (
            ("the true delta-V is larger", "every place after it is off by what is missing")
            if what == "accelerometer"
            else ("the vehicle turned more", "what is resolved with its attitude is off")
        )
        yield (
            "clipped",
            f"{', '.join(name for name, _ in found)}: the {what} was at the end of its range, and "
            f"{follows}",
            f"{'; '.join(said for _, said in found)}; no wider range stands behind it. What was "
            f"cut off is missing, and no bound here knows how much: along that axis {follows} than "
            f"what is told here, and {then}.",
        )


def assumed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return what was not measured, once for all recorders of which the same is true."""
    told: dict[str, list[str]] = {}
    for spec in result.spec.units:
        given, parts = spec.assumed, []
        if given is None:
            continue
        span = f"between {instant(given.over_s[0])} and {instant(given.over_s[1])}"
        if given.turn_sd_deg is not None:
            parts.append(
                "There is no gyro: the vehicle is taken not to have turned, with a standard "
                f"deviation of {_each(given.turn_sd_deg, '°', 'roll, pitch and heading')} {span}."
            )
        if given.delta_v_sd_m_per_s is not None:
            missing = [
                name
                for name, column in zip(AXES, ("x", "y", "z"), strict=True)
                if all(column not in t.channels for t in spec.accelerometers)
            ]
            parts.append(
                f"There is no accelerometer along {' and '.join(missing) or 'an axis'}: nothing is "
                "taken to have changed there, with a standard deviation of "
                f"{_each(given.delta_v_sd_m_per_s, ' m/s', 'x, y and z')} {span}."
            )
        parts.append("The bounds have it; they are wrong where the assumption is.")
        if given.because:
            parts.append(f"Reason stated: {given.because.rstrip('.')}.")
        told.setdefault(" ".join(parts), []).append(spec.name)
    for text, names in told.items():
        yield "assumed", f"{', '.join(names)}: not everything was measured", text


def _each(sd: float | tuple[float, float, float], unit: str, names: str) -> str:
    """One standard deviation for all axes, or one for each."""
    if isinstance(sd, float):
        return f"{sd:g}{unit}"
    return f"{sd[0]:g}, {sd[1]:g} and {sd[2]:g}{unit} ({names})"


def rest(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return what the stretch before the crash does not tell."""
    told: dict[tuple[str, str], list[str]] = {}
    for unit, prepared in _prepared(result):
        still, level = prepared.rest, prepared.levelling
        if still is None:
            half = TWO_SIDED_95 * level.sd_deg
            said = (
                "no stationary stretch before the crash",
                f"Roll and pitch are stated, {about(level.roll_deg, half, '°')} and "
                f"{about(level.pitch_deg, half, '°')}, or carried over from another recorder; "
                "biases are as stated of the sensors.",
            )
        elif still.grade == "steady":
            said = (
                "quiet before the crash, but perhaps at speed",
                f"The stretch from {instant(still.start)} to {instant(still.end)} may have been "
                "driven; acceleration and turning over it are taken as zero with a bound.",
            )
        elif still.end - still.start < SHORT_REST:
            said = (
                "a short stationary stretch",
                f"{instant(still.end - still.start)} before the crash, from "
                f"{instant(still.start)}: biases and levelling are known the less the "
                "shorter it is, and the bounds are so much wider.",
            )
        else:
            continue
        told.setdefault(said, []).append(unit.name)
    for (head, text), names in told.items():
        yield "rest", f"{', '.join(names)}: {head}", text


def borrowed(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return who has no gyro, and whose turning it takes."""
    told: dict[str, list[str]] = {}
    for unit in result.units:
        if unit.gyro is None and unit.gyro_from is not None:
            told.setdefault(unit.gyro_from, []).append(unit.name)
    for lender, names in told.items():
        yield (
            "borrowed-gyro",
            f"{', '.join(names)}: no gyro",
            f"The turning is that of {lender}: a rigid vehicle turns everywhere alike. An error of "
            "that gyro is in all of them, and the comparison of recorders does not show it.",
        )


def ringing(result: CaseResult) -> Iterator[tuple[str, str, str]]:
    """Return whose samples are too few for a structure that rings."""
    slow = []
    for unit in result.units:
        stamps = unit.accelerometers[-1].table.index.to_numpy()
        rate = 1.0 / float(np.median(np.diff(stamps)))
        means = unit.accelerometers[-1].table.attrs.get("sampling") == "mean"
        if rate < RINGS and not means:
            slow.append((unit.name, rate))
    if slow:
        which = ", ".join(f"{name} ({rate:.4g} Hz)" for name, rate in slow)
        yield (
            "ringing",
            "Ringing of the structure is not seen at this rate",
            f"{which}: what swings faster than a quarter of the rate cannot be integrated from "
            "samples. Ringing of 10 g at 195 Hz that decays in 30 ms moves the path by 1 m within "
            "750 ms at 200 Hz, and is not in the bounds. Another recorder at 1 kHz or more that "
            "agrees excludes it.",
        )
