"""Every chart and picture of a crash report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.case import CaseResult, ReferenceAnswer, main_event
from strapdown.crash.path import CrashPath
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.report.chart import Chart
from strapdown.report.crash_animation import path_animation
from strapdown.report.crash_charts import (
    StatedDeltaV,
    accelerations_chart,
    delta_v_budget_chart,
    delta_v_chart,
    differences_chart,
    pdof_by_shift_chart,
    pdof_by_window_chart,
    place_budget_chart,
    risk_chart,
)
from strapdown.report.crash_outline import vehicle_outline
from strapdown.report.crash_pictures import Direction, MountingPoint, conventions_picture, pdof_dial
from strapdown.report.crash_plan import path_plan
from strapdown.report.crash_signals import (
    UnitSignals,
    attitude_chart,
    place_chart,
    reference_chart,
    unit_signals,
    velocity_chart,
)
from strapdown.report.document import Animation, Picture
from strapdown.report.values import axis_names
from strapdown.tables import NED


@dataclass(frozen=True)
class CrashFigures:
    """Charts and pictures of one case, each with its caption; None where not available.

    Time is from the trigger, ms (s in overviews). Every bound is a 95 % bound. Axes are the turning
    axes of the vehicle: forward, right, down. Those of the path are north, east, down or, without a
    stated heading, forward, right, down of the vehicle at the entry.

    Attributes
    ----------
    front : tuple of Picture
        For page one: direction of force of every event on a clock about the vehicle, from the
        origin of the force, 0 the front, positive clockwise, 95 % as a wedge, if any; and the path,
        small.
    path : Picture
        From above, m; 95 % ellipses; outlines at the entry, time zero, event ends and end.
    signals : tuple of UnitSignals
        For every unit: specific force, g, and rates, deg/s, of the crash and the whole record.
    delta_v : tuple of Chart
        One per event: forward, right, down, resultant, km/h, of every unit and the mean.
    pdof_by_window, pdof_by_time_zero : Chart or None
        Direction of force of the main event, deg, against window length and time zero.
    motion : Animation
        The vehicle on its path in 3D, m; on paper six instants.
    place, velocity, attitude : Chart
        Path over time: m, m/s, deg; linear and Monte Carlo bounds.
    references : tuple of Chart
        Path minus each reference path, m, with the bound of both.
    units : Chart or None
        Change of velocity of each unit minus that of all, m/s.
    accelerations : Chart or None
        All units at the reference point, g.
    delta_v_budget : Chart or None
        Standard deviation by contributor, m/s, of the main event.
    place_budget : Chart
        The same of the end of the path, m.
    severity : Chart or None
        Risk, %, against the change of velocity, km/h.
    conventions : Picture
        Axes, signs, origin, units and reference point on this vehicle.
    """

    front: tuple[Picture, ...]
    path: Picture
    signals: tuple[UnitSignals, ...]
    delta_v: tuple[Chart, ...]
    pdof_by_window: Chart | None
    pdof_by_time_zero: Chart | None
    motion: Animation
    place: Chart
    velocity: Chart
    attitude: Chart
    references: tuple[Chart, ...]
    units: Chart | None
    accelerations: Chart | None
    delta_v_budget: Chart | None
    place_budget: Chart
    severity: Chart | None
    conventions: Picture

    @property
    def charts(self) -> tuple[Chart, ...]:
        """All charts in report order; each has its own slug."""
        found = [
            *self.delta_v,
            self.pdof_by_window,
            self.pdof_by_time_zero,
            self.place,
            self.velocity,
            self.attitude,
            *self.references,
            self.units,
            self.accelerations,
            self.delta_v_budget,
            self.place_budget,
            self.severity,
        ]
        for unit in self.signals:
            found += [unit.crash, unit.rates, unit.overview]
        return tuple(chart for chart in found if chart is not None)

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures, including those of the animation on paper."""
        stills = () if self.motion.stills is None else (self.motion.stills,)
        return (*self.front, self.path, *stills, self.conventions)


def crash_figures(result: CaseResult) -> CrashFigures:
    """Draw all charts and pictures of the report of a case.

    Returns
    -------
    CrashFigures
        Byte-identical for the same result.
    """
    found, spec = result.reconstruction, result.spec
    main, events = found.main, found.main.events.events
    path, which = main.path, main_event(main)
    names = axis_names(result)[:2]
    outline, point = vehicle_outline(spec.vehicle), found.point
    gravity = spec.options.gravity_m_per_s2
    paths = [r for r in result.references if r.path is not None and r.unit == main.name]
    first = paths[0] if paths else None
    reference = None if first is None else reference_in_path_axes(path, first)
    shown = "reference" if first is None else first.spec.name
    seen: Any = {
        "events": events,
        "point": point,
        "names": names,
        "reference": reference,
        "reference_name": shown,
    }
    several = len(found.units) > 1
    stated = _stated(result, main)
    charts = [
        delta_v_chart(
            found.units,
            found.combined,
            k,
            gravity=gravity,
            stated=[s for s in stated if _belongs(main, k, s.time)],
        )
        for k in range(len(events))
    ]
    by_name = {unit.name: unit for unit in result.units}
    return CrashFigures(
        front=(
            *(
                pdof_dial(outline, directions, point=point, point_name=spec.point.name, small=True)
                for directions in [_directions(main, which)]
                if directions
            ),
            path_plan(path, outline, small=True, **seen),
        ),
        path=path_plan(path, outline, **seen),
        signals=tuple(
            unit_signals(by_name[u.name], found.synchronised.unit(u.name), u, k, events)
            for k, u in enumerate(found.units)
        ),
        delta_v=tuple(chart for chart in charts if chart is not None),
        pdof_by_window=None
        if which is None
        else pdof_by_window_chart(found.units, found.combined, which),
        pdof_by_time_zero=None
        if which is None
        else pdof_by_shift_chart(found.units, found.combined, which),
        motion=path_animation(path, outline, **seen),
        place=place_chart(
            path,
            names,
            samples=result.samples,
            events=events,
            reference=reference,
            reference_name=shown,
        ),
        velocity=velocity_chart(path, names, samples=result.samples, events=events),
        attitude=attitude_chart(path, samples=result.samples, events=events),
        references=tuple(
            reference_chart(r.path, r.spec.name, names, k)
            for k, r in enumerate(paths, start=1)
            if r.path is not None
        ),
        units=None
        if found.comparison is None
        else differences_chart(found.comparison, [u.name for u in found.units]),
        accelerations=accelerations_chart(found.units, found.combined, events) if several else None,
        delta_v_budget=None if which is None else delta_v_budget_chart(main.body[which].event),
        place_budget=place_budget_chart(path, names),
        severity=_severity(result, which),
        conventions=conventions_picture(
            outline,
            [MountingPoint(u.name, u.mounting.position, k) for k, u in enumerate(result.units)],
            point=point,
            point_name=spec.point.name,
        ),
    )


def reference_in_path_axes(path: CrashPath, answer: ReferenceAnswer) -> pd.DataFrame:
    """Positions of a reference path, shifted to agree with the reconstruction at the entry.

    Parameters
    ----------
    path : CrashPath
        Reconstructed path of the comparison.
    answer : ReferenceAnswer
        Answer with a reference path.

    Returns
    -------
    DataFrame
        ``north east down``, m, indexed by time, s, as used in the comparison.
    """
    assert answer.path is not None
    from scipy.interpolate import CubicHermiteSpline

    errors = answer.path.errors
    own = CubicHermiteSpline(path.time, path.table[NED].to_numpy(), path.table[["VN", "VE", "VD"]])
    at = errors.index.to_numpy(dtype=np.float64)
    return pd.DataFrame(own(at) - errors[NED].to_numpy(), index=errors.index, columns=NED)


def _directions(main: UnitReconstruction, which: int | None) -> list[Direction]:
    return [
        Direction(
            f"event {k + 1}",
            kind.direction.horizontal_deg,
            changes.event.interval.horizontal,
            kind.direction.clock,
            changes.event.resultant,
            k == which,
        )
        for k, (changes, kind) in enumerate(zip(main.body, main.types, strict=True))
    ]


def _stated(result: CaseResult, main: UnitReconstruction) -> list[StatedDeltaV]:
    """Delta-V stated by other sources, at the end of the main event if no time is stated."""
    which = main_event(main)
    found = []
    for answer in result.references:
        spec = answer.spec
        if answer.unit != main.name or spec.delta_v_m_per_s is None or which is None:
            continue
        at = answer.span[1]
        sd = spec.delta_v_sd_m_per_s
        found.append(StatedDeltaV(at, spec.delta_v_m_per_s, sd, spec.name, spec.axis))
    return found


def _belongs(main: UnitReconstruction, event: int, at: float) -> bool:
    """Whether the time zero of this event is the last one before an instant."""
    zeros = [e.time_zero for e in main.events.events]
    return event == max((k for k, zero in enumerate(zeros) if zero <= at), default=0)


def _severity(result: CaseResult, which: int | None) -> Chart | None:
    risks = [answer.risk for answer in result.severity if answer.risk is not None]
    if which is None or not risks:
        return None
    main = result.reconstruction.main
    change = main.body[which].event
    inputs: dict[str, float | str] = {"crash_type": main.types[which].name}
    return risk_chart(
        risks,
        change.resultant,
        change.resultant_bound / TWO_SIDED_95,
        inputs | dict(result.spec.options.severity_inputs),
    )
