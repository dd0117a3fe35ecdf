"""A change of velocity with its direction of force, both with their bounds."""

from __future__ import annotations

from dataclasses import dataclass, field

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.delta_v import DeltaV
from strapdown.crash.delta_v_bound import DeltaVBound
from strapdown.crash.pdof import NedPdof, Pdof, ned_pdof, pdof
from strapdown.crash.pdof_interval import PdofInterval, pdof_interval
from strapdown.crash.reconstruction_summary import change_line


@dataclass(frozen=True, eq=False)
class VelocityChange:
    """What changed over a window.

    Attributes
    ----------
    window : {'peak', 'event'}
        The trailing window in which the change is largest, or the whole event.
    delta_v : DeltaV
        In its frame: ``body``, as recorders integrate, or ``ned``, gravity taken off through
        the attitude.
    bound : DeltaVBound
    pdof : Pdof or NedPdof
    interval : PdofInterval
        Of the direction, 95 %; of north-east-down, of the azimuth.
    """

    window: str
    delta_v: DeltaV
    bound: DeltaVBound = field(repr=False)
    pdof: Pdof | NedPdof
    interval: PdofInterval

    def __repr__(self) -> str:
        return f"<VelocityChange, {change_line(self)}>"

    @property
    def resultant(self) -> float:
        """Length of the change, m/s."""
        return self.delta_v.resultant

    @property
    def resultant_bound(self) -> float:
        """Half width of the interval that holds 95 % of the resultant, m/s."""
        return TWO_SIDED_95 * self.bound.along(self.delta_v.vector)


@dataclass(frozen=True, eq=False)
class EventChanges:
    """The changes of one event.

    Attributes
    ----------
    peak : VelocityChange
        Over the trailing window in which the change is largest.
    event : VelocityChange
        From time zero to the end.
    """

    peak: VelocityChange
    event: VelocityChange


def velocity_change(
    window: str, change: DeltaV, bound: DeltaVBound, heading_deg: float = 0.0
) -> VelocityChange:
    """Put a change, its bound and its direction together.

    Parameters
    ----------
    window : {'peak', 'event'}
    change : DeltaV
    bound : DeltaVBound
        In the same axes.
    heading_deg : float, deg
        Of the vehicle at the impact, for a change in north-east-down.
    """
    direction = ned_pdof(change, heading_deg) if change.frame == "ned" else pdof(change)
    return VelocityChange(window, change, bound, direction, pdof_interval(change, bound.covariance))
