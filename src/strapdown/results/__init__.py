"""Frozen results: what a run found, with what a reader needs to judge it."""

from __future__ import annotations

from strapdown.results.answer import Answer, Cost, Share, Trials
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.results.inputs import InputFiles, Reading
from strapdown.results.rests import GyroBiasCourse, RestStretch, SamePose
from strapdown.results.runs import AttitudeRun, PeerRun
from strapdown.results.scores import PositionScore, Score
from strapdown.results.second_log import SecondLog

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
