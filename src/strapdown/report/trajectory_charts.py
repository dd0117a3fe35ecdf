"""The chart of a trajectory: its path as a plan, and height, speed and attitude over time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.formats.trajectory_thinning import thin
from strapdown.frames import ned_from_geodetic
from strapdown.report.chart import BLUE, ORANGE, Array, Chart, Line, Panel, break_jumps, curve
from strapdown.report.path_marks import View, path_marks
from strapdown.tables import EULER, places_of

__all__ = ["trajectory_chart"]

# As many points of a plan, and buckets of a curve over time, as a picture of 900 pixels shows.
MOST_POINTS, BUCKETS = 1500, 700
# What moves less has no path, m; what changes less is drawn as constant: m, m/s, deg.
NO_PATH = 1e-3
_STEADY = 1e-3
# From here on a plan is in kilometres.
_FAR = 20e3
_LOW = 0.6  # height of a panel over time


@dataclass(frozen=True)
class _Drawn:
    """One trajectory, its thinned path in metres about the start, and how it is drawn."""

    table: pd.DataFrame
    time: Array
    east: Array
    north: Array
    left_out: str
    name: str
    colour: str
    dash: str
    legend: bool

    def column(self, name: str) -> Array:
        return self.table[name].to_numpy(dtype=np.float64)


def trajectory_chart(
    trajectory: pd.DataFrame,
    other: pd.DataFrame | None = None,
    *,
    title: str,
    names: tuple[str, str] = ("trajectory", "other"),
    ellipsoid: Ellipsoid = WGS84,
    slug: str = "trajectory",
) -> Chart:
    """Chart a trajectory: where it went, and height, speed and attitude over time.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table. The plan is about its first place.
    other : DataFrame, optional
        A second one on the same clock, a reference or an estimate, drawn over the first.
    title : str
    names : (str, str)
        Of the two, for the legend; there is none for one alone.
    ellipsoid : Ellipsoid
    slug : str
        Name of the file.

    Returns
    -------
    Chart
        Without the plan where nothing moves by 1 mm over the ground, and then without height and
        speed, too, unless the height changes by that. The plan is the projection along the
        vertical of the start onto its level plane, in which a straight path is straight: 0.1 % of
        a distance is lost 490 km away.

    Raises
    ------
    DataError
        A place cannot be, as `frames.ned_from_geodetic`.
    """
    origin = places_of(trajectory.iloc[:1])[0]
    drawn = [_drawn(trajectory, origin, ellipsoid, names[0], other is not None)]
    if other is not None:
        second = _drawn(other, origin, ellipsoid, names[1], True)
        drawn.append(replace(second, colour=ORANGE, dash="dash"))
    reach = max(float(np.ptp(v)) for d in drawn for v in (d.east, d.north))
    rise = float(np.ptp(np.concatenate([d.column("alt") for d in drawn])))
    at = f"{origin[0]:.6g}°, {origin[1]:.6g}°, {origin[2]:.6g} m"
    panels: list[Panel] = []
    if reach >= NO_PATH:
        panels.append(_plan(drawn, reach))
        words = [
            f"Plan: in the level plane at the start ({at}), to one scale; arrows: direction of "
            "motion."
        ]
    else:
        words = [f"It stays at its place ({at})."]
    if reach >= NO_PATH or rise >= NO_PATH:
        speeds = [np.hypot(d.column("VN"), d.column("VE")) for d in drawn]
        panels += [
            _over_time("height, m", drawn, [d.column("alt") for d in drawn]),
            _over_time("speed, m/s", drawn, speeds),
        ]
        words.append(f"Height over the ellipsoid ({ellipsoid.name}); speed over the ground.")
    angles = {name: [d.column(name) for d in drawn] for name in EULER}
    angles["heading"], wrapped = _wrapped(angles["heading"])
    panels += [_over_time(f"{k}, deg", drawn, v) for k, v in angles.items()]
    words.append(
        "Body forward-right-down relative to north-east-down, 3-2-1 angles; heading "
        f"{wrapped}, clockwise from north."
    )
    if reach >= NO_PATH:
        words += [d.left_out for d in drawn if d.left_out]
    return Chart(slug, title, " ".join(words), "time, s", tuple(panels))


def _drawn(
    table: pd.DataFrame, origin: Array, ellipsoid: Ellipsoid, name: str, legend: bool
) -> _Drawn:
    thinned = thin(table, MOST_POINTS, ellipsoid)
    kept = table.iloc[thinned.rows]
    ned = ned_from_geodetic(places_of(kept), origin, ellipsoid=ellipsoid)
    left_out = ""
    if len(kept) < len(table):
        left_out = f"Plan{f', {name}' if legend else ''}: {thinned.sentence}"
    time = kept.index.to_numpy(dtype=np.float64)
    return _Drawn(table, time, ned[:, 1], ned[:, 0], left_out, name, BLUE, "solid", legend)


def _plan(drawn: list[_Drawn], reach: float) -> Panel:
    """The paths, with the start, the end, the direction and the times of the first."""
    unit, scale = ("km", 1e-3) if reach >= _FAR else ("m", 1.0)
    paths = [(scale * d.east, scale * d.north) for d in drawn]
    view = View.of(paths)
    lines = [
        Line(d.name, *path, d.colour, d.dash, 1.8, legend=d.legend)
        for d, path in zip(drawn, paths, strict=True)
    ]
    lines += path_marks(drawn[0].time, paths, view, drawn[0].colour)
    return Panel(
        f"north of the start, {unit}",
        tuple(lines),
        x_label=f"east of the start, {unit}",
        height=view.height,
    )


def _over_time(label: str, drawn: list[_Drawn], values: list[Array]) -> Panel:
    lines = tuple(
        replace(
            curve(d.name, d.table.index.to_numpy(np.float64), v, d.colour, d.dash, buckets=BUCKETS),
            legend=d.legend,
        )
        for d, v in zip(drawn, values, strict=True)
    )
    return Panel(label, lines, height=_LOW, steady=_STEADY)


def _wrapped(headings: list[Array]) -> tuple[list[Array], str]:
    """Headings within the full turn, from north or from south, that breaks them least."""
    ranges = (
        ("0 to 360°", [h % 360.0 for h in headings]),
        ("−180 to 180°", [(h + 180.0) % 360.0 - 180.0 for h in headings]),
    )
    broken = [(words, [break_jumps(h) for h in found]) for words, found in ranges]
    words, best = min(broken, key=lambda one: sum(int(np.isnan(h).sum()) for h in one[1]))
    return best, words
