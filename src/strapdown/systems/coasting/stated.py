"""Predict the drift of a sensor along a stated motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Measurement
from strapdown.aiding.gnss import Gnss
from strapdown.config.coast import CoastSpec, CoastStartTable
from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import stated_states
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, NavigatorState, with_states
from strapdown.navigation.record import NavigationChunk
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.sensors.uncertainty import ImuUncertainty, stated_imu
from strapdown.simulation import simulate_imu
from strapdown.simulation.aiding_sensors import instants, velocity_of_point
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.path_motion import Limits, Manoeuvre
from strapdown.simulation.vehicles import Accelerate, Straight, Turn, car
from strapdown.systems.coasting.forecast import Forecast, forecast, physical, with_physical
from strapdown.systems.progress import Progress, silent
from strapdown.tables.aiding import odometer_table
from strapdown.tables.checks import index_of

__all__ = ["coast_navigator", "forecast_of_sensor", "sensor_of", "stated_motion"]


Array = NDArray[np.float64]

#: Sample rate of a stated motion, Hz. Without errors, samples are exact at any sufficient rate.
RATE = 50.0
#: Standard deviations after an alignment: m, m/s, deg, deg.
ALIGNED = (10.0, 0.1, 0.5, 5.0)
#: Rate and standard deviation of a remaining odometer, Hz and m/s.
ODOMETER_RATE, ODOMETER_SD = 2.0, 0.03
RECEIVER = "fixes"
#: Rows of the physical errors that each key of a start replaces, and the factor to SI.
STATED: dict[str, tuple[str, float]] = {
    "position_sd_m": ("position", 1.0),
    "velocity_sd_m_per_s": ("velocity", 1.0),
    "tilt_sd_deg": ("tilt", math.radians(1.0)),
    "heading_sd_deg": ("heading", math.radians(1.0)),
    "gyro_bias_sd_deg_per_h": ("gyro_bias", 1.0 / DEG_PER_HOUR),
    "accel_bias_sd_ug": ("accel_bias", 1.0 / MICRO_G),
}
CORE = {
    "position": slice(0, 3),
    "velocity": slice(3, 6),
    "tilt": slice(6, 8),
    "heading": slice(8, 9),
}


def sensor_of(name: str) -> ImuUncertainty:
    """Return the uncertainty of a sensor.

    Parameters
    ----------
    name : str
        Name in the catalogue, or path of a file.

    Raises
    ------
    ConfigError
        The sensor is unknown, or its bias or noise is not stated.
    """
    sensor = load_sensor(name)
    for triad in ("gyro", "accel"):
        if triad not in {figure.key.partition(".")[0] for figure in sensor.sources}:
            raise ConfigError(
                "outage.sensor-without-gyros"
                if triad == "gyro"
                else "outage.sensor-without-accelerometers",
                quantity="sensor",
                name=sensor.name,
            )
    return stated_imu(sensor, {}, {})


def coast_navigator(spec: CoastSpec, sensors: ImuUncertainty, fixes: bool) -> Navigator:
    """Return the navigator of a forecast.

    Parameters
    ----------
    spec : CoastSpec
    sensors : ImuUncertainty
    fixes : bool
        Whether a receiver is among its measurements.

    Returns
    -------
    Navigator
    """
    aids: tuple[Measurement, ...] = tuple(
        aid.make(name=kind, ellipsoid="wgs84") for kind, aid in spec.aiding.items()
    )
    filter_ = ErrorFilter(
        NorthEastDown(),
        RotationVectorModel(
            gyro_noise=sensors.gyro.axis("noise_density"),
            accel_noise=sensors.accel.axis("noise_density"),
            sensors=stated_states(sensors),
        ),
        Joseph(),
    )
    filter_ = with_states(filter_, aids)
    return Navigator(filter_, (*aids, Gnss(name=RECEIVER)) if fixes else aids)


def forecast_of_sensor(
    spec: CoastSpec, sensors: ImuUncertainty, progress: Progress = silent
) -> Forecast:
    """Predict the drift of a sensor along a stated motion.

    A filter runs over a drive with fixes, and from there over the outage. Samples and fixes are
    those of the truth: the result is the covariance, which includes their errors.

    Parameters
    ----------
    spec : CoastSpec
    sensors : ImuUncertainty
    progress : callable, optional

    Returns
    -------
    Forecast

    Raises
    ------
    ConfigError
        The motion is not possible.
    """
    motion, begin = stated_motion(spec)
    progress("the motion", 0.1)
    perfect = ImuErrors()
    imu, _ = simulate_imu(motion, perfect, rate=RATE, sampling="mean")
    made = motion_increments(imu)
    time, rows = index_of(made), made.to_numpy(dtype=np.float64)
    driven = begin > 0.0
    before = coast_navigator(spec, sensors, fixes=driven)
    state = before.begin(_first(motion), _aligned(before, sensors))
    for name, table in _tables(spec, motion, begin, driven).items():
        state = before.tell(state, name, table)
    progress("the drive before", 0.2)
    first = int(np.searchsorted(time, begin + 0.5 / RATE)) if driven else 0
    if first:
        state, _ = before.advance(state, time[:first], rows[:first])
    navigator = replace(before, aids=tuple(a for a in before.aids if a.name != RECEIVER))
    queues = {k: v for k, v in state.queues.items() if k != RECEIVER}
    state = _stated(replace(state, queues=queues), navigator, spec.start)

    def go(one: Navigator, start: NavigatorState) -> tuple[NavigationChunk, ...]:
        end, piece = one.advance(start, time[first:], rows[first:])
        return piece, one.finish(end)

    return forecast(
        navigator,
        state,
        go,
        spec.outage_s,
        aided=bool(navigator.aids),
        progress=lambda stage, share: progress(stage, 0.3 + 0.45 * share),
    )


def _first(motion: EarthMotion) -> NavState:
    """True state at time zero."""
    row = motion.trajectory([0.0]).iloc[0]
    return NavState.from_degrees(
        row["lat"],
        row["lon"],
        row["alt"],
        v_n=(row["VN"], row["VE"], row["VD"]),
        roll_deg=row["roll"],
        pitch_deg=row["pitch"],
        heading_deg=row["heading"],
    )


def _aligned(navigator: Navigator, sensors: ImuUncertainty) -> Array:
    """Covariance after an alignment, with sensors by their data sheets."""
    position, velocity, tilt, heading = ALIGNED
    core = np.repeat([position, velocity, math.radians(tilt)], 3)
    core[8] = math.radians(heading)
    sds = np.concatenate([core, navigator.filter.model.stacked.sd])
    return np.diag(np.square(sds))


def _stated(state: NavigatorState, navigator: Navigator, start: CoastStartTable) -> NavigatorState:
    """Replace errors by stated ones, uncorrelated with all others."""
    P = physical(navigator, state).copy()
    for key, (name, factor) in STATED.items():
        value = getattr(start, key)
        if value is None:
            continue
        rows = CORE.get(name) or navigator.filter.model.columns_of[name]
        P[rows, :] = P[:, rows] = 0.0
        P[rows, rows] = np.eye(rows.stop - rows.start) * (factor * value) ** 2
    return with_physical(navigator, state, P)


def _tables(
    spec: CoastSpec, motion: EarthMotion, begin: float, driven: bool
) -> dict[str, pd.DataFrame]:
    """Error-free tables of receivers and odometers."""
    out: dict[str, pd.DataFrame] = {}
    if driven:
        receiver = GnssReceiver(
            rate=1.0,
            on_excess="unaffected",
            stated_position_sd=spec.start.fix_position_sd_m,
            stated_velocity_sd=spec.start.fix_velocity_sd_m_per_s,
        )
        fixes = simulate_gnss(motion, receiver)
        out[RECEIVER] = fixes[fixes.index <= begin + 1e-6]
    if "odometer" in spec.aiding:
        at = instants(motion, ODOMETER_RATE)[1:]
        arm = spec.aiding["odometer"].make().lever_arm
        forward = velocity_of_point(motion, at, arm)[:, 0]
        out["odometer"] = odometer_table(at, forward, ODOMETER_SD)
    return out


# Stated motion: a drive with fixes, in which the filter converges, and the outage.


#: Drive with fixes: m/s, mean m/s² of a change of speed, m.
SPEED, GENTLE, RADIUS = 12.0, 1.0, 25.0
#: Least time at constant speed before the outage, s.
SETTLING = 12.0
#: Duration of a turn's onset and end, s.
RAMP = 1.0
#: Limits of a stated motion, those of a fast aircraft, m/s².
LIMITS = Limits(acceleration=100.0, lateral=100.0, climb_deg=20.0)


def stated_motion(spec: CoastSpec) -> tuple[EarthMotion, float]:
    """Return the motion of a forecast, and the begin of the outage.

    Before it, for `aided_s`, a car drives around blocks to the left and to the right, with changes
    of speed, which makes heading, tilts and biases observable. It ends with the heading at which
    the outage begins.

    Parameters
    ----------
    spec : CoastSpec

    Returns
    -------
    motion : EarthMotion
    begin : float, s

    Raises
    ------
    ConfigError
        The motion exceeds 100 m/s².
    """
    asked, outage = spec.motion, spec.outage_s
    before, begin = _drive(spec.start.aided_s, asked.speed_m_per_s)
    motion = car(
        Origin(asked.lat_deg, 10.0, 100.0),
        [(f"drive {k + 1}", one) for k, one in enumerate([*before, *_coasting(spec)])],
        heading_deg=asked.heading_deg,
        speed=0.0 if before else asked.speed_m_per_s,
        limits=LIMITS,
    )
    return replace(motion, duration=begin + outage), begin


def _drive(length: float, speed: float) -> tuple[list[Manoeuvre], float]:
    """Maneuvers before the outage, and their duration; empty if no drive is specified."""
    if length == 0.0:
        return [], 0.0
    turn = math.radians(90.0) * RADIUS / SPEED + RAMP
    block: list[tuple[Manoeuvre, float]] = []
    for sign in (1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0):
        block += [
            (Straight(6.0), 6.0),
            (Accelerate(0.5 * SPEED, 6.0), 6.0),
            (Accelerate(SPEED, 6.0), 6.0),
            (Turn(sign * 90.0, RADIUS, RAMP), turn),
        ]
    round_ = sum(t for _, t in block)
    done: list[tuple[Manoeuvre, float]] = [
        (Straight(5.0), 5.0),
        (Accelerate(SPEED, 12.0), 12.0),
    ]
    change = max(abs(speed - SPEED) / GENTLE, 1.0)
    rounds = max(1, round((length - 30.0 - change) / round_))
    done += block * rounds
    done += [(Accelerate(speed, change), change)]
    # Whole seconds, so that samples and fixes coincide with the begin of the outage.
    took = sum(t for _, t in done)
    whole = math.ceil(took + SETTLING)
    return [*(one for one, _ in done), Straight(whole - took)], float(whole)


def _coasting(spec: CoastSpec) -> list[Manoeuvre]:
    """Maneuvers during the outage."""
    asked, outage = spec.motion, spec.outage_s
    speed, rate = asked.speed_m_per_s, asked.turn_rate_deg_per_s
    to = asked.to_speed_m_per_s
    if rate != 0.0:
        if speed == 0.0 or to is not None:
            raise ConfigError(
                "outage.turn-goes-speed-above-zero"
                if to is not None
                else "outage.body-stands-makes-no-turn",
                quantity="--turn-rate",
            )
        if speed * abs(math.radians(rate)) > LIMITS.lateral:
            most = math.degrees(LIMITS.lateral / speed)
            raise ConfigError(
                "outage.take-more-than-side",
                quantity="--turn-rate",
                rate=rate,
                speed=speed,
                lateral=LIMITS.lateral,
                most=most,
            )
        # With its ramps the turn is as long as the outage, and a second more.
        radius = speed / abs(math.radians(rate))
        return [Turn(rate * outage, radius, RAMP)]
    if to is not None and to != speed:
        least = 15.0 / 8.0 * abs(to - speed) / LIMITS.acceleration
        if outage < least:
            raise ConfigError(
                "outage.takes-more-than",
                quantity="--to-speed",
                speed=speed,
                to=to,
                outage=outage,
                acceleration=LIMITS.acceleration,
                least=least,
            )
        return [Accelerate(to, outage)]
    return [Straight(outage)]
