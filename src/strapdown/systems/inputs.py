"""Inputs of a run: the files that it reads, and the part of a log that it uses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.bundle.seal import sha256
from strapdown.errors import ConfigError
from strapdown.results.inputs import InputFiles
from strapdown.sensors.catalogue import SENSORS

__all__ = ["check_part", "input_files", "part_of_log", "sensor_file"]


def check_part(from_s: float | None, to_s: float | None, duration_s: float | None) -> None:
    """Refuse an invalid part.

    Parameters
    ----------
    from_s, to_s, duration_s : float or None, s

    Raises
    ------
    ConfigError
        Both end and duration are given, it ends before it begins, or a value is not finite.
    """
    for flag, value in (("--from", from_s), ("--to", to_s), ("--duration", duration_s)):
        if value is not None and not np.isfinite(value):
            raise ConfigError("io.part-not-finite", quantity=flag, value=value)
    if to_s is not None and duration_s is not None:
        raise ConfigError(
            "io.part-ends-twice",
            quantity="--to, --duration",
            to_s=to_s,
            duration_s=duration_s,
        )
    if duration_s is not None and not duration_s > 0.0:
        raise ConfigError(
            "io.part-duration-not-positive", quantity="--duration", duration_s=duration_s
        )
    if from_s is not None and to_s is not None and not from_s < to_s:
        raise ConfigError(
            "io.part-ends-before-it-begins", quantity="--to", to_s=to_s, from_s=from_s
        )


def part_of_log(
    imu: pd.DataFrame,
    from_s: float | None,
    to_s: float | None,
    duration_s: float | None,
    name: str,
) -> pd.DataFrame:
    """Return the samples between two instants, both included.

    Parameters
    ----------
    imu : DataFrame
        Imu table.
    from_s, to_s : float or None, s
        On the log's own clock; its first and its last stamp, where they are not given.
    duration_s : float or None, s
        Duration from `from_s`, or from the first stamp, instead of `to_s`.
    name : str
        Of the log, for messages.

    Returns
    -------
    DataFrame
        The same table if all of it is used.

    Raises
    ------
    ConfigError
        Fewer than two samples lie between them, or as `check_part`.
    """
    check_part(from_s, to_s, duration_s)
    time = imu.index.to_numpy(dtype=np.float64)
    first = float(time[0]) if from_s is None else from_s
    last = float(time[-1]) if to_s is None else to_s
    if duration_s is not None:
        last = first + duration_s
    # A stamp that is a sum of steps may miss the instant by rounding.
    slack = 1e-6 * float(np.median(np.diff(time)))
    kept = (time >= first - slack) & (time <= last + slack)
    if kept.sum() < 2:
        ends = to_s is not None or duration_s is not None
        raise ConfigError(
            "io.part-between"
            if from_s is not None and ends
            else "io.part-up-to"
            if ends
            else "io.part-from",
            file=name,
            quantity="time",
            kept=int(kept.sum()),
            from_s=first,
            to_s=last,
            time=time[0],
            time_2=time[-1],
        )
    if kept.all():
        return imu
    out = imu[kept]
    out.attrs = dict(imu.attrs)
    if out.attrs.get("first_row") is not None:
        out.attrs["first_row"] += int(np.argmax(kept))
    return out


def input_files(role: str, path: str, files: tuple[Path, ...]) -> InputFiles:
    """List files read in a role, with their present digests."""
    return InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))


def sensor_file(sensor: str | None) -> tuple[InputFiles, ...]:
    """Return the file of a sensor that is not from the catalogue."""
    if sensor is None or sensor.lower() in SENSORS:
        return ()
    return (input_files("sensor", sensor, (Path(sensor),)),)
