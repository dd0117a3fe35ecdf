"""What a configuration says of a record, its sensors and its place, as far as it can be wrong."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from strapdown.config.alignment import AxesTable, LogTable, SensorsTable
from strapdown.config.crash_checks import Written
from strapdown.errors import ConfigError, nearest
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

    def refuse(self, path: tuple[str, ...], why: str, remedy: str) -> ConfigError:
        """An error at a key."""
        if self._written is None:
            return ConfigError(
                "config.message", quantity=", ".join(path), message=why, remedy_text=remedy
            )
        return self._written.refuse(path, why, remedy)

    def told(self, path: tuple[str, ...], make: Callable[[], Any]) -> Any:
        """Make something; what it refuses is told at a key."""
        try:
            return make()
        except ConfigError as error:
            f = error.finding
            said = [part.strip() for part in (f.quantity or "").split(",")]
            own = [part for part in said if part and part not in path]
            where = (*path, *(own if self._known((*path, *own)) else ()))
            remedy = f.remedy or "give another value"
            if self._written is None:
                raise ConfigError(
                    "config.message", quantity=", ".join(where), message=f.what, remedy_text=remedy
                ) from None
            raise self._written.refuse_as_told(where, f.what, remedy) from None

    def _known(self, path: tuple[str, ...]) -> bool:
        return self._written is None or self._written.has(*path)

    def place(self, table: str, lat_deg: float, lon_deg: float, alt_m: float) -> None:
        """Whether there is such a place."""
        if abs(lat_deg) > 90.0:
            remedy = "give degrees from -90 to 90, north positive"
            if abs(lon_deg) <= 90.0:
                remedy += "; are latitude and longitude exchanged?"
            raise self.refuse((table, "lat_deg"), "a latitude beyond a pole", remedy)
        if abs(lon_deg) > 360.0:
            remedy = "give degrees from -180 to 180, east positive"
            raise self.refuse((table, "lon_deg"), "a longitude of more than a turn", remedy)
        if not -1e4 <= alt_m <= 1e5:
            raise self.refuse((table, "alt_m"), "config.no-height-body-rest-earth")

    def axes(self, axes: AxesTable) -> None:
        """Whether axes are those of a sensor."""
        if axes.axes is not None:
            self.told(("axes", "axes"), lambda: parse_axes(axes.axes or ""))
        if axes.design is not None and axes.design not in NAMED_AXES:
            remedy = nearest(axes.design, NAMED_AXES)
            raise self.refuse(("axes", "design"), "there is no such design", remedy)
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

    def sensors(self, given: SensorsTable, simulation: Any, why: str) -> None:
        """Whether something says how good the sensors are.

        Parameters
        ----------
        given : SensorsTable
        simulation : table or None
            With a sensor of its own, or none.
        why : str
            What is missing without it.
        """
        from strapdown.sensors.catalogue import load_sensor
        from strapdown.sensors.stated_imu import stated_imu

        if given.sensor is None and not given.gyro and not given.accel:
            raise self.refuse(
                ("sensors", "sensor"), "config.nothing-says-how-good-sensors", why=why
            )
        sensor = None
        if given.sensor is not None:
            name = given.sensor
            sensor = self.told(("sensors", "sensor"), lambda: load_sensor(name))
        self.told(("sensors",), lambda: stated_imu(sensor, given.gyro, given.accel))
        simulated = simulation.sensor if simulation is not None else None
        if simulated is not None:
            self.told(("simulation", "sensor"), lambda: load_sensor(simulated))
        if simulation is not None and simulated is None and given.sensor is None:
            raise self.refuse(("simulation", "sensor"), "config.nothing-says-sensor-simulate")

    def span(self, log: LogTable | None) -> float | None:
        """Length of the part of a log that is used, s; None where it does not say it."""
        if log is None:
            return None
        if log.to_s is not None and log.duration_s is not None:
            raise self.refuse(("log", "duration_s"), "config.says-already-2")
        if log.from_s is not None and log.to_s is not None:
            if not log.from_s < log.to_s:
                why = f"it ends before it begins, at {log.from_s:g} s"
                raise self.refuse(("log", "to_s"), why, "give a later instant")
            return log.to_s - log.from_s
        return log.duration_s
