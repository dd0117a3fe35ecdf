"""Metadata of a crash channel as plain data, for files that store it beside the samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from strapdown.errors import DataError
from strapdown.formats.crash_record import QUANTITIES, CrashChannel
from strapdown.formats.crash_text import LONGEST_NAME, clean
from strapdown.tables import SAMPLINGS

__all__ = ["attributes_of", "check_attributes"]

_AXES = ("", "x", "y", "z", "-x", "-y", "-z")
_TEXTS = ("name", "quantity", "axis", "unit", "place", "body", "low_pass")
_NUMBERS = ("full_scale", "bandwidth")
MOST_REMARKS = 50


def attributes_of(channel: CrashChannel) -> dict[str, Any]:
    """Return everything of a channel except its samples.

    Parameters
    ----------
    channel : CrashChannel

    Returns
    -------
    dict
        The unit is the SI unit in which the values are written.
    """
    return {
        "name": channel.name,
        "quantity": channel.quantity,
        "axis": channel.axis,
        "unit": QUANTITIES[channel.quantity] or channel.unit,
        "sampling": channel.sampling,
        "place": channel.place,
        "body": channel.body,
        "low_pass": channel.low_pass,
        "remarks": list(channel.remarks),
        "full_scale": channel.full_scale,
        "bandwidth": channel.bandwidth,
    }


def check_attributes(said: object, file: str, row: int | None = None) -> dict[str, Any]:
    """Check the metadata of a channel from a file.

    Parameters
    ----------
    said : object
        As read from the file.
    file : str
    row : int, optional

    Returns
    -------
    dict
        As `attributes_of`; missing entries are empty, texts are cleaned.

    Raises
    ------
    DataError
        The metadata has the wrong structure.
    """
    if not isinstance(said, Mapping):
        raise _bad("a channel", "io.channel-no-table", file, row)
    texts = {}
    for key in _TEXTS:
        value = said.get(key, "")
        if not isinstance(value, str):
            raise _bad(key, "io.channel-no-text", file, row, value=str(value)[:40])
        texts[key] = clean(value, LONGEST_NAME) if key in ("name", "unit") else clean(value)
    numbers = {}
    for key in _NUMBERS:
        value = said.get(key)
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value)):
            raise _bad(key, "io.channel-no-number", file, row, value=str(value)[:40])
        numbers[key] = None if value is None else float(value)
    for key, known in (("quantity", tuple(QUANTITIES)), ("axis", _AXES)):
        if texts[key] not in known:
            raise DataError(
                "io.channel-unknown-word",
                file=file,
                row=row,
                quantity=key,
                key=key,
                word=texts[key],
                known=known,
            )
    remarks = said.get("remarks", [])
    if not isinstance(remarks, list) or not all(isinstance(r, str) for r in remarks):
        raise _bad("remarks", "io.channel-remarks-no-texts", file, row)
    sampling = said.get("sampling")
    if sampling not in (None, *SAMPLINGS):
        raise _bad(
            "sampling", "io.channel-sampling", file, row, value=str(sampling)[:40], known=SAMPLINGS
        )
    return {
        **texts,
        **numbers,
        "sampling": sampling,
        "remarks": tuple(clean(r) for r in remarks[:MOST_REMARKS]),
    }


def _bad(key: str, code: str, file: str, row: int | None, **data: Any) -> DataError:
    return DataError(code, file=file, row=row, quantity=key, key=key, **data)
