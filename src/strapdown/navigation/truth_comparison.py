"""Compare a navigation run with the truth: errors beside their stated covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown._kernels import earth as kernel
from strapdown.constants import TWO_SIDED_95
from strapdown.dsp.chi_square import (
    chi_square_above,
    chi_square_exceeded,
    chi_square_quantile,
    normal_quantile,
    plane_bound,
    plane_reach,
)
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError, Finding
from strapdown.evaluation.trajectory_differences import (
    SAME_BEAT,
    same_stamps,
    trajectory_at,
    trajectory_differences,
)
from strapdown.frames import q_ne
from strapdown.navigation.record import NavigationRecord, standard_deviations
from strapdown.tables import (
    EULER,
    GEODETIC,
    NED,
    POSITION_SD,
    TRAJECTORY,
    TRAJECTORY_ERROR,
    VELOCITY,
    places_of,
)
from strapdown.tables.checks import index_of, view_of
from strapdown.tables.on_disk import let_go_of_all, parts_of

if TYPE_CHECKING:
    from strapdown.simulation.earth_motion import EarthMotion

Array = NDArray[np.float64]

#: Physical errors, in the order of `mechanization.state_error.state_error`, and their units.
COMPONENTS = ("north", "east", "down", "VN", "VE", "VD", "psi_N", "psi_E", "psi_D")
UNITS = ("m",) * 3 + ("m/s",) * 3 + ("deg",) * 3
#: Groups of components of the normalized squares.
PARTS = {
    "all": tuple(range(9)),
    "position": (0, 1, 2),
    "velocity": (3, 4, 5),
    "attitude": (6, 7, 8),
    "horizontal": (0, 1),
}
# A mark belongs to the first row after it, if that is not more steps of the recorder away.
NEAR = 1.5
# Share of a variance that is not determined by other components: with less, rounding of the nine
# leaves a normalized square fewer than three digits.
OWN_VARIANCE = 1e3 * 9 * np.finfo(np.float64).eps


#: Longest time that one instant represents, s, or three usual steps if longer.
LONGEST = 1.5
#: Evenly spaced instants over a run at which its errors are compared with each other.
EVEN = 1024


@dataclass(frozen=True)
class SolutionScore:
    """Errors of one quantity over a run.

    Attributes
    ----------
    rms : float
        Weighted by time: instants are dense where measurements are frequent, sparse in an outage.
    largest_at : float, s
    bound : float
        Root mean square of the 95 % bounds.
    share : float
        Share of the time in which the error is within its bound; NaN for a quantity without a
        variance of its own, as a height that is held.
    chance : float
        Probability of errors whose mean normalized square is as large, if the bounds are right: for
        normal errors that last as long as these do (`independent_errors`). NaN as above.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    bound: float
    share: float
    chance: float


@dataclass(frozen=True, eq=False)
class TruthComparison:
    """Errors of a run, and their covariance by the run.

    Attributes
    ----------
    time : ndarray, (k,), s
        Of the marks that the truth covers; for positions alone, of the positions.
    errors : ndarray, (k, 9)
        Computed − true, as `mechanization.state_error.state_error`: m, m/s, rad, in
        north-east-down. NaN where the truth has no velocity or attitude.
    covariance : ndarray, (k, 9, 9)
        Stated covariance of the errors.
    differences : DataFrame
        TrajectoryError table at `time`: m, m/s, deg of roll, pitch and heading; NaN as above.
    sd : DataFrame
        TrajectoryError table of the stated standard deviations.
    nees : DataFrame
        By time: normalized squares of the `PARTS` that can be computed.
    freedom : dict of str to int
        Number of components in each; without those that are not estimated, and those that have
        no variance of their own.
    inside : dict of str to float
        Share of the epochs at which each is below its 95 % bound (chi-square, one-sided);
        ``horizontal``: inside of the 95 % ellipse.
    table : DataFrame
        By component, with rows ``horizontal`` and ``3-D``: ``unit``, ``rms``, ``max`` (of the
        absolute value), ``sd`` (root mean square of the stated ones), ``inside`` (share within
        1.96 stated standard deviations; of the ellipse). Rotations in deg.
    findings : tuple of Finding
        Possible interpolation error of the truth; gaps.
    """

    time: Array
    errors: Array
    covariance: Array
    differences: pd.DataFrame
    sd: pd.DataFrame
    nees: pd.DataFrame
    freedom: dict[str, int]
    inside: dict[str, float]
    table: pd.DataFrame
    findings: tuple[Finding, ...] = ()

    def error(self, column: str) -> Array:
        """Errors of a quantity, (n,): m, m/s, deg."""
        return self.differences[column].to_numpy(dtype=np.float64)

    def bound(self, column: str) -> Array:
        """95 % bounds of the errors of a quantity, (n,)."""
        return TWO_SIDED_95 * self.sd[column].to_numpy(dtype=np.float64)

    @cached_property
    def scores(self) -> tuple[SolutionScore, ...]:
        """Scores of each quantity, and of the horizontal position."""
        units = (
            dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m/s") | dict.fromkeys(EULER, "deg")
        )
        found = [self._score(n, u, self.error(n), self.bound(n), (n,)) for n, u in units.items()]
        inside = self.table["inside"]
        for k, score in enumerate(found):
            if np.isnan(inside.get(score.quantity, 0.0)):
                found[k] = replace(score, share=np.nan, chance=np.nan)
        size = np.hypot(*(self.error(n) for n in NED[:2]))
        return self._score("horizontal", "m", size, self._plane(size), NED[:2]), *found

    def score(self, quantity: str) -> SolutionScore:
        """Score of one quantity."""
        return next(s for s in self.scores if s.quantity == quantity)

    def _plane(self, size: Array) -> Array:
        """Radius of the 95 % ellipse in the direction of the horizontal error, (n,), m.

        The error is within it if and only if it is within the ellipse.
        """
        covariance = self.covariance
        if "horizontal" not in self.nees:
            return plane_bound(covariance)
        distance = np.sqrt(self.nees["horizontal"].to_numpy(dtype=np.float64))
        return plane_reach(size, distance, covariance)

    @cached_property
    def _weight(self) -> Array:
        return time_shares(self.time)

    def _score(
        self, name: str, unit: str, error: Array, bound: Array, parts: Sequence[str]
    ) -> SolutionScore:
        worst = int(np.argmax(np.abs(error)))
        return SolutionScore(
            name,
            unit,
            float(np.sqrt(self._weight @ np.square(error))),
            float(abs(error[worst])),
            float(self.time[worst]),
            float(np.sqrt(self._weight @ np.square(bound))),
            float(min(1.0, self._weight[np.abs(error) <= bound].sum())),
            self._chance(error, bound, parts),
        )

    def _chance(self, error: Array, bound: Array, parts: Sequence[str]) -> float:
        """Probability of errors of one or two components that are as large for their bounds."""
        freedom, sd = len(parts), self.sd[list(parts)].to_numpy(dtype=np.float64)
        known = np.isfinite(error) & (bound > 0.0) & (sd > 0.0).all(axis=1)
        if not known.any():
            return np.nan
        limit, weight = chi_square_quantile(0.95, freedom), self._weight[known]
        squares = limit * np.square(error[known] / bound[known])
        each = self.differences[list(parts)].to_numpy(dtype=np.float64)[known] / sd[known]
        count = independent_errors(self.time[known], each)
        mean = float(weight @ squares / weight.sum())
        return float(chi_square_above(count * mean, count * freedom))


def independent_errors(time: Array, errors: Array) -> float:
    """Return the number of independent errors of equal effect on a mean square, 1 or more.

    Parameters
    ----------
    time : ndarray, (n,), s
        Increasing.
    errors : ndarray, (n, m)
        Normalized errors of mean zero, of m components that last equally long.

    Notes
    -----
    The mean square of a normal process of the autocorrelation ρ over a time T has the variance
    2/N of the square of its mean, with 1/N = ∬ ρ(t - s)² dt ds / T²; N is 1 for a constant error.
    ρ is that of the errors themselves, about zero; the scatter of its square at long lags makes the
    number too small, by a third for errors that last a third of the time, by three for errors that
    last a hundredth.
    """
    even = np.linspace(time[0], time[-1], EVEN)
    z = np.column_stack([np.interp(even, time, one) for one in errors.T])
    # Padded, so that the end does not meet the beginning.
    spectrum = np.square(np.abs(np.fft.rfft(z, 2 * EVEN, axis=0))).sum(axis=1)
    products, pairs = np.fft.irfft(spectrum)[:EVEN], EVEN - np.arange(EVEN)
    if not products[0] > 0.0:
        return 1.0
    rho = np.clip(products / pairs * (EVEN / products[0]), -1.0, 1.0)
    squares = pairs * np.square(rho)
    return float(EVEN**2 / (2.0 * squares.sum() - squares[0]))


def time_shares(time: Array) -> Array:
    """Share of the time that each of increasing instants represents, (n,)."""
    steps = np.diff(time)
    if not steps.size:
        return np.ones(len(time)) / len(time)
    # A long gap counts only up to this limit.
    steps = np.minimum(steps, max(LONGEST, 3.0 * float(np.median(steps))))
    about = 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
    return np.asarray(about / about.sum())


def compare_with_truth(
    trajectory: pd.DataFrame,
    marks: ArrayLike,
    covariance: Array,
    truth: pd.DataFrame | EarthMotion,
    ellipsoid: Ellipsoid = WGS84,
) -> TruthComparison:
    """Compare a run with the truth at the marks of its covariance.

    A mark holds from its instant on: it is compared with the first row of the trajectory that
    is not before it, which does not mix in a state before the observation.

    Parameters
    ----------
    trajectory : DataFrame
        Trajectory table (`NavigationRecord.trajectory`).
    marks : array_like, (m,), s
        Instants of the covariance (``NavigationRecord.sd.index``).
    covariance : ndarray, (m, 9, 9)
        `NavigationRecord.covariance`: NaN for errors that are not estimated.
    truth : DataFrame or EarthMotion
        Trajectory table of any rate, on the same clock (`trajectory_at`), or the motion itself.

    Raises
    ------
    DataError
        No mark is within the truth, a table is not valid, or a covariance is not positive.
    """
    stamps = trajectory.index.to_numpy(dtype=np.float64)
    row, mark = rows_of_marks(stamps, np.asarray(marks, dtype=np.float64))
    if not isinstance(truth, pd.DataFrame):
        inside = stamps[row] <= truth.duration
        span = (0.0, truth.duration)
    else:
        known = truth.index.to_numpy(dtype=np.float64)
        inside = same_stamps(known, stamps[row], SAME_BEAT)[1]
        inside |= (stamps[row] > known[0]) & (stamps[row] < known[-1])
        span = (float(known[0]), float(known[-1]))
    row, mark = row[inside], mark[inside]
    if not row.size:
        raise _nothing_in_common(trajectory, span)
    computed, time = trajectory.iloc[row], stamps[row]
    if not isinstance(truth, pd.DataFrame):
        true = truth.trajectory(time)
        differences = trajectory_differences(computed, true, ellipsoid)
    else:
        true = trajectory_at(truth, time, ellipsoid)
        differences = trajectory_differences(computed, truth, ellipsoid)
    P = np.asarray(covariance)[mark]
    return _comparison(
        time,
        state_errors(computed, true, ellipsoid),
        P,
        differences[TRAJECTORY_ERROR],
        computed[EULER].to_numpy(),
        tuple(differences.attrs["findings"]),
    )


def compare_with_places(
    trajectory: pd.DataFrame,
    marks: ArrayLike,
    covariance: Array,
    places: pd.DataFrame,
    *,
    antenna: Sequence[float] = (0.0, 0.0, 0.0),
    ellipsoid: Ellipsoid = WGS84,
) -> TruthComparison:
    """Compare a run with positions alone, as those of a receiver, at their own instants.

    Parameters
    ----------
    trajectory, marks, covariance
        As `compare_with_truth`; at a position the newest covariance is used.
    places : DataFrame
        By time in s: ``lat lon`` deg, ``alt`` m, and, if they are not exact, ``north_sd east_sd
        down_sd`` m, as a Gnss table. Their variance is added to the stated one, and they must
        not have been used by the run: errors of positions that the filter has used are
        correlated with its own.
    antenna : sequence of float, (3,), m
        Point of the positions, from the point that the trajectory describes, in body axes.

    Returns
    -------
    TruthComparison
        Of the position alone.
    """
    stamps = trajectory.index.to_numpy(dtype=np.float64)
    instants = np.asarray(marks, dtype=np.float64)
    usable = places[np.isfinite(places[GEODETIC].to_numpy(dtype=np.float64)).all(axis=1)]
    if "quality" in usable:
        usable = usable[usable["quality"] > 0]
    time = usable.index.to_numpy(dtype=np.float64)
    inside = (time >= max(stamps[0], instants[0])) & (time <= stamps[-1])
    if not inside.any():
        span = (float(time[0]), float(time[-1])) if time.size else (np.nan, np.nan)
        raise _nothing_in_common(trajectory, span)
    usable, time = usable[inside], time[inside]
    computed = trajectory_at(trajectory, time, ellipsoid)
    mark = np.searchsorted(instants, time, side="right") - 1
    q_nb = rotation.quaternion_from_euler(computed[EULER].to_numpy())
    arm = np.asarray(rotation.rotate(q_nb, np.asarray(antenna, dtype=np.float64)))
    errors = np.full((len(time), 9), np.nan)
    errors[:, :3] = (
        _displacements(places_of(computed), usable[GEODETIC].to_numpy(dtype=np.float64), ellipsoid)
        + arm
    )
    P = np.asarray(covariance)[mark]
    without = np.isnan(P)
    P = np.where(without, 0.0, P)
    # The antenna position has the error dr + psi x arm, too.
    J = np.concatenate(
        [np.broadcast_to(np.eye(3), (len(time), 3, 3)), -rotation.cross_matrix(arm)], axis=2
    )
    at = [0, 1, 2, 6, 7, 8]
    P[:, :3, :3] = J @ P[:, at][:, :, at] @ np.swapaxes(J, 1, 2)
    if set(POSITION_SD) <= set(usable.columns):
        own = usable[POSITION_SD].to_numpy(dtype=np.float64) ** 2
        P[:, [0, 1, 2], [0, 1, 2]] += np.where(np.isfinite(own), own, 0.0)
    P[without] = np.nan
    differences = pd.DataFrame(errors, index=pd.Index(time, name="time"), columns=TRAJECTORY_ERROR)
    return _comparison(time, errors, P, differences, computed[EULER].to_numpy(), ())


def state_errors(computed: pd.DataFrame, true: pd.DataFrame, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return `mechanization.state_error.state_error` of each pair of rows, (n, 9).

    Parameters
    ----------
    computed, true : DataFrame
        Trajectory tables of the same instants.
    """
    a, b = (table[TRAJECTORY].to_numpy(dtype=np.float64) for table in (computed, true))
    q_a, q_b = (rotation.quaternion_from_euler(x[:, 6:]) for x in (a, b))
    # From the truth's local level to that of the computed state.
    between = rotation.compose(q_ne(a[:, 0], a[:, 1]), rotation.conjugate(q_ne(b[:, 0], b[:, 1])))
    psi = rotation.rotation_vector_from_quaternion(
        rotation.compose(q_a, rotation.conjugate(rotation.compose(between, q_b)))
    )
    apart = _displacements(places_of(computed), places_of(true), ellipsoid)
    velocity = a[:, 3:6] - rotation.rotate(between, b[:, 3:6])
    return np.hstack([apart, velocity, psi])


def _displacements(computed: Array, true: Array, ellipsoid: Ellipsoid) -> Array:
    """As `displacement_between`, from degrees and meters."""
    a, e2 = ellipsoid.semi_major_axis, ellipsoid.eccentricity_squared
    pairs = np.hstack([computed, true])
    pairs[:, [0, 1, 3, 4]] = np.radians(pairs[:, [0, 1, 3, 4]])
    return np.array(
        [
            kernel.displacement(lat, lon, alt, true_lat, true_lon, true_alt, a, e2)
            for lat, lon, alt, true_lat, true_lon, true_alt in pairs.tolist()
        ]
    )


def rows_of_marks(stamps: Array, marks: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of a trajectory that belong to marks, and these marks: of several, the last."""
    step = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    nearest, same = same_stamps(stamps, marks, SAME_BEAT)
    row = np.where(same, nearest, np.searchsorted(stamps, marks))
    mark = np.flatnonzero(row < len(stamps))
    mark = mark[same[mark] | (stamps[row[mark]] - marks[mark] <= NEAR * step)]
    row = row[mark]
    last = np.append(row[1:] != row[:-1], True) if row.size else np.zeros(0, dtype=bool)
    return row[last], mark[last]


def _comparison(
    time: Array,
    errors: Array,
    P: Array,
    differences: pd.DataFrame,
    euler: Array,
    findings: tuple[Finding, ...],
) -> TruthComparison:
    variance = np.diagonal(P, axis1=1, axis2=2)
    # NaN where the run does not estimate; zero where it is certain by what it was started with.
    known = np.asarray(np.isfinite(errors).all(axis=0) & (variance > 0.0).all(axis=0))
    told = _independent(known, P)
    squares, freedom, inside = {}, {}, {}
    for part, members in PARTS.items():
        kept = [k for k in members if told[k]]
        if not kept or (part == "horizontal" and len(kept) < 2):
            continue
        squares[part] = normalised_squares(errors[:, kept], P[:, kept][:, :, kept])
        freedom[part] = len(kept)
        # One-sided: a smaller error is never outside an ellipse.
        limit = bounds(len(kept), 2.0 * SHARE - 1.0)[1]
        inside[part] = float(np.mean(squares[part] <= limit))
    index = pd.Index(time, name="time")
    sd = np.sqrt(np.maximum(variance, 0.0))  # NaN stays NaN
    return TruthComparison(
        time,
        errors,
        P,
        differences,
        standard_deviations(time, P, euler),
        pd.DataFrame(squares, index=index),
        freedom,
        inside,
        _table(errors, sd, told, inside),
        findings,
    )


def _independent(known: NDArray[np.bool_], P: Array) -> NDArray[np.bool_]:
    """Which known components are not linear functions of those before them, at any epoch."""
    sd = np.sqrt(np.where(known, np.diagonal(P, axis1=1, axis2=2), 1.0))
    correlation = P / (sd[:, :, None] * sd[:, None, :])
    kept: list[int] = []
    for k in np.flatnonzero(known).tolist():
        row = correlation[:, k, kept, None]
        others = correlation[:, kept][:, :, kept]
        own = 1.0 - np.sum(row * np.linalg.solve(others, row), axis=(1, 2))
        # A covariance that is not positive definite is refused with its squares.
        if not np.any(np.abs(own) <= OWN_VARIANCE):
            kept.append(k)
    return np.isin(np.arange(known.size), kept)


def _table(
    errors: Array, sd: Array, told: NDArray[np.bool_], inside: dict[str, float]
) -> pd.DataFrame:
    wide = float(normal_quantile(0.5 + 0.5 * SHARE))
    rows = {}
    for k, name in enumerate(COMPONENTS):
        factor = np.degrees(1.0) if UNITS[k] == "deg" else 1.0
        e, s = factor * errors[:, k], factor * sd[:, k]
        share = float(np.mean(np.abs(e) <= wide * s)) if told[k] else np.nan
        rows[name] = (UNITS[k], _rms(e), float(np.abs(e).max()), _rms(s), share)
    for name, members, part in (("horizontal", (0, 1), "horizontal"), ("3-D", (0, 1, 2), None)):
        at = list(members)
        e, s = (np.linalg.norm(x[:, at], axis=1) for x in (errors, sd))
        share = np.nan if part is None else inside.get(part, np.nan)
        rows[name] = ("m", _rms(e), float(e.max()), _rms(s), share)
    return pd.DataFrame.from_dict(
        rows, orient="index", columns=["unit", "rms", "max", "sd", "inside"]
    )


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))


def _nothing_in_common(trajectory: pd.DataFrame, span: tuple[float, float]) -> DataError:
    time = trajectory.index
    return DataError(
        "evaluation.run-truth-no-instant-common",
        file=trajectory.attrs.get("source"),
        quantity="time",
        time=time[0],
        time_2=time[-1],
        span=span[0],
        span_2=span[1],
    )


# Errors against their stated covariance: normalized squares and their bounds.


#: Default probability of the bounds.
SHARE = 0.95


def normalised_squares(errors: Array, covariance: Array) -> Array:
    """Return ``e' P^-1 e`` of each epoch (NEES), chi-square if P is the covariance of e.

    Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001,
    Eq. (5.4.2-1). Each component is scaled by its own standard deviation, so that meters beside
    radians cost no digits.

    Parameters
    ----------
    errors : ndarray, (..., n)
    covariance : ndarray, (..., n, n)

    Returns
    -------
    ndarray, (...)
    """
    sd = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    if not np.all(sd > 0.0):
        raise _not_positive(np.argwhere(~(sd > 0.0))[0])
    e = errors / sd
    P = covariance / (sd[..., :, None] * sd[..., None, :])
    try:
        factor = np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        bad = np.linalg.eigvalsh(P)[..., 0] <= 0.0
        raise _not_positive(np.argwhere(bad)[0] if bad.any() else np.zeros(1, int)) from None
    y = np.linalg.solve(factor, e[..., None])[..., 0]
    return np.asarray(np.sum(y * y, axis=-1))


def bounds(freedom: int, share: float = SHARE) -> tuple[float, float]:
    """Return the two-sided bounds that hold a share of chi-square numbers."""
    outside = 0.5 - 0.5 * share
    return chi_square_quantile(outside, freedom), chi_square_exceeded(outside, freedom)


def band_of_mean(freedom: int, runs: int, share: float = SHARE) -> tuple[float, float]:
    """Return the bounds of the mean of chi-square numbers over independent runs.

    Bar-Shalom et al. (2001), Eq. (5.4.2-9): ``chi2(runs * freedom) / runs``.
    """
    low, high = bounds(freedom * runs, share)
    return low / runs, high / runs


def _not_positive(at: NDArray[np.int_]) -> DataError:
    return DataError(
        "evaluation.covariance-not-positive-definite", row=int(at[0]) + 1, quantity="covariance"
    )


# Consistency of a filter with its smoother.


#: Limit of a difference, in its predicted standard deviations.
WITHIN = 3.0
#: A smoother that reduces a variance by less than this share has added no information, and the
#: difference of the variances is rounding.
TOLD = 1e-3


@dataclass(frozen=True, eq=False)
class SmootherConsistency:
    """Differences between the filtered and the smoothed solution.

    Attributes
    ----------
    columns : tuple of str
        Components: those of a TrajectoryError table.
    instants : ndarray of int, (9,)
        At which the smoother improves on the filter.
    share : ndarray, (9,)
        Share of these with a difference within three of its standard deviations; NaN without
        instants.
    rms : ndarray, (9,)
        Root mean square of the difference in them: about 1 where the model is right.
    """

    columns: tuple[str, ...]
    instants: NDArray[np.int_]
    share: Array
    rms: Array


def smoother_consistency(
    forward: NavigationRecord, smoothed: NavigationRecord, ellipsoid: Ellipsoid = WGS84
) -> SmootherConsistency:
    """Test the difference of two estimates against their covariances.

    Where the model is right, ``x_filter - x_smoother`` has the covariance ``P_filter -
    P_smoother`` (McReynolds, JOTA 1 (1967); Bryson and Ho, Applied Optimal Control, 1975, sec.
    13.2), normally distributed in each component and correlated over time: three standard
    deviations hold 99.7 %. A filter with a wrong model is contradicted by its later observations.

    Parameters
    ----------
    forward, smoothed : NavigationRecord
        Of one run.
    """
    columns = list(TRAJECTORY_ERROR)
    let_go_of_all()
    rows, marks = index_of(forward.trajectory), index_of(forward.sd)
    # A mark belongs to the first row after it, unless a later mark precedes that row.
    row = np.searchsorted(rows, marks - 1e-7)
    kept = np.flatnonzero(np.append(row[1:] > row[:-1], True) & (row < len(rows)))
    count, inside = (np.zeros(len(columns), dtype=np.int64) for _ in range(2))
    squares = np.zeros((1, len(columns)))
    for part in parts_of(len(kept), 81):
        at = row[kept[part]]
        values = view_of(
            trajectory_differences(
                forward.trajectory.iloc[at], smoothed.trajectory.iloc[at], ellipsoid
            ),
            columns,
        )
        less = np.square(view_of(forward.sd, columns)[kept[part]])
        more = less - np.square(view_of(smoothed.sd, columns)[kept[part]])
        told = more > TOLD * less
        z = np.where(told, values / np.sqrt(np.where(told, more, 1.0)), np.nan)
        count += told.sum(axis=0)
        inside += (np.abs(z) <= WITHIN).sum(axis=0)
        # Row by row, as of the whole.
        new = np.concatenate([squares, np.where(told, np.square(z), 0.0)])
        squares = new.sum(axis=0, keepdims=True)
        let_go_of_all()
    squares = squares[0]
    of = np.where(count > 0, count, np.nan)
    return SmootherConsistency(tuple(columns), count, inside / of, np.sqrt(squares / of))
