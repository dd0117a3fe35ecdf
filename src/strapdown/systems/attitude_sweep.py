"""The same log at lower rates, by leaving samples out and by summing increments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.attitude import AttitudeAlgorithm, attitude_history
from strapdown.attitude.algorithm import Steps, steps_of
from strapdown.errors import ConfigError, DivergenceError, Finding
from strapdown.evaluation.known import Errors, Known
from strapdown.evaluation.reference_points import reference_errors
from strapdown.increments import increments_from_imu
from strapdown.systems.attitude_shares import OwnTruth
from strapdown.systems.progress import Progress
from strapdown.tables import DTHETA, QUATERNION, THETA, increments_table

Array = NDArray[np.float64]

MEANINGS = ("drop", "sum")
COLUMNS = [
    *("algorithm", "meaning", "factor", "rate_hz", "own_deg", "final_deg", "rms_deg"),
    *("max_deg", "reference_deg", "error_deg"),
]
# Halved as long as there is something left to judge.
FACTORS = (1, 2, 4, 8, 16, 32)
LEAST_STEPS = 20


@dataclass(frozen=True)
class Grounds:
    """What every cell of a sweep is judged on.

    Attributes
    ----------
    imu : DataFrame
        The samples as used, at the full rate.
    q_nb : ndarray, (4,)
        Attitude at the start.
    own : OwnTruth
    truth : Known or None
    references : DataFrame
        A References table.
    interpolation : str
    """

    imu: pd.DataFrame
    q_nb: Array
    own: OwnTruth
    truth: Known | None
    references: pd.DataFrame
    interpolation: str


def refuse_no_rate(rate: float) -> None:
    """Raise ConfigError unless a rate in Hz is positive and finite."""
    if not (np.isfinite(rate) and rate > 0.0):
        raise ConfigError("attitude.hz-no-rate", quantity="--rates", rate=rate)


def choose_factors(
    imu: pd.DataFrame, rates: Sequence[float], findings: list[Finding]
) -> tuple[int, ...]:
    """Find by what whole numbers the rate of a log is to be divided.

    Parameters
    ----------
    imu : DataFrame
    rates : sequence of float, Hz
        What was asked for; none: the full rate and its halves.
    findings : list of Finding
        Where a rate that was asked for is not among them.

    Returns
    -------
    tuple of int
        Ascending; 1, the full rate, is always the first.

    Raises
    ------
    ConfigError
        A rate is not positive, or leaves fewer than two steps.
    """
    steps = len(imu) - 1
    full = steps / float(imu.index[-1] - imu.index[0])
    if not rates:
        return tuple(f for f in FACTORS if f == 1 or steps // f >= LEAST_STEPS)
    factors = {1}
    for rate in rates:
        refuse_no_rate(rate)
        factor = max(1, round(full / rate))
        if steps // factor < 2:
            raise ConfigError(
                "attitude.hz-leaves-fewer-than-two",
                quantity="--rates",
                rate=rate,
                steps=steps / full,
                full=2.0 * full / steps,
            )
        factors.add(factor)
        if abs(full / factor / rate - 1.0) > 0.02:
            nearest = "the log's own rate" if factor == 1 else f"what one sample in {factor} gives"
            findings.append(
                Finding(
                    "attitude.hz-asked-hz",
                    quantity="--rates",
                    severity="note",
                    rate=rate,
                    full=full / factor,
                    nearest=nearest,
                )
            )
    return tuple(sorted(factors))


def sweep_rates(
    algorithms: Sequence[AttitudeAlgorithm],
    grounds: Grounds,
    factors: Sequence[int],
    progress: Progress,
) -> pd.DataFrame:
    """Run every algorithm at every rate, by both meanings of a lower rate.

    Parameters
    ----------
    algorithms : sequence of AttitudeAlgorithm
    grounds : Grounds
    factors : sequence of int
        From `choose_factors`.
    progress : callable
        Called with a stage and the share that is done.

    Returns
    -------
    DataFrame
        As `results.AttitudeBench.sweep`. ``drop`` keeps one sample in `factor` and forms
        increments between those that are left, as a slow logger would; ``sum`` adds up the
        increments of the full rate, as a sensor that integrates would. A last step may be
        shorter, so that every cell ends where the log does. An algorithm that leaves the range
        of floating point has an infinite error.
    """
    cells = [(meaning, factor) for meaning in MEANINGS for factor in factors]
    clean = grounds.own.clean
    whole = increments_from_imu(grounds.imu, grounds.interpolation)
    whole_clean = None if clean is None else increments_from_imu(clean, grounds.interpolation)
    rows: list[dict[str, object]] = []
    for k, (meaning, factor) in enumerate(cells):
        if meaning == "sum" and factor == 1:
            # Nothing is left out and nothing summed: what has been found already.
            full = [row for row in rows if row["factor"] == 1]
            rows += [row | {"meaning": "sum"} for row in full]
            continue
        progress(f"{meaning} 1:{factor}", k / len(cells))
        samples = chosen_samples(len(grounds.imu), factor)
        steps = _steps(grounds.imu, whole, samples, meaning, grounds.interpolation)
        error_free = None
        if clean is not None and whole_clean is not None:
            error_free = _steps(clean, whole_clean, samples, meaning, grounds.interpolation)
        used = grounds.imu.iloc[samples]
        there = replace(
            grounds,
            own=replace(grounds.own, known=grounds.own.known.at(samples)),
            truth=None if grounds.truth is None else grounds.truth.at(samples),
        )
        for algorithm in algorithms:
            rows.append(
                {"algorithm": algorithm.label, "meaning": meaning, "factor": factor}
                | {"rate_hz": (len(samples) - 1) / float(used.index[-1] - used.index[0])}
                | _cell(algorithm, there, steps, error_free, used)
            )
    return pd.DataFrame(rows, columns=COLUMNS)


def error_at_full_rate(algorithm: AttitudeAlgorithm, grounds: Grounds) -> float:
    """Return the error in deg by which one algorithm is judged at the full rate."""
    steps = steps_of(increments_from_imu(grounds.imu, grounds.interpolation))
    return _cell(algorithm, grounds, steps, None, grounds.imu)["error_deg"]


def chosen_samples(count: int, factor: int) -> NDArray[np.int64]:
    """Every factor-th of so many samples, and the last."""
    samples = np.arange(0, count, factor)
    return samples if samples[-1] == count - 1 else np.append(samples, count - 1)


def _steps(
    imu: pd.DataFrame,
    whole: pd.DataFrame,
    samples: NDArray[np.int64],
    meaning: str,
    interpolation: str,
) -> Steps:
    """Steps of a lower rate; `whole` are the increments of the full one."""
    if meaning == "drop":
        return steps_of(increments_from_imu(imu.iloc[samples], interpolation))
    return steps_of(sum_increments(whole, samples))


def sum_increments(increments: pd.DataFrame, samples: NDArray[np.int64]) -> pd.DataFrame:
    """Add up increments between some of the samples.

    Parameters
    ----------
    increments : DataFrame
        An Increments table of n steps.
    samples : ndarray of int
        Ascending, from 0 to n.

    Returns
    -------
    DataFrame
        An Increments table of one step between each two. What the rate did within a step is
        known only where nothing was added up.
    """
    if len(samples) == len(increments) + 1:
        return increments
    begin = samples[:-1]
    dt = np.add.reduceat(increments["dt"].to_numpy(), begin)
    theta = np.add.reduceat(increments[THETA].to_numpy(), begin, axis=0)
    ends = increments.index.to_numpy(dtype=np.float64)[samples[1:] - 1]
    # A step that holds a single one keeps what is known of it.
    single = np.diff(samples) == 1
    change = np.zeros_like(theta)
    change[single] = increments[DTHETA].to_numpy()[begin[single]]
    return increments_table(ends, dt, theta, change)


def _cell(
    algorithm: AttitudeAlgorithm,
    grounds: Grounds,
    steps: Steps,
    error_free: Steps | None,
    used: pd.DataFrame,
) -> dict[str, float]:
    infinite: Errors = (np.inf, np.inf, np.inf)
    try:
        q = attitude_history(algorithm, steps, grounds.q_nb)
        own = grounds.own.known.errors(
            q if error_free is None else attitude_history(algorithm, error_free, grounds.q_nb)
        )
        total = None if grounds.truth is None else grounds.truth.errors(q)
        reference = _largest_reference(q, grounds.references, used)
    except DivergenceError:
        own, reference = infinite, np.inf if len(grounds.references) else np.nan
        total = None if grounds.truth is None else infinite
    own_deg = np.nan if own is None else own[2]
    final, rms, largest = (np.nan,) * 3 if total is None else total
    return {
        "own_deg": own_deg,
        "final_deg": final,
        "rms_deg": rms,
        "max_deg": largest,
        "reference_deg": reference,
        # A truth tells more than a reference point, and better.
        "error_deg": next(e for e in (largest, reference, own_deg) if not np.isnan(e)),
    }


def _largest_reference(q: Array, references: pd.DataFrame, used: pd.DataFrame) -> float:
    if references.empty:
        return np.nan
    attitude = pd.DataFrame(q, index=used.index, columns=QUATERNION)
    return max(reference_errors(attitude, references))
