"""System A, Alexiev (2021): attitude algorithms on one log, and how far they can be trusted."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.levelling import level
from strapdown.attitude import Quaternion, make_algorithm, run_attitude
from strapdown.bundle import sha256
from strapdown.config import AttitudeSpec, LogSpec, ScenarioSpec, specify
from strapdown.constants import GYRO_UNITS
from strapdown.evaluation.differences import attitude_at, error_angles, largest_differences
from strapdown.evaluation.reference_points import references_from_words, score_references
from strapdown.exceptions import ConfigError, DataError, Finding
from strapdown.formats import read_log
from strapdown.formats.columns import parse_unit
from strapdown.formats.recording import Origin, ReadOptions
from strapdown.formats.references import read_reference_words, read_truth
from strapdown.increments import increments_from_imu
from strapdown.results import AttitudeBench, AttitudeRun, InputFiles, Reading, RestStretch, Score
from strapdown.sensors.rest import find_rests
from strapdown.simulation import SCENARIOS, GyroErrors, find_scenario, simulate_gyro
from strapdown.tables import GYRO, QUATERNION, THETA, find_gaps

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

__all__ = ["bench_attitude", "run_bench", "simulate_scenario"]

# Within this of ±90° of pitch the kinematics of Euler angles amplify every error tenfold.
NEAR_POLE = 5.7  # deg: 1/cos = 10
# A step that turns by more than this says little of what happened within it.
LARGE_STEP = 0.5  # rad


def _silent(stage: str, share: float) -> None:
    """Report progress to nobody."""


@dataclass(frozen=True)
class _Source:
    """A log or a scenario, read."""

    name: str
    what: str
    origin: Origin
    imu: pd.DataFrame
    truth: pd.DataFrame | None
    scored: NDArray[np.bool_] | None
    readings: tuple[Reading, ...]
    findings: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...]
    sampling_error_deg: tuple[float, float] | None


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
    words, truth_path = _references(_as_texts(reference))
    bias = _as_text(gyro_bias)
    bias_path = str(Path(bias)) if _exists(bias) else None
    spec = specify(
        AttitudeSpec,
        source=_source_spec(
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
        algorithms=tuple(_as_texts(algorithms)),
        initial=_as_text(initial),
        gyro_bias="log" if bias_path else bias,
        references=words,
        truth_path=truth_path,
        gyro_bias_path=bias_path,
        from_s=from_s,
        to_s=to_s,
    )
    return run_bench(spec, progress)


def _as_text(value: object) -> str:
    """A text as it is; three numbers as the text that means them."""
    if isinstance(value, str | Path):
        return str(value).strip()
    return ",".join(str(v) for v in np.asarray(value).ravel().tolist())


def _as_texts(values: object) -> list[str]:
    """One text or many, or none."""
    if values is None:
        return []
    if isinstance(values, str | Path):
        return [str(values)]
    return [str(v) for v in values] if isinstance(values, Iterable) else [str(values)]


def _source_spec(
    text: str, rate: float | None, seed: int | None, reading: dict[str, Any], sampling: str | None
) -> ScenarioSpec | LogSpec:
    name = text.strip().lower()
    if not name:
        raise ConfigError("nothing is named", quantity="source", remedy="name a log or a scenario")
    if name in SCENARIOS:
        if given := [key for key, value in reading.items() if value is not None]:
            raise ConfigError(
                f"{', '.join(given)}: a scenario is not read from a file",
                quantity=name,
                remedy="leave that out",
            )
        return specify(
            ScenarioSpec,
            name=name,
            rate_hz=100.0 if rate is None else rate,
            sampling=(sampling or "instantaneous").lower(),
            seed=0 if seed is None else seed,
        )
    if seed is not None:
        raise ConfigError(
            "a recorded log has no noise to be drawn", quantity="seed", remedy="leave it out"
        )
    if not _exists(text) and not Path(text).suffix and len(Path(text).parts) == 1:
        find_scenario(name)  # says which names there are
    said = {key: value for key, value in reading.items() if value is not None}
    return specify(LogSpec, path=str(Path(text)), sampling=sampling, rate_hz=rate, **said)


def _exists(text: str) -> bool:
    """Tell whether a text is the path of something; sentences and odd characters are not."""
    if text in ("", "none", "rest"):
        return False
    try:
        return Path(text).exists()
    except (OSError, ValueError):
        return False


def _references(items: Sequence[str]) -> tuple[tuple[str, ...], str | None]:
    """Sort references into sentences and the path of a truth."""
    words: list[str] = []
    truth: str | None = None
    for item in items:
        path = Path(item)
        if not _exists(item):
            if " " not in item.strip() and path.suffix:
                raise ConfigError(
                    "there is no such file",
                    file=item,
                    quantity="reference",
                    remedy="check the path, or say it in words: 'end same as start'",
                )
            words.append(item)
        elif path.is_dir():
            raise ConfigError(
                "it is a folder",
                file=item,
                quantity="reference",
                remedy="name one file",
            )
        elif (listed := read_reference_words(path)) is not None:
            words += listed
        elif truth is None:
            truth = str(path)
        else:
            raise ConfigError(
                f"two attitude truths were given: {truth} and {item}",
                quantity="reference",
                remedy="give one; reference points may be as many as you like",
            )
    return tuple(words), truth


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
    source = _read(spec)
    whole = source.imu
    source = replace(source, imu=_window(whole, spec.from_s, spec.to_s, source.name))
    source = _with_truth(source, spec)
    rests = find_rests(source.imu)
    bias, bias_input = _gyro_bias(spec, source, rests)
    findings = list(source.findings)
    imu = source.imu
    if bias["rad_per_s"] is not None:
        imu = imu.copy()
        imu[GYRO] = imu[GYRO].to_numpy() - np.asarray(bias["rad_per_s"])
    q_nb, initial, begin = _initial(spec.initial, source, rests, findings)
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
    scores = [s for run in runs for s in _truth_score(run, source)]
    scores += [s for run in runs for s in score_references(run, references, imu)]
    findings += _judge(runs, increments)
    findings += _judge_turns(scores)
    findings += _judge_truth(source, span)
    truth, scored = source.truth, source.scored
    if truth is not None and scored is not None:
        inside = np.asarray((truth.index >= span[0]) & (truth.index <= span[1]))
        truth, scored = truth[inside], scored[inside]
    return AttitudeBench(
        source=source.name,
        description=_describe(source.imu, source.what, whole),
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


# --- the log ----------------------------------------------------------------------------


def simulate_scenario(spec: ScenarioSpec) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the samples of a scenario and its exact attitude.

    Parameters
    ----------
    spec : ScenarioSpec

    Returns
    -------
    imu, truth : DataFrame
        Imu and Attitude tables on the same stamps.

    Raises
    ------
    ConfigError
        The scenario, the rate or the sampling is unknown.
    """
    scenario = find_scenario(spec.name)
    return simulate_gyro(
        scenario.motion,
        scenario.errors,
        rate=spec.rate_hz,
        sampling=spec.sampling,
        seed=spec.seed,
        source=spec.name,
    )


def read_options(spec: LogSpec) -> ReadOptions:
    """Return what a specification says about reading its log."""
    return ReadOptions(
        columns=dict(spec.columns),
        gyro_unit=spec.gyro_unit,
        accel_unit=spec.accel_unit,
        time_unit=spec.time_unit,
        axes=spec.axes,
        sampling=spec.sampling,
        rate=spec.rate_hz,
        repair=spec.repair,
    )


def _read(spec: AttitudeSpec) -> _Source:
    if isinstance(spec.source, ScenarioSpec):
        return _scenario(spec.source)
    recording = read_log(spec.source.path, read_options(spec.source))
    inputs = (_input("log", spec.source.path, recording.files),)
    return _Source(
        recording.name,
        "recorded log",
        recording.origin,
        recording.imu,
        recording.truth,
        recording.scored,
        recording.readings,
        recording.findings,
        inputs,
        None,
    )


def _input(role: str, path: str, files: tuple[Path, ...]) -> InputFiles:
    return InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))


def _scenario(spec: ScenarioSpec) -> _Source:
    scenario = find_scenario(spec.name)
    imu, truth = simulate_scenario(spec)
    clean, _ = simulate_gyro(
        scenario.motion, GyroErrors(), rate=spec.rate_hz, sampling=spec.sampling
    )
    exact = run_attitude(Quaternion(), increments_from_imu(clean), truth[QUATERNION].to_numpy()[0])
    lost = error_angles(exact.attitude, truth)
    return _Source(
        spec.name,
        f"simulated: {scenario.title} (Alexiev 2021, {scenario.origin})",
        Origin(0, "s"),
        imu,
        truth,
        np.ones(len(truth), dtype=bool),
        (),
        (),
        (),
        (float(lost.iloc[-1]), float(lost.max())),
    )


def _describe(imu: pd.DataFrame, what: str, whole: pd.DataFrame) -> str:
    length = float(imu.index[-1] - imu.index[0])
    rate = (len(imu) - 1) / length
    kind = {
        "instantaneous": "rates at the instant of each stamp",
        "mean": "mean rates over the interval that ends at each stamp",
    }[imu.attrs["sampling"]]
    text = f"{what}; {len(imu)} samples in {length:.4g} s, {rate:.4g} Hz on average; {kind}"
    if len(imu) < len(whole):
        text += (
            f"; the part from {imu.index[0]:.6g} to {imu.index[-1]:.6g} s of one from "
            f"{whole.index[0]:.6g} to {whole.index[-1]:.6g} s"
        )
    return text


def _with_truth(source: _Source, spec: AttitudeSpec) -> _Source:
    """The source with the truth that was given, on its own clock and within its window."""
    if spec.truth_path is None:
        if source.truth is None or source.scored is None:
            return source
        start, end = source.imu.index[0], source.imu.index[-1]
        inside = np.asarray((source.truth.index >= start) & (source.truth.index <= end))
        if not inside.any():
            return replace(source, truth=None, scored=None)
        return replace(source, truth=source.truth[inside], scored=source.scored[inside])
    path = Path(spec.truth_path)
    options = read_options(spec.source) if isinstance(spec.source, LogSpec) else None
    truth = read_truth(path, options, source.origin)
    inside = np.asarray(
        (truth.index >= source.imu.index[0]) & (truth.index <= source.imu.index[-1])
    )
    if inside.sum() < 2:
        log = source.imu.index
        raise DataError(
            f"{int(inside.sum())} of its instants lie within the log: it runs from "
            f"{truth.index[0]:.9g} to {truth.index[-1]:.9g} s, and the log from {log[0]:.9g} to "
            f"{log[-1]:.9g} s",
            file=path.name,
            quantity="time",
            remedy="bring both to one clock",
        )
    return replace(
        source,
        truth=truth[inside],
        scored=np.ones(int(inside.sum()), dtype=bool),
        inputs=(*source.inputs, _input("truth", spec.truth_path, (path,))),
    )


def _window(imu: pd.DataFrame, from_s: float | None, to_s: float | None, name: str) -> pd.DataFrame:
    start = imu.index[0] if from_s is None else from_s
    end = imu.index[-1] if to_s is None else to_s
    part = imu[(imu.index >= start) & (imu.index <= end)]
    if len(part) < 2:
        raise ConfigError(
            f"{len(part)} samples lie between {start:.9g} and {end:.9g} s; the log runs from "
            f"{imu.index[0]:.9g} to {imu.index[-1]:.9g} s",
            file=name,
            quantity="--from, --to",
            remedy="choose a window within the log",
        )
    return part


# --- bias and initial attitude ----------------------------------------------------------


def _gyro_bias(
    spec: AttitudeSpec, source: _Source, rests: tuple[RestStretch, ...]
) -> tuple[dict[str, Any], tuple[InputFiles, ...]]:
    if spec.gyro_bias_path is not None:
        options = read_options(spec.source) if isinstance(spec.source, LogSpec) else None
        other = read_log(spec.gyro_bias_path, options)
        found = find_rests(other.imu)
        if not found:
            raise DataError(
                "no stationary stretch of a second or more was found in it",
                file=other.name,
                quantity="gyro bias",
                remedy="give a log of the sensor lying still, or the bias itself",
            )
        longest = max(found, key=lambda r: r.end - r.start)
        files = _input("gyro-bias", spec.gyro_bias_path, other.files)
        return _bias_of(longest, f"{longest.end - longest.start:.4g} s of rest in {other.name}"), (
            files,
        )
    choice = spec.gyro_bias.lower()
    if choice == "none":
        return {"rad_per_s": None, "from": "not removed: nothing was asked for"}, ()
    if choice == "rest":
        if not rests:
            raise DataError(
                "no stationary stretch of a second or more was found",
                file=source.name,
                quantity="gyro bias",
                remedy="give the bias itself, as in --gyro-bias '4.5,0.1,1.1 deg/s', or a log of "
                "the sensor lying still",
            )
        first = rests[0]
        return _bias_of(first, f"mean over the rest {first.start:.3f}–{first.end:.3f} s"), ()
    numbers, unit = _stated_bias(spec.gyro_bias)
    bias = [v * GYRO_UNITS[unit] for v in numbers]
    return {"rad_per_s": bias, "from": f"stated: {spec.gyro_bias}"}, ()


def _bias_of(rest: RestStretch, where: str) -> dict[str, Any]:
    return {"rad_per_s": list(rest.gyro_mean), "from": where}


def _stated_bias(text: str) -> tuple[list[float], str]:
    match = re.fullmatch(r"([^,]+),([^,]+),\s*([+-]?[\d.]+(?:e[+-]?\d+)?)\s*(\D.*)?", text, re.I)
    try:
        if match is None:
            raise ValueError
        numbers = [float(match.group(k)) for k in (1, 2, 3)]
        if not np.isfinite(numbers).all():
            raise ValueError
    except ValueError:
        raise ConfigError(
            f"'{text}' is no bias",
            quantity="--gyro-bias",
            remedy="give none, rest, three numbers and a unit about the body's forward, right and "
            "down axis ('-4.5,-0.1,-1.1 deg/s'), or a log of the sensor lying still",
        ) from None
    return numbers, parse_unit((match.group(4) or "rad/s").strip(), "gyro")


def _initial(
    text: str, source: _Source, rests: tuple[RestStretch, ...], findings: list[Finding]
) -> tuple[Array, dict[str, Any], float]:
    """Attitude at the start of the run, in words, and where the run starts."""
    start = float(source.imu.index[0])
    at_rest = bool(rests) and rests[0].start - start <= 1.0 and rests[0].accel_mean is not None
    choice = text.strip().lower()
    if choice == "auto":
        choice = "truth" if source.truth is not None else "level" if at_rest else "zero"
        how = {
            "truth": "from the truth",
            "level": "levelled; heading zero, because nothing says what it is",
            "zero": "zero, because none was given and the log does not begin at rest with an "
            "accelerometer",
        }[choice]
    else:
        how = {"truth": "from the truth", "level": "levelled; heading zero", "zero": "zero"}.get(
            choice, "given"
        )
    if choice == "truth":
        q_nb, begin = _first_truth(source, start)
    elif choice == "level":
        q_nb, begin = _levelled(source, rests, at_rest, findings), start
    elif choice == "zero":
        q_nb, begin = np.array([1.0, 0.0, 0.0, 0.0]), start
    else:
        q_nb, begin = rotation.quaternion_from_euler(_three_angles(text)), start
    roll, pitch, heading = (float(a) for a in rotation.euler_from_quaternion(q_nb))
    words = {
        "roll_deg": roll,
        "pitch_deg": pitch,
        "heading_deg": heading,
        "time_s": begin,
        "from": how,
    }
    return q_nb, words, begin


def _first_truth(source: _Source, start: float) -> tuple[Array, float]:
    if source.truth is None:
        raise ConfigError(
            "the log has no truth to take it from",
            file=source.name,
            quantity="--initial",
            remedy="give --reference TRUTH.csv, or use level, zero or 'roll,pitch,heading'",
        )
    stamps = source.imu.index.to_numpy(dtype=np.float64)
    known = source.truth.index.to_numpy(dtype=np.float64)
    before = np.searchsorted(known, stamps, side="right") - 1
    after = np.minimum(np.searchsorted(known, stamps), known.size - 1)
    apart = np.where(before >= 0, known[after] - known[before], np.inf)
    # Across a hole in the truth nothing is known; a sample needs it at hand on both sides.
    usual = 3.0 * float(np.median(np.diff(known))) if known.size > 1 else 0.0
    good = np.flatnonzero((apart >= 0.0) & (apart <= usual))
    if not good.size:
        raise ConfigError(
            f"the truth is nowhere known at a sample between {stamps[0]:.9g} and "
            f"{stamps[-1]:.9g} s",
            file=source.name,
            quantity="--initial",
            remedy="use level, zero or 'roll,pitch,heading', or another window",
        )
    begin = float(stamps[good[0]])
    return attitude_at(source.truth, [begin])[0], begin


def _levelled(
    source: _Source, rests: tuple[RestStretch, ...], at_rest: bool, findings: list[Finding]
) -> Array:
    if not at_rest:
        raise ConfigError(
            "levelling needs an accelerometer and a log that begins at rest",
            file=source.name,
            quantity="--initial",
            remedy="begin at a rest with --from, or give 'roll,pitch,heading' in deg",
        )
    assert rests[0].accel_mean is not None
    roll, pitch = level(rests[0].accel_mean)
    if abs(roll) > 90.0:
        findings.append(
            Finding(
                f"levelled upside down (roll {roll:.1f}°)",
                file=source.name,
                quantity="accel",
                remedy="if it lay the right way up, its acceleration has the other sign, as on "
                "iOS: state the unit as --accel-unit -g or -m/s2",
            )
        )
    return rotation.quaternion_from_euler([roll, pitch, 0.0])


def _three_angles(text: str) -> list[float]:
    try:
        angles = [float(part) for part in text.split(",")]
    except ValueError:
        angles = []
    if len(angles) != 3 or not (np.abs(angles) <= 1e6).all():
        raise ConfigError(
            f"'{text}' is no attitude",
            quantity="--initial",
            remedy="use truth, level, zero, or roll,pitch,heading in degrees, as in 0,0,90",
        )
    return angles


# --- judging ----------------------------------------------------------------------------


def _how_near(run: AttitudeRun) -> str:
    near = run.diagnostics["closest_to_pole_deg"]
    return f"came within {near:.3g}° of" if near else "passed through"


def passed_pole(run: AttitudeRun) -> bool:
    """Tell whether a run came so near ±90° of pitch that its angles are not to be trusted."""
    return run.diagnostics.get("closest_to_pole_deg", 90.0) < NEAR_POLE


def _truth_score(run: AttitudeRun, source: _Source) -> list[Score]:
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


def _judge_turns(scores: list[Score]) -> list[Finding]:
    """Say where the turns that were stated are not those that the gyro saw."""
    findings = {}
    for score in scores:
        if score.turned_deg is None or score.expected_deg is None:
            continue
        off = (score.turned_deg - score.expected_deg) / 360.0
        if abs(off) > 0.5:
            findings[score.against] = Finding(
                f"'{score.against}' says {score.expected_deg / 360.0:g} turns, and the gyro turned "
                f"{score.turned_deg / 360.0:.2f}",
                quantity="reference",
                remedy="check the sign (right-handed about the axis named), the number and the "
                "axis; the error angle does not tell whole turns apart",
            )
    return list(findings.values())


def _judge_truth(source: _Source, span: tuple[float, float]) -> list[Finding]:
    """Say where the truth tells of a small part of the log only."""
    if source.truth is None or source.scored is None or not source.scored.any():
        return []
    counted = source.truth.index[source.scored]
    covered = float(counted[-1] - counted[0])
    if covered >= 0.5 * (span[1] - span[0]):
        return []
    return [
        Finding(
            f"it covers {covered:.4g} of {span[1] - span[0]:.4g} s; of the rest nothing is known",
            file=source.name,
            quantity="truth",
        )
    ]


def _judge(runs: list[AttitudeRun], increments: pd.DataFrame) -> list[Finding]:
    findings = []
    for run in runs:
        if passed_pole(run):
            findings.append(
                Finding(
                    f"{_how_near(run)} ±90° pitch at "
                    f"{run.diagnostics['closest_to_pole_time_s']:.6g} s, where its equations "
                    "divide by zero; what it says from there on is not to be trusted",
                    quantity=run.algorithm,
                    remedy="use dcm or quaternion, which have no such place",
                )
            )
    turn = np.sqrt((increments[THETA].to_numpy() ** 2).sum(axis=1))
    # Gaps have been reported when the log was read.
    turn[[gap.sample - 1 for gap in find_gaps(runs[0].attitude.index)]] = 0.0
    largest = int(turn.argmax())
    if turn[largest] > LARGE_STEP:
        findings.append(
            Finding(
                f"a single step turns by {np.degrees(turn[largest]):.3g}° (at "
                f"{increments.index[largest]:.6g} s): the rate says little of what happened "
                "within it",
                quantity="gyro",
                remedy="use a higher rate",
            )
        )
    return findings
