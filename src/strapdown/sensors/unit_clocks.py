"""Clock offsets of units on one vehicle, from the common trigger or by correlation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown.constants import Flags
from strapdown.dsp import decimation
from strapdown.dsp.delay import Delay, EvenSignal, find_delay
from strapdown.dsp.samples import even_step
from strapdown.errors import DataError, Finding, add_warning
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.error_chain import time_constant
from strapdown.sensors.saturation import RangeLimits, find_limits
from strapdown.sensors.triad_channels import OVER_RANGE, AxisGroup, TriadChannels
from strapdown.sensors.triad_errors import check_sd
from strapdown.tables.checks import Array

# Trigger and correlation disagree if they differ by more standard deviations than this.
CONTRADICTION = 4.0
# A trigger further outside its record belongs to another clock.
OUTSIDE = 1.0  # s
FORCE, RATES = "specific force", "rates"


@dataclass(frozen=True)
class UnitClock:
    """Offset of a unit's clock from the common one.

    `offset` (s): unit's stamp minus common time. `sd` (s). `how`: method, for display.
    """

    offset: float
    sd: float
    how: str


@dataclass(frozen=True, eq=False)
class UnitChannels:
    """A unit and the channels of its triads."""

    unit: CrashUnit
    accelerometers: tuple[TriadChannels, ...]
    gyro: TriadChannels | None

    @property
    def triads(self) -> tuple[TriadChannels, ...]:
        """Accelerometers, and the gyro if it has one."""
        return (*self.accelerometers, *(() if self.gyro is None else (self.gyro,)))


def clocks_by_trigger(units: Sequence[UnitChannels]) -> list[UnitClock]:
    """Use each unit's own trigger as zero.

    DataError: a unit has no trigger, or one outside of its record.
    """
    clocks = []
    for u in units:
        trigger = _trigger(u.unit)
        start, end = min(c.start for c in u.triads), max(c.end for c in u.triads)
        if not start - OUTSIDE <= trigger <= end + OUTSIDE:
            raise DataError(
                "sensors.trigger-not-within-record",
                file=u.unit.name,
                quantity="trigger",
                trigger=trigger,
                start=start,
                end=end,
            )
        clocks.append(UnitClock(trigger, u.unit.trigger_sd, "trigger"))
    return clocks


def clocks_by_correlation(
    units: Sequence[UnitChannels], reference: UnitChannels
) -> tuple[list[UnitClock], list[Finding]]:
    """Align each unit's specific force, or rates, with the reference unit's by correlation.

    `reference`: one of the units; its trigger is the common zero. Returns `clocks`: the delays,
    corrected for each part's stated bandwidth. The reference unit's clock has the standard
    deviation 0, because all units share its trigger error; `findings`. DataError: the reference
    unit has no trigger, a unit has too little overlap with it, or the motion is periodic.
    """
    zero = _trigger(reference.unit)
    clocks, findings = [], list[Finding]()
    for u in units:
        if u is reference:
            clocks.append(UnitClock(zero, 0.0, "reference"))
            continue
        delay, what = _delay(reference, u)
        clock = UnitClock(
            zero + delay.delay - (_lag(u, what) - _lag(reference, what)),
            delay.sd,
            f"correlation of the {what}",
        )
        clocks.append(clock)
        if u.unit.trigger is None:
            continue
        off = u.unit.trigger - clock.offset
        sd = math.hypot(clock.sd, math.hypot(u.unit.trigger_sd, reference.unit.trigger_sd))
        if abs(off) > CONTRADICTION * sd:
            add_warning(
                findings,
                "sensors.trigger-lies-ms-put-standard",
                file=u.unit.name,
                quantity="trigger",
                off=1000.0 * off,
                what=what,
                sd=1000.0 * sd,
            )
    return clocks, findings


def _trigger(unit: CrashUnit) -> float:
    if unit.trigger is None or not math.isfinite(unit.trigger):
        raise DataError(
            "sensors.no-trigger" if unit.trigger is None else "sensors.trigger-not-finite",
            file=unit.name,
            quantity="trigger",
            trigger=unit.trigger,
        )
    check_sd(unit.trigger_sd, "trigger_sd", "s", unit.name)
    return unit.trigger


def _lag(u: UnitChannels, what: str) -> float:
    """Delay of the part's own low-pass for slow signals: the time constant of its single pole."""
    triad = u.unit.gyro if what == RATES else u.unit.accelerometers[-1]
    assert triad is not None
    return time_constant(triad.uncertainty.bandwidth)


def _delay(reference: UnitChannels, u: UnitChannels) -> tuple[Delay, str]:
    """Best delay estimate from the triads that both have; magnitudes do not depend on the mounting.

    The widest range is used, because a saturated signal has lost its shape.
    """
    pairs = [(FORCE, reference.accelerometers, u.accelerometers)]
    if not _lacks(reference.unit.gyro) and not _lacks(u.unit.gyro):
        assert reference.gyro is not None and u.gyro is not None
        pairs.append((RATES, (reference.gyro,), (u.gyro,)))
    found, errors = [], []
    for what, first, second in pairs:
        if not (first and second):
            continue
        try:
            found.append((find_delay(_length(first[-1]), _length(second[-1])), what))
        except DataError as error:
            errors.append(error.finding.replace(shown=what))
    if not found:
        raise DataError(
            "sensors.cannot-laid-over" if errors else "sensors.no-triads-to-lay-over",
            file=u.unit.name,
            quantity="time",
            name=reference.unit.name,
            errors=errors,
        )
    return min(found, key=lambda f: f[0].sd)


def _lacks(gyro: RecordedTriad | None) -> bool:
    """Whether the gyro, or any of its axes, is missing: the magnitude of its rates then differs."""
    return gyro is None or bool(gyro.absent)


def _length(channels: TriadChannels) -> EvenSignal:
    """Magnitude of the vector on an even grid, on the unit's clock."""
    step = max(g.step for g in channels.groups)
    n = int((channels.end - channels.start) / step * (1.0 + 1e-9)) + 1
    time = channels.start + step * np.arange(n)
    square = np.zeros(n)
    for g in channels.groups:
        for values in g.values.T:
            square += np.interp(time, g.time, values) ** 2
    shift = 0.5 * step if channels.sampling == "mean" else 0.0
    return EvenSignal(channels.start - shift, step, np.sqrt(square)[:, None])


# Resampling of a triad to common stamps: faster ones without aliasing, slower ones interpolated.


# Stamps that agree to within this fraction of a step are equal.
SAME_STAMP = 1e-3
# Rates within this factor are equal, apart from clock drift.
SAME_RATE = 1.01
# A sample beyond this fraction of the range is saturated.
AT_END = 0.999


@dataclass(frozen=True, eq=False)
class TriadAtStamps:
    """A triad at the common stamps.

    `triad`: its `uncertainty` is the recorded one, because the noise density at low frequencies,
    which determines integrals, is unchanged. `noise` is the standard deviation of a single sample.
    `noise_factor` ((n, 3)): standard deviation of a sample divided by that of a recorded sample,
    exact for white noise. `noise` ((n, 3), u): standard deviation of each sample from the stated
    density: ``density/√dt``, dt the recorded step, times `noise_factor`. `clipped` ((n, 3)):
    whether a saturated recorded sample contributes to the sample. `whole` ((n,)): False where the
    record was extrapolated beyond its end to form the sample. `method`: 'as recorded', 'decimated',
    'averaged' or 'interpolated'.
    """

    triad: RecordedTriad
    noise_factor: Array
    noise: Array
    clipped: Flags
    whole: Flags
    method: str


def allowed_stamps(
    channels: TriadChannels, offset: float, rate: float, sampling: str
) -> tuple[float, float]:
    """First and last common stamp that a triad can supply.

    `offset` (s): unit's stamp minus common time. `rate` (Hz). `sampling` ({'instantaneous',
    'mean'}): of the output.
    """
    lows, highs = [], []
    for g in channels.groups:
        own = g.step if channels.sampling == "mean" else 0.0
        low, high = g.time[0], g.time[-1]
        if _is_faster(g, rate):
            # Means of means need the whole of the first step; a kernel needs its midpoint.
            low, high = (low - own, high) if sampling == "mean" else (low - own / 2, high - own / 2)
            low += 1.0 / rate if sampling == "mean" else 0.0
        elif not _same_kind_and_rate(g, channels.sampling, rate, sampling):
            low, high = low - own / 2, high - own / 2
            if sampling == "mean":
                shift = 1.0 / rate if own == 0.0 else 0.5 / rate
                low, high = low + shift, high + (0.0 if own == 0.0 else 0.5 / rate)
        lows.append(low - offset)
        highs.append(high - offset)
    return float(max(lows)), float(min(highs))


def onto_stamps(
    channels: TriadChannels,
    triad: RecordedTriad,
    columns: list[str],
    offset: float,
    stamps: Array,
    rate: float,
    sampling: str,
    attenuation: float,
) -> tuple[TriadAtStamps, list[Finding]]:
    """Resample a triad to common stamps.

    `triad`: triad that `channels` belong to. `offset` (s): unit's stamp minus common time. `stamps`
    ((n,), s): on the common clock, within `allowed_stamps`. `rate` (Hz). `sampling`
    ({'instantaneous', 'mean'}). `attenuation` (dB): attenuation of aliased signals, for
    instantaneous output. DataError: faster samples are not evenly spaced, or the record is shorter
    than the low-pass.
    """
    n = len(stamps)
    values, factor, noise = (np.empty((n, 3)) for _ in range(3))
    clipped, whole = np.zeros((n, 3), dtype=bool), np.ones(n, dtype=bool)
    limits = np.array(triad.uncertainty.axis("full_scale"))
    steps = np.array(triad.uncertainty.axis("quantization"))
    density = np.array(triad.uncertainty.axis("noise_density"))
    methods, findings = [], list[Finding]()
    for g in channels.groups:
        axes = list(g.axes)
        # An axis that reads beyond its stated range has another end and is not clipped at the
        # stated one.
        over = np.abs(g.values).max(axis=0) > OVER_RANGE * limits[axes]
        stated = np.where(over, np.inf, limits[axes])
        ends = find_limits(g.time, g.values, stated, steps[axes])
        held = ends.clipped | (np.abs(g.values) >= AT_END * stated)
        at, method = _resample(channels, g, held, offset, stamps, rate, sampling, attenuation)
        values[:, axes], factor[:, axes] = at.values, at.noise_factor[:, None]
        if method == "interpolated":
            values[:, axes] = _held(g, held, at.values, stamps + offset, ends)
        noise[:, axes] = at.noise_factor[:, None] * density[axes] / np.sqrt(g.step)
        clipped[:, axes] = at.touched
        whole &= at.whole
        methods.append(method)
        own = 1.0 / g.step
        # Interpolation at a similar rate loses no information worth reporting.
        if method == "interpolated" and own * SAME_RATE <= rate:
            add_warning(
                findings,
                "sensors.hz-slower-than-common-stamps",
                file=channels.source,
                quantity="time",
                names=[columns[a] for a in axes],
                own=own,
                rate=rate,
                own_2=own / 8.0,
            )
    table = pd.DataFrame(values, index=pd.Index(stamps, name="time"), columns=columns)
    table.attrs = {**triad.table.attrs, "sampling": sampling, "source": channels.source}
    order = ("decimated", "averaged", "interpolated", "as recorded")
    result = TriadAtStamps(
        RecordedTriad(table, triad.uncertainty, triad.name, absent=triad.absent),
        factor,
        noise,
        clipped,
        whole,
        next(m for m in order if m in methods),
    )
    return result, findings


def at_rows(triad: TriadAtStamps, stamps: Array, rate: float) -> TriadAtStamps:
    """The same triad at some of its stamps.

    `stamps` ((m,), s): consecutive, among those of the triad. `rate` (Hz): of both.
    """
    table = triad.triad.table
    first = round((stamps[0] - float(table.index[0])) * rate)
    rows = slice(first, first + len(stamps))
    part = table.iloc[rows]
    part.attrs = dict(table.attrs)
    return TriadAtStamps(
        replace(triad.triad, table=part, held=None),
        triad.noise_factor[rows],
        triad.noise[rows],
        triad.clipped[rows],
        triad.whole[rows],
        triad.method,
    )


def _held(g: AxisGroup, held: Flags, values: Array, at: Array, ends: RangeLimits) -> Array:
    """Interpolated values, set to the end of the range where the nearest sample was saturated.

    A polynomial through a saturated stretch oscillates about it, which would hide the saturation.
    """
    nearest = np.clip(np.rint((at - g.time[0]) / g.step).astype(np.int64), 0, len(g.time) - 1)
    inside = np.clip(values, ends.lower, ends.upper)
    end = np.where(g.values[nearest] > 0.0, ends.upper, ends.lower)
    return np.where(held[nearest], end, inside)


def _is_faster(g: AxisGroup, rate: float) -> bool:
    return 1.0 / g.step > SAME_RATE * rate


def _same_kind_and_rate(g: AxisGroup, own: str, rate: float, wanted: str) -> bool:
    return own == wanted and abs(g.step * rate - 1.0) < SAME_RATE - 1.0


def _resample(
    channels: TriadChannels,
    g: AxisGroup,
    held: Flags,
    offset: float,
    stamps: Array,
    rate: float,
    sampling: str,
    attenuation: float,
) -> tuple[decimation.Resampled, str]:
    own = g.step if channels.sampling == "mean" else 0.0
    at = stamps + offset
    if _is_faster(g, rate):
        try:
            step = even_step(g.time)
        except DataError as error:
            raise error.replaced(file=channels.source) from None
        try:
            if sampling == "mean":
                return decimation.mean_samples(
                    g.values,
                    g.time[0],
                    step,
                    at,
                    1.0 / rate,
                    sampling=channels.sampling,
                    marked=held,
                ), "averaged"
            design = decimation.low_pass_design(step, rate, attenuation=attenuation)
            return decimation.decimate(
                g.values, g.time[0] - 0.5 * own, step, at, design, marked=held
            ), "decimated"
        except DataError as error:
            raise error.replaced(file=channels.source) from None
    if _same_kind_and_rate(g, channels.sampling, rate, sampling):
        first = int(np.argmin(np.abs(g.time - at[0])))
        near = g.time[first : first + len(at)]
        if len(near) == len(at) and np.abs(near - at).max() < SAME_STAMP * g.step:
            rows = slice(first, first + len(at))
            one = np.ones(len(at))
            return decimation.Resampled(g.values[rows], one, one > 0.0, held[rows]), "as recorded"
        return decimation.interpolate(g.time, g.values, at, marked=held), "interpolated"
    centred = g.time - 0.5 * own
    if sampling == "mean" and own == 0.0:
        return decimation.interpolated_means(
            centred, g.values, at, 1.0 / rate, marked=held
        ), "interpolated"
    middle = at - (0.5 / rate if sampling == "mean" else 0.0)
    return decimation.interpolate(centred, g.values, middle, marked=held), "interpolated"
