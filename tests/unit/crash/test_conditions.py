"""Conditions outside of every bound: each is found, or the manual states that it is not.

The table of the manual is the one that `table` makes here.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded
from tests.unit.crash import planar_impact
from tests.unit.crash.folding_crash import KINDS, Crash, Fault, G

from strapdown.crash.closure import ImpactVehicle, close_vehicles
from strapdown.errors import DataError

MANUAL = Path(__file__).parents[3] / "docs" / "crash.md"
DRAWS = 12


def turned(vehicle):
    c, s = np.cos(np.radians(5.0)), np.sin(np.radians(5.0))
    return vehicle.with_delta_v_times([[c, s], [-s, c]])


def moved(vehicle):
    rate = np.radians(vehicle.rate_change[0])
    return replace(vehicle, delta_v=vehicle.delta_v + rate * 0.25 * np.array([-1.0, 1.0, 0.0]))


def turning_back(vehicle):
    def minus(pair):
        return -pair[0], pair[1]

    return replace(vehicle, rate=minus(vehicle.rate), rate_change=minus(vehicle.rate_change))


@dataclass(frozen=True)
class Condition:
    """What is wrong of a point, or of all; `vehicle`: what it makes of a vehicle's answer."""

    name: str
    fault: Callable[[Crash], Fault]
    vehicle: Callable[[ImpactVehicle], ImpactVehicle] | None = None


def largest(crash):
    time = np.linspace(0.0, crash.length, 500)
    return float(crash.shape(time).max()) * crash.size


CONDITIONS = (
    Condition(
        "turned by 5° about down",
        lambda c: Fault(turned_deg=5.0),
        turned,
    ),
    Condition(
        "0.25 m off, forward and right",
        lambda c: Fault(moved=(0.25, 0.25, 0.0)),
        moved,
    ),
    Condition(
        "sign of the yaw rate",
        lambda c: Fault(gyro=-1.0),
        turning_back,
    ),
    Condition(
        "trigger 20 ms late",
        lambda c: Fault(late=-0.02),
    ),
    Condition(
        "record cut at 0.6 of the pulse",
        lambda c: Fault(end=round(0.6 * c.length, 3)),
    ),
    Condition(
        "clipped at half of the peak",
        lambda c: Fault(full_scale=round(0.5 * largest(c), 1)),
    ),
    Condition(
        "unit g stated as m/s²",
        lambda c: Fault(factor=(1.0 / G,) * 3),
        lambda v: v.with_delta_v_times(np.eye(2) / G),
    ),
    Condition("axis right missing", lambda c: Fault(missing="y")),
)


def drawn(number) -> Crash:
    return Crash(7000 + number, list(KINDS)[number % len(KINDS)])


def warned(findings) -> bool:
    """Beyond what sound records of a tenth of a second before the trigger have, too."""
    usual = "crash.no-stationary-stretch-quiet-without"
    return any(f.severity != "note" and f.code != usual for f in findings)


def noticed(condition, number, *, both) -> bool:
    """Whether a reconstruction says that something is wrong, or that it has only a part."""
    crash = drawn(number)
    fault = condition.fault(crash)
    units = [crash.unit(k, gyro=True, fault=fault if both or k else None) for k in range(2)]
    if fault.missing:
        units = [replace(u, assumed=None) for u in units]
    try:
        whole = crash.reconstructed(units)
    except DataError:
        return True
    change = whole.main.delta_v
    return warned(whole.findings) or change is None or change.at_least


def contradicted(condition, number) -> bool:
    kind = list(planar_impact.KINDS)[number % len(planar_impact.KINDS)]
    impact = planar_impact.draw(np.random.default_rng([5, number]), kind)
    first, second = impact.measured
    if condition is None:
        swapped = {"delta_v": second.delta_v, "covariance": second.covariance}
        second = replace(second, delta_v=first.delta_v, covariance=first.covariance)
        first = replace(first, **swapped)
    else:
        first = condition.vehicle(first)
    return close_vehicles(first, second, friction=planar_impact.FRICTION).contradicted


def cell(shares) -> str:
    share = float(np.mean(shares))
    if share >= 0.9:
        return "found"
    return "not detectable" if share <= 0.05 else f"in {100.0 * share:.0f} %"


def table(draws=DRAWS, impacts=500) -> list[str]:
    """Rows of the table of the manual."""
    rows = []
    for condition in CONDITIONS:
        cells = [
            cell([noticed(condition, n, both=both) for n in range(draws)]) for both in (False, True)
        ]
        closed = "–"
        if condition.vehicle is not None:
            closed = cell([contradicted(condition, n) for n in range(impacts)])
        rows.append(f"| {condition.name} | {cells[0]} | {cells[1]} | {closed} |")
    closed = cell([contradicted(None, n) for n in range(impacts)])
    return [*rows, f"| records of the vehicles swapped | – | – | {closed} |"]


def test_a_gyro_of_the_other_sign_and_a_clipped_axis_are_found():
    by_name = {c.name: c for c in CONDITIONS}
    assert noticed(by_name["sign of the yaw rate"], 1, both=False)
    assert noticed(by_name["clipped at half of the peak"], 1, both=True)


def test_a_missing_axis_is_asked():
    crash = drawn(1)
    units = [crash.unit(k, gyro=True, fault=Fault(missing="y")) for k in range(2)]
    with pytest.raises(DataError, check=coded("sensors.axes-missing")):
        crash.reconstructed([replace(u, assumed=None) for u in units])


@pytest.mark.slow
def test_the_table_of_the_manual_is_that_of_the_draws():
    text = MANUAL.read_text(encoding="utf-8")
    rows = table()
    number = re.compile(r"in (\d+) %")
    for row in rows:
        name = row.split("|")[1]
        (written,) = [line for line in text.splitlines() if line.startswith(f"|{name}|")]
        # A draw on another processor may tip over: one of them.
        assert number.sub("in some", row) == number.sub("in some", written)
        for mine, said in zip(number.findall(row), number.findall(written), strict=True):
            assert abs(int(mine) - int(said)) <= 9
