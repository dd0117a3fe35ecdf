"""What the attitude bench found."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import nan
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.errors import Finding
from strapdown.results.inputs import InputFiles, Reading
from strapdown.results.rests import RestStretch, SamePose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    """What the attitude bench found.

    Attributes
    ----------
    source : str
        Name of the log or the scenario.
    description : str
    specification : dict
        Everything that determines the run, as it is sealed with the outputs.
    imu : DataFrame
        The samples as used: body axes, SI, bias removed where that was asked for.
    runs : tuple of AttitudeRun
    truth : DataFrame or None
        Attitude table at (some of) the samples' stamps.
    scored : ndarray of bool or None
        Which rows of `truth` count.
    scores : tuple of Score
    sampling_error_deg : tuple of float, or None
        For a scenario: what noise-free samples lose with exact arithmetic, at the end and at
        most. For a log an estimate: the difference between rates that run along chords and
        along cubics between their stamps; None for mean rates.
    differences_deg : DataFrame
        Largest rotation angle between each pair of algorithms.
    rests : tuple of RestStretch
    initial : dict
        The initial attitude in degrees and where it came from.
    gyro_bias : dict
        What was subtracted, in rad/s, and where it came from.
    references : DataFrame
    readings : tuple of Reading
    findings : tuple of Finding
        Warnings and notes, in words.
    inputs : tuple of InputFiles
    costs : tuple of Cost
        One an algorithm, in the order of `runs`.
    shares : tuple of Share
        Likewise.
    sweep : DataFrame
        One row an algorithm, a rate and a way to come to it: ``algorithm``, ``meaning``
        (``drop``: samples are left out; ``sum``: increments are summed, as a sensor that
        integrates would), ``factor``, ``rate_hz``, ``own_deg`` (largest error of algorithm and
        rate, as in `Share`), ``final_deg``, ``rms_deg``, ``max_deg`` (against the truth),
        ``reference_deg`` (largest at a reference point), ``error_deg`` (the one that the answer
        judges: against the truth, else at the reference points, else ``own_deg``).
    answer : Answer
    trials : Trials or None
    peers : tuple of PeerRun
    places : tuple of PositionScore
        One an algorithm and a reference point of place.
    offers : tuple of SamePose
        Rests that look alike, where no reference point was named.
    second : SecondLog or None
        How a second sensor's log lies to this one.
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
        """One row an algorithm and a comparison; angles in degrees, time in seconds."""
        columns = [f.name for f in fields(Score)]
        return pd.DataFrame([vars(score) for score in self.scores], columns=columns)

    def to_pandas(self) -> pd.DataFrame:
        """One row an algorithm and a comparison, with its share of the error and its cost.

        Returns
        -------
        DataFrame
            The columns of `summary`, then ``own_*_deg``, ``sensor_*_deg`` and ``single_*_deg``
            with ``final``, ``rms`` and ``max`` for the star, and the fields of `Cost`. Where
            nothing is known to compare with, one row an algorithm.
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

    def plot(self, kind: str = "cost") -> Figure:
        """Draw one chart, as the report shows it.

        Parameters
        ----------
        kind : str
            ``cost``, ``sweep``, ``gyro``, ``attitude``, ``error``, ``reference-error``,
            ``difference``, ``share``, ``trials`` or ``peers``.

        Returns
        -------
        matplotlib.figure.Figure
            Of no window and no global state; it shows itself in a notebook.

        Raises
        ------
        ConfigError
            There is no such chart, or nothing to show in it.
        """
        from strapdown.report.attitude_view import plot

        return plot(self, kind)

    def _repr_html_(self) -> str:
        """The answer and the table of results, for a notebook."""
        from strapdown.report.attitude_view import short_html

        return short_html(self)


_PARTS, _MOMENTS = ("own", "sensor", "single"), ("final", "rms", "max")


def _flat_names() -> list[str]:
    return ["algorithm", *(f"{part}_{moment}_deg" for part in _PARTS for moment in _MOMENTS)]


def _flat(share: Share) -> list[Any]:
    known = (share.own_deg, share.sensor_deg, share.single_deg)
    values = [v for three in known for v in (three or (nan, nan, nan))]
    return [share.algorithm, *values]


# Which algorithm is enough, what it costs, whose its error is, and whether that was luck.


@dataclass(frozen=True)
class Answer:
    """The simplest algorithm, and the lowest rate, that are accurate enough.

    Attributes
    ----------
    verdict : str
        ``enough``: one is found; ``sensor``: none is, because of the sensor; ``rate``: none is,
        because of the rate; ``own``: nothing is known of the attitude, and it is the
        algorithm's own error that was judged.
    sentence : str
        For people.
    tolerance_deg : float
    algorithm, meaning : str or None
    rate_hz : float or None
    why, helps : tuple of str
        What it rests on, and what would help.
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
    """What one sample costs one algorithm.

    Attributes
    ----------
    algorithm : str
    add, multiply, divide, sqrt, trig : float
        Operations, counted on the kernel itself in steps of 0.01 rad, and averaged over the
        samples of a block. Subtractions count as additions.
    cycles : float
        The same in cycles of a Cortex-M4F (`constants.CORTEX_M4F_CYCLES`): a weight for ranking.
    memory : int
        Numbers that it keeps between samples.
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
    """Whose the error of one algorithm is: its own, the sensor's, and single precision's.

    Attributes
    ----------
    algorithm : str
    own_deg : tuple of float
        Error of the algorithm and of the rate: at the end, RMS, largest. On a simulation the
        error on error-free samples; on a log the difference from the most accurate algorithm
        on the same samples, which is an estimate.
    sensor_deg : tuple of float, or None
        Likewise what the sensor's errors make: on a simulation the difference that they make
        to this algorithm, on a log the error of the most accurate algorithm against the
        truth; None without a truth.
    single_deg : tuple of float
        Likewise the difference between single and double precision on the same samples.
    """

    algorithm: str
    own_deg: tuple[float, float, float]
    sensor_deg: tuple[float, float, float] | None
    single_deg: tuple[float, float, float]


@dataclass(frozen=True)
class Trials:
    """The same bench over several logs or seeds.

    Attributes
    ----------
    names : tuple of str
        Of the trials.
    errors : DataFrame
        One row a trial and an algorithm: ``trial``, ``algorithm``, ``error_deg`` (what the
        answer is judged by), ``own_deg``, ``rms_deg``, ``final_deg``.
    ranking : DataFrame
        One row an algorithm, best first: ``algorithm``, ``mean_deg``, ``low_deg``, ``high_deg``
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
        For people; the equations are numbered as in the algorithm's source.
    attitude : DataFrame
        Attitude table at every sample.
    diagnostics : dict of str to float
        What the algorithm says of its own condition; each key carries its unit.
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
        ``gyro``, ``gyro+accel`` or ``gyro+accel+mag``; only like is compared with like.
    attitude : DataFrame
        Attitude table.
    scores : tuple of Score
    """

    peer: str
    aiding: str
    attitude: pd.DataFrame = field(repr=False)
    scores: tuple[Score, ...]


# How an attitude, or a position reckoned from it, compares with what is known.


Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Score:
    """How one algorithm compares with one thing that is known.

    Attributes
    ----------
    algorithm : str
    against : str
        ``truth``, or the reference point in words.
    time : float, s
        Where the comparison ends.
    error_deg : float
        Rotation angle between the computed and the known attitude, at that instant.
    rms_deg, max_deg : float or None
        Over every scored instant; None for a reference point.
    turned_deg, expected_deg : float or None
        For a number of turns: the integrated angle about the axis, and what it should be.
    sd_deg : float or None
        How well the reference itself is known.
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
    """How a position dead-reckoned between rests compares with what is known of it.

    Attributes
    ----------
    algorithm : str
        Whose attitude turned the specific force.
    against : str
        The reference in words.
    time, since : float, s
        The instants that it compares.
    legs : int
        Stretches between two rests that were reckoned one after the other.
    seconds : float
        Their lengths together, in s: what the errors grow with.
    moved_m, moved_corrected_m : tuple of float, m
        Displacement along the axes of the run's local level, without and with the velocity at
        the end of each leg brought to zero.
    expected_m : tuple of float, m
    error_m, corrected_error_m : float, m
        Distance from what is expected.
    end_velocity_m_s : float, m/s
        The largest velocity that was left at the end of a leg, where it should be zero.
    sd_m, corrected_sd_m, end_velocity_sd_m_s : float
        What the stated errors of the sensors and of the start lead to, root mean square of
        the length, first order.
    reference_sd_m : float or None
        How well the reference itself is known.
    gravity_m_s2 : float
        What was taken off along the vertical.
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


# How the log of a second sensor on the same body lies to the first.


@dataclass(frozen=True)
class SecondLog:
    """How the log of a second sensor on the same body lies to the first.

    The model is ``omega_1(t) = scale R_12 omega_2(u) + bias`` with
    ``u = t + offset + drift (t - middle)``; every ``sd`` is one standard deviation from the
    residuals, with their correlation in time.

    Attributes
    ----------
    start, end : float, s
        What both logs cover, on the first one's clock.
    middle : float, s
        Instant of the first clock for which `offset` holds.
    offset, offset_sd : float, s
        Second clock less first clock.
    drift_ppm, drift_sd_ppm : float
        How much faster the second clock runs, in parts per million.
    mounting : tuple of four float
        ``q_12``: turns a vector from the second sensor's axes into the first one's.
    mounting_deg : tuple of float, deg
        The same as roll, pitch, heading.
    mounting_sd_deg : tuple of float, deg
        About the first sensor's axes; infinite where it cannot be told.
    bias, bias_sd : tuple of float, rad/s
        Bias of the first less (scaled, turned) bias of the second, in the first one's axes.
    scale, scale_sd : float
        Scale of the first over that of the second.
    axis : tuple of float or None
        Where the body turned about one axis only: that axis, in the first sensor's axes. The
        mounting about it is then the least turn that fits, and not known.
    correlation : float
        Share of the rates that the two have in common at the coarse offset, 1 at best.
    runner_up : float
        The same for the best other offset.
    residual : float, rad/s
        Root mean square of what is left, all axes together, after smoothing.
    smoothing : float, s
        Standard deviation of the Gaussian that both were smoothed with before the fit.
    cells : int
        Points that were fitted.
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
