"""The tables of a crash report."""

from __future__ import annotations

import math

import numpy as np

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.pdof import Pdof
from strapdown.crash.pdof_interval import AngleInterval
from strapdown.crash.velocity_change import VelocityChange
from strapdown.report.crash_values import (
    KMH,
    about,
    axis_names,
    instant,
    over_ground,
    plain,
    recorder,
)
from strapdown.report.document import TableBlock
from strapdown.rotation import within_half_turn
from strapdown.systems.case_severity import main_event
from strapdown.systems.crash_case import CaseResult
from strapdown.tables import NED

__all__ = ["answers_table", "budget_table", "direction_table", "path_table"]
ANGLES = ("roll, deg", "pitch, deg", "heading, deg")
OVER_GROUND = "Axes: over ground."
FROM_THE_ENTRY = (
    "Axes: forward and right as the vehicle stood at the entry; the heading counts from there."
)


def answers_table(result: CaseResult) -> TableBlock:
    """Changes of velocity of every event, by every recorder."""
    rows: list[tuple[str, ...]] = []
    strong = []
    for unit in result.reconstruction.answers:
        for k, (changes, kind) in enumerate(zip(unit.body, unit.types, strict=True)):
            event, whole = unit.events.events[k], changes.event
            if unit is result.reconstruction.main and k == main_event(unit):
                strong.append(len(rows))
            rows.append(
                (
                    recorder(unit, result),
                    f"{k + 1}, {kind.name}",
                    f"{plain(event.time_zero, 4)} to {plain(event.end, 4)}",
                    *(
                        about(KMH * v, KMH * h, "")
                        for v, h in zip(
                            whole.delta_v.vector.tolist(), whole.bound.half_width, strict=True
                        )
                    ),
                    about(KMH * whole.resultant, KMH * whole.resultant_bound, ""),
                    about(KMH * changes.peak.resultant, KMH * changes.peak.resultant_bound, ""),
                )
            )
    ms = 1e3 * result.spec.options.peak_window_s
    return TableBlock(
        (
            "recorder",
            "event",
            "from, to, s",
            "forward, km/h",
            "right, km/h",
            "down, km/h",
            "resultant, km/h",
            f"largest in {ms:.3g} ms, km/h",
        ),
        tuple(rows),
        text=(0, 1, 2),
        caption="Change of velocity along the turning axes of the vehicle, at the "
        f"{result.spec.point.name}; bounds hold 95 %. What changed: a frontal crash has a "
        "negative forward part.",
        strong=tuple(strong),
    )


def direction_table(result: CaseResult) -> TableBlock:
    """Directions of force by window, along the axes of the vehicle and of the path."""
    rows: list[tuple[str, ...]] = []
    ground = over_ground(result)
    for unit in result.reconstruction.answers:
        for k, (body, ned) in enumerate(zip(unit.body, unit.ned, strict=True)):
            for window in ("event", "peak"):
                change: VelocityChange = getattr(body, window)
                angle, across = change.pdof, change.interval.horizontal
                assert isinstance(angle, Pdof)
                known = not across.undetermined
                path = ("–", "–")
                if ned is not None:
                    path = _over_ground(getattr(ned, window), ground)
                rows.append(
                    (
                        recorder(unit, result),
                        str(k + 1),
                        "event" if window == "event" else "largest",
                        f"{plain(angle.horizontal_deg, 1)}°" if known else "not determined",
                        _ends(across) if known else "all",
                        str(angle.clock) if known else "–",
                        f"{plain(angle.vertical_deg, 1)}°" if known else "–",
                        *path,
                    )
                )
    axes = "over ground, azimuth" if ground else "against the entry"
    told = (
        "the same over ground, from north"
        if ground
        else "the same in axes that do not turn with it, from where it pointed at the entry"
    )
    ms = 1e3 * result.spec.options.peak_window_s
    return TableBlock(
        (
            *("recorder", "event", "window", "horizontal", "95 %", "o'clock", "vertical"),
            *(axes, "95 %"),
        ),
        tuple(rows),
        text=(0, 1, 2),
        caption="Where the force came from, over the event and over the "
        f"{ms:.3g} ms of the largest change. Horizontal: from the front of the vehicle clockwise, "
        f"seen from above; vertical: positive from above; {axes}: {told}.",
    )


def _over_ground(change: VelocityChange, azimuth: bool) -> tuple[str, str]:
    """Direction and its interval: an azimuth, or an angle from the entry's heading."""
    angle, across = change.pdof, change.interval.horizontal
    if across.undetermined:
        return "not determined", "all"
    at = math.remainder(getattr(angle, "azimuth_deg", math.nan), 360.0)
    at += 360.0 * (azimuth and at < 0.0)
    shift = 360.0 * round((at - 0.5 * (across.low_deg + across.high_deg)) / 360.0)
    return f"{plain(at, 1)}°", _ends(across, shift)


def _ends(interval: AngleInterval, shift: float = 0.0) -> str:
    low, high = interval.low_deg + shift, interval.high_deg + shift
    return f"{plain(low, 1)}° to {plain(high, 1)}°"


def path_table(result: CaseResult) -> TableBlock:
    """Places at the end of the path, by every recorder."""
    rows = []
    for unit in result.reconstruction.answers:
        table, sd = unit.path.table.iloc[-1].copy(), unit.path.sd.iloc[-1]
        if not over_ground(result):
            # As the charts: from where it pointed, and not round the compass.
            table["heading"] = float(within_half_turn(table["heading"]))
        rows.append(
            (
                recorder(unit, result),
                instant(unit.path.time[-1]),
                *(about(float(table[a]), TWO_SIDED_95 * float(sd[a]), "") for a in NED),
                *(
                    about(float(table[a]), TWO_SIDED_95 * float(sd[a]), "")
                    for a in ("roll", "pitch", "heading")
                ),
            )
        )
    return TableBlock(
        ("recorder", "at", *(f"{name}, m" for name in axis_names(result)), *ANGLES),
        tuple(rows),
        text=(0,),
        caption="Place of the reference point from that at the entry, and attitude; bounds hold "
        "95 %. " + (OVER_GROUND if over_ground(result) else FROM_THE_ENTRY),
    )


def budget_table(result: CaseResult) -> TableBlock | None:
    """Return what makes the bounds: one standard deviation of each contributor."""
    unit = result.reconstruction.main
    ends = unit.path.variances()[NED]
    number = main_event(unit)
    names = list(ends.index)
    changes = None if number is None else unit.body[number].event.bound.by_contributor
    if changes is not None:
        names += [n for n in changes.index if n not in names]
    rows: list[tuple[float, tuple[str, ...]]] = []
    sums = np.zeros(5)
    for name in names:
        squares = np.zeros(5)
        if changes is not None and name in changes.index:
            squares[0], squares[1] = (float(changes.loc[name, c]) for c in ("xx", "yy"))
        if name in ends.index:
            squares[2:] = ends.loc[name].to_numpy(dtype=np.float64)
        sums += squares
        sizes = np.sqrt(squares)
        rows.append((float(squares.sum()), (name, *_sizes(sizes))))
    rows.sort(key=lambda r: -r[0])
    lines = tuple(cells for _, cells in rows)
    return TableBlock(
        (
            "contributor",
            "delta-V forward, km/h",
            "delta-V right, km/h",
            *(f"{name} at the end, m" for name in axis_names(result)),
        ),
        (*lines, ("all together", *_sizes(np.sqrt(sums)))),
        caption=f"{recorder(unit, result)}: one standard deviation; their squares add "
        "up to that of the last line. The 95 % bounds are 1.96 times it.",
        strong=(len(lines),),
    )


def _sizes(sizes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[str, ...]:
    scaled = sizes * np.array([KMH, KMH, 1.0, 1.0, 1.0])
    return tuple("–" if s < 5e-4 else plain(float(s), 3) for s in scaled)
