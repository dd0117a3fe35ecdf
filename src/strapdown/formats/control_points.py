"""Control points: surveyed positions of a body at given times, in a local level frame."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from strapdown.errors import DataError
from strapdown.formats import foot_mounted
from strapdown.formats.aid_table import read_aid_table
from strapdown.formats.clocks import RELATIVE, Clock, with_clock

__all__ = ["POINT", "read_control_points"]

#: Columns, m.
POINT = ["north", "east"]


def read_control_points(path: str | Path, names: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Read control points.

    Parameters
    ----------
    path : str or Path
        A text table or Parquet with columns ``time north east``, s and m, from any origin and
        in any direction; or the log of a foot-mounted unit that has them (`foot_mounted`).
    names : dict of str to str, optional
        Column of the table to its name in the file.

    Returns
    -------
    DataFrame
        By ``time`` s: ``north``, ``east`` m.

    Raises
    ------
    ConfigError
        The file does not exist.
    DataError
        The file cannot be used, or it has fewer than two points, which leave the heading open.
    """
    path = Path(path)
    if path.is_file() and foot_mounted.detect_points(path):
        time, places = foot_mounted.read_points(path)
        table = pd.DataFrame(places, index=pd.Index(time, name="time"), columns=POINT)
        table.attrs |= {"source": path.name, "findings": ()}
        table = with_clock(table, Clock(RELATIVE))
    else:
        table = read_aid_table(path, dict.fromkeys(POINT, "m"), names=names)
    if len(table) < 2:
        raise DataError("io.control-point-origin-heading-fit", file=path.name, count=len(table))
    return table
