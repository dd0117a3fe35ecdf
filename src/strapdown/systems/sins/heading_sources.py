"""Agreement of independent heading sources: two or more confirm each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.aiding.heading import Heading
from strapdown.evaluation.heading_light import RECENT, SURE, seconds_of
from strapdown.navigation.record import NavigationRecord
from strapdown.systems.sins.chain import NavigationPipeline
from strapdown.systems.sins.heading_witness import CarriedHeading
from strapdown.tables.checks import index_of

__all__ = ["AgreeingSources", "agreeing_sources"]

Array = NDArray[np.float64]

#: Fewest readings of a source.
FEWEST = 5


@dataclass(frozen=True, eq=False)
class AgreeingSources:
    """Heading by the second-best of several agreeing sources; as `heading_light.Heard`.

    Attributes
    ----------
    since : float, s
    time : ndarray, (n,), s
        Seconds with two or more sources, all of which agree.
    difference, sd : ndarray, (n,), deg
        Heading of the run minus that of the second-best source, and its standard deviation.
    kind : str
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    kind: str = "sources"


def agreeing_sources(
    chain: NavigationPipeline, record: NavigationRecord, carried: Sequence[CarriedHeading]
) -> list[AgreeingSources]:
    """Combine heading measurements and headings found by gyrocompassing.

    A constant error of a heading measurement is not observable from it alone, and the filter
    becomes overconfident. Independent sources, such as a magnetic compass and two antennas, or two
    antennas and the gyros' north, do not share it: the accuracy of the worse of them holds while
    all agree with the run within 2.58 standard deviations. A measurement with an estimated
    misalignment does not count as a source.

    Parameters
    ----------
    chain : NavigationPipeline
    record : NavigationRecord
    carried : sequence of CarriedHeading

    Returns
    -------
    list of AgreeingSources
        One or none.
    """
    seconds = seconds_of(record)
    told = [
        one
        for aid in chain.navigator.aids
        if isinstance(aid, Heading) and aid.misalignment_sd_deg == 0.0
        for one in [_of_aid(record, aid.name, seconds)]
        if one is not None
    ]
    if carried:
        told.append(_of_gyros(carried, seconds))
    if len(told) < 2:
        return []
    d, s = np.array([x for x, _ in told]), np.array([x for _, x in told])
    known = np.isfinite(s)
    bound = np.where(known, np.abs(d) + SURE * s, np.inf)
    own = np.interp(seconds, index_of(record.sd), record.sd["heading"])
    agree = (~known | (np.abs(d) <= SURE * np.hypot(s, own))).all(axis=0)
    good = agree & (known.sum(axis=0) >= 2)
    second = np.argsort(bound, axis=0)[1]
    column = np.arange(len(seconds))
    d, s = d[second, column], s[second, column]
    if not good.any():
        return []
    return [AgreeingSources(float(seconds[good][0]), seconds[good], d[good], s[good])]


def _of_aid(record: NavigationRecord, name: str, seconds: Array) -> tuple[Array, Array] | None:
    """Run minus measurement, and its standard deviation with a common error of all readings."""
    table = record.innovations.get(f"{name}.heading")
    if table is None or not len(table):
        return None
    time = index_of(table)
    nu, s = (np.degrees(table.iloc[:, 0]), np.degrees(np.sqrt(table.iloc[:, 1])))
    nu, s = nu.to_numpy(dtype=np.float64), s.to_numpy(dtype=np.float64)
    first = np.searchsorted(time, seconds - RECENT, side="right")
    last = np.searchsorted(time, seconds + 1e-6, side="right")
    d, sd = np.full(len(seconds), np.nan), np.full(len(seconds), np.inf)
    for k, (a, b) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        if b - a >= FEWEST:
            d[k], sd[k] = np.median(nu[a:b]), np.median(s[a:b])
    return d, sd


def _of_gyros(carried: Sequence[CarriedHeading], seconds: Array) -> tuple[Array, Array]:
    """Run minus the heading carried from the newest rest, by the stated gyro errors."""
    d, sd = np.full(len(seconds), np.nan), np.full(len(seconds), np.inf)
    for one in carried:
        at = np.searchsorted(seconds, one.time - 1e-6)
        inside = at < len(seconds)
        d[at[inside]], sd[at[inside]] = one.difference[inside], one.plain[inside]
    return d, sd
