"""System A, Alexiev (2021): attitude algorithms on one log, and how far they can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.attitude import make_algorithm, run_attitude
from strapdown.config import AttitudeSpec, specify
from strapdown.evaluation.differences import largest_differences
from strapdown.evaluation.reference_points import references_from_words, score_references
from strapdown.exceptions import ConfigError, DataError
from strapdown.increments import increments_from_imu
from strapdown.results import AttitudeBench
from strapdown.sensors.rest import find_rests
from strapdown.systems.attitude_judgement import judge_runs, judge_truth, judge_turns, truth_score
from strapdown.systems.attitude_request import (
    as_text,
    as_texts,
    exists,
    sort_references,
    source_spec,
)
from strapdown.systems.attitude_source import describe, read_source, window, with_truth
from strapdown.systems.attitude_start import find_gyro_bias, initial_attitude
from strapdown.tables import GYRO

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

__all__ = ["bench_attitude", "run_bench"]


def _silent(stage: str, share: float) -> None:
    """Report progress to nobody."""


def bench_attitude(
    source: str | Path,
    *,
    algorithms: Sequence[str] = ("naive", "euler", "dcm", "quaternion"),
    reference: Sequence[str] = (),
    initial: str = "auto",
    gyro_bias: str = "none",
    rate: float | None = None,
    sampling: str | None = None,
    seed: int | None = None,
    columns: dict[str, str] | None = None,
    gyro_unit: str | None = None,
    accel_unit: str | None = None,
    time_unit: str | None = None,
    axes: str | None = None,
    repair: bool = False,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: Progress = _silent,
) -> AttitudeBench:
    """Run attitude algorithms over a log or a scenario and compare them with what is known.

    Parameters
    ----------
    source : str or Path
        Name of a scenario (`simulation.SCENARIOS`), or path of a log: a file of a known
        format, or the folder of a known recording.
    algorithms : sequence of str
        Names with options, as in ``quaternion:order=3`` (`attitude.make_algorithm`).
    reference : sequence of str
        Reference points in words (``end same as start``, `evaluation.reference_points`), or
        the path of a file of them, or of an attitude truth.
    initial : str
        ``auto``, ``truth``, ``level``, ``zero``, or ``roll,pitch,heading`` in deg. ``auto`` is
        the truth where there is one, levelled where the log begins at rest, and zero else.
    gyro_bias : str
        ``none``; ``rest``, the mean over the first stationary stretch; three numbers and a
        unit about forward, right, down; or the path of a log of the sensor lying still.
    rate : float, optional, Hz
        Of a scenario (100 if not given), or of a log without a time column.
    sampling : {'instantaneous', 'mean'}, optional
        What a row holds: the rate at its stamp, or its mean over the interval ending there.
    seed : int, optional
        Of a scenario's noise; 0 if not given.
    columns, gyro_unit, accel_unit, time_unit, axes, repair
        How to read a log, as in `formats.recording.ReadOptions`.
    from_s, to_s : float, optional, s
        Use a part of the log.
    progress : callable, optional
        Called with the name of a stage and the share done.

    Returns
    -------
    AttitudeBench
        Attitudes as tables (quaternion; roll, pitch, heading in deg), errors in deg.

    Raises
    ------
    DataError
        The log or a reference cannot be used; the message names file, row and remedy.
    ConfigError
        Something that was asked for is not known, or cannot be had from this log.

    Notes
    -----
    Alexiev (2021). The Earth's rotation is neglected, as in the paper: 15 deg/h.
    """
    words, truth_path = sort_references(as_texts(reference))
    bias = as_text(gyro_bias)
    bias_path = str(Path(bias)) if exists(bias) else None
    spec = specify(
        AttitudeSpec,
        source=source_spec(
            str(source),
            rate,
            seed,
            {
                "columns": columns or None,
                "gyro_unit": gyro_unit,
                "accel_unit": accel_unit,
                "time_unit": time_unit,
                "axes": axes,
                "repair": repair or None,
            },
            sampling,
        ),
        algorithms=tuple(as_texts(algorithms)),
        initial=as_text(initial),
        gyro_bias="log" if bias_path else bias,
        references=words,
        truth_path=truth_path,
        gyro_bias_path=bias_path,
        from_s=from_s,
        to_s=to_s,
    )
    return run_bench(spec, progress)


def run_bench(spec: AttitudeSpec, progress: Progress = _silent) -> AttitudeBench:
    """Run attitude algorithms over a log or a scenario and compare them with what is known.

    Parameters
    ----------
    spec : AttitudeSpec
    progress : callable, optional
        Called with the name of a stage and the share that is done, 0 to 1.

    Returns
    -------
    AttitudeBench

    Raises
    ------
    DataError
        The log or a reference cannot be used.
    ConfigError
        Something that was asked for is not known, or cannot be had from this log.
    """
    algorithms = [make_algorithm(text) for text in spec.algorithms]
    if not algorithms:
        raise ConfigError("none is named", quantity="algorithms", remedy="name at least one")
    if len({a.label for a in algorithms}) < len(algorithms):
        raise ConfigError(
            f"one is named twice: {', '.join(a.label for a in algorithms)}",
            quantity="algorithms",
            remedy="name each once, or give it different options",
        )
    progress("reading", 0.0)
    source = read_source(spec)
    whole = source.imu
    source = replace(source, imu=window(whole, spec.from_s, spec.to_s, source.name))
    source = with_truth(source, spec)
    rests = find_rests(source.imu)
    bias, bias_input = find_gyro_bias(spec, source, rests)
    findings = list(source.findings)
    imu = source.imu
    if bias["rad_per_s"] is not None:
        imu = imu.copy()
        imu[GYRO] = imu[GYRO].to_numpy() - np.asarray(bias["rad_per_s"])
    q_nb, initial, begin = initial_attitude(spec.initial, source, rests, findings)
    imu = imu[imu.index >= begin]
    if len(imu) < 2:
        raise DataError(
            f"fewer than two samples are left from {begin:.9g} s, where the attitude is known",
            file=source.name,
            remedy="give another --initial",
        )
    increments = increments_from_imu(imu)
    runs = []
    for k, algorithm in enumerate(algorithms):
        progress(algorithm.title, (k + 0.5) / (len(algorithms) + 1.0))
        runs.append(run_attitude(algorithm, increments, q_nb))
    progress("comparing", 0.9)
    span = (float(imu.index[0]), float(imu.index[-1]))
    references = references_from_words(list(spec.references), *span)
    scores = [s for run in runs for s in truth_score(run, source)]
    scores += [s for run in runs for s in score_references(run, references, imu)]
    findings += judge_runs(runs, increments)
    findings += judge_turns(scores)
    findings += judge_truth(source, span)
    truth, scored = source.truth, source.scored
    if truth is not None and scored is not None:
        inside = np.asarray((truth.index >= span[0]) & (truth.index <= span[1]))
        truth, scored = truth[inside], scored[inside]
    return AttitudeBench(
        source=source.name,
        description=describe(source.imu, source.what, whole),
        specification=spec.model_dump(mode="json"),
        imu=imu,
        runs=tuple(runs),
        truth=truth,
        scored=scored,
        scores=tuple(scores),
        sampling_error_deg=source.sampling_error_deg,
        differences_deg=largest_differences(tuple(runs)),
        rests=rests,
        initial=initial,
        gyro_bias=bias,
        references=references,
        readings=source.readings,
        findings=tuple(findings),
        inputs=source.inputs + bias_input,
    )
