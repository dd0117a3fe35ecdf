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
    "turns": ("accel_bias", "gyro_bias", "gyro_scale"),
    "rate-table": ("gyro_bias", "gyro_scale"),
}
#: Units whose bias and scale lie far along the valley that their faces leave open: solutions that
#: stopped in it were up to 4.9 standard deviations off.
FAR = (45, 1022, 1023)


@pytest.mark.slow
@pytest.mark.parametrize("procedure", PROCEDURES)
def test_errors_are_within_their_bounds(procedure):
    inside: dict[str, list[bool]] = {}
    shares: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for seed in range(UNITS):
        found, error = calibrated(procedure, seed)
        for kind in KINDS:
            own = [k for k, n in enumerate(found.names) if n.rpartition("_")[0] == kind]
            shares[kind].append(float(np.mean(found.sd[own] / found.prior_sd[own])))
        # Of every parameter that is said to be observed, by its name and by its kind.
        for k in np.flatnonzero(found.observed):
            within = bool(np.abs(error[k]) < 1.96 * found.sd[k])
            name = found.names[k]
            for key in (name, name.rpartition("_")[0]):
                inside.setdefault(key, []).append(within)
    for kind in SHOWN[procedure]:
        assert np.median(shares[kind]) < 0.5, kind
        # Bounds are not so wide that every error is within them.
        assert not all(inside[kind]), kind
    for name, within in inside.items():
        # The 99 % interval of the coverage (Clopper and Pearson) reaches 95 %.
        count, total = sum(within), len(within)
        assert count == total or beta.ppf(0.995, count + 1, total - count) >= 0.95, (name, count)


def test_the_maximum_is_reached_along_a_curved_valley():
    worst = []
    for seed in FAR:
        found, error = calibrated("turns", seed)
        worst.append(np.abs(error[:6] / found.sd[:6]).max())
    assert max(worst) < 3.0
