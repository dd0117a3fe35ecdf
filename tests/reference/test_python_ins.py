"""Navigation beside python-ins: each against its own truth, and both limited by the same line.

python-ins makes its data with splines and has its nose down where the path climbs; the motions
are alike, and their data are not. So each side navigates its own data and is held to its own truth.
"""

from __future__ import annotations

import functools
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pyins import sim
from pyins.strapdown import Integrator, compute_increments_from_imu
from pyins.transform import compute_state_difference

sys.path.insert(0, str(Path(__file__).parents[1]))

from exact_increments import errors, rounding, start_of
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.simulation import (
    ImuErrors,
    Origin,
    SineVelocityMotion,
    StationaryMotion,
    simulate_imu,
)

# What python-ins asks of pandas is to go in a later version.
pytestmark = pytest.mark.filterwarnings("ignore:The (copy|inplace) keyword")

HOUR = 3600.0
MOTIONS = {
    "stationary": (StationaryMotion(HOUR, Origin(55.0, 37.0, 150.0), -5.0, 10.0, 110.0), 10.0),
    "sine": (
        SineVelocityMotion(HOUR, Origin(55.0, 37.0, 1500.0), (5.0, -3.0, 0.2), (1.0, 1.0, 1.0)),
        100.0,
    ),
}
KINDS = {"instantaneous": "rate", "mean": "increment"}
CASES = [(motion, sampling) for motion in MOTIONS for sampling in KINDS]


@functools.cache
def theirs(name, sampling):
    """Greatest error of python-ins at its own data of the motion."""
    kind = KINDS[sampling]
    if name == "stationary":
        time = np.arange(0.0, HOUR, 0.1)
        place, angles = np.tile([55.0, 37.0, 150.0], (time.size, 1)), [-5.0, 10.0, 110.0]
        truth, imu = sim.generate_imu(
            time, place, np.tile(angles, (time.size, 1)), sensor_type=kind
        )
    else:
        truth, imu = sim.generate_sine_velocity_motion(
            0.01,
            HOUR,
            [55.0, 37.0, 1500.0],
            [5.0, -3.0, 0.2],
            velocity_change_amplitude=1,
            sensor_type=kind,
        )
    found = Integrator(truth.iloc[0]).integrate(compute_increments_from_imu(imu, kind))
    return compute_state_difference(found, truth).abs().max()


@functools.cache
def samples(name, sampling):
    motion, rate = MOTIONS[name]
    return simulate_imu(motion, ImuErrors(), rate=rate, sampling=sampling)[0]


def ours(name, sampling, interpolation):
    """Greatest error of strapdown at exact data of the motion."""
    motion, _ = MOTIONS[name]
    increments = motion_increments(samples(name, sampling), interpolation=interpolation)
    return errors(run_mechanization(NorthEastDown(), start_of(motion), increments), motion).abs()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sampling"), CASES)
def test_no_component_is_worse_than_that_of_python_ins(name, sampling):
    found = ours(name, sampling, "cubic").max()
    peer = theirs(name, sampling)
    assert (found <= peer).all(), pd.DataFrame({"strapdown": found, "python-ins": peer})
    # And only rounding is left: of the sine the cubic errs by 11/720 (dt 2 pi/60 s)^4 = 2e-14 of
    # what it joins, which passes with every period.
    assert (found <= rounding(HOUR * MOTIONS[name][1], HOUR)).all(), found


@pytest.mark.slow
def test_the_trapezoid_costs_both_the_same():
    """Rates joined by a line: the line errs by dt²/12 of the curvature, whoever integrates it.

    Within 7 %, because the motions differ: 0.035 rad of mean pitch is of other signs.
    """
    found, peer = ours("sine", "instantaneous", "linear").max(), theirs("sine", "instantaneous")
    assert found.to_numpy() == pytest.approx(peer[found.index].to_numpy(), rel=0.07)


@pytest.mark.slow
def test_means_need_no_cubic_to_be_as_good():
    """The line through two means holds their integrals: what is left has the third order."""
    found, peer = ours("sine", "mean", "linear").max(), theirs("sine", "mean")
    assert (found <= peer).all(), pd.DataFrame({"strapdown": found, "python-ins": peer})
    # Of the first order of the line nothing may be left: each is under a fiftieth of the peer's,
    # or of the 2.6 m, 6.2 m and 4.5 m of rates joined by lines.
    assert found["north"] < 0.05
    assert found["east"] < 0.05
    assert found["down"] < 0.05
