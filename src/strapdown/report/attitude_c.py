"""The algorithm that a bench chose, as a C file."""

from __future__ import annotations

from pathlib import Path

from strapdown.attitude import make_algorithm
from strapdown.errors import ConfigError
from strapdown.export_c import export_c
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.tables import GYRO, QUATERNION

# What an embedded test needs: a second or so of motion, in a file that can still be read.
VECTOR = 64


def check_c(path: Path | None, force: bool) -> None:
    """Refuse a path that cannot be written, before anything is run.

    Raises
    ------
    ConfigError
        It is no name of a C file, it exists and may not be replaced, or its folder does not.
    """
    if path is None:
        return
    if path.suffix.lower() not in (".c", ".h"):
        # What --force replaces might else be the log itself.
        raise ConfigError("report.no-name-c-file", file=str(path), quantity="--export-c")
    if path.is_dir() or (path.exists() and not force):
        raise ConfigError("report.already", file=str(path), quantity="--export-c")
    if not path.parent.is_dir():
        raise ConfigError("report.no-such-folder", file=str(path.parent), quantity="--export-c")


def chosen_for_c(bench: AttitudeBench) -> str:
    """Return the algorithm to export: the one that the answer names, or else the only one.

    Raises
    ------
    ConfigError
        The answer names none and there are several.
    """
    labels = [run.algorithm for run in bench.runs]
    chosen = labels[0] if len(labels) == 1 else bench.answer.algorithm
    if chosen is None:
        raise ConfigError("report.no-algorithm-accurate-enough-chosen", quantity="--export-c")
    return chosen


def write_c(bench: AttitudeBench, path: Path, *, force: bool = False) -> str:
    """Write one algorithm of a bench as C99, with a test vector of its log.

    Parameters
    ----------
    bench : AttitudeBench
    path : Path
        File to write.
    force : bool
        Replace a file that is there.

    Returns
    -------
    str
        The algorithm: the one that the answer names, or else the only one.

    Raises
    ------
    ConfigError
        The answer names none and there are several, or the file may not be written.
    """
    check_c(path, force)
    chosen = chosen_for_c(bench)
    first = bench.runs[0].attitude[QUATERNION].to_numpy()
    start = _liveliest(bench)
    text = export_c(
        make_algorithm(chosen),
        interpolation=str(bench.specification["interpolation"]),
        q_nb=first[start],
        imu=bench.imu.iloc[start : start + VECTOR],
    )
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8", newline="\n")
    partial.replace(path)
    return chosen


def _liveliest(bench: AttitudeBench) -> int:
    """Where the stretch of the test vector turns most: one at rest would test nothing."""
    rate = bench.imu[GYRO].to_numpy()
    energy = (rate * rate).sum(axis=1).cumsum()
    if len(energy) <= VECTOR:
        return 0
    return int((energy[VECTOR:] - energy[:-VECTOR]).argmax())
