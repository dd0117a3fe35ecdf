"""One triad of a recorder out of the channels of a record, checked and in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.crash_clock import triad_stamps
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_triad_unit import triad_factor
from strapdown.tables import ACCEL, GYRO, SAMPLINGS

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

__all__ = ["triad_of_channels"]

_COLUMNS = {"acceleration": ACCEL, "rate": GYRO}
_AXES = ("x", "y", "z")
# A sample that is left out between others is a hole; rows of another axis are none.
HOLE = 1.5


@dataclass(frozen=True, eq=False)
class _Axis:
    """One axis: its channel, its sign, its samples."""

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
    """Take a triad out of a record.

    Parameters
    ----------
    record : CrashRecord
    channels : dict of {'x', 'y', 'z'} to str
        Name of the channel along each axis of the triad, with a minus before it where it points
        the other way. An axis that is left out is missing.
    quantity : {'acceleration', 'rate'}
        A channel of velocity gives mean accelerations, too.
    unit : str, optional
        Where the record does not say it. One that contradicts the record is refused.
    time : str, optional
        Channel that holds the stamps, where the record has another, or none.
    time_unit : str, optional
        Of the stamps, where the record does not say it.
    rate_hz : float, optional, Hz
        The samples are evenly spaced: stamps that are rounded or missing are made of it. It may
        not contradict stamps that there are.
    sampling : {'instantaneous', 'mean'}, optional
        Where the record does not say it; instantaneous if nothing does.

    Returns
    -------
    DataFrame
        The table of a `RecordedTriad`: index ``time``, s; columns ``accel_x accel_y accel_z``,
        m/s², or ``gyro_x gyro_y gyro_z``, rad/s, of the axes that there are. Axes with stamps of
        their own have NaN in the rows of others. ``attrs``: ``sampling``, ``source`` (the file),
        ``unit`` (as recorded), and ``findings``, a tuple of what a person should know.

    Raises
    ------
    ConfigError
        What is asked is contradictory, or no unit, axis or quantity.
    DataError
        There is no such channel, it holds another quantity, its unit is neither stated nor evident,
        a value is missing, or time does not advance: with the row.
    """
    if quantity not in _COLUMNS:
        raise ConfigError(
            "io.unknown-triad", quantity="quantity", of_what=quantity, word=quantity, known=_COLUMNS
        )
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
    table = _table(parts, factors, _COLUMNS[quantity])
    table.attrs = {
        "sampling": kind,
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
        findings.append(
            Finding(
                "io.record-along-taken-along",
                file=channel.file or None,
                quantity=f"channel {channel.name}",
                axis=channel.axis,
                taken=taken,
            )
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
    from strapdown.formats.crash_velocity import mean_accelerations_of, starts_at_zero

    if stamps.size < 2:
        raise DataError(
            "io.sample-no-change-velocity",
            file=channel.file or None,
            quantity=f"channel {channel.name}",
            size=stamps.size,
        )
    _check_finite(channel, stamps, values)
    from_zero = starts_at_zero(stamps, channel)
    findings.append(
        Finding(
            "io.velocity-made-means-from-zero" if from_zero else "io.velocity-made-means",
            file=channel.file or None,
            quantity=f"channel {channel.name}",
            severity="note",
        )
    )
    return mean_accelerations_of(stamps, values, from_zero=from_zero)


def _check_finite(channel: CrashChannel, stamps: Array, values: Array) -> None:
    if not values.size:
        raise DataError(
            "io.channel-without-samples",
            file=channel.file or None,
            quantity=f"channel {channel.name}",
        )
    there = np.flatnonzero(np.isfinite(values))
    endless = np.flatnonzero(np.isinf(values))
    hole = -1
    if endless.size or not there.size:
        hole = int(endless[0]) if endless.size else 0
    elif there.size > 1:
        # Rows of other sensors lie between those of a slow one; a sample left out is a hole.
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
        file=channel.file or None,
        row=channel.row(hole),
        quantity=f"channel {channel.name}",
        values=values[hole],
        stamps=stamps[hole],
        count=count,
    )


def _sampling(
    record: CrashRecord, parts: list[_Axis], stated: str | None, findings: list[Finding]
) -> str:
    if stated is not None and stated not in SAMPLINGS:
        raise ConfigError(
            "io.triad-sampling-unknown",
            quantity="sampling",
            stated=stated,
            word=stated,
            known=SAMPLINGS,
        )
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
        findings.append(
            Finding(
                "io.crash-sampling-taken-as-instantaneous",
                severity="note",
                file=record.path.name,
                quantity="sampling",
            )
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
