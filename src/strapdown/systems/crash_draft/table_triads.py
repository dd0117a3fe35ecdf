"""Which columns of a table of unknown layout belong together as triads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.systems.crash_draft.header_words import Heading

Array = NDArray[np.float64]

__all__ = ["Group", "group_columns"]

# A sensor that feels a crash steps off by more than this many of its usual steps; a temperature
# stands far from zero for its spread, and does not.
FEELS, FAR = 6.0, 10.0


@dataclass(frozen=True)
class Group:
    """Columns of one triad.

    Attributes
    ----------
    columns : dict of str to str
        Axis to column.
    quantity : str
        ``acceleration``, ``rate``, ``velocity``, or empty where headings do not tell.
    unit : str
        Of the headings; empty where they do not tell.
    by_heading : bool
        Whether headings tell the axes.
    label : str
        What tells it from others.
    """

    columns: dict[str, str]
    quantity: str
    unit: str
    by_heading: bool
    label: str


def group_columns(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], list[tuple[str, str]]]:
    """Group columns into triads.

    Parameters
    ----------
    columns : dict of str to ndarray
        Without the clock, in their order.
    headings : dict of str to Heading

    Returns
    -------
    groups : list of Group
    left : list of (str, str)
        Columns that belong to none, and why.
    """
    left: list[tuple[str, str]] = []
    open_: dict[str, Array] = {}
    for name, values in columns.items():
        quantity = headings[name].quantity
        if quantity in ("other", "time", "counter"):
            what = {
                "time": "a second clock, or one that goes back",
                "counter": "a count of samples",
            }
            left.append((name, what.get(quantity, "its heading names something else")))
        elif not np.isfinite(values).any():
            left.append((name, "it is empty"))
        elif np.ptp(values[np.isfinite(values)]) == 0.0 and not headings[name].axis:
            left.append((name, "it is constant"))
        else:
            open_[name] = values
    groups, rest = _by_heading(open_, headings)
    more, dropped = _by_order(rest, headings)
    order = {name: k for k, name in enumerate(columns)}
    groups = sorted([*groups, *more], key=lambda g: min(order[c] for c in g.columns.values()))
    return groups, [*left, *dropped]


def _by_heading(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], dict[str, Array]]:
    found: dict[tuple[str, str], dict[str, str]] = {}
    spoiled: set[tuple[str, str]] = set()
    for name in columns:
        said = headings[name]
        if not said.axis:
            continue
        # Roll, pitch and yaw are words of one triad, each with a stem of its own.
        key = (said.quantity, said.stem)
        axes = found.setdefault(key, {})
        if said.axis in axes:
            spoiled.add(key)
        axes[said.axis] = name
    groups: list[Group] = []
    rest = dict(columns)
    for key, axes in found.items():
        quantity, stem = key
        # A lone letter that is no axis by the company it keeps is left to the numbers.
        if key in spoiled or (len(axes) < 2 and not quantity):
            continue
        units = {headings[c].unit for c in axes.values()} - {""}
        if len(units) > 1:
            continue
        ordered = {a: axes[a] for a in "xyz" if a in axes}
        groups.append(Group(ordered, quantity, next(iter(units), ""), True, stem))
        for column in axes.values():
            rest.pop(column)
    return _joined(groups, headings), rest


def _joined(groups: list[Group], headings: Mapping[str, Heading]) -> list[Group]:
    """Single channels of one quantity with axes that do not meet are one triad."""
    out: list[Group] = []
    for group in groups:
        mate = next(
            (
                k
                for k, other in enumerate(out)
                if len(group.columns) == 1
                and other.quantity == group.quantity
                and other.unit == group.unit
                and not set(other.columns) & set(group.columns)
            ),
            None,
        )
        if mate is None:
            out.append(group)
            continue
        other = out[mate]
        both = {**other.columns, **group.columns}
        ordered = {a: both[a] for a in "xyz" if a in both}
        out[mate] = Group(ordered, group.quantity, group.unit, True, other.label)
    return out


def _by_order(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], list[tuple[str, str]]]:
    """Threes of neighbouring columns; of those that are too many, the ones that feel least go."""
    names = list(columns)
    dropped: list[tuple[str, str]] = []
    dull = [n for n in names if not headings[n].quantity and _is_dull(columns[n])]
    while len(names) % 3 and dull:
        name = dull.pop()
        names.remove(name)
        dropped.append((name, "nothing happens in it when the others feel the crash"))
    groups: list[Group] = []
    for run in _runs(names, headings):
        for k in range(0, len(run) - len(run) % 3, 3):
            three = run[k : k + 3]
            said = headings[three[0]]
            groups.append(
                Group(
                    dict(zip("xyz", three, strict=True)),
                    said.quantity,
                    said.unit,
                    False,
                    said.stem.rstrip("0123456789 "),
                )
            )
        over = run[len(run) - len(run) % 3 :]
        if over and headings[over[0]].quantity:
            axes = dict(zip("xyz", over, strict=False))
            said = headings[over[0]]
            groups.append(Group(axes, said.quantity, said.unit, False, said.stem))
        else:
            dropped += [(n, "it makes no three with its neighbours") for n in over]
    return groups, dropped


def _runs(names: Sequence[str], headings: Mapping[str, Heading]) -> list[list[str]]:
    """Neighbours of one quantity and unit, as far as headings tell."""
    runs: list[list[str]] = []
    for name in names:
        said = headings[name]
        before = headings[runs[-1][-1]] if runs else None
        if before and (before.quantity, before.unit) == (said.quantity, said.unit):
            runs[-1].append(name)
        else:
            runs.append([name])
    return runs


def _is_dull(values: Array) -> bool:
    kept = values[np.isfinite(values)]
    spread = float(kept.std())
    if spread == 0.0:
        return True
    steps = np.abs(np.diff(kept))
    nonzero = steps[steps > 0.0]
    usual = max(float(np.median(steps)), float(nonzero.min(initial=np.inf)))
    if not np.isfinite(usual):
        return True
    return float(steps.max()) < FEELS * usual and abs(float(kept.mean())) > FAR * spread
