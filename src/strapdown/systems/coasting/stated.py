"""A forecast of coasting of a sensor along a stated motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Aid
from strapdown.aiding.gnss import Gnss
from strapdown.config.choice import make_choice
from strapdown.config.coast import CoastSpec, CoastStartTable
from strapdown.config.slots import SLOTS
from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.joseph import Joseph
from strapdown.estimation.rotation_vector_model import RotationVectorModel
from strapdown.estimation.stated_states import stated_states
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, NavigatorState, with_states
from strapdown.navigation.piece import NavigationPiece
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.sensors.stated_imu import stated_imu
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import simulate_imu
from strapdown.simulation.aid_instants import instants, velocity_of_point
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.systems.coasting.forecast import Forecast, forecast
from strapdown.systems.coasting.motion import stated_motion
from strapdown.systems.coasting.sources import physical, with_physical
from strapdown.systems.progress import Progress, silent
from strapdown.tables.checks import index_of
from strapdown.tables.odometer import odometer_table

__all__ = ["coast_navigator", "forecast_of_sensor", "sensor_of"]

Array = NDArray[np.float64]

#: Samples of a stated motion, Hz. Without errors they are exact at any rate that follows it.
RATE = 50.0
#: What an alignment leaves: m, m/s, deg, deg.
ALIGNED = (10.0, 0.1, 0.5, 5.0)
#: An odometer that stays, Hz and m/s.
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
    """Return what is not known of a sensor.

    Parameters
    ----------
    name : str
        Of the catalogue, or the path of a file.

    Raises
    ------
    ConfigError
        There is none, or it says nothing of bias or noise.
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
        Whether a receiver is among its aids.

    Returns
    -------
    Navigator
    """
    names = type(spec.aiding).model_fields
    aids: tuple[Aid, ...] = tuple(
        make_choice(
            getattr(spec.aiding, kind), SLOTS["aiding"], {"name": kind, "ellipsoid": "wgs84"}
        )
        for kind in names
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
    """Foretell the drift of a sensor along a stated motion.

    A filter is taken over a drive with fixes, and from there over the outage without. Samples and
    fixes are those of the truth: what is wanted is the covariance, which knows their errors.

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
        The motion cannot be done.
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

    def go(one: Navigator, start: NavigatorState) -> tuple[NavigationPiece, ...]:
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
    """The true state at time zero."""
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
    """What an alignment leaves, and what data sheets do."""
    position, velocity, tilt, heading = ALIGNED
    core = np.repeat([position, velocity, math.radians(tilt)], 3)
    core[8] = math.radians(heading)
    sds = np.concatenate([core, navigator.filter.model.stacked.sd])
    return np.diag(np.square(sds))


def _stated(state: NavigatorState, navigator: Navigator, start: CoastStartTable) -> NavigatorState:
    """The state with what is stated in place of what the drive left, bound to nothing else."""
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
    """What receivers and wheels would tell at the truth."""
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
    if "odometer" in type(spec.aiding).model_fields:
        asked = spec.aiding.odometer  # type: ignore[attr-defined]
        at = instants(motion, ODOMETER_RATE)[1:]
        forward = velocity_of_point(motion, at, asked.lever_arm_m)[:, 0]
        out["odometer"] = odometer_table(at, forward, ODOMETER_SD)
    return out
