"""A run of navigation, from its specification to everything that a report tells."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.choice import make_choice
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_modules import given_of, sensors_of
from strapdown.config.slots import SLOTS
from strapdown.ellipsoids import find_ellipsoid
from strapdown.evaluation.control_points import score_control_points
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.evaluation.trajectory_summary import DifferenceSummary, summarise_differences
from strapdown.navigation.recorder import Recorder
from strapdown.systems.attitude_source import input_files
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.build import make_chain
from strapdown.systems.sins.channels import channel_findings, saturated_findings
from strapdown.systems.sins.drive import ChainRun, run_batch
from strapdown.systems.sins.file_rows import in_file, said_of_file
from strapdown.systems.sins.readiness import look_through
from strapdown.systems.sins.result import NavigationResult
from strapdown.systems.sins.source import NavigationSource, read_navigation_source
from strapdown.systems.sins.trust import trust_of
from strapdown.systems.sins.withholding import score_withholding

__all__ = ["Drive", "run_navigation"]

#: Runs a chain over samples and tables: with a recorder, and what is told of progress.
Drive = Callable[..., ChainRun]

#: Shares of a whole run at which its chain begins and ends.
BEGUN, ENDED = 0.15, 0.8
#: Of the record that is taken at a time, s: so often progress is told.
CHUNK = 20.0
_AT_ONCE = partial(run_batch, chunk=CHUNK)
#: Of a trajectory at least so much apart are the rows that are compared with the truth, s: errors
#: change no faster than what the truth is worth.
APART = 0.1


@one_thread()
def run_navigation(
    spec: NavigationSpec,
    file: Path | None = None,
    progress: Progress = silent,
    drive: Drive = _AT_ONCE,
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
    drive : callable, optional
        What runs the chain, called as `run_batch`: at a pace, or with what came already. The
        numbers must be those of a run at once.

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
    progress("looking through", 0.1)
    sensors = sensors_of(spec)
    tables = (source.imu, *source.tables.values())
    with said_of_file(*tables):
        looked = look_through(spec, source.imu, source.tables)
        # What is simulated has the errors that it was told to have; but how it moves may be more
        # than its sensors read.
        if spec.log is None:
            channels = saturated_findings(source.imu, sensors)
        else:
            channels = channel_findings(source.imu, sensors, spec.start)
    looked, channels = in_file(looked, *tables), in_file(channels, *tables)
    chain = make_chain(spec, sensors)
    recorder: Recorder = make_choice(spec.recorder, SLOTS["recorder"], given_of(spec))

    def told(mode: str, share: float) -> None:
        progress(mode, BEGUN + (ENDED - BEGUN) * share)

    progress("aligning" if spec.start is None else "navigating", BEGUN)
    with said_of_file(*tables):
        run = drive(chain, source.imu, source.tables, recorder, told)
    progress("comparing", ENDED)
    told_by = run.smoothed or run.record
    differences, errors = _against_truth(told_by.trajectory, source, spec)
    forward_differences = None
    if run.smoothed is not None:
        forward_differences, _ = _against_truth(run.record.trajectory, source, spec)
    points = None
    if source.points is not None:
        points = score_control_points(
            told_by.trajectory, source.points, find_ellipsoid(spec.ellipsoid)
        )
    withheld = score_withholding(
        spec,
        chain,
        source,
        run.record,
        lambda stage, share: progress(stage, ENDED + 0.02 * share),
    )
    trust = trust_of(
        spec,
        chain,
        sensors,
        source.imu,
        source.tables,
        run.record,
        run.aligned,
        lambda stage, share: progress(stage, ENDED + 0.02 * share),
    )
    files = () if file is None else (input_files("configuration", str(file), (file,)),)
    aligned = {one.mode: one for one in run.aligned}
    coarse, fine = aligned.get("coarse"), aligned.get("fine")
    findings = [
        *source.findings,
        *channels,
        *looked,
        *(f for one in run.aligned for f in one.alignment.findings),
        *(() if fine is None or fine.fine is None else fine.fine.findings),
    ]
    return NavigationResult(
        spec=spec,
        source=source,
        ellipsoid=find_ellipsoid(spec.ellipsoid),
        sensors=sensors,
        coarse=None if coarse is None else coarse.alignment,
        fine=None if fine is None else fine.fine,
        record=told_by,
        forward=None if run.smoothed is None else run.record,
        differences=differences,
        errors=errors,
        forward_differences=forward_differences,
        points=points,
        withheld=withheld,
        trust=trust,
        inputs=(*files, *source.inputs),
        findings=tuple(dict.fromkeys(findings)),
    )


def _against_truth(
    trajectory: pd.DataFrame, source: NavigationSource, spec: NavigationSpec
) -> tuple[pd.DataFrame | None, DifferenceSummary | None]:
    if source.truth is None:
        return None, None
    rows = _rows_compared(trajectory.index.to_numpy(dtype=np.float64))
    kept = trajectory.iloc[rows]
    kept.attrs = dict(trajectory.attrs)
    differences = trajectory_differences(kept, source.truth, find_ellipsoid(spec.ellipsoid))
    return differences, summarise_differences(differences)


def _rows_compared(time: NDArray[np.float64]) -> NDArray[np.intp]:
    """Rows at a steady distance, from the last one back."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else APART
    each = max(1, round(APART / step)) if step > 0.0 else 1
    return np.arange(len(time) - 1, -1, -each)[::-1]
