"""The triads of a case: each channel once, its unit, and how good its sensor is."""

from __future__ import annotations

from collections.abc import Iterator

from strapdown.config.crash_case import CaseSpec, TriadSpec
from strapdown.config.crash_checks.ranges import check_ranges, check_sensor
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_lines import KeyPath
from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS

__all__ = ["check_triads"]

_UNITS = {"accel": ACCEL_UNITS, "gyro": GYRO_UNITS}
_OTHER = {"accel": "gyro", "gyro": "accel"}


def check_triads(spec: CaseSpec, written: Written) -> None:
    """Check channels, units and sensors.

    Raises
    ------
    ConfigError
        A channel is used twice, a unit is none of the triad, a sensor is not known, nothing says
        how good it is, or a wide range stands before a narrow one.
    """
    used: dict[tuple[str, str], KeyPath] = {}
    for at, kind, triad in _triads(spec):
        _channels(at, triad, used, written)
        _unit(at, kind, triad, written)
        check_sensor(at, kind, triad, written)
    for k, unit in enumerate(spec.units):
        check_ranges(k, unit, written)


def _triads(spec: CaseSpec) -> Iterator[tuple[KeyPath, str, TriadSpec]]:
    for k, unit in enumerate(spec.units):
        for n, triad in enumerate(unit.accelerometers):
            yield ("units", k, "accelerometers", n), "accel", triad
        if unit.gyro is not None:
            yield ("units", k, "gyro"), "gyro", unit.gyro


def _channels(
    at: KeyPath, triad: TriadSpec, used: dict[tuple[str, str], KeyPath], written: Written
) -> None:
    if not triad.channels:
        raise written.missing((*at, "channels"), "config.channels-missing")
    for axis, channel in triad.channels.items():
        path = (*at, "channels", axis)
        name = channel.removeprefix("-").strip()
        if not name:
            raise written.refuse(path, "config.sign-without-channel")
        if name == triad.time:
            raise written.contradiction(path, (*at, "time"), "config.time-as-axis")
        before = used.setdefault((triad.path, name), path)
        if before != path:
            gyro = "gyro" in at and "gyro" in before
            raise written.contradiction(
                path,
                before,
                "config.gyro-channel-used-twice" if gyro else "config.channel-used-twice",
            )


def _unit(at: KeyPath, kind: str, triad: TriadSpec, written: Written) -> None:
    # Spellings of other programs are those of the readers, loaded only where a case is read.
    from strapdown.formats.unit_words import unit_of

    if triad.unit is not None:
        unit = unit_of(triad.unit) or triad.unit
        if unit in _UNITS[_OTHER[kind]]:
            raise written.refuse(
                (*at, "unit"),
                "config.gyro-unit-of-accelerometers"
                if kind == "accel"
                else "config.accelerometer-unit-of-gyro",
                units=_UNITS[kind],
            )
    if triad.time_unit is not None:
        unit = unit_of(triad.time_unit) or triad.time_unit
        if unit not in TIME_UNITS:
            raise written.refuse(
                (*at, "time_unit"),
                "config.unknown-time-unit",
                word=triad.time_unit,
                known=TIME_UNITS,
            )
