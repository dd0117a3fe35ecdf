"""What calculations say to programmers, in the words of the case file that asked for them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from strapdown.errors import Finding, StrapdownError

__all__ = ["in_case_words", "saying_case_words"]

_IN_PREPARATION = r" \(of reconstruct_crash: in preparation=\{\.\.\.\}\)"
# Longest first where one begins another.
_WORDS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), words)
    for pattern, words in (
        (
            r"give levelling=\(roll, pitch, sd\) in deg, as \(0, 0, ([\d.]+)\) for a level road",
            r"write levelling_deg = [0.0, 0.0] and levelling_sd_deg = \1 for this unit, if the "
            r"road was level",
        ),
        (
            r"rest=\(start, end\) in s" + _IN_PREPARATION,
            "rest_s = [start, end] in s from the trigger",
        ),
        (
            r"say moving_at_impact=False; if its velocity was constant, steady_acceleration=0"
            + _IN_PREPARATION,
            'write kind = "standstill" under [entry]',
        ),
        (
            r"give Entry\.from_speed\(speed, sd\) in m/s; or, for a vehicle that stood until it "
            r"was struck, preparation=\{'moving_at_impact': False\}",
            'write kind = "speed" under [entry], and the speed',
        ),
        (
            r"give Entry\(time, velocity=\(north, east, down\), heading_deg\) or, with "
            r"Entry\.from_speed, climb_sd",
            "write climb_sd_m_per_s under [entry]",
        ),
        (r"give it with time=(-?[\d.]+)", r"write time_s = \1 under [entry]"),
        (
            r"give it in m/s: km/h divided by 3\.6, mph times 0\.44704",
            "check the speed under [entry] and the unit of its key",
        ),
        (r"sampling='mean'", 'sampling = "mean" under [options]'),
        (r"look at EntryState\.fixes", "look at the fixes"),
        (
            r"if the record is in g, multiply it by 9\.80665; otherwise",
            'if the record is in g, write unit = "g" for it; otherwise',
        ),
        (
            r"multiply the accelerations by 9\.80665",
            'write unit = "g" for this accelerometer; the record stays as it is',
        ),
        (
            r"interpolate onto even stamps first, or cut the record at the gap",
            "if it was sampled evenly and only its stamps are not, write rate_hz = its samples a "
            "second; if samples are missing, name a copy of the part around the crash",
        ),
        (
            r"multiply the columns by π/180, so that they are in rad/s",
            'write unit = "deg/s" for the gyro',
        ),
        (r"give Entry\.from_speed\(speed, sd\) in m/s", "write the speed under [entry]"),
        (
            r"CrashUnit\(assumed=Assumed\(turn_sd_deg=\.\.\.\)\)",
            "turn_sd_deg in [units.assumed]",
        ),
        (r"borrow one with gyro_from", "borrow one: gyro_from of the unit names whose"),
        (r"the covariance is", "the stated standard deviation is"),
        (_IN_PREPARATION, ""),
    )
)


def in_case_words(finding: Finding) -> Finding:
    """Say a finding's remedy in the keys of a case file.

    Parameters
    ----------
    finding : Finding

    Returns
    -------
    Finding
        The same where nothing in it is an argument of a function.
    """
    if not finding.remedy:
        return finding
    remedy = finding.remedy
    for pattern, words in _WORDS:
        remedy = pattern.sub(words, remedy)
    return finding if remedy == finding.remedy else replace(finding, remedy=remedy)


@contextmanager
def saying_case_words() -> Iterator[None]:
    """Raise errors of what is inside with their remedies in the keys of a case file."""
    try:
        yield
    except StrapdownError as error:
        said = in_case_words(error.finding)
        if said is error.finding:
            raise
        raise type(error)(
            said.what,
            file=said.file,
            row=said.row,
            quantity=said.quantity,
            remedy=said.remedy,
            line=said.line,
        ) from error
