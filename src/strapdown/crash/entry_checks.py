"""What an entry state cannot be made of."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.crash.entry_estimate import Fixes
from strapdown.errors import ConfigError, DataError, Finding
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
            "crash.no-accelerometer-nothing-carries-velocity",
            file=imu.attrs.get("source"),
            quantity="accel",
        )
    if not (math.isfinite(impact) and math.isfinite(anchor) and anchor <= impact):
        raise ConfigError("crash.anchor-impact", quantity="anchor", anchor=anchor, impact=impact)
    if not 1.0 <= window <= LONGEST_WINDOW:
        raise ConfigError(
            "crash.gnss-window-out-of-range",
            quantity="window",
            window=window,
            longest_window=LONGEST_WINDOW,
        )
    if len(antenna) != 3 or not all(math.isfinite(x) for x in antenna):
        raise ConfigError("crash.antenna-not-three-numbers", quantity="antenna", antenna=antenna)
    sensed = index_of(imu)
    step = float(np.median(np.diff(sensed)))
    if not sensed[0] < anchor <= sensed[-1] + step:
        raise DataError(
            "crash.goes-anchor",
            file=imu.attrs.get("source"),
            quantity="time",
            sensed=sensed[0],
            sensed_2=sensed[-1],
            anchor=anchor,
        )
    sd = values_of(gnss, [*POSITION_SD, *VELOCITY_SD])
    if (sd == 0.0).any():
        row, column = (int(i) for i in np.argwhere(sd == 0.0)[0])
        raise DataError(
            "crash.standard-deviation-zero-nothing-measured",
            file=gnss.attrs.get("source"),
            row=row + 1,
            quantity=[*POSITION_SD, *VELOCITY_SD][column],
        )


def check_enough(fixes: Fixes, why: list[tuple[Finding, ...]], source: str | None) -> None:
    """Refuse to make one of too few fixes, and say where the others went."""
    span = float(np.ptp(fixes.instants)) if len(fixes.instants) else 0.0
    placed = int(np.isfinite(fixes.sd[:, :3]).all(axis=1).sum())
    if min(len(fixes.instants), placed) >= LEAST_FIXES and span >= LEAST_SPAN:
        return
    # Of each kind of reason its first stands for all.
    counts = Counter(f.code for found in why for f in found)
    first = {f.code: f for found in reversed(why) for f in found}
    refused = [
        Finding("crash.fixes-refused", severity="note", count=count, reason=first[code])
        for code, count in counts.items()
    ]
    raise DataError(
        "crash.too-few-fixes" if refused else "crash.too-few-fixes-given",
        file=source,
        quantity="fixes",
        count=len(fixes.instants),
        span=span,
        placed=placed,
        refused=refused,
        least_fixes=LEAST_FIXES,
        least_span=LEAST_SPAN,
    )
