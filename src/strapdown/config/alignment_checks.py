"""What an alignment says against itself, or a module refuses: told before anything runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import home_of
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.choice import make_choice
from strapdown.config.crash_checks import Written
from strapdown.config.slots import SLOTS
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.exceptions import ConfigError, nearest
from strapdown.formats.columns import parse_axes, parse_unit
from strapdown.sensors.axes_matrix import NAMED_AXES, check_axes_matrix

__all__ = ["NOT_BEFORE_FINE", "check_alignment"]


def check_alignment(spec: AlignmentSpec, written: Written | None = None) -> None:
    """Refuse what cannot be meant.

    Parameters
    ----------
    spec : AlignmentSpec
    written : Written, optional
        The file that it was read from, for lines in messages.

    Raises
    ------
    ConfigError
        A module refuses an option, the place is none, a matrix is no rotation, a sensor is not
        known or says too little, or times contradict one another.
    """
    check = _Checks(written)
    check.site(spec)
    check.axes(spec)
    check.log(spec)
    check.sensors(spec)
    check.times(spec)
    check.stages(spec)
    check.chain(spec)


class _Checks:
    def __init__(self, written: Written | None) -> None:
        self._written = written

    def refuse(self, path: tuple[str, ...], why: str, remedy: str) -> ConfigError:
        if self._written is None:
            return ConfigError(why, quantity=", ".join(path), remedy=remedy)
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
                raise ConfigError(f.what, quantity=", ".join(where), remedy=remedy) from None
            raise self._written.refuse_as_told(where, f.what, remedy) from None

    def _known(self, path: tuple[str, ...]) -> bool:
        return self._written is None or self._written.has(*path)

    def site(self, spec: AlignmentSpec) -> None:
        site = spec.site
        if abs(site.lat_deg) > 90.0:
            remedy = "give degrees from -90 to 90, north positive"
            if abs(site.lon_deg) <= 90.0:
                remedy += "; are latitude and longitude exchanged?"
            raise self.refuse(("site", "lat_deg"), "a latitude beyond a pole", remedy)
        if abs(site.lon_deg) > 360.0:
            remedy = "give degrees from -180 to 180, east positive"
            raise self.refuse(("site", "lon_deg"), "a longitude of more than a turn", remedy)
        if not -1e4 <= site.alt_m <= 1e5:
            raise self.refuse(
                ("site", "alt_m"), "no height of a body at rest on the Earth", "give metres"
            )
        self.told(("site", "ellipsoid"), lambda: find_ellipsoid(site.ellipsoid))

    def axes(self, spec: AlignmentSpec) -> None:
        axes = spec.axes
        if axes.axes is not None:
            self.told(("axes", "axes"), lambda: parse_axes(axes.axes or ""))
        if axes.design is not None and axes.design not in NAMED_AXES:
            remedy = nearest(axes.design, NAMED_AXES)
            raise self.refuse(("axes", "design"), "there is no such design", remedy)
        for name in ("matrix", "gyro_matrix", "accel_matrix"):
            matrix = getattr(axes, name)
            if matrix is not None:
                self.told(("axes", name), partial(check_axes_matrix, matrix, name))

    def log(self, spec: AlignmentSpec) -> None:
        for kind in ("gyro", "accel", "time"):
            unit = getattr(spec.log, f"{kind}_unit", None)
            if unit is not None:
                self.told(("log", f"{kind}_unit"), partial(parse_unit, unit, kind))

    def sensors(self, spec: AlignmentSpec) -> None:
        from strapdown.sensors.catalogue import load_sensor
        from strapdown.sensors.stated_imu import stated_imu

        given = spec.sensors
        if given.sensor is None and not given.gyro and not given.accel:
            raise self.refuse(
                ("sensors", "sensor"),
                "nothing says how good the sensors are, and without that no attitude has a bound: "
                "a gyro bias of 0.01 deg/h is 0.05° of heading",
                "write sensor = …, a name of the catalogue (strapdown modules) or a .toml file, "
                "or state bias and noise in [sensors.gyro] and [sensors.accel]",
            )
        sensor = None
        if given.sensor is not None:
            name = given.sensor
            sensor = self.told(("sensors", "sensor"), lambda: load_sensor(name))
        self.told(("sensors",), lambda: stated_imu(sensor, given.gyro, given.accel))
        simulated = spec.simulation.sensor if spec.simulation is not None else None
        if simulated is not None:
            self.told(("simulation", "sensor"), lambda: load_sensor(simulated))
        if spec.simulation is not None and simulated is None and given.sensor is None:
            raise self.refuse(
                ("simulation", "sensor"),
                "nothing says which sensor to simulate",
                "write sensor = … here or in [sensors]",
            )

    def times(self, spec: AlignmentSpec) -> None:
        log = spec.log
        if log is not None and log.to_s is not None and log.duration_s is not None:
            remedy = "keep one of the two"
            raise self.refuse(("log", "duration_s"), "to_s says it already", remedy)
        if (
            log is not None
            and log.from_s is not None
            and log.to_s is not None
            and not log.from_s < log.to_s
        ):
            why = f"it ends before it begins, at {log.from_s:g} s"
            raise self.refuse(("log", "to_s"), why, "give a later instant")
        if spec.simulation is not None:
            longest = spec.simulation.duration_s
            if spec.simulation.rate_hz * longest > MOST_SAMPLES:
                raise self.refuse(
                    ("simulation", "duration_s"),
                    f"{spec.simulation.rate_hz * longest:.3g} samples are too many",
                    f"stay below {MOST_SAMPLES:.0e}: a lower rate_hz, or a shorter duration_s",
                )
        elif log is not None and log.duration_s is not None:
            longest = log.duration_s
        elif log is not None and log.from_s is not None and log.to_s is not None:
            longest = log.to_s - log.from_s
        else:
            return
        if spec.coarse.duration_s is not None and spec.coarse.duration_s > longest:
            raise self.refuse(
                ("coarse", "duration_s"),
                f"it is longer than the record's {longest:g} s",
                "give less, or leave it out",
            )

    def stages(self, spec: AlignmentSpec) -> None:
        given = {"ellipsoid": spec.site.ellipsoid}
        for name in ("prefilter", "coarse", "fine"):
            self.told((name,), partial(make_choice, getattr(spec, name), SLOTS[name], given))

    def chain(self, spec: AlignmentSpec) -> None:
        """What one stage leaves, and another needs."""
        kind = spec.coarse.kind
        if kind in NEEDS_GNSS and spec.gnss is None:
            raise self.refuse(
                ("coarse", "kind"),
                "it takes the course from satellite fixes, and none are given",
                "write [gnss] and path = … below it, or take another kind",
            )
        if spec.gnss is not None and kind not in NEEDS_GNSS:
            raise self.refuse(
                ("gnss", "path"),
                f"the coarse alignment '{kind}' takes no fixes",
                f'leave [gnss] out, or write kind = "{NEEDS_GNSS[0]}" in [coarse]',
            )
        if kind in NOT_BEFORE_FINE and spec.fine.kind != "none":
            raise self.refuse(
                ("coarse", "kind"),
                f"{NOT_BEFORE_FINE[kind]}, and a fine alignment follows",
                'write kind = "none" in [fine], or take another coarse alignment',
            )
        if spec.fine.kind != "none":
            self.told(("fine",), partial(_begun, spec))


def _begun(spec: AlignmentSpec) -> None:
    """Begin the filter of a fine alignment, which refuses parts that do not go together."""
    site = Site(
        spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.site.ellipsoid)
    )
    way: FineAlignment = make_choice(spec.fine, SLOTS["fine"], {"ellipsoid": spec.site.ellipsoid})
    if abs(spec.site.lat_deg) > way.mechanization.latitude_limit_deg:
        # Whether north can be found there is told by the alignments themselves.
        return
    filter_ = ErrorFilter(way.mechanization, way.model(), way.form, way.rule)
    filter_.begin(home_of(site, 0.0), np.zeros((filter_.model.physical_size,) * 2))


#: Coarse alignments that need satellite fixes.
NEEDS_GNSS = ("gnss_course",)
#: Coarse alignments that a filter over a rest cannot begin from, and why.
NOT_BEFORE_FINE = {
    "gnss_course": "it is for a vehicle that moves",
    "levelling": "it finds no heading",
}

#: An hour at 4 kHz.
MOST_SAMPLES = 1.5e7
