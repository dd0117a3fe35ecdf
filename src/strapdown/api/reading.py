"""Tables from files, arrays and DataFrames, and tables in memory as input files of a bundle.

Functions of the public interface take samples as a path, as a table from `read_imu`, as a
DataFrame, or as arrays. An unchanged table that was read from a file is represented by that file,
which the bundle seals. Everything else is in memory, and a bundle stores it as a file that
restores each number bitwise.
"""

from __future__ import annotations

import hashlib
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.api.stamps import as_frame, by_time, flat, plain_columns, seconds_of
from strapdown.config.spec import specify
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats import holds
from strapdown.formats.aid_table import read_stream
from strapdown.formats.clocks import CLOCK
from strapdown.formats.gnss_files import read_gnss as read_gnss_table
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import ABSENT as ABSENT
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.tables import ACCEL, GYRO, QUATERNION, attitude_table, imu_table
from strapdown.tables.checks import view_of

if TYPE_CHECKING:
    from strapdown.config.logs import LogTable


@dataclass(frozen=True)
class ImuFile:
    """A recorded log that has not been read yet, and its reading options.

    `log`: path, columns, units, sampling, and the part to use. `axes`: sensor axes that point
    forward, right, down (``x,-y,-z``), or directions of the sensor's x, y and z axes
    (``forward-left-up``).
    """

    log: LogTable
    axes: str | None = None

    def read(self) -> Imu:
        """Read the used part of the log into body axes and SI."""
        from strapdown.config.logs import AxesTable
        from strapdown.systems.alignment_source import body_record

        recording, table, findings = body_record(self.log, AxesTable(axes=self.axes))
        imu = Imu(table)
        imu.attrs = {**table.attrs, "findings": findings, "readings": recording.readings}
        if recording.truth is not None:
            imu.attrs["reference"] = (
                recording.truth[QUATERNION].to_numpy(),
                np.asarray(recording.truth.index, dtype=np.float64),
            )
        if recording.wheel is not None:
            imu.attrs["wheel"] = (recording.wheel.to_numpy(), recording.wheel.index.to_numpy())
        imu.attrs["file"] = (self, _digest(imu))
        return imu


@dataclass(frozen=True)
class GnssFile:
    """A file of fixes, and its reading options."""

    path: str
    options: GnssOptions

    def keys(self) -> dict[str, Any]:
        """The equivalent keys of a measurement's configuration table."""
        told = {
            "format": self.options.format,
            "columns": dict(self.options.columns) or None,
            "units": dict(self.options.units) or None,
            "datum_height_m": self.options.datum_height,
            "origin": self.options.origin,
            "position_sd_m": self.options.position_sd,
            "velocity_sd_m_per_s": self.options.velocity_sd,
            "repair": self.options.repair or None,
        }
        return {key: value for key, value in told.items() if value is not None}


class FoundTable(pd.DataFrame):
    """A DataFrame with findings, whose warnings are below it wherever it is shown."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Warnings and notes."""
        return tuple(self.attrs.get("findings", ()))

    def _warnings(self) -> str:
        return "\n".join(f"warning: {f}" for f in self.findings if f.severity == "warning")

    def __repr__(self) -> str:
        return "\n".join(part for part in (super().__repr__(), self._warnings()) if part)

    def _repr_html_(self) -> str | None:
        # Notebooks ask for it; the stubs of pandas do not have it.
        table, said = super()._repr_html_(), self._warnings()  # type: ignore[misc]
        return table if table is None or not said else f"{table}<pre>{escape(said)}</pre>"


class Imu(FoundTable):
    """Samples of an inertial sensor: a DataFrame with `findings`.

    Index ``time`` in s; columns ``gyro_x gyro_y gyro_z`` in rad/s and, with an
    accelerometer, ``accel_x accel_y accel_z`` in m/s² (specific force), in body axes
    forward-right-down. ``attrs["sampling"]``: whether a row is the value at its stamp
    (``instantaneous``) or the mean over the interval that ends there (``mean``).
    """

    @property
    def _constructor(self) -> type[Imu]:
        return Imu

    @classmethod
    def from_arrays(
        cls,
        t: ArrayLike,
        gyro: ArrayLike,
        accel: ArrayLike | None = None,
        *,
        sampling: str = "instantaneous",
    ) -> Imu:
        """Create a table from arrays.

        Parameters
        ----------
        t : array_like, (n,), s
            Increasing.
        gyro : array_like, (n, 3), rad/s
            Body rates relative to inertial space, forward-right-down.
        accel : array_like, (n, 3), m/s², optional
            Specific force, forward-right-down: about (0, 0, -9.8) at rest and level.
        sampling : {'instantaneous', 'mean'}

        Raises
        ------
        DataError
            Shapes disagree, a value is not finite, or time does not increase.
        """
        table = imu_of_arrays(t, gyro, accel, sampling)
        out = cls(table)
        out.attrs = dict(table.attrs)
        return out


class GnssFixes(FoundTable):
    """Fixes of a satellite receiver: a DataFrame with `findings`.

    Index ``time`` in s; columns ``lat lon`` in deg, ``alt`` in m over the ellipsoid, ``VN VE VD``
    in m/s, of the antenna; ``north_sd east_sd down_sd`` in m, ``VN_sd VE_sd VD_sd`` in m/s, inf
    where not measured; ``quality`` as in NMEA 0183 GGA.
    """

    @property
    def _constructor(self) -> type[GnssFixes]:
        return GnssFixes


class Streams(Mapping[str, pd.DataFrame]):
    """The streams of one recording by name, of ``imu``, ``gnss``, ``reference`` and others.

    Parameters
    ----------
    tables : mapping of str to DataFrame
    source : str
        Name of the recording.
    left_out : sequence of Finding
        Streams that the recording has and that could not be read, each with the reason.
    """

    def __init__(
        self, tables: Mapping[str, pd.DataFrame], source: str, left_out: Sequence[Finding] = ()
    ) -> None:
        self._tables = dict(tables)
        self.source = source
        self.left_out = tuple(left_out)

    def __getitem__(self, name: str) -> pd.DataFrame:
        if name not in self._tables:
            raise DataError("api.unknown-stream", file=self.source, name=name, tables=self._tables)
        return self._tables[name]

    def __contains__(self, name: object) -> bool:
        return name in self._tables

    def get(self, name: str, default: Any = None) -> Any:
        """Return the stream of this name, or `default` where the recording has none."""
        return self._tables.get(name, default)

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    def __repr__(self) -> str:
        rows = ", ".join(f"{name}: {len(table)} rows" for name, table in self._tables.items())
        return f"<Streams {self.source}: {rows}>"

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of all streams, and of those left out."""
        said = (f for t in self._tables.values() for f in t.attrs.get("findings", ()))
        return (*self.left_out, *said)


def read_imu(
    path: str | Path | pd.DataFrame,
    *,
    axes: str | None = None,
    format: str | None = None,  # noqa: A002 (the name of the option and of the key)
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sampling: str | None = None,
    rate_hz: float | None = None,
    span_s: tuple[float | None, float | None] = (None, None),
    repair: bool = False,
    calibration: str | Path | None = None,
) -> Imu:
    """Read the log of an inertial sensor into body axes and SI.

    Parameters
    ----------
    path : str or Path, or DataFrame
        A file of a known format, or the folder of a known recording; or a table in memory, whose
        columns may have any names and units that those of a file may.
    axes : str, optional
        Directions of the sensor's x, y and z (``forward-left-up``), or the sensor axes that point
        forward, right, down (``x,-y,-z``); by default as stated in the file.
    format : str, optional
        A format of `strapdown modules`; by default found by the content.
    columns : mapping of str to str, optional
        Quantity (``time``, ``gyro_x`` …, or ``gyro``, ``accel`` for three) to the name of its
        column, or its number counted from 1; with a minus before it if it counts the other way.
    units : mapping of str to str, optional
        Of ``gyro`` (``deg/s``), ``accel`` (``g``) and ``time`` (``ms``), if not stated in the
        file.
    sampling : {'instantaneous', 'mean'}, optional
        Whether a row is the value at its stamp, or the mean over the interval that ends there.
    rate_hz : float, optional
        Sample rate of a log without a time column.
    span_s : tuple of float or None
        First and last stamp to use.
    repair : bool
        Leave out unusable rows, and report them, instead of refusing the file.
    calibration : str or Path, optional
        File of `calibrate`, ``calibration.toml``: the known errors of this sensor are taken off.

    Returns
    -------
    Imu
        With `findings`.

    Raises
    ------
    DataError
        The file cannot be used; the message names file, row, quantity and remedy.
    ConfigError
        The file does not exist, or an option does not fit it.
    """
    unknown = set(units or {}) - {"gyro", "accel", "time"}
    if unknown:
        raise ConfigError("api.quantity-without-unit", quantity="units", unknown=sorted(unknown)[0])
    from strapdown.config.logs import LogTable

    with _as_file(path) as (file, own):
        log = specify(
            LogTable,
            path=str(file),
            format=own or format,
            columns=dict(columns or {}),
            sampling=sampling,
            rate_hz=rate_hz,
            from_s=span_s[0],
            to_s=span_s[1],
            repair=repair,
            calibration=None if calibration is None else str(calibration),
            **{f"{quantity}_unit": unit for quantity, unit in (units or {}).items()},
        )
        imu = ImuFile(log, axes).read()
    if own:
        # Its numbers are in memory alone, and are kept with a result.
        del imu.attrs["file"]
    return imu


@contextmanager
def _as_file(source: str | Path | pd.DataFrame) -> Iterator[tuple[str | Path, str | None]]:
    """A file, and its format if it is made of a table in memory, for its reading."""
    source = as_frame(source)
    if not isinstance(source, pd.DataFrame):
        _require_path(source)
        yield source, None
        return
    if len(source) < 2:
        raise DataError("api.table-too-short", count=len(source))
    import pyarrow as pa
    from pyarrow import parquet

    table, units = plain_columns(source)
    try:
        held = pa.Table.from_pandas(table, preserve_index=False)
    except (pa.ArrowInvalid, pa.ArrowTypeError):  # values of several kinds in one column
        raise DataError("api.not-numeric") from None
    for k, name in enumerate(held.column_names):
        if name in units:
            field = held.schema.field(k).with_metadata({"unit": units[name]})
            held = held.set_column(k, field, held.column(k))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table"
        parquet.write_table(held, file)
        yield file, "parquet"


def read_gnss(
    path: str | Path | pd.DataFrame,
    *,
    format: str | None = None,  # noqa: A002 (the name of the option and of the key)
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    datum_height_m: float | None = None,
    origin: tuple[float, float, float] | str | None = None,
    position_sd_m: float | tuple[float, float, float] | None = None,
    velocity_sd_m_per_s: float | tuple[float, float, float] | None = None,
    repair: bool = False,
) -> GnssFixes:
    """Read the fixes of a satellite receiver.

    Parameters
    ----------
    path : str or Path, or DataFrame
        RTKLIB .pos, NMEA 0183, a table with named columns, or another format of
        `strapdown modules`; or a table in memory, with names and units as of a file.
    format : str, optional
        A format of `strapdown modules`; by default found by the content.
    columns : mapping of str to str, optional
        Quantity (``time``, ``lat`` …) to the name of its column, or its number counted from 1; with
        a minus before it if it counts the other way. Beside geodetic positions:
        ``ecef_x ecef_y ecef_z``, and local ``north east up``.
    units : mapping of str to str, optional
        Quantity to the unit of its column, if not stated in the file: ``{"time": "ms"}``.
    datum_height_m : float, optional
        Height over the ellipsoid of the level from which the file counts its heights: that of
        the geoid, or of the point of take-off.
    origin : tuple of float, or str, optional
        Latitude in deg, longitude in deg and height in m of the origin of local positions, or of
        where velocities without positions begin; or the zone of UTM of northings and eastings, with
        its hemisphere: ``33N``.
    position_sd_m, velocity_sd_m_per_s : float or tuple of float, optional
        Standard deviations north, east, down of each fix, replacing those of the file.
    repair : bool
        Leave out unusable rows, and report them, instead of refusing the file.

    Returns
    -------
    GnssFixes
        Time as in the file; with `findings`.

    Raises
    ------
    DataError, ConfigError
        The file cannot be used; the message names file, row, quantity and remedy.
    """
    with _as_file(path) as (file, own):
        options = GnssOptions(
            format=own or format,
            columns=dict(columns or {}),
            units=dict(units or {}),
            datum_height=datum_height_m,
            origin=origin,
            position_sd=position_sd_m,
            velocity_sd=velocity_sd_m_per_s,
            repair=repair,
        )
        fixes = _gnss(file, options)
    if own:
        del fixes.attrs["file"]
    return fixes


def _require_path(path: Any) -> None:
    """Refuse what is not a path, as a table, which needs no reading."""
    if not isinstance(path, str | os.PathLike):
        raise ConfigError("api.table-for-path", quantity="path", kind=type(path).__name__)


def _gnss(path: str | Path, options: GnssOptions) -> GnssFixes:
    _require_path(path)
    table = read_gnss_table(path, options)
    fixes = GnssFixes(table)
    fixes.attrs = dict(table.attrs)
    fixes.attrs["file"] = (GnssFile(str(path), options), _digest(fixes))
    return fixes


def read(path: str | Path, **options: Any) -> Streams:
    """Read all streams of a recording in a known format.

    Parameters
    ----------
    path : str or Path
    **options
        Those of `read_imu`, for the log of the inertial sensor: ``units``, ``axes`` ….

    Returns
    -------
    Streams
        ``imu``; ``gnss``, if it has fixes; ``reference``, an Attitude table of a log with a truth,
        or a Trajectory; ``magnetometer``, ``barometer``, ``wheel`` and ``heading`` (of two
        antennas), where they are apart from the inertial sensors: ``mag_x mag_y mag_z`` in µT along
        the sensor's own axes, ``pressure`` in Pa, ``speed`` in m/s, ``heading heading_sd`` in deg.

    Raises
    ------
    DataError, ConfigError
        The recording has neither a log of an inertial sensor nor fixes.
    """
    _require_path(path)

    def fixes(path: str | Path) -> pd.DataFrame:
        return _gnss(path, GnssOptions(unstated_position_sd=math.inf))

    tables: dict[str, pd.DataFrame] = {}
    refused: dict[str, StrapdownError] = {}
    beside = ("magnetometer", "barometer", "wheel", "heading")
    others = [s for s in beside if holds(Path(path), s)]
    readers: dict[str, Callable[[str | Path], pd.DataFrame]] = {
        "imu": partial(read_imu, **options),
        "gnss": fixes,
        "reference": read_trajectory,
        **{stream: partial(read_stream, stream=stream) for stream in others},
    }
    for stream, table_of in readers.items():
        if stream in tables:
            continue
        try:
            tables[stream] = table_of(path)
        except StrapdownError as error:
            refused[stream] = error
            continue
        if "reference" in tables[stream].attrs:
            q_nb, stamps = tables[stream].attrs["reference"]
            tables["reference"] = attitude_table(stamps, q_nb)
        if "wheel" in tables[stream].attrs:
            speed, stamps = tables[stream].attrs["wheel"]
            wheel = pd.DataFrame({"speed": speed}, index=pd.Index(stamps, name="time"))
            said = tables[stream].attrs
            wheel.attrs = {k: said[k] for k in ("source", *CLOCK) if k in said}
            tables["wheel"] = wheel
    if not tables:
        # A missing stream is not a fault: report the fault of a stream that the file has.
        raised = refused.values()
        raise next((e for e in raised if e.finding.code not in ABSENT), next(iter(raised)))
    left_out = [
        Finding(
            "api.stream-left-out",
            file=Path(path).name,
            quantity=stream,
            reason=error.finding,
        )
        for stream, error in refused.items()
        if stream not in tables and error.finding.code not in ABSENT
    ]
    return Streams(tables, Path(path).name, left_out)


def log_table(log: ImuFile | pd.DataFrame, file: Path, stated: Mapping[str, Any]) -> LogTable:
    """Return how a log is read: a file, or samples in memory that are written into `file`.

    `stated` replaces what a file is read with. ConfigError: it is stated of samples in memory.
    """
    from strapdown.config.logs import LogTable

    if isinstance(log, ImuFile):
        return specify(LogTable, **{**log.log.model_dump(exclude_none=True), **stated})
    if stated:
        raise ConfigError("api.table-with-options", quantity=next(iter(stated)))
    return specify(LogTable, path=str(file))


def imu_input(source: Any) -> ImuFile | pd.DataFrame:
    """Samples in any form as a file still to be read, or as a checked Imu table.

    `source`: an unchanged Imu from `read_imu` is represented by its file. A DataFrame has the
    columns of an Imu table, and its time in s as index or in a column ``time``; one without a gyro
    under these names is read as `read_imu` does. DataError: a column is missing, or a value cannot
    be used. ConfigError: the argument is none of these.
    """
    if isinstance(source, ImuFile):
        return source
    if isinstance(source, str | Path):
        from strapdown.config.logs import LogTable

        return ImuFile(specify(LogTable, path=str(source)))
    source = as_frame(source)
    if isinstance(source, pd.DataFrame):
        file = _unchanged(source)
        return file if isinstance(file, ImuFile) else _imu_of(source)
    if isinstance(source, tuple | list) and len(source) in (2, 3):
        return imu_of_arrays(*source)
    raise ConfigError("api.not-imu-samples", quantity="imu", name=type(source).__name__)


def table_input(data: Any, quantity: str) -> str | GnssFile | pd.DataFrame:
    """Source of a measurement: a path, a file with its options, or a table by time.

    `quantity`: for messages. ConfigError: the argument is none of these.
    """
    if isinstance(data, str | Path):
        return str(data)
    data = as_frame(data)
    if isinstance(data, pd.DataFrame):
        file = _unchanged(data)
        return file if isinstance(file, GnssFile) else by_time(data, quantity)
    raise ConfigError("api.not-a-table-or-file", quantity=quantity, name=type(data).__name__)


def log_in(samples: ImuFile | pd.DataFrame, folder: Path) -> ImuFile:
    """Return the file of samples; those in memory are ``imu.npz`` in a folder."""
    if isinstance(samples, ImuFile):
        return samples
    from strapdown.config.logs import LogTable

    return ImuFile(specify(LogTable, path=str(folder / "imu.npz")))


def keys_in(data: str | GnssFile | pd.DataFrame, file: Path) -> dict[str, Any]:
    """Return the configuration keys of a measurement's data; a table in memory is in a file."""
    if isinstance(data, GnssFile):
        return {**data.keys(), "path": data.path}
    return {"path": str(file) if isinstance(data, pd.DataFrame) else data}


def imu_of(source: Any) -> pd.DataFrame:
    """Samples in any form as a checked Imu table; a file is read.

    `source`: as `imu_input`.
    """
    given = imu_input(source)
    return given.read() if isinstance(given, ImuFile) else given


def _imu_of(source: pd.DataFrame) -> pd.DataFrame:
    """A checked copy with only the columns of an Imu table."""
    given = flat(source, [*GYRO, *ACCEL, "time"])
    if len(given.columns) and not any(name in given.columns for name in GYRO):
        return read_imu(source)
    given = by_time(given)
    triads = [*GYRO, *(ACCEL if ACCEL[0] in given.columns else [])]
    missing = [c for c in triads if c not in given.columns]
    if missing:
        raise DataError(
            "api.missing-columns", quantity="imu", missing=missing, columns=source.columns
        )
    try:
        values = view_of(given, triads)
        stamps = given.index.to_numpy(dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError("api.not-numeric", quantity="imu") from None
    accel = values[:, 3:] if len(triads) > 3 else None
    sampling = given.attrs.get("sampling", "instantaneous")
    imu = imu_of_arrays(stamps, values[:, :3], accel, sampling, given.attrs.get("source"))
    kept = ("calibrated", "clock", "clock_origin", "clock_origin_stamp", "gps_week")
    imu.attrs |= {key: given.attrs[key] for key in kept if key in given.attrs}
    return imu


def imu_of_arrays(
    t: Any, gyro: Any, accel: Any = None, sampling: str = "instantaneous", source: str | None = None
) -> pd.DataFrame:
    """An Imu table from arrays, stored column by column like one that is read."""
    stamps, clock = seconds_of(t)
    imu = imu_table(stamps, gyro, accel, sampling=sampling, source=source, by_column=True)
    imu.attrs |= clock
    return imu


def _digest(table: pd.DataFrame) -> str:
    """Hash of stamps, names, values and sampling, to detect changes of a table."""
    digest = hashlib.sha256(repr([*table.columns, table.attrs.get("sampling")]).encode())
    # Column by column: so a table that was read lies in memory, and is not copied.
    for column in (table.index.to_numpy(), *table.to_numpy().T):
        digest.update(np.ascontiguousarray(column).data)
    return digest.hexdigest()


def _unchanged(table: pd.DataFrame) -> ImuFile | GnssFile | None:
    """The file that a table was read from, if the table is unchanged."""
    file, digest = table.attrs.get("file", (None, ""))
    return file if file is not None and _digest(table) == digest else None
