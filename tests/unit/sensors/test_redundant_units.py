"""Units that vote: who failed, from when, and what the others tell."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from tests.coded import coded
from tests.sensor_faults import (
    Dead,
    DropOut,
    Jump,
    Noisy,
    Saturated,
    Stuck,
    inject_faults,
)

from strapdown.errors import ConfigError, DataError
from strapdown.rotation import dcm_from_euler
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.error_chain import apply, child
from strapdown.sensors.redundant_units import (
    AxisErrors,
    AxisVoting,
    MountedUnit,
    UnitVoting,
    VotingRule,
    isolable_axes,
    parity_matrix,
    vote_units,
)
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty
from strapdown.simulation import ImuErrors, SmoothRandom, simulate_imu
from strapdown.tables import ACCEL, GYRO, imu_table

RATE = 100.0
GRADES = ("mpu-6050", "adis16448", "stim300", "hg1700", "hg9900", "fog-1000")
BOTH = tuple(name for name in SENSORS if {"gyro", "accel"} <= set(load_sensor(name).rates))
MOTION = SmoothRandom(duration=100.0, seed=1, rms_rate=20.0, rms_acceleration=1.0, band=(0.1, 2.0))


@functools.cache
def truth():
    return simulate_imu(MOTION, ImuErrors(), rate=RATE, sampling="mean")[0]


@functools.cache
def readings(name, unit):
    # On the true means, without the low-pass, which all units share and whose integrals are slow.
    errors, true = load_sensor(name).draw(unit), truth()
    force = true[ACCEL].to_numpy()
    values = [
        apply(e, true.index, true[c], sampling="mean", seed=child(unit, k), sampled=True, **more)
        for k, (e, c, more) in enumerate(
            [(errors.gyro, GYRO, {"specific_force": force}), (errors.accel, ACCEL, {})]
        )
    ]
    return imu_table(true.index, *values, sampling="mean")


def units(name, count=3):
    uncertainty = ImuUncertainty.of_sensor(load_sensor(name))
    mounted = [MountedUnit("ABCD"[k], uncertainty) for k in range(count)]
    return mounted, {u.name: readings(name, k) for k, u in enumerate(mounted)}


def sd_of(mounted, channel):
    u = mounted[0].uncertainty
    triad = u.gyro if channel.startswith("gyro") else u.accel
    axis = "xyz".index(channel[-1])
    noise, step = triad.axis("noise_density")[axis], triad.axis("quantization")[axis]
    return float(np.hypot(noise * np.sqrt(RATE), step / np.sqrt(12.0)))


@pytest.mark.slow
@pytest.mark.parametrize("name", BOTH)
def test_sound_units_of_every_grade_do_not_disagree(name):
    # 1e-3 an hour and 100 s: 3e-5 for each vote, were all errors as stated; a bound of a data
    # sheet is a uniform distribution and stays further within.
    for count in (2, 3):
        mounted, tables = units(name, count)
        voted = vote_units(mounted, tables)
        assert voted.events == ()
        assert voted.used.to_numpy().all()


@pytest.mark.parametrize("name", GRADES)
@pytest.mark.parametrize("channel", ["gyro_x", "accel_z"])
def test_three_units_name_the_channel_that_fails(name, channel):
    mounted, tables = units(name)
    sd = sd_of(mounted, channel)
    triad = mounted[0].uncertainty.gyro if channel == "gyro_x" else mounted[0].uncertainty.accel
    # What a jump must exceed: noise, and what a scale factor and a cross-axis term make of a
    # motion of 1 rad/s or 20 m/s² since the comparison. Six times each is beyond chi-square 54.
    reach = 1.0 if channel == "gyro_x" else 20.0
    shift = 10.0 * sd + 10.0 * reach * max(*triad.axis("scale"), *triad.axis("misalignment"))
    shift += 40.0 * max(triad.axis("g_sensitivity")) + 0.05 * reach
    for fault in (
        Jump(channel, 60.0, size=shift),
        Dead(channel, 60.0),
        Stuck(channel, 60.0),
        Noisy(channel, 60.0, sd=5.0 * shift),
    ):
        broken = tables | {"B": inject_faults(tables["B"], [fault], seed=2)}
        voted = vote_units(mounted, broken)
        assert [(e.kind, e.channels) for e in voted.events] == [("excluded", (f"B.{channel}",))]
        (event,) = voted.events
        # Two time constants of the slow window at most; a dead or stuck channel shows as soon as
        # the motion has left its value.
        assert 60.0 <= event.time <= 70.0
        assert event.since <= event.time
        assert "of unit B excluded" in event.finding.what
        assert not voted.used[f"B.{channel}"].loc[event.time + 0.02 :].any()


def test_the_mean_of_three_and_its_noise():
    mounted, tables = units("fog-1000")
    voted = vote_units(mounted, tables)
    uncertainty = UnitVoting(mounted, RATE).uncertainty()
    one = mounted[0].uncertainty
    for fused, own in ((uncertainty.gyro, one.gyro), (uncertainty.accel, one.accel)):
        assert np.allclose(fused.axis("bias"), np.array(own.axis("bias")) / np.sqrt(3.0))
    # Noise of the fused table: what is left of the truth when its own slow errors are taken off.
    left = (voted.imu - truth())[GYRO].to_numpy()
    measured = np.diff(left, axis=0).std(axis=0) / np.sqrt(2.0)
    stated = voted.noise_density[GYRO].iloc[0].to_numpy() * np.sqrt(RATE)
    # 10⁴ samples know it to 1/√(2·10⁴)·√1.5: 0.9 %, 4 sd; scale factors add 1e-5 of the motion.
    assert measured == pytest.approx(stated, rel=0.035)


def test_no_step_where_a_channel_is_excluded_and_it_comes_back():
    mounted, tables = units("mpu-6050")
    # Their biases differ by 10 deg/s and more; the fused one must not step by a part of that.
    fault = Jump("gyro_x", 60.0, 61.0, size=0.3)
    broken = tables | {"B": inject_faults(tables["B"], [fault])}
    voted = vote_units(mounted, broken, VotingRule(readmit=15.0))
    assert [e.kind for e in voted.events] == ["excluded", "readmitted"]
    out, back = voted.events
    assert out.time < 60.2
    # The slow mean must first forget: 0.3 rad/s for 1 s in a mean of 5 s.
    assert 61.0 + 15.0 <= back.time <= 100.0
    whole = vote_units(mounted, tables)
    change = (voted.imu - whole.imu)["gyro_x"].loc[62.0:].to_numpy()
    # Of noise, a third each: √(1/2 - 1/3) of one's sample, 4.5 sd over 4000; besides half the
    # scale error and misalignment of the motion of 0.35 rad/s, four times as large at most.
    sd = sd_of(mounted, "gyro_x")
    triad = mounted[0].uncertainty.gyro
    moving = 1.4 * (triad.axis("scale")[0] + 2.0 * triad.axis("misalignment")[0])
    assert np.abs(change).max() < 4.5 * sd * np.sqrt(1 / 6) + moving
    assert np.abs(change.mean()) < 0.01  # rad/s; the biases are 0.2 apart
    assert voted.noise_density["gyro_x"].loc[61.0] == pytest.approx(
        voted.noise_density["gyro_x"].loc[0.0] * np.sqrt(1.5)
    )


def test_two_units_tell_that_they_disagree_and_not_which():
    mounted, tables = units("hg1700", 2)
    broken = tables | {"A": inject_faults(tables["A"], [Jump("gyro_y", 60.0, size=0.01)])}
    voted = vote_units(mounted, broken)
    (event,) = voted.events
    assert event.kind == "disagree"
    assert set(event.channels) == {"A.gyro_y", "B.gyro_y"}
    # Short window 0.1 s, persistent over twice 0.05 s.
    assert 60.0 <= event.since <= event.time < 60.5
    # By the mean of the moment, on its way: up to all of it.
    assert 0.002 < abs(event.size) < 0.0105
    assert "which is wrong is not known" in event.finding.what
    assert voted.used.to_numpy().all()


def test_two_skewed_units_tell_which():
    # Turned so that no two of the six axes are parallel.
    turn = dcm_from_euler(np.array([35.0, 40.0, 25.0]))
    uncertainty = ImuUncertainty.of_sensor(load_sensor("hg1700"))
    mounted = [MountedUnit("A", uncertainty), MountedUnit("B", uncertainty, turn)]
    tables = {"A": readings("hg1700", 0)}
    b = readings("hg1700", 1)
    tables["B"] = imu_table(
        b.index, b[GYRO].to_numpy() @ turn, b[ACCEL].to_numpy() @ turn, sampling="mean"
    )
    assert isolable_axes(np.vstack([np.eye(3), turn.T])).all()
    assert vote_units(mounted, tables).events == ()
    broken = tables | {"B": inject_faults(tables["B"], [Dead("gyro_x", 60.0)])}
    (event,) = vote_units(mounted, broken).events
    assert (event.kind, event.channels) == ("excluded", ("B.gyro_x",))


def test_a_unit_that_fails_as_a_whole():
    mounted, tables = units("hg1700")
    slipped = tables["C"].copy()
    slipped.attrs = dict(tables["C"].attrs)
    turn = dcm_from_euler(np.array([5.0, 0.0, 0.0]))
    after = slipped.index >= 60.0
    for columns in (GYRO, ACCEL):
        slipped.loc[after, columns] = slipped.loc[after, columns].to_numpy() @ turn
    voted = vote_units(mounted, tables | {"C": slipped})
    assert all(c.startswith("C.") for e in voted.events for c in e.channels)
    assert {e.kind for e in voted.events} == {"excluded"}
    # About its forward axis the unit still reads what the others do.
    assert not voted.used[["C.accel_y", "C.accel_z", "C.gyro_y", "C.gyro_z"]].iloc[-1].any()
    # Gone altogether: nothing is excluded, and nothing is used.
    silent = inject_faults(tables["C"], [DropOut(c, 60.0) for c in (*GYRO, *ACCEL)])
    voted = vote_units(mounted, tables | {"C": silent})
    assert voted.events == ()
    assert voted.used.iloc[-1].sum() == 12


def test_cut_anywhere_gives_the_same_numbers():
    mounted, tables = units("stim300")
    broken = tables | {
        "B": inject_faults(
            tables["B"], [Jump("gyro_x", 50.0, 52.0, size=0.5), DropOut("accel_y", 20.0, 21.0)]
        ),
        "A": inject_faults(tables["A"], [Saturated("accel_z", 70.0, limit=9.0)]),
    }
    rule = VotingRule(readmit=10.0)
    voting = UnitVoting(mounted, RATE, rule)
    _, whole = voting.advance(voting.begin(), broken)
    state, parts = voting.begin(), []
    for a, b in ((0, 1), (1, 2500), (2500, 5003), (5003, 5004), (5004, 10001)):
        before = [x.copy() for x in state.gyro.arrays]
        later, part = voting.advance(state, {k: t.iloc[a:b] for k, t in broken.items()})
        assert all(np.array_equal(x, y) for x, y in zip(before, state.gyro.arrays, strict=True))
        state = later
        parts.append(part)
    assert len(whole.events) >= 3
    joined = np.vstack([p.imu.to_numpy() for p in parts])
    assert np.array_equal(joined, whole.imu.to_numpy())
    assert np.array_equal(np.vstack([p.used.to_numpy() for p in parts]), whole.used.to_numpy())
    events = [e for p in parts for e in p.events]
    assert [(e.kind, e.channels, e.time, e.finding.row) for e in events] == [
        (e.kind, e.channels, e.time, e.finding.row) for e in whole.events
    ]
    assert [e.since for e in events] == pytest.approx([e.since for e in whole.events])
    with pytest.raises(DataError, check=coded("sensors.begins-last-segment-ended")):
        voting.advance(state, broken)


def skewed(m, half_angle=54.7356):
    """Axes on a cone about down."""
    turn = 2.0 * np.pi * np.arange(m) / m
    a = np.radians(half_angle)
    return np.column_stack(
        [np.sin(a) * np.cos(turn), np.sin(a) * np.sin(turn), np.full(m, np.cos(a))]
    )


def axis_errors(m, noise=1e-4, bias=1e-4):
    triad = TriadUncertainty(noise_density=noise, bias=bias, scale=1e-5)
    return AxisErrors.of([(triad, BiasDrift(), 0)] * m)


def test_the_chi_square_is_that_of_the_parity_vector():
    from strapdown._kernels import voting as kernel

    rng = np.random.default_rng(3)
    h = skewed(6) + 0.1 * rng.standard_normal((6, 3))
    h /= np.linalg.norm(h, axis=1)[:, None]
    v = parity_matrix(h)
    assert np.abs(v @ h).max() < 1e-14
    assert np.abs(v @ v.T - np.eye(3)).max() < 1e-14
    variance, z = rng.uniform(0.5, 2.0, 6), rng.standard_normal(6)
    x = np.empty(3)
    found = kernel.fit(h, 1.0 / variance, z, x)
    p = v @ z
    # Condition of a few, 30 operations.
    assert found == pytest.approx(p @ np.linalg.solve((v * variance) @ v.T, p), rel=1e-12)
    root = np.sqrt(variance)
    exact = np.linalg.lstsq(h / root[:, None], z / root, rcond=None)[0]
    assert x == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("m", [4, 5, 6])
def test_skewed_axes(m):
    h = skewed(m)
    assert isolable_axes(h).all() == (m >= 5)
    rng = np.random.default_rng(m)
    n = 9000
    rate = 0.3 * np.sin(np.outer(np.arange(n) / RATE, [0.7, 1.1, 1.9]))
    voting = AxisVoting(h, axis_errors(m), RATE)
    sd = 1e-4 * np.sqrt(RATE)
    sound = rate @ h.T + 1e-4 * rng.standard_normal(m) + sd * rng.standard_normal((n, m))
    _, vote = voting.advance(voting.begin(), sound)
    assert vote.events == ()
    # A cone with the half-angle of the magic angle has HᵀH = (m/3) I: each axis has 3/m of the
    # variance; bias of the same, 4 sd.
    left = vote.values - rate
    assert left.std(axis=0) == pytest.approx(np.full(3, sd * np.sqrt(3.0 / m)), rel=0.03)
    for axis in range(m):
        broken = sound.copy()
        broken[6000:, axis] += 10.0 * sd
        _, vote = voting.advance(voting.begin(), broken)
        (event,) = vote.events
        if m == 4:
            assert event.kind == "disagree"
            continue
        assert (event.kind, event.axes) == ("excluded", (axis,))
        assert 6000 <= event.row < 6100
        # What is left of the jump once it is out: nothing; before, for less than a second.
        assert np.abs((vote.values - rate)[event.row + 1 :].mean(axis=0)).max() < 4e-4


def test_detection_rate_against_its_own_statistics():
    # A jump of 0.8 sd of a sample: the short mean (20 samples wide: sd 0.22) does not see it, the
    # long one (sd 0.032, and the reference's 0.018) does, by 20 of its sd: always. One of 0.05 sd
    # is less than 2: the chi-square limit of some 55 is not reached.
    m, n = 6, 9000
    h = skewed(m)
    voting = AxisVoting(h, axis_errors(m), RATE)
    sd = 1e-4 * np.sqrt(RATE)
    found = {0.8: 0, 0.05: 0}
    for seed in range(20):
        noise = sd * np.random.default_rng(seed).standard_normal((n, m))
        for size in found:
            z = noise.copy()
            z[5000:, 2] += size * sd
            events = voting.advance(voting.begin(), z)[1].events
            assert {e.axes for e in events} <= {(2,)}
            found[size] += bool(events)
    assert found == {0.8: 20, 0.05: 0}


def test_false_alarms_are_as_rare_as_stated():
    # Limits at a false-alarm rate of one an hour are exceeded by that many samples of an hour and
    # no more; 200 votes of 60 s have 3.3 h. With 3 sd of the count: at most 9 that lasted.
    m, n = 5, 6000
    voting = AxisVoting(skewed(m), axis_errors(m), RATE, VotingRule(false_alarm=0.99))
    sd, bias = 1e-4 * np.sqrt(RATE), 1e-4
    alarms = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        z = bias * rng.standard_normal(m) + sd * rng.standard_normal((n, m))
        alarms += len(voting.advance(voting.begin(), z)[1].events)
    assert alarms <= 9


def test_accelerometers_apart():
    # 0.2 m apart along x, turning about z at up to 0.7 rad/s: 0.1 m/s², a hundred times the noise.
    mounted, _ = units("fog-1000", 2)
    n = 6000
    t = np.arange(n) / RATE
    rate = np.zeros((n, 3))
    rate[:, 2] = 0.7 * np.clip(t - 35.0, 0.0, 10.0) / 10.0
    rng = np.random.default_rng(0)
    noise = 1e-5 * 9.8 * np.sqrt(RATE)

    def table(x):
        accel = np.tile([0.0, 0.0, -9.8], (n, 1)) + noise * rng.standard_normal((n, 3))
        accel[:, 0] -= x * rate[:, 2] ** 2
        return imu_table(t, rate + 1e-7 * rng.standard_normal((n, 3)), accel)

    tables = {"A": table(0.0), "B": table(0.2)}
    assert "disagree" in {e.kind for e in vote_units(mounted, tables).events}
    assert vote_units(mounted, tables, VotingRule(apart=0.2)).events == ()


def test_what_is_refused():
    mounted, tables = units("hg1700", 2)
    with pytest.raises(ConfigError, check=coded("sensors.units-cannot-test-each-other")):
        UnitVoting(mounted[:1], RATE)
    with pytest.raises(DataError, check=coded("sensors.no-table-unit")):
        vote_units(mounted, {"A": tables["A"]})
    with pytest.raises(DataError, check=coded("sensors.unit-stamps-differ")):
        vote_units(mounted, {"A": tables["A"], "B": tables["B"].iloc[1:]})
    with pytest.raises(
        ConfigError, check=coded("sensors.mounting-no-rotation", quantity="mounting", file="A")
    ):
        MountedUnit("A", mounted[0].uncertainty, 2.0 * np.eye(3))
    with pytest.raises(ConfigError, check=coded("sensors.all-axes-lie-plane")):
        parity_matrix(np.eye(3)[[0, 1, 0, 1]])
    with pytest.raises(ConfigError, match="length"):
        parity_matrix(2.0 * np.eye(3))
    with pytest.raises(ConfigError, check=coded("sensors.neither-noise-nor-bias-stated")):
        AxisVoting(np.eye(3), axis_errors(3, 0.0, 0.0), RATE)
    with pytest.raises(ConfigError, match="windows"):
        VotingRule(windows=())
    with pytest.raises(ConfigError, match="3 directions"):
        AxisVoting(np.eye(3), axis_errors(4), RATE)
    gone = (
        inject_faults(tables["A"], [DropOut("gyro_x", 50.0)]),
        inject_faults(tables["B"], [DropOut("gyro_x", 60.0)]),
    )
    with pytest.raises(
        DataError, check=coded("sensors.healthy-axes-left-they-do", used=4)
    ) as error:
        vote_units(mounted, {"A": gone[0], "B": gone[1]})
    assert error.value.finding.row == 6001
