"""Tables of event data recorders in layouts made after 49 CFR 563, from known pulses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

KMH = 1.0 / 3.6
MPH = 0.44704
G = 9.80665
FACTORS = {"km/h": KMH, "mph": MPH, "ft/s": 0.3048, "m/s": 1.0}
SPELLED = {"km/h": "km/h", "mph": "MPH", "ft/s": "ft/s", "m/s": "m/s"}


@dataclass(frozen=True)
class Pulse:
    """Haversine pulse: change of velocity, m/s, forward and right, over `length`, s."""

    forward: float = -44.3 * KMH
    right: float = 7.4 * KMH
    length: float = 0.095
    start: float = 0.0

    def change(self, time):
        s = np.clip((np.asarray(time) - self.start) / self.length, 0.0, 1.0)
        shape = s - np.sin(2.0 * np.pi * s) / (2.0 * np.pi)
        return np.outer(shape, [self.forward, self.right])

    def acceleration(self, time):
        s = np.asarray(time) / self.length
        shape = np.where((s >= 0.0) & (s <= 1.0), 1.0 - np.cos(2.0 * np.pi * s), 0.0)
        return np.outer(shape / self.length, [self.forward, self.right])


@dataclass(frozen=True)
class Layout:
    """How an export writes a recorder. Lengths in s, `decimals` of delta-V in its unit."""

    units: tuple[str, ...] = ("km/h",)
    decimals: int = 0
    step: float = 0.01
    first: float = 0.0
    end: float = 0.25
    milliseconds: bool = True
    separator: str = ","
    comma: bool = False
    bracket: str = "({})"
    preamble: bool = True
    before: str = "above"  # above, below, none, in one table
    rate: float = 2.0
    lateral: bool = True
    acceleration: bool = False
    acceleration_only: bool = False
    both_in_cell: bool = False
    units_row: bool = False
    brake: str = "On/Off"
    order: str = "forward"  # forward, backward
    pulses: tuple[Pulse, ...] = (Pulse(),)
    speeds: tuple[float, ...] = (68.0,)
    complete: bool = True
    events: str = "title"  # title, column, none
    left_positive: bool = False
    names: dict[str, str] = field(default_factory=dict)


def _number(value, decimals, layout):
    text = f"{value:.{decimals}f}"
    return text.replace(".", ",") if layout.comma else text


def _row(cells, layout):
    return layout.separator.join(f'"{c}"' if layout.separator in c else c for c in cells)


def _before(layout, speed, number):
    """Rows before the crash: steady, then braked in the last second at 4 m/s²."""
    time = np.round(np.arange(-5.0, 1e-9, 1.0 / layout.rate), 6)
    heads = ["Time (sec)"]
    columns = [[_number(t, 2, layout) for t in time]]
    braked = time > -1.0
    value = speed + np.where(braked, -4.0 / KMH * time, 4.0 / KMH)
    for unit in layout.units:
        shown = value * KMH / FACTORS[unit]
        heads.append(f"Speed, Vehicle Indicated {layout.bracket.format(SPELLED[unit])}")
        columns.append([_number(v, 0, layout) for v in shown])
    heads += ["Accelerator Pedal, % full", "Service Brake, on/off", "Engine RPM", "ABS Activity"]
    heads += ["Steering Wheel Angle (deg)", "Stability Control"]
    on, off = layout.brake.split("/")
    columns += [
        [_number(0.0 if b else 23.0, 0, layout) for b in braked],
        [on if b else off for b in braked],
        [_number(2100.0 + 10.0 * t, 0, layout) for t in time],
        ["Off"] * len(time),
        [_number(-5.0 * t, 0, layout) for t in time],
        ["On"] * len(time),
    ]
    rows = list(zip(*columns, strict=True))
    return heads, rows if layout.order == "forward" else rows[::-1]


def _crash(layout, pulse):
    count = round((layout.end - layout.first) / layout.step)
    time = layout.first + np.arange(count + 1) * layout.step
    scale, name = (1e3, "Time (msec)") if layout.milliseconds else (1.0, "Time (sec)")
    heads, columns = [name], [[_number(t * scale, 0 if scale > 1 else 3, layout) for t in time]]
    axes = [("longitudinal", 0, 1.0)]
    if layout.lateral:
        axes.append(("lateral, left positive" if layout.left_positive else "lateral", 1, 1.0))
    change = pulse.change(time)
    if layout.left_positive:
        change[:, 1] *= -1.0
    for axis, k, _ in axes if not layout.acceleration_only else ():
        label = layout.names.get(axis, f"Delta-V, {axis}")
        if layout.both_in_cell:
            heads.append(f"{label} (MPH [km/h])")
            a, b = (change[:, k] / FACTORS[u] for u in ("mph", "km/h"))
            columns.append([f"{x:.1f} [{y:.1f}]" for x, y in zip(a, b, strict=True)])
            continue
        for unit in layout.units:
            heads.append(f"{label} {layout.bracket.format(SPELLED[unit])}".strip())
            shown = change[:, k] / FACTORS[unit]
            columns.append([_number(v, layout.decimals, layout) for v in shown])
    if layout.acceleration or layout.acceleration_only:
        force = pulse.acceleration(time) / G
        for axis, k, _ in axes:
            heads.append(f"Acceleration, {axis} (g)")
            columns.append([_number(v, 2, layout) for v in force[:, k]])
    return heads, list(zip(*columns, strict=True))


def text_of(layout: Layout) -> str:
    """Write the recorder."""
    lines = []
    if layout.preamble:
        lines += [
            _row(["Event data recorder report"], layout),
            _row(["VIN", "1TEST0000000"], layout),
            _row(["Complete File Recorded", "Yes" if layout.complete else "No"], layout),
            _row(["Multi-Event, Number of Events", str(len(layout.pulses))], layout),
            _row(["Safety Belt Status, Driver", "Buckled"], layout),
            _row(["Ignition Cycle, Crash", "2711"], layout),
            _row(["Time, Maximum Delta-V, Longitudinal (msec)", "95"], layout),
        ]
    tables = []
    for number, (pulse, speed) in enumerate(zip(layout.pulses, layout.speeds, strict=True), 1):
        before, crash = _before(layout, speed, number), _crash(layout, pulse)
        title = f"Event Record {number}" if layout.events == "title" else ""
        own = [(title, *crash)]
        if layout.before == "in one table":
            heads, rows = before
            more, below = crash
            empty = ("",) * (len(heads) - 1), ("",) * (len(more) - 1)
            rows = [(*row, *empty[1]) for row in rows]
            below = [(row[0], *empty[0], *row[1:]) for row in below]
            # Both have a row at time zero.
            own = [
                (title, [*heads, *more[1:]], [*rows[:-1], _joined(rows[-1], below[0]), *below[1:]])
            ]
        if layout.before in ("above", "below"):
            own.insert(0 if layout.before == "above" else 1, (title, *before))
        tables += own
    if layout.events == "column":
        heads = tables[0][1]
        rows = [(str(k), *row) for k, (_, _, own) in enumerate(tables, 1) for row in own]
        tables = [("", ["Event", *heads], rows)]
    for title, heads, rows in tables:
        lines += ["", title] if title else [""]
        if layout.units_row:
            split = [h.partition(" (") for h in heads]
            lines += [_row([s[0] for s in split], layout)]
            lines += [_row([s[2].rstrip(")") for s in split], layout)]
        else:
            lines.append(_row(heads, layout))
        lines += [_row(row, layout) for row in rows]
    return "\n".join(lines) + "\n"


def _joined(one, other):
    return tuple(a or b for a, b in zip(one, other, strict=True))


SMALL = Pulse(-11.0 * KMH, 2.0 * KMH, 0.08)
#: Twelve layouts: sampling, units, order, preamble, separators, decimal comma, tables, axes.
LAYOUTS = {
    "whole km/h, two tables": Layout(),
    "mph from 10 ms": Layout(units=("mph",), first=0.01, decimals=1, rate=20.0),
    "both units": Layout(units=("mph", "km/h"), decimals=1, bracket="[{}]"),
    "both units in a cell": Layout(both_in_cell=True, preamble=False),
    "decimal comma": Layout(separator=";", comma=True, decimals=2, units=("m/s",), end=0.3),
    "tabs, seconds, below": Layout(
        separator="\t", milliseconds=False, before="below", units=("ft/s",), decimals=1
    ),
    "forward only": Layout(lateral=False, before="none", preamble=False, events="none"),
    "with acceleration": Layout(acceleration=True, decimals=1, brake="Applied/Not applied"),
    "acceleration only": Layout(acceleration_only=True, step=0.002, end=0.25),
    "two events": Layout(pulses=(SMALL, Pulse()), speeds=(75.0, 62.0), decimals=1),
    "two events in a column": Layout(
        pulses=(Pulse(), SMALL), speeds=(75.0, 62.0), before="none", events="column", decimals=1
    ),
    "cut at 70 ms": Layout(end=0.07, complete=False, units=("mph",), order="backward"),
    "row of units, no brackets": Layout(units_row=True, units=("mph",)),
    "one table": Layout(before="in one table", milliseconds=False, decimals=1),
    "late in its table": Layout(pulses=(Pulse(length=0.08, start=0.07),), decimals=1, end=0.3),
    "left positive": Layout(
        left_positive=True,
        decimals=1,
        names={"lateral, left positive": "Delta-V, lateral, left positive"},
    ),
}
