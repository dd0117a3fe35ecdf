"""A chain cut anywhere, or fed sample by sample, gives the numbers of the whole to the last bit.

Held for every module of every slot, from the tables of modules themselves.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from tests.aiding_sensors import FieldSensor, simulate_magnetometer
from tests.town_drive import (
    ACCEL_BIAS,
    ACCEL_NOISE,
    ARM,
    GYRO_BIAS,
    GYRO_NOISE,
    RATE,
    fixes,
    motion,
)

from strapdown.alignment.alignment import Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import ERROR_MODELS
from strapdown.estimation.robust import UPDATE_RULES
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias, gyro_drift
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.filter_options import DAMPINGS
from strapdown.navigation.measurements import AIDS
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import ImuDerivedMeasurement
from strapdown.navigation.modes import CoarseMode, Command, FineMode, KnownStart, Navigation, Until
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import GapPolicy, ImuPreprocessor
from strapdown.navigation.recorder import RECORDERS, FullRecorder
from strapdown.navigation.replay import Recording, run_batch, run_by_sample
from strapdown.navigation.smoother import SMOOTHERS
from strapdown.prefilter import PREFILTERS
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.tables import (
    ACCEL,
    GYRO,
    barometer_table,
    body_velocity_table,
    gnss_table,
    heading_table,
    odometer_table,
)

LENGTH = 5.0  # s of the drive
HERE = (45.0, 20.0, 80.0)


@cache
def drive():
    """The begin of the drive through a town; a sample is lost, and six."""
    errors = ImuErrors(
        TriadErrors(noise_density=GYRO_NOISE, bias=GYRO_BIAS),
        TriadErrors(noise_density=ACCEL_NOISE, bias=ACCEL_BIAS),
    )
    imu, _ = simulate_imu(motion(), errors, rate=RATE, sampling="mean", seed=3)
    imu = imu[imu.index <= LENGTH]
    kept = imu.drop(imu.index[[90, *range(150, 156)]])
    kept.attrs = dict(imu.attrs)
    return kept


@cache
def rest(rate=50.0, length=44.0):
    """A body of navigation grade at rest."""
    errors = ImuErrors(
        TriadErrors(noise_density=1e-6, bias=5e-8), TriadErrors(noise_density=1e-4, bias=2e-4)
    )
    still = StationaryMotion(length, Origin(*HERE), roll_deg=2.0, heading_deg=30.0)
    return simulate_imu(still, errors, rate=rate, seed=4)[0]


def tables():
    """What each aid is told; times that fall on samples, and between them."""
    truth = motion().trajectory(np.arange(0.5, LENGTH, 0.25) + 0.003)
    time, speed = truth.index, np.hypot(truth["VN"], truth["VE"])
    return {
        "gnss": fixes(),
        "odometer": odometer_table(time, speed, 0.1),
        "body_velocity": body_velocity_table(time, np.outer(speed, [1.0, 0.0, 0.0]), (0.1,) * 3),
        "barometer": barometer_table(time, truth["alt"], 1.0),
        "heading": heading_table(time, truth["heading"], 1.0),
        "magnetometer": simulate_magnetometer(motion(), FieldSensor(rate=4.0), seed=9),
    }


def navigation(
    aids=(), form="ud", name="ned", model="rotation_vector", rule=None, damping="feedback"
):
    aids = aids or (Gnss(name="gnss", lever_arm=ARM),)
    sensors = (gyro_bias(GYRO_BIAS), accel_bias(ACCEL_BIAS))
    made = ERROR_MODELS[model]((GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, sensors)
    filter_ = ErrorFilter(MECHANIZATIONS[name](), made, COVARIANCES[form](), rule)
    return Navigator(with_states(filter_, aids), aids, damping=DAMPINGS[damping]())


def driving(navigator, **more):
    truth = motion().trajectory([0.0]).iloc[0]
    start = NavState.from_degrees(
        *truth[["lat", "lon", "alt"]].tolist(),
        v_n=truth[["VN", "VE", "VD"]].to_numpy(),
        roll_deg=truth["roll"],
        pitch_deg=truth["pitch"],
        heading_deg=truth["heading"],
    )
    known = KnownStart(start, (1.0,) * 3, (0.1,) * 3, (0.3, 0.3, 1.5))
    return NavigationPipeline(navigator, start=known, **more)


def in_random_pieces(chain, imu, told, recorder, seed):
    rng = np.random.default_rng(seed)
    time, values = imu.index.to_numpy(), imu[[*GYRO, *ACCEL]].to_numpy()
    recording, state = Recording(chain, recorder), chain.begin(imu.attrs["sampling"])
    edges = np.unique(np.r_[0, rng.integers(0, len(time), 12), len(time)])
    done = dict.fromkeys(told, 0)
    for first, end in pairwise(edges):
        for name, table in told.items():
            # Up to the newest sample of the piece, and a random number of rows beyond.
            upto = int((table.index <= time[end - 1] + 1e-6).sum()) + int(rng.integers(0, 3))
            rows = table.iloc[done[name] : upto]
            rows.attrs = dict(table.attrs)
            if len(rows):
                state, done[name] = chain.tell(state, name, rows), upto
        state, piece = chain.advance(state, time[first:end], values[first:end])
        recording.take(piece)
    recording.take(chain.finish(state)[1])
    return recording.run("imu")


def assert_same(one, two):
    assert_same_record(one.record, two.record)
    if one.smoothed is not None:
        assert_same_record(one.smoothed, two.smoothed)
    for x, y in zip(one.aligned, two.aligned, strict=True):
        np.testing.assert_array_equal(x.alignment.q_nb, y.alignment.q_nb)
        np.testing.assert_array_equal(x.alignment.covariance, y.alignment.covariance)


def assert_same_record(a, b):
    for name in ("trajectory", "sd", "sensors", "sensors_sd"):
        x, y = getattr(a, name), getattr(b, name)
        np.testing.assert_array_equal(x.index, y.index, err_msg=name)
        np.testing.assert_array_equal(x.to_numpy(), y.to_numpy(), err_msg=name)
    np.testing.assert_array_equal(a.covariance, b.covariance)
    assert list(a.innovations) == list(b.innovations)
    for name, table in a.innovations.items():
        np.testing.assert_array_equal(table.index, b.innovations[name].index)
        np.testing.assert_array_equal(table.to_numpy(), b.innovations[name].to_numpy())
    assert a.events == b.events
    assert a.modes == b.modes
    assert dict(a.outages) == dict(b.outages)


def assert_cuts(chain, imu, told, recorder=None, least=1):
    whole = run_batch(chain, imu, told, recorder, chunk=1e9)
    assert sum(len(table) for table in whole.record.innovations.values()) >= least
    assert_same(whole, in_random_pieces(chain, imu, told, recorder, 1))
    assert_same(whole, run_by_sample(chain, imu, told, recorder))
    return whole


def of(name):
    return {name: tables()[name]}


@pytest.mark.parametrize("name", MECHANIZATIONS)
@pytest.mark.parametrize("model", ERROR_MODELS)
def test_mechanizations_and_error_models(name, model):
    if model == "quaternions" and name != "wander_azimuth":
        pytest.skip("quaternions are states of a wander azimuth alone")
    assert_cuts(driving(navigation(name=name, model=model)), drive(), of("gnss"))


@pytest.mark.parametrize("form", COVARIANCES)
def test_covariances(form):
    assert_cuts(driving(navigation(form=form)), drive(), of("gnss"))


@pytest.mark.parametrize("rule", UPDATE_RULES)
def test_update_rules(rule):
    assert_cuts(driving(navigation(rule=UPDATE_RULES[rule]())), drive(), of("gnss"))


@pytest.mark.parametrize("damping", DAMPINGS)
def test_dampings(damping):
    assert_cuts(driving(navigation(damping=damping)), drive(), of("gnss"))


@pytest.mark.parametrize("kind", AIDS)
def test_aids(kind):
    aid = AIDS[kind](name="it")
    if isinstance(aid, ImuDerivedMeasurement):
        if kind == "no_slip":
            assert_cuts(driving(navigation(aids=(aid,))), drive(), {})
        else:
            still = NavState.from_degrees(*HERE, roll_deg=2.0, heading_deg=30.0)
            known = KnownStart(still, (1.0,) * 3, (0.01,) * 3, (0.1, 0.1, 1.0))
            assert_cuts(NavigationPipeline(navigation(aids=(aid,)), start=known), rest(), {})
    else:
        assert_cuts(driving(navigation(aids=(aid,))), drive(), {"it": tables()[kind]})


def test_aids_together_with_an_estimated_time_offset():
    aids = (
        Gnss(name="rtk", lever_arm=ARM, lever_arm_sd=0.1, time_offset_sd=0.05),
        Gnss(name="old", use_velocity=False),
        AIDS["odometer"](name="wheel"),
        AIDS["no_slip"](name="tires", mounting_sd_deg=(1.0, 2.0)),
    )
    told = {"rtk": fixes(), "old": fixes(seed=7), "wheel": tables()["odometer"]}
    assert_cuts(driving(navigation(aids=aids)), drive(), told)


@pytest.mark.parametrize("name", SMOOTHERS)
def test_smoothers(name):
    navigator = replace(navigation(), smoother=SMOOTHERS[name]())
    whole = assert_cuts(driving(navigator), drive(), of("gnss"))
    assert whole.smoothed.sd["heading"].iloc[0] < whole.record.sd["heading"].iloc[0]


@pytest.mark.parametrize("name", RECORDERS)
def test_recorders(name):
    whole = assert_cuts(driving(navigation()), drive(), of("gnss"), RECORDERS[name]())
    if name == "full":
        assert len(whole.record.trajectory) == len(drive()) - 1


SENSORS = ImuUncertainty(
    TriadUncertainty(bias=5e-8, noise_density=1e-6), TriadUncertainty(bias=2e-4, noise_density=1e-4)
)
OPTIONS = {
    "known_heading": {"heading_deg": 30.0, "sd_deg": 1.0},
    "gnss_course": {"least_speed": 2.0},
}


def standing(modes, prefilter=None, **more):
    sensors = (gyro_bias(5e-8), accel_bias(2e-4), gyro_drift(1e-8, 1000.0))
    model = ERROR_MODELS["rotation_vector"]((1e-6,) * 3, (1e-4,) * 3, sensors)
    filter_ = ErrorFilter(MECHANIZATIONS["wander_azimuth"](), model, COVARIANCES["ud"]())
    aids = (Gnss(name="gnss"),)
    return NavigationPipeline(
        Navigator(with_states(filter_, aids), aids),
        ImuPreprocessor(prefilter=prefilter),
        modes,
        sensors=SENSORS,
        **more,
    )


def standing_fixes():
    time = np.r_[0.4:20.0:1.0, 35.003:44.0:1.0]
    n = len(time)
    return {"gnss": gnss_table(time, np.tile(HERE, (n, 1)), np.zeros((n, 3)), (1,) * 3, (0.1,) * 3)}


@pytest.mark.parametrize("name", [*COARSE_ALIGNMENTS, "backtrack"])
def test_coarse_alignments(name):
    if name == "backtrack":
        way = COARSE_ALIGNMENTS["gnss_course"](least_speed=2.0, backtrack=True)
    else:
        way = COARSE_ALIGNMENTS[name](**OPTIONS.get(name, {}))
    if way.name == "gnss_course":
        chain = driving(navigation())
        until = Until(10.0, heading_sd_deg=8.0)
        modes = (CoarseMode(way=way, until=until, window=3.0), Navigation())
        sensors = ImuUncertainty(
            TriadUncertainty(bias=GYRO_BIAS, noise_density=GYRO_NOISE),
            TriadUncertainty(bias=ACCEL_BIAS, noise_density=ACCEL_NOISE),
        )
        chain = replace(chain, start=None, modes=modes, sensors=sensors)
        whole = assert_cuts(chain, drive(), of("gnss"))
        assert whole.record.modes[0].end < LENGTH - 0.5
        return
    modes = (CoarseMode(way=way, until=Until(30.0)), Navigation())
    assert_cuts(standing(modes, site=Site(*HERE)), rest(), standing_fixes())


def two_modes(**fine):
    coarse = CoarseMode(way=COARSE_ALIGNMENTS["two_vector"](), until=Until(8.0))
    return coarse, FineMode(way=FineAlignment(), until=Until(**fine)), Navigation()


@pytest.mark.slow
@pytest.mark.parametrize("name", PREFILTERS)
def test_prefilters_and_fine_alignment(name):
    prefilter = PREFILTERS[name]() if name == "none" else PREFILTERS[name](rate=25.0)
    if name == "w_d":
        prefilter = replace(prefilter, bandwidth=5.0)
    imu = rest(rate=100.0)
    # A chain refuses no lost samples before a pre-filter: it fills them.
    imu = imu.drop(imu.index[[700, *range(3200, 3206)]])
    imu.attrs = dict(rest(rate=100.0).attrs)
    assert_cuts(standing(two_modes(duration=20.0), prefilter), imu, standing_fixes())


def test_convergence_and_commands():
    coarse = (CoarseMode(way=COARSE_ALIGNMENTS["two_vector"](), until=Until(8.0)),)
    ends = Until(30.0, heading_sd_deg=2.0, tilt_sd_deg=0.1)
    whole = assert_cuts(
        standing((*coarse, FineMode(until=ends), Navigation())), rest(), standing_fixes()
    )
    assert 18.0 <= whole.record.modes[1].end < 38.0
    commands = (Command(5.0, "next"), Command(25.013, "navigation"))
    commanded = standing(two_modes(duration=30.0), commands=commands)
    whole = assert_cuts(commanded, rest(), standing_fixes())
    assert [round(mode.end, 2) for mode in whole.record.modes[:2]] == [5.0, 25.02]


def test_a_long_gap_aligns_anew():
    imu = rest()
    kept = imu[(imu.index < 15.0) | (imu.index > 17.0)]
    kept.attrs = dict(imu.attrs)
    modes = (CoarseMode(way=COARSE_ALIGNMENTS["two_vector"](), until=Until(12.0)), Navigation())
    chain = standing(modes)
    smoothed = replace(chain.navigator, smoother=SMOOTHERS["rts"]())
    chain = replace(
        chain, navigator=smoothed, intake=ImuPreprocessor(gaps=GapPolicy(beyond="align"))
    )
    whole = assert_cuts(chain, kept, standing_fixes())
    assert [mode.name for mode in whole.record.modes] == [
        "coarse",
        "navigation",
        "coarse",
        "navigation",
    ]


def test_a_recorder_that_is_not_named_keeps_all():
    run = run_batch(driving(navigation()), drive(), of("gnss"))
    assert_same(run, run_batch(driving(navigation()), drive(), of("gnss"), FullRecorder()))
