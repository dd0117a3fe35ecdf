"""What a person states of gyros and accelerometers together: a data sheet, and what replaces it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import Sensor
from strapdown.sensors.catalogue_keys import KEYS
from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty
from strapdown.sensors.stated_uncertainty import STATED_KEYS, stated_uncertainty
from strapdown.sensors.triad_uncertainty import TriadUncertainty

__all__ = ["STATED_IMU_KEYS", "stated_imu"]

Stated = float | Sequence[float]
DRIFT = ("bias_instability", "correlation_time")

#: By triad, the keys that may be stated, each with its unit.
STATED_IMU_KEYS: dict[str, tuple[str, ...]] = {
    triad: (*STATED_KEYS[triad], *(k for k, key in KEYS[triad].items() if key.quantity in DRIFT))
    for triad in ("gyro", "accel")
}
_NEEDED = {"bias": "bias_sd", "noise_density": "noise_density"}


def stated_imu(
    sensor: Sensor | None, gyro: Mapping[str, Stated], accel: Mapping[str, Stated]
) -> ImuUncertainty:
    """Turn a sensor of the catalogue, and what is stated beside it, into an uncertainty.

    Parameters
    ----------
    sensor : Sensor, optional
        What is not stated is as its data sheet has it.
    gyro, accel : dict
        By key of the catalogue: one number, or three.

    Returns
    -------
    ImuUncertainty

    Raises
    ------
    ConfigError
        A key is unknown, a number is none, or bias or noise of a triad is neither stated nor in
        the data sheet: with zero in their place every bound would be one of a perfect sensor.
    """
    base = None if sensor is None else ImuUncertainty.of_sensor(sensor)
    triads: dict[str, TriadUncertainty] = {}
    drifts: dict[str, BiasDrift] = {}
    for triad, stated in (("gyro", gyro), ("accel", accel)):
        slow = {
            k: v for k, v in stated.items() if k in KEYS[triad] and _quantity(triad, k) in DRIFT
        }
        fixed = {k: v for k, v in stated.items() if k not in slow}
        try:
            triads[triad] = stated_uncertainty(triad, fixed, sensor)
        except ConfigError as error:
            # A sensor's triad is stated under its own name.
            place = (error.finding.quantity or "").replace("uncertainty", triad)
            raise error.replaced(quantity=place) from None
        drifts[triad] = _drift(
            triad, slow, None if base is None else getattr(base, f"{triad}_drift")
        )
        _require(triad, triads[triad])
    return ImuUncertainty(triads["gyro"], triads["accel"], drifts["gyro"], drifts["accel"])


def _quantity(triad: str, key: str) -> str:
    return KEYS[triad][key].quantity


def _drift(triad: str, stated: Mapping[str, Stated], base: BiasDrift | None) -> BiasDrift:
    drift = base or BiasDrift()
    sd, time = drift.sd, drift.correlation_time
    for name, given in stated.items():
        factor = KEYS[triad][name].factor
        if _quantity(triad, name) == "bias_instability":
            one = isinstance(given, int | float)
            sd = given * factor if one else tuple(factor * x for x in given)  # type: ignore
        elif isinstance(given, int | float):
            time = float(given) * factor
        else:
            raise ConfigError("sensors.time-belongs-all-axes", quantity=f"{triad}, {name}")
    return BiasDrift(sd, time if time > 0.0 else math.inf)


def _require(triad: str, known: TriadUncertainty) -> None:
    for attribute, said in _NEEDED.items():
        value = getattr(known, attribute)
        sizes = (value,) if isinstance(value, int | float) else tuple(value)
        if max(sizes) > 0.0:
            continue
        keys = [k for k in STATED_KEYS[triad] if k.startswith(said)]
        raise ConfigError(
            "sensors.bias-not-stated" if attribute == "bias" else "sensors.noise-not-stated",
            quantity=f"{triad}, {said}",
            triad=triad,
            keys=keys[:2],
        )
