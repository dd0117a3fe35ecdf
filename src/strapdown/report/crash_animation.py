"""The vehicle moving along its path in space, and instants of it on paper."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.report.chart import BLACK, BLUE, GREY, VERMILLION
from strapdown.report.crash_body import VehicleBody, vehicle_body
from strapdown.report.crash_outline import Outline
from strapdown.report.crash_stills import crash_stills
from strapdown.report.document import Animation
from strapdown.report.plan_view import nice_step, tick_words
from strapdown.report.plotly_chart import FONT
from strapdown.tables import NED

Array = NDArray[np.float64]

__all__ = ["MOST_FRAMES", "path_animation"]

#: More than these a slider of a page cannot tell apart.
MOST_FRAMES = 120
_FRAME = 60  # ms
_DIGITS = 4  # a tenth of a millimetre
_TICKS = 5
_PAPER = {"showbackground": False, "gridcolor": "#e6e9ed", "zeroline": False}


def path_animation(
    path: CrashPath,
    outline: Outline,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0, 0.0),
    names: tuple[str, str] = ("forward", "right"),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
) -> Animation:
    """Let the vehicle move along its path, as it was turned.

    Parameters
    ----------
    path : CrashPath
    outline : Outline
        In vehicle axes.
    events : sequence of CrashEvent
    point : sequence of float, (3,), m
        The reference point in vehicle axes, whose path it is.
    names : (str, str)
        Of the first two axes of the path.
    reference : DataFrame, optional
        ``north east down`` of the point in the axes of the path, m.
    reference_name : str

    Returns
    -------
    Animation
        At most `MOST_FRAMES` frames, at samples of the path.
    """
    body = vehicle_body(outline)
    rows = np.unique(
        np.linspace(0, len(path.time) - 1, min(MOST_FRAMES, len(path.time))).round().astype(int)
    )
    places = path.table[NED].to_numpy(dtype=np.float64)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    given = None if reference is None else reference[NED].to_numpy(dtype=np.float64)
    ground = body.bottom - float(point[2]) + places[path.anchor, 2]
    low, high = _space([*corners, places, *([] if given is None else [given])], ground)
    still = [
        *_ground(low, high, ground),
        _line(places, "path of the reference point", GREY, 3),
        *([] if given is None else [_line(given, reference_name, VERMILLION, 4, "dash")]),
    ]
    moving = range(len(still), len(still) + 3)
    frames = [
        {
            "name": f"{1e3 * path.time[row]:.1f}",
            "data": [
                _xyz(corners[k]),
                _xyz(_wire(body, corners[k])),
                _xyz(places[rows[: k + 1]]),
            ],
            "traces": list(moving),
        }
        for k, row in enumerate(rows.tolist())
    ]
    first = _moving(body, corners[0], places[rows[:1]])
    slower = 1e-3 * _FRAME * len(rows) / max(float(path.time[-1] - path.time[0]), 1e-3)
    caption = (
        f"The vehicle on its path, seen in space; {names[0]}, {names[1]} and down in m from the "
        "reference point's place at the entry, to one scale on all axes. Orange: the front. Its "
        "length and width are the vehicle's, its height is for the eye alone; the ground is drawn "
        "half a metre below the vehicle's origin at the entry."
    )
    stills = crash_stills(path, body, events=events, point=point, ground=ground)
    layout = _layout((low, high), names, [str(f["name"]) for f in frames])
    return Animation(
        "motion",
        "The motion in space",
        caption,
        {"data": [*still, *first], "layout": layout, "frames": frames},
        stills,
        f"Played {slower:.2g} times slower than it was; drag to look from elsewhere.",
    )


def _space(points: Sequence[Array], ground: float) -> tuple[Array, Array]:
    """Least and greatest north, east, down of everything, and a little room."""
    every = np.vstack(points)
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    low[:2] -= 0.5
    high[:2] += 0.5
    high[2] = max(high[2], ground) + 0.05
    low[2] -= 0.2
    return low, high


def _drawn(points: Array) -> Array:
    """East to the right, north away, up upwards."""
    return points[:, [1, 0, 2]] * [1.0, 1.0, -1.0]


def _xyz(points: Array) -> dict[str, list[float | None]]:
    return {
        axis: [None if math.isnan(v) else round(v, _DIGITS) + 0.0 for v in column]
        for axis, column in zip("xyz", _drawn(points).T.tolist(), strict=True)
    }


def _line(
    points: Array, name: str, colour: str, width: float, dash: str = "solid"
) -> dict[str, Any]:
    keep = np.unique(np.linspace(0, len(points) - 1, min(len(points), 300)).astype(int))
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": html.escape(name),
        **_xyz(points[keep]),
        "line": {"color": colour, "width": width, "dash": dash},
        "hoverinfo": "skip",
    }


def _ground(low: Array, high: Array, down: float) -> list[dict[str, Any]]:
    step = nice_step(float((high - low)[:2].max()) / 16.0)
    rows: list[list[float]] = []
    gap = [math.nan] * 3
    for axis in (0, 1):
        other = 1 - axis
        for k in range(math.ceil(low[axis] / step), math.floor(high[axis] / step) + 1):
            for end in (low[other], high[other]):
                at = [0.0, 0.0, down]
                at[axis], at[other] = k * step, float(end)
                rows.append(at)
            rows.append(gap)
    trace = _line(np.zeros((1, 3)), f"ground, {step:g} m", "#c3cad2", 1)
    return [{**trace, **_xyz(np.array(rows, dtype=np.float64).reshape(-1, 3))}]


def _wire(body: VehicleBody, corners: Array) -> Array:
    """Edges as one broken line."""
    gap = np.full(3, np.nan)
    return np.array([row for a, b in body.edges for row in (corners[a], corners[b], gap)])


def _moving(body: VehicleBody, corners: Array, trace: Array) -> list[dict[str, Any]]:
    triangles, colours = body.triangles
    return [
        {
            "type": "mesh3d",
            "name": "vehicle",
            **_xyz(corners),
            **{key: triangles[:, k].astype(int).tolist() for k, key in enumerate("ijk")},
            "facecolor": list(colours),
            "flatshading": True,
            "lighting": {"ambient": 0.8, "diffuse": 0.4, "specular": 0.05},
            "hoverinfo": "skip",
            "showscale": False,
        },
        {
            "type": "scatter3d",
            "mode": "lines",
            "name": "edges",
            **_xyz(_wire(body, corners)),
            "line": {"color": BLACK, "width": 1.5},
            "hoverinfo": "skip",
            "showlegend": False,
        },
        {
            "type": "scatter3d",
            "mode": "lines",
            "name": "up to now",
            **_xyz(trace),
            "line": {"color": BLUE, "width": 7},
            "hoverinfo": "skip",
        },
    ]


def _axis(
    name: str, low: float, high: float, ticks: int = _TICKS, upside_down: bool = False
) -> dict[str, Any]:
    axis: dict[str, Any] = {"title": {"text": f"{name}, m"}, "range": [low, high], **_PAPER}
    step = nice_step((high - low) / ticks)
    values = [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
    words = [tick_words(-v if upside_down else v, step) for v in values]
    return axis | {"tickvals": [round(v, 6) for v in values], "ticktext": words}


def _layout(
    space: tuple[Array, Array], names: tuple[str, str], frames: Sequence[str]
) -> dict[str, Any]:
    low, high = space
    size = (high - low)[[1, 0, 2]]
    # The longest side fills the scene; a long path is not made smaller than it can be seen.
    share = size / float(np.sqrt((size**2).sum())) * 2.1
    steps = [
        {
            "label": f"{float(name):.0f} ms".replace("-", "−"),
            "method": "animate",
            "args": [
                [name],
                {
                    "mode": "immediate",
                    "frame": {"duration": 0, "redraw": True},
                    "transition": {"duration": 0},
                },
            ],
        }
        for name in frames
    ]
    play = {
        "frame": {"duration": _FRAME, "redraw": True},
        "fromcurrent": True,
        "transition": {"duration": 0},
    }
    stop = {"mode": "immediate", "frame": {"duration": 0, "redraw": False}}
    return {
        "font": FONT,
        "paper_bgcolor": "#ffffff",
        "height": 560,
        "margin": {"l": 0, "r": 0, "t": 10, "b": 10},
        "legend": {"orientation": "h", "y": 1.0, "x": 0},
        "scene": {
            "domain": {"x": [0, 1], "y": [0.1, 1]},
            "xaxis": _axis(names[1], float(low[1]), float(high[1])),
            "yaxis": _axis(names[0], float(low[0]), float(high[0])),
            "zaxis": _axis("down", -float(high[2]), -float(low[2]), 2, upside_down=True),
            "aspectmode": "manual",
            "aspectratio": {k: round(v, 4) for k, v in zip("xyz", share.tolist(), strict=True)},
            "camera": {
                "eye": {"x": 1.15, "y": 0.65, "z": 0.75},
                "center": {"x": 0.0, "y": 0.0, "z": -0.1},
                "projection": {"type": "orthographic"},
            },
        },
        "updatemenus": [
            {
                "type": "buttons",
                "direction": "left",
                "x": 0.02,
                "y": 0.02,
                "xanchor": "left",
                "yanchor": "bottom",
                "pad": {"t": 0, "r": 8},
                "buttons": [
                    {"label": "Play", "method": "animate", "args": [None, play]},
                    {"label": "Pause", "method": "animate", "args": [[None], stop]},
                ],
            }
        ],
        "sliders": [
            {
                "x": 0.22,
                "len": 0.76,
                "y": 0.02,
                "yanchor": "bottom",
                "pad": {"t": 0, "b": 0},
                "currentvalue": {
                    "prefix": "time from the trigger: ",
                    "xanchor": "left",
                    "font": {"size": 13, "color": BLACK},
                },
                "ticklen": 3,
                "font": {"size": 10, "color": "rgba(0,0,0,0)"},
                "steps": steps,
            }
        ],
    }
