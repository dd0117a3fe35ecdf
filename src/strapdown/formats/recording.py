"""What comes out of a reader: raw columns first, then a recording in body axes and SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.results.inputs import Reading

Array = NDArray[np.float64]

__all__ = ["Origin", "RawLog", "ReadOptions", "Recording", "StatedStart", "TruthInSensorAxes"]


@dataclass(frozen=True)
class ReadOptions:
    """What the user says about a log; whatever is None is taken from the log itself.

    Attributes
    ----------
    columns : dict of str to str
        Quantity (``time``, ``gyro_x`` …, or ``gyro``, ``accel`` for a group of three) to the
        name of the column in the file, or its number counted from 1.
    gyro_unit, accel_unit, time_unit : str, optional
        Keys of `constants.GYRO_UNITS`, `ACCEL_UNITS`, `TIME_UNITS`; or of `GYRO_SUMS`,
        `ACCEL_SUMS` for increments of each sample.
    axes : str, optional
        Which sensor axis points forward, right, down: ``x,-y,-z`` for a sensor whose axes
        point forward, left, up.
    sampling : str, optional
        ``instantaneous`` or ``mean``.
    rate : float, optional, Hz
        For a log without a time column.
    repair : bool
        Leave out rows that cannot be used, and say how many, instead of refusing the log.
    format : str, optional
        A key of `formats.READERS`; recognised by the file itself where it is left out.
    """

    columns: dict[str, str] = field(default_factory=dict)
    gyro_unit: str | None = None
    accel_unit: str | None = None
    time_unit: str | None = None
    axes: str | None = None
    sampling: str | None = None
    rate: float | None = None
    repair: bool = False
    format: str | None = None


@dataclass(frozen=True)
class TruthInSensorAxes:
    """Attitude truth that came with a log, before its axes are turned to body axes.

    Attributes
    ----------
    q_ns : ndarray, (n, 4)
        Sensor axes to local level north-east-down at each sample, NaN where unknown.
    scored : ndarray of bool, (n,)
        The samples that count for errors.
    """

    q_ns: Array
    scored: NDArray[np.bool_]


@dataclass(frozen=True)
class StatedStart:
    """Where and how a log says that it begins; kept for people, and used by no reader.

    Attributes
    ----------
    lat_deg, lon_deg : float, deg
        Geodetic, north and east positive.
    alt : float, m
    roll_pitch_heading_deg : tuple of float, deg
        Body forward-right-down to north-east-down.
    velocity_ned : tuple of float, m/s
    """

    lat_deg: float
    lon_deg: float
    alt: float
    roll_pitch_heading_deg: tuple[float, float, float]
    velocity_ned: tuple[float, float, float]


@dataclass
class RawLog:
    """The columns of a file as they stand in it.

    Attributes
    ----------
    name : str
        Of the file or folder, for messages.
    files : tuple of Path
        Every file that was read.
    columns : dict of str to ndarray
        One-dimensional; not numbers where the file holds text.
    rows : ndarray of int, or None
        Row of the file in which each sample stands, counted from 1; None where sample k stands
        in row k + 1.
    stated : dict of str to (str, str or None)
        For a known recording: column to (quantity, unit); None where it does not say the unit.
    units : dict of str to str
        Column to unit, where the file states it apart from the name.
    rate : float or None
        Sampling rate in Hz, where the file states it apart from stamps.
    sampling, axes : str or None
        Where the file states them.
    truth : TruthInSensorAxes or None
    findings : list of Finding
    start : StatedStart or None
        Where the file states one.
    clock : str or None
        What its stamps count (`clocks`), where the format says it.
    """

    name: str
    files: tuple[Path, ...]
    columns: dict[str, NDArray[Any]]
    rows: NDArray[np.int64] | None = None
    stated: Mapping[str, tuple[str, str | None]] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    rate: float | None = None
    sampling: str | None = None
    axes: str | None = None
    truth: TruthInSensorAxes | None = None
    findings: list[Finding] = field(default_factory=list)
    start: StatedStart | None = None
    clock: str | None = None

    def row(self, sample: int) -> int:
        """Row of the file, counted from 1, in which a sample stands."""
        return sample + 1 if self.rows is None else int(self.rows[sample])


@dataclass(frozen=True)
class Origin:
    """The raw stamp that became time zero; zero itself where time was left as it is.

    Attributes
    ----------
    stamp : int or float
    unit : str
    """

    stamp: int | float
    unit: str


@dataclass(frozen=True)
class Recording:
    """A log that is ready for use.

    Attributes
    ----------
    name : str
    files : tuple of Path
    origin : Origin
        Where its time counts from.
    imu : DataFrame
        Imu table: body axes forward-right-down, SI.
    truth : DataFrame or None
        Attitude table, at those stamps of `imu` at which it is known.
    scored : ndarray of bool or None
        Which rows of `truth` count for errors.
    readings : tuple of Reading
        What every column was taken for.
    findings : tuple of Finding
        What a person should know about it.
    start : StatedStart or None
        What the file says of its place and attitude at the start.
    """

    name: str
    files: tuple[Path, ...]
    origin: Origin
    imu: pd.DataFrame
    truth: pd.DataFrame | None
    scored: NDArray[np.bool_] | None
    readings: tuple[Reading, ...]
    findings: tuple[Finding, ...]
    start: StatedStart | None = None
