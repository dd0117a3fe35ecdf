"""Cases of simulated crashes, run as a report has them."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from strapdown.config.crash_case import (
    CaseSpec,
    EntrySpec,
    PointSpec,
    ReferenceSpec,
    TriadSpec,
    UnitSpec,
)
from strapdown.crash.case import CaseResult, ReferenceAnswer, SeverityAnswer
from strapdown.crash.entry import Entry
from strapdown.crash.path import compare_with_reference, sample_paths
from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
from strapdown.crash.severity import find_severity_model, injury_risk
from strapdown.formats.crash_record import CrashRecord
from strapdown.report.chart import Chart
from strapdown.report.crash_document import crash_document
from strapdown.report.document import Picture, drawings
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.tables import NED

HOSTILE = '<script>alert("&")</script>\x00'
RUNS = 400
SPEED_SD = 0.1


def crash_case(name="pole", units=("IMU1", "IMU2"), window=None, end=None):
    """As `_run`, kept."""
    return _run(name, tuple(units), window, end)


@cache
def _run(name, units, window, end):
    """Result of a simulated crash: of which recorders, over which path, cut at an instant."""
    crash = find_crash(name)
    impact = crash.impacts[0] if crash.impacts else crash.start
    recorded = [
        record_crash(
            crash.motion,
            design,
            impact=impact,
            seed=3,
            start=impact - 2.5,
            end=None if end is None else impact + end,
        )[0]
        for design in paper_units()
        if design.name in units
    ]
    state = crash.motion.trajectory(np.array([impact])).iloc[0]
    speed = float(np.hypot(state["VN"], state["VE"]))
    entry = Entry.from_speed(speed, SPEED_SD)
    found = reconstruct_crash(recorded, entry, CrashOptions(window=window))
    path = found.main.path
    references = [_path_reference(crash, impact, found.main)]
    severity = []
    if found.main.body:
        change = found.main.body[0].event
        forward, end_time = float(change.delta_v.vector[0]), float(change.delta_v.end)
        spec = ReferenceSpec(
            kind="delta_v",
            name="EDR",
            delta_v_m_per_s=forward - 0.2,
            delta_v_sd_m_per_s=0.3,
            over_s=(float(change.delta_v.start), end_time),
        )
        references.append(
            ReferenceAnswer(spec, found.main.name, None, None, spec.over_s, forward, 0.1, True)
        )
        model = find_severity_model("wang_2022_all_mais3")
        sd = change.bound.along(change.delta_v.vector)
        risk = injury_risk(model, {"delta_v": change.resultant}, {"delta_v": sd})
        severity.append(SeverityAnswer(model, risk))
    spec = CaseSpec(
        title=f"simulated {name}",
        point=PointSpec(name="center of mass"),
        entry=EntrySpec(speed_m_per_s=speed, speed_sd_m_per_s=SPEED_SD),
        units=tuple(
            UnitSpec(
                name=u.name,
                accelerometers=tuple(TriadSpec(path="a.csv") for _ in u.accelerometers),
                gyro=None if u.gyro is None else TriadSpec(path="a.csv"),
            )
            for u in recorded
        ),
    )
    samples = sample_paths(path, runs=RUNS, seed=1)
    return CaseResult(
        spec,
        (),
        {"a.csv": CrashRecord(Path("a.csv"), "table", "", {}, (), ())},
        tuple(recorded),
        found,
        samples,
        tuple(severity),
        tuple(references),
        found.findings,
    )


def _path_reference(crash, impact, main):
    path = main.path
    time = np.arange(-0.05, min(0.3, path.time[-1]), 0.01)
    truth = MountedMotion(crash.motion, Mounting()).kinematics_from(time + impact, epoch=impact)
    table = pd.DataFrame(truth.position + 2.0, index=pd.Index(time, name="time"), columns=NED)
    spec = ReferenceSpec(kind="path", name="cameras", path="cameras.csv")
    compared = compare_with_reference(path, table)
    whole = (math.nan, math.nan)
    return ReferenceAnswer(
        spec, main.name, table, compared, whole, math.nan, math.nan, compared.consistent
    )


def figures_in(document):
    """Charts, pictures and the animation of a report, by what they show."""
    drawn = drawings(document)
    by = {one.slug: one for one in drawn}
    charts = [one for one in drawn if isinstance(one, Chart)]
    pictures = [one for one in drawn if isinstance(one, Picture)]

    def all_of(kind):
        return [one for one in charts if one.slug.startswith(kind)]

    return SimpleNamespace(
        charts=charts,
        pictures=[*pictures, by["motion"].stills],
        path=by["path"],
        motion=by["motion"],
        delta_v=all_of("delta-v"),
        references=all_of("reference-"),
        signals=by.get("signals-1"),
        rates=by.get("rates-1"),
        overview=by.get("overview-1"),
        pdof_by_window=by.get("pdof-by-window"),
        pdof_by_time_zero=by.get("pdof-by-time-zero"),
        place=by["position"],
        attitude=by["attitude"],
        units=by.get("units"),
        accelerations=by.get("accelerations"),
        delta_v_budget=by.get("budget-delta-v"),
        place_budget=by["budget-position"],
        severity=by.get("severity"),
    )


@cache
def figures_of(name="pole", units=("IMU1", "IMU2"), window=None, end=None):
    """All figures of such a case."""
    return figures_in(crash_document(crash_case(name, units, window, end), ""))
