"""Filters over a day and near a pole: what must not matter does not."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.navigation.replay import run_batch
from strapdown.navigation.truth_comparison import state_errors
from strapdown.systems.navigation_run import make_chain
from strapdown.systems.navigation_source import read_navigation_source

DAY, BETWEEN = 86_400.0, 21_600.0
#: Covariance steps of the day, s, and states.
STEP, STATES = 10.0, 15
EPS = np.finfo(np.float64).eps


def record_of(table):
    """The source and the record of a specification, without judging it."""
    spec = NavigationSpec.checked(table)
    source = read_navigation_source(spec)
    chain = make_chain(spec, sensors_of(spec))
    return source, run_batch(chain, source.imu, source.tables, spec.recorder.make()).record


def a_day(form):
    """A body that stays where it is, by its sensors alone but for a position each six hours."""
    place = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0, "heading_deg": 127.0}
    return record_of(
        {
            "simulation": {
                "rate_hz": 1.0,
                "seed": 11,
                "sampling": "mean",
                "motion": {"kind": "stationary", **place, "duration_s": DAY},
                "gnss": {
                    "gps": {"rate_hz": 1.0 / BETWEEN, "position_noise_m": 1.0, "velocity": False}
                },
            },
            "sensors": {"sensor": "fog-1000", "states": ["gyro_bias", "accel_bias"]},
            "start": {
                **place,
                "roll_deg": 0.0,
                "pitch_deg": 0.0,
                "position_sd_m": 1.0,
                "velocity_sd_m_per_s": 0.01,
                "tilt_sd_deg": 0.005,
                "heading_sd_deg": 0.1,
            },
            "mechanization": {"kind": "wander_azimuth", "height": "held"},
            "filter": {
                "kind": "error_state",
                "covariance": form,
                "step_s": STEP,
                "mark_interval_s": 600.0,
            },
            "aiding": {"gps": {"kind": "gnss", "use_velocity": False}},
            "recorder": {"kind": "full"},
        }
    )


def correlations(covariance):
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return covariance / (sd[:, :, None] * sd[:, None, :])


@pytest.mark.slow
def test_a_day_of_free_running_with_rare_fixes_is_the_same_by_every_form():
    runs = {form: a_day(form) for form in ("joseph", "ud", "wd")}
    source, one = runs["joseph"]
    marks = one.sd.index.to_numpy()
    fixes = [t for t in source.tables["gps"].index if marks[0] < t < marks[-1]]
    assert len(fixes) >= 3
    for t in fixes:
        before, after = np.searchsorted(marks, t - 1e-3) - 1, np.searchsorted(marks, t + 1e-7) - 1
        plane = np.hypot(one.sd["north"], one.sd["east"]).to_numpy()
        # Hundreds of metres, and a fix of a metre an axis.
        assert plane[before] > 100.0
        assert plane[after] < 1.5
    truth = source.truth.loc[one.trajectory.index]
    off = state_errors(one.trajectory, truth)
    k = np.searchsorted(marks, one.trajectory.index.to_numpy() - 1e-6).clip(0, len(marks) - 1)
    sd = np.sqrt(np.diagonal(one.covariance, axis1=1, axis2=2))
    sd = np.maximum(sd[k], sd[np.maximum(k - 1, 0)])
    assert (np.abs(off[:, [0, 1, 3, 4, 6, 7, 8]]) < 5.0 * sd[:, [0, 1, 3, 4, 6, 7, 8]]).all()
    # A product of n terms is rounded by n eps of its size, and the least known direction by
    # the condition of the correlations more: over all steps of the day at most
    condition = max(np.linalg.cond(R) for R in correlations(one.covariance))
    most = DAY / STEP * STATES * EPS * condition
    print(f"condition {condition:.3g}, limit {most:.3g}")
    assert most < 0.01
    for form, (_, other) in runs.items():
        assert np.linalg.eigvalsh(correlations(other.covariance)).min() > 0.0, form
        sd = np.sqrt(np.diagonal(one.covariance, axis1=1, axis2=2))
        apart = (other.covariance - one.covariance) / (sd[:, :, None] * sd[:, None, :])
        moved = state_errors(other.trajectory, one.trajectory)
        size = np.sqrt(np.diagonal(one.covariance, axis1=1, axis2=2)).max(axis=0)
        print(form, np.abs(apart).max(), np.abs(moved / size).max())
        assert np.abs(apart).max() < most, form
        assert np.abs(moved / size).max() < most, form


#: Of the flight: speed, m/s; nearest to the pole, deg of latitude; outage there, s.
SPEED, NORTHERNMOST, OUTAGE = 250.0, 88.0, (3250.0, 3850.0)


def a_flight(mechanization):
    """Two hours over the Arctic, past the pole at a distance of two degrees."""
    # A great circle, by the angle from its northernmost point, in steps of half a degree.
    along, top = np.radians(np.linspace(-8.0, 8.0, 33)), np.radians(NORTHERNMOST)
    x, y, z = np.cos(along) * np.cos(top), np.sin(along), np.cos(along) * np.sin(top)
    points = [
        {"lat_deg": float(lat), "lon_deg": float(lon), "alt_m": 9000.0}
        for lat, lon in zip(np.degrees(np.arcsin(z)), np.degrees(np.arctan2(y, x)), strict=True)
    ]
    motion = {"kind": "waypoints", "speed_m_per_s": SPEED, "waypoints": points}
    simulation = {
        "rate_hz": 10.0,
        "seed": 5,
        "sampling": "mean",
        "motion": motion,
        "gnss": {
            "gps": {
                "rate_hz": 0.1,
                "position_noise_m": 3.0,
                "velocity_noise_m_per_s": 0.1,
                "outages_s": [list(OUTAGE)],
            }
        },
    }
    first = NavigationSpec.checked({"simulation": simulation, **_by(mechanization, points[0])})
    truth = read_navigation_source(first).truth.iloc[0]
    start = {f"{a}_deg": float(truth[a]) for a in ("lat", "lon", "roll", "pitch", "heading")}
    start["v_ned_m_per_s"] = [float(v) for v in truth[["VN", "VE", "VD"]]]
    return record_of({"simulation": simulation, **_by(mechanization, start)})


def _by(mechanization, start):
    return {
        "sensors": {"sensor": "fog-1000", "states": ["gyro_bias", "accel_bias"]},
        "start": {
            "alt_m": 9000.0,
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 0.0,
            **start,
            "position_sd_m": 5.0,
            "velocity_sd_m_per_s": 0.2,
            "tilt_sd_deg": 0.05,
            "heading_sd_deg": 0.3,
        },
        "mechanization": {"kind": mechanization},
        "filter": {"kind": "error_state", "step_s": 0.5},
        "aiding": {"gps": {"kind": "gnss"}},
        "recorder": {"kind": "interval", "rate_hz": 1.0},
    }


@pytest.mark.slow
def test_past_the_pole_north_east_down_and_wander_azimuth_are_one_filter():
    (source, ned), (_, wander) = a_flight("ned"), a_flight("wander_azimuth")
    lat = ned.trajectory["lat"]
    assert lat.max() == pytest.approx(NORTHERNMOST, abs=0.01)
    # The meridian turns by most of half a turn in it: north is no direction to hold.
    assert np.ptp(np.unwrap(ned.trajectory["lon"].to_numpy(), period=360.0)) > 150.0
    time = ned.trajectory.index.to_numpy()
    marks = ned.sd.index.to_numpy()
    k = np.searchsorted(marks, time - 1e-6).clip(0, len(marks) - 1)
    sd = np.sqrt(np.diagonal(ned.covariance, axis1=1, axis2=2))
    sd = np.maximum(sd[k], sd[np.maximum(k - 1, 0)])
    truth = source.truth.loc[time]
    for record in (ned, wander):
        assert np.array_equal(record.trajectory.index, time)
        assert (np.abs(state_errors(record.trajectory, truth)) < 5.0 * sd).all()
    apart = np.abs(state_errors(wander.trajectory, ned.trajectory) / sd).max(axis=0)
    print(apart, sd.max(axis=0), len(marks), len(wander.sd))
    # Both are linear in the same nine errors: products of two errors are left, of an error of
    # five standard deviations and a rotation of as many.
    rotation = 5.0 * np.radians(0.3)
    assert (apart < 5.0 * rotation).all()
    np.testing.assert_allclose(wander.sd.to_numpy()[-1], ned.sd.to_numpy()[-1], rtol=rotation)
