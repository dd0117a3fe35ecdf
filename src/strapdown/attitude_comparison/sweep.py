"""Errors at lower rates, by dropping samples and by summing increments; their shares and ranks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude_algorithms import AttitudeAlgorithm, RotationVector, attitude_history
from strapdown.attitude_algorithms.algorithm import AttitudeRun, Steps, steps_of
from strapdown.attitude_algorithms.cost import run_single, single_increments
from strapdown.attitude_comparison.options import refuse_no_rate
from strapdown.config.sources import LogSpec, ScenarioSpec
from strapdown.dsp.chi_square import student_above, student_quantile
from strapdown.errors import ConfigError, DivergenceError, Finding, add_note
from strapdown.evaluation.differences import Errors, Known, angles_to_errors
from strapdown.evaluation.reference_points import reference_errors
from strapdown.increments import increments_from_imu
from strapdown.progress import Progress, silent
from strapdown.rotation import unit_rotation_angle
from strapdown.tables import DTHETA, QUATERNION, THETA, increments_table
from strapdown.tables.checks import Array, values_of
from strapdown.tables.sample_clock import SampleClock

MEANINGS = ("drop", "sum")
COLUMNS = [
    *("algorithm", "meaning", "factor", "rate_hz", "own_deg", "final_deg", "rms_deg"),
    *("max_deg", "reference_deg", "error_deg"),
]
#: Reference for the algorithm error on a log: of fourth order from rates and of sixth from
#: increments, for any steps.
MOST_ACCURATE = RotationVector(samples=4, coefficients="fit")
# Halved while enough samples remain.
FACTORS = (1, 2, 4, 8, 16, 32)
LEAST_STEPS = 20


@dataclass(frozen=True)
class ErrorShare:
    """Error of one algorithm, separated into algorithm, sensor and single-precision error.

    Attributes
    ----------
    algorithm : str
    own_deg : tuple of float
        Algorithm and rate error: at the end, RMS, largest. On a simulation the error on
        error-free samples; on a log the difference from the most accurate algorithm on the same
        samples, which is an estimate.
    sensor_deg : tuple of float, or None
        Likewise the sensor error: on a simulation the change that the sensor errors cause in
        this algorithm, on a log the error of the most accurate algorithm against the truth;
        None without a truth.
    single_deg : tuple of float
        Likewise the difference between single and double precision on the same samples.
    """

    algorithm: str
    own_deg: tuple[float, float, float]
    sensor_deg: tuple[float, float, float] | None
    single_deg: tuple[float, float, float]


@dataclass(frozen=True)
class Trials:
    """Results of the same bench over several logs or seeds.

    Attributes
    ----------
    names : tuple of str
        Of the trials.
    errors : DataFrame
        One row per trial and algorithm: ``trial``, ``algorithm``, ``error_deg`` (the error used
        for the answer), ``own_deg``, ``rms_deg``, ``final_deg``.
    ranking : DataFrame
        One row per algorithm, best first: ``algorithm``, ``mean_deg``, ``low_deg``, ``high_deg``
        (95 % interval of the mean), ``luck`` (probability that the next one is as good, from
        paired differences; NaN for the last).
    """

    names: tuple[str, ...]
    errors: pd.DataFrame = field(repr=False)
    ranking: pd.DataFrame


@dataclass(frozen=True)
class Grounds:
    """Samples and references common to all cells of a sweep.

    Attributes
    ----------
    imu : DataFrame
        The used samples, at the full rate.
    q_nb : ndarray, (4,)
        Initial attitude.
    interpolation : str
        Of the rates between their stamps.
    references : DataFrame
        A References table.
    own : Known
        Reference of the algorithm errors: in a simulation the exact attitude, rotated to the
        start of the run; for a log that of the most accurate algorithm.
    clean : DataFrame or None
        In a simulation, the samples without the errors of the sensor: `own` is then exact.
    clock : SampleClock
        Of `imu`.
    restarts : tuple of (int, ndarray)
        Rows at which every run begins anew, after gaps, and the attitudes there: the truth where
        it is known, else `own`, which goes on through a gap as if the rate changed evenly in it.
    """

    imu: pd.DataFrame
    q_nb: Array
    interpolation: str
    references: pd.DataFrame
    truth: Known | None
    own: Known
    clean: pd.DataFrame | None
    clock: SampleClock
    restarts: tuple[tuple[int, Array], ...] = ()

    @classmethod
    def of(
        cls,
        imu: pd.DataFrame,
        q_nb: Array,
        interpolation: str,
        references: pd.DataFrame,
        truth: Known | None,
        clean: pd.DataFrame | None,
        clock: SampleClock,
    ) -> Grounds:
        """Find the reference for the algorithm errors, and gather the rest."""
        restarts: tuple[tuple[int, Array], ...] = ()
        if clean is not None and truth is not None:
            # The error of the initial attitude is not the algorithm's: the truth is rotated to
            # start with the run.
            start = rotation.compose(q_nb, rotation.conjugate(truth.q_nb[0]))
            own = replace(truth, q_nb=rotation.compose(start, truth.q_nb))
        else:
            clean = None
            increments = increments_from_imu(imu, interpolation)
            # Rows after gaps at which the truth is first known, with the truth.
            known: list[tuple[int, Array]] = []
            if truth is not None:
                counted = ((k, np.flatnonzero(truth.counts[k:m])) for k, m in clock.stretches[1:])
                rows = [k + int(there[0]) for k, there in counted if there.size]
                known = [(row, truth.q_nb[row]) for row in rows]
            best = attitude_history(MOST_ACCURATE, increments, q_nb, known)
            there = {row for row, _ in known}
            restarts = tuple(
                sorted(
                    [*known, *((r, best[r]) for r in clock.begins[1:].tolist() if r not in there)],
                    key=lambda restart: restart[0],
                )
            )
            own = Known(best, np.ones(len(best), dtype=bool))
        return cls(imu, q_nb, interpolation, references, truth, own, clean, clock, restarts)

    def history(self, algorithm: AttitudeAlgorithm, increments: pd.DataFrame | Steps) -> Array:
        """Attitude by an algorithm, anew after each gap."""
        return attitude_history(algorithm, increments, self.q_nb, self.restarts)

    def samples(self, factor: int) -> NDArray[np.int64]:
        """Rows of a lower rate, with the rows at which runs begin anew."""
        return np.union1d(self.clock.every(factor), [row for row, _ in self.restarts]).astype(
            np.int64
        )

    @property
    def exact(self) -> bool:
        """Whether `own` is the truth itself, not an estimate."""
        return self.clean is not None

    @property
    def known(self) -> bool:
        """Whether a truth or a reference point of the attitude is known."""
        return self.truth is not None or bool(len(self.references))

    def sensor_errors(self) -> Errors | None:
        """Error against the truth due to sensor and initial attitude: final, RMS, largest, deg."""
        if self.truth is None or self.clean is None:
            return None if self.truth is None else self.truth.errors(self.own.q_nb)
        with_errors, without = (
            self.history(MOST_ACCURATE, increments_from_imu(table, self.interpolation))
            for table in (self.imu, self.clean)
        )
        sensor = rotation.compose(rotation.conjugate(without), with_errors)
        return self.truth.errors(rotation.compose(self.own.q_nb, sensor))


def choose_factors(
    clock: SampleClock, rates: Sequence[float], findings: list[Finding]
) -> tuple[int, ...]:
    """Ascending divisors of a log's rate, from 1: of the requested rates in Hz, or its halves."""
    steps = clock.number.size - 1
    full = clock.rate_hz
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
            add_note(
                findings,
                "attitude.hz-asked-hz",
                quantity="--rates",
                rate=rate,
                full=full / factor,
                nearest=nearest,
            )
    return tuple(sorted(factors))


def sweep_rates(
    algorithms: Sequence[AttitudeAlgorithm],
    grounds: Grounds,
    factors: Sequence[int],
    progress: Progress,
) -> pd.DataFrame:
    """Run every algorithm at every rate; columns as `AttitudeComparison.sweep`.

    ``drop`` keeps one sample in `factor`, as a slow logger would; ``sum`` adds up the increments of
    the full rate, as an integrating sensor would. The last step may be shorter, so that every cell
    ends at the end of the log. An algorithm that overflows has an infinite error.
    """
    cells = [(meaning, factor) for meaning in MEANINGS for factor in factors]
    tables = [grounds.imu] if grounds.clean is None else [grounds.imu, grounds.clean]
    whole = [(table, increments_from_imu(table, grounds.interpolation)) for table in tables]
    rows: list[dict[str, object]] = []
    for k, (meaning, factor) in enumerate(cells):
        if meaning == "sum" and factor == 1:
            # At the full rate both meanings are the same: reuse the rows.
            full = [row for row in rows if row["factor"] == 1]
            rows += [row | {"meaning": "sum"} for row in full]
            continue
        progress(f"{meaning} 1:{factor}", k / len(cells))
        samples = grounds.samples(factor)
        steps, *error_free = [
            steps_of(
                increments_from_imu(table.iloc[samples], grounds.interpolation)
                if meaning == "drop"
                else sum_increments(increments, samples)
            )
            for table, increments in whole
        ]
        used = grounds.imu.iloc[samples]
        there = replace(
            grounds,
            own=grounds.own.at(samples),
            truth=None if grounds.truth is None else grounds.truth.at(samples),
            restarts=tuple((int(np.searchsorted(samples, row)), q) for row, q in grounds.restarts),
        )
        for algorithm in algorithms:
            rows.append(
                {"algorithm": algorithm.label, "meaning": meaning, "factor": factor}
                | {"rate_hz": grounds.clock.rate_hz / factor}
                | _cell(algorithm, there, steps, *error_free, used=used)
            )
    return pd.DataFrame(rows, columns=COLUMNS)


def sweep_on(
    sweep: pd.DataFrame, algorithms: Sequence[AttitudeAlgorithm], grounds: Grounds, limit: float
) -> pd.DataFrame:
    """Halve the rate further, while averaged samples of any algorithm keep its own error within.

    `limit` (deg). At the end too few samples remain.
    """
    factor = int(sweep["factor"].max())
    while (grounds.clock.number.size - 1) // (2 * factor) >= LEAST_STEPS:
        lowest = sweep[(sweep["meaning"] == "sum") & (sweep["factor"] == factor)]
        if not (lowest["own_deg"] <= limit).any():
            break
        factor *= 2
        further = sweep_rates(algorithms, grounds, (factor,), silent)
        sweep = pd.concat([sweep, further], ignore_index=True)
    return sweep


def error_at_full_rate(algorithm: AttitudeAlgorithm, grounds: Grounds) -> float:
    """Return the error in deg that judges an algorithm at the full rate."""
    steps = steps_of(increments_from_imu(grounds.imu, grounds.interpolation))
    return _cell(algorithm, grounds, steps, used=grounds.imu)["error_deg"]


def sum_increments(increments: pd.DataFrame, samples: NDArray[np.int64]) -> pd.DataFrame:
    """Add up increments between samples; the change of rate is known in single steps only."""
    if len(samples) == len(increments) + 1:
        return increments
    begin = samples[:-1]
    dt = np.add.reduceat(increments["dt"].to_numpy(), begin)
    theta = np.add.reduceat(values_of(increments, THETA), begin, axis=0)
    ends = increments.index.to_numpy(dtype=np.float64)[samples[1:] - 1]
    # A step of a single increment keeps its rate.
    single = np.diff(samples) == 1
    change = np.zeros_like(theta)
    change[single] = values_of(increments, DTHETA)[begin[single]]
    return increments_table(ends, dt, theta, change)


def _cell(
    algorithm: AttitudeAlgorithm,
    grounds: Grounds,
    steps: Steps,
    error_free: Steps | None = None,
    *,
    used: pd.DataFrame,
) -> dict[str, float]:
    infinite: Errors = (np.inf, np.inf, np.inf)
    try:
        q = grounds.history(algorithm, steps)
        own = grounds.own.errors(
            q if error_free is None else grounds.history(algorithm, error_free)
        )
        total = None if grounds.truth is None else grounds.truth.errors(q)
        reference = np.nan
        if len(grounds.references):
            attitude = pd.DataFrame(q, index=used.index, columns=QUATERNION)
            reference = max(reference_errors(attitude, grounds.references))
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
        # A truth is more complete and more accurate than a reference point.
        "error_deg": next(e for e in (largest, reference, own_deg) if not np.isnan(e)),
    }


# Shares of the error: sensor, algorithm, single precision.


def between_samples(grounds: Grounds) -> tuple[float, float] | None:
    """Final and largest angle in deg between linear and cubic rates; None for mean rates."""
    if grounds.imu.attrs["sampling"] == "mean":
        return None
    chord, cubic = (
        grounds.history(MOST_ACCURATE, increments_from_imu(grounds.imu, how))
        for how in ("linear", "cubic")
    )
    final, _, largest = angles_to_errors(unit_rotation_angle(chord, cubic))
    return final, largest


def find_shares(
    algorithms: Sequence[AttitudeAlgorithm], runs: Sequence[AttitudeRun], grounds: Grounds
) -> tuple[ErrorShare, ...]:
    """Split the error of each run into the shares of sensor and algorithm.

    In a simulation ``q_true^-1 q = (q_true^-1 q_clean)(q_clean^-1 q)``: the rotation vectors of
    both shares add up to within half their product.
    """
    own = grounds.own
    rounded = single_increments(grounds.imu, grounds.interpolation)
    clean = of_sensor = None
    if grounds.clean is not None:
        clean = increments_from_imu(grounds.clean, grounds.interpolation)
    elif grounds.truth is not None:
        # For a log the sensor error is that of the most accurate algorithm.
        of_sensor = grounds.truth.errors(own.q_nb)
    shares = []
    for algorithm, run in zip(algorithms, runs, strict=True):
        q = values_of(run.attitude, QUATERNION)
        if clean is None:
            mine, sensor = own.errors(q), of_sensor
        else:
            q_clean = grounds.history(algorithm, clean)
            mine = own.errors(q_clean)
            sensor = angles_to_errors(unit_rotation_angle(q, q_clean))
        assert mine is not None
        single = run_single(algorithm, rounded, grounds.q_nb, grounds.restarts)
        apart = unit_rotation_angle(single, q)
        shares.append(ErrorShare(run.algorithm, mine, sensor, angles_to_errors(apart)))
    return tuple(shares)


# Statistics over several logs or seeds, so that a rank is not due to chance.


#: Decimals of a degree beyond which errors differ by rounding alone.
ROUNDED = 9
CONFIDENCE = 0.95
_KIND = ["algorithm", "meaning"]
_NUMBERS = [
    *("rate_hz", "own_deg", "final_deg", "rms_deg"),
    *("max_deg", "reference_deg", "error_deg"),
]
# Rates halve from cell to cell: within a factor of the root of two they count as the same.
NEAR = 2.0**0.5


def trial_names(sources: Sequence[ScenarioSpec | LogSpec]) -> list[str]:
    """Names of trials: of a log the last part of its path, of a scenario its seed."""
    names = [
        f"{s.name}, seed {s.seed}" if isinstance(s, ScenarioSpec) else Path(s.path).name
        for s in sources
    ]
    return [n if names.count(n) == 1 else f"{n} ({k + 1})" for k, n in enumerate(names)]


def gather(sweeps: Sequence[pd.DataFrame], names: Sequence[str]) -> Trials:
    """Errors at the full rate of several trials, and the rank of the algorithms."""
    rows = []
    for name, sweep in zip(names, sweeps, strict=True):
        full = sweep[(sweep["factor"] == 1) & (sweep["meaning"] == "drop")]
        for _, cell in full.iterrows():
            rows.append(
                {"trial": name}
                | {key: cell[key] for key in ("algorithm", "error_deg", "own_deg")}
                | {key: cell[key] for key in ("rms_deg", "final_deg")}
            )
    errors = pd.DataFrame(rows)
    return Trials(tuple(names), errors, rank(errors))


def rank(errors: pd.DataFrame) -> pd.DataFrame:
    """Rank algorithms by their mean error over trials.

    The interval of the mean is Student's; `luck` is the one-sided probability, by Student's test of
    paired differences, that the next algorithm is in truth no worse.
    """
    by = errors.pivot(index="trial", columns="algorithm", values="error_deg")
    order = by.mean().round(ROUNDED).sort_values(kind="stable").index
    count = len(by)
    rows = []
    for k, name in enumerate(order):
        values = by[name].to_numpy(dtype=np.float64)
        mean, spread = float(values.mean()), np.nan
        if count > 1:
            spread = student_quantile(0.5 + CONFIDENCE / 2.0, count - 1) * float(
                values.std(ddof=1) / np.sqrt(count)
            )
        luck = np.nan
        if k + 1 < len(order) and count > 1:
            luck = _luck(by[order[k + 1]].to_numpy(dtype=np.float64) - values)
        rows.append(
            {
                "algorithm": name,
                "mean_deg": mean,
                # An angle between attitudes lies between 0 and 180 deg, and so does its mean.
                "low_deg": float(np.maximum(0.0, mean - spread)),
                "high_deg": min(180.0, mean + spread),
                "luck": luck,
            }
        )
    return pd.DataFrame(rows)


def _luck(worse_by: Array) -> float:
    """Probability of differences with this mean, if the true mean is not positive."""
    spread = float(worse_by.std(ddof=1))
    # Differences due to rounding alone are not significant.
    if float(np.abs(worse_by).max()) < 10.0**-ROUNDED:
        return 0.5
    if spread <= 1e-12 * max(1.0, float(np.abs(worse_by).max())):
        return float(worse_by.mean() < 0.0)
    t = float(worse_by.mean()) / (spread / np.sqrt(len(worse_by)))
    return student_above(t, len(worse_by) - 1)


def worst_sweep(sweeps: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Largest errors of several sweeps, cell by cell of the first.

    Of each other sweep the highest rate is used that is at most `NEAR` times that of the cell; the
    rate of a cell is the highest of these, so that each trial is judged at that rate or below.
    """
    first, *others = sweeps
    rows = []
    by_kind = [dict(list(other.groupby(_KIND))) for other in others]
    for cell in first.to_dict("records"):
        taken = [cell]
        for kinds in by_kind:
            cells = kinds[cell["algorithm"], cell["meaning"]]
            near = cells[cells["rate_hz"] <= NEAR * cell["rate_hz"]]
            if len(near):
                taken.append(near.loc[near["rate_hz"].idxmax()])
        if len(taken) == len(sweeps):
            numbers = pd.DataFrame([[float(row[name]) for name in _NUMBERS] for row in taken])
            rows.append(cell | dict(zip(_NUMBERS, numbers.max(), strict=True)))
    if not rows:
        raise ConfigError("attitude.no-rate-common-all-trials", quantity="--rates")
    return pd.DataFrame(rows)[list(first.columns)]


def not_judged(known: Sequence[bool], names: Sequence[str]) -> tuple[Finding, ...]:
    """Report the trials without a reference, where others have one."""
    if not any(known):
        return ()
    return tuple(
        Finding(
            "attitude.nothing-known-attitude-algorithms-own",
            file=name,
            quantity="reference",
            severity="note",
        )
        for there, name in zip(known, names, strict=True)
        if not there
    )
