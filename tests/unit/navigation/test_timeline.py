"""Modes: what leads where, what ends each, what a command does."""

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.alignment.alignment import Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.modes import (
    CoarseMode,
    Command,
    FineMode,
    KnownStart,
    Navigation,
    Until,
    check_timeline,
)
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.replay import Recording, pieces_by_sample, run_batch
from strapdown.rotation import (
    dcm_from_euler,
    quaternion_from_dcm,
    rotation_vector_from_quaternion,
)
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import Origin, StationaryMotion, simulate_imu

LEVEL = CoarseMode(way=COARSE_ALIGNMENTS["two_vector"](), until=Until(10.0))
HERE = (50.0, 10.0, 100.0)
SENSORS = ImuUncertainty(
    TriadUncertainty(bias=1e-7, noise_density=1e-6), TriadUncertainty(bias=2e-4, noise_density=1e-4)
)


def navigator():
    model = RotationVectorModel((1e-6,) * 3, (1e-4,) * 3, (gyro_bias(1e-7), accel_bias(2e-4)))
    return Navigator(ErrorFilter(MECHANIZATIONS["ned"](), model, COVARIANCES["ud"]()))


def standing(modes, **more):
    return NavigationPipeline(navigator(), modes=modes, sensors=SENSORS, site=Site(*HERE), **more)


def rest(length=20.0, rate=20.0):
    errors = ImuErrors(TriadErrors(noise_density=1e-6), TriadErrors(noise_density=1e-4))
    still = StationaryMotion(length, Origin(*HERE), heading_deg=30.0)
    return simulate_imu(still, errors, rate=rate, seed=1, source="rest.csv")[0]


@pytest.mark.parametrize(
    ("modes", "known", "what"),
    [
        ((), False, "is not navigation"),
        ((Navigation(), LEVEL), False, "is not navigation"),
        ((LEVEL,), False, "is not navigation"),
        ((Navigation(),), False, "navigation has no start"),
        ((LEVEL, Navigation()), True, "is known"),
        ((FineMode(), Navigation()), False, "no coarse alignment"),
        ((LEVEL, LEVEL, Navigation()), False, "two modes"),
        ((LEVEL, Navigation("next")), False, "'next'"),
    ],
)
def test_modes_that_lead_nowhere_are_refused(modes, known, what):
    with pytest.raises(ConfigError, match=what):
        check_timeline(modes, known)


def test_convergence_is_tried_at_whole_seconds_ever_less_often():
    until = Until(1000.0, heading_sd_deg=0.1)
    assert Until(10.0).next_try(0.0) == math.inf
    tries, at = [], 0.0
    while at < 600.0:
        at = until.next_try(at)
        tries.append(at)
    assert tries[:4] == [1.0, 2.0, 3.0, 4.0]
    assert all(t == round(t) for t in tries)
    # An alignment of t seconds costs t: all of them together cost no more than 25 of the last.
    assert sum(tries) < 25.0 * tries[-1]
    assert until.met(0.1, 5.0) and not until.met(0.11, 0.0)
    both = Until(10.0, heading_sd_deg=0.1, tilt_sd_deg=0.01)
    assert both.met(0.1, 0.01) and not both.met(0.1, 0.02)


def test_what_means_nothing_is_refused():
    for options in ({"duration": 0.0}, {"heading_sd_deg": -1.0}, {"pause": 2.0}, {"least": 0.0}):
        with pytest.raises(ConfigError):
            Until(**options)
    with pytest.raises(ConfigError, check=coded("navigation.unknown-mode")):
        standing((LEVEL, Navigation()), commands=(Command(1.0, "fly"),))
    with pytest.raises(
        ConfigError, check=coded("navigation.alignment-without-sensor-errors", quantity="sensors")
    ):
        NavigationPipeline(navigator(), modes=(LEVEL, Navigation()))
    with pytest.raises(ConfigError, check=coded("navigation.no-aid-table-2", quantity="fixes")):
        standing((LEVEL, Navigation()), fixes="rtk")


def test_events_and_spans_tell_the_timeline():
    run = run_batch(standing((LEVEL, Navigation())), rest())
    assert [(m.name, m.begin, m.end) for m in run.record.modes] == [
        ("coarse", 0.0, 10.0),
        ("navigation", 10.0, 20.0),
    ]
    said = [(event.finding.code, event.finding.data["mode"]) for event in run.record.events]
    assert said == [
        ("navigation.event-mode-begins", "coarse"),
        ("navigation.event-mode-timed-out", "coarse"),
        ("navigation.event-mode-begins", "navigation"),
    ]
    assert run.record.events[1].finding.data["elapsed"] == pytest.approx(10.0)
    assert run.aligned[0].alignment.time == 10.0
    first = run.record.trajectory.index[0]
    assert first == pytest.approx(10.05)


def test_a_command_that_is_not_possible_yet_changes_nothing():
    # Ten samples tell no attitude.
    chain = standing((LEVEL, Navigation()), commands=(Command(0.45, "next"), Command(6.0, "next")))
    run = run_batch(chain, rest())
    first, second = [event for event in run.record.events if event.kind == "command"]
    assert first.time == pytest.approx(0.45)
    assert first.finding.code == "navigation.event-command-too-early"
    assert second.finding.data["word"] == "next" and run.record.modes[0].end == pytest.approx(6.0)


def test_a_live_command_is_one_of_the_list():
    imu = rest()
    chain = standing((LEVEL, Navigation()))
    recording, done = Recording(chain), []

    def each(state, time):
        if time > 5.99 and not done:
            done.append(time)
            return chain.command(state, "navigation")
        return state

    for piece in pieces_by_sample(chain, imu, each=each):
        recording.take(piece)
    live = recording.run()
    listed = standing((LEVEL, Navigation()), commands=(Command(6.0, "navigation"),))
    listed = run_batch(listed, imu)
    np.testing.assert_array_equal(live.record.trajectory, listed.record.trajectory)
    assert live.record.events == listed.record.events


def test_a_command_in_navigation_is_past():
    chain = standing((LEVEL, Navigation()), commands=(Command(15.0, "navigation"),))
    events = run_batch(chain, rest()).record.events
    assert [event.finding.code for event in events if event.kind == "command"] == [
        "navigation.event-command-past"
    ]


def test_samples_that_end_before_navigation_say_so():
    with pytest.raises(
        DataError,
        check=coded("navigation.samples-end-mode-before-navigation", file="rest.csv", time=8.0),
    ):
        run_batch(standing((LEVEL, Navigation())), rest(8.0))


def test_an_alignment_that_never_converges_ends_with_its_longest_time():
    until = Until(10.0, heading_sd_deg=1e-6)
    mode = CoarseMode(way=COARSE_ALIGNMENTS["two_vector"](), until=until)
    run = run_batch(standing((mode, Navigation())), rest())
    assert run.record.modes[0].end == pytest.approx(10.0)


def test_a_known_state_begins_with_its_sample():
    imu = rest()
    here = NavState.from_degrees(*HERE, heading_deg=30.0, time=5.0)
    sd = ((1.0,) * 3, (0.1,) * 3, (0.1, 0.1, 1.0))
    run = run_batch(NavigationPipeline(navigator(), start=KnownStart(here, *sd)), imu)
    assert run.record.trajectory.index[0] == pytest.approx(5.05)
    assert run.record.modes[0].begin == pytest.approx(5.0)
    late = NavState.from_degrees(*HERE, time=-3.0)
    with pytest.raises(
        DataError,
        check=coded(
            "navigation.state-known-samples-begin",
            file="rest.csv",
            quantity="start",
            time=-3.0,
            time_2=0.0,
        ),
    ):
        run_batch(NavigationPipeline(navigator(), start=KnownStart(late, *sd)), imu)
    first = NavigationPipeline(navigator(), start=KnownStart(late, *sd, at_first_sample=True))
    assert run_batch(first, imu).record.trajectory.index[0] == pytest.approx(0.05)


def test_errors_of_angles_turn_about_their_axes():
    angles, sd = np.array([20.0, -35.0, 110.0]), np.array([0.3, 0.2, 0.1])
    C = dcm_from_euler(angles)
    state = NavState.from_degrees(
        *HERE, roll_deg=angles[0], pitch_deg=angles[1], heading_deg=angles[2]
    )
    expected = np.zeros((3, 3))
    for k in range(3):
        # C_computed = exp([psi x]) C_true, to first order in 1e-6 deg.
        moved = dcm_from_euler(angles + 1e-6 * np.eye(3)[k])
        psi = rotation_vector_from_quaternion(quaternion_from_dcm(moved @ C.T)) / 1e-6
        expected += np.outer(psi, psi) * sd[k] ** 2
    found = KnownStart(state, (1.0,) * 3, (1.0,) * 3, tuple(sd)).covariance[6:, 6:]
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-12)
    with pytest.raises(
        ConfigError, check=coded("navigation.no-three-standard-deviations", quantity="position_sd")
    ):
        KnownStart(state, (1.0, -1.0, 1.0), (1.0,) * 3, (1.0,) * 3)
