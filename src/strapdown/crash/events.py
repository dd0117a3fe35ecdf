"""Crash events of a whole record, after 49 CFR Part 563, and findings on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown._kernels import crash_events as kernel
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.acceleration import Acceleration, window_weights
from strapdown.errors import ConfigError, DataError, Finding, add_warning, check_choice
from strapdown.tables.checks import Array
from strapdown.tables.imu import SAMPLINGS
from strapdown.units import SPEEDS

# One event of a crash.


@dataclass(frozen=True)
class CrashEvent:
    """One event of a record.

    Attributes
    ----------
    time_zero : float, s
        First point of the interval in which the wake threshold was reached (49 CFR 563.5(b)), or
        the instant at which it was; see `EventRule.zero_at`.
    time_zero_sd : float, s
        Of `time_zero` from noise and bias of the acceleration: standard deviation of the window's
        change divided by its slope at the threshold. First order: valid while it is small
        compared with the time in which the slope changes. Zero where no noise is stated.
    basis : {'longitudinal', 'lateral', 'resultant', 'acceleration'}
        Criterion that gave time zero.
    woken : float, s
        Instant at which the wake threshold was reached, the earliest at which a recorder knows.
    trigger : float, s
        Instant of detection, at which the trigger threshold was reached.
    trigger_axis : {'longitudinal', 'lateral'}
    end : float, s
        Instant at which the resultant change within the wake window became small; the last stamp
        where `lasts_beyond_record`.
    end_sd : float, s
        As `time_zero_sd`; NaN where the event lasts beyond the record, or where the end is set
        by the trigger.
    peak : float, m/s²
        Largest horizontal magnitude of a sample from time zero to the end, unfiltered.
    peak_time : float, s
    starts_before_record : bool
        The record begins within the interval of time zero, which is then the first stamp.
    lasts_beyond_record : bool
        The record ends before the event.
    """

    time_zero: float
    time_zero_sd: float
    basis: str
    woken: float
    trigger: float
    trigger_axis: str
    end: float
    end_sd: float
    peak: float
    peak_time: float
    starts_before_record: bool
    lasts_beyond_record: bool

    @property
    def duration(self) -> float:
        """From time zero to the end, s."""
        return self.end - self.time_zero


def two_sds(given: float | Sequence[float], name: str) -> tuple[float, float]:
    """Forward and right standard deviation from one number or a triad."""
    try:
        sds = np.asarray(given, dtype=np.float64)
        sds = np.broadcast_to(sds, (3,)) if sds.ndim == 0 else sds
    except (TypeError, ValueError):
        sds = np.empty(0)
    if sds.shape != (3,) or not (np.isfinite(sds).all() and (sds >= 0.0).all()):
        raise ConfigError("crash.no-standard-deviation", quantity=name, given=given)
    return float(sds[0]), float(sds[1])


# Definition of an event: thresholds and windows of 49 CFR Part 563.


KMH = SPEEDS["km/h"]

ZERO_AT = ("interval", "threshold")
#: Finding of a record that begins within the interval of time zero. A table of an event data
#: recorder begins there by definition.
BEGINS_WITHIN = "crash.record-begins-event-km-h"


@dataclass(frozen=True)
class EventRule:
    """Thresholds and windows, by default those of 49 CFR 563.5(b), as amended to 89 FR 102832.

    Attributes
    ----------
    trigger, trigger_window : float, m/s and s
        *Trigger threshold*: a change of the longitudinal (or lateral) velocity of at least
        8 km/h within 150 ms makes an event.
    wake, wake_window : float, m/s and s
        *Time zero* (2)(i): the first point of the first interval of 20 ms in which the
        longitudinal velocity changes by more than 0.8 km/h. *End of event time*: the moment at
        which the resultant change within 20 ms becomes that or less.
    lateral_window : float, s
        *Time zero* (2)(ii): as above, laterally, within 5 ms.
    lateral : bool
        Whether the vehicle records the lateral change; otherwise only the longitudinal change
        counts, also in the resultant.
    wake_acceleration : float, m/s², optional
        *Time zero* (1), for systems that wake up: the acceleration, longitudinal or lateral, at
        which this recorder's algorithm is activated (the manufacturer's figure). The 20 and
        5 ms windows are then not used for time zero.
    zero_at : {'interval', 'threshold'}
        Whether time zero is the first point of the interval in which the wake threshold is
        reached, as in the regulation, or the instant at which it is reached. In a hard impact
        the first precedes the contact: by 12 ms where the threshold is reached in 8 ms.
    quiet : float, s
        How long the resultant must stay small for the event to end; the end is then the beginning
        of this interval. Zero is the regulation; 20 to 50 ms keeps together an event whose
        pulse has a dip.
    multi_event : float, s
        *Multi-event crash*: events that begin no further apart belong to one crash.

    Raises
    ------
    ConfigError
        A threshold or window is not positive and finite, a word is unknown, or the wake windows
        are not shorter than the trigger windows.

    Notes
    -----
    The regulation leaves three points open, settled here as follows. (a) The lateral window of
    5 ms requires 44 m/s²; a side impact may reach the trigger without reaching that. An event
    without another time zero takes the first point of the 20 ms interval in which the *resultant*
    changes by more than the threshold. (b) A trigger window does not reach back into an event
    that has ended; otherwise one impact would give two events. (c) *(3)*, the deployment of a
    restraint, is not observable with inertial sensors.
    """

    trigger: float = 8.0 * KMH
    trigger_window: float = 0.150
    wake: float = 0.8 * KMH
    wake_window: float = 0.020
    lateral_window: float = 0.005
    lateral: bool = True
    wake_acceleration: float | None = None
    zero_at: str = "interval"
    quiet: float = 0.0
    multi_event: float = 5.0

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in ("lateral", "zero_at") or (
                f.name == "wake_acceleration" and value is None
            ):
                continue
            least = 0.0 if f.name == "quiet" else math.ulp(0.0)
            if not (math.isfinite(value) and value >= least):
                raise ConfigError("crash.no-threshold-or-window", quantity=f.name, value=value)
        check_choice("crash.no-place-time-zero", ZERO_AT, quantity="zero_at", zero_at=self.zero_at)
        if max(self.wake_window, self.lateral_window) >= self.trigger_window:
            raise ConfigError(
                "crash.not-longer-than-windows-time",
                quantity="trigger_window",
                trigger_window=self.trigger_window,
            )


#: The regulation, for a vehicle that records the lateral change.
PART_563 = EventRule()


@dataclass(frozen=True)
class CrashEvents:
    """Events found in a record, in order of time; the last one may last beyond the record.

    `woken`: number of times the wake threshold was exceeded without an event: potholes, curbs,
    doors. `largest_change`, m/s, along `largest_axis` within the trigger window that ends at
    `largest_time`, s (NaN without any change), excluding changes that led to an event.
    `cut_change`, m/s: where the record ends without an event, and while the velocity still changes
    by more than the wake threshold within the wake window, its horizontal change up to there within
    the trigger window; the whole change is at least that. Zero otherwise.
    """

    events: tuple[CrashEvent, ...]
    rule: EventRule
    woken: int
    largest_change: float
    largest_axis: str
    largest_time: float
    source: str | None = None
    findings: tuple[Finding, ...] = ()
    cut_change: float = 0.0

    @property
    def first(self) -> CrashEvent:
        """The first event. `DataError`: there is none; the message gives the largest change."""
        if not self.events:
            raise DataError(self.findings[-1])
        return self.events[0]

    @property
    def strongest(self) -> CrashEvent:
        """The event with the largest peak. `DataError`: there is none."""
        return max(self.events, key=lambda e: e.peak) if self.events else self.first

    @property
    def crashes(self) -> tuple[tuple[CrashEvent, ...], ...]:
        """Events by crash: events that begin within 5 s of the first belong to one crash."""
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
    """Find the events of a complete record.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` (`body_acceleration`: stationary mean subtracted) or ``impact``
        (resolved in north-east-down, gravity subtracted, then `Acceleration.along` a heading).
    rule : EventRule
    noise : float or (3,), m/s²
        Standard deviation of the white noise of a sample.
    bias_sd : float or (3,), m/s²
        Of the stationary mean.

    Returns
    -------
    CrashEvents
        Bitwise the same events as an `EventDetector` gives sample by sample. Crossings are
        interpolated linearly between samples; for instantaneous sampling the error is of second
        order in the step.

    Raises
    ------
    ConfigError
        The record is in north-east-down, where forward and right are undefined.

    Notes
    -----
    49 CFR 563.5(b): event, trigger threshold, time zero, end of event time, multi-event crash;
    see `EventRule`. Braking at 0.9 g changes the velocity by 4.8 km/h within 150 ms and by
    0.64 km/h within 20 ms: neither an event nor a wake-up.
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
    cut = _last_change(acceleration, rule) if detector.changing and not events else 0.0
    if not events:
        findings.append(_no_event(detector, acceleration, cut))
    return CrashEvents(events, rule, detector.woken, size, axis, when, source, tuple(findings), cut)


def _last_change(acceleration: Acceleration, rule: EventRule) -> float:
    """Horizontal change of velocity within the trigger window that ends with the record, m/s."""
    time, end = acceleration.time, acceleration.end
    start = max(acceleration.begin, end - rule.trigger_window)
    weights = window_weights(time, start, end, acceleration.sampling)
    forward, right, _ = weights @ acceleration.values
    return math.hypot(forward, right if rule.lateral else 0.0)


def _findings(event: CrashEvent, acceleration: Acceleration, rule: EventRule) -> list[Finding]:
    found: list[Finding] = []
    source = acceleration.source
    if event.starts_before_record:
        add_warning(
            found,
            BEGINS_WITHIN,
            file=source,
            quantity="time zero",
            wake=rule.wake / KMH,
            woken=event.woken - acceleration.begin,
            begin=acceleration.begin,
        )
    if event.lasts_beyond_record:
        add_warning(
            found,
            "crash.record-ends-after-time-zero",
            file=source,
            quantity="end of event",
            end=acceleration.end,
            end_2=acceleration.end - event.time_zero,
            wake=rule.wake / KMH,
            wake_window=rule.wake_window * 1000.0,
        )
    for gap in acceleration.gaps(event.time_zero, event.end):
        add_warning(
            found,
            "crash.no-sample-ms-within-event",
            file=source,
            row=gap.sample + 1,
            quantity="acceleration",
            length=gap.length * 1000.0,
            start=gap.start,
            end=gap.end,
        )
    return found


def _no_event(detector: EventDetector, acceleration: Acceleration, cut: float) -> Finding:
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
    if cut > 0.0:
        return Finding(
            "crash.no-event-yet",
            file=acceleration.source,
            quantity="delta-V",
            data={**said, "cut": cut / KMH, "record_end": acceleration.end},
        )
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


# Sample-by-sample event detection, as in a vehicle's recorder.


#: Criteria of time zero, in the order of the kernel's marks.
BASES = ("longitudinal", "lateral", "resultant", "acceleration")
AXES = ("longitudinal", "lateral")


class EventDetector:
    """Find events causally, one sample or chunk of a record per call.

    The result is bitwise independent of how a record is cut into chunks.

    Parameters
    ----------
    sampling : {'instantaneous', 'mean'}
        Whether a sample is the value at its stamp or the mean over the interval ending there.
    noise : float or (3,), m/s²
        Standard deviation of the white noise of a sample, for the uncertainty of the times.
    bias_sd : float or (3,), m/s²
        Of the stationary mean that was subtracted.
    source : str, optional
        Name of the unit or file, for messages.

    Raises
    ------
    ConfigError
        `sampling` is unknown, or a standard deviation is not valid.

    Notes
    -----
    Samples are accelerations in vehicle axes without gravity: the specific force less its
    stationary mean, as from `body_acceleration`. Only the first two components are used.
    """

    def __init__(
        self,
        rule: EventRule = PART_563,
        *,
        sampling: str = "instantaneous",
        noise: float | Sequence[float] = 0.0,
        bias_sd: float | Sequence[float] = 0.0,
        source: str | None = None,
    ) -> None:
        if sampling not in SAMPLINGS:
            raise ConfigError(
                "crash.no-kind-sampling",
                file=source,
                quantity="sampling",
                sampling=sampling,
                samplings=SAMPLINGS,
            )
        options = np.zeros(kernel.OPTIONS)
        options[kernel.MEAN] = float(sampling == "mean")
        options[kernel.TRIGGER], options[kernel.LONG] = rule.trigger, rule.trigger_window
        options[kernel.WAKE], options[kernel.SHORT] = rule.wake, rule.wake_window
        options[kernel.SIDE], options[kernel.QUIET] = rule.lateral_window, rule.quiet
        options[kernel.LEVEL] = rule.wake_acceleration or 0.0
        options[kernel.LATERAL] = float(rule.lateral)
        self.rule = rule
        self._source = source
        self._options = options
        self._noise, self._bias = two_sds(noise, "noise"), two_sds(bias_sd, "bias_sd")
        self._state = np.zeros(kernel.SIZE)
        self._rows = np.zeros((1024, kernel.WIDTH))
        self._held, self._gone = 0, 0
        self._events: list[CrashEvent] = []

    @property
    def events(self) -> tuple[CrashEvent, ...]:
        """Events that have ended."""
        return tuple(self._events)

    @property
    def triggered(self) -> bool:
        """Whether an event has been detected that has not ended."""
        return bool(self._held and not math.isnan(self._state[kernel.TRIGGERED]))

    @property
    def changing(self) -> bool:
        """Whether the resultant now changes by more than the wake threshold within its window."""
        return bool(self._state[kernel.ACTIVE]) and math.isnan(self._state[kernel.PENDING])

    @property
    def current(self) -> CrashEvent | None:
        """The event detected and not yet ended, as currently known."""
        if not self.triggered:
            return None
        state = self._state
        pending = state[kernel.PENDING]
        if math.isnan(pending):
            return self._event(float(state[kernel.NOW]), True)
        # The change is small, but not yet for long enough.
        return self._event(float(pending), False)

    @property
    def samples(self) -> int:
        """Number of samples processed."""
        return self._held + self._gone

    @property
    def woken(self) -> int:
        """Number of wake-ups without an event."""
        return int(self._state[kernel.WOKEN])

    @property
    def largest_change(self) -> tuple[float, str, float]:
        """Largest change within the trigger window, excluding changes that led to an event.

        m/s, its axis, and the instant in s at which the window ends; (0, 'longitudinal', NaN)
        without any change.
        """
        state = self._state
        axis = AXES[int(state[kernel.MOST_AXIS])]
        return float(state[kernel.MOST]), axis, float(state[kernel.MOST_TIME])

    def update(self, time: float, accel: Array | Sequence[float]) -> tuple[CrashEvent, ...]:
        """Process one sample: time, s, later than the preceding; acceleration, (3,), m/s².

        Returns the events ended by it. `DataError`: time does not increase, or a number is not
        finite; the sample is then not processed.
        """
        held = self._held
        if 0 < held < len(self._rows) and np.shape(accel) == (3,):
            x, y, z = accel
            # `extend` rejects samples that are not finite or not later, with its message.
            if time > self._rows[held - 1, kernel.T] and math.isfinite(x + y + z + time):
                row = self._rows[held]
                row[kernel.T], row[kernel.AX], row[kernel.AY] = time, x, y
                self._held = held + 1
                return self._advance()
        return self.extend([time], [accel])  # type: ignore[arg-type]

    def extend(self, time: ArrayLike, accel: ArrayLike) -> tuple[CrashEvent, ...]:
        """Process a chunk of a record, (n,), s, and (n, 3), m/s², as `update`: all or none."""
        try:
            stamps = np.asarray(time, dtype=np.float64)
            values = np.asarray(accel, dtype=np.float64)
        except (TypeError, ValueError):
            stamps, values = np.empty(0), np.empty(0)
        self._check(stamps, values)
        if not len(stamps):
            return ()
        self._make_room(len(stamps))
        new = slice(self._held, self._held + len(stamps))
        self._rows[new, kernel.T] = stamps
        self._rows[new, kernel.AX] = values[:, 0]
        self._rows[new, kernel.AY] = values[:, 1]
        if self._held + self._gone == 0:
            self._rows[0, kernel.VX :] = 0.0
            kernel.begin(self._state, float(stamps[0]))
        self._held += len(stamps)
        return self._advance()

    def _advance(self) -> tuple[CrashEvent, ...]:
        before = len(self._events)
        while kernel.advance(self._state, self._options, self._rows, self._held) == kernel.CLOSED:
            end = float(self._state[kernel.MARKS + kernel.END * kernel.MARK])
            self._events.append(self._event(end, False))
            kernel.forget(self._state)
        return tuple(self._events[before:])

    def _check(self, time: Array, accel: Array) -> None:
        if time.ndim != 1 or accel.shape != (len(time), 3):
            raise DataError(
                "crash.stamps-shape-accelerations-shape",
                file=self._source,
                row=self.samples + 1,
                quantity="acceleration",
                shape=time.shape,
                shape_2=accel.shape,
            )
        bad = np.flatnonzero(~(np.isfinite(time) & np.isfinite(accel).all(axis=1)))
        if bad.size:
            raise DataError(
                "crash.time-acceleration-not-finite",
                file=self._source,
                row=self.samples + int(bad[0]) + 1,
                quantity="acceleration",
                time=time[bad[0]],
                accel=accel[bad[0]].tolist(),
            )
        last = self._rows[self._held - 1, kernel.T] if self._held else -math.inf
        back = np.flatnonzero(np.diff(time, prepend=last) <= 0.0)
        if back.size:
            raise DataError(
                "crash.time-does-not-advance-not",
                file=self._source,
                row=self.samples + int(back[0]) + 1,
                quantity="time",
                time=time[back[0]],
            )

    def _make_room(self, more: int) -> None:
        """Drop samples that no window reaches any more; otherwise double the buffer."""
        if self._held + more <= len(self._rows):
            return
        if self._held:
            state, rule = self._state, self.rule
            # The peak of an episode may precede its window.
            reach = rule.trigger_window + 2.0 * rule.wake_window
            pending = state[kernel.PENDING]
            oldest = state[kernel.NOW] if math.isnan(pending) else pending
            first = int(np.searchsorted(self._rows[: self._held, kernel.T], oldest - reach)) - 2
            first = max(min(first, int(state[kernel.TAILS : kernel.TAILS + 3].min()) - 1), 0)
            self._rows[: self._held - first] = self._rows[first : self._held].copy()
            state[kernel.TAILS : kernel.TAILS + 3] -= first
            state[kernel.ROW] -= first
            self._held -= first
            self._gone += first
        if 2 * (self._held + more) > len(self._rows):
            larger = np.zeros((2 * (self._held + more), kernel.WIDTH))
            larger[: self._held] = self._rows[: self._held]
            self._rows = larger

    def _event(self, end: float, lasts: bool) -> CrashEvent:
        state = self._state
        marks = state[kernel.MARKS : kernel.MARKS + 5 * kernel.MARK].reshape(5, kernel.MARK)
        rule, began = self.rule, float(state[kernel.BEGIN])
        back = (rule.wake_window, rule.lateral_window, rule.wake_window, 0.0)
        first = [float(marks[i, 0]) - back[i] for i in range(4)]
        own = [i for i in (0, 1, 3) if not math.isnan(first[i])]
        which = min(own, key=lambda i: first[i]) if own else 2
        trigger = float(state[kernel.TRIGGERED])
        begin = first[which] if not math.isnan(first[which]) else trigger - rule.trigger_window
        # A value below the first stamp by rounding is the first stamp.
        before = begin < began - 1e-12 * max(1.0, abs(began))
        late = rule.zero_at == "threshold" and not math.isnan(first[which])
        return CrashEvent(
            time_zero=float(marks[which, 0]) if late else max(begin, began),
            time_zero_sd=self._time_sd(marks[which]),
            basis=BASES[which],
            woken=float(marks[which, 0]),
            trigger=trigger,
            trigger_axis=AXES[int(state[kernel.AXIS])],
            end=end,
            end_sd=math.nan if lasts else self._time_sd(marks[kernel.END]),
            peak=float(state[kernel.PEAK]),
            peak_time=float(state[kernel.PEAK_TIME]),
            starts_before_record=before,
            lasts_beyond_record=lasts,
        )

    def _time_sd(self, mark: Array) -> float:
        """Standard deviation of the change at the crossing divided by its slope."""
        _, slope, power, length, *shares = mark.tolist()
        if math.isnan(slope):
            return math.nan
        variance = 0.0
        for share, noise, bias in zip(shares, self._noise, self._bias, strict=True):
            variance += share**2 * (power * noise**2 + (length * bias) ** 2)
        if variance == 0.0:
            return 0.0
        return math.sqrt(variance) / slope if slope != 0.0 else math.inf
