"""Each filter of each library on motions whose attitude is known exactly.

A wrong axis, sign or side of the product would show as degrees or tens of them: the bodies turn
through 100 deg from an attitude that no permutation of axes leaves alone.
"""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import StrapdownError
from strapdown.peers import PEERS, align_heading
from strapdown.tables import EULER, MAG, QUATERNION, imu_table

START = rotation.quaternion_from_euler([20.0, -35.0, 130.0])
RATE = 0.6  # rad/s
DIP, DECLINATION = 62.0, 5.0


def cases(*aidings):
    return [
        pytest.param(
            peer,
            name,
            aiding,
            marks=() if peer.available else pytest.mark.skip(f"{peer.name} is not installed"),
            id=f"{peer.name}-{name}-{aiding}",
        )
        for peer in PEERS.values()
        for name, one in peer.filters.items()
        for aiding in one.compute
        if aiding in aidings
    ]


def record(q_nb, rate_b, step, declination=0.0):
    """Error-free samples along attitudes (n, 4), in a uniform field and without motion."""
    q_bn = rotation.conjugate(q_nb)
    imu = imu_table(
        np.arange(len(q_nb)) * step,
        np.broadcast_to(rate_b, (len(q_nb), 3)),
        rotation.rotate(q_bn, [0.0, 0.0, -9.80665]),
    )
    dip, east = np.radians([DIP, declination])
    field = 48.0 * np.array([np.cos(dip) * np.cos(east), np.cos(dip) * np.sin(east), np.sin(dip)])
    imu[MAG] = rotation.rotate(q_bn, field)
    return imu


def turning(axis, sign, seconds=3.0, step=0.005):
    rate = np.zeros(3)
    rate["xyz".index(axis)] = sign * RATE
    time = np.arange(round(seconds / step) + 1) * step
    truth = rotation.compose(START, rotation.quaternion_from_rotation_vector(time[:, None] * rate))
    return record(truth, rate, step), truth


def angles(table, truth):
    return rotation.rotation_angle(table[QUATERNION].to_numpy(), truth)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro"))
def test_the_gyro_alone_turns_about_each_axis(peer, name, aiding, axis, sign):
    imu, truth = turning(axis, sign)
    found = peer.run(imu, START, aiding, name)
    assert found.index.equals(imu.index)
    assert found[QUATERNION].iloc[0].to_numpy() == pytest.approx(START, abs=1e-15)
    steps, angle = len(imu) - 1, RATE * 0.005
    exact = steps * 4e-16  # a product of quaternions rounds by that
    first_order = steps * angle**3 / 12.0  # 2 atan(a/2) instead of a
    single = steps * 2.0**-23  # rounding of float32, all one way
    allowed = {"vqf": exact, "closed": exact, "series": first_order + exact}
    limit = allowed.get(name, first_order + single)
    # twice: rounding of the angle itself, and of the truth
    assert angles(found, truth).max() < np.degrees(2.0 * limit)


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro+accel", "gyro+accel+mag"))
def test_what_agrees_with_gravity_and_field_is_left_alone(peer, name, aiding, axis, sign):
    imu, truth = turning(axis, sign)
    found = peer.run(imu, START, aiding, name)
    # Madgwick's, Mahony's and imufusion compare the attitude before the step with gravity and
    # field after it. However strong the feedback, that leads them by one step at most, and
    # Madgwick's goes to and fro by a fifth of it: 0.041 rad/s against RATE, twice, and less.
    assert angles(found, truth).max() < np.degrees(1.2 * RATE * 0.005)


@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro+accel", "gyro+accel+mag"))
def test_that_lead_is_the_step_and_no_convention(peer, name, aiding):
    largest = []
    for step in (0.01, 0.005):
        imu, truth = turning("x", 1, step=step)
        largest.append(angles(peer.run(imu, START, aiding, name), truth).max())
    # Proportional to the step, or of a higher order; a wrong convention stays.
    assert largest[1] < 0.6 * largest[0]


@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro+accel"))
def test_a_wrong_tilt_is_corrected_and_the_heading_kept(peer, name, aiding):
    q = rotation.quaternion_from_euler([25.0, -38.0, 130.0])
    # Not at zero, where Madgwick's and Mahony's do nothing: 2e-4 rad/min.
    imu = record(np.tile(q, (3000, 1)), [0.0, 0.0, 1e-6 * 3], 0.02)
    last = peer.run(imu, START, aiding, name)[EULER].iloc[-1].to_numpy()
    # 60 s are more than 10 time constants of each; what is left is Madgwick's to and fro,
    # 2 x 0.033 rad/s x 20 ms = 0.08 deg.
    assert last[:2] == pytest.approx([25.0, -38.0], abs=0.15)
    # The turn that corrects the tilt is about a level axis up to its second order,
    # (5 deg)^2 / 2 = 0.2 deg; roll and pitch change along it, and heading by the sine of the pitch
    # times the roll, 5 deg x sin 38 deg = 3.1 deg.
    assert abs(last[2] - 130.0) < 3.1 + 0.2 + 0.3


@pytest.mark.slow
@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro+accel+mag"))
@pytest.mark.parametrize("euler", [(0.0, 0.0, 0.0), (20.0, -35.0, 130.0), (-60.0, 15.0, 285.0)])
def test_the_heading_of_a_magnetometer_is_magnetic(peer, name, aiding, euler):
    q = rotation.quaternion_from_euler(euler)
    imu = record(np.tile(q, (3000, 1)), [0.0, 0.0, 1e-6 * 3], 0.02, DECLINATION)
    start = rotation.compose(rotation.quaternion_from_euler([0.0, 0.0, 3.0]), q)
    last = peer.run(imu, start, aiding, name)[QUATERNION].iloc[-1].to_numpy()
    magnetic = rotation.quaternion_from_euler([euler[0], euler[1], euler[2] - DECLINATION])
    # The heading begins 8 deg off. Madgwick's to and fro is 2 x 0.041 rad/s x 20 ms = 0.1 deg,
    # and in heading more, by 1 / cos(dip)= 2.1; to the true heading it would be 5 deg.
    assert float(rotation.rotation_angle(last, magnetic)) < 0.5


def test_vqf_starts_level_with_the_heading_of_the_start():
    peer = PEERS["vqf"]
    if not peer.available:
        pytest.skip("vqf is not installed")
    imu, _ = turning("x", 1)
    wrong = rotation.compose(START, rotation.quaternion_from_euler([2.0, 0.0, 0.0]))
    first = peer.run(imu, wrong, "gyro+accel")[QUATERNION].iloc[0].to_numpy()
    down = rotation.rotate(rotation.conjugate(first), [0.0, 0.0, 1.0])
    known = rotation.rotate(rotation.conjugate(START), [0.0, 0.0, 1.0])
    # One sample turns it by RATE times a step before it is levelled with the same sample.
    assert down == pytest.approx(known, abs=1e-12)
    twist = rotation.compose(wrong, rotation.conjugate(first))
    assert twist[3] == pytest.approx(0.0, abs=1e-12)


def test_aligning_takes_a_turn_about_the_vertical_away_and_nothing_else():
    q = rotation.quaternion_from_euler([[10.0, 80.0, 30.0], [-170.0, 5.0, 200.0]])
    turned = rotation.compose(rotation.quaternion_from_euler([0.0, 0.0, 77.0]), q)
    for row in (0, 1):
        back = align_heading(turned, q[row], row)
        assert rotation.rotation_angle(back, q) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("peer", "name", "aiding"), cases("gyro", "gyro+accel", "gyro+accel+mag"))
def test_uneven_steps_are_taken_as_they_are_or_as_their_mean(peer, name, aiding):
    step = np.where(np.arange(600) % 2, 0.004, 0.006)
    time = np.concatenate([[0.0], np.cumsum(step)])
    rate = np.array([0.0, 0.0, RATE])
    truth = rotation.compose(START, rotation.quaternion_from_rotation_vector(time[:, None] * rate))
    even = record(truth, rate, 0.005)
    imu = even.set_axis(time)
    imu.attrs = even.attrs
    found = angles(peer.run(imu, START, aiding, name), truth)
    # Of the mean, every other stamp is 1 ms away, and the last is right again.
    off = np.degrees(RATE * 1e-3) if peer.filters[name].steady else 0.0
    # The feedback leads by the longest step, as on even steps.
    lead = np.degrees(1.2 * RATE * 0.006) if aiding != "gyro" else 0.001
    assert found.max() < off + lead
    if peer.filters[name].steady and aiding == "gyro":
        assert found.max() == pytest.approx(off, rel=1e-6)
        assert found[-1] < 1e-9


def test_an_error_of_a_library_is_a_message():
    peer = PEERS["ahrs"]
    if not peer.available:
        pytest.skip("ahrs is not installed")
    imu, _ = turning("x", 1)
    imu[MAG] = 0.0
    with pytest.raises(
        StrapdownError, check=coded("peers.gave-up", quantity="ahrs 0.4.0 ekf, gyro+accel+mag")
    ):
        peer.run(imu, START, "gyro+accel+mag", "ekf")
