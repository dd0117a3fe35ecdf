"""A real crash: NHTSA test 10146, a 2018 Camry into a rigid load-cell wall at 57.09 km/h, 10 kHz.

United States government data, public. Known apart from the channels: the closing speed, the mass
of 1719 kg, and the wall's own load cells, whose impulse over the mass is the change of velocity
of the car's center of mass. There is no vehicle rate gyro and no film.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pymap3d
import pytest

from strapdown import rotation
from strapdown.crash.indices import (
    asi,
    exceeded_level,
    flail_space,
    from_start,
    hic,
    integrals,
    olc,
    thiv,
)
from strapdown.crash.severity import find_severity_model, injury_risk
from strapdown.dsp.channel_class import cfc_filter
from strapdown.formats.crash_nhtsa import accelerations, imu_of
from strapdown.formats.nhtsa import read_nhtsa
from strapdown.increments import motion_increments
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.run import run_mechanization
from strapdown.nav_state import NavState

STEP = 1e-4
G = 9.80665
ENTRY = 57.09 / 3.6
CROSSMEMBER = (93, 94, 99, 100)
# Noise of the accelerometers is 1.1-1.5 m/s² before the impact; the zero from 500 samples is so
# known to 0.06 m/s², which over 115 ms is 7 mm/s. Three of that.
ZERO_SPEED = 0.02


def channel_class(values, cfc):
    return cfc_filter(values, STEP, cfc, "sae")


def zeroed(test, number):
    series = test.channel(number).table["value"]
    time, values = series.index.to_numpy(), series.to_numpy()
    return time, values - values[time < 0.0].mean()


@pytest.fixture(scope="module")
def test(recordings):
    return read_nhtsa(recordings("crash_nhtsa_10146/v10146.EV5"))


@pytest.fixture(scope="module")
def pulse(test):
    """Mean of the four rear crossmember channels, CFC 180."""
    both = [zeroed(test, n) for n in CROSSMEMBER]
    mean = np.mean([channel_class(v, 180) for _, v in both], axis=0)
    return both[0][0], mean


def motion(time, accel):
    """Loss of velocity and way of the car from the impact on."""
    t, a = from_start(time, accel, 0.0, "start")
    velocity, way = integrals(t, a)
    return t, -velocity, ENTRY * t + way


class TestHeader:
    def test_says_what_the_test_was(self, test):
        assert "2018 TOYOTA CAMRY" in test.title
        assert test.closing_speed == pytest.approx(ENTRY)
        (vehicle,) = test.vehicles
        assert (vehicle.mass, vehicle.year, vehicle.wheelbase) == (1719.0, 2018, 2.825)
        assert len(test.channels) == 634
        assert sum(c.present for c in test.channels) == 26

    def test_says_what_is_not_there_and_what_failed(self, test):
        absent, failed = test.findings
        assert "608 of 634" in absent.what
        assert failed.quantity == "channel 96"

    def test_crossmember_channels_are_found_by_place_and_axis(self, test):
        found = accelerations(test, "FL", axis="XG", occupant="NA")
        assert tuple(c.number for c in found) == CROSSMEMBER

    def test_used_share_of_the_rating_is_that_of_the_samples(self, test):
        # An independent check of the factors: the laboratory states the share in whole per cent,
        # of the record before or after its own filter.
        for c in test.channels:
            if c.present:
                share = 100.0 * np.abs(c.table["value"]).max() / c.rating_si
                assert share == pytest.approx(c.used_percent, abs=1.0)


class TestVehicle:
    def test_delta_v_of_each_crossmember_channel(self, test):
        measured = {93: 18.34, 94: 18.56, 99: 18.72, 100: 18.51}
        for number, expected in measured.items():
            time, values = zeroed(test, number)
            t, lost, _ = motion(time, channel_class(values, 180))
            at_115 = float(np.interp(0.115, t, lost))
            assert at_115 == pytest.approx(expected, abs=ZERO_SPEED)
            assert 18.35 - ZERO_SPEED <= at_115 <= 18.72 + ZERO_SPEED

    def test_dynamic_crush(self, test):
        for number in CROSSMEMBER:
            time, values = zeroed(test, number)
            t, _, crush = motion(time, channel_class(values, 180))
            k = int(np.argmax(crush))
            # The zero's 0.06 m/s² over 73 ms is 0.2 mm; the gain's 1 %, 4 mm of what braking takes.
            assert 0.73 - 0.004 <= crush[k] <= 0.75 + 0.004
            assert t[k] == pytest.approx(0.073, abs=0.0015)

    def test_barrier_impulse_beside_it(self, recordings, test, pulse):
        path = recordings("crash_nhtsa_10146/barrier_force_sum.csv")
        time, force = np.loadtxt(path, delimiter=",", skiprows=1).T
        within = (time >= 0.0) & (time <= 0.115)
        impulse = -np.trapezoid(force[within], time[within])
        assert impulse == pytest.approx(32853.0, abs=1.0)
        by_wall = impulse / test.vehicles[0].mass
        assert by_wall == pytest.approx(19.11, abs=0.005)
        _, lost, _ = motion(*pulse)
        # The rear of the car is another point than its center of mass: 2 to 4 % less.
        share = by_wall / lost[1150] - 1.0
        assert 0.02 <= share <= 0.045

    def test_signs_are_those_of_sae_j211(self, pulse):
        # Stopped from the front: negative forward acceleration, and it rebounds.
        time, accel = pulse
        _, lost, _ = motion(time, accel)
        slow = channel_class(accel, 60)
        assert slow[(time > 0.03) & (time < 0.06)].max() < 0.0
        assert ENTRY < lost.max() < 1.25 * ENTRY

    def test_indices(self, pulse):
        time, accel = pulse
        plane = np.column_stack([accel, np.zeros_like(accel), np.zeros_like(accel)])
        # A rigid wall is worse than every class of barrier: A, B and C of EN 1317-2 end at ASI
        # 1.0, 1.4 and 1.9, and THIV at 33 km/h. Two averages of one thing differ by a seventh.
        old, new = asi(time, plane, average="mean_50ms"), asi(time, plane)
        both = asi(time, plane, cutoff="pass")
        assert (old.value, new.value) == pytest.approx((2.37, 2.73), abs=0.01)
        assert both.value == pytest.approx(2.54, abs=0.01)
        head = thiv(time, plane)
        assert head.surface == "front"
        assert 3.6 * head.velocity == pytest.approx(64.6, abs=0.1)
        # The head meets the front at 84 ms, when the pulse is nearly over; the 10 Hz filter
        # still lets in what was before.
        assert head.phd_g == pytest.approx(4.70, abs=0.05)
        assert thiv(time, plane, phd_average="butterworth_10hz").phd_g > 3.0 * head.phd_g
        flail = flail_space(time, plane)
        assert flail.oiv_x == pytest.approx(head.velocity, rel=1e-9)
        assert flail.oiv_x < motion(time, accel)[1].max()
        # The mean deceleration over the whole stop, V²/2s, with the restraint's 0.3 m added to
        # the crush, is what no restraint can go below: 12.3 g; a car of its class has 25 to 35.
        load = olc(time, accel)
        assert load.value_g == pytest.approx(29.6, abs=0.1)
        assert load.value_g > ENTRY**2 / (2.0 * (0.741 + 0.3)) / G

    def test_injury_risk_of_this_delta_v(self, pulse):
        lost = float(motion(*pulse)[1].max())
        model = find_severity_model("wang_2022_front_mais3")
        inputs = {"delta_v": lost, "crash_type": "front"}
        risk = injury_risk(model, inputs, {"delta_v": 0.2})
        # 41.5 mph: -6.9774 + 0.1620 * 41.5 = -0.25.
        assert risk.probability == pytest.approx(0.44, abs=0.01)
        assert 0.39 < risk.low < risk.probability < risk.high < 0.48


@dataclass(frozen=True)
class HeadPath:
    time: np.ndarray
    # Relative to the rear crossmember, which moves along north: north, east, down in m and m/s.
    place: np.ndarray
    velocity: np.ndarray
    angles_deg: np.ndarray
    turned_deg: np.ndarray


@pytest.fixture(scope="module")
def navigate(test):
    """A function that navigates a head and gives its path in the car."""
    both = [zeroed(test, n) for n in CROSSMEMBER]
    time, accel = both[0][0], np.mean([v for _, v in both], axis=0)
    gained, moved = integrals(time, accel)
    car_speed, car_place = ENTRY + gained, ENTRY * (time - time[0]) + moved

    def run(accel_numbers, gyro_numbers, *, signs=(1.0, 1.0, 1.0), pitch_deg=0.0):
        pitch = np.deg2rad(pitch_deg)
        force = (G * np.sin(pitch), 0.0, -G * np.cos(pitch))
        imu = imu_of(test, accel_numbers, gyro_numbers, rest_force=force)
        attrs = dict(imu.attrs)
        imu[["gyro_x", "gyro_y", "gyro_z"]] *= np.asarray(signs)
        imu.attrs = attrs
        # The wall is north; the place on Earth is free, and its rate of 4 mdeg/s no matter.
        start = NavState.from_degrees(
            42.0, -83.0, v_n=(ENTRY, 0.0, 0.0), pitch_deg=pitch_deg, time=float(time[0])
        )
        path = run_mechanization(NorthEastDown(), start, motion_increments(imu)).trajectory
        ned = pymap3d.geodetic2ned(
            path["lat"].to_numpy(), path["lon"].to_numpy(), path["alt"].to_numpy(), 42.0, -83.0, 0.0
        )
        place = np.column_stack(ned).copy()
        velocity = path[["VN", "VE", "VD"]].to_numpy(copy=True)
        place[:, 0] -= car_place
        velocity[:, 0] -= car_speed
        angles = path[["roll", "pitch", "heading"]].to_numpy()
        q = rotation.quaternion_from_euler(angles)
        turned = np.rad2deg(2.0 * np.arccos(np.clip(np.abs(q[:, 0]), 0.0, 1.0)))
        return HeadPath(time, place, velocity, angles, turned)

    return run


DRIVER, DRIVER_TWIN, DRIVER_GYRO = (1, 2, 3), (4, 5, 6), (101, 102, 103)
PASSENGER, PASSENGER_TWIN, PASSENGER_GYRO = (47, 48, 49), (50, 51, 52), (104, 105, 106)


class TestHeads:
    """The heads in six degrees of freedom: what can be known of them without a film."""

    def test_gravity_is_not_in_the_record(self, test):
        # Zeroed before the impact: 0.05 g at most, where an upright head reads -1 g.
        for number in (*DRIVER, *DRIVER_TWIN, *PASSENGER, *PASSENGER_TWIN):
            table = test.channel(number).table["value"]
            assert abs(table[table.index < 0.0].mean()) < 0.05 * G

    def test_before_the_impact_the_head_drives_along(self, navigate):
        path = navigate(DRIVER, DRIVER_GYRO)
        k = int(np.searchsorted(path.time, 0.0))
        # Zeros are taken from this stretch, so its ends meet by construction; the noise of the
        # gyros, 0.17 rad/s at 10 kHz, walks 0.17 sqrt(500) 1e-4 = 0.02 deg.
        assert np.abs(path.velocity[k]).max() < 0.02
        assert path.turned_deg[: k + 1].max() < 0.3

    @pytest.mark.parametrize(
        ("accel", "gyro", "forward", "turn"),
        [(DRIVER, DRIVER_GYRO, 0.47, 77.0), (PASSENGER, PASSENGER_GYRO, 0.29, 27.0)],
    )
    def test_excursion_and_turn(self, navigate, accel, gyro, forward, turn):
        path = navigate(accel, gyro)
        # A belted head with an airbag moves by a third to half a metre in such a test.
        assert path.place[:, 0].max() == pytest.approx(forward, abs=0.01)
        assert path.turned_deg.max() == pytest.approx(turn, abs=1.0)
        # The head neither leaves its seat sideways nor the roof.
        assert np.abs(path.place[:, 1:]).max() < 0.15
        # The nod comes first, and forward: about -Y in these axes.
        early = (path.time > 0.03) & (path.time < 0.06)
        assert path.angles_deg[early, 1].max() < 0.0

    @pytest.mark.parametrize(
        ("accel", "gyro", "closure", "speed"),
        [(DRIVER, DRIVER_GYRO, 0.08, 1.6), (PASSENGER, PASSENGER_GYRO, 0.15, 2.0)],
    )
    def test_it_comes_back_to_where_it_was(self, navigate, accel, gyro, closure, speed):
        # After 0.3 s and half a metre each way it is back where it started, before its head
        # restraint: what the restraint gives is the only thing known of that instant.
        path = navigate(accel, gyro)
        assert np.linalg.norm(path.place[-1]) < closure
        assert np.linalg.norm(path.velocity[-1]) < speed

    def test_redundant_triads_agree(self, navigate):
        for one, two, gyro in (
            (DRIVER, DRIVER_TWIN, DRIVER_GYRO),
            (PASSENGER, PASSENGER_TWIN, PASSENGER_GYRO),
        ):
            a, b = navigate(one, gyro), navigate(two, gyro)
            # The integrals of single channels differ by up to 0.29 m/s, which grow evenly:
            # half of it over 0.3 s, and on three axes.
            assert np.abs(a.place - b.place).max() < 0.5 * 0.29 * 0.3 * np.sqrt(3.0)
            assert np.abs(a.velocity - b.velocity).max() < 0.29 * np.sqrt(3.0)
            assert a.place[:, 0].max() == pytest.approx(b.place[:, 0].max(), abs=0.005)

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_another_sign_of_a_rate_does_not_close(self, navigate, axis):
        signs = [1.0, 1.0, 1.0]
        signs[axis] = -1.0
        right, wrong = navigate(DRIVER, DRIVER_GYRO), navigate(DRIVER, DRIVER_GYRO, signs=signs)
        assert np.linalg.norm(wrong.place[-1]) > 10.0 * np.linalg.norm(right.place[-1])

    def test_how_much_the_unknown_first_pitch_matters(self, navigate):
        # That the head stood upright is assumed. 5 deg would leave it 0.4 m too high or too low
        # at the end, so that the closure itself says that it stood so to about a degree.
        level = navigate(DRIVER, DRIVER_GYRO)
        for pitch, down in ((5.0, 0.46), (-5.0, -0.36)):
            tilted = navigate(DRIVER, DRIVER_GYRO, pitch_deg=pitch)
            assert tilted.place[-1, 2] == pytest.approx(down, abs=0.03)
            assert tilted.place[:, 0].max() == pytest.approx(level.place[:, 0].max(), abs=0.015)

    @pytest.mark.parametrize(
        ("one", "two", "hic15"), [(DRIVER, DRIVER_TWIN, 140.0), (PASSENGER, PASSENGER_TWIN, 334.0)]
    )
    def test_head_injury_criterion(self, test, one, two, hic15):
        found = []
        for numbers in (one, two):
            channels = [zeroed(test, n) for n in numbers]
            accel = np.column_stack([channel_class(v, 1000) for _, v in channels])
            found.append(hic(channels[0][0], accel).value)
            assert hic(channels[0][0], accel, longest=0.036).value > found[-1]
        # Far below the limit of 700 of FMVSS 208, as in every car of its year; twins differ by
        # 2.5 times what their gains do.
        assert found == pytest.approx([hic15, hic15], rel=0.01)

    @pytest.mark.parametrize(
        ("numbers", "hic15", "hic36", "clip"),
        [
            (DRIVER, 139.1478979007297, 268.3036430006184, 41.866199078135445),
            (DRIVER_TWIN, 139.13344058399156, 269.38446883251737, 41.988650436136616),
            (PASSENGER, 333.1044978380418, 547.8043836095833, 57.259242121458236),
            (PASSENGER_TWIN, 329.87871450530747, 543.9780609149768, 56.72343546070451),
        ],
    )
    def test_indices_of_the_heads_by_pyisomme(self, test, numbers, hic15, hic36, clip):
        """Values of pyisomme 1.1.0 (MIT licence), from the same files by its own filter."""
        channels = [test.channel(n).table["value"] for n in numbers]
        time = channels[0].index.to_numpy()
        accel = np.column_stack([cfc_filter(c.to_numpy(), STEP, 1000) for c in channels])
        for longest, value in ((0.015, hic15), (0.036, hic36)):
            # Its longest window ends a sample before ours wherever the stamps are so rounded.
            shorter, whole = (hic(time, accel, longest=s).value for s in (longest - STEP, longest))
            assert shorter * (1.0 - 1e-6) <= value <= whole * (1.0 + 1e-6)
            assert shorter == pytest.approx(whole, rel=0.01)
        size = np.sqrt((accel**2).sum(axis=1)) / G
        assert exceeded_level(time, size) == pytest.approx(clip, rel=1e-6)

    def test_occupant_load_criterion_by_pyisomme(self, pulse):
        # pyisomme 1.1.0: 29.671 g, at samples; a sample of 0.1 ms of some 30 ms is 0.3 %.
        assert olc(*pulse).value_g == pytest.approx(29.671, rel=0.004)


def test_the_case_has_the_indices_of_vehicle_and_occupants(recordings, tmp_path):
    from strapdown import reconstruct

    folder = recordings("crash_nhtsa_10146")
    text = (Path(__file__).parent / "cases" / "nhtsa_10146.toml").read_text(encoding="utf-8")
    case = tmp_path / "case.toml"
    case.write_text(text.replace("STRAPDOWN_DATA", folder.parent.as_posix()), encoding="utf-8")
    found = reconstruct(case).indices
    head = {i.channels: i.value for i in found if i.name == "HIC15"}
    assert set(head) == {
        tuple(str(n) for n in numbers)
        for numbers in (DRIVER, DRIVER_TWIN, PASSENGER, PASSENGER_TWIN)
    }
    # As recorded, instead of less the mean before the impact: 0.05 g of some 40 g.
    assert head["1", "2", "3"] == pytest.approx(140.0, rel=0.005)
    vehicle = {(i.name, i.standard): i for i in found if not i.channels}
    # At the common stamps of 200 Hz, beside those of all samples in CFC 180 above.
    for key, value in (
        (("OLC", "Euro NCAP TB 027"), 29.6),
        (("ASI", "EN 1317-1:2010"), 2.73),
        (("ASI", "EN 1317-1:1998"), 2.37),
        (("THIV", "EN 1317-1; MASH"), 64.6 / 3.6),
    ):
        index = vehicle[key]
        assert index.low < value < index.high
        assert index.value == pytest.approx(value, rel=0.015)


def test_a_case_that_names_the_header_is_the_same_from_its_sealed_copy(recordings, tmp_path):
    from strapdown.config.crash_case import CaseSpec
    from strapdown.crash.case import whole_records

    folder = recordings("crash_nhtsa_10146")
    text = (Path(__file__).parent / "cases" / "nhtsa_10146.toml").read_text(encoding="utf-8")
    case = tmp_path / "case.toml"
    case.write_text(text.replace("STRAPDOWN_DATA", folder.parent.as_posix()), encoding="utf-8")
    records, spec = whole_records(CaseSpec.read(case))
    again, same = whole_records(spec)
    assert list(records) == list(again) == [str(folder)]
    assert [r.path for r in records.values()] == [r.path for r in again.values()] == [folder]
    assert same == spec
