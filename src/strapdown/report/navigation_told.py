"""What the report of a run of navigation is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import Finding
from strapdown.evaluation.control_points import ControlPointScore
from strapdown.navigation.record import NavigationRecord

__all__ = ["NavigationTold", "Withheld"]


@dataclass(frozen=True)
class Withheld:
    """A stretch over which an aid was kept from the navigator, and what came of it.

    Attributes
    ----------
    aid : str
    begin, end : float, s
    error_m : float
        The largest horizontal distance from what was withheld.
    bound_m : float
        The run's own bound of 95 % at that instant: the longer half axis of its ellipse.
    forward_m : float, optional
        Of a run that is smoothed, what the largest distance was before.
    """

    aid: str
    begin: float
    end: float
    error_m: float
    bound_m: float
    forward_m: float | None = None

    @property
    def inside(self) -> bool:
        """Whether the error is within the bound."""
        return self.error_m <= self.bound_m


@dataclass(frozen=True, eq=False)
class NavigationTold:
    """A run of navigation, and what is known of it beside its own record.

    Attributes
    ----------
    record : NavigationRecord
    forward : NavigationRecord, optional
        Of a run that is smoothed, what the filter alone said.
    name, what : str
        Of the log: its file, and what it is (``recorded log``).
    title : str
        Of the report; made of `name`, if empty.
    chain : tuple of (str, str)
        Slots and what is in them, in words.
    fixes : mapping of str to DataFrame
        By name of the aid, Gnss tables: drawn as points.
    truth : DataFrame, optional
        Trajectory table on the clock of the run.
    truth_name : str
        In words, as they stand after "error against".
    points : ControlPointScore, optional
        The path at its control points.
    withheld : tuple of Withheld
    findings : tuple of Finding
    ellipsoid : Ellipsoid
    lasting : tuple of str
        Names of the aids that state that their errors last.
    """

    record: NavigationRecord
    forward: NavigationRecord | None = None
    name: str = "log"
    what: str = ""
    title: str = ""
    chain: tuple[tuple[str, str], ...] = ()
    fixes: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    truth: pd.DataFrame | None = None
    truth_name: str = "the truth"
    points: ControlPointScore | None = None
    withheld: tuple[Withheld, ...] = ()
    findings: tuple[Finding, ...] = ()
    ellipsoid: Ellipsoid = WGS84
    lasting: tuple[str, ...] = ()
