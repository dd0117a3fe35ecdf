"""Crash indices: ASI, HIC, 3 ms level, Nij, OLC, flail space, THIV and PHD."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY
from strapdown.dsp.channel_class import CfcCoefficients, both_ways
from strapdown.dsp.samples import running_integral
from strapdown.errors import ConfigError, DataError, Finding, check_choice
from strapdown.tables.checks import Array

# Stamps are rounded; steps that differ by more than this fraction are not uniform.
SAME_STEP = 0.02


def checked(
    time: ArrayLike, values: ArrayLike, width: int | None, quantity: str
) -> tuple[Array, Array]:
    """Return stamps, (n,), s, and values, (n,) or (n, width), as arrays.

    `DataError`: shapes disagree, a value is not finite, time does not increase, or fewer than two
    samples.
    """
    t, v = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    wanted = (t.size,) if width is None else (t.size, width)
    if t.ndim != 1 or v.shape != wanted:
        raise DataError(
            "crash.times-shape-values-needed",
            quantity=quantity,
            shape=t.shape,
            shape_2=v.shape,
            wanted=wanted,
        )
    if t.size < 2:
        raise DataError("crash.sample-no-pulse", quantity=quantity, size=t.size)
    for name, array in (("time", t), (quantity, v)):
        bad = np.flatnonzero(~np.isfinite(array).reshape(t.size, -1).all(axis=1))
        if bad.size:
            raise DataError(
                "crash.not-finite-number-sample",
                row=int(bad[0]) + 1,
                quantity=name,
                bad=int(bad[0]) + 1,
            )
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise DataError("crash.time-goes", row=k + 1, quantity="time", t=t[k - 1], t_2=t[k])
    return t, v


def step_of(time: Array) -> float:
    """Uniform step of a record, for a digital filter. `DataError`: the steps differ."""
    steps = np.diff(time)
    step = float(time[-1] - time[0]) / steps.size
    off = np.flatnonzero(np.abs(steps - step) > SAME_STEP * step)
    if off.size:
        k = int(off[0])
        raise DataError(
            "crash.step-not-mean", row=k + 2, quantity="time", steps=steps[k], step=step
        )
    return step


def from_start(time: Array, values: Array, start: float, quantity: str) -> tuple[Array, Array]:
    """Cut a record so that it begins at `start`, interpolated there."""
    if not time[0] <= start < time[-1]:
        raise DataError(
            "crash.start-not-within-record",
            quantity=quantity,
            start=start,
            time=time[0],
            time_2=time[-1],
        )
    k = int(np.searchsorted(time, start, side="right"))
    flat = values.reshape(values.shape[0], -1)
    share = (start - time[k - 1]) / (time[k] - time[k - 1])
    first = flat[k - 1] + share * (flat[k] - flat[k - 1])
    cut = np.vstack([first, flat[k:]]).reshape(-1, *values.shape[1:])
    return np.concatenate([[start], time[k:]]), cut


def integrals(time: Array, values: Array) -> tuple[Array, Array]:
    """First and second integral from the first sample, exact for values linear between samples.

    Over a step h from a0 to a1 the first grows by ``h (a0 + a1)/2``, the second by ``h v0 + h² (2
    a0 + a1)/6``.
    """
    h = np.diff(time).reshape(-1, *([1] * (values.ndim - 1)))
    first = running_integral(time, values)
    grown = h * first[:-1] + h * h * (2.0 * values[:-1] + values[1:]) / 6.0
    return first, np.concatenate([first[:1], np.cumsum(grown, axis=0)])


# First instant at which a quantity with known slope reaches a level.


def cubic(time: Array, values: Array, slopes: Array, at: float) -> tuple[float, float]:
    """Value and slope between samples, on the cubic through the two neighbors.

    Exact for the double integral of an acceleration that is linear between samples.
    """
    k = int(np.searchsorted(time[1:-1], at, side="right"))
    h = float(time[k + 1] - time[k])
    u = (at - float(time[k])) / h
    a, b, c, d = _coefficients(values, slopes, k, h)
    return ((a * u + b) * u + c) * u + d, ((3.0 * a * u + 2.0 * b) * u + c) / h


def _coefficients(values: Array, slopes: Array, k: int, h: float) -> tuple[float, ...]:
    """Of ``((a u + b) u + c) u + d``, u from 0 to 1 over the step h from sample k."""
    y0, y1 = float(values[k]), float(values[k + 1])
    m0, m1 = h * float(slopes[k]), h * float(slopes[k + 1])
    return 2.0 * (y0 - y1) + m0 + m1, 3.0 * (y1 - y0) - 2.0 * m0 - m1, m0, y0


def first_reach(time: Array, values: Array, slopes: Array, level: float) -> float | None:
    """Return the first instant at which a quantity reaches a level from below, or None.

    A crossing and return within one step is not detected.
    """
    above = np.flatnonzero(values >= level)
    if not above.size:
        return None
    k = int(above[0])
    if k == 0:
        return float(time[0])
    low, high = float(time[k - 1]), float(time[k])
    # The value at a knot is that of the sample up to rounding: a root there has no change of sign.
    if cubic(time, values, slopes, high)[0] - level <= 0.0:
        return high
    # The bracket is halved until it has no number inside: it is short, and this is done once.
    begin, h = low, float(time[k] - time[k - 1])
    a, b, c, d = _coefficients(values, slopes, k - 1, h)
    while low < (middle := 0.5 * (low + high)) < high:
        u = (middle - begin) / h
        short = ((a * u + b) * u + c) * u + d - level < 0.0
        low, high = (middle, high) if short else (low, middle)
    return high


# Means over a moving window, exact for a record that is linear between its samples.


def moving_means(time: Array, values: Array, width: float) -> tuple[Array, Array]:
    """Means over every window of a width, s, that begins or ends at a sample; and their begins.

    `DataError`: the record is shorter than the window.
    """
    # Stamps are sums of steps: a record as long as its window may be shorter by rounding.
    last = time[-1] - width
    if last < time[0] - 1e-9 * width:
        raise DataError(
            "crash.record-shorter-than-window",
            quantity="time",
            time=time[-1] - time[0],
            width=width,
        )
    last = max(float(last), float(time[0]))
    starts = np.concatenate([time[time <= last], time[time >= time[0] + width] - width, [last]])
    starts = np.unique(np.clip(starts, time[0], last))
    flat = values.reshape(values.shape[0], -1)
    total = running_integral(time, flat)
    ends = np.minimum(starts + width, time[-1])
    means = (
        _integral_at(time, flat, total, ends) - _integral_at(time, flat, total, starts)
    ) / width
    return starts, means.reshape(starts.size, *values.shape[1:])


def largest_mean(time: Array, values: Array, width: float) -> tuple[float, float]:
    """Return the mean of greatest magnitude, signed, and the start of its window.

    Exact for a record that is linear between samples: between two neighboring windows the mean is a
    parabola, whose vertex is where the values at both ends of the window are equal.
    """
    starts, means = moving_means(time, values, width)
    slope = np.interp(starts + width, time, values) - np.interp(starts, time, values)
    inner = np.flatnonzero(slope[:-1] * slope[1:] < 0.0)
    at = starts[inner] + (starts[inner + 1] - starts[inner]) * slope[inner] / (
        slope[inner] - slope[inner + 1]
    )
    total = running_integral(time, values[:, None])
    vertex = (
        _integral_at(time, values[:, None], total, at + width)
        - _integral_at(time, values[:, None], total, at)
    )[:, 0] / width
    starts, means = np.concatenate([starts, at]), np.concatenate([means, vertex])
    k = int(np.argmax(np.abs(means)))
    return float(means[k]), float(starts[k])


def _integral_at(time: Array, values: Array, total: Array, at: Array) -> Array:
    """Integral from the first sample to any instants, of values linear between samples."""
    k = np.searchsorted(time[1:-1], at, side="right")
    h = (time[k + 1] - time[k])[:, None]
    into = (at - time[k])[:, None]
    slope = (values[k + 1] - values[k]) / h
    return np.asarray(total[k] + into * (values[k] + 0.5 * into * slope))


# Zero-phase four-pole Butterworth low-pass of EN 1317-1:2010.

#: Whether the cut-off frequency is that of the whole filter or of each pass.
CUTOFFS = ("whole", "pass")
# Length of the extension before and after the record, s, as in T/HIS for EN 1317-1:2010.
PADDING = 0.5
# Both passes together attenuate by 1/(1 + (f/each)^4), which is 3 dB at this fraction of their
# own cut-off, 0.8022.
PASS_SHARE = (math.sqrt(2.0) - 1.0) ** 0.25


def four_pole(time: Array, values: Array, frequency: float, cutoff: str = "whole") -> Array:
    """Filter forward and backward with two poles each; uniform steps.

    `cutoff`: ``whole``: the whole filter is 3 dB down at the frequency, Hz; ``pass``: each pass (6
    dB for the whole). The record is extended at both ends by its point reflection, by 0.5 s or as
    much as there is, so that one that is stationary at its ends starts and stops without a
    transient. `DataError`: steps are not uniform, or the rate is less than ten times the frequency.
    """
    check_choice("crash.no-kind-cut-off", CUTOFFS, quantity="cutoff", cutoff=cutoff)
    step = step_of(time)
    if 1.0 / step < 10.0 * frequency:
        raise DataError(
            "crash.rate-hz-less-than-ten", quantity="time", step=1.0 / step, frequency=frequency
        )
    each = frequency / PASS_SHARE if cutoff == "whole" else frequency
    # Bilinear transformation of the upper of two poles.
    tangent = np.tan(np.pi * (each / (1.0 / step)))
    pole = -tangent * np.exp(-0.25j * np.pi)
    gain = tangent**2 * (1.0 / _square(1.0 - pole))
    pole = (1.0 + pole) / (1.0 - pole)
    one_pass = CfcCoefficients(gain, 2.0 * gain, gain, 2.0 * pole.real, -_square(pole))
    padding = min(round(PADDING / step), time.size - 1)
    channels = values.reshape(len(values), -1)
    return both_ways(one_pass, channels, padding, summed=True).reshape(values.shape)


def _square(number: complex) -> float:
    return float(number.real * number.real + number.imag * number.imag)


# Acceleration severity index.

#: Smoothing of the accelerations, by edition of EN 1317-1.
ASI_AVERAGES: dict[str, str] = {
    "mean_50ms": "EN 1317-1:1998, mean over a moving window of 50 ms",
    "butterworth_13hz": "EN 1317-1:2010, four-pole Butterworth low-pass without phase, 13 Hz",
}
LIMITS_G = (12.0, 9.0, 10.0)
WINDOW = 0.05  # s
FREQUENCY = 13.0  # Hz


@dataclass(frozen=True, eq=False)
class Asi:
    """Acceleration severity index of a record.

    Attributes
    ----------
    value : float
        Maximum; dimensionless.
    at : float, s
        Center of the window.
    average : str
        One of `ASI_AVERAGES`.
    time, history : ndarray, (m,)
        The index over time.
    """

    value: float
    at: float
    average: str
    time: Array = field(repr=False)
    history: Array = field(repr=False)


def asi(
    time: ArrayLike, accel: ArrayLike, *, average: str = "butterworth_13hz", cutoff: str = "whole"
) -> Asi:
    """Acceleration severity index of the vehicle at a point near its occupants.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 3), m/s²
        Acceleration in vehicle axes, without gravity, of class CFC 180.
    average : {'butterworth_13hz', 'mean_50ms'}
        Edition of 2010 or of 1998.
    cutoff : {'whole', 'pass'}
        Meaning of the 13 Hz: `four_pole`. The standard gives the frequency; its plain
        meaning is -3 dB there for the whole filter. Two passes of 13 Hz each smooth more and
        give smaller values on short pulses.

    Raises
    ------
    DataError
        The shapes, values or times are not valid; the record is shorter than 50 ms, or its steps
        are not uniform.
    ConfigError
        An option is unknown.

    Notes
    -----
    ``ASI(t) = sqrt((ax/12 g)² + (ay/9 g)² + (az/10 g)²)`` of the smoothed components (EN 1317-1,
    the clause on impact severity; limits, both editions and their averages as the manual of
    T/HIS 22.1 states them, page "Acceleration Severity Index").
    """
    t, a = checked(time, accel, 3, "accel")
    if average == "mean_50ms":
        starts, smooth = moving_means(t, a, WINDOW)
        stamps = starts + 0.5 * WINDOW
    elif average == "butterworth_13hz":
        stamps, smooth = t, four_pole(t, a, FREQUENCY, cutoff)
    else:
        raise ConfigError(
            "crash.no-average-asi",
            quantity="average",
            average=average,
            word=average,
            known=ASI_AVERAGES,
        )
    shares = smooth / (np.array(LIMITS_G) * STANDARD_GRAVITY)
    history = np.sqrt((shares * shares).sum(axis=1))
    k = int(np.argmax(history))
    return Asi(float(history[k]), float(stamps[k]), average, stamps, history)


# Head injury criterion.


@dataclass(frozen=True)
class Hic:
    """Head injury criterion of a record.

    Attributes
    ----------
    value : float
        In the customary unit, s g^2.5.
    begin, end : float, s
        Window with the maximum.
    longest : float, s
        Longest window evaluated.
    """

    value: float
    begin: float
    end: float
    longest: float


def hic(time: ArrayLike, accel: ArrayLike, *, longest: float = 0.015) -> Hic:
    """Head injury criterion: maximum over all windows between samples.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 3), m/s²
        Of the head's center of gravity, of class CFC 1000.
    longest : float, s
        0.015 for HIC15, 0.036 for HIC36.

    Raises
    ------
    DataError
        The shapes, values or times are not valid.
    ConfigError
        `longest` is not a positive, finite time.

    Notes
    -----
    ``max (t2 - t1) [1/(t2 - t1) ∫ a dt]^2.5`` with a the resultant in g, over windows that begin
    and end at samples (49 CFR 571.208, S6.2). Every pair of samples is evaluated.
    """
    if not (math.isfinite(longest) and longest > 0.0):
        raise ConfigError("crash.no-length-window", quantity="longest", longest=longest)
    t, a = checked(time, accel, 3, "accel")
    total = running_integral(t, np.sqrt((a * a).sum(axis=1)) / STANDARD_GRAVITY)
    best = (0.0, 0, 1)
    # By number of samples between the ends, until every window is too long.
    for apart in range(1, t.size):
        length = t[apart:] - t[:-apart]
        fits = length <= longest * (1.0 + 1e-9)
        if not fits.any():
            break
        rise = total[apart:] - total[:-apart]
        values = np.where(fits, length * np.abs(rise / length) ** 2.5, -1.0)
        k = int(np.argmax(values))
        if values[k] > best[0]:
            best = (float(values[k]), k, k + apart)
    return Hic(best[0], float(t[best[1]]), float(t[best[2]]), longest)


# Level exceeded for 3 ms.


def exceeded_level(time: ArrayLike, values: ArrayLike, *, duration: float = 0.003) -> float:
    """Highest level that a quantity reaches or exceeds for a cumulative duration.

    Parameters
    ----------
    time : array_like, (n,), s
    values : array_like, (n,)
        As the resultant acceleration of head (class CFC 1000) or chest (CFC 180).
    duration : float, s
        Sum of all intervals above the level.

    Returns
    -------
    float
        In the unit of the values.

    Raises
    ------
    DataError
        The shapes, values or times are not valid; the record is shorter than the duration.
    ConfigError
        `duration` is not a positive, finite time.

    Notes
    -----
    "shall not exceed 60 g's except for intervals whose cumulative duration is not more than 3
    milliseconds" (49 CFR 571.208, S6.3). Exact for values that are linear between samples.
    """
    if not (math.isfinite(duration) and duration > 0.0):
        raise ConfigError("crash.no-length-window", quantity="duration", longest=duration)
    t, v = checked(time, values, None, "values")
    if t[-1] - t[0] < duration * (1.0 - 1e-9):
        raise DataError(
            "crash.record-shorter-than-window", quantity="time", time=t[-1] - t[0], width=duration
        )
    step = np.diff(t)
    low, high = np.minimum(v[:-1], v[1:]), np.maximum(v[:-1], v[1:])
    rise = np.where(high > low, high - low, 1.0)

    def above(level: float) -> float:
        share = np.where(high > low, np.clip((high - level) / rise, 0.0, 1.0), high >= level)
        return float((step * share).sum())

    # The time above falls with the level, between two sample values along a straight line, and by a
    # jump at a value that lasts.
    levels = np.unique(v)
    first, last = 0, levels.size
    while last - first > 1:
        middle = (first + last) // 2
        first, last = (middle, last) if above(levels[middle]) >= duration else (first, middle)
    if last == levels.size:
        return float(levels[first])
    lower, upper = float(levels[first]), float(levels[last])
    span = upper - lower
    near, far = above(lower + 0.25 * span), above(lower + 0.75 * span)
    if near <= far:
        return lower
    return float(
        np.clip(lower + span * (0.25 + 0.5 * (near - duration) / (near - far)), lower, upper)
    )


# Normalized neck injury criterion.


#: Critical values of an in-position dummy: tension N, compression N, flexion N m, extension N m.
#: Hybrid III of a mid-sized man (49 CFR 571.208, S6.6) and of a small woman (S15.3.6).
NECK_INTERCEPTS: dict[str, tuple[float, float, float, float]] = {
    "H3": (6806.0, 6160.0, 310.0, 135.0),
    "HF": (4287.0, 3880.0, 155.0, 67.0),
}
#: From the upper neck load cell down to the occipital condyle of both, m.
CONDYLE = 0.01778


@dataclass(frozen=True)
class Nij:
    """Normalized neck injury criterion of a record.

    Attributes
    ----------
    value : float
    kind : {'tension-flexion', 'tension-extension', 'compression-flexion', 'compression-extension'}
        Load that gives the maximum.
    at : float, s
    """

    value: float
    kind: str
    at: float


def nij(
    time: ArrayLike,
    force_x: ArrayLike,
    force_z: ArrayLike,
    moment_y: ArrayLike,
    *,
    intercepts: tuple[float, float, float, float] = NECK_INTERCEPTS["H3"],
) -> Nij:
    """Normalized neck injury criterion of an upper neck load cell.

    Parameters
    ----------
    time : array_like, (n,), s
    force_x, force_z : array_like, (n,), N
        Shear and axial force by the signs of SAE J211: tension is positive. Of class CFC 600.
    moment_y : array_like, (n,), N m
        At the load cell; flexion is positive. Of class CFC 600.
    intercepts : tuple of float
        As `NECK_INTERCEPTS`.

    Raises
    ------
    DataError
        The shapes, values or times are not valid.

    Notes
    -----
    ``|Fz|/Fzc + |Mocy|/Myc`` with the moment about the occipital condyle ``Mocy = My - 0.01778 m
    Fx`` (49 CFR 571.208, S6.6). At every instant one of the four has its critical values.
    """
    t, fz = checked(time, force_z, None, "force_z")
    fx = checked(time, force_x, None, "force_x")[1]
    moment = checked(time, moment_y, None, "moment_y")[1] - CONDYLE * fx
    tension, compression, flexion, extension = intercepts
    values = np.where(fz >= 0.0, fz / tension, -fz / compression)
    values += np.where(moment >= 0.0, moment / flexion, -moment / extension)
    k = int(np.argmax(values))
    kind = f"{'tension' if fz[k] >= 0.0 else 'compression'}-"
    return Nij(
        float(values[k]), kind + ("flexion" if moment[k] >= 0.0 else "extension"), float(t[k])
    )


# Occupant load criterion.


FREE, WHOLE = 0.065, 0.300  # m


@dataclass(frozen=True)
class Olc:
    """Occupant load criterion of a pulse.

    Attributes
    ----------
    value_g : float or None
        Deceleration of the ideally restrained occupant, in g; None where the pulse is too weak.
    restraint_from, restraint_to : float, s, or None
        Instants, from the start, between which the restraint acts.
    """

    value_g: float | None
    restraint_from: float | None
    restraint_to: float | None
    findings: tuple[Finding, ...] = ()


def olc(
    time: ArrayLike,
    accel_x: ArrayLike,
    *,
    start: float = 0.0,
    free: float = FREE,
    whole: float = WHOLE,
) -> Olc:
    """Constant deceleration of an occupant who first flies freely and is then ideally restrained.

    Parameters
    ----------
    time : array_like, (n,), s
    accel_x : array_like, (n,), m/s²
        Forward acceleration of the vehicle, of class CFC 180; negative in a frontal impact.
    start : float, s
        First contact.
    free, whole : float, m
        Travel of the occupant relative to the vehicle before the restraint acts, and in total.

    Raises
    ------
    DataError
        The shapes, values or times are not valid; `start` is not in the record.
    ConfigError
        The travels do not satisfy ``0 <= free < whole``.

    Notes
    -----
    With ``u`` the velocity that the vehicle has lost and ``d`` its integral: the restraint acts
    from t1, where ``d = 65 mm``, and decelerates the occupant uniformly to the vehicle's velocity
    at t2, where the occupant has moved by 300 mm in all: ``d(t2) - u(t2) (t2 - t1)/2 = 300 mm``.
    The criterion is ``u(t2)/(t2 - t1)``. Euro NCAP Technical Bulletin TB 027, v1.1.1, as the
    manual of T/HIS 22.1 describes it (page "Occupant Load Criterion"; the 0.0235 m printed there
    is 0.300 - 0.065 = 0.235 m). Exact for acceleration that is linear between samples.
    """
    if not (math.isfinite(whole) and 0.0 <= free < whole):
        raise ConfigError(
            "crash.olc-ways-out-of-order", quantity="free, whole", free=free, whole=whole
        )
    t, a = from_start(*checked(time, accel_x, None, "accel_x"), start, "start")
    lost, ahead = integrals(t, -a)
    begin = first_reach(t, ahead, lost, free)
    if begin is None:
        return Olc(None, None, None, (_weak(float(ahead.max()), free),))
    rest = t - begin
    way = ahead - 0.5 * lost * rest
    slope = 0.5 * (lost + a * rest)
    # Before the restraint acts the formula is not valid.
    later = t > begin
    at_begin = cubic(t, ahead, lost, begin)

    knots = np.concatenate([[begin], t[later]])
    ways = np.concatenate([[at_begin[0]], way[later]])
    slopes = np.concatenate([[0.5 * at_begin[1]], slope[later]])
    end = first_reach(knots, ways, slopes, whole)
    if end is None:
        return Olc(None, begin - start, None, (_weak(float(ways.max()), whole),))
    velocity = cubic(t, ahead, lost, end)[1]
    value = velocity / (end - begin) / STANDARD_GRAVITY
    return Olc(value, begin - start, end - start)


def _weak(reached: float, needed: float) -> Finding:
    return Finding(
        "crash.occupant-moves-relative-vehicle-not", quantity="OLC", reached=reached, needed=needed
    )


# Occupant impact velocity and ridedown acceleration: the flail-space model.


FORWARD, SIDEWAYS = 0.6, 0.3  # m
RIDEDOWN_WINDOW = 0.01  # s


@dataclass(frozen=True)
class FlailSpace:
    """Occupant risk by the flail-space model.

    Attributes
    ----------
    oiv_x, oiv_y : float, m/s
        Occupant impact velocity: of the occupant relative to the vehicle, forward and
        right.
    at : float, s, or None
        Of the occupant's impact, on the record's clock; None without an impact, and the
        velocities are then the greatest changes of the vehicle's velocity.
    ora_x_g, ora_y_g : float or None
        Ridedown acceleration of the vehicle: the 10 ms mean of greatest magnitude after the
        impact, in g, signed.
    """

    oiv_x: float
    oiv_y: float
    at: float | None
    ora_x_g: float | None
    ora_y_g: float | None
    findings: tuple[Finding, ...] = ()


def flail_space(
    time: ArrayLike,
    accel: ArrayLike,
    *,
    start: float = 0.0,
    forward: float = FORWARD,
    sideways: float = SIDEWAYS,
) -> FlailSpace:
    """Occupant impact velocity, and the subsequent ridedown acceleration.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 2) or (n, 3), m/s²
        Of the vehicle near its center of gravity, forward and right, without gravity, of
        class CFC 180.
    start : float, s
        First contact.
    forward, sideways : float, m
        Flail space; the same to the rear and to the left.

    Raises
    ------
    DataError
        The shapes, values or times are not valid; `start` is not in the record.
    ConfigError
        A distance is not valid.

    Notes
    -----
    Each axis separately, rotation of the vehicle neglected: the occupant moves by ``-∬ a``
    relative to the vehicle and hits it at 0.6 m along or 0.3 m across, whichever is first; the
    velocities are ``-∫ a`` then. Where neither is reached, they are the vehicle's changes of
    velocity (Michie 1981, Transportation Research Record 796; NCHRP Report 350, 1993, and MASH
    2009, occupant risk). Exact for acceleration that is linear between samples.
    """
    for name, distance in (("forward", forward), ("sideways", sideways)):
        if not (math.isfinite(distance) and distance > 0.0):
            raise ConfigError("crash.no-space", quantity=name, distance=distance)
    plane = np.asarray(accel, dtype=np.float64)
    t, a = checked(time, plane[:, :2] if plane.ndim == 2 else plane, 2, "accel")
    t, a = from_start(t, a, start, "start")
    velocity, way = integrals(t, -a)
    met = [
        at
        for axis, distance in ((0, forward), (1, sideways))
        for sign in (1.0, -1.0)
        if (at := first_reach(t, sign * way[:, axis], sign * velocity[:, axis], distance))
        is not None
    ]
    if not met:
        x, y = (float(v[np.argmax(np.abs(v))]) for v in velocity.T)
        found = Finding(
            "crash.occupant-moves-less-than-along",
            quantity="OIV",
            forward=forward,
            sideways=sideways,
            t=t[-1],
        )
        return FlailSpace(x, y, None, None, None, (found,))
    at = min(met)
    x, y = (cubic(t, way[:, k], velocity[:, k], at)[1] for k in (0, 1))
    try:
        rest, values = from_start(t, a, at, "ORA")
        ora = [
            largest_mean(rest, values[:, k], RIDEDOWN_WINDOW)[0] / STANDARD_GRAVITY for k in (0, 1)
        ]
    except DataError:
        found = Finding("crash.record-ends-before-ora", quantity="ORA", at=at)
        return FlailSpace(x, y, at, None, None, (found,))
    return FlailSpace(x, y, at, ora[0], ora[1])


# Theoretical head impact velocity and post-impact head deceleration.

THIV_WINDOW = 0.01  # s
THIV_FREQUENCY = 10.0  # Hz
#: Smoothing of the acceleration after the head impact.
PHD_AVERAGES: dict[str, str] = {
    "mean_10ms": "mean of the resultant over a moving window of 10 ms (EN 1317-1:1998; MASH)",
    "butterworth_10hz": "resultant of the components through a four-pole Butterworth low-pass "
    "without phase, 10 Hz",
}


@dataclass(frozen=True)
class Thiv:
    """Impact of a head that flies freely in the vehicle.

    Attributes
    ----------
    velocity : float, m/s, or None
        Of the head relative to the vehicle at its impact; None without an impact.
    time_of_flight : float, s, or None
        From the start.
    surface : str or None
        ``front``, ``right`` or ``left`` of the vehicle.
    phd_g : float or None
        Post-impact head deceleration, in g.
    phd_at : float, s, or None
        On the record's clock: start of the window, or the instant of the filtered peak.
    largest : float, m/s
        Greatest velocity of the head relative to the vehicle up to its impact, or to the end.
    """

    velocity: float | None
    time_of_flight: float | None
    surface: str | None
    phd_g: float | None
    phd_at: float | None
    largest: float
    findings: tuple[Finding, ...] = ()


def thiv(
    time: ArrayLike,
    accel: ArrayLike,
    yaw_rate: ArrayLike | None = None,
    *,
    start: float = 0.0,
    head: tuple[float, float] = (0.0, 0.0),
    forward: float = FORWARD,
    sideways: float = SIDEWAYS,
    phd_average: str = "mean_10ms",
) -> Thiv:
    """Theoretical head impact velocity, and the subsequent deceleration.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 2) or (n, 3), m/s²
        Acceleration of the reference point, forward and right, without gravity, of class
        CFC 180.
    yaw_rate : array_like, (n,), rad/s, optional
        About the downward axis: clockwise from above; by default zero.
    start : float, s
        First contact.
    head : pair of float, m
        The head before the impact, forward and right of the reference point.
    forward, sideways : float, m
        Flight distance of the head to the surfaces.
    phd_average : {'mean_10ms', 'butterworth_10hz'}

    Raises
    ------
    DataError
        The shapes, values or times are not valid; `start` is not in the record.
    ConfigError
        An option is unknown, or a distance is none.

    Notes
    -----
    The head keeps the velocity of the reference point at `start`. In nonrotating axes that move
    with this velocity, the vehicle's point moves by ``X'' = ax cos ψ - ay sin ψ``,
    ``Y'' = ax sin ψ + ay cos ψ``; the head, at rest there, is at ``(x, y) = C(ψ)ᵀ (head - (X, Y))``
    in the vehicle. It hits a surface where x has grown by `forward` or y has changed by
    `sideways`, whichever is first, with the velocity ``(x', y')``, including the rotation of the
    vehicle (EN 1317-1, clauses on THIV and PHD; MASH 2009, appendix F2, which adopts it).
    The model has no surface behind the head. Exact for acceleration that is linear between
    samples and no yaw; with yaw, of the second order of the step.
    """
    t, a, rate = _inputs(time, accel, yaw_rate, forward, sideways, phd_average)
    table = np.column_stack([a, rate])
    after, cut = from_start(t, table, start, "start")
    position, velocity = _head_in_vehicle(after, cut[:, :2], cut[:, 2], np.asarray(head))
    meeting = _first_surface(after, position, velocity, head, forward, sideways)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    if meeting is None:
        found = Finding(
            "crash.head-flies-less-than-forward",
            quantity="THIV",
            forward=forward,
            sideways=sideways,
            after=after[-1],
        )
        return Thiv(None, None, None, None, None, float(speed.max()), (found,))
    at, surface = meeting
    met = [cubic(after, position[:, k], velocity[:, k], at)[1] for k in (0, 1)]
    flown = speed[after <= at]
    thiv_value = math.hypot(*met)
    phd, phd_at, findings = _after_impact(t, a, at, phd_average)
    return Thiv(
        thiv_value, at - start, surface, phd, phd_at, max(float(flown.max()), thiv_value), findings
    )


def _inputs(
    time: ArrayLike,
    accel: ArrayLike,
    yaw_rate: ArrayLike | None,
    forward: float,
    sideways: float,
    phd_average: str,
) -> tuple[Array, Array, Array]:
    check_choice(
        "crash.no-average-phd", PHD_AVERAGES, quantity="phd_average", phd_average=phd_average
    )
    for name, distance in (("forward", forward), ("sideways", sideways)):
        if not (math.isfinite(distance) and distance > 0.0):
            raise ConfigError("crash.no-way-fly", quantity=name, distance=distance)
    plane = np.asarray(accel, dtype=np.float64)
    t, a = checked(time, plane[:, :2] if plane.ndim == 2 else plane, 2, "accel")
    rate = np.zeros(t.size) if yaw_rate is None else checked(time, yaw_rate, None, "yaw_rate")[1]
    return t, a, rate


def _head_in_vehicle(time: Array, accel: Array, rate: Array, head: Array) -> tuple[Array, Array]:
    """Position of the head in vehicle axes, and its velocity there."""
    yaw = running_integral(time, rate)
    c, s = np.cos(yaw), np.sin(yaw)
    level = np.column_stack([c * accel[:, 0] - s * accel[:, 1], s * accel[:, 0] + c * accel[:, 1]])
    moved, place = integrals(time, level)
    away = head - place
    x, y = c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]
    vx = rate * y - (c * moved[:, 0] + s * moved[:, 1])
    vy = -rate * x - (c * moved[:, 1] - s * moved[:, 0])
    return np.column_stack([x, y]), np.column_stack([vx, vy])


def _first_surface(
    time: Array,
    position: Array,
    velocity: Array,
    head: tuple[float, float],
    forward: float,
    sideways: float,
) -> tuple[float, str] | None:
    sides = (("front", 0, 1.0, forward), ("right", 1, 1.0, sideways), ("left", 1, -1.0, sideways))
    met = []
    for surface, axis, sign, distance in sides:
        flown = sign * (position[:, axis] - head[axis])
        at = first_reach(time, flown, sign * velocity[:, axis], distance)
        if at is not None:
            met.append((at, surface))
    return min(met) if met else None


def _after_impact(
    time: Array, accel: Array, at: float, average: str
) -> tuple[float | None, float | None, tuple[Finding, ...]]:
    if average == "butterworth_10hz":
        smooth = four_pole(time, accel, THIV_FREQUENCY)
        rest, values = from_start(time, np.hypot(smooth[:, 0], smooth[:, 1]), at, "PHD")
        k = int(np.argmax(values))
        return float(values[k]) / STANDARD_GRAVITY, float(rest[k]), ()
    try:
        rest, values = from_start(time, np.hypot(accel[:, 0], accel[:, 1]), at, "PHD")
        phd, begins = largest_mean(rest, values, THIV_WINDOW)
    except DataError:
        found = Finding("crash.record-ends-before-phd", quantity="PHD", at=at)
        return None, None, (found,)
    return phd / STANDARD_GRAVITY, begins, ()
