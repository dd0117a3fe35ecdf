"""What a data sheet leaves unknown of a unit, as standard deviations."""

from __future__ import annotations

import math
from typing import Any

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import Sensor, Spread
from strapdown.sensors.triad_errors import Triad, TriadLike
from strapdown.sensors.triad_uncertainty import TriadUncertainty

TRIADS = ("gyro", "accel")
# Quantities of a data sheet, and the attribute of `TriadUncertainty` that holds their spread.
SPREADS = {
    "bias": "bias",
    "scale": "scale",
    "misalignment": "misalignment",
    "g_sensitivity": "g_sensitivity",
    "nonlinearity": "nonlinearity_2",
}
FACTS = ("noise_density", "full_scale", "quantization", "bandwidth")


def uncertainty_of(sensor: Sensor, triad: str, **overrides: TriadLike) -> TriadUncertainty:
    """Turn a sensor of the catalogue into what is not known of one of its units.

    Parameters
    ----------
    sensor : Sensor
    triad : {'gyro', 'accel'}
    **overrides : triad
        Attributes of `TriadUncertainty`, in its units, that replace the data sheet's: what a
        calibration or a record has told.

    Returns
    -------
    TriadUncertainty
        A standard deviation of the data sheet as it stands, a bound over √3 (that of a uniform
        distribution). The bound of a nonlinearity is given to its second order as a whole: the
        third leaves no mean, and a data sheet does not tell them apart. Drifts within a record
        (bias instability, random walk, trend) have no place here.

    Raises
    ------
    ConfigError
        The sensor has no such triad, or an override is none of the attributes.
    """
    if triad not in TRIADS or not any(f.key.startswith(f"{triad}.") for f in sensor.sources):
        raise ConfigError(
            "sensors.sensor-no-triad",
            quantity="triad",
            name=sensor.name,
            triad=triad,
            triads=TRIADS,
        )
    errors = sensor.imu_errors.gyro if triad == "gyro" else sensor.imu_errors.accel
    values: dict[str, Any] = {name: getattr(errors, name) for name in FACTS}
    spreads = sensor.spreads.get(triad, {})
    values.update((SPREADS[name], _sd(spread)) for name, spread in spreads.items())
    try:
        return TriadUncertainty(**{**values, **overrides})
    except TypeError:
        known = TriadUncertainty.__dataclass_fields__
        wrong = ", ".join(name for name in overrides if name not in known)
        raise ConfigError(
            "sensors.triad-no", quantity="overrides", wrong=wrong, known=known
        ) from None


def _sd(spread: Spread) -> Triad:
    part = 1.0 if spread.kind == "sd" else 1.0 / math.sqrt(3.0)
    x, y, z = spread.size
    return (x * part, y * part, z * part)
