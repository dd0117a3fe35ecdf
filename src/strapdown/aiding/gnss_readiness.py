"""What to know of a receiver's fixes before a record is navigated with them."""

from __future__ import annotations

import pandas as pd

from strapdown.aiding.gnss import Gnss
from strapdown.aiding.gnss_checks import check_fixes
from strapdown.aiding.gnss_clock import check_overlap, find_time_offset
from strapdown.aiding.gnss_delay import find_velocity_delay, velocity_delay
from strapdown.errors import Finding

__all__ = ["gnss_readiness"]


def gnss_readiness(
    table: pd.DataFrame, imu: pd.DataFrame | None = None, aid: Gnss | None = None
) -> tuple[Finding, ...]:
    """Look at fixes by themselves, and beside the inertial record that they are to aid.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    imu : DataFrame, optional
        Imu table.
    aid : Gnss, optional
        As it is configured: what it has already is not told again.

    Returns
    -------
    tuple of Finding
        Each with the option or the deed that helps.

    Raises
    ------
    DataError
        The fixes cannot be used as they are (`gnss_checks.check_fixes`,
        `gnss_clock.check_overlap`).
    """
    aid = aid or Gnss(name="gnss")
    found = check_fixes(table)
    if aid.use_velocity and aid.use_position:
        found += find_velocity_delay(table, aid.velocity_delay)
    if imu is None:
        return tuple(found)
    found += check_overlap(table, imu, aid.time_offset)
    delay = aid.velocity_delay
    if not delay and (measured := velocity_delay(table)) is not None:
        delay = measured.delay
    found += find_time_offset(table, imu, aid.time_offset, delay, aid.time_offset_sd)
    return tuple(found)
