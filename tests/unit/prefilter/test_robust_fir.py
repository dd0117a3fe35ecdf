"""The robust digital filter: phase between the channels, aliases, integrals, coning, sculling."""

import numpy as np
import pytest
from scipy.signal import csd, welch
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.increments import motion_increments
from strapdown.prefilter import Grid, RobustFir, Summed
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import Coning, Sculling
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.imu import simulate_imu
from strapdown.tables import DV, GYRO, PHI, imu_table

STEP = 1e-3
N = 120_000


def coloured(seed, n=N, band=22.0):
    """Motion within the passband of the filter: white below `band` Hz, unit variance."""
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    f = np.fft.rfftfreq(n, STEP)
    at = (f > 0.0) & (f < band)
    rng = np.random.default_rng(seed)
    spectrum[at] = rng.standard_normal(at.sum()) + 1j * rng.standard_normal(at.sum())
    signal = np.fft.irfft(spectrum, n)
    return signal / signal.std()


@pytest.fixture(scope="module", params=["instantaneous", "mean"])
def vehicle(request):
    """One motion that all six channels see, and outliers of each alone."""
    motion, rng = coloured(1), np.random.default_rng(2)
    if request.param == "mean":
        # Mean over the step: of a sum of tones, by its integral.
        f = np.fft.rfftfreq(N, STEP)
        late = np.sinc(f * STEP) * np.exp(-1j * np.pi * f * STEP)
        motion = np.fft.irfft(np.fft.rfft(motion) * late, N)
    scale = np.array([0.1] * 3 + [2.0] * 3)
    sd = 1e-3 * scale
    values = motion[:, None] * scale + sd * rng.standard_normal((N, 6))
    for c in range(6):
        rows = np.arange(300 + 71 * c, N - 300, 1000)
        values[rows, c] += 30.0 * scale[c] * rng.choice([-1.0, 1.0], len(rows))
    imu = imu_table(STEP * np.arange(N), values[:, :3], values[:, 3:], sampling=request.param)
    return imu, RobustFir().apply(imu)


def test_gyros_and_accelerometers_have_one_phase(vehicle):
    """Cross-spectrum of gyro and accelerometer, where the motion is: coherent, without phase.

    Noise is 1e-3 of the motion, times the motion's share of the band (22 of 500 Hz): at each
    frequency the noise is 1e-6 * 22/500 of the motion in power. An interpolated outlier leaves
    noise of 1.2 samples in one of a thousand. The phase of one of K segments' mean has the sd
    sqrt((1 - c)/(2 K c)), c the coherence.
    """
    _, done = vehicle
    out = done.imu.to_numpy()
    size = 256
    f, p01 = csd(out[:, 0], out[:, 3], 100.0, nperseg=size)
    _, p00 = welch(out[:, 0], 100.0, nperseg=size)
    _, p11 = welch(out[:, 3], 100.0, nperseg=size)
    inside = (f > 1.0) & (f < 21.0)
    coherence = np.abs(p01[inside]) ** 2 / (p00 * p11)[inside]
    lost = 2.0 * 1e-6 * 22.0 / 500.0
    # Leakage of the window at the edges and the chance of one frequency: ten times.
    assert (1.0 - coherence).max() < 10.0 * lost
    segments = 2 * len(out) / size - 1
    phase = np.angle(p01[inside])
    assert np.abs(phase).max() < 5.0 * np.sqrt(10.0 * lost / (2.0 * segments))
    # A delay of a microsecond at 20 Hz would be 1.3e-4 rad: it would be seen.
    assert np.abs(phase).max() < 1e-4
    gain = np.abs(p01[inside]) / p00[inside]
    np.testing.assert_allclose(gain, 20.0, rtol=1e-4)


def test_stamps_hold_the_motion_of_their_time(vehicle):
    """The outputs are the motion at their stamps, in all channels: the delay is taken off."""
    imu, done = vehicle
    truth = coloured(1)
    number = np.round(done.imu.index.to_numpy() / STEP).astype(int)
    scale = np.array([0.1] * 3 + [2.0] * 3)
    out = done.imu.to_numpy() / scale
    # Noise of 1e-3 by the factor 0.265; means lose (pi f STEP)²/6 at most, 8e-4 at 22 Hz; one
    # sample in a thousand is interpolated, off by 1.2e-3 times its weight of a tenth.
    off = out - truth[number][:, None]
    assert off.std(axis=0).max() < 1e-3 * 0.265 * 1.2 + (
        8e-4 if imu.attrs["sampling"] == "mean" else 0.0
    )
    # By least squares on the slope: a shift of the stamps by 10 µs would be seen.
    slope = np.gradient(truth, STEP)[number]
    shift = (off * slope[:, None]).sum(axis=0) / (slope**2).sum()
    sd = 1e-3 * 0.3 / np.sqrt((slope**2).sum())
    assert np.abs(shift).max() < 6.0 * sd
    assert done.report.findings == ()
    # Every outlier was found, and nothing else.
    assert len(done.report.replaced) == sum(
        len(np.arange(300 + 71 * c, N - 300, 1000)) for c in range(6)
    )


@pytest.mark.parametrize("attenuation", [60.0, 80.0, 100.0])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_no_tone_above_the_new_nyquist_comes_down(sampling, attenuation):
    """Tones from 50 to 500 Hz on all channels, one after the other: none is an outlier, and what
    is left of each is within the attenuation."""
    t = STEP * np.arange(3000)
    for low in (50.0, 75.0, 97.0, 100.0, 123.0, 200.0, 301.0, 400.0, 499.0):
        f = low + np.array([0.0, 0.01, 0.1, 0.2, 0.4, 0.9])
        tones = np.cos(2.0 * np.pi * f * t[:, None] + np.arange(6.0))
        imu = imu_table(t, tones[:, :3], tones[:, 3:], sampling=sampling)
        done = RobustFir(attenuation=attenuation).apply(imu)
        assert done.report.replaced.empty
        assert np.abs(done.imu.to_numpy()).max() <= 10.0 ** (-attenuation / 20.0)


def test_increments_sum_to_the_same_angle():
    """A turn of 90° about one axis within the record, by a sudden rate: nothing of it is lost.

    About one axis increments add up: each sample counts once, to rounding of 3000 and to the
    ripple's square at the two ends of the trapezoids, where the rate is zero.
    """
    t = STEP * np.arange(4000)
    rate = np.where((t > 1.0) & (t <= 2.0), 0.5 * np.pi, 0.0)
    gyro = np.column_stack([rate, 0.0 * rate, 0.0 * rate])
    imu = imu_table(t, gyro, gyro)
    for prefilter in (RobustFir(), Summed()):
        done = prefilter.apply(imu)
        assert done.increments["phi_x"].sum() == pytest.approx(0.5 * np.pi, abs=1e-12)
        assert done.increments["dv_x"].sum() == pytest.approx(0.5 * np.pi, abs=1e-12)


def joined(frequency):
    """Part that the cubic of a step holds: its integral lacks 11/720 x⁴, and coning is its square.

    The middle interval of four samples: h - 11/720 h^5 times the fourth derivative.
    """
    return 1.0 - 11.0 / 360.0 * (2.0 * np.pi * frequency * STEP) ** 4


def turned(increments):
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for phi in increments[PHI].to_numpy():
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    return rotation.rotation_vector_from_quaternion(q)


def driven(increments, frequency):
    """Velocity after two seconds, in the axes of the middle of the swing."""
    # From the start of a cycle on.
    first = increments.index[0] - increments["dt"].iloc[0]
    skip = round(100.0 * (np.ceil(first * frequency - 1e-9) / frequency - first))
    v, q = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    part = increments.iloc[skip : skip + 200]
    for phi, dv in zip(part[PHI].to_numpy(), part[DV].to_numpy(), strict=True):
        v += rotation.rotate(q, dv)
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    return v


@pytest.mark.parametrize("frequency", [5.0, 10.0, 20.0])
def test_coning_in_the_band_is_that_of_samples_of_the_motion(frequency):
    """The filter adds nothing to what 100 Hz samples of the motion itself lack."""
    coning = Coning(0.1, frequency, 2.5)
    drift = 8.0 * np.pi * frequency * np.sin(np.radians(0.05)) ** 2  # rad in 2 s
    imu, _ = simulate_imu(coning, ImuErrors(), rate=1000.0)
    ideal, _ = simulate_imu(coning, ImuErrors(), rate=100.0)
    done = RobustFir().apply(imu)
    assert done.report.replaced.empty
    expected = turned(motion_increments(ideal, interpolation="cubic").iloc[20:220])[2]
    # Twice the ripple, of the drift. At its start a record has no cubic.
    assert abs(turned(done.increments.iloc[5:205])[2] - expected) < 2.5e-4 * drift


@pytest.mark.parametrize("frequency", [5.0, 20.0, 60.0])
def test_coning_of_all_frequencies_is_in_the_joined_increments(frequency):
    imu, _ = simulate_imu(Coning(0.1, frequency, 2.5), ImuErrors(), rate=1000.0)
    drift = 8.0 * np.pi * frequency * np.sin(np.radians(0.05)) ** 2
    lost = 1.0 - joined(frequency)
    part = Summed().apply(imu).increments.iloc[:200]
    # The next order in x, and rounding of 2000 turns.
    assert turned(part)[2] / -drift == pytest.approx(lost, rel=0.05, abs=1e-8)


def test_coning_above_the_band_is_lost():
    """The gyro that is left sees the steady part alone: the whole drift."""
    imu, _ = simulate_imu(Coning(0.1, 60.0, 2.5), ImuErrors(), rate=1000.0)
    drift = 8.0 * np.pi * 60.0 * np.sin(np.radians(0.05)) ** 2
    part = RobustFir().apply(imu).increments.iloc[:200]
    assert turned(part)[2] / -drift == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("frequency", [5.0, 20.0, 60.0])
def test_sculling(frequency):
    """In phase, swing and push drive the body by B J1(swing) a second, J1 = half to its square."""
    sculling = Sculling(0.1, 10.0, frequency, 2.5)
    imu, ideal = (simulate_imu(sculling, ImuErrors(), rate=rate)[0] for rate in (1000.0, 100.0))
    weight = imu["accel_z"].mean()
    for table in (imu, ideal):
        table["accel_z"] -= weight
    whole = 2.0 * 0.5 * 10.0 * np.radians(0.1)
    v = driven(Summed().apply(imu).increments, frequency)
    # Lacks 11/360 x⁴ of it, and twice the square of the swing of the rest of gravity.
    axis = int(np.argmax(np.abs(v)))
    assert abs(v[axis]) / whole == pytest.approx(joined(frequency), abs=2e-3)
    fir = driven(RobustFir().apply(imu).increments.iloc[5:], frequency)
    if frequency > 50.0:
        assert np.abs(fir).max() < 1e-4 * whole
    else:
        same = driven(motion_increments(ideal, interpolation="cubic").iloc[5:], frequency)
        np.testing.assert_allclose(fir, same, atol=5e-4 * whole)


@pytest.mark.parametrize("columns", [GYRO])
def test_a_burst_is_told_and_left(columns):
    rng = np.random.default_rng(3)
    values = rng.standard_normal((5000, 6))
    values[2000:2012, 1] += 300.0
    imu = imu_table(STEP * np.arange(5000), values[:, :3], values[:, 3:], source="bench.csv")
    report = RobustFir().apply(imu).report
    assert len(report.findings) == 1
    finding = report.findings[0]
    assert (finding.file, finding.quantity) == ("bench.csv", columns[1])
    assert finding.row is not None
    assert 1997 <= finding.row <= 2001
    assert "rows" in finding.what
    assert finding.remedy
    assert report.replaced.empty
    assert not report.kept.empty


def test_a_channel_full_of_outliers_is_told():
    rng = np.random.default_rng(4)
    values = rng.standard_normal((5000, 6))
    values[200:-200:50, 5] += 100.0
    imu = imu_table(STEP * np.arange(5000), values[:, :3], values[:, 3:], source="bench.csv")
    report = RobustFir().apply(imu).report
    assert report.share["accel_z"] == pytest.approx(92 / 5000)
    assert [f.quantity for f in report.findings] == ["accel_z"]


def test_what_it_says_of_time():
    """Ten output steps at 0.5 and 85 dB: (85 - 7.95)/(2.285 · 2 pi · 25 Hz · 1 ms) = 214.6."""
    imu = imu_table(STEP * np.arange(1000), np.ones((1000, 3)), np.ones((1000, 3)))
    report = RobustFir().apply(imu).report
    assert report.delay == pytest.approx(0.107, abs=1e-12)
    assert report.latency == pytest.approx(0.107 + RobustFir().outliers.latency * STEP)
    assert (report.passband, report.stopband) == (25.0, 50.0)


@pytest.mark.parametrize("name", ["pole", "two-impacts", "kerb", "door-slam"])
def test_nothing_of_a_crash_or_a_blow_is_an_outlier(name):
    """What a vehicle does, by a sensor whose noise is a thousandth of it and whose range ends."""
    errors = load_sensor("fog-1000").imu_errors
    imu, _ = simulate_imu(find_crash(name).motion, errors, rate=1000.0, sampling="mean", seed=2)
    report = Summed().apply(imu).report
    assert report.replaced.empty
    assert report.findings == ()


@pytest.mark.parametrize(("rate", "told"), [(100.0, 1), (1000.0, 0)])
def test_a_knock_that_a_low_rate_cannot_tell_is_spoken_of(rate, told):
    t = np.arange(0.0, 20.0, 1.0 / rate)
    values = 1e-4 * np.random.default_rng(1).standard_normal((t.size, 6))
    values[t.size // 2, 0] = 0.1
    table = imu_table(t, values[:, :3], values[:, 3:] - [0.0, 0.0, 9.8], source="log")
    report = RobustFir(rate=50.0).apply(table).report
    assert len(report.replaced) == 1
    found = [f for f in report.findings if "a knock on the body" in f.what]
    assert len(found) == told
    assert all(f.row == t.size // 2 + 1 and f.quantity == "gyro_x" for f in found)


def test_a_rate_that_is_the_log_s_own_is_refused_with_what_to_give():
    with pytest.raises(ConfigError, check=coded("prefilter.rate-not-below-log")) as raised:
        RobustFir(rate=100.0).low_pass(Grid(0.0, 0.01, True))
    assert "robust_fir:rate=50" in str(raised.value)
    assert "summed" in str(raised.value)
