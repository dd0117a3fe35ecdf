"""Results compared from Python: folders, configurations, and runs in memory."""

from __future__ import annotations

from pathlib import Path

from strapdown.errors import ConfigError
from strapdown.progress import Progress, silent
from strapdown.report.compare import RunComparison as RunComparison
from strapdown.report.compare import Saved, compare_results


def compare_runs(*runs: str | Path | Saved, progress: Progress = silent) -> RunComparison:
    """Compare results: what differs in options, inputs and numbers, and over time.

    Parameters
    ----------
    *runs : str, Path or run
        Two or more: folders that runs wrote, of any command; configurations of `navigate`, `align`
        or `reconstruct` (``.toml``), which are run first; or runs in memory, as of `navigate`,
        named by their index (``run 1``). Differences are against the first.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    RunComparison
        Runs that were made for it are kept by `save` alone.

    Raises
    ------
    ConfigError
        Fewer than two runs are given, one is given twice, a configuration is faulty, or runs of
        different commands have no option and no input in common.
    DataError
        A folder is not a result, its files are damaged, or it has symbolic links. A result that was
        changed after it was sealed is compared, and `RunComparison.findings` say so.

    Examples
    --------
    >>> both = sd.compare_runs("drive-a", "drive-b")  # doctest: +SKIP
    >>> both.options, both.to_pandas(), both.differences[0].scores  # doctest: +SKIP
    """
    for run in runs:
        if not isinstance(run, str | Path) and not hasattr(run, "save"):
            raise ConfigError("compare.no-run", quantity="runs", shown=type(run).__name__)
    return compare_results(runs, progress)
