"""The figures of a reproduction as charts: names decide colours, so that pages look alike."""

from __future__ import annotations

from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Chart,
    Line,
    Mark,
    Panel,
    curve,
)
from strapdown.systems.reproduction import Figure, Trace

# As on the page of the bench.
ALGORITHM_COLOURS = {"naive": ORANGE, "euler": VERMILLION, "dcm": GREEN, "quaternion": BLUE}
# Colour, dash and symbol of what a crash is recorded with: told apart without colours, too.
RECORDERS = {
    "LAB1": (BLUE, "solid", "circle"),
    "LAB2": (SKY, "dash", "square"),
    "IMU1": (VERMILLION, "solid", "diamond"),
    "IMU2": (ORANGE, "dash", "triangle-up"),
    "LAB": (BLUE, "solid", "circle"),
    "IMU low-g": (ORANGE, "dash", "square"),
    "IMU high-g": (VERMILLION, "dashdot", "diamond"),
    "5 g": (SKY, "dash", "circle"),
    "10 g": (VERMILLION, "solid", "square"),
}
_AXES = dict(zip("xyz", AXIS_COLOURS, strict=True))
_OTHERS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION)


def chart(figure: Figure) -> Chart:
    """Return a figure as a chart, thinned to what a screen can show.

    Parameters
    ----------
    figure : Figure

    Returns
    -------
    Chart
        The first curve of an algorithm has the colour of that algorithm, its further ones
        others of the palette; references are dotted. Recorders of a crash have a dash and a
        symbol of their own.
    """
    colours: dict[str, tuple[str, str]] = {}
    for panel in figure.panels:
        for trace in panel.traces:
            if trace.name not in colours:
                colours[trace.name] = _style(trace, colours)
    return Chart(
        figure.slug,
        figure.title,
        figure.caption,
        figure.x_label,
        tuple(
            Panel(p.y_label, tuple(_line(t, *colours[t.name]) for t in p.traces), p.log)
            for p in figure.panels
        ),
        tuple(Mark(x, label) for x, label in figure.marks),
        log_x=figure.x_log,
    )


def _style(trace: Trace, taken: dict[str, tuple[str, str]]) -> tuple[str, str]:
    """Colour and dash of a new name."""
    # Axes of a gyro have a panel of their own and take no colour from the algorithms.
    used = [colour for name, (colour, _) in taken.items() if not name.startswith("gyro ")]
    if trace.reference:
        count = sum(dash == "dot" for _, dash in taken.values())
        return (BLACK, GREY)[count % 2], "dot"
    recorder = RECORDERS.get(trace.name.split(",")[0])
    if recorder is not None:
        return recorder[:2]
    if trace.name.startswith("gyro ") and trace.name[-1] in _AXES:
        return _AXES[trace.name[-1]], "solid"
    own = ALGORITHM_COLOURS.get(trace.name.replace(",", " ").replace(":", " ").split()[0])
    if own is not None and own not in used:
        return own, "solid"
    free = [c for c in _OTHERS if c not in used]
    return (free[0], "solid") if free else (_OTHERS[len(used) % len(_OTHERS)], "dash")


def _line(trace: Trace, colour: str, dash: str) -> Line:
    if trace.points:
        symbol = RECORDERS.get(trace.name.split(",")[0], ("", "", "diamond"))[2]
        return Line(trace.name, trace.x, trace.y, colour, points=True, symbol=symbol)
    return curve(trace.name, trace.x, trace.y, colour, dash, 1.2 if trace.reference else 1.6)
