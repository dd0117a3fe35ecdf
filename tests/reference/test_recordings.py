"""Real recordings with known answers; their provenance stands beside them, in their README.

The recordings come from STRAPDOWN_DATA; without them these tests skip. The numbers that are
asserted are those of the recording's own documentation, or follow from its physics; none was
taken from a result of this code.
"""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import bench_attitude, read_log, rotation
from strapdown.attitude import Quaternion, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.tables import ACCEL, GYRO, QUATERNION, imu_table

TURNS = {
    # Axis of the board turned about in body axes, and the integral that the recording's notes
    # give for it once the bias is removed, deg. Forward is -x of the board, right is +y.
    "rotate-360ccw-around-x-pointing-forward": ("forward", 720.6),
    "rotate-360ccw-around-y-pointing-left": ("right", 721.9),
    "rotate-360ccw-around-z-pointing-up": ("up", 721.5),
}


@pytest.mark.parametrize("name", TURNS)
@pytest.mark.parametrize("bias", ["none", "stated", "recorded"])
def test_two_turns_by_hand(recordings, name, bias):
    axis, integral = TURNS[name]
    folder = recordings("mpu6050_turns")
    gyro_bias = {
        "none": "none",
        # (4.54, 0.11, 1.07) deg/s about the board's axes.
        "stated": "-4.54,0.11,-1.07 deg/s",
        "recorded": str(folder / "unmoved-10min"),
    }[bias]
    bench = bench_attitude(
        folder / name, reference=[f"end 2 turns about {axis} since start"], gyro_bias=gyro_bias
    )
    scores = {s.algorithm: s for s in bench.scores}
    turned = abs(scores["quaternion"].turned_deg)
    length = bench.imu.index[-1] - bench.imu.index[0]
    if bias == "none":
        # What the bias itself turns in that time is missing or too much, to the tenth of a
        # degree a second to which it is known.
        drift = {"forward": 4.54, "right": 0.11, "up": 1.07}[axis]
        assert abs(turned - integral) == pytest.approx(drift * length, abs=0.12 * length)
    else:
        # The bias differs by 0.06 deg/s between the two ways of knowing it.
        assert turned == pytest.approx(integral, abs=0.15 * length)
    errors = {a: s.error_deg for a, s in scores.items()}
    assert errors["dcm"] == pytest.approx(errors["quaternion"], abs=1e-9)
    assert bench.differences_deg.loc["dcm", "quaternion"] < 1e-9
    if bias != "none":
        # Put back by hand, not by a machine: within a hand's breadth of the same attitude.
        assert errors["quaternion"] < 20.0


@pytest.mark.parametrize("name", TURNS)
def test_the_axes_of_the_board_are_right_handed(recordings, name):
    """Of the eight choices of sign, the one that is read predicts gravity best.

    The gyro carries the first second's direction of the specific force through the turns; the
    accelerometer measures it all along.
    """
    log = read_log(recordings("mpu6050_turns") / name).imu
    still = read_log(recordings("mpu6050_turns/unmoved-10min")).imu
    rates = log[GYRO].to_numpy() - still[GYRO].to_numpy().mean(axis=0)
    time, force = log.index.to_numpy(), log[ACCEL].to_numpy()
    misses = {}
    for signs in np.ndindex(2, 2, 2):
        flipped = rates * (1 - 2 * np.array(signs))
        run = run_attitude(Quaternion(), increments_from_imu(imu_table(time, flipped)))
        q = run.attitude[QUATERNION].to_numpy()
        early = time < time[0] + 1.0
        up = rotation.rotate(q[early], force[early]).mean(axis=0)
        predicted = rotation.rotate(rotation.conjugate(q), up)
        misses[signs] = np.sqrt(((predicted - force) ** 2).sum(axis=1).mean())
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
    bench = bench_attitude(recordings("mpu6050_turns") / name)
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


@pytest.mark.parametrize("trial", BROAD)
def test_broad_trials_against_their_optical_truth(recordings, trial):
    bench = bench_attitude(recordings(f"broad/{trial}.hdf5"), gyro_bias="rest")
    score = {s.algorithm: s for s in bench.scores}
    assert bench.differences_deg.loc["dcm", "quaternion"] < 1e-9
    # Gyro alone with that bias ends 3.0 to 6.9 deg off after three minutes: the sensor's own.
    assert 3.0 <= score["quaternion"].error_deg <= 6.9
    assert score["quaternion"].rms_deg < score["quaternion"].max_deg < 10.0
    # The commutation error of the naive sum is a multiple of that on free motion.
    assert score["naive"].max_deg > 2 * score["quaternion"].max_deg
    counted = read_log(recordings(f"broad/{trial}.hdf5")).scored.sum()
    assert bench.scored.sum() == counted > 20_000


def test_broad_s_attitude_is_its_own_truth_s(recordings):
    """At the first instant with truth, level to the accelerometer and heading as optical."""
    bench = bench_attitude(recordings(f"broad/{BROAD[0]}.hdf5"), gyro_bias="rest")
    # On the table: roll and pitch are those that the accelerometer levels to, within its bias.
    rest = bench.rests[0]
    from strapdown.alignment.levelling import level

    roll, pitch = level(rest.accel_mean)
    assert bench.initial["roll_deg"] == pytest.approx(roll, abs=1.5)
    assert bench.initial["pitch_deg"] == pytest.approx(pitch, abs=1.5)
