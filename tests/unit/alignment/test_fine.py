"""Fine alignment of a body at rest: what it finds, what it cannot, and what it says."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from resting import SITE, UNCERTAINTY, resting, roughly

from strapdown import rotation
from strapdown.alignment.fine import FINE_COLUMNS, FineAlignment
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_model import ERROR_MODELS, QuaternionModel
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.prefilter import PREFILTERS
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.tables import ACCEL, GYRO

DEG_PER_HOUR = np.radians(1.0) / 3600.0


@pytest.fixture(scope="module")
def rest():
    return resting(7, 200.0)


@pytest.fixture(scope="module")
def found(rest):
    return FineAlignment().align(rest.imu, SITE, UNCERTAINTY, roughly(rest))


def error_of(found, rest):
    """Attitude in north-east-down, rad: at rest it is the same at every instant."""
    return rotation.rotation_vector_from_quaternion(
        rotation.compose(found.q_nb, rotation.conjugate(rest.q_nb))
    )


def test_what_is_found_is_within_its_bounds(rest, found):
    # One draw: each of nine errors within 3.5 standard deviations, of which one in 240 is not.
    sd = np.sqrt(np.diagonal(found.alignment.covariance))
    assert np.all(np.abs(error_of(found.alignment, rest)) < 3.5 * sd)
    assert np.all(
        np.abs(found.alignment.gyro_bias - rest.gyro_bias) < 3.5 * found.alignment.gyro_bias_sd
    )
    assert np.all(
        np.abs(found.alignment.accel_bias - rest.accel_bias) < 3.5 * found.alignment.accel_bias_sd
    )


def test_the_bounds_are_those_that_physics_allows(found):
    # A tilt is a horizontal bias over g, the heading an east drift over the Earth's horizontal
    # rate. Both with what the gyros' noise leaves (ARW, 0.001 deg/sqrt h: over 200 s it is
    # 0.0042 deg/h) within a tenth.
    accel = np.hypot(*UNCERTAINTY.accel.axis("bias")[:1], UNCERTAINTY.accel_drift.triad[0])
    accel = np.hypot(accel, 9.81 * np.hypot(0.05e-3, 5e-6))
    tilt = np.degrees(accel / 9.81)
    np.testing.assert_allclose(found.alignment.sd_deg[:2], tilt, rtol=0.05)
    east = np.hypot(0.01, 0.003) * DEG_PER_HOUR
    noise = np.radians(0.001 / 60.0) / np.sqrt(200.0)
    horizontal = 7.292115e-5 * np.cos(np.radians(55.0))
    np.testing.assert_allclose(
        found.alignment.sd_deg[2], np.degrees(np.hypot(east, noise) / horizontal), rtol=0.1
    )


def test_what_rests_cannot_tell_keeps_its_uncertainty(rest, found):
    """Horizontal biases and the east drift: as unknown as they were; the vertical ones are seen."""
    first, last = found.history.iloc[0], found.history.iloc[-1]
    kept = last / first
    assert kept["accel_bias_x_sd"] > 0.95
    assert kept["accel_bias_y_sd"] > 0.95
    assert kept["accel_bias_z_sd"] < 0.15
    assert kept["gyro_bias_z_sd"] < 0.7


@pytest.mark.slow
def test_every_mechanization_model_and_form_finds_the_same(rest, found):
    wanted = found.alignment
    for mechanization, model, form in itertools.product(
        (NorthEastDown(), WanderAzimuth()), ERROR_MODELS.values(), COVARIANCES.values()
    ):
        if model is QuaternionModel and mechanization.name == "ned":
            continue
        other = FineAlignment(mechanization, model, form()).align(
            rest.imu, SITE, UNCERTAINTY, roughly(rest)
        )
        # Level axes of another azimuth, and states that are linear in something else: the second
        # order of a heading that is off by 0.5 deg at the start, 1e-4 of it.
        apart = np.abs(
            rotation.rotation_vector_from_quaternion(
                rotation.compose(other.alignment.q_nb, rotation.conjugate(wanted.q_nb))
            )
        )
        sd = np.sqrt(np.diagonal(wanted.covariance))
        assert np.all(apart < 0.01 * sd), (mechanization.name, model.name, form.name)
        np.testing.assert_allclose(other.alignment.sd_deg, wanted.sd_deg, rtol=2e-3)
        np.testing.assert_allclose(other.alignment.accel_bias_sd, wanted.accel_bias_sd, rtol=1e-2)


def test_the_attitude_at_the_start(rest, found):
    sd = np.sqrt(np.diagonal(found.at_start.covariance))
    assert found.at_start.time == pytest.approx(rest.imu.index[0], abs=1.0 / 50.0)
    assert np.all(np.abs(error_of(found.at_start, rest)) < 3.5 * sd)


def test_a_coarse_attitude_at_the_end_is_carried_back(rest, found):
    other = FineAlignment().align(rest.imu, SITE, UNCERTAINTY, roughly(rest, at="end"))
    sd = np.sqrt(np.diagonal(found.alignment.covariance))
    apart = error_of(other.alignment, rest) - error_of(found.alignment, rest)
    # 200 s of gyros move the start by 1e-5 rad, of an attitude that is forgotten in the end.
    assert np.all(np.abs(apart) < 0.02 * sd)


def test_a_heading_that_is_off_by_degrees_is_pulled_in(rest, found):
    far = FineAlignment().align(rest.imu, SITE, UNCERTAINTY, roughly(rest, heading_off_deg=8.0))
    apart = error_of(far.alignment, rest) - error_of(found.alignment, rest)
    # What is left of it: its prior, 20 deg, is forgotten as (sd/20 deg)², and the second order of
    # 8 deg, 1 %, is met by feeding back from epoch to epoch.
    assert abs(apart[2]) < 0.2 * np.sqrt(found.alignment.covariance[2, 2])


def test_history_and_innovations_are_tables(found):
    assert list(found.history.columns) == list(FINE_COLUMNS)
    assert found.history.index.name == "time"
    assert len(found.history) == 201
    assert np.all(np.isfinite(found.history.to_numpy()))
    assert set(found.innovations) == {"rate", "position", "velocity"}
    assert list(found.innovations["velocity"].columns)[:3] == [
        "nu x, m/s",
        "nu y, m/s",
        "nu z, m/s",
    ]
    assert not found.findings


def test_a_dead_gyro_is_named(rest):
    dead = rest.imu.copy()
    dead.attrs = dict(rest.imu.attrs)
    dead[GYRO[2]] = 0.0
    result = FineAlignment().align(dead, SITE, UNCERTAINTY, roughly(rest))
    named = [f for f in result.findings if f.quantity == "gyro_z"]
    assert len(named) == 1
    assert named[0].code == "alignment.bias-beyond-data-sheet"


def test_gyros_that_cannot_find_north_say_so(rest):
    poor = ImuUncertainty(
        TriadUncertainty(noise_density=1e-4, bias=np.radians(30.0) / 3600.0), UNCERTAINTY.accel
    )
    result = FineAlignment().align(rest.imu, SITE, poor, roughly(rest))
    # As unknown as it was: ten times what the coarse attitude claimed.
    assert result.alignment.sd_deg[2] > 0.9 * result.prior_heading_sd_deg
    assert any("heading standard deviation is" in f.what for f in result.findings)


def test_a_body_that_is_pushed_about_is_found_out(rest):
    pushed = rest.imu.copy()
    pushed.attrs = dict(rest.imu.attrs)
    t = pushed.index.to_numpy()
    pushed[ACCEL[0]] += 0.5 * np.sin(1.31 * t)
    result = FineAlignment().align(pushed, SITE, UNCERTAINTY, roughly(rest))
    assert any("is not stationary" in f.what for f in result.findings)
    sd = np.sqrt(np.diagonal(result.alignment.covariance))
    assert np.all(np.abs(error_of(result.alignment, rest)) < 4.0 * sd)


def test_what_cannot_be_done_is_refused(rest):
    with pytest.raises(DataError, check=coded("alignment.too-few-epochs", interval=1.0)):
        FineAlignment().align(rest.imu.iloc[:300], SITE, UNCERTAINTY, roughly(rest))
    middle = roughly(rest)
    middle = type(middle)(middle.method, 100.0, middle.q_nb, middle.covariance)
    with pytest.raises(
        DataError,
        check=coded(
            "alignment.coarse-alignment-at-other-instant", quantity="time", time=100.0, begin=0.0
        ),
    ):
        FineAlignment().align(rest.imu, SITE, UNCERTAINTY, middle)
    for options, word in (
        ({"interval": 0.0}, "interval"),
        ({"interval": 61.0}, "interval"),
        ({"observe": ("speed",)}, "speed"),
        ({"observe": ()}, "nothing"),
        ({"mechanization": NorthEastDown(height="damped")}, "damped"),
    ):
        with pytest.raises(ConfigError, match=word):
            FineAlignment(**options)


@pytest.mark.parametrize("name", ["robust_fir", "summed"])
def test_increments_of_a_prefilter_are_taken(rest, found, name):
    filtered = PREFILTERS[name](rate=10.0).apply(rest.imu)
    first = roughly(rest)
    begin = type(first)(first.method, float(filtered.imu.index[0]), first.q_nb, first.covariance)
    other = FineAlignment().align(
        filtered.imu, SITE, UNCERTAINTY, begin, increments=filtered.increments
    )
    apart = error_of(other.alignment, rest) - error_of(found.alignment, rest)
    # The same noise, but for what a low-pass leaves off at the ends of 200 s: a tenth of it.
    sd = np.sqrt(np.diagonal(found.alignment.covariance))
    assert np.all(np.abs(apart) < 0.2 * sd)
    assert len(filtered.increments) < 0.25 * len(rest.imu)
    with pytest.raises(DataError, check=coded("alignment.increments-outside-record")):
        late = filtered.increments.copy()
        late.index = late.index + 1e4
        FineAlignment().align(filtered.imu, SITE, UNCERTAINTY, begin, increments=late)
