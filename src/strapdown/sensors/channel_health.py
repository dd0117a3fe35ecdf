"""Health tests of the channels of a crash record, individually and against similar channels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError, Finding
from strapdown.sensors.health_log import equal_runs

__all__ = ["ChannelHealth", "Fault", "check_channel", "check_peers"]

Array = NDArray[np.float64]

# A moving sensor does not repeat a value for this long in a crash, unless its quantization is
# coarse, which then also shows at rest.
STUCK_TIME = 5e-3  # s
STUCK_LEAST = 10  # samples
STUCK_FACTOR = 4.0
# Consecutive samples at the end of the range, and the fraction of the range that counts as end.
FLAT_TOP = 3  # samples
FULL_SHARE = 0.98
# A step between quiet levels: averaging time of the means, and the largest step duration. A ramp
# with the same noise makes the means differ by 4.3 times the noise at most.
JUMP_WINDOW, JUMP_STEP = 5e-3, 5e-4  # s
JUMP_FACTOR, QUIET_FACTOR = 8.0, 1.5
# Fraction of the step between the near sixths of both windows, 1.3 ms apart; a rotating head takes
# longer.
ABRUPT = 0.8
# Largest deceleration after a crash: tires on a road, not locked.
SETTLED = 5.0  # m/s²
SETTLED_WINDOW = 0.05  # s
# Cars rebound from rigid walls with less restitution; 1 m/s corresponds to a bias of 0.3 g over a
# third of a second.
RESTITUTION, SPEED_LEFT = 0.3, 1.0  # m/s
# Against similar channels: ratio of noise before the impact, and missing fraction of the record.
NOISE_FACTOR = 3.0
SHORT_SHARE = 0.1
LEAST_REST = 20  # samples


@dataclass(frozen=True)
class Fault:
    """A defect of a channel.

    Attributes
    ----------
    kind : str
        ``stuck``, ``saturation``, ``jump``, ``offset``, ``velocity``, ``noise``, ``cut``.
    at : float, s
        Start of the fault.
    size, limit : float
        Measured value and its limit, in the channel's unit, its integral's, or s.
    """

    kind: str
    at: float
    size: float
    limit: float
    finding: Finding


@dataclass(frozen=True)
class ChannelHealth:
    """Test results of a channel.

    Attributes
    ----------
    name : str
    begin, end : float, s
    noise : float
        Standard deviation before the impact, in the channel's unit.
    velocity : float, m/s, or None
        Velocity at the end, for an accelerometer: entry speed plus integral.
    offset : float or None
        Mean over the last 50 ms, for an accelerometer.
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
    """Test a single channel.

    Parameters
    ----------
    time : array_like, (n,), s
    values : array_like, (n,)
        SI.
    name : str
        For messages.
    acceleration : bool
        Whether it is an acceleration, to test its mean and integral at the end. These two tests
        assume a part that moves straight and comes to rest within the record; for others, such as a
        dummy's head, they give false alarms.
    full_scale : float, optional
        End of its range, same unit.
    entry_speed : float, m/s
        Along its axis before the impact.
    rest_until : float, s
        End of the quiet time before the impact.

    Returns
    -------
    ChannelHealth

    Raises
    ------
    DataError
        The shapes disagree, a value is not finite, time does not increase, or fewer than 20 samples
        precede `rest_until`.
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
    """Compare channels of one kind: noise before the impact, and ends of their records.

    Parameters
    ----------
    channels : sequence of ChannelHealth
        From one kind of sensor and one recorder.

    Returns
    -------
    tuple of ChannelHealth
        The same channels with the new faults added.
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
            code, limit = "sensors.channel-noise", NOISE_FACTOR * usual
            at, ratio = channel.begin, channel.noise / usual
            found.append(_fault("noise", at, channel.noise, limit, channel.name, code, ratio=ratio))
        if last - channel.end > SHORT_SHARE * (last - begin):
            code, end = "sensors.channel-cut", channel.end
            found.append(_fault("cut", end, end, last, channel.name, code))
        out.append(replace(channel, faults=tuple(found)))
    return tuple(out)


def _fault(
    kind: str, at: float, size: float, limit: float, channel: str, code: str, **values: Any
) -> Fault:
    data = {"at": at, "size": size, "limit": limit, **values}
    return Fault(kind, at, size, limit, Finding(code, quantity=channel, data=data))


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
    """Longest run of equal values at rest, caused by quantization."""
    longest = int(equal_runs(rest)[1].max())
    # A channel that is constant at rest may be dead, and its run is not representative.
    return 1 if longest == rest.size else longest


def _stuck(t: Array, v: Array, usual: int, name: str) -> list[Fault]:
    starts, lengths = equal_runs(v)
    step = float(t[-1] - t[0]) / (t.size - 1)
    limit = max(STUCK_LEAST, math.ceil(STUCK_TIME / step), STUCK_FACTOR * usual)
    k = int(np.argmax(lengths))
    if lengths[k] < limit:
        return []
    at, long = float(t[starts[k]]), float(lengths[k] * step)
    said = {"value": v[starts[k]], "count": int(lengths[k])}
    return [_fault("stuck", at, long, limit * step, name, "sensors.channel-stuck", **said)]


def _saturation(
    t: Array, v: Array, noise: float, usual: int, full_scale: float | None, name: str
) -> list[Fault]:
    faults = []
    if full_scale is not None and math.isfinite(full_scale):
        limit = FULL_SHARE * full_scale
        over = np.flatnonzero(np.abs(v) >= limit)
        if over.size:
            at, size = float(t[over[0]]), float(np.abs(v).max())
            code = "sensors.channel-at-full-scale"
            return [_fault("saturation", at, size, limit, name, code, full_scale=full_scale)]
    starts, lengths = equal_runs(v)
    for extreme in (float(v.max()), float(v.min())):
        top = (v[starts] == extreme) & (lengths >= max(FLAT_TOP, 2 * usual))
        if top.any() and abs(extreme - float(np.median(v))) > JUMP_FACTOR * noise:
            k = int(np.flatnonzero(top)[0])
            at, size = float(t[starts[k]]), abs(extreme)
            code, count = "sensors.channel-flat-top", int(lengths[k])
            faults.append(
                _fault("saturation", at, size, size, name, code, extreme=extreme, count=count)
            )
    return faults


def _jump(t: Array, v: Array, noise: float, name: str) -> list[Fault]:
    """Find a step between two levels that are each as quiet as at rest."""
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
    return [_fault("jump", at, float(size[k]), limit, name, "sensors.channel-level-steps")]


def _end(t: Array, velocity: float, offset: float, entry: float, name: str) -> list[Fault]:
    faults = []
    end = float(t[-1])
    if abs(offset) > SETTLED:
        said = {"offset": offset, "window_ms": 1e3 * SETTLED_WINDOW}
        at, code = end - SETTLED_WINDOW, "sensors.channel-offset-at-end"
        faults.append(_fault("offset", at, abs(offset), SETTLED, name, code, **said))
    limit = RESTITUTION * abs(entry) + SPEED_LEFT
    if abs(velocity) > limit:
        said = {"velocity": velocity, "entry": entry}
        code = "sensors.channel-not-at-rest-at-end"
        faults.append(_fault("velocity", end, abs(velocity), limit, name, code, **said))
    return faults
