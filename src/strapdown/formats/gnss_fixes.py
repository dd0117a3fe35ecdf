"""Common part of the readers of GNSS fixes: options, and checks of every fix."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.arrays import told_by_file_rows
from strapdown.formats.clocks import GPS, RELATIVE, Clock, unrolled, with_clock
from strapdown.tables import gnss_table
from strapdown.tables.checks import (
    GEODETIC,
    HEIGHTS_AS_STATED,
    ORIGIN_STATED,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    Array,
)
from strapdown.tables.gnss import FIX_KINDS, check_velocity

Sd = float | tuple[float, float, float]

#: Radius of 68 % of a circular normal distribution, in standard deviations (Android,
#: Location.getAccuracy): 1 - exp(-r²/2) = 0.68.
RADIUS = float(np.sqrt(-2.0 * np.log(0.32)))
#: Standard deviation of an unstated vertical accuracy, relative to the horizontal one.
UNSTATED_VERTICAL = 2.0
#: Level of fixes without heights, and the standard deviation of the one that a user states for all
#: of them, m, unless stated, too.
NOWHERE, STATED_HEIGHT_SD = "nowhere", 100.0
#: Usual standard deviation of a horizontal position, a component, m, by the quality of NMEA 0183
#: GGA. Mapit GIS (RTK and Fix Types) has 0.01 to 0.03 m for 4, 0.1 to 0.3 for 5, below 0.3 for 3,
#: 0.5 to 2 for 2, 2 to 5 for 1; nmea_navsat_driver of ROS takes 0.02 m for 4, 4 for 5 and 1. Float
#: and precise solutions converge, hence more than the first. One that is estimated, manual or
#: simulated (6 to 8) is taken for no better than an autonomous one.
USUAL_POSITION_SD = {4: 0.02, 5: 0.5, 3: 1.0, 2: 1.0, 1: 5.0, 6: 5.0, 7: 5.0, 8: 5.0}
#: Typical accuracies of receivers, m and m/s.
POSITION_SDS = "0.02 suits RTK, 1 a code receiver with corrections, 5 one without"
VELOCITY_SDS = "0.05 suits RTK, 0.3 a code receiver by Doppler, 1 one that differences places"


def utm_zone(text: str) -> tuple[int, bool]:
    """Return the zone of UTM, 1 to 60, and whether it is of the south, of ``33N``.

    ConfigError: the text is not a zone with its hemisphere.
    """
    match = re.fullmatch(r"\s*(?:UTM\s*)?(\d{1,2})\s*([NS])\s*", text, re.I)
    if match is None or not 1 <= int(match[1]) <= 60:
        raise ConfigError("io.no-utm-zone", quantity="origin", text=text)
    return int(match[1]), match[2].upper() == "S"


@dataclass(frozen=True)
class GnssOptions:
    """User's statements about a file of fixes; None means as in the file."""

    #: A key of `formats.READERS`.
    format: str | None = None
    #: Quantity (``time``, ``lat`` …, as in a Gnss table) to the name of its column, or its number,
    #: from 1.
    columns: Mapping[str, str] = field(default_factory=dict)
    #: Quantity to the unit of its column: ``time`` in ``ms``, ``lat`` in ``rad``.
    units: Mapping[str, str] = field(default_factory=dict)
    #: Height over the ellipsoid, m, of the level from which the file counts its heights: that of
    #: the geoid, or of the point of take-off.
    datum_height: float | None = None
    #: Latitude and longitude, deg, and height, m, of the origin of local positions (``north east
    #: up``), or of where velocities without positions begin; or the zone of UTM, with its
    #: hemisphere, of northings and eastings: ``33N``.
    origin: tuple[float, float, float] | str | None = None
    #: `position_sd`, `velocity_sd`: standard deviations north, east, down, or one for all three,
    #: for each fix; they replace those of the file. Where it states none for positions, but kinds
    #: of fix, a worse kind than that which `position_sd` suits has its usual one (`_by_quality`).
    position_sd: Sd | None = None
    velocity_sd: Sd | None = None
    #: `unstated_position_sd`, `unstated_velocity_sd`: used where the file states none, that of the
    #: position at most; `attrs` of the table then has ``position_sd_taken``, ``velocity_sd_taken``.
    unstated_position_sd: float | None = None
    unstated_velocity_sd: float | None = None
    #: Steps of the receiver's clock, s, one after another: a stamp, and what is subtracted from it
    #: and the later ones.
    clock_steps: tuple[tuple[float, float], ...] = ()
    #: Drop and count rows that cannot be used, instead of refusing the file.
    repair: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.origin, str):
            utm_zone(self.origin)
        for name in ("position_sd", "velocity_sd", "unstated_position_sd", "unstated_velocity_sd"):
            value = getattr(self, name)
            if value is not None and not (
                np.shape(value) in ((), (3,)) and np.all(np.asarray(value) > 0.0)
            ):
                raise ConfigError("io.no-standard-deviation", quantity=name, value=value)


@dataclass
class Fixes:
    """Fixes from a file, in the units of a Gnss table; NaN where missing."""

    name: str
    #: (n,), s.
    time: Array
    #: (n, 3): latitude and longitude in deg, height above the ellipsoid in m.
    place: Array
    #: (n,): row of the file, counted from 1.
    rows: NDArray[np.int64]
    #: Whether the file measures positions; else `place` is the origin that the user states.
    placed: bool = True
    clock: Clock = field(default_factory=lambda: Clock(RELATIVE))
    #: Column of a clock of another kind, by how much it is ahead, s, and its kind.
    other_clock: tuple[str, float, str] | None = None
    #: `velocity`, `position_sd`, `velocity_sd`: (n, 3): north, east, down.
    velocity: Array | None = None
    position_sd: Array | None = None
    velocity_sd: Array | None = None
    #: (n,): as field 6 of NMEA 0183 GGA.
    quality: Array | None = None
    #: (n,): used in each fix; for display.
    satellites: Array | None = None
    #: A standard deviation of zero means unknown.
    zero_is_unknown: bool = False
    #: {'sea', 'take-off', 'unstated', 'open', 'as stated', 'nowhere', ''}: level from which heights
    #: are counted; empty: from the ellipsoid; 'open': the name of a column does not say it; 'as
    #: stated': that of the fixes that were written to this file; 'nowhere': the fixes have none.
    heights_from: str = ""
    #: Column or field of the heights, for messages.
    height_source: str = ""
    findings: list[Finding] = field(default_factory=list)


def table_of_fixes(fixes: Fixes, options: GnssOptions) -> pd.DataFrame:
    """Convert fixes to a Gnss table, or report their fault.

    Returns a Gnss table; ``attrs`` has its clock (`clocks`) and its `findings`. DataError: a stamp
    or position is not a number, time does not advance, a standard deviation is zero, negative or
    not stated, or as `gnss_table`.
    """
    count = fixes.time.size
    asked: Sd | None = options.position_sd
    taken: dict[str, float] = {}
    if not fixes.placed:
        if asked is not None:
            raise ConfigError(
                "io.position-sd-without-positions", file=fixes.name, quantity="position_sd_m"
            )
        asked = math.inf
    elif fixes.position_sd is None and asked is None and options.unstated_position_sd is not None:
        asked = taken["position_sd_taken"] = options.unstated_position_sd
        if np.isinf(asked).all():
            add_warning(
                fixes.findings,
                "io.position-sd-not-stated",
                file=fixes.name,
                quantity=", ".join(POSITION_SD),
            )
    try:
        place = _over_ellipsoid(fixes, options)
    except DataError as error:
        if fixes.position_sd is not None or asked is not None:
            raise
        # What a file leaves open is asked at once.
        questions = [error.finding, _without_sd(fixes)]
        raise DataError(
            "io.fixes-leave-open",
            file=fixes.name,
            questions=questions,
            flags=error.finding.data.get("flags", ""),
            keys=error.finding.data.get("keys", ""),
        ) from None
    position_sd = _sd(fixes, "position", asked, count)
    if fixes.heights_from == NOWHERE:
        position_sd[:, 2] = _sd_of_stated_height(fixes, asked, options, count)
    asked = options.velocity_sd
    unstated = fixes.velocity is not None and fixes.velocity_sd is None and asked is None
    if unstated and options.unstated_velocity_sd is not None:
        asked = taken["velocity_sd_taken"] = options.unstated_velocity_sd
    if not fixes.placed and fixes.velocity_sd is None and asked is None:
        raise DataError("io.velocity-sd-alone", file=fixes.name, quantity=", ".join(VELOCITY_SD))
    velocity, velocity_sd = _velocity(fixes, asked, count)
    quality = np.ones(count) if fixes.quality is None else fixes.quality
    quality = np.where(np.isnan(quality), 0.0, quality)
    time, keep = _time(fixes, options)
    keep &= _placed(fixes, quality, options)
    if not keep.any():
        raise DataError("io.no-usable-fix", file=fixes.name, quantity="lat, lon")
    at = np.flatnonzero(keep)
    if fixes.position_sd is None and fixes.quality is not None:
        level = slice(2 if fixes.heights_from == NOWHERE else 3)
        position_sd[at, level] = _by_quality(fixes, position_sd[at], quality[at], taken)[:, level]
    with told_by_file_rows(fixes.name, lambda row: int(fixes.rows[at[row]])):
        table = gnss_table(
            time[at],
            place[at],
            velocity[at],
            position_sd[at],
            velocity_sd[at],
            quality[at],
            source=fixes.name,
        )
    fit = check_velocity(table)
    if fit is not None and not fit.name:
        add_warning(
            fixes.findings,
            "io.velocity-unlike-positions",
            file=fixes.name,
            row=int(fixes.rows[at[fit.row]]),
            quantity="VN, VE",
            speed=fit.speed,
            moved=fit.moved,
        )
    if fixes.satellites is not None:
        table["satellites"] = fixes.satellites[at]
    with_clock(table, fixes.clock)
    table.attrs["findings"] = tuple(fixes.findings)
    if fixes.other_clock is not None:
        table.attrs["other_clock"] = fixes.other_clock
    table.attrs.update(taken)
    if not fixes.placed:
        table.attrs[ORIGIN_STATED] = True
    if fixes.heights_from not in ("", NOWHERE) and not options.datum_height:
        table.attrs[HEIGHTS_AS_STATED] = True
    table.attrs["first_row"] = first_of(fixes.rows[at])
    return table


#: Code of the question, by the level from which heights are counted.
_LEVELS = {
    "sea": "io.height-over-sea-column",
    "take-off": "io.heights-over-take-off",
    "unstated": "io.height-level-not-stated",
}


def _over_ellipsoid(fixes: Fixes, options: GnssOptions) -> Array:
    """Return positions with the height over the ellipsoid, or ask for the level of the file's."""
    if not fixes.heights_from:
        if options.datum_height is not None:
            raise ConfigError(
                "io.heights-over-ellipsoid-already", file=fixes.name, quantity="datum_height_m"
            )
        return fixes.place
    heights = {"file": fixes.name, "quantity": "alt", "source": fixes.height_source}
    if options.datum_height is None and fixes.heights_from in ("open", "as stated"):
        if fixes.heights_from == "open":
            add_note(fixes.findings, "io.height-level-open", **heights)
        return fixes.place
    if options.datum_height is None:
        # Heights that stay over the sea change gravity by 35 µg at most; over a take-off on a
        # mountain they would change it by more, so that no value is proposed.
        proposed = {"flags": "--gnss-datum-height 0", "keys": "datum_height_m = 0.0"}
        heights |= proposed if fixes.heights_from != "take-off" else {}
        raise DataError(_LEVELS[fixes.heights_from], **heights)
    if fixes.heights_from != NOWHERE:
        code = "io.heights-with-datum" if options.datum_height else "io.heights-stay-over-datum"
        add_note(fixes.findings, code, **heights, datum_height=options.datum_height)
    return np.asarray(fixes.place + np.array([0.0, 0.0, options.datum_height]))


def _sd_of_stated_height(fixes: Fixes, asked: Sd | None, options: GnssOptions, count: int) -> float:
    """Return the standard deviation, m, of one height that is stated for all fixes.

    Together they say of the height what the statement does once, or its error, which is the
    same in each, would average out: the variance is that of the statement times their number.
    """
    sd = STATED_HEIGHT_SD if asked is None or np.ndim(asked) == 0 else float(np.asarray(asked)[2])
    used = sd * float(np.sqrt(count))
    add_warning(
        fixes.findings,
        "io.fixes-with-stated-height",
        file=fixes.name,
        quantity="alt",
        height=options.datum_height,
        sd=sd,
        used=used,
    )
    return used


def first_of(rows: NDArray[np.int64]) -> int | None:
    """Return the first of consecutive rows; None if some between were dropped."""
    return int(rows[0]) if int(rows[-1]) - int(rows[0]) == len(rows) - 1 else None


def _time(fixes: Fixes, options: GnssOptions) -> tuple[Array, NDArray[np.bool_]]:
    """Unwrap stamps across the end of a week; select rows later than all before."""
    time = fixes.time
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size and not options.repair:
        raise DataError(
            "io.fix-stamp-no-number",
            file=fixes.name,
            row=int(fixes.rows[bad[0]]),
            quantity="time",
            count=bad.size,
        )
    keep: NDArray[np.bool_] = np.isfinite(time)
    if fixes.clock.name in (GPS, RELATIVE):
        whole = time.copy()
        whole[keep], weeks = unrolled(time[keep])
        time = np.asarray(whole)
        if weeks:
            row = int(fixes.rows[np.flatnonzero(keep)[weeks[0]]])
            add_note(
                fixes.findings,
                "io.seconds-of-week-unrolled",
                file=fixes.name,
                row=row,
                quantity="time",
            )
    for at, size in options.clock_steps:
        time = np.where(time >= at, time - size, time)
    there = np.where(keep, time, -np.inf)
    before = np.maximum.accumulate(np.concatenate([[-np.inf], there[:-1]]))
    late = np.flatnonzero(keep & (there <= before))
    if late.size and not options.repair:
        k = int(late[0])
        same = there[k] == before[k]
        raise DataError(
            "io.fix-stamp-repeated" if same else "io.fix-stamp-earlier",
            file=fixes.name,
            row=int(fixes.rows[k]),
            quantity="time",
            stamp=time[k],
            before=before[k],
            count=late.size,
        )
    keep = np.asarray(keep & (there > before))
    _say_left_out(fixes, keep, "io.fixes-out-of-time-left-out")
    return time, keep


#: Distance of all other fixes from latitude and longitude 0, from which on it is no place, deg of
#: arc: 100 km.
_FAR = 0.9


def at_zero(place: Array) -> NDArray[np.bool_]:
    """Return the rows, (n,), that a receiver without a fix wrote at latitude and longitude 0.

    `place` ((n, 3)): deg, deg, m. None where another fix is nearer than `_FAR`.
    """
    zero: NDArray[np.bool_] = (place[:, :2] == 0.0).all(axis=1)
    lat, lon = np.radians(place[~zero & np.isfinite(place[:, :2]).all(axis=1), :2]).T
    far = np.degrees(np.arccos(np.cos(lat) * np.cos(lon))) > _FAR
    return zero & bool(far.size and far.all())


def _placed(fixes: Fixes, quality: Array, options: GnssOptions) -> NDArray[np.bool_]:
    """Select the rows with a position; fixes of quality 0 may lack it."""
    zero = at_zero(fixes.place)
    _say_left_out(fixes, ~zero, "io.fixes-at-zero-left-out")
    there = np.asarray(np.isfinite(fixes.place).all(axis=1))
    bad = np.flatnonzero(~there & (quality != 0.0))
    # A row with a stamp alone is of no fix, as where other sensors have rows of their own.
    values = [v for v in (fixes.place, fixes.velocity) if v is not None]
    empty = np.isnan(np.hstack(values)).all(axis=1) & np.isfinite(fixes.time)
    bad = bad if empty.all() else bad[~empty[bad]]
    if bad.size and not options.repair:
        k = int(bad[0])
        which = GEODETIC[int(np.argmin(np.isfinite(fixes.place[k])))]
        raise DataError(
            "io.fix-value-no-number",
            file=fixes.name,
            row=int(fixes.rows[k]),
            quantity=which,
            count=bad.size,
        )
    _say_left_out(fixes, there, "io.fixes-without-position-left-out")
    return there & ~zero


def _say_left_out(fixes: Fixes, keep: NDArray[np.bool_], code: str) -> None:
    out = np.flatnonzero(~keep)
    if out.size:
        add_note(fixes.findings, code, file=fixes.name, row=int(fixes.rows[out[0]]), count=out.size)


def _velocity(fixes: Fixes, asked: Sd | None, count: int) -> tuple[Array, Array]:
    """Return velocity and its standard deviation: infinite where not measured."""
    if fixes.velocity is None:
        return np.zeros((count, 3)), np.full((count, 3), np.inf)
    sd = _sd(fixes, "velocity", asked, count)
    there = np.isfinite(fixes.velocity)
    return np.where(there, fixes.velocity, 0.0), np.where(there, sd, np.inf)


def _by_quality(fixes: Fixes, sd: Array, quality: Array, taken: dict[str, float]) -> Array:
    """Return standard deviations, (n, 3), of fixes whose kinds share one statement.

    A statement is of the kind in the file whose usual standard deviation is nearest, by ratio: 0.02
    is of the fixed solutions even where they are few, and says nothing of the others; 1.5 is of the
    autonomous ones though some be fixed. Fixes of a worse kind have at least their usual one, with
    the ratios of the components as stated; a better kind has no more than is stated. What is taken
    for want of a statement is that of the best kind, so that the same number as a statement gives
    each fix the same.
    """
    usual = np.full(len(sd), np.nan)
    for kind, size in USUAL_POSITION_SD.items():
        usual[quality == kind] = size
    sizes, given = np.unique(usual[np.isfinite(usual)]), float(sd[0, :2].min())
    if not sizes.size or not np.isfinite(given):
        return sd
    stated = given
    if "position_sd_taken" in taken:
        stated = taken["position_sd_taken"] = min(given, float(sizes[0]))
        sd = np.full_like(sd, stated)
    own = sizes[np.argmin(np.abs(np.log(sizes / stated)))]
    worse = usual > own
    sd = np.where(worse[:, None], sd * (usual / stated)[:, None], sd)
    if worse.any() or stated < given:
        kinds = [
            Finding(
                "io.sd-of-quality",
                severity="note",
                count=int(np.count_nonzero(quality == kind)),
                kind=FIX_KINDS[kind],
                quality_code=kind,
                sd=float(sd[quality == kind][0, 0]),
            )
            for kind in FIX_KINDS
            if (quality == kind).any()
        ]
        names = ", ".join(POSITION_SD)
        add_note(fixes.findings, "io.sd-by-quality", file=fixes.name, quantity=names, kinds=kinds)
    return sd


def _without_sd(fixes: Fixes) -> Finding:
    names = ", ".join(POSITION_SD)
    return Finding("io.position-sd-not-stated", severity="error", file=fixes.name, quantity=names)


def _sd(fixes: Fixes, what: str, asked: Sd | None, count: int) -> Array:
    names = POSITION_SD if what == "position" else VELOCITY_SD
    stated = fixes.position_sd if what == "position" else fixes.velocity_sd
    if asked is not None:
        return np.broadcast_to(np.asarray(asked, dtype=np.float64), (count, 3)).copy()
    if stated is None:
        if what == "velocity":
            add_warning(
                fixes.findings,
                "io.velocity-sd-not-stated",
                file=fixes.name,
                quantity=", ".join(VELOCITY),
            )
            return np.full((count, 3), np.inf)
        raise DataError(_without_sd(fixes))
    sd = np.where(np.isnan(stated), np.inf, stated)
    zero = sd == 0.0
    if fixes.zero_is_unknown and zero.any():
        rows = np.flatnonzero(zero.any(axis=1))
        add_warning(
            fixes.findings,
            "io.sd-of-zero-unknown",
            file=fixes.name,
            row=int(fixes.rows[rows[0]]),
            quantity=names[int(np.argmax(zero[rows[0]]))],
            count=rows.size,
            of=what,
        )
        sd = np.where(zero, np.inf, sd)
    bad = np.argwhere(~(sd > 0.0))
    if bad.size:
        k, j = (int(v) for v in bad[0])
        raise DataError(
            "io.sd-not-positive",
            file=fixes.name,
            row=int(fixes.rows[k]),
            quantity=names[j],
            stated=stated[k, j],
            count=len(np.unique(bad[:, 0])),
            of=what,
        )
    return np.asarray(sd)
