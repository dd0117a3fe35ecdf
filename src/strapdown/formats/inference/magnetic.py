"""Unit of a magnetometer, from the strength of the Earth's field."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAG_UNITS
from strapdown.formats.inference.conclusion import Inference, conclude, evidence, posterior

Array = NDArray[np.float64]

# The field at the surface is 22 to 67 µT (IGRF-13); iron around it and in the device, where it
# was not calibrated away, adds its own.
_FIELD = (22.0, 67.0)
_IRON = 0.15  # decades, of the tail on either side
_PRIOR = {"uT": 0.75, "nT": 0.05, "gauss": 0.12, "mG": 0.06, "T": 0.02}
_OTHER, _DECADES = 0.05, 12.0


def infer_mag_unit(mag: Array) -> Inference:
    """Conclude the unit of a magnetometer.

    Parameters
    ----------
    mag : ndarray, (n, 3)
        Finite, as it stands in the log.
    """
    usual = float(np.median(np.linalg.norm(mag, axis=1)))
    remedy = evidence("io.evidence-unit-in-name")
    if not usual > 0:
        return Inference("mag_unit", None, 1.0, (evidence("io.evidence-all-zero"), remedy))
    low, high = np.log10(_FIELD)
    height = 1.0 / (high - low + 2.5 * _IRON)
    weights: dict[str | None, float] = {}
    for unit, factor in MAG_UNITS.items():
        where = np.log10(usual * factor)
        off = max(low - where, where - high, 0.0) / _IRON
        weights[unit] = float(np.log(_PRIOR[unit] * height) - 0.5 * off * off)
    weights[None] = float(np.log(_OTHER / _DECADES))
    found = posterior(weights)
    best = next(iter(found))
    if best is None:
        told = evidence("io.evidence-field", norm=usual)
    else:
        field = {"microtesla": usual * MAG_UNITS[best], "low": _FIELD[0], "high": _FIELD[1]}
        told = evidence("io.evidence-field-in-unit", norm=usual, unit=best, **field)
    return conclude("mag_unit", found, (told, remedy))
