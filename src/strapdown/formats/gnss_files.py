"""GNSS fixes from files: one reader per format, and the registry of readers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from strapdown.errors import ConfigError, DataError
from strapdown.formats import (
    gnss_columns,
    gnss_comma2k19,
    gnss_kf_gins,
    gnss_logger,
    gnss_nmea,
    gnss_pos,
    kitti,
    pyins,
)
from strapdown.formats.gnss_fixes import Fixes, GnssOptions, table_of_fixes

__all__ = ["GNSS_READERS", "GnssOptions", "GnssReader", "files_of_fixes", "read_gnss"]


@dataclass(frozen=True)
class GnssReader:
    """How one format of fixes is recognized and read."""

    title: str
    detect: Callable[[Path], bool]
    read: Callable[[Path, GnssOptions], Fixes]


#: In the order of detection.
GNSS_READERS: dict[str, GnssReader] = {
    "comma2k19": GnssReader(
        "receiver of a comma2k19 segment, its folder", gnss_comma2k19.detect, gnss_comma2k19.read
    ),
    "rtklib": GnssReader("solution of RTKLIB (.pos)", gnss_pos.detect, gnss_pos.read),
    "nmea": GnssReader("NMEA 0183: GGA, RMC, VTG, ZDA, GST", gnss_nmea.detect, gnss_nmea.read),
    "gnss-logger": GnssReader(
        "GnssLogger of Android: lines Fix", gnss_logger.detect_fixes, gnss_logger.read_fixes
    ),
    "kitti": GnssReader("KITTI raw, folder oxts", kitti.detect, kitti.read_fixes),
    "kf-gins": GnssReader(
        "KF-GINS fixes, 7 or 13 columns without a header", gnss_kf_gins.detect, gnss_kf_gins.read
    ),
    "python-ins": GnssReader(
        "python-ins arrays: fix_time, fix (.npz)", pyins.detect_fixes, pyins.read_fixes
    ),
    "columns": GnssReader(
        "table with named columns (.csv .txt .tsv .dat .parquet)",
        gnss_columns.detect,
        gnss_columns.read,
    ),
}


def files_of_fixes(path: str | Path) -> tuple[Path, ...]:
    """List the files that fixes are read from: one, or several of a folder.

    Parameters
    ----------
    path : str or Path
    """
    given = Path(path)
    if kitti.detect(given):
        return kitti.files_of(given)
    return gnss_comma2k19.files_of(given) or (given,)


def read_gnss(path: str | Path, options: GnssOptions | None = None) -> pd.DataFrame:
    """Read the fixes of a GNSS receiver.

    Parameters
    ----------
    path : str or Path
    options : GnssOptions, optional
        User's statements about the file.

    Returns
    -------
    DataFrame
        A Gnss table with the time of the file; ``attrs`` has the clock (`clocks`), ``source``
        and ``findings``. A missing velocity has an infinite standard deviation.

    Raises
    ------
    ConfigError
        The file or format does not exist, or `options` names a column that it does not have.
    DataError
        The file cannot be used; the message names file, row, quantity and remedy.
    """
    path, asked = Path(path), options or GnssOptions()
    if not path.exists():
        raise ConfigError("io.no-such-file", file=str(path))
    if path.is_file() and gnss_comma2k19.belongs(path):
        raise DataError("io.fixes-comma-k-segment-two", file=path.name, parent=path.parent)
    if path.is_file() and path.stat().st_size == 0:
        raise DataError("io.file-empty", file=path.name)
    if asked.format is not None and asked.format not in GNSS_READERS:
        raise ConfigError(
            "io.unknown-format-of-fixes",
            quantity="format",
            format=asked.format,
            word=asked.format,
            known=GNSS_READERS,
        )
    readers = [GNSS_READERS[asked.format]] if asked.format else GNSS_READERS.values()
    for reader in readers:
        if asked.format or reader.detect(path):
            return table_of_fixes(reader.read(path, asked), asked)
    if path.is_dir():
        raise DataError("io.folder-fixes-read-file", file=path.resolve().name)
    kinds = "; ".join(r.title for r in GNSS_READERS.values())
    raise DataError(
        "io.ending-no-known-format-fixes", file=path.name, suffix=path.suffix, kinds=kinds
    )
