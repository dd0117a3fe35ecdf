"""Compile and load everything before the first sample."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import StrapdownError
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import KnownStart, Navigation
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import GapPolicy
from strapdown.navigation.replay import run_by_sample
from strapdown.tables import gnss_table, imu_table

__all__ = ["warm_up"]

#: Samples of a rest: more than a preprocessor needs before the first step.
ROWS, STEP = 80, 0.01


def warm_up(chain: NavigationPipeline, sampling: str = "mean") -> None:
    """Navigate a rest of less than a second with a copy of a pipeline, and discard the result.

    Parameters
    ----------
    chain : NavigationPipeline
    sampling : {'instantaneous', 'mean'}
    """
    time = STEP * np.arange(ROWS)
    force = np.tile([0.0, 0.0, -STANDARD_GRAVITY], (ROWS, 1))
    # Some detectors do not accept constant readings as a rest.
    force[1::2, 0] += 1e-3
    imu = imu_table(time, 1e-5 * force[:, [0, 0, 0]], force, sampling=sampling)
    here = NavState.from_degrees(45.0, 20.0, 0.0)
    start = KnownStart(here, (10.0,) * 3, (1.0,) * 3, (1.0,) * 3, at_first_sample=True)
    own = replace(
        chain,
        modes=(Navigation(),),
        start=start,
        commands=(),
        intake=replace(chain.intake, gaps=GapPolicy()),
    )
    # An error on this rest does not mean an error on the record.
    with suppress(StrapdownError):
        run_by_sample(own, imu, _fixes(chain))


def _fixes(chain: NavigationPipeline) -> dict[str, pd.DataFrame]:
    """Two fixes of each receiver, the first in the middle of the rest."""
    at = 0.5 * ROWS * STEP
    return {
        aid.name: gnss_table(
            np.array([at, at + 2.0 * STEP]) + aid.time_offset,
            np.tile([45.0, 20.0, 0.0], (2, 1)),
            np.zeros((2, 3)),
            (1.0,) * 3,
            (0.1,) * 3,
            np.full(2, float(aid.qualities[0])),
        )
        for aid in chain.navigator.aids
        if isinstance(aid, Gnss)
    }
