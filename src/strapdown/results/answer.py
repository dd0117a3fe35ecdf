"""Which algorithm is enough, what it costs, whose its error is, and whether that was luck."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd

__all__ = ["Answer", "Cost", "Share", "Trials"]


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
