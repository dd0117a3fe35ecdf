"""Figs. 3 and 6 with a real log: a sensor turned twice about each axis and put back by hand.

The recording is not part of the source: ``STRAPDOWN_DATA`` names the folder that holds
``mpu6050_turns`` (a MEMS sensor at a mean rate of 100 Hz; EUPL-1.2). Start and end of each log are
reference points of the paper's kind: the same attitude, two whole turns apart, known to what a
hand can put back, which is some degrees.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from papers.alexiev.motions import algorithm_history
from papers.reproduction import Figure, FigurePanel, Part, Table, Trace
from strapdown import read_log, rotation
from strapdown.increments import increments_from_imu
from strapdown.tables import GYRO, imu_table

Array = NDArray[np.float64]

FOLDER, STILL = "mpu6050_turns", "unmoved-10min"
LOGS = {
    "x": "rotate-360ccw-around-x-pointing-forward",
    "y": "rotate-360ccw-around-y-pointing-left",
    "z": "rotate-360ccw-around-z-pointing-up",
}
EVERY = 5  # samples: 100 Hz in the mean becomes 20 Hz
_NUMBERS = (
    "MPU-6050, mean rate 100 Hz, stamps in bursts; two turns by hand about each axis of the board; "
    "bias of the gyro from ten unmoved minutes of another log."
)


@dataclass(frozen=True)
class Turned:
    """One log of two turns.

    Attributes
    ----------
    time : ndarray, (n,), s
        From the first sample on.
    rate : ndarray, (n, 3), deg/s
        Of the gyro, bias taken off.
    course : dict of (ndarray, ndarray)
        By algorithm and rate: instants, and the angle from the pose at the start, deg.
    """

    time: Array
    rate: Array
    course: dict[str, tuple[Array, Array]]

    def at_return(self, name: str) -> float:
        """Angle between the poses at the start and at the end, deg; zero if nothing erred."""
        return float(self.course[name][1][-1])


def folder() -> Path | None:
    """Return the folder of the recording, or None where there is none."""
    root = os.environ.get("STRAPDOWN_DATA")
    found = Path(root) / FOLDER if root else None
    return found if found is not None and found.is_dir() else None


def turned(log: Path, bias: Array) -> Turned:
    """Integrate a log with the naive sum and direction cosines, at its rate and at a fifth."""
    imu = read_log(log).imu
    time = imu.index.to_numpy(dtype=np.float64)
    rate = imu[GYRO].to_numpy(dtype=np.float64) - bias
    course = {}
    for name, algorithm, every in (
        ("dcm, 100 Hz", "dcm", 1),
        ("dcm, 20 Hz", "dcm", EVERY),
        ("naive, 100 Hz", "naive", 1),
    ):
        # The last sample is kept, or the turn that is left after the last fifth is lost.
        rows = np.unique(np.append(np.arange(0, len(time), every), len(time) - 1))
        q = algorithm_history(
            algorithm,
            increments_from_imu(imu_table(time[rows], rate[rows])),
            (1.0, 0.0, 0.0, 0.0),
        )
        course[name] = time[rows] - time[0], rotation.rotation_angle(q, q[0])
    return Turned(time - time[0], np.degrees(rate), course)


def figures(found: dict[str, Turned]) -> list[Figure]:
    """Return Fig. 3, the gyro of each log, and Fig. 6, the angle from the pose at the start."""
    return [
        Figure(
            f"{slug}-real-{axis}",
            f"{title}, a real log: two turns about {axis}",
            caption,
            _NUMBERS,
            "time, s",
            panels,
            marks=((float(made.time[0]), "start"), (float(made.time[-1]), "the same pose")),
        )
        for axis, made in found.items()
        for slug, title, caption, panels in (
            (
                "fig3",
                "Fig. 3",
                "Rates of the gyro, its bias taken off.",
                (
                    FigurePanel(
                        "gyro, deg/s",
                        tuple(
                            Trace(f"gyro {name}", made.time, made.rate[:, k])
                            for k, name in enumerate("xyz")
                        ),
                    ),
                ),
            ),
            (
                "fig6",
                "Fig. 6",
                "Angle from the pose at the start: zero after each whole turn, and at the end, "
                "where the board was put back.",
                (
                    FigurePanel(
                        "angle, deg",
                        tuple(Trace(name, *values) for name, values in made.course.items()),
                    ),
                ),
            ),
        )
    ]


def table(found: dict[str, Turned]) -> Table:
    """Return the angle that is left where the pose at the start is taken again."""
    names = tuple(next(iter(found.values())).course)
    return Table(
        "real-log",
        "Figs. 3 and 6 with a real log: the angle left at the return",
        "Degrees between the poses at the start and at the end, which are the same to what a hand "
        "can put back: what direction cosines leave is sensor and hand together. The naive sum is "
        "far off although each log turns about one axis: a hand wobbles about the others, and "
        "these rotations do not commute.",
        ("two turns about", *(f"{name}, °" for name in names), "greatest rate, °/s"),
        tuple(
            (
                axis,
                (
                    *(made.at_return(name) for name in names),
                    float(np.linalg.norm(made.rate, axis=1).max()),
                ),
            )
            for axis, made in found.items()
        ),
    )


def real_log() -> Part:
    """Return figures and table of the recording; nothing but a line where it is not there."""
    logs = folder()
    if logs is None:
        print(
            f"Figs. 3 and 6 of a real log are left out: STRAPDOWN_DATA has no {FOLDER}.",
            file=sys.stderr,
        )
        return [], [], []
    bias = read_log(logs / STILL).imu[GYRO].to_numpy(dtype=np.float64).mean(axis=0)
    found = {axis: turned(logs / name, bias) for axis, name in LOGS.items()}
    return [], [table(found)], figures(found)
