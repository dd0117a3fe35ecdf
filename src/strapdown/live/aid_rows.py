"""What an aid measured, a line at a time: as a row of its table, and all rows as a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import TableAid
from strapdown.config.navigation import AidSpec
from strapdown.formats import csv
from strapdown.live.lines import BadLineError
from strapdown.systems.sins.aid_files import COLUMN_UNITS
from strapdown.tables import GEODETIC, GNSS, VELOCITY
from strapdown.tables.columns import POSITION_SD, VELOCITY_SD

__all__ = ["AidRows"]

Array = NDArray[np.float64]
_UNITS_OF_FIXES = {
    **dict(zip(GEODETIC, ("deg", "deg", "m"), strict=True)),
    **dict.fromkeys(POSITION_SD, "m"),
    **dict.fromkeys([*VELOCITY, *VELOCITY_SD], "m_s"),
    "quality": "",
}


class AidRows:
    """The rows that came of one aid.

    Parameters
    ----------
    aid : TableAid
    given : AidSpec
        What the configuration says in place of what is sent: standard deviations of fixes.
    """

    def __init__(self, aid: TableAid, given: AidSpec) -> None:
        self.aid = aid
        self.of_fixes = set(aid.columns) == set(GNSS)
        self._columns = GNSS if self.of_fixes else list(aid.columns)
        self._position_sd = _three(given.position_sd_m)
        self._velocity_sd = _three(given.velocity_sd_m_per_s)
        self._time: list[float] = []
        self._rows: list[list[float]] = []

    @property
    def newest(self) -> float:
        """Stamp of the newest row that was kept, s."""
        return self._time[-1] if self._time else -math.inf

    @property
    def count(self) -> int:
        """Rows that were kept."""
        return len(self._time)

    def row(self, values: Mapping[str, float]) -> list[float]:
        """Put what a line says in the order of the table.

        Parameters
        ----------
        values : mapping of str to float
            By column; of a fix, velocity, standard deviations and quality may be left out.

        Raises
        ------
        BadLineError
            A column is missing, or is none of the table.
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
        """A fix with what the configuration says; what was not measured is not known."""
        if self._position_sd is not None:
            values |= dict(zip(POSITION_SD, self._position_sd, strict=True))
        if not set(values) & {*VELOCITY, *VELOCITY_SD}:
            values |= dict.fromkeys([*VELOCITY, *VELOCITY_SD], math.nan)
        elif self._velocity_sd is not None:
            values |= dict(zip(VELOCITY_SD, self._velocity_sd, strict=True))
        return {"quality": 1.0, **values}

    def table(self, time: float, row: list[float]) -> pd.DataFrame:
        """A row as the aid takes it."""
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
        """Keep a row that the chain was told."""
        self._time.append(time)
        self._rows.append(row)

    def write(self, path: Path) -> None:
        """Write the rows as a file that is read to the same numbers."""
        values = np.array(self._rows)
        units = _UNITS_OF_FIXES
        if not self.of_fixes:
            of = {c: COLUMN_UNITS.get(c.removesuffix("_sd"), "") for c in self._columns}
            of |= dict(getattr(type(self.aid), "units", {}))
            units = {c: u.replace("/", "_") for c, u in of.items()}
        columns = {"time_s": np.array(self._time)}
        for k, name in enumerate(self._columns):
            if not np.isnan(values[:, k]).all():
                columns[f"{name}_{units[name]}" if units[name] else name] = values[:, k]
        csv.write(path, columns, {"aid": self.aid.name})


def _three(value: float | tuple[float, float, float] | None) -> list[float] | None:
    return None if value is None else [float(v) for v in np.broadcast_to(value, 3)]
