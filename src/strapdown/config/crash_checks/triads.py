"""The triads of a case: each channel once, its unit, and how good its sensor is."""

from __future__ import annotations

from collections.abc import Iterator

from strapdown.config.crash_case import CaseSpec, TriadSpec
from strapdown.config.crash_checks.ranges import check_ranges, check_sensor
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_lines import KeyPath
from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS
from strapdown.exceptions import nearest

__all__ = ["check_triads"]

_UNITS = {"accel": ACCEL_UNITS, "gyro": GYRO_UNITS}
_OTHER = {"accel": "gyro", "gyro": "accel"}
_NAMES = {"accel": "an accelerometer", "gyro": "a gyro"}


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
        raise written.missing((*at, "channels"), "nothing says where its axes are recorded")
    for axis, channel in triad.channels.items():
        path = (*at, "channels", axis)
        name = channel.removeprefix("-").strip()
        if not name:
            raise written.refuse(path, "a sign is no channel", 'name it after the sign: "-accel_x"')
        if name == triad.time:
            raise written.contradiction(
                path, (*at, "time"), "time is no axis", "name the channel of the axis"
            )
        before = used.setdefault((triad.path, name), path)
        if before != path:
            gyro = "gyro" in at and "gyro" in before
            raise written.contradiction(
                path,
                before,
                "a channel lies along one axis of one triad",
                'name the other channel; a gyro is lent to another unit by gyro_from = "…"'
                if gyro
                else "name the channel that was recorded along this axis",
            )


def _unit(at: KeyPath, kind: str, triad: TriadSpec, written: Written) -> None:
    # Spellings of other programs are those of the readers, loaded only where a case is read.
    from strapdown.formats.unit_words import unit_of

    if triad.unit is not None:
        unit = unit_of(triad.unit) or triad.unit
        if unit in _UNITS[_OTHER[kind]]:
            raise written.refuse(
                (*at, "unit"),
                f"it is a unit of {_NAMES[_OTHER[kind]]}, and this is {_NAMES[kind]}",
                f"use one of {', '.join(_UNITS[kind])}, or move the channels to where they belong",
            )
    if triad.time_unit is not None:
        unit = unit_of(triad.time_unit) or triad.time_unit
        if unit not in TIME_UNITS:
            raise written.refuse(
                (*at, "time_unit"), "it is no unit of time", nearest(triad.time_unit, TIME_UNITS)
            )
