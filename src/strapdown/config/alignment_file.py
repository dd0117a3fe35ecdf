"""Read an alignment configuration from a file or plain data, and check it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import create_model

from strapdown.alignment.alignment import Site
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.stationary import home_of
from strapdown.config.alignment import (
    AlignmentSpec,
    AxesTable,
    CoarseSpec,
    FineSpec,
    LogTable,
    PrefilterSpec,
    SensorsTable,
)
from strapdown.config.choice import SLOTS, ChoiceSpec, as_table, choice_form, field_of, make_choice
from strapdown.config.crash_checks import Written
from strapdown.config.filled_form import filled_form, read_named_toml
from strapdown.config.toml_file import TomlFile
from strapdown.config.wanted import ALIGNMENT_WANTED
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.formats.columns import parse_axes, parse_unit
from strapdown.sensors.triad_errors import NAMED_AXES, check_axes_matrix

__all__ = [
    "MOST_SAMPLES",
    "NOT_BEFORE_FINE",
    "STAGES",
    "SourceChecks",
    "alignment_spec",
    "check_alignment",
    "read_alignment_spec",
]


#: Module stages by table: base form of the table without the module's options, and default
#: kind.
STAGES: dict[str, tuple[type[ChoiceSpec], str]] = {
    "prefilter": (PrefilterSpec, "none"),
    "coarse": (CoarseSpec, "inertial_frame"),
    "fine": (FineSpec, "filter"),
}
#: Stages that may be left empty with the kind ``none``.
MAY_BE_EMPTY = ("prefilter", "fine")


def alignment_form(table: Mapping[str, Any], file: TomlFile | None = None) -> type[AlignmentSpec]:
    """Return the specification with the options of the kinds that a table names.

    Raises
    ------
    ConfigError
        A kind is unknown.
    """
    stages: dict[str, Any] = {}
    for name, (base, default) in STAGES.items():
        given = table.get(name)
        written = given if isinstance(given, Mapping) else {}
        form = choice_form(
            SLOTS[name],
            written,
            base,
            default=default,
            empty=name in MAY_BE_EMPTY,
            file=file,
            path=(name,),
        )
        stages[name] = field_of(form, {})
    return create_model("Alignment", __base__=AlignmentSpec, **stages)


def alignment_spec(table: Mapping[str, Any]) -> AlignmentSpec:
    """Create a specification from plain data, as from a command or a sealed folder.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        A kind is unknown, or a module refuses its options.
    ValidationError
        The table has another form.
    """
    whole = _with_kinds(table)
    spec = alignment_form(whole).model_validate(whole)
    check_alignment(spec)
    return spec


def read_alignment_spec(path: str | Path, *, files: bool = True) -> AlignmentSpec:
    """Read an alignment configuration file.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must exist and become absolute paths; otherwise only the
        form is checked.

    Returns
    -------
    AlignmentSpec
        Named after the file.

    Raises
    ------
    ConfigError
        The file is missing or not TOML; a key is unknown, missing or still ``"?"``; a value does
        not fit, or the parts are incompatible. The message names the line.
    """
    file = read_named_toml(Path(path), "alignment", ALIGNMENT_WANTED)
    file = replace(file, table=_with_kinds(file.table))
    form = alignment_form(file.table, file)
    spec, written = filled_form(file, form, ALIGNMENT_WANTED, files=files)
    check_alignment(spec, written)
    return spec


def _with_kinds(table: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(table)
    for name, (_, default) in STAGES.items():
        if name in out:
            out[name] = as_table(SLOTS[name], out[name], default)
    return out


# Checks of record, sensors and position, shared by alignment and navigation.


#: An hour at 4 kHz.
MOST_SAMPLES = 1.5e7


class SourceChecks:
    """Checks that alignments and navigation runs share.

    Parameters
    ----------
    written : Written or None
        The file, for line numbers in messages.
    """

    def __init__(self, written: Written | None) -> None:
        self._written = written

    def refuse(self, path: tuple[str, ...], code: str, /, **data: Any) -> ConfigError:
        """Return an error at a key."""
        if self._written is None:
            return ConfigError(code, quantity=", ".join(path), **data)
        return self._written.refuse(path, code, **data)

    def told(self, path: tuple[str, ...], make: Callable[[], Any]) -> Any:
        """Call `make`; report a refusal at a key."""
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
        """Check that the position is valid."""
        if abs(lat_deg) > 90.0:
            exchanged = abs(lon_deg) <= 90.0
            code = "config.latitude-longitude-exchanged" if exchanged else "config.latitude-beyond"
            raise self.refuse((table, "lat_deg"), code)
        if abs(lon_deg) > 360.0:
            raise self.refuse((table, "lon_deg"), "config.longitude-beyond")
        if not -1e4 <= alt_m <= 1e5:
            raise self.refuse((table, "alt_m"), "config.height-out-of-range")

    def axes(self, axes: AxesTable) -> None:
        """Check that the axes are valid sensor axes."""
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
        """Check that the units of the log are known."""
        for kind in ("gyro", "accel", "time"):
            unit = getattr(log, f"{kind}_unit", None)
            if unit is not None:
                self.told(("log", f"{kind}_unit"), partial(parse_unit, unit, kind))

    def sensors(self, given: SensorsTable, simulation: Any, missing: str) -> None:
        """Check that the sensor uncertainty is stated.

        Parameters
        ----------
        given : SensorsTable
        simulation : table or None
            With or without a sensor of its own.
        missing : str
            Error code if the uncertainty is not stated.
        """
        from strapdown.sensors.catalogue import load_sensor
        from strapdown.sensors.uncertainty import stated_imu

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
        """Length of the used part of a log, s; None if not stated."""
        if log is None:
            return None
        if log.to_s is not None and log.duration_s is not None:
            raise self.refuse(("log", "duration_s"), "config.span-stated-twice")
        if log.from_s is not None and log.to_s is not None:
            if not log.from_s < log.to_s:
                raise self.refuse(("log", "to_s"), "config.end-before-begin", begin=log.from_s)
            return log.to_s - log.from_s
        return log.duration_s


# Consistency checks of an alignment, made before anything runs.


def check_alignment(spec: AlignmentSpec, written: Written | None = None) -> None:
    """Refuse an inconsistent alignment.

    Parameters
    ----------
    spec : AlignmentSpec
    written : Written, optional
        The file it was read from, for line numbers in messages.

    Raises
    ------
    ConfigError
        A module refuses an option, the position is not valid, a matrix is not a rotation, a sensor
        is unknown or incomplete, or times are inconsistent.
    """
    check = _Checks(written)
    site = spec.site
    check.place("site", site.lat_deg, site.lon_deg, site.alt_m)
    check.told(("site", "ellipsoid"), lambda: find_ellipsoid(site.ellipsoid))
    check.axes(spec.axes)
    check.log(spec.log)
    check.sensors(spec.sensors, spec.simulation, "config.no-sensor-for-alignment")
    check.times(spec)
    check.stages(spec)
    check.chain(spec)


class _Checks(SourceChecks):
    def times(self, spec: AlignmentSpec) -> None:
        longest = self.span(spec.log)
        if spec.simulation is not None:
            longest = spec.simulation.duration_s
            if spec.simulation.rate_hz * longest > MOST_SAMPLES:
                raise self.refuse(
                    ("simulation", "duration_s"),
                    "config.samples-too-many",
                    count=spec.simulation.rate_hz * longest,
                    most=MOST_SAMPLES,
                )
        if (
            longest is not None
            and spec.coarse.duration_s is not None
            and spec.coarse.duration_s > longest
        ):
            raise self.refuse(
                ("coarse", "duration_s"), "config.longer-than-record", longest=longest
            )

    def stages(self, spec: AlignmentSpec) -> None:
        given = {"ellipsoid": spec.site.ellipsoid}
        for name in ("prefilter", "coarse", "fine"):
            self.told((name,), partial(make_choice, getattr(spec, name), SLOTS[name], given))

    def chain(self, spec: AlignmentSpec) -> None:
        """Check that each stage provides the input of the next."""
        kind = spec.coarse.kind
        if kind in NEEDS_GNSS and spec.gnss is None:
            raise self.refuse(("coarse", "kind"), "config.course-without-fixes")
        if spec.gnss is not None and kind not in NEEDS_GNSS:
            raise self.refuse(
                ("gnss", "path"),
                "config.coarse-takes-no-fixes",
                kind=kind,
                other=NEEDS_GNSS[0],
            )
        if kind in NOT_BEFORE_FINE and spec.fine.kind != "none":
            raise self.refuse(("coarse", "kind"), NOT_BEFORE_FINE[kind])
        if spec.fine.kind != "none":
            self.told(("fine",), partial(_begun, spec))


def _begun(spec: AlignmentSpec) -> None:
    """Initialize the filter of a fine alignment, which refuses incompatible parts."""
    site = Site(
        spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.site.ellipsoid)
    )
    way: FineAlignment = make_choice(spec.fine, SLOTS["fine"], {"ellipsoid": spec.site.ellipsoid})
    if abs(spec.site.lat_deg) > way.mechanization.latitude_limit_deg:
        # The alignments themselves report whether north can be found there.
        return
    filter_ = ErrorFilter(way.mechanization, way.model(), way.form, way.rule)
    filter_.begin(home_of(site, 0.0), np.zeros((filter_.model.physical_size,) * 2))


#: Coarse alignments that need GNSS fixes.
NEEDS_GNSS = ("gnss_course",)
#: Coarse alignments that cannot start a stationary fine filter, and the code of the reason.
NOT_BEFORE_FINE = {
    "gnss_course": "config.course-before-fine",
    "levelling": "config.levelling-before-fine",
}
