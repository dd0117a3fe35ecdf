"""Navigation from Python: samples and measurements in any form, and the run as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, fields, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
from pydantic import ValidationError

from strapdown.api.reading import (
    NOWHERE,
    GnssFile,
    ImuFile,
    Memory,
    imu_input,
    moved_inputs,
    moved_paths,
    table_input,
)
from strapdown.bundle.seal import Seal, check_destination
from strapdown.config.alignment import LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_file import navigation_spec, read_navigation_spec
from strapdown.config.spec import misfit, specify
from strapdown.errors import ConfigError
from strapdown.formats.clocks import on_clock_of
from strapdown.report.navigation import write_navigation
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.proposal import CODE_RECEIVER, propose
from strapdown.systems.sins.run import NavigationResult, run_navigation
from strapdown.systems.sins.trust import IntegrityReport
from strapdown.tables import EULER, GEODETIC, VELOCITY

if TYPE_CHECKING:
    from strapdown.report.chart_figure import ChartFigure

__all__ = [
    "Barometer",
    "BodyVelocity",
    "Gnss",
    "Heading",
    "Measurement",
    "NavigationRun",
    "NonHolonomic",
    "Odometer",
    "ZeroAngularRate",
    "ZeroVelocity",
    "navigate",
    "run_specified",
    "smoothed_too",
    "specify_navigation",
]


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


class Heading(_OfKind):
    """Heading: a table with ``heading`` and ``heading_sd`` in deg, clockwise from north."""

    KIND = "heading"


# --- the result ---------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class NavigationRun(NavigationResult):
    """Result of a navigation run.

    It adds the properties below to the attributes of `NavigationResult`. `save` writes the result;
    until then it is in memory only.
    """

    memory: Memory = field(default=Memory({}))

    @property
    def trajectory(self) -> pd.DataFrame:
        """Trajectory table by time in s; smoothed if the run is.

        ``lat lon`` in deg, ``alt`` in m over the ellipsoid, ``VN VE VD`` in m/s, ``roll pitch
        heading`` in deg.
        """
        return self.record.trajectory

    @property
    def sd(self) -> pd.DataFrame:
        """Standard deviations by time: ``north east down`` m, ``VN VE VD`` m/s, angles deg."""
        return self.record.sd

    @property
    def innovations(self) -> Mapping[str, pd.DataFrame]:
        """By name of the observation (``gnss.position``): innovation, variance, weight."""
        return self.record.innovations

    @property
    def sensor_errors(self) -> pd.DataFrame:
        """Estimates of sensor and measurement errors by time, in SI (`record.units`)."""
        return self.record.sensors

    @property
    def integrity(self) -> IntegrityReport:
        """Whether heading and bounds can be trusted, and the first inconsistency."""
        return self.trust

    def to_pandas(self) -> pd.DataFrame:
        """The trajectory with its standard deviations, at their common instants.

        Returns
        -------
        DataFrame
            Columns of `trajectory`, and those of `sd` with the suffix ``_sd``.
        """
        return self.trajectory.join(self.sd.add_suffix("_sd"), how="inner")

    def plot(self, kind: str = "plan") -> ChartFigure:
        """Draw one chart of the report.

        Parameters
        ----------
        kind : str
            ``plan``, ``bound``, ``height``, ``velocity``, ``attitude``, or the name of an
            observation of `innovations`.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist for this run.
        """
        from strapdown.report.navigation import plot

        return plot(self, kind)

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the run as a sealed bundle, which `verify` runs again.

        Parameters
        ----------
        out : str or Path
            New folder. Tables given in memory become input files in it.
        report : bool
            Whether to write its pages and figures as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Returns
        -------
        Seal

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        check_destination(Path(out), force)
        with self._on_disk() as result:
            return write_navigation(result, out, report=report, force=force, progress=progress)

    @contextmanager
    def _on_disk(self) -> Iterator[NavigationRun]:
        """The run with every input a file."""
        with self.memory.as_files() if self.memory.tables else nullcontext(NOWHERE) as folder:
            yield _moved(self, NOWHERE, folder)

    def __repr__(self) -> str:
        time, smoothed = self.trajectory.index, "" if self.forward is None else ", smoothed"
        last = self.sd.iloc[-1]
        return (
            f"<NavigationRun {self.source.name}: {time[-1] - time[0]:.6g} s{smoothed}; at the end "
            f"sd north {last['north']:.3g} m, east {last['east']:.3g} m, heading "
            f"{last['heading']:.3g}°; {len(self.findings)} findings>"
        )

    def _repr_html_(self) -> str:
        rows = self.to_pandas().iloc[[0, -1]]
        shown = rows[[*GEODETIC, *VELOCITY, *EULER, "north_sd", "east_sd", "heading_sd"]]
        found = "".join(f"<li>{escape(str(f))}</li>" for f in self.findings)
        return (
            f"<div><b>{escape(repr(self)[1:-1])}</b></div>{shown.to_html(float_format='{:.6g}'.format)}"
            f"<ul>{found}</ul>"
        )


def _moved(run: NavigationRun, old: Path, new: Path) -> NavigationRun:
    """The run with its input paths moved from one folder to another."""
    if not run.memory.tables or old == new:
        return run
    return replace(
        run,
        spec=navigation_spec(moved_paths(run.spec.plain(), old, new)),
        inputs=moved_inputs(run.inputs, old, new, copied=True),
    )


# --- the run ------------------------------------------------------------------------------


def navigate(
    imu: Any,
    measurements: Sequence[Measurement] = (),
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
        log, or of a configuration (``.toml``), which then replaces all arguments except `smooth`.
    measurements : sequence of Measurement
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
        Further tables of a configuration: ``{"gaps": {"beyond": "coast"}}``.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    NavigationRun

    Raises
    ------
    ConfigError
        A required argument is missing or does not fit; the message names the argument.
    DataError
        The record or a measurement cannot be used.
    DivergenceError
        The state left the range of the mechanization.
    """
    if isinstance(imu, str | Path) and Path(imu).suffix.lower() == ".toml":
        if len(measurements) or any(one is not None for one in (sensor, start, reference, options)):
            raise ConfigError(
                "api.configuration-and-arguments",
                file=Path(imu).name,
                quantity="measurements, sensor, start, reference, options",
            )
        spec = read_navigation_spec(imu)
        return run_specified(smoothed_too(spec) if smooth else spec, Path(imu), progress)
    memory = _memory(imu, measurements, reference)
    with memory.as_files() if memory.tables else nullcontext(NOWHERE) as folder:
        log = _log_in(imu, memory, folder)
        aids = {one.name: _aid_in(one, memory, folder) for one in measurements}
        if len(aids) < len(measurements):
            raise ConfigError("api.measurement-named-twice", quantity="measurements")
        extra = dict(options or {})
        if reference is not None:
            extra["truth"] = {"path": _path_in(reference, "reference", memory, folder)}
        if smooth:
            extra["smoother"] = {"kind": "rts"}
        try:
            spec = specify_navigation(log, aids, sensor=sensor, start=start, options=extra)
        except ValidationError as error:
            raise refused_value(error) from None
        run = run_specified(spec, None, progress)
        return _moved(replace(run, memory=memory), folder, NOWHERE)


def run_specified(
    spec: NavigationSpec,
    file: Path | None = None,
    progress: Progress = silent,
    **drive: Callable[..., Any],
) -> NavigationRun:
    """Run a specification of navigation.

    Parameters
    ----------
    spec : NavigationSpec
    file : Path, optional
        File it was read from, also an input.
    progress : callable, optional
    **drive : callable
        ``drive``: function that runs the chain, instead of one run at once.

    Returns
    -------
    NavigationRun
    """
    result = run_navigation(spec, file, progress, **drive)
    return NavigationRun(**{f.name: getattr(result, f.name) for f in fields(result)})


def smoothed_too(spec: NavigationSpec) -> NavigationSpec:
    """Return the specification with smoothing, whatever its file says.

    Parameters
    ----------
    spec : NavigationSpec
    """
    if spec.smoother.kind != "none":
        return spec
    return navigation_spec({**spec.plain(), "smoother": {"kind": "rts"}})


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

    Parameters
    ----------
    log : ImuFile
    aids : mapping of str to mapping
        By name, the configuration table of each measurement.
    sensor, start, options
        As `navigate`.
    called : callable
        Name of an argument in the interface, for messages: ``sensor`` as ``--sensor``.

    Returns
    -------
    NavigationSpec

    Raises
    ------
    ConfigError
        A required argument is missing; the message names it.
    DataError
        A file cannot be read.
    """
    receiver = next((n for n, a in aids.items() if a["kind"] == "gnss" and a.get("path")), None)
    known = dict(start or {})
    site = _site(known, called)
    fixes = aids.get(receiver or "", {})
    proposal = propose(
        log.log,
        axes=log.axes,
        gnss=Path(fixes["path"]) if fixes else None,
        sensor=None if sensor is None else str(sensor),
        site=site,
        heading_deg=known.get("heading_deg"),
        fixes_as=replace(
            CODE_RECEIVER,
            columns=dict(fixes.get("columns", {})),
            position_sd=fixes.get("position_sd_m"),
            velocity_sd=fixes.get("velocity_sd_m_per_s"),
            repair=bool(fixes.get("repair", False)),
        ),
    )
    if sensor is None:
        near = proposal.table.get("sensors", {}).get("sensor")
        code = "api.no-sensor-near-one" if near else "api.no-sensor-for-navigation"
        raise ConfigError(code, quantity=called("sensor"), near=near)
    whole: dict[str, Any] = {"name": Path(log.log.path).resolve().stem, **proposal.table}
    proposed = whole.pop("aiding", {}).get("gnss", {})
    if "position_sd_m" in proposed:
        raise ConfigError(
            "api.fixes-without-sd", file=Path(str(fixes["path"])).name, quantity=called("gnss")
        )
    coarse = whole["coarse"]
    if coarse["kind"] == "known_heading" and "heading_deg" not in coarse:
        raise ConfigError(
            "api.no-heading",
            quantity=called("heading"),
            called=called("heading"),
            called_2=called("gnss"),
        )
    if "site" not in whole and proposal.gnss is None:
        raise ConfigError(
            "api.no-initial-position",
            quantity=called("lat"),
            called=called("lat"),
            called_2=called("lon"),
            called_3=called("alt"),
            called_4=called("gnss"),
        )
    if aids:
        whole["aiding"] = {
            name: {**(proposed if name == receiver else {}), **aid} for name, aid in aids.items()
        }
    return navigation_spec({**whole, **(options or {})})


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


def _memory(imu: Any, measurements: Sequence[Measurement], reference: Any) -> Memory:
    """Every table that is not a file, by the file name that a bundle gives it."""
    tables: dict[str, pd.DataFrame] = {}
    samples = imu_input(imu)
    if isinstance(samples, pd.DataFrame):
        tables["imu.npz"] = samples
    for one in measurements:
        if not isinstance(one, Measurement):
            raise ConfigError(
                "api.not-a-measurement", quantity="measurements", name=type(one).__name__
            )
        data = None if one.data is None else table_input(one.data, one.name)
        if isinstance(data, pd.DataFrame):
            tables[f"{one.name}.csv"] = data
    if isinstance(reference, pd.DataFrame):
        tables["reference.csv"] = reference
    if isinstance(samples, pd.DataFrame):
        # Samples keep the clock in their attributes; a file has a clock of its own.
        tables = {
            name: table
            if name == "imu.npz"
            else _relative(on_clock_of(table, imu)[0])
            if isinstance(imu, pd.DataFrame)
            else table
            for name, table in tables.items()
        }
    return Memory(tables)


def _relative(table: pd.DataFrame) -> pd.DataFrame:
    out = table.copy()
    out.attrs = {k: v for k, v in table.attrs.items() if k not in ("clock", "gps_week")}
    return out


def _log_in(imu: Any, memory: Memory, folder: Path) -> ImuFile:
    if "imu.npz" in memory.tables:
        return ImuFile(specify(LogTable, path=str(folder / "imu.npz")))
    given = imu_input(imu)
    assert isinstance(given, ImuFile)
    return given


def _aid_in(one: Measurement, memory: Memory, folder: Path) -> dict[str, Any]:
    """The configuration table of a measurement."""
    table = {"kind": one.kind, **one.options}
    if one.data is None:
        return table
    if f"{one.name}.csv" in memory.tables:
        return {**table, "path": str(folder / f"{one.name}.csv")}
    data = table_input(one.data, one.name)
    if isinstance(data, GnssFile):
        return {**table, **data.keys(), **one.options, "path": data.path}
    return {**table, "path": str(data)}


def _path_in(data: Any, name: str, memory: Memory, folder: Path) -> str:
    return str(folder / f"{name}.csv") if f"{name}.csv" in memory.tables else str(data)


def refused_value(error: ValidationError) -> ConfigError:
    """Convert a pydantic error in the arguments of a run."""
    first = error.errors()[0]
    context = first.get("ctx", {})
    place = [str(p) for p in first["loc"]] + ([context["key"]] if context.get("key") else [])
    return ConfigError(misfit(first), quantity=", ".join(place))
