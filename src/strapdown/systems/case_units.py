"""The recorders of a case, from its file and the records."""

from __future__ import annotations

from collections.abc import Mapping

from strapdown.config.crash_case import AssumedSpec, TriadSpec, UnitSpec
from strapdown.errors import ConfigError
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.sensors.assumed import Assumed
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.stated_uncertainty import stated_uncertainty

__all__ = ["case_unit"]

# Quantity of a record's channels, and the triad of the catalogue.
TRIADS = {"acceleration": "accel", "rate": "gyro"}


def case_unit(spec: UnitSpec, records: Mapping[str, CrashRecord]) -> CrashUnit:
    """Make a unit of what the case says of it.

    Parameters
    ----------
    spec : UnitSpec
    records : dict of str to CrashRecord
        By path.

    Returns
    -------
    CrashUnit

    Raises
    ------
    DataError
        A channel is not there, or cannot be used.
    ConfigError
        A sensor, a key or a number is none.
    """
    count = len(spec.accelerometers)
    accelerometers = tuple(
        _triad(spec, triad, records, "acceleration", _name(triad, "accelerometer", k, count))
        for k, triad in enumerate(spec.accelerometers, start=1)
    )
    gyro = None
    if spec.gyro is not None:
        gyro = _triad(spec, spec.gyro, records, "rate", spec.gyro.name or "gyro")
    return CrashUnit(
        spec.name,
        accelerometers,
        gyro,
        Mounting(spec.position_m, spec.angles_deg, spec.position_sd_m, spec.angles_sd_deg),
        gyro_from=spec.gyro_from,
        trigger=spec.trigger_s,
        trigger_sd=spec.trigger_sd_s,
        assumed=None if spec.assumed is None else _assumed(spec.assumed),
    )


def _name(triad: TriadSpec, kind: str, number: int, count: int) -> str:
    return triad.name or (kind if count == 1 else f"{kind} {number}")


def _assumed(spec: AssumedSpec) -> Assumed:
    return Assumed(spec.turn_sd_deg, spec.delta_v_sd_m_per_s, spec.over_s, spec.because)


def _triad(
    unit: UnitSpec,
    spec: TriadSpec,
    records: Mapping[str, CrashRecord],
    quantity: str,
    name: str,
) -> RecordedTriad:
    table = triad_of_channels(
        records[spec.path],
        {axis: spec.channels[axis] for axis in ("x", "y", "z") if axis in spec.channels},
        quantity=quantity,
        unit=spec.unit,
        time=spec.time,
        time_unit=spec.time_unit,
        rate_hz=spec.rate_hz,
        sampling=spec.sampling,
    )
    sensor = None if spec.sensor is None else load_sensor(spec.sensor)
    try:
        uncertainty = stated_uncertainty(TRIADS[quantity], spec.uncertainty, sensor)
    except ConfigError as error:
        raise error.replaced(file=f"{unit.name}, {name}") from None
    return RecordedTriad(table, uncertainty, name)
