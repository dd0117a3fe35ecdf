"""What an entry state cannot be made of."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.crash.entry_estimate import Fixes
from strapdown.exceptions import ConfigError, DataError
from strapdown.tables import ACCEL, POSITION_SD, VELOCITY_SD, check_gnss, check_imu
from strapdown.tables.checks import index_of, values_of

# Least of what an entry state can be made of.
LEAST_FIXES = 3
LEAST_SPAN = 1.0  # s
LONGEST_WINDOW = 60.0  # s


def check_arguments(
    imu: pd.DataFrame,
    gnss: pd.DataFrame,
    impact: float,
    window: float,
    anchor: float,
    antenna: Sequence[float],
) -> None:
    """Refuse tables and arguments that no entry state can be made of."""
    check_imu(imu)
    check_gnss(gnss)
    if ACCEL[0] not in imu.columns:
        raise DataError(
            "there is no accelerometer: nothing carries the velocity from fix to fix",
            file=imu.attrs.get("source"),
            quantity="accel",
            remedy="give an Imu table with the specific force in vehicle axes",
        )
    if not (math.isfinite(impact) and math.isfinite(anchor) and anchor <= impact):
        raise ConfigError(
            f"an anchor at {anchor:g} s, with the impact at {impact:g} s",
            quantity="anchor",
            remedy="give the instant of the impact in s, and an anchor not after it",
        )
    if not 1.0 <= window <= LONGEST_WINDOW:
        raise ConfigError(
            f"a window of {window:g} s",
            quantity="window",
            remedy=f"use 1 to {LONGEST_WINDOW:g} s: beyond, the sensitivities lose their meaning",
        )
    if len(antenna) != 3 or not all(math.isfinite(x) for x in antenna):
        raise ConfigError(
            f"{antenna!r} are not three finite numbers",
            quantity="antenna",
            remedy="give forward, right, down from the reference point, in m",
        )
    sensed = index_of(imu)
    step = float(np.median(np.diff(sensed)))
    if not sensed[0] < anchor <= sensed[-1] + step:
        raise DataError(
            f"it goes from {sensed[0]:.6g} s to {sensed[-1]:.6g} s, and the anchor is at "
            f"{anchor:.6g} s",
            file=imu.attrs.get("source"),
            quantity="time",
            remedy="give a record that reaches from before the fixes to the impact, on the same "
            "clock as the impact",
        )
    sd = values_of(gnss, [*POSITION_SD, *VELOCITY_SD])
    if (sd == 0.0).any():
        row, column = (int(i) for i in np.argwhere(sd == 0.0)[0])
        raise DataError(
            "a standard deviation of zero: nothing is measured exactly",
            file=gnss.attrs.get("source"),
            row=row + 1,
            quantity=[*POSITION_SD, *VELOCITY_SD][column],
            remedy="give what the receiver is good for, and inf where it does not measure it",
        )


def check_enough(fixes: Fixes, why: list[str], source: str | None) -> None:
    """Refuse to make one of too few fixes, and say where the others went."""
    span = float(np.ptp(fixes.instants)) if len(fixes.instants) else 0.0
    placed = int(np.isfinite(fixes.sd[:, :3]).all(axis=1).sum())
    if min(len(fixes.instants), placed) >= LEAST_FIXES and span >= LEAST_SPAN:
        return
    # The instant at the end of a reason is one of many.
    reasons = Counter(w.split(" of ")[0] for w in why if w)
    told = "; ".join(f"{count} {what}" for what, count in reasons.items()) or "none was refused"
    raise DataError(
        f"{len(fixes.instants)} fixes over {span:.3g} s are left before the impact, {placed} of "
        f"them with a place; not used: {told}",
        file=source,
        quantity="fixes",
        remedy=f"at least {LEAST_FIXES} with a place over {LEAST_SPAN:g} s are needed: use a "
        "longer window, or take the entry speed from elsewhere",
    )
