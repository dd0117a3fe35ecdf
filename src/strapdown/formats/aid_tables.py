"""Files of aiding measurements: one reader for each kind of table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import read_raw
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.named_columns import columns_of
from strapdown.formats.recording import RawLog
from strapdown.tables import (
    BODY_VELOCITY,
    barometer_from_pressure,
    barometer_table,
    body_velocity_table,
    heading_table,
    odometer_table,
)

__all__ = ["AID_READERS"]

Array = NDArray[np.float64]
Made = Callable[..., pd.DataFrame]


def read_odometer(path: str | Path) -> pd.DataFrame:
    """Read wheel speeds: columns ``time speed speed_sd``, s and m/s.

    A column name may state a unit, as ``speed [km/h]`` or ``speed_km_per_h``.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    DataFrame
        Odometer table.

    Raises
    ------
    ConfigError
        The file does not exist.
    DataError
        The file cannot be used; the message names file, row, quantity and remedy.
    """
    return _read(path, {"speed": "m/s", "speed_sd": "m/s"}, odometer_table)


def read_body_velocity(path: str | Path) -> pd.DataFrame:
    """Read body velocities: ``time vx vy vz vx_sd vy_sd vz_sd``; as `read_odometer`."""

    def made(time: Array, *columns: Array, source: str) -> pd.DataFrame:
        values = np.column_stack(columns)
        return body_velocity_table(time, values[:, :3], values[:, 3:], source)

    return _read(path, dict.fromkeys(BODY_VELOCITY, "m/s"), made)


def read_barometer(path: str | Path) -> pd.DataFrame:
    """Read heights or pressures of a barometer; as `read_odometer`.

    Columns ``time height height_sd``, s and m; or ``time pressure pressure_sd``, s and Pa.
    """
    raw = read_raw(Path(path))
    if any(head.lower().startswith("pressure") for head in raw.columns):
        units = {"pressure": "Pa", "pressure_sd": "Pa"}
        return _made(raw, units, barometer_from_pressure)
    return _made(raw, {"height": "m", "height_sd": "m"}, barometer_table)


def read_heading(path: str | Path) -> pd.DataFrame:
    """Read headings: columns ``time heading heading_sd``, s and deg; as `read_odometer`."""
    return _read(path, {"heading": "deg", "heading_sd": "deg"}, heading_table)


#: Readers by the kind of measurement.
AID_READERS: dict[str, Callable[[str | Path], pd.DataFrame]] = {
    "gnss": read_gnss,
    "odometer": read_odometer,
    "body_velocity": read_body_velocity,
    "barometer": read_barometer,
    "heading": read_heading,
}


def _read(path: str | Path, units: Mapping[str, str], made: Made) -> pd.DataFrame:
    return _made(read_raw(Path(path)), units, made)


def _made(raw: RawLog, units: Mapping[str, str], made: Made) -> pd.DataFrame:
    names: Sequence[str] = list(units)
    found = columns_of(raw, {"time": "s", **units}, ["time", *names])
    try:
        return made(found["time"], *(found[name] for name in names), source=raw.name)
    except DataError as error:
        # Translate rows of the table to rows of the file.
        row = error.finding.row
        raise DataError(
            error.finding, file=raw.name, row=None if row is None else raw.row(row - 1)
        ) from None
