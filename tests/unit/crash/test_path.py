"""The path of a crash: exact samples give the truth, and small errors grow as they should."""

from __future__ import annotations

import mmap
import sys
import tempfile
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded
from tests.resident import resident
from tests.unit.crash.crash_case import RATE, prepared

from strapdown import rotation
from strapdown._kernels.crash_errors import perturbed_runs
from strapdown.crash import case as crash_case
from strapdown.crash import path as crash_path
from strapdown.crash.combine_units import combine_effects
from strapdown.crash.delta_v_bound import resolved_delta_v_bound
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import unit_effects
from strapdown.crash.path import PLACE, VELOCITY, reconstruct_path, sample_paths
from strapdown.errors import ConfigError, DataError
from strapdown.report.crash_document import attitude_chart
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.lever_arm import move_unit
from strapdown.sensors.pre_crash import Levelling
from strapdown.simulation import ImuErrors, simulate_imu
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.earth_motion import Origin
from strapdown.tables import ACCEL, GYRO, NED, on_disk

IMPACT = 2.0
LENGTH = 0.113
CHANGE = (-7.2, -0.9, 0.3)
TURN = (4.0, -6.0, 87.0)
WINDOW = (-0.1, 0.75)


def crash(velocity=(7.1, 0.0, 0.0), *, rate=RATE, change=CHANGE, turn=TURN):
    """A vehicle at constant velocity that is struck at time zero, and exact samples of it."""
    pulse = HaversinePulse(IMPACT, LENGTH, change, turn)
    motion = CrashMotion(3.0, Origin(45.0, 0.0, 0.0), velocity, (pulse,))
    imu, _ = simulate_imu(motion, ImuErrors(), rate=rate)
    imu.index = imu.index - IMPACT
    return motion, imu


def truth(motion, time):
    """Place from the impact on, m: closed form of the pulse, in the flat axes of the start.

    In a second the level turns by 1e-6 rad, which moves nothing here by a micrometre.
    """
    x = np.clip(time / LENGTH, 0.0, 1.0)
    after = np.maximum(time - LENGTH, 0.0)
    gathered = LENGTH * (0.5 * x * x + (np.cos(2 * np.pi * x) - 1) / (4 * np.pi**2)) + after
    return np.outer(time, motion.velocity) + np.outer(gathered, CHANGE)


@pytest.fixture(scope="module")
def case():
    motion, imu = crash()
    unit = prepared(imu)
    effects = unit_effects(unit, move_unit(unit, (0.0, 0.0, 0.0)), time_sd=5e-4)
    entry = Entry.from_speed(7.1, 0.05, slip_sd_deg=1.0, climb_sd=0.02)
    path = reconstruct_path(imu, effects, unit.levelling, -0.1, entry, window=WINDOW)
    return motion, imu, unit, effects, entry, path


def test_exact_samples_give_the_truth(case):
    motion, _, _, _, _, path = case
    error = path.table[NED].to_numpy() - truth(motion, path.time)
    # Chords between samples leave out dt²/12 of second derivatives, which return to zero with the
    # pulse, but for what turns meanwhile: force times angular acceleration, once from the force
    # and once from the rate. Of two haversines that is 3/8 of the product of their peaks over T.
    yaw = np.radians(TURN[2])
    step = 1.0 / RATE
    gained = 2.0 * step**2 / 12.0 * (2 * yaw / LENGTH) * (2 * abs(CHANGE[0]) / LENGTH) * 0.375
    assert np.abs(error).max() < gained * LENGTH * WINDOW[1]
    again = reconstruct_path(*_again(400.0), window=WINDOW)
    finer = again.table[NED].to_numpy() - truth(motion, again.time)
    assert np.abs(finer).max() < 0.4 * np.abs(error).max()


def _again(rate):
    _, imu = crash(rate=rate)
    unit = prepared(imu)
    return (
        imu,
        unit_effects(unit, move_unit(unit, (0, 0, 0))),
        unit.levelling,
        -0.1,
        Entry.from_speed(7.1, 0.05),
    )


def test_backward_and_forward_meet(case):
    _, imu, unit, effects, _, path = case
    # Tied to its own state 0.5 s later, the path is the same.
    row = int(np.searchsorted(path.time, 0.5))
    late = path.table.iloc[row]
    other = reconstruct_path(
        imu,
        effects,
        unit.levelling,
        None,
        Entry(
            time=float(path.time[row]),
            velocity=tuple(late[["VN", "VE", "VD"]]),
            heading_deg=float(late["heading"]),
            attitude_deg=(float(late["roll"]), float(late["pitch"])),
        ),
        window=WINDOW,
    )
    moved = path.table[NED].to_numpy() - path.table[NED].to_numpy()[row]
    # The same increments met backward. Each path is told in the level of its own entry: 3 m on,
    # that is turned by 5e-7 rad, over 3 m of path.
    assert np.abs(other.table[NED].to_numpy() - moved).max() < 3.0**2 / 6.3e6


@pytest.mark.parametrize("attitude", [False, True])
@pytest.mark.parametrize("at", [0.0557, 0.0581])
def test_an_entry_between_samples_is_carried_to_the_nearest(case, at, attitude):
    motion, imu, unit, effects, _, path = case
    # In the middle of the pulse half a sample is 0.3 m/s, and 0.1 deg of heading.
    now = motion.trajectory(np.array([IMPACT + at])).iloc[0]
    entry = Entry(
        time=at,
        velocity=(now["VN"], now["VE"], now["VD"]),
        heading_deg=now["heading"],
        attitude_deg=(now["roll"], now["pitch"]) if attitude else None,
    )
    other = reconstruct_path(imu, effects, unit.levelling, -0.1, entry, window=WINDOW)
    moved = other.table[NED].to_numpy() - truth(motion, other.time)
    moved += truth(motion, np.array([at]))
    # What chords between samples leave out of a pulse, dt²/12 of its slope, is in the velocity
    # over the rest of the path, and in the place it is linear in time.
    slope = np.pi / LENGTH * 2.0 * np.hypot(*CHANGE[:2]) / LENGTH
    assert np.abs(moved).max() < 1.5 * slope / RATE**2 / 12.0 * (WINDOW[1] + LENGTH)
    turned = other.table["heading"].to_numpy() - path.table["heading"].to_numpy()
    assert np.abs(rotation.within_half_turn(turned)).max() < 0.01
    # A scale factor that is wrong has gained its share of what was felt in between.
    (scale,) = (k for k, name in enumerate(other.names) if name == "imu1 high-g scale x")
    row = int(np.searchsorted(imu.index, other.time[other.anchor] - 1e-9))
    gained = effects.force[scale, row, 0] * (other.time[other.anchor] - at)
    assert other.start[scale, 3] == pytest.approx(gained, rel=0.1)


def test_an_entry_outside_of_the_record_is_named_and_no_window(case):
    _, imu, unit, effects, *_ = case
    with pytest.raises(
        DataError,
        check=coded(
            "crash.entry-not-within-record", quantity="entry", at=9.0, time=-2.0, time_2=1.0
        ),
    ):
        reconstruct_path(imu, effects, unit.levelling, -0.1, Entry.from_speed(7.1, 0.05, time=9.0))


@pytest.mark.slow
def test_every_unknown_grows_as_navigation_does(case):
    *_, path = case
    small = 1e-3
    largest = 0.0
    for leg in path.legs:
        unknowns = len(path.names)
        start = path.start.copy()
        sign = -1.0 if leg.backward else 1.0
        start[:, VELOCITY] *= sign
        steps = len(leg.rows)
        out = np.empty((unknowns, steps + 1, 9))
        whole = perturbed_runs(
            leg.state,
            leg.rows,
            leg.nominal,
            start,
            leg.effects,
            leg.effects.any(axis=2),
            np.zeros((6, steps)),
            small * np.eye(unknowns),
            np.zeros((unknowns, 6, steps)),
            leg.earth,
            leg.options,
            np.arange(steps + 1),
            out,
        )
        assert whole == unknowns
        out[..., VELOCITY] *= sign
        linear = leg.errors(path.start)
        scale = np.abs(path.errors).max(axis=(0, 1))
        # One standard deviation is up to 0.02 rad, so that a thousandth of it is linear to 1e-5.
        # A step turns by 0.01 rad, whose square over six is left out of how an error of the rate
        # turns the attitude; Coriolis force and the Earth's turn, 1e-4 a second, are left out. A
        # latitude is rounded by 1e-9 m a step: 1e-8 m of a thousandth of 0.1 m.
        largest = max(largest, float((np.abs(out / small - linear) / scale).max()))
    assert largest < 4e-4


def test_an_error_is_truth_less_computed(case):
    _, imu, unit, effects, entry, path = case
    # A vehicle that really is rolled by 1 deg more than it was levelled to.
    more = replace(unit.levelling, roll_deg=unit.levelling.roll_deg + 1.0)
    other = reconstruct_path(imu, effects, more, -0.1, entry, window=WINDOW)
    turned = rotation.rotation_vector_from_quaternion(
        rotation.compose(other.q_nb[-1], rotation.conjugate(path.q_nb[-1]))
    )
    k = path.names.index("vehicle levelling north")
    grown = path.errors[k, -1] * np.radians(1.0) / np.radians(unit.levelling.sd_deg)
    # Second order of a degree: 1e-4 of the turn, which is 0.017.
    assert np.allclose(turned, grown[:3], atol=3e-4)
    moved = (other.table[NED] - path.table[NED]).to_numpy()[-1]
    assert np.allclose(moved, grown[PLACE], atol=0.03 * np.abs(grown[PLACE]).max())


def test_a_bias_does_not_show_while_the_vehicle_does_not_turn():
    _, imu = crash(change=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0))
    unit = prepared(imu)
    effects = unit_effects(unit, move_unit(unit, (0, 0, 0)))
    path = reconstruct_path(imu, effects, unit.levelling, -0.1, Entry.from_speed(7.1, 0.0))
    biased = [k for k, c in enumerate(path.contributors) if c == "accelerometer bias"]
    # 0.2 m/s² over 0.75 s would be 56 mm; levelling hides it to gravity's difference from
    # 9.80665 at 45 deg (1e-6) and to the Earth's rate.
    assert np.abs(path.errors[biased][:, -1, PLACE]).max() < 1e-5
    assert np.abs(path.errors[biased][:, -1, :2]).max() > 0.02


def test_linear_covariance_and_monte_carlo_agree(case):
    *_, path = case
    runs = 4000
    samples = sample_paths(path, runs=runs, seed=3)
    ratio = np.diagonal(samples.covariance, axis1=1, axis2=2)[[0, -1]]
    linear = np.diagonal(path.covariance, axis1=1, axis2=2)[[0, -1]]
    # A variance from n runs scatters by sqrt(2/n) = 2.2 %; 18 of them, four deviations, and 2 %
    # for the second order of tilts of a degree.
    assert np.abs(ratio / linear - 1.0).max() < 4 * np.sqrt(2 / runs) + 0.02
    cross = samples.covariance[-1][6:, 6:]
    assert np.allclose(
        cross, path.covariance[-1][6:, 6:], atol=0.12 * np.abs(path.covariance[-1][6:, 6:]).max()
    )


def test_a_run_has_the_errors_of_its_draws(case):
    *_, path = case
    runs = 500
    samples = sample_paths(path, runs=runs, seed=3)
    linear = np.einsum("rp,pni->rni", samples.draws, path.errors)
    # What is left is the noise, which is not among the draws: its standard deviation by n runs to
    # 1/sqrt(2 n), four of them. Over the tenth of a second before the entry nothing else is.
    left = samples.errors[:, 0] - linear[:, 0]
    noise = np.sqrt(np.diagonal(path.noise_covariance[0]))
    assert np.abs(left.std(axis=0) / noise - 1.0).max() < 4.0 / np.sqrt(2.0 * runs)


def test_monte_carlo_does_not_know_the_cores(case):
    *_, path = case
    one = sample_paths(path, runs=200, seed=5, workers=1)
    three = sample_paths(path, runs=200, seed=5, workers=3)
    more = sample_paths(path, runs=333, seed=5)
    assert np.array_equal(one.errors, three.errors)
    assert np.array_equal(one.errors, more.errors[:200])
    assert not np.array_equal(one.errors, sample_paths(path, runs=200, seed=6).errors)
    assert len(sample_paths(path, runs=2).errors) == 2
    for runs in (1, 1_000_001):
        with pytest.raises(
            ConfigError,
            check=coded("crash.runs-out-of-range", quantity="runs", most_runs=1_000_000),
        ):
            sample_paths(path, runs=runs)


def test_runs_in_a_file_say_what_runs_in_memory_say(case, monkeypatch):
    *_, path = case
    runs = 345
    whole = sample_paths(path, runs=runs, seed=5)
    assert whole.errors.nbytes > on_disk.LARGE
    assert _base(whole.errors) is None
    errors = np.ascontiguousarray(whole.errors)
    assert errors.shape == (runs, len(path.time), 9)
    centred = errors - errors.mean(axis=0)
    covariance = np.einsum("rni,rnj->nij", centred, centred) / (runs - 1)
    assert np.array_equal(whole.covariance, covariance)
    # In memory all samples are one part; then some samples of a column, and one.
    for samples in (len(path.time), 7, 1):
        monkeypatch.setattr(on_disk, "PART", 8 * runs * samples)
        monkeypatch.setattr(crash_path, "LARGE", 1)
        monkeypatch.setattr(crash_path, "STREAMS", 2)
        filed = sample_paths(path, runs=runs, seed=5, workers=2)
        assert sys.platform != "linux" or isinstance(_base(filed.errors), mmap.mmap)
        assert np.array_equal(filed.errors, errors)
        assert np.array_equal(filed.draws, whole.draws)
        assert np.array_equal(filed.covariance, covariance)
        for share in (0.95, 0.5):
            edges = [0.5 * (1.0 - share), 1.0 - 0.5 * (1.0 - share)]
            bounds = np.quantile(errors, edges, axis=0)
            assert np.array_equal(filed.interval(share), bounds)
            assert np.array_equal(filed.interval(share, PLACE), bounds[..., PLACE])
    assert np.array_equal(filed.interval(), filed.interval(0.95))


def _base(array):
    while isinstance(array, np.ndarray):
        array = array.base
    return array


@pytest.mark.skipif(sys.platform != "linux", reason="other systems keep the runs in memory")
def test_memory_does_not_grow_with_the_runs(case, monkeypatch):
    *_, path = case
    monkeypatch.setattr(crash_path, "LARGE", 1)
    monkeypatch.setattr(crash_path, "STREAMS", 8)
    before, during = resident(), []

    def report(stage, share):
        during.append((stage, share, resident() - before))

    # A page holds 512 runs of a number, and so do 8 streams.
    samples = sample_paths(path, runs=20 * 512 + 1, seed=1, workers=1, progress=report)
    size = samples.errors.nbytes + samples.draws.nbytes
    assert [stage for stage, *_ in during] == ["drawing possible paths"] * 20
    assert [share for _, share, _ in during] == [(8 * k + 8) / 161 for k in range(20)]
    # The streams since memory was last given back are in two pages of each number at the most, and
    # the thread goes on while it is looked at.
    assert max(held for *_, held in during) < 0.25 * size
    assert resident() - before < 0.02 * size
    # What is made of them takes parts of 2 MiB: of a quantity at all samples, 14 MB.
    tracemalloc.start()
    for use in (
        samples.interval,
        lambda: samples.covariance,
        lambda: attitude_chart(path, samples=samples),
    ):
        tracemalloc.reset_peak()
        use()
        assert tracemalloc.get_traced_memory()[1] < 5 * on_disk.PART
        assert resident() - before < 0.02 * size
    tracemalloc.stop()


def test_runs_without_a_place_on_the_disk(case, monkeypatch):
    *_, path = case

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(crash_path, "LARGE", 1)
    monkeypatch.setattr(on_disk.os, "posix_fallocate", full, raising=False)
    assert _base(sample_paths(path, runs=100).errors) is None
    numbers = 9 * len(path.time) + len(path.names)
    # 100 runs are 13 lines of 8 numbers.
    size = 8 * 13 * 8 * numbers
    monkeypatch.setattr(crash_path, "MOST_IN_MEMORY", size)
    assert len(sample_paths(path, runs=100).errors) == 100
    monkeypatch.setattr(crash_path, "MOST_IN_MEMORY", size - 1)
    with pytest.raises(
        ConfigError,
        check=coded(
            "crash.runs-have-no-place",
            quantity="runs",
            runs=100,
            size=pytest.approx(1e-9 * size),
            folder=tempfile.gettempdir(),
        ),
    ):
        sample_paths(path, runs=100)


@pytest.mark.parametrize("runs", [2, 8, 100, 128, 512])
def test_numbers_of_a_run_do_not_share_places_in_a_cache(case, runs):
    *_, path = case
    apart = sample_paths(path, runs=runs).errors.strides[2]
    assert apart >= 8 * runs
    assert apart % 128 == 64


def test_a_case_draws_what_fits_in_a_file_and_says_so(case, monkeypatch):
    *_, path = case
    monkeypatch.setattr(crash_path, "STREAMS", 1)
    shares = []

    def drawn(runs):
        shares.clear()
        samples, findings = crash_case._samples(
            path, runs, 3, lambda _, share: shares.append(share)
        )
        return samples, findings

    assert drawn(0) == (None, [])
    monkeypatch.setattr(crash_case, "MOST_NUMBERS", 9 * len(path.time) * 100 + 5)
    samples, findings = drawn(100)
    assert np.array_equal(samples.errors, sample_paths(path, runs=100, seed=3).errors)
    assert findings == []
    assert shares == pytest.approx([0.4 + 0.35 * 0.5, 0.75])
    samples, (finding,) = drawn(101)
    assert len(samples.errors) == 100
    assert finding.code == "crash.runs-samples-would-need-more"
    assert finding.data == {"runs": 101, "count": len(path.time), "most": 100}


def test_effects_are_added_in_the_order_of_the_unknowns(case):
    *_, path = case
    leg, runs = path.legs[1], 3
    rng = np.random.default_rng(2)
    steps, unknowns = len(leg.rows), 6
    start, draws = 1e-3 * rng.normal(size=(unknowns, 9)), rng.normal(size=(runs, unknowns))
    effects = 1e-3 * rng.normal(size=(unknowns, 6, steps))
    noise = rng.normal(size=(runs, 6, steps)).astype(np.float32)
    used = np.ones((unknowns, 6), dtype=bool)
    # None, one, two, three, five and six of them.
    for j, unused in enumerate([range(6), [1, 2, 3, 4, 5], [0, 2, 3, 5], [1, 2, 4], [3], []]):
        used[list(unused), j] = False

    def navigated(start, effects, used, noise_sd, draws, noise):
        out = np.empty((len(draws), steps + 1, 9))
        state, rows, nominal = leg.state, leg.rows, leg.nominal
        known = (leg.earth, leg.options, np.arange(steps + 1))
        about = (start, effects, used, noise_sd, draws, noise, *known, out)
        assert perturbed_runs(state, rows, nominal, *about) == len(draws)
        return out

    found = navigated(start, effects, used, leg.noise_sd, draws, noise)
    for run in range(runs):
        first, added = np.zeros((1, 9)), leg.noise_sd * noise[run]
        for p in range(unknowns):
            first[0] += draws[run, p] * start[p]
            added += np.where(used[p, :, None], draws[run, p] * effects[p], 0.0)
        # The sums themselves, as one unknown of the start and as a noise.
        one = np.ones((1, 6, steps), dtype=np.float32)
        nothing = np.zeros((1, 6, steps)), np.zeros((1, 6), dtype=bool)
        alone = navigated(first, *nothing, added, np.ones((1, 1)), one)
        assert np.array_equal(found[run], alone[0])


def test_noise_alone(case):
    _, imu, unit, effects, _, _ = case
    silent = replace(
        effects,
        names=(),
        contributors=(),
        force=effects.force[:0],
        rate=effects.rate[:0],
        rest_force=effects.rest_force[:0],
        tilt=effects.tilt[:0],
    )
    level = replace(unit.levelling, sd_deg=0.0)
    path = reconstruct_path(imu, silent, level, -0.1, Entry.from_speed(7.1, 0.0), window=WINDOW)
    samples = sample_paths(path, runs=4000, seed=1)
    have = np.diagonal(samples.covariance, axis1=1, axis2=2)[-1]
    want = np.diagonal(path.covariance, axis1=1, axis2=2)[-1]
    assert np.abs(have / want - 1.0).max() < 4 * np.sqrt(2 / 4000)


@pytest.mark.parametrize("at", [-0.05, 0.05, 0.3])
def test_noise_of_a_change_before_after_and_about_the_entry(case, at):
    _, imu, unit, effects, *_ = case
    silent = replace(
        effects,
        names=(),
        contributors=(),
        force=effects.force[:0],
        rate=effects.rate[:0],
        rest_force=effects.rest_force[:0],
        tilt=effects.tilt[:0],
        # So that what the gyros do to the attitude shows beside the noise of the force.
        rate_noise=np.full_like(effects.rate_noise, 0.02),
    )
    stated = Entry(at, (2.0, 0.0, 0.0), 0.0, attitude_deg=(0.0, 0.0))
    path = reconstruct_path(imu, silent, unit.levelling, None, stated, window=WINDOW)
    runs = sample_paths(path, runs=4000, seed=2).errors[:, :, VELOCITY]
    first, last = np.searchsorted(path.time, [-1e-9, 0.1 - 1e-9])
    have = (runs[:, last] - runs[:, first]).std(axis=0)
    bound = resolved_delta_v_bound(path, float(path.time[first]), float(path.time[last]))
    # Standard deviations of 4000 runs are known to 1/sqrt(8000) each.
    assert np.abs(have / bound.sd - 1.0).max() < 4 / np.sqrt(8000)


def test_shares_add_up(case):
    *_, path = case
    total = path.variances().sum().to_numpy()
    assert np.allclose(total, np.diagonal(path.covariance[-1]), rtol=1e-12)
    assert path.variances()["north"].idxmax() == "scale factor"  # as theory says of the paper's


def test_combining_a_unit_with_itself_changes_nothing(case):
    _, _, _, effects, _, _ = case
    twice = combine_effects([effects, effects], [0.5, 0.5])
    assert twice.names == effects.names
    assert np.allclose(twice.force, effects.force)
    assert np.allclose(twice.force_noise, effects.force_noise / np.sqrt(2.0))


def test_speed_from_standing_still():
    pulses = (
        HaversinePulse(1.0, 1.5, (5.0, 0.0, 0.0)),
        HaversinePulse(3.0, LENGTH, CHANGE, TURN),
    )
    motion = CrashMotion(4.0, Origin(45.0, 0.0, 0.0), (0.0, 0.0, 0.0), pulses)
    imu, _ = simulate_imu(motion, ImuErrors(), rate=RATE)
    imu.index = imu.index - 3.0
    unit = prepared(imu, mounting=Mounting(), rest=(-2.9, -2.1))
    unit = replace(unit, levelling=Levelling(0.0, 0.0, 0.0, True))
    effects = unit_effects(unit, move_unit(unit, (0, 0, 0)))
    path = reconstruct_path(imu, effects, unit.levelling, -2.1, None, window=(0.0, 0.75))
    assert path.entry.velocity[0] == pytest.approx(5.0, abs=1e-4)
    # Scale of 1 % of the speed; the bias of 0.2 m/s² is hidden by the levelling; all others are
    # smaller: misalignment 0.5 % of gravity is, too.
    assert 0.04 < path.sd["VN"].iloc[0] < 0.08


def test_what_cannot_be_is_told(case):
    _, imu, unit, effects, entry, _ = case
    with pytest.raises(DataError, check=coded("crash.window-partly-in-record")):
        reconstruct_path(imu, effects, unit.levelling, -0.1, entry, window=(-0.1, 5.0))
    with pytest.raises(DataError, check=coded("crash.entry-speed-unknown", quantity="entry speed")):
        reconstruct_path(imu, effects, unit.levelling, None, None, window=WINDOW)
    with pytest.raises(
        DataError, check=coded("crash.vehicle-levelled-after-entry", quantity="entry")
    ):
        reconstruct_path(imu, effects, unit.levelling, 0.1, entry, window=WINDOW)
    with pytest.raises(ConfigError, match="km/h"):
        Entry.from_speed(200.0, 1.0)
    with pytest.raises(ConfigError, check=coded("crash.not-possible")):
        Entry.from_speed(20.0, -1.0)
    assert imu[[*GYRO, *ACCEL]].notna().all().all()
