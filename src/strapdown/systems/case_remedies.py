"""Remedies in the words of a case file, where a stage tells them in those of Python."""

from __future__ import annotations

import re
from dataclasses import replace

from strapdown.exceptions import Finding

__all__ = ["case_finding", "case_remedy"]

_LEVELLING = "levelling_deg and levelling_sd_deg"
# What a stage says, and what it is called in a case.
_WORDS: tuple[tuple[str, str], ...] = (
    (r"use means \(sampling='mean'\)", 'take means (sampling = "mean" under [options])'),
    (r"give it with time=(\S+?);", r"write time_s = \1 under [entry];"),
    (
        r"if the vehicle stood still until it was struck, say moving_at_impact=False; if its "
        r"velocity was constant, steady_acceleration=0 \(of reconstruct_crash: in "
        r"preparation=\{\.\.\.\}\)",
        "if the vehicle stood still over a stretch, name it in rest_s of the unit; else state roll "
        f"and pitch in {_LEVELLING}",
    ),
    (
        r"give levelling=\(roll, pitch, sd\) in deg, as \(0, 0, (\S+?)\) for a level road",
        r"state roll and pitch of the unit: levelling_deg = [0, 0] and levelling_sd_deg = \1 for "
        "a level road",
    ),
    (r"rest=\(start, end\) in s", "rest_s = [start, end] of the unit"),
    (r" \(of reconstruct_crash: in preparation=\{\.\.\.\}\)", ""),
    (
        r"if the record is in g, multiply it by 9\.80665",
        'if the record is in g, say unit = "g" of its accelerometers',
    ),
    (r"multiply the accelerations by 9\.80665", 'say unit = "g" of its accelerometers'),
    (r"multiply the columns by π/180, so that they are in rad/s", 'say unit = "deg/s" of the gyro'),
    (
        r"give Entry\.from_speed\(speed, sd\) in m/s; or, for a vehicle that stood until it was "
        r"struck, preparation=\{'moving_at_impact': False\}",
        "state speed_km_per_h and speed_sd_km_per_h under [entry]; or, for a vehicle that stood "
        "until it was struck, name the stretch in rest_s of the unit",
    ),
    (
        r"give Entry\.from_speed\(speed, sd\) in m/s",
        "state speed_km_per_h and speed_sd_km_per_h under [entry]",
    ),
    (
        r"give Entry\(time, velocity=\(north, east, down\), heading_deg\) or, with "
        r"Entry\.from_speed, climb_sd",
        "state climb_sd_m_per_s under [entry]",
    ),
    (r"CrashUnit\(assumed=Assumed\(turn_sd_deg=\.\.\.\)\)", "turn_sd_deg in [units.assumed]"),
    (r"borrow one with gyro_from", "borrow one: gyro_from of the unit names whose"),
    (r"the covariance is", "the stated standard deviation is"),
)


def case_remedy(remedy: str) -> str:
    """Return a remedy in the words of a case file.

    Parameters
    ----------
    remedy : str

    Returns
    -------
    str
        Itself, where it names nothing of Python.
    """
    for pattern, words in _WORDS:
        remedy = re.sub(pattern, words, remedy)
    return remedy


def case_finding(finding: Finding) -> Finding:
    """Return a finding with its remedy in the words of a case file."""
    return replace(finding, remedy=case_remedy(finding.remedy)) if finding.remedy else finding
