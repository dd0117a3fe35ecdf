"""Vehicles at an instant, as aids see them: true, and with errors of every kind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from strapdown import rotation
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import PHYSICAL, RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias, gyro_scale
from strapdown.frames import antenna_motion, q_ne
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.measurement import View
from strapdown.simulation import Origin
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion

#: Errors of the inertial sensors, beside those of an aid.
SENSORS = (gyro_bias(1e-3), accel_bias(1e-2), gyro_scale(1e-3))
STEP = 0.01


def track(value):
    return Track((0.0,), (value,))


def vehicle(speed, turn_rate=0.0, climb=0.0, roll=0.0, heading=70.0):
    return PathMotion(
        10.0,
        Origin(48.0, 11.0, 500.0),
        heading_deg=heading,
        speed=track(speed),
        turn_rate=track(turn_rate),
        climb=track(climb),
        roll_deg=roll,
    )


SITUATIONS = {
    "rest": vehicle(0.0, roll=4.0, climb=6.0),
    "level": vehicle(20.0),
    "turning": vehicle(12.0, turn_rate=25.0, heading=200.0),
    "tilted": vehicle(15.0, turn_rate=-10.0, climb=9.0, roll=-12.0, heading=310.0),
}


@dataclass(frozen=True, eq=False)
class Moment:
    """Truth of the sensors at an instant.

    Attributes
    ----------
    time : float, s
    state : NavState
    rate, force : ndarray, (3,)
        What ideal sensors read.
    """

    time: float
    state: NavState
    rate: np.ndarray
    force: np.ndarray

    @staticmethod
    def axle_from_sensors(place, turn):
        """Origin of the vehicle from sensors at a place in it, body axes of the sensors."""
        return -rotation.dcm_from_euler(turn).T @ np.asarray(place)

    def antenna(self, arm):
        """Place in deg and m, and velocity north, east, down, of a point of the body."""
        s = self.state
        place, velocity = antenna_motion(
            [[np.degrees(s.lat), np.degrees(s.lon), s.alt]], [s.v_n], [s.q_nb], [self.rate], arm
        )
        return place[0], velocity[0]


def moment_of(situation, place=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), time=3.0):
    """Sensors at a place of a vehicle, turned in it: the origin of the vehicle does not slip."""
    motion = SITUATIONS[situation]
    at = np.array([time])
    here = motion.trajectory(at)
    q, rate = motion.attitude(at), motion.rate(at)
    where, velocity = antenna_motion(
        here[["lat", "lon", "alt"]].to_numpy(),
        here[["VN", "VE", "VD"]].to_numpy(),
        q,
        rate,
        place,
    )
    q_vs = rotation.quaternion_from_euler(turn)
    back = rotation.dcm_from_euler(turn).T
    lat, lon, alt = where[0]
    # The level of the sensors is not quite that of the vehicle's origin: attitude and velocity
    # are carried over, so that both are the same vectors.
    origin = here[["lat", "lon", "alt"]].to_numpy()[0]
    between = rotation.compose(
        q_ne(float(lat), float(lon)),
        rotation.conjugate(q_ne(float(origin[0]), float(origin[1]))),
    )
    state = NavState(
        time,
        np.radians(lat),
        np.radians(lon),
        alt,
        rotation.rotate(between, velocity[0]),
        rotation.compose(between, rotation.compose(q[0], q_vs)),
    )
    return Moment(time, state, back @ rate[0], back @ motion.specific_force(at)[0])


def filter_of(mechanization, aid):
    model = RotationVectorModel(sensors=(*SENSORS, *aid.states()))
    return ErrorFilter(mechanization, model, COVARIANCES["joseph"]())


def view_of(mechanization, aid, moment, error=None, estimated=0.0):
    """The truth with errors of it taken in, as a filter has them: computed less true.

    The states of the aid are estimated to be `estimated`, each.
    """
    used = filter_of(mechanization, aid)
    size = used.model.physical_size
    error = np.zeros(size) if error is None else error
    state = mechanization.correct(mechanization.begin(moment.state), -error[:PHYSICAL])
    # What the sensors are still wrong by, after a perfect estimate: less of an estimate.
    sensors = -error[PHYSICAL:]
    sensors[sum(len(one.block) for one in SENSORS) :] += estimated
    row = np.concatenate([[STEP], moment.rate * STEP, moment.force * STEP, np.zeros(3)])
    begun = replace(used.begin(moment.state, np.eye(size)), sensors=sensors)
    felt = used.compensated(begun, row[None, :])[0]
    return View(
        mechanization=mechanization,
        model=used.model,
        time=moment.time,
        state=state,
        row=mechanization.history_row(state),
        sensors=sensors,
        rate=felt[1:4] / STEP,
        force=felt[4:7] / STEP,
    )


def difference_columns(mechanization, aid, moment, values, k, estimated=0.0):
    """How the k-th observation changes with each error, by differences of the fourth order."""
    size = filter_of(mechanization, aid).model.physical_size
    columns = []
    for i in range(size):
        # Metres, m/s and radians: far above rounding, and curvature falls out.
        small = 1.0 if i < 3 else 1e-2 if i < 6 else 1e-4

        def z(times, i=i, small=small):
            error = np.zeros(size)
            error[i] = times * small
            return aid.observe(view_of(mechanization, aid, moment, error, estimated), values)[k].z

        columns.append((8.0 * (z(1) - z(-1)) - (z(2) - z(-2))) / (12.0 * small))
    return np.column_stack(columns)
