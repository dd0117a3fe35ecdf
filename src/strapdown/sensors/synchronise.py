"""Synchronization of all units to common stamps of one clock, zero at the trigger."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown.errors import ConfigError, DataError, Finding, add_warning
from strapdown.sensors.crash_unit import (
    CrashUnit,
    Mounting,
    RecordedTriad,
    with_filled_axes,
    with_gyro,
)
from strapdown.sensors.error_chain import time_constant
from strapdown.sensors.triad_channels import TriadChannels, triad_channels
from strapdown.sensors.triad_errors import finite
from strapdown.sensors.uncertainty import FEELS
from strapdown.sensors.unit_clocks import (
    TriadAtStamps,
    UnitChannels,
    UnitClock,
    allowed_stamps,
    at_rows,
    clocks_by_correlation,
    clocks_by_trigger,
    onto_stamps,
)
from strapdown.tables import ACCEL, GYRO, SAMPLINGS
from strapdown.tables.checks import Array

#: Stamps that records share to be compared; of one by itself, a peak between two steps.
LEAST_STAMPS, LEAST_ALONE = 8, 4
# Methods of resampling that hide saturation in the values.
HIDING = ("decimated", "averaged")


@dataclass(frozen=True, eq=False)
class SynchronisedUnit:
    """A unit at the common stamps.

    `unit`: tables on the common clock, all at the same stamps; `trigger` is 0 and `trigger_sd` that
    of the clock. A borrowed gyro is in `gyro`, in the unit's own sensor axes, and `gyro_from` names
    its unit. `accelerometers`: the same triads with noise, clipping and range ends. `offset` (s):
    recorded stamp minus common time. `time_sd` (s): standard deviation of `offset`. `how`: source
    of `offset`. `lender`: name of the unit whose gyro is borrowed. `gyro_time_sd` (s): of the
    borrowed gyro relative to this unit's accelerometers; 0 for the unit's own gyro.
    """

    unit: CrashUnit
    accelerometers: tuple[TriadAtStamps, ...]
    gyro: TriadAtStamps | None
    offset: float
    time_sd: float
    how: str
    lender: str | None
    gyro_time_sd: float


@dataclass(frozen=True, eq=False)
class SynchronisedUnits:
    """Units on one clock.

    Attributes
    ----------
    units : tuple of SynchronisedUnit
        In the order given.
    time : ndarray, (n,), s
        Common stamps ``k/rate``, zero at the trigger, shared by all units.
    rate : float, Hz
    reference : str or None
        Unit whose clock is the common one, for method 'correlation'.
    trigger_sd : float, s
        Standard deviation of the zero if all units share its error; otherwise 0, and it is in each
        unit's `time_sd`.
    findings : tuple of Finding
    """

    units: tuple[SynchronisedUnit, ...]
    time: Array
    rate: float
    reference: str | None
    trigger_sd: float
    findings: tuple[Finding, ...]

    def unit(self, name: str) -> SynchronisedUnit:
        """Return the unit with a given name.

        Raises
        ------
        ConfigError
            The name is unknown.
        """
        for u in self.units:
            if u.unit.name == name:
                return u
        raise ConfigError(
            "sensors.reference-unit-unknown",
            quantity="name",
            name=name,
            word=name,
            known=[u.unit.name for u in self.units],
        )


def synchronise(
    units: Sequence[CrashUnit],
    *,
    method: str = "trigger",
    rate: float = 200.0,
    reference: str | None = None,
    sampling: str = "instantaneous",
    attenuation: float = 80.0,
    cut: bool = True,
) -> SynchronisedUnits:
    """Synchronize units to one clock and common stamps.

    Parameters
    ----------
    units : sequence of CrashUnit
        On one rigid vehicle, with any rates and starts, each on its own clock.
    method : {'trigger', 'correlation'}
        Zero is each unit's own trigger; or the reference unit's trigger, to which the others are
        aligned by correlating the magnitudes of specific force or rate, whichever is more precise.
    rate : float, Hz
        Of the common stamps.
    reference : str, optional
        Name of the reference unit; default, the first with a trigger.
    sampling : {'instantaneous', 'mean'}
        Kind of the output: values of a signal band-limited to half the output's Nyquist frequency
        (the low-pass reaches `attenuation` at twice that), or true means over the step ending at
        the stamp, whose sums are the integral.
    attenuation : float, dB
    cut : bool
        Cut all units to their common interval; otherwise each unit, with the gyro it borrows, keeps
        its own interval, including a rest before the crash that another record lacks.

    Returns
    -------
    SynchronisedUnits
        The stamps of every channel are corrected for the delay of the low-pass before its sampler,
        the time constant for slow signals. Faster channels are decimated (or averaged) without
        delay; others are interpolated where they were not sampled at the common stamps, which a
        finding reports.

    Raises
    ------
    ConfigError
        `method`, `rate`, `reference`, `sampling` or a unit's `gyro_from` is invalid, or two units
        have the same name.
    DataError
        A unit has no trigger, an invalid table, or no overlap with the others.
    """
    check_options(units, method, rate, reference, sampling)
    units = [with_filled_axes(u) for u in units]
    by_name = {u.name: u for u in units}
    check_lenders(by_name)
    given = [_channels(u) for u in units]
    fastest = 1.0 / min(g.step for u in given for t in u.triads for g in t.groups)
    if rate > MOST_FASTER * fastest:
        raise ConfigError(
            "sensors.hz-more-than-times-hz",
            quantity="rate",
            rate=rate,
            most_faster=MOST_FASTER,
            fastest=fastest,
        )
    findings = [f for u in given for t in u.triads for f in t.findings]
    # With missing axes the vector is shorter, so its magnitude does not indicate the unit.
    findings += compare_sizes(
        [
            (
                None if u.unit.gyro is None or u.unit.gyro.absent else u.gyro,
                () if any(t.absent for t in u.unit.accelerometers) else u.accelerometers,
            )
            for u in given
        ]
    )
    zero_sd = 0.0
    if method == "trigger":
        clocks, reference = clocks_by_trigger(given), None
    else:
        chosen = _reference(given, reference)
        clocks, said = clocks_by_correlation(given, chosen)
        findings += said
        reference, zero_sd = chosen.unit.name, chosen.unit.trigger_sd
    spans = {
        u.unit.name: _spans(u, clock, rate, sampling)
        for u, clock in zip(given, clocks, strict=True)
    }
    time = _stamps([s for own in spans.values() for s in own], rate)
    done: dict[str, SynchronisedUnit] = {}
    # Lenders first, because borrowers use their processed gyro.
    for u, clock in sorted(zip(given, clocks, strict=True), key=lambda p: p[0].gyro is None):
        triads = []
        borrowed = u.unit.gyro_from if u.gyro is None else None
        own = time
        if not cut:
            own = _stamps([*spans[u.unit.name], *(spans[borrowed] if borrowed else ())], rate)
        for channels, triad, columns in _parts(u):
            # The low-pass before the sampler delays slow signals by its time constant.
            late = clock.offset + time_constant(triad.uncertainty.bandwidth)
            at, said = onto_stamps(channels, triad, columns, late, own, rate, sampling, attenuation)
            triads.append(at)
            findings += said
        gyro, gyro_sd = (triads.pop() if u.gyro is not None else None), 0.0
        lender = None
        if borrowed is not None:
            lent = done[borrowed]
            assert lent.gyro is not None
            lender = lent.unit
            there = at_rows(lent.gyro, own, rate)
            gyro = turned_gyro(there, lender.mounting, u.unit.mounting)
            gyro_sd = math.hypot(clock.sd, lent.time_sd)
        made = replace(
            u.unit,
            accelerometers=tuple(_marked(a) for a in triads),
            gyro=None if gyro is None else _marked(gyro),
            trigger=0.0,
            trigger_sd=clock.sd,
            lender=lender,
        )
        done[u.unit.name] = SynchronisedUnit(
            with_gyro(made),
            tuple(triads),
            gyro,
            clock.offset,
            clock.sd,
            clock.how,
            None if lender is None else lender.name,
            gyro_sd,
        )
    ordered = tuple(done[u.name] for u in units)
    own_gyros = [() if s.gyro is None or s.lender else (s.gyro,) for s in ordered]
    for s, own_gyro in zip(ordered, own_gyros, strict=True):
        findings += end_findings(s.unit.name, (*s.accelerometers, *own_gyro))
    for s, own_gyro in zip(ordered, own_gyros, strict=True):
        # The widest range and the unit's own gyro: no wider range replaces them.
        findings += clipped_findings(s.unit.name, (*s.accelerometers[-1:], *own_gyro))
    if cut:
        findings += cut_findings([s for own in spans.values() for s in own], time)
    return SynchronisedUnits(ordered, time, rate, reference, zero_sd, tuple(findings))


def _marked(at: TriadAtStamps) -> RecordedTriad:
    """Mark held samples of a record where a low-pass hides saturation in the values."""
    return replace(at.triad, held=at.clipped) if at.method in HIDING else at.triad


def _parts(u: UnitChannels) -> list[tuple[TriadChannels, RecordedTriad, list[str]]]:
    parts = [(c, t, ACCEL) for c, t in zip(u.accelerometers, u.unit.accelerometers, strict=True)]
    if u.gyro is not None and u.unit.gyro is not None:
        parts.append((u.gyro, u.unit.gyro, GYRO))
    return parts


def _channels(unit: CrashUnit) -> UnitChannels:
    if not unit.accelerometers and unit.gyro is None:
        raise DataError(
            "sensors.neither-accelerometers-nor-gyro", file=unit.name, quantity="accelerometers"
        )
    return UnitChannels(
        unit,
        tuple(triad_channels(unit, t, ACCEL) for t in unit.accelerometers),
        None if unit.gyro is None else triad_channels(unit, unit.gyro, GYRO),
    )


def _reference(given: list[UnitChannels], name: str | None) -> UnitChannels:
    if name is not None:
        return next(u for u in given if u.unit.name == name)
    having = [u for u in given if u.unit.trigger is not None]
    if not having:
        raise DataError(
            "sensors.no-unit-trigger-time-counted",
            file=", ".join(u.unit.name for u in given),
            quantity="trigger",
        )
    return having[0]


def _spans(
    u: UnitChannels, clock: UnitClock, rate: float, sampling: str
) -> list[tuple[str, float, float]]:
    """Interval each triad of a unit can supply: name, first and last common instant."""
    return [
        (channels.source, *allowed_stamps(channels, late, rate, sampling))
        for channels, triad, _ in _parts(u)
        for late in (clock.offset + time_constant(triad.uncertainty.bandwidth),)
    ]


def _stamps(spans: list[tuple[str, float, float]], rate: float) -> Array:
    """Common stamps that all triads can supply."""
    latest = max(spans, key=lambda s: s[1])
    earliest = min(spans, key=lambda s: s[2])
    first = math.ceil(latest[1] * rate - 1e-6)
    last = math.floor(earliest[2] * rate + 1e-6)
    least = LEAST_ALONE if len({name for name, _, _ in spans}) == 1 else LEAST_STAMPS
    if last - first + 1 < least:
        short = latest[0] == earliest[0]
        raise DataError(
            "sensors.record-too-short" if short else "sensors.common-clock-begins-ends-they",
            file=latest[0],
            quantity="time",
            latest=latest[1],
            earliest=earliest[0],
            earliest_2=earliest[2],
            least_stamps=least,
            rate=rate,
        )
    return np.arange(first, last + 1) / rate


# Gyro of another unit on the same rigid body, rotated into the borrower's axes.


def check_lenders(units: dict[str, CrashUnit]) -> None:
    """Check that every borrowed gyro exists.

    ConfigError: a unit borrows from itself, from an unknown unit, or from one without a gyro.
    """
    for unit in units.values():
        if unit.gyro is not None or unit.gyro_from is None:
            continue
        having = [u.name for u in units.values() if u.gyro is not None]
        if unit.gyro_from not in units:
            raise ConfigError(
                "sensors.lender-unknown" if having else "sensors.mounted-lender-unknown",
                quantity="gyro_from",
                name=unit.name,
                gyro_from=unit.gyro_from,
                word=unit.gyro_from,
                known=having,
            )
        if units[unit.gyro_from].gyro is None:
            raise ConfigError(
                "sensors.lender-without-gyro" if having else "sensors.mounted-lender-without-gyro",
                quantity="gyro_from",
                name=unit.name,
                gyro_from=unit.gyro_from,
                having=having,
            )


def turned_gyro(lent: TriadAtStamps, lender: Mounting, borrower: Mounting) -> TriadAtStamps:
    """Rotate a gyro through both mountings into the borrower's sensor axes.

    `lent`: in the lender's sensor axes. Returns ``ω_b = C_vb^T C_va ω_a``. Standard deviations are
    rotated as for independent axes, ``sd_b² = (C ∘ C) sd_a²``. The range of an axis is the least of
    the contributing ranges, and the axis is clipped where one of those is.
    """
    C_ba = borrower.C_vs.T @ lender.C_vs
    square = C_ba**2
    feels = np.abs(C_ba) > FEELS
    table = lent.triad.table
    turned = pd.DataFrame(table[GYRO].to_numpy() @ C_ba.T, index=table.index, columns=GYRO)
    turned.attrs = dict(table.attrs)
    return TriadAtStamps(
        RecordedTriad(turned, lent.triad.uncertainty.turned(C_ba), lent.triad.name),
        np.sqrt(lent.noise_factor**2 @ square.T),
        np.sqrt(lent.noise**2 @ square.T),
        np.asarray((lent.clipped[:, None, :] & feels).any(axis=2)),
        lent.whole,
        lent.method,
    )


# Findings about records resampled to common stamps.

# A shorter omitted part of a record is not reported.
WORTH_A_WORD = 0.1  # s


def end_findings(unit: str, parts: Sequence[TriadAtStamps]) -> list[Finding]:
    """Report samples near the ends of a record, where the low-pass extrapolated it."""
    found: list[Finding] = []
    for t in parts:
        if t.whole.all():
            continue
        inner, time = np.flatnonzero(t.whole), t.triad.table.index.to_numpy()
        add_warning(
            found,
            "sensors.low-pass-at-ends" if inner.size else "sensors.low-pass-nowhere-whole",
            file=f"{unit}, {t.triad.name}",
            quantity="time",
            begin=time[inner[0]] if inner.size else None,
            end=time[inner[-1]] if inner.size else None,
            noise_factor=float(t.noise_factor.max() / np.median(t.noise_factor)),
        )
    return found


def clipped_findings(unit: str, parts: Sequence[TriadAtStamps]) -> list[Finding]:
    """Report saturated samples where the low-pass hides them from later processing."""
    found: list[Finding] = []
    for t in parts:
        if t.method not in HIDING:
            continue
        time = t.triad.table.index.to_numpy()
        kind = "gyro" if GYRO[0] in t.triad.table.columns else "accel"
        for k, axis in enumerate("xyz"):
            rows = np.flatnonzero(t.clipped[:, k])
            if rows.size:
                add_warning(
                    found,
                    f"sensors.{kind}-clipped-before-resampling",
                    file=f"{unit}, {t.triad.name}",
                    quantity=f"{kind}_{axis}",
                    size=rows.size,
                    time=time[rows[0]],
                    time_2=time[rows[-1]],
                )
    return found


def cut_findings(spans: Sequence[tuple[str, float, float]], time: Array) -> list[Finding]:
    """Report the part of the longest record omitted because another is shorter.

    `spans`: interval each part can supply, s on the common clock. `time` ((n,), s): common stamps.
    """
    latest, earliest = max(spans, key=lambda s: s[1]), min(spans, key=lambda s: s[2])
    first, last = min(spans, key=lambda s: s[1]), max(spans, key=lambda s: s[2])
    found: list[Finding] = []
    if time[0] - first[1] > WORTH_A_WORD:
        add_warning(
            found,
            "sensors.begins-last-before-not-used",
            file=latest[0],
            quantity="time",
            latest=latest[1],
            first=first[0],
            first_2=first[1],
        )
    if last[2] - time[-1] > WORTH_A_WORD:
        add_warning(
            found,
            "sensors.ends-first-after-not-used",
            file=earliest[0],
            quantity="time",
            earliest=earliest[2],
            last=last[0],
            last_2=last[2],
        )
    return found


# Consistency of the units of one vehicle: names, options, sizes of the measurements.

METHODS = ("trigger", "correlation")
# Rates on one rigid body differ by this factor if one is in deg/s.
DEGREES_APART = (40.0, 80.0)
# Specific forces differ by this factor if one is in g; they also vary with position.
G_APART = (8.0, 12.0)
# Denser common stamps cost time without adding information.
MOST_FASTER = 10.0


def check_options(
    units: Sequence[CrashUnit], method: str, rate: float, reference: str | None, sampling: str
) -> None:
    """Check the options of `synchronise`.

    ConfigError: no unit is given, two units have the same name, or an option is invalid.
    """
    if not units:
        raise ConfigError("sensors.no-units-given", quantity="units")
    names = [u.name for u in units]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ConfigError("sensors.two-units-called", quantity="name", twice=twice[0])
    if not (finite(rate) and rate > 0.0):
        raise ConfigError("sensors.common-rate-not-positive", quantity="rate", rate=rate)
    for quantity, given, known, code in (
        ("method", method, METHODS, "sensors.no-way-synchronise"),
        ("sampling", sampling, SAMPLINGS, "sensors.common-sampling-unknown"),
        ("reference", reference, (None, *names), "sensors.reference-unit-not-among"),
    ):
        if given not in known:
            data = {quantity: given, "word": str(given), "known": [k for k in known if k]}
            raise ConfigError(code, quantity=quantity, data=data)


def compare_sizes(
    units: Sequence[tuple[TriadChannels | None, tuple[TriadChannels, ...]]],
) -> list[Finding]:
    """Compare measurements of one rigid body to detect wrong units of measurement.

    Findings for specific forces that differ by a factor of about 9.8. DataError: rates differ by a
    factor of about 57, though equal everywhere on the body.
    """
    turning = [(gyro.source, _spread(gyro)) for gyro, _ in units if gyro is not None]
    for one, size in turning:
        for other, more in turning:
            if size > 0.0 and DEGREES_APART[0] < more / size < DEGREES_APART[1]:
                raise DataError(
                    "sensors.rates-times-those-same-body",
                    file=other,
                    quantity="gyro",
                    more=more / size,
                    one=one,
                )
    forces = [(force[-1].source, _spread(force[-1])) for _, force in units if force]
    return [
        Finding(
            "sensors.specific-force-varies-times-much",
            file=other,
            quantity="accel",
            more=more / size,
            one=one,
        )
        for one, size in forces
        for other, more in forces
        if size > 0.0 and G_APART[0] < more / size < G_APART[1]
    ]


def _spread(channels: TriadChannels) -> float:
    return math.sqrt(sum(float(g.values.var(axis=0).sum()) for g in channels.groups))
