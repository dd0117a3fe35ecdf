"""Build a specified trajectory or scenario and simulate the sensor readings along it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.config import motions
from strapdown.config.alignment import SimulationTable
from strapdown.config.motions import PulsesSpec, TrajectorySpec
from strapdown.config.navigation import NavigationSimulationTable, ReceiverTable
from strapdown.config.sources import ScenarioSpec
from strapdown.config.spec import AngleWaveSpec
from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.error_chain import Seed, child, normal
from strapdown.simulation import (
    EarthMotion,
    ImuErrors,
    Motion,
    Origin,
    PathMotion,
    Pulse,
    PulseMotion,
    Scenario,
    SineVelocityMotion,
    StationaryMotion,
    TriadErrors,
    Wave,
    aircraft,
    car,
    find_scenario,
    ship,
    simulate_imu,
    through_waypoints,
)
from strapdown.simulation import vehicles as steps
from strapdown.simulation.gnss import GnssReceiver, moved_places, simulate_gnss
from strapdown.simulation.path_motion import Manoeuvre
from strapdown.simulation.scenarios import repeated_pulse
from strapdown.simulation.vehicles import LIMITS
from strapdown.simulation.walking import GAITS, WalkingMotion, walk
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, gnss_table
from strapdown.tables.checks import index_of, values_of

# Default onset and end time of a turn or a climb, s.
TURN_RAMP = {"car": 1.0, "aircraft": 3.0, "ship": 10.0}
CLIMB_RAMP = 3.0

# Quantities of the simulation by key of a file.
_KEYS = {
    "acceleration": "most_acceleration_m_per_s2",
    "place": "waypoints",
    "alt": "alt_m",
    "arm": "arm_m",
    "edge": "edge_s",
    "angle": "angle_deg",
    "bank": "bank_deg",
    "distance": "distance_m",
    "duration": "duration_s",
    "height": "height_m",
    "latitude": "lat_deg",
    "offset": "offset_m",
    "period": "period_s",
    "radius": "radius_m",
    "ramp": "ramp_s",
    "rate": "rate_hz",
    "speed": "speed_m_per_s",
    "stand": "stand_s",
    "time": "time_s",
    "to": "to_m_per_s",
}


#: Rate, sampling and seed of simulated samples.
Sampling: TypeAlias = TrajectorySpec | SimulationTable | NavigationSimulationTable
#: Motion, errors, the tables Imu, Attitude and Trajectory on the same stamps, and a Gnss table.
SimulatedTrajectory: TypeAlias = tuple[
    EarthMotion, ImuErrors, pd.DataFrame, pd.DataFrame, pd.DataFrame, pd.DataFrame
]


def simulate_trajectory(spec: TrajectorySpec) -> SimulatedTrajectory:
    """Simulate a trajectory.

    Returns
    -------
    motion : EarthMotion
    errors : ImuErrors
    imu, attitude, trajectory : DataFrame
        Imu, Attitude and Trajectory tables on the same stamps; the last two are exact.
    fixes : DataFrame
        Gnss table of the stated receiver.
    """
    errors = _errors(spec.sensor, spec.seed)
    with with_key(f"{spec.name}.toml"):
        motion = make_motion(spec.motion, find_ellipsoid(spec.ellipsoid))
        imu, attitude = simulate_samples(motion, spec, spec.sensor, spec.name)
        trajectory = motion.trajectory(imu.index.to_numpy(dtype=np.float64), source=spec.name)
        fixes = simulated_fixes(motion, spec.gnss, spec.seed, spec.name)
    return motion, errors, imu, attitude, trajectory, fixes


# Random streams under the seed; those of the receiver itself count from zero.
_STRUCK, _WAY = 100, 101


def simulated_fixes(
    motion: EarthMotion, asked: ReceiverTable, seed: Seed, name: str
) -> pd.DataFrame:
    """Simulate a receiver along a motion.

    Parameters
    ----------
    seed : int or SeedSequence
        Of all random numbers.
    name : str
        Name of the measurement, for messages.

    Returns
    -------
    DataFrame
        Gnss table without the fixes of outages; outliers state the precision of the others.
    """
    receiver = GnssReceiver(
        rate=asked.rate_hz,
        position_noise=asked.position_noise_m,
        position_drift=asked.position_drift_m,
        correlation_time=asked.correlation_time_s,
        velocity_noise=asked.velocity_noise_m_per_s,
        antenna=asked.antenna_m,
        time_offset=asked.time_offset_s,
        on_excess="unaffected",
    )
    table = simulate_gnss(motion, receiver, seed=seed, source=name)
    time = index_of(table)
    place, velocity = values_of(table, GEODETIC), values_of(table, VELOCITY)
    place_sd, velocity_sd = values_of(table, POSITION_SD), values_of(table, VELOCITY_SD)
    if asked.outlier_share > 0.0:
        chance = np.random.Generator(np.random.PCG64(child(seed, _STRUCK))).random(len(time))
        struck = chance < asked.outlier_share
        way = normal(seed, _WAY, len(time), axes=6)
        for part in (way[:, :3], way[:, 3:]):
            part /= np.linalg.norm(part, axis=1, keepdims=True)
        off = asked.outlier_size * struck[:, None] * way
        place = moved_places(place, off[:, :3] * place_sd, motion.ellipsoid)
        velocity = velocity + off[:, 3:] * velocity_sd
    if not asked.velocity:
        velocity_sd = np.full_like(velocity_sd, np.inf)
    kept = np.ones(len(time), dtype=np.bool_)
    for begin, end in asked.outages_s:
        kept &= (time < begin) | (time > end)
    return gnss_table(
        time[kept], place[kept], velocity[kept], place_sd[kept], velocity_sd[kept], source=name
    )


def scenario_of(spec: ScenarioSpec) -> Scenario:
    """Return the scenario of a specification: by its name, or from its own file."""
    if spec.own is None:
        return find_scenario(spec.name)
    own = spec.own
    with with_key(f"{own.name}.toml"):
        made: Motion
        if isinstance(own.motion, PulsesSpec):
            made = _of_pulses(own.motion)
        else:
            made = make_motion(own.motion, find_ellipsoid("wgs84"))
    gyro, accel = own.gyro, own.accel
    errors = ImuErrors(
        TriadErrors(
            noise_density=_times(gyro.noise_density_deg_per_s_per_sqrt_hz, np.pi / 180.0),
            bias=_times(gyro.bias_deg_per_s, np.pi / 180.0),
            trend=_times(gyro.trend_deg_per_s2, np.pi / 180.0),
        ),
        TriadErrors(
            noise_density=_times(accel.noise_density_ug_per_sqrt_hz, 1e-6 * STANDARD_GRAVITY),
            bias=accel.bias_m_per_s2,
        ),
    )
    title = own.title or own.name
    return Scenario(title, own.name, made, errors, own.references, f"{own.name}.toml")


def _of_pulses(motion: PulsesSpec) -> PulseMotion:
    pulses: list[Pulse] = []
    for axis, listed in enumerate((motion.x, motion.y, motion.z)):
        for p in listed:
            within = (p.start_s, p.start_s + p.duration_s)
            turn = p.turn_deg
            if turn is None:
                turn = (p.rate_deg_per_s or 0.0) * (p.duration_s - p.edge_s)
            pulses += repeated_pulse(axis, within, turn, p.edge_s, p.times, p.every_s or 0.0)
    latest = max(pulses, key=lambda p: p.end, default=None)
    if latest is not None and latest.end > motion.duration_s:
        raise ConfigError(
            "simulation.pulse-not-within-motion",
            quantity="duration",
            length=latest.end - latest.start,
            start=latest.start,
            duration=motion.duration_s,
        )
    q_nb = rotation.quaternion_from_euler([motion.roll_deg, motion.pitch_deg, motion.heading_deg])
    return PulseMotion(
        tuple(pulses), motion.duration_s, (q_nb[0], q_nb[1], q_nb[2], q_nb[3]), motion.arm_m
    )


def _times(values: tuple[float, float, float], factor: float) -> tuple[float, ...]:
    return tuple(factor * value for value in values)


def _errors(sensor: str | None, seed: int) -> ImuErrors:
    """Errors of one unit of a sensor; of a perfect one, if none is named."""
    return ImuErrors() if sensor is None else load_sensor(sensor).draw(seed)


def simulate_samples(
    motion: EarthMotion, asked: Sampling, sensor: str | None, name: str
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate the samples of a sensor along a motion: an Imu table, and the true attitude."""
    return simulate_imu(
        motion,
        _errors(sensor, asked.seed),
        rate=asked.rate_hz,
        sampling=asked.sampling,
        seed=asked.seed,
        source=name,
    )


def make_motion(spec: motions.MotionSpec, ellipsoid: Ellipsoid) -> EarthMotion:
    """Build the motion of a specification."""
    if isinstance(spec, motions.WaypointsSpec):
        return _waypoints(spec, ellipsoid)
    origin = Origin(spec.lat_deg, spec.lon_deg, spec.alt_m)
    if isinstance(spec, motions.SineVelocitySpec):
        return SineVelocityMotion(
            spec.duration_s,
            origin,
            spec.mean_velocity_m_per_s,
            spec.amplitude_m_per_s,
            spec.period_s,
            spec.phase_deg,
            ellipsoid,
        )
    if isinstance(spec, motions.StationarySpec):
        angles = (spec.roll_deg, spec.pitch_deg, spec.heading_deg)
        return StationaryMotion(spec.duration_s, origin, *angles, ellipsoid)
    if isinstance(spec, motions.RockingStandSpec):
        return PathMotion(
            spec.duration_s,
            origin,
            roll_deg=spec.roll_deg,
            attack_deg=spec.pitch_deg,
            heading_deg=spec.heading_deg,
            roll_waves=_angle_waves(spec.roll_waves),
            pitch_waves=_angle_waves(spec.pitch_waves),
            heading_waves=_angle_waves(spec.heading_waves),
            ellipsoid=ellipsoid,
        )
    if isinstance(spec, motions.WalkingSpec):
        strides = walk(
            GAITS[spec.gait],
            spec.strides,
            corner_each=spec.corner_each,
            corner_deg=spec.corner_deg,
            stairs=spec.stairs,
            climb=spec.stair_m,
        )
        return WalkingMotion(
            strides,
            origin,
            spec.heading_deg,
            spec.stand_s,
            spec.roll_deg,
            spec.pitch_deg,
            ellipsoid,
        )
    return _vehicle(spec, origin, ellipsoid)


def _vehicle(
    spec: motions.CarSpec | motions.AircraftSpec | motions.ShipSpec,
    origin: Origin,
    ellipsoid: Ellipsoid,
) -> EarthMotion:
    limits = LIMITS[spec.kind]
    if spec.most_acceleration_m_per_s2 is not None:
        limits = replace(limits, acceleration=spec.most_acceleration_m_per_s2)
    if spec.most_lateral_m_per_s2 is not None:
        limits = replace(limits, lateral=spec.most_lateral_m_per_s2)
    listed = [_step(one, TURN_RAMP[spec.kind]) for one in spec.manoeuvres]
    if isinstance(spec, motions.CarSpec):
        return car(
            origin,
            listed,
            heading_deg=spec.heading_deg,
            speed=spec.speed_m_per_s,
            sway_roll=spec.roll_deg_per_m_per_s2,
            sway_pitch=spec.pitch_deg_per_m_per_s2,
            limits=limits,
            ellipsoid=ellipsoid,
        )
    if isinstance(spec, motions.ShipSpec):
        return ship(
            origin,
            listed,
            heading_deg=spec.heading_deg,
            speed=spec.speed_m_per_s,
            roll_waves=_angle_waves(spec.roll_waves),
            pitch_waves=_angle_waves(spec.pitch_waves),
            heading_waves=_angle_waves(spec.heading_waves),
            heave_waves=tuple(
                Wave(w.amplitude_m, w.period_s, w.phase_deg) for w in spec.heave_waves
            ),
            limits=limits,
            ellipsoid=ellipsoid,
        )
    if spec.most_bank_deg is not None:
        limits = replace(limits, bank_deg=spec.most_bank_deg)
    return aircraft(
        origin,
        listed,
        heading_deg=spec.heading_deg,
        speed=spec.speed_m_per_s,
        attack_deg=spec.angle_of_attack_deg,
        limits=limits,
        ellipsoid=ellipsoid,
    )


def _step(spec: motions.Step, ramp: float) -> tuple[str, Manoeuvre]:
    """One maneuver with its name."""
    side = -1.0 if spec.do in ("turn_left", "descend") else 1.0
    step: Manoeuvre
    if isinstance(spec, motions.SpeedSpec):
        change = steps.Brake if spec.do == "brake" else steps.Accelerate
        step = change(spec.to_m_per_s, spec.duration_s)
    elif isinstance(spec, motions.StopSpec):
        step = steps.Stop(spec.braking_s, spec.stay_s)
    elif isinstance(spec, motions.StraightSpec):
        if spec.duration_s is not None:
            step = steps.Straight(spec.duration_s)
        else:
            step = steps.Along(spec.distance_m or 0.0)
    elif isinstance(spec, motions.TurnSpec):
        step = steps.Turn(side * spec.angle_deg, spec.radius_m, spec.ramp_s or ramp)
    elif isinstance(spec, motions.BankedTurnSpec):
        step = steps.BankedTurn(side * spec.angle_deg, spec.bank_deg, spec.ramp_s or ramp)
    elif isinstance(spec, motions.LaneChangeSpec):
        step = steps.LaneChange(spec.offset_m, spec.duration_s)
    elif isinstance(spec, motions.ClimbSpec):
        step = steps.Climb(side * spec.angle_deg, spec.height_m, spec.ramp_s or CLIMB_RAMP)
    else:
        step = steps.Level(spec.ramp_s or CLIMB_RAMP)
    return spec.do, step


def _waypoints(spec: motions.WaypointsSpec, ellipsoid: Ellipsoid) -> EarthMotion:
    places = [(w.lat_deg, w.lon_deg, w.alt_m) for w in spec.waypoints]
    times = [w.time_s for w in spec.waypoints if w.time_s is not None]
    speeds = [w.speed_m_per_s or spec.speed_m_per_s or 0.0 for w in spec.waypoints[1:]]
    return through_waypoints(
        places,
        times=times or None,
        speeds=None if times else speeds,
        most_acceleration=spec.most_acceleration_m_per_s2,
        ellipsoid=ellipsoid,
    )


def _angle_waves(waves: Iterable[AngleWaveSpec]) -> tuple[Wave, ...]:
    return tuple(Wave(w.amplitude_deg, w.period_s, w.phase_deg) for w in waves)


@contextmanager
def with_key(name: str) -> Iterator[None]:
    """Report errors with the keys of a file instead of the simulation's parameters.

    Parameters
    ----------
    name : str
        Name of the file.
    """
    try:
        yield
    except ConfigError as error:
        parts = (error.finding.quantity or "").split(", ")
        keys = ", ".join(_KEYS.get(part, part).replace("place ", "waypoint ") for part in parts)
        raise error.replaced(file=name, quantity=keys) from None
