"""Sensor catalogue: named sensors with their data-sheet values and sources."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.sensors.error_chain import child
from strapdown.sensors.triad_errors import ImuErrors, Triad, TriadErrors, matrix_of, triad_of
from strapdown.units import GYRO_UNITS

FOLDER = Path(__file__).with_suffix("")
#: Names of the sensors supplied with strapdown; listing them reads no file content.
SENSORS: tuple[str, ...] = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
GRADES = ("phone", "industrial", "tactical", "navigation", "crash")

TOP = ("title", "class", "summary", "sources", "gyro", "accel")
FIGURE = ("value", "source", "place", "assumed")
# Largest figure of a data sheet in any unit; squares of larger ones would overflow.
LARGEST = 1e12
# Key in the seed tree, beside those of the triads in a simulation; the quantities drawn for a unit,
# in the order of their keys below it.
DRAW_SEED = 2
DRAWN = ("bias", "scale", "misalignment", "g_sensitivity", "nonlinearity")


@dataclass(frozen=True)
class Figure:
    """One value of a data sheet.

    Attributes
    ----------
    key : str
        As in the file, with the triad: ``gyro.bias_bound_deg_per_s``.
    value : triad
        In the unit of the key.
    source : str
        Document and location in it; empty for an assumed value.
    assumed : str
        Reason for the assumption; empty for a value with a source.
    """

    key: str
    value: Triad
    source: str
    assumed: str


@dataclass(frozen=True)
class Spread:
    """Unit-to-unit variation of a quantity, in SI: ``sd`` (normal) or ``bound`` (uniform)."""

    kind: str
    size: Triad


@dataclass(frozen=True)
class Sensor:
    """A sensor of the catalogue, or of a file in the same form.

    Attributes
    ----------
    name, title, summary : str
    grade : str
        The file's ``class``: ``phone``, ``industrial``, ``tactical``, ``navigation``, ``crash``.
    imu_errors : ImuErrors
        Errors common to all units. A missing triad has no errors (gyro) or is None (accelerometer).
    spreads : dict
        Unit-to-unit variation, by triad and quantity.
    rates : dict
        Highest output rate in Hz, by triad.
    sources : tuple of Figure
        Every value with its source.
    """

    name: str
    title: str
    summary: str
    grade: str
    imu_errors: ImuErrors
    spreads: Mapping[str, Mapping[str, Spread]]
    rates: Mapping[str, float]
    sources: tuple[Figure, ...]

    def draw(self, seed: int) -> ImuErrors:
        """Draw the errors of one unit.

        Parameters
        ----------
        seed : int
            Identifies the unit. Bias, scale factor, misalignment, g-sensitivity and nonlinearity
            are drawn within the data-sheet limits, each axis from its own stream.
        """
        gyro = _unit(self.imu_errors.gyro, self.spreads.get("gyro", {}), seed, 0)
        accel = self.imu_errors.accel
        if accel is not None:
            accel = _unit(accel, self.spreads.get("accel", {}), seed, 1)
        return ImuErrors(gyro, accel)


def load_sensor(name: str | Path) -> Sensor:
    """Read a sensor.

    Parameters
    ----------
    name : str or Path
        One of `SENSORS`, or the path of a file that ends in ``.toml``.

    Raises
    ------
    ConfigError
        The sensor is unknown, or the file is not in the form of the catalogue; the message names
        the file and the key.
    """
    text = str(name)
    if text.lower() in SENSORS:
        return _read(FOLDER / f"{text.lower()}.toml")
    path = Path(text)
    if path.suffix.lower() != ".toml":
        raise ConfigError(
            "sensors.no-sensor", quantity="sensor", text=text, word=text.lower(), known=SENSORS
        )
    if not path.is_file():
        raise ConfigError("sensors.no-such-file", file=text)
    return _read(path)


def _read(path: Path) -> Sensor:
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # an integer of 4,301 digits is a ValueError
        raise ConfigError("sensors.no-toml", file=path.name, error=error) from None
    except OSError as error:
        raise ConfigError("sensors.no-toml", file=path.name, error=error.strerror) from None
    if "procedure" in table and "class" not in table:
        raise ConfigError("sensors.calibration-as-sensor", file=path.name, quantity="sensor")
    _known(table, TOP, path, "")
    title, summary, grade = (_text(table, key, path) for key in ("title", "summary", "class"))
    if grade not in GRADES:
        raise _bad(path, "class", "sensors.no-class", grade=grade, word=grade, known=GRADES)
    documents = table.get("sources", {})
    if not isinstance(documents, dict):
        raise _bad(path, "sources", "sensors.sources-not-a-table")
    figures: list[Figure] = []
    triads: dict[str, TriadErrors] = {}
    spreads: dict[str, dict[str, Spread]] = {}
    rates: dict[str, float] = {}
    for triad in ("gyro", "accel"):
        if triad in table:
            triads[triad], spreads[triad] = _triad(table[triad], triad, documents, path, figures)
            rates.update((triad, f.value[0]) for f in figures if f.key == f"{triad}.output_rate_hz")
    if not triads:
        raise _bad(path, "gyro, accel", "sensors.sensor-without-triads")
    return Sensor(
        path.stem,
        title,
        summary,
        grade,
        ImuErrors(triads.get("gyro", TriadErrors()), triads.get("accel")),
        spreads,
        rates,
        tuple(figures),
    )


def _triad(
    table: Any, triad: str, documents: Mapping[str, Any], path: Path, figures: list[Figure]
) -> tuple[TriadErrors, dict[str, Spread]]:
    if not isinstance(table, dict):
        raise _bad(path, triad, "sensors.triad-not-a-table", triad=triad)
    _known(table, KEYS[triad], path, f"{triad}.")
    errors: dict[str, Any] = {}
    spreads: dict[str, Spread] = {}
    for name, entry in table.items():
        key, place = KEYS[triad][name], f"{triad}.{name}"
        figure = _figure(entry, place, documents, path)
        figures.append(figure)
        if key.quantity == "output_rate":
            continue
        if key.quantity in errors or key.quantity in spreads:
            raise _bad(path, place, "sensors.quantity-stated-twice")
        size = triad_of([x * key.factor for x in figure.value])
        if key.spread != "value":
            spreads[key.quantity] = Spread(key.spread, size)
        elif key.quantity in ("correlation_time", "bandwidth", "jitter"):
            errors[key.quantity] = size[0]
        else:
            errors[key.quantity] = size
    if "bias_instability" in errors and "correlation_time" not in errors:
        raise _bad(path, f"{triad}.correlation_time_s", "sensors.bias-instability-needs-missing")
    try:
        nominal = TriadErrors(**errors)
        # The worst-case unit must be valid, or a draw would fail for some seeds.
        _worst(nominal, spreads)
    except ConfigError as error:
        place = f"{triad}: {error.finding.quantity}"
        raise error.replaced(file=path.name, quantity=place) from None
    return nominal, spreads


def _figure(entry: Any, place: str, documents: Mapping[str, Any], path: Path) -> Figure:
    if not isinstance(entry, dict):
        raise _bad(path, place, "sensors.figure-without-source", entry=repr(entry))
    _known(entry, FIGURE, path, f"{place}.")
    given = entry.get("value")
    numbers: list[Any] = given if isinstance(given, list) else [given] * 3
    if len(numbers) != 3 or not all(
        isinstance(x, int | float) and not isinstance(x, bool) and 0.0 <= x <= LARGEST
        for x in numbers
    ):
        raise _bad(path, place, "sensors.figure-not-a-number", given=given)
    source, assumed = entry.get("source", ""), entry.get("assumed", "")
    if bool(source) == bool(assumed):
        raise _bad(path, place, "sensors.figure-source-or-reason")
    if source:
        if not isinstance(source, str) or source not in documents:
            raise _bad(
                path, place, "sensors.no-source", source=source, word=str(source), known=documents
            )
        where = entry.get("place", "")
        source = f"{documents[source]}, {where}" if where else str(documents[source])
    return Figure(place, triad_of(numbers), source, str(assumed))


def _unit(
    nominal: TriadErrors, spreads: Mapping[str, Spread], seed: int, triad: int
) -> TriadErrors:
    values: dict[str, Any] = {}
    for k, quantity in enumerate(DRAWN):
        if quantity not in spreads:
            continue
        spread = spreads[quantity]
        rows = []
        for axis in range(3):
            place = child(seed, DRAW_SEED, triad, k, axis)
            draw = np.random.Generator(np.random.PCG64(place))
            normal = spread.kind == "sd"
            unit = draw.standard_normal(3) if normal else draw.uniform(-1.0, 1.0, 3)
            rows.append(spread.size[axis] * unit)
        values.update(_placed(quantity, np.array(rows)))
    return replace(nominal, **values)


def _worst(nominal: TriadErrors, spreads: Mapping[str, Spread]) -> TriadErrors:
    """Make a unit with every bounded quantity at its bound, and others at 6 sd."""
    values: dict[str, Any] = {}
    for quantity, spread in spreads.items():
        size = np.asarray(spread.size) * (6.0 if spread.kind == "sd" else 1.0)
        values.update(_placed(quantity, -np.tile(size[:, None], (1, 3))))
    return replace(nominal, **values)


def _placed(quantity: str, rows: np.ndarray[Any, Any]) -> dict[str, Any]:
    """Assign three values per axis to the attributes of a quantity."""
    if quantity == "misalignment":
        matrix = rows.copy()
        np.fill_diagonal(matrix, 0.0)
        return {quantity: matrix_of(matrix)}
    if quantity == "g_sensitivity":
        return {quantity: matrix_of(rows)}
    if quantity == "nonlinearity":
        # Second and third order share the bound, so that their sum stays within it.
        return {f"nonlinearity_{k + 2}": tuple(0.5 * rows[:, k]) for k in (0, 1)}
    return {quantity: tuple(rows[:, 0])}


def _known(table: Mapping[str, Any], known: Any, path: Path, prefix: str) -> None:
    for key in table:
        if key not in known:
            raise _bad(path, f"{prefix}{key}", "sensors.no-such-key", word=key, known=known)


def _text(table: Mapping[str, Any], key: str, path: Path) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value:
        raise _bad(path, key, "sensors.missing-or-no-text", name=key)
    return value


def _bad(path: Path, key: str, code: str, **values: Any) -> ConfigError:
    return ConfigError(code, file=path.name, quantity=key, data=values)


# Keys that a sensor file may contain, with their units.

DEG = GYRO_UNITS["deg/s"]
DEG_H = GYRO_UNITS["deg/h"]
G = STANDARD_GRAVITY

# The Allan deviation of a first-order Gauss-Markov process has its maximum at 1.893 correlation
# times, where it is this fraction of the process's standard deviation (from IEEE Std 952-1997,
# Annex C, C.1.1.5). A data sheet's bias instability is that maximum.
ALLAN_OF_GAUSS_MARKOV = 0.61736


@dataclass(frozen=True)
class Key:
    """Meaning of a key of a sensor file.

    `quantity`: the attribute of `TriadErrors`, or ``nonlinearity`` or ``output_rate``. `factor`:
    converts to the SI units of `TriadErrors`. `spread`: how a unit's value follows from the figure:
    ``value`` unchanged, ``sd`` a normal draw, ``bound`` a uniform draw within ±.
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


# Keys without a unit: the same for gyros and accelerometers.
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
