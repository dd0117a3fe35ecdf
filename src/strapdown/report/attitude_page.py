"""The attitude bench as one offline page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import __version__, rotation
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.errors import Finding
from strapdown.evaluation.differences import attitude_at
from strapdown.report import attitude_tables as tables
from strapdown.report import attitude_words as words
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_numbers import chosen_run
from strapdown.report.attitude_tables import offer_lines, place_table
from strapdown.report.chart import AXIS_COLOURS, BLACK, GREY, Chart
from strapdown.report.document_html import embedded, render
from strapdown.report.plotly_chart import FONT, figure

__all__ = ["MOST_FRAMES", "attitude_page", "body_caption", "body_figure"]


# Section of the page for each chart.
_PLACES = {
    "answer": ("cost", "sweep"),
    "log": ("gyro", "attitude"),
    "error": ("error", "reference-error", "difference"),
    "share": ("share",),
    "trials": ("trials",),
    "peers": ("peers",),
}


def attitude_page(bench: AttitudeComparison, drawn: Sequence[Chart] | None = None) -> str:
    """Return a bench as one offline HTML page.

    Parameters
    ----------
    bench : AttitudeComparison
    drawn : sequence of Chart, optional
        Its charts, if already made.

    Returns
    -------
    str
    """
    shown = {c.slug: _chart(c) for c in (charts(bench) if drawn is None else drawn)}
    body = body_figure(bench)
    return render(
        "attitude.html",
        {
            "title": bench.source,
            "answer": bench.answer,
            "standing": words.standing(bench),
            "charts": {
                place: [shown[slug] for slug in slugs if slug in shown]
                for place, slugs in _PLACES.items()
            },
            "body": {
                "json": embedded(body),
                "height": body["layout"]["height"],
                "caption": body_caption(bench),
            },
            "results": tables.result_tables(bench),
            "sweeps": tables.sweep_tables(bench),
            "cost": tables.cost_table(bench),
            "conditions": tables.condition_table(bench),
            "trials": tables.trial_table(bench),
            "peers": tables.peer_table(bench),
            "references": words.reference_lines(bench),
            "places": place_table(bench),
            "offers": offer_lines(bench),
            "hint": "" if bench.scores else words.HOW_TO_REFERENCE,
            "findings": _findings(bench.findings),
            "differences": tables.difference_table(bench),
            "facts": words.facts(bench),
            "readings": bench.readings,
            "first_value": words.first_value,
            "conventions": words.CONVENTIONS,
            "version": __version__,
        },
    )


def _chart(chart: Chart) -> dict[str, Any]:
    data = figure(chart)
    return {
        "slug": chart.slug,
        "title": chart.title,
        "caption": chart.caption,
        "height": data["layout"]["height"],
        "json": embedded(data),
    }


def _findings(findings: Iterable[Finding]) -> list[dict[str, str | None]]:
    return [
        {
            "place": ", ".join(
                str(part)
                for part in (f.file, f"row {f.row}" if f.row else None, f.quantity)
                if part
            ),
            "what": f.what,
            "remedy": f.remedy,
        }
        for f in findings
    ]


# Animation of the body: a box with its axes in the north-east-down frame, over time.


Array = NDArray[np.float64]

#: A slider on a page cannot resolve more frames.
MOST_FRAMES = 300
_AS_IT_WAS = 30_000.0  # ms: a longer log is played faster
_SHORTEST = 33.0  # ms a frame: the shortest that a browser can draw in 3D
# Half dimensions of a phone, in drawing units; forward along its long side.
_HALF = np.array([0.72, 0.38, 0.07])
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * _HALF
# Two triangles per face, corners numbered as above: down, up, left, right, aft, fore.
_TRIANGLES = np.array(
    [
        *([1, 3, 5], [3, 7, 5]),
        *([0, 4, 2], [2, 4, 6]),
        *([0, 1, 4], [1, 5, 4]),
        *([2, 6, 3], [3, 6, 7]),
        *([0, 2, 1], [1, 2, 3]),
        *([4, 5, 6], [5, 7, 6]),
    ]
)
# The upper face with the screen, and the front, have their own colors to show the orientation.
_FACES = ("#9fb3c8", "#9fb3c8", "#3d5166", "#3d5166", *(("#c5d2de",) * 6), "#D55E00", "#D55E00")
_EDGES = [(0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 6)]
_EDGES += [(5, 7), (6, 7)]
_AXIS_NAMES = ("x forward", "y right", "z down")


def body_figure(bench: AttitudeComparison) -> dict[str, Any]:
    """Return the animated body for ``Plotly.newPlot``, with its frames.

    Parameters
    ----------
    bench : AttitudeComparison

    Returns
    -------
    dict
        ``data``, ``layout`` and ``frames``. The first pose is visible before playback. The box
        follows the chosen algorithm (`attitude_numbers.chosen_run`), the wireframe the truth, where
        it is known.
    """
    attitude = chosen_run(bench).attitude
    time = _instants(attitude)
    q = attitude_at(attitude, time)
    ghost = _ghost(bench, time)
    first = _moving(q[0], None if ghost is None else ghost[0])
    frames = []
    for k, at in enumerate(time):
        moved = _moving(q[k], None if ghost is None else ghost[k])
        frames.append(
            {
                "name": f"{at:.3f}",
                "data": [{axis: part[axis] for axis in "xyz"} for part in moved],
                "traces": list(range(len(moved))),
            }
        )
    return {"data": [*first, *_still()], "layout": _layout(time), "frames": frames}


def body_caption(bench: AttitudeComparison) -> str:
    """Caption of the animation, with its playback speed."""
    run = chosen_run(bench)
    time = _instants(run.attitude)
    text = (
        f"The attitude that {run.algorithm} says: dark the upper side, orange the front. "
        "Drag to look from elsewhere."
    )
    if bench.truth is not None:
        text += " Wireframe: the truth, where it is known."
    span = float(time[-1] - time[0])
    faster = 1000.0 * span / (_frame_length(time) * (len(time) - 1))
    if faster > 1.05:
        text += (
            f" Played {faster:.3g} times as fast as it was, "
            f"one pose every {time[1] - time[0]:.3g} s."
        )
    return text


def _instants(attitude: pd.DataFrame) -> Array:
    """Equally spaced instants, at most as many as there are samples."""
    start, end = float(attitude.index[0]), float(attitude.index[-1])
    return np.linspace(start, end, min(MOST_FRAMES, max(2, len(attitude))))


def _frame_length(time: Array) -> float:
    """Frame length in ms: real time for a short log, else the fastest drawable."""
    real = 1000.0 * float(time[-1] - time[0]) / (len(time) - 1)
    return max(real, _SHORTEST) if real * (len(time) - 1) <= _AS_IT_WAS else _SHORTEST


def _ghost(bench: AttitudeComparison, time: Array) -> Array | None:
    """True attitude at the frames; NaN where it is not known."""
    if bench.truth is None or not len(bench.truth):
        return None
    stamps = bench.truth.index.to_numpy(dtype=np.float64)
    q = attitude_at(bench.truth, time)
    q[(time < stamps[0]) | (time > stamps[-1])] = np.nan
    return q


def _turned(q_nb: Array, points_b: Array) -> Array:
    """Points of the body in the drawing frame: x east, y north, z up."""
    if np.isnan(q_nb).any():
        return np.full(points_b.shape, np.nan)
    north, east, down = rotation.rotate(q_nb, points_b).T
    return np.column_stack([east, north, -down])


def _coordinates(points: Array) -> dict[str, list[float | None]]:
    return {
        axis: [None if np.isnan(v) else round(v, 3) + 0.0 for v in points[:, k].tolist()]
        for k, axis in enumerate("xyz")
    }


def _moving(q: Array, ghost: Array | None) -> list[dict[str, Any]]:
    """Traces that rotate: the box, its axes, and the wireframe of the truth."""
    parts: list[dict[str, Any]] = [
        {
            "type": "mesh3d",
            **_coordinates(_turned(q, _CORNERS)),
            **{key: _TRIANGLES[:, k].tolist() for k, key in enumerate("ijk")},
            "facecolor": list(_FACES),
            "flatshading": True,
            "lighting": {"ambient": 0.75, "diffuse": 0.5, "specular": 0.05},
            "hoverinfo": "skip",
            "showscale": False,
        }
    ]
    for k, (name, colour) in enumerate(zip(_AXIS_NAMES, AXIS_COLOURS, strict=True)):
        tip = np.zeros((2, 3))
        tip[1, k] = 1.0
        parts.append(
            {
                "type": "scatter3d",
                "mode": "lines+text",
                "name": name,
                **_coordinates(_turned(q, tip)),
                "text": ["", name],
                "textfont": {"color": colour, "size": 13},
                "line": {"color": colour, "width": 7},
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    if ghost is not None:
        parts.append(
            {
                "type": "scatter3d",
                "mode": "lines",
                "name": "truth",
                **_coordinates(_wire(_turned(ghost, _CORNERS))),
                "line": {"color": BLACK, "width": 3, "dash": "dot"},
                "hoverinfo": "skip",
                "showlegend": True,
            }
        )
    return parts


def _wire(corners: Array) -> Array:
    """Edges of the box as one broken line."""
    gap = np.full(3, np.nan)
    return np.array([point for a, b in _EDGES for point in (corners[a], corners[b], gap)])


def _still() -> list[dict[str, Any]]:
    """Axes of the local level."""
    traces = []
    for name, end in (("north", (0, 1.3, 0)), ("east", (1.3, 0, 0)), ("down", (0, 0, -1.2))):
        traces.append(
            {
                "type": "scatter3d",
                "mode": "lines+text",
                "name": name,
                **{axis: [0.0, float(v)] for axis, v in zip("xyz", end, strict=True)},
                "text": ["", name],
                "textfont": {"color": GREY, "size": 12},
                "line": {"color": GREY, "width": 2, "dash": "dash"},
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    return traces


def _layout(time: Array) -> dict[str, Any]:
    empty = {"visible": False, "range": [-1.3, 1.3], "autorange": False}
    at_once = {"mode": "immediate", "transition": {"duration": 0}}
    length = round(_frame_length(time), 1)
    return {
        "font": FONT,
        "paper_bgcolor": "#ffffff",
        "height": 520,
        "margin": {"l": 0, "r": 0, "t": 10, "b": 0},
        "legend": {"x": 0.01, "y": 0.98},
        "scene": {
            **{f"{axis}axis": empty for axis in "xyz"},
            "aspectmode": "cube",
            # View from the south-east and above: north points away, east to the right.
            "camera": {"eye": {"x": 0.42, "y": -0.84, "z": 0.5}},
            "dragmode": "orbit",
        },
        "updatemenus": [
            {
                "type": "buttons",
                "direction": "left",
                "showactive": False,
                "x": 0.02,
                "xanchor": "left",
                "y": 0.0,
                "yanchor": "top",
                "pad": {"t": 38},
                "buttons": [
                    {
                        "label": "Play",
                        "method": "animate",
                        "args": [
                            None,
                            {
                                "frame": {"duration": length, "redraw": True},
                                "fromcurrent": True,
                                "transition": {"duration": 0},
                            },
                        ],
                    },
                    {
                        "label": "Pause",
                        "method": "animate",
                        "args": [[None], {"frame": {"duration": 0, "redraw": True}} | at_once],
                    },
                ],
            }
        ],
        "sliders": [
            {
                "x": 0.17,
                "len": 0.8,
                "y": 0.0,
                "pad": {"t": 24, "b": 12},
                "tickcolor": "#ffffff",
                "font": {"color": "#ffffff", "size": 1},
                "currentvalue": {
                    "prefix": "time ",
                    "suffix": " s",
                    "font": {"size": 13, "color": FONT["color"]},
                },
                "steps": [
                    {
                        "label": f"{at:.3f}",
                        "method": "animate",
                        "args": [
                            [f"{at:.3f}"],
                            {"frame": {"duration": 0, "redraw": True}} | at_once,
                        ],
                    }
                    for at in time
                ],
            }
        ],
    }
