"""Drives before a crash, their sensors with errors drawn from the priors, and the true answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strapdown import rotation
from strapdown.crash.entry_estimate import EntryPriors
from strapdown.frames import place_difference
from strapdown.nav_state import NavState
from strapdown.sensors.error_chain import apply
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation import ImuErrors, Origin, TriadErrors, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Accelerate, Brake, Straight, Turn
from strapdown.tables import ACCEL, GYRO, imu_table

ORIGIN = Origin(45.0, 20.0, 80.0)
LIVELY = car(
    ORIGIN,
    [
        ("in", Straight(2.0)),
        ("brake", Brake(12.0, 2.5)),
        ("bend", Turn(25.0, 60.0)),
        ("on", Straight(2.0)),
        ("away", Accelerate(16.0, 3.0)),
        ("out", Straight(1.0)),
    ],
    heading_deg=70.0,
    speed=20.0,
)
STEADY = car(ORIGIN, [("on", Straight(14.0))], heading_deg=70.0, speed=15.0)
IMPACT = 11.0
RATE = 200.0
ARM = (0.5, 0.3, -1.2)

GYRO_UNKNOWN = TriadUncertainty(
    noise_density=2e-4, bias=0.005, scale=0.005, misalignment=0.003, g_sensitivity=1e-4
)
ACCEL_UNKNOWN = TriadUncertainty(noise_density=5e-3, bias=0.15, scale=0.01, misalignment=0.005)
PRIORS = EntryPriors(
    GYRO_UNKNOWN, ACCEL_UNKNOWN, antenna_sd=0.05, time_offset_sd=0.01, tilt_sd_deg=5.0
)
RECEIVER = {"rate": 5.0, "position_noise": 0.5, "position_drift": 1.5, "velocity_noise": 0.05}


@dataclass(frozen=True)
class Clean:
    """What ideal sensors read on a motion."""

    motion: object
    time: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray

    @classmethod
    def of(cls, motion):
        imu, _ = simulate_imu(motion, ImuErrors(TriadErrors(), TriadErrors()), rate=RATE)
        return cls(motion, imu.index.to_numpy(), imu[GYRO].to_numpy(), imu[ACCEL].to_numpy())

    def imu(self, gyro=None, accel=None, seed=0):
        """The Imu table of sensors with errors."""
        rows = [
            apply(
                e or TriadErrors(),
                self.time,
                x,
                sampling="instantaneous",
                seed=seed + k,
                specific_force=self.accel,
            )
            for k, (e, x) in enumerate(((gyro, self.gyro), (accel, self.accel)))
        ]
        return imu_table(self.time, *rows, source="imu.csv")


def drawn(unknown, generator):
    """A triad of errors from its standard deviations."""
    cross = generator.standard_normal((3, 3)) * np.array(unknown.axis("misalignment"))[:, None]
    np.fill_diagonal(cross, 0.0)
    felt = generator.standard_normal((3, 3)) * np.array(unknown.axis("g_sensitivity"))[:, None]
    return TriadErrors(
        noise_density=unknown.axis("noise_density"),
        bias=tuple(generator.standard_normal(3) * unknown.axis("bias")),
        scale=tuple(generator.standard_normal(3) * unknown.axis("scale")),
        misalignment=cross.tolist(),
        g_sensitivity=felt.tolist(),
    )


def drawn_case(clean, priors, seed, **receiver):
    """Tables of one draw from the priors, and the errors of the two triads."""
    generator = np.random.default_rng(seed)
    gyro, accel = drawn(priors.gyro, generator), drawn(priors.accel, generator)
    antenna = np.array(ARM) + priors.antenna_sd * generator.standard_normal(3)
    late = priors.time_offset + priors.time_offset_sd * generator.standard_normal()
    fixes = simulate_gnss(
        clean.motion,
        GnssReceiver(**(RECEIVER | receiver), antenna=tuple(antenna), time_offset=late),
        seed=seed,
        source="gnss.csv",
    )
    return clean.imu(gyro, accel, seed=2 * seed + 1000), fixes, gyro, accel


def effective(errors, own, force, rows):
    """What a triad reads too much at the mean of what it feels."""
    mean, pushed = own[rows].mean(axis=0), force[rows].mean(axis=0)
    return (
        np.array(errors.bias)
        + np.array(errors.scale) * mean
        + np.array(errors.misalignment) @ mean
        + np.array(errors.g_sensitivity) @ pushed
    )


def errors_of(entry, clean, gyro=None, accel=None, window=10.0):
    """Truth minus estimate, (15,), in the order and the units of the covariance."""
    row = clean.motion.trajectory([entry.state.time])
    truth, at = NavState.from_trajectory(row), entry.state
    place = [np.degrees(at.lat), np.degrees(at.lon), at.alt]
    turn = rotation.compose(truth.q_nb, rotation.conjugate(at.q_nb))
    rows = (clean.time >= at.time - window) & (clean.time <= at.time)
    return np.concatenate(
        [
            place_difference(row[["lat", "lon", "alt"]].to_numpy()[0], place),
            truth.v_n - at.v_n,
            rotation.rotation_vector_from_quaternion(turn),
            effective(gyro or TriadErrors(), clean.gyro, clean.accel, rows) - entry.gyro_bias,
            effective(accel or TriadErrors(), clean.accel, clean.accel, rows) - entry.accel_bias,
        ]
    )
