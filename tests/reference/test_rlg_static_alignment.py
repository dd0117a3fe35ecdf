"""A ring-laser unit on a parked, rocking vehicle: 900 s, no surveyed azimuth.

Its source states a heading of 90.6 deg; an inertial-frame alignment of it gives pitch 0.90 and
roll 0.17 deg at the start. 0.01 deg/h of an east gyro's bias moves the heading by 0.046 deg.
"""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.site import Site
from strapdown.formats import read_log
from strapdown.prefilter import PREFILTERS
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.imu_uncertainty import ImuUncertainty

SITE = Site(34.246048, 108.909664, 380.0)
# Ring lasers of navigation grade; which ones they were is not known.
RING_LASERS = ImuUncertainty.of_sensor(load_sensor("hg9900"))
HEADING, PITCH, ROLL = 90.6, 0.90, 0.17


@pytest.fixture(scope="module")
def imu(recordings):
    return read_log(recordings("rlg_static") / "part1_first900s.imu").imu


def first(imu, seconds):
    part = imu.iloc[: round(seconds * 100)]
    part.attrs = dict(imu.attrs)
    return part


@pytest.mark.parametrize("seconds", [300, 900])
def test_fine_alignment_confirms_the_inertial_frame(imu, seconds):
    part = first(imu, seconds)
    coarse = COARSE_ALIGNMENTS["inertial_frame"]().align(first(imu, 100), SITE, RING_LASERS)
    rest = part.iloc[len(first(imu, 100)) - 1 :]
    rest.attrs = dict(imu.attrs)
    found = FineAlignment().align(rest, SITE, RING_LASERS, coarse)
    heading, sd = found.alignment.roll_pitch_heading[2], found.alignment.sd_deg[2]
    # Believable: no smaller than the data sheet's bias alone makes it, 0.0035 deg/h (sd) over
    # 12.43 deg/h, and not larger than twice that with the noise of 200 s, 0.04 deg.
    assert 0.0035 / 12.43 * 57.3 < sd < 0.09
    assert abs(heading - HEADING) < 0.1
    assert abs(heading - HEADING) < 3.0 * np.hypot(sd, 0.05)


def test_the_attitude_at_the_start(imu):
    coarse = COARSE_ALIGNMENTS["inertial_frame"]().align(first(imu, 300), SITE, RING_LASERS)
    found = FineAlignment().align(first(imu, 300), SITE, RING_LASERS, coarse)
    roll, pitch, heading = found.at_start.roll_pitch_heading
    assert abs(pitch - PITCH) < 0.05
    assert abs(roll - ROLL) < 0.05
    assert abs(heading - HEADING) < 0.1


@pytest.mark.parametrize("name", ["robust_fir", "summed"])
def test_a_prefilter_leaves_the_heading_where_it_is(imu, name):
    """Knocks of 0.01 s are what a pre-filter at 100 Hz takes for outliers: a few, and small."""
    filtered = PREFILTERS[name](rate=50.0).apply(first(imu, 300))
    assert filtered.report.replaced.shape[0] < 10
    way = COARSE_ALIGNMENTS["inertial_frame"]()
    coarse = way.align(filtered.imu, SITE, RING_LASERS)
    plain = way.align(first(imu, 300), SITE, RING_LASERS)
    # A knock that is cut off turns the attitude by up to 0.01 rad/s x 0.01 s, 1e-4 rad, where the
    # Earth turns the vertical by 2e-2 rad in 300 s: each is worth up to 0.3 deg at the ends of the
    # record and much less within. They are both ways; together less than the stated deviation.
    assert abs(coarse.roll_pitch_heading[2] - plain.roll_pitch_heading[2]) < coarse.sd_deg[2]
