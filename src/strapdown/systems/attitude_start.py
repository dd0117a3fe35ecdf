"""Where a run of the attitude bench starts, and what is taken off its rates."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.levelling import level
from strapdown.config import AttitudeSpec, LogSpec
from strapdown.constants import GYRO_SUMS, GYRO_UNITS
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.evaluation.known import known_at
from strapdown.formats import read_log
from strapdown.formats.unit_words import factor_of, parse_unit
from strapdown.results.inputs import InputFiles
from strapdown.results.rests import RestStretch
from strapdown.sensors.rest import find_rests
from strapdown.sensors.rest_bias import gyro_bias_from_rests, without_gyro_bias
from strapdown.systems.attitude_source import Source, input_files, read_options
from strapdown.tables import GYRO

Array = NDArray[np.float64]


def find_gyro_bias(
    spec: AttitudeSpec, source: Source, rests: tuple[RestStretch, ...]
) -> tuple[dict[str, Any], tuple[InputFiles, ...]]:
    """Find what is to be taken off the rates.

    Parameters
    ----------
    spec : AttitudeSpec
    source : Source
    rests : tuple of RestStretch

    Returns
    -------
    bias : dict
        ``rad_per_s`` about forward, right, down, or None; ``from``, in words.
    inputs : tuple of InputFiles
        Files that it was taken from.

    Raises
    ------
    DataError
        There is no rest to take it from.
    ConfigError
        It was not understood.
    """
    if spec.gyro_bias_path is not None:
        options = read_options(spec.source) if isinstance(spec.source, LogSpec) else None
        other = read_log(spec.gyro_bias_path, options)
        found = find_rests(other.imu)
        if not found:
            raise DataError(
                "attitude.no-stationary-stretch-second-or", file=other.name, quantity="gyro bias"
            )
        longest = max(found, key=lambda r: r.end - r.start)
        files = input_files("gyro-bias", spec.gyro_bias_path, other.files)
        return _bias_of(longest, f"{longest.end - longest.start:.4g} s of rest in {other.name}"), (
            files,
        )
    choice = spec.gyro_bias.lower()
    if choice == "none":
        return {"rad_per_s": None, "from": "not removed: nothing was asked for"}, ()
    if choice in ("rest", "rests"):
        if not rests:
            raise DataError(
                "attitude.no-stationary-stretch-second-or-2", file=source.name, quantity="gyro bias"
            )
        if choice == "rests" and len(rests) > 1:
            course = gyro_bias_from_rests(rests)
            where = (
                f"course over {len(rests)} rests from {rests[0].start:.3f} to "
                f"{rests[-1].end:.3f} s, straight between them; shown: their average"
            )
            return {"rad_per_s": list(course.average), "from": where}, ()
        first = rests[0]
        return _bias_of(first, f"mean over the rest {first.start:.3f}–{first.end:.3f} s"), ()
    numbers, unit = _stated_bias(spec.gyro_bias)
    bias = [v * factor_of(unit, GYRO_UNITS) for v in numbers]
    return {"rad_per_s": bias, "from": f"stated: {spec.gyro_bias}"}, ()


def without_bias(
    spec: AttitudeSpec, imu: pd.DataFrame, bias: dict[str, Any], rests: tuple[RestStretch, ...]
) -> pd.DataFrame:
    """Take a bias that was found off the rates of a log.

    Parameters
    ----------
    spec : AttitudeSpec
    imu : DataFrame
        An Imu table; it is not changed.
    bias : dict
        From `find_gyro_bias`.
    rests : tuple of RestStretch

    Returns
    -------
    DataFrame
    """
    if bias["rad_per_s"] is None:
        return imu
    if spec.gyro_bias.lower() == "rests" and len(rests) > 1:
        return without_gyro_bias(imu, gyro_bias_from_rests(rests))
    less = imu.copy()
    less[GYRO] = imu[GYRO].to_numpy() - np.asarray(bias["rad_per_s"])
    return less


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
        raise ConfigError("attitude.no-bias", quantity="--gyro-bias", text=text) from None
    unit = parse_unit((match.group(4) or "rad/s").strip(), "gyro")
    if unit in GYRO_SUMS:
        raise ConfigError(
            "attitude.increment-bias-rate", quantity="--gyro-bias", unit=unit, gyro_units=GYRO_UNITS
        )
    return numbers, unit


def initial_attitude(
    text: str, source: Source, rests: tuple[RestStretch, ...], findings: list[Finding]
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
        "method": choice if choice in ("truth", "level", "zero") else "given",
    }
    return q_nb, words, begin


def _first_truth(source: Source, start: float) -> tuple[Array, float]:
    if source.truth is None:
        raise ConfigError("attitude.log-no-truth-take", file=source.name, quantity="--initial")
    stamps = source.imu.index.to_numpy(dtype=np.float64)
    # Scored or not, an attitude that is known is one to start from.
    known = known_at(source.truth, np.ones(len(source.truth), dtype=bool), stamps)
    good = np.flatnonzero(known.counts)
    if not good.size:
        raise ConfigError(
            "attitude.truth-nowhere-known-sample-between",
            file=source.name,
            quantity="--initial",
            stamps=stamps[0],
            stamps_2=stamps[-1],
        )
    begin = float(stamps[good[0]])
    return known.q_nb[good[0]], begin


def _levelled(
    source: Source, rests: tuple[RestStretch, ...], at_rest: bool, findings: list[Finding]
) -> Array:
    if not at_rest:
        raise ConfigError(
            "attitude.levelling-needs-accelerometer-log-begins",
            file=source.name,
            quantity="--initial",
        )
    assert rests[0].accel_mean is not None
    roll, pitch = level(rests[0].accel_mean)
    if abs(roll) > 90.0:
        findings.append(
            Finding(
                "attitude.levelled-upside-down-roll", file=source.name, quantity="accel", roll=roll
            )
        )
    return rotation.quaternion_from_euler([roll, pitch, 0.0])


def _three_angles(text: str) -> list[float]:
    try:
        angles = [float(part) for part in text.split(",")]
    except ValueError:
        angles = []
    if len(angles) != 3 or not (np.abs(angles) <= 1e6).all():
        raise ConfigError("attitude.no-attitude", quantity="--initial", text=text)
    return angles
