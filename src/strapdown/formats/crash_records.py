"""Readers of crash records: one module per format, and the registry of readers."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from pathlib import Path

from strapdown.errors import ConfigError, DataError, StrapdownError, check_choice
from strapdown.formats import crash_edr, crash_json
from strapdown.formats.crash_record import CrashRecord, clean
from strapdown.formats.crash_table import record_of
from strapdown.formats.signs import Signs

# Logs of inertial sensors as crash records: arrays, phones, MATLAB, HDF5.


# Log formats whose columns may be those of a crash.
LOGS = (
    "sensor-logger",
    "phyphox",
    "sensor-folder",
    "npy-folder",
    "npz",
    "parquet",
    "hdf5",
    "matlab",
)


def detect(path: Path) -> bool:
    """Whether the file is a log with columns in another format: .npz, .h5, of a phone."""
    from strapdown.formats import READERS

    return any(READERS[key].detect(path) for key in LOGS)


def read(path: Path) -> CrashRecord:
    """Read a log of another format."""
    from strapdown.formats import READERS, read_raw

    for key in LOGS:
        if READERS[key].detect(path):
            return record_of(read_raw(path, key), path, "log")
    raise DataError(
        "io.crash-log-format-unknown",
        file=path.name,
        quantity="format",
        logs=[READERS[key].title for key in LOGS],
    )


# Spreadsheet files, which hold more than a table.
SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods", ".numbers")
# Most names of a folder that are searched for a similar one.
MOST_NAMES = 10_000
# Faults of a row to be corrected in a copy: the record itself is evidence.
ROW_FAULTS = frozenset(
    {
        "io.fields-expected",
        "io.csv-field-count",
        "io.first-or-last-stamp-missing",
        "io.no-stamp-such",
        "io.no-whole-number-nanoseconds",
        "io.not-date-time-like-those",
        "io.text-not-a-number",
        "io.not-stamp-blocks-id-values",
        "io.numbers-every-sample",
        "io.time-no-date-since-no",
    }
)
# Faults whose remedies are options of the command for attitude logs.
OPTION_FAULTS = frozenset({"io.value-not-a-number"})


@dataclass(frozen=True)
class CrashReader:
    """How one format is recognized and read.

    `module`: of `strapdown.formats`, whose function ``read`` reads it; loaded by the first record.
    """

    title: str
    detect: Callable[[Path], bool]
    module: str

    def read(self, path: Path) -> CrashRecord:
        """Read a record of this format. DataError: the file is damaged, or not as its format."""
        record: CrashRecord = import_module(f"strapdown.formats.{self.module}").read(path)
        return record


#: In the order of detection: self-describing formats first, tables of columns last.
CRASH_READERS: dict[str, CrashReader] = {
    "nhtsa": CrashReader(
        "test of the NHTSA vehicle database: .EV5 or its folder",
        Signs(named=(".ev5",), first=rb"\A.{0,4081}?----- EV5 -----", inside="*.ev5"),
        "crash_nhtsa",
    ),
    "mme": CrashReader(
        "test in ISO MME (ISO/TS 13499): .mme or its folder",
        Signs(named=(".mme",), inside="*.mme"),
        "mme_reader",
    ),
    "json": CrashReader(
        "crash record as JSON, as this package writes it", crash_json.detect, "crash_json"
    ),
    "edr": CrashReader(
        "tables of an event data recorder (49 CFR 563) as text: .csv .txt",
        crash_edr.detect,
        "crash_edr",
    ),
    "log": CrashReader(
        "log with a column a channel: .npz .parquet .h5 .mat, of a phone", detect, "crash_records"
    ),
    "csv": CrashReader(
        "text table with a column a channel: .csv .txt", Path.is_file, "crash_table"
    ),
}


#: Formats that hold nothing but records of crashes, and say so.
_STATED = ("nhtsa", "mme", "json", "edr")


def stated_format(path: Path) -> str | None:
    """Return the key of the format of a record that says itself that it is of a crash.

    None of any other file, such as a table, whose columns may be those of anything.
    """
    found = (name for name in _STATED if path.exists() and CRASH_READERS[name].detect(path))
    return next(found, None)


#: Formats of several files, of which one names the others.
_OF_SEVERAL = ("nhtsa", "mme")


def files_named(paths: Sequence[Path]) -> set[Path]:
    """Return the files that the records among paths name as their own, resolved.

    A record of several files, such as a header with a file for each channel, is one: its other
    files belong to it, and are not records. What states itself a record is not among them.
    """
    named: set[Path] = set()
    for path in paths:
        # What cannot be read says so where it is read.
        with suppress(StrapdownError, OSError, ValueError, RuntimeError):
            if stated_format(path) in _OF_SEVERAL:
                named |= {file.resolve() for file in read_crash_record(path).files}
    return {file for file in named if stated_format(file) not in _OF_SEVERAL}


def read_crash_record(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002
) -> CrashRecord:
    """Read a crash record, detecting its format.

    Parameters
    ----------
    path : str or Path
        A file, or the folder of a test.
    format : str, optional
        A key of `CRASH_READERS`; if not given, detected from the content.

    Returns
    -------
    CrashRecord
        Samples are read when a channel is used.

    Raises
    ------
    ConfigError
        The file does not exist, or the format is unknown.
    DataError
        Not recognized, or damaged; the message names file, row, quantity and remedy.
    """
    file = Path(path)
    if format is not None:
        check_choice("io.unknown-reader", CRASH_READERS, quantity="format", format=format)
    try:
        # Messages name a record by the last part of its path, which "." does not have.
        return _read(file if file.name not in ("", "..") else file.resolve(), format)
    except DataError as error:
        found = error.finding
        at_option = str(found.quantity).startswith("--")
        if found.code in ROW_FAULTS:
            code = "io.crash-row"
        elif found.code in OPTION_FAULTS or at_option:
            code = "io.crash-record-unusable"
        else:
            raise
        raise DataError(
            code,
            file=found.file,
            row=found.row,
            quantity=None if at_option else found.quantity,
            reason=found,
        ) from error
    except (OSError, ValueError) as error:
        # An invalid file name, a file without read permission, or a circular link.
        raise DataError(
            "io.crash-record-unreadable",
            file=clean(file.name),
            name=type(error).__name__,
            clean=clean(str(error), 200),
        ) from error


def _read(file: Path, form: str | None) -> CrashRecord:
    if not file.exists():
        beside: list[str] = []
        with suppress(OSError):
            beside = sorted(p.name for p in islice(file.absolute().parent.iterdir(), MOST_NAMES))
        near = difflib.get_close_matches(file.name, beside, n=1)
        raise ConfigError(
            "io.no-such-record-but-near" if near else "io.no-such-record",
            file=clean(str(file)),
            clean=clean(near[0]) if near else "",
        )
    if file.suffix.lower() in SPREADSHEETS and file.is_file():
        raise DataError("io.spreadsheet", file=file.name)
    if file.is_file() and file.stat().st_size == 0:
        raise DataError("io.file-empty", file=file.name)
    if form is not None:
        return CRASH_READERS[form].read(file)
    for reader in CRASH_READERS.values():
        if reader.detect(file):
            return reader.read(file)
    inside = sorted(p.name for p in file.iterdir()) if file.is_dir() else []
    shown = ", ".join(inside[:6]) + (" …" if len(inside) > 6 else "")
    kinds = "; ".join(r.title for r in CRASH_READERS.values())
    raise DataError(
        "io.folder-no-known-crash-record",
        file=file.resolve().name,
        value_shown=shown or "nothing",
        kinds=kinds,
    )
