"""The filters against motions with an exact answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom
from tests.coded import coded
from tests.hand_motions import KINDS, record

import strapdown as sd
from strapdown import rotation
from strapdown._kernels import orientation as kernel
from strapdown.errors import ConfigError, DataError
from strapdown.orientation_filters import make_filter, run_filter, run_for_motion
from strapdown.orientation_filters.cost import count_filter_cost
from strapdown.orientation_filters.filter import euler_sd
from strapdown.tables import ACCEL, MAG, QUATERNION, imu_table

G = kernel.G
FIELD = np.array([20.0, 0.0, 45.0])
START = rotation.quaternion_from_euler([12.0, -25.0, 130.0])
BIAS = np.radians([0.4, -0.3, 0.5])


def resting(seconds=30.0, bias=BIAS, field=FIELD, q=START, rate=100.0):
    time = np.arange(int(seconds * rate)) / rate
    count = len(time)
    back = rotation.conjugate(q)
    force = rotation.rotate(back, [0.0, 0.0, -G])
    imu = imu_table(time, np.tile(bias, (count, 1)), np.tile(force, (count, 1)))
    imu[MAG] = np.array([rotation.rotate(back, f) for f in np.broadcast_to(field, (count, 3))])
    return imu


def error_deg(q, truth):
    """Rotation vectors of the error in north-east-down, deg."""
    e = rotation.compose(q, rotation.conjugate(truth))
    return np.degrees(2.0 * np.sign(e[:, :1]) * e[:, 1:])


def test_a_bias_is_found_while_stationary_and_the_attitude_stays():
    """The rate of a body at rest is its bias: 0.05 deg/s over sqrt(28 s) is 0.01 deg/s."""
    for columns in (MAG, []):
        imu = resting()
        run = run_filter(make_filter("error-state"), imu[[*imu.columns[:6], *columns]])
        assert run.stationary > 0.9
        assert np.abs(run.bias - BIAS).max() < np.radians(0.01)
        assert np.all(run.bias_sd < np.radians(0.02))
        assert np.all(np.abs(run.bias - BIAS) < 3.0 * run.bias_sd)
    # Roll and pitch by the specific force, after what the bias turned before it was known.
    level = rotation.quaternion_from_euler([12.0, -25.0, 0.0])
    assert np.abs(error_deg(run.q_nb, level)[-1, :2]).max() < 0.02


def test_a_slow_turn_is_no_rest():
    """A turntable at 5 deg/s, beyond every bias that is expected, is not taken for a bias."""
    imu = resting(bias=np.zeros(3), q=np.array([1.0, 0.0, 0.0, 0.0]))
    imu["gyro_z"] = np.radians(5.0)
    run = run_filter(make_filter("error-state:bias=0.3"), imu[imu.columns[:6]])
    assert run.stationary == 0.0
    assert abs(rotation.euler_from_quaternion(run.q_nb[-1])[2] - (5.0 * 29.99)) < 0.1


def test_reaching_a_constant_velocity_is_no_tilt():
    """2 m/s² for 1 s: as gravity it would be a tilt of 11.5 deg, averaged over 3 s of 3.4 deg.

    Afterwards the body seems stationary. It stays within the 95 % bound of 0.3 deg x 1.96.
    """
    level = np.array([1.0, 0.0, 0.0, 0.0])
    imu = resting(30.0, bias=np.zeros(3), q=level)
    imu.loc[10.0:11.0, "accel_x"] += 2.0
    run = run_filter(make_filter("error-state"), imu)
    bound = 1.96 * run.euler_sd()[:, :2]
    assert np.all(np.abs(error_deg(run.q_nb, level)[:, :2]) <= bound)
    assert bound[1000:].max() < 0.8


def test_a_declination_turns_the_heading_and_its_covariance():
    imu = resting()
    plain, turned = (
        run_filter(make_filter(f"error-state:declination={d}"), imu) for d in (0.0, 7.0)
    )
    assert np.allclose(
        rotation.euler_from_quaternion(turned.q_nb)[-1]
        - rotation.euler_from_quaternion(plain.q_nb)[-1],
        [0.0, 0.0, 7.0],
        atol=1e-9,
    )
    assert np.allclose(turned.euler_sd(), plain.euler_sd(), rtol=1e-9)
    # Without a magnetometer there is no magnetic heading to correct.
    alone = run_filter(make_filter("error-state:declination=7"), imu[imu.columns[:6]])
    assert abs(rotation.euler_from_quaternion(alone.q_nb[0])[2]) < 1e-9


@pytest.mark.parametrize("push", [(30.0, 0.0, 0.0), (0.0, 0.0, -30.0), (0.0, 40.0, 0.0)])
def test_a_disturbed_field_moves_neither_roll_nor_pitch_and_is_reported(push):
    field = np.tile(FIELD, (6000, 1))
    field[2000:4000] += push
    imu = resting(60.0, field=field)
    clean = run_filter(make_filter("error-state"), resting(60.0))
    run = run_filter(make_filter("error-state"), imu)
    # 20 s of 60 s; it begins at once, and ends within the memory of the disturbance.
    assert 0.3 < run.disturbed < 0.5
    assert clean.disturbed == 0.0
    apart = error_deg(run.q_nb, clean.q_nb)
    assert np.abs(apart[:, :2]).max() < 0.05
    wrong = np.degrees(np.arctan2(FIELD[1] + push[1], FIELD[0] + push[0]))
    assert np.abs(apart[:, 2]).max() < max(0.2 * abs(wrong), 0.5)
    table = sd.attitude(imu, algorithm="error-state")
    (finding,) = [f for f in table.findings if f.code == "attitude.field-disturbed"]
    assert finding.data["share"] == run.disturbed


def test_a_gap_widens_the_bounds_and_the_next_samples_level_and_head_anew():
    imu = resting(40.0)
    q = rotation.quaternion_from_euler([-60.0, 10.0, 20.0])
    after = resting(40.0, q=q)
    joined = imu.copy()
    joined.iloc[2000:] = after.iloc[2000:]
    joined.index = np.where(np.arange(4000) < 2000, joined.index, joined.index + 20.0)
    joined = joined.rename_axis("time")
    for columns in (ACCEL, ACCEL + MAG):
        run = run_filter(make_filter("error-state"), joined[[*joined.columns[:3], *columns]])
        spread = run.euler_sd()
        assert run.gaps == 1
        # What it was turned in the gap is not known: leveled by one sample, 0.1 rad.
        assert spread[2001, 0] > 5.0
        roll, pitch, heading = rotation.euler_from_quaternion(run.q_nb[2000])
        assert np.allclose([roll, pitch], [-60.0, 10.0], atol=1e-2)
        if columns == ACCEL:
            assert spread[2001, 2] > 90.0
        else:
            # Turned by a bias of 0.8 deg/s, less what is known of it, over one step of 10 ms.
            assert abs(heading - 20.0) < 1e-2
            assert spread[2001, 2] < 30.0


def test_a_short_gap_is_not_integrated_as_if_nothing_had_happened():
    """0.5 s at 1 rad/s: the attitude is held, and its bound includes the turn."""
    time = np.r_[np.arange(200) * 0.01, 2.49 + np.arange(100) * 0.01]
    gyro = np.tile([0.0, 0.0, 1.0], (300, 1))
    imu = imu_table(time, gyro, np.tile([0.0, 0.0, -G], (300, 1)))
    run = run_filter(make_filter("error-state"), imu)
    before, after = rotation.euler_from_quaternion(run.q_nb[199:201])[:, 2]
    assert abs(after - before - np.degrees(0.01)) < 0.01
    assert 1.96 * run.euler_sd()[200, 2] > np.degrees(0.5)


def test_standard_deviations_of_angles_by_sampling():
    """To first order, against 20,000 drawn errors: 3 % is six standard errors of a spread."""
    rng = np.random.default_rng(4)
    root = rng.normal(0.0, 0.004, (3, 3))
    errors = rng.normal(size=(20_000, 3)) @ root.T
    turned = rotation.compose(rotation.quaternion_from_rotation_vector(errors), START)
    spread = rotation.euler_from_quaternion(turned).std(axis=0)
    assert np.allclose(euler_sd(START[None], (root @ root.T)[None])[0], spread, rtol=0.03)


def test_front_door():
    imu = resting(5.0)
    time, gyro = imu.index.to_numpy(), imu.iloc[:, :3].to_numpy()
    force, field = imu[ACCEL].to_numpy(), imu[MAG].to_numpy()
    table = sd.attitude(time, gyro, force, field, algorithm="error-state")
    run = run_filter(make_filter("error-state"), imu)
    assert np.array_equal(table[QUATERNION], run.q_nb)
    assert np.array_equal(table[["roll_sd", "pitch_sd", "heading_sd"]], run.euler_sd())
    assert np.allclose(table.rotation.as_matrix()[-1] @ force[-1], [0.0, 0.0, -G], atol=0.1)
    assert np.array_equal(sd.attitude(imu, algorithm="error-state"), table)
    assert "roll_sd" not in sd.attitude(imu, algorithm="complementary")
    device = sd.OrientationFilter(100.0, "error-state")
    for row in zip(gyro, force, field, strict=True):
        device.update(*row)
    assert np.array_equal(device.quaternion, run.q_nb[-1])
    assert np.allclose(device.roll_pitch_heading_sd, run.euler_sd()[-1], rtol=1e-12)
    assert sd.OrientationFilter(100.0).roll_pitch_heading_sd is None
    # Known biases: what remains is none.
    known = sd.attitude(imu, algorithm="error-state", gyro_bias=BIAS)
    assert np.abs(error_deg(known[QUATERNION].to_numpy(), START)).max() < 1e-6
    force = force.copy()
    force[3] = np.nan
    assert len(sd.attitude(time, gyro, force, algorithm="complementary")) == len(time)
    started = sd.attitude(time, gyro, force, algorithm="error-state", initial=(0.0, 0.0, 90.0))
    assert started.attrs["initial"] == "given"


def test_front_door_refuses():
    imu = resting(1.0)
    time, gyro, field = imu.index.to_numpy(), imu.iloc[:, :3].to_numpy(), imu[MAG].to_numpy()
    with pytest.raises(DataError, check=coded("attitude.filter-needs-accelerometer")):
        sd.attitude(time, gyro, algorithm="error-state")
    with pytest.raises(ConfigError, check=coded("api.magnetometer-needs-filter")):
        sd.attitude(time, gyro, mag=field)
    with pytest.raises(ConfigError, check=coded("api.magnetometer-needs-filter")):
        sd.OrientationFilter(50.0).update(gyro[0], [0.0, 0.0, -G], field[0])
    with pytest.raises(ConfigError, check=coded("attitude.filter-takes-linear")):
        sd.attitude(imu, algorithm="error-state", interpolation="cubic")
    with pytest.raises(ConfigError, check=coded("api.filter-levels-itself")):
        sd.attitude(imu, algorithm="error-state", initial="north")
    with pytest.raises(ConfigError, check=coded("attitude.no-attitude-algorithm")) as caught:
        sd.attitude(imu, algorithm="error-stat")
    assert "error-state" in caught.value.finding.data["known"]
    with pytest.raises(DataError, check=coded("tables.arrays-different-lengths")):
        sd.attitude(time, gyro, gyro[:-1], algorithm="error-state")


def test_cost_by_counting():
    """What is counted is the kernel: blocks cost by time, the cheap filter by sample."""
    cheap = [count_filter_cost(make_filter("complementary"), dt, True) for dt in (0.005, 0.05)]
    assert vars(cheap[0]) == vars(cheap[1])
    # The two quaternion rotations of gravity and field, and the turn: by hand 4 divisions (three
    # time constants and the sine) and a root, without a field 2 divisions and none.
    assert (cheap[0].divide, cheap[0].sqrt, cheap[0].trig) == (4.0, 1.0, 0.0)
    without = count_filter_cost(make_filter("complementary"), 0.005, False)
    assert (without.divide, without.sqrt) == (2.0, 0.0)
    assert cheap[0].memory == kernel.COMPLEMENTARY
    chosen = make_filter("error-state")
    slow, fast = (count_filter_cost(chosen, dt, True) for dt in (0.02, 0.005))
    assert slow.multiply > fast.multiply > 60.0
    # A block of 0.08 s has 4 or 16 samples: its B products are B/4 and B/16 of a sample.
    each = (slow.multiply - fast.multiply) / (1 / 4 - 1 / 16)
    assert 500.0 < each < 1500.0


def coverage(kind, count, chosen="error-state", disturbed=False):
    """Shares of the time within the 95 % bounds after 5 s, (count, 3): north, east, down."""
    shares, spread, errors = [], [], []
    for seed in range(count):
        made = record(kind, seed, disturbed=disturbed)
        _, run = run_for_motion(make_filter(chosen), made.imu)
        error = np.radians(error_deg(run.q_nb, made.q_nb))[500:]
        sd_rad = np.sqrt(np.diagonal(run.covariance, axis1=1, axis2=2))[500:]
        shares.append((np.abs(error) < 1.96 * sd_rad).mean(axis=0))
        spread.append((sd_rad**2).mean(axis=0))
        errors.append((error**2).mean(axis=0))
    return np.array(shares), np.sqrt(np.mean(spread, axis=0)), np.sqrt(np.mean(errors, axis=0))


#: Independent instants of a motion of 85 s: errors are correlated over 10 s.
INSTANTS = 8


def at_least_95(shares):
    """Whether a mean share is, by a one-sided test at 99 %, not under 0.95."""
    trials = INSTANTS * len(shares)
    return bool(np.all(shares.mean(axis=0) >= binom.ppf(0.01, trials, 0.95) / trials))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "chosen"),
    [(kind, "error-state") for kind in (*KINDS, "drive")],
)
def test_the_stated_bounds_hold(kind, chosen):
    """95 % or more of the time, and not by bounds that say nothing.

    Motions differ among each other in acceleration by a factor of ten, and the bounds include the
    strongest of them; so that bounds of a class may be up to six times its errors.
    """
    shares, spread, errors = coverage(kind, 24, chosen)
    assert at_least_95(shares), shares.mean(axis=0)
    assert np.all(spread < 6.0 * errors)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_roll_and_pitch_hold_in_a_disturbed_field(kind):
    shares, _, _ = coverage(kind, 16, disturbed=True)
    assert at_least_95(shares[:, :2]), shares.mean(axis=0)
    # The heading's own: nothing but norm and dip shows a disturbance that begins with the log.
    assert shares[:, 2].mean() > 0.8
