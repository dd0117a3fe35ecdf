"""A trajectory at instants between its rows, and what interpolation costs.

Everything is interpolated along the axes of the Earth, so that neither the date line nor a pole is
a special place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError
from strapdown.frames import ecef_from_geodetic, geodetic_from_ecef, q_ne
from strapdown.tables import (
    EULER,
    GEODETIC,
    VELOCITY,
    check_trajectory,
    places_of,
    trajectory_table,
)

Array = NDArray[np.float64]

# Stamps of one beat that were summed up and not multiplied differ by this share of a step at most;
# interpolating so near to a row costs nothing.
SAME_BEAT = 1e-6

__all__ = ["SAME_BEAT", "InterpolationCost", "interpolation_cost", "same_stamps", "trajectory_at"]


@dataclass(frozen=True)
class InterpolationCost:
    """What interpolating between the rows of a trajectory may cost at most.

    Attributes
    ----------
    position_m : float, m
    velocity_m_s : float, m/s
    rotation_deg : float, deg
    """

    position_m: float
    velocity_m_s: float
    rotation_deg: float


@dataclass(frozen=True)
class _Nodes:
    """Rows of a trajectory along the axes of the Earth: position, velocity, attitude."""

    time: Array
    r: Array
    v: Array
    q_eb: Array


def _nodes(trajectory: pd.DataFrame, ellipsoid: Ellipsoid) -> _Nodes:
    place = places_of(trajectory)
    to_earth = rotation.conjugate(q_ne(place[:, 0], place[:, 1]))
    q_nb = rotation.quaternion_from_euler(trajectory[EULER].to_numpy(dtype=np.float64))
    return _Nodes(
        trajectory.index.to_numpy(dtype=np.float64),
        ecef_from_geodetic(place, ellipsoid=ellipsoid),
        rotation.rotate(to_earth, trajectory[VELOCITY].to_numpy(dtype=np.float64)),
        rotation.compose(to_earth, q_nb),
    )


def _between(
    nodes: _Nodes, before: NDArray[np.intp], after: NDArray[np.intp], time: Array
) -> tuple[Array, Array, Array]:
    """Position, velocity and attitude between two rows each."""
    h = (nodes.time[after] - nodes.time[before])[:, None]
    s = (time[:, None] - nodes.time[before][:, None]) / h
    r_0, r_1, v_0, v_1 = nodes.r[before], nodes.r[after], nodes.v[before], nodes.v[after]
    r = (
        r_0
        + (r_1 - r_0) * (s * s * (3.0 - 2.0 * s))
        + h * (v_0 * (s * (1.0 - s) ** 2) - v_1 * (s * s * (1.0 - s)))
    )
    v = v_0 + s * (v_1 - v_0)
    q_0 = nodes.q_eb[before]
    turn = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(q_0), nodes.q_eb[after])
    )
    return r, v, rotation.compose(q_0, rotation.quaternion_from_rotation_vector(s * turn))


def same_stamps(
    stamps: Array, time: Array, share: float = 0.0
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Find the nearest stamp of each instant, and whether it is the same but for rounding.

    Parameters
    ----------
    stamps : ndarray, (m,), s
        Increasing.
    time : ndarray, (n,), s
    share : float
        Share of the step around the instant that still counts as rounding.

    Returns
    -------
    nearest : ndarray of int, (n,)
    same : ndarray of bool, (n,)
        Within `share`, or eight units in the last place.
    """
    last = len(stamps) - 1
    right = np.clip(np.searchsorted(stamps, time), min(1, last), last)
    left = np.maximum(right - 1, 0)
    nearest = np.where(time - stamps[left] < stamps[right] - time, left, right)
    slack = np.maximum(
        8.0 * np.spacing(np.maximum(np.abs(time), np.abs(stamps[nearest]))),
        share * (stamps[right] - stamps[left]),
    )
    return nearest, np.abs(time - stamps[nearest]) <= slack


def trajectory_at(
    trajectory: pd.DataFrame, time: ArrayLike, ellipsoid: Ellipsoid = WGS84
) -> pd.DataFrame:
    """Trajectory at any instants within its span.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table.
    time : array_like, (n,), s
        Increasing, and within the span of the table, but for a millionth of a step.
    ellipsoid : Ellipsoid
        To which its places refer.

    Returns
    -------
    DataFrame
        A Trajectory table: the rows themselves where the stamps are the same. Between two rows
        a step of `h` apart, position is the cubic of Hermite through both positions and
        velocities, right to ``h⁴/384`` times the largest fourth derivative; velocity changes in
        proportion to time, right to ``h²/8`` times the largest jerk; attitude turns at a
        constant rate relative to the Earth, right to ``h²/8`` times the largest angular
        acceleration.

    Raises
    ------
    DataError
        The table is not valid, an instant lies outside of its span, or the instants do not
        increase.
    """
    check_trajectory(trajectory)
    t = np.asarray(time, dtype=np.float64)
    stamps = trajectory.index.to_numpy(dtype=np.float64)
    nearest, same = same_stamps(stamps, t)
    _, beat = same_stamps(stamps, t, SAME_BEAT)
    outside = np.flatnonzero(~beat & ~((t > stamps[0]) & (t < stamps[-1])))
    if outside.size:
        raise DataError(
            "evaluation.outside-span",
            file=trajectory.attrs.get("source"),
            row=int(outside[0]) + 1,
            quantity="time",
            t=t[outside[0]],
            stamps=stamps[0],
            stamps_2=stamps[-1],
        )
    out = trajectory[[*GEODETIC, *VELOCITY, *EULER]].to_numpy(dtype=np.float64)[nearest]
    if not same.all():
        apart = t[~same]
        after = np.clip(np.searchsorted(stamps, apart), 1, len(stamps) - 1)
        used = slice(int(after.min()) - 1, int(after.max()) + 1)
        nodes = _nodes(trajectory.iloc[used], ellipsoid)
        after = after - used.start
        r, v, q_eb = _between(nodes, after - 1, after, apart)
        place = geodetic_from_ecef(r, ellipsoid=ellipsoid)
        to_level = q_ne(place[:, 0], place[:, 1])
        out[~same] = np.hstack(
            [
                place,
                rotation.rotate(to_level, v),
                rotation.euler_from_quaternion(rotation.compose(to_level, q_eb)),
            ]
        )
    return trajectory_table(
        t, out[:, :3], out[:, 3:6], out[:, 6:], source=trajectory.attrs.get("source")
    )


def interpolation_cost(
    trajectory: pd.DataFrame, ellipsoid: Ellipsoid = WGS84
) -> InterpolationCost | None:
    """Judge what interpolation costs, by interpolating each row from its two neighbours.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table.
    ellipsoid : Ellipsoid

    Returns
    -------
    InterpolationCost or None
        None for fewer than three rows. The misfit at a row that lies at the share `s` of the
        double step `H` goes with ``s² (1-s)² H⁴`` for position, and with ``s (1-s) H²`` for
        velocity and attitude; from it follows what the longer of the two steps costs in its
        middle. The largest of all rows is given. Noise of the rows is no cost of interpolation
        and enters undiminished, so that for a noisy trajectory this is too much.
    """
    if len(trajectory) < 3:
        return None
    nodes = _nodes(trajectory, ellipsoid)
    middle = np.arange(1, len(nodes.time) - 1)
    r, v, q_eb = _between(nodes, middle - 1, middle + 1, nodes.time[middle])
    steps = np.diff(nodes.time)
    longer = np.maximum(steps[:-1], steps[1:])
    # s (1-s) H² is the product of the two steps.
    share = longer**2 / (4.0 * steps[:-1] * steps[1:])

    def largest(misfit: Array) -> float:
        return float(misfit.max())

    return InterpolationCost(
        largest(np.linalg.norm(r - nodes.r[middle], axis=1) * share**2),
        largest(np.linalg.norm(v - nodes.v[middle], axis=1) * share),
        largest(rotation.rotation_angle(q_eb, nodes.q_eb[middle]) * share),
    )
