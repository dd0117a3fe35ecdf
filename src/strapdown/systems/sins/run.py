"""A run of navigation, from its specification to everything that a report tells."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.choice import make_choice
from strapdown.config.navigation import NavigationSpec, StartTable
from strapdown.config.navigation_checks import make_aids, make_filter, uncertainty_of
from strapdown.config.slots import SLOTS
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.evaluation.trajectory_summary import DifferenceSummary, summarise_differences
from strapdown.exceptions import Finding
from strapdown.increments import motion_increments
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.recorder import record_of
from strapdown.systems.attitude_source import input_files
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.result import NavigationResult
from strapdown.systems.sins.source import NavigationSource, read_navigation_source
from strapdown.tables import MOTION
from strapdown.tables.checks import index_of, values_of

__all__ = ["run_navigation"]

Array = NDArray[np.float64]

#: Samples that are navigated at a time: so often progress is told.
PIECE = 20_000


@one_thread()
def run_navigation(
    spec: NavigationSpec, file: Path | None = None, progress: Progress = silent
) -> NavigationResult:
    """Read a record and its aids, align, and navigate.

    Parameters
    ----------
    spec : NavigationSpec
        With absolute paths.
    file : Path, optional
        Where it was read from: an input, too.
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    NavigationResult

    Raises
    ------
    ConfigError
        A file is not there, or an option cannot be.
    DataError
        A record cannot be read, or it cannot be navigated by; the message names file, row,
        quantity and remedy.
    DivergenceError
        The state left what the mechanization can do.
    """
    progress("reading", 0.02)
    source = read_navigation_source(spec)
    sensors = uncertainty_of(spec)
    aids = make_aids(spec)
    filter_ = with_states(make_filter(spec, sensors), aids)
    options = make_choice(spec.filter, SLOTS["filter"], {})
    imu, report, increments = source.imu, None, None
    if spec.prefilter.kind != "none":
        prefilter = make_choice(spec.prefilter, SLOTS["prefilter"], {})
        progress("pre-filter", 0.1)
        filtered = prefilter.apply(imu)
        imu, report, increments = filtered.imu, filtered.report, filtered.increments
    progress("increments", 0.15)
    if increments is None:
        increments = motion_increments(imu)
    time, rows = index_of(increments), np.ascontiguousarray(values_of(increments, MOTION))
    begin = float(time[0] - rows[0, 0])
    assert spec.start is not None
    start, P = _known_start(spec.start, begin, filter_)
    navigator = Navigator(filter_, aids, options.mark_interval)
    state = navigator.begin(start, P)
    for aid in aids:
        if aid.name in source.tables:
            table = source.tables[aid.name]
            state = navigator.tell(state, aid.name, table[index_of(table) > begin + 1e-6])
    pieces = []
    for at in range(0, len(time), PIECE):
        progress("navigating", 0.2 + 0.6 * at / len(time))
        state, piece = navigator.advance(state, time[at : at + PIECE], rows[at : at + PIECE])
        pieces.append(piece)
    record = record_of(navigator, pieces, source.name)
    progress("comparing", 0.8)
    differences, errors = _against_truth(record.trajectory, source, spec)
    files = () if file is None else (input_files("configuration", str(file), (file,)),)
    findings: list[Finding] = [*source.findings, *(() if report is None else report.findings)]
    return NavigationResult(
        spec=spec,
        source=source,
        ellipsoid=find_ellipsoid(spec.ellipsoid),
        sensors=sensors,
        prefilter=report,
        coarse=None,
        fine=None,
        start=start,
        record=record,
        differences=differences,
        errors=errors,
        inputs=(*files, *source.inputs),
        findings=tuple(dict.fromkeys(findings)),
    )


def _known_start(known: StartTable, time: float, filter_: ErrorFilter) -> tuple[NavState, Array]:
    """A stated state, and the covariance of the physical errors that goes with it."""
    start = NavState.from_degrees(
        known.lat_deg,
        known.lon_deg,
        known.alt_m,
        v_n=known.v_ned_m_per_s,
        roll_deg=known.roll_deg,
        pitch_deg=known.pitch_deg,
        heading_deg=known.heading_deg,
        time=time,
    )
    tilt, heading = math.radians(known.tilt_sd_deg), math.radians(known.heading_sd_deg)
    sd = np.concatenate(
        [
            np.broadcast_to(known.position_sd_m, 3),
            np.broadcast_to(known.velocity_sd_m_per_s, 3),
            [tilt, tilt, heading],
            filter_.model.stacked.sd,
        ]
    )
    return start, np.diag(np.square(sd))


def _against_truth(
    trajectory: pd.DataFrame, source: NavigationSource, spec: NavigationSpec
) -> tuple[pd.DataFrame | None, DifferenceSummary | None]:
    if source.truth is None:
        return None, None
    differences = trajectory_differences(trajectory, source.truth, find_ellipsoid(spec.ellipsoid))
    return differences, summarise_differences(differences)
