"""Real recordings with known answers; their provenance stands beside them, in their README.

The recordings come from STRAPDOWN_DATA; without them these tests skip. The numbers that are
asserted are those of the recording's own documentation, or follow from its physics; none was
taken from a result of this code.
"""

from __future__ import annotations

from functools import cache

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strapdown import read_log, rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.evaluation.differences import error_angles
from strapdown.increments import increments_from_imu
from strapdown.tables import ACCEL, GYRO, QUATERNION, imu_table
from strapdown.tables.sample_clock import sample_clock

TURNS = {
    # Axis of the board turned about in body axes, and the integral that the recording's notes
    # give for it once the bias is removed, deg. Forward is -x of the board, right is +y.
    "rotate-360ccw-around-x-pointing-forward": ("forward", 720.6),
    "rotate-360ccw-around-y-pointing-left": ("right", 721.9),
    "rotate-360ccw-around-z-pointing-up": ("up", 721.5),
}
# Row of `gyroBuffer` in the file, sign.
ROWS = {"forward": (1, -1.0), "right": (2, 1.0), "up": (3, 1.0)}


# "Bias about (4.54, 0.11, 1.07) deg/s" about the board's axes, and what that is about the axis
# turned about. Over the four unmoved logs the mean rate about z runs from 1.02 to 1.12 deg/s.
BIAS = {"forward": -4.54, "right": 0.11, "up": 1.07}
KNOWN_TO = 0.1  # deg/s


def rates_of_file(path, axis):
    """Rates about an axis, deg/s, as they are in the file."""
    row, sign = ROWS[axis]
    with h5py.File(path / "mpu6050_gyroscope.mat") as file:
        return sign * file["gyroBuffer"][row]


@pytest.mark.parametrize("name", TURNS)
def test_two_turns_as_the_notes_integrate_them(recordings, name):
    """The notes take the stamps of arrival for those of the samples: trapezoids over them."""
    axis, integral = TURNS[name]
    imu = read_log(recordings("mpu6050_turns") / name).imu
    column, sign = {"forward": (0, 1.0), "right": (1, 1.0), "up": (2, -1.0)}[axis]
    turned = np.degrees(np.trapezoid(sign * imu[GYRO[column]], imu.index))
    length = imu.index[-1] - imu.index[0]
    # The notes' integral is printed to a tenth of a degree.
    assert turned - BIAS[axis] * length == pytest.approx(integral, abs=KNOWN_TO * length + 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("name", TURNS)
@pytest.mark.parametrize("bias", ["none", "stated", "recorded"])
def test_two_turns_by_hand(recordings, name, bias):
    """The integral on the sensor's clock, which gravity prefers to the stamps (below).

    At the start the program that recorded was held up for 0.3 s, and then read what had been
    sampled before: by stamps of arrival the turns about x are 7 deg smaller.
    """
    axis, _ = TURNS[name]
    folder = recordings("mpu6050_turns")
    gyro_bias = {
        "none": "none",
        "stated": "-4.54,0.11,-1.07 deg/s",
        "recorded": str(folder / "unmoved-10min"),
    }[bias]
    bench = compare_attitude(
        folder / name, reference=[f"end 2 turns about {axis} since start"], gyro_bias=gyro_bias
    )
    scores = {s.algorithm: s for s in bench.scores}
    score = scores["quaternion"]
    turned = score.turned_deg / score.expected_deg * 720.0  # positive in the sense that was named
    time = bench.imu.index.to_numpy()
    removed = 0.0 if bias == "none" else BIAS[axis]
    if bias == "recorded":
        removed = rates_of_file(folder / "unmoved-10min", axis).mean()
        assert removed == pytest.approx(BIAS[axis], abs=KNOWN_TO)
    rates = rates_of_file(folder / name, axis)
    # The rest of the unmoved log is at least 97 % of it (below), with the sd of a sample 0.1 deg/s.
    known = 1e-9 if bias != "recorded" else 0.03 * KNOWN_TO * (time[-1] - time[0])
    expected = np.trapezoid(rates, time) - removed * (time[-1] - time[0])
    assert turned == pytest.approx(expected, abs=known)
    assert bench.differences_deg.loc["dcm", "quaternion"] < 1e-9


def gravity_missed(time, rates, force):
    """RMS of the force less that of the first second, carried on by the rates, m/s²."""
    run = run_attitude(Quaternion(), increments_from_imu(imu_table(time, rates)))
    q = run.attitude[QUATERNION].to_numpy()
    early = time < time[0] + 1.0
    up = rotation.rotate(q[early], force[early]).mean(axis=0)
    predicted = rotation.rotate(rotation.conjugate(q), up)
    return np.sqrt(((predicted - force) ** 2).sum(axis=1).mean())


def turns(recordings, name):
    """Stamps of a log, rates less the bias of the unmoved board, rad/s, and specific force."""
    log = read_log(recordings("mpu6050_turns") / name).imu
    still = read_log(recordings("mpu6050_turns/unmoved-10min")).imu
    rates = log[GYRO].to_numpy() - still[GYRO].to_numpy().mean(axis=0)
    return log.index.to_numpy(), rates, log[ACCEL].to_numpy()


@pytest.mark.parametrize("name", TURNS)
def test_gravity_prefers_the_clock_of_bursts_to_their_stamps(recordings, name):
    stamps, rates, force = turns(recordings, name)
    clock = sample_clock(stamps, rates)
    assert clock.kind == "bursts"
    # The board was moved without a pause, and the samples are those of one clock.
    assert not clock.gaps
    assert gravity_missed(clock.time, rates, force) < gravity_missed(stamps, rates, force)


@pytest.mark.parametrize("name", TURNS)
def test_what_the_hand_left_is_what_the_accelerometer_sees(recordings, name):
    """The board is put back by hand; how far off, the direction of gravity tells.

    The hand shakes it by some 0.5 m/s² even in the mean of a second, which is 3 deg of tilt at
    each end; gyro and accelerometer must agree on the end within the two together, and a deg
    for the scale of the gyro in two turns (0.1 to 0.4 %).
    """
    axis, _ = TURNS[name]
    folder = recordings("mpu6050_turns")
    bench = compare_attitude(
        folder / name,
        reference=[f"end 2 turns about {axis} since start"],
        gyro_bias=str(folder / "unmoved-10min"),
    )
    time, force = bench.imu.index.to_numpy(), bench.imu[ACCEL].to_numpy()
    q = bench.runs[-1].attitude[QUATERNION].to_numpy()
    up = [
        rotation.rotate(q[part], force[part]).mean(axis=0)
        for part in (time < time[0] + 1.0, time > time[-1] - 1.0)
    ]
    cosine = up[0] @ up[1] / np.linalg.norm(up[0]) / np.linalg.norm(up[1])
    assert np.degrees(np.arccos(cosine)) < 7.0


@pytest.mark.parametrize("name", TURNS)
def test_the_axes_of_the_board_are_right_handed(recordings, name):
    """Of the eight choices of sign, the one that is read predicts gravity best.

    The gyro carries the first second's direction of the specific force through the turns; the
    accelerometer measures it all along.
    """
    time, rates, force = turns(recordings, name)
    misses = {
        signs: gravity_missed(time, rates * (1 - 2 * np.array(signs)), force)
        for signs in np.ndindex(2, 2, 2)
    }
    assert min(misses, key=misses.__getitem__) == (0, 0, 0)


@pytest.mark.parametrize(
    ("name", "up"),
    [
        ("unmoved-10min", None),
        ("unmoved-x-pointing-forward", (0, 0, -1)),
        ("unmoved-x-pointing-up", (1, 0, 0)),
        ("unmoved-z-pointing-left", None),
    ],
)
def test_unmoved_logs_are_one_rest(recordings, name, up):
    bench = compare_attitude(recordings("mpu6050_turns") / name)
    assert len(bench.rests) == 1
    rest = bench.rests[0]
    assert rest.end - rest.start > 0.97 * (bench.imu.index[-1] - bench.imu.index[0])
    # "about (4.54, 0.11, 1.07) deg/s" about the board's x, y, z
    board = np.degrees(rest.gyro_mean) * [-1, 1, -1]
    assert board == pytest.approx([4.54, 0.11, 1.07], abs=0.1)
    if up is not None:
        direction = np.array(rest.accel_mean) / np.linalg.norm(rest.accel_mean)
        assert direction @ up > np.cos(np.radians(5.0))


BROAD = [
    "02_undisturbed_slow_rotation_B",
    "07_undisturbed_fast_rotation_B",
    "14_undisturbed_slow_translation_with_breaks_B",
    "27_disturbed_phone_vibration_B",
]


@cache
def broad(path):
    """All algorithms on a trial, less the bias of its rest."""
    return compare_attitude(path, gyro_bias="rest")


@pytest.mark.slow
@pytest.mark.parametrize("trial", BROAD)
def test_broad_trials_against_their_optical_truth(recordings, trial):
    bench = broad(recordings(f"broad/{trial}.hdf5"))
    score = {s.algorithm: s for s in bench.scores}
    assert bench.differences_deg.loc["dcm", "quaternion"] < 1e-9
    # Gyro alone with that bias ends 3.0 to 6.9 deg off after three minutes: the sensor's own.
    assert 3.0 <= score["quaternion"].error_deg <= 6.9
    assert score["quaternion"].rms_deg < score["quaternion"].max_deg < 10.0
    # The commutation error of the naive sum is a multiple of that on free motion.
    assert score["naive"].max_deg > 2 * score["quaternion"].max_deg
    counted = read_log(recordings(f"broad/{trial}.hdf5")).scored.sum()
    assert bench.scored.sum() == counted > 20_000


@pytest.mark.parametrize("trial", BROAD)
def test_broad_starts_as_its_own_quaternion_says(recordings, trial):
    """From the first quaternion of the file alone, in its own frames: east, north, up."""
    path = recordings(f"broad/{trial}.hdf5")
    with h5py.File(path) as file:
        q = file["opt_quat"][:]
    w, x, y, z = q[np.argmax(np.isfinite(q[:, 0]))]
    turn = Rotation.from_quat([x, y, z, w])
    ahead, left = turn.apply([1.0, 0.0, 0.0]), turn.apply([0.0, 1.0, 0.0])
    asked = {"algorithms": ["quaternion"], "reference_clock": "stated"}
    initial = compare_attitude(path, **asked).initial
    heading = np.degrees(np.arctan2(ahead[0], ahead[1])) % 360  # from north towards east
    pitch = np.degrees(np.arcsin(ahead[2]))  # nose up
    roll = np.degrees(np.arcsin(left[2] / np.cos(np.radians(pitch))))  # left side up
    # Three roundings of angles up to 360 deg.
    assert initial["heading_deg"] == pytest.approx(heading, abs=1e-9)
    assert initial["pitch_deg"] == pytest.approx(pitch, abs=1e-9)
    assert initial["roll_deg"] == pytest.approx(roll, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("trial", BROAD)
def test_broad_by_another_library(recordings, trial):
    """The same integration by scipy's rotations in the file's own frames, and as stamped there."""
    path = recordings(f"broad/{trial}.hdf5")
    asked = {"algorithms": ["quaternion"], "reference_clock": "stated"}
    bench = compare_attitude(path, gyro_bias="rest", **asked)
    (run,) = bench.runs
    with h5py.File(path) as file:
        gyro, q = file["imu_gyr"][:], file["opt_quat"][:]
        counts, step = file["movement"][:], 1.0 / file.attrs["sampling_rate"]
    gyro = gyro - np.array(bench.gyro_bias["rad_per_s"]) * [1, -1, -1]
    first = int(np.argmax(np.isfinite(q[:, 0])))
    turns = Rotation.from_rotvec(0.5 * (gyro[first:-1] + gyro[first + 1 :]) * step)
    attitude = Rotation.from_quat(q[first][[1, 2, 3, 0]])
    known = counts & np.isfinite(q).all(axis=1)
    errors = []
    for k, turn in enumerate(turns, start=first + 1):
        attitude = attitude * turn
        if known[k] and k % 97 == 0:  # one in 97 is enough, and keeps this under a second
            truth = Rotation.from_quat(q[k][[1, 2, 3, 0]])
            errors.append((k * step, np.degrees((attitude.inv() * truth).magnitude())))
    ours = error_angles(run.attitude, bench.truth)
    for time, error in errors:
        # 5e4 products, each rounded to some 1e-16 rad, in two libraries; the clock to 1e-14.
        at = int(np.argmin(np.abs(ours.index.to_numpy() - time)))
        assert ours.iloc[at] == pytest.approx(error, abs=1e-9)
