"""The answers of a case beside what else is known of the crash."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from strapdown.config.crash_case import ReferenceSpec
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.delta_v import delta_v
from strapdown.crash.delta_v_bound import body_delta_v_bound
from strapdown.crash.reference_path import PathComparison, compare_with_reference
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.errors import ConfigError, DataError
from strapdown.systems.case_severity import main_event

__all__ = ["ReferenceAnswer", "compare_reference"]

AXES = {"forward": (1.0, 0.0, 0.0), "right": (0.0, 1.0, 0.0)}


@dataclass(frozen=True, eq=False)
class ReferenceAnswer:
    """One unit's answer beside something else that is known.

    Attributes
    ----------
    spec : ReferenceSpec
    unit : str
        Whose answer it is.
    table : DataFrame or None
        Of a path, as read.
    path : PathComparison or None
    span : tuple of float, s
        Of a change of velocity.
    delta_v, sd : float, m/s
        Ours over the span; NaN for a path.
    consistent : bool
        Whether the difference is within the 95 % bound of both together.
    """

    spec: ReferenceSpec
    unit: str
    table: pd.DataFrame | None
    path: PathComparison | None
    span: tuple[float, float]
    delta_v: float
    sd: float
    consistent: bool


def compare_reference(
    spec: ReferenceSpec,
    unit: UnitReconstruction,
    gravity: float,
    tables: Mapping[str, pd.DataFrame],
) -> ReferenceAnswer:
    """Hold one unit against one reference.

    Parameters
    ----------
    spec : ReferenceSpec
    unit : UnitReconstruction
    gravity : float, m/s²
    tables : dict of str to DataFrame
        Reference paths, by path of their file.

    Returns
    -------
    ReferenceAnswer

    Raises
    ------
    DataError
        The reference and the record have no time in common.
    ConfigError
        Nothing says over which span a change of velocity is meant: there is no event.
    """
    if spec.path is not None:
        table = tables[spec.path]
        found = compare_with_reference(unit.path, table)
        return ReferenceAnswer(
            spec,
            unit.name,
            table,
            found,
            (unit.path.time[0], unit.path.time[-1]),
            math.nan,
            math.nan,
            found.consistent,
        )
    assert spec.delta_v_m_per_s is not None
    number = main_event(unit)
    if spec.over_s is not None:
        start, end = spec.over_s
    elif number is not None:
        event = unit.events.events[number]
        start, end = event.time_zero, event.end
    else:
        raise ConfigError(
            "crash.no-event-no-span-stated",
            quantity=f"references, {spec.name}, over_s",
            name=unit.name,
        )
    try:
        change = delta_v(unit.acceleration, start, end, across_gaps=True)
    except DataError as error:
        raise DataError(
            "crash.reference-span-outside-record",
            file=unit.name,
            quantity="over_s",
            name=spec.name,
            reason=error.finding,
        ) from None
    _, rest_sd = unit.at_point.resting_force(gravity)
    bound = body_delta_v_bound(unit.at_point.effects, change.weights, rest_sd=rest_sd)
    if spec.axis == "resultant":
        value, sd = change.resultant, bound.along(change.vector)
    else:
        axis = AXES[spec.axis]
        value = float(change.vector @ axis)
        sd = bound.along(axis)
    together = TWO_SIDED_95 * math.hypot(sd, spec.delta_v_sd_m_per_s)
    near = abs(value - spec.delta_v_m_per_s) <= together
    return ReferenceAnswer(spec, unit.name, None, None, (start, end), value, sd, near)
