"""How an attitude, or a position reckoned from it, compares with what is known."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PositionScore", "Score"]

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
