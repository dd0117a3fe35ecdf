"""vqf: the versatile quaternion-based filter of Laidig and Seel (2023), with its defaults.

Earth axes east-north-up; any right-handed body axes; specific force up at rest. Constant rate.
It does not accept an initial attitude: with an accelerometer it levels itself with the first
sample, and without a magnetometer its heading has an arbitrary zero.
"""

from __future__ import annotations

import numpy as np

from strapdown import rotation
from strapdown.constants import Array
from strapdown.peers.peer import Peer, PeerFilter, Samples, align_heading, load
from strapdown.rotation import Q_NED_ENU


def _gyro(samples: Samples, q_nb: Array) -> Array:
    """Integrate the gyro alone: a specific force of exactly zero is ignored."""
    gyro = samples.gyro[1:]
    turned = load("vqf").VQF(float(samples.dt.mean())).updateBatch(gyro, np.zeros_like(gyro))
    return np.vstack([q_nb, rotation.compose(q_nb, turned["quat6D"])])


def _inclination(samples: Samples, q_nb: Array) -> Array:
    found = load("vqf").VQF(float(samples.dt.mean())).updateBatch(samples.gyro, samples.force)
    return align_heading(rotation.compose(Q_NED_ENU, found["quat6D"]), q_nb)


def _magnetic(samples: Samples, q_nb: Array) -> Array:
    vqf = load("vqf").VQF(float(samples.dt.mean()))
    found = vqf.updateBatch(samples.gyro, samples.force, samples.mag)
    return rotation.compose(Q_NED_ENU, found["quat9D"])


PEER = Peer(
    name="vqf",
    licence="MIT",
    source="Laidig, Seel, Information Fusion 91 (2023) 187, doi:10.1016/j.inffus.2022.10.014",
    filters={
        "vqf": PeerFilter(
            {"gyro": _gyro, "gyro+accel": _inclination, "gyro+accel+mag": _magnetic},
            steady=True,
            microseconds=4.5,
        )
    },
)
