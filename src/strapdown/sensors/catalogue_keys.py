"""What a data sheet of the catalogue may state: the keys with their units, in SI."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown.constants import GYRO_UNITS, STANDARD_GRAVITY

DEG = GYRO_UNITS["deg/s"]
DEG_H = GYRO_UNITS["deg/h"]
G = STANDARD_GRAVITY

# The Allan deviation of a first-order Gauss-Markov process has its maximum at 1.893 correlation
# times, and it is this part of the process's standard deviation (from IEEE Std 952-1997,
# Annex C, C.1.1.5). A data sheet's bias instability is the level of the Allan deviation there.
ALLAN_OF_GAUSS_MARKOV = 0.61736


@dataclass(frozen=True)
class Key:
    """What a key of a sensor file means.

    Attributes
    ----------
    quantity : str
        The attribute of `TriadErrors`, or ``nonlinearity`` or ``output_rate``.
    factor : float
        To SI, of `TriadErrors`.
    spread : str
        How one unit's value comes from the figure: ``value`` as it stands, ``sd`` a normal
        draw, ``bound`` a uniform draw within ±.
    """

    quantity: str
    factor: float
    spread: str = "value"


def _spread(quantity: str, units: dict[str, float]) -> dict[str, Key]:
    return {
        f"{quantity}_{spread}_{unit}": Key(quantity, factor, spread)
        for spread in ("sd", "bound")
        for unit, factor in units.items()
    }


# Without a unit of their own: the same for gyros and accelerometers.
COMMON: dict[str, Key] = {
    **_spread("scale", {"ppm": 1e-6, "percent": 1e-2}),
    **_spread("misalignment", {"mrad": 1e-3, "deg": DEG, "percent": 1e-2}),
    "nonlinearity_bound_ppm": Key("nonlinearity", 1e-6, "bound"),
    "nonlinearity_bound_percent": Key("nonlinearity", 1e-2, "bound"),
    "correlation_time_s": Key("correlation_time", 1.0),
    "bandwidth_hz": Key("bandwidth", 1.0),
    "jitter_us": Key("jitter", 1e-6),
    "output_rate_hz": Key("output_rate", 1.0),
}

GYRO_KEYS: dict[str, Key] = {
    "noise_density_deg_per_s_per_sqrt_hz": Key("noise_density", DEG),
    "noise_density_deg_per_sqrt_h": Key("noise_density", DEG / 60.0),
    "bias_instability_deg_per_h": Key("bias_instability", DEG_H / ALLAN_OF_GAUSS_MARKOV),
    "random_walk_deg_per_h_per_sqrt_h": Key("random_walk", DEG_H / 60.0),
    "trend_deg_per_h_per_h": Key("trend", DEG_H / 3600.0),
    "quantization_deg_per_s": Key("quantization", DEG),
    "full_scale_deg_per_s": Key("full_scale", DEG),
    **_spread("bias", {"deg_per_s": DEG, "deg_per_h": DEG_H}),
    **_spread("g_sensitivity", {"deg_per_s_per_g": DEG / G, "deg_per_h_per_g": DEG_H / G}),
    **COMMON,
}

ACCEL_KEYS: dict[str, Key] = {
    "noise_density_ug_per_sqrt_hz": Key("noise_density", 1e-6 * G),
    "noise_density_m_per_s_per_sqrt_h": Key("noise_density", 1.0 / 60.0),
    "bias_instability_ug": Key("bias_instability", 1e-6 * G / ALLAN_OF_GAUSS_MARKOV),
    "random_walk_ug_per_sqrt_h": Key("random_walk", 1e-6 * G / 60.0),
    "trend_ug_per_h": Key("trend", 1e-6 * G / 3600.0),
    "quantization_mg": Key("quantization", 1e-3 * G),
    "full_scale_g": Key("full_scale", G),
    **_spread("bias", {"mg": 1e-3 * G, "ug": 1e-6 * G}),
    **COMMON,
}

KEYS: dict[str, dict[str, Key]] = {"gyro": GYRO_KEYS, "accel": ACCEL_KEYS}
