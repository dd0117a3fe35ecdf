"""What a rest cannot tell, and which turn of the body would tell it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.fine_epochs import settled_epoch
from strapdown.alignment.fine_result import FineResult, alignment_of
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import home_of
from strapdown.estimation.filter_state import FilterState

__all__ = ["Manoeuvre", "manoeuvres_after", "null_space"]

Array = NDArray[np.float64]

# A turn by hand or by a vehicle, and the length of a step of the forecast.
TURN_TIME, STEP = 20.0, 0.1  # s
#: What a body can be asked to do: a rotation vector in its own axes, deg.
TURNS: dict[str, tuple[float, float, float]] = {
    "turn it by 90° about the vertical": (0.0, 0.0, 90.0),
    "turn it by 180° about the vertical": (0.0, 0.0, 180.0),
    "roll it by 90° onto its side": (90.0, 0.0, 0.0),
    "pitch it by 90° onto its nose": (0.0, -90.0, 0.0),
}
STAY = "leave it as it stands"


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """What would be known after a turn and a further rest.

    Attributes
    ----------
    name : str
        What to do.
    rest : float, s
        How long it rests afterwards.
    sd_deg : ndarray, (3,), deg
        Of the tilts about north and east and of the heading.
    gyro_bias_sd, accel_bias_sd : ndarray, (3,), rad/s and m/s²
    """

    name: str
    rest: float
    sd_deg: Array
    gyro_bias_sd: Array
    accel_bias_sd: Array


def null_space(lat_deg: float, q_nb: Array, gravity: float, earth_rate: float) -> Array:
    """Return the errors that leave no trace in any observation of a rest.

    Any constant rotation psi of the computed attitude, with ``C_nb b_a = f x psi`` and
    ``C_nb b_g = omega_ie x psi``: velocity and attitude relative to the Earth then stay at rest. So
    a horizontal bias cannot be told from a tilt, nor an east drift from the heading.

    Parameters
    ----------
    lat_deg : float, deg
    q_nb : ndarray, (4,)
    gravity : float, m/s²
    earth_rate : float, rad/s

    Returns
    -------
    ndarray, (15, 3)
        Columns of physical errors in north-east-down and body axes: displacement, velocity,
        rotation, gyro bias, accelerometer bias; one for a rotation about each of north, east, down.
    """
    lat = math.radians(lat_deg)
    spin = earth_rate * np.array([math.cos(lat), 0.0, -math.sin(lat)])
    force = np.array([0.0, 0.0, -gravity])
    C = rotation.dcm_from_quaternion(q_nb)
    out = np.zeros((15, 3))
    for i in range(3):
        psi = np.eye(3)[i]
        out[6:9, i] = psi
        out[9:12, i] = C.T @ np.cross(spin, psi)
        out[12:15, i] = C.T @ np.cross(force, psi)
    return out


def manoeuvres_after(
    result: FineResult, site: Site, rest: float | None = None
) -> tuple[Manoeuvre, ...]:
    """Forecast what a turn of the body and a further rest would make known.

    The filter's covariance goes on over the increments that error-free sensors would give, with the
    observations of the same rest; nothing else of the result is used. Scale factors and
    misalignments are a part of the biases here, and stay so; as a turn out of the level changes
    what they do, the forecast of such a turn is the best that could come of it.

    Parameters
    ----------
    result : FineResult
    site : Site
    rest : float, s, optional
        After the turn; as long as the record was, if not given.

    Returns
    -------
    tuple of Manoeuvre
        The best heading first; to stay as it stands is among them.
    """
    history = result.history
    length = float(history.index[-1] - history.index[0]) if rest is None else rest
    turns = {STAY: (0.0, 0.0, 0.0), **TURNS}
    found = [
        _forecast(result, site, name, np.radians(turn), length) for name, turn in turns.items()
    ]
    return tuple(sorted(found, key=lambda one: float(one.sd_deg[2])))


def _forecast(result: FineResult, site: Site, name: str, turn: Array, rest: float) -> Manoeuvre:
    filter_ = result.filter
    # A body at rest without errors: only the covariance is wanted.
    home = home_of(site, result.state.time)
    used = filter_.mechanization
    here = used.nav_state(result.state.mechanization, result.state.time)
    begun = used.begin(replace(home, q_nb=here.q_nb))
    state = FilterState(
        home.time,
        begun,
        used.history_row(begun),
        np.zeros_like(result.state.sensors),
        result.state.covariance,
    )
    q_nb = np.asarray(here.q_nb)
    moving = max(1, round(TURN_TIME / STEP))
    steps = round(TURN_TIME)
    if np.any(turn):
        rows, q_nb = _turning(site, q_nb, turn, moving)
        each = len(rows) // steps
        for k in range(steps):
            part = rows[k * each : (k + 1) * each]
            time = state.time + STEP * np.arange(1.0, each + 1)
            state, _ = filter_.predict(state, np.asarray(time), part)
    home = replace(home, q_nb=q_nb)
    each = round(result.interval / STEP)
    rows = np.tile(_resting(site, q_nb), (each, 1))
    for _ in range(max(1, math.floor(rest / result.interval))):
        time = state.time + STEP * np.arange(1.0, each + 1)
        state, _ = settled_epoch(
            filter_,
            state,
            np.asarray(time),
            rows,
            home,
            result.standing,
            tuple(result.innovations),
        )
    after = alignment_of(filter_, state)
    assert after.gyro_bias_sd is not None and after.accel_bias_sd is not None
    return Manoeuvre(
        name,
        rest,
        np.degrees(np.sqrt(np.diagonal(after.covariance))),
        after.gyro_bias_sd,
        after.accel_bias_sd,
    )


def _resting(site: Site, q_nb: Array) -> Array:
    """Motion increments of one step of a body that stands, (10,)."""
    C = rotation.dcm_from_quaternion(q_nb)
    rate, force = C.T @ site.earth_rate, -(C.T @ site.gravity)
    return np.concatenate([[STEP], rate * STEP, force * STEP, 0.5 * force * STEP**2])


def _turning(site: Site, q_nb: Array, turn: Array, steps: int) -> tuple[Array, Array]:
    """Motion increments of a turn at constant rate about an axis of the body, and its end."""
    rows = np.empty((steps, 10))
    step = rotation.quaternion_from_rotation_vector(turn / steps)
    for i in range(steps):
        # Force is constant in level: over the step it is met from halfway.
        half = rotation.quaternion_from_rotation_vector(0.5 * turn / steps)
        rows[i] = _resting(site, rotation.compose(q_nb, half))
        rows[i, 4:10] = np.concatenate(
            [rotation.rotate(half, v) for v in rows[i, 4:10].reshape(2, 3)]
        )
        rows[i, 1:4] += turn / steps
        q_nb = rotation.compose(q_nb, step)
    return rows, q_nb
