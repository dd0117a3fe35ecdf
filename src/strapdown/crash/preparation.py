"""Preparation of a recorded crash unit for navigation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.acceleration import force_at_rest
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import PointKinematics, at_point
from strapdown.crash.path import reconstruct_path
from strapdown.errors import ConfigError, DataError, Finding, add_warning, check_choice
from strapdown.rotation import level
from strapdown.sensors import pre_crash, range_merge
from strapdown.sensors.crash_unit import (
    CrashUnit,
    RecordedTriad,
    UnitArrays,
    assumed_findings,
    check_unit,
    with_common_assumptions,
    with_filled_axes,
    with_gyro,
)
from strapdown.sensors.rest import RestStretch, rest_between
from strapdown.sensors.saturation import RangeLimits, find_limits
from strapdown.sensors.synchronise import SynchronisedUnit, SynchronisedUnits
from strapdown.sensors.triad_errors import ZERO, Triad, check_sd, finite, span, triad_of, triple
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, imu_table
from strapdown.tables.checks import Array

#: Roll, pitch and their standard deviation on any road, deg.
ANY_ROAD = (0.0, 0.0, 10.0)


@dataclass(frozen=True)
class Preparation:
    """Options of `prepare_unit`.

    Attributes
    ----------
    gravity : float, m/s²
        At the site. Along assumed axes of the unit the gravity component is added.
    rest : 'auto' or (start, end), s
        Interval in which the vehicle is stationary before the crash: detected, or stated.
    levelling : (roll, pitch, sd), deg, optional
        Known attitude of the vehicle before the crash. Required where the record has no
        stationary interval or the unit lacks an accelerometer axis, and better than a sensor with
        a bias of tenths of g. The bias of the lowest range is then taken from gravity in that
        attitude, where this is more accurate than the stated bias; this also restores the offset of
        channels that were zeroed before the test.
    impact : float, s
        Of the first contact, where the trigger is known to be late or early.
    moving_at_impact : bool
        As `find_pre_crash_rest`.
    steady_acceleration : float, m/s²
        Standard deviation of the vehicle's own acceleration per axis over a steady interval;
        0.3 corresponds to a slope of 3 % or engine drag. Zero while stationary.
    steady_rate : float, rad/s
        As `gyro_bias_from`.
    stood : tuple of (start, end), s, optional
        Where the attitude comes from the drive before the crash: when the vehicle stood, by its
        fixes or speeds. A quiet interval that was detected elsewhere is one of driving, and a
        record without an interval is prepared as level within 10 deg.
    match_gravity : bool
        Whether the specific force while stationary is scaled to the length of gravity.
    margin, hysteresis, fade
        As `merge_ranges`.
    """

    gravity: float = STANDARD_GRAVITY
    rest: str | tuple[float, float] = "auto"
    levelling: tuple[float, float, float] | None = None
    impact: float = 0.0
    moving_at_impact: bool = True
    steady_acceleration: float = 0.3
    steady_rate: float = 0.01
    stood: tuple[tuple[float, float], ...] | None = None
    match_gravity: bool = True
    margin: float = 0.1
    hysteresis: float = 0.1
    fade: float = 0.0

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Preparation:
        """Options by name. `ConfigError`: a name is unknown."""
        known = [f.name for f in fields(cls)]
        for name in given:
            check_choice(
                "crash.preparation-option-unknown", known, quantity="preparation", name=name
            )
        return cls(**given)

    def check(self, unit: str) -> None:
        """Refuse options of a unit that are out of range, or of the wrong type."""
        if not (finite(self.gravity) and 9.7 < self.gravity < 9.9):
            raise ConfigError(
                "crash.gravity-nowhere-ground", file=unit, quantity="gravity", gravity=self.gravity
            )
        if not (isinstance(self.rest, str) and self.rest == "auto") and span(self.rest) is None:
            raise ConfigError("crash.no-stretch", file=unit, quantity="rest", rest=self.rest)
        if self.levelling is not None:
            code = "crash.levelling-not-three-numbers"
            _, pitch, sd = triple(self.levelling, "levelling", code, unit)
            if abs(pitch) > 90.0 or sd < 0.0:
                raise ConfigError(
                    "crash.levelling-out-of-range",
                    file=unit,
                    quantity="levelling",
                    levelling=repr(self.levelling),
                )
        for name in ("impact", "margin", "hysteresis", "fade"):
            value = getattr(self, name)
            if not finite(value):
                raise ConfigError(
                    "crash.preparation-not-a-number", file=unit, quantity=name, given=value
                )
        check_sd(self.steady_acceleration, "steady_acceleration", "m/s²", unit)
        check_sd(self.steady_rate, "steady_rate", "rad/s", unit)


def prepare_unit(unit: CrashUnit, options: Preparation = Preparation()) -> pre_crash.PreparedUnit:
    """Remove biases, merge ranges, rotate into vehicle axes and level.

    Parameters
    ----------
    unit : CrashUnit
        On the common clock, zero at the trigger; all triads at the same stamps, in the unit's
        axes, with its own or a borrowed gyro; axes listed in its `assumed` may be missing.
    options : Preparation

    Raises
    ------
    DataError
        `check_unit` refuses the unit; there is neither a stationary nor a steady interval and
        no leveling is stated; the stated stationary interval has too few samples; the length of
        the specific force while stationary differs from gravity, or an axis is missing and
        assumed, and no leveling is stated.
    ConfigError
        An option is out of range.
    """
    options.check(unit.name)
    gravity, levelling = options.gravity, options.levelling
    steady_acceleration = options.steady_acceleration
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
    ranges = [
        range_merge.Range(y, _with_held(limit, t), s, t.uncertainty.bandwidth)
        for y, limit, s, t in zip(data.accelerometers, limits, noise, triads, strict=True)
    ]

    lowest = imu_table(
        data.time, data.gyro, data.accelerometers[0], sampling=data.sampling, source=unit.name
    )
    # In sensor axes.
    if not isinstance(options.rest, str):
        own: RestStretch | None = rest_between(lowest, *options.rest)
    else:
        own = pre_crash.find_pre_crash_rest(
            lowest,
            impact=options.impact,
            moving_at_impact=options.moving_at_impact,
            accel_noise=float(np.median(noise[0], axis=0).max()),
            gyro_noise=float(np.median(gyro_noise, axis=0).max()),
        )
    if options.stood is None:
        findings += rest_findings(unit, data.time, own, options)
    elif own is None:
        levelling = levelling or ANY_ROAD
    elif isinstance(options.rest, str) and not any(
        start <= own.start and own.end <= end for start, end in options.stood
    ):
        own = replace(own, grade="steady")
    unknown = steady_acceleration if own is not None and own.grade == "steady" else 0.0
    turn = pre_crash.gyro_bias_from(own, gyro.axis("bias"), steady_rate=options.steady_rate)
    # Assumptions for missing axes are reported elsewhere.
    keep = [k not in unit.gyro.absent for k in range(3)]
    turn = pre_crash.BiasEstimate(
        triad_of(np.where(keep, turn.bias, 0.0)), triad_of(np.where(keep, turn.sd, 0.0))
    )

    bias, bias_from, bias_sd = _range_biases(unit, data.time, ranges, own)
    findings += bias_findings(unit, bias, bias_from, own)
    findings += range_merge.agreement_findings(unit, ranges)
    merged = range_merge.merge_ranges(
        data.time,
        [replace(one, bias=b) for one, b in zip(ranges, bias, strict=True)],
        margin=options.margin,
        hysteresis=options.hysteresis,
        fade=options.fade,
    )
    findings += step_findings(unit, merged)

    C = unit.mounting.C_vs
    standing = None if own is None else pre_crash.in_axes(own, C)
    force = merged.values @ C.T
    if levelling is not None:
        stated = np.sqrt(C**2 @ np.asarray(triads[0].uncertainty.axis("bias")) ** 2)
        level, shift = from_stated_attitude(levelling, standing, stated, unknown, gravity)
        if shift is not None:
            # All ranges are relative to the lowest and shift with it.
            force = force - shift
            bias_from = (pre_crash.FROM_GRAVITY, *bias_from[1:])
            assert own is not None and own.accel_mean_sd is not None
            bias_sd = (own.accel_mean_sd, *bias_sd[1:])
    else:
        assert standing is not None
        findings += length_findings(unit, standing, gravity)
        level = level_at_rest(standing, unknown, gravity, unit.name)
    correction = 0.0
    matched = bias_from[0] == pre_crash.FROM_GRAVITY
    # Missing axes are not corrected.
    whole = not triads[0].absent
    if options.match_gravity and whole and standing is not None and not matched:
        found = gravity_correction(standing, triads[0].uncertainty, unknown, gravity)
        if found is not None:
            matched, (correction, along) = True, found
            force = force + correction * along
    imu = imu_table(
        data.time, (data.gyro - turn.bias) @ C.T, force, sampling=data.sampling, source=unit.name
    )
    return pre_crash.PreparedUnit(
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
        gyro_bias=turn.bias,
        force_bias=triad_of(merged.values.mean(axis=0) @ C.T - force.mean(axis=0)),
        findings=tuple(findings),
    )


def _range_biases(
    unit: CrashUnit, time: Array, ranges: Sequence[range_merge.Range], rest: RestStretch | None
) -> tuple[list[Array], tuple[int | None, ...], tuple[Triad, ...]]:
    """Bias of every range relative to the lowest: each is tied to the next lower one."""
    bias: list[Array] = [np.zeros(3)]
    origin: list[int | None] = [None]
    sd: list[Triad] = [ZERO]
    for j in range(1, len(ranges)):
        found = None
        if rest is not None:
            low, high = ranges[j - 1], ranges[j]
            within = (time >= rest.start) & (time <= rest.end)
            found = range_merge.bias_from_lower_range(
                time,
                high.values,
                low.values,
                within[:, None] & ~low.limits.clipped & ~high.limits.clipped,
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
    """Add samples flagged as clipped, whether or not the values still show it."""
    if triad.held is None:
        return limits
    return replace(limits, clipped=limits.clipped | triad.held)


def _noise(time: Array, uncertainty: TriadUncertainty) -> Array:
    """Standard deviation of each sample: white noise over its interval, and quantization."""
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    white = np.asarray(uncertainty.noise_density) / np.sqrt(steps)[:, None]
    return np.hypot(white, np.asarray(uncertainty.quantization) / math.sqrt(12.0))


# Joint preparation of units of one vehicle: units without a stationary interval are leveled
# from units with one.


# Number of samples over which the lender's attitude is read.
READ = 2


def prepare_together(
    together: SynchronisedUnits, point: Sequence[float], gravity: float, options: Mapping[str, Any]
) -> list[PointKinematics]:
    """Prepare units, each over its own record, and move them to a point, (3,), m, vehicle axes.

    `options`: of `prepare_unit` for all units; under the name of a unit, a mapping of its own. A
    unit that borrows its gyro, is not leveled by an option, and whose record begins after the
    lender's stationary interval is leveled by the lender: roll and pitch are propagated with the
    gyro to the start of the borrower's record, with their standard deviation. What units assume of
    the vehicle is the largest that any unit states.
    """
    stated = {u.unit.name: u.unit.assumed for u in together.units}
    of_vehicle = with_common_assumptions([u.unit for u in together.units])
    together = replace(
        together,
        units=tuple(
            replace(u, unit=unit) for u, unit in zip(together.units, of_vehicle, strict=True)
        ),
    )
    names = {u.unit.name for u in together.units}
    common = {k: v for k, v in options.items() if k not in names}
    turning = [u.unit.name for u in together.units if u.lender is None and _turns(u)]
    done: dict[str, PointKinematics] = {}
    for unit in sorted(together.units, key=lambda u: u.lender is not None):
        own = {"gravity": gravity, **common, **options.get(unit.unit.name, {})}
        if unit.lender is not None and own.get("levelling") is None:
            lent = _attitude_at_start(unit, done[unit.lender])
            if lent is not None:
                own["levelling"] = lent
        hint = None
        if turning and unit.lender is None and not _turns(unit):
            # It has no gyro and borrows none although other units have one.
            hint = Finding(
                "crash.gyro-not-borrowed" if len(turning) == 1 else "crash.gyros-not-borrowed",
                file=unit.unit.name,
                quantity="gyro",
                turning=turning,
                lender=turning[0],
            )
        try:
            prepared = prepare_unit(unit.unit, Preparation.of(own))
        except DataError as error:
            if hint is None or error.finding.quantity != "gyro":
                raise
            raise DataError(
                "crash.no-gyro-for-path",
                file=error.finding.file,
                row=error.finding.row,
                quantity="gyro",
                reason=error.finding,
                hint=hint,
            ) from None
        if hint is not None:
            prepared = replace(prepared, findings=(*prepared.findings, hint))
        if unit.unit.assumed != stated[unit.unit.name]:
            larger = Finding(
                "crash.assumed-more-elsewhere",
                severity="note",
                file=unit.unit.name,
                quantity="assumed",
            )
            prepared = replace(prepared, findings=(*prepared.findings, larger))
        done[unit.unit.name] = at_point(prepared, point, time_sd=unit.time_sd)
    return [done[u.unit.name] for u in together.units]


def _turns(unit: SynchronisedUnit) -> bool:
    """Whether the unit has a gyro that measures, not a substitute for an assumption."""
    gyro = unit.unit.gyro
    return gyro is not None and len(gyro.absent) < 3


def _attitude_at_start(
    unit: SynchronisedUnit, lender: PointKinematics
) -> tuple[float, float, float] | None:
    """Roll, pitch and their sd in deg at the start of a record; None if it can level itself."""
    begin = float(unit.accelerometers[0].triad.table.index[0])
    rest = lender.rest
    if rest is None or rest.grade == "steady" or begin <= rest.end:
        return None
    step = float(lender.imu.index[1] - lender.imu.index[0])
    still = Entry(time=begin, velocity=(0.0, 0.0, 0.0), heading_deg=0.0)
    path = reconstruct_path(
        lender.imu,
        lender.effects,
        lender.levelling,
        rest.end,
        still,
        window=(begin, begin + READ * step),
        zeroed_at_rest=True,
    )
    attitude, sd = path.table.iloc[path.anchor], path.sd.iloc[path.anchor]
    return (
        float(attitude["roll"]),
        float(attitude["pitch"]),
        math.hypot(float(sd["roll"]), float(sd["pitch"])) / math.sqrt(2.0),
    )


# Attitude and bias of the lowest range from the specific force before a crash.


def level_at_rest(
    rest: RestStretch, unknown: float, gravity: float, source: str
) -> pre_crash.Levelling:
    """Roll and pitch from the mean specific force, with the sd from its noise.

    `unknown`, m/s²: standard deviation of the vehicle's own acceleration over the interval, each
    axis. The sd is that of the worse of the two angles: an acceleration error e perpendicular to
    the specific force tilts the level by ``e / g`` (roll: divided by ``cos(pitch)``). `DataError`:
    the length differs from gravity by more than 20 %.
    """
    assert rest.accel_mean is not None and rest.accel_mean_sd is not None
    try:
        roll, pitch = level(rest.accel_mean)
    except DataError as error:
        raise DataError(
            "crash.rest-not-level",
            file=source,
            quantity="levelling",
            reason=error.finding,
            start=rest.start,
            end=rest.end,
        ) from None
    across = math.hypot(max(rest.accel_mean_sd), unknown) / gravity
    sd = math.degrees(across / max(math.cos(math.radians(pitch)), 1e-3))
    return pre_crash.Levelling(roll, pitch, sd, from_rest=True)


def from_stated_attitude(
    stated: tuple[float, float, float],
    rest: RestStretch | None,
    bias_sd: Array,
    unknown: float,
    gravity: float,
) -> tuple[pre_crash.Levelling, Array | None]:
    """Bias of the lowest range from gravity in a stated attitude: (roll, pitch, sd), deg.

    `bias_sd`, (3,), m/s²: stated sd of that bias, vehicle axes; `unknown` as `level_at_rest`.
    Returns the leveling and the stationary reading minus gravity in that attitude, (3,), m/s²; None
    without a stationary interval, or where the stated bias is more accurate than ``g``
    times the sd of the attitude.
    """
    roll, pitch, sd = stated
    levelling = pre_crash.Levelling(float(roll), float(pitch), float(sd), from_rest=False)
    if rest is None or rest.accel_mean is None or rest.accel_mean_sd is None:
        return levelling, None
    known = math.hypot(gravity * math.radians(sd), unknown, max(rest.accel_mean_sd))
    if known >= float(bias_sd.max()):
        return levelling, None
    return levelling, np.asarray(rest.accel_mean) - force_at_rest(roll, pitch, gravity)


def with_gravity(
    unit: CrashUnit, data: UnitArrays, levelling: tuple[float, float, float] | None, gravity: float
) -> UnitArrays:
    """Add the gravity component along assumed axes, in sensor axes.

    `levelling`: (roll, pitch, sd), deg, of the stationary vehicle. `DataError`: there is such an
    axis and no leveling is stated, as two accelerometer axes do not determine the attitude.
    """
    absent = list(unit.accelerometers[0].absent)
    if not absent:
        return data
    if levelling is None:
        missing = " and no ".join(ACCEL[k] for k in absent)
        raise DataError(
            "crash.no-without-three-axes-attitude",
            file=unit.name,
            quantity="levelling",
            missing=missing,
        )
    at_rest = force_at_rest(levelling[0], levelling[1], gravity) @ unit.mounting.C_vs
    filled = tuple(y.copy() for y in data.accelerometers)
    for y in filled:
        y[:, absent] = at_rest[absent]
    return replace(data, accelerometers=filled)


def gravity_correction(
    rest: RestStretch, uncertainty: TriadUncertainty, unknown: float, gravity: float
) -> tuple[float, Array] | None:
    """Correction that makes the stationary specific force as long as gravity, and its direction.

    m/s², and (3,) in vehicle axes. It removes the bias along the vertical and the scale-factor
    error on gravity, as long as the body does not turn. None over a steady interval whose own
    acceleration (`unknown`, as `level_at_rest`) is less certain than bias and scale factor of the
    lowest range.
    """
    assert rest.accel_mean is not None
    mean = np.asarray(rest.accel_mean)
    length = float(np.linalg.norm(mean))
    own = math.hypot(max(uncertainty.axis("bias")), gravity * max(uncertainty.axis("scale")))
    if unknown > 0.0 and unknown >= own:
        return None
    return gravity - length, mean / length


# Findings on the preparation of a unit.


# A number contradicts its stated value beyond this many standard deviations.
SIGMAS = 4.0
# Fraction of the range: differences from interpolation and decimation of two clipped ranges.
LEAST_STEP = 1e-3
# A record that begins less than this before the impact has no interval before it.
SHORTEST = 0.05  # s
# Limits of a stationary specific force that is in g instead of m/s².
NEAR_ONE = (0.8, 1.2)


def rest_findings(
    unit: CrashUnit, time: Array, rest: RestStretch | None, options: Preparation
) -> list[Finding]:
    """Report a missing or only steady interval. `DataError`: none, and no stated leveling."""
    if rest is None:
        late = time[0] > options.impact - SHORTEST
        said = {"begin": time[0], "impact": options.impact}
        if options.levelling is None:
            code = "crash.record-starts-in-crash" if late else "crash.no-rest"
            raise DataError(code, file=unit.name, quantity="rest", data=said)
        code = "crash.record-starts-in-crash-levelled" if late else "crash.no-rest-levelled"
        if late and unit.from_zero:
            # It begins at time zero by definition: no other record of it would begin earlier.
            return [
                Finding(
                    "crash.table-levelled", severity="note", file=unit.name, quantity="rest", **said
                )
            ]
        return [Finding(code, file=unit.name, quantity="rest", data=said)]
    if rest.grade == "steady":
        return [
            Finding(
                "crash.no-stationary-stretch-quiet-without",
                file=unit.name,
                quantity="rest",
                end=rest.end - rest.start,
                start=rest.start,
                steady_acceleration=options.steady_acceleration,
            )
        ]
    return []


def length_findings(unit: CrashUnit, rest: RestStretch, gravity: float) -> list[Finding]:
    """Report a stationary force that points down or contradicts its stated errors.

    `DataError`: it is in g.
    """
    assert rest.accel_mean is not None
    mean = np.asarray(rest.accel_mean)
    length = float(np.linalg.norm(mean))
    lowest = unit.accelerometers[0]
    if NEAR_ONE[0] <= length <= NEAR_ONE[1]:
        raise DataError(
            "crash.specific-force-rest-long-gravity",
            file=f"{unit.name}, {lowest.name}",
            quantity="accel",
            length=length,
        )
    found: list[Finding] = []
    if mean[2] > 0.5 * gravity:
        add_warning(
            found,
            "crash.specific-force-rest-along-vehicle",
            file=f"{unit.name}, {lowest.name}",
            quantity="accel_z",
            mean=mean[2],
        )
    u = lowest.uncertainty
    stated = float(np.hypot(max(u.axis("bias")), gravity * max(u.axis("scale"))))
    if stated > 0.0 and abs(length - gravity) > SIGMAS * stated and 8.0 < length < 11.6:
        add_warning(
            found,
            "crash.specific-force-rest-long-off",
            file=f"{unit.name}, {lowest.name}",
            quantity="accel",
            length=length,
            length_2=length - gravity,
            length_3=abs(length - gravity) / stated,
            stated=stated,
        )
    return found


def saturation_findings(
    unit: CrashUnit, data: UnitArrays, limits: Sequence[RangeLimits], gyro_limits: RangeLimits
) -> list[Finding]:
    """Report clipping of the last range or the gyro, and ranges unlike the stated ones."""
    assert unit.gyro is not None
    triads = [*zip(unit.accelerometers, limits, strict=True), (unit.gyro, gyro_limits)]
    found: list[Finding] = []
    for j, (triad, limit) in enumerate(triads):
        kind, u = ("accel", "m/s²") if j < len(limits) else ("gyro", "rad/s")
        file, stated = f"{unit.name}, {triad.name}", triad.uncertainty.axis("full_scale")
        for k, axis in enumerate("xyz"):
            here: dict[str, Any] = {"file": file, "quantity": f"{kind}_{axis}"}
            if limit.found[k]:
                add_warning(
                    found,
                    "crash.held-between-stated-full-scale",
                    **here,
                    lower=limit.lower[k],
                    upper=limit.upper[k],
                    u=u,
                    stated=stated[k],
                )
            if limit.beyond[k]:
                code = "crash.reads-more-than-stated-full"
                found.append(Finding(code, **here, stated=stated[k], u=u))
        for k, axis in enumerate("xyz"):
            rows = np.flatnonzero(limit.clipped[:, k])
            # A wider range holds what ends a lower one.
            if rows.size and j + 1 >= len(limits):
                add_warning(
                    found,
                    f"crash.{kind}-clipped",
                    file=file,
                    quantity=f"{kind}_{axis}",
                    count=rows.size,
                    first=data.time[rows[0]],
                    last=data.time[rows[-1]],
                )
    return found


def bias_findings(
    unit: CrashUnit,
    bias: Sequence[Array],
    bias_from: Sequence[int | None],
    rest: RestStretch | None,
) -> list[Finding]:
    """Report a bias that could not be estimated, or exceeds the stated one."""
    found: list[Finding] = []
    for j in range(1, len(bias)):
        triad = unit.accelerometers[j]
        source = f"{unit.name}, {triad.name}"
        if bias_from[j] is None:
            add_warning(
                found,
                "crash.bias-unknown-without-rest"
                if rest is None
                else "crash.bias-unknown-range-at-end",
                file=source,
                quantity="bias",
                name=unit.accelerometers[j - 1].name,
                sd=max(triad.uncertainty.axis("bias")),
            )
            continue
        own = bias[j] - bias[j - 1]
        stated = np.hypot(
            triad.uncertainty.axis("bias"), unit.accelerometers[j - 1].uncertainty.axis("bias")
        )
        for k, axis in enumerate("xyz"):
            if stated[k] > 0.0 and abs(own[k]) > SIGMAS * stated[k]:
                add_warning(
                    found,
                    "crash.bias-against-times-stated",
                    file=source,
                    quantity=f"accel_{axis}",
                    own=own[k],
                    name=unit.accelerometers[j - 1].name,
                    own_2=abs(own[k]) / stated[k],
                    stated=stated[k],
                )
    return found


def step_findings(unit: CrashUnit, merged: range_merge.MergedRanges) -> list[Finding]:
    """Report ranges that differ where one takes over from the other."""
    found: list[Finding] = []
    largest = np.abs(merged.values).max(axis=0)
    for j in range(len(merged.step)):
        low, high = unit.accelerometers[j], unit.accelerometers[j + 1]
        for k, axis in enumerate("xyz"):
            if not merged.switches[j, k]:
                continue
            level = min(low.uncertainty.axis("full_scale")[k], 1e6)
            scale = level * np.hypot(
                low.uncertainty.axis("scale")[k], high.uncertainty.axis("scale")[k]
            )
            # Each axis senses the other axes through its own two angles.
            angles = np.hypot(
                low.uncertainty.axis("misalignment")[k], high.uncertainty.axis("misalignment")[k]
            )
            aside = angles * np.hypot(*np.delete(largest, k))
            own = max(float(np.hypot(scale, aside)), LEAST_STEP * level)
            sd = float(np.hypot(merged.step_sd[j, k], own))
            if abs(merged.step[j, k]) > SIGMAS * sd:
                add_warning(
                    found,
                    "crash.take-over-another-they-differ",
                    file=unit.name,
                    quantity=f"accel_{axis}",
                    name=low.name,
                    name_2=high.name,
                    step=merged.step[j, k],
                    switches=merged.switches[j, k],
                    step_2=abs(merged.step[j, k]) / sd,
                )
    return found
