"""What a body at rest tells of its heading by the Earth's rate, and how far it bears itself out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.aiding.standstill import StandstillAid
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.fine_findings import ROCKS
from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.site import Site
from strapdown.ellipsoids import Ellipsoid
from strapdown.estimation.error_model import PHYSICAL
from strapdown.evaluation.heading_light import SURE
from strapdown.exceptions import StrapdownError
from strapdown.navigation.record import NavigationRecord
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.piece import Aligned
from strapdown.tables import GEODETIC
from strapdown.tables.checks import index_of

__all__ = ["Compass", "compasses_of", "north_within"]

Array = NDArray[np.float64]

#: Two-sided quantile of 99 of 100 of Student's t with two degrees of freedom.
STUDENT_2 = 9.924843200918
#: Root mean square of normalised innovations beyond which an alignment says nothing.
INCONSISTENT = 2.0
#: A rest that is long enough to tell north, and the longest that is taken at once, s.
SHORTEST, LONGEST = 60.0, 300.0
#: Epochs of a rest are no farther apart, s.
APART = 2.5


@dataclass(frozen=True, eq=False)
class Compass:
    """A heading that the gyros found at rest, from nothing that was known of it before.

    Attributes
    ----------
    begin, time : float, s
        Of the rest, and the instant at which it holds.
    q_nb : ndarray, (4,)
    gyro_bias : ndarray, (3,), rad/s
    sd : float, deg
        Of the heading, by what is stated of the gyros, times what its innovations scatter too
        much.
    bound : float, deg
        Of 99 of 100 headings, by what the rest itself shows of the gyros.
    """

    begin: float
    time: float
    q_nb: Array
    gyro_bias: Array
    sd: float
    bound: float


def north_within(sensors: ImuUncertainty, lat_deg: float, ellipsoid: Ellipsoid) -> float:
    """Return to how many degrees gyros as stated find north: one standard deviation, deg."""
    bias = np.hypot(sensors.gyro.axis("bias"), sensors.gyro_drift.triad)
    across = float(np.linalg.norm(Site(lat_deg, 0.0, 0.0, ellipsoid).earth_rate[:2]))
    worst = float(np.max(bias))
    return math.degrees(math.atan2(worst, across))


def compasses_of(
    chain: Chain,
    sensors: ImuUncertainty,
    imu: pd.DataFrame,
    record: NavigationRecord,
    aligned: Sequence[Aligned],
    ellipsoid: Ellipsoid,
) -> tuple[list[Compass], str]:
    """Return what the alignments and the rests of a run found, each by itself.

    Of an alignment that was told its heading, and of each rest that an aid saw, a fine alignment of
    its own is made, that begins with north as the inertial frame shows it.

    Parameters
    ----------
    chain : Chain
        Of the run.
    sensors : ImuUncertainty
    imu : DataFrame
        Its samples.
    record : NavigationRecord
        What came of it.
    aligned : sequence of Aligned
        Its alignments.
    ellipsoid : Ellipsoid

    Returns
    -------
    compasses : list of Compass
        In the order of time.
    why : str
        Why there is none, in words; empty where there is one.
    """
    found: list[Compass] = []
    refused: list[str] = []
    rests = list(_rests(chain, record))
    coarse: Alignment | None = None
    for one in aligned:
        if one.fine is None:
            coarse = one.alignment
            continue
        begin = float(one.fine.history.index[0])
        if one.fine.heading_given:
            rests.append((begin, one.end))
            continue
        against = _against(one.fine, coarse)
        if against:
            refused.append(f"its alignment does not bear itself out ({against})")
        else:
            found.append(_judged(one.fine, begin))
    for begin, end in sorted(rests):
        try:
            fine, before = _aligned_anew(imu, record, sensors, begin, end, ellipsoid)
        except StrapdownError as error:
            refused.append(f"a rest did not tell north ({error.what.partition(': ')[0]})")
            continue
        against = _against(fine, before)
        if against:
            refused.append(f"a rest does not bear itself out ({against})")
        else:
            found.append(_judged(fine, begin))
    if found:
        return sorted(found, key=lambda one: one.time), ""
    if refused:
        return [], refused[-1]
    return [], "it found north by no fine alignment, and no aid saw it stand for a minute"


def _judged(fine: FineResult, begin: float) -> Compass:
    """A heading with what its own rest shows of the gyros.

    An east rate that is none of the Earth's and a heading look alike. The rest shows those to the
    north and down, which must be the Earth's: with u their number of standard deviations, the
    heading errs by as much as they do, and is within 9.92 rms(u) of its own in 99 of 100 cases,
    however good the gyros are (Student's t with two degrees of freedom).
    """
    found = fine.alignment
    scatter = max(1.0, _scatter(fine))
    sd = float(found.sd_deg[2]) * scatter
    bound = sd * max(SURE, STUDENT_2 * math.sqrt(float(np.mean(np.square(_surprise(fine))))))
    assert found.gyro_bias is not None
    return Compass(begin, found.time, found.q_nb, found.gyro_bias, sd, bound)


def _surprise(fine: FineResult) -> Array:
    """Rates to the north and down that are none of the Earth's, by what was expected of them."""
    found = fine.alignment
    assert found.gyro_bias is not None
    C_nb = rotation.dcm_from_quaternion(found.q_nb)
    before = C_nb @ np.diag(np.square(fine.filter.model.sensors[0].sd[:3])) @ C_nb.T
    gyros = slice(PHYSICAL, PHYSICAL + 3)
    after = C_nb @ fine.filter.physical_covariance(fine.state)[gyros, gyros] @ C_nb.T
    told = np.diagonal(before - after)[[0, 2]]
    rate = (C_nb @ found.gyro_bias)[[0, 2]]
    # What a rest did not tell at all surprises nobody, and bears nothing out.
    return np.asarray(np.where(told > 0.0, rate / np.sqrt(np.where(told > 0.0, told, 1.0)), np.inf))


def _scatter(fine: FineResult) -> float:
    """Root mean square of its normalised innovations, of the worst component."""
    worst = 0.0
    for table in fine.innovations.values():
        late = table.iloc[len(table) // 10 :]
        parts = len(late.columns) // 3
        nu, s = late.iloc[:, :parts].to_numpy(), late.iloc[:, parts : 2 * parts].to_numpy()
        worst = max(worst, float(np.sqrt(np.mean(np.square(nu) / s, axis=0)).max()))
    return worst


def _against(fine: FineResult, coarse: Alignment | None) -> str:
    """What speaks against an alignment, in a few words; empty if nothing does."""
    for one in fine.findings:
        if one.quantity != ROCKS:
            return one.what.partition(":")[0].partition(" (")[0]
    scatter = _scatter(fine)
    if scatter > INCONSISTENT:
        return f"what it observed scatters {scatter:.2g} times as much as it should"
    if coarse is None or coarse.heading_given:
        return ""
    beside = fine.at_start if abs(coarse.time - fine.at_start.time) < 1.0 else fine.alignment
    apart = rotation.within_half_turn(coarse.roll_pitch_heading[2] - beside.roll_pitch_heading[2])
    if abs(float(apart)) > SURE * math.hypot(float(coarse.sd_deg[2]), float(beside.sd_deg[2])):
        return f"coarse and fine alignment differ by {abs(float(apart)):.2g}°"
    return ""


def _aligned_anew(
    imu: pd.DataFrame,
    record: NavigationRecord,
    sensors: ImuUncertainty,
    begin: float,
    end: float,
    ellipsoid: Ellipsoid,
) -> tuple[FineResult, Alignment]:
    """A fine alignment of a rest, from its samples and its place alone."""
    time = index_of(imu)
    first, last = np.searchsorted(time, [begin - 1e-6, end + 1e-6])
    part = imu.iloc[first:last]
    part.attrs = dict(imu.attrs)
    row = min(int(np.searchsorted(index_of(record.trajectory), end)), len(record.trajectory) - 1)
    lat_deg, lon_deg, alt = (float(record.trajectory[c].iloc[row]) for c in GEODETIC)
    site = Site(lat_deg, lon_deg, alt, ellipsoid)
    coarse = InertialFrame().align(part, site, sensors)
    return FineAlignment().align(part, site, sensors, coarse), coarse


def _rests(chain: Chain, record: NavigationRecord) -> Iterator[tuple[float, float]]:
    """Begins and ends of the rests that aids saw, in parts that are not too long."""
    windows = {aid.name: aid.window for aid in chain.navigator.aids if _stands(aid)}
    told = [
        (index_of(table), windows[name.rpartition(".")[0]])
        for name, table in record.innovations.items()
        if name.rpartition(".")[0] in windows and len(table)
    ]
    if not told:
        return
    time = np.unique(np.concatenate([one for one, _ in told]))
    window = max(one for _, one in told)
    starts = np.flatnonzero(np.diff(time, prepend=-math.inf) > APART)
    for k, upto in zip(starts.tolist(), [*starts[1:].tolist(), len(time)], strict=True):
        # The first and the last second of a stop are those of its braking and starting.
        begin, end = float(time[k]), float(time[upto - 1]) - window
        count = max(1, math.floor((end - begin) / LONGEST))
        if end - begin < SHORTEST:
            continue
        edges = np.linspace(begin, end, count + 1)
        yield from zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)


def _stands(aid: object) -> bool:
    """Whether an aid tells the rests of a vehicle: a foot stands for no minute, and turns."""
    return isinstance(aid, StandstillAid)
