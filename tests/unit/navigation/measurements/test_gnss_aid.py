"""What a receiver observes: against exact motions, and every column against central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded

from strapdown import earth, rotation
from strapdown._kernels.sums import steady_motion
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, accel_scale, gyro_bias, gyro_scale
from strapdown.frames import antenna_motion
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import View
from strapdown.tables import POSITION_SD, VELOCITY_SD, gnss_table

ARM = (1.2, -0.4, -0.9)
START = NavState.from_degrees(
    55.0, 37.0, 300.0, v_n=[30.0, -20.0, 1.0], roll_deg=5.0, pitch_deg=-3.0, heading_deg=200.0
)
RATE = np.array([0.3, -0.5, 0.8])
FORCE = np.array([2.0, -1.5, -9.6])
AID = Gnss(
    name="rtk",
    lever_arm=ARM,
    lever_arm_sd=0.1,
    time_offset_sd=0.2,
    position_correlated_share=0.6,
)
BLOCKS = (gyro_bias(1e-4), accel_bias(1e-2), gyro_scale(1e-3), accel_scale(1e-3))


def table_of(place_deg, velocity, sd=0.01, **more):
    return gnss_table([10.0], [place_deg], [velocity], (sd,) * 3, (sd,) * 3, **more)


def view_of(name, aid=AID, start=START, blocks=BLOCKS):
    used = MECHANIZATIONS[name]()
    state = used.begin(start)
    model = RotationVectorModel(sensors=(*blocks, *aid.states()))
    sensors = np.zeros(model.physical_size - 9)
    return seen(used, model, state, sensors)


def seen(used, model, state, sensors):
    felt = np.concatenate([[1.0], RATE, FORCE])
    return View(
        used,
        model,
        0.0,
        state,
        used.history_row(state),
        sensors,
        RATE - np.tensordot(felt, model.stacked.gyro, 1) @ sensors,
        FORCE - np.tensordot(felt, model.stacked.accel, 1) @ sensors,
    )


def rows_of(aid, table):
    values = aid.epochs(table).values
    return [values[values[:, 0] == code][0] for code in (0.0, 1.0)]


@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
def test_the_place_and_velocity_of_the_antenna_are_those_of_the_body_and_its_arm(name):
    aid = Gnss(name="rtk", lever_arm=ARM)
    place, velocity = antenna_motion([[55.0, 37.0, 300.0]], [START.v_n], [START.q_nb], [RATE], ARM)
    view = view_of(name, aid)
    position, speed = (
        aid.observe(view, row)[0] for row in rows_of(aid, table_of(place[0], velocity[0]))
    )
    # 1e-9 m of a displacement between places, and as much of degrees as text: 1e-15 of 6.4e6 m.
    assert np.abs(position.z).max() < 2e-8
    assert np.abs(speed.z).max() < 1e-12
    assert (position.name, speed.name) == ("rtk.position", "rtk.velocity")


@pytest.mark.parametrize("late", [0.0, -0.15])
@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
def test_every_column_is_the_central_difference_of_the_nonlinear_observation(name, late):
    view = view_of(name)
    base = view.sensors.copy()
    base[view.place("rtk.time_offset").start - 9] = late
    base[view.place("rtk.lever_arm").start - 9 : view.place("rtk.lever_arm").stop - 9] = 0.05
    used, model, state = view.mechanization, view.model, view.state
    for row in rows_of(AID, table_of([55.0001, 37.0001, 310.0], [29.0, -19.0, 0.0])):
        H = AID.observe(seen(used, model, state, base), row)[0].H
        for j in range(model.physical_size):
            step = 1e-4 if j >= 6 else 1e-1
            error = np.zeros(model.physical_size)
            error[j] = step
            z = [
                AID.observe(
                    # An error is state less truth, and that of a sensor what is left of it.
                    seen(used, model, used.correct(state, -s * error[:9]), base - s * error[9:]),
                    row,
                )[0].z
                for s in (1.0, -1.0)
            ]
            found = (z[0] - z[1]) / (2.0 * step)
            # The observation is along north-east-down of the computed place, which turns by
            # step / R; H holds the axes: what is observed (velocity 36 m/s, place 15 m) turns by
            # 1.6e-7 a metre, tan(55 deg) times as much about the vertical. Gravity changes by
            # 3.1e-6 1/s² t²/2. Rounding: 2e-9 m over the step.
            turns = (40.0 if row[0] else 20.0) * 2.0 * 1.6e-7 if j < 3 else 0.0
            rounding = 4e-9 / step
            # Cubes of steps: a vector of 12 m/s² t²/2 or of the arm turned by the step, or the
            # product of an arm and the squares of the rates.
            cubes = 30.0 * step**2 if j >= 6 else 0.0
            assert np.abs(found - H[:, j]).max() < turns + rounding + cubes + 1e-7, j


def test_an_offset_of_time_is_met_to_the_second_order():
    # A body on a circle on the plane: f = centripetal, no jerk in body axes.
    aid = Gnss(name="rtk", lever_arm=ARM, time_offset_sd=0.2)
    used = MECHANIZATIONS["ned"]()
    speed, turn, height = 10.0, 0.3, 300.0
    start = NavState.from_degrees(40.0, 10.0, height, v_n=[speed, 0.0, 0.0])
    spin = earth.earth_rate(40.0)
    rate = np.array([0.0, 0.0, turn]) + spin
    v = start.v_n
    acceleration = np.array([0.0, speed * turn, 0.0])
    force = acceleration - earth.gravity(40.0, height) + 2.0 * np.cross(spin, v)
    model = RotationVectorModel(sensors=aid.states())
    state = used.begin(start)
    for late in (0.1, 0.2):
        angle = turn * late
        moved = speed / turn * np.array([np.sin(angle), 1.0 - np.cos(angle), 0.0])
        C = rotation.dcm_from_rotation_vector(np.array([0.0, 0.0, angle]))
        moved += C @ np.array(ARM)
        fast = C @ (v + np.cross([0.0, 0.0, turn], ARM))
        truth = used.nav_state(used.correct(state, np.r_[-moved, np.zeros(6)]), 0.0)
        place = [np.degrees(truth.lat), np.degrees(truth.lon), truth.alt]
        # The offset that was assumed is too large by `late`, and the filter has found it.
        view = View(used, model, 0.0, state, used.history_row(state), np.array([late]), rate, force)
        z = [aid.observe(view, row)[0].z for row in rows_of(aid, table_of(place, fast))]
        # Jerk of the antenna: its speed times turn²; the last term of the curved Earth, v²/R t²/2.
        jerk = (speed + 1.5 * turn) * turn**2
        assert np.abs(z[0]).max() < jerk * late**3 / 6.0 + speed**2 / 6.3e6 * late**2 + 3e-8
        assert np.abs(z[1]).max() < jerk * late**2 / 2.0 + 2.0 * speed**2 / 6.3e6 * late
        # And without the second order it would not be met.
        assert 0.5 * np.linalg.norm(acceleration) * late**2 > 10.0 * jerk * late**3 / 6.0


def test_the_acceleration_is_that_without_the_shaking():
    view = view_of("ned")
    row = rows_of(AID, table_of([55.0, 37.0, 300.0], [30.0, -20.0, 1.0]))[1]
    felt = np.r_[RATE, FORCE]
    shaken = replace(view, force=FORCE + np.array([3.0, -2.0, 1.0]), steady=felt)
    assert (AID.observe(shaken, row)[0].H == AID.observe(view, row)[0].H).all()
    assert AID.wants_steady
    assert not replace(AID, time_offset_sd=0.0).wants_steady


def test_a_force_that_stays_in_inertial_axes_is_steady_in_a_turn():
    rows = np.zeros((400, 10))
    turn = np.array([0.2, -0.3, 1.0])
    gravity = np.array([0.1, 0.2, -9.8])
    for k, row in enumerate(rows):
        C = rotation.dcm_from_rotation_vector((k + 1) * 0.01 * turn)
        row[:7] = [0.01, *(0.01 * turn), *(0.01 * (C.T @ gravity))]
    out, memory = np.empty((400, 6)), np.zeros(7)
    steady_motion(rows, 0.2, memory, out)
    # Turns to second order: (1e-2)³/6 a step over the 20 steps of the memory, times 9.8.
    assert np.abs(out[-1, 3:] - C.T @ gravity).max() < 20 * 0.0106**3 / 6.0 * 9.8 + 1e-12
    assert np.abs(out[-1, :3] - turn).max() < 1e-12
    pieces, again = np.empty((400, 6)), np.zeros(7)
    for lo in range(0, 400, 37):
        steady_motion(rows[lo : lo + 37], 0.2, again, pieces[lo : lo + 37])
    assert (pieces == out).all()


def test_epochs_are_where_the_fixes_were_made():
    aid = Gnss(name="rtk", time_offset=0.1, velocity_delay=0.125)
    time = np.array([10.0, 10.25, 10.5])
    table = gnss_table(
        time, np.tile([40.0, 10.0, 0.0], (3, 1)), np.zeros((3, 3)), (1,) * 3, (1,) * 3
    )
    epochs = aid.epochs(table)
    of_place = epochs.values[:, 0] == 0.0
    assert epochs.time[of_place] == pytest.approx(time - 0.1, abs=1e-12)
    assert epochs.time[~of_place] == pytest.approx(time - 0.225, abs=1e-12)
    assert (np.diff(epochs.time) >= 0.0).all()


def test_stated_deviations_have_factors_and_floors_and_qualities_are_chosen():
    aid = Gnss(name="rtk", position_sd_factor=3.0, least_velocity_sd=0.05, use_velocity=True)
    place, speed = rows_of(aid, table_of([40.0, 10.0, 0.0], [0.0, 0.0, 0.0], sd=0.01))
    assert place[4:7] == pytest.approx(0.03**2)
    assert speed[4:7] == pytest.approx(0.05**2)
    guessed = table_of([40.0, 10.0, 0.0], [0.0, 0.0, 0.0], quality=[6])
    assert not aid.epochs(guessed).time.size
    assert Gnss(name="x", qualities=(6,)).epochs(guessed).time.size == 2
    only = Gnss(name="x", use_velocity=False)
    assert (only.epochs(table_of([40.0, 10.0, 0.0], [0.0] * 3)).values[:, 0] == 0.0).all()


def test_a_fix_that_claims_to_be_exact_is_refused_with_the_option_that_helps():
    table = table_of([40.0, 10.0, 0.0], [0.0, 0.0, 0.0], sd=0.0)
    with pytest.raises(DataError, check=coded("navigation.sd-zero-in-rows")):
        Gnss(name="rtk").epochs(table)
    least = Gnss(name="rtk", least_position_sd=0.1, least_velocity_sd=0.1)
    assert least.epochs(table).time.size == 2


@pytest.mark.parametrize(
    ("options", "quantity"),
    [
        ({"lever_arm": (1.0, np.nan, 0.0)}, "lever_arm"),
        ({"lever_arm_sd": -1.0}, "lever_arm"),
        ({"time_offset_sd": 60.0}, "time_offset_sd"),
        ({"velocity_delay": -0.1}, "velocity_delay"),
        ({"use_position": False, "use_velocity": False}, "use_position"),
        ({"qualities": (0,)}, "qualities"),
        ({"time_offset_drift": 1e-3}, "time_offset_drift"),
        ({"clock_unsure": ((60.0, 0.2),)}, "clock_unsure"),
        ({"clock_unsure": ((60.0, 0.0),), "time_offset_sd": 0.1}, "clock_unsure"),
        ({"clock_unsure": ((60.0, 9.0),), "time_offset_sd": 0.1}, "clock_unsure"),
        ({"position_sd_factor": 0.0}, "position_sd_factor"),
        ({"position_correlated_share": 1.0}, "position_correlated_share"),
        ({"position_correlation_time": 0.0}, "position_correlation_time"),
        ({"displaced": ((60.0, 60.0),)}, "displaced"),
    ],
)
def test_options_out_of_range_are_refused(options, quantity):
    with pytest.raises(ConfigError, match=quantity):
        Gnss(name="rtk", **options)


def test_states_are_only_those_that_are_to_be_estimated():
    assert not Gnss(name="rtk").states()
    names = [one.block.name for one in AID.states()]
    assert names == ["rtk.lever_arm", "rtk.time_offset", "rtk.position_error"]
    walking = Gnss(name="rtk", time_offset_sd=0.1, time_offset_drift=2e-4).states()[0]
    assert walking.drive == pytest.approx([2e-4])


def test_a_velocity_without_a_vertical_component_is_one_of_two():
    table = table_of((55.0, 37.0, 300.0), (30.0, -20.0, 1.0))
    level = table.assign(VD=0.0, **{VELOCITY_SD[2]: np.inf})
    aid = Gnss(name="rtk", lever_arm=ARM)
    view = view_of("ned", aid)
    (whole,), (part,) = (aid.observe(view, aid.epochs(one).values[1]) for one in (table, level))
    assert whole.name == "rtk.velocity"
    assert part.name == whole.name
    assert part.labels == whole.labels[:2]
    np.testing.assert_array_equal(part.z, whole.z[:2])
    np.testing.assert_array_equal(part.H, whole.H[:2])
    np.testing.assert_array_equal(part.R, whole.R[:2])


@pytest.mark.parametrize("sd", [0.01, 40.0])
def test_a_velocity_within_its_own_error_does_not_show_the_offset(sd):
    """It is noise then: as a derivative it would lower the offset's deviation by chance."""
    plain = view_of("ned")
    offset = plain.place("rtk.time_offset").start
    P = np.zeros((plain.columns, plain.columns))
    P[3:6, 3:6] = sd**2 * np.eye(3)
    P[offset, offset] = 0.3**2
    view = replace(plain, covariance_of=lambda: P, kept={})
    row = rows_of(AID, table_of((55.0, 37.0, 300.0), START.v_n))[0]
    (before,), (after,) = AID.observe(plain, row), AID.observe(view, row)
    speed = -before.H[:, offset]
    np.testing.assert_array_equal(after.z, before.z)
    if sd > 1.0:
        np.testing.assert_array_equal(after.H[:, offset], 0.0)
        added = 0.3**2 * (speed**2 + sd**2)
    else:
        # Shrunk by nine times the share of the error; the rest is noise again.
        shrunk = 9.0 * sd**2 / speed**2
        np.testing.assert_allclose(after.H[:, offset], -speed * (1.0 - shrunk), rtol=1e-9)
        added = 0.3**2 * (np.square(speed * shrunk) + sd**2)
    np.testing.assert_allclose(after.R - before.R, added, rtol=1e-9)
    others = np.arange(plain.columns) != offset
    np.testing.assert_array_equal(after.H[:, others], before.H[:, others])


def test_a_change_of_velocity_within_its_error_does_not_show_the_offset():
    """The derivative by the offset stays what it was: changes by corrections tell nothing of it."""
    first = view_of("ned")
    offset = first.place("rtk.time_offset").start
    row = rows_of(AID, table_of((55.0, 37.0, 300.0), START.v_n))[0]
    (before,) = AID.observe(first, row)
    P = np.zeros((first.columns, first.columns))
    P[3:6, 3:6], P[offset, offset] = 0.3**2 * np.eye(3), 0.2**2
    derivatives, added = [], []
    for faster in (0.5, 5.0):
        start = replace(START, v_n=START.v_n + np.array([faster, 0.0, 0.0]))
        later = replace(view_of("ned", start=start), covariance_of=lambda: P, kept=dict(first.kept))
        (after,) = AID.observe(later, row)
        derivatives.append(after.H[0, offset] - before.H[0, offset])
        added.append(after.R[0] - before.R[0])
    # Beyond three standard deviations it follows, short by nine times the share of the error.
    assert derivatives[0] == 0.0
    assert derivatives[1] == pytest.approx(-5.0 * (1.0 - 9.0 * 0.3**2 / 5.0**2), rel=1e-6)
    assert added[0] == pytest.approx(0.2**2 * (0.5**2 + 0.3**2), rel=1e-6)


def test_a_float_solution_has_errors_of_its_own():
    aid = replace(AID, float_position_sd=0.1)
    view = view_of("ned", aid)
    table = table_of((55.0, 37.0, 300.0), START.v_n)
    seen = {}
    for sd in (0.02, 0.4):
        table[POSITION_SD] = sd
        (seen[sd],) = aid.observe(view, rows_of(aid, table)[0])
    fixed, floating = view.place("rtk.position_error"), view.place("rtk.float_error")
    for sd, own, other, share in ((0.02, fixed, floating, 0.6), (0.4, floating, fixed, 0.9)):
        scaled = aid.position_sd_factor * sd
        expected = -np.sqrt(share) * scaled * np.eye(3)
        np.testing.assert_allclose(seen[sd].H[:, own], expected, atol=1e-12)
        np.testing.assert_array_equal(seen[sd].H[:, other], 0.0)
        np.testing.assert_allclose(seen[sd].R, (1.0 - share) * scaled**2)
    # As one state in standard deviations, 0.4 m of a float would be 0.02 m of a fix.
    assert aid.lasting_sd(np.full(3, 0.4)).tolist() == [0.0, 0.0, 0.0]
