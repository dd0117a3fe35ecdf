"""What is known of a run of navigation: the flow of its states, and what was observed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

__all__ = ["Event", "NavigationRecord", "Span"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """Something that happened at an instant.

    Attributes
    ----------
    time : float, s
    kind : str
        ``mode``, ``outage``, ``recovered``, ``rejected``, ``late``, ``gap``, ``command``.
    what : str
        In words.
    """

    time: float
    kind: str
    what: str


@dataclass(frozen=True)
class Span:
    """A time over which something was so: a mode, an outage of an aid.

    Attributes
    ----------
    name : str
    begin, end : float, s
    """

    name: str
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class NavigationRecord:
    """A run of navigation, as it was recorded.

    Attributes
    ----------
    trajectory : DataFrame
        Trajectory table at the rate of the recorder.
    sd : DataFrame
        TrajectoryError table of standard deviations, by time of the marks.
    covariance : ndarray, (m, 9, 9)
        At the marks: displacement m, velocity m/s, rotation rad, north-east-down
        (`mechanization.state_error.state_error`).
    sensors, sensors_sd : DataFrame
        By time of the marks: estimates of the errors of sensors and aids, in SI, and their
        standard deviations; columns as ``gyro_bias_x``, ``rtk.lever_arm_x``.
    units : mapping of str to str
        Unit of each of these columns.
    innovations : mapping of str to DataFrame
        By name of the observation, by time: for each component ``nu LABEL`` (computed less
        observed, less what was expected of it), ``s LABEL`` (its expected variance),
        ``weight LABEL``.
    events : tuple of Event
        In the order of time.
    modes : tuple of Span
    outages : mapping of str to tuple of Span
        By name of the aid.
    """

    trajectory: pd.DataFrame
    sd: pd.DataFrame
    covariance: Array
    sensors: pd.DataFrame
    sensors_sd: pd.DataFrame
    units: Mapping[str, str]
    innovations: Mapping[str, pd.DataFrame]
    events: tuple[Event, ...] = ()
    modes: tuple[Span, ...] = ()
    outages: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
