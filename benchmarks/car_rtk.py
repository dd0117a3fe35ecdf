"""``python -m benchmarks.car_rtk``: python-ins on the recorded car, at the places of our own test.

The recording, the first state, the biases that the rest shows, the model of wheels that do not slip
and the places without fixes are those of ``tests/reference/test_car_rtk_navigation.py``, which
measures ours. python-ins has neither states for a mounting, nor for clocks, nor a drift that lasts,
so it is given what the whole recording tells of the first two, and a gyro that walks.
"""

from __future__ import annotations

import argparse
import math
import os
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from strapdown.constants import STANDARD_GRAVITY

#: When the filter begins, when it has settled, and how long the car stands at first, s.
BEGIN, SETTLED, REST = 58.0, 90.0, 30.0
#: Stamps of the inertial sensors less those of places, and how late velocities are, s.
OFFSET, DELAY = 0.135, 0.125
#: Antenna from the sensors, m.
ARM = (0.0, -0.05, 0.0)
#: Roll, pitch and yaw of the sensors in the car, deg.
MOUNTING = (0.0, -6.8, 5.0)
#: Of one fix a second: m, m/s.
POSITION_SD, VELOCITY_SD = 0.03, 0.05
#: First state: m, m/s, deg of the level, deg of the heading.
START_SD = (1.0, 0.3, 4.0, 10.0)
#: Sensors: deg/s, m/s²; and the walk of a gyro that shakes, 0.2 deg/s in 20 s, as deg/s/√s.
GYRO_BIAS, ACCEL_BIAS, GYRO_WALK = 0.05, 0.15, (0.005, 0.06, 0.001)
#: Of what no wheel does, m/s and deg/g; by how much correlated errors widen a variance; s.
LATERAL, VERTICAL, SLIP, DIVE, WIDER, INTERVAL = 0.03, 0.1, 4.0, 2.0, 2.16, 0.5
#: Largest rate of turn with wheels that do not slip, deg/s.
LARGEST_RATE = 45.0
#: Steps of its covariance, s.
STEP = 0.25
SAMPLES = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
FORCE, RATE = SAMPLES[3:], ["rate_x", "rate_y", "rate_z"]
PLACE, SPEED, ANGLES = ["lat", "lon", "alt"], ["VN", "VE", "VD"], ["roll", "pitch", "heading"]


class Recording(NamedTuple):
    """What was measured."""

    imu: Any
    increments: Any
    #: Standard deviations of the samples at rest, as white noise.
    noise: np.ndarray
    roll: float
    pitch: float
    fixes: np.ndarray
    #: When the places and the velocities were, on the clock of the sensors, s.
    at_place: np.ndarray
    at_speed: np.ndarray


def recording(folder: Path) -> Recording:
    """Read both tables; the means of the rest come off the gyros."""
    import pandas as pd
    from pyins.strapdown import compute_increments_from_imu

    samples = np.loadtxt(folder / "part1_imu_frd_si.csv", delimiter=",")
    fixes = np.loadtxt(folder / "part1_gnss_rtk.csv", delimiter=",")
    time = samples[:, 0]
    rest = samples[time < time[0] + REST, 1:]
    samples[:, 1:4] -= rest[:, :3].mean(axis=0)
    imu = pd.DataFrame(samples[:, 1:], index=time, columns=SAMPLES)
    force = rest[:, 3:].mean(axis=0)
    return Recording(
        imu,
        compute_increments_from_imu(imu, "rate"),
        rest.std(axis=0) * math.sqrt(float(np.median(np.diff(time)))),
        math.degrees(math.atan2(-force[1], -force[2])),
        math.degrees(math.atan2(force[0], math.hypot(force[1], force[2]))),
        fixes,
        # As round as the stamps are: python-ins looks a measurement up by its time.
        np.round(fixes[:, 0] + OFFSET, 6),
        np.round(fixes[:, 0] + OFFSET - DELAY, 6),
    )


def wheels(made: Recording, begin: float, end: float) -> Any:
    """Wheels that do not slip, as a measurement of python-ins."""
    import pandas as pd
    from pyins.measurements import Measurement
    from pyins.transform import mat_from_rph

    times = np.arange(math.ceil(begin / INTERVAL) + 1, math.floor(end / INTERVAL)) * INTERVAL
    # Beside the samples: where both are at one instant, it would be used one sample later.
    times = np.round(times + 0.003, 6)
    each = round(INTERVAL / float(np.median(np.diff(made.imu.index))))
    means = made.imu[FORCE].rolling(each, min_periods=1).mean().to_numpy()
    force = means[np.searchsorted(made.imu.index, times) - 1]
    C_vb = mat_from_rph(MOUNTING)

    class NoSlip(Measurement):  # type: ignore[misc]
        def compute_matrices(self, time: float, pva: Any, error_model: Any) -> Any:
            if time not in self.data.index:
                return None
            C_bn = mat_from_rph(pva[ANGLES]).T
            if abs((C_vb @ pva[RATE].to_numpy(float))[2]) > math.radians(LARGEST_RATE):
                return None
            v = C_vb @ C_bn @ pva[SPEED].to_numpy(float)
            f = C_vb @ self.data.loc[time].to_numpy() / STANDARD_GRAVITY
            moved = v[0] * np.radians([SLIP * f[1], DIVE * f[0]])
            R = np.diag(WIDER * np.hypot([LATERAL, VERTICAL], moved) ** 2)
            H = C_vb @ error_model.body_velocity_error_jacobian(pva)
            return v[1:], H[1:], R

    return NoSlip(pd.DataFrame(force, index=times, columns=FORCE))


def largest_error(made: Recording, begin: float, end: float, rolls: bool) -> float:
    """Navigate with the fixes up to a begin and none after it; return the largest error, m.

    Parameters
    ----------
    made : Recording
    begin, end : float, s
        On the clock of the sensors.
    rolls : bool
        Whether it has wheels that do not slip.
    """
    import pandas as pd
    from pyins.filters import run_feedback_filter
    from pyins.inertial_sensor import EstimationModel
    from pyins.measurements import NedVelocity, Position
    from pyins.transform import compute_lla_difference, mat_from_rph

    time = made.increments.index
    first = time[np.searchsorted(time, made.imu.index[0] + BEGIN) - 1]
    fixes, seconds = made.fixes, np.abs(made.fixes[:, 0] - np.round(made.fixes[:, 0])) < 1e-3
    place = [float(np.interp(first, made.at_place, fixes[:, k])) for k in (1, 2, 3)]
    v = [float(np.interp(first, made.at_speed, fixes[:, k])) for k in (4, 5, 6)]
    heading = math.degrees(math.atan2(v[1], v[0])) + MOUNTING[2]
    start = pd.Series(
        [*place, *v, made.roll, made.pitch, heading], index=PLACE + SPEED + ANGLES, name=first
    )

    def told(at: np.ndarray, columns: slice, names: Sequence[str]) -> Any:
        # A row is kept back whole, by the instant of its place.
        used = seconds & (at > first + 0.5) & (made.at_place <= begin)
        return pd.DataFrame(fixes[used, columns], index=at[used], columns=list(names))

    aids = [
        Position(told(made.at_place, slice(1, 4), PLACE), POSITION_SD, np.array(ARM)),
        NedVelocity(told(made.at_speed, slice(4, 7), SPEED), VELOCITY_SD, np.array(ARM)),
    ]
    if rolls:
        aids.append(wheels(made, first, end))
    found = run_feedback_filter(
        start,
        *START_SD,
        made.increments[(time > first) & (time <= end + 0.05)],
        EstimationModel(
            bias_sd=math.radians(GYRO_BIAS),
            noise=made.noise[:3],
            bias_walk=np.radians(GYRO_WALK),
        ),
        EstimationModel(bias_sd=ACCEL_BIAS, noise=made.noise[3:]),
        measurements=aids,
        time_step=STEP,
    ).trajectory
    found = found.assign(heading=np.degrees(np.unwrap(np.radians(found["heading"]))))
    kept = (made.at_place > begin) & (made.at_place <= end)
    at = made.at_place[kept]
    values = {name: np.interp(at, found.index, found[name]) for name in PLACE + ANGLES}
    arm = mat_from_rph(np.column_stack([values[name] for name in ANGLES])) @ np.array(ARM)
    there = np.column_stack([values[name] for name in PLACE])
    off = compute_lla_difference(there, fixes[kept, 1:4]) + arm
    return float(np.hypot(off[:, 0], off[:, 1]).max())


def rows(folder: Path, lengths: Sequence[float], places: int) -> Iterator[str]:
    """Yield a line for each form and length: median and worst of the largest errors."""
    from strapdown.navigation.outage_test import spans_to_withhold

    made = recording(folder)
    time = made.imu.index
    for rolls in (False, True):
        for length in lengths:
            spans = spans_to_withhold(time[0] + SETTLED, time[-1] - 1.0, length, places)
            errors = [largest_error(made, one.begin, one.end, rolls) for one in spans]
            what = "python-ins, wheels that do not slip" if rolls else "python-ins"
            each = " ".join(f"{x:.1f}" for x in errors)
            yield (
                f"{what}, {length:g} s at {places} places: "
                f"{np.median(errors):.1f} ({max(errors):.1f}) m; {each}"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description="python-ins on the recorded car, without fixes")
    parser.add_argument("--places", type=int, default=5)
    parser.add_argument("--lengths", type=float, nargs="+", default=[10.0, 30.0, 60.0])
    asked = parser.parse_args()
    folder = Path(os.environ.get("STRAPDOWN_DATA", "../shared/data")) / "car_rtk"
    if not folder.is_dir():
        print(f"{folder} is not there (STRAPDOWN_DATA says where recordings are): left out")
        return
    try:
        import pyins  # noqa: F401
    except ImportError:
        print("python-ins is not installed (the extra 'test'): left out")
        return
    # What python-ins asks of pandas is to go in a later version.
    warnings.filterwarnings("ignore", message="The (copy|inplace) keyword")
    for line in rows(folder, asked.lengths, asked.places):
        print(line, flush=True)


if __name__ == "__main__":
    main()
