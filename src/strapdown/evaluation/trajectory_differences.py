"""One trajectory compared with another: metres, metres a second and degrees."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError, Finding
from strapdown.evaluation.trajectory_at import (
    SAME_BEAT,
    interpolation_cost,
    same_stamps,
    trajectory_at,
)
from strapdown.frames import ecef_from_geodetic, place_difference
from strapdown.tables import (
    EULER,
    VELOCITY,
    check_trajectory,
    find_gaps,
    places_of,
    trajectory_error_table,
)

Array = NDArray[np.float64]

__all__ = ["ROTATION_ERROR", "trajectory_differences"]

ROTATION_ERROR = ["phi_N", "phi_E", "phi_D"]
# Trajectories that begin farther apart than this are asked whether they are of one vehicle.
FAR = 50_000.0  # m


def trajectory_differences(
    estimate: pd.DataFrame, reference: pd.DataFrame, ellipsoid: Ellipsoid = WGS84
) -> pd.DataFrame:
    """Estimate minus reference, at the estimate's instants within the reference's span.

    Parameters
    ----------
    estimate, reference : DataFrame
        Trajectory tables of one clock.
    ellipsoid : Ellipsoid
        To which the places of both refer.

    Returns
    -------
    DataFrame
        A TrajectoryError table with three further columns:

        ``north east down``, m
            The straight line from the reference, along north, east and down midway between both
            places: places of one height differ in no height, however far apart they are, and the
            length is the distance. Over the ground it is ``d³/24R²`` farther, 1 m at 100 km.
        ``VN VE VD``, m/s
            Each velocity along the local level of its own place.
        ``roll pitch heading``, deg
            Differences of the angles, within -180 to 180. Near a pitch of 90 deg roll and
            heading say little one by one.
        ``phi_N phi_E phi_D``, deg
            Rotation vector of ``C_est C_ref^T`` about north, east and down: the turn that brings
            the reference's attitude into the estimate's, ``C_est = exp([phi x]) C_ref``, so that
            for a level body ``phi_D`` is the error of heading. Free of singularities; its
            length is the angle between the attitudes. Both are relative to the local
            level of their own place, as a mechanization has them.

        ``attrs``: ``source``, ``reference``; ``interpolated``, the number of instants at which
        the reference had no row and was interpolated (`trajectory_at`); ``findings``, a tuple
        of Finding: what that may cost, and gaps of the reference.

    Raises
    ------
    DataError
        A table is not valid; they have no instant in common; or they begin far apart, and
        exchanging latitude and longitude, or taking radians for degrees, brings them together.
    """
    check_trajectory(estimate)
    check_trajectory(reference)
    inside = _within(estimate, reference)
    stamps = inside.index.to_numpy(dtype=np.float64)
    known = trajectory_at(reference, stamps, ellipsoid)
    place, truth = (places_of(t) for t in (inside, known))
    findings = _far_apart(place[0], truth[0], ellipsoid, estimate, reference)
    angles = [t[EULER].to_numpy(dtype=np.float64) for t in (inside, known)]
    q_est, q_ref = (rotation.quaternion_from_euler(a) for a in angles)
    phi = rotation.rotation_vector_from_quaternion(
        rotation.compose(q_est, rotation.conjugate(q_ref))
    )
    # Two products of the same numbers may differ in rounding alone.
    phi[(angles[0] == angles[1]).all(axis=1)] = 0.0
    table = trajectory_error_table(
        stamps,
        place_difference(place, truth, ellipsoid=ellipsoid),
        inside[VELOCITY].to_numpy(dtype=np.float64) - known[VELOCITY].to_numpy(dtype=np.float64),
        rotation.within_half_turn(angles[0] - angles[1]),
        source=estimate.attrs.get("source"),
    )
    table[ROTATION_ERROR] = np.degrees(phi)
    _, same = same_stamps(reference.index.to_numpy(dtype=np.float64), stamps, SAME_BEAT)
    table.attrs["reference"] = reference.attrs.get("source")
    table.attrs["interpolated"] = int((~same).sum())
    table.attrs["findings"] = (*findings, *_interpolated(stamps[~same], reference, ellipsoid))
    return table


def _within(estimate: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Rows of the estimate in the span of the reference; the ends but for rounding."""
    stamps, known = (t.index.to_numpy(dtype=np.float64) for t in (estimate, reference))
    source = estimate.attrs.get("source")
    for time, name in ((stamps, source), (known, reference.attrs.get("source"))):
        if not time.size:
            raise DataError("evaluation.trajectory-no-rows", file=name)
    _, same = same_stamps(known, stamps, SAME_BEAT)
    inside = same | ((stamps > known[0]) & (stamps < known[-1]))
    if not inside.any():
        spans = [f"{t[0]:.9g} to {t[-1]:.9g} s" for t in (stamps, known)]
        raise DataError(
            "evaluation.estimate-no-instant-within-reference"
            if stamps[-1] < known[0] or stamps[0] > known[-1]
            else "evaluation.estimate-no-instant-within-reference-2",
            file=source,
            quantity="time",
            spans=spans[0],
            spans_2=spans[1],
        )
    return estimate.iloc[np.flatnonzero(inside)]


def _far_apart(
    est: Array,
    ref: Array,
    ellipsoid: Ellipsoid,
    estimate: pd.DataFrame,
    reference: pd.DataFrame,
) -> list[Finding]:
    """Two starts that are far apart: an error if it is explained, or else a finding."""

    def distance(a: Array, b: Array) -> float:
        first, second = (ecef_from_geodetic(p[None], ellipsoid=ellipsoid) for p in (a, b))
        return float(np.linalg.norm(first - second))

    apart = distance(est, ref)
    if apart < FAR:
        return []
    names = [t.attrs.get("source") for t in (estimate, reference)]
    degrees = np.array([np.degrees(1.0), np.degrees(1.0), 1.0])
    tried = [
        (est[[1, 0, 2]], ref, "evaluation.latitude-and-longitude-swapped"),
        (est * degrees, ref, "evaluation.estimate-in-radians"),
        (est, ref * degrees, "evaluation.reference-in-radians"),
        (est * [1, -1, 1], ref, "evaluation.longitude-positive-west"),
    ]
    for a, b, code in tried:
        latitude, longitude = np.abs([a[:2], b[:2]]).max(axis=0)
        # A hundredth is no accident.
        if latitude <= 90.0 and longitude <= 360.0 and distance(a, b) < 0.01 * apart:
            raise DataError(
                code,
                file=names[0],
                row=1,
                quantity="lat, lon",
                apart_km=apart / 1000.0,
                mended_km=distance(a, b) / 1000.0,
            )
    return [
        Finding(
            "evaluation.trajectories-begin-km-apart",
            file=names[0],
            quantity="lat, lon",
            apart=apart / 1000.0,
        )
    ]


def _interpolated(time: Array, reference: pd.DataFrame, ellipsoid: Ellipsoid) -> list[Finding]:
    """What interpolating the reference at these instants may cost, and gaps among them."""
    if not time.size:
        return []
    source, stamps = reference.attrs.get("source"), reference.index.to_numpy(dtype=np.float64)
    findings = []
    gaps = [g for g in find_gaps(stamps) if ((time > g.start) & (time < g.end)).any()]
    if gaps:
        longest = max(gaps, key=lambda g: g.length)
        count = sum(int(((time > g.start) & (time < g.end)).sum()) for g in gaps)
        findings.append(
            Finding(
                "evaluation.instants-estimate-lie-gaps-reference",
                file=source,
                quantity="time",
                count=count,
                count_2=len(gaps),
                length=longest.length,
                start=longest.start,
                usual=longest.usual,
            )
        )
    first, last = np.searchsorted(stamps, [time[0], time[-1]])
    cost = interpolation_cost(reference.iloc[max(0, first - 2) : last + 2], ellipsoid)
    costs = {} if cost is None else vars(cost)
    return [
        *findings,
        Finding(
            "evaluation.reference-interpolated-at-unknown-cost"
            if cost is None
            else "evaluation.reference-interpolated",
            file=source,
            quantity="time",
            size=time.size,
            **costs,
        ),
    ]
