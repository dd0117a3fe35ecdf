"""Output of the readers: raw columns, and recordings in body axes and SI units."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.columns import parse_axes
from strapdown.tables import SAMPLINGS
from strapdown.tables.checks import height_words

#: Codes that say that a recording does not have a stream, which is not a fault.
ABSENT = {
    "io.no-stream",
    "io.accelerometer-alone",
    "io.no-gyro-columns",
    "io.no-gyro-columns-left-out",
    "io.table-of-positions",
    "io.table-of-attitudes",
    "io.missing-columns-2",
    "io.missing-columns-3",
}


class NoStreamError(DataError):
    """A file is of a known format that does not hold the stream.

    `stream`: what was wanted. `title`: of the format. `streams`: what it may hold. `rows`: lines of
    another kind that a text table may be of.
    """

    def __init__(
        self, file: str, stream: str, title: str, streams: Sequence[str], rows: int = 0
    ) -> None:
        held = next((s for s in ("imu", "gnss", "reference") if s in streams and s != stream), "")
        if (held, stream) == ("gnss", "reference"):
            held = "gnss-as-reference"
        way = Finding(f"io.way-of-{held}" if held else "io.way-of-others", stream=stream, file=file)
        if rows:
            way = Finding("io.way-of-rows-beside", name=file, count=rows)
        # The sentence of a finding has its data alone.
        way = way.replace(name=file)
        super().__init__(
            "io.no-stream", file=file, stream=stream, title=title, streams=streams, way=way
        )


@dataclass(frozen=True)
class Reading:
    """Interpretation of one column of a log.

    Attributes
    ----------
    source : str
        Name of the column in the file.
    quantity : str
        Table column that it became, with a sign if it was reversed.
    unit : str
        Unit in the file.
    why : str
        Reason for this interpretation.
    first : float or str
        The first value, as written in the file.
    """

    source: str
    quantity: str
    unit: str
    why: str
    first: float | str


@dataclass(frozen=True)
class ReadOptions:
    """User's statements about a log; None means as in the log.

    Attributes
    ----------
    columns : dict of str to str
        Quantity (``time``, ``gyro_x`` …, or ``gyro``, ``accel`` for a group of three) to the
        name of the column in the file, or its number, from 1; with a minus before it if it
        counts the other way.
    gyro_unit, accel_unit, time_unit : str, optional
        Keys of `units.GYRO_UNITS`, `ACCEL_UNITS`, `TIME_UNITS`; or of `GYRO_SUMS`,
        `ACCEL_SUMS` for increments per sample.
    axes : str, optional
        Which sensor axis points forward, right, down: ``x,-y,-z`` for a sensor whose axes
        point forward, left, up.
    axes_by_gravity : bool
        Turn axes that nothing states so that gravity points down.
    sampling : str, optional
        ``instantaneous`` or ``mean``.
    rate : float, optional, Hz
        For a log without a time column.
    repair : bool
        Drop and count rows that cannot be used, instead of refusing the log.
    format : str, optional
        A key of `formats.READERS`; detected from the file if not given.
    calibration : str, optional
        File of `strapdown calibrate`: known errors of the sensor, which are taken off.
    inferred : frozenset of str
        Units and quantities of `columns` that nobody stated: they were inferred, to go on.
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
    calibration: str | None = None
    inferred: frozenset[str] = frozenset()
    axes_by_gravity: bool = False

    def why(self, key: str) -> str:
        """Say whose statement a unit or a column is."""
        return INFERRED if key in self.inferred else STATED


#: Whose statement an option is, as a `Reading` shows it.
STATED, INFERRED = "stated by the user", "inferred, not yet confirmed"


@dataclass(frozen=True)
class TruthInSensorAxes:
    """Attitude truth of a log, in sensor axes.

    `q_ns` ((n, 4)): sensor axes to local level north-east-down at each sample, NaN where unknown.
    `scored` ((n,)): samples that count for errors.
    """

    q_ns: Array
    scored: NDArray[np.bool_]


@dataclass(frozen=True)
class StatedStart:
    """Initial state stated in a log; shown to people, not used by any reader.

    `lat_deg`, `lon_deg` (deg): geodetic, north and east positive. `alt` (m).
    `roll_pitch_heading_deg` (deg): body forward-right-down to north-east-down. `velocity_ned`
    (m/s).
    """

    lat_deg: float
    lon_deg: float
    alt: float
    roll_pitch_heading_deg: tuple[float, float, float]
    velocity_ned: tuple[float, float, float]


@dataclass
class RawLog:
    """Raw columns of a file."""

    #: Of the file or folder, for messages.
    name: str
    #: Every file that was read.
    files: tuple[Path, ...]
    #: One-dimensional; not numeric where the file holds text.
    columns: dict[str, NDArray[Any]]
    #: Row of each sample in the file, counted from 1; None if sample k is in row k + 1.
    rows: NDArray[np.int64] | None = None
    #: For a known recording: column to (quantity, unit); unit None if not stated.
    stated: Mapping[str, tuple[str, str | None]] = field(default_factory=dict)
    #: The same for each further sensor unit in the file, which is read where one of its columns is
    #: asked for.
    other_units: list[dict[str, tuple[str, str | None]]] = field(default_factory=list)
    #: Column to unit, if stated apart from the name.
    units: dict[str, str] = field(default_factory=dict)
    #: Unit of ``gyro``, ``accel``, ``mag``, if stated of the sensor and not of a column: as
    #: ``deg/s``, or of raw counts as ``deg/s/131``.
    triad_units: dict[str, str] = field(default_factory=dict)
    #: Sampling rate in Hz, if stated apart from stamps.
    rate: float | None = None
    #: `sampling`, `axes`: if the file states them.
    sampling: str | None = None
    axes: str | None = None
    truth: TruthInSensorAxes | None = None
    findings: list[Finding] = field(default_factory=list)
    #: If the file states one.
    start: StatedStart | None = None
    #: Lines above a text table.
    above: list[str] = field(default_factory=list)
    #: Clock of its stamps (`clocks`), if the format defines it.
    clock: str | None = None
    #: Seconds on that clock at stamp zero.
    epoch: float = 0.0
    #: Level of its heights in the words of `tables.checks.height_words`, if the file states it.
    heights: str | None = None
    #: Whether `strapdown doctor` wrote it: its statements were checked against the numbers, or were
    #: decided by a person.
    checked: bool = False
    #: The calibration whose errors were taken off before it was written: name and SHA-256.
    calibrated: str | None = None
    #: Triads of which some samples may be missing, NaN: of a magnetometer that began later.
    sparse: frozenset[str] = frozenset()
    #: Table of fixes in a section of the same text, with names and a clock of its own.
    fixes: RawLog | None = None

    @classmethod
    def of(
        cls, path: Path, quantities: Mapping[str, tuple[NDArray[Any], str | None]], **stated: Any
    ) -> RawLog:
        """Make a log of a file whose format states every quantity.

        `quantities`: by quantity (``time``, ``gyro_x``, ``lat``, ``VN``, ``north_sd`` …): values
        ((n,)) and their unit in the spelling of `constants`. `stated`: further attributes, such as
        ``clock``, ``axes``, ``sampling`` and ``findings``.
        """
        return cls(
            path.resolve().name,
            (path,),
            {quantity: np.asarray(values) for quantity, (values, _) in quantities.items()},
            stated={quantity: (quantity, unit) for quantity, (_, unit) in quantities.items()},
            **stated,
        )

    def fault(
        self, code: str, quantity: str | None = None, *, sample: int | None = None, **data: Any
    ) -> DataError:
        """Make an error of the file, or of one of its samples."""
        row = None if sample is None else self.row(sample)
        return DataError(code, file=self.name, row=row, quantity=quantity, **data)

    def note(self, code: str, quantity: str | None = None, **data: Any) -> None:
        """Add a note about the file."""
        add_note(self.findings, code, file=self.name, quantity=quantity, **data)

    def warn(self, code: str, quantity: str | None = None, **data: Any) -> None:
        """Add a warning about the file."""
        add_warning(self.findings, code, file=self.name, quantity=quantity, **data)

    def backward(self) -> RawLog:
        """Return the log with its rows in the opposite order, and a note that they were so."""
        count = len(next(iter(self.columns.values())))
        return self.in_order(np.arange(count)[::-1], "io.rows-in-descending-order")

    def in_order(self, order: NDArray[np.int64], code: str) -> RawLog:
        """Return the log with its rows in another order, and a note of this code."""
        rows = np.arange(1, order.size + 1) if self.rows is None else self.rows
        out = dataclasses.replace(
            self,
            columns={name: values[order] for name, values in self.columns.items()},
            rows=rows[order],
            findings=list(self.findings),
        )
        out.note(code, "time", count=order.size)
        return out

    def row(self, sample: int) -> int:
        """Row of a sample in the file, counted from 1."""
        return sample + 1 if self.rows is None else int(self.rows[sample])


@dataclass(frozen=True)
class Origin:
    """The raw stamp at time zero; zero itself if time was not shifted."""

    stamp: int | float
    unit: str


@dataclass(frozen=True)
class Recording:
    """A log in body axes and SI units.

    Attributes
    ----------
    name : str
    files : tuple of Path
    origin : Origin
        Origin of its time.
    imu : DataFrame
        Imu table: body axes forward-right-down, SI.
    truth : DataFrame or None
        Attitude table, at the stamps of `imu` with known attitude.
    scored : ndarray of bool or None
        Rows of `truth` that count for errors.
    readings : tuple of Reading
        How each column was read.
    findings : tuple of Finding
        Findings for the user.
    start : StatedStart or None
        Position and attitude at the start, if the file states them.
    temperature : Series or None
        Temperature at the stamps of `imu`, °C, under the name of its column, if there is one.
    wheel : Series or None
        Speed of the vehicle's wheels, m/s, at the stamps of `imu` that have a new one, under the
        names of its columns.
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
    temperature: pd.Series | None = None
    wheel: pd.Series | None = None


#: Answers for a value which the numbers do not show: a unit, a rate.
PLACEHOLDERS = frozenset({"UNIT", "HZ"})


@dataclass
class Questions:
    """Questions that a file leaves open, asked in one refusal with the inferred answers."""

    file: str
    questions: list[Finding] = field(default_factory=list)
    answers: dict[str, str] = field(default_factory=dict)

    def ask(self, fault: Finding, **answers: str) -> None:
        """Add a question. `answers`: options of `ReadOptions`, with the likely values."""
        self.questions.append(fault)
        self.answers |= answers

    def refuse(self) -> None:
        """Raise the questions, if there are any: DataError, or the fault itself if it is alone."""
        if not self.questions:
            return
        said = as_stated(self.answers)
        if len(self.questions) == 1:
            raise DataError(self.questions[0], **said)
        raise DataError("io.questions", file=self.file, questions=self.questions, **said)


def as_stated(answers: Mapping[str, str]) -> dict[str, Any]:
    """Return answers as options of the command line, ``flags``, and as ``keys`` of a configuration.

    ``answers`` has them in pairs.

    `answers`: `ReadOptions` that end in ``_unit``, ``rate``, and quantities with their columns.
    """
    plain = {q for q in answers if q.endswith("_unit")} | {"repair", "rate"}
    columns = {q: c for q, c in answers.items() if q not in plain}
    units = {q: u for q, u in answers.items() if q.endswith("_unit")}
    flags = [f"--{q.replace('_', '-')} {shlex.quote(u)}" for q, u in units.items()]
    keys = [f'{q} = "{u}"' for q, u in units.items()]
    if columns:
        flags.append("--columns " + shlex.quote(",".join(f"{q}={c}" for q, c in columns.items())))
        keys.append("columns = {" + ", ".join(f'{q} = "{c}"' for q, c in columns.items()) + "}")
    if "rate" in answers:
        flags.append(f"--rate {answers['rate']}")
        keys.append(f"rate_hz = {answers['rate']}")
    if "repair" in answers:
        flags.append("--repair")
        keys.append("repair = true")
    return {"flags": " ".join(flags), "keys": "; ".join(keys), "answers": tuple(answers.items())}


#: Axes of an Imu table whose log does not state them: x, y, z of the sensor.
AXES_OF_SENSOR = "not stated: x, y, z as in the source"
#: In the metadata of a file that `strapdown doctor` wrote, by the key ``checked``.
CHECKED = "strapdown doctor"
#: By the key ``calibration``, of samples that are compensated by a file of `strapdown calibrate`.
CALIBRATED = re.compile(r"strapdown calibrate: (.+, sha256 [0-9a-f]{64})")


def calibrated_in(text: Any) -> str | None:
    """Return the calibration that a text says was taken off: its name and SHA-256."""
    found = CALIBRATED.search(str(text))
    return None if found is None else found[1]


def calibrated_mark(imu: pd.DataFrame) -> dict[str, str]:
    """Return what a file states of an Imu table whose sensor's errors were taken off."""
    by = imu.attrs.get("calibrated")
    return {} if by is None else {"calibration": f"strapdown calibrate: {by}"}


def stated_by(meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes of a `RawLog` from the metadata or comments of a file.

    `meta`: text by key: ``sampling``, ``axes``, ``clock``, ``clock_origin_s``, ``checked``,
    ``calibration``, ``heights``.
    """
    sampling, checked = meta.get("sampling"), meta.get("checked") == CHECKED
    stated: dict[str, Any] = {"sampling": sampling if sampling in SAMPLINGS else None, "axes": None}
    if meta.get("axes"):
        with contextlib.suppress(ConfigError):  # a comment in other words states nothing
            text = str(meta["axes"])
            stated["axes"] = "x,y,z" if parse_axes(text) == ([0, 1, 2], [1.0, 1.0, 1.0]) else text
    if checked:
        stated |= {"clock": meta.get("clock"), "epoch": float(meta.get("clock_origin_s", 0.0))}
    by = calibrated_in(meta["calibration"]) if "calibration" in meta else None
    levels = (height_words(as_stated=False), height_words(as_stated=True))
    stated["heights"] = meta.get("heights") if meta.get("heights") in levels else None
    return {**stated, "checked": checked, "calibrated": by}
