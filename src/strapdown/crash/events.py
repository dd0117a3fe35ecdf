"""Events of a whole record, after 49 CFR Part 563, and what a person should know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.acceleration import Acceleration
from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.event_detector import EventDetector
from strapdown.crash.event_rule import KMH, PART_563, EventRule
from strapdown.errors import ConfigError, DataError, Finding

__all__ = ["PART_563", "CrashEvent", "CrashEvents", "EventDetector", "EventRule", "detect_events"]


@dataclass(frozen=True)
class CrashEvents:
    """What was found in a record.

    Attributes
    ----------
    events : tuple of CrashEvent
        In order of time; the last one may last beyond the record.
    rule : EventRule
    woken : int
        How often the wake threshold was exceeded without an event: potholes, kerbs, doors.
    largest_change : float, m/s
        Largest change of the longitudinal or lateral velocity within the trigger's window,
        without what led to an event.
    largest_axis : {'longitudinal', 'lateral'}
    largest_time : float, s
        Where that window ends; NaN where nothing changed.
    source : str or None
    findings : tuple of Finding
    """

    events: tuple[CrashEvent, ...]
    rule: EventRule
    woken: int
    largest_change: float
    largest_axis: str
    largest_time: float
    source: str | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def first(self) -> CrashEvent:
        """The first event.

        Raises
        ------
        DataError
            There is none; the message tells the largest change that was found.
        """
        if not self.events:
            raise DataError(self.findings[-1])
        return self.events[0]

    @property
    def strongest(self) -> CrashEvent:
        """The event with the largest peak.

        Raises
        ------
        DataError
            There is none.
        """
        return max(self.events, key=lambda e: e.peak) if self.events else self.first

    @property
    def crashes(self) -> tuple[tuple[CrashEvent, ...], ...]:
        """The events by crash: those that begin within 5 s of the first belong to one."""
        groups: list[list[CrashEvent]] = []
        for event in self.events:
            if groups and event.time_zero - groups[-1][0].time_zero <= self.rule.multi_event:
                groups[-1].append(event)
            else:
                groups.append([event])
        return tuple(tuple(g) for g in groups)


def detect_events(
    acceleration: Acceleration,
    rule: EventRule = PART_563,
    *,
    noise: float | Sequence[float] = 0.0,
    bias_sd: float | Sequence[float] = 0.0,
) -> CrashEvents:
    """Find the events of a record, in retrospect.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` (`body_acceleration`: the mean at rest taken off) or ``impact``
        (resolved in north-east-down, gravity taken off, then `Acceleration.along` a heading).
    rule : EventRule
    noise : float or (3,), m/s²
        Standard deviation of a sample, white.
    bias_sd : float or (3,), m/s²
        Of the resting value.

    Returns
    -------
    CrashEvents
        The same events, to the last bit, as an `EventDetector` gives sample by sample.
        Crossings are solved between the samples: with instantaneous sampling the acceleration is
        a line there, which leaves an error of the second order in the step.

    Raises
    ------
    ConfigError
        The record is in north-east-down, where forward and right mean nothing.

    Notes
    -----
    49 CFR 563.5(b): event, trigger threshold, time zero, end of event time, multi-event crash;
    `EventRule` says how each is read. Braking at 0.9 g changes the velocity by 4.8 km/h within
    150 ms and by 0.64 km/h within 20 ms, and is neither an event nor a wake.
    """
    source = acceleration.source
    if acceleration.frame == "ned":
        raise ConfigError("crash.record-north-east-down-event", file=source, quantity="frame")
    detector = EventDetector(
        rule, sampling=acceleration.sampling, noise=noise, bias_sd=bias_sd, source=source
    )
    detector.extend(acceleration.time, acceleration.values)
    open_event = detector.current
    events = detector.events + ((open_event,) if open_event is not None else ())
    size, axis, when = detector.largest_change
    findings = [f for e in events for f in _findings(e, acceleration, rule)]
    if not events:
        findings.append(_no_event(detector, acceleration))
    return CrashEvents(
        events, rule, detector.woken, size, axis, when, source, findings=tuple(findings)
    )


def _findings(event: CrashEvent, acceleration: Acceleration, rule: EventRule) -> list[Finding]:
    found = []
    source = acceleration.source
    if event.starts_before_record:
        found.append(
            Finding(
                "crash.record-begins-event-km-h",
                file=source,
                quantity="time zero",
                wake=rule.wake / KMH,
                woken=event.woken - acceleration.begin,
                begin=acceleration.begin,
            )
        )
    if event.lasts_beyond_record:
        found.append(
            Finding(
                "crash.record-ends-after-time-zero",
                file=source,
                quantity="end of event",
                end=acceleration.end,
                end_2=acceleration.end - event.time_zero,
                wake=rule.wake / KMH,
                wake_window=rule.wake_window * 1000.0,
            )
        )
    for gap in acceleration.gaps(event.time_zero, event.end):
        found.append(
            Finding(
                "crash.no-sample-ms-within-event",
                file=source,
                row=gap.sample + 1,
                quantity="acceleration",
                length=gap.length * 1000.0,
                start=gap.start,
                end=gap.end,
            )
        )
    return found


def _no_event(detector: EventDetector, acceleration: Acceleration) -> Finding:
    rule, (size, axis, when) = detector.rule, detector.largest_change
    changes = size > 0.0
    short = acceleration.end - acceleration.begin < rule.trigger_window
    in_g = size * STANDARD_GRAVITY >= rule.trigger
    said: dict[str, Any] = {
        "change": size / KMH,
        "axis": axis,
        "end": when,
        "trigger": rule.trigger / KMH,
        "window_ms": rule.trigger_window * 1e3,
        "record_ms": (acceleration.end - acceleration.begin) * 1e3,
        "wake": rule.wake / KMH,
        "wake_window_ms": rule.wake_window * 1e3,
        "woken": detector.woken,
    }
    largest = Finding("crash.largest-change" if changes else "crash.no-change", data=said)
    more = []
    if detector.woken and not short:
        code = "crash.woken-once" if detector.woken == 1 else "crash.woken"
        more.append(Finding(code, severity="note", data=said))
    code = "crash.no-event"
    if short:
        code = "crash.no-event-short-record"
    if in_g:
        code += "-perhaps-in-g"
    return Finding(
        code,
        file=acceleration.source,
        quantity="delta-V",
        data={**said, "largest": largest.replace(severity="note"), "more": more},
    )
