"""Navigation from Python: samples and measurements in any form, and the run as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.api.reading import GnssFile, ImuFile, imu_input, keys_in, log_in, table_input
from strapdown.config.logs import FixesTable
from strapdown.config.navigation import NavigationSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError, Finding, add_warning
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.gnss_fixes import POSITION_SDS
from strapdown.progress import Progress, silent
from strapdown.systems.inputs import NOWHERE, Memory
from strapdown.systems.navigation_proposal import Proposal, propose
from strapdown.systems.navigation_run import NavigationRun as NavigationRun
from strapdown.systems.navigation_run import run_navigation

# --- measurements -------------------------------------------------------------------------


@dataclass(frozen=True, init=False, eq=False)
class Measurement:
    """A measurement for the navigation filter: its kind, its data, and its options.

    Parameters
    ----------
    kind : str
        As listed by `strapdown modules`, or of an installed plug-in (entry points
        ``strapdown.measurements``).
    data : DataFrame, str or Path, optional
        Measured data by time in s on the clock of the inertial sensors; a table from
        `read_gnss`, or a file. None for a measurement derived from the inertial sensors
        themselves.
    name : str, optional
        Name of its observations (``gnss.position``) and states; by default its kind.
    **options
        Keys of its table in a configuration, with their units: ``lever_arm_m=(0.3, 0, -1.2)``,
        ``position_sd_m=1.5``.
    """

    kind: str
    data: Any = field(repr=False)
    name: str
    options: Mapping[str, Any]

    def __init__(
        self, kind: str, data: Any = None, *, name: str | None = None, **options: Any
    ) -> None:
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "data", data)
        object.__setattr__(self, "name", name or kind)
        object.__setattr__(self, "options", dict(options))


class Gnss(Measurement):
    """Positions and velocities of a satellite receiver.

    Parameters
    ----------
    data : GnssFixes, DataFrame, str or Path
        Fixes of the antenna; columns as `GnssFixes`.
    lever_arm_m : tuple of float, (3,), m
        Antenna from the inertial sensors: forward, right, down.
    name : str
    **options
        As `Measurement`: ``time_offset_s``, ``position_sd_m``, ``update_rule`` …
    """

    def __init__(
        self,
        data: Any,
        *,
        lever_arm_m: Sequence[float] = (0.0, 0.0, 0.0),
        name: str = "gnss",
        **options: Any,
    ) -> None:
        arm = tuple(float(x) for x in lever_arm_m)
        super().__init__("gnss", data, name=name, lever_arm_m=arm, **options)


class _OfKind(Measurement):
    """A measurement whose kind is given by its class."""

    KIND = ""

    def __init__(self, data: Any = None, *, name: str | None = None, **options: Any) -> None:
        super().__init__(self.KIND, data, name=name, **options)


class NonHolonomic(_OfKind):
    """Non-holonomic constraint (NHC): a wheeled vehicle moves along its own axis.

    Options: ``lever_arm_m`` to the rear axle, ``lateral_sd_m_per_s`` …
    """

    KIND = "no_slip"


class ZeroVelocity(_OfKind):
    """Zero-velocity update (ZUPT) wherever the inertial sensors show a standstill."""

    KIND = "zero_velocity"


class ZeroAngularRate(_OfKind):
    """Zero angular rate update (ZARU) wherever the inertial sensors show a standstill."""

    KIND = "zero_rate"


class Odometer(_OfKind):
    """Speed of a wheel: a table with ``speed`` and ``speed_sd`` in m/s, forward positive."""

    KIND = "odometer"


class BodyVelocity(_OfKind):
    """Velocity in axes of its instrument: ``vx vy vz vx_sd vy_sd vz_sd`` in m/s."""

    KIND = "body_velocity"


class Barometer(_OfKind):
    """Height: a table with ``height`` and ``height_sd`` in m."""

    KIND = "barometer"


class Magnetometer(_OfKind):
    """Magnetic field: without data, the columns ``mag_x mag_y mag_z`` of the samples.

    Options: ``field_ned_ut``, the Earth's field; ``hard_iron_sd_ut``, ``field_sd_ut`` …
    """

    KIND = "magnetometer"


class Heading(_OfKind):
    """Heading: a table with ``heading`` and ``heading_sd`` in deg, clockwise from north."""

    KIND = "heading"


# --- the run ------------------------------------------------------------------------------


def navigate(
    imu: Any,
    measurements: Measurement | Sequence[Measurement] = (),
    *,
    sensor: str | Path | None = None,
    start: Mapping[str, float] | None = None,
    smooth: bool = False,
    reference: Any = None,
    options: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> NavigationRun:
    """Navigate over samples of an inertial sensor, aided by measurements.

    The alignment is selected from the record, as in ``strapdown navigate``: from a stationary
    interval if the gyros can find north, else from the course of a drive with fixes, else from the
    given heading.

    Parameters
    ----------
    imu : Imu, DataFrame, (t, gyro, accel), str or Path
        Samples: s, rad/s (n, 3), m/s² (n, 3), body axes forward-right-down. A path is that of a
        log, or of a configuration (``.toml``), which then replaces all arguments except `smooth`
        and, as a file, `reference`.
    measurements : Measurement, or sequence of them
        `Gnss`, `NonHolonomic`, `ZeroVelocity`, `Odometer` …
    sensor : str or Path
        Data sheet: a name of the catalogue, or a ``.toml`` file.
    start : mapping of str to float, optional
        ``lat_deg``, ``lon_deg``, ``alt_m``, ``heading_deg`` where not given by the record.
    smooth : bool
        Whether to run the Rauch-Tung-Striebel smoother (RTS) backward over the record.
    reference : DataFrame, str or Path, optional
        Trajectory table or file to compare with.
    options : mapping, optional
        Further tables of a configuration: ``{"gaps": {"beyond": "bridge"}}``.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Raises
    ------
    ConfigError
        A required argument is missing or does not fit; the message names the argument.
    DataError
        The record or a measurement cannot be used.
    DivergenceError
        The state left the range of the mechanization.
    """
    if isinstance(measurements, Measurement):
        measurements = [measurements]
    if isinstance(imu, str | Path) and Path(imu).suffix.lower() == ".toml":
        table = isinstance(reference, pd.DataFrame)
        if len(measurements) or table or any(x is not None for x in (sensor, start, options)):
            raise ConfigError(
                "api.configuration-and-arguments",
                file=Path(imu).name,
                quantity="reference" if table else "measurements, sensor, start, options",
            )
        spec = NavigationSpec.read(imu)
        if reference is not None:
            spec = spec.with_path("truth", Path(reference).absolute())
        return run_navigation(spec.smoothed() if smooth else spec, Path(imu), progress)
    samples = imu_input(imu)
    data = _data_of(measurements)
    memory = _memory(imu, samples, data, reference)
    with memory.as_files() as folder:
        aids = {}
        for one in measurements:
            given = data[one.name]
            keys = {} if given is None else keys_in(given, folder / f"{one.name}.csv")
            path = {"path": keys["path"]} if keys else {}
            aids[one.name] = {"kind": one.kind, **keys, **one.options, **path}
        extra = dict(options or {})
        if reference is not None:
            in_memory = isinstance(reference, pd.DataFrame)
            extra["truth"] = {"path": str(folder / "reference.csv" if in_memory else reference)}
        if smooth:
            extra["smoother"] = {"kind": "rts"}
        log = log_in(samples, folder)
        spec = specify_navigation(log, aids, sensor=sensor, start=start, options=extra)
        run = run_navigation(spec, None, progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


def specify_navigation(
    log: ImuFile,
    aids: Mapping[str, Mapping[str, Any]],
    *,
    sensor: str | Path | None = None,
    start: Mapping[str, float] | None = None,
    options: Mapping[str, Any] | None = None,
    called: Callable[[str], str] = str,
) -> NavigationSpec:
    """Build the specification of a run over a log, completed from the log and the fixes.

    `aids`: by name, the configuration table of each measurement. `sensor`, `start`, `options`: as
    `navigate`. `called`: name of an argument in the interface, for messages: ``sensor`` as
    ``--sensor``. ConfigError: a required argument is missing; the message names it. DataError: a
    file cannot be read.
    """
    receiver = next((n for n, a in aids.items() if a["kind"] == "gnss" and a.get("path")), None)
    known = dict(start or {})
    site = _site(known, called)
    fixes = aids.get(receiver or "", {})
    proposal = propose(
        log.log,
        axes=log.axes,
        gnss=_fixes_table(fixes) if fixes else None,
        sensor=None if sensor is None else str(sensor),
        site=site,
        heading_deg=known.get("heading_deg"),
    )
    _ask(proposal, fixes, sensor, called)
    whole: dict[str, Any] = {"name": Path(log.log.path).resolve().stem, **proposal.table}
    proposed = whole.pop("aiding", {}).get("gnss", {})
    if aids:
        whole["aiding"] = {
            name: {**(proposed if name == receiver else {}), **aid} for name, aid in aids.items()
        }
    return NavigationSpec.checked({**whole, **(options or {})})


def _ask(
    proposal: Proposal,
    fixes: Mapping[str, Any],
    sensor: str | Path | None,
    called: Callable[[str], str],
) -> None:
    """Ask for everything that neither the user nor the files state, in one refusal."""
    open_: list[Finding] = []
    answers: list[str] = []
    name = Path(proposal.recording.name).name
    if sensor is None:
        near = proposal.table.get("sensors", {}).get("sensor")
        code = "api.no-sensor-near-one" if near else "api.no-sensor-for-navigation"
        open_.append(Finding(code, severity="error", quantity=called("sensor"), near=near))
        answers.append(f"--sensor {near or 'SENSOR'}")
    aid = proposal.table.get("aiding", {}).get("gnss", {})
    taken = aid.get("position_sd_m") if fixes and fixes.get("position_sd_m") is None else None
    if taken is not None:
        file = Path(aid["path"]).name
        add_warning(
            open_,
            "api.fixes-without-sd",
            severity="error",
            file=file,
            quantity=called("gnss"),
            typical=POSITION_SDS,
        )
        answers.append(f"--gnss-position-sd {taken:g}")
    coarse = proposal.table["coarse"]
    if coarse["kind"] == "known_heading" and "heading_deg" not in coarse:
        add_warning(
            open_,
            "api.no-heading",
            severity="error",
            quantity=called("heading"),
            called=called("heading"),
            called_2=called("gnss"),
        )
        answers.append("--heading DEG")
    if "site" not in proposal.table and proposal.gnss is None:
        add_warning(
            open_,
            "api.no-initial-position",
            severity="error",
            quantity=called("lat"),
            called=called("lat"),
            called_2=called("lon"),
            called_3=called("alt"),
            called_4=called("gnss"),
        )
        answers.append("--lat DEG --lon DEG --alt M")
    if not open_:
        return
    flags = " ".join(answers)
    if len(open_) == 1:
        raise ConfigError(open_[0], flags=flags)
    raise ConfigError("api.open-questions", file=name, questions=open_, flags=flags)


def _fixes_table(aid: Mapping[str, Any]) -> FixesTable:
    return specify(FixesTable, **{k: v for k, v in aid.items() if k in FixesTable.model_fields})


def _site(
    known: Mapping[str, float], called: Callable[[str], str]
) -> tuple[float, float, float] | None:
    unknown = set(known) - {"lat_deg", "lon_deg", "alt_m", "heading_deg"}
    if unknown:
        raise ConfigError("api.unknown-start-key", quantity="start", unknown=sorted(unknown)[0])
    if not {"lat_deg", "lon_deg", "alt_m"} & set(known):
        return None
    for key in ("lat", "lon"):
        if f"{key}_deg" not in known:
            raise ConfigError("api.half-a-position", quantity=called(key), called=called(key))
    return known["lat_deg"], known["lon_deg"], known.get("alt_m", 0.0)


# --- files and memory ---------------------------------------------------------------------


def _data_of(
    measurements: Sequence[Measurement],
) -> dict[str, str | GnssFile | pd.DataFrame | None]:
    """Data of each measurement by its name: a file, a table, or None."""
    data: dict[str, str | GnssFile | pd.DataFrame | None] = {}
    for one in measurements:
        if not isinstance(one, Measurement):
            raise ConfigError(
                "api.not-a-measurement", quantity="measurements", name=type(one).__name__
            )
        data[one.name] = None if one.data is None else table_input(one.data, one.name)
    if len(data) < len(measurements):
        raise ConfigError("api.measurement-named-twice", quantity="measurements")
    return data


def _memory(imu: Any, samples: Any, data: Mapping[str, Any], reference: Any) -> Memory:
    """Every table that is not a file, by the file name that a bundle gives it."""
    tables = {f"{name}.csv": one for name, one in data.items()} | {"reference.csv": reference}
    memory = Memory.of({"imu.npz": samples, **tables})
    if not (isinstance(samples, pd.DataFrame) and isinstance(imu, pd.DataFrame)):
        return memory
    # Samples keep the clock in their attributes; a file has a clock of its own.
    return Memory(
        {
            name: table if name == "imu.npz" else _relative(on_clock_of(table, imu)[0])
            for name, table in memory.tables.items()
        }
    )


def _relative(table: pd.DataFrame) -> pd.DataFrame:
    out = table.copy()
    out.attrs = {k: v for k, v in table.attrs.items() if k not in ("clock", "gps_week")}
    return out
