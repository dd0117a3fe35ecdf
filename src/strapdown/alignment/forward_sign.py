"""Whether a vehicle drives the way its forward axis points."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.course_fixes import CourseFixes
from strapdown.alignment.drive_sums import DriveSums
from strapdown.errors import DataError
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["check_forward"]

#: A slope so many standard deviations from zero is no chance.
CLEAR = 5.0
LEAST_STEPS = 6


def check_forward(imu: pd.DataFrame, fixes: CourseFixes, sums: DriveSums, reverse: bool) -> None:
    """Compare the force along the forward axis with the change of the speed.

    Parameters
    ----------
    imu : DataFrame
        For its name.
    fixes : CourseFixes
    sums : DriveSums
        At the fixes.
    reverse : bool
        What was taken.

    Raises
    ------
    DataError
        The force falls while the vehicle gains speed. Without six steps from fix to fix, or
        without changes of speed, nothing can be said.
    """
    fast = fixes.fast
    if fast.sum() <= LEAST_STEPS:
        return
    fixes, gained, turned = fixes.only(fast), sums.gained[fast], sums.turned[fast]
    steps = np.diff(fixes.time)
    speed = np.hypot(fixes.velocity[:, 0], fixes.velocity[:, 1])
    gain = np.diff(speed) / steps * (-1.0 if reverse else 1.0)
    force = -np.diff(gained, axis=0) / steps[:, None]
    # Body axes at the end of each step, near enough to those within it for a sign.
    forward = np.einsum("ki,ki->k", turned[1:, :, 0], force)
    x, y = gain - gain.mean(), forward - forward.mean()
    power = float(x @ x)
    if power == 0.0:
        return
    slope = float(x @ y) / power
    left = y - slope * x
    sd = float(np.sqrt(left @ left / (len(x) - 2) / power))
    if not (slope < 0.0 and abs(slope) > CLEAR * sd):
        return
    raise DataError(
        "alignment.drives-other-way",
        file=source_of(imu),
        quantity="heading",
        slope=-slope,
        sd=sd,
        value="false" if reverse else "true",
    )
