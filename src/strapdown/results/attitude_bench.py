"""What the attitude bench found."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import nan
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.errors import Finding
from strapdown.results.answer import Answer, Cost, Share, Trials
from strapdown.results.inputs import InputFiles, Reading
from strapdown.results.rests import RestStretch, SamePose
from strapdown.results.runs import AttitudeRun, PeerRun
from strapdown.results.scores import PositionScore, Score
from strapdown.results.second_log import SecondLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AttitudeBench"]


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
