"""Results of the attitude bench."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import nan
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.errors import Finding
from strapdown.results.inputs import InputFiles, Reading
from strapdown.results.rests import RestStretch, SamePose

if TYPE_CHECKING:
    from strapdown.report.chart_figure import ChartFigure

__all__ = [
    "Answer",
    "AttitudeBench",
    "AttitudeRun",
    "Cost",
    "PeerRun",
    "PositionScore",
    "Score",
    "SecondLog",
    "Share",
    "Trials",
]


@dataclass(frozen=True, repr=False)
class AttitudeBench:
    """Result of the attitude bench.

    Attributes
    ----------
    source : str
        Name of the log or the scenario.
    description : str
    specification : dict
        Everything that determines the run, as stored with the outputs.
    imu : DataFrame
        Samples as used: body axes, SI, bias removed if requested.
    runs : tuple of AttitudeRun
    truth : DataFrame or None
        Attitude table at (some of) the samples' stamps.
    scored : ndarray of bool or None
        Rows of `truth` that are scored.
    scores : tuple of Score
    sampling_error_deg : tuple of float, or None
        For a scenario: error of noise-free samples with exact arithmetic, at the end and at
        most. For a log an estimate: the difference between linear and cubic interpolation of
        the rates between their stamps; None for mean rates.
    differences_deg : DataFrame
        Largest rotation angle between each pair of algorithms.
    rests : tuple of RestStretch
    initial : dict
        Initial attitude in degrees, and its source.
    gyro_bias : dict
        Subtracted bias in rad/s, and its source.
    references : DataFrame
    readings : tuple of Reading
    findings : tuple of Finding
        Warnings and notes, in words.
    inputs : tuple of InputFiles
    costs : tuple of Cost
        One per algorithm, in the order of `runs`.
    shares : tuple of Share
        Likewise.
    sweep : DataFrame
        One row per algorithm, rate and decimation method: ``algorithm``, ``meaning``
        (``drop``: samples are decimated; ``sum``: increments are summed, as in an
        integrating sensor), ``factor``, ``rate_hz``, ``own_deg`` (largest error of algorithm and
        rate, as in `Share`), ``final_deg``, ``rms_deg``, ``max_deg`` (against the truth),
        ``reference_deg`` (largest at a reference point), ``error_deg`` (the one used for the
        answer: against the truth, else at the reference points, else ``own_deg``).
    answer : Answer
    trials : Trials or None
    peers : tuple of PeerRun
    places : tuple of PositionScore
        One per algorithm and position reference point.
    offers : tuple of SamePose
        Stationary intervals of similar pose, if no reference point is given.
    second : SecondLog or None
        Alignment of a second sensor's log with this one.
    """

    source: str
    description: str
    specification: dict[str, Any] = field(repr=False)
    imu: pd.DataFrame = field(repr=False)
    runs: tuple[AttitudeRun, ...] = field(repr=False)
    truth: pd.DataFrame | None = field(repr=False)
    scored: Any = field(repr=False)
    scores: tuple[Score, ...]
    sampling_error_deg: tuple[float, float] | None
    differences_deg: pd.DataFrame = field(repr=False)
    rests: tuple[RestStretch, ...]
    initial: dict[str, Any]
    gyro_bias: dict[str, Any]
    references: pd.DataFrame = field(repr=False)
    readings: tuple[Reading, ...] = field(repr=False)
    findings: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...] = field(repr=False)
    costs: tuple[Cost, ...] = field(repr=False)
    shares: tuple[Share, ...] = field(repr=False)
    sweep: pd.DataFrame = field(repr=False)
    answer: Answer
    trials: Trials | None = None
    peers: tuple[PeerRun, ...] = field(default=(), repr=False)
    places: tuple[PositionScore, ...] = field(default=(), repr=False)
    offers: tuple[SamePose, ...] = field(default=(), repr=False)
    second: SecondLog | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return f"<AttitudeBench {self.source}: {self.answer.sentence}>"

    @property
    def summary(self) -> pd.DataFrame:
        """One row per algorithm and comparison; angles in degrees, time in seconds."""
        columns = [f.name for f in fields(Score)]
        return pd.DataFrame([vars(score) for score in self.scores], columns=columns)

    def to_pandas(self) -> pd.DataFrame:
        """One row per algorithm and comparison, with error shares and cost.

        Returns
        -------
        DataFrame
            The columns of `summary`, then ``own_*_deg``, ``sensor_*_deg`` and ``single_*_deg``
            with ``final``, ``rms`` and ``max`` for the star, and the fields of `Cost`. Without
            a reference, one row per algorithm.
        """
        table = self.summary
        if table.empty:
            table = table.reindex(range(len(self.runs)))
            table["algorithm"] = [run.algorithm for run in self.runs]
        shares = pd.DataFrame([_flat(share) for share in self.shares], columns=_flat_names())
        costs = pd.DataFrame(
            [vars(cost) for cost in self.costs], columns=[f.name for f in fields(Cost)]
        )
        table = table.merge(shares, on="algorithm", how="left")
        return table.merge(costs, on="algorithm", how="left")

    def plot(self, kind: str = "cost") -> ChartFigure:
        """Draw one chart of the report.

        Parameters
        ----------
        kind : str
            ``cost``, ``sweep``, ``gyro``, ``attitude``, ``error``, ``reference-error``,
            ``difference``, ``share``, ``trials`` or ``peers``.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist or has no data.
        """
        from strapdown.report.attitude_document import plot

        return plot(self, kind)

    def _repr_html_(self) -> str:
        """Answer and table of results, for a notebook."""
        from strapdown.report.attitude_document import short_html

        return short_html(self)


_PARTS, _MOMENTS = ("own", "sensor", "single"), ("final", "rms", "max")


def _flat_names() -> list[str]:
    return ["algorithm", *(f"{part}_{moment}_deg" for part in _PARTS for moment in _MOMENTS)]


def _flat(share: Share) -> list[Any]:
    known = (share.own_deg, share.sensor_deg, share.single_deg)
    values = [v for three in known for v in (three or (nan, nan, nan))]
    return [share.algorithm, *values]


# Choice of algorithm, its cost, the error budget, and the significance of the ranking.


@dataclass(frozen=True)
class Answer:
    """The simplest algorithm, and the lowest rate, that are accurate enough.

    Attributes
    ----------
    verdict : str
        ``enough``: one is found; ``sensor``: none, because of the sensor; ``rate``: none,
        because of the rate; ``own``: the attitude has no reference, and the algorithm error
        was judged.
    sentence : str
        The answer as text.
    tolerance_deg : float
    algorithm, meaning : str or None
    rate_hz : float or None
    why, helps : tuple of str
        Reasons, and possible remedies.
    """

    verdict: str
    sentence: str
    tolerance_deg: float
    algorithm: str | None
    meaning: str | None
    rate_hz: float | None
    why: tuple[str, ...]
    helps: tuple[str, ...]


@dataclass(frozen=True)
class Cost:
    """Computational cost of one sample.

    Attributes
    ----------
    algorithm : str
    add, multiply, divide, sqrt, trig : float
        Operations, counted on the kernel itself in steps of 0.01 rad, and averaged over the
        samples of a block. Subtractions count as additions.
    cycles : float
        The same in cycles of a Cortex-M4F (`constants.CORTEX_M4F_CYCLES`): a weight for ranking.
    memory : int
        Count of numbers stored between samples.
    """

    algorithm: str
    add: float
    multiply: float
    divide: float
    sqrt: float
    trig: float
    cycles: float
    memory: int


@dataclass(frozen=True)
class Share:
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
        (95 % interval of the mean), ``luck`` (probability that the next one is no worse, from
        paired differences; NaN for the last).
    """

    names: tuple[str, ...]
    errors: pd.DataFrame = field(repr=False)
    ranking: pd.DataFrame


# One algorithm, or another library's filter, over one record.


@dataclass(frozen=True)
class AttitudeRun:
    """One algorithm over one record.

    Attributes
    ----------
    algorithm : str
        Name and options, as the command line takes them.
    title, equations : str
        Display text; the equations are numbered as in the algorithm's source.
    attitude : DataFrame
        Attitude table at every sample.
    diagnostics : dict of str to float
        Condition measures of the algorithm; each key has its unit.
    """

    algorithm: str
    title: str
    equations: str
    attitude: pd.DataFrame = field(repr=False)
    diagnostics: dict[str, float]


@dataclass(frozen=True)
class PeerRun:
    """Another library's filter over the same log.

    Attributes
    ----------
    peer : str
        Name and version.
    aiding : str
        ``gyro``, ``gyro+accel`` or ``gyro+accel+mag``; compare only equal aidings.
    attitude : DataFrame
        Attitude table.
    scores : tuple of Score
    """

    peer: str
    aiding: str
    attitude: pd.DataFrame = field(repr=False)
    scores: tuple[Score, ...]


# Comparison of an attitude, or of a dead-reckoned position, with a reference.


Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Score:
    """Comparison of one algorithm with one reference.

    Attributes
    ----------
    algorithm : str
    against : str
        ``truth``, or the reference point in words.
    time : float, s
        End of the comparison.
    error_deg : float
        Rotation angle between the computed and the reference attitude at that instant.
    rms_deg, max_deg : float or None
        Over every scored instant; None for a reference point.
    turned_deg, expected_deg : float or None
        For a number of turns: integrated angle about the axis, and expected angle.
    sd_deg : float or None
        Standard deviation of the reference.
    reference : int or None
        Number of the reference point, from 1.
    """

    algorithm: str
    against: str
    time: float
    error_deg: float
    rms_deg: float | None = None
    max_deg: float | None = None
    turned_deg: float | None = None
    expected_deg: float | None = None
    sd_deg: float | None = None
    reference: int | None = None


@dataclass(frozen=True)
class PositionScore:
    """Comparison of a position dead-reckoned between stationary intervals with a reference.

    Attributes
    ----------
    algorithm : str
        Algorithm whose attitude rotated the specific force.
    against : str
        The reference as text.
    time, since : float, s
        The instants that are compared.
    legs : int
        Number of successive dead-reckoned legs between stationary intervals.
    seconds : float
        Total length of the legs, in s, with which the errors grow.
    moved_m, moved_corrected_m : tuple of float, m
        Displacement along the axes of the run's local level, without and with the velocity at
        the end of each leg corrected to zero.
    expected_m : tuple of float, m
    error_m, corrected_error_m : float, m
        Distance from the expected displacement.
    end_velocity_m_s : float, m/s
        Largest remaining velocity at the end of a leg, where it should be zero.
    sd_m, corrected_sd_m, end_velocity_sd_m_s : float
        From the stated errors of the sensors and of the start: root mean square of the length,
        first order.
    reference_sd_m : float or None
        Standard deviation of the reference.
    gravity_m_s2 : float
        Gravity subtracted along the vertical.
    """

    algorithm: str
    against: str
    time: float
    since: float
    legs: int
    seconds: float
    moved_m: Triple
    moved_corrected_m: Triple
    expected_m: Triple
    error_m: float
    corrected_error_m: float
    end_velocity_m_s: float
    sd_m: float
    corrected_sd_m: float
    end_velocity_sd_m_s: float
    reference_sd_m: float | None
    gravity_m_s2: float


# Alignment of a second sensor's log with the first, on the same body.


@dataclass(frozen=True)
class SecondLog:
    """Alignment of a second sensor's log with the first, on the same body.

    The model is ``omega_1(t) = scale R_12 omega_2(u) + bias`` with
    ``u = t + offset + drift (t - middle)``; every ``sd`` is one standard deviation from the
    residuals, with their correlation in time.

    Attributes
    ----------
    start, end : float, s
        Common interval of both logs, on the first clock.
    middle : float, s
        Instant of the first clock at which `offset` holds.
    offset, offset_sd : float, s
        Second clock minus first clock.
    drift_ppm, drift_sd_ppm : float
        Rate excess of the second clock, in parts per million.
    mounting : tuple of four float
        ``q_12``: rotates a vector from the second sensor's axes into the first one's.
    mounting_deg : tuple of float, deg
        The same as roll, pitch, heading.
    mounting_sd_deg : tuple of float, deg
        About the first sensor's axes; infinite where not observable.
    bias, bias_sd : tuple of float, rad/s
        Bias of the first minus (scaled, rotated) bias of the second, in the first one's axes.
    scale, scale_sd : float
        Scale of the first over that of the second.
    axis : tuple of float or None
        If the body rotated about one axis only: that axis, in the first sensor's axes. The
        mounting about it is then the smallest rotation that fits, and not observable.
    correlation : float
        Correlation of the rates at the coarse offset, at best 1.
    runner_up : float
        The same for the next-best offset.
    residual : float, rad/s
        Root mean square of the residuals, all axes together, after smoothing.
    smoothing : float, s
        Standard deviation of the Gaussian that smoothed both before the fit.
    cells : int
        Number of fitted points.
    """

    start: float
    end: float
    middle: float
    offset: float
    offset_sd: float
    drift_ppm: float
    drift_sd_ppm: float
    mounting: tuple[float, float, float, float]
    mounting_deg: Triple
    mounting_sd_deg: Triple
    bias: Triple
    bias_sd: Triple
    scale: float
    scale_sd: float
    axis: Triple | None
    correlation: float
    runner_up: float
    residual: float
    smoothing: float
    cells: int
