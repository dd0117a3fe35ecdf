"""What is to be thought of the runs of the attitude bench."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.evaluation.differences import error_angles
from strapdown.results.runs import AttitudeRun
from strapdown.results.scores import Score
from strapdown.systems.attitude_source import Source
from strapdown.tables import THETA, find_gaps

Array = NDArray[np.float64]

# Within this of ±90° of pitch the kinematics of Euler angles amplify every error tenfold.
NEAR_POLE = 5.7  # deg: 1/cos = 10
# A step that turns by more than this says little of what happened within it.
LARGE_STEP = 0.5  # rad


def passed_pole(run: AttitudeRun) -> bool:
    """Tell whether a run came so near ±90° of pitch that its angles are not to be trusted."""
    return run.diagnostics.get("closest_to_pole_deg", 90.0) < NEAR_POLE


def truth_score(run: AttitudeRun, source: Source) -> list[Score]:
    """Compare a run with the truth, where there is one.

    Parameters
    ----------
    run : AttitudeRun
    source : Source

    Returns
    -------
    list of Score
        One, or none. Errors are rotation angles in deg over the samples that count.
    """
    if source.truth is None or source.scored is None:
        return []
    errors = error_angles(run.attitude, source.truth[source.scored])
    if errors.empty:
        return []
    return [
        Score(
            algorithm=run.algorithm,
            against="truth",
            time=float(errors.index[-1]),
            error_deg=float(errors.iloc[-1]),
            rms_deg=float(np.sqrt((errors**2).mean())),
            max_deg=float(errors.max()),
        )
    ]


def judge_turns(scores: list[Score]) -> list[Finding]:
    """Say where the turns that were stated are not those that the gyro saw."""
    findings = {}
    for score in scores:
        if score.turned_deg is None or score.expected_deg is None:
            continue
        off = (score.turned_deg - score.expected_deg) / 360.0
        if abs(off) > 0.5:
            findings[score.against] = Finding(
                "attitude.says-turns-gyro-turned",
                quantity="reference",
                against=score.against,
                expected_deg=score.expected_deg / 360.0,
                turned_deg=score.turned_deg / 360.0,
            )
    return list(findings.values())


def judge_truth(source: Source, span: tuple[float, float]) -> list[Finding]:
    """Say where the truth tells of a small part of the log only."""
    if source.truth is None or source.scored is None or not source.scored.any():
        return []
    counted = source.truth.index[source.scored]
    covered = float(counted[-1] - counted[0])
    if covered >= 0.5 * (span[1] - span[0]):
        return []
    return [
        Finding(
            "attitude.covers-rest-nothing-known",
            file=source.name,
            quantity="truth",
            severity="note",
            covered=covered,
            span=span[1] - span[0],
        )
    ]


def judge_runs(runs: list[AttitudeRun], increments: pd.DataFrame) -> list[Finding]:
    """Say what in the runs themselves, or in their steps, is not to be trusted.

    Parameters
    ----------
    runs : list of AttitudeRun
        On the same samples.
    increments : DataFrame
        The Increments table that they ran over.

    Returns
    -------
    list of Finding
    """
    findings = []
    for run in runs:
        if passed_pole(run):
            findings.append(
                Finding(
                    "attitude.near-vertical-pitch"
                    if run.diagnostics["closest_to_pole_deg"]
                    else "attitude.through-vertical-pitch",
                    quantity=run.algorithm,
                    apart_deg=run.diagnostics["closest_to_pole_deg"],
                    time=run.diagnostics["closest_to_pole_time_s"],
                )
            )
    turn = np.sqrt((increments[THETA].to_numpy() ** 2).sum(axis=1))
    # Gaps have been reported when the log was read.
    turn[[gap.sample - 1 for gap in find_gaps(runs[0].attitude.index)]] = 0.0
    largest = int(turn.argmax())
    if turn[largest] > LARGE_STEP:
        findings.append(
            Finding(
                "attitude.single-step-turns-rate-says",
                quantity="gyro",
                turn_deg=np.degrees(turn[largest]),
                index=increments.index[largest],
            )
        )
    return findings
