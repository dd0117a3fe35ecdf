"""How good the sensors of a case are, and how far they reach: the lowest range comes first."""

from __future__ import annotations

from collections.abc import Mapping

from strapdown.config.crash_case import TriadSpec, UnitSpec
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, StrapdownError

__all__ = ["check_ranges", "check_sensor"]

Triple = tuple[float, float, float]
AXES = ("x", "y", "z")


def check_sensor(at: KeyPath, kind: str, triad: TriadSpec, written: Written) -> None:
    """Check what is said of a triad's errors.

    Parameters
    ----------
    at : tuple
        Path of the triad.
    kind : {'accel', 'gyro'}
    triad : TriadSpec
    written : Written

    Raises
    ------
    ConfigError
        Nothing is said, the sensor is not known or has no such triad, or a key of the
        uncertainty is not known, stands twice in two units, or has no number that it can have.
    """
    if triad.sensor is None and not triad.uncertainty:
        raise written.missing((*at, "sensor"), "config.uncertainty-missing")
    if triad.sensor is not None:
        _known_sensor(at, kind, triad.sensor, written)
    _known_keys(at, kind, triad.uncertainty, written)


def check_ranges(k: int, unit: UnitSpec, written: Written) -> None:
    """Refuse accelerometers of a unit that are not in the order of their ranges.

    Raises
    ------
    ConfigError
        A wider range stands before a narrower one.
    """
    triads = unit.accelerometers
    for n in range(1, len(triads)):
        before, after = _full_scale(triads[n - 1]), _full_scale(triads[n])
        if before is None or after is None:
            continue
        if any(b > a for a, b in zip(after, before, strict=True)):
            raise written.contradiction(
                ("units", k, "accelerometers", n, *_range_key(triads[n])),
                ("units", k, "accelerometers", n - 1, *_range_key(triads[n - 1])),
                "config.ranges-not-ascending",
                before=_in_g(before),
                after=_in_g(after),
            )


def _known_sensor(at: KeyPath, kind: str, name: str, written: Written) -> None:
    # The catalogue is read only with a case.
    from strapdown.sensors.catalogue import SENSORS, load_sensor

    path = (*at, "sensor")
    if name.lower() not in SENSORS and not name.lower().endswith(".toml"):
        raise written.refuse(path, "config.unknown-sensor", word=name, known=SENSORS)
    try:
        sensor = load_sensor(name)
    except StrapdownError as error:
        part = error.finding.quantity
        code = "config.sensor-key-refused" if part else "config.sensor-refused"
        raise written.refuse(path, code, part=part, reason=error.finding) from None
    except (RecursionError, OSError, ValueError) as error:
        raise written.refuse(path, "config.sensor-unreadable", error=type(error).__name__) from None
    if not any(figure.key.startswith(f"{kind}.") for figure in sensor.sources):
        raise written.refuse(
            path,
            "config.sensor-without-gyro"
            if kind == "gyro"
            else "config.sensor-without-accelerometers",
        )


def _known_keys(
    at: KeyPath, kind: str, stated: Mapping[str, float | Triple], written: Written
) -> None:
    from strapdown.sensors.catalogue_keys import KEYS
    from strapdown.sensors.sensor_uncertainty import FACTS, SPREADS

    known = {n: k for n, k in KEYS[kind].items() if k.quantity in SPREADS or k.quantity in FACTS}
    by: dict[str, str] = {}
    for name, given in stated.items():
        path = (*at, "uncertainty", name)
        if name not in known:
            raise written.file.refuse(path, "config.unknown-key", word=name[:100], known=known)
        quantity = known[name].quantity
        if quantity in by:
            raise written.contradiction(
                path,
                (*at, "uncertainty", by[quantity]),
                "config.uncertainty-in-two-units",
                property=quantity.replace("_", " "),
            )
        by[quantity] = name
        _fits(path, quantity, given, written)


def _fits(path: KeyPath, quantity: str, given: float | Triple, written: Written) -> None:
    numbers = given if isinstance(given, tuple) else (given,)
    error: ConfigError | None = None
    if min(numbers) < 0.0:
        error = written.refuse(path, "config.negative-uncertainty")
    elif quantity in ("full_scale", "bandwidth") and min(numbers) == 0.0:
        error = written.refuse(path, "config.zero-uncertainty")
    elif quantity == "bandwidth" and len(numbers) != 1:
        error = written.refuse(path, "config.bandwidth-by-axis")
    if error is not None:
        raise error


def _range_key(triad: TriadSpec) -> KeyPath:
    return ("uncertainty", "full_scale_g") if "full_scale_g" in triad.uncertainty else ("sensor",)


def _full_scale(triad: TriadSpec) -> Triple | None:
    """As stated or by the sensor, g; None where it is not known."""
    from strapdown.sensors.catalogue import load_sensor

    stated = triad.uncertainty.get("full_scale_g")
    if stated is not None:
        return stated if isinstance(stated, tuple) else (stated, stated, stated)
    if triad.sensor is None:
        return None
    figures = load_sensor(triad.sensor).sources
    return next((f.value for f in figures if f.key == "accel.full_scale_g"), None)


def _in_g(values: Triple) -> str:
    return f"{values[0]:g}" if len(set(values)) == 1 else f"[{', '.join(f'{v:g}' for v in values)}]"
