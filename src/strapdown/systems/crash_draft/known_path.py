"""A path that another instrument measured, among the records: a reference to hold the answer to."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from strapdown.config.toml_text import Page, instant, plain, string
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.named_columns import read_reference_path

__all__ = ["KnownPath", "known_path", "reference_tables"]

# A path that is counted from the trigger has it within this.
LONGEST = 10.0  # s


@dataclass(frozen=True)
class KnownPath:
    """A path as the case names it.

    Attributes
    ----------
    path : str
    name : str
    start, end : float, s
    """

    path: str
    name: str
    start: float
    end: float

    @property
    def at_trigger(self) -> bool:
        """Whether its time may count from the trigger."""
        return self.start <= 0.0 <= self.end and self.end - self.start < LONGEST


def known_path(path: str, record: CrashRecord) -> KnownPath | None:
    """Take a record for the path of a point, where it has time, north, east and down.

    Parameters
    ----------
    path : str
        As the case names it.
    record : CrashRecord
    """
    if len(record.files) != 1 or not {"north", "east", "down"} <= _words(record):
        return None
    try:
        table: pd.DataFrame = read_reference_path(record.path)
    except (ConfigError, DataError):
        return None
    return KnownPath(path, record.path.stem, float(table.index[0]), float(table.index[-1]))


def _words(record: CrashRecord) -> set[str]:
    return {
        c.name.lower().split("[")[0].split("(")[0].split("_m")[0].strip() for c in record.channels
    }


def reference_tables(page: Page, paths: list[KnownPath]) -> None:
    """A table for each; one whose time does not count from the trigger stays a comment."""
    for one in paths:
        page.blank()
        page.say(
            f"---- '{plain(one.name)}' is a path, and no record of a recorder: the answers are "
            "held against it, and do not use it."
        )
        lines = (
            "[[references]]",
            'kind = "path"',
            f"name = {string(one.name)}",
            'source = ""                         # how it was measured, as you like',
            f"path = {string(one.path)}",
        )
        if one.at_trigger:
            page.say("assumed: its time counts from the trigger, its place is that of the point")
            page.lines += lines
            continue
        page.say(
            f"Its time goes from {instant(one.start)} to {instant(one.end)} s, and must count from "
            "the trigger: make a copy whose time does, name it here, and take the # away."
        )
        page.lines += [f"# {line}" for line in lines]
