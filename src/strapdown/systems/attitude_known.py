"""What is known of the attitude, beside a truth: reference points, rests, places, a second log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config import AttitudeSpec, ScenarioSpec
from strapdown.errors import ConfigError, Finding
from strapdown.evaluation.known import known_at
from strapdown.evaluation.place_references import PlaceReference, is_place, parse_place
from strapdown.evaluation.reference_points import references_from_words
from strapdown.evaluation.rest_references import same_pose_candidates, tilt_references
from strapdown.evaluation.second_log import align_second_log
from strapdown.evaluation.second_log_truth import second_clock, truth_from_second_log
from strapdown.formats import read_log
from strapdown.formats.recording import Recording
from strapdown.results.rests import RestStretch, SamePose
from strapdown.results.second_log import SecondLog
from strapdown.sensors.rest import find_rests
from strapdown.simulation import find_scenario
from strapdown.systems.attitude_source import Source, input_files

Array = NDArray[np.float64]

#: The word that makes a reference point of every rest.
RESTS = "rests"


@dataclass(frozen=True)
class Told:
    """Reference points of attitude and of place, and what could be one."""

    points: pd.DataFrame
    places: tuple[PlaceReference, ...]
    offers: tuple[SamePose, ...]


def gather_references(
    spec: AttitudeSpec,
    source: Source,
    span: tuple[float, float],
    rests: tuple[RestStretch, ...],
    levelled: bool,
) -> Told:
    """Make reference points of what was said, of a scenario's own, and of rests.

    Parameters
    ----------
    spec : AttitudeSpec
    source : Source
    span : tuple of float, s
        What the words start and end stand for.
    rests : tuple of RestStretch
    levelled : bool
        Whether the run starts levelled at the first rest, which is then no reference.

    Returns
    -------
    Told

    Raises
    ------
    ConfigError, DataError
        A sentence is not understood, an instant lies outside the log, or rests were asked for
        and there are none with acceleration.
    """
    words = list(spec.references)
    whole = spec.from_s is spec.to_s is spec.duration_s is None
    if isinstance(spec.source, ScenarioSpec) and not words and whole:
        words = list(find_scenario(spec.source.name).references)
    asked = [w for w in words if w.strip().lower() == RESTS]
    words = [w for w in words if w.strip().lower() != RESTS]
    points = references_from_words([w for w in words if not is_place(w)], *span)
    usable = [r for r in rests if r.accel_mean is not None and r.start >= span[0]]
    if asked:
        tilts = tilt_references(usable, levelled_from=usable[0] if levelled and usable else None)
        if tilts.empty:
            raise ConfigError(
                "attitude.no-rest-after-levelling" if levelled else "attitude.no-rest",
                file=source.name,
                quantity="--reference rests",
            )
        points = pd.concat([points, tilts], ignore_index=True) if len(points) else tilts
    return Told(
        points,
        tuple(parse_place(w, *span) for w in words if is_place(w)),
        same_pose_candidates(usable) if points.empty else (),
    )


@dataclass(frozen=True)
class Second:
    """A second log, laid over the first."""

    recording: Recording
    aligned: SecondLog


def read_second(spec: AttitudeSpec, source: Source) -> tuple[Source, Second | None]:
    """Read and lay over the log of a second sensor, where one is named.

    Parameters
    ----------
    spec : AttitudeSpec
    source : Source

    Returns
    -------
    source : Source
        The part that both cover; with a truth, where the second log has one itself.
    second : Second or None

    Raises
    ------
    ConfigError
        A truth was given, too.
    DataError
        The second log cannot be read or laid over the first.
    """
    if spec.reference_log_path is None:
        return source, None
    if spec.truth_path is not None:
        raise ConfigError("attitude.attitude-truth-given-too", quantity="--reference-log")
    recording = read_log(spec.reference_log_path)
    aligned = align_second_log(source.imu, recording.imu)
    inside = (source.imu.index >= aligned.start) & (source.imu.index <= aligned.end)
    findings = tuple(f.replace(file=f.file or recording.name) for f in recording.findings)
    inputs = input_files("reference-log", spec.reference_log_path, recording.files)
    imu = source.imu[inside]
    truth = scored = None
    if recording.truth is not None and recording.scored is not None:
        # It tells the attitude from the start, which a gyro alone cannot.
        truth = truth_from_second_log(aligned, imu, recording.imu, attitude=recording.truth)
        there = second_clock(aligned, truth.index)
        scored = known_at(recording.truth, recording.scored, there).counts
    return replace(
        source,
        imu=imu,
        truth=truth,
        scored=scored,
        # What a second sensor says is no exact truth.
        clean=None,
        findings=source.findings + findings,
        inputs=(*source.inputs, inputs),
    ), Second(recording, aligned)


def truth_of_second(source: Source, second: Second, imu: pd.DataFrame, q_nb: Array) -> Source:
    """Take the attitude by the second log's rates for the truth.

    Parameters
    ----------
    source : Source
    second : Second
    imu : DataFrame
        Of the first sensor, from where the run starts.
    q_nb : ndarray, (4,)
        Attitude there, which the second log's rates are carried on from.

    Returns
    -------
    Source
        With a truth, and a finding where the second log's own bias is not known.
    """
    rests = find_rests(second.recording.imu)
    bias = rests[0].gyro_mean if rests else (0.0, 0.0, 0.0)
    findings = source.findings
    if not rests:
        findings += (
            Finding(
                "attitude.no-rest-found-bias-truth",
                file=second.recording.name,
                quantity="gyro bias",
            ),
        )
    truth = truth_from_second_log(
        second.aligned,
        imu,
        second.recording.imu,
        gyro_bias=bias,
        q_start=q_nb,
    )
    return replace(source, truth=truth, scored=np.ones(len(truth), dtype=bool), findings=findings)
