"""Units on one vehicle: agreement with honest statements, and what is wrong where it is wrong."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom
from tests.coded import coded

from strapdown import CrashOptions, Entry, reconstruct_crash, rotation
from strapdown.crash.acceleration import window_weights
from strapdown.crash.combine_units import (
    _rate_weights,
    combine_effects,
    combine_units,
    least_variance,
)
from strapdown.crash.consistency import (
    common_edges,
    compare_pair,
    compare_units,
    difference_covariance,
    joint_covariance,
    velocity_increments,
)
from strapdown.crash.measuring_point import SampleEffects, at_point
from strapdown.crash.preparation import prepare_together
from strapdown.crash.structure import unlearnt
from strapdown.errors import ConfigError, DataError
from strapdown.formats.inference.rotation_rate import signed_permutations
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.pre_crash import Levelling, PreparedUnit
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation.crash_cases import CASES, record_case
from strapdown.tables import ACCEL, GYRO, imu_table

G = 9.80665
SD, GYRO_SD, BIAS_SD, SCALE_SD = 0.5, 0.004, 0.2, 0.02
P = np.array([0.1, 0.0, -0.1])


def motion(time):
    """Force at the vehicle's origin, rates and their derivative: a crash that turns all axes."""
    x = np.clip(time / 0.12, 0, 1)
    pulse = 2 * np.sin(np.pi * x) ** 2 / 0.12
    area = x - np.sin(2 * np.pi * x) / (2 * np.pi)
    direction, turn = np.array([-7.0, 2.0, -1.0]), np.array([0.8, -0.6, 1.5])
    force = np.outer(pulse, direction) + np.array([0.0, 0.0, -G])
    return force, np.outer(area, turn), np.outer(pulse, turn)


def at_place(place, *, rate=200.0, start=-0.5, wobble=3.0):
    """Ideal readings at a place; a wobble keeps the turning alive after the crash."""
    time = np.arange(round(start * rate), round(0.8 * rate) + 1) / rate
    force, omega, alpha = motion(time)
    w, p = 2 * np.pi * 4.0, np.array([0.0, 1.0, 2.0])
    omega = omega + wobble * 0.2 * np.sin(w * time[:, None] + p)
    alpha = alpha + wobble * 0.2 * w * np.cos(w * time[:, None] + p)
    r = np.asarray(place, dtype=float)
    force = force + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))
    return time, force, omega


def unit(
    name,
    place,
    seed,
    *,
    stated=None,
    rate=200.0,
    errors=1.0,
    accel_axes=None,
    gyro_axes=None,
    position_sd=0.0,
    start=-0.5,
    end=math.inf,
    wobble=3.0,
    gyro_bias_sd=0.0,
    gyro_seed=None,
):
    """A unit with bias, scale and noise drawn from what it states, moved to P."""
    rng = np.random.default_rng(seed)
    time, force, omega = at_place(place, rate=rate, start=start, wobble=wobble)
    time, force, omega = (values[time <= end] for values in (time, force, omega))
    bias, scale = BIAS_SD * rng.normal(size=3), SCALE_SD * rng.normal(size=3)
    read = force * (1 + errors * scale) + errors * bias
    read = read + errors * SD * rng.normal(size=force.shape)
    if gyro_seed is not None:
        rng = np.random.default_rng(gyro_seed)
    turned = omega + errors * GYRO_SD * rng.normal(size=omega.shape)
    turned = turned + errors * gyro_bias_sd * rng.normal(size=3)
    read = read if accel_axes is None else read @ np.asarray(accel_axes)
    turned = turned if gyro_axes is None else turned @ np.asarray(gyro_axes)
    position = np.asarray(place if stated is None else stated, dtype=float)
    imu = imu_table(time, turned, read)
    never = np.zeros(read.shape, dtype=bool)
    made = CrashUnit(
        name,
        (RecordedTriad(imu[ACCEL], TriadUncertainty(bias=BIAS_SD, scale=SCALE_SD), "accel"),),
        RecordedTriad(imu[GYRO], TriadUncertainty(), "gyro"),
        Mounting(tuple(position), position_sd=position_sd),
    )
    if gyro_seed is not None:
        made = replace(made, lender=replace(made, name="the lender"))
    there = PreparedUnit(
        unit=made,
        imu=imu,
        range_spoken=np.zeros(read.shape, dtype=np.int8),
        clipped=never,
        gyro_clipped=never,
        noise=np.full(read.shape, SD),
        gyro_noise=np.full(read.shape, GYRO_SD),
        rest=None,
        rest_accel_sd=0.0,
        levelling=Levelling(0.0, 0.0, 0.0, False),
        gyro_bias_sd=(gyro_bias_sd,) * 3,
        bias_from=(None,),
        bias_sd=((0.0, 0.0, 0.0),),
        gravity_matched=False,
    )
    return at_point(there, P)


A, B, C = (-0.6, 0.5, -0.2), (0.4, -0.5, 0.1), (0.9, 0.3, -0.3)


@pytest.mark.slow
def test_honest_units_agree_and_their_chi_square_is_one():
    chi, freedom, against, total = [], 0, [], []
    for k in range(25):
        units = [unit(n, p, 10 * k + i) for i, (n, p) in enumerate((("A", A), ("B", B), ("C", C)))]
        out = compare_units(units)
        assert not out.findings
        assert all(p.axes.kind == "agree" for p in out.pairs)
        chi.append([p.chi_square for p in out.pairs])
        freedom = out.pairs[0].freedom
        total.append(out.chi_square / out.freedom)
        against.append(out.against[0].probability)
    # The mean of n chi-squares over their degrees of freedom scatters by sqrt(2 / (freedom n)).
    mean = np.mean(chi) / freedom
    assert 1.0 - 5 * math.sqrt(2 / freedom / 25) < mean < 1.0 + 5 * math.sqrt(2 / freedom / 25)
    assert np.mean(total) == pytest.approx(1.0, abs=5 * math.sqrt(2 / (2 * freedom) / 25))
    assert np.mean(np.array(against) < 0.5) == pytest.approx(0.5, abs=5 * 0.5 / math.sqrt(25))


@pytest.mark.slow
def test_a_gyro_that_both_borrow_is_no_reason_to_differ_twice():
    def covariance(bias, seed):
        units = [unit(n, A, 1, gyro_bias_sd=bias, gyro_seed=seed) for n in ("A", "B")]
        edges = np.linspace(-0.1, 0.75, 21)
        return difference_covariance(*(velocity_increments(u, edges) for u in units))

    # At one place what the gyro does is the same in both.
    none = covariance(0.0, 5)
    assert np.allclose(covariance(0.3, 5), none, atol=1e-12 * np.trace(none))
    assert np.trace(covariance(0.3, None)) > 2.0 * np.trace(none)
    chi = []
    for k in range(25):
        pair = [
            unit(n, p, 10 * k + i, gyro_bias_sd=0.3, gyro_seed=900 + k)
            for i, (n, p) in enumerate((("A", A), ("B", B)))
        ]
        found = compare_units(pair).pairs[0]
        assert np.array_equal(found.axes.gyro, np.eye(3))
        chi.append(found.chi_square / found.freedom)
    # The square of the bias, 0.1 rad²/s² on half a metre, is second order: 0.05 of 0.5 m/s².
    assert np.mean(chi) == pytest.approx(1.0, abs=5 * math.sqrt(2 / found.freedom / 25))


def test_units_of_different_rates_are_compared_without_resampling():
    units = [unit("A", A, 1), unit("LAB", B, 2, rate=2000.0)]
    out = compare_units(units)
    assert out.agree
    assert out.edges.size == 21


def test_more_bias_than_stated_is_a_disagreement_with_words():
    biased = unit("B", B, 4)
    table = biased.imu.copy()
    table.attrs = biased.imu.attrs
    table["accel_y"] += 3.0
    out = compare_units([unit("A", A, 3), replace(biased, imu=table), unit("C", C, 5)])
    assert not out.agree
    assert [p.agree for p in out.pairs] == [False, True, False]
    words = " ".join(str(f) for f in out.findings)
    assert "A, delta-V: it and B disagree" in words
    assert "along right" in words
    assert "B, delta-V: the other units agree with each other and not with it" in words


@pytest.mark.slow
@pytest.mark.parametrize("index", range(48))
def test_every_signed_permutation_of_the_accelerometers_is_recognised(index):
    wrong = signed_permutations()[1][index]
    # The second unit reads its own axes: v_read = wrongᵀ v, so wrong turns it back.
    out = compare_units([unit("A", A, 1), unit("B", B, 2, accel_axes=wrong)])
    match = out.pairs[0].axes
    assert np.array_equal(match.accelerometers, wrong)
    assert np.array_equal(match.gyro, np.eye(3))
    if not np.array_equal(wrong, np.eye(3)):
        assert match.kind == "accelerometers"
        assert any(
            "the axes of its accelerometers differ" in str(f) or "its accelerometers" in str(f)
            for f in out.findings
        )


def test_a_unit_turned_as_a_whole_and_a_gyro_turned_alone():
    turned = rotation.dcm_from_euler([0.0, 0.0, 90.0]).round()
    both = compare_units([unit("A", A, 1), unit("B", B, 2, accel_axes=turned, gyro_axes=turned)])
    assert both.pairs[0].axes.kind == "unit"
    gyro = np.diag([1.0, 1.0, -1.0])
    alone = compare_units([unit("A", A, 1), unit("B", B, 2, gyro_axes=gyro)])
    assert np.array_equal(alone.pairs[0].axes.gyro, gyro)
    assert any("the axes of its gyro differ" in str(f) for f in alone.findings)


@pytest.mark.parametrize(("index", "agree"), [(5, False), (47, False), (None, True)])
def test_without_an_explanation_the_verdict_is_the_same(index, agree):
    axes = np.eye(3) if index is None else signed_permutations()[1][index]
    pair = unit("A", A, 1), unit("B", B, 2, accel_axes=axes)
    edges = common_edges(pair)
    a, b = (velocity_increments(u, edges) for u in pair)
    kept = np.ones(len(edges) - 1, dtype=bool)
    whole, short = (
        compare_pair(*pair, a, b, kept, unlearnt(pair), explained=e) for e in (True, False)
    )
    assert whole.agree == short.agree == agree
    assert whole.probability == short.probability
    # Where the points agree, a mounting may still be said to be wrong.
    assert np.array_equal(short.turned.sd_deg, whole.turned.sd_deg) == agree
    assert (short.findings == whole.findings) == agree


@pytest.mark.slow
def test_a_small_rotation_of_the_mounting_is_estimated_with_its_sd():
    C = rotation.dcm_from_euler([2.0, -3.0, 4.0])
    z = []
    for k in range(20):
        second = unit("B", A, 500 + k, accel_axes=C, gyro_axes=C)
        out = compare_units([unit("A", A, k), second])
        found = out.pairs[0].turned
        error = rotation.rotation_vector_from_dcm(found.matrix @ C.T)
        z.append(error @ np.linalg.solve(found.covariance, error))
        assert any(f.quantity == "mounting angles" for f in out.findings)
    # Chi-square of three degrees of freedom: a mean over 20 scatters by sqrt(6/20).
    assert np.mean(z) == pytest.approx(3.0, abs=5 * math.sqrt(6 / 20))


@pytest.mark.slow
def test_a_wrong_position_is_recognised_with_its_sd():
    wrong, z, said = np.array([-0.6, -0.5, -0.2]), [], 0
    for k in range(20):
        out = compare_units([unit("A", A, k, stated=wrong), unit("B", B, 700 + k)])
        check = out.pairs[0].lever_arm
        truth = np.asarray(A) - wrong
        z.append(check.directions.T @ (check.correction - truth) / check.sd)
        said += any("position" in str(f) for f in out.findings)
        assert check.told.any()
    assert said == 20
    # 60 normal deviates: their variance is one to sqrt(2/60).
    assert np.mean(np.square(z)) == pytest.approx(1.0, abs=5 * math.sqrt(2 / 60))


def test_without_turning_positions_are_not_judged():
    out = compare_units(
        [
            unit("A", A, 1, stated=(5.0, 5.0, 5.0), wobble=0.0, end=-0.05),
            unit("B", B, 2, wobble=0.0, end=-0.05),
        ]
    )
    assert not out.pairs[0].lever_arm.told.any()
    assert out.agree
    assert {f.severity for f in out.findings} <= {"note"}


def test_a_combination_is_better_than_its_parts_and_says_how_much():
    z, parts, whole = [], [], []
    for k in range(25):
        units = [unit(n, p, 20 * k + i) for i, (n, p) in enumerate((("A", A), ("B", B), ("C", C)))]
        both = combine_units(units)
        time, truth, _ = at_place(P)
        edges = np.array([0.0, 0.3])
        true = window_weights(time, *edges) @ truth
        got = velocity_increments(both, edges)
        error = got.values[0] - true
        z.append(error @ np.linalg.solve(joint_covariance([got]), error))
        whole.append(np.sum(error**2))
        parts.append(np.sum((velocity_increments(units[0], edges).values[0] - true) ** 2))
    # Chi-square of three degrees of freedom; noise of the gyro is taken as white in a
    # combination, where it cancels: below three by that.
    assert 0.5 * 3 < np.mean(z) < 3 + 5 * math.sqrt(6 / 25)
    assert np.mean(whole) < 0.6 * np.mean(parts)


def test_what_is_refused():
    one = unit("A", A, 1)
    with pytest.raises(DataError, check=coded("crash.unit-comparison-needs-two")):
        compare_units([one])
    with pytest.raises(DataError, check=coded("crash.share-does-not-cover-begins")):
        compare_units([unit("A", A, 1, end=-0.2), unit("B", B, 2)])
    with pytest.raises(ConfigError, check=coded("crash.steps-cannot-cut-into-three")):
        compare_units([unit("A", A, 1, end=-0.08), unit("B", B, 2)])
    with pytest.raises(ConfigError, check=coded("crash.units-cannot-combined")):
        combine_units([one])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 7])
def test_a_car_that_is_spun_by_a_blow_from_the_side_is_no_disagreement(seed):
    # Its rate comes within 60 ms, and with arms that are a metre apart 15 % of the angular
    # acceleration are 23 mm/s in a piece: chi-square 114 to 155 of 60 in these records.
    units = [of.unit for of in record_case(CASES["side"], seed=seed).units]
    assert reconstruct_crash(
        units, Entry.from_speed(0.0, 0.05), CrashOptions(combine=False)
    ).comparison.agree


def test_a_mean_lies_between_units_that_disagree_and_is_not_told_of_them():
    units = [of.unit for of in record_case(CASES["side-disagree"], seed=0).units]
    found = reconstruct_crash(units, Entry.from_speed(0.0, 0.05))
    assert not found.comparison.agree
    assert found.combined is None
    assert found.main is found.units[0]
    assert sum("no mean is given" in f.what for f in found.findings) == 1
    silent = reconstruct_crash(
        units, Entry.from_speed(0.0, 0.05), CrashOptions(combine=False)
    ).findings
    assert not any("no mean is given" in f.what for f in silent)
    there = [u.at_point for u in found.units]
    mean = combine_units(there)
    edges = np.array([0.0, 0.05, 0.1, 0.2])
    parts = np.array([velocity_increments(u, edges).values for u in there])
    between = velocity_increments(mean, edges).values
    # Straight lines between the stamps of two clocks: a millimetre per second.
    assert (between >= parts.min(axis=0) - 1e-3).all()
    assert (between <= parts.max(axis=0) + 1e-3).all()


def test_weights_are_the_best_of_those_that_are_not_negative():
    rng = np.random.default_rng(5)
    for _ in range(20):
        root = rng.normal(size=(3, 3))
        covariance = root @ root.T
        weights = least_variance(covariance)
        assert weights.sum() == pytest.approx(1.0)
        assert (weights >= 0.0).all()
        # No worse than any of many others, to the rounding of the least squares.
        others = rng.dirichlet(np.ones(3), 2000)
        least = np.einsum("ni,ij,nj->n", others, covariance, others).min()
        assert weights @ covariance @ weights <= least * (1 + 1e-9)
    # Two that are independent: the inverses of their variances.
    assert least_variance(np.diag([1.0, 4.0])) == pytest.approx([0.8, 0.2])


def test_what_was_cut_off_is_not_compared():
    units = [of.unit for of in record_case(CASES["saturated"], seed=0).units]
    found = reconstruct_crash(units, Entry.from_speed(15.65, 0.05))
    pair = found.comparison.pairs[0]
    assert found.comparison.agree
    assert pair.freedom < 60
    assert pair.axes.kind == "agree"
    gone = np.isnan(pair.force_difference).all(axis=1)
    assert pair.freedom == 3 * (~gone).sum()
    # Nothing is added where nothing was compared.
    assert not np.diff(pair.difference, axis=0)[gone].any()
    for name in ("IMU1", "IMU2"):
        assert any(
            f.file == name and "left out of the comparison" in f.what for f in found.findings
        )


def straight_into_a_wall(seed):
    """The comparison of the two recorders of a crash without yaw."""
    units = [of.unit for of in record_case(CASES["frontal"], seed=seed).units]
    at_stamps = synchronise(units, method="trigger", rate=200.0, cut=False)
    return compare_units(prepare_together(at_stamps, (0.0, 0.0, 0.0), G, {}))


@pytest.mark.parametrize("seed", [0, 2])
def test_where_nothing_turns_the_stated_axes_of_a_gyro_stand(seed):
    # Among 48 permutations of noise one fits better than the stated axes by more than five standard
    # deviations in these two records, and the stated ones fit, too.
    out = straight_into_a_wall(seed)
    assert out.agree
    assert out.pairs[0].axes.kind == "agree"
    assert out.findings == ()


def test_where_nothing_turns_a_position_is_not_judged_by_noise():
    # Noise of the angular acceleration over the stated meter between the recorders: with the same
    # noise as the effect of a position, the record is that of recorders beside each other.
    out = straight_into_a_wall(48)
    assert out.agree
    assert out.findings == ()


@pytest.mark.slow
def test_correct_recorders_are_reported_as_rarely_as_stated():
    # The odds against three single errors exceed 1000 by chance in at most one of 1000 (Markov)
    # each; a chi-square in one of 1000; three angles and three directions of a position exceed four
    # standard deviations in 6.3e-5 each.
    count, most = 240, 4e-3 + 6 * 6.4e-5
    # Seed 127 is refused: the noise of its record leaves no rest.
    seeds = [k for k in range(count + 1) if k != 127]
    out = {k: straight_into_a_wall(k) for k in seeds}
    wrong = [k for k, one in out.items() if any(f.severity != "note" for f in one.findings)]
    assert len(wrong) <= binom.ppf(1.0 - 1e-3, count, most), wrong


def plain_effects(names, rates, noise, n=151):
    """Effects of unknowns on the rate about x alone, each constant, and white noise of it."""
    rate = np.zeros((len(names), n, 3))
    rate[:, :, 0] = np.array(rates)[:, None]
    none = np.zeros((len(names), 3))
    noises = (np.full((n, 3), 0.2), np.full((n, 3), noise))
    return SampleEffects(tuple(names), tuple(names), 10.0 * rate, rate, none, none + 0.5, *noises)


def test_effects_on_a_mean_are_sums_by_unknown_and_noise_adds_in_square():
    first, second = (
        plain_effects(["a", "both"], [0.01, 0.02], 0.3),
        plain_effects(["both"], [0.04], 0.1),
    )
    mean = combine_effects([first, second], [0.25, 0.75])
    assert mean.names == ("a", "both")
    expected = [0.25 * 0.01, 0.25 * 0.02 + 0.75 * 0.04]
    np.testing.assert_allclose(mean.rate[:, 7, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(mean.force[:, 7], np.outer(expected, [10.0, 0.0, 0.0]), rtol=1e-12)
    np.testing.assert_allclose(mean.tilt[:, 0], [0.125, 0.5])
    np.testing.assert_allclose(mean.rate_noise, math.hypot(0.25 * 0.3, 0.75 * 0.1), rtol=1e-12)
    np.testing.assert_allclose(mean.force_noise, 0.2 * math.hypot(0.25, 0.75), rtol=1e-12)


def test_gyros_weigh_by_the_variance_of_their_turning_over_the_crash_and_each_once():
    # 1.5 s at 100 Hz, of which -0.1 to 0.75 s count: 86 stamps.
    time = np.arange(-60, 91) / 100.0
    units = [
        SimpleNamespace(time=time, effects=plain_effects(names, rates, noise), gyro=gyro)
        for names, rates, noise, gyro in (
            (["a", "b"], [0.03, 0.04], 0.0, "A"),
            (["c"], [0.0], 0.5, "B"),
            (["d"], [0.01], 0.0, "A"),
            (["e"], [0.01], 0.0, "C"),
        )
    ]
    # Unknowns in square by their sums, (0.03² + 0.04²) 0.86²; noise by sample, 86 · 3 (0.5 / 100)².
    variances = np.array([0.05**2 * 0.86**2, 86 * 3 * (0.5 * 0.01) ** 2])
    expected = np.append(1.0 / variances, [0.0, 0.0]) / (1.0 / variances).sum()
    found = _rate_weights(units, np.array([True, True, True, False]))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_what_a_drive_may_determine_are_the_biases_and_scale_factors_of_the_accelerometer():
    effects = unit("A", A, 1).effects
    of = {
        (one.quantity, one.axis): (one.sd, name)
        for name, one in zip(effects.names, effects.parameters, strict=True)
        if one is not None and one.quantity in ("bias", "scale")
    }
    assert sorted(of) == [(q, k) for q in ("bias", "scale") for k in range(3)]
    for (quantity, axis), (sd, name) in of.items():
        assert sd == {"bias": BIAS_SD, "scale": SCALE_SD}[quantity]
        assert name.endswith(f"{quantity} {'xyz'[axis]}")
