"""Check before a run whether a record and its measurements allow navigation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.constants import STANDARD_GRAVITY
from strapdown.dsp.samples import noise_free
from strapdown.errors import DataError, Finding
from strapdown.estimation.error_model import ERROR_MODELS
from strapdown.frames import ecef_from_geodetic, place_difference
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.gnss_clock import WHOLE
from strapdown.navigation.measurements.gnss_readiness import gnss_readiness
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.measurements.vehicle import NoSlip
from strapdown.sensors.health_log import LEAST_SAMPLES, ChannelFault
from strapdown.sensors.imu_health import check_imu_channels
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, usable
from strapdown.tables.checks import channels_of, index_of, source_of, values_of
from strapdown.tables.on_disk import filled, let_go

if TYPE_CHECKING:
    from strapdown.config.navigation import NavigationSpec, StartTable

#: Time in which the error of an unaided height grows by the factor e, s: sqrt(R / 2 g).
VERTICAL = 570.0
#: Duration from which this is reported, s.
LONG = 1800.0
#: Tolerance of the first fix from a stated position: standard deviations, m, and m/s since.
FAR_SD, FAR, FAST = 10.0, 1000.0, 340.0
#: Lever arm that vehicles have, and the standard deviation of one by a tape measure, m.
ARM, ARM_SD = 2.0, 0.02
#: Measurements that bound the height error.
HOLDS_HEIGHT = ("gnss", "barometer", "no_slip", "body_velocity")


def look_through(
    spec: NavigationSpec, imu: pd.DataFrame, tables: Mapping[str, pd.DataFrame]
) -> tuple[Finding, ...]:
    """Check measurements against the record.

    Parameters
    ----------
    imu : DataFrame
        Imu table of the used span.
    tables : mapping of str to DataFrame
        By name of the measurement, on the clock of the samples.
    """
    # `doctor` has the checks of samples without a configuration of navigation.
    from strapdown.config.navigation import make_aids

    found: list[Finding] = []
    yaw = _mounting_yaw(spec)
    for aid in make_aids(spec):
        table = tables.get(aid.name)
        if table is None:
            continue
        if isinstance(aid, Gnss):
            part = WHOLE if spec.log is None else spec.log.part_s(index_of(imu)[0])
            found += gnss_readiness(table, imu, aid, part, mounting_yaw=yaw)
            _refuse_far(spec, table, imu, aid)
            found += () if spec.log is None else _lever_arm(table, aid)
        elif isinstance(aid, TabulatedMeasurement):
            _refuse_apart(table, imu)
    return (*found, *_height(spec, imu))


def _mounting_yaw(spec: NavigationSpec) -> float | None:
    """Heading of the forward axis less that of the vehicle, rad, where the run assumes one.

    An alignment by the course does, and wheels that do not slip.
    """
    from strapdown.config.navigation import make_aids

    coarse = spec.coarse
    if spec.start is None and coarse.kind == "gnss_course":
        course = coarse.make()
        assert isinstance(course, GnssCourse)
        return math.radians(course.mounting_yaw_deg) + (math.pi if course.reverse else 0.0)
    wheels = next((aid for aid in make_aids(spec) if isinstance(aid, NoSlip)), None)
    return None if wheels is None else math.radians(wheels.yaw_deg)


def finer_than_arm(table: pd.DataFrame) -> float | None:
    """Standard deviation of the fixes, horizontal, m; None if the usual arm is no more than it."""
    sd = values_of(table, POSITION_SD)[:, :2]
    sd = sd[np.isfinite(sd)]
    middle = float(np.median(sd)) if sd.size else math.inf
    return middle if middle < ARM else None


def _lever_arm(table: pd.DataFrame, aid: Gnss) -> tuple[Finding, ...]:
    """Warn of a lever arm of zero, which no antenna has, beside fixes that are finer than one.

    One whose standard deviation is beyond that of a tape measure is estimated, and in the bounds.
    """
    sd = finer_than_arm(table)
    stated = np.any(np.asarray(aid.lever_arm)) or np.any(np.asarray(aid.lever_arm_sd) > ARM_SD)
    if sd is None or stated or not aid.use_position:
        return ()
    what = Finding("navigation.lever-arm-zero", name=aid.name, sd_m=sd)
    return (what,)


def _refuse_apart(table: pd.DataFrame, imu: pd.DataFrame) -> None:
    time, stamps = index_of(table), index_of(imu)
    if ((time >= stamps[0]) & (time <= stamps[-1])).any():
        return
    raise DataError(
        "navigation.aid-outside-record",
        file=source_of(table),
        quantity="time",
        time=time[0],
        time_2=time[-1],
        stamps=stamps[0],
        stamps_2=stamps[-1],
    )


def _refuse_far(spec: NavigationSpec, table: pd.DataFrame, imu: pd.DataFrame, aid: Gnss) -> None:
    """Refuse a first fix far from the stated position."""
    name, stated = ("start", spec.start) if spec.start is not None else ("site", spec.site)
    if stated is None or not aid.use_position:
        return
    sd = values_of(table, POSITION_SD)
    placed = usable(table, POSITION_SD)
    after = index_of(table) - aid.time_offset - float(imu.index[0])
    rows = np.flatnonzero(placed & (after >= 0.0))
    if not rows.size:
        return
    k = int(rows[0])
    here = np.array([stated.lat_deg, stated.lon_deg, stated.alt_m])
    fix = values_of(table, GEODETIC)[k]
    scatter = math.hypot(float(np.linalg.norm(stated.position_sd_m)), float(sd[k].max()))
    allowed = FAR_SD * scatter + FAR + FAST * float(after[k])
    if (off := _apart(fix, here)) <= allowed:
        return
    swapped = abs(fix[0]) <= 180.0 and abs(fix[1]) <= 90.0
    swapped = swapped and _apart(fix[[1, 0, 2]], here) <= allowed
    raise DataError(
        "navigation.fixes-swap-latitude-and-longitude"
        if swapped
        else "navigation.first-fix-far-from-stated-position",
        file=source_of(table),
        row=k + 1,
        quantity="lat, lon",
        table=name,
        lat_deg=fix[0],
        lon_deg=fix[1],
        stated_lat_deg=here[0],
        stated_lon_deg=here[1],
        apart_km=off / 1000.0,
    )


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.linalg.norm(ecef_from_geodetic(one) - ecef_from_geodetic(other)))


def _height(spec: NavigationSpec, imu: pd.DataFrame) -> tuple[Finding, ...]:
    """Warn of the growing error of an unaided height."""
    if getattr(spec.mechanization, "height", "free") != "free":
        return ()
    length = float(imu.index[-1] - imu.index[0])
    times = math.exp(min(length / VERTICAL, 700.0))
    model = getattr(getattr(spec.filter, "error_model", None), "kind", "")
    if (named := ERROR_MODELS.get(model)) is not None and not named.has_height:
        return (
            Finding(
                "navigation.error-model-without-height",
                file=source_of(imu),
                quantity="height",
                model=model,
                e_folding_s=VERTICAL,
                times=times,
            ),
        )
    if length <= LONG or any(aid.kind in HOLDS_HEIGHT for aid in spec.aiding.values()):
        return ()
    return (
        Finding(
            "navigation.height-not-aided",
            file=source_of(imu),
            quantity="height",
            length=length / 60.0,
            e_folding_s=VERTICAL,
            times=times,
        ),
    )


# Channels that do not read the motion of the body: reported or refused before use.


#: Faults that make a channel unusable, and their largest share of a record. A linear filter does
#: not know the rotation that saturated samples lost.
MOST = {"missing": 0.5, "stuck": 0.5, "dead": 0.5, "saturated": 0.15}
#: Share of the largest reading of a saturated stretch that counts as saturated, too.
AT_END = 0.999
#: Approximate noise ratio to the data sheet of gyros in deg/s that are read as rad/s.
DEGREES = (57.3 / 2.0, 57.3 * 2.0)
#: Relative distance of the usual reading from gravity in another unit.
NEAR = 0.05
#: Length of the first interval compared with a stated start, s, and its tolerance, deg.
FIRST, CHANNELS_FAR = 1.0, 60.0


def channel_findings(
    imu: pd.DataFrame,
    sensors: ImuUncertainty,
    start: StartTable | None,
    tables: Mapping[str, pd.DataFrame],
) -> tuple[Finding, ...]:
    """Check the channels of a record.

    Parameters
    ----------
    imu : DataFrame
        Recorded Imu table, body axes.
    start : StartTable or None
        Known state at its first sample.
    tables : mapping of str to DataFrame
        Measurements by name. Where their positions move, a smooth turn is not a gyro that reads too
        much at rest.

    Returns
    -------
    tuple of Finding
        The longest stretch of each channel and kind of fault.
    """
    _refuse_unit(imu)
    _refuse_gravity(imu, start)
    if len(imu) < LEAST_SAMPLES:
        return ()
    _refuse_degrees(imu, sensors)
    return _usable(
        imu,
        [
            fault
            for fault in check_imu_channels(imu, sensors).faults
            if fault.kind != "implausible" or not _moves(tables, fault.begin, fault.end)
        ],
    )


#: Standard deviations of a position by which the second half of a stretch lies from the first.
MOVES = 5.0


def _moves(tables: Mapping[str, pd.DataFrame], begin: float, end: float) -> bool:
    """Whether positions show that the body moves; medians, for single fixes may be wrong."""
    for table in tables.values():
        if not {*GEODETIC, *POSITION_SD, "quality"} <= set(table.columns):
            continue
        within = (table.index >= begin) & (table.index <= end)
        part = table[within & usable(table, POSITION_SD[:2])]
        if len(part) < 2:
            continue
        place = values_of(part, GEODETIC)
        first, second = np.array_split(place_difference(place, place[0])[:, :2], 2)
        way = float(np.hypot(*(np.median(second, axis=0) - np.median(first, axis=0))))
        if way > MOVES * float(np.median(values_of(part, POSITION_SD[:2]))):
            return True
    return False


def most_unusable(values: np.ndarray) -> dict[str, float]:
    """Return the largest share of a record by kind of fault, of channels, (n, k).

    In a simulation without noise a constant channel may be right.
    """
    if noise_free(values):
        return {kind: most for kind, most in MOST.items() if kind not in ("dead", "stuck")}
    return dict(MOST)


def _usable(imu: pd.DataFrame, faults: Sequence[ChannelFault]) -> tuple[Finding, ...]:
    """The longest stretch of each channel and kind of fault; DataError: a channel is lost."""
    lost = unusable_samples(imu, faults)
    most = most_unusable(values_of(imu, [*GYRO, *ACCEL])) if lost else {}
    for (channel, kind), count in lost.items():
        if count > most.get(kind, 1.0) * len(imu):
            of_kind = [f for f in faults if (f.channel, f.kind) == (channel, kind)]
            longest = max(of_kind, key=lambda f: f.last - f.first).finding
            raise DataError(longest.explains("navigation.channel-lost"))
    return longest_faults(imu, faults)


def longest_faults(imu: pd.DataFrame, faults: Sequence[ChannelFault]) -> tuple[Finding, ...]:
    """Return the longest stretch of each channel and kind of fault, with the share of all."""
    worst: dict[tuple[str, str], ChannelFault] = {}
    for fault in faults:
        key = (fault.channel, fault.kind)
        if key not in worst or fault.last - fault.first > worst[key].last - worst[key].first:
            worst[key] = fault
    lost = unusable_samples(imu, faults)
    return tuple(
        one.finding.explains(
            "navigation.channel-fault", percent=100.0 * lost[key] / len(imu), kind=one.kind
        )
        for key, one in worst.items()
    )


def unusable_samples(
    imu: pd.DataFrame, faults: Sequence[ChannelFault]
) -> dict[tuple[str, str], int]:
    """Count the samples of each channel in each kind of fault."""
    lost: dict[tuple[str, str], int] = {}
    for fault in faults:
        key = (fault.channel, fault.kind)
        lost[key] = lost.get(key, 0) + _without(imu, fault)
    return lost


def saturated_findings(imu: pd.DataFrame, sensors: ImuUncertainty) -> tuple[Finding, ...]:
    """Find saturation: the longest stretch of each channel.

    Parameters
    ----------
    imu : DataFrame
        Imu table, body axes.
    """
    if len(imu) < LEAST_SAMPLES:
        return ()
    faults = check_imu_channels(imu, sensors).faults
    return _usable(imu, [one for one in faults if one.kind == "saturated"])


def _without(imu: pd.DataFrame, fault: ChannelFault) -> int:
    """Unusable samples; of an intermittently saturated stretch, the saturated ones."""
    if fault.kind != "saturated":
        return fault.last - fault.first + 1
    values = imu[fault.channel].to_numpy(dtype=np.float64)[fault.first : fault.last + 1]
    return int(np.count_nonzero(np.abs(values) >= AT_END * fault.size))


def _refuse_degrees(imu: pd.DataFrame, sensors: ImuUncertainty) -> None:
    """Refuse gyros whose noise on every axis fits deg/s read as rad/s."""
    step = _median_of_differences(index_of(imu), 1)
    density = np.asarray(sensors.gyro.axis("noise_density"))
    if not density.all():
        return
    channels = channels_of(imu, GYRO)
    scatter = np.array([_median_of_differences(rates, 2) for rates in channels])
    times = np.sqrt(scatter / MEDIAN / 6.0 * step) / density
    if not ((times > DEGREES[0]) & (times < DEGREES[1])).all():
        return
    # A vehicle does not turn around within a second.
    if float(np.quantile([np.abs(one) for one in channels_of(imu, GYRO)], 0.99)) > WILD:
        raise DataError(
            "navigation.gyros-seem-in-deg-per-s",
            file=source_of(imu),
            quantity="gyro",
            times=times.min(),
            times_2=times.max(),
        )


def _median_of_differences(values: np.ndarray, order: int) -> float:
    """Median of the steps of numbers, or of the squares of their second differences."""

    def differences(part: slice) -> np.ndarray:
        of_part = np.diff(values[part.start : part.stop + order], n=order)
        let_go(values)
        return of_part if order == 1 else np.square(of_part)

    return float(np.median(filled(len(values) - order, differences), overwrite_input=True))


#: Median of the square of a standard normal number, and a rate in rad/s.
MEDIAN, WILD = 0.4549364, 6.0


def _refuse_unit(imu: pd.DataFrame) -> None:
    """Refuse accelerometers whose usual reading is gravity in another unit."""
    time = index_of(imu)
    starts = np.unique(np.searchsorted(time, np.arange(time[0], time[-1], FIRST)))
    count = np.diff(np.append(starts, len(time)))
    means = [np.add.reduceat(force, starts) / count for force in channels_of(imu, ACCEL)]
    size = np.median(np.linalg.norm(means, axis=0))
    for unit, factor in (("g", 1.0 / STANDARD_GRAVITY), ("m/s2", STANDARD_GRAVITY)):
        wanted = STANDARD_GRAVITY * factor
        if abs(size / wanted - 1.0) < NEAR:
            raise DataError(
                "navigation.accelerometers-seem-in-other-unit",
                file=source_of(imu),
                quantity="accel",
                size=size,
                standard_gravity=STANDARD_GRAVITY,
                unit=unit,
            )


def _refuse_gravity(imu: pd.DataFrame, start: StartTable | None) -> None:
    """Compare the specific force of the first second with gravity by a stated attitude."""
    if start is None:
        return
    time = index_of(imu)
    force = values_of(imu, ACCEL)[time <= time[0] + FIRST].mean(axis=0)
    q = rotation.quaternion_from_euler([start.roll_deg, start.pitch_deg, start.heading_deg])
    wanted = rotation.rotate(rotation.conjugate(q), np.array([0.0, 0.0, -1.0]))
    size = float(np.linalg.norm(force))
    cosine = float(force @ wanted) / size if size > 0.0 else 0.0
    apart = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    if apart < CHANNELS_FAR:
        return
    raise DataError(
        "navigation.gravity-upside-down"
        if apart > 180.0 - CHANNELS_FAR
        else "navigation.gravity-contradicts-attitude",
        file=source_of(imu),
        quantity="accel",
        force=force,
        apart_deg=apart,
    )
