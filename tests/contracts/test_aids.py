"""What every aid promises, held for every entry of the table."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.aiding_sensors import (
    Compass,
    FieldSensor,
    PressureHeight,
    VelocityLog,
    WheelSpeed,
    simulate_barometer,
    simulate_body_velocity,
    simulate_heading,
    simulate_magnetometer,
    simulate_odometer,
)

from aid_views import SITUATIONS, Moment, difference_columns, moment_of, view_of
from aided_drives import drive, gnss_of, increments_of, navigator_of, run
from strapdown import rotation
from strapdown.mechanization import MECHANIZATIONS
from strapdown.navigation.measurements import AIDS
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.measurement import (
    ImuDerivedMeasurement,
    Measurement,
    TabulatedMeasurement,
)
from strapdown.navigation.measurements.standstill import ZeroRate, ZeroVelocity
from strapdown.navigation.measurements.vehicle import BodyVelocity, NoSlip, Odometer
from strapdown.tables import (
    barometer_table,
    body_velocity_table,
    gnss_table,
    heading_table,
    odometer_table,
)

#: Where sensors sit in the vehicle of these tests, and how they are turned.
PLACE, TURN = (1.3, -0.4, -0.2), (3.0, -6.8, 5.4)


@dataclass(frozen=True)
class Case:
    """How an aid is tried.

    Attributes
    ----------
    aid : Aid
        With every state that it can have.
    values : callable
        Of a `Moment`: what it is told there, rows of its epochs.
    situations : tuple of str
        Where all that it assumes is true.
    size : float
        Of what it measures along axes of the place, in its unit.
    """

    aid: Measurement
    values: Callable[[Measurement, Moment], np.ndarray]
    situations: tuple[str, ...] = tuple(SITUATIONS)
    size: float = 20.0


def fix(aid, moment):
    place, velocity = moment.antenna(aid.lever_arm)
    table = gnss_table(*twice(moment, place, velocity), [0.1] * 3, [0.1] * 3)
    return aid.epochs(table).values[:2]


def twice(moment, *values):
    """Stamps and values of two rows: a table of one says nothing of its units."""
    return [moment.time, moment.time + 1.0], *([value] * 2 for value in values)


def felt(aid, moment):
    return np.concatenate([moment.rate, moment.force])[None, :]


def rested(aid, moment):
    return np.concatenate([[100.0], moment.rate, moment.force, [1e-6] * 3])[None, :]


def at_point(aid, moment):
    """Velocity of a point of the body, in axes of the vehicle."""
    _, velocity = moment.antenna(aid.lever_arm)
    C_vb = rotation.dcm_from_euler([aid.roll_deg, aid.pitch_deg, aid.yaw_deg])
    return C_vb @ rotation.dcm_from_quaternion(moment.state.q_nb).T @ velocity


def rolled(aid, moment):
    speed = at_point(aid, moment)[0]
    return aid.epochs(odometer_table(*twice(moment, speed), 0.1)).values[:1]


def seen(aid, moment):
    velocity = at_point(aid, moment)
    return aid.epochs(body_velocity_table(*twice(moment, velocity), [0.1, 0.2, 0.3])).values[:1]


def high(aid, moment):
    place, _ = moment.antenna(aid.lever_arm)
    return aid.epochs(barometer_table(*twice(moment, place[2]), 1.0)).values[:1]


def pointed(aid, moment):
    """A baseline that is not along the body, and a reading that wants its declination."""
    angle = np.radians(aid.axis_deg)
    axis = rotation.rotate(moment.state.q_nb, [np.cos(angle), np.sin(angle), 0.0])
    azimuth = np.degrees(np.arctan2(axis[1], axis[0])) - aid.added_deg
    return aid.epochs(heading_table(*twice(moment, azimuth), 1.0)).values[:1]


def magnetic(aid, moment):
    """The stated field along the axes of the body."""
    C_nb = rotation.dcm_from_quaternion(moment.state.q_nb)
    return (C_nb.T @ aid.field_ned)[None, :]


ANGLES = {"roll_deg": TURN[0], "pitch_deg": TURN[1], "yaw_deg": TURN[2]}
AXLE = tuple(Moment.axle_from_sensors(PLACE, TURN))
CASES = {
    "gnss": Case(Gnss(name="rtk"), fix),
    "zero_velocity": Case(ZeroVelocity(name="rest"), rested, ("rest",)),
    "zero_rate": Case(ZeroRate(name="still"), rested, ("rest",)),
    "no_slip": Case(
        NoSlip(
            name="wheels",
            lever_arm=AXLE,
            mounting_sd_deg=(5.0, 5.0),
            compliance_sd_deg_per_g=(4.0, 2.0),
            **ANGLES,
        ),
        felt,
    ),
    "odometer": Case(
        Odometer(name="left", lever_arm=(-1.0, -0.7, 0.4), scale_sd=0.02, **ANGLES), rolled
    ),
    "body_velocity": Case(
        BodyVelocity(
            name="log",
            lever_arm=(0.3, 0.2, 1.5),
            mounting_sd_deg=(3.0, 3.0, 3.0),
            scale_sd=0.01,
            **ANGLES,
        ),
        seen,
    ),
    "barometer": Case(Barometer(name="baro", lever_arm=(0.3, 0.2, -1.5)), high),
    "heading": Case(
        Heading(name="compass", axis_deg=70.0, added_deg=3.5, misalignment_sd_deg=5.0), pointed
    ),
    "magnetometer": Case(
        Magnetometer(name="mag", field_ned=FieldSensor().field_ned), magnetic, size=50.0
    ),
}
CASE_NAMES = list(CASES)
#: Each kind where it holds.
TRUE = [(kind, situation) for kind, case in CASES.items() for situation in case.situations]


def test_every_kind_is_tried():
    assert set(CASES) == set(AIDS)


@pytest.mark.parametrize("kind", CASE_NAMES)
def test_it_says_what_it_is(kind):
    aid = CASES[kind].aid
    assert type(aid) is AIDS[kind]
    assert aid.kind == kind
    assert aid.summary and aid.source
    assert isinstance(aid, TabulatedMeasurement | ImuDerivedMeasurement)
    assert all(s.block.name.startswith(f"{aid.name}.") for s in aid.states())


@pytest.mark.parametrize("mechanization", ["ned", "wander_azimuth"])
@pytest.mark.parametrize(("kind", "situation"), TRUE)
def test_what_is_true_is_what_is_computed(kind, mechanization, situation):
    """Beside rounding: over an arm of 1.5 m the ellipsoid falls from its plane by 1.8e-7 m."""
    aid = CASES[kind].aid
    moment = moment_of(situation, PLACE, TURN)
    view = view_of(MECHANIZATIONS[mechanization](), aid, moment)
    for values in CASES[kind].values(aid, moment):
        for one in aid.observe(view, values):
            np.testing.assert_allclose(one.z, 0.0, atol=2e-7)
            assert (one.R > 0.0).all()
            assert one.name.startswith(f"{aid.name}.")
            assert len(one.labels) == len(one.z) == len(one.R) == len(one.H)


@pytest.mark.slow
@pytest.mark.parametrize("mechanization", ["ned", "wander_azimuth"])
@pytest.mark.parametrize(("kind", "situation"), TRUE)
def test_every_column_is_how_an_error_changes_the_difference(kind, mechanization, situation):
    """Where the states of the aid are estimated to be something, too.

    What is measured along the axes of a place turns with it, by its size over the Earth's radius a
    metre: 20 m/s and the meridians' convergence at 48 deg make 7e-6, which no aid need know.
    """
    aid = CASES[kind].aid
    moment = moment_of(situation, PLACE, TURN)
    used = MECHANIZATIONS[mechanization]()
    estimated = 0.05
    for values in CASES[kind].values(aid, moment):
        for k, one in enumerate(aid.observe(view_of(used, aid, moment, None, estimated), values)):
            found = difference_columns(used, aid, moment, values, k, estimated)
            turned = 0.5e-6 * CASES[kind].size
            np.testing.assert_allclose(found[:, :3], one.H[:, :3], rtol=1e-6, atol=turned)
            np.testing.assert_allclose(found[:, 3:], one.H[:, 3:], rtol=1e-6, atol=2e-6)


# --- watching in pieces ------------------------------------------------------------------

WATCHING = [kind for kind in CASE_NAMES if isinstance(CASES[kind].aid, ImuDerivedMeasurement)]


@pytest.mark.parametrize("kind", WATCHING)
def test_samples_watched_in_pieces_tell_the_same_to_the_last_bit(kind):
    aid = CASES[kind].aid
    time, rows = increments_of(drive(), 0)
    _, whole = aid.watch(aid.begin(), time, rows)
    assert 10 < len(whole.time) < len(time)
    assert np.isin(whole.time, time).all()
    for pieces in (np.array_split(np.arange(1500), 11), [[i] for i in range(700)]):
        memory, told = aid.begin(), []
        for cut in pieces:
            before = pickle.dumps(memory)
            after, epochs = aid.watch(memory, time[cut], rows[cut])
            assert pickle.dumps(memory) == before
            memory = after
            told.append(epochs)
        upto = np.searchsorted(whole.time, time[pieces[-1][-1]], side="right")
        np.testing.assert_array_equal(np.concatenate([e.time for e in told]), whole.time[:upto])
        np.testing.assert_array_equal(np.concatenate([e.values for e in told]), whole.values[:upto])


@pytest.mark.parametrize("kind", WATCHING)
def test_nothing_watched_tells_nothing(kind):
    aid = CASES[kind].aid
    _, epochs = aid.watch(aid.begin(), np.empty(0), np.empty((0, 10)))
    assert len(epochs.time) == len(epochs.values) == 0


# --- together ---------------------------------------------------------------------------


def of_both(kind):
    """Two aids of a kind, each with a name, and what both are told of a drive."""
    one = CASES[kind].aid
    both = (replace(one, name="first"), replace(one, name="second"))
    made = {
        "gnss": lambda: gnss_of(drive(), 0),
        "odometer": lambda: simulate_odometer(drive(), WheelSpeed(rate=2.0)),
        "body_velocity": lambda: simulate_body_velocity(drive(), VelocityLog(rate=2.0)),
        "barometer": lambda: simulate_barometer(drive(), PressureHeight(rate=2.0)),
        "heading": lambda: simulate_heading(drive(), Compass(rate=2.0)),
        "magnetometer": lambda: simulate_magnetometer(drive(), FieldSensor(rate=2.0)),
    }
    return both, {aid.name: made[kind]() for aid in both} if kind in made else {}


@pytest.mark.parametrize("kind", CASE_NAMES)
def test_two_of_a_kind_observe_side_by_side_and_in_pieces(kind):
    aids, tables = of_both(kind)
    navigator = navigator_of(aids)
    whole, pieces = run(navigator, drive(), 0, tables, until=20.0)
    seen = [one for piece in pieces for one in piece.seen]
    names = {one.name.split(".")[0] for one in seen}
    assert names == {"first", "second"}
    labels = list(navigator.filter.model.layout.labels())
    assert len(set(labels)) == len(labels)
    cut, _ = run(navigator, drive(), 0, tables, until=20.0, pieces=13)
    np.testing.assert_array_equal(cut.engine.mechanization, whole.engine.mechanization)
    np.testing.assert_array_equal(cut.engine.filter.covariance, whole.engine.filter.covariance)
    np.testing.assert_array_equal(cut.engine.filter.sensors, whole.engine.filter.sensors)
