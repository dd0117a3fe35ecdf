"""Whether a channel of a crash record can be believed: alone, and among its like."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError, Finding
from strapdown.sensors.equal_runs import equal_runs

__all__ = ["ChannelHealth", "Fault", "check_channel", "check_peers"]

Array = NDArray[np.float64]

# A sensor that moves in a crash does not repeat a value for so long, unless its steps are
# coarse: then it does so at rest, too.
STUCK_TIME = 5e-3  # s
STUCK_LEAST = 10  # samples
STUCK_FACTOR = 4.0
# Samples at the very end of the range that follow each other, and the share of the range.
FLAT_TOP = 3  # samples
FULL_SHARE = 0.98
# A step from one quiet level to another: means over so long, the step itself being shorter. A
# ramp that is as quiet as this makes the means differ by 4.3 times the noise at most.
JUMP_WINDOW, JUMP_STEP = 5e-3, 5e-4  # s
JUMP_FACTOR, QUIET_FACTOR = 8.0, 1.5
# Share of the step that lies between the near sixths of both windows, 1.3 ms apart; a head that
# turns takes longer.
ABRUPT = 0.8
# What a vehicle still decelerates with when the crash is over: tyres on a road, not locked.
SETTLED = 5.0  # m/s²
SETTLED_WINDOW = 0.05  # s
# Restitution of cars into rigid walls stays below, and a metre a second is a zero error of
# 0.3 g over a third of a second.
RESTITUTION, SPEED_LEFT = 0.3, 1.0  # m/s
# Among its like: noise before the impact, and how much earlier a record may end.
NOISE_FACTOR = 3.0
SHORT_SHARE = 0.1
LEAST_REST = 20  # samples


@dataclass(frozen=True)
class Fault:
    """Something that a sound channel does not do.

    Attributes
    ----------
    kind : str
        ``stuck``, ``saturation``, ``jump``, ``offset``, ``velocity``, ``noise``, ``cut``.
    at : float, s
        When it begins.
    size, limit : float
        What was measured, and what it may be; in the channel's unit, its integral's, or s.
    """

    kind: str
    at: float
    size: float
    limit: float
    finding: Finding


@dataclass(frozen=True)
class ChannelHealth:
    """What the tests say of a channel.

    Attributes
    ----------
    name : str
    begin, end : float, s
    noise : float
        Standard deviation before the impact, in the channel's unit.
    velocity : float, m/s, or None
        At the end, of an accelerometer: entry speed and integral.
    offset : float or None
        Mean over the last 50 ms, of an accelerometer.
    faults : tuple of Fault
    """

    name: str
    begin: float
    end: float
    noise: float
    velocity: float | None
    offset: float | None
    faults: tuple[Fault, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its faults."""
        return tuple(f.kind for f in self.faults)


def check_channel(
    time: ArrayLike,
    values: ArrayLike,
    name: str,
    *,
    acceleration: bool = True,
    full_scale: float | None = None,
    entry_speed: float = 0.0,
    rest_until: float = 0.0,
) -> ChannelHealth:
    """Test a channel by itself.

    Parameters
    ----------
    time : array_like, (n,), s
    values : array_like, (n,)
        SI.
    name : str
        For messages.
    acceleration : bool
        Whether it is an acceleration, whose mean and integral at the end are looked at; these
        two hold for a part that moves straight and comes to rest within the record, and alarm
        falsely for one that does not, as a dummy's head.
    full_scale : float, optional
        End of its range, same unit.
    entry_speed : float, m/s
        Along its axis before the impact.
    rest_until : float, s
        Before this nothing happens to it.

    Returns
    -------
    ChannelHealth

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, time does not advance, or there are fewer
        than 20 samples before `rest_until`.
    """
    t, v = _arrays(time, values, name)
    rest = v[t < rest_until]
    if rest.size < LEAST_REST:
        raise DataError(
            "sensors.samples-before-too-few-noise",
            quantity=name,
            size=rest.size,
            rest_until=rest_until,
            least_rest=LEAST_REST,
        )
    noise = float(rest.std(ddof=1))
    usual = _usual_run(rest)
    faults = [*_stuck(t, v, usual, name), *_saturation(t, v, noise, usual, full_scale, name)]
    faults += _jump(t, v - rest.mean(), noise, name)
    velocity = offset = None
    if acceleration:
        zeroed = v - rest.mean()
        velocity = entry_speed + float(np.trapezoid(zeroed, t))
        offset = float(zeroed[t >= t[-1] - SETTLED_WINDOW].mean())
        faults += _end(t, velocity, offset, entry_speed, name)
    return ChannelHealth(name, float(t[0]), float(t[-1]), noise, velocity, offset, tuple(faults))


def check_peers(channels: Sequence[ChannelHealth]) -> tuple[ChannelHealth, ...]:
    """Test channels of one kind against each other: noise before the impact, and their ends.

    Parameters
    ----------
    channels : sequence of ChannelHealth
        Of one kind of sensor and one recorder.

    Returns
    -------
    tuple of ChannelHealth
        The same, with what was found added.
    """
    if not channels:
        return ()
    usual = float(np.median([c.noise for c in channels]))
    last = max(c.end for c in channels)
    begin = min(c.begin for c in channels)
    out = []
    for channel in channels:
        found = list(channel.faults)
        if channel.noise > NOISE_FACTOR * usual:
            what = (
                f"noise of {channel.noise:.3g} before the impact, "
                f"{channel.noise / usual:.1f} times that of its like"
            )
            remedy = "look at its cable and mounting; do not use it alone"
            found.append(
                _fault(
                    "noise",
                    channel.begin,
                    channel.noise,
                    NOISE_FACTOR * usual,
                    channel,
                    what,
                    remedy,
                )
            )
        if last - channel.end > SHORT_SHARE * (last - begin):
            what = (
                f"it ends at {channel.end:.4f} s, and others go on to {last:.4f} s: what was "
                "recorded then was taken out, or is lost"
            )
            remedy = (
                "use it up to there at most; a channel that failed was seldom sound just before"
            )
            found.append(_fault("cut", channel.end, channel.end, last, channel, what, remedy))
        out.append(replace(channel, faults=tuple(found)))
    return tuple(out)


def _fault(
    kind: str,
    at: float,
    size: float,
    limit: float,
    channel: ChannelHealth | str,
    what: str,
    remedy: str,
) -> Fault:
    name = channel if isinstance(channel, str) else channel.name
    return Fault(
        kind,
        at,
        size,
        limit,
        Finding("sensors.message", quantity=name, message=what, remedy_text=remedy),
    )


def _arrays(time: ArrayLike, values: ArrayLike, name: str) -> tuple[Array, Array]:
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or v.shape != t.shape:
        raise DataError("sensors.times-shape-values", quantity=name, shape=t.shape, shape_2=v.shape)
    bad = np.flatnonzero(~(np.isfinite(t) & np.isfinite(v)))
    back = np.flatnonzero(np.diff(t) <= 0.0) + 1
    if bad.size or back.size:
        row = int(bad[0] if bad.size else back[0]) + 1
        raise DataError(
            "sensors.not-finite-number" if bad.size else "sensors.time-does-not-advance",
            row=row,
            quantity=name,
        )
    return t, v


def _usual_run(rest: Array) -> int:
    """Longest run of equal values at rest, which the steps of the converter make."""
    longest = int(equal_runs(rest)[1].max())
    # A channel that never moves at rest, as one that is dead, tells no usual run.
    return 1 if longest == rest.size else longest


def _stuck(t: Array, v: Array, usual: int, name: str) -> list[Fault]:
    starts, lengths = equal_runs(v)
    step = float(t[-1] - t[0]) / (t.size - 1)
    limit = max(STUCK_LEAST, math.ceil(STUCK_TIME / step), STUCK_FACTOR * usual)
    k = int(np.argmax(lengths))
    if lengths[k] < limit:
        return []
    at, long = float(t[starts[k]]), float(lengths[k] * step)
    what = f"it repeats {v[starts[k]]:.6g} for {lengths[k]} samples from {at:.4f} s on"
    return [_fault("stuck", at, long, limit * step, name, what, "do not use it from there on")]


def _saturation(
    t: Array, v: Array, noise: float, usual: int, full_scale: float | None, name: str
) -> list[Fault]:
    faults = []
    if full_scale is not None and math.isfinite(full_scale):
        limit = FULL_SHARE * full_scale
        over = np.flatnonzero(np.abs(v) >= limit)
        if over.size:
            at, size = float(t[over[0]]), float(np.abs(v).max())
            what = f"it reaches {size:.5g} of a range of {full_scale:.5g}, first at {at:.4f} s"
            remedy = "what it misses is not in its integral: take a higher range there"
            return [_fault("saturation", at, size, limit, name, what, remedy)]
    starts, lengths = equal_runs(v)
    for extreme in (float(v.max()), float(v.min())):
        top = (v[starts] == extreme) & (lengths >= max(FLAT_TOP, 2 * usual))
        if top.any() and abs(extreme - float(np.median(v))) > JUMP_FACTOR * noise:
            k = int(np.flatnonzero(top)[0])
            at = float(t[starts[k]])
            what = (
                f"its extreme, {extreme:.5g}, is flat over {lengths[k]} samples at {at:.4f} s: the "
                "end of a range, or a clipped amplifier"
            )
            remedy = "what it misses is not in its integral: take a higher range there"
            faults.append(_fault("saturation", at, abs(extreme), abs(extreme), name, what, remedy))
    return faults


def _jump(t: Array, v: Array, noise: float, name: str) -> list[Fault]:
    """A step between two levels that are each as quiet as the rest."""
    step = float(t[-1] - t[0]) / (t.size - 1)
    width, gap = max(round(JUMP_WINDOW / step), 3), max(round(JUMP_STEP / step), 1)
    if t.size < 2 * width + gap or noise == 0.0:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(v, width)
    mean, sd = windows.mean(axis=1), windows.std(axis=1)
    before, after = slice(0, mean.size - width - gap), slice(width + gap, mean.size)
    quiet = (sd[before] <= QUIET_FACTOR * noise) & (sd[after] <= QUIET_FACTOR * noise)
    part = max(width // 6, 1)
    near = windows[after, :part].mean(axis=1) - windows[before, -part:].mean(axis=1)
    rise = mean[after] - mean[before]
    size = np.where(quiet & (near * np.sign(rise) >= ABRUPT * np.abs(rise)), np.abs(rise), 0.0)
    limit = JUMP_FACTOR * noise
    k = int(np.argmax(size))
    if size[k] <= limit:
        return []
    at = float(t[k + width])
    what = f"its level steps by {size[k]:.4g} at {at:.4f} s, and is quiet before and after"
    remedy = "take its zero anew after the step, or leave it out"
    return [_fault("jump", at, float(size[k]), limit, name, what, remedy)]


def _end(t: Array, velocity: float, offset: float, entry: float, name: str) -> list[Fault]:
    faults = []
    end = float(t[-1])
    if abs(offset) > SETTLED:
        what = (
            f"mean of {offset:.3g} m/s² over the last {1e3 * SETTLED_WINDOW:.0f} ms: its zero "
            "moved, or its part is not at rest"
        )
        remedy = "its integral drifts by as much each second; compare it with its like"
        faults.append(
            _fault("offset", end - SETTLED_WINDOW, abs(offset), SETTLED, name, what, remedy)
        )
    limit = RESTITUTION * abs(entry) + SPEED_LEFT
    if abs(velocity) > limit:
        what = (
            f"{velocity:.3g} m/s at the end, after {entry:.3g} m/s before: it does not come to rest"
        )
        remedy = "its zero or scale is off, its part turned, or the record is too short"
        faults.append(_fault("velocity", end, abs(velocity), limit, name, what, remedy))
    return faults
