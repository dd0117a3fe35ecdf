"""imufusion: the revised filter of Madgwick's thesis (2014), chapter 7, with its defaults.

Set to north-east-down; specific force in g; rates in deg/s; single precision inside. Each
sample has its own step. It starts at the given attitude, without its start-up phase.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from strapdown.constants import STANDARD_GRAVITY, Array
from strapdown.peers.peer import Peer, PeerFilter, Samples, load


def _run(samples: Samples, q_nb: Array, update: Callable[[Any, int], Any]) -> Array:
    library = load("imufusion")
    settings = library.AhrsSettings()
    # Version 1.3.3 ignores it as a constructor argument.
    settings.convention = library.CONVENTION_NED
    settings.sample_rate = 1.0 / float(samples.dt.mean())
    ahrs = library.Ahrs()
    ahrs.set_settings(settings)
    ahrs.skip_startup()
    ahrs.set_quaternion(q_nb)
    q = np.empty((len(samples.gyro), 4))
    q[0] = q_nb
    for k, dt in enumerate(samples.dt.tolist(), start=1):
        ahrs.set_sample_period(dt)
        update(ahrs, k)
        q[k] = ahrs.get_quaternion()
    return q


def _gyro(samples: Samples, q_nb: Array) -> Array:
    """Integrate the gyro alone: a specific force of exactly zero is ignored."""
    gyro, none = np.degrees(samples.gyro), np.zeros(3)
    return _run(samples, q_nb, lambda ahrs, k: ahrs.update_no_magnetometer(gyro[k], none))


def _inclination(samples: Samples, q_nb: Array) -> Array:
    gyro, force = np.degrees(samples.gyro), samples.force / STANDARD_GRAVITY
    return _run(samples, q_nb, lambda ahrs, k: ahrs.update_no_magnetometer(gyro[k], force[k]))


def _magnetic(samples: Samples, q_nb: Array) -> Array:
    gyro, force = np.degrees(samples.gyro), samples.force / STANDARD_GRAVITY
    mag = samples.mag
    return _run(samples, q_nb, lambda ahrs, k: ahrs.update(gyro[k], force[k], mag[k]))


PEER = Peer(
    name="imufusion",
    licence="MIT",
    source="Madgwick, PhD thesis, University of Bristol 2014, chapter 7",
    filters={
        "imufusion": PeerFilter(
            {"gyro": _gyro, "gyro+accel": _inclination, "gyro+accel+mag": _magnetic},
            steady=False,
            microseconds=7.0,
        )
    },
)
