"""An alignment read from its file, or from what is sealed: the forms that its kinds have."""

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
from strapdown.formats.columns import parse_axes
from strapdown.formats.unit_words import parse_unit
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


#: Stages that are modules, by table: what the table has beside the options, and the kind that
#: stands there where none is named.
STAGES: dict[str, tuple[type[ChoiceSpec], str]] = {
    "prefilter": (PrefilterSpec, "none"),
    "coarse": (CoarseSpec, "inertial_frame"),
    "fine": (FineSpec, "filter"),
}
#: Stages that a chain can do without, by the kind ``none``.
MAY_BE_EMPTY = ("prefilter", "fine")


def alignment_form(table: Mapping[str, Any], file: TomlFile | None = None) -> type[AlignmentSpec]:
    """The specification with the options of the kinds that a table names.

    Raises
    ------
    ConfigError
        There is no such kind.
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
    """Make a specification of plain data, as a command or a sealed folder has it.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        There is no such kind, or a module refuses its options.
    ValidationError
        The table has another form.
    """
    whole = _with_kinds(table)
    spec = alignment_form(whole).model_validate(whole)
    check_alignment(spec)
    return spec


def read_alignment_spec(path: str | Path, *, files: bool = True) -> AlignmentSpec:
    """Read the file of an alignment.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must be there, and become absolute paths; else only the
        form is checked.

    Returns
    -------
    AlignmentSpec
        Named after the file.

    Raises
    ------
    ConfigError
        There is no such file, it is no TOML, a key is not known, missing or still ``"?"``, a value
        does not fit, or the parts do not go together; the message names the line.
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


# What a configuration says of a record, its sensors and its place, as far as it can be wrong.


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


# What an alignment says against itself, or a module refuses: told before anything runs.


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
        """What one stage leaves, and another needs."""
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
#: Coarse alignments that a filter over a rest cannot begin from, and the code that says why.
NOT_BEFORE_FINE = {
    "gnss_course": "config.course-before-fine",
    "levelling": "config.levelling-before-fine",
}
