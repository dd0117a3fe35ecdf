"""Compare two trajectories in meters, meters per second and degrees."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError, Finding, add_warning
from strapdown.frames import ecef_from_geodetic, geodetic_from_ecef, place_difference, q_ne
from strapdown.tables import (
    EULER,
    NED,
    TRAJECTORY,
    VELOCITY,
    check_trajectory,
    check_trajectory_error,
    find_gaps,
    places_of,
    trajectory_error_table,
    trajectory_table,
)
from strapdown.tables.checks import Array, view_of
from strapdown.tables.on_disk import let_go

ROTATION_ERROR = ["phi_N", "phi_E", "phi_D"]
# Trajectories that begin farther apart are checked for wrong units and signs.
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
        Ellipsoid of the positions of both.

    Returns
    -------
    DataFrame
        A TrajectoryError table with three further columns:

        ``north east down``, m
            The straight line from the reference, along north, east and down midway between both
            positions: positions of equal height have no height difference, however far apart, and
            the length is the distance. Over the ground it is ``d³/24R²`` farther, 1 m at 100 km.
        ``VN VE VD``, m/s
            Each velocity along the local level of its own position.
        ``roll pitch heading``, deg
            Differences of the angles, within -180 to 180. Near a pitch of 90 deg roll and
            heading are meaningful in combination only.
        ``phi_N phi_E phi_D``, deg
            Rotation vector of ``C_est C_ref^T`` about north, east and down: the rotation from
            the reference's attitude to the estimate's, ``C_est = exp([phi x]) C_ref``, so that
            for a level body ``phi_D`` is the error of heading. Free of singularities; its
            length is the angle between the attitudes. Both are relative to the local
            level of their own position, as in a mechanization.

        ``attrs``: ``source``, ``reference``; ``interpolated``, the number of instants at which
        the reference had no row and was interpolated (`trajectory_at`); ``findings``, a tuple of
        Finding: the possible interpolation error, and gaps of the reference.

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
    """Rows of the estimate in the span of the reference, ends included despite rounding."""
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
    """Check two distant starts: an error if a wrong unit or sign explains them, else a finding."""

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
        # A hundredth of the rows is too many for an accident.
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
    """Findings on the interpolation error of the reference at these instants, and on gaps."""
    if not time.size:
        return []
    source, stamps = reference.attrs.get("source"), reference.index.to_numpy(dtype=np.float64)
    findings: list[Finding] = []
    gaps = [g for g in find_gaps(stamps) if ((time > g.start) & (time < g.end)).any()]
    if gaps:
        longest = max(gaps, key=lambda g: g.length)
        count = sum(int(((time > g.start) & (time < g.end)).sum()) for g in gaps)
        add_warning(
            findings,
            "evaluation.instants-estimate-lie-gaps-reference",
            file=source,
            quantity="time",
            count=count,
            count_2=len(gaps),
            length=longest.length,
            start=longest.start,
            usual=longest.usual,
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


# A trajectory at instants between its rows, and the interpolation error.
#
# Everything is interpolated along the axes of the Earth, so that the date line and the poles need
# no special case.


# Time stamps of one rate that were summed and not multiplied differ by this share of a step at
# most; interpolating so close to a row has no cost.
SAME_BEAT = 1e-6
#: Instants that are interpolated at a time.
AT_ONCE = 10_000


@dataclass(frozen=True)
class InterpolationCost:
    """Largest interpolation error between the rows of a trajectory.

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
    """Nearest stamp of each instant, and whether it is equal but for rounding.

    Rounding: within `share` of the step around it, or eight units in the last place.
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
        Ellipsoid of its positions.

    Returns
    -------
    DataFrame
        A Trajectory table: the rows themselves at their time stamps. Between two rows a step of
        `h` apart, position is the cubic of Hermite through both positions and velocities,
        accurate to ``h⁴/384`` times the largest fourth derivative; velocity is linear,
        accurate to ``h²/8`` times the largest jerk; attitude rotates at a constant rate relative
        to the Earth, accurate to ``h²/8`` times the largest angular acceleration.

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
    out = view_of(trajectory, TRAJECTORY)[nearest]
    apart = np.flatnonzero(~same)
    # Part by part: what lies between takes much more memory than the instants themselves.
    for some in np.array_split(apart, range(AT_ONCE, len(apart), AT_ONCE)) if len(apart) else ():
        after = np.clip(np.searchsorted(stamps, t[some]), 1, len(stamps) - 1)
        used = slice(int(after.min()) - 1, int(after.max()) + 1)
        nodes = _nodes(trajectory.iloc[used], ellipsoid)
        after = after - used.start
        r, v, q_eb = _between(nodes, after - 1, after, t[some])
        place = geodetic_from_ecef(r, ellipsoid=ellipsoid)
        to_level = q_ne(place[:, 0], place[:, 1])
        out[some] = np.hstack(
            [
                place,
                rotation.rotate(to_level, v),
                rotation.euler_from_quaternion(rotation.compose(to_level, q_eb)),
            ]
        )
        let_go(trajectory)
    return trajectory_table(
        t, out[:, :3], out[:, 3:6], out[:, 6:], source=trajectory.attrs.get("source")
    )


def interpolation_cost(
    trajectory: pd.DataFrame, ellipsoid: Ellipsoid = WGS84
) -> InterpolationCost | None:
    """Estimate the interpolation error by interpolating each row from its two neighbors.

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
        velocity and attitude; the error in the middle of the longer of the two steps follows
        from it. The largest of all rows is given. Noise of the rows is not an interpolation
        error but enters undiminished, so that the figure is too large for a noisy trajectory.
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


# Summary of the differences of two trajectories.


@dataclass(frozen=True)
class QuantityError:
    """Error of one quantity over time.

    Attributes
    ----------
    quantity : str
        A column, or a combination: ``horizontal`` and ``position`` (the lengths in two
        and three dimensions), ``horizontal velocity``, ``velocity``, ``rotation`` (the angle
        between the attitudes).
    unit : str
    rms : float
        Over the instants, each with the same weight.
    largest : float
        Of the magnitude.
    largest_at : float, s
        When that is.
    final : float
        With its sign.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    final: float


@dataclass(frozen=True)
class DifferenceSummary:
    """Errors of a trajectory: root mean square, largest, final.

    Attributes
    ----------
    source, reference : str or None
        The compared trajectories.
    samples : int
    start, end : float, s
    errors : tuple of QuantityError
    findings : tuple of Finding
        Findings about the comparison.
    """

    source: str | None
    reference: str | None
    samples: int
    start: float
    end: float
    errors: tuple[QuantityError, ...]
    findings: tuple[Finding, ...]

    def __getitem__(self, quantity: str) -> QuantityError:
        """Error of one quantity."""
        for error in self.errors:
            if error.quantity == quantity:
                return error
        raise DataError(
            "evaluation.no-error",
            of_what=quantity,
            word=quantity,
            known=[e.quantity for e in self.errors],
        )

    def to_pandas(self) -> pd.DataFrame:
        """One row per quantity: ``unit rms largest largest_at final``."""
        return pd.DataFrame([vars(e) for e in self.errors]).set_index("quantity")

    @property
    def title(self) -> str:
        """The compared trajectories and the time span."""
        named = f"{self.source or 'estimate'} minus {self.reference or 'reference'}"
        span = f"{self.start:.9g} to {self.end:.9g} s, {self.samples} instants"
        return f"{named}, {span}"

    def __str__(self) -> str:
        lines = [self.title, f"{'':24}{'rms':>11}{'largest':>11}{'at s':>11}{'final':>11}"]
        lines += [
            f"{e.quantity + ' ' + e.unit:24}{e.rms:11.4g}{e.largest:11.4g}{e.largest_at:11.6g}"
            f"{e.final:11.4g}"
            for e in self.errors
        ]
        return "\n".join([*lines, *(f"note: {f}" for f in self.findings)])

    def _repr_html_(self) -> str:
        """The table for a notebook."""
        table = self.to_pandas().to_html(float_format="{:.6g}".format)
        notes = "".join(f"<div><small>{escape(str(f))}</small></div>" for f in self.findings)
        return f"<div><div><b>{escape(self.title)}</b></div>{table}{notes}</div>"


def summarise_differences(differences: pd.DataFrame) -> DifferenceSummary:
    """Root mean square, largest and final error of each component and of their lengths.

    Parameters
    ----------
    differences : DataFrame
        As `trajectory_differences` returns it, or any TrajectoryError table; without
        ``phi_N phi_E phi_D`` the row ``rotation`` is missing.

    Returns
    -------
    DifferenceSummary

    Raises
    ------
    DataError
        The table is not valid, or has no rows.
    """
    check_trajectory_error(differences)
    if differences.empty:
        raise DataError("evaluation.table-no-rows", file=differences.attrs.get("source"))
    time = differences.index.to_numpy(dtype=np.float64)
    groups = [
        (NED, "m", {"horizontal": NED[:2], "position": NED}),
        (VELOCITY, "m/s", {"horizontal velocity": VELOCITY[:2], "velocity": VELOCITY}),
        (EULER, "deg", {}),
    ]
    if set(ROTATION_ERROR) <= set(differences.columns):
        groups.append((ROTATION_ERROR, "deg", {"rotation": ROTATION_ERROR}))
    errors = []
    for columns, unit, lengths in groups:
        series = {c: differences[c].to_numpy(dtype=np.float64) for c in columns}
        series |= {
            name: np.sqrt(np.square([series[c] for c in parts]).sum(axis=0))
            for name, parts in lengths.items()
        }
        errors += [_error(name, unit, values, time) for name, values in series.items()]
    return DifferenceSummary(
        differences.attrs.get("source"),
        differences.attrs.get("reference"),
        len(time),
        float(time[0]),
        float(time[-1]),
        tuple(errors),
        tuple(differences.attrs.get("findings", ())),
    )


def _error(name: str, unit: str, values: Array, time: Array) -> QuantityError:
    worst = int(np.argmax(np.abs(values)))
    return QuantityError(
        name,
        unit,
        float(np.sqrt(np.mean(np.square(values)))),
        float(abs(values[worst])),
        float(time[worst]),
        float(values[-1]),
    )
