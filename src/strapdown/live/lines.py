"""Line protocol of a live run: comma-separated samples, measurements and commands.

::

    imu,TIME,GX,GY,GZ,AX,AY,AZ        rad/s and m/s², axes of the sensors
    NAME,TIME,COLUMN=VALUE,…          measurement of the aid NAME
    command,WORD[,TOKEN]              next, fine, navigation; end
    TIME,4,GX,GY,GZ,3,AX,AY,AZ,…      as sent by Sensorstream
    accel,TIME,AX,AY,AZ               to detect a crash without gyros

Blanks around commas, empty lines and lines that begin with ``#`` are ignored.
"""

from __future__ import annotations

import hmac
import json
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.navigation import AidSpec
from strapdown.errors import ConfigError, Finding
from strapdown.formats import csv
from strapdown.formats.sensorstream import blocks_of
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.modes import PipelineChunk
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.record import CovarianceSnapshot
from strapdown.rotation import euler_sd
from strapdown.tables import EULER, GEODETIC, GNSS, TRAJECTORY, VELOCITY
from strapdown.tables.checks import POSITION_SD, VELOCITY_SD

if TYPE_CHECKING:
    from strapdown.live.journal import SpooledRows

#: Command that ends a run.
END = "end"
IMU, COMMAND, FORCE = "imu", "command", "accel"
#: Block numbers of Sensorstream.
_ACCEL, _GYRO = 3, 4
_FORM, _FORCE_FORM = "imu,TIME,GX,GY,GZ,AX,AY,AZ", "accel,TIME,AX,AY,AZ"
#: Most characters of a line in a message.
LONGEST = 40
#: Largest value of a measurement: a double squares and sums it without harm; and of columns that
#: have a limit of their own, deg, m and m/s.
MEASURABLE = 1e9
LIMITS = {"lon": 360.0, "alt": 1e8, **dict.fromkeys(VELOCITY, 1e5)}


class BadLineError(Exception):
    """Invalid line, which is ignored.

    Parameters
    ----------
    kind : str
        Category for counting such lines.
    code : str or Finding
        As in `StrapdownError`.
    **data
        As in `Finding`.
    """

    def __init__(self, kind: str, code: str | Finding, /, **data: Any) -> None:
        self.kind = kind
        self.finding = code if isinstance(code, Finding) else Finding(code, **data)
        super().__init__(self.finding)


@dataclass(frozen=True)
class Sample:
    """Rates in rad/s, if any, and specific forces in m/s², axes of the sensors."""

    time: float
    values: tuple[float, ...]


@dataclass(frozen=True)
class Measured:
    """Measurement of an aid."""

    name: str
    time: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Word:
    """A command, with the token of its sender, if it has one."""

    word: str
    token: str = ""


def parse_line(
    text: str, aids: Sequence[str], *, without_gyro: bool = False
) -> Sample | Measured | Word | None:
    """Parse a line.

    Parameters
    ----------
    aids : sequence of str
        Names of the measurements that lines may hold.
    without_gyro : bool
        Whether samples without rates are accepted.

    Returns
    -------
    Sample, Measured, Word or None
        None for an ignored line.
    """
    text = text.strip()
    if not text or text.startswith("#"):
        return None
    head, *fields = (part.strip() for part in text.split(","))
    if head == IMU:
        if len(fields) != 7:
            raise BadLineError("imu", "live.wrong-number-of-values", count=len(fields), form=_FORM)
        time, *values = (_number(field, IMU) for field in fields)
        return Sample(time, tuple(values))
    if head == FORCE and without_gyro:
        if len(fields) != 4:
            raise BadLineError(
                FORCE, "live.wrong-number-of-forces", count=len(fields), form=_FORCE_FORM
            )
        time, *values = (_number(field, FORCE) for field in fields)
        return Sample(time, tuple(values))
    if head == COMMAND:
        if len(fields) not in (1, 2) or not fields[0]:
            raise BadLineError("command", "live.command-not-one-word", end=END)
        return Word(*fields)
    if head in aids:
        return _measured(head, fields)
    if head[:1].isdigit() or head[:1] in ("-", "+", "."):
        return _streamed(text)
    known = [IMU, COMMAND, *aids]
    raise BadLineError(
        "word", "live.unknown-line", given=_shown(head), word=head[:LONGEST], known=known
    )


def count_unused(
    unused: Counter[str], bad: BadLineError, line: int | None, warn: Callable[[Finding], None]
) -> None:
    """Count a line that was not used, and report the first of its kind."""
    unused[bad.kind] += 1
    if unused[bad.kind] == 1:
        warn(Finding("live.line-not-used", line=line, reason=bad.finding))


def check_token(said: Word, token: str | None) -> None:
    """Refuse a command without the token of the run; None: it comes from the launching side."""
    if token is not None and not hmac.compare_digest(said.token.encode(), token.encode()):
        raise BadLineError("command refused", "live.command-refused", command=_shown(said.word))


def _measured(name: str, fields: Sequence[str]) -> Measured:
    if len(fields) < 2:
        raise BadLineError(name, "live.measurement-incomplete", name=name)
    values: dict[str, float] = {}
    for field in fields[1:]:
        column, equals, value = field.partition("=")
        if not equals:
            raise BadLineError(name, "live.not-column-value", name=name, given=_shown(field))
        if column.strip() in values:
            raise BadLineError(name, "live.column-repeated", name=name, given=_shown(field))
        number = _number(value.strip(), name)
        most = LIMITS.get(column.strip(), MEASURABLE)
        if abs(number) > most:
            kind = f"{name} value"
            raise BadLineError(
                kind, "live.row-beyond-limit", column=column, value=number, most=most
            )
        values[column.strip()] = number
    return Measured(name, _number(fields[0], name), values)


def _streamed(text: str) -> Sample:
    found = blocks_of(text)
    if found is None:
        raise BadLineError("sensorstream", "live.not-sensorstream", form=_FORM)
    time, blocks = found
    if _GYRO not in blocks or _ACCEL not in blocks:
        raise BadLineError(
            "sensorstream without a sensor",
            "live.sensorstream-without-sensor",
            gyro=_GYRO,
            accel=_ACCEL,
        )
    values = (*blocks[_GYRO], *blocks[_ACCEL])
    if not all(map(math.isfinite, (time, *values))):
        raise BadLineError("sensorstream", "live.value-not-finite")
    return Sample(time, values)


def _number(text: str, kind: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadLineError(kind, "live.not-a-finite-number", given=_shown(text))
    return value


def _shown(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


# Measurements received line by line: as rows of a table, and all rows as a file.


Array = NDArray[np.float64]
_UNITS_OF_FIXES = {
    **dict(zip(GEODETIC, ("deg", "deg", "m"), strict=True)),
    **dict.fromkeys(POSITION_SD, "m"),
    **dict.fromkeys([*VELOCITY, *VELOCITY_SD], "m_s"),
    "quality": "",
}


class AidRows:
    """Rows received for one measurement.

    Parameters
    ----------
    given : AidSpec
        Configuration, whose standard deviations of fixes replace received ones.
    spool : callable
        Returns empty rows of so many columns.
    """

    def __init__(
        self, aid: TabulatedMeasurement, given: AidSpec, spool: Callable[[int], SpooledRows]
    ) -> None:
        self.aid = aid
        self.of_fixes = set(aid.columns) == set(GNSS)
        self._columns = GNSS if self.of_fixes else list(aid.columns)
        self._position_sd = _three(given.position_sd_m)
        self._velocity_sd = _three(given.velocity_sd_m_per_s)
        self._rows = spool(1 + len(self._columns))
        self._newest = -math.inf

    @property
    def newest(self) -> float:
        """Stamp of the newest kept row, s."""
        return self._newest

    @property
    def count(self) -> int:
        """Number of kept rows."""
        return self._rows.count

    def row(self, values: Mapping[str, float]) -> list[float]:
        """Arrange the values of a line in the order of the table.

        Parameters
        ----------
        values : mapping of str to float
            By column; a fix may omit velocity, standard deviations and quality.
        """
        name = self.aid.name
        for column in values:
            if column not in self._columns:
                raise BadLineError(name, "live.unknown-column", word=column, known=self._columns)
        whole = self._whole_fix(dict(values)) if self.of_fixes else values
        missing = [column for column in self._columns if column not in whole]
        if missing:
            code = "live.fix-incomplete" if self.of_fixes else "live.columns-missing"
            raise BadLineError(name, code, missing=missing, columns=self._columns)
        return [float(whole[column]) for column in self._columns]

    def _whole_fix(self, values: dict[str, float]) -> dict[str, float]:
        """Complete a fix from the configuration; missing quantities are NaN."""
        if self._position_sd is not None:
            values |= dict(zip(POSITION_SD, self._position_sd, strict=True))
        if not set(values) & {*VELOCITY, *VELOCITY_SD}:
            values |= dict.fromkeys([*VELOCITY, *VELOCITY_SD], math.nan)
        elif self._velocity_sd is not None:
            values |= dict(zip(VELOCITY_SD, self._velocity_sd, strict=True))
        return {"quality": 1.0, **values}

    def table(self, time: float, row: list[float]) -> pd.DataFrame:
        """Convert a row to a table of the measurement."""
        values = np.array([row])
        if self.of_fixes:
            none = np.isnan(values)
            sd = np.array([column in VELOCITY_SD for column in self._columns])
            values[none & sd], values[none & ~sd] = np.inf, 0.0
        table = pd.DataFrame(
            values, index=pd.Index([time], name="time"), columns=list(self._columns)
        )
        table.attrs["source"] = self.aid.name
        return table

    def keep(self, time: float, row: list[float]) -> None:
        """Keep a row that the pipeline has received."""
        self._rows.append([time, *row])
        self._newest = time

    def write(self, path: Path) -> None:
        """Write the rows to a file that reads back to the same numbers."""
        time, values = np.split(self._rows.rows, [1], axis=1)
        units = _UNITS_OF_FIXES
        if not self.of_fixes:
            units = {c: u.replace("/", "_") for c, u in self.aid.column_units().items()}
        columns = {"time_s": time[:, 0]}
        for k, name in enumerate(self._columns):
            if not np.isnan(values[:, k]).all():
                columns[f"{name}_{units[name]}" if units[name] else name] = values[:, k]
        csv.write(path, columns, {"aid": self.aid.name})


def _three(value: float | tuple[float, float, float] | None) -> list[float] | None:
    return None if value is None else [float(v) for v in np.broadcast_to(value, 3)]


# The newest state as a line of JSON or CSV.

STATE = [*GEODETIC, *VELOCITY, *EULER]
SD = [*POSITION_SD, *VELOCITY_SD, *(f"{angle}_sd" for angle in EULER)]
LINE_FORMS = ("json", "csv")
# Decimals: 0.1 mm of a position, and as much of an angle at 6 km.
_FINE, _COARSE = 9, 6
_DECIMALS = {name: _FINE if name in ("lat", "lon") else _COARSE for name in (*STATE, *SD)}


class StateLines:
    """Write a line for the newest state, at a limited rate.

    Parameters
    ----------
    write : callable
        Takes a line with its end.
    form : {'json', 'csv'}
    every : float, s
        Least interval between lines, by stamps; zero for each sample.
    """

    def __init__(
        self,
        navigator: Navigator,
        write: Callable[[str], None],
        form: str = "json",
        every: float = 1.0,
    ) -> None:
        if form not in LINE_FORMS:
            raise ConfigError("live.unknown-line-form", quantity="--lines", form=form)
        if not 0.0 <= every < math.inf:
            raise ConfigError("live.bad-interval", quantity="--every", every=every)
        self._used, self._write, self._form, self._every = navigator, write, form, every
        self._next = -math.inf
        self._mark: CovarianceSnapshot | None = None
        self._begun = False

    def begin(self) -> None:
        """Begin the lines of a new reader: with a header, if the form has one."""
        self._begun = False

    def take(self, piece: PipelineChunk) -> None:
        """Write the state after a chunk, if due."""
        for navigation in piece.navigation:
            if navigation.marks:
                self._mark = navigation.marks[-1]
        # Stamps are rounded decimal fractions.
        if not math.isfinite(piece.time) or piece.time < self._next - 1e-9:
            return
        self._next = piece.time + self._every
        self.tell({"time": round(piece.time, _FINE), "mode": piece.mode, **self._state(piece)})

    def tell(self, told: Mapping[str, Any]) -> None:
        """Write a state."""
        if self._form == "json":
            self._write(json.dumps(told) + "\n")
            return
        if not self._begun:
            self._write(",".join(told) + "\n")
            self._begun = True
        self._write(",".join("" if v is None else str(v) for v in told.values()) + "\n")

    def _state(self, piece: PipelineChunk) -> dict[str, float | None]:
        rows = [one.history[-1:] for one in piece.navigation if len(one.history)]
        if not rows:
            return dict.fromkeys([*STATE, *SD])
        out = np.empty((1, len(TRAJECTORY)))
        self._used.filter.mechanization.fill_trajectory(rows[-1], out)
        state = dict(zip(TRAJECTORY, out[0].tolist(), strict=True))
        told: dict[str, float | None] = {n: round(state[n], _DECIMALS[n]) for n in STATE}
        if self._mark is None:
            return {**told, **dict.fromkeys(SD)}
        covariance = self._mark.covariance
        euler = np.array([state[angle] for angle in EULER])
        sd = np.sqrt(np.diagonal(covariance)[:6]).tolist()
        sd += euler_sd(euler, covariance[6:, 6:]).tolist()
        return {**told, **{n: round(v, _COARSE) for n, v in zip(SD, sd, strict=True)}}
