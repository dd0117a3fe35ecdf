"""What is wrong with fixes is wrong with the place and velocity that were made of them."""

import numpy as np
import pandas as pd
import pytest

from strapdown import rotation
from strapdown.ellipsoids import WGS84
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import ERROR_MODELS
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.navigation.handover import (
    _added,
    _with_sensors,
    errors_by_antenna,
    from_state,
    here_by_fix,
)
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.navigator import with_states
from strapdown.tables import GNSS

HERE = np.array([50.0, 10.0, 500.0])
ARM, SPEED, TURN = (
    np.array([2.0, -0.5, -1.0]),
    np.array([12.0, 5.0, -0.4]),
    np.array([0.05, 0.1, 0.4]),
)
AID = Gnss(name="rtk", lever_arm=tuple(ARM), lever_arm_sd=0.1, time_offset_sd=0.05)


def made(mechanization=None):
    model = ERROR_MODELS["rotation_vector"](
        (1e-5,) * 3, (1e-3,) * 3, (gyro_bias(1e-4), accel_bias(0.01))
    )
    filter_ = ErrorFilter(mechanization or NorthEastDown(), model, COVARIANCES["joseph"]())
    return with_states(filter_, (AID,))


def found(q_nb, arm, late=0.0):
    """Place and velocity by a fix whose stamp is early by `late`, so that it is of later."""
    lat, lon, alt = geodetic_from_ned(SPEED * late, HERE).tolist()
    values = [[lat, lon, alt, *SPEED, *(0.02,) * 3, *(0.05,) * 3, 4]]
    fixes = pd.DataFrame(values, index=pd.Index([10.0], name="time"), columns=GNSS)
    fixes.attrs["source"] = "fixes.csv"
    velocity = SPEED - rotation.rotate(q_nb, np.cross(TURN, arm))
    place, _ = here_by_fix(fixes, 10.0, q_nb, arm, WGS84, velocity, np.zeros((3, 3)))
    return [np.degrees(place.lat), np.degrees(place.lon), place.alt], place.v_n


@pytest.mark.parametrize("what", ["attitude", "arm", "time"])
def test_errors_of_others_are_errors_of_the_place(what):
    q_true = rotation.quaternion_from_euler([3.0, -4.0, 130.0])
    wrong = np.array([1e-4, -2e-4, 3e-4])
    filter_ = made()
    J = errors_by_antenna(filter_, "rtk", q_true, ARM, SPEED, TURN)
    x = np.zeros(J.shape[1])
    columns = filter_.model.columns_of
    q_nb, arm, late = q_true, ARM, 0.0
    if what == "attitude":
        x[6:9] = wrong
        q_nb = rotation.compose(rotation.quaternion_from_rotation_vector(wrong), q_true)
    elif what == "arm":
        x[columns["rtk.lever_arm"]] = wrong
        arm = ARM + wrong
    else:
        x[columns["rtk.time_offset"]] = late = 1e-3
    right, v_right = found(q_true, ARM)
    place, v = found(q_nb, arm, late)
    # Linear but for squares of 4e-4 rad and metres of a plane, against errors of 1e-4 m and more.
    np.testing.assert_allclose(J[:3] @ x, ned_from_geodetic(place, right), atol=1e-6)
    np.testing.assert_allclose(J[3:] @ x, v - v_right, atol=1e-6)


@pytest.mark.parametrize("mechanization", [NorthEastDown(), WanderAzimuth()], ids=["ned", "wander"])
def test_the_fix_that_made_a_place_does_not_prove_its_own_instant(mechanization):
    filter_ = made(mechanization)
    q_nb = rotation.quaternion_from_euler([0.0, 0.0, 20.0])
    (lat, lon, alt), v = found(q_nb, ARM)
    start = NavState.from_degrees(lat, lon, alt, v_n=v, heading_deg=20.0, time=10.0)
    P = _with_sensors(filter_, np.diag(np.repeat([0.02, 0.05, 0.03], 3) ** 2))
    J = errors_by_antenna(filter_, "rtk", q_nb, ARM, SPEED, TURN)
    state = filter_.begin(start, _added(P, J))
    whole = filter_.physical_covariance(state)
    at = filter_.model.columns_of["rtk.time_offset"].start
    speed = np.hypot(*SPEED[:2])
    # Speed by the deviation of the offset, and what the fix and the arm add.
    place = np.sqrt(np.trace(whole[:2, :2]))
    assert speed * 0.05 < place < speed * 0.05 + 0.25
    # Place of the antenna less the place of the fix: what is wrong with the offset cancels.
    along = np.zeros(whole.shape[0])
    along[:3] = filter_.mechanization.level_from_ned(state.row) @ (SPEED / np.linalg.norm(SPEED))
    along[at] = -np.linalg.norm(SPEED)
    C = rotation.dcm_from_quaternion(q_nb)
    turned = filter_.mechanization.level_from_ned(state.row)
    along[6:9] = -(along[:3] @ rotation.cross_matrix(turned @ C @ ARM))
    along[filter_.model.columns_of["rtk.lever_arm"]] = along[:3] @ turned @ C
    assert np.sqrt(along @ whole @ along) == pytest.approx(0.02, rel=1e-9)
    # Without the correlations the place seems known as the fix is.
    alone = filter_.physical_covariance(from_state(filter_, start, P[:9, :9]))
    assert np.sqrt(np.trace(alone[:2, :2])) < 0.03
