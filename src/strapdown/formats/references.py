"""Reference points and attitude truth from files."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.position_references import is_place, parse_place
from strapdown.evaluation.reference_points import parse_reference
from strapdown.formats import csv, read_raw
from strapdown.formats.assemble import truth_of_file
from strapdown.formats.recording import Origin, ReadOptions

# Distinguishes a sentence from the header of a table with a column named roll.
SENTENCE = re.compile(
    r"same[ -](?:place[ -])?as|\smoved\s|turns?\s+about|^\S+\s*:?\s+roll[ =]+[-+\d.]", re.I
)


def read_reference_words(path: Path) -> list[str] | None:
    """Read reference points as sentences.

    `path`: ``.toml`` with ``references = ["end same as start", ...]``; a text file with one
    sentence per line (``#`` for comments); or a CSV with the columns ``time_s, kind, since_s,
    roll_deg, pitch_deg, heading_deg, turns, axis, sd_deg``, as needed by the kinds. Returns none if
    the file is not a list of reference points; it may be an attitude truth. DataError: an entry of
    the list is missing or malformed.
    """
    if path.suffix.lower() == ".toml":
        return _understood(list(enumerate(_from_toml(path), start=1)), path, "sentence")
    if path.suffix.lower() not in csv.SUFFIXES:
        return None
    numbered = [
        (number, line.strip())
        for number, line in enumerate(
            path.read_text(encoding="utf-8-sig", errors="replace").splitlines(), start=1
        )
        if line.strip() and not line.lstrip().startswith("#")
    ]
    lines = [line for _, line in numbered]
    if lines and "kind" in [f.strip() for f in lines[0].split(",")]:
        return _from_csv(path)
    if lines and SENTENCE.search(lines[0]):
        return _understood(numbered, path, "line")
    return None


def _understood(numbered: list[tuple[int, str]], path: Path, what: str) -> list[str]:
    """Return the sentences; refuse the first that is not understood."""
    if not numbered:
        raise DataError("io.empty-list-reference-points", file=path.name)
    for number, text in numbered:
        try:
            read = parse_place if is_place(text) else parse_reference
            read(text, -math.inf, math.inf)
        except ConfigError as error:
            where = {"file": path.name, "quantity": "reference"}
            if what == "line":
                raise DataError(error.finding, row=number, **where) from None
            raise DataError(
                "io.sentence-not-understood", number=number, reason=error.finding, **where
            ) from None
    return [text for _, text in numbered]


def _from_toml(path: Path) -> list[str]:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # an integer of 4,301 digits is a ValueError
        raise DataError("io.toml-malformed", file=path.name, error=error) from None
    words = content.get("references")
    if not isinstance(words, list) or not all(isinstance(w, str) for w in words):
        raise DataError("io.no-list-sentences-named-references", file=path.name)
    return words


def _from_csv(path: Path) -> list[str]:
    raw = csv.read(path)
    if "kind" not in raw.columns:
        # A name over rows that hold no fields for it.
        raise DataError("io.no-column-4", file=path.name, missing="kind", columns=[*raw.columns])
    words = []
    for sample in range(len(raw.columns["kind"])):
        row = {name: column[sample] for name, column in raw.columns.items()}
        kind, file_row = str(row["kind"]).strip(), raw.row(sample)

        def value(name: str, row: dict[str, Any] = row, file_row: int = file_row) -> str:
            if name not in row or pd.isna(row[name]) or not str(row[name]).strip():
                raise DataError(
                    "io.reference-kind-needs-missing",
                    file=path.name,
                    row=file_row,
                    quantity=name,
                    at_row=row["kind"],
                )
            return str(row[name]).strip()

        if kind == "same":
            text = f"{value('time_s')} same as {value('since_s')}"
        elif kind == "turns":
            text = (
                f"{value('time_s')} {value('turns')} turns about {value('axis')} since "
                f"{value('since_s')}"
            )
        elif kind == "tilt":
            text = f"{value('time_s')} roll {value('roll_deg')} pitch {value('pitch_deg')}"
        elif kind == "known":
            text = (
                f"{value('time_s')} roll {value('roll_deg')} pitch {value('pitch_deg')} heading "
                f"{value('heading_deg')}"
            )
        else:
            raise DataError(
                "io.unknown-kind", file=path.name, row=file_row, quantity="kind", kind=kind
            )
        sd = row.get("sd_deg")
        words.append(text if sd is None or pd.isna(sd) else f"{text} sd {sd}")
    return words


def read_truth(
    path: Path, options: ReadOptions | None = None, origin: Origin | None = None
) -> pd.DataFrame:
    """Read an attitude truth.

    Parameters
    ----------
    path : Path
        Any readable format with a time and either ``q_w q_x q_y q_z`` (body to
        north-east-down) or ``roll pitch heading``.
    options : ReadOptions, optional
        Whether to repair.
    origin : Origin, optional
        Origin of the log's time; zero if not given.

    Returns
    -------
    DataFrame
        An Attitude table of the rows with known attitude.

    Raises
    ------
    DataError
        The file has no attitude, or cannot be read.
    """
    truth = truth_of_file(read_raw(path), options or ReadOptions(), origin or Origin(0, "s"))
    if truth is None or not np.isfinite(truth.to_numpy()).all():
        raise DataError("io.file-without-attitude", file=path.name)
    return truth
