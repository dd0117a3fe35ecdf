"""What the simplifications of Tadic and Vukajlovic (2016) cost, against exact truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from strapdown import earth
from strapdown.constants import STANDARD_GRAVITY
from strapdown.evaluation.trajectory_differences import ROTATION_ERROR, trajectory_differences
from strapdown.exceptions import DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import Mechanization, NorthEastDown, Tadic, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation.earth_motion import EarthMotion, Origin
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.manoeuvres import Accelerate, Manoeuvre, Stop, Straight, Turn
from strapdown.simulation.pulse_motion import PulseMotion
from strapdown.simulation.sine_velocity import SineVelocityMotion
from strapdown.simulation.vehicles import car
from strapdown.tables import NED, VELOCITY

__all__ = [
    "ERRORS",
    "SIMPLIFICATIONS",
    "TRIPS",
    "Trip",
    "largest_errors",
    "mechanization_errors",
    "predicted_position",
    "sensor_errors",
]

#: Columns of the tables made here: largest of each over the trip.
ERRORS = ("position_m", "velocity_m_per_s", "attitude_deg")
_EVERY = Tadic(coriolis=True)
#: Each alone, and together. `every term` is the floor: the equations of the paper with nothing
#: left out, of the first order of the step in what is slow.
SIMPLIFICATIONS: dict[str, Tadic] = {
    "every term": _EVERY,
    "no Coriolis term": replace(_EVERY, coriolis=False),
    "no Earth rate": replace(_EVERY, earth_rate=False),
    "no transport rate": replace(_EVERY, transport_rate=False),
    "gravity 9.80665": replace(_EVERY, gravity=STANDARD_GRAVITY),
    "the paper's": Tadic(),
    "all: flat Earth": Tadic(
        earth_rate=False, transport_rate=False, gravity=STANDARD_GRAVITY
    ),
}


@dataclass(frozen=True)
class Trip:
    """A motion whose truth is exact, and how it is sampled and navigated.

    Attributes
    ----------
    title : str
    motion : EarthMotion
    rate : float, Hz
    height : {'free', 'held'}
        As `Mechanization`: an hour is too long for a free height.
    """

    title: str
    motion: EarthMotion
    rate: float
    height: str

    @cached_property
    def increments(self) -> pd.DataFrame:
        """Motion increments of perfect sensors."""
        return motion_increments(simulate_imu(self.motion, ImuErrors(), rate=self.rate)[0])

    @cached_property
    def truth(self) -> pd.DataFrame:
        """Exact trajectory at the samples."""
        ends = self.increments.index.to_numpy(dtype=np.float64)
        return self.motion.trajectory(np.concatenate([[0.0], ends]))


def _crash() -> EarthMotion:
    """Pole test: 7.1 m/s, a pulse of 113 ms that changes it by 7.20 m/s and leaves 87 deg/s."""
    return PulseMotion(
        0.75,
        Origin(45.0, 20.0, 100.0),
        (7.1, 0.0, 0.0),
        velocity_change=(-7.2, 0.0, 0.0),
        rate_change=(0.0, 0.0, 87.0),
        start=0.1,
        length=0.113,
    )


def _straight(duration: float) -> EarthMotion:
    along = 20.0 * math.sqrt(0.5)
    return SineVelocityMotion(duration, Origin(45.0, 20.0, 100.0), (along, along, 0.0))


def _drive() -> EarthMotion:
    """Ten minutes on level ground: a town, a fast road of five kilometres, a stop."""
    block: list[tuple[str, Manoeuvre]] = []
    for k, side in enumerate((90.0, -90.0, 90.0, -60.0)):
        block += [
            (f"away {k}", Accelerate(14.0, 8.0)),
            (f"street {k}", Straight(20.0)),
            (f"slow {k}", Accelerate(7.0, 5.0)),
            (f"corner {k}", Turn(side, radius=20.0)),
        ]
    steps = [
        *block,
        ("fast", Accelerate(25.0, 15.0)),
        ("road", Straight(200.0)),
        ("bend", Turn(120.0, radius=300.0)),
        ("road back", Straight(150.0)),
        ("end", Stop(12.0, 30.0)),
    ]
    whole = car(Origin(45.0, 20.0, 100.0), steps, heading_deg=30.0)
    return replace(whole, duration=600.0)


def _flight() -> EarthMotion:
    return SineVelocityMotion(3600.0, Origin(45.0, 20.0, 10_000.0), (0.0, 230.0, 0.0))


#: From a crash to a flight, by name.
TRIPS: dict[str, Trip] = {
    "crash": Trip("0.75 s of a crash", _crash(), 2000.0, "free"),
    "10 s": Trip("10 s at 20 m/s", _straight(10.0), 100.0, "free"),
    "60 s": Trip("60 s at 20 m/s", _straight(60.0), 100.0, "free"),
    "drive": Trip("10 min of driving", _drive(), 100.0, "held"),
    "flight": Trip("1 h at 230 m/s", _flight(), 10.0, "held"),
}


def largest_errors(
    trip: Trip, mechanization: Mechanization, increments: pd.DataFrame | None = None
) -> dict[str, float]:
    """Navigate a trip from its exact start; largest error of each kind over it.

    Parameters
    ----------
    trip : Trip
    mechanization : Mechanization
        Its height is taken from the trip.
    increments : DataFrame, optional
        Of perfect sensors, if not given.

    Returns
    -------
    dict
        `ERRORS`: length of the difference in place, in m, in velocity, in m/s, and of the
        rotation between the attitudes, in deg. NaN where the run has diverged.
    """
    start = NavState.from_trajectory(trip.truth)
    used = trip.increments if increments is None else increments
    try:
        run = run_mechanization(replace(mechanization, height=trip.height), start, used)
    except DivergenceError:
        return dict.fromkeys(ERRORS, math.nan)
    difference = trajectory_differences(run.trajectory, trip.truth)
    return {
        name: float(np.linalg.norm(difference[columns].to_numpy(), axis=1).max())
        for name, columns in zip(ERRORS, (NED, VELOCITY, ROTATION_ERROR), strict=True)
    }


def mechanization_errors(trip: Trip) -> pd.DataFrame:
    """Errors of `NorthEastDown` and of every simplification, with perfect sensors.

    Parameters
    ----------
    trip : Trip

    Returns
    -------
    DataFrame
        Columns `ERRORS`; one row each, by name.
    """
    tried: dict[str, Mechanization] = {"NorthEastDown": NorthEastDown(), **SIMPLIFICATIONS}
    return pd.DataFrame({name: largest_errors(trip, m) for name, m in tried.items()}).T


def sensor_errors(trip: Trip, sensor: str, units: Sequence[int] = range(9)) -> pd.DataFrame:
    """Errors of `NorthEastDown` with units of a real sensor, whose gyro bias is taken away.

    Parameters
    ----------
    trip : Trip
    sensor : str
        Of the catalogue.
    units : sequence of int
        Seeds.

    Returns
    -------
    DataFrame
        Columns `ERRORS`; one row a unit.
    """
    rows = {}
    for unit in units:
        drawn = load_sensor(sensor).draw(unit)
        # A rest before the trip tells it; the accelerometers' biases it does not tell.
        known = replace(drawn, gyro=replace(drawn.gyro, bias=0.0))
        imu, _ = simulate_imu(trip.motion, known, rate=trip.rate, seed=unit)
        rows[unit] = largest_errors(trip, NorthEastDown(), motion_increments(imu))
    return pd.DataFrame(rows).T


def predicted_position(trip: Trip, simplification: str) -> float:
    """Position error of a simplification by hand, at the end of a trip of constant velocity.

    Parameters
    ----------
    trip : Trip
        Its velocity at the start is taken for that of the whole.
    simplification : str
        Of `SIMPLIFICATIONS`.

    Returns
    -------
    float, m
        With ``v`` the velocity, ``w`` the rates that are left out and ``t`` the time: the Coriolis
        term gives ``(2 w_ie + w_en) x v t²/2``; a rate that the attitude does not follow tilts
        it by ``w t``, which turns the specific force: ``w x f t³/6``; gravity ``dg t²/2``. A held
        height leaves the horizontal part. Without what the error itself does: up to some minutes.
    """
    left = SIMPLIFICATIONS[simplification]
    at = trip.truth.iloc[0]
    v = at[VELOCITY].to_numpy(dtype=np.float64)
    t = trip.motion.duration
    g = earth.gravity(at["lat"], at["alt"])
    turning = earth.earth_rate(at["lat"])
    transport = earth.transport_rate(at["lat"], at["alt"], v)
    kept = left.coriolis * (2.0 * turning * left.earth_rate + transport * left.transport_rate)
    missing = turning * (not left.earth_rate) + transport * (not left.transport_rate)
    error = np.cross(2.0 * turning + transport - kept, v) * t**2 / 2.0
    error += np.cross(missing, -g) * t**3 / 6.0
    if left.gravity is not None:
        error[2] += (left.gravity - g[2]) * t**2 / 2.0
    return float(np.linalg.norm(error[:2] if trip.height == "held" else error))
