"""Events sample by sample, as a recorder in a vehicle finds them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import crash_events as kernel
from strapdown._kernels import window_change as rows
from strapdown.crash.crash_event import CrashEvent, two_sds
from strapdown.crash.event_rule import PART_563, EventRule
from strapdown.errors import ConfigError, DataError
from strapdown.tables.imu import SAMPLINGS

Array = NDArray[np.float64]

#: By what time zero is told, in the order of the kernel's marks.
BASES = ("longitudinal", "lateral", "resultant", "acceleration")
AXES = ("longitudinal", "lateral")


class EventDetector:
    """Find events, one call a sample or a piece of a record, and never look ahead.

    A record that is given in pieces, cut anywhere, gives the same bits as in one.

    Parameters
    ----------
    rule : EventRule
    sampling : {'instantaneous', 'mean'}
        What a sample is: the value at its stamp, or its mean over the interval that ends there.
    noise : float or (3,), m/s²
        Standard deviation of a sample, taken as white, for the uncertainty of the times.
    bias_sd : float or (3,), m/s²
        Of the resting value that was taken off.
    source : str, optional
        Name of the unit or file, for messages.

    Raises
    ------
    ConfigError
        `sampling` is unknown, or a standard deviation is none.

    Notes
    -----
    The samples are accelerations in vehicle axes without gravity: the specific force with its
    resting value taken off, as `body_acceleration` does. Only the first two components are used.
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
        self._rows = np.zeros((1024, rows.WIDTH))
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
    def current(self) -> CrashEvent | None:
        """The event that has been detected and not ended, as known now."""
        if not self.triggered:
            return None
        state = self._state
        pending = state[kernel.PENDING]
        if math.isnan(pending):
            return self._event(float(state[kernel.NOW]), True)
        # It has become quiet, though not yet for long enough.
        return self._event(float(pending), False)

    @property
    def samples(self) -> int:
        """How many samples were taken."""
        return self._held + self._gone

    @property
    def woken(self) -> int:
        """How often the resultant woke the algorithm without an event."""
        return int(self._state[kernel.WOKEN])

    @property
    def largest_change(self) -> tuple[float, str, float]:
        """Largest change within the trigger's window, without what led to an event.

        m/s, its axis, and the instant in s at which the window ends; (0, 'longitudinal', NaN)
        where there was none.
        """
        state = self._state
        axis = AXES[int(state[kernel.MOST_AXIS])]
        return float(state[kernel.MOST]), axis, float(state[kernel.MOST_TIME])

    def update(self, time: float, accel: Array | Sequence[float]) -> tuple[CrashEvent, ...]:
        """Take one sample.

        Parameters
        ----------
        time : float, s
            Later than that of the sample before.
        accel : array_like, (3,), m/s²

        Returns
        -------
        tuple of CrashEvent
            Those that ended by it, mostly none.

        Raises
        ------
        DataError
            Time does not advance, or a number is not finite. The sample is then not taken.
        """
        held = self._held
        if 0 < held < len(self._rows) and np.shape(accel) == (3,):
            x, y, z = accel
            # What is not finite, or goes back, is refused with its words by `extend`.
            if time > self._rows[held - 1, rows.T] and math.isfinite(x + y + z + time):
                row = self._rows[held]
                row[rows.T], row[rows.AX], row[rows.AY] = time, x, y
                self._held = held + 1
                return self._advance()
        return self.extend([time], [accel])  # type: ignore[arg-type]

    def extend(self, time: ArrayLike, accel: ArrayLike) -> tuple[CrashEvent, ...]:
        """Take a piece of a record.

        Parameters
        ----------
        time : array_like, (n,), s
        accel : array_like, (n, 3), m/s²

        Returns
        -------
        tuple of CrashEvent
            Those that ended in it.

        Raises
        ------
        DataError
            As `update`; then nothing of the piece is taken.
        """
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
        self._rows[new, rows.T] = stamps
        self._rows[new, rows.AX] = values[:, 0]
        self._rows[new, rows.AY] = values[:, 1]
        if self._held + self._gone == 0:
            self._rows[0, rows.VX :] = 0.0
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
        last = self._rows[self._held - 1, rows.T] if self._held else -math.inf
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
        """Let go what no window reaches any more; hold twice what there is otherwise."""
        if self._held + more <= len(self._rows):
            return
        if self._held:
            state, rule = self._state, self.rule
            # An episode's peak may begin before its window does.
            reach = rule.trigger_window + 2.0 * rule.wake_window
            pending = state[kernel.PENDING]
            oldest = state[kernel.NOW] if math.isnan(pending) else pending
            first = int(np.searchsorted(self._rows[: self._held, rows.T], oldest - reach)) - 2
            first = max(min(first, int(state[kernel.TAILS : kernel.TAILS + 3].min()) - 1), 0)
            self._rows[: self._held - first] = self._rows[first : self._held].copy()
            state[kernel.TAILS : kernel.TAILS + 3] -= first
            state[kernel.ROW] -= first
            self._held -= first
            self._gone += first
        if 2 * (self._held + more) > len(self._rows):
            larger = np.zeros((2 * (self._held + more), rows.WIDTH))
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
        # A rounding below the first stamp is the first stamp.
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
        """Uncertainty of the change at the crossing, over its slope."""
        _, slope, power, length, *shares = mark.tolist()
        if math.isnan(slope):
            return math.nan
        variance = 0.0
        for share, noise, bias in zip(shares, self._noise, self._bias, strict=True):
            variance += share**2 * (power * noise**2 + (length * bias) ** 2)
        if variance == 0.0:
            return 0.0
        return math.sqrt(variance) / slope if slope != 0.0 else math.inf
