"""One triad of a recorder from the channels of a record, checked and in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from strapdown.constants import Array
from strapdown.dsp.samples import constant_beside_noise
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning, check_choice
from strapdown.formats.clocks import EPOCH
from strapdown.formats.crash_record import QUANTITIES, CrashChannel, CrashRecord, refuse_impossible
from strapdown.formats.crash_samples import Clock, last_midnight, past_midnight, seconds_of
from strapdown.formats.inference.infer import Signals, infer_signals
from strapdown.formats.triad_units import what_numbers_say
from strapdown.tables import ACCEL, GYRO, SAMPLINGS
from strapdown.units import FACTORS, OF_CRASHES, TIME_UNITS, find_unit

if TYPE_CHECKING:
    import pandas as pd

_COLUMNS = {"acceleration": ACCEL, "rate": GYRO}
_AXES = ("x", "y", "z")
# A sample missing between others is a gap; rows of another axis are not.
HOLE = 1.5


@dataclass(frozen=True, eq=False)
class _Axis:
    """One axis: channel, sign and samples."""

    axis: str
    sign: float
    channel: CrashChannel
    time: Array
    values: Array
    mean: bool


def triad_of_channels(
    record: CrashRecord,
    channels: Mapping[str, str],
    *,
    quantity: str,
    unit: str | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    rate_hz: float | None = None,
    sampling: str | None = None,
) -> pd.DataFrame:
    """Extract a triad from a record.

    Parameters
    ----------
    record : CrashRecord
    channels : dict of {'x', 'y', 'z'} to str
        Name of the channel along each axis of the triad, with a leading minus if it points the
        other way. Axes may be missing.
    quantity : {'acceleration', 'rate'}
        A channel of velocity yields mean accelerations, too.
    unit : str, optional
        If the record does not state it. A unit that contradicts the record is refused.
    time : str, optional
        Channel that holds the stamps, if the record assigns another one or none.
    time_unit : str, optional
        Unit of the stamps, if the record does not state it.
    rate_hz : float, optional, Hz
        For evenly spaced samples: replaces rounded or missing stamps. It must not contradict
        existing stamps.
    sampling : {'instantaneous', 'mean'}, optional
        If the record does not state it; instantaneous by default.

    Returns
    -------
    DataFrame
        The table of a `RecordedTriad`: index ``time``, s; columns ``accel_x accel_y accel_z``,
        m/s², or ``gyro_x gyro_y gyro_z``, rad/s, for the available axes. Axes with their own
        stamps have NaN in the rows of others. ``attrs``: ``sampling``, ``from_zero`` (made of
        changes of velocity since time zero), ``source`` (the file), ``unit`` (as recorded), and
        ``findings``, a tuple.

    Raises
    ------
    ConfigError
        The arguments are contradictory, or a unit, axis or quantity is unknown.
    DataError
        A channel does not exist or holds another quantity, its unit is not stated and not
        evident, a value is missing, or time does not advance; with the row.
    """
    check_choice("io.unknown-triad", _COLUMNS, quantity="quantity", of_what=quantity)
    findings: list[Finding] = []
    chosen = _chosen(record, channels, findings)
    parts = []
    for axis, (channel, sign) in chosen.items():
        _check_quantity(record, channel, quantity, stated=unit is not None)
        stamps, values = triad_stamps(record, channel, time, time_unit, rate_hz, findings)
        mean = channel.quantity == "velocity"
        if mean:
            stamps, values = _as_mean(channel, stamps, values, findings)
        _check_finite(channel, stamps, values)
        parts.append(_Axis(axis, sign, channel, stamps, values, mean))
    factors, recorded = triad_factor(
        record,
        {p.axis: (p.channel, p.values) for p in parts},
        parts[0].time,
        quantity,
        unit,
        findings,
    )
    kind = _sampling(record, parts, sampling, findings)
    _report_constant(parts, findings)
    table = _table(parts, factors, _COLUMNS[quantity])
    table.attrs = {
        "sampling": kind,
        "from_zero": all(p.mean and p.channel.from_zero for p in parts),
        "source": record.path.name,
        "unit": recorded,
        "findings": tuple(dict.fromkeys(findings)),
    }
    return table


def _chosen(
    record: CrashRecord, channels: Mapping[str, str], findings: list[Finding]
) -> dict[str, tuple[CrashChannel, float]]:
    wrong = [a for a in channels if a not in _AXES]
    if wrong or not channels:
        raise ConfigError(
            "io.triad-axis-unknown" if wrong else "io.triad-without-axes",
            file=record.path.name,
            quantity="channels",
            wrong=wrong[:1],
        )
    out: dict[str, tuple[CrashChannel, float]] = {}
    for axis in _AXES:
        if axis not in channels:
            continue
        name = channels[axis].strip()
        known = {c.name for c in record.channels}
        sign = 1.0
        if name not in known and name[:1] in "+-":
            sign, name = (-1.0 if name[0] == "-" else 1.0), name[1:].strip()
        channel = record.channel(name)
        twin = [a for a, (c, _) in out.items() if c is channel]
        if twin:
            raise ConfigError(
                "io.channel-named",
                file=record.path.name,
                quantity="channels",
                name=name,
                twin=twin[0],
                axis=axis,
            )
        out[axis] = channel, sign
        _tell_axis(channel, axis, sign, findings)
    return out


def _tell_axis(channel: CrashChannel, axis: str, sign: float, findings: list[Finding]) -> None:
    if not channel.axis:
        return
    taken = f"{'-' if sign < 0 else ''}{axis}"
    if channel.axis != taken:
        add_warning(
            findings, "io.record-along-taken-along", **channel.where, axis=channel.axis, taken=taken
        )


def _check_quantity(
    record: CrashRecord, channel: CrashChannel, quantity: str, *, stated: bool
) -> None:
    fits = {"acceleration": ("acceleration", "velocity"), "rate": ("rate",)}[quantity]
    if channel.quantity in fits or (channel.quantity == "other" and (stated or not channel.unit)):
        return
    unit = f" in {channel.unit}" if channel.unit else ""
    others = [c.name for c in record.channels if c.quantity in fits]
    raise DataError(
        "io.channel-of-other-quantity" if others else "io.channel-of-unstated-quantity",
        file=channel.file or record.path.name,
        quantity=f"channel {channel.name}",
        of_what=channel.quantity if channel.quantity != "other" else "something",
        unit=unit,
        fits=fits,
        others=others[:12],
        of_what_2=quantity,
    )


def _as_mean(
    channel: CrashChannel, stamps: Array, values: Array, findings: list[Finding]
) -> tuple[Array, Array]:
    from strapdown.formats.crash_samples import mean_accelerations_of, means_from_zero, of_start

    if stamps.size < 2:
        raise DataError("io.sample-no-change-velocity", **channel.where, size=stamps.size)
    _check_finite(channel, stamps, values)
    from_zero = channel.from_zero
    add_note(
        findings,
        "io.velocity-made-means-from-zero" if from_zero else "io.velocity-made-means",
        **channel.where,
    )
    if not from_zero:
        return mean_accelerations_of(stamps, values)
    found = means_from_zero(stamps, values, channel)
    findings += of_start(found, channel)
    return found.time, found.mean


def _check_finite(channel: CrashChannel, stamps: Array, values: Array) -> None:
    if not values.size:
        raise DataError("io.channel-without-samples", **channel.where)
    refuse_impossible(channel, values)
    there = np.flatnonzero(np.isfinite(values))
    endless = np.flatnonzero(np.isinf(values))
    hole = -1
    if endless.size or not there.size:
        hole = int(endless[0]) if endless.size else 0
    elif there.size > 1:
        # Rows of other sensors lie between those of a slow one; only a missing sample is a gap.
        steps, rows = np.diff(stamps[there]), np.diff(there)
        together = steps[rows == 1]
        holes = (rows > 1) & (steps > HOLE * np.median(together if together.size else steps))
        if holes.any():
            hole = int(there[int(np.argmax(holes))]) + 1
    if hole < 0:
        return
    count = int((~np.isfinite(values)).sum())
    raise DataError(
        "io.not-finite-number-such",
        **channel.where,
        row=channel.row(hole),
        values=values[hole],
        stamps=stamps[hole],
        count=count,
    )


#: Fewest samples of a channel that never changes; fewer may be alike by chance.
FEWEST = 10


def _report_constant(parts: list[_Axis], findings: list[Finding]) -> None:
    """Warn of a channel that never changes beside others that have the noise of a sensor."""
    values = [p.values[np.isfinite(p.values)] for p in parts]
    constant = constant_beside_noise(values, FEWEST)
    for part, samples, same in zip(parts, values, constant, strict=True):
        if same:
            add_warning(
                findings,
                "io.crash-channel-constant",
                **part.channel.where,
                axis=part.axis,
                value=float(samples[0]),
                count=samples.size,
            )


def _sampling(
    record: CrashRecord, parts: list[_Axis], stated: str | None, findings: list[Finding]
) -> str:
    if stated is not None:
        check_choice("io.triad-sampling-unknown", SAMPLINGS, quantity="sampling", stated=stated)
    kinds = {"mean" if p.mean else p.channel.sampling for p in parts} - {None}
    if len(kinds) > 1 or (stated and kinds and stated not in kinds):
        raise ConfigError(
            "io.sampling-contradicts-record" if stated else "io.sampling-of-axes-differs",
            file=record.path.name,
            quantity="sampling",
            kinds=sorted(str(k) for k in kinds),
            stated=stated,
        )
    if not kinds and stated is None:
        add_note(
            findings,
            "io.crash-sampling-taken-as-instantaneous",
            file=record.path.name,
            quantity="sampling",
        )
    return stated or (str(kinds.pop()) if kinds else "instantaneous")


def _table(parts: list[_Axis], factors: dict[str, float], columns: list[str]) -> pd.DataFrame:
    import pandas as pd

    stamps = parts[0].time
    if any(not np.array_equal(p.time, stamps) for p in parts[1:]):
        stamps = np.unique(np.concatenate([p.time for p in parts]))
    data = {}
    for part in parts:
        values = np.full(stamps.size, np.nan)
        values[np.searchsorted(stamps, part.time)] = part.values
        data[columns[_AXES.index(part.axis)]] = values * (part.sign * factors[part.axis])
    return pd.DataFrame(data, index=pd.Index(stamps, name="time"))


# Stamps and values of one channel, from the record and the case.


# Largest relative difference between a stated rate and that of the stamps.
RATE_AGREES = 0.01


def triad_stamps(
    record: CrashRecord,
    channel: CrashChannel,
    time: str | None,
    time_unit: str | None,
    rate_hz: float | None,
    findings: list[Finding],
) -> tuple[Array, Array]:
    """Return stamps in s and values of a channel.

    `time`, `time_unit`, `rate_hz`: as in `triad_of_channels`. `findings`: inferences are appended.
    Returns `time`, `values` ((n,)). ConfigError: arguments contradict the record or each other.
    DataError: stamps are not known, or time does not advance.
    """
    if rate_hz is not None and not (math.isfinite(rate_hz) and rate_hz > 0.0):
        raise ConfigError("io.crash-rate-not-positive", quantity="rate_hz", rate_hz=rate_hz)
    if time is None and time_unit is None and rate_hz is None:
        stamps, values = channel.load()
        _check_advances(channel, stamps)
        # Repeat the findings of the inference.
        if channel.clock and (own := _clock_of(record, channel.clock, None)).unit == "":
            findings.extend(seconds_of(own)[1])
        return stamps, values
    if time is None and not channel.clock and rate_hz is None:
        raise ConfigError(
            "io.time-unit-stated-record-no"
            if channel.samples is not None
            else "io.time-unit-stated-record-stamps",
            file=record.path.name,
            quantity="time_unit",
            time_unit=time_unit,
        )
    name = time if time is not None else channel.clock
    values = channel.samples() if channel.samples is not None else channel.load()[1]
    values = np.asarray(values, dtype=np.float64)
    if rate_hz is None:
        seconds, told = seconds_of(_clock_of(record, name, time_unit))
        findings += told
        return _same_length(channel, seconds, name, values)
    if time is None and name and channel.samples is not None:
        steps = np.diff(_clock_of(record, name, time_unit).stamps.astype(np.float64))
        # Stamps that decrease, or change only once, are not a clock: samples are counted from zero.
        name = "" if bool((steps < 0.0).any()) or np.count_nonzero(steps) < 2 else name
    return _even(record, channel, name, time_unit, rate_hz, findings, values), values


def _clock_of(record: CrashRecord, name: str, time_unit: str | None) -> Clock:
    held = record.channel(name)
    read = held.samples or (lambda: held.load()[1])
    recorded = held.unit if held.quantity == "time" else ""
    if held.quantity not in ("time", "other"):
        raise DataError(
            "io.holds-stamps-needed",
            file=held.file or record.path.name,
            quantity=f"channel {name}",
            of_what=held.quantity,
        )
    stated = state_unit(time_unit, "time", "time_unit") if time_unit else ""
    if stated and recorded and stated != recorded:
        raise ConfigError(
            "io.time-unit-stated-record-says",
            file=record.path.name,
            quantity="time_unit",
            time_unit=time_unit,
            recorded=recorded,
        )
    unit = recorded or stated
    stamps = past_midnight(np.asarray(read()), unit)
    return Clock(name, stamps, unit, held.file or record.path.name, held.row)


def _same_length(
    channel: CrashChannel, stamps: Array, name: str, values: Array
) -> tuple[Array, Array]:
    if stamps.size != values.size:
        raise DataError(
            "io.samples-channel-stamps",
            **channel.where,
            size=values.size,
            name=name,
            size_2=stamps.size,
        )
    return stamps, values


def _even(
    record: CrashRecord,
    channel: CrashChannel,
    name: str,
    time_unit: str | None,
    rate_hz: float,
    findings: list[Finding],
    values: Array,
) -> Array:
    """Make evenly spaced stamps, from the first recorded one if there is one."""
    count = np.arange(values.size, dtype=np.float64)
    start, span, slack = 0.0, 0.0, 0.0
    if name:
        clock = _clock_of(record, name, time_unit)
        stamps = _same_length(channel, clock.stamps.astype(np.float64), name, values)[0]
        ends = stamps[[0, -1]]
        seconds = _ends(clock, ends, rate_hz, values.size)
        start, span = float(seconds[0]), float(seconds[1] - seconds[0])
        steps = np.diff(stamps)
        if span > 0.0 and steps.min() == 0.0:
            # Whole seconds, say: the span is known to 1 s.
            slack = float(steps.max()) * span / float(ends[1] - ends[0])
        if abs(start) > EPOCH:
            start -= last_midnight(start, 1.0)
    elif channel.samples is None:
        stamps = channel.load()[0]
        start, span = float(stamps[0]), float(stamps[-1] - stamps[0])
    if (name or channel.samples is None) and values.size > 1:
        recorded = (values.size - 1) / span if span > 0.0 else math.inf
        within = abs(span - (values.size - 1) / rate_hz) <= slack
        if not (within or abs(recorded / rate_hz - 1.0) <= RATE_AGREES):
            raise ConfigError(
                "io.rate-hz-stated-stamps-record",
                file=record.path.name,
                quantity="rate_hz",
                rate_hz=rate_hz,
                recorded=recorded,
            )
        add_note(
            findings,
            "io.stamps-evenly-spaced-hz-first",
            file=record.path.name,
            quantity="time",
            rate_hz=rate_hz,
        )
    return start + count / rate_hz


def _ends(clock: Clock, ends: Array, rate_hz: float, count: int) -> Array:
    """Return first and last stamp in s; without a unit, in the one that fits the rate."""
    if not np.isfinite(ends).all():
        raise DataError(
            "io.first-or-last-stamp-missing",
            file=clock.file,
            row=clock.row(0 if not np.isfinite(ends[0]) else count - 1),
            quantity=f"time ({clock.name})",
        )
    if clock.unit:
        return ends * TIME_UNITS[clock.unit]
    span = float(ends[1] - ends[0])
    for factor in TIME_UNITS.values():
        if span > 0.0 and abs((count - 1) / (span * factor) / rate_hz - 1.0) <= RATE_AGREES:
            return ends * factor
    return ends


def _check_advances(channel: CrashChannel, stamps: Array) -> None:
    bad = np.flatnonzero(~(np.diff(stamps) > 0.0)) if stamps.size > 1 else np.array([], int)
    if stamps.size == 0 or bad.size or not np.isfinite(stamps[0]):
        k = int(bad[0]) + 1 if bad.size else 0
        raise DataError(
            "io.time-goes" if bad.size else "io.no-stamps",
            file=channel.file or None,
            row=channel.row(k),
            quantity=f"time of channel {channel.name}",
            stamps=stamps[k - 1] if bad.size else None,
            stamps_2=stamps[k] if bad.size else None,
        )


# The unit of a triad: from the record, from the case, or inferred from the numbers.


_TRIAD = {"acceleration": "accel", "rate": "gyro"}
# Units shown for numbers whose unit is ambiguous.
_CHOICES = {"acceleration": ("g", "m/s2"), "rate": ("deg/s", "rad/s")}


def triad_factor(
    record: CrashRecord,
    axes: Mapping[str, tuple[CrashChannel, Array]],
    time: Array,
    quantity: str,
    stated: str | None,
    findings: list[Finding],
) -> tuple[dict[str, float], str]:
    """Return the factors from the values of each axis to SI units.

    `axes`: values are SI if the channel's unit is known, else as recorded. `time` ((n,), s).
    `quantity` ({'acceleration', 'rate'}). `stated`: unit stated in the case. `findings`: inferences
    are appended. Returns `unit`: as recorded, or stated. ConfigError: the stated unit does not fit
    the quantity, or contradicts the record. DataError: the unit is not known.
    """
    # Whether the values are in SI units already.
    own = {
        a: c.unit
        for a, (c, _) in axes.items()
        if FACTORS.get(c.quantity, {}).get(c.unit) is not None
    }
    velocity = {c.quantity == "velocity" for c, _ in axes.values()}
    kind = "velocity" if velocity == {True} else quantity
    wanted = state_unit(stated, kind) if stated else ""
    for axis, unit in own.items():
        if wanted and unit != wanted:
            channel = axes[axis][0]
            raise ConfigError(
                "io.unit-stated-record-says",
                file=record.path.name,
                quantity="unit",
                stated=stated,
                unit=unit,
                name=channel.name,
            )
    open_axes = [a for a in axes if a not in own]
    if not open_axes:
        return dict.fromkeys(axes, 1.0), " ".join(dict.fromkeys(own.values()))
    if not wanted:
        if len(set(own.values())) == 1:
            # One axis decides for the triad: a header is often filled in only once.
            wanted = next(iter(own.values()))
            without = ", ".join(axes[a][0].name for a in open_axes)
            other = axes[next(iter(own))][0].name
            add_warning(
                findings,
                "io.unit-taken-from-other-axis",
                file=record.path.name,
                quantity="unit",
                without=without,
                wanted=wanted,
                other=other,
            )
        else:
            wanted = _evident(record, axes, time, kind, findings)
    for axis in open_axes:
        channel = axes[axis][0]
        if channel.unit:
            add_note(
                findings,
                "io.record-says-not-known-read",
                **channel.where,
                unit=channel.unit,
                wanted=wanted,
            )
    return {a: 1.0 if a in own else FACTORS[kind][wanted] for a in axes}, wanted


def _evident(
    record: CrashRecord,
    axes: Mapping[str, tuple[CrashChannel, Array]],
    time: Array,
    quantity: str,
    findings: list[Finding],
) -> str:
    block = [v for _, v in axes.values()]
    names = ", ".join(c.name for c, _ in axes.values())
    unit = None
    if quantity in _TRIAD and len(block) == 3 and all(b.shape == time.shape for b in block):
        values = np.column_stack(block)
        triad = _TRIAD[quantity]
        signals = Signals(
            time,
            gyro=values if triad == "gyro" else None,
            accel=values if triad == "accel" else None,
            time_unit="s",
        )
        said = {i.quantity: i for i in infer_signals(signals)}
        unit, form = said.get(f"{triad}_unit"), said.get(f"{triad}_form")
        if unit is not None and unit.settled and (form is None or form.value == "rate"):
            findings.append(
                unit.finding(
                    "io.crash-unit-inferred", file=record.path.name, quantity=f"unit of {names}"
                )
            )
            return str(unit.value)
    raise DataError(
        "io.crash-unit-not-stated" if unit is None else "io.crash-unit-undecided",
        file=record.path.name,
        quantity=names,
        choices=_choices(block, quantity),
        **what_numbers_say(unit),
    )


def _choices(block: list[Array], quantity: str) -> list[Finding]:
    """List the possible units, with the largest value in each."""
    largest = max(float(np.nanmax(np.abs(b), initial=0.0)) for b in block)
    units = _CHOICES.get(quantity, tuple(FACTORS[quantity])[:3])
    return [
        Finding(
            "io.crash-choice-of-unit",
            severity="note",
            unit=unit,
            largest=largest,
            value=largest * FACTORS[quantity][unit],
            si=QUANTITIES[quantity],
        )
        for unit in units
    ]


def state_unit(text: str, quantity: str, key: str = "unit") -> str:
    """Check a unit stated in a case.

    `quantity`: a key of `FACTORS`. `key`: key of the case, for the message. Returns in the spelling
    of this package. ConfigError: the quantity does not have this unit.
    """
    known = FACTORS[quantity]
    if text in known:
        return text
    found = find_unit(text, OF_CRASHES)
    if found is None or found[0] != quantity:
        raise ConfigError(
            "io.crash-unit-of-other-quantity" if found else "io.crash-unit-unknown",
            quantity=key,
            is_of=found[0] if found else None,
            needed=quantity,
            word=text,
            known=known,
        )
    return found[1]
