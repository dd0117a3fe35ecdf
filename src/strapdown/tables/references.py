"""References tables: instants at which the attitude is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.errors import DataError
from strapdown.tables.checks import as_array, check_columns, source_of
from strapdown.tables.columns import EULER, REFERENCE

REFERENCE_KINDS = ("known", "tilt", "same", "turns")


def references_table(rows: Sequence[dict[str, object]], source: str | None = None) -> pd.DataFrame:
    """Make a References table.

    Parameters
    ----------
    rows : sequence of dict
        Each with ``time`` (s) and ``kind``. ``known`` adds ``roll``, ``pitch``, ``heading``
        in deg; ``tilt`` adds ``roll`` and ``pitch`` only, the direction of gravity; ``same``
        adds ``since`` (s), the instant whose attitude it shares; ``turns``
        adds ``since``, ``turns`` (whole or not; positive right-handed) and ``axis`` (``x``,
        ``y``, ``z`` of the body, forward-right-down). ``sd`` in deg is how well it is known.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        As `check_references`.
    """
    table = pd.DataFrame([dict(r) for r in rows], columns=REFERENCE)
    numbers = [c for c in REFERENCE if c not in ("kind", "axis")]
    for name in numbers:
        table[name] = as_array(table[name].tolist(), None, name, source)
    table.attrs["source"] = source
    check_references(table)
    return table


def check_references(table: pd.DataFrame) -> None:
    """Check a References table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, the kind is unknown, or a kind lacks what it needs.
    """
    source = source_of(table)
    check_columns(table, REFERENCE, source)
    needs = {
        "known": ["time", *EULER],
        "tilt": ["time", "roll", "pitch"],
        "same": ["time", "since"],
        "turns": ["time", "since", "turns"],
    }
    for number, (_, row) in enumerate(table.iterrows(), start=1):
        kind = row["kind"]
        if kind not in needs:
            raise DataError(
                "tables.unknown-kind",
                file=source,
                row=number,
                quantity="kind",
                kind=kind,
                reference_kinds=REFERENCE_KINDS,
            )
        for name in needs[kind]:
            if not np.isfinite(float(row[name])):
                raise DataError(
                    "tables.reference-kind-needs-missing",
                    file=source,
                    row=number,
                    quantity=name,
                    kind=kind,
                    needs=needs[kind],
                )
        if kind == "turns" and row["axis"] not in ("x", "y", "z"):
            raise DataError(
                "tables.axis", file=source, row=number, quantity="axis", at_row=row["axis"]
            )
