"""A recorded drive by the chain that is proposed for it: its pitch is that of the road, and more.

What is proposed goes by the recording alone. There is no truth of the attitude; but a car's axis
lies along the road, so that pitch less the slope of its way is the mounting of the unit, -6.8 deg
as the recording's description has it, to what springs and the distance of the axles make.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.frames import place_difference
from strapdown.navigation.truth_comparison import smoother_consistency
from strapdown.systems.navigation_proposal import propose
from strapdown.systems.navigation_run import run_navigation
from strapdown.tables import GEODETIC

pytestmark = pytest.mark.slow

MOUNTING = -6.8
#: The way before and after that its slope is of, m: about the distance of the axles.
WAY = 2.0
#: The body on its springs against the road, deg.
SPRINGS = 0.7


@pytest.fixture(scope="module", params=["mpu-6050", "icm-42688-p"])
def result(request, recordings):
    folder = recordings("car_rtk")
    made = propose(
        LogTable(path=str(folder / "part1_imu_frd_si.csv")),
        gnss=FixesTable(path=str(folder / "part1_gnss_rtk.csv")),
        sensor=request.param,
    )
    made.table["aiding"]["wheels"] = {"kind": "no_slip", "mounting_sd_deg": (6.0, 6.0)}
    return made, navigated(made, kind="rts")


def navigated(made, **smoother):
    table = {"name": "drive", **made.table, "smoother": smoother}
    return run_navigation(NavigationSpec.checked(table))


def slopes(fixes):
    """Time, speed and slope of the way in deg where fixes are fixed."""
    place = fixes[GEODETIC].to_numpy()
    apart = place_difference(place, place[0])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(apart[:, :2], axis=0).T))])
    height = place[:, 2]
    rise = np.interp(way + WAY, way, height) - np.interp(way - WAY, way, height)
    speed = np.gradient(way, fixes.index.to_numpy())
    good = (speed > 2.0) & (fixes["quality"].to_numpy() == 4)
    return fixes.index.to_numpy()[good], np.degrees(np.arctan2(rise, 2.0 * WAY))[good]


def test_the_pitch_is_that_of_the_road_within_its_bound(result):
    made, run = result
    offset = made.table["aiding"]["gnss"]["time_offset_s"]
    for record in (run.forward, run.record):
        trajectory, sd = record.trajectory, record.sd
        time, slope = slopes(made.gnss)
        at = time - offset
        within = (at > trajectory.index[0]) & (at < trajectory.index[-1])
        at, slope = at[within], slope[within]
        pitch = np.interp(at, trajectory.index, trajectory["pitch"])
        told = np.hypot(np.interp(at, sd.index, sd["pitch"]), SPRINGS)
        off = pitch - slope - MOUNTING
        # Down a ramp of 10 deg in the first ten seconds: it is the road, and no error.
        assert slope.min() < -8.0
        assert (np.abs(off) < 1.96 * told).mean() > 0.95
        assert np.sqrt(np.mean(off**2)) < 1.0
    # The clock of these sensors runs apart from the receiver's.
    assert made.table["aiding"]["gnss"]["time_offset_drift_s_per_sqrt_s"] > 0.0


def test_later_fixes_confirm_the_bounds_of_the_filter(result):
    made, _ = result
    # Filter and smoother of one linearization. A pass about the smoothed states moves the vertical
    # arm, and with it the height throughout, by 1.5 cm: two thirds of their standard deviations,
    # which filter and smoother have in common, and more than is left of their difference.
    run = navigated(made, kind="rts", passes=1)
    # A receiver's error lasts: instants at which the car has not moved off are of one and the same
    # (0.05 m here, from ambiguities that are fixed anew on the way), no evidence for each of them.
    moves = made.gnss.index[made.gnss["VN"].abs() > 0.5][0]
    driven = [
        dataclasses.replace(each, trajectory=each.trajectory[moves:], sd=each.sd[moves:])
        for each in (run.forward, run.record)
    ]
    found = smoother_consistency(*driven)
    share = dict(zip(found.columns, found.share, strict=True))
    # 62 and 57 % of the east without a clock that drifts. One of a hundred is left to fixes
    # whose errors last for many epochs.
    assert min(share.values()) > 0.92, share
    assert share["pitch"] > 0.98
