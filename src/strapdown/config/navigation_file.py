"""Read a navigation configuration from a file or plain data, and check it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, create_model

from strapdown.config.alignment import PrefilterSpec
from strapdown.config.alignment_file import MOST_SAMPLES, NEEDS_GNSS, NOT_BEFORE_FINE, SourceChecks
from strapdown.config.choice import (
    SLOTS,
    ChoiceSpec,
    as_table,
    choice_form,
    field_of,
    make_choice,
    with_kinds,
)
from strapdown.config.crash_checks import Written
from strapdown.config.filled_form import filled_form, read_named_toml, together
from strapdown.config.motions import KINDS, MANOEUVRES
from strapdown.config.navigation import (
    AidSpec,
    CoarseModeSpec,
    DampingSpec,
    FilterSpec,
    FineModeSpec,
    MechanizationSpec,
    NavigationSimulationTable,
    NavigationSpec,
    ReceiverTable,
    RecorderSpec,
    SmootherSpec,
    aids_of,
    receivers_of,
)
from strapdown.config.navigation_modules import (
    StatesTable,
    given_of,
    make_aid,
    make_aids,
    make_filter,
    sensors_of,
)
from strapdown.config.spec import TableSpec
from strapdown.config.toml_file import KeyPath, TomlFile, place_of
from strapdown.config.wanted import NAVIGATION_WANTED
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, Finding
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.formats.trajectory_writers import TRAJECTORY_WRITERS
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.navigator import with_states

__all__ = [
    "NAVIGATION_STAGES",
    "TRAJECTORY_FILES",
    "check_navigation",
    "navigation_spec",
    "read_navigation_spec",
    "stage_default",
]


#: Module stages by table: base form of the table without the module's options, default kind, and
#: whether the stage may be left empty with the kind ``none``.
NAVIGATION_STAGES: dict[str, tuple[type[ChoiceSpec], str, bool]] = {
    "prefilter": (PrefilterSpec, "none", True),
    "coarse": (CoarseModeSpec, "inertial_frame", True),
    "fine": (FineModeSpec, "filter", True),
    "mechanization": (MechanizationSpec, "ned", False),
    "filter": (FilterSpec, "error_state", False),
    "damping": (DampingSpec, "feedback", False),
    "smoother": (SmootherSpec, "none", True),
    "recorder": (RecorderSpec, "interval", False),
}
#: With a known start there is no alignment.
ALIGNMENTS = ("coarse", "fine")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def stage_default(name: str, table: Mapping[str, Any]) -> str:
    """Default kind of a stage."""
    if name in ALIGNMENTS and table.get("start") is not None:
        return "none"
    return NAVIGATION_STAGES[name][1]


def navigation_form(table: Mapping[str, Any], file: TomlFile | None = None) -> type[NavigationSpec]:
    """Return the specification with the options of the kinds that a table names.

    Raises
    ------
    ConfigError
        A kind is unknown, or a measurement has an invalid name.
    """
    parts: dict[str, Any] = {}
    for name, (base, _, empty) in NAVIGATION_STAGES.items():
        given = table.get(name)
        form = choice_form(
            SLOTS[name],
            given if isinstance(given, Mapping) else {},
            base,
            default=stage_default(name, table),
            empty=empty,
            file=file,
            path=(name,),
        )
        parts[name] = field_of(form, {"kind": stage_default(name, table)})
    parts["states"] = (StatesTable, StatesTable())
    parts["aiding"] = field_of(_aiding_form(table, file), {})
    if isinstance(table.get("simulation"), Mapping):
        parts["simulation"] = (_simulation_form(table, file), ...)
    return create_model("Navigation", __base__=NavigationSpec, **parts)


def _aiding_form(table: Mapping[str, Any], file: TomlFile | None) -> type[TableSpec]:
    given = table.get("aiding")
    forms: dict[str, Any] = {}
    for name, aid in given.items() if isinstance(given, Mapping) else ():
        path = ("aiding", name)
        _refuse_name(name, path, file)
        slot = SLOTS["aiding"]
        form = choice_form(
            slot,
            aid if isinstance(aid, Mapping) else {},
            AidSpec,
            default=name if name in slot.entries else "",
            file=file,
            path=path,
        )
        forms[name] = (form, ...)
    return create_model("Aiding", __base__=TableSpec, **forms)


def _simulation_form(table: Mapping[str, Any], file: TomlFile | None) -> type[TableSpec]:
    """The simulation with a receiver for each measurement that takes fixes and names no file."""
    aiding = table.get("aiding")
    names = {
        name
        for name, aid in (aiding.items() if isinstance(aiding, Mapping) else ())
        if isinstance(aid, Mapping) and aid.get("kind", name) == "gnss" and not aid.get("path")
    }
    written = table["simulation"].get("gnss")
    for name in written if isinstance(written, Mapping) else ():
        if name not in names:
            path: KeyPath = ("simulation", "gnss", str(name))
            finding = Finding("config.receiver-without-aid", name=name)
            if file is None:
                raise ConfigError(finding, quantity=place_of(path))
            raise file.refuse(path, finding)
    forms: dict[str, Any] = {name: (ReceiverTable, ReceiverTable()) for name in sorted(names)}
    receivers = create_model("Receivers", __base__=TableSpec, **forms)
    return create_model(
        "Simulation", __base__=NavigationSimulationTable, gnss=(receivers, receivers())
    )


def _refuse_name(name: Any, path: KeyPath, file: TomlFile | None) -> None:
    if isinstance(name, str) and _NAME.fullmatch(name) and not hasattr(BaseModel, name):
        return
    reserved = isinstance(name, str) and hasattr(BaseModel, name)
    finding = Finding("config.aid-name-reserved" if reserved else "config.bad-aid-name")
    if file is None:
        raise ConfigError(finding, quantity=place_of(path))
    raise file.refuse(path, finding)


def navigation_spec(table: Mapping[str, Any]) -> NavigationSpec:
    """Create a specification from plain data, as from a command or a sealed folder.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    NavigationSpec

    Raises
    ------
    ConfigError
        A kind is unknown, or the parts are incompatible.
    ValidationError
        The table has another form.
    """
    whole = _with_kinds(table)
    spec = navigation_form(whole).model_validate(whole)
    check_navigation(spec)
    return spec


def read_navigation_spec(path: str | Path, *, files: bool = True) -> NavigationSpec:
    """Read a navigation configuration file.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must exist and become absolute paths; otherwise only the
        form is checked.

    Returns
    -------
    NavigationSpec
        Named after the file.

    Raises
    ------
    ConfigError
        The file is missing or not TOML; a key is unknown, missing or still ``"?"``; a value does
        not fit, or the parts are incompatible. The message names the line.
    """
    file = read_named_toml(Path(path), "run", NAVIGATION_WANTED)
    file = replace(file, table=_with_kinds(file.table))
    spec, written = filled_form(
        file,
        navigation_form(file.table, file),
        NAVIGATION_WANTED,
        files=files,
        place=_place,
        tags={"kind": KINDS, "do": MANOEUVRES},
    )
    check_navigation(spec, written)
    return spec


def _place(parts: KeyPath) -> str:
    """Position of a path for users, without the kind of the motion."""
    if parts[:2] == ("simulation", "motion") and len(parts) > 3 and parts[2] in KINDS:
        parts = (*parts[:2], *parts[3:])
    return place_of(parts)


def _with_kinds(table: Mapping[str, Any]) -> dict[str, Any]:
    """Replace modules given by kind alone with tables."""
    out = dict(table)
    for name in NAVIGATION_STAGES:
        if name in out:
            out[name] = as_table(SLOTS[name], out[name], stage_default(name, table))
    aiding = out.get("aiding")
    if isinstance(aiding, Mapping):
        out["aiding"] = {
            name: with_kinds(SLOTS["aiding"], aid, name if isinstance(name, str) else "")
            for name, aid in aiding.items()
        }
    return out


# Consistency checks of a navigation run, made before anything runs.
#
# All errors are collected and reported together.


#: Trajectory formats that a run can write.
TRAJECTORY_FILES = tuple(TRAJECTORY_WRITERS)
#: Stages filled by modules.
STAGES = (
    "prefilter",
    "coarse",
    "fine",
    "mechanization",
    "filter",
    "damping",
    "smoother",
    "recorder",
)
#: Keys that end an alignment.
ENDS = ("duration_s", "until_heading_sd_deg", "until_tilt_sd_deg", "window_s")
#: Measurements of height.
HEIGHTS = ("barometer",)


def check_navigation(spec: NavigationSpec, written: Written | None = None) -> None:
    """Refuse an inconsistent navigation run.

    Parameters
    ----------
    spec : NavigationSpec
    written : Written, optional
        The file it was read from, for line numbers in messages.

    Raises
    ------
    ConfigError
        A module refuses an option, modules are incompatible, the position is not valid, or a sensor
        is unknown or incomplete: all errors in one message, each with its line.
    """
    check = _Checks(written)
    found: list[ConfigError] = []
    for one in check.all(spec):
        try:
            one()
        except ConfigError as error:
            found.append(error)
    if found:
        raise together(found)


class _Checks(SourceChecks):
    def all(self, spec: NavigationSpec) -> Iterator[Callable[[], None]]:
        yield partial(self.earth, spec)
        yield partial(self.axes, spec.axes)
        yield partial(self.log, spec.log)
        missing = "config.no-sensor-for-navigation"
        yield partial(self.sensors, spec.sensors, spec.simulation, missing)
        yield partial(self.times, spec)
        yield partial(self.begins, spec)
        for name in STAGES:
            yield partial(self.stage, spec, name)
        yield partial(self.height, spec)
        yield partial(self.modes, spec)
        yield partial(self.gaps, spec)
        yield partial(self.alignment, spec)
        for name in aids_of(spec):
            yield partial(self.aid, spec, name)
        for name, receiver in receivers_of(spec).items():
            yield partial(self.receiver, name, receiver)
        yield partial(self.withhold, spec)
        yield partial(self.output, spec)
        yield partial(self.chain, spec)

    def earth(self, spec: NavigationSpec) -> None:
        self.told(("ellipsoid",), lambda: find_ellipsoid(spec.ellipsoid))

    def times(self, spec: NavigationSpec) -> None:
        longest = self.span(spec.log)
        if longest is None:
            return
        for stage in ("coarse", "fine"):
            duration = getattr(spec, stage).duration_s
            if duration is not None and duration > longest:
                raise self.refuse(
                    (stage, "duration_s"), "config.longer-than-record", longest=longest
                )

    def begins(self, spec: NavigationSpec) -> None:
        """Check the initial state."""
        for name in ("start", "site"):
            table = getattr(spec, name)
            if table is not None:
                self.place(name, table.lat_deg, table.lon_deg, table.alt_m)
                for key in ("position_sd_m", "velocity_sd_m_per_s"):
                    if np.min(getattr(table, key)) < 0.0:
                        raise self.refuse((name, key), "config.negative-start-sd")
        if spec.start is not None:
            if abs(spec.start.heading_deg) > 360.0:
                raise self.refuse(("start", "heading_deg"), "config.heading-beyond-turn")
            for stage in ("coarse", "fine"):
                if getattr(spec, stage).kind != "none":
                    raise self.refuse((stage, "kind"), "config.start-and-alignment", stage=stage)
            if spec.site is not None:
                raise self.refuse(("site", "lat_deg"), "config.start-and-site")
        elif spec.coarse.kind == "none":
            raise self.refuse(("start", "lat_deg"), "config.no-start")

    def stage(self, spec: NavigationSpec, name: str) -> None:
        self.told((name,), partial(make_choice, getattr(spec, name), SLOTS[name], given_of(spec)))

    def height(self, spec: NavigationSpec) -> None:
        """Reject a damped height in the mechanization: its loop has no filter states."""
        if getattr(spec.mechanization, "height", "") == "damped":
            raise self.refuse(("mechanization", "height"), "config.damped-height-without-states")

    def modes(self, spec: NavigationSpec) -> None:
        """Check the end conditions of each alignment, and options of stages that are absent."""
        if spec.start is not None:
            return
        for stage in ("coarse", "fine"):
            given = getattr(spec, stage)
            ends = [n for n in ENDS if getattr(given, n, None) is not None]
            if given.kind == "none" and ends:
                raise self.refuse((stage, ends[0]), "config.alignment-end-without-alignment")
            commanded = any(one.mode != "navigation" or stage == "fine" for one in spec.commands)
            if given.kind != "none" and not [n for n in ends if n != "window_s"]:
                if commanded or spec.live is not None:
                    continue
                raise self.refuse((stage, "duration_s"), "config.alignment-never-ends")

    def alignment(self, spec: NavigationSpec) -> None:
        """Check the requirements of coarse and fine alignment on each other and on measurements."""
        kind = spec.coarse.kind
        if kind in NEEDS_GNSS and not _fixes(spec):
            raise self.refuse(("coarse", "kind"), "config.course-without-fixes-in-run")
        if kind in NOT_BEFORE_FINE and spec.fine.kind != "none":
            raise self.refuse(("coarse", "kind"), NOT_BEFORE_FINE[kind])
        if spec.start is None and spec.site is None and not _fixes(spec):
            raise self.refuse(("site", "lat_deg"), "config.no-initial-position")

    def aid(self, spec: NavigationSpec, name: str) -> None:
        """Check one measurement: its options, and whether its data are available."""
        given = aids_of(spec)[name]
        entry = SLOTS["aiding"].entries[given.kind]
        self.told(("aiding", name), partial(make_aid, spec, name))
        takes = issubclass(entry, TabulatedMeasurement)
        if not takes and given.path is not None:
            raise self.refuse(
                ("aiding", name, "path"),
                "config.aid-takes-no-file",
                kind=given.kind,
            )
        sent = name in receivers_of(spec) or spec.live is not None
        if takes and given.path is None and not sent:
            raise self.refuse(("aiding", name, "path"), "config.aid-file-missing", kind=given.kind)
        for key in ("position_sd_m", "velocity_sd_m_per_s"):
            if getattr(given, key) is not None and given.kind != "gnss":
                raise self.refuse(
                    ("aiding", name, key), "config.fix-sd-of-other-aid", kind=given.kind
                )
        height = getattr(spec.mechanization, "height", None)
        if given.kind in HEIGHTS and height == "held":
            raise self.refuse(("aiding", name, "kind"), "config.height-aid-with-held-height")

    def gaps(self, spec: NavigationSpec) -> None:
        if spec.gaps.beyond == "align" and spec.start is not None:
            raise self.refuse(("gaps", "beyond"), "config.no-alignment-to-repeat")

    def receiver(self, name: str, receiver: ReceiverTable) -> None:
        """Check a simulated receiver."""
        for key in ("position_noise_m", "position_drift_m", "velocity_noise_m_per_s"):
            if np.min(getattr(receiver, key)) < 0.0:
                raise self.refuse(("simulation", "gnss", name, key), "config.negative-receiver-sd")
        for begin, end in receiver.outages_s:
            if not begin < end:
                raise self.refuse(
                    ("simulation", "gnss", name, "outages_s"),
                    "config.receiver-outage-empty",
                    begin=begin,
                    end=end,
                )

    def withhold(self, spec: NavigationSpec) -> None:
        """Check the fixes and spans of a GNSS outage test."""
        given = spec.withhold
        if given is None:
            return
        if given.aid is None and not _fixes(spec):
            raise self.refuse(("withhold", "aid"), "config.no-aid-to-withhold")
        if given.aid is not None and given.aid not in _fixes(spec):
            raise self.refuse(
                ("withhold", "aid"),
                "config.unknown-aid-to-withhold",
                word=given.aid,
                known=_fixes(spec),
            )
        if bool(given.spans_s) == bool(given.lengths_s):
            raise self.refuse(
                ("withhold", "spans_s"),
                "config.outage-without-span"
                if not given.spans_s
                else "config.outage-spans-and-lengths",
            )
        for begin, end in given.spans_s:
            if not begin < end:
                raise self.refuse(
                    ("withhold", "spans_s"), "config.outage-span-empty", begin=begin, end=end
                )

    def output(self, spec: NavigationSpec) -> None:
        for form in spec.output.files:
            if form not in TRAJECTORY_FILES:
                raise self.refuse(
                    ("output", "files"),
                    "config.unknown-trajectory-form",
                    form=form,
                    known=TRAJECTORY_FILES,
                )
        simulation = spec.simulation
        if simulation is not None and simulation.rate_hz > MOST_SAMPLES:
            raise self.refuse(("simulation", "rate_hz"), "config.rate-too-high")

    def chain(self, spec: NavigationSpec) -> None:
        """Initialize the filter, which refuses incompatible parts."""
        try:
            made = make_filter(spec, sensors_of(spec))
            aids = make_aids(spec)
        except ConfigError as error:
            # Errors in options of modules are reported separately, with their own keys.
            about = error.finding.quantity or ""
            if about == "states":
                self.told(("sensors",), partial(_raise, error))
            elif about.startswith("states"):
                self.told(("states",), partial(_raise, error))
            return
        self.told(("filter",), partial(_begun, spec, with_states(made, aids)))


def _raise(error: ConfigError) -> None:
    raise error


def _fixes(spec: NavigationSpec) -> list[str]:
    """Names of the measurements that give fixes."""
    return [name for name, aid in aids_of(spec).items() if aid.kind == "gnss"]


def _begun(spec: NavigationSpec, filter_: ErrorFilter) -> None:
    start = NavState.from_degrees(min(80.0, filter_.mechanization.latitude_limit_deg), 0.0)
    filter_.begin(start, np.zeros((filter_.model.physical_size,) * 2))
