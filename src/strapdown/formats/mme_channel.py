"""One channel of an ISO MME test: its header in words, and its samples when they are asked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.crash_record import CrashChannel
from strapdown.formats.crash_text import LONGEST_NAME, clean
from strapdown.formats.crash_units import factor_of, unit_of
from strapdown.formats.mme_codes import DIMENSIONS, NO_CLASS
from strapdown.formats.mme_file import MmeFile, clock_of, stamps_of
from strapdown.formats.mme_text import MmeHeader, read_samples
from strapdown.tables import SAMPLINGS

Array = NDArray[np.float64]

__all__ = ["channel_of", "is_bad"]

#: What the writer of this package says in comments, and no field of the standard does.
SAMPLING_NOTE = "sampling "
AXIS_NOTE = "axis "
CHANGE_NOTE = "change of velocity since time zero of the recorder"
BODY_NOTE = "fixed to "
FILTER_NOTE = "low-pass "
AXES = ("x", "y", "z", "-x", "-y", "-z")
_GOOD = ("ok", "o.k.", "good", "valid", "as measured")
_REMARKS = (
    "location",
    "reference system",
    "transducer type",
    "transducer id",
    "pre-filter type",
    "data source",
    "laboratory channel code",
    "customer channel code",
)


def channel_of(file: MmeFile, name: str, others: Mapping[str, tuple[str, MmeFile]]) -> CrashChannel:
    """Make a channel of a record of it.

    Parameters
    ----------
    file : MmeFile
    name : str
        Unique in the record.
    others : dict of str to (str, MmeFile)
        Channels of the test by their code in capitals, each with its name: a channel may hold the
        stamps of another.

    Returns
    -------
    CrashChannel

    Raises
    ------
    DataError
        A field of the header is no number.
    """
    header, known = file.header, file.known
    text = header.text("unit")
    quantity, unit, factor, against = _unit(file, text)
    notes = header.all("comments")
    change = CHANGE_NOTE in notes
    clock = clock_of(file, others)
    read_stamps = stamps_of(file, clock, others)

    def samples() -> Array:
        values = read_samples(file.path, header, f"channel {name}")
        if quantity == "velocity" and not change and values.size:
            values = values - values[0]
        return values if factor is None else values * factor

    def load() -> tuple[Array, Array]:
        values = samples()
        return values if quantity == "time" else read_stamps(values.size), values

    # Stamps that the header does not tell may be stated by a case.
    open_stamps = (
        bool(clock) or quantity == "time" or _plain_number(header, "sampling interval") is None
    )
    full_scale = _plain_number(header, "channel amplitude class")
    cut_off = _plain_number(header, "cut off frequency")
    return CrashChannel(
        name=name,
        quantity=quantity,
        axis=_note(notes, AXIS_NOTE, AXES) or (known.axis if known else ""),
        unit=unit,
        load=load,
        sampling=_note(notes, SAMPLING_NOTE, SAMPLINGS)
        or ("instantaneous" if quantity in ("acceleration", "rate") else None),
        place=_place(file),
        body=_note(notes, BODY_NOTE) or (known.body if known else "not known"),
        low_pass=_note(notes, FILTER_NOTE) or _low_pass(file, cut_off),
        remarks=_remarks(file, against, notes),
        full_scale=None if full_scale is None else full_scale * (factor or 1.0),
        bandwidth=cut_off if cut_off is not None and cut_off > 0.0 else None,
        file=file.path.name,
        row=lambda k: header.end + k + 1,
        clock=others[clock.upper()][0] if clock else "",
        samples=samples if open_stamps else None,
    )


def _unit(file: MmeFile, text: str) -> tuple[str, str, float | None, str]:
    """Quantity, unit, factor, and what of the code speaks against the unit."""
    said = file.known.quantity if file.known else "other"
    found = unit_of(text) if text else None
    if found is None:
        # Of a quantity whose unit is not stated or not known the values are as recorded.
        return said, clean(text, LONGEST_NAME), None, ""
    quantity, unit = found
    if said in ("other", quantity):
        # A dimension that is known and none of ours, such as an angle, is not made one.
        plain = file.known is not None and file.code[12:14].upper() in DIMENSIONS
        if said == "other" and plain and file.code[12:14] != "00":
            return "other", unit, None, ""
        return quantity, unit, factor_of(quantity, unit), ""
    against = f"its code says {said}, and its unit is one of {quantity}"
    return quantity, unit, factor_of(quantity, unit), against


def _note(notes: list[str], key: str, known: tuple[str, ...] = ()) -> str:
    said = next((n[len(key) :] for n in notes if n.startswith(key)), "")
    return said if not known or said in known else ""


def _place(file: MmeFile) -> str:
    given = file.header.text("name of the channel")
    place = file.known.place if file.known else ""
    return given or place


def _plain_number(header: MmeHeader, key: str) -> float | None:
    """A number of the header that may also be a word there."""
    try:
        return header.number(key)
    except DataError:
        return None


def _low_pass(file: MmeFile, cut_off: float | None) -> str:
    parts = []
    stated = file.header.text("channel frequency class")
    if file.known and file.known.code[-1] != NO_CLASS:
        parts.append(file.known.filter)
    elif stated and file.known is None:
        parts.append(stated if not stated.isdecimal() else f"CFC {stated}")
    if cut_off is not None and cut_off > 0.0:
        parts.append(f"{cut_off:g} Hz before the sampler")
    return "; ".join(parts)


def _remarks(file: MmeFile, against: str, notes: list[str]) -> tuple[str, ...]:
    header, known = file.header, file.known
    remarks = [against] if against else []
    if known is None:
        remarks.append(
            f"'{file.code}' is no channel code of sixteen characters"
            if file.code
            else "it has no channel code"
        )
    else:
        remarks.append(f"{known.test_object}, {known.dimension}, {known.direction}")
        if header.text("name of the channel") and known.place:
            remarks.append(f"place by its code: {known.place}")
        if known.unknown:
            remarks.append(f"not in the tables of codes: {', '.join(known.unknown)}")
        stated = header.text("channel frequency class")
        figures = "".join(c for c in stated if c.isdigit())
        if figures and known.filter.startswith("CFC") and figures not in known.filter.split():
            remarks.append(f"its header says {stated}, and its code {known.filter}")
    if status := header.text("data status"):
        remarks.append(f"status {status}")
    remarks += [f"{key}: {header.text(key)}" for key in _REMARKS if header.text(key)]
    own = (SAMPLING_NOTE, AXIS_NOTE, BODY_NOTE, FILTER_NOTE)
    remarks += [n for n in notes if not n.startswith(own)]
    return tuple(remarks)


def is_bad(file: MmeFile) -> bool:
    """Whether the laboratory gives another status than a good one."""
    status = file.header.text("data status").lower()
    return bool(status) and status not in _GOOD
