"""ahrs: angular rate, Madgwick (2011), Mahony (2008) and a Kalman filter, with its defaults.

All rotate body into earth axes and multiply increments from the right. The earth axes follow
from the sign of the acceleration and from the axis compared with the horizontal field:

========  ==========================  =====================
filter    acceleration                earth axes
========  ==========================  =====================
Madgwick  gravity, down at rest       north-east-down
Mahony    specific force, up at rest  east-north-up
EKF       gravity, down at rest       north-east-down
========  ==========================  =====================

Each sample has its own step, and each run starts at the given attitude: sample by sample,
because the Madgwick class ignores the attitude when it is given a magnetometer.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from strapdown import rotation
from strapdown.constants import Array
from strapdown.peers.peer import Peer, PeerFilter, Samples, load
from strapdown.rotation import Q_NED_ENU


def _step_by_step(
    samples: Samples, start: Array, update: Callable[[Array, int, float], Array]
) -> Array:
    q = np.empty((len(samples.gyro), 4))
    q[0] = start
    for k, dt in enumerate(samples.dt.tolist(), start=1):
        q[k] = update(q[k - 1], k, dt)
    return q


def _angular_rate(samples: Samples, q_nb: Array, method: str) -> Array:
    # First-order series: from order 2 on, version 0.4.0 squares elements instead of the matrix.
    update, gyro = load("ahrs").filters.AngularRate().update, samples.gyro
    return _step_by_step(
        samples, q_nb, lambda q, k, dt: update(q, gyro[k], method=method, order=1, dt=dt)
    )


def _madgwick(samples: Samples, q_nb: Array) -> Array:
    filters, gyro, gravity, mag = load("ahrs").filters, samples.gyro, -samples.force, samples.mag
    if len(mag):
        marg = filters.Madgwick(gain=0.041).updateMARG
        return _step_by_step(
            samples, q_nb, lambda q, k, dt: marg(q, gyro[k], gravity[k], mag[k], dt=dt)
        )
    alone = filters.Madgwick(gain=0.033).updateIMU
    return _step_by_step(samples, q_nb, lambda q, k, dt: alone(q, gyro[k], gravity[k], dt=dt))


def _mahony(samples: Samples, q_nb: Array) -> Array:
    mahony, gyro = load("ahrs").filters.Mahony(), samples.gyro
    force, mag = samples.force, samples.mag
    start = rotation.compose(Q_NED_ENU, q_nb)
    if len(mag):
        q = _step_by_step(
            samples,
            start,
            lambda q, k, dt: mahony.updateMARG(q, gyro[k], force[k], mag[k], dt=dt),
        )
    else:
        q = _step_by_step(
            samples, start, lambda q, k, dt: mahony.updateIMU(q, gyro[k], force[k], dt=dt)
        )
    return np.vstack([q_nb, rotation.compose(Q_NED_ENU, q[1:])])


def _dip_deg(samples: Samples) -> float:
    """Dip of the field: median angle below the plane normal to the specific force."""
    sizes = np.linalg.norm(samples.force, axis=1) * np.linalg.norm(samples.mag, axis=1)
    sine = -(samples.force * samples.mag).sum(axis=1)[sizes > 0.0] / sizes[sizes > 0.0]
    return float(np.degrees(np.arcsin(np.clip(np.median(sine), -1.0, 1.0)))) if sine.size else 0.0


def _kalman(samples: Samples, q_nb: Array) -> Array:
    filters, gyro, gravity, mag = load("ahrs").filters, samples.gyro, -samples.force, samples.mag
    if len(mag):
        # The filter takes the presence of a magnetometer from the attribute, not from the call.
        marg = filters.EKF(mag=mag, frame="NED", magnetic_ref=_dip_deg(samples))
        return _step_by_step(
            samples, q_nb, lambda q, k, dt: marg.update(q, gyro[k], gravity[k], mag[k], dt=dt)
        )
    alone = filters.EKF(frame="NED", magnetic_ref=0.0)
    return _step_by_step(
        samples, q_nb, lambda q, k, dt: alone.update(q, gyro[k], gravity[k], dt=dt)
    )


PEER = Peer(
    name="ahrs",
    licence="MIT",
    source="https://ahrs.readthedocs.io",
    filters={
        "closed": PeerFilter({"gyro": partial(_angular_rate, method="closed")}, False, 50.0),
        "series": PeerFilter({"gyro": partial(_angular_rate, method="series")}, False, 50.0),
        "madgwick": PeerFilter(
            {"gyro+accel": _madgwick, "gyro+accel+mag": _madgwick}, False, 130.0
        ),
        "mahony": PeerFilter({"gyro+accel": _mahony, "gyro+accel+mag": _mahony}, False, 170.0),
        "ekf": PeerFilter({"gyro+accel": _kalman, "gyro+accel+mag": _kalman}, False, 260.0),
    },
)
