"""Many cases in one call are those of the single runs, and agree with linear propagation."""

from __future__ import annotations

import math
import pickle
import tracemalloc
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.campaign.bulk import BulkCrash, bulk_attitude, bulk_outage
from strapdown.config.outage import OutageSpec
from strapdown.config.sources import ScenarioSpec
from strapdown.crash import Entry, sample_paths
from strapdown.crash.path import PLACE, VELOCITY
from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
from strapdown.errors import ConfigError
from strapdown.increments import increments_from_imu
from strapdown.rotation import unit_rotation_angle
from strapdown.sensors.catalogue import SENSORS
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import simulate_imu
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.systems.outage_run import run_outage
from strapdown.systems.trajectory_source import scenario_of
from strapdown.tables import NED, QUATERNION

# Cases of an agreement, and how far a standard deviation of so many may be from the true one: four
# standard deviations of it, of a normal number 1 / sqrt(2 n).
CASES = 4096
SAMPLING = 4.0 / math.sqrt(2.0 * CASES)


@pytest.fixture(scope="module")
def crash():
    motion = find_crash("frontal")
    design = next(d for d in paper_units() if d.gyro is not None)
    unit, _ = record_crash(motion.motion, design, impact=motion.impacts[0], seed=1)
    entry = Entry.from_speed(17.0, 0.2, slip_sd_deg=1.0)
    made = reconstruct_crash([unit], entry, CrashOptions(window=(-0.05, 0.3)))
    return BulkCrash(made.main, 5)


def _attitude(sensor, *, scenario="gestures", sampling="instantaneous", algorithm="quaternion"):
    spec = ScenarioSpec(name=scenario, sampling=sampling)
    return bulk_attitude(spec, str(sensor), algorithm, seed=3)


SPEC = OutageSpec(
    outage_s=40.0, sensor="icm-42688-p", start={"aided_s": 0.0}, motion={"speed_m_per_s": 15.0}
)
RANGES = {
    "outage_s": (5.0, 60.0),
    "speed_m_per_s": (5.0, 40.0),
    "heading_sd_deg": (0.1, 4.0),
    "gyro_bias_sd_deg_per_h": (1.0, 200.0),
    "gyro.noise_density": (0.5, 2.0),
    "accel.bias": (0.2, 1.5),
    "accel.bias_instability": (0.5, 2.0),
    "accel.scale": (0.0, 3.0),
}


@pytest.fixture(scope="module")
def outage():
    return bulk_outage(SPEC, RANGES, seed=4)


def _cases(request, name):
    return _attitude("bmi160") if name == "attitude" else request.getfixturevalue(name)


# What all three promise.


@pytest.mark.parametrize("name", ["crash", "attitude", "outage"])
def test_a_case_is_the_same_however_the_cases_are_cut(request, name):
    cases = _cases(request, name)
    whole = cases.run(0, 200)
    assert whole.shape == (200, len(cases.scalars))
    assert np.isfinite(whole).all()
    for low, high in pairwise([0, 1, 37, 64, 128, 190, 200]):
        assert np.array_equal(cases.run(low, high), whole[low:high])
    assert len(cases.run(7, 7)) == 0
    assert len(np.unique(whole[:, 0])) == 200


@pytest.mark.parametrize("name", ["crash", "attitude", "outage"])
def test_another_process_gets_the_same_cases_and_another_seed_does_not(request, name):
    cases = _cases(request, name)
    again = pickle.loads(pickle.dumps(cases))
    assert np.array_equal(again.run(60, 70), cases.run(60, 70))
    assert not np.isclose(replace(cases, seed=9).run(60, 70), cases.run(60, 70)).all(axis=1).any()


@pytest.mark.parametrize("name", ["crash", "attitude", "outage"])
def test_memory_is_that_of_one_stream(request, name):
    cases = _cases(request, name)
    cases.run(0, 64)

    def peak(count):
        tracemalloc.start()
        out = cases.run(0, count)
        most = tracemalloc.get_traced_memory()[1] - out.nbytes
        tracemalloc.stop()
        return most

    one = peak(64)
    # Beside what is returned, at most what a second stream begins before the first is let go.
    assert peak(1280) < 2.2 * one
    assert one < 64e6


@pytest.mark.parametrize("name", ["crash", "attitude"])
def test_linear_and_drawn_standard_deviations_agree(request, name):
    cases = request.getfixturevalue(name) if name == "crash" else _attitude("hg1700")
    found = dict(zip(cases.scalars, cases.run(0, CASES).T, strict=True))
    assert set(cases.linear_sd) <= set(cases.nominal) == set(found)
    for scalar, linear in cases.linear_sd.items():
        ratio = found[scalar].std(ddof=1) / linear
        # Of sizes that are small enough the second order adds less than a hundredth.
        assert ratio == pytest.approx(1.0, abs=SAMPLING + 0.01), scalar
        off = found[scalar].mean() - cases.nominal[scalar]
        assert abs(off) < (4.0 / math.sqrt(CASES) + 0.02) * linear, scalar


# Crashes.


def test_crashes_end_where_the_sampled_paths_do(crash):
    path = crash.unit.path
    samples = sample_paths(path, runs=100, seed=crash.seed)
    found = dict(zip(crash.scalars, crash.run(0, 100).T, strict=True))
    end = path.table.iloc[-1]
    for k, axis in enumerate(NED):
        place = end[axis] + samples.errors[:, -1, PLACE][:, k]
        assert np.array_equal(found[f"end_{axis}_m"], place)
        speed = end[f"V{axis[0].upper()}"] + samples.errors[:, -1, VELOCITY][:, k]
        assert np.array_equal(found[f"end_velocity_{axis}_m_per_s"], speed)
    turned = [
        rotation.euler_from_quaternion(
            rotation.compose(rotation.quaternion_from_rotation_vector(phi), path.q_nb[-1])
        )[2]
        for phi in samples.errors[:, -1, :3]
    ]
    away = (found["end_heading_deg"] - turned + 180.0) % 360.0 - 180.0
    assert np.abs(away).max() < 1e-10


def test_delta_v_is_drawn_with_the_covariance_of_its_bound(crash):
    each, by_sample, root = crash._effects
    noise = sum(weights @ weights.T for weights in by_sample)
    bound = crash.unit.delta_v.bound.covariance
    # The noise of the axes is independent.
    noise = np.diag(np.diag(noise))
    assert np.allclose(each.T @ each + noise + root @ root.T, bound, rtol=0, atol=1e-9)
    found = dict(zip(crash.scalars, crash.run(0, 64).T, strict=True))
    assert np.allclose(found["delta_v_total_km_per_h"], 3.6 * found["delta_v_total_m_per_s"])
    # From the front: the clock direction is near zero, not beside a full turn.
    assert np.abs(found["pdof_deg"]).max() < 20.0
    across = np.degrees(
        np.arctan2(-found["delta_v_right_m_per_s"], -found["delta_v_forward_m_per_s"])
    )
    assert np.allclose(found["pdof_deg"], across)


def test_delta_v_and_path_take_the_same_noise(crash):
    unit, path = crash.unit, crash.unit.path
    quiet_legs = tuple(replace(one, noise_sd=np.zeros_like(one.noise_sd)) for one in path.legs)
    effects = replace(
        unit.at_point.effects, force_noise=np.zeros_like(unit.at_point.effects.force_noise)
    )
    quiet = BulkCrash(
        replace(
            unit,
            path=replace(path, legs=quiet_legs),
            at_point=replace(unit.at_point, effects=effects),
        ),
        crash.seed,
    )
    # The rest is drawn in proportion to another root without the noise beyond the path: none here.
    assert np.allclose(quiet._effects[2], crash._effects[2])
    names = crash.scalars
    k = [names.index("delta_v_forward_m_per_s"), names.index("delta_v_right_m_per_s")]
    by_body = (crash.run(0, 192) - quiet.run(0, 192))[:, k]
    runs = {"runs": 192, "seed": crash.seed}
    noise = sample_paths(path, **runs).errors - sample_paths(quiet.unit.path, **runs).errors
    change = unit.delta_v.delta_v
    rows = [int(np.argmin(np.abs(path.time - t))) for t in (change.start, change.end)]
    level = noise[:, rows[1], VELOCITY] - noise[:, rows[0], VELOCITY]
    body = rotation.rotate(rotation.conjugate(path.q_nb[rows[1]]), level)[:, :2]
    # All but the samples at the ends of the window, which are not on its stamps, and what the
    # gyro's noise turns.
    steps = rows[1] - rows[0]
    left = (body - by_body).std(axis=0) / by_body.std(axis=0)
    assert (left < 3.0 / math.sqrt(steps)).all()


# Attitude.


BARE = """
title = "constants alone"
class = "industrial"
summary = "for a test"
[gyro]
bias_sd_deg_per_h = { value = 400.0, assumed = "a test" }
scale_bound_ppm = { value = 5000.0, assumed = "a test" }
misalignment_sd_mrad = { value = 4.0, assumed = "a test" }
g_sensitivity_sd_deg_per_h_per_g = { value = 300.0, assumed = "a test" }
nonlinearity_bound_ppm = { value = 3000.0, assumed = "a test" }
full_scale_deg_per_s = { value = 300.0, assumed = "a test" }
quantization_deg_per_s = { value = 0.05, assumed = "a test" }
bandwidth_hz = { value = 40.0, assumed = "a test" }
trend_deg_per_h_per_h = { value = 900.0, assumed = "a test" }
"""


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("algorithm", ["quaternion", "rotvec:samples=3", "dcm", "naive"])
def test_a_unit_is_integrated_as_a_single_run(tmp_path, sampling, algorithm):
    from strapdown.campaign.bulk import _generator, _units

    file = tmp_path / "bare.toml"
    file.write_text(BARE)
    cases = _attitude(file, sampling=sampling, algorithm=algorithm)
    found = cases.run(64, 128)
    units = _units(cases._errors, cases._spreads, _generator(cases.seed, 1))
    motion = scenario_of(ScenarioSpec(name="gestures")).motion
    for k in (0, 17):
        own = units[k]
        errors = TriadErrors(
            bias=tuple(own[:, 9]),
            scale=tuple(own[:, 6]),
            misalignment=own[:, :3] - np.eye(3),
            g_sensitivity=own[:, 3:6],
            nonlinearity_2=tuple(own[:, 7]),
            nonlinearity_3=tuple(own[:, 8]),
            full_scale=cases._errors.full_scale,
            quantization=cases._errors.quantization,
            bandwidth=cases._errors.bandwidth,
            trend=cases._errors.trend,
        )
        imu, truth = simulate_imu(motion, ImuErrors(errors), rate=100.0, sampling=sampling)
        known = truth[QUATERNION].to_numpy()
        made = run_attitude(make_algorithm(algorithm), increments_from_imu(imu), known[0])
        q = made.attitude[QUATERNION].to_numpy()
        angles = unit_rotation_angle(known, q)
        # A quantum may fall to the other side by rounding: half a step of one sample.
        close = {"abs": 1e-6 + np.degrees(0.05 * math.pi / 180 / 100)}
        assert found[k, 0] == pytest.approx(angles[-1], **close)
        assert found[k, 1] == pytest.approx(angles.max(), **close)
        away = rotation.euler_from_quaternion(q[-1]) - rotation.euler_from_quaternion(known[-1])
        away = (away + 180.0) % 360.0 - 180.0
        assert np.allclose(found[k, 2:], away, atol=close["abs"])


@pytest.mark.parametrize(
    "figure",
    [
        "noise_density_deg_per_sqrt_h = { value = 0.3, assumed = 'a test' }",
        "bias_instability_deg_per_h = { value = 60.0, assumed = 'a test' }\n"
        "correlation_time_s = { value = 8.0, assumed = 'a test' }",
        "random_walk_deg_per_h_per_sqrt_h = { value = 200.0, assumed = 'a test' }",
        "bias_bound_deg_per_h = { value = 60.0, assumed = 'a test' }",
        "scale_sd_ppm = { value = 500.0, assumed = 'a test' }",
        "misalignment_sd_mrad = { value = 0.5, assumed = 'a test' }",
        "g_sensitivity_sd_deg_per_h_per_g = { value = 60.0, assumed = 'a test' }",
    ],
)
def test_each_error_alone_grows_as_linear_propagation_says(tmp_path, figure):
    file = tmp_path / "one.toml"
    head = "title = 'one'\nclass = 'industrial'\nsummary = 'a test'\n[gyro]\n"
    file.write_text(head + figure + "\n")
    cases = _attitude(file)
    found = cases.run(0, CASES)[:, 2:]
    linear = np.array([cases.linear_sd[name] for name in cases.scalars[2:]])
    # A gap between few constants of a uniform or normal number is no looser.
    assert np.allclose(found.std(axis=0, ddof=1) / linear, 1.0, atol=SAMPLING + 0.005)
    # And as units that are simulated one by one, of which there are fewer.
    motion = scenario_of(ScenarioSpec(name="gestures")).motion
    ends = []
    for seed in range(200):
        unit = cases.sensor.draw(seed)
        imu, truth = simulate_imu(motion, unit, rate=100.0, seed=seed)
        known = truth[QUATERNION].to_numpy()
        made = run_attitude(cases.algorithm, increments_from_imu(imu), known[0])
        last = made.attitude[QUATERNION].to_numpy()[-1]
        ends.append(
            rotation.euler_from_quaternion(last) - rotation.euler_from_quaternion(known[-1])
        )
    ends = (np.array(ends) + 180.0) % 360.0 - 180.0
    assert np.allclose(ends.std(axis=0, ddof=1) / linear, 1.0, atol=4.0 / math.sqrt(400.0))


def test_the_nominal_unit_has_the_errors_of_the_algorithm_alone():
    cases = _attitude("bmi160", sampling="mean", algorithm="rotvec:samples=2")
    imu, truth = simulate_imu(
        scenario_of(ScenarioSpec(name="gestures")).motion, ImuErrors(), rate=100.0, sampling="mean"
    )
    known = truth[QUATERNION].to_numpy()
    made = run_attitude(cases.algorithm, increments_from_imu(imu), known[0])
    angles = unit_rotation_angle(known, made.attitude[QUATERNION].to_numpy())
    assert cases.nominal["end_error_deg"] == pytest.approx(angles[-1], rel=1e-6)
    assert cases.nominal["largest_error_deg"] == pytest.approx(angles.max(), rel=1e-6)


def test_jitter_is_refused(tmp_path):
    file = tmp_path / "late.toml"
    file.write_text(BARE + "jitter_us = { value = 5.0, assumed = 'a test' }\n")
    with pytest.raises(ConfigError, check=coded("campaign.bulk-without-jitter")):
        _attitude(file)


# Predicted drifts.


def _spec(parameters):
    start = {key: float(v) for key, v in parameters.items() if key in type(SPEC.start).model_fields}
    return OutageSpec(
        outage_s=float(parameters["outage_s"]),
        sensor=SPEC.sensor,
        start={"aided_s": 0.0, **start},
        motion={"speed_m_per_s": float(parameters["speed_m_per_s"])},
    )


def _predicted(parameters, monkeypatch):
    """The prediction of `run_outage` itself, with the figures of the sensor multiplied."""
    from strapdown.systems import outage_run

    sensors = outage_run.sensor_of(SPEC.sensor)
    for key, factor in parameters.items():
        if "." not in key:
            continue
        triad, name = key.split(".")
        name, triad = {
            "bias_instability": ("sd", f"{triad}_drift"),
            "random_walk": ("walk", f"{triad}_drift"),
        }.get(name, (name, triad))
        part = getattr(sensors, triad)
        value = tuple(factor * x for x in getattr(part, name))
        sensors = replace(sensors, **{triad: replace(part, **{name: value})})
    monkeypatch.setattr(outage_run, "sensor_of", lambda _: sensors)
    made = run_outage(_spec(parameters)).forecast
    return np.array([made.bound[-1], made.sd("speed")[-1], np.degrees(made.sd("heading")[-1])])


@pytest.mark.parametrize("case", [0, 5, 63])
def test_a_predicted_drift_is_that_of_a_single_run(outage, monkeypatch, case):
    drawn = outage.drawn(0)
    assert np.array_equal(outage.of(drawn), outage.run(0, 64))
    # A single run ends at the last of its samples at 50 Hz.
    drawn[:, 0] = np.round(drawn[:, 0] / 0.02) * 0.02
    parameters = dict(zip(outage.parameters, drawn[case], strict=True))
    # Of the polynomial over speed and the spline over time.
    assert np.allclose(outage.of(drawn)[case], _predicted(parameters, monkeypatch), rtol=1e-7)


def test_without_length_and_speed_a_drift_is_exact(monkeypatch):
    few = {key: RANGES[key] for key in ("heading_sd_deg", "gyro.noise_density", "accel.bias")}
    cases = bulk_outage(SPEC, few, seed=1)
    parameters = dict(zip(cases.parameters, cases.drawn(0)[9], strict=True))
    expected = _predicted(
        {**parameters, "outage_s": SPEC.outage_s, "speed_m_per_s": 15.0}, monkeypatch
    )
    # Sums of a covariance of condition 1e8 in double precision.
    assert np.allclose(cases.run(9, 10)[0], expected, rtol=1e-8)


def test_the_nominal_drift_and_the_linear_spread(outage):
    made = run_outage(
        _spec({"outage_s": 40.0, "speed_m_per_s": 15.0, "gyro_bias_sd_deg_per_h": 100.5})
    )
    assert outage.nominal["horizontal_95_m"] == pytest.approx(made.forecast.bound[-1], rel=2e-5)
    small = {key: (0.99 * v, 1.01 * v) for key, v in zip(RANGES, outage._middle, strict=True)}
    cases = bulk_outage(SPEC, small, seed=2)
    found = cases.run(0, CASES)
    for k, name in enumerate(cases.scalars):
        # A sum of uniform numbers has less of a tail than a normal one.
        assert found[:, k].std(ddof=1) / cases.linear_sd[name] == pytest.approx(1.0, abs=SAMPLING)


@pytest.mark.parametrize(
    ("changed", "ranges", "code"),
    [
        ({"start": {"aided_s": 600.0}}, {}, "campaign.bulk-outage-with-measurements"),
        ({"aiding": {"odometer": {}}}, {}, "campaign.bulk-outage-with-measurements"),
        ({"sensor": None}, {}, "outage.nothing-says-sensor"),
        ({}, {"gyro.colour": (1.0, 2.0)}, "campaign.bulk-outage-nothing-varies"),
        ({}, {"outage_s": (0.0, 2.0)}, "campaign.bulk-not-a-range"),
        ({}, {"gyro.bias": (2.0, 1.0)}, "campaign.bulk-not-a-range"),
        (
            {"motion": {"speed_m_per_s": 1.0, "to_speed_m_per_s": 9.0}},
            {"outage_s": (10.0, 20.0)},
            "campaign.bulk-outage-changes-speed",
        ),
    ],
)
def test_what_many_drifts_cannot_share_is_refused(changed, ranges, code):
    given = {
        "outage_s": 40.0,
        "sensor": "icm-42688-p",
        "start": {"aided_s": 0.0},
        "motion": {"speed_m_per_s": 15.0},
    }
    with pytest.raises(ConfigError, check=coded(code)):
        bulk_outage(OutageSpec(**{**given, **changed}), ranges or {"gyro.bias": (0.5, 2.0)})


def test_every_gyro_of_the_catalogue_is_drawn():
    scenario = ScenarioSpec(name="gesture", rate_hz=50.0)
    for name in SENSORS:
        assert np.isfinite(bulk_attitude(scenario, name).run(0, 3)).all(), name
