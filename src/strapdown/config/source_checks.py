"""What a configuration says of a record, its sensors and its place, as far as it can be wrong."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from strapdown.config.alignment import AxesTable, LogTable, SensorsTable
from strapdown.config.crash_checks import Written
from strapdown.errors import ConfigError
from strapdown.formats.columns import parse_axes
from strapdown.formats.unit_words import parse_unit
from strapdown.sensors.axes_matrix import NAMED_AXES, check_axes_matrix

__all__ = ["MOST_SAMPLES", "SourceChecks"]

#: An hour at 4 kHz.
MOST_SAMPLES = 1.5e7


class SourceChecks:
    """Checks that alignments and runs of navigation share.

    Parameters
    ----------
    written : Written or None
        The file, for lines in messages.
    """

    def __init__(self, written: Written | None) -> None:
        self._written = written

    def refuse(self, path: tuple[str, ...], code: str, /, **data: Any) -> ConfigError:
        """Return an error at a key."""
        if self._written is None:
            return ConfigError(code, quantity=", ".join(path), **data)
        return self._written.refuse(path, code, **data)

    def told(self, path: tuple[str, ...], make: Callable[[], Any]) -> Any:
        """Make something; what it refuses is told at a key."""
        try:
            return make()
        except ConfigError as error:
            f = error.finding
            said = [part.strip() for part in (f.quantity or "").split(",")]
            own = [part for part in said if part and part not in path]
            where = (*path, *(own if self._known((*path, *own)) else ()))
            if self._written is None:
                quantity = ", ".join(where)
                raise error.replaced(file=None, row=None, line=None, quantity=quantity) from None
            raise self._written.located(where, f) from None

    def _known(self, path: tuple[str, ...]) -> bool:
        return self._written is None or self._written.has(*path)

    def place(self, table: str, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        """Whether there is such a place."""
        if abs(lat_deg) > 90.0:
            exchanged = abs(lon_deg) <= 90.0
            code = "config.latitude-longitude-exchanged" if exchanged else "config.latitude-beyond"
            raise self.refuse((table, "lat_deg"), code)
        if abs(lon_deg) > 360.0:
            raise self.refuse((table, "lon_deg"), "config.longitude-beyond")
        if not -1e4 <= alt_m <= 1e5:
            raise self.refuse((table, "alt_m"), "config.height-out-of-range")

    def axes(self, axes: AxesTable) -> None:
        """Whether axes are those of a sensor."""
        if axes.axes is not None:
            self.told(("axes", "axes"), lambda: parse_axes(axes.axes or ""))
        if axes.design is not None and axes.design not in NAMED_AXES:
            raise self.refuse(
                ("axes", "design"), "config.unknown-axes", word=axes.design, known=NAMED_AXES
            )
        for name in ("matrix", "gyro_matrix", "accel_matrix"):
            matrix = getattr(axes, name)
            if matrix is not None:
                self.told(("axes", name), partial(check_axes_matrix, matrix, name))

    def log(self, log: LogTable | None) -> None:
        """Whether there are such units."""
        for kind in ("gyro", "accel", "time"):
            unit = getattr(log, f"{kind}_unit", None)
            if unit is not None:
                self.told(("log", f"{kind}_unit"), partial(parse_unit, unit, kind))

    def sensors(self, given: SensorsTable, simulation: Any, missing: str) -> None:
        """Whether something says how good the sensors are.

        Parameters
        ----------
        given : SensorsTable
        simulation : table or None
            With a sensor of its own, or none.
        missing : str
            Code of the error where nothing does.
        """
        from strapdown.sensors.catalogue import load_sensor
        from strapdown.sensors.stated_imu import stated_imu

        if given.sensor is None and not given.gyro and not given.accel:
            raise self.refuse(("sensors", "sensor"), missing)
        sensor = None
        if given.sensor is not None:
            name = given.sensor
            sensor = self.told(("sensors", "sensor"), lambda: load_sensor(name))
        self.told(("sensors",), lambda: stated_imu(sensor, given.gyro, given.accel))
        simulated = simulation.sensor if simulation is not None else None
        if simulated is not None:
            self.told(("simulation", "sensor"), lambda: load_sensor(simulated))
        if simulation is not None and simulated is None and given.sensor is None:
            raise self.refuse(("simulation", "sensor"), "config.no-sensor-to-simulate")

    def span(self, log: LogTable | None) -> float | None:
        """Length of the part of a log that is used, s; None where it does not say it."""
        if log is None:
            return None
        if log.to_s is not None and log.duration_s is not None:
            raise self.refuse(("log", "duration_s"), "config.span-stated-twice")
        if log.from_s is not None and log.to_s is not None:
            if not log.from_s < log.to_s:
                raise self.refuse(("log", "to_s"), "config.end-before-begin", begin=log.from_s)
            return log.to_s - log.from_s
        return log.duration_s
