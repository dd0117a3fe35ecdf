"""From a recorded crash unit to one that can be navigated with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.prepare_findings import (
    bias_findings,
    length_findings,
    rest_findings,
    saturation_findings,
    step_findings,
)
from strapdown.crash.prepare_options import check_options
from strapdown.crash.rest_attitude import (
    from_stated_attitude,
    gravity_correction,
    level_at_rest,
    with_gravity,
)
from strapdown.errors import Finding
from strapdown.results.rests import RestStretch
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.high_g_bias import bias_from_lower_range
from strapdown.sensors.pre_crash import (
    BiasEstimate,
    find_pre_crash_rest,
    gyro_bias_from,
    in_axes,
)
from strapdown.sensors.prepared_unit import FROM_GRAVITY, PreparedUnit
from strapdown.sensors.range_agreement import agreement_findings
from strapdown.sensors.range_merge import merge_ranges
from strapdown.sensors.rest import rest_between
from strapdown.sensors.saturation import RangeLimits, find_limits
from strapdown.sensors.triad_errors import ZERO, Triad, triad_of
from strapdown.sensors.triad_uncertainty import TriadUncertainty
from strapdown.sensors.unit_checks import UnitArrays, check_unit
from strapdown.sensors.unmeasured import assumed_findings, with_filled_axes, with_gyro
from strapdown.tables import imu_table

Array = NDArray[np.float64]

__all__ = ["prepare_unit"]


def prepare_unit(
    unit: CrashUnit,
    *,
    gravity: float = 9.80665,
    rest: str | tuple[float, float] = "auto",
    levelling: tuple[float, float, float] | None = None,
    impact: float = 0.0,
    moving_at_impact: bool = True,
    steady_acceleration: float = 0.3,
    steady_rate: float = 0.01,
    match_gravity: bool = True,
    margin: float = 0.1,
    hysteresis: float = 0.1,
    fade: float = 0.0,
) -> PreparedUnit:
    """Take biases off, merge the ranges, turn into vehicle axes and level.

    Parameters
    ----------
    unit : CrashUnit
        On the common clock, zero at the trigger; all triads at the same stamps, the gyro its
        own or borrowed, in the unit's axes; or without what its `assumed` speaks of.
    gravity : float, m/s²
        At the place. Where the unit has axes that are assumed, gravity's part is put there.
    rest : 'auto' or (start, end), s
        Where the vehicle stands before the crash: found, or stated.
    levelling : (roll, pitch, sd), deg, optional
        Attitude of the vehicle before the crash where it is known otherwise: needed where the
        record has no rest or the unit lacks an axis of its accelerometers, and better than a
        sensor with a bias of tenths of g. The bias of the
        lowest range is then taken from gravity in that attitude, where this says more of it
        than is stated: so are channels that were zeroed before the test given back what they
        lost.
    impact : float, s
        Of the first contact, where the trigger is known to be late or early.
    moving_at_impact : bool
        As `find_pre_crash_rest`.
    steady_acceleration : float, m/s²
        Standard deviation of what each axis of the vehicle may accelerate over a steady
        stretch; 0.3 is a slope of 3 % or engine drag. At rest it is zero.
    steady_rate : float, rad/s
        As `gyro_bias_from`.
    match_gravity : bool
        Whether the length of the specific force at rest is made gravity's.
    margin, hysteresis, fade
        As `merge_ranges`.

    Returns
    -------
    PreparedUnit

    Raises
    ------
    DataError
        The unit is refused by `check_unit`; there is neither a rest nor a steady stretch and no
        levelling is given; the stated rest has too few samples; the specific force at rest
        has not the length of gravity, or an axis is missing and assumed, and no levelling is given.
    ConfigError
        An option is out of range.
    """
    check_options(
        unit.name,
        gravity=gravity,
        rest=rest,
        levelling=levelling,
        impact=impact,
        steady_acceleration=steady_acceleration,
        steady_rate=steady_rate,
        margin=margin,
        hysteresis=hysteresis,
        fade=fade,
    )
    unit = with_gyro(with_filled_axes(unit))
    data = with_gravity(unit, check_unit(unit), levelling, gravity)
    assert unit.gyro is not None
    triads, gyro = unit.accelerometers, unit.gyro.uncertainty
    limits = [_limits(data.time, y, t) for y, t in zip(data.accelerometers, triads, strict=True)]
    gyro_limits = _limits(data.time, data.gyro, unit.gyro)
    noise = [_noise(data.time, t.uncertainty) for t in triads]
    gyro_noise = _noise(data.time, gyro)
    findings: list[Finding] = [*data.findings, *assumed_findings(unit)]
    findings += saturation_findings(unit, data, limits, gyro_limits)
    limits = [_with_held(limit, t) for limit, t in zip(limits, triads, strict=True)]

    own = _find_rest(unit, data, rest, impact, moving_at_impact, noise[0], gyro_noise)
    findings += rest_findings(
        unit, data.time, impact, own, levelling is not None, steady_acceleration
    )
    unknown = steady_acceleration if own is not None and own.grade == "steady" else 0.0
    turn = _where_there(
        gyro_bias_from(own, gyro.axis("bias"), steady_rate=steady_rate), unit.gyro.absent
    )

    bias, bias_from, bias_sd = _range_biases(unit, data, limits, own)
    findings += bias_findings(unit, bias, bias_from, own)
    findings += agreement_findings(unit, data, limits, noise)
    merged = merge_ranges(
        data.time,
        data.accelerometers,
        limits,
        noise,
        bias=bias,
        bandwidth=[t.uncertainty.bandwidth for t in triads],
        margin=margin,
        hysteresis=hysteresis,
        fade=fade,
    )
    findings += step_findings(unit, merged)

    C = unit.mounting.C_vs
    standing = None if own is None else in_axes(own, C)
    force = merged.values @ C.T
    if levelling is not None:
        level, shift = from_stated_attitude(
            levelling, standing, _stated_sd(triads[0].uncertainty, C), unknown, gravity
        )
        if shift is not None:
            # All ranges hang on the lowest, and move with it.
            force = force - shift
            bias_from = (FROM_GRAVITY, *bias_from[1:])
            assert own is not None and own.accel_mean_sd is not None
            bias_sd = (own.accel_mean_sd, *bias_sd[1:])
    else:
        assert standing is not None
        findings += length_findings(unit, standing, gravity)
        level = level_at_rest(standing, unknown, gravity, unit.name)
    correction = 0.0
    matched = bias_from[0] == FROM_GRAVITY
    # Along an axis that is not there nothing is to be corrected.
    whole = not triads[0].absent
    if match_gravity and whole and standing is not None and not matched:
        found = gravity_correction(standing, triads[0].uncertainty, unknown, gravity)
        if found is not None:
            matched, (correction, along) = True, found
            force = force + correction * along
    imu = imu_table(
        data.time, (data.gyro - turn.bias) @ C.T, force, sampling=data.sampling, source=unit.name
    )
    return PreparedUnit(
        unit=unit,
        imu=imu,
        range_spoken=merged.spoken,
        clipped=merged.clipped,
        gyro_clipped=_with_held(gyro_limits, unit.gyro).clipped,
        noise=merged.noise,
        gyro_noise=gyro_noise,
        rest=standing,
        rest_accel_sd=unknown,
        levelling=level,
        gyro_bias_sd=turn.sd,
        bias_from=bias_from,
        bias_sd=bias_sd,
        gravity_matched=matched,
        gravity_correction=correction,
        findings=tuple(findings),
    )


def _find_rest(
    unit: CrashUnit,
    data: UnitArrays,
    rest: str | tuple[float, float],
    impact: float,
    moving: bool,
    noise: Array,
    gyro_noise: Array,
) -> RestStretch | None:
    """In sensor axes."""
    table = imu_table(
        data.time, data.gyro, data.accelerometers[0], sampling=data.sampling, source=unit.name
    )
    if not isinstance(rest, str):
        return rest_between(table, *rest)
    return find_pre_crash_rest(
        table,
        impact=impact,
        moving_at_impact=moving,
        accel_noise=float(np.median(noise, axis=0).max()),
        gyro_noise=float(np.median(gyro_noise, axis=0).max()),
    )


def _range_biases(
    unit: CrashUnit,
    data: UnitArrays,
    limits: Sequence[RangeLimits],
    rest: RestStretch | None,
) -> tuple[list[Array], tuple[int | None, ...], tuple[Triad, ...]]:
    """Of every range relative to the lowest: each hangs on the next lower one."""
    bias: list[Array] = [np.zeros(3)]
    origin: list[int | None] = [None]
    sd: list[Triad] = [ZERO]
    for j in range(1, len(data.accelerometers)):
        found = None
        if rest is not None:
            within = (data.time >= rest.start) & (data.time <= rest.end)
            found = bias_from_lower_range(
                data.time,
                data.accelerometers[j],
                data.accelerometers[j - 1],
                within[:, None] & ~limits[j - 1].clipped & ~limits[j].clipped,
                quantization=unit.accelerometers[j].uncertainty.axis("quantization"),
            )
        if found is None:
            bias.append(np.zeros(3))
            origin.append(None)
            sd.append(ZERO)
        else:
            bias.append(bias[j - 1] + np.asarray(found.bias))
            origin.append(j - 1)
            sd.append(found.sd)
    return bias, tuple(origin), tuple(sd)


def _limits(time: Array, values: Array, triad: RecordedTriad) -> RangeLimits:
    u = triad.uncertainty
    return find_limits(
        time, values, np.array(u.full_scale), np.array(u.quantization), held=triad.held
    )


def _with_held(limits: RangeLimits, triad: RecordedTriad) -> RangeLimits:
    """What is spent, whether the values still show it or not."""
    if triad.held is None:
        return limits
    return replace(limits, clipped=limits.clipped | triad.held)


def _noise(time: Array, uncertainty: TriadUncertainty) -> Array:
    """Standard deviation of each sample: white noise over its interval, and the step."""
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    white = np.asarray(uncertainty.noise_density) / np.sqrt(steps)[:, None]
    return np.hypot(white, np.asarray(uncertainty.quantization) / math.sqrt(12.0))


def _where_there(found: BiasEstimate, absent: tuple[int, ...]) -> BiasEstimate:
    """Without a word on axes that are not there: what is assumed of them is told elsewhere."""
    keep = [k not in absent for k in range(3)]
    return BiasEstimate(
        triad_of(np.where(keep, found.bias, 0.0)), triad_of(np.where(keep, found.sd, 0.0))
    )


def _stated_sd(uncertainty: TriadUncertainty, C: Array) -> Array:
    """Of the bias of the lowest range, in vehicle axes."""
    return np.asarray(np.sqrt(C**2 @ np.asarray(uncertainty.axis("bias")) ** 2))
