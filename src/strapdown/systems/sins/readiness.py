"""Whether a record and what aids it can be navigated by: told, or refused, before anything runs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from strapdown.aiding.aid import TableAid
from strapdown.aiding.gnss import Gnss
from strapdown.aiding.gnss_readiness import gnss_readiness
from strapdown.config.navigation import NavigationSpec, aids_of
from strapdown.config.navigation_modules import make_aids
from strapdown.errors import DataError, Finding
from strapdown.estimation.error_models import ERROR_MODELS
from strapdown.frames import ecef_from_geodetic
from strapdown.tables import GEODETIC, POSITION_SD
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["look_through"]

#: A height that nothing aids multiplies its error by e over so long, s: sqrt(R / 2 g).
VERTICAL = 570.0
#: From here on that is told, s.
LONG = 1800.0
#: The first fix may be so far from a place that is stated: standard deviations, m, and m/s since.
FAR_SD, FAR, FAST = 10.0, 1000.0, 340.0
#: Aids that hold the height.
HOLDS_HEIGHT = ("gnss", "barometer", "no_slip", "body_velocity")


def look_through(
    spec: NavigationSpec, imu: pd.DataFrame, tables: Mapping[str, pd.DataFrame]
) -> tuple[Finding, ...]:
    """Look at what aids measured beside the record that they are to aid.

    Parameters
    ----------
    spec : NavigationSpec
    imu : DataFrame
        Imu table of the span that is used.
    tables : mapping of str to DataFrame
        By name of the aid, on the clock of the samples.

    Returns
    -------
    tuple of Finding

    Raises
    ------
    DataError
        An aid is of another time than the record, or has nothing that can be used; the message
        names file, row and remedy.
    """
    found: list[Finding] = []
    for aid in make_aids(spec):
        table = tables.get(aid.name)
        if table is None:
            continue
        if isinstance(aid, Gnss):
            found += gnss_readiness(table, imu, aid)
            _refuse_far(spec, table, imu, aid)
        elif isinstance(aid, TableAid):
            _refuse_apart(table, imu)
    return (*found, *_height(spec, imu))


def _refuse_apart(table: pd.DataFrame, imu: pd.DataFrame) -> None:
    time, stamps = index_of(table), index_of(imu)
    if ((time >= stamps[0]) & (time <= stamps[-1])).any():
        return
    raise DataError(
        "navigation.aid-outside-record",
        file=source_of(table),
        quantity="time",
        time=time[0],
        time_2=time[-1],
        stamps=stamps[0],
        stamps_2=stamps[-1],
    )


def _refuse_far(spec: NavigationSpec, table: pd.DataFrame, imu: pd.DataFrame, aid: Gnss) -> None:
    """A first fix that is nowhere near the place that is stated."""
    name, stated = ("start", spec.start) if spec.start is not None else ("site", spec.site)
    if stated is None or not aid.use_position:
        return
    sd = values_of(table, POSITION_SD)
    placed = np.isfinite(sd).all(axis=1) & (values_of(table, ["quality"])[:, 0] > 0.0)
    after = index_of(table) - aid.time_offset - float(imu.index[0])
    rows = np.flatnonzero(placed & (after >= 0.0))
    if not rows.size:
        return
    k = int(rows[0])
    here = np.array([stated.lat_deg, stated.lon_deg, stated.alt_m])
    fix = values_of(table, GEODETIC)[k]
    scatter = math.hypot(float(np.linalg.norm(stated.position_sd_m)), float(sd[k].max()))
    allowed = FAR_SD * scatter + FAR + FAST * float(after[k])
    if (off := _apart(fix, here)) <= allowed:
        return
    swapped = abs(fix[0]) <= 180.0 and abs(fix[1]) <= 90.0
    swapped = swapped and _apart(fix[[1, 0, 2]], here) <= allowed
    raise DataError(
        "navigation.fixes-swap-latitude-and-longitude"
        if swapped
        else "navigation.first-fix-far-from-stated-position",
        file=source_of(table),
        row=k + 1,
        quantity="lat, lon",
        table=name,
        lat_deg=fix[0],
        lon_deg=fix[1],
        stated_lat_deg=here[0],
        stated_lon_deg=here[1],
        apart_km=off / 1000.0,
    )


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.linalg.norm(ecef_from_geodetic(one) - ecef_from_geodetic(other)))


def _height(spec: NavigationSpec, imu: pd.DataFrame) -> tuple[Finding, ...]:
    """What becomes of a height that nothing holds."""
    if getattr(spec.mechanization, "height", "free") != "free":
        return ()
    length = float(imu.index[-1] - imu.index[0])
    times = math.exp(min(length / VERTICAL, 700.0))
    model = getattr(getattr(spec.filter, "error_model", None), "kind", "")
    if (named := ERROR_MODELS.get(model)) is not None and not named.has_height:
        return (
            Finding(
                "navigation.error-model-without-height",
                file=source_of(imu),
                quantity="height",
                model=model,
                e_folding_s=VERTICAL,
                times=times,
            ),
        )
    if length <= LONG or any(aid.kind in HOLDS_HEIGHT for aid in aids_of(spec).values()):
        return ()
    return (
        Finding(
            "navigation.height-not-aided",
            file=source_of(imu),
            quantity="height",
            length=length / 60.0,
            e_folding_s=VERTICAL,
            times=times,
        ),
    )
