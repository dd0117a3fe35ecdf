"""Calibrations of simulated units by each procedure: their errors are within their bounds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import beta
from tests.calibrated import PROCEDURES, calibrated

UNITS = 100
#: Kinds of errors by the heads of their names.
KINDS = (
    *("accel_bias", "accel_scale", "accel_misalignment", "gyro_bias", "gyro_scale"),
    *("gyro_misalignment", "g_sensitivity"),
)
#: Kinds that each procedure shows, by the median of their standard deviations beside the prior.
SHOWN = {
    "positions": KINDS,
    "six-position": ("accel_bias", "accel_scale", "gyro_bias", "gyro_scale", "g_sensitivity"),
    "turns": ("gyro_bias", "gyro_scale"),
    "rate-table": ("gyro_bias", "gyro_scale"),
}


@pytest.mark.slow
@pytest.mark.parametrize("procedure", PROCEDURES)
def test_errors_are_within_their_bounds(procedure):
    inside: dict[str, list[np.ndarray]] = {kind: [] for kind in KINDS}
    shares: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for seed in range(UNITS):
        found, error = calibrated(procedure, seed)
        for kind in KINDS:
            own = [k for k, n in enumerate(found.names) if n.rpartition("_")[0] == kind]
            inside[kind].append(np.abs(error[own]) < 1.96 * found.sd[own])
            shares[kind].append(float(np.mean(found.sd[own] / found.prior_sd[own])))
    for kind in SHOWN[procedure]:
        assert np.median(shares[kind]) < 0.5, kind
        count, total = int(np.sum(inside[kind])), np.size(inside[kind])
        # The 99 % interval of the coverage (Clopper and Pearson) reaches 95 %; and bounds are not
        # so wide that every error is within them.
        assert beta.ppf(0.995, count + 1, total - count) >= 0.95, (kind, count, total)
        assert count < total, kind
