"""Second sensors, rests, places and offers, from files to scores, against exact motions."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.differences import Known, attitude_at, known_at
from strapdown.formats.writers import WRITERS
from strapdown.increments import increments_from_imu
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import find_scenario, simulate_imu
from strapdown.simulation.attitude_motions import Handling
from strapdown.tables import ACCEL, GYRO, QUATERNION, attitude_table, imu_table

MOTION = Handling(duration=60.0, seed=3)
# Turns a vector from the second sensor's axes into the first one's.
MOUNTING = rotation.quaternion_from_euler([25.0, -35.0, 110.0])
LATE = 3.217  # s, of the second clock
ALGORITHMS = ["naive", "quaternion"]


def second_sensor(rate):
    """A sensor without errors on the same body, in axes of its own and on a clock of its own."""
    imu, truth = simulate_imu(MOTION, ImuErrors(), rate=rate)
    back = rotation.conjugate(MOUNTING)
    table = imu_table(
        imu.index + LATE,
        rotation.rotate(back, imu[GYRO].to_numpy()),
        rotation.rotate(back, imu[ACCEL].to_numpy()),
    )
    q = rotation.compose(truth[QUATERNION].to_numpy(), MOUNTING)
    return table, attitude_table(table.index, q)


@pytest.fixture(scope="module")
def first():
    return simulate_imu(MOTION, load_sensor("mpu-9250").draw(4), rate=100.0, seed=4)


@pytest.fixture(scope="module")
def logs(first, tmp_path_factory):
    """The same minute by a cheap sensor, and by a better one with and without its attitude."""
    folder = tmp_path_factory.mktemp("two")
    second, attitude = second_sensor(200.0)
    WRITERS["csv"].write(folder / "first.csv", {"imu": first[0]})
    WRITERS["csv"].write(folder / "second.csv", {"imu": second})
    WRITERS["csv"].write(folder / "optical.csv", {"imu": second, "reference": attitude})
    return folder


def truths_own_error(bench, exact):
    """Rotation angle between the truth that was found and the exact one, deg."""
    at = exact[QUATERNION].loc[bench.truth.index].to_numpy()
    return rotation.rotation_angle(bench.truth[QUATERNION].to_numpy(), at)


def test_errors_against_a_second_log_are_those_against_the_exact_truth(logs, first):
    bench = compare_attitude(
        logs / "first.csv",
        reference_log=logs / "second.csv",
        gyro_bias="rest",
        initial="0,0,0",
        algorithms=ALGORITHMS,
        rates_hz=[100],
    )
    found = bench.second
    assert found.offset == pytest.approx(LATE, abs=5 * found.offset_sd + 1e-6)
    off = rotation.rotation_angle(found.mounting, MOUNTING)
    assert off <= 5 * np.linalg.norm(found.mounting_sd_deg)
    second, _ = second_sensor(200.0)
    rate = np.linalg.norm(second[GYRO].to_numpy(), axis=1)
    # What the second log tells is off by: the mounting, twice; its clock's offset and drift by
    # the rate, and the drift by all that was turned; its own sampling; and what the first sensor
    # turned before the part that both cover, which is at rest but for its noise.
    clock = found.offset_sd + 1e-6 * found.drift_sd_ppm * 30.0
    clock = clock * rate.max() + 1e-6 * found.drift_sd_ppm * np.trapezoid(rate, second.index)
    straight = run_attitude(
        Quaternion(),
        increments_from_imu(second),
        rotation.compose([1.0, 0.0, 0.0, 0.0], MOUNTING),
    )
    exact2 = second_sensor(200.0)[1]
    sampled = rotation.rotation_angle(
        straight.attitude[QUATERNION].to_numpy(), exact2[QUATERNION].to_numpy()
    ).max()
    bound = 5 * (2 * np.linalg.norm(found.mounting_sd_deg) + np.degrees(clock)) + 2 * sampled
    assert truths_own_error(bench, first[1]).max() <= bound
    for run, score in zip(bench.runs, bench.scores, strict=True):
        at = first[1][QUATERNION].loc[run.attitude.index].to_numpy()
        error = rotation.rotation_angle(run.attitude[QUATERNION].to_numpy(), at)
        assert abs(score.max_deg - error.max()) <= bound
        assert abs(score.error_deg - error[-1]) <= bound
    # The bound says something of the errors that it bounds.
    assert bound < 0.25 * max(s.max_deg for s in bench.scores)
    assert [i.role for i in bench.inputs] == ["log", "reference-log"]
    assert bench.answer.verdict in ("enough", "sensor")


def test_a_second_log_with_an_attitude_tells_where_the_run_starts(logs, first):
    """In the midst of a motion, where no levelling and no zero would do."""
    rate = np.linalg.norm(first[0][GYRO].to_numpy(), axis=1)
    middle = float(first[0].index[2000 + int(rate[2000:3000].argmax())])
    bench = compare_attitude(
        logs / "first.csv",
        from_s=middle,
        reference_log=logs / "optical.csv",
        algorithms=ALGORITHMS,
        rates_hz=[100],
    )
    assert bench.initial["from"] == "from the truth"
    found = bench.second
    # The mounting and the clock; and chords of 5 ms between the rows of the truth, which lie
    # below the arc by the angular acceleration, some 30 rad/s², times 5 ms squared, over 8.
    bound = 5 * (
        np.linalg.norm(found.mounting_sd_deg) + np.degrees(found.offset_sd * rate.max())
    ) + np.degrees(30.0 * 0.005**2 / 8.0)
    assert truths_own_error(bench, first[1]).max() <= bound
    start = first[1][QUATERNION].loc[bench.runs[0].attitude.index[0]].to_numpy()
    q = bench.runs[0].attitude[QUATERNION].to_numpy()[0]
    assert rotation.rotation_angle(q, start) <= bound
    # Not level: had it begun so, it would be off by this from the start on.
    assert rotation.rotation_angle([1.0, 0.0, 0.0, 0.0], start) > 10.0


def test_two_truths_are_refused(logs, first):
    WRITERS["csv"].write(logs / "truth.csv", {"imu": first[0], "reference": first[1]})
    with pytest.raises(
        ConfigError, match="--reference-log: an attitude reference is given as well"
    ):
        compare_attitude(
            logs / "first.csv",
            reference=logs / "truth.csv",
            reference_log=logs / "second.csv",
        )


def test_a_second_log_of_another_motion_is_refused(logs):
    other, _ = simulate_imu(Handling(duration=60.0, seed=99), ImuErrors(), rate=100.0)
    WRITERS["csv"].write(logs / "other.csv", {"imu": other})
    with pytest.raises(DataError):
        compare_attitude(logs / "first.csv", reference_log=logs / "other.csv")


def test_a_second_log_is_no_exact_truth_of_a_scenario(logs, tmp_path):
    """Own errors are then an estimate, and are not measured against what the second log says."""
    second, _ = simulate_imu(find_scenario("gestures").motion, ImuErrors(), rate=200.0)
    turned = imu_table(second.index, 1.02 * second[GYRO].to_numpy(), second[ACCEL].to_numpy())
    WRITERS["csv"].write(tmp_path / "second.csv", {"imu": turned})
    bench = compare_attitude(
        "gestures",
        reference_log=tmp_path / "second.csv",
        algorithms=["quaternion"],
        rates_hz=[100],
    )
    # Its scale is 2 % off, which no algorithm is to blame for.
    assert bench.scores[0].max_deg > 1.0
    assert bench.shares[0].own_deg[2] < 0.1


def test_gravity_at_rests_is_a_reference(logs, first):
    bench = compare_attitude(
        logs / "first.csv",
        reference="rests",
        gyro_bias="rest",
        algorithms=["quaternion"],
        rates_hz=[100],
    )
    assert bench.initial["from"].startswith("levelled")
    kinds = bench.references["kind"]
    assert set(kinds) == {"tilt"}
    # The rest that it was levelled from is none.
    assert len(kinds) == len(bench.rests) - 1
    assert bench.offers == ()
    exact = first[1]
    for score in bench.scores:
        assert score.against != "truth"
        # The tilt of the run against the exact one: what the reference is known to, and the
        # bias of the accelerometer at the start, which levelling takes for a tilt.
        q = attitude_at(bench.runs[0].attitude, [score.time])[0]
        down = rotation.rotate(rotation.conjugate(q), [0.0, 0.0, 1.0])
        there = attitude_at(exact, [score.time])[0]
        at = rotation.rotate(rotation.conjugate(there), [0.0, 0.0, 1.0])
        tilt = np.degrees(np.arccos(np.clip(down @ at, -1.0, 1.0)))
        assert abs(score.error_deg - tilt) <= 5 * score.sd_deg


def test_rests_without_any_are_refused(tmp_path):
    time = np.arange(300) * 0.01
    gyro = np.column_stack([np.sin(9 * time), np.cos(7 * time), np.sin(5 * time)])
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": imu_table(time, gyro)})
    with pytest.raises(
        ConfigError, match=r"log\.csv, --reference rests: no stationary interval with acceleration"
    ):
        compare_attitude(tmp_path / "log.csv", reference="rests")


def test_a_single_rest_levels_and_is_no_reference(tmp_path):
    time = np.arange(800) * 0.01
    gyro = np.where(time[:, None] < 4.0, 0.0, np.sin([3.0, 2.0, 4.0] * time[:, None]))
    force = np.tile([0.0, 0.0, -9.8], (800, 1)) + 0.3 * gyro
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": imu_table(time, gyro, force)})
    bench = compare_attitude(
        tmp_path / "log.csv", reference="rests", algorithms=["quaternion"], rates_hz=[100]
    )
    assert (bench.initial["method"], bench.scores, bench.answer.verdict) == ("level", (), "own")
    (finding,) = [f for f in bench.findings if f.code == "attitude.one-rest"]
    assert finding.severity == "warning" and finding.data["end"] < 4.0


def test_the_course_of_a_trend_is_taken_off(tmp_path):
    """Noise of 1e-4 rad/s/√Hz, and a bias that runs away by 5e-5 rad/s².

    A rest of 1.5 s tells the bias to 8e-5 rad/s; each counts for some 10 s, six of them in turn:
    0.11 deg. The walk over 60 s is 0.05 deg. Outside the middles of the first and last rest, up
    to 2.5 s long, the course is held: 2.5² / 2 times the trend is 0.009 deg, at either end.
    """
    trend = (5e-5, -3e-5, 4e-5)
    errors = ImuErrors(TriadErrors(noise_density=1e-4, trend=trend))
    imu, truth = simulate_imu(MOTION, errors, rate=100.0, seed=1)
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": imu, "reference": truth})
    asked = {"algorithms": ["quaternion"], "rates_hz": [100]}
    plain = compare_attitude(tmp_path / "log.csv", **asked)
    course = compare_attitude(tmp_path / "log.csv", gyro_bias="rests", **asked)
    own = plain.shares[0].own_deg[2]
    bound = own + np.sqrt(3) * (5 * np.hypot(0.11, 0.05) + 2 * 0.009)
    assert course.scores[0].max_deg < bound
    # 5e-5 rad/s² over 60 s are 5.2 deg about one axis alone.
    assert plain.scores[0].max_deg > 3.0
    assert course.gyro_bias["from"].startswith("course over")


def test_poses_that_are_alike_are_offered_and_can_be_taken(logs):
    bench = compare_attitude(
        logs / "first.csv", gyro_bias="rest", algorithms=["quaternion"], rates_hz=[100]
    )
    assert len(bench.offers) >= 1
    offer = bench.offers[-1]
    # The phone is put back into the very same pose each time.
    taken = compare_attitude(
        logs / "first.csv",
        gyro_bias="rest",
        algorithms=["quaternion"],
        rates_hz=[100],
        reference=offer.words,
    )
    assert taken.offers == ()
    assert taken.scores[0].time == pytest.approx(offer.time, abs=0.01)
    assert np.isfinite(taken.scores[0].error_deg)


def test_a_place_is_scored_for_every_algorithm():
    bench = compare_attitude(
        "gestures",
        algorithms=["quaternion", "rotvec"],
        rates_hz=[200],
        reference=["13 same place as 6", "end same as start"],
    )
    assert [p.algorithm for p in bench.places] == ["quaternion", "rotvec"]
    for place in bench.places:
        assert place.expected_m == (0.0, 0.0, 0.0)
        # Back to the same place; with the velocity brought to zero the trapezoid of 5 ms leaves
        # far less than what was moved, 0.3 m.
        assert place.corrected_error_m < 0.03
    assert {s.against for s in bench.scores} >= {"truth"}


def test_a_truth_counts_where_it_is_at_hand_on_both_sides():
    time = np.r_[np.arange(11) * 0.1, 2.0 + np.arange(11) * 0.1]
    angle = 10.0 * time
    truth = attitude_table(
        time, rotation.quaternion_from_euler(np.column_stack([0 * angle, 0 * angle, angle]))
    )
    scored = np.ones(22, dtype=bool)
    scored[3] = False
    stamps = np.array([-0.05, 0.0, 0.05, 0.3, 0.25, 1.0, 1.5, 2.0, 2.95, 3.0, 3.05])
    found = known_at(truth, scored, stamps)
    # Beside the row that does not count its neighbours are two steps apart, which is near enough;
    # across the hole of a second nothing is known.
    expected = [False, True, True, True, True, True, False, True, True, True, False]
    assert found.counts.tolist() == expected
    heading = rotation.euler_from_quaternion(found.q_nb[found.counts])[:, 2]
    assert heading == pytest.approx(10.0 * stamps[found.counts], abs=1e-9)
    nothing = known_at(truth, np.zeros(22, dtype=bool), stamps)
    assert not nothing.counts.any()
    assert nothing.errors(found.q_nb) is None


def test_errors_are_the_last_the_root_mean_square_and_the_largest():
    turned = np.array([3.0, 4.0, 0.0, 1.0])
    angles = np.column_stack([0 * turned, 0 * turned, turned])
    known = Known(np.tile([1.0, 0.0, 0.0, 0.0], (6, 1)), np.array([1, 1, 0, 1, 1, 0], dtype=bool))
    q = rotation.quaternion_from_euler(angles)
    samples = np.array([0, 1, 2, 3])
    final, rms, largest = known.at(samples).errors(q)
    assert (final, rms, largest) == pytest.approx((1.0, np.sqrt(26.0 / 3.0), 4.0), abs=1e-12)
