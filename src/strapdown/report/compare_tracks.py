"""Differences of two results over time: positions, velocities and attitudes beside their bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import TWO_SIDED_95
from strapdown.dsp.chi_square import PLANE_95, plane_reach
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.evaluation.trajectory_differences import (
    SAME_BEAT,
    same_stamps,
    trajectory_differences,
)
from strapdown.formats import csv
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.navigation.truth_comparison import rows_of_marks, time_shares
from strapdown.report.compare_folders import LONGEST, RunPart, SealedRun
from strapdown.report.compare_numbers import is_over_ground
from strapdown.report.crash_case import table_in
from strapdown.tables import EULER, NED, QUATERNION, VELOCITY

Array = NDArray[np.float64]

#: Files of a trajectory with velocity and attitude, the best first.
FORMS = ("csv", "parquet", "npz", "h5", "mat")
_UNITS = {
    **dict.fromkeys(NED, "m"),
    **dict.fromkeys(VELOCITY, "m_per_s"),
    **dict.fromkeys(EULER, "deg"),
}
_SD_UNITS = _UNITS | dict.fromkeys(VELOCITY, "m_s")
#: Axes of the path of a crash, where the heading is known and where it is not.
GROUND, VEHICLE = "over ground", "along the vehicle's axes"
#: Quantities of a difference: column, words, unit.
QUANTITIES = {
    "horizontal": ("position, horizontal", "m"),
    "height": ("height", "m"),
    "VN": ("velocity north", "m/s"),
    "VE": ("velocity east", "m/s"),
    "VD": ("velocity down", "m/s"),
    "roll": ("roll", "deg"),
    "pitch": ("pitch", "deg"),
    "heading": ("heading", "deg"),
    "angle": ("angle between the attitudes", "deg"),
}


@dataclass(frozen=True, eq=False)
class Track:
    """A result over time.

    Attributes
    ----------
    label : str
        What of the run it is: a vehicle, an algorithm; empty for the only one.
    kind : str
        ``geodetic``: `table` is a Trajectory; ``local``: north, east, down in m, velocity and
        attitude; ``attitude``: quaternions.
    frame : str
        Ellipsoid, or axes of the positions; only tracks of one frame have a difference.
    sd : DataFrame or None
        Standard deviations north, east, down m, velocity m/s, roll, pitch, heading deg, by time.
    """

    label: str
    kind: str
    frame: str
    table: pd.DataFrame = field(repr=False)
    sd: pd.DataFrame | None = field(default=None, repr=False)

    @property
    def time(self) -> Array:
        """Its instants, (n,), s."""
        return self.table.index.to_numpy(dtype=np.float64)


@dataclass(frozen=True)
class DifferenceScore:
    """Difference of one quantity over the common time.

    Attributes
    ----------
    rms : float
        Weighted by time.
    largest, largest_at : float
        Largest absolute difference, and its instant in s.
    last : float
        At the last common instant.
    bound : float or None
        Root mean square of the combined 95 % bounds; None without bounds of both.
    share : float or None
        Share of the time in which the difference is within the combined bound.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    last: float
    bound: float | None
    share: float | None


@dataclass(frozen=True, eq=False)
class Difference:
    """A run minus the first one, over their common time.

    Attributes
    ----------
    run : int
        Place of the run, from 1 (the first is 0).
    label : str
        As of the tracks.
    table : DataFrame
        By time in s: the quantities, and where both have bounds ``NAME_combined``, ``NAME_first``
        and ``NAME_other``, 95 %. ``horizontal`` is a distance; the others are signed.
    scores : tuple of DifferenceScore
    place : tuple of (str, float, str)
        Where the largest horizontal difference is: name, value, unit.
    """

    run: int
    label: str
    table: pd.DataFrame = field(repr=False)
    scores: tuple[DifferenceScore, ...]
    place: tuple[tuple[str, float, str], ...] = ()

    def score(self, quantity: str) -> DifferenceScore | None:
        """Score of one quantity, if it has one."""
        return next((one for one in self.scores if one.quantity == quantity), None)


# Tracks of a sealed result.


def tracks_of(run: SealedRun) -> tuple[tuple[Track, ...], tuple[Finding, ...]]:
    """Read the tracks of a result, and say which could not be read."""
    read = {"navigate": _navigated, "crash": _crashed, "attitude": _attitudes}.get(run.command)
    tracks: list[Track] = []
    findings: list[Finding] = []
    for part in run.parts if read is not None else ():
        assert read is not None
        try:
            tracks += read(part)
        except StrapdownError as error:
            name = f"{run.name}, {part.label}" if part.label else run.name
            findings.append(Finding("compare.track-not-read", file=name, reason=error.finding))
    return tuple(tracks), tuple(findings)


def _navigated(part: RunPart) -> Iterator[Track]:
    names = [f"trajectory.{form}" for form in FORMS if part.has(f"trajectory.{form}")]
    if not names:
        raise DataError("compare.no-trajectory", known=[f"trajectory.{form}" for form in FORMS])
    table = read_trajectory(part.root / names[0])
    sd = None
    if part.has("sd.csv"):
        columns = _columns(part, "sd.csv", strict=False)
        known = {name: f"{name}_sd_{unit}" for name, unit in _SD_UNITS.items()}
        if {"time_s", *known.values()} <= set(columns):
            sd = pd.DataFrame(
                {name: columns[column] for name, column in known.items()},
                index=pd.Index(columns["time_s"], name="time"),
            )
    frame = part.answer.get("ellipsoid")
    yield Track("", "geodetic", frame if isinstance(frame, str) else "wgs84", table, sd)


def _crashed(part: RunPart) -> Iterator[Track]:
    data = part.answer
    system = data.get("units")
    columns = _columns(part, "trajectory.csv")
    whole = pd.DataFrame(columns).set_index("time_s")
    whole = table_in(str(system), whole, back=True)
    names = {f"{n}_{u}": n for n, u in _UNITS.items()}
    sds = {f"{n}_sd_{u}": n for n, u in _UNITS.items()}
    if not {*names, *sds} <= set(whole.columns):
        raise DataError("compare.file-damaged", file="trajectory.csv", reason="columns")
    frame = GROUND if is_over_ground(data) else VEHICLE
    table, sd = (whole[list(columns)].rename(columns=columns) for columns in (names, sds))
    yield Track(part.label, "local", frame, table, sd)


def _attitudes(part: RunPart) -> Iterator[Track]:
    columns = _columns(part, "attitude.csv")
    time = columns["time_s"] if "time_s" in columns else np.empty(0)
    for name in columns:
        algorithm = name.removesuffix(f" {QUATERNION[0]}")
        own = [f"{algorithm} {q}" for q in QUATERNION]
        if algorithm != name and set(own) <= set(columns):
            table = pd.DataFrame(
                {q: columns[c] for q, c in zip(QUATERNION, own, strict=True)}, index=time
            )
            yield Track(algorithm, "attitude", "", table)


def _columns(part: RunPart, name: str, *, strict: bool = True) -> Mapping[str, Array]:
    """Columns of numbers of a table; `time_s` is there and increases, strictly or not."""
    if not part.has(name):
        raise DataError("compare.file-missing", file=name)
    raw = csv.read(part.root / name)
    found = {
        key: np.asarray(v, np.float64) for key, v in raw.columns.items() if v.dtype.kind in "fiu"
    }
    time = found.get("time_s", np.empty(0))
    steps = np.diff(time)
    increases = (steps > 0.0).all() if strict else (steps >= 0.0).all()
    if time.size < 2 or not (np.isfinite(time).all() and increases):
        raise DataError("compare.file-damaged", file=name, reason="time_s does not increase")
    return found


@dataclass(frozen=True, eq=False)
class Curve:
    """Something of a run over time or rate that has no difference.

    Attributes
    ----------
    kind : str
        ``cone``: 95 % bound of the drift, m, over the time of an outage, s; ``sweep``: largest
        error, deg, of the algorithm `label` over the rate to which samples were averaged, Hz.
    """

    kind: str
    label: str
    x: Array
    y: Array


def curves_of(run: SealedRun) -> tuple[Curve, ...]:
    """Return the curves of an outage or a comparison of algorithms; those that can be read."""
    part = run.parts[0]
    if run.command == "outage":
        try:
            columns = _columns(part, "cone.csv")
        except StrapdownError:
            return ()
        bound = columns.get("horizontal_95_m")
        return () if bound is None else (Curve("cone", "", columns["time_s"], bound),)
    if run.command != "attitude":
        return ()
    sweep = part.answer.get("sweep")
    found: dict[str, list[tuple[float, float]]] = {}
    for row in sweep if isinstance(sweep, list) else ():
        if isinstance(row, dict) and row.get("meaning") == "sum":
            pair = (row.get("rate_hz"), row.get("error_deg"))
            if all(isinstance(v, float) and 0.0 < v < math.inf for v in pair):
                found.setdefault(str(row.get("algorithm"))[:LONGEST], []).append(pair)  # type: ignore[arg-type]
    return tuple(
        Curve("sweep", name, *np.array(sorted(points), dtype=np.float64).T)
        for name, points in found.items()
    )


# Differences on the common time.


def differences(
    first: tuple[Track, ...], other: tuple[Track, ...], run: int, name: str
) -> tuple[tuple[Difference, ...], tuple[Finding, ...]]:
    """Return the differences of a run's tracks from those of the first run with the same label.

    `run`, `name`: index and shown name of the run. Findings say what has no difference, and why.
    """
    out: list[Difference] = []
    findings: list[Finding] = []
    known = {(t.kind, t.label): t for t in first}
    for track in other:
        mate = known.get((track.kind, track.label))
        if mate is None:
            continue
        if mate.frame != track.frame:
            frames = (mate.frame, track.frame)
            findings.append(Finding("compare.other-frames", file=name, frames=frames))
            continue
        try:
            found = {"geodetic": _geodetic, "local": _local, "attitude": _angles}[track.kind](
                mate, track
            )
        except StrapdownError as error:
            findings.append(Finding("compare.no-difference", file=name, reason=error.finding))
            continue
        table, place, told = found
        findings += told
        out.append(Difference(run, track.label, table, _scores(table), place))
    return tuple(out), tuple(findings)


_Found = tuple[pd.DataFrame, tuple[tuple[str, float, str], ...], tuple[Finding, ...]]


def _geodetic(first: Track, other: Track) -> _Found:
    """Differences at the covariance marks of the other, as `compare_with_truth` has errors."""
    ellipsoid = find_ellipsoid(other.frame)
    if other.sd is None:
        row, mark = np.arange(len(other.table)), None
    else:
        row, mark = rows_of_marks(other.time, other.sd.index.to_numpy(dtype=np.float64))
    table = trajectory_differences(other.table.iloc[row], first.table, ellipsoid)
    time = table.index.to_numpy(dtype=np.float64)
    known = table.attrs["findings"]
    kept = np.searchsorted(other.time[row], time)
    sds: tuple[pd.DataFrame | None, pd.DataFrame | None] = (None, None)
    if first.sd is not None and other.sd is not None and mark is not None:
        marks = first.sd.index.to_numpy(dtype=np.float64)
        # A mark holds from its instant on; stamps of one instant may differ by rounding.
        nearest, same = same_stamps(marks, time, SAME_BEAT)
        before = np.where(same, nearest, np.searchsorted(marks, time, side="right") - 1)
        sds = (first.sd.iloc[np.maximum(before, 0)], other.sd.iloc[mark[kept]])
    found = _with_bounds(time, table, *sds)
    worst = other.table.iloc[row[kept[int(np.argmax(found["horizontal"]))]]]
    place = tuple((n, float(worst[n]), "deg") for n in ("lat", "lon"))
    return found, place, tuple(known)


def _local(first: Track, other: Track) -> _Found:
    """Differences at the instants of the other; the first is interpolated linearly."""
    time = _common(first, other)
    tables = []
    for track in (first, other):
        columns = {}
        for name in track.table.columns:
            values = track.table[name].to_numpy(dtype=np.float64)
            if name == "heading":
                values = np.unwrap(values, period=360.0)
            columns[name] = np.interp(time, track.time, values)
        assert track.sd is not None
        sd = {n: np.interp(time, track.time, track.sd[n].to_numpy()) for n in track.sd.columns}
        tables.append((pd.DataFrame(columns), pd.DataFrame(sd)))
    (a, sd_a), (b, sd_b) = tables
    table = b - a
    table[EULER] = rotation.within_half_turn(table[EULER].to_numpy())
    found = _with_bounds(time, table, sd_a, sd_b)
    worst = b.iloc[int(np.argmax(found["horizontal"]))]
    names = ("north", "east") if other.frame == GROUND else ("forward", "right")
    place = tuple((n, float(worst[c]), "m") for n, c in zip(names, NED, strict=False))
    return found, place, ()


def _with_bounds(
    time: Array, table: pd.DataFrame, first: pd.DataFrame | None, other: pd.DataFrame | None
) -> pd.DataFrame:
    """The quantities with the 95 % bounds of both, and combined as of independent errors."""
    north, east = (table[n].to_numpy(dtype=np.float64) for n in ("north", "east"))
    out = {"horizontal": np.hypot(north, east), "height": -table["down"].to_numpy()}
    out |= {name: table[name].to_numpy(dtype=np.float64) for name in (*VELOCITY, *EULER)}
    if first is None or other is None:
        return pd.DataFrame(out, index=pd.Index(time, name="time"))
    bounds: dict[str, Array] = {}
    sds = [{n: one[n].to_numpy(dtype=np.float64) for n in one.columns} for one in (first, other)]
    plane = np.zeros((len(time), 2, 2))
    for k, name in enumerate(("north", "east")):
        plane[:, k, k] = sds[0][name] ** 2 + sds[1][name] ** 2
    whole = np.isfinite(plane).all(axis=(1, 2)) & (plane[:, 0, 0] > 0.0) & (plane[:, 1, 1] > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.sqrt(north**2 / plane[:, 0, 0] + east**2 / plane[:, 1, 1])
    # A component that is certain has no share in the distance: the longer half axis bounds both.
    reach = PLANE_95 * np.sqrt(np.maximum(plane[:, 0, 0], plane[:, 1, 1]))
    reach[whole] = plane_reach(out["horizontal"][whole], distance[whole], plane[whole])
    bounds["horizontal_combined"] = reach
    for end, sd in zip(("first", "other"), sds, strict=True):
        bounds[f"horizontal_{end}"] = PLANE_95 * np.maximum(sd["north"], sd["east"])
    for name, own in {"height": "down", **{n: n for n in (*VELOCITY, *EULER)}}.items():
        both = [TWO_SIDED_95 * sd[own] for sd in sds]
        bounds[f"{name}_combined"] = np.hypot(*both)
        bounds[f"{name}_first"], bounds[f"{name}_other"] = both
    return pd.DataFrame(out | bounds, index=pd.Index(time, name="time"))


def _angles(first: Track, other: Track) -> _Found:
    """Angle between two attitudes; between its samples the first turns at a constant rate."""
    time = _common(first, other)
    q_first, q_other = (_attitude_at(track, time) for track in (first, other))
    angle = rotation.rotation_angle(q_first, q_other)
    return pd.DataFrame({"angle": angle}, index=pd.Index(time, name="time")), (), ()


def _attitude_at(track: Track, time: Array) -> Array:
    q = track.table[list(QUATERNION)].to_numpy(dtype=np.float64)
    size = np.linalg.norm(q, axis=1, keepdims=True)
    if not (np.isfinite(q).all() and (np.abs(size - 1.0) < 1e-3).all()):
        raise DataError("compare.file-damaged", file="attitude.csv", reason="no unit quaternions")
    q = q / size
    stamps = track.time
    after = np.clip(np.searchsorted(stamps, time), 1, len(stamps) - 1)
    share = (time - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
    turn = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(q[after - 1]), q[after])
    )
    steps = rotation.quaternion_from_rotation_vector(share[:, None] * turn)
    return rotation.compose(q[after - 1], steps)


def _common(first: Track, other: Track) -> Array:
    """Instants of the other within the span of the first."""
    a, b = first.time, other.time
    slack = 1e-6 * float(np.median(np.diff(a)))
    time: Array = b[(b >= a[0] - slack) & (b <= a[-1] + slack)]
    if not time.size:
        spans = [f"{t[0]:.9g} to {t[-1]:.9g} s" for t in (a, b)]
        raise DataError("compare.no-common-time", spans=spans)
    return time


def _scores(table: pd.DataFrame) -> tuple[DifferenceScore, ...]:
    time = table.index.to_numpy(dtype=np.float64)
    weight = time_shares(time)
    found = []
    for name in QUANTITIES:
        if name not in table:
            continue
        value = table[name].to_numpy(dtype=np.float64)
        if not np.isfinite(value).all():
            continue
        worst = int(np.argmax(np.abs(value)))
        bound = share = None
        if f"{name}_combined" in table:
            half = table[f"{name}_combined"].to_numpy(dtype=np.float64)
            if np.isfinite(half).all() and (half > 0.0).any():
                bound = math.sqrt(float(weight @ half**2))
                share = float(min(1.0, weight[np.abs(value) <= half].sum()))
        rms, last = math.sqrt(float(weight @ value**2)), float(value[-1])
        largest = float(abs(value[worst])), float(time[worst])
        unit = QUANTITIES[name][1]
        found.append(DifferenceScore(name, unit, rms, *largest, last, bound, share))
    return tuple(found)


def plain_scores(one: Difference) -> dict[str, Any]:
    """Return a difference for programs."""
    units = {"m": "m", "m/s": "m_per_s", "deg": "deg"}
    return {
        "of": one.label,
        "instants": len(one.table),
        "from_s": float(one.table.index[0]),
        "to_s": float(one.table.index[-1]),
        "largest_horizontal_at": {f"{n}_{u}": v for n, v, u in one.place},
        "quantities": {
            s.quantity: {
                f"rms_{units[s.unit]}": s.rms,
                f"largest_{units[s.unit]}": s.largest,
                "largest_at_s": s.largest_at,
                f"last_{units[s.unit]}": s.last,
                f"combined_bound_95_rms_{units[s.unit]}": s.bound,
                "share_within_combined_bound": s.share,
            }
            for s in one.scores
        },
    }
