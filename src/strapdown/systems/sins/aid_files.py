"""The file of an aid, as the table that it takes."""

from __future__ import annotations

import pandas as pd

from strapdown.aiding.aid import TableAid
from strapdown.config.navigation import AidSpec
from strapdown.config.slots import SLOTS
from strapdown.formats.aid_table import read_aid_table
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.tables import GNSS

__all__ = ["COLUMN_UNITS", "read_aid"]

#: Units of the columns of aids, as `read_aid_table` has them; of a column that is not here, and of
#: which its aid says nothing, the number is taken as it stands.
COLUMN_UNITS = {
    "speed": "m/s",
    "height": "m",
    "heading": "deg",
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
}


def read_aid(given: AidSpec) -> pd.DataFrame:
    """Read what an aid measured.

    Parameters
    ----------
    given : AidSpec
        With a path.

    Returns
    -------
    DataFrame
        By time as it stands in the file; ``attrs`` say its clock, ``source`` and ``findings``.

    Raises
    ------
    DataError, ConfigError
        It cannot be used; the message names file, row and remedy.
    """
    assert given.path is not None  # checked with the specification
    entry = SLOTS["aiding"].entries[given.kind]
    assert issubclass(entry, TableAid)
    if set(entry.columns) == set(GNSS):
        return read_gnss(
            given.path,
            GnssOptions(
                columns=given.columns,
                position_sd=given.position_sd_m,
                velocity_sd=given.velocity_sd_m_per_s,
                repair=given.repair,
            ),
        )
    units = {c: COLUMN_UNITS.get(c.removesuffix("_sd"), "") for c in entry.columns}
    units |= dict(getattr(entry, "units", {}))
    return read_aid_table(given.path, units, names=given.columns, repair=given.repair)
