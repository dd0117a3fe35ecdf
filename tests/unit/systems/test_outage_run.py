"""How far it drifts is foretold by the filter: against closed forms, and against drifts drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from strapdown import outage, rotation
from strapdown.config.outage import OutageSpec
from strapdown.config.spec import specify
from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.dsp.chi_square import PLANE_95
from strapdown.errors import ConfigError
from strapdown.frames import ned_from_geodetic
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.navigation.outage import QUANTITIES
from strapdown.report.outage import outage_json
from strapdown.report.outage_document import cone_chart
from strapdown.sensors.error_chain import apply
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import simulate_imu
from strapdown.systems import outage_run as stated
from strapdown.systems.outage_run import forecast_of_sensor, sensor_of, stated_motion
from strapdown.tables import ACCEL, GYRO, imu_table

G = 9.806
START = {
    "aided_s": 0.0,
    "position_sd_m": 0.5,
    "velocity_sd_m_per_s": 0.03,
    "tilt_sd_deg": 0.05,
    "heading_sd_deg": 0.5,
}
# Biases so small that errors stay small over 30 s, which those of data sheets do not.
SMALL = {**START, "gyro_bias_sd_deg_per_h": 30.0, "accel_bias_sd_ug": 500.0}


def foretold(sensor, outage=10.0, **tables):
    spec = specify(OutageSpec, **{"outage_s": outage, "sensor": sensor, **tables})
    return forecast_of_sensor(spec, sensor_of(sensor))


def alone(found, name, quantity="horizontal"):
    return next(s.alone[quantity][-1] for s in found.shares if s.source.name == name)


@pytest.fixture(scope="module")
def standing():
    """Ten seconds at rest, every error of the start stated, and so none bound to another."""
    return foretold("adis16495-1", start=START)


@pytest.fixture(scope="module")
def aided():
    """A minute after five of driving with fixes: the errors of the start are bound."""
    return foretold("adis16495-1", 60.0, start={"aided_s": 300.0}, motion={"speed_m_per_s": 15.0})


# Each closed form is of two axes, hence the root of two, and leaves out what the Earth's curvature
# does within 10 s: (w_S t)²/12 = 1.3e-5 of it, and what is rounded by means over 0.1 s: 1e-3 of
# what grows with the fifth power.
@pytest.mark.parametrize(
    ("source", "grown", "within"),
    [
        ("position", lambda sd, t: sd, 1e-4),
        ("velocity", lambda sd, t: sd * t, 1e-4),
        ("tilt", lambda sd, t: 0.5 * G * sd * t**2, 1e-3),
        ("accel_bias", lambda sd, t: 0.5 * sd * t**2, 0.02),
        ("gyro_bias", lambda sd, t: G * sd * t**3 / 6.0, 0.02),
    ],
)
def test_each_source_grows_as_its_closed_form(standing, source, grown, within):
    # A bias has a part that fades over its correlation time: by up to t/(2 T) = 1.7 % in 10 s.
    share = next(s for s in standing.shares if s.source.name == source)
    expected = math.hypot(*(grown(float(sd), 10.0) for sd in share.sd[:2]))
    assert share.alone["horizontal"][-1] == pytest.approx(expected, rel=within)


def test_white_noise_grows_as_its_closed_form(standing):
    known = sensor_of("adis16495-1")
    accel = known.accel.axis("noise_density")[0] * math.sqrt(2.0 * 10.0**3 / 3.0)
    gyro = known.gyro.axis("noise_density")[0] * G * math.sqrt(2.0 * 10.0**5 / 20.0)
    assert alone(standing, "accel_noise") == pytest.approx(accel, rel=2e-3)
    assert alone(standing, "gyro_noise") == pytest.approx(gyro, rel=2e-3)


@pytest.mark.parametrize("run", ["standing", "aided"])
def test_the_budget_adds_up_to_the_forecast(run, request):
    found = request.getfixturevalue(run)
    assert not found.aids
    for quantity in QUANTITIES:
        parts = np.sum([s.variance[quantity] for s in found.shares], axis=0)
        # Linear: exact but for rounding, at every instant.
        assert parts == pytest.approx(found.variance(quantity), rel=1e-9), quantity


def test_what_is_bound_to_nothing_adds_up_alone(standing):
    squares = np.sum([s.alone["horizontal"] ** 2 for s in standing.shares], axis=0)
    assert squares == pytest.approx(standing.variance("horizontal"), rel=1e-9)


def test_a_bias_that_is_bound_to_a_tilt_cancels_it(aided):
    share = {s.source.name: s for s in aided.shares}["accel_bias"]
    # While it drives with one attitude a filter cannot tell them, and a share falls far below what
    # the source would make alone.
    assert share.variance["horizontal"][-1] < 0.5 * share.alone["horizontal"][-1] ** 2


@pytest.mark.slow
def test_with_aids_the_budget_has_what_their_noise_adds(monkeypatch):
    asked = {
        "start": SMALL,
        "motion": {"speed_m_per_s": 15.0},
        "aiding": {"odometer": {}, "no_slip": {}},
    }
    found = foretold("mpu-6050", 12.0, **asked)
    noise = stated.ODOMETER_SD, 0.03, 0.1
    ends = []
    for factor in (1.02, 0.98):
        monkeypatch.setattr(stated, "ODOMETER_SD", factor * noise[0])
        slip = {
            "lateral_sd_m_per_s": factor * noise[1],
            "vertical_sd_m_per_s": factor * noise[2],
        }
        changed = foretold(
            "mpu-6050", 12.0, **{**asked, "aiding": {"odometer": {}, "no_slip": slip}}
        )
        ends.append(changed.variance("horizontal")[-1])
    whole = found.variance("horizontal")[-1]
    # Central differences of 2 % leave some 1e-3 of each of a dozen shares.
    assert found.aids["horizontal"][-1] / whole == pytest.approx(
        (ends[0] - ends[1]) / 0.08 / whole, abs=5e-3
    )
    assert found.bound[-1] < foretold("mpu-6050", 12.0, start=SMALL).bound[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "motion", [{}, {"speed_m_per_s": 15.0}, {"speed_m_per_s": 15.0, "turn_rate_deg_per_s": 6.0}]
)
@pytest.mark.parametrize("sensor", ["mpu-6050", "adis16495-1"])
def test_drifts_that_are_drawn_are_as_foretold(sensor, motion):
    """Errors are drawn by the simulation of sensors, and navigated by the mechanization alone."""
    spec = specify(OutageSpec, outage_s=30.0, sensor=sensor, start=SMALL, motion=motion)
    known = sensor_of(sensor)
    found = forecast_of_sensor(spec, known)
    drifts = drawn(spec, known, 150)
    P = found.covariance[-1]
    for k, name in enumerate(("north", "east", "down")):
        ratio = np.sqrt(np.mean(drifts[:, k] ** 2) / P[k, k])
        # An rms of 150 has a relative standard deviation of 1/√300 = 5.8 %: four of them. The
        # drift of the bias, stated as known here too, is in both.
        assert ratio == pytest.approx(1.0, abs=0.23), name
    far = np.einsum("ij,ij->i", drifts[:, :2] @ np.linalg.inv(P[:2, :2]), drifts[:, :2])
    inside = np.mean(far <= PLANE_95**2)
    # Of 150, 95 % with a standard deviation of 1.8 %: three of them.
    assert inside == pytest.approx(0.95, abs=0.054)


def drawn(spec, known, runs):
    """Place errors at the end of an outage, (runs, 3), north, east, down."""
    motion, _ = stated_motion(spec)
    imu, _ = simulate_imu(motion, ImuErrors(), rate=50.0, sampling="mean")
    time = imu.index.to_numpy()
    rate, force = imu[GYRO].to_numpy(), imu[ACCEL].to_numpy()
    first, last = (motion.trajectory(np.array([t])).iloc[0] for t in (0.0, time[-1]))
    truth = NavState.from_degrees(
        *first[["lat", "lon", "alt"]],
        v_n=tuple(first[["VN", "VE", "VD"]]),
        roll_deg=first["roll"],
        pitch_deg=first["pitch"],
        heading_deg=first["heading"],
    )
    out = np.empty((runs, 3))
    for run in range(runs):
        draws = np.random.default_rng([run, 9])
        gyro = apply(
            unit(known, "gyro", spec, draws),
            time,
            rate,
            sampling="mean",
            seed=2 * run,
            specific_force=force,
        )
        accel = apply(
            unit(known, "accel", spec, draws), time, force, sampling="mean", seed=2 * run + 1
        )
        made = motion_increments(imu_table(time, gyro, accel, sampling="mean"))
        went = run_mechanization(NorthEastDown(), wrong_start(truth, spec, draws), made)
        end = went.trajectory.iloc[-1]
        out[run] = ned_from_geodetic(
            np.array(end[["lat", "lon", "alt"]], dtype=np.float64),
            np.array(last[["lat", "lon", "alt"]], dtype=np.float64),
        )
    return out


def unit(known, triad, spec, draws):
    """One unit of a sensor, with what is left of its bias."""
    stated_sd, drift = getattr(known, triad), getattr(known, f"{triad}_drift")
    left = spec.start.gyro_bias_sd_deg_per_h / DEG_PER_HOUR
    if triad == "accel":
        left = spec.start.accel_bias_sd_ug / MICRO_G
    cross = draws.standard_normal((3, 3)) * np.array(stated_sd.axis("misalignment"))[:, None]
    np.fill_diagonal(cross, 0.0)
    by_force = draws.standard_normal((3, 3)) * np.array(stated_sd.axis("g_sensitivity"))[:, None]
    return TriadErrors(
        noise_density=stated_sd.axis("noise_density"),
        bias=tuple(left * draws.standard_normal(3)),
        bias_instability=drift.triad,
        correlation_time=drift.correlation_time,
        scale=tuple(np.array(stated_sd.axis("scale")) * draws.standard_normal(3)),
        misalignment=tuple(tuple(row) for row in cross.tolist()),
        g_sensitivity=tuple(tuple(row) for row in by_force.tolist()),
    )


def wrong_start(truth, spec, draws):
    """The true state with errors as they are stated."""
    start = spec.start
    place = start.position_sd_m * draws.standard_normal(3)
    tilt, heading = math.radians(start.tilt_sd_deg), math.radians(start.heading_sd_deg)
    psi = np.array([tilt, tilt, heading]) * draws.standard_normal(3)
    radius = 6.378e6  # half a metre of place need not be better known than to a percent
    return replace(
        truth,
        lat=truth.lat + place[0] / radius,
        lon=truth.lon + place[1] / (radius * math.cos(truth.lat)),
        alt=truth.alt - place[2],
        v_n=truth.v_n + start.velocity_sd_m_per_s * draws.standard_normal(3),
        q_nb=rotation.compose(rotation.quaternion_from_rotation_vector(psi), truth.q_nb),
    )


@pytest.mark.parametrize(
    ("motion", "quantity", "says"),
    [
        ({"turn_rate_deg_per_s": 3.0}, "--turn-rate", "stationary"),
        ({"speed_m_per_s": 100.0, "turn_rate_deg_per_s": 90.0}, "--turn-rate", "lateral"),
        ({"to_speed_m_per_s": 2000.0}, "--to-speed", "m/s²"),
    ],
)
def test_a_motion_that_cannot_be_is_refused(motion, quantity, says):
    with pytest.raises(ConfigError) as told:
        stated_motion(specify(OutageSpec, outage_s=10.0, sensor="hg9900", motion=motion))
    assert told.value.finding.quantity == quantity
    assert says in told.value.finding.what


@pytest.mark.parametrize(
    ("table", "quantity"),
    [
        ({"outage_s": 0.0}, "outage_s"),
        ({"outage_s": math.nan}, "outage_s"),
        ({"outage_s": 10.0, "places": 0}, "places"),
        ({"outage_s": 10.0, "start": {"tilt_sd_deg": -1.0}}, "start, tilt_sd_deg"),
        ({"outage_s": 10.0, "start": {"tilt": 1.0}}, "start, tilt"),
        ({"outage_s": 10.0, "aiding": {"gnss": {}}}, "aiding"),
    ],
)
def test_a_number_that_cannot_be_is_refused(table, quantity):
    with pytest.raises(ConfigError) as told:
        specify(OutageSpec, **table)
    assert told.value.finding.quantity == quantity
    assert told.value.finding.remedy


def test_the_drive_before_ends_as_the_outage_begins():
    spec = specify(OutageSpec, outage_s=20.0, motion={"speed_m_per_s": 20.0, "heading_deg": 70.0})
    motion, begin = stated_motion(spec)
    # Rounds are whole: the drive is as long as was asked for but for half of one.
    assert abs(begin - 600.0) < 100.0
    assert motion.duration == pytest.approx(begin + 20.0)
    ends = motion.trajectory(np.array([begin, motion.duration]))
    assert ends["heading"].to_numpy() == pytest.approx([70.0, 70.0], abs=1e-6)
    assert np.hypot(ends["VN"], ends["VE"]).to_numpy() == pytest.approx([20.0, 20.0])


# Outages of a run whose receiver is silent for a while and has gross errors.

TUNNEL = """
[simulation]
rate_hz = 50.0
seed = 3

[simulation.motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
heading_deg = 30.0
manoeuvres = [
  { do = "straight", duration_s = 5.0 },
  { do = "accelerate", to_km_per_h = 50.0, duration_s = 10.0 },
  { do = "straight", duration_s = 65.0 },
]

[simulation.gnss.rtk]
rate_hz = 2.0
position_noise_m = 0.02
velocity_noise_m_per_s = 0.03
outages_s = [[50.0, 65.0]]
outlier_share = 0.1

[sensors]
sensor = "adis16495-1"

[start]
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 30.0
heading_sd_deg = 1.0
position_sd_m = 0.1

[aiding.rtk]
kind = "gnss"
update_rule = { kind = "adaptive", influence = "igg3", scale = { lowest = 1.0 } }
"""


@pytest.fixture(scope="module")
def tunnel(tmp_path_factory):
    """Outages of 8 s in a drive of 80 s without fixes from 50 to 65 s."""
    file = tmp_path_factory.mktemp("tunnel") / "tunnel.toml"
    file.write_text(TUNNEL)
    return outage(file, 8.0, places=8)


def test_the_curve_is_over_outages_of_one_length(tunnel):
    begins = np.array([d.span.begin for d in tunnel.drifts])
    # The last fix before the silent stretch is at 49.5 s, the first one after it at 65.5 s; two
    # intervals of the fixes are one second.
    whole = (begins <= 50.5) | (begins >= 65.5)
    assert whole.sum() == 6
    assert [d.whole for d in tunnel.drifts] == whole.tolist()
    silent = [d.since_fix for d in tunnel.drifts if not d.whole]
    assert silent == pytest.approx(begins[~whole] - 49.0)  # at 49.5 s is a gross error
    assert tunnel.equal == tuple(d for d in tunnel.drifts if d.whole)
    _, bound, variances = tunnel.cone
    same = [d for d, one in zip(tunnel.drifts, whole, strict=True) if one]
    assert bound == pytest.approx(np.sqrt(np.mean([d.bound**2 for d in same], axis=0)))
    along = np.mean([d.variance["along"] for d in same], axis=0)
    assert variances["along"] == pytest.approx(along)
    # It goes on to the end: by more than half of what it grows a tenth of the outage earlier.
    assert bound[-1] - bound[-3] > 0.5 * (bound[-13] - bound[-15])
    # Nothing but the fixes corrects this run: what is known grows no better with time.
    assert (np.diff(bound) >= 0.0).all()
    # On the clock of the samples, 0.02 s apart.
    assert np.abs(tunnel.forecast.begin - begins[whole]).min() <= 0.02


def test_gross_errors_of_withheld_fixes_are_no_drift(tunnel):
    seen = [len(d.time) + d.rejected for d in tunnel.drifts]
    at = np.concatenate([np.arange(0.5, 49.9, 0.5), np.arange(65.5, 90.0, 0.5)])
    assert seen == [int(((at > d.span.begin) & (at <= d.span.end)).sum()) for d in tunnel.drifts]
    assert min(seen) == 0
    assert sum(d.rejected for d in tunnel.drifts) > 0
    for d in tunnel.drifts:
        # 95 % ellipses end at 2.45 standard deviations: thrice that is none of 90 fixes' noise.
        assert (d.horizontal <= 3.0 * (np.interp(d.time, tunnel.cone[0], d.bound) + 0.05)).all()


def test_outages_that_do_not_count_are_told(tunnel):
    data = outage_json(tunnel)
    assert data["outages"] == {
        "tried": 8,
        "equal_length": 6,
        "fixes_to_the_end": 4,  # those from 43 and 49 s end in the silent stretch
        "rejected_fixes": sum(d.rejected for d in tunnel.drifts),
    }
    words = cone_chart(tunnel).caption
    assert "6 outages" in words and "2 outages that begin" in words
