"""What the simplifications of Tadic and Vukajlovic (2016) cost, against exact truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import earth, rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.dsp import running_integral
from strapdown.errors import DivergenceError
from strapdown.evaluation import ROTATION_ERROR, trajectory_differences
from strapdown.increments import motion_increments
from strapdown.mechanization import Mechanization, NorthEastDown, Tadic, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors import ImuErrors, load_sensor
from strapdown.simulation import (
    Accelerate,
    CrashMotion,
    EarthMotion,
    HaversinePulse,
    Manoeuvre,
    Origin,
    SineVelocityMotion,
    Stop,
    Straight,
    Turn,
    car,
    simulate_imu,
)
from strapdown.tables import NED, VELOCITY

Array = NDArray[np.float64]

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
    "all: flat Earth": Tadic(earth_rate=False, transport_rate=False, gravity=STANDARD_GRAVITY),
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
        imu, _ = simulate_imu(self.motion, ImuErrors(), rate=self.rate)
        return motion_increments(imu, interpolation="cubic")

    @cached_property
    def truth(self) -> pd.DataFrame:
        """Exact trajectory at the samples."""
        ends = self.increments.index.to_numpy(dtype=np.float64)
        return self.motion.trajectory(np.concatenate([[0.0], ends]))


def _crash() -> EarthMotion:
    """Pole test: 7.1 m/s, a pulse of 113 ms that changes it by 7.20 m/s and leaves 87 deg/s."""
    pulse = HaversinePulse(0.1, 0.113, (-7.2, 0.0, 0.0), (0.0, 0.0, 87.0))
    return CrashMotion(0.75, Origin(45.0, 20.0, 100.0), (7.1, 0.0, 0.0), (pulse,))


def straight(
    duration: float, speed: float, *, lat_deg: float = 45.0, alt: float = 100.0, east: bool = False
) -> EarthMotion:
    """Level motion at one speed, to the north-east or to the east.

    Parameters
    ----------
    duration : float, s
    speed : float, m/s
    lat_deg : float, deg
    alt : float, m
    east : bool

    Returns
    -------
    EarthMotion
    """
    part = math.sqrt(0.5)
    north, to_east = (0.0, 1.0) if east else (part, part)
    origin = Origin(lat_deg, 20.0, alt)
    return SineVelocityMotion(duration, origin, (speed * north, speed * to_east, 0.0))


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


#: From a crash to a flight, by name.
TRIPS: dict[str, Trip] = {
    "crash": Trip("0.75 s of a crash", _crash(), 2000.0, "free"),
    "10 s": Trip("10 s at 20 m/s", straight(10.0, 20.0), 100.0, "free"),
    "60 s": Trip("60 s at 20 m/s", straight(60.0, 20.0), 100.0, "free"),
    "drive": Trip("10 min of driving", _drive(), 100.0, "held"),
    "flight": Trip("1 h at 230 m/s", straight(3600.0, 230.0, alt=1e4, east=True), 10.0, "held"),
}


def error_course(
    trip: Trip, mechanization: Mechanization, increments: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Navigate a trip from its exact start, and compare with the truth.

    Parameters
    ----------
    trip : Trip
    mechanization : Mechanization
        Its height is taken from the trip.
    increments : DataFrame, optional
        Of perfect sensors, if not given.

    Returns
    -------
    DataFrame
        At every sample `ERRORS`: length of the difference in place, in m, in velocity, in m/s,
        and of the rotation between the attitudes, in deg.

    Raises
    ------
    DivergenceError
        As `run_mechanization`.
    """
    start = NavState.from_trajectory(trip.truth)
    used = trip.increments if increments is None else increments
    run = run_mechanization(replace(mechanization, height=trip.height), start, used)
    difference = trajectory_differences(run.trajectory, trip.truth)
    return pd.DataFrame(
        {
            name: np.linalg.norm(difference[columns].to_numpy(dtype=np.float64), axis=1)
            for name, columns in zip(ERRORS, (NED, VELOCITY, ROTATION_ERROR), strict=True)
        },
        index=difference.index,
    )


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
    return pd.DataFrame({name: error_course(trip, m).max() for name, m in tried.items()}).T


def sensor_increments(trip: Trip, sensor: str, unit: int) -> pd.DataFrame:
    """Motion increments of a trip from a unit of a real sensor, its gyro bias taken away.

    Parameters
    ----------
    trip : Trip
    sensor : str
        Of the catalogue.
    unit : int
        Seed.

    Returns
    -------
    DataFrame
        MotionIncrements table.
    """
    drawn = load_sensor(sensor).draw(unit)
    # A rest before the trip tells it; the accelerometers' biases it does not tell.
    known = replace(drawn, gyro=replace(drawn.gyro, bias=0.0))
    return motion_increments(simulate_imu(trip.motion, known, rate=trip.rate, seed=unit)[0])


def sensor_errors(trip: Trip, sensor: str, units: Sequence[int] = range(9)) -> pd.DataFrame:
    """Errors of `NorthEastDown` with units of a real sensor, as `sensor_increments` has them.

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
        Columns `ERRORS`; one row a unit; infinite where the run has diverged.
    """
    rows = {}
    for unit in units:
        try:
            course = error_course(trip, NorthEastDown(), sensor_increments(trip, sensor, unit))
            rows[unit] = course.max()
        except DivergenceError:
            rows[unit] = pd.Series(math.inf, index=list(ERRORS))
    return pd.DataFrame(rows).T


def predicted_errors(trip: Trip, simplification: str) -> pd.Series:
    """Largest errors of a simplification from its formula, without running a mechanization.

    Parameters
    ----------
    trip : Trip
    simplification : str
        Of `SIMPLIFICATIONS`.

    Returns
    -------
    Series
        `ERRORS`. What is left out of the Coriolis term, ``w_c x v``, and what the attitude, which
        is turned by ``a = int w dt`` of the rates that it does not follow, makes of the specific
        force, ``a x f``, and the error of gravity, are integrated over the exact motion: at
        constant velocity ``(w_c x v + dg) t²/2 - w x g t³/6``. A held height leaves the horizontal
        part. What the error does to itself is left out: it counts after some minutes, and on an
        hour's flight it is all (Schuler's period is 84 min).
    """
    left = SIMPLIFICATIONS[simplification]
    time = trip.truth.index.to_numpy(dtype=np.float64)
    v = trip.truth[VELOCITY].to_numpy(dtype=np.float64)
    lat, alt = (trip.truth[name].to_numpy(dtype=np.float64) for name in ("lat", "alt"))
    turning, transport = earth.earth_rate(lat), earth.transport_rate(lat, alt, v)
    force = rotation.rotate(trip.motion.attitude(time), trip.motion.specific_force(time))
    kept = left.coriolis * (2.0 * turning * left.earth_rate + transport * left.transport_rate)
    missing = turning * (not left.earth_rate) + transport * (not left.transport_rate)
    turned = running_integral(time, missing)
    error = np.cross(2.0 * turning + transport - kept, v) + np.cross(turned, force)
    if left.gravity is not None:
        error[:, 2] += left.gravity - earth.gravity(lat, alt)[:, 2]
    if trip.height == "held":
        error[:, 2] = 0.0
    speed = running_integral(time, error)
    parts = (running_integral(time, speed), speed, np.degrees(turned))
    return pd.Series(
        {n: np.linalg.norm(x, axis=1).max() for n, x in zip(ERRORS, parts, strict=True)}
    )
