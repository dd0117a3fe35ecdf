"""The state of a vehicle when it is struck, from satellite fixes before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.crash.entry_checks import check_arguments, check_enough
from strapdown.crash.entry_estimate import Fixes, estimate
from strapdown.crash.entry_findings import findings, say_outliers, unlikely
from strapdown.crash.entry_priors import EntryPriors
from strapdown.crash.entry_start import first_guesses
from strapdown.crash.entry_state import EntryState
from strapdown.crash.entry_trust import AVERAGED, RECOVERY, judge_fixes, record_of_fixes
from strapdown.errors import DataError
from strapdown.increments import motion_increments
from strapdown.mechanization import NavigationRun, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.tables import (
    GEODETIC,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
)
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]


def entry_state_from_gnss(
    imu: pd.DataFrame,
    gnss: pd.DataFrame,
    *,
    impact: float,
    priors: EntryPriors,
    window: float = 10.0,
    anchor: float | None = None,
    antenna: Sequence[float] = (0.0, 0.0, 0.0),
    ellipsoid: str = "wgs84",
) -> EntryState:
    """Estimate speed, velocity, attitude and biases when a crash begins, from fixes before it.

    Parameters
    ----------
    imu : DataFrame
        Imu table with specific force, in vehicle axes at the vehicle's reference point.
    gnss : DataFrame
        Gnss table on the same clock; rows anywhere in time.
    impact : float, s
        Beginning of the crash; nothing from there on is used of either table.
    priors : EntryPriors
    window : float, s
        Length of the record before the anchor that is used, 1 to 60.
    anchor : float, s, optional
        Instant of the state, not after the impact; the impact where it is left out. The state is
        that at the last sample of the Imu table up to there.
    antenna : sequence of float, m
        From the reference point, in vehicle axes.
    ellipsoid : str
        Of the places, one of `ellipsoids.ELLIPSOIDS`.

    Returns
    -------
    EntryState

    Raises
    ------
    DataError
        A table is not valid, there is no specific force, the Imu table does not reach from before
        the fixes to the anchor, or fewer than three fixes over one second are left to be used.
    ConfigError
        An argument is out of range.
    DivergenceError
        As `run_mechanization`.

    Notes
    -----
    *Method.* Iterated generalised least squares (Gauss-Newton) for the 15 states at the anchor,
    from which the full mechanization runs backward over the window, and for scale,
    misalignment, g-sensitivity, antenna and time offset as far as the priors leave them open.
    The covariance of the rows has the noise of the inertial sensors between each fix and the
    anchor, and the part of the receiver's error that stays (`FixCorrelation`), so that ten fixes
    a second are not taken for ten times the knowledge; `entry_adjust.adjust` solves it fix by
    fix. Fixes that lie too far from what all others say lose weight (`entry_adjust.weigh`).

    *Which fixes.* None from the impact on; none where the acceleration without gravity exceeds
    50 m/s² or the jerk 20 m/s³ (both means over 50 ms, `entry_trust.strain`), nor for 1 s after;
    none of quality 0. `EntryState.fixes` says of each why.

    *What can be seen.* Velocity and place always. Roll and pitch, and the horizontal bias
    that looks like them, only together while the vehicle neither turns nor accelerates: 0.1 m/s²
    of bias is 0.6 deg, and the prior of the bias decides. Heading through changes of velocity
    alone: a steady straight drive does not show it, unless the vehicle may be taken to travel
    along its axis (`EntryPriors.side_slip_sd_deg`). A finding says when it is not seen. A
    standard deviation beyond some 15 deg then means "unknown": errors so large are not linear,
    and the noise that the accelerometers have summed up is itself taken for a motion.

    *Valid* for motions that the Imu table samples well; for sensor errors that stay over the
    window; without vibration that the sensors rectify; and for fixes whose standard deviations
    are right: a misfit that chance does not explain is told.
    """
    mechanization = NorthEastDown(ellipsoid=ellipsoid)
    at = impact if anchor is None else anchor
    check_arguments(imu, gnss, impact, window, at, antenna)
    source = gnss.attrs.get("source")
    stamps, sensed = index_of(gnss), index_of(imu)
    instants = stamps - priors.time_offset
    last = int(np.searchsorted(sensed, at, side="right")) - 1
    begin = max(at - window, float(sensed[0]))
    later = instants >= begin
    reached = later & (instants <= sensed[last])
    if not reached.any():
        raise DataError(
            "crash.no-fix-between-beginning-window",
            file=source,
            quantity="time",
            begin=begin,
            sensed=sensed[last],
        )
    first = float(instants[reached][0])
    piece = _between(imu, first, last)
    turned = _turn_only(
        mechanization, _between(imu, first - RECOVERY - 2.0 * AVERAGED, last), gnss[reached]
    )
    slack = 3.0 * priors.time_offset_sd
    why = judge_fixes(
        instants[later],
        values_of(gnss, ["quality"])[later, 0],
        turned,
        impact,
        float(sensed[last]),
        slack,
    )
    record = record_of_fixes(stamps[later], why)
    used = np.flatnonzero(later)[record["used"].to_numpy()]
    fixes = Fixes(
        instants[used],
        values_of(gnss, GEODETIC)[used],
        values_of(gnss, VELOCITY)[used],
        np.hstack([values_of(gnss, POSITION_SD)[used], values_of(gnss, VELOCITY_SD)[used]]),
    )
    check_enough(fixes, why, source)

    guesses, found = first_guesses(turned, fixes, priors)
    arm = np.asarray(antenna, dtype=np.float64)
    best = estimate(mechanization, piece, fixes, guesses[0], priors, arm)
    for other in guesses[1:]:
        # A drive backward, or with the axes turned, fits from the other heading alone.
        if unlikely(best.cost, best.degrees_of_freedom):
            next_best = estimate(mechanization, piece, fixes, other, priors, arm)
            best = min(best, next_best, key=lambda e: e.cost)
    for name, weights, misfits in (
        ("position", best.weights[:, 0], best.misfits[:, 0]),
        ("velocity", best.weights[:, 1], best.misfits[:, 1]),
    ):
        record.loc[record["used"], f"{name}_weight"] = weights
        record.loc[record["used"], f"{name}_misfit"] = misfits
    say_outliers(record)
    return EntryState(
        state=best.state,
        gyro_bias=tuple(best.gyro_bias.tolist()),
        accel_bias=tuple(best.accel_bias.tolist()),
        covariance=best.covariance,
        mean_rate=tuple(best.mean_rate.tolist()),
        mean_specific_force=tuple(best.mean_force.tolist()),
        fixes=record,
        chi_square=best.chi_square,
        degrees_of_freedom=best.degrees_of_freedom,
        iterations=best.iterations,
        findings=(*found, *findings(best, record, source, priors, at)),
    )


def _between(imu: pd.DataFrame, begin: float, last: int) -> pd.DataFrame:
    """Rows from the last one before an instant to a row."""
    first = max(0, int(np.searchsorted(index_of(imu), begin, side="right")) - 1)
    # A step needs two samples.
    piece = imu.iloc[min(first, last - 1) : last + 1]
    piece.attrs = dict(imu.attrs)
    return piece


def _turn_only(
    mechanization: NorthEastDown, imu: pd.DataFrame, gnss: pd.DataFrame
) -> NavigationRun:
    """Navigate from a stand, level and to the north: only what changes means something."""
    increments = motion_increments(imu)
    begin = float(increments.index[0] - increments["dt"].iloc[0])
    at = gnss[GEODETIC].median()
    start = NavState.from_degrees(at["lat"], at["lon"], at["alt"], time=begin)
    return run_mechanization(mechanization, start, increments)
