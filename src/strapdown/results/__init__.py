"""Frozen results of runs, with the data needed to judge them."""

from __future__ import annotations

from strapdown.results.attitude_bench import (
    Answer,
    AttitudeBench,
    AttitudeRun,
    Cost,
    PeerRun,
    PositionScore,
    Score,
    SecondLog,
    Share,
    Trials,
)
from strapdown.results.inputs import InputFiles, Reading
from strapdown.results.rests import GyroBiasCourse, RestStretch, SamePose

__all__ = [
    "Answer",
    "AttitudeBench",
    "AttitudeRun",
    "Cost",
    "GyroBiasCourse",
    "InputFiles",
    "PeerRun",
    "PositionScore",
    "Reading",
    "RestStretch",
    "SamePose",
    "Score",
    "SecondLog",
    "Share",
    "Trials",
]
