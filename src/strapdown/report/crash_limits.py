"""What limits the answers of a case, from what happened in it, the gravest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.report.crash_values import about, instant, plain
from strapdown.sensors.prepared_unit import PreparedUnit
from strapdown.systems.case_severity import main_event
from strapdown.systems.crash_case import CaseResult

__all__ = ["limitations"]

# A rest that is shorter leaves biases that a longer one would have told.
SHORT_REST = 2.0  # s
# Below this rate a structure that rings is not integrated: a quarter of the rate is the fastest.
RINGS = 1000.0  # Hz
AXES = ("forward", "right", "down")


def limitations(result: CaseResult) -> tuple[tuple[str, str], ...]:
    """Return what a reader must know before relying on the answers.

    Parameters
    ----------
    result : CaseResult

    Returns
    -------
    tuple of (head, text)
        Only of what happened in this case.
    """
    return (
        *_event(result),
        *_disagreement(result),
        *_clipping(result),
        *_assumed(result),
        *_rest(result),
        *_alone(result),
        *_ringing(result),
        *_levers(result),
        *_entry(result),
        *_references(result),
    )


def _event(result: CaseResult) -> Iterator[tuple[str, str]]:
    unit = result.reconstruction.main
    number = main_event(unit)
    if number is None:
        others = [u.name for u in result.reconstruction.units if main_event(u) is not None]
        alone = (
            f" There is one by {' and '.join(others)} alone: see Delta-V, and whether the record "
            "of another begins late or ends early."
        )
        yield (
            "No event",
            "The record holds no event after 49 CFR 563. There is no delta-V and no direction of "
            f"force; the path is told all the same.{alone if others else ''}",
        )
        return
    event = unit.events.events[number]
    if event.lasts_beyond_record:
        yield (
            "The event lasts beyond the record",
            f"The record ends at {instant(event.end)} while the velocity still changes: the "
            "delta-V is that up to there, and the whole one is larger or smaller.",
        )
    if event.starts_before_record:
        yield (
            "The event begins before the record",
            f"The record begins at {instant(event.time_zero)}, within the event: what changed "
            "before is missing.",
        )
    whole = unit.body[number].event
    if whole.interval.horizontal.undetermined:
        yield (
            "The direction of force is not determined",
            "The bound of the change of velocity holds zero in the horizontal plane, so that no "
            "direction is excluded.",
        )
    if unit.ned[number] is None:
        yield (
            "The event is not within the path",
            "Its change of velocity is told along the turning axes of the vehicle alone.",
        )


def _disagreement(result: CaseResult) -> Iterator[tuple[str, str]]:
    made = result.reconstruction
    comparison = made.comparison
    if comparison is None or comparison.agree:
        return
    pairs = [f"{p.first} and {p.second}" for p in comparison.pairs if not p.agree]
    mean = (
        "The weighted mean lies between them, and its bound is too narrow: it takes each at its "
        "word. "
        if made.combined is not None
        else ""
    )
    yield (
        "The recorders do not agree",
        f"{'; '.join(pairs) or 'All together'}: they differ by more than what is stated of them "
        f"allows with 95 %. {mean}At least one of them has an error that is not stated: a wrong "
        "axis, mounting point, angle, scale or clock, or a place that was deformed. Do not rely on "
        "the answers before it is found; see Sensors against each other.",
    )


def _prepared(result: CaseResult) -> Iterator[tuple[UnitReconstruction, PreparedUnit]]:
    for unit in result.reconstruction.units:
        if unit.at_point.prepared is not None:
            yield unit, unit.at_point.prepared


def _clipping(result: CaseResult) -> Iterator[tuple[str, str]]:
    for unit, prepared in _prepared(result):
        time = unit.at_point.time
        for what, clipped in (
            ("accelerometer", prepared.clipped),
            ("gyro", prepared.gyro_clipped),
        ):
            axes = [k for k in range(3) if clipped[:, k].any()]
            if not axes:
                continue
            rows = np.flatnonzero(clipped.any(axis=1))
            names = ", ".join("xyz"[k] for k in axes)
            yield (
                f"{unit.name}: the {what} was at the end of its range",
                f"Axis {names}, {len(rows)} samples between {instant(time[rows[0]])} and "
                f"{instant(time[rows[-1]])}, with no wider range behind it. What was cut off is "
                "missing, and no bound here knows how much: "
                + (
                    "the delta-V is too small, and the path too long."
                    if what == "accelerometer"
                    else "the attitude after it, and what is resolved with it, is not to be "
                    "relied on."
                ),
            )


def _assumed(result: CaseResult) -> Iterator[tuple[str, str]]:
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        if spec.assumed is None:
            continue
        given, parts = spec.assumed, []
        span = f"between {instant(given.over_s[0])} and {instant(given.over_s[1])}"
        if given.turn_sd_deg is not None:
            parts.append(
                "it has no gyro: the vehicle is taken not to have turned, with a standard "
                f"deviation of {given.turn_sd_deg:g}° of each angle {span}"
            )
        if given.delta_v_sd_m_per_s is not None:
            missing = [
                name
                for name, column in zip(AXES, ("x", "y", "z"), strict=True)
                if all(column not in t.channels for t in spec.accelerometers)
            ]
            parts.append(
                f"it has no accelerometer along its axis {' and '.join(missing) or 'that is told'}:"
                " nothing is taken to have changed there, with a standard deviation of "
                f"{given.delta_v_sd_m_per_s:g} m/s {span}"
            )
        why = f" Reason stated: {given.because}" if given.because else ""
        yield (
            f"{unit.name}: something is assumed that was not measured",
            f"{'; '.join(parts).capitalize()}. The bounds have it; they are wrong where the "
            f"assumption is.{why}",
        )


def _rest(result: CaseResult) -> Iterator[tuple[str, str]]:
    for unit, prepared in _prepared(result):
        rest, level = prepared.rest, prepared.levelling
        if rest is None:
            yield (
                f"{unit.name}: no stationary stretch before the crash",
                f"Roll and pitch are stated, {about(level.roll_deg, 1.96 * level.sd_deg, '°')} and "
                f"{about(level.pitch_deg, 1.96 * level.sd_deg, '°')}, or carried over from another "
                "recorder; biases are as stated of the sensors.",
            )
        elif rest.grade == "steady":
            yield (
                f"{unit.name}: quiet before the crash, but perhaps at speed",
                f"The stretch from {instant(rest.start)} to {instant(rest.end)} may have been "
                "driven; acceleration and turning over it are taken as zero with a bound.",
            )
        elif rest.end - rest.start < SHORT_REST:
            yield (
                f"{unit.name}: a short stationary stretch",
                f"{instant(rest.end - rest.start)} before the crash, from {instant(rest.start)}: "
                "biases and levelling are known the less the shorter it is, and the bounds are so "
                "much wider.",
            )
    for recorder in result.units:
        if recorder.gyro is None and recorder.gyro_from is not None:
            yield (
                f"{recorder.name} has no gyro",
                f"It borrows that of {recorder.gyro_from}: a rigid vehicle turns everywhere alike.",
            )


def _alone(result: CaseResult) -> Iterator[tuple[str, str]]:
    if len(result.units) == 1:
        yield (
            "One recorder alone",
            "An error that is not stated, such as an axis with a wrong sign, a wrong mounting "
            "point or a loose bracket, would not show.",
        )


def _ringing(result: CaseResult) -> Iterator[tuple[str, str]]:
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
            "Ringing of the structure is not seen at this rate",
            f"{which}: what swings faster than a quarter of the rate cannot be integrated from "
            "samples. Ringing of 10 g at 195 Hz that decays in 30 ms moves the path by 1 m within "
            "750 ms at 200 Hz, and is not in the bounds. Another recorder at 1 kHz or more that "
            "agrees excludes it.",
        )


def _levers(result: CaseResult) -> Iterator[tuple[str, str]]:
    point = np.asarray(result.spec.point.position_m)
    longest = max(
        (float(np.linalg.norm(point - unit.mounting.position)), unit.name) for unit in result.units
    )
    if longest[0] > 0.0:
        yield (
            "The vehicle is taken as rigid",
            f"between each recorder and the {result.spec.point.name}, up to "
            f"{plain(longest[0], 2)} m ({longest[1]}). A floor or pillar that folded in between "
            "moved otherwise.",
        )


def _entry(result: CaseResult) -> Iterator[tuple[str, str]]:
    if result.spec.entry.kind == "speed":
        yield (
            "The entry speed is not from these records",
            "It shifts every velocity and the path as a whole; delta-V and direction of force do "
            "not depend on it.",
        )


def _references(result: CaseResult) -> Iterator[tuple[str, str]]:
    if not result.references:
        yield (
            "Nothing to compare with",
            "No film, no survey and no other measurement of the crash was given.",
        )
    for answer in result.references:
        if answer.unit == result.reconstruction.main.name and not answer.consistent:
            yield (
                f"{answer.spec.name}: not within the bounds",
                "The difference is larger than the bounds of both together allow with 95 %; see "
                "Reference comparison.",
            )
