"""What every prefilter promises, held for every entry of the table."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import ConfigError, DataError
from strapdown.prefilter import PREFILTERS, Grid, NoPrefilter, RobustWd
from strapdown.tables import ACCEL, GYRO, check_imu, check_motion_increments, imu_table

RATE = 1000.0
VARIANTS = {
    **{name: kind() for name, kind in PREFILTERS.items()},
    "w_d, filter alone": RobustWd(smooth=False),
    "w_d, given noise": RobustWd(noise=(1e-3,) * 3 + (1e-2,) * 3),
}
NAMES = list(VARIANTS)


def bench(samples=3000, sampling="instantaneous", seed=1, start=100.0):
    """A bench at rest, with noise and some outliers."""
    rng = np.random.default_rng(seed)
    sd = np.array([1e-3] * 3 + [1e-2] * 3)
    values = np.array([1e-5, 2e-5, -5e-5, 0.3, -0.2, -9.8]) + sd * rng.standard_normal((samples, 6))
    rows = rng.choice(samples - 400, 12, replace=False) + 200
    values[rows, rng.integers(0, 6, 12)] += 40.0 * sd.max()
    time = start + np.arange(samples) / RATE
    return imu_table(time, values[:, :3], values[:, 3:], sampling=sampling, source="bench.csv")


def in_pieces(prefilter, imu, cut):
    grid = Grid(float(imu.index[0]), 1.0 / RATE, imu.attrs["sampling"] == "mean")
    values = imu.to_numpy()
    state, portions = prefilter.begin(grid, values.shape[1]), []
    for k in range(0, len(values), cut):
        state, portion = prefilter.advance(state, values[k : k + cut], k + cut >= len(values))
        portions.append(portion)
    return [
        np.concatenate([getattr(p, name) for p in portions]) for name in ("time", "values", "rows")
    ], sorted(
        (int(n), int(c), float(v), float(b), int(f))
        for p in portions
        for n, c, v, b, f in zip(
            p.changed.number,
            p.changed.channel,
            p.changed.value,
            p.changed.by,
            p.changed.flag,
            strict=True,
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("name", NAMES)
def test_any_cut_gives_the_same_bits(name, sampling):
    imu = bench(1200, sampling)
    whole, changed = in_pieces(VARIANTS[name], imu, len(imu))
    for cut in (1, 17, 400):
        parts, again = in_pieces(VARIANTS[name], imu, cut)
        for a, b in zip(whole, parts, strict=True):
            np.testing.assert_array_equal(a, b)
        assert again == changed


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("name", NAMES)
def test_gives_tables_at_even_stamps_within_the_record(name, sampling):
    imu = bench(sampling=sampling)
    before = imu.copy()
    done = VARIANTS[name].apply(imu)
    np.testing.assert_array_equal(imu, before)
    check_imu(done.imu)
    check_motion_increments(done.increments)
    time = done.imu.index.to_numpy()
    assert imu.index[0] <= time[0]
    assert time[-1] <= imu.index[-1] + 1e-9
    if name != "none":
        # Stamps on whole hundredths, for all prefilters alike; epochs of 100 s carry 1e-14.
        np.testing.assert_allclose(np.diff(time), 0.01, atol=1e-12)
        np.testing.assert_allclose(100.0 * time, np.round(100.0 * time), atol=1e-9)
    ends = done.increments.index.to_numpy()
    assert set(np.round(ends, 9)) <= set(np.round(time, 9))
    assert done.imu.attrs["source"] == "bench.csv"


@pytest.mark.parametrize("name", NAMES)
def test_a_constant_passes_as_it_is(name):
    """Gain at zero: noise of nothing but a millionth, and of it the mean."""
    imu = bench(seed=2)
    constant = np.array([0.01, -0.02, 0.03, 1.0, -2.0, -9.8])
    sd = 1e-9
    imu.iloc[:, :] = constant + sd * np.random.default_rng(3).standard_normal(imu.shape)
    prefilter = RobustWd(noise=(sd,) * 6) if "given noise" in name else VARIANTS[name]
    done = prefilter.apply(imu)
    # Six standard deviations of a sample: no prefilter makes noise larger.
    np.testing.assert_allclose(
        done.imu.to_numpy(), np.tile(constant, (len(done.imu), 1)), atol=6.0 * sd
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_noise_is_what_is_stated(name):
    """White noise: the spread of the outputs is the stated factor.

    4000 outputs of which a fifth or more is independent: the spread's own is 0.025 of it; five.
    """
    rng = np.random.default_rng(4)
    n = 40_000
    time = np.arange(n) / RATE
    imu = imu_table(time, rng.standard_normal((n, 3)), rng.standard_normal((n, 3)))
    prefilter = RobustWd(noise=(1.0,) * 6) if "given noise" in name else VARIANTS[name]
    done = prefilter.apply(imu)
    ratio = done.imu.iloc[100:-100].std().to_numpy() / done.report.noise_factor
    # Huber's function uses 95 % of the information in normal noise: its filter is as much slower
    # or noisier, 1.026 in the standard deviation. Six channels' mean.
    slack = 0.06 if name.startswith("w_d") else 0.03
    assert ratio.mean() == pytest.approx(1.0, abs=slack)


@pytest.mark.parametrize("name", [n for n in NAMES if n != "none"])
def test_outliers_are_found_and_told(name):
    imu = bench(seed=5)
    clean = imu.copy()
    row, channel = 1500, "gyro_y"
    imu.loc[imu.index[row], channel] += 0.5
    done, without = VARIANTS[name].apply(imu), VARIANTS[name].apply(clean)
    told = done.report.replaced
    one = told[(told["row"] == row + 1) & (told["channel"] == channel)]
    assert len(one) == 1
    assert one["time"].item() == imu.index[row]
    assert one["value"].item() == imu.iloc[row][channel]
    # 500 standard deviations of a sample leave less than three of them, anywhere.
    assert np.abs((done.imu - without.imu)[channel]).max() < 3e-3
    assert done.report.share[channel] > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_a_gyro_alone(name):
    imu = bench()[GYRO]
    imu.attrs = {"sampling": "instantaneous", "source": "gyro.csv"}
    prefilter = RobustWd(noise=(1e-3,) * 3) if "given noise" in name else VARIANTS[name]
    done = prefilter.apply(imu)
    assert list(done.imu.columns) == GYRO
    assert done.increments.empty


@pytest.mark.parametrize("name", NAMES)
def test_what_is_refused(name):
    imu = bench(600)
    bad = imu.copy()
    bad.iloc[77, 4] = np.nan
    with pytest.raises(DataError) as error:
        VARIANTS[name].apply(bad)
    assert (error.value.finding.row, error.value.finding.quantity) == (78, ACCEL[1])
    assert error.value.finding.file == "bench.csv"
    gap = imu.drop(imu.index[300:350])
    gap.attrs = imu.attrs
    with pytest.raises(DataError) as error:
        VARIANTS[name].apply(gap)
    assert error.value.finding.row == 301
    assert error.value.finding.file == "bench.csv"
    assert error.value.finding.remedy


@pytest.mark.parametrize("name", NAMES)
def test_a_value_of_a_later_segment_that_is_none(name):
    values = bench(700).to_numpy().copy()
    values[555, 3] = np.inf
    state = VARIANTS[name].begin(Grid(0.0, 1.0 / RATE, False))
    with pytest.raises(DataError) as error:
        for k in range(0, 700, 50):
            state, _ = VARIANTS[name].advance(state, values[k : k + 50])
    assert error.value.finding.row == 556
    assert "channel 3" in error.value.finding.what
    assert error.value.finding.remedy


@pytest.mark.parametrize("name", [n for n in NAMES if n != "none"])
def test_rates_that_are_no_part(name):
    kind = PREFILTERS[name.split(",")[0]]
    for rate in (333.0, 2000.0, 0.0, -5.0, float("nan")):
        with pytest.raises(ConfigError) as error:
            kind(rate=rate).apply(bench(600))
        assert error.value.finding.quantity in ("rate", "factor")


def test_every_entry_of_the_table_is_here():
    assert {n.split(",")[0] for n in NAMES} == set(PREFILTERS)
    assert isinstance(VARIANTS["none"], NoPrefilter)
    for name, kind in PREFILTERS.items():
        assert kind.name == name
        assert kind.summary
        assert kind.source
